/*
  test_govern.c - loads that hurry and wait: the law against what it tends to, the clock against sums, a governed run stopped and gone on with.  Eqs (1.9)-(1.11)

  The body here is a table and two numbers: how far from rest it is follows from the pace alone, so what the pace tends to is known.
*/
#include "run_govern.h"
#include "run_toy.h"

static const RunGovernOptions law = {.kinetic = 0.01, .slowest = 0.1, .fastest = 8, .response = 4};

/* The law alone: at a measure in proportion to the pace it goes to pace/measure, from either side, without passing it, one e-fold in a response time at most on the way up. */
static PetscErrorCode TestLaw(void)
{
  const PetscReal start[] = {0.1, 8}, at = 0.4; /* measured per pace: 2.5 is wanted */

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    PetscReal pace = start[k], off = PETSC_MAX_REAL;

    for (int i = 0; i < 400; i++) {
      const PetscReal now = RunGovernPace(&law, pace, at * pace, pace, 0.2);

      CheckBelow(now / pace, PetscExpReal(0.2 / 4) * (1 + 1e-14));
      CheckAbove(now / pace, PetscExpReal(-4 * 0.2 / 4) * (1 - 1e-14));
      CheckTrue((now - 2.5) * (start[k] - 2.5) >= 0 && PetscAbsReal(now - 2.5) <= off);
      off  = PetscAbsReal(now - 2.5);
      pace = now;
    }
    CheckNear(pace, 2.5, 1e-6);
  }
  CheckNear(RunGovernPace(&law, 1, 0, 8, 0.2), 8, 1e-12); /* at rest: the bounds */
  CheckNear(RunGovernPace(&law, 1, 1e9, 0.1, 0.2), 0.1, 1e-12);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestLaw)

/* Pace is continuous, load time its integral; what a table moves has the speed the table says times the pace; without a clock tables are what they were. */
static PetscErrorCode TestClock(void)
{
  const TableClock clock = {{-2, 0, 2, 5}, {-3, 0, 5, 13.25}, {1, 2, 3, 2.5}};
  const PetscReal  t[] = {0, 4, 9}, v[] = {0, 2, -1}, h = 1e-5;
  Table            table, plain;

  PetscFunctionBeginUser;
  PetscCall(TableCreate(3, t, v, &plain));
  PetscCall(TableCopy(&plain, &table));
  CheckTrue(!table.clock);
  for (PetscReal s = -1; s < 12; s += 0.37) {
    CheckNear(TableClockTime(NULL, s), s, 0);
    CheckNear(TableValue(&table, s), TableValue(&plain, s), 0);
    CheckNear(TableRate(&table, s), TableValue(&plain, s), 0);
  }
  table.clock = &clock;
  PetscCall(TableDestroy(&plain));
  PetscCall(TableCopy(&table, &plain));
  CheckTrue(plain.clock == &clock); /* handed on */
  for (PetscReal s = -1.9; s < 7; s += 0.37) {
    CheckNear((TableClockTime(&clock, s + h) - TableClockTime(&clock, s - h)) / (2 * h), TableClockPace(&clock, s), 1e-5);
    CheckNear((TableIntegral(&table, s + h) - TableIntegral(&table, s - h)) / (2 * h), TableRate(&table, s), 1e-4);
    CheckNear((TableValue(&table, s + h) - TableValue(&table, s - h)) / (2 * h), TableSlope(&table, s), 1e-4);
  }
  for (int k = 0; k < 4; k++) { /* from either side of the knots */
    CheckNear(TableClockTime(&clock, clock.at[k] - 1e-9), clock.load[k], 1e-8);
    CheckNear(TableClockTime(&clock, clock.at[k]), clock.load[k], 0);
    CheckNear(TableClockPace(&clock, clock.at[k] - 1e-9), clock.pace[k], 1e-8);
  }
  CheckNear(TableClockTime(&clock, 7), 13.25 + 2 * 2.5, 1e-12);
  PetscCall(TableDestroy(&table));
  PetscCall(TableDestroy(&plain));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestClock)

/* A body whose kinetic energy is kinetic pace^2 and whose strain energy is 1; breaks between the load times 100 and 200, then takes `power` joules in a unit of load time. */
typedef struct {
  TableClock *clock;
  PetscReal   kinetic, power, x, now;
  PetscInt    looks;
  Table       speed;
} Piston;

