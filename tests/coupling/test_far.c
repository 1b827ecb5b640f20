/* Implicit elements beyond an explicit overlap: the same wave, a closed ledger, the same bits again.  Eqs (6.20)-(6.28) */
#include "check.h"
#include "checkpoint.h"
#include "coupled.h"

static PetscErrorCode Strip(PetscInt m, CouplingFar far, PetscReal length, PetscReal from, PetscReal to, PetscReal ratio, PetscReal nu, Coupled *c)
{
  const PetscReal       size[3] = {length, 2, 1};
  const CouplingOptions options = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = m, .far = far};

  PetscFunctionBegin;
  PetscCall(CoupledCreate(2, size, 1, from, to, ratio, 2, nu, 7, &options, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  PetscReal worst, taken, apart; /* ledger error; energy the faces took over the work; [m] */
  PetscReal u[400];
} Result;

/* A pulse `period` long sent by a traction through both faces, seen six elements before the far end: displacement every ten particle steps. */
static PetscErrorCode Wave(PetscInt m, CouplingFar far, PetscReal period, PetscReal dt, PetscInt samples, Result *r)
{
  const PetscReal push[3] = {1, 0, 0}, stress = 1e-4;
  Coupled         c;
  Stepper         stepper;
  Table           pulse;
  PetscReal       t[21], v[21], limit;
  FemState        fs;
  FemFarReport    report;
  Ledger          ledger;

  PetscFunctionBegin;
  for (PetscInt k = 0; k <= 20; k++) {
    t[k] = period / 20 * k;
    v[k] = stress * 0.5 * (1 - PetscCosReal(PETSC_PI * k / 10));
  }
  PetscCall(Strip(m, far, 50, 18, 22, 6, 0, &c));
  PetscCall(TableCreate(21, t, v, &pulse));
  PetscCall(FemModelAddTraction(c.fem, "xmin", push, &pulse));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, &limit));
  CheckBelow(m * dt, limit);
  r->worst = 0;
  for (PetscInt k = 0; k < samples; k++) {
    for (PetscInt j = 0; j < 10 / m; j++) PetscCall(stepper.step(c.model, (k * (10 / m) + j) * m * dt, m * dt));
    PetscCall(stepper.energy(c.model, &ledger));
    r->worst = PetscMax(r->worst, LedgerError(&ledger));
    PetscCall(FemModelGetState(c.fem, &fs));
    for (PetscInt i = 0; i < fs.n_nodes; i++)
      if (fs.x[2 * i] == 44 && fs.x[2 * i + 1] == 1) r->u[k] = fs.u[2 * i];
    PetscCall(FemModelRestoreState(c.fem, &fs));
  }
  PetscCall(CouplingModelGetFar(c.model, &report));
  r->taken = report.taken / ledger.energy[LEDGER_WORK];
  r->apart = report.apart;
  PetscCall(TableDestroy(&pulse));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestWave(void)
{
  const PetscInt m[4] = {1, 2, 5, 10};
  const PetscReal dt = 0.06;

  PetscFunctionBeginUser;
  for (PetscInt long_ = 0; long_ < 2; long_++) {
    const PetscReal period = long_ ? 20 : 10;
    const PetscInt  n      = (PetscInt)((46 + period) / (10 * dt));
    Result          r = {0}, explicit = {0};
    PetscReal       top = 0;

    PetscCall(Wave(1, COUPLING_FAR_EXPLICIT, period, dt, n, &explicit));
    for (PetscInt i = 0; i < n; i++) top = PetscMax(top, PetscAbsReal(explicit.u[i]));
    for (PetscInt k = 0; k < 4; k++) {
      PetscReal off = 0;

      PetscCall(Wave(m[k], COUPLING_FAR_IMPLICIT, period, dt, n, &r));
      for (PetscInt i = 0; i < n; i++) off = PetscMax(off, PetscAbsReal(r.u[i] - explicit.u[i]));
      print_message("           pulse of %.0f elements, m = %2d, H = %.2f: history off by %.2e of the largest, faces took %.1e of the work (H/period %.3f), copies apart by %.1e, energy off by %.1e (explicit %.1e)\n", (double)period, (int)m[k],
                    (double)(m[k] * dt), (double)(off / top), (double)r.taken, (double)(m[k] * dt / period), (double)(r.apart / top), (double)r.worst, (double)explicit.worst);
      if (long_ || m[k] <= 2) CheckBelow(off, 0.01 * top);
      else CheckBelow(off, 0.05 * top); /* ten elements in H = 0.3 and 0.6: Newmark's own period is 2 % long there */
      CheckBelow(r.worst, 1e-11);
      if (m[k] == 1) CheckBelow(PetscAbsReal(r.taken), 1e-7);
      else CheckPositive(r.taken);
      CheckBelow(r.taken, 0.3 * m[k] * dt / period);
      CheckBelow(r.apart, 1e-4 * top);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestWave)

/* Far past what the far elements bear explicitly, from random velocities, undamped, 2D and 3D: the energy only falls, momentum stays, the ledger closes. */
static PetscErrorCode TestUnconditional(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const PetscReal       size[3] = {14, 2, 2};
    const PetscInt        m = 25, steps = dim == 2 ? 400 : 60;
    const CouplingOptions options = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = m, .far = COUPLING_FAR_IMPLICIT};
    Coupled               c;
    Stepper               stepper;
    FemState              fs;
    DemState              ds;
    Ledger                ledger;
    FemFarReport          report;
    PetscReal             dt, begin = 0, worst = 0, p[2] = {0, 0}, scale = 0;
    uint64_t              seed = 3;

    PetscCall(CoupledCreate(dim, size, 1, 6, 8, 3, 2, 0.2, 3, &options, &c));
    PetscCall(CouplingModelSetUp(c.model));
    PetscCall(CouplingModelGetStepper(c.model, &stepper));
    PetscCall(stepper.stable_step(c.model, &dt));
    dt *= 0.9;
    PetscCall(FemModelGetState(c.fem, &fs));
    for (PetscInt i = 0; i < fs.n_nodes * dim; i++) {
      fs.v[i] = 1e-9 * ((double)(seed = seed * 6364136223846793005ULL + 1442695040888963407ULL) / 18446744073709551616.0 - 0.5);
      if (i % dim == 0) p[0] += fs.mass[i / dim] * fs.v[i];
      scale += fs.mass[i / dim] * PetscAbsReal(fs.v[i]);
    }
    PetscCall(FemModelRestoreState(c.fem, &fs));
    for (PetscInt k = 0; k < steps; k++) {
      PetscCall(stepper.step(c.model, k * dt, dt));
      PetscCall(stepper.energy(c.model, &ledger));
      if (k == 0) begin = LedgerBalance(&ledger); /* initial knows nothing of the shake */
      worst = PetscMax(worst, PetscAbsReal(LedgerBalance(&ledger) / begin - 1));
    }
    PetscCall(CouplingModelGetFar(c.model, &report));
    PetscCall(FemModelGetState(c.fem, &fs));
    PetscCall(DemModelGetState(c.dem, &ds));
    for (PetscInt i = 0; i < fs.n_nodes; i++) p[1] += fs.mass[i] * fs.v[i * dim];
    for (PetscInt i = 0; i < ds.n; i++) p[1] += ds.mass[i] * ds.v[i];
    PetscCall(FemModelRestoreState(c.fem, &fs));
    PetscCall(DemModelRestoreState(c.dem, &ds));
    print_message("           %dD, m = %d, H = %.2f: faces took %.3f of the energy, ledger within %.1e, momentum %.2e then %.2e of %.1e\n", (int)dim, (int)m, (double)dt, (double)(report.taken / begin), (double)worst, (double)p[0], (double)p[1], (double)scale);
    CheckPositive(report.taken);
    CheckBelow(report.taken, begin);
    CheckBelow(worst, 1e-6);
    PetscCall(CoupledDestroy(&c));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestUnconditional)

/* The bar of test_substeps drawn by a steady traction and brought to rest at H = 30 particle steps: Hooke, and it stays there. */
static PetscErrorCode TestStaticBar(void)
{
  const PetscReal nu = 0.2, stress = 1e-6, pull[3] = {1, 0, 0}, t[2] = {0, 30}, v[2] = {0, stress}, strain = stress * (1 - nu * nu);
  const PetscInt  m = 30;
  Coupled         c;
  Stepper         stepper;
  Table           ramp, none;
  FemState        fs;
  DemState        ds;
  Ledger          ledger;
  FemFarReport    report;
  PetscReal       dt, reaction, off = 0, tip = 0, later = 0;

  PetscFunctionBeginUser;
  PetscCall(Strip(m, COUPLING_FAR_IMPLICIT, 20, 9, 11, 6, nu, &c));
  PetscCall(TableCreate(2, t, v, &ramp));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(FemModelFix(c.fem, "xmin", 0, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(c.fem, "xmax", pull, &ramp));
  PetscCall(FemModelAddHistory(c.fem, "reaction", "xmin"));
  PetscCall(FemModelSetDamping(c.fem, 0.1));
  PetscCall(DemModelSetLocalDamping(c.dem, 0.3));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, &dt));
  dt *= 0.9;
  for (PetscInt k = 0; k < 700; k++) PetscCall(stepper.step(c.model, k * dt, dt));
  PetscCall(stepper.energy(c.model, &ledger));
  PetscCall(CouplingModelGetFar(c.model, &report));
  CheckBelow(LedgerError(&ledger), 1e-2);
  CheckBelow(PetscAbsReal(ledger.energy[LEDGER_KINETIC]), 1e-6 * ledger.energy[LEDGER_STRAIN]);
  PetscCall(FemModelGetState(c.fem, &fs));
  PetscCall(DemModelGetState(c.dem, &ds));
  for (PetscInt p = 0; p < ds.n; p++) off = PetscMax(off, PetscAbsReal(ds.u[p] - strain * ds.x0[p]) / strain);
  for (PetscInt i = 0; i < fs.n_nodes; i++) {
    off = PetscMax(off, PetscAbsReal(fs.u[2 * i] - strain * fs.x[2 * i]) / strain);
    if (fs.x[2 * i] == 20) tip = fs.u[2 * i];
  }
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(DemModelRestoreState(c.dem, &ds));
  PetscCall(stepper.history(c.model, 0, &reaction));
  for (PetscInt k = 700; k < 1400; k++) PetscCall(stepper.step(c.model, k * dt, dt));
  PetscCall(stepper.energy(c.model, &ledger));
  PetscCall(FemModelGetState(c.fem, &fs));
  for (PetscInt i = 0; i < fs.n_nodes; i++)
    if (fs.x[2 * i] == 20) later = fs.u[2 * i];
  PetscCall(FemModelRestoreState(c.fem, &fs));
  print_message("           bar at H = %.2f: displacement off by %.2e of strain x element, tip %.2e, reaction %.2e, drift over 700 more steps %.1e; copies apart by %.1e of an element's stretch, faces took %.1e of the work\n", (double)dt,
                (double)off, (double)(tip / (20 * strain) - 1), (double)(-reaction / (2 * stress) - 1), (double)(later / tip - 1), (double)(report.apart / strain), (double)(report.taken / ledger.energy[LEDGER_WORK]));
  CheckBelow(off, 0.05);
  CheckBelow(PetscAbsReal(tip / (20 * strain) - 1), 2e-3);
  CheckClose(-reaction, 2 * stress, 1e-6);
  CheckNear(later, tip, 1e-5 * tip);
  PetscCall(TableDestroy(&ramp));
  PetscCall(TableDestroy(&none));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestStaticBar)

