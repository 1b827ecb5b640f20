/*
  Recovered stress, its error estimate, invariants and probes.

  Displacements are often given at the nodes directly, so that the recovery is looked at alone. The smooth case of the orders
  is that of test_fem_order: u = grad phi, phi harmonic.
*/
#include "recover_case.h"
#include "fem_recover.h"
#include "fem_point.h"
#include "fem_stress.h"

/* ---- exactness ---- */

static void Linear(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * (2 * x[0] - x[1] + 0.5 * x[2]);
  u[1] = 1e-3 * (x[0] + 3 * x[1] - x[2]);
  u[2] = 1e-3 * (-x[0] + x[1] - 2 * x[2]);
}

/* u_x = x^2 + xy, u_y = y^2 - 2xy + xz, u_z = z^2 - 2yz: its stress is linear */
static void Quadratic(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * (x[0] * x[0] + x[0] * x[1]);
  u[1] = 1e-3 * (x[1] * x[1] - 2 * x[0] * x[1] + x[0] * x[2]);
  u[2] = 1e-3 * (x[2] * x[2] - 2 * x[1] * x[2]);
}

static void LinearStress(const PetscReal x[3], PetscReal s[6])
{
  PetscReal h[3][3] = {{2e-3, -1e-3, 0.5e-3}, {1e-3, 3e-3, -1e-3}, {-1e-3, 1e-3, -2e-3}};

  (void)x;
  RecoverHooke(&recover_steel, h, s);
}

static void QuadraticStress(const PetscReal x[3], PetscReal s[6])
{
  PetscReal h[3][3] = {{1e-3 * (2 * x[0] + x[1]), 1e-3 * x[0], 0}, {1e-3 * (x[2] - 2 * x[1]), 1e-3 * (2 * x[1] - 2 * x[0]), 1e-3 * x[0]}, {0, -2e-3 * x[2], 1e-3 * (2 * x[2] - 2 * x[1])}};

  RecoverHooke(&recover_steel, h, s);
}

static void PlaneLinear(const PetscReal x[3], PetscReal u[3])
{
  const PetscReal flat[3] = {x[0], x[1], 0};

  Linear(flat, u);
}

static void PlaneLinearStress(const PetscReal x[3], PetscReal s[6])
{
  PetscReal h[3][3] = {{2e-3, -1e-3, 0}, {1e-3, 3e-3, 0}, {0, 0, 0}};

  (void)x;
  RecoverHooke(&recover_steel, h, s);
}

static void PlaneQuadraticStress(const PetscReal x[3], PetscReal s[6])
{
  PetscReal h[3][3] = {{1e-3 * (2 * x[0] + x[1]), 1e-3 * x[0], 0}, {-2e-3 * x[1], 1e-3 * (2 * x[1] - 2 * x[0]), 0}, {0, 0, 0}};

  RecoverHooke(&recover_steel, h, s);
}

