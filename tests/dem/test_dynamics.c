/* Bonds in motion: energy, loads, threads, restart, contact with planes, and the order of convergence. */
#include "check.h"
#include "checkpoint.h"
#include "dem_solve.h"

/* Random bodies big enough for several blocks. */
static PetscErrorCode Body(PetscInt dim, TestBody *body)
{
  const PetscReal size[3] = {1, 1.2, 2};

  return TestBodyCreate(dim, size, dim == 3 ? 8 : 20, 0.7, 21, body);
}

static PetscErrorCode Model(const TestBody *body, PetscInt threads, DemModel *model)
{
  const PetscReal pull[3] = {0, 1e-6, 2e-6}, gravity[3] = {1e-7, -2e-7, 0};
  const PetscReal t[3] = {0, 2, 4}, v[3] = {0, 2e-6, -1e-6};
  Table           ramp, none;

  PetscFunctionBegin;
  PetscCall(TestModelCreate(body, body->body.dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS, 1, 0.25, model));
  PetscCall(TableCreate(3, t, v, &ramp));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(DemModelFix(*model, "ymin", 1, DEM_DISPLACEMENT, &none));
  PetscCall(DemModelFix(*model, "ymax", 1, DEM_VELOCITY, &ramp));
  PetscCall(DemModelAddTraction(*model, "xmax", pull, &ramp));
  PetscCall(DemModelSetGravity(*model, gravity));
  PetscCall(DemModelSetThreads(*model, threads));
  PetscCall(TableDestroy(&ramp));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Undamped and linear to 1e-6: every joule is found again. With local damping the drag's own work closes it. */
static PetscErrorCode TestLedger(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt damped = 0; damped < 2; damped++) {
      TestBody  body;
      DemModel  model;
      Stepper   stepper;
      Ledger    ledger;
      PetscReal dt;

      PetscCall(Body(dim, &body));
      PetscCall(Model(&body, 1, &model));
      PetscCall(DemModelSetLocalDamping(model, damped ? 0.3 : 0));
      PetscCall(DemModelSetUp(model));
      PetscCall(DemModelGetStepper(model, &stepper));
      PetscCall(stepper.stable_step(model, &dt));
      dt *= 0.9;
      for (PetscInt k = 0; k < 400; k++) PetscCall(stepper.step(model, k * dt, dt));
      PetscCall(stepper.energy(model, &ledger));
      CheckAbove(ledger.energy[LEDGER_STRAIN], 0.01 * ledger.energy[LEDGER_WORK]);
      if (damped) CheckAbove(ledger.energy[LEDGER_DAMPING], 0.01 * ledger.energy[LEDGER_WORK]);
      else CheckNear(ledger.energy[LEDGER_DAMPING], 0, 0);
      CheckBelow(LedgerError(&ledger), 2e-4); /* the sudden gravity's first half kick, dt^2 f^2 / 8 m, is what is left */
      PetscCall(DemModelDestroy(&model));
      PetscCall(TestBodyDestroy(&body));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestLedger)

/* One, two and three threads: the same bits. */
static PetscErrorCode TestThreads(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    TestBody   body;
    PetscReal *one = NULL;

    PetscCall(Body(dim, &body));
    for (PetscInt threads = 1; threads <= 3; threads++) {
      DemModel model;
      DemState s;
      Stepper  stepper;

      PetscCall(Model(&body, threads, &model));
      PetscCall(DemModelSetUp(model));
      PetscCall(DemModelGetStepper(model, &stepper));
      for (PetscInt k = 0; k < 50; k++) PetscCall(stepper.step(model, k * 0.005, 0.005));
      PetscCall(DemModelGetState(model, &s));
      if (!one) {
        PetscCall(PetscMalloc1(6 * s.n, &one));
        PetscCall(PetscArraycpy(one, s.u, 3 * s.n));
        PetscCall(PetscArraycpy(one + 3 * s.n, s.spin, 3 * s.n));
      } else {
        CheckInt(memcmp(one, s.u, 3 * s.n * sizeof(PetscReal)), 0);
        CheckInt(memcmp(one + 3 * s.n, s.spin, 3 * s.n * sizeof(PetscReal)), 0);
      }
      PetscCall(DemModelRestoreState(model, &s));
      PetscCall(DemModelDestroy(&model));
    }
    PetscCall(PetscFree(one));
    PetscCall(TestBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestThreads)

/* 2N steps, and N steps, a checkpoint, a new model, N steps: the same bits. */
static PetscErrorCode TestRestart(void)
{
  TestBody   body;
  DemModel   straight, first, second;
  Stepper    a, b, c;
  DemState   s, t;
  Checkpoint file;
  Ledger     la, lc;

  PetscFunctionBeginUser;
  PetscCall(Body(3, &body));
  PetscCall(Model(&body, 1, &straight));
  PetscCall(Model(&body, 2, &first));
  PetscCall(Model(&body, 1, &second));
  PetscCall(DemModelSetUp(straight));
  PetscCall(DemModelSetUp(first));
  PetscCall(DemModelSetUp(second));
  PetscCall(DemModelGetStepper(straight, &a));
  PetscCall(DemModelGetStepper(first, &b));
  PetscCall(DemModelGetStepper(second, &c));
  for (PetscInt k = 0; k < 60; k++) PetscCall(a.step(straight, k * 0.005, 0.005));
  for (PetscInt k = 0; k < 30; k++) PetscCall(b.step(first, k * 0.005, 0.005));
  PetscCall(CheckpointCreate(PETSC_COMM_SELF, "test_dynamics_checkpoint.h5", &file));
  PetscCall(b.save(first, file));
  PetscCall(CheckpointClose(&file));
  PetscCall(CheckpointOpen(PETSC_COMM_SELF, "test_dynamics_checkpoint.h5", &file));
  PetscCall(c.load(second, file));
  PetscCall(CheckpointClose(&file));
  for (PetscInt k = 30; k < 60; k++) PetscCall(c.step(second, k * 0.005, 0.005));
  PetscCall(DemModelGetState(straight, &s));
  PetscCall(DemModelGetState(second, &t));
  CheckInt(memcmp(s.u, t.u, 3 * s.n * sizeof(PetscReal)), 0);
  CheckInt(memcmp(s.v, t.v, 3 * s.n * sizeof(PetscReal)), 0);
  CheckInt(memcmp(s.rot, t.rot, 4 * s.n * sizeof(PetscReal)), 0);
  PetscCall(a.energy(straight, &la));
  PetscCall(c.energy(second, &lc));
  for (PetscInt k = 0; k < LEDGER_TERMS; k++) CheckNear(la.energy[k], lc.energy[k], 0);
  PetscCall(DemModelRestoreState(straight, &s));
  PetscCall(DemModelRestoreState(second, &t));
  PetscCall(DemModelDestroy(&straight));
  PetscCall(DemModelDestroy(&first));
  PetscCall(DemModelDestroy(&second));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRestart)

/* Two loose spheres on a plane: one bounces with its energy kept, one slides and comes to pure rolling at 5/7 of its speed. */
static PetscErrorCode TestPlane(void)
{
  const PetscReal size[3] = {4, 2, 2};
  const DemPlane  floor = {.point = {0, 0, 0}, .normal = {0, 0, 1}, .friction = 0.3};
  Table           still[3];
  TestBody        body = {.packing.n = 2};
  DemModel        model;
  DemState        s;
  Stepper         stepper;
  Ledger          ledger;
  PetscReal       dt, lowest = 1, initial, zero[3] = {0};

  PetscFunctionBeginUser;
  PetscCall(DemBodyCreateBox(3, zero, size, 1, &body.body));
  PetscCall(PetscCalloc1(6, &body.packing.x));
  PetscCall(PetscCalloc1(2, &body.packing.r));
  body.packing.x[0] = 1, body.packing.x[1] = body.packing.x[2] = 1;
  body.packing.x[3] = 3, body.packing.x[4] = 1, body.packing.x[5] = 0.5;
  body.packing.r[0] = body.packing.r[1] = 0.5;
  PetscCall(DemCellsCreate(&body.body, &body.packing, &body.cells));
  PetscCall(TestModelCreate(&body, DEM_SOLID, 1e6, 0.2, &model));
  PetscCall(DemModelSetBonded(model, PETSC_FALSE));
  for (PetscInt d = 0; d < 3; d++) PetscCall(TableCreateConstant(0, &still[d]));
  PetscCall(DemModelAddPlane(model, "floor", &floor, still));
  PetscCall(DemModelAddHistory(model, "reaction", "floor"));
  {
    const PetscReal g[3] = {0, 0, -10};

    PetscCall(DemModelSetGravity(model, g));
  }
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetStepper(model, &stepper));
  PetscCall(stepper.stable_step(model, &dt));
  dt *= 0.02;
  PetscCall(DemModelGetState(model, &s));
  const PetscInt slider = s.number[0] == 1 ? 0 : 1, bouncer = 1 - slider;

  s.v[slider] = 0.7;
  PetscCall(stepper.energy(model, &ledger));
  initial = ledger.energy[LEDGER_KINETIC];
  for (PetscInt k = 0; k < 60000; k++) {
    PetscCall(stepper.step(model, k * dt, dt));
    lowest = PetscMin(lowest, s.u[2 * s.n + bouncer]);
  }
  CheckBelow(lowest, -0.5);                /* it fell to the floor */
  CheckClose(s.v[slider], 5. / 7 * 0.7, 2e-3);
  CheckClose(s.spin[s.n + slider], s.v[slider] / 0.5, 2e-3);
  PetscCall(stepper.energy(model, &ledger));
  CheckPositive(ledger.energy[LEDGER_FRICTION]);
  ledger.initial = initial;
  CheckBelow(LedgerError(&ledger), 1e-3);
  PetscCall(DemModelRestoreState(model, &s));
  for (PetscInt d = 0; d < 3; d++) PetscCall(TableDestroy(&still[d]));
  PetscCall(DemModelDestroy(&model));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPlane)

/* Tip of a cantilever 8 deep-lengths long under end shear, plane strain, nu = 0.2: the figures of one point per facet, and second order. */
static PetscErrorCode TestCantilever(void)
{
  const PetscReal nu = 0.2, young = 1e12, L = 8, H = 1, shear = 1;
  PetscReal       error[3];

  PetscFunctionBeginUser;
  for (PetscInt level = 0; level < 3; level++) {
    const PetscReal size[3] = {L, H, 1}, push[3] = {0, shear, 0};
    const PetscReal Ep = young / (1 - nu * nu), G = young / (2 * (1 + nu)), second = H * H * H / 12, P = shear * H;
    /* Timoshenko with kappa = 5/6; the clamped end's own compliance is in the band of the check */
    const PetscReal exact = P * L * L * L / (3 * Ep * second) + P * L / (5. / 6 * G * H);
    PetscReal      *x, tip;
    TestBody        body;
    DemModel        model;
    Stepper         stepper;
    Table           one, none;

    PetscCall(TestBodyCreate(2, size, 4 << level, 0.5, 31, &body));
    PetscCall(TestModelCreate(&body, DEM_PLANE_STRAIN, young, nu, &model));
    PetscCall(TableCreateConstant(1, &one));
    PetscCall(TableCreateConstant(0, &none));
    for (PetscInt d = 0; d < 2; d++) PetscCall(DemModelFix(model, "xmin", d, DEM_DISPLACEMENT, &none));
    PetscCall(DemModelAddTraction(model, "xmax", push, &one));
    PetscCall(DemModelAddHistory(model, "displacement", "xmax"));
    PetscCall(DemModelSetUp(model));
    PetscCall(DemModelGetStepper(model, &stepper));
    PetscCall(PetscCalloc1(TestUnknowns(model), &x));
    PetscCall(TestEquilibrium(model, 1e-9, x, NULL));
    PetscCall(stepper.history(model, 1, &tip));
    error[level] = tip / exact - 1;
    PetscCall(PetscFree(x));
    PetscCall(TableDestroy(&one));
    PetscCall(TableDestroy(&none));
    PetscCall(DemModelDestroy(&model));
    PetscCall(TestBodyDestroy(&body));
  }
  print_message("           cantilever tip/exact - 1 at 4, 8, 16 cells of depth: %.4f %.4f %.4f\n", (double)error[0], (double)error[1], (double)error[2]);
  CheckBelow(PetscAbsReal(error[0]), 0.09);
  CheckBelow(PetscAbsReal(error[1]), 0.02);
  CheckBelow(PetscAbsReal(error[2]), 0.006);
  CheckAbove(PetscLogReal(error[0] / error[1]) / PetscLogReal(2), 1.6);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCantilever)

/* u = sin x sin y sheets clamped by their own traction: the order of the displacement error. */
static PetscErrorCode ManufacturedError(PetscInt dim, PetscReal nu, PetscReal cells, PetscReal *error)
{
  const PetscReal size[3] = {1, 1, 1}, young = 1e12, a = PETSC_PI;
  const PetscReal G = young / (2 * (1 + nu)), lambda = young * nu / ((1 + nu) * (1 - 2 * nu));
  PetscReal      *x, sum = 0, norm = 0;
  TestBody        body;
  DemModel        model;
  DemState        s;
  Table           none;
  static const char *const faces[] = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};

  PetscFunctionBegin;
  PetscCall(TestBodyCreate(dim, size, cells, 0.6, 77, &body));
  PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRAIN, young, nu, &model));
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt f = 0; f < 2 * dim; f++)
    for (PetscInt d = 0; d < dim; d++) PetscCall(DemModelFix(model, faces[f], d, DEM_DISPLACEMENT, &none));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetState(model, &s));
  /* u_x = u_y (= u_z) = prod sin(a x_d): zero on every face; body force b = -(G lap u + (lambda + G) grad div u) at the cell's centroid */
  for (PetscInt p = 0; p < s.n; p++) {
    const PetscReal *c = body.cells.centroid + 3 * s.number[p];
    const PetscReal  V = body.cells.volume[s.number[p]];
    PetscReal        sn[3] = {1, 1, 1}, cs[3] = {0}, b[3] = {0}, arm[3] = {0};

    for (PetscInt d = 0; d < dim; d++) {
      sn[d]  = PetscSinReal(a * c[d]);
      cs[d]  = PetscCosReal(a * c[d]);
      arm[d] = c[d] - s.x0[d * s.n + p];
    }
    for (PetscInt i = 0; i < dim; i++) {
      b[i] = G * dim * a * a * sn[0] * sn[1] * sn[2];
      for (PetscInt j = 0; j < dim; j++) { /* d_i d_j of the product */
        PetscReal t = 1;

        for (PetscInt k = 0; k < dim; k++) t *= (i == j) ? (k == i ? -sn[k] : sn[k]) : (k == i || k == j ? cs[k] : sn[k]);
        b[i] -= (lambda + G) * a * a * t;
      }
    }
    for (PetscInt d = 0; d < dim; d++) s.f_ext[d * s.n + p] = V * b[d];
    if (dim == 2) s.t_ext[2 * s.n + p] = V * (arm[0] * b[1] - arm[1] * b[0]);
    else
      for (PetscInt d = 0; d < 3; d++) s.t_ext[d * s.n + p] = V * (arm[(d + 1) % 3] * b[(d + 2) % 3] - arm[(d + 2) % 3] * b[(d + 1) % 3]);
  }
  for (PetscInt i = 0; i < 3 * s.n; i++) {
    s.f_ext[i] *= 1e-12;
    s.t_ext[i] *= 1e-12;
  }
  PetscCall(PetscCalloc1(TestUnknowns(model), &x));
  PetscCall(TestEquilibrium(model, 1e-8, x, NULL));
  for (PetscInt p = 0; p < s.n; p++) {
    PetscReal u = 1e-12;

    for (PetscInt d = 0; d < dim; d++) u *= PetscSinReal(a * s.x0[d * s.n + p]);
    for (PetscInt d = 0; d < dim; d++) {
      sum += s.mass[p] * PetscSqr(x[d * s.n + p] - u);
      norm += s.mass[p] * u * u;
    }
  }
  *error = PetscSqrtReal(sum / norm);
  PetscCall(DemModelRestoreState(model, &s));
  PetscCall(PetscFree(x));
  PetscCall(TableDestroy(&none));
  PetscCall(DemModelDestroy(&model));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestOrder(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt c = 0; c < 3; c++) {
      const PetscReal nu = 0.15 * c, coarse = dim == 3 ? 6 : 16;
      PetscReal       e[2], slope;

      PetscCall(ManufacturedError(dim, nu, coarse, &e[0]));
      PetscCall(ManufacturedError(dim, nu, (dim == 3 ? 2.5 : 4) * coarse, &e[1]));
      slope = PetscLogReal(e[0] / e[1]) / PetscLogReal(dim == 3 ? 2.5 : 4);
      print_message("           %dD nu %.2f error %.2e %.2e slope %.2f\n", (int)dim, (double)nu, (double)e[0], (double)e[1], (double)slope);
      CheckAbove(slope, 1.6);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOrder)

