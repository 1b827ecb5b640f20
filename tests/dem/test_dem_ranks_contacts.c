/*
  Contacts between ranks beside their twin on one, in the same program: grains in a box that settle, collide and leave, and pieces of a
  body that was torn and is pushed together again. The same bits, whatever the number of ranks.
*/
#include "check.h"
#include "checkpoint.h"
#include "dem_solve.h"
#include <unistd.h>

#define SAFETY 0.8 /* of the critical step */

typedef enum { FALLING, GAS, LEAVING, KINDS, TORN, SPRINGS, CASES } Case;

typedef struct {
  Case     what;
  PetscInt dim, steps, touch; /* pairs of two ranks that touch at the end, at least */
} Setting;

/* Loose discs or spheres on a jittered lattice; a bonded body from its cells. */
static PetscErrorCode Body(const Setting *s, TestBody *body)
{
  const PetscReal size[3] = {1, 1.1, 2}, low[3] = {0};
  const PetscInt  side = s->dim == 3 ? 13 : 46;
  const PetscReal high[3] = {side, side, s->dim == 3 ? side : 0};
  uint64_t        seed = 11;

  PetscFunctionBegin;
  if (s->what >= TORN) {
    PetscCall(TestBodyCreate(s->dim, size, s->dim == 3 ? 10 : 44, 0.5, 5, body));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMemzero(body, sizeof(*body)));
  PetscCall(DemBodyCreateBox(s->dim, low, high, 1, &body->body));
  body->packing.n = s->dim == 3 ? side * side * side : side * side;
  PetscCall(PetscCalloc1(3 * body->packing.n, &body->packing.x));
  PetscCall(PetscMalloc1(body->packing.n, &body->packing.r));
  for (PetscInt k = 0; k < body->packing.n; k++) {
    const PetscInt cell[3] = {k % side, k / side % side, k / side / side};

    body->packing.r[k] = 0.45 * (1 + 0.1 * (2 * TestRandom(&seed) - 1));
    for (PetscInt d = 0; d < s->dim; d++) body->packing.x[3 * k + d] = (PetscReal)cell[d] + 0.5 + 0.1 * (TestRandom(&seed) - 0.5);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Bonded(const Setting *s, DemModel model)
{
  const PetscReal   t[5] = {0, 0.1, 0.6, 0.7, 20}, v[5] = {0, 6e-2, 6e-2, -1e-1, -1e-1}, back[5] = {0, -6e-2, -6e-2, 1e-1, 1e-1};
  const char       *ends[2] = {s->dim == 3 ? "zmin" : "ymin", s->dim == 3 ? "zmax" : "ymax"};
  const DemStrength strength = {.tensile = 1e-3, .fracture_energy = 1e-6, .shear = 3e-3, .shear_energy = 1e-4, .mu_static = 0.5, .mu_dynamic = 0.3, .published = (PetscBool)(s->what == SPRINGS)};
  const DemRule     rule = {.elasticity = DEM_KDEM, .normal_factor = 1, .shear_factor = 1};

  PetscFunctionBegin;
  if (s->what == SPRINGS) PetscCall(DemModelSetRule(model, &rule));
  PetscCall(DemModelSetStrength(model, &strength));
  for (PetscInt e = 0; e < 2; e++) {
    Table motion, zero;

    PetscCall(TableCreate(5, t, e ? v : back, &motion));
    PetscCall(TableCreateConstant(0, &zero));
    for (PetscInt d = 0; d < s->dim; d++) PetscCall(DemModelFix(model, ends[e], d, DEM_VELOCITY, d == s->dim - 1 ? &motion : &zero));
    PetscCall(TableDestroy(&motion));
    PetscCall(TableDestroy(&zero));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Loose(const Setting *s, const TestBody *body, DemModel model)
{
  const PetscReal down[3] = {0, s->dim == 2 ? -1e-3 : 0, s->dim == 3 ? -1e-3 : 0};
  const DemPlane  floor = {.point = {0, 0, 0}, .normal = {0, s->dim == 2, s->dim == 3}, .friction = 0.3, .stiffness = 1, .damping = 0.1};
  Table           none[3] = {{0}};

  PetscFunctionBegin;
  PetscCall(DemModelSetBonded(model, PETSC_FALSE));
  PetscCall(DemModelSetBody(model, &body->body, &body->packing, NULL));
  if (s->what == FALLING || s->what == KINDS) {
    PetscCall(DemModelSetGravity(model, down));
    PetscCall(DemModelAddPlane(model, "floor", &floor, none));
  }
  if (s->what == KINDS) {
    const DemMaterial      kind[2] = {{1, 1, 0.2}, {2, 0.5, 0.3}};
    const DemContactChoice own = {.law = DEM_CONTACT_LINEAR, .restitution = 0.3, .friction = 0.7};
    PetscInt              *of;

    PetscCall(PetscMalloc1(body->packing.n, &of));
    for (PetscInt k = 0; k < body->packing.n; k++) of[k] = k % 3 == 0;
    PetscCall(DemModelSetGrainMaterials(model, 2, kind, of));
    PetscCall(DemModelSetContactPair(model, 0, 1, &own));
    PetscCall(PetscFree(of));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Model(MPI_Comm comm, const TestBody *body, const Setting *s, PetscInt threads, DemModel *model)
{
  const DemMaterial material = {1, 1, 0.25};
  const PetscBool   bonded = (PetscBool)(s->what >= TORN);
  DemContactOptions meet = {.choice = {.law = s->dim == 3 && !bonded ? DEM_CONTACT_HERTZ : DEM_CONTACT_LINEAR, .restitution = 0.5, .friction = 0.4}, .deepest = 0.9};
  DemState          state;

  PetscFunctionBegin;
  PetscCall(DemModelCreate(comm, model));
  PetscCall(DemModelSetKind(*model, s->dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS));
  PetscCall(DemModelSetThreads(*model, threads));
  PetscCall(DemModelSetMaterial(*model, &material));
  if (bonded) {
    PetscCall(DemModelSetBody(*model, &body->body, &body->packing, &body->cells));
    PetscCall(Bonded(s, *model));
  } else PetscCall(Loose(s, body, *model));
  if (s->what == GAS || s->what == LEAVING) {
    meet.domain = s->what == GAS ? DEM_DOMAIN_PERIODIC : DEM_DOMAIN_BOX;
    for (PetscInt d = 0; d < s->dim; d++) meet.high[d] = body->body.high[d];
  }
  if (s->what == GAS) {
    meet.choice.rolling         = 0.1;
    meet.choice.twisting        = s->dim == 3 ? 0.05 : 0;
    meet.choice.rolling_damping = 0.2;
  }
  PetscCall(DemModelSetContact(*model, &meet));
  PetscCall(DemModelSetUp(*model));
  PetscCall(DemModelGetState(*model, &state));
  for (PetscInt p = 0; p < state.own && !bonded; p++) /* each its own way, known by its number */
    for (PetscInt d = 0; d < s->dim; d++) {
      uint64_t seed = 1000 + 3 * (uint64_t)state.number[p] + (uint64_t)d;

      state.v[d * state.n + p] = (s->what == LEAVING ? 0.3 : 0.05) * (2 * TestRandom(&seed) - 1);
    }
  PetscCall(DemModelRestoreState(*model, &state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Energies to rounding, counts exactly. */
static PetscErrorCode SameSums(DemModel part, DemModel whole)
{
  Ledger           la, lb;
  DemContactCounts na, nb;

  PetscFunctionBegin;
  PetscCall(TestSameEnergies(part, whole, &la, &lb));
  PetscCall(DemModelGetContactCounts(part, &na));
  PetscCall(DemModelGetContactCounts(whole, &nb));
  CheckInt(na.searches, nb.searches);
  CheckInt(na.searched, nb.searched);
  CheckInt(na.pairs, nb.pairs);
  CheckInt(na.touching, nb.touching);
  CheckInt(na.left, nb.left);
  CheckNear(na.deepest, nb.deepest, 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Between(DemModel model, PetscInt *between)
{
  DemShare share;

  PetscFunctionBegin;
  PetscCall(DemModelGetShare(model, &share));
  *between = share.between;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, between, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Compare(const Setting *s, PetscInt threads, PetscInt migrate)
{
  TestBody         body;
  DemModel         part, whole;
  DemContactCounts counts;
  PetscInt         between, cracks = 0;

  PetscFunctionBegin;
  PetscCall(Body(s, &body));
  PetscCall(Model(PETSC_COMM_WORLD, &body, s, threads, &part));
  PetscCall(Model(PETSC_COMM_SELF, &body, s, 1, &whole));
  if (migrate) PetscCall(TestStepsMigrating(part, SAFETY, 0, s->steps, migrate));
  else PetscCall(TestSteps(part, SAFETY, 0, s->steps));
  PetscCall(TestSteps(whole, SAFETY, 0, s->steps));
  PetscCall(TestSameState(part, whole));
  PetscCall(SameSums(part, whole));
  PetscCall(DemModelGetContactCounts(whole, &counts));
  CheckAbove(counts.searches, 2);
  if (s->what == LEAVING) CheckAbove(counts.left, 20);
  PetscCall(Between(part, &between));
  CheckAbove(between, s->touch);
  if (s->what >= TORN) {
    DemCracks list;

    PetscCall(DemModelGetCracks(whole, &list));
    for (PetscInt k = 0; k < list.n; k++) cracks += list.broken[k] > 0.99;
    CheckAbove(cracks, 20);
  }
  PetscCall(DemModelDestroy(&part));
  PetscCall(DemModelDestroy(&whole));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Grains that fall on a floor, in two materials; a gas in a periodic cell, with rolling; grains that fly out of a box. */
static PetscErrorCode TestGrains(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(&(Setting){FALLING, 2, 700, 3}, 1, 0));
  PetscCall(Compare(&(Setting){FALLING, 3, 250, 3}, 1, 0));
  PetscCall(Compare(&(Setting){KINDS, 2, 700, 3}, 2, 0));
  PetscCall(Compare(&(Setting){GAS, 2, 700, 1}, 1, 0));
  PetscCall(Compare(&(Setting){GAS, 3, 250, 3}, 2, 0));
  PetscCall(Compare(&(Setting){LEAVING, 2, 500, 0}, 1, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestGrains)

/* Torn by its ends, which then come back: pieces of several ranks meet again. */
static PetscErrorCode TestPieces(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(&(Setting){TORN, 2, 560, 1}, 1, 0));
  PetscCall(Compare(&(Setting){TORN, 3, 420, 1}, 2, 0));
  PetscCall(Compare(&(Setting){SPRINGS, 2, 500, 1}, 1, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPieces)

/* Owners change again and again while grains fall, fly and leave, and pieces meet. */
static PetscErrorCode TestMigrating(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(&(Setting){KINDS, 2, 700, 3}, 1, 31));
  PetscCall(Compare(&(Setting){GAS, 3, 250, 3}, 2, 13));
  PetscCall(Compare(&(Setting){LEAVING, 2, 500, 0}, 1, 17));
  PetscCall(Compare(&(Setting){TORN, 2, 560, 1}, 1, 13));
  PetscCall(Compare(&(Setting){SPRINGS, 2, 500, 1}, 1, 50));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestMigrating)

static PetscErrorCode File(MPI_Comm comm, DemModel model, const char *file, PetscBool save)
{
  Checkpoint c;
  Stepper    stepper;

  PetscFunctionBegin;
  PetscCall(DemModelGetStepper(model, &stepper));
  if (save) PetscCall(CheckpointCreate(comm, file, &c));
  else PetscCall(CheckpointOpen(comm, file, &c));
  PetscCall(save ? stepper.save(model, c) : stepper.load(model, c));
  PetscCall(CheckpointClose(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What touches when the run stops goes on with its history, on any number of ranks: from one to all, and from all to one. */
static PetscErrorCode TestRestart(void)
{
  const Setting kinds[] = {{KINDS, 2, 500, 0}, {GAS, 3, 200, 0}, {LEAVING, 2, 300, 0}, {TORN, 2, 520, 0}};
  const char   *file = "dem_ranks_contacts.h5", *alone = "dem_ranks_contacts_one.h5";
  PetscMPIInt   rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (size_t k = 0; k < sizeof(kinds) / sizeof(kinds[0]); k++) {
    const Setting *s = &kinds[k];
    const PetscInt half = s->steps - 90;
    TestBody       body;
    DemModel       part, whole, on;

    PetscCall(Body(s, &body));
    PetscCall(Model(PETSC_COMM_WORLD, &body, s, 1, &part));
    PetscCall(Model(PETSC_COMM_SELF, &body, s, 1, &whole));
    PetscCall(TestSteps(part, SAFETY, 0, half));
    PetscCall(TestSteps(whole, SAFETY, 0, half));
    PetscCall(File(PETSC_COMM_WORLD, part, file, PETSC_TRUE));
    if (rank == 0) PetscCall(File(PETSC_COMM_SELF, whole, alone, PETSC_TRUE));
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    PetscCall(TestSteps(whole, SAFETY, half, s->steps));
    PetscCall(Model(PETSC_COMM_WORLD, &body, s, 1, &on));
    PetscCall(File(PETSC_COMM_WORLD, on, alone, PETSC_FALSE));
    PetscCall(TestSteps(on, SAFETY, half, s->steps));
    PetscCall(TestSameState(on, whole));
    PetscCall(SameSums(on, whole));
    PetscCall(DemModelDestroy(&on));
    PetscCall(Model(PETSC_COMM_SELF, &body, s, 1, &on));
    PetscCall(File(PETSC_COMM_SELF, on, file, PETSC_FALSE));
    PetscCall(TestSteps(on, SAFETY, half, s->steps));
    PetscCall(TestSameState(on, whole));
    PetscCall(SameSums(on, whole));
    PetscCall(DemModelDestroy(&on));
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    if (rank == 0) {
      unlink(file);
      unlink(alone);
    }
    PetscCall(DemModelDestroy(&part));
    PetscCall(DemModelDestroy(&whole));
    PetscCall(TestBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRestart)

/* A rank keeps the pairs of its own grains and copies of those near them, not the cloud. */
static PetscErrorCode TestShare(void)
{
  const Setting s = {FALLING, 2, 0, 0};
  TestBody      body;
  DemModel      part, whole;
  DemShare      mine, all;
  PetscMPIInt   size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(Body(&s, &body));
  PetscCall(Model(PETSC_COMM_WORLD, &body, &s, 1, &part));
  PetscCall(Model(PETSC_COMM_SELF, &body, &s, 1, &whole));
  PetscCall(DemModelGetShare(part, &mine));
  PetscCall(DemModelGetShare(whole, &all));
  CheckInt(all.copies, 0);
  CheckAbove(mine.copies, 20);
  CheckBelow(mine.copies, 0.2 * (PetscReal)all.own);
  CheckBelow(mine.pairs, 1.4 * (PetscReal)all.pairs / size);
  PetscCall(DemModelDestroy(&part));
  PetscCall(DemModelDestroy(&whole));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestShare)

static const struct CMUnitTest tests[] = {TEST(TestGrains), TEST(TestPieces), TEST(TestMigrating), TEST(TestRestart), TEST(TestShare)};
CHECK_MAIN(tests)
