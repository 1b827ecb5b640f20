/* dem_static_impl.h - load steps without inertia, what their files share. Unknowns: displacement [dim][n], then rotation vector [nrot][n]. */
#pragma once
#include "dem_rule.h"
#include <petscksp.h>

struct _n_DemStatic {
  Vec        x, b;
  Mat        K;         /* products by the force function.  Eq. (4.81) */
  Mat        springs;   /* eq. (4.83) for the preconditioner, upper half; NULL: its diagonal alone */
  KSP        ksp;
  PetscReal *u, *rot;   /* [3][n], [4][n] where the step linearises */
  PetscReal *f;         /* [unknowns] forces there */
  PetscReal *diagonal;  /* [unknowns] */
  PetscReal *held;      /* [unknowns] forces of the state that is kept, its supports where they are; NULL unless bonds can break */
  PetscReal  radius;    /* mean [m] */
  PetscReal  reference; /* largest out-of-balance a step began with [N] */
  PetscInt   products;  /* force evaluations in K's place, so far */
  PetscInt   factors;   /* times the springs were factored */
  PetscInt   usual;     /* iterations of the first solve with the factor at hand, -1 before it */
};

static inline PetscInt DemStaticUnknowns(DemModel model)
{
  return (model->dim + model->nrot) * model->n;
}

/* dem_static.c */
void           DemStaticMoveTo_Internal(DemModel model, PetscReal scale, const PetscReal *v);
PetscReal      DemStaticForces_Internal(DemModel model, PetscReal *f); /* forces and couples now; their norm, couples over the mean radius [N] */
PetscErrorCode DemStaticSolve_Internal(DemModel model, PetscReal rtol, PetscInt most); /* statics->x from statics->f */
PetscReal      DemStaticTooFar_Internal(DemModel model, const PetscReal *x);
/* dem_static_factor.c */
PetscErrorCode DemStaticSprings_Internal(DemModel model, PetscBool fresh); /* of bonds and held facets as they stand; fresh: the pattern is new */
/* dem_static_break.c: a load step of bonds that may break */
PetscErrorCode DemStaticBreak_Internal(DemModel model, PetscReal t, PetscReal dt);
