/* output_impl.h - what output.c, output_hdf5.c, output_vtu.c and output_history.c share. Rank 0 works; others only learn of errors. */
#pragma once
#include "files.h"
#include "hdf5_file.h"
#include "output.h"
#include <stdint.h>

#define OUTPUT_NAME 128

/* The parts of a block's geometry that are written once and linked while they stay the same. */
typedef enum { OUTPUT_POINTS, OUTPUT_CELL_START, OUTPUT_CELL_NODE, OUTPUT_CELL_TYPE, OUTPUT_GEOMETRY } OutputGeometry;

/* A block as it stands in one frame. */
typedef struct {
  char     name[OUTPUT_NAME];
  PetscInt home[OUTPUT_GEOMETRY]; /* number of the frame whose file holds the data */
  uint64_t hash[OUTPUT_GEOMETRY]; /* of the contents */
} OutputBlockRecord;

typedef struct {
  PetscInt           number; /* in the file names */
  PetscInt           step;
  PetscReal          time; /* [s] */
  PetscInt           n_blocks;
  OutputBlockRecord *block; /* [n_blocks] owned */
} OutputFrame;

struct _p_Output {
  MPI_Comm    comm;
  PetscMPIInt rank;
  char        directory[BASE_LINE];

  PetscBool named; /* OutputSetFieldNames() was called */
  PetscInt  n_fields;
  char    **field; /* [n_fields] */

  PetscInt     n_frames, frame_room;
  OutputFrame *frame; /* [n_frames] those the index names, by number; rank 0 */

  PetscBool   writing; /* between FrameBegin and FrameEnd */
  OutputFrame now;
  hid_t       file; /* of the frame being written, < 0 otherwise; rank 0 */

  FILE    *history; /* rank 0, after the header */
  PetscInt n_columns;
};

PetscErrorCode OutputPath(Output output, char path[BASE_LINE], const char *format, ...); /* DIR/... */

/* Last record of a block in the frames written so far, NULL when it is new. */
const OutputBlockRecord *OutputFindBlock(Output output, const char *name);
PetscErrorCode           OutputAppendFrame(Output output, OutputFrame *frame); /* takes the blocks over */
void                     OutputFreeFrame(OutputFrame *frame);

/* output_hdf5.c */
PetscErrorCode OutputHdf5Begin(Output output);
PetscErrorCode OutputHdf5Block(Output output, const OutputBlock *block, OutputBlockRecord *record);
PetscErrorCode OutputHdf5End(Output output);
PetscErrorCode OutputHdf5Index(Output output); /* rewrite fields.h5 from the list of frames */
PetscErrorCode OutputHdf5Scan(Output output);  /* the list of frames from fields.h5 */

/* output_vtu.c */
PetscErrorCode OutputVtuBlock(Output output, const OutputBlock *block);
PetscErrorCode OutputVtuIndex(Output output, const char *block); /* rewrite BLOCK.pvd; removes it when no frame has the block */

/* output_history.c */
PetscErrorCode OutputHistoryTruncate(Output output, PetscReal time);
