/* tool_cases.h - loose spheres and surfaces that the tests of tools share. */
#pragma once
#include "check.h"
#include "dem.h"
#include "dem_solve.h"

/* n loose spheres (2D: discs) in a box that is only their room; density 1000, young 1e7, poisson 0.25. Not set up. */
static inline PetscErrorCode Spheres(PetscInt dim, PetscInt n, const PetscReal x[][3], const PetscReal r[], PetscInt threads, DemModel *model)
{
  const DemMaterial material = {1000, 1e7, 0.25};
  DemBody           body;
  DemPacking        packing = {.n = n};
  DemCells          cells;

  PetscFunctionBegin;
  PetscCall(DemBodyCreateBox(dim, (PetscReal[3]){-50, -50, -50}, (PetscReal[3]){50, 50, 50}, 1, &body));
  PetscCall(PetscMalloc1(3 * n, &packing.x));
  PetscCall(PetscMalloc1(n, &packing.r));
  for (PetscInt k = 0; k < n; k++) {
    packing.r[k] = r[k];
    for (PetscInt d = 0; d < 3; d++) packing.x[3 * k + d] = x[k][d];
  }
  PetscCall(DemCellsCreate(&body, &packing, &cells));
  PetscCall(DemModelCreate(PETSC_COMM_SELF, model));
  PetscCall(DemModelSetKind(*model, dim == 3 ? DEM_SOLID : DEM_PLANE_STRAIN));
  PetscCall(DemModelSetThreads(*model, threads));
  PetscCall(DemModelSetMaterial(*model, &material));
  PetscCall(DemModelSetBody(*model, &body, &packing, &cells));
  PetscCall(DemModelSetBonded(*model, PETSC_FALSE));
  PetscCall(DemCellsDestroy(&cells));
  PetscCall(DemPackingDestroy(&packing));
  PetscCall(DemBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A patch of the plane through `o` spanned by a and b, [-size, size]^2: m x m squares with shaken inner nodes, cut along either diagonal. */
static inline PetscErrorCode Sheet(PetscInt m, const PetscReal o[3], const PetscReal a[3], const PetscReal b[3], PetscReal size, uint64_t seed, DemSurface *surface)
{
  PetscReal(*node)[3], (*corner)[3][3];
  PetscInt n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2((m + 1) * (m + 1), &node, 2 * m * m, &corner));
  for (PetscInt j = 0; j <= m; j++)
    for (PetscInt i = 0; i <= m; i++) {
      const PetscReal h = 2 * size / m, s = -size + h * i + (i > 0 && i < m ? 0.6 * h * (TestRandom(&seed) - 0.5) : 0), t = -size + h * j + (j > 0 && j < m ? 0.6 * h * (TestRandom(&seed) - 0.5) : 0);

      for (PetscInt d = 0; d < 3; d++) node[j * (m + 1) + i][d] = o[d] + s * a[d] + t * b[d];
    }
  for (PetscInt j = 0; j < m; j++)
    for (PetscInt i = 0; i < m; i++) {
      const PetscInt q[4] = {j * (m + 1) + i, j * (m + 1) + i + 1, (j + 1) * (m + 1) + i + 1, (j + 1) * (m + 1) + i}, turn = TestRandom(&seed) < 0.5;

      for (PetscInt t = 0; t < 2; t++, n++)
        for (PetscInt k = 0; k < 3; k++)
          for (PetscInt d = 0; d < 3; d++) corner[n][k][d] = node[q[(turn + (k ? k + t : 0)) % 4]][d];
    }
  PetscCall(DemSurfaceCreate("sheet", 3, n, &corner[0][0][0], surface));
  PetscCall(PetscFree2(node, corner));
  PetscFunctionReturn(PETSC_SUCCESS);
}
