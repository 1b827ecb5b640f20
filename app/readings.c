/*
  readings.c - what history.csv shows beyond the models' own columns.

  Probes are the element model's. A strain(a, b) is made here, for every method alike: the mean displacements of the two groups,
  along the line between their middles, over its length, eq. (2.99). The columns it is made of are the models'; those nobody asked for stay
  hidden. A scene without a strain meets none of this: the models' own stepper runs.
*/
#include "app.h"
#include <string.h>

typedef struct {
  char      path[256], group[2][128];
  PetscBool particles[2];
  PetscInt  column[2][3]; /* of the models' stepper */
  PetscReal axis[3], length; /* [m] */
} Strain;

struct _AppReadings {
  Stepper      inner;
  PetscInt     n_strains, n_hidden;
  Strain      *strain;
  char       (*hidden)[128]; /* groups whose displacement only strains want */
  PetscInt    *hidden_in;    /* [n_hidden] c->made_dem of the models that have its columns: elements that turn make models anew */
  PetscInt    *column;       /* [n_history] of the inner stepper, or -1 - strain */
  PetscInt    *twin;         /* [n_history] the particles' column of the same probe, -1 */
  char       **own_name;     /* [n_strains] */
  const char **name, **unit; /* [n_history] */
};

/* ---- probes ---- */

