/*
  fem_shape.c - shape functions and integration points of every element, as tables filled once.

  Reference elements are gmsh's: triangle and tetrahedron on [0,1] with their first corner at 0, square and cube on
  [-1,1], prism a triangle times [-1,1]. Gradients come from the product rule (Dual), so no derivative is written twice.
  Points: enough for the full rank of the stiffness and the exact mass of an affine element.  Eqs (2.5), (2.30)
*/
#include "fem_element.h"

/* A function's value and gradient at a point. */
typedef struct {
  PetscReal v, g[3];
} Dual;

static Dual Times(Dual a, Dual b)
{
  Dual c = {a.v * b.v, {0, 0, 0}};

  for (PetscInt i = 0; i < 3; i++) c.g[i] = a.g[i] * b.v + a.v * b.g[i];
  return c;
}

/* s a + t */
static Dual Linear(PetscReal s, Dual a, PetscReal t)
{
  Dual c = {s * a.v + t, {s * a.g[0], s * a.g[1], s * a.g[2]}};

  return c;
}

static Dual Plus(Dual a, Dual b)
{
  Dual c = {a.v + b.v, {a.g[0] + b.g[0], a.g[1] + b.g[1], a.g[2] + b.g[2]}};

  return c;
}

/* Quadratic on [-1, 1]: 1 at c in {-1, 0, 1}, 0 at the other two. */
static Dual Three(Dual x, PetscReal c)
{
  return c == 0 ? Linear(-1, Times(x, x), 1) : Linear(0.5, Times(x, Linear(1, x, c)), 0);
}

static const PetscReal cube_corner[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};

static PetscBool IsSimplex(MeshCellType linear)
{
  return linear == MESH_TRI3 || linear == MESH_TET4 ? PETSC_TRUE : PETSC_FALSE;
}

/* Reference coordinates of a corner. */
static void CornerPlace(MeshCellType linear, PetscInt a, PetscReal xi[3])
{
  for (PetscInt i = 0; i < 3; i++) {
    if (IsSimplex(linear)) xi[i] = a == i + 1;
    else if (linear == MESH_PRISM6) xi[i] = i == 2 ? (a < 3 ? -1 : 1) : a % 3 == i + 1;
    else xi[i] = i < MeshCellDim(linear) ? cube_corner[a][i] : 0;
  }
}

static void NodePlace(MeshCellType type, PetscInt a, PetscReal xi[3])
{
  PetscInt       corner[8];
  const PetscInt n = MeshCellParents(type, a, corner);

  for (PetscInt i = 0; i < 3; i++) xi[i] = 0;
  for (PetscInt k = 0; k < n; k++) {
    PetscReal at[3];

    CornerPlace(MeshCellLinear(type), corner[k], at);
    for (PetscInt i = 0; i < 3; i++) xi[i] += at[i] / n;
  }
}

/* Quadratic on a simplex with barycentric coordinates L: of corner i, or of the edge between i and j. */
static Dual SimplexTwo(const Dual L[], PetscInt i, PetscInt j)
{
  return i == j ? Times(L[i], Linear(2, L[i], -1)) : Linear(4, Times(L[i], L[j]), 0);
}

