/*
  dem_force.c - forces and energies of the present state, block by block.  Eqs (4.4)-(4.7)

  Four passes with a barrier between: volumetric sums of the blocks, dilations, forces of the blocks, sums over halo
  slots. Every sum has one fixed order.
*/
#include "dem_rule.h"
#include <omp.h>

/* Position, displacement and rotation of block b's own and halo particles into its copy. Returns how many. */
PetscInt DemCopyState_Internal(DemModel model, PetscInt b, PetscReal *copy)
{
  const DemBlocks *blocks = &model->blocks;
  const PetscInt   n = model->n, wide = blocks->widest, first = blocks->first[b], own = blocks->first[b + 1] - first;
  const PetscInt   halo = blocks->halo_start[b + 1] - blocks->halo_start[b], *ghost = blocks->halo + blocks->halo_start[b];
  const PetscInt   nr = model->dim == 3 ? 4 : 2;

  for (PetscInt d = 0; d < model->dim; d++) {
    const PetscReal *x = model->x0 + d * n, *u = model->u + d * n;
    PetscReal       *X = copy + (DEM_COPY_X + d) * wide, *U = copy + (DEM_COPY_U + d) * wide;

    for (PetscInt i = 0; i < own; i++) {
      X[i] = x[first + i];
      U[i] = u[first + i];
    }
    for (PetscInt i = 0; i < halo; i++) {
      X[own + i] = x[ghost[i]];
      U[own + i] = u[ghost[i]];
    }
  }
  for (PetscInt d = 0; d < nr; d++) {
    const PetscReal *r = model->rot + d * n;
    PetscReal       *R = copy + (DEM_COPY_R + d) * wide;

    for (PetscInt i = 0; i < own; i++) R[i] = r[first + i];
    for (PetscInt i = 0; i < halo; i++) R[own + i] = r[ghost[i]];
  }
  return own + halo;
}

static PetscBool Awake(DemModel model, PetscInt b)
{
  return (PetscBool)(model->crack.awake && model->crack.awake[b]);
}

static void BlockSum(DemModel model, PetscInt b, PetscReal *copy)
{
  const DemBlocks *blocks = &model->blocks;
  const PetscInt   wide = blocks->widest, first = blocks->first[b], own = blocks->first[b + 1] - first, all = DemCopyState_Internal(model, b, copy);
  PetscReal       *S = copy + DEM_COPY_S * wide;

  for (PetscInt i = 0; i < all; i++) S[i] = 0;
  if (model->cohesive) {
    PetscReal *V = copy + DEM_COPY_V * wide;

    for (PetscInt i = 0; i < all; i++) V[i] = 0;
  }
  if (Awake(model, b)) DemCracksSum_Internal(model, b, copy);
  if (model->dim == 3) DemBondsSum3_Internal(wide, blocks->bond[b], blocks->bond[b + 1], &model->bonds, copy);
  else DemBondsSum2_Internal(wide, blocks->bond[b], blocks->bond[b + 1], &model->bonds, copy);
  for (PetscInt i = 0; i < own; i++) {
    model->sum[first + i] = S[i];
    if (model->walls.n) DemWallsSum_Internal(model, first + i, &model->sum[first + i]);
  }
  for (PetscInt i = own; i < all; i++) blocks->slot_s[blocks->halo_start[b] + i - own] = S[i];
  if (model->cohesive) {
    const PetscReal *V = copy + DEM_COPY_V * wide;

    for (PetscInt i = 0; i < own; i++) model->crack.volume[first + i] = V[i];
    for (PetscInt i = own; i < all; i++) model->crack.slot_v[blocks->halo_start[b] + i - own] = V[i];
  }
}

static void BlockDilation(DemModel model, PetscInt b)
{
  const DemBlocks *blocks = &model->blocks;

  for (PetscInt p = blocks->first[b]; p < blocks->first[b + 1]; p++) {
    for (PetscInt s = blocks->slot_start[p]; s < blocks->slot_start[p + 1]; s++) model->sum[p] += blocks->slot_s[blocks->slot[s]];
    if (model->cohesive) {
      for (PetscInt s = blocks->slot_start[p]; s < blocks->slot_start[p + 1]; s++) model->crack.volume[p] += model->crack.slot_v[blocks->slot[s]];
      model->dilation[p] = model->sum[p] / (model->vstar[p] + model->crack.volume[p]);
    } else model->dilation[p] = model->sum[p] / model->vstar[p];
    if (model->share) model->dilation[p] *= model->share[p];
  }
}

