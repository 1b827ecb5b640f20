/* coupling_locate.c - which element of the overlap a point of the rest state lies in, and its shape functions there. */
#include "coupling_impl.h"

static const PetscReal quad_corner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
static const PetscReal hex_corner[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};

/* N and reference gradients at xi. */
static void Reference(MeshCellType type, const PetscReal xi[3], PetscReal N[8], PetscReal dr[8][3])
{
  if (type == MESH_TRI3 || type == MESH_TET4) {
    const PetscInt dim = type == MESH_TRI3 ? 2 : 3;

    N[0] = 1;
    for (PetscInt d = 0; d < dim; d++) {
      N[0] -= xi[d];
      N[1 + d] = xi[d];
      dr[0][d] = -1;
      for (PetscInt k = 0; k < dim; k++) dr[1 + k][d] = k == d;
    }
  } else if (type == MESH_QUAD4)
    for (PetscInt k = 0; k < 4; k++) {
      const PetscReal a = quad_corner[k][0], b = quad_corner[k][1];

      N[k]     = 0.25 * (1 + a * xi[0]) * (1 + b * xi[1]);
      dr[k][0] = 0.25 * a * (1 + b * xi[1]);
      dr[k][1] = 0.25 * b * (1 + a * xi[0]);
    }
  else
    for (PetscInt k = 0; k < 8; k++) {
      const PetscReal a = 1 + hex_corner[k][0] * xi[0], b = 1 + hex_corner[k][1] * xi[1], c = 1 + hex_corner[k][2] * xi[2];

      N[k]     = 0.125 * a * b * c;
      dr[k][0] = 0.125 * hex_corner[k][0] * b * c;
      dr[k][1] = 0.125 * a * hex_corner[k][1] * c;
      dr[k][2] = 0.125 * a * b * hex_corner[k][2];
    }
}

static void Invert(PetscInt dim, PetscReal J[3][3], PetscReal inverse[3][3])
{
  if (dim == 2) {
    const PetscReal det = J[0][0] * J[1][1] - J[0][1] * J[1][0];

    inverse[0][0] = J[1][1] / det;
    inverse[0][1] = -J[0][1] / det;
    inverse[1][0] = -J[1][0] / det;
    inverse[1][1] = J[0][0] / det;
    return;
  }
  PetscReal det = 0;

  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) inverse[j][i] = J[(i + 1) % 3][(j + 1) % 3] * J[(i + 2) % 3][(j + 2) % 3] - J[(i + 1) % 3][(j + 2) % 3] * J[(i + 2) % 3][(j + 1) % 3];
  for (int j = 0; j < 3; j++) det += J[0][j] * inverse[j][0];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) inverse[i][j] /= det;
}

