/* dem_model.c - making a DemModel and telling it what it is. */
#include "dem_rule.h"

PetscErrorCode DemModelCreate(MPI_Comm comm, DemModel *model)
{
  PetscFunctionBegin;
  PetscCall(PetscNew(model));
  (*model)->comm    = comm;
  (*model)->threads = 1;
  (*model)->bonded  = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetKind(DemModel model, DemKind kind)
{
  PetscFunctionBegin;
  model->kind = kind;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetThreads(DemModel model, PetscInt threads)
{
  PetscFunctionBegin;
  BaseCheckInput(threads > 0, model->comm, "%" PetscInt_FMT " threads: at least one is needed", threads);
  PetscCheck(!model->ready, model->comm, PETSC_ERR_ORDER, "The number of threads is fixed at set-up");
  model->threads = threads;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetMaterial(DemModel model, const DemMaterial *material)
{
  PetscFunctionBegin;
  BaseCheckInput(material->density > 0, model->comm, "Density %.6g kg/m3 must be positive", (double)material->density);
  BaseCheckInput(material->young > 0, model->comm, "Young's modulus %.6g Pa must be positive", (double)material->young);
  BaseCheckInput(material->poisson > -1 && material->poisson < 0.5, model->comm, "Poisson's ratio %.6g must lie between -1 and 0.5", (double)material->poisson);
  model->material = *material;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetStrength(DemModel model, const DemStrength *s)
{
  PetscFunctionBegin;
  BaseCheckInput(s->tensile >= 0 && s->shear >= 0 && (s->tensile > 0 || s->shear > 0), model->comm, "A cohesive material needs a positive tensile_strength or shear_strength");
  BaseCheckInput(s->tensile == 0 || s->fracture_energy > 0 || (s->published && s->delta_n > 0), model->comm, "Fracture energy %.6g J/m2 must be positive beside a tensile strength", (double)s->fracture_energy);
  BaseCheckInput(s->shear == 0 || s->shear_energy > 0 || (s->published && s->delta_s > 0), model->comm, "Shear fracture energy %.6g J/m2 must be positive beside a shear strength", (double)s->shear_energy);
  BaseCheckInput(s->softening != DEM_SOFTENING_BILINEAR || (s->knee_stress > 0 && s->knee_stress < 1 && s->knee_opening > 0 && s->knee_opening < 2), model->comm,
                 "Bilinear softening: knee_stress %.6g must lie in (0, 1) and knee_opening %.6g in (0, 2)", (double)s->knee_stress, (double)s->knee_opening);
  BaseCheckInput(s->n_branches == 0 || s->published, model->comm, "Branches of compression belong to law: published");
  for (PetscInt b = 0; b < s->n_branches; b++)
    BaseCheckInput(s->crush[b] > (b ? s->crush[b - 1] : 0) && s->reduce[b] >= 1, model->comm, "Branch %" PetscInt_FMT " of compression: its stress must lie above the one before, and Young's modulus be divided by 1 or more", b + 1);
  BaseCheckInput(s->mu_static >= 0 && s->mu_dynamic >= 0, model->comm, "Friction coefficients cannot be negative");
  model->strength = *s;
  model->cohesive = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetRule(DemModel model, const DemRule *r)
{
  PetscFunctionBegin;
  PetscCheck(!model->ready, model->comm, PETSC_ERR_ORDER, "The rule is fixed at set-up");
  BaseCheckInput(!r->polyhedron || r->elasticity == DEM_KDEM, model->comm, "Areas of virtual polyhedra belong to elasticity: kdem");
  if (r->elasticity == DEM_ONATE2015 || r->elasticity == DEM_GIVEN || r->polyhedron)
    BaseCheckInput(r->range > 0 && r->range < 1, model->comm, "Interaction range %.6g must lie in (0, 1); the papers use 0.1 and 0.15", (double)r->range);
  BaseCheckInput(r->area_factor >= 0, model->comm, "Area factor %.6g cannot be negative", (double)r->area_factor);
  if (r->elasticity == DEM_GIVEN) BaseCheckInput(r->normal_stiffness > 0 && r->shear_stiffness >= 0, model->comm, "elasticity: given needs a positive normal stiffness, and a shear stiffness that is not negative [N/m]");
  else if (r->elasticity != DEM_EXACT) BaseCheckInput(r->normal_factor > 0 && r->shear_factor >= 0, model->comm, "The factors on the stiffnesses, %.6g and %.6g, must be positive", (double)r->normal_factor, (double)r->shear_factor);
  BaseCheckInput(!r->poisson_term || r->elasticity == DEM_KDEM, model->comm, "The Poisson term belongs to elasticity: kdem");
  BaseCheckInput(!r->sphere_pressure || r->elasticity != DEM_EXACT, model->comm, "Pressure on spheres belongs to the published rules; with elasticity: exact it acts on facets");
  model->rule = *r;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetGroups(DemModel model, const PetscInt group[])
{
  PetscFunctionBegin;
  PetscCheck(model->packing.n && !model->ready, model->comm, PETSC_ERR_ORDER, "Groups are given between DemModelSetBody() and DemModelSetUp()");
  PetscCall(PetscFree(model->group));
  PetscCall(PetscMalloc1(model->packing.n, &model->group));
  PetscCall(PetscArraycpy(model->group, group, model->packing.n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetCrackPlane(DemModel model, PetscBool plane)
{
  PetscFunctionBegin;
  PetscCheck(!model->ready, model->comm, PETSC_ERR_ORDER, "Say that the crack is a plane before DemModelSetUp()");
  model->crack_plane = plane;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetWeakness(DemModel model, const PetscReal part[])
{
  PetscFunctionBegin;
  PetscCheck(!model->ready && model->cells.n, model->comm, PETSC_ERR_ORDER, "Say how weak facets are between DemModelSetBody() and DemModelSetUp()");
  PetscCall(PetscFree(model->weak));
  PetscCall(PetscMalloc1(model->cells.n_facets, &model->weak));
  model->weakest = 1;
  for (PetscInt f = 0; f < model->cells.n_facets; f++) {
    PetscCheck(part[f] > 0 && part[f] <= 1, model->comm, PETSC_ERR_ARG_OUTOFRANGE, "Facet %" PetscInt_FMT " has %.6g of the strength; it must lie in (0, 1]", f, (double)part[f]);
    model->weak[f] = part[f];
    model->weakest = PetscMin(model->weakest, part[f]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetBreakable(DemModel model, const PetscBool breakable[])
{
  PetscFunctionBegin;
  PetscCheck(model->packing.n && !model->ready, model->comm, PETSC_ERR_ORDER, "Say which facets may break between DemModelSetBody() and DemModelSetUp()");
  PetscCall(PetscFree(model->breakable));
  PetscCall(PetscMalloc1(model->cells.n_facets, &model->breakable));
  PetscCall(PetscArraycpy(model->breakable, breakable, model->cells.n_facets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CopyReals(PetscInt n, const PetscReal from[], PetscReal **to)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, to));
  PetscCall(PetscArraycpy(*to, from, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CopyInts(PetscInt n, const PetscInt from[], PetscInt **to)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, to));
  PetscCall(PetscArraycpy(*to, from, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CopyCells(const DemCells *cells, DemCells *c)
{
  PetscFunctionBegin;
  *c = (DemCells){.n = cells->n, .n_facets = cells->n_facets, .n_walls = cells->n_walls};
  PetscCall(CopyReals(c->n, cells->volume, &c->volume));
  PetscCall(CopyReals(3 * c->n, cells->centroid, &c->centroid));
  PetscCall(CopyInts(c->n_facets, cells->p, &c->p));
  PetscCall(CopyInts(c->n_facets, cells->q, &c->q));
  PetscCall(CopyReals(c->n_facets, cells->area, &c->area));
  PetscCall(CopyReals(3 * c->n_facets, cells->at, &c->at));
  PetscCall(CopyInts(c->n_walls, cells->wall_p, &c->wall_p));
  PetscCall(CopyInts(c->n_walls, cells->wall_face, &c->wall_face));
  PetscCall(CopyReals(c->n_walls, cells->wall_area, &c->wall_area));
  PetscCall(CopyReals(3 * c->n_walls, cells->wall_at, &c->wall_at));
  PetscCall(CopyReals(3 * c->n_walls, cells->wall_normal, &c->wall_normal));
  if (cells->facet_start) {
    const PetscInt corners = cells->facet_start[c->n_facets];

    PetscCall(CopyInts(c->n_facets + 1, cells->facet_start, &c->facet_start));
    PetscCall(PetscMalloc1(3 * corners, &c->corner));
    PetscCall(PetscArraycpy(c->corner, cells->corner, 3 * corners));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelTakeBody(DemModel model, const DemBody *body, const DemPacking *packing, DemCells *cells)
{
  PetscFunctionBegin;
  PetscCheck(!model->packing.n, model->comm, PETSC_ERR_ORDER, "A DemModel takes one body");
  BaseCheckInput(packing->n > 0, model->comm, "The packing holds no particle");
  PetscCheck(cells || !model->bonded, model->comm, PETSC_ERR_ARG_NULL, "Bonded particles need their cells");
  PetscCheck(!cells || packing->n == cells->n, model->comm, PETSC_ERR_ARG_SIZ, "%" PetscInt_FMT " particles but %" PetscInt_FMT " cells", packing->n, cells->n);
  model->dim  = body->dim;
  model->nrot = body->dim == 3 ? 3 : 1;
  model->n    = model->own = packing->n;

  model->packing.n = packing->n;
  PetscCall(CopyReals(3 * packing->n, packing->x, &model->packing.x));
  PetscCall(CopyReals(packing->n, packing->r, &model->packing.r));
  if (cells) { /* loose grains: no facet, no wall */
    model->cells = *cells;
    PetscCall(PetscMemzero(cells, sizeof(*cells)));
  }

  model->n_faces = model->body.n_faces = body->n_faces;
  model->body.dim       = body->dim;
  model->body.thickness = body->thickness;
  for (PetscInt d = 0; d < 3; d++) {
    model->body.low[d]  = body->low[d];
    model->body.high[d] = body->high[d];
  }
  PetscCall(PetscMalloc1(body->n_faces, &model->body.face_name));
  PetscCall(PetscArraycpy(model->body.face_name, body->face_name, body->n_faces));
  PetscCall(PetscCalloc1(body->n_faces, &model->face));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetBody(DemModel model, const DemBody *body, const DemPacking *packing, const DemCells *cells)
{
  DemCells copy;

  PetscFunctionBegin;
  if (cells) PetscCall(CopyCells(cells, &copy));
  PetscCall(DemModelTakeBody(model, body, packing, cells ? &copy : NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetBonded(DemModel model, PetscBool bonded)
{
  PetscFunctionBegin;
  model->bonded = bonded;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetWeights(DemModel model, const PetscReal mass[], const PetscReal volume[], const PetscReal facet[])
{
  PetscFunctionBegin;
  PetscCheck(model->packing.n && !model->ready && !model->weight_mass, model->comm, PETSC_ERR_ORDER, "Weights are given once, between DemModelSetBody() and DemModelSetUp()");
  PetscCall(CopyReals(model->packing.n, mass, &model->weight_mass));
  PetscCall(CopyReals(model->packing.n, volume, &model->weight_volume));
  PetscCall(CopyReals(model->cells.n_facets, facet, &model->weight_facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FindFace(DemModel model, const char *name, DemFace **face)
{
  PetscInt k;

  PetscFunctionBegin;
  *face = NULL;
  PetscCheck(model->packing.n, model->comm, PETSC_ERR_ORDER, "Call DemModelSetBody() before naming its faces");
  PetscCall(DemBodyFindFace(&model->body, name, &k));
  if (k < 0) {
    const char **names, *near;

    PetscCall(PetscMalloc1(model->n_faces, &names));
    for (PetscInt i = 0; i < model->n_faces; i++) names[i] = model->body.face_name[i];
    near = BaseNearest(name, model->n_faces, names);
    PetscCall(PetscFree(names));
    SETERRQ(model->comm, PETSC_ERR_USER_INPUT, "The particle body has no face '%s'%s%s%s", name, near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
  }
  *face = &model->face[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelFix(DemModel model, const char *face, PetscInt component, DemMotion motion, const Table *table)
{
  DemFace *f;

  PetscFunctionBegin;
  PetscCall(FindFace(model, face, &f));
  BaseCheckInput(component >= 0 && component < model->dim, model->comm, "Face '%s': component %" PetscInt_FMT " does not exist in %" PetscInt_FMT "D", face, component, model->dim);
  BaseCheckInput(!f->fixed[component], model->comm, "Face '%s': the motion along %c is prescribed twice", face, (char)('x' + component));
  f->fixed[component]  = PETSC_TRUE;
  f->motion[component] = motion;
  PetscCall(TableCopy(table, &f->table[component]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelAddTraction(DemModel model, const char *face, const PetscReal direction[3], const Table *table)
{
  DemFace *f;

  PetscFunctionBegin;
  PetscCall(FindFace(model, face, &f));
  BaseCheckInput(!f->loaded, model->comm, "Face '%s' carries a traction already; give one table for all of it", face);
  f->loaded = PETSC_TRUE;
  for (PetscInt d = 0; d < 3; d++) f->direction[d] = direction[d];
  PetscCall(TableCopy(table, &f->traction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelAddPressure(DemModel model, const char *face, const Table *table)
{
  DemFace *f;

  PetscFunctionBegin;
  PetscCall(FindFace(model, face, &f));
  BaseCheckInput(!f->pressed, model->comm, "Face '%s' carries a pressure already", face);
  f->pressed = PETSC_TRUE;
  PetscCall(TableCopy(table, &f->pressure));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelFindFace(DemModel model, const char *name, PetscInt *face)
{
  return DemBodyFindFace(&model->body, name, face);
}

PetscErrorCode DemModelSetRim(DemModel model, const char *face)
{
  DemFace *f;

  PetscFunctionBegin;
  PetscCall(FindFace(model, face, &f));
  f->rim = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetRim(DemModel model, DemRim *rim)
{
  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before borrowing the rim");
  *rim = (DemRim){model->walls.n_rim, model->walls.rim_x, model->walls.rim_u, model->walls.rim_f, model->walls.rim_number};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetGravity(DemModel model, const PetscReal gravity[3])
{
  PetscFunctionBegin;
  for (PetscInt d = 0; d < 3; d++) model->gravity[d] = gravity[d];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetInitialVelocity(DemModel model, const PetscReal velocity[3])
{
  PetscFunctionBegin;
  for (PetscInt d = 0; d < 3; d++) model->initial_velocity[d] = velocity[d];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetStart(DemModel model, const PetscReal u[])
{
  PetscFunctionBegin;
  PetscCheck(!model->ready && !model->begin && model->bonded && model->packing.n > 0, model->comm, PETSC_ERR_ORDER, "A start is given once to a bonded body, before DemModelSetUp()");
  PetscCall(PetscMalloc1(3 * model->packing.n, &model->begin));
  PetscCall(PetscArraycpy(model->begin, u, 3 * model->packing.n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetLocalDamping(DemModel model, PetscReal alpha)
{
  PetscFunctionBegin;
  BaseCheckInput(alpha >= 0 && alpha < 1, model->comm, "Local damping %.6g must lie in [0, 1)", (double)alpha);
  model->alpha = alpha;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelAddHistory(DemModel model, const char *quantity, const char *group)
{
  static const char *const known[] = {"reaction", "displacement", "velocity"};
  static const char *const units[] = {"N", "m", "m/s"};
  PetscInt                 face = -1, tool = -1, components = 0, first = 0;
  const char              *unit = NULL;
  DemHistory              *grown;

  PetscFunctionBegin;
  PetscCall(DemBodyFindFace(&model->body, group, &face));
  if (face < 0) tool = DemToolFind_Internal(model, group);
  if (tool >= 0) {
    components = DemToolQuantity_Internal(model->dim, quantity, &first, &unit);
    BaseCheckInput(components, model->comm, "History quantity '%s' is not known for tools; known: force (or reaction), torque, work, displacement, velocity", quantity);
  } else {
    for (PetscInt k = 0; k < 3; k++)
      if (!strcmp(quantity, known[k])) {
        unit       = units[k];
        components = model->dim;
      }
    BaseCheckInput(components, model->comm, "History quantity '%s' is not known for particles; known: reaction, displacement, velocity", quantity);
  }
  if (face < 0 && tool < 0) {
    DemFace *f;

    PetscCall(FindFace(model, group, &f)); /* fails, and names the nearest */
  }
  PetscCall(PetscMalloc1(model->n_history + components, &grown));
  PetscCall(PetscArraycpy(grown, model->history, model->n_history));
  PetscCall(PetscFree(model->history));
  model->history = grown;
  for (PetscInt c = first; c < first + components; c++) {
    DemHistory *h = &model->history[model->n_history++];
    char        name[300];

    PetscCall(PetscStrncpy(h->quantity, quantity, sizeof(h->quantity)));
    h->face      = face;
    h->tool      = tool;
    h->component = c;
    h->unit      = unit;
    if (tool >= 0 && components == 1 && first == 0) PetscCall(BaseFormat(name, "%s(%s)", quantity, group));
    else PetscCall(BaseFormat(name, "%s(%s).%c", quantity, group, (char)('x' + c)));
    PetscCall(PetscStrallocpy(name, &h->name));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetUp(DemModel model)
{
  const DemMaterial *m = &model->material;

  PetscFunctionBegin;
  PetscCheck(model->packing.n, model->comm, PETSC_ERR_ORDER, "Call DemModelSetBody() before DemModelSetUp()");
  PetscCheck(m->young > 0, model->comm, PETSC_ERR_ORDER, "Call DemModelSetMaterial() before DemModelSetUp()");
  PetscCheck(!model->ready, model->comm, PETSC_ERR_ORDER, "DemModelSetUp() was called twice");
  BaseCheckInput((model->dim == 3) == (model->kind == DEM_SOLID), model->comm, "A %" PetscInt_FMT "D body with the kind of the other dimension", model->dim);
  for (PetscInt k = 0; k < model->n_faces && model->begin; k++)
    for (PetscInt d = 0; d < model->dim; d++)
      BaseCheckInput(!model->face[k].fixed[d], model->comm, "Face '%s' holds particles that begin under in-situ stress, which is not covered; hold the elements, or stress the sides and begin with time: {preload: static}", model->body.face_name[k]);
  BaseCheckInput(model->rain.rate == 0 || model->contacts.on, model->comm, "Grains that rain need to know how they meet; add a contact section");
  model->g_shear = m->young / (2 * (1 + m->poisson));
  model->lambda  = m->young * m->poisson / ((1 + m->poisson) * (1 - 2 * m->poisson));
  if (model->kind == DEM_PLANE_STRESS) model->lambda = 2 * model->g_shear * model->lambda / (model->lambda + 2 * model->g_shear);
  if (model->bonded && model->rule.elasticity != DEM_EXACT) { /* springs have no volumetric part; held facets are springs of modulus E */
    PetscCall(PetscNew(&model->net));
    model->g_shear = 0.5 * m->young;
    model->lambda  = 0;
  }
  PetscCall(DemSetUpOrder_Internal(model));
  PetscCall(DemSetUpClumps_Internal(model));
  PetscCall(DemSetUpBonds_Internal(model));
  if (model->net) PetscCall(DemSetUpRule_Internal(model));
  PetscCall(DemSetUpWalls_Internal(model));
  BaseCheckInput(model->net || !model->cohesive || !model->strength.published, model->comm, "law: published acts on springs; with elasticity: exact write law: cohesive");
  BaseCheckInput(!model->group || model->cohesive, model->comm, "Groups that only touch need a law that can break");
  if (model->cohesive && model->bonds.n) PetscCall(DemSetUpCracks_Internal(model));
  if (model->is_static) {
    PetscMPIInt ranks;

    PetscCallMPI(MPI_Comm_size(model->comm, &ranks));
    BaseCheckInput(ranks == 1, model->comm, "Static load steps of particles run on one rank: use threads");
    BaseCheckInput(model->bonded && !(model->net && model->crack.damage) && !model->contacts.on && !model->n_tools && !model->rule.poisson_term && !model->weight_mass, model->comm,
                   "Static load steps are for bonded particles that are elastic, or break by law: cohesive; without contacts, tools, the Poisson term and a coupling");
    PetscCall(DemStaticCreate_Internal(model));
  }
  if (model->n_tools) PetscCall(DemToolsSetUp_Internal(model));
  model->ready = PETSC_TRUE;
  DemFacesSetTime_Internal(model, 0);
  if (model->contacts.on) PetscCall(DemSetUpContacts_Internal(model));
  PetscCall(DemSpread_Internal(model));
  PetscCall(DemForces_Internal(model, DEM_WITH_LOADS));
  if (model->contacts.on) {
    PetscCall(DemSetUpContactRoom_Internal(model));
    if (model->rain.rate > 0) {
      DemRainSleep_Internal(model);
      PetscCall(DemRainFall_Internal(model));
      PetscCall(DemForces_Internal(model, DEM_WITH_LOADS));
    }
    PetscCall(DemContactsForce_Internal(model, 0));
  }
  PetscCall(DemToolsForce_Internal(model, 0)); /* those that press from the start */
  if (model->rain.rate > 0) DemContactsStill_Internal(model);
  DemClumpsGather_Internal(model);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetCounts(DemModel model, PetscInt *particles, PetscInt *bonds, PetscInt *walls)
{
  const DemRanks r = model->ranks;

  PetscFunctionBegin;
  if (particles) *particles = r ? r->particles : model->n;
  if (bonds) *bonds = r ? r->bonds : model->bonds.n;
  if (walls) *walls = r ? r->cell_walls : model->cells.n_walls;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetShare(DemModel model, DemShare *share)
{
  const DemRanks r = model->ranks;

  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before asking for a rank's share");
  *share = (DemShare){.own = model->own, .ghosts = r ? r->ghosts : 0, .bonds = model->bonds.n, .facets = model->cells.n_facets, .pairs = model->contacts.m, .copies = model->contacts.ghosts};
  for (PetscInt e = 0; e < model->bonds.n; e++) share->counted += DemBondIsMine(model, e);
  for (PetscInt k = 0; k < model->contacts.m; k++) share->between += model->contacts.met[k] && model->contacts.p[k] < model->own && model->contacts.q[k] >= model->own;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelDestroy(DemModel *pmodel)
{
  DemModel model = *pmodel;

  PetscFunctionBegin;
  if (!model) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DemRanksDestroy_Internal(model));
  PetscCall(DemPackingDestroy(&model->packing));
  PetscCall(DemStaticDestroy_Internal(model));
  PetscCall(DemCellsDestroy(&model->cells));
  PetscCall(PetscFree(model->body.face_name));
  PetscCall(PetscFree2(model->rank_of, model->at));
  PetscCall(PetscFree2(model->x0, model->r));
  PetscCall(PetscFree3(model->u, model->v, model->f));
  PetscCall(PetscFree3(model->rot, model->spin, model->torque));
  PetscCall(PetscFree6(model->mass, model->inertia, model->volume, model->vstar, model->sum, model->dilation));
  PetscCall(PetscFree(model->offset));
  PetscCall(PetscFree(model->begin));
  PetscCall(PetscFree(model->share));
  PetscCall(PetscFree2(model->f_ext, model->t_ext));
  PetscCall(PetscFree7(model->bonds.p, model->bonds.q, model->bonds.ip, model->bonds.iq, model->bonds.k, model->bonds.arm, model->bonds.facet));
  PetscCall(PetscFree(model->bonds.weight));
  PetscCall(PetscFree3(model->blocks.first, model->blocks.bond, model->blocks.halo_start));
  PetscCall(PetscFree3(model->blocks.halo, model->blocks.slot_start, model->blocks.slot));
  PetscCall(PetscFree2(model->blocks.slot_s, model->blocks.slot_f));
  PetscCall(PetscFree7(model->walls.start, model->walls.face, model->walls.kind, model->walls.area, model->walls.h, model->walls.arm, model->walls.normal));
  PetscCall(PetscFree(model->walls.owner));
  PetscCall(PetscFree4(model->walls.rim, model->walls.rim_x, model->walls.rim_u, model->walls.rim_f));
  PetscCall(PetscFree(model->walls.rim_number));
  PetscCall(PetscFree(model->weight_mass));
  PetscCall(PetscFree(model->weight_volume));
  PetscCall(PetscFree(model->weight_facet));
  PetscCall(PetscFree(model->traction_old));
  PetscCall(PetscFree(model->traction_new));
  PetscCall(DemCracksDestroy_Internal(model));
  PetscCall(DemContactsDestroy_Internal(model));
  PetscCall(DemRuleDestroy_Internal(model));
  PetscCall(DemClumpsDestroy_Internal(model));
  PetscCall(DemBondListDestroy_Internal(model));
  PetscCall(PetscFree(model->group));
  PetscCall(PetscFree(model->breakable));
  PetscCall(PetscFree(model->weak));
  PetscCall(PetscFree(model->surface));
  PetscCall(PetscFree(model->block_sum));
  for (PetscInt k = 0; k < model->n_faces; k++) {
    for (PetscInt d = 0; d < 3; d++) PetscCall(TableDestroy(&model->face[k].table[d]));
    PetscCall(TableDestroy(&model->face[k].traction));
    PetscCall(TableDestroy(&model->face[k].pressure));
  }
  PetscCall(PetscFree(model->face));
  PetscCall(DemToolsDestroy_Internal(model));
  PetscCall(PetscFree(model->probed));
  if (model->tool_scratch)
    for (PetscInt t = 0; t < model->threads; t++) PetscCall(PetscFree(model->tool_scratch[t]));
  PetscCall(PetscFree(model->tool_scratch));
  PetscCall(PetscFree(model->tool_total));
  for (PetscInt k = 0; k < model->n_history; k++) PetscCall(PetscFree(model->history[k].name));
  PetscCall(PetscFree(model->history));
  PetscCall(PetscFree2(model->history_name, model->history_unit));
  PetscCall(PetscFree(model->scratch));
  PetscCall(PetscFree(model->scratch_room));
  PetscCall(PetscFree(model->lent));
  PetscCall(PetscFree(*pmodel));
  PetscFunctionReturn(PETSC_SUCCESS);
}
