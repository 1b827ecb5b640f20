/*
  fem_substep.c - some elements go in m steps while the rest take one: impulses of the rest every macro step.  Eqs (6.10)-(6.12)

  Inner elements, and every node of theirs, step with dt; the forces of all other elements (slow) act as impulses H = m dt on
  all nodes once a macro step. Where an inner node also carries outer elements (the edge) the two forces cancel at rest but act at
  different instants, so the node swings within the macro step, by f (H^2 - dt^2)/(12 M) on average; the slow forces get a term
  that takes this out, itself the gradient of an energy. Damping acts once a macro step, on the mean velocity of the instant.
*/
#include "fem_impl.h"

/* f [n][dim] = K_inner u; u [nodes][dim] */
void FemInnerTimes(const FemModel model, const PetscReal *u, PetscReal *f)
{
  const FemInner *in  = &model->inner;
  const PetscInt  dim = model->dim;

#pragma omp parallel for schedule(static) num_threads(model->threads)
  for (PetscInt j = 0; j < in->n; j++) {
    PetscReal sum[3] = {0, 0, 0};

    for (PetscInt b = in->start[j]; b < in->start[j + 1]; b++) {
      const PetscReal *K = &in->value[(size_t)b * dim * dim], *x = &u[in->col[b] * dim];

      for (PetscInt p = 0; p < dim; p++)
        for (PetscInt q = 0; q < dim; q++) sum[p] += K[p * dim + q] * x[q];
    }
    for (PetscInt d = 0; d < dim; d++) f[j * dim + d] = sum[d];
  }
}

