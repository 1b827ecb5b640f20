/*
  coupling_far.c - a far field that goes implicitly: which elements are near, and how many steps of theirs make one of the others'.  Eqs (6.20)-(6.28)

  Near are the elements of the overlap; fem/fem_far.c takes the rest. Both are stable by themselves and so is the pair, whatever the
  far elements' size, so that only accuracy limits the far field's step.
*/
#include "coupling_impl.h"

#define MOST    10
#define WORTH   1.5 /* auto: implicit where far elements alone would make the particles' step this much smaller */
#define RESOLVE 0.3 /* auto steps: the far field's at most this much of the near elements' critical step */

/* The particles' step without and with an implicit far field decides.  */
static PetscErrorCode Wanted(CouplingModel model, const PetscBool near[], PetscInt outside, PetscBool *implicit)
{
  PetscReal whole, dem, outer = PETSC_MAX_REAL;

  PetscFunctionBegin;
  *implicit = model->options.far == COUPLING_FAR_IMPLICIT ? PETSC_TRUE : PETSC_FALSE;
  BaseCheckInput(!*implicit || outside > 0, model->comm, "far_field: implicit has no element to act on: all lie in the overlap; use explicit");
  if (model->options.far != COUPLING_FAR_AUTO || outside == 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FemModelGetCriticalStep(model->fem, &whole));
  PetscCall(DemModelGetCriticalStep(model->dem, &dem));
  if (whole * WORTH > dem) PetscFunctionReturn(PETSC_SUCCESS); /* the particles set the step */
  PetscCall(FemModelSetInnerCells(model->fem, near, 2, &outer));
  PetscCall(FemModelSetInnerCells(model->fem, near, 1, NULL));
  *implicit = outer * WORTH < dem ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Near elements relax, the others follow statically. */
static PetscErrorCode SetStatic(CouplingModel model, const PetscBool near[], PetscInt outside)
{
  PetscReal    fem, dem;
  FemFarReport report;

  PetscFunctionBegin;
  BaseCheckInput(outside > 0, model->comm, "far_field: static has no element to act on: all lie in the overlap");
  BaseCheckInput(model->options.tolerance > 0 && model->options.tolerance < 0.1, model->comm, "A load step's force out of balance must come below a positive fraction of the forces, not %.4g", (double)model->options.tolerance);
  BaseCheckInput(!model->options.preload, model->comm, "A static far field and a static start do not go together: the first load step is static anyway");
  PetscCall(FemModelGetCriticalStep(model->fem, &fem));
  PetscCall(DemModelGetCriticalStep(model->dem, &dem));
  PetscCall(FemModelSetFarStatic(model->fem, near, model->options.condense, &fem));
  PetscCall(FemModelGetFar(model->fem, &report));
  model->report.dense  = report.dense;
  model->report.factor = report.entries;
  model->report.face   = report.face;
  model->limit         = 0.9 * CouplingStepShare(&model->options) * PetscMin(fem, dem);
  model->far           = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingChooseFar_Internal(CouplingModel model, PetscBool *implicit)
{
  const PetscInt asked = model->options.substeps;
  PetscBool     *near;
  PetscInt       outside = 0;
  PetscReal      whole, fem, dem, local;

  PetscFunctionBegin;
  *implicit = PETSC_FALSE;
  if (model->options.far == COUPLING_FAR_EXPLICIT) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(model->n_top, &near));
  for (PetscInt t = 0; t < model->n_top; t++) {
    near[t] = model->split->layer[t] > 0 ? PETSC_TRUE : PETSC_FALSE;
    outside += !near[t];
  }
  if (model->options.far == COUPLING_FAR_STATIC) {
    PetscCall(SetStatic(model, near, outside));
    PetscCall(PetscFree(near));
    *implicit = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FemModelGetLocalDamping(model->fem, &local));
  if (model->options.far == COUPLING_FAR_AUTO && local > 0) outside = 0; /* has no implicit form */
  PetscCall(Wanted(model, near, outside, implicit));
  if (*implicit) {
    BaseCheckInput(asked >= 0, model->comm, "substeps: %" PetscInt_FMT " is no number of particle steps; give 1 or more, or auto", asked);
    PetscCall(FemModelGetCriticalStep(model->fem, &whole));
    PetscCall(DemModelGetCriticalStep(model->dem, &dem));
    PetscCall(FemModelSetFar(model->fem, near, 1, &fem));
    model->limit           = CouplingStepShare(&model->options) * PetscMin(fem, dem);
    model->substeps        = asked > 0 ? asked : (PetscInt)PetscMax(1, PetscMin(MOST, PetscFloorReal(RESOLVE * fem / model->limit)));
    model->report.explicit_limit = CouplingStepShare(&model->options) * PetscMin(whole, dem);
    PetscCall(FemModelSetFar(model->fem, near, model->substeps, NULL));
    model->far = PETSC_TRUE;
  }
  PetscCall(PetscFree(near));
  PetscFunctionReturn(PETSC_SUCCESS);
}
