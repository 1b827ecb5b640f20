/* new.c - `cleave new KIND [FILE]`: commented scenes to start from. */
#include "app.h"
#include "files.h"
#include "new.h"
#include <string.h>
#include <unistd.h>

static const char elastic[] =
  "# An elastic cantilever of finite elements, loaded at its free end and solved for equilibrium.\n"
  "# cleave run FILE runs it, cleave check FILE only reads it. docs/scene.md lists every key.\n"
  "title: Elastic cantilever\n"
  "dimension: 3               # or 2, with plane: strain | stress and thickness: 50 mm\n"
  "time:\n"
  "  end: 1 s                 # static: the loads of this time\n"
  "  method: static           # or explicit: central differences in time\n"
  "materials:\n"
  "  steel: {density: 7850 kg/m3, young: 210 GPa, poisson: 0.3}\n"
  "bodies:\n"
  "  beam:\n"
  "    geometry:              # a box, or the name of a .geo or .msh file beside this one\n"
  "      box: {size: [200 mm, 20 mm, 20 mm]}   # groups: xmin xmax ymin ymax zmin zmax\n"
  "    method: fem\n"
  "    material: steel\n"
  "    mesh: {size: 5 mm, cells: hex}\n"
  "conditions:\n"
  "  - {group: xmin, fix: all}\n"
  "  - {group: xmax, traction: {z: -1 MPa}}    # 400 N in all\n"
  "output:\n"
  "  history: {quantities: [reaction(xmin), displacement(xmax)]}\n"
  "  fields: {names: [displacement, stress]}\n";

static const char wave[] =
  "# A pulse runs along a bar of finite elements and leaves through an absorbing end.\n"
  "# cleave run FILE runs it, cleave check FILE only reads it. docs/scene.md lists every key.\n"
  "title: Wave in a bar\n"
  "dimension: 2\n"
  "plane: stress\n"
  "thickness: 100 mm\n"
  "time:\n"
  "  end: 1.2 ms\n"
  "  method: explicit         # or implicit, with step: 2 us, and rho_inf: 0.8 where high frequencies should die\n"
  "materials:\n"
  "  concrete: {density: 2400 kg/m3, young: 38.4 GPa, poisson: 0}   # bar speed sqrt(E/rho) = 4000 m/s\n"
  "bodies:\n"
  "  bar:\n"
  "    geometry:\n"
  "      box: {size: [2 m, 100 mm]}              # groups: xmin xmax ymin ymax\n"
  "    method: fem\n"
  "    material: concrete\n"
  "    mesh: {size: 10 mm, cells: quad}\n"
  "conditions:\n"
  "  # 1 MPa sin^2(pi t / 100 us): smooth, 40 cells long; the far end then moves with p/(rho c) = 0.104 m/s\n"
  "  - {group: xmin, traction: {x: {table: [[0 us, 0 MPa], [10 us, 0.0955 MPa], [20 us, 0.3455 MPa], [30 us, 0.6545 MPa], [40 us, 0.9045 MPa], [50 us, 1 MPa], [60 us, 0.9045 MPa], [70 us, 0.6545 MPa], [80 us, 0.3455 MPa], [90 us, 0.0955 MPa], [100 us, 0 MPa]]}}}\n"
  "  - {group: xmax, absorb: true}               # without it the pulse comes back\n"
  "output:\n"
  "  history: {every: 4 us, quantities: [velocity(xmin), velocity(xmax)]}\n"
  "  fields: {every: 100 us, names: [displacement, velocity]}\n"
  "  plots:\n"
  "    - {x: time, y: velocity(xmax).x}\n";

