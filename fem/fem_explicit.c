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

  PetscFunctionBegin;
  if (model->operator == FEM_ROWS) PetscCall(FemRowsCreate(model));
  else PetscCall(FemElementsCreate(model));
  for (PetscInt k = 0; k < model->n_fixes; k++)
    BaseCheckInput(FemFixPosition(&model->fix[k], 0) == 0, model->comm, "Group '%s' stands %g m away from its place at t = 0; an explicit run starts from displacement 0", model->group[model->fix[k].group].name,
                   (double)FemFixPosition(&model->fix[k], 0));
  for (PetscInt k = 0; k < model->n_own * dim; k++) {
    model->v[k] = model->fixed[k] >= 0 ? FemFixVelocity(&model->fix[model->fixed[k]], 0) : model->velocity0[k % dim];
    energy += 0.5 * model->mass[k / dim] * model->v[k] * model->v[k];
  }
  PetscCall(FemSum(model, 1, &energy));
  model->initial = energy;
  PetscCall(FemLoadsAt(model, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Close a level over dofs [from, to).  Eq. (2.17) free, (2.18) prescribed, (2.19) work and damping

  before, after [s]  half of the last and of the coming step; before = 0 at the start, where v is the velocity itself
  sum [4]            out: work over the half step before and after, damping likewise
*/
static void CloseLevel(FemModel model, PetscInt from, PetscInt to, PetscReal before, PetscReal after, const PetscReal *place, PetscReal sum[4])
{
  const PetscInt  dim   = model->dim;
  const PetscReal h     = before + after, alpha = model->alpha;
  const PetscBool start = before > 0 ? PETSC_FALSE : PETSC_TRUE;
  const PetscReal keep = start ? 1 - alpha * h : (1 - 0.5 * alpha * h) / (1 + 0.5 * alpha * h), gain = start ? h : h / (1 + 0.5 * alpha * h);
  PetscReal       s[4] = {0, 0, 0, 0};

  for (PetscInt k = from; k < to; k++) {
    const PetscReal m = model->mass[k / dim], v = model->v[k], force = model->f_app[k] + model->f_ext[k] - model->f_int[k];
    const PetscReal local = model->local * PetscAbsReal(force) * (v > 0 ? 1 : v < 0 ? -1 : 0); /* eq. (5.3) */
    PetscReal       next = keep * v + gain * (force - local) / m, drag, pushed = model->f_app[k], reaction = 0, move_before, move_after;

    if (model->fixed[k] >= 0) next = after > 0 ? (place[model->fixed[k]] - model->u[k]) / (2 * after) : v;
    drag = alpha * m * (start ? v : 0.5 * (v + next)) + (model->fixed[k] < 0 ? local : 0);
    if (model->fixed[k] >= 0) {
      reaction = (h > 0 ? m * (next - v) / h : 0) + drag - force;
      pushed += reaction;
    }
    move_before = before * v;
    move_after  = after * (start ? 0.5 * (v + next) : next);
    s[0] += pushed * move_before;
    s[1] += pushed * move_after;
    s[2] += drag * move_before;
    s[3] += drag * move_after;
    model->v_next[k]   = next;
    model->reaction[k] = reaction;
  }
  for (PetscInt k = 0; k < 4; k++) sum[k] = s[k];
}

PetscErrorCode FemExplicitLevel(FemModel model, PetscReal dt)
{
  const PetscInt  n = model->n_own * model->dim, chunks = (n + CHUNK - 1) / CHUNK;
  const PetscReal before = model->started ? 0.5 * model->dt_last : 0;
  PetscReal      *place, (*sum)[4];

  PetscFunctionBegin;
  if (model->level_known && model->level_dt == dt) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(model->n_fixes, &place, chunks, &sum));
  for (PetscInt k = 0; k < model->n_fixes; k++) place[k] = FemFixPosition(&model->fix[k], model->t + dt);
#pragma omp parallel for schedule(static) num_threads(model->threads)
  for (PetscInt c = 0; c < chunks; c++) CloseLevel(model, c * CHUNK, PetscMin(n, (c + 1) * CHUNK), before, 0.5 * dt, place, sum[c]);
  for (PetscInt j = 0; j < 4; j++) {
    model->level_sum[j] = 0;
    for (PetscInt c = 0; c < chunks; c++) model->level_sum[j] += sum[c][j];
  }
  PetscCall(PetscFree2(place, sum));
  model->level_known = PETSC_TRUE;
  model->level_dt    = dt;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemExplicitStep(void *ctx, PetscReal t, PetscReal dt)
{
  FemModel       model = ctx;
  const PetscInt n     = model->n_own * model->dim;
  PetscReal      sum[2], *place;

  PetscFunctionBegin;
  if (t != model->t) model->level_known = PETSC_FALSE; /* asking for energies in between must not change a bit */
  model->t = t;
  PetscCall(FemExplicitLevel(model, dt));
  sum[0] = model->level_sum[0] + model->level_sum[1];
  sum[1] = model->level_sum[2] + model->level_sum[3];
  PetscCall(FemSum(model, 2, sum));
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
  PetscCall(FemLoadsAt(model, t + dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}
