/*
  fem_contact_implicit.c - planes in implicit steps: what a push does to velocities and accelerations.  Eqs (2.136)-(2.139)

  A push is a mean force of the step, not of a level: it moves a node by no more than to its plane and is not carried into the next step by its acceleration,
  so it never does work on the body (Kane, Repetto, Ortiz and Marsden 1999). A node that has met its plane then moves with it: its velocity along what the
  plane takes is made the plane's by the impulse that needs the least energy, of a body with this mass (Deuflhard, Krause and Ertel 2008). Energy falls
  by what the nodes had that struck, never rises, and stays while they stay on the plane.
*/
#include "fem_impl.h"

/* Does entry e hold its node along direction p after the step? */
static PetscBool Holds(const FemContact *c, PetscInt e, PetscInt p)
{
  if (!c->state[e] || c->idle[e * c->parts + p]) return PETSC_FALSE;
  return p == 0 || (c->state[e] == FEM_STICK && c->plane[c->of[e]].friction > 0) ? PETSC_TRUE : PETSC_FALSE; /* 1: sticks */
}

/* Zero along what planes hold. */
void FemContactKeepFree(FemModel model, PetscReal *a)
{
  const FemContact *c = &model->contact;

  for (PetscInt k = 0; k < c->n * c->parts; k++) {
    PetscReal *at = &a[c->node[k / c->parts] * model->dim], dot = 0;

    if (!Holds(c, k / c->parts, k % c->parts)) continue;
    for (PetscInt d = 0; d < model->dim; d++) dot += c->direction[3 * k + d] * at[d];
    for (PetscInt d = 0; d < model->dim; d++) at[d] -= dot * c->direction[3 * k + d];
  }
}

/* Velocity of nodes on planes made that of the planes at t, the change left in y.  Eq. (2.138); sum [2] += energy taken, work done by moving planes and supports, of this rank */
static PetscErrorCode Stop(FemModel model, PetscReal t, PetscReal h, PetscReal sum[2])
{
  FemImplicit      *im  = &model->implicit;
  const FemContact *c   = &model->contact;
  const PetscInt    dim = model->dim, n = model->n_own * dim;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(im->r, n));
  PetscCall(PetscArrayzero(im->y, model->n_loc * dim));
  for (PetscInt k = 0; k < c->n * c->parts; k++) {
    const PetscInt at = c->node[k / c->parts] * dim;
    PetscReal      D0[3], D1[3], more = 0;

    if (!Holds(c, k / c->parts, k % c->parts)) continue;
    FemPlaneMotion(&c->plane[c->of[k / c->parts]], PetscMax(0, t - h), D0);
    FemPlaneMotion(&c->plane[c->of[k / c->parts]], t + h, D1);
    for (PetscInt d = 0; d < dim; d++) more += c->direction[3 * k + d] * ((D1[d] - D0[d]) / (t + h - PetscMax(0, t - h)) - model->v[at + d]);
    for (PetscInt d = 0; d < dim; d++) im->y[at + d] += more * c->direction[3 * k + d];
  }
  PetscCall(FemMassSolve(model, im->mass, PETSC_TRUE, im->r, im->y)); /* the least energy with those changes */
  FemMassApply(model, im->mass, im->y, im->q);
  for (PetscInt k = 0; k < n; k++) {
    sum[0] += 0.5 * im->y[k] * im->q[k];
    sum[1] += im->q[k] * (model->v[k] + im->y[k]); /* impulses act where the velocity after them is given */
    model->v[k] += im->y[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* a holds the acceleration that goes with the step's motion, pushes and all; takes theirs out, M^-1 push/(1 - alpha_m), and the drag of the change y of velocity.  Eq. (2.136) */
static PetscErrorCode TakeOut(FemModel model)
{
  FemImplicit      *im = &model->implicit;
  const FemContact *c  = &model->contact;

  PetscFunctionBegin;
  PetscCall(FemImplicitDrag(model, im->y, im->r, im->q));
  PetscCall(PetscArrayzero(im->x, model->n_loc * model->dim));
  for (PetscInt e = 0; e < c->n; e++)
    for (PetscInt d = 0; d < model->dim; d++) im->r[c->node[e] * model->dim + d] += c->push[3 * e + d] / (1 - im->am);
  PetscCall(FemMassSolve(model, im->mass, PETSC_FALSE, im->r, im->x));
  for (PetscInt k = 0; k < model->n_own * model->dim; k++) im->a[k] -= im->x[k];
  PetscCall(FemGhosts(model, im->a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemContactImplicit(FemModel model, PetscReal t, PetscReal h, const PetscReal *old_u)
{
  FemImplicit    *im = &model->implicit;
  FemContact     *c  = &model->contact;
  const PetscReal share = (1 - (im->rho_inf < 0 ? 0.5 : im->am)) / (1 - im->am), mean = im->gamma / (1 - im->am); /* of the push of the matrix: at the instant of balance; of the step */
  PetscReal       sum[5] = {0, 0, 0, 0, 0}, work;

  PetscFunctionBegin;
  if (!c->touching) PetscFunctionReturn(PETSC_SUCCESS);
  FemContactWork(model, t, t + h, old_u, c->push, c->normal, sum);
  for (PetscInt k = 0; k < 3; k++) sum[k] *= share;
  PetscCall(Stop(model, t + h, h, &sum[3]));
  PetscCall(TakeOut(model));
  PetscCall(FemSum(model, 5, sum));
  c->contact -= sum[0] - sum[3];
  c->friction -= sum[1];
  work = sum[2] + sum[4];
  model->work += work;
  model->work_in += PetscAbsReal(work);
  for (PetscInt e = 0; e < c->n; e++) { /* shown as the step's mean */
    c->normal[e] *= mean;
    for (PetscInt d = 0; d < model->dim; d++) c->push[3 * e + d] *= mean;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
