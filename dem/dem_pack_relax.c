/*
  dem_pack_relax.c - minimise the gap functional Psi over centres and radii.  Eqs (3.4)-(3.6), docs/theory.md

  Each sweep moves every sphere along its own gradient, from the old positions of all others, with some momentum; the
  sums over neighbours have a fixed order, so the result is the same bits for any number of threads. A wall is a
  neighbour whose gap is distance - r. The last sweeps keep the outermost spheres exactly tangent.
*/
#include "dem_pack_impl.h"

#define SWEEPS 120      /* by default */
#define REFRESH 6       /* sweeps between neighbour searches */
#define OVERLAP_CAP 0.2 /* (r_i + r_j): more sweeps, up to MORE_SWEEPS, while a pair overlaps by more */
#define FEW 2000        /* particles that are not worth waking threads for */
#define MORE_SWEEPS 240
#define SEAT_TOUCH 0.9 /* a sphere in a corner reaches this far for its walls */

typedef struct {
  PetscReal near, far; /* a gap below near counts in full, beyond far not at all */
  PetscReal step, momentum, grow, hold;
  PetscReal wall_far; /* walls attract up to this gap */
  PetscReal stiff;    /* an overlap counts 1 + (stiff gap)^2 fold */
  PetscReal touch;    /* a sphere nearer to a wall than (1 + touch) r is set against it */
} Tune;