/* x [nodes][3], straight sides: the place is that of the corners; outside: how far beyond the reference element the point lies, 0 inside. */
PetscErrorCode CouplingShapes_Internal(MeshCellType whole, const PetscReal *x, PetscInt dim, const PetscReal point[3], PetscReal N[FEM_MAX_NODES], PetscReal dN[FEM_MAX_NODES][3], PetscReal *outside)
{
  const MeshCellType type = MeshCellLinear(whole);
  const PetscInt  n = MeshCellNodes(type);
  const PetscBool simplex = (PetscBool)(type == MESH_TRI3 || type == MESH_TET4);
  PetscReal       xi[3] = {0}, dr[8][3] = {{0}}, inverse[3][3] = {{0}}, own[FEM_MAX_NODES][3], (*slope)[3] = dr;

  PetscFunctionBegin;
  if (simplex) xi[0] = xi[1] = xi[2] = 0.25;
  for (PetscInt it = 0; it < (simplex ? 1 : 30); it++) { /* Newton; one step is exact for simplices */
    PetscReal J[3][3] = {{0}}, off[3], size = 0;

    Reference(type, xi, N, dr);
    for (PetscInt i = 0; i < dim; i++) {
      off[i] = point[i];
      for (PetscInt a = 0; a < n; a++) {
        off[i] -= N[a] * x[3 * a + i];
        for (PetscInt j = 0; j < dim; j++) J[i][j] += x[3 * a + i] * dr[a][j];
      }
    }
    Invert(dim, J, inverse);
    for (PetscInt j = 0; j < dim; j++) {
      PetscReal step = 0;

      for (PetscInt i = 0; i < dim; i++) step += inverse[j][i] * off[i];
      step = PetscMax(-2, PetscMin(2, step)); /* a point far outside must not throw Newton away */
      xi[j] += step;
      size = PetscMax(size, PetscAbsReal(step));
    }
    if (size < 1e-14) break;
  }
  Reference(type, xi, N, dr);
  *outside = 0;
  if (simplex)
    for (PetscInt a = 0; a < n; a++) *outside = PetscMax(*outside, -N[a]);
  else
    for (PetscInt d = 0; d < dim; d++) *outside = PetscMax(*outside, PetscAbsReal(xi[d]) - 1);
  {
    PetscReal J[3][3] = {{0}};

    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt a = 0; a < n; a++)
        for (PetscInt j = 0; j < dim; j++) J[i][j] += x[3 * a + i] * dr[a][j];
    Invert(dim, J, inverse);
  }
  if (whole != type) {
    FemShapeAt(whole, xi, N, own);
    slope = own;
  }
  for (PetscInt a = 0; a < MeshCellNodes(whole); a++)
    for (PetscInt i = 0; i < 3; i++) {
      dN[a][i] = 0;
      if (i < dim)
        for (PetscInt j = 0; j < dim; j++) dN[a][i] += slope[a][j] * inverse[j][i];
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingLocate_Internal(CouplingModel model, const PetscReal point[3], PetscReal tolerance, PetscBool *found, CouplingPoint *at)
{
  const Mesh *mesh = CouplingMesh(model);
  PetscReal   least = tolerance;

  PetscFunctionBegin;
  *found = PETSC_FALSE;
  for (PetscInt e = 0; e < model->n_overlap && (!*found || least > 0); e++) {
    const PetscInt top = model->overlap[e], c = model->top[top], first = mesh->start[c], n = mesh->start[c + 1] - first;
    PetscReal      x[FEM_MAX_NODES][3], N[FEM_MAX_NODES], dN[FEM_MAX_NODES][3], outside, slack = 0;
    PetscBool      near = PETSC_TRUE;

    for (PetscInt a = 0; a < n; a++)
      for (PetscInt d = 0; d < 3; d++) x[a][d] = mesh->x[3 * mesh->node[first + a] + d];
    for (PetscInt d = 0; d < model->dim && near; d++) { /* bounding box first */
      PetscReal low = x[0][d], high = x[0][d];

      for (PetscInt a = 1; a < n; a++) {
        low  = PetscMin(low, x[a][d]);
        high = PetscMax(high, x[a][d]);
      }
      slack = 2 * tolerance * (high - low);
      near  = (PetscBool)(point[d] >= low - slack && point[d] <= high + slack);
    }
    if (!near) continue;
    PetscCall(CouplingShapes_Internal(mesh->type[c], &x[0][0], model->dim, point, N, dN, &outside));
    if (outside > least || (*found && outside >= least)) continue;
    *found   = PETSC_TRUE;
    least    = outside;
    at->cell = top;
    at->n    = n;
    for (PetscInt a = 0; a < n; a++) {
      at->node[a] = mesh->node[first + a];
      at->N[a]    = N[a];
      for (PetscInt d = 0; d < 3; d++) at->dN[a][d] = dN[a][d];
    }
    if (MeshCellLinear(mesh->type[c]) != mesh->type[c]) { /* strain and turn by the corners */
      PetscCall(CouplingShapes_Internal(MeshCellLinear(mesh->type[c]), &x[0][0], model->dim, point, N, dN, &outside));
      for (PetscInt a = 0; a < n; a++)
        for (PetscInt d = 0; d < 3; d++) at->dN[a][d] = a < MeshCellCorners(mesh->type[c]) ? dN[a][d] : 0;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Share of the elements at the point.  Eq. (6.1) */
PetscReal CouplingWeight_Internal(CouplingModel model, const CouplingPoint *at)
{
  PetscReal s = 0;

  for (PetscInt a = 0; a < at->n; a++) s += at->N[a] * model->split->s[at->node[a]];
  s = PetscMax(0, PetscMin(1, s));
  if (model->options.smooth) s = s * s * (3 - 2 * s);
  return model->options.floor + (1 - 2 * model->options.floor) * s;
}
