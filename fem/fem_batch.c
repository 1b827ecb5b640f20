/*
  fem_batch.c - a model's elements dealt into batches, and f = K u by them.  Theory 2.15
*/
#include "fem_impl.h"

/* Corners are measured in 2^-36 of the cell's size, so that cells of one shape agree to the bit and share one block. */
#define SHAPE_BITS 36

/* In the order batches are made: along is a place on the curve, or 0. */
typedef struct {
  PetscInt   kind, type, material, cell;
  PetscInt64 along;
} Key;

static int ByKey(const void *a, const void *b)
{
  const Key *p = a, *q = b;

  if (p->kind != q->kind) return p->kind < q->kind ? -1 : 1;
  if (p->type != q->type) return p->type < q->type ? -1 : 1;
  if (p->material != q->material) return p->material < q->material ? -1 : 1;
  if (p->along != q->along) return p->along < q->along ? -1 : 1;
  return p->cell < q->cell ? -1 : p->cell > q->cell;
}

/* Places of elements on a Z-curve through the body's box: 20 bits of each coordinate of the first corner, woven. */
static PetscErrorCode Along(FemModel model, Key *key)
{
  const PetscInt dim = model->dim;
  PetscReal      box[6];

  PetscFunctionBegin;
  for (PetscInt d = 0; d < 3; d++) box[d] = box[3 + d] = PETSC_MAX_REAL;
  for (PetscInt i = 0; i < model->n_own; i++)
    for (PetscInt d = 0; d < dim; d++) {
      box[d]     = PetscMin(box[d], model->x[i * dim + d]);
      box[3 + d] = PetscMin(box[3 + d], -model->x[i * dim + d]);
    }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, box, 6, MPIU_REAL, MPIU_MIN, model->comm));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const PetscReal *x = &model->x[model->cell_node[model->cell_start[c]] * dim];

    for (PetscInt d = 0; d < dim; d++) {
      PetscInt at = (PetscInt)(1048575 * (x[d] - box[d]) / PetscMax(-box[3 + d] - box[d], PETSC_SMALL));

      for (PetscInt b = 0; b < 20; b++) key[c].along |= (PetscInt64)(at >> b & 1) << (b * dim + d);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every middle node in the middle? */
static PetscBool IsStraight(const FemShape *shape, const PetscReal *x)
{
  const PetscInt dim  = shape->dim;
  PetscReal      size = 0, worst = 0;

  for (PetscInt d = 0; d < dim; d++)
    for (PetscInt a = 1; a < shape->corners; a++) size = PetscMax(size, PetscAbsReal(x[a * dim + d] - x[d]));
  for (PetscInt a = shape->corners; a < shape->nodes; a++) {
    PetscInt       parent[8];
    const PetscInt n = MeshCellParents(shape->type, a, parent);

    for (PetscInt d = 0; d < dim; d++) {
      PetscReal off = x[a * dim + d];

      for (PetscInt k = 0; k < n; k++) off -= x[parent[k] * dim + d] / n;
      worst = PetscMax(worst, PetscAbsReal(off));
    }
  }
  return worst <= 1e-12 * size ? PETSC_TRUE : PETSC_FALSE;
}

static FemBatchKind KindOf(FemModel model, PetscInt c)
{
  const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
  PetscReal       x[FEM_MAX_DOFS];

  if (shape->type == MESH_HEX8) return FEM_BATCH_HEX8;
  if (FemCellEnhanced(model, c)) return FEM_BATCH_DENSE;
  if (shape->type != MESH_TET10) return FEM_BATCH_POINTS;
  FemCellGather(model, c, model->x, x);
  return IsStraight(shape, x) ? FEM_BATCH_TET10 : FEM_BATCH_POINTS;
}

static PetscReal Share(FemModel model, PetscInt c)
{
  return model->cell_weight ? model->cell_weight[model->cell_gid[c]] : 1;
}

/* J^-1 [dim][dim] and det J of reference gradients dN. */
static PetscReal InverseAt(PetscInt nodes, PetscInt dim, const PetscReal *x, const PetscReal dN[][3], PetscReal *inverse)
{
  PetscReal J[3][3] = {{0}}, det;

  for (PetscInt a = 0; a < nodes; a++)
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) J[i][j] += x[a * dim + i] * dN[a][j];
  if (dim == 2) {
    det        = J[0][0] * J[1][1] - J[0][1] * J[1][0];
    inverse[0] = J[1][1] / det;
    inverse[1] = -J[0][1] / det;
    inverse[2] = -J[1][0] / det;
    inverse[3] = J[0][0] / det;
    return det;
  }
  det = J[0][0] * (J[1][1] * J[2][2] - J[1][2] * J[2][1]) - J[0][1] * (J[1][0] * J[2][2] - J[1][2] * J[2][0]) + J[0][2] * (J[1][0] * J[2][1] - J[1][1] * J[2][0]);
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) {
      const PetscInt r = (j + 1) % 3, t = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;

      inverse[3 * i + j] = (J[r][c] * J[t][d] - J[r][d] * J[t][c]) / det;
    }
  return det;
}

