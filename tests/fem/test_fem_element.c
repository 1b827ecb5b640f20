/* Elements on their own: exact sums, the stiffness against its matrix-free twin, zero modes, the eigenvalue bound.  Theory 2.2 */
#include "check.h"
#include "fem_element.h"
#include <gmshc.h>
#include <petscblaslapack.h>

#define KINDS 13
static const MeshCellType types[KINDS] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8, MESH_PRISM6, MESH_TRI6, MESH_QUAD8, MESH_QUAD9, MESH_TET10, MESH_HEX20, MESH_HEX27, MESH_PRISM15, MESH_PRISM18};

/* A skewed element: corners of the reference one, moved by fixed amounts; between them a quadratic one is slightly curved. */
static void Skewed(const FemShape *s, PetscReal *x)
{
  static const PetscReal tri[3][2] = {{0, 0}, {1.2, 0.1}, {0.3, 0.9}}, quad[4][2] = {{0, 0}, {1.1, 0.1}, {1.3, 1.2}, {-0.1, 0.8}};
  static const PetscReal tet[4][3] = {{0, 0, 0}, {1.1, 0.1, 0.05}, {0.2, 0.9, -0.1}, {0.1, 0.3, 1.2}};
  static const PetscReal hex[8][3] = {{0, 0, 0}, {1.1, 0.05, 0}, {1.2, 1, 0.1}, {0.1, 0.9, -0.1}, {0, 0.1, 1}, {1, 0, 1.2}, {1.1, 1.2, 1.1}, {-0.1, 1, 0.9}};
  static const PetscReal prism[6][3] = {{0, 0, 0}, {1.1, 0.1, 0.05}, {0.2, 0.9, -0.1}, {0.1, 0, 1}, {1, 0.2, 1.1}, {0.1, 1.1, 0.9}};
  const PetscReal       *from = s->linear == MESH_TRI3 ? tri[0] : s->linear == MESH_QUAD4 ? quad[0] : s->linear == MESH_TET4 ? tet[0] : s->linear == MESH_HEX8 ? hex[0] : prism[0];

  for (PetscInt a = 0; a < s->nodes; a++) {
    PetscInt       corner[8];
    const PetscInt n = MeshCellParents(s->type, a, corner);

    for (PetscInt i = 0; i < s->dim; i++) {
      x[a * s->dim + i] = a < s->corners ? 0 : 0.02 * sin(a + 5 * i);
      for (PetscInt k = 0; k < n; k++) x[a * s->dim + i] += from[corner[k] * s->dim + i] / n;
    }
  }
}

