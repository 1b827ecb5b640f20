/* dem_fields.c - stress and strain of each particle, for output: plain loops, packing's order. */
#include "dem_rule.h"
#include "dem_tool_impl.h"

typedef struct {
  PetscReal a[3], b[3], gap[3]; /* arms and gap now */
} BondNow;

static void BondState(DemModel model, PetscInt e, BondNow *now)
{
  const DemBonds *bonds = &model->bonds;
  const PetscInt  n = model->n, p = bonds->p[e], q = bonds->q[e];
  PetscReal       ra[3] = {0}, rb[3] = {0}, ta[3], tb[3];

  for (PetscInt d = 0; d < model->dim; d++) {
    ra[d] = bonds->arm[d * bonds->n + e];
    rb[d] = ra[d] - (model->x0[d * n + q] - model->x0[d * n + p]);
  }
  DemTurn(model->dim, n, p, model->rot, ra, ta);
  DemTurn(model->dim, n, q, model->rot, rb, tb);
  for (PetscInt d = 0; d < 3; d++) {
    now->a[d]   = ra[d] + ta[d];
    now->b[d]   = rb[d] + tb[d];
    now->gap[d] = d < model->dim ? model->u[d * n + q] - model->u[d * n + p] + tb[d] - ta[d] : 0;
  }
}

/* The broken part of a facet, pressed shut and rubbing: added to t.  Eq. (4.26) */
static void AddClosed(DemModel model, PetscInt e, const BondNow *now, PetscReal t[3])
{
  const DemCrackState *crack = &model->crack;
  const PetscInt       n = model->n, p = model->bonds.p[e], q = model->bonds.q[e];
  const PetscReal      stiff = 2 * model->g_shear * model->bonds.k[e] * crack->damage[e];
  PetscReal            y[3] = {0}, turn[3], slip[3], d = 0, normal = 0;

  if (crack->state[e] & (DEM_BOND_PARTED | DEM_BOND_SLID)) return;
  for (PetscInt c = 0; c < model->dim; c++) {
    y[c] = model->x0[c * n + q] - model->x0[c * n + p];
    d += y[c] * y[c];
  }
  DemTurn(model->dim, n, p, model->rot, y, turn);
  for (PetscInt c = 0; c < 3; c++) {
    y[c] = (y[c] + turn[c]) / PetscSqrtReal(d); /* the facet's normal now: it turns with p, as the slip does */
    normal += now->gap[c] * y[c];
  }
  if (normal >= 0) return;
  DemTurn(model->dim, n, p, model->rot, crack->slip + 3 * e, turn);
  for (PetscInt c = 0; c < 3; c++) {
    slip[c] = crack->slip[3 * e + c] + turn[c];
    t[c] += stiff * (now->gap[c] - slip[c]); /* normal part, and what of the tangential one has not slipped */
  }
}

void DemBondForce_Internal(DemModel model, PetscInt e, PetscReal t[3])
{
  const DemBonds *b = &model->bonds;
  const PetscReal g2 = 2 * model->g_shear * (b->weight ? b->weight[e] : 1);
  BondNow         now;

  if (model->net) {
    DemPairForce pair;

    DemPairNow_Internal(model, e, &pair);
    for (PetscInt d = 0; d < 3; d++) t[d] = pair.force[d] + (model->net->nu_force ? DemPoissonForce_Internal(model, e, d) : 0);
    return;
  }
  BondState(model, e, &now);
  for (PetscInt d = 0; d < 3; d++) t[d] = b->now[e] * (g2 * now.gap[d] + model->lambda * (model->dilation[b->p[e]] * now.a[d] - model->dilation[b->q[e]] * now.b[d]));
  if (model->crack.damage && model->crack.damage[e] > 0) AddClosed(model, e, &now, t);
}

