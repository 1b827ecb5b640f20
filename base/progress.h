/* progress.h - one line that says how a run is doing; used by run.c only. Rank 0 prints. */
#pragma once
#include "ledger.h"

typedef struct {
  PetscBool      on, terminal;
  PetscReal      every;        /* wall time between lines [s] */
  PetscLogDouble started, shown; /* wall clock [s] */
  PetscInt       first_step;   /* where this call began */
  PetscBool      open;         /* the terminal's line awaits its end */
} Progress;

/* What a line tells. Not known: negative unbalanced. */
typedef struct {
  PetscInt  step, steps;
  PetscReal time;     /* [s] */
  PetscReal elements; /* advanced per step */
  PetscReal unbalanced;
  Ledger    ledger;
} ProgressState;

void      ProgressBegin(Progress *progress, PetscBool on, PetscInt first_step);
PetscBool ProgressDue(const Progress *progress, PetscLogDouble now);
void      ProgressShow(Progress *progress, const ProgressState *state, PetscLogDouble now);
void      ProgressEnd(Progress *progress); /* ends the terminal's line, so that messages start on their own */
