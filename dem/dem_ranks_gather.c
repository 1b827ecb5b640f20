/*
  dem_ranks_gather.c - rows of all ranks on rank 0, in the order of one rank: what goes to files. And back, when a run goes on.

  A checkpoint holds what one rank would write, so it is read by any number of ranks.
*/
#include "dem_impl.h"

/* Counts and places of the rows of every rank, on rank 0. Caller frees both. */
static PetscErrorCode Counts(DemModel model, PetscInt rows, PetscInt width, PetscMPIInt **count, PetscMPIInt **place, PetscInt *n)
{
  DemRanks    r = model->ranks;
  PetscMPIInt mine;

  PetscFunctionBegin;
  PetscCall(PetscMPIIntCast(rows * width, &mine));
  PetscCall(PetscMalloc1(r->size, count));
  PetscCall(PetscMalloc1(r->size + 1, place));
  PetscCallMPI(MPI_Gather(&mine, 1, MPI_INT, *count, 1, MPI_INT, 0, model->comm));
  (*place)[0] = 0;
  for (PetscMPIInt s = 0; s < r->size && r->rank == 0; s++) (*place)[s + 1] = (*place)[s] + (*count)[s];
  *n = r->rank == 0 ? (*place)[r->size] / width : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  PetscInt key, place;
} Row;

static int CompareRows(const void *a, const void *b)
{
  const Row *s = a, *t = b;

  if (s->key != t->key) return s->key < t->key ? -1 : 1;
  return s->place < t->place ? -1 : s->place > t->place;
}

