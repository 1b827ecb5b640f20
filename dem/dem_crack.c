/*
  dem_crack.c - bonds that are breaking, or near it.  Eqs (4.20)-(4.28), docs/theory.md

  The vectorised rule runs over every bond with (1 - D) k; what is here comes on top, one live (watched or damaged) bond at a
  time: D is advanced after the force pass with the sums of the same positions, the bond's force is cut by what D has grown,
  and a closed, broken part pushes. Blocks without a live bond never come here.
*/
#include "dem_rule.h"
#include <math.h>
#include <omp.h>

/* A bond's geometry now, from the block's copy. */
typedef struct {
  PetscReal a[3], b[3], gap[3], n[3]; /* arms, gap, unit normal p to q (turned with p) */
  PetscReal rest[3];                  /* that normal at rest */
  PetscReal d, h;                     /* distance, and of p from the facet, at rest */
} Bond;

/* (R - I) r by the rotation of a record */
static inline void RecordTurn(PetscInt dim, const PetscReal *at, const PetscReal r[3], PetscReal out[3])
{
  DemTurn(dim, 1, 0, at + DEM_AT_R, r, out);
}

static void BondState(DemModel model, PetscInt k, const PetscReal *at_p, const PetscReal *at_q, Bond *bond)
{
  const DemBonds *bonds = &model->bonds;
  PetscReal       ra[3] = {0}, rb[3] = {0}, y[3] = {0}, ta[3], tb[3], tn[3], d2 = 0, dot = 0;

  for (PetscInt c = 0; c < model->dim; c++) {
    ra[c] = bonds->arm[c * bonds->n + k];
    y[c]  = at_q[DEM_AT_X + c] - at_p[DEM_AT_X + c];
    rb[c] = ra[c] - y[c];
    d2 += y[c] * y[c];
    dot += ra[c] * y[c];
  }
  bond->d = PetscSqrtReal(d2);
  bond->h = dot / bond->d;
  for (PetscInt c = 0; c < 3; c++) y[c] /= bond->d;
  RecordTurn(model->dim, at_p, ra, ta);
  RecordTurn(model->dim, at_q, rb, tb);
  RecordTurn(model->dim, at_p, y, tn);
  for (PetscInt c = 0; c < 3; c++) {
    bond->a[c]    = ra[c] + ta[c];
    bond->b[c]    = rb[c] + tb[c];
    bond->rest[c] = y[c];
    bond->n[c]    = y[c] + tn[c];
    bond->gap[c]  = c < model->dim ? at_q[DEM_AT_U + c] - at_p[DEM_AT_U + c] + tb[c] - ta[c] : 0;
  }
}

