/*
  fem_element.c - the integrals of one element.

  Isoparametric: x = sum N_a x_a, J = dx/dxi, grad N_a = J^-T dN_a/dxi. Shapes and points: fem_shape.c. Each kernel is
  written once for any (nodes, dim, points); for linear elements it is inlined with constants, so the compiler unrolls it.
*/
#include "fem_element.h"

/* J = sum x_a dN_a and its determinant; inverse[i][j] = dxi_i/dx_j when det is not 0. */
static inline PetscReal Jacobian(PetscInt nodes, PetscInt dim, const PetscReal *x, const PetscReal dN[][3], PetscReal J[3][3])
{
  for (PetscInt i = 0; i < dim; i++)
    for (PetscInt j = 0; j < dim; j++) J[i][j] = 0;
  for (PetscInt a = 0; a < nodes; a++)
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) J[i][j] += x[a * dim + i] * dN[a][j];
  if (dim == 2) return J[0][0] * J[1][1] - J[0][1] * J[1][0];
  return J[0][0] * (J[1][1] * J[2][2] - J[1][2] * J[2][1]) - J[0][1] * (J[1][0] * J[2][2] - J[1][2] * J[2][0]) + J[0][2] * (J[1][0] * J[2][1] - J[1][1] * J[2][0]);
}

static inline void Inverse(PetscInt dim, PetscReal J[3][3], PetscReal det, PetscReal inverse[3][3])
{
  const PetscReal s = 1 / det;

  if (dim == 2) {
    inverse[0][0] = s * J[1][1];
    inverse[0][1] = -s * J[0][1];
    inverse[1][0] = -s * J[1][0];
    inverse[1][1] = s * J[0][0];
    return;
  }
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) {
      const PetscInt r = (j + 1) % 3, t = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;

      inverse[i][j] = s * (J[r][c] * J[t][d] - J[r][d] * J[t][c]);
    }
}

static inline PetscInt Gradients(PetscInt nodes, PetscInt dim, PetscInt points, const FemShape *shape, const PetscReal *restrict x, PetscReal thickness, PetscReal *restrict dN, PetscReal *restrict w)
{
  PetscInt bad = 0;

  for (PetscInt q = 0; q < points; q++) {
    PetscReal       J[3][3], inverse[3][3];
    const PetscReal det = Jacobian(nodes, dim, x, shape->dN[q], J);

    bad += !(det > 0);
    w[q] = shape->weight[q] * det * (dim == 2 ? thickness : 1);
    Inverse(dim, J, det, inverse);
    for (PetscInt a = 0; a < nodes; a++)
      for (PetscInt j = 0; j < dim; j++) {
        PetscReal sum = 0;

        for (PetscInt i = 0; i < dim; i++) sum += shape->dN[q][a][i] * inverse[i][j];
        dN[(q * nodes + a) * dim + j] = sum;
      }
  }
  return bad;
}

/* One kernel, four sizes of which nodes, dim and points become constants; others run with what their shape says. */
#define FOR_SHAPE(shape, kernel, ...) \
  switch ((shape)->type) { \
  case MESH_TRI3: kernel(3, 2, 1, __VA_ARGS__); break; \
  case MESH_QUAD4: kernel(4, 2, 4, __VA_ARGS__); break; \
  case MESH_TET4: kernel(4, 3, 1, __VA_ARGS__); break; \
  case MESH_HEX8: kernel(8, 3, 8, __VA_ARGS__); break; \
  default: \
    if ((shape)->dim == 2) kernel((shape)->nodes, 2, (shape)->points, __VA_ARGS__); \
    else kernel((shape)->nodes, 3, (shape)->points, __VA_ARGS__); \
  }

PetscInt FemGradients(const FemShape *shape, const PetscReal *x, PetscReal thickness, PetscReal *dN, PetscReal *w)
{
  PetscInt bad = 0;

  FOR_SHAPE(shape, bad = Gradients, shape, x, thickness, dN, w)
  return bad;
}

/* det J over the lengths of its columns: those are half or whole edges, so it is the sine of the angle they span. 0 where one vanishes. */
static PetscReal Sine(PetscInt nodes, PetscInt dim, const PetscReal *x, const PetscReal dN[][3])
{
  PetscReal       J[3][3], size = 1;
  const PetscReal det = Jacobian(nodes, dim, x, dN, J);

  for (PetscInt j = 0; j < dim; j++) {
    PetscReal sum = 0;

    for (PetscInt i = 0; i < dim; i++) sum += J[i][j] * J[i][j];
    size *= PetscSqrtReal(sum);
  }
  return size > 0 ? det / size : 0;
}

