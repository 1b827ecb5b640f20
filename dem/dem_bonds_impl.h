/* dem_bonds_impl.h - bonds of a block four by four, for the kernels. */
#pragma once
#include "dem_impl.h"
#include "dem_lanes.h"

#define DEM_RUN_ROWS 5

/* Four bonds of a block: rows of numbers and ends within the block's copy. The first n are the block's, the others repeat its last one. */
typedef struct {
  int              n;
  const PetscReal *row[DEM_RUN_ROWS]; /* [DEM_LANES] each */
  const int       *ip, *iq;
} DemRun;

/* Room for the rows of a run that the block's end cuts short. */
typedef struct {
  PetscReal row[DEM_RUN_ROWS][DEM_LANES];
  int       end[2][DEM_LANES];
} DemRunTail;

/* Records of the run's particles in the block's copy. */
typedef struct {
  const PetscReal *p[DEM_LANES], *q[DEM_LANES];
} DemBondEnds;

/* Take bonds beyond the `left` that remain of the block out of a run of `rows` rows. */
DEM_INLINE void DemRunCut(int rows, PetscInt left, DemRunTail *tail, DemRun *run)
{
  run->n = DEM_LANES;
  if (__builtin_expect(left >= DEM_LANES, 1)) return;
  run->n = (int)left;
  for (int c = 0; c < DEM_LANES; c++) {
    const int e = c < run->n ? c : run->n - 1;

    for (int r = 0; r < rows; r++) tail->row[r][c] = run->row[r][e];
    tail->end[0][c] = run->ip[e];
    tail->end[1][c] = run->iq[e];
  }
  for (int r = 0; r < rows; r++) run->row[r] = tail->row[r];
  run->ip = tail->end[0];
  run->iq = tail->end[1];
}

/* Rows of the `exact` rule; in 2D the arm's third is left out. */
enum { DEM_ROW_K, DEM_ROW_WEIGHT, DEM_ROW_ARM };

/* The run from bond k of a block that ends before `last`. */
DEM_INLINE void DemBondRunAt(int dim, const DemBonds *bonds, PetscInt k, PetscInt last, DemRunTail *tail, DemRun *run)
{
  run->row[DEM_ROW_K]      = bonds->now + k;
  run->row[DEM_ROW_WEIGHT] = (bonds->weight ? bonds->weight : bonds->now) + k; /* read only where there are weights */
  for (int d = 0; d < dim; d++) run->row[DEM_ROW_ARM + d] = bonds->arm + d * bonds->n + k;
  run->ip = bonds->ip + k;
  run->iq = bonds->iq + k;
  DemRunCut(DEM_ROW_ARM + dim, last - k, tail, run);
}

/* Volumetric sums of both ends, in the order of the bonds. */
DEM_INLINE void DemBondSum(const DemRun *run, DemLanes sp, DemLanes sq, PetscReal *restrict S)
{
#pragma GCC unroll 4
  for (int c = 0; c < DEM_LANES; c++) {
    if (c >= run->n) break;
    S[run->ip[c]] += sp[c];
    S[run->iq[c]] -= sq[c];
  }
}

DEM_INLINE void DemBondEndsOf(const int *ip, const int *iq, const PetscReal *copy, DemBondEnds *ends)
{
  for (int c = 0; c < DEM_LANES; c++) {
    ends->p[c] = copy + DEM_AT_ALL * ip[c];
    ends->q[c] = copy + DEM_AT_ALL * iq[c];
  }
}

/* Four rows of the records from `at` on, q less p. */
DEM_INLINE void DemEndsDifference(const DemBondEnds *e, PetscInt at, DemLanes out[DEM_LANES])
{
  DemLanes d[DEM_LANES];

  for (int c = 0; c < DEM_LANES; c++) d[c] = DemLanesLoad(e->q[c] + at) - DemLanesLoad(e->p[c] + at);
  DemLanesAcross(d[0], d[1], d[2], d[3], out);
}

DEM_INLINE void DemEndsRows(const PetscReal *const end[DEM_LANES], PetscInt at, DemLanes out[DEM_LANES])
{
  DemLanesRows(end[0] + at, end[1] + at, end[2] + at, end[3] + at, out);
}

DEM_INLINE DemLanes DemEndsOne(const PetscReal *const end[DEM_LANES], PetscInt at)
{
  return (DemLanes){end[0][at], end[1][at], end[2][at], end[3][at]};
}

/* (R - I) r of a unit quaternion */
DEM_INLINE void DemLanesTurn(const DemLanes q[4], const DemLanes r[3], DemLanes out[3])
{
  const DemLanes x = 2 * (q[2] * r[2] - q[3] * r[1]), y = 2 * (q[3] * r[0] - q[1] * r[2]), z = 2 * (q[1] * r[1] - q[2] * r[0]);

  out[0] = q[0] * x + (q[2] * z - q[3] * y);
  out[1] = q[0] * y + (q[3] * x - q[1] * z);
  out[2] = q[0] * z + (q[1] * y - q[2] * x);
}

/* Rows of forces on p, couples on p and on q, to the records of what they feel; q feels the opposite force. In the order of the bonds. */
DEM_INLINE void DemLanesScatter(int n, const int *ip, const int *iq, const DemLanes t[3], const DemLanes couple_p[3], const DemLanes couple_q[3], PetscReal *restrict F)
{
  DemLanes force[DEM_LANES], cp[DEM_LANES], cq[DEM_LANES];

  DemLanesAcross(t[0], t[1], t[2], t[2], force); /* nobody reads the fourth number of a force, nor of a couple */
  DemLanesAcross(couple_p[0], couple_p[1], couple_p[2], couple_p[2], cp);
  DemLanesAcross(couple_q[0], couple_q[1], couple_q[2], couple_q[2], cq);
#pragma GCC unroll 4
  for (int c = 0; c < DEM_LANES; c++) {
    if (c >= n) break;
    PetscReal *fp = F + DEM_FORCE_ALL * ip[c], *fq = F + DEM_FORCE_ALL * iq[c];

    *(DemLoose *)fp += force[c];
    *(DemLoose *)(fp + DEM_FORCE_COUPLE) += cp[c];
    *(DemLoose *)fq -= force[c];
    *(DemLoose *)(fq + DEM_FORCE_COUPLE) += cq[c];
  }
}
