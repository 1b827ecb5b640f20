/*
  dem_cells.c - the power diagram clipped by the body, one cell at a time.

  A cell starts as a cube around its particle, is cut by the bisectors of ever farther neighbours until none can reach
  it, and then by every convex piece of the body that it meets; the parts are summed. A cube whose own face survives
  inside the body was too small and is doubled. Each cell is computed by itself in coordinates of its cube, so threads
  share nothing and the order of work cannot show.  Eqs (3.1)-(3.3), docs/theory.md
*/
#include "dem_body_impl.h"
#include "dem_cells_impl.h"
#include "dem_clip.h"
#include <omp.h>
#include <stdlib.h>
#include <string.h>

#define PLANE_ID(k) (-10 - (k)) /* facet ids: >= 0 a neighbour, -1 .. -6 the cube, <= -10 plane k of the body */

/* Particles sorted into a grid. */
typedef struct {
  PetscReal low[3], width, r_max;
  PetscInt  m[3];
  PetscInt *start, *item;
} ParticleGrid;

/* One facet piece of the cell in hand; corners at corner[3 * at ..]. */
typedef struct {
  PetscInt  q, at, n; /* q >= 0: neighbour; else -1 - face of the body */
  PetscReal area, x[3], normal[3];
} Piece;

typedef struct {
  PetscInt  p, q;
  PetscReal area;
} Mirror; /* what the higher particle thinks of a facet, to compare */

/* The cell in one piece of the body. */
typedef struct {
  PetscInt  piece, root; /* root: lowest part it is joined with */
  PetscReal volume;      /* in cube units */
  PetscReal outside;     /* how far the particle's centre is outside this piece [m] */
} Part;

/* What one thread has made of its run of particles. */
typedef struct {
  PetscInt   n_facets, room_facets, n_walls, room_walls, n_corners, room_corners, n_mirrors, room_mirrors;
  Piece     *facet; /* [n_facets] at: owner p; n: corners */
  Piece     *wall;  /* [n_walls] at: owner */
  PetscReal *corner; /* [n_corners][3] */
  Mirror    *mirror;
} Harvest;

typedef struct {
  PetscReal t;
  PetscInt  q;
} Candidate;

/* A thread's tools. */
typedef struct {
  DemClip    whole, part;
  Candidate *candidate;
  Piece     *piece;
  PetscReal *corner;
  Part      *parts;
  PetscInt  *stamp, *part_of; /* [pieces of the body]: last particle that met it, and as which part */
  PetscInt   room_candidates, n_pieces, room_pieces, n_corners, room_corners, n_parts, room_parts;
  PetscInt   other; /* second particle of a trouble */
  Harvest    out;
} Worker;

typedef struct {
  PetscReal volume, centroid[3], solid;
  PetscBool cube; /* a face of the cube lies in the body */
} Cell;

/* Threads report trouble by code; the caller turns the first particle's into words. */
typedef enum { FINE, NO_MEMORY, SAME_CENTRE, NO_CELL, APART } Trouble;

static Trouble Grow(PetscInt need, size_t size, PetscInt *room, void *array)
{
  void *more;

  if (need <= *room) return FINE;
  need = PetscMax(need, 2 * *room);
  more = realloc(*(void **)array, need * size);
  if (!more) return NO_MEMORY;
  *(void **)array = more;
  *room           = need;
  return FINE;
}

/* ---- neighbours ---- */

