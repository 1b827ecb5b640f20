/* Patch tests: any linear field on any mesh is solved exactly, by displacement or by traction.  Notes P1, P2 */
#include "fem_case.h"

#define KINDS 13
#define PLANE 5 /* the first five are of the plane */
static const MeshCellType types[KINDS] = {MESH_TRI3, MESH_QUAD4, MESH_TRI6, MESH_QUAD8, MESH_QUAD9, MESH_TET4, MESH_HEX8, MESH_PRISM6, MESH_TET10, MESH_HEX20, MESH_HEX27, MESH_PRISM15, MESH_PRISM18};

static void Linear(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * (0.7 * x[0] + 0.4 * x[1] - 0.2 * x[2] + 0.1);
  u[1] = 1e-3 * (-0.3 * x[0] + 0.5 * x[1] + 0.6 * x[2]);
  u[2] = 1e-3 * (0.2 * x[0] + 0.1 * x[1] - 0.4 * x[2]);
}

static PetscErrorCode TestDisplacementPatch(void)
{
  const FemMaterial m         = {1000, 1e6, 0.3};
  const PetscReal   length[3] = {1, 0.8, 0.6};
  const PetscInt    n[3]      = {3, 2, 2};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < KINDS; t++)
    for (PetscInt kind = 0; kind < (t < PLANE ? 2 : 1); kind++) {
      const FemKind   k      = t >= PLANE ? FEM_SOLID : kind ? FEM_PLANE_STRESS : FEM_PLANE_STRAIN;
      const PetscReal mu     = m.young / 2.6, lambda = m.young * 0.3 / (1.3 * 0.4), plane = 2 * lambda * mu / (lambda + 2 * mu);
      PetscReal       want[6], *u, *s, h[3][3] = {{0.7e-3, 0.4e-3, -0.2e-3}, {-0.3e-3, 0.5e-3, 0.6e-3}, {0.2e-3, 0.1e-3, -0.4e-3}}, trace;
      PetscInt       *surface, n_surface;
      Mesh            mesh;
      FemModel        model;

      PetscCall(CaseBox(PETSC_COMM_SELF, types[t], length, n, 0.25, &mesh));
      PetscCall(PetscMalloc3(mesh.n_nodes, &surface, 3 * mesh.n_nodes, &u, 6 * mesh.n_cells, &s));
      n_surface = CaseSurface(&mesh, length, -1, surface);
      PetscCall(CaseAddNodeGroups(&mesh, n_surface, surface));
      PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, k, FEM_STATIC, 0.7, &m, &model));
      PetscCall(CaseFixNodes(model, mesh.dim, n_surface, surface, mesh.x, Linear));
      PetscCall(CaseSolve(model));
      PetscCall(FemModelGetField(model, "displacement", u));
      for (PetscInt i = 0; i < mesh.n_nodes; i++) {
        PetscReal exact[3];

        Linear(&mesh.x[3 * i], exact);
        for (PetscInt d = 0; d < mesh.dim; d++) CheckNear(u[3 * i + d], exact[d], 1e-13);
      }
      trace = h[0][0] + h[1][1] + (t < PLANE ? 0 : h[2][2]);
      for (PetscInt i = 0; i < 3; i++) {
        want[i]     = 2 * mu * (t < PLANE && i == 2 ? 0 : h[i][i]) + (kind ? plane : lambda) * trace;
        want[3 + i] = t < PLANE && i > 0 ? 0 : mu * (h[i][(i + 1) % 3] + h[(i + 1) % 3][i]);
      }
      if (kind) want[2] = 0;
      PetscCall(FemModelGetField(model, "element_stress", s));
      {
        PetscInt cells;

        PetscCall(FemModelGetCounts(model, NULL, &cells, NULL));
        for (PetscInt c = 0; c < cells; c++)
          for (PetscInt i = 0; i < 6; i++) CheckNear(s[6 * c + i], want[i], 1e-10 * 1000);
      }
      PetscCall(PetscFree3(surface, u, s));
      PetscCall(FemModelDestroy(&model));
      PetscCall(MeshDestroy(&mesh));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Uniaxial tension by traction, rollers on three sides: s_xx = p everywhere, e_yy = -nu p/E. */
