/*
  Friction where a matrix decides who sticks and slides, and planes in implicit steps: a sheared patch, a bar pulled along a floor, a block dragged in any
  direction; a bar that strikes a wall, a block that slides and stops, a body at rest. Theory 2.17.
*/
#include "fem_case.h"

/* ---- static ---- */

/* Pressed on and sheared evenly, in the plane or in space, below the bound: every node sticks, and the stress is even in every element. */
static PetscErrorCode TestSticks(void)
{
  static const MeshCellType types[]   = {MESH_TRI3, MESH_QUAD4, MESH_QUAD9, MESH_TET4, MESH_HEX8, MESH_TET10, MESH_HEX27};
  const FemMaterial         m         = {1000, 1e9, 0.3};
  const PetscReal           length[3] = {1, 1, 1}, up[3] = {0, 1, 0}, floor[3] = {0, 0, 0}, p = 1e6, mu = 0.4;
  const PetscInt            n[3]      = {3, 3, 3};

  PetscFunctionBeginUser;
  for (size_t t = 0; t < sizeof(types) / sizeof(types[0]); t++) {
    const PetscBool solid = MeshCellDim(types[t]) == 3 ? PETSC_TRUE : PETSC_FALSE;
    const PetscReal tx = solid ? 0.24e6 : 0.39e6, tz = solid ? -0.3e6 : 0, side = solid ? 0.3 / 0.7 * p : 0.3 * p; /* 0.384 of p in space; with this pressure it does not widen */
    PetscReal      *stress;
    PetscInt        cells;
    Mesh            mesh;
    FemModel        model;
    Ledger          ledger;

    PetscCall(CaseBox(PETSC_COMM_SELF, types[t], length, n, 0.15, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, solid ? FEM_SOLID : FEM_PLANE_STRESS, FEM_STATIC, 1, &m, &model));
    PetscCall(CaseTraction(model, "ymax", tx, -p, tz));
    PetscCall(CaseTraction(model, "xmax", -side, tx, 0));
    PetscCall(CaseTraction(model, "xmin", side, -tx, 0));
    if (solid) {
      PetscCall(CaseTraction(model, "zmax", 0, tz, -side));
      PetscCall(CaseTraction(model, "zmin", 0, -tz, side));
    }
    PetscCall(FemModelAddPlane(model, "ymin", floor, up, mu, 1, NULL));
    PetscCall(FemModelAddHistory(model, "reaction", "ymin"));
    PetscCall(CaseSolve(model));
    CheckClose(CaseHistory(model, "reaction(ymin).y"), p, 1e-9);
    CheckClose(CaseHistory(model, "reaction(ymin).x"), -tx, 1e-9);
    if (solid) CheckClose(CaseHistory(model, "reaction(ymin).z"), -tz, 1e-9);
    PetscCall(FemModelGetCounts(model, NULL, &cells, NULL));
    PetscCall(PetscMalloc1(6 * cells, &stress));
    PetscCall(FemModelGetField(model, "element_stress", stress));
    for (PetscInt e = 0; e < cells; e++) {
      CheckNear(stress[6 * e], -side, 1e-7 * p);
      CheckNear(stress[6 * e + 1], -p, 1e-7 * p);
      CheckNear(stress[6 * e + 3], tx, 1e-7 * p);
      CheckNear(stress[6 * e + 4], tz, 1e-7 * p);
    }
    PetscCall(CaseLedger(model, &ledger));
    CheckBelow(LedgerError(&ledger), 1e-10);
    CheckNear(ledger.energy[LEDGER_FRICTION], 0, 1e-10 * ledger.energy[LEDGER_WORK]);
    PetscCall(PetscFree(stress));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A long bar pressed on a floor by q [N/m] and pulled at one end with F: it slides over s = F/(mu q) from there, its end moves F^2/(2 mu q EA), friction takes
  F^3/(6 mu q EA). Let go it keeps half of that motion; pulled again the other way it runs through the same loop (Masing).
*/
static PetscErrorCode TestBarSlides(void)
{
  const FemMaterial m         = {1000, 1e9, 0};
  const PetscReal   length[3] = {1, 0.01, 0}, up[3] = {0, 1, 0}, floor[3] = {0, 0, 0}, mu = 0.5, q = 1e5, EA = 1e9 * 0.01, F = 3e4, k = mu * q * EA;
  const PetscReal   time[4] = {0, 1, 2, 3}, pull[4] = {0, F / 0.01, 0, -F / 0.01};
  const PetscInt    n[3]    = {100, 1, 0}, steps = 20;
  Mesh              mesh;
  FemModel          model;
  Stepper           s;
  Ledger            ledger;
  Table             press, table;
  PetscReal         end[3], taken[3];

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  PetscCall(TableCreateConstant(q, &press));
  PetscCall(TableCreate(4, time, pull, &table));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_STATIC, 1, &m, &model));
  PetscCall(FemModelAddPressure(model, "ymax", &press));
  PetscCall(FemModelAddTraction(model, "xmax", (PetscReal[3]){1, 0, 0}, &table));
  PetscCall(FemModelAddPlane(model, "ymin", floor, up, mu, 1, NULL));
  PetscCall(FemModelAddHistory(model, "displacement", "xmax"));
  PetscCall(FemModelAddHistory(model, "reaction", "ymin"));
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModelGetStepper(model, &s));
  for (PetscInt j = 0; j < 3 * steps; j++) {
    PetscCall(s.step(s.ctx, j / (PetscReal)steps, 1. / steps));
    CheckClose(CaseHistory(model, "reaction(ymin).y"), q, 1e-9);
    PetscCall(CaseLedger(model, &ledger));
    CheckBelow(LedgerError(&ledger), 1e-9);
    if ((j + 1) % steps) continue;
    end[j / steps]   = CaseHistory(model, "displacement(xmax).x");
    taken[j / steps] = ledger.energy[LEDGER_FRICTION];
  }
  printf("  bar on a floor: end %.4f, %.4f, %.4f of F^2/2k, friction took %.4f, %.4f, %.4f of F^3/6k\n", (double)(end[0] * 2 * k / (F * F)), (double)(end[1] * 2 * k / (F * F)), (double)(end[2] * 2 * k / (F * F)), (double)(taken[0] * 6 * k / (F * F * F)),
         (double)(taken[1] * 6 * k / (F * F * F)), (double)(taken[2] * 6 * k / (F * F * F)));
  CheckClose(end[0], F * F / (2 * k), 0.03);
  CheckClose(end[1], F * F / (4 * k), 0.03);
  CheckClose(end[2], -F * F / (2 * k), 0.03);
  CheckClose(taken[0], F * F * F / (6 * k), 0.05);
  CheckClose(taken[1], (1 + 0.25) * F * F * F / (6 * k), 0.05); /* back by F: as much as forth by F/2, twice (Masing) */
  CheckClose(taken[2], 3 * F * F * F / (6 * k), 0.05);          /* back by 2F: twice the first */
  PetscCall(TableDestroy(&press));
  PetscCall(TableDestroy(&table));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A block pressed on a slanting floor and dragged along it by its top: once all of it slides, the floor pulls back with mu N, against the motion, whichever way. */
