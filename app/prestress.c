/* prestress.c - in-situ stress and temperature of finite elements, from the scene to the model. */
#include "app.h"

#define Path(buffer, ...) PetscCall(PetscSNPrintf(buffer, sizeof(buffer), __VA_ARGS__))

static PetscErrorCode InitialStress(AppCase *c, const AppPart *part)
{
  static const char *const component[] = {"xx", "yy", "zz", "xy", "yz", "zx"};
  const PetscInt           up       = c->dim - 1;
  PetscReal                base[6] = {0}, slope[6] = {0}, level = 0, ratio = part->poisson / (1 - part->poisson), gravity;
  char                     at[256], path[320];
  PetscBool                has;

  PetscFunctionBegin;
  Path(at, "bodies.%s.initial_stress", part->name);
  PetscCall(SceneHas(c->scene, at, &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < (c->dim == 3 ? 6 : 4); k++) {
    Path(path, "%s.%s", at, component[k]);
    PetscCall(SceneGetReal(c->scene, path, &base[k]));
  }
  Path(path, "%s.gravity", at);
  PetscCall(SceneGetReal(c->scene, path, &gravity));
  Path(path, "%s.ratio", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) PetscCall(SceneGetReal(c->scene, path, &ratio));
  Path(path, "%s.surface", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscCall(SceneGetReal(c->scene, path, &level));
    for (PetscInt k = 0; k < 3; k++) slope[k] = part->density * gravity * (k == up ? 1 : c->dim == 2 && k == 2 && c->plane_stress ? 0 : ratio);
  }
  AppCallAt(c->scene, at, FemModelSetInitialStress(c->fem, part->group, base, slope, up, level));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Temperature(AppCase *c, const AppPart *part)
{
  char      at[256], path[320];
  PetscReal origin[3] = {0}, field[4] = {1, 0, 0, 0};
  Table     table = {0};
  PetscBool has;

  PetscFunctionBegin;
  Path(at, "bodies.%s.temperature", part->name);
  PetscCall(SceneHas(c->scene, at, &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  Path(path, "%s.rise", at);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscCall(AppTable(c, path, &table));
    AppCallAt(c->scene, path, FemModelAddTemperature(c->fem, part->group, field, &table));
    PetscCall(TableDestroy(&table));
  }
  Path(path, "%s.origin", at);
  PetscCall(SceneGetVector(c->scene, path, c->dim, origin));
  for (PetscInt d = 0; d < c->dim; d++) {
    Path(path, "%s.gradient.%c", at, (char)('x' + d));
    PetscCall(SceneHas(c->scene, path, &has));
    if (!has) continue;
    PetscCall(AppTable(c, path, &table));
    for (PetscInt k = 0; k < 4; k++) field[k] = k == d + 1 ? 1 : 0;
    field[0] = -origin[d];
    AppCallAt(c->scene, path, FemModelAddTemperature(c->fem, part->group, field, &table));
    PetscCall(TableDestroy(&table));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppPrestressApply(AppCase *c, const AppPart *part)
{
  char      path[256];
  PetscReal expansion;

  PetscFunctionBegin;
  Path(path, "materials.%s.expansion", part->material);
  PetscCall(SceneGetReal(c->scene, path, &expansion));
  if (expansion != 0) AppCallAt(c->scene, path, FemModelSetExpansion(c->fem, part->group, expansion));
  PetscCall(InitialStress(c, part));
  PetscCall(Temperature(c, part));
  PetscFunctionReturn(PETSC_SUCCESS);
}