PetscErrorCode DemPackNeighbours(PetscInt dim, PetscInt n, const PetscReal *x, const PetscReal *r, PetscReal reach, PetscInt **start, PetscInt **nbr)
{
  PetscReal low[3], high[3], r_max = 0, width;
  PetscInt  m[3], cells = 1, *cell_start, *item, *cell;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 3; c++) {
    low[c] = PETSC_MAX_REAL;
    high[c] = -PETSC_MAX_REAL;
  }
  for (PetscInt p = 0; p < n; p++) {
    r_max = PetscMax(r_max, r[p]);
    for (PetscInt c = 0; c < 3; c++) {
      low[c] = PetscMin(low[c], x[3 * p + c]);
      high[c] = PetscMax(high[c], x[3 * p + c]);
    }
  }
  width = 2 * r_max * (1 + reach);
  for (PetscReal total = 9. * n + 65; total > 8. * n + 64; width *= total > 8. * n + 64 ? 1.2 : 1) {
    total = 1;
    for (PetscInt c = 0; c < 3; c++) total *= PetscFloorReal((high[c] - low[c]) / width) + 1;
  }
  for (PetscInt c = 0; c < 3; c++) {
    m[c] = (PetscInt)PetscFloorReal((high[c] - low[c]) / width) + 1;
    cells *= m[c];
  }
  PetscCall(PetscCalloc1(cells + 2, &cell_start));
  PetscCall(PetscMalloc1(n, &item));
  PetscCall(PetscMalloc1(n, &cell));
  for (PetscInt p = 0; p < n; p++) {
    PetscInt at[3];

    for (PetscInt c = 0; c < 3; c++) at[c] = PetscMin(m[c] - 1, (PetscInt)((x[3 * p + c] - low[c]) / width));
    cell[p] = (at[2] * m[1] + at[1]) * m[0] + at[0];
    cell_start[cell[p] + 2]++;
  }
  for (PetscInt c = 0; c < cells; c++) cell_start[c + 2] += cell_start[c + 1];
  for (PetscInt p = 0; p < n; p++) item[cell_start[cell[p] + 1]++] = p;
  PetscCall(PetscCalloc1(n + 1, start));
  for (PetscInt pass = 0; pass < 2; pass++) {
#pragma omp parallel for schedule(static) if (n > FEW)
    for (PetscInt p = 0; p < n; p++) {
      PetscInt at[3], lo[3], hi[3], k = pass ? (*start)[p] : 0;

      at[0] = cell[p] % m[0];
      at[1] = cell[p] / m[0] % m[1];
      at[2] = cell[p] / m[0] / m[1];
      for (PetscInt c = 0; c < 3; c++) {
        lo[c] = PetscMax(0, at[c] - 1);
        hi[c] = PetscMin(m[c] - 1, at[c] + 1);
      }
      for (PetscInt z = lo[2]; z <= hi[2]; z++)
        for (PetscInt y = lo[1]; y <= hi[1]; y++) {
          const PetscInt row = (z * m[1] + y) * m[0];

          for (PetscInt j = cell_start[row + lo[0]]; j < cell_start[row + hi[0] + 1]; j++) {
            const PetscInt  q = item[j];
            const PetscReal d = (1 + reach) * (r[p] + r[q]);

            if (q == p || PetscSqr(x[3 * q] - x[3 * p]) + PetscSqr(x[3 * q + 1] - x[3 * p + 1]) + PetscSqr(x[3 * q + 2] - x[3 * p + 2]) > d * d) continue;
            if (pass) (*nbr)[k] = q;
            k++;
          }
        }
      if (!pass) (*start)[p + 1] = k;
    }
    if (!pass) {
      for (PetscInt p = 0; p < n; p++) (*start)[p + 1] += (*start)[p];
      PetscCall(PetscMalloc1((*start)[n] + 1, nbr));
    }
  }
  PetscCall(PetscFree(cell_start));
  PetscCall(PetscFree(item));
  PetscCall(PetscFree(cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscReal Weight(const Tune *t, PetscReal gap, PetscReal far)
{
  if (gap < 0) return 1 + PetscSqr(t->stiff * gap);
  return gap <= t->near ? 1 : (gap >= far ? 0 : (far - gap) / (far - t->near));
}

/* Set a sphere against the walls it nearly touches: least move with n . dx = r - distance for the nearest wall and for
   others at a clear angle to it. Returns what is missing to the nearest wall, relative to r (0 when all touch). */
static PetscReal SetAgainstWalls(const DemBodySearch *search, PetscReal touch, PetscReal x[3], PetscReal r)
{
  const PetscInt dim = search->body->dim;
  PetscReal      miss = 0;

  for (PetscInt pass = 0; pass < 30; pass++) {
    DemWall        wall[DEM_MAX_WALLS];
    const PetscInt n = DemBodySearchWalls(search, x, PetscMin(search->reach, (1 + touch) * r), wall);
    PetscReal      basis[3][3], move[3] = {0, 0, 0};
    PetscInt       rank = 0;

    miss = 0;
    for (PetscInt k = 0; k < n && rank < dim; k++) { /* Gram-Schmidt: each wall corrects what the nearer ones leave */
      PetscReal rest[3], left = 0, want = r - wall[k].distance;

      for (PetscInt c = 0; c < 3; c++) rest[c] = wall[k].inward[c];
      for (PetscInt b = 0; b < rank; b++) {
        PetscReal along = 0;

        for (PetscInt c = 0; c < 3; c++) along += rest[c] * basis[b][c];
        for (PetscInt c = 0; c < 3; c++) rest[c] -= along * basis[b][c];
      }
      for (PetscInt c = 0; c < 3; c++) left += rest[c] * rest[c];
      if (left < 0.1 || (rank > 0 && !wall[k].flat)) { /* nearly parallel, or a re-entrant edge: only a limit; the pass that finds it nearest obeys it */
        miss = PetscMax(miss, want / r);
        continue;
      }
      for (PetscInt c = 0; c < 3; c++) want -= move[c] * wall[k].inward[c];
      for (PetscInt c = 0; c < 3; c++) move[c] += want / left * rest[c];
      for (PetscInt c = 0; c < 3; c++) basis[rank][c] = rest[c] / PetscSqrtReal(left);
      miss = PetscMax(miss, PetscAbsReal(r - wall[k].distance) / r);
      rank++;
    }
    if (miss < 1e-13) break;
    for (PetscInt c = 0; c < dim; c++) x[c] += move[c];
  }
  return miss;
}

/* A sphere squeezed between walls gives way by its radius, as far as it may. */
static PetscErrorCode CheckWalls(const DemBodySearch *search, PetscInt n, const PetscReal *target, const PetscReal *x, PetscReal *r)
{
  PetscFunctionBegin;
  for (PetscInt p = 0; p < n; p++) {
    DemWall wall[DEM_MAX_WALLS];

    if (!DemBodySearchWalls(search, &x[3 * p], r[p], wall) || wall[0].distance > r[p] * (1 - 1e-9)) continue;
    BaseCheckInput(wall[0].distance >= 0.5 * target[p], PETSC_COMM_SELF,
                   "The body is narrower at (%.6g, %.6g, %.6g) m than a particle of radius %.6g m that must lie there; ask for smaller particles", (double)x[3 * p],
                   (double)x[3 * p + 1], (double)x[3 * p + 2], (double)r[p]);
    r[p] = wall[0].distance;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal LargestOverlap(PetscInt n, const PetscInt *start, const PetscInt *nbr, const PetscReal *x, const PetscReal *r)
{
  PetscReal least = 0;

#pragma omp parallel for schedule(static) if (n > FEW) reduction(min : least)
  for (PetscInt p = 0; p < n; p++)
    for (PetscInt k = start[p]; k < start[p + 1]; k++) {
      const PetscInt  q = nbr[k];
      const PetscReal d = PetscSqrtReal(PetscSqr(x[3 * q] - x[3 * p]) + PetscSqr(x[3 * q + 1] - x[3 * p + 1]) + PetscSqr(x[3 * q + 2] - x[3 * p + 2]));

      least = PetscMin(least, d / (r[p] + r[q]) - 1);
    }
  return -least;
}

PetscErrorCode DemPackRelax(const DemBodySearch *search, PetscInt n, PetscReal radius, PetscInt iterations, const PetscBool *seated, PetscReal *x, PetscReal *r)
{
  const PetscInt dim = search->body->dim;
  const Tune     t = {.near = 0.15, .far = 0.35, .step = 0.5, .momentum = 0.8, .grow = 0.1, .hold = 0.15, .wall_far = 1.0, .touch = 0.35, .stiff = 15};
  PetscReal     *y, *s, *v, *target;
  PetscInt      *start = NULL, *nbr = NULL;
  PetscBool     *outer;
  PetscErrorCode code;

  PetscFunctionBegin;
  iterations = REFRESH * ((iterations > 0 ? iterations : SWEEPS) / REFRESH + 1);
  PetscCall(PetscMalloc1(3 * n, &y));
  PetscCall(PetscMalloc1(n, &s));
  PetscCall(PetscCalloc1(3 * n, &v));
  PetscCall(PetscMalloc1(n, &target));
  PetscCall(PetscMalloc1(n, &outer));
  PetscCall(PetscArraycpy(target, r, n));
  for (PetscInt sweep = 0; sweep < iterations + MORE_SWEEPS; sweep++) {
    const PetscBool rigid = sweep >= iterations / 2 ? PETSC_TRUE : PETSC_FALSE;
    PetscReal       sum = 0;

    if (sweep % REFRESH == 0) {
      PetscCall(PetscFree(start));
      PetscCall(PetscFree(nbr));
      PetscCall(DemPackNeighbours(dim, n, x, r, t.far + 0.1, &start, &nbr));
      if (sweep >= iterations && LargestOverlap(n, start, nbr, x, r) < OVERLAP_CAP) break;
#pragma omp parallel for schedule(static) if (n > FEW)
      for (PetscInt p = 0; p < n; p++) {
        DemWall wall[DEM_MAX_WALLS];

        outer[p] = DemBodySearchWalls(search, &x[3 * p], PetscMin(search->reach, (1.3 + t.wall_far) * r[p]), wall) > 0 ? PETSC_TRUE : PETSC_FALSE;
      }
    }
#pragma omp parallel for schedule(static) if (n > FEW)
    for (PetscInt p = 0; p < n; p++) {
      PetscReal F[3] = {0, 0, 0}, W = 0, G = 0, longest = 0;

      for (PetscInt k = start[p]; k < start[p + 1]; k++) {
        const PetscInt  q = nbr[k];
        const PetscReal d[3] = {x[3 * q] - x[3 * p], x[3 * q + 1] - x[3 * p + 1], x[3 * q + 2] - x[3 * p + 2]};
        const PetscReal len = PetscSqrtReal(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), reach = r[p] + r[q], gap = (len - reach) / reach,
                        w = Weight(&t, gap, t.far);

        for (PetscInt c = 0; c < 3; c++) F[c] += w * gap * d[c] / PetscMax(len, 1e-3 * reach);
        W += w;
        G += w * gap;
      }
      if (outer[p]) {
        DemWall        wall[DEM_MAX_WALLS];
        const PetscInt m = DemBodySearchWalls(search, &x[3 * p], PetscMin(search->reach, (1 + t.wall_far) * r[p]), wall);

        for (PetscInt k = 0; k < m; k++) {
          const PetscReal gap = (wall[k].distance - r[p]) / r[p], w = 2 * Weight(&t, gap, t.wall_far);

          if (k > 0 && gap > 0 && !wall[k].flat) continue; /* no need to touch two re-entrant edges */
          for (PetscInt c = 0; c < 3; c++) F[c] -= w * gap * wall[k].inward[c];
          W += w;
          G += w * gap;
        }
      }
      for (PetscInt c = 0; c < 3; c++) {
        v[3 * p + c] = t.momentum * v[3 * p + c] + t.step * dim * r[p] * F[c] / PetscMax(W, 1);
        longest = PetscMax(longest, PetscAbsReal(v[3 * p + c]));
      }
      for (PetscInt c = 0; c < 3; c++) y[3 * p + c] = x[3 * p + c] + v[3 * p + c] * PetscMin(1, 0.3 * r[p] / PetscMax(longest, 1e-300));
      s[p] = r[p] * (1 + t.grow * G / PetscMax(W, 1)) + t.hold * t.grow * (target[p] - r[p]);
      s[p] = PetscMin(1.25 * target[p], PetscMax(0.8 * target[p], s[p]));
    }
    for (PetscInt p = 0; p < n; p++) sum += s[p];
    for (PetscInt p = 0; p < n; p++) s[p] *= radius * n / sum;
#pragma omp parallel for schedule(static) if (n > FEW)
    for (PetscInt p = 0; p < n; p++) {
      r[p] = s[p];
      if (outer[p] && (rigid || seated[p])) {
        SetAgainstWalls(search, seated[p] ? SEAT_TOUCH : t.touch, &y[3 * p], r[p]);
      } else if (outer[p]) { /* springs hold the rest; none comes nearer than half a radius */
        DemWall        wall[DEM_MAX_WALLS];
        const PetscInt m = DemBodySearchWalls(search, &y[3 * p], 0.5 * r[p], wall);

        for (PetscInt k = 0; k < m; k++)
          for (PetscInt c = 0; c < 3; c++) y[3 * p + c] += (0.5 * r[p] - wall[k].distance) * wall[k].inward[c];
      }
      if (outer[p] && !DemBodySearchInside(search, &y[3 * p])) { /* a thin part: stay, try again from rest */
        for (PetscInt c = 0; c < 3; c++) v[3 * p + c] = 0;
      } else {
        for (PetscInt c = 0; c < 3; c++) x[3 * p + c] = y[3 * p + c];
      }
    }
  }
  code = CheckWalls(search, n, target, x, r);
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(nbr));
  PetscCall(PetscFree(y));
  PetscCall(PetscFree(s));
  PetscCall(PetscFree(v));
  PetscCall(PetscFree(target));
  PetscCall(PetscFree(outer));
  PetscCall(code);
  PetscFunctionReturn(PETSC_SUCCESS);
}