static PetscErrorCode TestBlockIsDragged(void)
{
  const FemMaterial m         = {1000, 1e8, 0.3};
  const PetscReal   length[3] = {1, 0.5, 0.8}, mu = 0.3, tilt = 0.4, floor[3] = {0, 0, 0}, up[3] = {-PetscSinReal(tilt), PetscCosReal(tilt), 0}, along[3] = {PetscCosReal(tilt), PetscSinReal(tilt), 0};
  const PetscInt    n[3]      = {4, 3, 3};

  PetscFunctionBeginUser;
  for (PetscInt way = 0; way < 3; way++) {
    const PetscReal angle = 0.5 + 2.1 * way;
    PetscReal       total[3] = {0, 0, 0}, N, T, dot = 0, taken = 0;
    Table           drag[3];
    Mesh            mesh;
    FemModel        model;
    Stepper         s;
    Ledger          ledger;

    PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX8, length, n, 0.1, &mesh));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) {
      const PetscReal x = mesh.x[3 * i], y = mesh.x[3 * i + 1];

      mesh.x[3 * i]     = along[0] * x + up[0] * y;
      mesh.x[3 * i + 1] = along[1] * x + up[1] * y;
    }
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
    for (PetscInt d = 0; d < 3; d++) { /* pressed by 1 mm at once, then dragged at 20 mm/s */
      const PetscReal speed   = 0.02 * (along[d] * PetscCosReal(angle) + (d == 2) * PetscSinReal(angle));
      const PetscReal time[3] = {0, 1, 9}, place[3] = {0, -1e-3 * up[d], -1e-3 * up[d] + 8 * speed};

      PetscCall(TableCreate(3, time, place, &drag[d]));
      PetscCall(FemModelFix(model, "ymax", d, FEM_DISPLACEMENT, &drag[d]));
      PetscCall(TableDestroy(&drag[d]));
    }
    PetscCall(FemModelAddPlane(model, "ymin", floor, up, mu, 1, NULL));
    PetscCall(FemModelAddHistory(model, "reaction", "ymin"));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetStepper(model, &s));
    for (PetscInt k = 0; k < 9; k++) {
      PetscCall(s.step(s.ctx, k, 1));
      PetscCall(CaseLedger(model, &ledger));
      CheckBelow(LedgerError(&ledger), 1e-9);
      if (k == 7) taken = ledger.energy[LEDGER_FRICTION];
    }
    total[0] = CaseHistory(model, "reaction(ymin).x");
    total[1] = CaseHistory(model, "reaction(ymin).y");
    total[2] = CaseHistory(model, "reaction(ymin).z");
    N        = total[0] * up[0] + total[1] * up[1];
    T        = PetscSqrtReal(PetscMax(0, PetscSqr(total[0]) + PetscSqr(total[1]) + PetscSqr(total[2]) - N * N));
    dot      = (total[0] * along[0] + total[1] * along[1]) * PetscCosReal(angle) + total[2] * PetscSinReal(angle);
    CheckAbove(N, 1e4);
    CheckClose(T, mu * N, 1e-9);
    CheckClose(dot, -mu * N, 1e-9);
    CheckClose(ledger.energy[LEDGER_FRICTION] - taken, mu * N * 0.02, 1e-6);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- implicit steps ---- */

