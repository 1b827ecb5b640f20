/* test_run_ranks.c - two ranks write what one writes, stop together, and go on together. */
#include "run_toy.h"

static const RunOptions plain = {.end = 300, .step = 0.5, .history_every = 1.3, .frame_every = 21, .quiet = PETSC_TRUE, .stamp = "toy"};

static PetscErrorCode TestTwoRanks(void)
{
  Toy         toy;
  RunOptions  o = plain;
  RunSummary  s;
  PetscMPIInt rank;
  PetscReal   u;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (rank == 0) { /* one rank alone, for comparison */
    Stepper stepper;
    Output  output;

    PetscCall(OutputCreate(PETSC_COMM_SELF, "test_ranks.one", PETSC_FALSE, &output));
    PetscCall(ToyCreate(10, &toy));
    ToyGetStepper(&toy, &stepper);
    PetscCall(RunLoop(PETSC_COMM_SELF, &stepper, &plain, output, &s));
    PetscCall(RunSummaryDestroy(&s));
    PetscCall(OutputDestroy(&output));
    PetscCall(ToyDestroy(&toy));
  }
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscCall(ToyCreate(10, &toy));
  o.max_steps = 100;
  PetscCall(RunToy("test_ranks.two", &toy, &o, &s));
  CheckInt(s.end, RUN_INTERRUPTED);
  CheckInt(s.steps, 100);
  PetscCall(RunSummaryDestroy(&s));
  PetscCall(ToyDestroy(&toy));
  PetscCall(ToyCreate(10, &toy)); /* forgets; the checkpoint reaches every rank */
  o.max_steps = 0;
  o.resume    = PETSC_TRUE;
  PetscCall(RunToy("test_ranks.two", &toy, &o, &s));
  CheckInt(s.end, RUN_DONE);
  CheckInt(s.steps, 600);
  u = toy.u[9];
  PetscCallMPI(MPI_Bcast(&u, 1, MPIU_REAL, 0, PETSC_COMM_WORLD));
  CheckNear(toy.u[9], u, 0);
  PetscCall(RunSummaryDestroy(&s));
  PetscCall(ToyDestroy(&toy));
  if (rank == 0) PetscCall(SameFiles("test_ranks.one", "test_ranks.two"));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTwoRanks)

/* Rank 0 cannot write: both ranks return the error. */
static PetscErrorCode TestErrorReachesAll(void)
{
  Toy    toy;
  Output output;

  PetscFunctionBeginUser;
  PetscCall(ToyCreate(10, &toy));
  CheckFails(OutputCreate(PETSC_COMM_WORLD, "/proc/no/such", PETSC_FALSE, &output), PETSC_ERR_USER_INPUT, "");
  toy.poison = 7; /* on one rank, and yet both stop */
  PetscMPIInt rank;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (rank) toy.poison = 0;
  RunOptions o    = plain;
  o.history_every = 0.5;
  CheckFails(RunToy("test_ranks.two", &toy, &o, NULL), PETSC_ERR_FP, "at step 7");
  PetscCall(ToyDestroy(&toy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestErrorReachesAll)

static const struct CMUnitTest tests[] = {TEST(TestTwoRanks), TEST(TestErrorReachesAll)};
CHECK_MAIN(tests)
