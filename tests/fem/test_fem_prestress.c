/* Stress without strain: in-situ stress in balance moves nothing, free expansion stresses nothing, energies close.  Theory 2.8 */
#include "fem_case.h"

static const FemMaterial rock = {2500, 20e9, 0.25};

/* Ground under its own weight between rollers, the stress of its weight put in: not a nanometre of settlement. */
static PetscErrorCode TestWeightInBalance(void)
{
  const PetscReal    length[3] = {3, 2, 4}, g = 10, gravity[3] = {0, 0, -g}, top = 4, ratio = 0.7, zero[6] = {0};
  const PetscReal    slope[6]  = {ratio * 2500 * g, ratio * 2500 * g, 2500 * g, 0, 0, 0};
  const PetscInt     n[3]      = {3, 2, 4};
  const MeshCellType types[3]  = {MESH_HEX8, MESH_TET4, MESH_TET10};
  const char *const  side[5]   = {"xmin", "xmax", "ymin", "ymax", "zmin"};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 3; t++)
    for (PetscInt moving = 0; moving < 4; moving++) {
      Mesh       mesh;
      FemModel   model;
      PetscReal *u, *s, weight = 2500 * 10 * 24., dt;
      PetscInt   cells;
      Ledger     ledger;
      Stepper    stepper;

      if (moving && t) continue; /* a stepped body takes gravity by its lumped mass: exact on bricks only */
      PetscCall(CaseBox(PETSC_COMM_SELF, types[t], length, n, t || moving ? 0 : 0.2, &mesh));
      PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, moving > 1 ? FEM_IMPLICIT : moving ? FEM_EXPLICIT : FEM_STATIC, 1, &rock, &model));
      if (moving > 1) PetscCall(FemModelSetImplicit(model, moving == 2 ? -1 : 0.6, PETSC_FALSE));
      for (PetscInt k = 0; k < 5; k++) PetscCall(FemModelSetSymmetry(model, side[k]));
      PetscCall(FemModelSetGravity(model, gravity));
      PetscCall(FemModelSetInitialStress(model, "", zero, slope, 2, top));
      PetscCall(FemModelAddHistory(model, "reaction", "zmin"));
      PetscCall(FemModelSetUp(model));
      PetscCall(FemModelGetStepper(model, &stepper));
      PetscCall(FemModelGetStableStep(model, &dt));
      if (moving > 1) dt = 1e-3;
      for (PetscInt k = 0; k < (moving ? 50 : 1); k++) PetscCall(stepper.step(stepper.ctx, moving ? k * dt : 0, moving ? dt : 1));
      PetscCall(FemModelGetCounts(model, NULL, &cells, NULL));
      PetscCall(PetscMalloc2(3 * mesh.n_nodes, &u, 6 * mesh.n_cells, &s));
      PetscCall(FemModelGetField(model, "displacement", u));
      PetscCall(FemModelGetField(model, "element_stress", s));
      for (PetscInt k = 0; k < 3 * mesh.n_nodes; k++) CheckNear(u[k], 0, 1e-12 * weight / (20e9 * 6) * 4); /* of its settlement */
      for (PetscInt c = 0; c < cells; c++) CheckNear(s[6 * c], ratio * s[6 * c + 2], 1e-9 * 2500 * g * top);
      CheckClose(CaseHistory(model, "reaction(zmin).z"), weight, 1e-10);
      CheckClose(CaseHistory(model, "reaction(zmin).normal"), -weight, 1e-10);
      PetscCall(CaseLedger(model, &ledger));
      CheckBelow(LedgerError(&ledger), 1e-11);
      /* 1/2 s:C^-1:s with s = rho g depth (k, k, 1): E e = (1 + 2k^2) - nu (4k + 2k^2), mean of depth^2 = 16/3 */
      CheckClose(ledger.energy[LEDGER_STRAIN], 0.5 * 24 * PetscSqr(2500 * g) * 16. / 3 * (1 + 2 * ratio * ratio - 0.25 * (4 * ratio + 2 * ratio * ratio)) / 20e9, t == 1 ? 0.05 : t || moving ? 1e-10 : 1e-5); /* points of tet4 and of distorted bricks do not integrate a square */
      PetscCall(PetscFree2(u, s));
      PetscCall(FemModelDestroy(&model));
      PetscCall(MeshDestroy(&mesh));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Corners held 3-2-1: no rigid motion, no stress. */
