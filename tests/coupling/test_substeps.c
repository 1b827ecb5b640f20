/* Elements outside the overlap in one step for m of the particles: the same answer, nothing gained or lost, nothing unstable. */
#include "check.h"
#include "checkpoint.h"
#include "coupled.h"

static PetscErrorCode Strip(PetscInt m, PetscReal length, PetscReal from, PetscReal to, PetscReal ratio, PetscReal nu, Coupled *c)
{
  const PetscReal       size[3] = {length, 2, 1};
  const CouplingOptions options = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = m};

  PetscFunctionBegin;
  PetscCall(CoupledCreate(2, size, 1, from, to, ratio, 2, nu, 7, &options, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Total(const Ledger *ledger)
{
  PetscReal sum = 0;

  for (PetscInt t = 0; t < LEDGER_WORK; t++) sum += ledger->energy[t];
  return sum;
}

static PetscErrorCode Shake(Coupled *c, uint64_t seed)
{
  FemState fs;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(c->fem, &fs));
  for (PetscInt i = 0; i < fs.n_nodes * fs.dim; i++) fs.v[i] = 1e-9 * ((double)(seed = seed * 6364136223846793005ULL + 1442695040888963407ULL) / 18446744073709551616.0 - 0.5);
  PetscCall(FemModelRestoreState(c->fem, &fs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A pulse ten elements long, sent by a traction, seen six elements before the far end: displacement every ten particle steps. */
static PetscErrorCode Wave(PetscInt m, PetscReal dt, PetscInt samples, PetscReal *u, PetscReal *worst, PetscReal *limit)
{
  const PetscReal push[3] = {1, 0, 0}, stress = 1e-4;
  Coupled         c;
  Stepper         stepper;
  Table           pulse;
  PetscReal       t[21], v[21];
  FemState        fs;

  PetscFunctionBegin;
  for (PetscInt k = 0; k <= 20; k++) {
    t[k] = 0.5 * k;
    v[k] = stress * 0.5 * (1 - PetscCosReal(PETSC_PI * k / 10));
  }
  PetscCall(Strip(m, 40, 18, 22, 8, 0, &c));
  PetscCall(TableCreate(21, t, v, &pulse));
  PetscCall(FemModelAddTraction(c.fem, "xmin", push, &pulse));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, limit));
  *limit /= m;
  *worst = 0;
  for (PetscInt k = 0; k < samples; k++) {
    Ledger ledger;

    for (PetscInt j = 0; j < 10 / m; j++) PetscCall(stepper.step(c.model, (k * (10 / m) + j) * m * dt, m * dt));
    PetscCall(stepper.energy(c.model, &ledger));
    *worst = PetscMax(*worst, LedgerError(&ledger));
    PetscCall(FemModelGetState(c.fem, &fs));
    for (PetscInt i = 0; i < fs.n_nodes; i++)
      if (fs.x[2 * i] == 34 && fs.x[2 * i + 1] == 1) u[k] = fs.u[2 * i];
    PetscCall(FemModelRestoreState(c.fem, &fs));
  }
  PetscCall(TableDestroy(&pulse));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestWave(void)
{
  const PetscInt m[4] = {1, 2, 5, 10};
  PetscReal      u[4][200], limit, worst = 0, dt = 0.04, top = 0;
  PetscInt       n = (PetscInt)(44 / (10 * dt));

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 4; k++) {
    PetscReal off = 0;

    PetscCall(Wave(m[k], dt, n, u[k], &worst, &limit));
    CheckBelow(dt, limit);
    for (PetscInt i = 0; i < n; i++) {
      top = PetscMax(top, PetscAbsReal(u[0][i]));
      off = PetscMax(off, PetscAbsReal(u[k][i] - u[0][i]));
    }
    print_message("           m = %2d: history off by %.2e of the largest, energy by %.1e (step %.3g of %.3g)\n", (int)m[k], (double)(off / top), (double)worst, (double)dt, (double)limit);
    CheckBelow(off, 0.01 * top);
    CheckBelow(worst, m[k] <= 5 ? 1e-3 : 4e-3); /* (omega H)^2 / 6 of the loads' work: 4 times that of m = 5 */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestWave)

/* Undamped from random velocities of the nodes: momentum to round-off; over 4e5 particle steps the energy beats slowly (about 3e5 steps, 2e-3), and neither half has more. */
static PetscErrorCode TestBounded(void)
{
  const PetscInt m = 5, steps = 400000 / m, window = steps / 40;
  Coupled        c;
  Stepper        stepper;
  Ledger         ledger;
  FemState       fs;
  DemState       ds;
  PetscReal      dt, mean[40] = {0}, half[2] = {0, 0}, least = PETSC_MAX_REAL, most = 0, p[2][2] = {{0}}, scale = 0;

  PetscFunctionBeginUser;
  PetscCall(Strip(m, 20, 9, 11, 6, 0.2, &c));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, &dt));
  dt *= 0.9;
  PetscCall(Shake(&c, 5));
  for (PetscInt k = 0; k < steps; k++) {
    PetscCall(stepper.step(c.model, k * dt, dt));
    if (k % 5 == 0) {
      PetscCall(stepper.energy(c.model, &ledger));
      mean[k / window] += 5 * Total(&ledger) / window;
    }
    if (k == 0 || k == 400) {
      PetscCall(FemModelGetState(c.fem, &fs));
      PetscCall(DemModelGetState(c.dem, &ds));
      for (PetscInt d = 0; d < 2; d++) {
        for (PetscInt i = 0; i < fs.n_nodes; i++) {
          p[k > 0][d] += fs.mass[i] * fs.v[2 * i + d];
          scale += fs.mass[i] * PetscAbsReal(fs.v[2 * i + d]) / 4;
        }
        for (PetscInt i = 0; i < ds.n; i++) p[k > 0][d] += ds.mass[i] * ds.v[d * ds.n + i];
      }
      PetscCall(FemModelRestoreState(c.fem, &fs));
      PetscCall(DemModelRestoreState(c.dem, &ds));
    }
  }
  for (PetscInt k = 0; k < 40; k++) {
    half[k / 20] += mean[k] / 20;
    least = PetscMin(least, mean[k]);
    most  = PetscMax(most, mean[k]);
  }
  print_message("           %d macro steps of %d: energy of the second half over the first - 1 = %.1e, of fortieths within %.1e; momentum off by %.1e\n", (int)steps, (int)m, (double)(half[1] / half[0] - 1),
                (double)(most / least - 1), (double)((p[1][0] - p[0][0]) / scale));
  CheckBelow(PetscAbsReal(half[1] / half[0] - 1), 1e-3);
  CheckBelow(most / least - 1, 5e-3);
  for (PetscInt d = 0; d < 2; d++) CheckNear(p[1][d], p[0][d], 1e-12 * scale); /* 400 macro steps; then the body is so far from home that round-off of K u shows */
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBounded)

/* The bar of test_overlap, longer: drawn by a steady traction and brought to rest. The edge swings within a macro step; at its ends
   the bar stands where Hooke puts it, and the ledger stays closed. */
static PetscErrorCode TestStaticBar(void)
{
  const PetscReal nu = 0.2, stress = 1e-6, pull[3] = {1, 0, 0}, t[2] = {0, 30}, v[2] = {0, stress}, strain = stress * (1 - nu * nu);
  Coupled         c;
  Stepper         stepper;
  Table           ramp, none;
  FemState        fs;
  DemState        ds;
  Ledger          ledger;
  PetscReal       dt, reaction, off = 0, tip = 0, later[2] = {0, 0}, was[2];

  PetscFunctionBeginUser;
  PetscCall(Strip(5, 20, 9, 11, 6, nu, &c));
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
  for (PetscInt k = 0; k < 4000; k++) PetscCall(stepper.step(c.model, k * dt, dt));
  PetscCall(stepper.energy(c.model, &ledger));
  was[0] = ledger.energy[LEDGER_DAMPING];
  was[1] = ledger.energy[LEDGER_STRAIN];
  CheckBelow(PetscAbsReal(ledger.energy[LEDGER_KINETIC]), 1e-4 * was[1]);
  CheckBelow(LedgerError(&ledger), 1e-2);
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
  for (PetscInt k = 4000; k < 12000; k++) {
    PetscCall(stepper.step(c.model, k * dt, dt));
    if (k != 7999 && k != 11999) continue;
    PetscCall(FemModelGetState(c.fem, &fs));
    for (PetscInt i = 0; i < fs.n_nodes; i++)
      if (fs.x[2 * i] == 20) later[k > 8000] = fs.u[2 * i];
    PetscCall(FemModelRestoreState(c.fem, &fs));
  }
  PetscCall(stepper.energy(c.model, &ledger));
  print_message("           bar at m = 5: displacement off by %.2e of strain x element, tip %.2e, reaction %.2e, drift %.1e, then %.1e; 8000 more steps: damping %.1e of the strain energy\n", (double)off, (double)(tip / (20 * strain) - 1),
                (double)(-reaction / (2 * stress) - 1), (double)(later[0] / tip - 1), (double)(later[1] / later[0] - 1), (double)((ledger.energy[LEDGER_DAMPING] - was[0]) / was[1]));
  CheckBelow(off, 0.01);
  CheckBelow(PetscAbsReal(tip / (20 * strain) - 1), 1e-3);
  CheckClose(-reaction, 2 * stress, 1e-6);
  CheckNear(later[0], tip, 1e-5 * tip); /* the particles' slowest mode still decays, as it does with m = 1 */
  CheckBelow(PetscAbsReal(later[1] - later[0]), 0.7 * PetscAbsReal(later[0] - tip));
  CheckBelow(ledger.energy[LEDGER_DAMPING] - was[0], 1e-3 * was[1]);
  PetscCall(TableDestroy(&ramp));
  PetscCall(TableDestroy(&none));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestStaticBar)

/* Particle steps that the outer elements cannot bear, and an m with nothing to act on, are refused in words; auto finds one. */
static PetscErrorCode TestRefused(void)
{
  Coupled        c;
  CouplingReport report;
  Stepper        stepper;
  Ledger         ledger;

  PetscFunctionBeginUser;
  PetscCall(Strip(40, 20, 9, 11, 6, 0.2, &c));
  CheckFails(CouplingModelSetUp(c.model), PETSC_ERR_USER_INPUT, "exceed what the elements outside the overlap allow");
  PetscCall(CoupledDestroy(&c));
  PetscCall(Strip(3, 12, 5, 7, 6, 0.2, &c));
  CheckFails(CouplingModelSetUp(c.model), PETSC_ERR_USER_INPUT, "has no element to act on");
  PetscCall(CoupledDestroy(&c));
  PetscCall(Strip(3, 20, 9, 11, 6, 0.2, &c));
  PetscCall(FemModelSetLocalDamping(c.fem, 0.5));
  CheckFails(CouplingModelSetUp(c.model), PETSC_ERR_USER_INPUT, "do not go together");
  PetscCall(CoupledDestroy(&c));
  PetscCall(Strip(0, 20, 9, 11, 6, 0.2, &c));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetReport(c.model, &report));
  print_message("           auto: %d\n", (int)report.substeps);
  CheckAbove(report.substeps, 4);
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.energy(c.model, &ledger));
  for (PetscInt i = 0; i < LEDGER_TERMS; i++) CheckNear(ledger.energy[i], 0, 0); /* the trials leave nothing behind */
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefused)

