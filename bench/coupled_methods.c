/*
  coupled_methods.c - ways of joining elements and particles side by side: drift, what comes back, the step, what a step costs.

  bench/coupled_methods
  One line a method. Bodies, waves and measurement: tests/coupling/coupled.c, wave.c.
*/
#include "wave.h"
#include <stdio.h>

#define STEPS 100000

static PetscErrorCode Run(void)
{
  static const struct {
    const char     *name;
    CouplingOptions options;
  } ways[] = {{"energy", {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1}},
              {"energy, absorber", {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1, .absorber = PETSC_TRUE}},
              {"consistent", {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1, .method = COUPLING_CONSISTENT}},
              {"penalty 0.3", {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1, .method = COUPLING_PENALTY, .penalty = 0.3}},
              {"penalty 0.1", {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1, .method = COUPLING_PENALTY, .penalty = 0.1}},
              {"penalty 1", {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1, .method = COUPLING_PENALTY, .penalty = 1}}};
  static const PetscReal lambda[] = {2.5, 4, 5, 6, 8, 10, 20};
  PetscReal              first = 0;

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(ways) / sizeof(ways[0]); k++) {
    CouplingOptions rest = ways[k].options;
    PetscReal       off, drift, step, seconds, energy, dt;

    rest.preload = PETSC_TRUE;
    PetscCall(CoupledRest(&rest, STEPS, &off, &drift, &step, &seconds));
    if (k == 0) first = seconds;
    printf("| %s | %.1e | %.1e | %.4f | %.2f |", ways[k].name, (double)off, (double)drift, (double)step, (double)(seconds / first));
    for (size_t i = 0; i < sizeof(lambda) / sizeof(lambda[0]); i++) {
      PetscCall(WaveReflect(lambda[i], 2, &ways[k].options, &energy, &dt));
      printf(" %.1e |", (double)energy);
    }
    printf("\n");
    fflush(stdout);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscErrorCode ierr;

  if (BaseInitialize(&argc, &argv)) return 1;
  ierr = Run();
  return BaseFinalize() || ierr ? 1 : 0;
}
