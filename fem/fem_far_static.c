/*
  fem_far_static.c - a far field that follows the elements near a coupling statically, while those relax.  Eqs (6.40)-(6.44)

  The far field's nodes but the face's are solved for; what it puts on the face is linear in the face's displacement u_f and in the
  loads, pull = b - S u_f. S and b come from one Cholesky factor of the far field with its face held: S once, condensed to a dense
  matrix of the face (or, where that is dearer, applied by a solve each time), b once for each load step. The near elements move by
  central differences under this pull with a drag the caller chooses, until forces balance.
*/
#include "fem_impl.h"

#define FACE_MOST 6000 /* unknowns of a dense face */

/* Is dof k solved for: the far field's alone and free? */
static inline PetscBool Inside(const FemModel model, PetscInt k)
{
  return model->inner.place[k / model->dim] < 0 && model->fixed[k] < 0 ? PETSC_TRUE : PETSC_FALSE;
}

/* Displacement u [n_own*dim] of the far field: in, its held and face dofs (zero on the rest); out, all, under the loads f (NULL: none). g = K u.  Eq. (6.40) */
static PetscErrorCode Equilibrium(FemModel model, const PetscReal *f, PetscReal *u, PetscReal *g)
{
  FemFar        *far = &model->far;
  const PetscInt n   = model->n_own * model->dim;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++)
    if (Inside(model, k)) u[k] = 0;
  PetscCall(FemApply(model, u, g));
  for (PetscInt k = 0; k < n; k++) far->a1[k] = Inside(model, k) ? (f ? f[k] : 0) - g[k] : 0;
  PetscCall(FemSolverSolveArray(model, far->a1, far->a1));
  for (PetscInt k = 0; k < n; k++)
    if (Inside(model, k)) u[k] = far->a1[k];
  PetscCall(FemApply(model, u, g));
  far->solves++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Condense(FemModel model)
{
  FemFar        *far = &model->far;
  const PetscInt n = model->n_own * model->dim, nf = far->n_face;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1((size_t)nf * nf, &far->S));
  for (PetscInt c = 0; c < nf; c++) {
    PetscCall(PetscArrayzero(far->u1, n));
    far->u1[far->face[c]] = 1;
    PetscCall(Equilibrium(model, NULL, far->u1, far->g1));
    for (PetscInt r = 0; r < nf; r++) far->S[(size_t)r * nf + c] = far->g1[far->face[r]];
  }
  for (PetscInt r = 0; r < nf; r++)
    for (PetscInt c = 0; c < r; c++) {
      const PetscReal both = 0.5 * (far->S[(size_t)r * nf + c] + far->S[(size_t)c * nf + r]);

      far->S[(size_t)r * nf + c] = far->S[(size_t)c * nf + r] = both;
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The far field's matrix, its face and the near nodes held; entries of the factor. */
static PetscErrorCode Factor(FemModel model, PetscReal *entries)
{
  const PetscInt n = model->n_own * model->dim;
  PetscInt      *fixed;
  PC             pc;
  Mat            factor;
  MatInfo        info;
  PetscBool      direct;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &fixed));
  PetscCall(PetscArraycpy(fixed, model->fixed, n));
  for (PetscInt k = 0; k < n; k++)
    if (model->inner.place[k / model->dim] >= 0) model->fixed[k] = 0; /* any number >= 0: held */
  PetscCall(FemSolverCreate(model, model->rows.value));
  PetscCall(PetscArraycpy(model->fixed, fixed, n));
  PetscCall(PetscFree(fixed));
  PetscCall(KSPSetUp(model->ksp));
  PetscCall(KSPGetPC(model->ksp, &pc));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCCHOLESKY, &direct));
  *entries = PETSC_MAX_REAL;
  if (!direct) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCFactorGetMatrix(pc, &factor));
  PetscCall(MatGetInfo(factor, MAT_LOCAL, &info));
  if (info.nz_used > 0) *entries = info.nz_used;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetFarStatic(FemModel model, const PetscBool near[], FemCondense condense, PetscReal *critical)
{
  FemFar        *far = &model->far;
  const PetscInt n   = model->n_own * model->dim;
  PetscReal      entries;

  PetscFunctionBegin;
  PetscCall(FemModelSetFar(model, near, 1, critical));
  BaseCheckInput(!model->absorb.n, model->comm, "%s: a static far field has no waves for a side to absorb; take absorb out", model->source);
  far->is_static = PETSC_TRUE;
  PetscCall(Factor(model, &entries));
  far->dense = (PetscBool)(condense == FEM_CONDENSE_ALWAYS || (condense == FEM_CONDENSE_AUTO && far->n_face <= FACE_MOST && PetscSqr((PetscReal)far->n_face) <= 2 * entries)); /* products of a face, of two triangles */
  far->factor_entries = entries;
  PetscCall(PetscCalloc5(2 * far->n_face, &far->b0, 2 * far->n_face, &far->b1, model->n_own, &far->relax_mass, 2 * n, &far->rest, far->n_face, &far->moved));
  if (far->dense) PetscCall(Condense(model));
  PetscCall(PetscArrayzero(far->u1, n));
  PetscCall(PetscArrayzero(model->v, n)); /* the run is a series of states at rest */
  model->initial = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Masses a relaxation of step dt moves: what the far field's stiffness on the face asks for is added, so that dt stays stable.  Eq. (6.42) */
static PetscErrorCode Masses(FemModel model, PetscReal dt)
{
  FemFar        *far = &model->far;
  const PetscInt dim = model->dim;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < model->n_own; i++) far->relax_mass[i] = far->near_mass[i];
  for (PetscInt i = 0; i < model->n_own; i++) {
    PetscReal most = 0;

    if (model->inner.place[i] < 0 || far->far_mass[i] == 0) continue;
    for (PetscInt d = 0; d < dim; d++) { /* S is no stiffer than the far elements on the face with all else held */
      PetscReal sum = 0;

      for (PetscInt b = model->rows.start[i]; b < model->rows.start[i + 1]; b++)
        for (PetscInt e = 0; e < dim; e++)
          if (model->inner.place[model->rows.col[b]] >= 0) sum += PetscAbsReal(model->rows.value[((size_t)b * dim + d) * dim + e]);
      most = PetscMax(most, sum);
    }
    far->relax_mass[i] += most * dt * dt / 3;
  }
  far->dt = dt;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  The far field under the supports and loads of time t, its face at rest: what they put on it, b = b_f + b_g, and their work along the way.  Eqs (6.41), (6.43)

  rest [2][n]: displacement, and K u less loads where motion is prescribed; rest and b of the time before become those at the step's begin.
*/
static PetscErrorCode AtRest(FemModel model, PetscReal t)
{
  FemFar        *far = &model->far;
  const PetscInt n = model->n_own * model->dim, nf = far->n_face;
  PetscReal     *u = far->rest, *reaction = far->rest + n, *old = far->v1; /* work */

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(far->b0, far->b1, 2 * nf));
  PetscCall(PetscArraycpy(old, u, n));
  far->along = 0;
  for (PetscInt i = 0; i < model->n_fixed_own; i++) far->along += 0.5 * reaction[model->fixed_dof[i]] * -u[model->fixed_dof[i]];
  PetscCall(PetscArrayzero(u, n));
  PetscCall(Equilibrium(model, far->f1, u, far->g1)); /* loads alone */
  for (PetscInt c = 0; c < nf; c++) far->b1[c] = -far->g1[far->face[c]];
  PetscCall(PetscArrayzero(far->u1, n));
  for (PetscInt i = 0; i < model->n_fixed_own; i++) {
    const PetscInt k = model->fixed_dof[i];

    if (far->far_mass[k / model->dim] > 0) far->u1[k] = FemFixPosition(&model->fix[model->fixed[k]], t);
  }
  for (PetscInt k = 0; k < n; k++) far->a[k] = far->g1[k];
  PetscCall(Equilibrium(model, NULL, far->u1, far->g1)); /* supports alone */
  for (PetscInt c = 0; c < nf; c++) far->b1[nf + c] = -far->g1[far->face[c]];
  for (PetscInt k = 0; k < n; k++) u[k] += far->u1[k];
  for (PetscInt i = 0; i < model->n_fixed_own; i++) {
    const PetscInt k = model->fixed_dof[i];
    const PetscReal was = reaction[k];

    reaction[k] = far->far_mass[k / model->dim] > 0 ? far->a[k] + far->g1[k] - (model->inner.place[k / model->dim] < 0 ? far->f1[k] : 0) : 0;
    far->along += 0.5 * (reaction[k] * (u[k] - old[k]) + was * u[k]);
  }
  for (PetscInt k = 0; k < n; k++)
    if (model->inner.place[k / model->dim] < 0) far->along += 0.5 * (far->f0[k] + far->f1[k]) * (u[k] - old[k]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A load step from t to t + h begins: loads and supports at its end, and what they put on a face that stays at rest.  Eq. (6.41) */
PetscErrorCode FemModelFarLoad(FemModel model, PetscReal t, PetscReal h, PetscReal dt)
{
  FemFar        *far = &model->far;
  const PetscInt n   = model->n_own * model->dim;

  PetscFunctionBegin;
  PetscCheck(far->is_static && !model->lent, model->comm, PETSC_ERR_ORDER, "Call FemModelSetFarStatic() and give the state back before a load step");
  if (far->dt != dt) PetscCall(Masses(model, dt));
  if (model->started) PetscCall(PetscArraycpy(far->f0, model->f_app, n));
  else PetscCall(PetscArrayzero(far->f0, n)); /* loads grow from nothing during the first step */
  PetscCall(FemLoadsAt(model, t + h));
  PetscCall(PetscArraycpy(far->f1, model->f_app, n));
  PetscCall(AtRest(model, t + h));
  far->from  = model->started ? t : 0;
  far->to    = t + h;
  far->share = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the far field puts on the face, when s of the step's load is there.  Eq. (6.41) */
static PetscErrorCode Pull(FemModel model, PetscReal s)
{
  FemFar        *far = &model->far;
  const PetscInt n = model->n_own * model->dim, nf = far->n_face;

  PetscFunctionBegin;
  if (far->dense) {
#pragma omp parallel for schedule(static) num_threads(model->threads)
    for (PetscInt r = 0; r < nf; r++) {
      PetscReal sum = 0;

      for (PetscInt c = 0; c < nf; c++) sum += far->S[(size_t)r * nf + c] * model->u[far->face[c]];
      far->lambda[r] = (1 - s) * (far->b0[r] + far->b0[nf + r]) + s * (far->b1[r] + far->b1[nf + r]) - sum;
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscArrayzero(far->u1, n));
  for (PetscInt c = 0; c < nf; c++) far->u1[far->face[c]] = model->u[far->face[c]];
  PetscCall(Equilibrium(model, NULL, far->u1, far->g1));
  for (PetscInt c = 0; c < nf; c++) far->lambda[c] = (1 - s) * (far->b0[c] + far->b0[nf + c]) + s * (far->b1[c] + far->b1[nf + c]) - far->g1[far->face[c]];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One step dt of the near nodes at the share s of the load, velocities kept by `keep`; f_ext is the caller's. */
PetscErrorCode FemModelFarRelax(FemModel model, PetscReal s, PetscReal keep, FemRelax *sums)
{
  FemFar         *far = &model->far;
  const FemInner *in  = &model->inner;
  const PetscInt  dim = model->dim;
  const PetscInt  nf  = far->n_face;
  const PetscReal dt  = far->dt, t = (1 - s) * far->from + s * far->to;
  PetscReal       work = 0;

  PetscFunctionBegin;
  PetscCall(Pull(model, s));
  for (PetscInt c = 0; c < far->n_face; c++) far->pull[far->face[c]] = far->lambda[c];
  for (PetscInt j = 0; j < in->n; j++)
    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt  k = in->node[j] * dim + d;
      const PetscBool held = model->fixed[k] >= 0 ? PETSC_TRUE : PETSC_FALSE;
      const PetscReal applied = (1 - s) * far->f0[k] + s * far->f1[k], force = applied + model->f_ext[k] + far->pull[k] - in->fast[j * dim + d], m = far->relax_mass[in->node[j]], v = model->v[k];
      const PetscReal at = held ? FemFixPosition(&model->fix[model->fixed[k]], t) : 0, next = held ? (at - model->u[k]) / dt : keep * v + dt * force / m, mean = 0.5 * (v + next);

      work += dt * mean * (applied - (held ? force : 0));
      if (!held) {
        const PetscReal lost = (1 - keep) * m * v * mean;

        model->damping += lost;
        sums->change += v * (far->was[k] - force); /* K over the last step, times it */
        sums->moving += m * v * v;
        sums->left += PetscAbsReal(force);
        sums->free += 1;
      }
      far->was[k] = force;
      sums->through += PetscAbsReal(in->fast[j * dim + d]);
      sums->all += 1;
      model->v[k] = model->v_next[k] = next;
      model->u[k] = held ? at : model->u[k] + dt * next;
    }
  /* work of loads and supports on the far field: f.du = b_f.du_f, R.dg = -u_f.db_g, and what they do with the face at rest */
  for (PetscInt c = 0; c < nf; c++) {
    const PetscInt  k = far->face[c];
    const PetscReal ahead = dt * model->v[k], load = (1 - s) * far->b0[c] + s * far->b1[c];

    work += 0.5 * load * (far->moved[c] + ahead) - (s - far->share) * (model->u[k] - ahead - 0.5 * far->moved[c]) * (far->b1[nf + c] - far->b0[nf + c]);
    far->moved[c] = ahead;
  }
  work += (s - far->share) * far->along;
  far->share = s;
  model->work += work;
  model->work_in += PetscAbsReal(work);
  model->started = PETSC_TRUE;
  model->dt_last = dt;
  model->t       = t;
  PetscCall(PetscArrayzero(model->f_ext, model->n_own * dim));
  FemInnerTimes(model, model->u, in->fast);
  far->closed        = PETSC_FALSE;
  model->level_known = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The far field at the end of the load step.  Eq. (6.40) */
PetscErrorCode FemModelFarFinish(FemModel model)
{
  FemFar         *far = &model->far;
  const FemInner *in  = &model->inner;
  const PetscInt  dim = model->dim, n = model->n_own * dim;
  const PetscReal h   = far->to - far->from;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(far->u1, n));
  for (PetscInt c = 0; c < far->n_face; c++) far->u1[far->face[c]] = model->u[far->face[c]];
  for (PetscInt i = 0; i < model->n_fixed_own; i++) {
    const PetscInt k = model->fixed_dof[i];

    if (far->far_mass[k / dim] > 0) far->u1[k] = FemFixPosition(&model->fix[model->fixed[k]], far->to);
  }
  PetscCall(Equilibrium(model, far->f1, far->u1, far->g1));
  PetscCall(PetscArraycpy(far->u, far->u1, n));
  PetscCall(PetscArraycpy(far->g, far->g1, n));
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt j = in->place[k / dim];

    if (j < 0) {
      model->v[k] = model->v_next[k] = h > 0 ? (far->u[k] - model->u[k]) / h : 0;
      model->u[k] = far->u[k];
    }
    model->f_int[k] = far->g[k] + (j < 0 ? 0 : in->fast[j * dim + k % dim]);
    model->reaction[k] = 0;
  }
  model->t    = far->to;
  far->closed = PETSC_TRUE;
  far->k      = far->m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reactions of the present state, which is at rest. */
PetscErrorCode FemFarStaticLevel(FemModel model)
{
  FemFar         *far = &model->far;
  const PetscInt  dim = model->dim;

  PetscFunctionBegin;
  if (model->level_known) PetscFunctionReturn(PETSC_SUCCESS);
  far->kinetic = 0;
  for (PetscInt j = 0; j < model->inner.n; j++)
    for (PetscInt d = 0; d < dim; d++) far->kinetic += 0.5 * far->relax_mass[model->inner.node[j]] * PetscSqr(model->v[model->inner.node[j] * dim + d]);
  for (PetscInt i = 0; i < model->n_fixed_own; i++) {
    const PetscInt k = model->fixed_dof[i];

    model->reaction[k] = model->f_int[k] - model->f_app[k] - (model->inner.place[k / dim] >= 0 ? model->f_ext[k] : 0);
  }
  model->level_known = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
