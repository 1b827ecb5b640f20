/* fem_setup.c - what the answers to "which material, which support, what mass" come to, element by element and node by node. */
#include "fem_impl.h"

/* Everyone's first trouble: the lowest global index over ranks, -1 when none. */
static PetscErrorCode FirstTrouble(FemModel model, PetscInt mine, PetscInt *first)
{
  PetscInt key = mine < 0 ? PETSC_MAX_INT : mine;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(&key, first, 1, MPIU_INT, MPI_MIN, model->comm));
  if (*first == PETSC_MAX_INT) *first = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gmsh's tag of a global element or node, known on rank 0. */
static PetscErrorCode TagOf(FemModel model, PetscBool cell, PetscInt global, PetscInt *tag)
{
  PetscFunctionBegin;
  *tag = model->rank == 0 ? (cell ? model->cell_id_all[global] : model->id_all[global]) : 0;
  PetscCallMPI(MPI_Bcast(tag, 1, MPIU_INT, 0, model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemSetUpMaterials(FemModel model)
{
  PetscInt bare = -1, twice = -1, first, tag;

  PetscFunctionBegin;
  BaseCheckInput(model->n_regions > 0, model->comm, "%s: the body has no material", model->source);
  PetscCall(PetscMalloc1(model->n_regions, &model->law));
  for (PetscInt r = 0; r < model->n_regions; r++) {
    const FemGroup *group = model->region[r].group < 0 ? NULL : &model->group[model->region[r].group];
    const PetscInt  n     = group ? group->n_cells : model->n_cells;

    model->law[r] = FemElasticOf(model->kind, &model->region[r].material);
    for (PetscInt k = 0; k < n; k++) {
      const PetscInt c = group ? group->cell[k] : k;

      if (model->cell_material[c] >= 0 && model->cell_material[c] != r && (twice < 0 || model->cell_gid[c] < twice)) twice = model->cell_gid[c];
      model->cell_material[c] = r;
    }
  }
  PetscCall(FirstTrouble(model, twice, &first));
  if (first >= 0) {
    PetscCall(TagOf(model, PETSC_TRUE, first, &tag));
    SETERRQ(model->comm, PETSC_ERR_USER_INPUT, "%s: element %d has two materials; the groups that carry materials must not overlap", model->source, (int)tag);
  }
  for (PetscInt c = model->n_cells - 1; c >= 0; c--)
    if (model->cell_material[c] < 0) bare = model->cell_gid[c];
  PetscCall(FirstTrouble(model, bare, &first));
  if (first >= 0) {
    PetscCall(TagOf(model, PETSC_TRUE, first, &tag));
    SETERRQ(model->comm, PETSC_ERR_USER_INPUT, "%s: element %d has no material; give one to its group", model->source, (int)tag);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool SameMotion(const FemFix *a, const FemFix *b)
{
  if (a->motion != b->motion) { /* both at rest for ever: the same support said in two ways */
    for (PetscInt k = 0; k < a->table.n; k++)
      if (a->table.v[k] != 0) return PETSC_FALSE;
    for (PetscInt k = 0; k < b->table.n; k++)
      if (b->table.v[k] != 0) return PETSC_FALSE;
    return PETSC_TRUE;
  }
  if (a->table.n == 1 && b->table.n == 1) return a->table.v[0] == b->table.v[0] ? PETSC_TRUE : PETSC_FALSE;
  if (a->table.n != b->table.n) return PETSC_FALSE;
  for (PetscInt k = 0; k < a->table.n; k++)
    if (a->table.t[k] != b->table.t[k] || a->table.v[k] != b->table.v[k]) return PETSC_FALSE;
  return PETSC_TRUE;
}

PetscErrorCode FemSetUpFixes(FemModel model)
{
  const PetscInt dim   = model->dim;
  PetscInt       clash = -1, pair[2] = {0, 0}, first, tag;
  PetscReal     *flag;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(model->n_loc * dim, &model->fixed));
  PetscCall(PetscMalloc1(model->n_loc * dim, &flag));
  for (PetscInt k = 0; k < model->n_loc * dim; k++) model->fixed[k] = -1;
  for (PetscInt k = 0; k < model->n_fixes; k++) {
    const FemFix   *fix   = &model->fix[k];
    const FemGroup *group = &model->group[fix->group];

    for (PetscInt i = 0; i < group->n_nodes; i++) {
      PetscInt *at = &model->fixed[group->node[i] * dim + fix->component];

      if (*at >= 0 && !SameMotion(&model->fix[*at], fix) && (clash < 0 || model->gid[group->node[i]] < clash)) {
        clash   = model->gid[group->node[i]];
        pair[0] = *at;
        pair[1] = k;
      }
      if (*at < 0) *at = k;
    }
  }
  PetscCall(FirstTrouble(model, clash, &first));
  if (first >= 0) {
    PetscMPIInt holder, mine = first == clash ? model->rank : model->size;

    PetscCallMPI(MPI_Allreduce(&mine, &holder, 1, MPI_INT, MPI_MIN, model->comm));
    PetscCallMPI(MPI_Bcast(pair, 2, MPIU_INT, holder, model->comm));
    PetscCall(TagOf(model, PETSC_FALSE, first, &tag));
    SETERRQ(model->comm, PETSC_ERR_USER_INPUT, "%s: groups '%s' and '%s' move node %d along %c in two different ways; take it out of one of them", model->source, model->group[model->fix[pair[0]].group].name,
            model->group[model->fix[pair[1]].group].name, (int)tag, "xyz"[model->fix[pair[0]].component]);
  }
  PetscCall(FemSetUpFrames(model)); /* takes the nodes with a frame out of fixed[] */
  for (PetscInt k = 0; k < model->n_own * dim; k++) {
    flag[k] = model->fixed[k];
    model->n_fixed_own += model->fixed[k] >= 0;
  }
  PetscCall(FemGhosts(model, flag));
  for (PetscInt k = model->n_own * dim; k < model->n_loc * dim; k++) model->fixed[k] = (PetscInt)flag[k];
  PetscCall(PetscFree(flag));
  PetscCall(PetscMalloc1(model->n_fixed_own, &model->fixed_dof));
  model->n_fixed_own = 0;
  for (PetscInt k = 0; k < model->n_own * dim; k++)
    if (model->fixed[k] >= 0) model->fixed_dof[model->n_fixed_own++] = k;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gradients, and the weights of the points: with the element's share where it has one, so that stiffness and mass carry it alike. */
void FemCellGeometry(FemModel model, PetscInt cell, PetscReal *dN, PetscReal *w)
{
  PetscReal x[FEM_MAX_DOFS];

  FemCellGather(model, cell, model->x, x);
  (void)FemGradients(FemShapeGet((MeshCellType)model->cell_type[cell]), x, model->thickness, dN, w); /* shapes were checked with the mesh */
  if (model->cell_weight)
    for (PetscInt g = 0; g < FemShapeGet((MeshCellType)model->cell_type[cell])->points; g++) w[g] *= model->cell_weight[model->cell_gid[cell]];
}

void FemCellGather(FemModel model, PetscInt cell, const PetscReal *u, PetscReal *ue)
{
  const PetscInt dim = model->dim, first = model->cell_start[cell], n = model->cell_start[cell + 1] - first;

  for (PetscInt a = 0; a < n; a++)
    for (PetscInt i = 0; i < dim; i++) ue[a * dim + i] = u[model->cell_node[first + a] * dim + i];
}

FemOwnKind FemCellKind(FemModel model, PetscInt cell)
{
  const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[cell]);

  if (model->element != FEM_ENHANCED) return FEM_OWN_NONE;
  return FemModesHas(shape) ? FEM_OWN_MODES : FemVolumeExcess(shape, &model->law[model->cell_material[cell]]) > 0 ? FEM_OWN_VOLUME : FEM_OWN_NONE;
}

PetscBool FemCellEnhanced(FemModel model, PetscInt cell)
{
  return FemCellKind(model, cell) != FEM_OWN_NONE ? PETSC_TRUE : PETSC_FALSE;
}

/* Geometry of a cell, and what its strain has beside B u; amounts are left alone. */
static void CellOwn(FemModel model, PetscInt cell, PetscReal *dN, PetscReal *w, FemOwn *own)
{
  const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[cell]);
  PetscReal       x[FEM_MAX_DOFS];

  FemCellGeometry(model, cell, dN, w);
  own->kind = FemCellKind(model, cell);
  if (own->kind == FEM_OWN_NONE) return;
  FemCellGather(model, cell, model->x, x);
  if (own->kind == FEM_OWN_MODES) FemModesCreate(shape, &model->law[model->cell_material[cell]], x, w, &own->modes);
  else FemVolumeCreate(shape, x, w, &own->volume);
}

void FemCellStiffness(FemModel model, PetscInt cell, PetscReal *K)
{
  const FemShape   *shape = FemShapeGet((MeshCellType)model->cell_type[cell]);
  const FemElastic *law   = &model->law[model->cell_material[cell]];
  FemOwn            own;
  PetscReal         dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS];

  CellOwn(model, cell, dN, w, &own);
  if (own.kind == FEM_OWN_MODES) FemModesStiffness(shape, law, dN, w, &own.modes, K);
  else if (own.kind == FEM_OWN_VOLUME) FemVolumeStiffness(shape, law, dN, w, &own.volume, K);
  else FemStiffness(shape, law, dN, w, K);
}

void FemCellForce(FemModel model, PetscInt cell, const PetscReal *ue, PetscReal *f)
{
  const FemShape   *shape = FemShapeGet((MeshCellType)model->cell_type[cell]);
  const FemElastic *law   = &model->law[model->cell_material[cell]];
  FemOwn            own;
  PetscReal         dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS];

  CellOwn(model, cell, dN, w, &own);
  if (own.kind == FEM_OWN_MODES) FemModesForce(shape, law, dN, w, &own.modes, ue, f);
  else if (own.kind == FEM_OWN_VOLUME) FemVolumeForce(shape, law, dN, w, &own.volume, ue, f);
  else FemForce(shape, law, dN, w, ue, f);
}

void FemCellOwn(FemModel model, PetscInt cell, const PetscReal *ue, FemOwn *own)
{
  const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[cell]);
  PetscReal       dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS];

  if (FemCellKind(model, cell) == FEM_OWN_NONE) {
    own->kind = FEM_OWN_NONE;
    return;
  }
  CellOwn(model, cell, dN, w, own);
  if (own->kind == FEM_OWN_MODES) FemModesAmounts(shape, &model->law[model->cell_material[cell]], dN, w, &own->modes, ue, own->amount);
  else FemVolumeAmounts(shape, dN, w, &own->volume, ue, own->amount);
}

