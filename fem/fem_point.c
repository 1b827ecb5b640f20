/*
  fem_point.c - an element at one point.

  Families by corners: triangle 3, quadrilateral 4 (plane), tetrahedron 4 (space), prism 6, hexahedron 8. Triangles and tetrahedra
  live on xi >= 0, sum xi <= 1; quadrilaterals and hexahedra on [-1, 1]; a prism is a triangle times [-1, 1].
*/
#include "fem_point.h"

typedef enum { TRIANGLE, QUADRILATERAL, TETRAHEDRON, PRISM, HEXAHEDRON, OTHER } Family;

static Family FamilyOf(MeshCellType type)
{
  const PetscInt dim = MeshCellDim(type), corners = MeshCellCorners(type);

  if (dim == 2) return corners == 3 ? TRIANGLE : QUADRILATERAL;
  return corners == 4 ? TETRAHEDRON : corners == 6 ? PRISM : corners == 8 ? HEXAHEDRON : OTHER;
}

/* Directions that share a simplex, from the first: the others run over [-1, 1]. */
static PetscInt SimplexDims(Family family)
{
  return family == TRIANGLE || family == PRISM ? 2 : family == TETRAHEDRON ? 3 : 0;
}

PetscInt FemPointOrder(MeshCellType type)
{
  return MeshCellNodes(type) > MeshCellCorners(type) ? 2 : 1;
}

PetscBool FemPointIsSimplex(MeshCellType type)
{
  const Family family = FamilyOf(type);

  return (PetscBool)(family == TRIANGLE || family == TETRAHEDRON);
}

PetscReal FemPointMap(const FemShape *shape, const PetscReal *x, const PetscReal *N, const PetscReal grad[][3], PetscReal *dN, PetscReal *at)
{
  const PetscInt dim = shape->dim, nodes = shape->nodes;
  PetscReal      J[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, cofactor[3][3], det = 0;

  for (PetscInt i = 0; i < dim; i++) {
    at[i] = 0;
    for (PetscInt j = 0; j < dim; j++) J[i][j] = 0;
  }
  for (PetscInt a = 0; a < nodes; a++)
    for (PetscInt i = 0; i < dim; i++) {
      at[i] += N[a] * x[a * dim + i];
      for (PetscInt j = 0; j < dim; j++) J[i][j] += x[a * dim + i] * grad[a][j];
    }
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) cofactor[i][j] = J[(i + 1) % 3][(j + 1) % 3] * J[(i + 2) % 3][(j + 2) % 3] - J[(i + 1) % 3][(j + 2) % 3] * J[(i + 2) % 3][(j + 1) % 3];
  for (PetscInt j = 0; j < 3; j++) det += J[0][j] * cofactor[0][j];
  for (PetscInt a = 0; a < nodes; a++)
    for (PetscInt i = 0; i < dim; i++) {
      PetscReal sum = 0;

      for (PetscInt j = 0; j < dim; j++) sum += cofactor[i][j] * grad[a][j]; /* J^-T = cofactor / det */
      dN[a * dim + i] = sum / det;
    }
  return det;
}

PetscReal FemPointAt(const FemShape *shape, const PetscReal *x, const PetscReal xi[3], PetscReal *N, PetscReal *dN, PetscReal *at)
{
  PetscReal grad[FEM_MAX_NODES][3];

  FemShapeAt(shape->type, xi, N, grad);
  return FemPointMap(shape, x, N, (const PetscReal(*)[3])grad, dN, at);
}

void FemPointsFill(MeshCellType type, FemPoints *points)
{
  for (PetscInt q = 0; q < points->n; q++) FemShapeAt(type, points->xi[q], points->N[q], points->grad[q]);
}

/* How far outside the reference element. */
static PetscReal Outside(Family family, const PetscReal xi[3])
{
  const PetscInt dim = family == TRIANGLE || family == QUADRILATERAL ? 2 : 3, simplex = SimplexDims(family);
  PetscReal      far = 0, sum = 0;

  for (PetscInt i = 0; i < simplex; i++) {
    far = PetscMax(far, -xi[i]);
    sum += xi[i];
  }
  if (simplex) far = PetscMax(far, sum - 1);
  for (PetscInt i = simplex; i < dim; i++) far = PetscMax(far, PetscAbsReal(xi[i]) - 1);
  return far;
}

PetscReal FemPointFind(const FemShape *shape, const PetscReal *x, const PetscReal at[3], PetscReal xi[3])
{
  const PetscInt dim    = shape->dim;
  const Family   family = FamilyOf(shape->type);
  PetscReal      N[FEM_MAX_NODES], dN[FEM_MAX_NODES * 3], here[3], step = 1;

  for (PetscInt i = 0; i < 3; i++) xi[i] = i >= SimplexDims(family) ? 0 : 1. / (SimplexDims(family) + 1);
  for (PetscInt k = 0; k < 30 && step > 1e-14; k++) {
    PetscReal grad[FEM_MAX_NODES][3], J[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, move[3] = {0, 0, 0}, det;

    det = FemPointAt(shape, x, xi, N, dN, here);
    if (!(PetscAbsReal(det) > 0)) return PETSC_MAX_REAL;
    FemShapeAt(shape->type, xi, N, grad);
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) {
        J[i][j] = 0;
        for (PetscInt a = 0; a < shape->nodes; a++) J[i][j] += x[a * dim + i] * grad[a][j];
      }
    for (PetscInt j = 0; j < dim; j++) /* move = J^-1 (at - here) */
      for (PetscInt i = 0; i < dim; i++)
        move[j] += (J[(i + 1) % 3][(j + 1) % 3] * J[(i + 2) % 3][(j + 2) % 3] - J[(i + 1) % 3][(j + 2) % 3] * J[(i + 2) % 3][(j + 1) % 3]) * (at[i] - here[i]) / det;
    step = 0;
    for (PetscInt j = 0; j < dim; j++) {
      xi[j] += move[j];
      step = PetscMax(step, PetscAbsReal(move[j]));
    }
    if (!(step < 1e3)) return PETSC_MAX_REAL;
  }
  return step < 1e-9 ? Outside(family, xi) : PETSC_MAX_REAL;
}