static PetscErrorCode HoldCorners(Mesh *mesh, const PetscReal length[3], PetscInt node[3])
{
  PetscFunctionBeginUser;
  node[0] = CaseNodeAt(mesh, 0, 0, 0);
  node[1] = CaseNodeAt(mesh, length[0], 0, 0);
  node[2] = CaseNodeAt(mesh, 0, length[1], 0);
  PetscCall(CaseAddNodeGroups(mesh, mesh->dim, node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FixCorners(FemModel model, PetscInt dim, const PetscInt node[3])
{
  char name[64];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < dim; k++) {
    PetscCall(BaseFormat(name, "node %d", (int)node[k]));
    for (PetscInt d = 0; d < dim; d++)
      if (k == 0 || (k == 1 && d > 0) || (k == 2 && d > 1)) PetscCall(CaseFix(model, name, d, 0));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Any uniform stress with the tractions that belong to it, on every side. */
static PetscErrorCode TestStressInBalanceWithTractions(void)
{
  const PetscReal    length[3] = {1, 0.8, 0.6}, s0[6] = {-5e6, 2e6, -3e6, 1e6, -2e6, 5e5}, zero[6] = {0};
  const PetscInt     n[3]      = {3, 3, 2};
  const MeshCellType types[6]  = {MESH_HEX8, MESH_TET4, MESH_HEX20, MESH_TET10, MESH_QUAD4, MESH_TRI6};
  const char *const  low[3]    = {"xmin", "ymin", "zmin"}, *const high[3] = {"xmax", "ymax", "zmax"};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 6; t++) {
    const PetscInt  dim  = MeshCellDim(types[t]);
    const PetscReal s[6] = {s0[0], s0[1], s0[2], s0[3], dim == 3 ? s0[4] : 0, dim == 3 ? s0[5] : 0};
    const PetscReal S[3][3] = {{s[0], s[3], s[5]}, {s[3], s[1], s[4]}, {s[5], s[4], s[2]}};
    Mesh            mesh;
    FemModel        model;
    PetscInt        node[3];
    PetscReal      *u;

    PetscCall(CaseBox(PETSC_COMM_SELF, types[t], length, n, t == 0 || t == 1 || t == 4 ? 0.2 : 0, &mesh));
    PetscCall(HoldCorners(&mesh, length, node));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, FEM_STATIC, 0.3, &rock, &model));
    PetscCall(FixCorners(model, dim, node));
    PetscCall(FemModelSetInitialStress(model, "body", s, zero, 0, 0));
    for (PetscInt d = 0; d < dim; d++) {
      PetscCall(CaseTraction(model, high[d], S[d][0], S[d][1], dim == 3 ? S[d][2] : 0));
      PetscCall(CaseTraction(model, low[d], -S[d][0], -S[d][1], dim == 3 ? -S[d][2] : 0));
    }
    PetscCall(CaseSolve(model));
    PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
    PetscCall(FemModelGetField(model, "displacement", u));
    for (PetscInt k = 0; k < 3 * mesh.n_nodes; k++) CheckNear(u[k], 0, 1e-11 * 5e6 / 20e9);
    PetscCall(PetscFree(u));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Free expansion, uniform (all elements) and linear in x (quadratic elements): no stress; clamped between two walls: -E alpha T. */
static PetscErrorCode TestFreeAndClampedExpansion(void)
{
  const PetscReal    length[3] = {1, 0.8, 0.6}, alpha = 1e-5, T = 40, even[4] = {1, 0, 0, 0}, rising[4] = {0, 1, 0, 0};
  const PetscInt     n[3]      = {3, 2, 2};
  const MeshCellType types[6]  = {MESH_HEX8, MESH_TET4, MESH_QUAD4, MESH_HEX20, MESH_TET10, MESH_TRI6};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 6; t++)
    for (PetscInt clamped = 0; clamped < 2; clamped++)
      for (PetscInt field = 0; field < 2; field++) {
        const PetscInt dim = MeshCellDim(types[t]);
        Mesh           mesh;
        FemModel       model;
        PetscInt       node[3], cells;
        PetscReal     *u, *s, *e;
        Table          table;
        Ledger         ledger;

        if (field && (t < 3 || clamped)) continue;
        PetscCall(TableCreateConstant(T, &table));
        PetscCall(CaseBox(PETSC_COMM_SELF, types[t], length, n, t < 3 ? 0.2 : 0, &mesh));
        PetscCall(HoldCorners(&mesh, length, node));
        PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, dim == 3 ? FEM_SOLID : FEM_PLANE_STRESS, FEM_STATIC, 0.3, &rock, &model));
        PetscCall(FixCorners(model, dim, node));
        PetscCall(FemModelSetExpansion(model, "", alpha));
        PetscCall(FemModelAddTemperature(model, "", field ? rising : even, &table));
        if (clamped) {
          PetscCall(CaseFix(model, "xmin", 0, 0));
          PetscCall(CaseFix(model, "xmax", 0, 0));
        }
        PetscCall(CaseSolve(model));
        PetscCall(FemModelGetCounts(model, NULL, &cells, NULL));
        PetscCall(PetscMalloc3(3 * mesh.n_nodes, &u, 6 * cells, &s, 6 * cells, &e));
        PetscCall(FemModelGetField(model, "displacement", u));
        PetscCall(FemModelGetField(model, "element_stress", s));
        PetscCall(FemModelGetField(model, "element_strain", e));
        for (PetscInt c = 0; c < cells; c++)
          for (PetscInt i = 0; i < 6; i++) CheckNear(s[6 * c + i], clamped && i == 0 ? -20e9 * alpha * T : 0, 1e-10 * 20e9 * alpha * T);
        for (PetscInt c = 0; c < cells && !field; c++) CheckNear(e[6 * c + 2], alpha * T * (clamped ? 1 + 0.25 : 1), 1e-10 * alpha * T);
        for (PetscInt i = 0; i < mesh.n_nodes && !clamped && !field; i++)
          for (PetscInt d = 0; d < dim; d++) CheckNear(u[3 * i + d], alpha * T * mesh.x[3 * i + d], 1e-11 * alpha * T);
        PetscCall(CaseLedger(model, &ledger));
        {
          PetscInt        points;
          const PetscInt *of;
          PetscReal      *sp, *ep;

          PetscCall(FemModelGetPoints(model, &points, &of));
          PetscCall(PetscMalloc2(6 * points, &sp, 6 * points, &ep));
          PetscCall(FemModelRecover(model, sp, ep));
          for (PetscInt p = 0; p < points; p++)
            for (PetscInt i = 0; i < 6; i++) CheckNear(sp[6 * p + i], clamped && i == 0 ? -20e9 * alpha * T : 0, 1e-9 * 20e9 * alpha * T);
          for (PetscInt p = 0; p < points && !field; p++) CheckNear(ep[6 * p + 2], alpha * T * (clamped ? 1 + 0.25 : 1), 1e-9 * alpha * T);
          PetscCall(PetscFree2(sp, ep));
        }
        CheckNear(ledger.energy[LEDGER_STRAIN], clamped ? 0.5 * 20e9 * PetscSqr(alpha * T) * 0.8 * (dim == 3 ? 0.6 : 0.3) : 0, 1e-9 * 20e9 * PetscSqr(alpha * T));
        CheckBelow(LedgerError(&ledger), field ? 1e-8 : 1e-9); /* a hundred joules of heat in and out again */
        PetscCall(PetscFree3(u, s, e));
        PetscCall(TableDestroy(&table));
        PetscCall(FemModelDestroy(&model));
        PetscCall(MeshDestroy(&mesh));
      }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A block with in-situ stress let go on one side and heated in time by two sources: the ledger closes to round-off, static, by central differences, by Newmark
   and by generalised-alpha. */
static PetscErrorCode TestEnergyOfHeat(void)
{
  const PetscReal length[3] = {1, 0.8, 0.6}, s0[6] = {-5e6, 2e6, -3e6, 1e6, 0, 0}, slope[6] = {1e6, 0, 2e6, 0, 0, 0}, field[2][4] = {{1, 0, 0, 0}, {-0.5, 1, 2, 0}};
  const PetscReal v[2][3] = {{5, 60, 20}, {0, -30, 10}};
  const PetscInt  n[3] = {3, 3, 2};

  PetscFunctionBeginUser;
  for (PetscInt moving = 0; moving < 2; moving++) {
    Mesh      mesh;
    FemModel  model;
    Stepper   s;
    Ledger    ledger;
    Table     table[2];
    PetscReal dt = 1;

    PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX8, length, n, 0.2, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, moving > 1 ? FEM_IMPLICIT : moving ? FEM_EXPLICIT : FEM_STATIC, 1, &rock, &model));
    if (moving > 1) PetscCall(FemModelSetImplicit(model, moving == 2 ? -1 : 0.6, PETSC_FALSE));
    for (PetscInt d = 0; d < 3; d++) PetscCall(CaseFix(model, "xmin", d, 0));
    PetscCall(FemModelSetInitialStress(model, "", s0, slope, 1, 0.3));
    PetscCall(FemModelSetExpansion(model, "", 1e-5));
    for (PetscInt k = 0; k < 2; k++) {
      const PetscReal t[3] = {0, moving ? 1e-3 : 3, moving ? 2e-3 : 7};

      PetscCall(TableCreate(3, t, v[k], &table[k]));
      PetscCall(FemModelAddTemperature(model, k ? "body" : "", field[k], &table[k]));
      PetscCall(TableDestroy(&table[k]));
    }
    PetscCall(CaseTraction(model, "xmax", 1e6, 2e5, 0));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetStepper(model, &s));
    if (moving == 1) PetscCall(FemModelGetStableStep(model, &dt));
    if (moving > 1) dt = 7e-5;
    for (PetscInt k = 0; k < (moving ? 100 : 8); k++) {
      PetscCall(s.step(s.ctx, k * dt, dt));
      PetscCall(CaseLedger(model, &ledger));
      CheckBelow(LedgerError(&ledger), 1e-11);
    }
    CheckAbove(ledger.energy[LEDGER_STRAIN], 1);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestPrestressRefusals(void)
{
  const PetscReal length[3] = {1, 1, 1}, s[6] = {0, 0, 1e6, 0, 0, 0}, zero[6] = {0}, even[4] = {1, 0, 0, 0};
  const PetscInt  n[3]      = {1, 1, 1};
  Mesh            mesh;
  FemModel        model;
  Table           table;

  PetscFunctionBeginUser;
  PetscCall(TableCreateConstant(10, &table));
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_STATIC, 1, &rock, &model));
  CheckFails(FemModelSetInitialStress(model, "", s, zero, 0, 0), PETSC_ERR_USER_INPUT, "no stress across the plane");
  CheckFails(FemModelSetInitialStress(model, "xmin", zero, zero, 0, 0), PETSC_ERR_USER_INPUT, "fills a group of dimension 2");
  PetscCall(FemModelAddTemperature(model, "", even, &table));
  PetscCall(FemModelSetSymmetry(model, "xmin"));
  PetscCall(FemModelSetSymmetry(model, "ymin"));
  CheckFails(FemModelSetUp(model), PETSC_ERR_USER_INPUT, "no material has an expansion");
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscCall(TableDestroy(&table));
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestWeightInBalance)
CHECK_TEST(TestStressInBalanceWithTractions)
CHECK_TEST(TestFreeAndClampedExpansion)
CHECK_TEST(TestEnergyOfHeat)
CHECK_TEST(TestPrestressRefusals)

static const struct CMUnitTest tests[] = {TEST(TestWeightInBalance), TEST(TestStressInBalanceWithTractions), TEST(TestFreeAndClampedExpansion), TEST(TestEnergyOfHeat), TEST(TestPrestressRefusals)};

CHECK_MAIN(tests)
