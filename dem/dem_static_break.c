/*
  dem_static_break.c - a load step of bonds that may break, without inertia.  Eqs (4.83)-(4.87)

  From one state that is kept to the next along a straight line: the secant stiffness (damage held) says where the body would go under the load of the step's end, or
  under what is out of balance. Curves are cut into teeth: a facet waits until it carries a little more than its curve, then falls a little below. The load grows to where
  the first tooth is due; whatever is furthest beyond its curve is cut; then the load waits until the body is in balance and no tooth is due. So one crack among many
  that could grow does, the others unload, as it is when inertia chooses. Where no equilibrium is near (snap-back), teeth are cut under supports that stand still until one
  is found, and what the forces out of balance do meanwhile is what waves would carry away. D only grows, so this comes to an end.
*/
#include "dem_static_impl.h"

#define BREAK_RESIDUAL 1e-5 /* of the largest out-of-balance a load step began with; what is left is carried on, not dropped */
#define BREAK_TURN     0.9  /* of how far the first in turn is beyond its curve: whatever is less waits */
#define BREAK_AIM      0.005 /* strengths: the load goes at most so far beyond where the first tooth is due */
#define BREAK_BACK     0.1 /* of the force along the line at its start: more than so much beyond its end, back (pieces that meet) */
#define BREAK_BENT     0.02 /* of the same: where pieces met on the way the works are summed in BREAK_PIECES */
#define BREAK_CARE     1e-5 /* of the work done so far: less is not worth it */
#define BREAK_PIECES   32
#define BREAK_TRIALS   20   /* along one line */
#define BREAK_ROUNDS   500  /* under one load with nothing breaking */
#define BREAK_ITERATIONS 300 /* of a solve */
#define BREAK_SOLVE    1e-4 /* of a solve's start */

typedef struct {
  PetscReal from, to;     /* of the line's ends [s] */
  PetscReal now, part;    /* of the kept state: time [s], part of the line behind it */
  PetscReal margin;       /* of the latest trial: of the facet nearest to its tooth, > 0 when one is due [strengths] */
  PetscReal pull;         /* of the latest trial: force along the line [J] */
} Line;

static PetscReal Along(DemModel model, const PetscReal *f, const PetscReal *x)
{
  PetscReal sum = 0;

  for (PetscInt i = 0; i < DemStaticUnknowns(model); i++) sum += f[i] * x[i];
  return sum;
}

