/* recover_case.h - what tests of recovered stress share: displacements given at the nodes, exact stresses, orders of the error. */
#pragma once
#include "fem_case.h"
#include "fem_impl.h"

typedef void (*RecoverField)(const PetscReal x[3], PetscReal s[6]);

extern const FemMaterial recover_steel;

FemKind RecoverKind(MeshCellType type);                                          /* solid or plane strain */
void    RecoverHooke(const FemMaterial *m, PetscReal h[3][3], PetscReal s[6]); /* by hand: stress of a gradient */

/* A box with material, no supports (explicit), not yet set up; then its nodes follow a field. */
PetscErrorCode RecoverFree(MeshCellType type, const PetscReal length[3], const PetscInt n[3], PetscReal distort, FemKind kind, const FemMaterial *material, Mesh *mesh, FemModel *model);
PetscErrorCode RecoverImpose(FemModel model, CaseField field);

/* Worst difference of recovered and exact stress over the points of a unit box, in parts of the largest stress; inner points only when asked. */
PetscErrorCode RecoverWorst(FemModel model, const Mesh *mesh, RecoverField exact, PetscBool inner, PetscReal *worst);

/* Orders of raw and recovered stress and the estimate of the error, `coarse` and twice as many cells a side; the orders recovery must reach on
   smoothly bent and on distorted meshes; 0: not asked (quad8 and its like lose an order on cells that are no parallelograms). */
PetscErrorCode RecoverCheckOrders(MeshCellType type, PetscInt coarse, PetscReal smooth_order, PetscReal rough_order);
