/*
  fem_implicit.c - Newmark's average acceleration and the generalised-alpha method, one factorisation for all steps.  Eqs (2.51)-(2.57)

  Known at level n: u, v, a, the internal force K u and the loads. A step predicts from them, solves K_eff for the rest and books,
  at the instant the scheme balances forces, every force times the motion of the step: the ledger closes to the solver's precision.
  Without rho_inf the balance holds at every level and work is taken by trapezoid, which is exact for average acceleration.
*/
#include "fem_impl.h"

/* Eq. (2.54): u, v, a along prescribed axes at t; v and a are central differences of the motion over t - h .. t + h. */
static void Motion(FemModel model, PetscReal t, PetscReal h)
{
  PetscReal *u = model->implicit.place, *v = u + model->n_fixes, *a = v + model->n_fixes;

  for (PetscInt k = 0; k < model->n_fixes; k++) {
    const FemFix   *fix    = &model->fix[k];
    const PetscReal before = FemFixPosition(fix, t - h), after = FemFixPosition(fix, t + h);

    u[k] = FemFixPosition(fix, t);
    v[k] = (after - before) / (2 * h);
    a[k] = ((after - u[k]) - (u[k] - before)) / (h * h);
  }
  FemProjectTo(model, u, model->u);
  FemProjectTo(model, v, model->v);
  FemProjectTo(model, a, model->implicit.a);
}

