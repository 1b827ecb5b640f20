/*
  Lame's thick cylinder and hollow sphere under pressure, up to Poisson's ratio 0.4999, with every element that is fit for it; plain quad4 and
  hex8 lock. A point load on a half-space (Boussinesq). Notes S1, S2, S6.
*/
#include "fem_case.h"

/* ---- 1/24 of a hollow sphere, 1 < r < 2, between planes through its middle: y = 0, z = 0, y = x, z = x ---- */

#define SPHERE_A 1.0
#define SPHERE_B 2.0

static void SphereMap(PetscReal x[3])
{
  const PetscReal r = SPHERE_A + (SPHERE_B - SPHERE_A) * x[0], p = PetscTanReal(0.25 * PETSC_PI * x[1]), q = PetscTanReal(0.25 * PETSC_PI * x[2]), size = PetscSqrtReal(1 + p * p + q * q);

  x[0] = r / size;
  x[1] = r * p / size;
  x[2] = r * q / size;
}

/* u_r of pressure p = 1 inside: p a^3/(E (b^3 - a^3)) ((1 - 2 nu) r + (1 + nu) b^3/(2 r^2)) */
static PetscReal SphereExact(PetscReal nu, PetscReal r)
{
  const PetscReal a3 = SPHERE_A * SPHERE_A * SPHERE_A, b3 = SPHERE_B * SPHERE_B * SPHERE_B;

  return a3 / (1000 * (b3 - a3)) * ((1 - 2 * nu) * r + (1 + nu) * b3 / (2 * r * r));
}

/* Worst relative error of the motion of the inner and outer faces; cells across the wall and along each side. */
static PetscErrorCode Sphere(MeshCellType type, FemElement element, PetscReal nu, PetscInt across, PetscInt along, PetscReal *error)
{
  const FemMaterial m         = {1, 1000, nu};
  const PetscReal   length[3] = {1, 1, 1};
  const PetscInt    n[3]      = {across, along, along};
  const char *const plane[4]  = {"ymin", "ymax", "zmin", "zmax"};
  Mesh              mesh;
  FemModel          model;
  Table             one;
  PetscReal        *u;

  PetscFunctionBeginUser;
  PetscCall(TableCreateConstant(1, &one));
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, 0, &mesh));
  for (PetscInt i = 0; i < mesh.n_nodes; i++) SphereMap(&mesh.x[3 * i]);
  PetscCall(FemModelCreate(PETSC_COMM_SELF, &model));
  PetscCall(FemModelSetElement(model, element));
  PetscCall(FemModelSetMesh(model, &mesh));
  PetscCall(FemModelAddMaterial(model, "", &m));
  for (PetscInt k = 0; k < 4; k++) PetscCall(FemModelSetSymmetry(model, plane[k]));
  PetscCall(FemModelAddPressure(model, "xmin", &one));
  PetscCall(CaseSolve(model));
  PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
  PetscCall(FemModelGetField(model, "displacement", u));
  *error = 0;
  for (PetscInt i = 0; i < mesh.n_nodes; i++) {
    const PetscReal *x = &mesh.x[3 * i], r = PetscSqrtReal(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);

    if (r > SPHERE_A + 1e-9 && r < SPHERE_B - 1e-9) continue;
    *error = PetscMax(*error, PetscAbsReal((u[3 * i] * x[0] + u[3 * i + 1] * x[1] + u[3 * i + 2] * x[2]) / r / SphereExact(nu, r) - 1));
  }
  PetscCall(PetscFree(u));
  PetscCall(TableDestroy(&one));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Quadratic hexahedra and prisms are fit to 0.499: at 0.4999 and curved they stiffen until they are fine. hex8 and tet10, what scenes make, go on. */
