/*
  dem_ranks_partition.c - which rank owns which particles.

  What is shared out are units: 256 (with contacts 512) particles that follow each other along the space-filling curve. Three
  proposals are made, by pieces of the curve, by coordinate bisection and by PT-Scotch on the graph of the bonds and contacts between
  units; the one whose busiest rank has least to do is taken. A bond or contact between two ranks counts for both. Work is
  counted, not clocked: the same owners on every machine.
*/
#include "dem_impl.h"
#include <petscpartitioner.h>

/* Work of a step, in bonds without damage. */
#define PER_PARTICLE 3. /* kick, drift and copies */
#define PER_LIVE 3.     /* more, for a bond that is watched or damaged */
#define PER_TOUCH 3.    /* more, for a pair of the list that touches */

typedef struct {
  PetscInt   n, dim;               /* units */
  PetscReal *load;                 /* [n] */
  PetscReal *at;                   /* [n][3] mean position now */
  PetscInt  *start, *near, *joins; /* graph, both ways; joins: work of what joins the two, of an edge to a later unit */
} Units;

/* Two units that something joins, and its work: pairs here become those of all on rank 0, each once. */
static PetscErrorCode Join(DemModel model, PetscInt units, PetscInt *m, PetscInt **pair, PetscInt **work)
{
  PetscInt  n = *m, kept = 0, *all;
  PetscInt *row;

  PetscFunctionBegin;
  for (int pass = 0; pass < 2; pass++) { /* of this rank, then of all */
    PetscCall(PetscSortIntWithArray(n, *pair, *work));
    kept = 0;
    for (PetscInt k = 0; k < n; k++) {
      if (kept && (*pair)[k] == (*pair)[kept - 1])
        (*work)[kept - 1] += (*work)[k];
      else {
        (*pair)[kept] = (*pair)[k];
        (*work)[kept++] = (*work)[k];
      }
    }
    if (pass || !model->ranks) break;
    PetscCall(PetscMalloc1(2 * kept, &row));
    for (PetscInt k = 0; k < kept; k++) {
      row[2 * k] = (*pair)[k];
      row[2 * k + 1] = (*work)[k];
    }
    PetscCall(DemGatherInts_Internal(model, kept, *pair, 2, row, &n, &all));
    PetscCall(PetscFree(row));
    PetscCall(PetscRealloc((n + 1) * sizeof(PetscInt), pair));
    PetscCall(PetscRealloc((n + 1) * sizeof(PetscInt), work));
    for (PetscInt k = 0; k < n; k++) {
      (*pair)[k] = all[2 * k];
      (*work)[k] = all[2 * k + 1];
    }
    PetscCall(PetscFree(all));
  }
  *m = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The graph from pairs p * units + q, p < q. */
static PetscErrorCode Graph(Units *u, PetscInt m, const PetscInt pair[], const PetscInt work[])
{
  PetscInt *fill;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m; k++) {
    u->start[pair[k] / u->n + 1]++;
    u->start[pair[k] % u->n + 1]++;
  }
  for (PetscInt k = 0; k < u->n; k++) u->start[k + 1] += u->start[k];
  PetscCall(PetscMalloc1(u->n, &fill));
  PetscCall(PetscArraycpy(fill, u->start, u->n));
  PetscCall(PetscMalloc2(2 * m, &u->near, 2 * m, &u->joins));
  for (int side = 1; side >= 0; side--) /* ascending: earlier units first */
    for (PetscInt k = 0; k < m; k++) {
      const PetscInt p = pair[k] / u->n, q = pair[k] % u->n, from = side ? q : p;

      u->joins[fill[from]] = side ? 0 : work[k];
      u->near[fill[from]++] = side ? p : q;
    }
  PetscCall(PetscFree(fill));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt IdOf(DemModel model, PetscInt p) { return model->ranks ? model->ranks->id[p] : p; }

/* Of the whole body here, or of all ranks' parts of it: then loads and places on all, the graph on rank 0. */
static PetscErrorCode UnitsCreate(DemModel model, PetscInt unit, Units *u)
{
  const PetscInt       n = model->n, all = model->ranks ? model->ranks->particles : n, units = (all + unit - 1) / unit;
  const DemBonds      *b = &model->bonds;
  const DemContacts   *c = &model->contacts;
  const DemCrackState *crack = &model->crack;
  PetscInt            *pair, *work, m = 0;

  PetscFunctionBegin;
  u->n = units;
  u->dim = model->dim;
  PetscCall(PetscCalloc3(units, &u->load, 3 * units, &u->at, units + 1, &u->start));
  for (PetscInt p = 0; p < model->own; p++) {
    const PetscInt k = IdOf(model, p) / unit, size = PetscMin(unit, all - k * unit);

    for (PetscInt d = 0; d < model->dim; d++) u->at[3 * k + d] += (model->x0[d * n + p] + model->u[d * n + p]) / (PetscReal)size;
    if (!c->gone || !c->gone[p]) u->load[k] += PER_PARTICLE;
  }
  PetscCall(PetscMalloc1(b->n + c->m + 1, &pair)); /* units that something joins */
  PetscCall(PetscMalloc1(b->n + c->m + 1, &work));
  for (PetscInt e = 0; e < b->n; e++) {
    const PetscInt p = IdOf(model, b->p[e]) / unit, q = IdOf(model, b->q[e]) / unit, cost = 1 + (crack->damage && crack->state[e] ? (PetscInt)PER_LIVE : 0);

    if (!DemBondIsMine(model, e)) continue;
    u->load[p] += cost;
    if (p == q) continue;
    pair[m] = p * units + q;
    work[m++] = cost;
  }
  for (PetscInt k = 0; k < c->m; k++) {
    const PetscInt p = DemContactId_Internal(model, c->p[k]) / unit, q = DemContactId_Internal(model, c->q[k]) / unit,
                   cost = 1 + (c->met[k] ? (PetscInt)PER_TOUCH : 0);

    if (c->p[k] >= model->own) continue;
    u->load[p] += cost;
    if (p == q) continue;
    pair[m] = p * units + q;
    work[m++] = cost;
  }
  if (model->ranks) { /* a unit has one owner: nothing is rounded */
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, u->load, (PetscMPIInt)units, MPIU_REAL, MPI_SUM, model->comm));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, u->at, 3 * (PetscMPIInt)units, MPIU_REAL, MPI_SUM, model->comm));
  }
  PetscCall(Join(model, units, &m, &pair, &work));
  PetscCall(Graph(u, m, pair, work));
  PetscCall(PetscFree(pair));
  PetscCall(PetscFree(work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode UnitsDestroy(Units *u)
{
  PetscFunctionBegin;
  PetscCall(PetscFree3(u->load, u->at, u->start));
  PetscCall(PetscFree2(u->near, u->joins));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cut the list where `parts` shares of the load end, halving the parts. axes: sort along the longest extent first. */
static PetscErrorCode Bisect(const Units *u, PetscBool axes, PetscInt n, PetscInt list[], PetscMPIInt first, PetscMPIInt parts, PetscMPIInt owner[])
{
  const PetscMPIInt half = parts / 2;
  PetscReal         all = 0, sum = 0;
  PetscInt          cut = 0;

  PetscFunctionBegin;
  if (parts == 1) {
    for (PetscInt k = 0; k < n; k++) owner[list[k]] = first;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (axes) {
    PetscReal low[3], high[3], *key;
    PetscInt  a = 0;

    for (PetscInt d = 0; d < 3; d++) {
      low[d] = PETSC_MAX_REAL;
      high[d] = PETSC_MIN_REAL;
      for (PetscInt k = 0; k < n; k++) {
        low[d] = PetscMin(low[d], u->at[3 * list[k] + d]);
        high[d] = PetscMax(high[d], u->at[3 * list[k] + d]);
      }
      if (high[d] - low[d] > high[a] - low[a]) a = d;
    }
    PetscCall(PetscMalloc1(n, &key));
    for (PetscInt k = 0; k < n; k++) key[k] = u->at[3 * list[k] + a];
    PetscCall(PetscSortRealWithArrayInt(n, key, list));
    PetscCall(PetscFree(key));
  }
  for (PetscInt k = 0; k < n; k++) all += u->load[list[k]];
  while (cut < n - (parts - half) && (cut < half || sum + 0.5 * u->load[list[cut]] < all * half / parts)) sum += u->load[list[cut++]];
  PetscCall(Bisect(u, axes, cut, list, first, half, owner));
  PetscCall(Bisect(u, axes, n - cut, list + cut, first + half, parts - half, owner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ByGraph(const Units *u, PetscMPIInt parts, PetscMPIInt owner[], PetscBool *made)
{
#if defined(PETSC_HAVE_PTSCOTCH)
  PetscPartitioner partitioner;
  PetscSection     weight, part;
  IS               is;
  const PetscInt  *unit;

  PetscFunctionBegin;
  PetscCall(PetscSectionCreate(PETSC_COMM_SELF, &weight));
  PetscCall(PetscSectionSetChart(weight, 0, u->n));
  for (PetscInt k = 0; k < u->n; k++) PetscCall(PetscSectionSetDof(weight, k, (PetscInt)u->load[k]));
  PetscCall(PetscSectionSetUp(weight));
  PetscCall(PetscSectionCreate(PETSC_COMM_SELF, &part));
  PetscCall(PetscPartitionerCreate(PETSC_COMM_SELF, &partitioner));
  PetscCall(PetscPartitionerSetType(partitioner, PETSCPARTITIONERPTSCOTCH));
  PetscCall(PetscPartitionerSetUp(partitioner));
  PetscCall(PetscPartitionerPartition(partitioner, parts, u->n, u->start, u->near, weight, NULL, part, &is));
  PetscCall(ISGetIndices(is, &unit));
  for (PetscMPIInt r = 0; r < parts; r++) {
    PetscInt n, first;

    PetscCall(PetscSectionGetDof(part, r, &n));
    PetscCall(PetscSectionGetOffset(part, r, &first));
    for (PetscInt k = 0; k < n; k++) owner[unit[first + k]] = r;
  }
  PetscCall(ISRestoreIndices(is, &unit));
  PetscCall(ISDestroy(&is));
  PetscCall(PetscSectionDestroy(&weight));
  PetscCall(PetscSectionDestroy(&part));
  PetscCall(PetscPartitionerDestroy(&partitioner));
  *made = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
#else
  *made = PETSC_FALSE;
  return PETSC_SUCCESS;
#endif
}

/* Work of the busiest rank over the mean of what is done once; a rank without a unit is no rank. */
static PetscErrorCode Busiest(const Units *u, PetscMPIInt parts, const PetscMPIInt owner[], PetscReal *most)
{
  PetscReal *load, all = 0;
  PetscInt  *units;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(parts, &load, parts, &units));
  for (PetscInt k = 0; k < u->n; k++) {
    units[owner[k]]++;
    load[owner[k]] += u->load[k];
    all += u->load[k];
    for (PetscInt e = u->start[k]; e < u->start[k + 1]; e++)
      if (owner[k] != owner[u->near[e]]) load[owner[u->near[e]]] += (PetscReal)u->joins[e];
  }
  *most = 0;
  for (PetscMPIInt r = 0; r < parts; r++) *most = units[r] ? PetscMax(*most, load[r]) : PETSC_MAX_REAL;
  *most *= parts / PetscMax(all, 1);
  PetscCall(PetscFree2(load, units));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ranks within one proposal are named as most of their particles' owners were, so that what can stay stays. */
static PetscErrorCode Rename(const Units *u, PetscMPIInt parts, const PetscMPIInt was[], PetscMPIInt owner[])
{
  PetscReal   *shared; /* [parts][parts] load that goes from the one to the other */
  PetscMPIInt *name;
  PetscBool   *taken;

  PetscFunctionBegin;
  PetscCall(PetscCalloc3(parts * parts, &shared, parts, &name, parts, &taken));
  for (PetscInt k = 0; k < u->n; k++) shared[owner[k] * parts + was[k]] += 1 + u->load[k];
  for (PetscMPIInt s = 0; s < parts; s++) name[s] = -1;
  for (PetscMPIInt round = 0; round < parts; round++) {
    PetscMPIInt best = -1, to = -1;

    for (PetscMPIInt s = 0; s < parts; s++)
      for (PetscMPIInt t = 0; t < parts && name[s] < 0; t++)
        if (!taken[t] && (best < 0 || shared[s * parts + t] > shared[best * parts + to])) {
          best = s;
          to = t;
        }
    name[best] = to;
    taken[to] = PETSC_TRUE;
  }
  for (PetscInt k = 0; k < u->n; k++) owner[k] = name[owner[k]];
  PetscCall(PetscFree3(shared, name, taken));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Propose(const Units *u, PetscMPIInt parts, PetscMPIInt owner[], PetscReal *best)
{
  PetscMPIInt *try;
  PetscInt    *list;
  PetscReal    most;
  PetscBool    made = PETSC_TRUE;

  PetscFunctionBegin;
  *best = PETSC_MAX_REAL;
  PetscCall(PetscMalloc2(u->n, &list, u->n, &try));
  for (PetscInt k = 0; k < u->n; k++) owner[k] = u->n < parts ? (PetscMPIInt)k : 0;
  for (int way = 0; way < 3 && u->n >= parts; way++) {
    for (PetscInt k = 0; k < u->n; k++) list[k] = k;
    if (way < 2)
      PetscCall(Bisect(u, (PetscBool)(way == 1), u->n, list, 0, parts, try));
    else if (u->start[u->n])
      PetscCall(ByGraph(u, parts, try, &made));
    else
      made = PETSC_FALSE;
    if (!made) continue;
    PetscCall(Busiest(u, parts, try, &most));
    if (most >= *best) continue;
    *best = most;
    PetscCall(PetscArraycpy(owner, try, u->n));
  }
  PetscCall(PetscFree2(list, try));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemPartition_Internal(DemModel model, PetscInt unit, const PetscMPIInt was[], PetscMPIInt owner[], PetscReal *load, PetscReal *now)
{
  PetscMPIInt parts, rank;
  PetscReal   found[2] = {0, 0};
  PetscInt    units;
  Units       u = {0};

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(model->comm, &parts));
  PetscCallMPI(MPI_Comm_rank(model->comm, &rank));
  units = ((model->ranks ? model->ranks->particles : model->n) + unit - 1) / unit;
  if (rank == 0 || was) PetscCall(UnitsCreate(model, unit, &u));
  if (rank == 0) {
    if (was) PetscCall(Busiest(&u, parts, was, &found[1]));
    PetscCall(Propose(&u, parts, owner, &found[0]));
    if (was) PetscCall(Rename(&u, parts, was, owner));
  }
  PetscCall(UnitsDestroy(&u));
  PetscCallMPI(MPI_Bcast(owner, (PetscMPIInt)units, MPI_INT, 0, model->comm));
  PetscCallMPI(MPI_Bcast(found, 2, MPIU_REAL, 0, model->comm));
  *load = found[0];
  if (now) *now = found[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}
