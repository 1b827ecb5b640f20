/* targets.c - bytes as a file in a folder of this process's own, read the way a run reads it. */
#include "targets.h"
#include "checkpoint.h"
#include "dem_packing.h"
#include "dem_surface.h"
#include "files.h"
#include "mesh.h"
#include "output.h"
#include "scene.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[64];

static void Remove(void)
{
  char words[128];

  snprintf(words, sizeof(words), "rm -rf %s", folder);
  if (system(words)) fprintf(stderr, "%s stays\n", folder);
}

static const char *Folder(void)
{
  if (!folder[0]) {
    strcpy(folder, access("/dev/shm", W_OK) ? "/tmp/cleave-fuzz-XXXXXX" : "/dev/shm/cleave-fuzz-XXXXXX");
    if (!mkdtemp(folder)) abort();
    atexit(Remove);
  }
  return folder;
}

static PetscErrorCode ReadScene(const char *file)
{
  Scene          scene = NULL;
  PetscErrorCode code  = SceneRead(PETSC_COMM_SELF, file, 0, NULL, &scene);

  (void)SceneDestroy(&scene);
  return code;
}

static PetscErrorCode ReadPacking(const char *file)
{
  const PetscReal low[3] = {0, 0, 0}, high[3] = {1, 1, 1};
  static DemBody  body;
  static int      made;
  DemPacking      packing;
  PetscErrorCode  code;

  PetscFunctionBegin;
  if (!made++) PetscCall(DemBodyCreateBox(3, low, high, 1, &body));
  code = DemPackingRead(file, &body, PETSC_FALSE, &packing);
  if (!code) PetscCall(DemPackingDestroy(&packing));
  PetscFunctionReturn(code);
}

static PetscErrorCode ReadSurface(const char *file)
{
  DemSurface     surface;
  PetscErrorCode code;

  PetscFunctionBegin;
  code = DemSurfaceRead(PETSC_COMM_SELF, file, 3, "", 1, 0, &surface);
  if (!code) PetscCall(DemSurfaceDestroy(&surface));
  PetscFunctionReturn(code);
}

static PetscErrorCode ReadMesh(const char *file)
{
  const MeshOptions options = {2, 0, 1, 1, PETSC_FALSE, PETSC_FALSE, PETSC_FALSE};
  Mesh              mesh = {{0}};
  PetscErrorCode    code;

  PetscFunctionBegin;
  code = MeshRead(PETSC_COMM_SELF, file, &options, &mesh);
  if (!code) PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(code);
}

