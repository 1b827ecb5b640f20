/*
  dem_contacts.c - time of a step of loose spheres in contact: ninja bench_dem_contacts && ./tests/dem/bench_dem_contacts

  A periodic cubic lattice, every sphere pressed against its six neighbours and shaken, Hertz and Mindlin with friction
  and restitution. Prints the least processor time of several runs (all threads together), per step, per contact and step, per particle and step.
*/
#include "dem.h"
#include <time.h>

/* Processor time of this process: a busy machine adds little to it. */
static PetscReal Seconds(void)
{
  struct timespec t;

  (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (PetscReal)t.tv_sec + 1e-9 * (PetscReal)t.tv_nsec;
}

int main(int argc, char **argv)
{
  PetscInt          side = 27, repeats = 10, steps = 20, threads = 1, n;
  PetscReal         size, dt, best = PETSC_MAX_REAL;
  DemBody           body;
  DemPacking        packing = {0};
  DemModel          model;
  DemState          state;
  Stepper           stepper;
  DemContactCounts  counts;
  const DemMaterial glass = {.density = 2500, .young = 1e9, .poisson = 0.25};
  DemContactOptions o = {.choice = {.law = DEM_CONTACT_HERTZ, .restitution = 0.9, .friction = 0.3}, .domain = DEM_DOMAIN_OPEN, .push = PETSC_TRUE, .deepest = 0.2};

  PetscCall(BaseInitialize(&argc, &argv));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-side", &side, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-repeats", &repeats, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-steps", &steps, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-threads", &threads, NULL));
  n    = side * side * side;
  size = (PetscReal)side * 1.99e-3;
  PetscCall(DemBodyCreateBox(3, (PetscReal[3]){0, 0, 0}, (PetscReal[3]){size, size, size}, 1, &body));
  packing.n = n;
  PetscCall(PetscMalloc1(3 * n, &packing.x));
  PetscCall(PetscMalloc1(n, &packing.r));
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt cell[3] = {k % side, k / side % side, k / side / side};

    packing.r[k] = 1e-3;
    for (PetscInt d = 0; d < 3; d++) packing.x[3 * k + d] = 1.99e-3 * ((PetscReal)cell[d] + 0.5);
  }
  PetscCall(DemModelCreate(PETSC_COMM_SELF, &model));
  PetscCall(DemModelSetKind(model, DEM_SOLID));
  PetscCall(DemModelSetThreads(model, threads));
  PetscCall(DemModelSetMaterial(model, &glass));
  PetscCall(DemModelSetBonded(model, PETSC_FALSE));
  PetscCall(DemModelSetBody(model, &body, &packing, NULL));
  PetscCall(DemModelSetContact(model, &o));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetState(model, &state));
  for (PetscInt i = 0; i < 3 * n; i++) state.v[i] = 1e-3 * (PetscReal)((i * 7919) % 13 - 6);
  PetscCall(DemModelRestoreState(model, &state));
  PetscCall(DemModelGetStableStep(model, &dt));
  dt *= 0.01; /* too short for a contact to open: what is timed is contacts */
  PetscCall(DemModelGetStepper(model, &stepper));
  for (PetscInt r = 0; r < repeats; r++) {
    const PetscReal begin = Seconds();

    for (PetscInt k = 0; k < steps; k++) PetscCall(stepper.step(model, (PetscReal)(r * steps + k) * dt, dt));
    best = PetscMin(best, (Seconds() - begin) / (PetscReal)steps);
  }
  PetscCall(DemModelGetContactCounts(model, &counts));
  printf("%d spheres, %d contacts of %d pairs, %d threads: step %.3f ms, %.4f us per contact and step, %.4f us per sphere and step\n", (int)n, (int)counts.touching, (int)counts.pairs, (int)threads, 1e3 * best,
         1e6 * best / (PetscReal)counts.touching, 1e6 * best / (PetscReal)n);
  PetscCall(DemModelDestroy(&model));
  PetscCall(DemPackingDestroy(&packing));
  PetscCall(DemBodyDestroy(&body));
  return (int)BaseFinalize();
}
