/* coupling_switch.c - a CouplingSwitch's life: what may turn, the region's packing, the first split.  Section 8 of docs/theory.md */
#include "coupling_switch.h"

PetscErrorCode CouplingSwitchCreate(MPI_Comm comm, const Mesh *whole, const char *seed, PetscInt width, const CouplingSwitchOptions *options, CouplingSwitch *out)
{
  CouplingSwitch sw;
  PetscBool     *both;

  PetscFunctionBegin;
  BaseCheckInput(options->at > 0 && options->at < 1, comm, "Elements turn at %.4g of their strength; the fraction must lie between 0 and 1, 0.5 to 0.8 is usual", (double)options->at);
  BaseCheckInput(options->hysteresis >= 0 && options->hysteresis < 1, comm, "The hysteresis %.4g must lie in [0, 1)", (double)options->hysteresis);
  BaseCheckInput(options->ahead >= 0, comm, "%" PetscInt_FMT " rings ahead; 0 or more are possible", options->ahead);
  BaseCheckInput(width >= 1, comm, "The overlap must be at least one element wide, not %" PetscInt_FMT, width);
  PetscCall(PetscNew(&sw));
  *out        = sw;
  sw->comm    = comm;
  sw->whole   = whole;
  sw->width   = width;
  sw->options = *options;
  sw->blocked = -1;
  PetscCall(PetscStrncpy(sw->seed, seed, sizeof(sw->seed)));
  PetscCall(PetscCalloc6(whole->n_cells, &sw->is_dem, whole->n_cells, &sw->may, whole->n_cells, &sw->stays, whole->n_cells, &sw->ring, whole->n_nodes, &sw->reach, whole->n_cells, &sw->use));
  PetscCall(CouplingGroupCells_Internal(whole, seed, sw->is_dem));
  if (options->group) PetscCall(CouplingGroupCells_Internal(whole, options->group, sw->may));
  else
    for (PetscInt c = 0; c < whole->n_cells; c++) sw->may[c] = (PetscBool)(MeshCellDim(whole->type[c]) == whole->dim);
  PetscCall(PetscMalloc1(whole->n_cells, &both));
  for (PetscInt c = 0; c < whole->n_cells; c++) both[c] = (PetscBool)(sw->may[c] || sw->is_dem[c]);
  PetscCall(CouplingRegion_Internal(whole, both, width, &sw->region));
  PetscCall(PetscFree(both));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSwitchGetRegion(CouplingSwitch sw, const Mesh **region)
{
  PetscFunctionBegin;
  *region = &sw->region;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSwitchProtect(CouplingSwitch sw, const char *name)
{
  const Mesh      *mesh = sw->whole;
  const MeshGroup *group;
  PetscBool       *of;

  PetscFunctionBegin;
  if (sw->ready) PetscFunctionReturn(PETSC_SUCCESS); /* said again when the sides are made anew */
  PetscCall(MeshFindGroup(mesh, name, &group));
  if (!group) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(mesh->n_nodes, &of));
  for (PetscInt k = 0; k < group->n_cells; k++)
    for (PetscInt a = mesh->start[group->cell[k]]; a < mesh->start[group->cell[k] + 1]; a++) of[mesh->node[a]] = PETSC_TRUE;
  for (PetscInt c = 0; c < mesh->n_cells; c++)
    for (PetscInt a = mesh->start[c]; MeshCellDim(mesh->type[c]) == mesh->dim && a < mesh->start[c + 1]; a++)
      if (of[mesh->node[a]]) sw->stays[c] = PETSC_TRUE;
  PetscCall(PetscFree(of));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSwitchSetBody(CouplingSwitch sw, const DemBody *body, const DemPacking *packing, const DemCells *cells, const FemMaterial *material, const DemStrength *strength, FemKind kind, PetscReal thickness)
{
  PetscInt rim;

  PetscFunctionBegin;
  PetscCheck(!sw->w.mesh, sw->comm, PETSC_ERR_ORDER, "A CouplingSwitch takes one body");
  BaseCheckInput(sw->options.when != COUPLING_GIVEN || sw->options.given || sw->options.given_strength > 0, sw->comm, "A given criterion needs a function, or its numbers: (mean p + mises q) / strength");
  BaseCheckInput(strength->tensile > 0 || strength->shear > 0, sw->comm, "Elements that turn into particles need a material with a strength (law: cohesive)");
  sw->w         = (CouplingWhole){sw->whole, &sw->body, packing, cells, NULL, NULL};
  sw->material  = *material;
  sw->strength  = *strength;
  sw->kind      = kind;
  sw->thickness = sw->whole->dim == 3 ? 1 : thickness;
  sw->mu        = material->young / (2 * (1 + material->poisson));
  sw->lambda    = material->young * material->poisson / ((1 + material->poisson) * (1 - 2 * material->poisson));
  if (kind == FEM_PLANE_STRESS) sw->lambda = 2 * sw->lambda * sw->mu / (sw->lambda + 2 * sw->mu);
  sw->body = *body; /* the faces are our own: one more, where awake particles end */
  PetscCall(DemBodyFindFace(body, COUPLING_RIM, &rim));
  PetscCall(PetscCalloc1(body->n_faces + 1, &sw->body.face_name));
  PetscCall(PetscArraycpy(sw->body.face_name, body->face_name, body->n_faces));
  if (rim < 0) PetscCall(PetscStrncpy(sw->body.face_name[sw->body.n_faces++], COUPLING_RIM, sizeof(sw->body.face_name[0])));
  PetscCall(CouplingHomes_Internal(sw->whole, packing, cells, &sw->w.home, &sw->w.facet_home));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSwitchSetWeakness(CouplingSwitch sw, const PetscReal part[])
{
  const DemCells *cells = sw->w.cells;

  PetscFunctionBegin;
  PetscCheck(sw->w.mesh && !sw->ready && !sw->weak, sw->comm, PETSC_ERR_ORDER, "Say how weak facets are once, between CouplingSwitchSetBody() and CouplingSwitchSetUp()");
  PetscCall(PetscMalloc2(cells->n_facets, &sw->weak, sw->whole->n_cells, &sw->weak_cell));
  PetscCall(PetscArraycpy(sw->weak, part, cells->n_facets));
  for (PetscInt c = 0; c < sw->whole->n_cells; c++) sw->weak_cell[c] = 1;
  for (PetscInt f = 0; f < cells->n_facets; f++) {
    const PetscInt c[3] = {sw->w.home[cells->p[f]], sw->w.home[cells->q[f]], sw->w.facet_home[f]};

    for (PetscInt k = 0; k < 3; k++)
      if (c[k] >= 0) sw->weak_cell[c[k]] = PetscMin(sw->weak_cell[c[k]], part[f]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingWeaken_Internal(CouplingSwitch sw, const CouplingCarved *carved, DemModel dem)
{
  PetscReal *part;

  PetscFunctionBegin;
  if (!sw->weak) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(carved->cells.n_facets, &part));
  for (PetscInt f = 0; f < carved->cells.n_facets; f++) part[f] = sw->weak[carved->facet[f]];
  PetscCall(DemModelSetWeakness(dem, part));
  PetscCall(PetscFree(part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal CouplingVolume_Internal(const Mesh *mesh, PetscInt c)
{
  const PetscInt  first = mesh->start[c], n = mesh->start[c + 1] - first;
  const FemShape *shape = FemShapeGet(mesh->type[c]);
  PetscReal       x[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], volume = 0;

  for (PetscInt a = 0; a < n; a++)
    for (PetscInt d = 0; d < mesh->dim; d++) x[a * mesh->dim + d] = mesh->x[3 * mesh->node[first + a] + d];
  (void)FemGradients(shape, x, 1, dN, w);
  for (PetscInt g = 0; g < shape->points; g++) volume += w[g];
  return volume;
}

/* What both sides together must weigh in every split, and where: lumped, as the elements' nodes are. */
static PetscErrorCode BodyMass(CouplingSwitch sw)
{
  const Mesh *mesh = sw->whole;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 4; k++) sw->mass[k] = 0;
  for (PetscInt c = 0; c < mesh->n_cells; c++) {
    const PetscInt  first = mesh->start[c], n = mesh->start[c + 1] - first;
    const FemShape *shape = FemShapeGet(mesh->type[c]);
    PetscReal       x[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], m[FEM_MAX_NODES];

    if (MeshCellDim(mesh->type[c]) != mesh->dim) continue;
    for (PetscInt a = 0; a < n; a++)
      for (PetscInt d = 0; d < mesh->dim; d++) x[a * mesh->dim + d] = mesh->x[3 * mesh->node[first + a] + d];
    (void)FemGradients(shape, x, sw->thickness, dN, w);
    FemLumpedMass(shape, sw->material.density, w, m);
    for (PetscInt a = 0; a < n; a++) {
      sw->mass[0] += m[a];
      for (PetscInt d = 0; d < mesh->dim; d++) sw->mass[1 + d] += m[a] * x[a * mesh->dim + d];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells so near one that stays that the overlap would reach it may not turn; the smallest that may. */
static PetscErrorCode Limits(CouplingSwitch sw)
{
  const Mesh *mesh = sw->whole;
  PetscInt   *ring, *reach;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(mesh->n_cells, &ring, mesh->n_nodes, &reach));
  PetscCall(CouplingRings_Internal(mesh, sw->stays, sw->width, ring, reach));
  sw->smallest = PETSC_MAX_REAL;
  for (PetscInt c = 0; c < mesh->n_cells; c++) {
    if (MeshCellDim(mesh->type[c]) != mesh->dim) continue;
    if (ring[c] >= 0) sw->may[c] = PETSC_FALSE;
    if (sw->may[c] || sw->is_dem[c]) sw->smallest = PetscMin(sw->smallest, PetscPowReal(CouplingVolume_Internal(mesh, c), 1.0 / mesh->dim));
  }
  PetscCall(PetscFree2(ring, reach));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whatever turns later must bear the same step, and the softening curve its longest bond: all that may turn as particles, once. */
static PetscErrorCode WholeRegion(CouplingSwitch sw)
{
  CouplingCarved carved;
  FemModel       fem = NULL;
  DemModel       dem = NULL;
  PetscInt      *ring, *reach;
  PetscBool     *most;
  PetscReal      dt;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(sw->whole->n_cells, &ring, sw->whole->n_nodes, &reach, sw->whole->n_cells, &most));
  for (PetscInt c = 0; c < sw->whole->n_cells; c++) most[c] = (PetscBool)(sw->may[c] || sw->is_dem[c]);
  PetscCall(CouplingRings_Internal(sw->whole, most, sw->width, ring, reach));
  PetscCall(CouplingCarve_Internal(&sw->w, ring, &carved));
  PetscCall(sw->make(sw->ctx, &sw->now->split, &sw->body, &carved.packing, &carved.cells, &fem, &dem));
  PetscCall(CouplingWeaken_Internal(sw, &carved, dem));
  PetscCall(DemModelSetRim(dem, COUPLING_RIM));
  PetscCall(DemModelSetUp(dem));
  PetscCall(DemModelGetCriticalStep(dem, &dt));
  sw->limit = PetscMin(sw->limit, CouplingStepShare(&sw->coupling) * dt * sw->substeps);
  PetscCall(FemModelDestroy(&fem));
  PetscCall(DemModelDestroy(&dem));
  PetscCall(CouplingCarvedDestroy_Internal(&carved));
  PetscCall(PetscFree3(ring, reach, most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSwitchSetUp(CouplingSwitch sw, const CouplingOptions *options, CouplingMakeSides make, void *ctx)
{
  CouplingReport report;

  PetscFunctionBegin;
  PetscCheck(sw->w.mesh && !sw->ready, sw->comm, PETSC_ERR_ORDER, "Call CouplingSwitchSetBody(), then CouplingSwitchSetUp() once");
  BaseCheckInput(options->method == COUPLING_ENERGY, sw->comm, "Elements that turn into particles go with method: energy alone; the other methods are there for comparison of overlaps that stay");
  sw->coupling = *options;
  sw->make     = make;
  sw->ctx      = ctx;
  for (PetscInt c = 0; c < sw->whole->n_cells; c++) sw->use[c] = 0;
  PetscCall(BodyMass(sw));
  PetscCall(CouplingBuild_Internal(sw, &sw->now));
  PetscCall(Limits(sw)); /* what conditions hold was said while the sides were made */
  PetscCall(CouplingModelGetReport(sw->now->model, &report));
  sw->substeps = report.substeps;
  PetscCall(CouplingModelGetCriticalStep(sw->now->model, &sw->limit));
  if (!sw->options.off) PetscCall(WholeRegion(sw));
  sw->ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSwitchGetCriticalStep(CouplingSwitch sw, PetscReal *dt)
{
  PetscFunctionBegin;
  PetscCheck(sw->ready, sw->comm, PETSC_ERR_ORDER, "Call CouplingSwitchSetUp() before asking for the step");
  *dt = sw->limit;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSwitchGetSides(CouplingSwitch sw, CouplingModel *model, FemModel *fem, DemModel *dem, const CouplingSplit **split)
{
  PetscFunctionBegin;
  PetscCheck(sw->ready, sw->comm, PETSC_ERR_ORDER, "Call CouplingSwitchSetUp() before asking for the sides");
  if (model) *model = sw->now->model;
  if (fem) *fem = sw->now->fem;
  if (dem) *dem = CouplingMoving(sw->now->model);
  if (split) *split = &sw->now->split;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSwitchGetReport(CouplingSwitch sw, CouplingSwitchReport *report)
{
  PetscFunctionBegin;
  PetscCheck(sw->ready, sw->comm, PETSC_ERR_ORDER, "Call CouplingSwitchSetUp() before asking for the report");
  *report = (CouplingSwitchReport){.n_events = sw->n_events, .event = sw->event, .cells = sw->n_turned, .particles = sw->now->carved.packing.n, .sleeping = sw->w.packing->n - sw->now->carved.packing.n,
                                   .booked = sw->booked, .bond_steps = sw->bond_steps, .element_steps = sw->element_steps, .looks = sw->looks, .blocked = sw->blocked >= 0 ? sw->whole->cell_id[sw->blocked] : -1,
                                   .blocked_time = sw->blocked_time, .every = sw->every};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSwitchDestroy(CouplingSwitch *psw)
{
  CouplingSwitch sw = *psw;

  PetscFunctionBegin;
  if (!sw) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CouplingHalvesDestroy_Internal(&sw->now));
  PetscCall(MeshDestroy(&sw->region));
  PetscCall(PetscFree6(sw->is_dem, sw->may, sw->stays, sw->ring, sw->reach, sw->use));
  PetscCall(PetscFree(sw->w.home));
  PetscCall(PetscFree(sw->w.facet_home));
  if (sw->w.mesh) PetscCall(PetscFree(sw->body.face_name));
  PetscCall(PetscFree(sw->event));
  PetscCall(PetscFree2(sw->skin, sw->skin_margin));
  PetscCall(PetscFree2(sw->weak, sw->weak_cell));
  for (PetscInt k = 0; k < sw->n_columns; k++) {
    PetscCall(PetscFree(sw->history_name[k]));
    PetscCall(PetscFree(sw->history_unit[k]));
  }
  PetscCall(PetscFree2(sw->history_name, sw->history_unit));
  PetscCall(PetscFree(*psw));
  PetscFunctionReturn(PETSC_SUCCESS);
}
