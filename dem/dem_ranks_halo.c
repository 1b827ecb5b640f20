/* dem_ranks_halo.c - what ranks tell each other in a step: motion of the ghosts, dilations, stresses; sums in the order of the ranks. */
#include "dem_impl.h"

/* Who sends what: copies learn where their owner keeps them, the owners which of their particles are wanted. */
PetscErrorCode DemHaloSetUp_Internal(DemModel model, PetscInt n, const PetscInt id[], DemHalo *halo)
{
  const DemRanks  r = model->ranks;
  const PetscInt  own = model->own;
  PetscSFNode    *from;
  PetscInt       *row, *theirs;
  const PetscInt *degree;
  PetscSF         all;

  PetscFunctionBegin;
  PetscCall(DemHaloDestroy_Internal(halo));
  halo->n = n;
  PetscCall(PetscMalloc1(n, &from));
  PetscCall(PetscMalloc2(own, &row, n, &theirs));
  for (PetscInt g = 0; g < n; g++) {
    const PetscInt unit = id[g] / r->unit;

    from[g].rank  = r->unit_owner[unit];
    from[g].index = r->unit_start[unit] + id[g] - unit * r->unit;
  }
  PetscCall(PetscSFCreate(model->comm, &all));
  PetscCall(PetscSFSetGraph(all, own, n, NULL, PETSC_COPY_VALUES, from, PETSC_COPY_VALUES));
  PetscCall(PetscSFSetUp(all));
  PetscCall(PetscSFComputeDegreeBegin(all, &degree));
  PetscCall(PetscSFComputeDegreeEnd(all, &degree));
  for (PetscInt p = 0; p < own; p++) halo->n_border += degree[p] > 0;
  PetscCall(PetscMalloc1(halo->n_border, &halo->border));
  for (PetscInt p = 0, k = 0; p < own; p++) {
    row[p] = degree[p] > 0 ? k : -1;
    if (degree[p] > 0) halo->border[k++] = p;
  }
  PetscCall(PetscSFBcastBegin(all, MPIU_INT, row, theirs, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(all, MPIU_INT, row, theirs, MPI_REPLACE));
  PetscCall(PetscSFDestroy(&all));
  for (PetscInt g = 0; g < n; g++) from[g].index = theirs[g];
  PetscCall(PetscSFCreate(model->comm, &halo->sf));
  PetscCall(PetscSFSetGraph(halo->sf, halo->n_border, n, NULL, PETSC_COPY_VALUES, from, PETSC_COPY_VALUES));
  PetscCall(PetscSFSetUp(halo->sf));
  PetscCall(PetscFree(from));
  PetscCall(PetscFree2(row, theirs));
  PetscCall(PetscMalloc2(DEM_HALO_ROW * halo->n_border, &halo->out, DEM_HALO_ROW * n, &halo->in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemHaloDestroy_Internal(DemHalo *halo)
{
  PetscFunctionBegin;
  PetscCall(PetscSFDestroy(&halo->sf));
  PetscCall(PetscFree(halo->border));
  PetscCall(PetscFree2(halo->out, halo->in));
  halo->n = halo->n_border = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemHaloSend_Internal(DemHalo *halo, MPI_Datatype record)
{
  PetscFunctionBegin;
  PetscCall(PetscSFBcastBegin(halo->sf, record, halo->out, halo->in, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(halo->sf, record, halo->out, halo->in, MPI_REPLACE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define MOTION 7 /* displacement, rotation */

/* One column-major array of k columns into the records at `at`, or back. */
static void Pack(const DemHalo *h, PetscInt n, PetscInt k, PetscInt at, const PetscReal *a)
{
  for (PetscInt d = 0; d < k; d++)
    for (PetscInt b = 0; b < h->n_border; b++) h->out[MOTION * b + at + d] = a[d * n + h->border[b]];
}

static void Unpack(const DemHalo *h, PetscInt n, PetscInt own, PetscInt k, PetscInt at, PetscReal *a)
{
  for (PetscInt d = 0; d < k; d++)
    for (PetscInt g = 0; g < h->n; g++) a[d * n + own + g] = h->in[MOTION * g + at + d];
}

PetscErrorCode DemHaloMotion_Internal(DemModel model)
{
  DemHalo       *h = &model->ranks->halo;
  const PetscInt n = model->n, own = model->own;

  PetscFunctionBegin;
  Pack(h, n, 3, 0, model->u);
  Pack(h, n, 4, 3, model->rot);
  PetscCall(DemHaloSend_Internal(h, model->ranks->motion));
  Unpack(h, n, own, 3, 0, model->u);
  Unpack(h, n, own, 4, 3, model->rot);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemHaloReal_Internal(DemModel model, PetscReal *a)
{
  DemHalo *h = &model->ranks->halo;

  PetscFunctionBegin;
  for (PetscInt b = 0; b < h->n_border; b++) h->out[b] = a[h->border[b]];
  PetscCall(PetscSFBcastBegin(h->sf, MPIU_REAL, h->out, a + model->own, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(h->sf, MPIU_REAL, h->out, a + model->own, MPI_REPLACE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemHaloStress_Internal(DemModel model, PetscReal *a)
{
  DemHalo *h = &model->ranks->halo;

  PetscFunctionBegin;
  for (PetscInt b = 0; b < h->n_border; b++)
    for (PetscInt c = 0; c < 6; c++) h->out[6 * b + c] = a[6 * h->border[b] + c];
  PetscCall(PetscSFBcastBegin(h->sf, model->ranks->stress, h->out, a + 6 * model->own, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(h->sf, model->ranks->stress, h->out, a + 6 * model->own, MPI_REPLACE));
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
