/*
  fem_modes.c - quad4 and hex8 that bend and keep their volume: strains of the element's own, condensed out.

  A bilinear element cannot bend without shearing, nor swell along one line alone: it locks. So each element gets strains
  that no neighbour shares, e = B u + G a: those of incompatible displacements 1/2 (xi^2 - 1) in each direction (Taylor,
  Beresford, Wilson 1976; Simo and Rifai 1990), and in space three volume changes xi eta, eta zeta, zeta xi, without which
  hexahedra lock near nu = 1/2 (Simo, Armero, Taylor 1993). G is made with the Jacobian of the centre and j0/j, so its
  integral vanishes on any shape: constant stress does no work on it and patches stay exact. Stationary energy in a gives
  K = K_uu - K_ua K_aa^-1 K_au, which is symmetric, has rigid motions as its only null space and is never stiffer than
  the plain element.  Eqs (2.32)-(2.36)
*/
#include "fem_element.h"

/* Engineering Voigt strain of a displacement gradient that is g in the row of direction i. */
static void Row(PetscInt dim, PetscInt i, const PetscReal g[3], PetscReal e[6])
{
  for (PetscInt k = 0; k < 6; k++) e[k] = 0;
  e[i] = g[i];
  if (dim == 2) {
    e[3] = g[1 - i];
    return;
  }
  e[3 + i]           = g[(i + 1) % 3];
  e[3 + (i + 2) % 3] = g[(i + 2) % 3];
}

/* e [6] at point q of the nodes' motion u alone. */
static void NodeStrain(const FemShape *shape, const PetscReal *dN, PetscInt q, const PetscReal *u, PetscReal e[6])
{
  const PetscInt dim = shape->dim;
  PetscReal      h[3][3] = {{0}};

  for (PetscInt a = 0; a < shape->nodes; a++)
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) h[i][j] += u[a * dim + i] * dN[(q * shape->nodes + a) * dim + j];
  for (PetscInt i = 0; i < 3; i++) {
    e[i]     = h[i][i];
    e[3 + i] = h[i][(i + 1) % 3] + h[(i + 1) % 3][i];
  }
}

static PetscReal Dot6(const PetscReal a[6], const PetscReal b[6])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5];
}

static PetscReal Determinant(PetscInt dim, PetscReal J[3][3])
{
  if (dim == 2) return J[0][0] * J[1][1] - J[0][1] * J[1][0];
  return J[0][0] * (J[1][1] * J[2][2] - J[1][2] * J[2][1]) - J[0][1] * (J[1][0] * J[2][2] - J[1][2] * J[2][0]) + J[0][2] * (J[1][0] * J[2][1] - J[1][1] * J[2][0]);
}

static void JacobianAt(const FemShape *shape, const PetscReal *x, const PetscReal dN[][3], PetscReal J[3][3])
{
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) {
      J[i][j] = 0;
      for (PetscInt a = 0; a < shape->nodes && i < shape->dim && j < shape->dim; a++) J[i][j] += x[a * shape->dim + i] * dN[a][j];
    }
}

/* dxi_m/dx_j of J */
static void InverseOf(PetscInt dim, PetscReal J[3][3], PetscReal det, PetscReal inverse[3][3])
{
  for (PetscInt m = 0; m < dim; m++)
    for (PetscInt j = 0; j < dim; j++) {
      const PetscInt r = (j + 1) % 3, t = (j + 2) % 3, c = (m + 1) % 3, d = (m + 2) % 3;

      inverse[m][j] = dim == 2 ? ((m + j) % 2 ? -J[1 - j][1 - m] : J[1 - j][1 - m]) / det : (J[r][c] * J[t][d] - J[r][d] * J[t][c]) / det;
    }
}

/* G [modes][6] at xi; ratio = j0/j there. */
static void ModeStrains(const FemModes *modes, PetscInt dim, const PetscReal xi[3], PetscReal ratio, PetscReal G[FEM_MODES][6])
{
  PetscInt k = 0;

  for (PetscInt m = 0; m < dim; m++) {
    PetscReal g[3] = {0, 0, 0};

    for (PetscInt j = 0; j < dim; j++) g[j] = ratio * xi[m] * modes->inverse[m][j];
    for (PetscInt i = 0; i < dim; i++) Row(dim, i, g, G[k++]);
  }
  for (PetscInt m = 0; m < 3 && dim == 3; m++, k++)
    for (PetscInt i = 0; i < 6; i++) G[k][i] = i < 3 ? ratio * xi[m] * xi[(m + 1) % 3] : 0;
}

PetscBool FemModesHas(const FemShape *shape)
{
  return shape->type == MESH_QUAD4 || shape->type == MESH_HEX8 ? PETSC_TRUE : PETSC_FALSE;
}

void FemModesCreate(const FemShape *shape, const FemElastic *law, const PetscReal *x, const PetscReal *w, FemModes *modes)
{
  const PetscInt dim = shape->dim, n = dim == 2 ? 4 : FEM_MODES;
  PetscReal      J0[3][3], N[FEM_MODE_POINTS], dN[FEM_MODE_POINTS][3], *L = modes->factor;
  const PetscReal centre[3] = {0, 0, 0};

  modes->n = n;
  FemShapeAt(shape->type, centre, N, dN);
  JacobianAt(shape, x, dN, J0);
  modes->det = Determinant(dim, J0);
  InverseOf(dim, J0, modes->det, modes->inverse);
  for (PetscInt k = 0; k < n * n; k++) L[k] = 0;
  for (PetscInt q = 0; q < shape->points; q++) {
    PetscReal(*G)[6] = modes->strain[q], J[3][3], s[6];

    JacobianAt(shape, x, shape->dN[q], J);
    ModeStrains(modes, dim, shape->xi[q], modes->det / Determinant(dim, J), G);
    for (PetscInt a = 0; a < n; a++) {
      FemStress(law, dim, G[a], s);
      for (PetscInt b = 0; b <= a; b++) L[a * n + b] += w[q] * Dot6(s, G[b]);
    }
  }
  for (PetscInt a = 0; a < n; a++) /* Cholesky */
    for (PetscInt b = 0; b <= a; b++) {
      for (PetscInt k = 0; k < b; k++) L[a * n + b] -= L[a * n + k] * L[b * n + k];
      if (a == b) L[a * n + a] = PetscSqrtReal(L[a * n + a]);
      else L[a * n + b] /= L[b * n + b];
    }
}

