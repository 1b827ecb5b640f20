/*
  dem_cells_one.c - one cell of the power diagram, clipped by the body.

  A cell starts as a cube around its particle, is cut by the bisectors of ever farther neighbours until none can reach
  it, and then by every convex piece of the body that it meets; the parts are summed. A cube whose own face survives
  inside the body was too small and is doubled. Everything is in coordinates of the cube, so lengths are near 1
  whatever the body's size.  Eq. (3.1), docs/theory.md
*/
#include "dem_cells_impl.h"
#include <stdlib.h>
#include <string.h>

#define FLAT 2e-13 /* thickness in cube units below which a part only touches: the clip's own tolerance */
#define APART 1e-6 /* of the neighbour grid's width: centres nearer than this are one; their bisector would be round-off */
#define CRUMB 1e-9 /* volume in cube units: what is cut off and smaller stays with its owner, it may be round-off */

Trouble DemCellGrow(PetscInt need, size_t size, PetscInt *room, void *array)
{
  void *more;

  if (need <= *room) return FINE;
  need = PetscMax(need, *room + *room / 4);
  more = realloc(*(void **)array, need * size);
  if (!more) return NO_MEMORY;
  *(void **)array = more;
  *room = need;
  return FINE;
}

static int CompareCandidates(const void *a, const void *b)
{
  const Candidate *c = a, *d = b;

  return c->t != d->t ? (c->t > d->t) - (c->t < d->t) : (c->q > d->q) - (c->q < d->q);
}

/* Cut the cell of p (cube of half side h) by the bisectors with all others that can reach it.  Eq. (3.1) */
static Trouble CutByNeighbours(const CellScene *scene, PetscInt p, PetscReal h, Worker *w, PetscBool *some)
{
  const ParticleGrid *g = scene->grid;
  const DemPacking   *packing = scene->packing;
  const PetscReal    *x = &packing->x[3 * p], rp2 = packing->r[p] * packing->r[p];
  PetscReal           reach = h * DemClipReach(&w->whole);
  PetscInt            at[3], rings = 0;

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
            if (!(d2 > PetscSqr(APART * g->width))) {
              w->other = q;
              return SAME_CENTRE;
            }
            t = (d2 + rp2 - packing->r[q] * packing->r[q]) / (2 * PetscSqrtReal(d2)); /* signed distance of the bisector */
            if (t >= reach) continue;
            if (DemCellGrow(n + 1, sizeof(Candidate), &w->room_candidates, &w->candidate)) return NO_MEMORY;
            w->candidate[n].t = t;
            w->candidate[n++].q = q;
          }
        }
      }
    if (n > 1) qsort(w->candidate, n, sizeof(Candidate), CompareCandidates); /* none: no list to point at */
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

/* The planes of a piece seen from x in cube units. False when one of them has all corners of the cell outside; else
   cut [n_cut] are those that cut some corner off. */
static PetscBool MeetsPiece(const DemBody *body, PetscInt piece, const PetscReal x[3], PetscReal h, PetscInt n_corners, const double *corner, PetscInt *n_cut,
                            PetscInt *cut)
{
  *n_cut = 0;
  for (PetscInt k = body->start[piece]; k < body->start[piece + 1]; k++) {
    const PetscReal *n = &body->plane[4 * k];
    const PetscReal  offset = (n[3] - (n[0] * x[0] + n[1] * x[1] + n[2] * x[2])) / h;
    PetscInt         out = 0;

    for (PetscInt c = 0; c < n_corners; c++) out += n[0] * corner[3 * c] + n[1] * corner[3 * c + 1] + n[2] * corner[3 * c + 2] >= offset;
    if (out == n_corners) return PETSC_FALSE;
    if (out) cut[(*n_cut)++] = k;
  }
  return PETSC_TRUE;
}

/* Cut by the planes plane[first .. end) of the body; plane NULL: first .. end themselves. */
static Trouble CutByPlanes(const DemBody *body, PetscInt first, PetscInt end, const PetscInt *plane, const PetscReal x[3], PetscReal h, DemClip *clip,
                           PetscBool *some)
{
  const PetscReal reach = DemClipReach(clip);

  for (PetscInt j = first; j < end && *some; j++) {
    const PetscInt   k = plane ? plane[j] : j;
    const PetscReal *m = &body->plane[4 * k];
    const PetscReal  offset = (m[3] - (m[0] * x[0] + m[1] * x[1] + m[2] * x[2])) / h;

    if (offset < reach && DemClipCut(clip, m, offset, PLANE_ID(k), some)) return NO_MEMORY;
  }
  return FINE;
}

