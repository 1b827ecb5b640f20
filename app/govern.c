/* govern.c - time.govern: loads that hurry while the body is quiet and wait while it breaks.  docs/theory.md 1, eqs (1.9)-(1.11); the law is base/run_govern.c's. */
#include "app.h"

#define RESPONSE_CROSSINGS 10 /* of a wave through the longest extent: some periods of a bar, about one of a slender beam that bends */

/* Time a wave takes through the longest extent of the bodies, the slowest material's [s]. */
static PetscErrorCode Crossing(AppCase *c, PetscReal *seconds)
{
  PetscReal low[3] = {PETSC_MAX_REAL, PETSC_MAX_REAL, PETSC_MAX_REAL}, high[3] = {PETSC_MIN_REAL, PETSC_MIN_REAL, PETSC_MIN_REAL}, speed = PETSC_MAX_REAL, longest = 0;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < c->n_parts; p++)
    if (c->part[p].young > 0) speed = PetscMin(speed, PetscSqrtReal(c->part[p].young / c->part[p].density));
  for (PetscInt d = 0; d < c->dim; d++) {
    for (PetscInt k = 0; k < c->mesh.n_nodes; k++) {
      low[d]  = PetscMin(low[d], c->mesh.x[3 * k + d]);
      high[d] = PetscMax(high[d], c->mesh.x[3 * k + d]);
    }
    if (c->body.n_pieces) {
      low[d]  = PetscMin(low[d], c->body.low[d]);
      high[d] = PetscMax(high[d], c->body.high[d]);
    }
    if (high[d] > low[d]) longest = PetscMax(longest, high[d] - low[d]);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &longest, 1, MPIU_REAL, MPIU_MAX, c->comm)); /* the mesh is rank 0's */
  *seconds = longest / speed;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Options(AppCase *c)
{
  RunGovernOptions *o = &c->law;
  PetscReal         crossing = 0;

  PetscFunctionBegin;
  PetscCall(SceneGetReal(c->scene, "time.govern.unbalanced", &o->unbalanced));
  PetscCall(SceneGetReal(c->scene, "time.govern.kinetic", &o->kinetic));
  PetscCall(SceneGetReal(c->scene, "time.govern.loading", &o->loading));
  PetscCall(SceneGetReal(c->scene, "time.govern.breaking", &o->breaking));
  PetscCall(SceneGetReal(c->scene, "time.govern.slowest", &o->slowest));
  PetscCall(SceneGetReal(c->scene, "time.govern.fastest", &o->fastest));
  PetscCall(SceneGetReal(c->scene, "time.govern.response", &o->response)); /* auto: 0 */
  if (o->response > 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Crossing(c, &crossing));
  o->response = RESPONSE_CROSSINGS * crossing;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppGovernRead(AppCase *c)
{
  const RunGovernOptions *o = &c->law;

  PetscFunctionBegin;
  PetscCall(SceneHas(c->scene, "time.govern", &c->governed));
  if (!c->governed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Options(c));
  if (o->unbalanced == 0 && o->kinetic == 0 && o->loading == 0 && o->breaking == 0) PetscCall(SceneFail(c->scene, "time.govern", "unbalanced, kinetic, loading and breaking are all 0, so nothing governs the load; give one of them a positive value"));
  if (o->fastest < o->slowest) PetscCall(SceneFail(c->scene, "time.govern.fastest", "%g is below time.govern.slowest, %g; it must be at least that", (double)o->fastest, (double)o->slowest));
  for (PetscInt p = 0; p < c->n_parts; p++) {
    char      path[256];
    PetscBool rain;

    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.rain", c->part[p].name));
    PetscCall(SceneHas(c->scene, path, &rain));
    if (rain) PetscCall(SceneFail(c->scene, path, "grains that fall are not governed: they come as time goes, and never rest; take time.govern out, or the rain"));
  }
  RunGovernClock(o, &c->pace);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppTable(AppCase *c, const char *path, Table *table)
{
  PetscFunctionBegin;
  PetscCall(SceneGetTable(c->scene, path, table));
  if (c->governed) table->clock = &c->pace;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppGovernBegin(AppCase *c)
{
  PetscFunctionBegin;
  if (!c->governed) PetscFunctionReturn(PETSC_SUCCESS);
  if (c->law.unbalanced > 0 && !c->stepper.unbalanced) PetscCall(SceneFail(c->scene, "time.govern", "grains without bonds have no unbalanced ratio to govern the load by; add unbalanced: 0, so that kinetic governs alone"));
  PetscCall(RunGovernCreate(c->comm, &c->law, &c->stepper, &c->pace, &c->govern));
  PetscCall(RunGovernGetStepper(c->govern, &c->stepper));
  PetscFunctionReturn(PETSC_SUCCESS);
}
