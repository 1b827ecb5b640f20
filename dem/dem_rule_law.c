/*
  dem_rule_law.c - one bond of the published rules: its geometry, and the published law of failure.  Eqs (4.40)-(4.63)

  The normal spring acts on the elongation of the centre line, the tangential one on the gap across it. Tension and
  shear lose stiffness each by its own largest load (uncoupled); compression yields along branches and keeps a set. A
  bond that has lost either is broken: it pushes, and rubs with Coulomb's friction.
*/
#include "dem_rule.h"

static inline PetscReal Dot3(const PetscReal a[3], const PetscReal b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void DemPairGeometry_Internal(PetscInt dim, const DemPairView *view, PetscReal part, DemPairState *pair)
{
  PetscReal Y[3] = {0}, move[3] = {0}, ra[3] = {0}, rb[3] = {0}, ta[3], tb[3], length2 = 0, rest2 = 0, grow = 0;

  for (PetscInt c = 0; c < dim; c++) {
    Y[c]    = view->q[DEM_AT_X + c] - view->p[DEM_AT_X + c];
    move[c] = view->q[DEM_AT_U + c] - view->p[DEM_AT_U + c];
    ra[c]   = part * Y[c];
    rb[c]   = ra[c] - Y[c];
    rest2 += Y[c] * Y[c];
    length2 += PetscSqr(Y[c] + move[c]);
    grow += (2 * Y[c] + move[c]) * move[c];
  }
  pair->length = PetscSqrtReal(length2);
  pair->open   = grow / (pair->length + PetscSqrtReal(rest2));
  DemTurn(dim, 1, 0, view->p + DEM_AT_R, ra, ta);
  DemTurn(dim, 1, 0, view->q + DEM_AT_R, rb, tb);
  for (PetscInt c = 0; c < 3; c++) {
    pair->n[c]   = (Y[c] + move[c]) / pair->length;
    pair->a[c]   = ra[c] + ta[c];
    pair->b[c]   = rb[c] + tb[c];
    pair->gap[c] = move[c] + tb[c] - ta[c];
  }
  pair->along = Dot3(pair->gap, pair->n);
  for (PetscInt c = 0; c < 3; c++) pair->slide[c] = pair->gap[c] - pair->along * pair->n[c];
}

/* A vector kept with particle p: to space, and back. */
static void ToSpace(PetscInt dim, const DemPairView *view, const PetscReal v[3], PetscReal out[3])
{
  PetscReal t[3];

  DemTurn(dim, 1, 0, view->p + DEM_AT_R, v, t);
  for (PetscInt c = 0; c < 3; c++) out[c] = v[c] + t[c];
}

static void ToParticle(PetscInt dim, const DemPairView *view, const PetscReal v[3], PetscReal out[3])
{
  const PetscReal *R = view->p + DEM_AT_R;
  PetscReal        back[4], t[3];

  if (dim == 2) {
    out[0] = (1 + R[1]) * v[0] + R[0] * v[1];
    out[1] = -R[0] * v[0] + (1 + R[1]) * v[1];
    out[2] = 0;
    return;
  }
  back[0] = R[0];
  for (PetscInt c = 1; c < 4; c++) back[c] = -R[c];
  DemTurn(3, 1, 0, back, v, t);
  for (PetscInt c = 0; c < 3; c++) out[c] = v[c] + t[c];
}

static void Break(DemModel model, PetscInt k, const DemPairView *view, const DemPairState *pair)
{
  model->crack.damage[k] = 1;
  ToParticle(model->dim, view, pair->slide, model->crack.slip + 3 * k);
}

/* First damage: when, and across which plane. */
static void Mark(DemModel model, PetscInt k, unsigned char mode)
{
  const PetscInt n = model->n, p = model->bonds.p[k], q = model->bonds.q[k];
  PetscReal      d = 0;

  if (!(model->crack.state[k] & (DEM_BOND_TENSION | DEM_BOND_SHEAR))) {
    model->crack.time[k] = model->time;
    for (PetscInt c = 0; c < model->dim; c++) d += PetscSqr(model->x0[c * n + q] - model->x0[c * n + p]);
    for (PetscInt c = 0; c < 3; c++) model->crack.e[3 * k + c] = c < model->dim ? (model->x0[c * n + q] - model->x0[c * n + p]) / PetscSqrtReal(d) : 0;
  }
  model->crack.state[k] |= mode;
}

void DemPairLaw_Internal(DemModel model, PetscInt k, const DemPairView *view, PetscBool advance, DemPairForce *out)
{
  const DemStrength *s = &model->strength;
  DemNetwork         net = model->net;
  DemCrackState     *crack = &model->crack;
  const PetscInt     m = model->bonds.n;
  const PetscReal    kn = net->kn[k], ks = net->ks[k], A = net->area[k];
  PetscReal         *hist = net->hist + k, t[3];
  const PetscReal    limit_n = s->nonlocal ? hist[DEM_PAST_LIMIT_N * m] : s->tensile * A / kn; /* 0: does not soften */
  const PetscReal    delta_n = s->tensile > 0 ? DemPublishedDelta(s->delta_n, s->fracture_energy, s->tensile, A, kn) : 1;
  const PetscReal    delta_s = s->shear > 0 ? DemPublishedDelta(s->delta_s, s->shear_energy, s->shear, A, ks) : 1;
  const PetscBool    kept = (PetscBool)((crack->state[k] & DEM_BOND_KEPT) != 0);
  PetscBool          broken = (PetscBool)(crack->damage[k] >= 1);
  DemPairState       pair;

  if (crack->state[k] & DEM_BOND_PARTED) { /* an ordinary contact now */
    *out = (DemPairForce){{0}};
    return;
  }
  DemPairGeometry_Internal(model->dim, view, net->part[k], &pair);

  /* compression: yields along the envelope, unloads elastically.  Eqs (4.57)-(4.59) */
  PetscReal elastic = pair.open - hist[DEM_PAST_SET * m];

  if (advance && s->n_branches > 0 && !kept) {
    PetscReal push = PetscMax(0, -kn * elastic);

    if (push > s->crush[0] * A) {
      const PetscReal most = DemCrushStress(s, -kn * pair.open / A) * A;

      if (push > most) {
        const PetscReal set = pair.open + most / kn;

        crack->work[k] += 0.5 * (hist[DEM_PAST_PUSH * m] + most) * (hist[DEM_PAST_SET * m] - set);
        hist[DEM_PAST_SET * m] = set;
        crack->state[k] |= DEM_BOND_WATCHED; /* from now on the plain spring is not its force, however small that is */
        elastic                = pair.open - set;
        push                   = most;
      }
    }
    hist[DEM_PAST_PUSH * m] = push;
  }

  /* tension.  Eqs (4.50)-(4.53) */
  PetscReal loss_n = DemPublishedLoss(hist[DEM_PAST_OPEN * m], delta_n), loss_s = DemPublishedLoss(hist[DEM_PAST_SLIDE * m], delta_s);
  PetscReal N = elastic <= 0 ? kn * elastic : broken ? 0 : (1 - loss_n) * kn * elastic;

  for (PetscInt c = 0; c < 3; c++) t[c] = ks * pair.slide[c];
  PetscReal shear = PetscSqrtReal(Dot3(t, t));

  if (advance && !broken && !kept) {
    const PetscReal yn = elastic > 0 ? 0.5 * kn * elastic * elastic : 0, ys = 0.5 * shear * shear / ks;
    /* The ledger's works are trapezoids: a spring then balances with the geometric mean over the step, exactly.  Eq. (4.28) */
    const PetscReal mean_n = hist[DEM_PAST_YN * m] > 0 ? PetscSqrtReal(yn * hist[DEM_PAST_YN * m]) : yn, mean_s = hist[DEM_PAST_YS * m] > 0 ? PetscSqrtReal(ys * hist[DEM_PAST_YS * m]) : ys;

    if (limit_n > 0 && elastic > hist[DEM_PAST_OPEN * m] * limit_n) {
      const PetscReal old = loss_n;

      hist[DEM_PAST_OPEN * m] = elastic / limit_n;
      loss_n                  = DemPublishedLoss(hist[DEM_PAST_OPEN * m], delta_n);
      crack->work[k] += mean_n * (loss_n - old);
      N = (1 - loss_n) * kn * elastic;
      Mark(model, k, DEM_BOND_TENSION);
      crack->damage[k] = PetscMax(crack->damage[k], PetscMin(1, (hist[DEM_PAST_OPEN * m] - 1) / delta_n));
    }
    const PetscReal limit_s = s->nonlocal ? hist[DEM_PAST_LIMIT_S * m] : s->shear > 0 ? s->shear * A + s->mu_static * PetscMax(0, -N) : 0;

    if (limit_s > 0 && shear > hist[DEM_PAST_SLIDE * m] * limit_s) { /* Eqs (4.54), (4.55) */
      const PetscReal old = loss_s;

      hist[DEM_PAST_SLIDE * m] = shear / limit_s;
      loss_s                   = DemPublishedLoss(hist[DEM_PAST_SLIDE * m], delta_s);
      crack->work[k] += mean_s * (loss_s - old);
      Mark(model, k, DEM_BOND_SHEAR);
      crack->damage[k] = PetscMax(crack->damage[k], PetscMin(1, (hist[DEM_PAST_SLIDE * m] - 1) / delta_s));
    }
    if (crack->damage[k] >= 1) { /* what the other direction still held goes too */
      crack->work[k] += mean_n * (1 - loss_n) + mean_s * (1 - loss_s);
      Break(model, k, view, &pair);
      broken = PETSC_TRUE;
      N      = PetscMin(0, N);
    }
    hist[DEM_PAST_YN * m] = yn;
    hist[DEM_PAST_YS * m] = ys;
  }
  out->normal = N;
  out->energy = N > 0 ? 0.5 * N * elastic : N < 0 ? 0.5 * kn * elastic * elastic : 0;
  for (PetscInt c = 0; c < 3; c++) out->couple_p[c] = out->couple_q[c] = 0;

  if (!broken) {
    const PetscReal share = 1 - pair.along / pair.length;

    out->shear = (1 - loss_s) * shear;
    out->energy += 0.5 * (1 - loss_s) * shear * shear / ks;
    for (PetscInt c = 0; c < 3; c++) {
      t[c] *= 1 - loss_s;
      out->force[c] = N * pair.n[c] + share * t[c];
    }
    for (PetscInt c = 0; c < 3; c++) {
      const PetscInt e = (c + 1) % 3, f = (c + 2) % 3;

      out->couple_p[c] = pair.a[e] * t[f] - pair.a[f] * t[e];
      out->couple_q[c] = -(pair.b[e] * t[f] - pair.b[f] * t[e]);
    }
    return;
  }

  /* broken: friction on the slide since it last was free.  Eq. (4.56) */
  PetscReal slip[3], length = 0;
  const PetscReal most = s->mu_dynamic * -N / ks;

  out->shear = 0;
  for (PetscInt c = 0; c < 3; c++) out->force[c] = N * pair.n[c];
  if (N >= 0) {
    if (advance) ToParticle(model->dim, view, pair.slide, crack->slip + 3 * k);
    return;
  }
  ToSpace(model->dim, view, crack->slip + 3 * k, slip);
  for (PetscInt c = 0; c < 3; c++) t[c] = pair.slide[c] - slip[c];
  const PetscReal along = Dot3(t, pair.n);

  for (PetscInt c = 0; c < 3; c++) t[c] -= along * pair.n[c];
  length = PetscSqrtReal(Dot3(t, t));
  if (length > most && advance) {
    for (PetscInt c = 0; c < 3; c++) {
      slip[c] += t[c] * (1 - most / length);
      t[c] *= most / length;
    }
    crack->rub[k] += ks * most * (length - most);
    ToParticle(model->dim, view, slip, crack->slip + 3 * k);
    length = most;
  }
  out->shear = ks * length;
  out->energy += 0.5 * ks * length * length;
  for (PetscInt c = 0; c < 3; c++) { /* both arms to the point half way across the gap: the couple on the pair is then exact */
    t[c] *= ks;
    pair.a[c] += 0.5 * pair.gap[c];
    pair.b[c] -= 0.5 * pair.gap[c];
    out->force[c] += t[c];
  }
  for (PetscInt c = 0; c < 3; c++) {
    const PetscInt e = (c + 1) % 3, f = (c + 2) % 3;

    out->couple_p[c] = pair.a[e] * t[f] - pair.a[f] * t[e];
    out->couple_q[c] = -(pair.b[e] * t[f] - pair.b[f] * t[e]);
  }
}

/* Elastic spring of bond k, for rules that do not break. */
static void Spring(DemModel model, PetscInt k, const DemPairView *view, DemPairForce *out)
{
  DemNetwork   net = model->net;
  DemPairState pair;

  DemPairGeometry_Internal(model->dim, view, net->part[k], &pair);
  const PetscReal N = net->kn[k] * pair.open, share = 1 - pair.along / pair.length, slide = PetscSqrtReal(Dot3(pair.slide, pair.slide));

  out->normal = N;
  out->shear  = net->ks[k] * slide;
  out->energy = 0.5 * N * pair.open + 0.5 * net->ks[k] * slide * slide;
  for (PetscInt c = 0; c < 3; c++) {
    const PetscInt e = (c + 1) % 3, f = (c + 2) % 3;

    out->force[c]    = N * pair.n[c] + share * net->ks[k] * pair.slide[c];
    out->couple_p[c] = net->ks[k] * (pair.a[e] * pair.slide[f] - pair.a[f] * pair.slide[e]);
    out->couple_q[c] = -net->ks[k] * (pair.b[e] * pair.slide[f] - pair.b[f] * pair.slide[e]);
  }
}

void DemPairNow_Internal(DemModel model, PetscInt k, DemPairForce *out)
{
  PetscReal         at[2][DEM_AT_ALL];
  const DemPairView view = {at[0], at[1]};

  DemCopyParticle_Internal(model, model->bonds.p[k], at[0]);
  DemCopyParticle_Internal(model, model->bonds.q[k], at[1]);
  if (model->net->hist) DemPairLaw_Internal(model, k, &view, PETSC_FALSE, out);
  else Spring(model, k, &view, out);
}
