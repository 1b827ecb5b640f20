/*
  fem_static.c - seconds, iterations and tip of a cantilever (8 x 1 x 1, end shear), set-up and one solve.

  bench/fem_static [cells across, default 16] [gmsh type, 5 = hex8, 4 = tet4, 11 = tet10] [Poisson's ratio, default 0.3] [PETSC OPTIONS, such as -fem_pc_type gamg]
*/
#include "fem.h"
#include <petsctime.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
  const PetscReal   origin[3] = {0, 0, 0}, length[3] = {8, 1, 1}, up[3] = {0, 0, 1};
  const FemMaterial m         = {7850, 210e9, argc > 3 && argv[3][0] != '-' ? atof(argv[3]) : 0.3};
  PetscLogDouble    t[4], memory;
  PetscReal         tip;
  PetscInt          n[3], dofs;
  FemReadings       readings;
  FemModel          model;
  Stepper           s;
  Table             load, zero;
  Mesh              mesh;

  PetscCall(BaseInitialize(&argc, &argv));
  PetscFunctionBeginUser;
  n[1] = n[2] = argc > 1 ? atoi(argv[1]) : 16;
  n[0] = 8 * n[1];
  PetscCall(TableCreateConstant(1e6, &load));
  PetscCall(TableCreateConstant(0, &zero));
  PetscCall(MeshCreateBox(PETSC_COMM_WORLD, "body", argc > 2 ? (MeshCellType)atoi(argv[2]) : MESH_HEX8, origin, length, n, &mesh));
  PetscCall(PetscTime(&t[0]));
  PetscCall(FemModelCreate(PETSC_COMM_WORLD, &model));
  PetscCall(FemModelSetMesh(model, &mesh));
  PetscCall(FemModelAddMaterial(model, "", &m));
  for (PetscInt d = 0; d < 3; d++) PetscCall(FemModelFix(model, "xmin", d, FEM_DISPLACEMENT, &zero));
  PetscCall(FemModelAddTraction(model, "xmax", up, &load));
  PetscCall(FemModelAddHistory(model, "displacement", "xmax"));
  PetscCall(PetscTime(&t[1]));
  PetscCall(FemModelSetUp(model));
  PetscCall(PetscTime(&t[2]));
  PetscCall(FemModelGetStepper(model, &s));
  PetscCall(s.step(s.ctx, 0, 1));
  PetscCall(PetscTime(&t[3]));
  PetscCall(s.history(s.ctx, 2, &tip));
  PetscCall(FemModelGetCounts(model, NULL, NULL, &dofs));
  PetscCall(FemModelGetReadings(model, &readings));
  PetscCall(PetscMemoryGetCurrentUsage(&memory));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%d unknowns: mesh %.2f s, set-up %.2f s, factor and solve %.2f s, %d iterations, tip %.9g m, memory now %.0f MiB on rank 0\n", (int)dofs, t[1] - t[0], t[2] - t[1], t[3] - t[2], (int)readings.iterations, (double)tip, memory / 1048576));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscCall(TableDestroy(&load));
  PetscCall(TableDestroy(&zero));
  PetscFunctionReturn(BaseFinalize());
}
