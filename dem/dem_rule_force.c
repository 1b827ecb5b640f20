/*
  dem_rule_force.c - forces and energies of a model whose bonds follow a published rule.  Eqs (4.40)-(4.64)

  As dem_force.c, in two passes: forces of the blocks, sums over halo slots. Bonds go through the elastic kernel in
  chunks; those near a limit, or with history, are then done again one by one by the law.
*/
#include "dem_bonds_impl.h"
#include "dem_rule.h"
#include <omp.h>

#define NEAR_LIMIT 0.9 /* of a strength: from here on a bond is followed step by step */

/* Bonds of the chunk that the law must see; returns how many. */
static PetscInt Odd(DemModel model, PetscInt begin, PetscInt m, const PetscReal *normal, const PetscReal *shear2, int odd[DEM_CHUNK])
{
  const DemStrength   *s = &model->strength;
  const PetscReal     *area = model->net->area + begin;
  const unsigned char *state = model->crack.state + begin;
  const PetscReal      pull = s->tensile > 0 && !s->nonlocal ? NEAR_LIMIT * s->tensile : PETSC_MAX_REAL, mu = s->mu_static;
  const PetscReal      cohesion = s->shear > 0 && !s->nonlocal ? NEAR_LIMIT * s->shear : PETSC_MAX_REAL, crush = s->n_branches ? NEAR_LIMIT * s->crush[0] : PETSC_MAX_REAL;
  PetscInt             n = 0;
  int                  flag[DEM_CHUNK];

#pragma omp simd
  for (PetscInt c = 0; c < m; c++) {
    const PetscReal A = area[c], N = normal[c], hold = A * cohesion + mu * (N < 0 ? -N : 0);

    flag[c] = (N > A * pull) | (-N > A * crush) | (shear2[c] > hold * hold) | (state[c] & ~DEM_BOND_KEPT);
  }
  for (PetscInt c = 0; c < m; c++)
    if (flag[c]) odd[n++] = (int)c;
  return n;
}

/* Component d of the line from particle i of the copy to j, now. */
static inline PetscReal Reach(const PetscReal *copy, int i, int j, PetscInt d)
{
  const PetscReal *p = copy + DEM_AT_ALL * i, *q = copy + DEM_AT_ALL * j;

  return q[DEM_AT_X + d] - p[DEM_AT_X + d] + q[DEM_AT_U + d] - p[DEM_AT_U + d];
}

/* A nu (sigma_t1 + sigma_t2) of the two particles' mean stress, across the bond.  Eq. (4.44) */
static void PoissonForce(DemModel model, PetscInt begin, PetscInt m, PetscInt flags, const PetscReal *copy, const PetscReal *normal, PetscReal t[9][DEM_CHUNK], PetscReal *work)
{
  const DemBonds *bonds = &model->bonds;
  const PetscInt  dim = model->dim;
  DemNetwork      net = model->net;
  const PetscReal nu = model->material.poisson;

  for (PetscInt c = 0; c < m; c++) {
    const PetscInt   k = begin + c;
    const int        i = bonds->ip[k], j = bonds->iq[k];
    const PetscReal *sp = net->stress + 6 * bonds->p[k], *sq = net->stress + 6 * bonds->q[k];
    PetscReal        y[3] = {0}, s[6], length = 0, across, force;

    for (PetscInt d = 0; d < dim; d++) {
      y[d] = Reach(copy, i, j, d);
      length += y[d] * y[d];
    }
    for (PetscInt d = 0; d < 6; d++) s[d] = 0.5 * (sp[d] + sq[d]);
    if (dim == 2) s[2] = model->kind == DEM_PLANE_STRAIN ? nu * (s[0] + s[1]) : 0;
    across = (s[0] * y[0] * y[0] + s[1] * y[1] * y[1] + s[2] * y[2] * y[2] + 2 * (s[3] * y[0] * y[1] + s[4] * y[1] * y[2] + s[5] * y[2] * y[0])) / length;
    force  = net->area[k] * nu * (s[0] + s[1] + s[2] - across);
    if (model->crack.damage) force *= model->crack.damage[k] < 1;
    for (PetscInt d = 0; d < dim; d++) t[d][c] += force / PetscSqrtReal(length) * y[d];
    if (flags & DEM_WITH_FAILURE) {
      const PetscReal open = normal[c] / net->kn[k];

      *work += 0.5 * (force + net->nu_force[k]) * (open - net->nu_length[k]);
      net->nu_force[k]  = force;
      net->nu_length[k] = open;
    }
  }
}

static void AddStress(const PetscReal f[3], const PetscReal r[3], PetscReal sign, PetscReal s[6])
{
  for (PetscInt c = 0; c < 3; c++) s[c] += sign * f[c] * r[c];
  s[3] += 0.5 * sign * (f[0] * r[1] + f[1] * r[0]);
  s[4] += 0.5 * sign * (f[1] * r[2] + f[2] * r[1]);
  s[5] += 0.5 * sign * (f[2] * r[0] + f[0] * r[2]);
}

