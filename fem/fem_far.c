/*
  fem_far.c - a far field that goes by Newmark's average acceleration while the elements near a coupling go by central differences.
  Gravouil and Combescure.  Eqs (6.20)-(6.28)

  The nodes between (the face) exist twice. Near copy and far copy of a face dof have the same velocity at the end of every step
  dt of the near side; the force that sees to it, lambda, is the multiplier of that condition. The far field takes one step
  H = m dt: first as if lambda were not there (the free step), which gives the near side a velocity to follow, linear in between;
  then lambda of the last instant completes it (the link). Of the whole factor only the face is needed in between:

      (G + Y) lambda_j = v_free(t_j) - v_near,free,    Y = H/2 L Mt^-1 L',  Mt = M + H/2 C + H^2/4 K,  G = dt/2 L M_near^-1 L'

  solved by the stored inverse of G + Y, symmetric and positive. Both steps are stable by themselves, and so is the pair.
*/
#include "fem_impl.h"
#include <petscblaslapack.h>

#define FACE_MOST 6000 /* unknowns of the face: 2 x 8 n^2 bytes, 0.6 GB */

void FemFarSame(FemModel model)
{
  for (PetscInt k = 0; k < model->n_own * model->dim; k++) model->far.u[k] = model->far.far_mass[k / model->dim] > 0 ? model->u[k] : 0;
}

