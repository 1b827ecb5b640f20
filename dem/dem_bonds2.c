/* dem_bonds2.c - the `exact` rule over a block's bonds in 2D: two displacements, one angle.  Eqs (4.2)-(4.7); see dem_bonds3.c */
#include "dem_bonds_impl.h"

typedef struct {
  DemLanes a[2], b[2], gap[2];
} Pose;

/* Rotations are sin and cos - 1. */
DEM_INLINE void PoseOf(const DemRun *run, const DemBondEnds *e, Pose *pose)
{
  DemLanes move[4], y[4], ri[4], rj[4];

  DemEndsDifference(e, DEM_AT_U, move);
  DemEndsDifference(e, DEM_AT_X, y);
  DemEndsRows(e->p, DEM_AT_R, ri);
  DemEndsRows(e->q, DEM_AT_R, rj);
  const DemLanes px = DemLanesLoad(run->row[DEM_ROW_ARM]), py = DemLanesLoad(run->row[DEM_ROW_ARM + 1]), qx = px - y[0], qy = py - y[1];
  const DemLanes ax = ri[1] * px - ri[0] * py, ay = ri[0] * px + ri[1] * py, bx = rj[1] * qx - rj[0] * qy, by = rj[0] * qx + rj[1] * qy;

  pose->gap[0] = move[0] + (bx - ax);
  pose->gap[1] = move[1] + (by - ay);
  pose->a[0]   = ax + px;
  pose->a[1]   = ay + py;
  pose->b[0]   = bx + qx;
  pose->b[1]   = by + qy;
}

DEM_CLONES void DemBondsSum2_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal *restrict copy)
{
  PetscReal *restrict S = copy + DEM_COPY_S * wide;

  for (PetscInt k = first; k < last; k += DEM_LANES) {
    DemRunTail  tail;
    DemRun      run;
    DemBondEnds ends;
    DemLanes    kk, sp, sq;
    Pose        pose;

    DemBondRunAt(2, bonds, k, last, &tail, &run);
    DemBondEndsOf(run.ip, run.iq, copy, &ends);
    PoseOf(&run, &ends, &pose);
    kk = DemLanesLoad(run.row[DEM_ROW_K]);
    sp = kk * (pose.gap[0] * pose.a[0] + pose.gap[1] * pose.a[1]);
    sq = kk * (pose.gap[0] * pose.b[0] + pose.gap[1] * pose.b[1]);
    DemBondSum(&run, sp, sq, S);
  }
}

DEM_CLONES void DemBondsForce2_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal g2, PetscReal lambda, PetscReal *restrict copy)
{
  PetscReal *restrict F = copy + DEM_COPY_F * wide;

  for (PetscInt k = first; k < last; k += DEM_LANES) {
    DemRunTail  tail;
    DemRun      run;
    DemBondEnds ends;
    DemLanes    kk, gk, ep, eq, force[DEM_LANES];
    Pose        pose;

    DemBondRunAt(2, bonds, k, last, &tail, &run);
    DemBondEndsOf(run.ip, run.iq, copy, &ends);
    PoseOf(&run, &ends, &pose);
    kk = DemLanesLoad(run.row[DEM_ROW_K]);
    gk = kk * g2;
    if (bonds->weight) gk *= DemLanesLoad(run.row[DEM_ROW_WEIGHT]);
    ep = kk * lambda * DemEndsOne(ends.p, DEM_AT_E);
    eq = kk * lambda * DemEndsOne(ends.q, DEM_AT_E);
    const DemLanes tx = gk * pose.gap[0] + ep * pose.a[0] - eq * pose.b[0], ty = gk * pose.gap[1] + ep * pose.a[1] - eq * pose.b[1];
    const DemLanes cp = pose.a[0] * (ty - ep * pose.gap[1]) - pose.a[1] * (tx - ep * pose.gap[0]); /* a x (t - f_p), b x (t + f_q).  Eq. (4.7) */
    const DemLanes cq = pose.b[0] * (ty - eq * pose.gap[1]) - pose.b[1] * (tx - eq * pose.gap[0]);

    DemLanesAcross(tx, ty, cp, cq, force);
#pragma GCC unroll 4
    for (int c = 0; c < DEM_LANES; c++) {
      if (c >= run.n) break;
      PetscReal *fp = F + DEM_FORCE_ALL * run.ip[c], *fq = F + DEM_FORCE_ALL * run.iq[c];

      fp[0] += force[c][0];
      fp[1] += force[c][1];
      fp[DEM_FORCE_COUPLE + 2] += force[c][2];
      fq[0] -= force[c][0];
      fq[1] -= force[c][1];
      fq[DEM_FORCE_COUPLE + 2] -= force[c][3];
    }
  }
}

PetscReal DemBondsEnergy2_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal g_shear, const PetscReal *copy)
{
  PetscReal sum = 0;

  for (PetscInt k = first; k < last; k += DEM_LANES) {
    DemRunTail  tail;
    DemRun      run;
    DemBondEnds ends;
    DemLanes    energy;
    Pose        pose;

    DemBondRunAt(2, bonds, k, last, &tail, &run);
    DemBondEndsOf(run.ip, run.iq, copy, &ends);
    PoseOf(&run, &ends, &pose);
    energy = g_shear * DemLanesLoad(run.row[DEM_ROW_K]) * (pose.gap[0] * pose.gap[0] + pose.gap[1] * pose.gap[1]);
    if (bonds->weight) energy *= DemLanesLoad(run.row[DEM_ROW_WEIGHT]);
    for (int c = 0; c < run.n; c++) sum += energy[c];
  }
  return sum;
}
