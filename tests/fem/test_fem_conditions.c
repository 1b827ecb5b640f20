/* What acts on the body: symmetry on planes in any direction, total forces, lines and points.  Theory 2.5 */
#include "fem_case.h"

static void Turn(PetscReal angle, const PetscReal axis[3], const PetscReal x[3], PetscReal y[3])
{
  const PetscReal c = PetscCosReal(angle), s = PetscSinReal(angle), dot = axis[0] * x[0] + axis[1] * x[1] + axis[2] * x[2];

  for (PetscInt d = 0; d < 3; d++) {
    const PetscInt e = (d + 1) % 3, f = (d + 2) % 3;

    y[d] = c * x[d] + s * (axis[e] * x[f] - axis[f] * x[e]) + (1 - c) * dot * axis[d];
  }
}

/* A slanting axis in 3D, z in 2D. */
static const PetscReal slant[3] = {2. / 7, 3. / 7, 6. / 7}, upright[3] = {0, 0, 1};

static const PetscReal *AxisOf(PetscInt dim)
{
  return dim == 3 ? slant : upright;
}

static void TurnMesh(Mesh *mesh, PetscReal angle)
{
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    const PetscReal x[3] = {mesh->x[3 * i], mesh->x[3 * i + 1], mesh->x[3 * i + 2]};

    Turn(angle, AxisOf(mesh->dim), x, &mesh->x[3 * i]);
  }
}

static const char *const low[3] = {"xmin", "ymin", "zmin"};

