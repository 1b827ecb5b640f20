/*
  Nodes against rigid planes: a bar that strikes a wall, restitution, friction, a plane that moves; a patch under contact pressure, a part that lifts off,
  a cylinder and a sphere pressed flat (Hertz). Theory 2.17.
*/
#include "fem_case.h"
#include "fem_impl.h"

static PetscErrorCode Plane(FemModel model, const char *group, const PetscReal point[3], const PetscReal normal[3], PetscReal friction, PetscReal restitution)
{
  return FemModelAddPlane(model, group, point, normal, friction, restitution, NULL);
}

/* ---- explicit ---- */

/*
  A bar of speed v0 meets a wall head on, gap a whole number of steps: at Courant 1 every node follows the characteristics. The wall feels rho c v0 A for
  2L/c, the whole bar leaves with v0 and no wave in it.  Notes T9, T10
*/
static PetscErrorCode TestBarStrikesWall(void)
{
  const FemMaterial m         = {2000, 2e9, 0}; /* c = 1000 m/s */
  const PetscReal   length[3] = {1, 0.05, 0}, v0[3] = {-2, 0, 0}, wall[3] = {0, 0, 0}, normal[3] = {1, 0, 0}, dt = 5e-5, c = 1000, force = 2000 * c * 2 * 0.05;
  const PetscInt    n[3]      = {20, 1, 0}, wait = 4;

  PetscFunctionBeginUser;
  for (PetscInt rotation = 0; rotation < 2; rotation++) {
    Mesh       mesh;
    FemModel   model;
    Stepper    s;
    Ledger     ledger;
    PetscReal *u, *v, push = 0;

    PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) mesh.x[3 * i] += wait * 2 * dt;
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_EXPLICIT, 1, &m, &model));
    PetscCall(FemModelSetRotation(model, rotation ? FEM_COROTATIONAL : FEM_SMALL));
    PetscCall(CaseFix(model, "body", 1, 0));
    PetscCall(FemModelSetInitialVelocity(model, v0));
    PetscCall(Plane(model, "xmin", wall, normal, 0, 1));
    PetscCall(FemModelAddHistory(model, "reaction", "xmin"));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetStepper(model, &s));
    PetscCall(PetscMalloc2(3 * mesh.n_nodes, &u, 3 * mesh.n_nodes, &v));
    for (PetscInt k = 0; k < 70; k++) {
      PetscReal t = (k + 1) * dt, met = wait * dt, left = met + 2 * length[0] / c;

      PetscCall(s.step(s.ctx, k * dt, dt));
      PetscCall(CaseLedger(model, &ledger));
      CheckBelow(LedgerError(&ledger), 1e-11);
      push = CaseHistory(model, "reaction(xmin).x");
      if (!rotation) {
        const PetscInt level = k + 1;

        CheckNear(push, level < wait || level > wait + 40 ? 0 : level == wait || level == wait + 40 ? 0.5 * force : force, 1e-9 * force);
      }
      PetscCall(FemModelGetField(model, "displacement", u));
      for (PetscInt i = 0; i < mesh.n_nodes; i++) { /* -v0 t until the wave comes, then still, then back */
        const PetscReal x = mesh.x[3 * i] - wait * 2 * dt, stop = met + x / c, go = left - x / c, exact = t < stop ? -2 * t : -2 * stop + 2 * PetscMax(0, t - go);

        CheckNear(u[3 * i], exact, rotation ? 1e-5 : 1e-12); /* an element that turns is of finite stretch: f and dx/dX differ by the strain, 2e-3 */
      }
    }
    PetscCall(FemModelGetField(model, "velocity", v));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) CheckNear(v[3 * i], 2, rotation ? 0.02 : 1e-10);
    CheckNear(push, 0, 0);
    CheckNear(ledger.energy[LEDGER_CONTACT], 0, 1e-10 * ledger.initial);
    CheckClose(ledger.energy[LEDGER_KINETIC] + ledger.energy[LEDGER_STRAIN], ledger.initial, 1e-10);
    /* half of u.f, f a sum of terms E u that cancel: rounded at each node; u is 2.2 mm at the end */
    CheckBelow(ledger.energy[LEDGER_STRAIN], rotation ? 1e-4 * ledger.initial : mesh.n_nodes * PETSC_MACHINE_EPSILON * m.young * PetscSqr(2.2e-3));
    PetscCall(PetscFree2(u, v));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Any step, any mesh, a slanting wall: the ledger closes, and a body that loses nothing has its energy back; contact takes 2L/c to a few elements. */
