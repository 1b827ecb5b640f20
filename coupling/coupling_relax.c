/*
  coupling_relax.c - quasi-static load steps: particles and the elements of the overlap relax, the far field follows statically.  Eqs (6.40)-(6.45)

  Dynamic relaxation: central differences with the particles' own stable step and a drag near the critical one of the mode that
  dominates, read off the motion itself (Rayleigh's quotient of velocities and of the forces they change). The step's load comes in
  while a wave crosses the particles a few times, so that nothing is struck. Bonds break on the way as they do in a run in time.
*/
#include "coupling_impl.h"

#define MOST  400000 /* iterations of a load step */
#define CROSS 4      /* crossings of the particles' region while the load comes in */
#define LOOK  10     /* iterations between looks at the balance */

/* Of all ranks' particles, in the ranks' order; nothing on one rank. */
static PetscErrorCode SumRanks(CouplingModel model, PetscInt n, PetscReal *a)
{
  PetscMPIInt size;
  PetscReal  *all;

  PetscFunctionBegin;
  if (!model->part) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Comm_size(model->comm, &size));
  PetscCall(PetscMalloc1(n * size, &all));
  PetscCallMPI(MPI_Allgather(a, (PetscMPIInt)n, MPIU_REAL, all, (PetscMPIInt)n, MPIU_REAL, model->comm));
  for (PetscInt k = 0; k < n; k++) {
    a[k] = 0;
    for (PetscMPIInt s = 0; s < size; s++) a[k] += all[n * s + k];
  }
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest extent of the particles' mesh [m]. */
static PetscReal Extent(CouplingModel model)
{
  const Mesh *mesh = &model->split->dem;
  PetscReal   most = 0;

  for (PetscInt d = 0; d < model->dim; d++) {
    PetscReal low = PETSC_MAX_REAL, high = PETSC_MIN_REAL;

    for (PetscInt i = 0; i < mesh->n_nodes; i++) {
      low  = PetscMin(low, mesh->x[3 * i + d]);
      high = PetscMax(high, mesh->x[3 * i + d]);
    }
    most = PetscMax(most, high - low);
  }
  return most;
}

