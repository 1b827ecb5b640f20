/*
  dem_lanes.h - four bonds or contacts side by side, in the compiler's own vectors.

  What a pair needs of its two particles lies in records; four of those become rows, and rows become records again, by a
  transposition in registers. One number at a time, gathered, takes half of a step's time.
*/
#pragma once
#include "dem_contact.h"

/* Where the compiler is not told which machine it builds for, a kernel is built for x86-64-v3 too, and chosen as the program starts. */
#if defined(__x86_64__) && !defined(__AVX2__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define DEM_CLONES __attribute__((target_clones("default", "arch=haswell")))
#else
#define DEM_CLONES
#endif

#define DEM_LANES 4

typedef PetscReal DemLanes __attribute__((vector_size(DEM_LANES * sizeof(PetscReal))));
typedef PetscReal DemLoose __attribute__((vector_size(DEM_LANES * sizeof(PetscReal)), aligned(sizeof(PetscReal)), may_alias));

DEM_INLINE DemLanes DemLanesLoad(const PetscReal *a)
{
  return *(const DemLoose *)a;
}

DEM_INLINE DemLanes DemLanesSqrt(DemLanes a)
{
  DemLanes root;

  for (int c = 0; c < DEM_LANES; c++) root[c] = PetscSqrtReal(a[c]);
  return root;
}

/* Columns of four rows. */
DEM_INLINE void DemLanesAcross(DemLanes a, DemLanes b, DemLanes c, DemLanes d, DemLanes out[DEM_LANES])
{
  const DemLanes even = __builtin_shufflevector(a, b, 0, 4, 2, 6), odd = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const DemLanes even2 = __builtin_shufflevector(c, d, 0, 4, 2, 6), odd2 = __builtin_shufflevector(c, d, 1, 5, 3, 7);

  out[0] = __builtin_shufflevector(even, even2, 0, 1, 4, 5);
  out[1] = __builtin_shufflevector(odd, odd2, 0, 1, 4, 5);
  out[2] = __builtin_shufflevector(even, even2, 2, 3, 6, 7);
  out[3] = __builtin_shufflevector(odd, odd2, 2, 3, 6, 7);
}

/* The same of four records in memory. */
DEM_INLINE void DemLanesRows(const PetscReal *a, const PetscReal *b, const PetscReal *c, const PetscReal *d, DemLanes out[DEM_LANES])
{
  DemLanesAcross(DemLanesLoad(a), DemLanesLoad(b), DemLanesLoad(c), DemLanesLoad(d), out);
}