static PetscErrorCode TestSphere(void)
{
  static const struct {
    MeshCellType type;
    const char  *word;
    PetscInt     across, along;
    PetscReal    most; /* Poisson's ratio */
  } rows[] = {{MESH_HEX8, "hex8", 14, 9, 0.4999}, {MESH_TET10, "tet10", 9, 8, 0.4999}, {MESH_HEX20, "hex20", 5, 3, 0.4999}, {MESH_HEX27, "hex27", 5, 3, 0.4999}, {MESH_PRISM15, "prism15", 6, 5, 0.4999}, {MESH_PRISM18, "prism18", 6, 5, 0.4999}};

  PetscFunctionBeginUser;
  CheckClose(SphereExact(0.3, 1), 8e-4, 1e-12); /* notes S2 */
  CheckClose(SphereExact(0.3, 2), 3e-4, 1e-12);
  for (size_t k = 0; k < sizeof(rows) / sizeof(rows[0]); k++)
    for (PetscInt j = 0; j < 2; j++) {
      const PetscReal nu = j ? rows[k].most : 0.3;
      PetscReal       error;

      PetscCall(Sphere(rows[k].type, FEM_ENHANCED, nu, rows[k].across, rows[k].along, &error));
      printf("  sphere, %-7s %2d x %d x %d, nu %.4f: worst error of the faces' motion %.4f\n", rows[k].word, (int)rows[k].across, (int)rows[k].along, (int)rows[k].along, (double)nu, (double)error);
      CheckBelow(error, 0.01);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestPlainHex8Locks(void)
{
  PetscReal error;

  PetscFunctionBeginUser;
  PetscCall(Sphere(MESH_HEX8, FEM_FULL, 0.4999, 10, 6, &error));
  printf("  sphere, plain hex8, nu 0.4999: worst error %.2f\n", (double)error);
  CheckAbove(error, 0.5);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- thick cylinder, 3 < r < 9, plane strain: a quarter; as MacNeal and Harder's, cut finer ---- */

static PetscErrorCode Cylinder(MeshCellType type, FemElement element, PetscReal nu, PetscInt across, PetscInt along, PetscReal *error)
{
  const FemMaterial m         = {1, 1000, nu};
  const PetscReal   length[3] = {1, 1, 1};
  const PetscInt    n[3]      = {across, along, 1};
  Mesh              mesh;
  FemModel          model;
  Table             one;
  PetscReal        *u;

  PetscFunctionBeginUser;
  PetscCall(TableCreateConstant(1, &one));
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, 0, &mesh));
  for (PetscInt i = 0; i < mesh.n_nodes; i++) {
    PetscReal      *x = &mesh.x[3 * i];
    const PetscReal r = 3 * PetscPowReal(3, x[0]), angle = x[1] * PETSC_PI / 2;

    x[0] = r * PetscCosReal(angle);
    x[1] = r * PetscSinReal(angle);
  }
  PetscCall(FemModelCreate(PETSC_COMM_SELF, &model));
  PetscCall(FemModelSetKind(model, FEM_PLANE_STRAIN, 1));
  PetscCall(FemModelSetElement(model, element));
  PetscCall(FemModelSetMesh(model, &mesh));
  PetscCall(FemModelAddMaterial(model, "", &m));
  PetscCall(FemModelSetSymmetry(model, "ymin"));
  PetscCall(FemModelSetSymmetry(model, "ymax"));
  PetscCall(FemModelAddPressure(model, "xmin", &one));
  PetscCall(CaseSolve(model));
  PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
  PetscCall(FemModelGetField(model, "displacement", u));
  *error = 0;
  for (PetscInt i = 0; i < mesh.n_nodes; i++) {
    const PetscReal *x = &mesh.x[3 * i], r = PetscSqrtReal(x[0] * x[0] + x[1] * x[1]), exact = 9 * (1 + nu) / (1000 * 72) * ((1 - 2 * nu) * r + 81 / r);

    if (r > 3 + 1e-9 && r < 9 - 1e-9) continue;
    *error = PetscMax(*error, PetscAbsReal((u[3 * i] * x[0] + u[3 * i + 1] * x[1]) / r / exact - 1));
  }
  PetscCall(PetscFree(u));
  PetscCall(TableDestroy(&one));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestCylinder(void)
{
  static const struct {
    MeshCellType type;
    const char  *word;
    PetscInt     across, along;
  } rows[] = {{MESH_QUAD4, "quad4", 10, 18}, {MESH_TRI6, "tri6", 8, 10}, {MESH_QUAD8, "quad8", 6, 8}, {MESH_QUAD9, "quad9", 5, 8}};
  const PetscReal nu[3] = {0.3, 0.499, 0.4999};
  PetscReal       error;

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(rows) / sizeof(rows[0]); k++)
    for (PetscInt j = 0; j < 3; j++) {
      PetscCall(Cylinder(rows[k].type, FEM_ENHANCED, nu[j], rows[k].across, rows[k].along, &error));
      printf("  cylinder, %-5s %2d x %2d, nu %.4f: worst error of the faces' motion %.4f\n", rows[k].word, (int)rows[k].across, (int)rows[k].along, (double)nu[j], (double)error);
      CheckBelow(error, 0.01);
    }
  PetscCall(Cylinder(MESH_QUAD4, FEM_FULL, 0.4999, 10, 18, &error));
  printf("  cylinder, plain quad4, nu 0.4999: worst error %.2f\n", (double)error);
  CheckAbove(error, 0.5);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- Boussinesq: a force of 1 down on the corner of a quarter of the half-space; its far sides follow the exact field ---- */

#define LOAD_NU 0.3
#define LOAD_G (1000 / 2.6)

/* z points into the body. */
static void Boussinesq(const PetscReal x[3], PetscReal u[3])
{
  const PetscReal r2 = x[0] * x[0] + x[1] * x[1], R = PetscSqrtReal(r2 + x[2] * x[2]), c = 1 / (4 * PETSC_PI * LOAD_G);
  const PetscReal along = c * (x[2] / (R * R * R) - (1 - 2 * LOAD_NU) / (R * (R + x[2])));

  u[0] = along * x[0];
  u[1] = along * x[1];
  u[2] = c / R * (2 * (1 - LOAD_NU) + x[2] * x[2] / (R * R));
}

static PetscErrorCode TestBoussinesq(void)
{
  static const struct {
    MeshCellType type;
    const char  *word;
    PetscInt     n;
    PetscReal    motion, stress;
  } rows[]                    = {{MESH_HEX8, "hex8", 16, 0.02, 0.05}, {MESH_TET10, "tet10", 8, 0.02, 0.05}, {MESH_HEX20, "hex20", 10, 0.02, 0.05}};
  const FemMaterial m         = {1, 1000, LOAD_NU};
  const PetscReal   length[3] = {1, 1, 1}, down[3] = {0, 0, 1};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(rows) / sizeof(rows[0]); k++) {
    const PetscInt n[3] = {rows[k].n, rows[k].n, rows[k].n};
    PetscInt      *held, n_held = 0, corner, points;
    PetscReal     *u, *stress, worst[2] = {0, 0};
    Mesh           mesh;
    FemModel       model;
    Table          quarter;

    PetscCall(CaseBox(PETSC_COMM_SELF, rows[k].type, length, n, 0, &mesh));
    for (PetscInt i = 0; i < 3 * mesh.n_nodes; i++) mesh.x[i] = 0.3 * mesh.x[i] + 0.7 * mesh.x[i] * mesh.x[i]; /* smaller near the load */
    PetscCall(CaseStraighten(&mesh));
    PetscCall(PetscMalloc3(mesh.n_nodes + 1, &held, 3 * mesh.n_nodes, &u, 6 * mesh.n_nodes, &stress));
    for (PetscInt i = 0; i < mesh.n_nodes; i++)
      if (PetscMax(PetscMax(mesh.x[3 * i], mesh.x[3 * i + 1]), mesh.x[3 * i + 2]) > 1 - 1e-9) held[n_held++] = i;
    corner       = CaseNodeAt(&mesh, 0, 0, 0);
    held[n_held] = corner;
    PetscCall(CaseAddNodeGroups(&mesh, n_held + 1, held));
    PetscCall(TableCreateConstant(0.25, &quarter));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
    PetscCall(FemModelSetSymmetry(model, "xmin"));
    PetscCall(FemModelSetSymmetry(model, "ymin"));
    for (PetscInt j = 0; j < n_held; j++) {
      char      name[64];
      PetscReal exact[3];

      PetscCall(BaseFormat(name, "node %d", (int)held[j]));
      Boussinesq(&mesh.x[3 * held[j]], exact);
      for (PetscInt d = 0; d < 3; d++)
        if (d == 2 || mesh.x[3 * held[j] + d] > 1e-9) PetscCall(CaseFix(model, name, d, exact[d]));
    }
    {
      char name[64];

      PetscCall(BaseFormat(name, "node %d", (int)corner));
      PetscCall(FemModelAddForce(model, name, down, &quarter));
    }
    PetscCall(CaseSolve(model));
    PetscCall(FemModelGetField(model, "displacement", u));
    PetscCall(FemModelGetPoints(model, &points, NULL));
    CheckInt(points, mesh.n_nodes);
    PetscCall(FemModelRecover(model, stress, NULL));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) { /* well away from the load, and inside */
      const PetscReal *x = &mesh.x[3 * i], R = PetscSqrtReal(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
      PetscReal        exact[3], off = 0, size = 0;

      if (R < 0.5 || PetscMax(PetscMax(x[0], x[1]), x[2]) > 0.7) continue;
      Boussinesq(x, exact);
      for (PetscInt d = 0; d < 3; d++) {
        off += PetscSqr(u[3 * i + d] - exact[d]);
        size += PetscSqr(exact[d]);
      }
      worst[0] = PetscMax(worst[0], PetscSqrtReal(off / size));
      if (x[2] > 0.3) worst[1] = PetscMax(worst[1], PetscAbsReal(stress[6 * i + 2] * 2 * PETSC_PI * R * R / 3 + PetscPowRealInt(x[2] / R, 3))); /* over the largest at that distance */
    }
    printf("  Boussinesq, %-5s %d a side: worst error of the motion %.4f, of s_zz %.4f\n", rows[k].word, (int)rows[k].n, (double)worst[0], (double)worst[1]);
    CheckAbove(worst[0], 1e-9);
    CheckBelow(worst[0], rows[k].motion);
    CheckBelow(worst[1], rows[k].stress);
    PetscCall(PetscFree3(held, u, stress));
    PetscCall(TableDestroy(&quarter));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestSphere)
CHECK_TEST(TestPlainHex8Locks)
CHECK_TEST(TestCylinder)
CHECK_TEST(TestBoussinesq)

static const struct CMUnitTest tests[] = {TEST(TestSphere), TEST(TestPlainHex8Locks), TEST(TestCylinder), TEST(TestBoussinesq)};
CHECK_MAIN(tests)
