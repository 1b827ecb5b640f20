/*
  fem_operator.c - processor time per element and step of explicit runs: in lanes (hex8), by assembled rows, element by element.

  bench/fem_operator [cells a side, default 40] [steps, default 200] [threads, default 1] [file.geo]
  -twin R: stop with an error unless lanes take less than R times what element by element takes, each the best of its repeats, turn by turn.
  Boxes of hex8 and of tet4 (Kuhn), and the tetrahedra gmsh makes of file.geo when one is given. Prints medians of five.
*/
#include "fem.h"
#include <petsctime.h>
#include <stdlib.h>
#include <time.h>

static int ByReal(const void *a, const void *b)
{
  const PetscReal p = *(const PetscReal *)a, q = *(const PetscReal *)b;

  return p < q ? -1 : p > q;
}

static PetscErrorCode Time(const Mesh *mesh, const char *what, const char *way, PetscInt steps, PetscInt threads, PetscReal *best)
{
  const FemMaterial m    = {2400, 30e9, 0.2};
  const PetscReal   v[3] = {1, 2, 3};
  FemModel          model;
  Stepper           s;
  PetscLogDouble    begin, end, setup;
  PetscReal         dt, seconds[5];
  PetscInt          nodes, cells;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsSetValue(NULL, "-fem_elements", way[0] == 'e' ? "1" : "0"));
  PetscCall(PetscOptionsSetValue(NULL, "-fem_batches", way[0] == 'l' ? "1" : "0"));
  PetscCall(PetscTime(&begin));
  PetscCall(FemModelCreate(PETSC_COMM_WORLD, &model));
  PetscCall(FemModelSetKind(model, FEM_SOLID, 1));
  PetscCall(FemModelSetMethod(model, FEM_EXPLICIT));
  PetscCall(FemModelSetThreads(model, threads));
  PetscCall(FemModelSetMesh(model, mesh));
  PetscCall(FemModelAddMaterial(model, "", &m));
  PetscCall(FemModelSetInitialVelocity(model, v));
  PetscCall(FemModelSetUp(model));
  PetscCall(PetscTime(&setup));
  PetscCall(FemModelGetStableStep(model, &dt));
  PetscCall(PetscTime(&end));
  setup -= begin;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%-14s %-9s set-up %.2f s, stable step %.2f s, ", what, way, setup, end - begin - setup));
  PetscCall(FemModelGetCounts(model, &nodes, &cells, NULL));
  PetscCall(FemModelGetStepper(model, &s));
  for (PetscInt k = 0; k < 5; k++) {
    begin = (PetscLogDouble)clock() / CLOCKS_PER_SEC;
    for (PetscInt j = 0; j < steps; j++) PetscCall(s.step(s.ctx, (k * steps + j) * dt, dt));
    end = (PetscLogDouble)clock() / CLOCKS_PER_SEC;
    seconds[k] = end - begin;
  }
  for (PetscInt k = 0; k < 5; k++) *best = PetscMin(*best, seconds[k]);
  qsort(seconds, 5, sizeof(PetscReal), ByReal);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%d nodes, %d elements: %.4f us per element and step\n", (int)nodes, (int)cells, (double)(1e6 * seconds[2] / steps / cells)));
  PetscCall(FemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Both(Mesh *mesh, const char *what, PetscInt steps, PetscInt threads)
{
  PetscReal lanes = PETSC_MAX_REAL, rows = PETSC_MAX_REAL, elements = PETSC_MAX_REAL, twin = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-twin", &twin, NULL));
  PetscCall(Time(mesh, what, "lanes", steps, threads, &lanes));
  PetscCall(Time(mesh, what, "rows", steps, threads, &rows));
  PetscCall(Time(mesh, what, "elements", steps, threads, &elements));
  if (twin > 0) PetscCall(Time(mesh, what, "lanes", steps, threads, &lanes)); /* once before and once after: what else runs hurts both */
  PetscCall(MeshDestroy(mesh));
  PetscCheck(twin <= 0 || lanes < twin * elements, PETSC_COMM_WORLD, PETSC_ERR_PLIB, "%s: lanes take %.2f of what element by element takes, %.2f expected at most", what, (double)(lanes / elements), (double)twin);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%-14s lanes / elements %.2f\n", what, (double)(lanes / elements)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const PetscReal origin[3] = {0, 0, 0}, length[3] = {1, 1, 1};
  PetscInt        side, steps, threads, n[3];
  Mesh            mesh;

  PetscCall(BaseInitialize(&argc, &argv));
  PetscFunctionBeginUser;
  side    = argc > 1 ? atoi(argv[1]) : 40;
  steps   = argc > 2 ? atoi(argv[2]) : 200;
  threads = argc > 3 ? atoi(argv[3]) : 1;
  n[0] = n[1] = n[2] = side;
  PetscCall(MeshCreateBox(PETSC_COMM_WORLD, "body", MESH_HEX8, origin, length, n, &mesh));
  PetscCall(Both(&mesh, "hex8 box", steps, threads));
  PetscCall(MeshCreateBox(PETSC_COMM_WORLD, "body", MESH_TET4, origin, length, n, &mesh));
  PetscCall(Both(&mesh, "tet4 box", steps, threads));
  if (argc > 4 && argv[4][0] != '-') {
    const MeshOptions options = {3, 1.0 / side, 1, 1, PETSC_FALSE};

    PetscCall(MeshRead(PETSC_COMM_WORLD, argv[4], &options, &mesh));
    PetscCall(Both(&mesh, "tet4 gmsh", steps, threads));
  }
  PetscFunctionReturn(BaseFinalize());
}
