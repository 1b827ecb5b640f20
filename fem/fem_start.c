/* fem_start.c - the state a dynamic run begins with: at rest without load, or in equilibrium with the loads of t = 0.  Eq. (2.58) */
#include "fem_impl.h"

/* u, v, f_int, loads and v of prescribed dofs at t = 0. */
PetscErrorCode FemStart(FemModel model)
{
  const PetscInt dim = model->dim;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_fixes && !model->preload; k++)
    BaseCheckInput(FemFixPosition(&model->fix[k], 0) == 0, model->comm, "Group '%s' stands %g m away from its place at t = 0; a dynamic run starts from displacement 0, or from the static state with time.preload: static",
                   model->group[model->fix[k].group].name, (double)FemFixPosition(&model->fix[k], 0));
  if (model->preload) PetscCall(FemPreload(model));
  for (PetscInt k = 0; k < model->n_own * dim; k++) model->v[k] = model->velocity0[k % dim];
  PetscCall(FemProject(model, FEM_HOLD_VELOCITY, 0, model->v));
  if (!model->preload) FemAddPrestress(model); /* on f_int = 0 */
  PetscCall(FemLoadsAt(model, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
