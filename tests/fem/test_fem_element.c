/* Elements on their own: exact sums, the stiffness against its matrix-free twin, zero modes, the eigenvalue bound.  Theory 2.2 */
#include "check.h"
#include "fem_element.h"
#include <petscblaslapack.h>

static const MeshCellType types[4] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8};

/* A skewed element: corners of the reference one, moved by fixed amounts. */
static void Skewed(const FemShape *s, PetscReal *x)
{
  static const PetscReal tri[3][2] = {{0, 0}, {1.2, 0.1}, {0.3, 0.9}}, quad[4][2] = {{0, 0}, {1.1, 0.1}, {1.3, 1.2}, {-0.1, 0.8}};
  static const PetscReal tet[4][3] = {{0, 0, 0}, {1.1, 0.1, 0.05}, {0.2, 0.9, -0.1}, {0.1, 0.3, 1.2}};
  static const PetscReal hex[8][3] = {{0, 0, 0}, {1.1, 0.05, 0}, {1.2, 1, 0.1}, {0.1, 0.9, -0.1}, {0, 0.1, 1}, {1, 0, 1.2}, {1.1, 1.2, 1.1}, {-0.1, 1, 0.9}};
  const PetscReal       *from = s->type == MESH_TRI3 ? tri[0] : s->type == MESH_QUAD4 ? quad[0] : s->type == MESH_TET4 ? tet[0] : hex[0];

  for (PetscInt k = 0; k < s->nodes * s->dim; k++) x[k] = from[k];
}

typedef struct {
  const FemShape *s;
  PetscReal       x[24], dN[192], w[8], K[576], volume;
  PetscInt        n;
} Element;

static void Build(Element *e, MeshCellType type, const FemElastic *law)
{
  e->s = FemShapeGet(type);
  Skewed(e->s, e->x);
  CheckInt(FemGradients(e->s, e->x, 0.7, e->dN, e->w), 0);
  FemStiffness(e->s, law, e->dN, e->w, e->K);
  e->n      = e->s->nodes * e->s->dim;
  e->volume = 0;
  for (PetscInt q = 0; q < e->s->points; q++) e->volume += e->w[q];
}

static const FemElastic steel = {115e9, 77e9, 0, 0};

