/* Recovered stress knows no axes: a body and its motion turned by any rotation have the same stress, turned. Eqs (2.90)-(2.93) */
#include "recover_case.h"

static PetscReal turn[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

/* About (1, 1, 1)/sqrt 3 by 0.7, in the plane about z. */
static void Turn(PetscInt dim)
{
  const PetscReal c = PetscCosReal(0.7), s = PetscSinReal(0.7), k = 1 / PetscSqrtReal(3);

  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) {
      if (dim == 3) turn[i][j] = i == j ? c + k * k * (1 - c) : k * k * (1 - c) + ((j - i + 3) % 3 == 1 ? -k * s : k * s);
      else turn[i][j] = i == 2 || j == 2 ? i == j : i == j ? c : i ? s : -s;
    }
}

/* No polynomial: recovery is not exact, so that only its own indifference makes both agree. */
static void Field(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * exp(x[0]) * cos(2 * x[1] + x[2]);
  u[1] = 1e-3 * sin(3 * x[0]) * exp(x[1] - x[2]);
  u[2] = 1e-3 * cos(x[0] + 2 * x[2]) * x[1];
}

static void Turned(const PetscReal x[3], PetscReal u[3])
{
  PetscReal at[3] = {0, 0, 0}, w[3];

  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) at[i] += turn[j][i] * x[j];
  Field(at, w);
  if (turn[2][2] == 1) w[2] = 0;
  for (PetscInt i = 0; i < 3; i++) {
    u[i] = 0;
    for (PetscInt j = 0; j < 3; j++) u[i] += turn[i][j] * w[j];
  }
}

static PetscErrorCode Stress(MeshCellType type, PetscBool turned, PetscInt *points, PetscReal **stress)
{
  const PetscReal length[3] = {1, 0.7, 0.8};
  const PetscInt  n[3]      = {3, 3, 2};
  Mesh            mesh;
  FemModel        model;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, 0.15, &mesh));
  for (PetscInt i = 0; i < mesh.n_nodes && turned; i++) {
    const PetscReal x[3] = {mesh.x[3 * i], mesh.x[3 * i + 1], mesh.x[3 * i + 2]};

    for (PetscInt d = 0; d < 3; d++) mesh.x[3 * i + d] = turn[d][0] * x[0] + turn[d][1] * x[1] + turn[d][2] * x[2];
  }
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, RecoverKind(type), FEM_EXPLICIT, 1, &recover_steel, &model));
  PetscCall(FemModelSetUp(model));
  PetscCall(RecoverImpose(model, turned ? Turned : Field));
  PetscCall(FemModelGetPoints(model, points, NULL));
  PetscCall(PetscMalloc1(6 * *points, stress));
  PetscCall(FemModelRecover(model, *stress, NULL));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestStressTurnsWithTheBody(void)
{
  static const MeshCellType types[]     = {MESH_TRI3, MESH_QUAD4, MESH_TRI6, MESH_QUAD9, MESH_TET4, MESH_HEX8, MESH_PRISM6, MESH_TET10, MESH_HEX20, MESH_HEX27, MESH_PRISM18};
  static const PetscInt     voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};

  PetscFunctionBeginUser;
  for (size_t t = 0; t < sizeof(types) / sizeof(types[0]); t++) {
    PetscReal *here, *there, largest = 0;
    PetscInt   n, m;

    Turn(MeshCellDim(types[t]));
    PetscCall(Stress(types[t], PETSC_FALSE, &n, &here));
    PetscCall(Stress(types[t], PETSC_TRUE, &m, &there));
    CheckInt(m, n);
    for (PetscInt k = 0; k < 6 * n; k++) largest = PetscMax(largest, PetscAbsReal(here[k]));
    CheckAbove(largest, 1e7);
    for (PetscInt p = 0; p < n; p++)
      for (PetscInt i = 0; i < 3; i++)
        for (PetscInt j = 0; j < 3; j++) {
          PetscReal want = 0;

          for (PetscInt k = 0; k < 3; k++)
            for (PetscInt l = 0; l < 3; l++) want += turn[i][k] * here[6 * p + voigt[k][l]] * turn[j][l];
          CheckNear(there[6 * p + voigt[i][j]], want, 1e-9 * largest);
        }
    PetscCall(PetscFree(here));
    PetscCall(PetscFree(there));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestStressTurnsWithTheBody)

static const struct CMUnitTest tests[] = {TEST(TestStressTurnsWithTheBody)};
CHECK_MAIN(tests)
