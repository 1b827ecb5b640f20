/*
  run.h - the loop that advances a model: steps, history, frames, checkpoints, progress, Ctrl-C.

  A model gives a Stepper; the loop knows nothing else of it.
*/
#pragma once
#include "base.h"
#include "checkpoint.h"
#include "ledger.h"
#include "output.h"
#include "table.h"

typedef enum { RUN_WATCH_MOTION, RUN_WATCH_ALL, RUN_WATCH_FASTEST } RunWatch; /* all: also what costs more than a look at the motion */

/* Every function may be called on all ranks together. ctx is the model, borrowed. */
typedef struct {
  const char *name; /* "fem", "dem", "coupled": heads the summary and the checkpoint's groups */
  void       *ctx;
  PetscErrorCode (*stable_step)(void *ctx, PetscReal *dt);               /* largest step the model allows [s]; PETSC_MAX_REAL when any will do */
  PetscErrorCode (*step)(void *ctx, PetscReal t, PetscReal dt);          /* advance the state from t to t + dt */
  PetscErrorCode (*energy)(void *ctx, Ledger *ledger);                   /* of the present state */
  /* What is wrong with the state (what, which, where), "" when it is sound; RUN_WATCH_FASTEST: which moves fastest and where. NULL: nothing to say. */
  PetscErrorCode (*watch)(void *ctx, RunWatch look, char fault[BASE_LINE]);
  PetscErrorCode (*history)(void *ctx, PetscInt i, PetscReal *value);    /* i-th asked quantity; see n_history */
  PetscErrorCode (*write)(void *ctx, Output output);                     /* blocks of the present frame */
  PetscErrorCode (*save)(void *ctx, Checkpoint checkpoint);
  PetscErrorCode (*load)(void *ctx, Checkpoint checkpoint);
  PetscErrorCode (*unbalanced)(void *ctx, PetscReal *ratio);             /* mean |out-of-balance force| / mean |force|; NULL when it has none */
  PetscInt    n_history;
  const char *const *history_name; /* [n_history] */
  const char *const *history_unit; /* [n_history] */
  PetscReal   elements;            /* elements + bonds advanced a step, for the rate shown */
  const TableClock *clock;         /* load time, that ends and intervals are counted in (run_govern.h); NULL: time itself */
} Stepper;

typedef struct {
  PetscReal   end;              /* [s]; this and the intervals below of load time, where the stepper has a clock */
  PetscReal   step;             /* given step [s]; 0 = safety x stable step */
  PetscReal   safety;           /* default 0.9 */
  PetscReal   history_every;    /* [s]; 0 = only first and last */
  PetscReal   frame_every;      /* [s]; 0 = only first and last */
  PetscReal   checkpoint_every; /* [s] of simulated time; 0 = by wall clock, every 5 minutes */
  PetscReal   checkpoint_clock; /* wall time between those [s]; 0 = 300 */
  PetscReal   ledger_bound;     /* stop with exit 1 above this ledger error; default 0.05 */
  PetscReal   unbalanced_stop;  /* stop when the ratio falls below; 0 = never */
  PetscInt    max_steps;        /* stop as if interrupted, with a checkpoint, after so many steps of this call; 0 = none */
  PetscLogDouble stop_at;       /* stop as if interrupted when PetscTime() reaches this; 0 = never */
  PetscBool   resume;
  PetscBool   new_loads;        /* resume: lines of the stamp that begin with '~' may differ */
  PetscBool   quiet;
  const char *stamp;            /* text that tells one scene from another; a checkpoint with another is refused */
  const char *scene;            /* lines "path: value": what a resumed run does otherwise is listed; NULL = nothing to list */
  PetscErrorCode (*goes_on)(void *ctx, const char *changes); /* resume: called once the checkpoint is loaded, with all changes since the first start, "" when there are none; may be NULL */
  void       *goes_on_to;       /* its ctx */
} RunOptions;

typedef enum { RUN_DONE, RUN_INTERRUPTED, RUN_QUIET_STATE } RunEnd;

typedef struct {
  RunEnd    end;
  PetscInt  steps, steps_here; /* in all, in this call */
  PetscReal time, dt, stable_dt;
  PetscReal seconds_step, seconds_output, seconds_checkpoint; /* wall time by phase */
  PetscReal seconds_first, seconds_frames;                    /* of the first step here, of the frames: parts of the above */
  PetscInt  frames_here;
  Ledger    ledger;
  PetscReal worst_ledger_error;
  PetscInt  n_history;
  PetscReal *lowest, *highest; /* [n_history] extremes; freed by RunSummaryDestroy */
} RunSummary;

/*
  RunLoop - advance until end, Ctrl-C (SIGINT, SIGTERM; SIGUSR1 means the same), failure or max_steps

  The history gets time[s], step[-], the stepper's quantities, energy.*[J] and ledger_error[-]; the checkpoint is DIR/checkpoint.h5.
  resume goes on from it: everything it finds there must be this scene's (PETSC_ERR_USER_INPUT otherwise). Call after OutputCreate() with
  the same resume. The summary holds what was done also when an error is returned; destroy it in any case.

  A state with NaN, or a ledger error over the bound, is PETSC_ERR_FP or PETSC_ERR_NOT_CONVERGED with the step, the time and the last good
  checkpoint in the message; no frame of a bad state is written. The step stays constant from start to end, also across a resume.
*/
PetscErrorCode RunLoop(MPI_Comm comm, const Stepper *stepper, const RunOptions *options, Output output, RunSummary *summary);
PetscErrorCode RunSummaryDestroy(RunSummary *summary);
