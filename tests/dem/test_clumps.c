/*
  test_clumps.c - clumps of spheres as rigid bodies: what they weigh, how they turn, fall, hit and roll.  Eqs (5.90)-(5.99)

  Units: density 1000, young 1e7 (tool_cases.h).
*/
#include <unistd.h>
#include "tool_cases.h"

static const PetscReal odd_x[4][3] = {{0, 0, 0}, {0.07, 0.02, 0}, {-0.03, 0.06, 0.05}, {0.01, -0.02, 0.09}}, odd_r[4] = {0.06, 0.05, 0.045, 0.055};

/* Second moments of a sphere cut at height h above its centre, of what lies below, about the centre: axis^2, across^2 (one direction), and volume, first along the axis */
static void Cut(PetscReal r, PetscReal h, PetscReal m[4])
{
  const PetscReal r2 = r * r, h2 = h * h;

  m[0] = PETSC_PI * (r2 * h - h2 * h / 3 + 2 * r2 * r / 3);
  m[1] = PETSC_PI * (r2 * h2 / 2 - h2 * h2 / 4 - r2 * r2 / 4);
  m[2] = PETSC_PI * (r2 * h2 * h / 3 - h2 * h2 * h / 5 + r2 * r2 * r * 2 / 15);
  m[3] = 0.25 * PETSC_PI * (r2 * r2 * h - 2 * r2 * h2 * h / 3 + h2 * h2 * h / 5 + r2 * r2 * r * 8 / 15);
}

/* Two spheres that overlap, of two sizes and at a slant: volume, centre and moments in closed form; touching, apart, one within the other. */
static PetscErrorCode TestTwoSpheres(void)
{
  const PetscReal axis[3] = {2. / 7, -3. / 7, 6. / 7}, r[2] = {0.05, 0.04};
  PetscReal       worst = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 6; i++) {
    const PetscReal apart = (PetscReal[]){0.02, 0.05, 0.07, 0.0899, 0.09, 0.2}[i], h = apart < r[0] + r[1] ? 0.5 * (apart * apart + r[0] * r[0] - r[1] * r[1]) / apart : r[0];
    PetscReal       a[4], b[4], x[6], volume, centre, along, across;
    DemClump        clump;

    Cut(r[0], PetscMin(h, r[0]), a);
    Cut(r[1], PetscMin(apart - h, r[1]), b); /* looking back */
    for (PetscInt d = 0; d < 3; d++) {
      x[d]     = 0.3 - 0.1 * d;
      x[3 + d] = x[d] + apart * axis[d];
    }
    volume = a[0] + b[0];
    centre = (a[1] + apart * b[0] - b[1]) / volume; /* from the first */
    along  = a[2] + apart * apart * b[0] - 2 * apart * b[1] + b[2] - volume * centre * centre;
    across = a[3] + b[3];
    PetscCall(DemClumpCreate(2, x, r, &clump));
    worst = PetscMax(worst, PetscAbsReal(clump.volume / volume - 1));
    CheckClose(clump.volume, volume, 1e-11);
    CheckClose(clump.moments[0], 2 * across, 1e-11);
    CheckClose(clump.moments[1], along + across, 1e-11);
    CheckClose(clump.moments[2], along + across, 1e-11);
    for (PetscInt d = 0; d < 3; d++) {
      CheckNear(clump.x[d], -centre * axis[d], 1e-11);
      CheckNear(clump.axes[d][0] * (clump.axes[0][0] * axis[0] + clump.axes[1][0] * axis[1] + clump.axes[2][0] * axis[2]), axis[d], 1e-9);
    }
    PetscCall(DemClumpDestroy(&clump));
  }
  {
    const PetscReal x[12] = {0, 0, 0, 0.01, 0, 0, 0, 0, 0, 0, 0, 0.05}, radius[4] = {0.05, 0.03, 0.05, 1e-3};
    PetscReal       volume, first[3], second[3][3];

    PetscCall(DemUnionMoments(3, x, radius, &volume, first, second)); /* one hidden, one twice */
    CheckClose(volume, 4 * PETSC_PI / 3 * 1.25e-4, 1e-13);
    CheckClose(second[2][2], volume * 2.5e-3 / 5, 1e-13);
  }
  printf("two spheres: volume to %.1e\n", (double)worst);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTwoSpheres)

