/* dem_body_impl.h - questions that packing and cells ask a body often: inside? which pieces, which walls are near? */
#pragma once
#include "dem_body.h"

PetscErrorCode DemBodyAllocate(PetscInt n_pieces, PetscInt n_planes, PetscInt n_simplices, PetscInt n_faces, DemBody *body);

/* A grid over the body: pieces whose box meets a cell, boundary simplices that come within `reach` of a cell. */
typedef struct {
  const DemBody *body; /* borrowed */
  PetscReal      reach, low[3], width;
  PetscInt       m[3];
  PetscInt      *piece_start, *piece; /* CSR; NULL when the body is one piece */
  PetscInt      *wall_start, *wall;   /* CSR; NULL when made with reach 0 */
  PetscReal     *out;                 /* [n_simplices][4] outward plane of each simplex; with reach 0: NULL */
  unsigned char *bend;                /* [n_simplices][dim] 1: a sphere inside the body may touch corner k; 2 (3D): the edge k, k + 1 */
} DemBodySearch;

/* A place where the boundary is nearest: what a sphere around x would touch. */
typedef struct {
  PetscReal distance; /* [m] > 0 */
  PetscReal inward[3];
  PetscInt  simplex;
  PetscBool flat; /* the foot lies in the simplex, not on a re-entrant edge or corner */
} DemWall;

#define DEM_MAX_WALLS 12

PetscErrorCode DemBodySearchCreate(const DemBody *body, PetscReal reach, PetscReal width, DemBodySearch *search);
PetscErrorCode DemBodySearchDestroy(DemBodySearch *search);

/* Outward unit normal of a boundary simplex. */
void      DemBodyNormal(PetscInt dim, const PetscReal *simplex, PetscReal n[3]);
PetscBool DemBodySearchInside(const DemBodySearch *search, const PetscReal x[3]);
/* The ball of this radius around a point inside the body lies inside it; a radius above `reach` is answered by no. */
PetscBool DemBodySearchClear(const DemBodySearch *search, const PetscReal x[3], PetscReal radius);
/* Walls of a point inside the body within `reach`, nearest first; returns how many (at most DEM_MAX_WALLS). */
PetscInt DemBodySearchWalls(const DemBodySearch *search, const PetscReal x[3], PetscReal reach, DemWall wall[DEM_MAX_WALLS]);
