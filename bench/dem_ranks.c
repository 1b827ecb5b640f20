/*
  dem_ranks.c - a step of bonded particles on all ranks beside the same on one.

  mpiexec -n 2 bench_dem_ranks [-particles 60000] [-steps 5] [-repeats 20]
  A cube on a jittered lattice with a strength, strained to a fifth of it, as `cohesive` of dem_bonds.c. In turn rank 0 steps the whole body
  while the others wait, and all ranks step their parts; best of the repeats. A row of CSV: ranks, particles, bonds, ns per bond-step on one rank and on
  all, their ratio; particles and bonds of the fullest rank over those of the body.
*/
#include "dem.h"
#include <petsctime.h>

static PetscReal Random(uint64_t *state)
{
  uint64_t z = (*state += 0x9e3779b97f4a7c15ULL);

  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  z ^= z >> 31;
  return (PetscReal)(z >> 11) / 9007199254740992.0;
}

static PetscErrorCode Body(PetscInt n, DemBody *body, DemPacking *packing, DemCells *cells)
{
  const PetscInt  side = (PetscInt)(PetscPowReal(n, 1.0 / 3) + 0.5);
  const PetscReal low[3] = {0}, high[3] = {side, side, side};
  uint64_t        seed = 5;

  PetscFunctionBeginUser;
  PetscCall(DemBodyCreateBox(3, low, high, 1, body));
  packing->n = side * side * side;
  PetscCall(PetscCalloc1(3 * packing->n, &packing->x));
  PetscCall(PetscMalloc1(packing->n, &packing->r));
  for (PetscInt k = 0; k < packing->n; k++) {
    const PetscInt at[3] = {k % side, k / side % side, k / (side * side)};

    for (PetscInt d = 0; d < 3; d++) packing->x[3 * k + d] = at[d] + 0.5 + 0.33 * (2 * Random(&seed) - 1);
    packing->r[k] = 0.4;
  }
  PetscCall(DemCellsCreate(body, packing, cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Model(MPI_Comm comm, const DemBody *body, const DemPacking *packing, const DemCells *cells, DemModel *model)
{
  const DemMaterial material = {.density = 1, .young = 1, .poisson = 0.2};
  const DemStrength strength = {.tensile = 1e-6, .fracture_energy = 1e-9, .softening = DEM_SOFTENING_LINEAR, .shear = 2e-6, .shear_energy = 1e-9, .mu_static = 0.5, .mu_dynamic = 0.5};
  DemState          s;

  PetscFunctionBeginUser;
  PetscCall(DemModelCreate(comm, model));
  PetscCall(DemModelSetKind(*model, DEM_SOLID));
  PetscCall(DemModelSetMaterial(*model, &material));
  PetscCall(DemModelSetStrength(*model, &strength));
  PetscCall(DemModelSetBody(*model, body, packing, cells));
  PetscCall(DemModelSetUp(*model));
  PetscCall(DemModelGetState(*model, &s));
  for (PetscInt p = 0; p < s.own; p++) s.u[p] = 0.2e-6 * s.x0[p];
  PetscCall(DemModelRestoreState(*model, &s));
  PetscCall(DemModelComputeForces(*model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Steps(DemModel model, PetscInt steps, PetscReal dt)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < steps; k++) {
    PetscCall(DemModelAdvance(model, 0, 1e-6 * dt)); /* strained, and as good as at rest */
    PetscCall(DemModelEvaluate(model, 1e-6 * dt));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Run(void)
{
  PetscInt       n = 60000, steps = 5, repeats = 20, particles, bonds;
  PetscReal      one = PETSC_MAX_REAL, all = PETSC_MAX_REAL, dt, most[2];
  DemBody        body;
  DemPacking     packing = {0};
  DemCells       cells;
  DemModel       whole = NULL, part;
  DemShare       share;
  PetscMPIInt    rank, size;
  PetscLogDouble begin, end;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-particles", &n, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-steps", &steps, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-repeats", &repeats, NULL));
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(Body(n, &body, &packing, &cells));
  PetscCall(Model(PETSC_COMM_WORLD, &body, &packing, &cells, &part));
  if (!rank) PetscCall(Model(PETSC_COMM_SELF, &body, &packing, &cells, &whole));
  PetscCall(DemCellsDestroy(&cells));
  PetscCall(DemPackingDestroy(&packing));
  PetscCall(DemModelGetCounts(part, &particles, &bonds, NULL));
  PetscCall(DemModelGetShare(part, &share));
  PetscCall(DemModelGetCriticalStep(part, &dt));
  for (PetscInt r = -1; r < repeats; r++) { /* one to warm up */
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    PetscCall(PetscTime(&begin));
    if (whole) PetscCall(Steps(whole, steps, dt));
    PetscCall(PetscTime(&end));
    if (r >= 0) one = PetscMin(one, (end - begin) / steps);
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    PetscCall(PetscTime(&begin));
    PetscCall(Steps(part, steps, dt));
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    PetscCall(PetscTime(&end));
    if (r >= 0) all = PetscMin(all, (end - begin) / steps);
  }
  most[0] = (PetscReal)(share.own + share.ghosts) / particles;
  most[1] = (PetscReal)share.bonds / bonds;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 2, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "ranks,particles,bonds,ns per bond-step on one,on all,ratio,particles of the fullest,bonds of the fullest\n%d,%d,%d,%.2f,%.2f,%.3f,%.3f,%.3f\n", (int)size, (int)particles, (int)bonds,
                        (double)(1e9 * one / bonds), (double)(1e9 * all / bonds), (double)(one / all), (double)most[0], (double)most[1]));
  if (whole) PetscCall(DemModelDestroy(&whole));
  PetscCall(DemModelDestroy(&part));
  PetscCall(DemBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscErrorCode code;

  if (BaseInitialize(&argc, &argv)) return 1;
  code = Run();
  if (BaseFinalize() || code) return 1;
  return 0;
}
