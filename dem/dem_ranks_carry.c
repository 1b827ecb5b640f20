/*
  dem_ranks_carry.c - rows of arrays on their way to the ranks that will keep them.

  At the end of set-up all rows are here and a rank picks its own. When a body is shared out anew they are spread over the ranks: whoever
  counts a row tells those that will need it (DemCarryPush_Internal()), and each array follows along the same paths.
*/
#include "dem_impl.h"

/* So many bytes a row. */
PetscErrorCode DemCarryInto_Internal(const DemCarry *c, size_t row, const void *from, void *to)
{
  MPI_Datatype type;

  PetscFunctionBegin;
  if (!c->sf) {
    for (PetscInt k = 0; k < c->n; k++) memcpy((char *)to + row * (size_t)k, (const char *)from + row * (size_t)c->take[k], row);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCallMPI(MPI_Type_contiguous((PetscMPIInt)row, MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCall(PetscSFBcastBegin(c->sf, type, from, to, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(c->sf, type, from, to, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemCarryRows_Internal(const DemCarry *c, size_t row, void *array)
{
  PetscBool there = (PetscBool)(*(void **)array != NULL);
  char     *to;

  PetscFunctionBegin;
  if (c->sf) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &there, 1, MPIU_BOOL, MPI_LOR, c->comm)); /* a rank without rows has no array */
  if (!there) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(row * (size_t)c->n, &to));
  PetscCall(DemCarryInto_Internal(c, row, *(void **)array, to));
  PetscCall(PetscFree(*(void **)array));
  *(void **)array = to;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemCarryColumns_Internal(const DemCarry *c, PetscInt columns, PetscInt old, PetscInt stride, const PetscReal *from, PetscReal *to)
{
  PetscFunctionBegin;
  for (PetscInt d = 0; d < columns; d++) PetscCall(DemCarryInto_Internal(c, sizeof(PetscReal), from + d * old, to + d * stride));
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  PetscInt    key, row;
  PetscMPIInt rank;
} Sent;

static int CompareSent(const void *a, const void *b)
{
  const Sent *s = a, *t = b;

  return s->key < t->key ? -1 : s->key > t->key;
}

PetscErrorCode DemCarryPush_Internal(MPI_Comm comm, PetscInt rows, PetscInt pushed, const PetscInt row[], const PetscInt key[], const PetscMPIInt to[],
                                     PetscInt **keys, DemCarry *c)
{
  PetscMPIInt *count, *place, *got, *got_at, *fill, size;
  PetscInt    *out, *in;
  PetscSFNode *from;
  Sent        *sent;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(PetscCalloc5(size, &count, size + 1, &place, size, &got, size + 1, &got_at, size, &fill));
  for (PetscInt k = 0; k < pushed; k++)
    for (PetscInt s = 0; s < 2; s++)
      if (to[2 * k + s] >= 0 && (!s || to[2 * k + 1] != to[2 * k])) count[to[2 * k + s]] += 2;
  for (PetscMPIInt s = 0; s < size; s++) {
    fill[s] = place[s];
    place[s + 1] = place[s] + count[s];
  }
  PetscCall(PetscMalloc1(place[size], &out));
  for (PetscInt k = 0; k < pushed; k++)
    for (PetscInt s = 0; s < 2; s++) {
      const PetscMPIInt rank = to[2 * k + s];

      if (rank < 0 || (s && rank == to[2 * k])) continue;
      out[fill[rank]++] = key[k];
      out[fill[rank]++] = row[k];
    }
  PetscCallMPI(MPI_Alltoall(count, 1, MPI_INT, got, 1, MPI_INT, comm));
  for (PetscMPIInt s = 0; s < size; s++) got_at[s + 1] = got_at[s] + got[s];
  c->comm = comm;
  c->n = got_at[size] / 2;
  PetscCall(PetscMalloc2(got_at[size], &in, c->n, &sent));
  PetscCallMPI(MPI_Alltoallv(out, count, place, MPIU_INT, in, got, got_at, MPIU_INT, comm));
  for (PetscMPIInt s = 0; s < size; s++)
    for (PetscInt k = got_at[s] / 2; k < got_at[s + 1] / 2; k++) sent[k] = (Sent){in[2 * k], in[2 * k + 1], s};
  if (c->n > 1) qsort(sent, c->n, sizeof(*sent), CompareSent);
  PetscCall(PetscMalloc1(c->n, keys));
  PetscCall(PetscMalloc1(c->n, &from));
  for (PetscInt k = 0; k < c->n; k++) {
    (*keys)[k] = sent[k].key;
    from[k] = (PetscSFNode){.rank = sent[k].rank, .index = sent[k].row};
  }
  PetscCall(PetscSFCreate(comm, &c->sf));
  PetscCall(PetscSFSetGraph(c->sf, rows, c->n, NULL, PETSC_COPY_VALUES, from, PETSC_COPY_VALUES));
  PetscCall(PetscSFSetUp(c->sf));
  PetscCall(PetscFree(out));
  PetscCall(PetscFree2(in, sent));
  PetscCall(PetscFree(from));
  PetscCall(PetscFree5(count, place, got, got_at, fill));
  PetscFunctionReturn(PETSC_SUCCESS);
}
