/*
  conditions.c - what the scene's conditions and history quantities ask for, as a plain list.

  Read and checked against the groups before any model exists; applied once the model does.
*/
#include "app.h"
#include <ctype.h>
#include <string.h>

#define Path(buffer, ...) PetscCall(PetscSNPrintf(buffer, sizeof(buffer), __VA_ARGS__))

static const AppGroup *FindGroup(const AppCase *c, const char *name)
{
  for (PetscInt g = 0; g < c->n_groups; g++)
    if (!strcmp(c->group[g].name, name)) return &c->group[g];
  return NULL;
}

/* Says which groups there are, nearest first when one is near. */
static PetscErrorCode FailNoGroup(AppCase *c, const char *path, const char *name)
{
  const char *names[256], *near;
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

/* The same component of one group fixed twice: by name at the second place. */
static PetscErrorCode AddFix(AppCase *c, const char *path, const char *group, PetscInt component, PetscBool velocity, const Table *table)
{
  AppLoad *load;

  PetscFunctionBegin;
  if (component >= c->dim) PetscCall(SceneFail(c->scene, path, "there is no z in a scene of dimension 2"));
  for (PetscInt k = 0; k < c->n_loads; k++) {
    const AppLoad *l = &c->load[k];

    if (l->kind == APP_FIX && l->component == component && !strcmp(l->group, group))
      PetscCall(SceneFail(c->scene, path, "the motion of '%s' along %c is prescribed already; one condition per group and direction", group, (char)('x' + component)));
  }
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

/* velocity, displacement and traction: a table per direction. */
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
    PetscCall(SceneGetTable(c->scene, path, &table));
    if (!strcmp(key, "traction")) {
      AppLoad *load;

      if (d >= c->dim) PetscCall(SceneFail(c->scene, path, "there is no z in a scene of dimension 2"));
      PetscCall(AddLoad(c, APP_TRACTION, path, group->name, &load));
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

      if (l->kind == APP_TRACTION && m->kind == APP_TRACTION && !strcmp(l->group, m->group))
        PetscCall(SceneFail(c->scene, l->path, "'%s' carries a traction already; a face of particles takes one direction: x, y or z", l->group));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadCondition(AppCase *c, PetscInt i)
{
  static const char *const keys[] = {"fix", "velocity", "displacement", "traction", "pressure"};
  char            at[64], path[256];
  const char     *name = NULL;
  const AppGroup *group;
  AppLoad        *load;
  PetscBool       has, any = PETSC_FALSE;

  PetscFunctionBegin;
  Path(at, "conditions[%" PetscInt_FMT "]", i);
  Path(path, "%s.group", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) PetscCall(SceneGetString(c->scene, path, &name));

  Path(path, "%s.gravity", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    if (name) PetscCall(SceneFail(c->scene, path, "gravity acts on everything; leave the group '%s' out of this condition", name));
    for (PetscInt k = 0; k < c->n_loads; k++)
      if (c->load[k].kind == APP_GRAVITY) PetscCall(SceneFail(c->scene, path, "gravity is given already"));
    PetscCall(AddLoad(c, APP_GRAVITY, path, "", &load));
    PetscCall(SceneGetVector(c->scene, path, c->dim, load->gravity));
    any = PETSC_TRUE;
  }
  for (int k = 0; k < 5; k++) {
    Path(path, "%s.%s", at, keys[k]);
    PetscCall(SceneHas(c->scene, path, &has));
    if (!has) continue;
    any = PETSC_TRUE;
    if (!name) PetscCall(SceneFail(c->scene, path, "%s needs a group to act on: add group: NAME", keys[k]));
  }
  if (!any) PetscCall(SceneFail(c->scene, at, "this condition does nothing; give fix, velocity, displacement, traction, pressure or gravity"));
  if (!name) PetscFunctionReturn(PETSC_SUCCESS);

  Path(path, "%s.body", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    const char *body;

    PetscCall(SceneGetString(c->scene, path, &body));
    has = PETSC_FALSE;
    for (PetscInt p = 0; p < c->n_parts; p++)
      if (!strcmp(body, c->part[p].name)) has = PETSC_TRUE;
    if (!has) PetscCall(SceneFail(c->scene, path, "no body '%s'; there is '%s'%s", body, c->part[0].name, c->n_parts > 1 ? " and others" : ""));
  }
  Path(path, "%s.group", at);
  group = FindGroup(c, name);
  if (!group) PetscCall(FailNoGroup(c, path, name));

  PetscCall(ReadFix(c, at, group->name));
  PetscCall(ReadDirections(c, at, "velocity", group));
  PetscCall(ReadDirections(c, at, "displacement", group));
  Path(path, "%s.traction", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscCall(CheckFacets(c, path, group));
    PetscCall(ReadDirections(c, at, "traction", group));
  }
  Path(path, "%s.pressure", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscCall(CheckFacets(c, path, group));
    PetscCall(AddLoad(c, APP_PRESSURE, path, group->name, &load));
    PetscCall(SceneGetTable(c->scene, path, &load->table));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- history ------------------------------------------------------------------------------------------------------ */

/* "reaction( notch mouth )" -> quantity, group; "energies" has no group. */
static PetscErrorCode ReadQuantity(AppCase *c, const char *path, const char *text)
{
  static const char *const known[] = {"reaction", "displacement", "velocity", "energies"};
  const char  *open = strchr(text, '('), *near;
  size_t       length = open ? (size_t)(open - text) : strlen(text);
  AppQuantity *q;
  PetscBool    is_known = PETSC_FALSE, tool = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscRealloc((size_t)(c->n_quantities + 1) * sizeof(*c->quantity), &c->quantity));
  q = &c->quantity[c->n_quantities];
  PetscCall(PetscMemzero(q, sizeof(*q)));
  PetscCall(PetscStrncpy(q->path, path, sizeof(q->path)));
  while (length && isspace((unsigned char)text[length - 1])) length--;
  PetscCall(PetscStrncpy(q->quantity, text, PetscMin(length + 1, sizeof(q->quantity))));
  for (int k = 0; k < 4; k++)
    if (!strcmp(q->quantity, known[k])) is_known = PETSC_TRUE;
  if (!is_known) {
    near = BaseNearest(q->quantity, 4, known);
    if (near) PetscCall(SceneFail(c->scene, path, "no quantity '%s'; did you mean '%s'?", q->quantity, near));
    PetscCall(SceneFail(c->scene, path, "no quantity '%s'; there is reaction(GROUP), displacement(GROUP), velocity(GROUP), energies", q->quantity));
  }
  if (!strcmp(q->quantity, "energies")) {
    if (open) PetscCall(SceneFail(c->scene, path, "energies are of the whole model; leave the group out"));
    PetscFunctionReturn(PETSC_SUCCESS); /* always in the history: the ledger's columns */
  }
  if (open) {
    const char *from = open + 1, *to = strchr(from, ')');

    if (!to || to[1]) PetscCall(SceneFail(c->scene, path, "'%s' does not end with ')'; write %s(GROUP)", text, q->quantity));
    while (from < to && isspace((unsigned char)*from)) from++;
    while (to > from && isspace((unsigned char)to[-1])) to--;
    PetscCall(PetscStrncpy(q->group, from, PetscMin((size_t)(to - from) + 1, sizeof(q->group))));
  }
  if (!q->group[0]) PetscCall(SceneFail(c->scene, path, "%s of what? write %s(GROUP)", q->quantity, q->quantity));
  for (PetscInt k = 0; k < c->n_tools; k++) {
    const char *name;

    PetscCall(SceneGetEntry(c->scene, "tools", k, &name));
    if (!strcmp(name, q->group)) tool = PETSC_TRUE;
  }
  if (!tool && !FindGroup(c, q->group)) PetscCall(FailNoGroup(c, path, q->group));
  for (PetscInt k = 0; k < c->n_quantities; k++)
    if (!strcmp(c->quantity[k].quantity, q->quantity) && !strcmp(c->quantity[k].group, q->group)) PetscCall(SceneFail(c->scene, path, "%s is asked for twice", text));
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
  if (c->n_tools && c->method == APP_FEM) PetscCall(SceneFail(c->scene, "tools", "rigid tools against finite elements are not covered yet, see docs/not-yet.md; prescribe the motion of a group instead"));
  PetscCall(SceneHas(c->scene, "conditions", &has));
  if (has) {
    PetscCall(SceneGetSize(c->scene, "conditions", &n));
    for (PetscInt i = 0; i < n; i++) PetscCall(ReadCondition(c, i));
  }
  if (c->method == APP_DEM) PetscCall(CheckDemTraction(c));
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
  case APP_PRESSURE: AppCallAt(c->scene, l->path, FemModelAddPressure(c->fem, l->group, &l->table)); break;
  case APP_GRAVITY: AppCallAt(c->scene, l->path, FemModelSetGravity(c->fem, l->gravity)); break;
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
  case APP_PRESSURE: AppCallAt(c->scene, l->path, DemModelAddPressure(c->dem, l->group, &l->table)); break;
  case APP_GRAVITY: AppCallAt(c->scene, l->path, DemModelSetGravity(c->dem, l->gravity)); break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ApplyTools(AppCase *c)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < c->n_tools; k++) {
    const char *name;
    char        at[160], path[256];
    DemPlane    plane = {{0}};
    Table       velocity[3] = {{0}};

    PetscCall(SceneGetEntry(c->scene, "tools", k, &name));
    Path(at, "tools.%s", name);
    Path(path, "%s.plane.point", at);
    PetscCall(SceneGetVector(c->scene, path, c->dim, plane.point));
    Path(path, "%s.plane.normal", at);
    PetscCall(SceneGetVector(c->scene, path, c->dim, plane.normal));
    Path(path, "%s.friction", at);
    PetscCall(SceneGetReal(c->scene, path, &plane.friction));
    Path(path, "%s.stiffness", at);
    PetscCall(SceneGetReal(c->scene, path, &plane.stiffness));
    Path(path, "%s.damping", at);
    PetscCall(SceneGetReal(c->scene, path, &plane.damping));
    for (PetscInt d = 0; d < 3; d++) {
      PetscBool has;

      Path(path, "%s.velocity.%c", at, (char)('x' + d));
      PetscCall(SceneHas(c->scene, path, &has));
      if (has && d >= c->dim) PetscCall(SceneFail(c->scene, path, "there is no z in a scene of dimension 2"));
      if (has) PetscCall(SceneGetTable(c->scene, path, &velocity[d]));
      else PetscCall(TableCreateConstant(0, &velocity[d]));
    }
    AppCallAt(c->scene, at, DemModelAddPlane(c->dem, name, &plane, velocity));
    for (PetscInt d = 0; d < 3; d++) PetscCall(TableDestroy(&velocity[d]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppConditionsApply(AppCase *c)
{
  PetscFunctionBegin;
  if (c->method == APP_DEM) PetscCall(ApplyTools(c));
  for (PetscInt k = 0; k < c->n_loads; k++) {
    if (c->method == APP_FEM) PetscCall(ApplyFem(c, &c->load[k]));
    else PetscCall(ApplyDem(c, &c->load[k]));
  }
  for (PetscInt k = 0; k < c->n_quantities; k++) {
    const AppQuantity *q = &c->quantity[k];

    if (c->method == APP_FEM) AppCallAt(c->scene, q->path, FemModelAddHistory(c->fem, q->quantity, q->group));
    else AppCallAt(c->scene, q->path, DemModelAddHistory(c->dem, q->quantity, q->group));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
