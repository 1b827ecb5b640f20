/* stamp.c - a scene as lines "path: value": what a checkpoint depends on, and what a resumed run does otherwise. */
#include "app.h"
#include "files.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { DEPTH = 24 };

/* Where a line of resolved.yaml stands: the keys above it. */
typedef struct {
  PetscInt depth, indent[DEPTH];
  char     path[DEPTH][128];
  PetscInt item[DEPTH]; /* of the list below the key, -1 before its first */
} Place;

/* "    velocity: ..." -> path; returns what follows the key. */
static PetscErrorCode Step(Place *place, const char *line, const char **value)
{
  const char *key    = line + strspn(line, " ");
  PetscInt    indent = (PetscInt)(key - line), item = -1;
  char        above[128] = "";
  size_t      n;

  PetscFunctionBegin;
  while (place->depth > 0 && place->indent[place->depth - 1] >= indent) place->depth--;
  while (!strncmp(key, "- ", 2)) { /* an item of the list that the key above holds */
    if (place->depth > 0) item = ++place->item[place->depth - 1];
    key += 2;
    indent += 2;
  }
  if (item < 0 && place->depth > 0) item = place->item[place->depth - 1];
  n = strcspn(key, ":\n");
  PetscCheck(place->depth < DEPTH, PETSC_COMM_SELF, PETSC_ERR_PLIB, "resolved.yaml is deeper than %d levels", DEPTH);
  if (place->depth > 0) PetscCall(BaseFormat(above, item < 0 ? "%s." : "%s[%" PetscInt_FMT "].", place->path[place->depth - 1], item));
  PetscCall(BaseFormat(place->path[place->depth], "%s%.*s", above, (int)n, key));
  place->indent[place->depth] = indent;
  place->item[place->depth++] = -1;
  *value                      = key + n + (key[n] == ':');
  *value += strspn(*value, " ");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A later end, more output or another title does not change how the state got here. */
static PetscBool Depends(const char *path)
{
  return (PetscBool)(strcmp(path, "title") && strncmp(path, "output.", 7) && strcmp(path, "time.end") && strcmp(path, "time.stop_unbalanced"));
}

/* Loads and prescribed motions: a resumed run may say that they change. */
static PetscBool IsLoad(const char *path)
{
  static const char *const driven[] = {".velocity.", ".rotation.speed", ".push.force", ".twist.torque"};

  if (!strncmp(path, "conditions", 10)) return PETSC_TRUE;
  for (int k = 0; k < 4 && !strncmp(path, "tools.", 6); k++)
    if (strstr(path, driven[k]) && !strstr(path, ".free.")) return PETSC_TRUE;
  return PETSC_FALSE;
}

/* Both texts from resolved.yaml, without what stands behind '#'. Rank 0. */
static PetscErrorCode Lines(const char *file, char **stamp, char **scene)
{
  char  *text, *line, *next;
  size_t lines = 1, size, n_stamp = 0, n_scene = 0;
  Place  place = {0};

  PetscFunctionBegin;
  PetscCall(FileReadText(file, &text, &size));
  for (size_t k = 0; k < size; k++) lines += text[k] == '\n';
  size += lines * (sizeof(place.path[0]) + 4);
  PetscCall(PetscMalloc1(size, stamp));
  PetscCall(PetscMalloc1(size, scene));
  (*stamp)[0] = (*scene)[0] = 0;
  for (line = text; *line; line = next) {
    const size_t length = strcspn(line, "\n");
    char        *comment;
    const char  *value = "", *path;

    next         = line + length + (line[length] == '\n');
    line[length] = 0;
    comment      = strstr(line, "  #");
    if (comment) *comment = 0;
    if (line[0] == '#' || !line[0]) continue;
    PetscCall(Step(&place, line, &value));
    path = place.path[place.depth - 1];
    if (!value[0]) continue; /* a section */
    n_scene += (size_t)snprintf(*scene + n_scene, size - n_scene, "%s: %s\n", path, value);
    if (Depends(path)) n_stamp += (size_t)snprintf(*stamp + n_stamp, size - n_stamp, "%s%s: %s\n", IsLoad(path) ? "~" : "", path, value);
  }
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Share(MPI_Comm comm, PetscMPIInt rank, char **text)
{
  PetscInt length = rank ? 0 : (PetscInt)strlen(*text);

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&length, 1, MPIU_INT, 0, comm));
  if (rank) PetscCall(PetscMalloc1(length + 1, text));
  PetscCallMPI(MPI_Bcast(*text, (int)length + 1, MPI_CHAR, 0, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppStamp(AppCase *c, char **stamp, char **scene)
{
  char           file[PETSC_MAX_PATH_LEN];
  const char    *directory = getenv("TMPDIR");
  int            fd        = -1;
  PetscErrorCode code      = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(file, sizeof(file), "%s/cleave-XXXXXX", directory ? directory : "/tmp"));
  if (!c->rank) {
    fd = mkstemp(file);
    PetscCheck(fd >= 0, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "Cannot make a temporary file %s; set TMPDIR", file);
  }
  code = SceneWriteResolved(c->scene, file);
  if (!c->rank) {
    if (!code) code = Lines(file, stamp, scene);
    close(fd);
    unlink(file);
  }
  PetscCall(FileShareError(c->comm, code, "write the scene down"));
  PetscCall(Share(c->comm, c->rank, stamp));
  PetscCall(Share(c->comm, c->rank, scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* resolved.yaml of a run that went on: the scene as it is now, then what changed and when. */
PetscErrorCode AppResolvedWrite(AppCase *c, const char *directory, const char *changes)
{
  char           path[PETSC_MAX_PATH_LEN];
  PetscErrorCode code = PETSC_SUCCESS;
  FILE          *out;

  PetscFunctionBegin;
  PetscCall(BaseFormat(path, "%s/resolved.yaml", directory));
  PetscCall(SceneWriteResolved(c->scene, path));
  if (c->rank || !changes || !changes[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FileOpen(path, "a", &out));
  for (const char *line = changes; *line; line += strcspn(line, "\n"), line += *line == '\n') fprintf(out, "# %.*s\n", (int)strcspn(line, "\n"), line);
  code = FileClose(&out, path);
  PetscCall(code);
  PetscFunctionReturn(PETSC_SUCCESS);
}
