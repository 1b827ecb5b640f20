/* contact.c - the scene's `contact` section to the particle model. */
#include "app.h"
#include <string.h>

/* Parts of this material, from `from` on; -1: none is left. */
static PetscInt NextPart(const AppCase *c, const char *material, PetscInt from)
{
  for (PetscInt k = from; k < (c->grain_body ? c->n_parts : 1); k++)
    if (!strcmp(c->grain_body ? c->part[k].material : AppGrains(c)->material, material)) return k;
  return -1;
}

/* A number a pair says itself; else it keeps contact's. */
static PetscErrorCode Own(AppCase *c, PetscInt i, const char *key, PetscReal *value)
{
  char      path[256];
  PetscBool has;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "contact.pairs[%" PetscInt_FMT "].%s", i, key));
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) PetscCall(SceneGetReal(c->scene, path, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ApplyPair(AppCase *c, PetscInt i, const DemContactChoice *common)
{
  DemContactChoice choice = *common;
  const char      *name[2], *word;
  char             path[256];
  PetscBool        has;

  PetscFunctionBegin;
  for (PetscInt s = 0; s < 2; s++) {
    PetscCall(PetscSNPrintf(path, sizeof(path), "contact.pairs[%" PetscInt_FMT "].%s", i, s ? "second" : "first"));
    PetscCall(SceneGetString(c->scene, path, &name[s]));
    if (NextPart(c, name[s], 0) < 0) PetscCall(SceneFail(c->scene, path, "no body of particles is made of '%s'; name the material of one", name[s]));
  }
  PetscCall(PetscSNPrintf(path, sizeof(path), "contact.pairs[%" PetscInt_FMT "].law", i));
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscCall(SceneGetString(c->scene, path, &word));
    choice.law = strcmp(word, "hertz") ? DEM_CONTACT_LINEAR : DEM_CONTACT_HERTZ;
  }
  PetscCall(Own(c, i, "stiffness", &choice.stiffness));
  PetscCall(Own(c, i, "tangential", &choice.ratio));
  PetscCall(Own(c, i, "restitution", &choice.restitution));
  PetscCall(Own(c, i, "friction", &choice.friction));
  PetscCall(Own(c, i, "static_friction", &choice.friction_static));
  PetscCall(Own(c, i, "rolling_friction", &choice.rolling));
  PetscCall(Own(c, i, "rolling_damping", &choice.rolling_damping));
  PetscCall(Own(c, i, "torsional_friction", &choice.twisting));
  for (PetscInt a = NextPart(c, name[0], 0); a >= 0; a = NextPart(c, name[0], a + 1))
    for (PetscInt b = NextPart(c, name[1], 0); b >= 0; b = NextPart(c, name[1], b + 1)) AppCallAt(c->scene, "contact.pairs", DemModelSetContactPair(c->dem, a, b, &choice));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppContactApply(AppCase *c)
{
  DemContactOptions o = {0};
  const char       *word;
  PetscBool         has;

  PetscFunctionBegin;
  PetscCall(SceneHas(c->scene, "contact", &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SceneGetString(c->scene, "contact.law", &word));
  o.choice.law = strcmp(word, "hertz") ? DEM_CONTACT_LINEAR : DEM_CONTACT_HERTZ;
  PetscCall(SceneGetReal(c->scene, "contact.stiffness", &o.choice.stiffness));
  PetscCall(SceneGetReal(c->scene, "contact.tangential", &o.choice.ratio));
  PetscCall(SceneGetReal(c->scene, "contact.restitution", &o.choice.restitution));
  PetscCall(SceneGetReal(c->scene, "contact.friction", &o.choice.friction));
  PetscCall(SceneGetReal(c->scene, "contact.static_friction", &o.choice.friction_static));
  PetscCall(SceneGetReal(c->scene, "contact.rolling_friction", &o.choice.rolling));
  PetscCall(SceneGetReal(c->scene, "contact.rolling_damping", &o.choice.rolling_damping));
  PetscCall(SceneGetReal(c->scene, "contact.torsional_friction", &o.choice.twisting));
  PetscCall(SceneGetString(c->scene, "contact.initial_overlaps", &word));
  o.push = strcmp(word, "push") ? PETSC_FALSE : PETSC_TRUE;
  PetscCall(SceneGetString(c->scene, "contact.domain", &word));
  o.domain = !strcmp(word, "box") ? DEM_DOMAIN_BOX : !strcmp(word, "periodic") ? DEM_DOMAIN_PERIODIC : DEM_DOMAIN_OPEN;
  if (o.domain != DEM_DOMAIN_OPEN) {
    PetscCall(SceneGetVector(c->scene, "contact.low", c->dim, o.low));
    PetscCall(SceneGetVector(c->scene, "contact.high", c->dim, o.high));
  }
  PetscCall(SceneGetReal(c->scene, "contact.skin", &o.skin));
  PetscCall(SceneGetReal(c->scene, "contact.deepest", &o.deepest));
  AppCallAt(c->scene, "contact", DemModelSetContact(c->dem, &o));
  PetscCall(SceneHas(c->scene, "contact.pairs", &has));
  if (has) {
    PetscInt n;

    PetscCall(SceneGetSize(c->scene, "contact.pairs", &n));
    for (PetscInt i = 0; i < n; i++) PetscCall(ApplyPair(c, i, &o.choice));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
