/*
  fem_rigid.c - is the body held? A static answer exists only when no part of it can move as a rigid body.

  Per connected part: the rigid motions r_k (translations, rotations about the part's centre, lengths scaled by its size)
  seen by its fixed dofs give G = sum r r'. What G does not see is free, and named.  Eq. (2.15)
*/
#include "fem_impl.h"
#include <petscblaslapack.h>

static PetscInt Root(PetscInt *parent, PetscInt i)
{
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

/* part [n_loc] out: the lowest global node number connected to each node through elements, over all ranks. */
static PetscErrorCode FindParts(FemModel model, PetscInt *part)
{
  PetscInt *parent, *low, changed = 1;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(model->n_loc, &parent, model->n_loc, &low));
  for (PetscInt i = 0; i < model->n_loc; i++) {
    parent[i] = i;
    part[i]   = model->gid[i];
  }
  for (PetscInt c = 0; c < model->n_cells; c++)
    for (PetscInt k = model->cell_start[c] + 1; k < model->cell_start[c + 1]; k++) parent[Root(parent, model->cell_node[k])] = Root(parent, model->cell_node[model->cell_start[c]]);
  while (changed) {
    changed = 0;
    for (PetscInt i = 0; i < model->n_loc; i++) low[i] = PETSC_MAX_INT;
    for (PetscInt i = 0; i < model->n_loc; i++) low[Root(parent, i)] = PetscMin(low[Root(parent, i)], part[i]);
    for (PetscInt i = 0; i < model->n_loc; i++)
      if (part[i] != low[Root(parent, i)]) {
        part[i] = low[Root(parent, i)];
        changed = 1;
      }
    if (model->size == 1) break;
    PetscCall(PetscSFReduceBegin(model->ghosts, MPIU_INT, part, part, MPI_MIN));
    PetscCall(PetscSFReduceEnd(model->ghosts, MPIU_INT, part, part, MPI_MIN));
    PetscCall(PetscSFBcastBegin(model->ghosts, MPIU_INT, part, part, MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(model->ghosts, MPIU_INT, part, part, MPI_REPLACE));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &changed, 1, MPIU_INT, MPI_MAX, model->comm));
  }
  PetscCall(PetscFree2(parent, low));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All parts, ascending, on every rank; part[] becomes an index into them. */
