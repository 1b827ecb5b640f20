/*
  fem_body.c - which cells are finite elements, and whether they are sound.

  Only rank 0 has the mesh, and only here are gmsh's own numbers at hand, so every fault of a mesh is named here.
*/
#include "fem_body.h"
#include "fem_element.h"

static const char *CellWord(MeshCellType type)
{
  static const char *const word[] = {"?", "line2", "tri3", "quad4", "tet4", "hex8", "prism6", "pyramid5", "line3", "tri6", "quad9", "tet10", "hex27", "prism18", "pyramid14", "point", "quad8", "hex20", "prism15"};

  return (int)type < 1 || (int)type > 18 ? word[0] : word[type];
}

static PetscErrorCode SelectCells(const Mesh *mesh, FemBody *b, char words[BASE_LINE])
{
  PetscInt entries = 0, bad = -1;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < mesh->n_cells; c++)
    if (MeshCellDim(mesh->type[c]) == mesh->dim) {
      b->n_cells++;
      entries += mesh->start[c + 1] - mesh->start[c];
      if (bad < 0 && !FemShapeGet(mesh->type[c])) bad = c;
    }
  if (mesh->dim < 2 || !b->n_cells) PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: the mesh has no cell of dimension 2 or 3, so no finite element", mesh->source));
  else if (bad >= 0)
    PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: element %d is a %s, and %s is not covered; mesh with triangles, quadrilaterals, tetrahedra, hexahedra or prisms of first or second order", mesh->source, (int)mesh->cell_id[bad],
                            CellWord(mesh->type[bad]), CellWord(mesh->type[bad])));
  if (words[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc3(b->n_cells, &b->cell, b->n_cells + 1, &b->start, entries, &b->node));
  PetscCall(PetscMalloc1(mesh->n_nodes, &b->number));
  for (PetscInt i = 0; i < mesh->n_nodes; i++) b->number[i] = -1;
  b->n_cells = entries = 0;
  for (PetscInt c = 0; c < mesh->n_cells; c++) {
    if (MeshCellDim(mesh->type[c]) != mesh->dim) continue;
    b->start[b->n_cells]  = entries;
    b->cell[b->n_cells++] = c;
    for (PetscInt k = mesh->start[c]; k < mesh->start[c + 1]; k++) {
      b->node[entries++]         = mesh->node[k];
      b->number[mesh->node[k]] = 0;
    }
  }
  b->start[b->n_cells] = entries;
  for (PetscInt i = 0; i < mesh->n_nodes; i++)
    if (b->number[i] == 0) b->number[i] = b->n_nodes++; /* nodes no element uses (arc centres, loose points) are left out */
  PetscCall(PetscMalloc1(b->n_nodes, &b->old));
  for (PetscInt i = 0; i < mesh->n_nodes; i++)
    if (b->number[i] >= 0) b->old[b->number[i]] = i;
  for (PetscInt k = 0; k < entries; k++) b->node[k] = b->number[b->node[k]];
  PetscCall(PetscCalloc2(b->n_nodes + 1, &b->star_start, entries, &b->star));
  for (PetscInt k = 0; k < entries; k++) b->star_start[b->node[k] + 1]++;
  for (PetscInt i = 0; i < b->n_nodes; i++) b->star_start[i + 1] += b->star_start[i];
  for (PetscInt c = 0; c < b->n_cells; c++)
    for (PetscInt k = b->start[c]; k < b->start[c + 1]; k++) b->star[b->star_start[b->node[k]]++] = c;
  for (PetscInt i = b->n_nodes; i > 0; i--) b->star_start[i] = b->star_start[i - 1];
  b->star_start[0] = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Quality(const Mesh *mesh, const FemBody *b, PetscInt c)
{
  const FemShape *shape = FemShapeGet(mesh->type[b->cell[c]]);
  PetscReal       x[FEM_MAX_DOFS];

  for (PetscInt a = 0; a < shape->nodes; a++)
    for (PetscInt d = 0; d < shape->dim; d++) x[a * shape->dim + d] = mesh->x[3 * b->old[b->node[b->start[c] + a]] + d];
  return FemShapeQuality(shape, x);
}

static void Reverse(PetscInt *node, PetscInt from, PetscInt to)
{
  for (PetscInt i = from, j = to - 1; i < j; i++, j--) {
    const PetscInt swap = node[i];

    node[i] = node[j];
    node[j] = swap;
  }
}

/* A plane cell the other way round: its first corner stays, and a node in its middle. */
static void TurnRound(FemBody *b, MeshCellType type, PetscInt c)
{
  const PetscInt corners = MeshCellCorners(type);

  Reverse(&b->node[b->start[c]], 1, corners);
  if (type != MeshCellLinear(type)) Reverse(&b->node[b->start[c]], corners, 2 * corners);
}

/* Does cell c run from node p to node q along one of its edges? */
static PetscBool Runs(const Mesh *mesh, const FemBody *b, PetscInt c, PetscInt p, PetscInt q)
{
  const PetscInt n = MeshCellCorners(mesh->type[b->cell[c]]), *node = &b->node[b->start[c]];

  for (PetscInt a = 0; a < n; a++)
    if (node[a] == p && node[(a + 1) % n] == q) return PETSC_TRUE;
  return PETSC_FALSE;
}

/*
  gmsh numbers a plane surface clockwise when its loop was given so: such cells are turned round. A cell folded over its
  neighbour also has a negative area, but it runs along the shared edge against that neighbour, as sound pairs do.
*/
static PetscBool Folded(const Mesh *mesh, const FemBody *b, const char *clockwise, PetscInt c)
{
  const PetscInt n = MeshCellCorners(mesh->type[b->cell[c]]), *node = &b->node[b->start[c]];

  for (PetscInt a = 0; a < n; a++) {
    const PetscInt p = node[a], q = node[(a + 1) % n];

    for (PetscInt k = b->star_start[p]; k < b->star_start[p + 1]; k++) {
      const PetscInt other = b->star[k];

      if (other != c && !clockwise[other] && Runs(mesh, b, other, q, p)) return PETSC_TRUE;
    }
  }
  return PETSC_FALSE;
}

static PetscErrorCode SayShape(const Mesh *mesh, const FemBody *b, PetscInt c, const char *what, char words[BASE_LINE])
{
  PetscReal      x[3] = {0, 0, 0};
  const PetscInt n    = b->start[c + 1] - b->start[c];

  PetscFunctionBegin;
  for (PetscInt k = b->start[c]; k < b->start[c + 1]; k++)
    for (PetscInt d = 0; d < 3; d++) x[d] += mesh->x[3 * b->old[b->node[k]] + d] / n;
  PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: element %d (%s) near (%.6g, %.6g, %.6g) m is %s; mesh again, or move its nodes", mesh->source, (int)mesh->cell_id[b->cell[c]], CellWord(mesh->type[b->cell[c]]), (double)x[0],
                          (double)x[1], (double)x[2], what));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckShapes(const Mesh *mesh, FemBody *b, char words[BASE_LINE])
{
  const PetscReal collapsed = 1e-8; /* det J over the product of its columns; gmsh's worst slivers reach 1e-4 */
  char           *clockwise;

  PetscFunctionBegin;
  if (mesh->dim == 2)
    for (PetscInt i = 0; i < b->n_nodes; i++) {
      const PetscReal z = mesh->x[3 * b->old[i] + 2], z0 = mesh->x[3 * b->old[0] + 2];

      if (PetscAbsReal(z - z0) > 1e-9 * (PetscAbsReal(mesh->x[3 * b->old[i]]) + PetscAbsReal(mesh->x[3 * b->old[i] + 1]) + PetscAbsReal(z0))) {
        PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: node %d is at z = %g m, off the plane of the others (z = %g m); a plane body lies in x, y", mesh->source, (int)mesh->id[b->old[i]], (double)z, (double)z0));
        PetscFunctionReturn(PETSC_SUCCESS);
      }
    }
  PetscCall(PetscCalloc1(b->n_cells, &clockwise));
  for (PetscInt c = 0; c < b->n_cells && !words[0]; c++) {
    PetscReal quality = Quality(mesh, b, c);

    if (quality <= -collapsed && mesh->dim == 2) {
      TurnRound(b, mesh->type[b->cell[c]], c);
      quality = Quality(mesh, b, c);
      TurnRound(b, mesh->type[b->cell[c]], c);
      clockwise[c] = quality > collapsed;
    }
    if (!(quality > collapsed)) PetscCall(SayShape(mesh, b, c, quality <= -collapsed ? "turned inside out (its Jacobian is negative)" : "collapsed (it has no volume, or two of its nodes coincide)", words));
  }
  for (PetscInt c = 0; c < b->n_cells && !words[0]; c++)
    if (clockwise[c] && Folded(mesh, b, clockwise, c)) PetscCall(SayShape(mesh, b, c, "turned inside out (folded over its neighbour)", words));
  for (PetscInt c = 0; c < b->n_cells && !words[0]; c++)
    if (clockwise[c]) TurnRound(b, mesh->type[b->cell[c]], c);
  PetscCall(PetscFree(clockwise));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Quadratic beside linear, or side nodes on one cell only: such cells hang together at corners alone. */
static PetscErrorCode CheckKinds(const Mesh *mesh, const FemBody *b, char words[BASE_LINE])
{
  PetscInt linear = -1, quadratic = -1, bare = -1, full = -1, one = -1, other = -1;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < b->n_cells; c++) {
    const MeshCellType type = mesh->type[b->cell[c]];
    PetscInt          *first = type == MeshCellLinear(type) ? &linear : &quadratic;

    if (*first < 0) *first = c;
    if ((type == MESH_HEX20 || type == MESH_PRISM15) && bare < 0) bare = c;
    if ((type == MESH_HEX27 || type == MESH_PRISM18) && full < 0) full = c;
  }
  if (linear >= 0 && quadratic >= 0) one = linear, other = quadratic;
  else if (bare >= 0 && full >= 0) one = bare, other = full;
  if (one >= 0)
    PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: element %d is a %s and element %d a %s; their shared sides do not have the same nodes, so they would come apart: mesh all of it in one order, complete or incomplete throughout", mesh->source,
                            (int)mesh->cell_id[b->cell[one]], CellWord(mesh->type[b->cell[one]]), (int)mesh->cell_id[b->cell[other]], CellWord(mesh->type[b->cell[other]])));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool Uses(const FemBody *b, PetscInt c, PetscInt node)
{
  for (PetscInt k = b->start[c]; k < b->start[c + 1]; k++)
    if (b->node[k] == node) return PETSC_TRUE;
  return PETSC_FALSE;
}