static PetscErrorCode TestBlockBouncesOffSlantingWall(void)
{
  const FemMaterial m         = {2000, 2e9, 0.3};
  const PetscReal   length[3] = {1, 0.2, 0.2}, a = 0.6, normal[3] = {PetscCosReal(0.6), PetscSinReal(0.6), 0}, v0[3] = {-3 * PetscCosReal(0.6), -3 * PetscSinReal(0.6), 0};
  const PetscReal   point[3]  = {-1e-3 * PetscCosReal(0.6), -1e-3 * PetscSinReal(0.6), 0}, E0 = 0.5 * 2000 * 0.04 * 9;
  const PetscInt    n[3]      = {20, 4, 4};
  Mesh              mesh;

  PetscFunctionBeginUser;
  for (PetscInt soft = 0; soft < 2; soft++) {
    FemModel  model;
    Stepper   s;
    Ledger    ledger;
    PetscReal dt, first = -1, last = -1, deepest = 0, *u;

    PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX8, length, n, 0.15, &mesh));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) {
      const PetscReal x = mesh.x[3 * i], y = mesh.x[3 * i + 1];

      mesh.x[3 * i]     = PetscCosReal(a) * x - PetscSinReal(a) * y;
      mesh.x[3 * i + 1] = PetscSinReal(a) * x + PetscCosReal(a) * y;
    }
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_EXPLICIT, 1, &m, &model));
    PetscCall(FemModelSetInitialVelocity(model, v0));
    PetscCall(Plane(model, "body", point, normal, 0, soft ? 0 : 1));
    PetscCall(FemModelAddHistory(model, "reaction", "body"));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetStepper(model, &s));
    PetscCall(FemModelGetStableStep(model, &dt));
    PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
    dt *= 0.9;
    for (PetscInt k = 0; k * dt < 4e-3; k++) {
      PetscReal fx, fy, force;

      PetscCall(s.step(s.ctx, k * dt, dt));
      PetscCall(CaseLedger(model, &ledger));
      CheckBelow(LedgerError(&ledger), 1e-10);
      fx    = CaseHistory(model, "reaction(body).x");
      fy    = CaseHistory(model, "reaction(body).y");
      force = fx * normal[0] + fy * normal[1];
      CheckAbove(force, -1e-9);
      CheckNear(fx * normal[1] - fy * normal[0], 0, 1e-9 * (1 + force));
      if (force > 0 && first < 0) first = (k + 1) * dt;
      if (force > 0) last = (k + 1) * dt;
      PetscCall(FemModelGetField(model, "displacement", u));
      for (PetscInt i = 0; i < mesh.n_nodes; i++) deepest = PetscMin(deepest, normal[0] * (mesh.x[3 * i] + u[3 * i] - point[0]) + normal[1] * (mesh.x[3 * i + 1] + u[3 * i + 1] - point[1]));
    }
    printf("  block on a slanting wall, restitution %d: contact %.3f ms, energy taken %.4f of the first, deepest %.1e m\n", soft ? 0 : 1, (double)((last - first) * 1e3), (double)((ledger.energy[LEDGER_CONTACT] + ledger.energy[LEDGER_DAMPING]) / E0), (double)deepest);
    CheckAbove(deepest, -1e-14);
    CheckAbove(last - first, 1.8e-3); /* 2L/c = 2 ms, slower by the width */
    CheckBelow(last - first, 2.6e-3);
    CheckNear(ledger.energy[LEDGER_CONTACT], 0, 1e-9 * E0);
    if (soft) {
      CheckAbove(ledger.energy[LEDGER_DAMPING], 0.01 * E0); /* of the layer of nodes that struck, half a cell */
      CheckBelow(ledger.energy[LEDGER_DAMPING], 0.06 * E0);
    } else CheckNear(ledger.energy[LEDGER_DAMPING], 0, 1e-9 * E0);
    PetscCall(PetscFree(u));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A stiff block slides on a floor under its weight: slows by mu g, stops, stays; friction takes its energy. Then a floor that moves takes it along. */