/* A bar strikes a wall: the wall feels rho c v0 A for 2L/c, the bar leaves with v0. Energy never rises, and what is lost is the layer of nodes that struck: of order h.  Notes T9, T10 */
static PetscErrorCode StrikesWall(PetscInt cells, PetscReal rho_inf, PetscBool lumped, PetscReal *lost, PetscReal *speed, PetscReal *impulse)
{
  const FemMaterial m         = {2000, 2e9, 0}; /* c = 1000 m/s */
  const PetscReal   length[3] = {1, 0.05, 0}, v0[3] = {-2, 0, 0}, wall[3] = {-1.3e-4, 0, 0}, normal[3] = {1, 0, 0}, dt = 0.5 / cells / 1000;
  const PetscInt    n[3]      = {cells, 1, 0};
  PetscReal         energy = PETSC_MAX_REAL, *u;
  Mesh              mesh;
  FemModel          model;
  Stepper           s;
  Ledger            ledger;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_IMPLICIT, 1, &m, &model));
  PetscCall(FemModelSetImplicit(model, rho_inf, lumped));
  PetscCall(CaseFix(model, "body", 1, 0));
  PetscCall(FemModelSetInitialVelocity(model, v0));
  PetscCall(FemModelAddPlane(model, "xmin", wall, normal, 0, 1, NULL));
  PetscCall(FemModelAddHistory(model, "reaction", "xmin"));
  PetscCall(FemModelAddHistory(model, "velocity", "body"));
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModelGetStepper(model, &s));
  PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
  *impulse = 0;
  for (PetscInt k = 0; k * dt < 2.6e-3; k++) {
    PetscReal push, now;

    PetscCall(s.step(s.ctx, k * dt, dt));
    PetscCall(CaseLedger(model, &ledger));
    CheckBelow(LedgerError(&ledger), 1e-10);
    now = ledger.energy[LEDGER_KINETIC] + ledger.energy[LEDGER_STRAIN];
    if (rho_inf < 0) CheckBelow(now, energy * (1 + 1e-12)); /* generalised-alpha has an energy of its own, that of another instant */
    energy = now;
    push   = CaseHistory(model, "reaction(xmin).x");
    CheckAbove(push, -1e-9);
    *impulse += push * dt;
    PetscCall(FemModelGetField(model, "displacement", u));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) CheckAbove(mesh.x[3 * i] + u[3 * i] - wall[0], -1e-14);
  }
  *lost  = 1 - energy / ledger.initial;
  *speed = CaseHistory(model, "velocity(body).x");
  if (rho_inf < 0) CheckClose(ledger.energy[LEDGER_CONTACT], ledger.initial - energy, 1e-9); /* by the contact alone */
  PetscCall(PetscFree(u));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestBarStrikesWall(void)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 3; k++) { /* consistent mass, lumped, damped at high frequency */
    PetscReal lost[2], speed[2], impulse[2];

    for (PetscInt j = 0; j < 2; j++) PetscCall(StrikesWall(40 << j, k == 2 ? 0.8 : -1, k == 1 ? PETSC_TRUE : PETSC_FALSE, &lost[j], &speed[j], &impulse[j]));
    printf("  bar on a wall, %s: 40 and 80 cells lose %.4f, %.4f of the energy, leave with %.4f, %.4f m/s, impulse %.4f, %.4f of 2 m v0\n", k == 2 ? "rho 0.8" : k ? "lumped" : "consistent", (double)lost[0], (double)lost[1], (double)speed[0], (double)speed[1],
           (double)(impulse[0] / 400), (double)(impulse[1] / 400));
    CheckPositive(lost[1]);
    CheckBelow(lost[1], 0.03);
    CheckBelow(lost[1], 0.65 * lost[0]);
    CheckClose(speed[1], 2, 0.03);
    CheckClose(impulse[1], 0.5 * 100 * (speed[1] + 2) * 2, 0.03); /* m = 100 kg: momentum */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A block slides on a floor under its weight: slows by mu g, stops, stays; a floor that moves takes it along. As the explicit one of test_fem_contact. */
static PetscErrorCode TestBlockSlides(void)
{
  const FemMaterial m         = {2000, 1e8, 0};
  const PetscReal   length[3] = {0.2, 0.1, 0}, g[3] = {0, -10, 0}, floor[3] = {0, 0, 0}, up[3] = {0, 1, 0}, v0[3] = {0.5, 0, 0}, mu = 0.4, dt = 1e-3;
  const PetscInt    n[3]      = {4, 2, 0};

  PetscFunctionBeginUser;
  for (PetscInt moving = 0; moving < 2; moving++) {
    Mesh      mesh;
    FemModel  model;
    Stepper   s;
    Ledger    ledger;
    Table     velocity[3] = {{0}};
    PetscReal mass        = 2000 * 0.02;

    PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_IMPLICIT, 1, &m, &model));
    PetscCall(FemModelSetGravity(model, g));
    if (!moving) PetscCall(FemModelSetInitialVelocity(model, v0));
    if (moving) PetscCall(TableCreateConstant(0.5, &velocity[0]));
    PetscCall(FemModelAddPlane(model, "ymin", floor, up, mu, 1, velocity));
    PetscCall(FemModelAddHistory(model, "velocity", "body"));
    PetscCall(FemModelAddHistory(model, "displacement", "body"));
    PetscCall(FemModelAddHistory(model, "reaction", "ymin"));
    PetscCall(FemModelAddHistory(model, "balance", ""));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetStepper(model, &s));
    for (PetscInt k = 0; k < 200; k++) {
      PetscCall(s.step(s.ctx, k * dt, dt));
      PetscCall(CaseLedger(model, &ledger));
      CheckBelow(LedgerError(&ledger), 1e-9);
      CheckNear(CaseHistory(model, "balance.x"), 0, 1e-8 * mass * 10); /* reactions, pushes among them, and loads are the inertia */
      CheckNear(CaseHistory(model, "balance.y"), 0, 1e-8 * mass * 10);
      if ((k + 1) * dt < 0.11) CheckNear(CaseHistory(model, "velocity(body).x"), moving ? mu * 10 * (k + 1) * dt : 0.5 - mu * 10 * (k + 1) * dt, 0.02);
    }
    printf("  block %s, implicit: at the end %.5f m/s, moved %.5f m, friction took %.4f J of %.4f J\n", moving ? "on a moving floor" : "sliding", (double)CaseHistory(model, "velocity(body).x"), (double)CaseHistory(model, "displacement(body).x"),
           (double)ledger.energy[LEDGER_FRICTION], (double)(0.5 * mass * 0.25));
    CheckNear(CaseHistory(model, "velocity(body).x"), moving ? 0.5 : 0, 0.01);
    CheckClose(CaseHistory(model, "displacement(body).x"), moving ? 0.5 * 0.2 - 0.5 * 0.5 * 0.125 : 0.5 * 0.5 * 0.125, 0.02);
    CheckClose(ledger.energy[LEDGER_FRICTION], 0.5 * mass * 0.25, 0.03);
    if (moving) PetscCall(TableDestroy(&velocity[0]));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A body that begins in static equilibrium on a rough slope, below the angle of friction, stays: same push, no motion, no energy. Above it, it slides with g (sin - mu cos). */
