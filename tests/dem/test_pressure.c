/* Pressure that ends on pieces that have come off.  docs/theory.md (4.88) */
#include "check.h"
#include "dem_impl.h" /* forces of single facets */
#include "dem_solve.h"
#include <unistd.h>

#define YOUNG 37e9
#define H     0.1 /* edge of a cell [m] */
#define P     1e4 /* [Pa] */

/* A row of n cells along x that can break, held at x = 0, pressed on the face named; held: at its other end too, drawn away at this speed [m/s]. */
static PetscErrorCode Row(PetscInt dim, PetscInt n, const char *pressed, PetscReal drawn, TestBody *body, DemModel *model)
{
  const PetscReal   low[3] = {0}, size[3] = {n * H, H, H};
  const DemStrength strength = {.tensile = 3.9e6, .fracture_energy = 143, .softening = DEM_SOFTENING_LINEAR, .mu_static = 0.6, .mu_dynamic = 0.4};
  Table             still, pull, pressure;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(body, sizeof(*body)));
  PetscCall(DemBodyCreateBox(dim, low, size, 1, &body->body));
  body->packing.n = n;
  PetscCall(PetscCalloc1(3 * n, &body->packing.x));
  PetscCall(PetscMalloc1(n, &body->packing.r));
  for (PetscInt k = 0; k < n; k++) {
    body->packing.r[k]     = 0.5 * H;
    body->packing.x[3 * k] = (k + 0.5) * H;
    for (PetscInt d = 1; d < dim; d++) body->packing.x[3 * k + d] = 0.5 * H;
  }
  PetscCall(DemCellsCreate(&body->body, &body->packing, &body->cells));
  PetscCall(TestModelCreate(body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS, YOUNG, 0, model));
  PetscCall(DemModelSetStrength(*model, &strength));
  PetscCall(TableCreateConstant(0, &still));
  PetscCall(TableCreateConstant(drawn, &pull));
  PetscCall(TableCreateConstant(P, &pressure));
  for (PetscInt d = 0; d < dim; d++) {
    PetscCall(DemModelFix(*model, "xmin", d, DEM_VELOCITY, &still));
    if (drawn > 0) PetscCall(DemModelFix(*model, "xmax", d, DEM_VELOCITY, d == 0 ? &pull : &still));
  }
  PetscCall(DemModelAddPressure(*model, pressed, &pressure));
  PetscCall(DemModelSetUp(*model));
  PetscCall(TableDestroy(&still));
  PetscCall(TableDestroy(&pull));
  PetscCall(TableDestroy(&pressure));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Total(const Ledger *ledger)
{
  const PetscReal *e = ledger->energy;

  return e[LEDGER_KINETIC] + e[LEDGER_STRAIN] + e[LEDGER_FRACTURE] + e[LEDGER_FRICTION] + e[LEDGER_DAMPING] - e[LEDGER_WORK];
}

