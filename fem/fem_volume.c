/*
  fem_volume.c - quadratic hexahedra and prisms that keep their volume: near nu = 1/2 its change is linear in space within each element.

  A curved cell of 27, 20, 18 or 15 nodes cannot keep its volume at 27 or 18 points at once without stiffening: near nu = 1/2 it locks
  until it is fine. So what the modulus lambda has beyond 3/2 mu (that of nu = 0.3) resists not the volume change div u itself but its
  projection onto 1, x, y, z in each element (B-bar, Hughes 1980; Q2 with linear pressures of each element's own),

      energy = 1/2 int 2 mu e:e + lambda_0 (div u)^2 + (lambda - lambda_0) (P div u)^2,   lambda_0 = min(lambda, 3/2 mu)

  psi are 1, x, y, z made orthonormal under the element's own points: P q = sum_m psi_m int psi_m q. A field with a linear div u, so every
  quadratic one on an affine cell and every linear one on any, keeps its energy. K is symmetric, has rigid motions as its only null space
  and is never stiffer than the plain element's; up to nu = 0.3 it is that. lambda_0 keeps div u from wandering where P does not see it:
  with all of lambda on P a point load made 20-node bricks waver at 3 % where now it is 0.1 %.  Eqs (2.37)-(2.39)
*/
#include "fem_element.h"

PetscReal FemVolumeExcess(const FemShape *shape, const FemElastic *law)
{
  if (shape->dim < 3 || shape->type == shape->linear || shape->linear == MESH_TET4 || law->general) return 0;
  return PetscMax(0, law->lambda - 1.5 * law->mu);
}

/* 1, x - centre */
static void Terms(PetscInt dim, const FemVolume *v, const PetscReal x[3], PetscReal r[4])
{
  r[0] = 1;
  for (PetscInt d = 0; d < dim; d++) r[1 + d] = x[d] - v->centre[d];
}

/* psi_m = sum_k root[m][k] r_k at x */
static void PsiAt(PetscInt dim, const FemVolume *v, const PetscReal x[3], PetscReal psi[4])
{
  PetscReal r[4];

  Terms(dim, v, x, r);
  for (PetscInt m = 0; m <= dim; m++) {
    psi[m] = 0;
    for (PetscInt k = 0; k <= m; k++) psi[m] += v->root[m][k] * r[k];
  }
}

void FemVolumeCreate(const FemShape *shape, const PetscReal *x, const PetscReal *w, FemVolume *v)
{
  const PetscInt dim = shape->dim;
  PetscReal      at[FEM_MAX_POINTS][3], volume = 0, G[4][4] = {{0}}, r[4];

  for (PetscInt d = 0; d < 3; d++) v->centre[d] = 0;
  for (PetscInt q = 0; q < shape->points; q++) {
    volume += w[q];
    for (PetscInt d = 0; d < dim; d++) {
      at[q][d] = 0;
      for (PetscInt a = 0; a < shape->nodes; a++) at[q][d] += shape->N[q][a] * x[a * dim + d];
      v->centre[d] += w[q] * at[q][d];
    }
  }
  for (PetscInt d = 0; d < dim; d++) v->centre[d] /= volume;
  for (PetscInt q = 0; q < shape->points; q++) {
    Terms(dim, v, at[q], r);
    for (PetscInt k = 0; k <= dim; k++)
      for (PetscInt l = 0; l <= k; l++) G[k][l] += w[q] * r[k] * r[l];
  }
  for (PetscInt k = 0; k <= dim; k++) /* G = L L', root = L^-1 */
    for (PetscInt l = 0; l <= k; l++) {
      for (PetscInt i = 0; i < l; i++) G[k][l] -= G[k][i] * G[l][i];
      if (k == l) G[k][k] = PetscSqrtReal(G[k][k]);
      else G[k][l] /= G[l][l];
    }
  for (PetscInt k = 0; k <= dim; k++)
    for (PetscInt l = 0; l <= dim; l++) {
      v->root[k][l] = k == l;
      for (PetscInt i = l; i < k; i++) v->root[k][l] -= G[k][i] * v->root[i][l];
      v->root[k][l] /= G[k][k];
    }
  for (PetscInt q = 0; q < shape->points; q++) PsiAt(dim, v, at[q], v->psi[q]);
}

/* D [dim+1][nodes*dim] = int psi_m dN_a/dx_i: amounts of psi in the volume change of a unit motion */
static void Rows(const FemShape *shape, const PetscReal *dN, const PetscReal *w, const FemVolume *v, PetscReal D[4][FEM_MAX_DOFS])
{
  const PetscInt n = shape->nodes * shape->dim;

  for (PetscInt m = 0; m <= shape->dim; m++) {
    for (PetscInt k = 0; k < n; k++) D[m][k] = 0;
    for (PetscInt q = 0; q < shape->points; q++)
      for (PetscInt k = 0; k < n; k++) D[m][k] += w[q] * v->psi[q][m] * dN[q * n + k];
  }
}