static void BlockForce(DemModel model, PetscInt b, PetscReal *copy, PetscInt flags, PetscReal *sum)
{
  const DemBlocks *blocks = &model->blocks;
  const DemBonds  *bonds = &model->bonds;
  DemNetwork       net = model->net;
  const PetscInt   wide = blocks->widest, dim = model->dim, all = DemCopyState_Internal(model, b, copy), own = blocks->first[b + 1] - blocks->first[b];
  const PetscBool  fails = (PetscBool)(net->hist && (flags & DEM_WITH_LOADS)), advance = (PetscBool)((flags & DEM_WITH_FAILURE) != 0);
  PetscReal       *F = copy + DEM_COPY_F * wide, t[9][DEM_CHUNK], normal[DEM_CHUNK], shear2[DEM_CHUNK], work = 0;
  int              odd[DEM_CHUNK];

  for (PetscInt i = 0; i < DEM_FORCE_ALL * all; i++) F[i] = 0;
  if (sum)
    for (PetscInt i = 0; i < 6 * all; i++) sum[i] = 0;
  for (PetscInt begin = blocks->bond[b]; begin < blocks->bond[b + 1]; begin += DEM_CHUNK) {
    const PetscInt m = PetscMin(DEM_CHUNK, blocks->bond[b + 1] - begin);

    if (dim == 3) DemPairsForce3_Internal(begin, m, bonds, net, copy, t, normal, shear2);
    else DemPairsForce2_Internal(begin, m, bonds, net, copy, t, normal, shear2);
    if (fails) {
      const PetscInt n_odd = Odd(model, begin, m, normal, shear2, odd);

      for (PetscInt l = 0; l < n_odd; l++) {
        const PetscInt    c = odd[l], k = begin + c;
        const DemPairView view = {DemCopyAt(copy, bonds->ip[k]), DemCopyAt(copy, bonds->iq[k])};
        DemPairForce      force;

        DemPairLaw_Internal(model, k, &view, advance, &force);
        for (PetscInt d = 0; d < 3; d++) {
          t[d][c]     = force.force[d];
          t[3 + d][c] = force.couple_p[d];
          t[6 + d][c] = force.couple_q[d];
        }
      }
    }
    if (net->nu_force && (flags & DEM_WITH_LOADS)) PoissonForce(model, begin, m, flags, copy, normal, t, &work);
    for (PetscInt c = 0; c < m; c += DEM_LANES) {
      DemLanes rows[9];

      for (int d = 0; d < 9; d++) rows[d] = DemLanesLoad(t[d] + c);
      DemLanesScatter((int)PetscMin(DEM_LANES, m - c), bonds->ip + begin + c, bonds->iq + begin + c, rows, rows + 3, rows + 6, F);
    }
    if (sum)
      for (PetscInt c = 0; c < m; c++) { /* Love-Weber, each particle its part of the centre line.  Eq. (4.43) */
        const PetscInt  k = begin + c;
        const int       i = bonds->ip[k], j = bonds->iq[k];
        const PetscReal f[3] = {t[0][c], t[1][c], t[2][c]};
        PetscReal       r[3] = {0}, s[3] = {0};

        for (PetscInt d = 0; d < dim; d++) {
          const PetscReal y = Reach(copy, i, j, d);

          r[d] = net->part[k] * y;
          s[d] = r[d] - y;
        }
        AddStress(f, r, 1, sum + 6 * i);
        AddStress(f, s, -1, sum + 6 * j);
      }
  }
  if (net->block_work) net->block_work[b] = work;
  DemBlockLoads_Internal(model, b, copy, flags);
  if (!sum) return;
  for (PetscInt i = 0; i < own; i++) {
    const PetscInt  p = blocks->first[b] + i;
    const DemWalls *w = &model->walls;

    if (w->n)
      for (PetscInt f = w->start[p]; f < w->start[p + 1]; f++) {
        PetscReal force[3];

        DemFacetForce_Internal(model, f, force);
        AddStress(force, w->arm + 3 * f, 1, sum + 6 * i);
      }
    for (PetscInt c = 0; c < 6; c++) net->stress_sum[6 * p + c] = sum[6 * i + c];
  }
  for (PetscInt i = own; i < all; i++)
    for (PetscInt c = 0; c < 6; c++) net->slot_stress[6 * (blocks->halo_start[b] + i - own) + c] = sum[6 * i + c];
}

