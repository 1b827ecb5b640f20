/* dem_failure.c - softening curves and the series of spring and crack. */
#include "dem_failure.h"

PetscReal DemSofteningEnd(const DemStrength *s)
{
  const PetscReal w1 = s->knee_opening * s->fracture_energy / s->tensile;

  switch (s->softening) {
  case DEM_SOFTENING_LINEAR: return 2 * s->fracture_energy / s->tensile;
  case DEM_SOFTENING_BILINEAR: return (2 * s->fracture_energy / s->tensile - w1) / s->knee_stress;
  default: return PETSC_MAX_REAL;
  }
}

PetscReal DemSofteningStress(const DemStrength *s, PetscReal w)
{
  const PetscReal st = s->tensile, w1 = s->knee_opening * s->fracture_energy / st, w2 = DemSofteningEnd(s);

  if (s->softening == DEM_SOFTENING_EXPONENTIAL) return st * PetscExpReal(-st * w / s->fracture_energy);
  if (w >= w2) return 0;
  if (s->softening == DEM_SOFTENING_LINEAR) return st * (1 - w / w2);
  if (w < w1) return st - (1 - s->knee_stress) * st * w / w1;
  return s->knee_stress * st * (w2 - w) / (w2 - w1);
}

PetscReal DemSofteningOpening(const DemStrength *s, PetscReal k, PetscReal stress)
{
  const PetscReal st = s->tensile, w2 = DemSofteningEnd(s);

  if (s->softening == DEM_SOFTENING_LINEAR) return (stress - st) / (k - st / w2);
  if (s->softening == DEM_SOFTENING_BILINEAR) {
    const PetscReal w1 = s->knee_opening * s->fracture_energy / st, r = s->knee_stress;
    const PetscReal w  = (stress - st) / (k - (1 - r) * st / w1);

    return w < w1 ? w : (stress - r * st * w2 / (w2 - w1)) / (k - r * st / (w2 - w1));
  }
  /* t is convex and t + k w increasing: Newton from 0 approaches from the left and does not overshoot twice */
  const PetscReal w0 = s->fracture_energy / st;
  PetscReal       w  = 0;

  for (int it = 0; it < 60; it++) {
    const PetscReal t = st * PetscExpReal(-w / w0), step = -(t + k * w - stress) / (k - t / w0);

    w = PetscMax(0, w + step);
    if (PetscAbsReal(step) < 1e-15 * w0) break;
  }
  return w;
}

PetscReal DemSofteningLongest(const DemStrength *s, PetscReal g_shear)
{
  const PetscReal st = s->tensile, w2 = DemSofteningEnd(s), w1 = s->knee_opening * s->fracture_energy / st;
  PetscReal       slope; /* steepest fall of t [Pa/m] */

  switch (s->softening) {
  case DEM_SOFTENING_LINEAR: slope = st / w2; break;
  case DEM_SOFTENING_BILINEAR: slope = PetscMax((1 - s->knee_stress) * st / w1, s->knee_stress * st / (w2 - w1)); break;
  default: slope = st * st / s->fracture_energy;
  }
  return 2 * g_shear / slope;
}

PetscReal DemShearLongest(const DemStrength *s, PetscReal g_shear)
{
  return 4 * g_shear * s->shear_energy / PetscSqr(s->shear);
}
