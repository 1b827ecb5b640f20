/*
  fem_point.h - an element at one point: place, gradients, the way back from a place, rules of points. Plain arrays.  Theory 2.9

  Written for any element FemShapeAt() knows, linear or quadratic, triangle to prism: corners come first among its nodes.
*/
#pragma once
#include "fem_element.h"

#define FEM_RULE_MAX 64 /* points of the largest rule */

PetscInt  FemPointOrder(MeshCellType type);      /* degree of the shape functions, 1 or 2 */
PetscBool FemPointIsSimplex(MeshCellType type);  /* triangle or tetrahedron */

/* N [nodes], gradients dN [nodes][dim] [1/m] and place at [dim] [m] of reference point xi; x [nodes][dim]. Returns det J.  Eq. (2.5), (2.6) */
PetscReal FemPointAt(const FemShape *shape, const PetscReal *x, const PetscReal xi[3], PetscReal *N, PetscReal *dN, PetscReal *at);

/* The same with the reference gradients grad [nodes] at hand. */
PetscReal FemPointMap(const FemShape *shape, const PetscReal *x, const PetscReal *N, const PetscReal grad[][3], PetscReal *dN, PetscReal *at);

/* Newton from the middle for x(xi) = at. Returns how far xi lies outside the reference element (0: inside), a large number when
   Newton does not get there. */
PetscReal FemPointFind(const FemShape *shape, const PetscReal *x, const PetscReal at[3], PetscReal xi[3]);
void      FemPointClamp(MeshCellType type, PetscReal xi[3]); /* to the nearest place in the reference element, roughly for simplices */

/* Points with what the shape functions are there. */
typedef struct {
  PetscInt  n;
  PetscReal xi[FEM_RULE_MAX][3], w[FEM_RULE_MAX], N[FEM_RULE_MAX][FEM_MAX_NODES], grad[FEM_RULE_MAX][FEM_MAX_NODES][3];
} FemPoints;
void FemPointsFill(MeshCellType type, FemPoints *points); /* N and grad of n points at xi */

/* Gauss points with n a side; a simplex takes them collapsed, exact to degree 2 n - dim. w sums to the reference volume. Returns how many. */
PetscInt FemPointRule(MeshCellType type, PetscInt n, PetscReal xi[FEM_RULE_MAX][3], PetscReal w[FEM_RULE_MAX]);
/* Where the derivatives of degree-p elements are better than elsewhere: the middle (p = 1), 2 Gauss points a side (p = 2). Returns how many. */
PetscInt FemPointSamples(MeshCellType type, PetscReal xi[FEM_RULE_MAX][3]);

/* Corners joined to corner a by an edge: dim of them. Two of them in space (one in the plane) and a tell a side at a. NULL: not covered. */
const PetscInt *FemPointEdges(MeshCellType type, PetscInt a);
