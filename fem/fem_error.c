/*
  fem_error.c - how far the elements' stress is from the recovered one, in energy (Zienkiewicz and Zhu).

  The recovered stress is the better one where the field is smooth, so their difference is the error of the elements to first
  order.  Eqs (2.97)-(2.99), docs/theory.md
*/
#include "fem_recover.h"

PetscErrorCode FemEstimateError(FemModel model, PetscReal *density)
{
  FemRecovery    r      = model->recovery;
  const PetscInt dim    = model->dim;
  PetscReal      sum[2] = {0, 0}; /* squared energy norms: of the difference, of the elements' own field [J] */

  PetscFunctionBegin;
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const MeshCellType type  = (MeshCellType)model->cell_type[c];
    const FemShape    *shape = FemShapeGet(type);
    const FemElastic  *law   = &model->law[model->cell_material[c]];
    const PetscReal    share = model->cell_weight ? model->cell_weight[model->cell_gid[c]] : 1;
    const FemPoints   *points = r->rule[type];
    PetscReal          volume = 0, square = 0;
    FemReading         reading;
    PetscInt           slot[FEM_MAX_NODES];

    if (!model->own[c]) continue;
    FemReadCell(model, c, PETSC_TRUE, &reading);
    for (PetscInt a = 0; a < shape->nodes; a++) slot[a] = FemSlotOf(r, model->cell_node[model->cell_start[c] + a], r->law[model->cell_material[c]]);
    for (PetscInt q = 0; q < points->n; q++) {
      PetscReal       at[3], raw[6], difference[6];
      const PetscReal dV = points->w[q] * FemRawStress(model, &reading, points, q, raw, at) * (dim == 2 ? model->thickness : 1);

      for (PetscInt i = 0; i < r->parts; i++) {
        difference[i] = -raw[i];
        for (PetscInt a = 0; a < shape->nodes; a++) difference[i] += points->N[q][a] * r->value[slot[a] * r->parts + i];
      }
      square += dV * FemStressNorm(dim, law, difference);
      sum[1] += share * dV * FemStressNorm(dim, law, raw);
      volume += dV;
    }
    sum[0] += share * square;
    if (density) density[c] = 0.5 * square / volume;
  }
  PetscCall(FemSum(model, 2, sum));
  model->error_norm  = PetscSqrtReal(sum[0]);
  model->error_share = sum[0] + sum[1] > 0 ? PetscSqrtReal(sum[0] / (sum[0] + sum[1])) : 0;
  model->error_known = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelComputeError(FemModel model, PetscReal *share, PetscReal *norm)
{
  PetscFunctionBegin;
  PetscCheck(model && model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetUp() first");
  PetscCall(FemRecoveryCreate(model));
  PetscCall(FemRecover(model, &model->recovery->all));
  PetscCall(FemEstimateError(model, NULL));
  if (share) *share = model->error_share;
  if (norm) *norm = model->error_norm;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetReadings(FemModel model, FemReadings *readings)
{
  PetscFunctionBegin;
  *readings = (FemReadings){0, 0, model->error_known, model->error_share, model->error_norm, model->iterations, model->corotate.count};
  if (model->recovery) {
    readings->recoveries = model->recovery->count;
    readings->patches    = model->recovery->patches;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