/* One iteration of the particles: velocities kept by `keep`, then a kick and a drift; what the drag took [J]. old [12][n]: velocities, then forces before. */
static PetscErrorCode MoveParticles(CouplingModel model, PetscReal t, PetscReal dt, PetscReal keep, PetscReal *old)
{
  const DemModel dem = CouplingMoving(model);
  DemState       s;
  PetscReal      lost = 0;
  PetscInt       n, turns;

  PetscFunctionBegin;
  PetscCall(DemModelGetState(dem, &s));
  n     = s.n;
  turns = s.dim == 3 ? 3 : 1;
  PetscCall(PetscArraycpy(old, s.v, 3 * n));
  PetscCall(PetscArraycpy(old + 3 * n, s.spin, turns * n));
  PetscCall(PetscArraycpy(old + 6 * n, s.f, 3 * n));
  PetscCall(PetscArraycpy(old + 9 * n, s.torque, turns * n));
  for (PetscInt k = 0; k < 3 * n; k++) s.v[k] *= keep;
  for (PetscInt k = 0; k < turns * n; k++) s.spin[k] *= keep;
  PetscCall(DemModelRestoreState(dem, &s)); /* s is empty now */
  PetscCall(DemModelAdvance(dem, t - dt, dt));
  PetscCall(DemModelGetState(dem, &s));
  for (PetscInt k = 0; k < s.dim * n; k++)
    if (k % n < s.own) lost += 0.5 * (1 - keep) * s.mass[k % n] * old[k] * (old[k] + s.v[k]);
  for (PetscInt k = 0; k < turns * n; k++)
    if (k % n < s.own) lost += 0.5 * (1 - keep) * s.inertia[k % n] * old[3 * n + k] * (old[3 * n + k] + s.spin[k]);
  PetscCall(DemModelRestoreState(dem, &s));
  PetscCall(SumRanks(model, 1, &lost));
  model->relaxed += lost;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rayleigh's sums of the particles' last motion. */
static PetscErrorCode AddSums(CouplingModel model, const PetscReal *old, FemRelax *sums)
{
  PetscReal all[2] = {0, 0}; /* change, moving */
  DemState  s;
  PetscInt  n, turns;

  PetscFunctionBegin;
  PetscCall(DemModelGetState(CouplingMoving(model), &s));
  n     = s.n;
  turns = s.dim == 3 ? 3 : 1;
  for (PetscInt k = 0; k < s.dim * n; k++) {
    if (k % n >= s.own) continue;
    all[0] += s.v[k] * (old[6 * n + k] - s.f[k]);
    all[1] += s.mass[k % n] * s.v[k] * s.v[k];
  }
  for (PetscInt k = 0; k < turns * n; k++) {
    if (k % n >= s.own) continue;
    all[0] += s.spin[k] * (old[9 * n + k] - s.torque[k]);
    all[1] += s.inertia[k % n] * s.spin[k] * s.spin[k];
  }
  PetscCall(DemModelRestoreState(CouplingMoving(model), &s));
  PetscCall(SumRanks(model, 2, all));
  sums->change += all[0];
  sums->moving += all[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean force out of balance over the largest mean force through bonds and elements so far: a body that has come apart is at rest too. */
static PetscErrorCode Balance(CouplingModel model, const FemRelax *sums, PetscReal *fem, PetscReal *dem)
{
  DemState  s;
  PetscReal net = 0, ratio;
  PetscInt  particles;

  PetscFunctionBegin;
  PetscCall(DemModelGetCounts(CouplingMoving(model), &particles, NULL, NULL));
  PetscCall(DemModelGetState(CouplingMoving(model), &s));
  for (PetscInt p = 0; p < s.own; p++) net += PetscSqrtReal(PetscSqr(s.f[p]) + PetscSqr(s.f[s.n + p]) + PetscSqr(s.f[2 * s.n + p])) / particles;
  PetscCall(DemModelRestoreState(CouplingMoving(model), &s));
  PetscCall(SumRanks(model, 1, &net));
  PetscCall(model->dem_stepper.unbalanced(CouplingMoving(model), &ratio));
  if (ratio > 0) model->through[1] = PetscMax(model->through[1], net / ratio);
  if (sums->all > 0) model->through[0] = PetscMax(model->through[0], sums->through / sums->all);
  *fem = model->through[0] > 0 && sums->free > 0 ? sums->left / sums->free / model->through[0] : 0;
  *dem = model->through[1] > 0 ? net / model->through[1] : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingRelax_Internal(CouplingModel model, PetscReal t, PetscReal h)
{
  const PetscReal dt   = model->limit;
  const PetscInt  ramp = (PetscInt)PetscCeilReal(CROSS * Extent(model) / (model->speed * dt));
  const PetscReal least = PetscSqr(0.1 / ramp); /* of (omega dt)^2: what is loose comes to rest too */
  PetscReal      *old, keep = 1, fem = 1, dem = 1;
  DemState        s;
  PetscInt        j;

  PetscFunctionBegin;
  model->reference = dt;
  if (model->dt != dt) PetscCall(CouplingStart_Internal(model, dt));
  PetscCall(CouplingForget_Internal(model));
  PetscCall(DemModelGetState(CouplingMoving(model), &s));
  PetscCall(PetscCalloc1(12 * s.n, &old));
  PetscCall(DemModelRestoreState(CouplingMoving(model), &s));
  PetscCall(FemModelFarLoad(model->fem, t, h, dt));
  for (j = 1; j <= MOST; j++) {
    const PetscReal share = PetscMin(1, (PetscReal)j / ramp);
    FemRelax        sums  = {0};
    PetscReal       square;

    PetscCall(FemModelFarRelax(model->fem, share, keep, &sums));
    PetscCall(MoveParticles(model, t + share * h, dt, keep, old));
    PetscCall(CouplingPull_Internal(model));
    PetscCall(CouplingForces_Internal(model));
    PetscCall(CouplingPush_Internal(model));
    PetscCall(DemModelEvaluate(CouplingMoving(model), dt));
    PetscCall(CouplingPullRim_Internal(model));
    PetscCall(CouplingGiveNodes_Internal(model));
    PetscCall(AddSums(model, old, &sums));
    square = sums.moving > 0 ? sums.change * dt / sums.moving : 0; /* (omega dt)^2 */
    square = PetscMin(1, PetscMax(square, least));
    keep   = (1 - PetscSqrtReal(square)) / (1 + PetscSqrtReal(square)); /* drag 2 omega */
    if (share < 1 || j % LOOK) continue;
    PetscCall(Balance(model, &sums, &fem, &dem));
    if (PetscMax(fem, dem) <= model->options.tolerance) break;
  }
  PetscCall(PetscFree(old));
  model->report.iterations += PetscMin(j, MOST);
  PetscCheck(j <= MOST, model->comm, PETSC_ERR_NOT_CONVERGED, "The load step to t = %.6g s did not come to rest in %d iterations: %.2g of the elements' forces is out of balance, %.2g of the particles' (coupling.tolerance %.2g); a body that breaks under a given load has no rest, give motions instead, or smaller steps",
             (double)(t + h), MOST, (double)fem, (double)dem, (double)model->options.tolerance);
  PetscCall(FemModelFarFinish(model->fem));
  PetscFunctionReturn(PETSC_SUCCESS);
}
