/* run_changes.h - what a resumed run does otherwise than the one that wrote its checkpoint; used by run.c only. Texts are lines "path: value". */
#pragma once
#include "base.h"

/*
  RunStampCheck - does a state of the scene `saved` suit the scene `now`?

  Lines that begin with '~' are loads: they may differ when loads_may_change. All others must be the same.
  Errors: PETSC_ERR_USER_INPUT with the first line that differs
*/
PetscErrorCode RunStampCheck(MPI_Comm comm, const char *file, const char *saved, const char *now, PetscBool loads_may_change);

/* One line "  path: old -> new" for each value that is not the same, or "(not given)" for one that is missing; "" when all are. PetscFree() it. */
PetscErrorCode RunChangesList(const char *before, const char *now, char **list);