static PetscErrorCode PistonStep(void *ctx, PetscReal t, PetscReal dt)
{
  Piston *p = ctx;

  p->x   = TableIntegral(&p->speed, t + dt);
  p->now = t + dt;
  return PETSC_SUCCESS;
}

static PetscErrorCode PistonEnergy(void *ctx, Ledger *ledger)
{
  Piston         *p    = ctx;
  const PetscReal load = TableClockTime(p->clock, p->now), pace = TableClockPace(p->clock, p->now);

  memset(ledger, 0, sizeof(*ledger));
  ledger->energy[LEDGER_KINETIC]  = p->kinetic * pace * pace;
  ledger->energy[LEDGER_STRAIN]   = 1;
  ledger->energy[LEDGER_FRACTURE] = p->power * PetscMax(0, PetscMin(100, load - 100));
  ledger->energy[LEDGER_WORK]     = ledger->energy[LEDGER_KINETIC] + ledger->energy[LEDGER_FRACTURE];
  ledger->work_in                 = 1 + ledger->energy[LEDGER_WORK];
  p->looks++;
  return PETSC_SUCCESS;
}

static PetscErrorCode PistonHistory(void *ctx, PetscInt i, PetscReal *value)
{
  (void)i;
  *value = ((Piston *)ctx)->x;
  return PETSC_SUCCESS;
}

static PetscErrorCode PistonWrite(void *ctx, Output output)
{
  (void)ctx, (void)output;
  return PETSC_SUCCESS;
}

