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

void DemPrincipalValues(PetscInt dim, const PetscReal s[6], PetscReal value[3])
{
  if (dim == 2) {
    const PetscReal mean = 0.5 * (s[0] + s[1]), half = 0.5 * (s[0] - s[1]), radius = PetscSqrtReal(half * half + s[3] * s[3]);

    value[0] = mean + radius;
    value[1] = value[2] = mean - radius;
    return;
  }
  const PetscReal mean = (s[0] + s[1] + s[2]) / 3, x = s[0] - mean, y = s[1] - mean, z = s[2] - mean;
  const PetscReal second = 0.5 * (x * x + y * y + z * z) + s[3] * s[3] + s[4] * s[4] + s[5] * s[5], radius = 2 * PetscSqrtReal(second / 3); /* J2 */
  const PetscReal third = x * y * z + 2 * s[3] * s[4] * s[5] - x * s[4] * s[4] - y * s[5] * s[5] - z * s[3] * s[3];
  const PetscReal cosine = radius > 0 ? PetscMax(-1, PetscMin(1, 4 * third / (radius * radius * radius))) : 1, angle = PetscAcosReal(cosine) / 3;

  value[0] = mean + radius * PetscCosReal(angle);
  value[1] = mean + radius * PetscCosReal(angle - 2 * PETSC_PI / 3);
  value[2] = mean + radius * PetscCosReal(angle + 2 * PETSC_PI / 3);
}
