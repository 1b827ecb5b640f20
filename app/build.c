/* build.c - from the scene to the models: geometry, packing, cells, the one model the scene names. */
#include "app.h"
#include <string.h>

PetscErrorCode AppCaseRead(MPI_Comm comm, const AppOptions *options, AppCase *c)
{
  static const char *const times[] = {"explicit", "static", "implicit", "modal"}; /* AppTime */
  const char              *word;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(c, sizeof(*c)));
  c->comm = comm;
  PetscCallMPI(MPI_Comm_rank(comm, &c->rank));
  PetscCallMPI(MPI_Comm_size(comm, &c->size));
  BaseCheckInput(options->n_words == 1, comm, "cleave %s takes one scene, not %d: cleave %s SCENE", options->command, (int)options->n_words, options->command);
  PetscCall(AppClockBegin(&c->clock, "scene"));
  PetscCall(SceneRead(comm, options->word[0], options->n_set, options->set, &c->scene));
  PetscCall(SceneGetInt(c->scene, "dimension", &c->dim));
  c->thickness = 1;
  if (c->dim == 2) {
    PetscCall(SceneGetString(c->scene, "plane", &word));
    c->plane_stress = strcmp(word, "stress") ? PETSC_FALSE : PETSC_TRUE;
    PetscCall(SceneGetReal(c->scene, "thickness", &c->thickness));
  }
  PetscCall(SceneGetString(c->scene, "time.method", &word));
  for (int k = 0; k < 4; k++)
    if (!strcmp(word, times[k])) c->time = (AppTime)k;
  c->is_static = c->time == APP_STATIC ? PETSC_TRUE : PETSC_FALSE;
  if (c->time == APP_EXPLICIT || c->time == APP_IMPLICIT) {
    PetscCall(SceneGetString(c->scene, "time.preload", &word));
    c->preload = strcmp(word, "static") ? PETSC_FALSE : PETSC_TRUE;
  }
  PetscCall(AppClockEnd(&c->clock));
  PetscCall(AppClockBegin(&c->clock, "geometry"));
  PetscCall(AppGeometryRead(c));
  PetscCall(AppGovernRead(c)); /* before the tables */
  PetscCall(AppConditionsRead(c));
  PetscCall(AppClockEnd(&c->clock));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode InitialVelocity(AppCase *c, const AppPart *part, PetscReal velocity[3], char path[256])
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(velocity, 3));
  PetscCall(PetscSNPrintf(path, 256, "bodies.%s.initial_velocity", part->name));
  if (c->time == APP_EXPLICIT || c->time == APP_IMPLICIT) PetscCall(SceneGetVector(c->scene, path, c->dim, velocity));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Linear quadrilaterals and hexahedra as the scene wants them. */
