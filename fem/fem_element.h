/*
  fem_element.h - finite elements alone: shape functions, quadrature, stiffness, mass. Plain arrays, no handles.  Docs: theory 2.2, 2.5

  Linear and quadratic triangles, quadrilaterals, tetrahedra, hexahedra and prisms; nodes are numbered as gmsh does.
  Strain and stress are Voigt xx yy zz xy yz zx, shear strain as the engineering angle.
*/
#pragma once
#include "mesh.h"

#define FEM_MAX_NODES      27
#define FEM_MAX_POINTS     27
#define FEM_MAX_DOFS       81
#define FEM_MAX_FACE_NODES 9

typedef struct {
  MeshCellType  type, linear;                           /* linear: of the same corners */
  PetscInt      dim, nodes, corners, points, faces;
  PetscReal     weight[FEM_MAX_POINTS];                 /* of the reference element; sums to its volume */
  PetscReal     xi[FEM_MAX_POINTS][3];                  /* the points */
  PetscReal     N[FEM_MAX_POINTS][FEM_MAX_NODES];       /* shape functions at the points */
  PetscReal     dN[FEM_MAX_POINTS][FEM_MAX_NODES][3];   /* their reference gradients */
  PetscReal     place[FEM_MAX_NODES][3];                /* reference coordinates of the nodes */
  PetscReal     dN_place[FEM_MAX_NODES][FEM_MAX_NODES][3]; /* reference gradients at the nodes: [node][function] */
  PetscInt      face_nodes[6], face[6][FEM_MAX_FACE_NODES]; /* nodes of each side in gmsh's order of a cell of that kind, normal pointing out */
  unsigned char vtk;                                    /* VTK's cell type, and */
  PetscInt      vtk_node[FEM_MAX_NODES];                /* our node at each place of its list */
} FemShape;

const FemShape *FemShapeGet(MeshCellType type); /* NULL when not covered */
/* Shape functions [nodes] and their reference gradients [nodes][3] anywhere in (or outside) the reference element. Eqs (2.5), (2.30).
   For set-up and looking up: slow. Lines too. */
void FemShapeAt(MeshCellType type, const PetscReal xi[3], PetscReal N[], PetscReal dN[][3]);

/* Elastic constants [Pa] that act in the plane or the solid: Lame's, or where general a matrix.  Eqs (2.3), (2.4), (2.41)-(2.43) */
typedef struct {
  PetscReal lambda, mu; /* in h -> s; plane stress has its own lambda */
  PetscReal szz, ezz;   /* 2D: s_zz = szz (h_xx + h_yy) [Pa], e_zz = ezz (h_xx + h_yy) */
  PetscBool general;
  PetscReal C[6][6];    /* s = C e; in a plane body e has xx, yy, xy only */
  PetscReal S[6][6];    /* e = S s, likewise */
  PetscReal ezz_of[6];  /* plane stress: e_zz = ezz_of . e */
} FemElastic;

/* s [6] = stress [Pa] of the strain e [6]; in a plane body e is that in the plane, and e_zz = 0 here. */
static inline void FemStress(const FemElastic *law, PetscInt dim, const PetscReal e[6], PetscReal s[6])
{
  const PetscReal trace = e[0] + e[1] + e[2];

  if (law->general) {
    for (PetscInt i = 0; i < 6; i++) {
      s[i] = 0;
      for (PetscInt j = 0; j < 6; j++) s[i] += law->C[i][j] * e[j];
    }
    return;
  }
  for (PetscInt i = 0; i < 3; i++) {
    s[i]     = 2 * law->mu * e[i] + law->lambda * trace;
    s[3 + i] = law->mu * e[3 + i];
  }
  if (dim == 2) s[2] = law->szz * trace;
}

/* e_zz [-] that goes with a plane strain e [6] */
static inline PetscReal FemStrainZZ(const FemElastic *law, const PetscReal e[6])
{
  PetscReal sum = 0;

  if (!law->general) return law->ezz * (e[0] + e[1]);
  for (PetscInt j = 0; j < 6; j++) sum += law->ezz_of[j] * e[j];
  return sum;
}

/*
  Gradients of the shape functions and weights of the points.  Eq. (2.6)

  x   [nodes][dim]          node positions [m]
  dN  [points][nodes][dim]  out, [1/m]
  w   [points]              out, volume of each point [m3] (area x thickness in 2D)
  Returns the number of points where the element is turned inside out.
*/
PetscInt FemGradients(const FemShape *shape, const PetscReal *x, PetscReal thickness, PetscReal *dN, PetscReal *w);

/* Worst ratio over the integration points of det J to the lengths of its columns: 1 for a square or cube, < 0 inverted, 0 or tiny
   collapsed. A straight element's corners may be negative: MacNeal and Harder's solid patch has one, and integrates well. Nodes of
   a quadratic element may not, where the straight one is sound; 0 is allowed there (quarter-point nodes at a crack's tip). */
PetscReal FemShapeQuality(const FemShape *shape, const PetscReal *x);

