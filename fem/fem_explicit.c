/*
  fem_explicit.c - central differences with half-step velocities, and their exact energy balance.  Eqs (2.17)-(2.20)

  Known at level n: u_n, v_{n-1/2}, forces. Closing the level gives v_{n+1/2} and the reactions; a step closes the level
  and drifts to u_{n+1}. Energies are those the scheme itself conserves: kinetic 1/2 v_{n-1/2}.M v_{n+1/2}, work as force
  times the mean of the two half steps around the level. With them a linear run balances to round-off at any step.
*/
#include "fem_impl.h"

#define CHUNK 4096 /* dofs summed together; fixed, so sums do not depend on the number of threads */

PetscErrorCode FemExplicitSetUp(FemModel model)
{
  const PetscInt dim = model->dim;
  PetscReal      energy = 0;
  PetscBool      batches;

  PetscFunctionBegin;
  PetscCall(FemBatchesWanted(model, &batches));
  if (batches) PetscCall(FemBatchesCreate(model, PETSC_FALSE));
  else if (model->operator == FEM_ROWS && !model->corotate.on) PetscCall(FemRowsCreate(model));
  else PetscCall(FemElementsCreate(model));
  PetscCall(FemStart(model));
  for (PetscInt k = 0; k < model->n_own * dim; k++) energy += 0.5 * model->mass[k / dim] * model->v[k] * model->v[k];
  energy += FemStrainEnergy(model) + FemPrestressEnergy(model);
  PetscCall(FemSum(model, 1, &energy));
  model->initial = energy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The half steps around a level: [s] before = 0 at the start, where v is the velocity itself. */
typedef struct {
  PetscReal before, after, h, keep, gain, alpha, local;
  PetscBool start;
} Level;

/* Close a level for one dof: the coming velocity.  Eq. (2.17) free, (2.18) prescribed to be at `place`, (2.19) work and damping added to sum [4] */
static inline PetscReal CloseDof(const Level *l, PetscReal m, PetscReal v, PetscReal u, PetscReal applied, PetscReal force, PetscBool held, PetscReal place, PetscReal *reaction, PetscReal *sum)
{
  const PetscReal local = l->local * PetscAbsReal(force) * (v > 0 ? 1 : v < 0 ? -1 : 0); /* eq. (5.3) */
  PetscReal       next = l->keep * v + l->gain * (force - local) / m, drag, pushed = applied, move_before, move_after;

  if (held) next = l->after > 0 ? (place - u) / (2 * l->after) : v;
  drag      = l->alpha * m * (l->start ? v : 0.5 * (v + next)) + (held ? 0 : local);
  *reaction = 0;
  if (held) {
    *reaction = (l->h > 0 ? m * (next - v) / l->h : 0) + drag - force;
    pushed += *reaction;
  }
  move_before = l->before * v;
  move_after  = l->after * (l->start ? 0.5 * (v + next) : next);
  sum[0] += pushed * move_before;
  sum[1] += pushed * move_after;
  sum[2] += drag * move_before;
  sum[3] += drag * move_after;
  return next;
}

/* Dofs [from, to) of nodes without a frame; sum [4] out: work over the half step before and after, damping likewise */
static void CloseLevel(FemModel model, const Level *l, PetscInt from, PetscInt to, const PetscReal *place, PetscReal sum[4])
{
  const PetscReal *outside = FemOutside(model);
  const PetscInt   dim     = model->dim;
  PetscReal        s[4]    = {0, 0, 0, 0};

  for (PetscInt k = from; k < to; k++) {
    const PetscInt fix = model->fixed[k];

    if (model->frame_of && model->frame_of[k / dim] >= 0) continue;
    model->v_next[k] = CloseDof(l, model->mass[k / dim], model->v[k], model->u[k], model->f_app[k], model->f_app[k] + outside[k] - model->f_int[k], fix >= 0 ? PETSC_TRUE : PETSC_FALSE, fix >= 0 ? place[fix] : 0,
                                &model->reaction[k], s);
  }
  for (PetscInt k = 0; k < 4; k++) sum[k] = s[k];
}

/* Nodes with a frame, along its axes; adds to sum [4].  Eq. (2.73) */
static void CloseFrames(FemModel model, const Level *l, const PetscReal *place, PetscReal sum[4])
{
  const PetscReal *outside = FemOutside(model);
  const PetscInt   dim     = model->dim;

  for (PetscInt f = 0; f < model->n_frames_own; f++) {
    const PetscInt k = model->frame_node[f] * dim;
    PetscReal      next[3] = {0, 0, 0}, reaction[3] = {0, 0, 0};

    for (PetscInt i = 0; i < dim; i++) {
      const PetscReal *q = &model->frame[(f * dim + i) * dim];
      const PetscInt   fix = model->frame_fix[f * dim + i];
      PetscReal        v = 0, u = 0, applied = 0, force = 0, r, w;

      for (PetscInt d = 0; d < dim; d++) {
        v += q[d] * model->v[k + d];
        u += q[d] * model->u[k + d];
        applied += q[d] * model->f_app[k + d];
        force += q[d] * (model->f_app[k + d] + outside[k + d] - model->f_int[k + d]);
      }
      w = CloseDof(l, model->mass[k / dim], v, u, applied, force, fix >= 0 ? PETSC_TRUE : PETSC_FALSE, fix >= 0 ? place[fix] : 0, &r, sum);
      for (PetscInt d = 0; d < dim; d++) {
        next[d] += w * q[d];
        reaction[d] += r * q[d];
      }
    }
    for (PetscInt d = 0; d < dim; d++) {
      model->v_next[k + d]   = next[d];
      model->reaction[k + d] = reaction[d];
    }
  }
}

PetscErrorCode FemExplicitLevel(FemModel model, PetscReal dt)
{
  const PetscInt  n = model->n_own * model->dim, chunks = (n + CHUNK - 1) / CHUNK;
  const PetscReal before = model->started ? 0.5 * model->dt_last : 0, h = before + 0.5 * dt, alpha = model->alpha;
  Level           level = {before, 0.5 * dt, h, (1 - 0.5 * alpha * h) / (1 + 0.5 * alpha * h), h / (1 + 0.5 * alpha * h), alpha, model->local, before > 0 ? PETSC_FALSE : PETSC_TRUE};
  PetscReal      *place, (*sum)[4];

  PetscFunctionBegin;
  if (model->level_known && model->level_dt == dt) PetscFunctionReturn(PETSC_SUCCESS);
  if (level.start) {
    level.keep = 1 - alpha * h;
    level.gain = h;
  }
  PetscCall(PetscMalloc2(model->n_fixes, &place, chunks, &sum));
  for (PetscInt k = 0; k < model->n_fixes; k++) place[k] = FemFixPosition(&model->fix[k], model->t + dt);
  if (model->absorb.n) FemAbsorbLevel(model, before, 0.5 * dt, place);
  if (model->contact.outside) FemContactLevel(model, before, 0.5 * dt, level.keep, level.gain, place);
#pragma omp parallel for schedule(static) num_threads(model->threads)
  for (PetscInt c = 0; c < chunks; c++) CloseLevel(model, &level, c * CHUNK, PetscMin(n, (c + 1) * CHUNK), place, sum[c]);
  for (PetscInt j = 0; j < 8; j++) {
    model->level_sum[j] = 0;
    for (PetscInt c = 0; c < chunks && j < 4; c++) model->level_sum[j] += sum[c][j];
  }
  CloseFrames(model, &level, place, model->level_sum);
  if (model->absorb.n) FemAbsorbBook(model, before, 0.5 * dt, model->level_sum);
  if (model->contact.n) FemContactBook(model, before, 0.5 * dt, model->level_sum);
  PetscCall(PetscFree2(place, sum));
  model->level_known = PETSC_TRUE;
  model->level_dt    = dt;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A body that starts under stress starts, for the scheme, with T of (1.5): below 1/2 v.M v where the stress is not in balance.  Eq. (2.81) */
static PetscErrorCode StartStressed(FemModel model, PetscReal dt)
{
  PetscReal less = 0.25 * dt * (FemDot(model, model->pre.force, model->v_next) - FemDot(model, model->pre.force, model->v));

  PetscFunctionBegin;
  PetscCall(FemSum(model, 1, &less));
  model->initial += less;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemExplicitStep(void *ctx, PetscReal t, PetscReal dt)
{
  FemModel       model = ctx;
  const PetscInt n     = model->n_own * model->dim;
  PetscReal      sum[5], *place;

  PetscFunctionBegin;
  if (t != model->t) model->level_known = PETSC_FALSE; /* asking for energies in between must not change a bit */
  model->t = t;
  PetscCall(FemExplicitLevel(model, dt));
  if (!model->started && model->pre.n) PetscCall(StartStressed(model, dt));
  sum[0] = model->level_sum[0] + model->level_sum[1];
  sum[1] = model->level_sum[2] + model->level_sum[3];
  sum[2] = model->level_sum[4] + model->level_sum[5];
  sum[3] = model->level_sum[6] + model->level_sum[7];
  sum[4] = FemContactAdvance(model);
  PetscCall(FemSum(model, model->contact.n_planes ? 5 : 2, sum));
  if (model->contact.n_planes) {
    model->contact.contact += sum[2] - sum[4];
    model->contact.friction += sum[3];
    sum[1] += sum[4];
  }
  model->work += sum[0];
  model->work_in += PetscAbsReal(sum[0]);
  model->damping += sum[1];

  PetscCall(PetscMalloc1(model->n_fixes, &place));
  for (PetscInt k = 0; k < model->n_fixes; k++) place[k] = FemFixPosition(&model->fix[k], t + dt);
#pragma omp parallel for schedule(static) num_threads(model->threads)
  for (PetscInt k = 0; k < n; k++) {
    model->v[k] = model->v_next[k];
    model->u[k] = model->fixed[k] >= 0 ? place[model->fixed[k]] : model->u[k] + dt * model->v[k];
    model->f_ext[k] = 0;
  }
  PetscCall(PetscFree(place));
  model->started     = PETSC_TRUE;
  model->dt_last     = dt;
  model->t           = t + dt;
  model->level_known = PETSC_FALSE;
  PetscCall(FemGhosts(model, model->u));
  PetscCall(FemApply(model, model->u, model->f_int));
  if (model->pre.n) {
    PetscReal heat;

    FemPrestressAdvance(model, t + dt);
    FemAddPrestress(model);
    PetscCall(FemHeatWork(model, &heat));
    model->work += heat;
    model->work_in += PetscAbsReal(heat);
  }
  PetscCall(FemLoadsAt(model, t + dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}
