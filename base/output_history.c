/* output_history.c - history.csv: one header, one row per call, each row on disk before the next step. */
#include "output_impl.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* name[unit], quoted as RFC 4180 asks where it holds a comma or a quote. */
static size_t AppendColumn(char *line, size_t room, const char *name, const char *unit)
{
  const PetscBool quote = (PetscBool)(strpbrk(name, ",\"\n") || strpbrk(unit, ",\"\n"));
  const char     *piece[4] = {name, "[", unit, "]"};
  size_t          n = 0;

  if (quote && n + 1 < room) line[n++] = '"';
  for (int k = 0; k < 4; k++)
    for (const char *c = piece[k]; *c && n + 3 < room; c++) {
      if (*c == '"') line[n++] = '"';
      line[n++] = *c == '\n' ? ' ' : *c;
    }
  if (quote && n + 1 < room) line[n++] = '"';
  line[n] = 0;
  return n;
}

/* A history of other columns stays, as history-1.csv (-2, ...); this run's goes on in a file of its own. */
static PetscErrorCode SetAside(Output output, const char *path)
{
  char other[BASE_LINE];

  PetscFunctionBegin;
  for (PetscInt k = 1;; k++) {
    PetscCall(OutputPath(output, other, "history-%" PetscInt_FMT ".csv", k));
    if (access(other, F_OK)) break;
  }
  PetscCall(FileCommit(path, other, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode OpenHistory(Output output, const char *header)
{
  char   path[BASE_LINE];
  char  *text = NULL;
  size_t n    = strlen(header);

  PetscFunctionBegin;
  PetscCall(OutputPath(output, path, "history.csv"));
  if (!access(path, F_OK)) {
    PetscBool same, empty;

    PetscCall(FileReadText(path, &text, NULL));
    empty = (PetscBool)(text[0] == 0);
    same  = (PetscBool)(!strncmp(text, header, n) && text[n] == '\n');
    PetscCall(PetscFree(text));
    if (!same && !empty) PetscCall(SetAside(output, path));
    PetscCall(FileOpen(path, "a", &output->history));
    if (same) PetscFunctionReturn(PETSC_SUCCESS);
  } else PetscCall(FileOpen(path, "w", &output->history));
  fprintf(output->history, "%s\n", header);
  PetscCheck(!fflush(output->history), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "Cannot write '%s' (is the disk full?)", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputHistoryHeader(Output output, PetscInt n, const char *const names[], const char *const units[])
{
  PetscErrorCode code = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCheck(!output->n_columns, output->comm, PETSC_ERR_ORDER, "The header of history.csv is written once");
  PetscCheck(n > 0, output->comm, PETSC_ERR_ARG_OUTOFRANGE, "A history needs at least one column");
  output->n_columns = n;
  if (output->rank == 0) {
    size_t room = 16, used = 0;
    char  *header;

    for (PetscInt k = 0; k < n; k++) room += 2 * (strlen(names[k]) + strlen(units[k])) + 8;
    PetscCall(PetscMalloc1(room, &header));
    for (PetscInt k = 0; k < n; k++) {
      if (k) header[used++] = ',';
      used += AppendColumn(header + used, room - used, names[k], units[k]);
    }
    code = OpenHistory(output, header);
    PetscCall(PetscFree(header));
  }
  PetscCall(FileShareError(output->comm, code, "begin history.csv"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteRow(Output output, PetscInt n, const PetscReal values[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) fprintf(output->history, "%s%.12g", k ? "," : "", (double)values[k]);
  fputc('\n', output->history);
  PetscCheck(!fflush(output->history), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "Cannot write '%s/history.csv' (is the disk full?)", output->directory);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputHistoryRow(Output output, PetscInt n, const PetscReal values[])
{
  PetscErrorCode code = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCheck(n == output->n_columns, output->comm, PETSC_ERR_ARG_SIZ, "The row has %" PetscInt_FMT " values, the header of history.csv %" PetscInt_FMT, n, output->n_columns);
  if (output->rank == 0) code = WriteRow(output, n, values);
  PetscCall(FileShareError(output->comm, code, "write a row of history.csv"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows carry 12 digits, so the bound is rounded the same way before the two are compared. A row cut by a kill goes too. */
PetscErrorCode OutputHistoryTruncate(Output output, PetscReal time)
{
  char   path[BASE_LINE], part[BASE_LINE], bound[64];
  char  *text, *line, *end;
  FILE  *file;
  double last;

  PetscFunctionBegin;
  PetscCall(OutputPath(output, path, "history.csv"));
  PetscCall(OutputPath(output, part, "history.csv.part"));
  if (access(path, F_OK)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BaseFormat(bound, "%.12g", (double)time));
  last = strtod(bound, NULL);
  PetscCall(FileReadText(path, &text, NULL));
  PetscCall(FileOpen(part, "w", &file));
  for (line = text; (end = strchr(line, '\n')); line = end + 1) {
    if (line != text && strtod(line, NULL) > last) break; /* the first line is the header */
    fwrite(line, 1, (size_t)(end + 1 - line), file);
  }
  PetscCall(PetscFree(text));
  PetscCall(FileClose(&file, part));
  PetscCall(FileCommit(part, path, PETSC_FALSE));
  if (output->history) {
    fclose(output->history);
    output->history = NULL;
    PetscCall(FileOpen(path, "a", &output->history));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
