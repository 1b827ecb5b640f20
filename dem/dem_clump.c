/*
  dem_clump.c - volume, centre and moments of inertia of a union of spheres, and clumps laid into spheres.  Eqs (5.90)-(5.94)

  The divergence theorem makes each moment an integral over the part of every sphere that no other one covers. At a height z
  that part is a set of arcs, whose ends are known in closed form; between the heights where arcs appear, meet or vanish
  the integrand is smooth in an angle (Chebyshev's substitution), so Gauss points reach rounding with a few dozen.
*/
#include "dem_clump.h"
#include "dem_pack_impl.h"
#include <petscblaslapack.h>
#include <petscdt.h>

#define ARC_POINTS   12 /* on at most a quarter of a circle: exact to rounding for what is of degree 4 in sine and cosine */
#define LEVEL_POINTS 24
#define SAME_LEVEL   1e-9 /* of a radius; what lies between weighs 1e-13 of the sphere */
#define MOST_SPHERES 100
#define STREAM_TURN  30 /* of DemPackRandom */

typedef struct {
  PetscReal from, to;
} Arc;

typedef struct {
  PetscInt         n;
  const PetscReal *x, *r;
  PetscReal        point[ARC_POINTS], weight[ARC_POINTS];     /* on [0, 1] */
  PetscReal        height[LEVEL_POINTS], layer[LEVEL_POINTS]; /* on [-1, 1], ends excluded */
  PetscReal       *level;   /* heights where sphere i's arcs change */
  Arc             *covered; /* [2 n] */
  PetscReal        sum[10]; /* volume, x y z, xx yy zz xy yz zx */
} Union;

static int CompareReals(const void *a, const void *b)
{
  const PetscReal x = *(const PetscReal *)a, y = *(const PetscReal *)b;

  return x < y ? -1 : x > y;
}

/* One arc of sphere i at height z; w the weight of the level.  n dA = (rho cos, rho sin, z - z_i) dphi dz.  Eq. (5.91) */
static void AddArc(Union *u, PetscInt i, PetscReal z, PetscReal w, PetscReal from, PetscReal to)
{
  const PetscReal *c = &u->x[3 * i], rho = PetscSqrtReal(PetscMax(0, (u->r[i] - (z - c[2])) * (u->r[i] + (z - c[2]))));
  const PetscInt   parts = 1 + (PetscInt)((to - from) / (0.5 * PETSC_PI));

  for (PetscInt p = 0; p < parts; p++)
    for (PetscInt k = 0; k < ARC_POINTS; k++) {
      const PetscReal phi = from + (to - from) * ((PetscReal)p + u->point[k]) / (PetscReal)parts, dphi = w * u->weight[k] * (to - from) / (PetscReal)parts;
      const PetscReal n[3] = {rho * PetscCosReal(phi) * dphi, rho * PetscSinReal(phi) * dphi, (z - c[2]) * dphi}, x[3] = {c[0] + rho * PetscCosReal(phi), c[1] + rho * PetscSinReal(phi), z};

      for (PetscInt d = 0; d < 3; d++) {
        u->sum[0] += x[d] * n[d] / 3;
        u->sum[1 + d] += 0.5 * x[d] * x[d] * n[d];
        u->sum[4 + d] += x[d] * x[d] * x[d] * n[d] / 3;
        u->sum[7 + d] += 0.5 * x[d] * x[d] * x[(d + 1) % 3] * n[d];
      }
    }
}