static PetscErrorCode Factor(FemModel model, PetscReal h)
{
  FemImplicit    *im   = &model->implicit;
  const PetscReal unit = 1 / (im->beta * h * h), lag = 1 - im->af, drag = lag * im->gamma / (im->beta * h); /* eq. (2.53) */
  const FemRows  *rows = &model->rows;
  PetscReal      *value;

  PetscFunctionBegin;
  PetscCall(FemSolverDestroy(model));
  PetscCall(PetscMalloc1((size_t)rows->start[model->n_own] * model->dim * model->dim, &value));
  FemMassAddToRows(model, im->mass, lag + drag * model->stiff_damping, (1 - im->am) * unit + drag * model->alpha, value);
  FemAbsorbAddToRows(model, drag, value);
  PetscCall(FemContactWeigh(model, value));
  FemRowsIntoFrames(model, value);
  PetscCall(FemSolverCreate(model, value));
  PetscCall(PetscFree(value));
  im->h = h;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C v of eq. (2.51); v [n_loc*dim] with ghosts filled, f [n_own*dim] out, work [n_own*dim]. */
PetscErrorCode FemImplicitDrag(FemModel model, const PetscReal *v, PetscReal *f, PetscReal *work)
{
  const PetscInt n = model->n_own * model->dim;

  PetscFunctionBegin;
  if (model->alpha > 0) {
    FemMassApply(model, model->implicit.mass, v, f);
    for (PetscInt k = 0; k < n; k++) f[k] *= model->alpha;
  } else PetscCall(PetscArrayzero(f, n));
  if (model->stiff_damping > 0) {
    PetscCall(FemApply(model, v, work));
    for (PetscInt k = 0; k < n; k++) f[k] += model->stiff_damping * work[k];
  }
  FemAbsorbTimes(model, v, f);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x [n_loc*dim] = p a + q b on owned dofs, ghosts filled. */
static PetscErrorCode Blend(FemModel model, PetscReal p, const PetscReal *a, PetscReal q, const PetscReal *b, PetscReal *x)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_own * model->dim; k++) x[k] = p * a[k] + q * b[k];
  PetscCall(FemGhosts(model, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemImplicitSetUp(FemModel model)
{
  FemImplicit    *im  = &model->implicit;
  const PetscInt  dim = model->dim, n = model->n_own * dim, n_loc = model->n_loc * dim;
  const PetscReal rho = im->rho_inf;

  PetscFunctionBegin;
  im->am    = rho < 0 ? 0 : (2 * rho - 1) / (rho + 1); /* eq. (2.52) */
  im->af    = rho < 0 ? 0 : rho / (rho + 1);
  im->gamma = 0.5 - im->am + im->af;
  im->beta  = 0.25 * (1 - im->am + im->af) * (1 - im->am + im->af);
  PetscCall(FemRowsCreate(model));
  if (!im->lumped) PetscCall(FemMassRows(model, &im->mass));
  PetscCall(PetscCalloc3(n_loc, &im->a, n_loc, &im->x, n_loc, &im->y));
  PetscCall(PetscCalloc5(n, &im->p, n, &im->q, n, &im->r, 5 * n, &im->old, 3 * model->n_fixes, &im->place));
  for (PetscInt k = 0; k < model->n_fixes; k++)
    if (model->fix[k].table.n > 1 || (model->fix[k].motion == FEM_VELOCITY && model->fix[k].table.v[0] != 0)) im->moving = PETSC_TRUE;
  PetscCall(FemStart(model));
  /* M a = f - K u - C v at t = 0 */
  for (PetscInt k = 0; k < model->n_fixes; k++) im->place[k] = model->fix[k].motion == FEM_VELOCITY ? TableSlope(&model->fix[k].table, 0) : 0;
  FemProjectTo(model, im->place, im->a);
  PetscCall(Blend(model, 1, model->v, 0, model->v, im->x));
  PetscCall(FemImplicitDrag(model, im->x, im->p, im->q));
  for (PetscInt k = 0; k < n; k++) im->r[k] = model->f_app[k] - model->f_int[k] - im->p[k];
  if (model->preload) { /* at rest, equilibrium to round-off is no acceleration */
    PetscReal sum[2] = {0, 0};

    PetscCall(PetscArraycpy(im->p, im->r, n));
    sum[0] = FemKeepHeld(model, im->p);
    for (PetscInt k = 0; k < n; k++) sum[1] += model->f_int[k] * model->f_int[k] + model->f_app[k] * model->f_app[k];
    PetscCall(FemSum(model, 2, sum));
    if (sum[0] <= 1e-18 * sum[1]) PetscCall(PetscArrayzero(im->r, n));
  }
  PetscCall(FemMassSolve(model, im->mass, PETSC_FALSE, im->r, im->a));
  PetscCall(FemImplicitLevel(model));
  model->initial = im->kinetic + 0.5 * FemDot(model, model->u, model->f_int) + FemPrestressEnergy(model);
  PetscCall(FemSum(model, 1, &model->initial));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reactions and kinetic energy (this rank's) of the present level.  Eqs (2.51), (2.55) */
PetscErrorCode FemImplicitLevel(FemModel model)
{
  FemImplicit   *im = &model->implicit;
  const PetscInt n  = model->n_own * model->dim;

  PetscFunctionBegin;
  if (model->level_known) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Blend(model, 1, model->v, 0, model->v, im->x));
  FemMassApply(model, im->mass, im->x, im->p);
  im->kinetic = 0.5 * FemDot(model, model->v, im->p);
  PetscCall(FemImplicitDrag(model, im->x, im->p, im->q));
  FemMassApply(model, im->mass, im->a, im->q);
  for (PetscInt k = 0; k < n; k++) model->reaction[k] = im->q[k] + im->p[k] + model->f_int[k] - model->f_app[k];
  (void)FemKeepHeld(model, model->reaction);
  for (PetscInt e = 0; e < model->contact.n; e++)
    for (PetscInt d = 0; d < model->dim; d++) model->reaction[model->contact.node[e] * model->dim + d] += model->contact.push[3 * e + d];
  model->level_known = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Book the step.  Eqs (2.55)-(2.57)

  old [5][n] u, v, a, K u and loads of the level before. Forces at the instant of balance times the step's displacement; what the
  scheme itself takes; and at prescribed dofs the work of a motion that a step cannot follow (a kink in it).
*/
static PetscErrorCode Book(FemModel model, PetscReal h)
{
  FemImplicit     *im = &model->implicit;
  const PetscInt   n  = model->n_own * model->dim;
  const PetscReal *u = im->old, *v = im->old + n, *a = im->old + 2 * n, *f_int = im->old + 3 * n, *f_app = im->old + 4 * n;
  const PetscReal  am = im->rho_inf < 0 ? 0.5 : im->am, af = im->rho_inf < 0 ? 0.5 : im->af;
  PetscReal        sum[2] = {0, 0}; /* work, damping */

  PetscFunctionBegin;
  PetscCall(Blend(model, 1 - af, model->v, af, v, im->x));
  PetscCall(FemImplicitDrag(model, im->x, im->p, im->q));
  PetscCall(Blend(model, 1 - am, im->a, am, a, im->x));
  FemMassApply(model, im->mass, im->x, im->q);
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal load = (1 - af) * model->f_app[k] + af * f_app[k], inner = (1 - af) * model->f_int[k] + af * f_int[k], du = model->u[k] - u[k];

    sum[0] += load * du;
    sum[1] += im->p[k] * du;
    im->q[k] += im->p[k] + inner - load;
  }
  (void)FemKeepHeld(model, im->q);
  for (PetscInt k = 0; k < n; k++) sum[0] += im->q[k] * (model->u[k] - u[k]);
  if (im->rho_inf >= 0) {
    PetscCall(Blend(model, 1, im->a, -1, a, im->x));
    FemMassApply(model, im->mass, im->x, im->q);
    for (PetscInt k = 0; k < n; k++) sum[1] += (0.5 - af) * (im->q[k] + model->f_int[k] - f_int[k]) * (model->u[k] - u[k]) + h * (im->beta - 0.5 * im->gamma) * im->q[k] * (model->v[k] - v[k]);
  }
  if (im->moving) {
    PetscCall(Blend(model, 1, model->u, -1, u, im->x));
    FemMassApply(model, im->mass, im->x, im->p);
    PetscCall(Blend(model, 1, model->v, -1, v, im->x));
    FemMassApply(model, im->mass, im->x, im->q);
    for (PetscInt k = 0; k < n; k++) { /* both are zero along free axes, up to round-off */
      const PetscReal e_u = model->u[k] - u[k] - 0.5 * h * (v[k] + model->v[k]) - h * h * (im->beta - 0.5 * im->gamma) * (im->a[k] - a[k]);
      const PetscReal e_v = model->v[k] - v[k] - h * ((1 - im->gamma) * a[k] + im->gamma * im->a[k]);

      sum[0] += (e_v * im->p[k] - e_u * im->q[k]) / h;
    }
  }
  PetscCall(FemSum(model, 2, sum));
  model->work += sum[0];
  model->work_in += PetscAbsReal(sum[0]);
  model->damping += sum[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemImplicitStep(void *ctx, PetscReal t, PetscReal h)
{
  FemModel           model = ctx;
  FemImplicit       *im    = &model->implicit;
  const PetscInt     n     = model->n_own * model->dim;
  const PetscReal    unit = im->beta * h * h, af = im->af, am = im->am;
  PetscReal         *u = im->old, *v = im->old + n, *a = im->old + 2 * n, *f_app = im->old + 4 * n;
  PetscScalar       *b, *s;
  const PetscScalar *w;

  PetscFunctionBegin;
  if (im->h != h) PetscCall(Factor(model, h));
  PetscCall(PetscArraycpy(u, model->u, n));
  PetscCall(PetscArraycpy(v, model->v, n));
  PetscCall(PetscArraycpy(a, im->a, n));
  PetscCall(PetscArraycpy(im->old + 3 * n, model->f_int, n));
  PetscCall(PetscArraycpy(f_app, model->f_app, n));
  FemContactBegin(model, t, u);
  for (PetscInt k = 0; k < n; k++) { /* what does not need the new acceleration */
    model->u[k] = u[k] + h * v[k] + h * h * (0.5 - im->beta) * a[k];
    model->v[k] = v[k] + h * (1 - im->gamma) * a[k];
    im->a[k]    = 0;
  }
  Motion(model, t + h, h);
  PetscCall(Blend(model, 1 - af, model->v, af, v, im->y));
  PetscCall(Blend(model, 1 - am, im->a, am, a, im->x));
  FemMassApply(model, im->mass, im->x, im->p);
  PetscCall(FemImplicitDrag(model, im->y, im->q, im->r));
  PetscCall(Blend(model, 1 - af, model->u, af, u, im->x));
  PetscCall(FemApply(model, im->x, im->r));
  PetscCall(FemLoadsAt(model, t + h));
  if (model->pre.n) { /* stress apart from displacement, as of the instant of balance */
    for (PetscInt k = 0; k < n; k++) im->r[k] += af * model->pre.force[k];
    FemPrestressAdvance(model, t + h);
    for (PetscInt k = 0; k < n; k++) im->r[k] += (1 - af) * model->pre.force[k];
  }
  PetscCall(VecGetArrayWrite(model->rhs, &b));
  PetscCall(VecGetArrayWrite(model->solution, &s));
  for (PetscInt k = 0; k < n; k++) {
    b[k] = (1 - af) * model->f_app[k] + af * f_app[k] - im->r[k] - im->p[k] - im->q[k];
    s[k] = unit * a[k]; /* first guess of an iterative solver */
  }
  FemIntoFrames(model, b);
  FemIntoFrames(model, s);
  for (PetscInt k = 0; k < n; k++)
    if (FemHeld(model, k) >= 0) b[k] = s[k] = 0;
  PetscCall(VecRestoreArrayWrite(model->rhs, &b));
  PetscCall(VecRestoreArrayWrite(model->solution, &s));
  PetscCall(FemSolverSolve(model));
  PetscCall(FemContactSolve(model, t + h, model->u));
  PetscCall(VecGetArrayRead(model->solution, &w));
  for (PetscInt k = 0; k < n; k++) im->r[k] = FemHeld(model, k) >= 0 ? 0 : w[k];
  PetscCall(VecRestoreArrayRead(model->solution, &w));
  FemOutOfFrames(model, im->r);
  for (PetscInt k = 0; k < n; k++) {
    model->u[k] += im->r[k];
    model->v[k] += im->gamma / (im->beta * h) * im->r[k];
    im->a[k] += im->r[k] / unit;
  }
  PetscCall(FemGhosts(model, model->u));
  PetscCall(FemGhosts(model, im->a));
  PetscCall(FemApply(model, model->u, model->f_int));
  FemAddPrestress(model);
  PetscCall(Book(model, h));
  PetscCall(FemContactImplicit(model, t, h, u));
  if (model->pre.n) {
    PetscReal heat;

    PetscCall(FemHeatWork(model, &heat));
    model->work += heat;
    model->work_in += PetscAbsReal(heat);
  }
  model->started     = PETSC_TRUE;
  model->t           = t + h;
  model->dt_last     = h;
  model->level_known = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemImplicitDestroy(FemModel model)
{
  FemImplicit *im = &model->implicit;

  PetscFunctionBegin;
  PetscCall(PetscFree(im->mass));
  PetscCall(PetscFree3(im->a, im->x, im->y));
  PetscCall(PetscFree5(im->p, im->q, im->r, im->old, im->place));
  PetscFunctionReturn(PETSC_SUCCESS);
}
