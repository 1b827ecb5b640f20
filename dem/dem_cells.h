/*
  dem_cells.h - the power (Laguerre) diagram of a packing, clipped by its body.  Eqs (3.1)-(3.3), docs/theory.md

  3D cells by voro++ (voro_shim.cc), 2D by our own polygon clip. Both cut each cell by the body's convex pieces, so
  volumes and boundary facets sum to the body's.
*/
#pragma once
#include "dem_packing.h"

typedef struct {
  PetscInt   n;        /* cells = particles */
  PetscReal *volume;   /* [n] [m3] */
  PetscReal *centroid; /* [n][3] [m] */

  /* Facets between particles p < q, sorted by p then q. n points from p to q. */
  PetscInt   n_facets;
  PetscInt  *p, *q; /* [n_facets] */
  PetscReal *area;  /* [n_facets] [m2] */
  PetscReal *at;    /* [n_facets][3] facet centroid [m] */

  /* Boundary facets: one per particle, face and plane, sorted by particle. */
  PetscInt   n_walls;
  PetscInt  *wall_p;      /* [n_walls] */
  PetscInt  *wall_face;   /* [n_walls] face of the body */
  PetscReal *wall_area;   /* [n_walls] [m2] */
  PetscReal *wall_at;     /* [n_walls][3] centroid [m] */
  PetscReal *wall_normal; /* [n_walls][3] outward unit normal */

  /* Corners of the facets, for crack output: facet f has corner[facet_start[f]..facet_start[f+1]) in order around it
     (2D: the two ends); when a facet was cut by pieces, its pieces follow one another, each closed by its first corner. */
  PetscInt *facet_start;
  float    *corner; /* [..][3] from the facet's centroid [m]; single precision: they are most of a cell's memory */
} DemCells;

PetscErrorCode DemCellsCreate(const DemBody *body, const DemPacking *packing, DemCells *cells);
PetscErrorCode DemCellsDropCorners(DemCells *cells); /* of a body that cannot crack; facet_start and corner are NULL then */
PetscErrorCode DemCellsDestroy(DemCells *cells);
