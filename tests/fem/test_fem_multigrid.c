/* Two-level multigrid without a matrix against a Cholesky factor, on any number of ranks; how many iterations it takes. */
#include <petscpc.h>
#include "fem_case.h"

/* Turned about (1, 1, 1) by 0.7: planes of symmetry then lie across the axes (a plane body turns in its plane). */
static void TurnMesh(Mesh *mesh, PetscInt dim)
{
  const PetscReal c = PetscCosReal(0.7), s = PetscSinReal(0.7), k = 1 / PetscSqrtReal(3);
  PetscReal       R[3][3] = {{c, -s, 0}, {s, c, 0}, {0, 0, 1}};

  for (PetscInt i = 0; i < 3 && dim == 3; i++)
    for (PetscInt j = 0; j < 3; j++) R[i][j] = i == j ? c + k * k * (1 - c) : k * k * (1 - c) + ((j - i + 3) % 3 == 1 ? -k * s : k * s);
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    const PetscReal x[3] = {mesh->x[3 * i], mesh->x[3 * i + 1], mesh->x[3 * i + 2]};

    for (PetscInt d = 0; d < 3; d++) mesh->x[3 * i + d] = R[d][0] * x[0] + R[d][1] * x[1] + R[d][2] * x[2];
  }
}

/* Cells of the body on either side of the middle into groups "left" and "right" (rank 0). */
static PetscErrorCode HalveBody(Mesh *mesh, PetscReal middle)
{
  MeshGroup *left = NULL, *right;
  PetscInt   n = 0, m = 0;

  PetscFunctionBeginUser;
  if (!mesh->n_groups) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscRealloc(sizeof(MeshGroup) * (mesh->n_groups + 1), &mesh->group));
  left   = &mesh->group[mesh->n_groups - 1];
  right  = &mesh->group[mesh->n_groups++];
  *right = *left;
  PetscCall(PetscStrncpy(left->name, "left", sizeof(left->name)));
  PetscCall(PetscStrncpy(right->name, "right", sizeof(right->name)));
  PetscCall(PetscMalloc1(left->n_cells, &right->cell));
  for (PetscInt k = 0; k < left->n_cells; k++) {
    const PetscInt c = left->cell[k];

    if (mesh->x[3 * mesh->node[mesh->start[c]]] < middle) left->cell[n++] = c;
    else right->cell[m++] = c;
  }
  left->n_cells  = n;
  right->n_cells = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A bar of two materials, one of them orthotropic where `orthotropic`; held on inclined planes of symmetry, or where it stands and
   moved at one end. One solve with these options; u [nodes][3] on rank 0. */
