/* dem_packing.h - spheres (2D: discs) that fill a body, deterministic by seed.  docs/theory.md 3.2 */
#pragma once
#include "dem_body.h"

typedef struct {
  PetscInt   n;
  PetscReal *x; /* [n][3] centre [m]; z = 0 in 2D */
  PetscReal *r; /* [n] radius [m] */
} DemPacking;

typedef struct {
  PetscReal radius; /* mean [m]; 0 = from count */
  PetscReal spread; /* half width of the uniform size distribution / mean, in [0, 0.6] */
  PetscInt  count;  /* wanted number; 0 = from radius */
  PetscInt  seed;
  PetscInt  iterations; /* of the gap functional; 0 = default */
  PetscReal porosity;   /* > 0: grains apart from each other, at about this porosity; 0: close-packed */
} DemPackingOptions;

/* What the papers report and what a user checks. Design section 0 defines porosity and coordination. */
typedef struct {
  PetscReal porosity;                         /* exact: each sphere's volume within its own power cell, summed.  Eq. (3.7) */
  PetscReal coordination_10, coordination_15; /* neighbours with gap <= 0.10, 0.15 (r_i + r_j) */
  PetscReal mean_radius, relative_deviation;
  PetscReal largest_overlap; /* / (r_i + r_j) */
  PetscReal flatness;        /* largest |distance to its face - r| / r over the outermost particles */
  PetscInt  outermost;       /* particles nearer to the boundary than 1.25 r */
  PetscReal smallest_cell;   /* smallest cell volume / mean: the time step hangs on it */
} DemPackingReport;

PetscErrorCode DemPackingCreate(const DemBody *body, const DemPackingOptions *options, DemPacking *packing);
/* Grains that come later (DemModelSetRain()): options->count of them, all at the body's middle until then. */
PetscErrorCode DemPackingCreateRain(const DemBody *body, const DemPackingOptions *options, DemPacking *packing);
/* Text table "x y z r" or "x,y,z,r", '#' comments; a centre outside the body or a bad line is PETSC_ERR_USER_INPUT with its line. */
PetscErrorCode DemPackingRead(const char *file, const DemBody *body, PetscBool trim, DemPacking *packing); /* trim: leave out centres outside the body */
PetscErrorCode DemPackingWrite(const DemPacking *packing, const char *file);
PetscErrorCode DemPackingGetReport(const DemPacking *packing, const DemBody *body, DemPackingReport *report);
PetscErrorCode DemPackingDestroy(DemPacking *packing);