static const struct {
  const char *name, *text, *beside[4]; /* beside: files the scene needs, written next to it: name, text, name, text */
} kinds[] = {
  {"elastic", elastic, {NULL}},
  {"ucs", AppNewUcs, {NULL}},
  {"triaxial", AppNewTriaxial, {NULL}},
  {"hydrostatic", AppNewHydrostatic, {NULL}},
  {"compaction", AppNewCompaction, {NULL}},
  {"brazilian", AppNewBrazilian, {"brazilian.geo", AppNewBrazilianGeo}},
  {"direct-tension", AppNewTension, {NULL}},
  {"bending", AppNewBending, {"bending.geo", AppNewBendingGeo}},
  {"notched-beam", AppNewBeam, {"beam.geo", AppNewBeamGeo, "measured.csv", AppNewBeamMeasured}},
  {"cutting", AppNewCutting, {"block.geo", AppNewCuttingGeo, "pick.geo", AppNewCuttingPick}},
  {"cutting-adaptive", AppNewCuttingTurning, {"adaptive.geo", AppNewCuttingTurningGeo, "pick.geo", AppNewCuttingPick}},
  {"cutting-3d", AppNewCuttingSolid, {"block3d.geo", AppNewBlockSolid}},
  {"disc-cutter", AppNewDisc, {"block.geo", AppNewCuttingGeo}},
  {"disc-cutter-3d", AppNewDiscSolid, {"block3d.geo", AppNewBlockSolid}},
  {"bar-impact", AppNewImpact, {"impact.geo", AppNewImpactGeo}},
  {"spall", AppNewSpall, {"spall.geo", AppNewSpallGeo}},
  {"plate-impact", AppNewPlate, {"plate.geo", AppNewPlateGeo}},
  {"overlap-wave", AppNewOverlapWave, {"wave.geo", AppNewOverlapWaveGeo}},
  {"overlap-cantilever", AppNewOverlapBeam, {"cantilever.geo", AppNewOverlapBeamGeo}},
  {"wave", wave, {NULL}},
};
enum { N_KINDS = sizeof(kinds) / sizeof(kinds[0]) };

static PetscErrorCode Write(const char *text, const char *file)
{
  FILE *out;

  PetscFunctionBegin;
  BaseCheckInput(access(file, F_OK), PETSC_COMM_SELF, "'%s' is there already; name another file", file);
  PetscCall(FileOpen(file, "w", &out));
  fputs(text, out);
  PetscCall(FileClose(&out, file));
  printf("written: %s\n", file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppNew(const AppOptions *options, int *exit_code)
{
  const char *names[N_KINDS], *near;
  char        all[512] = "";
  size_t      n        = 0;
  int         k = 0;
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (int j = 0; j < N_KINDS; j++)
    n += snprintf(all + n, sizeof(all) - n, "%s%s", n ? ", " : "", kinds[j].name);
  BaseCheckInput(options->n_words == 1 || options->n_words == 2, PETSC_COMM_WORLD, "cleave new KIND [FILE]; kinds: %s", all);
  for (int j = 0; j < N_KINDS; j++) names[j] = kinds[j].name;
  while (k < N_KINDS && strcmp(names[k], options->word[0])) k++;
  if (k == N_KINDS) {
    near = BaseNearest(options->word[0], N_KINDS, names);
    BaseCheckInput(!near, PETSC_COMM_WORLD, "no kind of scene '%s'; did you mean %s?", options->word[0], near);
    SETERRQ(PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "no kind of scene '%s'; there is %s", options->word[0], all);
  }
  *exit_code = 0;
  if (rank) PetscFunctionReturn(PETSC_SUCCESS);
  if (options->n_words == 1) fputs(kinds[k].text, stdout);
  else {
    for (int j = 0; j < 4 && kinds[k].beside[j]; j += 2) {
      const char *slash = strrchr(options->word[1], '/');
      char        path[PETSC_MAX_PATH_LEN];

      PetscCall(BaseFormat(path, "%.*s%s", slash ? (int)(slash - options->word[1] + 1) : 0, options->word[1], kinds[k].beside[j]));
      PetscCall(Write(kinds[k].beside[j + 1], path));
    }
    PetscCall(Write(kinds[k].text, options->word[1]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
