/* Ways of joining both sides: the springs of one energy, the constraint held exactly, springs of a given stiffness; and the absorber. */
#include "check.h"
#include "checkpoint.h"
#include "coupled.h"
#include "wave.h"

static const char *const name[] = {"energy", "consistent", "penalty"};

static CouplingOptions Options(CouplingMethod method, PetscBool preload, PetscBool absorber)
{
  return (CouplingOptions){.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1, .method = method, .penalty = 1, .preload = preload, .absorber = absorber};
}

static PetscErrorCode TestRest(void)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 4; k++) {
    const CouplingOptions options = Options(k < 3 ? (CouplingMethod)k : COUPLING_ENERGY, PETSC_TRUE, (PetscBool)(k == 3));
    PetscReal             off, drift, step;

    PetscCall(CoupledRest(&options, 10000, &off, &drift, &step, NULL));
    print_message("           %-10s displacement off by %.1e of strain x element, drift in 10,000 steps %.1e, critical step %.4f\n", k < 3 ? name[k] : "absorber", (double)off, (double)drift, (double)step);
    CheckBelow(off, 3e-3);
    CheckBelow(drift, 1e-9);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRest)

/* A free body, shaken: steps from .. to, its ledger, momentum and state; a checkpoint to begin from and to end with, or NULL. */
static PetscErrorCode Shake(CouplingMethod method, PetscBool absorber, PetscInt from, PetscInt to, const char *load, const char *save, Ledger *first, Ledger *last, PetscReal P[2], PetscReal *scale, PetscReal *sum,
                            CouplingReport *report)
{
  const PetscReal       size[3] = {12, 3, 3};
  const CouplingOptions options = Options(method, PETSC_FALSE, absorber);
  Coupled               c;
  Stepper               stepper;
  Checkpoint            checkpoint;
  FemState              fs;
  DemState              ds;
  PetscReal             dt;
  uint64_t              seed = 4;

  PetscFunctionBegin;
  PetscCall(CoupledCreate(2, size, 1, 5, 7, 4, 2, 0.2, 7, &options, &c));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, &dt));
  dt *= 0.9;
  PetscCall(FemModelGetState(c.fem, &fs));
  for (PetscInt i = 0; i < fs.n_nodes * 2; i++) /* away from the overlap, whose sides begin together */
    if (fs.x[i / 2 * 2] < 2 || fs.x[i / 2 * 2] > 10) fs.v[i] = 1e-12 * ((double)(seed = seed * 6364136223846793005ULL + 1442695040888963407ULL) / 18446744073709551616.0 - 0.5);
  PetscCall(FemModelRestoreState(c.fem, &fs));
  if (load) {
    PetscCall(CheckpointOpen(PETSC_COMM_SELF, load, &checkpoint));
    PetscCall(stepper.load(c.model, checkpoint));
    PetscCall(CheckpointAbandon(&checkpoint));
  }
  for (PetscInt k = from; k < to; k++) {
    PetscCall(stepper.step(c.model, k * dt, dt));
    if (k == 0 && first) PetscCall(stepper.energy(c.model, first));
  }
  if (save) {
    PetscCall(CheckpointCreate(PETSC_COMM_SELF, save, &checkpoint));
    PetscCall(stepper.save(c.model, checkpoint));
    PetscCall(CheckpointClose(&checkpoint));
  }
  PetscCall(stepper.energy(c.model, last));
  PetscCall(CouplingModelGetReport(c.model, report));
  PetscCall(FemModelGetState(c.fem, &fs));
  PetscCall(DemModelGetState(c.dem, &ds));
  P[0] = P[1] = *scale = *sum = 0;
  for (PetscInt i = 0; i < 2 * fs.n_nodes; i++) {
    P[i % 2] += fs.mass[i / 2] * fs.v[i];
    *scale += fs.mass[i / 2] * PetscAbsReal(fs.v[i]);
    *sum += fs.u[i] * (1 + i % 7);
  }
  for (PetscInt i = 0; i < 2 * ds.n; i++) {
    P[i / ds.n] += ds.mass[i % ds.n] * ds.v[i];
    *sum += ds.u[i] * (1 + i % 5);
  }
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(DemModelRestoreState(c.dem, &ds));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Total(const Ledger *ledger)
{
  PetscReal sum = 0;

  for (PetscInt t = 0; t < LEDGER_WORK; t++) sum += ledger->energy[t];
  return sum;
}