static void BlockForce(DemModel model, PetscInt b, PetscReal *copy, PetscInt flags)
{
  const DemBlocks *blocks = &model->blocks;
  const PetscInt   wide = blocks->widest, first = blocks->first[b], own = blocks->first[b + 1] - first, all = DemCopyState_Internal(model, b, copy);
  const PetscInt  *ghost = blocks->halo + blocks->halo_start[b];
  PetscReal       *F = copy + DEM_COPY_F * wide, *E = copy + DEM_COPY_E * wide;

  for (PetscInt i = 0; i < own; i++) E[i] = model->dilation[first + i];
  for (PetscInt i = own; i < all; i++) E[i] = model->dilation[ghost[i - own]];
  for (PetscInt i = 0; i < 8 * all; i++) F[i] = 0;
  if (model->dim == 3) DemBondsForce3_Internal(wide, blocks->bond[b], blocks->bond[b + 1], &model->bonds, 2 * model->g_shear, model->lambda, copy);
  else DemBondsForce2_Internal(wide, blocks->bond[b], blocks->bond[b + 1], &model->bonds, 2 * model->g_shear, model->lambda, copy);
  if (Awake(model, b)) DemCracksForce_Internal(model, b, copy, flags);
  DemBlockLoads_Internal(model, b, copy, flags);
}

/* Boundary facets and weight on top of block b's bond forces in its copy; out to the model's forces and the halo's slots. */
void DemBlockLoads_Internal(DemModel model, PetscInt b, PetscReal *copy, PetscInt flags)
{
  const DemBlocks *blocks = &model->blocks;
  const PetscInt   n = model->n, first = blocks->first[b], own = blocks->first[b + 1] - first, all = own + blocks->halo_start[b + 1] - blocks->halo_start[b];
  const PetscBool  heavy = (PetscBool)((flags & DEM_WITH_LOADS) && (model->gravity[0] != 0 || model->gravity[1] != 0 || model->gravity[2] != 0));
  PetscReal       *F = copy + DEM_COPY_F * blocks->widest;

  for (PetscInt i = 0; i < own; i++) {
    const PetscInt p = first + i;
    PetscReal     *f = F + 8 * i;

    if (model->walls.n) DemWallsForce_Internal(model, p, model->dilation[p], f);
    if (heavy) { /* at the cell's centroid, with its moment */
      const PetscReal c[3] = {model->offset[p], model->offset[n + p], model->offset[2 * n + p]}, m = model->mass[p], *g = model->gravity;
      PetscReal       a[3];

      DemTurn(model->dim, n, p, model->rot, c, a);
      for (PetscInt d = 0; d < 3; d++) a[d] += c[d];
      for (PetscInt d = 0; d < 3; d++) f[d] += m * g[d];
      f[3] += m * (a[1] * g[2] - a[2] * g[1]);
      f[4] += m * (a[2] * g[0] - a[0] * g[2]);
      f[5] += m * (a[0] * g[1] - a[1] * g[0]);
    }
    for (PetscInt d = 0; d < 3; d++) {
      model->f[d * n + p]      = f[d];
      model->torque[d * n + p] = f[3 + d];
    }
  }
  for (PetscInt i = own; i < all; i++)
    for (PetscInt c = 0; c < 6; c++) blocks->slot_f[8 * (blocks->halo_start[b] + i - own) + c] = F[8 * i + c];
}

void DemBlockGather_Internal(DemModel model, PetscInt b, PetscInt flags)
{
  const DemBlocks *blocks = &model->blocks;
  const PetscInt   n = model->n;

  for (PetscInt p = blocks->first[b]; p < blocks->first[b + 1]; p++) {
    for (PetscInt s = blocks->slot_start[p]; s < blocks->slot_start[p + 1]; s++) {
      const PetscReal *f = blocks->slot_f + 8 * blocks->slot[s];

      for (PetscInt d = 0; d < 3; d++) {
        model->f[d * n + p] += f[d];
        model->torque[d * n + p] += f[3 + d];
      }
    }
    if (model->f_ext && (flags & DEM_WITH_LOADS))
      for (PetscInt d = 0; d < 3; d++) {
        model->f[d * n + p] += model->f_ext[d * n + p];
        model->torque[d * n + p] += model->t_ext[d * n + p];
      }
    if (model->dim == 2) {
      model->f[2 * n + p] = 0;
      model->torque[p]    = model->torque[2 * n + p]; /* the one rotation of 2D is kept first */
      model->torque[n + p] = model->torque[2 * n + p] = 0;
    }
  }
}