/* Forces of the state at part `part` of the line; directions and onsets looked at anew. */
static PetscErrorCode GoTo(DemModel model, const Line *line, PetscReal part, const PetscReal *x)
{
  PetscFunctionBegin;
  DemFacesSetTime_Internal(model, line->from + part * (line->to - line->from));
  DemStaticMoveTo_Internal(model, part, x);
  PetscCall(DemForces_Internal(model, DEM_WITH_LOADS));
  PetscCall(DemCracksLook_Internal(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What would break there; nothing is kept. */
static PetscErrorCode Try(DemModel model, Line *line, PetscReal part, const PetscReal *x)
{
  DemCrackState *crack = &model->crack;

  PetscFunctionBegin;
  PetscCall(GoTo(model, line, part, x));
  (void)DemStaticForces_Internal(model, model->statics->f);
  line->pull = Along(model, model->statics->f, x);
  for (PetscInt k = 0; k < model->bonds.n; k++) {
    crack->margin[k] = -1;
    crack->beyond[k] = 0;
  }
  PetscCall(DemForces_Internal(model, DEM_WITH_LOADS | DEM_TRY_FAILURE));
  line->margin = -1;
  for (PetscInt k = 0; k < model->bonds.n; k++) line->margin = PetscMax(line->margin, crack->margin[k]);
  if (crack->limit)
    for (PetscInt k = 0; k < model->bonds.n; k++)
      if (crack->limit[k] < 0) crack->limit[k] = 0; /* an onset only if we stay */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How far along the line: under a load that grows to where the first tooth is due, otherwise to its end; nearer where pieces meet.  Eq. (4.85) */
static PetscErrorCode Search(DemModel model, Line *line, PetscReal most, PetscReal pull, const PetscReal *x, PetscReal *part)
{
  const PetscBool grows = (PetscBool)(line->to > line->from);
  PetscReal       low = 0, high = most, at = most, below = line->margin, above = 1;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < BREAK_TRIALS; k++) {
    PetscReal step;

    PetscCall(Try(model, line, at, x));
    if (line->pull < -BREAK_BACK * pull) {
      high  = at;
      above = 1;
    } else if (grows && line->margin > BREAK_AIM) {
      high  = at;
      above = line->margin;
    } else {
      if (at == most || (grows && line->margin > 0) || high - low < 0.01 * low) break;
      low   = at;
      below = line->margin;
    }
    step = grows && above < 1 && k % 3 < 2 ? (0.5 * BREAK_AIM - below) / (above - below) : 0.5; /* where a straight line would have it; by halves now and then, for it is none */
    at   = low + (high - low) * PetscMin(0.98, PetscMax(0.02, step));
  }
  *part = at;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whose turn it is: of the facets whose tooth is due those that are furthest beyond their curve; the others wait. */
static void Choose(DemModel model)
{
  DemCrackState *crack = &model->crack;
  PetscReal      most  = 0;

  for (PetscInt k = 0; k < model->bonds.n; k++) most = PetscMax(most, crack->beyond[k]);
  for (PetscInt k = 0; k < model->bonds.n; k++) crack->due[k] = crack->beyond[k] > 0 && crack->beyond[k] >= 1 + BREAK_TURN * (most - 1);
}

/* Stay at part `part` of the line: damage, work and what the forces out of balance did.  Eqs (4.86), (4.87) */
static PetscErrorCode Keep(DemModel model, Line *line, PetscReal part, PetscBool cuts, const PetscReal *x, PetscReal *size)
{
  DemStatic s = model->statics;

  PetscFunctionBegin;
  DemFacesSetTime_Internal(model, line->now);
  PetscCall(DemModelAdvance(model, line->now, 0)); /* at rest nothing drifts: supports and loads are noted */
  model->time = part == 1 ? line->to : line->from + part * (line->to - line->from);
  PetscCall(GoTo(model, line, part, x));
  model->crack.steps = 1; /* looked at just now */
  if (cuts) Choose(model);
  else PetscCall(PetscArrayzero(model->crack.due, model->bonds.n));
  PetscCall(PetscArrayzero(model->crack.excess, model->blocks.n_blocks));
  PetscCall(DemForces_Internal(model, DEM_WITH_LOADS | DEM_WITH_FAILURE));
  PetscCall(DemForces_Internal(model, DEM_WITH_LOADS)); /* with the volumes of what is broken now */
  PetscCall(DemBook_Internal(model));
  *size = DemStaticForces_Internal(model, s->f);
  model->damped += 0.5 * (part - line->part) * (Along(model, s->held, x) + Along(model, s->f, x));
  for (PetscInt b = 0; b < model->blocks.n_blocks; b++) model->damped += model->crack.excess[b];
  PetscCall(PetscArraycpy(s->held, s->f, DemStaticUnknowns(model)));
  line->now  = model->time;
  line->part = part;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemStaticBreak_Internal(DemModel model, PetscReal t, PetscReal dt)
{
  DemStatic s      = model->statics;
  Line      line   = {.now = t, .margin = -1};
  PetscReal size;
  PetscInt  rounds = 0;

  PetscFunctionBegin;
  DemFacesSetTime_Internal(model, t);
  PetscCall(DemForces_Internal(model, DEM_WITH_LOADS));
  if (!model->started) { /* what the first work starts from */
    DemFacesReactions_Internal(model);
    (void)DemTractionWork_Internal(model, NULL, model->traction_new);
    model->started = PETSC_TRUE;
  }
  size = DemStaticForces_Internal(model, s->held);
  PetscCall(PetscArraycpy(s->f, s->held, DemStaticUnknowns(model)));
  for (;;) {
    const PetscBool  rests = (PetscBool)(size <= BREAK_RESIDUAL * s->reference && line.margin <= 0);
    const PetscReal *x;
    PetscReal        part = 0, pull;
    PetscInt         pieces;

    if (rests && line.now == t + dt) break;
    line.from = line.now;
    line.to   = rests ? t + dt : line.now;
    line.part = 0;
    if (rests) {
      rounds = 0;
      DemFacesSetTime_Internal(model, line.to);
      PetscCall(DemForces_Internal(model, DEM_WITH_LOADS));
      size = DemStaticForces_Internal(model, s->f);
    }
    s->reference = PetscMax(s->reference, size);
    PetscCheck(!PetscIsInfOrNanReal(size), model->comm, PETSC_ERR_FP, "Forces are not numbers any more in the load step to t = %.6g s", (double)(t + dt));
    PetscCheck(rounds < BREAK_ROUNDS, model->comm, PETSC_ERR_NOT_CONVERGED, "No equilibrium after %" PetscInt_FMT " rounds at t = %.6g s: out of balance by %.3g of what a load step began with. The supports leave a loaded piece free to move as one, or broken pieces slide and meet; prescribe motions in place of loads, or go on explicitly", rounds,
               (double)line.now, (double)(size / s->reference));
    PetscCall(DemStaticSolve_Internal(model, size > 0 ? PetscMax(1e-8, PetscMin(BREAK_SOLVE, 0.3 * BREAK_RESIDUAL * s->reference / size)) : BREAK_SOLVE, BREAK_ITERATIONS));
    PetscCall(VecGetArrayRead(s->x, &x));
    pull = Along(model, s->f, x);
    PetscCall(Search(model, &line, 1 / DemStaticTooFar_Internal(model, x), pull, x, &part));
    rounds = line.margin > 0 ? 0 : rounds + 1;
    pieces = PetscAbsReal(line.pull - (1 - part) * Along(model, s->held, x)) > PetscMax(BREAK_BENT * pull, BREAK_CARE * model->work_in) ? BREAK_PIECES : 1;
    for (PetscInt k = 1; k <= pieces; k++) PetscCall(Keep(model, &line, k == pieces ? part : part * k / pieces, (PetscBool)(k == pieces), x, &size));
    PetscCall(VecRestoreArrayRead(s->x, &x));
  }
  model->time = t + dt;
  DemFacesSetTime_Internal(model, model->time);
  PetscCall(PetscArrayzero(model->v, 3 * model->n)); /* the forces left over move nothing */
  PetscCall(PetscArrayzero(model->spin, model->nrot * model->n));
  model->dt_last = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
