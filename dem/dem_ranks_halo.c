/* dem_ranks_halo.c - what ranks tell each other in a step: motion of the ghosts, dilations, stresses; sums in the order of the ranks. */
#include "dem_impl.h"

/* Who sends what: ghosts learn where their owner keeps them, the owners which of their particles are wanted. */
PetscErrorCode DemHaloSetUp_Internal(DemModel model)
{
  DemRanks       r = model->ranks;
  const PetscInt own = model->own;
  PetscSFNode   *from;
  PetscInt      *row, *theirs;
  const PetscInt *degree;
  PetscSF        all;

  PetscFunctionBegin;
  PetscCall(PetscSFDestroy(&r->sf));
  PetscCall(PetscFree(r->border));
  PetscCall(PetscFree2(r->out, r->in));
  PetscCall(PetscMalloc1(r->ghosts, &from));
  PetscCall(PetscMalloc2(own, &row, r->ghosts, &theirs));
  for (PetscInt g = 0; g < r->ghosts; g++) {
    const PetscInt id = r->id[own + g], unit = id / r->unit;

    from[g].rank  = r->unit_owner[unit];
    from[g].index = r->unit_start[unit] + id - unit * r->unit;
  }
  PetscCall(PetscSFCreate(model->comm, &all));
  PetscCall(PetscSFSetGraph(all, own, r->ghosts, NULL, PETSC_COPY_VALUES, from, PETSC_COPY_VALUES));
  PetscCall(PetscSFSetUp(all));
  PetscCall(PetscSFComputeDegreeBegin(all, &degree));
  PetscCall(PetscSFComputeDegreeEnd(all, &degree));
  r->n_border = 0;
  for (PetscInt p = 0; p < own; p++) r->n_border += degree[p] > 0;
  PetscCall(PetscMalloc1(r->n_border, &r->border));
  for (PetscInt p = 0, k = 0; p < own; p++) {
    row[p] = degree[p] > 0 ? k : -1;
    if (degree[p] > 0) r->border[k++] = p;
  }
  PetscCall(PetscSFBcastBegin(all, MPIU_INT, row, theirs, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(all, MPIU_INT, row, theirs, MPI_REPLACE));
  PetscCall(PetscSFDestroy(&all));
  for (PetscInt g = 0; g < r->ghosts; g++) from[g].index = theirs[g];
  PetscCall(PetscSFCreate(model->comm, &r->sf));
  PetscCall(PetscSFSetGraph(r->sf, r->n_border, r->ghosts, NULL, PETSC_COPY_VALUES, from, PETSC_COPY_VALUES));
  PetscCall(PetscSFSetUp(r->sf));
  PetscCall(PetscFree(from));
  PetscCall(PetscFree2(row, theirs));
  PetscCall(PetscMalloc2(13 * r->n_border, &r->out, 13 * r->ghosts, &r->in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Send(DemRanks r, MPI_Datatype record)
{
  PetscFunctionBegin;
  PetscCall(PetscSFBcastBegin(r->sf, record, r->out, r->in, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(r->sf, record, r->out, r->in, MPI_REPLACE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One column-major array of k columns into the records at `at`, or back. */
static void Pack(DemRanks r, PetscInt n, PetscInt k, PetscInt at, const PetscReal *a)
{
  for (PetscInt d = 0; d < k; d++)
    for (PetscInt b = 0; b < r->n_border; b++) r->out[r->wide * b + at + d] = a[d * n + r->border[b]];
}

static void Unpack(DemRanks r, PetscInt n, PetscInt own, PetscInt k, PetscInt at, PetscReal *a)
{
  for (PetscInt d = 0; d < k; d++)
    for (PetscInt g = 0; g < r->ghosts; g++) a[d * n + own + g] = r->in[r->wide * g + at + d];
}

PetscErrorCode DemHaloMotion_Internal(DemModel model)
{
  DemRanks       r = model->ranks;
  const PetscInt n = model->n, own = model->own;

  PetscFunctionBegin;
  Pack(r, n, 3, 0, model->u);
  Pack(r, n, 4, 3, model->rot);
  if (r->wide > 7) { /* contacts go by velocities too */
    Pack(r, n, 3, 7, model->v);
    Pack(r, n, 3, 10, model->spin);
  }
  PetscCall(Send(r, r->motion));
  Unpack(r, n, own, 3, 0, model->u);
  Unpack(r, n, own, 4, 3, model->rot);
  if (r->wide > 7) {
    Unpack(r, n, own, 3, 7, model->v);
    Unpack(r, n, own, 3, 10, model->spin);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemHaloReal_Internal(DemModel model, PetscReal *a)
{
  DemRanks r = model->ranks;

  PetscFunctionBegin;
  for (PetscInt b = 0; b < r->n_border; b++) r->out[b] = a[r->border[b]];
  PetscCall(PetscSFBcastBegin(r->sf, MPIU_REAL, r->out, a + model->own, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(r->sf, MPIU_REAL, r->out, a + model->own, MPI_REPLACE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemHaloStress_Internal(DemModel model, PetscReal *a)
{
  DemRanks r = model->ranks;

  PetscFunctionBegin;
  for (PetscInt b = 0; b < r->n_border; b++)
    for (PetscInt c = 0; c < 6; c++) r->out[6 * b + c] = a[6 * r->border[b] + c];
  PetscCall(PetscSFBcastBegin(r->sf, r->stress, r->out, a + 6 * model->own, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(r->sf, r->stress, r->out, a + 6 * model->own, MPI_REPLACE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemSumRanks_Internal(DemModel model, PetscInt n, PetscReal *a)
{
  DemRanks   r = model->ranks;
  PetscReal *all;

  PetscFunctionBegin;
  if (!r) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(n * r->size, &all));
  PetscCallMPI(MPI_Allgather(a, (PetscMPIInt)n, MPIU_REAL, all, (PetscMPIInt)n, MPIU_REAL, model->comm));
  for (PetscInt k = 0; k < n; k++) {
    a[k] = 0;
    for (PetscMPIInt s = 0; s < r->size; s++) a[k] += all[n * s + k];
  }
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Work goes in with its sign, and as an amount: only the sum over the ranks has one, so it waits for the sum. */
PetscErrorCode DemRanksWork_Internal(DemModel model, PetscReal work)
{
  DemRanks r = model->ranks;

  PetscFunctionBegin;
  r->work[r->n_work++] = work;
  if (r->n_work == DEM_RANKS_WORK) PetscCall(DemRanksFlush_Internal(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemRanksFlush_Internal(DemModel model)
{
  DemRanks r = model->ranks;

  PetscFunctionBegin;
  if (!r || !r->n_work) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DemSumRanks_Internal(model, r->n_work, r->work));
  for (PetscInt k = 0; k < r->n_work; k++) {
    model->work += r->work[k];
    model->work_in += PetscAbsReal(r->work[k]);
  }
  r->n_work = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