static PetscErrorCode NumberParts(FemModel model, PetscInt *part, PetscInt *n_parts, PetscInt **first)
{
  PetscInt    mine = 0, at, *own;
  PetscMPIInt count, *counts, *offsets;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(model->n_own, &own, model->size, &counts, model->size + 1, &offsets));
  for (PetscInt i = 0; i < model->n_own; i++)
    if (part[i] == model->gid[i]) own[mine++] = part[i];
  count = (PetscMPIInt)mine;
  PetscCallMPI(MPI_Allgather(&count, 1, MPI_INT, counts, 1, MPI_INT, model->comm));
  offsets[0] = 0;
  for (PetscMPIInt r = 0; r < model->size; r++) offsets[r + 1] = offsets[r] + counts[r];
  *n_parts = offsets[model->size];
  PetscCall(PetscMalloc1(*n_parts, first));
  PetscCallMPI(MPI_Allgatherv(own, count, MPIU_INT, *first, counts, offsets, MPIU_INT, model->comm));
  PetscCall(PetscSortInt(*n_parts, *first));
  for (PetscInt i = 0; i < model->n_loc; i++) {
    PetscCall(PetscFindInt(part[i], *n_parts, *first, &at));
    part[i] = at;
  }
  PetscCall(PetscFree3(own, counts, offsets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Add words like "move along x" for the axes e for which |P e| = 1, P the projector on the n vectors of three numbers. */
static PetscErrorCode NameAxes(PetscInt n, PetscReal axis[][3], const char *verb, const char *preposition, char words[BASE_LINE])
{
  PetscInt  named = 0;
  char      more[256];
  PetscReal Q[3][3];
  PetscInt  rank = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n && rank < 3; k++) { /* orthonormal basis */
    PetscReal v[3] = {axis[k][0], axis[k][1], axis[k][2]}, size = 0;

    for (PetscInt j = 0; j < rank; j++) {
      const PetscReal dot = v[0] * Q[j][0] + v[1] * Q[j][1] + v[2] * Q[j][2];

      for (PetscInt i = 0; i < 3; i++) v[i] -= dot * Q[j][i];
    }
    for (PetscInt i = 0; i < 3; i++) size += v[i] * v[i];
    if (size < 1e-8) continue;
    for (PetscInt i = 0; i < 3; i++) Q[rank][i] = v[i] / PetscSqrtReal(size);
    rank++;
  }
  for (PetscInt e = 0; e < 3; e++) {
    PetscReal inside = 0;

    for (PetscInt j = 0; j < rank; j++) inside += Q[j][e] * Q[j][e];
    if (inside < 1 - 1e-6) continue;
    PetscCall(BaseFormat(more, "%s%s %s %c", words[0] ? " and " : "", verb, preposition, "xyz"[e]));
    PetscCall(PetscStrlcat(words, more, BASE_LINE));
    named++;
  }
  if (named < rank && !named) {
    PetscReal sign = 0;

    for (PetscInt i = 0; i < 3; i++) { /* the same words whatever the sign and round-off of an eigenvector */
      if (PetscAbsReal(Q[0][i]) < 1e-9) Q[0][i] = 0;
      if (sign == 0) sign = Q[0][i] > 0 ? 1 : Q[0][i] < 0 ? -1 : 0;
      if (Q[0][i] != 0) Q[0][i] *= sign;
    }
    PetscCall(BaseFormat(more, "%s%s %s (%.3g, %.3g, %.3g)", words[0] ? " and " : "", verb, preposition, (double)Q[0][0], (double)Q[0][1], (double)Q[0][2]));
    PetscCall(PetscStrlcat(words, more, BASE_LINE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Words for the free rigid motions of one part; G is overwritten. Order of motions: x, y, z, about x, about y, about z. */
static PetscErrorCode NameMotions(PetscInt dim, PetscReal *G, char words[BASE_LINE])
{
  const PetscBLASInt six = 6, room = 64;
  PetscBLASInt       info;
  PetscReal          lambda[6], work[64], trace = 0, free_motion[6][6], move[6][3], turn[6][3];
  PetscInt           n = 0, moves = 0, turns = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 6; k++) trace += G[7 * k];
  if (dim == 2)
    for (PetscInt k = 2; k < 5; k++) G[7 * k] = trace + 1; /* a plane body does not leave its plane */
  PetscCallBLAS("LAPACKsyev", LAPACKsyev_("V", "U", &six, G, &six, lambda, work, &room, &info));
  PetscCheck(!info, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev returned %d", (int)info);
  for (PetscInt k = 0; k < 6; k++)
    if (lambda[k] <= 1e-12 * trace) PetscCall(PetscArraycpy(free_motion[n++], &G[6 * k], 6));
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  /* motions without any turning: combinations of the free ones whose rotations cancel, found by elimination */
  for (PetscInt column = 3; column < 6; column++) {
    PetscInt pivot = turns;

    for (PetscInt k = turns; k < n; k++)
      if (PetscAbsReal(free_motion[k][column]) > PetscAbsReal(free_motion[pivot][column])) pivot = k;
    if (pivot >= n || PetscAbsReal(free_motion[pivot][column]) < 1e-6) continue;
    for (PetscInt i = 0; i < 6; i++) {
      const PetscReal swap = free_motion[pivot][i];

      free_motion[pivot][i] = free_motion[turns][i];
      free_motion[turns][i] = swap;
    }
    for (PetscInt k = 0; k < n; k++) {
      const PetscReal factor = free_motion[k][column] / free_motion[turns][column];

      for (PetscInt i = 0; i < 6 && k != turns; i++) free_motion[k][i] -= factor * free_motion[turns][i];
    }
    turns++;
  }
  for (PetscInt k = 0; k < turns; k++)
    for (PetscInt i = 0; i < 3; i++) turn[k][i] = free_motion[k][3 + i];
  for (PetscInt k = turns; k < n; k++, moves++)
    for (PetscInt i = 0; i < 3; i++) move[moves][i] = free_motion[k][i];
  PetscCall(NameAxes(moves, move, "move", "along", words));
  PetscCall(NameAxes(turns, turn, "turn", "about", words));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* words, empty when all is held: what the part called `where` can do. */
static PetscErrorCode FreeMotion(FemModel model, char words[BASE_LINE], char where[256])
{
  const PetscInt dim = model->dim;
  PetscInt      *part, *first, n_parts;
  PetscReal     *centre, *size, *G; /* centre [n_parts][4]: sum of x, count */

  PetscFunctionBegin;
  words[0] = 0;
  PetscCall(PetscStrncpy(where, "the body", 256));
  PetscCall(PetscMalloc1(model->n_loc, &part));
  PetscCall(FindParts(model, part));
  PetscCall(NumberParts(model, part, &n_parts, &first));
  PetscCall(PetscCalloc3(4 * n_parts, &centre, n_parts, &size, 36 * n_parts, &G));
  for (PetscInt i = 0; i < model->n_own; i++) {
    for (PetscInt d = 0; d < dim; d++) centre[4 * part[i] + d] += model->x[i * dim + d];
    centre[4 * part[i] + 3] += 1;
  }
  PetscCall(FemSum(model, 4 * n_parts, centre));
  for (PetscInt p = 0; p < n_parts; p++)
    for (PetscInt d = 0; d < 3; d++) centre[4 * p + d] /= centre[4 * p + 3];
  for (PetscInt i = 0; i < model->n_own; i++)
    for (PetscInt d = 0; d < dim; d++) size[part[i]] = PetscMax(size[part[i]], PetscAbsReal(model->x[i * dim + d] - centre[4 * part[i] + d]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, size, (PetscMPIInt)n_parts, MPIU_REAL, MPIU_MAX, model->comm));
  for (PetscInt k = 0; k < model->n_own * dim; k++) {
    const PetscInt i = k / dim, f = model->frame_of ? model->frame_of[i] : -1, p = part[i];
    PetscReal      s[3] = {0, 0, 0}, r[6] = {0, 0, 0, 0, 0, 0};

    if (FemHeld(model, k) < 0) continue;
    for (PetscInt d = 0; d < dim; d++) s[d] = (model->x[i * dim + d] - centre[4 * p + d]) / size[p];
    for (PetscInt d = 0; d < dim; d++) r[d] = f < 0 ? d == k % dim : model->frame[f * dim * dim + k % dim * dim + d];
    for (PetscInt d = 0; d < 3; d++) r[3 + d] = s[(d + 1) % 3] * r[(d + 2) % 3] - s[(d + 2) % 3] * r[(d + 1) % 3]; /* (e_d x s) . r */
    for (PetscInt a = 0; a < 6; a++)
      for (PetscInt b = 0; b < 6; b++) G[36 * p + 6 * a + b] += r[a] * r[b];
  }
  for (PetscInt e = 0; e < model->contact.n; e++) { /* planes hold one way only, friction up to its bound; the solution tells whether that is enough */
    const FemContact *c = &model->contact;
    const PetscInt    i = c->node[e], p = part[i], ways = c->direction && c->plane[c->of[e]].friction > 0 ? c->parts : 1;
    PetscReal         s[3] = {0, 0, 0}, r[6];

    for (PetscInt d = 0; d < dim; d++) s[d] = (model->x[i * dim + d] - centre[4 * p + d]) / size[p];
    for (PetscInt k = 0; k < ways; k++) {
      for (PetscInt d = 0; d < 3; d++) r[d] = k ? c->direction[3 * (c->parts * e + k) + d] : c->plane[c->of[e]].normal[d];
      for (PetscInt d = 0; d < 3; d++) r[3 + d] = s[(d + 1) % 3] * r[(d + 2) % 3] - s[(d + 2) % 3] * r[(d + 1) % 3];
      for (PetscInt a = 0; a < 6; a++)
        for (PetscInt b = 0; b < 6; b++) G[36 * p + 6 * a + b] += r[a] * r[b];
    }
  }
  PetscCall(FemSum(model, 36 * n_parts, G));
  for (PetscInt p = 0; p < n_parts && !words[0]; p++) {
    PetscCall(NameMotions(dim, &G[36 * p], words));
    if (words[0] && n_parts > 1)
      PetscCall(PetscSNPrintf(where, 256, "one of its %d unconnected parts, around (%.4g, %.4g, %.4g) m,", (int)n_parts, (double)centre[4 * p], (double)centre[4 * p + 1], (double)centre[4 * p + 2]));
  }
  PetscCall(PetscFree3(centre, size, G));
  PetscCall(PetscFree(first));
  PetscCall(PetscFree(part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemIsHeld(FemModel model, PetscBool *held)
{
  char words[BASE_LINE], where[256];

  PetscFunctionBegin;
  PetscCall(FreeMotion(model, words, where));
  *held = words[0] ? PETSC_FALSE : PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemCheckRigidMotion(FemModel model)
{
  char words[BASE_LINE], where[256];

  PetscFunctionBegin;
  PetscCall(FreeMotion(model, words, where));
  BaseCheckInput(!words[0], model->comm, "%s: %s can %s; fix it, or the static solution is not unique", model->source, where, words);
  PetscFunctionReturn(PETSC_SUCCESS);
}
