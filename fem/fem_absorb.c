/*
  fem_absorb.c - sides that let waves out (Lysmer and Kuhlemeyer): dashpots rho c_p along the normal, rho c_s across it.  Eqs (2.60)-(2.62)

  A node of such sides carries the sum over its facets as one dim x dim block. Explicit steps solve that block with the node's mass for the
  mean velocity of the step: the drag is centred like (2.17), takes energy at any step size, and leaves the critical step as it is.
*/
#include "fem_impl.h"
#include <petscblaslapack.h>

PetscErrorCode FemModelAddAbsorber(FemModel model, const char *name)
{
  PetscInt        g;
  const FemGroup *group;

  PetscFunctionBegin;
  PetscCheck(model && model->has_mesh && !model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Absorbing sides are named between FemModelSetMesh() and FemModelSetUp()");
  PetscCall(FemFindGroup(model, name, &g));
  group = &model->group[g];
  BaseCheckInput(group->dim == model->dim - 1, model->comm, "%s: group '%s' has dimension %d; an absorbing side is a group of dimension %d", model->source, name, (int)group->dim, (int)model->dim - 1);
  BaseCheckInput(!group->loose, model->comm, "%s: %d cells of group '%s' are not a side of any element of the body; nothing can be absorbed there", model->source, (int)group->loose, name);
  BaseCheckInput(!group->interior, model->comm, "%s: %d cells of group '%s' lie inside the body; an absorbing side is a free side", model->source, (int)group->interior, name);
  PetscCall(PetscRealloc(sizeof(PetscInt) * (model->absorb.n_groups + 1), &model->absorb.group));
  model->absorb.group[model->absorb.n_groups++] = g;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Z [3][3] = (rho Gamma)^(1/2), Gamma_ik = n_j C_ijkl n_l: traction per velocity of plane waves along n, whatever the law [N s/m3].  Eq. (2.60) */
static void Impedance(PetscInt dim, const FemElastic *law, PetscReal density, const PetscReal n[3], PetscReal Z[9])
{
  static const PetscInt voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
  const PetscBLASInt    three = 3, room = 64;
  PetscBLASInt          info;
  PetscReal             gamma[9] = {0}, square[3], work[64];

  for (PetscInt k = 0; k < dim; k++) {
    PetscReal e[6] = {0}, s[6];

    for (PetscInt i = 0; i < dim; i++) e[voigt[k][i]] += n[i]; /* the strain of a jump along k: engineering shear */
    FemStress(law, dim, e, s);
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) gamma[3 * i + k] += s[voigt[i][j]] * n[j];
  }
  LAPACKsyev_("V", "U", &three, gamma, &three, square, work, &room, &info); /* rows become the directions of motion */
  for (PetscInt i = 0; i < 9; i++) Z[i] = 0;
  for (PetscInt m = 0; m < 3; m++)
    for (PetscInt i = 0; i < 9; i++) Z[i] += PetscSqrtReal(density * PetscMax(square[m], 0)) * gamma[3 * m + i / 3] * gamma[3 * m + i % 3];
}

/* Add one facet's dashpots to the blocks [n_loc][dim][dim]. Nodal areas are int N_a dA, or where some are negative (sides of eight
   nodes) their absolute values scaled to the same sum: a dashpot must not push. */
static void AddFacet(FemModel model, PetscInt cell, const FemShape *shape, PetscInt face, PetscReal *block)
{
  const PetscInt    dim = model->dim, n = shape->face_nodes[face];
  PetscReal         x[3 * FEM_MAX_FACE_NODES] = {0}, area[FEM_MAX_FACE_NODES], vector[3 * FEM_MAX_FACE_NODES], normal[3] = {0, 0, 0}, Z[9], size = 0, sum = 0, positive = 0;
  PetscInt          node[FEM_MAX_FACE_NODES];

  for (PetscInt a = 0; a < n; a++) {
    node[a] = model->cell_node[model->cell_start[cell] + shape->face[face][a]];
    for (PetscInt d = 0; d < dim; d++) x[a * dim + d] = model->x[node[a] * dim + d];
  }
  FemFaceIntegrals(dim, n, x, model->thickness, area, vector);
  for (PetscInt a = 0; a < n; a++) {
    sum += area[a];
    positive += PetscAbsReal(area[a]);
    for (PetscInt d = 0; d < dim; d++) normal[d] += vector[a * dim + d];
  }
  for (PetscInt d = 0; d < dim; d++) size += normal[d] * normal[d];
  for (PetscInt d = 0; d < dim; d++) normal[d] /= PetscSqrtReal(size);
  Impedance(dim, &model->law[model->cell_material[cell]], model->region[model->cell_material[cell]].material.density, normal, Z);
  for (PetscInt a = 0; a < n; a++)
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) block[(node[a] * dim + i) * dim + j] += PetscAbsReal(area[a]) * sum / positive * Z[3 * i + j];
}

