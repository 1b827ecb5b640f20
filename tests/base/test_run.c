/* test_run.c - the loop on a chain of oscillators: time, schedule, energy, and that no bad state is written. */
#include "run_toy.h"
#include "files.h"

#define DIRECTORY "test_run.out"

static const RunOptions plain = {.end = 100, .safety = 0.9, .quiet = PETSC_TRUE};

/* Mode j under central differences is A sin(w n dt) with sin(w dt/2) = omega dt/2, to round-off; against the exact
   sin(omega t) halving dt gains a factor of four. */
static PetscErrorCode TestOscillator(void)
{
  PetscReal error[3];

  PetscFunctionBeginUser;
  for (int level = 0; level < 3; level++) {
    const PetscInt n = 20, mode = 5;
    const PetscReal dt = 0.1 / (1 << level);
    Toy             toy;
    RunOptions      o = plain;
    RunSummary      s;
    PetscReal       omega, w, shape;

    o.step = dt;
    o.end  = 24;
    PetscCall(ToyCreate(n, &toy));
    PetscCall(ToySetMode(&toy, mode));
    PetscCall(RunToy(DIRECTORY, &toy, &o, &s));
    CheckInt(s.end, RUN_DONE);
    CheckInt(s.steps, 240 << level);
    CheckNear(s.time, 24, 1e-12);
    omega = ToyFrequency(&toy, mode);
    w     = 2 / dt * PetscAsinReal(omega * dt / 2);
    shape = 1e-3 * PetscSinReal(PETSC_PI * mode * n / (n + 1));
    CheckNear(toy.u[n - 1], shape * dt / PetscSinReal(w * dt) * PetscSinReal(w * s.time), 1e-15);
    error[level] = PetscAbsReal(toy.u[n - 1] - shape / omega * PetscSinReal(omega * s.time));
    PetscCall(RunSummaryDestroy(&s));
    PetscCall(ToyDestroy(&toy));
  }
  CheckNear(log2(error[0] / error[1]), 2, 0.1);
  CheckNear(log2(error[1] / error[2]), 2, 0.05);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOscillator)

/* With the kinetic energy of (1.5) and work by the trapezoid the discrete energy is kept: 20,000 driven steps at 0.9 of the
   critical step leave round-off. */