/* K [nodes*dim][nodes*dim] [N/m].  Eq. (2.7) */
void FemStiffness(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, PetscReal *K);
/* f [nodes][dim] internal force [N] of displacement u [nodes][dim] [m], without forming K.  Eq. (2.9) */
void FemForce(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const PetscReal *u, PetscReal *f);
/* m [nodes] lumped mass [kg]: row sums, for quadratic elements the diagonal of the full mass scaled to the element's.  Eqs (2.10), (2.31) */
void FemLumpedMass(const FemShape *shape, PetscReal density, const PetscReal *w, PetscReal *m);
/* m [nodes] int rho N_a dV [kg]: what each node bears of a uniform acceleration.  Eq. (2.10) */
void FemBodyMass(const FemShape *shape, PetscReal density, const PetscReal *w, PetscReal *m);
/* Volume means of strain [-] and stress [Pa], Voigt [6] each; either may be NULL. */
void FemMeanStress(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const PetscReal *u, PetscReal *strain, PetscReal *stress);

/*
  Strains of an element's own, which cure quad4 and hex8 of locking.  Eqs (2.32)-(2.36), fem_modes.c

  Kept per element while it is worked on, for one law; a cell's weights w may carry its share.
*/
#define FEM_MODES       12
#define FEM_MODE_POINTS 8
#define FEM_MODE_DOFS   24
typedef struct {
  PetscInt  n;                                      /* 4 in the plane, 12 in space */
  PetscReal strain[FEM_MODE_POINTS][FEM_MODES][6];  /* of each mode at each point */
  PetscReal factor[FEM_MODES * FEM_MODES];          /* Cholesky factor of int G' C G */
  PetscReal inverse[3][3], det;                     /* of the Jacobian at the centre */
} FemModes;

PetscBool FemModesHas(const FemShape *shape); /* is there such a set for this shape? */
void      FemModesCreate(const FemShape *shape, const FemElastic *law, const PetscReal *x, const PetscReal *w, FemModes *modes);
/* The condensed stiffness, and the force of a displacement without forming it; as FemStiffness, FemForce. */
void FemModesStiffness(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemModes *modes, PetscReal *K);
void FemModesForce(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemModes *modes, const PetscReal *u, PetscReal *f);
/* How much of each mode [n] goes with the nodes' motion u; and what that adds to the strain e at xi, where the Jacobian is det. */
void FemModesAmounts(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemModes *modes, const PetscReal *u, PetscReal *amount);
void FemModesAdd(const FemShape *shape, const FemModes *modes, const PetscReal *amount, const PetscReal xi[3], PetscReal det, PetscReal e[6]);
/* strain [points][6] of the nodes' motion and the modes that go with it; modes NULL: of the nodes' alone, any shape. Plane: e_zz = 0. */
void FemModesStrain(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemModes *modes, const PetscReal *u, PetscReal strain[][6]);

/*
  Volume change as a linear function of place in each element: quadratic hexahedra and prisms near nu = 1/2.  Eqs (2.37)-(2.39), fem_volume.c

  Kept per element while it is worked on; no law in it.
*/
typedef struct {
  PetscReal centre[3], root[4][4];  /* psi_m(x) = sum_k root[m][k] (1, x - centre)_k, orthonormal under the element's points */
  PetscReal psi[FEM_MAX_POINTS][4]; /* at the points */
} FemVolume;

PetscReal FemVolumeExcess(const FemShape *shape, const FemElastic *law); /* what of lambda acts on the projected volume change [Pa]; 0: a plain element */
void      FemVolumeCreate(const FemShape *shape, const PetscReal *x, const PetscReal *w, FemVolume *volume);
/* As FemStiffness, FemForce. Only counts, dN and w are taken from shape: coarser functions on the same points will do. */
void FemVolumeStiffness(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemVolume *volume, PetscReal *K);
void FemVolumeForce(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemVolume *volume, const PetscReal *u, PetscReal *f);
void FemVolumeBlocks(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemVolume *volume, PetscReal *block); /* [nodes][dim][dim] on the diagonal of K */
/* How much of each psi [4] the volume change of u has; and e = B u at x made the strain that has the stress there. */
void FemVolumeAmounts(const FemShape *shape, const PetscReal *dN, const PetscReal *w, const FemVolume *volume, const PetscReal *u, PetscReal amount[4]);
void FemVolumeAdd(const FemShape *shape, const FemElastic *law, const FemVolume *volume, const PetscReal amount[4], const PetscReal x[3], PetscReal e[6]);
void FemVolumeStrain(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemVolume *volume, const PetscReal *u, PetscReal strain[][6]); /* [points][6] */

/* Upper bound of the largest eigenvalue of K x = w^2 m x [1/s2].  Eq. (2.13) */
PetscReal FemEigenBound(PetscInt nodes, PetscInt dim, const PetscReal *K, const PetscReal *m);

/*
  Shape-function integrals over one side.  Eq. (2.8)

  x [n][dim] its nodes, n in 3D: 3, 4, 6, 8 or 9, in 2D: 2 or 3; N_dA [n] out, int N_a dA [m2]; N_n_dA [n][dim] out, int N_a n dA [m2], n outward. In 2D both carry the thickness.
*/
void FemFaceIntegrals(PetscInt dim, PetscInt n, const PetscReal *x, PetscReal thickness, PetscReal *N_dA, PetscReal *N_n_dA);
