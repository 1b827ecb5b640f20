/* dem_bonds2.c - the `exact` rule over a block's bonds in 2D: two displacements, one angle.  Eqs (4.2)-(4.7); see dem_bonds3.c */
#include "dem_impl.h"

/* Arms a, b and gap d of bond k between i and j of the copy; R holds sin and cos - 1. */
#define GAP(k, i, j) \
  const PetscReal px = arm[k], py = arm[n + k]; \
  const PetscReal qx = px - (X[j] - X[i]), qy = py - (X[wide + j] - X[wide + i]); \
  const PetscReal si = R[i], ci = R[wide + i], sj = R[j], cj = R[wide + j]; \
  PetscReal       ax = ci * px - si * py, ay = si * px + ci * py, bx = cj * qx - sj * qy, by = sj * qx + cj * qy; \
  const PetscReal dx = (U[j] - U[i]) + (bx - ax), dy = (U[wide + j] - U[wide + i]) + (by - ay); \
  ax += px; \
  ay += py; \
  bx += qx; \
  by += qy

void DemBondsSum2_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal *copy)
{
  const PetscInt           n = bonds->n;
  const PetscReal *restrict X = copy + DEM_COPY_X * wide, *restrict U = copy + DEM_COPY_U * wide, *restrict R = copy + DEM_COPY_R * wide;
  const PetscReal *restrict arm = bonds->arm, *restrict kk = bonds->now;
  const int *restrict ip = bonds->ip, *restrict iq = bonds->iq;
  PetscReal *restrict S = copy + DEM_COPY_S * wide;
  PetscReal sp[DEM_CHUNK], sq[DEM_CHUNK];

  for (PetscInt begin = first; begin < last; begin += DEM_CHUNK) {
    const PetscInt m = PetscMin(DEM_CHUNK, last - begin);

#pragma omp simd
    for (PetscInt c = 0; c < m; c++) {
      const PetscInt k = begin + c;
      const int      i = ip[k], j = iq[k];

      GAP(k, i, j);
      sp[c] = kk[k] * (dx * ax + dy * ay);
      sq[c] = kk[k] * (dx * bx + dy * by);
    }
    for (PetscInt c = 0; c < m; c++) {
      S[ip[begin + c]] += sp[c];
      S[iq[begin + c]] -= sq[c];
    }
  }
}

void DemBondsForce2_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal g2, PetscReal lambda, PetscReal *copy)
{
  const PetscInt           n = bonds->n;
  const PetscReal *restrict X = copy + DEM_COPY_X * wide, *restrict U = copy + DEM_COPY_U * wide, *restrict R = copy + DEM_COPY_R * wide;
  const PetscReal *restrict eps = copy + DEM_COPY_E * wide;
  const PetscReal *restrict arm = bonds->arm, *restrict kk = bonds->now, *restrict weight = bonds->weight;
  const int *restrict ip = bonds->ip, *restrict iq = bonds->iq;
  PetscReal *restrict F = copy + DEM_COPY_F * wide; /* [wide][8] */
  PetscReal t[4][DEM_CHUNK], g[DEM_CHUNK];

  for (PetscInt begin = first; begin < last; begin += DEM_CHUNK) {
    const PetscInt m = PetscMin(DEM_CHUNK, last - begin);

    if (weight)
      for (PetscInt c = 0; c < m; c++) g[c] = g2 * weight[begin + c];
    else
      for (PetscInt c = 0; c < m; c++) g[c] = g2;
#pragma omp simd
    for (PetscInt c = 0; c < m; c++) {
      const PetscInt k = begin + c;
      const int      i = ip[k], j = iq[k];

      GAP(k, i, j);
      const PetscReal gk = kk[k] * g[c], ep = kk[k] * lambda * eps[i], eq = kk[k] * lambda * eps[j];
      const PetscReal tx = gk * dx + ep * ax - eq * bx, ty = gk * dy + ep * ay - eq * by;

      t[0][c] = tx;
      t[1][c] = ty;
      t[2][c] = ax * (ty - ep * dy) - ay * (tx - ep * dx); /* a x (t - f_p), b x (t + f_q).  Eq. (4.7) */
      t[3][c] = bx * (ty - eq * dy) - by * (tx - eq * dx);
    }
    for (PetscInt c = 0; c < m; c++) {
      PetscReal *fp = F + 8 * ip[begin + c], *fq = F + 8 * iq[begin + c];

      fp[0] += t[0][c];
      fp[1] += t[1][c];
      fp[5] += t[2][c];
      fq[0] -= t[0][c];
      fq[1] -= t[1][c];
      fq[5] -= t[3][c];
    }
  }
}

PetscReal DemBondsEnergy2_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal g_shear, const PetscReal *copy)
{
  const PetscInt   n = bonds->n;
  const PetscReal *X = copy + DEM_COPY_X * wide, *U = copy + DEM_COPY_U * wide, *R = copy + DEM_COPY_R * wide;
  const PetscReal *arm = bonds->arm;
  PetscReal        sum = 0;

  for (PetscInt k = first; k < last; k++) {
    const int i = bonds->ip[k], j = bonds->iq[k];

    GAP(k, i, j);
    (void)ax, (void)ay, (void)bx, (void)by;
    sum += (bonds->weight ? bonds->weight[k] : 1) * g_shear * bonds->now[k] * (dx * dx + dy * dy);
  }
  return sum;
}
