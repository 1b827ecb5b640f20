/* dem_pack_report.c - what a packing is like: porosity, neighbours, overlaps, how flat its faces are. */
#include "dem_cells_impl.h"
#include "dem_pack_impl.h"

PetscErrorCode DemPackingGetReport(const DemPacking *packing, const DemBody *body, DemPackingReport *report)
{
  const PetscInt n = packing->n;
  PetscReal     *solid, sum = 0, r_max = 0, square = 0, smallest = PETSC_MAX_REAL;
  PetscInt      *start, *nbr, near_10 = 0, near_15 = 0;
  DemCells       cells;
  DemBodySearch  search;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(report, sizeof(*report)));
  PetscCall(PetscMalloc1(n, &solid));
  PetscCall(DemCellsBuild(body, packing, &cells, solid));
  for (PetscInt p = 0; p < n; p++) {
    sum += solid[p];
    smallest = PetscMin(smallest, cells.volume[p]);
    r_max = PetscMax(r_max, packing->r[p]);
    report->mean_radius += packing->r[p] / n;
  }
  report->porosity = 1 - sum / DemBodyVolume(body);
  report->smallest_cell = smallest * n / DemBodyVolume(body);
  for (PetscInt p = 0; p < n; p++) square += PetscSqr(packing->r[p] / report->mean_radius - 1) / n;
  report->relative_deviation = PetscSqrtReal(square);
  PetscCall(DemPackNeighbours(body->dim, n, packing->x, packing->r, 0.16, &start, &nbr));
  for (PetscInt p = 0; p < n; p++)
    for (PetscInt k = start[p]; k < start[p + 1]; k++) {
      const PetscInt   q = nbr[k];
      const PetscReal *x = &packing->x[3 * p], *y = &packing->x[3 * q], reach = packing->r[p] + packing->r[q];
      const PetscReal  gap = PetscSqrtReal(PetscSqr(x[0] - y[0]) + PetscSqr(x[1] - y[1]) + PetscSqr(x[2] - y[2])) / reach - 1;

      near_10 += gap <= 0.10;
      near_15 += gap <= 0.15;
      report->largest_overlap = PetscMax(report->largest_overlap, -gap);
    }
  report->coordination_10 = (PetscReal)near_10 / n;
  report->coordination_15 = (PetscReal)near_15 / n;
  PetscCall(DemBodySearchCreate(body, 1.3 * r_max, 2 * report->mean_radius, &search));
  for (PetscInt p = 0; p < n; p++) {
    DemWall        wall[DEM_MAX_WALLS];
    const PetscInt m = DemBodySearchWalls(&search, &packing->x[3 * p], 1.25 * packing->r[p], wall);

    if (!m) continue;
    report->flatness = PetscMax(report->flatness, PetscAbsReal(wall[0].distance / packing->r[p] - 1));
    report->outermost++;
  }
  PetscCall(DemBodySearchDestroy(&search));
  PetscCall(DemCellsDestroy(&cells));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(nbr));
  PetscCall(PetscFree(solid));
  PetscFunctionReturn(PETSC_SUCCESS);
}
