/*
  dem_bonds3.c - the `exact` rule over a block's bonds in 3D.  Eqs (4.2)-(4.7), docs/theory.md

  Each bond writes its results to a chunk's own slots (so lanes never collide); a scalar loop then adds them to the
  block's copy in bond order. The gap is formed from displacements and from (R - I) arm, never from positions: at rest
  it is zero to the last bit, and rounding scales with the motion, not with the size of the body.
*/
#include "dem_impl.h"

/* (R - I) r of a unit quaternion */
#define TURN(w, x, y, z, rx, ry, rz, ox, oy, oz) \
  do { \
    const PetscReal tx_ = 2 * ((y) * (rz) - (z) * (ry)), ty_ = 2 * ((z) * (rx) - (x) * (rz)), tz_ = 2 * ((x) * (ry) - (y) * (rx)); \
    ox = (w) * tx_ + ((y) * tz_ - (z) * ty_); \
    oy = (w) * ty_ + ((z) * tx_ - (x) * tz_); \
    oz = (w) * tz_ + ((x) * ty_ - (y) * tx_); \
  } while (0)

/* Arms a, b and gap d of bond k between i and j of the copy.  Eqs (4.2), (4.3) */
#define GAP(k, i, j) \
  const PetscReal px = arm[k], py = arm[n + k], pz = arm[2 * n + k]; \
  const PetscReal qx = px - (X[j] - X[i]), qy = py - (X[wide + j] - X[wide + i]), qz = pz - (X[2 * wide + j] - X[2 * wide + i]); \
  PetscReal       ax, ay, az, bx, by, bz; \
  TURN(R[i], R[wide + i], R[2 * wide + i], R[3 * wide + i], px, py, pz, ax, ay, az); \
  TURN(R[j], R[wide + j], R[2 * wide + j], R[3 * wide + j], qx, qy, qz, bx, by, bz); \
  const PetscReal dx = (U[j] - U[i]) + (bx - ax), dy = (U[wide + j] - U[wide + i]) + (by - ay), dz = (U[2 * wide + j] - U[2 * wide + i]) + (bz - az); \
  ax += px; \
  ay += py; \
  az += pz; \
  bx += qx; \
  by += qy; \
  bz += qz

void DemBondsSum3_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal *copy)
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
      sp[c] = kk[k] * (dx * ax + dy * ay + dz * az);
      sq[c] = kk[k] * (dx * bx + dy * by + dz * bz);
    }
    for (PetscInt c = 0; c < m; c++) {
      S[ip[begin + c]] += sp[c];
      S[iq[begin + c]] -= sq[c];
    }
  }
}

void DemBondsForce3_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal g2, PetscReal lambda, PetscReal *copy)
{
  const PetscInt           n = bonds->n;
  const PetscReal *restrict X = copy + DEM_COPY_X * wide, *restrict U = copy + DEM_COPY_U * wide, *restrict R = copy + DEM_COPY_R * wide;
  const PetscReal *restrict eps = copy + DEM_COPY_E * wide;
  const PetscReal *restrict arm = bonds->arm, *restrict kk = bonds->now, *restrict weight = bonds->weight;
  const int *restrict ip = bonds->ip, *restrict iq = bonds->iq;
  PetscReal *restrict F = copy + DEM_COPY_F * wide; /* [wide][8] */
  PetscReal t[9][DEM_CHUNK], g[DEM_CHUNK];

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
      const PetscReal tx = gk * dx + ep * ax - eq * bx, ty = gk * dy + ep * ay - eq * by, tz = gk * dz + ep * az - eq * bz;

      t[0][c] = tx;
      t[1][c] = ty;
      t[2][c] = tz;
      /* T_p = a x (t - f_p), T_q = -b x (t + ...): the volumetric part acts on the other particle's gap alone.  Eq. (4.7) */
      const PetscReal sx = tx - ep * dx, sy = ty - ep * dy, sz = tz - ep * dz;
      const PetscReal rx = tx - eq * dx, ry = ty - eq * dy, rz = tz - eq * dz;

      t[3][c] = ay * sz - az * sy;
      t[4][c] = az * sx - ax * sz;
      t[5][c] = ax * sy - ay * sx;
      t[6][c] = by * rz - bz * ry;
      t[7][c] = bz * rx - bx * rz;
      t[8][c] = bx * ry - by * rx;
    }
    for (PetscInt c = 0; c < m; c++) {
      PetscReal *fp = F + 8 * ip[begin + c], *fq = F + 8 * iq[begin + c];

      fp[0] += t[0][c];
      fp[1] += t[1][c];
      fp[2] += t[2][c];
      fp[3] += t[3][c];
      fp[4] += t[4][c];
      fp[5] += t[5][c];
      fq[0] -= t[0][c];
      fq[1] -= t[1][c];
      fq[2] -= t[2][c];
      fq[3] -= t[6][c];
      fq[4] -= t[7][c];
      fq[5] -= t[8][c];
    }
  }
}

PetscReal DemBondsEnergy3_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal g_shear, const PetscReal *copy)
{
  const PetscInt   n = bonds->n;
  const PetscReal *X = copy + DEM_COPY_X * wide, *U = copy + DEM_COPY_U * wide, *R = copy + DEM_COPY_R * wide;
  const PetscReal *arm = bonds->arm;
  PetscReal        sum = 0;

  for (PetscInt k = first; k < last; k++) {
    const int i = bonds->ip[k], j = bonds->iq[k];

    GAP(k, i, j);
    (void)ax, (void)ay, (void)az, (void)bx, (void)by, (void)bz;
    sum += (bonds->weight ? bonds->weight[k] : 1) * g_shear * bonds->now[k] * (dx * dx + dy * dy + dz * dz);
  }
  return sum;
}