static PetscErrorCode TestLedgerCloses(void)
{
  Toy        toy;
  RunOptions o = plain;
  RunSummary s;

  PetscFunctionBeginUser;
  PetscCall(ToyCreate(10, &toy));
  o.end           = 18000;
  o.history_every = 10;
  PetscCall(RunToy(DIRECTORY, &toy, &o, &s));
  CheckAbove(s.steps, 19000);
  CheckClose(s.dt, 0.9 * s.stable_dt, 1e-15);
  CheckAbove(s.ledger.work_in, 1e-5);
  CheckBelow(s.worst_ledger_error, 1e-11);
  CheckAbove(s.worst_ledger_error, 1e-20); /* it was looked at */
  CheckAbove(s.highest[0], 1e-4);
  CheckBelow(s.lowest[0], -1e-4);
  PetscCall(RunSummaryDestroy(&s));
  PetscCall(ToyDestroy(&toy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestLedgerCloses)

/* Every 0.1 s in steps of 0.01 s, neither a binary number: 10,001 rows, each 10 steps after the other. */
static PetscErrorCode TestNoDrift(void)
{
  Toy        toy;
  RunOptions o = plain;
  PetscReal *step;
  PetscInt   n;

  PetscFunctionBeginUser;
  PetscCall(ToyCreate(2, &toy));
  o.step          = 0.01;
  o.end           = 1000;
  o.history_every = 0.1;
  PetscCall(RunToy(DIRECTORY, &toy, &o, NULL));
  step = ReadColumn(DIRECTORY, 1, &n);
  CheckInt(n, 10001);
  for (PetscInt r = 0; r < n; r++) CheckNear(step[r], 10. * (PetscReal)r, 0);
  PetscCall(PetscFree(step));
  PetscCall(ToyDestroy(&toy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestNoDrift)

/* Rows at the first step at or after k x every, for intervals below, near and above the step; the brute-force twin counts. */
static PetscErrorCode TestSchedule(void)
{
  static const PetscReal every[] = {0.03, 0.1, 0.10001, 0.17, 0.25, 1.3, 7};

  PetscFunctionBeginUser;
  for (int e = 0; e < 7; e++) {
    Toy        toy;
    RunOptions o = plain;
    PetscReal *step;
    PetscInt   n, row = 0, last = 205, k = 0;

    PetscCall(ToyCreate(3, &toy));
    o.step          = 0.1;
    o.end           = 20.43; /* 204.3 steps: the last lands just after */
    o.history_every = every[e];
    PetscCall(RunToy(DIRECTORY, &toy, &o, NULL));
    step = ReadColumn(DIRECTORY, 1, &n);
    for (PetscInt i = 0; i <= last; i++) {
      PetscBool due = (PetscBool)(i == last);

      while (k * every[e] <= (i + 1e-7) * 0.1) {
        due = PETSC_TRUE;
        k++;
      }
      if (!due) continue;
      CheckTrue(row < n);
      CheckNear(step[row], i, 0);
      row++;
    }
    CheckInt(row, n);
    PetscCall(PetscFree(step));
    PetscCall(ToyDestroy(&toy));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSchedule)

/* First and last row and frame when no interval is given; the state is looked at every 1000 steps all the same. */
static PetscErrorCode TestFirstAndLast(void)
{
  Toy        toy;
  RunOptions o = plain;
  PetscReal *t;
  PetscInt   n;

  PetscFunctionBeginUser;
  PetscCall(ToyCreate(4, &toy));
  o.step = 0.5;
  o.end  = 1750;
  PetscCall(RunToy(DIRECTORY, &toy, &o, NULL));
  t = ReadColumn(DIRECTORY, 0, &n);
  CheckInt(n, 2);
  CheckNear(t[0], 0, 0);
  CheckNear(t[1], 1750, 0);
  CheckInt(CountFrames(DIRECTORY), 2);
  CheckInt(toy.looks, 5); /* 0, 1000, 2000, 3000, 3500 */
  PetscCall(PetscFree(t));
  PetscCall(ToyDestroy(&toy));
  ReadFrames(DIRECTORY, PETSC_FALSE);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFirstAndLast)

/* No row, frame or checkpoint of what went wrong; the message says when and what is left. */
static PetscErrorCode CheckStopped(PetscInt rows, PetscInt frames, PetscInt checkpoint)
{
  Checkpoint c;
  PetscReal *error, *u;
  PetscInt   n, step;

  PetscFunctionBeginUser;
  CheckInt(CountRows(DIRECTORY), rows);
  CheckInt(CountFrames(DIRECTORY), frames);
  ReadFrames(DIRECTORY, PETSC_FALSE);
  u     = ReadColumn(DIRECTORY, 2, &n);
  error = ReadColumn(DIRECTORY, 4 + LEDGER_TERMS, &n);
  for (PetscInt r = 0; r < n; r++) {
    CheckTrue(!PetscIsInfOrNanReal(u[r]));
    CheckBelow(error[r], 0.05);
  }
  PetscCall(PetscFree(u));
  PetscCall(PetscFree(error));
  PetscCall(CheckpointOpen(PETSC_COMM_WORLD, DIRECTORY "/checkpoint.h5", &c));
  PetscCall(CheckpointReadInt(c, "run/step", 1, &step));
  CheckInt(step, checkpoint);
  PetscCall(CheckpointClose(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestNaN(void)
{
  Toy        toy;
  RunOptions o = plain;

  PetscFunctionBeginUser;
  PetscCall(ToyCreate(10, &toy));
  toy.poison         = 57;
  o.step             = 0.5;
  o.history_every    = 5;
  o.frame_every      = 10;
  o.checkpoint_every = 10;
  CheckFails(RunToy(DIRECTORY, &toy, &o, NULL), PETSC_ERR_FP, "at step 60, t = 30 s");
  CheckContains(BaseErrorMessage(), DIRECTORY "/checkpoint.h5 (step 40)");
  PetscCall(CheckStopped(6, 3, 40));
  PetscCall(ToyDestroy(&toy));
  PetscCall(ToyCreate(10, &toy));
  toy.poison         = 3;
  o.checkpoint_every = 0;
  CheckFails(RunToy(DIRECTORY, &toy, &o, NULL), PETSC_ERR_FP, "no checkpoint was written yet");
  PetscCall(ToyDestroy(&toy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestNaN)

static PetscErrorCode TestLedgerBound(void)
{
  Toy        toy;
  RunOptions o = plain;
  RunSummary s;

  PetscFunctionBeginUser;
  PetscCall(ToyCreate(10, &toy));
  toy.kick           = 57;
  o.step             = 0.5;
  o.history_every    = 5;
  o.frame_every      = 10;
  o.checkpoint_every = 10;
  CheckFails(RunToy(DIRECTORY, &toy, &o, &s), PETSC_ERR_NOT_CONVERGED, "Energy balance lost at step 60, t = 30 s");
  CheckContains(BaseErrorMessage(), "bound 0.05");
  CheckContains(BaseErrorMessage(), DIRECTORY "/checkpoint.h5 (step 40)");
  CheckInt(s.steps, 60);
  PetscCall(RunSummaryDestroy(&s));
  PetscCall(CheckStopped(6, 3, 40));
  PetscCall(ToyDestroy(&toy));
  PetscCall(ToyCreate(10, &toy)); /* and a bound wide enough lets it pass */
  toy.kick       = 57;
  o.ledger_bound = 50;
  PetscCall(RunToy(DIRECTORY, &toy, &o, NULL));
  PetscCall(ToyDestroy(&toy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestLedgerBound)

/* 5 % above the critical step the discrete energy still balances for a while: it grows as kinetic and strain of opposite
   sign. The loop stops on the growth, and at the latest on infinities, with every written number finite. */
static PetscErrorCode TestUnstableStep(void)
{
  PetscFunctionBeginUser;
  for (int often = 0; often < 2; often++) {
    Toy        toy;
    RunOptions o = plain;
    RunSummary s;

    PetscCall(ToyCreate(10, &toy));
    o.step             = 1.05 * 2 / ToyFrequency(&toy, 10);
    o.end              = 5000;
    o.history_every    = often ? 5 : 0;
    o.checkpoint_every = often ? 5 : 0;
    CheckFails(RunToy(DIRECTORY, &toy, &o, &s), often ? PETSC_ERR_NOT_CONVERGED : PETSC_ERR_FP, "stable step");
    CheckBelow(s.steps, often ? 30 : 1000);
    PetscCall(RunSummaryDestroy(&s));
    PetscCall(ToyDestroy(&toy));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestUnstableStep)

static PetscErrorCode TestStepFails(void)
{
  Toy        toy;
  RunOptions o = plain;
  RunSummary s;

  PetscFunctionBeginUser;
  PetscCall(ToyCreate(10, &toy));
  toy.fail = 5;
  CheckFails(RunToy(DIRECTORY, &toy, &o, &s), PETSC_ERR_PLIB, "the toy broke");
  CheckInt(s.steps, 4);
  PetscCall(RunSummaryDestroy(&s));
  PetscCall(ToyDestroy(&toy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestStepFails)

/* Out-of-balance ratio 1/step below 0.02: seen at the first row after step 50. */
static PetscErrorCode TestStopsWhenStill(void)
{
  Toy        toy;
  RunOptions o = plain;
  RunSummary s;
  PetscReal *step;
  PetscInt   n;

  PetscFunctionBeginUser;
  PetscCall(ToyCreate(10, &toy));
  toy.stillness     = 1;
  o.step            = 0.5;
  o.history_every   = 6;
  o.unbalanced_stop = 0.02;
  PetscCall(RunToy(DIRECTORY, &toy, &o, &s));
  CheckInt(s.end, RUN_QUIET_STATE);
  CheckInt(s.steps, 60);
  step = ReadColumn(DIRECTORY, 1, &n);
  CheckInt(n, 6);
  CheckNear(step[5], 60, 0);
  CheckInt(CountFrames(DIRECTORY), 2);
  PetscCall(PetscFree(step));
  PetscCall(RunSummaryDestroy(&s));
  o.resume = PETSC_TRUE; /* still still: nothing moves on */
  PetscCall(RunToy(DIRECTORY, &toy, &o, &s));
  CheckInt(s.end, RUN_QUIET_STATE);
  CheckInt(s.steps_here, 0);
  PetscCall(RunSummaryDestroy(&s));
  PetscCall(ToyDestroy(&toy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestStopsWhenStill)

static PetscErrorCode AnyStep(void *ctx, PetscReal *dt)
{
  *dt = PETSC_MAX_REAL;
  return PETSC_SUCCESS;
}

static PetscErrorCode TestBadOptions(void)
{
  Toy        toy;
  Stepper    stepper;
  Output     output;
  RunOptions o = plain;
  RunSummary s;
  FILE      *file;

  PetscFunctionBeginUser;
  PetscCall(ToyCreate(10, &toy));
  o.end = 0;
  CheckFails(RunToy(DIRECTORY, &toy, &o, &s), PETSC_ERR_USER_INPUT, "time.end");
  o.end  = 1e12;
  o.step = 1e-12;
  CheckFails(RunToy(DIRECTORY, &toy, &o, NULL), PETSC_ERR_USER_INPUT, "more than this build can count");
  o             = plain;
  o.frame_every = -1;
  CheckFails(RunToy(DIRECTORY, &toy, &o, &s), PETSC_ERR_USER_INPUT, "negative");
  o = plain;
  ToyGetStepper(&toy, &stepper);
  stepper.stable_step = AnyStep;
  PetscCall(OutputCreate(PETSC_COMM_WORLD, DIRECTORY, PETSC_FALSE, &output));
  CheckFails(RunLoop(PETSC_COMM_WORLD, &stepper, &o, output, &s), PETSC_ERR_USER_INPUT, "sets no time step");
  PetscCall(RunSummaryDestroy(&s));
  PetscCall(OutputDestroy(&output));
  CheckFails(OutputCreate(PETSC_COMM_WORLD, "/proc/no/such", PETSC_FALSE, &output), PETSC_ERR_USER_INPUT, "/proc/no");
  CheckFails(OutputCreate(PETSC_COMM_WORLD, "", PETSC_FALSE, &output), PETSC_ERR_USER_INPUT, "needs a name");
  PetscCall(FileOpen("test_run.file", "w", &file));
  PetscCall(FileClose(&file, "test_run.file"));
  CheckFails(OutputCreate(PETSC_COMM_WORLD, "test_run.file", PETSC_FALSE, &output), PETSC_ERR_USER_INPUT, "not a directory");
  CheckFails(OutputCreate(PETSC_COMM_WORLD, "test_run.file/below", PETSC_FALSE, &output), PETSC_ERR_USER_INPUT, "test_run.file");
  PetscCall(ToyDestroy(&toy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBadOptions)

static const struct CMUnitTest tests[] = {TEST(TestOscillator), TEST(TestLedgerCloses), TEST(TestNoDrift),      TEST(TestSchedule),  TEST(TestFirstAndLast),   TEST(TestNaN),
                                          TEST(TestLedgerBound), TEST(TestUnstableStep), TEST(TestStepFails), TEST(TestStopsWhenStill), TEST(TestBadOptions)};
CHECK_MAIN(tests)
