/* fem_start.c - the state a dynamic run begins with: at rest without load, or in equilibrium with the loads of t = 0.  Eq. (2.58) */
#include "fem_impl.h"

/* u, v, f_int, loads and v of prescribed dofs at t = 0. */
PetscErrorCode FemStart(FemModel model)
{
  const PetscInt dim = model->dim;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_fixes && !model->preload && !model->start_given; k++)
    BaseCheckInput(FemFixPosition(&model->fix[k], 0) == 0, model->comm, "Group '%s' stands %g m away from its place at t = 0; a dynamic run starts from displacement 0, or from the static state with time.preload: static",
                   model->group[model->fix[k].group].name, (double)FemFixPosition(&model->fix[k], 0));
  if (model->preload) PetscCall(FemPreload(model));
  for (PetscInt k = 0; k < model->n_own * dim; k++) model->v[k] = model->velocity0[k % dim];
  PetscCall(FemProject(model, FEM_HOLD_VELOCITY, 0, model->v));
  if (!model->preload) FemAddPrestress(model); /* on f_int = 0 */
  PetscCall(FemLoadsAt(model, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- a start that a caller finds: both sides of a coupled body in equilibrium --------------------------------------- */

PetscErrorCode FemModelSetStartGiven(FemModel model, PetscBool given)
{
  PetscFunctionBegin;
  PetscCheck(model && !model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "A start is announced before FemModelSetUp()");
  model->start_given = given;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelHoldStart(FemModel model)
{
  PetscFunctionBegin;
  PetscCheck(model->ready && model->method == FEM_EXPLICIT && model->size == 1 && !model->started && !model->lent, model->comm, PETSC_ERR_ORDER, "A start is given on one rank, after set-up and before the first explicit step");
  PetscCall(FemProject(model, FEM_HOLD_POSITION, 0, model->u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetResidual(FemModel model, const PetscReal *outside, PetscReal *r)
{
  PetscFunctionBegin;
  if (model->far.m) FemFarSame(model);
  PetscCall(FemForces(model));
  FemAddPrestress(model);
  for (PetscInt k = 0; k < model->n_own * model->dim; k++) r[k] = model->f_app[k] + (outside ? outside[k] : 0) - model->f_int[k];
  FemKeepFree(model, r);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetForces(FemModel model, PetscReal *r)
{
  PetscFunctionBegin;
  PetscCheck(model->ready && model->method == FEM_EXPLICIT && model->size == 1, model->comm, PETSC_ERR_ORDER, "Forces are at hand in explicit models on one rank, after set-up");
  for (PetscInt k = 0; k < model->n_own * model->dim; k++) r[k] = model->f_app[k] - model->f_int[k];
  FemKeepFree(model, r);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelStartHere(FemModel model)
{
  PetscReal energy = 0;

  PetscFunctionBegin;
  PetscCheck(model->ready && model->start_given && !model->started, model->comm, PETSC_ERR_ORDER, "Call FemModelSetStartGiven() before set-up, and this before the first step");
  for (PetscInt k = 0; k < model->n_own * model->dim; k++) energy += 0.5 * model->mass[k / model->dim] * model->v[k] * model->v[k];
  if (model->far.m) FemFarSame(model);
  PetscCall(FemForces(model));
  FemAddPrestress(model);
  energy += FemStrainEnergy(model); /* f_int is that of all elements, sub-steps or not, and of their prestress, as (2.79) takes it */
  model->initial     = energy + FemPrestressEnergy(model);
  model->level_known = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