typedef struct {
  const FemShape *s;
  PetscReal       x[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], K[FEM_MAX_DOFS * FEM_MAX_DOFS], volume;
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

/* A slow twin: gmsh's own functions of each type, at places inside and outside. */
static PetscErrorCode TestShapesAreGmshs(void)
{
  double place[12] = {0.1, 0.2, 0.3, 0.3, 0.15, -0.7, -0.4, 0.9, 0.25, 1.3, -0.6, 0.8};
  int    ierr, components, orientations;

  PetscFunctionBeginUser;
  gmshInitialize(0, NULL, 0, &ierr);
  CheckInt(ierr, 0);
  for (PetscInt t = 0; t < KINDS; t++) {
    const FemShape *s = FemShapeGet(types[t]);
    double         *value = NULL, *gradient = NULL, *local = NULL;
    char           *name = NULL;
    size_t          n_value, n_gradient, n_local;
    int             dim, order, nodes, primary;

    gmshModelMeshGetBasisFunctions((int)types[t], place, 12, "Lagrange", &components, &value, &n_value, &orientations, NULL, 0, &ierr);
    CheckInt(ierr, 0);
    gmshModelMeshGetBasisFunctions((int)types[t], place, 12, "GradLagrange", &components, &gradient, &n_gradient, &orientations, NULL, 0, &ierr);
    CheckInt(ierr, 0);
    CheckInt(n_value, 4 * s->nodes);
    CheckInt(n_gradient, 12 * s->nodes);
    for (PetscInt p = 0; p < 4; p++) {
      PetscReal N[FEM_MAX_NODES], dN[FEM_MAX_NODES][3];

      FemShapeAt(types[t], &place[3 * p], N, dN);
      for (PetscInt a = 0; a < s->nodes; a++) {
        CheckNear(N[a], value[p * s->nodes + a], 1e-13);
        for (PetscInt i = 0; i < s->dim; i++) CheckNear(dN[a][i], gradient[3 * (p * s->nodes + a) + i], 2e-13);
      }
    }
    gmshModelMeshGetElementProperties((int)types[t], &name, &dim, &order, &nodes, &local, &n_local, &primary, &ierr);
    CheckInt(ierr, 0);
    CheckInt(nodes, s->nodes);
    for (PetscInt a = 0; a < s->nodes; a++)
      for (PetscInt i = 0; i < dim; i++) CheckNear(s->place[a][i], local[a * dim + i], 1e-15);
    gmshFree(value);
    gmshFree(gradient);
    gmshFree(local);
    gmshFree(name);
  }
  gmshFinalize(&ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* VTK's own list of places (GetParametricCoords of VTK 9.1, times two) against ours in its order. */
static PetscErrorCode TestVtkOrder(void)
{
  static const struct {
    MeshCellType type;
    const char  *place;
  } vtk[] = {{MESH_TRI6, "000 200 020 100 110 010"},
             {MESH_QUAD9, "000 200 220 020 100 210 120 010 110"},
             {MESH_TET10, "000 200 020 002 100 110 010 001 101 011"},
             {MESH_HEX20, "000 200 220 020 002 202 222 022 100 210 120 010 102 212 122 012 001 201 221 021"},
             {MESH_HEX27, "000 200 220 020 002 202 222 022 100 210 120 010 102 212 122 012 001 201 221 021 011 211 101 121 110 112 111"},
             {MESH_PRISM15, "000 200 020 002 202 022 100 110 010 102 112 012 001 201 021"},
             {MESH_PRISM18, "000 200 020 002 202 022 100 110 010 102 112 012 001 201 021 101 111 011"}};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(vtk) / sizeof(vtk[0]); k++) {
    const FemShape *s = FemShapeGet(vtk[k].type);

    CheckInt(strlen(vtk[k].place), 4 * s->nodes - 1);
    for (PetscInt a = 0; a < s->nodes; a++)
      for (PetscInt i = 0; i < s->dim; i++) {
        const PetscReal  ours   = s->place[s->vtk_node[a]][i];
        const PetscBool  unit = s->linear == MESH_TRI3 || s->linear == MESH_TET4 || (s->linear == MESH_PRISM6 && i < 2) ? PETSC_TRUE : PETSC_FALSE;

        CheckNear(unit ? 2 * ours : ours + 1, vtk[k].place[4 * a + i] - '0', 1e-15);
      }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Integral of x^i y^j z^k over the reference element in closed form. */
static PetscReal Monomial(const FemShape *s, const PetscInt e[3])
{
  PetscReal value = 1;

  if (s->linear == MESH_QUAD4 || s->linear == MESH_HEX8) {
    for (PetscInt i = 0; i < s->dim; i++) value *= e[i] % 2 ? 0 : 2.0 / (e[i] + 1);
    return value;
  }
  const PetscInt d = s->linear == MESH_TET4 ? 3 : 2;

  value = 1 / tgamma(d + 1 + e[0] + e[1] + (d == 3 ? e[2] : 0)); /* i! j! k! / (i + j + k + d)! */
  for (PetscInt i = 0; i < d; i++) value *= tgamma(e[i] + 1);
  return s->linear == MESH_PRISM6 ? value * (e[2] % 2 ? 0 : 2.0 / (e[2] + 1)) : value;
}

/* The points integrate N_a N_b of a straight element exactly (linear simplices: N_a only), and nothing is left to chance in their digits. */
static PetscErrorCode TestPointsAreExact(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < KINDS; t++) {
    const FemShape *s = FemShapeGet(types[t]);
    const PetscInt  degree = s->type == MESH_TRI3 || s->type == MESH_TET4 ? 1 : s->type == s->linear ? 2 : 4;
    PetscInt        e[3];

    for (e[0] = 0; e[0] <= degree; e[0]++)
      for (e[1] = 0; e[1] <= degree; e[1]++)
        for (e[2] = 0; e[2] <= (s->dim == 3 ? degree : 0); e[2]++) {
          PetscReal      sum = 0;
          const PetscInt total = s->linear == MESH_PRISM6 ? e[0] + e[1] : s->linear == MESH_TRI3 || s->linear == MESH_TET4 ? e[0] + e[1] + e[2] : 0;

          if (total > degree) continue;
          for (PetscInt q = 0; q < s->points; q++) sum += s->weight[q] * pow(s->xi[q][0], e[0]) * pow(s->xi[q][1], e[1]) * pow(s->xi[q][2], e[2]);
          CheckNear(sum, Monomial(s, e), 2e-15);
        }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestShapesSumToOneAndReproducePlace(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < KINDS; t++) {
    Element e;

    Build(&e, types[t], &steel);
    for (PetscInt q = 0; q < e.s->points; q++) {
      PetscReal one = 0;

      for (PetscInt a = 0; a < e.s->nodes; a++) one += e.s->N[q][a];
      CheckNear(one, 1, 2e-15);
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
  PetscReal m[FEM_MAX_NODES], sum;

  PetscFunctionBeginUser;
  Build(&e, MESH_TRI3, &steel);
  CheckClose(e.volume, 0.5 * (1.2 * 0.9 - 0.3 * 0.1) * 0.7, 1e-14); /* half the cross product times the thickness */
  Build(&e, MESH_TET4, &steel);
  CheckClose(e.volume, (1.1 * (0.9 * 1.2 + 0.1 * 0.3) - 0.1 * (0.2 * 1.2 + 0.1 * 0.1) + 0.05 * (0.2 * 0.3 - 0.9 * 0.1)) / 6, 1e-14);
  for (PetscInt t = 0; t < KINDS; t++) {
    Build(&e, types[t], &steel);
    FemLumpedMass(e.s, 7800, e.w, m);
    sum = 0;
    for (PetscInt a = 0; a < e.s->nodes; a++) {
      CheckPositive(m[a]);
      sum += m[a];
    }
    CheckClose(sum, 7800 * e.volume, 1e-14);
    FemBodyMass(e.s, 7800, e.w, m);
    sum = 0;
    for (PetscInt a = 0; a < e.s->nodes; a++) sum += m[a];
    CheckClose(sum, 7800 * e.volume, 1e-14);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestForceIsStiffnessTimesMotion(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < KINDS; t++) {
    Element   e;
    PetscReal u[FEM_MAX_DOFS], f[FEM_MAX_DOFS];

    Build(&e, types[t], &steel);
    for (PetscInt k = 0; k < e.n; k++) u[k] = 1e-3 * sin(1 + 3 * k);
    FemForce(e.s, &steel, e.dN, e.w, u, f);
    for (PetscInt i = 0; i < e.n; i++) {
      PetscReal sum = 0;

      for (PetscInt j = 0; j < e.n; j++) {
        sum += e.K[i * e.n + j] * u[j];
        CheckNear(e.K[i * e.n + j], e.K[j * e.n + i], 1e-14 * 77e9);
      }
      CheckNear(f[i], sum, 2e-13 * 77e9 * 1e-3 * e.n);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Three rigid motions in the plane, six in space, and nothing else without force: no hourglass modes.  Notes P6 */
static PetscErrorCode TestZeroModes(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < KINDS; t++) {
    Element      e;
    PetscReal    lambda[FEM_MAX_DOFS], work[512];
    PetscBLASInt n, info, room = 512;
    PetscInt     zeros = 0;

    Build(&e, types[t], &steel);
    n = (PetscBLASInt)e.n;
    LAPACKsyev_("N", "U", &n, e.K, &n, lambda, work, &room, &info);
    CheckInt(info, 0);
    for (PetscInt k = 0; k < e.n; k++) zeros += PetscAbsReal(lambda[k]) < 1e-12 * lambda[e.n - 1];
    CheckInt(zeros, e.s->dim == 2 ? 3 : 6);
    CheckAbove(lambda[zeros], 1e-5 * lambda[e.n - 1]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestRigidMotionMakesNoForce(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < KINDS; t++) {
    Element e;

    Build(&e, types[t], &steel);
    for (PetscInt mode = 0; mode < 6; mode++) {
      PetscReal u[FEM_MAX_DOFS] = {0}, f[FEM_MAX_DOFS];

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
  for (PetscInt t = 0; t < KINDS; t++) {
    Element      e;
    PetscReal    m[FEM_MAX_NODES], A[FEM_MAX_DOFS * FEM_MAX_DOFS], lambda[FEM_MAX_DOFS], work[512], bound;
    PetscBLASInt n, info, room = 512;

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
  for (PetscInt t = 0; t < KINDS; t++) {
    Element   e;
    PetscReal sum[3] = {0, 0, 0}, flux = 0;

    Build(&e, types[t], &steel);
    for (PetscInt f = 0; f < e.s->faces; f++) {
      PetscReal x[27], a[9], n[27];

      for (PetscInt k = 0; k < e.s->face_nodes[f]; k++)
        for (PetscInt i = 0; i < e.s->dim; i++) x[k * e.s->dim + i] = e.x[e.s->face[f][k] * e.s->dim + i];
      FemFaceIntegrals(e.s->dim, e.s->face_nodes[f], x, 0.7, a, n);
      for (PetscInt k = 0; k < e.s->face_nodes[f]; k++)
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

CHECK_TEST(TestShapesAreGmshs)
CHECK_TEST(TestVtkOrder)
CHECK_TEST(TestPointsAreExact)
CHECK_TEST(TestShapesSumToOneAndReproducePlace)
CHECK_TEST(TestVolumeAndMass)
CHECK_TEST(TestForceIsStiffnessTimesMotion)
CHECK_TEST(TestZeroModes)
CHECK_TEST(TestRigidMotionMakesNoForce)
CHECK_TEST(TestEigenBound)
CHECK_TEST(TestFaceIntegrals)

static const struct CMUnitTest tests[] = {TEST(TestShapesAreGmshs), TEST(TestVtkOrder), TEST(TestPointsAreExact), TEST(TestShapesSumToOneAndReproducePlace), TEST(TestVolumeAndMass), TEST(TestForceIsStiffnessTimesMotion), TEST(TestZeroModes), TEST(TestRigidMotionMakesNoForce), TEST(TestEigenBound),
                                          TEST(TestFaceIntegrals)};
CHECK_MAIN(tests)