static PetscErrorCode TestTractionPatch(void)
{
  const FemMaterial m         = {1000, 2e9, 0.25};
  const PetscReal   length[3] = {1, 0.8, 0.6}, p = 3e6;
  const PetscInt    n[3]      = {3, 2, 2};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < KINDS; t++) {
    Mesh       mesh;
    FemModel   model;
    PetscReal *u;

    PetscCall(CaseBox(PETSC_COMM_SELF, types[t], length, n, 0.25, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, t < PLANE ? FEM_PLANE_STRESS : FEM_SOLID, FEM_STATIC, 0.05, &m, &model));
    PetscCall(CaseFix(model, "xmin", 0, 0));
    PetscCall(CaseFix(model, "ymin", 1, 0));
    if (t >= PLANE) PetscCall(CaseFix(model, "zmin", 2, 0));
    PetscCall(CaseTraction(model, "xmax", p, 0, 0));
    PetscCall(FemModelAddHistory(model, "reaction", "xmin"));
    PetscCall(CaseSolve(model));
    PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
    PetscCall(FemModelGetField(model, "displacement", u));
    for (PetscInt i = 0; i < mesh.n_nodes; i++)
      for (PetscInt d = 0; d < mesh.dim; d++) CheckNear(u[3 * i + d], p / m.young * mesh.x[3 * i + d] * (d == 0 ? 1 : -m.poisson), 1e-10 * p / m.young);
    CheckClose(CaseHistory(model, "reaction(xmin).x"), -p * 0.8 * (t < PLANE ? 0.05 : 0.6), 1e-10);
    PetscCall(PetscFree(u));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void MacNealPlane(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * (x[0] + x[1] / 2);
  u[1] = 1e-3 * (x[1] + x[0] / 2);
  u[2] = 0;
}

static void MacNealSolid(const PetscReal x[3], PetscReal u[3])
{
  for (PetscInt i = 0; i < 3; i++) u[i] = 0.5e-3 * (2 * x[i] + x[(i + 1) % 3] + x[(i + 2) % 3]);
}

/* MacNeal and Harder's patches as published: stress 1333.33 and 400 in the plane, 2000 and 400 in space. */
static PetscErrorCode MacNeal(PetscInt dim, PetscInt n_nodes, PetscReal (*place)[3], PetscInt n_cells, const PetscInt *node, MeshCellType type, PetscInt n_outer, CaseField field, PetscReal direct, PetscReal shear)
{
  const FemMaterial m     = {1, 1e6, 0.25};
  const PetscInt    outer[8] = {0, 1, 2, 3, 4, 5, 6, 7};
  PetscInt          per   = MeshCellNodes(type), id[16], all[16], cell_id[16], start[17];
  MeshCellType      kinds[16];
  MeshGroup         group = {"body", dim, n_cells, all};
  Mesh              mesh  = {"patch", dim, n_nodes, place[0], id, n_cells, kinds, cell_id, start, (PetscInt *)node, 1, &group}, copy;
  FemModel          model;
  PetscReal         s[6 * 16], zz;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 16; k++) {
    id[k] = cell_id[k] = k + 1;
    all[k]             = k;
    kinds[k]           = type;
  }
  for (PetscInt k = 0; k <= 16; k++) start[k] = per * k;
  copy = mesh; /* owned copies, so that groups can be added */
  PetscCall(PetscMalloc2(3 * n_nodes, &copy.x, n_nodes, &copy.id));
  PetscCall(PetscArraycpy(copy.x, mesh.x, 3 * n_nodes));
  PetscCall(PetscArraycpy(copy.id, id, n_nodes));
  PetscCall(PetscMalloc3(n_cells, &copy.type, n_cells, &copy.cell_id, n_cells + 1, &copy.start));
  PetscCall(PetscArraycpy(copy.type, kinds, n_cells));
  PetscCall(PetscArraycpy(copy.cell_id, cell_id, n_cells));
  PetscCall(PetscArraycpy(copy.start, start, n_cells + 1));
  PetscCall(PetscMalloc1(per * n_cells, &copy.node));
  PetscCall(PetscArraycpy(copy.node, node, per * n_cells));
  PetscCall(PetscMalloc1(1, &copy.group));
  copy.group[0] = group;
  PetscCall(PetscMalloc1(n_cells, &copy.group[0].cell));
  PetscCall(PetscArraycpy(copy.group[0].cell, all, n_cells));

  PetscCall(CaseAddNodeGroups(&copy, n_outer, outer));
  PetscCall(CaseModel(PETSC_COMM_SELF, &copy, dim == 2 ? FEM_PLANE_STRESS : FEM_SOLID, FEM_STATIC, 1e-3, &m, &model));
  PetscCall(CaseFixNodes(model, dim, n_outer, outer, copy.x, field));
  PetscCall(CaseSolve(model));
  PetscCall(FemModelGetField(model, "element_stress", s));
  zz = dim == 2 ? 0 : direct;
  for (PetscInt c = 0; c < n_cells; c++) {
    CheckClose(s[6 * c], direct, 1e-10);
    CheckClose(s[6 * c + 1], direct, 1e-10);
    CheckNear(s[6 * c + 2], zz, 1e-10 * direct);
    CheckClose(s[6 * c + 3], shear, 1e-10);
    CheckNear(s[6 * c + 4], dim == 2 ? 0 : shear, 1e-10 * shear);
  }
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestMacNealHarder(void)
{
  PetscReal      plane[8][3]  = {{0, 0, 0}, {0.24, 0, 0}, {0.24, 0.12, 0}, {0, 0.12, 0}, {0.04, 0.02, 0}, {0.18, 0.03, 0}, {0.16, 0.08, 0}, {0.08, 0.08, 0}};
  const PetscInt quads[5][4]  = {{0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}, {4, 5, 6, 7}};
  const PetscInt tris[10][3]  = {{0, 1, 5}, {0, 5, 4}, {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}, {4, 5, 6}, {4, 6, 7}};
  PetscReal      solid[16][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {.249, .342, .192}, {.826, .288, .288}, {.850, .649, .263}, {.273, .750, .230}, {.320, .186, .643}, {.677, .305, .683}, {.788, .693, .644}, {.165, .745, .702}};
  const PetscInt hexes[7][8]  = {{8, 9, 10, 11, 12, 13, 14, 15}, {0, 1, 2, 3, 8, 9, 10, 11}, {12, 13, 14, 15, 4, 5, 6, 7}, {0, 1, 9, 8, 4, 5, 13, 12}, {11, 10, 2, 3, 15, 14, 6, 7}, {0, 8, 11, 3, 4, 12, 15, 7}, {9, 1, 2, 10, 13, 5, 6, 14}};

  PetscFunctionBeginUser;
  PetscCall(MacNeal(2, 8, plane, 5, quads[0], MESH_QUAD4, 4, MacNealPlane, 1e6 / 0.75 * 1e-3, 400));
  PetscCall(MacNeal(2, 8, plane, 10, tris[0], MESH_TRI3, 4, MacNealPlane, 1e6 / 0.75 * 1e-3, 400));
  PetscCall(MacNeal(3, 16, solid, 7, hexes[0], MESH_HEX8, 8, MacNealSolid, 2000, 400));
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestDisplacementPatch)
CHECK_TEST(TestTractionPatch)
CHECK_TEST(TestMacNealHarder)

static const struct CMUnitTest tests[] = {TEST(TestDisplacementPatch), TEST(TestTractionPatch), TEST(TestMacNealHarder)};
CHECK_MAIN(tests)