void FemOwnAdd(const FemShape *shape, const FemElastic *law, const FemOwn *own, const PetscReal xi[3], PetscReal det, const PetscReal x[3], PetscReal e[6])
{
  if (own->kind == FEM_OWN_MODES) FemModesAdd(shape, &own->modes, own->amount, xi, det, e);
  else if (own->kind == FEM_OWN_VOLUME) FemVolumeAdd(shape, law, &own->volume, own->amount, x, e);
}

void FemCellStress(FemModel model, PetscInt cell, const PetscReal *ue, PetscReal strain[][6], PetscReal stress[][6])
{
  const FemShape   *shape = FemShapeGet((MeshCellType)model->cell_type[cell]);
  const FemElastic *law   = &model->law[model->cell_material[cell]];
  FemOwn            own;
  PetscReal         dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], e[FEM_MAX_POINTS][6];

  CellOwn(model, cell, dN, w, &own);
  if (own.kind == FEM_OWN_VOLUME) FemVolumeStrain(shape, law, dN, w, &own.volume, ue, e);
  else FemModesStrain(shape, law, dN, w, own.kind == FEM_OWN_MODES ? &own.modes : NULL, ue, e);
  for (PetscInt q = 0; q < shape->points; q++) {
    if (stress) FemStress(law, shape->dim, e[q], stress[q]);
    if (shape->dim == 2) e[q][2] = FemStrainZZ(law, e[q]);
    for (PetscInt i = 0; i < 6 && strain; i++) strain[q][i] = e[q][i];
  }
}

