/* coupling_switch_stepper.c - both sides as they stand, looked at every few steps, as the run loop sees them.  Eq. (8.4) */
#include "coupling_switch.h"

enum { COLUMNS = 3 };

static PetscErrorCode SetStep(CouplingSwitch sw, PetscReal dt)
{
  const PetscReal speed = PetscSqrtReal((sw->lambda + 2 * sw->mu) / sw->material.density);

  PetscFunctionBegin;
  PetscCheck(sw->dt == 0 || sw->dt == dt, sw->comm, PETSC_ERR_ARG_WRONG, "The step was %.17g s and is %.17g s; it stays the same from start to end", (double)sw->dt, (double)dt);
  sw->dt    = dt;
  sw->every = PetscMax(1, (PetscInt)(0.5 * sw->smallest / (speed * dt))); /* a wave crosses half an element.  Eq. (8.4) */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Step(void *ctx, PetscReal t, PetscReal dt)
{
  CouplingSwitch sw = ctx;
  CouplingReport report;
  const PetscInt done = (PetscInt)((t + dt) / dt + 0.5);
  PetscInt       parts, bonds, elements;

  PetscFunctionBegin;
  if (sw->dt != dt) PetscCall(SetStep(sw, dt));
  PetscCall(CouplingModelGetReport(sw->now->model, &report));
  parts = sw->substeps / report.substeps;
  for (PetscInt k = 0; k < parts; k++) PetscCall(sw->now->stepper.step(sw->now->model, t + k * (dt / parts), dt / parts));
  PetscCall(DemModelGetCounts(CouplingMoving(sw->now->model), NULL, &bonds, NULL));
  PetscCall(FemModelGetCounts(sw->now->fem, NULL, &elements, NULL));
  sw->bond_steps += (PetscReal)bonds * sw->substeps;
  sw->element_steps += (PetscReal)elements * parts;
  if (!sw->options.off && done % sw->every == 0) PetscCall(CouplingLook_Internal(sw, t + dt, (PetscBool)(done / sw->every % COUPLING_TOOL_LOOKS == 0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSwitchConvert(CouplingSwitch sw, PetscInt n, const PetscInt cell[], PetscReal dt)
{
  PetscBool *marked;
  PetscReal  t = 0;

  PetscFunctionBegin;
  PetscCheck(sw->ready, sw->comm, PETSC_ERR_ORDER, "Call CouplingSwitchSetUp() before CouplingSwitchConvert()");
  if (sw->dt != dt) PetscCall(SetStep(sw, dt));
  PetscCall(DemModelGetTime(CouplingMoving(sw->now->model), &t));
  PetscCall(PetscCalloc1(sw->whole->n_cells, &marked));
  for (PetscInt k = 0; k < n; k++) marked[cell[k]] = PETSC_TRUE;
  PetscCall(CouplingTurn_Internal(sw, marked, t, 0, COUPLING_BY_ELEMENT));
  PetscCall(PetscFree(marked));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode StableStep(void *ctx, PetscReal *dt)
{
  return CouplingSwitchGetCriticalStep(ctx, dt);
}

/* What events gave or took is energy of the coupling, of their own: sum of before - after.  Eq. (8.9) */
static PetscErrorCode Energy(void *ctx, Ledger *ledger)
{
  CouplingSwitch sw = ctx;

  PetscFunctionBegin;
  PetscCall(sw->now->stepper.energy(sw->now->model, ledger));
  ledger->energy[LEDGER_COUPLING] += sw->booked;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sides' columns, then elements turned, particles awake, energy booked. */
static PetscErrorCode History(void *ctx, PetscInt i, PetscReal *value)
{
  CouplingSwitch sw = ctx;
  const PetscInt n = sw->now->stepper.n_history;

  PetscFunctionBegin;
  if (i < n) PetscCall(sw->now->stepper.history(sw->now->model, i, value));
  else *value = i == n ? (PetscReal)sw->n_turned : i == n + 1 ? (PetscReal)sw->now->carved.packing.n : sw->booked;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Write(void *ctx, Output output)
{
  CouplingSwitch sw = ctx;

  return sw->now->stepper.write(sw->now->model, output);
}

static PetscErrorCode Watch(void *ctx, RunWatch look, char fault[BASE_LINE])
{
  CouplingSwitch sw = ctx;

  return sw->now->stepper.watch(sw->now->model, look, fault);
}

static PetscErrorCode Unbalanced(void *ctx, PetscReal *ratio)
{
  CouplingSwitch sw = ctx;

  return sw->now->stepper.unbalanced(sw->now->model, ratio);
}

/* ---- checkpoints: which cells have turned, then the sides as ever -------------------------------------------------- */

enum { EVENT_NUMBERS = 7 + 2 * LEDGER_TERMS }; /* the wall time of an event is kept beside: it is no result */

static void Pack(const CouplingEvent *event, PetscReal number[EVENT_NUMBERS])
{
  const PetscReal head[7] = {event->time, (PetscReal)event->cells, (PetscReal)event->particles, event->booked, event->highest, (PetscReal)event->above, (PetscReal)event->asked};

  for (PetscInt k = 0; k < 7; k++) number[k] = head[k];
  for (PetscInt k = 0; k < LEDGER_TERMS; k++) {
    number[7 + k]                = event->before[k];
    number[7 + LEDGER_TERMS + k] = event->after[k];
  }
}

static void Unpack(const PetscReal number[EVENT_NUMBERS], CouplingEvent *event)
{
  *event = (CouplingEvent){.time = number[0], .cells = (PetscInt)number[1], .particles = (PetscInt)number[2], .booked = number[3], .highest = number[4], .above = (PetscInt)number[5], .asked = (PetscInt)number[6]};
  for (PetscInt k = 0; k < LEDGER_TERMS; k++) {
    event->before[k] = number[7 + k];
    event->after[k]  = number[7 + LEDGER_TERMS + k];
  }
}

static PetscErrorCode Save(void *ctx, Checkpoint c)
{
  CouplingSwitch  sw = ctx;
  const PetscInt  n = sw->whole->n_cells, count[3] = {sw->n_events, sw->n_turned, sw->blocked};
  const PetscReal scalar[3] = {sw->dt, sw->booked, sw->blocked_time};
  PetscInt       *flag;
  PetscReal      *number, *seconds;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n, &flag, sw->n_events * EVENT_NUMBERS, &number, sw->n_events, &seconds));
  for (PetscInt k = 0; k < sw->n_events; k++) seconds[k] = sw->event[k].seconds;
  for (PetscInt k = 0; k < n; k++) flag[k] = (sw->is_dem[k] ? 1 : 0) + (sw->may[k] ? 2 : 0);
  for (PetscInt k = 0; k < sw->n_events; k++) Pack(&sw->event[k], number + k * EVENT_NUMBERS);
  PetscCall(CheckpointWriteInt(c, "switch/count", 3, count));
  PetscCall(CheckpointWriteReal(c, "switch/scalars", 3, scalar));
  PetscCall(CheckpointWriteInt(c, "switch/cells", n, flag));
  if (sw->n_events) PetscCall(CheckpointWriteReal(c, "switch/events", sw->n_events * EVENT_NUMBERS, number));
  PetscCall(CheckpointWriteReal(c, "switch/seconds", sw->n_events, seconds));
  PetscCall(PetscFree3(flag, number, seconds));
  PetscCall(sw->now->stepper.save(sw->now->model, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Load(void *ctx, Checkpoint c)
{
  CouplingSwitch sw = ctx;
  const PetscInt n = sw->whole->n_cells;
  PetscInt       count[3], *flag;
  PetscReal      scalar[3], *number, *seconds;

  PetscFunctionBegin;
  PetscCall(CheckpointReadInt(c, "switch/count", 3, count));
  PetscCall(CheckpointReadReal(c, "switch/scalars", 3, scalar));
  BaseCheckInput(count[0] >= 0 && count[0] <= n, sw->comm, "The checkpoint is damaged: %" PetscInt_FMT " events on %" PetscInt_FMT " elements", count[0], n);
  PetscCall(PetscMalloc3(n, &flag, count[0] * EVENT_NUMBERS, &number, count[0], &seconds));
  PetscCall(CheckpointReadInt(c, "switch/cells", n, flag));
  PetscCall(CheckpointReadReal(c, "switch/seconds", count[0], seconds));
  if (count[0]) PetscCall(CheckpointReadReal(c, "switch/events", count[0] * EVENT_NUMBERS, number));
  if (scalar[0] > 0) PetscCall(SetStep(sw, scalar[0]));
  for (PetscInt k = 0; k < n; k++) {
    sw->is_dem[k] = (PetscBool)(flag[k] & 1);
    sw->may[k]    = (PetscBool)((flag[k] & 2) != 0);
  }
  sw->n_events = sw->room = count[0];
  sw->n_turned     = count[1];
  sw->blocked      = count[2];
  sw->booked       = scalar[1];
  sw->blocked_time = scalar[2];
  PetscCall(PetscRealloc((size_t)(sw->room + 1) * sizeof(*sw->event), &sw->event));
  for (PetscInt k = 0; k < sw->n_events; k++) {
    Unpack(number + k * EVENT_NUMBERS, &sw->event[k]);
    sw->event[k].seconds = seconds[k];
  }
  PetscCall(PetscFree3(flag, number, seconds));
  if (sw->n_turned) { /* the split of then, from the same numbers as then */
    PetscCall(CouplingHalvesDestroy_Internal(&sw->now));
    PetscCall(CouplingBuild_Internal(sw, &sw->now));
  }
  PetscCall(sw->now->stepper.load(sw->now->model, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSwitchGetStepper(CouplingSwitch sw, Stepper *stepper)
{
  static const char *const name[COLUMNS] = {"switch.elements", "switch.particles", "switch.energy"}, *const unit[COLUMNS] = {"-", "-", "J"};
  const Stepper           *s;
  PetscInt                 n;

  PetscFunctionBegin;
  PetscCheck(sw->ready, sw->comm, PETSC_ERR_ORDER, "Call CouplingSwitchSetUp() before asking for the stepper");
  s = &sw->now->stepper;
  n = s->n_history;
  if (!sw->history_name) { /* own copies: the sides' names go with the sides */
    PetscCall(PetscMalloc2(n + COLUMNS, &sw->history_name, n + COLUMNS, &sw->history_unit));
    for (PetscInt k = 0; k < n + COLUMNS; k++) {
      PetscCall(PetscStrallocpy(k < n ? s->history_name[k] : name[k - n], (char **)&sw->history_name[k]));
      PetscCall(PetscStrallocpy(k < n ? s->history_unit[k] : unit[k - n], (char **)&sw->history_unit[k]));
    }
    sw->n_columns = n + COLUMNS;
  }
  *stepper = (Stepper){.name = "coupled", .ctx = sw, .stable_step = StableStep, .step = Step, .energy = Energy, .watch = Watch, .history = History, .write = Write, .save = Save, .load = Load,
                       .unbalanced = s->unbalanced ? Unbalanced : NULL, .n_history = n + COLUMNS, .history_name = sw->history_name, .history_unit = sw->history_unit, .elements = s->elements};
  PetscFunctionReturn(PETSC_SUCCESS);
}
