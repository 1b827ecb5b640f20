/* dem_rule_bonds3.c - springs of the published rules over a run of bonds in 3D.  Eqs (4.40)-(4.44), docs/theory.md */
#include "dem_rule.h"

/* (R - I) r of a unit quaternion */
#define TURN(w, x, y, z, rx, ry, rz, ox, oy, oz) \
  do { \
    const PetscReal tx_ = 2 * ((y) * (rz) - (z) * (ry)), ty_ = 2 * ((z) * (rx) - (x) * (rz)), tz_ = 2 * ((x) * (ry) - (y) * (rx)); \
    ox = (w) * tx_ + ((y) * tz_ - (z) * ty_); \
    oy = (w) * ty_ + ((z) * tx_ - (x) * tz_); \
    oz = (w) * tz_ + ((x) * ty_ - (y) * tx_); \
  } while (0)

void DemPairsForce3_Internal(PetscInt wide, PetscInt begin, PetscInt m, const DemBonds *bonds, DemNetwork net, const PetscReal *copy, PetscReal t[9][DEM_CHUNK], PetscReal *restrict normal, PetscReal *restrict shear2)
{
  const PetscReal *restrict X = copy + DEM_COPY_X * wide, *restrict U = copy + DEM_COPY_U * wide, *restrict R = copy + DEM_COPY_R * wide;
  const PetscReal *restrict kn = net->kn, *restrict ks = net->ks, *restrict part = net->part;
  const int *restrict ip = bonds->ip, *restrict iq = bonds->iq;

#pragma omp simd
  for (PetscInt c = 0; c < m; c++) {
    const PetscInt  k = begin + c;
    const int       i = ip[k], j = iq[k];
    const PetscReal Yx = X[j] - X[i], Yy = X[wide + j] - X[wide + i], Yz = X[2 * wide + j] - X[2 * wide + i];
    const PetscReal wx = U[j] - U[i], wy = U[wide + j] - U[wide + i], wz = U[2 * wide + j] - U[2 * wide + i];
    const PetscReal yx = Yx + wx, yy = Yy + wy, yz = Yz + wz, s = part[k];
    const PetscReal px = s * Yx, py = s * Yy, pz = s * Yz, qx = px - Yx, qy = py - Yy, qz = pz - Yz;
    const PetscReal L = PetscSqrtReal(yx * yx + yy * yy + yz * yz), d = PetscSqrtReal(Yx * Yx + Yy * Yy + Yz * Yz), inv = 1 / L;
    const PetscReal open = (2 * (Yx * wx + Yy * wy + Yz * wz) + wx * wx + wy * wy + wz * wz) / (L + d); /* L - d without cancellation */
    const PetscReal nx = inv * yx, ny = inv * yy, nz = inv * yz;
    PetscReal       ax, ay, az, bx, by, bz;

    TURN(R[i], R[wide + i], R[2 * wide + i], R[3 * wide + i], px, py, pz, ax, ay, az);
    TURN(R[j], R[wide + j], R[2 * wide + j], R[3 * wide + j], qx, qy, qz, bx, by, bz);
    PetscReal       gx = wx + (bx - ax), gy = wy + (by - ay), gz = wz + (bz - az);
    const PetscReal along = gx * nx + gy * ny + gz * nz;

    ax += px;
    ay += py;
    az += pz;
    bx += qx;
    by += qy;
    bz += qz;
    gx = ks[k] * (gx - along * nx);
    gy = ks[k] * (gy - along * ny);
    gz = ks[k] * (gz - along * nz);
    const PetscReal N = kn[k] * open, share = 1 - along * inv;

    normal[c] = N;
    shear2[c] = gx * gx + gy * gy + gz * gz;
    t[0][c]   = N * nx + share * gx;
    t[1][c]   = N * ny + share * gy;
    t[2][c]   = N * nz + share * gz;
    t[3][c]   = ay * gz - az * gy;
    t[4][c]   = az * gx - ax * gz;
    t[5][c]   = ax * gy - ay * gx;
    t[6][c]   = bz * gy - by * gz;
    t[7][c]   = bx * gz - bz * gx;
    t[8][c]   = by * gx - bx * gy;
  }
}
