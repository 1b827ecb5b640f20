/*
  dem_bonds3.c - the `exact` rule over a block's bonds in 3D.  Eqs (4.2)-(4.7), docs/theory.md

  Four bonds at a time, in registers from the particles' records to the records of their forces; sums go to the block's copy in
  the order of the bonds. The gap is formed from displacements and from (R - I) arm, never from positions: at rest it is zero
  to the last bit, and rounding scales with the motion, not with the size of the body.
*/
#include "dem_bonds_impl.h"

/* Arms a, b of four bonds, turned, and their gaps.  Eqs (4.2), (4.3) */
typedef struct {
  DemLanes a[3], b[3], gap[3];
} Pose;

DEM_INLINE void PoseOf(const DemRun *run, const DemBondEnds *e, Pose *pose)
{
  DemLanes move[4], y[4], ri[4], rj[4], p[3], q[3], ta[3], tb[3];

  DemEndsDifference(e, DEM_AT_U, move);
  DemEndsDifference(e, DEM_AT_X, y);
  DemEndsRows(e->p, DEM_AT_R, ri);
  DemEndsRows(e->q, DEM_AT_R, rj);
  for (int d = 0; d < 3; d++) {
    p[d] = DemLanesLoad(run->row[DEM_ROW_ARM + d]);
    q[d] = p[d] - y[d];
  }
  DemLanesTurn(ri, p, ta);
  DemLanesTurn(rj, q, tb);
  for (int d = 0; d < 3; d++) {
    pose->gap[d] = move[d] + (tb[d] - ta[d]);
    pose->a[d]   = p[d] + ta[d];
    pose->b[d]   = q[d] + tb[d];
  }
}

DEM_INLINE DemLanes Dot(const DemLanes a[3], const DemLanes b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

DEM_CLONES void DemBondsSum3_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal *restrict copy)
{
  PetscReal *restrict S = copy + DEM_COPY_S * wide;

  for (PetscInt k = first; k < last; k += DEM_LANES) {
    DemRunTail  tail;
    DemRun      run;
    DemBondEnds ends;
    DemLanes    kk, sp, sq;
    Pose        pose;

    DemBondRunAt(3, bonds, k, last, &tail, &run);
    DemBondEndsOf(run.ip, run.iq, copy, &ends);
    PoseOf(&run, &ends, &pose);
    kk = DemLanesLoad(run.row[DEM_ROW_K]);
    sp = kk * Dot(pose.gap, pose.a);
    sq = kk * Dot(pose.gap, pose.b);
    DemBondSum(&run, sp, sq, S);
  }
}

/* T_p = a x (t - f_p), T_q = -b x (t + ...): the volumetric part acts on the other particle's gap alone.  Eq. (4.7) */
DEM_CLONES void DemBondsForce3_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal g2, PetscReal lambda, PetscReal *restrict copy)
{
  PetscReal *restrict F = copy + DEM_COPY_F * wide;

  for (PetscInt k = first; k < last; k += DEM_LANES) {
    DemRunTail  tail;
    DemRun      run;
    DemBondEnds ends;
    DemLanes    kk, gk, ep, eq, t[3], sp[3], sq[3], cp[3], cq[3];
    Pose        pose;

    DemBondRunAt(3, bonds, k, last, &tail, &run);
    DemBondEndsOf(run.ip, run.iq, copy, &ends);
    PoseOf(&run, &ends, &pose);
    kk = DemLanesLoad(run.row[DEM_ROW_K]);
    gk = kk * g2;
    if (bonds->weight) gk *= DemLanesLoad(run.row[DEM_ROW_WEIGHT]);
    ep = kk * lambda * DemEndsOne(ends.p, DEM_AT_E);
    eq = kk * lambda * DemEndsOne(ends.q, DEM_AT_E);
    for (int d = 0; d < 3; d++) {
      t[d]  = gk * pose.gap[d] + ep * pose.a[d] - eq * pose.b[d];
      sp[d] = t[d] - ep * pose.gap[d];
      sq[d] = t[d] - eq * pose.gap[d];
    }
    for (int d = 0; d < 3; d++) {
      const int e = (d + 1) % 3, f = (d + 2) % 3;

      cp[d] = pose.a[e] * sp[f] - pose.a[f] * sp[e];
      cq[d] = pose.b[f] * sq[e] - pose.b[e] * sq[f];
    }
    DemLanesScatter(run.n, run.ip, run.iq, t, cp, cq, F);
  }
}

PetscReal DemBondsEnergy3_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal g_shear, const PetscReal *copy)
{
  PetscReal sum = 0;

  for (PetscInt k = first; k < last; k += DEM_LANES) {
    DemRunTail  tail;
    DemRun      run;
    DemBondEnds ends;
    DemLanes    energy;
    Pose        pose;

    DemBondRunAt(3, bonds, k, last, &tail, &run);
    DemBondEndsOf(run.ip, run.iq, copy, &ends);
    PoseOf(&run, &ends, &pose);
    energy = g_shear * DemLanesLoad(run.row[DEM_ROW_K]) * Dot(pose.gap, pose.gap);
    if (bonds->weight) energy *= DemLanesLoad(run.row[DEM_ROW_WEIGHT]);
    for (int c = 0; c < run.n; c++) sum += energy[c];
  }
  return sum;
}