/* Forces of the present level: near copy at model->u, far copy at far.u. */
PetscErrorCode FemFarForces(FemModel model)
{
  FemFar         *far = &model->far;
  const FemInner *in  = &model->inner;
  const PetscInt  dim = model->dim;

  PetscFunctionBegin;
  FemInnerTimes(model, model->u, in->fast);
  PetscCall(FemApply(model, far->u, far->g));
  PetscCall(PetscArraycpy(model->f_int, far->g, model->n_own * dim));
  for (PetscInt j = 0; j < in->n; j++)
    for (PetscInt d = 0; d < dim; d++) model->f_int[in->node[j] * dim + d] += in->fast[j * dim + d];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The near elements without the far ones, for a trial of their energy: slow is zero. */
PetscErrorCode FemFarTrial(FemModel model, const PetscReal *u, PetscReal *slow, PetscReal *fast, PetscReal *mobility)
{
  const FemFar   *far = &model->far;
  const FemInner *in  = &model->inner;
  const PetscInt  dim = model->dim, n = model->n_own * dim;

  PetscFunctionBegin;
  FemInnerTimes(model, u, in->net);
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt j = in->place[k / dim];

    slow[k]     = 0;
    fast[k]     = j >= 0 ? -in->net[j * dim + k % dim] : 0;
    mobility[k] = j < 0 || model->fixed[k] >= 0 ? 0 : 1 / far->near_mass[k / dim];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Half of a velocity that a unit of force puts on each near face dof at the middle of its kick. */
static PetscReal NearGain(const FemModel model, PetscInt dof, PetscReal h)
{
  return 0.5 * h / (1 + 0.5 * model->alpha * h) / model->far.near_mass[dof / model->dim];
}

/* The matrix of the far field's step H, and the inverse of the face's own.  Eqs (6.22), (6.24) */
static PetscErrorCode Factor(FemModel model, PetscReal dt)
{
  FemFar         *far = &model->far;
  const FemRows  *rows = &model->rows;
  const PetscInt  dim = model->dim, n = model->n_own * dim, nf = far->n_face;
  const PetscReal H = far->m * dt;
  const size_t    entries = (size_t)rows->start[model->n_own] * dim * dim;
  PetscReal      *value, *x, largest = 0;
  PetscBLASInt    size, info;

  PetscFunctionBegin;
  PetscCall(FemSolverDestroy(model));
  PetscCall(PetscMalloc2(entries, &value, n, &x));
  for (size_t k = 0; k < entries; k++) value[k] = 0.25 * H * H * rows->value[k];
  for (PetscInt i = 0; i < model->n_own; i++)
    for (PetscInt d = 0; d < dim; d++) {
      PetscReal *diagonal = &value[((size_t)FemRowsColumn(model, i, i) * dim + d) * dim + d];

      *diagonal += far->far_mass[i] * (1 + 0.5 * H * model->alpha);
      largest = PetscMax(largest, *diagonal);
    }
  FemAbsorbAddToRows(model, 0.5 * H, value);
  for (PetscInt i = 0; i < model->n_own; i++)
    for (PetscInt d = 0; d < dim && far->far_mass[i] == 0; d++) value[((size_t)FemRowsColumn(model, i, i) * dim + d) * dim + d] = largest; /* near nodes: rows of their own */
  PetscCall(FemSolverCreate(model, value));
  for (PetscInt c = 0; c < nf; c++) {
    PetscCall(PetscArrayzero(x, n));
    x[far->face[c]] = 1;
    PetscCall(FemSolverSolveArray(model, x, x));
    for (PetscInt r = 0; r < nf; r++) far->Y[(size_t)r * nf + c] = 0.5 * H * x[far->face[r]];
  }
  for (PetscInt r = 0; r < nf; r++)
    for (PetscInt c = 0; c <= r; c++) {
      const PetscReal both = 0.5 * (far->Y[(size_t)r * nf + c] + far->Y[(size_t)c * nf + r]);

      far->Y[(size_t)r * nf + c] = far->Y[(size_t)c * nf + r] = both;
    }
  PetscCall(PetscArraycpy(far->inverse, far->Y, (size_t)nf * nf));
  for (PetscInt r = 0; r < nf; r++) far->inverse[(size_t)r * nf + r] += NearGain(model, far->face[r], dt);
  PetscCall(PetscBLASIntCast(nf, &size));
  PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &size, far->inverse, &size, &info));
  PetscCheck(!info, model->comm, PETSC_ERR_LIB, "The face's matrix is not positive (LAPACK potrf returned %d)", (int)info);
  PetscCallBLAS("LAPACKpotri", LAPACKpotri_("L", &size, far->inverse, &size, &info));
  PetscCheck(!info, model->comm, PETSC_ERR_LIB, "LAPACK potri returned %d", (int)info);
  for (PetscInt r = 0; r < nf; r++) /* column-major "L" is our upper half */
    for (PetscInt c = 0; c < r; c++) far->inverse[(size_t)r * nf + c] = far->inverse[(size_t)c * nf + r];
  PetscCall(PetscFree2(value, x));
  far->dt = dt;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y [n] = A x, rows each in their own order: the same bits for any number of threads */
static void DenseTimes(const FemModel model, PetscInt n, const PetscReal *A, const PetscReal *x, PetscReal *y)
{
#pragma omp parallel for schedule(static) num_threads(model->threads)
  for (PetscInt r = 0; r < n; r++) {
    PetscReal sum = 0;

    for (PetscInt c = 0; c < n; c++) sum += A[(size_t)r * n + c] * x[c];
    y[r] = sum;
  }
}

/* lambda of the present level, the j-th of the far field's step.  Eq. (6.23) */
static void Multiplier(FemModel model, PetscReal dt, PetscInt j)
{
  FemFar         *far = &model->far;
  const FemInner *in  = &model->inner;
  const PetscInt  dim = model->dim;
  const PetscReal keep = (1 - 0.5 * model->alpha * dt) / (1 + 0.5 * model->alpha * dt), s = (PetscReal)j / far->m;

  for (PetscInt c = 0; c < far->n_face; c++) {
    const PetscInt  k = far->face[c], near = in->place[k / dim] * dim + k % dim;
    const PetscReal force = model->f_app[k] + model->f_ext[k] - in->fast[near];

    far->right[c] = (1 - s) * far->free[0][c] + s * far->free[1][c] - 0.5 * (1 + keep) * model->v[k] - NearGain(model, k, dt) * force;
  }
  DenseTimes(model, far->n_face, far->inverse, far->right, far->lambda);
}

/* The face at t = 0: equal accelerations; and the far field's own.  Eq. (6.26) */
static PetscErrorCode Start(FemModel model)
{
  FemFar         *far = &model->far;
  const FemInner *in  = &model->inner;
  const PetscInt  dim = model->dim, n = model->n_own * dim;
  PetscReal      *drag;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n, &drag));
  FemAbsorbTimes(model, model->v, drag);
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal M = far->far_mass[k / dim];
    const PetscBool near = in->place[k / dim] >= 0 ? PETSC_TRUE : PETSC_FALSE;

    far->v[k] = M > 0 ? model->v[k] : 0;
    far->a[k] = M > 0 && model->fixed[k] < 0 ? ((near ? 0 : model->f_app[k]) - far->g[k] - drag[k]) / M - model->alpha * model->v[k] : 0;
  }
  for (PetscInt c = 0; c < far->n_face; c++) {
    const PetscInt  k = far->face[c], near = in->place[k / dim] * dim + k % dim;
    const PetscReal m = far->near_mass[k / dim], M = far->far_mass[k / dim], a = (model->f_app[k] + model->f_ext[k] - in->fast[near]) / m - model->alpha * model->v[k];

    far->lambda[c] = (far->a[k] - a) / (1 / m + 1 / M);
    far->a[k] -= far->lambda[c] / M;
  }
  PetscCall(PetscFree(drag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The far field's next step as if nothing pulled at its face.  Eqs (6.20), (6.21) */
static PetscErrorCode Predict(FemModel model, PetscReal t, PetscReal H)
{
  FemFar         *far = &model->far;
  const PetscInt  dim = model->dim, n = model->n_own * dim;
  PetscReal      *b;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &b));
  PetscCall(PetscArraycpy(far->f0, model->f_app, n));
  PetscCall(FemLoadsAt(model, t + H));
  PetscCall(PetscArraycpy(far->f1, model->f_app, n));
  PetscCall(FemLoadsAt(model, t));
  for (PetscInt k = 0; k < n; k++) {
    if (model->inner.place[k / dim] >= 0) far->f0[k] = far->f1[k] = 0; /* the near side's */
    far->u1[k] = far->u[k] + H * far->v[k] + 0.25 * H * H * far->a[k];
    far->v1[k] = far->v[k] + 0.5 * H * far->a[k];
    far->a1[k] = 0;
    if (model->fixed[k] >= 0 && far->far_mass[k / dim] > 0) { /* eq. (2.54) */
      const FemFix   *fix = &model->fix[model->fixed[k]];
      const PetscReal at = FemFixPosition(fix, t + H), before = FemFixPosition(fix, t), after = FemFixPosition(fix, t + 2 * H);

      far->u1[k] = at;
      far->v1[k] = (after - before) / (2 * H);
      far->a1[k] = ((after - at) - (at - before)) / (H * H);
    }
  }
  PetscCall(FemApply(model, far->u1, b));
  for (PetscInt k = 0; k < n; k++) b[k] = -b[k];
  for (PetscInt j = 0; j < model->absorb.n; j++)
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt e = 0; e < dim; e++) b[model->absorb.node[j] * dim + i] -= model->absorb.block[(j * dim + i) * dim + e] * far->v1[model->absorb.node[j] * dim + e];
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal M = far->far_mass[k / dim];

    b[k] = M == 0 || model->fixed[k] >= 0 ? 0 : b[k] + far->f1[k] - model->alpha * M * far->v1[k];
  }
  PetscCall(FemSolverSolveArray(model, b, b));
  for (PetscInt k = 0; k < n; k++) {
    if (far->far_mass[k / dim] == 0 || model->fixed[k] >= 0) continue;
    far->a1[k] = b[k];
    far->v1[k] += 0.5 * H * b[k];
    far->u1[k] += 0.25 * H * H * b[k];
  }
  DenseTimes(model, far->n_face, far->Y, far->lambda, far->right);
  for (PetscInt c = 0; c < far->n_face; c++) {
    far->free[0][c] = far->v[far->face[c]] + far->right[c]; /* free at the start too: with the linked velocity energy would grow */
    far->free[1][c] = far->v1[far->face[c]];
    far->lambda0[c] = far->lambda[c];
  }
  PetscCall(PetscFree(b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Work and damping of the far field's step, every force at mid-step times its motion; the link's on its face.  As (2.55)-(2.57) */
static void Book(FemModel model, PetscReal H)
{
  FemFar         *far = &model->far;
  const PetscInt  dim = model->dim, n = model->n_own * dim;
  PetscReal       work = 0, damping = 0, link = 0;

  for (PetscInt j = 0; j < model->absorb.n; j++)
    for (PetscInt i = 0; i < dim; i++) {
      const PetscInt k = model->absorb.node[j] * dim + i;
      PetscReal      drag = 0;

      for (PetscInt e = 0; e < dim; e++) drag += model->absorb.block[(j * dim + i) * dim + e] * 0.5 * (far->v[k - i + e] + far->v1[k - i + e]);
      damping += drag * (far->u1[k] - far->u[k]);
      if (model->fixed[k] >= 0) work += drag * (far->u1[k] - far->u[k]);
    }
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal M = far->far_mass[k / dim], du = far->u1[k] - far->u[k], load = 0.5 * (far->f0[k] + far->f1[k]), drag = model->alpha * M * 0.5 * (far->v[k] + far->v1[k]);

    if (M == 0) continue;
    work += load * du;
    damping += drag * du;
    if (model->fixed[k] < 0) continue;
    work += (M * 0.5 * (far->a[k] + far->a1[k]) + drag + 0.5 * (far->g[k] + far->g1[k]) - load) * du;
    /* what the scheme's own kinematics miss of a prescribed motion, eq. (2.57) */
    work += M * ((far->v1[k] - far->v[k] - 0.5 * H * (far->a[k] + far->a1[k])) * du - (du - 0.5 * H * (far->v[k] + far->v1[k])) * (far->v1[k] - far->v[k])) / H;
  }
  for (PetscInt c = 0; c < far->n_face; c++) link -= 0.5 * (far->lambda0[c] + far->lambda[c]) * (far->u1[far->face[c]] - far->u[far->face[c]]);
  model->work += work;
  model->work_in += PetscAbsReal(work);
  model->damping += damping;
  far->link += link;
}

/* Completes the far field's step that ends at the present level. Nothing changes when it is asked for twice.  Eq. (6.25) */
static PetscErrorCode Close(FemModel model)
{
  FemFar         *far = &model->far;
  const FemInner *in  = &model->inner;
  const PetscInt  dim = model->dim, n = model->n_own * dim;
  const PetscReal H   = far->m * far->dt;
  PetscReal      *w;

  PetscFunctionBegin;
  if (far->closed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(far->k == far->m, model->comm, PETSC_ERR_ORDER, "The far field is between its steps; energies, history and frames belong to their ends");
  Multiplier(model, far->dt, far->m);
  PetscCall(PetscCalloc1(n, &w));
  for (PetscInt c = 0; c < far->n_face; c++) w[far->face[c]] = -far->lambda[c];
  PetscCall(FemSolverSolveArray(model, w, w));
  for (PetscInt k = 0; k < n; k++) {
    if (far->far_mass[k / dim] == 0 || model->fixed[k] >= 0) continue;
    far->a1[k] += w[k];
    far->v1[k] += 0.5 * H * w[k];
    far->u1[k] += 0.25 * H * H * w[k];
  }
  PetscCall(PetscFree(w));
  PetscCall(FemApply(model, far->u1, far->g1));
  Book(model, H);
  PetscCall(PetscArraycpy(far->u, far->u1, n));
  PetscCall(PetscArraycpy(far->v, far->v1, n));
  PetscCall(PetscArraycpy(far->a, far->a1, n));
  PetscCall(PetscArraycpy(far->g, far->g1, n));
  far->apart = 0;
  for (PetscInt k = 0; k < n; k++) {
    if (in->place[k / dim] < 0) {
      model->u[k] = far->u[k];
      model->v[k] = model->v_next[k] = far->v[k];
    } else if (far->far_mass[k / dim] > 0) far->apart = PetscMax(far->apart, PetscAbsReal(model->u[k] - far->u[k]));
    model->f_int[k] = far->g[k] + (in->place[k / dim] < 0 ? 0 : in->fast[in->place[k / dim] * dim + k % dim]);
  }
  far->closed        = PETSC_TRUE;
  model->level_known = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The near copy's level with lambda known: coming velocity, reactions, energies.  Eqs (2.17)-(2.20) */
static PetscErrorCode NearLevel(FemModel model, PetscReal dt)
{
  FemFar         *far = &model->far;
  const FemInner *in  = &model->inner;
  const PetscInt  dim = model->dim;
  const PetscReal before = model->started ? 0.5 * model->dt_last : 0, after = 0.5 * dt, h = before + after, alpha = model->alpha;
  const PetscReal keep = model->started ? (1 - 0.5 * alpha * h) / (1 + 0.5 * alpha * h) : 1 - alpha * h, gain = model->started ? h / (1 + 0.5 * alpha * h) : h;
  PetscReal      *place, s[6] = {0, 0, 0, 0, 0, 0};

  PetscFunctionBegin;
  if (model->level_known && model->level_dt == dt) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(model->n_fixes, &place));
  for (PetscInt k = 0; k < model->n_fixes; k++) place[k] = FemFixPosition(&model->fix[k], model->t + dt);
  for (PetscInt c = 0; c < far->n_face; c++) far->pull[far->face[c]] = far->lambda[c];
  far->kinetic = 0;
  for (PetscInt j = 0; j < in->n; j++)
    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt  k = in->node[j] * dim + d;
      const PetscBool held = model->fixed[k] >= 0 ? PETSC_TRUE : PETSC_FALSE;
      const PetscReal m = far->near_mass[in->node[j]], v = model->v[k], force = model->f_app[k] + model->f_ext[k] + far->pull[k] - in->fast[j * dim + d];
      PetscReal       next = keep * v + gain * force / m, drag, applied = model->f_app[k], move[2];

      if (held) next = dt > 0 ? (place[model->fixed[k]] - model->u[k]) / dt : v;
      drag               = alpha * m * (model->started ? 0.5 * (v + next) : v);
      model->reaction[k] = 0;
      if (held) {
        model->reaction[k] = (h > 0 ? m * (next - v) / h : 0) + drag - force;
        applied += model->reaction[k];
      }
      move[0] = before * v;
      move[1] = after * (model->started ? next : 0.5 * (v + next));
      for (PetscInt i = 0; i < 2; i++) {
        s[i] += applied * move[i];
        s[2 + i] += drag * move[i];
        s[4 + i] += far->pull[k] * move[i];
      }
      far->kinetic += 0.5 * m * v * (model->started ? next : v);
      model->v_next[k] = next;
    }
  for (PetscInt i = 0; i < 4; i++) model->level_sum[i] = s[i];
  for (PetscInt i = 4; i < 8; i++) model->level_sum[i] = 0;
  far->level_link[0] = s[4];
  far->level_link[1] = s[5];
  PetscCall(PetscFree(place));
  model->level_known = PETSC_TRUE;
  model->level_dt    = dt;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemFarLevel(FemModel model)
{
  FemFar        *far = &model->far;
  const PetscInt dim = model->dim;
  PetscReal     *drag;

  PetscFunctionBegin;
  const PetscReal dt = model->started ? far->dt : 0;

  if (far->is_static) {
    PetscCall(FemFarStaticLevel(model));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(Close(model));
  if (model->level_known && model->level_dt == dt) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(NearLevel(model, dt));
  PetscCall(PetscCalloc1(model->n_own * dim, &drag));
  FemAbsorbTimes(model, far->v, drag);
  for (PetscInt i = 0; i < model->n_fixed_own; i++) { /* reactions of the far copy */
    const PetscInt  k = model->fixed_dof[i];
    const PetscReal M = far->far_mass[k / dim];

    if (M == 0) continue;
    if (model->inner.place[k / dim] < 0) model->reaction[k] = -model->f_app[k];
    model->reaction[k] += M * (far->a[k] + model->alpha * far->v[k]) + far->g[k] + drag[k];
  }
  PetscCall(PetscFree(drag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Kinetic and strain energy, and what the face has taken, up to the present level [J].  Eq. (6.27) */
void FemFarEnergies(FemModel model, PetscReal *kinetic, PetscReal *strain, PetscReal *taken)
{
  const FemFar   *far = &model->far;
  const FemInner *in  = &model->inner;
  const PetscInt  dim = model->dim;

  *kinetic = model->started ? far->kinetic : 0;
  *strain  = 0;
  for (PetscInt k = 0; k < model->n_own * dim; k++) {
    const PetscInt j = in->place[k / dim];

    if (!model->started) *kinetic += 0.5 * model->mass[k / dim] * model->v[k] * model->v[k];
    else if (!far->is_static) *kinetic += 0.5 * far->far_mass[k / dim] * far->v[k] * far->v[k];
    *strain += 0.5 * far->u[k] * far->g[k];
    if (j >= 0) *strain += 0.5 * model->u[k] * in->fast[j * dim + k % dim];
  }
  *taken = -(far->link + (model->started ? far->level_link[0] : 0));
}

PetscErrorCode FemModelFarStep(FemModel model, PetscReal t, PetscReal dt, PetscInt k)
{
  FemFar         *far = &model->far;
  const FemInner *in  = &model->inner;
  const PetscInt  dim = model->dim;

  PetscFunctionBegin;
  PetscCheck(far->m > 0 && !model->lent, model->comm, PETSC_ERR_ORDER, "Call FemModelSetFar() and give the state back before a step");
  if (k == 0) {
    if (t != model->t) model->level_known = PETSC_FALSE;
    model->t = t;
    if (far->dt != dt) {
      PetscCall(Close(model));
      PetscCall(Factor(model, dt));
    }
    if (!model->started) {
      PetscCall(Start(model));
      model->level_known = PETSC_FALSE;
    }
    PetscCall(Close(model));
    PetscCall(NearLevel(model, dt));
    PetscCall(Predict(model, t, dt * far->m));
  } else {
    Multiplier(model, dt, k);
    model->level_known = PETSC_FALSE;
    PetscCall(NearLevel(model, dt));
  }
  model->work += model->level_sum[0] + model->level_sum[1];
  model->work_in += PetscAbsReal(model->level_sum[0] + model->level_sum[1]);
  model->damping += model->level_sum[2] + model->level_sum[3];
  far->link += far->level_link[0] + far->level_link[1];
  for (PetscInt j = 0; j < in->n; j++)
    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt i = in->node[j] * dim + d;

      model->v[i] = model->v_next[i];
      model->u[i] = model->fixed[i] >= 0 ? FemFixPosition(&model->fix[model->fixed[i]], t + dt) : model->u[i] + dt * model->v[i];
    }
  model->started     = PETSC_TRUE;
  model->dt_last     = dt;
  model->t           = t + dt;
  model->level_known = PETSC_FALSE;
  far->k             = k + 1;
  far->closed        = PETSC_FALSE;
  PetscCall(FemLoadsAt(model, t + dt));
  PetscCall(PetscArrayzero(model->f_ext, model->n_own * dim));
  FemInnerTimes(model, model->u, in->fast);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lumped masses of either side, and the critical step of the near elements with theirs. */
static PetscErrorCode Divide(FemModel model, const PetscBool near[], PetscReal *critical)
{
  FemFar         *far   = &model->far;
  const PetscReal whole = model->critical;
  PetscReal      *value, *kept = model->rows.value, *mass = model->mass;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
    PetscReal       dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], m[FEM_MAX_NODES];

    if (near[model->cell_gid[c]]) continue;
    FemCellGeometry(model, c, dN, w);
    FemLumpedMass(shape, model->region[model->cell_material[c]].material.density, w, m);
    for (PetscInt a = 0; a < shape->nodes; a++) far->far_mass[model->cell_node[model->cell_start[c] + a]] += m[a];
  }
  for (PetscInt i = 0; i < model->n_own; i++) far->near_mass[i] = model->inner.place[i] >= 0 ? model->mass[i] - far->far_mass[i] : 0;
  PetscCall(PetscMalloc1((size_t)model->rows.start[model->n_own] * model->dim * model->dim, &value));
  PetscCall(FemRowsFill(model, near, PETSC_TRUE, value));
  PetscCall(PetscMalloc1(model->n_own, &model->mass));
  for (PetscInt i = 0; i < model->n_own; i++) model->mass[i] = far->near_mass[i] > 0 ? far->near_mass[i] : mass[i];
  model->rows.value = value;
  model->critical   = 0;
  PetscCall(FemModelGetCriticalStep(model, critical));
  PetscCall(PetscFree(model->mass));
  PetscCall(PetscFree(value));
  model->mass       = mass;
  model->rows.value = kept;
  model->critical   = whole;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetFar(FemModel model, const PetscBool near[], PetscInt m, PetscReal *critical)
{
  FemFar        *far = &model->far;
  FemInner      *in  = &model->inner;
  const PetscInt dim = model->dim, n = model->n_own * dim;
  PetscReal      ignored;

  PetscFunctionBegin;
  PetscCheck(model->ready && model->method == FEM_EXPLICIT && model->size == 1 && !model->started && m > 0, model->comm, PETSC_ERR_ORDER, "A far field is set on one rank, after set-up and before the first explicit step");
  PetscCheck(!model->corotate.on, model->comm, PETSC_ERR_SUP, "Corotational elements step explicitly, all of them");
  BaseCheckInput(!model->contact.n_planes, model->comm, "%s: a rigid plane met by elements beside an implicit far field is not covered; step all explicitly (coupling: {far_field: explicit})", model->source);
  BaseCheckInput(model->operator == FEM_ROWS, model->comm, "An implicit far field needs assembled rows; leave out -fem_elements");
  BaseCheckInput(!model->frame_of, model->comm, "%s: inclined planes of symmetry with an implicit far field are not covered; step all explicitly (coupling: {far_field: explicit})", model->source);
  BaseCheckInput(!model->pre.n, model->comm, "%s: initial or thermal stress with an implicit far field is not covered; step all explicitly (coupling: {far_field: explicit})", model->source);
  BaseCheckInput(model->local == 0, model->comm, "An implicit far field and local_damping %.4g do not go together: this damping has no implicit form; use mass_damping", (double)model->local);
  if (far->m > 0) { /* only how many steps of the near side make one */
    far->m = m;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FemInnerCreate(model, near));
  PetscCall(PetscCalloc2(model->n_own, &far->near_mass, model->n_own, &far->far_mass));
  PetscCall(Divide(model, near, critical ? critical : &ignored));
  for (PetscInt j = 0; j < model->absorb.n; j++)
    BaseCheckInput(in->place[model->absorb.node[j]] < 0, model->comm, "%s: an absorbing side reaches the elements that step with the particles; keep it away from the overlap", model->source);
  PetscCall(PetscMalloc1(n, &far->face));
  for (PetscInt j = 0; j < in->n; j++)
    for (PetscInt d = 0; d < dim && in->edge[j]; d++)
      if (model->fixed[in->node[j] * dim + d] < 0) far->face[far->n_face++] = in->node[j] * dim + d;
  BaseCheckInput(far->n_face > 0, model->comm, "An implicit far field has no element: all lie in the overlap; step all explicitly (coupling: {far_field: explicit})");
  BaseCheckInput(far->n_face <= FACE_MOST, model->comm, "The face between the overlap and the implicit far field has %" PetscInt_FMT " unknowns, more than %d, whose dense matrix would not fit; step all explicitly (coupling: {far_field: explicit})", far->n_face, FACE_MOST);
  PetscCall(PetscMalloc2((size_t)far->n_face * far->n_face, &far->Y, (size_t)far->n_face * far->n_face, &far->inverse));
  PetscCall(PetscCalloc5(far->n_face, &far->lambda, far->n_face, &far->lambda0, far->n_face, &far->right, far->n_face, &far->free[0], far->n_face, &far->free[1]));
  PetscCall(PetscCalloc6(n, &far->u, n, &far->v, n, &far->a, n, &far->g, n, &far->pull, n, &far->was));
  PetscCall(PetscCalloc6(n, &far->u1, n, &far->v1, n, &far->a1, n, &far->g1, n, &far->f0, n, &far->f1));
  FemFarSame(model);
  far->m             = m;
  far->closed        = PETSC_TRUE;
  model->level_known = PETSC_FALSE;
  PetscCall(FemFarForces(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetFar(FemModel model, FemFarReport *report)
{
  const FemFar *far = &model->far;
  PetscReal     kinetic, strain;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(report, sizeof(*report)));
  report->steps = far->m;
  report->face  = far->n_face;
  report->dense   = far->dense;
  report->entries = far->factor_entries;
  report->solves  = far->solves;
  if (!far->m || !model->started) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FemFarLevel(model));
  FemFarEnergies(model, &kinetic, &strain, &report->taken);
  report->apart = far->apart;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* [n_own*dim] each in the mesh's order, as on one rank; nothing without a far field. */
PetscErrorCode FemFarSave(FemModel model, Checkpoint checkpoint)
{
  FemFar        *far = &model->far;
  const PetscInt n   = model->n_own * model->dim;
  PetscReal      state[4];

  PetscFunctionBegin;
  if (!far->m) PetscFunctionReturn(PETSC_SUCCESS);
  state[0] = far->dt;
  state[1] = (PetscReal)far->m;
  state[2] = far->link;
  state[3] = far->apart;
  PetscCall(CheckpointWriteReal(checkpoint, "fem/far/state", 4, state));
  PetscCall(CheckpointWriteReal(checkpoint, "fem/far/displacement", n, far->u));
  PetscCall(CheckpointWriteReal(checkpoint, "fem/far/velocity", n, far->v));
  PetscCall(CheckpointWriteReal(checkpoint, "fem/far/acceleration", n, far->a));
  PetscCall(CheckpointWriteReal(checkpoint, "fem/far/force", far->n_face, far->lambda));
  if (far->is_static) PetscCall(CheckpointWriteReal(checkpoint, "fem/far/loads", 2 * far->n_face, far->b1));
  if (far->is_static) PetscCall(CheckpointWriteReal(checkpoint, "fem/far/rest", 2 * n, far->rest));
  if (far->is_static) PetscCall(CheckpointWriteReal(checkpoint, "fem/far/moved", far->n_face, far->moved));
  if (far->is_static) PetscCall(CheckpointWriteReal(checkpoint, "fem/far/before", n, far->was));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemFarLoad(FemModel model, Checkpoint checkpoint)
{
  FemFar        *far = &model->far;
  const PetscInt n   = model->n_own * model->dim;
  PetscReal      state[4];

  PetscFunctionBegin;
  if (!far->m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckpointReadReal(checkpoint, "fem/far/state", 4, state));
  PetscCall(CheckpointReadReal(checkpoint, "fem/far/displacement", n, far->u));
  PetscCall(CheckpointReadReal(checkpoint, "fem/far/velocity", n, far->v));
  PetscCall(CheckpointReadReal(checkpoint, "fem/far/acceleration", n, far->a));
  PetscCall(CheckpointReadReal(checkpoint, "fem/far/force", far->n_face, far->lambda));
  if (far->is_static) PetscCall(CheckpointReadReal(checkpoint, "fem/far/loads", 2 * far->n_face, far->b1));
  if (far->is_static) PetscCall(CheckpointReadReal(checkpoint, "fem/far/rest", 2 * n, far->rest));
  if (far->is_static) PetscCall(CheckpointReadReal(checkpoint, "fem/far/moved", far->n_face, far->moved));
  if (far->is_static) PetscCall(CheckpointReadReal(checkpoint, "fem/far/before", n, far->was));
  far->m      = (PetscInt)state[1];
  far->link   = state[2];
  far->apart  = state[3];
  far->k      = far->m;
  far->closed = PETSC_TRUE;
  if (state[0] > 0 && !far->is_static) PetscCall(Factor(model, state[0]));
  if (far->is_static) far->dt = 0; /* masses anew */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemFarDestroy(FemModel model)
{
  FemFar *far = &model->far;

  PetscFunctionBegin;
  PetscCall(PetscFree2(far->near_mass, far->far_mass));
  PetscCall(PetscFree(far->face));
  PetscCall(PetscFree2(far->Y, far->inverse));
  PetscCall(PetscFree5(far->lambda, far->lambda0, far->right, far->free[0], far->free[1]));
  PetscCall(PetscFree6(far->u, far->v, far->a, far->g, far->pull, far->was));
  PetscCall(PetscFree(far->S));
  PetscCall(PetscFree5(far->b0, far->b1, far->relax_mass, far->rest, far->moved));
  PetscCall(PetscFree6(far->u1, far->v1, far->a1, far->g1, far->f0, far->f1));
  PetscFunctionReturn(PETSC_SUCCESS);
}