/* N steps, a checkpoint, N more: the bits of 2 N steps. Supports and loads on inner and outer nodes. */
static PetscErrorCode Run(PetscInt from, PetscInt to, const char *load, const char *save, PetscReal *u, PetscInt *n, Ledger *ledger)
{
  Coupled c;

  PetscFunctionBegin;
  PetscCall(Strip(3, 20, 9, 11, 6, 0.2, &c));
  PetscCall(CoupledRunPulled(&c, from, to, PETSC_FALSE, load, save, 2000, u, n, ledger));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestRestart(void)
{
  PetscReal u[2][2000];
  PetscInt  n;
  Ledger    ledger[2];

  PetscFunctionBeginUser;
  PetscCall(Run(0, 120, NULL, NULL, u[0], &n, &ledger[0]));
  PetscCall(Run(0, 60, NULL, "substeps.h5", u[1], &n, &ledger[1]));
  PetscCall(Run(60, 120, "substeps.h5", NULL, u[1], &n, &ledger[1]));
  for (PetscInt i = 0; i < n; i++) CheckNear(u[1][i], u[0][i], 0);
  for (PetscInt i = 0; i < LEDGER_TERMS; i++) CheckNear(ledger[1].energy[i], ledger[0].energy[i], 0);
  print_message("           supports, loads and gravity on both kinds of node: energy off by %.1e\n", (double)LedgerError(&ledger[0]));
  CheckBelow(LedgerError(&ledger[0]), 1e-2);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRestart)

/* One particle to an element of the overlap: the corrected energy has no minimum, and the set-up says so, sub-steps or not; two are borne. */
static PetscErrorCode TestTooFew(void)
{
  const PetscReal size[3] = {14, 2, 2};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt m = 0; m < 2; m++)
      for (PetscInt ratio = 1; ratio <= 2; ratio++) {
        const CouplingOptions options = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = m};
        Coupled               c;

        PetscCall(CoupledCreate(dim, size, 1, 6, 8, ratio, 2, 0.2, 1, &options, &c));
        if (ratio == 1) CheckFails(CouplingModelSetUp(c.model), PETSC_ERR_USER_INPUT, "has no stable energy");
        else PetscCall(CouplingModelSetUp(c.model));
        PetscCall(CoupledDestroy(&c));
      }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTooFew)

static const struct CMUnitTest tests[] = {TEST(TestTooFew), TEST(TestWave), TEST(TestBounded), TEST(TestStaticBar), TEST(TestRefused), TEST(TestRestart)};

CHECK_MAIN(tests)
