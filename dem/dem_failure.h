/*
  dem_failure.h - how a facet of the `exact` rule breaks: pure functions of one bond.  Eqs (4.20)-(4.28), docs/theory.md

  A facet keeps the fraction 1 - D of itself. The facet's own spring is in series with the crack: its total traction t~
  (what the whole facet would carry) rules D so that the carried part follows the softening curve.
*/
#pragma once
#include "base.h"

typedef enum { DEM_SOFTENING_LINEAR, DEM_SOFTENING_BILINEAR, DEM_SOFTENING_EXPONENTIAL } DemSoftening;

/* Strengths of a material; tensile = 0 or shear = 0 turns that criterion off. */
typedef struct {
  PetscReal    tensile;         /* [Pa] sigma_t */
  PetscReal    fracture_energy; /* [J/m2] G_f */
  DemSoftening softening;
  PetscReal    knee_stress;     /* [-] r: knee at (w_1, r sigma_t) */
  PetscReal    knee_opening;    /* [-] w_1 sigma_t / G_f */
  PetscReal    shear;           /* [Pa] tau_f, cohesion */
  PetscReal    shear_energy;    /* [J/m2] G_II */
  PetscReal    mu_static;       /* [-] raises the shear strength under compression */
  PetscReal    mu_dynamic;      /* [-] of broken, closed facets */
} DemStrength;

/* Opening at which the curve ends, G_f-true [m]; infinite for the exponential. */
PetscReal DemSofteningEnd(const DemStrength *strength);
/* Carried traction at opening w [Pa].  Eq. (4.22) */
PetscReal DemSofteningStress(const DemStrength *strength, PetscReal w);
/* Opening at which t(w) + k w = s, k [Pa/m] the facet's unloading stiffness; s > sigma_t.  Eq. (4.23) */
PetscReal DemSofteningOpening(const DemStrength *strength, PetscReal k, PetscReal s);
/* Longest effective distance the curve allows, so that k stays above its steepest slope [m].  Eq. (4.24) */
PetscReal DemSofteningLongest(const DemStrength *strength, PetscReal g_shear);
PetscReal DemShearLongest(const DemStrength *strength, PetscReal g_shear);

/* Broken fraction in tension: largest s = t~.e / c so far over sigma_t, effective distance d_e = c d.  Eq. (4.21) */
static inline PetscReal DemDamageTension(const DemStrength *strength, PetscReal g_shear, PetscReal d_e, PetscReal s)
{
  PetscReal t;

  if (s <= strength->tensile) return 0;
  t = DemSofteningStress(strength, DemSofteningOpening(strength, 2 * g_shear / d_e, s));
  return t <= 0 ? 1 : 1 - t / s;
}

/* Broken fraction in shear: r = (|t~_s| + mu t~_n) / tau_f.  Eq. (4.25) */
static inline PetscReal DemDamageShear(const DemStrength *strength, PetscReal g_shear, PetscReal d, PetscReal r)
{
  const PetscReal end = 2 * strength->shear_energy / strength->shear;

  if (r <= 1) return 0;
  return PetscMin(1, (1 - 1 / r) / (1 - strength->shear * d / (2 * g_shear * end)));
}
