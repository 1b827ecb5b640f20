/* dem_rule_bonds3.c - springs of the published rules over a run of bonds in 3D.  Eqs (4.40)-(4.44), docs/theory.md */
#include "dem_bonds_impl.h"
#include "dem_rule.h"

enum { ROW_KN, ROW_KS, ROW_PART, ROW_LENGTH, ROWS };

DEM_INLINE void Store(const DemLanes value, PetscReal *to)
{
  *(DemLoose *)to = value;
}

DEM_CLONES void DemPairsForce3_Internal(PetscInt begin, PetscInt m, const DemBonds *bonds, DemNetwork net, const PetscReal *copy, PetscReal t[9][DEM_CHUNK], PetscReal *restrict normal, PetscReal *restrict shear2)
{
  for (PetscInt first = 0; first < m; first += DEM_LANES) {
    const PetscInt k = begin + first;
    DemRun         run = {.row = {net->kn + k, net->ks + k, net->part + k, net->length + k}, .ip = bonds->ip + k, .iq = bonds->iq + k};
    DemRunTail     tail;
    DemBondEnds    ends;
    DemLanes       move[4], Y[4], ri[4], rj[4], y[3], p[3], q[3], a[3], b[3], gap[3], n[3], g[3], f[3];

    DemRunCut(ROWS, m - first, &tail, &run);
    DemBondEndsOf(run.ip, run.iq, copy, &ends);
    DemEndsDifference(&ends, DEM_AT_U, move);
    DemEndsDifference(&ends, DEM_AT_X, Y);
    DemEndsRows(ends.p, DEM_AT_R, ri);
    DemEndsRows(ends.q, DEM_AT_R, rj);
    const DemLanes part = DemLanesLoad(run.row[ROW_PART]), d = DemLanesLoad(run.row[ROW_LENGTH]);

    for (int c = 0; c < 3; c++) {
      y[c] = Y[c] + move[c];
      p[c] = part * Y[c];
      q[c] = p[c] - Y[c];
    }
    DemLanesTurn(ri, p, a);
    DemLanesTurn(rj, q, b);
    const DemLanes L = DemLanesSqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]);
    const DemLanes both = 1 / (L * (L + d)), inverse = both * (L + d); /* one division for two: 1/L and 1/(L + d) */
    const DemLanes open = (2 * (Y[0] * move[0] + Y[1] * move[1] + Y[2] * move[2]) + move[0] * move[0] + move[1] * move[1] + move[2] * move[2]) * (both * L); /* L - d without cancellation */

    for (int c = 0; c < 3; c++) {
      n[c]   = inverse * y[c];
      gap[c] = move[c] + (b[c] - a[c]);
      a[c] += p[c];
      b[c] += q[c];
    }
    const DemLanes along = gap[0] * n[0] + gap[1] * n[1] + gap[2] * n[2], ks = DemLanesLoad(run.row[ROW_KS]), N = DemLanesLoad(run.row[ROW_KN]) * open, share = 1 - along * inverse;

    for (int c = 0; c < 3; c++) {
      g[c] = ks * (gap[c] - along * n[c]);
      f[c] = N * n[c] + share * g[c];
    }
    Store(N, normal + first);
    Store(g[0] * g[0] + g[1] * g[1] + g[2] * g[2], shear2 + first);
    for (int c = 0; c < 3; c++) {
      const int e = (c + 1) % 3, h = (c + 2) % 3;

      Store(f[c], t[c] + first);
      Store(a[e] * g[h] - a[h] * g[e], t[3 + c] + first);
      Store(b[h] * g[e] - b[e] * g[h], t[6 + c] + first);
    }
  }
}
