/* json.h - a JSON file written in order: objects and arrays open and close, a key is NULL inside an array. One rank. */
#pragma once
#include "base.h"

#define JSON_DEPTH 32

typedef struct {
  FILE     *out;
  char      path[BASE_LINE]; /* renamed from path.part on close: a reader never meets half a file */
  PetscInt  depth;
  char      closer[JSON_DEPTH];
  PetscBool used[JSON_DEPTH]; /* something was written at this depth, so a comma goes first */
} Json;

PetscErrorCode JsonOpen(const char *path, Json *json); /* opens the outer object */
PetscErrorCode JsonClose(Json *json);                  /* closes all that is open */

PetscErrorCode JsonBeginObject(Json *json, const char *key);
PetscErrorCode JsonBeginArray(Json *json, const char *key);
PetscErrorCode JsonEnd(Json *json);

PetscErrorCode JsonReal(Json *json, const char *key, PetscReal value); /* shortest text that reads back the same; not finite: null */
PetscErrorCode JsonInt(Json *json, const char *key, PetscInt64 value);
PetscErrorCode JsonBool(Json *json, const char *key, PetscBool value);
PetscErrorCode JsonString(Json *json, const char *key, const char *value); /* NULL: null */