/* Corners from the first, in units of 2^-36 of the cell's size; the size is a power of 2. */
static void Measure(FemModel model, PetscInt c, PetscReal *unit, PetscReal x[24])
{
  PetscReal size = 0;
  int       power;

  FemCellGather(model, c, model->x, x);
  for (PetscInt k = 3; k < 24; k++) x[k] -= x[k % 3];
  x[0] = x[1] = x[2] = 0;
  for (PetscInt k = 3; k < 24; k++) size = PetscMax(size, PetscAbsReal(x[k]));
  (void)frexp(size, &power);
  *unit = ldexp(1, power - SHAPE_BITS);
  for (PetscInt k = 3; k < 24; k++) x[k] = rint(x[k] / *unit);
}

/* Constants of a hex8 from its measured corners: the same bits for the same shape, wherever it lies. */
static PetscErrorCode Hex8Constants(FemModel model, PetscInt c, PetscReal *constant)
{
  const FemShape   *shape = FemShapeGet(MESH_HEX8);
  const FemElastic *law   = &model->law[model->cell_material[c]];
  PetscReal         x[24], unit, dN[8 * 24], w[8], K[24 * 24], b[24] = {0}, volume = 0;
  FemModes          modes;
  PetscBool         sound;

  PetscFunctionBegin;
  Measure(model, c, &unit, x);
  for (PetscInt k = 0; k < 24; k++) x[k] *= unit;
  (void)FemGradients(shape, x, 1, dN, w);
  for (PetscInt q = 0; q < 8; q++) w[q] *= Share(model, c);
  if (FemCellEnhanced(model, c)) {
    FemModesCreate(shape, law, x, w, &modes);
    FemModesStiffness(shape, law, dN, w, &modes, K);
  } else FemStiffness(shape, law, dN, w, K);
  for (PetscInt q = 0; q < 8; q++) {
    volume += w[q];
    for (PetscInt k = 0; k < 24; k++) b[k] += w[q] * dN[q * 24 + k];
  }
  for (PetscInt k = 0; k < 24; k++) b[k] /= volume;
  sound = FemBatchHex8(K, b, volume, x, constant);
  PetscCheck(sound, PETSC_COMM_SELF, PETSC_ERR_FP, "%s: element %d is too distorted for the fast hex8 kernel; run with -- -fem_batches 0", model->source, (int)model->cell_gid[c]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the kernel keeps of one element. */
static PetscErrorCode Constants(FemModel model, FemBatchKind kind, PetscInt c, PetscReal *constant)
{
  const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
  const PetscInt  dim   = shape->dim;
  PetscReal       x[FEM_MAX_DOFS];

  PetscFunctionBegin;
  if (kind == FEM_BATCH_HEX8) PetscCall(Hex8Constants(model, c, constant));
  else if (kind == FEM_BATCH_DENSE) FemCellStiffness(model, c, constant);
  else {
    const PetscReal thick = (dim == 2 ? model->thickness : 1) * Share(model, c);

    FemCellGather(model, c, model->x, x);
    if (kind == FEM_BATCH_TET10) {
      const FemShape *line = FemShapeGet(MESH_TET4);

      constant[9] = InverseAt(4, 3, x, line->dN[0], constant) / 6 * thick;
    } else
      for (PetscInt q = 0; q < shape->points; q++) {
        PetscReal *at = &constant[q * (dim * dim + 1)];

        at[dim * dim] = InverseAt(shape->nodes, dim, x, shape->dN[q], at) * shape->weight[q] * thick;
      }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Are all lanes of two batches one shape? Then the blocks are equal too. */
static PetscBool SameShapes(FemModel model, const FemBatches *s, const FemBatch *p, const FemBatch *q)
{
  PetscReal first[24], x[24], unit, other;

  if (p->kind != FEM_BATCH_HEX8 || q->kind != FEM_BATCH_HEX8 || p->material != q->material) return PETSC_FALSE;
  Measure(model, s->cell[p->first], &unit, first);
  for (PetscInt k = 0; k < p->n + q->n; k++) {
    const PetscInt c = s->cell[k < p->n ? p->first + k : q->first + k - p->n];

    Measure(model, c, &other, x);
    if (other != unit || Share(model, c) != Share(model, s->cell[p->first])) return PETSC_FALSE;
    for (PetscInt i = 0; i < 24; i++)
      if (x[i] != first[i]) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* Constants of all batches; one that is of the same shape throughout as the last such shares its block. */
static PetscErrorCode FillConstants(FemModel model, FemBatches *s)
{
  PetscInt  last = -1;
  PetscReal one[FEM_MAX_DOFS * FEM_MAX_DOFS];

  PetscFunctionBegin;
  s->n_constants = 0;
  for (PetscInt b = 0; b < s->n; b++) {
    FemBatch *batch = &s->batch[b];

    batch->owns = PETSC_TRUE;
    if (batch->kind == FEM_BATCH_HEX8 && SameShapes(model, s, batch, last < 0 ? batch : &s->batch[last])) {
      if (last >= 0) {
        batch->constant = s->batch[last].constant;
        batch->owns     = PETSC_FALSE;
        continue;
      }
      last = b;
    } else if (batch->kind == FEM_BATCH_HEX8 && SameShapes(model, s, batch, batch)) last = b;
    batch->constant = s->n_constants;
    s->n_constants += FemBatchConstants(batch->kind, FemShapeGet(batch->type));
  }
  PetscCall(PetscMalloc1((s->n_constants + 1) * FEM_LANES, &s->room));
  s->constant = (FemLanes *)(((size_t)s->room + sizeof(FemLanes) - 1) / sizeof(FemLanes) * sizeof(FemLanes));
  for (PetscInt b = 0; b < s->n; b++) {
    const FemBatch *batch = &s->batch[b];
    const PetscInt  m     = FemBatchConstants(batch->kind, FemShapeGet(batch->type));
    PetscReal      *to    = (PetscReal *)&s->constant[batch->constant];

    for (PetscInt l = 0; l < FEM_LANES && batch->owns; l++) {
      if (l < batch->n) PetscCall(Constants(model, batch->kind, s->cell[batch->first + l], one)); /* lanes without an element repeat the last */
      for (PetscInt k = 0; k < m; k++) to[k * FEM_LANES + l] = one[k];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which forces of which batch and lane add to each owned node, in the order one thread would add them. */
static PetscErrorCode FillTouch(FemModel model, FemBatches *s)
{
  const PetscInt dim = model->dim;
  PetscInt      *start;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(model->n_own + 2, &s->touch_start));
  start = s->touch_start + 1;
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt b = 0; b < s->n; b++) {
      const FemBatch *batch = &s->batch[b];

      for (PetscInt l = 0; l < batch->n; l++)
        for (PetscInt a = 0; a < MeshCellNodes(batch->type); a++) {
          const PetscInt i = model->cell_node[model->cell_start[s->cell[batch->first + l]] + a];

          if (i >= model->n_own) continue;
          if (pass) s->touch[start[i]++] = batch->node * dim + a * dim * FEM_LANES + l;
          else start[i + 1]++;
        }
    }
    if (pass) break;
    for (PetscInt i = 0; i < model->n_own; i++) start[i + 1] += start[i];
    PetscCall(PetscMalloc1(start[model->n_own], &s->touch));
  }
  PetscCall(PetscMalloc1((size_t)s->n_node * dim, &s->force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemBatchesCreate(FemModel model, PetscBool sort)
{
  FemBatches *s;
  Key        *key;
  PetscInt    nodes = 0, met = 0;

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  PetscCall(PetscMalloc1(model->n_cells, &key));
  for (PetscInt c = 0; c < model->n_cells; c++) key[c] = (Key){(PetscInt)KindOf(model, c), model->cell_type[c], model->cell_material[c], c, 0};
  if (sort) PetscCall(Along(model, key));
  qsort(key, model->n_cells, sizeof(Key), ByKey);
  PetscCall(PetscMalloc2(model->n_cells, &s->batch, model->n_cells, &s->cell));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    FemBatch *batch = &s->batch[s->n - 1];

    s->cell[c] = key[c].cell;
    if (c && batch->n < FEM_LANES && (FemBatchKind)key[c].kind == batch->kind && (MeshCellType)key[c].type == batch->type && key[c].material == batch->material) batch->n++;
    else {
      s->batch[s->n++] = (FemBatch){(FemBatchKind)key[c].kind, (MeshCellType)key[c].type, key[c].material, 1, c, nodes, 0, PETSC_TRUE};
      nodes += MeshCellNodes((MeshCellType)key[c].type) * FEM_LANES;
    }
  }
  PetscCall(PetscFree(key));
  s->n_node = nodes;
  PetscCall(PetscMalloc1(nodes, &s->node));
  if (sort) {
    PetscCall(PetscMalloc3(model->n_loc, &s->place, model->n_loc * model->dim, &s->u, model->n_loc * model->dim, &s->f));
    for (PetscInt i = 0; i < model->n_loc; i++) s->place[i] = -1;
    for (PetscInt c = 0; c < model->n_cells; c++)
      for (PetscInt k = model->cell_start[s->cell[c]]; k < model->cell_start[s->cell[c] + 1]; k++)
        if (s->place[model->cell_node[k]] < 0) s->place[model->cell_node[k]] = met++;
  }
  for (PetscInt b = 0; b < s->n; b++) {
    const FemBatch *batch = &s->batch[b];

    for (PetscInt a = 0; a < MeshCellNodes(batch->type); a++)
      for (PetscInt l = 0; l < FEM_LANES; l++) {
        const PetscInt c = s->cell[batch->first + PetscMin(l, batch->n - 1)];

        s->node[batch->node + a * FEM_LANES + l] = model->cell_node[model->cell_start[c] + a];
        if (sort) s->node[batch->node + a * FEM_LANES + l] = s->place[s->node[batch->node + a * FEM_LANES + l]];
        s->node[batch->node + a * FEM_LANES + l] *= model->dim;
      }
  }
  PetscCall(FillConstants(model, s));
  if (model->threads > 1) PetscCall(FillTouch(model, s));
  model->batches = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where every element is a hex8 and none turns: rows would stream 2 kB of K for each. Same answer on all ranks. */
PetscErrorCode FemBatchesWanted(FemModel model, PetscBool *wanted)
{
  PetscInt  other = 0;
  PetscBool given;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < model->n_cells; c++) other += model->cell_type[c] != MESH_HEX8;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &other, 1, MPIU_INT, MPI_SUM, model->comm));
  *wanted = other || model->operator != FEM_ROWS ? PETSC_FALSE : PETSC_TRUE;
  PetscCall(PetscOptionsGetBool(NULL, "fem_", "-batches", wanted, &given));
  if (model->corotate.on || model->operator != FEM_ROWS || model->cell_weight) *wanted = PETSC_FALSE; /* a coupled body may take sub-steps, by rows */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemBatchesDestroy(FemModel model)
{
  FemBatches *s = model->batches;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree2(s->batch, s->cell));
  PetscCall(PetscFree(s->node));
  PetscCall(PetscFree3(s->place, s->u, s->f));
  PetscCall(PetscFree(s->room));
  PetscCall(PetscFree(s->touch_start));
  PetscCall(PetscFree(s->touch));
  PetscCall(PetscFree(s->force));
  PetscCall(PetscFree(model->batches));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline FemLanes Pick(const PetscReal *u, const PetscInt *node)
{
#if FEM_LANES == 8
  return (FemLanes){u[node[0]], u[node[1]], u[node[2]], u[node[3]], u[node[4]], u[node[5]], u[node[6]], u[node[7]]};
#else
  return (FemLanes){u[node[0]], u[node[1]], u[node[2]], u[node[3]]};
#endif
}

/* Forces of one batch at displacement u into f [nodes][dim] lanes. */
static inline void BatchForce(FemModel model, const FemBatches *s, const FemBatch *batch, const PetscReal *u, FemLanes *f)
{
  const FemShape *shape = FemShapeGet(batch->type);
  const PetscInt  dim = model->dim, *node = &s->node[batch->node];
  FemLanes        ue[FEM_MAX_DOFS];

  for (PetscInt a = 0; a < shape->nodes; a++)
    for (PetscInt d = 0; d < dim; d++) ue[a * dim + d] = Pick(u + d, &node[a * FEM_LANES]);
  FemBatchForce(batch->kind, shape, &model->law[batch->material], &s->constant[batch->constant], ue, f);
}

/* f += forces of one batch; n: beyond are ghosts, where places are not used. */
static inline void Spread(PetscInt nodes, PetscInt dim, PetscInt lanes, PetscInt n, const PetscInt *node, const FemLanes *fe, PetscReal *f)
{
  const PetscReal *from = (const PetscReal *)fe;

  for (PetscInt l = 0; l < lanes; l++)
    for (PetscInt a = 0; a < nodes; a++) {
      const PetscInt at = node[a * FEM_LANES + l];

      if (at >= n) continue;
      for (PetscInt d = 0; d < dim; d++) f[at + d] += from[(a * dim + d) * FEM_LANES + l];
    }
}

static void ApplyAlone(FemModel model, const FemBatches *s, const PetscReal *u, PetscReal *f, PetscInt n)
{
  for (PetscInt k = 0; k < n; k++) f[k] = 0;
  for (PetscInt b = 0; b < s->n; b++) {
    const FemBatch *batch = &s->batch[b];
    const PetscInt *node  = &s->node[batch->node], nodes = MeshCellNodes(batch->type);
    FemLanes        fe[FEM_MAX_DOFS];

    BatchForce(model, s, batch, u, fe);
    if (model->dim == 3) Spread(nodes, 3, batch->n, n, node, fe, f);
    else Spread(nodes, 2, batch->n, n, node, fe, f);
  }
}

static void ApplyTogether(FemModel model, const FemBatches *s, const PetscReal *u, PetscReal *f)
{
  const PetscInt dim = model->dim;

#pragma omp parallel num_threads(model->threads)
  {
#pragma omp for schedule(static)
    for (PetscInt b = 0; b < s->n; b++) {
      const FemBatch *batch = &s->batch[b];
      FemLanes        fe[FEM_MAX_DOFS];

      BatchForce(model, s, batch, u, fe);
      memcpy(&s->force[(size_t)batch->node * dim], fe, sizeof(FemLanes) * MeshCellNodes(batch->type) * dim);
    }
#pragma omp for schedule(static)
    for (PetscInt i = 0; i < model->n_own; i++) {
      PetscReal sum[3] = {0, 0, 0};

      for (PetscInt k = s->touch_start[i]; k < s->touch_start[i + 1]; k++)
        for (PetscInt d = 0; d < dim; d++) sum[d] += s->force[s->touch[k] + d * FEM_LANES];
      for (PetscInt d = 0; d < dim; d++) f[i * dim + d] = sum[d];
    }
  }
}

void FemBatchesApply(FemModel model, const PetscReal *u, PetscReal *f)
{
  const FemBatches *s   = model->batches;
  const PetscInt    dim = model->dim;
  PetscReal        *own = s->place ? s->f : f;

  for (PetscInt i = 0; i < model->n_loc && s->place; i++)
    for (PetscInt d = 0; d < dim; d++) s->u[s->place[i] * dim + d] = u[i * dim + d];
  if (s->touch) ApplyTogether(model, s, s->place ? s->u : u, f);
  else {
    ApplyAlone(model, s, s->place ? s->u : u, own, (s->place ? model->n_loc : model->n_own) * dim);
    for (PetscInt i = 0; i < model->n_own && s->place; i++)
      for (PetscInt d = 0; d < dim; d++) f[i * dim + d] = s->f[s->place[i] * dim + d];
  }
}
