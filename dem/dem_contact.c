/* dem_contact.c - constants of a pair of materials in contact.  Eqs (5.20), (5.24), docs/theory.md */
#include "dem_contact.h"

/*
  ln e = -2 b cot b with b = acos(zeta); beyond critical damping b = i s, ln e = -2 s coth s with s = acosh(zeta).
  Falls from 0 at zeta = 0 without end.
*/
static PetscReal LogRestitution(PetscReal zeta)
{
  if (PetscAbsReal(zeta - 1) < 1e-9) return -2;
  if (zeta < 1) {
    const PetscReal b = PetscAcosReal(zeta);

    return -2 * b * zeta / PetscSqrtReal(1 - zeta * zeta);
  }
  return -2 * PetscAcoshReal(zeta) * zeta / PetscSqrtReal(zeta * zeta - 1);
}

PetscReal DemContactDamping(PetscReal e)
{
  const PetscReal goal = PetscLogReal(PetscMax(e, DEM_CONTACT_LEAST));
  PetscReal       low = 0, high = 32; /* e = 1e-3 needs 15.8 */

  if (e >= 1) return 0;
  for (int k = 0; k < 100; k++) {
    const PetscReal middle = 0.5 * (low + high);

    if (LogRestitution(middle) > goal) low = middle;
    else high = middle;
  }
  return 0.5 * (low + high);
}

PetscErrorCode DemContactPairSet(DemContactPair *pair, const DemContactChoice *c, DemContactElastic a, DemContactElastic b)
{
  const PetscReal flat = (a.young > 0 ? (1 - a.poisson * a.poisson) / a.young : 0) + (b.young > 0 ? (1 - b.poisson * b.poisson) / b.young : 0);
  const PetscReal skew = (a.young > 0 ? 2 * (2 - a.poisson) * (1 + a.poisson) / a.young : 0) + (b.young > 0 ? 2 * (2 - b.poisson) * (1 + b.poisson) / b.young : 0);
  const PetscReal mean = a.young > 0 && b.young > 0 ? 2 / (1 / a.young + 1 / b.young) : PetscMax(a.young, b.young);
  const PetscBool hertz = (PetscBool)(c->law == DEM_CONTACT_HERTZ);
  PetscReal       ratio;

  PetscFunctionBegin;
  BaseCheckInput(flat > 0 || (!hertz && c->stiffness > 0 && c->ratio > 0), PETSC_COMM_SELF, "Two rigid bodies cannot meet: give one of them a Young's modulus");
  BaseCheckInput(c->restitution >= 0 && c->restitution <= 1, PETSC_COMM_SELF, "Restitution %.6g must lie between 0 and 1", (double)c->restitution);
  BaseCheckInput(c->friction >= 0 && c->rolling >= 0 && c->twisting >= 0, PETSC_COMM_SELF, "Friction coefficients cannot be negative");
  BaseCheckInput(c->friction_static == 0 || c->friction_static >= c->friction, PETSC_COMM_SELF, "Static friction %.6g is less than the dynamic one, %.6g", (double)c->friction_static,
                 (double)c->friction);
  ratio = c->ratio > 0 ? c->ratio : 4 * flat / skew; /* 4 G* / E* */
  pair->hertz        = hertz ? 1 : 0;
  pair->modulus      = hertz ? 2 / flat : (c->stiffness > 0 ? c->stiffness : mean);
  pair->share        = hertz ? 2.0 / 3 : 1;
  pair->store        = hertz ? 4.0 / 15 : 0.5;
  pair->zeta         = DemContactDamping(c->restitution);
  pair->drag         = 2 * pair->zeta * (hertz ? PetscSqrtReal(5.0 / 6) : 1);
  pair->ratio        = ratio;
  pair->drag_tangent = pair->drag * PetscSqrtReal(ratio);
  pair->mu           = c->friction;
  pair->mu_static    = c->friction_static > 0 ? c->friction_static : c->friction;
  pair->roll         = c->rolling;
  pair->roll_spring  = PetscMin(2.25 * c->rolling * c->rolling, ratio); /* never stiffer than the tangential spring at the radius */
  pair->roll_drag    = 2 * c->rolling_damping * PetscSqrtReal(1.4);
  pair->twist        = c->twisting;
  pair->twist_spring = PetscMin(2.25 * c->twisting * c->twisting, ratio);
  PetscFunctionReturn(PETSC_SUCCESS);
}