/* One shape function. x: the coordinates themselves; L: barycentric ones of the simplex, or of the prism's triangle. */
static Dual Shape(MeshCellType type, PetscInt a, const Dual x[3], const Dual L[4])
{
  const MeshCellType linear = MeshCellLinear(type);
  const PetscInt     dim    = MeshCellDim(type);
  const PetscBool    curved = type != linear ? PETSC_TRUE : PETSC_FALSE, complete = type == MeshCellQuadratic(linear, PETSC_FALSE) ? PETSC_TRUE : PETSC_FALSE;
  PetscInt           corner[8], n = MeshCellParents(type, a, corner), zeros = 0;
  PetscReal          c[3];
  Dual               N = {1, {0, 0, 0}};

  NodePlace(type, a, c);
  if (IsSimplex(linear)) return curved ? SimplexTwo(L, corner[0], corner[n - 1]) : L[a];
  if (linear == MESH_PRISM6) {
    const Dual along = Linear(c[2], x[2], 1); /* 1 + z z_a */
    PetscInt   i = corner[0] % 3, j = i;

    for (PetscInt k = 1; k < n; k++)
      if (corner[k] % 3 != i) j = corner[k] % 3;
    if (!curved) return Linear(0.5, Times(L[i], along), 0);
    if (complete) return Times(SimplexTwo(L, i, j), Three(x[2], c[2]));
    if (c[2] == 0) return Times(L[i], Three(x[2], 0));
    if (i != j) return Linear(2, Times(Times(L[i], L[j]), along), 0);
    return Linear(0.5, Times(L[i], Plus(Times(Linear(2, L[i], -1), along), Linear(-1, Three(x[2], 0), 0))), 0);
  }
  for (PetscInt d = 0; d < dim; d++) zeros += c[d] == 0;
  for (PetscInt d = 0; d < dim; d++) N = Times(N, complete && curved ? Three(x[d], c[d]) : c[d] == 0 ? Three(x[d], 0) : Linear(0.5 * c[d], x[d], 0.5));
  if (curved && !complete && zeros == 0) { /* a corner of a serendipity cell */
    Dual sum = Linear(c[0], x[0], 1.0 - dim);

    for (PetscInt d = 1; d < dim; d++) sum = Plus(sum, Linear(c[d], x[d], 0));
    N = Times(N, sum);
  }
  return N;
}

void FemShapeAt(MeshCellType type, const PetscReal xi[3], PetscReal N[], PetscReal dN[][3])
{
  const PetscInt dim = MeshCellDim(type), bary = MeshCellLinear(type) == MESH_TET4 ? 3 : 2, nodes = MeshCellNodes(type);
  Dual           x[3] = {{0}}, L[4] = {{0}};

  for (PetscInt i = 0; i < dim; i++) {
    x[i].v    = xi[i];
    x[i].g[i] = 1;
  }
  L[0].v = 1;
  for (PetscInt i = 0; i < bary; i++) {
    L[i + 1] = x[i];
    L[0]     = Plus(L[0], Linear(-1, x[i], 0));
  }
  for (PetscInt a = 0; a < nodes; a++) {
    const Dual s = Shape(type, a, x, L);

    N[a] = s.v;
    for (PetscInt i = 0; i < 3; i++) dN[a][i] = s.g[i];
  }
}

/* ---- points ---- */

static PetscInt Gauss(PetscInt n, PetscReal x[], PetscReal w[])
{
  static const PetscReal two = 0.57735026918962576, three = 0.77459666924148338; /* 1/sqrt 3, sqrt 3/5 */

  if (n == 2) {
    x[0] = -two;
    x[1] = two;
    w[0] = w[1] = 1;
  } else {
    x[0] = -three;
    x[1] = 0;
    x[2] = three;
    w[0] = w[2] = 5.0 / 9;
    w[1]        = 8.0 / 9;
  }
  return n;
}

/* Triangle: 1 point (degree 1), 3 (degree 2), 6 (degree 4; Dunavant 1985). Weights sum to 1/2. */
static PetscInt Triangle(PetscInt n, PetscReal x[][3], PetscReal w[])
{
  const PetscReal near[3] = {1.0 / 3, 1.0 / 6, 0.44594849091596488632}, far[3] = {1.0 / 3, 1.0 / 6, 0.091576213509770743460}, share[3] = {0.5, 1.0 / 6, 0.5 * 0.22338158967801146570};
  const PetscInt  k = n == 1 ? 0 : n == 3 ? 1 : 2;

  for (PetscInt q = 0; q < n; q++) {
    const PetscReal a = q < 3 ? near[k] : far[k];

    x[q][0] = n > 1 && q % 3 == 1 ? 1 - 2 * a : a;
    x[q][1] = n > 1 && q % 3 == 2 ? 1 - 2 * a : a;
    x[q][2] = 0;
    w[q]    = q < 3 ? share[k] : 0.5 * 0.10995174365532186764;
  }
  return n;
}

