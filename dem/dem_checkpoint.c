/*
  dem_checkpoint.c - the state a run goes on from. The file is that of one rank, whatever the number that writes or reads it.
*/
#include "dem_rule.h"

/* Scalars that a restart needs, in one array. */
#define SCALARS 9

/* Bytes travel as integers. */
static PetscErrorCode SaveBytes(DemModel model, Checkpoint c, const char *name, const unsigned char *bytes)
{
  PetscInt *copy;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(model->bonds.n, &copy));
  for (PetscInt k = 0; k < model->bonds.n; k++) copy[k] = bytes[k];
  PetscCall(DemSaveInts_Internal(model, c, name, DEM_OF_BONDS, copy));
  PetscCall(PetscFree(copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadBytes(DemModel model, Checkpoint c, const char *name, unsigned char *bytes)
{
  PetscInt *copy;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(model->bonds.n, &copy));
  PetscCall(DemLoadInts_Internal(model, c, name, DEM_OF_BONDS, copy));
  for (PetscInt k = 0; k < model->bonds.n; k++) bytes[k] = (unsigned char)copy[k];
  PetscCall(PetscFree(copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The list of live bonds, as one rank keeps it: each block's from its first bond on. */
static PetscErrorCode SaveLive(DemModel model, Checkpoint c)
{
  const DemCrackState *crack = &model->crack;
  const DemBlocks     *b = &model->blocks;
  const DemRanks       r = model->ranks;
  PetscInt            *live, *count, mine = 0, n;

  PetscFunctionBegin;
  if (!r) {
    PetscCall(CheckpointWriteInt(c, "dem/block_live", b->n_blocks, crack->n_live));
    PetscCall(CheckpointWriteInt(c, "dem/bond_live", model->bonds.n, crack->live));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc2(2 * b->n_blocks, &count, model->bonds.n, &live));
  for (PetscInt k = 0; k < b->n_blocks; k++) {
    for (PetscInt e = b->bond[k]; e < b->bond[k + 1]; e++) live[e] = e - b->bond[k] < crack->n_live[k] ? r->bond[crack->live[e]] : 0;
    if (!r->block_mine[k]) continue;
    count[mine]                 = r->block[k];
    count[b->n_blocks + mine++] = crack->n_live[k];
  }
  {
    PetscInt *all;

    PetscCall(DemGatherInts_Internal(model, mine, count, 1, count + b->n_blocks, &n, &all));
    PetscCall(CheckpointWriteInt(c, "dem/block_live", n, all));
    PetscCall(PetscFree(all));
  }
  PetscCall(DemSaveInts_Internal(model, c, "dem/bond_live", DEM_OF_BONDS, live));
  PetscCall(PetscFree2(count, live));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadLive(DemModel model, Checkpoint c)
{
  DemCrackState *crack = &model->crack;
  DemBlocks     *b = &model->blocks;
  const DemRanks r = model->ranks;
  PetscInt      *count, *live;

  PetscFunctionBegin;
  if (!r) {
    PetscCall(CheckpointReadInt(c, "dem/block_live", b->n_blocks, crack->n_live));
    PetscCall(CheckpointReadInt(c, "dem/bond_live", model->bonds.n, crack->live));
  } else { /* a block that is partly here keeps what is here of its list */
    PetscBool *listed;

    PetscCall(PetscMalloc2(r->blocks, &count, r->bonds, &live));
    PetscCall(PetscCalloc1(r->bonds, &listed));
    PetscCall(CheckpointReadInt(c, "dem/block_live", r->blocks, count));
    PetscCall(CheckpointReadInt(c, "dem/bond_live", r->bonds, live));
    for (PetscInt k = 0; k < r->blocks; k++)
      for (PetscInt e = 0; e < count[k]; e++) listed[live[r->bond_start[k] + e]] = PETSC_TRUE;
    for (PetscInt k = 0; k < b->n_blocks; k++) {
      crack->n_live[k] = 0;
      for (PetscInt e = b->bond[k]; e < b->bond[k + 1]; e++)
        if (listed[r->bond[e]]) crack->live[b->bond[k] + crack->n_live[k]++] = e;
    }
    PetscCall(PetscFree2(count, live));
    PetscCall(PetscFree(listed));
  }
  for (PetscInt k = 0; k < b->n_blocks; k++) crack->awake[k] = crack->n_live[k] > 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SaveCracks(DemModel model, Checkpoint c)
{
  const DemCrackState *crack = &model->crack;

  PetscFunctionBegin;
  PetscCall(DemSaveRows_Internal(model, c, "dem/bond_damage", DEM_OF_BONDS, 1, 1, crack->damage));
  PetscCall(DemSaveRows_Internal(model, c, "dem/bond_opening_direction", DEM_OF_BONDS, 1, 3, crack->e));
  PetscCall(DemSaveRows_Internal(model, c, "dem/bond_slip", DEM_OF_BONDS, 1, 3, crack->slip));
  PetscCall(DemSaveRows_Internal(model, c, "dem/bond_fracture_work", DEM_OF_BONDS, 1, 1, crack->work));
  PetscCall(DemSaveRows_Internal(model, c, "dem/bond_friction_work", DEM_OF_BONDS, 1, 1, crack->rub));
  PetscCall(DemSaveRows_Internal(model, c, "dem/bond_time", DEM_OF_BONDS, 1, 1, crack->time));
  PetscCall(DemSaveRows_Internal(model, c, "dem/bond_release", DEM_OF_BONDS, 1, 1, crack->release));
  PetscCall(DemSaveRows_Internal(model, c, "dem/crack_stress", DEM_OF_PARTICLES, 1, 6, crack->stress));
  PetscCall(SaveBytes(model, c, "dem/bond_state", crack->state));
  if (crack->limit) PetscCall(DemSaveRows_Internal(model, c, "dem/bond_limit", DEM_OF_BONDS, 1, 1, crack->limit));
  PetscCall(SaveLive(model, c));
  PetscCall(CheckpointWriteInt(c, "dem/stress_steps", 1, &crack->steps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadCracks(DemModel model, Checkpoint c)
{
  DemCrackState *crack = &model->crack;
  const PetscInt m = model->bonds.n;

  PetscFunctionBegin;
  PetscCall(DemLoadRows_Internal(model, c, "dem/bond_damage", DEM_OF_BONDS, 1, 1, crack->damage));
  PetscCall(DemLoadRows_Internal(model, c, "dem/bond_opening_direction", DEM_OF_BONDS, 1, 3, crack->e));
  PetscCall(DemLoadRows_Internal(model, c, "dem/bond_slip", DEM_OF_BONDS, 1, 3, crack->slip));
  PetscCall(DemLoadRows_Internal(model, c, "dem/bond_fracture_work", DEM_OF_BONDS, 1, 1, crack->work));
  PetscCall(DemLoadRows_Internal(model, c, "dem/bond_friction_work", DEM_OF_BONDS, 1, 1, crack->rub));
  PetscCall(DemLoadRows_Internal(model, c, "dem/bond_time", DEM_OF_BONDS, 1, 1, crack->time));
  PetscCall(DemLoadRows_Internal(model, c, "dem/bond_release", DEM_OF_BONDS, 1, 1, crack->release));
  PetscCall(DemLoadRows_Internal(model, c, "dem/crack_stress", DEM_OF_PARTICLES, 1, 6, crack->stress));
  PetscCall(LoadBytes(model, c, "dem/bond_state", crack->state));
  if (crack->limit) PetscCall(DemLoadRows_Internal(model, c, "dem/bond_limit", DEM_OF_BONDS, 1, 1, crack->limit));
  PetscCall(LoadLive(model, c));
  for (PetscInt k = 0; k < m; k++) model->bonds.now[k] = (1 - crack->damage[k]) * model->bonds.k[k];
  PetscCall(CheckpointReadInt(c, "dem/stress_steps", 1, &crack->steps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemSave_Internal(void *ctx, Checkpoint c)
{
  DemModel  model = ctx;
  PetscReal scalar[SCALARS] = {model->time, model->dt_last, model->started, 0, 0, model->damped, model->contact_lost, model->friction_lost, model->stable};
  PetscReal reaction[3];
  char      name[64];

  PetscFunctionBegin;
  PetscCall(DemRanksFlush_Internal(model));
  PetscCall(DemSumRanks_Internal(model, 3, scalar + 5));
  scalar[3] = model->work;
  scalar[4] = model->work_in;
  PetscCall(CheckpointWriteReal(c, "dem/scalars", SCALARS, scalar));
  if (model->statics) PetscCall(CheckpointWriteReal(c, "dem/static_reference", 1, DemStaticReference_Internal(model)));
  PetscCall(DemSaveInts_Internal(model, c, "dem/number", DEM_OF_PARTICLES, model->ranks ? model->ranks->number : model->at)); /* packing's number of each row below: global ids */
  PetscCall(DemSaveRows_Internal(model, c, "dem/displacement", DEM_OF_PARTICLES, 3, 1, model->u));
  PetscCall(DemSaveRows_Internal(model, c, "dem/velocity", DEM_OF_PARTICLES, 3, 1, model->v));
  PetscCall(DemSaveRows_Internal(model, c, "dem/rotation", DEM_OF_PARTICLES, 4, 1, model->rot));
  PetscCall(DemSaveRows_Internal(model, c, "dem/spin", DEM_OF_PARTICLES, 3, 1, model->spin));
  PetscCall(DemSaveRows_Internal(model, c, "dem/force", DEM_OF_PARTICLES, 3, 1, model->f));
  PetscCall(DemSaveRows_Internal(model, c, "dem/couple", DEM_OF_PARTICLES, 3, 1, model->torque));
  PetscCall(DemSaveRows_Internal(model, c, "dem/dilation", DEM_OF_PARTICLES, 1, 1, model->dilation));
  PetscCall(DemSaveRows_Internal(model, c, "dem/vstar", DEM_OF_PARTICLES, 1, 1, model->vstar));
  if (model->crack.damage) PetscCall(SaveCracks(model, c));
  if (model->contacts.on) PetscCall(DemContactsSave_Internal(model, c));
  if (model->rain.rate > 0) PetscCall(DemRainSave_Internal(model, c));
  PetscCall(DemClumpsSave_Internal(model, c));
  if (model->net) PetscCall(DemRuleSave_Internal(model, c));
  for (PetscInt k = 0; k < model->n_faces; k++) {
    PetscCall(BaseFormat(name, "dem/reaction_%" PetscInt_FMT, k));
    PetscCall(PetscArraycpy(reaction, model->face[k].reaction, 3));
    PetscCall(DemSumRanks_Internal(model, 3, reaction));
    PetscCall(CheckpointWriteReal(c, name, 3, reaction));
  }
  if (model->ranks ? model->ranks->walls : model->walls.n) PetscCall(DemSaveRows_Internal(model, c, "dem/traction", DEM_OF_WALLS, 1, DEM_TRACTION, model->traction_new));
  PetscCall(DemToolsSave_Internal(model, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemLoad_Internal(void *ctx, Checkpoint c)
{
  DemModel       model = ctx;
  const PetscInt n = model->n;
  PetscReal      scalar[SCALARS];
  PetscInt      *number;
  PetscBool      same = PETSC_TRUE, first = (PetscBool)(!model->ranks || model->ranks->rank == 0);
  char           name[64];

  PetscFunctionBegin;
  PetscCall(CheckpointReadReal(c, "dem/scalars", SCALARS, scalar));
  if (model->statics) PetscCall(CheckpointReadReal(c, "dem/static_reference", 1, DemStaticReference_Internal(model)));
  PetscCall(PetscMalloc1(n, &number));
  PetscCall(DemLoadInts_Internal(model, c, "dem/number", DEM_OF_PARTICLES, number));
  for (PetscInt p = 0; p < model->own; p++) same = (PetscBool)(same && number[p] == (model->ranks ? model->ranks->number : model->at)[p]);
  PetscCall(PetscFree(number));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPIU_BOOL, MPI_LAND, model->comm));
  BaseCheckInput(same, model->comm, "The checkpoint's particles stand in another order: it belongs to another packing than this scene makes");
  PetscCall(DemLoadRows_Internal(model, c, "dem/displacement", DEM_OF_PARTICLES, 3, 1, model->u));
  PetscCall(DemLoadRows_Internal(model, c, "dem/velocity", DEM_OF_PARTICLES, 3, 1, model->v));
  PetscCall(DemLoadRows_Internal(model, c, "dem/rotation", DEM_OF_PARTICLES, 4, 1, model->rot));
  PetscCall(DemLoadRows_Internal(model, c, "dem/spin", DEM_OF_PARTICLES, 3, 1, model->spin));
  PetscCall(DemLoadRows_Internal(model, c, "dem/force", DEM_OF_PARTICLES, 3, 1, model->f));
  PetscCall(DemLoadRows_Internal(model, c, "dem/couple", DEM_OF_PARTICLES, 3, 1, model->torque));
  PetscCall(DemLoadRows_Internal(model, c, "dem/dilation", DEM_OF_PARTICLES, 1, 1, model->dilation));
  PetscCall(DemLoadRows_Internal(model, c, "dem/vstar", DEM_OF_PARTICLES, 1, 1, model->vstar));
  if (model->crack.damage) PetscCall(LoadCracks(model, c));
  if (model->contacts.on) PetscCall(DemContactsLoad_Internal(model, c));
  if (model->rain.rate > 0) PetscCall(DemRainLoad_Internal(model, c));
  PetscCall(DemClumpsLoad_Internal(model, c));
  if (model->net) PetscCall(DemRuleLoad_Internal(model, c));
  model->time          = scalar[0];
  model->dt_last       = scalar[1];
  model->started       = (PetscBool)(scalar[2] != 0);
  model->work          = scalar[3];
  model->work_in       = scalar[4];
  model->damped        = first ? scalar[5] : 0; /* sums over the ranks: one of them goes on with all there was */
  model->contact_lost  = first ? scalar[6] : 0;
  model->friction_lost = first ? scalar[7] : 0;
  model->stable        = scalar[8];
  DemFacesSetTime_Internal(model, model->time);
  for (PetscInt k = 0; k < model->n_faces; k++) {
    PetscCall(BaseFormat(name, "dem/reaction_%" PetscInt_FMT, k));
    PetscCall(CheckpointReadReal(c, name, 3, model->face[k].reaction));
    for (PetscInt d = 0; d < 3; d++) model->face[k].reaction[d] *= first ? 1 : 0;
  }
  if (model->ranks ? model->ranks->walls : model->walls.n) PetscCall(DemLoadRows_Internal(model, c, "dem/traction", DEM_OF_WALLS, 1, DEM_TRACTION, model->traction_new));
  for (PetscInt i = 0; i < model->walls.n; i++) model->traction_old[DEM_TRACTION * i + DEM_TRACTION_ENDED] = model->traction_new[DEM_TRACTION * i + DEM_TRACTION_ENDED];
  PetscCall(DemToolsLoad_Internal(model, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