/* A box on planes of symmetry that meet in edges and a corner, pulled on its far side; turned by angle about a slanting axis. */
static PetscErrorCode BoxOnPlanes(MeshCellType type, PetscReal angle, FemMethod method, Mesh *mesh, FemModel *model)
{
  const FemMaterial m         = {2400, 30e9, 0.2};
  const PetscReal   length[3] = {1, 0.8, 0.6}, pull[3] = {1e6, 4e5, -2e5};
  const PetscInt    n[3]      = {4, 3, 3}, dim = MeshCellDim(type);
  PetscReal         turned[3];

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, 0.2, mesh));
  TurnMesh(mesh, angle);
  PetscCall(CaseModel(PETSC_COMM_SELF, mesh, dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, method, 0.3, &m, model));
  for (PetscInt d = 0; d < dim; d++) PetscCall(FemModelSetSymmetry(*model, low[d]));
  Turn(angle, AxisOf(dim), (PetscReal[3]){pull[0], pull[1], dim == 3 ? pull[2] : 0}, turned);
  PetscCall(CaseTraction(*model, "xmax", turned[0], turned[1], turned[2]));
  PetscCall(FemModelAddHistory(*model, "reaction", "ymin"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Turning the whole problem turns its answer: planes across the axes are plain fixes, turned ones need frames. */
static PetscErrorCode TestTurnedPlanesGiveTheTurnedAnswer(void)
{
  const MeshCellType types[4] = {MESH_HEX8, MESH_TET4, MESH_QUAD4, MESH_TRI3};
  const PetscReal    angle    = 0.7;

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) {
    Mesh       mesh[2];
    FemModel   model[2];
    PetscReal *u[2], most = 0;
    Ledger     ledger[2];

    for (PetscInt k = 0; k < 2; k++) {
      PetscCall(BoxOnPlanes(types[t], k * angle, FEM_STATIC, &mesh[k], &model[k]));
      PetscCall(CaseSolve(model[k]));
      PetscCall(PetscMalloc1(3 * mesh[k].n_nodes, &u[k]));
      PetscCall(FemModelGetField(model[k], "displacement", u[k]));
      PetscCall(CaseLedger(model[k], &ledger[k]));
    }
    for (PetscInt k = 0; k < 3 * mesh[0].n_nodes; k++) most = PetscMax(most, PetscAbsReal(u[0][k]));
    for (PetscInt i = 0; i < mesh[0].n_nodes; i++) {
      PetscReal want[3];

      Turn(angle, AxisOf(mesh[0].dim), &u[0][3 * i], want);
      for (PetscInt d = 0; d < 3; d++) CheckNear(u[1][3 * i + d], want[d], 1e-11 * most);
    }
    CheckClose(CaseHistory(model[1], "reaction(ymin).normal"), CaseHistory(model[0], "reaction(ymin).normal"), 1e-9);
    CheckClose(ledger[1].energy[LEDGER_STRAIN], ledger[0].energy[LEDGER_STRAIN], 1e-10);
    CheckClose(ledger[1].energy[LEDGER_WORK], ledger[1].energy[LEDGER_STRAIN], 1e-10);
    for (PetscInt k = 0; k < 2; k++) {
      PetscCall(PetscFree(u[k]));
      PetscCall(FemModelDestroy(&model[k]));
      PetscCall(MeshDestroy(&mesh[k]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same in motion: at every step the turned answer, nothing through the planes, the ledger closed, the same critical step. */
static PetscErrorCode TestTurnedPlanesInMotion(void)
{
  const PetscReal angle = 0.7;
  Mesh            mesh[2];
  FemModel        model[2];
  Stepper         s[2];
  PetscReal      *u[2], dt, critical[2], most = 0, normal[3];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 2; k++) {
    PetscCall(BoxOnPlanes(MESH_HEX8, k * angle, FEM_EXPLICIT, &mesh[k], &model[k]));
    PetscCall(FemModelSetUp(model[k]));
    PetscCall(FemModelGetStepper(model[k], &s[k]));
    PetscCall(FemModelGetCriticalStep(model[k], &critical[k]));
    PetscCall(PetscMalloc1(3 * mesh[k].n_nodes, &u[k]));
  }
  CheckClose(critical[1], critical[0], 1e-3);
  dt = 0.9 * critical[0];
  for (PetscInt step = 0; step < 200; step++)
    for (PetscInt k = 0; k < 2; k++) PetscCall(s[k].step(s[k].ctx, step * dt, dt));
  for (PetscInt k = 0; k < 2; k++) {
    Ledger ledger;

    PetscCall(FemModelGetField(model[k], "displacement", u[k]));
    PetscCall(CaseLedger(model[k], &ledger));
    CheckBelow(LedgerError(&ledger), 1e-11);
  }
  for (PetscInt k = 0; k < 3 * mesh[0].n_nodes; k++) most = PetscMax(most, PetscAbsReal(u[0][k]));
  Turn(angle, slant, (PetscReal[3]){1, 0, 0}, normal);
  for (PetscInt i = 0; i < mesh[0].n_nodes; i++) {
    PetscReal want[3], x[3];

    Turn(angle, slant, &u[0][3 * i], want);
    Turn(-angle, slant, &mesh[1].x[3 * i], x);
    for (PetscInt d = 0; d < 3; d++) CheckNear(u[1][3 * i + d], want[d], 1e-10 * most);
    if (PetscAbsReal(x[0]) < 1e-9) CheckNear(u[1][3 * i] * normal[0] + u[1][3 * i + 1] * normal[1] + u[1][3 * i + 2] * normal[2], 0, 1e-15 * most);
  }
  CheckClose(CaseHistory(model[1], "reaction(ymin).normal"), CaseHistory(model[0], "reaction(ymin).normal"), 1e-8);
  for (PetscInt k = 0; k < 2; k++) {
    PetscCall(PetscFree(u[k]));
    PetscCall(FemModelDestroy(&model[k]));
    PetscCall(MeshDestroy(&mesh[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A square turned by 45 degrees slides along its lower left side while its lower right side is pushed with 1 mm along y: a rigid
   motion along the plane would be (1, 1)/sqrt(2); the group pushed along y and x follows the plane when both agree. */
static PetscErrorCode TestSupportsMeetPlanes(void)
{
  const FemMaterial m         = {2400, 30e9, 0};
  const PetscReal   length[3] = {1, 1, 1};
  const PetscInt    n[3]      = {2, 2, 1};
  Mesh              mesh;
  FemModel          model;
  PetscReal        *u;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  TurnMesh(&mesh, PETSC_PI / 4);
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRAIN, FEM_STATIC, 1, &m, &model));
  PetscCall(FemModelSetSymmetry(model, "ymin")); /* normal (1, -1)/sqrt 2: slides along (1, 1) */
  for (PetscInt d = 0; d < 2; d++) PetscCall(CaseFix(model, "xmax", d, 1e-3));
  PetscCall(CaseSolve(model));
  PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
  PetscCall(FemModelGetField(model, "displacement", u));
  for (PetscInt i = 0; i < mesh.n_nodes; i++)
    for (PetscInt d = 0; d < 2; d++) CheckNear(u[3 * i + d], 1e-3, 1e-14);
  PetscCall(FemModelDestroy(&model));

  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRAIN, FEM_STATIC, 1, &m, &model));
  PetscCall(FemModelSetSymmetry(model, "ymin"));
  PetscCall(CaseFix(model, "xmax", 0, 1e-3));
  PetscCall(CaseFix(model, "xmax", 1, 2e-3));
  CheckFails(FemModelSetUp(model), PETSC_ERR_USER_INPUT, "group 'xmax' moves node");
  PetscCall(FemModelDestroy(&model));

  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRAIN, FEM_STATIC, 1, &m, &model));
  PetscCall(FemModelSetSymmetry(model, "ymin"));
  CheckFails(FemModelSetUp(model), PETSC_ERR_USER_INPUT, "can move along (0.707, 0.707, 0)");
  PetscCall(FemModelDestroy(&model));
  PetscCall(PetscFree(u));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestCurvedGroupIsRefused(void)
{
  const FemMaterial m         = {2400, 30e9, 0.2};
  const PetscReal   length[3] = {1, 1, 1};
  const PetscInt    n[3]      = {3, 3, 3};
  Mesh              mesh;
  FemModel          model;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX8, length, n, 0, &mesh));
  for (PetscInt i = 0; i < mesh.n_nodes; i++) mesh.x[3 * i] += 0.05 * mesh.x[3 * i + 1] * mesh.x[3 * i + 1];
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
  CheckFails(FemModelSetSymmetry(model, "xmax"), PETSC_ERR_USER_INPUT, "is not flat: its sides turn by up to 3.81 degrees");
  CheckFails(FemModelSetSymmetry(model, "body"), PETSC_ERR_USER_INPUT, "a plane of symmetry is a group of dimension 2");
  PetscCall(FemModelSetSymmetry(model, "ymax"));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A total force is the traction F/A on a side, and the same total on a point or a line of a wedge-shaped block. */
static PetscErrorCode TestTotalForces(void)
{
  const FemMaterial  m         = {2400, 30e9, 0.2};
  const PetscReal    length[3] = {1, 0.8, 0.6}, F[3] = {3e3, -2e3, 7e3};
  const PetscInt     n[3]      = {4, 3, 3};
  const char *const  where[3]  = {"xmax", "edge", "node 0"};
  const MeshCellType types[2]  = {MESH_HEX8, MESH_TET4};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 2; t++) {
    Mesh       mesh;
    FemModel   model;
    PetscReal *u[2];
    Table      one;

    PetscCall(TableCreateConstant(1, &one));
    PetscCall(CaseBox(PETSC_COMM_SELF, types[t], length, n, 0.2, &mesh));
    PetscCall(CaseAddNodeGroups(&mesh, 1, (PetscInt[1]){0}));
    PetscCall(CaseAddLine(&mesh, "edge", (PetscReal[3]){1, 0, 0.6}, (PetscReal[3]){1, 0.8, 0.6}));
    for (PetscInt k = 0; k < 2; k++) {
      PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
      for (PetscInt d = 0; d < 3; d++) PetscCall(CaseFix(model, "xmin", d, 0));
      if (k) PetscCall(FemModelAddForce(model, "xmax", F, &one));
      else PetscCall(CaseTraction(model, "xmax", F[0] / 0.48, F[1] / 0.48, F[2] / 0.48));
      PetscCall(CaseSolve(model));
      PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u[k]));
      PetscCall(FemModelGetField(model, "displacement", u[k]));
      PetscCall(FemModelDestroy(&model));
    }
    for (PetscInt k = 0; k < 3 * mesh.n_nodes; k++) CheckNear(u[1][k], u[0][k], 1e-14 * PetscAbsReal(u[0][3 * (mesh.n_nodes - 1) + 2]) + 1e-20);
    for (PetscInt k = 0; k < 2; k++) PetscCall(PetscFree(u[k]));
    for (PetscInt k = 0; k < 4; k++) { /* total on a side, a line, a point; 5 kN/m on the line */
      PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
      for (PetscInt d = 0; d < 3; d++) PetscCall(CaseFix(model, k == 2 ? "xmax" : "xmin", d, 0));
      if (k < 3) PetscCall(FemModelAddForce(model, where[k], F, &one));
      else PetscCall(FemModelAddLineLoad(model, "edge", (PetscReal[3]){0, 0, 5e3}, &one));
      PetscCall(FemModelAddHistory(model, "reaction", k == 2 ? "xmax" : "xmin"));
      PetscCall(CaseSolve(model));
      CheckNear(CaseHistory(model, k == 2 ? "reaction(xmax).x" : "reaction(xmin).x"), k < 3 ? -F[0] : 0, 1e-7);
      CheckNear(CaseHistory(model, k == 2 ? "reaction(xmax).z" : "reaction(xmin).z"), k < 3 ? -F[2] : -5e3 * 0.8, 1e-7);
      PetscCall(FemModelDestroy(&model));
    }
    PetscCall(TableDestroy(&one));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Loads, reactions, inertia and drag add up to nothing, in force and moment, standing and moving, on slanting planes. */
static PetscErrorCode TestBalance(void)
{
  static const char *const column[6] = {"balance.x", "balance.y", "balance.z", "balance.about_x", "balance.about_y", "balance.about_z"};

  PetscFunctionBeginUser;
  for (PetscInt moving = 0; moving < 3; moving++) { /* static, explicit, implicit */
    Mesh      mesh;
    FemModel  model;
    Stepper   s;
    PetscReal dt = moving ? 2e-5 : 1;

    PetscCall(BoxOnPlanes(MESH_TET4, 0.7, moving == 2 ? FEM_IMPLICIT : moving ? FEM_EXPLICIT : FEM_STATIC, &mesh, &model));
    PetscCall(FemModelAddHistory(model, "balance", ""));
    if (moving) PetscCall(FemModelSetDamping(model, 500));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetStepper(model, &s));
    if (moving == 1) PetscCall(FemModelGetStableStep(model, &dt));
    for (PetscInt k = 0; k < (moving ? 40 : 1); k++) PetscCall(s.step(s.ctx, k * dt, dt));
    for (PetscInt k = 0; k < 6; k++) CheckNear(CaseHistory(model, column[k]), 0, 1e-9 * 1e6 * 0.48);
    CheckAbove(PetscAbsReal(CaseHistory(model, "reaction(ymin).normal")), 1e3);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void ThirtyDegrees(const PetscReal x[3], PetscReal u[3])
{
  PetscReal y[3];

  Turn(PETSC_PI / 6, slant, x, y);
  for (PetscInt d = 0; d < 3; d++) u[d] = y[d] - x[d];
}

static PetscErrorCode TestTurnOfElements(void)
{
  const FemMaterial m         = {2400, 30e9, 0.2};
  const PetscReal   length[3] = {1, 1, 1};
  const PetscInt    n[3]      = {2, 2, 2};
  PetscInt         *node, count;
  PetscReal         turn;
  Mesh              mesh;
  FemModel          model;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX8, length, n, 0, &mesh));
  PetscCall(PetscMalloc1(mesh.n_nodes, &node));
  count = CaseSurface(&mesh, length, -1, node);
  PetscCall(CaseAddNodeGroups(&mesh, count, node));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
  PetscCall(CaseFixNodes(model, 3, count, node, mesh.x, ThirtyDegrees));
  PetscCall(CaseSolve(model));
  PetscCall(FemModelGetTurn(model, &turn));
  CheckNear(turn, PETSC_PI / 6, 1e-9);
  PetscCall(PetscFree(node));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestBalance)
CHECK_TEST(TestTurnOfElements)
CHECK_TEST(TestTurnedPlanesGiveTheTurnedAnswer)
CHECK_TEST(TestTurnedPlanesInMotion)
CHECK_TEST(TestSupportsMeetPlanes)
CHECK_TEST(TestCurvedGroupIsRefused)
CHECK_TEST(TestTotalForces)

static const struct CMUnitTest tests[] = {TEST(TestBalance), TEST(TestTurnOfElements), TEST(TestTurnedPlanesGiveTheTurnedAnswer), TEST(TestTurnedPlanesInMotion), TEST(TestSupportsMeetPlanes), TEST(TestCurvedGroupIsRefused), TEST(TestTotalForces)};

CHECK_MAIN(tests)
