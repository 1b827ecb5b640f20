/* fem_stress.c - stress and strain at a point, and what engineers read off them.  Docs: theory 2.9 */
#include "fem_stress.h"

void FemStressOf(PetscInt dim, const FemElastic *law, const PetscReal e[6], PetscReal *s)
{
  PetscReal six[6];

  FemStress(law, dim, e, six);
  for (PetscInt i = 0; i < FEM_PARTS(dim); i++) s[i] = six[dim == 2 && i == 2 ? 3 : i];
}

void FemStressExpand(PetscInt dim, const FemElastic *law, const PetscReal *s, PetscReal *stress, PetscReal *strain)
{
  const PetscReal sum = dim == 2 ? s[0] + s[1] : s[0] + s[1] + s[2], trace = law->general ? 0 : sum / (dim * law->lambda + 2 * law->mu); /* of the strain in the dim directions */
  PetscReal       six[6], e[6];

  for (PetscInt i = 0; i < 3; i++) {
    six[i]     = i < dim ? s[i] : 0;
    six[3 + i] = dim == 3 ? s[3 + i] : i == 0 ? s[2] : 0;
  }
  for (PetscInt i = 0; i < 6; i++) {
    e[i] = law->general ? 0 : i >= 3 ? six[i] / law->mu : i < dim ? (six[i] - law->lambda * trace) / (2 * law->mu) : 0;
    for (PetscInt j = 0; j < 6 && law->general; j++) e[i] += law->S[i][j] * six[j];
  }
  if (dim == 2) {
    PetscReal full[6];

    FemStress(law, dim, e, full);
    six[2] = full[2];
    e[2]   = FemStrainZZ(law, e);
  }
  for (PetscInt i = 0; i < 6 && stress; i++) stress[i] = six[i];
  for (PetscInt i = 0; i < 6 && strain; i++) strain[i] = e[i];
}

PetscReal FemStressNorm(PetscInt dim, const FemElastic *law, const PetscReal *s)
{
  PetscReal stress[6], strain[6], sum = 0;

  FemStressExpand(dim, law, s, stress, strain);
  for (PetscInt i = 0; i < 6; i++) sum += stress[i] * strain[i]; /* plane: either the stress or the strain across is zero */
  return sum;
}

PetscReal FemVonMises(const PetscReal s[6])
{
  const PetscReal xy = s[0] - s[1], yz = s[1] - s[2], zx = s[2] - s[0];

  return PetscSqrtReal(0.5 * (xy * xy + yz * yz + zx * zx) + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

/* Jacobi's rotations: each makes one off-diagonal entry zero. Sorted, and exact for equal roots, where Cardano's formula loses half the digits. */
void FemPrincipal(const PetscReal stress[6], PetscReal value[3], PetscReal direction[3][3])
{
  PetscReal a[3][3] = {{stress[0], stress[3], stress[5]}, {stress[3], stress[1], stress[4]}, {stress[5], stress[4], stress[2]}};
  PetscReal v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}; /* columns */
  PetscInt  order[3] = {0, 1, 2};

  for (PetscInt sweep = 0; sweep < 12; sweep++) {
    const PetscReal off = PetscAbsReal(a[0][1]) + PetscAbsReal(a[1][2]) + PetscAbsReal(a[0][2]);

    if (!(off > 1e-300)) break;
    for (PetscInt p = 0; p < 2; p++)
      for (PetscInt q = p + 1; q < 3; q++) {
        PetscReal theta, t, c, s;

        if (a[p][q] == 0) continue;
        theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        t     = (theta >= 0 ? 1 : -1) / (PetscAbsReal(theta) + PetscSqrtReal(theta * theta + 1));
        c     = 1 / PetscSqrtReal(t * t + 1);
        s     = t * c;
        for (PetscInt k = 0; k < 3; k++) {
          const PetscReal kp = a[k][p], kq = a[k][q];

          a[k][p] = c * kp - s * kq;
          a[k][q] = s * kp + c * kq;
        }
        for (PetscInt k = 0; k < 3; k++) {
          const PetscReal pk = a[p][k], qk = a[q][k], vp = v[k][p], vq = v[k][q];

          a[p][k] = c * pk - s * qk;
          a[q][k] = s * pk + c * qk;
          v[k][p] = c * vp - s * vq;
          v[k][q] = s * vp + c * vq;
        }
        a[p][q] = a[q][p] = 0;
      }
  }
  for (PetscInt i = 0; i < 2; i++)
    for (PetscInt j = 0; j < 2 - i; j++)
      if (a[order[j]][order[j]] < a[order[j + 1]][order[j + 1]]) {
        const PetscInt swap = order[j];

        order[j]     = order[j + 1];
        order[j + 1] = swap;
      }
  for (PetscInt k = 0; k < 3; k++) {
    value[k] = a[order[k]][order[k]];
    for (PetscInt i = 0; i < 3 && direction; i++) direction[k][i] = v[i][order[k]];
  }
}
