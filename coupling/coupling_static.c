/*
  coupling_static.c - static equilibrium of a whole coupled body with the loads and supports of t = 0.  Eqs (6.30)-(6.33)

  Newton's method on the forces of both sides and the overlap, which all come from one energy; each linear system by conjugate
  gradients, its matrix times a direction being a difference of forces. Unknowns: displacements of nodes, then of particles, then
  their rotation vectors. Masses scale them: particles and elements have then about the same highest frequency, and a direction's
  size is a displacement.
*/
#include "coupling_impl.h"

#define NEWTONS 12
#define MOST    100000
#define INEXACT 1e-6  /* of each linear system: what a difference of forces is good for */
#define DONE    1e-10 /* of the loads */
#define PROBE   1e-6  /* largest displacement of a difference, over the mean size of a cell */

typedef struct {
  PetscInt   n_dof, n, turns, m; /* of nodes; particles; their turns; all unknowns */
  PetscReal *inverse;            /* [m] 1 / mass, 0 = prescribed */
  PetscReal  size;               /* mean size of a cell [m] */
  PetscInt   evaluations;
} Problem;

static PetscReal Dot(PetscInt n, const PetscReal *a, const PetscReal *b)
{
  PetscReal sum = 0;

  for (PetscInt i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}

/* Displaces both sides to x and gives the forces r that are left; zero where motion is prescribed. */
static PetscErrorCode Residual(CouplingModel model, Problem *problem, const PetscReal *x, PetscReal *r)
{
  const PetscInt   n = problem->n, dim = model->dim;
  const PetscReal *u = x + problem->n_dof, *turn = u + dim * n;
  FemState         fs;
  DemState         ds;

  PetscFunctionBegin;
  problem->evaluations++;
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(DemModelGetState(model->dem, &ds));
  PetscCall(PetscArraycpy(fs.u, x, problem->n_dof));
  PetscCall(PetscArraycpy(ds.u, u, dim * n));
  for (PetscInt p = 0; p < n; p++) {
    if (dim == 2) {
      ds.rot[p]         = PetscSinReal(turn[p]);
      ds.rot[n + p]     = -2 * PetscSqr(PetscSinReal(0.5 * turn[p]));
      ds.rot[2 * n + p] = turn[p];
    } else {
      const PetscReal a = PetscSqrtReal(PetscSqr(turn[p]) + PetscSqr(turn[n + p]) + PetscSqr(turn[2 * n + p])), f = a > 0 ? PetscSinReal(0.5 * a) / a : 0.5;

      ds.rot[p] = PetscCosReal(0.5 * a);
      for (PetscInt d = 0; d < 3; d++) ds.rot[(1 + d) * n + p] = f * turn[d * n + p];
    }
  }
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscCall(DemModelRestoreState(model->dem, &ds));
  PetscCall(CouplingForces_Internal(model));
  PetscCall(DemModelComputeForces(model->dem));
  PetscCall(CouplingRimForces_Internal(model));
  PetscCall(FemModelGetResidual(model->fem, model->g, r));
  PetscCall(DemModelGetState(model->dem, &ds));
  PetscCall(PetscArraycpy(r + problem->n_dof, ds.f, dim * n));
  PetscCall(PetscArraycpy(r + problem->n_dof + dim * n, ds.torque, problem->turns * n));
  PetscCall(DemModelRestoreState(model->dem, &ds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* d = K^-1 r to INEXACT, K taken at x; work [4][m] */
static PetscErrorCode Solve(CouplingModel model, Problem *problem, const PetscReal *x, const PetscReal *r0, PetscReal target, PetscReal *d, PetscReal *work)
{
  const PetscInt   m = problem->m, moves = problem->n_dof + model->dim * problem->n;
  const PetscReal *w = problem->inverse;
  PetscReal       *r = work, *p = work + m, *q = work + 2 * m, *y = work + 3 * m, rz;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(d, m));
  PetscCall(PetscArraycpy(r, r0, m));
  for (PetscInt i = 0; i < m; i++) p[i] = w[i] * r[i];
  rz = Dot(m, r, p);
  for (PetscInt k = 0; PetscSqrtReal(Dot(m, r, r)) > target; k++) {
    PetscReal largest = 0, up, a, old = rz, bend;

    for (PetscInt i = 0; i < moves; i++) largest = PetscMax(largest, PetscAbsReal(p[i]));
    BaseCheckInput(k < MOST && largest > 0, model->comm, "The static state before the run was not found in %d iterations: is the body held against every rigid motion, by its elements or its particles?", (int)k);
    up = PROBE * problem->size / largest;
    for (PetscInt i = 0; i < m; i++) y[i] = x[i] + up * p[i];
    PetscCall(Residual(model, problem, y, q));
    for (PetscInt i = 0; i < m; i++) q[i] = (r0[i] - q[i]) / up;
    bend = Dot(m, p, q);
    BaseCheckInput(bend > 0, model->comm, "The static state before the run is not stable, or the body is not held against every rigid motion by its elements or its particles");
    a = rz / bend;
    for (PetscInt i = 0; i < m; i++) {
      d[i] += a * p[i];
      r[i] -= a * q[i];
    }
    rz = 0;
    for (PetscInt i = 0; i < m; i++) rz += w[i] * r[i] * r[i];
    for (PetscInt i = 0; i < m; i++) p[i] = w[i] * r[i] + rz / old * p[i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bonds past their strength at the start would break at once: the body does not bear its loads. */
static PetscErrorCode CheckStrength(CouplingModel model)
{
  DemBondList list;
  PetscInt    over = 0;
  PetscReal   most = 0;

  PetscFunctionBegin;
  PetscCall(DemModelGetBonds(model->dem, &list));
  for (PetscInt k = 0; k < list.n; k++) {
    over += list.criterion[k] >= 1;
    most = PetscMax(most, list.criterion[k]);
  }
  model->report.preload_use = most;
  BaseCheckInput(over == 0, model->comm, "In the static state before the run %" PetscInt_FMT " bonds are at their strength or past it: the body does not bear the loads of t = 0; lower them, or let them grow during the run", over);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is in the body when the run begins.  Eq. (6.33) */
static PetscErrorCode Initial(CouplingModel model)
{
  Ledger    part;
  Stepper   dem;
  PetscReal spring, strain;

  PetscFunctionBegin;
  PetscCall(DemModelGetStepper(model->dem, &dem));
  PetscCall(dem.energy(model->dem, &part));
  PetscCall(CouplingEnergy_Internal(model, &spring, &strain));
  model->initial      = part.energy[LEDGER_STRAIN] + part.energy[LEDGER_CONTACT] + spring + strain;
  model->initial_work = part.energy[LEDGER_WORK]; /* a potential: what weight did before */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingStartStressed_Internal(CouplingModel model)
{
  PetscFunctionBegin;
  PetscCall(CouplingForces_Internal(model));
  PetscCall(DemModelComputeForces(model->dem));
  PetscCall(CheckStrength(model));
  PetscCall(Initial(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingPreload_Internal(CouplingModel model)
{
  Problem    problem = {0};
  FemState   fs;
  DemState   ds;
  PetscReal *x, *r, *d, *work, *start, loads, left = 0, volume = 0, limit = model->limit;

  PetscFunctionBegin;
  model->reference = limit; /* the springs' step, the run's whatever it is: P = c / reference^2 */
  model->dt        = limit;
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(DemModelGetState(model->dem, &ds));
  problem.n_dof = fs.n_nodes * fs.dim;
  problem.n     = ds.n;
  problem.turns = ds.dim == 3 ? 3 : 1;
  problem.m     = problem.n_dof + (ds.dim + problem.turns) * ds.n;
  PetscCall(PetscCalloc5(problem.m, &x, problem.m, &r, problem.m, &d, 4 * problem.m, &work, problem.m, &problem.inverse));
  for (PetscInt i = 0; i < problem.n_dof; i++) problem.inverse[i] = 0.25 * limit * limit / fs.mass[i / fs.dim];
  for (PetscInt i = 0; i < ds.dim * ds.n; i++) problem.inverse[problem.n_dof + i] = 0.25 * limit * limit / ds.mass[i % ds.n];
  for (PetscInt i = 0; i < problem.turns * ds.n; i++) problem.inverse[problem.n_dof + ds.dim * ds.n + i] = 0.25 * limit * limit / ds.inertia[i % ds.n];
  for (PetscInt p = 0; p < ds.n; p++) volume += ds.mass[p] / ds.n; /* weighted; only a size */
  PetscCall(PetscMalloc1(ds.dim * ds.n, &start));
  PetscCall(PetscArraycpy(start, ds.u, ds.dim * ds.n));
  volume /= model->density * model->thickness;
  problem.size = PetscPowReal(volume, 1. / model->dim);
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscCall(DemModelRestoreState(model->dem, &ds));
  PetscCall(FemModelHoldStart(model->fem)); /* supports where they are at t = 0 */
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(PetscArraycpy(x, fs.u, problem.n_dof));
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscCall(Residual(model, &problem, x, r));
  loads = left = PetscSqrtReal(Dot(problem.m, r, r));
  if (model->before) { /* what the elements' in-situ stress alone leaves is the measure; the particles' holds most of it */
    PetscCall(PetscArraycpy(x + problem.n_dof, start, ds.dim * ds.n));
    PetscCall(Residual(model, &problem, x, r));
    left = PetscSqrtReal(Dot(problem.m, r, r));
  }
  PetscCall(PetscFree(start));
  for (PetscInt k = 0; k < NEWTONS && left > DONE * loads; k++) {
    PetscReal was = left;

    PetscCall(Solve(model, &problem, x, r, PetscMax(INEXACT * left, 0.3 * DONE * loads), d, work));
    for (PetscInt i = 0; i < problem.m; i++) x[i] += d[i];
    PetscCall(Residual(model, &problem, x, r));
    left = PetscSqrtReal(Dot(problem.m, r, r));
    if (left > 0.5 * was) break; /* round-off, or no equilibrium nearby */
  }
  BaseCheckInput(left <= 1e-7 * loads, model->comm, "The static state before the run was not found: %.2g of the loads is left out of balance", (double)(left / loads));
  model->report.preload_left        = loads > 0 ? left / loads : 0;
  model->report.preload_evaluations = problem.evaluations;
  PetscCall(CouplingStart_Internal(model, limit));
  PetscCall(FemModelStartHere(model->fem));
  PetscCall(PetscFree5(x, r, d, work, problem.inverse));
  PetscCall(CheckStrength(model));
  PetscCall(Initial(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