static PetscErrorCode TestShapesSumToOneAndReproducePlace(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) {
    Element e;

    Build(&e, types[t], &steel);
    for (PetscInt q = 0; q < e.s->points; q++) {
      PetscReal one = 0;

      for (PetscInt a = 0; a < e.s->nodes; a++) one += e.s->N[q][a];
      CheckNear(one, 1, 1e-15);
      for (PetscInt i = 0; i < e.s->dim; i++)
        for (PetscInt j = 0; j < e.s->dim; j++) { /* sum x_i dN/dx_j = delta_ij */
          PetscReal sum = 0;

          for (PetscInt a = 0; a < e.s->nodes; a++) sum += e.x[a * e.s->dim + i] * e.dN[(q * e.s->nodes + a) * e.s->dim + j];
          CheckNear(sum, i == j, 1e-14);
        }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Hand figures: the skewed triangle and tetrahedron from their determinants. */
static PetscErrorCode TestVolumeAndMass(void)
{
  Element   e;
  PetscReal m[8], sum;

  PetscFunctionBeginUser;
  Build(&e, MESH_TRI3, &steel);
  CheckClose(e.volume, 0.5 * (1.2 * 0.9 - 0.3 * 0.1) * 0.7, 1e-14); /* half the cross product times the thickness */
  Build(&e, MESH_TET4, &steel);
  CheckClose(e.volume, (1.1 * (0.9 * 1.2 + 0.1 * 0.3) - 0.1 * (0.2 * 1.2 + 0.1 * 0.1) + 0.05 * (0.2 * 0.3 - 0.9 * 0.1)) / 6, 1e-14);
  for (PetscInt t = 0; t < 4; t++) {
    Build(&e, types[t], &steel);
    FemLumpedMass(e.s, 7800, e.w, m);
    sum = 0;
    for (PetscInt a = 0; a < e.s->nodes; a++) {
      CheckAbove(m[a], 0);
      sum += m[a];
    }
    CheckClose(sum, 7800 * e.volume, 1e-14);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestForceIsStiffnessTimesMotion(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) {
    Element   e;
    PetscReal u[24], f[24];

    Build(&e, types[t], &steel);
    for (PetscInt k = 0; k < e.n; k++) u[k] = 1e-3 * sin(1 + 3 * k);
    FemForce(e.s, &steel, e.dN, e.w, u, f);
    for (PetscInt i = 0; i < e.n; i++) {
      PetscReal sum = 0;

      for (PetscInt j = 0; j < e.n; j++) {
        sum += e.K[i * e.n + j] * u[j];
        CheckNear(e.K[i * e.n + j], e.K[j * e.n + i], 1e-14 * 77e9);
      }
      CheckNear(f[i], sum, 1e-13 * 77e9 * 1e-3 * e.n);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Three rigid motions in the plane, six in space, and nothing else without force: no hourglass modes.  Notes P6 */
static PetscErrorCode TestZeroModes(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) {
    Element      e;
    PetscReal    lambda[24], work[256];
    PetscBLASInt n, info, room = 256;
    PetscInt     zeros = 0;

    Build(&e, types[t], &steel);
    n = (PetscBLASInt)e.n;
    LAPACKsyev_("N", "U", &n, e.K, &n, lambda, work, &room, &info);
    CheckInt(info, 0);
    for (PetscInt k = 0; k < e.n; k++) zeros += PetscAbsReal(lambda[k]) < 1e-12 * lambda[e.n - 1];
    CheckInt(zeros, e.s->dim == 2 ? 3 : 6);
    CheckAbove(lambda[zeros], 1e-4 * lambda[e.n - 1]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestRigidMotionMakesNoForce(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) {
    Element e;

    Build(&e, types[t], &steel);
    for (PetscInt mode = 0; mode < 6; mode++) {
      PetscReal u[24] = {0}, f[24];

      for (PetscInt a = 0; a < e.s->nodes; a++)
        for (PetscInt i = 0; i < e.s->dim; i++) {
          const PetscInt r = mode - 3; /* small rotation about axis r */

          if (mode < 3) u[a * e.s->dim + i] = i == mode;
          else if (e.s->dim == 3) u[a * 3 + i] = i == (r + 1) % 3 ? -e.x[a * 3 + (r + 2) % 3] : i == (r + 2) % 3 ? e.x[a * 3 + (r + 1) % 3] : 0;
          else if (r == 2) u[a * 2 + i] = i == 0 ? -e.x[a * 2 + 1] : e.x[a * 2];
        }
      FemForce(e.s, &steel, e.dN, e.w, u, f);
      for (PetscInt k = 0; k < e.n; k++) CheckNear(f[k], 0, 1e-13 * 200e9);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The trace bound against LAPACK: never below, at most n^(1/64) above.  Eq. (2.13) */
static PetscErrorCode TestEigenBound(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) {
    Element      e;
    PetscReal    m[8], A[576], lambda[24], work[256], bound;
    PetscBLASInt n, info, room = 256;

    Build(&e, types[t], &steel);
    FemLumpedMass(e.s, 7800, e.w, m);
    bound = FemEigenBound(e.s->nodes, e.s->dim, e.K, m);
    n     = (PetscBLASInt)e.n;
    for (PetscInt i = 0; i < e.n; i++)
      for (PetscInt j = 0; j < e.n; j++) A[i * e.n + j] = e.K[i * e.n + j] / PetscSqrtReal(m[i / e.s->dim] * m[j / e.s->dim]);
    LAPACKsyev_("N", "U", &n, A, &n, lambda, work, &room, &info);
    CheckAbove(bound, lambda[e.n - 1]);
    CheckBelow(bound, lambda[e.n - 1] * PetscPowReal(e.n, 1.0 / 64) * 1.0001);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Unit square side and a triangle: shares and normals by hand; the sides of any element close. */
static PetscErrorCode TestFaceIntegrals(void)
{
  const PetscReal square[12] = {0, 0, 0, 2, 0, 0, 2, 1, 0, 0, 1, 0}, edge[4] = {0, 0, 3, 4};
  PetscReal       a[4], n[12];

  PetscFunctionBeginUser;
  FemFaceIntegrals(3, 4, square, 1, a, n);
  for (PetscInt k = 0; k < 4; k++) {
    CheckNear(a[k], 0.5, 1e-15);
    CheckNear(n[3 * k + 2], 0.5, 1e-15);
  }
  FemFaceIntegrals(2, 2, edge, 0.1, a, n);
  CheckNear(a[0], 0.25, 1e-15);  /* half of 5 m x 0.1 m */
  CheckNear(n[0], 0.2, 1e-15);   /* 0.1/2 x (4, -3) */
  CheckNear(n[1], -0.15, 1e-15);
  for (PetscInt t = 0; t < 4; t++) {
    Element   e;
    PetscReal sum[3] = {0, 0, 0}, flux = 0;

    Build(&e, types[t], &steel);
    for (PetscInt f = 0; f < e.s->faces; f++) {
      PetscReal x[12];

      for (PetscInt k = 0; k < e.s->face_nodes; k++)
        for (PetscInt i = 0; i < e.s->dim; i++) x[k * e.s->dim + i] = e.x[e.s->face[f][k] * e.s->dim + i];
      FemFaceIntegrals(e.s->dim, e.s->face_nodes, x, 0.7, a, n);
      for (PetscInt k = 0; k < e.s->face_nodes; k++)
        for (PetscInt i = 0; i < e.s->dim; i++) {
          sum[i] += n[k * e.s->dim + i];
          flux += n[k * e.s->dim + i] * x[k * e.s->dim + i];
        }
    }
    for (PetscInt i = 0; i < e.s->dim; i++) CheckNear(sum[i], 0, 1e-14);
    CheckClose(flux, e.s->dim * e.volume, 1e-13); /* div x = dim */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestShapesSumToOneAndReproducePlace)
CHECK_TEST(TestVolumeAndMass)
CHECK_TEST(TestForceIsStiffnessTimesMotion)
CHECK_TEST(TestZeroModes)
CHECK_TEST(TestRigidMotionMakesNoForce)
CHECK_TEST(TestEigenBound)
CHECK_TEST(TestFaceIntegrals)

static const struct CMUnitTest tests[] = {TEST(TestShapesSumToOneAndReproducePlace), TEST(TestVolumeAndMass), TEST(TestForceIsStiffnessTimesMotion), TEST(TestZeroModes), TEST(TestRigidMotionMakesNoForce), TEST(TestEigenBound),
                                          TEST(TestFaceIntegrals)};
CHECK_MAIN(tests)
