/*
  dem_step.c - one step: kick with the forces at hand, drift, forces of the new state.  Eqs (1.1), (5.1)-(5.4)

  Velocities live at half steps. Every conservative force then closes the ledger to round-off in a linear system, with
  the kinetic energy 1/2 m v(n-1/2) v(n+1/2) and work by the trapezoid.
*/
#include "dem_impl.h"

/* Non-viscous local damping takes alpha |F| against the motion.  Eq. (5.3) */
static inline PetscReal Damping(PetscReal alpha, PetscReal force, PetscReal velocity)
{
  return alpha * PetscAbsReal(force) * (velocity > 0 ? 1 : velocity < 0 ? -1 : 0);
}

/* Kick component arrays; returns what damping took with the mean velocity [J]. */
static PetscReal Kick(PetscInt first, PetscInt last, PetscReal dt, PetscReal alpha, const PetscReal *mass, const PetscReal *force, PetscReal *velocity)
{
  PetscReal lost = 0;

  if (alpha == 0) {
    for (PetscInt p = first; p < last; p++) velocity[p] += dt / mass[p] * force[p];
    return 0;
  }
  for (PetscInt p = first; p < last; p++) {
    const PetscReal drag = Damping(alpha, force[p], velocity[p]), old = velocity[p];

    velocity[p] += dt / mass[p] * (force[p] - drag);
    lost += drag * 0.5 * (old + velocity[p]) * dt;
  }
  return lost;
}

/* Turn the quaternions by spin dt, exactly.  Eq. (5.2) */
static void Turn3(PetscInt n, PetscInt first, PetscInt last, PetscReal dt, const PetscReal *spin, PetscReal *rot)
{
#pragma omp simd
  for (PetscInt p = first; p < last; p++) {
    const PetscReal hx = 0.5 * dt * spin[p], hy = 0.5 * dt * spin[n + p], hz = 0.5 * dt * spin[2 * n + p], h2 = hx * hx + hy * hy + hz * hz;
    /* cos h and sin h / h; the series is exact to the last bit for the steps we take (h < 0.05 rad). Beyond, the norm is mended below. */
    const PetscReal c = 1 - h2 * (0.5 - h2 * (1.0 / 24 - h2 * (1.0 / 720 - h2 / 40320))), s = 1 - h2 * (1.0 / 6 - h2 * (1.0 / 120 - h2 * (1.0 / 5040 - h2 / 362880)));
    const PetscReal ax = s * hx, ay = s * hy, az = s * hz, w = rot[p], x = rot[n + p], y = rot[2 * n + p], z = rot[3 * n + p];
    PetscReal       nw = c * w - ax * x - ay * y - az * z, nx = c * x + ax * w + ay * z - az * y, ny = c * y + ay * w + az * x - ax * z, nz = c * z + az * w + ax * y - ay * x;
    const PetscReal mend = 1.5 - 0.5 * (nw * nw + nx * nx + ny * ny + nz * nz);

    rot[p]         = nw * mend;
    rot[n + p]     = nx * mend;
    rot[2 * n + p] = ny * mend;
    rot[3 * n + p] = nz * mend;
  }
}

/* sin and cos - 1 of the angle, advanced by the small turn: small angles keep all their digits. */
static void Turn2(PetscInt n, PetscInt first, PetscInt last, PetscReal dt, const PetscReal *spin, PetscReal *rot)
{
#pragma omp simd
  for (PetscInt p = first; p < last; p++) {
    const PetscReal a = dt * spin[p], a2 = a * a, s = rot[p], c1 = rot[n + p];
    const PetscReal da = a * (1 - a2 * (1.0 / 6 - a2 * (1.0 / 120 - a2 * (1.0 / 5040 - a2 / 362880)))), ca = -a2 * (0.5 - a2 * (1.0 / 24 - a2 * (1.0 / 720 - a2 / 40320)));
    PetscReal       ns = s + s * ca + da + c1 * da, nc = c1 + ca + c1 * ca - s * da;
    const PetscReal off = 0.5 * (ns * ns + 2 * nc + nc * nc);

    rot[p]         = ns - ns * off;
    rot[n + p]     = nc - (1 + nc) * off;
    rot[2 * n + p] += a;
  }
}

