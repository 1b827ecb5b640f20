/*
  fem_multigrid.c - K u = f of a body of quadratic elements, without its matrix.  Theory 2.16

  Conjugate gradients on K as batches of elements apply it (fem_batch.c), preconditioned by two levels of PETSc's PCMG: a
  polynomial smoother on the diagonal, and below it the linear functions of the corners, a seventh of the unknowns in
  tetrahedra, whose matrix is assembled and given to GAMG with the rigid-body modes. What the linear functions cannot carry
  is short and local, so the smoother takes it whatever the mesh size: iterations do not grow.

  A middle node is the mean of its parents, in the body's axes; nodes with a frame are turned before and after. Held dofs
  are identity rows on both levels and zero in what passes between them.
*/
#include "fem_impl.h"

struct _FemMultigrid {
  Mat        move;         /* corners to all nodes, eq. (2.110), and by its transpose back */
  Mat        coarse;       /* of the linear functions, eq. (2.111) */
  PetscInt   n_own, n_loc; /* corners: owned, with ghosts */
  PetscInt  *node;         /* [n_loc] their local nodes, owned first */
  PetscInt  *corner;       /* [model->n_loc] index into node, -1: a middle node */
  PetscInt  *up_start, *up;     /* [model->n_loc + 1] parents of each local middle node, local nodes */
  PetscInt  *down_start, *down; /* [n_own + 1] middle nodes that have this owned corner as a parent */
  PetscInt   n_held, *held;     /* owned dofs */
  PetscReal *u, *f;             /* [model->n_loc*dim] work */
  Vec        diagonal;
};

/* Zero where held: of a vector seen from frames. */
static void FreeOnly(const FemMultigrid g, PetscReal *a)
{
  for (PetscInt k = 0; k < g->n_held; k++) a[g->held[k]] = 0;
}

