/* dem_pack_impl.h - what the steps of a packing hand to each other. */
#pragma once
#include "dem_body_impl.h"
#include "dem_packing.h"

/* Number k of stream `stream` of a seed, uniform in [0, 1): splitmix64, so any thread may ask for any number. */
PetscReal DemPackRandom(PetscInt seed, PetscInt stream, PetscInt64 k);

/* n points inside the body, at least 0.2 radius from its boundary, evenly spread but disordered; in Morton order.
   x [n][3]; seated [n]: sits in a sharp corner of the body and stays there. */
PetscErrorCode DemPackStart(const DemBodySearch *search, PetscInt n, PetscReal radius, PetscInt seed, PetscReal *x, PetscBool *seated);

/* Minimise the gap functional over x [n][3] and r [n]; the mean radius stays `radius`, each r within 0.8 .. 1.25 of its
   start; the outermost spheres end exactly against the walls.  Eqs (3.4)-(3.6)
   Errors: PETSC_ERR_USER_INPUT when the body is somewhere narrower than a sphere that must lie there */
PetscErrorCode DemPackRelax(const DemBodySearch *search, PetscInt n, PetscReal radius, PetscInt iterations, const PetscBool *seated, PetscReal *x,
                            PetscReal *r);

/* Apart from each other, for loose grains; packing must be empty.  Eqs (5.80)-(5.82) */
PetscErrorCode DemPackLoose(const DemBody *body, const DemPackingOptions *options, DemPacking *packing);

/* Pairs with gap < reach (r_i + r_j), both ways: neighbours of i are nbr[start[i] .. start[i + 1]). Caller frees. */
PetscErrorCode DemPackNeighbours(PetscInt dim, PetscInt n, const PetscReal *x, const PetscReal *r, PetscReal reach, PetscInt **start, PetscInt **nbr);