PetscReal FemShapeQuality(const FemShape *shape, const PetscReal *x)
{
  const PetscInt dim   = shape->dim;
  PetscReal      worst = 1, longest = 0, shortest = PETSC_MAX_REAL, N[FEM_MAX_NODES], dN[FEM_MAX_NODES][3];

  for (PetscInt q = 0; q < shape->points; q++) worst = PetscMin(worst, Sine(shape->nodes, dim, x, shape->dN[q]));
  for (PetscInt a = 0; a < shape->nodes && shape->linear != shape->type && worst > 0; a++) {
    PetscReal here, straight;

    here = Sine(shape->nodes, dim, x, shape->dN_place[a]);
    if (here > -1e-6) continue; /* 0 but for round-off */
    FemShapeAt(shape->linear, shape->place[a], N, dN);
    straight = Sine(shape->corners, dim, x, dN);
    if (straight > 0) worst = here;
  }
  for (PetscInt a = 0; a < shape->nodes; a++)
    for (PetscInt b = 0; b < a; b++) {
      PetscReal sum = 0;

      for (PetscInt i = 0; i < dim; i++) sum += PetscSqr(x[a * dim + i] - x[b * dim + i]);
      longest  = PetscMax(longest, sum);
      shortest = PetscMin(shortest, sum);
    }
  if (!(shortest > 1e-20 * longest)) worst = PetscMin(worst, 0); /* two nodes in one place */
  return worst;
}

static inline void Stiffness(PetscInt nodes, PetscInt dim, PetscInt points, const FemElastic *law, const PetscReal *restrict dN, const PetscReal *restrict w, PetscReal *restrict K)
{
  const PetscInt n = nodes * dim;

  for (PetscInt k = 0; k < n * n; k++) K[k] = 0;
  for (PetscInt q = 0; q < points; q++) {
    const PetscReal *g      = &dN[q * nodes * dim];
    const PetscReal  lambda = w[q] * law->lambda, mu = w[q] * law->mu;

    for (PetscInt a = 0; a < nodes; a++)
      for (PetscInt b = 0; b < nodes; b++) {
        PetscReal dot = 0;

        for (PetscInt i = 0; i < dim; i++) dot += g[a * dim + i] * g[b * dim + i];
        for (PetscInt i = 0; i < dim; i++)
          for (PetscInt j = 0; j < dim; j++)
            K[(a * dim + i) * n + b * dim + j] += lambda * g[a * dim + i] * g[b * dim + j] + mu * g[a * dim + j] * g[b * dim + i] + (i == j ? mu * dot : 0);
      }
  }
}

/* Any law: K_ab = int B_a' C B_b.  Eq. (2.42) */
static void StiffnessGeneral(PetscInt nodes, PetscInt dim, PetscInt points, const FemElastic *law, const PetscReal *restrict dN, const PetscReal *restrict w, PetscReal *restrict K)
{
  const PetscInt n = nodes * dim;

  for (PetscInt k = 0; k < n * n; k++) K[k] = 0;
  for (PetscInt q = 0; q < points; q++)
    for (PetscInt b = 0; b < nodes; b++)
      for (PetscInt j = 0; j < dim; j++) { /* stress of a unit motion of node b along j */
        const PetscReal *d = &dN[(q * nodes + b) * dim];
        PetscReal        e[6] = {0}, s[6], t[3][3];

        e[j] = d[j];
        if (dim == 2) e[3] = d[1 - j];
        else {
          e[3 + j]           = d[(j + 1) % 3];
          e[3 + (j + 2) % 3] = d[(j + 2) % 3];
        }
        FemStress(law, dim, e, s);
        for (PetscInt i = 0; i < 3; i++) {
          t[i][i]           = w[q] * s[i];
          t[i][(i + 1) % 3] = t[(i + 1) % 3][i] = w[q] * s[3 + i];
        }
        for (PetscInt a = 0; a < nodes; a++)
          for (PetscInt i = 0; i < dim; i++)
            for (PetscInt k = 0; k < dim; k++) K[(a * dim + i) * n + b * dim + j] += t[i][k] * dN[(q * nodes + a) * dim + k];
      }
}

