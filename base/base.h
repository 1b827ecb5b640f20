/* base.h - what every module shares: PETSc, the two facts about 3.18 we mend, and how errors reach people. */
#pragma once
#include <petscsys.h>

#if !defined(PETSC_SUCCESS)
  #define PETSC_SUCCESS 0 /* PETSc 3.19 names it; 3.18 does not */
#endif

#if defined(CLEAVE_DEBUG)
  #define BASE_DEBUG 1
#else
  #define BASE_DEBUG 0
#endif

/* Longest path, name or message line we keep. */
#define BASE_LINE 4096

/*
  Errors in two kinds. PETSC_ERR_USER_INPUT: the input is wrong, and the message names the place and the cure;
  `cleave` exits with 2. Any other code: the run failed; `cleave` exits with 1.
*/
#define BaseCheckInput(cond, comm, ...) PetscCheck(cond, comm, PETSC_ERR_USER_INPUT, __VA_ARGS__)

/* Printf into a caller's buffer of known size; a message that does not fit is cut, never overrun. */
#define BaseFormat(buffer, ...) PetscSNPrintf(buffer, sizeof(buffer), __VA_ARGS__)

/*
  BaseInitialize - PETSc and our error handler: one plain line on stderr (rank 0) instead of a trace;
  CLEAVE_TRACE=1 in the environment brings the trace back. Call once, before anything else.
  BaseFinalize - the counterpart.
*/
PetscErrorCode BaseInitialize(int *argc, char ***argv);
PetscErrorCode BaseFinalize(void);

/* The first message an error carried since start-up or BaseErrorClear(); "" when none. Quiet: record, do not print. Tests use these. */
const char *BaseErrorMessage(void);
void        BaseErrorClear(void);
void        BaseErrorQuiet(PetscBool quiet);

/* Say a fault of the input at once: one line on stderr (rank 0 of comm), remembered; the handler will not say it again.
   BaseReports: all lines since BaseErrorClear(), each ended by a newline. */
void        BaseReport(MPI_Comm comm, const char *line);
const char *BaseReports(void);

/* Nearest of n names to a misspelt one by edit distance; NULL when none is near enough to suggest. */
const char *BaseNearest(const char *word, PetscInt n, const char *const names[]);