/* Symmetric part of sum(vector (x) arm)/volume into Voigt xx yy zz xy yz zx. */
static void AddVoigt(const PetscReal t[3], const PetscReal arm[3], PetscReal scale, PetscReal s[6])
{
  for (PetscInt d = 0; d < 3; d++) s[d] += scale * t[d] * arm[d];
  s[3] += 0.5 * scale * (t[0] * arm[1] + t[1] * arm[0]);
  s[4] += 0.5 * scale * (t[1] * arm[2] + t[2] * arm[1]);
  s[5] += 0.5 * scale * (t[2] * arm[0] + t[0] * arm[2]);
}

/* Love-Weber stress, boundary facets included [Pa].  Eq. (4.15) */
PetscErrorCode DemStress_Internal(DemModel model, PetscReal *stress)
{
  const DemBonds *b = &model->bonds;
  const DemWalls *w = &model->walls;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(stress, 6 * model->n));
  for (PetscInt e = 0; e < b->n; e++) {
    const PetscInt p = b->p[e], q = b->q[e];
    PetscReal      t[3];
    BondNow        now;

    BondState(model, e, &now);
    DemBondForce_Internal(model, e, t);
    AddVoigt(t, now.a, 1 / model->volume[p], stress + 6 * model->at[p]);
    AddVoigt(t, now.b, -1 / model->volume[q], stress + 6 * model->at[q]);
  }
  for (PetscInt i = 0; i < w->n; i++) {
    const PetscInt p = w->owner[i];
    PetscReal      t[3];

    DemFacetForce_Internal(model, i, t);
    AddVoigt(t, &w->arm[3 * i], 1 / model->volume[p], stress + 6 * model->at[p]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Symmetric gradient by the divergence theorem over the cell, each facet moving with the mean of its two sides.  Eq. (4.16) */
PetscErrorCode DemStrain_Internal(DemModel model, PetscReal *strain)
{
  const DemBonds *b = &model->bonds;
  const DemCells *cells = &model->cells;
  const PetscInt  n = model->n;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(strain, 6 * n));
  for (PetscInt e = 0; e < b->n; e++) {
    const PetscInt p = b->p[e], q = b->q[e];
    PetscReal      normal[3] = {0}, mean[3] = {0};
    BondNow        now;

    if (model->net) break; /* its bonds are not its facets */
    BondState(model, e, &now);
    for (PetscInt d = 0; d < model->dim; d++) normal[d] = model->x0[d * n + q] - model->x0[d * n + p]; /* length d: k d = area */
    for (PetscInt d = 0; d < model->dim; d++) {
      const PetscReal own = model->u[d * n + p] + now.a[d] - b->arm[d * b->n + e];

      mean[d] = own + 0.5 * now.gap[d];
    }
    AddVoigt(mean, normal, b->k[e] / model->volume[p], strain + 6 * model->at[p]);
    AddVoigt(mean, normal, -b->k[e] / model->volume[q], strain + 6 * model->at[q]);
  }
  for (PetscInt k = 0; k < cells->n_facets && model->net; k++) {
    const PetscInt side[2] = {cells->p[k], cells->q[k]};
    PetscReal      normal[3], mean[3] = {0}, d = 0;

    for (PetscInt c = 0; c < 3; c++) {
      normal[c] = model->packing.x[3 * side[1] + c] - model->packing.x[3 * side[0] + c];
      d += normal[c] * normal[c];
    }
    for (PetscInt s = 0; s < 2; s++) {
      const PetscInt p = model->rank_of[side[s]];
      PetscReal      arm[3], turn[3];

      for (PetscInt c = 0; c < 3; c++) arm[c] = c < model->dim ? cells->at[3 * k + c] - model->packing.x[3 * side[s] + c] : 0;
      DemTurn(model->dim, n, p, model->rot, arm, turn);
      for (PetscInt c = 0; c < model->dim; c++) mean[c] += 0.5 * (model->u[c * n + p] + turn[c]);
    }
    for (PetscInt s = 0; s < 2; s++) AddVoigt(mean, normal, (s ? -1 : 1) * cells->area[k] / PetscSqrtReal(d) / model->volume[model->rank_of[side[s]]], strain + 6 * side[s]);
  }
  for (PetscInt k = 0; k < cells->n_walls; k++) {
    const PetscInt p = model->rank_of[cells->wall_p[k]];
    PetscReal      arm[3], turn[3], move[3] = {0};

    for (PetscInt d = 0; d < 3; d++) arm[d] = cells->wall_at[3 * k + d] - model->packing.x[3 * cells->wall_p[k] + d];
    DemTurn(model->dim, n, p, model->rot, arm, turn);
    for (PetscInt d = 0; d < model->dim; d++) move[d] = model->u[d * n + p] + turn[d];
    AddVoigt(move, &cells->wall_normal[3 * k], cells->wall_area[k] / model->volume[p], strain + 6 * model->at[p]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void DemDamage_Internal(DemModel model, PetscReal *damage)
{
  const DemBonds *b = &model->bonds;

  for (PetscInt k = 0; k < model->n; k++) damage[k] = 0;
  if (!model->crack.damage) return;
  for (PetscInt e = 0; e < b->n; e++) {
    const PetscInt p = model->at[b->p[e]], q = model->at[b->q[e]];

    damage[p] = PetscMax(damage[p], model->crack.damage[e]);
    damage[q] = PetscMax(damage[q], model->crack.damage[e]);
  }
}

PetscErrorCode DemModelGetGroupMiddle(DemModel model, const char *group, PetscReal middle[3])
{
  const DemCells *cells = &model->cells;
  PetscReal       area  = 0;
  PetscInt        face;

  PetscFunctionBegin;
  for (PetscInt d = 0; d < 3; d++) middle[d] = 0;
  for (PetscInt k = 0; k < model->n_tools; k++) {
    PetscBool same;

    PetscCall(PetscStrcmp(group, model->tool[k]->name, &same));
    if (!same) continue;
    for (PetscInt d = 0; d < 3; d++) middle[d] = model->tool[k]->centre0[d];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(DemBodyFindFace(&model->body, group, &face));
  PetscCheck(face >= 0, model->comm, PETSC_ERR_ARG_WRONG, "No face or tool '%s'", group);
  for (PetscInt k = 0; k < cells->n_walls; k++)
    if (cells->wall_face[k] == face) {
      area += cells->wall_area[k];
      for (PetscInt d = 0; d < 3; d++) middle[d] += cells->wall_area[k] * cells->wall_at[3 * k + d];
    }
  if (model->ranks) {
    PetscReal all[4] = {area, middle[0], middle[1], middle[2]};

    PetscCall(DemSumRanks_Internal(model, 4, all));
    area = all[0];
    for (PetscInt d = 0; d < 3; d++) middle[d] = all[1 + d];
  }
  for (PetscInt d = 0; d < 3 && area > 0; d++) middle[d] /= area;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetFacet(DemModel model, PetscInt facet, PetscReal at[3], PetscReal normal[3], PetscReal *area)
{
  const DemCells *cells = &model->cells;
  PetscReal       d = 0;

  PetscFunctionBegin;
  PetscCheck(facet >= 0 && facet < cells->n_facets, model->comm, PETSC_ERR_ARG_OUTOFRANGE, "Facet %" PetscInt_FMT " of %" PetscInt_FMT, facet, cells->n_facets);
  for (PetscInt c = 0; c < 3; c++) {
    at[c]     = cells->at[3 * facet + c];
    normal[c] = model->packing.x[3 * cells->q[facet] + c] - model->packing.x[3 * cells->p[facet] + c];
    d += normal[c] * normal[c];
  }
  for (PetscInt c = 0; c < 3; c++) normal[c] /= PetscSqrtReal(d);
  *area = cells->area[facet];
  PetscFunctionReturn(PETSC_SUCCESS);
}
