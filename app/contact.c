/* contact.c - the scene's `contact` section to the particle model. */
#include "app.h"
#include <string.h>

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
  PetscFunctionReturn(PETSC_SUCCESS);
}
