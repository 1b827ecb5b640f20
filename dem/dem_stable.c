/*
  dem_stable.c - the largest stable step: the critical one by Lanczos iteration, and a rigorous bound.  Eqs (4.13), (4.14)

  The operator is the model's own force function at small amplitude, so whatever acts is counted.
*/
#include "dem_rule.h"
#include <petscblaslapack.h>

#define LANCZOS_STEPS 60

static PetscInt Unknowns(DemModel model)
{
  return (model->dim + model->nrot) * model->n;
}

/* y = M^-1/2 K M^-1/2 x by one force evaluation at amplitude `scale` about the state of rest. */
static PetscErrorCode Apply(DemModel model, PetscReal scale, const PetscReal *x, PetscReal *y)
{
  const PetscInt n = model->n, dim = model->dim;

  PetscFunctionBegin;
  for (PetscInt d = 0; d < dim; d++)
    for (PetscInt p = 0; p < n; p++) model->u[d * n + p] = scale * x[d * n + p] / PetscSqrtReal(model->mass[p]);
  for (PetscInt d = 0; d < model->nrot; d++)
    for (PetscInt p = 0; p < n; p++) {
      const PetscReal a = scale * x[(dim + d) * n + p] / PetscSqrtReal(model->inertia[p]);

      if (dim == 2) {
        model->rot[p]     = PetscSinReal(a);
        model->rot[n + p] = -2 * PetscSqr(PetscSinReal(0.5 * a));
      } else {
        model->rot[p]               = 1;
        model->rot[(1 + d) * n + p] = 0.5 * a;
      }
    }
  PetscCall(DemForces_Internal(model, 0));
  for (PetscInt d = 0; d < dim; d++)
    for (PetscInt p = 0; p < n; p++) y[d * n + p] = -model->f[d * n + p] / (scale * PetscSqrtReal(model->mass[p]));
  for (PetscInt d = 0; d < model->nrot; d++)
    for (PetscInt p = 0; p < n; p++) y[(dim + d) * n + p] = -model->torque[d * n + p] / (scale * PetscSqrtReal(model->inertia[p]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Dot(PetscInt n, const PetscReal *a, const PetscReal *b)
{
  PetscReal sum = 0;

  for (PetscInt i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}

/* Largest eigenvalue of the tridiagonal matrix (alpha, beta) of size m. */
static PetscErrorCode LargestRitz(PetscInt m, const PetscReal *alpha, const PetscReal *beta, PetscReal *largest)
{
  PetscReal    d[LANCZOS_STEPS], e[LANCZOS_STEPS], none, work[4 * LANCZOS_STEPS];
  PetscBLASInt size = (PetscBLASInt)m, one = 1, info;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m; i++) {
    d[i] = alpha[i];
    e[i] = beta[i];
  }
  PetscCallBLAS("LAPACKsteqr", LAPACKsteqr_("N", &size, d, e, &none, &one, work, &info));
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK steqr failed (%d) on a %d-step Lanczos matrix", (int)info, (int)size);
  *largest = d[m - 1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest step with stiffness/mass <= rate and dashpot/mass <= drag, forces at the lagged velocity.  Eq. (5.37) */
PetscReal DemDampedStep_Internal(PetscReal rate, PetscReal drag)
{
  return 4 / (drag + PetscSqrtReal(drag * drag + 4 * rate));
}

PetscErrorCode DemModelGetCriticalStep(DemModel model, PetscReal *dt)
{
  const PetscInt n = model->n, all = Unknowns(model);
  PetscReal     *saved, *x, *y, *old, alpha[LANCZOS_STEPS], beta[LANCZOS_STEPS], largest = 0, before = 0, norm, scale, smallest = PETSC_MAX_REAL;
  PetscReal      shift[64][3], *carried = model->bonds.now;
  uint64_t       seed = 88172645463325252ULL;

  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before asking for the step");
  PetscCheck(model->n_faces <= 64, model->comm, PETSC_ERR_SUP, "A particle body with %" PetscInt_FMT " faces; at most 64", model->n_faces);
  if (model->stable > 0) {
    *dt = model->stable;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!model->bonds.n && !model->walls.n) { /* loose particles: only contacts count */
    PetscReal drag = 0, rate = model->contacts.on ? DemContactsRate_Internal(model, &drag) : 0;

    rate += DemToolsRate_Internal(model, &drag);
    *dt = model->stable = rate > 0 ? DemDampedStep_Internal(rate * (1 + model->alpha), drag) : PETSC_MAX_REAL;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc4(13 * n, &saved, all, &x, all, &y, all, &old));
  PetscCall(PetscArraycpy(saved, model->u, 3 * n));
  PetscCall(PetscArraycpy(saved + 3 * n, model->rot, 4 * n));
  PetscCall(PetscArraycpy(saved + 7 * n, model->f, 3 * n));
  PetscCall(PetscArraycpy(saved + 10 * n, model->torque, 3 * n));
  for (PetscInt k = 0; k < model->n_faces; k++)
    for (PetscInt d = 0; d < 3; d++) {
      shift[k][d]             = model->face[k].shift[d];
      model->face[k].shift[d] = 0;
    }
  for (PetscInt k = 0; k < model->n_faces; k++) model->face[k].push = model->face[k].stress[0] = model->face[k].stress[1] = model->face[k].stress[2] = 0;

  for (PetscInt i = 0; i < all; i++) { /* xorshift: any fixed vector with every frequency in it will do */
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    x[i] = (PetscReal)(seed >> 11) / 9007199254740992.0 - 0.5;
  }
  norm = PetscSqrtReal(Dot(all, x, x));
  for (PetscInt i = 0; i < all; i++) {
    x[i] /= norm;
    old[i] = 0;
  }
  for (PetscInt p = 0; p < n; p++) smallest = PetscMin(smallest, model->mass[p]);
  scale = 1e-7 * model->r[0] * PetscSqrtReal(smallest); /* motions of 1e-7 r at most: small rotations, gaps far above rounding */

  model->bonds.now = model->bonds.k; /* intact: a facet broken and closed is as stiff, and the iteration sees no contact */
  for (PetscInt m = 0; m < LANCZOS_STEPS; m++) {
    PetscCall(Apply(model, scale, x, y));
    alpha[m] = Dot(all, x, y);
    for (PetscInt i = 0; i < all; i++) y[i] -= alpha[m] * x[i] + (m ? beta[m - 1] : 0) * old[i];
    beta[m] = PetscSqrtReal(Dot(all, y, y));
    PetscCall(LargestRitz(m + 1, alpha, beta, &largest));
    if (beta[m] < 1e-12 * largest || (m > 12 && largest - before < 1e-4 * largest && m % 2)) break;
    if (m % 2) before = largest;
    for (PetscInt i = 0; i < all; i++) {
      old[i] = x[i];
      x[i]   = y[i] / beta[m];
    }
  }
  model->bonds.now = carried;
  if (model->net) largest *= DemRuleStiffening_Internal(model);
  if (model->net && model->net->hist) { /* what the intact body does says nothing about pairs that broke and turned */
    PetscReal turned;

    PetscCall(DemRuleRate_Internal(model, PETSC_TRUE, &turned));
    largest = PetscMax(largest, turned);
  }
  {
    PetscReal drag = 0;

    if (model->contacts.on) largest = PetscMax(largest, DemContactsRate_Internal(model, &drag)); /* a contact takes the place of a lost bond */
    largest += DemToolsRate_Internal(model, &drag);
    *dt = model->stable = DemDampedStep_Internal(largest * (1 + model->alpha), drag); /* drag against a slowing motion adds alpha F */
  }

  PetscCall(PetscArraycpy(model->u, saved, 3 * n));
  PetscCall(PetscArraycpy(model->rot, saved + 3 * n, 4 * n));
  for (PetscInt k = 0; k < model->n_faces; k++)
    for (PetscInt d = 0; d < 3; d++) model->face[k].shift[d] = shift[k][d];
  DemFacesSetTime_Internal(model, model->time);
  PetscCall(DemForces_Internal(model, 0)); /* sums and dilations of the present state */
  PetscCall(PetscArraycpy(model->f, saved + 7 * n, 3 * n));
  PetscCall(PetscArraycpy(model->torque, saved + 10 * n, 3 * n));
  PetscCall(PetscFree4(saved, x, y, old));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Upper bound of the largest eigenvalue of a symmetric positive 6 x 6 matrix: ||B^32||_F^(1/32), at most 3 % high. Overwrites B. */
PetscReal DemLargestOfBlock_Internal(PetscReal B[6][6])
{
  PetscReal scale = 0, exponent = 1, log_sum = 0;

  for (int round = 0; round <= 5; round++) {
    PetscReal C[6][6];

    scale = 0;
    for (int i = 0; i < 6; i++)
      for (int j = 0; j < 6; j++) scale += B[i][j] * B[i][j];
    scale = PetscSqrtReal(scale);
    if (scale == 0) return 0;
    log_sum += exponent * PetscLogReal(scale);
    if (round == 5) break;
    for (int i = 0; i < 6; i++)
      for (int j = 0; j < 6; j++) {
        C[i][j] = 0;
        for (int k = 0; k < 6; k++) C[i][j] += B[i][k] / scale * (B[k][j] / scale);
      }
    PetscMemcpy(B, C, sizeof(C));
    exponent *= 0.5;
  }
  return PetscExpReal(log_sum);
}

/* Add stiffness s |w|^2 of the gap at `arm`, w = u + theta x arm, to the mass-scaled block. */
static void AddGap(PetscReal B[6][6], PetscReal s, const PetscReal a[3], PetscReal im, PetscReal ii)
{
  const PetscReal row[3][6] = {{im, 0, 0, 0, ii * a[2], -ii * a[1]}, {0, im, 0, -ii * a[2], 0, ii * a[0]}, {0, 0, im, ii * a[1], -ii * a[0], 0}};

  for (int r = 0; r < 3; r++)
    for (int i = 0; i < 6; i++)
      for (int j = 0; j < 6; j++) B[i][j] += s * row[r][i] * row[r][j];
}

/*
  A cell's volumetric energy is bounded by its bonds': S^2 <= (sum k |a|^2) (sum k |gap|^2), so each bond's stiffness
  2 G k grows by lambda k Q / V* of either end; and |w_q - w_p|^2 <= 2 |w_p|^2 + 2 |w_q|^2 parts the particles. What is
  left is one 6 x 6 eigenvalue per particle.  Eq. (4.14)
*/
PetscErrorCode DemModelGetStableStep(DemModel model, PetscReal *dt)
{
  const PetscInt  n = model->n, dim = model->dim;
  const DemBonds *b = &model->bonds;
  const DemWalls *w = &model->walls;
  PetscReal      *Q, *block, worst = 0;

  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before asking for the step");
  if (!b->n && !w->n) {
    PetscCall(DemModelGetCriticalStep(model, dt));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (model->net) {
    PetscReal rate;

    PetscCall(DemRuleRate_Internal(model, (PetscBool)(model->net->hist != NULL), &rate));
    *dt = DemDampedStep_Internal(rate * (1 + model->alpha), 0);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscCalloc2(n, &Q, 36 * n, &block));
  for (PetscInt e = 0; e < b->n; e++) {
    PetscReal ap = 0, aq = 0;

    for (PetscInt d = 0; d < dim; d++) {
      const PetscReal a = b->arm[d * b->n + e];

      ap += a * a;
      aq += PetscSqr(a - (model->x0[d * n + b->q[e]] - model->x0[d * n + b->p[e]]));
    }
    Q[b->p[e]] += b->k[e] * ap;
    Q[b->q[e]] += b->k[e] * aq;
  }
  for (PetscInt i = 0; i < w->n; i++)
    if (w->kind[i] == DEM_WALL_SMOOTH || w->kind[i] == DEM_WALL_RIM) Q[w->owner[i]] += w->area[i] * PetscAbsReal(w->h[i]);
    else if (w->kind[i] == DEM_WALL_GLUED)
      for (PetscInt d = 0; d < 3; d++) Q[w->owner[i]] += w->area[i] / w->h[i] * PetscSqr(w->arm[3 * i + d]);
  for (PetscInt p = 0; p < n; p++) Q[p] *= PetscMax(model->lambda, 0) / model->vstar[p] * (model->share ? model->share[p] : 1);
  for (PetscInt e = 0; e < b->n; e++) {
    const PetscInt  p = b->p[e], q = b->q[e];
    const PetscReal s = 2 * b->k[e] * (2 * model->g_shear * (b->weight ? b->weight[e] : 1) + Q[p] + Q[q]);
    PetscReal       ap[3], aq[3];

    for (PetscInt d = 0; d < 3; d++) {
      ap[d] = b->arm[d * b->n + e];
      aq[d] = d < dim ? ap[d] - (model->x0[d * n + q] - model->x0[d * n + p]) : 0;
    }
    AddGap((PetscReal(*)[6])(block + 36 * p), s, ap, 1 / PetscSqrtReal(model->mass[p]), 1 / PetscSqrtReal(model->inertia[p]));
    AddGap((PetscReal(*)[6])(block + 36 * q), s, aq, 1 / PetscSqrtReal(model->mass[q]), 1 / PetscSqrtReal(model->inertia[q]));
  }
  for (PetscInt i = 0; i < w->n; i++) {
    const PetscInt p = w->owner[i];

    if (w->kind[i] != DEM_WALL_TRACTION && w->kind[i] != DEM_WALL_RIM)
      AddGap((PetscReal(*)[6])(block + 36 * p), w->area[i] / w->h[i] * (2 * model->g_shear + Q[p]), &w->arm[3 * i], 1 / PetscSqrtReal(model->mass[p]), 1 / PetscSqrtReal(model->inertia[p]));
  }
  for (PetscInt p = 0; p < n; p++) {
    PetscReal(*B)[6] = (PetscReal(*)[6])(block + 36 * p);

    if (dim == 2) /* out of plane nothing moves */
      for (int i = 2; i < 5; i++)
        for (int j = 0; j < 6; j++) B[i][j] = B[j][i] = 0;
    const PetscReal largest = DemLargestOfBlock_Internal(B); /* spends B */

    worst = PetscMax(worst, largest);
  }
  PetscCall(PetscFree2(Q, block));
  {
    PetscReal drag = 0;

    if (model->contacts.on) worst = PetscMax(worst, DemContactsRate_Internal(model, &drag));
    *dt = DemDampedStep_Internal(worst * (1 + model->alpha), drag);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
