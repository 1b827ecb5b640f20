/*
  Orders on a smooth exact solution, by slope: displacement in L2 second, stress (energy) first.

  u = grad phi with phi harmonic is in equilibrium without body force for any elastic constants: phi = e^x cos y in the
  plane, e^(sqrt2 x) cos y cos z in space. The boundary follows it exactly. Meshes are distorted.
*/
#include "fem_case.h"
#include "fem_element.h"

static void Plane(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * exp(x[0]) * cos(x[1]);
  u[1] = -1e-3 * exp(x[0]) * sin(x[1]);
  u[2] = 0;
}

static void Solid(const PetscReal x[3], PetscReal u[3])
{
  const PetscReal r = sqrt(2.0), e = 1e-3 * exp(r * x[0]);

  u[0] = r * e * cos(x[1]) * cos(x[2]);
  u[1] = -e * sin(x[1]) * cos(x[2]);
  u[2] = -e * cos(x[1]) * sin(x[2]);
}

/* Errors against the exact field: displacement at integration points, its gradient at corners, where it is not superconvergent. */
static PetscErrorCode Errors(MeshCellType type, PetscInt cells, PetscReal *l2, PetscReal *energy)
{
  const PetscInt    dim       = MeshCellDim(type);
  const CaseField   field     = dim == 2 ? Plane : Solid;
  const FemMaterial m         = {1, 1e6, 0.3};
  const PetscReal   length[3] = {1, 1, 1}, lambda = 1e6 * 0.3 / (1.3 * 0.4), mu = 1e6 / 2.6;
  const PetscInt    n[3]      = {cells, cells, cells};
  const FemShape   *shape     = FemShapeGet(type);
  PetscInt         *surface, n_surface;
  PetscReal        *u;
  Mesh              mesh;
  FemModel          model;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, 0.2, &mesh));
  PetscCall(PetscMalloc2(mesh.n_nodes, &surface, 3 * mesh.n_nodes, &u));
  n_surface = CaseSurface(&mesh, length, -1, surface);
  PetscCall(CaseAddNodeGroups(&mesh, n_surface, surface));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, dim == 2 ? FEM_PLANE_STRAIN : FEM_SOLID, FEM_STATIC, 1, &m, &model));
  PetscCall(CaseFixNodes(model, dim, n_surface, surface, mesh.x, field));
  PetscCall(CaseSolve(model));
  PetscCall(FemModelGetField(model, "displacement", u));
  *l2 = *energy = 0;
  for (PetscInt c = 0; c < mesh.n_cells; c++) {
    PetscReal x[24], ue[24], dN[192], w[8];

    if (mesh.type[c] != type) continue;
    for (PetscInt a = 0; a < shape->nodes; a++)
      for (PetscInt d = 0; d < dim; d++) {
        x[a * dim + d]  = mesh.x[3 * mesh.node[mesh.start[c] + a] + d];
        ue[a * dim + d] = u[3 * mesh.node[mesh.start[c] + a] + d];
      }
    (void)FemGradients(shape, x, 1, dN, w);
    for (PetscInt q = 0; q < shape->points; q++) {
      PetscReal at[3] = {0, 0, 0}, got[3] = {0, 0, 0}, want[3], h[3][3] = {{0}}, trace = 0, sum = 0;

      for (PetscInt a = 0; a < shape->nodes; a++)
        for (PetscInt i = 0; i < dim; i++) {
          at[i] += shape->N[q][a] * x[a * dim + i];
          got[i] += shape->N[q][a] * ue[a * dim + i];
          for (PetscInt j = 0; j < dim; j++) h[i][j] += ue[a * dim + i] * dN[(q * shape->nodes + a) * dim + j];
        }
      field(at, want);
      for (PetscInt i = 0; i < dim; i++) *l2 += w[q] * PetscSqr(got[i] - want[i]);
      for (PetscInt a = 0; a < shape->nodes; a++) { /* exact gradient at each corner by central differences, error shared */
        PetscReal e[3][3];

        for (PetscInt j = 0; j < dim; j++) {
          PetscReal plus[3] = {0, 0, 0}, minus[3] = {0, 0, 0}, up[3], down[3];

          for (PetscInt i = 0; i < dim; i++) plus[i] = minus[i] = x[a * dim + i];
          plus[j] += 1e-5;
          minus[j] -= 1e-5;
          field(plus, up);
          field(minus, down);
          for (PetscInt i = 0; i < dim; i++) e[i][j] = h[i][j] - (up[i] - down[i]) / 2e-5;
        }
        trace = sum = 0;
        for (PetscInt i = 0; i < dim; i++) {
          trace += e[i][i];
          for (PetscInt j = 0; j < dim; j++) sum += 0.5 * mu * PetscSqr(e[i][j] + e[j][i]);
        }
        *energy += w[q] / shape->nodes * (sum + lambda * trace * trace);
      }
    }
  }
  *l2     = PetscSqrtReal(*l2);
  *energy = PetscSqrtReal(*energy);
  PetscCall(PetscFree2(surface, u));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckOrder(MeshCellType type, PetscInt coarse)
{
  PetscReal l2[2], energy[2];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 2; k++) PetscCall(Errors(type, coarse << k, &l2[k], &energy[k]));
  printf("  gmsh type %d, %d and %d cells a side: displacement order %.2f, energy order %.2f\n", (int)type, (int)coarse, (int)coarse * 2, log2(l2[0] / l2[1]), log2(energy[0] / energy[1]));
  CheckAbove(log2(l2[0] / l2[1]), 1.9);
  CheckAbove(log2(energy[0] / energy[1]), 0.9);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestTri3(void)
{
  return CheckOrder(MESH_TRI3, 16);
}

static PetscErrorCode TestQuad4(void)
{
  return CheckOrder(MESH_QUAD4, 16);
}

static PetscErrorCode TestTet4(void)
{
  return CheckOrder(MESH_TET4, 6);
}

static PetscErrorCode TestHex8(void)
{
  return CheckOrder(MESH_HEX8, 6);
}

CHECK_TEST(TestTri3)
CHECK_TEST(TestQuad4)
CHECK_TEST(TestTet4)
CHECK_TEST(TestHex8)

static const struct CMUnitTest tests[] = {TEST(TestTri3), TEST(TestQuad4), TEST(TestTet4), TEST(TestHex8)};
CHECK_MAIN(tests)
