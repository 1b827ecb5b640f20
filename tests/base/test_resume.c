/*
  test_resume.c - a run that stopped and went on leaves the same bytes as one that did not stop.

  Called as `test_resume child DIRECTORY KIND` it is the run that the tests interrupt from outside.
*/
#include "run_toy.h"
#include "files.h"
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;
static char **clean_environment; /* as it was before MPI added to it: a child is a run of its own */

static const RunOptions plain = {.end = 300, .step = 0.5, .history_every = 1.3, .frame_every = 21, .quiet = PETSC_TRUE, .stamp = "scene: toy\nyoung: 28 GPa\n"};

static PetscErrorCode RunWhole(const char *directory, const RunOptions *options)
{
  Toy toy;

  PetscFunctionBeginUser;
  PetscCall(ToyCreate(10, &toy));
  PetscCall(RunToy(directory, &toy, options, NULL));
  PetscCall(ToyDestroy(&toy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Resume(const char *directory, RunOptions options, RunSummary *summary)
{
  Toy            toy;
  PetscErrorCode code;

  PetscFunctionBeginUser;
  options.resume = PETSC_TRUE;
  PetscCall(ToyCreate(10, &toy));
  code = RunToy(directory, &toy, &options, summary);
  PetscCall(ToyDestroy(&toy));
  PetscFunctionReturn(code);
}

/* 600 steps at once, and in pieces of 37, 113 and the rest. */
static PetscErrorCode TestPieces(void)
{
  RunOptions o = plain;
  RunSummary s;
  Toy        toy;

  PetscFunctionBeginUser;
  PetscCall(RunWhole("test_resume.whole", &plain));
  o.max_steps = 37;
  PetscCall(ToyCreate(10, &toy));
  PetscCall(RunToy("test_resume.pieces", &toy, &o, &s));
  CheckInt(s.end, RUN_INTERRUPTED);
  CheckInt(s.steps, 37);
  PetscCall(RunSummaryDestroy(&s));
  PetscCall(ToyDestroy(&toy));
  o.max_steps = 113;
  PetscCall(Resume("test_resume.pieces", o, &s));
  CheckInt(s.steps, 150);
  CheckInt(s.steps_here, 113);
  PetscCall(RunSummaryDestroy(&s));
  PetscCall(Resume("test_resume.pieces", plain, &s));
  CheckInt(s.end, RUN_DONE);
  CheckInt(s.steps, 600);
  PetscCall(RunSummaryDestroy(&s));
  PetscCall(SameFiles("test_resume.whole", "test_resume.pieces"));
  ReadFrames("test_resume.pieces", PETSC_FALSE);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPieces)

/* To N, then to 2N: the row and the frame that only ended the first half are gone. N is no step of the schedule. */
static PetscErrorCode TestLaterEnd(void)
{
  RunOptions half = plain, finer = plain;
  RunSummary s;

  PetscFunctionBeginUser;
  PetscCall(RunWhole("test_resume.whole", &plain));
  half.end = 150;
  PetscCall(RunWhole("test_resume.later", &half));
  PetscCall(Resume("test_resume.later", plain, NULL));
  PetscCall(SameFiles("test_resume.whole", "test_resume.later"));
  PetscCall(Resume("test_resume.later", plain, &s)); /* nothing left to do, nothing changes */
  CheckInt(s.steps_here, 0);
  CheckInt(s.end, RUN_DONE);
  PetscCall(RunSummaryDestroy(&s));
  PetscCall(SameFiles("test_resume.whole", "test_resume.later"));
  finer.step = 0.25;
  CheckFails(Resume("test_resume.later", finer, NULL), PETSC_ERR_USER_INPUT, "step of 0.5 s, not 0.25 s");
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestLaterEnd)

static PetscErrorCode TestRefusals(void)
{
  RunOptions o = plain;
  Toy        toy;

  PetscFunctionBeginUser;
  PetscCall(RunWhole("test_resume.refused", &plain));
  o.stamp = "scene: toy\nyoung: 30 GPa\n";
  CheckFails(Resume("test_resume.refused", o, NULL), PETSC_ERR_USER_INPUT, "'young: 28 GPa' where this one has 'young: 30 GPa'");
  o        = plain;
  o.resume = PETSC_TRUE;
  PetscCall(ToyCreate(11, &toy));
  CheckFails(RunToy("test_resume.refused", &toy, &o, NULL), PETSC_ERR_USER_INPUT, "has 10 numbers, this scene needs 11");
  PetscCall(ToyDestroy(&toy));
  PetscCall(RunWhole("test_resume.refused", &plain));
  CheckTrue(!unlink("test_resume.refused/checkpoint.h5"));
  CheckFails(Resume("test_resume.refused", plain, NULL), PETSC_ERR_USER_INPUT, "no checkpoint");
  CheckAbove(CountRows("test_resume.refused"), 200); /* and what was there stays */
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefusals)

/* A run that starts over leaves nothing of the longer one before it, and nothing that is not ours is touched. */
static PetscErrorCode TestStartsOver(void)
{
  RunOptions  brief = plain;
  FILE       *file;
  struct stat info;

  PetscFunctionBeginUser;
  brief.end = 50;
  PetscCall(RunWhole("test_resume.brief", &brief));
  PetscCall(RunWhole("test_resume.over", &plain));
  file = fopen("test_resume.over/theirs.pvd", "w");
  fputs("<VTKFile/>", file);
  fclose(file);
  PetscCall(RunWhole("test_resume.over", &brief));
  CheckTrue(!stat("test_resume.over/theirs.pvd", &info));
  unlink("test_resume.over/theirs.pvd");
  PetscCall(SameFiles("test_resume.brief", "test_resume.over"));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestStartsOver)

/* Checkpoints by the wall clock, as often as the disk allows, and a line of progress leave no trace in the results. */
static PetscErrorCode TestClockLeavesNoTrace(void)
{
  RunOptions o = plain;
  RunSummary s;
  Toy        toy;
  char      *text;

  PetscFunctionBeginUser;
  PetscCall(RunWhole("test_resume.whole", &plain));
  o.checkpoint_clock = 1e-6;
  o.quiet            = PETSC_FALSE;
  PetscCall(ToyCreate(10, &toy));
  fflush(stdout);
  {
    const int kept = dup(STDOUT_FILENO), file = open("test_resume.said", O_WRONLY | O_CREAT | O_TRUNC, 0666);

    dup2(file, STDOUT_FILENO);
    PetscCall(RunToy("test_resume.clock", &toy, &o, &s));
    dup2(kept, STDOUT_FILENO);
    close(kept);
    close(file);
  }
  PetscCall(ToyDestroy(&toy));
  CheckAbove(s.seconds_checkpoint, 1e-3); /* some 600 of them */
  CheckBelow(s.seconds_checkpoint + s.seconds_output + s.seconds_step, 600);
  PetscCall(RunSummaryDestroy(&s));
  PetscCall(SameFiles("test_resume.whole", "test_resume.clock"));
  PetscCall(FileReadText("test_resume.said", &text, NULL));
  CheckContains(text, "100.0 %  t 300 s  step 600/600");
  CheckContains(text, "element-steps/s");
  CheckContains(text, "kinetic/strain");
  CheckContains(text, "energy error");
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestClockLeavesNoTrace)

/* ---- runs stopped from outside ---- */

static RunOptions ChildOptions(const char *kind)
{
  RunOptions o = plain;

  if (!strcmp(kind, "kill")) {
    o.end              = 60;
    o.frame_every      = 0.5; /* a frame every step */
    o.checkpoint_every = 10;
  }
  return o;
}

static int Child(const char *directory, const char *kind)
{
  Toy            toy;
  RunSummary     s;
  PetscErrorCode code;
  const RunOptions o = ChildOptions(kind);

  if (ToyCreate(10, &toy)) return 3;
  toy.sleep = 2000;
  toy.hang  = (PetscBool)!strcmp(kind, "deaf");
  code = RunToy(directory, &toy, &o, &s);
  if (code) return 1;
  code = s.end == RUN_INTERRUPTED ? 130 : 0;
  return RunSummaryDestroy(&s) || ToyDestroy(&toy) ? 5 : (int)code;
}

static pid_t StartChild(const char *directory, const char *kind)
{
  const pid_t child = fork();

  if (child == 0) {
    char *const arguments[] = {(char *)"test_resume", (char *)"child", (char *)directory, (char *)kind, NULL};

    execve("/proc/self/exe", arguments, clean_environment);
    _exit(4);
  }
  return child;
}

static int WaitFor(pid_t child)
{
  int status;

  waitpid(child, &status, 0);
  return status;
}

/* Until the run has so many rows or frames; a run that ends first is no test. */
static void Await(pid_t child, const char *directory, PetscInt rows, PetscInt frames)
{
  int status;

  while (CountRows(directory) < rows || CountFrames(directory) < frames) {
    if (waitpid(child, &status, WNOHANG)) fail_msg("the child ended early");
    usleep(2000);
  }
}

static void RemoveIndex(const char *directory)
{
  char path[BASE_LINE];

  snprintf(path, sizeof(path), "%s/history.csv", directory);
  unlink(path);
}

static PetscErrorCode TestCtrlC(void)
{
  static const int numbers[] = {SIGINT, SIGTERM, SIGUSR1};
  RunSummary       s;

  PetscFunctionBeginUser;
  PetscCall(RunWhole("test_resume.whole", &plain));
  for (int k = 0; k < 3; k++) {
    pid_t child;
    int   status;

    RemoveIndex("test_resume.ctrlc");
    child = StartChild("test_resume.ctrlc", "slow");
    Await(child, "test_resume.ctrlc", 20, 0);
    kill(child, numbers[k]);
    status = WaitFor(child);
    CheckTrue(WIFEXITED(status));
    CheckInt(WEXITSTATUS(status), 130);
    CheckBelow(CountRows("test_resume.ctrlc"), 200);
    ReadFrames("test_resume.ctrlc", PETSC_FALSE);
    PetscCall(Resume("test_resume.ctrlc", plain, &s));
    CheckAbove(s.steps_here, 50);
    CheckBelow(s.steps_here, 590);
    PetscCall(RunSummaryDestroy(&s));
    PetscCall(SameFiles("test_resume.whole", "test_resume.ctrlc"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCtrlC)

/* A step that does not return must not trap the user: the second signal kills. */
static PetscErrorCode TestSecondCtrlC(void)
{
  pid_t child;
  int   status;

  PetscFunctionBeginUser;
  RemoveIndex("test_resume.deaf");
  child = StartChild("test_resume.deaf", "deaf");
  Await(child, "test_resume.deaf", 1, 1);
  usleep(20000);
  kill(child, SIGINT);
  usleep(100000);
  CheckInt(waitpid(child, &status, WNOHANG), 0);
  kill(child, SIGINT);
  status = WaitFor(child);
  CheckTrue(WIFSIGNALED(status));
  CheckInt(WTERMSIG(status), SIGINT);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSecondCtrlC)

/* kill -9 while frame follows frame: what the indices name is whole, and the run goes on from its checkpoint to the same end. */
static PetscErrorCode TestKill(void)
{
  const RunOptions o = ChildOptions("kill");

  PetscFunctionBeginUser;
  PetscCall(RunWhole("test_resume.frames", &o));
  for (int trial = 0; trial < 4; trial++) {
    pid_t child;

    RemoveIndex("test_resume.kill");
    child = StartChild("test_resume.kill", "kill");
    Await(child, "test_resume.kill", 20, 25 + 10 * trial);
    usleep((useconds_t)(700 * trial));
    kill(child, SIGKILL);
    CheckTrue(WIFSIGNALED(WaitFor(child)));
    ReadFrames("test_resume.kill", PETSC_TRUE);
    PetscCall(Resume("test_resume.kill", o, NULL));
    PetscCall(SameFiles("test_resume.frames", "test_resume.kill"));
  }
  ReadFrames("test_resume.kill", PETSC_FALSE);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestKill)

static const struct CMUnitTest tests[] = {TEST(TestPieces), TEST(TestLaterEnd), TEST(TestRefusals), TEST(TestStartsOver), TEST(TestClockLeavesNoTrace), TEST(TestCtrlC), TEST(TestSecondCtrlC), TEST(TestKill)};

static char **CopyEnvironment(void)
{
  size_t n = 0;
  char **copy;

  while (environ[n]) n++;
  copy = malloc((n + 1) * sizeof(*copy));
  for (size_t k = 0; k <= n; k++) copy[k] = environ[k] ? strdup(environ[k]) : NULL;
  return copy;
}

int main(int argc, char **argv)
{
  const PetscBool child = (PetscBool)(argc == 4 && !strcmp(argv[1], "child"));
  int             result;

  clean_environment = CopyEnvironment();
  if (BaseInitialize(&argc, &argv)) return 99;
  if (child) result = Child(argv[2], argv[3]);
  else result = cmocka_run_group_tests_name(__FILE__, tests, NULL, NULL);
  if (BaseFinalize()) return 98;
  for (char **entry = clean_environment; *entry; entry++) free(*entry);
  free(clean_environment);
  return result;
}