PetscErrorCode FemForces(FemModel model)
{
  FemInner      *in  = &model->inner;
  const PetscInt dim = model->dim;

  PetscFunctionBegin;
  if (model->far.m) {
    PetscCall(FemFarForces(model));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FemApply(model, model->u, model->f_int));
  if (in->m > 1) {
    FemInnerTimes(model, model->u, in->fast);
    for (PetscInt j = 0; j < in->n; j++)
      for (PetscInt d = 0; d < dim; d++) {
        in->slow[j * dim + d] = model->f_int[in->node[j] * dim + d];
        model->f_int[in->node[j] * dim + d] += in->fast[j * dim + d];
      }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* c [n][dim] = -(H^2 - dt^2)/12 K_inner M^-1 f at the free edge dofs; f [n][dim] the fast forces there.  Eq. (6.11) */
static void Correct(FemModel model, PetscReal H, const PetscReal *f, PetscReal *c)
{
  FemInner       *in    = &model->inner;
  const PetscInt  dim   = model->dim;
  const PetscReal scale = H * H * (1 - 1 / (PetscReal)(in->m * in->m)) / 12;

  for (PetscInt j = 0; j < in->n; j++)
    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt k = in->node[j] * dim + d;

      in->work[k] = in->edge[j] && model->fixed[k] < 0 ? f[j * dim + d] / model->mass[in->node[j]] : 0;
    }
  FemInnerTimes(model, in->work, c);
  for (PetscInt k = 0; k < in->n * dim; k++) c[k] *= -scale;
}

/* Forces of displacements alone, for a trial of the sub-steps: slow and fast [nodes][dim], mobility 1/M, 0 where prescribed. */
PetscErrorCode FemModelSubForces(FemModel model, PetscReal H, const PetscReal *u, PetscReal *slow, PetscReal *fast, PetscReal *mobility)
{
  FemInner      *in  = &model->inner;
  const PetscInt dim = model->dim, n = model->n_own * dim;

  PetscFunctionBegin;
  if (model->far.m) { /* the near elements alone, their face free */
    PetscCall(FemFarTrial(model, u, slow, fast, mobility));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FemApply(model, u, slow));
  if (in->m > 1) {
    FemInnerTimes(model, u, in->net);
    for (PetscInt k = 0; k < in->n * dim; k++) in->net[k] = -in->net[k];
    Correct(model, H, in->net, in->correction);
  }
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt j = in->m > 1 ? in->place[k / dim] : -1;

    slow[k]     = -slow[k] + (j >= 0 ? in->correction[j * dim + k % dim] : 0);
    fast[k]     = j >= 0 ? in->net[j * dim + k % dim] : 0;
    mobility[k] = model->fixed[k] >= 0 ? 0 : 1 / model->mass[k / dim];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Close the level at a macro step's start: velocity after both kicks, reactions, and the energies of the instant.  Eqs (6.10), (6.12)

  A node's kinetic energy is 1/2 M v' v'' with v', v'' the mean velocity less and plus half its own step's kick by all forces
  there: the swing of the edge within the macro step is then no energy, and an outer node has (2.20).
*/
PetscErrorCode FemInnerLevel(FemModel model, PetscReal H)
{
  FemInner       *in    = &model->inner;
  const PetscInt  dim   = model->dim;
  const PetscReal before = model->started ? 0.5 * H : 0, h = before + 0.5 * H, alpha = model->alpha, part = 1 / (PetscReal)in->m;
  const PetscReal keep = model->started ? (1 - 0.5 * alpha * h) / (1 + 0.5 * alpha * h) : 1 - alpha * h, gain = model->started ? 1 / (1 + 0.5 * alpha * h) : 1;
  PetscReal      *place, s[4] = {0, 0, 0, 0};

  PetscFunctionBegin;
  if (model->level_known && model->level_dt == H) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(model->n_fixes, &place));
  for (PetscInt k = 0; k < model->n_fixes; k++) place[k] = FemFixPosition(&model->fix[k], model->t + H);
  if (model->absorb.n) FemAbsorbLevel(model, before, 0.5 * H, place); /* all on outer nodes */
  for (PetscInt j = 0; j < in->n; j++)
    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt k = in->node[j] * dim + d;

      in->net[j * dim + d] = model->f_app[k] + model->f_ext[k] - in->fast[j * dim + d];
    }
  Correct(model, H, in->net, in->correction);
  in->kinetic = 0;
  for (PetscInt k = 0; k < model->n_own * dim; k++) {
    const PetscInt  j = in->place[k / dim], i = j * dim + k % dim;
    const PetscReal m = model->mass[k / dim], v = model->v[k], own = j >= 0 ? part : 1; /* own step / H */
    const PetscReal fast = j >= 0 ? in->net[i] : 0, slow = j >= 0 ? -in->slow[i] : model->f_app[k] + FemOutside(model)[k] - model->f_int[k];
    const PetscReal push = slow + (j >= 0 ? in->correction[i] : 0) + part * fast, force = slow + fast, ahead = v + 0.5 * h * push / m;
    const PetscReal local = model->fixed[k] < 0 ? model->local * PetscAbsReal(force) * (ahead > 0 ? 1 : ahead < 0 ? -1 : 0) : 0; /* eq. (5.3) */
    PetscReal       next = keep * v + gain * h * (push - local) / m, mean, drag, swing, reaction = 0;

    if (model->fixed[k] >= 0) next = H > 0 ? (place[model->fixed[k]] - model->u[k]) / H : v;
    mean  = model->started ? 0.5 * (v + next) : v;
    drag  = alpha * m * mean + local;
    swing = 0.5 * own * H * (force - drag) / m;
    if (model->fixed[k] >= 0) {
      const PetscReal a = h > 0 ? (next - v) / h : 0;

      reaction = m * a + drag - force;
      swing    = 0.5 * own * H * a;
      s[0] += before * (m * a + drag - push) * mean; /* impulse of this instant */
      s[1] += 0.5 * H * (m * a + drag - push) * mean;
    }
    s[0] += own * before * model->f_app[k] * (mean - swing);
    s[1] += own * 0.5 * H * model->f_app[k] * (model->started ? mean + swing : mean + 0.5 * swing);
    s[2] += before * drag * (j >= 0 ? mean : mean - swing);
    s[3] += 0.5 * H * drag * (j >= 0 ? mean : model->started ? mean + swing : mean + 0.5 * swing);
    in->kinetic += 0.5 * m * (model->started ? mean * mean - swing * swing : v * v);
    model->v_next[k]   = next;
    model->reaction[k] = reaction;
  }
  if (model->absorb.n) FemAbsorbBook(model, before, 0.5 * H, s);
  for (PetscInt k = 0; k < 4; k++) model->level_sum[k] = s[k];
  PetscCall(PetscFree(place));
  model->level_known = PETSC_TRUE;
  model->level_dt    = H;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Inner nodes' kick between macro steps by dt; the supports' and loads' work. */
static void InnerKick(FemModel model, PetscReal dt)
{
  FemInner      *in  = &model->inner;
  const PetscInt dim = model->dim;
  PetscReal      work = 0;

  for (PetscInt j = 0; j < in->n; j++)
    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt  k = in->node[j] * dim + d;
      const PetscReal force = model->f_app[k] + model->f_ext[k] - in->fast[j * dim + d], v = model->v[k];

      if (model->fixed[k] < 0) model->v[k] = v + dt * force / model->mass[in->node[j]];
      work += dt * 0.5 * (v + model->v[k]) * (model->f_app[k] - (model->fixed[k] < 0 ? 0 : force));
    }
  model->work += work;
  model->work_in += PetscAbsReal(work);
}