PetscErrorCode DemModelAdvance(DemModel model, PetscReal t, PetscReal dt)
{
  const DemBlocks *blocks = &model->blocks;
  const PetscReal  kick = model->started ? dt : 0.5 * dt; /* velocities start at t = 0, and move to the first half step */
  PetscInt         n;

  PetscFunctionBegin;
  if (model->ranks) PetscCall(DemLookAtShares_Internal(model));
  PetscCall(DemPressureLook_Internal(model));
  n = model->n;
  if (model->walls.n) {
    PetscReal *swap = model->traction_old;

    if (!model->started) {
      DemFacesReactions_Internal(model);
      (void)DemTractionWork_Internal(model, NULL, model->traction_new);
    }
    model->traction_old = model->traction_new;
    model->traction_new = swap;
  }
#pragma omp parallel for schedule(static) num_threads((int)model->threads)
  for (PetscInt b = 0; b < blocks->n_blocks; b++) {
    const PetscInt first = blocks->first[b], last = blocks->first[b + 1];
    PetscReal      lost = 0;

    for (PetscInt d = 0; d < model->dim; d++) {
      PetscReal *u = model->u + d * n, *v = model->v + d * n;

      lost += Kick(first, last, kick, model->alpha, model->mass, model->f + d * n, v);
      for (PetscInt p = first; p < last; p++) u[p] += dt * v[p];
    }
    for (PetscInt d = 0; d < model->nrot; d++) lost += Kick(first, last, kick, model->alpha, model->inertia, model->torque + d * n, model->spin + d * n);
    if (model->dim == 3) Turn3(n, first, last, dt, model->spin, model->rot);
    else Turn2(n, first, last, dt, model->spin, model->rot);
    model->block_sum[b] = lost;
  }
  for (PetscInt b = 0; b < blocks->n_blocks; b++) model->damped += model->block_sum[b];
  DemClumpsAdvance_Internal(model, kick, dt); /* its spheres go where it goes, wherever they were just put */
  if (model->n_tools) PetscCall(DemToolsAdvance_Internal(model, t, kick, dt));
  model->started = PETSC_TRUE;
  model->dt_last = dt;
  model->time    = t + dt;

  for (PetscInt k = 0; k < model->n_faces; k++)
    for (PetscInt d = 0; d < model->dim; d++) {
      model->face[k].shift_old[d]    = model->face[k].shift[d];
      model->face[k].reaction_old[d] = model->face[k].reaction[d];
    }
  DemFacesSetTime_Internal(model, model->time);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Work of supports and loads since the last state, by the forces at hand. */
PetscErrorCode DemBook_Internal(DemModel model)
{
  PetscReal work = 0;

  PetscFunctionBegin;
  if (model->walls.n) {
    DemFacesReactions_Internal(model);
    for (PetscInt k = 0; k < model->n_faces; k++)
      for (PetscInt d = 0; d < model->dim; d++) work += 0.5 * (model->face[k].reaction[d] + model->face[k].reaction_old[d]) * (model->face[k].shift[d] - model->face[k].shift_old[d]);
    work += DemTractionWork_Internal(model, model->traction_old, model->traction_new);
  }
  if (model->ranks) {
    if (model->ranks->walls) PetscCall(DemRanksWork_Internal(model, work));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  model->work += work;
  model->work_in += PetscAbsReal(work);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelEvaluate(DemModel model, PetscReal dt)
{
  PetscFunctionBegin;
  if (model->rain.rate > 0) PetscCall(DemRainFall_Internal(model));
  PetscCall(DemForces_Internal(model, DEM_WITH_LOADS | DEM_WITH_FAILURE));
  if (model->contacts.on) PetscCall(DemContactsForce_Internal(model, dt));
  if (model->n_tools) PetscCall(DemToolsForce_Internal(model, dt));
  if (model->contacts.n_gone) DemContactsStill_Internal(model);
  DemClumpsGather_Internal(model);
  PetscCall(DemBook_Internal(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemStep_Internal(void *ctx, PetscReal t, PetscReal dt)
{
  PetscFunctionBegin;
  PetscCall(DemModelAdvance(ctx, t, dt));
  PetscCall(DemModelEvaluate(ctx, dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 1/2 m v(n-1/2) v(n+1/2) summed [J], and the half step of damping the ledger is due at this instant [J].  Eq. (1.2) */
PetscErrorCode DemKineticEnergy_Internal(DemModel model, PetscReal *kinetic, PetscReal *damping_due)
{
  const PetscInt  n = model->n;
  const PetscReal dt = model->started ? model->dt_last : 0;
  PetscReal       sum = 0, due = 0, weight = 0, all[2];

  PetscFunctionBegin;
  DemClumpsEnergy_Internal(model, &sum, &weight);
  for (PetscInt d = 0; d < model->dim; d++)
    for (PetscInt p = 0; p < model->own; p++) {
      const PetscReal v = model->v[d * n + p], f = model->f[d * n + p], drag = Damping(model->alpha, f, v);

      if (DemInClump(model, p)) continue;
      sum += 0.5 * model->mass[p] * v * (v + dt / model->mass[p] * (f - drag));
      due += 0.5 * dt * drag * v;
    }
  for (PetscInt d = 0; d < model->nrot; d++)
    for (PetscInt p = 0; p < model->own; p++) {
      const PetscReal v = model->spin[d * n + p], f = model->torque[d * n + p], drag = Damping(model->alpha, f, v);

      if (DemInClump(model, p)) continue;
      sum += 0.5 * model->inertia[p] * v * (v + dt / model->inertia[p] * (f - drag));
      due += 0.5 * dt * drag * v;
    }
  all[0] = sum;
  all[1] = due;
  PetscCall(DemSumRanks_Internal(model, 2, all));
  *kinetic     = all[0];
  *damping_due = all[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}