static PetscErrorCode TestBlockSlides(void)
{
  const FemMaterial m         = {2000, 1e8, 0};
  const PetscReal   length[3] = {0.2, 0.1, 0}, g[3] = {0, -10, 0}, floor[3] = {0, 0, 0}, up[3] = {0, 1, 0}, v0[3] = {0.5, 0, 0}, mu = 0.4;
  const PetscInt    n[3]      = {4, 2, 0};

  PetscFunctionBeginUser;
  for (PetscInt moving = 0; moving < 2; moving++) {
    Mesh      mesh;
    FemModel  model;
    Stepper   s;
    Ledger    ledger;
    Table     velocity[3] = {{0}};
    PetscReal dt, t, mass = 2000 * 0.02;
    PetscInt  k;

    PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_EXPLICIT, 1, &m, &model));
    PetscCall(FemModelSetGravity(model, g));
    PetscCall(FemModelSetPreload(model, PETSC_FALSE));
    PetscCall(FemModelSetDamping(model, 0));
    if (!moving) PetscCall(FemModelSetInitialVelocity(model, v0));
    if (moving) PetscCall(TableCreateConstant(0.5, &velocity[0]));
    PetscCall(FemModelAddPlane(model, "ymin", floor, up, mu, 0, velocity));
    PetscCall(FemModelAddHistory(model, "velocity", "body"));
    PetscCall(FemModelAddHistory(model, "displacement", "body"));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetStepper(model, &s));
    PetscCall(FemModelGetStableStep(model, &dt));
    dt *= 0.9;
    for (k = 0, t = 0; t < 0.2; k++, t = k * dt) {
      PetscCall(s.step(s.ctx, k * dt, dt));
      PetscCall(CaseLedger(model, &ledger));
      CheckBelow(LedgerError(&ledger), 1e-9);
      if (!moving && t + dt < 0.5 / 4 * 0.9) CheckNear(CaseHistory(model, "velocity(body).x"), 0.5 - mu * 10 * (t + dt), 0.02);
      if (moving && t + dt < 0.5 / 4 * 0.9) CheckNear(CaseHistory(model, "velocity(body).x"), mu * 10 * (t + dt), 0.02);
    }
    printf("  block %s: at the end %.4f m/s, moved %.5f m, friction took %.4f J of %.4f J, work %.4f J\n", moving ? "on a moving floor" : "sliding", (double)CaseHistory(model, "velocity(body).x"), (double)CaseHistory(model, "displacement(body).x"),
           (double)ledger.energy[LEDGER_FRICTION], (double)(0.5 * mass * 0.25), (double)ledger.energy[LEDGER_WORK]);
    CheckNear(CaseHistory(model, "velocity(body).x"), moving ? 0.5 : 0, 0.01);
    CheckClose(CaseHistory(model, "displacement(body).x"), moving ? 0.5 * 0.2 - 0.5 * 0.5 * 0.125 : 0.5 * 0.5 * 0.125, 0.02);
    CheckClose(ledger.energy[LEDGER_FRICTION], 0.5 * mass * 0.25, 0.03); /* the same either way */
    if (moving) PetscCall(TableDestroy(&velocity[0]));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A body at rest that stays on its floor begins with the static push, and neither moves nor rings.  Eq. (2.58) */
static PetscErrorCode TestPreloadOnPlane(void)
{
  const FemMaterial m         = {2000, 1e8, 0.3};
  const PetscReal   length[3] = {0.3, 0.2, 0.1}, g[3] = {0, 0, -10}, floor[3] = {0, 0, 0}, up[3] = {0, 0, 1}, weight = 2000 * 0.006 * 10;
  const PetscInt    n[3]      = {4, 3, 3};
  Mesh              mesh;
  FemModel          model;
  Stepper           s;
  Ledger            ledger;
  PetscReal         dt, *u, *u0;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX8, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_EXPLICIT, 1, &m, &model));
  PetscCall(CaseFix(model, "xmin", 0, 0));
  PetscCall(CaseFix(model, "ymin", 1, 0));
  PetscCall(FemModelSetGravity(model, g));
  PetscCall(FemModelSetPreload(model, PETSC_TRUE));
  PetscCall(Plane(model, "zmin", floor, up, 0, 1));
  PetscCall(FemModelAddHistory(model, "reaction", "zmin"));
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModelGetStepper(model, &s));
  PetscCall(FemModelGetStableStep(model, &dt));
  PetscCall(PetscMalloc2(3 * mesh.n_nodes, &u, 3 * mesh.n_nodes, &u0));
  PetscCall(FemModelGetField(model, "displacement", u0));
  for (PetscInt k = 0; k < 100; k++) {
    PetscCall(s.step(s.ctx, k * dt, dt));
    CheckClose(CaseHistory(model, "reaction(zmin).z"), weight, 1e-8);
  }
  PetscCall(FemModelGetField(model, "displacement", u));
  for (PetscInt k = 0; k < 3 * mesh.n_nodes; k++) CheckNear(u[k], u0[k], 1e-9 * weight / (1e8 * 0.06) * 0.1);
  PetscCall(CaseLedger(model, &ledger));
  CheckBelow(LedgerError(&ledger), 1e-11);
  PetscCall(PetscFree2(u, u0));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- static ---- */