static PetscErrorCode SetElement(AppCase *c)
{
  const char *word;
  char        path[256];

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.mesh.element", c->part[0].name));
  PetscCall(SceneGetString(c->scene, path, &word));
  PetscCall(FemModelSetElement(c->fem, strcmp(word, "full") ? FEM_ENHANCED : FEM_FULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every part's elements turn, or none do. */
static PetscErrorCode Rotation(AppCase *c)
{
  const char *first = NULL, *rotation;
  char        path[256];

  PetscFunctionBegin;
  for (PetscInt p = 0; p < c->n_parts; p++) {
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.mesh.rotation", c->part[p].name));
    PetscCall(SceneGetString(c->scene, path, &rotation));
    if (!first) first = rotation;
    if (strcmp(first, rotation)) PetscCall(SceneFail(c->scene, path, "the bodies of one mesh turn alike: give each the same rotation"));
    if (strcmp(rotation, "small") && c->method == APP_COUPLED) PetscCall(SceneFail(c->scene, path, "the elements of a coupled body are of small rotation, see docs/not-yet.md"));
    if (strcmp(rotation, "small") && c->time != APP_EXPLICIT) PetscCall(SceneFail(c->scene, path, "corotational elements need time.method: explicit; other methods are of small rotation"));
  }
  PetscCall(FemModelSetRotation(c->fem, first && !strcmp(first, "corotational") ? FEM_COROTATIONAL : FEM_SMALL));
  c->corotational = first && !strcmp(first, "corotational") ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BuildFem(AppCase *c, PetscInt threads)
{
  PetscReal velocity[3];
  char      path[256];

  PetscFunctionBegin;
  PetscCall(AppClockBegin(&c->clock, "fem set-up"));
  PetscCall(FemModelCreate(c->comm, &c->fem));
  c->made_fem++;
  PetscCall(FemModelSetKind(c->fem, c->dim == 3 ? FEM_SOLID : c->plane_stress ? FEM_PLANE_STRESS : FEM_PLANE_STRAIN, c->thickness));
  PetscCall(FemModelSetMethod(c->fem, c->is_static ? FEM_STATIC : c->time == APP_IMPLICIT ? FEM_IMPLICIT : c->time == APP_MODAL ? FEM_MODAL : FEM_EXPLICIT));
  PetscCall(FemModelSetPreload(c->fem, c->preload));
  if (c->time == APP_IMPLICIT || c->time == APP_MODAL) {
    PetscReal   rho = -1;
    PetscBool   has = PETSC_FALSE;
    const char *mass;

    if (c->time == APP_IMPLICIT) PetscCall(SceneHas(c->scene, "time.rho_inf", &has));
    if (has) PetscCall(SceneGetReal(c->scene, "time.rho_inf", &rho));
    PetscCall(SceneGetString(c->scene, "time.mass", &mass));
    PetscCall(FemModelSetImplicit(c->fem, rho, strcmp(mass, "lumped") ? PETSC_FALSE : PETSC_TRUE));
  }
  PetscCall(SetElement(c));
  PetscCall(FemModelSetThreads(c->fem, threads));
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.geometry", c->part[0].name));
  AppCallAt(c->scene, path, FemModelSetMesh(c->fem, &c->mesh));
  PetscCall(MeshDestroy(&c->mesh));
  for (PetscInt p = 0; p < (c->method == APP_TOUCH ? 1 : c->n_parts); p++) {
    const AppPart    *part     = &c->part[p];

    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.material", part->name));
    AppCallAt(c->scene, path, FemModelAddMaterial(c->fem, part->group, &part->elastic));
  }
  for (PetscInt p = 0; p < (c->method == APP_TOUCH ? 1 : c->n_parts); p++) PetscCall(AppPrestressApply(c, &c->part[p]));
  PetscCall(InitialVelocity(c, &c->part[0], velocity, path));
  AppCallAt(c->scene, path, FemModelSetInitialVelocity(c->fem, velocity));
  PetscCall(FemModelSetDamping(c->fem, c->part[0].mass_damping));
  PetscCall(FemModelSetStiffnessDamping(c->fem, c->part[0].stiffness_damping));
  PetscCall(FemModelSetLocalDamping(c->fem, c->part[0].local_damping));
  PetscCall(Rotation(c));
  if (c->method == APP_TOUCH) { /* conditions come when both bodies are there */
    PetscCall(AppClockEnd(&c->clock));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AppConditionsApply(c));
  AppCallAt(c->scene, "bodies", FemModelSetUp(c->fem));
  PetscCall(FemModelGetStepper(c->fem, &c->stepper));
  PetscCall(AppClockEnd(&c->clock));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the body's rain: grains a second, and how many until its end; rate 0 without one. */
static PetscErrorCode Rain(AppCase *c, PetscReal *rate, PetscInt *count)
{
  char      path[256];
  PetscReal until;
  PetscBool has;

  PetscFunctionBegin;
  *rate = 0;
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.rain", AppGrains(c)->name));
  PetscCall(SceneHas(c->scene, path, &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.rain.until", AppGrains(c)->name));
  PetscCall(SceneGetReal(c->scene, path, &until));
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.rain.rate", AppGrains(c)->name));
  PetscCall(SceneGetReal(c->scene, path, rate));
  if (*rate * until > 1e8) PetscCall(SceneFail(c->scene, path, "%.6g grains a second for %.6g s are more than 1e8; fewer, or for a shorter time", (double)*rate, (double)until));
  *count = 1 + (PetscInt)PetscFloorReal(*rate * until * (1 - 1e-12)); /* the first at time 0 */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppCasePack(AppCase *c)
{
  const char       *body    = AppGrains(c)->name;
  DemPackingOptions options = {0};
  char              path[256];
  PetscBool         has;
  PetscReal         rain;

  PetscFunctionBegin;
  PetscCall(AppClockBegin(&c->clock, "packing"));
  PetscCall(Rain(c, &rain, &options.count));
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing.file", body));
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    const char *name;
    char        file[PETSC_MAX_PATH_LEN], key[256];
    PetscBool   trim;

    PetscCall(SceneGetString(c->scene, path, &name));
    PetscCall(SceneFilePath(c->scene, name, sizeof(file), file));
    PetscCall(PetscSNPrintf(key, sizeof(key), "bodies.%s.dem.packing.trim", body));
    PetscCall(SceneGetBool(c->scene, key, &trim));
    AppCallAt(c->scene, path, DemPackingRead(file, &c->body, trim, &c->packing));
  } else {
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing.radius", body));
    PetscCall(SceneHas(c->scene, path, &has));
    if (has) PetscCall(SceneGetReal(c->scene, path, &options.radius));
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing.count", body));
    PetscCall(SceneHas(c->scene, path, &has));
    if (has) PetscCall(SceneGetInt(c->scene, path, &options.count));
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing.spread", body));
    PetscCall(SceneGetReal(c->scene, path, &options.spread));
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing.porosity", body));
    PetscCall(SceneHas(c->scene, path, &has));
    if (has) PetscCall(SceneGetReal(c->scene, path, &options.porosity));
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing.seed", body));
    PetscCall(SceneGetInt(c->scene, path, &options.seed));
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing", body));
    if (rain > 0) AppCallAt(c->scene, path, DemPackingCreateRain(&c->body, &options, &c->packing));
    else AppCallAt(c->scene, path, DemPackingCreate(&c->body, &options, &c->packing));
  }
  c->made_packings++;
  PetscCall(AppClockEnd(&c->clock));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The group of each particle: 1 + the first of dem.cohesive_groups that its centre lies in, 0 in none. */
static PetscErrorCode SetJoints(AppCase *c, const char *body)
{
  char       path[256];
  PetscInt  *group;
  PetscBool *inside;

  PetscFunctionBegin;
  if (!c->n_joints) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.cohesive_groups", body));
  if (!c->part[0].cohesive) PetscCall(SceneFail(c->scene, path, "groups that do not bond push and rub, which law: cohesive or published describes; add one to the material"));
  PetscCall(PetscCalloc1(c->packing.n, &group));
  PetscCall(PetscMalloc1(c->packing.n, &inside));
  for (PetscInt k = c->n_joints - 1; k >= 0; k--) {
    PetscCall(DemBodyInside(&c->joint[k], c->packing.n, c->packing.x, inside));
    for (PetscInt p = 0; p < c->packing.n; p++)
      if (inside[p]) group[p] = k + 1;
    PetscCall(DemBodyDestroy(&c->joint[k]));
  }
  AppCallAt(c->scene, path, DemModelSetGroups(c->dem, group));
  PetscCall(PetscFree(group));
  PetscCall(PetscFree(inside));
  PetscCall(PetscFree(c->joint));
  c->n_joints = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What particles do on one rank alone, told before the packing is made. */
static PetscErrorCode CheckRanks(AppCase *c)
{
  char      path[256];
  PetscBool has;

  PetscFunctionBegin;
  if (c->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.clump", AppGrains(c)->name));
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) PetscCall(SceneFail(c->scene, path, "clump: particles of this kind run on one rank for now, not %d; give them threads instead: cleave run SCENE --threads N", (int)c->size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BuildDem(AppCase *c, PetscInt threads)
{
  const AppPart    *part     = AppGrains(c);
  const DemMaterial material = {part->density, part->young, part->poisson};
  PetscReal         velocity[3], rain;
  PetscBool         bonded;
  PetscInt          count;
  char              path[256];

  PetscFunctionBegin;
  PetscCall(CheckRanks(c));
  PetscCall(AppGrainsPack(c));
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.bonded", part->name));
  PetscCall(SceneGetBool(c->scene, path, &bonded));
  if (bonded) { /* loose grains are their spheres */
    PetscCall(AppClockBegin(&c->clock, "cells"));
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing", part->name));
    AppCallAt(c->scene, path, DemCellsCreate(&c->body, &c->packing, &c->cells));
    if (!part->cohesive) PetscCall(DemCellsDropCorners(&c->cells));
    c->made_cells++;
    PetscCall(AppClockEnd(&c->clock));
  }
  PetscCall(AppClockBegin(&c->clock, "dem set-up"));
  PetscCall(DemModelCreate(c->comm, &c->dem));
  c->made_dem++;
  PetscCall(DemModelSetKind(c->dem, c->dim == 3 ? DEM_SOLID : c->plane_stress ? DEM_PLANE_STRESS : DEM_PLANE_STRAIN));
  PetscCall(DemModelSetThreads(c->dem, threads));
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.material", part->name));
  AppCallAt(c->scene, path, DemModelSetMaterial(c->dem, &material));
  AppCallAt(c->scene, path, DemModelSetRule(c->dem, &part->rule));
  if (part->cohesive) AppCallAt(c->scene, path, DemModelSetStrength(c->dem, &part->strength));
  PetscCall(DemModelSetStatic(c->dem, c->is_static));
  PetscCall(DemModelSetLocalDamping(c->dem, part->local_damping));
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing", part->name));
  PetscCall(DemModelSetBonded(c->dem, bonded));
  AppCallAt(c->scene, path, DemModelTakeBody(c->dem, &c->body, &c->packing, bonded ? &c->cells : NULL));
  PetscCall(SetJoints(c, part->name));
  PetscCall(DemPackingDestroy(&c->packing));
  PetscCall(Rain(c, &rain, &count));
  if (rain > 0) {
    PetscInt seed;

    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing.seed", part->name));
    PetscCall(SceneGetInt(c->scene, path, &seed));
    AppCallAt(c->scene, "contact", DemModelSetRain(c->dem, rain, seed));
  }
  PetscCall(InitialVelocity(c, part, velocity, path));
  PetscCall(DemModelSetInitialVelocity(c->dem, velocity));
  PetscCall(AppGrainsApply(c));
  if (c->method == APP_TOUCH) {
    PetscCall(AppClockEnd(&c->clock));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AppConditionsApply(c));
  PetscCall(AppContactApply(c));
  if (!c->is_static) {
    PetscCall(SceneGetInt(c->scene, "time.rebalance", &count));
    PetscCall(DemModelSetRebalance(c->dem, count));
  }
  AppCallAt(c->scene, "conditions", DemModelSetUp(c->dem));
  PetscCall(DemModelGetStepper(c->dem, &c->stepper));
  PetscCall(AppClockEnd(&c->clock));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A body of elements, one of particles, and the contacts between them. */
static PetscErrorCode BuildTouch(AppCase *c, PetscInt threads)
{
  const AppPart         *body = &c->part[0], *grains = AppGrains(c);
  CouplingContactOptions options = {.particle = {grains->young, grains->poisson}, .body = {body->young, body->poisson}, .thickness = c->thickness};
  char                   path[256];

  PetscFunctionBegin;
  PetscCall(BuildFem(c, threads));
  PetscCall(BuildDem(c, threads));
  PetscCall(AppConditionsApply(c));
  PetscCall(AppContactApply(c));
  AppCallAt(c->scene, "bodies", FemModelSetUp(c->fem));
  AppCallAt(c->scene, "conditions", DemModelSetUp(c->dem));
  PetscCall(AppClockBegin(&c->clock, "contact set-up"));
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.surface", body->name));
  PetscCall(AppContactRead(c, path, &options.choice));
  PetscCall(CouplingContactSetSides(c->contact, c->fem, c->dem));
  AppCallAt(c->scene, path, CouplingContactSetUp(c->contact, &options));
  PetscCall(CouplingContactGetStepper(c->contact, &c->stepper));
  PetscCall(AppClockEnd(&c->clock));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RefusePrestress(AppCase *c)
{
  static const char *const key[] = {"initial_stress.surface", "temperature"};
  char                     path[256];
  PetscBool                has, tools;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 2; k++) {
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.%s", c->part[0].name, key[k]));
    PetscCall(SceneHas(c->scene, path, &has));
    if (has) PetscCall(SceneFail(c->scene, path, "%s in a coupled body is not covered, see docs/not-yet.md%s", key[k], k ? "" : "; give the components (xx, yy, ...), or add gravity, stress the sides, and begin with time: {preload: static}"));
  }
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.initial_stress", c->part[0].name));
  PetscCall(SceneHas(c->scene, path, &has));
  PetscCall(SceneHas(c->scene, "tools", &tools));
  if (has && tools) PetscCall(SceneFail(c->scene, "tools", "tools and initial_stress of a coupled body do not go together: particles stand off by the stress's strain; stress the sides and begin with time: {preload: static}"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static FemKind CoupledKind(const AppCase *c)
{
  return c->dim == 3 ? FEM_SOLID : c->plane_stress ? FEM_PLANE_STRESS : FEM_PLANE_STRAIN;
}

/* Both sides of a split, not yet set up; c->fem and c->dem are theirs when it returns. */
static PetscErrorCode MakeSides(void *ctx, const CouplingSplit *split, const DemBody *body, const DemPacking *packing, const DemCells *cells, FemModel *fem, DemModel *dem)
{
  AppCase          *c        = ctx;
  const AppPart    *part     = &c->part[0];
  const FemMaterial elements = {part->density, part->young, part->poisson};
  const DemMaterial grains   = {part->density, part->young, part->poisson};
  PetscReal         velocity[3];
  char              path[256];

  const MPI_Comm    alone    = c->size > 1 ? PETSC_COMM_SELF : c->comm; /* every rank has all elements, and the particles for itself, too */
  FemModel          had      = c->fem;

  PetscFunctionBegin;
  PetscCall(InitialVelocity(c, part, velocity, path));
  PetscCall(FemModelCreate(alone, &c->fem));
  c->made_fem += fem ? 1 : 0;
  PetscCall(FemModelSetKind(c->fem, CoupledKind(c), c->thickness));
  PetscCall(FemModelSetMethod(c->fem, FEM_EXPLICIT));
  PetscCall(FemModelSetStartGiven(c->fem, (PetscBool)(c->preload || c->is_static)));
  PetscCall(Rotation(c));
  PetscCall(SetElement(c));
  PetscCall(FemModelSetThreads(c->fem, c->threads));
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.geometry", part->name));
  AppCallAt(c->scene, path, FemModelSetMesh(c->fem, &split->fem));
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.material", part->name));
  AppCallAt(c->scene, path, FemModelAddMaterial(c->fem, "", &elements));
  PetscCall(AppPrestressApply(c, part));
  PetscCall(FemModelSetInitialVelocity(c->fem, velocity));
  PetscCall(FemModelSetLocalDamping(c->fem, part->local_damping));
  PetscCall(FemModelSetDamping(c->fem, part->mass_damping));
  PetscCall(DemModelCreate(fem ? alone : c->comm, &c->dem));
  c->made_dem++;
  PetscCall(DemModelSetKind(c->dem, c->dim == 3 ? DEM_SOLID : c->plane_stress ? DEM_PLANE_STRESS : DEM_PLANE_STRAIN));
  PetscCall(DemModelSetThreads(c->dem, c->threads));
  AppCallAt(c->scene, path, DemModelSetMaterial(c->dem, &grains));
  if (part->cohesive) AppCallAt(c->scene, path, DemModelSetStrength(c->dem, &part->strength));
  PetscCall(DemModelSetLocalDamping(c->dem, part->local_damping));
  PetscCall(DemModelSetInitialVelocity(c->dem, velocity));
  AppCallAt(c->scene, path, DemModelSetBody(c->dem, body, packing, cells));
  PetscCall(AppConditionsApply(c));
  PetscCall(AppContactApply(c));
  if (fem) *fem = c->fem;
  else { /* the particles alone were asked for, shared out among the ranks */
    PetscCall(FemModelDestroy(&c->fem));
    c->fem = had;
  }
  *dem = c->dem;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppSidesNow(AppCase *c)
{
  PetscFunctionBegin;
  if (c->turning && c->stepper.ctx) PetscCall(CouplingSwitchGetSides(c->turning, &c->coupling, &c->fem, &c->dem, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both sides of one body and their overlap. */
static PetscErrorCode BuildCoupled(AppCase *c, PetscInt threads)
{
  const AppPart    *part     = &c->part[0];
  const FemMaterial elements = {part->density, part->young, part->poisson};
  CouplingOptions   options  = {.affine = PETSC_TRUE};
  const char       *word, *far, *way;
  PetscBool         has;
  char              path[256];

  PetscFunctionBegin;
  PetscCall(RefusePrestress(c));
  c->threads = threads;
  if (!c->turning) PetscCall(MeshDestroy(&c->mesh));
  PetscCall(AppCasePack(c));
  PetscCall(AppClockBegin(&c->clock, "cells"));
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing", part->name));
  AppCallAt(c->scene, path, DemCellsCreate(&c->body, &c->packing, &c->cells));
  c->made_cells++;
  PetscCall(AppClockEnd(&c->clock));

  PetscCall(AppClockBegin(&c->clock, "coupled set-up"));
  PetscCall(SceneGetReal(c->scene, "coupling.floor", &options.floor));
  PetscCall(SceneGetString(c->scene, "coupling.weights", &word));
  PetscCall(SceneGetInt(c->scene, "coupling.substeps", &options.substeps)); /* auto: 0 */
  PetscCall(SceneGetString(c->scene, "coupling.far_field", &far));
  options.far    = !strcmp(far, "implicit") ? COUPLING_FAR_IMPLICIT : !strcmp(far, "auto") ? COUPLING_FAR_AUTO : !strcmp(far, "static") ? COUPLING_FAR_STATIC : COUPLING_FAR_EXPLICIT;
  if (options.far == COUPLING_FAR_STATIC) {
    PetscCall(SceneGetReal(c->scene, "coupling.tolerance", &options.tolerance));
    PetscCall(SceneGetString(c->scene, "coupling.condense", &far));
    options.condense = !strcmp(far, "always") ? FEM_CONDENSE_ALWAYS : !strcmp(far, "never") ? FEM_CONDENSE_NEVER : FEM_CONDENSE_AUTO;
  }
  PetscCall(SceneGetString(c->scene, "coupling.method", &way));
  options.method = !strcmp(way, "consistent") ? COUPLING_CONSISTENT : !strcmp(way, "penalty") ? COUPLING_PENALTY : COUPLING_ENERGY;
  PetscCall(SceneGetReal(c->scene, "coupling.penalty", &options.penalty));
  PetscCall(SceneGetBool(c->scene, "coupling.absorber", &options.absorber));
  for (PetscInt k = 0; k < (c->dim == 3 ? 6 : 4); k++) {
    static const char *const component[] = {"xx", "yy", "zz", "xy", "yz", "zx"};

    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.initial_stress", part->name));
    PetscCall(SceneHas(c->scene, path, &has));
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.initial_stress.%s", part->name, component[k]));
    if (has) PetscCall(SceneGetReal(c->scene, path, &options.stress[k]));
  }
  options.preload = c->preload;
  options.smooth = strcmp(word, "smoothstep") ? PETSC_FALSE : PETSC_TRUE;
  c->made_couplings++;
  if (c->turning) { /* packing and cells stay: sleeping particles are theirs */
    AppCallAt(c->scene, "coupling.switch", CouplingSwitchSetBody(c->turning, &c->body, &c->packing, &c->cells, &elements, &part->strength, CoupledKind(c), c->thickness));
    AppCallAt(c->scene, "coupling", CouplingSwitchSetUp(c->turning, &options, MakeSides, c));
    PetscCall(CouplingSwitchGetStepper(c->turning, &c->stepper));
    PetscCall(AppSidesNow(c));
  } else {
    DemModel dem;

    PetscCall(MakeSides(c, &c->split, &c->body, &c->packing, &c->cells, &c->fem, &dem));
    PetscCall(CouplingModelCreate(c->comm, &c->coupling));
    if (c->size > 1) {
      PetscCall(MakeSides(c, &c->split, &c->body, &c->packing, &c->cells, NULL, &c->dem));
      PetscCall(CouplingModelSetPart(c->coupling, c->dem));
    }
    AppCallAt(c->scene, "coupling", CouplingModelSetSplit(c->coupling, &c->split, &options));
    AppCallAt(c->scene, "coupling", CouplingModelSetSides(c->coupling, c->fem, dem, &c->packing, &c->cells, &elements, CoupledKind(c), c->thickness));
    AppCallAt(c->scene, "bodies", CouplingModelSetUp(c->coupling));
    PetscCall(DemCellsDestroy(&c->cells));
    PetscCall(DemPackingDestroy(&c->packing));
    PetscCall(CouplingModelGetStepper(c->coupling, &c->stepper));
  }
  PetscCall(AppClockEnd(&c->clock));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppCaseBuild(AppCase *c, PetscInt threads)
{
  PetscFunctionBegin;
  if (c->method == APP_COUPLED) PetscCall(BuildCoupled(c, threads));
  else if (c->method == APP_TOUCH) PetscCall(BuildTouch(c, threads));
  else if (c->method == APP_FEM) PetscCall(BuildFem(c, threads));
  else PetscCall(BuildDem(c, threads));
  PetscCall(AppReadingsBegin(c));
  PetscCall(AppGovernBegin(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppCaseDestroy(AppCase *c)
{
  PetscFunctionBegin;
  PetscCall(RunGovernDestroy(&c->govern));
  PetscCall(AppReadingsDestroy(c));
  if (c->turning) { /* the sides are its own */
    PetscCall(CouplingSwitchDestroy(&c->turning));
    c->coupling = NULL;
    c->fem      = NULL;
    c->dem      = NULL;
  }
  PetscCall(AppToolsDestroy(c));
  if (c->contact) PetscCall(CouplingContactDestroy(&c->contact));
  PetscCall(AppGrainsDestroy(c));
  if (c->coupling) PetscCall(CouplingModelDestroy(&c->coupling));
  if (c->fem) PetscCall(FemModelDestroy(&c->fem));
  if (c->dem) PetscCall(DemModelDestroy(&c->dem));
  PetscCall(DemCellsDestroy(&c->cells));
  PetscCall(DemPackingDestroy(&c->packing));
  PetscCall(DemBodyDestroy(&c->body));
  if (c->split.dim) PetscCall(CouplingSplitDestroy(&c->split));
  PetscCall(MeshDestroy(&c->mesh));
  for (PetscInt k = 0; k < c->n_joints; k++) PetscCall(DemBodyDestroy(&c->joint[k]));
  PetscCall(PetscFree(c->joint));
  for (PetscInt k = 0; k < c->n_loads; k++) {
    PetscCall(TableDestroy(&c->load[k].table));
    for (PetscInt d = 0; d < 3; d++) PetscCall(TableDestroy(&c->load[k].motion[d]));
  }
  PetscCall(PetscFree(c->frequency));
  PetscCall(PetscFree(c->load));
  PetscCall(PetscFree(c->quantity));
  PetscCall(PetscFree(c->group));
  if (c->scene) PetscCall(SceneDestroy(&c->scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