static PetscErrorCode PistonSave(void *ctx, Checkpoint c)
{
  Piston *p = ctx;

  PetscFunctionBeginUser;
  PetscCall(CheckpointWriteReal(c, "piston", 2, (PetscReal[]){p->x, p->now}));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PistonLoad(void *ctx, Checkpoint c)
{
  Piston   *p = ctx;
  PetscReal kept[2];

  PetscFunctionBeginUser;
  PetscCall(CheckpointReadReal(c, "piston", 2, kept));
  p->x   = kept[0];
  p->now = kept[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RunPiston(const char *directory, const RunGovernOptions *govern, PetscReal kinetic, PetscReal power, const RunOptions *options, RunSummary *sum)
{
  static const char *const name = "x", *const unit = "m";
  const PetscReal t[] = {0, 50, 300}, v[] = {0, 1, 3};
  TableClock      clock;
  Piston          p = {.clock = govern ? &clock : NULL, .kinetic = kinetic, .power = power};
  Stepper         stepper = {.name = "piston", .ctx = &p, .step = PistonStep, .energy = PistonEnergy, .history = PistonHistory, .write = PistonWrite, .save = PistonSave, .load = PistonLoad, .n_history = 1, .history_name = &name, .history_unit = &unit};
  RunGovern       g = NULL;
  Output          output;

  PetscFunctionBeginUser;
  PetscCall(TableCreate(3, t, v, &p.speed));
  if (govern) {
    RunGovernClock(govern, &clock);
    p.speed.clock = &clock;
    PetscCall(RunGovernCreate(PETSC_COMM_WORLD, govern, &stepper, &clock, &g));
    PetscCall(RunGovernGetStepper(g, &stepper));
  }
  PetscCall(OutputCreate(PETSC_COMM_WORLD, directory, options->resume, &output));
  PetscCall(RunLoop(PETSC_COMM_WORLD, &stepper, options, output, sum));
  PetscCall(OutputDestroy(&output));
  PetscCall(RunGovernDestroy(&g));
  PetscCall(TableDestroy(&p.speed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const RunOptions plain = {.end = 300, .step = 0.1, .history_every = 2, .quiet = PETSC_TRUE, .stamp = "piston\n"};

/* The pace is sqrt(kinetic wanted / kinetic at pace 1) where nothing breaks and the value that takes the energy asked for where it does; rows fall on load times; the piston is
   where its table has it then. */
static PetscErrorCode TestGoverned(void)
{
  const char      *directory = "test_govern.out";
  RunGovernOptions o = law;
  RunSummary       s;
  PetscReal       *time, *x, *load, *pace, highest = 0;
  PetscInt         n;

  PetscFunctionBeginUser;
  o.breaking = 0.5; /* pace 0.5 where power is 1/4 */
  PetscCall(RunPiston(directory, &o, 0.01 / 9, 0.25, &plain, &s));
  CheckInt(s.end, RUN_DONE);
  time = ReadColumn(directory, 0, &n);
  x    = ReadColumn(directory, 2, &n);
  load = ReadColumn(directory, 3, &n);
  pace = ReadColumn(directory, 4, &n);
  CheckInt(n, 151);
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal T = load[k], v = T < 50 ? T * T / 100 : T < 300 ? 25 + (T - 50) * (1 + 0.5 * (T - 50) * 2 / 250) : 525 + 3 * (T - 300);

    CheckNear(T, 2 * k, 0.1 * 3.1);
    CheckAbove(T, 2 * k - 1e-6);
    CheckNear(x[k], v, 1e-9 * (1 + v));
    if (k) CheckNear((T - load[k - 1]) / (time[k] - time[k - 1]), 0.5 * (pace[k] + pace[k - 1]), 0.15);
    highest = PetscMax(highest, pace[k]);
    if (T > 92 && T < 100) CheckNear(pace[k], 3, 0.02);
    if (T > 160 && T < 198) CheckNear(pace[k], 0.5, 0.005);
    if (T > 290) CheckNear(pace[k], 3, 0.02);
  }
  CheckBelow(highest, 3.02);
  CheckAbove(s.steps, 2000);
  CheckBelow(s.steps, 3500); /* of 300 / 0.1 at pace 1; 10/3 of 100, 10/0.5 of 100 and the ways between */
  PetscCall(PetscFree(time));
  PetscCall(PetscFree(x));
  PetscCall(PetscFree(load));
  PetscCall(PetscFree(pace));
  PetscCall(RunSummaryDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestGoverned)

/* At once, and in pieces that end between looks and at one: the same files. Without a governor no energy is looked at but for the rows. */
static PetscErrorCode TestPieces(void)
{
  const PetscInt   stops[] = {33, 7, 160, 411};
  RunGovernOptions o = law;
  RunOptions       run = plain;
  RunSummary       s;

  PetscFunctionBeginUser;
  o.breaking = 0.5;
  PetscCall(RunPiston("test_govern.whole", &o, 0.01 / 9, 0.25, &run, &s));
  PetscCall(RunSummaryDestroy(&s));
  for (int k = 0; k < 5; k++) {
    run.max_steps = k < 4 ? stops[k] : 0;
    run.resume    = (PetscBool)(k > 0);
    PetscCall(RunPiston("test_govern.pieces", &o, 0.01 / 9, 0.25, &run, &s));
    CheckInt(s.end, k < 4 ? RUN_INTERRUPTED : RUN_DONE);
    PetscCall(RunSummaryDestroy(&s));
  }
  PetscCall(SameFiles("test_govern.whole", "test_govern.pieces"));
  run = plain;
  PetscCall(RunPiston("test_govern.plain", NULL, 0.01 / 9, 0.25, &run, &s));
  CheckInt(s.steps, 3000);
  PetscCall(RunSummaryDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPieces)

static PetscErrorCode TestRefusals(void)
{
  RunGovernOptions o = law;
  RunSummary       s;

  PetscFunctionBeginUser;
  o.slowest = 0;
  CheckFails(RunPiston("test_govern.no", &o, 0, 0, &plain, &s), PETSC_ERR_USER_INPUT, "positive least");
  o         = law;
  o.fastest = 0.05;
  CheckFails(RunPiston("test_govern.no", &o, 0, 0, &plain, &s), PETSC_ERR_USER_INPUT, "positive least");
  o         = law;
  o.kinetic = 0;
  CheckFails(RunPiston("test_govern.no", &o, 0, 0, &plain, &s), PETSC_ERR_USER_INPUT, "Nothing governs");
  o            = law;
  o.unbalanced = 0.01;
  CheckFails(RunPiston("test_govern.no", &o, 0, 0, &plain, &s), PETSC_ERR_USER_INPUT, "no unbalanced force");
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefusals)

static const struct CMUnitTest tests[] = {TEST(TestLaw), TEST(TestClock), TEST(TestGoverned), TEST(TestPieces), TEST(TestRefusals)};

CHECK_MAIN(tests)
