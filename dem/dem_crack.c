/*
  dem_crack.c - bonds that are breaking, or near it.  Eqs (4.20)-(4.28), docs/theory.md

  The vectorised rule runs over every bond with (1 - D) k; what is here comes on top, one live (watched or damaged) bond at a
  time: D is advanced after the force pass with the sums of the same positions, the bond's force is cut by what D has grown,
  and a closed, broken part pushes. Blocks without a live bond never come here.
*/
#include "dem_rule.h"
#include <math.h>

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

/* The tooth that is due, or the margin of the nearer one; returns its D. */
static PetscReal Tooth(const DemStrength *curve, PetscReal k, PetscReal s, PetscReal damage, DemTooth *tooth)
{
  const DemTooth  own    = DemToothOf(curve, k, s, damage);
  const PetscReal margin = PetscMax(own.margin, tooth->margin);

  if (own.damage > tooth->damage) *tooth = own;
  tooth->margin = margin;
  return own.damage;
}

/* D of bond k under its total traction t~ now, and what broke it; at: record of p, ep, eq: dilations of the ends; keep: an onset found here stays;
   tooth: NULL, or D falls by teeth.  Eqs (4.20)-(4.25), (4.84) */
static PetscReal DamageNow(DemModel model, PetscInt k, const PetscReal *at, const Bond *bond, PetscReal ep, PetscReal eq, PetscBool keep, unsigned char *mode, DemTooth *tooth)
{
  const DemStrength *strength = &model->strength;
  DemStrength        weaker;
  DemCrackState     *crack = &model->crack;
  const PetscReal    G = model->g_shear, lambda = model->lambda, d = bond->d;
  PetscReal          t[3], D = crack->damage[k], axis[3] = {bond->n[0], bond->n[1], bond->n[2]};
  PetscBool          opens = PETSC_FALSE;

  *mode = 0;
  if (tooth) *tooth = (DemTooth){.damage = D, .margin = -1};
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
      const PetscReal now = tooth ? Tooth(strength, 2 * G / (c * d), Dot3(t, e) / c, crack->damage[k], tooth) : DemDamageTension(strength, G, c * d, Dot3(t, e) / c);

      if (now > D) {
        D     = now;
        *mode = DEM_BOND_TENSION;
      }
      if (((crack->state[k] | *mode) & DEM_BOND_TENSION) && Dot3(t, e) > 0) {
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
    DemStrength own = *strength;

    if (crack->limit) { /* softens from what it carries at the onset.  Eq. (4.65) */
      if (crack->limit[k] < 0) own.shear = PetscMin(strength->shear, PetscMax(load, DEM_SMALLEST_COSINE * strength->shear));
      else own.shear = crack->limit[k];
      if (keep) crack->limit[k] = own.shear;
    }
    if (tooth) {
      const DemStrength curve = {.tensile = own.shear, .fracture_energy = own.shear_energy, .softening = DEM_SOFTENING_LINEAR};

      now = Tooth(&curve, 2 * G / d, load, crack->damage[k], tooth);
    } else now = DemDamageShear(&own, G, d, load / own.shear);
    if (now > D) {
      D     = now;
      *mode = DEM_BOND_SHEAR;
    }
  }
  return D;
}

/* Advance D of bond k and book what that takes.  Eqs (4.26)-(4.28) */
static void Damage(DemModel model, PetscInt block, PetscInt k, const PetscReal *at, const Bond *bond, PetscReal ep, PetscReal eq)
{
  DemCrackState  *crack = &model->crack;
  const PetscReal G = model->g_shear, lambda = model->lambda, d = bond->d, A = model->bonds.k[k] * d, old = crack->damage[k];
  PetscReal       tangent[3];
  unsigned char   mode;
  DemTooth        tooth;
  const PetscReal D = DamageNow(model, k, at, bond, ep, eq, (PetscBool)(!crack->due || crack->due[k]), &mode, crack->due ? &tooth : NULL);

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
  PetscReal mean = crack->release[k] > 0 ? PetscSqrtReal(Y * crack->release[k]) : Y;

  crack->release[k] = Y;
  if (D <= old || Y == 0 || (crack->due && !crack->due[k])) return;
  if (crack->due) { /* the curve's part is fracture; what else is lost between the states is set free.  Eq. (4.86) */
    crack->excess[block] += (mean - Y * tooth.law) * (D - old);
    mean = Y * tooth.law;
  }
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
static PetscBool ClosedForce(DemModel model, PetscInt k, const PetscReal *at, const PetscReal *at_q, const Bond *bond, PetscReal broken, PetscBool advance, PetscReal force[3], PetscReal *energy)
{
  DemCrackState  *crack = &model->crack;
  const PetscBool whole = (PetscBool)(crack->damage[k] == 1);
  const PetscReal full = 2 * model->g_shear * model->bonds.k[k] * broken;
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
    el[c] = crack->damage[k] > 0 ? tangent[c] - slip[c] : 0; /* what would begin to break here would slip from here */
    length += el[c] * el[c];
  }
  length = PetscSqrtReal(length);
  most   = -model->strength.mu_dynamic * normal;
  if (length > most && (advance || crack->due)) { /* a load step's tangent slides too */
    for (PetscInt c = 0; c < 3; c++) {
      slip[c] += el[c] * (1 - most / length);
      el[c] *= most / length;
    }
  }
  if (length > most && advance) {
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
  const PetscBool  advance = (PetscBool)((flags & DEM_WITH_FAILURE) != 0), tries = (PetscBool)((flags & DEM_TRY_FAILURE) != 0);
  PetscReal       *F = copy + DEM_COPY_F * wide;

  for (PetscInt l = 0; l < crack->n_live[block]; l++) {
    const PetscInt  k = live[l];
    const int       i = model->bonds.ip[k], j = model->bonds.iq[k];
    const PetscReal old = crack->damage[k], *at_p = DemCopyAt(copy, i), *at_q = DemCopyAt(copy, j), eps_p = at_p[DEM_AT_E], eps_q = at_q[DEM_AT_E];
    PetscReal      *fp = F + DEM_FORCE_ALL * i, *fq = F + DEM_FORCE_ALL * j, t[3], sp[3], sq[3], now = old;
    DemTooth        tooth;
    unsigned char   mode;
    Bond            bond;

    if (!advance && !tries && old <= 0) continue;
    BondState(model, k, at_p, at_q, &bond);
    if (advance && old < 1) {
      Damage(model, block, k, at_p, &bond, eps_p, eps_q);
      now = crack->damage[k];
    } else if (tries && old < 1) {
      now              = DamageNow(model, k, at_p, &bond, eps_p, eps_q, PETSC_FALSE, &mode, &tooth);
      crack->margin[k] = tooth.margin;
      crack->beyond[k] = tooth.beyond;
    }
    if (now > old) { /* take off what the pass over all bonds gave too much */
      const PetscReal off = -(now - old) * model->bonds.k[k], g2 = 2 * model->g_shear, ep = off * lambda * eps_p, eq = off * lambda * eps_q;

      if (advance) model->bonds.now[k] = (1 - now) * model->bonds.k[k];
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
    if (now > 0 && ClosedForce(model, k, at_p, at_q, &bond, now, advance, t, NULL)) {
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
    if (ClosedForce(model, k, at_p, at_q, &bond, model->crack.damage[k], PETSC_FALSE, force, &closed)) sum += closed;
  }
  return sum;
}
