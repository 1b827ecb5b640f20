/*
  coupling_recover.c - gradients at the nodes from the elements around them, and a field between nodes that keeps its curvature.  Eqs (8.6), (8.7)

  About a node the element means, each at its element's centroid, are fitted by a linear function in the least-squares sense; its value at
  the node is the gradient there. A node with too few elements for the fit takes those of its neighbours too.
*/
#include "coupling_switch.h"

typedef struct {
  PetscInt  *start, *cell; /* cells around each node */
  PetscReal *G, *x;        /* [cells][dim*dim], [cells][3] mean gradient and centroid of top cells */
} Around;

static PetscErrorCode AroundCreate(const Mesh *mesh, PetscReal thickness, const PetscReal *u, Around *around)
{
  const PetscInt dim = mesh->dim;
  PetscInt      *fill;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(mesh->n_cells * dim * dim, &around->G, 3 * mesh->n_cells, &around->x));
  PetscCall(PetscCalloc2(mesh->n_nodes + 1, &around->start, mesh->start[mesh->n_cells], &around->cell));
  for (PetscInt c = 0; c < mesh->n_cells; c++)
    for (PetscInt k = mesh->start[c]; MeshCellDim(mesh->type[c]) == dim && k < mesh->start[c + 1]; k++) around->start[mesh->node[k] + 1]++;
  for (PetscInt i = 0; i < mesh->n_nodes; i++) around->start[i + 1] += around->start[i];
  PetscCall(PetscMalloc1(mesh->n_nodes, &fill));
  PetscCall(PetscArraycpy(fill, around->start, mesh->n_nodes));
  for (PetscInt c = 0; c < mesh->n_cells; c++) {
    const PetscInt  first = mesh->start[c], n = mesh->start[c + 1] - first;
    const FemShape *shape = FemShapeGet(mesh->type[c]);
    PetscReal       x[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], volume = 0, *G = around->G + c * dim * dim;

    if (MeshCellDim(mesh->type[c]) != dim) continue;
    for (PetscInt a = 0; a < n; a++) {
      around->cell[fill[mesh->node[first + a]]++] = c;
      for (PetscInt d = 0; d < 3; d++) around->x[3 * c + d] += mesh->x[3 * mesh->node[first + a] + d] / n;
      for (PetscInt d = 0; d < dim; d++) x[a * dim + d] = mesh->x[3 * mesh->node[first + a] + d];
    }
    (void)FemGradients(shape, x, thickness, dN, w);
    for (PetscInt g = 0; g < shape->points; g++) {
      volume += w[g];
      for (PetscInt a = 0; a < n; a++)
        for (PetscInt i = 0; i < dim; i++)
          for (PetscInt j = 0; j < dim; j++) G[i * dim + j] += w[g] * u[mesh->node[first + a] * dim + i] * dN[(g * n + a) * dim + j];
    }
    for (PetscInt k = 0; k < dim * dim; k++) G[k] /= volume;
  }
  PetscCall(PetscFree(fill));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Value at x0 of the linear least-squares fit over the cells, of m numbers each; PETSC_FALSE when they do not settle it. */
static PetscBool Fit(const Around *around, PetscInt dim, const PetscReal x0[3], PetscInt n, const PetscInt *cell, PetscReal *value)
{
  const PetscInt m = dim * dim, b = dim + 1;
  PetscReal      A[4][4] = {{0}}, r[4][9] = {{0}}, size = 0;

  for (PetscInt k = 0; k < n; k++)
    for (PetscInt d = 0; d < dim; d++) size = PetscMax(size, PetscAbsReal(around->x[3 * cell[k] + d] - x0[d]));
  if (n < b || size == 0) return PETSC_FALSE;
  for (PetscInt k = 0; k < n; k++) {
    PetscReal p[4] = {1};

    for (PetscInt d = 0; d < dim; d++) p[1 + d] = (around->x[3 * cell[k] + d] - x0[d]) / size;
    for (PetscInt i = 0; i < b; i++) {
      for (PetscInt j = 0; j < b; j++) A[i][j] += p[i] * p[j];
      for (PetscInt j = 0; j < m; j++) r[i][j] += p[i] * around->G[cell[k] * m + j];
    }
  }
  for (PetscInt i = 0; i < b; i++) { /* Cholesky in place, the right sides along */
    for (PetscInt j = 0; j <= i; j++) {
      PetscReal s = A[i][j];

      for (PetscInt k = 0; k < j; k++) s -= A[i][k] * A[j][k];
      if (i == j) {
        if (s < 1e-3 * A[i][i]) return PETSC_FALSE; /* cells all but on a line: the slope would be a guess */
        A[i][i] = PetscSqrtReal(s);
      } else A[i][j] = s / A[j][j];
    }
    for (PetscInt j = 0; j < m; j++) {
      for (PetscInt k = 0; k < i; k++) r[i][j] -= A[i][k] * r[k][j];
      r[i][j] /= A[i][i];
    }
  }
  for (PetscInt i = b - 1; i >= 0; i--)
    for (PetscInt j = 0; j < m; j++) {
      for (PetscInt k = i + 1; k < b; k++) r[i][j] -= A[k][i] * r[k][j];
      r[i][j] /= A[i][i];
    }
  for (PetscInt j = 0; j < m; j++) value[j] = r[0][j];
  return PETSC_TRUE;
}

PetscErrorCode CouplingRecover_Internal(const Mesh *mesh, PetscReal thickness, const PetscBool wanted[], const PetscReal *u, PetscReal *G)
{
  const PetscInt dim = mesh->dim;
  Around         around;
  PetscInt      *cell, *seen;

  PetscFunctionBegin;
  PetscCall(AroundCreate(mesh, thickness, u, &around));
  PetscCall(PetscMalloc2(mesh->n_cells, &cell, mesh->n_cells, &seen));
  for (PetscInt c = 0; c < mesh->n_cells; c++) seen[c] = -1;
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    PetscInt  n = 0, ring = 0;
    PetscBool good;

    if (!wanted[i]) continue;
    for (PetscInt k = around.start[i]; k < around.start[i + 1]; k++) {
      cell[n++] = around.cell[k];
      seen[around.cell[k]] = i;
    }
    good = Fit(&around, dim, mesh->x + 3 * i, n, cell, G + i * dim * dim);
    for (; !good && ring < 2; ring++) { /* the neighbours' too */
      const PetscInt before = n;

      for (PetscInt e = 0; e < before; e++)
        for (PetscInt a = mesh->start[cell[e]]; a < mesh->start[cell[e] + 1]; a++)
          for (PetscInt k = around.start[mesh->node[a]]; k < around.start[mesh->node[a] + 1]; k++)
            if (seen[around.cell[k]] != i) {
              cell[n++] = around.cell[k];
              seen[around.cell[k]] = i;
            }
      good = Fit(&around, dim, mesh->x + 3 * i, n, cell, G + i * dim * dim);
    }
    if (good) continue;
    for (PetscInt j = 0; j < dim * dim; j++) {
      G[i * dim * dim + j] = 0;
      for (PetscInt k = 0; k < n; k++) G[i * dim * dim + j] += around.G[cell[k] * dim * dim + j] / n;
    }
  }
  PetscCall(PetscFree2(cell, seen));
  PetscCall(PetscFree2(around.G, around.x));
  PetscCall(PetscFree2(around.start, around.cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}
