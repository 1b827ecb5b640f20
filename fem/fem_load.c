/*
  fem_load.c - forces applied from outside, and where prescribed motion stands.

  Every load is a fixed pattern of nodal forces times a table in time, so the patterns are integrated once.  Eq. (2.8)
*/
#include "fem_impl.h"

void FemSideGet(FemModel model, PetscInt cell, PetscInt side, FemSide *s)
{
  const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[cell]);
  const PetscInt  dim   = model->dim;

  s->n = shape->face_nodes[side];
  for (PetscInt a = 0; a < s->n; a++) {
    s->node[a] = model->cell_node[model->cell_start[cell] + shape->face[side][a]];
    for (PetscInt i = 0; i < dim; i++) s->x[a * dim + i] = model->x[s->node[a] * dim + i];
  }
  FemFaceIntegrals(dim, s->n, s->x, model->thickness, s->N_dA, s->N_n_dA);
}

/* Sum of one number per owned node in the mesh's order: the same bits on any number of ranks. a [n_own] */
static PetscErrorCode SumNodes(FemModel model, const PetscReal *a, PetscReal *sum)
{
  PetscReal *all;

  PetscFunctionBegin;
  *sum = 0;
  PetscCall(PetscMalloc1(model->rank == 0 ? model->N_nodes : 0, &all));
  PetscCall(FemGather(model, model->home, 1, a, all));
  for (PetscInt i = 0; i < model->N_nodes && model->rank == 0; i++) *sum += all[i];
  PetscCallMPI(MPI_Bcast(sum, 1, MPIU_REAL, 0, model->comm));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points and lines that are no sides of elements: their nodes' shares of the group.  Eq. (2.75) */
static PetscErrorCode PatternOfShares(FemModel model, FemLoad *load)
{
  const FemGroup *group = &model->group[load->group];
  const PetscInt  dim   = model->dim;
  const PetscReal scale = load->kind == FEM_FORCE ? 1 / group->share_all : 1;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(group->n_nodes, &load->node, group->n_nodes * dim, &load->force));
  load->n = group->n_nodes;
  for (PetscInt k = 0; k < load->n; k++) {
    load->node[k] = group->node[k];
    for (PetscInt i = 0; i < dim; i++) load->force[k * dim + i] = group->share[k] * scale * load->direction[i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Pattern(FemModel model, FemLoad *load)
{
  const FemGroup *group = &model->group[load->group];
  const PetscInt  dim   = model->dim;
  PetscReal      *force, *area, scale = 1;

  PetscFunctionBegin;
  if (group->dim < dim - 1) {
    PetscCall(PatternOfShares(model, load));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscCalloc2(model->n_loc * dim, &force, model->n_loc, &area));
  for (PetscInt k = 0; k < group->n_facets; k++) {
    FemSide s;

    FemSideGet(model, group->facet_cell[k], group->facet_face[k], &s);
    for (PetscInt a = 0; a < s.n; a++) {
      area[s.node[a]] += s.N_dA[a];
      for (PetscInt i = 0; i < dim; i++) force[s.node[a] * dim + i] += load->kind == FEM_PRESSURE ? -s.N_n_dA[a * dim + i] : s.N_dA[a] * load->direction[i];
    }
  }
  if (load->kind == FEM_FORCE) PetscCall(SumNodes(model, area, &scale));
  if (load->kind == FEM_LINE_LOAD) scale = model->thickness; /* a side of a plane body is a strip as wide as the body is thick */
  PetscCall(PetscMalloc2(group->n_nodes, &load->node, group->n_nodes * dim, &load->force));
  load->n = group->n_nodes;
  for (PetscInt k = 0; k < load->n; k++) {
    load->node[k] = group->node[k];
    for (PetscInt i = 0; i < dim; i++) load->force[k * dim + i] = force[group->node[k] * dim + i] / scale;
  }
  PetscCall(PetscFree2(force, area));
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
  return fix->motion == FEM_VELOCITY ? TableRate(&fix->table, t) : TableSlope(&fix->table, t);
}