/* Tetrahedron: 1 point (degree 1) or 14 (degree 5; Grundmann and Moeller 1978, Walkington). Weights sum to 1/6. */
static PetscInt Tetrahedron(PetscInt n, PetscReal x[][3], PetscReal w[])
{
  static const PetscReal a[2] = {0.31088591926330060980, 0.092735250310891226402}, share[2] = {0.11268792571801585080, 0.073493043116361949544}, c = 0.045503704125649649492;
  static const PetscInt  edge[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

  if (n == 1) {
    x[0][0] = x[0][1] = x[0][2] = 0.25;
    w[0]                        = 1.0 / 6;
    return 1;
  }
  for (PetscInt q = 0; q < 8; q++) {
    for (PetscInt i = 0; i < 3; i++) x[q][i] = q % 4 == i + 1 ? 1 - 3 * a[q / 4] : a[q / 4];
    w[q] = share[q / 4] / 6;
  }
  for (PetscInt q = 8; q < 14; q++) {
    for (PetscInt i = 0; i < 3; i++) x[q][i] = edge[q - 8][0] == i + 1 || edge[q - 8][1] == i + 1 ? 0.5 - c : c;
    w[q] = 0.042546020777081466438 / 6;
  }
  return 14;
}

static void FillPoints(FemShape *s)
{
  const PetscBool curved = s->type != s->linear ? PETSC_TRUE : PETSC_FALSE;
  PetscReal       x[3], w[3], flat[6][3], share[6];
  const PetscInt  n = Gauss(curved ? 3 : 2, x, w);

  if (s->linear == MESH_TRI3) s->points = Triangle(curved ? 6 : 1, s->xi, s->weight);
  else if (s->linear == MESH_TET4) s->points = Tetrahedron(curved ? 14 : 1, s->xi, s->weight);
  else if (s->linear == MESH_PRISM6) {
    const PetscInt m = Triangle(curved ? 6 : 3, flat, share);

    s->points = m * n;
    for (PetscInt q = 0; q < s->points; q++) {
      s->xi[q][0]  = flat[q % m][0];
      s->xi[q][1]  = flat[q % m][1];
      s->xi[q][2]  = x[q / m];
      s->weight[q] = share[q % m] * w[q / m];
    }
  } else {
    s->points = s->dim == 2 ? n * n : n * n * n;
    for (PetscInt q = 0; q < s->points; q++) {
      PetscInt at[3] = {q % n, q / n % n, q / n / n};

      if (!curved) /* in the order of the corners */
        for (PetscInt i = 0; i < 3; i++) at[i] = cube_corner[q][i] > 0;
      s->weight[q] = 1;
      for (PetscInt i = 0; i < 3; i++) {
        s->xi[q][i] = i < s->dim ? x[at[i]] : 0;
        if (i < s->dim) s->weight[q] *= w[at[i]];
      }
    }
  }
}

/* ---- sides ---- */

/* Corners of each side, normal pointing out; -1 ends a triangle. */
static const PetscInt tri_side[3][4] = {{0, 1}, {1, 2}, {2, 0}}, quad_side[4][4] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}}, tet_side[4][4] = {{0, 2, 1, -1}, {0, 1, 3, -1}, {1, 2, 3, -1}, {0, 3, 2, -1}},
                      hex_side[6][4] = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}}, prism_side[5][4] = {{0, 2, 1, -1}, {3, 4, 5, -1}, {0, 1, 4, 3}, {1, 2, 5, 4}, {0, 3, 5, 2}};

/* Our node in the middle of these n corners, -1 when the type has none. */
static PetscInt Between(const FemShape *s, PetscInt n, const PetscInt corner[])
{
  for (PetscInt a = s->corners; a < s->nodes; a++) {
    PetscInt parent[8], same = 0;

    if (MeshCellParents(s->type, a, parent) != n) continue;
    for (PetscInt i = 0; i < n; i++)
      for (PetscInt k = 0; k < n; k++) same += corner[i] == parent[k];
    if (same == n) return a;
  }
  return -1;
}