/* Loose grains: weight and what comes from outside; contacts are added later. */
static void LooseForces(DemModel model, PetscInt flags)
{
  const PetscInt n = model->n;

  for (PetscInt d = 0; d < 3; d++) {
    const PetscReal g = flags & DEM_WITH_LOADS ? model->gravity[d] : 0, *mass = model->mass;
    PetscReal      *f = model->f + d * n, *t = model->torque + d * n;

    for (PetscInt p = 0; p < n; p++) {
      f[p] = g * mass[p];
      t[p] = 0;
    }
  }
  if (flags & DEM_WITH_LOADS) DemClumpsUnweigh_Internal(model);
  if (model->f_ext && (flags & DEM_WITH_LOADS)) {
    for (PetscInt i = 0; i < model->dim * n; i++) model->f[i] += model->f_ext[i];
    for (PetscInt i = 0; i < model->nrot * n; i++) model->torque[i] += model->t_ext[model->dim == 2 ? 2 * n + i : i];
  }
}

PetscErrorCode DemForces_Internal(DemModel model, PetscInt flags)
{
  const PetscInt n_blocks = model->blocks.n_blocks;

  PetscFunctionBegin;
  if (!model->bonded) {
    LooseForces(model, flags);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (model->net) {
    PetscCall(DemRuleForces_Internal(model, flags));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (model->crack.awake && (flags & DEM_WITH_FAILURE) && model->crack.steps++ % DEM_STRESS_EVERY == 0) PetscCall(DemCracksLook_Internal(model));
#pragma omp parallel num_threads((int)model->threads)
  {
    PetscReal *copy = model->scratch[omp_get_thread_num()];

#pragma omp for schedule(static)
    for (PetscInt b = 0; b < n_blocks; b++) BlockSum(model, b, copy);
#pragma omp for schedule(static)
    for (PetscInt b = 0; b < n_blocks; b++) BlockDilation(model, b);
#pragma omp for schedule(static)
    for (PetscInt b = 0; b < n_blocks; b++) BlockForce(model, b, copy, flags);
#pragma omp for schedule(static)
    for (PetscInt b = 0; b < n_blocks; b++) DemBlockGather_Internal(model, b, flags);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elastic energy of bonds, cells and held facets [J].  Eq. (4.5). Leaves sums and dilations of the present state. */
PetscErrorCode DemStrainEnergy_Internal(DemModel model, PetscReal *energy)
{
  const PetscInt n_blocks = model->blocks.n_blocks;
  PetscReal      sum = 0;

  PetscFunctionBegin;
  *energy = 0;
  if (!model->bonded) PetscFunctionReturn(PETSC_SUCCESS);
  if (model->net) {
    *energy = DemRuleEnergy_Internal(model) + DemWallsEnergy_Internal(model);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
#pragma omp parallel num_threads((int)model->threads)
  {
    PetscReal *copy = model->scratch[omp_get_thread_num()];

#pragma omp for schedule(static)
    for (PetscInt b = 0; b < n_blocks; b++) BlockSum(model, b, copy);
#pragma omp for schedule(static)
    for (PetscInt b = 0; b < n_blocks; b++) {
      const DemBlocks *blocks = &model->blocks;
      PetscReal        part;

      BlockDilation(model, b);
      DemCopyState_Internal(model, b, copy);
      if (model->dim == 3) part = DemBondsEnergy3_Internal(blocks->widest, blocks->bond[b], blocks->bond[b + 1], &model->bonds, model->g_shear, copy);
      else part = DemBondsEnergy2_Internal(blocks->widest, blocks->bond[b], blocks->bond[b + 1], &model->bonds, model->g_shear, copy);
      if (Awake(model, b)) part += DemCracksEnergy_Internal(model, b, copy);
      for (PetscInt p = blocks->first[b]; p < blocks->first[b + 1]; p++) part += 0.5 * model->lambda * model->sum[p] * model->dilation[p];
      model->block_sum[b] = part;
    }
  }
  for (PetscInt b = 0; b < n_blocks; b++) sum += model->block_sum[b];
  *energy = sum + DemWallsEnergy_Internal(model);
  PetscFunctionReturn(PETSC_SUCCESS);
}
