/* test_tools.c - tools that press, turn, fall: against closed forms, and momentum, energy, threads, restart. */
#include "tool_cases.h"

static PetscReal Total(const Ledger *l)
{
  return l->energy[LEDGER_KINETIC] + l->energy[LEDGER_STRAIN] + l->energy[LEDGER_CONTACT];
}

/* Ledger error against the energies of step 0, as the run loop makes it. */
static PetscErrorCode LedgerNow(DemModel model, Stepper *stepper, PetscReal initial, PetscReal *error)
{
  Ledger ledger;

  PetscFunctionBegin;
  PetscCall(stepper->energy(model, &ledger));
  ledger.initial = initial;
  *error         = LedgerError(&ledger);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const DemContactChoice rough = {.law = DEM_CONTACT_LINEAR, .stiffness = 1e6, .ratio = 0.8, .restitution = 1, .friction = 0.4};

/* A sphere slides, then rolls over a shaken tessellation of an inclined plane: the same force as over the plane itself, to 1e-9 at every step. */
static PetscErrorCode Incline(DemContactLaw law, PetscReal rolling, PetscReal restitution)
{
  const PetscReal a[3] = {0.8, 0, 0.6}, b[3] = {0, 1, 0}, n[3] = {-0.6, 0, 0.8}, g[3] = {1, -0.5, -9.8};
  PetscReal       x[1][3], r = 0.1, force[2][3], worst = 0, dt, peak = 0, initial[2], error;
  DemModel        model[2];
  Stepper         stepper[2];
  DemState        s[2];
  Ledger          ledger;

  PetscFunctionBeginUser;
  for (PetscInt d = 0; d < 3; d++) x[0][d] = 0.0999 * n[d] + (d == 0 ? 0.5 * a[0] : d == 2 ? 0.5 * a[2] : 0);
  for (PetscInt k = 0; k < 2; k++) {
    DemToolOptions o = {.shape = k ? DEM_TOOL_SURFACE : DEM_TOOL_PLANE, .contact = rough};

    o.contact.law         = law;
    o.contact.rolling     = rolling;
    o.contact.restitution = restitution;
    if (law == DEM_CONTACT_HERTZ) o.contact.ratio = 0;
    PetscCall(Spheres(3, 1, x, &r, 1, &model[k]));
    for (PetscInt d = 0; d < 3; d++) o.axis[d] = n[d];
    if (k) PetscCall(Sheet(25, (PetscReal[3]){0, 0, 0}, a, b, 2, 17, &o.surface));
    PetscCall(DemModelAddTool(model[k], "floor", &o));
    PetscCall(DemModelSetGravity(model[k], g));
    PetscCall(DemModelSetUp(model[k]));
    PetscCall(DemModelGetStepper(model[k], &stepper[k]));
    PetscCall(DemModelGetState(model[k], &s[k]));
    s[k].v[0] = -0.3;
    s[k].v[1] = 1.2;
    s[k].spin[2] = 3;
    PetscCall(stepper[k].energy(model[k], &ledger));
    initial[k] = Total(&ledger);
  }
  PetscCall(stepper[0].stable_step(model[0], &dt));
  dt *= 0.02;
  for (PetscInt k = 0; k < 6000; k++) {
    for (PetscInt i = 0; i < 2; i++) {
      DemToolState now;

      PetscCall(stepper[i].step(model[i], k * dt, dt));
      PetscCall(DemModelGetTool(model[i], "floor", &now));
      for (PetscInt d = 0; d < 3; d++) force[i][d] = now.force[d];
    }
    for (PetscInt d = 0; d < 3; d++) {
      peak  = PetscMax(peak, PetscAbsReal(force[0][d]));
      worst = PetscMax(worst, PetscAbsReal(force[1][d] - force[0][d]));
    }
  }
  print_message("           force over triangles against plane: %.1e of the largest; way %.2f r down, %.2f r across, spin %.3g\n", (double)(worst / peak),
                (double)((s[0].u[0] * a[0] + s[0].u[2] * a[2]) / r), (double)(s[0].u[1] / r), (double)s[0].spin[1]);
  CheckBelow(worst / peak, 1e-9);
  CheckAbove(PetscAbsReal(s[0].u[0]), 5 * r); /* it crossed squares, */
  CheckBelow(PetscAbsReal(s[0].u[0]), 1.9);   /* and stayed on the sheet */
  for (PetscInt i = 0; i < 2; i++) {
    PetscCall(LedgerNow(model[i], &stepper[i], initial[i], &error));
    print_message("           ledger %.1e\n", (double)error);
    CheckBelow(error, 1e-3);
    PetscCall(DemModelRestoreState(model[i], &s[i]));
    PetscCall(DemModelDestroy(&model[i]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestIncline(void)
{
  PetscFunctionBeginUser;
  PetscCall(Incline(DEM_CONTACT_LINEAR, 0, 1));
  PetscCall(Incline(DEM_CONTACT_LINEAR, 0.05, 0.7));
  PetscCall(Incline(DEM_CONTACT_HERTZ, 0, 0.8));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestIncline)

/* Balls at rest against edge, corner and hollow of a box: force is stiffness x overlap along the line to the nearest point. */
static PetscErrorCode TestClosedForms(void)
{
  const PetscReal x[5][3] = {{2.06, 1, 2.06}, {2.05, 2.05, 2.05}, {1, 1, 2.09}, {0.09, 1, 0.08}, {-0.09, -0.09, 1}}, r[5] = {0.1, 0.1, 0.1, 0.1, 0.1};
  const PetscReal k = 1e6 * 0.1, edge = 0.06 * PETSC_SQRT2, corner = 0.05 * PetscSqrtReal(3);
  DemToolOptions  o = {.shape = DEM_TOOL_SURFACE, .contact = rough};
  DemToolState    now;
  DemModel        model;
  DemState        s;

  PetscFunctionBeginUser;
  PetscCall(Spheres(3, 5, x, r, 1, &model));
  PetscCall(DemSurfaceCreateBox(3, (PetscReal[3]){0, 0, 0}, (PetscReal[3]){2, 2, 2}, &o.surface));
  PetscCall(DemModelAddTool(model, "box", &o));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetState(model, &s));
  PetscCall(DemModelGetTool(model, "box", &now));
  CheckInt(now.contacts, 5); /* 1 edge, 1 corner, 1 face, 2 in the hollow, none beyond the edge at the origin */
  for (PetscInt p = 0; p < 5; p++) {
    const PetscReal want[5][3] = {{k * (0.1 - edge) / PETSC_SQRT2, 0, k * (0.1 - edge) / PETSC_SQRT2},
                                  {k * (0.1 - corner) / PetscSqrtReal(3), k * (0.1 - corner) / PetscSqrtReal(3), k * (0.1 - corner) / PetscSqrtReal(3)},
                                  {0, 0, k * 0.01},
                                  {k * 0.01, 0, k * 0.02},
                                  {0, 0, 0}};

    for (PetscInt d = 0; d < 3; d++) CheckNear(s.f[d * s.n + p], want[s.number[p]][d], 1e-9 * k);
  }
  PetscCall(DemModelRestoreState(model, &s));
  PetscCall(DemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestClosedForms)

/* A ball falls on an edge and on a corner of a box, straight and beside, smooth and rough: straight it comes back the way it came, e times as fast; every joule is found. */
static PetscErrorCode TestEdgeAndCorner(void)
{
  const PetscReal from[2][3] = {{PETSC_SQRT2 / 2, 0, PETSC_SQRT2 / 2}, {1 / PetscSqrtReal(3), 1 / PetscSqrtReal(3), 1 / PetscSqrtReal(3)}}, foot[2][3] = {{2, 1.03, 2}, {2, 2, 2}};
  PetscReal       off = 0, most = 0;

  PetscFunctionBeginUser;
  for (PetscInt run = 0; run < 16; run++) {
    const PetscInt  where = run & 1, beside = run >> 1 & 1, law = run >> 2 & 1;
    const PetscReal e = run >> 3 & 1 ? 0.6 : 1;
    DemToolOptions  o = {.shape = DEM_TOOL_SURFACE, .contact = rough};
    PetscReal       x[1][3], r[1] = {0.1}, v[3], dt, initial, error = 0, back = 0, side = 0;
    DemModel        model;
    Stepper         stepper;
    DemState        s;
    Ledger          ledger;

    o.contact.law         = law ? DEM_CONTACT_HERTZ : DEM_CONTACT_LINEAR;
    o.contact.restitution = e;
    if (law) o.contact.ratio = 0;
    for (PetscInt d = 0; d < 3; d++) {
      x[0][d] = foot[where][d] + 0.1005 * from[where][d] + (beside && d == 2 ? 0.01 : 0);
      v[d]    = -1.5 * from[where][d];
    }
    PetscCall(Spheres(3, 1, x, r, 1, &model));
    PetscCall(DemModelSetInitialVelocity(model, v));
    PetscCall(DemSurfaceCreateBox(3, (PetscReal[3]){0, 0, 0}, (PetscReal[3]){2, 2, 2}, &o.surface));
    PetscCall(DemModelAddTool(model, "box", &o));
    PetscCall(DemModelSetUp(model));
    PetscCall(DemModelGetStepper(model, &stepper));
    PetscCall(stepper.stable_step(model, &dt));
    dt *= 0.01;
    PetscCall(stepper.energy(model, &ledger));
    initial = Total(&ledger);
    for (PetscReal t = 0; t < 0.06; t += dt) PetscCall(stepper.step(model, t, dt));
    PetscCall(LedgerNow(model, &stepper, initial, &error));
    CheckBelow(error, 1e-3);
    most = PetscMax(most, error);
    PetscCall(DemModelGetState(model, &s));
    for (PetscInt d = 0; d < 3; d++) back += s.v[d] * from[where][d];
    for (PetscInt d = 0; d < 3; d++) side = PetscMax(side, PetscAbsReal(s.v[d] - back * from[where][d]));
    CheckAbove(back, 0.3);
    if (beside) {
      CheckAbove(PetscAbsReal(s.spin[0]) + PetscAbsReal(s.spin[1]), 0.1); /* friction has turned it */
    } else {
      off = PetscMax(off, PetscAbsReal(back / (1.5 * e) - 1));
      CheckClose(back, 1.5 * e, 1e-3);
      CheckBelow(side, 1e-9);
    }
    PetscCall(DemModelRestoreState(model, &s));
    PetscCall(DemModelDestroy(&model));
  }
  print_message("           edge and corner: restitution off by %.1e, ledger %.1e\n", (double)off, (double)most);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestEdgeAndCorner)

/* A platen of 2 kg pushed down by 40 N on three balls comes to rest where they carry the force, its weight and no more. */
static PetscErrorCode TestPlaten(void)
{
  const PetscReal x[3][3] = {{0, 0, 0.1}, {1, 0, 0.1}, {0.5, 1, 0.1}}, r[3] = {0.1, 0.1, 0.1}, g[3] = {0, 0, -10};
  DemToolOptions  floor = {.shape = DEM_TOOL_PLANE, .axis = {0, 0, 1}, .contact = rough}, platen = {.shape = DEM_TOOL_DISC, .point = {0.5, 0.4, 0.2 + 1e-4}, .axis = {0, 0, 1}, .radius = 2, .contact = rough, .pushed = PETSC_TRUE, .push_axis = {0, 0, -3}, .mass = 2};
  DemToolState    now;
  DemModel        model;
  Stepper         stepper;
  Ledger          ledger;
  PetscReal       dt, initial, error, balls;

  PetscFunctionBeginUser;
  PetscCall(Spheres(3, 3, x, r, 1, &model));
  PetscCall(TableCreateConstant(40, &platen.force));
  floor.contact.restitution = platen.contact.restitution = 0.3;
  PetscCall(DemModelAddTool(model, "floor", &floor));
  PetscCall(DemModelAddTool(model, "platen", &platen));
  PetscCall(DemModelSetGravity(model, g));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetStepper(model, &stepper));
  PetscCall(stepper.energy(model, &ledger));
  initial = Total(&ledger);
  PetscCall(stepper.stable_step(model, &dt));
  dt *= 0.05;
  for (PetscInt k = 0; k < 20000; k++) PetscCall(stepper.step(model, k * dt, dt));
  balls = 3 * 1000 * 4. / 3 * PETSC_PI * 1e-3 * 10;
  PetscCall(DemModelGetTool(model, "platen", &now));
  CheckClose(now.force[2], 60, 1e-6);
  CheckClose(-now.shift[2], 1e-4 + 20. / 1e5 + (20 + balls / 3) / 1e5, 1e-5);
  PetscCall(DemModelGetTool(model, "floor", &now));
  CheckClose(-now.force[2], 60 + balls, 1e-6);
  PetscCall(LedgerNow(model, &stepper, initial, &error));
  print_message("           platen at rest, ledger %.1e\n", (double)error);
  CheckBelow(error, 1e-3);
  PetscCall(TableDestroy(&platen.force));
  PetscCall(DemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPlaten)

/* A free brick: falls as g says, keeps its angular momentum to rounding and its spin energy, turns as Euler's equations do (order 2),
   whichever way round it lies: its principal axes come in the order of their moments. */
static PetscErrorCode Brick(PetscInt x_axis, PetscInt y_axis, PetscInt z_axis)
{
  const PetscReal x[1][3] = {{40, 40, 40}}, r[1] = {0.1}, g[3] = {0, 0, -10}, end = 0.5;
  const PetscInt  axis[3] = {x_axis, y_axis, z_axis};
  PetscReal       q[3][4], L[3], slope, high[3], low[3], spin[3];

  PetscFunctionBeginUser;
  for (PetscInt d = 0; d < 3; d++) {
    high[axis[d]] = (PetscReal[3]){0.1, 0.2, 0.4}[d];
    spin[axis[d]] = (PetscReal[3]){5, 0.3, -2}[d];
  }
  for (PetscInt d = 0; d < 3; d++) low[d] = -high[d];
  for (PetscInt level = 0; level < 3; level++) {
    const PetscInt steps = 100 << (2 * level);
    const PetscReal dt = end / steps;
    DemToolOptions o = {.shape = DEM_TOOL_SURFACE, .contact = rough, .motion = DEM_TOOL_FREE, .density = 500, .start_velocity = {1, 0, 2}, .start_spin = {spin[0], spin[1], spin[2]}};
    DemToolState   now;
    DemModel       model;
    Stepper        stepper;
    Ledger         ledger;
    PetscReal      first = 0, error;

    PetscCall(Spheres(3, 1, x, r, 1, &model));
    PetscCall(DemSurfaceCreateBox(3, low, high, &o.surface));
    PetscCall(DemModelAddTool(model, "brick", &o));
    PetscCall(DemModelSetGravity(model, g));
    PetscCall(DemModelSetUp(model));
    PetscCall(DemModelGetStepper(model, &stepper));
    PetscCall(DemModelGetTool(model, "brick", &now));
    CheckClose(now.mass, 500 * 0.2 * 0.4 * 0.8, 1e-14);
    CheckClose(now.angular[axis[0]], now.mass / 12 * (0.16 + 0.64) * 5, 1e-13);
    CheckClose(now.angular[axis[2]], -now.mass / 12 * (0.04 + 0.16) * 2, 1e-13);
    for (PetscInt d = 0; d < 3; d++) L[d] = now.angular[d];
    PetscCall(stepper.energy(model, &ledger));
    first = Total(&ledger);
    for (PetscInt k = 0; k < steps; k++) PetscCall(stepper.step(model, k * dt, dt));
    PetscCall(DemModelGetTool(model, "brick", &now));
    for (PetscInt d = 0; d < 3; d++) CheckNear(now.angular[d], L[d], 1e-13 * PetscAbsReal(L[axis[0]]));
    CheckClose(now.shift[0], 0.5, 1e-12);
    CheckClose(now.shift[2], 2 * end - 5 * end * end, 1e-11);
    PetscCall(LedgerNow(model, &stepper, first, &error));
    CheckBelow(error, 1e-3);
    for (PetscInt k = 0; k < 4; k++) q[level][k] = now.quaternion[k];
    PetscCall(DemModelDestroy(&model));
  }
  {
    PetscReal e[2] = {0};

    for (PetscInt k = 0; k < 4; k++) {
      e[0] += PetscSqr(q[0][k] - q[2][k]);
      e[1] += PetscSqr(q[1][k] - q[2][k]);
    }
    slope = 0.25 * PetscLogReal(e[0] / e[1]) / PetscLogReal(2);
    print_message("           order of the free rotation %.2f\n", (double)slope);
    CheckAbove(slope, 1.9);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestFreeBody(void)
{
  PetscFunctionBeginUser;
  PetscCall(Brick(0, 1, 2));
  PetscCall(Brick(1, 2, 0));
  PetscCall(Brick(2, 0, 1));
  PetscCall(Brick(1, 0, 2));
  PetscCall(Brick(0, 2, 1));
  PetscCall(Brick(2, 1, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFreeBody)

/* A free brick thrown at balls in empty space: momentum and angular momentum of all are kept to rounding, energy to 0.1 %; its force is minus theirs. */
static PetscErrorCode Collision(PetscInt dim)
{
  const PetscReal x[3][3] = {{0.33, 0.05, dim == 3 ? 0.03 : 0}, {0.3, -0.22, dim == 3 ? -0.1 : 0}, {0.62, 0, 0}}, r[3] = {0.1, 0.1, 0.1};
  DemToolOptions  o = {.shape = DEM_TOOL_SURFACE, .contact = rough, .motion = DEM_TOOL_FREE, .density = 800, .start_velocity = {2, 0.2, 0}, .start_spin = {dim == 3 ? 0.5 : 0, 0, 3}};
  PetscReal       sum[2][6], dt, initial, error = 0, most = 0, exchanged = 0, t = 0;
  DemToolState    now;
  DemModel        model;
  Stepper         stepper;
  Ledger          ledger;
  DemState        s;

  PetscFunctionBeginUser;
  PetscCall(Spheres(dim, 3, x, r, 1, &model));
  PetscCall(DemSurfaceCreateBox(dim, (PetscReal[3]){-0.2, -0.25, -0.15}, (PetscReal[3]){0.2, 0.25, 0.15}, &o.surface));
  o.contact.restitution = 0.8;
  PetscCall(DemModelAddTool(model, "brick", &o));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetStepper(model, &stepper));
  PetscCall(DemModelGetState(model, &s));
  PetscCall(stepper.energy(model, &ledger));
  initial = Total(&ledger);
  PetscCall(stepper.stable_step(model, &dt));
  dt *= 0.02;
  for (PetscInt k = 0; k < 6000; k++, t += dt) {
    PetscReal net[3] = {0};

    PetscCall(stepper.step(model, t, dt));
    PetscCall(DemModelGetTool(model, "brick", &now));
    for (PetscInt d = 0; d < dim; d++) {
      for (PetscInt p = 0; p < s.n; p++) net[d] += s.f[d * s.n + p];
      CheckNear(net[d] + now.force[d], 0, 1e-12 * (PetscAbsReal(net[d]) + 1));
      exchanged = PetscMax(exchanged, PetscAbsReal(net[d]));
    }
    for (PetscInt i = 0; i < 6; i++) sum[k ? 1 : 0][i] = 0;
    for (PetscInt p = 0; p <= s.n; p++) { /* momenta belong to half steps: with the place half a step ago; x x v is the same at either end */
      PetscReal *to = sum[k ? 1 : 0], X[3] = {0}, P[3] = {0}, S[3] = {0};

      for (PetscInt d = 0; d < 3; d++) {
        if (p == s.n) {
          X[d] = now.centre[d];
          P[d] = now.momentum[d];
          S[d] = now.angular[d];
        } else if (d < dim) {
          X[d] = s.x0[d * s.n + p] + s.u[d * s.n + p];
          P[d] = s.mass[p] * s.v[d * s.n + p];
          if (dim == 3) S[d] = s.inertia[p] * s.spin[d * s.n + p];
        } else if (dim == 2) S[2] = s.inertia[p] * s.spin[p];
      }
      for (PetscInt d = 0; d < 3; d++) {
        to[d] += P[d];
        to[3 + d] += S[d] + X[(d + 1) % 3] * P[(d + 2) % 3] - X[(d + 2) % 3] * P[(d + 1) % 3];
      }
    }
    if (k)
      for (PetscInt i = 0; i < 6; i++) most = PetscMax(most, PetscAbsReal(sum[1][i] - sum[0][i]));
  }
  PetscCall(LedgerNow(model, &stepper, initial, &error));
  PetscCall(stepper.energy(model, &ledger));
  print_message("           %dD: largest force %.3g N, momenta drift %.1e of %.3g, ledger %.1e, friction %.3g J, damping %.3g J of %.3g J\n", (int)dim, (double)exchanged, (double)most, (double)sum[0][0], (double)error,
                (double)ledger.energy[LEDGER_FRICTION], (double)(ledger.energy[LEDGER_CONTACT]), (double)initial);
  CheckAbove(exchanged, 100);
  CheckPositive(ledger.energy[LEDGER_FRICTION]);
  CheckBelow(most, 1e-11 * PetscAbsReal(sum[0][0]));
  CheckBelow(error, 1e-3);
  PetscCall(DemModelRestoreState(model, &s));
  PetscCall(DemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestCollision(void)
{
  PetscFunctionBeginUser;
  PetscCall(Collision(3));
  PetscCall(Collision(2));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCollision)

/* A turning box full of balls, friction and rolling resistance: its model, for the tests below. */
static PetscErrorCode Drum(PetscInt threads, DemModel *model)
{
  PetscReal(*x)[3], *r;
  PetscInt       n = 0;
  uint64_t       seed = 9;
  DemToolOptions o = {.shape = DEM_TOOL_SURFACE, .contact = rough, .turn_axis = {0, 1, 0.1}, .has_centre = PETSC_TRUE, .centre = {0.1, 0, 0}};

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(1000, &x, 1000, &r));
  for (PetscInt k = 0; k < 9; k++)
    for (PetscInt j = 0; j < 9; j++)
      for (PetscInt i = 0; i < 9; i++, n++) {
        const PetscInt at[3] = {i, j, k};

        r[n] = 0.05 * (0.8 + 0.2 * TestRandom(&seed));
        for (PetscInt d = 0; d < 3; d++) x[n][d] = 0.11 * (at[d] - 4) + 0.005 * TestRandom(&seed);
      }
  PetscCall(Spheres(3, n, x, r, threads, model));
  PetscCall(PetscFree2(x, r));
  PetscCall(DemSurfaceCreateBox(3, (PetscReal[3]){-0.51, -0.51, -0.51}, (PetscReal[3]){0.51, 0.51, 0.51}, &o.surface));
  o.contact.rolling     = 0.02;
  o.contact.restitution = 0.6;
  PetscCall(TableCreate(2, (PetscReal[2]){0, 0.05}, (PetscReal[2]){0, 6}, &o.speed));
  PetscCall(TableCreateConstant(0.3, &o.velocity[0]));
  PetscCall(DemModelAddTool(*model, "drum", &o));
  PetscCall(TableDestroy(&o.speed));
  PetscCall(TableDestroy(&o.velocity[0]));
  PetscCall(DemModelAddHistory(*model, "torque", "drum"));
  PetscCall(DemModelAddHistory(*model, "work", "drum"));
  PetscCall(DemModelSetGravity(*model, (PetscReal[3]){0, 0, -10}));
  PetscCall(DemModelSetUp(*model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckSame(DemModel a, DemModel b)
{
  DemState     s, t;
  DemToolState p, q;

  PetscFunctionBegin;
  PetscCall(DemModelGetState(a, &s));
  PetscCall(DemModelGetState(b, &t));
  PetscCall(DemModelGetTool(a, "drum", &p));
  PetscCall(DemModelGetTool(b, "drum", &q));
  CheckInt(memcmp(s.u, t.u, 3 * s.n * sizeof(PetscReal)), 0);
  CheckInt(memcmp(s.spin, t.spin, 3 * s.n * sizeof(PetscReal)), 0);
  CheckInt(memcmp(&p, &q, sizeof(p)), 0);
  CheckAbove(p.contacts, 10);
  PetscCall(DemModelRestoreState(a, &s));
  PetscCall(DemModelRestoreState(b, &t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One, two, three threads and a run that was stopped and resumed: the same bits. All balls stay in; the ledger closes. */
static PetscErrorCode TestDrum(void)
{
  const PetscInt steps = 800;
  DemModel       model[4];
  Stepper        stepper[4];
  Checkpoint     file;
  Ledger         one, two;
  DemToolState   now;
  DemState       s;
  PetscReal      dt, initial = 0, error, work;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 4; k++) {
    PetscCall(Drum(k < 3 ? k + 1 : 2, &model[k]));
    PetscCall(DemModelGetStepper(model[k], &stepper[k]));
  }
  PetscCall(stepper[0].energy(model[0], &one));
  initial = Total(&one);
  PetscCall(stepper[0].stable_step(model[0], &dt));
  dt *= 0.1;
  for (PetscInt k = 0; k < 3; k++)
    for (PetscInt i = 0; i < steps; i++) {
      PetscCall(stepper[k].step(model[k], i * dt, dt));
      if (k == 0 && i == steps / 2) {
        PetscCall(CheckpointCreate(PETSC_COMM_SELF, "test_tools_checkpoint.h5", &file));
        PetscCall(stepper[0].save(model[0], file));
        PetscCall(CheckpointClose(&file));
      }
    }
  PetscCall(CheckpointOpen(PETSC_COMM_SELF, "test_tools_checkpoint.h5", &file));
  PetscCall(stepper[3].load(model[3], file));
  PetscCall(CheckpointClose(&file));
  for (PetscInt i = steps / 2 + 1; i < steps; i++) PetscCall(stepper[3].step(model[3], i * dt, dt));
  PetscCall(CheckSame(model[0], model[1]));
  PetscCall(CheckSame(model[0], model[2]));
  PetscCall(CheckSame(model[0], model[3]));
  PetscCall(stepper[0].energy(model[0], &one));
  PetscCall(stepper[3].energy(model[3], &two));
  for (PetscInt k = 0; k < LEDGER_TERMS; k++) CheckNear(one.energy[k], two.energy[k], 0);
  PetscCall(LedgerNow(model[0], &stepper[0], initial, &error));
  PetscCall(DemModelGetTool(model[0], "drum", &now));
  print_message("           drum turned %.3f rad, %d contacts, work %.4g J, friction %.3g J, ledger %.1e\n", (double)(2 * PetscAcosReal(now.quaternion[0])), (int)now.contacts, (double)now.work, (double)one.energy[LEDGER_FRICTION],
                (double)error);
  CheckBelow(error, 1e-3);
  PetscCall(stepper[0].history(model[0], 3, &work));
  CheckNear(work, now.work, 0);
  PetscCall(DemModelGetState(model[0], &s));
  for (PetscInt p = 0; p < s.n; p++) { /* in the box's own frame every centre is inside */
    const PetscReal *q = now.quaternion;
    PetscReal        w[3], c[3];

    for (PetscInt d = 0; d < 3; d++) w[d] = s.x0[d * s.n + p] + s.u[d * s.n + p] - now.centre[d];
    for (PetscInt d = 0; d < 3; d++) c[d] = q[1 + (d + 1) % 3] * w[(d + 2) % 3] - q[1 + (d + 2) % 3] * w[(d + 1) % 3];
    for (PetscInt d = 0; d < 3; d++) {
      const PetscReal back = w[d] - 2 * q[0] * c[d] + 2 * (q[1 + (d + 1) % 3] * c[(d + 2) % 3] - q[1 + (d + 2) % 3] * c[(d + 1) % 3]) + (d == 0 ? 0.1 : 0);

      CheckBelow(PetscAbsReal(back), 0.51);
    }
  }
  PetscCall(DemModelRestoreState(model[0], &s));
  for (PetscInt k = 0; k < 4; k++) PetscCall(DemModelDestroy(&model[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestDrum)

/* Circle and tube, solid and hollow: a ball at rest inside and outside; a ball in a turning tube is taken along, work = what it gains and loses. */
static PetscErrorCode TestCylinders(void)
{
  const PetscReal x[4][3] = {{0.905, 0, 0.5}, {0, 1.095, 0.2}, {0, 5.3, 3.05}, {4, 5, 2.995}}, r[4] = {0.1, 0.1, 0.1, 0.1}, k = 1e5;
  DemToolOptions  tube = {.shape = DEM_TOOL_CYLINDER, .point = {0, 0, 0.5}, .axis = {0, 0, 2}, .radius = 1, .length = 2, .inside = PETSC_TRUE, .contact = rough};
  DemToolOptions  rod = {.shape = DEM_TOOL_CYLINDER, .point = {0, 5, 0}, .axis = {0, 0, 1}, .radius = 0.3, .length = 6, .contact = rough}, disc = {.shape = DEM_TOOL_DISC, .point = {4, 5, 3.09}, .axis = {0, 0, -1}, .radius = 1, .contact = rough};
  DemToolState    now;
  DemModel        model;
  DemState        s;

  PetscFunctionBeginUser;
  PetscCall(Spheres(3, 4, x, r, 1, &model));
  PetscCall(DemModelAddTool(model, "tube", &tube));
  PetscCall(DemModelAddTool(model, "rod", &rod));
  PetscCall(DemModelAddTool(model, "disc", &disc));
  CheckFails(DemModelAddTool(model, "disc", &disc), PETSC_ERR_USER_INPUT, "Two tools are named 'disc'");
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetState(model, &s));
  for (PetscInt p = 0; p < 4; p++) {
    /* inner side 5 mm deep, outer side 5 mm, on the rim of the rod's end, under the disc 5 mm; curved sides by the radius sqrt(r r') of the pair */
    const PetscReal inner = k * 0.005 / PetscSqrtReal(1 - 0.1), outer = k * 0.005 / PetscSqrtReal(1 + 0.1), rim = k * 0.05;
    const PetscReal want[4][3] = {{-inner, 0, 0}, {0, outer, 0}, {0, 0, rim}, {0, 0, -k * 0.005}};

    for (PetscInt d = 0; d < 3; d++) CheckNear(s.f[d * s.n + p], want[s.number[p]][d], 1e-9 * k);
  }
  PetscCall(DemModelGetTool(model, "rod", &now));
  CheckInt(now.contacts, 1);
  CheckNear(now.torque[0], -(0.3 * k * 0.05), 1e-6);
  PetscCall(DemModelRestoreState(model, &s));
  PetscCall(DemModelDestroy(&model));

  { /* 2D: discs in and on a circle, on a polyline */
    const PetscReal y[3][3] = {{0, -0.905, 0}, {1.095, 0, 0}, {0, 3.09, 0}};
    const PetscReal line[2][2][3] = {{{-1, 3, 0}, {0, 3, 0}}, {{1, 3, 0}, {0, 3, 0}}}, k2 = 1e6 * 0.5;
    DemToolOptions  hole = {.shape = DEM_TOOL_CYLINDER, .radius = 1, .inside = PETSC_TRUE, .contact = rough}, table = {.shape = DEM_TOOL_SURFACE, .contact = rough};

    PetscCall(Spheres(2, 3, y, r, 1, &model));
    PetscCall(DemSurfaceCreate("line", 2, 2, &line[0][0][0], &table.surface));
    PetscCall(DemModelAddTool(model, "table", &table));
    PetscCall(DemModelAddTool(model, "hole", &hole));
    PetscCall(DemModelSetUp(model));
    PetscCall(DemModelGetTool(model, "table", &now));
    CheckInt(now.contacts, 1);
    CheckNear(now.force[1], -k2 * 0.01, 1e-6);
    CheckNear(now.force[0], 0, 1e-6);
    PetscCall(DemModelDestroy(&model));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCylinders)

/* A wheel on a ball: driven by a torque it spins up as T t / I while it is free; with a table it does the work that friction and motion take. */
static PetscErrorCode TestTorque(void)
{
  const PetscReal x[1][3] = {{10, 10, 10}}, r[1] = {0.1}, dt = 1e-3;
  DemToolOptions  o = {.shape = DEM_TOOL_CYLINDER, .axis = {0, 1, 0}, .radius = 1, .length = 1, .contact = rough, .twisted = PETSC_TRUE, .turn_axis = {0, 2, 0}, .inertia = 4};
  DemToolState    now;
  DemModel        model;
  Stepper         stepper;
  PetscReal       error;

  PetscFunctionBeginUser;
  PetscCall(Spheres(3, 1, x, r, 1, &model));
  PetscCall(TableCreateConstant(2, &o.torque));
  o.inertia = 0;
  CheckFails(DemModelAddTool(model, "bad", &o), PETSC_ERR_USER_INPUT, "needs a positive moment of inertia");
  PetscCall(DemModelDestroy(&model));
  PetscCall(Spheres(3, 1, x, r, 1, &model));
  o.inertia = 4;
  PetscCall(DemModelAddTool(model, "wheel", &o));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetStepper(model, &stepper));
  for (PetscInt k = 0; k < 1000; k++) PetscCall(stepper.step(model, k * dt, dt));
  PetscCall(DemModelGetTool(model, "wheel", &now));
  CheckClose(2 * PetscAsinReal(now.quaternion[2]), 0.25, 1e-12); /* T t^2 / 2 I */
  CheckClose(now.spin[1], 0.5 * (1 - 0.5 * dt), 1e-12);
  PetscCall(LedgerNow(model, &stepper, 0, &error));
  CheckBelow(error, 1e-6); /* the first half kick: dt^2 / 8 of the power, eq. (1.5) */
  PetscCall(TableDestroy(&o.torque));
  PetscCall(DemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTorque)

static const struct CMUnitTest tests[] = {TEST(TestIncline), TEST(TestClosedForms), TEST(TestEdgeAndCorner), TEST(TestPlaten), TEST(TestFreeBody), TEST(TestCollision), TEST(TestDrum), TEST(TestCylinders), TEST(TestTorque)};

CHECK_MAIN(tests)