static void ForceGeneral(PetscInt nodes, PetscInt dim, PetscInt points, const FemElastic *law, const PetscReal *restrict dN, const PetscReal *restrict w, const PetscReal *restrict u, PetscReal *restrict f)
{
  for (PetscInt k = 0; k < nodes * dim; k++) f[k] = 0;
  for (PetscInt q = 0; q < points; q++) {
    const PetscReal *g = &dN[q * nodes * dim];
    PetscReal        h[3][3] = {{0}}, e[6], s[6], t[3][3];

    for (PetscInt a = 0; a < nodes; a++)
      for (PetscInt i = 0; i < dim; i++)
        for (PetscInt j = 0; j < dim; j++) h[i][j] += u[a * dim + i] * g[a * dim + j];
    for (PetscInt i = 0; i < 3; i++) {
      e[i]     = h[i][i];
      e[3 + i] = h[i][(i + 1) % 3] + h[(i + 1) % 3][i];
    }
    FemStress(law, dim, e, s);
    for (PetscInt i = 0; i < 3; i++) {
      t[i][i]           = w[q] * s[i];
      t[i][(i + 1) % 3] = t[(i + 1) % 3][i] = w[q] * s[3 + i];
    }
    for (PetscInt a = 0; a < nodes; a++)
      for (PetscInt i = 0; i < dim; i++)
        for (PetscInt j = 0; j < dim; j++) f[a * dim + i] += t[i][j] * g[a * dim + j];
  }
}

void FemStiffness(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, PetscReal *K)
{
  if (law->general) StiffnessGeneral(shape->nodes, shape->dim, shape->points, law, dN, w, K);
  else FOR_SHAPE(shape, Stiffness, law, dN, w, K)
}

static inline void Force(PetscInt nodes, PetscInt dim, PetscInt points, const FemElastic *law, const PetscReal *restrict dN, const PetscReal *restrict w, const PetscReal *restrict u, PetscReal *restrict f)
{
  for (PetscInt k = 0; k < nodes * dim; k++) f[k] = 0;
  for (PetscInt q = 0; q < points; q++) {
    const PetscReal *g = &dN[q * nodes * dim];
    PetscReal        h[3][3], s[3][3], trace = 0;

    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) {
        h[i][j] = 0;
        for (PetscInt a = 0; a < nodes; a++) h[i][j] += u[a * dim + i] * g[a * dim + j];
      }
    for (PetscInt i = 0; i < dim; i++) trace += h[i][i];
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) s[i][j] = w[q] * (law->mu * (h[i][j] + h[j][i]) + (i == j ? law->lambda * trace : 0));
    for (PetscInt a = 0; a < nodes; a++)
      for (PetscInt i = 0; i < dim; i++)
        for (PetscInt j = 0; j < dim; j++) f[a * dim + i] += s[i][j] * g[a * dim + j];
  }
}

void FemForce(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const PetscReal *u, PetscReal *f)
{
  if (law->general) ForceGeneral(shape->nodes, shape->dim, shape->points, law, dN, w, u, f);
  else FOR_SHAPE(shape, Force, law, dN, w, u, f)
}

void FemBodyMass(const FemShape *shape, PetscReal density, const PetscReal *w, PetscReal *m)
{
  for (PetscInt a = 0; a < shape->nodes; a++) {
    m[a] = 0;
    for (PetscInt q = 0; q < shape->points; q++) m[a] += density * w[q] * shape->N[q][a];
  }
}

void FemLumpedMass(const FemShape *shape, PetscReal density, const PetscReal *w, PetscReal *m)
{
  PetscReal mass = 0, sum = 0;

  if (shape->linear == shape->type) {
    FemBodyMass(shape, density, w, m);
    return;
  }
  for (PetscInt q = 0; q < shape->points; q++) mass += density * w[q];
  for (PetscInt a = 0; a < shape->nodes; a++) {
    m[a] = 0;
    for (PetscInt q = 0; q < shape->points; q++) m[a] += w[q] * shape->N[q][a] * shape->N[q][a];
    sum += m[a];
  }
  for (PetscInt a = 0; a < shape->nodes; a++) m[a] *= mass / sum;
}

void FemMeanStress(const FemShape *shape, const FemElastic *law, const PetscReal *dN, const PetscReal *w, const PetscReal *u, PetscReal *strain, PetscReal *stress)
{
  const PetscInt dim = shape->dim, nodes = shape->nodes;
  PetscReal      h[3][3] = {{0}}, e[6], volume = 0;

  for (PetscInt q = 0; q < shape->points; q++) {
    volume += w[q];
    for (PetscInt a = 0; a < nodes; a++)
      for (PetscInt i = 0; i < dim; i++)
        for (PetscInt j = 0; j < dim; j++) h[i][j] += w[q] * u[a * dim + i] * dN[(q * nodes + a) * dim + j];
  }
  for (PetscInt i = 0; i < dim; i++)
    for (PetscInt j = 0; j < dim; j++) h[i][j] /= volume;
  for (PetscInt i = 0; i < 3; i++) {
    e[i]     = h[i][i];
    e[3 + i] = h[i][(i + 1) % 3] + h[(i + 1) % 3][i];
  }
  if (stress) FemStress(law, dim, e, stress);
  if (dim == 2) e[2] = FemStrainZZ(law, e);
  for (PetscInt i = 0; i < 6 && strain; i++) strain[i] = e[i];
}

