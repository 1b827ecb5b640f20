/*
  fem_element.h - linear elements: shape functions, quadrature, stiffness, mass. Plain arrays, no handles.  Docs: theory 2.2

  Nodes are numbered as gmsh and VTK do (they agree for these four). Strain and stress are Voigt xx yy zz xy yz zx,
  shear strain as the engineering angle.
*/
#pragma once
#include "mesh.h"

#define FEM_MAX_NODES  8
#define FEM_MAX_POINTS 8
#define FEM_MAX_DOFS   24

typedef struct {
  MeshCellType  type;
  PetscInt      dim, nodes, points, faces, face_nodes;
  PetscReal     weight[FEM_MAX_POINTS];                 /* of the reference element; sums to its volume */
  PetscReal     N[FEM_MAX_POINTS][FEM_MAX_NODES];       /* shape functions at the points */
  PetscReal     dN[FEM_MAX_POINTS][FEM_MAX_NODES][3];   /* their reference gradients */
  PetscInt      face[6][4];                             /* nodes of each side, normal pointing out */
  unsigned char vtk;
} FemShape;

const FemShape *FemShapeGet(MeshCellType type); /* NULL when not covered */
/* Shape functions [nodes] and their reference gradients [nodes][3] anywhere in (or outside) the reference element.  Eq. (2.5) */
void FemShapeAt(MeshCellType type, const PetscReal xi[3], PetscReal N[], PetscReal dN[][3]);

/* Lame constants [Pa] that act in the plane or the solid.  Eq. (2.3), (2.4) */
typedef struct {
  PetscReal lambda, mu;       /* in h -> s; plane stress has its own lambda */
  PetscReal szz, ezz;         /* 2D: s_zz = szz (h_xx + h_yy) [Pa], e_zz = ezz (h_xx + h_yy) */
} FemElastic;

/*
  Gradients of the shape functions and weights of the points.  Eq. (2.6)

  x   [nodes][dim]          corner positions [m]
  dN  [points][nodes][dim]  out, [1/m]
  w   [points]              out, volume of each point [m3] (area x thickness in 2D)
  Returns the number of points where the element is turned inside out.
*/
PetscInt FemGradients(const FemShape *shape, const PetscReal *x, PetscReal thickness, PetscReal *dN, PetscReal *w);

/* Worst ratio over the integration points of det J to the lengths of its columns: 1 for a square or cube, < 0 inverted, 0 or tiny
   collapsed. Corners may be negative: MacNeal and Harder's solid patch has one, and integrates well. */
PetscReal FemShapeQuality(const FemShape *shape, const PetscReal *x);

/* K [nodes*dim][nodes*dim] [N/m].  Eq. (2.7) */
void FemStiffness(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, PetscReal *K);
/* f [nodes][dim] internal force [N] of displacement u [nodes][dim] [m], without forming K.  Eq. (2.9) */
void FemForce(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const PetscReal *u, PetscReal *f);
/* m [nodes] row-sum lumped mass [kg].  Eq. (2.10) */
void FemLumpedMass(const FemShape *shape, PetscReal density, const PetscReal *w, PetscReal *m);
/* Volume means of strain [-] and stress [Pa], Voigt [6] each; either may be NULL. */
void FemMeanStress(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const PetscReal *u, PetscReal *strain, PetscReal *stress);
/* Upper bound of the largest eigenvalue of K x = w^2 m x [1/s2].  Eq. (2.13) */
PetscReal FemEigenBound(PetscInt nodes, PetscInt dim, const PetscReal *K, const PetscReal *m);

/*
  Shape-function integrals over one side.  Eq. (2.8)

  x [n][dim] its nodes; N_dA [n] out, int N_a dA [m2]; N_n_dA [n][dim] out, int N_a n dA [m2], n outward. In 2D both carry the thickness.
*/
void FemFaceIntegrals(PetscInt dim, PetscInt n, const PetscReal *x, PetscReal thickness, PetscReal *N_dA, PetscReal *N_n_dA);
