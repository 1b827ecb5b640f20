/* quad4 and hex8 with strains of their own: what one element must do, and that nothing locks where the plain one does.  Theory 2.5 */
#include "fem_case.h"
#include "fem_element.h"
#include <petscblaslapack.h>

static const MeshCellType types[2] = {MESH_QUAD4, MESH_HEX8};

typedef struct {
  const FemShape *s;
  FemElastic      law;
  FemModes        modes;
  PetscReal       x[24], dN[192], w[8], plain[576], K[576];
  PetscInt        n;
} Element;

static void Build(Element *e, MeshCellType type, PetscReal nu, PetscReal skew)
{
  e->s          = FemShapeGet(type);
  e->n          = e->s->nodes * e->s->dim;
  e->law        = (FemElastic){0};
  e->law.lambda = nu / ((1 + nu) * (1 - 2 * nu));
  e->law.mu     = 1 / (2 * (1 + nu));
  for (PetscInt a = 0; a < e->s->nodes; a++)
    for (PetscInt i = 0; i < e->s->dim; i++) e->x[a * e->s->dim + i] = (1 + i) * e->s->place[a][i] + skew * sin(1 + 7 * a + 3 * i);
  CheckInt(FemGradients(e->s, e->x, 0.7, e->dN, e->w), 0);
  FemModesCreate(e->s, &e->law, e->x, e->w, &e->modes);
  FemModesStiffness(e->s, &e->law, e->dN, e->w, &e->modes, e->K);
  FemStiffness(e->s, &e->law, e->dN, e->w, e->plain);
}

static void Eigenvalues(PetscInt n, const PetscReal *A, PetscReal *lambda)
{
  PetscReal    B[576], work[256];
  PetscBLASInt size = (PetscBLASInt)n, room = 256, info;

  for (PetscInt k = 0; k < n * n; k++) B[k] = A[k];
  LAPACKsyev_("N", "U", &size, B, &size, lambda, work, &room, &info);
  CheckInt(info, 0);
}

