/* fem_stepper.c - the FemModel as the run loop sees it: energy, history, frames, checkpoint. Arrays travel in the mesh's order. */
#include "fem_impl.h"

static PetscErrorCode StepperStable(void *ctx, PetscReal *dt)
{
  return FemModelGetStableStep((FemModel)ctx, dt);
}

static PetscErrorCode StepperStep(void *ctx, PetscReal t, PetscReal dt)
{
  FemModel model = ctx;

  PetscFunctionBegin;
  PetscCheck(!model->lent, model->comm, PETSC_ERR_ORDER, "The state is lent; FemModelRestoreState() before a step");
  if (model->method == FEM_STATIC) PetscCall(FemStaticStep(model, t, dt));
  else if (model->method == FEM_IMPLICIT) PetscCall(FemImplicitStep(model, t, dt));
  else PetscCall(FemExplicitStep(model, t, dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reactions and the coming velocity of the present level; a static model has them already. */
static PetscErrorCode Close(FemModel model)
{
  PetscFunctionBegin;
  if (model->far.m) PetscCall(FemFarLevel(model));
  else if (model->inner.m > 1) PetscCall(FemInnerLevel(model, model->dt_last));
  else if (model->method == FEM_EXPLICIT) PetscCall(FemExplicitLevel(model, model->dt_last));
  else if (model->method == FEM_IMPLICIT) PetscCall(FemImplicitLevel(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal FemVelocityOf(FemModel model, PetscInt k)
{
  return model->method == FEM_EXPLICIT && model->started ? 0.5 * (model->v[k] + model->v_next[k]) : model->v[k];
}

PetscErrorCode FemModelGetBalance(FemModel model, PetscReal *force, PetscReal *moment)
{
  PetscReal all[6];

  PetscFunctionBegin;
  PetscCheck(model && model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetUp() first");
  PetscCall(Close(model));
  PetscCall(FemBalance(model, all));
  *force  = PetscSqrtReal(all[0] * all[0] + all[1] * all[1] + all[2] * all[2]);
  *moment = PetscSqrtReal(all[3] * all[3] + all[4] * all[4] + all[5] * all[5]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Eqs (2.16), (2.20) */
static PetscErrorCode StepperEnergy(void *ctx, Ledger *ledger)
{
  FemModel       model  = ctx;
  const PetscInt n      = model->n_own * model->dim;
  PetscReal      taken = 0, sum[6] = {0, 0, 0, 0, 0, 0}; /* kinetic, strain; work, damping, contact and friction of the half step up to now */

  PetscFunctionBegin;
  PetscCall(Close(model));
  sum[1] = FemStrainEnergy(model) + FemPrestressEnergy(model);
  if (model->method == FEM_EXPLICIT) {
    if (model->inner.m > 1) sum[0] = model->inner.kinetic;
    else for (PetscInt k = 0; k < n; k++) sum[0] += 0.5 * model->mass[k / model->dim] * model->v[k] * (model->started ? model->v_next[k] : model->v[k]);
    sum[2] = model->started ? model->level_sum[0] : 0;
    sum[3] = model->started ? model->level_sum[2] : 0;
    sum[4] = model->started ? model->level_sum[4] : 0;
    sum[5] = model->started ? model->level_sum[6] : 0;
  }
  if (model->method == FEM_IMPLICIT) sum[0] = model->implicit.kinetic;
  if (model->far.m) FemFarEnergies(model, &sum[0], &sum[1], &taken);
  PetscCall(FemSum(model, 6, sum));
  PetscCall(PetscMemzero(ledger, sizeof(*ledger)));
  ledger->energy[LEDGER_KINETIC] = sum[0];
  ledger->energy[LEDGER_STRAIN]  = sum[1];
  ledger->energy[LEDGER_WORK]    = model->work + sum[2];
  ledger->energy[LEDGER_DAMPING] = model->damping + sum[3];
  ledger->energy[LEDGER_CONTACT]  = model->contact.contact + sum[4];
  ledger->energy[LEDGER_FRICTION] = model->contact.friction + sum[5];
  ledger->energy[LEDGER_COUPLING] = taken;
  ledger->initial                = model->initial;
  ledger->work_in                = PetscMax(model->work_in, PetscAbsReal(model->work + sum[2]));
  ledger->scale                  = model->scale;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode StepperHistory(void *ctx, PetscInt i, PetscReal *value)
{
  FemModel          model = ctx;
  const FemHistory *h     = &model->history[i];
  const FemGroup   *group = h->group < 0 ? NULL : &model->group[h->group];
  PetscReal         sum   = 0;

  PetscFunctionBegin;
  PetscCall(Close(model));
  if (h->quantity == FEM_HIST_PROBE || h->quantity == FEM_HIST_ERROR) {
    if (h->quantity == FEM_HIST_PROBE) PetscCall(FemProbesHistory(model, i, value));
    else PetscCall(FemModelComputeError(model, value, NULL));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (h->quantity == FEM_HIST_BALANCE) {
    PetscReal all[6];

    PetscCall(FemBalance(model, all));
    *value = all[h->component];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (h->quantity == FEM_HIST_OPENING) { /* mean motion along the axis, far lip less near lip */
    PetscReal mean[2] = {0}, count[2] = {0};

    for (PetscInt k = 0; k < group->n_nodes; k++) {
      const PetscInt first = group->node[k] * model->dim;
      PetscReal      x = 0, u = 0;

      for (PetscInt d = 0; d < model->dim; d++) {
        x += h->axis[d] * model->x[first + d];
        u += h->axis[d] * model->u[first + d];
      }
      mean[x > h->middle] += u;
      count[x > h->middle] += 1;
    }
    *value = mean[1] / count[1] - mean[0] / count[0];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = 0; k < group->n_nodes; k++) {
    const PetscInt dof = group->node[k] * model->dim + h->component;

    if (h->quantity == FEM_HIST_NORMAL) {
      for (PetscInt d = 0; d < model->dim; d++) sum += h->axis[d] * model->reaction[group->node[k] * model->dim + d];
      continue;
    }

    sum += h->quantity == FEM_HIST_REACTION ? model->reaction[dof] : h->quantity == FEM_HIST_DISPLACEMENT ? model->u[dof] : FemVelocityOf(model, dof);
  }
  PetscCall(FemSum(model, 1, &sum));
  *value = h->quantity == FEM_HIST_REACTION || h->quantity == FEM_HIST_NORMAL ? sum : sum / group->n_nodes_global;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean |out-of-balance force| of free dofs over mean |internal force|; 1 while nothing pulls yet. */
static PetscErrorCode StepperUnbalanced(void *ctx, PetscReal *ratio)
{
  FemModel         model   = ctx;
  const PetscReal *outside = FemOutside(model);
  PetscReal        sum[4]  = {0, 0, 0, 0};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_own * model->dim; k++) {
    PetscReal force = model->f_app[k] + outside[k] - model->f_int[k];

    if (model->frame_of && model->frame_of[k / model->dim] >= 0) { /* along the frame's own axis */
      const PetscReal *q = &model->frame[(model->frame_of[k / model->dim] * model->dim + k % model->dim) * model->dim];

      force = 0;
      for (PetscInt d = 0, j = k - k % model->dim; d < model->dim; d++) force += q[d] * (model->f_app[j + d] + outside[j + d] - model->f_int[j + d]);
    }
    if (FemHeld(model, k) < 0) {
      sum[0] += PetscAbsReal(force);
      sum[1] += 1;
    }
    sum[2] += PetscAbsReal(model->f_int[k]);
    sum[3] += 1;
  }
  PetscCall(FemSum(model, 4, sum));
  *ratio = sum[2] > 0 && sum[1] > 0 ? (sum[0] / sum[1]) / (sum[2] / sum[3]) : 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Three components from dim. */
static PetscErrorCode NodeField(FemModel model, const char *name, PetscReal *own, PetscReal *all)
{
  PetscBool displacement, velocity;

  PetscFunctionBegin;
  PetscCall(PetscStrcmp(name, "displacement", &displacement));
  PetscCall(PetscStrcmp(name, "velocity", &velocity));
  for (PetscInt i = 0; i < model->n_own; i++)
    for (PetscInt d = 0; d < 3; d++) {
      const PetscInt k = i * model->dim + d;

      own[3 * i + d] = d >= model->dim ? 0 : displacement ? model->u[k] : velocity ? FemVelocityOf(model, k) : model->reaction[k];
    }
  PetscCall(FemGather(model, model->home, 3, own, all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CellField(FemModel model, PetscBool stress, PetscReal *own, PetscReal *all)
{
  PetscFunctionBegin;
  for (PetscInt c = 0; c < model->n_cells; c++) {
    PetscReal dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], u[FEM_MAX_DOFS], R[3][3];

    if (!model->own[c]) continue;
    FemCellGeometry(model, c, dN, w);
    FemCellGather(model, c, model->u, u);
    if (model->corotate.on) {
      PetscReal d[FEM_MAX_DOFS];

      FemCorotateSee(model, c, u, d, R);
      PetscCall(PetscArraycpy(u, d, FEM_MAX_DOFS));
    }
    FemMeanStress(FemShapeGet((MeshCellType)model->cell_type[c]), &model->law[model->cell_material[c]], dN, w, u, stress ? NULL : &own[6 * c], stress ? &own[6 * c] : NULL);
    if (stress && model->corotate.on) FemTurnStress(R, &own[6 * c]);
    if (stress && model->pre.n) {
      PetscReal more[6];

      FemCellPrestressMean(model, c, more);
      for (PetscInt i = 0; i < 6; i++) own[6 * c + i] += more[i];
    }
    if (!stress && model->kind == FEM_PLANE_STRESS) own[6 * c + 2] += FemCellThicker(model, c);
  }
  PetscCall(FemGather(model, model->home_cells, 6, own, all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetField(FemModel model, const char *name, PetscReal *data)
{
  static const char *const names[] = {"displacement", "velocity", "reaction", "element_stress", "element_strain"};
  PetscInt                 found   = -1;
  PetscReal               *own;
  PetscBool                same;

  PetscFunctionBegin;
  PetscCheck(model && model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetUp() first");
  for (PetscInt k = 0; k < 5; k++) {
    PetscCall(PetscStrcmp(name, names[k], &same));
    if (same) found = k;
  }
  PetscCheck(found >= 0, model->comm, PETSC_ERR_ARG_WRONG, "A FemModel has no field '%s'; recovered stress and strain are FemModelRecover()'s", name);
  PetscCall(Close(model));
  PetscCall(PetscMalloc1(found < 3 ? 3 * model->n_own : 6 * model->n_cells, &own));
  if (found < 3) PetscCall(NodeField(model, name, own, data));
  else PetscCall(CellField(model, found == 3 ? PETSC_TRUE : PETSC_FALSE, own, data));
  PetscCall(PetscFree(own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode StepperWrite(void *ctx, Output output)
{
  PetscReal turn;

  PetscFunctionBegin;
  PetscCall(FemModelGetTurn((FemModel)ctx, &turn));
  PetscCall(FemWriteFrame((FemModel)ctx, output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode StepperSave(void *ctx, Checkpoint checkpoint)
{
  FemModel        model = ctx;
  const PetscInt  n     = model->N_nodes * model->dim;
  PetscReal      *all;

  PetscFunctionBegin;
  if (model->far.m) PetscCall(FemFarLevel(model)); /* the far step that ends now is booked with it */
  const PetscReal state[7] = {model->t, model->dt_last, (PetscReal)model->started, model->work, model->damping, model->work_in, model->initial};

  PetscCall(PetscMalloc1(model->rank == 0 ? n : 0, &all));
  PetscCall(CheckpointWriteReal(checkpoint, "fem/state", 7, state));
  PetscCall(FemGather(model, model->home, model->dim, model->u, all));
  PetscCall(CheckpointWriteReal(checkpoint, "fem/displacement", n, all));
  PetscCall(FemGather(model, model->home, model->dim, model->v, all));
  PetscCall(CheckpointWriteReal(checkpoint, "fem/velocity", n, all));
  if (model->method == FEM_IMPLICIT) {
    PetscCall(FemGather(model, model->home, model->dim, model->implicit.a, all));
    PetscCall(CheckpointWriteReal(checkpoint, "fem/acceleration", n, all));
  }
  PetscCall(PetscFree(all));
  PetscCall(FemContactSave(model, checkpoint));
  PetscCall(FemFarSave(model, checkpoint));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces are functions of displacement and time, so they come back bit for bit by computing them again. */
static PetscErrorCode StepperLoad(void *ctx, Checkpoint checkpoint)
{
  FemModel       model = ctx;
  const PetscInt n     = model->N_nodes * model->dim;
  PetscReal      state[7], *all;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &all));
  PetscCall(CheckpointReadReal(checkpoint, "fem/state", 7, state));
  PetscCall(CheckpointReadReal(checkpoint, "fem/displacement", n, all));
  PetscCall(FemScatter(model, model->home, model->dim, all, model->u));
  PetscCall(CheckpointReadReal(checkpoint, "fem/velocity", n, all));
  PetscCall(FemScatter(model, model->home, model->dim, all, model->v));
  if (model->method == FEM_IMPLICIT) {
    PetscCall(CheckpointReadReal(checkpoint, "fem/acceleration", n, all));
    PetscCall(FemScatter(model, model->home, model->dim, all, model->implicit.a));
    PetscCall(FemGhosts(model, model->implicit.a));
  }
  PetscCall(PetscFree(all));
  model->t           = state[0];
  model->dt_last     = state[1];
  model->started     = state[2] != 0 ? PETSC_TRUE : PETSC_FALSE;
  model->work        = state[3];
  model->damping     = state[4];
  model->work_in     = state[5];
  model->initial     = state[6];
  model->level_known = PETSC_FALSE;
  PetscCall(FemContactLoad(model, checkpoint));
  PetscCall(FemFarLoad(model, checkpoint));
  PetscCall(FemGhosts(model, model->u));
  PetscCall(FemForces(model));
  if (model->pre.n && (model->started || model->method != FEM_STATIC)) {
    PetscReal heat;

    FemPrestressAdvance(model, model->t);
    PetscCall(FemHeatWork(model, &heat)); /* booked before; this is for the powers */
  }
  FemAddPrestress(model);
  if (model->started || model->method != FEM_STATIC) PetscCall(FemLoadsAt(model, model->t));
  if (model->method == FEM_STATIC) PetscCall(FemTakeReactions(model, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemSetUpStepper(FemModel model)
{
  PetscFunctionBegin;
  model->stepper = (Stepper){.name         = model->name,
                             .ctx          = model,
                             .stable_step  = StepperStable,
                             .step         = StepperStep,
                             .energy       = StepperEnergy,
                             .watch        = FemWatch,
                             .history      = StepperHistory,
                             .write        = StepperWrite,
                             .save         = StepperSave,
                             .load         = StepperLoad,
                             .unbalanced   = model->method == FEM_STATIC ? NULL : StepperUnbalanced,
                             .n_history    = model->n_history,
                             .history_name = (const char *const *)model->history_name,
                             .history_unit = model->history_unit,
                             .elements     = (PetscReal)model->N_cells};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetStepper(FemModel model, Stepper *stepper)
{
  PetscFunctionBegin;
  PetscCheck(model && model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetUp() before FemModelGetStepper()");
  *stepper = model->stepper;
  PetscFunctionReturn(PETSC_SUCCESS);
}
