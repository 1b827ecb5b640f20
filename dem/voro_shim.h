/*
  voro_shim.h - voro++'s convex cell in C: a polyhedron around the origin that planes cut.

  Only the cell is voro++'s; the search for neighbours is ours (dem_cells.c), so that threads share nothing. voro++
  takes a corner within a fixed small distance of a plane as lying on it: keep coordinates near 1.
*/
#pragma once

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct VoroCell VoroCell;

VoroCell *VoroCellCreate(void); /* NULL when out of memory */
void      VoroCellDestroy(VoroCell *cell);
void      VoroCellBox(VoroCell *cell, const double low[3], const double high[3]);     /* faces -1 -x, -2 +x, -3 -y .. -6 +z */
int       VoroCellCut(VoroCell *cell, const double normal[3], double offset, int id); /* keep normal.x <= offset; 0: nothing left */
void      VoroCellCopy(VoroCell *to, VoroCell *from);
double    VoroCellReach(VoroCell *cell);                          /* distance of the farthest corner from the origin */
int       VoroCellCorners(VoroCell *cell, const double **corner); /* [n][3], on loan until the next call on this cell */

/* Facets: id [n], corners corner[start[f]..start[f+1]) [..][3] in order around. On loan until the next call on this cell. */
int VoroCellFacets(VoroCell *cell, const int **id, const int **start, const double **corner);

#if defined(__cplusplus)
}
#endif
