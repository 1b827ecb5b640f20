/*
  dem_failure.h - how a bond breaks: pure functions of one bond.  Eqs (4.20)-(4.28), (4.50)-(4.62), docs/theory.md

  Cohesive law (the `exact` rule): a facet keeps the fraction 1 - D of itself. The facet's own spring is in series with the crack: its total traction t~
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
  PetscBool    nonlocal;        /* onset by the mean stress of the two particles: in shear, and under the published law in tension too */
  PetscReal    teeth;           /* [-] of load steps, near the strength, over the largest; 0 = 1.  Eq. (4.84) */
  /* Published law (rules other than `exact`) */
  PetscBool    published;
  PetscReal    delta_n, delta_s;    /* [-] (end - limit) / limit of elongation, of slide; 0 = from fracture_energy, shear_energy */
  PetscInt     n_branches;          /* of compression beyond the elastic one, 0 to 3 */
  PetscReal    crush[3], reduce[3]; /* stress [Pa] where branch i begins, and by what Young's modulus is divided on it */
} DemStrength;

/* Opening at which the curve ends, G_f-true [m]; infinite for the exponential. */
PetscReal DemSofteningEnd(const DemStrength *strength);
/* Carried traction at opening w [Pa].  Eq. (4.22) */
PetscReal DemSofteningStress(const DemStrength *strength, PetscReal w);
/* Opening at which t(w) + k w = s, k [Pa/m] the facet's unloading stiffness; s > sigma_t.  Eq. (4.23) */
PetscReal DemSofteningOpening(const DemStrength *strength, PetscReal k, PetscReal s);
/* A curve cut into teeth, for load steps: a facet of broken fraction D waits until it carries more than its curve by a part of it, and then falls
   below the curve by another.  Eq. (4.84) */
#define DEM_TOOTH_FIRST 0.002 /* beyond the strength, of the first tooth: what lifts a peak; */
#define DEM_TOOTH_WAIT  0.02  /* beyond the curve, of every other */
#define DEM_TOOTH_CUT   0.03  /* below what the curve carries */
#define DEM_TOOTH_GROWS 2.5   /* both begin at curve->teeth of that, and are whole where the curve has fallen by (1 - teeth)/2.5 of the strength: which way a crack goes is settled before */
#define DEM_TOOTH_LAST  0.02  /* of the strength: no further tooth */
typedef struct {
  PetscReal damage; /* after the tooth, or D */
  PetscReal margin; /* carried above the curve, less the band, in strengths; the tooth is cut when > 0 */
  PetscReal beyond; /* carried over what the curve carries: the tooth that is furthest beyond goes first; 0 without one */
  PetscReal law;    /* the curve's part of Y (D' - D).  Eq. (4.86) */
} DemTooth;

DemTooth DemToothOf(const DemStrength *curve, PetscReal k, PetscReal s, PetscReal damage); /* s: what the whole facet would carry [Pa] */
/* Opening at which the curve's facet has lost D; opening at which it carries t.  */
PetscReal DemSofteningAt(const DemStrength *strength, PetscReal k, PetscReal damage);
PetscReal DemSofteningInverse(const DemStrength *strength, PetscReal t);
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

/* Softening range of a bond: given, or what the fracture energy leaves after the elastic part.  Eq. (4.53) */
static inline PetscReal DemPublishedDelta(PetscReal given, PetscReal energy, PetscReal strength, PetscReal area, PetscReal stiffness)
{
  return given > 0 ? given : 2 * energy * stiffness / (strength * strength * area) - 1;
}

/* Stiffness lost under the published law when the largest force of the whole bond so far is r limits.  Eq. (4.52) */
static inline PetscReal DemPublishedLoss(PetscReal r, PetscReal delta)
{
  if (r <= 1) return 0;
  return r >= 1 + delta ? 1 : 1 - (1 - (r - 1) / delta) / r;
}

/* Compressive stress of the envelope where an elastic bond would carry s [Pa].  Eq. (4.58) */
static inline PetscReal DemCrushStress(const DemStrength *strength, PetscReal s)
{
  PetscReal t = 0, begin = 0, slope = 1; /* stress, elastic stress and slope at the start of the branch at hand */

  for (PetscInt b = 0; b < strength->n_branches; b++) {
    const PetscReal end = begin + (strength->crush[b] - t) / slope;

    if (s <= end) break;
    t     = strength->crush[b];
    begin = end;
    slope = 1 / strength->reduce[b];
  }
  return t + slope * (s - begin);
}

/* Principal values, largest first, of a symmetric tensor xx yy zz xy yz zx; in 2D the two of the plane, in first and last place.  */
void DemPrincipalValues(PetscInt dim, const PetscReal s[6], PetscReal value[3]);
/* Largest of (|t_s| + mu t_n) / cohesion over all planes.  Eq. (4.61) */
static inline PetscReal DemMohrCoulomb(const PetscReal value[3], PetscReal mu, PetscReal cohesion)
{
  return (0.5 * (value[0] - value[2]) * PetscSqrtReal(1 + mu * mu) + 0.5 * mu * (value[0] + value[2])) / cohesion;
}