/* Sum the facets of one part into p's cell: volume, centroid, sphere, patches; join it with parts it opens to.
   origin: particle the clip's coordinates are relative to - p itself, or the first owner of a part that p inherits;
   then part is -1 - share. Patches towards orphans are left out: those parts are not their owner's any more. */
static Trouble ReadPart(const CellScene *scene, PetscInt p, PetscInt origin, PetscReal h, PetscInt part, PetscInt in_piece, DemClip *clip, Worker *w,
                        Cell *cell)
{
  const DemBody    *body = scene->search->body;
  const DemPacking *packing = scene->packing;
  const PetscInt    dim = body->dim;
  const PetscReal  *x = &packing->x[3 * p], scale_area = dim == 2 ? h * body->thickness : h * h;
  const int        *id, *start;
  const double     *corner;
  const PetscInt    n = DemClipFacets(clip, &id, &start, &corner);
  PetscReal         volume = 0, moment[3] = {0, 0, 0}, solid = 0, surface = 0;
  const PetscInt    kept = w->n_patches;
  PetscBool         cube = PETSC_FALSE;

  if (origin != p) {
    if (DemCellGrow(3 * start[n], sizeof(double), &w->room_moved, &w->moved)) return NO_MEMORY;
    for (PetscInt k = 0; k < 3 * start[n]; k++) w->moved[k] = corner[k] + (packing->x[3 * origin + k % 3] - x[k % 3]) / h;
    corner = w->moved;
  }
  for (PetscInt f = 0; f < n; f++) {
    const double  *v = &corner[3 * start[f]];
    const int      m = start[f + 1] - start[f];
    const PetscInt q = id[f] >= HEIR_ID(0) ? scene->estate->share[id[f] - HEIR_ID(0)].heir : id[f]; /* the neighbour beyond, if q >= 0 */
    PetscReal      normal[3] = {0, 0, 0}, area = 0, mid[3] = {0, 0, 0}, height;

    if (q >= 0) {
      const PetscInt from = id[f] >= HEIR_ID(0) ? DemEstateCutter(scene->estate, -1 - part, id[f] - HEIR_ID(0)) : origin;
      PetscReal      d = 0;

      for (PetscInt c = 0; c < 3; c++) {
        normal[c] = packing->x[3 * q + c] - packing->x[3 * from + c];
        d += normal[c] * normal[c];
      }
      d = PetscSqrtReal(d);
      for (PetscInt c = 0; c < 3; c++) normal[c] /= d;
    } else if (q <= PLANE_ID(0)) {
      for (PetscInt c = 0; c < 3; c++) normal[c] = body->plane[4 * (-10 - q) + c];
    } else {
      normal[(-1 - q) / 2] = (-1 - q) % 2 ? 1 : -1;
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
    surface += area;
    volume += area * height / dim;
    for (PetscInt c = 0; c < 3; c++) moment[c] += area * height / (dim + 1) * mid[c];
    solid += dim == 2 ? DemDiscInTriangle(v, normal, height, packing->r[p] / h) : DemBallInCone(m, v, normal, height, packing->r[p] / h);
    if (q < 0 && q > PLANE_ID(0)) {
      cube = PETSC_TRUE;
    } else if (q >= 0 || body->face[-10 - q] >= 0) {
      Patch *patch;

      if (id[f] >= HEIR_ID(0) && !DemEstateParts(scene->estate, -1 - part, id[f] - HEIR_ID(0))) continue;
      if (q >= 0 && id[f] < HEIR_ID(0) && (part < 0 || (scene->estate && DemEstateHas(scene->estate, q, in_piece)))) continue;
      if (DemCellGrow(w->n_patches + 1, sizeof(Patch), &w->room_patches, &w->patch)) return NO_MEMORY;
      if (DemCellGrow(3 * (w->n_corners + m), sizeof(PetscReal), &w->room_corners, &w->corner)) return NO_MEMORY;
      patch = &w->patch[w->n_patches++];
      patch->q = q >= 0 ? q : -1 - body->face[-10 - q];
      patch->area = area * scale_area;
      patch->at = w->n_corners;
      patch->n = m;
      for (PetscInt c = 0; c < 3; c++) {
        patch->normal[c] = normal[c];
        patch->x[c] = x[c] + h * mid[c];
      }
      for (int k = 0; k < m; k++, w->n_corners++)
        for (PetscInt c = 0; c < 3; c++) w->corner[3 * w->n_corners + c] = x[c] + h * v[3 * k + c];
    } else if (part >= 0 && area > 1e-12) {
      const PetscInt next = body->beyond[-10 - q];

      if (next >= 0 && w->stamp[next] == p) {
        PetscInt a = part, b = w->part_of[next];

        while (w->parts[a].root != a) a = w->parts[a].root;
        while (w->parts[b].root != b) b = w->parts[b].root;
        w->parts[PetscMax(a, b)].root = PetscMin(a, b);
      }
    }
  }
  if (!(volume > FLAT * surface)) { /* the cell only touches this piece */
    w->n_patches = kept;
    return FINE;
  }
  if (part >= 0) w->parts[part].volume = volume;
  if (cube) cell->cube = PETSC_TRUE;
  cell->volume += volume * scale_area * h;
  cell->solid += solid * scale_area * h;
  for (PetscInt c = 0; c < 3; c++) cell->centroid[c] += moment[c] * scale_area * h * h;
  return FINE;
}

/* Keep the parts that are not joined through the body to the particle's own, for the estate. */
static Trouble KeepOrphans(const CellScene *scene, PetscInt p, PetscReal h, Worker *w)
{
  const DemBody   *body = scene->search->body;
  const PetscReal *x = &scene->packing->x[3 * p];
  PetscInt         mine = -1;

  for (PetscInt k = 0; k < w->n_parts; k++)
    if (w->parts[w->parts[k].root].joined > CRUMB && w->parts[k].volume > 0 && (mine < 0 || w->parts[k].outside < w->parts[mine].outside)) mine = k;
  for (PetscInt k = 0; k < w->n_parts; k++) {
    const PetscInt piece = w->parts[k].piece, root = w->parts[k].root;
    PetscBool      some = PETSC_TRUE;
    Orphan        *orphan;

    if (root == w->parts[mine].root || !(w->parts[k].volume > 0) || w->parts[root].joined <= CRUMB) continue;
    if (DemCellGrow(w->out.n_orphans + 1, sizeof(Orphan), &w->out.room_orphans, &w->out.orphan)) return NO_MEMORY;
    orphan = &w->out.orphan[w->out.n_orphans];
    if (DemClipCreate(body->dim, &orphan->clip)) return NO_MEMORY;
    orphan->p = p;
    orphan->piece = piece;
    orphan->h = h;
    w->out.n_orphans++;
    if (DemClipCopy(&orphan->clip, &w->whole) || CutByPlanes(body, body->start[piece], body->start[piece + 1], NULL, x, h, &orphan->clip, &some))
      return NO_MEMORY;
  }
  return FINE;
}

/* The cell in every piece of the body that it meets. */
static Trouble CutByBody(const CellScene *scene, PetscInt p, PetscReal h, Worker *w, Cell *cell)
{
  const DemBodySearch *search = scene->search;
  const DemBody       *body = search->body;
  const PetscReal     *x = &scene->packing->x[3 * p], reach = DemClipReach(&w->whole);
  const double        *corner;
  const PetscInt       n_corners = DemClipCorners(&w->whole, &corner);
  PetscInt             lo[3], hi[3], groups = 0, n_cut, cut[4]; /* a piece among several has at most 4 planes */

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
          const PetscReal *box = &body->box[6 * piece];
          PetscBool        some = PETSC_TRUE;
          PetscReal        gap = 0;

          if (w->stamp[piece] == p) continue;
          for (PetscInt c = 0; c < 3; c++) gap = PetscMax(gap, PetscMax(box[c] - x[c], x[c] - box[3 + c]));
          if (gap > h * reach || (scene->estate && DemEstateHas(scene->estate, p, piece))) continue;
          if (!MeetsPiece(body, piece, x, h, n_corners, corner, &n_cut, cut)) continue;
          if (DemClipCopy(&w->part, &w->whole) || CutByPlanes(body, 0, n_cut, cut, x, h, &w->part, &some)) return NO_MEMORY;
          if (!some) continue;
          if (DemCellGrow(part + 1, sizeof(Part), &w->room_parts, &w->parts)) return NO_MEMORY;
          w->n_parts++;
          w->stamp[piece] = p;
          w->part_of[piece] = part;
          w->parts[part] = (Part){.piece = piece, .root = part};
          for (PetscInt f = body->start[piece]; f < body->start[piece + 1]; f++) {
            const PetscReal *n = &body->plane[4 * f];

            w->parts[part].outside = PetscMax(w->parts[part].outside, n[0] * x[0] + n[1] * x[1] + n[2] * x[2] - n[3]);
          }
          if (ReadPart(scene, p, p, h, part, piece, &w->part, w, cell)) return NO_MEMORY;
        }
      }
  for (PetscInt k = 0; k < w->n_parts; k++) {
    while (w->parts[w->parts[k].root].root != w->parts[k].root) w->parts[k].root = w->parts[w->parts[k].root].root;
    w->parts[w->parts[k].root].joined += w->parts[k].volume;
  }
  for (PetscInt k = 0; k < w->n_parts; k++) groups += w->parts[k].joined > CRUMB;
  cell->apart = groups > 1 ? PETSC_TRUE : PETSC_FALSE;
  for (PetscInt k = 0; k < w->n_parts; k++) w->stamp[w->parts[k].piece] = -1;
  return FINE;
}

