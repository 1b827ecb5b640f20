/*
  measure.c - what a run would take, from some seconds of it: `cleave check --measure`

  The scene is run as it stands, set-up, rows, frames and pictures included, in a temporary directory that goes afterwards; what was
  seen is carried on to the last step. Steps that cost more later (cracks, new contacts, elements that turn) are not foreseen.
*/
#define _GNU_SOURCE /* nftw */
#include "app.h"
#include <ftw.h>
#include <petsctime.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

#define SECONDS_ENOUGH  4.   /* of stepping; more than the first few steps, whose pages and caches are cold */
#define CHECKPOINTS_PER 300. /* [s] the loop's own interval */

static int Remove(const char *path, const struct stat *status, int kind, struct FTW *walk)
{
  (void)status, (void)kind, (void)walk;
  return remove(path);
}

static PetscErrorCode MakeRoom(MPI_Comm comm, size_t size, char directory[])
{
  const char *top = getenv("TMPDIR");
  int         fine = 1, rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(PetscSNPrintf(directory, size, "%s/cleave-measure-XXXXXX", top && top[0] ? top : "/tmp"));
  if (!rank) fine = mkdtemp(directory) != NULL;
  PetscCallMPI(MPI_Bcast(&fine, 1, MPI_INT, 0, comm));
  BaseCheckInput(fine, comm, "Cannot make a temporary directory '%s'; set TMPDIR to a place that can be written", directory);
  PetscCallMPI(MPI_Bcast(directory, (int)size, MPI_CHAR, 0, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Frames from 0 to the end, at the first step at or after each multiple of the interval, and the last. */
static PetscReal Frames(PetscReal end, PetscReal every)
{
  return every > 0 ? 1 + PetscCeilReal(end / every * (1 - 1e-9)) : 2;
}

PetscErrorCode AppMeasure(AppCase *c, const AppOptions *options, const AppPlan *plan, FILE *out)
{
  RunOptions     loop;
  RunSummary     run = {0};
  AppEnd         end = {.state = "running"};
  Output         output;
  PetscLogDouble now;
  PetscErrorCode code;
  PetscReal      processor, set_up = 0, per_step, rest, frames, frame, total;
  struct rusage  use;
  char           directory[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  if (c->time == APP_MODAL) {
    if (!c->rank) fprintf(out, "  measured  nothing: a modal run has no steps; it takes as long as it takes to run it\n");
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = 0; k < c->clock.n; k++) set_up += c->clock.seconds[k];
  getrusage(RUSAGE_SELF, &use);
  processor = use.ru_utime.tv_sec + use.ru_stime.tv_sec + 1e-6 * (use.ru_utime.tv_usec + use.ru_stime.tv_usec);
  set_up    = PetscMax(set_up, processor); /* what it is above the phases is the program's start */

  PetscCall(MakeRoom(c->comm, sizeof(directory), directory));
  PetscCall(AppRunOptions(c, options, plan, &loop));
  PetscCall(PetscTime(&now));
  loop.quiet   = PETSC_TRUE;
  loop.stop_at = now + SECONDS_ENOUGH;
  loop.stamp = loop.scene = "";
  PetscCall(OutputCreate(c->comm, directory, PETSC_FALSE, &output));
  PetscCall(AppFieldNames(c, output));
  code = RunLoop(c->comm, &c->stepper, &loop, output, &run);
  PetscCall(OutputDestroy(&output));
  c->clock.n = 0;
  if (!code && !options->no_plots) PetscCall(AppPlots(c, directory, PETSC_TRUE, &end));

  if (!c->rank) nftw(directory, Remove, 16, FTW_DEPTH | FTW_PHYS);
  PetscCall(code);

  const PetscReal steps = PetscMax(1, PetscCeilReal(loop.end / run.dt * (1 - 1e-12))), here = PetscMax(1, run.steps_here);

  per_step = here > 1 ? (run.seconds_step - run.seconds_first) / (here - 1) : run.seconds_step;
  frame    = run.frames_here ? run.seconds_frames / run.frames_here : 0;
  frames   = Frames(loop.end, loop.frame_every);
  rest     = (run.seconds_output - run.seconds_frames) * steps / here; /* rows, flushed each */
  total    = set_up + run.seconds_first + per_step * (steps - 1) + frame * frames + rest;
  total += run.seconds_checkpoint * (1 + PetscFloorReal(total / CHECKPOINTS_PER));
  for (PetscInt k = 0; k < c->clock.n; k++) total += c->clock.seconds[k];
  if (!c->rank) {
    fprintf(out, "  measured  %.2g s of set-up, %.3g ms a step over %d steps, %.2g s a frame\n", (double)set_up, (double)(1e3 * per_step), (int)run.steps_here, (double)frame);
    fprintf(out, "  takes     about %.3g s for %.0f steps and %.0f frames%s\n", (double)total, (double)steps, (double)frames, c->turning ? "; elements that turn make it longer" : c->governed ? " at pace 1 of the governed load" : plan->rounds > 0 ? "; what breaks comes on top, see above" : "");
  }
  PetscCall(RunSummaryDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}
