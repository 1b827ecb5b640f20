/*
  dem_surface_contact.c - where a sphere touches a surface of flat cells.  Eqs (5.50)-(5.52), docs/theory.md

  A touch is a local minimum of the distance to the surface: the foot of the centre inside a face; the foot inside an edge
  when it is nearest for the faces on both sides; a corner when it is nearest for all edges that end there. On a flat or
  convex surface there is exactly one, in a hollow corner one for each face. Rounding at a seam may find it twice or on
  both sides: such twins, and facets of one smooth part, are told by their normals, and the nearest stands for all.
*/
#include "dem_surface.h"

#define CANDIDATES 32    /* local minima before twins are sorted out */
#define SEAM       1e-7  /* a foot this far beyond a seam, over the distance, is still on it */

static PetscReal Dot(const PetscReal a[3], const PetscReal b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void Cross(const PetscReal a[3], const PetscReal b[3], PetscReal c[3])
{
  c[0] = a[1] * b[2] - a[2] * b[1];
  c[1] = a[2] * b[0] - a[0] * b[2];
  c[2] = a[0] * b[1] - a[1] * b[0];
}

static void Minus(const PetscReal *a, const PetscReal *b, PetscReal c[3])
{
  for (PetscInt d = 0; d < 3; d++) c[d] = a[d] - b[d];
}

typedef struct {
  PetscInt n;
  DemTouch touch[CANDIDATES]; /* nearest first; equal distances: faces, edges, corners */
} Found;

static void Insert(Found *found, const PetscReal n[3], PetscReal distance, PetscInt kind, PetscInt which)
{
  PetscInt k = found->n;

  if (k == CANDIDATES) {
    if (found->touch[k - 1].distance <= distance) return;
    k--;
  } else found->n++;
  while (k > 0 && (found->touch[k - 1].distance > distance || (found->touch[k - 1].distance == distance && found->touch[k - 1].kind > kind))) {
    found->touch[k] = found->touch[k - 1];
    k--;
  }
  found->touch[k] = (DemTouch){{n[0], n[1], n[2]}, distance, 0, kind, which};
}

/* The nearest first; those it hides are left out. */
static PetscInt Sift(const Found *found, DemTouch touch[DEM_TOUCHES])
{
  PetscInt n = 0;

  for (PetscInt k = 0; k < found->n && n < DEM_TOUCHES; k++) {
    PetscBool hidden = PETSC_FALSE;

    for (PetscInt i = 0; i < n; i++)
      if (Dot(touch[i].n, found->touch[k].n) > DEM_SMOOTH_COSINE) hidden = PETSC_TRUE;
    if (!hidden) touch[n++] = found->touch[k];
  }
  return n;
}

/* Does the foot of the centre lie inside cell c? Side k runs from corner k; its inward direction is normal x side. */
static PetscBool Over(const DemSurface *s, PetscInt c, const PetscReal centre[3])
{
  const PetscInt *node = &s->corner[s->dim * c];
  PetscReal       w[3], side[3], inward[3];

  if (s->dim == 2) {
    Minus(&s->x[3 * node[1]], &s->x[3 * node[0]], side);
    Minus(centre, &s->x[3 * node[0]], w);
    return (PetscBool)(Dot(w, side) >= 0 && Dot(w, side) <= Dot(side, side));
  }
  for (PetscInt k = 0; k < 3; k++) {
    Minus(&s->x[3 * node[(k + 1) % 3]], &s->x[3 * node[k]], side);
    Cross(&s->normal[3 * c], side, inward);
    Minus(centre, &s->x[3 * node[k]], w);
    if (Dot(w, inward) < 0) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

static void TryFace(const DemSurface *s, PetscInt c, const PetscReal centre[3], PetscReal radius, Found *found)
{
  PetscReal       w[3], n[3], h;

  Minus(centre, &s->x[3 * s->corner[s->dim * c]], w);
  h = Dot(w, &s->normal[3 * c]);
  if (PetscAbsReal(h) >= radius || !Over(s, c, centre)) return;
  for (PetscInt d = 0; d < 3; d++) n[d] = h < 0 ? -s->normal[3 * c + d] : s->normal[3 * c + d];
  Insert(found, n, PetscAbsReal(h), 0, c);
}

/* w from the foot to the centre, at distance l: n, or a face's normal where the centre lies on the surface itself */
static void Along(const PetscReal w[3], PetscReal l, const PetscReal *normal, PetscReal n[3])
{
  for (PetscInt d = 0; d < 3; d++) n[d] = l > 0 ? w[d] / l : normal[d];
}

static void TryEdge(const DemSurface *s, PetscInt e, const PetscReal centre[3], PetscReal radius, Found *found)
{
  const PetscReal *a = &s->x[3 * s->edge[2 * e]], *b = &s->x[3 * s->edge[2 * e + 1]];
  PetscReal        side[3], w[3], n[3], t, l, length2;

  Minus(b, a, side);
  Minus(centre, a, w);
  length2 = Dot(side, side);
  t       = Dot(w, side) / length2;
  if (t <= 0 || t >= 1) return;
  for (PetscInt d = 0; d < 3; d++) w[d] -= t * side[d];
  l = PetscSqrtReal(Dot(w, w));
  if (l >= radius) return;
  for (PetscInt k = 0; k < 2; k++) {
    const PetscInt c = s->edge_cell[2 * e + k];
    PetscReal      inward[3], sign = 1;

    if (c < 0) continue;
    for (PetscInt i = 0; i < 3; i++)
      if (s->cell_edge[3 * c + i] == e && s->corner[3 * c + i] != s->edge[2 * e]) sign = -1;
    Cross(&s->normal[3 * c], side, inward);
    if (sign * Dot(w, inward) > SEAM * l * PetscSqrtReal(length2)) return; /* nearer to the face */
  }
  Along(w, l, &s->normal[3 * s->edge_cell[2 * e]], n);
  Insert(found, n, l, 1, e);
}

static void TryNode(const DemSurface *s, PetscInt node, const PetscReal centre[3], PetscReal radius, Found *found)
{
  PetscReal w[3], side[3], n[3], l;

  Minus(centre, &s->x[3 * node], w);
  l = PetscSqrtReal(Dot(w, w));
  if (l >= radius) return;
  for (PetscInt k = s->spoke_start[node]; k < s->spoke_start[node + 1]; k++) {
    Minus(&s->x[3 * s->spoke[k]], &s->x[3 * node], side);
    if (Dot(w, side) > SEAM * l * PetscSqrtReal(Dot(side, side))) return; /* nearer to that edge */
  }
  Along(w, l, &s->normal[3 * s->node_owner[node]], n);
  Insert(found, n, l, 2, node);
}

/* A face, and those of its edges and corners that it speaks for: whoever is near them has this cell in the list too. */
static void TryCell(const DemSurface *s, PetscInt c, const PetscReal centre[3], PetscReal radius, Found *found)
{
  TryFace(s, c, centre, radius, found);
  for (PetscInt k = 0; k < s->dim; k++) {
    if (s->dim == 3 && s->edge_cell[2 * s->cell_edge[3 * c + k]] == c) TryEdge(s, s->cell_edge[3 * c + k], centre, radius, found);
    if (s->node_owner[s->corner[s->dim * c + k]] == c) TryNode(s, s->corner[s->dim * c + k], centre, radius, found);
  }
}

PetscInt DemSurfaceTouchAll(const DemSurface *s, const PetscReal centre[3], PetscReal radius, DemTouch touch[DEM_TOUCHES])
{
  Found found = {0};

  for (PetscInt c = 0; c < s->n; c++) TryCell(s, c, centre, radius, &found);
  return Sift(&found, touch);
}

PetscInt DemSurfaceTouch(const DemSurface *s, const PetscReal centre[3], PetscReal radius, DemTouch touch[DEM_TOUCHES])
{
  Found    found;
  PetscInt at = 0;

  for (PetscInt d = 2; d >= 0; d--) {
    const PetscReal y = (centre[d] - s->origin[d]) / s->width;

    if (!(y >= 0 && y < (PetscReal)s->m[d])) return 0;
    at = at * s->m[d] + (PetscInt)y;
  }
  if (s->box_start[at] == s->box_start[at + 1]) return 0;
  found.n = 0;
  for (PetscInt k = s->box_start[at]; k < s->box_start[at + 1]; k++) TryCell(s, s->box[k], centre, radius, &found);
  return found.n ? Sift(&found, touch) : 0;
}

/* Distance of a point from cell c [m] */
static PetscReal CellDistance(const DemSurface *s, PetscInt c, const PetscReal x[3])
{
  const PetscInt *node = &s->corner[s->dim * c];
  PetscReal       w[3], best = PETSC_MAX_REAL;

  if (Over(s, c, x)) {
    Minus(x, &s->x[3 * node[0]], w);
    return PetscAbsReal(Dot(w, &s->normal[3 * c]));
  }
  for (PetscInt k = 0; k < (s->dim == 3 ? 3 : 1); k++) {
    PetscReal side[3], t;

    Minus(&s->x[3 * node[(k + 1) % s->dim]], &s->x[3 * node[k]], side);
    Minus(x, &s->x[3 * node[k]], w);
    t = PetscMin(1, PetscMax(0, Dot(w, side) / Dot(side, side)));
    for (PetscInt d = 0; d < 3; d++) w[d] -= t * side[d];
    best = PetscMin(best, PetscSqrtReal(Dot(w, w)));
  }
  return best;
}

PetscReal DemSurfaceDistance(const DemSurface *s, const PetscReal x[3])
{
  PetscReal best = PETSC_MAX_REAL;

  for (PetscInt c = 0; c < s->n; c++) best = PetscMin(best, CellDistance(s, c, x));
  return best;
}

PetscErrorCode DemSurfaceSetReach(DemSurface *s, PetscReal reach)
{
  const PetscReal most = PetscMax(4096, 16.0 * (PetscReal)s->n);
  PetscInt        total = 1;

  PetscFunctionBegin;
  PetscCheck(reach > 0 && !s->box_start, PETSC_COMM_SELF, PETSC_ERR_ORDER, "The reach of a surface is set once, and positive");
  s->reach = reach;
  s->width = reach;
  for (;;) {
    PetscReal boxes = 1;

    for (PetscInt d = 0; d < s->dim; d++) boxes *= PetscCeilReal((s->high[d] - s->low[d] + 2 * reach) / s->width) + 1;
    if (boxes <= most) break;
    s->width *= 1.2;
  }
  for (PetscInt d = 0; d < 3; d++) {
    s->m[d]      = d < s->dim ? (PetscInt)PetscCeilReal((s->high[d] - s->low[d] + 2 * reach) / s->width) + 1 : 1;
    s->origin[d] = d < s->dim ? s->low[d] - reach : -0.5 * s->width;
    total *= s->m[d];
  }
  PetscCall(PetscCalloc1(total + 2, &s->box_start));
  for (PetscInt pass = 0; pass < 2; pass++) { /* count, then fill */
    for (PetscInt c = 0; c < s->n; c++) {
      PetscInt low[3], high[3];

      for (PetscInt d = 0; d < 3; d++) {
        PetscReal least = PETSC_MAX_REAL, largest = -PETSC_MAX_REAL;

        for (PetscInt k = 0; k < s->dim; k++) {
          least   = PetscMin(least, s->x[3 * s->corner[s->dim * c + k] + d]);
          largest = PetscMax(largest, s->x[3 * s->corner[s->dim * c + k] + d]);
        }
        low[d]  = PetscMax(0, (PetscInt)PetscFloorReal((least - reach * (1 + 1e-9) - s->origin[d]) / s->width));
        high[d] = PetscMin(s->m[d] - 1, (PetscInt)PetscFloorReal((largest + reach * (1 + 1e-9) - s->origin[d]) / s->width));
      }
      for (PetscInt k = low[2]; k <= high[2]; k++)
        for (PetscInt j = low[1]; j <= high[1]; j++)
          for (PetscInt i = low[0]; i <= high[0]; i++) {
            const PetscInt  at = (k * s->m[1] + j) * s->m[0] + i;
            const PetscReal middle[3] = {s->origin[0] + (i + 0.5) * s->width, s->origin[1] + (j + 0.5) * s->width, s->dim == 3 ? s->origin[2] + (k + 0.5) * s->width : 0};
            const PetscReal half = 0.5 * s->width * (s->dim == 3 ? 1.7320508075688774 : 1.4142135623730951);

            if (CellDistance(s, c, middle) > (half + reach) * (1 + 1e-9)) continue;
            if (pass) s->box[s->box_start[at + 1]++] = c;
            else s->box_start[at + 2]++;
          }
    }
    if (!pass) {
      for (PetscInt b = 0; b < total; b++) s->box_start[b + 2] += s->box_start[b + 1];
      PetscCall(PetscMalloc1(s->box_start[total + 1], &s->box));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
