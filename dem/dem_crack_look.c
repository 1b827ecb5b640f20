/*
  dem_crack_look.c - which bonds are worth watching: stresses of the particles, opening directions, onset; set-up.  Eq. (4.20)
*/
#include "dem_rule.h"
#include <omp.h>

static inline PetscReal Dot3(const PetscReal a[3], const PetscReal b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

PetscReal DemMajorDirection_Internal(PetscInt dim, const PetscReal s[6], PetscReal e[3])
{
  if (dim == 2) {
    const PetscReal mean = 0.5 * (s[0] + s[1]), half = 0.5 * (s[0] - s[1]), radius = PetscSqrtReal(half * half + s[3] * s[3]);
    const PetscReal angle = 0.5 * PetscAtan2Real(s[3], half);

    e[0] = PetscCosReal(angle);
    e[1] = PetscSinReal(angle);
    e[2] = 0;
    return mean + radius;
  }
  PetscReal A[3][3] = {{s[0], s[3], s[5]}, {s[3], s[1], s[4]}, {s[5], s[4], s[2]}}, Q[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  PetscInt  big = 0;

  for (int sweep = 0; sweep < 12; sweep++) /* Jacobi */
    for (int p = 0; p < 2; p++)
      for (int q = p + 1; q < 3; q++) {
        if (A[p][q] == 0) continue;
        const PetscReal theta = (A[q][q] - A[p][p]) / (2 * A[p][q]);
        const PetscReal t = (theta >= 0 ? 1 : -1) / (PetscAbsReal(theta) + PetscSqrtReal(theta * theta + 1)), c = 1 / PetscSqrtReal(t * t + 1), sn = t * c;

        for (int r = 0; r < 3; r++) {
          const PetscReal x = A[r][p], y = A[r][q];

          A[r][p] = c * x - sn * y;
          A[r][q] = sn * x + c * y;
        }
        for (int r = 0; r < 3; r++) {
          const PetscReal x = A[p][r], y = A[q][r], u = Q[r][p], v = Q[r][q];

          A[p][r] = c * x - sn * y;
          A[q][r] = sn * x + c * y;
          Q[r][p] = c * u - sn * v;
          Q[r][q] = sn * u + c * v;
        }
      }
  for (PetscInt c = 1; c < 3; c++)
    if (A[c][c] > A[big][big]) big = c;
  for (PetscInt c = 0; c < 3; c++) e[c] = Q[c][big];
  return A[big][big];
}

static PetscReal LeastStrength(DemModel model)
{
  const DemStrength *s = &model->strength;

  return (model->weak ? model->weakest : 1) * PetscMin(s->tensile > 0 ? s->tensile : PETSC_MAX_REAL, s->shear > 0 ? s->shear : PETSC_MAX_REAL);
}

/* Stress x volume of block b's own particles and halo slots, from the bonds as they stand. A bond that carries much by itself is
   marked: the mean stress of a particle with few bonds, or with a couple on it, can be small against the traction of one facet. */
static void BlockStress(DemModel model, PetscInt b, PetscReal *sum)
{
  const DemBlocks *blocks = &model->blocks;
  const DemBonds  *bonds = &model->bonds;
  const PetscInt   n = model->n, first = blocks->first[b], own = blocks->first[b + 1] - first, all = own + blocks->halo_start[b + 1] - blocks->halo_start[b];
  const PetscReal  wake = DEM_STRESS_WAKE * LeastStrength(model);

  for (PetscInt i = 0; i < 6 * all; i++) sum[i] = 0;
  for (PetscInt k = blocks->bond[b]; k < blocks->bond[b + 1]; k++) {
    const PetscInt  p = bonds->p[k], q = bonds->q[k];
    const PetscReal stiff = bonds->now[k], ep = model->lambda * model->dilation[p], eq = model->lambda * model->dilation[q];
    PetscReal       ra[3] = {0}, rb[3] = {0}, y[3] = {0}, ta[3], tb[3], t[3] = {0};

    for (PetscInt c = 0; c < model->dim; c++) {
      ra[c] = bonds->arm[c * bonds->n + k];
      y[c]  = model->x0[c * n + q] - model->x0[c * n + p];
      rb[c] = ra[c] - y[c];
    }
    DemTurn(model->dim, n, p, model->rot, ra, ta);
    DemTurn(model->dim, n, q, model->rot, rb, tb);
    for (PetscInt c = 0; c < model->dim; c++) {
      ra[c] += ta[c];
      rb[c] += tb[c];
      t[c] = stiff * (2 * model->g_shear * (model->u[c * n + q] - model->u[c * n + p] + tb[c] - ta[c]) + ep * ra[c] - eq * rb[c]);
    }
    if (!(model->crack.state[k] & DEM_BOND_KEPT) && Dot3(t, t) > wake * wake * stiff * stiff * Dot3(y, y)) model->crack.state[k] |= DEM_BOND_LOADED; /* area = k d */
    for (PetscInt side = 0; side < 2; side++) {
      PetscReal       *s = sum + 6 * (side ? bonds->iq[k] : bonds->ip[k]), sign = side ? -1 : 1;
      const PetscReal *r = side ? rb : ra;

      for (PetscInt c = 0; c < 3; c++) s[c] += sign * t[c] * r[c];
      s[3] += 0.5 * sign * (t[0] * r[1] + t[1] * r[0]);
      s[4] += 0.5 * sign * (t[1] * r[2] + t[2] * r[1]);
      s[5] += 0.5 * sign * (t[2] * r[0] + t[0] * r[2]);
    }
  }
  for (PetscInt i = 0; i < own; i++) {
    const DemWalls *w = &model->walls;
    PetscReal      *s = sum + 6 * i;

    if (w->n)
      for (PetscInt f = w->start[first + i]; f < w->start[first + i + 1]; f++) {
        const PetscReal *r = w->arm + 3 * f;
        PetscReal        t[3];

        DemFacetForce_Internal(model, f, t);
        for (PetscInt c = 0; c < 3; c++) s[c] += t[c] * r[c];
        s[3] += 0.5 * (t[0] * r[1] + t[1] * r[0]);
        s[4] += 0.5 * (t[1] * r[2] + t[2] * r[1]);
        s[5] += 0.5 * (t[2] * r[0] + t[0] * r[2]);
      }
    for (PetscInt c = 0; c < 6; c++) model->crack.stress[6 * (first + i) + c] = s[c];
  }
  for (PetscInt i = own; i < all; i++)
    for (PetscInt c = 0; c < 6; c++) model->crack.slot_stress[6 * (blocks->halo_start[b] + i - own) + c] = sum[6 * i + c];
}

/* Which intact bonds of block b are worth watching, and their opening direction.  Eq. (4.20) */
static void BlockLook(DemModel model, PetscInt b)
{
  const DemBonds    *bonds = &model->bonds;
  const PetscInt     n = model->n;
  DemCrackState     *crack = &model->crack;
  PetscInt          *live = crack->live + model->blocks.bond[b], n_live = 0;

  for (PetscInt k = model->blocks.bond[b]; k < model->blocks.bond[b + 1]; k++) {
    const PetscInt  p = bonds->p[k], q = bonds->q[k];
    const PetscReal volume = model->volume[p] + model->volume[q];
    const PetscBool loaded = (PetscBool)((crack->state[k] & DEM_BOND_LOADED) != 0);
    PetscReal       s[6], norm = 0, e[3], r[3];

    if (crack->state[k] & DEM_BOND_KEPT) continue;
    if (crack->damage[k] > 0) {
      live[n_live++] = k;
      if (!crack->limit || crack->limit[k] != 0) continue;
    }
    for (PetscInt c = 0; c < 6; c++) {
      s[c] = (crack->stress[6 * p + c] + crack->stress[6 * q + c]) / volume;
      norm += (c < 3 ? 1 : 2) * s[c] * s[c];
    }
    if (crack->limit && crack->limit[k] == 0) {
      PetscReal value[3];

      DemPrincipalValues(model->dim, s, value);
      if (DemMohrCoulomb(value, model->strength.mu_static, model->strength.shear) >= 1) crack->limit[k] = -1;
    }
    if (crack->damage[k] > 0) continue;
    norm            = PetscSqrtReal(norm);
    if (!(crack->state[k] & DEM_BOND_WATCHED)) crack->release[k] = 0;
    crack->state[k] = 0;
    if (!loaded && norm < DEM_STRESS_WAKE * LeastStrength(model)) continue;
    crack->state[k] = DEM_BOND_WATCHED;
    live[n_live++]  = k;
    for (PetscInt c = 0; c < 3; c++) r[c] = c < model->dim ? model->x0[c * n + q] - model->x0[c * n + p] : 0;
    PetscReal turned[3];

    if (model->crack_plane) {
      const PetscReal d = PetscSqrtReal(Dot3(r, r));

      DemTurn(model->dim, n, p, model->rot, r, turned);
      for (PetscInt c = 0; c < 3; c++) e[c] = (r[c] + turned[c]) / d;
    } else (void)DemMajorDirection_Internal(model->dim, s, e);

    DemTurn(model->dim, n, p, model->rot, r, turned);
    if (Dot3(e, r) + Dot3(e, turned) < 0)
      for (PetscInt c = 0; c < 3; c++) e[c] = -e[c];
    /* kept with particle p; its inverse rotation */
    if (model->dim == 2) {
      const PetscReal sn = model->rot[p], cs = 1 + model->rot[n + p];

      crack->e[3 * k]     = cs * e[0] + sn * e[1];
      crack->e[3 * k + 1] = -sn * e[0] + cs * e[1];
      crack->e[3 * k + 2] = 0;
    } else {
      const PetscReal inverse[4] = {model->rot[p], -model->rot[n + p], -model->rot[2 * n + p], -model->rot[3 * n + p]};

      DemTurn(3, 1, 0, inverse, e, turned);
      for (PetscInt c = 0; c < 3; c++) crack->e[3 * k + c] = e[c] + turned[c];
    }
  }
  crack->n_live[b] = n_live;
  crack->awake[b]  = n_live > 0;
}

PetscErrorCode DemCracksLook_Internal(DemModel model)
{
  const DemBlocks *blocks = &model->blocks;
  PetscErrorCode   code   = PETSC_SUCCESS;

  PetscFunctionBegin;
#pragma omp parallel num_threads((int)model->threads)
  {
    PetscReal *sum = model->scratch[omp_get_thread_num()];

#pragma omp for schedule(static)
    for (PetscInt b = 0; b < blocks->n_blocks; b++) BlockStress(model, b, sum);
#pragma omp for schedule(static)
    for (PetscInt p = 0; p < model->own; p++)
      for (PetscInt s = blocks->slot_start[p]; s < blocks->slot_start[p + 1]; s++)
        for (PetscInt c = 0; c < 6; c++) model->crack.stress[6 * p + c] += model->crack.slot_stress[6 * blocks->slot[s] + c];
    if (model->ranks) { /* of the ghosts, from their owners */
#pragma omp master
      code = DemHaloStress_Internal(model, model->crack.stress);
#pragma omp barrier
    }
#pragma omp for schedule(static)
    for (PetscInt b = 0; b < blocks->n_blocks; b++) BlockLook(model, b);
  }
  PetscCall(code);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemSetUpCracks_Internal(DemModel model)
{
  const PetscInt     m = model->bonds.n, n = model->n, slots = model->blocks.halo_start[model->blocks.n_blocks];
  const DemStrength *s = &model->strength;
  DemCrackState     *crack = &model->crack;
  PetscReal          longest = 0, tension, shear;

  PetscFunctionBegin;
  if (model->net) PetscCall(DemRuleCheckLaw_Internal(model));
  for (PetscInt k = 0; k < m && !model->net; k++) {
    PetscReal d = 0;

    if (model->breakable && !model->breakable[model->bonds.facet[k]]) continue;
    for (PetscInt c = 0; c < model->dim; c++) d += PetscSqr(model->x0[c * n + model->bonds.q[k]] - model->x0[c * n + model->bonds.p[k]]);
    longest = PetscMax(longest, PetscSqrtReal(d));
  }
  tension = s->tensile > 0 && !model->net ? DemSofteningLongest(s, model->g_shear) : PETSC_MAX_REAL;
  shear   = s->shear > 0 && !model->net ? DemShearLongest(s, model->g_shear) : PETSC_MAX_REAL;
  BaseCheckInput(longest < tension, model->comm, "The particles are too far apart for the softening curve: the longest bond is %g mm, the curve allows %g mm (smaller particles, or a larger fracture_energy)",
                 1e3 * (double)longest, 1e3 * (double)tension);
  BaseCheckInput(longest < shear, model->comm, "The particles are too far apart for the shear softening: the longest bond is %g mm, the curve allows %g mm (smaller particles, or a larger fracture_energy_shear)",
                 1e3 * (double)longest, 1e3 * (double)shear);
  PetscCall(PetscCalloc7(m, &crack->damage, 3 * m, &crack->e, 3 * m, &crack->slip, m, &crack->work, m, &crack->rub, m, &crack->time, m, &crack->release));
  PetscCall(PetscCalloc6(m, &crack->state, model->blocks.n_blocks, &crack->awake, 6 * n, &crack->stress, 6 * slots, &crack->slot_stress, slots, &crack->slot_v, n, &crack->volume));
  PetscCall(PetscCalloc3(m, &model->bonds.now, m, &crack->live, model->blocks.n_blocks, &crack->n_live));
  PetscCall(PetscArraycpy(model->bonds.now, model->bonds.k, m));
  PetscCall(PetscArrayzero(crack->n_live, model->blocks.n_blocks));
  if (model->is_static) PetscCall(PetscCalloc4(m, &crack->margin, m, &crack->beyond, m, &crack->due, model->blocks.n_blocks, &crack->excess));
  if (s->nonlocal && s->shear > 0 && !model->net) PetscCall(PetscCalloc1(m, &crack->limit));
  for (PetscInt k = 0; k < m; k++) {
    if (model->breakable && model->bonds.facet[k] >= 0 && !model->breakable[model->bonds.facet[k]]) crack->state[k] = DEM_BOND_KEPT;
    if (model->group && model->group[model->at[model->bonds.p[k]]] != model->group[model->at[model->bonds.q[k]]]) { /* broken from the start */
      crack->damage[k] = 1;
      crack->state[k]  = DEM_BOND_APART;
      model->bonds.now[k] = 0;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetCrackOpening(DemModel model, PetscReal *opening, PetscReal *distance)
{
  const DemBonds    *b = &model->bonds;
  const DemStrength *s = &model->strength;
  PetscReal          sum[2] = {0, 0};

  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before asking for the opening of a crack");
  *opening = *distance = 0;
  if (!model->crack.state || model->net) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < b->n; k++) {
    PetscReal square = 0;

    if (model->crack.state[k] == DEM_BOND_KEPT) continue;
    for (PetscInt c = 0; c < model->dim; c++) square += PetscSqr(model->x0[c * model->n + b->q[k]] - model->x0[c * model->n + b->p[k]]);
    sum[0] += PetscSqrtReal(square);
    sum[1] += 1;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, model->comm));
  if (sum[1] == 0) PetscFunctionReturn(PETSC_SUCCESS);
  *distance = sum[0] / sum[1];
  if (s->tensile > 0) *opening = DemSofteningInverse(s, 0.02 * s->tensile);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemCracksDestroy_Internal(DemModel model)
{
  DemCrackState *crack = &model->crack;

  PetscFunctionBegin;
  PetscCall(PetscFree7(crack->damage, crack->e, crack->slip, crack->work, crack->rub, crack->time, crack->release));
  PetscCall(PetscFree6(crack->state, crack->awake, crack->stress, crack->slot_stress, crack->slot_v, crack->volume));
  if (crack->live) PetscCall(PetscFree3(model->bonds.now, crack->live, crack->n_live));
  PetscCall(PetscFree(crack->limit));
  PetscCall(PetscFree4(crack->margin, crack->beyond, crack->due, crack->excess));
  PetscCall(PetscFree(crack->facet));
  for (PetscInt c = 0; c < 7; c++) PetscCall(PetscFree(crack->list[c]));
  PetscCall(PetscFree(crack->mode));
  PetscCall(PetscFree(crack->bond));
  PetscCall(PetscFree(crack->place));
  PetscFunctionReturn(PETSC_SUCCESS);
}
