/*
  A model on several ranks beside its twin on one, in the same program: every rank also runs the whole body alone. Particles
  have the same bits, bonds break in the same steps, sums over the ranks agree to rounding.
*/
#include "check.h"
#include "checkpoint.h"
#include "dem_solve.h"
#include <unistd.h>

#define SAFETY 0.9 /* of the critical step */

typedef enum { ELASTIC, COHESIVE, NONLOCAL, SPRINGS, POISSON, CASES } Case;

typedef struct {
  PetscInt dim, steps;
  Case     what;
  PetscBool groups; /* two that only touch */
  PetscInt  migrate; /* steps after which owners change, 0: never */
} Setting;

static PetscErrorCode Body(PetscInt dim, TestBody *body)
{
  const PetscReal size[3] = {1, 1.1, 2};

  return TestBodyCreate(dim, size, dim == 3 ? 10 : 32, 0.5, 5, body);
}

static PetscErrorCode Model(MPI_Comm comm, const TestBody *body, const Setting *s, PetscInt threads, DemModel *model)
{
  const PetscReal   pull[3] = {0, 1e-4, 2e-4}, gravity[3] = {1e-5, -2e-5, 0}, t[3] = {0, 1, 4}, v[3] = {0, 4e-3, 4e-3}, back[3] = {0, -3e-3, -3e-3};
  const DemMaterial material = {1, 1, s->what == SPRINGS ? 0.2 : 0.25};
  const DemKind     kind = s->dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS;
  const char       *ends[2] = {s->dim == 3 ? "zmin" : "ymin", s->dim == 3 ? "zmax" : "ymax"};
  const PetscBool   springs = (PetscBool)(s->what == SPRINGS || s->what == POISSON);
  DemStrength       strength = {.tensile = 1e-3, .fracture_energy = 1e-6, .shear = 3e-3, .shear_energy = 1e-4, .mu_static = 0.5, .mu_dynamic = 0.3};
  DemRule           rule = {.elasticity = DEM_KDEM, .normal_factor = 1, .shear_factor = 1, .poisson_term = (PetscBool)(s->what == POISSON)};
  Table             ramp, other, one;

  PetscFunctionBegin;
  PetscCall(DemModelCreate(comm, model));
  PetscCall(DemModelSetKind(*model, kind));
  PetscCall(DemModelSetThreads(*model, threads));
  PetscCall(DemModelSetMaterial(*model, &material));
  PetscCall(DemModelSetBody(*model, &body->body, &body->packing, &body->cells));
  if (springs) PetscCall(DemModelSetRule(*model, &rule));
  strength.published = springs;
  strength.nonlocal  = (PetscBool)(s->what == NONLOCAL);
  if (s->what != ELASTIC) PetscCall(DemModelSetStrength(*model, &strength));
  if (s->groups) {
    PetscInt *group;

    PetscCall(PetscMalloc1(body->packing.n, &group));
    for (PetscInt p = 0; p < body->packing.n; p++) group[p] = body->packing.x[3 * p] > 0.5;
    PetscCall(DemModelSetGroups(*model, group));
    PetscCall(PetscFree(group));
  }
  PetscCall(TableCreate(3, t, v, &ramp));
  PetscCall(TableCreate(3, t, back, &other));
  PetscCall(TableCreateConstant(1, &one));
  for (PetscInt d = 0; d < s->dim; d++) {
    Table zero;

    PetscCall(TableCreateConstant(0, &zero));
    PetscCall(DemModelFix(*model, ends[0], d, DEM_VELOCITY, d == s->dim - 1 ? &other : &zero));
    PetscCall(TableDestroy(&zero));
  }
  PetscCall(DemModelFix(*model, ends[1], s->dim - 1, DEM_VELOCITY, &ramp)); /* a smooth platen */
  PetscCall(DemModelAddTraction(*model, "xmax", pull, &one));
  PetscCall(DemModelAddPressure(*model, "xmin", &ramp));
  PetscCall(DemModelSetGravity(*model, gravity));
  PetscCall(DemModelSetLocalDamping(*model, 0.1));
  PetscCall(DemModelAddHistory(*model, "reaction", ends[1]));
  PetscCall(DemModelAddHistory(*model, "displacement", "xmax"));
  PetscCall(DemModelAddHistory(*model, "velocity", "xmin"));
  PetscCall(DemModelAddColumns(*model, "gauge"));
  PetscCall(DemModelAddColumns(*model, "quality"));
  PetscCall(TableDestroy(&ramp));
  PetscCall(TableDestroy(&other));
  PetscCall(TableDestroy(&one));
  PetscCall(DemModelSetUp(*model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Energies and columns of the history: sums in another order. */
static PetscErrorCode SameSums(DemModel part, DemModel whole)
{
  Stepper a, b;
  Ledger  la, lb;

  PetscFunctionBegin;
  PetscCall(TestSameEnergies(part, whole, &la, &lb));
  PetscCall(DemModelGetStepper(part, &a));
  PetscCall(DemModelGetStepper(whole, &b));
  CheckClose(la.work_in, lb.work_in, 1e-12);
  CheckClose(la.scale, lb.scale, 1e-12);
  CheckInt(a.n_history, b.n_history);
  for (PetscInt i = 0; i < a.n_history; i++) {
    PetscReal x, y;

    PetscCall(a.history(part, i, &x));
    PetscCall(b.history(whole, i, &y));
    CheckNear(x, y, 1e-9 * (PetscAbsReal(y) + 1e-6)); /* slopes and ratios of small numbers */
  }
  {
    PetscReal x, y;

    PetscCall(a.unbalanced(part, &x));
    PetscCall(b.unbalanced(whole, &y));
    CheckClose(x, y, 1e-11);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same facets, broken as far, since the same instant; returns how many bonds between two ranks are broken. */
static PetscErrorCode SameCracks(DemModel part, DemModel whole, PetscInt *broken, PetscInt *between)
{
  PetscMPIInt rank;
  DemCracks   a, b;
  DemBondList list;
  DemShare    share;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(DemModelGetCracks(part, &a));
  PetscCall(DemModelGetCracks(whole, &b));
  CheckInt(a.n, rank ? 0 : b.n);
  *broken = 0;
  for (PetscInt k = 0; k < b.n; k++) *broken += b.broken[k] > 0.99;
  for (PetscInt k = 0; k < a.n; k++) {
    PetscReal at[2][3], normal[2][3], area[2];

    CheckInt(a.facet[k], b.facet[k]);
    CheckInt(a.mode[k], b.mode[k]);
    CheckNear(a.time[k], b.time[k], 0);
    CheckNear(a.damage[k], b.damage[k], 0);
    CheckNear(a.opening[k], b.opening[k], 0);
    CheckNear(a.slide[k], b.slide[k], 0);
    CheckNear(a.work[k], b.work[k], 0);
    PetscCall(DemModelGetCrackPlace(part, k, at[0], normal[0], &area[0]));
    PetscCall(DemModelGetCrackPlace(whole, k, at[1], normal[1], &area[1]));
    CheckNear(area[0], area[1], 0);
    for (PetscInt d = 0; d < 3; d++) {
      CheckNear(at[0][d], at[1][d], 0);
      CheckNear(normal[0][d], normal[1][d], 0);
    }
  }
  PetscCall(DemModelGetShare(part, &share));
  PetscCall(DemModelGetBonds(part, &list));
  *between = 0;
  for (PetscInt k = 0; k < list.n; k++) *between += list.state[k] >= 2 && (list.p[k] >= share.own || list.q[k] >= share.own);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, between, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Compare(const Setting *s)
{
  TestBody body;
  DemModel part, whole;
  PetscInt broken, between;

  PetscFunctionBegin;
  PetscCall(Body(s->dim, &body));
  PetscCall(Model(PETSC_COMM_WORLD, &body, s, 1, &part));
  PetscCall(Model(PETSC_COMM_SELF, &body, s, 1, &whole));
  PetscCall(TestSameState(part, whole));
  if (s->migrate) PetscCall(TestStepsMigrating(part, SAFETY, 0, s->steps, s->migrate));
  else PetscCall(TestSteps(part, SAFETY, 0, s->steps));
  PetscCall(TestSteps(whole, SAFETY, 0, s->steps));
  PetscCall(TestSameState(part, whole));
  PetscCall(SameSums(part, whole));
  if (s->what != ELASTIC) {
    PetscCall(SameCracks(part, whole, &broken, &between));
    CheckAbove(broken, 20);
    CheckAbove(between, 1);
  }
  PetscCall(DemModelDestroy(&part));
  PetscCall(DemModelDestroy(&whole));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestElastic(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(&(Setting){.dim = 2, .steps = 100, .what = ELASTIC}));
  PetscCall(Compare(&(Setting){.dim = 3, .steps = 40, .what = ELASTIC}));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestElastic)

/* Torn by its ends: cracks run across the ranks, open and, where groups meet, closed and rubbing. */
static PetscErrorCode TestBreaking(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(&(Setting){.dim = 2, .steps = 300, .what = COHESIVE, .groups = PETSC_TRUE}));
  PetscCall(Compare(&(Setting){.dim = 3, .steps = 120, .what = COHESIVE}));
  PetscCall(Compare(&(Setting){.dim = 3, .steps = 120, .what = NONLOCAL}));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBreaking)

static PetscErrorCode TestPublished(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(&(Setting){.dim = 3, .steps = 120, .what = SPRINGS}));
  PetscCall(Compare(&(Setting){.dim = 3, .steps = 120, .what = POISSON}));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPublished)

/* Owners change again and again while cracks run. */
static PetscErrorCode TestMigrating(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(&(Setting){.dim = 2, .steps = 300, .what = COHESIVE, .groups = PETSC_TRUE, .migrate = 7}));
  PetscCall(Compare(&(Setting){.dim = 3, .steps = 120, .what = NONLOCAL, .migrate = 11}));
  PetscCall(Compare(&(Setting){.dim = 2, .steps = 100, .what = ELASTIC, .migrate = 20}));
  PetscCall(Compare(&(Setting){.dim = 3, .steps = 120, .what = POISSON, .migrate = 30}));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestMigrating)

/* A rank holds its own part and a thin layer of others', not the body. */
static PetscErrorCode TestShare(void)
{
  const Setting s = {.dim = 3, .what = COHESIVE};
  TestBody      body;
  DemModel      model;
  DemShare      share;
  PetscInt      sum[2], particles, bonds;
  PetscMPIInt   size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(Body(3, &body));
  PetscCall(Model(PETSC_COMM_WORLD, &body, &s, 1, &model));
  PetscCall(DemModelGetShare(model, &share));
  PetscCall(DemModelGetCounts(model, &particles, &bonds, NULL));
  CheckInt(particles, body.packing.n);
  CheckInt(bonds, body.cells.n_facets);
  sum[0] = share.own;
  sum[1] = share.counted;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  CheckInt(sum[0], particles); /* each particle moves on one rank, each bond counts on one */
  CheckInt(sum[1], bonds);
  CheckBelow(share.own, 1.35 * particles / size); /* pieces of 256 of about 2,200 particles */
  CheckBelow(share.own + share.ghosts, (size == 2 ? 0.75 : 0.6) * particles);
  CheckBelow(share.bonds, (size == 2 ? 0.7 : 0.5) * bonds);
  PetscCall(DemModelDestroy(&model));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestShare)

static PetscErrorCode Save(MPI_Comm comm, DemModel model, const char *file)
{
  Checkpoint c;
  Stepper    stepper;

  PetscFunctionBegin;
  PetscCall(DemModelGetStepper(model, &stepper));
  PetscCall(CheckpointCreate(comm, file, &c));
  PetscCall(stepper.save(model, c));
  PetscCall(CheckpointClose(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Load(MPI_Comm comm, DemModel model, const char *file)
{
  Checkpoint c;
  Stepper    stepper;

  PetscFunctionBegin;
  PetscCall(DemModelGetStepper(model, &stepper));
  PetscCall(CheckpointOpen(comm, file, &c));
  PetscCall(stepper.load(model, c));
  PetscCall(CheckpointClose(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Half way on one number of ranks, on with another: all ranks, all but one, one. The same bits as without a stop. */
static PetscErrorCode TestRestart(void)
{
  const PetscInt half = 90, all = 180;
  const char    *file = "dem_ranks.h5", *alone = "dem_ranks_one.h5";
  PetscMPIInt    rank, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (int what = COHESIVE; what < CASES; what++) {
    const Setting s = {.dim = 2, .what = (Case)what};
    MPI_Comm      some;
    TestBody      body;
    DemModel      part, whole, on;
    PetscInt      broken, between;

    PetscCall(Body(2, &body));
    PetscCall(Model(PETSC_COMM_WORLD, &body, &s, 1, &part));
    PetscCall(Model(PETSC_COMM_SELF, &body, &s, 1, &whole));
    PetscCall(TestSteps(part, SAFETY, 0, half));
    PetscCall(TestSteps(whole, SAFETY, 0, half));
    PetscCall(Save(PETSC_COMM_WORLD, part, file));
    if (rank == 0) PetscCall(Save(PETSC_COMM_SELF, whole, alone));
    PetscCall(DemModelDestroy(&part));
    PetscCall(TestSteps(whole, SAFETY, half, all));

    PetscCall(Model(PETSC_COMM_WORLD, &body, &s, 1, &on)); /* one to all */
    PetscCall(Load(PETSC_COMM_WORLD, on, alone));
    PetscCall(TestSteps(on, SAFETY, half, all));
    PetscCall(TestSameState(on, whole));
    PetscCall(SameSums(on, whole));
    PetscCall(SameCracks(on, whole, &broken, &between));
    CheckAbove(broken, 5);
    PetscCall(DemModelDestroy(&on));
    if (rank == size - 1) { /* all to one */
      PetscCall(Model(PETSC_COMM_SELF, &body, &s, 1, &on));
      PetscCall(Load(PETSC_COMM_SELF, on, file));
      PetscCall(TestSteps(on, SAFETY, half, all));
      PetscCall(TestSameState(on, whole));
      PetscCall(DemModelDestroy(&on));
    }
    PetscCallMPI(MPI_Comm_split(PETSC_COMM_WORLD, rank < size / 2, rank, &some)); /* all to half of them */
    if (size > 2 && rank < size / 2) {
      PetscCall(Model(some, &body, &s, 1, &on));
      PetscCall(Load(some, on, file));
      PetscCall(TestSteps(on, SAFETY, half, all));
      PetscCall(TestSameState(on, whole));
      PetscCall(DemModelDestroy(&on));
    }
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    PetscCallMPI(MPI_Comm_free(&some));
    if (rank == 0) {
      unlink(file);
      unlink(alone);
    }
    PetscCall(DemModelDestroy(&whole));
    PetscCall(TestBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRestart)

/* Threads within ranks, and the parts that bonds still hold together. */
static PetscErrorCode TestThreadsAndFragments(void)
{
  const Setting s = {.dim = 2, .what = COHESIVE, .groups = PETSC_TRUE};
  TestBody      body;
  DemModel      part, whole;
  DemState      state;
  PetscInt     *a, *b, parts[2];

  PetscFunctionBeginUser;
  PetscCall(Body(2, &body));
  PetscCall(Model(PETSC_COMM_WORLD, &body, &s, 2, &part));
  PetscCall(Model(PETSC_COMM_SELF, &body, &s, 1, &whole));
  PetscCall(TestSteps(part, SAFETY, 0, 200));
  PetscCall(TestSteps(whole, SAFETY, 0, 200));
  PetscCall(TestSameState(part, whole));
  PetscCall(DemModelGetState(part, &state));
  PetscCall(PetscMalloc2(state.n, &a, body.packing.n, &b));
  PetscCall(DemModelGetFragments(part, &parts[0], a));
  PetscCall(DemModelGetFragments(whole, &parts[1], b));
  CheckInt(parts[0], parts[1]);
  CheckAbove(parts[0], 2);
  for (PetscInt p = 0; p < state.own; p++) CheckInt(a[p], b[state.number[p]]);
  PetscCall(PetscFree2(a, b));
  PetscCall(DemModelRestoreState(part, &state));
  PetscCall(DemModelDestroy(&part));
  PetscCall(DemModelDestroy(&whole));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestThreadsAndFragments)

/* A floor that two ranks' particles press, a driven plate, and a probe. */
static PetscErrorCode TestTools(void)
{
  const PetscReal gravity[3] = {0, -1e-3, 0};
  const char     *file = "dem_ranks_tools.h5";
  const char     *wanted[] = {"displacement", "stress"};
  const PetscReal at[3] = {0.4, 1, 0};
  PetscMPIInt     rank;
  TestBody        body;
  DemModel        model[3]; /* all ranks, one, all ranks from the middle on */
  Stepper         stepper;
  PetscReal       dt;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(Body(2, &body));
  for (int k = 0; k < 3; k++) {
    const DemMaterial material = {1, 1, 0.25};
    const DemPlane    floor = {.point = {0, -0.001, 0}, .normal = {0, 1, 0}, .friction = 0.3, .stiffness = 1, .damping = 0.1};
    DemToolOptions    plate = {.shape = DEM_TOOL_PLANE, .point = {0, 1.101, 0}, .axis = {0, -1, 0}, .pushed = PETSC_TRUE, .push_axis = {0, -1, 0}, .mass = 0.3};
    Table             none[3] = {{0}};

    plate.contact = (DemContactChoice){.law = DEM_CONTACT_LINEAR, .stiffness = 1, .ratio = 1, .restitution = 1, .friction = 0.2};
    PetscCall(DemModelCreate(k == 1 ? PETSC_COMM_SELF : PETSC_COMM_WORLD, &model[k]));
    PetscCall(DemModelSetKind(model[k], DEM_PLANE_STRESS));
    PetscCall(DemModelSetMaterial(model[k], &material));
    PetscCall(DemModelSetBody(model[k], &body.body, &body.packing, &body.cells));
    PetscCall(DemModelSetGravity(model[k], gravity));
    PetscCall(DemModelAddPlane(model[k], "floor", &floor, none));
    PetscCall(TableCreateConstant(1e-3, &plate.force));
    PetscCall(DemModelAddTool(model[k], "plate", &plate));
    PetscCall(TableDestroy(&plate.force));
    PetscCall(DemModelAddHistory(model[k], "force", "floor"));
    PetscCall(DemModelAddHistory(model[k], "displacement", "plate"));
    PetscCall(DemModelAddProbe(model[k], "point", at, 2, wanted));
    PetscCall(DemModelSetUp(model[k]));
  }
  PetscCall(DemModelGetCriticalStep(model[0], &dt));
  for (int k = 0; k < 2; k++) {
    PetscCall(TestSteps(model[k], SAFETY, 0, 100));
    if (k == 0) PetscCall(Save(PETSC_COMM_WORLD, model[0], file));
    PetscCall(TestSteps(model[k], SAFETY, 100, 200));
  }
  PetscCall(Load(PETSC_COMM_WORLD, model[2], file));
  PetscCall(TestSteps(model[2], SAFETY, 100, 200));
  {
    DemState a, b;

    PetscCall(DemModelGetState(model[2], &a));
    PetscCall(DemModelGetState(model[0], &b));
    CheckInt(a.own, b.own);
    for (PetscInt p = 0; p < a.own; p++)
      for (PetscInt d = 0; d < 2; d++) CheckNear(a.u[d * a.n + p], b.u[d * b.n + p], 0);
    PetscCall(DemModelRestoreState(model[2], &a));
    PetscCall(DemModelRestoreState(model[0], &b));
  }
  for (int k = 0; k < 3; k += 2) {
    Ledger la, lb;

    PetscCall(DemModelGetStepper(model[k], &stepper));
    for (PetscInt i = 0; i < stepper.n_history; i++) { /* the plate goes by the sum over the ranks: to rounding */
      PetscReal x, y;

      PetscCall(stepper.history(model[k], i, &x));
      PetscCall(stepper.history(model[1], i, &y));
      CheckNear(x, y, 1e-9 * PetscAbsReal(y) + 1e-14);
    }
    PetscCall(stepper.energy(model[k], &la));
    PetscCall(stepper.energy(model[1], &lb));
    for (int e = 0; e < LEDGER_TERMS; e++) CheckNear(la.energy[e], lb.energy[e], 1e-10 * lb.energy[LEDGER_WORK]);
    CheckAbove(lb.energy[LEDGER_CONTACT], 0.001 * lb.energy[LEDGER_WORK]);
  }
  if (rank == 0) unlink(file);
  for (int k = 0; k < 3; k++) PetscCall(DemModelDestroy(&model[k]));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTools)

/* A state that is lost is told by all ranks in the same words. */
static PetscErrorCode TestWatch(void)
{
  const Setting s = {.dim = 2, .what = ELASTIC};
  TestBody      body;
  DemModel      model;
  DemState      state;
  Stepper       stepper;
  PetscMPIInt   rank, size;
  char          fault[BASE_LINE], first[BASE_LINE];

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(Body(2, &body));
  PetscCall(Model(PETSC_COMM_WORLD, &body, &s, 1, &model));
  PetscCall(TestSteps(model, SAFETY, 0, 2));
  PetscCall(DemModelGetStepper(model, &stepper));
  PetscCall(stepper.watch(model, RUN_WATCH_MOTION, fault));
  CheckInt(fault[0], 0);
  PetscCall(DemModelGetState(model, &state));
  if (rank == size - 1) state.v[3] = 1e9;
  PetscCall(DemModelRestoreState(model, &state));
  PetscCall(stepper.watch(model, RUN_WATCH_MOTION, fault));
  CheckContains(fault, "runs away: 1e+09 m/s");
  PetscCall(PetscStrncpy(first, fault, sizeof(first)));
  PetscCallMPI(MPI_Bcast(first, BASE_LINE, MPI_CHAR, 0, PETSC_COMM_WORLD));
  CheckContains(fault, first);
  PetscCall(DemModelDestroy(&model));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestWatch)

/* More ranks than pieces to share out. */
static PetscErrorCode TestTooFew(void)
{
  const PetscReal   size[3] = {1, 1, 1};
  const DemMaterial material = {1, 1, 0.2};
  TestBody          body;
  DemModel          model;

  PetscFunctionBeginUser;
  PetscCall(TestBodyCreate(2, size, 10, 0.3, 1, &body));
  PetscCall(DemModelCreate(PETSC_COMM_WORLD, &model));
  PetscCall(DemModelSetKind(model, DEM_PLANE_STRESS));
  PetscCall(DemModelSetMaterial(model, &material));
  PetscCall(DemModelSetBody(model, &body.body, &body.packing, &body.cells));
  CheckFails(DemModelSetUp(model), PETSC_ERR_USER_INPUT, "too few for");
  PetscCall(DemModelDestroy(&model));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTooFew)

static const struct CMUnitTest tests[] = {TEST(TestElastic), TEST(TestBreaking), TEST(TestPublished), TEST(TestMigrating), TEST(TestShare), TEST(TestRestart), TEST(TestThreadsAndFragments), TEST(TestTools), TEST(TestWatch), TEST(TestTooFew)};
CHECK_MAIN(tests)
