/* new.c - `cleave new KIND [FILE]`: commented scenes to start from. */
#include "app.h"
#include "files.h"
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

static const char ucs[] =
  "# A cylinder of bonded particles between smooth platens, pressed slowly: E and nu come out of the history.\n"
  "# The material is elastic: failure laws are not covered yet (docs/not-yet.md). docs/scene.md lists every key.\n"
  "title: Uniaxial compression, elastic\n"
  "time:\n"
  "  end: 1 ms\n"
  "  safety: 0.9              # of the largest stable step\n"
  "materials:\n"
  "  rock: {density: 2500 kg/m3, young: 30 GPa, poisson: 0.2, local_damping: 0.1}\n"
  "bodies:\n"
  "  sample:\n"
  "    geometry:\n"
  "      cylinder: {radius: 25 mm, height: 100 mm}   # axis z; groups: bottom top side\n"
  "    method: dem\n"
  "    material: rock\n"
  "    dem:\n"
  "      packing: {radius: 3 mm, spread: 0.2, seed: 1}\n"
  "conditions:\n"
  "  - {group: bottom, fix: z}                        # smooth: the face slides on its platen\n"
  "  - {group: top, velocity: {z: {ramp: {to: -20 mm/s, over: 0.5 ms}}}}\n"
  "output:\n"
  "  history: {every: 10 us, quantities: [reaction(top), displacement(top)]}\n"
  "  fields: {every: 0.5 ms, names: [displacement, stress]}\n"
  "  plots:\n"
  "    - {x: displacement(top).z, y: reaction(top).z}\n";

static const struct {
  const char *name, *text;
} kinds[] = {
  {"elastic", elastic}, {"ucs", ucs}, {"triaxial", NULL}, {"brazilian", NULL}, {"hydrostatic", NULL}, {"direct-tension", NULL}, {"notched-beam", NULL}, {"cutting", NULL}, {"wave", NULL},
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
  int         k = 0;
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  BaseCheckInput(options->n_words == 1 || options->n_words == 2, PETSC_COMM_WORLD, "cleave new KIND [FILE]; kinds: elastic, ucs");
  for (int j = 0; j < N_KINDS; j++) names[j] = kinds[j].name;
  while (k < N_KINDS && strcmp(names[k], options->word[0])) k++;
  if (k == N_KINDS) {
    near = BaseNearest(options->word[0], N_KINDS, names);
    BaseCheckInput(!near, PETSC_COMM_WORLD, "no kind of scene '%s'; did you mean %s?", options->word[0], near);
    SETERRQ(PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "no kind of scene '%s'; there is elastic, ucs", options->word[0]);
  }
  BaseCheckInput(kinds[k].text, PETSC_COMM_WORLD, "a scene of kind %s is not covered yet, see docs/not-yet.md; there is elastic, ucs", kinds[k].name);
  *exit_code = 0;
  if (rank) PetscFunctionReturn(PETSC_SUCCESS);
  if (options->n_words == 1) fputs(kinds[k].text, stdout);
  else PetscCall(Write(kinds[k].text, options->word[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
