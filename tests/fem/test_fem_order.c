/*
  Orders on a smooth exact solution, by slope: displacement in L2 of order p + 1, stress (energy) of order p; and quadratic fields exactly.

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

/* Errors against the exact field: displacement at integration points, its gradient there too, but for linear cells at corners, where it is
   not superconvergent; volume changes count at most as at nu = 0.3. */
static PetscErrorCode Errors(MeshCellType type, PetscInt cells, PetscReal distort, PetscReal nu, PetscReal *l2, PetscReal *energy)
{
  const PetscInt    dim       = MeshCellDim(type);
  const CaseField   field     = dim == 2 ? Plane : Solid;
  const FemMaterial m         = {1, 1e6, nu};
  const PetscReal   length[3] = {1, 1, 1}, mu = 5e5 / (1 + nu), lambda = PetscMin(2 * nu / (1 - 2 * nu), 1.5) * mu;
  const PetscInt    n[3]      = {cells, cells, cells};
  const FemShape   *shape     = FemShapeGet(type);
  PetscInt         *surface, n_surface;
  PetscReal        *u;
  Mesh              mesh;
  FemModel          model;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, distort, &mesh));
  PetscCall(PetscMalloc2(mesh.n_nodes, &surface, 3 * mesh.n_nodes, &u));
  n_surface = CaseSurface(&mesh, length, -1, surface);
  PetscCall(CaseAddNodeGroups(&mesh, n_surface, surface));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, dim == 2 ? FEM_PLANE_STRAIN : FEM_SOLID, FEM_STATIC, 1, &m, &model));
  PetscCall(CaseFixNodes(model, dim, n_surface, surface, mesh.x, field));
  PetscCall(CaseSolve(model));
  PetscCall(FemModelGetField(model, "displacement", u));
  *l2 = *energy = 0;
  for (PetscInt c = 0; c < mesh.n_cells; c++) {
    PetscReal x[FEM_MAX_DOFS], ue[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS];

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
      for (PetscInt a = 0; a < (shape->type == shape->linear ? shape->nodes : 1); a++) { /* exact gradient by central differences, error shared */
        const PetscReal *place = shape->type == shape->linear ? &x[a * dim] : at;
        PetscReal        e[3][3];

        for (PetscInt j = 0; j < dim; j++) {
          PetscReal plus[3] = {0, 0, 0}, minus[3] = {0, 0, 0}, up[3], down[3];

          for (PetscInt i = 0; i < dim; i++) plus[i] = minus[i] = place[i];
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
        *energy += w[q] / (shape->type == shape->linear ? shape->nodes : 1) * (sum + lambda * trace * trace);
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

static PetscErrorCode CheckOrder(MeshCellType type, PetscInt coarse, PetscReal distort, PetscReal nu, PetscReal lost)
{
  const PetscInt p = type == MeshCellLinear(type) ? 1 : 2;
  PetscReal      l2[2], energy[2];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 2; k++) PetscCall(Errors(type, coarse << k, distort, nu, &l2[k], &energy[k]));
  printf("  gmsh type %d, nu %.4f, %d and %d cells a side: displacement order %.2f, energy order %.2f\n", (int)type, (double)nu, (int)coarse, (int)coarse * 2, log2(l2[0] / l2[1]), log2(energy[0] / energy[1]));
  CheckAbove(log2(l2[0] / l2[1]), p + 1 - 0.1 * p - lost);
  CheckAbove(log2(energy[0] / energy[1]), p - 0.1 * p - lost);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestLinear(void)
{
  PetscFunctionBeginUser;
  PetscCall(CheckOrder(MESH_TRI3, 16, 0.2, 0.3, 0));
  PetscCall(CheckOrder(MESH_QUAD4, 16, 0.2, 0.3, 0));
  PetscCall(CheckOrder(MESH_TET4, 6, 0.2, 0.3, 0));
  PetscCall(CheckOrder(MESH_HEX8, 6, 0.2, 0.3, 0));
  PetscCall(CheckOrder(MESH_PRISM6, 6, 0.2, 0.3, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Serendipity cells keep their order on affine cells only (Arnold, Boffi and Falk, Math. Comp. 71 (2002) 909). */
static PetscErrorCode TestQuadratic(void)
{
  PetscFunctionBeginUser;
  PetscCall(CheckOrder(MESH_TRI6, 8, 0.2, 0.3, 0));
  PetscCall(CheckOrder(MESH_QUAD9, 8, 0.2, 0.3, 0));
  PetscCall(CheckOrder(MESH_QUAD8, 8, 0, 0.3, 0));
  PetscCall(CheckOrder(MESH_TET10, 2, 0.1, 0.3, 0));
  PetscCall(CheckOrder(MESH_HEX27, 2, 0.1, 0.3, 0));
  PetscCall(CheckOrder(MESH_HEX20, 2, 0, 0.3, 0));
  PetscCall(CheckOrder(MESH_PRISM18, 2, 0.1, 0.3, 0));
  PetscCall(CheckOrder(MESH_PRISM15, 2, 0, 0.3, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The field keeps its volume, and so do these elements, as well as at nu = 0.3; but 15 nodes of a prism are too few for four volume changes, and
   half an order is lost. */
static PetscErrorCode TestNearlyIncompressible(void)
{
  PetscFunctionBeginUser;
  PetscCall(CheckOrder(MESH_QUAD4, 16, 0.2, 0.4999, 0));
  PetscCall(CheckOrder(MESH_HEX8, 6, 0.2, 0.4999, 0));
  PetscCall(CheckOrder(MESH_HEX27, 2, 0.1, 0.4999, 0));
  PetscCall(CheckOrder(MESH_HEX20, 2, 0, 0.4999, 0));
  PetscCall(CheckOrder(MESH_PRISM18, 2, 0.1, 0.4999, 0));
  PetscCall(CheckOrder(MESH_PRISM15, 2, 0, 0.4999, 0.7));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u = x^2, v = y^2 - 2xy, w = z^2 - 2yz with mu = 1: a constant body force holds it, and affine quadratic cells have it exactly.  Notes P4 */
static void Squares(const PetscReal x[3], PetscReal u[3])
{
  u[0] = x[0] * x[0];
  u[1] = x[1] * x[1] - 2 * x[0] * x[1];
  u[2] = x[2] * x[2] - 2 * x[1] * x[2];
}

static PetscErrorCode TestQuadraticFieldIsExact(void)
{
  const MeshCellType types[8]  = {MESH_TRI6, MESH_QUAD8, MESH_QUAD9, MESH_TET10, MESH_HEX20, MESH_HEX27, MESH_PRISM15, MESH_PRISM18};
  const PetscReal    length[3] = {1, 1, 1};
  const PetscInt     n[3]      = {2, 2, 2};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 16; k++) {
    const PetscInt    t  = k / 2;
    const PetscReal   nu = k % 2 ? 0.49 : 0.25, lambda = 2 * nu / (1 - 2 * nu), flat[3] = {-2. / 2, -(4 + 2 * lambda) / 2, 0}, solid[3] = {-2. / 2, -2. / 2, -(4 + 2 * lambda) / 2};
    const FemMaterial m  = {2, 2 * (1 + nu), nu};
    Mesh       mesh;
    FemModel   model;
    PetscInt  *surface, n_surface;
    PetscReal *u;

    PetscCall(CaseBox(PETSC_COMM_SELF, types[t], length, n, types[t] == MESH_TRI6 || types[t] == MESH_TET10 ? 0.2 : 0, &mesh));
    PetscCall(PetscMalloc2(mesh.n_nodes, &surface, 3 * mesh.n_nodes, &u));
    n_surface = CaseSurface(&mesh, length, -1, surface);
    for (PetscInt i = 0; i < mesh.n_nodes; i++) { /* sheared: still affine */
      mesh.x[3 * i] += 0.3 * mesh.x[3 * i + 1] - 0.1 * mesh.x[3 * i + 2];
      mesh.x[3 * i + 1] += 0.2 * mesh.x[3 * i + 2];
    }
    PetscCall(CaseAddNodeGroups(&mesh, n_surface, surface));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, mesh.dim == 2 ? FEM_PLANE_STRAIN : FEM_SOLID, FEM_STATIC, 1, &m, &model));
    PetscCall(FemModelSetGravity(model, mesh.dim == 2 ? flat : solid));
    PetscCall(CaseFixNodes(model, mesh.dim, n_surface, surface, mesh.x, Squares));
    PetscCall(CaseSolve(model));
    PetscCall(FemModelGetField(model, "displacement", u));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) {
      PetscReal exact[3];

      Squares(&mesh.x[3 * i], exact);
      for (PetscInt d = 0; d < mesh.dim; d++) CheckNear(u[3 * i + d], exact[d], 1e-12);
    }
    PetscCall(PetscFree2(surface, u));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestLinear)
CHECK_TEST(TestQuadratic)
CHECK_TEST(TestNearlyIncompressible)
CHECK_TEST(TestQuadraticFieldIsExact)

static const struct CMUnitTest tests[] = {TEST(TestLinear), TEST(TestQuadratic), TEST(TestNearlyIncompressible), TEST(TestQuadraticFieldIsExact)};
CHECK_MAIN(tests)
