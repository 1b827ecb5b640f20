/* dem_cells_impl.h - the diagram with what the packing's report asks besides. */
#pragma once
#include "dem_cells.h"

/* solid [n], or NULL: volume of each sphere within its own cell [m3]; their sum is the volume of the union. */
PetscErrorCode DemCellsBuild(const DemBody *body, const DemPacking *packing, DemCells *cells, PetscReal *solid);

/* Volume of the ball of radius R around the origin within the cone from the origin over a polygon, signed as `height`.
   corner [n][3] in order around; normal: outward unit normal; height = normal.corner.  Eq. (3.8) */
PetscReal DemBallInCone(PetscInt n, const double *corner, const PetscReal normal[3], PetscReal height, PetscReal R);
/* Area of the disc within the triangle from the origin over a segment.  Eq. (3.9) */
PetscReal DemDiscInTriangle(const double *corner, const PetscReal normal[3], PetscReal height, PetscReal R);