/* N steps, a checkpoint, N more: the bits of 2 N steps; and those of any number of threads, whether energies are asked for or not. */
static PetscErrorCode Run(PetscInt from, PetscInt to, PetscInt threads, PetscBool look, const char *load, const char *save, PetscReal *u, PetscInt *n, Ledger *ledger)
{
  Coupled c;

  PetscFunctionBegin;
  PetscCall(Strip(3, COUPLING_FAR_IMPLICIT, 20, 9, 11, 6, 0.2, &c));
  PetscCall(FemModelSetThreads(c.fem, threads));
  PetscCall(DemModelSetThreads(c.dem, threads));
  PetscCall(CoupledRunPulled(&c, from, to, look, load, save, 2000, u, n, ledger));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestRestart(void)
{
  PetscReal u[3][2000];
  PetscInt  n;
  Ledger    ledger[3];

  PetscFunctionBeginUser;
  PetscCall(Run(0, 120, 1, PETSC_FALSE, NULL, NULL, u[0], &n, &ledger[0]));
  PetscCall(Run(0, 60, 1, PETSC_FALSE, NULL, "far.h5", u[1], &n, &ledger[1]));
  PetscCall(Run(60, 120, 1, PETSC_TRUE, "far.h5", NULL, u[1], &n, &ledger[1]));
  PetscCall(Run(0, 120, 2, PETSC_TRUE, NULL, NULL, u[2], &n, &ledger[2]));
  for (PetscInt k = 1; k < 3; k++) {
    for (PetscInt i = 0; i < n; i++) CheckNear(u[k][i], u[0][i], 0);
    for (PetscInt i = 0; i < LEDGER_TERMS; i++) CheckClose(ledger[k].energy[i], ledger[0].energy[i], k == 1 ? 0 : 1e-13);
  }
  print_message("           supports, loads and gravity on both kinds of node: energy off by %.1e\n", (double)LedgerError(&ledger[0]));
  CheckBelow(LedgerError(&ledger[0]), 1e-4);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRestart)

static PetscErrorCode TestRefused(void)
{
  Coupled        c;
  CouplingReport report;
  Stepper        stepper;
  Ledger         ledger;

  PetscFunctionBeginUser;
  PetscCall(Strip(3, COUPLING_FAR_IMPLICIT, 20, 9, 11, 6, 0.2, &c));
  PetscCall(FemModelSetLocalDamping(c.fem, 0.5));
  CheckFails(CouplingModelSetUp(c.model), PETSC_ERR_USER_INPUT, "do not go together");
  PetscCall(CoupledDestroy(&c));
  PetscCall(Strip(0, COUPLING_FAR_IMPLICIT, 20, 9, 11, 6, 0.2, &c));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetReport(c.model, &report));
  print_message("           auto steps: %d; the particles' step with an explicit far field %.3g s\n", (int)report.substeps, (double)report.explicit_limit);
  CheckTrue(report.implicit);
  CheckAbove(report.substeps, 2);
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.energy(c.model, &ledger));
  for (PetscInt i = 0; i < LEDGER_TERMS; i++) CheckNear(ledger.energy[i], 0, 0);
  PetscCall(CoupledDestroy(&c));
  PetscCall(Strip(1, COUPLING_FAR_AUTO, 20, 9, 11, 6, 0.2, &c)); /* equal elements: nothing to win */
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetReport(c.model, &report));
  CheckTrue(!report.implicit);
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefused)