static PetscErrorCode TestSlope(void)
{
  const FemMaterial m         = {2000, 1e8, 0.3};
  const PetscReal   length[3] = {0.3, 0.1, 0.2}, floor[3] = {0, 0, 0}, up[3] = {0, 1, 0}, a = 0.3, g[3] = {10 * PetscSinReal(0.3), -10 * PetscCosReal(0.3), 0}, weight = 2000 * 0.006 * 10, dt = 2e-3;
  const PetscInt    n[3]      = {4, 2, 3};

  PetscFunctionBeginUser;
  for (PetscInt slides = 0; slides < 2; slides++) {
    const PetscReal mu = slides ? 0.2 : 0.6;
    Mesh            mesh;
    FemModel        model;
    Stepper         s;
    Ledger          ledger;
    PetscReal       moved, before;

    PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX8, length, n, 0, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_IMPLICIT, 1, &m, &model));
    PetscCall(FemModelSetGravity(model, g));
    PetscCall(FemModelSetPreload(model, slides ? PETSC_FALSE : PETSC_TRUE));
    PetscCall(FemModelAddPlane(model, "ymin", floor, up, mu, 1, NULL));
    PetscCall(FemModelAddHistory(model, "reaction", "ymin"));
    PetscCall(FemModelAddHistory(model, "displacement", "body"));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetStepper(model, &s));
    before = CaseHistory(model, "displacement(body).x");
    for (PetscInt k = 0; k < 100; k++) {
      PetscCall(s.step(s.ctx, k * dt, dt));
      PetscCall(CaseLedger(model, &ledger));
      CheckBelow(LedgerError(&ledger), 1e-9);
      if (slides) continue;
      CheckClose(CaseHistory(model, "reaction(ymin).y"), weight * PetscCosReal(a), 1e-8);
      CheckClose(CaseHistory(model, "reaction(ymin).x"), -weight * PetscSinReal(a), 1e-8);
      CheckNear(CaseHistory(model, "displacement(body).x"), before, 1e-8 * PetscAbsReal(before));
    }
    moved = CaseHistory(model, "displacement(body).x") - before;
    if (slides) CheckClose(moved, 0.5 * 10 * (PetscSinReal(a) - mu * PetscCosReal(a)) * 0.04, 0.02);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestSticks)
CHECK_TEST(TestBarSlides)
CHECK_TEST(TestBlockIsDragged)
CHECK_TEST(TestBarStrikesWall)
CHECK_TEST(TestBlockSlides)
CHECK_TEST(TestSlope)

static const struct CMUnitTest tests[] = {TEST(TestSticks), TEST(TestBarSlides), TEST(TestBlockIsDragged), TEST(TestBarStrikesWall), TEST(TestBlockSlides), TEST(TestSlope)};
CHECK_MAIN(tests)
