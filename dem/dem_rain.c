/*
  dem_rain.c - grains that come one after the other while the run goes on.  Eqs (5.83)-(5.86)

  All of them exist from the start, asleep: marked as gone, without velocity or force, in no list. At its instant a grain
  is put at a random place of the body's box where it touches nobody; from then on it is a particle like any other. Places
  are numbers of a seed and of the instant, so a run, its resumed twin and one with more threads lay down the same rain. On
  several ranks each looks whether the place is free of its own grains, and the grain's owner puts it there.
*/
#include "dem_pack_impl.h"
#include "dem_tool_impl.h"

#define STREAM_RAIN 24 /* of DemPackRandom */
#define PLACES 32      /* tried for one grain; then its turn passes */

PetscErrorCode DemPackingCreateRain(const DemBody *body, const DemPackingOptions *options, DemPacking *packing)
{
  const PetscReal spread = options->spread;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(packing, sizeof(*packing)));
  BaseCheckInput(spread >= 0 && spread <= 0.6, PETSC_COMM_SELF, "The spread of radii is %.6g; between 0 and 0.6 (spread)", (double)spread);
  BaseCheckInput(options->radius > 0 && options->count > 0, PETSC_COMM_SELF, "A rain needs a radius and at least one grain (radius %.6g m, %" PetscInt_FMT " grains)", (double)options->radius, options->count);
  for (PetscInt d = 0; d < body->dim; d++)
    BaseCheckInput(body->high[d] - body->low[d] > 2 * options->radius * (1 + spread), PETSC_COMM_SELF, "The rain's box is %.6g m wide along %c; its largest grain measures %.6g m", (double)(body->high[d] - body->low[d]),
                   (char)('x' + d), (double)(2 * options->radius * (1 + spread)));
  packing->n = options->count;
  PetscCall(PetscCalloc1(3 * packing->n, &packing->x));
  PetscCall(PetscMalloc1(packing->n, &packing->r));
  for (PetscInt k = 0; k < packing->n; k++) {
    packing->r[k] = options->radius * (1 + spread * (2 * DemPackRandom(options->seed, 0, k) - 1));
    for (PetscInt d = 0; d < body->dim; d++) packing->x[3 * k + d] = 0.5 * (body->low[d] + body->high[d]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetRain(DemModel model, PetscReal rate, PetscInt seed)
{
  PetscFunctionBegin;
  PetscCheck(model->packing.n && !model->ready, model->comm, PETSC_ERR_ORDER, "A rain is set between DemModelSetBody() and DemModelSetUp()");
  BaseCheckInput(!model->bonded, model->comm, "Grains that come later cannot be bonded");
  BaseCheckInput(rate > 0 && !PetscIsInfOrNanReal(rate), model->comm, "The rain brings %.6g grains a second; it must be positive (rate)", (double)rate);
  model->rain = (DemRain){.rate = rate, .seed = seed};
  PetscFunctionReturn(PETSC_SUCCESS);
}

void DemRainSleep_Internal(DemModel model)
{
  for (PetscInt p = 0; p < model->n; p++) {
    model->contacts.gone[p] = 1;
    for (PetscInt d = 0; d < model->dim; d++) model->v[d * model->n + p] = model->f[d * model->n + p] = 0;
  }
  for (PetscInt k = 0; k < 3 * model->clumps.n; k++) model->clumps.v[k] = 0;
  model->contacts.n_gone = model->ranks ? model->ranks->particles : model->n; /* of all ranks */
}

/* Of what is kept here. */
static PetscBool Free(DemModel model, const PetscReal x[3], PetscReal r)
{
  const DemContacts *c = &model->contacts;
  const PetscInt     n = model->n, dim = model->dim;
  DemTouch           touch[DEM_TOUCHES];

  for (PetscInt p = 0; p < model->own; p++) {
    PetscReal d2 = 0;

    if (c->gone[p]) continue;
    for (PetscInt d = 0; d < dim; d++) {
      const PetscReal L = c->options.domain == DEM_DOMAIN_PERIODIC ? c->options.high[d] - c->options.low[d] : 0;
      PetscReal       y = x[d] - model->x0[d * n + p] - model->u[d * n + p];

      if (L > 0) y -= L * rint(y / L);
      d2 += y * y;
    }
    if (d2 <= PetscSqr(r + model->r[p])) return PETSC_FALSE;
  }
  for (PetscInt k = 0; k < model->n_tools; k++)
    if (DemToolTouch_Internal(model->tool[k], dim, x, r, touch)) return PETSC_FALSE;
  return PETSC_TRUE;
}

/* Clump k wakes at x, as a grain does below. */
static void WakeClump(DemModel model, PetscInt k, const PetscReal x[3])
{
  DemClumps      *c = &model->clumps;
  const PetscReal dt = model->started ? model->dt_last : 0;
  PetscReal       v[3], brought = 0;

  for (PetscInt d = 0; d < 3; d++) {
    v[d] = model->initial_velocity[d] - 0.5 * dt * model->gravity[d];
    brought += 0.5 * c->mass[k] * v[d] * (v[d] + dt * model->gravity[d]);
  }
  DemClumpsPlace_Internal(model, k, x, v);
  for (PetscInt i = c->start[k]; i < c->start[k + 1]; i++) model->contacts.gone[c->member[i]] = 0;
  model->contacts.n_gone -= c->start[k + 1] - c->start[k];
  if (!model->started) return;
  model->contacts.taken -= brought;
  model->work_in += PetscAbsReal(brought);
}

/* Grain p, -1: another rank's, wakes at x; half a step of its weight behind, as velocities are, and its kinetic energy comes from outside.  Eqs (5.84), (5.85) */
static PetscErrorCode Wake(DemModel model, PetscInt p, const PetscReal x[3])
{
  const PetscInt  n = model->n;
  const PetscReal dt = model->started ? model->dt_last : 0;
  PetscReal       brought = 0;

  PetscFunctionBegin;
  for (PetscInt d = 0; d < model->dim && p >= 0; d++) {
    const PetscReal g = model->gravity[d], v = model->initial_velocity[d] - 0.5 * dt * g;

    model->x0[d * n + p] = model->packing.x[3 * model->at[p] + d] = x[d];
    model->u[d * n + p] = 0;
    model->v[d * n + p] = v;
    brought += 0.5 * model->mass[p] * v * (v + dt * g);
  }
  if (p >= 0) model->contacts.gone[p] = 0;
  model->contacts.n_gone--;
  if (!model->started) PetscFunctionReturn(PETSC_SUCCESS); /* what is there at time 0 is where the ledger starts */
  model->contacts.taken -= brought; /* a sum over the ranks, but work_in is told by each */
  PetscCall(DemSumRanks_Internal(model, 1, &brought));
  model->work_in += PetscAbsReal(brought);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where grain k of the packing is kept, -1: by another rank; its radius. */
static PetscErrorCode FindGrain(DemModel model, PetscInt k, PetscInt *p, PetscReal *r)
{
  PetscFunctionBegin;
  if (!model->ranks) {
    *p = model->rank_of[k];
    *r = model->r[*p];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  *p = -1;
  for (PetscInt i = 0; i < model->own && *p < 0; i++)
    if (model->ranks->number[i] == k) *p = i;
  *r = *p < 0 ? 0 : model->r[*p];
  PetscCall(DemSumRanks_Internal(model, 1, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemRainFall_Internal(DemModel model)
{
  DemRain       *rain = &model->rain;
  const PetscInt was  = rain->next, all = DemGrains_Internal(model);

  PetscFunctionBegin;
  for (; rain->turn < all && (PetscReal)rain->turn <= model->time * rain->rate * (1 + 1e-12); rain->turn++) {
    const PetscInt k = rain->next;
    PetscInt       p = -1;
    PetscReal      r;

    if (model->clumps.n) r = model->clumps.reach[k]; /* all are clumps, or none is */
    else PetscCall(FindGrain(model, k, &p, &r));
    for (PetscInt place = 0; place < PLACES; place++) {
      PetscReal x[3] = {0};
      PetscInt  taken;

      for (PetscInt d = 0; d < model->dim; d++)
        x[d] = model->body.low[d] + r + (model->body.high[d] - model->body.low[d] - 2 * r) * DemPackRandom(rain->seed, STREAM_RAIN + d, PLACES * (PetscInt64)rain->turn + place);
      taken = !Free(model, x, r);
      PetscCall(DemContactsAgree_Internal(model, 1, &taken));
      if (taken) continue;
      if (model->clumps.n) WakeClump(model, k, x);
      else PetscCall(Wake(model, p, x));
      rain->next++;
      break;
    }
  }
  if (rain->next > was) PetscCall(DemContactsSearch_Internal(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemRainSave_Internal(DemModel model, Checkpoint c)
{
  const PetscInt state[2] = {model->rain.turn, model->rain.next};

  PetscFunctionBegin;
  PetscCall(CheckpointWriteInt(c, "dem/rain", 2, state));
  PetscCall(DemSaveRows_Internal(model, c, "dem/rest_position", DEM_OF_PARTICLES, 3, 1, model->x0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemRainLoad_Internal(DemModel model, Checkpoint c)
{
  PetscInt state[2];

  PetscFunctionBegin;
  PetscCall(CheckpointReadInt(c, "dem/rain", 2, state));
  PetscCall(DemLoadRows_Internal(model, c, "dem/rest_position", DEM_OF_PARTICLES, 3, 1, model->x0));
  model->rain.turn = state[0];
  model->rain.next = state[1];
  for (PetscInt p = 0; p < model->n; p++)
    for (PetscInt d = 0; d < model->dim; d++) model->packing.x[3 * model->at[p] + d] = model->x0[d * model->n + p];
  PetscFunctionReturn(PETSC_SUCCESS);
}