/* Largest eigenvalue of A <= (tr A^m)^(1/m) for m = 2^k, A symmetric and not negative; k = 6 loses at most n^(1/64). */
static inline PetscReal PowerTrace(PetscInt n, PetscReal *restrict A, PetscReal *restrict B)
{
  PetscReal log_scale = 0, power = 1, trace = 0;

  for (PetscInt k = 0;; k++) {
    trace = 0;
    for (PetscInt i = 0; i < n; i++) trace += A[i * n + i];
    if (!(trace > 0)) return 0;
    if (k == 6) break;
    for (PetscInt i = 0; i < n * n; i++) A[i] /= trace; /* A = scale^(2^k) times this */
    log_scale += PetscLogReal(trace) / power;
    power *= 2;
    for (PetscInt i = 0; i < n; i++) {
      for (PetscInt j = 0; j < n; j++) B[i * n + j] = 0;
      for (PetscInt l = 0; l < n; l++)
        for (PetscInt j = 0; j < n; j++) B[i * n + j] += A[i * n + l] * A[l * n + j];
    }
    for (PetscInt i = 0; i < n * n; i++) A[i] = B[i];
  }
  return PetscExpReal(log_scale + PetscLogReal(trace) / power) * (1 + 1e-10); /* round-off stays on the safe side */
}

PetscReal FemEigenBound(PetscInt nodes, PetscInt dim, const PetscReal *K, const PetscReal *m)
{
  const PetscInt n = nodes * dim;
  PetscReal      A[FEM_MAX_DOFS * FEM_MAX_DOFS], B[FEM_MAX_DOFS * FEM_MAX_DOFS];

  for (PetscInt i = 0; i < n; i++)
    for (PetscInt j = 0; j < n; j++) A[i * n + j] = K[i * n + j] / PetscSqrtReal(m[i / dim] * m[j / dim]);
  switch (n) {
  case 6: return PowerTrace(6, A, B);
  case 8: return PowerTrace(8, A, B);
  case 12: return PowerTrace(12, A, B);
  case 24: return PowerTrace(24, A, B);
  default: return PowerTrace(n, A, B);
  }
}

void FemFaceIntegrals(PetscInt dim, PetscInt n, const PetscReal *x, PetscReal thickness, PetscReal *N_dA, PetscReal *N_n_dA)
{
  const FemShape *side = dim == 3 ? FemShapeGet(n == 3 ? MESH_TRI3 : n == 4 ? MESH_QUAD4 : n == 6 ? MESH_TRI6 : n == 8 ? MESH_QUAD8 : MESH_QUAD9) : NULL;
  /* an edge: three Gauss points, exact for all but the length of a curved one */
  static const PetscReal gauss[3] = {-0.77459666924148338, 0, 0.77459666924148338}, weight[3] = {5.0 / 9, 8.0 / 9, 5.0 / 9};

  for (PetscInt a = 0; a < n; a++) {
    N_dA[a] = 0;
    for (PetscInt i = 0; i < dim; i++) N_n_dA[a * dim + i] = 0;
  }
  for (PetscInt q = 0; q < (dim == 2 ? 3 : side->points); q++) {
    PetscReal        edge_N[FEM_MAX_NODES], edge_dN[FEM_MAX_NODES][3], t[2][3] = {{0}}, normal[3], area;
    const PetscReal *N = edge_N, (*dN)[3] = (const PetscReal(*)[3])edge_dN;

    if (dim == 2) { /* the normal is the edge turned by -90 degrees */
      const PetscReal xi[3] = {gauss[q], 0, 0};

      FemShapeAt(n == 2 ? MESH_LINE2 : MESH_LINE3, xi, edge_N, edge_dN);
    } else {
      N  = side->N[q];
      dN = side->dN[q];
    }
    for (PetscInt a = 0; a < n; a++)
      for (PetscInt j = 0; j < dim - 1; j++)
        for (PetscInt i = 0; i < dim; i++) t[j][i] += x[dim * a + i] * dN[a][j];
    if (dim == 2) {
      normal[0] = weight[q] * thickness * t[0][1];
      normal[1] = -weight[q] * thickness * t[0][0];
      normal[2] = 0;
    } else
      for (PetscInt i = 0; i < 3; i++) normal[i] = side->weight[q] * (t[0][(i + 1) % 3] * t[1][(i + 2) % 3] - t[0][(i + 2) % 3] * t[1][(i + 1) % 3]);
    area = PetscSqrtReal(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    for (PetscInt a = 0; a < n; a++) {
      N_dA[a] += N[a] * area;
      for (PetscInt i = 0; i < dim; i++) N_n_dA[dim * a + i] += N[a] * normal[i];
    }
  }
}
