/*
  dem_pack_start.c - where the spheres begin.

  A close-packed lattice, turned and shifted at random, has the right number of points everywhere; shaken by a good part
  of its spacing it has no order left that the relaxation would keep. The lattice's spacing is adjusted until it holds
  the wanted number of points inside the body, set back a little from the boundary because the outermost spheres
  will stand one radius off the wall while layers inside are 0.8 of a diameter apart.
*/
#include "dem_pack_impl.h"
#include <stdlib.h>

#define SET_BACK 0.2 /* radii */
#define SHAKE 0.4    /* spacings, each way along each axis */
#define TRIES 40
#define MAX_CORNERS 500 /* a body with more sharp corners is left to the relaxation */

PetscReal DemPackRandom(PetscInt seed, PetscInt stream, PetscInt64 k)
{
  unsigned long long z = (unsigned long long)seed * 0xD1342543DE82EF95ULL + (unsigned long long)stream * 0x2545F4914F6CDD1DULL +
                         (unsigned long long)k * 0x9E3779B97F4A7C15ULL + 0x9E3779B97F4A7C15ULL;

  for (int pass = 0; pass < 2; pass++) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    z ^= z >> 31;
  }
  return (PetscReal)(z >> 11) / 9007199254740992.0;
}

/* A lattice: point (i, j, k) is origin + i b0 + j b1 + k b2. */
typedef struct {
  PetscReal origin[3], b[3][3], spacing;
} Lattice;

static void LatticeMake(const DemBody *body, PetscReal spacing, PetscInt seed, PetscInt try, Lattice *l)
{
  static const PetscReal fcc[3][3] = {{0, 1, 1}, {1, 0, 1}, {1, 1, 0}};
  PetscReal              q[4], u[7];

  for (PetscInt k = 0; k < 7; k++) u[k] = DemPackRandom(seed, 1, 16 * (PetscInt64)try + k);
  l->spacing = spacing;
  if (body->dim == 2) {
    for (PetscInt k = 0; k < 2; k++) {
      const PetscReal a = PETSC_PI * (2 * u[0] + k / 3.);

      l->b[k][0] = spacing * PetscCosReal(a);
      l->b[k][1] = spacing * PetscSinReal(a);
      l->b[k][2] = 0;
    }
    l->b[2][0] = l->b[2][1] = 0;
    l->b[2][2] = 1;
  } else { /* a uniform random rotation from a random unit quaternion */
    q[0] = PetscSqrtReal(1 - u[0]) * PetscSinReal(2 * PETSC_PI * u[1]);
    q[1] = PetscSqrtReal(1 - u[0]) * PetscCosReal(2 * PETSC_PI * u[1]);
    q[2] = PetscSqrtReal(u[0]) * PetscSinReal(2 * PETSC_PI * u[2]);
    q[3] = PetscSqrtReal(u[0]) * PetscCosReal(2 * PETSC_PI * u[2]);
    {
      const PetscReal R[3][3] = {{1 - 2 * (q[1] * q[1] + q[2] * q[2]), 2 * (q[0] * q[1] - q[2] * q[3]), 2 * (q[0] * q[2] + q[1] * q[3])},
                                 {2 * (q[0] * q[1] + q[2] * q[3]), 1 - 2 * (q[0] * q[0] + q[2] * q[2]), 2 * (q[1] * q[2] - q[0] * q[3])},
                                 {2 * (q[0] * q[2] - q[1] * q[3]), 2 * (q[1] * q[2] + q[0] * q[3]), 1 - 2 * (q[0] * q[0] + q[1] * q[1])}};

      for (PetscInt k = 0; k < 3; k++)
        for (PetscInt c = 0; c < 3; c++) l->b[k][c] = spacing * PetscSqrtReal(0.5) * (R[c][0] * fcc[k][0] + R[c][1] * fcc[k][1] + R[c][2] * fcc[k][2]);
    }
  }
  for (PetscInt c = 0; c < 3; c++) {
    l->origin[c] = 0.5 * (body->low[c] + body->high[c]);
    for (PetscInt k = 0; k < body->dim; k++) l->origin[c] += (u[3 + k] - 0.5) * l->b[k][c];
  }
}

