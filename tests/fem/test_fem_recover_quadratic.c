/* Recovered stress of quadratic elements, displacements given at the nodes: exact fields, and orders in the plane. */
#include "recover_case.h"

/* u_x = x^2 + xy, u_y = y^2 - 2xy + xz, u_z = z^2 - 2yz: a linear stress */
static void Quadratic(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * (x[0] * x[0] + x[0] * x[1]);
  u[1] = 1e-3 * (x[1] * x[1] - 2 * x[0] * x[1] + x[0] * x[2]);
  u[2] = 1e-3 * (x[2] * x[2] - 2 * x[1] * x[2]);
}

static void QuadraticStress(const PetscReal x[3], PetscReal s[6])
{
  PetscReal h[3][3] = {{1e-3 * (2 * x[0] + x[1]), 1e-3 * x[0], 0}, {1e-3 * (x[2] - 2 * x[1]), 1e-3 * (2 * x[1] - 2 * x[0]), 1e-3 * x[0]}, {0, -2e-3 * x[2], 1e-3 * (2 * x[2] - 2 * x[1])}};

  RecoverHooke(&recover_steel, h, s);
}

static void PlaneQuadraticStress(const PetscReal x[3], PetscReal s[6])
{
  PetscReal h[3][3] = {{1e-3 * (2 * x[0] + x[1]), 1e-3 * x[0], 0}, {-2e-3 * x[1], 1e-3 * (2 * x[1] - 2 * x[0]), 0}, {0, 0, 0}};

  RecoverHooke(&recover_steel, h, s);
}

/* u_x = x^3 - 2xy^2 + yz^2, u_y = x^2 y + y^3 - xz^2, u_z = z^3 + x^2 z - 2y^2 z: a quadratic stress; in the plane z = 0 */
static void Cubic(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * (x[0] * x[0] * x[0] - 2 * x[0] * x[1] * x[1] + x[1] * x[2] * x[2]);
  u[1] = 1e-3 * (x[0] * x[0] * x[1] + x[1] * x[1] * x[1] - x[0] * x[2] * x[2]);
  u[2] = 1e-3 * (x[2] * x[2] * x[2] + x[0] * x[0] * x[2] - 2 * x[1] * x[1] * x[2]);
}

static void CubicStress(const PetscReal x[3], PetscReal s[6])
{
  const PetscReal a = x[0], b = x[1], c = x[2];
  PetscReal       h[3][3] = {{3 * a * a - 2 * b * b, -4 * a * b + c * c, 2 * b * c}, {2 * a * b - c * c, a * a + 3 * b * b, -2 * a * c}, {2 * a * c, -4 * b * c, 3 * c * c + a * a - 2 * b * b}};

  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) h[i][j] *= 1e-3;
  RecoverHooke(&recover_steel, h, s);
}

static void PlaneCubicStress(const PetscReal x[3], PetscReal s[6])
{
  const PetscReal a = x[0], b = x[1];
  PetscReal       h[3][3] = {{1e-3 * (3 * a * a - 2 * b * b), -4e-3 * a * b, 0}, {2e-3 * a * b, 1e-3 * (a * a + 3 * b * b), 0}, {0, 0, 0}};

  RecoverHooke(&recover_steel, h, s);
}

static PetscErrorCode Off(MeshCellType type, PetscReal distort, CaseField field, RecoverField plane, RecoverField solid, PetscBool inner, PetscReal *worst)
{
  const PetscReal length[3] = {1, 1, 1};
  const PetscInt  cells[3]  = {4, 4, 4};
  Mesh            mesh;
  FemModel        model;

  PetscFunctionBeginUser;
  PetscCall(RecoverFree(type, length, cells, distort, RecoverKind(type), &recover_steel, &mesh, &model));
  PetscCall(FemModelSetUp(model));
  PetscCall(RecoverImpose(model, field));
  PetscCall(RecoverWorst(model, &mesh, mesh.dim == 2 ? plane : solid, inner, worst));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const struct {
  MeshCellType type;
  PetscReal    distort; /* cells that hold all quadratics whatever their straight shape, or rectangles */
  PetscBool    cubic;   /* best at their sample points for every cubic displacement, in rectangles */
} rows[] = {{MESH_TRI6, 0.2, PETSC_FALSE}, {MESH_QUAD8, 0, PETSC_TRUE}, {MESH_QUAD9, 0.2, PETSC_TRUE}, {MESH_TET10, 0.2, PETSC_FALSE}, {MESH_HEX20, 0, PETSC_TRUE}, {MESH_HEX27, 0.2, PETSC_TRUE}, {MESH_PRISM15, 0, PETSC_FALSE}, {MESH_PRISM18, 0, PETSC_FALSE}};

/* A stress linear in x is there in every node, inner or not. */
static PetscErrorCode TestLinearStress(void)
{
  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(rows) / sizeof(rows[0]); k++) {
    PetscReal worst;

    PetscCall(Off(rows[k].type, rows[k].distort, Quadratic, PlaneQuadraticStress, QuadraticStress, PETSC_FALSE, &worst));
    CheckBelow(worst, 1e-11);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A quadratic stress: derivatives of the interpolated cubic are exact at two Gauss points a side of a rectangle, and the patch's polynomial is
   quadratic. Triangles have no such points; there the nodes are off by a little. */
static PetscErrorCode TestQuadraticStress(void)
{
  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(rows) / sizeof(rows[0]); k++) {
    PetscReal worst;

    PetscCall(Off(rows[k].type, 0, Cubic, PlaneCubicStress, CubicStress, PETSC_TRUE, &worst));
    printf("  gmsh type %d: inner nodes off by %.1e of the largest stress\n", (int)rows[k].type, (double)worst);
    CheckBelow(worst, rows[k].cubic ? 1e-11 : 0.02);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestOrders(void)
{
  PetscFunctionBeginUser;
  PetscCall(RecoverCheckOrders(MESH_TRI6, 8, 2.6, 2));
  PetscCall(RecoverCheckOrders(MESH_QUAD8, 8, 2.8, 0));
  PetscCall(RecoverCheckOrders(MESH_QUAD9, 8, 2.8, 2));
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestLinearStress)
CHECK_TEST(TestQuadraticStress)
CHECK_TEST(TestOrders)

static const struct CMUnitTest tests[] = {TEST(TestLinearStress), TEST(TestQuadraticStress), TEST(TestOrders)};
CHECK_MAIN(tests)