PetscErrorCode AppProbesCheck(AppCase *c)
{
  PetscInt  n = 0;
  PetscBool has;

  PetscFunctionBegin;
  PetscCall(SceneHas(c->scene, "output.probes", &has));
  if (has) PetscCall(SceneGetSize(c->scene, "output.probes", &n));
  for (PetscInt k = 0; k < n; k++) {
    const char *name;
    char        path[256];

    PetscCall(SceneGetEntry(c->scene, "output.probes", k, &name));
    PetscCall(PetscSNPrintf(path, sizeof(path), "output.probes.%s", name));
    for (PetscInt g = 0; g < c->n_groups; g++)
      if (!strcmp(c->group[g].name, name)) PetscCall(SceneFail(c->scene, path, "'%s' is a group of a body; columns are named after it, so a probe needs another name", name));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppProbesApply(AppCase *c)
{
  PetscInt  n = 0;
  PetscBool has;

  PetscFunctionBegin;
  PetscCall(SceneHas(c->scene, "output.probes", &has));
  if (has) PetscCall(SceneGetSize(c->scene, "output.probes", &n));
  for (PetscInt k = 0; k < n; k++) {
    const char *name, *word[8];
    char        path[256];
    PetscReal   at[3] = {0, 0, 0};
    PetscInt    words = 0, given;

    PetscCall(SceneGetEntry(c->scene, "output.probes", k, &name));
    PetscCall(PetscSNPrintf(path, sizeof(path), "output.probes.%s.at", name));
    PetscCall(SceneGetVector(c->scene, path, c->dim, at));
    PetscCall(PetscSNPrintf(path, sizeof(path), "output.probes.%s.quantities", name));
    PetscCall(SceneGetSize(c->scene, path, &given));
    for (PetscInt i = 0; i < PetscMin(given, 8); i++) {
      const char *next;

      PetscCall(SceneGetEntry(c->scene, path, i, &next));
      for (PetscInt j = 0; j < words; j++)
        if (!strcmp(word[j], next)) PetscCall(SceneFail(c->scene, path, "%s is asked for twice", next));
      word[words++] = next;
    }
    PetscCall(PetscSNPrintf(path, sizeof(path), "output.probes.%s.at", name));
    if (c->turning) { /* of whichever side has the point at the time */
      AppCallAt(c->scene, path, FemModelAddProbeAnywhere(c->fem, name, at, words, word));
      AppCallAt(c->scene, path, DemModelAddProbe(c->dem, name, at, words, word));
      if (!c->readings) PetscCall(PetscCalloc1(1, &c->readings));
    } else AppCallAt(c->scene, path, FemModelAddProbe(c->fem, name, at, words, word));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- strains ---- */

/* The model's displacement columns of a group; hidden unless the user asks for them too. */
static PetscErrorCode NeedDisplacement(AppCase *c, const char *path, const char *group, PetscBool particles)
{
  AppReadings r  = c->readings;
  PetscInt    at = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < c->n_quantities; k++)
    if (!strcmp(c->quantity[k].quantity, "displacement") && !strcmp(c->quantity[k].group, group)) PetscFunctionReturn(PETSC_SUCCESS);
  while (at < r->n_hidden && strcmp(r->hidden[at], group)) at++;
  if (at < r->n_hidden && r->hidden_in[at] == c->made_dem) PetscFunctionReturn(PETSC_SUCCESS);
  if (at == r->n_hidden) {
    PetscCall(PetscRealloc(sizeof(*r->hidden) * (r->n_hidden + 1), &r->hidden));
    PetscCall(PetscRealloc(sizeof(*r->hidden_in) * (r->n_hidden + 1), &r->hidden_in));
    PetscCall(PetscStrncpy(r->hidden[r->n_hidden++], group, sizeof(*r->hidden)));
  }
  r->hidden_in[at] = c->made_dem;
  if (particles) AppCallAt(c->scene, path, DemModelAddHistory(c->dem, "displacement", group));
  else AppCallAt(c->scene, path, FemModelAddHistory(c->fem, "displacement", group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppReadingsNeed(AppCase *c, const AppQuantity *q)
{
  AppReadings r;
  Strain     *s;

  PetscFunctionBegin;
  if (!c->readings) PetscCall(PetscCalloc1(1, &c->readings));
  r = c->readings;
  if (r->column) { /* begun: of models made anew for a new split */
    PetscBool particles;

    for (PetscInt k = 0; k < 2; k++) {
      PetscCall(AppSideOf(c, q->path, k ? q->other : q->group, &particles));
      PetscCall(NeedDisplacement(c, q->path, k ? q->other : q->group, particles));
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = 0; k < r->n_strains; k++) /* both sides are made more than once */
    if (!strcmp(r->strain[k].group[0], q->group) && !strcmp(r->strain[k].group[1], q->other)) {
      for (PetscInt i = 0; i < 2; i++) PetscCall(NeedDisplacement(c, q->path, r->strain[k].group[i], r->strain[k].particles[i]));
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  PetscCall(PetscRealloc(sizeof(Strain) * (r->n_strains + 1), &r->strain));
  s = &r->strain[r->n_strains++];
  PetscCall(PetscMemzero(s, sizeof(*s)));
  PetscCall(PetscStrncpy(s->path, q->path, sizeof(s->path)));
  for (PetscInt k = 0; k < 2; k++) {
    PetscCall(PetscStrncpy(s->group[k], k ? q->other : q->group, sizeof(s->group[k])));
    s->particles[k] = (PetscBool)(c->method == APP_DEM);
    if (c->method == APP_COUPLED) PetscCall(AppSideOf(c, q->path, s->group[k], &s->particles[k]));
    PetscCall(NeedDisplacement(c, q->path, s->group[k], s->particles[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt FindColumn(const Stepper *s, const char *name)
{
  for (PetscInt k = 0; k < s->n_history; k++)
    if (!strcmp(s->history_name[k], name)) return k;
  return -1;
}

/* Columns, axis and length of a strain. */
static PetscErrorCode FindLine(AppCase *c, Strain *s)
{
  PetscReal middle[2][3] = {{0}};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 2; k++) {
    if (s->particles[k]) PetscCall(DemModelGetGroupMiddle(c->dem, s->group[k], middle[k]));
    else PetscCall(FemModelGetGroupMiddle(c->fem, s->group[k], middle[k]));
    for (PetscInt d = 0; d < c->dim; d++) {
      char name[256];

      PetscCall(PetscSNPrintf(name, sizeof(name), "displacement(%s).%c", s->group[k], (char)('x' + d)));
      s->column[k][d] = FindColumn(&c->readings->inner, name);
      PetscCheck(s->column[k][d] >= 0, c->comm, PETSC_ERR_PLIB, "No column %s", name);
    }
  }
  for (PetscInt d = 0; d < c->dim; d++) {
    s->axis[d] = middle[1][d] - middle[0][d];
    s->length += s->axis[d] * s->axis[d];
  }
  s->length = PetscSqrtReal(s->length);
  if (!(s->length > 0)) PetscCall(SceneFail(c->scene, s->path, "groups '%s' and '%s' have the same middle, so there is no length between them to stretch", s->group[0], s->group[1]));
  for (PetscInt d = 0; d < c->dim; d++) s->axis[d] /= s->length;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode History(void *ctx, PetscInt i, PetscReal *value)
{
  AppCase    *c = ctx;
  AppReadings r = c->readings;
  PetscReal   sum = 0;

  PetscFunctionBegin;
  if (r->column[i] >= 0) {
    PetscCall(r->inner.history(r->inner.ctx, r->column[i], value));
    if (r->twin[i] >= 0) {
      PetscReal other;

      PetscCall(r->inner.history(r->inner.ctx, r->twin[i], &other));
      if (PetscIsNanReal(*value)) *value = other;
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = 0; k < 2; k++) {
    const Strain *s = &r->strain[-1 - r->column[i]];

    for (PetscInt d = 0; d < c->dim; d++) {
      PetscReal u;

      PetscCall(r->inner.history(r->inner.ctx, s->column[k][d], &u));
      sum += (k ? 1 : -1) * s->axis[d] * u / s->length;
    }
  }
  *value = sum;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rest is the models' own. */
static PetscErrorCode Stable(void *ctx, PetscReal *dt)
{
  const Stepper *s = &((AppCase *)ctx)->readings->inner;

  return s->stable_step(s->ctx, dt);
}

static PetscErrorCode Step(void *ctx, PetscReal t, PetscReal dt)
{
  const Stepper *s = &((AppCase *)ctx)->readings->inner;

  return s->step(s->ctx, t, dt);
}

static PetscErrorCode Energy(void *ctx, Ledger *ledger)
{
  const Stepper *s = &((AppCase *)ctx)->readings->inner;

  return s->energy(s->ctx, ledger);
}

static PetscErrorCode Write(void *ctx, Output output)
{
  const Stepper *s = &((AppCase *)ctx)->readings->inner;

  return s->write(s->ctx, output);
}

static PetscErrorCode Save(void *ctx, Checkpoint checkpoint)
{
  const Stepper *s = &((AppCase *)ctx)->readings->inner;

  return s->save(s->ctx, checkpoint);
}

static PetscErrorCode Load(void *ctx, Checkpoint checkpoint)
{
  const Stepper *s = &((AppCase *)ctx)->readings->inner;

  return s->load(s->ctx, checkpoint);
}

static PetscErrorCode Watch(void *ctx, RunWatch look, char fault[BASE_LINE])
{
  const Stepper *s = &((AppCase *)ctx)->readings->inner;

  return s->watch(s->ctx, look, fault);
}

static PetscErrorCode Unbalanced(void *ctx, PetscReal *ratio)
{
  const Stepper *s = &((AppCase *)ctx)->readings->inner;

  return s->unbalanced(s->ctx, ratio);
}

PetscErrorCode AppReadingsBegin(AppCase *c)
{
  AppReadings r = c->readings;
  PetscInt    n = 0;

  PetscFunctionBegin;
  if (!r) PetscFunctionReturn(PETSC_SUCCESS);
  r->inner = c->stepper;
  PetscCall(PetscMalloc4(r->inner.n_history + r->n_strains, &r->twin, r->inner.n_history + r->n_strains, &r->column, r->inner.n_history + r->n_strains, &r->name, r->inner.n_history + r->n_strains, &r->unit));
  PetscCall(PetscCalloc1(r->n_strains, &r->own_name));
  for (PetscInt k = 0; k < r->inner.n_history; k++) {
    PetscBool hide = (PetscBool)(FindColumn(&r->inner, r->inner.history_name[k]) < k); /* the particles' part of a probe */

    for (PetscInt h = 0; h < r->n_hidden; h++) {
      char start[256];

      PetscCall(PetscSNPrintf(start, sizeof(start), "displacement(%s).", r->hidden[h]));
      if (!strncmp(r->inner.history_name[k], start, strlen(start))) hide = PETSC_TRUE;
    }
    if (hide) continue;
    r->column[n] = k;
    r->twin[n]   = -1;
    for (PetscInt j = k + 1; j < r->inner.n_history; j++)
      if (!strcmp(r->inner.history_name[j], r->inner.history_name[k])) r->twin[n] = j;
    r->name[n]   = r->inner.history_name[k];
    r->unit[n++] = r->inner.history_unit[k];
  }
  for (PetscInt k = 0; k < r->n_strains; k++) {
    char name[300];

    PetscCall(FindLine(c, &r->strain[k]));
    PetscCall(PetscSNPrintf(name, sizeof(name), "strain(%s, %s)", r->strain[k].group[0], r->strain[k].group[1]));
    PetscCall(PetscStrallocpy(name, &r->own_name[k]));
    r->column[n] = -1 - k;
    r->twin[n]   = -1;
    r->name[n]   = r->own_name[k];
    r->unit[n++] = "-";
  }
  c->stepper             = r->inner; /* its name, rate and the like */
  c->stepper.ctx         = c;
  c->stepper.stable_step = Stable;
  c->stepper.step        = Step;
  c->stepper.energy      = Energy;
  c->stepper.history     = History;
  c->stepper.write       = Write;
  c->stepper.save        = Save;
  c->stepper.load        = Load;
  c->stepper.watch       = r->inner.watch ? Watch : NULL;
  c->stepper.unbalanced  = r->inner.unbalanced ? Unbalanced : NULL;
  c->stepper.n_history   = n;
  c->stepper.history_name = r->name;
  c->stepper.history_unit = r->unit;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppReadingsDestroy(AppCase *c)
{
  AppReadings r = c->readings;

  PetscFunctionBegin;
  if (!r) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < r->n_strains && r->own_name; k++) PetscCall(PetscFree(r->own_name[k]));
  PetscCall(PetscFree(r->own_name));
  PetscCall(PetscFree(r->strain));
  PetscCall(PetscFree(r->hidden));
  PetscCall(PetscFree(r->hidden_in));
  PetscCall(PetscFree4(r->twin, r->column, r->name, r->unit));
  PetscCall(PetscFree(c->readings));
  PetscFunctionReturn(PETSC_SUCCESS);
}
