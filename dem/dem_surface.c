/*
  dem_surface.c - a surface from loose triangles or segments: nodes, edges, neighbours, orientation; its mass.

  Corners at the same place become one node, so a file that repeats its points (STL) has neighbours too. Cells that face
  different ways are turned, part by part, and closed parts so that they enclose a positive volume.
*/
#include "dem_surface.h"
#include <stdlib.h>
#include <string.h>

typedef struct {
  PetscReal key;
  PetscInt  at;
} Sorted;

static int ByKey(const void *a, const void *b)
{
  const Sorted *p = a, *q = b;

  if (p->key != q->key) return p->key < q->key ? -1 : 1;
  return p->at < q->at ? -1 : p->at > q->at;
}

typedef struct {
  PetscInt a, b, cell, side; /* nodes in order, cell, which of its edges */
} Half;

static int ByNodes(const void *a, const void *b)
{
  const Half *p = a, *q = b;

  if (p->a != q->a) return p->a < q->a ? -1 : 1;
  if (p->b != q->b) return p->b < q->b ? -1 : 1;
  if (p->cell != q->cell) return p->cell < q->cell ? -1 : 1;
  return p->side < q->side ? -1 : p->side > q->side;
}

static PetscReal Distance2(const PetscReal *a, const PetscReal *b)
{
  return PetscSqr(a[0] - b[0]) + PetscSqr(a[1] - b[1]) + PetscSqr(a[2] - b[2]);
}

