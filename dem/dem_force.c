/*
  dem_force.c - forces and energies of the present state, block by block.  Eqs (4.4)-(4.7)

  Four passes with a barrier between: volumetric sums of the blocks, dilations, forces of the blocks, sums over halo
  slots. Every sum has one fixed order.
*/
#include "dem_lanes.h"
#include "dem_rule.h"
#include <omp.h>

DEM_INLINE void CopyParticle(DemModel model, PetscInt p, PetscReal at[DEM_AT_ALL])
{
  const PetscInt n = model->n;

  for (PetscInt d = 0; d < 3; d++) {
    at[DEM_AT_U + d] = model->u[d * n + p];
    at[DEM_AT_X + d] = model->x0[d * n + p];
  }
  for (PetscInt d = 0; d < 4; d++) at[DEM_AT_R + d] = model->rot[d * n + p];
  at[DEM_AT_E] = model->dilation[p];
}

void DemCopyParticle_Internal(DemModel model, PetscInt p, PetscReal at[DEM_AT_ALL])
{
  CopyParticle(model, p, at);
}

/* Four particles in a row at a time: rows of the model's arrays become records. */
DEM_CLONES static void CopyRow(DemModel model, PetscInt first, PetscInt own, PetscReal *copy)
{
  const PetscInt   n = model->n;
  const PetscReal *u = model->u + first, *x = model->x0 + first, *rot = model->rot + first, *dilation = model->dilation + first;
  PetscInt         i = 0;

  for (; i + DEM_LANES <= own; i += DEM_LANES) {
    DemLanes   U[DEM_LANES], R[DEM_LANES], X[DEM_LANES];
    PetscReal *at = DemCopyAt(copy, i);

    DemLanesRows(u + i, u + n + i, u + 2 * n + i, dilation + i, U);
    DemLanesRows(rot + i, rot + n + i, rot + 2 * n + i, rot + 3 * n + i, R);
    DemLanesRows(x + i, x + n + i, x + 2 * n + i, x + i, X);
    for (int c = 0; c < DEM_LANES; c++) {
      *(DemLoose *)(at + DEM_AT_ALL * c + DEM_AT_U) = U[c]; /* the dilation comes fourth */
      *(DemLoose *)(at + DEM_AT_ALL * c + DEM_AT_R) = R[c];
      *(DemLoose *)(at + DEM_AT_ALL * c + DEM_AT_X) = X[c];
    }
  }
  for (; i < own; i++) CopyParticle(model, first + i, DemCopyAt(copy, i));
}

/* Position, displacement, rotation and dilation of block b's own and halo particles into its copy. Returns how many. */
PetscInt DemCopyState_Internal(DemModel model, PetscInt b, PetscReal *copy)
{
  const DemBlocks *blocks = &model->blocks;
  const PetscInt   first = blocks->first[b], own = blocks->first[b + 1] - first;
  const PetscInt   halo = blocks->halo_start[b + 1] - blocks->halo_start[b], *ghost = blocks->halo + blocks->halo_start[b];

  CopyRow(model, first, own, copy);
  for (PetscInt i = 0; i < halo; i++) CopyParticle(model, ghost[i], DemCopyAt(copy, own + i));
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
  const PetscInt   wide = blocks->widest, all = DemCopyState_Internal(model, b, copy);
  PetscReal       *F = copy + DEM_COPY_F * wide;

  for (PetscInt i = 0; i < DEM_FORCE_ALL * all; i++) F[i] = 0;
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
    PetscReal     *f = F + DEM_FORCE_ALL * i;

    if (model->walls.n) DemWallsForce_Internal(model, p, model->dilation[p], f);
    if (heavy) { /* at the cell's centroid, with its moment */
      const PetscReal c[3] = {model->offset[p], model->offset[n + p], model->offset[2 * n + p]}, m = model->mass[p], *g = model->gravity;
      PetscReal       a[3];

      DemTurn(model->dim, n, p, model->rot, c, a);
      for (PetscInt d = 0; d < 3; d++) a[d] += c[d];
      for (PetscInt d = 0; d < 3; d++) f[d] += m * g[d];
      DemAddMoment(a, g, m, f);
    }
    for (PetscInt d = 0; d < 3; d++) {
      model->f[d * n + p]      = f[d];
      model->torque[d * n + p] = f[DEM_FORCE_COUPLE + d];
    }
  }
  for (PetscInt i = own; i < all; i++)
    for (PetscInt c = 0; c < DEM_FORCE_ALL; c++) blocks->slot_f[DEM_FORCE_ALL * (blocks->halo_start[b] + i - own) + c] = F[DEM_FORCE_ALL * i + c];
}

void DemBlockGather_Internal(DemModel model, PetscInt b, PetscInt flags)
{
  const DemBlocks *blocks = &model->blocks;
  const PetscInt   n = model->n;

  for (PetscInt p = blocks->first[b]; p < blocks->first[b + 1]; p++) {
    for (PetscInt s = blocks->slot_start[p]; s < blocks->slot_start[p + 1]; s++) {
      const PetscReal *f = blocks->slot_f + DEM_FORCE_ALL * blocks->slot[s];

      for (PetscInt d = 0; d < 3; d++) {
        model->f[d * n + p] += f[d];
        model->torque[d * n + p] += f[DEM_FORCE_COUPLE + d];
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
  PetscErrorCode code     = PETSC_SUCCESS;

  PetscFunctionBegin;
  if (model->ranks) PetscCall(DemHaloMotion_Internal(model));
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
    if (model->ranks) { /* of the ghosts, from their owners */
#pragma omp master
      code = DemHaloReal_Internal(model, model->dilation);
#pragma omp barrier
    }
#pragma omp for schedule(static)
    for (PetscInt b = 0; b < n_blocks; b++) BlockForce(model, b, copy, flags);
#pragma omp for schedule(static)
    for (PetscInt b = 0; b < n_blocks; b++) DemBlockGather_Internal(model, b, flags);
  }
  PetscCall(code);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elastic energy of bonds, cells and held facets [J].  Eq. (4.5). A look leaves no trace: the dilations of the last forces, before damage grew, are what the
   next look at stresses starts from. */
PetscErrorCode DemStrainEnergy_Internal(DemModel model, PetscReal *energy)
{
  const PetscInt n_blocks = model->blocks.n_blocks;
  PetscReal      sum = 0, *before = NULL;

  PetscFunctionBegin;
  *energy = 0;
  if (!model->bonded) PetscFunctionReturn(PETSC_SUCCESS);
  if (model->net) {
    *energy = DemRuleEnergy_Internal(model) + DemWallsEnergy_Internal(model);
    PetscCall(DemSumRanks_Internal(model, 1, energy));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (model->crack.damage) {
    PetscCall(PetscMalloc1(model->n, &before));
    PetscCall(PetscArraycpy(before, model->dilation, model->n));
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
  if (before) PetscCall(PetscArraycpy(model->dilation, before, model->n));
  else if (model->ranks) PetscCall(DemHaloReal_Internal(model, model->dilation));
  PetscCall(PetscFree(before));
  for (PetscInt b = 0; b < n_blocks; b++)
    if (DemBlockIsMine(model, b)) sum += model->block_sum[b];
  *energy = sum + DemWallsEnergy_Internal(model);
  PetscCall(DemSumRanks_Internal(model, 1, energy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