static PetscErrorCode ParticleGridCreate(const DemBody *body, const DemPacking *packing, ParticleGrid *g)
{
  PetscInt cells = 1, *cell;

  PetscFunctionBegin;
  g->width = PetscPowReal(DemBodyVolume(body) / body->thickness / packing->n, 1. / body->dim);
  for (PetscInt again = 1; again;) {
    PetscReal total = 1;

    again = 0;
    for (PetscInt c = 0; c < 3; c++) total *= PetscMax(1, PetscCeilReal((body->high[c] - body->low[c]) / g->width));
    if (total > 8. * packing->n + 64) { /* thin bodies in big boxes */
      g->width *= 1.2;
      again = 1;
    }
  }
  for (PetscInt c = 0; c < 3; c++) {
    g->low[c] = body->low[c];
    g->m[c]   = (PetscInt)PetscMax(1, PetscCeilReal((body->high[c] - body->low[c]) / g->width));
    cells *= g->m[c];
  }
  PetscCall(PetscCalloc1(cells + 2, &g->start));
  PetscCall(PetscMalloc1(packing->n, &g->item));
  PetscCall(PetscMalloc1(packing->n, &cell));
  g->r_max = 0;
  for (PetscInt p = 0; p < packing->n; p++) {
    PetscInt at[3];

    for (PetscInt c = 0; c < 3; c++) at[c] = (PetscInt)PetscMax(0, PetscMin(g->m[c] - 1, PetscFloorReal((packing->x[3 * p + c] - g->low[c]) / g->width)));
    cell[p]  = (at[2] * g->m[1] + at[1]) * g->m[0] + at[0];
    g->r_max = PetscMax(g->r_max, packing->r[p]);
    g->start[cell[p] + 2]++;
  }
  for (PetscInt c = 0; c < cells; c++) g->start[c + 2] += g->start[c + 1];
  for (PetscInt p = 0; p < packing->n; p++) g->item[g->start[cell[p] + 1]++] = p;
  PetscCall(PetscFree(cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int CompareCandidates(const void *a, const void *b)
{
  const Candidate *c = a, *d = b;

  return c->t != d->t ? (c->t > d->t) - (c->t < d->t) : (c->q > d->q) - (c->q < d->q);
}

/* Cut the cell of p (cube of half side h) by the bisectors with all others that can reach it.  Eq. (3.1) */
static Trouble CutByNeighbours(const ParticleGrid *g, const DemPacking *packing, PetscInt p, PetscReal h, Worker *w, PetscBool *some)
{
  const PetscReal *x = &packing->x[3 * p], rp2 = packing->r[p] * packing->r[p];
  PetscReal        reach = h * DemClipReach(&w->whole);
  PetscInt         at[3], rings = 0;

  for (PetscInt c = 0; c < 3; c++) {
    at[c] = (PetscInt)PetscMax(0, PetscMin(g->m[c] - 1, PetscFloorReal((x[c] - g->low[c]) / g->width)));
    rings = PetscMax(rings, PetscMax(at[c], g->m[c] - 1 - at[c]));
  }
  for (PetscInt ring = 0; ring <= rings && *some; ring++) {
    PetscReal seen = PETSC_MAX_REAL; /* every particle nearer than this has been met */
    PetscInt  n = 0, lo[3], hi[3];

    for (PetscInt c = 0; c < 3; c++) {
      lo[c] = PetscMax(0, at[c] - ring);
      hi[c] = PetscMin(g->m[c] - 1, at[c] + ring);
      if (at[c] - ring > 0) seen = PetscMin(seen, x[c] - (g->low[c] + lo[c] * g->width));
      if (at[c] + ring < g->m[c] - 1) seen = PetscMin(seen, g->low[c] + (hi[c] + 1) * g->width - x[c]);
    }
    for (PetscInt z = lo[2]; z <= hi[2]; z++)
      for (PetscInt y = lo[1]; y <= hi[1]; y++) {
        const PetscInt shell = PetscAbsInt(z - at[2]) == ring || PetscAbsInt(y - at[1]) == ring;

        for (PetscInt i = lo[0]; i <= hi[0]; i++) {
          PetscInt cell;

          if (!shell && i > at[0] - ring && i < at[0] + ring) {
            i = at[0] + ring - 1; /* the middle of the row is done: on to its far end */
            continue;
          }
          cell = (z * g->m[1] + y) * g->m[0] + i;
          for (PetscInt k = g->start[cell]; k < g->start[cell + 1]; k++) {
            const PetscInt   q = g->item[k];
            const PetscReal *y2 = &packing->x[3 * q];
            const PetscReal  d2 = PetscSqr(y2[0] - x[0]) + PetscSqr(y2[1] - x[1]) + PetscSqr(y2[2] - x[2]);
            PetscReal        t;

            if (q == p) continue;
            if (!(d2 > 0)) {
              w->other = q;
              return SAME_CENTRE;
            }
            t = (d2 + rp2 - packing->r[q] * packing->r[q]) / (2 * PetscSqrtReal(d2)); /* signed distance of the bisector */
            if (t >= reach) continue;
            if (Grow(n + 1, sizeof(Candidate), &w->room_candidates, &w->candidate)) return NO_MEMORY;
            w->candidate[n].t   = t;
            w->candidate[n++].q = q;
          }
        }
      }
    qsort(w->candidate, n, sizeof(Candidate), CompareCandidates);
    for (PetscInt k = 0; k < n && *some; k++) {
      const PetscReal *y = &packing->x[3 * w->candidate[k].q];
      PetscReal        normal[3], d;

      if (w->candidate[k].t >= reach) break;
      for (PetscInt c = 0; c < 3; c++) normal[c] = y[c] - x[c];
      d = PetscSqrtReal(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
      for (PetscInt c = 0; c < 3; c++) normal[c] /= d;
      if (DemClipCut(&w->whole, normal, w->candidate[k].t / h, w->candidate[k].q, some)) return NO_MEMORY;
      if (*some && k % 8 == 7) reach = h * DemClipReach(&w->whole);
    }
    if (!*some) break;
    reach = h * DemClipReach(&w->whole);
    if (seen >= PETSC_MAX_REAL || (seen > 0 && (seen * seen + rp2 - g->r_max * g->r_max) / (2 * seen) >= reach)) break;
  }
  return FINE;
}

/* ---- the body ---- */

/* The planes of a piece seen from x in cube units. False when one of them has all corners of the cell outside; else
   cut [n_cut] are those that cut some corner off. */
static PetscBool MeetsPiece(const DemBody *body, PetscInt piece, const PetscReal x[3], PetscReal h, PetscInt n_corners, const double *corner, PetscInt *n_cut, PetscInt *cut)
{
  *n_cut = 0;
  for (PetscInt k = body->start[piece]; k < body->start[piece + 1]; k++) {
    const PetscReal *n      = &body->plane[4 * k];
    const PetscReal  offset = (n[3] - (n[0] * x[0] + n[1] * x[1] + n[2] * x[2])) / h;
    PetscInt         out    = 0;

    for (PetscInt c = 0; c < n_corners; c++) out += n[0] * corner[3 * c] + n[1] * corner[3 * c + 1] + n[2] * corner[3 * c + 2] >= offset;
    if (out == n_corners) return PETSC_FALSE;
    if (out) cut[(*n_cut)++] = k;
  }
  return PETSC_TRUE;
}

/* Cut by n planes of the body; plane NULL: all n of the only piece. */
static Trouble CutByPlanes(const DemBody *body, PetscInt n, const PetscInt *plane, const PetscReal x[3], PetscReal h, DemClip *clip, PetscBool *some)
{
  const PetscReal reach = DemClipReach(clip);

  for (PetscInt j = 0; j < n && *some; j++) {
    const PetscInt   k      = plane ? plane[j] : j;
    const PetscReal *m      = &body->plane[4 * k];
    const PetscReal  offset = (m[3] - (m[0] * x[0] + m[1] * x[1] + m[2] * x[2])) / h;

    if (offset < reach && DemClipCut(clip, m, offset, PLANE_ID(k), some)) return NO_MEMORY;
  }
  return FINE;
}

/* Sum the facets of one part into the cell: volume, centroid, sphere, facet pieces; note what faces the part meets. */
static Trouble ReadPart(const DemBody *body, const DemPacking *packing, PetscInt p, PetscReal h, PetscInt part, DemClip *clip, Worker *w, Cell *cell)
{
  const PetscInt   dim = body->dim;
  const PetscReal *x = &packing->x[3 * p], scale_area = dim == 2 ? h * body->thickness : h * h;
  const int       *id, *start;
  const double    *corner;
  const PetscInt   n      = DemClipFacets(clip, &id, &start, &corner);
  PetscReal        volume = 0, moment[3] = {0, 0, 0}, solid = 0;
  PetscInt         kept = w->n_pieces;

  for (PetscInt f = 0; f < n; f++) {
    const double *v = &corner[3 * start[f]];
    const int     m = start[f + 1] - start[f];
    PetscReal     normal[3] = {0, 0, 0}, area = 0, mid[3] = {0, 0, 0}, height;

    if (id[f] >= 0) {
      PetscReal d = 0;

      for (PetscInt c = 0; c < 3; c++) {
        normal[c] = packing->x[3 * id[f] + c] - x[c];
        d += normal[c] * normal[c];
      }
      d = PetscSqrtReal(d);
      for (PetscInt c = 0; c < 3; c++) normal[c] /= d;
    } else if (id[f] <= PLANE_ID(0)) {
      for (PetscInt c = 0; c < 3; c++) normal[c] = body->plane[4 * (-10 - id[f]) + c];
    } else {
      normal[(-1 - id[f]) / 2] = (-1 - id[f]) % 2 ? 1 : -1;
    }
    if (dim == 2) {
      area = PetscAbsReal(normal[0] * (v[4] - v[1]) - normal[1] * (v[3] - v[0]));
      for (PetscInt c = 0; c < 2; c++) mid[c] = 0.5 * (v[c] + v[3 + c]);
    } else {
      for (int k = 1; k + 1 < m; k++) {
        const double *a = &v[3 * k], *b = &v[3 * (k + 1)];
        const double  e[3] = {a[0] - v[0], a[1] - v[1], a[2] - v[2]}, g[3] = {b[0] - v[0], b[1] - v[1], b[2] - v[2]};
        const double  tri = 0.5 * (normal[0] * (e[1] * g[2] - e[2] * g[1]) + normal[1] * (e[2] * g[0] - e[0] * g[2]) + normal[2] * (e[0] * g[1] - e[1] * g[0]));

        area += tri;
        for (PetscInt c = 0; c < 3; c++) mid[c] += tri * (e[c] + g[c]) / 3; /* from v, so that small facets keep their digits */
      }
      for (PetscInt c = 0; c < 3; c++) mid[c] = v[c] + (area != 0 ? mid[c] / area : 0);
      area = PetscAbsReal(area);
    }
    if (!(area > 0)) continue;
    height = normal[0] * mid[0] + normal[1] * mid[1] + normal[2] * mid[2];
    volume += area * height / dim;
    for (PetscInt c = 0; c < 3; c++) moment[c] += area * height / (dim + 1) * mid[c];
    solid += dim == 2 ? DemDiscInTriangle(v, normal, height, packing->r[p] / h) : DemBallInCone(m, v, normal, height, packing->r[p] / h);
    if (id[f] < 0 && id[f] > PLANE_ID(0)) {
      cell->cube = PETSC_TRUE;
    } else if (id[f] >= 0 || body->face[-10 - id[f]] >= 0) {
      Piece *piece;

      if (Grow(w->n_pieces + 1, sizeof(Piece), &w->room_pieces, &w->piece)) return NO_MEMORY;
      if (Grow(3 * (w->n_corners + m), sizeof(PetscReal), &w->room_corners, &w->corner)) return NO_MEMORY;
      piece       = &w->piece[w->n_pieces++];
      piece->q    = id[f] >= 0 ? id[f] : -1 - body->face[-10 - id[f]];
      piece->area = area * scale_area;
      piece->at   = w->n_corners;
      piece->n    = m;
      for (PetscInt c = 0; c < 3; c++) {
        piece->normal[c] = normal[c];
        piece->x[c]      = x[c] + h * mid[c];
      }
      for (int k = 0; k < m; k++, w->n_corners++)
        for (PetscInt c = 0; c < 3; c++) w->corner[3 * w->n_corners + c] = x[c] + h * v[3 * k + c];
    } else if (area > 1e-12) { /* open towards the next piece: join the two parts */
      const PetscInt next = body->beyond[-10 - id[f]];

      if (next >= 0 && w->stamp[next] == p) {
        PetscInt a = part, b = w->part_of[next];

        while (w->parts[a].root != a) a = w->parts[a].root;
        while (w->parts[b].root != b) b = w->parts[b].root;
        w->parts[PetscMax(a, b)].root = PetscMin(a, b);
      }
    }
  }
  if (!(volume > 1e-15)) { /* the cell only touches this piece */
    w->n_pieces = kept;
    return FINE;
  }
  w->parts[part].volume = volume;
  cell->volume += volume * scale_area * h;
  cell->solid += solid * scale_area * h;
  for (PetscInt c = 0; c < 3; c++) cell->centroid[c] += moment[c] * scale_area * h * h;
  return FINE;
}

static Trouble CutByBody(const DemBodySearch *search, const DemPacking *packing, PetscInt p, PetscReal h, Worker *w, Cell *cell)
{
  const DemBody   *body = search->body;
  const PetscReal *x = &packing->x[3 * p], reach = DemClipReach(&w->whole);
  const double    *corner;
  const PetscInt   n_corners = DemClipCorners(&w->whole, &corner);
  PetscInt         lo[3], hi[3], mine = -1, n_cut, cut[4]; /* a piece among several has at most 4 planes */

  for (PetscInt c = 0; c < 3; c++) {
    lo[c] = (PetscInt)PetscMax(0, PetscMin(search->m[c] - 1, PetscFloorReal((x[c] - h * reach - search->low[c]) / search->width)));
    hi[c] = (PetscInt)PetscMax(0, PetscMin(search->m[c] - 1, PetscFloorReal((x[c] + h * reach - search->low[c]) / search->width)));
  }
  for (PetscInt l = lo[2]; l <= hi[2]; l++)
    for (PetscInt j = lo[1]; j <= hi[1]; j++)
      for (PetscInt i = lo[0]; i <= hi[0]; i++) {
        const PetscInt bin = (l * search->m[1] + j) * search->m[0] + i;

        for (PetscInt k = search->piece_start[bin]; k < search->piece_start[bin + 1]; k++) {
          const PetscInt   piece = search->piece[k], part = w->n_parts;
          const PetscReal *box   = &body->box[6 * piece];
          PetscBool        some  = PETSC_TRUE;
          PetscReal        gap   = 0;

          if (w->stamp[piece] == p) continue;
          for (PetscInt c = 0; c < 3; c++) gap = PetscMax(gap, PetscMax(box[c] - x[c], x[c] - box[3 + c]));
          if (gap > h * reach) continue;
          if (!MeetsPiece(body, piece, x, h, n_corners, corner, &n_cut, cut)) continue;
          if (DemClipCopy(&w->part, &w->whole)) return NO_MEMORY;
          if (CutByPlanes(body, n_cut, cut, x, h, &w->part, &some)) return NO_MEMORY;
          if (!some) continue;
          if (Grow(part + 1, sizeof(Part), &w->room_parts, &w->parts)) return NO_MEMORY;
          w->n_parts++;
          w->stamp[piece]        = p;
          w->part_of[piece]      = part;
          w->parts[part].piece   = piece;
          w->parts[part].root    = part;
          w->parts[part].volume  = 0;
          w->parts[part].outside = 0;
          for (PetscInt f = body->start[piece]; f < body->start[piece + 1]; f++) {
            const PetscReal *n = &body->plane[4 * f];

            w->parts[part].outside = PetscMax(w->parts[part].outside, n[0] * x[0] + n[1] * x[1] + n[2] * x[2] - n[3]);
          }
          if (ReadPart(body, packing, p, h, part, &w->part, w, cell)) return NO_MEMORY;
        }
      }
  /* A part that is not joined through the body to the particle's own belongs to the far side of a notch. */
  for (PetscInt k = 0; k < w->n_parts; k++)
    if (w->parts[k].volume > 0 && (mine < 0 || w->parts[k].outside < w->parts[mine].outside)) mine = k;
  while (mine >= 0 && w->parts[mine].root != mine) mine = w->parts[mine].root;
  for (PetscInt k = 0; k < w->n_parts; k++) {
    PetscInt root = k;

    while (w->parts[root].root != root) root = w->parts[root].root;
    if (root != mine && w->parts[k].volume > 1e-9) return APART;
  }
  return FINE;
}

/* The cell of p within the body, from a cube of half side h that grows while it is too small. */
static Trouble MakeCell(const DemBodySearch *search, const ParticleGrid *grid, const DemPacking *packing, PetscInt p, PetscReal h, PetscReal h_max, Worker *w, Cell *cell)
{
  const DemBody   *body = search->body;
  const PetscReal *x    = &packing->x[3 * p];

  for (;; h *= 2) {
    PetscBool some = PETSC_TRUE;
    Trouble   trouble;

    memset(cell, 0, sizeof(*cell));
    w->n_pieces = w->n_corners = w->n_parts = 0;
    DemClipBox(&w->whole);
    if (body->n_pieces == 1 && CutByPlanes(body, body->start[1], NULL, x, h, &w->whole, &some)) return NO_MEMORY;
    if (some && (trouble = CutByNeighbours(grid, packing, p, h, w, &some))) return trouble;
    if (!some) return NO_CELL;
    if (body->n_pieces == 1) {
      if (Grow(1, sizeof(Part), &w->room_parts, &w->parts)) return NO_MEMORY;
      if (ReadPart(body, packing, p, h, 0, &w->whole, w, cell)) return NO_MEMORY;
    } else {
      trouble = CutByBody(search, packing, p, h, w, cell);
      for (PetscInt k = 0; k < w->n_parts; k++) w->stamp[w->parts[k].piece] = -1;
      if (trouble && !(trouble == APART && cell->cube && h < h_max)) return trouble; /* a larger cube may join the parts */
    }
    if (!cell->cube || h >= h_max) break;
  }
  if (!(cell->volume > 0)) return NO_CELL;
  for (PetscInt c = 0; c < 3; c++) cell->centroid[c] = x[c] + cell->centroid[c] / cell->volume;
  return FINE;
}

/* ---- from pieces to facets ---- */

static int ComparePieces(const void *a, const void *b)
{
  const Piece *f = a, *g = b;

  return f->q != g->q ? (f->q > g->q) - (f->q < g->q) : (f->at > g->at) - (f->at < g->at);
}

/* Take in another piece of the same flat facet: area and centroid. */
static void JoinPiece(Piece *to, const Piece *from)
{
  const PetscReal area = to->area + from->area;

  for (PetscInt c = 0; c < 3; c++) to->x[c] += from->area / area * (from->x[c] - to->x[c]);
  to->area = area;
}

/* Copy the corners of pieces first .. last: one polygon as it is, several each closed by its first corner; 2D: the far ends. */
static Trouble HarvestCorners(PetscInt dim, const Worker *w, const Piece *first, const Piece *last, Harvest *out, PetscInt *n)
{
  const PetscInt begin = out->n_corners, closed = dim == 3 && last > first;

  for (const Piece *piece = first; piece <= last; piece++) {
    if (Grow(3 * (out->n_corners + piece->n + 1), sizeof(PetscReal), &out->room_corners, &out->corner)) return NO_MEMORY;
    memcpy(&out->corner[3 * out->n_corners], &w->corner[3 * piece->at], 3 * piece->n * sizeof(PetscReal));
    out->n_corners += piece->n;
    if (closed) memcpy(&out->corner[3 * out->n_corners++], &w->corner[3 * piece->at], 3 * sizeof(PetscReal));
  }
  if (dim == 2 && last > first) {
    PetscReal *end[2] = {&out->corner[3 * begin], &out->corner[3 * begin]}, axis[2] = {-first->normal[1], first->normal[0]}, ends[6];

    for (PetscInt k = begin; k < out->n_corners; k++) {
      PetscReal *x = &out->corner[3 * k];

      if (axis[0] * (x[0] - end[0][0]) + axis[1] * (x[1] - end[0][1]) < 0) end[0] = x;
      if (axis[0] * (x[0] - end[1][0]) + axis[1] * (x[1] - end[1][1]) > 0) end[1] = x;
    }
    for (PetscInt c = 0; c < 6; c++) ends[c] = end[c / 3][c % 3];
    memcpy(&out->corner[3 * begin], ends, sizeof(ends));
    out->n_corners = begin + 2;
  }
  *n = out->n_corners - begin;
  return FINE;
}

static Trouble HarvestCell(PetscInt dim, PetscInt p, Worker *w)
{
  Harvest *out = &w->out;

  qsort(w->piece, w->n_pieces, sizeof(Piece), ComparePieces);
  for (PetscInt k = 0, m; k < w->n_pieces; k += m) {
    Piece joined = w->piece[k];

    for (m = 1; k + m < w->n_pieces && w->piece[k + m].q == joined.q; m++) { }
    if (joined.q >= 0) {
      for (PetscInt j = 1; j < m; j++) JoinPiece(&joined, &w->piece[k + j]);
      if (joined.q < p) {
        if (Grow(out->n_mirrors + 1, sizeof(Mirror), &out->room_mirrors, &out->mirror)) return NO_MEMORY;
        out->mirror[out->n_mirrors++] = (Mirror){.p = joined.q, .q = p, .area = joined.area};
      } else {
        if (HarvestCorners(dim, w, &w->piece[k], &w->piece[k + m - 1], out, &joined.n)) return NO_MEMORY;
        if (Grow(out->n_facets + 1, sizeof(Piece), &out->room_facets, &out->facet)) return NO_MEMORY;
        joined.at                   = p;
        out->facet[out->n_facets++] = joined;
      }
    } else { /* one wall per face and plane */
      const PetscInt first = out->n_walls;

      for (PetscInt j = k; j < k + m; j++) {
        PetscInt same;

        for (same = first; same < out->n_walls; same++) {
          const Piece *a = &out->wall[same], *b = &w->piece[j];
          PetscReal    turn = 0, step = 0;

          for (PetscInt c = 0; c < 3; c++) {
            turn += PetscSqr(a->normal[c] - b->normal[c]);
            step += a->normal[c] * (a->x[c] - b->x[c]);
          }
          if (turn < 1e-18 && PetscAbsReal(step) < 1e-9 * PetscSqrtReal(a->area + b->area)) break;
        }
        if (same < out->n_walls) {
          JoinPiece(&out->wall[same], &w->piece[j]);
        } else {
          if (Grow(out->n_walls + 1, sizeof(Piece), &out->room_walls, &out->wall)) return NO_MEMORY;
          out->wall[out->n_walls]    = w->piece[j];
          out->wall[out->n_walls].at = p;
          out->n_walls++;
        }
      }
    }
  }
  return FINE;
}

/* ---- all cells ---- */

static void WorkerFree(Worker *w)
{
  DemClipDestroy(&w->whole);
  DemClipDestroy(&w->part);
  free(w->candidate);
  free(w->piece);
  free(w->corner);
  free(w->parts);
  free(w->stamp);
  free(w->part_of);
  free(w->out.facet);
  free(w->out.wall);
  free(w->out.corner);
  free(w->out.mirror);
}

/* Each thread takes one run of particles; joining the runs in order gives the same arrays for any number of threads. */
static PetscErrorCode MakeCells(const DemBodySearch *search, const ParticleGrid *grid, const DemPacking *packing, PetscReal h, PetscReal h_max, PetscInt n_workers, Worker *worker,
                                DemCells *cells, PetscReal *solid)
{
  const PetscInt n = packing->n, dim = search->body->dim;
  PetscInt       bad = n, bad_other = -1;
  Trouble        kind = FINE;

  PetscFunctionBegin;
#pragma omp parallel for schedule(static, 1) num_threads((int)n_workers)
  for (PetscInt t = 0; t < n_workers; t++) {
    Worker        *w       = &worker[t];
    const PetscInt first   = (PetscInt)((PetscInt64)n * t / n_workers), end = (PetscInt)((PetscInt64)n * (t + 1) / n_workers), pieces = search->body->n_pieces;
    Trouble        trouble = DemClipCreate(dim, &w->whole) || DemClipCreate(dim, &w->part) ? NO_MEMORY : FINE;
    PetscInt       p       = first;

    w->stamp   = malloc(pieces * sizeof(PetscInt));
    w->part_of = malloc(pieces * sizeof(PetscInt));
    if (!w->stamp || !w->part_of) trouble = NO_MEMORY;
    for (PetscInt k = 0; k < pieces && !trouble; k++) w->stamp[k] = -1;
    while (!trouble && p < end) {
      Cell cell;

      trouble = MakeCell(search, grid, packing, p, h, h_max, w, &cell);
      if (!trouble) trouble = HarvestCell(dim, p, w);
      if (trouble) break;
      cells->volume[p] = cell.volume;
      for (PetscInt c = 0; c < 3; c++) cells->centroid[3 * p + c] = cell.centroid[c];
      if (solid) solid[p] = cell.solid;
      p++;
    }
    if (trouble) {
#pragma omp critical
      if (p < bad) {
        bad       = p;
        kind      = trouble;
        bad_other = w->other;
      }
    }
  }
  {
    const PetscReal *x = &packing->x[3 * PetscMin(bad, n - 1)], r = packing->r[PetscMin(bad, n - 1)];

    PetscCheck(kind != NO_MEMORY, PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for the cells of %" PetscInt_FMT " particles", n);
    BaseCheckInput(kind != SAME_CENTRE, PETSC_COMM_SELF, "Particles %" PetscInt_FMT " and %" PetscInt_FMT " have the same centre (%g, %g, %g) m; remove one", bad, bad_other,
                   (double)x[0], (double)x[1], (double)x[2]);
    BaseCheckInput(kind != NO_CELL, PETSC_COMM_SELF,
                   "Particle %" PetscInt_FMT " at (%g, %g, %g) m with radius %g m has no cell: it lies outside the body or hidden by larger neighbours; remove it or change its radius",
                   bad, (double)x[0], (double)x[1], (double)x[2], (double)r);
    BaseCheckInput(kind != APART, PETSC_COMM_SELF,
                   "The notch is narrower than the particles beside it allow: the cell of particle %" PetscInt_FMT " at (%g, %g, %g) m with radius %g m reaches across; use smaller "
                   "particles or a wider notch",
                   bad, (double)x[0], (double)x[1], (double)x[2], (double)r);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Join the threads' runs into the caller's arrays. */
static PetscErrorCode JoinHarvests(PetscInt n_workers, const Worker *worker, DemCells *cells)
{
  PetscInt facets = 0, walls = 0, corners = 0;

  PetscFunctionBegin;
  for (PetscInt t = 0; t < n_workers; t++) {
    facets += worker[t].out.n_facets;
    walls += worker[t].out.n_walls;
    corners += worker[t].out.n_corners;
  }
  PetscCall(PetscMalloc1(facets, &cells->p));
  PetscCall(PetscMalloc1(facets, &cells->q));
  PetscCall(PetscMalloc1(facets, &cells->area));
  PetscCall(PetscMalloc1(3 * facets, &cells->at));
  PetscCall(PetscMalloc1(facets + 1, &cells->facet_start));
  PetscCall(PetscMalloc1(3 * corners, &cells->corner));
  PetscCall(PetscMalloc1(walls, &cells->wall_p));
  PetscCall(PetscMalloc1(walls, &cells->wall_face));
  PetscCall(PetscMalloc1(walls, &cells->wall_area));
  PetscCall(PetscMalloc1(3 * walls, &cells->wall_at));
  PetscCall(PetscMalloc1(3 * walls, &cells->wall_normal));
  facets = walls = corners = 0;
  for (PetscInt t = 0; t < n_workers; t++) {
    const Harvest *h = &worker[t].out;

    PetscCall(PetscArraycpy(&cells->corner[3 * corners], h->corner, 3 * h->n_corners));
    for (PetscInt k = 0; k < h->n_facets; k++, facets++) {
      cells->p[facets]           = h->facet[k].at;
      cells->q[facets]           = h->facet[k].q;
      cells->area[facets]        = h->facet[k].area;
      cells->facet_start[facets] = corners;
      for (PetscInt c = 0; c < 3; c++) cells->at[3 * facets + c] = h->facet[k].x[c];
      corners += h->facet[k].n;
    }
    for (PetscInt k = 0; k < h->n_walls; k++, walls++) {
      cells->wall_p[walls]    = h->wall[k].at;
      cells->wall_face[walls] = -1 - h->wall[k].q;
      cells->wall_area[walls] = h->wall[k].area;
      for (PetscInt c = 0; c < 3; c++) {
        cells->wall_at[3 * walls + c]     = h->wall[k].x[c];
        cells->wall_normal[3 * walls + c] = h->wall[k].normal[c];
      }
    }
  }
  cells->facet_start[facets] = corners;
  cells->n_facets            = facets;
  cells->n_walls             = walls;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both particles of a facet must see the same area. `tiny` [m2]: what a cutting tolerance may drop on one side. */
static PetscErrorCode CheckMirrors(PetscInt n_workers, const Worker *worker, const DemCells *cells, PetscReal tiny)
{
  PetscInt  *first;
  PetscBool *seen; /* [n_facets] by the higher particle */

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(cells->n + 2, &first));
  PetscCall(PetscCalloc1(cells->n_facets, &seen));
  for (PetscInt k = 0; k < cells->n_facets; k++) first[cells->p[k] + 1]++;
  for (PetscInt p = 0; p < cells->n; p++) first[p + 1] += first[p];
  for (PetscInt t = 0; t < n_workers; t++)
    for (PetscInt k = 0; k < worker[t].out.n_mirrors; k++) {
      const Mirror *m = &worker[t].out.mirror[k];
      PetscReal     area = 0;
      PetscInt      lo = first[m->p], hi = first[m->p + 1];

      while (lo < hi) {
        const PetscInt mid = (lo + hi) / 2;

        if (cells->q[mid] < m->q) lo = mid + 1;
        else hi = mid;
      }
      if (lo < first[m->p + 1] && cells->q[lo] == m->q) {
        area     = cells->area[lo];
        seen[lo] = PETSC_TRUE;
      }
      PetscCheck(PetscAbsReal(area - m->area) <= tiny, PETSC_COMM_SELF, PETSC_ERR_PLIB,
                 "Particles %" PetscInt_FMT " and %" PetscInt_FMT " see their facet as %g and %g m2: the diagram is broken", m->p, m->q, (double)area, (double)m->area);
    }
  for (PetscInt k = 0; k < cells->n_facets; k++)
    PetscCheck(seen[k] || cells->area[k] <= tiny, PETSC_COMM_SELF, PETSC_ERR_PLIB, "Particle %" PetscInt_FMT " does not see its facet of %g m2 with %" PetscInt_FMT, cells->q[k],
               (double)cells->area[k], cells->p[k]);
  PetscCall(PetscFree(first));
  PetscCall(PetscFree(seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemCellsBuild(const DemBody *body, const DemPacking *packing, DemCells *cells, PetscReal *solid)
{
  const PetscInt  n = packing->n, dim = body->dim;
  const PetscReal total = DemBodyVolume(body), spacing = PetscPowReal(total / body->thickness / PetscMax(n, 1), 1. / dim);
  PetscReal       h_max = 0, sum = 0;
  ParticleGrid    grid;
  DemBodySearch   search;
  PetscInt        n_workers = PetscMin(n, omp_get_max_threads());
  Worker         *worker;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(cells, sizeof(*cells)));
  BaseCheckInput(n > 0, PETSC_COMM_SELF, "A packing without particles has no cells");
  for (PetscInt p = 0; p < n; p++)
    BaseCheckInput(packing->r[p] > 0 && !PetscIsInfOrNanReal(packing->r[p] + packing->x[3 * p] + packing->x[3 * p + 1] + packing->x[3 * p + 2]), PETSC_COMM_SELF,
                   "Particle %" PetscInt_FMT " at (%g, %g, %g) m with radius %g m: centres are finite and radii above 0", p, (double)packing->x[3 * p],
                   (double)packing->x[3 * p + 1], (double)packing->x[3 * p + 2], (double)packing->r[p]);
  for (PetscInt p = 0; p < n; p++)
    for (PetscInt c = 0; c < dim; c++)
      h_max = PetscMax(h_max, PetscMax(PetscAbsReal(packing->x[3 * p + c] - body->low[c]), PetscAbsReal(packing->x[3 * p + c] - body->high[c])));
  h_max *= 1.01;
  cells->n = n;
  PetscCall(PetscMalloc1(n, &cells->volume));
  PetscCall(PetscMalloc1(3 * n, &cells->centroid));
  PetscCall(ParticleGridCreate(body, packing, &grid));
  PetscCall(DemBodySearchCreate(body, 0, spacing, &search));
  PetscCall(PetscCalloc1(n_workers, &worker));
  /* A part of a cell across a void wider than the first cube is missing from the sum: then every cube spans the body. */
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt t = 0; t < n_workers; t++) WorkerFree(&worker[t]);
    PetscCall(PetscArrayzero(worker, n_workers));
    PetscCall(MakeCells(&search, &grid, packing, pass ? h_max : PetscMin(h_max, 1.5 * spacing), h_max, n_workers, worker, cells, solid));
    sum = 0;
    for (PetscInt p = 0; p < n; p++) sum += cells->volume[p];
    if (PetscAbsReal(sum - total) <= 1e-9 * total) break;
  }
  PetscCheck(PetscAbsReal(sum - total) <= 1e-9 * total, PETSC_COMM_SELF, PETSC_ERR_PLIB, "The cells fill %.12g m3 of a body of %.12g m3%s", (double)sum, (double)total,
             body->n_pieces > 1 ? "; do cells of the mesh overlap?" : "");
  PetscCall(JoinHarvests(n_workers, worker, cells));
  PetscCall(CheckMirrors(n_workers, worker, cells, 1e-9 * total / n / spacing));
  for (PetscInt t = 0; t < n_workers; t++) WorkerFree(&worker[t]);
  PetscCall(PetscFree(worker));
  PetscCall(DemBodySearchDestroy(&search));
  PetscCall(PetscFree(grid.start));
  PetscCall(PetscFree(grid.item));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemCellsCreate(const DemBody *body, const DemPacking *packing, DemCells *cells)
{
  return DemCellsBuild(body, packing, cells, NULL);
}

PetscErrorCode DemCellsDestroy(DemCells *cells)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(cells->volume));
  PetscCall(PetscFree(cells->centroid));
  PetscCall(PetscFree(cells->p));
  PetscCall(PetscFree(cells->q));
  PetscCall(PetscFree(cells->area));
  PetscCall(PetscFree(cells->at));
  PetscCall(PetscFree(cells->wall_p));
  PetscCall(PetscFree(cells->wall_face));
  PetscCall(PetscFree(cells->wall_area));
  PetscCall(PetscFree(cells->wall_at));
  PetscCall(PetscFree(cells->wall_normal));
  PetscCall(PetscFree(cells->facet_start));
  PetscCall(PetscFree(cells->corner));
  PetscCall(PetscMemzero(cells, sizeof(*cells)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