/* The plain element's law, but for the excess */
static FemElastic Bounded(const FemShape *shape, const FemElastic *law)
{
  FemElastic bounded = *law;

  bounded.lambda -= FemVolumeExcess(shape, law);
  return bounded;
}

void FemVolumeStiffness(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemVolume *v, PetscReal *K)
{
  const PetscInt   n       = shape->nodes * shape->dim;
  const FemElastic bounded = Bounded(shape, law);
  PetscReal        D[4][FEM_MAX_DOFS];

  Rows(shape, dN, w, v, D);
  FemStiffness(shape, &bounded, dN, w, K);
  for (PetscInt m = 0; m <= shape->dim; m++)
    for (PetscInt i = 0; i < n; i++) {
      const PetscReal d = FemVolumeExcess(shape, law) * D[m][i];

      for (PetscInt j = 0; j < n; j++) K[i * n + j] += d * D[m][j];
    }
}

void FemVolumeBlocks(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemVolume *v, PetscReal *block)
{
  const PetscInt   dim     = shape->dim;
  const FemElastic bounded = Bounded(shape, law);
  PetscReal        D[4][FEM_MAX_DOFS];

  Rows(shape, dN, w, v, D);
  for (PetscInt a = 0; a < shape->nodes; a++) {
    PetscReal *to = &block[a * dim * dim];

    for (PetscInt k = 0; k < dim * dim; k++) to[k] = 0;
    for (PetscInt q = 0; q < shape->points; q++) {
      const PetscReal *g   = &dN[(q * shape->nodes + a) * dim];
      PetscReal        dot = 0;

      for (PetscInt i = 0; i < dim; i++) dot += g[i] * g[i];
      for (PetscInt i = 0; i < dim; i++)
        for (PetscInt j = 0; j < dim; j++) to[i * dim + j] += w[q] * ((bounded.lambda + bounded.mu) * g[i] * g[j] + (i == j ? bounded.mu * dot : 0));
    }
    for (PetscInt m = 0; m <= dim; m++)
      for (PetscInt i = 0; i < dim; i++)
        for (PetscInt j = 0; j < dim; j++) to[i * dim + j] += FemVolumeExcess(shape, law) * D[m][a * dim + i] * D[m][a * dim + j];
  }
}

void FemVolumeAmounts(const FemShape *shape, const PetscReal *dN, const PetscReal *w, const FemVolume *v, const PetscReal *u, PetscReal amount[4])
{
  const PetscInt n = shape->nodes * shape->dim;

  for (PetscInt m = 0; m < 4; m++) amount[m] = 0;
  for (PetscInt q = 0; q < shape->points; q++) {
    PetscReal div = 0;

    for (PetscInt k = 0; k < n; k++) div += dN[q * n + k] * u[k];
    for (PetscInt m = 0; m <= shape->dim; m++) amount[m] += w[q] * v->psi[q][m] * div;
  }
}

/* Eq. (2.39) where psi is known */
static void Exchange(const FemShape *shape, const FemElastic *law, const PetscReal psi[4], const PetscReal amount[4], PetscReal e[6])
{
  PetscReal more = -(e[0] + e[1] + e[2]);

  for (PetscInt m = 0; m <= shape->dim; m++) more += psi[m] * amount[m];
  for (PetscInt i = 0; i < 3; i++) e[i] += FemVolumeExcess(shape, law) / (3 * law->lambda + 2 * law->mu) * more;
}

void FemVolumeAdd(const FemShape *shape, const FemElastic *law, const FemVolume *v, const PetscReal amount[4], const PetscReal x[3], PetscReal e[6])
{
  PetscReal psi[4];

  PsiAt(shape->dim, v, x, psi);
  Exchange(shape, law, psi, amount, e);
}

void FemVolumeStrain(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemVolume *v, const PetscReal *u, PetscReal strain[][6])
{
  PetscReal amount[4];

  FemModesStrain(shape, NULL, dN, w, NULL, u, strain);
  FemVolumeAmounts(shape, dN, w, v, u, amount);
  for (PetscInt q = 0; q < shape->points; q++) Exchange(shape, law, v->psi[q], amount, strain[q]);
}

void FemVolumeForce(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemVolume *v, const PetscReal *u, PetscReal *f)
{
  PetscReal e[FEM_MAX_POINTS][6];

  FemVolumeStrain(shape, law, dN, w, v, u, e);
  for (PetscInt k = 0; k < shape->nodes * 3; k++) f[k] = 0;
  for (PetscInt q = 0; q < shape->points; q++) {
    PetscReal s[6], t[3][3];

    FemStress(law, 3, e[q], s);
    for (PetscInt i = 0; i < 3; i++) {
      t[i][i]           = w[q] * s[i];
      t[i][(i + 1) % 3] = t[(i + 1) % 3][i] = w[q] * s[3 + i];
    }
    for (PetscInt a = 0; a < shape->nodes; a++)
      for (PetscInt i = 0; i < 3; i++)
        for (PetscInt j = 0; j < 3; j++) f[a * 3 + i] += t[i][j] * dN[(q * shape->nodes + a) * 3 + j];
  }
}
