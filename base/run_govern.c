/*
  run_govern.c - the pace of the load from how far the body is from rest.  Eqs (1.9)-(1.11)

  Looks fall on steps that are multiples of a number of steps, so on no clock but the steps'. A look settles the pace two spans on: what models read a step ahead is
  what will be. Everything else is the inner stepper's.
*/
#include "run_govern.h"

#define GOVERN_STEPS 20  /* most steps between looks: a look costs about as much as a step */
#define GOVERN_SPAN  0.1 /* of the response time, at most: the law answers two spans late */
#define GOVERN_FALL  4   /* e-folds in a response time at most, on the way down; one on the way up */
#define GOVERN_BITS  20  /* of the measure count: round-off of sums over several ranks stays out of it */

struct _p_RunGovern {
  MPI_Comm         comm;
  RunGovernOptions o;
  Stepper          inner;
  TableClock      *clock;
  PetscInt         every;   /* steps between looks; 0 before the first step */
  PetscReal        now;     /* time of the state [s] */
  PetscReal        strain;  /* largest strain energy so far [J] */
  PetscReal        broken;  /* what fracture and friction had taken at the look before [J] */
  const char     **name, **unit;
};

void RunGovernClock(const RunGovernOptions *o, TableClock *clock)
{
  const PetscReal pace = o->slowest; /* what is quiet soon hurries; what began too fast has its waves for long */

  for (PetscInt k = 0; k < 4; k++) {
    clock->at[k]   = k - 1.;
    clock->load[k] = (k - 1.) * pace;
    clock->pace[k] = pace;
  }
}

PetscReal RunGovernPace(const RunGovernOptions *o, PetscReal then, PetscReal much, PetscReal pace, PetscReal h)
{
  const PetscReal want = PetscMax(o->slowest, much * o->fastest > then ? then / much : o->fastest); /* what is far from rest is so in proportion to the pace */
  const PetscReal turn = PetscMax(-GOVERN_FALL, PetscMin(1, PetscLogReal(want / pace))) * h / o->response;

  return PetscMax(o->slowest, PetscMin(o->fastest, pace * PetscExpReal(turn)));
}

