/*
  A body that is shared out anew of itself: one half of a cloud of grains flies out of its box, and the ranks that had it get work
  of the others. Beside it the same on one rank, and with the owners of the set-up.
*/
#include "check.h"
#include "checkpoint.h"
#include "dem_solve.h"
#include <unistd.h>

#define SAFETY 0.8 /* of the critical step */
#define SIDE 64    /* discs along the cloud: 8 pieces of 512 */
#define STEPS 240
#define EVERY 20 /* steps between looks */

static PetscErrorCode Model(MPI_Comm comm, PetscInt every, DemModel *model)
{
  const DemMaterial material = {1, 1, 0.25};
  const PetscReal   low[3] = {0}, high[3] = {SIDE, SIDE, 0};
  DemContactOptions meet = {
      .choice = {.law = DEM_CONTACT_LINEAR, .restitution = 0.5, .friction = 0.4}, .domain = DEM_DOMAIN_BOX, .high = {SIDE, SIDE, 0}, .deepest = 0.9};
  DemBody    body;
  DemPacking packing = {.n = SIDE * SIDE};
  DemState   state;
  PetscReal  dt;

  PetscFunctionBegin;
  PetscCall(DemBodyCreateBox(2, low, high, 1, &body));
  PetscCall(PetscCalloc1(3 * packing.n, &packing.x));
  PetscCall(PetscMalloc1(packing.n, &packing.r));
  for (PetscInt k = 0; k < packing.n; k++) {
    packing.r[k] = 0.49;
    packing.x[3 * k] = (PetscReal)(k % SIDE) + 0.5;
    packing.x[3 * k + 1] = (PetscReal)(k / SIDE) + 0.5;
  }
  PetscCall(DemModelCreate(comm, model));
  PetscCall(DemModelSetKind(*model, DEM_PLANE_STRESS));
  PetscCall(DemModelSetMaterial(*model, &material));
  PetscCall(DemModelSetBonded(*model, PETSC_FALSE));
  PetscCall(DemModelSetBody(*model, &body, &packing, NULL));
  PetscCall(DemModelSetContact(*model, &meet));
  PetscCall(DemModelSetRebalance(*model, every));
  PetscCall(DemModelSetUp(*model));
  PetscCall(DemModelGetCriticalStep(*model, &dt));
  PetscCall(DemModelGetState(*model, &state));
  for (PetscInt p = 0; p < state.own; p++) { /* the left ones fly off within 200 steps; the others jostle */
    uint64_t seed = 1000 + (uint64_t)state.number[p];

    if (state.x0[p] < 0.5 * SIDE)
      state.v[p] = -0.5 * SIDE / (200 * SAFETY * dt);
    else
      for (PetscInt d = 0; d < 2; d++) state.v[d * state.n + p] = 0.02 * (2 * TestRandom(&seed) - 1);
  }
  PetscCall(DemModelRestoreState(*model, &state));
  PetscCall(PetscFree(packing.x));
  PetscCall(PetscFree(packing.r));
  PetscCall(DemBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Most grains still in the box that one rank has, over the mean. */
static PetscErrorCode Spread(DemModel model, PetscReal *spread)
{
  DemState    state;
  PetscInt    here = 0, all, most;
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(DemModelGetState(model, &state));
  for (PetscInt p = 0; p < state.own; p++) here += state.x0[p] + state.u[p] > 0;
  PetscCall(DemModelRestoreState(model, &state));
  PetscCallMPI(MPI_Allreduce(&here, &all, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(&here, &most, 1, MPIU_INT, MPI_MAX, PETSC_COMM_WORLD));
  *spread = (PetscReal)most * size / (PetscReal)all;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode File(MPI_Comm comm, DemModel model, const char *file, PetscBool save)
{
  Checkpoint c;
  Stepper    stepper;

  PetscFunctionBegin;
  PetscCall(DemModelGetStepper(model, &stepper));
  PetscCall(save ? CheckpointCreate(comm, file, &c) : CheckpointOpen(comm, file, &c));
  PetscCall(save ? stepper.save(model, c) : stepper.load(model, c));
  PetscCall(CheckpointClose(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestWorkThatShifts(void)
{
  const char *file = "dem_ranks_migrate.h5";
  DemModel    moving, staying, whole, on;
  DemSharing  sharing;
  PetscReal   before, after;
  Ledger      la, lb;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(Model(PETSC_COMM_WORLD, EVERY, &moving));
  PetscCall(Model(PETSC_COMM_WORLD, 0, &staying));
  PetscCall(Model(PETSC_COMM_SELF, EVERY, &whole));
  PetscCall(TestSteps(moving, SAFETY, 0, STEPS));
  PetscCall(TestSteps(staying, SAFETY, 0, STEPS));
  PetscCall(TestSteps(whole, SAFETY, 0, STEPS));
  PetscCall(TestSameState(moving, whole));
  PetscCall(TestSameState(staying, whole));
  PetscCall(TestSameEnergies(moving, whole, &la, &lb));
  PetscCall(Spread(staying, &before));
  PetscCall(Spread(moving, &after));
  CheckAbove(before, 1.9); /* half the ranks have nothing left */
  CheckBelow(after, 1.1);
  PetscCall(DemModelGetSharing(moving, NULL, &sharing));
  CheckInt(sharing.looks, (STEPS - 1) / EVERY);
  CheckAbove(sharing.times, 0);
  CheckBelow(sharing.times, 8); /* not at every look */
  CheckAbove(sharing.before, 1.2);
  CheckBelow(sharing.after, 0.95 * sharing.before);
  PetscCall(DemModelGetSharing(staying, NULL, &sharing));
  CheckInt(sharing.looks + sharing.times, 0);
  PetscCall(DemModelGetSharing(whole, NULL, &sharing));
  CheckInt(sharing.looks + sharing.times, 0);

  /* a run goes on from there, on all ranks and on one */
  PetscCall(File(PETSC_COMM_WORLD, moving, file, PETSC_TRUE));
  PetscCall(TestSteps(whole, SAFETY, STEPS, STEPS + 60));
  PetscCall(Model(PETSC_COMM_WORLD, EVERY, &on));
  PetscCall(File(PETSC_COMM_WORLD, on, file, PETSC_FALSE));
  PetscCall(TestSteps(on, SAFETY, STEPS, STEPS + 60));
  PetscCall(TestSameState(on, whole));
  PetscCall(Spread(on, &after));
  CheckBelow(after, 1.1); /* its owners were those of a set-up, and changed too */
  PetscCall(DemModelDestroy(&on));
  PetscCall(Model(PETSC_COMM_SELF, EVERY, &on));
  PetscCall(File(PETSC_COMM_SELF, on, file, PETSC_FALSE));
  PetscCall(TestSteps(on, SAFETY, STEPS, STEPS + 60));
  PetscCall(TestSameState(on, whole));
  PetscCall(DemModelDestroy(&on));
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  if (!rank) unlink(file);
  PetscCall(DemModelDestroy(&moving));
  PetscCall(DemModelDestroy(&staying));
  PetscCall(DemModelDestroy(&whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestWorkThatShifts)

/* Ranks may be left with nothing, and get some again; owners that no rank is are refused. */
static PetscErrorCode TestOwners(void)
{
  DemModel    model, whole;
  DemSharing  sharing;
  PetscInt    pieces;
  PetscMPIInt owner[8] = {0};

  PetscFunctionBeginUser;
  PetscCall(Model(PETSC_COMM_WORLD, 0, &model));
  PetscCall(Model(PETSC_COMM_SELF, 0, &whole));
  PetscCall(DemModelGetSharing(model, &pieces, &sharing));
  CheckInt(pieces, 8);
  PetscCall(DemModelMigrate(model, owner)); /* all to one */
  PetscCall(TestSteps(model, SAFETY, 0, 20));
  PetscCall(DemModelMigrate(model, NULL));
  PetscCall(TestSteps(model, SAFETY, 20, 40));
  PetscCall(TestSteps(whole, SAFETY, 0, 40));
  PetscCall(TestSameState(model, whole));
  PetscCall(DemModelMigrate(whole, NULL)); /* nothing to share */
  owner[3] = 99;
  CheckFails(DemModelMigrate(model, owner), PETSC_ERR_ARG_OUTOFRANGE, "ranks are 0 to");
  CheckFails(DemModelSetRebalance(model, -1), PETSC_ERR_USER_INPUT, "0 (never) or more");
  PetscCall(DemModelDestroy(&model));
  PetscCall(DemModelDestroy(&whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOwners)

static const struct CMUnitTest tests[] = {TEST(TestWorkThatShifts), TEST(TestOwners)};
CHECK_MAIN(tests)
