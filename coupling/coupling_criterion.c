/* coupling_criterion.c - how near its strength an element is.  Eqs (8.1), (8.2) */
#include "coupling_switch.h"

/* Fraction of the strength.  Eqs (8.1), (8.2) */
PetscReal CouplingUse_Internal(CouplingCriterion when, const DemStrength *strength, PetscInt dim, const PetscReal stress[6])
{
  PetscReal value[3], use = 0;

  DemPrincipalValues(dim, stress, value);
  if (strength->tensile > 0) use = PetscMax(0, value[0] / strength->tensile);
  if (when == COUPLING_MOHR_COULOMB && strength->shear > 0) {
    const PetscReal mu = strength->mu_static, middle = 0.5 * (value[0] + value[dim - 1]), radius = 0.5 * (value[0] - value[dim - 1]);

    use = PetscMax(use, (radius * PetscSqrtReal(1 + mu * mu) + mu * middle) / strength->shear);
  }
  return use;
}
