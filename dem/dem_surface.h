/*
  dem_surface.h - a rigid surface of flat cells: triangles in space, segments in the plane.

  Read from STL or gmsh, or made; its own neighbours are found here, so that a sphere which rolls over it meets one
  surface and not many triangles.  docs/theory.md 5.3
*/
#pragma once
#include "mesh.h"

typedef struct {
  PetscInt   dim;     /* 3 or 2 */
  PetscInt   n_nodes;
  PetscReal *x;       /* [n_nodes][3] [m] */
  PetscInt   n;       /* cells */
  PetscInt  *corner;  /* [n][dim] nodes */
  PetscReal *normal;  /* [n][3] unit; neighbours' agree, and point out of a closed surface */

  PetscInt   n_edges;   /* 3D */
  PetscInt  *edge;      /* [n_edges][2] nodes */
  PetscInt  *edge_cell; /* [n_edges][2] cells on either side, -1 where the surface ends */
  PetscInt  *cell_edge; /* [n][3] edge from corner k to corner k + 1 */
  PetscInt  *spoke_start, *spoke; /* nodes joined to a node by an edge (2D: a segment): spoke[spoke_start[i] .. spoke_start[i + 1]) */

  PetscInt  *node_owner; /* [n_nodes] its first cell */
  PetscBool  closed;  /* every edge (2D: node) has a cell on both sides */
  PetscReal  low[3], high[3];

  /* Grid for searches: cells of the surface that come within `reach` of a box of the grid. */
  PetscReal  reach, width, origin[3];
  PetscInt   m[3];
  PetscInt  *box_start, *box;
} DemSurface;

/* Where a sphere touches: the point of a rigid body nearest to its centre, among the points around. */
typedef struct {
  PetscReal n[3];      /* unit, from the body to the centre */
  PetscReal distance;  /* of the centre [m]; negative inside a half-space or a solid cylinder */
  PetscReal curvature; /* of the body there, for Hertz: 0 flat, 1/R of a cylinder, -1/R inside one [1/m] */
  PetscInt  kind;      /* 0 face, 1 edge, 2 corner; of a surface: */
  PetscInt  which;     /* its number among the cells, edges, nodes */
} DemTouch;

#define DEM_TOUCHES 8 /* contacts of one sphere with one body that are kept: the nearest */

/*
  DemSurfaceCreate - from corners [n][dim][3] that share no nodes: equal points (to 1e-9 of the size) become one node

  Errors: PETSC_ERR_USER_INPUT with the cell's number for a coordinate that is not a number, a cell without area, two cells
  on the same corners, an edge with three cells, a surface with one side only (Moebius). `source` heads the messages.
*/
PetscErrorCode DemSurfaceCreate(const char *source, PetscInt dim, PetscInt n, const PetscReal corner[], DemSurface *surface);
PetscErrorCode DemSurfaceCreateBox(PetscInt dim, const PetscReal low[3], const PetscReal high[3], DemSurface *surface);
/* A group of facets of a mesh (quadrilaterals are split, of quadratic cells the corners count); "" = all facets. */
PetscErrorCode DemSurfaceCreateFromMesh(const Mesh *mesh, PetscInt dim, const char *group, DemSurface *surface);
/* By its ending: .stl (text or binary), else gmsh's. scale: metres in a unit of the file. group: of a gmsh file. size: of a .geo's elements, 0 = its own. */
PetscErrorCode DemSurfaceRead(MPI_Comm comm, const char *file, PetscInt dim, const char *group, PetscReal scale, PetscReal size, DemSurface *surface);
PetscErrorCode DemSurfaceDestroy(DemSurface *surface);

/* Prepare for spheres up to this radius. Once, before DemSurfaceTouch(). */
PetscErrorCode DemSurfaceSetReach(DemSurface *surface, PetscReal reach);
/* Where a sphere (radius <= reach) touches, nearest first; returns how many. Plain and safe for threads. */
PetscInt DemSurfaceTouch(const DemSurface *surface, const PetscReal centre[3], PetscReal radius, DemTouch touch[DEM_TOUCHES]);
/* The same by trying every cell: the slow twin, for tests. */
PetscInt DemSurfaceTouchAll(const DemSurface *surface, const PetscReal centre[3], PetscReal radius, DemTouch touch[DEM_TOUCHES]);

/* Of a point from the surface [m], by trying every cell. */
PetscReal DemSurfaceDistance(const DemSurface *surface, const PetscReal x[3]);

/* A surface that moves and bends: after its x has changed, normals anew; and, once a node has moved by more than the reach has to spare, the grid. */
void           DemSurfaceNormals(DemSurface *surface);
PetscErrorCode DemSurfaceRegrid(DemSurface *surface);
PetscBool      DemSurfaceNear(const DemSurface *surface, const PetscReal x[3]); /* may a point within `reach` be on the surface? false is certain */
/* The foot of a touch: a cell it belongs to, and the share of each of the cell's corners; shares add to 1. Eq. (5.70) */
void           DemSurfaceFoot(const DemSurface *surface, const DemTouch *touch, const PetscReal centre[3], PetscInt *cell, PetscReal share[3]);

/* A nearer touch hides those whose normal is within 10 degrees of its own: they are one smooth part of the surface.  Eq. (5.52) */
#define DEM_SMOOTH_COSINE 0.984807753012208

/* Volume [m3] (2D: area x thickness), centre of mass [m] and moments of inertia per density about it, [3][3] [m5]; exact for the
   polyhedron.  Eqs (5.60), (5.61). PETSC_ERR_USER_INPUT for a surface that is not closed. */
PetscErrorCode DemSurfaceMass(const DemSurface *surface, PetscReal thickness, PetscReal *volume, PetscReal centre[3], PetscReal inertia[3][3]);
