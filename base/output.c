/*
  output.c - one directory: what is in it, what a frame is, what stays when a run starts over or goes on.

  Order of writing a frame: its VTU files, its HDF5 file, the index fields.h5, the indices BLOCK.pvd. Each is written
  under another name and renamed, so at any instant the indices name only whole files. docs/output.md describes the layout.
*/
#include "output_impl.h"
#include <dirent.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

PetscErrorCode OutputPath(Output output, char path[BASE_LINE], const char *format, ...)
{
  va_list arguments;
  int     length = snprintf(path, BASE_LINE, "%s/", output->directory);

  PetscFunctionBegin;
  va_start(arguments, format);
  length += vsnprintf(path + length, (size_t)(BASE_LINE - length), format, arguments);
  va_end(arguments);
  BaseCheckInput(length < BASE_LINE, PETSC_COMM_SELF, "The path of a file in '%s' is longer than %d characters; choose a shorter directory", output->directory, BASE_LINE - 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

const OutputBlockRecord *OutputFindBlock(Output output, const char *name)
{
  for (PetscInt f = output->n_frames - 1; f >= 0; f--)
    for (PetscInt b = 0; b < output->frame[f].n_blocks; b++)
      if (!strcmp(output->frame[f].block[b].name, name)) return &output->frame[f].block[b];
  return NULL;
}

void OutputFreeFrame(OutputFrame *frame)
{
  free(frame->block);
  memset(frame, 0, sizeof(*frame));
}

PetscErrorCode OutputAppendFrame(Output output, OutputFrame *frame)
{
  PetscFunctionBegin;
  if (output->n_frames == output->frame_room) {
    OutputFrame *grown = realloc(output->frame, sizeof(*grown) * (size_t)(2 * output->frame_room + 16));

    PetscCheck(grown, PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for the list of frames");
    output->frame      = grown;
    output->frame_room = 2 * output->frame_room + 16;
  }
  output->frame[output->n_frames++] = *frame;
  memset(frame, 0, sizeof(*frame));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number in "000012.h5" or "beam_000012.vtu", -1 where the name is not one of ours. */
static PetscInt FrameNumber(const char *file, const char *ending)
{
  const char *dot   = strrchr(file, '.');
  const char *digit = dot;

  if (!dot || strcmp(dot, ending)) return -1;
  while (digit > file && digit[-1] >= '0' && digit[-1] <= '9') digit--;
  if (dot - digit < 6 || dot - digit > 9) return -1;
  if (digit > file && digit[-1] != '_') return -1;
  return (PetscInt)atol(digit);
}

static PetscBool IsIndexed(Output output, PetscInt number)
{
  for (PetscInt f = output->n_frames - 1; f >= 0; f--)
    if (output->frame[f].number == number) return PETSC_TRUE;
  return PETSC_FALSE;
}

/* Remove frame files that no index names, and unfinished ones. folder is "fields" or "vtu". */
static PetscErrorCode RemoveStrays(Output output, const char *folder, const char *ending)
{
  char           path[BASE_LINE];
  DIR           *directory;
  struct dirent *entry;

  PetscFunctionBegin;
  PetscCall(OutputPath(output, path, "%s", folder));
  directory = opendir(path);
  if (!directory) PetscFunctionReturn(PETSC_SUCCESS);
  while ((entry = readdir(directory))) {
    char           name[BASE_LINE];
    PetscInt       number;
    const size_t   length = strlen(entry->d_name);
    const PetscBool part  = (PetscBool)(length > 5 && !strcmp(entry->d_name + length - 5, ".part"));

    PetscCall(BaseFormat(name, "%s", entry->d_name));
    if (part) name[length - 5] = 0;
    number = FrameNumber(name, ending);
    if (number < 0 || (!part && IsIndexed(output, number))) continue;
    PetscCall(OutputPath(output, path, "%s/%s", folder, entry->d_name));
    unlink(path);
  }
  closedir(directory);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* BLOCK.pvd of an earlier run; others' .pvd files lack our mark and stay. */
static PetscErrorCode RemoveIndices(Output output)
{
  DIR           *directory = opendir(output->directory);
  struct dirent *entry;

  PetscFunctionBegin;
  while (directory && (entry = readdir(directory))) {
    char        path[BASE_LINE], head[256] = "";
    const char *dot = strrchr(entry->d_name, '.');
    FILE       *file;
    size_t      n = 0;

    if (!dot || strcmp(dot, ".pvd")) continue;
    PetscCall(OutputPath(output, path, "%s", entry->d_name));
    file = FileUnfit(path) ? NULL : fopen(path, "r");
    if (file) {
      n = fread(head, 1, sizeof(head) - 1, file);
      fclose(file);
    }
    head[n] = 0;
    if (strstr(head, "<!-- cleave -->")) unlink(path);
  }
  if (directory) closedir(directory);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Indices first, so that what they name is there as long as they are. */
static PetscErrorCode RemoveEarlierRun(Output output)
{
  static const char *const files[] = {"fields.h5", "history.csv", "checkpoint.h5", "checkpoint.h5.part", "summary.json", "cracks.csv", "fields.h5.part", "history.csv.part", "summary.json.part", "fragments.csv", "switches.csv"};
  char                     path[BASE_LINE];

  PetscFunctionBegin;
  PetscCall(RemoveIndices(output));
  for (size_t k = 0; k < sizeof(files) / sizeof(files[0]); k++) {
    PetscCall(OutputPath(output, path, "%s", files[k]));
    unlink(path);
  }
  for (PetscInt k = 1;; k++) {
    PetscCall(OutputPath(output, path, "history-%" PetscInt_FMT ".csv", k));
    if (unlink(path)) break;
  }
  PetscCall(RemoveStrays(output, "fields", ".h5"));
  PetscCall(RemoveStrays(output, "vtu", ".vtu"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Prepare(Output output, PetscBool resume)
{
  char path[BASE_LINE];

  PetscFunctionBegin;
  PetscCall(FileMakeDirectory(output->directory));
  PetscCall(OutputPath(output, path, "fields"));
  PetscCall(FileMakeDirectory(path));
  PetscCall(OutputPath(output, path, "vtu"));
  PetscCall(FileMakeDirectory(path));
  if (resume) PetscCall(OutputHdf5Scan(output));
  else PetscCall(RemoveEarlierRun(output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputCreate(MPI_Comm comm, const char *directory, PetscBool resume, Output *output)
{
  Output         o;
  PetscErrorCode code = PETSC_SUCCESS;
  size_t         length;

  PetscFunctionBegin;
  *output = NULL;
  length  = directory ? strlen(directory) : 0;
  BaseCheckInput(length > 0 && length < BASE_LINE - 256, comm, "The output directory needs a name of 1 to %d characters", BASE_LINE - 257);
  PetscCall(PetscNew(&o));
  o->comm = comm;
  o->file = -1;
  PetscCallMPI(MPI_Comm_rank(comm, &o->rank));
  PetscCall(BaseFormat(o->directory, "%s", directory));
  while (length > 1 && o->directory[length - 1] == '/') o->directory[--length] = 0;
  if (o->rank == 0) code = Prepare(o, resume);
  if (code) (void)OutputDestroy(&o);
  PetscCall(FileShareError(comm, code, "prepare the output directory"));
  *output = o;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Drop the frame being written, if any. */
static void AbandonFrame(Output o)
{
  char path[BASE_LINE];

  if (o->file >= 0) {
    H5Fclose(o->file);
    o->file = -1;
    if (!OutputPath(o, path, "fields/%06" PetscInt_FMT ".h5.part", o->now.number)) unlink(path);
    for (PetscInt b = 0; b < o->now.n_blocks; b++)
      if (!OutputPath(o, path, "vtu/%s_%06" PetscInt_FMT ".vtu", o->now.block[b].name, o->now.number)) unlink(path);
  }
  OutputFreeFrame(&o->now);
  o->writing = PETSC_FALSE;
}

PetscErrorCode OutputDestroy(Output *output)
{
  Output o = *output;

  PetscFunctionBegin;
  if (!o) PetscFunctionReturn(PETSC_SUCCESS);
  AbandonFrame(o);
  if (o->history) fclose(o->history); /* every row was flushed and checked */
  for (PetscInt f = 0; f < o->n_frames; f++) OutputFreeFrame(&o->frame[f]);
  free(o->frame);
  for (PetscInt k = 0; k < o->n_fields; k++) PetscCall(PetscFree(o->field[k]));
  PetscCall(PetscFree(o->field));
  PetscCall(PetscFree(*output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const char *OutputDirectory(Output output)
{
  return output->directory;
}

PetscErrorCode OutputSetFieldNames(Output output, PetscInt n, const char *const names[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < output->n_fields; k++) PetscCall(PetscFree(output->field[k]));
  PetscCall(PetscFree(output->field));
  PetscCall(PetscMalloc1(PetscMax(n, 1), &output->field));
  for (PetscInt k = 0; k < n; k++) PetscCall(PetscStrallocpy(names[k], &output->field[k]));
  output->n_fields = n;
  output->named    = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool OutputWants(Output output, const char *field)
{
  if (!output->named) return PETSC_TRUE;
  for (PetscInt k = 0; k < output->n_fields; k++)
    if (!strcmp(output->field[k], field)) return PETSC_TRUE;
  return PETSC_FALSE;
}

PetscErrorCode OutputFrameBegin(Output output, PetscReal time, PetscInt step)
{
  PetscErrorCode code = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCheck(!output->writing, output->comm, PETSC_ERR_ORDER, "A frame is open already; call OutputFrameEnd() first");
  output->now.time   = time;
  output->now.step   = step;
  output->now.number = output->n_frames ? output->frame[output->n_frames - 1].number + 1 : 0;
  output->writing    = PETSC_TRUE;
  if (output->rank == 0) code = OutputHdf5Begin(output);
  PetscCall(FileShareError(output->comm, code, "begin a frame"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A name that is both a file's and an HDF5 group's. */
static PetscErrorCode CheckName(const char *name, const char *of)
{
  PetscBool good = (PetscBool)(name && name[0] && name[0] != '.' && strlen(name) < OUTPUT_NAME);

  PetscFunctionBegin;
  for (const char *c = name; good && *c; c++) good = (PetscBool)(*c != '/' && *c != '\\' && (unsigned char)*c >= ' ');
  BaseCheckInput(good, PETSC_COMM_SELF, "'%s' cannot name %s in the output: 1 to %d characters, no '/' or '\\', not starting with '.'", name ? name : "", of, OUTPUT_NAME - 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckBlock(Output output, const OutputBlock *block)
{
  PetscFunctionBegin;
  PetscCall(CheckName(block->name, "a block"));
  for (PetscInt b = 0; b < output->now.n_blocks; b++)
    PetscCheck(strcmp(output->now.block[b].name, block->name), PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "Block '%s' is twice in one frame", block->name);
  PetscCheck(block->n_points >= 0 && block->n_cells >= 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "Block '%s': negative counts", block->name);
  if (block->n_cells) {
    PetscInt bad = -1;

    PetscCheck(block->start[0] == 0, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "Block '%s': start[0] must be 0", block->name);
    for (PetscInt c = 0; c < block->n_cells && bad < 0; c++) {
      if (block->start[c + 1] < block->start[c]) bad = c;
      for (PetscInt k = block->start[c]; k < block->start[c + 1] && bad < 0; k++)
        if (block->node[k] < 0 || block->node[k] >= block->n_points) bad = c;
    }
    PetscCheck(bad < 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "Block '%s': cell %" PetscInt_FMT " names a point that is not there", block->name, bad);
  }
  for (PetscInt a = 0; a < block->n_arrays; a++) {
    PetscCall(CheckName(block->array[a].name, "an array"));
    PetscCheck(block->array[a].components > 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "Array '%s' of block '%s' has no components", block->array[a].name, block->name);
    for (PetscInt b = 0; b < a; b++)
      PetscCheck(block->array[a].place != block->array[b].place || strcmp(block->array[a].name, block->array[b].name), PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
                 "Array '%s' is twice in block '%s'", block->array[a].name, block->name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteBlock(Output output, const OutputBlock *block)
{
  OutputFrame       *now = &output->now;
  OutputBlockRecord *grown;

  PetscFunctionBegin;
  PetscCall(CheckBlock(output, block));
  grown = realloc(now->block, sizeof(*grown) * (size_t)(now->n_blocks + 1));
  PetscCheck(grown, PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for block '%s'", block->name);
  now->block = grown;
  memset(&grown[now->n_blocks], 0, sizeof(*grown));
  strcpy(grown[now->n_blocks].name, block->name);
  now->n_blocks++;
  PetscCall(OutputHdf5Block(output, block, &grown[now->n_blocks - 1]));
  PetscCall(OutputVtuBlock(output, block));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputFrameBlock(Output output, const OutputBlock *block)
{
  PetscErrorCode code = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCheck(output->writing, output->comm, PETSC_ERR_ORDER, "No frame is open; call OutputFrameBegin() first");
  if (output->rank == 0) code = WriteBlock(output, block);
  PetscCall(FileShareError(output->comm, code, "write a block of the frame"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode EndFrame(Output output)
{
  const OutputFrame *last;

  PetscFunctionBegin;
  PetscCall(OutputHdf5End(output));
  PetscCall(OutputAppendFrame(output, &output->now));
  PetscCall(OutputHdf5Index(output));
  last = &output->frame[output->n_frames - 1];
  for (PetscInt b = 0; b < last->n_blocks; b++) PetscCall(OutputVtuIndex(output, last->block[b].name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputFrameEnd(Output output)
{
  PetscErrorCode code = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCheck(output->writing, output->comm, PETSC_ERR_ORDER, "No frame is open; call OutputFrameBegin() first");
  if (output->rank == 0) code = EndFrame(output);
  output->writing = PETSC_FALSE;
  PetscCall(FileShareError(output->comm, code, "end the frame"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The index shrinks before the files go. Every .pvd is made anew: a kill may have come between fields.h5 and them. */
static PetscErrorCode TruncateFrames(Output output, PetscReal time)
{
  PetscInt     keep = 0, n_before = output->n_frames;
  OutputFrame *frame = output->frame;

  PetscFunctionBegin;
  while (keep < output->n_frames && frame[keep].time <= time) keep++;
  output->n_frames = keep;
  PetscCall(OutputHdf5Index(output));
  for (PetscInt f = 0; f < n_before; f++)
    for (PetscInt b = 0; b < frame[f].n_blocks; b++) {
      PetscBool seen = PETSC_FALSE;

      if (f > 0) /* most frames hold the blocks of the one before, whose index is made already */
        for (PetscInt k = 0; k < frame[f - 1].n_blocks; k++) seen = (PetscBool)(seen || !strcmp(frame[f - 1].block[k].name, frame[f].block[b].name));
      if (!seen) PetscCall(OutputVtuIndex(output, frame[f].block[b].name));
    }
  for (PetscInt f = keep; f < n_before; f++) OutputFreeFrame(&frame[f]);
  PetscCall(RemoveStrays(output, "fields", ".h5"));
  PetscCall(RemoveStrays(output, "vtu", ".vtu"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputTruncateFrames(Output output, PetscReal time)
{
  PetscErrorCode code = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCheck(!output->writing, output->comm, PETSC_ERR_ORDER, "A frame is open; call OutputFrameEnd() first");
  if (output->rank == 0) code = TruncateFrames(output, time);
  PetscCall(FileShareError(output->comm, code, "shorten the list of frames"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputTruncateHistory(Output output, PetscReal time)
{
  PetscErrorCode code = PETSC_SUCCESS;

  PetscFunctionBegin;
  if (output->rank == 0) code = OutputHistoryTruncate(output, time);
  PetscCall(FileShareError(output->comm, code, "shorten history.csv"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputTruncate(Output output, PetscReal time)
{
  PetscFunctionBegin;
  PetscCall(OutputTruncateFrames(output, time));
  PetscCall(OutputTruncateHistory(output, time));
  PetscFunctionReturn(PETSC_SUCCESS);
}