/* Bonds whose mean stress has reached a strength begin to soften from the load they carry now.  Eqs (4.60)-(4.62) */
static void Look(DemModel model, PetscInt b)
{
  const DemStrength *s = &model->strength;
  const PetscInt     m = model->bonds.n;
  DemNetwork         net = model->net;

  for (PetscInt k = model->blocks.bond[b]; k < model->blocks.bond[b + 1]; k++) {
    const PetscInt  p = model->bonds.p[k], q = model->bonds.q[k];
    const PetscReal vp = model->volume[p], vq = model->volume[q];
    PetscReal       mean[6], value[3], *limit_n = net->hist + DEM_PAST_LIMIT_N * m + k, *limit_s = net->hist + DEM_PAST_LIMIT_S * m + k;
    PetscReal       at[2][DEM_AT_ALL];
    const DemPairView view = {at[0], at[1]};
    DemPairState    pair;

    if ((model->crack.state[k] & DEM_BOND_KEPT) || model->crack.damage[k] >= 1 || (*limit_n > 0 && *limit_s > 0)) continue;
    for (PetscInt c = 0; c < 6; c++) mean[c] = (net->stress[6 * p + c] * vp + net->stress[6 * q + c] * vq) / (vp + vq);
    DemPrincipalValues(model->dim, mean, value);
    const PetscBool rankine = (PetscBool)(s->tensile > 0 && value[0] >= s->tensile && *limit_n == 0);
    const PetscBool coulomb = (PetscBool)(s->shear > 0 && *limit_s == 0 && DemMohrCoulomb(value, s->mu_static, s->shear) >= 1);

    if (!rankine && !coulomb) continue;
    DemCopyParticle_Internal(model, p, at[0]);
    DemCopyParticle_Internal(model, q, at[1]);
    DemPairGeometry_Internal(model->dim, &view, net->part[k], &pair);
    model->crack.state[k] |= DEM_BOND_WATCHED;
    if (rankine) *limit_n = PetscMax(pair.open - net->hist[DEM_PAST_SET * m + k], DEM_SMALLEST_COSINE * s->tensile * net->area[k] / net->kn[k]);
    if (coulomb) {
      PetscReal slide = 0;

      for (PetscInt c = 0; c < 3; c++) slide += PetscSqr(pair.slide[c]);
      *limit_s = PetscMax(net->ks[k] * PetscSqrtReal(slide), DEM_SMALLEST_COSINE * s->shear * net->area[k]);
    }
  }
}

PetscErrorCode DemRuleForces_Internal(DemModel model, PetscInt flags)
{
  const DemBlocks *blocks = &model->blocks;
  DemNetwork       net = model->net;
  const PetscBool  advance = (PetscBool)((flags & DEM_WITH_FAILURE) != 0), looks = (PetscBool)(advance && net->hist && model->strength.nonlocal && model->crack.steps % DEM_STRESS_EVERY == 0);
  const PetscBool  stress = (PetscBool)(looks || (advance && net->nu_force));
  PetscErrorCode   code = PETSC_SUCCESS;

  PetscFunctionBegin;
  if (advance) model->crack.steps++;
#pragma omp parallel num_threads((int)model->threads)
  {
    PetscReal *copy = model->scratch[omp_get_thread_num()], *sum = stress ? net->scratch[omp_get_thread_num()] : NULL;

#pragma omp for schedule(static)
    for (PetscInt b = 0; b < blocks->n_blocks; b++) BlockForce(model, b, copy, flags, sum);
#pragma omp for schedule(static)
    for (PetscInt b = 0; b < blocks->n_blocks; b++) DemBlockGather_Internal(model, b, flags);
    if (stress) {
#pragma omp for schedule(static)
      for (PetscInt p = 0; p < model->own; p++) {
        PetscReal *s = net->stress_sum + 6 * p;

        for (PetscInt l = blocks->slot_start[p]; l < blocks->slot_start[p + 1]; l++)
          for (PetscInt c = 0; c < 6; c++) s[c] += net->slot_stress[6 * blocks->slot[l] + c];
        for (PetscInt c = 0; c < 6; c++) net->stress[6 * p + c] = s[c] / model->volume[p];
      }
    }
    if (stress && model->ranks) { /* of the ghosts, from their owners */
#pragma omp master
      code = DemHaloStress_Internal(model, net->stress);
#pragma omp barrier
    }
    if (looks) {
#pragma omp for schedule(static)
      for (PetscInt b = 0; b < blocks->n_blocks; b++) Look(model, b);
    }
  }
  PetscCall(code);
  if (advance && net->nu_force)
    for (PetscInt b = 0; b < blocks->n_blocks; b++)
      if (DemBlockIsMine(model, b)) net->nu_work += net->block_work[b];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal DemPoissonForce_Internal(DemModel model, PetscInt k, PetscInt d)
{
  const PetscInt p = model->bonds.p[k], q = model->bonds.q[k], n = model->n;
  PetscReal      y[3] = {0}, length = 0;

  for (PetscInt c = 0; c < model->dim; c++) {
    y[c] = model->x0[c * n + q] - model->x0[c * n + p] + model->u[c * n + q] - model->u[c * n + p];
    length += y[c] * y[c];
  }
  return model->net->nu_force[k] * y[d] / PetscSqrtReal(length);
}

PetscReal DemRuleEnergy_Internal(DemModel model)
{
  PetscReal sum = 0;

  for (PetscInt k = 0; k < model->bonds.n; k++) {
    DemPairForce now;

    if (!DemBondIsMine(model, k)) continue;
    DemPairNow_Internal(model, k, &now);
    sum += now.energy;
  }
  return sum;
}