/* Pressed onto a plane in any direction by an even pressure: even stress, whatever the elements; the plane carries the load, one factor serves all. */
static PetscErrorCode TestContactPatch(void)
{
  static const MeshCellType types[] = {MESH_TRI3, MESH_QUAD4, MESH_TRI6, MESH_QUAD9, MESH_TET4, MESH_HEX8, MESH_TET10, MESH_HEX27, MESH_PRISM18};
  const FemMaterial         m       = {1000, 1e9, 0.3};
  const PetscReal           length[3] = {1, 1, 1}, a = 0.5, normal[3] = {-PetscSinReal(0.5), PetscCosReal(0.5), 0}, point[3] = {0, 0, 0};
  const PetscInt            n[3] = {3, 3, 3};

  PetscFunctionBeginUser;
  for (size_t t = 0; t < sizeof(types) / sizeof(types[0]); t++) {
    Mesh       mesh;
    FemModel   model;
    Stepper    s;
    Ledger     ledger;
    Table      press;
    PetscInt   cells;
    PetscReal *stress;
    const PetscReal time[2] = {0, 2}, value[2] = {0, 2e6};

    PetscCall(CaseBox(PETSC_COMM_SELF, types[t], length, n, 0.15, &mesh));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) {
      const PetscReal x = mesh.x[3 * i], y = mesh.x[3 * i + 1];

      mesh.x[3 * i]     = PetscCosReal(a) * x - PetscSinReal(a) * y;
      mesh.x[3 * i + 1] = PetscSinReal(a) * x + PetscCosReal(a) * y;
    }
    PetscCall(TableCreate(2, time, value, &press));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, mesh.dim == 3 ? FEM_SOLID : FEM_PLANE_STRESS, FEM_STATIC, 1, &m, &model));
    PetscCall(FemModelSetSymmetry(model, "xmin"));
    if (mesh.dim == 3) PetscCall(FemModelSetSymmetry(model, "zmin"));
    PetscCall(FemModelAddPressure(model, "ymax", &press));
    PetscCall(Plane(model, "ymin", point, normal, 0, 1));
    PetscCall(FemModelAddHistory(model, "reaction", "ymin"));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetStepper(model, &s));
    PetscCall(FemModelGetCounts(model, NULL, &cells, NULL));
    PetscCall(PetscMalloc1(6 * cells, &stress));
    for (PetscInt k = 0; k < 2; k++) {
      PetscReal p = 1e6 * (k + 1), c = PetscCosReal(a), d = PetscSinReal(a);

      PetscCall(s.step(s.ctx, k, 1));
      CheckClose(CaseHistory(model, "reaction(ymin).y"), p * c, 1e-9);
      CheckClose(CaseHistory(model, "reaction(ymin).x"), -p * d, 1e-9);
      PetscCall(FemModelGetField(model, "element_stress", stress));
      for (PetscInt e = 0; e < cells; e++) {
        CheckNear(stress[6 * e], -p * d * d, 1e-8 * p);
        CheckNear(stress[6 * e + 1], -p * c * c, 1e-8 * p);
        CheckNear(stress[6 * e + 3], p * c * d, 1e-8 * p);
      }
      PetscCall(CaseLedger(model, &ledger));
      CheckBelow(LedgerError(&ledger), 1e-10);
      CheckNear(ledger.energy[LEDGER_CONTACT], 0, 1e-10 * ledger.energy[LEDGER_WORK]);
    }
    PetscCall(PetscFree(stress));
    PetscCall(TableDestroy(&press));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Signorini: a beam without weight on a floor, its middle pressed by a force: ends lift off. Nobody pulls, nobody passes, where there is a push there is no gap.
  Contact that recedes does so at once and stays as wide under any load, and the answer grows with the load (Dundurs and Stippes, J. Appl. Mech. 37 (1970) 965).
