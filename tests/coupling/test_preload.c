/* A coupled body that begins in its static state: the loads' reactions from the first row on, and nothing moves.  Eqs (6.30)-(6.33) */
#include "check.h"
#include "checkpoint.h"
#include "coupled.h"

typedef struct {
  PetscReal reaction[2], jump, moved, kinetic, ledger, strain; /* at the start; the largest change of it afterwards / loads; of u / u; energies / strain energy */
  PetscInt  evaluations;
  PetscReal left, most; /* out of balance; largest |u| */
} Rest;

/* A bar hanging from xmin under its weight and a traction, its support moved off at t = 0; steps of the run, then a checkpoint's copy of the rest. */
static PetscErrorCode Hang(PetscInt dim, PetscInt m, CouplingFar far, PetscInt steps, Rest *rest)
{
  const PetscReal       size[3] = {16, 2, 2}, pull[3] = {1, 0.2, 0}, gravity[3] = {1e-6, -2e-6, 0};
  const CouplingOptions options = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = m, .far = far, .preload = PETSC_TRUE};
  Coupled               c;
  Stepper               stepper;
  Table                 load, off, none;
  Ledger                ledger;
  CouplingReport        report;
  FemState              fs;
  DemState              ds;
  PetscReal            *u, dt;
  PetscInt              n;

  PetscFunctionBegin;
  PetscCall(CoupledCreate(dim, size, 1, 7, 9, dim == 3 ? 3 : 5, 2, 0.2, 7, &options, &c));
  PetscCall(TableCreateConstant(1e-5, &load));
  PetscCall(TableCreateConstant(1e-6, &off));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(FemModelFix(c.fem, "xmin", 0, FEM_DISPLACEMENT, &off));
  for (PetscInt d = 1; d < dim; d++) PetscCall(FemModelFix(c.fem, "xmin", d, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(c.fem, "xmax", pull, &load));
  PetscCall(FemModelAddHistory(c.fem, "reaction", "xmin"));
  PetscCall(FemModelSetGravity(c.fem, gravity));
  PetscCall(DemModelSetGravity(c.dem, gravity));
  PetscCall(FemModelSetStartGiven(c.fem, PETSC_TRUE));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetReport(c.model, &report));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, &dt));
  dt *= 0.83;
  *rest             = (Rest){{0}};
  rest->evaluations = report.preload_evaluations;
  rest->left        = report.preload_left;
  for (PetscInt d = 0; d < 2; d++) PetscCall(stepper.history(c.model, d, &rest->reaction[d]));
  PetscCall(stepper.energy(c.model, &ledger));
  rest->strain = ledger.energy[LEDGER_STRAIN];
  rest->ledger = LedgerError(&ledger);
  PetscCall(FemModelGetState(c.fem, &fs));
  PetscCall(DemModelGetState(c.dem, &ds));
  n = fs.n_nodes * dim + 3 * ds.n;
  PetscCall(PetscMalloc1(n, &u));
  PetscCall(PetscArraycpy(u, fs.u, fs.n_nodes * dim));
  PetscCall(PetscArraycpy(u + fs.n_nodes * dim, ds.u, 3 * ds.n));
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(DemModelRestoreState(c.dem, &ds));
  for (PetscInt i = 0; i < n; i++) rest->most = PetscMax(rest->most, PetscAbsReal(u[i]));
  for (PetscInt k = 0; k < steps; k++) {
    PetscReal reaction;

    PetscCall(stepper.step(c.model, k * dt, dt));
    for (PetscInt d = 0; d < 2; d++) {
      PetscCall(stepper.history(c.model, d, &reaction));
      rest->jump = PetscMax(rest->jump, PetscAbsReal(reaction - rest->reaction[d]) / PetscAbsReal(rest->reaction[0]));
    }
    if (k % 50 && k + 1 < steps) continue;
    PetscCall(stepper.energy(c.model, &ledger));
    rest->kinetic = PetscMax(rest->kinetic, PetscAbsReal(ledger.energy[LEDGER_KINETIC]) / rest->strain);
    rest->ledger  = PetscMax(rest->ledger, LedgerError(&ledger));
    PetscCall(FemModelGetState(c.fem, &fs));
    PetscCall(DemModelGetState(c.dem, &ds));
    for (PetscInt i = 0; i < n; i++) rest->moved = PetscMax(rest->moved, PetscAbsReal((i < fs.n_nodes * dim ? fs.u[i] : ds.u[i - fs.n_nodes * dim]) - u[i]) / rest->most);
    PetscCall(FemModelRestoreState(c.fem, &fs));
    PetscCall(DemModelRestoreState(c.dem, &ds));
  }
  PetscCall(PetscFree(u));
  PetscCall(TableDestroy(&load));
  PetscCall(TableDestroy(&off));
  PetscCall(TableDestroy(&none));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestStaysAtRest(void)
{
  const struct {
    PetscInt    dim, m, steps;
    CouplingFar far;
  } run[3] = {{2, 1, 1200, COUPLING_FAR_EXPLICIT}, {2, 6, 1000, COUPLING_FAR_IMPLICIT}, {3, 1, 400, COUPLING_FAR_EXPLICIT}};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 3; k++) {
    Rest      rest;
    const PetscReal area = run[k].dim == 3 ? 4 : 2;

    PetscCall(Hang(run[k].dim, run[k].m, run[k].far, run[k].steps, &rest));
    print_message("           %dD, m = %d, %s: left %.1e of the loads after %d force evaluations; reaction off by %.1e of the weight and traction, jumps by %.1e in %d steps, motion %.1e, kinetic %.1e of the strain energy, ledger %.1e\n", (int)run[k].dim,
                  (int)run[k].m, run[k].far == COUPLING_FAR_IMPLICIT ? "implicit" : "explicit", (double)rest.left, (int)rest.evaluations, (double)(-rest.reaction[0] / (area * (1e-5 + 16 * 1e-6)) - 1), (double)rest.jump, (int)run[k].steps,
                  (double)rest.moved, (double)rest.kinetic, (double)rest.ledger);
    CheckNear(-rest.reaction[0], area * (1e-5 + 16 * 1e-6), 2e-4 * area * 2.6e-5); /* 1 - alpha is taken at the particles' centres */
    CheckBelow(rest.left, 1e-9);
    CheckBelow(rest.jump, 1e-6);
    CheckBelow(rest.moved, 1e-6);
    CheckBelow(rest.kinetic, 1e-10);
    CheckBelow(rest.ledger, 1e-6);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestStaysAtRest)

