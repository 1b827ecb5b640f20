/*
  dem_body_mesh.c - a mesh's cells as convex pieces.

  2D cells stay polygons of three or four corners. 3D cells become tetrahedra: hexahedra, prisms and pyramids get a
  node in their middle, and each four-cornered face is cut along the diagonal from its lowest node, which both
  neighbours do alike. Facets are then matched by their sorted nodes, and both sides take their plane from the same
  sorted triple: the two planes of an interior facet are exact opposites and clipped parts meet without a gap.
*/
#include "dem_body_impl.h"
#include <stdlib.h>
#include <string.h>

/* One facet of one piece: nodes ascending, -1 behind the end in 2D. */
typedef struct {
  PetscInt key[3], piece, local;
} Facet;

/* Pieces by nodes; filled from the cells, then turned into planes. */
typedef struct {
  PetscInt   dim, n_nodes, n_pieces;
  PetscReal *x;             /* [n_nodes][3]: the mesh's and the middles */
  PetscInt  *node;          /* [n_pieces][4]; a triangle leaves the last -1 */
  PetscInt  *cell;          /* [n_pieces] mesh cell it came from */
  Facet     *facet, *named; /* work: facets of all pieces; those of named groups */
  PetscInt  *face_of_group; /* work: face of the body by group of the mesh, -1 unused */
} Pieces;

static int CompareFacets(const void *a, const void *b)
{
  const Facet *f = a, *g = b;

  for (int k = 0; k < 3; k++)
    if (f->key[k] != g->key[k]) return f->key[k] < g->key[k] ? -1 : 1;
  return (f->piece > g->piece) - (f->piece < g->piece);
}

static void SortKey(PetscInt n, PetscInt key[3])
{
  for (PetscInt i = 1; i < n; i++)
    for (PetscInt j = i; j > 0 && key[j] < key[j - 1]; j--) {
      const PetscInt t = key[j];

      key[j] = key[j - 1];
      key[j - 1] = t;
    }
}

/* Corners and faces of gmsh's cells, by shape. A face's unused fourth corner is -1. */
typedef struct {
  PetscInt dim, corners, n_faces, face[6][4];
} Shape;

static const Shape tri = {2, 3, 0, {{0}}};
static const Shape quad = {2, 4, 0, {{0}}};
static const Shape tet = {3, 4, 0, {{0}}};
static const Shape hex = {3, 8, 6, {{0, 3, 2, 1}, {0, 1, 5, 4}, {0, 4, 7, 3}, {1, 2, 6, 5}, {2, 3, 7, 6}, {4, 5, 6, 7}}};
static const Shape prism = {3, 6, 5, {{0, 2, 1, -1}, {3, 4, 5, -1}, {0, 1, 4, 3}, {0, 3, 5, 2}, {1, 2, 5, 4}}};
static const Shape pyra = {3, 5, 5, {{0, 3, 2, 1}, {0, 1, 4, -1}, {1, 2, 4, -1}, {2, 3, 4, -1}, {3, 0, 4, -1}}};
static const Shape line = {1, 2, 0, {{0}}};
static const Shape point = {0, 1, 0, {{0}}};

static const Shape *CellShape(MeshCellType type)
{
  switch (type) {
  case MESH_LINE2:
  case MESH_LINE3:
    return &line;
  case MESH_TRI3:
  case MESH_TRI6:
    return &tri;
  case MESH_QUAD4:
  case MESH_QUAD8:
  case MESH_QUAD9:
    return &quad;
  case MESH_TET4:
  case MESH_TET10:
    return &tet;
  case MESH_HEX8:
  case MESH_HEX20:
  case MESH_HEX27:
    return &hex;
  case MESH_PRISM6:
  case MESH_PRISM15:
  case MESH_PRISM18:
    return &prism;
  case MESH_PYRAMID5:
  case MESH_PYRAMID14:
    return &pyra;
  default:
    return &point;
  }
}

