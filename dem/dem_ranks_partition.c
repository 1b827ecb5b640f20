/*
  dem_ranks_partition.c - which rank owns which particles.

  What is shared out are units: 256 (with contacts 512) particles that follow each other along the space-filling curve. Three
  proposals are made, by pieces of the curve, by coordinate bisection and by PT-Scotch on the graph of the bonds between
  units; the one whose busiest rank has least to do is taken. A bond between two ranks counts for both.
*/
#include "dem_impl.h"
#include <petscpartitioner.h>

#define PER_PARTICLE 3. /* a particle's kick, drift and copies cost as much as so many bonds */

typedef struct {
  PetscInt   n, dim; /* units */
  PetscReal *load;   /* [n] */
  PetscReal *at;     /* [n][3] mean position */
  PetscInt  *start, *near; /* graph */
} Units;

static PetscErrorCode UnitsCreate(DemModel model, PetscInt unit, Units *u)
{
  const PetscInt  n = model->n, units = (n + unit - 1) / unit;
  const DemBonds *b = &model->bonds;
  PetscInt       *pair, m = 0;

  PetscFunctionBegin;
  u->n   = units;
  u->dim = model->dim;
  PetscCall(PetscCalloc3(units, &u->load, 3 * units, &u->at, units + 1, &u->start));
  for (PetscInt p = 0; p < n; p++) {
    const PetscInt k = p / unit, size = PetscMin(unit, n - k * unit);

    u->load[k] += PER_PARTICLE;
    for (PetscInt d = 0; d < model->dim; d++) u->at[3 * k + d] += (model->x0[d * n + p] + model->u[d * n + p]) / (PetscReal)size;
  }
  for (PetscInt e = 0; e < b->n; e++) u->load[b->p[e] / unit]++;
  PetscCall(PetscMalloc1(2 * b->n, &pair)); /* units whose bonds meet, both ways */
  for (PetscInt e = 0; e < b->n; e++) {
    const PetscInt p = b->p[e] / unit, q = b->q[e] / unit;

    if (p == q) continue;
    pair[m++] = p * units + q;
    pair[m++] = q * units + p;
  }
  PetscCall(PetscSortRemoveDupsInt(&m, pair));
  PetscCall(PetscMalloc1(m, &u->near));
  for (PetscInt k = 0; k < m; k++) {
    u->start[pair[k] / units + 1]++;
    u->near[k] = pair[k] % units;
  }
  for (PetscInt k = 0; k < units; k++) u->start[k + 1] += u->start[k];
  PetscCall(PetscFree(pair));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode UnitsDestroy(Units *u)
{
  PetscFunctionBegin;
  PetscCall(PetscFree3(u->load, u->at, u->start));
  PetscCall(PetscFree(u->near));
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
    PetscReal  low[3], high[3], *key;
    PetscInt   a = 0;

    for (PetscInt d = 0; d < 3; d++) {
      low[d]  = PETSC_MAX_REAL;
      high[d] = PETSC_MIN_REAL;
      for (PetscInt k = 0; k < n; k++) {
        low[d]  = PetscMin(low[d], u->at[3 * list[k] + d]);
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

/* Work of the busiest rank; a rank without a unit is no rank. */
static PetscErrorCode Busiest(DemModel model, const Units *u, PetscInt unit, PetscMPIInt parts, const PetscMPIInt owner[], PetscReal *most)
{
  const DemBonds *b = &model->bonds;
  PetscReal      *load;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(parts, &load));
  for (PetscInt k = 0; k < u->n; k++) load[owner[k]] += u->load[k];
  for (PetscInt e = 0; e < b->n; e++)
    if (owner[b->p[e] / unit] != owner[b->q[e] / unit]) load[owner[b->q[e] / unit]]++;
  *most = 0;
  for (PetscMPIInt r = 0; r < parts; r++) *most = load[r] > 0 ? PetscMax(*most, load[r]) : PETSC_MAX_REAL;
  PetscCall(PetscFree(load));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemPartition_Internal(DemModel model, PetscInt unit, PetscMPIInt owner[])
{
  PetscMPIInt  parts, rank, *try;
  PetscReal    best = PETSC_MAX_REAL, most = 0;
  PetscInt    *list;
  PetscBool    made = PETSC_TRUE;
  Units        u = {0};

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(model->comm, &parts));
  PetscCallMPI(MPI_Comm_rank(model->comm, &rank));
  if (rank == 0) {
    PetscCall(UnitsCreate(model, unit, &u));
    PetscCall(PetscMalloc2(u.n, &list, u.n, &try));
    for (PetscInt k = 0; k < u.n; k++) owner[k] = 0;
    for (PetscInt k = 0; k < u.n && u.n < parts; k++) owner[k] = (PetscMPIInt)k;
    for (int way = 0; way < 3 && u.n >= parts; way++) {
      for (PetscInt k = 0; k < u.n; k++) list[k] = k;
      if (way < 2) PetscCall(Bisect(&u, (PetscBool)(way == 1), u.n, list, 0, parts, try));
      else if (model->bonds.n) PetscCall(ByGraph(&u, parts, try, &made));
      else made = PETSC_FALSE;
      if (!made) continue;
      PetscCall(Busiest(model, &u, unit, parts, try, &most));
      if (most >= best) continue;
      best = most;
      PetscCall(PetscArraycpy(owner, try, u.n));
    }
    PetscCall(PetscFree2(list, try));
    PetscCall(UnitsDestroy(&u));
  }
  PetscCallMPI(MPI_Bcast(owner, (PetscMPIInt)((model->n + unit - 1) / unit), MPI_INT, 0, model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
