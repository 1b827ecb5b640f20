/*
  run.c - the loop.

  Time is t = n dt with a constant dt, n the step; the last step is the first at or after `end`, of load time where the stepper has a clock. Rows, frames and
  checkpoints fall on the first step at or after k x every, a function of n alone: nothing drifts, and a resumed run
  falls on the same steps as an uninterrupted one. What the wall clock decides (progress, checkpoints every 5 minutes,
  Ctrl-C) reads the state and never changes it, nor anything a later checkpoint would hold.

  The final checkpoint is written before the final row and frame when those fall between two scheduled ones. So a run
  resumed with a later end drops them again, and ends in the same files as if it had run there at once.
*/
#include "run.h"
#include "progress.h"
#include "run_changes.h"
#include <petsctime.h>
#include <signal.h>
#include <string.h>

#define CHECK_STEPS      1000   /* at least so often the state is looked at: its balance, and the watch in full */
#define WATCH_STEPS      250    /* and the motion alone; a step 5 % too long grows a disturbance by 10^70 between two such looks, so that it is still finite when it is found */
#define CHECKPOINT_CLOCK 300.   /* wall time between checkpoints when no simulated interval is given [s] */
#define STEP_SLACK       1e-6   /* of a step: an instant this little before a step is that step, so round-off adds none */
#define POLL_SECONDS     0.05   /* ranks agree on the clock and Ctrl-C about so often */
#define START_STEPS      10     /* until then what the energy of step 0 leaves out, dt^2/8 f.f/m of (1.5), is taken off the error: 1/(4 n^2) of the work, as in a fall from rest */
#define GROWTH_BOUND     100.   /* stored energy over all ever put in: stable central differences stay below 1/(1 - safety^2) */

typedef struct {
  MPI_Comm          comm;
  PetscMPIInt       rank, size;
  const Stepper    *stepper;
  const RunOptions *options;
  Output            output;
  RunSummary       *sum;
  Progress          progress;
  PetscInt          n, last;          /* step, last step */
  PetscInt          watched;          /* step of the model's last look at itself, */
  RunWatch          watched_well;     /* and how well it looked */
  PetscBool         resumed;          /* the state at n came from a checkpoint: its outputs are written */
  PetscReal         initial, work_in; /* kept for every ledger [J] */
  PetscReal         unbalanced;       /* latest; -1 when the model has none */
  PetscInt          checkpoint_step;  /* of the last good one, -1 before any */
  char              checkpoint[BASE_LINE];
  char             *columns, *changes; /* names of the history's columns, each with its newline; what a resumed run does otherwise */
  PetscLogDouble    checkpoint_clock;
  PetscInt          poll_every, next_poll;
  PetscReal        *row; /* [2 + n_history + LEDGER_TERMS + 1] */
} Run;

/* ---- signals: the first asks for a checkpoint, a second SIGINT or SIGTERM kills. mpiexec hands SIGUSR1 on at once. ---- */

static const int             watched[] = {SIGINT, SIGTERM, SIGUSR1};
static volatile sig_atomic_t stop_asked;

#define WATCHED ((int)(sizeof(watched) / sizeof(watched[0])))

static void AskToStop(int number)
{
  stop_asked = 1;
  signal(SIGINT, SIG_DFL);
  signal(SIGTERM, SIG_DFL);
}

static void WatchSignals(struct sigaction old[WATCHED])
{
  struct sigaction watch;

  memset(&watch, 0, sizeof(watch));
  watch.sa_handler = AskToStop;
  watch.sa_flags   = SA_RESTART; /* a write under way goes on */
  stop_asked       = 0;
  for (int k = 0; k < WATCHED; k++) sigaction(watched[k], &watch, &old[k]);
}

static void UnwatchSignals(const struct sigaction old[WATCHED])
{
  for (int k = 0; k < WATCHED; k++) sigaction(watched[k], &old[k], NULL);
}

/* ---- the schedule ---- */

/* First step at or after k x every. */
static PetscReal StepOf(PetscReal k, PetscReal every, PetscReal dt)
{
  return PetscCeilReal(k * (every / dt) - STEP_SLACK);
}

