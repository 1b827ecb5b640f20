/*
  fem_load.c - forces applied from outside, and where prescribed motion stands.

  Every load is a fixed pattern of nodal forces times a table in time, so the patterns are integrated once.  Eq. (2.8)
*/
#include "fem_impl.h"

static PetscErrorCode Pattern(FemModel model, FemLoad *load)
{
  const FemGroup *group = &model->group[load->group];
  const PetscInt  dim   = model->dim;
  PetscReal      *force;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(model->n_loc * dim, &force));
  for (PetscInt k = 0; k < group->n_facets; k++) {
    const PetscInt  c     = group->facet_cell[k];
    const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
    const PetscInt  n     = shape->face_nodes[group->facet_face[k]];
    PetscInt        node[FEM_MAX_FACE_NODES];
    PetscReal       x[3 * FEM_MAX_FACE_NODES], N_dA[FEM_MAX_FACE_NODES], N_n_dA[3 * FEM_MAX_FACE_NODES];

    for (PetscInt a = 0; a < n; a++) {
      node[a] = model->cell_node[model->cell_start[c] + shape->face[group->facet_face[k]][a]];
      for (PetscInt i = 0; i < dim; i++) x[a * dim + i] = model->x[node[a] * dim + i];
    }
    FemFaceIntegrals(dim, n, x, model->thickness, N_dA, N_n_dA);
    for (PetscInt a = 0; a < n; a++)
      for (PetscInt i = 0; i < dim; i++) force[node[a] * dim + i] += load->kind == FEM_TRACTION ? N_dA[a] * load->direction[i] : -N_n_dA[a * dim + i];
  }
  PetscCall(PetscMalloc2(group->n_nodes, &load->node, group->n_nodes * dim, &load->force));
  load->n = group->n_nodes;
  for (PetscInt k = 0; k < load->n; k++) {
    load->node[k] = group->node[k];
    for (PetscInt i = 0; i < dim; i++) load->force[k * dim + i] = force[group->node[k] * dim + i];
  }
  PetscCall(PetscFree(force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemSetUpLoads(FemModel model)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_loads; k++) PetscCall(Pattern(model, &model->load[k]));
  PetscCall(PetscMalloc1(model->n_loads, &model->load_value));
  model->loads_known = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemLoadsAt(FemModel model, PetscReal t)
{
  const PetscInt dim   = model->dim;
  PetscBool      stale = model->loads_known ? PETSC_FALSE : PETSC_TRUE;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_loads; k++) {
    const PetscReal value = TableValue(&model->load[k].table, t);

    if (!model->loads_known || value != model->load_value[k]) stale = PETSC_TRUE;
    model->load_value[k] = value;
  }
  model->loads_known = PETSC_TRUE;
  if (!stale) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < model->n_own; i++)
    for (PetscInt d = 0; d < dim; d++) model->f_app[i * dim + d] = model->borne[i] * model->gravity[d];
  for (PetscInt k = 0; k < model->n_loads; k++) {
    const FemLoad *load = &model->load[k];

    for (PetscInt a = 0; a < load->n; a++)
      for (PetscInt d = 0; d < dim; d++) model->f_app[load->node[a] * dim + d] += model->load_value[k] * load->force[a * dim + d];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal FemFixPosition(const FemFix *fix, PetscReal t)
{
  return fix->motion == FEM_VELOCITY ? TableIntegral(&fix->table, t) : TableValue(&fix->table, t);
}

PetscReal FemFixVelocity(const FemFix *fix, PetscReal t)
{
  return fix->motion == FEM_VELOCITY ? TableValue(&fix->table, t) : TableSlope(&fix->table, t);
}
