/* Quadratic elements that turn into particles in the middle of a run: what test_switch asks of linear ones. */
#include "check.h"
#include "switched.h"

static PetscErrorCode Conditions(Switched *s, FemModel fem, DemModel dem)
{
  const PetscBool bends = (PetscBool)(s->load > 0);
  const PetscReal t[2] = {0, bends ? 250 : 30}, v[2] = {0, bends ? s->load : 1e-6}, pull[3] = {!bends, bends, 0};
  Table           ramp, none;

  PetscFunctionBegin;
  PetscCall(TableCreate(2, t, v, &ramp));
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt d = 0; d < (bends ? s->dim : 1); d++) PetscCall(FemModelFix(fem, "xmin", d, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(fem, "xmax", pull, &ramp));
  PetscCall(FemModelAddHistory(fem, "reaction", "xmin"));
  PetscCall(CouplingSwitchProtect(s->sw, "xmin"));
  PetscCall(CouplingSwitchProtect(s->sw, "xmax"));
  PetscCall(FemModelSetDamping(fem, bends ? 0.02 : 0.15));
  PetscCall(DemModelSetLocalDamping(dem, 0.3));
  PetscCall(TableDestroy(&ramp));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Turns the cells in the box once the body has settled: the reaction afterwards, what is booked, bonds above strength, the ledger. */
static PetscErrorCode TurnAndWatch(Switched *s, PetscInt settle, PetscInt n, const PetscReal low[3], const PetscReal high[3])
{
  const PetscInt       column = s->load > 0 ? 1 : 0;
  CouplingSwitchReport report;
  PetscReal            before, after, change = 0, injected;
  PetscInt             k = 0;
  Ledger               ledger = {{0}};

  PetscFunctionBegin;
  PetscCall(SwitchedCreate(s));
  PetscCall(SwitchedSteps(s, &k, settle));
  PetscCall(s->stepper.history(s->sw, column, &before));
  PetscCall(SwitchedConvert(s, low, high));
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(SwitchedSteps(s, &k, 1));
    PetscCall(s->stepper.history(s->sw, column, &after));
    change = PetscMax(change, PetscAbsReal(after / before - 1));
  }
  PetscCall(CouplingSwitchGetReport(s->sw, &report));
  PetscCall(s->stepper.energy(s->sw, &ledger));
  CheckInt(report.n_events, 1);
  injected = -report.event[0].booked / report.event[0].before[LEDGER_STRAIN];
  print_message("           %2d nodes, %s: %d elements turned, %d particles woke; reaction changes by %.1e, injected %.1e of the strain energy, ledger error %.1e\n", (int)MeshCellNodes(s->type), s->load > 0 ? "beam" : "bar", (int)report.event[0].cells,
                (int)report.event[0].particles, (double)change, (double)injected, (double)LedgerError(&ledger));
  CheckAbove(report.event[0].particles, 1);
  CheckInt(report.event[0].above, 0);
  CheckBelow(change, 0.01);
  CheckBelow(PetscAbsReal(injected), 1e-3);
  CheckBelow(LedgerError(&ledger), 0.01);
  PetscCall(SwitchedDestroy(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Drawn to a uniform stress, then the middle turns. */
static PetscErrorCode TestBar(void)
{
  static const MeshCellType type[] = {MESH_QUAD9, MESH_QUAD8, MESH_TRI6, MESH_HEX27};

  PetscFunctionBeginUser;
  for (size_t i = 0; i < sizeof(type) / sizeof(type[0]); i++) {
    const PetscInt  dim = MeshCellDim(type[i]);
    const PetscReal low[3] = {dim == 2 ? 8 : 4, -1, -1}, high[3] = {dim == 2 ? 12 : 6, 9, 9};
    Switched        s = SwitchedDefault(dim, dim == 2 ? 18 : 9, dim == 2 ? 3 : 1, dim == 2 ? 0 : 1);

    s.type        = type[i];
    s.ratio       = dim == 2 ? 6 : 8;
    s.width       = dim == 2 ? 2 : 1;
    s.start[0][0] = dim == 2 ? 5 : 3;
    s.start[0][1] = dim == 2 ? 6 : 4;
    s.conditions  = Conditions;
    PetscCall(TurnAndWatch(&s, dim == 2 ? 4000 : 2500, dim == 2 ? 400 : 100, low, high));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBar)

/* A cantilever bent by a force at its tip: the tensile side of its middle turns, in cells of twice the edge of test_switch's. */
static PetscErrorCode TestBeam(void)
{
  static const MeshCellType type[] = {MESH_QUAD9, MESH_TRI6};

  PetscFunctionBeginUser;
  for (size_t i = 0; i < sizeof(type) / sizeof(type[0]); i++) {
    const PetscReal low[3] = {12, 6, -1}, high[3] = {16, 11, 9};
    Switched        s = SwitchedDefault(2, 30, 10, 0);

    s.type        = type[i];
    s.h           = 2;
    s.ratio       = 6;
    s.width       = 1;
    s.start[0][0] = 12;
    s.start[0][1] = 14;
    s.start[1][0] = 8;
    s.start[1][1] = 10;
    s.load        = 1e-8;
    s.conditions  = Conditions;
    PetscCall(TurnAndWatch(&s, 12000, 400, low, high));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBeam)

/* In uniform motion nothing is felt: no energy, every velocity as it was, momentum to round-off. */
static PetscErrorCode TestUniformMotion(void)
{
  static const MeshCellType type[] = {MESH_QUAD9, MESH_TRI6, MESH_HEX27};

  PetscFunctionBeginUser;
  for (size_t i = 0; i < sizeof(type) / sizeof(type[0]); i++) {
    const PetscInt       dim = MeshCellDim(type[i]);
    const PetscReal      low[3] = {4, -1, -1}, high[3] = {6, 9, 9}, v = 1e-9;
    Switched             s = SwitchedDefault(dim, 9, dim == 2 ? 2 : 1, dim == 2 ? 0 : 1);
    CouplingSwitchReport report;
    FemModel             fem;
    DemModel             dem;
    FemState             fs;
    DemState             ds;
    PetscReal            off = 0, P[2][3], L[2][3], scale;
    PetscInt             k = 0;

    s.type        = type[i];
    s.ratio       = dim == 2 ? 6 : 8;
    s.width       = 1;
    s.start[0][0] = 3;
    s.start[0][1] = 4;
    s.velocity[0] = v;
    s.velocity[1] = 0.5 * v;
    s.conditions  = SwitchedFlying;
    PetscCall(SwitchedCreate(&s));
    PetscCall(SwitchedSteps(&s, &k, 20));
    PetscCall(SwitchedMomentum(&s, P[0], L[0], &scale));
    PetscCall(SwitchedConvert(&s, low, high));
    PetscCall(SwitchedMomentum(&s, P[1], L[1], &scale));
    PetscCall(SwitchedSteps(&s, &k, 20));
    PetscCall(CouplingSwitchGetReport(s.sw, &report));
    PetscCall(CouplingSwitchGetSides(s.sw, NULL, &fem, &dem, NULL));
    PetscCall(FemModelGetState(fem, &fs));
    PetscCall(DemModelGetState(dem, &ds));
    for (PetscInt j = 0; j < fs.n_nodes; j++)
      for (PetscInt d = 0; d < dim; d++) off = PetscMax(off, PetscAbsReal(fs.v[j * dim + d] - s.velocity[d]) / v);
    for (PetscInt p = 0; p < ds.n; p++)
      for (PetscInt d = 0; d < dim; d++) off = PetscMax(off, PetscAbsReal(ds.v[d * ds.n + p] - s.velocity[d]) / v);
    print_message("           %2d nodes: %d particles woke, velocities off by %.1e, booked %.1e of the kinetic energy\n", (int)MeshCellNodes(s.type), (int)report.event[0].particles, (double)off,
                  (double)(report.event[0].booked / report.event[0].before[LEDGER_KINETIC]));
    CheckBelow(off, 1e-9);
    CheckBelow(PetscAbsReal(report.event[0].booked), 1e-9 * report.event[0].before[LEDGER_KINETIC]);
    for (PetscInt d = 0; d < 3; d++) CheckNear(P[1][d], P[0][d], 1e-12 * scale);
    PetscCall(FemModelRestoreState(fem, &fs));
    PetscCall(DemModelRestoreState(dem, &ds));
    PetscCall(SwitchedDestroy(&s));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestUniformMotion)

static const struct CMUnitTest tests[] = {TEST(TestUniformMotion), TEST(TestBar), TEST(TestBeam)};

CHECK_MAIN(tests)
