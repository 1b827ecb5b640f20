/*
  fem_material.c - elastic constants as they act in an element: isotropic by two numbers, else a full symmetric matrix.

  An orthotropic solid is given by nine numbers along three axes square to each other. Its compliance is written there,
  inverted, and turned to x, y, z with the matrix that turns strains; the plane states are taken from that.
  Eqs (2.3), (2.4), (2.40)-(2.43)
*/
#include "fem_impl.h"

/* Voigt xx yy zz xy yz zx as pairs. */
static const PetscInt voigt[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

/* inverse [n][6] of the leading n x n of a symmetric A with positive pivots; PETSC_FALSE when one is not. */
static PetscBool Invert(PetscInt n, PetscReal A[6][6], PetscReal inverse[6][6])
{
  PetscReal B[6][6];

  for (PetscInt i = 0; i < n; i++)
    for (PetscInt j = 0; j < n; j++) {
      B[i][j]       = A[i][j];
      inverse[i][j] = i == j;
    }
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal pivot = B[k][k];

    if (!(pivot > 1e-12 * A[k][k])) return PETSC_FALSE;
    for (PetscInt j = 0; j < n; j++) {
      B[k][j] /= pivot;
      inverse[k][j] /= pivot;
    }
    for (PetscInt i = 0; i < n; i++) {
      const PetscReal factor = B[i][k];

      for (PetscInt j = 0; j < n && i != k; j++) {
        B[i][j] -= factor * B[k][j];
        inverse[i][j] -= factor * inverse[k][j];
      }
    }
  }
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt j = 0; j < i; j++) inverse[i][j] = inverse[j][i] = 0.5 * (inverse[i][j] + inverse[j][i]);
  return PETSC_TRUE;
}

/* C [6][6] along the axes.  Eq. (2.40) */
static PetscBool AlongAxes(const FemMaterial *m, PetscReal C[6][6])
{
  PetscReal S[6][6] = {{1 / m->E[0], -m->nu[0] / m->E[0], -m->nu[1] / m->E[0]}, {-m->nu[0] / m->E[0], 1 / m->E[1], -m->nu[2] / m->E[1]}, {-m->nu[1] / m->E[0], -m->nu[2] / m->E[1], 1 / m->E[2]}};

  for (PetscInt i = 0; i < 6; i++)
    for (PetscInt j = 0; j < 6; j++) C[i][j] = 0;
  if (!Invert(3, S, C)) return PETSC_FALSE;
  C[3][3] = m->G[0];
  C[4][4] = m->G[2];
  C[5][5] = m->G[1];
  return PETSC_TRUE;
}

/* a [3][3]: rows are the unit axes; 2 is what is left of the second direction square to the first. */
static PetscBool Axes(const FemMaterial *m, PetscReal a[3][3])
{
  PetscReal size[2] = {0, 0}, dot = 0;

  for (PetscInt k = 0; k < 2; k++)
    for (PetscInt d = 0; d < 3; d++) a[k][d] = m->axis[k][d];
  for (PetscInt d = 0; d < 3; d++) size[0] += a[0][d] * a[0][d] + a[1][d] * a[1][d];
  if (size[0] == 0) a[0][0] = a[1][1] = 1; /* not given: x and y */
  size[0] = 0;
  for (PetscInt d = 0; d < 3; d++) size[0] += a[0][d] * a[0][d];
  if (!(size[0] > 0) || PetscIsInfOrNanReal(size[0])) return PETSC_FALSE;
  for (PetscInt d = 0; d < 3; d++) {
    a[0][d] /= PetscSqrtReal(size[0]);
    dot += a[0][d] * a[1][d];
  }
  size[0] = 0;
  for (PetscInt d = 0; d < 3; d++) {
    size[0] += a[1][d] * a[1][d];
    a[1][d] -= dot * a[0][d];
    size[1] += a[1][d] * a[1][d];
  }
  if (!(size[1] > 1e-8 * size[0])) return PETSC_FALSE;
  for (PetscInt d = 0; d < 3; d++) a[1][d] /= PetscSqrtReal(size[1]);
  for (PetscInt d = 0; d < 3; d++) a[2][d] = a[0][(d + 1) % 3] * a[1][(d + 2) % 3] - a[0][(d + 2) % 3] * a[1][(d + 1) % 3];
  return PETSC_TRUE;
}

/* C <- T' C T with the strain along the axes = T x strain along x, y, z (engineering shears).  Eq. (2.41) */
static void Turn(PetscReal a[3][3], PetscReal C[6][6])
{
  PetscReal T[6][6], CT[6][6];

  for (PetscInt k = 0; k < 6; k++)
    for (PetscInt l = 0; l < 6; l++) {
      const PetscInt p = voigt[k][0], q = voigt[k][1], i = voigt[l][0], j = voigt[l][1];

      T[k][l] = (k < 3 ? 1 : 2) * (l < 3 ? a[p][i] * a[q][j] : 0.5 * (a[p][i] * a[q][j] + a[p][j] * a[q][i]));
    }
  for (PetscInt k = 0; k < 6; k++)
    for (PetscInt l = 0; l < 6; l++) {
      CT[k][l] = 0;
      for (PetscInt m = 0; m < 6; m++) CT[k][l] += C[k][m] * T[m][l];
    }
  for (PetscInt k = 0; k < 6; k++)
    for (PetscInt l = 0; l < 6; l++) {
      C[k][l] = 0;
      for (PetscInt m = 0; m < 6; m++) C[k][l] += T[m][k] * CT[m][l];
    }
  for (PetscInt k = 0; k < 6; k++)
    for (PetscInt l = 0; l < k; l++) C[k][l] = C[l][k] = 0.5 * (C[k][l] + C[l][k]);
}