/* The circle of sphere i at height z, without what other spheres cover. */
static void AddLevel(Union *u, PetscInt i, PetscReal z, PetscReal w)
{
  const PetscReal *c = &u->x[3 * i], rho2 = (u->r[i] - (z - c[2])) * (u->r[i] + (z - c[2])), rho = PetscSqrtReal(PetscMax(0, rho2));
  PetscInt         m = 0;
  PetscReal        at = 0;

  for (PetscInt j = 0; j < u->n; j++) {
    const PetscReal *e = &u->x[3 * j], dx = e[0] - c[0], dy = e[1] - c[1], d = PetscSqrtReal(dx * dx + dy * dy), other2 = (u->r[j] - (z - e[2])) * (u->r[j] + (z - e[2]));
    PetscReal        cosine, middle, half;

    if (j == i || other2 <= 0) continue;
    if (d * rho <= 1e-14 * u->r[i] * u->r[i]) { /* one axis */
      if (PetscSqr(rho - d) < other2) return;
      continue;
    }
    cosine = (rho2 + d * d - other2) / (2 * rho * d);
    if (cosine <= -1) return;
    if (cosine >= 1) continue;
    middle = PetscAtan2Real(dy, dx);
    half   = PetscAcosReal(cosine);
    if (middle < 0) middle += 2 * PETSC_PI;
    u->covered[m++] = (Arc){PetscMax(0, middle - half), PetscMin(2 * PETSC_PI, middle + half)};
    if (middle - half < 0) u->covered[m++] = (Arc){middle - half + 2 * PETSC_PI, 2 * PETSC_PI};
    if (middle + half > 2 * PETSC_PI) u->covered[m++] = (Arc){0, middle + half - 2 * PETSC_PI};
  }
  qsort(u->covered, (size_t)m, sizeof(Arc), CompareReals); /* by their beginnings */
  for (PetscInt k = 0; k < m; k++) {
    if (u->covered[k].from > at) AddArc(u, i, z, w, at, u->covered[k].from);
    at = PetscMax(at, u->covered[k].to);
  }
  if (at < 2 * PETSC_PI) AddArc(u, i, z, w, at, 2 * PETSC_PI);
}

/* Heights of the one or two points that three spheres share. */
static PetscInt Shared(const Union *u, PetscInt i, PetscInt j, PetscInt k, PetscReal z[2])
{
  const PetscReal *a = &u->x[3 * i], *b = &u->x[3 * j], *c = &u->x[3 * k];
  PetscReal        p[3], q[3], n[3], pp = 0, pq = 0, qq = 0, nn = 0, fp, fq, s, t, h2;

  for (PetscInt d = 0; d < 3; d++) {
    p[d] = b[d] - a[d];
    q[d] = c[d] - a[d];
    pp += p[d] * p[d];
    pq += p[d] * q[d];
    qq += q[d] * q[d];
  }
  for (PetscInt d = 0; d < 3; d++) {
    n[d] = p[(d + 1) % 3] * q[(d + 2) % 3] - p[(d + 2) % 3] * q[(d + 1) % 3];
    nn += n[d] * n[d];
  }
  if (nn <= 1e-24 * pp * qq) return 0;
  fp = 0.5 * (pp + u->r[i] * u->r[i] - u->r[j] * u->r[j]); /* x.p = fp and x.q = fq, x from a */
  fq = 0.5 * (qq + u->r[i] * u->r[i] - u->r[k] * u->r[k]);
  s  = (fp * qq - fq * pq) / nn;
  t  = (fq * pp - fp * pq) / nn;
  h2 = u->r[i] * u->r[i] - (s * s * pp + 2 * s * t * pq + t * t * qq);
  if (h2 < 0) return 0;
  z[0] = a[2] + s * p[2] + t * q[2] + PetscSqrtReal(h2 / nn) * n[2];
  z[1] = a[2] + s * p[2] + t * q[2] - PetscSqrtReal(h2 / nn) * n[2];
  return 2;
}

/* Halves layers until none is more than four times as thick as one beside it: a kink just outside a layer spoils it as one inside would. */
static PetscInt Graded(PetscInt n, PetscReal *z)
{
  for (PetscInt k = 0; k + 1 < n;) {
    const PetscReal thick = z[k + 1] - z[k], below = k > 0 ? z[k] - z[k - 1] : thick, above = k + 2 < n ? z[k + 2] - z[k + 1] : thick;

    if (thick <= 4 * PetscMin(below, above)) {
      k++;
      continue;
    }
    for (PetscInt l = n; l > k + 1; l--) z[l] = z[l - 1];
    z[k + 1] = z[k] + 0.5 * thick;
    n++;
    k = PetscMax(0, k - 1);
  }
  return n;
}

