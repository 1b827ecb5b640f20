/*
  fem_operator.c - internal forces f = K u of owned nodes, in two ways; a third, in lanes, is fem_batch.c.

  Rows: K assembled once in block rows; a product streams it through memory. Elements: forces of each element from its
  stored shape gradients (an enhanced one from its stored stiffness), then summed into nodes from a list. Both run in threads over independent outputs and sum in
  global order, so threads and ranks do not change a bit. fem/README.md has the measured times.
*/
#include "fem_impl.h"

/* Elements around each owned node, ascending; entry = element*FEM_MAX_NODES + place in it. */
static PetscErrorCode BuildTouch(FemModel model, PetscInt **touch_start, PetscInt **touch)
{
  PetscInt *start, *list;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(model->n_own + 1, &start));
  for (PetscInt k = 0; k < model->cell_start[model->n_cells]; k++)
    if (model->cell_node[k] < model->n_own) start[model->cell_node[k] + 1]++;
  for (PetscInt i = 0; i < model->n_own; i++) start[i + 1] += start[i];
  PetscCall(PetscMalloc1(start[model->n_own], &list));
  for (PetscInt c = 0; c < model->n_cells; c++)
    for (PetscInt k = model->cell_start[c]; k < model->cell_start[c + 1]; k++) {
      const PetscInt i = model->cell_node[k];

      if (i < model->n_own) list[start[i]++] = c * FEM_MAX_NODES + k - model->cell_start[c];
    }
  for (PetscInt i = model->n_own; i > 0; i--) start[i] = start[i - 1];
  start[0]     = 0;
  *touch_start = start;
  *touch       = list;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BuildPattern(FemModel model)
{
  FemRows  *rows = &model->rows;
  PetscInt *touch_start, *touch, *seen, *key, room = 0;

  PetscFunctionBegin;
  PetscCall(BuildTouch(model, &touch_start, &touch));
  PetscCall(PetscMalloc1(model->n_loc, &seen));
  for (PetscInt i = 0; i < model->n_loc; i++) seen[i] = -1;
  PetscCall(PetscMalloc1(model->n_own + 1, &rows->start));
  PetscCall(PetscMalloc1(model->n_loc, &key));
  rows->start[0] = 0;
  rows->longest  = 0;
  for (PetscInt pass = 0; pass < 2; pass++) { /* count, then fill */
    if (pass) PetscCall(PetscMalloc1(rows->start[model->n_own], &rows->col));
    for (PetscInt i = 0; i < model->n_own; i++) {
      const PetscInt mark = pass * model->n_own + i;
      PetscInt       m    = 0;

      for (PetscInt k = touch_start[i]; k < touch_start[i + 1]; k++) {
        const PetscInt c = touch[k] / FEM_MAX_NODES;

        for (PetscInt e = model->cell_start[c]; e < model->cell_start[c + 1]; e++) {
          const PetscInt j = model->cell_node[e];

          if (seen[j] == mark) continue;
          seen[j] = mark;
          if (pass) {
            rows->col[rows->start[i] + m] = j;
            key[m]                        = model->gid[j];
          }
          m++;
        }
      }
      if (pass) PetscCall(PetscSortIntWithArray(m, key, &rows->col[rows->start[i]]));
      else {
        room += m;
        rows->start[i + 1] = room;
        rows->longest      = PetscMax(rows->longest, m);
      }
    }
  }
  PetscCall(PetscFree(key));
  PetscCall(PetscFree(seen));
  PetscCall(PetscFree(touch_start));
  PetscCall(PetscFree(touch));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Entry of col[] in row i that is node j. */
PetscInt FemRowsColumn(const FemModel model, PetscInt i, PetscInt j)
{
  PetscInt low = model->rows.start[i], high = model->rows.start[i + 1] - 1;

  while (low < high) {
    const PetscInt middle = (low + high) / 2;

    if (model->gid[model->rows.col[middle]] < model->gid[j]) low = middle + 1;
    else high = middle;
  }
  return low;
}

PetscErrorCode FemRowsCreate(FemModel model)
{
  FemRows *rows = &model->rows;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(FEM_Assemble, 0, 0, 0, 0));
  PetscCall(BuildPattern(model));
  PetscCall(PetscMalloc1((size_t)rows->start[model->n_own] * model->dim * model->dim, &rows->value));
  PetscCall(FemRowsFill(model, NULL, PETSC_TRUE, rows->value));
  PetscCall(PetscLogEventEnd(FEM_Assemble, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemRowsFill(FemModel model, const PetscBool *flag, PetscBool take, PetscReal *all)
{
  const PetscInt dim = model->dim;
  PetscReal      K[FEM_MAX_DOFS * FEM_MAX_DOFS];

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(all, (size_t)model->rows.start[model->n_own] * dim * dim));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
    const PetscInt *node = &model->cell_node[model->cell_start[c]], n = shape->nodes * dim;

    if (flag && flag[model->cell_gid[c]] != take) continue;
    FemCellStiffness(model, c, K);
    for (PetscInt a = 0; a < shape->nodes; a++) {
      const PetscInt i = node[a];

      if (i >= model->n_own) continue;
      for (PetscInt b = 0; b < shape->nodes; b++) {
        PetscReal *value = &all[(size_t)FemRowsColumn(model, i, node[b]) * dim * dim];

        for (PetscInt p = 0; p < dim; p++)
          for (PetscInt q = 0; q < dim; q++) value[p * dim + q] += K[(a * dim + p) * n + b * dim + q];
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemRowsDestroy(FemModel model)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(model->rows.start));
  PetscCall(PetscFree(model->rows.col));
  PetscCall(PetscFree(model->rows.value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemElementsCreate(FemModel model)
{
  const PetscInt dim    = model->dim;
  PetscInt       points = 0, entries = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(model->n_cells, &model->cell_point, model->n_cells, &model->cell_at));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);

    model->cell_point[c] = points;
    model->cell_at[c]    = entries;
    points += shape->points;
    entries += FemCellEnhanced(model, c) ? PetscSqr(shape->nodes * dim) : shape->points * shape->nodes * dim;
  }
  if (model->method == FEM_STATIC) points = entries = 0; /* few products: geometry is worked out anew each time */
  PetscCall(PetscMalloc3(points, &model->cell_w, entries, &model->cell_dN, (size_t)model->cell_start[model->n_cells] * dim, &model->cell_f));
  for (PetscInt c = 0; c < model->n_cells && points; c++)
    if (FemCellEnhanced(model, c)) FemCellStiffness(model, c, &model->cell_dN[model->cell_at[c]]);
    else FemCellGeometry(model, c, &model->cell_dN[model->cell_at[c]], &model->cell_w[model->cell_point[c]]);
  PetscCall(BuildTouch(model, &model->touch_start, &model->touch));
  PetscCall(FemCorotateCreate(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemElementsDestroy(FemModel model)
{
  PetscFunctionBegin;
  PetscCall(PetscFree2(model->cell_point, model->cell_at));
  PetscCall(PetscFree3(model->cell_w, model->cell_dN, model->cell_f));
  PetscCall(PetscFree(model->touch_start));
  PetscCall(PetscFree(model->touch));
  PetscCall(FemCorotateDestroy(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  f = K u by block rows.  Eq. (2.9)

  start [n+1], col, value  FemRows; u [][dim], f [n][dim] out
  One stream through value, and a sum for each of its dim x dim places, so that no addition waits for the one before. Rows
  kept as dim long dot products vectorise better and run slower (0.29 against 0.17 us per hex8): three streams at once.
*/
static void RowsTimes3(PetscInt from, PetscInt to, const PetscInt *restrict start, const PetscInt *restrict col, const PetscReal *restrict value, const PetscReal *restrict u, PetscReal *restrict f)
{
  for (PetscInt i = from; i < to; i++) {
    PetscReal xx = 0, xy = 0, xz = 0, yx = 0, yy = 0, yz = 0, zx = 0, zy = 0, zz = 0;

    for (PetscInt b = start[i]; b < start[i + 1]; b++) {
      const PetscReal *K = &value[(size_t)9 * b], x = u[3 * col[b]], y = u[3 * col[b] + 1], z = u[3 * col[b] + 2];

      xx += K[0] * x;
      xy += K[1] * y;
      xz += K[2] * z;
      yx += K[3] * x;
      yy += K[4] * y;
      yz += K[5] * z;
      zx += K[6] * x;
      zy += K[7] * y;
      zz += K[8] * z;
    }
    f[3 * i]     = xx + xy + xz;
    f[3 * i + 1] = yx + yy + yz;
    f[3 * i + 2] = zx + zy + zz;
  }
}

static void RowsTimes2(PetscInt from, PetscInt to, const PetscInt *restrict start, const PetscInt *restrict col, const PetscReal *restrict value, const PetscReal *restrict u, PetscReal *restrict f)
{
  for (PetscInt i = from; i < to; i++) {
    PetscReal xx = 0, xy = 0, yx = 0, yy = 0;

    for (PetscInt b = start[i]; b < start[i + 1]; b++) {
      const PetscReal *K = &value[(size_t)4 * b], x = u[2 * col[b]], y = u[2 * col[b] + 1];

      xx += K[0] * x;
      xy += K[1] * y;
      yx += K[2] * x;
      yy += K[3] * y;
    }
    f[2 * i]     = xx + xy;
    f[2 * i + 1] = yx + yy;
  }
}

static void ApplyRows(FemModel model, const PetscReal *u, PetscReal *f)
{
  const FemRows *rows = &model->rows;
  const PetscInt n = model->n_own, block = 256;

#pragma omp parallel for schedule(static) num_threads(model->threads)
  for (PetscInt b = 0; b < (n + block - 1) / block; b++) {
    if (model->dim == 2) RowsTimes2(b * block, PetscMin(n, (b + 1) * block), rows->start, rows->col, rows->value, u, f);
    else RowsTimes3(b * block, PetscMin(n, (b + 1) * block), rows->start, rows->col, rows->value, u, f);
  }
}

void FemCellStoredForce(FemModel model, PetscInt c, const PetscReal *ue, PetscReal *f)
{
  const PetscReal *at = &model->cell_dN[model->cell_at[c]];
  const PetscInt   n  = (model->cell_start[c + 1] - model->cell_start[c]) * model->dim;

  if (!FemCellEnhanced(model, c)) FemForce(FemShapeGet((MeshCellType)model->cell_type[c]), &model->law[model->cell_material[c]], at, &model->cell_w[model->cell_point[c]], ue, f);
  else
    for (PetscInt i = 0; i < n; i++) {
      PetscReal sum = 0;

      for (PetscInt j = 0; j < n; j++) sum += at[i * n + j] * ue[j];
      f[i] = sum;
    }
}

/* cell_f at displacement u */
static void CellForces(FemModel model, const PetscReal *u)
{
#pragma omp parallel for schedule(static) num_threads(model->threads)
  for (PetscInt c = 0; c < model->n_cells; c++) {
    PetscReal ue[FEM_MAX_DOFS], *f = &model->cell_f[model->cell_start[c] * model->dim];

    FemCellGather(model, c, u, ue);
    if (model->method == FEM_EXPLICIT) FemCellStoredForce(model, c, ue, f);
    else FemCellForce(model, c, ue, f);
  }
}

static PetscErrorCode ApplyElements(FemModel model, const PetscReal *u, PetscReal *f)
{
  const PetscInt threads = model->threads, dim = model->dim;

  PetscFunctionBegin;
  if (model->corotate.on && !model->corotate.linear) {
    PetscInt bad = FemCorotateForces(model, u);

    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &bad, 1, MPIU_INT, MPI_MIN, model->comm));
    PetscCheck(bad == PETSC_MAX_INT, model->comm, PETSC_ERR_FP, "%s: element %d of the body is turned inside out; the step is too long, or the load too much for elastic elements", model->source, (int)bad);
  } else CellForces(model, u);
#pragma omp parallel for schedule(static) num_threads(threads)
  for (PetscInt i = 0; i < model->n_own; i++) {
    PetscReal sum[3] = {0, 0, 0};

    for (PetscInt k = model->touch_start[i]; k < model->touch_start[i + 1]; k++) {
      const PetscInt at = model->cell_start[model->touch[k] / FEM_MAX_NODES] + model->touch[k] % FEM_MAX_NODES;

      for (PetscInt d = 0; d < dim; d++) sum[d] += model->cell_f[at * dim + d];
    }
    for (PetscInt d = 0; d < dim; d++) f[i * dim + d] = sum[d];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemApply(FemModel model, const PetscReal *u, PetscReal *f)
{
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(FEM_Force, 0, 0, 0, 0));
  if (model->batches) FemBatchesApply(model, u, f);
  else if (model->rows.value) ApplyRows(model, u, f);
  else PetscCall(ApplyElements(model, u, f));
  PetscCall(PetscLogEventEnd(FEM_Force, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal FemDot(FemModel model, const PetscReal *a, const PetscReal *b)
{
  const PetscInt n   = model->n_own * model->dim;
  PetscReal      sum = 0;

#pragma omp simd reduction(+ : sum)
  for (PetscInt k = 0; k < n; k++) sum += a[k] * b[k];
  return sum;
}

PetscErrorCode FemSum(FemModel model, PetscInt n, PetscReal *value)
{
  PetscFunctionBegin;
  if (model->size > 1) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value, (PetscMPIInt)n, MPIU_REAL, MPIU_SUM, model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
