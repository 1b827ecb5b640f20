/* run_toy.c - see run_toy.h. */
#include "run_toy.h"
#include "files.h"
#include <dirent.h>
#include <stdlib.h>
#include <unistd.h>

PetscErrorCode RunToy(const char *directory, Toy *toy, const RunOptions *options, RunSummary *summary)
{
  Output         output;
  Stepper        stepper;
  RunSummary     own;
  PetscErrorCode code;

  PetscFunctionBeginUser;
  PetscCall(OutputCreate(PETSC_COMM_WORLD, directory, options->resume, &output));
  ToyGetStepper(toy, &stepper);
  code = RunLoop(PETSC_COMM_WORLD, &stepper, options, output, summary ? summary : &own);
  if (!summary) PetscCall(RunSummaryDestroy(&own));
  PetscCall(OutputDestroy(&output));
  PetscFunctionReturn(code);
}

static void SameFile(const char *a, const char *b)
{
  char  *x, *y;
  size_t nx, ny, k = 0;

  if (access(a, F_OK) || access(b, F_OK)) fail_msg("only one of '%s' and '%s' is there", a, b);
  assert_int_equal(FileReadText(a, &x, &nx), 0);
  assert_int_equal(FileReadText(b, &y, &ny), 0);
  while (k < nx && k < ny && x[k] == y[k]) k++;
  if (nx != ny || k != nx) fail_msg("'%s' (%zu bytes) and '%s' (%zu) differ from byte %zu on", a, nx, b, ny, k);
  PetscFree(x);
  PetscFree(y);
}

/* Every regular file of a has its twin in b. checkpoint.h5 too: it holds no clock. */
static void SameFolder(const char *a, const char *b)
{
  DIR           *directory = opendir(a);
  struct dirent *entry;

  if (!directory) fail_msg("'%s' is not there", a);
  while ((entry = readdir(directory))) {
    char x[BASE_LINE], y[BASE_LINE];

    if (entry->d_type != DT_REG) continue;
    snprintf(x, sizeof(x), "%s/%s", a, entry->d_name);
    snprintf(y, sizeof(y), "%s/%s", b, entry->d_name);
    SameFile(x, y);
  }
  closedir(directory);
}

PetscErrorCode SameFiles(const char *a, const char *b)
{
  static const char *const folders[] = {"", "fields", "vtu"};

  for (int k = 0; k < 3; k++) {
    char x[BASE_LINE], y[BASE_LINE];

    snprintf(x, sizeof(x), "%s/%s", a, folders[k]);
    snprintf(y, sizeof(y), "%s/%s", b, folders[k]);
    SameFolder(x, y);
    SameFolder(y, x);
  }
  return PETSC_SUCCESS;
}

PetscInt CountRows(const char *directory)
{
  char     path[BASE_LINE], *text;
  PetscInt n = 0;

  snprintf(path, sizeof(path), "%s/history.csv", directory);
  if (access(path, F_OK) || FileReadText(path, &text, NULL)) return 0;
  for (const char *c = text; *c; c++) n += *c == '\n';
  PetscFree(text);
  return PetscMax(n - 1, 0);
}

PetscReal *ReadColumn(const char *directory, PetscInt column, PetscInt *n)
{
  const PetscInt rows = CountRows(directory);
  char           path[BASE_LINE], *text, *line;
  PetscReal     *value;

  snprintf(path, sizeof(path), "%s/history.csv", directory);
  assert_int_equal(FileReadText(path, &text, NULL), 0);
  assert_int_equal(PetscMalloc1(rows + 1, &value), 0);
  line = strchr(text, '\n') + 1;
  for (PetscInt r = 0; r < rows; r++) {
    const char *cell = line;

    for (PetscInt c = 0; c < column; c++) cell = strchr(cell, ',') + 1;
    value[r] = strtod(cell, NULL);
    line     = strchr(line, '\n') + 1;
  }
  PetscFree(text);
  *n = rows;
  return value;
}

PetscInt CountFrames(const char *directory)
{
  char           path[BASE_LINE];
  DIR           *folder;
  struct dirent *entry;
  PetscInt       n = 0;

  snprintf(path, sizeof(path), "%s/fields", directory);
  folder = opendir(path);
  while (folder && (entry = readdir(folder))) {
    const size_t length = strlen(entry->d_name);

    n += length > 3 && !strcmp(entry->d_name + length - 3, ".h5");
  }
  if (folder) closedir(folder);
  return n;
}

void ReadFrames(const char *directory, PetscBool killed)
{
  char command[2 * BASE_LINE];

  snprintf(command, sizeof(command), "'%s' '%s' '%s' %s", CLEAVE_PYTHON, READ_FRAMES, directory, killed ? "--killed" : "");
  if (system(command)) fail_msg("'%s' failed", command);
}