/* Corners within `close` of one another become one node: the first of them in the file. Sorted along a direction no mesh is aligned with. */
static PetscErrorCode Weld(DemSurface *s, const PetscReal *x, PetscInt m, PetscReal close)
{
  static const PetscReal direction[3] = {0.5377, 0.6134, 0.5784};
  PetscInt              *node;
  Sorted                *sorted;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m, &sorted, m, &node));
  for (PetscInt k = 0; k < m; k++) {
    sorted[k].key = direction[0] * x[3 * k] + direction[1] * x[3 * k + 1] + direction[2] * x[3 * k + 2];
    sorted[k].at  = k;
    node[k]       = -1;
  }
  qsort(sorted, (size_t)m, sizeof(*sorted), ByKey);
  for (PetscInt i = 0; i < m; i++) {
    if (node[sorted[i].at] >= 0) continue;
    node[sorted[i].at] = sorted[i].at;
    for (PetscInt j = i + 1; j < m && sorted[j].key - sorted[i].key <= 2 * close; j++)
      if (node[sorted[j].at] < 0 && Distance2(&x[3 * sorted[i].at], &x[3 * sorted[j].at]) <= close * close) node[sorted[j].at] = sorted[i].at;
  }
  PetscCall(PetscMalloc2(3 * m, &s->x, m, &s->corner)); /* as many nodes as corners at most */
  for (PetscInt k = 0; k < m; k++) sorted[k].at = -1;
  for (PetscInt k = 0; k < m; k++) {
    const PetscInt first = node[k];

    if (sorted[first].at < 0) {
      for (PetscInt d = 0; d < 3; d++) s->x[3 * s->n_nodes + d] = x[3 * first + d];
      sorted[first].at = s->n_nodes++;
    }
    s->corner[k] = sorted[first].at;
  }
  PetscCall(PetscFree2(sorted, node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void CellNormal(DemSurface *s, PetscInt c)
{
  const PetscReal *a = &s->x[3 * s->corner[s->dim * c]], *b = &s->x[3 * s->corner[s->dim * c + 1]];
  PetscReal       *n = &s->normal[3 * c], length;

  if (s->dim == 2) { /* to the right of a segment: out of a polygon that runs against the clock */
    n[0] = b[1] - a[1];
    n[1] = a[0] - b[0];
    n[2] = 0;
  } else {
    const PetscReal *d = &s->x[3 * s->corner[3 * c + 2]], p[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, q[3] = {d[0] - a[0], d[1] - a[1], d[2] - a[2]};

    for (PetscInt k = 0; k < 3; k++) n[k] = p[(k + 1) % 3] * q[(k + 2) % 3] - p[(k + 2) % 3] * q[(k + 1) % 3];
  }
  length = PetscSqrtReal(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  for (PetscInt k = 0; k < 3; k++) n[k] /= length;
}

void DemSurfaceNormals(DemSurface *s)
{
  for (PetscInt c = 0; c < s->n; c++) CellNormal(s, c);
}

/* Least height of a cell over its longest side: 0 when it has no area (2D: no length). */
static PetscReal Flatness(const DemSurface *s, PetscInt c)
{
  const PetscInt *node = &s->corner[s->dim * c];
  PetscReal       longest = 0, area = 0;

  for (PetscInt k = 0; k < s->dim; k++) longest = PetscMax(longest, Distance2(&s->x[3 * node[k]], &s->x[3 * node[(k + 1) % s->dim]]));
  if (s->dim == 2 || longest == 0) return longest > 0 ? 1 : 0;
  for (PetscInt k = 0; k < 3; k++) {
    const PetscReal *a = &s->x[3 * node[0]], *b = &s->x[3 * node[1]], *d = &s->x[3 * node[2]];
    const PetscInt   i = (k + 1) % 3, j = (k + 2) % 3;

    area += PetscSqr((b[i] - a[i]) * (d[j] - a[j]) - (b[j] - a[j]) * (d[i] - a[i]));
  }
  return PetscSqrtReal(area) / longest;
}

/* Edges with the cells on either side; refuses a third cell, and a second one on the same three corners. */
static PetscErrorCode FindEdges(const char *source, DemSurface *s)
{
  Half    *half;
  PetscInt m = 3 * s->n;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m, &half));
  for (PetscInt c = 0; c < s->n; c++)
    for (PetscInt k = 0; k < 3; k++) {
      const PetscInt a = s->corner[3 * c + k], b = s->corner[3 * c + (k + 1) % 3];

      half[3 * c + k] = (Half){PetscMin(a, b), PetscMax(a, b), c, k};
    }
  qsort(half, (size_t)m, sizeof(*half), ByNodes);
  PetscCall(PetscMalloc3(2 * m, &s->edge, 2 * m, &s->edge_cell, m, &s->cell_edge));
  for (PetscInt i = 0; i < m;) {
    PetscInt j = i + 1;

    while (j < m && half[j].a == half[i].a && half[j].b == half[i].b) j++;
    if (j - i > 2) {
      const PetscReal *a = &s->x[3 * half[i].a], *b = &s->x[3 * half[i].b];
      const PetscInt   one = half[i].cell + 1, two = half[i + 1].cell + 1, three = half[i + 2].cell + 1;
      char             words[512];

      PetscCall(BaseFormat(words, "%" PetscInt_FMT " triangles (numbers %" PetscInt_FMT ", %" PetscInt_FMT ", %" PetscInt_FMT ") share the edge from (%.6g, %.6g, %.6g) to (%.6g, %.6g, %.6g) m", j - i, one, two, three, (double)a[0],
                           (double)a[1], (double)a[2], (double)b[0], (double)b[1], (double)b[2]));
      PetscCall(PetscFree(half));
      SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s: %s; a surface has two sides at most, so cut it there into two tools", source, words);
    }
    s->edge[2 * s->n_edges]          = half[i].a;
    s->edge[2 * s->n_edges + 1]      = half[i].b;
    s->edge_cell[2 * s->n_edges]     = half[i].cell;
    s->edge_cell[2 * s->n_edges + 1] = j - i == 2 ? half[i + 1].cell : -1;
    for (PetscInt k = i; k < j; k++) s->cell_edge[3 * half[k].cell + half[k].side] = s->n_edges;
    s->n_edges++;
    i = j;
  }
  PetscCall(PetscFree(half));
  for (PetscInt e = 0; e < s->n_edges; e++) {
    const PetscInt p = s->edge_cell[2 * e], q = s->edge_cell[2 * e + 1];
    PetscInt       same = 0;

    if (q < 0) continue;
    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < 3; j++) same += s->corner[3 * p + i] == s->corner[3 * q + j];
    BaseCheckInput(same < 3, PETSC_COMM_SELF, "%s: triangles %" PetscInt_FMT " and %" PetscInt_FMT " have the same corners; remove one", source, p + 1, q + 1);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes joined by an edge or segment. */
static PetscErrorCode FindSpokes(DemSurface *s)
{
  const PetscInt  m    = s->dim == 3 ? s->n_edges : s->n;
  const PetscInt *pair = s->dim == 3 ? s->edge : s->corner;
  PetscInt       *fill;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(s->n_nodes + 1, &fill));
  PetscCall(PetscMalloc2(s->n_nodes + 1, &s->spoke_start, 2 * m, &s->spoke));
  for (PetscInt k = 0; k < 2 * m; k++) fill[pair[k] + 1]++;
  for (PetscInt i = 0; i < s->n_nodes; i++) fill[i + 1] += fill[i];
  PetscCall(PetscArraycpy(s->spoke_start, fill, s->n_nodes + 1));
  for (PetscInt k = 0; k < m; k++) {
    s->spoke[fill[pair[2 * k]]++]     = pair[2 * k + 1];
    s->spoke[fill[pair[2 * k + 1]]++] = pair[2 * k];
  }
  PetscCall(PetscFree(fill));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Turn(DemSurface *s, PetscInt c)
{
  const PetscInt keep = s->corner[s->dim * c];

  s->corner[s->dim * c]     = s->corner[s->dim * c + 1];
  s->corner[s->dim * c + 1] = keep;
  if (s->dim == 3) { /* edges 0: 0-1 stays; 1: 1-2 and 2: 2-0 change places */
    const PetscInt e = s->cell_edge[3 * c + 1];

    s->cell_edge[3 * c + 1] = s->cell_edge[3 * c + 2];
    s->cell_edge[3 * c + 2] = e;
  }
}

/* Does cell c run along its side k from the lower node to the higher? */
static PetscBool Forward(const DemSurface *s, PetscInt c, PetscInt edge)
{
  for (PetscInt k = 0; k < 3; k++)
    if (s->cell_edge[3 * c + k] == edge) return (PetscBool)(s->corner[3 * c + k] == s->edge[2 * edge]);
  return PETSC_FALSE;
}

/* 2D: the other segment at a node with exactly two, else -1. node_cell [n_nodes][2] */
static PetscInt Across(const DemSurface *s, const PetscInt *node_cell, PetscInt c, PetscInt k)
{
  const PetscInt node = s->corner[2 * c + k];

  if (s->spoke_start[node + 1] - s->spoke_start[node] != 2) return -1;
  return node_cell[2 * node] == c ? node_cell[2 * node + 1] : node_cell[2 * node];
}

/* Neighbours face the same way; parts that are closed enclose a positive volume. */
static PetscErrorCode Orient(const char *source, DemSurface *s)
{
  PetscInt *queue, *node_cell = NULL, twisted = -1;
  PetscBool *seen;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->n, &queue));
  PetscCall(PetscCalloc1(s->n, &seen));
  s->closed = PETSC_TRUE;
  if (s->dim == 2) {
    PetscCall(PetscMalloc1(2 * s->n_nodes, &node_cell));
    for (PetscInt k = 0; k < 2 * s->n_nodes; k++) node_cell[k] = -1;
    for (PetscInt k = 0; k < 2 * s->n; k++) {
      const PetscInt node = s->corner[k];

      if (node_cell[2 * node] < 0) node_cell[2 * node] = k / 2;
      else node_cell[2 * node + 1] = k / 2;
    }
    for (PetscInt i = 0; i < s->n_nodes; i++)
      if (s->spoke_start[i + 1] - s->spoke_start[i] != 2) s->closed = PETSC_FALSE;
  } else
    for (PetscInt e = 0; e < s->n_edges; e++)
      if (s->edge_cell[2 * e + 1] < 0) s->closed = PETSC_FALSE;
  for (PetscInt start = 0; start < s->n; start++) {
    PetscInt  head = 0, tail = 0;
    PetscBool whole = PETSC_TRUE;
    PetscReal volume = 0;
    const PetscReal *o = &s->x[3 * s->corner[s->dim * start]];

    if (seen[start]) continue;
    seen[start]   = PETSC_TRUE;
    queue[tail++] = start;
    while (head < tail) {
      const PetscInt c = queue[head++];

      for (PetscInt k = 0; k < s->dim; k++) {
        PetscInt  other, e = -1;
        PetscBool alike;

        if (s->dim == 3) {
          e     = s->cell_edge[3 * c + k];
          other = s->edge_cell[2 * e] == c ? s->edge_cell[2 * e + 1] : s->edge_cell[2 * e];
        } else other = Across(s, node_cell, c, k);
        if (other < 0) {
          whole = PETSC_FALSE;
          continue;
        }
        alike = s->dim == 3 ? (PetscBool)(Forward(s, c, e) != Forward(s, other, e)) : (PetscBool)(s->corner[2 * other + 1 - k] == s->corner[2 * c + k]);
        if (!seen[other]) {
          if (!alike) Turn(s, other);
          seen[other]   = PETSC_TRUE;
          queue[tail++] = other;
        } else if (!alike) twisted = c;
      }
    }
    for (PetscInt i = 0; i < tail; i++) {
      PetscReal a[3][3] = {{0}};

      for (PetscInt k = 0; k < s->dim; k++)
        for (PetscInt d = 0; d < 3; d++) a[k][d] = s->x[3 * s->corner[s->dim * queue[i] + k] + d] - o[d];
      if (s->dim == 2) volume += a[0][0] * a[1][1] - a[0][1] * a[1][0];
      else
        for (PetscInt d = 0; d < 3; d++) volume += a[0][d] * (a[1][(d + 1) % 3] * a[2][(d + 2) % 3] - a[1][(d + 2) % 3] * a[2][(d + 1) % 3]);
    }
    if (whole && volume < 0)
      for (PetscInt i = 0; i < tail; i++) Turn(s, queue[i]);
  }
  PetscCall(PetscFree(queue));
  PetscCall(PetscFree(seen));
  PetscCall(PetscFree(node_cell));
  BaseCheckInput(twisted < 0, PETSC_COMM_SELF, "%s: the surface has one side only (like a Moebius strip) at triangle %" PetscInt_FMT "; cut it open", source, twisted + 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Fill(const char *source, PetscInt dim, PetscInt n, const PetscReal corner[], DemSurface *s)
{
  const char *thing = dim == 3 ? "triangle" : "segment";
  PetscReal   size = 0;

  PetscFunctionBegin;
  s->dim = dim;
  s->n   = n;
  BaseCheckInput(n > 0, PETSC_COMM_SELF, "%s: the surface has no %s", source, thing);
  for (PetscInt k = 0; k < 3 * dim * n; k++) BaseCheckInput(!PetscIsInfOrNanReal(corner[k]), PETSC_COMM_SELF, "%s: %s %" PetscInt_FMT " has a coordinate that is not a number", source, thing, k / (3 * dim) + 1);
  for (PetscInt d = 0; d < 3; d++) {
    s->low[d] = s->high[d] = corner[d];
    for (PetscInt k = 1; k < dim * n; k++) {
      s->low[d]  = PetscMin(s->low[d], corner[3 * k + d]);
      s->high[d] = PetscMax(s->high[d], corner[3 * k + d]);
    }
    size = PetscMax(size, s->high[d] - s->low[d]);
  }
  if (dim == 2) BaseCheckInput(s->low[2] == 0 && s->high[2] == 0, PETSC_COMM_SELF, "%s: a tool of a 2D scene lies in the plane z = 0", source);
  PetscCall(Weld(s, corner, dim * n, 1e-9 * size));
  PetscCall(PetscMalloc1(3 * n, &s->normal));
  for (PetscInt c = 0; c < n; c++) {
    const PetscInt *node = &s->corner[dim * c];
    PetscReal       flat = node[0] == node[1] || (dim == 3 && (node[1] == node[2] || node[0] == node[2])) ? 0 : Flatness(s, c);

    BaseCheckInput(flat > 1e-9, PETSC_COMM_SELF, "%s: %s %" PetscInt_FMT ", at (%.6g, %.6g, %.6g) m, has no %s; remove it", source, thing, c + 1, (double)s->x[3 * node[0]], (double)s->x[3 * node[0] + 1],
                   (double)s->x[3 * node[0] + 2], dim == 3 ? "area" : "length");
  }
  if (dim == 3) PetscCall(FindEdges(source, s));
  PetscCall(FindSpokes(s));
  if (dim == 2)
    for (PetscInt i = 0; i < s->n_nodes; i++)
      for (PetscInt a = s->spoke_start[i]; a < s->spoke_start[i + 1]; a++)
        for (PetscInt b = a + 1; b < s->spoke_start[i + 1]; b++)
          BaseCheckInput(s->spoke[a] != s->spoke[b], PETSC_COMM_SELF, "%s: two segments join (%.6g, %.6g) and (%.6g, %.6g) m; remove one", source, (double)s->x[3 * i], (double)s->x[3 * i + 1], (double)s->x[3 * s->spoke[a]],
                         (double)s->x[3 * s->spoke[a] + 1]);
  PetscCall(Orient(source, s));
  for (PetscInt c = 0; c < n; c++) CellNormal(s, c);
  PetscCall(PetscMalloc1(s->n_nodes, &s->node_owner));
  for (PetscInt k = dim * n - 1; k >= 0; k--) s->node_owner[s->corner[k]] = k / dim;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemSurfaceCreate(const char *source, PetscInt dim, PetscInt n, const PetscReal corner[], DemSurface *surface)
{
  PetscErrorCode code;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(surface, sizeof(*surface)));
  code = Fill(source, dim, n, corner, surface);
  if (code) PetscCall(DemSurfaceDestroy(surface));
  PetscFunctionReturn(code);
}

PetscErrorCode DemSurfaceCreateBox(PetscInt dim, const PetscReal low[3], const PetscReal high[3], DemSurface *surface)
{
  static const PetscInt quad[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}; /* corner bits x y z */
  static const PetscInt round[5]   = {0, 1, 3, 2, 0};
  PetscReal             x[12][3][3] = {{{0}}}, line[4][2][3] = {{{0}}};

  PetscFunctionBegin;
  for (PetscInt d = 0; d < dim; d++) BaseCheckInput(high[d] > low[d], PETSC_COMM_SELF, "A box needs a positive size along %c", (char)('x' + d));
  for (PetscInt f = 0; f < 6; f++)
    for (PetscInt t = 0; t < 2; t++)
      for (PetscInt k = 0; k < 3; k++) {
        const PetscInt corner = quad[f][k ? (k + t) : 0];

        for (PetscInt d = 0; d < 3; d++) x[2 * f + t][k][d] = corner >> d & 1 ? high[d] : low[d];
      }
  for (PetscInt e = 0; e < 4; e++)
    for (PetscInt k = 0; k < 2; k++)
      for (PetscInt d = 0; d < 2; d++) line[e][k][d] = round[e + k] >> d & 1 ? high[d] : low[d];
  PetscCall(dim == 3 ? DemSurfaceCreate("box", 3, 12, &x[0][0][0], surface) : DemSurfaceCreate("box", 2, 4, &line[0][0][0], surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemSurfaceDestroy(DemSurface *s)
{
  PetscFunctionBegin;
  PetscCall(PetscFree2(s->x, s->corner));
  PetscCall(PetscFree(s->normal));
  if (s->dim == 3) PetscCall(PetscFree3(s->edge, s->edge_cell, s->cell_edge));
  PetscCall(PetscFree2(s->spoke_start, s->spoke));
  PetscCall(PetscFree(s->node_owner));
  PetscCall(PetscFree(s->box_start));
  PetscCall(PetscFree(s->box));
  PetscCall(PetscMemzero(s, sizeof(*s)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Signed cones from one point to the cells fill the body once: the divergence theorem, cell by cell. */
PetscErrorCode DemSurfaceMass(const DemSurface *s, PetscReal thickness, PetscReal *volume, PetscReal centre[3], PetscReal inertia[3][3])
{
  const PetscInt  m = s->dim;
  PetscReal       o[3], V = 0, first[3] = {0}, second[3][3] = {{0}};

  PetscFunctionBegin;
  BaseCheckInput(s->closed, PETSC_COMM_SELF, "The surface is not closed, so it encloses no volume: give mass and inertia instead of a density");
  for (PetscInt d = 0; d < 3; d++) o[d] = 0.5 * (s->low[d] + s->high[d]);
  for (PetscInt c = 0; c < s->n; c++) {
    PetscReal a[3][3] = {{0}}, v, sum[3] = {0};

    for (PetscInt k = 0; k < m; k++)
      for (PetscInt d = 0; d < 3; d++) {
        a[k][d] = s->x[3 * s->corner[m * c + k] + d] - o[d];
        sum[d] += a[k][d];
      }
    if (m == 2) v = 0.5 * thickness * (a[0][0] * a[1][1] - a[0][1] * a[1][0]);
    else {
      v = 0;
      for (PetscInt d = 0; d < 3; d++) v += a[0][d] * (a[1][(d + 1) % 3] * a[2][(d + 2) % 3] - a[1][(d + 2) % 3] * a[2][(d + 1) % 3]) / 6;
    }
    /* a simplex with one corner at o: int x = v sum/(m + 1), int x x^T = v (sum sum^T + sum_k a_k a_k^T)/((m + 1)(m + 2)) */
    V += v;
    for (PetscInt i = 0; i < 3; i++) {
      first[i] += v * sum[i] / (m + 1);
      for (PetscInt j = 0; j < 3; j++) {
        PetscReal q = sum[i] * sum[j];

        for (PetscInt k = 0; k < m; k++) q += a[k][i] * a[k][j];
        second[i][j] += v * q / ((m + 1) * (m + 2));
      }
    }
  }
  BaseCheckInput(V > 0, PETSC_COMM_SELF, "The surface encloses a volume of %.6g m3; it must be positive", (double)V);
  *volume = V;
  for (PetscInt i = 0; i < 3; i++) centre[i] = o[i] + first[i] / V;
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) second[i][j] -= first[i] * first[j] / V;
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) inertia[i][j] = (i == j ? second[0][0] + second[1][1] + second[2][2] : 0) - second[i][j];
  PetscFunctionReturn(PETSC_SUCCESS);
}