/* Rows of `size` bytes a number; ordered by key, rows of one key as they came. */
static PetscErrorCode Gather(DemModel model, PetscInt rows, const PetscInt key[], PetscInt width, const void *a, MPI_Datatype type, size_t size, PetscInt *n, void **all)
{
  PetscMPIInt *count, *place;
  PetscInt    *keys;
  Row         *order;
  char        *raw;

  PetscFunctionBegin;
  PetscCall(Counts(model, rows, 1, &count, &place, n));
  PetscCall(PetscMalloc2(*n, &keys, *n, &order));
  PetscCallMPI(MPI_Gatherv(key, (PetscMPIInt)rows, MPIU_INT, keys, count, place, MPIU_INT, 0, model->comm));
  PetscCall(PetscFree(count));
  PetscCall(PetscFree(place));
  PetscCall(Counts(model, rows, width, &count, &place, n));
  PetscCall(PetscMalloc1((size_t)(*n * width) * size, &raw));
  PetscCall(PetscMalloc((size_t)(*n * width) * size, all));
  PetscCallMPI(MPI_Gatherv(a, (PetscMPIInt)(rows * width), type, raw, count, place, type, 0, model->comm));
  for (PetscInt k = 0; k < *n; k++) order[k] = (Row){keys[k], k};
  if (*n > 1) qsort(order, *n, sizeof(*order), CompareRows);
  for (PetscInt k = 0; k < *n; k++) PetscCall(PetscMemcpy((char *)*all + (size_t)(k * width) * size, raw + (size_t)(order[k].place * width) * size, (size_t)width * size));
  PetscCall(PetscFree(raw));
  PetscCall(PetscFree2(keys, order));
  PetscCall(PetscFree(count));
  PetscCall(PetscFree(place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemGatherReals_Internal(DemModel model, PetscInt rows, const PetscInt key[], PetscInt width, const PetscReal *a, PetscInt *n, PetscReal **all)
{
  return Gather(model, rows, key, width, a, MPIU_REAL, sizeof(PetscReal), n, (void **)all);
}

PetscErrorCode DemGatherInts_Internal(DemModel model, PetscInt rows, const PetscInt key[], PetscInt width, const PetscInt *a, PetscInt *n, PetscInt **all)
{
  return Gather(model, rows, key, width, a, MPIU_INT, sizeof(PetscInt), n, (void **)all);
}

/* Rows here (others' copies among them), rows of all ranks, and the number of each. */
static void RowsOf(DemModel model, DemRowsOf of, PetscInt *here, PetscInt *all, const PetscInt **id)
{
  const DemRanks r = model->ranks;

  *here = of == DEM_OF_PARTICLES ? model->n : of == DEM_OF_BONDS ? model->bonds.n : model->walls.n;
  if (r) {
    *all = of == DEM_OF_PARTICLES ? r->particles : of == DEM_OF_BONDS ? r->bonds : r->walls;
    *id  = of == DEM_OF_PARTICLES ? r->id : of == DEM_OF_BONDS ? r->bond : r->wall;
  } else *all = *here;
}

static PetscBool RowIsMine(DemModel model, DemRowsOf of, PetscInt k)
{
  return of == DEM_OF_PARTICLES ? (PetscBool)(k < model->own) : of == DEM_OF_BONDS ? DemBondIsMine(model, k) : PETSC_TRUE;
}

PetscErrorCode DemSaveRows_Internal(DemModel model, Checkpoint c, const char *name, DemRowsOf of, PetscInt columns, PetscInt width, const PetscReal *a)
{
  const PetscInt *id = NULL;
  PetscInt        here, all, mine = 0, n, *key;
  PetscReal      *rows, *got, *whole;
  const PetscInt  wide = columns * width;

  PetscFunctionBegin;
  RowsOf(model, of, &here, &all, &id);
  if (!model->ranks) {
    PetscCall(CheckpointWriteReal(c, name, wide * all, a));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc2(here, &key, wide * here, &rows));
  for (PetscInt k = 0; k < here; k++) {
    if (!RowIsMine(model, of, k)) continue;
    key[mine] = id[k];
    for (PetscInt q = 0; q < columns; q++)
      for (PetscInt w = 0; w < width; w++) rows[wide * mine + width * q + w] = a[(q * here + k) * width + w];
    mine++;
  }
  PetscCall(DemGatherReals_Internal(model, mine, key, wide, rows, &n, &got));
  PetscCall(PetscMalloc1(wide * n, &whole));
  for (PetscInt k = 0; k < n; k++)
    for (PetscInt q = 0; q < columns; q++)
      for (PetscInt w = 0; w < width; w++) whole[(q * n + k) * width + w] = got[wide * k + width * q + w];
  PetscCall(CheckpointWriteReal(c, name, wide * n, whole));
  PetscCall(PetscFree(whole));
  PetscCall(PetscFree(got));
  PetscCall(PetscFree2(key, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemSaveInts_Internal(DemModel model, Checkpoint c, const char *name, DemRowsOf of, const PetscInt *a)
{
  const PetscInt *id = NULL;
  PetscInt        here, all, mine = 0, n, *key, *rows, *whole;

  PetscFunctionBegin;
  RowsOf(model, of, &here, &all, &id);
  if (!model->ranks) {
    PetscCall(CheckpointWriteInt(c, name, all, a));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc2(here, &key, here, &rows));
  for (PetscInt k = 0; k < here; k++) {
    if (!RowIsMine(model, of, k)) continue;
    key[mine]    = id[k];
    rows[mine++] = a[k];
  }
  PetscCall(DemGatherInts_Internal(model, mine, key, 1, rows, &n, &whole));
  PetscCall(CheckpointWriteInt(c, name, n, whole));
  PetscCall(PetscFree(whole));
  PetscCall(PetscFree2(key, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemLoadInts_Internal(DemModel model, Checkpoint c, const char *name, DemRowsOf of, PetscInt *a)
{
  const PetscInt *id = NULL;
  PetscInt        here, all, used, *whole;

  PetscFunctionBegin;
  RowsOf(model, of, &here, &all, &id);
  if (!model->ranks) {
    PetscCall(CheckpointReadInt(c, name, all, a));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  used = of == DEM_OF_PARTICLES ? model->own + model->ranks->ghosts : here;
  PetscCall(PetscMalloc1(all, &whole));
  PetscCall(CheckpointReadInt(c, name, all, whole));
  for (PetscInt k = 0; k < used; k++) a[k] = whole[id[k]];
  PetscCall(PetscFree(whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemLoadRows_Internal(DemModel model, Checkpoint c, const char *name, DemRowsOf of, PetscInt columns, PetscInt width, PetscReal *a)
{
  const PetscInt *id = NULL;
  PetscInt        here, all, used;
  PetscReal      *whole;

  PetscFunctionBegin;
  RowsOf(model, of, &here, &all, &id);
  if (!model->ranks) {
    PetscCall(CheckpointReadReal(c, name, columns * width * all, a));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  used = of == DEM_OF_PARTICLES ? model->own + model->ranks->ghosts : here;
  PetscCall(PetscMalloc1(columns * width * all, &whole));
  PetscCall(CheckpointReadReal(c, name, columns * width * all, whole));
  for (PetscInt q = 0; q < columns; q++)
    for (PetscInt k = 0; k < used; k++)
      for (PetscInt w = 0; w < width; w++) a[(q * here + k) * width + w] = whole[(q * all + id[k]) * width + w];
  PetscCall(PetscFree(whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}