static PetscErrorCode TestRefusals(void)
{
  const PetscReal size[3] = {1, 1, 1};
  TestBody        body;
  DemModel        model;
  Table           none;
  DemMaterial     bad = {.density = 1, .young = 1, .poisson = 0.5};

  PetscFunctionBeginUser;
  PetscCall(TestBodyCreate(3, size, 3, 0.5, 1, &body));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(TestModelCreate(&body, DEM_SOLID, 1, 0.2, &model));
  CheckFails(DemModelSetMaterial(model, &bad), PETSC_ERR_USER_INPUT, "Poisson's ratio 0.5 must lie");
  CheckFails(DemModelFix(model, "zmaks", 0, DEM_DISPLACEMENT, &none), PETSC_ERR_USER_INPUT, "no face 'zmaks'; did you mean 'zmax'?");
  CheckFails(DemModelSetLocalDamping(model, 1), PETSC_ERR_USER_INPUT, "must lie in [0, 1)");
  CheckFails(DemModelAddHistory(model, "stress", "xmin"), PETSC_ERR_USER_INPUT, "known: reaction, displacement, velocity");
  PetscCall(DemModelFix(model, "zmax", 0, DEM_DISPLACEMENT, &none));
  CheckFails(DemModelSetUp(model), PETSC_ERR_USER_INPUT, "held along its own normal (a smooth platen) or in all directions (glued)");
  PetscCall(DemModelDestroy(&model));
  PetscCall(TableDestroy(&none));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefusals)

static const struct CMUnitTest tests[] = {TEST(TestLedger), TEST(TestThreads), TEST(TestRestart), TEST(TestPlane), TEST(TestCantilever), TEST(TestOrder), TEST(TestRefusals)};

CHECK_MAIN(tests)