static PetscErrorCode Bar(const Mesh *mesh, PetscInt dim, PetscReal poisson, PetscBool inclined, PetscBool orthotropic, const char *pc, PetscReal *u, PetscInt *iterations)
{
  FemMaterial  soft = {2400, 30e9, poisson}, stiff = {7850, 210e9, 0.3};
  FemReadings  readings;
  FemModel     model;

  PetscFunctionBeginUser;
  if (orthotropic) stiff = (FemMaterial){7850, 0, 0, PETSC_TRUE, {100e9, 40e9, 60e9}, {0.25, 0.2, 0.3}, {20e9, 15e9, 25e9}, {{1, 0.3, 0}, {0, 1, 0}}};
  PetscCall(PetscOptionsSetValue(NULL, "-fem_pc_type", pc));
  PetscCall(FemModelCreate(PETSC_COMM_WORLD, &model));
  PetscCall(FemModelSetKind(model, dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, 0.1));
  PetscCall(FemModelSetMethod(model, FEM_STATIC));
  PetscCall(FemModelSetMesh(model, mesh));
  PetscCall(FemModelAddMaterial(model, "left", &soft));
  PetscCall(FemModelAddMaterial(model, "right", &stiff));
  if (inclined) {
    PetscCall(FemModelSetSymmetry(model, "xmin"));
    PetscCall(FemModelSetSymmetry(model, "ymin"));
    if (dim == 3) PetscCall(FemModelSetSymmetry(model, "zmin"));
  } else {
    for (PetscInt d = 0; d < dim; d++) PetscCall(CaseFix(model, "xmin", d, 0));
    PetscCall(CaseFix(model, "xmax", 1, 1e-4)); /* held in part, and moved */
  }
  PetscCall(CaseTraction(model, "xmax", 1e6, 0, dim == 3 ? 2e5 : 0));
  PetscCall(CaseSolve(model));
  PetscCall(FemModelGetField(model, "displacement", u));
  PetscCall(FemModelGetReadings(model, &readings));
  *iterations = readings.iterations;
  PetscCall(FemModelDestroy(&model));
  PetscCall(PetscOptionsClearValue(NULL, "-fem_pc_type"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Compare(MeshCellType type, PetscReal poisson, PetscBool inclined, PetscBool orthotropic)
{
  const PetscReal length[3] = {3, 1, 1};
  const PetscInt  dim = MeshCellDim(type), n[3] = {6, 3, dim == 3 ? 2 : 0};
  PetscInt        iterations = 0, nodes;
  PetscReal      *u[2], largest = 0;
  Mesh            mesh;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_WORLD, type, length, n, inclined ? 0 : 0.25, &mesh));
  PetscCall(HalveBody(&mesh, 1.4));
  if (inclined) TurnMesh(&mesh, dim);
  nodes = mesh.n_nodes;
  for (PetscInt k = 0; k < 2; k++) {
    PetscCall(PetscMalloc1(3 * nodes, &u[k]));
    PetscCall(Bar(&mesh, dim, poisson, inclined, orthotropic, k ? PCMG : PCCHOLESKY, u[k], &iterations));
  }
  CheckAbove(iterations, 5); /* the last was iterative */
  CheckBelow(iterations, 150);
  for (PetscInt i = 0; i < 3 * nodes; i++) largest = PetscMax(largest, PetscAbsReal(u[0][i]));
  for (PetscInt i = 0; i < 3 * nodes; i++) CheckNear(u[1][i], u[0][i], 1e-8 * largest);
  PetscCall(PetscFree(u[0]));
  PetscCall(PetscFree(u[1]));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestEveryShapeAgreesWithFactor(void)
{
  const MeshCellType type[] = {MESH_TRI6, MESH_QUAD8, MESH_QUAD9, MESH_TET10, MESH_HEX20, MESH_HEX27, MESH_PRISM15, MESH_PRISM18};

  PetscFunctionBeginUser;
  for (size_t t = 0; t < sizeof(type) / sizeof(type[0]); t++) PetscCall(Compare(type[t], 0.3, PETSC_FALSE, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestNearlyIncompressibleAgrees(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(MESH_TET10, 0.45, PETSC_FALSE, PETSC_FALSE));
  PetscCall(Compare(MESH_HEX27, 0.45, PETSC_FALSE, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestInclinedPlanesAgree(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(MESH_TET10, 0.3, PETSC_TRUE, PETSC_FALSE));
  PetscCall(Compare(MESH_HEX20, 0.3, PETSC_TRUE, PETSC_FALSE));
  PetscCall(Compare(MESH_QUAD8, 0.45, PETSC_TRUE, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestOrthotropicAgrees(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(MESH_TET10, 0.3, PETSC_FALSE, PETSC_TRUE));
  PetscCall(Compare(MESH_HEX20, 0.3, PETSC_FALSE, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A cube of tet10, refined twice: hardly more iterations. */
static PetscErrorCode TestIterationsDoNotGrow(void)
{
  const PetscReal length[3] = {1, 1, 1};
  PetscInt        iterations[3];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 3; k++) {
    const PetscInt n[3] = {3 << k, 3 << k, 3 << k};
    PetscReal     *u;
    Mesh           mesh;

    PetscCall(CaseBox(PETSC_COMM_WORLD, MESH_TET10, length, n, 0, &mesh));
    PetscCall(HalveBody(&mesh, 0.5));
    PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
    PetscCall(Bar(&mesh, 3, 0.3, PETSC_FALSE, PETSC_FALSE, PCMG, u, &iterations[k]));
    PetscCall(PetscFree(u));
    PetscCall(MeshDestroy(&mesh));
  }
  CheckBelow(iterations[2], 40);
  CheckBelow(iterations[2], 1.25 * iterations[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestEveryShapeAgreesWithFactor)
CHECK_TEST(TestNearlyIncompressibleAgrees)
CHECK_TEST(TestInclinedPlanesAgree)
CHECK_TEST(TestOrthotropicAgrees)
CHECK_TEST(TestIterationsDoNotGrow)

static const struct CMUnitTest tests[] = {TEST(TestEveryShapeAgreesWithFactor), TEST(TestNearlyIncompressibleAgrees), TEST(TestInclinedPlanesAgree), TEST(TestOrthotropicAgrees), TEST(TestIterationsDoNotGrow)};
CHECK_MAIN(tests)
