/*
  fem_batch.c - a model's elements dealt into batches, and f = K u by them.  Theory 2.15
*/
#include "fem_impl.h"

/* Hexahedra whose corners agree to 2^-36 of their size are one shape and share one block of constants, that of the first of
   them in the whole mesh; where there are more shapes than this each keeps its own. */
#define SHAPE_BITS 36
#define SHAPE_MOST 256

typedef struct {
  PetscReal key[25]; /* corners from the first in units of 2^-36 of the size, and the unit [m] */
  PetscReal x[24];   /* of the first such element */
  PetscReal first;   /* its global number */
} Shape;

/* In the order batches are made: shape among those shared, or -1; along is a place on the curve, or 0. */
typedef struct {
  PetscInt   kind, type, material, shape, cell;
  PetscInt64 along;
} Key;

static int ByKey(const void *a, const void *b)
{
  const Key *p = a, *q = b;

  if (p->kind != q->kind) return p->kind < q->kind ? -1 : 1;
  if (p->type != q->type) return p->type < q->type ? -1 : 1;
  if (p->material != q->material) return p->material < q->material ? -1 : 1;
  if (p->shape != q->shape) return p->shape < q->shape ? -1 : 1;
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
  if (FemCellKind(model, c) == FEM_OWN_VOLUME) return FEM_BATCH_VOLUME;
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

/* What makes a hex8 the same shape as another; x [8][3] its corners from the first. */
static void Measure(FemModel model, PetscInt c, PetscReal x[24], PetscReal key[25])
{
  PetscReal size = 0;
  int       power;

  FemCellGather(model, c, model->x, x);
  for (PetscInt k = 3; k < 24; k++) x[k] -= x[k % 3];
  x[0] = x[1] = x[2] = 0;
  for (PetscInt k = 3; k < 24; k++) size = PetscMax(size, PetscAbsReal(x[k]));
  (void)frexp(size, &power);
  key[24] = ldexp(1, power - SHAPE_BITS);
  for (PetscInt k = 0; k < 24; k++) key[k] = rint(x[k] / key[24]);
}

/* The place of a shape in the list, appended when new; -1 when there are too many. */
static PetscInt Place(const Shape *one, PetscInt *n, Shape *list)
{
  for (PetscInt k = 0; k < *n; k++) {
    if (memcmp(list[k].key, one->key, sizeof(one->key))) continue;
    if (one->first < list[k].first) list[k] = *one;
    return k;
  }
  if (*n == SHAPE_MOST) return -1;
  list[*n] = *one;
  return (*n)++;
}

static int ByFirst(const void *a, const void *b)
{
  const PetscReal p = ((const Shape *)a)->first, q = ((const Shape *)b)->first;

  return p < q ? -1 : p > q;
}

/* All shapes of the mesh by their first element, the same list on every rank; n = 0 when they are too many. list [SHAPE_MOST] */
static PetscErrorCode Shapes(FemModel model, PetscInt *n, Shape *list)
{
  const PetscInt width = sizeof(Shape) / sizeof(PetscReal);
  PetscInt       many  = model->cell_weight ? 1 : 0;
  Shape          one, *all;
  PetscMPIInt    mine, *count, *at;

  PetscFunctionBegin;
  *n = 0;
  for (PetscInt c = 0; c < model->n_cells && !many; c++) {
    if (model->cell_type[c] != MESH_HEX8) continue;
    Measure(model, c, one.x, one.key);
    for (PetscInt k = 0; k < 24; k++) one.key[k] += 0.; /* no negative zero */
    one.first = model->cell_gid[c];
    many      = Place(&one, n, list) < 0;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &many, 1, MPIU_INT, MPI_MAX, model->comm));
  if (many) *n = 0;
  if (model->size > 1 && !many) {
    PetscCall(PetscMalloc3(model->size, &count, model->size + 1, &at, SHAPE_MOST * model->size, &all));
    mine = (PetscMPIInt)(*n * width);
    PetscCallMPI(MPI_Allgather(&mine, 1, MPI_INT, count, 1, MPI_INT, model->comm));
    at[0] = 0;
    for (PetscMPIInt r = 0; r < model->size; r++) at[r + 1] = at[r] + count[r];
    PetscCallMPI(MPI_Allgatherv(list, mine, MPIU_REAL, all, count, at, MPIU_REAL, model->comm));
    *n = 0;
    for (PetscInt k = 0; k < at[model->size] / width && !many; k++) many = Place(&all[k], n, list) < 0;
    if (many) *n = 0;
    PetscCall(PetscFree3(count, at, all));
  }
  qsort(list, *n, sizeof(Shape), ByFirst);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Constants of a hex8 from its corners x, those of its shape where it has one. */
static PetscErrorCode Hex8Constants(FemModel model, PetscInt c, const PetscReal x[24], PetscReal *constant)
{
  const FemShape   *shape = FemShapeGet(MESH_HEX8);
  const FemElastic *law   = &model->law[model->cell_material[c]];
  PetscReal         dN[8 * 24], w[8], K[24 * 24], b[24] = {0}, volume = 0;
  FemModes          modes;
  PetscBool         sound;

  PetscFunctionBegin;
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
static PetscErrorCode Constants(FemModel model, FemBatchKind kind, PetscInt c, const Shape *form, PetscReal *constant)
{
  const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
  const PetscInt  dim   = shape->dim;
  PetscReal       x[FEM_MAX_DOFS], key[25];

  PetscFunctionBegin;
  if (kind == FEM_BATCH_HEX8) {
    Measure(model, c, x, key);
    PetscCall(Hex8Constants(model, c, form ? form->x : x, constant));
  } else if (kind == FEM_BATCH_DENSE) FemCellStiffness(model, c, constant);
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
    if (kind == FEM_BATCH_VOLUME) {
      PetscReal w[FEM_MAX_POINTS], *psi = &constant[shape->points * (dim * dim + 1)];
      FemVolume volume;

      for (PetscInt q = 0; q < shape->points; q++) w[q] = constant[q * (dim * dim + 1) + dim * dim];
      FemVolumeCreate(shape, x, w, &volume);
      for (PetscInt q = 0; q < shape->points; q++)
        for (PetscInt m = 0; m <= dim; m++) psi[q * (dim + 1) + m] = volume.psi[q][m];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Constants of all batches; shape [SHAPE_MOST] */
static PetscErrorCode FillConstants(FemModel model, FemBatches *s, const Shape *shape)
{
  PetscReal one[FEM_MAX_DOFS * FEM_MAX_DOFS];

  PetscFunctionBegin;
  s->n_constants = 0;
  for (PetscInt b = 0; b < s->n; b++) {
    FemBatch *batch = &s->batch[b];

    batch->owns     = b && batch->shape >= 0 && batch[-1].shape == batch->shape && batch[-1].material == batch->material ? PETSC_FALSE : PETSC_TRUE;
    batch->constant = batch->owns ? s->n_constants : batch[-1].constant;
    if (batch->owns) s->n_constants += FemBatchConstants(batch->kind, FemShapeGet(batch->type));
  }
  PetscCall(PetscMalloc1((s->n_constants + 1) * FEM_LANES, &s->room));
  s->constant = (FemLanes *)(((size_t)s->room + sizeof(FemLanes) - 1) / sizeof(FemLanes) * sizeof(FemLanes));
  for (PetscInt b = 0; b < s->n; b++) {
    const FemBatch *batch = &s->batch[b];
    const PetscInt  m     = FemBatchConstants(batch->kind, FemShapeGet(batch->type));
    PetscReal      *to    = (PetscReal *)&s->constant[batch->constant];

    for (PetscInt l = 0; l < FEM_LANES && batch->owns; l++) { /* lanes without an element repeat the last; one shape is one block in all lanes */
      if (l == 0 || (l < batch->n && batch->shape < 0)) PetscCall(Constants(model, batch->kind, s->cell[batch->first + l], batch->shape < 0 ? NULL : &shape[batch->shape], one));
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
  Shape      *shape;
  PetscInt    nodes = 0, met = 0, n_shapes;

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  PetscCall(PetscMalloc1(SHAPE_MOST, &shape));
  PetscCall(Shapes(model, &n_shapes, shape));
  PetscCall(PetscMalloc1(model->n_cells, &key));
  for (PetscInt c = 0; c < model->n_cells; c++) key[c] = (Key){(PetscInt)KindOf(model, c), model->cell_type[c], model->cell_material[c], -1, c, 0};
  for (PetscInt c = 0; c < model->n_cells && n_shapes; c++) {
    Shape one = {.first = PETSC_MAX_REAL};

    if (model->cell_type[c] != MESH_HEX8) continue;
    Measure(model, c, one.x, one.key);
    for (PetscInt k = 0; k < 24; k++) one.key[k] += 0.;
    key[c].shape = Place(&one, &n_shapes, shape);
  }
  if (sort) PetscCall(Along(model, key));
  qsort(key, model->n_cells, sizeof(Key), ByKey);
  PetscCall(PetscMalloc2(model->n_cells, &s->batch, model->n_cells, &s->cell));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    FemBatch *batch = &s->batch[s->n - 1];

    s->cell[c] = key[c].cell;
    if (c && batch->n < FEM_LANES && (FemBatchKind)key[c].kind == batch->kind && (MeshCellType)key[c].type == batch->type && key[c].material == batch->material && key[c].shape == batch->shape) batch->n++;
    else {
      s->batch[s->n++] = (FemBatch){(FemBatchKind)key[c].kind, (MeshCellType)key[c].type, key[c].material, key[c].shape, 1, c, nodes, 0, PETSC_TRUE};
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
  PetscCall(FillConstants(model, s, shape));
  PetscCall(PetscFree(shape));
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
