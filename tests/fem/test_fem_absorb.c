/* Sides that absorb waves: a pulse leaves, in 2D and 3D, implicit and explicit; energy booked; the critical step kept.  Theory 2.11 */
#include "fem_case.h"

static PetscErrorCode Run(FemModel model, PetscReal dt, PetscInt from, PetscInt to)
{
  Stepper s;

  PetscFunctionBeginUser;
  PetscCall(FemModelGetStepper(model, &s));
  for (PetscInt k = from; k < to; k++) PetscCall(s.step(s.ctx, k * dt, dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Notes T11: concrete, nu = 0.48, a bar whose sides hold the lateral motion; one end is pushed by 1 mm over 20 elements' travel and
  held, the far end absorbs. Normal wave (shear: 0) or shear wave. Returns what is left of the energy put in.
*/
static PetscErrorCode Pulse(MeshCellType type, FemMethod method, PetscInt shear, PetscReal courant, PetscReal *left, PetscReal *ledger_error)
{
  const FemMaterial m         = {2400, 3.6e10, 0.48};
  const PetscReal   length[3] = {100, 2, 2}, h = 1;
  const PetscInt    n[3]      = {100, 2, 2}, dim = MeshCellDim(type), along = shear ? 1 : 0;
  const PetscReal   mu = 3.6e10 / (2 * 1.48), lambda = 3.6e10 * 0.48 / (1.48 * 0.04), c = PetscSqrtReal((shear ? mu : lambda + 2 * mu) / 2400);
  PetscReal         time[41], push[41], dt = courant * h / PetscSqrtReal((lambda + 2 * mu) / 2400), *u;
  PetscInt          steps;
  Table             table;
  Mesh              mesh;
  FemModel          model;
  Ledger            l;
  PetscReal         given;

  PetscFunctionBeginUser;
  for (PetscInt j = 0; j <= 40; j++) { /* 1 mm and back, smoothly */
    time[j] = j * h / c;
    push[j] = 1e-3 * PetscSqr(PetscSinReal(PETSC_PI * j / 40));
  }
  PetscCall(TableCreate(41, time, push, &table));
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, method, 1, &m, &model));
  for (PetscInt d = 0; d < dim; d++)
    if (d != along) PetscCall(CaseFix(model, "body", d, 0));
  PetscCall(FemModelFix(model, "xmin", along, FEM_DISPLACEMENT, &table));
  PetscCall(FemModelAddAbsorber(model, "xmax"));
  PetscCall(FemModelSetUp(model));
  steps = (PetscInt)PetscCeilReal(45 * h / c / dt);
  PetscCall(Run(model, dt, 0, steps));
  PetscCall(CaseLedger(model, &l));
  given = l.energy[LEDGER_WORK];
  CheckAbove(l.energy[LEDGER_KINETIC], 0.4 * given); /* the pulse is on its way: half and half */
  PetscCall(Run(model, dt, steps, (PetscInt)PetscCeilReal(200 * h / c / dt)));
  PetscCall(CaseLedger(model, &l));
  *left         = (l.energy[LEDGER_KINETIC] + l.energy[LEDGER_STRAIN]) / given;
  *ledger_error = LedgerError(&l);
  CheckClose(l.energy[LEDGER_DAMPING], given, 2e-3);
  PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
  PetscCall(FemModelGetField(model, "displacement", u));
  for (PetscInt i = 0; i < mesh.n_nodes; i++) CheckNear(u[3 * i + along], 0, 2.5e-5); /* back at rest, 1 mm had passed */
  PetscCall(PetscFree(u));
  PetscCall(TableDestroy(&table));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestNormalAndShearPulsesLeave(void)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 8; k++) {
    const MeshCellType type   = k & 1 ? MESH_HEX8 : MESH_QUAD4;
    const FemMethod    method = k & 2 ? FEM_IMPLICIT : FEM_EXPLICIT;
    PetscReal          left, error;

    PetscCall(Pulse(type, method, k & 4 ? 1 : 0, k & 2 ? 0.5 : 0.6, &left, &error));
    printf("  %s, %s, %s wave: %.2e of the energy stays\n", k & 1 ? "hex8" : "quad4", k & 2 ? "implicit" : "explicit", k & 4 ? "shear" : "normal", (double)left);
    CheckBelow(left, 1e-3);
    CheckBelow(error, 1e-10);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At Courant 1 in one dimension the dashpot is the missing half of the bar: nothing at all comes back. */
static PetscErrorCode TestNothingComesBackAtCourantOne(void)
{
  const FemMaterial m         = {2000, 2e9, 0};
  const PetscReal   length[3] = {1, 0.1, 0}, c = 1e3, dt = 0.02 / c;
  const PetscInt    n[3]      = {50, 1, 0};
  PetscReal         time[11], push[11], *u;
  Table             table;
  Mesh              mesh;
  FemModel          model;

  PetscFunctionBeginUser;
  for (PetscInt j = 0; j <= 10; j++) {
    time[j] = j * dt;
    push[j] = 1e-4 * PetscSqr(PetscSinReal(PETSC_PI * j / 10));
  }
  PetscCall(TableCreate(11, time, push, &table));
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_EXPLICIT, 1, &m, &model));
  PetscCall(CaseFix(model, "body", 1, 0));
  PetscCall(FemModelFix(model, "xmin", 0, FEM_DISPLACEMENT, &table));
  PetscCall(FemModelAddAbsorber(model, "xmax"));
  PetscCall(FemModelSetUp(model));
  PetscCall(Run(model, dt, 0, 75));
  PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
  PetscCall(FemModelGetField(model, "displacement", u));
  for (PetscInt i = 0; i < mesh.n_nodes; i++) CheckNear(u[3 * i], 0, 1e-17);
  PetscCall(PetscFree(u));
  PetscCall(TableDestroy(&table));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The critical step is that of the body without dashpots: at 0.999 of it a shaken block only loses energy, for 20,000 steps;
   every joule of it is booked. Normals oblique to the axes: a distorted mesh on a tilted side is as good. */
static PetscErrorCode TestCriticalStepIsKept(void)
{
  const MeshCellType types[3] = {MESH_TRI3, MESH_QUAD4, MESH_TET4};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 3; k++) {
    const FemMaterial m         = {2400, 3e9, 0.3};
    const PetscReal   length[3] = {1, 0.5, 0.5}, v0[3] = {1, -2, 3};
    const PetscInt    n[3]      = {5, 3, 3};
    Mesh              mesh;
    FemModel          model, bare;
    Ledger            l;
    PetscReal         dt, dt_bare, before;

    PetscCall(CaseBox(PETSC_COMM_SELF, types[k], length, n, 0.2, &mesh));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) mesh.x[3 * i] += 0.4 * mesh.x[3 * i] * mesh.x[3 * i + 1]; /* tilts xmax */
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, mesh.dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, FEM_EXPLICIT, 1, &m, &model));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, mesh.dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, FEM_EXPLICIT, 1, &m, &bare));
    PetscCall(CaseFix(model, "xmin", 0, 0));
    PetscCall(CaseFix(bare, "xmin", 0, 0));
    PetscCall(FemModelAddAbsorber(model, "xmax"));
    PetscCall(FemModelAddAbsorber(model, "ymax"));
    PetscCall(FemModelSetInitialVelocity(model, v0));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelSetUp(bare));
    PetscCall(FemModelGetCriticalStep(model, &dt));
    PetscCall(FemModelGetCriticalStep(bare, &dt_bare));
    CheckNear(dt, dt_bare, 0);
    dt *= 0.999;
    PetscCall(CaseLedger(model, &l));
    before = l.initial;
    PetscCall(Run(model, dt, 0, 20000));
    PetscCall(CaseLedger(model, &l));
    CheckBelow(LedgerError(&l), 1e-11);
    CheckBelow(l.energy[LEDGER_STRAIN] + l.energy[LEDGER_KINETIC], 1e-6 * before);
    CheckClose(l.energy[LEDGER_DAMPING], before, 1e-6);
    PetscCall(FemModelDestroy(&model));
    PetscCall(FemModelDestroy(&bare));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestNormalAndShearPulsesLeave)
CHECK_TEST(TestNothingComesBackAtCourantOne)
CHECK_TEST(TestCriticalStepIsKept)

static const struct CMUnitTest tests[] = {TEST(TestNormalAndShearPulsesLeave), TEST(TestNothingComesBackAtCourantOne), TEST(TestCriticalStepIsKept)};
CHECK_MAIN(tests)
