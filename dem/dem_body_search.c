/*
  dem_body_search.c - a grid over the body for pieces and boundary simplices.

  A sphere inside the body can touch flat parts of the boundary and re-entrant edges and corners, never a convex or
  flat edge. Which edges and corners are re-entrant is found once, from the simplices that share them.
*/
#include "dem_body_impl.h"
#include <stdlib.h>

#define MAX_CELLS 4000000

/* ---- re-entrant edges and corners ---- */

typedef struct {
  PetscInt key[2], simplex, local;
} Ridge;

static int CompareRidges(const void *a, const void *b)
{
  const Ridge *r = a, *s = b;

  for (int k = 0; k < 2; k++)
    if (r->key[k] != s->key[k]) return r->key[k] < s->key[k] ? -1 : 1;
  return (r->simplex > s->simplex) - (r->simplex < s->simplex);
}

void DemBodyNormal(PetscInt dim, const PetscReal *s, PetscReal n[3])
{
  PetscReal len;

  if (dim == 2) {
    n[0] = s[4] - s[1];
    n[1] = s[0] - s[3];
    n[2] = 0;
  } else {
    const PetscReal u[3] = {s[3] - s[0], s[4] - s[1], s[5] - s[2]}, v[3] = {s[6] - s[0], s[7] - s[1], s[8] - s[2]};

    n[0] = u[1] * v[2] - u[2] * v[1];
    n[1] = u[2] * v[0] - u[0] * v[2];
    n[2] = u[0] * v[1] - u[1] * v[0];
  }
  len = PetscSqrtReal(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  for (PetscInt c = 0; c < 3; c++) n[c] /= len;
}

/* +1 when simplex t rises outside the plane of s (a re-entrant ridge), -1 when it falls inside, 0 when flat. */
static PetscInt RidgeSign(const DemBody *body, const Ridge *s, const Ridge *t)
{
  const PetscInt   dim = body->dim;
  const PetscReal *a = &body->simplex[3 * dim * s->simplex], *b = &body->simplex[3 * dim * t->simplex];
  const PetscReal *on = &a[3 * s->local], *far = &b[3 * ((t->local + dim - 1) % dim)];
  PetscReal        n[3], rise = 0, len = 0;

  DemBodyNormal(dim, a, n);
  for (PetscInt c = 0; c < 3; c++) {
    rise += n[c] * (far[c] - on[c]);
    len += PetscSqr(far[c] - on[c]);
  }
  return rise > 1e-7 * PetscSqrtReal(len) ? 1 : (rise < -1e-7 * PetscSqrtReal(len) ? -1 : 0);
}

static PetscErrorCode FindBends(const DemBody *body, unsigned char **bend)
{
  const PetscInt dim = body->dim, n = dim * body->n_simplices;
  Ridge         *ridge;
  PetscInt       top = 0;
  signed char   *corner; /* by node: 1 an incident edge is re-entrant, -1 one is convex */

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n, bend));
  PetscCall(PetscMalloc1(n, &ridge));
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt s = k / dim, local = k % dim, a = body->simplex_node[k], b = dim == 2 ? a : body->simplex_node[dim * s + (local + 1) % dim];

    ridge[k].key[0] = PetscMin(a, b);
    ridge[k].key[1] = PetscMax(a, b);
    ridge[k].simplex = s;
    ridge[k].local = local;
    top = PetscMax(top, ridge[k].key[1]);
  }
  qsort(ridge, n, sizeof(*ridge), CompareRidges);
  PetscCall(PetscCalloc1(top + 1, &corner));
  for (PetscInt k = 0, m; k < n; k += m) {
    PetscInt sign = 1;

    for (m = 1; k + m < n && ridge[k + m].key[0] == ridge[k].key[0] && ridge[k + m].key[1] == ridge[k].key[1]; m++) {
    }
    if (m == 2) sign = RidgeSign(body, &ridge[k], &ridge[k + 1]); /* shared by more: taken as re-entrant, filtered later */
    for (PetscInt j = 0; j < m && sign > 0; j++) (*bend)[dim * ridge[k + j].simplex + ridge[k + j].local] |= dim == 2 ? 1 : 2;
    for (PetscInt e = 0; e < 2 && sign; e++) {
      signed char *c = &corner[ridge[k].key[e]];

      if (sign < 0 || *c == 0) *c = (signed char)sign;
    }
  }
  for (PetscInt k = 0; dim == 3 && k < n; k++)
    if (corner[body->simplex_node[k]] > 0) (*bend)[k] |= 1;
  PetscCall(PetscFree(corner));
  PetscCall(PetscFree(ridge));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- nearest point of a simplex ---- */