/* Row of particle `number`, and its state. */
static PetscErrorCode Where(DemModel model, PetscInt number, DemState *st, PetscInt *row)
{
  PetscFunctionBegin;
  PetscCall(DemModelGetState(model, st));
  for (PetscInt p = 0; p < st->n; p++)
    if (st->number[p] == number) *row = p;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  The last of three cells flies off at 200 m/s against its pressure, p/(rho h) = 1e5 m/s2 (density 1). That ends when it is a radius away, within 50 steps; from
  then on its speed is what p left it, v0^2 - 2 a s. Left on, the pressure would bring it back.
*/
static PetscErrorCode TestThrownOff(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    TestBody  body;
    DemModel  model;
    DemState  st;
    Stepper   s;
    Ledger    ledger;
    PetscInt  last = 0, k = 0;
    PetscReal dt, start, speed = 200, now = 0, a = P / H, far = 0;

    PetscCall(Row(dim, 3, "xmax", 0, &body, &model));
    PetscCall(DemModelGetStepper(model, &s));
    PetscCall(s.stable_step(model, &dt));
    dt *= 0.01; /* the crack opens in 0.4 us */
    PetscCall(Where(model, 2, &st, &last));
    st.v[last] = speed;
    PetscCall(DemModelRestoreState(model, &st));
    PetscCall(s.energy(model, &ledger));
    start = Total(&ledger);
    for (; far < 2 * H; k++) {
      PetscReal force;

      PetscCall(s.step(model, k * dt, dt));
      PetscCall(DemModelGetState(model, &st));
      far   = st.u[last];
      now   = st.v[last];
      force = st.f[last];
      if (far > 0.1 * H && far < 0.5 * H) CheckClose(force, -P * (dim == 3 ? H * H : H), 1e-12);
      if (far > 0.5 * H + 51 * dt * 200) CheckNear(force, 0, 0);
      if (far < 0.5 * H) speed = now;
      PetscCall(DemModelRestoreState(model, &st));
    }
    CheckNear(now, speed, 52 * dt * a); /* not past the next look */
    CheckAbove(now, 100);
    PetscCall(s.energy(model, &ledger));
    CheckNear(Total(&ledger), start, 1e-3 * start);
    PetscCall(DemModelDestroy(&model));
    PetscCall(TestBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestThrownOff)

/* A cell that only turns round loses its pressure beyond 60 degrees, not before: it would be driven where its facet then looks. */
static PetscErrorCode TestTurned(void)
{
  TestBody  body;
  DemModel  model;
  DemState  st;
  Stepper   s;
  PetscInt  last = 0;
  PetscReal dt, turn = 0;

  PetscFunctionBeginUser;
  PetscCall(Row(2, 3, "xmax", 0, &body, &model));
  PetscCall(DemModelGetStepper(model, &s));
  PetscCall(s.stable_step(model, &dt));
  PetscCall(Where(model, 2, &st, &last));
  st.v[last]    = 200;
  st.spin[last] = 1e4; /* a third of a turn before it is a radius away */
  PetscCall(DemModelRestoreState(model, &st));
  for (PetscInt k = 0; turn < 2; k++) {
    PetscCall(s.step(model, k * 0.2 * dt, 0.2 * dt));
    PetscCall(DemModelGetState(model, &st));
    turn = st.rot[2 * st.n + last];
    CheckBelow(st.u[last], 0.5 * H); /* it is not the distance */
    if (turn > 0.7 && turn < PETSC_PI / 3) CheckClose(PetscSqrtReal(PetscSqr(st.f[last]) + PetscSqr(st.f[st.n + last])), P * H, 1e-9);
    if (turn > PETSC_PI / 3 + 51 * 0.2 * dt * 1e4) CheckNear(st.f[last], 0, 0);
    PetscCall(DemModelRestoreState(model, &st));
  }
  PetscCall(DemModelDestroy(&model));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTurned)

/* A row drawn apart between two platens: both halves go on bearing the pressure on their sides, however far they are. */
static PetscErrorCode TestHalves(void)
{
  TestBody  body;
  DemModel  model;
  Stepper   s;
  PetscInt  parts, part[6];
  PetscReal dt;

  PetscFunctionBeginUser;
  PetscCall(Row(2, 6, "ymax", 40, &body, &model));
  PetscCall(DemModelGetStepper(model, &s));
  PetscCall(s.stable_step(model, &dt));
  for (PetscInt k = 0; k * 0.4 * dt * 40 < 2 * H; k++) PetscCall(s.step(model, k * 0.4 * dt, 0.4 * dt));
  PetscCall(DemModelGetFragments(model, &parts, part));
  CheckTrue(part[0] != part[5]);
  for (PetscInt i = 0; i < model->walls.n; i++) {
    const PetscInt mine = part[model->at[model->walls.owner[i]]];
    PetscReal      t[3];

    if (model->walls.kind[i] != DEM_WALL_TRACTION || (mine != part[0] && mine != part[5])) continue;
    DemFacetForce_Internal(model, i, t);
    CheckClose(PetscSqrtReal(t[0] * t[0] + t[1] * t[1]), P * H, 1e-12);
  }
  PetscCall(DemModelDestroy(&model));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestHalves)

/* A run that goes on from a checkpoint between two looks knows which pressure has ended: same bits. */
static PetscErrorCode TestResumed(void)
{
  char       name[64];
  TestBody   body[2];
  DemModel   model[2];
  DemState   st[2];
  Stepper    s[2];
  Checkpoint file;
  PetscInt   last = 0, k = 0;
  PetscReal  dt, far = 0;

  PetscFunctionBeginUser;
  (void)snprintf(name, sizeof(name), "test_pressure_%d.h5", (int)getpid());
  for (PetscInt r = 0; r < 2; r++) {
    PetscCall(Row(2, 3, "xmax", 0, &body[r], &model[r]));
    PetscCall(DemModelGetStepper(model[r], &s[r]));
  }
  PetscCall(s[0].stable_step(model[0], &dt));
  dt *= 0.4;
  PetscCall(Where(model[0], 2, &st[0], &last));
  st[0].v[last] = 200;
  for (; far < 0.7 * H || k % 50 != 17; k++) {
    PetscCall(s[0].step(model[0], k * dt, dt));
    far = st[0].u[last];
  }
  CheckNear(st[0].f[last], 0, 0);
  PetscCall(DemModelRestoreState(model[0], &st[0]));
  PetscCall(CheckpointCreate(PETSC_COMM_SELF, name, &file));
  PetscCall(s[0].save(model[0], file));
  PetscCall(CheckpointClose(&file));
  PetscCall(CheckpointOpen(PETSC_COMM_SELF, name, &file));
  PetscCall(s[1].load(model[1], file));
  PetscCall(CheckpointClose(&file));
  unlink(name);
  for (PetscInt r = 0; r < 2; r++) {
    for (PetscInt i = 0; i < 20; i++) PetscCall(s[r].step(model[r], (k + i) * dt, dt));
    PetscCall(DemModelGetState(model[r], &st[r]));
  }
  CheckTrue(!memcmp(st[0].u, st[1].u, 9 * sizeof(PetscReal)));
  CheckTrue(!memcmp(st[0].v, st[1].v, 9 * sizeof(PetscReal)));
  for (PetscInt r = 0; r < 2; r++) {
    PetscCall(DemModelRestoreState(model[r], &st[r]));
    PetscCall(DemModelDestroy(&model[r]));
    PetscCall(TestBodyDestroy(&body[r]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestResumed)

static const struct CMUnitTest tests[] = {TEST(TestThrownOff), TEST(TestTurned), TEST(TestHalves), TEST(TestResumed)};

CHECK_MAIN(tests)