/* A pulse through both faces and out of an absorbing side: what stays, beside elements alone; sub-steps and implicit far fields alike.  Eqs (2.60)-(2.62) */
static PetscErrorCode TestAbsorb(void)
{
  const struct {
    PetscInt    m;
    CouplingFar far;
  } run[4] = {{1, COUPLING_FAR_EXPLICIT}, {3, COUPLING_FAR_EXPLICIT}, {1, COUPLING_FAR_IMPLICIT}, {3, COUPLING_FAR_IMPLICIT}};
  const PetscReal push[3] = {1, 0, 0}, stress = 1e-4, dt = 0.06;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 4; i++) {
    Coupled   c;
    Stepper   stepper;
    Table     pulse;
    PetscReal t[41], v[41], limit, worst = 0, left;
    Ledger    ledger;

    for (PetscInt k = 0; k <= 40; k++) {
      t[k] = 0.5 * k;
      v[k] = stress * 0.5 * (1 - PetscCosReal(PETSC_PI * k / 20));
    }
    PetscCall(Strip(run[i].m, run[i].far, 30, 12, 15, 6, 0, &c));
    PetscCall(TableCreate(41, t, v, &pulse));
    PetscCall(FemModelAddTraction(c.fem, "xmin", push, &pulse));
    PetscCall(FemModelAddAbsorber(c.fem, "xmax"));
    PetscCall(CouplingModelSetUp(c.model));
    PetscCall(CouplingModelGetStepper(c.model, &stepper));
    PetscCall(stepper.stable_step(c.model, &limit));
    CheckBelow(run[i].m * dt, limit);
    for (PetscInt k = 0; k * run[i].m * dt < 60; k++) {
      PetscCall(stepper.step(c.model, k * run[i].m * dt, run[i].m * dt));
      PetscCall(stepper.energy(c.model, &ledger));
      worst = PetscMax(worst, LedgerError(&ledger));
    }
    left = (ledger.energy[LEDGER_KINETIC] + ledger.energy[LEDGER_STRAIN]) / ledger.energy[LEDGER_WORK];
    print_message("           %s, m = %d: %.1e of the work is still there, %.5f absorbed, ledger %.1e\n", run[i].far == COUPLING_FAR_IMPLICIT ? "implicit" : "explicit", (int)run[i].m, (double)left,
                  (double)(ledger.energy[LEDGER_DAMPING] / ledger.energy[LEDGER_WORK]), (double)worst);
    CheckBelow(left, 1e-3);
    CheckBelow(worst, run[i].far == COUPLING_FAR_EXPLICIT && run[i].m > 1 ? 1e-3 : 1e-10); /* impulses: (omega H)^2/6 of the loads' work */
    PetscCall(TableDestroy(&pulse));
    PetscCall(CoupledDestroy(&c));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestAbsorb)

static const struct CMUnitTest tests[] = {TEST(TestAbsorb), TEST(TestWave), TEST(TestUnconditional), TEST(TestStaticBar), TEST(TestRestart), TEST(TestRefused)};

CHECK_MAIN(tests)
