/* dem_solve.h - what the bond tests share: random packings that no generator made, and static equilibrium by conjugate gradients. */
#pragma once
#include "dem.h"

typedef struct {
  DemBody    body;
  DemPacking packing;
  DemCells   cells;
} TestBody;

/* Uniform in [0, 1), splitmix64. */
PetscReal TestRandom(uint64_t *state);

/* About n^dim particles per unit volume in a box [0, size], by random sequential addition (scattered radii) or, jitter > 0, on a jittered lattice. */
PetscErrorCode TestBodyCreate(PetscInt dim, const PetscReal size[3], PetscReal n, PetscReal jitter, uint64_t seed, TestBody *body);
PetscErrorCode TestBodyDestroy(TestBody *body);
PetscErrorCode TestModelCreate(const TestBody *body, DemKind kind, PetscReal young, PetscReal poisson, DemModel *model); /* density 1; not set up yet */

/* Unknowns: displacement then rotation vector, component-major [dim + nrot][n]. Small: (R - I) r = theta x r to 1e-16. */
PetscInt       TestUnknowns(DemModel model);
PetscErrorCode TestSetState(DemModel model, const PetscReal *x);
PetscErrorCode TestGetForce(DemModel model, PetscReal *f); /* force and couple, same layout */

/* Equilibrium of the loads that act now, by preconditioned CG from x (in/out) to a residual of rtol x loads; free rigid modes are left as they are. */
PetscErrorCode TestEquilibrium(DemModel model, PetscReal rtol, PetscReal *x, PetscInt *iterations);

/* Remove from x the rigid motion that fits it best, by displacement. */
PetscErrorCode TestRemoveRigid(DemModel model, PetscReal *x);

/* The rank's own particles are those of the whole body on one rank, to the last bit. */
PetscErrorCode TestSameState(DemModel part, DemModel whole);
/* Steps from .. to of safety x critical. */
PetscErrorCode TestSteps(DemModel model, PetscReal safety, PetscInt from, PetscInt to);
/* The same; every so many steps the body is shared out among the ranks anew, piece after piece to the next rank, with another first one each time. */
PetscErrorCode TestStepsMigrating(DemModel model, PetscReal safety, PetscInt from, PetscInt to, PetscInt every);
/* The energies of both, sums in another order: to 1e-12 of the largest. Returns both ledgers. */
PetscErrorCode TestSameEnergies(DemModel part, DemModel whole, Ledger *of_part, Ledger *of_whole);