/* Inside, and off every wall by the set-back. */
static PetscBool Fits(const DemBodySearch *search, const PetscReal x[3], PetscReal back)
{
  DemWall wall[DEM_MAX_WALLS];

  return DemBodySearchInside(search, x) && !DemBodySearchWalls(search, x, back, wall) ? PETSC_TRUE : PETSC_FALSE;
}

/* Points of the lattice that fit; x [room][3] takes as many as it can, or NULL to count. */
static PetscInt LatticeFill(const DemBodySearch *search, const Lattice *l, PetscReal back, PetscInt room, PetscReal *x)
{
  const DemBody *body = search->body;
  const PetscInt dim = body->dim, last = dim - 1; /* rows run along b[last] */
  PetscReal      inv[3][3], det, lo[2] = {PETSC_MAX_REAL, PETSC_MAX_REAL}, hi[2] = {-PETSC_MAX_REAL, -PETSC_MAX_REAL};
  PetscInt       n = 0;

  det = 0;
  for (PetscInt c = 0; c < 3; c++) {
    const PetscInt d = (c + 1) % 3, e = (c + 2) % 3;

    for (PetscInt k = 0; k < 3; k++) {
      const PetscInt m = (k + 1) % 3, o = (k + 2) % 3;

      inv[k][c] = l->b[m][d] * l->b[o][e] - l->b[m][e] * l->b[o][d];
    }
    det += l->b[0][c] * inv[0][c];
  }
  for (PetscInt corner = 0; corner < 8; corner++)
    for (PetscInt k = 0; k < last; k++) {
      PetscReal s = 0;

      for (PetscInt c = 0; c < 3; c++) s += inv[k][c] / det * ((corner >> c & 1 ? body->high[c] : body->low[c]) - l->origin[c]);
      lo[k] = PetscMin(lo[k], s);
      hi[k] = PetscMax(hi[k], s);
    }
  for (PetscInt j = dim == 3 ? (PetscInt)PetscFloorReal(lo[1]) : 0; j <= (dim == 3 ? (PetscInt)PetscCeilReal(hi[1]) : 0); j++)
    for (PetscInt i = (PetscInt)PetscFloorReal(lo[0]); i <= (PetscInt)PetscCeilReal(hi[0]); i++) {
      PetscReal from = -1e9, to = 1e9, row[3];

      for (PetscInt c = 0; c < dim; c++) { /* where the row lies in the bounding box */
        const PetscReal step = l->b[last][c];

        row[c] = l->origin[c] + i * l->b[0][c] + (dim == 3 ? j * l->b[1][c] : 0);
        if (PetscAbsReal(step) < 1e-12 * l->spacing) {
          if (row[c] < body->low[c] || row[c] > body->high[c]) to = -2e9;
        } else {
          const PetscReal a = (body->low[c] - row[c]) / step, b = (body->high[c] - row[c]) / step;

          from = PetscMax(from, PetscMin(a, b));
          to = PetscMin(to, PetscMax(a, b));
        }
      }
      if (to < from) continue;
      for (PetscInt k = (PetscInt)PetscCeilReal(from); k <= (PetscInt)PetscFloorReal(to); k++) {
        PetscReal p[3] = {0, 0, 0};

        for (PetscInt c = 0; c < dim; c++) p[c] = row[c] + k * l->b[last][c];
        if (!Fits(search, p, back)) continue;
        if (x && n < room)
          for (PetscInt c = 0; c < 3; c++) x[3 * n + c] = p[c];
        n++;
      }
    }
  return n;
}

typedef struct {
  unsigned long long key;
  PetscInt           at;
} Place;

static int ComparePlaces(const void *a, const void *b)
{
  const Place *p = a, *q = b;

  return p->key != q->key ? (p->key > q->key ? 1 : -1) : (p->at > q->at) - (p->at < q->at);
}