void FemModesStiffness(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemModes *modes, PetscReal *K)
{
  const PetscInt dim = shape->dim, nodes = shape->nodes, n = nodes * dim, m = modes->n;
  PetscReal      Y[FEM_MODES][FEM_MODE_DOFS] = {{0}};

  FemStiffness(shape, law, dN, w, K);
  for (PetscInt q = 0; q < shape->points; q++)
    for (PetscInt k = 0; k < m; k++) {
      PetscReal s[6];

      FemStress(law, dim, modes->strain[q][k], s);
      for (PetscInt a = 0; a < nodes; a++) {
        const PetscReal *g = &dN[(q * nodes + a) * dim];

        if (dim == 2) {
          Y[k][2 * a] += w[q] * (s[0] * g[0] + s[3] * g[1]);
          Y[k][2 * a + 1] += w[q] * (s[3] * g[0] + s[1] * g[1]);
        } else {
          Y[k][3 * a] += w[q] * (s[0] * g[0] + s[3] * g[1] + s[5] * g[2]);
          Y[k][3 * a + 1] += w[q] * (s[3] * g[0] + s[1] * g[1] + s[4] * g[2]);
          Y[k][3 * a + 2] += w[q] * (s[5] * g[0] + s[4] * g[1] + s[2] * g[2]);
        }
      }
    }
  for (PetscInt k = 0; k < m; k++) { /* L Y = K_au; K -= Y' Y */
    for (PetscInt l = 0; l < k; l++)
      for (PetscInt i = 0; i < n; i++) Y[k][i] -= modes->factor[k * m + l] * Y[l][i];
    for (PetscInt i = 0; i < n; i++) Y[k][i] /= modes->factor[k * m + k];
  }
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt k = 0; k < m; k++)
      for (PetscInt j = 0; j < n; j++) K[i * n + j] -= Y[k][i] * Y[k][j];
}

void FemModesAmounts(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemModes *modes, const PetscReal *u, PetscReal *r)
{
  const PetscInt m = modes->n;

  for (PetscInt k = 0; k < m; k++) r[k] = 0;
  for (PetscInt q = 0; q < shape->points; q++) {
    PetscReal e[6], s[6];

    NodeStrain(shape, dN, q, u, e);
    FemStress(law, shape->dim, e, s);
    for (PetscInt k = 0; k < m; k++) r[k] -= w[q] * Dot6(s, modes->strain[q][k]);
  }
  for (PetscInt k = 0; k < m; k++) { /* K_aa a = -K_au u */
    for (PetscInt l = 0; l < k; l++) r[k] -= modes->factor[k * m + l] * r[l];
    r[k] /= modes->factor[k * m + k];
  }
  for (PetscInt k = m - 1; k >= 0; k--) {
    for (PetscInt l = k + 1; l < m; l++) r[k] -= modes->factor[l * m + k] * r[l];
    r[k] /= modes->factor[k * m + k];
  }
}

void FemModesAdd(const FemShape *shape, const FemModes *modes, const PetscReal *amount, const PetscReal xi[3], PetscReal det, PetscReal e[6])
{
  PetscReal G[FEM_MODES][6];

  ModeStrains(modes, shape->dim, xi, modes->det / det, G);
  for (PetscInt k = 0; k < modes->n; k++)
    for (PetscInt i = 0; i < 6; i++) e[i] += amount[k] * G[k][i];
}

void FemModesStrain(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemModes *modes, const PetscReal *u, PetscReal strain[][6])
{
  PetscReal amount[FEM_MODES];

  if (modes) FemModesAmounts(shape, law, dN, w, modes, u, amount);
  for (PetscInt q = 0; q < shape->points; q++) {
    NodeStrain(shape, dN, q, u, strain[q]);
    for (PetscInt k = 0; modes && k < modes->n; k++)
      for (PetscInt i = 0; i < 6; i++) strain[q][i] += amount[k] * modes->strain[q][k][i];
  }
}

void FemModesForce(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const FemModes *modes, const PetscReal *u, PetscReal *f)
{
  const PetscInt dim = shape->dim, nodes = shape->nodes;
  PetscReal      strain[FEM_MODE_POINTS][6];

  FemModesStrain(shape, law, dN, w, modes, u, strain);
  for (PetscInt k = 0; k < nodes * dim; k++) f[k] = 0;
  for (PetscInt q = 0; q < shape->points; q++) {
    PetscReal s[6], t[3][3];

    FemStress(law, dim, strain[q], s);
    for (PetscInt i = 0; i < 3; i++) {
      t[i][i]           = w[q] * s[i];
      t[i][(i + 1) % 3] = t[(i + 1) % 3][i] = w[q] * s[3 + i];
    }
    for (PetscInt a = 0; a < nodes; a++)
      for (PetscInt i = 0; i < dim; i++)
        for (PetscInt j = 0; j < dim; j++) f[a * dim + i] += t[i][j] * dN[(q * nodes + a) * dim + j];
  }
}
