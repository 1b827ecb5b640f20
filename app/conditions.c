/*
  conditions.c - what the scene's conditions and history quantities ask for, as a plain list.

  Read and checked against the groups before any model exists; applied once the model does.
*/
#include "app.h"
#include <ctype.h>
#include <string.h>

#define Path(buffer, ...) PetscCall(PetscSNPrintf(buffer, sizeof(buffer), __VA_ARGS__))

/* body NULL: of any */
static const AppGroup *FindGroup(const AppCase *c, const char *name, const char *body)
{
  for (PetscInt g = 0; g < c->n_groups; g++)
    if (!strcmp(c->group[g].name, name) && (!body || c->method != APP_TOUCH || !strcmp(c->part[c->group[g].particles ? 1 : 0].name, body))) return &c->group[g];
  return NULL;
}

/* Where two bodies touch both may have a group of this name. */
static PetscErrorCode CheckOne(AppCase *c, const char *path, const AppGroup *group, const char *cure)
{
  PetscFunctionBegin;
  for (const AppGroup *g = group + 1; g < c->group + c->n_groups; g++)
    if (!strcmp(g->name, group->name)) PetscCall(SceneFail(c->scene, path, "group '%s' is in both bodies, '%s' and '%s'; %s", group->name, c->part[0].name, c->part[1].name, cure));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Says which groups there are, nearest first when one is near. */
static PetscErrorCode FailNoGroup(AppCase *c, const char *path, const char *name)
{
  const char *names[256] = {NULL}, *near;
  char        known[1024] = "";
  PetscInt    n = PetscMin(c->n_groups, 256);

  PetscFunctionBegin;
  for (PetscInt g = 0; g < n; g++) {
    names[g] = c->group[g].name;
    PetscCall(PetscStrlcat(known, g ? ", " : "", sizeof(known)));
    PetscCall(PetscStrlcat(known, names[g], sizeof(known)));
  }
  near = BaseNearest(name, n, names);
  if (near) PetscCall(SceneFail(c->scene, path, "no group '%s' in any body; did you mean '%s'?", name, near));
  PetscCall(SceneFail(c->scene, path, "no group '%s' in any body; there is %s", name, n ? known : "none"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddLoad(AppCase *c, AppLoadKind kind, const char *path, const char *group, AppLoad **load)
{
  AppLoad *l;

  PetscFunctionBegin;
  PetscCall(PetscRealloc((size_t)(c->n_loads + 1) * sizeof(*c->load), &c->load));
  l = &c->load[c->n_loads++];
  PetscCall(PetscMemzero(l, sizeof(*l)));
  l->kind = kind;
  PetscCall(PetscStrncpy(l->path, path, sizeof(l->path)));
  PetscCall(PetscStrncpy(l->group, group, sizeof(l->group)));
  *load = l;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddFix(AppCase *c, const char *path, const char *group, PetscInt component, PetscBool velocity, const Table *table)
{
  AppLoad *load = NULL;

  PetscFunctionBegin;
  if (!c->is_static && !c->preload && !velocity && TableValue(table, 0) != 0)
    PetscCall(SceneFail(c->scene, path, "'%s' stands %g m away from its place at t = 0; a dynamic run starts at displacement 0: use a table or a ramp, or begin with time.preload: static", group, (double)TableValue(table, 0)));
  PetscCall(AddLoad(c, APP_FIX, path, group, &load));
  load->component = component;
  load->velocity  = velocity;
  PetscCall(TableCopy(table, &load->table));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadFix(AppCase *c, const char *at, const char *group)
{
  char        path[256];
  PetscBool   has;
  PetscInt    n;
  Table       zero = {0};

  PetscFunctionBegin;
  Path(path, "%s.fix", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TableCreateConstant(0, &zero));
  PetscCall(SceneGetSize(c->scene, path, &n)); /* a single word is a list of one */
  for (PetscInt k = 0; k < n; k++) {
    const char *word;

    PetscCall(SceneGetEntry(c->scene, path, k, &word));
    if (!strcmp(word, "all"))
      for (PetscInt d = 0; d < c->dim; d++) PetscCall(AddFix(c, path, group, d, PETSC_FALSE, &zero));
    else PetscCall(AddFix(c, path, group, word[0] - 'x', PETSC_FALSE, &zero));
  }
  PetscCall(TableDestroy(&zero));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* velocity, displacement, traction, force and line_load: a table per direction. */
static PetscErrorCode ReadDirections(AppCase *c, const char *at, const char *key, const AppGroup *group)
{
  PetscFunctionBegin;
  for (PetscInt d = 0; d < 3; d++) {
    char      path[256];
    PetscBool has;
    Table     table = {0};

    Path(path, "%s.%s.%c", at, key, (char)('x' + d));
    PetscCall(SceneHas(c->scene, path, &has));
    if (!has) continue;
    PetscCall(AppTable(c, path, &table));
    if (!strcmp(key, "traction") || !strcmp(key, "force") || !strcmp(key, "line_load")) {
      AppLoad *load;

      PetscCall(AddLoad(c, key[0] == 't' ? APP_TRACTION : key[0] == 'f' ? APP_FORCE : APP_LINE_LOAD, path, group->name, &load));
      load->component = d;
      PetscCall(TableCopy(&table, &load->table));
    } else PetscCall(AddFix(c, path, group->name, d, !strcmp(key, "velocity") ? PETSC_TRUE : PETSC_FALSE, &table));
    PetscCall(TableDestroy(&table));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A force per area needs an area. */
static PetscErrorCode CheckFacets(AppCase *c, const char *path, const AppGroup *group)
{
  static const char *const word[] = {"points", "lines", "surfaces", "volumes"};

  PetscFunctionBegin;
  if (group->dim != c->dim - 1)
    PetscCall(SceneFail(c->scene, path, "a force per area acts on %s, and '%s' is a group of %s", word[c->dim - 1], group->name, word[group->dim]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tractions of particles come as one direction and one table: components must share their course in time. */
static PetscErrorCode CheckDemTraction(AppCase *c)
{
  PetscFunctionBegin;
  for (PetscInt a = 0; a < c->n_loads; a++)
    for (PetscInt b = 0; b < a; b++) {
      const AppLoad *l = &c->load[a], *m = &c->load[b];

      if (l->kind == APP_TRACTION && m->kind == APP_TRACTION && l->particles == m->particles && (c->method == APP_DEM || l->particles) && !strcmp(l->group, m->group))
        PetscCall(SceneFail(c->scene, l->path, "'%s' carries a traction already; a face of particles takes one direction: x, y or z", l->group));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Is the face flat, its normal along the axis? */
static PetscBool FlatAcross(const DemBody *body, PetscInt face, PetscInt axis)
{
  for (PetscInt k = 0; k < body->start[body->n_pieces]; k++)
    if (body->face[k] == face && PetscAbsReal(PetscAbsReal(body->plane[4 * k + axis]) - 1) > 1e-9) return PETSC_FALSE;
  return PETSC_TRUE;
}

/* On finite elements a plane in any direction; a face of particles is a smooth platen across an axis. */
static PetscErrorCode ReadSymmetry(AppCase *c, const char *at, const AppGroup *group)
{
  char      path[256];
  PetscBool on;
  AppLoad  *load;
  Table     zero = {0};

  PetscFunctionBegin;
  Path(path, "%s.symmetry", at);
  PetscCall(SceneHas(c->scene, path, &on));
  if (on) PetscCall(SceneGetBool(c->scene, path, &on));
  if (!on) PetscFunctionReturn(PETSC_SUCCESS);
  if (group->dim != c->dim - 1) PetscCall(SceneFail(c->scene, path, "symmetry is of a plane; '%s' is a group of dimension %d, not %d", group->name, (int)group->dim, (int)c->dim - 1));
  if (c->method != APP_DEM && !group->particles) {
    PetscCall(AddLoad(c, APP_SYMMETRY, path, group->name, &load));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(TableCreateConstant(0, &zero));
  for (PetscInt f = 0; f < c->body.n_faces; f++)
    for (PetscInt d = 0; d < c->dim && !strcmp(c->body.face_name[f], group->name); d++)
      if (FlatAcross(&c->body, f, d)) {
        PetscCall(AddFix(c, path, group->name, d, PETSC_FALSE, &zero));
        PetscCall(TableDestroy(&zero));
        PetscFunctionReturn(PETSC_SUCCESS);
      }
  PetscCall(SceneFail(c->scene, path, "'%s' is not a flat face across x, y or z; particles have planes of symmetry there only", group->name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A total force and a force per line are spread over element nodes; particles carry loads per area of their faces. */
static PetscErrorCode ReadForces(AppCase *c, const char *at, const AppGroup *group)
{
  static const char *const keys[] = {"force", "line_load"};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 2; k++) {
    char      path[256];
    PetscBool has;

    Path(path, "%s.%s", at, keys[k]);
    PetscCall(SceneHas(c->scene, path, &has));
    if (!has) continue;
    if (c->method == APP_DEM || group->particles) PetscCall(SceneFail(c->scene, path, "%s acts on finite elements; load a face of particles by traction or pressure", keys[k]));
    if (k == 0 && group->dim == c->dim) PetscCall(SceneFail(c->scene, path, "'%s' is a part of the body itself; a force acts on points, lines or sides, gravity on mass", group->name));
    if (k == 1 && group->dim != 1) PetscCall(SceneFail(c->scene, path, "a force per length acts on lines, and '%s' is a group of dimension %d", group->name, (int)group->dim));
    PetscCall(ReadDirections(c, at, keys[k], group));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A rigid plane that the group meets. */
static PetscErrorCode ReadPlane(AppCase *c, const char *at, const AppGroup *group)
{
  char      path[256], key[256];
  PetscBool has;
  AppLoad  *load;

  PetscFunctionBegin;
  Path(path, "%s.plane", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  if (c->method != APP_FEM)
    PetscCall(SceneFail(c->scene, path, "a plane is met by finite elements; %s", c->method == APP_DEM ? "particles meet tools: write tools: {floor: {plane: {point: ..., normal: ...}}}" : "in a coupled body this is not covered yet, see docs/not-yet.md"));
  PetscCall(AddLoad(c, APP_PLANE, path, group->name, &load));
  Path(key, "%s.point", path);
  PetscCall(SceneGetVector(c->scene, key, c->dim, load->point));
  Path(key, "%s.normal", path);
  PetscCall(SceneGetVector(c->scene, key, c->dim, load->normal));
  Path(key, "%s.friction", path);
  PetscCall(SceneGetReal(c->scene, key, &load->friction));
  load->restitution = 1;
  Path(key, "%s.restitution", path);
  if (c->time == APP_EXPLICIT) PetscCall(SceneGetReal(c->scene, key, &load->restitution));
  for (PetscInt d = 0; d < c->dim; d++) {
    Path(key, "%s.velocity.%c", path, (char)('x' + d));
    PetscCall(SceneHas(c->scene, key, &has));
    if (has) PetscCall(AppTable(c, key, &load->motion[d]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A platen is smooth (a flat face moves along its own normal alone) or glued (all components); held and loaded exclude each other. */
static PetscErrorCode CheckDemFaces(AppCase *c)
{
  PetscFunctionBegin;
  for (PetscInt f = 0; f < c->body.n_faces; f++) {
    const AppLoad *fix = NULL, *force = NULL;
    PetscInt       held = 0;

    for (PetscInt k = 0; k < c->n_loads; k++) {
      const AppLoad *l = &c->load[k];

      if (strcmp(l->group, c->body.face_name[f]) || !l->group[0] || (c->method == APP_TOUCH && !l->particles)) continue;
      if (l->kind == APP_FIX) {
        fix = l;
        held++;
      } else force = l;
    }
    if (fix && force) PetscCall(SceneFail(c->scene, force->path, "'%s' is a platen: its motion is prescribed, so it cannot carry a force too", force->group));
    if (!fix || held == c->dim || (held == 1 && FlatAcross(&c->body, f, fix->component))) continue;
    if (held == 1)
      PetscCall(SceneFail(c->scene, fix->path, "'%s' is not a flat face across %c; a smooth platen moves a flat face along its own normal alone, a glued one prescribes all components", fix->group,
                          (char)('x' + fix->component)));
    PetscCall(SceneFail(c->scene, fix->path, "%d of %d components of '%s' are prescribed; a face of particles is held along its normal alone (smooth) or in all components (glued)", (int)held,
                        (int)c->dim, fix->group));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* That a condition has a group and does something the scene's own rules have seen to. */
static PetscErrorCode ReadCondition(AppCase *c, PetscInt i)
{
  char            at[64], path[256];
  const char     *name, *body = NULL;
  PetscInt        first;
  const AppGroup *group;
  AppLoad        *load;
  PetscBool       has;

  PetscFunctionBegin;
  Path(at, "conditions[%" PetscInt_FMT "]", i);
  Path(path, "%s.gravity", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    for (PetscInt k = 0; k < c->n_loads; k++)
      if (c->load[k].kind == APP_GRAVITY) PetscCall(SceneFail(c->scene, path, "gravity is given already, in another condition; keep one"));
    PetscCall(AddLoad(c, APP_GRAVITY, path, "", &load));
    PetscCall(SceneGetVector(c->scene, path, c->dim, load->gravity));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  Path(path, "%s.group", at);
  PetscCall(SceneGetString(c->scene, path, &name));
  Path(path, "%s.body", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) PetscCall(SceneGetString(c->scene, path, &body));
  Path(path, "%s.group", at);
  group = FindGroup(c, name, body);
  if (!group) PetscCall(FailNoGroup(c, path, name));
  if (!body) PetscCall(CheckOne(c, path, group, "add body: NAME"));
  first = c->n_loads;

  PetscCall(ReadFix(c, at, group->name));
  PetscCall(ReadSymmetry(c, at, group));
  PetscCall(ReadForces(c, at, group));
  PetscCall(ReadPlane(c, at, group));
  PetscCall(ReadDirections(c, at, "velocity", group));
  PetscCall(ReadDirections(c, at, "displacement", group));
  Path(path, "%s.traction", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscCall(CheckFacets(c, path, group));
    PetscCall(ReadDirections(c, at, "traction", group));
  }
  Path(path, "%s.absorb", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) PetscCall(SceneGetBool(c->scene, path, &has));
  if (has) {
    PetscCall(CheckFacets(c, path, group));
    if (c->method == APP_DEM) PetscCall(SceneFail(c->scene, path, "absorbing sides belong to finite elements; the body of '%s' is made of particles", group->name));
    if (c->method == APP_TOUCH) PetscCall(SceneFail(c->scene, path, "absorbing sides of a body that particles touch are not covered, see docs/not-yet.md"));
    PetscCall(AddLoad(c, APP_ABSORB, path, group->name, &load));
  }
  Path(path, "%s.pressure", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscCall(CheckFacets(c, path, group));
    PetscCall(AddLoad(c, APP_PRESSURE, path, group->name, &load));
    PetscCall(AppTable(c, path, &load->table));
  }
  for (PetscInt k = first; k < c->n_loads; k++) c->load[k].particles = group->particles;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- history ------------------------------------------------------------------------------------------------------ */

/* A tool's name, or a group's. */
static PetscErrorCode CheckNamed(AppCase *c, const char *path, const char *name)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < c->n_tools; k++) {
    const char *tool;

    PetscCall(SceneGetEntry(c->scene, "tools", k, &tool));
    if (!strcmp(tool, name)) PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!FindGroup(c, name, NULL)) PetscCall(FailNoGroup(c, path, name));
  PetscCall(CheckOne(c, path, FindGroup(c, name, NULL), "take a geometry file that names it differently"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* [from, to) without blanks at its ends. */
static PetscErrorCode CopyTrimmed(const char *from, const char *to, size_t size, char text[])
{
  PetscFunctionBegin;
  while (from < to && isspace((unsigned char)*from)) from++;
  while (to > from && isspace((unsigned char)to[-1])) to--;
  PetscCall(PetscStrncpy(text, from, PetscMin((size_t)(to - from) + 1, size)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "reaction( notch mouth )" -> quantity, group; "strain(a, b)" two groups; "error" none. Its form has been checked; `energies` is always there. */
static PetscErrorCode ReadQuantity(AppCase *c, const char *path, const char *text)
{
  const char  *from = strchr(text, '('), *to = strrchr(text, ')'), *comma = NULL;
  AppQuantity *q;

  PetscFunctionBegin;
  if (!strcmp(text, "balance")) {
    if (c->method != APP_FEM) PetscCall(SceneFail(c->scene, path, "balance sums the forces of finite elements alone; this body has particles"));
    PetscCall(PetscRealloc((size_t)(c->n_quantities + 1) * sizeof(*c->quantity), &c->quantity));
    q = &c->quantity[c->n_quantities++];
    PetscCall(PetscMemzero(q, sizeof(*q)));
    PetscCall(PetscStrncpy(q->path, path, sizeof(q->path)));
    PetscCall(PetscStrncpy(q->quantity, text, sizeof(q->quantity)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!strcmp(text, "energies")) PetscFunctionReturn(PETSC_SUCCESS);
  if ((!strcmp(text, "gauge") || !strcmp(text, "quality") || !strcmp(text, "grains")) && c->method != APP_DEM)
    PetscCall(SceneFail(c->scene, path, "%s is measured on a body of particles alone (method: dem); ask for reactions and displacements of groups", text));
  PetscCall(PetscRealloc((size_t)(c->n_quantities + 1) * sizeof(*c->quantity), &c->quantity));
  q = &c->quantity[c->n_quantities];
  PetscCall(PetscMemzero(q, sizeof(*q)));
  PetscCall(PetscStrncpy(q->path, path, sizeof(q->path)));
  PetscCall(CopyTrimmed(text, from ? from : text + strlen(text), sizeof(q->quantity), q->quantity));
  if (from) {
    if (!strcmp(q->quantity, "strain")) comma = strchr(from, ',');
    if (comma && c->method == APP_TOUCH) PetscCall(SceneFail(c->scene, path, "strains between groups are not covered where two bodies touch, see docs/not-yet.md; ask for displacements"));
    PetscCall(CopyTrimmed(from + 1, comma ? comma : to, sizeof(q->group), q->group));
    PetscCall(CheckNamed(c, path, q->group));
    if (comma) {
      PetscCall(CopyTrimmed(comma + 1, to, sizeof(q->other), q->other));
      PetscCall(CheckNamed(c, path, q->other));
    }
  }
  for (PetscInt k = 0; k < c->n_quantities; k++)
    if (!strcmp(c->quantity[k].quantity, q->quantity) && !strcmp(c->quantity[k].group, q->group) && !strcmp(c->quantity[k].other, q->other)) PetscCall(SceneFail(c->scene, path, "%s is asked for twice", text));
  c->n_quantities++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppConditionsRead(AppCase *c)
{
  PetscInt  n;
  PetscBool has;

  PetscFunctionBegin;
  PetscCall(SceneHas(c->scene, "tools", &has));
  if (has) PetscCall(SceneGetSize(c->scene, "tools", &c->n_tools));
  PetscCall(SceneHas(c->scene, "conditions", &has));
  if (has) {
    PetscCall(SceneGetSize(c->scene, "conditions", &n));
    for (PetscInt i = 0; i < n; i++) PetscCall(ReadCondition(c, i));
  }
  PetscCall(SceneHas(c->scene, "output.plots", &has));
  if (has && c->time == APP_MODAL) PetscCall(SceneFail(c->scene, "output.plots", "plots are of the history, and a modal run has none; take them out, modes.csv holds the frequencies"));
  for (PetscInt k = 0; k < c->n_loads && c->time == APP_MODAL; k++) {
    const AppLoad *l = &c->load[k];

    if (l->kind == APP_SYMMETRY || (l->kind == APP_FIX && l->table.n == 1 && l->table.v[0] == 0)) continue;
    PetscCall(SceneFail(c->scene, l->path, "eigenfrequencies know supports alone, no loads and no motion; take this out, or hold the group with fix"));
  }
  if (c->method == APP_DEM || c->method == APP_TOUCH) {
    PetscCall(CheckDemTraction(c));
    PetscCall(CheckDemFaces(c));
  }
  PetscCall(SceneHas(c->scene, "output.history.quantities", &has));
  if (has) {
    PetscCall(SceneGetSize(c->scene, "output.history.quantities", &n));
    for (PetscInt i = 0; i < n; i++) {
      char        path[256];
      const char *text;

      Path(path, "output.history.quantities[%" PetscInt_FMT "]", i);
      PetscCall(SceneGetEntry(c->scene, "output.history.quantities", i, &text));
      PetscCall(ReadQuantity(c, path, text));
    }
  }
  PetscCall(AppProbesCheck(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- to the models ------------------------------------------------------------------------------------------------ */

static PetscErrorCode ApplyFem(AppCase *c, const AppLoad *l)
{
  PetscReal direction[3] = {0};

  PetscFunctionBegin;
  switch (l->kind) {
  case APP_FIX: AppCallAt(c->scene, l->path, FemModelFix(c->fem, l->group, l->component, l->velocity ? FEM_VELOCITY : FEM_DISPLACEMENT, &l->table)); break;
  case APP_TRACTION:
    direction[l->component] = 1;
    AppCallAt(c->scene, l->path, FemModelAddTraction(c->fem, l->group, direction, &l->table));
    break;
  case APP_FORCE:
    direction[l->component] = 1;
    AppCallAt(c->scene, l->path, FemModelAddForce(c->fem, l->group, direction, &l->table));
    break;
  case APP_LINE_LOAD:
    direction[l->component] = 1;
    AppCallAt(c->scene, l->path, FemModelAddLineLoad(c->fem, l->group, direction, &l->table));
    break;
  case APP_SYMMETRY: AppCallAt(c->scene, l->path, FemModelSetSymmetry(c->fem, l->group)); break;
  case APP_PRESSURE: AppCallAt(c->scene, l->path, FemModelAddPressure(c->fem, l->group, &l->table)); break;
  case APP_GRAVITY: AppCallAt(c->scene, l->path, FemModelSetGravity(c->fem, l->gravity)); break;
  case APP_ABSORB: AppCallAt(c->scene, l->path, FemModelAddAbsorber(c->fem, l->group)); break;
  case APP_PLANE: AppCallAt(c->scene, l->path, FemModelAddPlane(c->fem, l->group, l->point, l->normal, l->friction, l->restitution, l->motion)); break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ApplyDem(AppCase *c, const AppLoad *l)
{
  PetscReal direction[3] = {0};

  PetscFunctionBegin;
  switch (l->kind) {
  case APP_FIX: AppCallAt(c->scene, l->path, DemModelFix(c->dem, l->group, l->component, l->velocity ? DEM_VELOCITY : DEM_DISPLACEMENT, &l->table)); break;
  case APP_TRACTION:
    direction[l->component] = 1;
    AppCallAt(c->scene, l->path, DemModelAddTraction(c->dem, l->group, direction, &l->table));
    break;
  case APP_SYMMETRY:
  case APP_FORCE:
  case APP_LINE_LOAD: PetscCall(SceneFail(c->scene, l->path, "'%s' is on the particles' side of the coupled body, which takes fix, traction and pressure", l->group)); break;
  case APP_PRESSURE: AppCallAt(c->scene, l->path, DemModelAddPressure(c->dem, l->group, &l->table)); break;
  case APP_GRAVITY: AppCallAt(c->scene, l->path, DemModelSetGravity(c->dem, l->gravity)); break;
  case APP_ABSORB: PetscCall(SceneFail(c->scene, l->path, "absorbing sides belong to finite elements; '%s' is on the particles' side of the coupled body", l->group)); break;
  case APP_PLANE: break; /* refused when they were read */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which side of a coupled body has the group; one that both have, or that the overlap shares, is refused. */
PetscErrorCode AppSideOf(AppCase *c, const char *path, const char *name, PetscBool *particles)
{
  const MeshGroup *elements = NULL, *grains = NULL;

  PetscFunctionBegin;
  PetscCall(MeshFindGroup(&c->split.fem, name, &elements));
  PetscCall(MeshFindGroup(&c->split.dem, name, &grains));
  if (elements && grains)
    PetscCall(SceneFail(c->scene, path, "group '%s' lies in the overlap, or on both sides of it; loads, supports and history of a coupled body are on the elements or on the particles: divide the group, or move the overlap", name));
  *particles = grains ? PETSC_TRUE : PETSC_FALSE;
  if (c->turning && !grains) PetscCall(CouplingSwitchProtect(c->turning, name)); /* its elements stay elements */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppConditionsApply(AppCase *c)
{
  PetscFunctionBegin;
  if (c->method != APP_FEM) PetscCall(AppToolsApply(c));
  for (PetscInt k = 0; k < c->n_loads; k++) {
    PetscBool particles = (PetscBool)(c->method == APP_DEM || c->load[k].particles);

    if ((c->method == APP_TOUCH || c->method == APP_COUPLED) && c->load[k].kind == APP_GRAVITY) {
      PetscCall(ApplyFem(c, &c->load[k])); /* and on the particles below */
      particles = PETSC_TRUE;
    } else if (c->method == APP_COUPLED) PetscCall(AppSideOf(c, c->load[k].path, c->load[k].group, &particles));
    if (particles) PetscCall(ApplyDem(c, &c->load[k]));
    else PetscCall(ApplyFem(c, &c->load[k]));
  }
  for (PetscInt k = 0; k < c->n_quantities; k++) {
    const AppQuantity *q = &c->quantity[k];

    PetscBool          particles = (PetscBool)(c->method == APP_DEM);

    if (q->other[0]) {
      PetscCall(AppReadingsNeed(c, q));
      continue;
    }
    if (c->method == APP_COUPLED && q->group[0]) {
      char path[256];

      Path(path, "tools.%s", q->group);
      PetscCall(SceneHas(c->scene, path, &particles));
      if (!particles) PetscCall(AppSideOf(c, q->path, q->group, &particles));
    }
    if (c->method == APP_TOUCH && q->group[0]) {
      const AppGroup *group = FindGroup(c, q->group, NULL);

      particles = group ? group->particles : PETSC_TRUE; /* else a tool */
    }
    if (particles && !q->group[0] && strcmp(q->quantity, "error")) AppCallAt(c->scene, q->path, DemModelAddColumns(c->dem, q->quantity));
    else if (!particles) AppCallAt(c->scene, q->path, FemModelAddHistory(c->fem, q->quantity, q->group));
    else AppCallAt(c->scene, q->path, DemModelAddHistory(c->dem, q->quantity, q->group));
  }
  PetscCall(AppProbesApply(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