void FemPointClamp(MeshCellType type, PetscReal xi[3])
{
  const Family   family  = FamilyOf(type);
  const PetscInt simplex = SimplexDims(family);
  PetscReal      sum     = 0;

  for (PetscInt i = 0; i < simplex; i++) {
    xi[i] = PetscMax(xi[i], 0);
    sum += xi[i];
  }
  for (PetscInt i = 0; i < simplex && sum > 1; i++) xi[i] /= sum;
  for (PetscInt i = simplex; i < 3; i++) xi[i] = PetscMax(-1, PetscMin(1, xi[i]));
}

/* Gauss-Legendre on [-1, 1]. */
static const PetscReal gauss_x[4][4] = {{0},
                                        {-0.57735026918962576451, 0.57735026918962576451},
                                        {-0.77459666924148337704, 0, 0.77459666924148337704},
                                        {-0.86113631159405257522, -0.33998104358485626480, 0.33998104358485626480, 0.86113631159405257522}};
static const PetscReal gauss_w[4][4] = {{2}, {1, 1}, {5. / 9, 8. / 9, 5. / 9}, {0.34785484513745385737, 0.65214515486254614263, 0.65214515486254614263, 0.34785484513745385737}};

PetscInt FemPointRule(MeshCellType type, PetscInt n, PetscReal xi[FEM_RULE_MAX][3], PetscReal w[FEM_RULE_MAX])
{
  const Family   family  = FamilyOf(type);
  const PetscInt dim     = MeshCellDim(type), simplex = SimplexDims(family);
  PetscInt       m       = 0, index[3];

  for (index[2] = 0; index[2] < (dim == 3 ? n : 1); index[2]++)
    for (index[1] = 0; index[1] < n; index[1]++)
      for (index[0] = 0; index[0] < n; index[0]++, m++) {
        PetscReal left = 1;

        w[m] = 1;
        for (PetscInt i = 0; i < 3; i++) {
          const PetscReal g = i < dim ? gauss_x[n - 1][index[i]] : 0, weight = i < dim ? gauss_w[n - 1][index[i]] : 1;

          if (i >= simplex) {
            xi[m][i] = g;
            w[m] *= weight;
          } else { /* the rest of the simplex, left - xi_i, is the length of the next direction */
            xi[m][i] = left * 0.5 * (1 + g);
            w[m] *= 0.5 * weight * left;
            left -= xi[m][i];
          }
        }
      }
  return m;
}

PetscInt FemPointSamples(MeshCellType type, PetscReal xi[FEM_RULE_MAX][3])
{
  const Family family = FamilyOf(type);
  PetscReal    w[FEM_RULE_MAX];

  if (FemPointOrder(type) == 1) {
    for (PetscInt i = 0; i < 3; i++) xi[0][i] = i >= SimplexDims(family) ? 0 : 1. / (SimplexDims(family) + 1);
    return 1;
  }
  if (family == TRIANGLE || family == PRISM) { /* the points of degree 2 nearest to the corners */
    const PetscInt layers = family == PRISM ? 2 : 1;

    for (PetscInt l = 0; l < layers; l++)
      for (PetscInt k = 0; k < 3; k++) {
        for (PetscInt i = 0; i < 2; i++) xi[3 * l + k][i] = k == i + 1 ? 2. / 3 : 1. / 6;
        xi[3 * l + k][2] = layers == 2 ? gauss_x[1][l] : 0;
      }
    return 3 * layers;
  }
  if (family == TETRAHEDRON) {
    const PetscReal near = 0.58541019662496845446, far = 0.13819660112501051518; /* (5 + 3 sqrt 5)/20, (5 - sqrt 5)/20 */

    for (PetscInt k = 0; k < 4; k++)
      for (PetscInt i = 0; i < 3; i++) xi[k][i] = k == i + 1 ? near : far;
    return 4;
  }
  return FemPointRule(type, 2, xi, w);
}

const PetscInt *FemPointEdges(MeshCellType type, PetscInt a)
{
  static const PetscInt triangle[3][3]      = {{1, 2}, {2, 0}, {0, 1}},
                        quadrilateral[4][3] = {{1, 3}, {2, 0}, {3, 1}, {0, 2}},
                        tetrahedron[4][3]   = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}},
                        prism[6][3]         = {{1, 2, 3}, {2, 0, 4}, {0, 1, 5}, {4, 5, 0}, {5, 3, 1}, {3, 4, 2}},
                        hexahedron[8][3]    = {{1, 3, 4}, {0, 2, 5}, {1, 3, 6}, {0, 2, 7}, {0, 5, 7}, {1, 4, 6}, {2, 5, 7}, {3, 4, 6}};

  switch (FamilyOf(type)) {
  case TRIANGLE: return triangle[a];
  case QUADRILATERAL: return quadrilateral[a];
  case TETRAHEDRON: return tetrahedron[a];
  case PRISM: return prism[a];
  case HEXAHEDRON: return hexahedron[a];
  default: return NULL;
  }
}