/* A four-cornered face as two triangles along the diagonal from its lowest node. Returns how many triangles. */
static PetscInt SplitFace(const PetscInt corner[4], PetscInt triangle[2][3])
{
  PetscInt low = 0;

  if (corner[3] < 0) {
    for (PetscInt k = 0; k < 3; k++) triangle[0][k] = corner[k];
    return 1;
  }
  for (PetscInt k = 1; k < 4; k++)
    if (corner[k] < corner[low]) low = k;
  for (PetscInt t = 0; t < 2; t++) {
    triangle[t][0] = corner[low];
    triangle[t][1] = corner[(low + 1 + t) % 4];
    triangle[t][2] = corner[(low + 2 + t) % 4];
  }
  return 2;
}

static PetscErrorCode PiecesFromCells(const Mesh *mesh, const MeshGroup *group, Pieces *p)
{
  const PetscInt n = group ? group->n_cells : mesh->n_cells;
  PetscInt       pieces = 0, middles = 0;

  PetscFunctionBegin;
  p->dim = mesh->dim;
  for (PetscInt k = 0; k < n; k++) {
    const Shape *s = CellShape(mesh->type[group ? group->cell[k] : k]);

    if (s->dim != mesh->dim) continue;
    pieces += s->n_faces ? 2 * s->n_faces : 1;
    middles += s->n_faces > 0;
  }
  BaseCheckInput(pieces > 0, PETSC_COMM_SELF, "%s holds no %" PetscInt_FMT "D cell for a body of particles", mesh->source, mesh->dim);
  PetscCall(PetscMalloc1(3 * (mesh->n_nodes + middles), &p->x));
  PetscCall(PetscMalloc1(4 * pieces, &p->node));
  PetscCall(PetscMalloc1(pieces, &p->cell));
  PetscCall(PetscArraycpy(p->x, mesh->x, 3 * mesh->n_nodes));
  p->n_nodes = mesh->n_nodes;
  p->n_pieces = 0;
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt cell = group ? group->cell[k] : k, *v = &mesh->node[mesh->start[cell]];
    const Shape   *s = CellShape(mesh->type[cell]);
    const PetscInt mid = p->n_nodes;

    if (s->dim != mesh->dim) continue;
    if (!s->n_faces) {
      for (PetscInt c = 0; c < 4; c++) p->node[4 * p->n_pieces + c] = c < s->corners ? v[c] : -1;
      p->cell[p->n_pieces++] = cell;
      continue;
    }
    for (PetscInt c = 0; c < 3; c++) {
      p->x[3 * mid + c] = 0;
      for (PetscInt a = 0; a < s->corners; a++) p->x[3 * mid + c] += mesh->x[3 * v[a] + c] / s->corners;
    }
    p->n_nodes++;
    for (PetscInt f = 0; f < s->n_faces; f++) {
      PetscInt corner[4], triangle[2][3], m;

      for (PetscInt c = 0; c < 4; c++) corner[c] = s->face[f][c] < 0 ? -1 : v[s->face[f][c]];
      m = SplitFace(corner, triangle);
      for (PetscInt t = 0; t < m; t++) {
        for (PetscInt c = 0; c < 3; c++) p->node[4 * p->n_pieces + c] = triangle[t][c];
        p->node[4 * p->n_pieces + 3] = mid;
        p->cell[p->n_pieces++] = cell;
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Orient(const Pieces *p, PetscInt a, PetscInt b, PetscInt c, PetscInt d)
{
  const PetscReal *A = &p->x[3 * a], *B = &p->x[3 * b], *C = &p->x[3 * c];
  PetscReal        u[3], v[3];

  for (PetscInt k = 0; k < 3; k++) {
    u[k] = B[k] - A[k];
    v[k] = C[k] - A[k];
  }
  if (p->dim == 2) return u[0] * v[1] - u[1] * v[0];
  {
    const PetscReal *D = &p->x[3 * d], w[3] = {D[0] - A[0], D[1] - A[1], D[2] - A[2]};

    return (u[1] * v[2] - u[2] * v[1]) * w[0] + (u[2] * v[0] - u[0] * v[2]) * w[1] + (u[0] * v[1] - u[1] * v[0]) * w[2];
  }
}

static PetscReal LongestEdge(const Pieces *p, const PetscInt *v)
{
  PetscReal longest = 0;

  for (PetscInt i = 0; i < 4; i++)
    for (PetscInt j = 0; j < i; j++) {
      PetscReal d2 = 0;

      if (v[i] < 0 || v[j] < 0) continue;
      for (PetscInt c = 0; c < 3; c++) d2 += PetscSqr(p->x[3 * v[i] + c] - p->x[3 * v[j] + c]);
      longest = PetscMax(longest, d2);
    }
  return PetscSqrtReal(longest);
}

/* Turn every piece the right way round (2D counter-clockwise, 3D positive); refuse the flat and the folded. The
   tetrahedra of one cell all turn the same way unless it is folded. volume [m2 or m3]: sum over the pieces. */
static PetscErrorCode PiecesOrient(const Mesh *mesh, Pieces *p, PetscReal *volume)
{
  PetscReal before = 0;

  PetscFunctionBegin;
  *volume = 0;
  for (PetscInt k = 0; k < p->n_pieces; k++) {
    PetscInt       *v = &p->node[4 * k];
    const PetscReal len = LongestEdge(p, v), flat = 1e-9 * (p->dim == 2 ? len * len : len * len * len), turn = Orient(p, v[0], v[1], v[2], v[3]);
    const PetscInt  id = mesh->cell_id ? mesh->cell_id[p->cell[k]] : p->cell[k];
    const PetscBool same = k > 0 && p->cell[k] == p->cell[k - 1] ? PETSC_TRUE : PETSC_FALSE;

    BaseCheckInput(PetscAbsReal(turn) > flat && !(same && turn * before < 0), PETSC_COMM_SELF,
                   "%s: cell %" PetscInt_FMT " is flat or folded; mesh the body again", mesh->source, id);
    before = turn;
    if (turn < 0) {
      const PetscInt last = p->dim == 2 && v[3] >= 0 ? 3 : 2, t = v[1];

      v[1] = v[last];
      v[last] = t;
    }
    *volume += PetscAbsReal(turn) / (p->dim == 2 ? 2 : 6);
    if (p->dim == 3 || v[3] < 0) continue;
    BaseCheckInput(Orient(p, v[0], v[1], v[2], 0) > flat && Orient(p, v[1], v[2], v[3], 0) > flat && Orient(p, v[2], v[3], v[0], 0) > flat &&
                       Orient(p, v[3], v[0], v[1], 0) > flat,
                   PETSC_COMM_SELF, "%s: cell %" PetscInt_FMT " is not convex; mesh the body again", mesh->source, id);
    *volume += 0.5 * Orient(p, v[2], v[3], v[0], 0);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes of facet `local` of a piece, in outward order; returns the piece's facets when local < 0. */
static PetscInt PieceFacet(const Pieces *p, PetscInt piece, PetscInt local, PetscInt out[3])
{
  static const PetscInt of_tet[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  const PetscInt       *v = &p->node[4 * piece], n = p->dim == 2 && v[3] < 0 ? 3 : 4;

  if (local < 0) return n;
  out[2] = -1;
  if (p->dim == 2) {
    out[0] = v[local];
    out[1] = v[(local + 1) % n];
  } else {
    for (PetscInt c = 0; c < 3; c++) out[c] = v[of_tet[local][c]];
  }
  return n;
}

/* The plane through the sorted nodes of a facet: the same numbers whichever piece asks. */
static void FacetPlane(const Pieces *p, const PetscInt key[3], PetscReal plane[4])
{
  const PetscReal *a = &p->x[3 * key[0]], *b = &p->x[3 * key[1]];
  PetscReal        mid[3], len = 0;

  if (p->dim == 2) {
    plane[0] = b[1] - a[1];
    plane[1] = a[0] - b[0];
    plane[2] = 0;
    for (PetscInt c = 0; c < 3; c++) mid[c] = (a[c] + b[c]) / 2;
  } else {
    const PetscReal *d = &p->x[3 * key[2]], u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {d[0] - a[0], d[1] - a[1], d[2] - a[2]};

    plane[0] = u[1] * v[2] - u[2] * v[1];
    plane[1] = u[2] * v[0] - u[0] * v[2];
    plane[2] = u[0] * v[1] - u[1] * v[0];
    for (PetscInt c = 0; c < 3; c++) mid[c] = (a[c] + b[c] + d[c]) / 3;
  }
  for (PetscInt c = 0; c < 3; c++) len += plane[c] * plane[c];
  len = PetscSqrtReal(len);
  plane[3] = 0;
  for (PetscInt c = 0; c < 3; c++) {
    plane[c] /= len;
    plane[3] += plane[c] * mid[c];
  }
}

/* Named facets of the mesh, sorted by nodes: piece holds the group. */
static PetscErrorCode NamedFacets(const Mesh *mesh, PetscInt *n, Facet **named)
{
  PetscInt total = 0;

  PetscFunctionBegin;
  for (PetscInt g = 0; g < mesh->n_groups; g++)
    if (mesh->group[g].dim == mesh->dim - 1) total += 2 * mesh->group[g].n_cells;
  PetscCall(PetscMalloc1(total, named));
  *n = 0;
  for (PetscInt g = 0; g < mesh->n_groups; g++) {
    const MeshGroup *group = &mesh->group[g];

    for (PetscInt k = 0; group->dim == mesh->dim - 1 && k < group->n_cells; k++) {
      const PetscInt *v = &mesh->node[mesh->start[group->cell[k]]];
      const Shape    *s = CellShape(mesh->type[group->cell[k]]);
      PetscInt        corner[4] = {v[0], v[1], s->corners > 2 ? v[2] : -1, s->corners > 3 ? v[3] : -1}, triangle[2][3] = {{v[0], v[1], -1}}, m = 1;

      if (mesh->dim == 3) m = SplitFace(corner, triangle);
      for (PetscInt t = 0; t < m; t++) {
        Facet *f = &(*named)[(*n)++];

        for (PetscInt c = 0; c < 3; c++) f->key[c] = triangle[t][c];
        SortKey(mesh->dim, f->key);
        f->piece = g;
        f->local = 0;
      }
    }
  }
  if (*n) qsort(*named, *n, sizeof(**named), CompareFacets);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First named facet with this key, -1 when none. */
static PetscInt FindNamed(PetscInt n, const Facet *named, const PetscInt key[3])
{
  const Facet want = {{key[0], key[1], key[2]}, -1, 0};
  PetscInt    lo = 0, hi = n;

  while (lo < hi) {
    const PetscInt m = (lo + hi) / 2;

    if (CompareFacets(&named[m], &want) < 0)
      lo = m + 1;
    else
      hi = m;
  }
  return lo < n && !memcmp(named[lo].key, key, sizeof(named[lo].key)) ? lo : -1;
}

static PetscErrorCode PiecesToBody(const Mesh *mesh, Pieces *p, DemBody *body)
{
  Facet   *facet;
  PetscInt n_facets = 0, n_named = 0, n_boundary = 0, n_planes = 0, unnamed = -1, n_faces = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < p->n_pieces; k++) n_planes += PieceFacet(p, k, -1, NULL);
  PetscCall(PetscMalloc1(n_planes, &p->facet));
  facet = p->facet;
  for (PetscInt k = 0; k < p->n_pieces; k++)
    for (PetscInt f = 0; f < PieceFacet(p, k, -1, NULL); f++, n_facets++) {
      PieceFacet(p, k, f, facet[n_facets].key);
      SortKey(p->dim, facet[n_facets].key);
      facet[n_facets].piece = k;
      facet[n_facets].local = f;
    }
  qsort(facet, n_facets, sizeof(*facet), CompareFacets);
  for (PetscInt k = 0, m; k < n_facets; k += m) {
    for (m = 1; k + m < n_facets && !memcmp(facet[k].key, facet[k + m].key, sizeof(facet[k].key)); m++) {
    }
    BaseCheckInput(m <= 2, PETSC_COMM_SELF, "%s: %" PetscInt_FMT " cells share one facet (cell %" PetscInt_FMT " is one of them); remove the duplicates",
                   mesh->source, m, mesh->cell_id ? mesh->cell_id[p->cell[facet[k].piece]] : p->cell[facet[k].piece]);
    n_boundary += m == 1;
  }
  PetscCall(NamedFacets(mesh, &n_named, &p->named));

  body->dim = p->dim;
  PetscCall(DemBodyAllocate(p->n_pieces, n_planes, n_boundary, mesh->n_groups + 1, body));
  PetscCall(PetscMalloc1(mesh->n_groups, &p->face_of_group));
  for (PetscInt g = 0; g < mesh->n_groups; g++) p->face_of_group[g] = -1;
  body->start[0] = 0;
  for (PetscInt c = 0; c < 3; c++) {
    body->low[c] = PETSC_MAX_REAL;
    body->high[c] = -PETSC_MAX_REAL;
  }
  for (PetscInt k = 0; k < p->n_pieces; k++) {
    PetscReal *box = &body->box[6 * k];

    body->start[k + 1] = body->start[k] + PieceFacet(p, k, -1, NULL);
    for (PetscInt c = 0; c < 3; c++) {
      box[c] = PETSC_MAX_REAL;
      box[3 + c] = -PETSC_MAX_REAL;
      for (PetscInt a = 0; a < 4; a++) {
        const PetscInt v = p->node[4 * k + a];

        if (v < 0) continue;
        box[c] = PetscMin(box[c], p->x[3 * v + c]);
        box[3 + c] = PetscMax(box[3 + c], p->x[3 * v + c]);
      }
      body->low[c] = PetscMin(body->low[c], box[c]);
      body->high[c] = PetscMax(body->high[c], box[3 + c]);
    }
  }
  n_boundary = 0;
  for (PetscInt k = 0, m; k < n_facets; k += m) {
    PetscReal plane[4];
    PetscInt  face = -1;

    m = k + 1 < n_facets && !memcmp(facet[k].key, facet[k + 1].key, sizeof(facet[k].key)) ? 2 : 1;
    FacetPlane(p, facet[k].key, plane);
    if (m == 1) {
      const PetscInt at = FindNamed(n_named, p->named, facet[k].key);

      if (at < 0) {
        if (unnamed < 0) unnamed = n_faces++;
        face = unnamed;
      } else {
        const PetscInt group = p->named[at].piece, next = at + 1;

        BaseCheckInput(next == n_named || memcmp(p->named[next].key, p->named[at].key, sizeof(p->named[at].key)) || p->named[next].piece == group,
                       PETSC_COMM_SELF, "%s: groups '%s' and '%s' share facets; a facet of a body of particles belongs to one group", mesh->source,
                       mesh->group[group].name, mesh->group[p->named[next].piece].name);
        if (p->face_of_group[group] < 0) {
          p->face_of_group[group] = n_faces;
          PetscCall(PetscStrncpy(body->face_name[n_faces++], mesh->group[group].name, sizeof(body->face_name[0])));
        }
        face = p->face_of_group[group];
      }
    }
    for (PetscInt side = 0; side < m; side++) {
      const Facet *f = &facet[k + side];
      PetscInt     v[3], at = body->start[f->piece] + f->local;
      PetscReal    out = 0, inner[3] = {0, 0, 0};
      PetscInt     corners = PieceFacet(p, f->piece, f->local, v);

      for (PetscInt a = 0; a < corners; a++)
        for (PetscInt c = 0; c < 3; c++) inner[c] += p->x[3 * p->node[4 * f->piece + a] + c] / corners;
      for (PetscInt c = 0; c < 3; c++) out += plane[c] * inner[c];
      for (PetscInt c = 0; c < 4; c++) body->plane[4 * at + c] = out < plane[3] ? plane[c] : -plane[c];
      body->face[at] = face;
      body->beyond[at] = m == 2 ? facet[k + 1 - side].piece : -1;
      if (m == 1) {
        for (PetscInt a = 0; a < p->dim; a++) {
          for (PetscInt c = 0; c < 3; c++) body->simplex[3 * (p->dim * n_boundary + a) + c] = p->x[3 * v[a] + c];
          body->simplex_node[p->dim * n_boundary + a] = v[a];
        }
        body->simplex_face[n_boundary++] = face;
      }
    }
  }
  body->n_faces = n_faces;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemBodyCreateFromMesh(const Mesh *mesh, const char *group, PetscReal thickness, DemBody *body)
{
  const MeshGroup *part = NULL;
  Pieces           pieces = {0};
  PetscReal        size = 0, volume = 0;
  PetscErrorCode   code;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(body, sizeof(*body)));
  BaseCheckInput(mesh->dim == 2 || mesh->dim == 3, PETSC_COMM_SELF, "%s: a body of particles needs cells of 2 or 3 dimensions", mesh->source);
  BaseCheckInput(mesh->dim == 3 || (thickness > 0 && !PetscIsInfOrNanReal(thickness)), PETSC_COMM_SELF, "A 2D body needs a thickness above 0, not %.6g m",
                 (double)thickness);
  if (group && group[0]) {
    for (PetscInt g = 0; g < mesh->n_groups; g++)
      if (mesh->group[g].dim == mesh->dim && !strcmp(mesh->group[g].name, group)) part = &mesh->group[g];
    BaseCheckInput(part, PETSC_COMM_SELF, "%s has no group '%s' of %" PetscInt_FMT "D cells", mesh->source, group, mesh->dim);
  }
  for (PetscInt k = 0; k < 3 * mesh->n_nodes; k++) size = PetscMax(size, PetscAbsReal(mesh->x[k]));
  for (PetscInt k = 0; mesh->dim == 2 && k < mesh->n_nodes; k++)
    BaseCheckInput(PetscAbsReal(mesh->x[3 * k + 2]) <= 1e-9 * size, PETSC_COMM_SELF,
                   "%s: node %" PetscInt_FMT " lies at z = %.6g m; a 2D body lies in the plane z = 0", mesh->source, mesh->id ? mesh->id[k] : k,
                   (double)mesh->x[3 * k + 2]);
  body->thickness = mesh->dim == 2 ? thickness : 1;
  code = PiecesFromCells(mesh, part, &pieces);
  if (!code) code = PiecesOrient(mesh, &pieces, &volume);
  if (!code) code = PiecesToBody(mesh, &pieces, body);
  PetscCall(PetscFree(pieces.x));
  PetscCall(PetscFree(pieces.node));
  PetscCall(PetscFree(pieces.cell));
  PetscCall(PetscFree(pieces.facet));
  PetscCall(PetscFree(pieces.named));
  PetscCall(PetscFree(pieces.face_of_group));
  if (code) PetscCall(DemBodyDestroy(body));
  PetscCall(code);
  volume *= body->thickness;
  if (PetscAbsReal(DemBodyVolume(body) - volume) > 1e-9 * volume) {
    PetscCall(DemBodyDestroy(body));
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s: cells are repeated or do not fit together; mesh the body again", mesh->source);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