static PetscErrorCode TestRefused(void)
{
  const PetscReal       size[3] = {16, 2, 2}, pull[3] = {1, 0, 0};
  const CouplingOptions options = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1, .preload = PETSC_TRUE}, many = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 3, .preload = PETSC_TRUE};
  const DemStrength     weak = {.tensile = 5e-6, .fracture_energy = 1, .shear = 1, .shear_energy = 1};
  Coupled               c;
  Table                 load, none;

  PetscFunctionBeginUser;
  PetscCall(TableCreateConstant(1e-5, &load));
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt k = 0; k < 3; k++) {
    PetscCall(CoupledCreate(2, size, 1, 7, 9, 5, 2, 0.2, 7, k == 2 ? &many : &options, &c));
    for (PetscInt d = 0; d < 2 && k; d++) PetscCall(FemModelFix(c.fem, "xmin", d, FEM_DISPLACEMENT, &none));
    PetscCall(FemModelAddTraction(c.fem, "xmax", pull, &load));
    PetscCall(FemModelSetStartGiven(c.fem, PETSC_TRUE));
    if (k == 1) PetscCall(DemModelSetStrength(c.dem, &weak));
    CheckFails(CouplingModelSetUp(c.model), PETSC_ERR_USER_INPUT, k == 0 ? "held against every rigid motion" : k == 1 ? "at their strength or past it" : "do not go together");
    PetscCall(CoupledDestroy(&c));
  }
  PetscCall(TableDestroy(&load));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefused)

static const struct CMUnitTest tests[] = {TEST(TestStaysAtRest), TEST(TestRefused)};

CHECK_MAIN(tests)
