/* coupling_stepper.c - both sides in step, as the run loop sees them.  Eq. (6.9) */
#include "coupling_impl.h"

PetscErrorCode CouplingRimForces_Internal(CouplingModel model)
{
  const PetscInt dim = model->dim;
  DemRim         rim;

  PetscFunctionBegin;
  PetscCall(CouplingRim_Internal(model, &rim));
  for (PetscInt k = 0; k < rim.n; k++)
    for (PetscInt a = 0; a < model->rim[k].n; a++)
      for (PetscInt d = 0; d < dim; d++) model->g[model->rim[k].node[a] * dim + d] += model->rim[k].N[a] * rim.force[3 * k + d];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces on the nodes, the rim's included, handed to the element model for its next level. */
PetscErrorCode CouplingGiveNodes_Internal(CouplingModel model)
{
  const PetscInt dim = model->dim;
  FemState       fs;

  PetscFunctionBegin;
  PetscCall(CouplingRimForces_Internal(model));
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(PetscArraycpy(fs.f_ext, model->g, fs.n_nodes * dim));
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rest of an instant's forces: multipliers, and all of the nodes' to the elements. */
static PetscErrorCode Join(CouplingModel model, PetscReal dt)
{
  const PetscInt dim = model->dim;
  FemState       fs;

  PetscFunctionBegin;
  if (model->options.method != COUPLING_CONSISTENT) {
    PetscCall(CouplingGiveNodes_Internal(model));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (model->part && !model->whole_leads) PetscCall(CouplingPull_Internal(model)); /* forces as they are now */
  PetscCall(CouplingRimForces_Internal(model));
  PetscCall(CouplingMultiply_Internal(model, model->moving ? dt : 0.5 * dt, dt));
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(PetscArraycpy(fs.f_ext, model->g, fs.n_nodes * dim));
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingStart_Internal(CouplingModel model, PetscReal dt)
{
  const PetscBool whole = (PetscBool)(!model->part || model->whole_leads); /* the particles as one, or their parts, have the state */

  PetscFunctionBegin;
  model->dt = model->reference > 0 ? model->reference : dt; /* the springs belong to the step: P = c / dt^2 */
  if (!whole) PetscCall(CouplingPull_Internal(model));
  if (model->options.method == COUPLING_CONSISTENT) {
    PetscCall(CouplingMultiplierHold_Internal(model));
    model->holding = PETSC_TRUE;
  }
  PetscCall(CouplingForces_Internal(model));
  if (model->options.absorber) PetscCall(CouplingAbsorb_Internal(model, dt, PETSC_FALSE));
  if (!whole) PetscCall(CouplingPush_Internal(model));
  PetscCall(DemModelComputeForces(whole ? model->dem : model->part));
  if (!whole) PetscCall(CouplingPullRim_Internal(model));
  PetscCall(Join(model, dt));
  if (whole && model->ready) PetscCall(CouplingSpread_Internal(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One step of the outer elements: m of the particles, the overlap and what steps with it.  Eq. (6.10) */
static PetscErrorCode Step(void *ctx, PetscReal t, PetscReal macro)
{
  CouplingModel   model = ctx;
  const PetscInt  m     = model->substeps;
  const PetscReal dt    = macro / m;

  PetscFunctionBegin;
  if (model->options.far == COUPLING_FAR_STATIC) {
    PetscCall(CouplingRelax_Internal(model, t, macro));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (model->dt != (model->reference > 0 ? model->reference : dt)) PetscCall(CouplingStart_Internal(model, dt));
  PetscCall(CouplingForget_Internal(model));
  for (PetscInt k = 0; k < m; k++) {
    if (model->far) PetscCall(FemModelFarStep(model->fem, t + k * dt, dt, k));
    else if (m == 1) PetscCall(model->fem_stepper.step(model->fem, t, dt));
    else PetscCall(FemModelSubStep(model->fem, t + k * dt, dt, k));
    PetscCall(DemModelAdvance(CouplingMoving(model), t + k * dt, dt));
    model->moving = PETSC_TRUE;
    PetscCall(CouplingPull_Internal(model));
    PetscCall(CouplingForces_Internal(model));
    if (model->options.absorber) PetscCall(CouplingAbsorb_Internal(model, dt, PETSC_TRUE));
    PetscCall(CouplingPush_Internal(model));
    PetscCall(DemModelEvaluate(CouplingMoving(model), dt));
    PetscCall(CouplingPullRim_Internal(model));
    PetscCall(Join(model, dt));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Energy(void *ctx, Ledger *ledger)
{
  CouplingModel model = ctx;
  Ledger        part;
  PetscReal     spring, strain;

  PetscFunctionBegin;
  PetscCall(model->fem_stepper.energy(model->fem, ledger));
  PetscCall(model->dem_stepper.energy(CouplingMoving(model), &part));
  LedgerAdd(ledger, &part);
  PetscCall(CouplingEnergy_Internal(model, &spring, &strain));
  ledger->energy[LEDGER_COUPLING] += spring;
  ledger->energy[LEDGER_STRAIN] += strain;
  ledger->initial += model->initial;
  ledger->energy[LEDGER_DAMPING] += model->relaxed + model->absorbed;
  ledger->energy[LEDGER_WORK] -= model->initial_work;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode StableStep(void *ctx, PetscReal *dt)
{
  return CouplingModelGetCriticalStep(ctx, dt);
}

/* The sides' columns, the elements' first. */
static PetscErrorCode History(void *ctx, PetscInt i, PetscReal *value)
{
  CouplingModel model = ctx;
  const PetscInt n = model->fem_stepper.n_history;

  PetscFunctionBegin;
  if (i < n) PetscCall(model->fem_stepper.history(model->fem, i, value));
  else PetscCall(model->dem_stepper.history(CouplingMoving(model), i - n, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Write(void *ctx, Output output)
{
  CouplingModel model = ctx;

  PetscFunctionBegin;
  PetscCall(model->fem_stepper.write(model->fem, output));
  PetscCall(model->dem_stepper.write(CouplingMoving(model), output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Save(void *ctx, Checkpoint checkpoint)
{
  CouplingModel   model = ctx;
  const PetscReal step[7] = {model->dt, model->reference, model->initial, model->initial_work, model->relaxed, model->through[0], model->through[1]};

  PetscFunctionBegin;
  PetscCall(model->fem_stepper.save(model->fem, checkpoint));
  PetscCall(model->dem_stepper.save(CouplingMoving(model), checkpoint));
  PetscCall(CheckpointWriteReal(checkpoint, "coupling/step", 7, step));
  PetscCall(CheckpointWriteReal(checkpoint, "coupling/node_force", CouplingMesh(model)->n_nodes * model->dim, model->g));
  if (model->options.absorber) {
    PetscCall(CheckpointWriteReal(checkpoint, "coupling/slip", 3 * model->n_particles, model->slip));
    PetscCall(CheckpointWriteReal(checkpoint, "coupling/absorbed", 1, &model->absorbed));
  }
  if (model->holding) PetscCall(CheckpointWriteReal(checkpoint, "coupling/held", 3 * model->n_particles, model->q0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Load(void *ctx, Checkpoint checkpoint)
{
  CouplingModel model = ctx;
  FemState      fs;
  PetscReal     step[7];

  PetscFunctionBegin;
  PetscCall(model->fem_stepper.load(model->fem, checkpoint));
  PetscCall(model->dem_stepper.load(CouplingMoving(model), checkpoint));
  PetscCall(CheckpointReadReal(checkpoint, "coupling/step", 7, step));
  model->dt        = step[0];
  model->reference = step[1];
  model->initial   = step[2];
  model->initial_work = step[3];
  model->relaxed = step[4];
  model->through[0] = step[5];
  model->through[1] = step[6];
  PetscCall(CheckpointReadReal(checkpoint, "coupling/node_force", CouplingMesh(model)->n_nodes * model->dim, model->g));
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(PetscArraycpy(fs.f_ext, model->g, fs.n_nodes * model->dim));
  PetscCall(FemModelRestoreState(model->fem, &fs));
  if (model->options.absorber) {
    PetscCall(CheckpointReadReal(checkpoint, "coupling/slip", 3 * model->n_particles, model->slip));
    PetscCall(CheckpointReadReal(checkpoint, "coupling/absorbed", 1, &model->absorbed));
  }
  model->moving = model->holding = PETSC_FALSE;
  if (model->options.method == COUPLING_CONSISTENT && model->dt > 0) {
    PetscCall(CheckpointReadReal(checkpoint, "coupling/held", 3 * model->n_particles, model->q0));
    model->moving = model->holding = PETSC_TRUE;
  }
  PetscCall(CouplingPull_Internal(model));
  if (model->dt > 0) PetscCall(CouplingForces_Internal(model)); /* the particles' outside forces and the rim; g is overwritten next step */
  PetscCall(CouplingPush_Internal(model));
  PetscCall(CheckpointReadReal(checkpoint, "coupling/node_force", CouplingMesh(model)->n_nodes * model->dim, model->g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingWatch_Internal(const Stepper *fem, const Stepper *dem, RunWatch look, char fault[BASE_LINE])
{
  char more[BASE_LINE] = "";

  PetscFunctionBegin;
  PetscCall(fem->watch(fem->ctx, look, fault));
  if (fault[0] && look != RUN_WATCH_FASTEST) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(dem->watch(dem->ctx, look, more));
  if (fault[0] && more[0]) PetscCall(PetscStrlcat(fault, ", ", BASE_LINE));
  PetscCall(PetscStrlcat(fault, more, BASE_LINE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Watch(void *ctx, RunWatch look, char fault[BASE_LINE])
{
  CouplingModel model = ctx;

  return CouplingWatch_Internal(&model->fem_stepper, &model->dem_stepper, look, fault);
}

static PetscErrorCode Unbalanced(void *ctx, PetscReal *ratio)
{
  CouplingModel model = ctx;

  PetscFunctionBegin;
  PetscCall(model->dem_stepper.unbalanced(CouplingMoving(model), ratio));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingModelGetCriticalStep(CouplingModel model, PetscReal *dt)
{
  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call CouplingModelSetUp() before asking for the step");
  *dt = model->options.far == COUPLING_FAR_STATIC ? PETSC_MAX_REAL : model->substeps * model->limit;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingModelGetStepper(CouplingModel model, Stepper *stepper)
{
  Stepper *f = &model->fem_stepper, *d = &model->dem_stepper;

  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call CouplingModelSetUp() before asking for the stepper");
  PetscCall(FemModelGetStepper(model->fem, f));
  PetscCall(DemModelGetStepper(CouplingMoving(model), d));
  if (!model->history_name) {
    model->n_history = f->n_history + d->n_history;
    PetscCall(PetscMalloc2(model->n_history, &model->history_name, model->n_history, &model->history_unit));
    for (PetscInt k = 0; k < model->n_history; k++) {
      model->history_name[k] = k < f->n_history ? f->history_name[k] : d->history_name[k - f->n_history];
      model->history_unit[k] = k < f->n_history ? f->history_unit[k] : d->history_unit[k - f->n_history];
    }
  }
  *stepper = (Stepper){.name = "coupled", .ctx = model, .stable_step = StableStep, .step = Step, .energy = Energy, .watch = Watch, .history = History, .write = Write, .save = Save, .load = Load,
                       .unbalanced = d->unbalanced ? Unbalanced : NULL, .n_history = model->n_history, .history_name = model->history_name, .history_unit = model->history_unit,
                       .elements = f->elements + d->elements};
  PetscFunctionReturn(PETSC_SUCCESS);
}