*/
static PetscErrorCode TestEndsLiftOff(void)
{
  const FemMaterial m         = {2000, 1e7, 0.3};
  const PetscReal   length[3] = {8, 0.5, 0}, down[3] = {0, -1, 0}, up[3] = {0, 1, 0}, floor[3] = {0, 0, 0}, time[4] = {0, 1, 2, 3}, load[4] = {0, 2000, 200, 2000};
  const PetscInt    n[3]      = {64, 4, 0};
  PetscInt          top, touching[3];
  Mesh              mesh;
  FemModel          model;
  Stepper           s;
  Ledger            ledger;
  Table             force;
  PetscReal        *u, *r, *first;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  top = CaseNodeAt(&mesh, 4, 0.5, 0);
  PetscCall(CaseAddNodeGroups(&mesh, 1, &top));
  PetscCall(TableCreate(4, time, load, &force));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_STATIC, 1, &m, &model));
  {
    char name[32];

    PetscCall(BaseFormat(name, "node %d", (int)top));
    PetscCall(CaseFix(model, name, 0, 0));
    PetscCall(FemModelAddForce(model, name, down, &force));
  }
  PetscCall(Plane(model, "ymin", floor, up, 0, 1));
  PetscCall(FemModelAddHistory(model, "reaction", "ymin"));
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModelGetStepper(model, &s));
  PetscCall(PetscMalloc3(3 * mesh.n_nodes, &u, 3 * mesh.n_nodes, &r, 3 * mesh.n_nodes, &first));
  for (PetscInt k = 0; k < 3; k++) {
    PetscCall(s.step(s.ctx, k, 1));
    CheckClose(CaseHistory(model, "reaction(ymin).y"), load[k + 1], 1e-9);
    PetscCall(FemModelGetField(model, "displacement", u));
    PetscCall(FemModelGetField(model, "reaction", r));
    touching[k] = 0;
    for (PetscInt i = 0; i < mesh.n_nodes; i++) {
      if (mesh.x[3 * i + 1] > 1e-9) continue;
      CheckAbove(r[3 * i + 1], 0);
      CheckAbove(u[3 * i + 1], -1e-12);
      CheckNear(r[3 * i + 1] * u[3 * i + 1], 0, 1e-12 * load[k + 1]);
      touching[k] += r[3 * i + 1] > 0;
    }
    PetscCall(CaseLedger(model, &ledger));
    CheckBelow(LedgerError(&ledger), 1e-10);
    if (k == 0) PetscCall(PetscArraycpy(first, u, 3 * mesh.n_nodes));
    for (PetscInt i = 0; i < 3 * mesh.n_nodes; i++) CheckNear(u[i] * load[1], first[i] * load[k + 1], 1e-9);
  }
  printf("  beam on a floor: %d of 65 nodes touch under 2000 N, %d under 200 N\n", (int)touching[0], (int)touching[1]);
  CheckBelow(touching[0], 20);
  CheckAbove(touching[0], 4);
  CheckInt(touching[1], touching[0]);
  CheckAbove(u[3 * CaseNodeAt(&mesh, 0, 0, 0) + 1], 1e-5);
  PetscCall(PetscFree3(u, r, first));
  PetscCall(TableDestroy(&force));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Smaller cells near the lowest point (0, 0): a quarter of a disc or of a ball in [0, 1]^d, R = 1, centre at (0, 1). */
static void Round(PetscInt dim, PetscReal grade, PetscReal x[3])
{
  PetscReal s[3] = {x[0], x[1], dim == 3 ? x[2] : 0}, q, depth, r;

  for (PetscInt d = 0; d < 3; d++) s[d] = s[d] * ((1 - grade) * s[d] * s[d] + grade);
  q     = 0.5 * (s[0] * s[0] + s[2] * s[2]); /* the floor of the block is bent up to the arc, its top stays level at y = 0.8 */
  r     = PetscSqrtReal(s[0] * s[0] + s[2] * s[2]);
  depth = 1 - PetscSqrtReal(PetscMax(0, 1 - 0.25 * r * r));
  (void)q;
  x[0] = 0.5 * s[0];
  x[2] = 0.5 * s[2];
  x[1] = depth + s[1] * (0.8 - depth);
}

