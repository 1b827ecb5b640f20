/*
  output.h - frames for ParaView and HDF5, the history, one directory.

  A frame is a set of blocks ("beam", "particles", "bonds", "cracks"); each block is points, cells and named arrays.
  fields.h5 holds the data once per frame, NAME.pvd with VTU files what ParaView opens. docs/output.md has the layout.
*/
#pragma once
#include "base.h"

typedef struct _p_Output *Output;

typedef enum { OUTPUT_POINT_DATA, OUTPUT_CELL_DATA } OutputPlace;

/* One array on loan until OutputFrameEnd. data [n][components]. Ranks other than 0 pass n = 0: models gather. */
typedef struct {
  const char      *name; /* "displacement" */
  const char      *unit; /* "m" */
  OutputPlace      place;
  PetscInt         components;
  const PetscReal *data;
} OutputArray;

typedef struct {
  const char      *name; /* of the block */
  PetscInt         n_points;
  const PetscReal *x; /* [n_points][3] [m], undeformed */
  PetscInt         n_cells;
  const PetscInt  *start;    /* [n_cells + 1] */
  const PetscInt  *node;     /* [start[n_cells]] VTK's order within a cell */
  const unsigned char *type; /* [n_cells] VTK cell type; 1 vertex, 3 line, 5 triangle, 7 polygon, 9 quad, 10 tet, 12 hex */
  PetscInt         n_arrays;
  const OutputArray *array;
} OutputBlock;

/* Create the directory (parents too). resume keeps what is there; otherwise what an earlier run wrote is removed. */
PetscErrorCode OutputCreate(MPI_Comm comm, const char *directory, PetscBool resume, Output *output);
PetscErrorCode OutputDestroy(Output *output);
const char    *OutputDirectory(Output output);

/* Ask before computing a field: only named fields are made. Before any are named, all are wanted. */
PetscErrorCode OutputSetFieldNames(Output output, PetscInt n, const char *const names[]);
PetscBool      OutputWants(Output output, const char *field);

PetscErrorCode OutputFrameBegin(Output output, PetscReal time, PetscInt step);
PetscErrorCode OutputFrameBlock(Output output, const OutputBlock *block);
PetscErrorCode OutputFrameEnd(Output output); /* the index files are valid after each frame */

/* history.csv: header once, a row per call, flushed. */
PetscErrorCode OutputHistoryHeader(Output output, PetscInt n, const char *const names[], const char *const units[]);
PetscErrorCode OutputHistoryRow(Output output, PetscInt n, const PetscReal values[]);

/* On resume: forget frames and history rows after `time`. */
PetscErrorCode OutputTruncate(Output output, PetscReal time);
PetscErrorCode OutputTruncateFrames(Output output, PetscReal time);  /* one without the other, for a last frame or row */
PetscErrorCode OutputTruncateHistory(Output output, PetscReal time); /* that a longer run would not have written */
