/* Elements that turn into particles in the middle of a run: nothing jumps, and nothing is lost that is not booked. */
#include "check.h"
#include "switched.h"

/* What a settled body is asked: turns the cells in the box, watches a column of the history over n steps. */
static PetscErrorCode TurnAndWatch(Switched *s, const char *what, PetscInt column, PetscInt *k, const PetscReal low[3], const PetscReal high[3], PetscInt n, PetscReal *change, PetscReal *injected)
{
  CouplingSwitchReport report;
  PetscReal            before, after;
  Ledger               ledger = {{0}};

  PetscFunctionBegin;
  PetscCall(s->stepper.history(s->sw, column, &before));
  PetscCall(SwitchedConvert(s, low, high));
  PetscCall(CouplingSwitchGetReport(s->sw, &report));
  CheckInt(report.n_events, 1);
  *change = 0;
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(SwitchedSteps(s, k, 1));
    PetscCall(s->stepper.history(s->sw, column, &after));
    *change = PetscMax(*change, PetscAbsReal(after / before - 1));
  }
  PetscCall(CouplingSwitchGetReport(s->sw, &report));
  *injected = -report.event[0].booked / report.event[0].before[LEDGER_STRAIN];
  PetscCall(s->stepper.energy(s->sw, &ledger));
  print_message("           %s: %d elements turned, %d particles woke; reaction changes by %.1e, injected %.1e of the strain energy, ledger error %.1e\n", what, (int)report.event[0].cells, (int)report.event[0].particles, (double)*change,
                (double)*injected, (double)LedgerError(&ledger));
  CheckInt(report.event[0].above, 0);
  CheckBelow(LedgerError(&ledger), 0.01);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BarConditions(Switched *s, FemModel fem, DemModel dem)
{
  const PetscReal t[2] = {0, 30}, v[2] = {0, 1e-6}, pull[3] = {1, 0, 0};
  Table           ramp, none;

  PetscFunctionBegin;
  PetscCall(TableCreate(2, t, v, &ramp));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(FemModelFix(fem, "xmin", 0, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(fem, "xmax", pull, &ramp));
  PetscCall(FemModelAddHistory(fem, "reaction", "xmin"));
  PetscCall(CouplingSwitchProtect(s->sw, "xmin"));
  PetscCall(CouplingSwitchProtect(s->sw, "xmax"));
  PetscCall(FemModelSetDamping(fem, 0.15));
  PetscCall(DemModelSetLocalDamping(dem, 0.3));
  PetscCall(TableDestroy(&ramp));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Drawn to a uniform stress and brought to rest, then the middle turns. */
static PetscErrorCode TestBar(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const PetscReal low[3] = {8, -1, -1}, high[3] = {12, 9, 9};
    Switched        s = SwitchedDefault(dim, 18, 3, dim == 2 ? 0 : 2);
    PetscReal       change = 0, injected = 0;
    PetscInt        k = 0;

    s.start[0][0] = 5;
    s.start[0][1] = 6;
    s.conditions  = BarConditions;
    PetscCall(SwitchedCreate(&s));
    PetscCall(SwitchedSteps(&s, &k, dim == 2 ? 4000 : 1500));
    PetscCall(TurnAndWatch(&s, dim == 2 ? "2D bar" : "3D bar", 0, &k, low, high, dim == 2 ? 400 : 100, &change, &injected));
    CheckBelow(change, 0.01);
    CheckBelow(PetscAbsReal(injected), 1e-3);
    PetscCall(SwitchedDestroy(&s));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBar)

static PetscErrorCode BeamConditions(Switched *s, FemModel fem, DemModel dem)
{
  const PetscReal t[2] = {0, s->load > 0 ? 1000 : 250}, v[2] = {0, s->load > 0 ? s->load : 1e-8}, push[3] = {0, 1, 0};
  Table           ramp, none;

  PetscFunctionBegin;
  PetscCall(TableCreate(2, t, v, &ramp));
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt d = 0; d < s->dim; d++) PetscCall(FemModelFix(fem, "xmin", d, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(fem, "xmax", push, &ramp));
  PetscCall(FemModelAddHistory(fem, "reaction", "xmin"));
  PetscCall(CouplingSwitchProtect(s->sw, "xmin"));
  PetscCall(CouplingSwitchProtect(s->sw, "xmax"));
  PetscCall(FemModelSetDamping(fem, 0.02));
  PetscCall(DemModelSetLocalDamping(dem, 0.3));
  PetscCall(TableDestroy(&ramp));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A cantilever of ten elements' depth, bent by a force at its tip: the tensile side of its middle turns. */
static PetscErrorCode TestBeam(void)
{
  const PetscReal low[3] = {13, 5, -1}, high[3] = {16, 11, 9};
  Switched        s = SwitchedDefault(2, 30, 10, 0);
  PetscReal       change = 0, injected = 0;
  PetscInt        k = 0;

  PetscFunctionBeginUser;
  s.ratio       = 3;
  s.start[0][0] = 13;
  s.start[0][1] = 15;
  s.start[1][0] = 8;
  s.start[1][1] = 10;
  s.conditions  = BeamConditions;
  PetscCall(SwitchedCreate(&s));
  PetscCall(SwitchedSteps(&s, &k, 12000));
  PetscCall(TurnAndWatch(&s, "beam", 1, &k, low, high, 400, &change, &injected));
  CheckBelow(change, 0.01);
  CheckBelow(PetscAbsReal(injected), 1e-3);
  PetscCall(SwitchedDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBeam)

static PetscErrorCode BlockConditions(Switched *s, FemModel fem, DemModel dem)
{
  static const char *const held[3] = {"xmin", "ymin", "zmin"}, *const loaded[3] = {"xmax", "ymax", "zmax"};
  const PetscReal          t[2] = {0, 20}, size[3] = {1e-6, 5e-7, 2.5e-7};
  Table                    ramp, none;

  PetscFunctionBegin;
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt d = 0; d < 3; d++) {
    const PetscReal v[2] = {0, size[d]};

    PetscCall(TableCreate(2, t, v, &ramp));
    PetscCall(FemModelFix(fem, held[d], d, FEM_DISPLACEMENT, &none));
    PetscCall(FemModelAddPressure(fem, loaded[d], &ramp));
    PetscCall(TableDestroy(&ramp));
    PetscCall(CouplingSwitchProtect(s->sw, held[d]));
    PetscCall(CouplingSwitchProtect(s->sw, loaded[d]));
  }
  PetscCall(FemModelAddHistory(fem, "reaction", "xmin"));
  PetscCall(FemModelSetDamping(fem, 0.3));
  PetscCall(DemModelSetLocalDamping(dem, 0.3));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Three different pressures on a block, and one element of its inside turns beside the one that has. */
static PetscErrorCode TestBlock(void)
{
  const PetscReal low[3] = {3, 4, 4}, high[3] = {6, 5, 5};
  Switched        s = SwitchedDefault(3, 9, 9, 9);
  PetscReal       change = 0, injected = 0;
  PetscInt        k = 0;

  PetscFunctionBeginUser;
  s.width = 1;
  for (PetscInt d = 0; d < 3; d++) {
    s.start[d][0]  = 4;
    s.start[d][1]  = 5;
    s.zone[d][0]   = 3;
    s.zone[d][1]   = 6;
  }
  s.conditions = BlockConditions;
  PetscCall(SwitchedCreate(&s));
  PetscCall(SwitchedSteps(&s, &k, 700));
  PetscCall(TurnAndWatch(&s, "block", 0, &k, low, high, 60, &change, &injected));
  CheckBelow(change, 0.01);
  CheckBelow(PetscAbsReal(injected), 1e-3);
  PetscCall(SwitchedDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBlock)

/* In uniform motion nothing is felt: no force, no energy, every velocity as it was. */
static PetscErrorCode TestUniformMotion(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const PetscReal      low[3] = {6, -1, -1}, high[3] = {8, 9, 9}, v = 1e-9;
    Switched             s = SwitchedDefault(dim, 13, 2, dim == 2 ? 0 : 2);
    CouplingSwitchReport report;
    FemModel             fem;
    DemModel             dem;
    FemState             fs;
    DemState             ds;
    PetscReal            off = 0, force = 0;
    PetscInt             k = 0;

    s.start[0][0] = 4;
    s.start[0][1] = 5;
    s.velocity[0] = v;
    s.velocity[1] = 0.5 * v;
    s.conditions  = SwitchedFlying;
    PetscCall(SwitchedCreate(&s));
    PetscCall(SwitchedSteps(&s, &k, 20));
    PetscCall(SwitchedConvert(&s, low, high));
    PetscCall(SwitchedSteps(&s, &k, 20));
    PetscCall(CouplingSwitchGetSides(s.sw, NULL, &fem, &dem, NULL));
    PetscCall(FemModelGetState(fem, &fs));
    PetscCall(DemModelGetState(dem, &ds));
    for (PetscInt i = 0; i < fs.n_nodes; i++)
      for (PetscInt d = 0; d < dim; d++) off = PetscMax(off, PetscAbsReal(fs.v[i * dim + d] - s.velocity[d]) / v);
    for (PetscInt p = 0; p < ds.n; p++)
      for (PetscInt d = 0; d < dim; d++) {
        off   = PetscMax(off, PetscAbsReal(ds.v[d * ds.n + p] - s.velocity[d]) / v);
        force = PetscMax(force, PetscAbsReal(ds.f[d * ds.n + p]));
      }
    PetscCall(FemModelRestoreState(fem, &fs));
    PetscCall(DemModelRestoreState(dem, &ds));
    PetscCall(CouplingSwitchGetReport(s.sw, &report));
    print_message("           %dD in uniform motion: velocities off by %.1e, largest force %.1e, booked %.1e of the kinetic energy\n", (int)dim, (double)off, (double)force,
                  (double)(report.booked / report.event[0].before[LEDGER_KINETIC]));
    CheckBelow(off, 1e-11);
    CheckBelow(force, 1e-20);
    CheckBelow(PetscAbsReal(report.booked), 1e-11 * report.event[0].before[LEDGER_KINETIC]);
    PetscCall(SwitchedDestroy(&s));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestUniformMotion)

/* Turning about a point with a shake on top: momentum and angular momentum to round-off, the kinetic difference booked. */
static PetscErrorCode TestRotation(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const PetscReal      low[3] = {6, -1, -1}, high[3] = {8, 9, 9}, spin[3] = {dim == 3 ? 0.4e-10 : 0, dim == 3 ? -0.3e-10 : 0, 1e-10}; /* so slow that what turns in 100 steps is below the tolerance */
    Switched             s = SwitchedDefault(dim, 13, 2, dim == 2 ? 0 : 2);
    CouplingSwitchReport report;
    FemModel             fem;
    DemModel             dem;
    FemState             fs;
    DemState             ds;
    PetscReal            P[2][3], L[2][3], scale;
    uint64_t             seed = 9;
    PetscInt             k = 0;

    s.start[0][0] = 4;
    s.start[0][1] = 5;
    PetscCall(SwitchedCreate(&s));
    PetscCall(CouplingSwitchGetSides(s.sw, NULL, &fem, &dem, NULL));
    PetscCall(FemModelGetState(fem, &fs));
    PetscCall(DemModelGetState(dem, &ds));
    for (PetscInt i = 0; i < fs.n_nodes; i++)
      for (PetscInt d = 0; d < dim; d++) {
        const PetscInt a = (d + 1) % 3, b = (d + 2) % 3;

        fs.v[i * dim + d] = spin[a] * (b < dim ? fs.x[i * dim + b] : 0) - spin[b] * (a < dim ? fs.x[i * dim + a] : 0);
        fs.v[i * dim + d] += 1e-11 * ((double)(seed = seed * 6364136223846793005ULL + 1442695040888963407ULL) / 18446744073709551616.0 - 0.5);
      }
    for (PetscInt p = 0; p < ds.n; p++) {
      for (PetscInt d = 0; d < dim; d++) {
        const PetscInt a = (d + 1) % 3, b = (d + 2) % 3;

        ds.v[d * ds.n + p] = spin[a] * ds.x0[b * ds.n + p] - spin[b] * ds.x0[a * ds.n + p];
      }
      for (PetscInt d = 0; d < 3; d++)
        if (dim == 3) ds.spin[d * ds.n + p] = spin[d];
      if (dim == 2) ds.spin[p] = spin[2];
    }
    PetscCall(FemModelRestoreState(fem, &fs));
    PetscCall(DemModelRestoreState(dem, &ds));
    PetscCall(SwitchedSteps(&s, &k, 10));
    PetscCall(SwitchedMomentum(&s, P[0], L[0], &scale));
    PetscCall(SwitchedConvert(&s, low, high));
    PetscCall(SwitchedMomentum(&s, P[1], L[1], &scale));
    PetscCall(CouplingSwitchGetReport(s.sw, &report));
    print_message("           %dD turning and shaken: momentum off by %.1e, angular by %.1e, booked %.1e of the kinetic energy\n", (int)dim, (double)((P[1][0] - P[0][0]) / scale), (double)((L[1][2] - L[0][2]) / (13 * scale)),
                  (double)(report.booked / report.event[0].before[LEDGER_KINETIC]));
    for (PetscInt d = 0; d < 3; d++) {
      CheckNear(P[1][d], P[0][d], 1e-13 * scale);
      CheckNear(L[1][d], L[0][d], 1e-13 * 13 * scale);
    }
    CheckBelow(PetscAbsReal(report.booked), 5e-3 * report.event[0].before[LEDGER_KINETIC]);
    PetscCall(SwitchedSteps(&s, &k, 100));
    PetscCall(SwitchedMomentum(&s, P[1], L[1], &scale));
    for (PetscInt d = 0; d < 3; d++) CheckNear(L[1][d], L[0][d], 1e-12 * 13 * scale);
    PetscCall(SwitchedDestroy(&s));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRotation)

/* A pulse eight elements long runs along a bar; where it is, elements turn. What is missing afterwards is what was booked. */
static PetscErrorCode TestPulse(void)
{
  const PetscReal      low[3] = {16, -1, -1}, high[3] = {24, 9, 9}, length = 8;
  Switched             s = SwitchedDefault(2, 40, 1, 0);
  CouplingSwitchReport report;
  FemModel             fem;
  FemState             fs;
  Ledger               ledger = {{0}}, end = {{0}};
  PetscReal            total, left;
  PetscInt             k = 0;

  PetscFunctionBeginUser;
  s.nu          = 0;
  s.start[0][0] = 30;
  s.start[0][1] = 32;
  PetscCall(SwitchedCreate(&s));
  PetscCall(CouplingSwitchGetSides(s.sw, NULL, &fem, NULL, NULL));
  PetscCall(FemModelGetState(fem, &fs));
  for (PetscInt i = 0; i < fs.n_nodes; i++) fs.v[2 * i] = 1e-9 * PetscExpReal(-PetscSqr((fs.x[2 * i] - 20) / (0.25 * length))); /* parts in two that run apart */
  PetscCall(FemModelRestoreState(fem, &fs));
  PetscCall(SwitchedSteps(&s, &k, 8));
  PetscCall(s.stepper.energy(s.sw, &ledger));
  total = SwitchedTotal(&ledger);
  PetscCall(SwitchedConvert(&s, low, high));
  PetscCall(CouplingSwitchGetReport(s.sw, &report));
  PetscCall(SwitchedSteps(&s, &k, 400));
  PetscCall(s.stepper.energy(s.sw, &end));
  left = SwitchedTotal(&end);
  print_message("           pulse: booked %.2e of its energy (%d particles woke); 400 steps later the sum of all energies is off by %.1e\n", (double)(report.booked / total), (int)report.event[0].particles, (double)(left / total - 1));
  CheckBelow(PetscAbsReal(left / total - 1), 1e-6);
  CheckBelow(PetscAbsReal(report.booked), PetscSqr(2 * PETSC_PI / length) / 6 * total); /* what interpolating linearly would lose */
  PetscCall(SwitchedDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPulse)

static const struct CMUnitTest tests[] = {TEST(TestBar), TEST(TestBeam), TEST(TestBlock), TEST(TestUniformMotion), TEST(TestRotation), TEST(TestPulse)};

CHECK_MAIN(tests)
