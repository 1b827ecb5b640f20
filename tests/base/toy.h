/* toy.h - a chain of equal masses and springs between two walls, for tests of the run loop: all its answers are known. */
#pragma once
#include "run.h"

typedef struct {
  PetscInt  n;         /* masses of 1 kg, springs of 1 N/m */
  PetscReal *u, *v;    /* [n] displacement [m]; half-step velocity [m/s] (the initial one before the first step) */
  PetscReal drive;     /* force on the last mass is drive sin(0.3 t) [N]; 0 at t = 0 */
  PetscReal t, dt;     /* of the last step */
  PetscReal work, work_in;
  PetscInt  steps;     /* made so far */
  PetscInt  poison;    /* put a NaN in at this step; 0 = never */
  PetscInt  kick;      /* multiply velocities by 1.5 at this step: energy from nowhere */
  PetscInt  fail;      /* the step function fails here */
  PetscInt  sleep;     /* microseconds per step */
  PetscBool hang;      /* the step never returns */
  PetscInt  looks;     /* calls of energy() */
  PetscReal stillness; /* reported unbalanced ratio is stillness / steps; 0 = reports none */
} Toy;

PetscErrorCode ToyCreate(PetscInt n, Toy *toy); /* starts undeformed, with velocities 1e-3 sin^2 */
PetscErrorCode ToySetMode(Toy *toy, PetscInt mode); /* undeformed, velocity 1 mm/s in one mode */
PetscReal      ToyFrequency(const Toy *toy, PetscInt mode); /* omega = 2 sin(pi mode / 2(n + 1)) [rad/s] */
PetscErrorCode ToyDestroy(Toy *toy);
void           ToyGetStepper(Toy *toy, Stepper *stepper);
