/*
  dem_cells2d.c - the convex polygon that half-planes cut, and the choice between it and voro++'s polyhedron.

  A cut moves no corner it keeps, so a cell closes to round-off whatever the order of the cuts. Coordinates are O(1); a
  corner within 1e-14 of a line counts as on it, which keeps the corners cut off in one run.
*/
#include "dem_clip.h"
#include <stdlib.h>
#include <string.h>

static int PolygonGrow(DemPolygon *p, int room)
{
  void *x, *id, *s, *corner, *start;

  if (room <= p->room) return 0;
  room = PetscMax(room, 2 * p->room);
  if (!(x = realloc(p->x, 2 * room * sizeof(double)))) return 1;
  p->x = x;
  if (!(id = realloc(p->id, room * sizeof(int)))) return 1;
  p->id = id;
  if (!(s = realloc(p->s, room * sizeof(double)))) return 1;
  p->s = s;
  if (!(corner = realloc(p->corner, 6 * room * sizeof(double)))) return 1;
  p->corner = corner;
  if (!(start = realloc(p->start, (room + 1) * sizeof(int)))) return 1;
  p->start = start;
  p->room = room;
  return 0;
}

/* Sutherland-Hodgman for one half-plane; a convex polygon gains at most one corner. */
static int PolygonCut(DemPolygon *p, const PetscReal n[3], PetscReal offset, int id)
{
  int out = 0, first = -1, m = p->n;

  for (int k = 0; k < m; k++) {
    p->s[k] = n[0] * p->x[2 * k] + n[1] * p->x[2 * k + 1] - offset;
    if (p->s[k] < 1e-14) p->s[k] = PetscMin(p->s[k], 0);
    out += p->s[k] > 0;
  }
  if (out == 0) return 0;
  if (out == m) {
    p->n = 0;
    return 0;
  }
  if (PolygonGrow(p, m + 2)) return 1;
  for (int k = 0; k < m; k++) /* last corner kept before the run of cut ones */
    if (p->s[k] <= 0 && p->s[(k + 1) % m] > 0) first = k;
  {
    const int    a = first, b = (a + 1) % m, keep = m - out; /* edge a leaves, edge c comes back */
    const int    c = (a + out) % m, d = (c + 1) % m;
    const double ta = p->s[a] / (p->s[a] - p->s[b]), tc = p->s[c] / (p->s[c] - p->s[d]);
    const double leave[2] = {p->x[2 * a] + ta * (p->x[2 * b] - p->x[2 * a]), p->x[2 * a + 1] + ta * (p->x[2 * b + 1] - p->x[2 * a + 1])};
    const double enter[2] = {p->x[2 * c] + tc * (p->x[2 * d] - p->x[2 * c]), p->x[2 * c + 1] + tc * (p->x[2 * d + 1] - p->x[2 * c + 1])};
    const int    id_c = p->id[c];
    double      *w = p->corner; /* work: kept corners from d round to a, then the two new ones */
    int         *e = p->start;

    for (int k = 0; k < keep; k++) {
      const int from = (d + k) % m;

      w[2 * k] = p->x[2 * from];
      w[2 * k + 1] = p->x[2 * from + 1];
      e[k] = p->id[from];
    }
    for (int k = 0; k < keep; k++) {
      p->x[2 * k] = w[2 * k];
      p->x[2 * k + 1] = w[2 * k + 1];
      p->id[k] = e[k];
    }
    for (int k = 0; k < 2; k++) {
      p->x[2 * keep + k] = leave[k];
      p->x[2 * (keep + 1) + k] = enter[k];
    }
    p->id[keep] = id;
    p->id[keep + 1] = id_c;
    p->n = keep + 2;
  }
  return 0;
}

int DemClipCreate(PetscInt dim, DemClip *clip)
{
  memset(clip, 0, sizeof(*clip));
  clip->dim = dim;
  if (dim == 2) return PolygonGrow(&clip->polygon, 64);
  clip->cell = VoroCellCreate();
  return clip->cell ? 0 : 1;
}

void DemClipDestroy(DemClip *clip)
{
  if (clip->cell) VoroCellDestroy(clip->cell);
  free(clip->polygon.x);
  free(clip->polygon.id);
  free(clip->polygon.s);
  free(clip->polygon.corner);
  free(clip->polygon.start);
  memset(clip, 0, sizeof(*clip));
}

void DemClipBox(DemClip *clip)
{
  static const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1}, square[8] = {-1, -1, 1, -1, 1, 1, -1, 1};
  static const int    side[4] = {-3, -2, -4, -1};

  if (clip->dim == 3) {
    VoroCellBox(clip->cell, low, high);
  } else {
    clip->polygon.n = 4;
    memcpy(clip->polygon.x, square, sizeof(square));
    memcpy(clip->polygon.id, side, sizeof(side));
  }
}

int DemClipCut(DemClip *clip, const PetscReal normal[3], PetscReal offset, PetscInt id, PetscBool *some)
{
  int full = 0;

  if (clip->dim == 3) {
    *some = VoroCellCut(clip->cell, normal, offset, (int)id) ? PETSC_TRUE : PETSC_FALSE;
  } else {
    full = PolygonCut(&clip->polygon, normal, offset, (int)id);
    *some = clip->polygon.n > 0 ? PETSC_TRUE : PETSC_FALSE;
  }
  return full;
}

int DemClipCopy(DemClip *to, DemClip *from)
{
  if (to->dim == 3) {
    VoroCellCopy(to->cell, from->cell);
  } else {
    if (PolygonGrow(&to->polygon, from->polygon.n)) return 1;
    to->polygon.n = from->polygon.n;
    memcpy(to->polygon.x, from->polygon.x, 2 * from->polygon.n * sizeof(double));
    memcpy(to->polygon.id, from->polygon.id, from->polygon.n * sizeof(int));
  }
  return 0;
}

PetscReal DemClipReach(DemClip *clip)
{
  PetscReal far = 0;

  if (clip->dim == 3) return VoroCellReach(clip->cell);
  for (int k = 0; k < clip->polygon.n; k++) far = PetscMax(far, PetscSqr(clip->polygon.x[2 * k]) + PetscSqr(clip->polygon.x[2 * k + 1]));
  return PetscSqrtReal(far);
}

PetscInt DemClipCorners(DemClip *clip, const double **corner)
{
  DemPolygon *p = &clip->polygon;

  if (clip->dim == 3) return VoroCellCorners(clip->cell, corner);
  for (int k = 0; k < p->n; k++) {
    p->corner[3 * k] = p->x[2 * k];
    p->corner[3 * k + 1] = p->x[2 * k + 1];
    p->corner[3 * k + 2] = 0;
  }
  *corner = p->corner;
  return p->n;
}

PetscInt DemClipFacets(DemClip *clip, const int **id, const int **start, const double **corner)
{
  DemPolygon *p = &clip->polygon;

  if (clip->dim == 3) return VoroCellFacets(clip->cell, id, start, corner);
  for (int k = 0; k < p->n; k++) {
    p->start[k] = 2 * k;
    for (int e = 0; e < 2; e++) {
      p->corner[6 * k + 3 * e] = p->x[2 * ((k + e) % p->n)];
      p->corner[6 * k + 3 * e + 1] = p->x[2 * ((k + e) % p->n) + 1];
      p->corner[6 * k + 3 * e + 2] = 0;
    }
  }
  p->start[p->n] = 2 * p->n;
  *id = p->id;
  *start = p->start;
  *corner = p->corner;
  return p->n;
}
