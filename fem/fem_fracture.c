/*
  fem_fracture.c - energy release rate of a crack along its own direction: Rice's J as an integral over a ring of elements.

  The contour integral times a function q, 1 about the tip and 0 outside the ring, is by Gauss's theorem an integral over
  the ring alone, where the elements' stress is good.  Eq. (2.95), docs/theory.md; Li, Shih and Needleman, Eng. Fract. Mech. 21 (1985) 405
*/
#include "fem_recover.h"

/* 1 inside the ring, 0 outside, falling in proportion to the distance from the front between */
static PetscReal Share(const FemCrack *crack, PetscInt dim, const PetscReal *x)
{
  PetscReal r[3] = {0, 0, 0}, along = 0, distance = 0;

  for (PetscInt d = 0; d < dim; d++) r[d] = x[d] - crack->tip[d];
  if (dim == 3)
    for (PetscInt d = 0; d < 3; d++) along += r[d] * crack->front[d];
  for (PetscInt d = 0; d < dim; d++) distance += PetscSqr(r[d] - (dim == 3 ? along * crack->front[d] : 0));
  return PetscMin(1, PetscMax(0, (crack->outer - PetscSqrtReal(distance)) / (crack->outer - crack->inner)));
}

/* [J]: int (s_ij u_j,1 - W d_1i) q_,i dV of one element; 1 is the direction of the crack */
static PetscReal RingEnergy(FemModel model, PetscInt cell, const FemPoints *points, const FemCrack *crack, const PetscReal *q)
{
  const FemShape   *shape = FemShapeGet((MeshCellType)model->cell_type[cell]);
  const FemElastic *law   = &model->law[model->cell_material[cell]];
  const PetscInt    dim = model->dim, voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
  PetscReal         sum = 0;
  FemReading        reading;

  FemReadCell(model, cell, PETSC_TRUE, &reading);
  for (PetscInt p = 0; p < points->n; p++) {
    PetscReal       dN[FEM_MAX_DOFS], at[3], s[6], full[6], slope[3] = {0, 0, 0}, dq[3] = {0, 0, 0}, work = 0, ahead = 0;
    const PetscReal dV = points->w[p] * FemRawStress(model, &reading, points, p, s, at) * (dim == 2 ? model->thickness : 1);

    (void)FemPointMap(shape, reading.x, points->N[p], points->grad[p], dN, at);
    FemStressExpand(dim, law, s, full, NULL);
    for (PetscInt a = 0; a < shape->nodes; a++) {
      PetscReal dN1 = 0;

      for (PetscInt i = 0; i < dim; i++) {
        dN1 += dN[a * dim + i] * crack->direction[i];
        dq[i] += dN[a * dim + i] * q[a];
      }
      for (PetscInt j = 0; j < dim; j++) slope[j] += reading.u[a * dim + j] * dN1;
    }
    for (PetscInt i = 0; i < dim; i++) {
      for (PetscInt j = 0; j < dim; j++) work += full[voigt[i][j]] * slope[j] * dq[i];
      ahead += crack->direction[i] * dq[i];
    }
    sum += dV * (work - 0.5 * FemStressNorm(dim, law, s) * ahead);
  }
  return sum;
}

static PetscReal Length(PetscInt dim, const PetscReal v[3])
{
  PetscReal sum = 0;

  for (PetscInt d = 0; d < dim; d++) sum += v[d] * v[d];
  return PetscSqrtReal(sum);
}

PetscErrorCode FemModelGetJ(FemModel model, const FemCrack *crack, PetscReal *J)
{
  FemPoints *points[MESH_PRISM15 + 1] = {NULL};
  FemCrack   c                        = *crack;
  PetscReal  sum[2]                   = {0, 0}, width, size; /* [J]; elements in the ring */

  PetscFunctionBegin;
  PetscCheck(model && model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetUp() first");
  PetscCheck(!model->pre.n, model->comm, PETSC_ERR_SUP, "J is not covered for a body with in-situ stress or temperature");
  width = model->dim == 2 ? model->thickness : c.length;
  PetscCheck(c.inner >= 0 && c.outer > c.inner && width > 0, model->comm, PETSC_ERR_ARG_OUTOFRANGE, "The ring of J has 0 <= inner < outer, and a crack in space a front of some length; not %.6g, %.6g, %.6g m", (double)c.inner, (double)c.outer, (double)width);
  size = Length(model->dim, c.direction);
  PetscCheck(size > 0, model->comm, PETSC_ERR_ARG_OUTOFRANGE, "The crack needs a direction");
  for (PetscInt d = 0; d < 3; d++) c.direction[d] /= size;
  if (model->dim == 3) {
    PetscReal across = 0;

    size = Length(3, c.front);
    PetscCheck(size > 0, model->comm, PETSC_ERR_ARG_OUTOFRANGE, "A crack in space needs the direction of its front");
    for (PetscInt d = 0; d < 3; d++) {
      c.front[d] /= size;
      across += c.front[d] * c.direction[d];
    }
    PetscCheck(PetscAbsReal(across) < 1e-8, model->comm, PETSC_ERR_ARG_OUTOFRANGE, "A crack goes square to its front");
  }
  for (PetscInt k = 0; k < model->n_cells; k++) {
    const MeshCellType type  = (MeshCellType)model->cell_type[k];
    const FemShape    *shape = FemShapeGet(type);
    PetscReal          q[FEM_MAX_NODES];
    PetscBool          ring = PETSC_FALSE;

    if (!model->own[k]) continue;
    for (PetscInt a = 0; a < shape->nodes; a++) {
      q[a] = Share(&c, model->dim, &model->x[model->cell_node[model->cell_start[k] + a] * model->dim]);
      ring = (PetscBool)(ring || q[a] != q[0]);
    }
    if (!ring) continue; /* q does not change: nothing to add */
    if (!points[type]) {
      PetscCall(PetscCalloc1(1, &points[type]));
      points[type]->n = shape->points;
      PetscCall(PetscArraycpy(points[type]->xi, shape->xi, shape->points));
      PetscCall(PetscArraycpy(points[type]->w, shape->weight, shape->points));
      FemPointsFill(type, points[type]);
    }
    sum[0] += (model->cell_weight ? model->cell_weight[model->cell_gid[k]] : 1) * RingEnergy(model, k, points[type], &c, q);
    sum[1] += 1;
  }
  for (PetscInt t = 0; t <= MESH_PRISM15; t++) PetscCall(PetscFree(points[t]));
  PetscCall(FemSum(model, 2, sum));
  PetscCheck(sum[1] > 0, model->comm, PETSC_ERR_ARG_OUTOFRANGE, "No element touches the ring of J from %.6g to %.6g m around its tip", (double)c.inner, (double)c.outer);
  *J = (c.half ? 2 : 1) * sum[0] / width;
  PetscFunctionReturn(PETSC_SUCCESS);
}