static PetscErrorCode ReadAll(Checkpoint c)
{
  PetscReal x[64];
  PetscInt  n[3];
  char     *text;

  PetscFunctionBegin;
  PetscCall(CheckpointReadText(c, "run/stamp", &text));
  PetscCall(PetscFree(text));
  PetscCall(CheckpointReadInt(c, "run/count", 3, n));
  PetscCall(CheckpointReadReal(c, "dem/position", 64, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadCheckpoint(const char *file)
{
  Checkpoint     c;
  PetscErrorCode code;

  PetscFunctionBegin;
  code = CheckpointOpen(PETSC_COMM_SELF, file, &c);
  if (code) PetscFunctionReturn(code);
  code = ReadAll(c);
  PetscCall(CheckpointClose(&c));
  PetscFunctionReturn(code);
}

static PetscErrorCode ReadFrames(const char *file)
{
  Output         output;
  char           directory[128];
  PetscErrorCode code;

  PetscFunctionBegin;
  PetscCall(BaseFormat(directory, "%s/out", Folder()));
  code = OutputCreate(PETSC_COMM_SELF, directory, PETSC_TRUE, &output);
  if (!code) PetscCall(OutputDestroy(&output));
  PetscFunctionReturn(code);
}

static const struct {
  const char *name, *file;
  PetscErrorCode (*read)(const char *file);
} kinds[] = {
  {"scene",      "scene.yaml",      ReadScene     },
  {"packing",    "packing.csv",     ReadPacking   },
  {"stl",        "tool.stl",        ReadSurface   },
  {"msh",        "body.msh",        ReadMesh      },
  {"checkpoint", "checkpoint.h5",   ReadCheckpoint},
  {"frames",     "out/fields.h5",   ReadFrames    },
};
enum { N_KINDS = sizeof(kinds) / sizeof(kinds[0]) };

static int Kind(const char *name)
{
  for (int k = 0; k < N_KINDS; k++)
    if (!strcmp(kinds[k].name, name)) return k;
  fprintf(stderr, "no reader '%s'\n", name);
  exit(2);
}

static void Begin(void)
{
  static int begun;
  int        argc = 1;
  char      *words[] = {(char *)"fuzz", NULL}, **argv = words;
  char       out[128];

  if (begun++) return;
  if (BaseInitialize(&argc, &argv)) abort();
  BaseErrorQuiet(PETSC_TRUE);
  snprintf(out, sizeof(out), "%s/out", Folder());
  if (FileMakeDirectory(out)) abort();
}

void FuzzOne(const char *name, const unsigned char *data, size_t size, PetscBool *read)
{
  const int      kind = Kind(name);
  char           path[256];
  FILE          *file;
  PetscErrorCode code;

  Begin();
  snprintf(path, sizeof(path), "%s/%s", Folder(), kinds[kind].file);
  file = fopen(path, "wb");
  if (!file || (size && fwrite(data, 1, size, file) != size) || fclose(file)) abort();
  BaseErrorClear();
  code  = kinds[kind].read(path);
  *read = (PetscBool)!code;
  if (!code || (code == PETSC_ERR_USER_INPUT && BaseErrorMessage()[0])) return;
  fprintf(stderr, "%s: %zu bytes end in code %d: %s\n", name, size, (int)code, BaseErrorMessage());
  abort();
}

static PetscErrorCode Make(const char *name, char path[256])
{
  PetscFunctionBegin;
  if (!strcmp(name, "checkpoint")) {
    const PetscInt n[3] = {1, 2, 3};
    PetscReal      x[64];
    Checkpoint     c;

    for (int k = 0; k < 64; k++) x[k] = 1. / (k + 1);
    snprintf(path, 256, "%s/made.h5", Folder());
    PetscCall(CheckpointCreate(PETSC_COMM_SELF, path, &c));
    PetscCall(CheckpointWriteString(c, "run/stamp", "time.step: 1e-6 s\n"));
    PetscCall(CheckpointWriteInt(c, "run/count", 3, n));
    PetscCall(CheckpointWriteReal(c, "dem/position", 64, x));
    PetscCall(CheckpointClose(&c));
  } else {
    const PetscReal     x[3] = {1, 2, 3};
    const PetscInt      start[2] = {0, 1}, node[1] = {0};
    const unsigned char type[1] = {1};
    const OutputArray   array = {"displacement", "m", OUTPUT_POINT_DATA, 3, x};
    const OutputBlock   block = {"body", 1, x, 1, start, node, type, 1, &array};
    Output              output;
    char                directory[128];

    PetscCall(BaseFormat(directory, "%s/out", Folder()));
    PetscCall(OutputCreate(PETSC_COMM_SELF, directory, PETSC_FALSE, &output));
    for (PetscInt k = 0; k < 2; k++) {
      PetscCall(OutputFrameBegin(output, k * 0.1, k));
      PetscCall(OutputFrameBlock(output, &block));
      PetscCall(OutputFrameEnd(output));
    }
    PetscCall(OutputDestroy(&output));
    snprintf(path, 256, "%s/fields.h5", directory);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

unsigned char *FuzzMade(const char *name, size_t *size)
{
  char           path[256], *text;
  unsigned char *bytes;

  Begin();
  if (Make(name, path) || FileReadText(path, &text, size)) abort();
  bytes = malloc(*size + 1);
  if (!bytes) abort();
  memcpy(bytes, text, *size);
  if (PetscFree(text)) abort();
  return bytes;
}
