/* grains.c - bodies of loose grains that share one model: packings in one, clumps in place of their spheres, materials and their pairs. */
#include "app.h"
#include <string.h>

#define Path(buffer, ...) PetscCall(PetscSNPrintf(buffer, sizeof(buffer), __VA_ARGS__))

/* The clump of the body at hand, if it has one. */
static PetscErrorCode ReadShape(AppCase *c, DemClump *shape, PetscBool *has)
{
  const char *body = AppGrains(c)->name;
  PetscReal  *x, *r, mass, centre[3], moments[3];
  PetscBool   given;
  PetscInt    n;
  char        path[256];

  PetscFunctionBegin;
  Path(path, "bodies.%s.dem.clump", body);
  PetscCall(SceneHas(c->scene, path, has));
  if (!*has) PetscFunctionReturn(PETSC_SUCCESS);
  Path(path, "bodies.%s.dem.clump.spheres", body);
  PetscCall(SceneGetSize(c->scene, path, &n));
  PetscCall(PetscMalloc2(3 * n, &x, n, &r));
  for (PetscInt i = 0; i < n; i++) {
    Path(path, "bodies.%s.dem.clump.spheres[%" PetscInt_FMT "].at", body, i);
    PetscCall(SceneGetVector(c->scene, path, 3, &x[3 * i]));
    Path(path, "bodies.%s.dem.clump.spheres[%" PetscInt_FMT "].radius", body, i);
    PetscCall(SceneGetReal(c->scene, path, &r[i]));
  }
  Path(path, "bodies.%s.dem.clump.mass", body);
  PetscCall(SceneHas(c->scene, path, &given));
  if (given) {
    PetscCall(SceneGetReal(c->scene, path, &mass));
    Path(path, "bodies.%s.dem.clump.centre", body);
    PetscCall(SceneGetVector(c->scene, path, 3, centre));
    Path(path, "bodies.%s.dem.clump.inertia", body);
    PetscCall(SceneGetVector(c->scene, path, 3, moments));
    AppCallAt(c->scene, path, DemClumpCreateGiven(n, x, r, mass, centre, moments, shape));
  } else {
    Path(path, "bodies.%s.dem.clump.spheres", body);
    AppCallAt(c->scene, path, DemClumpCreate(n, x, r, shape));
  }
  PetscCall(PetscFree2(x, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Append(DemPacking *all, DemPacking *more)
{
  PetscFunctionBegin;
  PetscCall(PetscRealloc((size_t)(3 * (all->n + more->n)) * sizeof(PetscReal), &all->x));
  PetscCall(PetscRealloc((size_t)(all->n + more->n) * sizeof(PetscReal), &all->r));
  PetscCall(PetscArraycpy(all->x + 3 * all->n, more->x, 3 * more->n));
  PetscCall(PetscArraycpy(all->r + all->n, more->r, more->n));
  all->n += more->n;
  PetscCall(DemPackingDestroy(more));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Spheres of the packing to clumps; their places begin at sphere `first` of the whole. */
static PetscErrorCode ToClumps(AppCase *c, PetscInt first)
{
  DemClumpPlace *place;
  DemPacking     members;
  const char    *word;
  PetscInt       seed;
  char           path[256];

  PetscFunctionBegin;
  Path(path, "bodies.%s.dem.clump.orientation", AppGrains(c)->name);
  PetscCall(SceneGetString(c->scene, path, &word));
  Path(path, "bodies.%s.dem.packing.seed", AppGrains(c)->name);
  PetscCall(SceneGetInt(c->scene, path, &seed));
  PetscCall(DemPackingMakeClumps(&c->packing, &c->shape[c->grain], strcmp(word, "random") ? PETSC_FALSE : PETSC_TRUE, seed, &members, &place));
  PetscCall(PetscRealloc((size_t)(c->n_places + c->packing.n) * sizeof(*place), &c->place));
  for (PetscInt k = 0; k < c->packing.n; k++) {
    place[k].first += first;
    c->place[c->n_places++] = place[k];
  }
  PetscCall(PetscFree(place));
  PetscCall(DemPackingDestroy(&c->packing));
  c->packing = members;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppGrainsPack(AppCase *c)
{
  const PetscInt bodies = c->grain_body ? c->n_parts : 1;
  DemPacking     all    = {0};
  DemBody        box    = c->body;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(bodies, &c->shape));
  for (PetscInt k = 0; k < bodies; k++) {
    PetscBool      clumps;
    const PetscInt first = all.n;

    c->grain = k;
    if (c->grain_body) c->body = c->grain_body[k];
    PetscCall(AppCasePack(c));
    PetscCall(ReadShape(c, &c->shape[k], &clumps));
    if (clumps) PetscCall(ToClumps(c, first));
    if (!c->grain_body) break;
    PetscCall(PetscRealloc((size_t)(all.n + c->packing.n) * sizeof(PetscInt), &c->grain_of));
    for (PetscInt i = 0; i < c->packing.n; i++) c->grain_of[all.n + i] = k;
    PetscCall(Append(&all, &c->packing));
  }
  if (c->grain_body) {
    c->packing = all;
    c->body    = box;
  }
  c->grain = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppGrainsApply(AppCase *c)
{
  PetscFunctionBegin;
  if (c->grain_body) {
    DemMaterial *material;
    PetscReal   *velocity;

    PetscCall(PetscMalloc2(c->n_parts, &material, 3 * c->n_parts, &velocity));
    for (PetscInt k = 0; k < c->n_parts; k++) {
      char path[256];

      material[k] = (DemMaterial){c->part[k].density, c->part[k].young, c->part[k].poisson};
      PetscCall(PetscArrayzero(&velocity[3 * k], 3));
      Path(path, "bodies.%s.initial_velocity", c->part[k].name);
      PetscCall(SceneGetVector(c->scene, path, c->dim, &velocity[3 * k]));
    }
    AppCallAt(c->scene, "bodies", DemModelSetGrainMaterials(c->dem, c->n_parts, material, c->grain_of));
    PetscCall(DemModelSetGrainVelocities(c->dem, velocity));
    PetscCall(PetscFree2(material, velocity));
  }
  if (c->n_places) {
    char path[256];

    for (PetscInt k = 0; k < (c->grain_body ? c->n_parts : 1); k++) {
      c->grain = k;
      if (c->shape[k].n) Path(path, "bodies.%s.dem.clump", AppGrains(c)->name);
    }
    c->grain = 0;
    AppCallAt(c->scene, path, DemModelSetClumps(c->dem, c->n_places, c->place));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppGrainsDestroy(AppCase *c)
{
  const PetscInt bodies = c->grain_body ? c->n_parts : 1;

  PetscFunctionBegin;
  for (PetscInt k = 0; c->grain_body && k < bodies; k++) PetscCall(DemBodyDestroy(&c->grain_body[k]));
  for (PetscInt k = 0; c->shape && k < bodies; k++) PetscCall(DemClumpDestroy(&c->shape[k]));
  PetscCall(PetscFree(c->grain_body));
  PetscCall(PetscFree(c->shape));
  PetscCall(PetscFree(c->place));
  PetscCall(PetscFree(c->grain_of));
  PetscFunctionReturn(PETSC_SUCCESS);
}
