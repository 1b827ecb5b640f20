/*
  dem_continue.c - a model of more particles goes on where one of fewer stands, and what intact facets bear.  Section 8 of docs/theory.md

  A particle keeps motion and turn, a facet its damage with all that belongs to it, to the bit; both models keep their
  particles along one curve, so a bond's ends stand in the same order in both.
*/
#include "dem_impl.h"

static PetscErrorCode ContinueCracks(DemModel model, DemModel from, const PetscInt particle[], const PetscInt facet[])
{
  DemCrackState       *crack = &model->crack;
  const DemCrackState *old = &from->crack;
  PetscInt            *bond;

  PetscFunctionBegin;
  PetscCheck(old->damage, model->comm, PETSC_ERR_ARG_WRONG, "One model can break, the other cannot");
  PetscCall(PetscMalloc1(from->cells.n_facets, &bond));
  for (PetscInt f = 0; f < from->cells.n_facets; f++) bond[f] = -1;
  for (PetscInt k = 0; k < from->bonds.n; k++) bond[from->bonds.facet[k]] = k;
  for (PetscInt k = 0; k < model->bonds.n; k++) {
    const PetscInt f = facet[model->bonds.facet[k]], o = f >= 0 ? bond[f] : -1;

    if (o < 0) continue;
    crack->damage[k]  = old->damage[o];
    crack->work[k]    = old->work[o];
    crack->rub[k]     = old->rub[o];
    crack->time[k]    = old->time[o];
    crack->release[k] = old->release[o];
    if (crack->limit && old->limit) crack->limit[k] = old->limit[o];
    for (PetscInt c = 0; c < 3; c++) {
      crack->e[3 * k + c]    = old->e[3 * o + c];
      crack->slip[3 * k + c] = old->slip[3 * o + c];
    }
    if (!(crack->state[k] & DEM_BOND_KEPT) && !(old->state[o] & DEM_BOND_KEPT)) crack->state[k] = old->state[o];
    model->bonds.now[k] = (1 - crack->damage[k]) * model->bonds.k[k];
  }
  PetscCall(PetscFree(bond));
  for (PetscInt p = 0; p < model->n; p++) {
    const PetscInt k = particle[model->at[p]];

    if (k >= 0) PetscCall(PetscArraycpy(crack->stress + 6 * p, old->stress + 6 * from->rank_of[k], 6));
  }
  for (PetscInt b = 0; b < model->blocks.n_blocks; b++) {
    crack->n_live[b] = 0;
    for (PetscInt k = model->blocks.bond[b]; k < model->blocks.bond[b + 1]; k++)
      if (crack->damage[k] > 0 || (crack->state[k] & DEM_BOND_WATCHED)) crack->live[model->blocks.bond[b] + crack->n_live[b]++] = k;
    crack->awake[b] = crack->n_live[b] > 0;
  }
  crack->steps = old->steps;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelContinue(DemModel model, DemModel from, const PetscInt particle[], const PetscInt facet[])
{
  const PetscInt n = model->n, m = from->n;
  PetscInt      *of;

  PetscFunctionBegin;
  PetscCheck(model->ready && from->ready && !model->started, model->comm, PETSC_ERR_ORDER, "A model goes on from another after set-up and before its first step");
  PetscCheck(model->dim == from->dim && model->n_faces == from->n_faces, model->comm, PETSC_ERR_ARG_WRONG, "The two models are not of one body");
  PetscCheck(model->n_tools == from->n_tools && model->contacts.on == from->contacts.on, model->comm, PETSC_ERR_ARG_WRONG, "The two models do not touch the same");
  PetscCall(PetscMalloc1(m, &of));
  for (PetscInt o = 0; o < m; o++) of[o] = -1;
  for (PetscInt p = 0; p < n; p++) {
    const PetscInt o = particle[model->at[p]] >= 0 ? from->rank_of[particle[model->at[p]]] : -1;

    if (o < 0) continue;
    of[o] = p;
    for (PetscInt d = 0; d < 3; d++) {
      model->u[d * n + p]    = from->u[d * m + o];
      model->v[d * n + p]    = from->v[d * m + o];
      model->spin[d * n + p] = from->spin[d * m + o];
    }
    for (PetscInt d = 0; d < 4; d++) model->rot[d * n + p] = from->rot[d * m + o];
  }
  model->time          = from->time;
  model->dt_last       = from->dt_last;
  model->started       = from->started;
  model->work          = from->work;
  model->work_in       = from->work_in;
  model->damped        = from->damped;
  model->contact_lost  = from->contact_lost;
  model->friction_lost = from->friction_lost;
  if (model->crack.damage) PetscCall(ContinueCracks(model, from, particle, facet));
  if (model->contacts.on) PetscCall(DemContactsContinue_Internal(model, from, of));
  PetscCall(DemToolsContinue_Internal(model, from, of));
  PetscCall(PetscFree(of));
  DemFacesSetTime_Internal(model, model->time);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetTime(DemModel model, PetscReal *t)
{
  PetscFunctionBegin;
  *t = model->time;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Traction t~ [Pa] of the whole, unweighted facet of bond k on its first end, arms of both ends, distance and normal now. */
static void Traction(DemModel model, PetscInt k, PetscReal t[3], PetscReal a[3], PetscReal b[3], PetscReal normal[3])
{
  const DemBonds *bonds = &model->bonds;
  const PetscInt  n = model->n, p = bonds->p[k], q = bonds->q[k];
  const PetscReal ep = model->dilation[p] / (model->share ? model->share[p] : 1), eq = model->dilation[q] / (model->share ? model->share[q] : 1);
  PetscReal       y[3] = {0}, ta[3], tb[3], ty[3], d = 0;

  for (PetscInt c = 0; c < 3; c++) a[c] = b[c] = 0;
  for (PetscInt c = 0; c < model->dim; c++) {
    a[c] = bonds->arm[c * bonds->n + k];
    y[c] = model->x0[c * n + q] - model->x0[c * n + p];
    b[c] = a[c] - y[c];
    d += y[c] * y[c];
  }
  d = PetscSqrtReal(d);
  DemTurn(model->dim, n, p, model->rot, a, ta);
  DemTurn(model->dim, n, q, model->rot, b, tb);
  DemTurn(model->dim, n, p, model->rot, y, ty);
  for (PetscInt c = 0; c < 3; c++) {
    const PetscReal gap = c < model->dim ? model->u[c * n + q] - model->u[c * n + p] + tb[c] - ta[c] : 0;

    a[c] += ta[c];
    b[c] += tb[c];
    t[c]      = (2 * model->g_shear * gap + model->lambda * (ep * a[c] - eq * b[c])) / d;
    normal[c] = (y[c] + ty[c]) / d;
  }
}

/*
  DemModelGetFacetUse - how near its strength a facet is that cannot break: the rule that would break it, eqs (4.20), (4.25)

  1 = at its strength, but no more than twice the mean stress: under pressure a traction that is off by a per cent of it, as in an
  overlap, is not a crack. The opening direction is that of both ends' mean stress, from whole facets less what is broken of them,
  without the weights of an overlap. Dilations are those of the last force evaluation. On several ranks facets are the whole body's, and all
  ranks learn all uses.
*/
PetscErrorCode DemModelGetFacetUse(DemModel model, PetscInt n, const PetscInt facet[], PetscReal use[])
{
  const DemBonds    *bonds = &model->bonds;
  const DemRanks     r = model->ranks;
  PetscInt          *bond, *here; /* of each facet here; facet here of each asked for, -1 */
  PetscReal         *sum;
  PetscBool         *wanted;

  PetscFunctionBegin;
  PetscCheck(model->ready && !model->net, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() first, for elasticity exact");
  PetscCall(PetscMalloc1(model->cells.n_facets, &bond));
  PetscCall(PetscCalloc2(6 * model->n, &sum, model->n, &wanted));
  for (PetscInt k = 0; k < bonds->n; k++)
    if (bonds->facet[k] >= 0) bond[bonds->facet[k]] = k;
  PetscCall(PetscMalloc1(n, &here));
  for (PetscInt i = 0; i < n; i++) {
    here[i] = facet[i];
    if (r) {
      PetscCall(PetscFindInt(facet[i], model->cells.n_facets, r->facet, &here[i]));
      if (here[i] < 0) continue;
    }
    wanted[bonds->p[bond[here[i]]]] = wanted[bonds->q[bond[here[i]]]] = PETSC_TRUE;
  }
  for (PetscInt k = 0; k < bonds->n; k++) {
    const PetscInt  p = bonds->p[k], q = bonds->q[k];
    PetscReal       t[3], a[3], b[3], normal[3], area;

    if (bonds->facet[k] < 0 || (!wanted[p] && !wanted[q])) continue;
    Traction(model, k, t, a, b, normal);
    area = model->cells.area[bonds->facet[k]] * (1 - (model->crack.damage ? model->crack.damage[k] : 0));
    for (PetscInt side = 0; side < 2; side++) {
      PetscReal       *s = sum + 6 * (side ? q : p);
      const PetscReal *r = side ? b : a, force = side ? -area : area;

      for (PetscInt c = 0; c < 3; c++) {
        s[c] += force * t[c] * r[c];
        s[3 + c] += 0.5 * force * (t[c] * r[(c + 1) % 3] + t[(c + 1) % 3] * r[c]);
      }
    }
  }
  if (r) PetscCall(DemHaloStress_Internal(model, sum));
  for (PetscInt i = 0; i < n; i++) {
    use[i] = -1; /* another rank's */
    if (here[i] < 0 || !DemBondIsMine(model, bond[here[i]])) continue;
    const PetscInt k = bond[here[i]], p = bonds->p[k], q = bonds->q[k];
    PetscReal      t[3], a[3], b[3], normal[3], s[6], e[3], along = 0, pull = 0, tn = 0, ts = 0;
    const DemStrength own = DemStrengthOf_Internal(model, k), *strength = &own;

    Traction(model, k, t, a, b, normal);
    for (PetscInt c = 0; c < 6; c++) s[c] = sum[6 * p + c] + sum[6 * q + c];
    const PetscReal major = DemMajorDirection_Internal(model->dim, s, e) / (model->volume[p] + model->volume[q]);

    for (PetscInt c = 0; c < 3; c++) {
      along += normal[c] * e[c];
      pull += t[c] * e[c];
      tn += t[c] * normal[c];
    }
    for (PetscInt c = 0; c < 3; c++) ts += PetscSqr(t[c] - tn * normal[c]);
    use[i] = strength->tensile > 0 && PetscAbsReal(along) >= DEM_SMALLEST_COSINE ? PetscMax(0, PetscMin(pull / along, 2 * major) / strength->tensile) : 0;
    if (strength->shear > 0) use[i] = PetscMax(use[i], (PetscSqrtReal(ts) + strength->mu_static * tn) / strength->shear);
  }
  if (r) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, use, (PetscMPIInt)n, MPIU_REAL, MPI_MAX, model->comm));
  PetscCall(PetscFree2(sum, wanted));
  PetscCall(PetscFree(here));
  PetscCall(PetscFree(bond));
  PetscFunctionReturn(PETSC_SUCCESS);
}