/* Heights between which sphere i's arcs change smoothly: ends of spheres, of the circles it shares, and points of three. */
static PetscInt Levels(Union *u, PetscInt i)
{
  const PetscReal *a = &u->x[3 * i], low = a[2] - u->r[i], high = a[2] + u->r[i];
  PetscInt         m = 0, kept = 1;
  PetscReal       *z = u->level;

  z[m++] = low;
  z[m++] = high;
  for (PetscInt j = 0; j < u->n; j++) {
    const PetscReal *b = &u->x[3 * j];
    PetscReal        D = 0, h, circle;

    if (j == i) continue;
    z[m++] = b[2] - u->r[j];
    z[m++] = b[2] + u->r[j];
    for (PetscInt d = 0; d < 3; d++) D += PetscSqr(b[d] - a[d]);
    D = PetscSqrtReal(D);
    if (D <= 0) continue;
    h      = 0.5 * (D * D + u->r[i] * u->r[i] - u->r[j] * u->r[j]) / D;
    circle = u->r[i] * u->r[i] - h * h;
    if (circle > 0) {
      const PetscReal nz = (b[2] - a[2]) / D, extent = PetscSqrtReal(circle * PetscMax(0, 1 - nz * nz));

      z[m++] = a[2] + h * nz + extent;
      z[m++] = a[2] + h * nz - extent;
    }
    for (PetscInt k = j + 1; k < u->n; k++)
      if (k != i) m += Shared(u, i, j, k, &z[m]);
  }
  qsort(z, (size_t)m, sizeof(*z), CompareReals);
  for (PetscInt k = 0; k < m; k++) z[k] = PetscMin(high, PetscMax(low, z[k]));
  for (PetscInt k = 1; k < m; k++)
    if (z[k] > z[kept - 1] + SAME_LEVEL * u->r[i]) z[kept++] = z[k];
  return Graded(kept, z);
}

/* Spheres within others count for nothing; of two equal ones the first stays. */
static PetscInt LeaveOutHidden(PetscInt n, const PetscReal x[], const PetscReal r[], PetscReal *kept_x, PetscReal *kept_r)
{
  PetscInt kept = 0;

  for (PetscInt i = 0; i < n; i++) {
    PetscBool hidden = PETSC_FALSE;

    for (PetscInt j = 0; j < n && !hidden; j++) {
      const PetscReal D = PetscSqrtReal(PetscSqr(x[3 * i] - x[3 * j]) + PetscSqr(x[3 * i + 1] - x[3 * j + 1]) + PetscSqr(x[3 * i + 2] - x[3 * j + 2]));

      if (j != i && D + r[i] <= r[j] * (1 + 1e-14)) hidden = (PetscBool)(r[i] < r[j] || j < i || D > 0);
    }
    if (hidden) continue;
    for (PetscInt d = 0; d < 3; d++) kept_x[3 * kept + d] = x[3 * i + d];
    kept_r[kept++] = r[i];
  }
  return kept;
}

