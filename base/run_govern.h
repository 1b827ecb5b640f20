/*
  run_govern.h - a governor between the loop and a model: the load hurries while the body is quiet and waits while it breaks.  Eqs (1.9)-(1.11)

  Explicit steps toward rest take as many steps as the load takes time. Tables with the governor's clock (table.h) are read at a load time whose pace follows how far the
  body is from rest. Steps, masses and laws stay what they are; without a governor nothing is different, nothing is paid.
*/
#pragma once
#include "run.h"

typedef struct {
  PetscReal unbalanced;       /* wanted mean unbalanced over mean force, (1.5); 0: not looked at */
  PetscReal kinetic;          /* wanted kinetic over the largest strain energy so far; 0: not looked at */
  PetscReal loading;          /* wanted growth of the largest strain energy in a response time, over itself; 0: not looked at */
  PetscReal breaking;         /* wanted energy that fracture and friction take in a response time over the largest strain energy so far; 0: not looked at */
  PetscReal slowest, fastest; /* bounds of the pace [-] */
  PetscReal response;         /* of an e-fold of the pace [s] */
} RunGovernOptions;

typedef struct _p_RunGovern *RunGovern;

/* clock: filled here, for tables to point at before the model is set up; both borrowed, and must outlive the governor. */
void           RunGovernClock(const RunGovernOptions *options, TableClock *clock);
PetscErrorCode RunGovernCreate(MPI_Comm comm, const RunGovernOptions *options, const Stepper *inner, TableClock *clock, RunGovern *govern);
PetscErrorCode RunGovernGetStepper(RunGovern govern, Stepper *stepper); /* the inner one's columns, then load_time and load_rate */
PetscErrorCode RunGovernDestroy(RunGovern *govern);
/* One turn of the law, a pure function: the pace h [s] on from `pace`, where the body was `much` of what is wanted at the pace `then`.  Eq. (1.11) */
PetscReal      RunGovernPace(const RunGovernOptions *options, PetscReal then, PetscReal much, PetscReal pace, PetscReal h);
