/* Eigenfrequencies on all ranks together and on one alone: the same, held or free, in the plane and in space; so are the shapes.  Theory 2.12 */
#include "fem_case.h"
#include "fem_modal.h"

#define COUNT 9

/* No two modes of this body are alike: 1 x 0.7 x 0.4, its nodes moved about. */
static PetscErrorCode Modes(MPI_Comm comm, MeshCellType type, PetscBool held, PetscReal frequency[COUNT], PetscReal *shape)
{
  const FemMaterial m         = {2400, 30e9, 0.2};
  const PetscReal   length[3] = {1, 0.7, 0.4};
  const PetscInt    n[3]      = {6, 5, 4};
  Mesh              mesh;
  FemModel          model;
  FemModal          modes;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(comm, type, length, n, 0.2, &mesh));
  PetscCall(CaseModel(comm, &mesh, MeshCellDim(type) == 3 ? FEM_SOLID : FEM_PLANE_STRESS, FEM_MODAL, 0.1, &m, &model));
  for (PetscInt d = 0; d < MeshCellDim(type) && held; d++) PetscCall(CaseFix(model, "xmin", d, 0));
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModalSolve(model, COUNT, -1, &modes));
  for (PetscInt j = 0; j < COUNT; j++) frequency[j] = modes.frequency[j];
  PetscCall(FemModalShow(model, &modes, COUNT - 1));
  PetscCall(FemModelGetField(model, "displacement", shape));
  PetscCall(FemModalDestroy(&modes));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestModesAgree(void)
{
  const MeshCellType types[4] = {MESH_QUAD4, MESH_TRI6, MESH_HEX8, MESH_TET4};
  PetscMPIInt        rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (PetscInt t = 0; t < 8; t++) {
    PetscReal all[COUNT], alone[COUNT], *shape[2], worst[2] = {0, 0};

    PetscCall(PetscCalloc2(6000, &shape[0], 6000, &shape[1]));
    PetscCall(Modes(PETSC_COMM_WORLD, types[t % 4], t / 4 ? PETSC_FALSE : PETSC_TRUE, all, shape[0]));
    if (rank == 0) {
      PetscCall(Modes(PETSC_COMM_SELF, types[t % 4], t / 4 ? PETSC_FALSE : PETSC_TRUE, alone, shape[1]));
      for (PetscInt j = 0; j < COUNT; j++) worst[0] = PetscMax(worst[0], PetscAbsReal(all[j] - alone[j]) / alone[COUNT - 1]);
      for (PetscInt k = 0; k < 6000; k++) worst[1] = PetscMax(worst[1], PetscAbsReal(shape[0][k] - shape[1][k]));
      printf("  gmsh type %d, %s: frequencies differ by %.1e, the last shape by %.1e\n", (int)types[t % 4], t / 4 ? "free" : "held", (double)worst[0], (double)worst[1]);
    }
    PetscCallMPI(MPI_Bcast(worst, 2, MPIU_REAL, 0, PETSC_COMM_WORLD)); /* every rank fails together */
    CheckBelow(worst[0], 1e-10);
    CheckBelow(worst[1], 1e-6); /* a shape is known to the root of what its frequency is */
    PetscCall(PetscFree2(shape[0], shape[1]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestModesAgree)

static const struct CMUnitTest tests[] = {TEST(TestModesAgree)};
CHECK_MAIN(tests)