/* Rigid motions and nothing else without force, at any Poisson's ratio; never stiffer than the plain element. */
static PetscErrorCode TestRankAndOrder(void)
{
  const PetscReal nu[3] = {0, 0.3, 0.4999};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 2; t++)
    for (PetscInt k = 0; k < 6; k++) {
      Element   e;
      PetscReal lambda[24], less[576];
      PetscInt  zeros = 0;

      Build(&e, types[t], nu[k / 2], k % 2 ? 0.15 : 0);
      Eigenvalues(e.n, e.K, lambda);
      for (PetscInt i = 0; i < e.n; i++) zeros += PetscAbsReal(lambda[i]) < 1e-12 * lambda[e.n - 1];
      CheckInt(zeros, t ? 6 : 3);
      CheckAbove(lambda[zeros], 0.01); /* of the order of E x length, however large lambda is */
      for (PetscInt i = 0; i < e.n * e.n; i++) less[i] = e.plain[i] - e.K[i];
      Eigenvalues(e.n, less, lambda);
      CheckAbove(lambda[0], -1e-12 * lambda[e.n - 1]);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Force without the matrix is the matrix times the motion; its energy is the least over the own strains; a linear field has none. */
static PetscErrorCode TestForceAndStrain(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 2; t++) {
    Element   e;
    PetscReal u[24], f[24], strain[8][6], plain[8][6], energy = 0, twice = 0;

    Build(&e, types[t], 0.3, 0.15);
    for (PetscInt k = 0; k < e.n; k++) u[k] = sin(1 + 3 * k);
    FemModesForce(e.s, &e.law, e.dN, e.w, &e.modes, u, f);
    for (PetscInt i = 0; i < e.n; i++) {
      PetscReal sum = 0;

      for (PetscInt j = 0; j < e.n; j++) {
        sum += e.K[i * e.n + j] * u[j];
        CheckNear(e.K[i * e.n + j], e.K[j * e.n + i], 1e-14);
      }
      CheckNear(f[i], sum, 1e-13);
      twice += f[i] * u[i];
    }
    FemModesStrain(e.s, &e.law, e.dN, e.w, &e.modes, u, strain);
    FemModesStrain(e.s, &e.law, e.dN, e.w, NULL, u, plain);
    for (PetscInt q = 0; q < e.s->points; q++) {
      PetscReal s[6];

      FemStress(&e.law, e.s->dim, strain[q], s);
      for (PetscInt i = 0; i < 6; i++) energy += e.w[q] * s[i] * strain[q][i];
    }
    CheckClose(energy, twice, 1e-13);
    for (PetscInt i = 0; i < 6; i++) { /* the means are those of the nodes: u on the surface decides them */
      PetscReal sum = 0;

      for (PetscInt q = 0; q < e.s->points; q++) sum += e.w[q] * (strain[q][i] - plain[q][i]);
      CheckNear(sum, 0, 1e-13);
    }
    for (PetscInt a = 0; a < e.s->nodes; a++)
      for (PetscInt i = 0; i < e.s->dim; i++) {
        u[a * e.s->dim + i] = 0.1 * (1 + i);
        for (PetscInt j = 0; j < e.s->dim; j++) u[a * e.s->dim + i] += cos(2 * i + 5 * j) * e.x[a * e.s->dim + j];
      }
    FemModesStrain(e.s, &e.law, e.dN, e.w, &e.modes, u, strain);
    for (PetscInt q = 0; q < e.s->points; q++)
      for (PetscInt i = 0; i < e.s->dim; i++) CheckNear(strain[q][i], cos(7 * i), 1e-13);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Motion of the inner face of a thick cylinder under pressure 1, plane strain; MacNeal and Harder's mesh of 5 rings times 9, each cut in `fine`. */
static PetscErrorCode Cylinder(MeshCellType type, FemElement element, PetscReal nu, PetscInt fine, PetscReal *u_inner)
{
  const FemMaterial m         = {1, 1000, nu};
  const PetscReal   length[3] = {1, 1, 1};
  const PetscInt    n[3]      = {5 * fine, 9 * fine, 1};
  const PetscReal   ring[6]   = {3, 3.5, 4.2, 5.2, 6.75, 9};
  Mesh              mesh;
  FemModel          model;
  Table             one;
  PetscReal        *u;

  PetscFunctionBeginUser;
  PetscCall(TableCreateConstant(1, &one));
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, 0, &mesh));
  for (PetscInt i = 0; i < mesh.n_nodes; i++) {
    PetscReal      *x = &mesh.x[3 * i];
    const PetscInt  k = PetscMin(4, (PetscInt)floor(5 * x[0] + 1e-9));
    const PetscReal r = ring[k] + (5 * x[0] - k) * (ring[k + 1] - ring[k]), angle = x[1] * PETSC_PI / 2;

    x[0] = r * cos(angle);
    x[1] = r * sin(angle);
  }
  PetscCall(FemModelCreate(PETSC_COMM_SELF, &model));
  PetscCall(FemModelSetKind(model, mesh.dim == 2 ? FEM_PLANE_STRAIN : FEM_SOLID, 1));
  PetscCall(FemModelSetElement(model, element));
  PetscCall(FemModelSetMesh(model, &mesh));
  PetscCall(FemModelAddMaterial(model, "", &m));
  PetscCall(CaseFix(model, "ymin", 1, 0));
  PetscCall(CaseFix(model, "ymax", 0, 0));
  if (mesh.dim == 3) PetscCall(CaseFix(model, "body", 2, 0));
  PetscCall(FemModelAddPressure(model, "xmin", &one));
  PetscCall(CaseSolve(model));
  PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
  PetscCall(FemModelGetField(model, "displacement", u));
  *u_inner = u[3 * CaseNodeAt(&mesh, 3, 0, 0)];
  PetscCall(PetscFree(u));
  PetscCall(TableDestroy(&one));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* MacNeal and Harder's figures; the plain elements lock: less than a tenth of the motion is left at 0.4999. */
static PetscErrorCode TestNearlyIncompressibleCylinder(void)
{
  const PetscReal nu[4] = {0.3, 0.49, 0.499, 0.4999}, exact[4] = {4.5825e-3, 5.03993e-3, 5.06025e-3, 5.06227e-3};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 2; t++)
    for (PetscInt k = 0; k < 4; k++) {
      PetscReal enhanced, finer, full;

      PetscCall(Cylinder(types[t], FEM_ENHANCED, nu[k], 1, &enhanced));
      PetscCall(Cylinder(types[t], FEM_ENHANCED, nu[k], 2, &finer));
      PetscCall(Cylinder(types[t], FEM_FULL, nu[k], 1, &full));
      printf("  gmsh type %d, nu %.4f: enhanced %.4f (%.4f on half the size), full %.4f of the exact motion\n", (int)types[t], (double)nu[k], (double)(enhanced / exact[k]), (double)(finer / exact[k]), (double)(full / exact[k]));
      CheckClose(enhanced, exact[k], 0.015);
      CheckClose(finer, exact[k], 0.005);
      if (k == 3) CheckBelow(full, 0.1 * exact[k]);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One layer of square elements bent as a beam of depth 1 and length 20: P L^3/3EI and a little shear. */
static PetscErrorCode Bend(MeshCellType type, FemElement element, PetscReal depth, PetscReal *tip)
{
  const FemMaterial m         = {1, 1000, 0.3};
  const PetscReal   length[3] = {20, depth, 1};
  const PetscInt    n[3]      = {20, 1, 1}, first = 0;
  Mesh              mesh;
  FemModel          model;
  PetscReal        *u;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, 0, &mesh));
  PetscCall(CaseAddNodeGroups(&mesh, 1, &first));
  PetscCall(FemModelCreate(PETSC_COMM_SELF, &model));
  PetscCall(FemModelSetKind(model, mesh.dim == 2 ? FEM_PLANE_STRESS : FEM_SOLID, 1));
  PetscCall(FemModelSetElement(model, element));
  PetscCall(FemModelSetMesh(model, &mesh));
  PetscCall(FemModelAddMaterial(model, "", &m));
  for (PetscInt d = 0; d < 2; d++) PetscCall(CaseFix(model, "xmin", d, 0));
  if (mesh.dim == 3) PetscCall(CaseFix(model, "node 0", 2, 0)); /* else free to narrow where it is stretched, as a beam does */
  PetscCall(CaseTraction(model, "xmax", 0, 1 / depth, 0));
  PetscCall(CaseSolve(model));
  PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
  PetscCall(FemModelGetField(model, "displacement", u));
  *tip = u[3 * CaseNodeAt(&mesh, 20, 0, 0) + 1] / (20 * 20 * 20 / (3 * 1000 * depth * depth * depth / 12) + 1.2 * 20 / (1000 / 2.6 * depth));
  PetscCall(PetscFree(u));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestThinBending(void)
{
  const PetscReal depth[3] = {1, 0.2, 0.05};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 2; t++)
    for (PetscInt k = 0; k < 3; k++) {
      PetscReal enhanced, full;

      PetscCall(Bend(types[t], FEM_ENHANCED, depth[k], &enhanced));
      PetscCall(Bend(types[t], FEM_FULL, depth[k], &full));
      printf("  gmsh type %d, one layer %g deep of 20 elements: enhanced %.4f, full %.4f of the beam's deflection\n", (int)types[t], (double)depth[k], (double)enhanced, (double)full);
      CheckClose(enhanced, 1, 0.015);
      if (k) CheckBelow(full, 0.1);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestRankAndOrder)
CHECK_TEST(TestForceAndStrain)
CHECK_TEST(TestNearlyIncompressibleCylinder)
CHECK_TEST(TestThinBending)

static const struct CMUnitTest tests[] = {TEST(TestRankAndOrder), TEST(TestForceAndStrain), TEST(TestNearlyIncompressibleCylinder), TEST(TestThinBending)};
CHECK_MAIN(tests)