/* Some neighbour of the cell owns orphans: facets must be told apart piece by piece. */
static PetscBool MeetsOrphans(const CellScene *scene, DemClip *clip)
{
  const int    *id, *start;
  const double *corner;
  PetscInt      n;

  if (!scene->estate) return PETSC_FALSE;
  n = DemClipFacets(clip, &id, &start, &corner);
  for (PetscInt f = 0; f < n; f++)
    if (id[f] >= 0 && scene->estate->has[id[f]]) return PETSC_TRUE;
  return PETSC_FALSE;
}

/* The cell of p within the body, from a cube that grows while a face of it is left in the body. */
Trouble DemCellMake(const CellScene *scene, PetscInt p, Worker *w, Cell *cell)
{
  const DemBody   *body = scene->search->body;
  const PetscReal *x = &scene->packing->x[3 * p];
  Trouble          trouble;

  for (PetscReal h = scene->h;; h *= 2) {
    PetscBool some = PETSC_TRUE, inside = body->n_pieces == 1 ? PETSC_TRUE : PETSC_FALSE;

    memset(cell, 0, sizeof(*cell));
    w->n_patches = w->n_corners = w->n_parts = 0;
    DemClipBox(&w->whole);
    if (inside && CutByPlanes(body, 0, body->start[1], NULL, x, h, &w->whole, &some)) return NO_MEMORY;
    if (some && (trouble = CutByNeighbours(scene, p, h, w, &some))) return trouble;
    if (!some) return NO_CELL;
    if (!inside && !MeetsOrphans(scene, &w->whole)) inside = DemBodySearchClear(scene->search, x, h * DemClipReach(&w->whole));
    if (inside) {
      if (DemCellGrow(1, sizeof(Part), &w->room_parts, &w->parts)) return NO_MEMORY;
      w->parts[0] = (Part){0};
      trouble = ReadPart(scene, p, p, h, 0, 0, &w->whole, w, cell);
    } else {
      trouble = CutByBody(scene, p, h, w, cell);
    }
    if (trouble) return trouble;
    if (cell->cube && h < scene->h_max) continue;
    if (cell->apart && !scene->estate && KeepOrphans(scene, p, h, w)) return NO_MEMORY;
    break;
  }
  if (scene->estate) {
    PetscInt first, end;

    DemEstateFind(scene->estate, p, &first, &end);
    for (PetscInt k = first; k < end; k++) {
      Share        *share = &scene->estate->share[scene->estate->bequest[k].share];
      const Orphan *o = &scene->estate->orphan[share->orphan];

      if (ReadPart(scene, p, o->p, o->h, -1 - scene->estate->bequest[k].share, o->piece, &share->clip, w, cell)) return NO_MEMORY;
    }
  }
  if (!(cell->volume > 0)) return NO_CELL;
  for (PetscInt c = 0; c < 3; c++) cell->centroid[c] = x[c] + cell->centroid[c] / cell->volume;
  return FINE;
}
