/*
  dem_packing.c - from options to a packing: how many spheres of what size, then start and relax.

  The sum of sphere volumes over the body's is `filling`; with it the number follows from the mean radius or the radius
  from the number. Near a wall there is less room for spheres: a layer of WALL_LOSS radii under the surface is left out of the count.
*/
#include "dem_pack_impl.h"

#define FILLING_3D 0.80
#define FILLING_2D 0.93
#define WALL_LOSS 0.3

PetscErrorCode DemPackingCreate(const DemBody *body, const DemPackingOptions *options, DemPacking *packing)
{
  const PetscInt  dim = body->dim;
  const PetscReal filling = dim == 2 ? FILLING_2D : FILLING_3D;
  const PetscReal spread = options->spread, volume = DemBodyVolume(body) / body->thickness;
  /* mean of (r/mean)^dim over a uniform distribution of half width `spread` */
  const PetscReal one = dim == 2 ? PETSC_PI * (1 + spread * spread / 3) : 4 * PETSC_PI / 3 * (1 + spread * spread);
  PetscReal       surface = 0, radius = options->radius, sum = 0;
  DemBodySearch   search;
  PetscInt        n;
  PetscBool      *seated;
  PetscErrorCode  code;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(packing, sizeof(*packing)));
  BaseCheckInput(spread >= 0 && spread <= 0.6, PETSC_COMM_SELF, "The spread of radii is %.6g; between 0 and 0.6 (spread)", (double)spread);
  BaseCheckInput((radius > 0) != (options->count > 0) && !PetscIsInfOrNanReal(radius), PETSC_COMM_SELF,
                 "A packing is given by its mean radius or by its count, one of them above 0 (radius %.6g m, count %" PetscInt_FMT ")", (double)radius,
                 options->count);
  if (options->porosity > 0) {
    BaseCheckInput(options->porosity < 1, PETSC_COMM_SELF, "A porosity of %.6g leaves no room for grains; it must be less than 1 (porosity)", (double)options->porosity);
    PetscCall(DemPackLoose(body, options, packing));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = 0; k < body->n_simplices; k++) {
    const PetscReal *s = &body->simplex[3 * dim * k];

    if (dim == 2) {
      surface += PetscSqrtReal(PetscSqr(s[3] - s[0]) + PetscSqr(s[4] - s[1]));
    } else {
      const PetscReal u[3] = {s[3] - s[0], s[4] - s[1], s[5] - s[2]}, v[3] = {s[6] - s[0], s[7] - s[1], s[8] - s[2]};

      surface += 0.5 * PetscSqrtReal(PetscSqr(u[1] * v[2] - u[2] * v[1]) + PetscSqr(u[2] * v[0] - u[0] * v[2]) + PetscSqr(u[0] * v[1] - u[1] * v[0]));
    }
  }
  if (options->count > 0) {
    n = options->count;
    radius = 0;
    for (PetscInt k = 0; k < 60; k++) /* contraction: the loss is a part of the volume */
      radius = 0.5 * radius + 0.5 * PetscPowReal(filling * PetscMax(0.3 * volume, volume - WALL_LOSS * radius * surface) / (n * one), 1. / dim);
  } else {
    const PetscReal want = filling * PetscMax(0.3 * volume, volume - WALL_LOSS * radius * surface) / (one * PetscPowReal(radius, dim));

    BaseCheckInput(want >= 0.5, PETSC_COMM_SELF, "Particles of radius %.6g m do not fit into a body of %.6g m%c; ask for smaller ones", (double)radius,
                   (double)volume, dim == 2 ? '2' : '3');
    BaseCheckInput(want < 1e8, PETSC_COMM_SELF, "Particles of radius %.6g m would be %.6g in number; ask for larger ones", (double)radius, (double)want);
    n = (PetscInt)PetscMax(1, want + 0.5);
  }
  packing->n = n;
  PetscCall(PetscMalloc1(3 * n, &packing->x));
  PetscCall(PetscMalloc1(n, &packing->r));
  PetscCall(PetscMalloc1(n, &seated));
  for (PetscInt p = 0; p < n; p++) sum += packing->r[p] = 1 + spread * (2 * DemPackRandom(options->seed, 0, p) - 1);
  for (PetscInt p = 0; p < n; p++) packing->r[p] *= radius * n / sum;
  /* finer than a sphere where the body's pieces are */
  PetscCall(DemBodySearchCreate(body, 3 * radius * (1 + spread), PetscMin(2 * radius, 2 * PetscPowReal(volume / body->n_pieces, 1. / dim)), &search));
  code = DemPackStart(&search, n, radius, options->seed, packing->x, seated);
  if (!code) code = DemPackRelax(&search, n, radius, options->iterations, seated, packing->x, packing->r);
  PetscCall(DemBodySearchDestroy(&search));
  PetscCall(PetscFree(seated));
  if (code) PetscCall(DemPackingDestroy(packing));
  PetscCall(code);
  sum = 0;
  for (PetscInt p = 0; p < n; p++) sum += packing->r[p];
  if (PetscAbsReal(sum / n - radius) > 0.02 * radius) {
    PetscCall(DemPackingDestroy(packing));
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
            "The body is narrower than particles of radius %.6g m: they shrink to %.6g m between its walls; ask for smaller ones", (double)radius,
            (double)(sum / n));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemPackingDestroy(DemPacking *packing)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(packing->x));
  PetscCall(PetscFree(packing->r));
  packing->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
