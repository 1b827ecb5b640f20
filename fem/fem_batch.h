/*
  fem_batch.h - internal forces of many elements at once: one lane of a vector register for each.  Docs: theory 2.15

  Elements of one kind and material go through a kernel in batches; what a kernel needs of an element's shape is worked out
  once and kept lane by lane. Elements of the same shape (a structured mesh) share one such block. Sums into a node run in one
  order, set by kind, material and global number: the same bits whatever the number of threads and ranks.
*/
#pragma once
#include "fem_element.h"

#if defined(__AVX512F__)
#define FEM_LANES 8
#else
#define FEM_LANES 4
#endif
typedef double FemLanes __attribute__((vector_size(8 * FEM_LANES)));

typedef enum {
  FEM_BATCH_TET10, /* straight sides: strain is linear, its values at the corners tell all.  Eqs (2.101), (2.102) */
  FEM_BATCH_HEX8,  /* any stiffness of a hex8 in a basis of sums and differences.  Eqs (2.103)-(2.106) */
  FEM_BATCH_POINTS, /* any shape, point by point.  Eq. (2.9) */
  FEM_BATCH_VOLUME, /* point by point, the excess of lambda on a linear volume change.  Eqs (2.37), (2.38) */
  FEM_BATCH_DENSE  /* any stiffness, as a matrix: quad4 with strains of its own */
} FemBatchKind;

/* Numbers a kernel keeps of one element. */
#define FEM_HEX8_CONSTANTS 112 /* volume, [7][3] mean gradients, [4][3] places, lower triangle of [12][12] */
PetscInt FemBatchConstants(FemBatchKind kind, const FemShape *shape);
/* Eqs (2.103)-(2.105): from a stiffness K [24][24], mean gradients b [8][3], volume and places x [8][3] of a hex8. False when the shape has no such basis. */
PetscBool FemBatchHex8(const PetscReal *K, const PetscReal *b, PetscReal volume, const PetscReal *x, PetscReal constant[FEM_HEX8_CONSTANTS]);

/*
  Forces of FEM_LANES elements: u, f [nodes][dim] lanes, constant [FemBatchConstants()] lanes. f is written, not added to.
*/
void FemBatchForce(FemBatchKind kind, const FemShape *shape, const FemElastic *law, const FemLanes *constant, const FemLanes *u, FemLanes *f);
