/* coupling_criterion.c - how near its strength an element is, and how near a facet.  Eqs (8.1)-(8.3) */
#include "coupling_switch.h"

/* Jacobi rotations; 2D uses the plane alone, as the particles do. */
void CouplingPrincipal_Internal(PetscInt dim, const PetscReal s[6], PetscReal value[3], PetscReal major[3])
{
  PetscReal A[3][3] = {{s[0], s[3], s[5]}, {s[3], s[1], s[4]}, {s[5], s[4], s[2]}}, Q[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  PetscInt  order[3] = {0, 1, 2};

  if (dim == 2) A[0][2] = A[1][2] = A[2][0] = A[2][1] = A[2][2] = 0;
  for (int sweep = 0; sweep < 12; sweep++)
    for (int p = 0; p < dim - 1; p++)
      for (int q = p + 1; q < dim; q++) {
        if (A[p][q] == 0) continue;
        const PetscReal theta = (A[q][q] - A[p][p]) / (2 * A[p][q]);
        const PetscReal t = (theta >= 0 ? 1 : -1) / (PetscAbsReal(theta) + PetscSqrtReal(theta * theta + 1)), c = 1 / PetscSqrtReal(t * t + 1), sn = t * c;

        for (int r = 0; r < 3; r++) {
          const PetscReal x = A[r][p], y = A[r][q];

          A[r][p] = c * x - sn * y;
          A[r][q] = sn * x + c * y;
        }
        for (int r = 0; r < 3; r++) {
          const PetscReal x = A[p][r], y = A[q][r], u = Q[r][p], v = Q[r][q];

          A[p][r] = c * x - sn * y;
          A[q][r] = sn * x + c * y;
          Q[r][p] = c * u - sn * v;
          Q[r][q] = sn * u + c * v;
        }
      }
  for (PetscInt i = 1; i < dim; i++)
    for (PetscInt j = i; j > 0 && A[order[j]][order[j]] > A[order[j - 1]][order[j - 1]]; j--) {
      const PetscInt k = order[j];

      order[j]     = order[j - 1];
      order[j - 1] = k;
    }
  value[2] = 0;
  for (PetscInt i = 0; i < dim; i++) value[i] = A[order[i]][order[i]];
  for (PetscInt c = 0; c < 3; c++) major[c] = Q[c][order[0]];
}

/* Fraction of the strength.  Eqs (8.1), (8.2) */
PetscReal CouplingUse_Internal(CouplingCriterion when, const DemStrength *strength, PetscInt dim, const PetscReal stress[6])
{
  PetscReal value[3], major[3], use = 0;

  CouplingPrincipal_Internal(dim, stress, value, major);
  if (strength->tensile > 0) use = PetscMax(0, value[0] / strength->tensile);
  if (when == COUPLING_MOHR_COULOMB && strength->shear > 0) {
    const PetscReal mu = strength->mu_static, middle = 0.5 * (value[0] + value[dim - 1]), radius = 0.5 * (value[0] - value[dim - 1]);

    use = PetscMax(use, (radius * PetscSqrtReal(1 + mu * mu) + mu * middle) / strength->shear);
  }
  return use;
}

/* The particles' own rule (4.20), (4.25) for one facet with the direction the elements give.  Eq. (8.3) */
PetscReal CouplingFacetUse_Internal(const DemStrength *strength, const PetscReal t[3], const PetscReal n[3], const PetscReal major[3])
{
  PetscReal along = 0, pull = 0, tn = 0, ts = 0, use = 0;

  for (PetscInt c = 0; c < 3; c++) {
    along += n[c] * major[c];
    pull += t[c] * major[c];
    tn += t[c] * n[c];
  }
  for (PetscInt c = 0; c < 3; c++) ts += PetscSqr(t[c] - tn * n[c]);
  if (strength->tensile > 0 && PetscAbsReal(along) >= 0.2) use = pull / along / strength->tensile;
  if (strength->shear > 0) use = PetscMax(use, (PetscSqrtReal(ts) + strength->mu_static * tn) / strength->shear);
  return use;
}
