/*
  dem_ranks_migrate.c - a body that is shared out among ranks is shared out anew.

  Grains move, bonds break, contacts come and go: owners that were right at the start need not stay so. Every so many steps the work of
  each unit of particles is counted; when the busiest rank has much more than its share, and other owners would mend it, the body goes
  over to them between two steps. Its state goes through a checkpoint in memory, as a restart's would; the rest, which no checkpoint
  holds (bonds, facets, what the cells were), goes from rank to rank. Nothing in a step hangs on who owns what, so the bits stay.
*/
#include "checkpoint.h"
#include "dem_impl.h"

#define UNEVEN 1.2   /* load of the busiest rank over the mean from which other owners are looked for */
#define BETTER 0.95  /* of the load now, what other owners must bring it to */
#define CHANGED 1.05 /* of the load last found, from which it is worth looking again */

static PetscMPIInt OwnerOf(const DemRanks r, const PetscMPIInt owner[], PetscInt id) { return owner[id / r->unit]; }

/* Every name of a particle becomes its number on one rank. */
static PetscErrorCode ToNumbers(DemModel model)
{
  const PetscInt *id = model->ranks->id;
  DemCells       *c = &model->cells;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < model->bonds.n; e++) {
    model->bonds.p[e] = id[model->bonds.p[e]];
    model->bonds.q[e] = id[model->bonds.q[e]];
    if (model->bonds.facet[e] >= 0) model->bonds.facet[e] = model->ranks->facet[model->bonds.facet[e]];
  }
  for (PetscInt f = 0; f < c->n_facets; f++) {
    c->p[f] = id[c->p[f]];
    c->q[f] = id[c->q[f]];
  }
  for (PetscInt w = 0; w < c->n_walls; w++) c->wall_p[w] = id[c->wall_p[w]];
  for (PetscInt i = 0; i < model->walls.n; i++) model->walls.owner[i] = id[model->walls.owner[i]];
  for (PetscInt k = 0; k < model->n_history; k++) {
    DemHistory *h = &model->history[k];

    if (h->quantity[0] == 'p' && h->particle >= 0) h->particle = id[h->particle];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows counted here, with the numbers of their one or two particles, to those who will need them. */
static PetscErrorCode Push(DemModel model, const PetscMPIInt owner[], PetscInt rows, const PetscInt key[], const PetscInt p[], const PetscInt q[],
                           PetscInt **keys, DemCarry *carry)
{
  const DemRanks r = model->ranks;
  PetscInt      *row, *of, pushed = 0;
  PetscMPIInt   *to;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(rows, &row, rows, &of, 2 * rows, &to));
  for (PetscInt k = 0; k < rows; k++) {
    if (DemOwnOf(r, p[k]) < 0) continue; /* another's to count */
    row[pushed] = k;
    of[pushed] = key[k];
    to[2 * pushed] = OwnerOf(r, owner, p[k]);
    to[2 * pushed + 1] = q ? OwnerOf(r, owner, q[k]) : -1;
    pushed++;
  }
  PetscCall(DemCarryPush_Internal(model->comm, rows, pushed, row, of, to, keys, carry));
  PetscCall(PetscFree3(row, of, to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The other ends of what has come. */
static PetscErrorCode FindGhosts(DemModel model, DemPart *part)
{
  PetscInt *near, n = 2 * (part->bonds + part->facets);

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &near));
  PetscCall(DemCarryInto_Internal(&part->of_bonds, sizeof(PetscInt), model->bonds.p, near));
  PetscCall(DemCarryInto_Internal(&part->of_bonds, sizeof(PetscInt), model->bonds.q, near + part->bonds));
  PetscCall(DemCarryInto_Internal(&part->of_facets, sizeof(PetscInt), model->cells.p, near + 2 * part->bonds));
  PetscCall(DemCarryInto_Internal(&part->of_facets, sizeof(PetscInt), model->cells.q, near + 2 * part->bonds + part->facets));
  PetscCall(DemPartGhosts_Internal(model, n, near, part));
  PetscCall(PetscFree(near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From where each of the part's particles comes: from its owner so far. */
static PetscErrorCode FindParticles(DemModel model, DemPart *part)
{
  const DemRanks r = model->ranks;
  PetscSFNode   *from;

  PetscFunctionBegin;
  part->of_particles = (DemCarry){.n = part->n, .comm = model->comm};
  PetscCall(PetscMalloc1(part->n, &from));
  for (PetscInt p = 0; p < part->n; p++) {
    const PetscInt unit = part->id[p] / r->unit;

    from[p] = (PetscSFNode){.rank = r->unit_owner[unit], .index = r->unit_start[unit] + part->id[p] - unit * r->unit};
  }
  PetscCall(PetscSFCreate(model->comm, &part->of_particles.sf));
  PetscCall(PetscSFSetGraph(part->of_particles.sf, model->own, part->n, NULL, PETSC_COPY_VALUES, from, PETSC_COPY_VALUES));
  PetscCall(PetscSFSetUp(part->of_particles.sf));
  PetscCall(PetscFree(from));
  part->of_packing = part->of_particles;
  PetscCall(PetscObjectReference((PetscObject)part->of_packing.sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Choose(DemModel model, const PetscMPIInt owner[], DemPart *part)
{
  const DemRanks r = model->ranks;
  PetscInt      *first;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(r->particles, &part->local));
  for (PetscInt p = 0; p < r->particles; p++) {
    part->local[p] = OwnerOf(r, owner, p) == r->rank ? part->own : -1;
    part->own += part->local[p] >= 0;
  }
  PetscCall(PetscMalloc1(part->own, &part->id));
  for (PetscInt p = 0; p < r->particles; p++)
    if (part->local[p] >= 0) part->id[part->local[p]] = p;
  PetscCall(Push(model, owner, model->bonds.n, r->bond, model->bonds.p, model->bonds.q, &part->bond, &part->of_bonds));
  PetscCall(Push(model, owner, model->cells.n_facets, r->facet, model->cells.p, model->cells.q, &part->facet, &part->of_facets));
  PetscCall(Push(model, owner, model->walls.n, r->wall, model->walls.owner, NULL, &part->wall, &part->of_walls));
  PetscCall(Push(model, owner, model->cells.n_walls, r->cell_wall, model->cells.wall_p, NULL, &part->cell_wall, &part->of_cell_walls));
  part->bonds = part->of_bonds.n;
  part->facets = part->of_facets.n;
  part->walls = part->of_walls.n;
  part->cell_walls = part->of_cell_walls.n;
  PetscCall(PetscMalloc1(r->blocks + 1, &first));
  for (PetscInt b = 0; b <= r->blocks; b++) first[b] = PetscMin(b * DEM_BLOCK, r->particles);
  PetscCall(DemPartBlocks_Internal(model, first, owner, part));
  PetscCall(PetscFree(first));
  PetscCall(FindGhosts(model, part));
  PetscCall(FindParticles(model, part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemMigrate_Internal(DemModel model, const PetscMPIInt owner[])
{
  DemRanks   r = model->ranks;
  Checkpoint state;
  DemPart    part = {0};

  PetscFunctionBegin;
  PetscCheck(model->contacts.fresh == NULL, model->comm, PETSC_ERR_ORDER, "Particles that have just woken must meet before they are shared out anew");
  PetscCall(CheckpointCreateInMemory(model->comm, &state));
  PetscCall(DemSave_Internal(model, state));
  PetscCall(ToNumbers(model));
  PetscCall(Choose(model, owner, &part));
  PetscCall(DemOwners_Internal(model, owner, r->unit_owner, r->unit_start));
  PetscCall(DemCut_Internal(model, &part));
  PetscCall(DemPartDestroy_Internal(&part));
  if (model->contacts.on) {
    PetscCall(DemContactsRoomDestroy_Internal(model));
    PetscCall(DemSetUpContactRoom_Internal(model));
  }
  PetscCall(DemLoad_Internal(model, state));
  PetscCall(CheckpointClose(&state));
  r->sharing.times++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemLookAtShares_Internal(DemModel model)
{
  DemRanks     r = model->ranks;
  PetscMPIInt *owner;
  PetscReal    load, now;

  PetscFunctionBegin;
  if (!r->every || r->steps++ % r->every || r->steps == 1) PetscFunctionReturn(PETSC_SUCCESS);
  r->sharing.looks++;
  PetscCall(PetscMalloc1((r->particles + r->unit - 1) / r->unit, &owner));
  PetscCall(DemPartition_Internal(model, r->unit, r->unit_owner, owner, &load, &now));
  if (now > UNEVEN && now > CHANGED * r->settled) {
    r->settled = now;
    if (load < BETTER * now) {
      r->settled = load;
      r->sharing.before = now;
      r->sharing.after = load;
      PetscCall(DemMigrate_Internal(model, owner));
    }
  }
  PetscCall(PetscFree(owner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetRebalance(DemModel model, PetscInt every)
{
  PetscFunctionBegin;
  BaseCheckInput(every >= 0, model->comm, "%" PetscInt_FMT " steps between looks at how a body is shared out: 0 (never) or more", every);
  model->rebalance = every;
  if (model->ranks) model->ranks->every = every;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelMigrate(DemModel model, const PetscMPIInt owner[])
{
  DemRanks     r = model->ranks;
  PetscMPIInt *best;
  PetscReal    load, now;

  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before sharing out anew");
  if (!r) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(!model->walls.n_rim && !model->weight_mass, model->comm, PETSC_ERR_ORDER, "The part of a coupled body keeps its owners until elements turn");
  for (PetscInt k = 0; owner && k * r->unit < r->particles; k++)
    PetscCheck(owner[k] >= 0 && owner[k] < r->size, model->comm, PETSC_ERR_ARG_OUTOFRANGE, "Owner %d of piece %" PetscInt_FMT ": ranks are 0 to %d", owner[k],
               k, r->size - 1);
  PetscCall(PetscMalloc1((r->particles + r->unit - 1) / r->unit, &best));
  if (!owner) PetscCall(DemPartition_Internal(model, r->unit, r->unit_owner, best, &load, &now));
  PetscCall(DemMigrate_Internal(model, owner ? owner : best));
  PetscCall(PetscFree(best));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetSharing(DemModel model, PetscInt *pieces, DemSharing *sharing)
{
  const DemRanks r = model->ranks;

  PetscFunctionBegin;
  if (pieces) *pieces = r ? (r->particles + r->unit - 1) / r->unit : 1;
  *sharing = r ? r->sharing : (DemSharing){0};
  PetscFunctionReturn(PETSC_SUCCESS);
}