static PetscErrorCode CheckDuplicates(const Mesh *mesh, const FemBody *b, char words[BASE_LINE])
{
  PetscFunctionBegin;
  for (PetscInt c = 0; c < b->n_cells; c++) {
    const PetscInt first = b->node[b->start[c]], n = b->start[c + 1] - b->start[c];

    for (PetscInt k = b->star_start[first]; k < b->star_start[first + 1]; k++) {
      const PetscInt other = b->star[k];
      PetscInt       a     = 0;

      if (other <= c || b->start[other + 1] - b->start[other] != n) continue;
      while (a < n && Uses(b, other, b->node[b->start[c] + a])) a++;
      if (a == n) {
        PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: elements %d and %d have the same nodes; keep one of them", mesh->source, (int)mesh->cell_id[b->cell[c]], (int)mesh->cell_id[b->cell[other]]));
        PetscFunctionReturn(PETSC_SUCCESS);
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemBodyCreate(const Mesh *mesh, FemBody *body, char words[BASE_LINE])
{
  PetscFunctionBegin;
  PetscCall(PetscMemzero(body, sizeof(*body)));
  PetscCall(SelectCells(mesh, body, words));
  if (!words[0]) PetscCall(CheckKinds(mesh, body, words));
  if (!words[0]) PetscCall(CheckShapes(mesh, body, words));
  if (!words[0]) PetscCall(CheckDuplicates(mesh, body, words));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemBodyDestroy(FemBody *body)
{
  PetscFunctionBegin;
  PetscCall(PetscFree3(body->cell, body->start, body->node));
  PetscCall(PetscFree(body->number));
  PetscCall(PetscFree(body->old));
  PetscCall(PetscFree2(body->star_start, body->star));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt FemBodyFindSide(const Mesh *mesh, const FemBody *b, PetscInt n, const PetscInt node[], PetscInt cell[2], PetscInt *side)
{
  const PetscInt first = b->number[node[0]];
  PetscInt       found = 0;

  *side = -1;
  if (first < 0) return 0;
  for (PetscInt k = b->star_start[first]; k < b->star_start[first + 1]; k++) {
    const PetscInt  c     = b->star[k];
    const FemShape *shape = FemShapeGet(mesh->type[b->cell[c]]);
    PetscInt        a     = 0;

    while (a < n && Uses(b, c, b->number[node[a]])) a++;
    if (a < n) continue;
    for (PetscInt f = 0; f < shape->faces; f++) {
      PetscInt same = 0;

      if (shape->face_nodes[f] != n) continue;
      for (PetscInt i = 0; i < n; i++)
        for (PetscInt j = 0; j < n; j++) same += b->node[b->start[c] + shape->face[f][i]] == b->number[node[j]];
      if (same != n) continue;
      if (found == 0) *side = f;
      if (found < 2) cell[found] = c;
      found++;
    }
  }
  return found;
}
