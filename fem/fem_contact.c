/*
  fem_contact.c - nodes of a group against rigid planes, at rest or moving.  Eqs (2.120)-(2.126)

  Explicit steps: a node that would pass the plane by the end of the step is put on it, by the force that does so; no spring, so the critical step stays
  as it is. What the node loses when it meets the plane is its lumped share of a body that would lose nothing; it is kept in account and
  given back, times the square of the restitution, when the body pulls the node off. Friction takes up to mu times the push from sliding.
  Static equilibrium is in fem_contact_solve.c, implicit steps in fem_contact_implicit.c besides.
*/
#include "fem_impl.h"

/* Gap of a node at rest [m]; what is round-off of the places is 0. */
static PetscReal RestGap(FemModel model, const FemPlane *plane, PetscInt node)
{
  PetscReal gap = 0, size = 0;

  for (PetscInt d = 0; d < model->dim; d++) {
    gap += plane->normal[d] * (model->x[node * model->dim + d] - plane->point[d]);
    size += PetscAbsReal(model->x[node * model->dim + d]) + PetscAbsReal(plane->point[d]);
  }
  return PetscAbsReal(gap) <= 1e-9 * size ? 0 : gap;
}

/* No node of the group begins behind the plane. */
static PetscErrorCode CheckGaps(FemModel model, const FemPlane *plane)
{
  const FemGroup *group = &model->group[plane->group];
  PetscInt        bad = PETSC_MAX_INT, first, tag;
  PetscReal       mine = 0, deep;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < group->n_nodes; k++) mine = PetscMin(mine, RestGap(model, plane, group->node[k]));
  PetscCallMPI(MPI_Allreduce(&mine, &deep, 1, MPIU_REAL, MPI_MIN, model->comm));
  if (deep == 0) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < group->n_nodes; k++)
    if (RestGap(model, plane, group->node[k]) == deep) bad = PetscMin(bad, model->gid[group->node[k]]);
  PetscCallMPI(MPI_Allreduce(&bad, &first, 1, MPIU_INT, MPI_MIN, model->comm));
  tag = model->rank == 0 ? model->id_all[first] : 0;
  PetscCallMPI(MPI_Bcast(&tag, 1, MPIU_INT, 0, model->comm));
  SETERRQ(model->comm, PETSC_ERR_USER_INPUT, "%s: node %d of group '%s' lies %.6g m behind the plane it is to meet; turn the plane's normal towards the body, or move the plane's point", model->source, (int)tag, group->name, -(double)deep);
}

