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

PetscReal DemSofteningAt(const DemStrength *s, PetscReal k, PetscReal D)
{
  const PetscReal st = s->tensile, w2 = DemSofteningEnd(s), w1 = s->knee_opening * s->fracture_energy / st, w0 = s->fracture_energy / st;
  PetscReal       w = 0;

  /* (1 - D)(t + k w) = t on each straight piece t = st - a w */
  if (s->softening == DEM_SOFTENING_LINEAR) return D * st / ((1 - D) * k + D * st / w2);
  if (s->softening == DEM_SOFTENING_BILINEAR) {
    const PetscReal b = s->knee_stress * st / (w2 - w1);

    w = D * st / ((1 - D) * k + D * (1 - s->knee_stress) * st / w1);
    return w <= w1 ? w : D * b * w2 / ((1 - D) * k + D * b);
  }
  if (D >= 1) return PETSC_MAX_REAL;
  for (int it = 0; it < 100; it++) { /* (1 - D) k w = D t: convex, from the left */
    const PetscReal t = st * PetscExpReal(-w / w0), step = (D * t - (1 - D) * k * w) / (D * t / w0 + (1 - D) * k);

    w += step;
    if (PetscAbsReal(step) < 1e-14 * w0) break;
  }
  return w;
}

PetscReal DemSofteningInverse(const DemStrength *s, PetscReal t)
{
  const PetscReal st = s->tensile, w2 = DemSofteningEnd(s), w1 = s->knee_opening * s->fracture_energy / st;

  if (s->softening == DEM_SOFTENING_EXPONENTIAL) return -s->fracture_energy / st * PetscLogReal(t / st);
  if (s->softening == DEM_SOFTENING_LINEAR) return w2 * (1 - t / st);
  if (t >= s->knee_stress * st) return w1 * (1 - t / st) / (1 - s->knee_stress);
  return w2 - (w2 - w1) * t / (s->knee_stress * st);
}

DemTooth DemToothOf(const DemStrength *curve, PetscReal k, PetscReal s, PetscReal D)
{
  const PetscReal st = curve->tensile, teeth = curve->teeth > 0 ? curve->teeth : 1;
  DemTooth        tooth = {.damage = D, .margin = (1 - D) * s / st - 1 - DEM_TOOTH_FIRST};
  PetscReal       t, now, before, w, fine, band;

  if (D >= 1) tooth.margin = -1;
  if (s <= st || D >= 1) return tooth;
  t            = DemSofteningStress(curve, DemSofteningOpening(curve, k, s));
  fine         = PetscMin(1, teeth + DEM_TOOTH_GROWS * (1 - t / st));
  band         = D > 0 ? fine * DEM_TOOTH_WAIT : DEM_TOOTH_FIRST;
  tooth.margin = ((1 - D) * s - t * (1 + band)) / st;
  if (tooth.margin <= 0) return tooth;
  tooth.beyond = (1 - D) * s / PetscMax(t, DEM_TOOTH_LAST * st);
  w            = DemSofteningAt(curve, k, D);
  before       = DemSofteningStress(curve, w) + k * w;
  tooth.damage = PetscMax(D, 1 - (1 - fine * DEM_TOOTH_CUT) * t / s);
  w            = DemSofteningAt(curve, k, tooth.damage);
  t            = DemSofteningStress(curve, w);
  now          = t + k * w;
  if (t <= DEM_TOOTH_LAST * st) { /* the last one takes what is left under the curve */
    now          = curve->softening == DEM_SOFTENING_EXPONENTIAL ? 2 * k * curve->fracture_energy / st + before - DemSofteningStress(curve, DemSofteningAt(curve, k, D)) : k * DemSofteningEnd(curve);
    tooth.damage = 1;
  }
  tooth.law = before * now / (s * s);
  return tooth;
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
