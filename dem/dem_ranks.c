/*
  dem_ranks.c - which part of a model a rank keeps.

  Every rank sets up the whole body, so that checks, areas, the critical step are those of one rank to the last bit; then it
  takes its rows out of each array (dem_ranks_cut.c) and frees the rest. From there on memory and steps are shared out.
*/
#include "dem_impl.h"

static PetscBool IsOwn(const DemRanks r, PetscInt id)
{
  return (PetscBool)(r->unit_owner[id / r->unit] == r->rank);
}

PetscErrorCode DemOwners_Internal(DemModel model, const PetscMPIInt owner[], PetscMPIInt unit_owner[], PetscInt unit_start[])
{
  const DemRanks r = model->ranks;
  PetscInt      *filled;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(r->size, &filled));
  for (PetscInt k = 0; k * r->unit < r->particles; k++) {
    unit_owner[k] = owner[k];
    unit_start[k] = filled[owner[k]];
    filled[owner[k]] += PetscMin(r->unit, r->particles - k * r->unit);
  }
  PetscCall(PetscFree(filled));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Blocks with particles or bonds here. first [blocks of all + 1]: first particle of each. */
PetscErrorCode DemPartBlocks_Internal(DemModel model, const PetscInt first[], const PetscMPIInt unit_owner[], DemPart *part)
{
  const DemRanks r = model->ranks;
  PetscInt       e = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(r->blocks, &part->block, r->blocks + 1, &part->first, r->blocks + 1, &part->bond_start));
  part->first[0] = part->bond_start[0] = 0;
  for (PetscInt k = 0; k < r->blocks; k++) {
    const PetscBool mine   = (PetscBool)(unit_owner[first[k] / r->unit] == r->rank);
    const PetscInt  before = e;

    while (e < part->bonds && part->bond[e] < r->bond_start[k + 1]) e++;
    if (!mine && e == before) continue;
    part->block[part->blocks++]    = k;
    part->first[part->blocks]      = part->first[part->blocks - 1] + (mine ? first[k + 1] - first[k] : 0);
    part->bond_start[part->blocks] = e;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemPartGhosts_Internal(DemModel model, PetscInt n, const PetscInt id[], DemPart *part)
{
  const PetscInt own = part->own;
  PetscInt      *grown, ghosts = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++)
    if (part->local[id[k]] < 0) {
      part->local[id[k]] = own; /* found */
      ghosts++;
    }
  PetscCall(PetscMalloc1(own + ghosts, &grown));
  PetscCall(PetscArraycpy(grown, part->id, own));
  part->n = own;
  for (PetscInt k = 0; k < n; k++)
    if (part->local[id[k]] == own) {
      part->local[id[k]] = own + 1; /* listed */
      grown[part->n++]   = id[k];
    }
  PetscCall(PetscSortInt(ghosts, grown + own));
  for (PetscInt g = own; g < part->n; g++) part->local[grown[g]] = g;
  PetscCall(PetscFree(part->id));
  part->id = grown;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemPartDestroy_Internal(DemPart *part)
{
  DemCarry *const carry[] = {&part->of_particles, &part->of_packing, &part->of_bonds, &part->of_facets, &part->of_walls, &part->of_cell_walls};

  PetscFunctionBegin;
  for (size_t k = 0; k < sizeof(carry) / sizeof(carry[0]); k++) PetscCall(PetscSFDestroy(&carry[k]->sf));
  PetscCall(PetscFree(part->id));
  PetscCall(PetscFree(part->local));
  PetscCall(PetscFree(part->bond));
  PetscCall(PetscFree3(part->block, part->first, part->bond_start));
  PetscCall(PetscFree(part->facet));
  PetscCall(PetscFree(part->facet_local));
  PetscCall(PetscFree(part->wall));
  PetscCall(PetscFree(part->cell_wall));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* This rank's part of a body that is all here. */
static PetscErrorCode Choose(DemModel model, DemPart *part)
{
  const DemRanks  r = model->ranks;
  const DemBonds *bonds = &model->bonds;
  const DemCells *cells = &model->cells;
  const DemWalls *walls = &model->walls;
  PetscInt       *near, nears = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(model->n, &part->local));
  for (PetscInt p = 0; p < model->n; p++) {
    part->local[p] = IsOwn(r, p) ? part->own : -1;
    part->own += part->local[p] >= 0;
  }
  PetscCall(PetscMalloc1(part->own, &part->id));
  for (PetscInt p = 0; p < model->n; p++)
    if (part->local[p] >= 0) part->id[part->local[p]] = p;
  PetscCall(PetscMalloc1(bonds->n, &part->bond));
  PetscCall(PetscMalloc1(cells->n_facets, &part->facet));
  PetscCall(PetscMalloc1(walls->n, &part->wall));
  PetscCall(PetscMalloc1(cells->n_walls, &part->cell_wall));
  for (PetscInt e = 0; e < bonds->n; e++)
    if (IsOwn(r, bonds->p[e]) || IsOwn(r, bonds->q[e])) part->bond[part->bonds++] = e;
  for (PetscInt f = 0; f < cells->n_facets; f++)
    if (IsOwn(r, cells->p[f]) || IsOwn(r, cells->q[f])) part->facet[part->facets++] = f;
  for (PetscInt i = 0; i < walls->n; i++)
    if (IsOwn(r, walls->owner[i])) part->wall[part->walls++] = i;
  for (PetscInt w = 0; w < cells->n_walls; w++)
    if (IsOwn(r, cells->wall_p[w])) part->cell_wall[part->cell_walls++] = w;
  PetscCall(DemPartBlocks_Internal(model, model->blocks.first, r->unit_owner, part));
  PetscCall(PetscMalloc1(2 * (part->bonds + part->facets), &near));
  for (PetscInt e = 0; e < part->bonds; e++) {
    near[nears++] = bonds->p[part->bond[e]];
    near[nears++] = bonds->q[part->bond[e]];
  }
  for (PetscInt f = 0; f < part->facets; f++) {
    near[nears++] = cells->p[part->facet[f]];
    near[nears++] = cells->q[part->facet[f]];
  }
  PetscCall(DemPartGhosts_Internal(model, nears, near, part));
  PetscCall(PetscFree(near));
  part->of_particles  = (DemCarry){.n = part->n, .take = part->id};
  part->of_bonds      = (DemCarry){.n = part->bonds, .take = part->bond};
  part->of_facets     = (DemCarry){.n = part->facets, .take = part->facet};
  part->of_walls      = (DemCarry){.n = part->walls, .take = part->wall};
  part->of_cell_walls = (DemCarry){.n = part->cell_walls, .take = part->cell_wall};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What stands by the packing's numbers is told by those in the order of the model. */
static void ByOrder(DemModel model)
{
  DemCells *c = &model->cells;

  for (PetscInt f = 0; f < c->n_facets; f++) {
    c->p[f] = model->rank_of[c->p[f]];
    c->q[f] = model->rank_of[c->q[f]];
  }
  for (PetscInt w = 0; w < c->n_walls; w++) c->wall_p[w] = model->rank_of[c->wall_p[w]];
  for (PetscInt k = 0; k < model->n_history; k++) {
    DemHistory *h = &model->history[k];

    if (h->quantity[0] == 'p' && h->particle >= 0) h->particle = model->rank_of[h->particle];
  }
}

static PetscErrorCode Refuse(DemModel model)
{
  PetscFunctionBegin;
  BaseCheckInput(!model->clumps.n, model->comm, "Clumps run on one rank for now; give them threads instead: cleave run SCENE --threads N");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemSpread_Internal(DemModel model)
{
  PetscMPIInt size, rank, *owner;
  PetscInt    unit = model->contacts.on ? DEM_CONTACT_BLOCK : DEM_BLOCK, units, *packed;
  PetscReal   dt;
  DemRanks    r;
  DemPart     part = {0};

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(model->comm, &size));
  if (size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Comm_rank(model->comm, &rank));
  PetscCall(Refuse(model));
  while (model->n / unit > 20000) unit *= 2;
  units = (model->n + unit - 1) / unit;
  /* the particles of a coupled body may be few at first: ranks without any wait until more have woken */
  BaseCheckInput(units >= size || model->weight_mass, model->comm, "%" PetscInt_FMT " particles are %" PetscInt_FMT " pieces of %" PetscInt_FMT ", too few for %d ranks; use %" PetscInt_FMT " at most, or threads", model->n, units, unit, (int)size, units);
  PetscCall(DemModelGetCriticalStep(model, &dt)); /* of the whole body: kept */

  PetscCall(PetscNew(&r));
  r->size       = size;
  r->rank       = rank;
  r->unit       = unit;
  r->every      = model->rebalance;
  r->particles  = model->n;
  r->bonds      = model->bonds.n;
  r->walls      = model->walls.n;
  r->cell_walls = model->cells.n_walls;
  r->facets     = model->cells.n_facets;
  r->blocks     = model->blocks.n_blocks;
  PetscCall(PetscMalloc1(units, &owner));
  PetscCall(PetscMalloc2(units, &r->unit_owner, units, &r->unit_start));
  PetscCall(DemPartition_Internal(model, unit, NULL, owner, &r->settled, NULL));
  PetscCallMPI(MPI_Type_contiguous(7, MPIU_REAL, &r->motion));
  PetscCallMPI(MPI_Type_commit(&r->motion));
  PetscCallMPI(MPI_Type_contiguous(6, MPIU_REAL, &r->stress));
  PetscCallMPI(MPI_Type_commit(&r->stress));
  PetscCall(PetscMalloc1(r->blocks + 1, &r->bond_start));
  PetscCall(PetscArraycpy(r->bond_start, model->blocks.bond, r->blocks + 1));
  PetscCall(PetscMalloc1(model->n, &r->number));
  PetscCall(PetscArraycpy(r->number, model->at, model->n));

  model->ranks = r;
  PetscCall(DemOwners_Internal(model, owner, r->unit_owner, r->unit_start));
  PetscCall(PetscFree(owner));
  ByOrder(model);
  PetscCall(Choose(model, &part));
  PetscCall(PetscMalloc1(part.n, &packed));
  for (PetscInt p = 0; p < part.n; p++) packed[p] = model->at[part.id[p]];
  part.of_packing = (DemCarry){.n = part.n, .take = packed};
  PetscCall(DemCut_Internal(model, &part));
  PetscCall(PetscFree(packed));
  PetscCall(DemPartDestroy_Internal(&part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemRanksDestroy_Internal(DemModel model)
{
  DemRanks r = model->ranks;

  PetscFunctionBegin;
  if (!r) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(r->id));
  PetscCall(PetscFree(r->number));
  PetscCall(PetscFree(r->bond));
  PetscCall(PetscFree(r->wall));
  PetscCall(PetscFree(r->facet));
  PetscCall(PetscFree(r->cell_wall));
  PetscCall(PetscFree(r->block));
  PetscCall(PetscFree(r->bond_start));
  PetscCall(PetscFree(r->mine));
  PetscCall(PetscFree(r->block_mine));
  PetscCall(PetscFree2(r->unit_owner, r->unit_start));
  PetscCall(DemHaloDestroy_Internal(&r->halo));
  PetscCallMPI(MPI_Type_free(&r->motion));
  PetscCallMPI(MPI_Type_free(&r->stress));
  PetscCall(PetscFree(model->ranks));
  PetscFunctionReturn(PETSC_SUCCESS);
}
