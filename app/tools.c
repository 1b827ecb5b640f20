/* tools.c - the scene's `tools` to the particle model. */
#include "app.h"
#include <string.h>

static void Path(char path[256], const char *at, const char *key)
{
  (void)PetscSNPrintf(path, 256, "%s.%s", at, key);
}

/* SceneGet... of a key below `at`, when the user wrote it; *has may be NULL. */
static PetscErrorCode Vector(AppCase *c, const char *at, const char *key, PetscReal value[3], PetscBool *has)
{
  char      path[256];
  PetscBool wrote;

  PetscFunctionBegin;
  Path(path, at, key);
  PetscCall(SceneHas(c->scene, path, &wrote));
  if (wrote) PetscCall(SceneGetVector(c->scene, path, c->dim, value));
  if (has) *has = wrote;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Real(AppCase *c, const char *at, const char *key, PetscReal *value)
{
  char      path[256];
  PetscBool wrote;

  PetscFunctionBegin;
  Path(path, at, key);
  PetscCall(SceneHas(c->scene, path, &wrote));
  if (wrote) PetscCall(SceneGetReal(c->scene, path, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TableOf(AppCase *c, const char *at, const char *key, Table *table)
{
  char      path[256];
  PetscBool wrote;

  PetscFunctionBegin;
  Path(path, at, key);
  PetscCall(SceneHas(c->scene, path, &wrote));
  if (wrote) PetscCall(AppTable(c, path, table));
  if (table->n == 1 && table->v[0] == 0) PetscCall(TableDestroy(table)); /* as if it were not there */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Has(AppCase *c, const char *at, const char *key, PetscBool *has)
{
  char path[256];

  PetscFunctionBegin;
  Path(path, at, key);
  PetscCall(SceneHas(c->scene, path, has));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Inside(AppCase *c, const char *at, const char *key, PetscBool *inside)
{
  const char *word;
  char        path[256];

  PetscFunctionBegin;
  Path(path, at, key);
  PetscCall(SceneGetString(c->scene, path, &word));
  *inside = strcmp(word, "inside") ? PETSC_FALSE : PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadSurface(AppCase *c, const char *at, DemSurface *surface)
{
  const char *name, *group = "";
  char        path[256], file[PETSC_MAX_PATH_LEN];
  PetscReal   unit, size = 0;
  PetscBool   has;

  PetscFunctionBegin;
  Path(path, at, "surface.length_unit");
  PetscCall(SceneGetReal(c->scene, path, &unit));
  PetscCall(Real(c, at, "surface.size", &size));
  Path(path, at, "surface.group");
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) PetscCall(SceneGetString(c->scene, path, &group));
  Path(path, at, "surface.file");
  PetscCall(SceneGetString(c->scene, path, &name));
  PetscCall(SceneFilePath(c->scene, name, sizeof(file), file));
  AppCallAt(c->scene, path, DemSurfaceRead(c->comm, file, c->dim, group, unit, size, surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A surface of a file, read once however often the models are made anew. */
static PetscErrorCode SurfaceAgain(AppCase *c, PetscInt k, const char *at, DemSurface *surface)
{
  DemSurface *kept;
  PetscReal  *corner;

  PetscFunctionBegin;
  if (!c->turning) {
    PetscCall(ReadSurface(c, at, surface));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!c->tool_surface) PetscCall(PetscCalloc1(c->n_tools, &c->tool_surface));
  kept = &c->tool_surface[k];
  if (!kept->n) PetscCall(ReadSurface(c, at, kept));
  PetscCall(PetscMalloc1(3 * kept->dim * kept->n, &corner));
  for (PetscInt i = 0; i < kept->dim * kept->n; i++)
    for (PetscInt d = 0; d < 3; d++) corner[3 * i + d] = kept->x[3 * kept->corner[i] + d];
  AppCallAt(c->scene, at, DemSurfaceCreate(at, kept->dim, kept->n, corner, surface));
  PetscCall(PetscFree(corner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppToolsDestroy(AppCase *c)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; c->tool_surface && k < c->n_tools; k++) PetscCall(DemSurfaceDestroy(&c->tool_surface[k]));
  PetscCall(PetscFree(c->tool_surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadShape(AppCase *c, PetscInt k, const char *at, DemToolOptions *o)
{
  PetscBool plane, surface, box, cylinder, disc;
  char      path[256];

  PetscFunctionBegin;
  PetscCall(Has(c, at, "plane", &plane));
  PetscCall(Has(c, at, "surface", &surface));
  PetscCall(Has(c, at, "box", &box));
  PetscCall(Has(c, at, "cylinder", &cylinder));
  PetscCall(Has(c, at, "disc", &disc));
  if (plane) {
    PetscCall(Vector(c, at, "plane.point", o->point, NULL));
    PetscCall(Vector(c, at, "plane.normal", o->axis, NULL));
  } else if (surface) {
    o->shape = DEM_TOOL_SURFACE;
    PetscCall(SurfaceAgain(c, k, at, &o->surface));
  } else if (box) {
    PetscReal low[3] = {0}, high[3] = {0};

    o->shape = DEM_TOOL_SURFACE;
    PetscCall(Vector(c, at, "box.low", low, NULL));
    PetscCall(Vector(c, at, "box.size", high, NULL));
    for (PetscInt d = 0; d < 3; d++) high[d] += low[d];
    Path(path, at, "box");
    AppCallAt(c->scene, path, DemSurfaceCreateBox(c->dim, low, high, &o->surface));
  } else if (cylinder) {
    o->shape = DEM_TOOL_CYLINDER;
    PetscCall(Vector(c, at, "cylinder.centre", o->point, NULL));
    PetscCall(Vector(c, at, "cylinder.axis", o->axis, NULL));
    PetscCall(Real(c, at, "cylinder.radius", &o->radius));
    PetscCall(Real(c, at, "cylinder.length", &o->length));
    PetscCall(Inside(c, at, "cylinder.side", &o->inside));
  } else if (disc) {
    o->shape = c->dim == 3 ? DEM_TOOL_DISC : DEM_TOOL_CYLINDER;
    PetscCall(Vector(c, at, "disc.centre", o->point, NULL));
    PetscCall(Real(c, at, "disc.radius", &o->radius));
    if (c->dim == 3) PetscCall(Vector(c, at, "disc.normal", o->axis, NULL));
    else PetscCall(Inside(c, at, "disc.side", &o->inside));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadMotion(AppCase *c, const char *at, DemToolOptions *o)
{
  PetscBool free;

  PetscFunctionBegin;
  PetscCall(Vector(c, at, "centre", o->centre, &o->has_centre));
  PetscCall(TableOf(c, at, "velocity.x", &o->velocity[0]));
  PetscCall(TableOf(c, at, "velocity.y", &o->velocity[1]));
  PetscCall(TableOf(c, at, "velocity.z", &o->velocity[2]));
  if (c->dim == 3) PetscCall(Vector(c, at, "rotation.axis", o->turn_axis, NULL));
  PetscCall(TableOf(c, at, "rotation.speed", &o->speed));
  PetscCall(Has(c, at, "push", &o->pushed));
  if (o->pushed) {
    PetscCall(Vector(c, at, "push.axis", o->push_axis, NULL));
    PetscCall(TableOf(c, at, "push.force", &o->force));
    PetscCall(Real(c, at, "push.mass", &o->mass));
  }
  PetscCall(Has(c, at, "twist", &o->twisted));
  if (o->twisted) {
    if (c->dim == 3) PetscCall(Vector(c, at, "twist.axis", o->turn_axis, NULL));
    PetscCall(TableOf(c, at, "twist.torque", &o->torque));
    PetscCall(Real(c, at, "twist.inertia", &o->inertia));
  }
  PetscCall(Has(c, at, "free", &free));
  if (free) {
    o->motion = DEM_TOOL_FREE;
    PetscCall(Real(c, at, "free.density", &o->density));
    PetscCall(Real(c, at, "free.mass", &o->mass));
    PetscCall(Vector(c, at, "free.velocity", o->start_velocity, NULL));
    if (c->dim == 3) {
      PetscCall(Vector(c, at, "free.inertia", o->moments, NULL));
      PetscCall(Vector(c, at, "free.spin", o->start_spin, NULL));
    } else {
      PetscCall(Real(c, at, "free.inertia_z", &o->moments[2]));
      PetscCall(Real(c, at, "free.spin_z", &o->start_spin[2]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppContactRead(AppCase *c, const char *at, DemContactChoice *choice)
{
  const char *word;
  char        path[256];

  PetscFunctionBegin;
  Path(path, at, "law");
  PetscCall(SceneGetString(c->scene, path, &word));
  choice->law         = strcmp(word, "hertz") ? DEM_CONTACT_LINEAR : DEM_CONTACT_HERTZ;
  choice->restitution = 1;
  PetscCall(Real(c, at, "stiffness", &choice->stiffness));
  PetscCall(Real(c, at, "tangential", &choice->ratio));
  PetscCall(Real(c, at, "restitution", &choice->restitution));
  PetscCall(Real(c, at, "friction", &choice->friction));
  PetscCall(Real(c, at, "static_friction", &choice->friction_static));
  PetscCall(Real(c, at, "rolling_friction", &choice->rolling));
  PetscCall(Real(c, at, "torsional_friction", &choice->twisting));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppToolsApply(AppCase *c)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < c->n_tools; k++) {
    DemToolOptions o = {.shape = DEM_TOOL_PLANE};
    const char    *name;
    char           at[160];

    PetscCall(SceneGetEntry(c->scene, "tools", k, &name));
    PetscCall(PetscSNPrintf(at, sizeof(at), "tools.%s", name));
    PetscCall(ReadShape(c, k, at, &o));
    PetscCall(ReadMotion(c, at, &o));
    PetscCall(AppContactRead(c, at, &o.contact));
    PetscCall(Real(c, at, "damping", &o.damping));
    AppCallAt(c->scene, at, DemModelAddTool(c->dem, name, &o));
    for (PetscInt d = 0; d < 3; d++) PetscCall(TableDestroy(&o.velocity[d]));
    PetscCall(TableDestroy(&o.speed));
    PetscCall(TableDestroy(&o.force));
    PetscCall(TableDestroy(&o.torque));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