PetscErrorCode FemSetUpAbsorbers(FemModel model)
{
  FemAbsorb     *ab  = &model->absorb;
  const PetscInt dim = model->dim;
  PetscReal     *block;
  PetscBool     *used;

  PetscFunctionBegin;
  if (!ab->n_groups) PetscFunctionReturn(PETSC_SUCCESS);
  BaseCheckInput(model->method != FEM_STATIC, model->comm, "Group '%s' absorbs waves, and a static body has none", model->group[ab->group[0]].name);
  BaseCheckInput(model->local == 0, model->comm, "Group '%s' absorbs waves, and local damping takes them too, in its own way; keep one", model->group[ab->group[0]].name);
  PetscCall(PetscCalloc2((size_t)model->n_loc * dim * dim, &block, model->n_loc, &used));
  for (PetscInt k = 0; k < ab->n_groups; k++) {
    const FemGroup *group = &model->group[ab->group[k]];

    for (PetscInt f = 0; f < group->n_facets; f++) {
      const PetscInt  c     = group->facet_cell[f];
      const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);

      AddFacet(model, c, shape, group->facet_face[f], block);
      for (PetscInt a = 0; a < shape->face_nodes[group->facet_face[f]]; a++) used[model->cell_node[model->cell_start[c] + shape->face[group->facet_face[f]][a]]] = PETSC_TRUE;
    }
  }
  for (PetscInt i = 0; i < model->n_own; i++) ab->n += used[i];
  PetscCall(PetscMalloc2(ab->n, &ab->node, ab->n * dim * dim, &ab->block));
  ab->n = 0;
  for (PetscInt i = 0; i < model->n_own; i++) {
    if (!used[i]) continue;
    PetscCall(PetscArraycpy(&ab->block[ab->n * dim * dim], &block[i * dim * dim], dim * dim));
    ab->node[ab->n++] = i;
  }
  PetscCall(PetscFree2(block, used));
  if (model->method == FEM_EXPLICIT) PetscCall(PetscCalloc2(ab->n * dim, &ab->force, model->n_own * dim, &ab->outside));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f [n_own*dim] += C v */
void FemAbsorbTimes(FemModel model, const PetscReal *v, PetscReal *f)
{
  const FemAbsorb *ab  = &model->absorb;
  const PetscInt   dim = model->dim;

  for (PetscInt j = 0; j < ab->n; j++)
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt k = 0; k < dim; k++) f[ab->node[j] * dim + i] += ab->block[(j * dim + i) * dim + k] * v[ab->node[j] * dim + k];
}

/* value += scale C on the diagonal blocks of model->rows' pattern */
void FemAbsorbAddToRows(FemModel model, PetscReal scale, PetscReal *value)
{
  const FemAbsorb *ab = &model->absorb;
  const PetscInt   dd = model->dim * model->dim;

  for (PetscInt j = 0; j < ab->n; j++)
    for (PetscInt e = 0; e < dd; e++) value[(size_t)FemRowsColumn(model, ab->node[j], ab->node[j]) * dd + e] += scale * ab->block[j * dd + e];
}

/* Forces from outside that an explicit level sees: f_ext, with the dashpots' and the planes' where there are any. */
const PetscReal *FemOutside(FemModel model)
{
  return model->contact.outside ? model->contact.outside : model->absorb.outside ? model->absorb.outside : model->f_ext;
}