static void FillSides(FemShape *s)
{
  const PetscInt(*side)[4] = s->linear == MESH_TRI3 ? tri_side : s->linear == MESH_QUAD4 ? quad_side : s->linear == MESH_TET4 ? tet_side : s->linear == MESH_HEX8 ? hex_side : prism_side;

  s->faces = s->linear == MESH_TRI3 ? 3 : s->linear == MESH_PRISM6 ? 5 : s->linear == MESH_HEX8 ? 6 : 4;
  for (PetscInt f = 0; f < s->faces; f++) {
    const PetscInt corners = s->dim == 2 ? 2 : side[f][3] < 0 ? 3 : 4;
    PetscInt       n       = corners, middle;

    for (PetscInt k = 0; k < corners; k++) s->face[f][k] = side[f][k];
    for (PetscInt k = 0; k < (corners == 2 ? 1 : corners) && s->type != s->linear; k++) {
      const PetscInt edge[2] = {side[f][k], side[f][(k + 1) % corners]};

      s->face[f][n++] = Between(s, 2, edge);
    }
    middle = corners == 4 ? Between(s, 4, side[f]) : -1;
    if (middle >= 0) s->face[f][n++] = middle;
    s->face_nodes[f] = n;
  }
}

/* ---- all of it ---- */

/* Node orders of VTK where they differ from gmsh's after the corners. */
static const PetscInt vtk_tet10[]   = {4, 5, 6, 7, 9, 8};
static const PetscInt vtk_hex[]     = {8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25, 26};
static const PetscInt vtk_prism15[] = {6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16};

static void FillShape(FemShape *s, MeshCellType type, unsigned char vtk)
{
  s->type    = type;
  s->linear  = MeshCellLinear(type);
  s->dim     = MeshCellDim(type);
  s->nodes   = MeshCellNodes(type);
  s->corners = MeshCellCorners(type);
  s->vtk     = vtk;
  FillPoints(s);
  for (PetscInt q = 0; q < s->points; q++) FemShapeAt(type, s->xi[q], s->N[q], s->dN[q]);
  for (PetscInt a = 0; a < s->nodes; a++) {
    PetscReal N[FEM_MAX_NODES];

    NodePlace(type, a, s->place[a]);
    FemShapeAt(type, s->place[a], N, s->dN_place[a]);
    s->vtk_node[a] = a;
    if (a < s->corners) continue;
    if (type == MESH_TET10) s->vtk_node[a] = vtk_tet10[a - s->corners];
    if (s->linear == MESH_HEX8) s->vtk_node[a] = vtk_hex[a - s->corners];
    if (s->linear == MESH_PRISM6) s->vtk_node[a] = vtk_prism15[a - s->corners];
  }
  FillSides(s);
}

const FemShape *FemShapeGet(MeshCellType type)
{
  static const struct {
    MeshCellType  type;
    unsigned char vtk;
  } kind[]                 = {{MESH_TRI3, 5}, {MESH_QUAD4, 9}, {MESH_TET4, 10}, {MESH_HEX8, 12}, {MESH_PRISM6, 13}, {MESH_TRI6, 22}, {MESH_QUAD8, 23}, {MESH_QUAD9, 28}, {MESH_TET10, 24}, {MESH_HEX20, 25}, {MESH_HEX27, 29}, {MESH_PRISM15, 26}, {MESH_PRISM18, 32}};
  static FemShape  shape[19];
  static PetscBool filled = PETSC_FALSE;

  if (!filled) { /* the first call comes from one thread, when a mesh is read */
    for (size_t k = 0; k < sizeof(kind) / sizeof(kind[0]); k++) FillShape(&shape[kind[k].type], kind[k].type, kind[k].vtk);
    filled = PETSC_TRUE;
  }
  return (int)type < 1 || (int)type > 18 || !shape[type].nodes ? NULL : &shape[type];
}