/* Any union: the same body turned has the same volume and moments; and points thrown at it agree within what their number allows. */
static PetscErrorCode TestAnyUnion(void)
{
  PetscReal       worst = 0, volume, first[3], second[3][3], count = 0, sum[3] = {0};
  const PetscInt  points = 400000;
  uint64_t        seed = 11;
  DemClump        a, b;

  PetscFunctionBeginUser;
  PetscCall(DemClumpCreate(4, &odd_x[0][0], odd_r, &a));
  for (PetscInt turn = 0; turn < 4; turn++) {
    PetscReal q[4], norm = 0, x[12];

    for (PetscInt d = 0; d < 4; d++) {
      q[d] = TestRandom(&seed) - 0.5;
      norm += q[d] * q[d];
    }
    for (PetscInt d = 0; d < 4; d++) q[d] /= PetscSqrtReal(norm);
    for (PetscInt i = 0; i < 4; i++)
      for (PetscInt d = 0; d < 3; d++) {
        const PetscReal *v = odd_x[i];
        const PetscReal  t[3] = {2 * (q[2] * v[2] - q[3] * v[1]), 2 * (q[3] * v[0] - q[1] * v[2]), 2 * (q[1] * v[1] - q[2] * v[0])};

        x[3 * i + d] = v[d] + q[0] * t[d] + q[1 + (d + 1) % 3] * t[(d + 2) % 3] - q[1 + (d + 2) % 3] * t[(d + 1) % 3];
      }
    PetscCall(DemClumpCreate(4, x, odd_r, &b));
    worst = PetscMax(worst, PetscAbsReal(b.volume / a.volume - 1));
    CheckClose(b.volume, a.volume, 1e-10);
    for (PetscInt d = 0; d < 3; d++) CheckClose(b.moments[d], a.moments[d], 1e-10);
    CheckClose(b.reach, a.reach, 1e-10);
    PetscCall(DemClumpDestroy(&b));
  }
  PetscCall(DemUnionMoments(4, &odd_x[0][0], odd_r, &volume, first, second));
  for (PetscInt k = 0; k < points; k++) {
    const PetscReal y[3] = {-0.1 + 0.25 * TestRandom(&seed), -0.1 + 0.25 * TestRandom(&seed), -0.1 + 0.25 * TestRandom(&seed)};
    PetscBool       in = PETSC_FALSE;

    for (PetscInt i = 0; i < 4; i++) in = (PetscBool)(in || PetscSqr(y[0] - odd_x[i][0]) + PetscSqr(y[1] - odd_x[i][1]) + PetscSqr(y[2] - odd_x[i][2]) < PetscSqr(odd_r[i]));
    if (!in) continue;
    count += 0.015625 / (PetscReal)points;
    sum[0] += 0.015625 / (PetscReal)points * y[0];
    sum[1] += 0.015625 / (PetscReal)points * y[1] * y[1];
    sum[2] += 0.015625 / (PetscReal)points * y[0] * y[2];
  }
  CheckClose(count, volume, 0.015); /* four deviations of a count of 6 % of the points */
  CheckNear(sum[0], first[0], 0.015 * volume * 0.1);
  CheckClose(sum[1], second[1][1], 0.03);
  CheckNear(sum[2], second[0][2], 0.015 * volume * 0.01);
  printf("four spheres, turned: volume to %.1e\n", (double)worst);
  PetscCall(DemClumpDestroy(&a));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestAnyUnion)