/* Along a Morton curve, so that neighbours in space are neighbours in memory. */
static PetscErrorCode SortMorton(const DemBody *body, PetscReal width, PetscInt n, PetscReal *x)
{
  Place     *place;
  PetscReal *copy;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &place));
  PetscCall(PetscMalloc1(3 * n, &copy));
  PetscCall(PetscArraycpy(copy, x, 3 * n));
  for (PetscInt p = 0; p < n; p++) {
    place[p].key = 0;
    place[p].at = p;
    for (PetscInt c = 0; c < body->dim; c++) {
      const unsigned long long cell = (unsigned long long)PetscMax(0, (x[3 * p + c] - body->low[c]) / width);

      for (PetscInt bit = 0; bit < 21; bit++) place[p].key |= (cell >> bit & 1) << (body->dim * bit + c);
    }
  }
  qsort(place, n, sizeof(*place), ComparePlaces);
  for (PetscInt p = 0; p < n; p++)
    for (PetscInt c = 0; c < 3; c++) x[3 * p + c] = copy[3 * place[p].at + c];
  PetscCall(PetscFree(copy));
  PetscCall(PetscFree(place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A boundary node with the simplices around it. */
typedef struct {
  PetscInt node, simplex, local;
} Incidence;

static int CompareIncidences(const void *a, const void *b)
{
  const Incidence *i = a, *j = b;

  return i->node != j->node ? (i->node > j->node) - (i->node < j->node) : (i->simplex > j->simplex) - (i->simplex < j->simplex);
}

/* Where a sphere of radius r touches `dim` clearly different faces at a convex corner; false when the node is no such corner. */
static PetscBool CornerSeat(const DemBodySearch *search, PetscInt n, const Incidence *around, PetscReal r, PetscReal seat[3])
{
  const DemBody   *body = search->body;
  const PetscInt   dim = body->dim;
  const PetscReal *at = &body->simplex[3 * (dim * around[0].simplex + around[0].local)];
  PetscReal        basis[3][3];
  PetscInt         rank = 0;

  for (PetscInt c = 0; c < 3; c++) seat[c] = at[c];
  for (PetscInt k = 0; k < n; k++) {
    const unsigned char *bend = &search->bend[dim * around[k].simplex];
    const PetscInt       local = around[k].local;
    PetscReal            out[3], rest[3], left = 0, want = r;

    if (dim == 2 ? bend[local] & 1 : (bend[local] | bend[(local + 2) % 3]) & 2) return PETSC_FALSE;
    if (rank == dim) continue;
    DemBodyNormal(dim, &body->simplex[3 * dim * around[k].simplex], out);
    for (PetscInt c = 0; c < 3; c++) {
      rest[c] = -out[c];
      want += out[c] * (seat[c] - at[c]); /* distance still missing to this face */
    }
    for (PetscInt b = 0; b < rank; b++) {
      PetscReal along = 0;

      for (PetscInt c = 0; c < 3; c++) along += rest[c] * basis[b][c];
      for (PetscInt c = 0; c < 3; c++) rest[c] -= along * basis[b][c];
    }
    for (PetscInt c = 0; c < 3; c++) left += rest[c] * rest[c];
    if (left < 0.2) continue;
    for (PetscInt c = 0; c < 3; c++) {
      basis[rank][c] = rest[c] / PetscSqrtReal(left);
      seat[c] += want / left * rest[c];
    }
    rank++;
  }
  return rank == dim && DemBodySearchInside(search, seat) ? PETSC_TRUE : PETSC_FALSE;
}

/* Every sharp corner gets the sphere that is nearest to its seat; relaxation alone leaves one in ten empty. */
static PetscErrorCode SeatCorners(const DemBodySearch *search, PetscInt n, PetscReal radius, PetscReal *x, PetscBool *taken)
{
  const DemBody *body = search->body;
  const PetscInt m = body->dim * body->n_simplices;
  Incidence     *all;
  PetscInt       seated = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m, &all));
  PetscCall(PetscArrayzero(taken, n));
  for (PetscInt k = 0; k < m; k++) all[k] = (Incidence){.node = body->simplex_node[k], .simplex = k / body->dim, .local = k % body->dim};
  qsort(all, m, sizeof(*all), CompareIncidences);
  for (PetscInt k = 0, w; k < m && seated < MAX_CORNERS; k += w) {
    PetscReal seat[3], best = PetscSqr(2.5 * radius);
    PetscInt  nearest = -1;

    for (w = 1; k + w < m && all[k + w].node == all[k].node; w++) {
    }
    if (!CornerSeat(search, w, &all[k], radius, seat)) continue;
    seated++;
    for (PetscInt p = 0; p < n; p++) {
      const PetscReal d2 = PetscSqr(x[3 * p] - seat[0]) + PetscSqr(x[3 * p + 1] - seat[1]) + PetscSqr(x[3 * p + 2] - seat[2]);

      if (d2 < best && !taken[p]) {
        best = d2;
        nearest = p;
      }
    }
    if (nearest < 0) continue;
    taken[nearest] = PETSC_TRUE;
    for (PetscInt c = 0; c < 3; c++) x[3 * nearest + c] = seat[c];
    for (PetscInt p = 0; p < n; p++) { /* clear the corner around it */
      const PetscReal *node = &body->simplex[3 * (body->dim * all[k].simplex + all[k].local)];
      PetscReal        away[3], from = 0, len = 0;

      for (PetscInt c = 0; c < 3; c++) {
        away[c] = x[3 * p + c] - seat[c];
        from += away[c] * away[c];
      }
      if (taken[p] || from > PetscSqr(1.3 * radius)) continue;
      for (PetscInt c = 0; c < 3; c++) {
        away[c] += 2 * (seat[c] - node[c]);
        len += away[c] * away[c];
      }
      for (PetscInt c = 0; c < 3; c++) away[c] = seat[c] + 1.5 * radius / PetscSqrtReal(len) * away[c];
      if (DemBodySearchInside(search, away))
        for (PetscInt c = 0; c < 3; c++) x[3 * p + c] = away[c];
    }
  }
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemPackStart(const DemBodySearch *search, PetscInt n, PetscReal radius, PetscInt seed, PetscReal *x, PetscBool *seated)
{
  const DemBody *body = search->body;
  const PetscInt dim = body->dim;
  PetscReal      spacing, back = SET_BACK * radius, best_spacing = 0, best_back = 0, *all;
  PetscInt       best = PETSC_MAX_INT, best_try = -1;
  Lattice        lattice;

  PetscFunctionBegin;
  {
    const PetscReal volume = DemBodyVolume(body) / body->thickness;

    spacing = dim == 2 ? PetscSqrtReal(2 / PetscSqrtReal(3.) * volume / n) : PetscPowReal(PetscSqrtReal(2.) * volume / n, 1. / 3);
  }
  for (PetscInt try = 0; try < TRIES && best > n + n / 100 + 1; try++) {
    PetscInt m;

    LatticeMake(body, spacing, seed, try, &lattice);
    m = LatticeFill(search, &lattice, back, 0, NULL);
    if (m >= n && m < best) {
      best = m;
      best_try = try;
      best_spacing = spacing;
      best_back = back;
    }
    if (m == 0) {
      spacing *= 0.8;
      back *= 0.7; /* a body as thin as its spheres */
    } else {
      spacing *= PetscMin(1.25, PetscMax(0.8, PetscPowReal(m / (n * 1.001 + 0.3), 1. / dim)));
    }
  }
  BaseCheckInput(best_try >= 0, PETSC_COMM_SELF, "No room for %" PetscInt_FMT " particles of radius %.6g m in this body; ask for smaller ones", n,
                 (double)radius);
  PetscCall(PetscMalloc1(3 * best, &all));
  LatticeMake(body, best_spacing, seed, best_try, &lattice);
  LatticeFill(search, &lattice, best_back, best, all);
  for (PetscInt p = 0, left = 0; left < n; p++) { /* leave out the few too many, evenly */
    if ((PetscInt64)(p + 1) * n / best == (PetscInt64)p * n / best) continue;
    for (PetscInt c = 0; c < 3; c++) x[3 * left + c] = all[3 * p + c];
    left++;
  }
  PetscCall(PetscFree(all));
  PetscCall(SortMorton(body, 2 * best_spacing, n, x));
  for (PetscInt p = 0; p < n; p++) {
    PetscReal shake = 2 * SHAKE * best_spacing;

    for (PetscInt again = 0; again < 12; again++, shake *= 0.7) {
      PetscReal y[3] = {0, 0, 0};

      for (PetscInt c = 0; c < dim; c++) y[c] = x[3 * p + c] + shake * (DemPackRandom(seed, 2 + again, 3 * (PetscInt64)p + c) - 0.5);
      if (!Fits(search, y, best_back)) continue;
      for (PetscInt c = 0; c < 3; c++) x[3 * p + c] = y[c];
      break;
    }
  }
  PetscCall(SeatCorners(search, n, radius, x, seated));
  PetscFunctionReturn(PETSC_SUCCESS);
}
