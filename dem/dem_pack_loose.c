/*
  dem_pack_loose.c - spheres that touch nobody, for grains that gravity or a rain will lay down.  Eqs (5.80)-(5.82)

  A cubic lattice (2D: square) of the wanted porosity over the body's box, each sphere put at random where its own cell has
  room for it: no two overlap, whatever the seed. Cells whose sphere would stick out of the body stay empty.
*/
#include "dem_pack_impl.h"

#define STREAM_PLACE 20 /* of DemPackRandom */
#define PLACES 8        /* tried in a cell that the boundary cuts */

PetscErrorCode DemPackLoose(const DemBody *body, const DemPackingOptions *options, DemPacking *packing)
{
  const PetscInt  dim = body->dim;
  const PetscReal spread = options->spread, volume = DemBodyVolume(body) / body->thickness, solid = 1 - options->porosity;
  const PetscReal one = dim == 2 ? PETSC_PI * (1 + spread * spread / 3) : 4 * PETSC_PI / 3 * (1 + spread * spread);
  const PetscReal radius = options->count > 0 ? PetscPowReal(solid * volume / ((PetscReal)options->count * one), 1. / dim) : options->radius;
  const PetscReal side = radius * PetscPowReal(one / solid, 1. / dim), least = 1 - one / PetscPowReal(2 * (1 + spread), dim);
  PetscReal       width[3] = {0};
  PetscInt        cells[3] = {1, 1, 1}, all = 1, n = 0;
  DemBodySearch   search;

  PetscFunctionBegin;
  BaseCheckInput(side >= 2 * radius * (1 + spread) * (1 - 1e-12), PETSC_COMM_SELF, "Grains of spread %.6g laid out apart from each other leave a porosity of at least %.4g, not %.6g; they settle closer by themselves (porosity)", (double)spread,
                 (double)least, (double)options->porosity);
  for (PetscInt d = 0; d < dim; d++) {
    const PetscReal fit = (body->high[d] - body->low[d]) / side;

    BaseCheckInput(fit < 1e6, PETSC_COMM_SELF, "Grains of radius %.6g m would be %.6g in a row; ask for larger ones", (double)radius, (double)fit);
    cells[d] = (PetscInt)PetscFloorReal(fit * (1 + 1e-9));
    BaseCheckInput(cells[d] > 0, PETSC_COMM_SELF, "The body is %.6g m wide along %c; a grain and its share of the pores need %.6g m", (double)(body->high[d] - body->low[d]), (char)('x' + d), (double)side);
    width[d] = (body->high[d] - body->low[d]) / (PetscReal)cells[d];
    all *= cells[d];
  }
  PetscCall(PetscMalloc1(3 * all, &packing->x));
  PetscCall(PetscMalloc1(all, &packing->r));
  PetscCall(DemBodySearchCreate(body, radius * (1 + spread) * (1 + 1e-9), 2 * radius, &search));
  for (PetscInt k = 0; k < all; k++) {
    const PetscInt  at[3] = {k % cells[0], k / cells[0] % cells[1], k / cells[0] / cells[1]};
    const PetscReal r = radius * (1 + spread * (2 * DemPackRandom(options->seed, 0, k) - 1));

    for (PetscInt place = 0; place < PLACES; place++) {
      PetscReal x[3] = {0};

      for (PetscInt d = 0; d < dim; d++)
        x[d] = body->low[d] + ((PetscReal)at[d] + 0.5) * width[d] + (width[d] - 2 * r) * (1 - 1e-9) * (DemPackRandom(options->seed, STREAM_PLACE + d, PLACES * (PetscInt64)k + place) - 0.5);
      if (!DemBodySearchInside(&search, x) || !DemBodySearchClear(&search, x, r * (1 - 1e-9))) continue;
      for (PetscInt d = 0; d < 3; d++) packing->x[3 * n + d] = x[d];
      packing->r[n++] = r;
      break;
    }
  }
  PetscCall(DemBodySearchDestroy(&search));
  BaseCheckInput(n > 0, PETSC_COMM_SELF, "No grain of radius %.6g m fits into the body", (double)radius);
  packing->n = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}
