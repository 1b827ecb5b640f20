/* dem_stepper.c - the model as the run loop sees it: energies, history, frames, checkpoints. */
#include "dem_rule.h"

static PetscErrorCode StepperStable(void *ctx, PetscReal *dt)
{
  if (((DemModel)ctx)->statics) { /* any will do */
    *dt = PETSC_MAX_REAL;
    return PETSC_SUCCESS;
  }
  return DemModelGetCriticalStep(ctx, dt);
}

static PetscErrorCode StepperEnergy(void *ctx, Ledger *ledger)
{
  enum { GRAVITY, DAMPED, POISSON, TOOLS, CONTACTS, LOST, FRICTION, FRACTURE, TAKEN, SCALE, PARTS }; /* sums over what is here [J] */
  DemModel       model = ctx;
  const PetscInt n = model->n;
  PetscReal      kinetic, due, strain, gravity = 0, moving = 0, here[PARTS] = {0};

  PetscFunctionBegin;
  PetscCall(PetscMemzero(ledger, sizeof(*ledger)));
  PetscCall(DemKineticEnergy_Internal(model, &kinetic, &due));
  PetscCall(DemStrainEnergy_Internal(model, &strain));
  if (model->gravity[0] != 0 || model->gravity[1] != 0 || model->gravity[2] != 0) /* a potential: its work needs no sum over time */
    for (PetscInt p = 0; p < model->own; p++) {
      const PetscReal c[3] = {model->offset[p], model->offset[n + p], model->offset[2 * n + p]};
      PetscReal       turn[3];

      if (DemInClump(model, p)) continue;
      DemTurn(model->dim, n, p, model->rot, c, turn);
      for (PetscInt d = 0; d < model->dim; d++) gravity += model->mass[p] * model->gravity[d] * (model->u[d * n + p] + turn[d]);
    }
  here[GRAVITY]  = gravity;
  here[DAMPED]   = model->damped;
  here[POISSON]  = model->net ? model->net->nu_work : 0;
  here[TOOLS]    = DemToolsEnergy_Internal(model);
  here[CONTACTS] = model->contacts.on ? DemContactsEnergy_Internal(model) : 0;
  here[LOST]     = model->contact_lost;
  here[FRICTION] = model->friction_lost;
  here[TAKEN]    = model->contacts.taken;
  if (model->crack.damage)
    for (PetscInt k = 0; k < model->bonds.n; k++) {
      if (!DemBondIsMine(model, k)) continue;
      here[FRACTURE] += model->crack.work[k];
      here[FRICTION] += model->crack.rub[k];
    }
  for (PetscInt p = 0; p < model->own; p++) here[SCALE] += 0.5 * model->material.young * model->volume[p];
  PetscCall(DemSumRanks_Internal(model, PARTS, here));
  PetscCall(DemRanksFlush_Internal(model));
  gravity = here[GRAVITY];
  DemClumpsEnergy_Internal(model, &moving, &gravity);
  if (model->n_tools) DemToolsKinetic_Internal(model, &kinetic, &gravity);
  ledger->energy[LEDGER_KINETIC]  = kinetic;
  ledger->energy[LEDGER_STRAIN]   = strain;
  ledger->energy[LEDGER_DAMPING]  = here[DAMPED] + due + here[POISSON];
  ledger->energy[LEDGER_CONTACT]  = here[TOOLS] + here[CONTACTS] + here[LOST];
  ledger->energy[LEDGER_FRICTION] = here[FRICTION];
  ledger->energy[LEDGER_FRACTURE] = here[FRACTURE];
  ledger->energy[LEDGER_WORK]     = model->work + gravity - here[TAKEN];
  ledger->work_in                 = model->work_in + PetscAbsReal(gravity);
  ledger->scale                   = here[SCALE]; /* strain energy of a strain of one: what the floor of the error is taken from */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode StepperHistory(void *ctx, PetscInt i, PetscReal *value)
{
  DemModel          model = ctx;
  const DemHistory *h = &model->history[i];
  const PetscInt    n = model->n, c = h->component;

  PetscFunctionBegin;
  if (h->quantity[0] == 'p') {
    *value = 0;
    if (h->particle != -2) PetscCall(DemProbe_Internal(model, h, value)); /* -2: another rank's */
    PetscCall(DemSumRanks_Internal(model, h->particle == -1 ? 0 : 1, value));
  }
  else if (h->tool < 0 && h->face < 0) PetscCall(DemColumn_Internal(model, h, value));
  else if (h->tool >= 0) *value = DemToolHistory_Internal(model, h->tool, h->quantity, c);
  else if (h->quantity[0] == 'r') {
    DemFacesReactions_Internal(model);
    *value = model->face[h->face].reaction[c];
    PetscCall(DemSumRanks_Internal(model, 1, value));
  } else if (model->face[h->face].fixed[c]) { /* a platen moves as prescribed, whatever its particles do behind it */
    const DemFace *face = &model->face[h->face];

    if (h->quantity[0] == 'd') *value = face->shift[c];
    else *value = face->motion[c] == DEM_VELOCITY ? TableRate(&face->table[c], model->time) : TableSlope(&face->table[c], model->time);
  } else { /* area mean over the face, of the facets' own points */
    const DemCells *cells = &model->cells;
    PetscReal       both[2], sum = 0, area = 0;

    for (PetscInt k = 0; k < cells->n_walls; k++)
      if (cells->wall_face[k] == h->face) {
        const PetscInt p = model->rank_of[cells->wall_p[k]];
        PetscReal      arm[3], turn[3];

        for (PetscInt d = 0; d < 3; d++) arm[d] = cells->wall_at[3 * k + d] - model->packing.x[3 * cells->wall_p[k] + d];
        if (h->quantity[0] == 'd') {
          DemTurn(model->dim, n, p, model->rot, arm, turn);
          sum += cells->wall_area[k] * (model->u[c * n + p] + turn[c] - (model->begin ? model->begin[3 * cells->wall_p[k] + c] : 0));
        } else sum += cells->wall_area[k] * model->v[c * n + p];
        area += cells->wall_area[k];
      }
    both[0] = sum;
    both[1] = area;
    PetscCall(DemSumRanks_Internal(model, 2, both));
    *value = both[1] > 0 ? both[0] / both[1] : 0;
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
  PetscInt         m = 0;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < model->own; p++)
    if (!DemInClump(model, p)) net += PetscSqrtReal(PetscSqr(f[p]) + PetscSqr(f[n + p]) + PetscSqr(f[2 * n + p]));
  for (PetscInt k = 0; k < model->clumps.n; k++) net += PetscSqrtReal(PetscSqr(model->clumps.force[3 * k]) + PetscSqr(model->clumps.force[3 * k + 1]) + PetscSqr(model->clumps.force[3 * k + 2]));
  for (PetscInt e = 0; e < b->n; e++) {
    PetscReal t[3];

    if (!DemBondIsMine(model, e)) continue;
    DemBondForce_Internal(model, e, t);
    through += PetscSqrtReal(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
  }
  for (PetscInt e = 0; e < b->n; e++) m += DemBondIsMine(model, e);
  if (model->contacts.on) DemContactsThrough_Internal(model, &through, &m);
  if (model->ranks) {
    PetscReal all[3] = {net, through, (PetscReal)m};

    PetscCall(DemSumRanks_Internal(model, 3, all));
    net     = all[0];
    through = all[1];
    m       = (PetscInt)all[2];
  }
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
    for (PetscInt k = 0; model->begin && k < 3 * n; k++) data[0][k] -= model->begin[k];
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
  if (model->ranks) {
    PetscCall(DemGatherBlock_Internal(model, &block));
    PetscCall(OutputFrameBlock(output, &block));
    PetscCall(DemGatherBlockFree_Internal(model, &block));
  } else {
    if (model->contacts.n_gone) PetscCall(LeaveOut(model, &block, &where));
    PetscCall(OutputFrameBlock(output, &block));
  }
  PetscCall(PetscFree(where));
  if (model->n_tools) PetscCall(DemToolsWrite_Internal(model, output));
  if (OutputWants(output, "bonds") && (model->ranks ? model->ranks->bonds : model->bonds.n)) PetscCall(DemWriteBonds_Internal(model, output));
  if (OutputWants(output, "damage") && model->crack.damage) PetscCall(DemWriteCracks_Internal(model, output));
  for (PetscInt k = 0; k < 12; k++) PetscCall(PetscFree(data[k]));
  PetscCall(PetscFree4(start, node, type, radius));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetStepper(DemModel model, Stepper *stepper)
{
  PetscInt particles, bonds;

  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before asking for the stepper");
  if (!model->history_name) {
    PetscCall(PetscMalloc2(model->n_history, &model->history_name, model->n_history, &model->history_unit));
    for (PetscInt k = 0; k < model->n_history; k++) {
      model->history_name[k] = model->history[k].name;
      model->history_unit[k] = model->history[k].unit;
    }
  }
  PetscCall(DemModelGetCounts(model, &particles, &bonds, NULL)); /* of all ranks */
  PetscCall(PetscMemzero(stepper, sizeof(*stepper)));
  *stepper = (Stepper){.name = "dem", .ctx = model, .stable_step = StepperStable, .step = model->statics ? DemStaticStep_Internal : DemStep_Internal, .energy = StepperEnergy, .watch = DemWatch_Internal, .history = StepperHistory, .write = StepperWrite,
                       .save = DemSave_Internal, .load = DemLoad_Internal, .unbalanced = bonds ? DemUnbalanced_Internal : NULL, .n_history = model->n_history, .history_name = model->history_name,
                       .history_unit = model->history_unit, .elements = bonds ? bonds : particles};
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

PetscErrorCode DemModelAddForces(DemModel model, const PetscReal force[])
{
  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Forces are added after DemModelSetUp()");
  for (PetscInt k = 0; k < model->dim * model->n; k++) model->f[k] += force[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetState(DemModel model, DemState *s)
{
  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before borrowing the state");
  if (!model->f_ext) PetscCall(PetscCalloc2(3 * model->n, &model->f_ext, 3 * model->n, &model->t_ext));
  *s = (DemState){model->dim, model->n, model->own, model->ranks ? model->ranks->number : model->at, model->x0, model->u, model->v, model->rot, model->spin, model->f, model->torque, model->mass, model->inertia, model->f_ext, model->t_ext};
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
