/* base.c - start-up, and one error handler that speaks to people. */
#include "base.h"
#include "hdf5_file.h"
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

static char      message[BASE_LINE];
static char      reports[8 * BASE_LINE];
static PetscBool quiet, allocating;

/* PETSc calls this once where the error starts (kind INITIAL) and once per frame above it (REPEAT). */
static PetscErrorCode HandleError(MPI_Comm comm, int line, const char *function, const char *file, PetscErrorCode code, PetscErrorType kind, const char *text, void *ctx)
{
  if (allocating) return code; /* told by Malloc() */
  if (kind == PETSC_ERROR_INITIAL) {
    PetscMPIInt rank = 0;
    const char *what = text && text[0] ? text : "an error without a message";

    if (!message[0]) {
      strncpy(message, what, sizeof(message) - 1);
      message[sizeof(message) - 1] = 0;
    }
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    if (!quiet && !getenv("CLEAVE_TRACE") && !(what[0] && strstr(reports, what)) && (rank == 0 || comm == PETSC_COMM_SELF)) {
      if (code == PETSC_ERR_USER_INPUT) fprintf(stderr, "cleave: %s\n", what);
      else fprintf(stderr, "cleave: %s  [%s, %s:%d, code %d; CLEAVE_TRACE=1 shows the calls]\n", what, function, file, line, (int)code);
    }
  }
  if (getenv("CLEAVE_TRACE") && !quiet) return PetscTraceBackErrorHandler(comm, line, function, file, code, kind, text, ctx);
  return code;
}

/*
  PETSc 3.18's own allocator, when there is no memory, raises an error whose code is the caller's line and whose words are
  its name; a line 88 would be bad input. These two ask it and, where it fails, say what is true.
*/
static PetscErrorCode (*next_malloc)(size_t, PetscBool, int, const char[], const char[], void **);
static PetscErrorCode (*next_realloc)(size_t, int, const char[], const char[], void **);

static PetscErrorCode Malloc(size_t size, PetscBool clear, int line, const char function[], const char file[], void **result)
{
  PetscErrorCode code;

  allocating = PETSC_TRUE;
  code       = next_malloc(size, clear, line, function, file, result);
  allocating = PETSC_FALSE;
  if (!code) return PETSC_SUCCESS;
  return PetscError(PETSC_COMM_SELF, line, function, file, PETSC_ERR_MEM, PETSC_ERROR_INITIAL, "No memory: %.6g MB more were refused", (double)size * 1e-6);
}

static PetscErrorCode Realloc(size_t size, int line, const char function[], const char file[], void **result)
{
  PetscErrorCode code;

  allocating = PETSC_TRUE;
  code       = next_realloc(size, line, function, file, result);
  allocating = PETSC_FALSE;
  if (!code) return PETSC_SUCCESS;
  return PetscError(PETSC_COMM_SELF, line, function, file, PETSC_ERR_MEM, PETSC_ERROR_INITIAL, "No memory: %.6g MB in place of less were refused", (double)size * 1e-6);
}

PetscErrorCode BaseInitialize(int *argc, char ***argv)
{
  PetscErrorCode code;

  Hdf5Quiet(); /* before anybody else calls HDF5 */
  setenv("OPENBLAS_NUM_THREADS", "1", 0); /* BLAS threads would fight ours for the cores */
  code = PetscInitialize(argc, argv, NULL, NULL);
  if (code) return code;
  PetscFunctionBegin;
  PetscCall(PetscPopSignalHandler()); /* Ctrl-C is the run loop's */
  PetscCall(PetscPushErrorHandler(HandleError, NULL));
  next_malloc    = PetscTrMalloc;
  next_realloc   = PetscTrRealloc;
  PetscTrMalloc  = Malloc;
  PetscTrRealloc = Realloc;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode BaseFinalize(void)
{
  PetscTrMalloc  = next_malloc;
  PetscTrRealloc = next_realloc;
  PetscPopErrorHandler();
  return PetscFinalize();
}

const char *BaseErrorMessage(void)
{
  return message;
}

void BaseErrorClear(void)
{
  message[0] = 0;
  reports[0] = 0;
}

void BaseReport(MPI_Comm comm, const char *line)
{
  const size_t used = strlen(reports);
  PetscMPIInt  rank = 0;

  if (!message[0]) snprintf(message, sizeof(message), "%s", line);
  snprintf(reports + used, sizeof(reports) - used, "%s\n", line);
  MPI_Comm_rank(comm, &rank);
  if (!quiet && rank == 0) fprintf(stderr, "%s\n", line);
}

const char *BaseReports(void)
{
  return reports;
}

void BaseErrorQuiet(PetscBool on)
{
  quiet = on;
}

/* Levenshtein distance with adjacent transposition, cut at the words' length. */
static PetscInt EditDistance(const char *a, const char *b)
{
  const PetscInt na = (PetscInt)strlen(a), nb = (PetscInt)strlen(b);
  PetscInt       row[3][128];

  if (na > 100 || nb > 100) return 1000;
  for (PetscInt j = 0; j <= nb; j++) row[1][j] = j;
  for (PetscInt i = 1; i <= na; i++) {
    PetscInt *before = row[(i + 2) % 3], *last = row[i % 3], *now = row[(i + 1) % 3];

    now[0] = i;
    for (PetscInt j = 1; j <= nb; j++) {
      const PetscInt change = last[j - 1] + (a[i - 1] != b[j - 1]);

      now[j] = PetscMin(change, PetscMin(last[j], now[j - 1]) + 1);
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) now[j] = PetscMin(now[j], before[j - 2] + 1);
    }
  }
  return row[(na + 1) % 3][nb];
}

const char *BaseNearest(const char *word, PetscInt n, const char *const names[])
{
  const char *best  = NULL;
  PetscInt    n_word = (PetscInt)strlen(word), least = PetscMin(1 + n_word / 3, n_word - 1); /* not all of it wrong */

  for (PetscInt k = 0; k < n; k++) {
    const PetscInt distance = EditDistance(word, names[k]);

    if (distance < least || (distance == least && !best)) {
      least = distance;
      best  = names[k];
    }
  }
  return best;
}