/* Lumped mass (2.10), (2.31), what gravity acts on, and the energy the body would hold at unit strain, the ledger's scale. */
PetscErrorCode FemSetUpMass(FemModel model)
{
  const PetscBool own = model->method == FEM_STATIC || (model->method == FEM_IMPLICIT && !model->implicit.lumped) ? PETSC_TRUE : PETSC_FALSE;
  PetscReal       dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], m[FEM_MAX_NODES];

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(model->n_own, &model->mass, model->n_own, &model->borne));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const FemShape    *shape    = FemShapeGet((MeshCellType)model->cell_type[c]);
    const FemMaterial *material = &model->region[model->cell_material[c]].material;

    FemCellGeometry(model, c, dN, w);
    FemLumpedMass(shape, material->density, w, m);
    for (PetscInt a = 0; a < shape->nodes; a++) {
      const PetscInt i = model->cell_node[model->cell_start[c] + a];

      if (i < model->n_own) model->mass[i] += m[a];
    }
    if (own) FemBodyMass(shape, material->density, w, m);
    for (PetscInt a = 0; a < shape->nodes; a++) {
      const PetscInt i = model->cell_node[model->cell_start[c] + a];

      if (i < model->n_own) model->borne[i] += m[a];
    }
    for (PetscInt q = 0; q < shape->points && model->own[c]; q++) model->scale += 0.5 * material->young * w[q];
  }
  for (PetscInt i = 0; i < model->n_own && model->extra_mass; i++) model->mass[i] += model->extra_mass[i];
  if (!own) PetscCall(PetscArraycpy(model->borne, model->mass, model->n_own)); /* a falling body must not deform */
  PetscCall(FemSum(model, 1, &model->scale));
  PetscFunctionReturn(PETSC_SUCCESS);
}
