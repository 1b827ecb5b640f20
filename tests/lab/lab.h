/* lab.h - what the laboratory's tables share: packed specimens, their uniaxial test solved at rest, the same specimen of finite elements. */
#pragma once
#include "check.h"
#include "dem_solve.h"

typedef enum { LAB_BOX, LAB_CYLINDER } LabShape; /* unit width (diameter), height 2, axis z */
extern const char *const LabShapeName[];

typedef struct {
  PetscReal modulus; /* reaction/section over shortening/height, of the Young's modulus given: what a platen feels */
  PetscReal E, nu;   /* of the gauge, the middle half.  Eq. (4.70) */
  PetscInt  iterations;
} LabUniaxial;

/* A specimen by the packing generator. */
PetscErrorCode LabSpecimen(LabShape shape, PetscInt count, PetscInt seed, TestBody *body);

/*
  LabUniaxialSolve - a specimen pressed between smooth or glued platens, E = 1, by conjugate gradients on its own forces

  The discrete equilibrium that slow dynamics tends to. rule NULL: `exact`. The Poisson term of kdem is a load of the
  last stress; it is solved again until the modulus stands still to 1e-6.
*/
PetscErrorCode LabUniaxialSolve(const TestBody *body, const DemRule *rule, PetscReal nu, PetscBool glued, PetscReal rtol, LabUniaxial *result);

/* The same between glued platens, of quadratic finite elements: what the platens do to the modulus, and what a gauge then says. Smooth platens do nothing. */
PetscErrorCode LabGluedFem(LabShape shape, PetscReal nu, PetscReal size, LabUniaxial *result);
