/* coupling_contact_stepper.c - a body of elements and particles that touch it, in step, as the run loop sees them.  Eq. (5.79) */
#include "coupling_contact_impl.h"
#include "coupling_impl.h"

static PetscErrorCode StableStep(void *ctx, PetscReal *dt)
{
  return CouplingContactGetStableStep(ctx, dt);
}

static PetscErrorCode Step(void *ctx, PetscReal t, PetscReal dt)
{
  CouplingContact c = ctx;

  PetscFunctionBegin;
  PetscCall(c->fem_stepper.step(c->fem, t, dt));
  PetscCall(DemModelAdvance(c->dem, t, dt));
  PetscCall(CouplingContactForces_Internal(c, dt));
  PetscCall(DemModelEvaluate(c->dem, dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Energy(void *ctx, Ledger *ledger)
{
  CouplingContact       c = ctx;
  CouplingContactReport r;
  Ledger                part;

  PetscFunctionBegin;
  PetscCall(c->fem_stepper.energy(c->fem, ledger));
  PetscCall(c->dem_stepper.energy(c->dem, &part));
  LedgerAdd(ledger, &part);
  PetscCall(CouplingContactGetReport(c, &r));
  ledger->energy[LEDGER_CONTACT] += r.energy + r.damping;
  ledger->energy[LEDGER_FRICTION] += r.friction;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The elements' columns, the particles', and the force of the contacts on the body. */
static PetscErrorCode History(void *ctx, PetscInt i, PetscReal *value)
{
  CouplingContact c = ctx;
  const PetscInt  n = c->fem_stepper.n_history, m = n + c->dem_stepper.n_history;

  PetscFunctionBegin;
  if (i < n) PetscCall(c->fem_stepper.history(c->fem, i, value));
  else if (i < m) PetscCall(c->dem_stepper.history(c->dem, i - n, value));
  else *value = c->force[i - m];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Write(void *ctx, Output output)
{
  CouplingContact c = ctx;

  PetscFunctionBegin;
  PetscCall(c->fem_stepper.write(c->fem, output));
  PetscCall(c->dem_stepper.write(c->dem, output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define SCALARS 7

static PetscErrorCode Save(void *ctx, Checkpoint checkpoint)
{
  CouplingContact c = ctx;
  const PetscReal scalar[SCALARS] = {c->friction, c->damping, c->deepest, c->force[0], c->force[1], c->force[2], c->time};
  FemState        fs;
  PetscInt       *index;
  PetscReal      *value;

  PetscFunctionBegin;
  PetscCall(c->fem_stepper.save(c->fem, checkpoint));
  PetscCall(c->dem_stepper.save(c->dem, checkpoint));
  PetscCall(PetscMalloc2(2 * c->n, &index, TOUCH_REALS * c->n, &value));
  for (PetscInt k = 0; k < c->n; k++) {
    index[2 * k]     = c->contact[k].p;
    index[2 * k + 1] = c->contact[k].cell;
    PetscCall(PetscMemcpy(&value[TOUCH_REALS * k], c->contact[k].share, TOUCH_REALS * sizeof(PetscReal)));
  }
  PetscCall(CheckpointWriteReal(checkpoint, "contact/scalars", SCALARS, scalar));
  PetscCall(CheckpointWriteInt(checkpoint, "contact/count", 1, &c->n));
  if (c->n) PetscCall(CheckpointWriteInt(checkpoint, "contact/who", 2 * c->n, index));
  if (c->n) PetscCall(CheckpointWriteReal(checkpoint, "contact/history", TOUCH_REALS * c->n, value));
  PetscCall(PetscFree2(index, value));
  PetscCall(FemModelGetState(c->fem, &fs));
  PetscCall(CheckpointWriteReal(checkpoint, "contact/node_force", fs.n_nodes * fs.dim, fs.f_ext));
  PetscCall(FemModelRestoreState(c->fem, &fs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Load(void *ctx, Checkpoint checkpoint)
{
  CouplingContact c = ctx;
  PetscReal       scalar[SCALARS], *value;
  FemState        fs;
  PetscInt       *index;

  PetscFunctionBegin;
  PetscCall(c->fem_stepper.load(c->fem, checkpoint));
  PetscCall(c->dem_stepper.load(c->dem, checkpoint));
  PetscCall(CheckpointReadReal(checkpoint, "contact/scalars", SCALARS, scalar));
  c->friction = scalar[0];
  c->damping  = scalar[1];
  c->deepest  = scalar[2];
  for (PetscInt d = 0; d < 3; d++) c->force[d] = scalar[3 + d];
  c->time = scalar[6];
  c->seen = -1; /* nobody was looked for where they are now */
  PetscCall(CheckpointReadInt(checkpoint, "contact/count", 1, &c->n));
  BaseCheckInput(c->n >= 0 && c->n < 100000000, PETSC_COMM_SELF, "The checkpoint is damaged: %" PetscInt_FMT " contacts", c->n);
  if (c->n > c->room) {
    PetscCall(PetscFree(c->contact));
    PetscCall(PetscFree(c->next));
    PetscCall(PetscMalloc1(2 * c->n, &c->contact));
    PetscCall(PetscMalloc1(2 * c->n, &c->next));
    c->room = 2 * c->n;
  }
  PetscCall(PetscMalloc2(2 * c->n, &index, TOUCH_REALS * c->n, &value));
  if (c->n) PetscCall(CheckpointReadInt(checkpoint, "contact/who", 2 * c->n, index));
  if (c->n) PetscCall(CheckpointReadReal(checkpoint, "contact/history", TOUCH_REALS * c->n, value));
  for (PetscInt k = 0; k < c->n; k++) {
    c->contact[k].p    = index[2 * k];
    c->contact[k].cell = index[2 * k + 1];
    PetscCall(PetscMemcpy(c->contact[k].share, &value[TOUCH_REALS * k], TOUCH_REALS * sizeof(PetscReal)));
  }
  PetscCall(PetscFree2(index, value));
  PetscCall(FemModelGetState(c->fem, &fs));
  PetscCall(CheckpointReadReal(checkpoint, "contact/node_force", fs.n_nodes * fs.dim, fs.f_ext));
  PetscCall(FemModelRestoreState(c->fem, &fs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Watch(void *ctx, RunWatch look, char fault[BASE_LINE])
{
  CouplingContact c = ctx;

  return CouplingWatch_Internal(&c->fem_stepper, &c->dem_stepper, look, fault);
}

static PetscErrorCode Unbalanced(void *ctx, PetscReal *ratio)
{
  CouplingContact c = ctx;

  PetscFunctionBegin;
  PetscCall(c->dem_stepper.unbalanced(c->dem, ratio));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingContactGetStepper(CouplingContact c, Stepper *stepper)
{
  const Stepper *f = &c->fem_stepper, *d = &c->dem_stepper;

  PetscFunctionBegin;
  PetscCheck(c->ready, c->comm, PETSC_ERR_ORDER, "Call CouplingContactSetUp() before asking for the stepper");
  if (!c->history_name) {
    c->n_history = f->n_history + d->n_history + c->dim;
    PetscCall(PetscMalloc3(c->n_history, &c->history_name, c->n_history, &c->history_unit, c->dim, &c->own_name));
    for (PetscInt k = 0; k < c->n_history; k++) {
      const PetscInt own = k - f->n_history - d->n_history;

      if (own >= 0) PetscCall(BaseFormat(c->own_name[own], "contact_force(%s).%c", c->name, (char)('x' + own)));
      c->history_name[k] = own >= 0 ? c->own_name[own] : k < f->n_history ? f->history_name[k] : d->history_name[k - f->n_history];
      c->history_unit[k] = own >= 0 ? "N" : k < f->n_history ? f->history_unit[k] : d->history_unit[k - f->n_history];
    }
  }
  *stepper = (Stepper){.name = "contact", .ctx = c, .stable_step = StableStep, .step = Step, .energy = Energy, .watch = Watch, .history = History, .write = Write, .save = Save, .load = Load,
                       .unbalanced = d->unbalanced ? Unbalanced : NULL, .n_history = c->n_history, .history_name = c->history_name, .history_unit = c->history_unit, .elements = f->elements + d->elements};
  PetscFunctionReturn(PETSC_SUCCESS);
}
