/* dem_stepper.c - the model as the run loop sees it: energies, history, frames, checkpoints. */
#include "dem_rule.h"

static PetscErrorCode StepperStable(void *ctx, PetscReal *dt)
{
  return DemModelGetCriticalStep(ctx, dt);
}

static PetscErrorCode StepperEnergy(void *ctx, Ledger *ledger)
{
  DemModel       model = ctx;
  const PetscInt n = model->n;
  PetscReal      kinetic, due, strain, gravity = 0, moving = 0, *dilation = NULL;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(ledger, sizeof(*ledger)));
  PetscCall(DemKineticEnergy_Internal(model, &kinetic, &due));
  if (model->crack.damage) { /* those of the last forces, before damage grew, are what the next look at stresses starts from: a look at energies leaves no trace */
    PetscCall(PetscMalloc1(n, &dilation));
    PetscCall(PetscArraycpy(dilation, model->dilation, n));
  }
  PetscCall(DemStrainEnergy_Internal(model, &strain));
  if (dilation) PetscCall(PetscArraycpy(model->dilation, dilation, n));
  PetscCall(PetscFree(dilation));
  if (model->gravity[0] != 0 || model->gravity[1] != 0 || model->gravity[2] != 0) /* a potential: its work needs no sum over time */
    for (PetscInt p = 0; p < n; p++) {
      const PetscReal c[3] = {model->offset[p], model->offset[n + p], model->offset[2 * n + p]};
      PetscReal       turn[3];

      if (DemInClump(model, p)) continue;
      DemTurn(model->dim, n, p, model->rot, c, turn);
      for (PetscInt d = 0; d < model->dim; d++) gravity += model->mass[p] * model->gravity[d] * (model->u[d * n + p] + turn[d]);
    }
  DemClumpsEnergy_Internal(model, &moving, &gravity);
  if (model->n_tools) DemToolsKinetic_Internal(model, &kinetic, &gravity);
  ledger->energy[LEDGER_KINETIC]  = kinetic;
  ledger->energy[LEDGER_STRAIN]   = strain;
  ledger->energy[LEDGER_DAMPING]  = model->damped + due + (model->net ? model->net->nu_work : 0);
  ledger->energy[LEDGER_CONTACT]  = DemToolsEnergy_Internal(model) + (model->contacts.on ? DemContactsEnergy_Internal(model) : 0) + model->contact_lost;
  ledger->energy[LEDGER_FRICTION] = model->friction_lost;
  if (model->crack.damage)
    for (PetscInt k = 0; k < model->bonds.n; k++) {
      ledger->energy[LEDGER_FRACTURE] += model->crack.work[k];
      ledger->energy[LEDGER_FRICTION] += model->crack.rub[k];
    }
  ledger->energy[LEDGER_WORK]     = model->work + gravity - model->contacts.taken;
  ledger->work_in                 = model->work_in + PetscAbsReal(gravity);
  ledger->scale                   = 0; /* strain energy of a strain of one: what the floor of the error is taken from */
  for (PetscInt p = 0; p < n; p++) ledger->scale += 0.5 * model->material.young * model->volume[p];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode StepperHistory(void *ctx, PetscInt i, PetscReal *value)
{
  DemModel          model = ctx;
  const DemHistory *h = &model->history[i];
  const PetscInt    n = model->n, c = h->component;

  PetscFunctionBegin;
  if (h->quantity[0] == 'p') PetscCall(DemProbe_Internal(model, h, value));
  else if (h->tool < 0 && h->face < 0) PetscCall(DemColumn_Internal(model, h, value));
  else if (h->tool >= 0) *value = DemToolHistory_Internal(model, h->tool, h->quantity, c);
  else if (h->quantity[0] == 'r') {
    DemFacesReactions_Internal(model);
    *value = model->face[h->face].reaction[c];
  } else if (model->face[h->face].fixed[c]) { /* a platen moves as prescribed, whatever its particles do behind it */
    const DemFace *face = &model->face[h->face];

    if (h->quantity[0] == 'd') *value = face->shift[c];
    else *value = face->motion[c] == DEM_VELOCITY ? TableValue(&face->table[c], model->time) : TableSlope(&face->table[c], model->time);
  } else { /* area mean over the face, of the facets' own points */
    const DemCells *cells = &model->cells;
    PetscReal       sum = 0, area = 0;

    for (PetscInt k = 0; k < cells->n_walls; k++)
      if (cells->wall_face[k] == h->face) {
        const PetscInt p = model->rank_of[cells->wall_p[k]];
        PetscReal      arm[3], turn[3];

        for (PetscInt d = 0; d < 3; d++) arm[d] = cells->wall_at[3 * k + d] - model->packing.x[3 * cells->wall_p[k] + d];
        if (h->quantity[0] == 'd') {
          DemTurn(model->dim, n, p, model->rot, arm, turn);
          sum += cells->wall_area[k] * (model->u[c * n + p] + turn[c]);
        } else sum += cells->wall_area[k] * model->v[c * n + p];
        area += cells->wall_area[k];
      }
    *value = area > 0 ? sum / area : 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean out-of-balance force over mean contact force: zero at rest.  Eq. (1.5) */
PetscErrorCode DemUnbalanced_Internal(void *ctx, PetscReal *ratio)
{
  DemModel         model = ctx;
  const PetscInt   n = model->n;
  const PetscReal *f = model->f;
  PetscReal        net = 0, through = 0;
  const DemBonds  *b = &model->bonds;
  PetscInt         m = b->n;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < n; p++)
    if (!DemInClump(model, p)) net += PetscSqrtReal(PetscSqr(f[p]) + PetscSqr(f[n + p]) + PetscSqr(f[2 * n + p]));
  for (PetscInt k = 0; k < model->clumps.n; k++) net += PetscSqrtReal(PetscSqr(model->clumps.force[3 * k]) + PetscSqr(model->clumps.force[3 * k + 1]) + PetscSqr(model->clumps.force[3 * k + 2]));
  for (PetscInt e = 0; e < b->n; e++) {
    PetscReal t[3];

    DemBondForce_Internal(model, e, t);
    through += PetscSqrtReal(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
  }
  if (model->contacts.on) DemContactsThrough_Internal(model, &through, &m);
  *ratio = through > 0 ? (net / DemGrains_Internal(model)) / (through / m) : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vector of each particle, packing's order: from component-major internal arrays. */
static void ToPackingOrder(DemModel model, const PetscReal *from, PetscReal *to)
{
  for (PetscInt p = 0; p < model->n; p++)
    for (PetscInt d = 0; d < 3; d++) to[3 * model->at[p] + d] = from[d * model->n + p];
}

/* Rotation vector from the quaternion: angle times axis. */
static void RotationVectors(DemModel model, PetscReal *to)
{
  const PetscInt n = model->n;

  for (PetscInt p = 0; p < n; p++) {
    PetscReal *o = to + 3 * model->at[p];

    o[0] = o[1] = o[2] = 0;
    if (model->dim == 2) o[2] = model->rot[2 * n + p];
    else {
      const PetscReal x = model->rot[n + p], y = model->rot[2 * n + p], z = model->rot[3 * n + p], s = PetscSqrtReal(x * x + y * y + z * z);
      const PetscReal f = s > 1e-12 ? 2 * PetscAtan2Real(s, model->rot[p]) / s : 2;

      o[0] = f * x;
      o[1] = f * y;
      o[2] = f * z;
    }
  }
}

/* Rows of particles that have left the box go; the arrays are ours to shorten. */
static PetscErrorCode LeaveOut(DemModel model, OutputBlock *block, PetscReal **where)
{
  PetscInt kept = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(3 * model->n, where));
  for (PetscInt k = 0; k < model->n; k++) {
    if (model->contacts.gone[model->rank_of[k]]) continue;
    for (PetscInt d = 0; d < 3; d++) (*where)[3 * kept + d] = model->packing.x[3 * k + d];
    for (PetscInt a = 0; a < block->n_arrays; a++) {
      PetscReal     *data = (PetscReal *)block->array[a].data;
      const PetscInt w = block->array[a].components;

      for (PetscInt d = 0; d < w; d++) data[w * kept + d] = data[w * k + d];
    }
    kept++;
  }
  block->n_points = block->n_cells = kept;
  block->x = *where;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode StepperWrite(void *ctx, Output output)
{
  DemModel       model = ctx;
  const PetscInt n = model->n;
  PetscReal     *data[12] = {NULL}, *radius, *where = NULL;
  PetscInt      *start, *node, m = 0;
  unsigned char *type;
  OutputArray    array[14];
  OutputBlock    block = {"particles", n, model->packing.x, n, NULL, NULL, NULL, 0, array};

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(n + 1, &start, n, &node, n, &type, n, &radius));
  for (PetscInt k = 0; k < n; k++) {
    start[k] = node[k] = k;
    type[k]            = 1;
    radius[k]          = model->packing.r[k];
  }
  start[n]   = n;
  block.start = start;
  block.node  = node;
  block.type  = type;
  array[m++]  = (OutputArray){"radius", "m", OUTPUT_POINT_DATA, 1, radius};
  if (OutputWants(output, "displacement")) {
    PetscCall(PetscMalloc1(3 * n, &data[0]));
    ToPackingOrder(model, model->u, data[0]);
    array[m++] = (OutputArray){"displacement", "m", OUTPUT_POINT_DATA, 3, data[0]};
  }
  if (OutputWants(output, "velocity")) {
    PetscCall(PetscMalloc1(3 * n, &data[1]));
    ToPackingOrder(model, model->v, data[1]);
    array[m++] = (OutputArray){"velocity", "m/s", OUTPUT_POINT_DATA, 3, data[1]};
  }
  if (OutputWants(output, "rotation")) {
    PetscCall(PetscMalloc1(3 * n, &data[2]));
    RotationVectors(model, data[2]);
    array[m++] = (OutputArray){"rotation", "rad", OUTPUT_POINT_DATA, 3, data[2]};
  }
  if (OutputWants(output, "orientation")) { /* w x y z; 2D: about z */
    PetscCall(PetscMalloc1(4 * n, &data[9]));
    for (PetscInt p = 0; p < n; p++) {
      PetscReal *q = data[9] + 4 * model->at[p];

      for (PetscInt d = 0; d < 4; d++) q[d] = model->dim == 3 ? model->rot[d * n + p] : 0;
      if (model->dim == 2) {
        q[0] = PetscCosReal(0.5 * model->rot[2 * n + p]);
        q[3] = PetscSinReal(0.5 * model->rot[2 * n + p]);
      }
    }
    array[m++] = (OutputArray){"orientation", "-", OUTPUT_POINT_DATA, 4, data[9]};
  }
  if (OutputWants(output, "stress")) {
    PetscCall(PetscMalloc1(6 * n, &data[3]));
    PetscCall(DemStress_Internal(model, data[3]));
    array[m++] = (OutputArray){"stress", "Pa", OUTPUT_POINT_DATA, 6, data[3]};
  }
  if (OutputWants(output, "strain")) {
    PetscCall(PetscMalloc1(6 * n, &data[4]));
    PetscCall(DemStrain_Internal(model, data[4]));
    array[m++] = (OutputArray){"strain", "-", OUTPUT_POINT_DATA, 6, data[4]};
  }
  if (OutputWants(output, "damage")) {
    PetscCall(PetscMalloc1(n, &data[5]));
    DemDamage_Internal(model, data[5]);
    array[m++] = (OutputArray){"damage", "-", OUTPUT_POINT_DATA, 1, data[5]};
  }
  if (OutputWants(output, "coordination")) {
    PetscCall(PetscMalloc1(n, &data[6]));
    DemCoordination_Internal(model, data[6]);
    array[m++] = (OutputArray){"coordination", "-", OUTPUT_POINT_DATA, 1, data[6]};
  }
  if (OutputWants(output, "criterion")) {
    PetscCall(PetscMalloc1(n, &data[7]));
    PetscCall(DemCriterion_Internal(model, data[7]));
    array[m++] = (OutputArray){"criterion", "-", OUTPUT_POINT_DATA, 1, data[7]};
  }
  if (OutputWants(output, "fragment")) {
    PetscInt *fragment, parts;

    PetscCall(PetscMalloc1(n, &data[8]));
    PetscCall(PetscMalloc1(n, &fragment));
    PetscCall(DemModelGetFragments(model, &parts, fragment));
    for (PetscInt k = 0; k < n; k++) data[8][k] = (PetscReal)fragment[k];
    PetscCall(PetscFree(fragment));
    array[m++] = (OutputArray){"fragment", "-", OUTPUT_POINT_DATA, 1, data[8]};
  }
  if (model->grain_of) {
    PetscCall(PetscMalloc1(n, &data[10]));
    for (PetscInt k = 0; k < n; k++) data[10][k] = (PetscReal)model->grain_of[k];
    array[m++] = (OutputArray){"body", "-", OUTPUT_POINT_DATA, 1, data[10]};
  }
  if (model->clumps.n) {
    PetscCall(PetscMalloc1(n, &data[11]));
    for (PetscInt k = 0; k < n; k++) data[11][k] = (PetscReal)model->clumps.of[model->rank_of[k]];
    array[m++] = (OutputArray){"clump", "-", OUTPUT_POINT_DATA, 1, data[11]};
  }
  block.n_arrays = m;
  if (model->contacts.n_gone) PetscCall(LeaveOut(model, &block, &where));
  PetscCall(OutputFrameBlock(output, &block));
  PetscCall(PetscFree(where));
  if (model->n_tools) PetscCall(DemToolsWrite_Internal(model, output));
  if (OutputWants(output, "bonds") && model->bonds.n) PetscCall(DemWriteBonds_Internal(model, output));
  if (OutputWants(output, "damage") && model->crack.damage) PetscCall(DemWriteCracks_Internal(model, output));
  for (PetscInt k = 0; k < 12; k++) PetscCall(PetscFree(data[k]));
  PetscCall(PetscFree4(start, node, type, radius));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Scalars that a restart needs, in one array. */
#define SCALARS 9

/* Bytes travel as integers. */
static PetscErrorCode SaveBytes(Checkpoint c, const char *name, PetscInt n, const unsigned char *bytes)
{
  PetscInt *copy;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &copy));
  for (PetscInt k = 0; k < n; k++) copy[k] = bytes[k];
  PetscCall(CheckpointWriteInt(c, name, n, copy));
  PetscCall(PetscFree(copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadBytes(Checkpoint c, const char *name, PetscInt n, unsigned char *bytes)
{
  PetscInt *copy;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &copy));
  PetscCall(CheckpointReadInt(c, name, n, copy));
  for (PetscInt k = 0; k < n; k++) bytes[k] = (unsigned char)copy[k];
  PetscCall(PetscFree(copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SaveCracks(DemModel model, Checkpoint c)
{
  const DemCrackState *crack = &model->crack;
  const PetscInt       m = model->bonds.n;

  PetscFunctionBegin;
  PetscCall(CheckpointWriteReal(c, "dem/bond_damage", m, crack->damage));
  PetscCall(CheckpointWriteReal(c, "dem/bond_opening_direction", 3 * m, crack->e));
  PetscCall(CheckpointWriteReal(c, "dem/bond_slip", 3 * m, crack->slip));
  PetscCall(CheckpointWriteReal(c, "dem/bond_fracture_work", m, crack->work));
  PetscCall(CheckpointWriteReal(c, "dem/bond_friction_work", m, crack->rub));
  PetscCall(CheckpointWriteReal(c, "dem/bond_time", m, crack->time));
  PetscCall(CheckpointWriteReal(c, "dem/bond_release", m, crack->release));
  PetscCall(CheckpointWriteReal(c, "dem/crack_stress", 6 * model->n, crack->stress));
  PetscCall(SaveBytes(c, "dem/bond_state", m, crack->state));
  if (crack->limit) PetscCall(CheckpointWriteReal(c, "dem/bond_limit", m, crack->limit));
  PetscCall(CheckpointWriteInt(c, "dem/block_live", model->blocks.n_blocks, crack->n_live));
  PetscCall(CheckpointWriteInt(c, "dem/bond_live", m, crack->live));
  PetscCall(CheckpointWriteInt(c, "dem/stress_steps", 1, &crack->steps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadCracks(DemModel model, Checkpoint c)
{
  DemCrackState *crack = &model->crack;
  const PetscInt m = model->bonds.n;

  PetscFunctionBegin;
  PetscCall(CheckpointReadReal(c, "dem/bond_damage", m, crack->damage));
  PetscCall(CheckpointReadReal(c, "dem/bond_opening_direction", 3 * m, crack->e));
  PetscCall(CheckpointReadReal(c, "dem/bond_slip", 3 * m, crack->slip));
  PetscCall(CheckpointReadReal(c, "dem/bond_fracture_work", m, crack->work));
  PetscCall(CheckpointReadReal(c, "dem/bond_friction_work", m, crack->rub));
  PetscCall(CheckpointReadReal(c, "dem/bond_time", m, crack->time));
  PetscCall(CheckpointReadReal(c, "dem/bond_release", m, crack->release));
  PetscCall(CheckpointReadReal(c, "dem/crack_stress", 6 * model->n, crack->stress));
  PetscCall(LoadBytes(c, "dem/bond_state", m, crack->state));
  if (crack->limit) PetscCall(CheckpointReadReal(c, "dem/bond_limit", m, crack->limit));
  PetscCall(CheckpointReadInt(c, "dem/block_live", model->blocks.n_blocks, crack->n_live));
  PetscCall(CheckpointReadInt(c, "dem/bond_live", m, crack->live));
  for (PetscInt b = 0; b < model->blocks.n_blocks; b++) crack->awake[b] = crack->n_live[b] > 0;
  for (PetscInt k = 0; k < m; k++) model->bonds.now[k] = (1 - crack->damage[k]) * model->bonds.k[k];
  PetscCall(CheckpointReadInt(c, "dem/stress_steps", 1, &crack->steps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode StepperSave(void *ctx, Checkpoint c)
{
  DemModel        model = ctx;
  const PetscInt  n = model->n;
  const PetscReal scalar[SCALARS] = {model->time, model->dt_last, model->started, model->work, model->work_in, model->damped, model->contact_lost, model->friction_lost, model->stable};
  char            name[64];

  PetscFunctionBegin;
  PetscCall(CheckpointWriteReal(c, "dem/scalars", SCALARS, scalar));
  PetscCall(CheckpointWriteInt(c, "dem/number", n, model->at)); /* packing's number of each row below: global ids */
  PetscCall(CheckpointWriteReal(c, "dem/displacement", 3 * n, model->u));
  PetscCall(CheckpointWriteReal(c, "dem/velocity", 3 * n, model->v));
  PetscCall(CheckpointWriteReal(c, "dem/rotation", 4 * n, model->rot));
  PetscCall(CheckpointWriteReal(c, "dem/spin", 3 * n, model->spin));
  PetscCall(CheckpointWriteReal(c, "dem/force", 3 * n, model->f));
  PetscCall(CheckpointWriteReal(c, "dem/couple", 3 * n, model->torque));
  PetscCall(CheckpointWriteReal(c, "dem/dilation", n, model->dilation));
  PetscCall(CheckpointWriteReal(c, "dem/vstar", n, model->vstar));
  if (model->crack.damage) PetscCall(SaveCracks(model, c));
  if (model->contacts.on) PetscCall(DemContactsSave_Internal(model, c));
  if (model->rain.rate > 0) PetscCall(DemRainSave_Internal(model, c));
  PetscCall(DemClumpsSave_Internal(model, c));
  if (model->net) PetscCall(DemRuleSave_Internal(model, c));
  for (PetscInt k = 0; k < model->n_faces; k++) {
    PetscCall(BaseFormat(name, "dem/reaction_%" PetscInt_FMT, k));
    PetscCall(CheckpointWriteReal(c, name, 3, model->face[k].reaction));
  }
  if (model->walls.n) PetscCall(CheckpointWriteReal(c, "dem/traction", 7 * model->walls.n, model->traction_new));
  PetscCall(DemToolsSave_Internal(model, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode StepperLoad(void *ctx, Checkpoint c)
{
  DemModel       model = ctx;
  const PetscInt n = model->n;
  PetscReal      scalar[SCALARS];
  PetscInt      *number;
  PetscBool      same = PETSC_TRUE;
  char           name[64];

  PetscFunctionBegin;
  PetscCall(CheckpointReadReal(c, "dem/scalars", SCALARS, scalar));
  PetscCall(PetscMalloc1(n, &number));
  PetscCall(CheckpointReadInt(c, "dem/number", n, number));
  for (PetscInt p = 0; p < n; p++) same = (PetscBool)(same && number[p] == model->at[p]);
  PetscCall(PetscFree(number));
  BaseCheckInput(same, model->comm, "The checkpoint's particles stand in another order: it belongs to another packing than this scene makes");
  PetscCall(CheckpointReadReal(c, "dem/displacement", 3 * n, model->u));
  PetscCall(CheckpointReadReal(c, "dem/velocity", 3 * n, model->v));
  PetscCall(CheckpointReadReal(c, "dem/rotation", 4 * n, model->rot));
  PetscCall(CheckpointReadReal(c, "dem/spin", 3 * n, model->spin));
  PetscCall(CheckpointReadReal(c, "dem/force", 3 * n, model->f));
  PetscCall(CheckpointReadReal(c, "dem/couple", 3 * n, model->torque));
  PetscCall(CheckpointReadReal(c, "dem/dilation", n, model->dilation));
  PetscCall(CheckpointReadReal(c, "dem/vstar", n, model->vstar));
  if (model->crack.damage) PetscCall(LoadCracks(model, c));
  if (model->contacts.on) PetscCall(DemContactsLoad_Internal(model, c));
  if (model->rain.rate > 0) PetscCall(DemRainLoad_Internal(model, c));
  PetscCall(DemClumpsLoad_Internal(model, c));
  if (model->net) PetscCall(DemRuleLoad_Internal(model, c));
  model->time          = scalar[0];
  model->dt_last       = scalar[1];
  model->started       = (PetscBool)(scalar[2] != 0);
  model->work          = scalar[3];
  model->work_in       = scalar[4];
  model->damped        = scalar[5];
  model->contact_lost  = scalar[6];
  model->friction_lost = scalar[7];
  model->stable        = scalar[8];
  DemFacesSetTime_Internal(model, model->time);
  for (PetscInt k = 0; k < model->n_faces; k++) {
    PetscCall(BaseFormat(name, "dem/reaction_%" PetscInt_FMT, k));
    PetscCall(CheckpointReadReal(c, name, 3, model->face[k].reaction));
  }
  if (model->walls.n) PetscCall(CheckpointReadReal(c, "dem/traction", 7 * model->walls.n, model->traction_new));
  PetscCall(DemToolsLoad_Internal(model, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetStepper(DemModel model, Stepper *stepper)
{
  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before asking for the stepper");
  if (!model->history_name) {
    PetscCall(PetscMalloc2(model->n_history, &model->history_name, model->n_history, &model->history_unit));
    for (PetscInt k = 0; k < model->n_history; k++) {
      model->history_name[k] = model->history[k].name;
      model->history_unit[k] = model->history[k].unit;
    }
  }
  PetscCall(PetscMemzero(stepper, sizeof(*stepper)));
  *stepper = (Stepper){.name = "dem", .ctx = model, .stable_step = StepperStable, .step = DemStep_Internal, .energy = StepperEnergy, .watch = DemWatch_Internal, .history = StepperHistory, .write = StepperWrite,
                       .save = StepperSave, .load = StepperLoad, .unbalanced = model->bonds.n ? DemUnbalanced_Internal : NULL, .n_history = model->n_history, .history_name = model->history_name,
                       .history_unit = model->history_unit, .elements = model->bonds.n ? model->bonds.n : model->n};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelComputeForces(DemModel model)
{
  PetscFunctionBegin;
  DemFacesSetTime_Internal(model, model->time);
  PetscCall(DemForces_Internal(model, DEM_WITH_LOADS));
  if (model->contacts.on) PetscCall(DemContactsForce_Internal(model, 0));
  if (model->n_tools) PetscCall(DemToolsForce_Internal(model, 0));
  DemClumpsGather_Internal(model);
  if (model->started && model->walls.n) { /* what the next step's work starts from */
    DemFacesReactions_Internal(model);
    (void)DemTractionWork_Internal(model, NULL, model->traction_new);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetState(DemModel model, DemState *s)
{
  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before borrowing the state");
  if (!model->f_ext) PetscCall(PetscCalloc2(3 * model->n, &model->f_ext, 3 * model->n, &model->t_ext));
  *s = (DemState){model->dim, model->n, model->at, model->x0, model->u, model->v, model->rot, model->spin, model->f, model->torque, model->mass, model->inertia, model->f_ext, model->t_ext};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetOutside(DemModel model, DemOutside *o)
{
  const DemContacts *c = &model->contacts;

  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before asking for the outside");
  *o = (DemOutside){.n = c->on ? c->n_who : model->n_surface, .looks = c->on ? c->searches : 0, .who = c->on ? c->who : model->surface, .radius = model->r};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelRestoreState(DemModel model, DemState *s)
{
  PetscFunctionBegin;
  PetscCheck(s->u == model->u, model->comm, PETSC_ERR_ARG_WRONG, "This state was not borrowed from this model");
  PetscCall(PetscMemzero(s, sizeof(*s)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