PetscErrorCode FemModelAddPlane(FemModel model, const char *name, const PetscReal point[3], const PetscReal normal[3], PetscReal friction, PetscReal restitution, const Table *velocity)
{
  FemPlane  plane = {.friction = friction, .restitution = restitution};
  PetscReal size = 0;

  PetscFunctionBegin;
  PetscCheck(model && model->has_mesh && !model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Planes are given between FemModelSetMesh() and FemModelSetUp()");
  PetscCall(FemFindGroup(model, name, &plane.group));
  for (PetscInt d = 0; d < model->dim; d++) size += normal[d] * normal[d];
  BaseCheckInput(size > 0 && (model->dim == 3 || normal[2] == 0), model->comm, "The normal (%.6g, %.6g, %.6g) of the plane group '%s' meets needs a direction%s", (double)normal[0], (double)normal[1], (double)normal[2], name,
                 model->dim == 2 ? " in x, y" : "");
  BaseCheckInput(friction >= 0 && !PetscIsInfOrNanReal(friction), model->comm, "A friction of %.6g against a plane must be 0 or more", (double)friction);
  BaseCheckInput(restitution >= 0 && restitution <= 1, model->comm, "A restitution of %.6g from a plane must lie between 0 and 1", (double)restitution);
  BaseCheckInput(model->group[plane.group].n_nodes_global > 0, model->comm, "%s: group '%s' touches no node of the body, so nothing can meet the plane", model->source, name);
  for (PetscInt d = 0; d < model->dim; d++) {
    plane.point[d]  = point[d];
    plane.normal[d] = normal[d] / PetscSqrtReal(size);
    if (velocity && velocity[d].n) {
      PetscCall(TableCopy(&velocity[d], &plane.velocity[d]));
      plane.moves = PETSC_TRUE;
    }
  }
  PetscCall(CheckGaps(model, &plane));
  PetscCall(PetscRealloc(sizeof(FemPlane) * (model->contact.n_planes + 1), &model->contact.plane));
  model->contact.plane[model->contact.n_planes++] = plane;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void FemPlaneMotion(const FemPlane *plane, PetscReal t, PetscReal D[3])
{
  for (PetscInt d = 0; d < 3; d++) D[d] = plane->velocity[d].n ? TableIntegral(&plane->velocity[d], t) : 0;
}

static int CompareEntries(const void *a, const void *b)
{
  const PetscInt *p = a, *q = b;

  return p[0] != q[0] ? (p[0] < q[0] ? -1 : 1) : p[1] < q[1] ? -1 : p[1] > q[1];
}

/* Held directions of a node lie in the plane, so that plane and supports do not fight. */
static PetscReal HeldAcross(FemModel model, PetscInt node, const PetscReal n[3])
{
  const PetscInt dim = model->dim, f = model->frame_of ? model->frame_of[node] : -1;
  PetscReal      worst = 0;

  for (PetscInt i = 0; i < dim; i++) {
    PetscReal dot = 0;

    if (FemHeld(model, node * dim + i) < 0) continue;
    for (PetscInt d = 0; d < dim; d++) dot += n[d] * (f < 0 ? d == i : model->frame[(f * dim + i) * dim + d]);
    worst = PetscMax(worst, PetscAbsReal(dot));
  }
  return worst;
}

PetscErrorCode FemSetUpContact(FemModel model)
{
  FemContact    *c    = &model->contact;
  const PetscInt dim  = model->dim;
  PetscInt      *pair, bad[2] = {PETSC_MAX_INT, PETSC_MAX_INT}, first[2], tag;

  PetscFunctionBegin;
  if (!c->n_planes) PetscFunctionReturn(PETSC_SUCCESS);
  BaseCheckInput(model->local == 0, model->comm, "Contact with a plane and local damping do not go together: it damps the forces that hold a node on the plane; use viscous damping");
  for (PetscInt p = 0; p < c->n_planes; p++) c->n += model->group[c->plane[p].group].n_nodes;
  PetscCall(PetscMalloc1(2 * c->n, &pair));
  for (PetscInt p = 0, k = 0; p < c->n_planes; p++)
    for (PetscInt i = 0; i < model->group[c->plane[p].group].n_nodes; i++, k++) {
      pair[2 * k]     = model->group[c->plane[p].group].node[i];
      pair[2 * k + 1] = p;
    }
  if (c->n > 1) qsort(pair, c->n, 2 * sizeof(PetscInt), CompareEntries);
  PetscCall(PetscCalloc6(c->n, &c->node, c->n, &c->of, c->n, &c->gap, c->n, &c->held, 3 * c->n, &c->push, c->n, &c->normal));
  PetscCall(PetscCalloc2(c->n, &c->taken, c->n, &c->kick));
  for (PetscInt e = 0; e < c->n; e++) {
    const FemPlane *plane = &c->plane[pair[2 * e + 1]];

    c->node[e] = pair[2 * e];
    c->of[e]   = pair[2 * e + 1];
    c->gap[e]  = RestGap(model, plane, c->node[e]);
    if (HeldAcross(model, c->node[e], plane->normal) > 1e-9) bad[0] = PetscMin(bad[0], model->gid[c->node[e]]);
    if (model->method != FEM_EXPLICIT && e && c->node[e - 1] == c->node[e]) bad[1] = PetscMin(bad[1], model->gid[c->node[e]]);
  }
  PetscCall(PetscFree(pair));
  PetscCallMPI(MPI_Allreduce(bad, first, 2, MPIU_INT, MPI_MIN, model->comm));
  for (PetscInt k = 0; k < 2; k++) {
    if (first[k] == PETSC_MAX_INT) continue;
    tag = model->rank == 0 ? model->id_all[first[k]] : 0;
    PetscCallMPI(MPI_Bcast(&tag, 1, MPIU_INT, 0, model->comm));
    BaseCheckInput(k != 0, model->comm, "%s: node %d meets a plane and is held across it; take it out of the support, or out of the group that meets the plane", model->source, (int)tag);
    BaseCheckInput(k != 1, model->comm, "%s: node %d meets two planes, which a static or implicit step does not follow; give each plane its own group", model->source, (int)tag);
  }
  for (PetscInt e = 0; e < c->n; e++) {
    PetscInt at = -1;

    for (PetscInt k = 0; k < model->absorb.n; k++)
      if (model->absorb.node[k] == c->node[e]) at = k;
    PetscCheck(at < 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s: group '%s' meets a plane and shares a node with an absorbing side; it can do one of them", model->source, model->group[c->plane[c->of[e]].group].name);
  }
  if (model->method == FEM_EXPLICIT) PetscCall(PetscCalloc1(model->n_own * dim, &c->outside));
  if (model->method != FEM_EXPLICIT || model->preload) PetscCall(FemContactSolveSetUp(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- explicit steps ---- */

/* Velocity of a node after the step, contact left out: (2.17), (2.18) along its own axes. F [dim] is added to the forces. */
static void Predict(FemModel model, PetscInt node, PetscReal keep, PetscReal gain, PetscReal after, const PetscReal *place, const PetscReal F[3], PetscReal next[3])
{
  const PetscInt dim = model->dim, k = node * dim, f = model->frame_of ? model->frame_of[node] : -1;

  next[0] = next[1] = next[2] = 0;
  for (PetscInt i = 0; i < dim; i++) {
    const PetscInt fix = FemHeld(model, k + i);
    PetscReal      q[3] = {i == 0, i == 1, i == 2}, v = 0, u = 0, force = 0, w;

    for (PetscInt d = 0; d < dim && f >= 0; d++) q[d] = model->frame[(f * dim + i) * dim + d];
    for (PetscInt d = 0; d < dim; d++) {
      v += q[d] * model->v[k + d];
      u += q[d] * model->u[k + d];
      force += q[d] * (model->f_app[k + d] + model->contact.outside[k + d] - model->f_int[k + d] + F[d]);
    }
    w = fix >= 0 ? (place[fix] - u) / (2 * after) : keep * v + gain * force / model->mass[node];
    for (PetscInt d = 0; d < dim; d++) next[d] += w * q[d];
  }
}

/* Steps of planes: their motion before and after the level [m/s], and where they are then [m]. */
static void PlaneSteps(const FemPlane *plane, PetscReal t, PetscReal before, PetscReal after, PetscReal past[3], PetscReal coming[3], PetscReal place[3])
{
  PetscReal now[3], old[3];

  FemPlaneMotion(plane, t - 2 * before, old);
  FemPlaneMotion(plane, t, now);
  FemPlaneMotion(plane, t + 2 * after, place);
  for (PetscInt d = 0; d < 3; d++) {
    past[d]   = before > 0 ? (now[d] - old[d]) / (2 * before) : 0;
    coming[d] = (place[d] - now[d]) / (2 * after);
  }
}

/* The push that gives back `energy` over this level: R (before w + after (w_next + R gain/m)) = energy.  Eq. (2.124) */
static PetscReal Kick(PetscReal before, PetscReal after, PetscReal w, PetscReal w_next, PetscReal slope, PetscReal energy)
{
  const PetscReal b = before * w + after * w_next, root = PetscSqrtReal(b * b + 4 * after * slope * energy);

  return b > 0 ? 2 * energy / (b + root) : (root - b) / (2 * after * slope);
}

/* Pushes of this level, into outside.  Eqs (2.120)-(2.124) */
void FemContactLevel(FemModel model, PetscReal before, PetscReal after, PetscReal keep, PetscReal gain, const PetscReal *place)
{
  FemContact      *c       = &model->contact;
  const PetscReal *outside = model->absorb.outside ? model->absorb.outside : model->f_ext;
  const PetscInt   dim     = model->dim;

  for (PetscInt k = 0; k < model->n_own * dim; k++) c->outside[k] = outside[k];
  for (PetscInt e = 0, last; e < c->n && after > 0; e = last) { /* a node's planes together */
    const PetscInt node = c->node[e], k = node * dim;
    PetscReal      next[3], F[3] = {0, 0, 0}, change = 1;

    for (last = e; last < c->n && c->node[last] == node; last++) {
      c->normal[last] = 0;
      c->kick[last]   = 0;
    }
    for (PetscInt sweep = 0; sweep < 100 && change > 0 && (sweep < 1 || last > e + 1); sweep++) {
      change = 0;
      for (PetscInt j = e; j < last; j++) {
        const FemPlane *plane = &c->plane[c->of[j]];
        PetscReal       past[3], coming[3], there[3], gap = c->gap[j], R;

        PlaneSteps(plane, model->t, before, after, past, coming, there);
        Predict(model, node, keep, gain, after, place, F, next);
        for (PetscInt d = 0; d < dim; d++) gap += plane->normal[d] * (model->u[k + d] + 2 * after * next[d] - there[d]);
        R = PetscMax(0, c->normal[j] - gap * model->mass[node] / (2 * after * gain));
        if (PetscAbsReal(R - c->normal[j]) > 1e-14 * R) change = 1;
        for (PetscInt d = 0; d < dim; d++) F[d] += (R - c->normal[j]) * plane->normal[d];
        c->normal[j] = R;
      }
    }
    for (PetscInt j = e; j < last; j++) {
      const FemPlane *plane = &c->plane[c->of[j]];
      PetscReal       past[3], coming[3], there[3], w = 0, w_next = 0, T[3] = {0, 0, 0}, size = 0;

      if (c->normal[j] * gain <= 1e-9 * PetscSqrtReal(2 * PetscMax(0, c->held[j]) * model->mass[node])) c->normal[j] = 0; /* held there by round-off */
      for (PetscInt d = 0; d < dim; d++) c->push[3 * j + d] = c->normal[j] * plane->normal[d];
      if (c->normal[j] == 0 && !(c->held[j] > 0 && plane->restitution > 0)) continue;
      PlaneSteps(plane, model->t, before, after, past, coming, there);
      Predict(model, node, keep, gain, after, place, F, next);
      if (c->normal[j] == 0) { /* let go */
        for (PetscInt d = 0; d < dim; d++) {
          w += plane->normal[d] * (model->v[k + d] - past[d]);
          w_next += plane->normal[d] * (next[d] - coming[d]);
        }
        c->normal[j] = Kick(before, after, w, w_next, gain / model->mass[node], PetscSqr(plane->restitution) * c->held[j]);
        c->kick[j]   = 1;
        for (PetscInt d = 0; d < dim; d++) c->push[3 * j + d] = c->normal[j] * plane->normal[d];
        continue;
      }
      if (plane->friction == 0) continue;
      for (PetscInt d = 0; d < dim; d++) w += plane->normal[d] * (next[d] - coming[d]);
      for (PetscInt d = 0; d < dim; d++) T[d] = -model->mass[node] / gain * (next[d] - coming[d] - w * plane->normal[d]); /* would stop it */
      for (PetscInt i = 0; i < dim; i++) {                                                                               /* held directions stop it themselves */
        const PetscInt f = model->frame_of ? model->frame_of[node] : -1;
        PetscReal      q[3] = {i == 0, i == 1, i == 2}, dot = 0;

        if (FemHeld(model, k + i) < 0) continue;
        for (PetscInt d = 0; d < dim && f >= 0; d++) q[d] = model->frame[(f * dim + i) * dim + d];
        for (PetscInt d = 0; d < dim; d++) dot += q[d] * T[d];
        for (PetscInt d = 0; d < dim; d++) T[d] -= dot * q[d];
      }
      for (PetscInt d = 0; d < dim; d++) size += T[d] * T[d];
      size = PetscSqrtReal(size);
      for (PetscInt d = 0; d < dim; d++) {
        T[d] *= size > plane->friction * c->normal[j] ? plane->friction * c->normal[j] / size : 1;
        c->push[3 * j + d] += T[d];
        F[d] += T[d];
      }
    }
    for (PetscInt j = e; j < last; j++)
      for (PetscInt d = 0; d < dim; d++) c->outside[k + d] += c->push[3 * j + d];
  }
}

/*
  After the level is closed: pushes join the reactions; what they do, each on its own motion, over the half step before and after.  Eqs (2.125), (2.126)

  sum [8]: 0, 1 work of the planes' motion; 4, 5 taken into account by nodes that touch; 6, 7 friction.
*/
void FemContactBook(FemModel model, PetscReal before, PetscReal after, PetscReal sum[8])
{
  FemContact    *c   = &model->contact;
  const PetscInt dim = model->dim;

  for (PetscInt e = 0; e < c->n; e++) {
    const FemPlane *plane = &c->plane[c->of[e]];
    const PetscInt  k     = c->node[e] * dim;
    PetscReal       past[3], coming[3], there[3], all[2] = {0, 0}, across[2] = {0, 0};

    c->taken[e] = 0;
    if (c->normal[e] == 0 || !(after > 0)) continue;
    PlaneSteps(plane, model->t, before, after, past, coming, there);
    for (PetscInt d = 0; d < dim; d++) {
      const PetscReal v = model->v[k + d], next = before > 0 ? model->v_next[k + d] : 0.5 * (v + model->v_next[k + d]), push = c->push[3 * e + d];

      sum[0] += push * before * past[d];
      sum[1] += push * after * coming[d];
      all[0] += push * before * (v - past[d]);
      all[1] += push * after * (next - coming[d]);
      across[0] += c->normal[e] * plane->normal[d] * before * (v - past[d]);
      across[1] += c->normal[e] * plane->normal[d] * after * (next - coming[d]);
      model->reaction[k + d] += push;
    }
    c->taken[e] = -across[0] - across[1];
    sum[4] -= across[0];
    sum[5] -= across[1];
    sum[6] -= all[0] - across[0];
    sum[7] -= all[1] - across[1];
  }
}

/* Once the step is taken: accounts of the nodes; returns what restitution keeps back [J], this rank's. */
PetscReal FemContactAdvance(FemModel model)
{
  FemContact *c    = &model->contact;
  PetscReal   lost = 0;

  for (PetscInt e = 0; e < c->n; e++) {
    if (c->kick[e] || c->normal[e] == 0) {
      lost += c->held[e] + c->taken[e]; /* taken < 0: given back */
      c->held[e] = 0;
    } else c->held[e] += c->taken[e];
    c->kick[e] = 0;
  }
  return lost;
}

PetscErrorCode FemContactSave(FemModel model, Checkpoint checkpoint)
{
  FemContact     *c        = &model->contact;
  const PetscInt  width = model->method == FEM_EXPLICIT ? 1 : 4, m = c->n_planes * width, n = m * model->N_nodes;
  const PetscReal state[2] = {c->contact, c->friction};
  PetscReal      *own, *all;

  PetscFunctionBegin;
  if (!m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(m * model->n_own, &own));
  PetscCall(PetscMalloc1(model->rank == 0 ? n : 0, &all));
  for (PetscInt e = 0; e < c->n; e++) {
    PetscReal *to = &own[c->node[e] * m + c->of[e] * width];

    to[0] = model->method == FEM_EXPLICIT ? c->held[e] : c->normal[e];
    for (PetscInt d = 1; d < width; d++) to[d] = c->push[3 * e + d - 1];
  }
  PetscCall(FemGather(model, model->home, m, own, all));
  PetscCall(CheckpointWriteReal(checkpoint, "fem/contact", n, all));
  PetscCall(CheckpointWriteReal(checkpoint, "fem/contact_state", 2, state));
  PetscCall(PetscFree(own));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemContactLoad(FemModel model, Checkpoint checkpoint)
{
  FemContact    *c = &model->contact;
  const PetscInt width = model->method == FEM_EXPLICIT ? 1 : 4, m = c->n_planes * width, n = m * model->N_nodes;
  PetscReal      state[2], *own, *all;

  PetscFunctionBegin;
  if (!m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(m * model->n_own, &own, n, &all));
  PetscCall(CheckpointReadReal(checkpoint, "fem/contact", n, all));
  PetscCall(CheckpointReadReal(checkpoint, "fem/contact_state", 2, state));
  PetscCall(FemScatter(model, model->home, m, all, own));
  for (PetscInt e = 0; e < c->n; e++) {
    const PetscReal *from = &own[c->node[e] * m + c->of[e] * width];

    if (model->method == FEM_EXPLICIT) c->held[e] = from[0];
    else c->normal[e] = from[0];
    for (PetscInt d = 1; d < width; d++) c->push[3 * e + d - 1] = from[d];
  }
  c->contact  = state[0];
  c->friction = state[1];
  PetscCall(PetscFree2(own, all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemContactDestroy(FemModel model)
{
  FemContact *c = &model->contact;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < c->n_planes; p++)
    for (PetscInt d = 0; d < 3; d++) PetscCall(TableDestroy(&c->plane[p].velocity[d]));
  PetscCall(PetscFree(c->plane));
  PetscCall(PetscFree6(c->node, c->of, c->gap, c->held, c->push, c->normal));
  PetscCall(PetscFree2(c->taken, c->kick));
  PetscCall(PetscFree(c->outside));
  PetscCall(PetscFree2(c->spring, c->begin));
  PetscCall(PetscFree5(c->direction, c->idle, c->before, c->stiff, c->state));
  PetscCall(PetscFree(c->flexible));
  PetscFunctionReturn(PETSC_SUCCESS);
}
