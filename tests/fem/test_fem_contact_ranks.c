/* Bodies against planes on all ranks together and on rank 0 alone: the same bits of motion in explicit steps, static answers to 1e-10.  Run on any number of ranks. */
#include "fem_case.h"

/* Explicit: a block tumbles onto a slanting, rising floor with friction. Static: it is lowered onto a floor askew to its side, by its top. */
static PetscErrorCode Answer(MPI_Comm comm, FemMethod method, PetscReal friction, PetscInt *nodes, PetscReal **data)
{
  const FemMaterial m         = {2000, 1e8, 0.3};
  const PetscReal   length[3] = {0.4, 0.3, 0.2}, g[3] = {1, 0, -10}, v0[3] = {0.5, 0.2, -1}, slant[3] = {0.05, 0.02, 1}, point[3] = {-1e-4, 0, -1e-3}, time[2] = {0, 0.01}, rise[2] = {0, 0.4};
  const PetscReal   dt        = method == FEM_STATIC ? 0.5 : 4e-5;
  const PetscInt    n[3]      = {6, 4, 3}, steps = method == FEM_STATIC ? 2 : 45; /* while it touches */
  Table             velocity[3] = {{0}}, down;
  Mesh              mesh;
  FemModel          model;
  Stepper           s;
  Ledger            ledger;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(comm, MESH_HEX8, length, n, 0.2, &mesh));
  PetscCall(CaseModel(comm, &mesh, FEM_SOLID, method, 1, &m, &model));
  if (method != FEM_STATIC) {
    PetscCall(TableCreate(2, time, rise, &velocity[2]));
    PetscCall(FemModelSetGravity(model, g));
    PetscCall(FemModelSetInitialVelocity(model, v0));
    PetscCall(FemModelAddPlane(model, method == FEM_EXPLICIT ? "body" : "zmin", point, slant, 0.3, 0.8, velocity));
    PetscCall(TableDestroy(&velocity[2]));
  } else {
    PetscCall(TableCreateConstant(-5e-3, &down));
    for (PetscInt d = 0; d < 2; d++) PetscCall(CaseFix(model, "zmax", d, 0));
    PetscCall(FemModelFix(model, "zmax", 2, FEM_VELOCITY, &down));
    PetscCall(FemModelAddPlane(model, "zmin", point, slant, friction, 1, NULL));
    PetscCall(TableDestroy(&down));
  }
  PetscCall(FemModelAddHistory(model, "reaction", "body"));
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModelGetStepper(model, &s));
  for (PetscInt k = 0; k < steps; k++) PetscCall(s.step(s.ctx, k * dt, dt));
  PetscCall(CaseLedger(model, &ledger));
  CheckBelow(LedgerError(&ledger), 1e-9);
  PetscCall(FemModelGetCounts(model, nodes, NULL, NULL));
  PetscCall(PetscCalloc1(9 * *nodes + 3 + LEDGER_TERMS, data));
  PetscCall(FemModelGetField(model, "displacement", *data));
  PetscCall(FemModelGetField(model, "velocity", *data + 3 * *nodes));
  PetscCall(FemModelGetField(model, "reaction", *data + 6 * *nodes));
  (*data)[9 * *nodes]     = CaseHistory(model, "reaction(body).x");
  (*data)[9 * *nodes + 1] = CaseHistory(model, "reaction(body).y");
  (*data)[9 * *nodes + 2] = CaseHistory(model, "reaction(body).z");
  for (PetscInt k = 0; k < LEDGER_TERMS; k++) (*data)[9 * *nodes + 3 + k] = ledger.energy[k];
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Compare(FemMethod method, PetscReal friction)
{
  PetscMPIInt rank;
  PetscReal  *all, *alone, worst = 0, same = 1, big[4] = {0, 0, 0, 0};
  PetscInt    nodes;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(Answer(PETSC_COMM_WORLD, method, friction, &nodes, &all));
  if (rank == 0) {
    PetscCall(Answer(PETSC_COMM_SELF, method, friction, &nodes, &alone));
    for (PetscInt k = 0; k < 9 * nodes; k++) big[k / (3 * nodes)] = PetscMax(big[k / (3 * nodes)], PetscAbsReal(alone[k]));
    for (PetscInt k = 0; k < LEDGER_TERMS; k++) big[3] = PetscMax(big[3], PetscAbsReal(alone[9 * nodes + 3 + k]));
    for (PetscInt k = 0; k < 9 * nodes + 3 + LEDGER_TERMS; k++) {
      const PetscReal off = PetscAbsReal(all[k] - alone[k]);

      if (k < 9 * nodes && off > 0) same = 0;
      worst = PetscMax(worst, off / (k < 9 * nodes + 3 ? big[PetscMin(2, k / (3 * nodes))] : big[3]));
    }
    CheckAbove(big[2], 1); /* something is pushed */
    printf("  %s: one rank and all differ by %.1e\n", method == FEM_STATIC ? "static" : method == FEM_EXPLICIT ? "explicit" : "implicit", (double)worst);
    PetscCall(PetscFree(alone));
  }
  PetscCallMPI(MPI_Bcast(&worst, 1, MPIU_REAL, 0, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Bcast(&same, 1, MPIU_REAL, 0, PETSC_COMM_WORLD));
  CheckBelow(worst, 1e-10);
  if (method == FEM_EXPLICIT) CheckNear(same, 1, 0);
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestExplicit(void)
{
  return Compare(FEM_EXPLICIT, 0.3);
}

static PetscErrorCode TestImplicit(void)
{
  return Compare(FEM_IMPLICIT, 0.3);
}

static PetscErrorCode TestStatic(void)
{
  return Compare(FEM_STATIC, 0);
}

static PetscErrorCode TestStaticFriction(void)
{
  return Compare(FEM_STATIC, 0.2);
}

CHECK_TEST(TestExplicit)
CHECK_TEST(TestImplicit)
CHECK_TEST(TestStatic)
CHECK_TEST(TestStaticFriction)

static const struct CMUnitTest tests[] = {TEST(TestExplicit), TEST(TestImplicit), TEST(TestStatic), TEST(TestStaticFriction)};
CHECK_MAIN(tests)