/*
  Dashpot forces of the coming level, -C vm with vm = (v- + v+)/2 (at the start v0), from (m + h C/2) v+ = (m - h C/2) v- + h F.  Eq. (2.61)

  before, after [s] half of the last and of the coming step; place: where prescribed dofs go. Seen along the node's own axes; a prescribed
  component is known, its row is dropped.
*/
void FemAbsorbLevel(FemModel model, PetscReal before, PetscReal after, const PetscReal *place)
{
  FemAbsorb      *ab  = &model->absorb;
  const PetscInt  dim = model->dim;
  const PetscReal h   = before + after, alpha = model->alpha;

  for (PetscInt j = 0; j < ab->n; j++) {
    const PetscInt   first = ab->node[j] * dim;
    const PetscInt   frame = model->frame_of ? model->frame_of[ab->node[j]] : -1;
    const PetscReal *C = &ab->block[j * dim * dim], m = model->mass[ab->node[j]], *v = &model->v[first];
    PetscReal        A[3][3], b[3], mean[3], Q[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

    for (PetscInt i = 0; i < dim && frame >= 0; i++)
      for (PetscInt e = 0; e < dim; e++) Q[i][e] = model->frame[(frame * dim + i) * dim + e];
    for (PetscInt i = 0; i < dim; i++) { /* unknown: the mean velocity; with alpha's drag as in (2.17) */
      const PetscInt fix = FemHeld(model, first + i);
      PetscReal      u = 0, speed = 0, force = 0;

      for (PetscInt d = 0; d < dim; d++) {
        u += Q[i][d] * model->u[first + d];
        speed += Q[i][d] * v[d];
        force += Q[i][d] * (model->f_app[first + d] + model->f_ext[first + d] - model->f_int[first + d]);
      }
      for (PetscInt e = 0; e < dim; e++) {
        A[i][e] = i == e ? fix >= 0 ? 1 : m * (2 / h + alpha) : 0;
        for (PetscInt p = 0; p < dim && fix < 0; p++)
          for (PetscInt q = 0; q < dim; q++) A[i][e] += Q[i][p] * C[p * dim + q] * Q[e][q];
      }
      b[i] = fix >= 0 ? 0.5 * (speed + (after > 0 ? (place[fix] - u) / (2 * after) : speed)) : 2 * m / h * speed + force;
    }
    for (PetscInt p = 0; p < dim; p++) /* elimination; the matrix is positive definite on free components */
      for (PetscInt i = p + 1; i < dim; i++) {
        const PetscReal factor = A[i][p] / A[p][p];

        for (PetscInt e = p; e < dim; e++) A[i][e] -= factor * A[p][e];
        b[i] -= factor * b[p];
      }
    for (PetscInt i = dim - 1; i >= 0; i--) {
      mean[i] = b[i];
      for (PetscInt e = i + 1; e < dim; e++) mean[i] -= A[i][e] * mean[e];
      mean[i] /= A[i][i];
    }
    if (!(before > 0))
      for (PetscInt i = 0; i < dim; i++) mean[i] = Q[i][0] * v[0] + Q[i][1] * v[1] + (dim == 3 ? Q[i][2] * v[2] : 0); /* the start: drag of v0 alone, as in (2.17) */
    for (PetscInt i = 0; i < dim; i++) {
      PetscReal *force = &ab->force[j * dim + i];

      *force = 0;
      for (PetscInt e = 0; e < dim; e++)
        for (PetscInt p = 0; p < dim; p++) *force -= C[i * dim + e] * Q[p][e] * mean[p];
    }
  }
  for (PetscInt k = 0; k < model->n_own * dim; k++) ab->outside[k] = model->f_ext[k];
  for (PetscInt j = 0; j < ab->n; j++)
    for (PetscInt i = 0; i < dim; i++) ab->outside[ab->node[j] * dim + i] += ab->force[j * dim + i];
}

/* Energy the dashpots take over the half steps before and after the level, as (2.19): added to sum [4]; v_next is known.  Eq. (2.62) */
void FemAbsorbBook(FemModel model, PetscReal before, PetscReal after, PetscReal sum[4])
{
  const FemAbsorb *ab  = &model->absorb;
  const PetscInt   dim = model->dim;

  for (PetscInt j = 0; j < ab->n; j++)
    for (PetscInt i = 0; i < dim; i++) {
      const PetscInt  k = ab->node[j] * dim + i;
      const PetscReal v = model->v[k], next = model->v_next[k];

      sum[2] -= ab->force[j * dim + i] * before * v;
      sum[3] -= ab->force[j * dim + i] * after * (before > 0 ? next : 0.5 * (v + next));
    }
}

PetscErrorCode FemAbsorbDestroy(FemModel model)
{
  FemAbsorb *ab = &model->absorb;

  PetscFunctionBegin;
  PetscCall(PetscFree(ab->group));
  PetscCall(PetscFree2(ab->node, ab->block));
  PetscCall(PetscFree2(ab->force, ab->outside));
  PetscFunctionReturn(PETSC_SUCCESS);
}