/* Is n the first step at or after some k x every? Step 0 always is; every = 0 is never after that. With a clock, of load time: what lies between this step and the one before. */
static PetscBool IsDue(const TableClock *clock, PetscInt n, PetscReal every, PetscReal dt)
{
  PetscReal k;

  if (n == 0) return PETSC_TRUE;
  if (every <= 0) return PETSC_FALSE;
  if (clock) return (PetscBool)(PetscFloorReal((TableClockTime(clock, n * dt) + STEP_SLACK * dt) / every) > PetscFloorReal((TableClockTime(clock, (n - 1) * dt) + STEP_SLACK * dt) / every));
  if (every <= dt) return PETSC_TRUE;
  k = PetscFloorReal(n * (dt / every)); /* near enough; the neighbours settle it */
  for (PetscReal j = k - 1; j <= k + 1; j++)
    if (j > 0 && StepOf(j, every, dt) == (PetscReal)n) return PETSC_TRUE;
  return PETSC_FALSE;
}

static PetscErrorCode ChooseStep(Run *run)
{
  const RunOptions *o = run->options;
  RunSummary       *s = run->sum;

  PetscFunctionBegin;
  s->stable_dt = PETSC_MAX_REAL;
  if (run->stepper->stable_step) PetscCall(run->stepper->stable_step(run->stepper->ctx, &s->stable_dt));
  PetscCallMPI(MPI_Bcast(&s->stable_dt, 1, MPIU_REAL, 0, run->comm));
  PetscCheck(s->stable_dt > 0, run->comm, PETSC_ERR_FP, "The %s model allows a step of %.6g s; it must be positive", run->stepper->name, (double)s->stable_dt);
  s->dt = o->step > 0 ? o->step : (o->safety > 0 ? o->safety : 0.9) * s->stable_dt;
  BaseCheckInput(s->dt < 0.1 * PETSC_MAX_REAL, run->comm, "The %s model sets no time step of its own; give one (time.step)", run->stepper->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CountSteps(Run *run)
{
  const TableClock *clock = run->stepper->clock;
  const PetscReal   dt = run->sum->dt, now = run->n * dt, left = run->options->end - TableClockTime(clock, now);
  const PetscReal   steps = clock ? run->n + PetscMax(0, PetscCeilReal(left / (dt * TableClockPace(clock, now)) - STEP_SLACK)) : StepOf(1, run->options->end, dt); /* with a clock a guess, made anew as it goes */

  PetscFunctionBegin;
  BaseCheckInput(steps < PETSC_MAX_INT - 1, run->comm, "%.6g s in steps of %.6g s are %.6g steps, more than this build can count (%" PetscInt_FMT ")", (double)run->options->end,
                 (double)run->sum->dt, (double)steps, PETSC_MAX_INT);
  run->last = (PetscInt)steps;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- history ---- */

static PetscErrorCode WriteHeader(Run *run)
{
  const Stepper *s = run->stepper;
  const PetscInt n = s->n_history, all = 3 + n + LEDGER_TERMS;
  const char   **name, **unit;
  char           energy[LEDGER_TERMS][64];

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(all, &name, all, &unit));
  name[0] = "time";
  unit[0] = "s";
  name[1] = "step";
  unit[1] = "-";
  for (PetscInt i = 0; i < n; i++) {
    name[2 + i] = s->history_name[i];
    unit[2 + i] = s->history_unit[i];
  }
  for (int term = 0; term < LEDGER_TERMS; term++) {
    PetscCall(BaseFormat(energy[term], "energy.%s", LedgerNames[term]));
    name[2 + n + term] = energy[term];
    unit[2 + n + term] = "J";
  }
  name[all - 1] = "ledger_error";
  unit[all - 1] = "-";
  PetscCall(OutputHistoryHeader(run->output, all, name, unit));
  PetscCall(PetscFree2(name, unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode NameColumns(Run *run)
{
  const Stepper *s    = run->stepper;
  size_t         size = 1, used = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < s->n_history; i++) size += strlen(s->history_name[i]) + 1;
  PetscCall(PetscMalloc1(size, &run->columns));
  run->columns[0] = 0;
  for (PetscInt i = 0; i < s->n_history; i++) used += (size_t)snprintf(run->columns + used, size - used, "%s\n", s->history_name[i]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteRow(Run *run)
{
  const PetscInt n   = run->stepper->n_history;
  RunSummary    *sum = run->sum;

  PetscFunctionBegin;
  run->row[0] = sum->time;
  run->row[1] = (PetscReal)run->n;
  for (PetscInt i = 0; i < n; i++) PetscCall(run->stepper->history(run->stepper->ctx, i, &run->row[2 + i]));
  PetscCallMPI(MPI_Bcast(run->row + 2, (int)n, MPIU_REAL, 0, run->comm));
  for (PetscInt i = 0; i < n; i++) {
    sum->lowest[i]  = PetscMin(sum->lowest[i], run->row[2 + i]);
    sum->highest[i] = PetscMax(sum->highest[i], run->row[2 + i]);
  }
  for (int term = 0; term < LEDGER_TERMS; term++) run->row[2 + n + term] = sum->ledger.energy[term];
  run->row[2 + n + LEDGER_TERMS] = LedgerError(&sum->ledger);
  PetscCall(OutputHistoryRow(run->output, 3 + n + LEDGER_TERMS, run->row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Write(Run *run, PetscBool row, PetscBool frame)
{
  PetscLogDouble start, middle, end;

  PetscFunctionBegin;
  PetscCall(PetscTime(&start));
  if (row) PetscCall(WriteRow(run));
  PetscCall(PetscTime(&middle));
  if (frame && run->stepper->write) {
    PetscCall(OutputFrameBegin(run->output, run->sum->time, run->n));
    PetscCall(run->stepper->write(run->stepper->ctx, run->output));
    PetscCall(OutputFrameEnd(run->output));
  }
  PetscCall(PetscTime(&end));
  run->sum->seconds_output += end - start;
  if (frame) {
    run->sum->seconds_frames += end - middle;
    run->sum->frames_here++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- is the state sound? ---- */

static void LastGood(const Run *run, char *text, size_t size)
{
  if (run->checkpoint_step < 0) snprintf(text, size, "no checkpoint was written yet");
  else snprintf(text, size, "last good checkpoint: %s (step %lld)", run->checkpoint, (long long)run->checkpoint_step);
}

/* The model's own look at its state. */
static PetscErrorCode Watch(Run *run, RunWatch look)
{
  char fault[BASE_LINE] = "", good[BASE_LINE + 128];

  PetscFunctionBegin;
  if (!run->stepper->watch || (run->watched == run->n && run->watched_well >= look)) PetscFunctionReturn(PETSC_SUCCESS);
  run->watched      = run->n;
  run->watched_well = look;
  PetscCall(run->stepper->watch(run->stepper->ctx, look, fault));
  LastGood(run, good, sizeof(good));
  PetscCheck(!fault[0], run->comm, PETSC_ERR_FP, "At step %" PetscInt_FMT ", t = %.6g s, %s (step of %.6g s, stable step %.6g s); %s", run->n, (double)run->sum->time, fault, (double)run->sum->dt, (double)run->sum->stable_dt, good);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Energies, their balance and the unbalanced ratio of the present state. scheduled: this look happens at the same step
   in every run, so it may leave a trace in the worst error. */
static PetscErrorCode CheckState(Run *run, PetscBool scheduled)
{
  RunSummary      *sum = run->sum;
  const PetscReal *e   = sum->ledger.energy;
  const PetscReal  bound = run->options->ledger_bound > 0 ? run->options->ledger_bound : 0.05;
  PetscReal        given, stored, error;
  PetscInt         bad = -1;
  char             good[BASE_LINE + 128], where[BASE_LINE] = "";

  PetscFunctionBegin;
  memset(&sum->ledger, 0, sizeof(sum->ledger));
  PetscCall(run->stepper->energy(run->stepper->ctx, &sum->ledger));
  PetscCallMPI(MPI_Bcast(&sum->ledger, sizeof(sum->ledger), MPI_BYTE, 0, run->comm)); /* one verdict on all ranks */
  if (run->n == 0) run->initial = e[LEDGER_KINETIC] + e[LEDGER_STRAIN] + e[LEDGER_COUPLING] + e[LEDGER_CONTACT];
  sum->ledger.initial = run->initial;
  sum->ledger.work_in = PetscMax(sum->ledger.work_in, run->work_in);
  run->unbalanced     = -1;
  if (run->stepper->unbalanced) {
    PetscCall(run->stepper->unbalanced(run->stepper->ctx, &run->unbalanced));
    PetscCallMPI(MPI_Bcast(&run->unbalanced, 1, MPIU_REAL, 0, run->comm));
  }

  LastGood(run, good, sizeof(good));
  given  = sum->ledger.work_in + PetscAbsReal(run->initial) + 1e-12 * PetscAbsReal(sum->ledger.scale);
  stored = PetscMax(PetscAbsReal(e[LEDGER_KINETIC]), PetscAbsReal(e[LEDGER_STRAIN]));
  error  = LedgerError(&sum->ledger);
  if (run->n > 0 && run->n < START_STEPS) error -= PetscMin(error, 0.25 / PetscSqr((PetscReal)run->n));
  if (!(error <= bound && stored <= GROWTH_BOUND * given)) { /* the model says where, if it can */
    PetscCall(Watch(run, RUN_WATCH_ALL));
    if (run->stepper->watch) PetscCall(run->stepper->watch(run->stepper->ctx, RUN_WATCH_FASTEST, where));
  }
  for (PetscInt term = LEDGER_TERMS - 1; term >= 0; term--)
    if (PetscIsInfOrNanReal(e[term])) bad = term;
  PetscCheck(bad < 0, run->comm, PETSC_ERR_FP, "The %s energy is %.6g at step %" PetscInt_FMT ", t = %.6g s: the state is lost (step of %.6g s, stable step %.6g s); %s", LedgerNames[bad],
             (double)e[bad], run->n, (double)sum->time, (double)sum->dt, (double)sum->stable_dt, good);
  PetscCheck(!PetscIsInfOrNanReal(run->unbalanced) && !PetscIsInfOrNanReal(sum->ledger.work_in), run->comm, PETSC_ERR_FP,
             "The %s is not finite at step %" PetscInt_FMT ", t = %.6g s: the state is lost; %s", PetscIsInfOrNanReal(run->unbalanced) ? "unbalanced force" : "external work", run->n,
             (double)sum->time, good);

  PetscCheck(error <= bound && stored <= GROWTH_BOUND * given, run->comm, PETSC_ERR_NOT_CONVERGED,
             "Energy balance lost at step %" PetscInt_FMT ", t = %.6g s: ledger error %.3g, bound %.6g; kinetic %.6g J, strain %.6g J, put in %.6g J%s%s (step of %.6g s, stable step %.6g s); %s", run->n,
             (double)sum->time, (double)error, (double)bound, (double)e[LEDGER_KINETIC], (double)e[LEDGER_STRAIN], (double)given, where[0] ? "; " : "", where, (double)sum->dt, (double)sum->stable_dt, good);
  if (scheduled) {
    run->work_in            = sum->ledger.work_in;
    sum->worst_ledger_error = PetscMax(sum->worst_ledger_error, error);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- checkpoints ---- */

static PetscErrorCode SaveAll(Run *run, Checkpoint c)
{
  const RunSummary *s       = run->sum;
  const PetscReal   kept[5] = {s->dt, s->stable_dt, run->initial, run->work_in, s->worst_ledger_error};

  PetscFunctionBegin;
  PetscCall(CheckpointWriteString(c, "run/stamp", run->options->stamp ? run->options->stamp : ""));
  PetscCall(CheckpointWriteString(c, "run/scene", run->options->scene ? run->options->scene : ""));
  PetscCall(CheckpointWriteString(c, "run/changes", run->changes ? run->changes : ""));
  PetscCall(CheckpointWriteString(c, "run/columns", run->columns));
  PetscCall(CheckpointWriteString(c, "run/model", run->stepper->name));
  PetscCall(CheckpointWriteInt(c, "run/step", 1, &run->n));
  PetscCall(CheckpointWriteReal(c, "run/time", 1, &s->time));
  PetscCall(CheckpointWriteReal(c, "run/kept", 5, kept));
  PetscCall(CheckpointWriteReal(c, "run/lowest", s->n_history, s->lowest));
  PetscCall(CheckpointWriteReal(c, "run/highest", s->n_history, s->highest));
  PetscCall(run->stepper->save(run->stepper->ctx, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of a state that CheckState() found sound. */
static PetscErrorCode Save(Run *run)
{
  Checkpoint     c;
  PetscLogDouble start, end;
  PetscErrorCode code;

  PetscFunctionBegin;
  if (!run->stepper->save || run->checkpoint_step == run->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscTime(&start));
  PetscCall(CheckpointCreate(run->comm, run->checkpoint, &c));
  code = SaveAll(run, c);
  if (code) (void)CheckpointAbandon(&c);
  PetscCall(code);
  PetscCall(CheckpointClose(&c));
  run->checkpoint_step = run->n;
  PetscCall(PetscTime(&end));
  run->checkpoint_clock = end;
  run->sum->seconds_checkpoint += end - start;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Highest and lowest so far, by the names of the columns: a resumed run may ask for others. */
static PetscErrorCode LoadExtremes(Run *run, Checkpoint c)
{
  const Stepper *st = run->stepper;
  PetscReal     *low, *high;
  char          *names;
  PetscInt       n = 0;

  PetscFunctionBegin;
  PetscCall(CheckpointReadText(c, "run/columns", &names));
  for (const char *s = names; *s; s++) n += *s == '\n';
  PetscCall(PetscMalloc2(n, &low, n, &high));
  PetscCall(CheckpointReadReal(c, "run/lowest", n, low));
  PetscCall(CheckpointReadReal(c, "run/highest", n, high));
  for (PetscInt i = 0; i < st->n_history; i++) {
    const size_t length = strlen(st->history_name[i]);
    const char  *s      = names;

    for (PetscInt k = 0; k < n; k++, s += strcspn(s, "\n") + 1) {
      if (strcspn(s, "\n") != length || strncmp(s, st->history_name[i], length)) continue;
      run->sum->lowest[i]  = low[k];
      run->sum->highest[i] = high[k];
    }
  }
  PetscCall(PetscFree2(low, high));
  PetscCall(PetscFree(names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What this run does otherwise than the one that wrote the checkpoint, below what was changed before. */
static PetscErrorCode ListChanges(Run *run, Checkpoint c)
{
  char  *earlier, *saved, *list;
  size_t size;

  PetscFunctionBegin;
  PetscCall(CheckpointReadText(c, "run/changes", &earlier));
  PetscCall(CheckpointReadText(c, "run/scene", &saved));
  PetscCall(RunChangesList(saved, run->options->scene ? run->options->scene : "", &list));
  size = strlen(earlier) + strlen(list) + 128;
  PetscCall(PetscMalloc1(size, &run->changes));
  snprintf(run->changes, size, "%s", earlier);
  if (list[0]) snprintf(run->changes + strlen(earlier), size - strlen(earlier), "changed from step %lld, t = %.9g s on:\n%s", (long long)run->n, (double)(run->n * run->sum->dt), list);
  PetscCall(PetscFree(earlier));
  PetscCall(PetscFree(saved));
  PetscCall(PetscFree(list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadAll(Run *run, Checkpoint c)
{
  RunSummary *s = run->sum;
  PetscReal   kept[5];
  char       *text;

  PetscFunctionBegin;
  PetscCall(CheckpointReadText(c, "run/stamp", &text));
  PetscCall(RunStampCheck(run->comm, run->checkpoint, text, run->options->stamp ? run->options->stamp : "", run->options->new_loads));
  PetscCall(PetscFree(text));
  PetscCall(CheckpointReadText(c, "run/model", &text));
  BaseCheckInput(!strcmp(text, run->stepper->name), run->comm, "The checkpoint '%s' holds a %s model, this run is a %s one", run->checkpoint, text, run->stepper->name);
  PetscCall(PetscFree(text));
  PetscCall(CheckpointReadInt(c, "run/step", 1, &run->n));
  PetscCall(CheckpointReadReal(c, "run/kept", 5, kept));
  PetscCall(LoadExtremes(run, c));
  PetscCall(run->stepper->load(run->stepper->ctx, c));
  s->dt                 = kept[0];
  s->stable_dt          = kept[1];
  run->initial          = kept[2];
  run->work_in          = kept[3];
  s->worst_ledger_error = kept[4];
  BaseCheckInput(run->n >= 0 && s->dt > 0, run->comm, "The checkpoint '%s' is damaged: step %" PetscInt_FMT ", time step %.6g s", run->checkpoint, run->n, (double)s->dt);
  BaseCheckInput(!(run->options->step > 0) || PetscAbsReal(run->options->step - s->dt) <= 1e-12 * s->dt, run->comm,
                 "The checkpoint '%s' was made with a step of %.6g s, not %.6g s; the step stays the same from start to end", run->checkpoint, (double)s->dt, (double)run->options->step);
  PetscCall(ListChanges(run, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Load(Run *run)
{
  Checkpoint     c;
  PetscErrorCode code;

  PetscFunctionBegin;
  BaseCheckInput(run->stepper->load, run->comm, "The %s model cannot go on from a checkpoint; run without resuming", run->stepper->name);
  PetscCall(CheckpointOpen(run->comm, run->checkpoint, &c));
  code = LoadAll(run, c);
  (void)CheckpointAbandon(&c);
  PetscCall(code);
  run->resumed         = PETSC_TRUE;
  run->checkpoint_step = run->n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Drop what an interrupted run wrote after the checkpoint, and a final row or frame that this run would not write. */
static PetscErrorCode DropLater(Run *run)
{
  const PetscReal dt = run->sum->dt, here = run->n * dt, before = (run->n - 1) * dt;

  PetscFunctionBegin;
  PetscCall(OutputTruncateHistory(run->output, IsDue(run->stepper->clock, run->n, run->options->history_every, dt) ? here : before));
  PetscCall(OutputTruncateFrames(run->output, IsDue(run->stepper->clock, run->n, run->options->frame_every, dt) ? here : before));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- the clock and Ctrl-C, agreed by all ranks ---- */

typedef enum { POLL_STOP, POLL_PROGRESS, POLL_CHECKPOINT, POLL_EVERY, POLL_ITEMS } PollItem;

static PetscErrorCode Poll(Run *run, PetscInt here, PetscBool asked[POLL_ITEMS])
{
  const PetscReal clock = run->options->checkpoint_clock > 0 ? run->options->checkpoint_clock : CHECKPOINT_CLOCK;
  PetscLogDouble  now;
  int             mine[POLL_ITEMS] = {0}, all[POLL_ITEMS];

  PetscFunctionBegin;
  memset(asked, 0, sizeof(PetscBool) * POLL_ITEMS);
  if (run->n < run->next_poll) PetscFunctionReturn(PETSC_SUCCESS);
  mine[POLL_STOP] = stop_asked != 0;
  if (run->rank == 0) {
    PetscCall(PetscTime(&now));
    if (run->options->stop_at > 0 && now >= run->options->stop_at) mine[POLL_STOP] = 1;
    mine[POLL_PROGRESS]   = ProgressDue(&run->progress, now);
    mine[POLL_CHECKPOINT] = run->options->checkpoint_every <= 0 && now - run->checkpoint_clock >= clock;
    mine[POLL_EVERY]      = (int)PetscMin(1000., 1. + POLL_SECONDS * here / PetscMax(now - run->progress.started, 1e-9));
  }
  if (run->size > 1) PetscCallMPI(MPI_Allreduce(mine, all, POLL_ITEMS, MPI_INT, MPI_MAX, run->comm));
  else memcpy(all, mine, sizeof(all));
  for (int k = 0; k < POLL_ITEMS; k++) asked[k] = (PetscBool)(all[k] != 0);
  run->next_poll = run->n + (run->size > 1 ? all[POLL_EVERY] : 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Show(Run *run)
{
  const RunSummary   *s     = run->sum;
  const ProgressState state = {.step = run->n, .steps = run->last, .time = s->time, .elements = run->stepper->elements, .unbalanced = run->unbalanced, .ledger = s->ledger};
  PetscLogDouble      now;

  PetscTime(&now);
  if (run->stepper->clock) (void)CountSteps(run);
  if (run->rank == 0 && run->progress.on) ProgressShow(&run->progress, &state, now);
}

/* ---- the loop ---- */

/* What falls due at step n: look at the state, then row, frame, checkpoint. ends: the run finishes here. */
static PetscErrorCode Deliver(Run *run, PetscBool *ends)
{
  const RunOptions *o     = run->options;
  RunSummary       *sum   = run->sum;
  const PetscReal   dt    = sum->dt;
  const PetscBool   row   = IsDue(run->stepper->clock, run->n, o->history_every, dt), frame = IsDue(run->stepper->clock, run->n, o->frame_every, dt);
  const PetscBool   save  = (PetscBool)(o->checkpoint_every > 0 && run->n > 0 && IsDue(run->stepper->clock, run->n, o->checkpoint_every, dt));
  const PetscBool   last  = (PetscBool)(run->stepper->clock ? TableClockTime(run->stepper->clock, run->n * dt) >= o->end - STEP_SLACK * dt : run->n >= run->last);
  PetscBool         quiet = PETSC_FALSE;

  PetscFunctionBegin;
  *ends = PETSC_FALSE;
  if (run->n % WATCH_STEPS == 0) PetscCall(Watch(run, run->n % CHECK_STEPS ? RUN_WATCH_MOTION : RUN_WATCH_ALL));
  if (!row && !frame && !save && !last && run->n % CHECK_STEPS) PetscFunctionReturn(PETSC_SUCCESS);
  if (save || last) PetscCall(Watch(run, RUN_WATCH_ALL)); /* what is kept has been looked at */
  PetscCall(CheckState(run, PETSC_TRUE));
  quiet = (PetscBool)(o->unbalanced_stop > 0 && run->n > 0 && run->unbalanced >= 0 && run->unbalanced < o->unbalanced_stop);
  *ends = (PetscBool)(last || quiet);
  if (!run->resumed) PetscCall(Write(run, row, frame));
  if (save || *ends) PetscCall(Save(run));
  if (*ends) {
    PetscCall(Write(run, (PetscBool)!row, (PetscBool)!frame));
    sum->end = last ? RUN_DONE : RUN_QUIET_STATE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One step; a model that fails has said why, the loop adds where and what is left. */
static PetscErrorCode Advance(Run *run)
{
  const PetscBool first = (PetscBool)(run->sum->steps_here == 0);
  PetscLogDouble  start = 0, end = 0;
  PetscErrorCode  code;

  PetscFunctionBegin;
  if (first) PetscCall(PetscTime(&start));
  code = run->stepper->step(run->stepper->ctx, run->n * run->sum->dt, run->sum->dt);
  if (code) {
    char good[BASE_LINE + 128];

    LastGood(run, good, sizeof(good));
    if (!run->options->quiet && run->rank == 0) fprintf(stderr, "cleave: stopped in step %lld, t = %.6g s; %s\n", (long long)run->n + 1, (double)run->sum->time, good);
  }
  PetscCall(code);
  if (first) PetscCall(PetscTime(&end));
  run->sum->seconds_first += end - start;
  run->n++;
  run->resumed    = PETSC_FALSE;
  run->sum->steps = run->n;
  run->sum->steps_here++;
  run->sum->time = run->n * run->sum->dt;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Loop(Run *run)
{
  const PetscInt most = run->options->max_steps;
  RunSummary    *sum  = run->sum;

  PetscFunctionBegin;
  for (;;) {
    PetscBool ends, asked[POLL_ITEMS];

    PetscCall(Deliver(run, &ends));
    if (ends) break;
    PetscCall(Poll(run, sum->steps_here, asked));
    if (most > 0 && sum->steps_here >= most) asked[POLL_STOP] = PETSC_TRUE;
    if (asked[POLL_STOP] || asked[POLL_PROGRESS] || asked[POLL_CHECKPOINT]) PetscCall(CheckState(run, PETSC_FALSE));
    if (asked[POLL_PROGRESS]) Show(run);
    if (asked[POLL_STOP] || asked[POLL_CHECKPOINT]) PetscCall(Save(run));
    if (asked[POLL_STOP]) {
      sum->end = RUN_INTERRUPTED;
      break;
    }
    PetscCall(Advance(run));
  }
  if (sum->steps_here > 0) Show(run);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Start(Run *run)
{
  PetscFunctionBegin;
  run->checkpoint_step = run->watched = -1;
  PetscCall(BaseFormat(run->checkpoint, "%s/checkpoint.h5", OutputDirectory(run->output)));
  if (run->options->resume) {
    PetscCall(Load(run));
    PetscCall(DropLater(run));
    if (run->options->goes_on) PetscCall(run->options->goes_on(run->options->goes_on_to, run->changes));
  } else PetscCall(ChooseStep(run));
  PetscCall(CountSteps(run));
  run->sum->steps = run->n;
  run->sum->time  = run->n * run->sum->dt;
  PetscCall(WriteHeader(run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RunLoop(MPI_Comm comm, const Stepper *stepper, const RunOptions *options, Output output, RunSummary *summary)
{
  Run              run = {.comm = comm, .stepper = stepper, .options = options, .output = output, .sum = summary};
  struct sigaction old[WATCHED];
  PetscLogDouble   start, end;
  PetscErrorCode   code;

  PetscFunctionBegin;
  BaseCheckInput(options->end > 0 && !PetscIsInfOrNanReal(options->end), comm, "The end of the run, %.6g s, must be positive (time.end)", (double)options->end);
  BaseCheckInput(options->step >= 0 && options->history_every >= 0 && options->frame_every >= 0 && options->checkpoint_every >= 0, comm,
                 "A time step or an interval of output is negative; it must be positive, or 0 for the default");
  memset(summary, 0, sizeof(*summary));
  PetscCallMPI(MPI_Comm_rank(comm, &run.rank));
  PetscCallMPI(MPI_Comm_size(comm, &run.size));
  summary->n_history = stepper->n_history;
  PetscCall(PetscMalloc2(stepper->n_history, &summary->lowest, stepper->n_history, &summary->highest));
  for (PetscInt i = 0; i < stepper->n_history; i++) {
    summary->lowest[i]  = PETSC_MAX_REAL;
    summary->highest[i] = PETSC_MIN_REAL;
  }
  PetscCall(PetscMalloc1(3 + stepper->n_history + LEDGER_TERMS, &run.row));
  PetscCall(NameColumns(&run));
  WatchSignals(old);
  code = Start(&run);
  PetscCall(PetscTime(&start));
  run.checkpoint_clock = start;
  run.next_poll        = run.n;
  ProgressBegin(&run.progress, (PetscBool)!options->quiet, run.n);
  if (!code) code = Loop(&run);
  PetscCall(PetscTime(&end));
  ProgressEnd(&run.progress);
  UnwatchSignals(old);
  summary->seconds_step = (end - start) - summary->seconds_output - summary->seconds_checkpoint;
  PetscCall(PetscFree(run.row));
  PetscCall(PetscFree(run.columns));
  PetscCall(PetscFree(run.changes));
  PetscCall(code);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RunSummaryDestroy(RunSummary *summary)
{
  PetscFunctionBegin;
  PetscCall(PetscFree2(summary->lowest, summary->highest));
  PetscFunctionReturn(PETSC_SUCCESS);
}
