/* test_static.c - load steps of particles without inertia: closed forms, finite rotations, ledger, refusals.  Eqs (4.80), (4.81) */
#include "check.h"
#include "dem_solve.h"

/* A 2 x 1 x 1 box (2D: 2 x 1) of random packing, E = 1, nu = 0.2; steps are static. */
static PetscErrorCode Make(PetscInt dim, PetscInt side, TestBody *body, DemModel *model)
{
  const PetscReal size[3] = {2, 1, 1};

  PetscFunctionBegin;
  PetscCall(TestBodyCreate(dim, size, side, 0.4, 7, body));
  PetscCall(TestModelCreate(body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS, 1, 0.2, model));
  PetscCall(DemModelSetStatic(*model, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Hold(DemModel model, const char *face, PetscInt first, PetscInt last, const Table *table)
{
  PetscFunctionBegin;
  for (PetscInt d = first; d < last; d++) PetscCall(DemModelFix(model, face, d, DEM_DISPLACEMENT, table));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Between smooth platens the rule is exact: reaction, energy and ledger in one step, whatever the packing. */
static PetscErrorCode TestUniaxial(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const PetscReal strain = 1e-6;
    PetscReal       reaction;
    TestBody        body;
    DemModel        model;
    Stepper         s;
    Table           none, shift;
    Ledger          ledger = {{0}};
    PetscInt        products;

    PetscCall(Make(dim, dim == 3 ? 5 : 10, &body, &model));
    PetscCall(TableCreateConstant(0, &none));
    PetscCall(TableCreateConstant(2 * strain, &shift));
    PetscCall(Hold(model, "xmin", 0, 1, &none));
    PetscCall(Hold(model, "xmax", 0, 1, &shift));
    PetscCall(DemModelAddHistory(model, "reaction", "xmax"));
    PetscCall(DemModelSetUp(model));
    PetscCall(DemModelGetStepper(model, &s));
    PetscCall(s.step(s.ctx, 0, 1));
    PetscCall(s.history(s.ctx, 0, &reaction));
    CheckClose(reaction, strain, 1e-7); /* E = 1, section 1 */
    PetscCall(s.energy(s.ctx, &ledger));
    CheckClose(ledger.energy[LEDGER_STRAIN], 0.5 * strain * strain * 2, 1e-6);
    PetscCall(DemModelGetProducts(model, &products));
    CheckTrue(products > 5 && products < 400);
    PetscCall(TableDestroy(&none));
    PetscCall(TableDestroy(&shift));
    PetscCall(DemModelDestroy(&model));
    PetscCall(TestBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestUniaxial)

/* A cantilever pressed aside until it stands at a large angle: one way in 4 or in 8 steps, the same end; the work of the trapezoid comes to the elastic energy with the square of the step. */
static PetscErrorCode TestLargeRotation(void)
{
  PetscReal tip[2][2], error[2];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 2; k++) {
    const PetscInt  steps = k ? 8 : 4;
    const PetscReal up[3] = {0, 1, 0}, ends[2] = {0, 1}, loads[2] = {0, 0.01};
    TestBody        body;
    DemModel        model;
    Stepper         s;
    Table           none, load;
    Ledger          ledger = {{0}};

    PetscCall(Make(2, 8, &body, &model));
    PetscCall(TableCreateConstant(0, &none));
    PetscCall(TableCreate(2, ends, loads, &load));
    PetscCall(Hold(model, "xmin", 0, 2, &none));
    PetscCall(DemModelAddTraction(model, "xmax", up, &load));
    PetscCall(DemModelAddHistory(model, "displacement", "xmax"));
    PetscCall(DemModelSetUp(model));
    PetscCall(DemModelGetStepper(model, &s));
    for (PetscInt i = 0; i < steps; i++) PetscCall(s.step(s.ctx, (PetscReal)i / steps, 1. / steps));
    for (PetscInt d = 0; d < 2; d++) PetscCall(s.history(s.ctx, d, &tip[k][d]));
    PetscCall(s.energy(s.ctx, &ledger));
    error[k] = PetscAbsReal(ledger.energy[LEDGER_WORK] - ledger.energy[LEDGER_STRAIN]) / ledger.energy[LEDGER_STRAIN];
    PetscCall(TableDestroy(&none));
    PetscCall(TableDestroy(&load));
    PetscCall(DemModelDestroy(&model));
    PetscCall(TestBodyDestroy(&body));
  }
  CheckAbove(tip[0][1], 0.35); /* of a length of 2, 15 degrees at the end */
  CheckBelow(tip[0][0], -0.03);
  CheckClose(tip[0][0], tip[1][0], 1e-6);
  CheckClose(tip[0][1], tip[1][1], 1e-6);
  CheckBelow(error[0], 1e-3);
  CheckBelow(error[1], 0.26 * error[0]); /* second order */
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestLargeRotation)

/* A free body that is pulled has no equilibrium, and the message says so. */
static PetscErrorCode TestFreeBody(void)
{
  const PetscReal right[3] = {1, 0, 0};
  TestBody        body;
  DemModel        model;
  Stepper         s;
  Table           load;

  PetscFunctionBeginUser;
  PetscCall(Make(2, 6, &body, &model));
  PetscCall(TableCreateConstant(1e-6, &load));
  PetscCall(DemModelAddTraction(model, "xmax", right, &load));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetStepper(model, &s));
  CheckFails(s.step(s.ctx, 0, 1), PETSC_ERR_NOT_CONVERGED, "free to move as one");
  PetscCall(TableDestroy(&load));
  PetscCall(DemModelDestroy(&model));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFreeBody)

static const struct CMUnitTest tests[] = {TEST(TestUniaxial), TEST(TestLargeRotation), TEST(TestFreeBody)};

CHECK_MAIN(tests)