/*
  Hertz: a round body of R = 1 pressed onto a plane by its level top. Force per length in the plane P = pi a^2 E' / (4R), p0 = 2P/(pi a); in space
  P = 4 E' a^3 / (3R), p0 = 3P/(2 pi a^2). From the total push P measured: half width a and p0 as theory has them against the largest
  recovered stress at the middle and the place of the last push.
*/
static PetscErrorCode TestHertz(void)
{
  static const struct {
    MeshCellType type;
    const char  *word;
    PetscInt     n, high;
    PetscReal    down, tolerance;
  } rows[]            = {{MESH_QUAD4, "cylinder, quad4", 80, 40, 2e-3, 0.03}, {MESH_QUAD9, "cylinder, quad9", 40, 20, 2e-3, 0.03}, {MESH_HEX8, "sphere, hex8", 14, 12, 6e-3, 0.05}};
  const FemMaterial m = {1000, 1e9, 0.3};
  const PetscReal   Es = 1e9 / (1 - 0.09);

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(rows) / sizeof(rows[0]); k++) {
    const PetscInt  dim = MeshCellDim(rows[k].type), n[3] = {rows[k].n, rows[k].high, rows[k].n};
    const PetscReal length[3] = {1, 1, 1}, floor[3] = {0, 0, 0}, up[3] = {0, 1, 0};
    PetscReal      *r, *stress, P, a, p0, got, width = 0, next = PETSC_MAX_REAL;
    PetscInt        points;
    Mesh            mesh;
    FemModel        model;

    PetscCall(CaseBox(PETSC_COMM_SELF, rows[k].type, length, n, 0, &mesh));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) Round(dim, 0.12, &mesh.x[3 * i]);
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, FEM_STATIC, 1, &m, &model));
    PetscCall(FemModelSetSymmetry(model, "xmin"));
    if (dim == 3) PetscCall(FemModelSetSymmetry(model, "zmin"));
    PetscCall(CaseFix(model, "ymax", 1, -rows[k].down));
    PetscCall(Plane(model, "ymin", floor, up, 0, 1));
    PetscCall(FemModelAddHistory(model, "reaction", "ymin"));
    PetscCall(CaseSolve(model));
    PetscCall(FemModelGetPoints(model, &points, NULL));
    PetscCall(PetscMalloc2(3 * mesh.n_nodes, &r, 6 * mesh.n_nodes, &stress));
    PetscCall(FemModelGetField(model, "reaction", r));
    PetscCall(FemModelRecover(model, stress, NULL));
    P = CaseHistory(model, "reaction(ymin).y") * (dim == 3 ? 4 : 2);
    if (dim == 2) {
      a  = PetscSqrtReal(4 * P / (PETSC_PI * Es));
      p0 = 2 * P / (PETSC_PI * a);
    } else {
      a  = PetscPowReal(3 * P / (4 * Es), 1. / 3);
      p0 = 3 * P / (2 * PETSC_PI * a * a);
    }
    got = -stress[6 * CaseNodeAt(&mesh, 0, 0, 0) + 1];
    for (PetscInt i = 0; i < mesh.n_nodes; i++) {
      const PetscReal x = mesh.x[3 * i];

      if (mesh.x[3 * i + 1] > 0.1 || mesh.x[3 * i + 2] > 1e-9) continue;
      if (r[3 * i + 1] > 0) width = PetscMax(width, x);
    }
    for (PetscInt i = 0; i < mesh.n_nodes; i++)
      if (mesh.x[3 * i + 1] < 0.1 && mesh.x[3 * i + 2] < 1e-9 && mesh.x[3 * i] > width + 1e-12) next = PetscMin(next, mesh.x[3 * i]);
    printf("  Hertz, %s: half width %.4f, the last that touches at %.4f, the next at %.4f; p0 %.4g, found %.4f of it\n", rows[k].word, (double)a, (double)width, (double)next, (double)p0, (double)(got / p0));
    CheckClose(got, p0, rows[k].tolerance);
    CheckAbove(a, width - 0.5 * (next - width)); /* between the last node that touches and the next, give or take half a cell */
    CheckBelow(a, next + 0.5 * (next - width));
    PetscCall(PetscFree2(r, stress));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- ranks, restart, words ---- */