PetscErrorCode DemUnionMoments(PetscInt n, const PetscReal x[], const PetscReal r[], PetscReal *volume, PetscReal first[3], PetscReal second[3][3])
{
  Union      u = {0};
  PetscReal *kept_x, *kept_r;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(3 * n, &kept_x, n, &kept_r, 64 * (4 + 4 * n + n * n), &u.level, 2 * n + 2, &u.covered));
  u.n = LeaveOutHidden(n, x, r, kept_x, kept_r);
  u.x = kept_x;
  u.r = kept_r;
  PetscCall(PetscDTGaussQuadrature(ARC_POINTS, 0, 1, u.point, u.weight));
  PetscCall(PetscDTGaussQuadrature(LEVEL_POINTS, 0, PETSC_PI, u.height, u.layer));
  for (PetscInt k = 0; k < LEVEL_POINTS; k++) {
    u.layer[k] *= PetscSinReal(u.height[k]);
    u.height[k] = -PetscCosReal(u.height[k]);
  }
  for (PetscInt i = 0; i < u.n; i++) {
    const PetscInt levels = Levels(&u, i);

    for (PetscInt l = 1; l < levels; l++) {
      const PetscReal middle = 0.5 * (u.level[l] + u.level[l - 1]), half = 0.5 * (u.level[l] - u.level[l - 1]);

      for (PetscInt k = 0; k < LEVEL_POINTS; k++) AddLevel(&u, i, middle + half * u.height[k], half * u.layer[k]);
    }
  }
  *volume = u.sum[0];
  for (PetscInt d = 0; d < 3; d++) {
    first[d]     = u.sum[1 + d];
    second[d][d] = u.sum[4 + d];
    second[d][(d + 1) % 3] = second[(d + 1) % 3][d] = u.sum[7 + d];
  }
  PetscCall(PetscFree4(kept_x, kept_r, u.level, u.covered));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Copy(PetscInt n, const PetscReal x[], const PetscReal r[], const PetscReal centre[3], DemClump *clump)
{
  PetscFunctionBegin;
  clump->n = n;
  PetscCall(PetscMalloc1(3 * n, &clump->x));
  PetscCall(PetscMalloc1(n, &clump->r));
  clump->reach = 0;
  for (PetscInt i = 0; i < n; i++) {
    PetscReal d2 = 0;

    for (PetscInt d = 0; d < 3; d++) {
      clump->x[3 * i + d] = x[3 * i + d] - centre[d];
      d2 += PetscSqr(clump->x[3 * i + d]);
    }
    clump->r[i]  = r[i];
    clump->reach = PetscMax(clump->reach, PetscSqrtReal(d2) + r[i]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckSpheres(PetscInt n, const PetscReal r[])
{
  PetscFunctionBegin;
  BaseCheckInput(n >= 1 && n <= MOST_SPHERES, PETSC_COMM_SELF, "A clump has between 1 and %d spheres, not %" PetscInt_FMT, MOST_SPHERES, n);
  for (PetscInt i = 0; i < n; i++) BaseCheckInput(r[i] > 0 && !PetscIsInfOrNanReal(r[i]), PETSC_COMM_SELF, "Sphere %" PetscInt_FMT " of the clump has the radius %.6g m; it must be positive", i + 1, (double)r[i]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemClumpCreate(PetscInt n, const PetscReal x[], const PetscReal r[], DemClump *clump)
{
  PetscReal    first[3], second[3][3], centre[3], trace, a[9], work[16];
  PetscBLASInt three = 3, size = 16, info;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(clump, sizeof(*clump)));
  PetscCall(CheckSpheres(n, r));
  PetscCall(DemUnionMoments(n, x, r, &clump->volume, first, second));
  for (PetscInt d = 0; d < 3; d++) centre[d] = first[d] / clump->volume;
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) second[i][j] -= clump->volume * centre[i] * centre[j];
  trace = second[0][0] + second[1][1] + second[2][2];
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) a[3 * i + j] = (i == j ? trace : 0) - second[i][j];
  PetscCallBLAS("LAPACKsyev", LAPACKsyev_("V", "U", &three, a, &three, clump->moments, work, &size, &info));
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev failed (%d) on the inertia of a clump", (int)info);
  for (PetscInt d = 0; d < 3; d++) { /* columns; the third makes them right-handed */
    clump->axes[d][0] = a[d];
    clump->axes[d][1] = a[3 + d];
    clump->axes[d][2] = a[(d + 1) % 3] * a[3 + (d + 2) % 3] - a[(d + 2) % 3] * a[3 + (d + 1) % 3];
  }
  PetscCall(Copy(n, x, r, centre, clump));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemClumpCreateGiven(PetscInt n, const PetscReal x[], const PetscReal r[], PetscReal mass, const PetscReal centre[3], const PetscReal moments[3], DemClump *clump)
{
  PetscReal first[3], second[3][3];

  PetscFunctionBegin;
  PetscCall(PetscMemzero(clump, sizeof(*clump)));
  PetscCall(CheckSpheres(n, r));
  BaseCheckInput(mass > 0, PETSC_COMM_SELF, "The clump's mass, %.6g kg, must be positive", (double)mass);
  for (PetscInt d = 0; d < 3; d++)
    BaseCheckInput(moments[d] > 0 && moments[d] <= (moments[(d + 1) % 3] + moments[(d + 2) % 3]) * (1 + 1e-9), PETSC_COMM_SELF,
                   "Moments of inertia %.6g, %.6g and %.6g kg m2 belong to no body: each must be positive and none larger than the sum of the others", (double)moments[0], (double)moments[1], (double)moments[2]);
  PetscCall(DemUnionMoments(n, x, r, &clump->volume, first, second));
  clump->mass = mass;
  for (PetscInt d = 0; d < 3; d++) {
    clump->moments[d] = moments[d];
    clump->axes[d][d] = 1;
  }
  PetscCall(Copy(n, x, r, centre, clump));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemClumpDestroy(DemClump *clump)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(clump->x));
  PetscCall(PetscFree(clump->r));
  PetscCall(PetscMemzero(clump, sizeof(*clump)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Uniform over all rotations (Shoemake, Graphics Gems III (1992) 124).  Eq. (5.94) */
static void AnyTurn(PetscInt seed, PetscInt k, PetscReal q[4])
{
  const PetscReal a = DemPackRandom(seed, STREAM_TURN, k), b = 2 * PETSC_PI * DemPackRandom(seed, STREAM_TURN + 1, k), c = 2 * PETSC_PI * DemPackRandom(seed, STREAM_TURN + 2, k);

  q[0] = PetscSqrtReal(a) * PetscCosReal(c);
  q[1] = PetscSqrtReal(1 - a) * PetscSinReal(b);
  q[2] = PetscSqrtReal(1 - a) * PetscCosReal(b);
  q[3] = PetscSqrtReal(a) * PetscSinReal(c);
}

PetscErrorCode DemPackingMakeClumps(const DemPacking *balls, const DemClump *shape, PetscBool random, PetscInt seed, DemPacking *members, DemClumpPlace **place)
{
  PetscFunctionBegin;
  PetscCall(PetscMemzero(members, sizeof(*members)));
  members->n = balls->n * shape->n;
  PetscCall(PetscMalloc1(3 * members->n, &members->x));
  PetscCall(PetscMalloc1(members->n, &members->r));
  PetscCall(PetscMalloc1(balls->n, place));
  for (PetscInt k = 0; k < balls->n; k++) {
    DemClumpPlace *p = &(*place)[k];

    *p = (DemClumpPlace){.shape = shape, .first = k * shape->n, .scale = balls->r[k] / shape->reach, .quaternion = {1, 0, 0, 0}};
    for (PetscInt d = 0; d < 3; d++) p->centre[d] = balls->x[3 * k + d];
    if (random) AnyTurn(seed, k, p->quaternion);
    for (PetscInt i = 0; i < shape->n; i++) { /* x + 2 w (v x x) + 2 v x (v x x) */
      const PetscReal *b = &shape->x[3 * i], *q = p->quaternion;
      const PetscReal  t[3] = {2 * (q[2] * b[2] - q[3] * b[1]), 2 * (q[3] * b[0] - q[1] * b[2]), 2 * (q[1] * b[1] - q[2] * b[0])};

      for (PetscInt d = 0; d < 3; d++)
        members->x[3 * (p->first + i) + d] = p->centre[d] + p->scale * (b[d] + q[0] * t[d] + q[1 + (d + 1) % 3] * t[(d + 2) % 3] - q[1 + (d + 2) % 3] * t[(d + 1) % 3]);
      members->r[p->first + i] = p->scale * shape->r[i];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
