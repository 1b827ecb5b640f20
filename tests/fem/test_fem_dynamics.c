/* Implicit dynamics: periods, energy to round-off, numerical damping, orders, prescribed motion, damping, preload, restart.  Theory 2.10 */
#include "fem_case.h"
#include <petscksp.h>
#include <unistd.h>

static PetscErrorCode Run(FemModel model, PetscReal dt, PetscInt from, PetscInt to)
{
  Stepper s;

  PetscFunctionBeginUser;
  PetscCall(FemModelGetStepper(model, &s));
  for (PetscInt k = from; k < to; k++) PetscCall(s.step(s.ctx, k * dt, dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One free mode: a square held at x = 0, y held everywhere. omega = sqrt(3E/rho)/L with consistent mass, sqrt(2E/rho)/L lumped. */
static PetscErrorCode OneMode(PetscReal rho_inf, PetscBool lumped, PetscReal alpha, PetscReal beta, FemModel *model, PetscReal *omega)
{
  const FemMaterial m         = {2000, 1e9, 0};
  const PetscReal   length[3] = {0.5, 0.5, 0}, v0[3] = {3, 0, 0};
  const PetscInt    n[3]      = {1, 1, 0};
  Mesh              mesh;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRAIN, FEM_IMPLICIT, 1, &m, model));
  PetscCall(CaseFix(*model, "body", 1, 0));
  PetscCall(CaseFix(*model, "xmin", 0, 0));
  PetscCall(FemModelSetInitialVelocity(*model, v0));
  PetscCall(FemModelSetImplicit(*model, rho_inf, lumped));
  PetscCall(FemModelSetDamping(*model, alpha));
  PetscCall(FemModelSetStiffnessDamping(*model, beta));
  PetscCall(FemModelSetUp(*model));
  PetscCall(MeshDestroy(&mesh));
  *omega = PetscSqrtReal((lumped ? 2 : 3) * 1e9 / 2000) / 0.5;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Tip(FemModel model, PetscReal *u, PetscReal *v)
{
  PetscReal all[12];

  PetscFunctionBeginUser;
  PetscCall(FemModelGetField(model, "displacement", all));
  *u = all[3];
  PetscCall(FemModelGetField(model, "velocity", all));
  *v = all[3];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Average acceleration: u_n = v0/omega sin(n theta), tan(theta/2) = omega dt/2.  Notes T1 */
static PetscErrorCode TestPeriodErrorHasItsClosedForm(void)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 6; k++) {
    FemModel  model;
    PetscReal omega, dt, theta, u, v, factor[3] = {0.1, 1, 5};

    PetscCall(OneMode(-1, k < 3 ? PETSC_FALSE : PETSC_TRUE, 0, 0, &model, &omega));
    dt    = factor[k % 3] / omega;
    theta = 2 * atan(omega * dt / 2);
    for (PetscInt j = 1; j <= 500; j++) {
      PetscCall(Run(model, dt, j - 1, j));
      PetscCall(Tip(model, &u, &v));
      CheckNear(u, 3 / omega * sin(j * theta), 1e-10 * 3 / omega);
      CheckNear(v, 3 * cos(j * theta), 1e-10 * 3);
    }
    CheckClose((2 * PETSC_PI / theta * dt) / (2 * PETSC_PI / omega) - 1, k % 3 == 0 ? 8.33e-4 : k % 3 == 1 ? 0.07841 : 1.1005, 1e-3); /* +.0833 %, +7.841 % */
    PetscCall(FemModelDestroy(&model));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At omega dt = 1e4 a step multiplies the mode by rho_inf (acceleration: by -rho_inf).  Notes T4 */
static PetscErrorCode TestSpectralRadiusAtHighFrequency(void)
{
  const PetscReal rho[5] = {1, 0.8, 0.5, 0.2, 0};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 5; k++) {
    FemModel  model;
    Ledger    l;
    PetscReal omega, dt, norm[2], grown;

    PetscCall(OneMode(rho[k], PETSC_FALSE, 0, 0, &model, &omega));
    dt = 1e4 / omega;
    for (PetscInt j = 0; j < 2; j++) {
      PetscCall(Run(model, dt, j ? 8 : 0, j ? 16 : 8));
      PetscCall(CaseLedger(model, &l));
      norm[j] = PetscSqrtReal(l.energy[LEDGER_KINETIC] + l.energy[LEDGER_STRAIN]);
    }
    grown = pow(norm[1] / PetscMax(norm[0], 1e-30), 1.0 / 8);
    if (rho[k] > 0) CheckNear(grown, rho[k], 0.1 * rho[k]); /* a double root: n rho^n at first */
    else CheckBelow(norm[0], 1e-3);
    PetscCall(FemModelDestroy(&model));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestSecondOrder(void)
{
  const PetscReal rho[3] = {-1, 0.8, 0};

  PetscFunctionBeginUser;
  for (PetscInt r = 0; r < 3; r++) {
    PetscReal off[3], slope;

    for (PetscInt k = 0; k < 3; k++) {
      FemModel  model;
      PetscReal omega, u, v;

      PetscCall(OneMode(rho[r], PETSC_FALSE, 300, 1e-5, &model, &omega));
      {
        const PetscInt  steps = 40 << k;
        const PetscReal end = 4 / omega, xi = 0.5 * (300 / omega + 1e-5 * omega), damped = omega * PetscSqrtReal(1 - xi * xi);

        PetscCall(Run(model, end / steps, 0, steps));
        PetscCall(Tip(model, &u, &v));
        off[k] = PetscAbsReal(u - 3 / damped * exp(-xi * omega * end) * sin(damped * end));
      }
      PetscCall(FemModelDestroy(&model));
    }
    slope = log2(off[1] / off[2]);
    CheckNear(slope, 2, 0.05);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A busy run: gravity, ramped traction and pressure, a moving support with kinks inside steps, an initial velocity, damping. */
static PetscErrorCode BusyModel(MeshCellType type, PetscReal rho_inf, PetscBool lumped, PetscReal damping, PetscBool absorb, Mesh *mesh, FemModel *model)
{
  const FemMaterial m         = {2400, 3e9, 0.3};
  const PetscReal   length[3] = {1, 0.5, 0.5}, v0[3] = {0.1, -0.2, 0.3}, g[3] = {1, -9.81, 3}, down[3] = {0, -1, 0.3};
  const PetscInt    n[3]      = {6, 3, 3};
  const PetscReal   time[3] = {0, 1.013e-3, 2.007e-3}, speed[3] = {0, 0.05, -0.02}, press[3] = {0, 1e5, 0}, place[3] = {0, 1e-5, 3e-5};
  Table             motion, load, way;

  PetscFunctionBeginUser;
  PetscCall(TableCreate(3, time, speed, &motion));
  PetscCall(TableCreate(3, time, press, &load));
  PetscCall(TableCreate(3, time, place, &way));
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, 0.2, mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, mesh, MeshCellDim(type) == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, FEM_IMPLICIT, 0.4, &m, model));
  PetscCall(FemModelFix(*model, "xmin", 0, FEM_VELOCITY, &motion));
  PetscCall(FemModelFix(*model, "xmin", 1, FEM_DISPLACEMENT, &way));
  if (mesh->dim == 3) PetscCall(CaseFix(*model, "xmin", 2, 0));
  PetscCall(FemModelAddTraction(*model, "ymax", down, &load));
  if (absorb) PetscCall(FemModelAddAbsorber(*model, "xmax"));
  else PetscCall(FemModelAddPressure(*model, "xmax", &load));
  PetscCall(FemModelSetGravity(*model, g));
  PetscCall(FemModelSetInitialVelocity(*model, v0));
  PetscCall(FemModelSetDamping(*model, damping));
  PetscCall(FemModelSetStiffnessDamping(*model, damping * 1e-7));
  PetscCall(FemModelSetImplicit(*model, rho_inf, lumped));
  PetscCall(FemModelAddHistory(*model, "reaction", "xmin"));
  PetscCall(FemModelSetUp(*model));
  PetscCall(TableDestroy(&motion));
  PetscCall(TableDestroy(&load));
  PetscCall(TableDestroy(&way));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CountFactorisations(PetscInt *count)
{
  PetscLogEvent      event;
  PetscEventPerfInfo info;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventGetId("MatCholFctrNum", &event));
  PetscCall(PetscLogEventGetPerfInfo(PETSC_DETERMINE, event, &info));
  *count = (PetscInt)info.count;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every joule accounted for, whatever the scheme, the mass, the damping; one factorisation for all steps.  Eqs (2.55)-(2.57), notes T3 */
static PetscErrorCode TestEnergyClosesToRoundOff(void)
{
  const MeshCellType types[4] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8};
  const PetscReal    rho[4]   = {-1, 1, 0.7, 0};

  PetscFunctionBeginUser;
  PetscCall(PetscLogDefaultBegin());
  for (PetscInt k = 0; k < 16; k++) {
    Mesh      mesh;
    FemModel  model;
    Ledger    ledger;
    PetscReal worst = 0;
    PetscInt  before, after;

    PetscCall(CountFactorisations(&before));
    PetscCall(BusyModel(types[k % 4], rho[k / 4], k % 3 == 1 ? PETSC_TRUE : PETSC_FALSE, k % 2 ? 300 : 0, k % 5 > 2 ? PETSC_TRUE : PETSC_FALSE, &mesh, &model));
    for (PetscInt j = 0; j < 20; j++) {
      PetscCall(CaseLedger(model, &ledger));
      worst = PetscMax(worst, LedgerError(&ledger));
      PetscCall(Run(model, 4e-5, 5 * j, 5 * j + (j ? 5 : 1)));
      if (j == 0) PetscCall(Run(model, 4e-5, 1, 5));
    }
    PetscCall(CountFactorisations(&after));
    CheckInt(after - before, 1);
    CheckBelow(worst, 1e-11);
    CheckPositive(ledger.energy[LEDGER_STRAIN]);
    if (k == 0) CheckNear(ledger.energy[LEDGER_DAMPING], 0, 0);
    else if (k > 7 || k % 2) CheckPositive(ledger.energy[LEDGER_DAMPING]);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestRestartContinuesBitForBit(void)
{
  char      file[] = "fem_dynamics_XXXXXX.h5";
  PetscReal bits[2][2000];
  const int fd = mkstemps(file, 3);

  PetscFunctionBeginUser;
  CheckTrue(fd >= 0);
  close(fd);
  for (PetscInt k = 0; k < 2; k++) {
    Mesh       mesh;
    FemModel   model;
    Stepper    s;
    Checkpoint checkpoint;

    PetscCall(BusyModel(MESH_TET4, 0.7, PETSC_FALSE, 300, PETSC_TRUE, &mesh, &model));
    PetscCall(Run(model, 4e-5, 0, 31));
    if (k) {
      PetscCall(FemModelGetStepper(model, &s));
      PetscCall(CheckpointCreate(PETSC_COMM_SELF, file, &checkpoint));
      PetscCall(s.save(s.ctx, checkpoint));
      PetscCall(CheckpointClose(&checkpoint));
      PetscCall(FemModelDestroy(&model));
      PetscCall(MeshDestroy(&mesh));
      PetscCall(BusyModel(MESH_TET4, 0.7, PETSC_FALSE, 300, PETSC_TRUE, &mesh, &model));
      PetscCall(FemModelGetStepper(model, &s));
      PetscCall(CheckpointOpen(PETSC_COMM_SELF, file, &checkpoint));
      PetscCall(s.load(s.ctx, checkpoint));
      PetscCall(CheckpointClose(&checkpoint));
    }
    PetscCall(Run(model, 4e-5, 31, 70));
    CheckTrue(9 * mesh.n_nodes <= 2000);
    PetscCall(PetscArrayzero(bits[k], 2000));
    PetscCall(FemModelGetField(model, "displacement", bits[k]));
    PetscCall(FemModelGetField(model, "velocity", bits[k] + 3 * mesh.n_nodes));
    PetscCall(FemModelGetField(model, "reaction", bits[k] + 6 * mesh.n_nodes));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  for (PetscInt i = 0; i < 2000; i++) CheckTrue(bits[0][i] == bits[1][i]);
  unlink(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A rigid block pushed through a table: u, v follow it, the reaction is mass x acceleration; after the kink nothing rings.  Eq. (2.54) */
static PetscErrorCode TestPrescribedMotion(void)
{
  const FemMaterial m         = {2000, 2e13, 0.2}; /* stiff: 1 m rings at 50 kHz, the motion takes 0.1 s */
  const PetscReal   length[3] = {1, 1, 0}, time[3] = {0, 0.05, 0.1}, speed[3] = {0, 2, 2};
  const PetscInt    n[3]      = {2, 2, 0};
  const PetscReal   dt        = 1.25e-3;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 2; k++) {
    Mesh     mesh;
    FemModel model;
    Table    table;

    PetscCall(TableCreate(3, time, speed, &table));
    PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRAIN, FEM_IMPLICIT, 1, &m, &model));
    PetscCall(FemModelFix(model, "xmin", 0, FEM_VELOCITY, &table));
    PetscCall(CaseFix(model, "xmin", 1, 0));
    PetscCall(FemModelSetImplicit(model, k ? 0.5 : -1, PETSC_FALSE));
    PetscCall(FemModelAddHistory(model, "reaction", "xmin"));
    PetscCall(FemModelAddHistory(model, "displacement", "xmax"));
    PetscCall(FemModelAddHistory(model, "velocity", "xmin"));
    PetscCall(FemModelSetUp(model));
    for (PetscInt j = 1; j <= 80; j++) {
      const PetscReal t = j * dt;

      PetscCall(Run(model, dt, j - 1, j));
      CheckNear(CaseHistory(model, "displacement(xmax).x"), t < 0.05 ? 20 * t * t : 0.05 + 2 * (t - 0.05), 1e-6);
      if (j != 40) CheckNear(CaseHistory(model, "velocity(xmin).x"), t < 0.05 ? 40 * t : 2, 1e-9);
      if (k && ((j > 20 && j < 38) || j > 60)) CheckNear(CaseHistory(model, "reaction(xmin).x"), j < 38 ? 2000 * 40 : 0, 80); /* numerical damping stills the block's own ringing */
    }
    PetscCall(TableDestroy(&table));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Loaded statically, then dynamics: no jump in the reaction, nothing moves, energy begins with the strain energy.  Eq. (2.58) */
static PetscErrorCode TestPreloadGoesOnWithoutAJump(void)
{
  const FemMaterial m         = {2400, 3e9, 0.3};
  const PetscReal   length[3] = {1, 0.5, 0.5}, g[3] = {0, -9.81, 0}, down[3] = {0, -1, 0};
  const PetscInt    n[3]      = {6, 3, 3};
  PetscReal         fixed[3]  = {0, 0, 0}, still[3];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 6; k++) { /* static, explicit rows, explicit elements, explicit with local damping, implicit twice */
    const FemMethod method = k == 0 ? FEM_STATIC : k < 4 ? FEM_EXPLICIT : FEM_IMPLICIT;
    Mesh            mesh;
    FemModel        model;
    Table           load, held;
    Ledger          l;

    if (k == 2) PetscCall(PetscOptionsSetValue(NULL, "-fem_elements", "1"));
    PetscCall(TableCreateConstant(1e5, &load));
    PetscCall(TableCreateConstant(1e-4, &held));
    PetscCall(CaseBox(PETSC_COMM_SELF, MESH_TET4, length, n, 0.2, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, method, 1, &m, &model));
    for (PetscInt d = 0; d < 3; d++) PetscCall(CaseFix(model, "xmin", d, 0));
    PetscCall(FemModelFix(model, "xmax", 0, FEM_DISPLACEMENT, &held));
    PetscCall(FemModelAddTraction(model, "ymax", down, &load));
    PetscCall(FemModelSetGravity(model, g));
    if (k) PetscCall(FemModelSetPreload(model, PETSC_TRUE));
    if (k == 3) PetscCall(FemModelSetLocalDamping(model, 0.7));
    if (k == 5) PetscCall(FemModelSetImplicit(model, 0.6, PETSC_FALSE));
    PetscCall(FemModelAddHistory(model, "reaction", "xmin"));
    PetscCall(FemModelSetUp(model));
    if (k == 0) PetscCall(Run(model, 1, 0, 1));
    for (PetscInt pass = 0; pass < (k ? 2 : 1); pass++) {
      still[0] = CaseHistory(model, "reaction(xmin).x");
      still[1] = CaseHistory(model, "reaction(xmin).y");
      still[2] = CaseHistory(model, "reaction(xmin).z");
      for (PetscInt d = 0; d < 3; d++) {
        if (k == 0) fixed[d] = still[d];
        CheckNear(still[d], fixed[d], 1e-9 * 1e5);
      }
      PetscCall(CaseLedger(model, &l));
      if (k) {
        CheckAbove(l.energy[LEDGER_STRAIN], 0.1);
        CheckBelow(l.energy[LEDGER_KINETIC], 1e-16 * l.energy[LEDGER_STRAIN]);
        CheckClose(l.initial, l.energy[LEDGER_STRAIN], 1e-10);
      }
      if (k && !pass) PetscCall(Run(model, 1e-5, 0, 50));
    }
    if (k == 2) PetscCall(PetscOptionsClearValue(NULL, "-fem_elements"));
    PetscCall(TableDestroy(&load));
    PetscCall(TableDestroy(&held));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestRefusals(void)
{
  const FemMaterial m         = {2400, 3e9, 0.3};
  const PetscReal   length[3] = {1, 1, 0};
  const PetscInt    n[3]      = {2, 2, 0};
  Mesh              mesh;
  FemModel          model;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRAIN, FEM_EXPLICIT, 1, &m, &model));
  CheckFails(FemModelSetImplicit(model, 1.5, PETSC_FALSE), PETSC_ERR_USER_INPUT, "[0, 1]");
  CheckFails(FemModelSetStiffnessDamping(model, -1), PETSC_ERR_USER_INPUT, "negative");
  PetscCall(FemModelSetStiffnessDamping(model, 1e-6));
  CheckFails(FemModelSetUp(model), PETSC_ERR_USER_INPUT, "needs the implicit method");
  PetscCall(FemModelDestroy(&model));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRAIN, FEM_IMPLICIT, 1, &m, &model));
  PetscCall(FemModelSetPreload(model, PETSC_TRUE));
  CheckFails(FemModelSetUp(model), PETSC_ERR_USER_INPUT, "move along x");
  PetscCall(FemModelDestroy(&model));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRAIN, FEM_STATIC, 1, &m, &model));
  CheckFails(FemModelAddAbsorber(model, "body"), PETSC_ERR_USER_INPUT, "dimension 1");
  PetscCall(FemModelAddAbsorber(model, "xmax"));
  CheckFails(FemModelSetUp(model), PETSC_ERR_USER_INPUT, "a static body has none");
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestPeriodErrorHasItsClosedForm)
CHECK_TEST(TestSpectralRadiusAtHighFrequency)
CHECK_TEST(TestSecondOrder)
CHECK_TEST(TestEnergyClosesToRoundOff)
CHECK_TEST(TestRestartContinuesBitForBit)
CHECK_TEST(TestPrescribedMotion)
CHECK_TEST(TestPreloadGoesOnWithoutAJump)
CHECK_TEST(TestRefusals)

static const struct CMUnitTest tests[] = {TEST(TestPeriodErrorHasItsClosedForm), TEST(TestSpectralRadiusAtHighFrequency), TEST(TestSecondOrder), TEST(TestEnergyClosesToRoundOff), TEST(TestRestartContinuesBitForBit),
                                          TEST(TestPrescribedMotion), TEST(TestPreloadGoesOnWithoutAJump), TEST(TestRefusals)};
CHECK_MAIN(tests)