static inline PetscReal Dot3(const PetscReal a[3], const PetscReal b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Vector kept with a particle: to space, and back. */
static void ToSpace(DemModel model, const PetscReal *at, const PetscReal v[3], PetscReal out[3])
{
  PetscReal t[3];

  RecordTurn(model->dim, at, v, t);
  for (PetscInt c = 0; c < 3; c++) out[c] = v[c] + t[c];
}

static void ToParticle(DemModel model, const PetscReal *at, const PetscReal v[3], PetscReal out[3])
{
  const PetscReal *R = at + DEM_AT_R;

  if (model->dim == 2) {
    const PetscReal s = R[0], c = 1 + R[1];

    out[0] = c * v[0] + s * v[1];
    out[1] = -s * v[0] + c * v[1];
    out[2] = v[2];
  } else {
    const PetscReal w = R[0], x = -R[1], y = -R[2], z = -R[3];
    const PetscReal tx = 2 * (y * v[2] - z * v[1]), ty = 2 * (z * v[0] - x * v[2]), tz = 2 * (x * v[1] - y * v[0]);

    out[0] = v[0] + w * tx + (y * tz - z * ty);
    out[1] = v[1] + w * ty + (z * tx - x * tz);
    out[2] = v[2] + w * tz + (x * ty - y * tx);
  }
}

/* Condensed volumes of the damaged facets. */
void DemCracksSum_Internal(DemModel model, PetscInt block, PetscReal *copy)
{
  const DemBonds      *bonds = &model->bonds;
  const DemCrackState *crack = &model->crack;
  const PetscInt       wide = model->blocks.widest, *live = crack->live + model->blocks.bond[block];
  const PetscReal      ratio = 0.5 * model->lambda / model->g_shear;
  PetscReal           *V = copy + DEM_COPY_V * wide;

  for (PetscInt l = 0; l < crack->n_live[block]; l++) {
    const PetscInt k = live[l];
    const int      i = bonds->ip[k], j = bonds->iq[k];
    PetscReal      dot = 0, d2 = 0;

    if (crack->damage[k] <= 0) continue;
    for (PetscInt c = 0; c < model->dim; c++) {
      const PetscReal y = copy[DEM_AT_ALL * j + DEM_AT_X + c] - copy[DEM_AT_ALL * i + DEM_AT_X + c];

      dot += bonds->arm[c * bonds->n + k] * y;
      d2 += y * y;
    }
    V[i] += ratio * crack->damage[k] * bonds->k[k] * dot; /* A h = k d h */
    V[j] += ratio * crack->damage[k] * bonds->k[k] * (d2 - dot);
  }
}

/* Gap of the broken part, split, while it is closed: normal < 0.  Eq. (4.26) */
static PetscReal Closed(const Bond *bond, PetscReal tangent[3])
{
  const PetscReal normal = Dot3(bond->gap, bond->n);

  for (PetscInt c = 0; c < 3; c++) tangent[c] = bond->gap[c] - normal * bond->n[c];
  return normal;
}

/* The material's strengths, less where the facet is weak. */
DemStrength DemStrengthOf_Internal(DemModel model, PetscInt k)
{
  DemStrength own = model->strength;

  if (model->weak && model->bonds.facet[k] >= 0) {
    own.tensile *= model->weak[model->bonds.facet[k]];
    own.shear *= model->weak[model->bonds.facet[k]];
  }
  return own;
}

/* Advance D of bond k under its total traction t~; at: record of p, ep, eq: dilations of the ends.  Eqs (4.20)-(4.27) */
static void Damage(DemModel model, PetscInt k, const PetscReal *at, const Bond *bond, PetscReal ep, PetscReal eq)
{
  const DemStrength *strength = &model->strength;
  DemStrength        weaker;
  DemCrackState     *crack = &model->crack;
  const PetscReal    G = model->g_shear, lambda = model->lambda, d = bond->d, A = model->bonds.k[k] * d, old = crack->damage[k];
  PetscReal          t[3], D = old, tangent[3], axis[3] = {bond->n[0], bond->n[1], bond->n[2]};
  PetscBool          opens = PETSC_FALSE;
  unsigned char      mode = 0;

  if (model->weak) {
    weaker   = DemStrengthOf_Internal(model, k);
    strength = &weaker;
  }
  for (PetscInt c = 0; c < 3; c++) t[c] = (2 * G * bond->gap[c] + lambda * (ep * bond->a[c] - eq * bond->b[c])) / d;
  if (strength->tensile > 0 && (crack->state[k] & DEM_BOND_WATCHED)) {
    PetscReal e[3], c;

    ToSpace(model, at, crack->e + 3 * k, e);
    c = Dot3(e, bond->n);
    if (c >= DEM_SMALLEST_COSINE) {
      const PetscReal now = DemDamageTension(strength, G, c * d, Dot3(t, e) / c);

      if (now > D) {
        D    = now;
        mode = DEM_BOND_TENSION;
      }
      if (((crack->state[k] | mode) & DEM_BOND_TENSION) && Dot3(t, e) > 0) {
        opens = PETSC_TRUE;
        for (PetscInt i = 0; i < 3; i++) axis[i] = e[i];
      }
    }
  }
  if (strength->shear > 0 && (!crack->limit || crack->limit[k] != 0)) {
    const PetscReal tn = Dot3(t, axis);
    PetscReal       ts = 0, load, now;

    for (PetscInt c = 0; c < 3; c++) ts += PetscSqr(t[c] - tn * axis[c]);
    load = PetscSqrtReal(ts) + (opens ? 0 : strength->mu_static * tn);
    if (crack->limit) { /* softens from what it carries at the onset.  Eq. (4.65) */
      DemStrength own = *strength;

      if (crack->limit[k] < 0) crack->limit[k] = PetscMin(strength->shear, PetscMax(load, DEM_SMALLEST_COSINE * strength->shear));
      own.shear = crack->limit[k];
      now       = DemDamageShear(&own, G, d, load / own.shear);
    } else now = DemDamageShear(strength, G, d, load / strength->shear);
    if (now > D) {
      D    = now;
      mode = DEM_BOND_SHEAR;
    }
  }

  PetscReal Y = A * (G * Dot3(bond->gap, bond->gap) / d + lambda / d * (ep * Dot3(bond->gap, bond->a) - eq * Dot3(bond->gap, bond->b)) +
                     lambda * lambda / (4 * G) * (ep * ep * bond->h + eq * eq * (d - bond->h)));
  const PetscReal normal = Closed(bond, tangent);

  if (normal < 0) { /* the broken part goes on carrying what is pressed shut */
    PetscReal slip[3], el = 0;

    if (old == 0) ToParticle(model, at, tangent, crack->slip + 3 * k);
    ToSpace(model, at, crack->slip + 3 * k, slip);
    for (PetscInt c = 0; c < 3; c++) el += PetscSqr(tangent[c] - slip[c]);
    Y -= A * G / d * (normal * normal + el);
  }
  Y = PetscMax(Y, 0);
  /* The ledger's works are trapezoids; for a spring they then balance with the geometric mean of Y over the step, exactly. */
  const PetscReal mean = crack->release[k] > 0 ? PetscSqrtReal(Y * crack->release[k]) : Y;

  crack->release[k] = Y;
  if (D <= old || Y == 0) return;
  if (old == 0) crack->time[k] = model->time;
  crack->state[k] |= mode;
  crack->work[k] += mean * (D - old);
  crack->damage[k] = D;
  if (D == 1) crack->release[k] = 0;
}

/* Width of bond k's facet. */
static PetscReal FacetWidth(DemModel model, PetscInt k, PetscReal d)
{
  const PetscReal area = model->bonds.k[k] * d;

  return model->dim == 3 ? PetscSqrtReal(area) : area / model->body.thickness;
}

/* Part of a facet that faces the other side no more: slid past its rim, or turned away.  Eq. (4.82) */
static PetscReal PastRim(DemModel model, PetscInt k, const PetscReal *at_q, const Bond *bond, const PetscReal tangent[3])
{
  const PetscReal slid = PetscSqrtReal(Dot3(tangent, tangent)) / FacetWidth(model, k, bond->d);
  PetscReal       other[3];

  RecordTurn(model->dim, at_q, bond->rest, other);
  for (PetscInt c = 0; c < 3; c++) other[c] += bond->rest[c];
  return 1 - PetscMax(0, 1 - slid) * PetscMin(1, PetscMax(0, Dot3(bond->n, other)));
}

/* Contact of the closed broken fraction: spring against the gap, Coulomb on its slip.  Returns its force; eqs (4.26), (4.82) */
static PetscBool ClosedForce(DemModel model, PetscInt k, const PetscReal *at, const PetscReal *at_q, const Bond *bond, PetscBool advance, PetscReal force[3], PetscReal *energy)
{
  DemCrackState  *crack = &model->crack;
  const PetscBool whole = (PetscBool)(crack->damage[k] == 1);
  const PetscReal full = 2 * model->g_shear * model->bonds.k[k] * crack->damage[k];
  PetscReal       tangent[3], slip[3], el[3], length = 0, most, stiff = full, lost = 0;
  const PetscReal normal = Closed(bond, tangent);

  if (crack->state[k] & (DEM_BOND_PARTED | DEM_BOND_SLID)) return PETSC_FALSE; /* an ordinary contact now, or soon */
  if (whole) { /* as much of it as still faces the other */
    const PetscReal was = crack->release[k];

    if (advance) crack->release[k] = PetscMax(was, PastRim(model, k, at_q, bond, tangent));
    lost  = crack->release[k] - was;
    stiff = full * (1 - crack->release[k]);
  }
  if (normal >= 0) {
    if (advance) ToParticle(model, at, tangent, crack->slip + 3 * k);
    return PETSC_FALSE;
  }
  ToSpace(model, at, crack->slip + 3 * k, slip);
  for (PetscInt c = 0; c < 3; c++) {
    el[c] = tangent[c] - slip[c];
    length += el[c] * el[c];
  }
  length = PetscSqrtReal(length);
  most   = -model->strength.mu_dynamic * normal;
  if (length > most && advance) {
    for (PetscInt c = 0; c < 3; c++) {
      slip[c] += el[c] * (1 - most / length);
      el[c] *= most / length;
    }
    crack->rub[k] += stiff * most * (length - most);
    ToParticle(model, at, slip, crack->slip + 3 * k);
  }
  if (whole && advance) {
    crack->rub[k] += 0.5 * full * lost * (normal * normal + Dot3(el, el)); /* what the part held that is past the other's rim */
    if (crack->release[k] == 1) {
      crack->state[k] |= DEM_BOND_SLID;
      return PETSC_FALSE;
    }
  }
  for (PetscInt c = 0; c < 3; c++) force[c] = stiff * (normal * bond->n[c] + el[c]);
  if (energy) *energy = 0.5 * stiff * (normal * normal + Dot3(el, el));
  return PETSC_TRUE;
}

PetscBool DemCrackClosed_Internal(DemModel model, PetscInt e)
{
  const DemBonds *bonds = &model->bonds;
  const PetscInt  n = model->n, p = bonds->p[e], q = bonds->q[e];
  PetscReal       ra[3] = {0}, rb[3] = {0}, y[3] = {0}, ta[3], tb[3], tn[3], normal = 0;

  if (model->net) {
    DemPairForce now;

    DemPairNow_Internal(model, e, &now);
    return (PetscBool)(now.normal < 0);
  }
  if (model->crack.state[e] & DEM_BOND_SLID) return PETSC_FALSE;
  for (PetscInt c = 0; c < model->dim; c++) {
    ra[c] = bonds->arm[c * bonds->n + e];
    y[c]  = model->x0[c * n + q] - model->x0[c * n + p];
    rb[c] = ra[c] - y[c];
  }
  DemTurn(model->dim, n, p, model->rot, ra, ta);
  DemTurn(model->dim, n, q, model->rot, rb, tb);
  DemTurn(model->dim, n, p, model->rot, y, tn);
  for (PetscInt c = 0; c < model->dim; c++) normal += (model->u[c * n + q] - model->u[c * n + p] + tb[c] - ta[c]) * (y[c] + tn[c]);
  return (PetscBool)(normal < 0);
}

void DemCracksForce_Internal(DemModel model, PetscInt block, PetscReal *copy, PetscInt flags)
{
  DemCrackState   *crack = &model->crack;
  const PetscInt   wide = model->blocks.widest, *live = crack->live + model->blocks.bond[block];
  const PetscReal  lambda = model->lambda;
  const PetscBool  advance = (PetscBool)((flags & DEM_WITH_FAILURE) != 0);
  PetscReal       *F = copy + DEM_COPY_F * wide;

  for (PetscInt l = 0; l < crack->n_live[block]; l++) {
    const PetscInt  k = live[l];
    const int       i = model->bonds.ip[k], j = model->bonds.iq[k];
    const PetscReal old = crack->damage[k], *at_p = DemCopyAt(copy, i), *at_q = DemCopyAt(copy, j), eps_p = at_p[DEM_AT_E], eps_q = at_q[DEM_AT_E];
    PetscReal      *fp = F + DEM_FORCE_ALL * i, *fq = F + DEM_FORCE_ALL * j, t[3], sp[3], sq[3];
    Bond            bond;

    if (!advance && old <= 0) continue;
    BondState(model, k, at_p, at_q, &bond);
    if (advance && old < 1) Damage(model, k, at_p, &bond, eps_p, eps_q);
    if (crack->damage[k] > old) { /* take off what the pass over all bonds gave too much */
      const PetscReal off = -(crack->damage[k] - old) * model->bonds.k[k], g2 = 2 * model->g_shear, ep = off * lambda * eps_p, eq = off * lambda * eps_q;

      model->bonds.now[k] = (1 - crack->damage[k]) * model->bonds.k[k];
      for (PetscInt c = 0; c < 3; c++) {
        t[c]  = off * g2 * bond.gap[c] + ep * bond.a[c] - eq * bond.b[c];
        sp[c] = t[c] - ep * bond.gap[c];
        sq[c] = t[c] - eq * bond.gap[c];
        fp[c] += t[c];
        fq[c] -= t[c];
      }
      DemAddMoment(bond.a, sp, 1, fp);
      DemAddMoment(bond.b, sq, -1, fq);
    }
    if (crack->damage[k] > 0 && ClosedForce(model, k, at_p, at_q, &bond, advance, t, NULL)) {
      PetscReal ap[3]; /* normal and slip turn with p: its arm goes across the gap, so that the spring is conservative and the couple on the pair exact */

      for (PetscInt c = 0; c < 3; c++) {
        ap[c] = bond.a[c] + bond.gap[c];
        fp[c] += t[c];
        fq[c] -= t[c];
      }
      DemAddMoment(ap, t, 1, fp);
      DemAddMoment(bond.b, t, -1, fq);
    }
  }
}

PetscReal DemCracksEnergy_Internal(DemModel model, PetscInt block, PetscReal *copy)
{
  const PetscInt *live = model->crack.live + model->blocks.bond[block];
  PetscReal      sum = 0;

  for (PetscInt l = 0; l < model->crack.n_live[block]; l++) {
    const PetscInt k = live[l];
    const PetscReal *at_p = DemCopyAt(copy, model->bonds.ip[k]), *at_q = DemCopyAt(copy, model->bonds.iq[k]);
    PetscReal        force[3], closed;
    Bond             bond;

    if (model->crack.damage[k] <= 0) continue;
    BondState(model, k, at_p, at_q, &bond);
    if (ClosedForce(model, k, at_p, at_q, &bond, PETSC_FALSE, force, &closed)) sum += closed;
  }
  return sum;
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

PetscErrorCode DemCracksDestroy_Internal(DemModel model)
{
  DemCrackState *crack = &model->crack;

  PetscFunctionBegin;
  PetscCall(PetscFree7(crack->damage, crack->e, crack->slip, crack->work, crack->rub, crack->time, crack->release));
  PetscCall(PetscFree6(crack->state, crack->awake, crack->stress, crack->slot_stress, crack->slot_v, crack->volume));
  if (crack->live) PetscCall(PetscFree3(model->bonds.now, crack->live, crack->n_live));
  PetscCall(PetscFree(crack->limit));
  PetscCall(PetscFree(crack->facet));
  for (PetscInt c = 0; c < 7; c++) PetscCall(PetscFree(crack->list[c]));
  PetscCall(PetscFree(crack->mode));
  PetscCall(PetscFree(crack->bond));
  PetscCall(PetscFree(crack->place));
  PetscFunctionReturn(PETSC_SUCCESS);
}
