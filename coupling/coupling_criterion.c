/* coupling_criterion.c - how near its strength an element is.  Eqs (8.1), (8.2) */
#include "coupling_switch.h"

/* (a p + b q) / S with the mean stress p, positive in tension, and von Mises's q.  Eq. (8.12) */
static PetscReal MeanAndMises(const CouplingSwitchOptions *o, const PetscReal s[6])
{
  const PetscReal p = (s[0] + s[1] + s[2]) / 3;
  const PetscReal q = PetscSqrtReal(0.5 * (PetscSqr(s[0] - s[1]) + PetscSqr(s[1] - s[2]) + PetscSqr(s[2] - s[0])) + 3 * (PetscSqr(s[3]) + PetscSqr(s[4]) + PetscSqr(s[5])));

  return (o->given_mean * p + o->given_mises * q) / o->given_strength;
}

/* Fraction of the strength.  Eqs (8.1), (8.2), (8.12) */
PetscReal CouplingUse_Internal(const CouplingSwitchOptions *o, const DemStrength *strength, PetscInt dim, const PetscReal stress[6])
{
  PetscReal value[3], use = 0;

  if (o->when == COUPLING_GIVEN) return o->given ? o->given(o->given_ctx, dim, stress) : MeanAndMises(o, stress);
  DemPrincipalValues(dim, stress, value);
  if (strength->tensile > 0) use = PetscMax(0, value[0] / strength->tensile);
  if (o->when == COUPLING_MOHR_COULOMB && strength->shear > 0) {
    const PetscReal mu = strength->mu_static, middle = 0.5 * (value[0] + value[dim - 1]), radius = 0.5 * (value[0] - value[dim - 1]);

    use = PetscMax(use, (radius * PetscSqrtReal(1 + mu * mu) + mu * middle) / strength->shear);
  }
  return use;
}

PetscReal CouplingUseBound_Internal(const CouplingSwitchOptions *o, const DemStrength *strength)
{
  PetscReal least = PETSC_MAX_REAL;

  /* |p| <= |s| / sqrt(3), q <= sqrt(3/2) |s| */
  if (o->when == COUPLING_GIVEN) return o->given ? 0 : o->given_strength / (PetscAbsReal(o->given_mean) / PetscSqrtReal(3) + PetscAbsReal(o->given_mises) * PetscSqrtReal(1.5));
  if (strength->tensile > 0) least = strength->tensile;
  if (o->when == COUPLING_MOHR_COULOMB && strength->shear > 0) least = PetscMin(least, strength->shear / (1 + strength->mu_static));
  return least;
}