/* y = K x on free dofs, d x on held ones */
static PetscErrorCode Times(Mat K, Vec x, Vec y)
{
  FemModel           model;
  FemMultigrid       g;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(K, &model));
  g = model->multigrid;
  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArrayWrite(y, &to));
  PetscCall(PetscArraycpy(g->u, from, model->n_own * model->dim));
  FreeOnly(g, g->u);
  FemOutOfFrames(model, g->u);
  PetscCall(FemGhosts(model, g->u));
  FemBatchesApply(model, g->u, to);
  FemIntoFrames(model, to);
  for (PetscInt k = 0; k < g->n_held; k++) to[g->held[k]] = model->diagonal * from[g->held[k]];
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscCall(VecRestoreArrayWrite(y, &to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetDiagonal(Mat K, Vec d)
{
  FemModel model;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(K, &model));
  PetscCall(VecCopy(model->multigrid->diagonal, d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Corners to all nodes.  Eq. (2.110) */
static PetscErrorCode Prolong(Mat P, Vec x, Vec y)
{
  FemModel           model;
  FemMultigrid       g;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(P, &model));
  g = model->multigrid;
  const PetscInt dim = model->dim, n = model->n_own * dim;

  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArrayWrite(y, &to));
  PetscCall(PetscArrayzero(g->u, n));
  for (PetscInt i = 0; i < g->n_own; i++)
    for (PetscInt d = 0; d < dim; d++) g->u[g->node[i] * dim + d] = from[i * dim + d];
  FreeOnly(g, g->u);
  FemOutOfFrames(model, g->u);
  PetscCall(FemGhosts(model, g->u));
  for (PetscInt i = 0; i < model->n_own; i++) {
    const PetscInt m = g->up_start[i + 1] - g->up_start[i];

    for (PetscInt d = 0; d < dim; d++) {
      PetscReal sum = m ? 0 : g->u[i * dim + d];

      for (PetscInt k = g->up_start[i]; k < g->up_start[i + 1]; k++) sum += g->u[g->up[k] * dim + d] / m;
      to[i * dim + d] = sum;
    }
  }
  FemIntoFrames(model, to);
  FreeOnly(g, to);
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscCall(VecRestoreArrayWrite(y, &to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The transpose: forces of middle nodes to their parents. */
static PetscErrorCode Restrict(Mat P, Vec x, Vec y)
{
  FemModel           model;
  FemMultigrid       g;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(P, &model));
  g = model->multigrid;
  const PetscInt dim = model->dim;

  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArrayWrite(y, &to));
  PetscCall(PetscArraycpy(g->u, from, model->n_own * dim));
  FreeOnly(g, g->u);
  FemOutOfFrames(model, g->u);
  PetscCall(FemGhosts(model, g->u));
  PetscCall(PetscArrayzero(g->f, model->n_own * dim));
  for (PetscInt i = 0; i < g->n_own; i++)
    for (PetscInt d = 0; d < dim; d++) {
      PetscReal sum = g->u[g->node[i] * dim + d];

      for (PetscInt k = g->down_start[i]; k < g->down_start[i + 1]; k++) sum += g->u[g->down[k] * dim + d] / (g->up_start[g->down[k] + 1] - g->up_start[g->down[k]]);
      g->f[g->node[i] * dim + d] = sum;
    }
  FemIntoFrames(model, g->f);
  FreeOnly(g, g->f);
  for (PetscInt i = 0; i < g->n_own; i++)
    for (PetscInt d = 0; d < dim; d++) to[i * dim + d] = g->f[g->node[i] * dim + d];
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscCall(VecRestoreArrayWrite(y, &to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Corners and the parents of middle nodes, from the elements kept here: all around an owned corner are. */
static PetscErrorCode FindCorners(FemModel model, FemMultigrid g)
{
  PetscInt *parents; /* [n_loc] how many; 0 a corner */
  PetscInt *child;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(model->n_loc, &parents, model->n_loc, &child));
  PetscCall(PetscMalloc2(model->n_loc, &g->corner, model->n_loc, &g->node));
  PetscCall(PetscCalloc1(model->n_loc + 1, &g->up_start));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
    PetscInt        parent[8];

    for (PetscInt a = shape->corners; a < shape->nodes; a++) parents[model->cell_node[model->cell_start[c] + a]] = MeshCellParents(shape->type, a, parent);
  }
  for (PetscInt i = 0; i < model->n_loc; i++) {
    g->up_start[i + 1] = g->up_start[i] + parents[i];
    g->corner[i]       = parents[i] ? -1 : g->n_loc;
    if (!parents[i]) {
      g->node[g->n_loc++] = i;
      if (i < model->n_own) g->n_own++;
    }
  }
  PetscCall(PetscMalloc1(g->up_start[model->n_loc], &g->up));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
    const PetscInt *node  = &model->cell_node[model->cell_start[c]];
    PetscInt        parent[8];

    for (PetscInt a = shape->corners; a < shape->nodes; a++)
      for (PetscInt k = 0, n = MeshCellParents(shape->type, a, parent); k < n; k++) g->up[g->up_start[node[a]] + k] = node[parent[k]];
  }
  PetscCall(PetscCalloc1(g->n_own + 1, &g->down_start));
  for (PetscInt pass = 0; pass < 2; pass++) {
    PetscCall(PetscArrayzero(child, model->n_loc));
    for (PetscInt i = 0; i < model->n_loc; i++)
      for (PetscInt k = g->up_start[i]; k < g->up_start[i + 1]; k++) {
        const PetscInt c = g->corner[g->up[k]];

        if (c < 0 || c >= g->n_own) continue;
        if (pass) g->down[g->down_start[c] + child[c]] = i;
        child[c]++;
      }
    if (pass) break;
    for (PetscInt c = 0; c < g->n_own; c++) g->down_start[c + 1] = g->down_start[c] + child[c];
    PetscCall(PetscMalloc1(g->down_start[g->n_own], &g->down));
  }
  PetscCall(PetscFree2(parents, child));
  for (PetscInt pass = 0; pass < 2; pass++) {
    g->n_held = 0;
    for (PetscInt k = 0; k < model->n_own * model->dim; k++)
      if (FemHeld(model, k) >= 0) {
        if (pass) g->held[g->n_held] = k;
        g->n_held++;
      }
    if (!pass) PetscCall(PetscMalloc1(g->n_held, &g->held));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A diagonal block in the axes of node i's frame: Q block Q' */
static void IntoFrame(const FemModel model, PetscInt i, PetscReal *block)
{
  const PetscInt  dim = model->dim, f = model->frame_of ? model->frame_of[i] : -1;
  const PetscReal *Q  = &model->frame[f < 0 ? 0 : f * dim * dim];
  PetscReal        half[9] = {0}, full[9] = {0};

  if (f < 0) return;
  for (PetscInt p = 0; p < dim; p++)
    for (PetscInt q = 0; q < dim; q++)
      for (PetscInt d = 0; d < dim; d++) half[p * dim + q] += Q[p * dim + d] * block[d * dim + q];
  for (PetscInt p = 0; p < dim; p++)
    for (PetscInt q = 0; q < dim; q++)
      for (PetscInt d = 0; d < dim; d++) full[p * dim + q] += half[p * dim + d] * Q[q * dim + d];
  for (PetscInt k = 0; k < dim * dim; k++) block[k] = full[k];
}

/* Blocks [n_own][dim][dim] on the diagonal of K, in the body's axes: of each element int B_a'C B_a for its nodes. A straight
   tet10 needs four points, whatever its rule has. */
static PetscErrorCode DiagonalBlocks(FemModel model, PetscReal *block)
{
  static const PetscReal near = 0.5854101966249685, far = 0.1381966011250105; /* (5 + 3 sqrt 5)/20, (5 - sqrt 5)/20 */
  const PetscInt         dim  = model->dim;
  FemShape              *four;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(1, &four));
  if (dim == 3) {
    *four        = *FemShapeGet(MESH_TET10);
    four->points = 4;
    for (PetscInt q = 0; q < 4; q++) {
      PetscReal N[FEM_MAX_NODES];

      for (PetscInt i = 0; i < 3; i++) four->xi[q][i] = q == i + 1 ? near : far;
      four->weight[q] = 1. / 24;
      FemShapeAt(MESH_TET10, four->xi[q], N, four->dN[q]);
    }
  }
  for (PetscInt b = 0; b < model->batches->n; b++) {
    const FemBatch   *batch = &model->batches->batch[b];
    const FemShape   *shape = batch->kind == FEM_BATCH_TET10 ? four : FemShapeGet(batch->type);
    const FemElastic *law   = &model->law[batch->material];

    for (PetscInt k = 0; k < batch->n; k++) {
      const PetscInt c = model->batches->cell[batch->first + k], *node = &model->cell_node[model->cell_start[c]];
      PetscReal      x[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS];

      FemCellGather(model, c, model->x, x);
      (void)FemGradients(shape, x, model->thickness, dN, w);
      if (batch->kind == FEM_BATCH_VOLUME) {
        FemVolume volume;
        PetscReal own[FEM_MAX_NODES * 9];

        for (PetscInt q = 0; q < shape->points && model->cell_weight; q++) w[q] *= model->cell_weight[model->cell_gid[c]];
        FemVolumeCreate(shape, x, w, &volume);
        FemVolumeBlocks(shape, law, dN, w, &volume, own);
        for (PetscInt a = 0; a < shape->nodes; a++)
          for (PetscInt e = 0; e < dim * dim && node[a] < model->n_own; e++) block[(size_t)node[a] * dim * dim + e] += own[a * dim * dim + e];
        continue;
      }
      for (PetscInt q = 0; q < shape->points; q++)
        for (PetscInt a = 0; a < shape->nodes; a++) {
          const PetscReal *g  = &dN[(q * shape->nodes + a) * dim], weight = w[q] * (model->cell_weight ? model->cell_weight[model->cell_gid[c]] : 1);
          PetscReal       *to = &block[(size_t)node[a] * dim * dim], dot = 0;

          if (node[a] >= model->n_own) continue;
          if (law->general) {
            for (PetscInt j = 0; j < dim; j++) {
              PetscReal e[6] = {0}, s[6], t[3][3];

              e[j] = g[j];
              if (dim == 2) e[3] = g[1 - j];
              else {
                e[3 + j]           = g[(j + 1) % 3];
                e[3 + (j + 2) % 3] = g[(j + 2) % 3];
              }
              FemStress(law, dim, e, s);
              for (PetscInt i = 0; i < 3; i++) {
                t[i][i]           = weight * s[i];
                t[i][(i + 1) % 3] = t[(i + 1) % 3][i] = weight * s[3 + i];
              }
              for (PetscInt i = 0; i < dim; i++)
                for (PetscInt d = 0; d < dim; d++) to[i * dim + j] += t[i][d] * g[d];
            }
            continue;
          }
          for (PetscInt i = 0; i < dim; i++) dot += g[i] * g[i];
          for (PetscInt i = 0; i < dim; i++)
            for (PetscInt j = 0; j < dim; j++) to[i * dim + j] += weight * ((law->lambda + law->mu) * g[i] * g[j] + (i == j ? law->mu * dot : 0));
        }
    }
  }
  PetscCall(PetscFree(four));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The diagonal of the operator, and model->diagonal: what held dofs carry. */
static PetscErrorCode FillDiagonal(FemModel model, FemMultigrid g)
{
  const PetscInt dim     = model->dim;
  PetscReal      largest = 0, *block;
  PetscScalar   *d;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1((size_t)model->n_own * dim * dim, &block));
  PetscCall(DiagonalBlocks(model, block));
  PetscCall(VecDuplicate(model->solution, &g->diagonal));
  PetscCall(VecGetArrayWrite(g->diagonal, &d));
  for (PetscInt i = 0; i < model->n_own; i++) {
    IntoFrame(model, i, &block[(size_t)i * dim * dim]);
    for (PetscInt k = 0; k < dim; k++) {
      d[i * dim + k] = block[(size_t)i * dim * dim + k * dim + k];
      largest        = PetscMax(largest, d[i * dim + k]);
    }
  }
  PetscCall(PetscFree(block));
  PetscCallMPI(MPI_Allreduce(&largest, &model->diagonal, 1, MPIU_REAL, MPIU_MAX, model->comm));
  for (PetscInt k = 0; k < g->n_held; k++) d[g->held[k]] = model->diagonal;
  PetscCall(VecRestoreArrayWrite(g->diagonal, &d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stiffness [corners*dim]^2 of the linear functions on element c, whose sides may be curved: their gradients are sums of its own.  Eq. (2.111) */
static void LinearStiffness(FemModel model, FemBatchKind kind, PetscInt c, FemShape *view, PetscReal *K)
{
  const FemShape   *shape = FemShapeGet((MeshCellType)model->cell_type[c]), *line = FemShapeGet(shape->linear);
  const FemElastic *law   = &model->law[model->cell_material[c]];
  PetscReal         dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], x[FEM_MAX_DOFS], flat[FEM_MAX_POINTS * FEM_MAX_DOFS];
  const PetscInt    dim = model->dim, n = shape->corners;

  if (kind == FEM_BATCH_TET10) { /* straight: the linear element itself */
    FemCellGather(model, c, model->x, x);
    (void)FemGradients(line, x, model->thickness, flat, w);
    for (PetscInt q = 0; q < line->points; q++) w[q] *= model->cell_weight ? model->cell_weight[model->cell_gid[c]] : 1;
    FemStiffness(line, law, flat, w, K);
    return;
  }
  FemCellGeometry(model, c, dN, w);
  for (PetscInt q = 0; q < shape->points; q++) {
    for (PetscInt k = 0; k < n * dim; k++) flat[q * n * dim + k] = dN[q * shape->nodes * dim + k];
    for (PetscInt a = n; a < shape->nodes; a++) {
      PetscInt       parent[8];
      const PetscInt m = MeshCellParents(shape->type, a, parent);

      for (PetscInt k = 0; k < m; k++)
        for (PetscInt d = 0; d < dim; d++) flat[(q * n + parent[k]) * dim + d] += dN[(q * shape->nodes + a) * dim + d] / m;
    }
  }
  view->type   = shape->type; /* a quadratic type: counts are taken from here */
  view->linear = shape->linear;
  view->dim    = dim;
  view->nodes  = n;
  view->points = shape->points;
  if (kind == FEM_BATCH_VOLUME) {
    FemVolume volume;

    FemCellGather(model, c, model->x, x);
    FemVolumeCreate(shape, x, w, &volume);
    FemVolumeStiffness(view, law, flat, w, &volume, K);
  } else FemStiffness(view, law, flat, w, K);
}

/* A row's columns, ascending; row [n_own + 1], col. Corners that share an element. */
static PetscErrorCode CoarsePattern(FemModel model, FemMultigrid g, PetscInt **row, PetscInt **col)
{
  PetscInt *start, *list, *touch_start, *touch, *seen, n = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(g->n_own + 2, &touch_start));
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt c = 0; c < model->n_cells; c++)
      for (PetscInt a = 0; a < MeshCellCorners((MeshCellType)model->cell_type[c]); a++) {
        const PetscInt i = g->corner[model->cell_node[model->cell_start[c] + a]];

        if (i >= g->n_own) continue;
        if (pass) touch[touch_start[i + 1]++] = c;
        else touch_start[i + 2]++;
      }
    if (pass) break;
    for (PetscInt i = 0; i < g->n_own; i++) touch_start[i + 2] += touch_start[i + 1];
    PetscCall(PetscMalloc1(touch_start[g->n_own + 1], &touch));
  }
  PetscCall(PetscMalloc1(g->n_loc, &seen));
  for (PetscInt i = 0; i < g->n_loc; i++) seen[i] = -1;
  PetscCall(PetscMalloc1(g->n_own + 1, &start));
  start[0] = 0;
  for (PetscInt pass = 0; pass < 2; pass++) {
    n = 0;
    for (PetscInt i = 0; i < g->n_own; i++) {
      for (PetscInt t = touch_start[i]; t < touch_start[i + 1]; t++) {
        const PetscInt c = touch[t];

        for (PetscInt a = 0; a < MeshCellCorners((MeshCellType)model->cell_type[c]); a++) {
          const PetscInt j = g->corner[model->cell_node[model->cell_start[c] + a]];

          if (seen[j] == pass * g->n_own + i) continue;
          seen[j] = pass * g->n_own + i;
          if (pass) list[n] = j;
          n++;
        }
      }
      if (pass) PetscCall(PetscSortInt(n - start[i], &list[start[i]]));
      else start[i + 1] = n;
    }
    if (!pass) PetscCall(PetscMalloc1(n, &list));
  }
  PetscCall(PetscFree(seen));
  PetscCall(PetscFree(touch_start));
  PetscCall(PetscFree(touch));
  *row = start;
  *col = list;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt Find(const PetscInt *col, PetscInt low, PetscInt end, PetscInt j)
{
  PetscInt high = end - 1;

  while (low < high) {
    const PetscInt middle = (low + high) / 2;

    if (col[middle] < j) low = middle + 1;
    else high = middle;
  }
  return low;
}

/* value [row[n_own]][dim][dim] of the coarse rows, in the body's axes. */
static PetscErrorCode CoarseValues(FemModel model, FemMultigrid g, const PetscInt *row, const PetscInt *col, PetscReal *value)
{
  const PetscInt dim = model->dim;
  PetscReal      K[24 * 24];
  FemShape      *view;

  PetscFunctionBegin;
  PetscCall(PetscNew(&view));
  for (PetscInt b = 0; b < model->batches->n; b++) {
    const FemBatch *batch = &model->batches->batch[b];
    const PetscInt  n     = MeshCellCorners(batch->type);

    for (PetscInt k = 0; k < batch->n; k++) {
      const PetscInt c = model->batches->cell[batch->first + k], *node = &model->cell_node[model->cell_start[c]];

      LinearStiffness(model, batch->kind, c, view, K);
      for (PetscInt a = 0; a < n; a++) {
        const PetscInt i = g->corner[node[a]];

        if (i >= g->n_own) continue;
        for (PetscInt e = 0; e < n; e++) {
          PetscReal *to = &value[(size_t)Find(col, row[i], row[i + 1], g->corner[node[e]]) * dim * dim];

          for (PetscInt p = 0; p < dim; p++)
            for (PetscInt q = 0; q < dim; q++) to[p * dim + q] += K[(a * dim + p) * n * dim + e * dim + q];
        }
      }
    }
  }
  PetscCall(PetscFree(view));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Q_i block Q_j' */
static void BlockIntoFrames(const FemModel model, PetscInt i, PetscInt j, PetscReal *K)
{
  const PetscInt dim = model->dim, fi = model->frame_of[i], fj = model->frame_of[j];
  PetscReal      half[9] = {0}, full[9] = {0};

  if (fi < 0 && fj < 0) return;
  for (PetscInt p = 0; p < dim; p++)
    for (PetscInt q = 0; q < dim; q++)
      for (PetscInt d = 0; d < dim; d++) half[p * dim + q] += (fi < 0 ? p == d : model->frame[(fi * dim + p) * dim + d]) * K[d * dim + q];
  for (PetscInt p = 0; p < dim; p++)
    for (PetscInt q = 0; q < dim; q++)
      for (PetscInt d = 0; d < dim; d++) full[p * dim + q] += half[p * dim + d] * (fj < 0 ? q == d : model->frame[(fj * dim + q) * dim + d]);
  for (PetscInt k = 0; k < dim * dim; k++) K[k] = full[k];
}

static PetscErrorCode CoarseMatrix(FemModel model, FemMultigrid g)
{
  const PetscInt dim = model->dim, n = g->n_own * dim;
  PetscInt      *row = NULL, *col = NULL, *inside, *outside, *number, *column, longest = 0, first;
  PetscReal     *value, *global, *line, scale = 0, largest = 0;
  Mat            K;

  PetscFunctionBegin;
  PetscCall(CoarsePattern(model, g, &row, &col));
  PetscCall(PetscCalloc1((size_t)row[g->n_own] * dim * dim, &value));
  PetscCall(CoarseValues(model, g, row, col, value));
  PetscCall(MatCreate(model->comm, &K));
  PetscCall(MatSetSizes(K, n, n, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(K, dim));
  PetscCall(MatSetType(K, MATAIJ));
  PetscCall(MatSetOptionsPrefix(K, "fem_mg_coarse_"));
  PetscCall(PetscMalloc2(n, &inside, n, &outside));
  for (PetscInt i = 0; i < g->n_own; i++) {
    PetscInt here = 0;

    for (PetscInt k = row[i]; k < row[i + 1]; k++) here += col[k] < g->n_own;
    for (PetscInt d = 0; d < dim; d++) {
      inside[i * dim + d]  = here * dim;
      outside[i * dim + d] = (row[i + 1] - row[i] - here) * dim;
    }
    longest = PetscMax(longest, row[i + 1] - row[i]);
    for (PetscInt k = row[i]; k < row[i + 1] && model->frame_of; k++) BlockIntoFrames(model, g->node[i], g->node[col[k]], &value[(size_t)k * dim * dim]);
    for (PetscInt k = row[i]; k < row[i + 1]; k++)
      for (PetscInt d = 0; d < dim && col[k] == i; d++) largest = PetscMax(largest, value[((size_t)k * dim + d) * dim + d]);
  }
  PetscCallMPI(MPI_Allreduce(&largest, &scale, 1, MPIU_REAL, MPIU_MAX, model->comm));
  PetscCall(MatSeqAIJSetPreallocation(K, 0, inside));
  PetscCall(MatMPIAIJSetPreallocation(K, 0, inside, 0, outside));
  PetscCall(MatGetOwnershipRange(K, &first, NULL));
  PetscCall(PetscMalloc4(g->n_loc, &number, model->n_loc * dim, &global, longest * dim, &column, longest * dim, &line));
  for (PetscInt i = 0; i < g->n_own; i++) global[g->node[i] * dim] = first / dim + i;
  PetscCall(FemGhosts(model, global));
  for (PetscInt i = 0; i < g->n_loc; i++) number[i] = (PetscInt)global[g->node[i] * dim];
  for (PetscInt i = 0; i < g->n_own; i++) {
    const PetscInt m = (row[i + 1] - row[i]) * dim;

    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt  at   = first + i * dim + d;
      const PetscBool mine = FemHeld(model, g->node[i] * dim + d) >= 0 ? PETSC_TRUE : PETSC_FALSE;

      for (PetscInt k = 0; k < m; k++) {
        const PetscInt  b = row[i] + k / dim, e = k % dim;
        const PetscBool held = mine || FemHeld(model, g->node[col[b]] * dim + e) >= 0 ? PETSC_TRUE : PETSC_FALSE;

        column[k] = number[col[b]] * dim + e;
        line[k]   = !held ? value[((size_t)b * dim + d) * dim + e] : column[k] == at ? scale : 0;
      }
      PetscCall(MatSetValues(K, 1, &at, m, column, line, INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(K, MAT_SPD, PETSC_TRUE));
  PetscCall(MatSetOption(K, MAT_SPD_ETERNAL, PETSC_TRUE));
  PetscCall(PetscFree2(inside, outside));
  PetscCall(PetscFree4(number, global, column, line));
  PetscCall(PetscFree(row));
  PetscCall(PetscFree(col));
  PetscCall(PetscFree(value));
  PetscCall(FemRigidModes(model, K, g->n_own, g->node));
  g->coarse = K;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two levels of PCMG; every part by options under -fem_mg_levels_ and -fem_mg_coarse_. */
static PetscErrorCode Levels(FemModel model, FemMultigrid g)
{
  static const char *const ours[][2] = {{"-fem_mg_levels_ksp_type", "chebyshev"},         {"-fem_mg_levels_ksp_max_it", "2"},
                                        {"-fem_mg_levels_ksp_chebyshev_esteig", "0,0.1,0,1.1"}, {"-fem_mg_levels_esteig_ksp_type", "cg"},
                                        {"-fem_mg_levels_esteig_ksp_max_it", "10"},       {"-fem_mg_levels_pc_type", "jacobi"},
                                        {"-fem_mg_coarse_ksp_type", "richardson"},        {"-fem_mg_coarse_ksp_max_it", "2"}, /* two cycles: 25 iterations became 20 */
                                        {"-fem_mg_coarse_ksp_norm_type", "none"},         {"-fem_mg_coarse_pc_type", "gamg"},
                                        {"-fem_mg_coarse_pc_gamg_agg_nsmooths", "1"},     {"-fem_mg_coarse_pc_gamg_aggressive_coarsening", "1"},
                                        {"-fem_mg_coarse_pc_gamg_threshold", "0.001"},    {"-fem_mg_coarse_pc_gamg_coarse_eq_limit", "200"},
                                        {"-fem_mg_coarse_pc_gamg_esteig_ksp_type", "cg"}, {"-fem_mg_coarse_pc_gamg_esteig_ksp_max_it", "10"},
                                        {"-fem_mg_coarse_mg_levels_ksp_type", "chebyshev"}, {"-fem_mg_coarse_mg_levels_ksp_max_it", "2"},
                                        {"-fem_mg_coarse_mg_levels_ksp_chebyshev_esteig", "0,0.05,0,1.1"}, {"-fem_mg_coarse_mg_levels_pc_type", "jacobi"}};
  PC                       pc;
  KSP                      coarse;

  PetscFunctionBegin;
  for (size_t k = 0; k < sizeof(ours) / sizeof(ours[0]); k++) PetscCall(FemPrefer(ours[k][0], ours[k][1]));
  PetscCall(KSPGetPC(model->ksp, &pc));
  PetscCall(PCSetType(pc, PCMG));
  PetscCall(PCMGSetLevels(pc, 2, NULL));
  PetscCall(PCMGSetGalerkin(pc, PC_MG_GALERKIN_NONE));
  PetscCall(PCMGSetInterpolation(pc, 1, g->move));
  PetscCall(PCMGGetCoarseSolve(pc, &coarse));
  PetscCall(KSPSetOperators(coarse, g->coarse, g->coarse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemMultigridCreate(FemModel model)
{
  const PetscInt dim = model->dim, n = model->n_own * dim;
  FemMultigrid   g;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(FEM_Assemble, 0, 0, 0, 0));
  PetscCall(PetscNew(&g));
  model->multigrid = g;
  PetscCall(FindCorners(model, g));
  PetscCall(PetscCalloc2(model->n_loc * dim, &g->u, model->n_loc * dim, &g->f));
  PetscCall(MatCreateShell(model->comm, n, n, PETSC_DETERMINE, PETSC_DETERMINE, model, &model->K));
  PetscCall(MatShellSetOperation(model->K, MATOP_MULT, (void (*)(void))Times));
  PetscCall(MatShellSetOperation(model->K, MATOP_MULT_TRANSPOSE, (void (*)(void))Times));
  PetscCall(MatShellSetOperation(model->K, MATOP_GET_DIAGONAL, (void (*)(void))GetDiagonal));
  PetscCall(MatSetBlockSize(model->K, dim));
  PetscCall(MatSetOption(model->K, MAT_SPD, PETSC_TRUE));
  PetscCall(MatSetOption(model->K, MAT_SPD_ETERNAL, PETSC_TRUE));
  PetscCall(MatCreateVecs(model->K, &model->solution, &model->rhs));
  PetscCall(FillDiagonal(model, g));
  PetscCall(CoarseMatrix(model, g));
  PetscCall(MatCreateShell(model->comm, n, g->n_own * dim, PETSC_DETERMINE, PETSC_DETERMINE, model, &g->move));
  PetscCall(MatShellSetOperation(g->move, MATOP_MULT, (void (*)(void))Prolong));
  PetscCall(MatShellSetOperation(g->move, MATOP_MULT_TRANSPOSE, (void (*)(void))Restrict));
  PetscCall(KSPSetOperators(model->ksp, model->K, model->K));
  PetscCall(Levels(model, g));
  PetscCall(PetscLogEventEnd(FEM_Assemble, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemMultigridDestroy(FemModel model)
{
  FemMultigrid g = model->multigrid;

  PetscFunctionBegin;
  if (!g) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatDestroy(&g->move));
  PetscCall(MatDestroy(&g->coarse));
  PetscCall(VecDestroy(&g->diagonal));
  PetscCall(PetscFree2(g->corner, g->node));
  PetscCall(PetscFree(g->up_start));
  PetscCall(PetscFree(g->up));
  PetscCall(PetscFree(g->down_start));
  PetscCall(PetscFree(g->down));
  PetscCall(PetscFree(g->held));
  PetscCall(PetscFree2(g->u, g->f));
  PetscCall(PetscFree(model->multigrid));
  PetscFunctionReturn(PETSC_SUCCESS);
}
