/* A cantilever whose middle is particles: the tip's deflection against elements alone, with the overlap's width and the size of element. */
#include "check.h"
#include "coupled.h"

#define NU     0.2
#define SHEAR  1e-9 /* end traction over Young's modulus */
#define LENGTH 12
#define DEPTH  3

/* Elements alone, a quarter of unit edge, without locking. */
static PetscErrorCode Reference(PetscReal *tip)
{
  const PetscReal   zero[3] = {0}, size[3] = {LENGTH, DEPTH, 1}, up[3] = {0, 1, 0};
  const PetscInt    n[3] = {4 * LENGTH, 4 * DEPTH, 1};
  const FemMaterial material = {.density = 1, .young = 1, .poisson = NU};
  Mesh              mesh;
  FemModel          fem;
  Stepper           stepper;
  Table             none, load;
  PetscReal        *u;

  PetscFunctionBegin;
  PetscCall(MeshCreateBox(PETSC_COMM_SELF, "beam", MESH_QUAD4, zero, size, n, &mesh));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(TableCreateConstant(SHEAR, &load));
  PetscCall(FemModelCreate(PETSC_COMM_SELF, &fem));
  PetscCall(FemModelSetKind(fem, FEM_PLANE_STRAIN, 1));
  PetscCall(FemModelSetMethod(fem, FEM_STATIC));
  PetscCall(FemModelSetElement(fem, FEM_ENHANCED));
  PetscCall(FemModelSetMesh(fem, &mesh));
  PetscCall(FemModelAddMaterial(fem, "", &material));
  for (PetscInt d = 0; d < 2; d++) PetscCall(FemModelFix(fem, "xmin", d, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(fem, "xmax", up, &load));
  PetscCall(FemModelSetUp(fem));
  PetscCall(FemModelGetStepper(fem, &stepper));
  PetscCall(stepper.step(fem, 0, 1));
  PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
  PetscCall(FemModelGetField(fem, "displacement", u));
  for (PetscInt i = 0; i < mesh.n_nodes; i++)
    if (mesh.x[3 * i] == LENGTH && mesh.x[3 * i + 1] == 0) *tip = u[3 * i + 1];
  PetscCall(PetscFree(u));
  PetscCall(TableDestroy(&none));
  PetscCall(TableDestroy(&load));
  PetscCall(FemModelDestroy(&fem));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Particles of h/ratio between x = 5 and 7, the overlap `width` elements of h to each side; brought to rest. */
static PetscErrorCode Tip(MeshCellType type, PetscReal h, PetscReal ratio, PetscInt width, PetscReal *tip)
{
  const PetscReal size[3] = {LENGTH, DEPTH, 1}, up[3] = {0, 1, 0}, t[2] = {0, 200}, v[2] = {0, SHEAR};
  const PetscReal first = 3.516 * (DEPTH / PetscSqrtReal(12)) / PetscSqr(LENGTH); /* lowest circular frequency, about */
  Coupled         c;
  Stepper         stepper;
  Table           none, ramp;
  FemState        fs;
  PetscReal       dt;

  PetscFunctionBegin;
  PetscCall(CoupledCreateOf(type, size, h, 5, 7, ratio, width, NU, 3, NULL, &c));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(TableCreate(2, t, v, &ramp));
  for (PetscInt d = 0; d < 2; d++) PetscCall(FemModelFix(c.fem, "xmin", d, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(c.fem, "xmax", up, &ramp));
  PetscCall(FemModelSetElement(c.fem, FEM_ENHANCED));
  PetscCall(FemModelSetDamping(c.fem, 2.5 * first)); /* of the elements only, most of the beam: about critical */
  PetscCall(DemModelSetLocalDamping(c.dem, 0.1));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, &dt));
  dt *= 0.9;
  for (PetscInt k = 0; k * dt < 200 + 14 / first; k++) PetscCall(stepper.step(c.model, k * dt, dt));
  PetscCall(FemModelGetState(c.fem, &fs));
  for (PetscInt i = 0; i < fs.n_nodes; i++)
    if (fs.x[2 * i] == LENGTH && fs.x[2 * i + 1] == 0) *tip = fs.u[2 * i + 1];
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(TableDestroy(&none));
  PetscCall(TableDestroy(&ramp));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Below 1 % at the default width of two elements. It is the linear elements' own error, which finer ones take out and the overlap's width hardly touches; with quadratic ones what the overlap does is left. */
static PetscErrorCode TestCantilever(void)
{
  PetscReal exact, tip[3], fine;

  PetscFunctionBeginUser;
  PetscCall(Reference(&exact));
  for (PetscInt width = 1; width <= 3; width++) {
    PetscCall(Tip(MESH_QUAD4, 1, 4, width, &tip[width - 1]));
    print_message("           overlap of %d elements: tip / exact - 1 = %+.4f\n", (int)width, (double)(tip[width - 1] / exact - 1));
  }
  PetscCall(Tip(MESH_QUAD4, 0.5, 4, 2, &fine));
  print_message("           2 elements of half the size: %+.4f\n", (double)(fine / exact - 1));
  CheckBelow(PetscAbsReal(tip[1] / exact - 1), 0.01);
  CheckBelow(PetscAbsReal(fine / exact - 1), 0.5 * PetscAbsReal(tip[1] / exact - 1));
  for (PetscInt width = 1; width <= 3; width++) {
    PetscCall(Tip(MESH_QUAD9, 1, 5, width, &tip[width - 1]));
    print_message("           quadratic, overlap of %d elements: %+.5f\n", (int)width, (double)(tip[width - 1] / exact - 1));
    CheckBelow(PetscAbsReal(tip[width - 1] / exact - 1), 0.002);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCantilever)

/* Quadratic cells of the same number bend better than linear ones. */
static PetscErrorCode TestQuadratic(void)
{
  static const MeshCellType linear[] = {MESH_QUAD4, MESH_TRI3}, quadratic[] = {MESH_QUAD9, MESH_TRI6};
  PetscReal                 exact, tip[2];

  PetscFunctionBeginUser;
  PetscCall(Reference(&exact));
  for (PetscInt k = 0; k < 2; k++) {
    PetscCall(Tip(linear[k], 1, 5, 2, &tip[0]));
    PetscCall(Tip(quadratic[k], 1, 5, 2, &tip[1]));
    print_message("           %d nodes: tip / exact - 1 = %+.4f, %d nodes: %+.4f\n", (int)MeshCellNodes(linear[k]), (double)(tip[0] / exact - 1), (int)MeshCellNodes(quadratic[k]), (double)(tip[1] / exact - 1));
    CheckBelow(PetscAbsReal(tip[1] / exact - 1), 0.5 * PetscAbsReal(tip[0] / exact - 1));
    CheckBelow(PetscAbsReal(tip[1] / exact - 1), 0.005);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestQuadratic)

static const struct CMUnitTest tests[] = {TEST(TestQuadratic), TEST(TestCantilever)};

CHECK_MAIN(tests)
