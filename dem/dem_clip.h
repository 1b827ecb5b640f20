/* dem_clip.h - a convex cell cut by planes, in 2D (our polygon) or 3D (voro++'s), and what the cells need of it. */
#pragma once
#include "base.h"
#include "voro_shim.h"

/* Counter-clockwise corners; edge k runs from corner k to k + 1 and carries id[k]. */
typedef struct {
  int     n, room;
  double *x;      /* [room][2] */
  int    *id;     /* [room] */
  double *s;      /* [room] work */
  double *corner; /* [2 room][3] facets as segments, on loan by DemClipFacets */
  int    *start;  /* [room + 1] */
} DemPolygon;

typedef struct {
  PetscInt   dim;
  DemPolygon polygon;
  VoroCell  *cell;
} DemClip;

/* Called by threads: no PETSc memory, no error handler. Functions that return int give 0, or 1 when out of memory. */
int  DemClipCreate(PetscInt dim, DemClip *clip);
void DemClipDestroy(DemClip *clip);

/* The cube (square) [-1, 1]; its faces have the ids -1 .. -6. */
void DemClipBox(DemClip *clip);
/* Keep normal.x <= offset; the new facet carries id. some = false when nothing is left. */
int       DemClipCut(DemClip *clip, const PetscReal normal[3], PetscReal offset, PetscInt id, PetscBool *some);
int       DemClipCopy(DemClip *to, DemClip *from);
PetscReal DemClipReach(DemClip *clip); /* farthest corner from the origin */
/* Corners [n][3], on loan likewise. */
PetscInt DemClipCorners(DemClip *clip, const double **corner);
/* Facets with corners in order; 2D facets are segments. On loan until the next call on this clip. */
PetscInt DemClipFacets(DemClip *clip, const int **id, const int **start, const double **corner);