static PetscErrorCode BouncingBlock(MPI_Comm comm, FemMethod method, FemModel *model)
{
  const FemMaterial m         = {2000, 1e8, 0.3};
  const PetscReal   length[3] = {0.4, 0.3, 0.2}, g[3] = {1, 0, -10}, v0[3] = {0.5, 0.2, -1}, floor[3] = {0, 0, -1e-4}, up[3] = {0.05, 0.02, 1}, point[3] = {-1e-4, 0, -9e-3}, time[2] = {0, 0.01}, rise[2] = {0, 0.4};
  const PetscInt    n[3]      = {6, 4, 3};
  Table             velocity[3] = {{0}};
  Mesh              mesh;

  PetscFunctionBeginUser;
  PetscCall(TableCreate(2, time, rise, &velocity[2]));
  PetscCall(CaseBox(comm, MESH_HEX8, length, n, 0.2, &mesh));
  PetscCall(CaseModel(comm, &mesh, FEM_SOLID, method, 1, &m, model));
  PetscCall(FemModelSetGravity(*model, g));
  if (method != FEM_STATIC) PetscCall(FemModelSetInitialVelocity(*model, v0));
  else {
    PetscCall(CaseFix(*model, "xmin", 0, 0));
    PetscCall(CaseFix(*model, "ymin", 1, 0));
  }
  if (method != FEM_STATIC) PetscCall(FemModelAddPlane(*model, method == FEM_EXPLICIT ? "body" : "zmin", point, up, 0.3, 0.8, velocity));
  else PetscCall(FemModelAddPlane(*model, "zmin", floor, (PetscReal[3]){0, 0, 1}, 0.1, 1, velocity));
  PetscCall(FemModelAddHistory(*model, "reaction", "body"));
  PetscCall(FemModelSetUp(*model));
  PetscCall(TableDestroy(&velocity[2]));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stopped and gone on: the same bits, ledger included. */
static PetscErrorCode TestRestart(void)
{
  for (PetscInt still = 0; still < 3; still++) {
    const FemMethod method = still == 2 ? FEM_IMPLICIT : still ? FEM_STATIC : FEM_EXPLICIT;
    const PetscReal dt     = still == 2 ? 2e-4 : still ? 0.002 : 4e-5;
    const PetscInt  steps  = still == 2 ? 40 : still ? 2 : 200;
    char            file[] = "fem_contact_checkpoint.h5";
    FemModel        one, two;
    Stepper         s;
    Checkpoint      checkpoint;
    Ledger          a, b;

    PetscFunctionBeginUser;
    PetscCall(BouncingBlock(PETSC_COMM_SELF, method, &one));
    PetscCall(FemModelGetStepper(one, &s));
    for (PetscInt k = 0; k < steps; k++) PetscCall(s.step(s.ctx, k * dt, dt));
    PetscCall(CheckpointCreate(PETSC_COMM_SELF, file, &checkpoint));
    PetscCall(s.save(s.ctx, checkpoint));
    PetscCall(CheckpointClose(&checkpoint));
    for (PetscInt k = steps; k < 2 * steps; k++) PetscCall(s.step(s.ctx, k * dt, dt));
    PetscCall(CaseLedger(one, &a));
    PetscCall(BouncingBlock(PETSC_COMM_SELF, method, &two));
    PetscCall(FemModelGetStepper(two, &s));
    PetscCall(CheckpointOpen(PETSC_COMM_SELF, file, &checkpoint));
    PetscCall(s.load(s.ctx, checkpoint));
    PetscCall(CheckpointClose(&checkpoint));
    for (PetscInt k = steps; k < 2 * steps; k++) PetscCall(s.step(s.ctx, k * dt, dt));
    PetscCall(CaseLedger(two, &b));
    for (PetscInt k = 0; k < one->n_own * 3; k++) CheckTrue(one->u[k] == two->u[k] && one->v[k] == two->v[k]);
    for (PetscInt k = 0; k < LEDGER_TERMS; k++) CheckTrue(a.energy[k] == b.energy[k]);
    CheckBelow(LedgerError(&a), 1e-9);
    CheckPositive(a.energy[LEDGER_FRICTION]);
    CheckAbove(PetscAbsReal(CaseHistory(one, "reaction(body).z")), still == 1 ? 1 : 0);
    remove(file);
    PetscCall(FemModelDestroy(&one));
    PetscCall(FemModelDestroy(&two));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestRefusals(void)
{
  const FemMaterial m         = {1000, 1e9, 0.3};
  const PetscReal   length[3] = {1, 1, 1}, floor[3] = {0, 0, 0}, up[3] = {0, 1, 0}, down[3] = {0, -1, 0}, none[3] = {0, 0, 0};
  const PetscInt    n[3]      = {2, 2, 2};

  PetscFunctionBeginUser;
  for (PetscInt c = 0; c < 9; c++) {
    Mesh     mesh;
    FemModel model;

    PetscCall(CaseBox(PETSC_COMM_SELF, c == 7 ? MESH_HEX20 : MESH_QUAD4, length, n, 0, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, c == 7 ? FEM_SOLID : FEM_PLANE_STRAIN, c == 8 ? FEM_IMPLICIT : c == 1 ? FEM_EXPLICIT : FEM_STATIC, 1, &m, &model));
    if (c != 3) PetscCall(CaseFix(model, "xmin", 0, 0));
    if (c == 0) {
      CheckFails(Plane(model, "ymin", floor, none, 0, 1), PETSC_ERR_USER_INPUT, "needs a direction");
      CheckFails(Plane(model, "ymin", floor, up, -1, 1), PETSC_ERR_USER_INPUT, "friction of -1");
      CheckFails(Plane(model, "ymin", floor, up, 0, 2), PETSC_ERR_USER_INPUT, "between 0 and 1");
      CheckFails(Plane(model, "ymni", floor, up, 0, 1), PETSC_ERR_USER_INPUT, "did you mean 'ymin'?");
    }
    if (c == 1) {
      CheckFails(Plane(model, "body", (PetscReal[3]){0, 0.25, 0}, up, 0, 1), PETSC_ERR_USER_INPUT, "0.25 m behind the plane");
    }
    if (c == 2 || c == 8) { /* two planes at a node, a static or an implicit step */
      PetscCall(Plane(model, "body", floor, up, 0, 1));
      PetscCall(Plane(model, "ymax", (PetscReal[3]){0, 1, 0}, down, 0, 1));
      CheckFails(FemModelSetUp(model), PETSC_ERR_USER_INPUT, "meets two planes");
    }
    if (c == 3) { /* pulled along it by more than it holds: 0.3 x 1 kN, and 0.31 kN */
      PetscCall(Plane(model, "ymin", floor, up, 0.3, 1));
      PetscCall(CaseTraction(model, "ymax", 310, -1000, 0));
      CheckFails(CaseSolve(model), PETSC_ERR_USER_INPUT, "or slides along it, and nothing else holds it");
    }
    if (c == 4) {
      PetscCall(CaseFix(model, "ymin", 1, 0));
      PetscCall(Plane(model, "ymin", floor, up, 0, 1));
      CheckFails(FemModelSetUp(model), PETSC_ERR_USER_INPUT, "held across it");
    }
    if (c == 5) { /* lifted off by a pull */
      PetscCall(Plane(model, "ymin", floor, up, 0, 1));
      PetscCall(CaseTraction(model, "ymax", 0, 1e3, 0));
      CheckFails(CaseSolve(model), PETSC_ERR_USER_INPUT, "nothing else holds it");
    }
    if (c == 7) {
      PetscCall(CaseFix(model, "zmin", 2, 0));
      PetscCall(Plane(model, "ymin", floor, up, 0, 1));
      CheckFails(FemModelSetUp(model), PETSC_ERR_USER_INPUT, "sides of eight nodes");
    }
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestBarStrikesWall)
CHECK_TEST(TestBlockBouncesOffSlantingWall)
CHECK_TEST(TestBlockSlides)
CHECK_TEST(TestPreloadOnPlane)
CHECK_TEST(TestContactPatch)
CHECK_TEST(TestEndsLiftOff)
CHECK_TEST(TestHertz)
CHECK_TEST(TestRestart)
CHECK_TEST(TestRefusals)

static const struct CMUnitTest tests[] = {TEST(TestBarStrikesWall), TEST(TestBlockBouncesOffSlantingWall), TEST(TestBlockSlides), TEST(TestPreloadOnPlane), TEST(TestContactPatch), TEST(TestEndsLiftOff), TEST(TestHertz), TEST(TestRestart), TEST(TestRefusals)};
CHECK_MAIN(tests)
