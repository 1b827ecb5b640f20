/* dem_rule_bonds2.c - springs of the published rules over a run of bonds in 2D: two displacements, one angle; see dem_rule_bonds3.c */
#include "dem_rule.h"

void DemPairsForce2_Internal(PetscInt begin, PetscInt m, const DemBonds *bonds, DemNetwork net, const PetscReal *copy, PetscReal t[9][DEM_CHUNK], PetscReal *restrict normal, PetscReal *restrict shear2)
{
  const PetscReal *restrict kn = net->kn, *restrict ks = net->ks, *restrict part = net->part, *restrict length = net->length;
  const int *restrict ip = bonds->ip, *restrict iq = bonds->iq;

#pragma omp simd
  for (PetscInt c = 0; c < m; c++) {
    const PetscInt  k = begin + c;
    const int       i = DEM_AT_ALL * ip[k], j = DEM_AT_ALL * iq[k];
    const PetscReal Yx = copy[j + DEM_AT_X] - copy[i + DEM_AT_X], Yy = copy[j + DEM_AT_X + 1] - copy[i + DEM_AT_X + 1];
    const PetscReal wx = copy[j + DEM_AT_U] - copy[i + DEM_AT_U], wy = copy[j + DEM_AT_U + 1] - copy[i + DEM_AT_U + 1];
    const PetscReal si = copy[i + DEM_AT_R], ci = copy[i + DEM_AT_R + 1], sj = copy[j + DEM_AT_R], cj = copy[j + DEM_AT_R + 1];
    const PetscReal yx = Yx + wx, yy = Yy + wy, s = part[k], px = s * Yx, py = s * Yy, qx = px - Yx, qy = py - Yy;
    const PetscReal L = PetscSqrtReal(yx * yx + yy * yy), inv = 1 / L;
    const PetscReal open = (2 * (Yx * wx + Yy * wy) + wx * wx + wy * wy) / (L + length[k]);
    const PetscReal nx = inv * yx, ny = inv * yy;
    PetscReal       ax = ci * px - si * py, ay = si * px + ci * py, bx = cj * qx - sj * qy, by = sj * qx + cj * qy;
    PetscReal       gx = wx + (bx - ax), gy = wy + (by - ay);
    const PetscReal along = gx * nx + gy * ny;

    ax += px;
    ay += py;
    bx += qx;
    by += qy;
    gx = ks[k] * (gx - along * nx);
    gy = ks[k] * (gy - along * ny);
    const PetscReal N = kn[k] * open, share = 1 - along * inv;

    normal[c] = N;
    shear2[c] = gx * gx + gy * gy;
    t[0][c]   = N * nx + share * gx;
    t[1][c]   = N * ny + share * gy;
    t[2][c]   = t[3][c] = t[4][c] = t[6][c] = t[7][c] = 0;
    t[5][c]   = ax * gy - ay * gx;
    t[8][c]   = by * gx - bx * gy;
  }
}
