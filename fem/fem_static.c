/*
  fem_static.c - K u = f, one factorisation for all load steps; and the same solve once, before dynamics.  Eqs (2.14)-(2.16), (2.58)
*/
#include "fem_impl.h"

PetscErrorCode FemStaticSetUp(FemModel model)
{
  FemSolver solver;

  PetscFunctionBegin;
  BaseCheckInput(model->alpha == 0, model->comm, "Damping of %g 1/s needs the explicit or the implicit method; a static body has no velocity", (double)model->alpha);
  for (PetscInt d = 0; d < 3; d++) BaseCheckInput(model->velocity0[d] == 0, model->comm, "An initial velocity needs the explicit or the implicit method; a static body has no inertia");
  PetscCall(FemCheckRigidMotion(model));
  model->initial = FemPrestressEnergy(model);
  PetscCall(FemSum(model, 1, &model->initial));
  PetscCall(FemSolverWants(model, &solver));
  if (solver == FEM_TWO_LEVEL) {
    PetscCall(FemBatchesCreate(model, PETSC_TRUE));
    PetscCall(FemSolverCreate(model, NULL));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FemRowsCreate(model));
  PetscCall(FemContactStiffen(model, model->rows.value));
  FemRowsIntoFrames(model, model->rows.value);
  PetscCall(FemSolverCreate(model, model->rows.value));
  PetscCall(FemRowsDestroy(model)); /* K is in the matrix now; forces and reactions come from the elements */
  PetscCall(FemElementsCreate(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reactions, and the out-of-balance force on free dofs against all forces; catches a singular K that still factorised. */
static PetscErrorCode CheckResidual(FemModel model)
{
  PetscReal sum[3] = {0, 0, 0};

  PetscFunctionBegin;
  PetscCall(FemTakeReactions(model, &sum[0]));
  for (PetscInt k = 0; k < model->n_own * model->dim; k++) {
    sum[1] += model->f_int[k] * model->f_int[k] + model->f_app[k] * model->f_app[k] + (model->pre.n ? PetscSqr(model->pre.force[k]) : 0);
    if (FemHeld(model, k) >= 0) sum[2] += PetscSqr(model->diagonal * model->u[k]); /* a body moved as a whole has no force but round-off */
  }
  PetscCall(FemSum(model, 3, sum));
  PetscCheck(sum[0] <= 1e-12 * sum[1] + 1e-26 * sum[2], model->comm, PETSC_ERR_NOT_CONVERGED, "%s: the static solution is out of balance by %g of its forces; a part held only by a hinge or a single node can cause it", model->source,
             (double)PetscSqrtReal(sum[0] / sum[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u, f_int and reactions in equilibrium with loads and supports of time t.  Eq. (2.14) */
static PetscErrorCode SolveAt(FemModel model, PetscReal t)
{
  const PetscInt     dim = model->dim, n = model->n_own * dim;
  PetscReal         *place, moved = 0;
  PetscScalar       *b, *s;
  const PetscScalar *a;

  PetscFunctionBegin;
  FemContactBegin(model, model->t, model->u);
  PetscCall(FemLoadsAt(model, t));
  PetscCall(PetscMalloc1(model->n_fixes, &place));
  for (PetscInt k = 0; k < model->n_fixes; k++) place[k] = FemFixPosition(&model->fix[k], t);
  PetscCall(VecGetArrayWrite(model->solution, &s));
  PetscCall(PetscArraycpy(s, model->u, n));
  FemIntoFrames(model, s);
  for (PetscInt k = 0; k < n; k++)
    if (FemHeld(model, k) >= 0) s[k] = place[FemHeld(model, k)];
  PetscCall(VecRestoreArrayWrite(model->solution, &s));
  for (PetscInt k = 0; k < n; k++) model->u[k] = FemHeld(model, k) >= 0 ? place[FemHeld(model, k)] : 0;
  FemOutOfFrames(model, model->u);
  PetscCall(FemGhosts(model, model->u));
  for (PetscInt k = 0; k < model->n_loc * dim; k++) moved = PetscMax(moved, PetscAbsReal(model->u[k]));
  if (moved > 0) PetscCall(FemApply(model, model->u, model->f_int));
  else PetscCall(PetscArrayzero(model->f_int, n));
  FemPrestressAdvance(model, t);
  FemAddPrestress(model);
  PetscCall(VecGetArrayWrite(model->rhs, &b));
  for (PetscInt k = 0; k < n; k++) b[k] = model->f_app[k] + model->f_ext[k] - model->f_int[k];
  FemIntoFrames(model, b);
  for (PetscInt k = 0; k < n; k++)
    if (FemHeld(model, k) >= 0) b[k] = model->diagonal * place[FemHeld(model, k)];
  PetscCall(VecRestoreArrayWrite(model->rhs, &b));
  PetscCall(FemSolverSolve(model));
  PetscCall(FemContactSolve(model, t, NULL));
  PetscCall(VecGetArrayRead(model->solution, &a));
  for (PetscInt k = 0; k < n; k++) model->u[k] = FemHeld(model, k) >= 0 ? place[FemHeld(model, k)] : a[k];
  PetscCall(VecRestoreArrayRead(model->solution, &a));
  FemOutOfFrames(model, model->u);
  PetscCall(FemGhosts(model, model->u));
  PetscCall(FemApply(model, model->u, model->f_int));
  FemAddPrestress(model);
  PetscCall(CheckResidual(model));
  PetscCall(PetscFree(place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemStaticStep(void *ctx, PetscReal t, PetscReal dt)
{
  FemModel       model = ctx;
  const PetscInt n     = model->n_own * model->dim;
  FemContact    *contact = &model->contact;
  PetscReal     *old_u, *old_force, *normal, *push, work[4] = {0, 0, 0, 0}, heat; /* of planes across, along them and of their motion; of all forces */

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(n, &old_u, n, &old_force, contact->n, &normal, 3 * contact->n, &push));
  for (PetscInt e = 0; e < contact->n; e++) normal[e] = 0.5 * contact->normal[e];
  for (PetscInt k = 0; k < 3 * contact->n; k++) push[k] = 0.5 * contact->push[k];
  for (PetscInt k = 0; k < n; k++) {
    old_u[k]     = model->u[k];
    old_force[k] = model->f_app[k] + model->reaction[k];
    if (!model->started) old_force[k] = model->pre.n ? model->pre.force[k] : 0; /* loads grow from nothing during the first step, and what held an in-situ stress lets go */
  }
  PetscCall(SolveAt(model, t + dt));
  for (PetscInt k = 0; k < n; k++) { /* eq. (2.16) */
    model->v[k] = (model->u[k] - old_u[k]) / dt;
    work[3] += 0.5 * (old_force[k] + model->f_app[k] + model->reaction[k]) * (model->u[k] - old_u[k]);
  }
  for (PetscInt e = 0; e < contact->n; e++) normal[e] += 0.5 * contact->normal[e];
  for (PetscInt k = 0; k < 3 * contact->n; k++) push[k] += 0.5 * contact->push[k];
  FemContactWork(model, t, t + dt, old_u, push, normal, work);
  PetscCall(PetscFree4(old_u, old_force, normal, push));
  PetscCall(FemSum(model, 4, work));
  PetscCall(FemHeatWork(model, &heat));
  contact->contact -= work[0];
  contact->friction -= work[1];
  work[3] -= work[0] + work[1];
  model->work += work[3] + heat;
  model->work_in += PetscAbsReal(work[3]) + PetscAbsReal(heat);
  model->started = PETSC_TRUE;
  model->t       = t + dt;
  model->dt_last = dt;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The state at t = 0 of a dynamic run: equilibrium with the loads and supports of that time. The factor is dropped again.  Eq. (2.58) */
PetscErrorCode FemPreload(FemModel model)
{
  const PetscBool rows = model->rows.value ? PETSC_TRUE : PETSC_FALSE;
  PetscReal      *value, heat;
  size_t          n;

  PetscFunctionBegin;
  PetscCall(FemCheckRigidMotion(model));
  if (!rows) PetscCall(FemRowsCreate(model));
  n = (size_t)model->rows.start[model->n_own] * model->dim * model->dim;
  PetscCall(PetscMalloc1(n, &value));
  PetscCall(PetscArraycpy(value, model->rows.value, n));
  PetscCall(FemContactStiffen(model, value));
  FemRowsIntoFrames(model, value);
  PetscCall(FemSolverCreate(model, value));
  PetscCall(PetscFree(value));
  PetscCall(SolveAt(model, 0));
  PetscCall(FemHeatWork(model, &heat)); /* no work: for the powers at t = 0 */
  PetscCall(FemSolverDestroy(model));
  if (!rows) PetscCall(FemRowsDestroy(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