PetscErrorCode FemModelSubStep(FemModel model, PetscReal t, PetscReal dt, PetscInt k)
{
  FemInner       *in   = &model->inner;
  const PetscInt  dim  = model->dim;
  const PetscReal H    = dt * in->m;
  const PetscBool last = k + 1 == in->m ? PETSC_TRUE : PETSC_FALSE;

  PetscFunctionBegin;
  PetscCheck(in->m > 1 && !model->lent, model->comm, PETSC_ERR_ORDER, "Call FemModelSetInnerCells() and give the state back before a sub-step");
  if (k == 0) {
    if (t != model->t) model->level_known = PETSC_FALSE;
    model->t = t;
    PetscCall(FemInnerLevel(model, H));
    model->work += model->level_sum[0] + model->level_sum[1];
    model->work_in += PetscAbsReal(model->level_sum[0] + model->level_sum[1]);
    model->damping += model->level_sum[2] + model->level_sum[3];
    PetscCall(PetscArraycpy(model->v, model->v_next, model->n_own * dim));
    for (PetscInt i = 0; i < model->n_own * dim; i++)
      if (in->place[i / dim] < 0) model->u[i] += H * model->v[i];
    model->started     = PETSC_TRUE;
    model->dt_last     = H;
    model->level_known = PETSC_FALSE;
  } else InnerKick(model, dt);
  for (PetscInt j = 0; j < in->n; j++)
    for (PetscInt d = 0; d < dim; d++) model->u[in->node[j] * dim + d] += dt * model->v[in->node[j] * dim + d];
  model->t = t + dt;
  PetscCall(FemLoadsAt(model, t + dt));
  PetscCall(PetscArrayzero(model->f_ext, model->n_own * dim));
  if (last) {
    for (PetscInt i = 0; i < model->n_fixed_own; i++) model->u[model->fixed_dof[i]] = FemFixPosition(&model->fix[model->fixed[model->fixed_dof[i]]], t + dt);
    PetscCall(FemForces(model));
  } else FemInnerTimes(model, model->u, in->fast);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetLocalDamping(FemModel model, PetscReal *alpha)
{
  PetscFunctionBegin;
  *alpha = model->local;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetDamping(FemModel model, PetscReal *alpha)
{
  PetscFunctionBegin;
  *alpha = model->alpha;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemInnerDestroy(FemModel model)
{
  FemInner *in = &model->inner;

  PetscFunctionBegin;
  PetscCall(PetscFree4(in->node, in->place, in->edge, in->start));
  PetscCall(PetscFree2(in->col, in->value));
  PetscCall(PetscFree5(in->fast, in->slow, in->net, in->correction, in->work));
  PetscCall(PetscMemzero(in, sizeof(*in)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of inner nodes among inner nodes, from the values of the inner elements in the pattern of all. */
static PetscErrorCode TakeRows(FemModel model, const PetscReal *value)
{
  FemInner      *in   = &model->inner;
  const FemRows *rows = &model->rows;
  const PetscInt block = model->dim * model->dim;

  PetscFunctionBegin;
  in->start[0] = 0;
  for (PetscInt j = 0; j < in->n; j++) {
    in->start[j + 1] = in->start[j];
    for (PetscInt b = rows->start[in->node[j]]; b < rows->start[in->node[j] + 1]; b++) in->start[j + 1] += in->place[rows->col[b]] >= 0;
  }
  PetscCall(PetscMalloc2(in->start[in->n], &in->col, (size_t)in->start[in->n] * block, &in->value));
  for (PetscInt j = 0, at = 0; j < in->n; j++)
    for (PetscInt b = rows->start[in->node[j]]; b < rows->start[in->node[j] + 1]; b++) {
      if (in->place[rows->col[b]] < 0) continue;
      in->col[at] = rows->col[b];
      PetscCall(PetscArraycpy(&in->value[(size_t)at * block], &value[(size_t)b * block], block));
      at++;
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Inner nodes, the edge, rows of the inner elements; rows of the model keep those of the others. in->m stays 0. */
PetscErrorCode FemInnerCreate(FemModel model, const PetscBool inner[])
{
  FemInner      *in  = &model->inner;
  const PetscInt dim = model->dim;
  PetscReal     *value;

  PetscFunctionBegin;
  PetscCall(FemInnerDestroy(model));
  PetscCall(PetscMalloc4(model->n_own, &in->node, model->n_own, &in->place, model->n_own, &in->edge, model->n_own + 1, &in->start));
  for (PetscInt i = 0; i < model->n_own; i++) in->place[i] = -1;
  for (PetscInt c = 0; c < model->n_cells; c++)
    for (PetscInt k = model->cell_start[c]; k < model->cell_start[c + 1]; k++)
      if (inner[model->cell_gid[c]]) in->place[model->cell_node[k]] = 0;
  for (PetscInt i = 0; i < model->n_own; i++)
    if (in->place[i] == 0) {
      in->edge[in->n] = 0;
      in->place[i]    = in->n;
      in->node[in->n++] = i;
    }
  for (PetscInt c = 0; c < model->n_cells; c++)
    for (PetscInt k = model->cell_start[c]; k < model->cell_start[c + 1]; k++)
      if (!inner[model->cell_gid[c]] && in->place[model->cell_node[k]] >= 0) in->edge[in->place[model->cell_node[k]]] = 1;
  if (model->batches) {
    PetscCall(FemBatchesDestroy(model));
    PetscCall(FemRowsCreate(model));
  }
  PetscCall(PetscMalloc1((size_t)model->rows.start[model->n_own] * dim * dim, &value));
  PetscCall(FemRowsFill(model, inner, PETSC_TRUE, value));
  PetscCall(TakeRows(model, value));
  PetscCall(PetscFree(value));
  PetscCall(FemRowsFill(model, inner, PETSC_FALSE, model->rows.value));
  PetscCall(PetscCalloc5(in->n * dim, &in->fast, in->n * dim, &in->slow, in->n * dim, &in->net, in->n * dim, &in->correction, model->n_own * dim, &in->work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetInnerCells(FemModel model, const PetscBool inner[], PetscInt m, PetscReal *critical)
{
  FemInner       *in    = &model->inner;
  const PetscReal whole = model->critical;

  PetscFunctionBegin;
  PetscCheck(!model->corotate.on, model->comm, PETSC_ERR_SUP, "Corotational elements go in one step, all together");
  BaseCheckInput(m == 1 || !model->contact.n_planes, model->comm, "%s: a rigid plane met by elements with sub-steps is not covered; take one step for both sides (coupling: {substeps: 1})", model->source);
  PetscCheck(model->ready && model->method == FEM_EXPLICIT && model->size == 1 && !model->started, model->comm, PETSC_ERR_ORDER, "Sub-steps are set on one rank, after set-up and before the first explicit step");
  PetscCheck(whole > 0, model->comm, PETSC_ERR_ORDER, "Ask for the critical step before elements are set apart");
  BaseCheckInput(m == 1 || model->operator == FEM_ROWS, model->comm, "Sub-steps need assembled rows; leave out -fem_elements, or take one step");
  BaseCheckInput(m == 1 || !model->frame_of, model->comm, "%s: inclined planes of symmetry with sub-steps are not covered; take one step for both sides (coupling: {substeps: 1})", model->source);
  BaseCheckInput(m == 1 || !model->pre.n, model->comm, "%s: initial or thermal stress with sub-steps is not covered; take one step for both sides (coupling: {substeps: 1})", model->source);
  if (m == 1) {
    PetscCall(FemInnerDestroy(model));
    if (model->rows.value) PetscCall(FemRowsFill(model, NULL, PETSC_TRUE, model->rows.value));
    if (critical) *critical = whole;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FemInnerCreate(model, inner));
  for (PetscInt j = 0; j < model->absorb.n; j++)
    BaseCheckInput(in->place[model->absorb.node[j]] < 0, model->comm, "%s: an absorbing side reaches the elements that step with the particles; keep it four elements away from the overlap, or take one step for both sides (coupling: {substeps: 1})",
                   model->source);
  in->m = m;
  model->critical = 0;
  if (critical) PetscCall(FemModelGetCriticalStep(model, critical));
  model->critical    = whole;
  model->level_known = PETSC_FALSE;
  PetscCall(FemForces(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
