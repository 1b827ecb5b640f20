/* fem_continue.c - a model of fewer elements goes on where one of more stands. */
#include "fem_impl.h"

PetscErrorCode FemModelContinue(FemModel model, FemModel from, const PetscInt node[])
{
  const PetscInt dim = model->dim;

  PetscFunctionBegin;
  PetscCheck(model->ready && from->ready && !model->started, model->comm, PETSC_ERR_ORDER, "A model goes on from another after set-up and before its first step");
  PetscCheck(model->method == FEM_EXPLICIT && from->method == FEM_EXPLICIT && model->size == 1 && dim == from->dim, model->comm, PETSC_ERR_SUP, "A model goes on from another on one rank, both explicit");
  for (PetscInt i = 0; i < model->n_own; i++)
    for (PetscInt d = 0; d < dim; d++) {
      model->u[i * dim + d] = from->u[node[i] * dim + d];
      model->v[i * dim + d] = from->v[node[i] * dim + d];
    }
  model->t           = from->t;
  model->dt_last     = from->dt_last;
  model->started     = from->started;
  model->work        = from->work;
  model->damping     = from->damping;
  model->work_in     = from->work_in;
  model->initial     = from->initial;
  model->level_known = PETSC_FALSE;
  PetscCall(FemForces(model));
  FemAddPrestress(model);
  PetscCall(FemLoadsAt(model, model->t));
  PetscFunctionReturn(PETSC_SUCCESS);
}
