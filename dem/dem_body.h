/*
  dem_body.h - the body that particles fill: a union of convex pieces.

  A box is one piece, a cylinder one prism, a gmsh volume its tetrahedra (2D: triangles). Cells are clipped piece by
  piece, so notches and re-entrant corners are exact.  docs/theory.md 3.1
*/
#pragma once
#include "mesh.h"

typedef struct {
  PetscInt  dim;       /* 2 or 3 */
  PetscReal thickness; /* [m] in 2D; 1 in 3D */
  PetscReal low[3], high[3];

  PetscInt   n_pieces;
  PetscInt  *start;  /* [n_pieces + 1] first plane of a piece */
  PetscReal *plane;  /* [start[n_pieces]][4] outward unit normal n and offset c: inside is n.x <= c */
  PetscInt  *face;   /* [start[n_pieces]] boundary face of that plane, -1 between two pieces */
  PetscInt  *beyond; /* [start[n_pieces]] piece on the other side of that plane, -1 at the boundary */
  PetscReal *box;    /* [n_pieces][6] low x y z, high x y z */

  PetscInt n_faces; /* named parts of the boundary */
  char (*face_name)[128];

  /* The boundary as simplices: triangles (3D) or segments (2D), outward orientation. */
  PetscInt   n_simplices;
  PetscReal *simplex;      /* [n_simplices][dim][3] corners [m] */
  PetscInt  *simplex_node; /* [n_simplices][dim] equal numbers are the same point; two sides of a crack have their own */
  PetscInt  *simplex_face; /* [n_simplices] */
} DemBody;

/* Faces xmin xmax ymin ymax (zmin zmax). */
PetscErrorCode DemBodyCreateBox(PetscInt dim, const PetscReal low[3], const PetscReal high[3], PetscReal thickness, DemBody *body);
/* Axis z; regular prism of `sides` sides with the circle's area; faces "bottom" (z = low), "top", "side". */
PetscErrorCode DemBodyCreateCylinder(const PetscReal centre[3], PetscReal radius, PetscReal height, PetscInt sides, DemBody *body);
/* 2D; face "side". */
PetscErrorCode DemBodyCreateDisc(const PetscReal centre[2], PetscReal radius, PetscInt sides, PetscReal thickness, DemBody *body);
/*
  DemBodyCreateFromMesh - the cells of a mesh as pieces; group "" = all of them

  Triangles and tetrahedra are pieces as they are, convex quadrilaterals too; hexahedra, prisms and pyramids are split
  about their middle, faces along the diagonal from their lowest node, so neighbours agree. Of a quadratic cell the
  corners count. Facet groups on the boundary become faces, the rest of it is face "".
  Errors: PETSC_ERR_USER_INPUT for an unknown group, a flat or non-convex cell, three cells on one facet, a boundary
  facet in two groups, a 2D mesh that leaves the plane z = 0.
*/
PetscErrorCode DemBodyCreateFromMesh(const Mesh *mesh, const char *group, PetscReal thickness, DemBody *body);
PetscErrorCode DemBodyDestroy(DemBody *body);

PetscReal      DemBodyVolume(const DemBody *body);                                     /* [m3], area x thickness in 2D */
PetscErrorCode DemBodyInside(const DemBody *body, PetscInt n, const PetscReal x[], PetscBool inside[]); /* x [n][3] */
PetscErrorCode DemBodyFindFace(const DemBody *body, const char *name, PetscInt *face); /* -1 when absent */