static PetscErrorCode Clumps(const DemClump *shape, PetscInt n, const PetscReal centre[][3], const PetscReal q[4], PetscInt threads, DemModel *model, DemClumpPlace *place)
{
  PetscReal(*x)[3], *r;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n * shape->n, &x, n * shape->n, &r));
  for (PetscInt k = 0; k < n; k++) {
    DemPacking     ball = {.n = 1}, members;
    DemClumpPlace *one;

    PetscCall(PetscMalloc1(3, &ball.x));
    PetscCall(PetscMalloc1(1, &ball.r));
    for (PetscInt d = 0; d < 3; d++) ball.x[d] = centre[k][d];
    ball.r[0] = shape->reach;
    PetscCall(DemPackingMakeClumps(&ball, shape, (PetscBool)!q, 7 + k, &members, &one));
    place[k]       = one[0];
    place[k].first = k * shape->n;
    for (PetscInt i = 0; i < shape->n; i++) {
      for (PetscInt d = 0; d < 3; d++) x[place[k].first + i][d] = members.x[3 * i + d];
      r[place[k].first + i] = members.r[i];
    }
    PetscCall(PetscFree(one));
    PetscCall(DemPackingDestroy(&ball));
    PetscCall(DemPackingDestroy(&members));
  }
  PetscCall(Spheres(3, n * shape->n, (const PetscReal(*)[3])x, r, threads, model));
  PetscCall(DemModelSetClumps(*model, n, place));
  PetscCall(PetscFree2(x, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Balance(const Ledger *l)
{
  PetscReal sum = -l->energy[LEDGER_WORK];

  for (PetscInt k = 0; k < LEDGER_WORK; k++) sum += l->energy[k];
  return sum;
}

/* Free and spinning about no axis of its own: momentum to rounding, energy bounded and of second order, the axes' motion of second order. */
static PetscErrorCode TestFreeSpin(void)
{
  const PetscReal none[1][3] = {{0, 0, 0}}, straight[4] = {1, 0, 0, 0}, v[3] = {0.3, -0.2, 0.1}, spin[3] = {3, 7, -5};
  PetscReal       swing[3], end[3][4];
  DemClump        shape;

  PetscFunctionBeginUser;
  PetscCall(DemClumpCreate(4, &odd_x[0][0], odd_r, &shape));
  for (PetscInt run = 0; run < 3; run++) {
    const PetscInt steps = 2000 << run;
    DemModel       model;
    DemClumpPlace  place;
    DemClumpState  first, now;
    Stepper        stepper;
    Ledger         ledger;
    PetscReal      start, low = PETSC_MAX_REAL, high = 0, size = 0;

    PetscCall(Clumps(&shape, 1, none, straight, 1, &model, &place));
    PetscCall(DemModelSetUp(model));
    PetscCall(DemModelSetClumpMotion(model, 0, v, spin));
    PetscCall(DemModelGetStepper(model, &stepper));
    PetscCall(DemModelGetClump(model, 0, &first));
    CheckClose(first.mass, 1000 * shape.volume, 1e-14);
    PetscCall(stepper.energy(model, &ledger));
    start = ledger.energy[LEDGER_KINETIC];
    for (PetscInt d = 0; d < 3; d++) size = PetscMax(size, PetscAbsReal(first.momentum[d]));
    for (PetscInt s = 0; s < steps; s++) {
      PetscCall(stepper.step(model, 10.0 * s / steps, 10.0 / steps));
      PetscCall(stepper.energy(model, &ledger));
      low  = PetscMin(low, ledger.energy[LEDGER_KINETIC]);
      high = PetscMax(high, ledger.energy[LEDGER_KINETIC]);
    }
    PetscCall(DemModelGetClump(model, 0, &now));
    for (PetscInt d = 0; d < 3; d++) {
      CheckNear(now.momentum[d], first.momentum[d], 1e-12 * size);
      CheckNear(now.velocity[d], v[d], 1e-15);
      CheckNear(now.centre[d], first.centre[d] + 10 * v[d], 1e-12);
    }
    swing[run] = PetscMax(high - start, start - low) / start;
    CheckBelow(swing[run], 2e-3 / PetscSqr(1 << run));
    for (PetscInt d = 0; d < 4; d++) end[run][d] = now.quaternion[d];
    PetscCall(DemModelDestroy(&model));
  }
  {
    PetscReal coarse = 0, fine = 0;

    for (PetscInt d = 0; d < 4; d++) {
      coarse = PetscMax(coarse, PetscAbsReal(end[0][d] - end[1][d]));
      fine   = PetscMax(fine, PetscAbsReal(end[1][d] - end[2][d]));
    }
    printf("free spin: energy within %.1e, %.1e, %.1e; attitude off by %.1e, %.1e\n", (double)swing[0], (double)swing[1], (double)swing[2], (double)coarse, (double)fine);
    CheckAbove(log2((double)(coarse / fine)), 1.9);
    CheckAbove(log2((double)(swing[0] / swing[2])), 3.6); /* two halvings */
  }
  PetscCall(DemClumpDestroy(&shape));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFreeSpin)

/* A rod of two spheres lands flat on one of them, no friction: J = (1 + e) v m, 1/m = 1/M + b^2/I, as the contact gets stiffer. */
static PetscErrorCode TestDumbbellHits(void)
{
  const PetscReal x[6] = {-0.1, 0, 0, 0.1, 0, 0}, r[2] = {0.06, 0.06}, straight[4] = {1, 0, 0, 0}, at[1][3] = {{0.1, 0, 0.0601}}, down[3] = {0, 0, -1}, still[3] = {0, 0, 0};
  PetscReal       off[2];
  DemClump        shape;

  PetscFunctionBeginUser;
  PetscCall(DemClumpCreate(2, x, r, &shape));
  for (PetscInt run = 0; run < 2; run++) {
    const DemContactChoice  choice = {.stiffness = run ? 16e9 : 1e9, .ratio = 0.5, .restitution = 1};
    const DemContactOptions among  = {.choice = choice};
    DemToolOptions          floor  = {.shape = DEM_TOOL_SURFACE, .contact = choice};
    DemModel                model;
    DemClumpPlace           place;
    DemClumpState           now;
    Stepper                 stepper;
    Ledger                  ledger;
    PetscReal               dt, t = 0, m, b = 0.1, about = 1000 * shape.moments[1], J, start;

    PetscCall(Clumps(&shape, 1, at, straight, 1, &model, &place));
    PetscCall(DemModelSetContact(model, &among));
    PetscCall(DemSurfaceCreateBox(3, (PetscReal[3]){0.1, -1, -1}, (PetscReal[3]){1, 1, 0}, &floor.surface)); /* under the second sphere alone */
    PetscCall(DemModelAddTool(model, "floor", &floor));
    PetscCall(DemModelSetUp(model));
    PetscCall(DemModelSetClumpMotion(model, 0, down, still));
    PetscCall(DemModelGetStableStep(model, &dt));
    dt *= 0.5;
    PetscCall(DemModelGetStepper(model, &stepper));
    PetscCall(stepper.energy(model, &ledger));
    start = Balance(&ledger);
    for (; t < 4e-3; t += dt) PetscCall(stepper.step(model, t, dt));
    PetscCall(stepper.energy(model, &ledger));
    CheckClose(Balance(&ledger), start, 1e-3);
    PetscCall(DemModelGetClump(model, 0, &now));
    m        = 1 / (1 / now.mass + b * b / about);
    J        = 2 * m;
    off[run] = PetscMax(PetscAbsReal(now.velocity[2] - (-1 + J / now.mass)), PetscAbsReal(now.momentum[1] - (-b * J)) / (b * J));
    CheckBelow(off[run], 1e-4); /* the step's; the body turns by less than 1e-4 while it touches */
    PetscCall(DemModelDestroy(&model));
  }
  printf("dumbbell: off by %.1e, at 16 times the stiffness %.1e\n", (double)off[0], (double)off[1]);
  PetscCall(DemClumpDestroy(&shape));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestDumbbellHits)

/* A peanut rolls about its long axis down a slope without slipping: a = g sin/(1 + I/(M r^2)), I of the union, not of its spheres. */
static PetscErrorCode TestRollsDown(void)
{
  const PetscReal x[6] = {0, -0.03, 0, 0, 0.03, 0}, r[2] = {0.05, 0.05}, straight[4] = {1, 0, 0, 0}, angle = 0.2, at[1][3] = {{0, 0, 0.05}};
  const PetscReal g[3] = {9.81 * PetscSinReal(angle), 0, -9.81 * PetscCosReal(angle)};
  const DemContactChoice  choice = {.stiffness = 1e8, .ratio = 0.8, .restitution = 0.5, .friction = 0.5};
  const DemContactOptions among  = {.choice = choice};
  DemToolOptions          floor  = {.shape = DEM_TOOL_PLANE, .axis = {0, 0, 1}, .contact = choice};
  DemClump                shape;
  DemModel                model;
  DemClumpPlace           place;
  DemClumpState           now;
  Stepper                 stepper;
  Ledger                  ledger;
  PetscReal               dt, t = 0, want, start, worst = 0, energy;

  PetscFunctionBeginUser;
  PetscCall(DemClumpCreate(2, x, r, &shape));
  PetscCall(Clumps(&shape, 1, at, straight, 1, &model, &place));
  PetscCall(DemModelSetContact(model, &among));
  PetscCall(DemModelSetGravity(model, g));
  PetscCall(DemModelAddTool(model, "floor", &floor));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetStableStep(model, &dt));
  dt *= 0.9;
  PetscCall(DemModelGetStepper(model, &stepper));
  PetscCall(stepper.energy(model, &ledger));
  start = Balance(&ledger);
  for (; t < 0.5; t += dt) {
    PetscCall(stepper.step(model, t, dt));
    PetscCall(stepper.energy(model, &ledger));
    worst = PetscMax(worst, PetscAbsReal(Balance(&ledger) - start));
  }
  energy = ledger.energy[LEDGER_KINETIC];
  PetscCall(DemModelGetClump(model, 0, &now));
  want = g[0] / (1 + shape.moments[0] / (shape.volume * r[0] * r[0]));
  printf("rolls down: %.6f of the closed form, energy off by %.1e of what it has\n", (double)(now.centre[0] / (0.5 * want * t * t)), (double)(worst / energy));
  CheckClose(now.centre[0], 0.5 * want * t * t, 1e-3);
  CheckClose(now.velocity[0], want * (t - 0.5 * dt), 1e-3);
  CheckNear(now.centre[1], 0, 1e-9);
  CheckBelow(worst, 1e-3 * energy);
  PetscCall(DemClumpDestroy(&shape));
  PetscCall(DemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRollsDown)

/* Eight odd clumps fall into a box and on each other: momentum of pairs, energy within 0.1 %, one and two threads and a resume the same bits. */
static PetscErrorCode TestHeap(void)
{
  const DemContactChoice  choice = {.stiffness = 1e6, .restitution = 0.6, .friction = 0.4};
  const DemContactOptions among  = {.choice = choice};
  const PetscReal         g[3] = {0, 0, -9.81}, v[3] = {0.1, 0.2, -2};
  PetscReal               at[8][3], dt, worst = 0, start = 0, most = 0;
  DemClump                shape;
  DemModel                model[3];
  DemClumpPlace           place[3][8];
  Stepper                 stepper[3];
  char                    file[64];
  PetscInt                steps, half;

  PetscFunctionBeginUser;
  PetscCall(DemClumpCreate(4, &odd_x[0][0], odd_r, &shape));
  PetscCall(BaseFormat(file, "/tmp/clumps-%d.h5", (int)getpid()));
  for (PetscInt k = 0; k < 8; k++)
    for (PetscInt d = 0; d < 3; d++) at[k][d] = 0.16 + 0.27 * (k >> d & 1);
  for (PetscInt m = 0; m < 3; m++) {
    DemToolOptions box = {.shape = DEM_TOOL_SURFACE, .contact = choice};

    PetscCall(Clumps(&shape, 8, (const PetscReal(*)[3])at, NULL, m == 1 ? 2 : 1, &model[m], place[m]));
    PetscCall(DemModelSetContact(model[m], &among));
    PetscCall(DemModelSetGravity(model[m], g));
    PetscCall(DemModelSetInitialVelocity(model[m], v));
    PetscCall(DemSurfaceCreateBox(3, (PetscReal[3]){0, 0, 0}, (PetscReal[3]){0.6, 0.6, 2}, &box.surface));
    PetscCall(DemModelAddTool(model[m], "box", &box));
    PetscCall(DemModelSetUp(model[m]));
    PetscCall(DemModelGetStepper(model[m], &stepper[m]));
  }
  PetscCall(DemModelGetStableStep(model[0], &dt));
  dt *= 0.9;
  half  = (PetscInt)(0.12 / dt);
  steps = 2 * half;
  for (PetscInt s = 0; s < steps; s++) {
    Ledger     ledger;
    Checkpoint checkpoint;

    for (PetscInt m = 0; m < (s < half ? 2 : 3); m++) PetscCall(stepper[m].step(model[m], s * dt, dt));
    PetscCall(stepper[0].energy(model[0], &ledger));
    if (!s) start = Balance(&ledger);
    worst = PetscMax(worst, PetscAbsReal(Balance(&ledger) - start));
    most  = PetscMax(most, ledger.energy[LEDGER_KINETIC]);
    if (s + 1 != half) continue;
    CheckAbove(ledger.energy[LEDGER_CONTACT] + ledger.energy[LEDGER_FRICTION], 0.01 * start);
    PetscCall(CheckpointCreate(PETSC_COMM_SELF, file, &checkpoint));
    PetscCall(stepper[0].save(model[0], checkpoint));
    PetscCall(CheckpointClose(&checkpoint));
    PetscCall(CheckpointOpen(PETSC_COMM_SELF, file, &checkpoint));
    PetscCall(stepper[2].load(model[2], checkpoint));
    PetscCall(CheckpointClose(&checkpoint));
    unlink(file);
  }
  for (PetscInt m = 1; m < 3; m++)
    for (PetscInt k = 0; k < 8; k++) {
      DemClumpState a, b;

      PetscCall(DemModelGetClump(model[0], k, &a));
      PetscCall(DemModelGetClump(model[m], k, &b));
      assert_memory_equal(&a, &b, sizeof(a));
    }
  {
    DemState      state;
    DemClumpState a;
    PetscReal     gap = 0;

    PetscCall(DemModelGetState(model[0], &state)); /* the spheres have not come apart */
    PetscCall(DemModelGetClump(model[0], 0, &a));
    for (PetscInt p = 0; p < state.n; p++)
      for (PetscInt q = 0; q < state.n; q++)
        if (state.number[p] / 4 == state.number[q] / 4) {
          PetscReal d2 = 0, e2 = 0;

          for (PetscInt d = 0; d < 3; d++) {
            d2 += PetscSqr(state.x0[d * state.n + p] + state.u[d * state.n + p] - state.x0[d * state.n + q] - state.u[d * state.n + q]);
            e2 += PetscSqr(odd_x[state.number[p] % 4][d] - odd_x[state.number[q] % 4][d]);
          }
          gap = PetscMax(gap, PetscAbsReal(PetscSqrtReal(d2) - PetscSqrtReal(e2)));
        }
    CheckBelow(gap, 1e-14);
    PetscCall(DemModelRestoreState(model[0], &state));
  }
  printf("heap: energy off by %.1e of the largest kinetic energy, %d steps\n", (double)(worst / most), (int)steps);
  CheckBelow(worst, 1e-3 * most);
  for (PetscInt m = 0; m < 3; m++) PetscCall(DemModelDestroy(&model[m]));
  PetscCall(DemClumpDestroy(&shape));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestHeap)

/* Given mass and moments scale with the size; what belongs to no body is refused. */
static PetscErrorCode TestGiven(void)
{
  const PetscReal x[6] = {-0.1, 0, 0, 0.1, 0, 0}, r[2] = {0.06, 0.06}, centre[3] = {0.02, 0, 0}, moments[3] = {0.004, 0.02, 0.021}, none[3] = {0.01, 0.02, 0.04}, straight[4] = {1, 0, 0, 0}, at[1][3] = {{0, 0, 0}};
  DemClump        shape;
  DemClumpPlace   place;
  DemModel        model;
  DemClumpState   state;

  PetscFunctionBeginUser;
  PetscCall(DemClumpCreateGiven(2, x, r, 3, centre, moments, &shape));
  CheckClose(shape.reach, 0.18, 1e-14);
  PetscCall(Clumps(&shape, 1, at, straight, 1, &model, &place));
  place.scale = 2;
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetClump(model, 0, &state));
  CheckClose(state.mass, 24, 1e-14);
  for (PetscInt d = 0; d < 3; d++) CheckClose(state.moments[d], 32 * moments[d], 1e-14);
  PetscCall(DemModelDestroy(&model));
  PetscCall(DemClumpDestroy(&shape));
  CheckFails(DemClumpCreateGiven(2, x, r, 3, centre, none, &shape), PETSC_ERR_USER_INPUT, "belong to no body");
  CheckFails(DemClumpCreate(2, x, centre, &shape), PETSC_ERR_USER_INPUT, "must be positive");
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestGiven)

static const struct CMUnitTest tests[] = {TEST(TestTwoSpheres), TEST(TestAnyUnion), TEST(TestFreeSpin), TEST(TestDumbbellHits), TEST(TestRollsDown), TEST(TestHeap), TEST(TestGiven)};
CHECK_MAIN(tests)
