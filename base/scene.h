/*
  scene.h - the user's YAML as typed values.

  One table (scene_keys.c) says every key: type, unit, default, range, equation, help. It checks scenes, makes the
  reference page and is what the getters ask for defaults. A path is keys joined by dots, list items in brackets:
  "materials.concrete.young", "conditions[2].velocity.y".
*/
#pragma once
#include "base.h"
#include "table.h"

typedef struct _p_Scene *Scene;

/*
  SceneRead - read, check against the table, convert to SI

  Collective: rank 0 reads the file, all ranks check the same text.
  Input:  file; overrides "path=value" from --set, applied before checking (value is YAML: "28 GPa", "[x, y]")
  Errors: PETSC_ERR_USER_INPUT; every fault found (at most 20) is printed as `file:line:column: what; what would be right`
*/
PetscErrorCode SceneRead(MPI_Comm comm, const char *file, PetscInt n_overrides, const char *const overrides[], Scene *scene);
PetscErrorCode SceneDestroy(Scene *scene);

PetscErrorCode SceneHas(Scene scene, const char *path, PetscBool *has); /* the user wrote this key */

/* Values in SI, the table's default when the user wrote none; PETSC_ERR_ARG_WRONG for a path the table does not know
   (a programming error), PETSC_ERR_USER_INPUT where a value without default is missing. `auto` is 0 for numbers.
   A vector of a 2D scene has two components; SceneGetVector fills the rest of n with 0. */
PetscErrorCode SceneGetReal(Scene scene, const char *path, PetscReal *value);
PetscErrorCode SceneGetInt(Scene scene, const char *path, PetscInt *value);
PetscErrorCode SceneGetBool(Scene scene, const char *path, PetscBool *value);
PetscErrorCode SceneGetString(Scene scene, const char *path, const char **value); /* borrowed */
PetscErrorCode SceneGetVector(Scene scene, const char *path, PetscInt n, PetscReal value[]);
PetscErrorCode SceneGetTable(Scene scene, const char *path, Table *table); /* caller destroys */

/* A map's entries or a list's items, in the order written. SceneGetEntry gives the key of a map, the text of a plain list item. */
PetscErrorCode SceneGetSize(Scene scene, const char *path, PetscInt *n);
PetscErrorCode SceneGetEntry(Scene scene, const char *path, PetscInt i, const char **key);

/* A file named in the scene, relative to the scene's own folder. */
PetscErrorCode SceneFilePath(Scene scene, const char *name, size_t size, char path[]);

/* Record a value the program derived ("auto" keys), for resolved.yaml. unit is for print only: value is SI. */
PetscErrorCode SceneSetDerived(Scene scene, const char *path, PetscReal value, const char *why);

/*
  SceneFail - an error at a place in the scene: prints `file:line:column: message`, returns PETSC_ERR_USER_INPUT
  Use as `PetscCall(SceneFail(scene, path, "...", ...))`; a path the user did not write points at its nearest parent.
*/
PetscErrorCode SceneFail(Scene scene, const char *path, const char *format, ...) PETSC_ATTRIBUTE_FORMAT(3, 4);

PetscErrorCode SceneWriteResolved(Scene scene, const char *file); /* every value, unit, and user | default | derived */
PetscErrorCode SceneWriteReference(FILE *out);                    /* the reference page, Markdown */