/* Momentum and energy of every way, the absorber's loss booked; a restart goes on to the bit; who is off costs nothing. */
static PetscErrorCode TestKept(void)
{
  const PetscInt steps = 2000;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 4; k++) {
    const CouplingMethod method = k < 3 ? (CouplingMethod)k : COUPLING_ENERGY;
    const PetscBool      absorber = (PetscBool)(k == 3);
    Ledger               first = {{0}}, last = {{0}}, again = {{0}};
    PetscReal            P0[2], P[2], scale, sum, sum_again;
    CouplingReport       report;

    PetscCall(Shake(method, absorber, 0, 1, NULL, NULL, &first, &last, P0, &scale, &sum, &report));
    PetscCall(Shake(method, absorber, 0, steps, NULL, NULL, NULL, &last, P, &scale, &sum, &report));
    print_message("           %-10s energy off by %.1e, momentum by %.1e; damping %.2e of the energy, %g solves\n", k < 3 ? name[k] : "absorber", (double)(Total(&last) / Total(&first) - 1),
                  (double)((P[0] - P0[0]) / scale), (double)(last.energy[LEDGER_DAMPING] / Total(&first)), (double)report.solves);
    CheckClose(Total(&last), Total(&first), 1e-6);
    for (PetscInt d = 0; d < 2; d++) CheckNear(P[d], P0[d], 1e-11 * scale);
    CheckTrue((report.solves > 0) == (method == COUPLING_CONSISTENT)); /* what is not named is not done */
    CheckTrue((report.absorbed > 0) == absorber);
    if (absorber) CheckAbove(report.absorbed, 1e-3 * Total(&first));
    PetscCall(Shake(method, absorber, 0, 50, NULL, "methods.h5", NULL, &again, P, &scale, &sum_again, &report));
    PetscCall(Shake(method, absorber, 50, 120, "methods.h5", NULL, NULL, &again, P, &scale, &sum_again, &report));
    PetscCall(Shake(method, absorber, 0, 120, NULL, NULL, NULL, &last, P, &scale, &sum, &report));
    CheckTrue(remove("methods.h5") == 0);
    CheckTrue(sum == sum_again);
    CheckTrue(!memcmp(last.energy, again.energy, sizeof(last.energy)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestKept)

/* Waves below pi h cannot enter the elements: without the absorber all comes back. Those of ten elements must not know of it. */
static PetscErrorCode TestAbsorber(void)
{
  static const PetscReal lambda[] = {2, 2.5, 3, 10};

  PetscFunctionBeginUser;
  for (int k = 0; k < 4; k++) {
    const CouplingOptions options = Options(COUPLING_ENERGY, PETSC_FALSE, PETSC_TRUE);
    PetscReal             plain, absorbed, dt;

    PetscCall(WaveReflect(lambda[k], 2, NULL, &plain, &dt));
    PetscCall(WaveReflect(lambda[k], 2, &options, &absorbed, &dt));
    print_message("           %4.1f h: sent back %.4f, with the absorber %.4f (%.2e, %.2e)\n", (double)lambda[k], (double)plain, (double)absorbed, (double)plain, (double)absorbed);
    if (lambda[k] < 3.1) {
      CheckAbove(plain, 0.98);
      CheckBelow(absorbed, 0.7 * plain);
    } else CheckBelow(absorbed, WaveEdge(lambda[k], dt));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestAbsorber)

/* Springs too soft to hold the affine terms, and what does not go together, are refused. */
static PetscErrorCode TestRefused(void)
{
  const PetscReal size[3] = {12, 3, 3};
  CouplingOptions options[5];
  const char     *words[5] = {"penalty 0.001 are too soft", "must be positive", "belongs to the springs of method: energy", "use substeps: 1", "use far_field: explicit"};

  PetscFunctionBeginUser;
  for (int k = 0; k < 5; k++) options[k] = Options(k < 2 ? COUPLING_PENALTY : COUPLING_CONSISTENT, PETSC_FALSE, PETSC_FALSE);
  options[0].penalty  = 1e-3;
  options[1].penalty  = -1;
  options[2].absorber = PETSC_TRUE;
  options[3].substeps = 2;
  options[4].far      = COUPLING_FAR_IMPLICIT;
  for (int k = 0; k < 5; k++) {
    Coupled c;

    PetscCall(CoupledCreate(2, size, 1, 5, 7, 4, 2, 0.2, 7, &options[k], &c));
    CheckFails(CouplingModelSetUp(c.model), PETSC_ERR_USER_INPUT, words[k]);
    PetscCall(CoupledDestroy(&c));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefused)

static const struct CMUnitTest tests[] = {TEST(TestRest), TEST(TestKept), TEST(TestAbsorber), TEST(TestRefused)};

CHECK_MAIN(tests)
