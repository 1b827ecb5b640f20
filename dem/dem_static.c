/*
  dem_static.c - load steps of bonded particles without inertia: equilibrium by Newton's method.  Eqs (4.80), (4.81)

  The tangent is the model's own force function, differenced along a direction, so whatever acts is counted and nothing is assembled;
  each of its systems is solved by PETSc's conjugate gradients. Rotations are increments upon the particles' own, however far they have turned.
*/
#include "dem_static_impl.h"

#define STATIC_RESIDUAL 1e-8 /* of the largest out-of-balance a load step began with */
#define STATIC_NEWTON   60
#define STATIC_TURN     0.1  /* [rad] largest rotation in one round: far from equilibrium the tangent says little */
#define STATIC_MOTION   1e-7 /* largest motion of a difference, in mean radii: far above rounding, far below what bends the force */
#define STATIC_MORE     20   /* iterations beyond the first solve's that make a new factor worth its while */
#define FACTOR_MOST_2D  600000 /* unknowns up to which springs are factored */
#define FACTOR_MOST_3D  60000

/* The state of the step moved by scale x v: displacement [dim][n], then rotation vector [nrot][n]. */
void DemStaticMoveTo_Internal(DemModel model, PetscReal scale, const PetscReal *v)
{
  const PetscInt  n = model->n, dim = model->dim;
  DemStatic       s = model->statics;
  const PetscReal *turn = v + dim * n;

  for (PetscInt i = 0; i < dim * n; i++) model->u[i] = s->u[i] + scale * v[i];
  for (PetscInt p = 0; p < n; p++) {
    if (dim == 2) {
      const PetscReal a = s->rot[2 * n + p] + scale * turn[p];

      model->rot[p]         = PetscSinReal(a);
      model->rot[n + p]     = -2 * PetscSqr(PetscSinReal(0.5 * a));
      model->rot[2 * n + p] = a;
    } else {
      const PetscReal t[3] = {scale * turn[p], scale * turn[n + p], scale * turn[2 * n + p]}, a = PetscSqrtReal(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
      const PetscReal c = PetscCosReal(0.5 * a), f = a > 0 ? PetscSinReal(0.5 * a) / a : 0.5, ax = f * t[0], ay = f * t[1], az = f * t[2];
      const PetscReal w = s->rot[p], x = s->rot[n + p], y = s->rot[2 * n + p], z = s->rot[3 * n + p];

      model->rot[p]         = c * w - ax * x - ay * y - az * z;
      model->rot[n + p]     = c * x + ax * w + ay * z - az * y;
      model->rot[2 * n + p] = c * y + ay * w + az * x - ax * z;
      model->rot[3 * n + p] = c * z + az * w + ax * y - ay * x;
    }
  }
}

/* Forces and couples now; their norm, couples over the mean radius [N]. */
PetscReal DemStaticForces_Internal(DemModel model, PetscReal *f)
{
  const PetscInt n = model->n, dim = model->dim;
  PetscReal      sum = 0;

  for (PetscInt i = 0; i < dim * n; i++) {
    f[i] = model->f[i];
    sum += PetscSqr(f[i]);
  }
  for (PetscInt i = 0; i < model->nrot * n; i++) {
    f[dim * n + i] = model->torque[i];
    sum += PetscSqr(f[dim * n + i] / model->statics->radius);
  }
  return PetscSqrtReal(sum);
}

/* y = K x, the fall of the forces along x.  Eq. (4.81) */
static PetscErrorCode Product(Mat K, Vec X, Vec Y)
{
  const PetscReal *x;
  PetscReal       *y, most = 0;
  DemModel         model;
  DemStatic        s;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(K, &model));
  s = model->statics;
  PetscCall(VecGetArrayRead(X, &x));
  for (PetscInt i = 0, n = model->dim * model->n; i < DemStaticUnknowns(model); i++) most = PetscMax(most, PetscAbsReal(x[i]) * (i < n ? 1 : s->radius));
  if (most > 0) {
    const PetscReal scale = STATIC_MOTION * s->radius / most;

    DemStaticMoveTo_Internal(model, scale, x);
    PetscCall(DemForces_Internal(model, DEM_WITH_LOADS));
    s->products++;
    PetscCall(VecGetArrayWrite(Y, &y));
    (void)DemStaticForces_Internal(model, y);
    for (PetscInt i = 0; i < DemStaticUnknowns(model); i++) y[i] = (s->f[i] - y[i]) / scale;
    PetscCall(VecRestoreArrayWrite(Y, &y));
  } else PetscCall(VecZeroEntries(Y));
  PetscCall(VecRestoreArrayRead(X, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Diagonal(Mat K, Vec D)
{
  PetscReal *d;
  DemModel   model;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(K, &model));
  PetscCall(VecGetArrayWrite(D, &d));
  PetscCall(PetscArraycpy(d, model->statics->diagonal, DemStaticUnknowns(model)));
  PetscCall(VecRestoreArrayWrite(D, &d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What holds each particle: bonds and boundary facets by their springs, couples by their arms. For the preconditioner. */
static void SetDiagonal(DemModel model)
{
  const DemBonds *bonds = &model->bonds;
  const DemWalls *walls = &model->walls;
  const PetscInt  n = model->n, dim = model->dim;
  PetscReal      *d = model->statics->diagonal;

  for (PetscInt i = 0; i < DemStaticUnknowns(model); i++) d[i] = 0;
  for (PetscInt e = 0; e < bonds->n; e++)
    for (PetscInt side = 0; side < 2; side++) {
      const PetscInt  p = side ? bonds->q[e] : bonds->p[e];
      const PetscReal k = model->net ? model->net->kn[e] : 2 * model->g_shear * bonds->k[e];
      PetscReal       arm = 0;

      for (PetscInt c = 0; c < dim; c++) arm += PetscSqr(bonds->arm[c * bonds->n + e] - (side ? model->x0[c * n + bonds->q[e]] - model->x0[c * n + bonds->p[e]] : 0));
      for (PetscInt c = 0; c < dim; c++) d[c * n + p] += k;
      for (PetscInt c = 0; c < model->nrot; c++) d[(dim + c) * n + p] += k * arm;
    }
  for (PetscInt i = 0; i < walls->n; i++) {
    const PetscInt  p = walls->owner[i];
    const PetscReal k = walls->h[i] > 0 ? 2 * model->g_shear * walls->area[i] / walls->h[i] : 0;
    PetscReal       arm = 0;

    for (PetscInt c = 0; c < dim; c++) arm += PetscSqr(walls->arm[3 * i + c]);
    for (PetscInt c = 0; c < dim; c++) d[c * n + p] += k;
    for (PetscInt c = 0; c < model->nrot; c++) d[(dim + c) * n + p] += k * arm;
  }
  for (PetscInt i = 0; i < DemStaticUnknowns(model); i++)
    if (d[i] <= 0) d[i] = model->g_shear * model->statics->radius; /* a particle that nothing holds, and nothing moves */
}

PetscErrorCode DemStaticCreate_Internal(DemModel model)
{
  const PetscInt n = model->n, all = DemStaticUnknowns(model);
  DemStatic      s;
  PetscBool      factors;
  PC             pc;

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  model->statics = s;
  PetscCall(PetscMalloc4(3 * n, &s->u, 4 * n, &s->rot, all, &s->f, all, &s->diagonal));
  for (PetscInt p = 0; p < n; p++) s->radius += model->r[p] / n;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, all, &s->x));
  PetscCall(VecDuplicate(s->x, &s->b));
  PetscCall(MatCreateShell(PETSC_COMM_SELF, all, all, all, all, model, &s->K));
  PetscCall(MatShellSetOperation(s->K, MATOP_MULT, (void (*)(void))Product));
  PetscCall(MatShellSetOperation(s->K, MATOP_GET_DIAGONAL, (void (*)(void))Diagonal));
  PetscCall(KSPCreate(PETSC_COMM_SELF, &s->ksp));
  PetscCall(KSPSetOptionsPrefix(s->ksp, "dem_"));
  PetscCall(KSPSetOperators(s->ksp, s->K, s->K));
  PetscCall(KSPSetType(s->ksp, KSPCG));
  PetscCall(KSPGetPC(s->ksp, &pc));
  if (model->crack.damage && all <= (model->dim == 2 ? FACTOR_MOST_2D : FACTOR_MOST_3D)) { /* worth its while where hundreds of systems with soft bonds are solved: of elastic ones the diagonal is 2 to 10 times as fast */
    PetscCall(PCSetType(pc, PCCHOLESKY));
    PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERCHOLMOD));
  } else PetscCall(PCSetType(pc, PCJACOBI));
  PetscCall(KSPSetNormType(s->ksp, KSP_NORM_UNPRECONDITIONED));
  PetscCall(KSPSetFromOptions(s->ksp));
  SetDiagonal(model);
  if (model->crack.damage) PetscCall(PetscMalloc1(all, &s->held));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCCHOLESKY, &factors));
  if (factors) PetscCall(DemStaticSprings_Internal(model, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemStaticDestroy_Internal(DemModel model)
{
  DemStatic s = model->statics;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree4(s->u, s->rot, s->f, s->diagonal));
  PetscCall(VecDestroy(&s->x));
  PetscCall(VecDestroy(&s->b));
  PetscCall(MatDestroy(&s->K));
  PetscCall(MatDestroy(&s->springs));
  PetscCall(PetscFree(s->held));
  PetscCall(KSPDestroy(&s->ksp));
  PetscCall(PetscFree(model->statics));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tangent's answer to the forces s->f at the state at hand, which becomes the one to move from; most: iterations after which any way down will do, 0: none. */
PetscErrorCode DemStaticSolve_Internal(DemModel model, PetscReal rtol, PetscInt most)
{
  DemStatic          s = model->statics;
  PetscReal         *b;
  PetscInt           its;
  KSPConvergedReason reason;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(s->u, model->u, 3 * model->n));
  PetscCall(PetscArraycpy(s->rot, model->rot, 4 * model->n));
  PetscCall(VecGetArrayWrite(s->b, &b));
  PetscCall(PetscArraycpy(b, s->f, DemStaticUnknowns(model)));
  PetscCall(VecRestoreArrayWrite(s->b, &b));
  PetscCall(KSPSetTolerances(s->ksp, rtol, PETSC_DEFAULT, PETSC_DEFAULT, most ? most : 20 * DemStaticUnknowns(model)));
  PetscCall(KSPSolve(s->ksp, s->b, s->x));
  PetscCall(KSPGetConvergedReason(s->ksp, &reason));
  PetscCall(KSPGetIterationNumber(s->ksp, &its));
  if (most && reason < 0) { /* pieces that just touch push on one side alone, no tangent is theirs: the springs' own way is down whatever happens */
    PetscReal down;

    PetscCall(VecDot(s->b, s->x, &down));
    if (!(down > 0)) {
      PC pc;

      PetscCall(KSPGetPC(s->ksp, &pc));
      PetscCall(PCApply(pc, s->b, s->x));
    }
  }
  PetscCall(PetscArraycpy(model->u, s->u, 3 * model->n));
  PetscCall(PetscArraycpy(model->rot, s->rot, 4 * model->n));
  if (s->springs) {
    PetscCall(KSPSetReusePreconditioner(s->ksp, PETSC_TRUE));
    if (s->usual < 0) s->usual = its;
    else if (its > s->usual + STATIC_MORE) PetscCall(DemStaticSprings_Internal(model, PETSC_FALSE));
  }
  /* Where the tangent has a direction of no stiffness the solver stops with what it has: a way down. Such rounds come to an end, or the load step says so. */
  PetscCheck(reason > 0 || reason == KSP_DIVERGED_INDEFINITE_MAT || reason == KSP_DIVERGED_INDEFINITE_PC || (most && reason == KSP_DIVERGED_ITS), model->comm, PETSC_ERR_NOT_CONVERGED, "The particles find no equilibrium in the load step to t = %.6g s (%s). The supports leave a loaded body free to move as one, or the load is more than it carries without buckling", (double)model->time, KSPConvergedReasons[reason]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest rotation of the solution [rad], over STATIC_TURN: by how much the motion is to be shortened, at least 1. */
PetscReal DemStaticTooFar_Internal(DemModel model, const PetscReal *x)
{
  PetscReal turn = 0;

  for (PetscInt i = model->dim * model->n; i < DemStaticUnknowns(model); i++) turn = PetscMax(turn, PetscAbsReal(x[i]));
  return PetscMax(1, turn / STATIC_TURN);
}

/* One Newton step from the state at hand, whose out-of-balance is `size`. */
static PetscErrorCode Newton(DemModel model, PetscReal size)
{
  DemStatic        s = model->statics;
  const PetscReal *x;

  PetscFunctionBegin;
  PetscCall(DemStaticSolve_Internal(model, PetscMax(1e-6, 0.1 * STATIC_RESIDUAL * s->reference / size), 0));
  PetscCall(VecGetArrayRead(s->x, &x));
  DemStaticMoveTo_Internal(model, 1 / DemStaticTooFar_Internal(model, x), x);
  PetscCall(VecRestoreArrayRead(s->x, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemStaticStep_Internal(void *ctx, PetscReal t, PetscReal dt)
{
  DemModel  model = ctx;
  DemStatic s = model->statics;
  PetscReal size = 0;

  PetscFunctionBegin;
  if (s->springs && model->started) PetscCall(DemStaticSprings_Internal(model, PETSC_FALSE)); /* of the state alone: a resumed run goes the same way */
  if (model->crack.damage) {
    PetscCall(DemStaticBreak_Internal(model, t, dt));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(DemModelAdvance(model, t, 0)); /* at rest nothing drifts: loads and supports alone go on */
  model->time = t + dt;
  DemFacesSetTime_Internal(model, model->time);
  for (PetscInt k = 0;; k++) {
    PetscCall(DemForces_Internal(model, DEM_WITH_LOADS));
    size = DemStaticForces_Internal(model, s->f);
    if (k == 0) s->reference = PetscMax(s->reference, size);
    if (size <= STATIC_RESIDUAL * s->reference) break;
    PetscCheck(k < STATIC_NEWTON, model->comm, PETSC_ERR_NOT_CONVERGED, "No equilibrium after %d rounds of Newton's method in the load step to t = %.6g s: out of balance by %.3g of what the step began with. The supports leave a loaded body free to move as one, or the load is more than it carries without buckling; or take more time.steps", STATIC_NEWTON,
               (double)model->time, (double)(size / s->reference));
    PetscCall(Newton(model, size));
  }
  PetscCall(DemModelEvaluate(model, dt));
  PetscCall(PetscArrayzero(model->v, 3 * model->n)); /* the forces left over move nothing */
  PetscCall(PetscArrayzero(model->spin, model->nrot * model->n));
  model->dt_last = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal *DemStaticReference_Internal(DemModel model)
{
  return &model->statics->reference;
}

PetscErrorCode DemModelSetStatic(DemModel model, PetscBool is_static)
{
  PetscFunctionBegin;
  PetscCheck(!model->ready, model->comm, PETSC_ERR_ORDER, "Say that steps are static before DemModelSetUp()");
  model->is_static = is_static;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetProducts(DemModel model, PetscInt *products)
{
  PetscFunctionBegin;
  *products = model->statics ? model->statics->products : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