/* Uniform stress on distorted meshes, on fine and on hardly any elements. */
static PetscErrorCode TestUniform(void)
{
  static const MeshCellType types[] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8};
  const PetscReal           length[3] = {1, 1, 1};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++)
    for (PetscInt cells = 1; cells <= 4; cells += 3) {
      const PetscInt n[3] = {cells, cells, cells}, flat = MeshCellDim(types[t]) == 2;
      Mesh           mesh;
      FemModel       model;
      PetscReal      worst = 0;

      PetscCall(RecoverFree(types[t], length, n, 0.2, RecoverKind(types[t]), &recover_steel, &mesh, &model));
      PetscCall(FemModelSetUp(model));
      PetscCall(RecoverImpose(model, flat ? PlaneLinear : Linear));
      PetscCall(RecoverWorst(model, &mesh, flat ? PlaneLinearStress : LinearStress, PETSC_FALSE, &worst));
      CheckBelow(worst, 1e-12);
      PetscCall(FemModelDestroy(&model));
      PetscCall(MeshDestroy(&mesh));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A stress linear in x, from the nodes of a quadratic displacement. The middles of rectangles and boxes see it exactly, so every node does, those of
   the boundary too; in a regular mesh of triangles the errors of a patch cancel at inner nodes. */
static PetscErrorCode TestLinearStress(void)
{
  static const MeshCellType types[] = {MESH_QUAD4, MESH_HEX8, MESH_TRI3};
  const PetscReal           length[3] = {1, 1, 1};
  const PetscInt            cells[3] = {4, 4, 4};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 3; t++) {
    const PetscInt flat = MeshCellDim(types[t]) == 2;
    Mesh           mesh;
    FemModel       model;
    PetscReal      worst = 0;

    PetscCall(RecoverFree(types[t], length, cells, 0, RecoverKind(types[t]), &recover_steel, &mesh, &model));
    PetscCall(FemModelSetUp(model));
    PetscCall(RecoverImpose(model, Quadratic));
    PetscCall(RecoverWorst(model, &mesh, flat ? PlaneQuadraticStress : QuadraticStress, types[t] == MESH_TRI3 ? PETSC_TRUE : PETSC_FALSE, &worst));
    CheckBelow(worst, 1e-12);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Bending(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * x[0] * (x[2] - 0.5);
  u[1] = 0;
  u[2] = -0.5e-3 * x[0] * x[0];
}

/* A plate of one layer of hexahedra in pure bending, nu = 0: the middles all lie in one plane, and top and bottom are still told apart. */
static PetscErrorCode TestOneLayer(void)
{
  const FemMaterial m = {1000, 1e9, 0};
  const PetscReal   length[3] = {4, 3, 1};
  const PetscInt    cells[3] = {8, 6, 1};
  PetscInt          n_points;
  PetscReal        *stress;
  Mesh              mesh;
  FemModel          model;

  PetscFunctionBeginUser;
  PetscCall(RecoverFree(MESH_HEX8, length, cells, 0, FEM_SOLID, &m, &mesh, &model));
  PetscCall(FemModelSetUp(model));
  PetscCall(RecoverImpose(model, Bending));
  PetscCall(FemModelGetPoints(model, &n_points, NULL));
  PetscCall(PetscMalloc1(6 * n_points, &stress));
  PetscCall(FemModelRecover(model, stress, NULL));
  for (PetscInt p = 0; p < n_points; p++) CheckNear(stress[6 * p], 1e6 * (mesh.x[3 * p + 2] - 0.5), 1e-6);
  PetscCall(PetscFree(stress));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- orders ---- */

static PetscErrorCode TestOrderTri3(void)
{
  return RecoverCheckOrders(MESH_TRI3, 16, 1.85, 1.3);
}

static PetscErrorCode TestOrderQuad4(void)
{
  return RecoverCheckOrders(MESH_QUAD4, 16, 1.85, 1.3);
}

static PetscErrorCode TestOrderTet4(void)
{
  return RecoverCheckOrders(MESH_TET4, 8, 1.85, 1.3);
}

static PetscErrorCode TestOrderHex8(void)
{
  return RecoverCheckOrders(MESH_HEX8, 8, 1.85, 1.3);
}

/* ---- invariants ---- */

static PetscErrorCode TestInvariants(void)
{
  const PetscReal tension[6] = {5, 0, 0, 0, 0, 0}, shear[6] = {0, 0, 0, 0, 7, 0}, even[6] = {-4, -4, -4, 0, 0, 0}, twice[6] = {2, 2, 5, 0, 0, 0}, known[6] = {3, 2, 3, 1, 1, 1};
  const PetscReal nearly[6] = {1e9, 1e9 * (1 + 1e-9), 1e9, 1e-3, 0, 0};
  PetscReal       p[3], v[3][3], turned[6];

  PetscFunctionBeginUser;
  CheckNear(FemVonMises(tension), 5, 1e-15);
  CheckNear(FemVonMises(shear), 7 * sqrt(3.0), 1e-14);
  CheckNear(FemVonMises(even), 0, 1e-15);
  FemPrincipal(tension, p, v);
  CheckNear(p[0], 5, 0);
  CheckNear(p[1], 0, 0);
  CheckNear(p[2], 0, 0);
  FemPrincipal(shear, p, v);
  CheckNear(p[0], 7, 1e-14);
  CheckNear(p[1], 0, 1e-14);
  CheckNear(p[2], -7, 1e-14);
  CheckNear(fabs(v[0][1]), sqrt(0.5), 1e-15);
  FemPrincipal(even, p, v);
  for (PetscInt k = 0; k < 3; k++) CheckNear(p[k], -4, 0);
  FemPrincipal(twice, p, NULL);
  CheckNear(p[0], 5, 0);
  CheckNear(p[1], 2, 0);
  CheckNear(p[2], 2, 0);
  FemPrincipal(known, p, NULL); /* characteristic polynomial (s - 2)(s^2 - 6 s + 6) */
  CheckNear(p[0], 3 + sqrt(3.0), 1e-14);
  CheckNear(p[1], 2, 1e-14);
  CheckNear(p[2], 3 - sqrt(3.0), 1e-14);
  FemPrincipal(nearly, p, v);
  CheckNear(p[0], 1e9 + 1 + 1e-6, 6e-7); /* second order in the shear: 1e-6 / 1 */
  CheckNear(p[2], 1e9 - 1e-6, 6e-7);

  /* a pair of equal roots, turned: sum of value * direction (x) direction comes back */
  for (PetscInt k = 0; k < 6; k++) turned[k] = (k < 3 ? 2 : 0) + 3. / 9 * (PetscReal[]){1, 4, 4, 2, 4, 2}[k]; /* 2 I + 3 n n, n = (1, 2, 2)/3 */
  FemPrincipal(turned, p, v);
  CheckNear(p[0], 5, 1e-14);
  CheckNear(p[1], 2, 1e-14);
  CheckNear(p[2], 2, 1e-14);
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) {
      PetscReal sum = 0, dot = 0;

      for (PetscInt k = 0; k < 3; k++) {
        sum += p[k] * v[k][i] * v[k][j];
        dot += v[i][k] * v[j][k];
      }
      CheckNear(sum, turned[i == j ? i : i + j == 1 ? 3 : i + j == 3 ? 4 : 5], 1e-14);
      CheckNear(dot, i == j, 1e-14);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* There and back: gradient to stress to Voigt stress and strain, in the three kinds of space. */
static PetscErrorCode TestLaws(void)
{
  static const FemKind kinds[] = {FEM_SOLID, FEM_PLANE_STRAIN, FEM_PLANE_STRESS};
  const PetscReal      E = recover_steel.young, nu = recover_steel.poisson, length[3] = {1, 1, 1};
  const PetscInt       n[3] = {1, 1, 1};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 3; k++) {
    const PetscInt dim = k ? 2 : 3;
    PetscReal      h[3][3] = {{1e-3, 4e-4, k ? 0 : 2e-4}, {-1e-4, -5e-4, 0}, {0, k ? 0 : 3e-4, k ? 0 : 7e-4}}, e[6], s[6], stress[6], strain[6];
    Mesh           mesh;
    FemModel       model;

    PetscCall(RecoverFree(k ? MESH_QUAD4 : MESH_HEX8, length, n, 0, kinds[k], &recover_steel, &mesh, &model));
    PetscCall(FemModelSetUp(model));
    for (PetscInt i = 0; i < 3; i++) {
      e[i]     = h[i][i];
      e[3 + i] = h[i][(i + 1) % 3] + h[(i + 1) % 3][i];
    }
    FemStressOf(dim, &model->law[0], e, s);
    FemStressExpand(dim, &model->law[0], s, stress, strain);
    CheckNear(strain[0], 1e-3, 1e-15);
    CheckNear(strain[1], -5e-4, 1e-15);
    CheckNear(strain[3], 3e-4, 1e-15);
    for (PetscInt i = 0; i < 3; i++) { /* Hooke's law the other way */
      CheckNear(strain[i], (stress[i] - nu * (stress[(i + 1) % 3] + stress[(i + 2) % 3])) / E, 1e-15);
      CheckNear(strain[3 + i], stress[3 + i] * 2 * (1 + nu) / E, 1e-15);
    }
    if (k == 1) CheckNear(strain[2], 0, 1e-18);
    if (k == 2) CheckNear(stress[2], 0, 1e-9);
    CheckClose(FemStressNorm(dim, &model->law[0], s), stress[0] * strain[0] + stress[1] * strain[1] + stress[2] * strain[2] + stress[3] * strain[3] + stress[4] * strain[4] + stress[5] * strain[5], 1e-14);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- two materials ---- */

/* Halves of a bar pulled along x, nu = 0, E 1 : 3. The strain across the interface jumps, the stress does not; with the same strain on both sides it is
   the stress that jumps. Both sides keep their own value at the interface. */
static PetscErrorCode TestTwoMaterials(void)
{
  const FemMaterial soft = {1000, 1e9, 0}, hard = {1000, 3e9, 0};
  const PetscReal   length[3] = {2, 1, 1};
  const PetscInt    n[3] = {8, 4, 4};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 2; t++) {
    const MeshCellType type = t ? MESH_HEX8 : MESH_TRI3;
    Mesh               mesh;
    FemModel           model;
    PetscInt           n_points, seams = 0, cells;
    const PetscInt    *node;
    PetscReal         *stress, *strain;
    MeshGroup         *group;

    PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, 0, &mesh));
    PetscCall(PetscRealloc(sizeof(MeshGroup) * (mesh.n_groups + 2), &mesh.group)); /* left and right cells */
    for (PetscInt side = 0; side < 2; side++) {
      group = &mesh.group[mesh.n_groups++];
      PetscCall(PetscMemzero(group, sizeof(*group)));
      PetscCall(PetscStrncpy(group->name, side ? "right" : "left", sizeof(group->name)));
      group->dim = mesh.dim;
      PetscCall(PetscMalloc1(mesh.n_cells, &group->cell));
      for (PetscInt c = 0; c < mesh.n_cells; c++) {
        PetscReal middle = 0;

        if (MeshCellDim(mesh.type[c]) != mesh.dim) continue;
        for (PetscInt a = mesh.start[c]; a < mesh.start[c + 1]; a++) middle += mesh.x[3 * mesh.node[a]] / (mesh.start[c + 1] - mesh.start[c]);
        if ((middle > 1) == side) group->cell[group->n_cells++] = c;
      }
    }
    PetscCall(FemModelCreate(PETSC_COMM_SELF, &model));
    PetscCall(FemModelSetKind(model, RecoverKind(type), 1));
    PetscCall(FemModelSetMethod(model, FEM_STATIC));
    PetscCall(FemModelSetMesh(model, &mesh));
    PetscCall(FemModelAddMaterial(model, "left", &soft));
    PetscCall(FemModelAddMaterial(model, "right", &hard));
    PetscCall(CaseFix(model, "xmin", 0, 0));
    PetscCall(CaseFix(model, "ymin", 1, 0));
    if (mesh.dim == 3) PetscCall(CaseFix(model, "zmin", 2, 0));
    PetscCall(CaseTraction(model, "xmax", 3e6, 0, 0));
    PetscCall(CaseSolve(model));
    PetscCall(FemModelGetPoints(model, &n_points, &node));
    PetscCall(FemModelGetCounts(model, NULL, &cells, NULL));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) seams += fabs(mesh.x[3 * i] - 1) < 1e-9;
    CheckInt(n_points, mesh.n_nodes + seams);
    PetscCall(PetscMalloc2(6 * n_points, &stress, 6 * n_points, &strain));
    PetscCall(FemModelRecover(model, stress, strain));
    for (PetscInt p = 0; p < n_points; p++) {
      const PetscReal x = mesh.x[3 * node[p]];

      if (p >= mesh.n_nodes) CheckNear(x, 1, 1e-12);
      CheckClose(stress[6 * p], 3e6, 1e-9);
      CheckClose(strain[6 * p], x > 1 + 1e-9 || p >= mesh.n_nodes ? 1e-3 : 3e-3, 1e-9);
    }
    PetscCall(RecoverImpose(model, mesh.dim == 2 ? PlaneLinear : Linear)); /* the same strain on both sides */
    PetscCall(FemModelRecover(model, stress, NULL));
    for (PetscInt p = 0; p < n_points; p++) CheckClose(stress[6 * p], 2e-3 * (mesh.x[3 * node[p]] > 1 + 1e-9 || p >= mesh.n_nodes ? 3e9 : 1e9), 1e-12);
    PetscCall(PetscFree2(stress, strain));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- probes ---- */

static PetscErrorCode TestProbes(void)
{
  static const MeshCellType types[] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8};
  static const char *const  quantity[] = {"displacement", "velocity", "stress", "strain", "von_mises", "principal_stress"};
  const PetscReal           length[3] = {1, 1, 1}, at[3] = {0.37, 0.71, 0.22}, corner[3] = {1, 1, 1}, away[3] = {1.25, 0.5, 0.5};
  const PetscInt            n[3] = {6, 6, 6};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) {
    const PetscInt flat = MeshCellDim(types[t]) == 2;
    PetscReal      u[3], s[6], p[3];
    Mesh           mesh;
    FemModel       model;
    FemReadings    readings;

    PetscCall(RecoverFree(types[t], length, n, 0.2, RecoverKind(types[t]), &recover_steel, &mesh, &model));
    PetscCall(FemModelAddProbe(model, "A", at, 6, quantity));
    PetscCall(FemModelAddProbe(model, "corner", corner, 1, &quantity[2]));
    CheckFails(FemModelAddProbe(model, "B", away, 1, quantity), PETSC_ERR_USER_INPUT, "probe 'B'");
    CheckContains(BaseErrorMessage(), "about 0.25");
    CheckFails(FemModelAddProbe(model, "C", at, 1, (const char *const[]){"colour"}), PETSC_ERR_USER_INPUT, "no quantity 'colour'");
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetReadings(model, &readings));
    CheckInt(readings.recoveries + readings.patches, 0); /* nobody has looked yet */
    PetscCall(RecoverImpose(model, flat ? PlaneLinear : Linear));
    (flat ? PlaneLinear : Linear)(at, u);
    (flat ? PlaneLinearStress : LinearStress)(at, s);
    FemPrincipal(s, p, NULL);
    CheckNear(CaseHistory(model, "displacement(A).x"), u[0], 1e-16);
    CheckNear(CaseHistory(model, "displacement(A).y"), u[1], 1e-16);
    CheckNear(CaseHistory(model, "velocity(A).y"), 0, 0);
    CheckClose(CaseHistory(model, "stress(A).xx"), s[0], 1e-12);
    CheckClose(CaseHistory(model, "stress(A).zz"), s[2], 1e-12);
    CheckClose(CaseHistory(model, "stress(corner).yy"), s[1], 1e-12);
    CheckNear(CaseHistory(model, "strain(A).yy"), 3e-3, 1e-15);
    CheckClose(CaseHistory(model, "von_mises(A)"), FemVonMises(s), 1e-12);
    CheckClose(CaseHistory(model, "principal_stress(A).1"), p[0], 1e-12);
    CheckTrue(isnan(CaseHistory(model, "stress(A).yz")) == flat);
    PetscCall(FemModelGetReadings(model, &readings));
    CheckInt(readings.recoveries, 0);
    CheckAbove(readings.patches, 1);
    CheckBelow(readings.patches / 9, 30); /* patches of two elements, once for each of the nine columns asked for alone */
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Newton on the map of elements that are no parallelograms, corners and all. */
static PetscErrorCode TestPointFind(void)
{
  const PetscReal quad[8] = {0, 0, 2, 0.3, 1.7, 1.4, -0.2, 0.9}, hex[24] = {0, 0, 0, 1.2, 0, 0.1, 1, 1.1, 0, -0.1, 0.9, 0, 0.1, 0, 1, 1, 0.1, 1.2, 1.3, 1.2, 1, 0, 1, 0.8};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 2; t++) {
    const FemShape  *shape = FemShapeGet(t ? MESH_HEX8 : MESH_QUAD4);
    const PetscReal *x = t ? hex : quad;

    for (PetscInt k = 0; k < 27; k++) {
      const PetscReal want[3] = {k % 3 - 1, k / 3 % 3 - 1, t ? k / 9 - 1 : 0};
      PetscReal       N[8], dN[24], at[3], xi[3];

      (void)FemPointAt(shape, x, want, N, dN, at);
      CheckBelow(FemPointFind(shape, x, at, xi), 1e-12);
      for (PetscInt d = 0; d < shape->dim; d++) CheckNear(xi[d], want[d], 1e-12);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rules integrate what they promise: monomials on the reference elements. */
static PetscErrorCode TestRules(void)
{
  static const MeshCellType types[] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8, MESH_PRISM6};
  const PetscReal           volume[] = {0.5, 4, 1. / 6, 8, 1}, second[] = {1. / 12, 4. / 3, 1. / 60, 8. / 3, 1. / 6}; /* int xi_0^2 */

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 5; t++) {
    PetscReal xi[FEM_RULE_MAX][3], w[FEM_RULE_MAX], sum[2] = {0, 0};
    PetscInt  n = FemPointRule(types[t], 3, xi, w);

    for (PetscInt q = 0; q < n; q++) {
      sum[0] += w[q];
      sum[1] += w[q] * xi[q][0] * xi[q][0];
    }
    CheckClose(sum[0], volume[t], 1e-14);
    CheckClose(sum[1], second[t], 1e-14);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestUniform)
CHECK_TEST(TestLinearStress)
CHECK_TEST(TestOneLayer)
CHECK_TEST(TestOrderTri3)
CHECK_TEST(TestOrderQuad4)
CHECK_TEST(TestOrderTet4)
CHECK_TEST(TestOrderHex8)
CHECK_TEST(TestInvariants)
CHECK_TEST(TestLaws)
CHECK_TEST(TestTwoMaterials)
CHECK_TEST(TestProbes)
CHECK_TEST(TestPointFind)
CHECK_TEST(TestRules)

static const struct CMUnitTest tests[] = {TEST(TestUniform), TEST(TestLinearStress), TEST(TestOneLayer), TEST(TestOrderTri3), TEST(TestOrderQuad4), TEST(TestOrderTet4), TEST(TestOrderHex8),
                                          TEST(TestInvariants), TEST(TestLaws), TEST(TestTwoMaterials), TEST(TestProbes), TEST(TestPointFind), TEST(TestRules)};
CHECK_MAIN(tests)