static PetscReal Dot(const PetscReal a[3], const PetscReal b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Nearest point q of segment a b; returns where: 0 inside, 1 at a, 2 at b. */
static PetscInt NearestOnSegment(const PetscReal *a, const PetscReal *b, const PetscReal x[3], PetscReal q[3])
{
  const PetscReal ab[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, ax[3] = {x[0] - a[0], x[1] - a[1], x[2] - a[2]};
  const PetscReal t = PetscMin(1, PetscMax(0, Dot(ab, ax) / Dot(ab, ab)));

  for (PetscInt c = 0; c < 3; c++) q[c] = t >= 1 ? b[c] : a[c] + t * ab[c];
  return t <= 0 ? 1 : (t >= 1 ? 2 : 0);
}

/* Nearest point q of a simplex. Returns -1 in its inside, 0..2 at corner k, 3..5 on edge k, k + 1. */
static PetscInt NearestOnSimplex(PetscInt dim, const PetscReal *s, const PetscReal x[3], PetscReal q[3])
{
  PetscReal n[3], best = PETSC_MAX_REAL;
  PetscInt  where = -1, inside = 1;

  if (dim == 2) {
    where = NearestOnSegment(s, s + 3, x, q);
    return where - 1;
  }
  DemBodyNormal(3, s, n);
  for (PetscInt k = 0; k < 3; k++) {
    const PetscReal *a = &s[3 * k], *b = &s[3 * ((k + 1) % 3)], ab[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]},
                    ax[3] = {x[0] - a[0], x[1] - a[1], x[2] - a[2]};

    inside &= (ab[1] * ax[2] - ab[2] * ax[1]) * n[0] + (ab[2] * ax[0] - ab[0] * ax[2]) * n[1] + (ab[0] * ax[1] - ab[1] * ax[0]) * n[2] >= 0;
  }
  if (inside) {
    const PetscReal ax[3] = {x[0] - s[0], x[1] - s[1], x[2] - s[2]}, h = Dot(ax, n);

    for (PetscInt c = 0; c < 3; c++) q[c] = x[c] - h * n[c];
    return -1;
  }
  for (PetscInt k = 0; k < 3; k++) {
    PetscReal       p[3];
    const PetscInt  at = NearestOnSegment(&s[3 * k], &s[3 * ((k + 1) % 3)], x, p);
    const PetscReal d = PetscSqr(p[0] - x[0]) + PetscSqr(p[1] - x[1]) + PetscSqr(p[2] - x[2]);

    if (d < best) {
      best = d;
      where = at == 0 ? 3 + k : (k + at - 1) % 3;
      for (PetscInt c = 0; c < 3; c++) q[c] = p[c];
    }
  }
  return where;
}

/* ---- the grid ---- */

static void CellRange(const DemBodySearch *g, const PetscReal low[3], const PetscReal high[3], PetscInt lo[3], PetscInt hi[3])
{
  for (PetscInt c = 0; c < 3; c++) {
    lo[c] = (PetscInt)PetscMax(0, PetscMin(g->m[c] - 1, PetscFloorReal((low[c] - g->low[c]) / g->width)));
    hi[c] = (PetscInt)PetscMax(0, PetscMin(g->m[c] - 1, PetscFloorReal((high[c] - g->low[c]) / g->width)));
  }
}

/* Put items into every cell of their box (walls: only cells that come within reach). Two passes: count, fill. */
static PetscErrorCode FillGrid(const DemBodySearch *g, PetscBool walls, PetscInt **start, PetscInt **item)
{
  const DemBody  *body = g->body;
  const PetscInt  dim = body->dim, cells = g->m[0] * g->m[1] * g->m[2], n = walls ? body->n_simplices : body->n_pieces;
  const PetscReal half = 0.5 * g->width * PetscSqrtReal((PetscReal)dim);

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(cells + 2, start));
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt k = 0; k < n; k++) {
      PetscReal box[6];
      PetscInt  lo[3], hi[3];

      for (PetscInt c = 0; c < 3; c++) {
        if (walls) {
          box[c] = PETSC_MAX_REAL;
          box[3 + c] = -PETSC_MAX_REAL;
          for (PetscInt a = 0; a < dim; a++) {
            box[c] = PetscMin(box[c], body->simplex[3 * (dim * k + a) + c] - g->reach);
            box[3 + c] = PetscMax(box[3 + c], body->simplex[3 * (dim * k + a) + c] + g->reach);
          }
        } else {
          box[c] = body->box[6 * k + c] - 1e-9 * g->width;
          box[3 + c] = body->box[6 * k + 3 + c] + 1e-9 * g->width;
        }
      }
      CellRange(g, box, box + 3, lo, hi);
      for (PetscInt z = lo[2]; z <= hi[2]; z++)
        for (PetscInt y = lo[1]; y <= hi[1]; y++)
          for (PetscInt x = lo[0]; x <= hi[0]; x++) {
            const PetscInt cell = (z * g->m[1] + y) * g->m[0] + x;

            if (walls) {
              const PetscReal mid[3] = {g->low[0] + (x + 0.5) * g->width, g->low[1] + (y + 0.5) * g->width, dim == 2 ? 0 : g->low[2] + (z + 0.5) * g->width};
              PetscReal       q[3];

              NearestOnSimplex(dim, &body->simplex[3 * dim * k], mid, q);
              if (PetscSqr(q[0] - mid[0]) + PetscSqr(q[1] - mid[1]) + PetscSqr(q[2] - mid[2]) > PetscSqr(g->reach + half)) continue;
            }
            if (pass == 0)
              (*start)[cell + 2]++;
            else
              (*item)[(*start)[cell + 1]++] = k;
          }
    }
    if (pass == 0) {
      for (PetscInt c = 0; c < cells; c++) (*start)[c + 2] += (*start)[c + 1];
      PetscCall(PetscMalloc1((*start)[cells + 1] + 1, item));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemBodySearchCreate(const DemBody *body, PetscReal reach, PetscReal width, DemBodySearch *search)
{
  PetscFunctionBegin;
  PetscCall(PetscMemzero(search, sizeof(*search)));
  search->body = body;
  search->reach = reach;
  search->width = width;
  for (PetscReal cells = MAX_CELLS + 1.; cells > MAX_CELLS;) {
    cells = 1;
    for (PetscInt c = 0; c < 3; c++) {
      const PetscReal m = PetscCeilReal((body->high[c] - body->low[c]) / search->width + 1e-9);

      search->low[c] = body->low[c];
      cells *= PetscMax(1, m);
      if (cells <= MAX_CELLS) search->m[c] = (PetscInt)PetscMax(1, m);
    }
    if (cells > MAX_CELLS) search->width *= 1.25;
  }
  if (body->n_pieces > 1) PetscCall(FillGrid(search, PETSC_FALSE, &search->piece_start, &search->piece));
  if (reach > 0) {
    PetscCall(FindBends(body, &search->bend));
    PetscCall(PetscMalloc1(4 * body->n_simplices, &search->out));
    for (PetscInt k = 0; k < body->n_simplices; k++) {
      const PetscReal *s = &body->simplex[3 * body->dim * k];

      DemBodyNormal(body->dim, s, &search->out[4 * k]);
      search->out[4 * k + 3] = Dot(&search->out[4 * k], s);
    }
    PetscCall(FillGrid(search, PETSC_TRUE, &search->wall_start, &search->wall));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemBodySearchDestroy(DemBodySearch *search)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(search->piece_start));
  PetscCall(PetscFree(search->piece));
  PetscCall(PetscFree(search->wall_start));
  PetscCall(PetscFree(search->wall));
  PetscCall(PetscFree(search->bend));
  PetscCall(PetscFree(search->out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt CellOf(const DemBodySearch *g, const PetscReal x[3])
{
  PetscInt lo[3], hi[3];

  CellRange(g, x, x, lo, hi);
  return (lo[2] * g->m[1] + lo[1]) * g->m[0] + lo[0];
}

static PetscBool InsidePiece(const DemBody *body, PetscInt piece, const PetscReal x[3], PetscReal slack)
{
  for (PetscInt k = body->start[piece]; k < body->start[piece + 1]; k++)
    if (Dot(&body->plane[4 * k], x) > body->plane[4 * k + 3] + slack) return PETSC_FALSE;
  return PETSC_TRUE;
}

PetscBool DemBodySearchInside(const DemBodySearch *search, const PetscReal x[3])
{
  const PetscReal slack = 1e-10 * search->width;

  for (PetscInt c = 0; c < search->body->dim; c++)
    if (!(x[c] >= search->body->low[c] - slack && x[c] <= search->body->high[c] + slack)) return PETSC_FALSE;
  if (!search->piece_start) return InsidePiece(search->body, 0, x, slack);
  {
    const PetscInt cell = CellOf(search, x);

    for (PetscInt k = search->piece_start[cell]; k < search->piece_start[cell + 1]; k++)
      if (InsidePiece(search->body, search->piece[k], x, slack)) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

PetscBool DemBodySearchClear(const DemBodySearch *search, const PetscReal x[3], PetscReal radius)
{
  const PetscInt dim = search->body->dim, cell = CellOf(search, x);

  if (radius > search->reach) return PETSC_FALSE;
  for (PetscInt k = search->wall_start[cell]; k < search->wall_start[cell + 1]; k++) {
    const PetscInt   s = search->wall[k];
    const PetscReal *out = &search->out[4 * s];
    PetscReal        q[3];

    if (PetscAbsReal(out[3] - Dot(out, x)) >= radius) continue;
    NearestOnSimplex(dim, &search->body->simplex[3 * dim * s], x, q);
    if (PetscSqr(q[0] - x[0]) + PetscSqr(q[1] - x[1]) + PetscSqr(q[2] - x[2]) < radius * radius) return PETSC_FALSE;
  }
  return DemBodySearchInside(search, x);
}

PetscInt DemBodySearchWalls(const DemBodySearch *search, const PetscReal x[3], PetscReal reach, DemWall wall[DEM_MAX_WALLS])
{
  const DemBody *body = search->body;
  const PetscInt dim = body->dim, cell = CellOf(search, x);
  PetscReal      foot[DEM_MAX_WALLS][3];
  PetscInt       n = 0, kept = 0;

  for (PetscInt k = search->wall_start[cell]; k < search->wall_start[cell + 1]; k++) {
    const PetscInt   s = search->wall[k];
    const PetscReal *tri = &body->simplex[3 * dim * s];
    const PetscReal *out = &search->out[4 * s];
    const PetscReal  rise = out[3] - Dot(out, x);
    PetscReal        q[3], d, height, inward[3];
    PetscInt         where, at;
    PetscBool flat, twin = PETSC_FALSE, bent = search->bend[dim * s] | search->bend[dim * s + 1] | search->bend[dim * s + dim - 1] ? PETSC_TRUE : PETSC_FALSE;

    if (rise >= reach || rise <= (bent ? -reach : 0)) continue; /* most of them */
    where = NearestOnSimplex(dim, tri, x, q);
    for (PetscInt c = 0; c < 3; c++) inward[c] = x[c] - q[c];
    d = PetscSqrtReal(Dot(inward, inward));
    if (!(d > 0 && d < reach)) continue;
    height = -Dot(out, inward);
    flat = height > (1 - 1e-9) * d ? PETSC_TRUE : PETSC_FALSE;
    if (!flat) {
      if (where < 0) continue; /* behind the face: another part of a thin body, or across a notch */
      if (!(where < 3 ? search->bend[dim * s + where] & 1 : search->bend[dim * s + where - 3] & 2)) continue;
    }
    for (PetscInt j = 0; j < n && !twin; j++)
      twin = PetscSqr(foot[j][0] - q[0]) + PetscSqr(foot[j][1] - q[1]) + PetscSqr(foot[j][2] - q[2]) < 1e-14 * reach * reach ? PETSC_TRUE : PETSC_FALSE;
    if (twin) continue;
    for (at = n; at > 0 && wall[at - 1].distance > d; at--) {
    }
    if (at == DEM_MAX_WALLS) continue;
    if (n == DEM_MAX_WALLS) n--;
    for (PetscInt j = n; j > at; j--) {
      wall[j] = wall[j - 1];
      for (PetscInt c = 0; c < 3; c++) foot[j][c] = foot[j - 1][c];
    }
    n++;
    wall[at].distance = flat ? height : d;
    wall[at].simplex = s;
    wall[at].flat = flat;
    for (PetscInt c = 0; c < 3; c++) {
      wall[at].inward[c] = flat ? -out[c] : inward[c] / d;
      foot[at][c] = q[c];
    }
  }
  /* A touch on an edge counts only where no flat part that holds the same foot is nearer. */
  for (PetscInt j = 0; j < n; j++) {
    PetscBool real = PETSC_TRUE;

    for (PetscInt i = 0; i < j && !wall[j].flat && real; i++) {
      PetscReal q[3];

      NearestOnSimplex(dim, &body->simplex[3 * dim * wall[i].simplex], foot[j], q);
      if (PetscSqr(foot[j][0] - q[0]) + PetscSqr(foot[j][1] - q[1]) + PetscSqr(foot[j][2] - q[2]) < 1e-14 * reach * reach) real = PETSC_FALSE;
    }
    if (real) wall[kept++] = wall[j];
  }
  return kept;
}

PetscErrorCode DemBodyInside(const DemBody *body, PetscInt n, const PetscReal x[], PetscBool inside[])
{
  DemBodySearch search;
  PetscReal     width = 0;

  PetscFunctionBegin;
  for (PetscInt d = 0; d < body->dim; d++) width = PetscMax(width, body->high[d] - body->low[d]);
  PetscCall(DemBodySearchCreate(body, 0, width / PetscMax(1, PetscPowReal((PetscReal)body->n_pieces, 1.0 / body->dim)), &search)); /* about a piece to a cell */
  for (PetscInt p = 0; p < n; p++) inside[p] = DemBodySearchInside(&search, x + 3 * p);
  PetscCall(DemBodySearchDestroy(&search));
  PetscFunctionReturn(PETSC_SUCCESS);
}