PetscErrorCode FemCheckMaterial(FemModel model, FemMaterial *m)
{
  PetscReal C[6][6], a[3][3];

  PetscFunctionBegin;
  BaseCheckInput(m->density > 0 && !PetscIsInfOrNanReal(m->density), model->comm, "Density %g kg/m3 must be positive", (double)m->density);
  if (!m->orthotropic) {
    BaseCheckInput(m->young > 0 && !PetscIsInfOrNanReal(m->young), model->comm, "Young's modulus %g Pa must be positive", (double)m->young);
    BaseCheckInput(m->poisson > -1 && m->poisson < 0.5, model->comm, "Poisson's ratio %g must lie above -1 and below 0.5", (double)m->poisson);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = 0; k < 3; k++) {
    static const char *const pair[] = {"12", "13", "23"};

    BaseCheckInput(m->E[k] > 0 && !PetscIsInfOrNanReal(m->E[k]), model->comm, "Young's modulus %.6g Pa along axis %d must be positive", (double)m->E[k], (int)k + 1);
    BaseCheckInput(m->G[k] > 0 && !PetscIsInfOrNanReal(m->G[k]), model->comm, "Shear modulus %.6g Pa (%s) must be positive", (double)m->G[k], pair[k]);
    BaseCheckInput(PetscSqr(m->nu[k]) < m->E[k == 2] / m->E[k == 0 ? 1 : 2], model->comm, "Poisson's ratio %.6g (%s) must be below sqrt(E%c/E%c) = %.6g in size, or some strain would cost negative energy", (double)m->nu[k], pair[k],
                   pair[k][0], pair[k][1], (double)PetscSqrtReal(m->E[k == 2] / m->E[k == 0 ? 1 : 2]));
  }
  BaseCheckInput(AlongAxes(m, C), model->comm, "Poisson's ratios %.6g, %.6g, %.6g (12, 13, 23) are each possible but not together: some strain would cost negative energy; make one smaller", (double)m->nu[0], (double)m->nu[1], (double)m->nu[2]);
  BaseCheckInput(Axes(m, a), model->comm, "The axes (%g, %g, %g) and (%g, %g, %g) of an orthotropic material must be two directions that differ", (double)m->axis[0][0], (double)m->axis[0][1], (double)m->axis[0][2], (double)m->axis[1][0],
                 (double)m->axis[1][1], (double)m->axis[1][2]);
  if (model->kind != FEM_SOLID) {
    PetscInt along = 0;

    for (PetscInt k = 0; k < 3; k++) along += PetscAbsReal(a[k][2]) > 1 - 1e-12;
    BaseCheckInput(along == 1, model->comm, "In a plane body one axis of an orthotropic material stands along z; turn the others in the plane");
  }
  m->young   = PetscMax(m->E[0], PetscMax(m->E[1], m->E[2])); /* where a size is asked for */
  m->poisson = PetscMax(m->nu[0], PetscMax(m->nu[1], m->nu[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool FemElasticSame(const FemElastic *a, const FemElastic *b)
{
  if (a->lambda != b->lambda || a->mu != b->mu || a->general != b->general) return PETSC_FALSE;
  for (PetscInt i = 0; i < 36 && a->general; i++)
    if (a->C[i / 6][i % 6] != b->C[i / 6][i % 6]) return PETSC_FALSE;
  return PETSC_TRUE;
}

FemElastic FemElasticOf(FemKind kind, const FemMaterial *m)
{
  FemElastic law = {0};
  PetscReal  a[3][3];

  if (!m->orthotropic) {
    const PetscReal nu = m->poisson, mu = m->young / (2 * (1 + nu)), lambda = m->young * nu / ((1 + nu) * (1 - 2 * nu));

    law.lambda = lambda;
    law.mu     = mu;
    if (kind == FEM_PLANE_STRAIN) law.szz = lambda;
    if (kind == FEM_PLANE_STRESS) {
      law.lambda = 2 * lambda * mu / (lambda + 2 * mu);
      law.ezz    = -nu / (1 - nu);
    }
    return law;
  }
  law.general = PETSC_TRUE;
  (void)AlongAxes(m, law.C); /* checked by FemCheckMaterial */
  (void)Axes(m, a);
  Turn(a, law.C);
  if (kind == FEM_PLANE_STRESS) { /* eq. (2.43) */
    const PetscReal czz = law.C[2][2];
    PetscReal       row[6];

    for (PetscInt j = 0; j < 6; j++) row[j] = law.C[2][j];
    for (PetscInt i = 0; i < 6; i++) {
      law.ezz_of[i] = i == 2 ? 0 : -row[i] / czz;
      for (PetscInt j = 0; j < 6; j++) law.C[i][j] -= row[i] * row[j] / czz;
    }
    for (PetscInt i = 0; i < 6; i++) law.C[i][2] = law.C[2][i] = 0;
  }
  if (kind == FEM_SOLID) (void)Invert(6, law.C, law.S);
  else {
    const PetscInt in_plane[3] = {0, 1, 3};
    PetscReal      C[6][6], S[6][6];

    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < 3; j++) C[i][j] = law.C[in_plane[i]][in_plane[j]];
    (void)Invert(3, C, S);
    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < 3; j++) law.S[in_plane[i]][in_plane[j]] = S[i][j];
  }
  return law;
}