/* How far from rest, over what is wanted. */
static PetscErrorCode Measure(RunGovern g, PetscReal h, PetscReal *much)
{
  const PetscReal *e = NULL;
  Ledger           ledger;
  PetscReal        ratio, most, broken;
  int              power;

  PetscFunctionBegin;
  *much = 0;
  if (g->o.unbalanced > 0) {
    PetscCall(g->inner.unbalanced(g->inner.ctx, &ratio));
    *much = ratio / g->o.unbalanced;
  }
  if (g->o.kinetic > 0 || g->o.loading > 0 || g->o.breaking > 0) {
    PetscCall(PetscMemzero(&ledger, sizeof(ledger)));
    PetscCall(g->inner.energy(g->inner.ctx, &ledger));
    e      = ledger.energy;
    most   = PetscMax(g->strain, PetscMax(e[LEDGER_STRAIN], PETSC_SMALL * e[LEDGER_KINETIC]));
    broken = PetscMax(g->broken, e[LEDGER_FRACTURE] + e[LEDGER_FRICTION]);
    if (most > 0) {
      if (g->o.kinetic > 0) *much = PetscMax(*much, PetscSqrtReal(PetscMax(0, e[LEDGER_KINETIC]) / most / g->o.kinetic)); /* energies go with the square of the pace */
      if (g->o.loading > 0) *much = PetscMax(*much, (most - g->strain) / most * g->o.response / h / g->o.loading);
      if (g->o.breaking > 0) *much = PetscMax(*much, (broken - g->broken) / most * g->o.response / h / g->o.breaking);
    }
    g->strain = most;
    g->broken = broken;
  }
  if (*much > 0 && !PetscIsInfOrNanReal(*much)) {
    const PetscReal part = frexp(*much, &power);

    *much = ldexp(rint(ldexp(part, GOVERN_BITS)), power - GOVERN_BITS);
  }
  PetscCallMPI(MPI_Bcast(much, 1, MPIU_REAL, 0, g->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the start of step n, time n dt: the span of steps from here is the next of those known; the one after it is settled. */
static PetscErrorCode Look(RunGovern g, PetscInt n, PetscReal dt)
{
  TableClock     *c = g->clock;
  const PetscReal h = g->every * dt;
  PetscReal       much;

  PetscFunctionBegin;
  PetscCall(Measure(g, h, &much));
  for (PetscInt k = 0; k < 3; k++) {
    c->at[k]   = c->at[k + 1];
    c->load[k] = c->load[k + 1];
    c->pace[k] = c->pace[k + 1];
  }
  c->at[3]   = (n + 2 * g->every) * dt;
  c->pace[3] = RunGovernPace(&g->o, c->pace[1], much, c->pace[2], h);
  c->load[3] = c->load[2] + 0.5 * h * (c->pace[2] + c->pace[3]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Step(void *ctx, PetscReal t, PetscReal dt)
{
  RunGovern      g = ctx;
  const PetscInt n = (PetscInt)PetscFloorReal(t / dt + 0.5);

  PetscFunctionBegin;
  if (!g->every) { /* knots on steps from now on; the pace so far was constant */
    g->every = (PetscInt)PetscMax(2, PetscMin(GOVERN_STEPS, GOVERN_SPAN * g->o.response / dt));
    for (PetscInt k = 0; k < 4; k++) {
      g->clock->at[k]   = (k - 1) * g->every * dt;
      g->clock->load[k] = g->clock->at[k] * g->clock->pace[k];
    }
  } else if (n % g->every == 0) PetscCall(Look(g, n, dt));
  PetscCall(g->inner.step(g->inner.ctx, t, dt));
  g->now = t + dt;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Stable(void *ctx, PetscReal *dt)
{
  RunGovern g = ctx;

  return g->inner.stable_step(g->inner.ctx, dt);
}

static PetscErrorCode Energy(void *ctx, Ledger *ledger)
{
  RunGovern g = ctx;

  return g->inner.energy(g->inner.ctx, ledger);
}

static PetscErrorCode Watch(void *ctx, RunWatch look, char fault[BASE_LINE])
{
  RunGovern g = ctx;

  return g->inner.watch(g->inner.ctx, look, fault);
}

static PetscErrorCode Unbalanced(void *ctx, PetscReal *ratio)
{
  RunGovern g = ctx;

  return g->inner.unbalanced(g->inner.ctx, ratio);
}

static PetscErrorCode Write(void *ctx, Output output)
{
  RunGovern g = ctx;

  return g->inner.write(g->inner.ctx, output);
}

static PetscErrorCode History(void *ctx, PetscInt i, PetscReal *value)
{
  RunGovern      g = ctx;
  const PetscInt n = g->inner.n_history;

  PetscFunctionBegin;
  if (i == n) *value = TableClockTime(g->clock, g->now);
  else if (i == n + 1) *value = TableClockPace(g->clock, g->now);
  else PetscCall(g->inner.history(g->inner.ctx, i, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Save(void *ctx, Checkpoint checkpoint)
{
  RunGovern         g = ctx;
  const TableClock *c = g->clock;
  PetscReal         kept[15] = {g->now, g->strain, g->broken};

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(kept + 3, c->at, 4));
  PetscCall(PetscArraycpy(kept + 7, c->load, 4));
  PetscCall(PetscArraycpy(kept + 11, c->pace, 4));
  PetscCall(CheckpointWriteReal(checkpoint, "govern/clock", 15, kept));
  PetscCall(CheckpointWriteInt(checkpoint, "govern/every", 1, &g->every));
  PetscCall(g->inner.save(g->inner.ctx, checkpoint));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The clock first: a model that loads its state may read its tables. */
static PetscErrorCode Load(void *ctx, Checkpoint checkpoint)
{
  RunGovern   g = ctx;
  TableClock *c = g->clock;
  PetscReal   kept[15];

  PetscFunctionBegin;
  PetscCall(CheckpointReadReal(checkpoint, "govern/clock", 15, kept));
  PetscCall(CheckpointReadInt(checkpoint, "govern/every", 1, &g->every));
  g->now    = kept[0];
  g->strain = kept[1];
  g->broken = kept[2];
  PetscCall(PetscArraycpy(c->at, kept + 3, 4));
  PetscCall(PetscArraycpy(c->load, kept + 7, 4));
  PetscCall(PetscArraycpy(c->pace, kept + 11, 4));
  for (PetscInt k = 0; k < 3; k++)
    BaseCheckInput(c->at[k + 1] > c->at[k] && c->load[k + 1] > c->load[k], g->comm, "The checkpoint is damaged: the load's clock does not go forward");
  PetscCall(g->inner.load(g->inner.ctx, checkpoint));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RunGovernCreate(MPI_Comm comm, const RunGovernOptions *o, const Stepper *inner, TableClock *clock, RunGovern *govern)
{
  RunGovern g;

  PetscFunctionBegin;
  BaseCheckInput(o->slowest > 0 && o->fastest >= o->slowest && !PetscIsInfOrNanReal(o->fastest), comm, "The load's pace must stay between a positive least and a larger greatest value, not %.6g and %.6g (time.govern.slowest, fastest)", (double)o->slowest,
                 (double)o->fastest);
  BaseCheckInput(o->response > 0 && !PetscIsInfOrNanReal(o->response), comm, "The load's response time, %.6g s, must be positive (time.govern.response)", (double)o->response);
  BaseCheckInput(o->unbalanced > 0 || o->kinetic > 0 || o->loading > 0 || o->breaking > 0, comm, "Nothing governs the load: give unbalanced, kinetic, loading or breaking a positive value (time.govern)");
  BaseCheckInput(o->unbalanced <= 0 || inner->unbalanced, comm, "The %s model has no unbalanced force to govern the load by; give time.govern.unbalanced: 0, and kinetic", inner->name);
  PetscCall(PetscNew(&g));
  g->comm  = comm;
  g->o     = *o;
  g->inner = *inner;
  g->clock = clock;
  PetscCall(PetscMalloc2(inner->n_history + 2, &g->name, inner->n_history + 2, &g->unit));
  for (PetscInt i = 0; i < inner->n_history; i++) {
    g->name[i] = inner->history_name[i];
    g->unit[i] = inner->history_unit[i];
  }
  g->name[inner->n_history]     = "load_time";
  g->unit[inner->n_history]     = "s";
  g->name[inner->n_history + 1] = "load_rate";
  g->unit[inner->n_history + 1] = "-";
  *govern = g;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RunGovernGetStepper(RunGovern g, Stepper *stepper)
{
  PetscFunctionBegin;
  *stepper = (Stepper){.name = g->inner.name, .ctx = g, .clock = g->clock, .stable_step = g->inner.stable_step ? Stable : NULL, .step = Step, .energy = Energy, .watch = g->inner.watch ? Watch : NULL, .history = History, .write = g->inner.write ? Write : NULL,
                       .save = g->inner.save ? Save : NULL, .load = g->inner.load ? Load : NULL, .unbalanced = g->inner.unbalanced ? Unbalanced : NULL, .n_history = g->inner.n_history + 2, .history_name = g->name, .history_unit = g->unit,
                       .elements = g->inner.elements};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RunGovernDestroy(RunGovern *govern)
{
  PetscFunctionBegin;
  if (!*govern) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree2((*govern)->name, (*govern)->unit));
  PetscCall(PetscFree(*govern));
  PetscFunctionReturn(PETSC_SUCCESS);
}
