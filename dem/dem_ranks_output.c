/* dem_ranks_output.c - frames of a model on several ranks: rank 0 writes what one rank would. */
#include "dem_impl.h"

/* Vertices of particles: rows of the rank's own become those of all, by the packing's numbers. */
PetscErrorCode DemGatherBlock_Internal(DemModel model, OutputBlock *block)
{
  const DemRanks r = model->ranks;
  PetscInt      *row, *key, rows = 0, n, *start, *node;
  PetscReal     *here, *all;
  OutputArray   *array;
  unsigned char *type;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(model->own, &row, model->own, &key, 6 * model->own, &here));
  PetscCall(PetscMalloc1(block->n_arrays, &array));
  for (PetscInt p = 0; p < model->own; p++) {
    if (model->contacts.gone && model->contacts.gone[p]) continue;
    row[rows]   = p;
    key[rows++] = r->number[p];
  }
  for (PetscInt k = 0; k < rows; k++)
    for (PetscInt d = 0; d < 3; d++) here[3 * k + d] = block->x[3 * row[k] + d];
  PetscCall(DemGatherReals_Internal(model, rows, key, 3, here, &n, &all));
  block->x = all;
  for (PetscInt a = 0; a < block->n_arrays; a++) {
    const PetscInt w = block->array[a].components;

    PetscCheck(w <= 6, PETSC_COMM_SELF, PETSC_ERR_PLIB, "A field of %" PetscInt_FMT " components", w);
    for (PetscInt k = 0; k < rows; k++)
      for (PetscInt c = 0; c < w; c++) here[w * k + c] = block->array[a].data[w * row[k] + c];
    PetscCall(DemGatherReals_Internal(model, rows, key, w, here, &n, &all));
    array[a]      = block->array[a];
    array[a].data = all;
  }
  PetscCall(PetscFree3(row, key, here));
  PetscCall(PetscMalloc1(n + 1, &start));
  PetscCall(PetscMalloc1(n, &node));
  PetscCall(PetscMalloc1(n, &type));
  for (PetscInt k = 0; k < n; k++) {
    start[k] = node[k] = k;
    type[k]            = 1;
  }
  start[n]        = n;
  block->n_points = block->n_cells = n;
  block->start    = start;
  block->node     = node;
  block->type     = type;
  block->array    = array;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The arrays that the gathering made. */
PetscErrorCode DemGatherBlockFree_Internal(DemModel model, OutputBlock *block)
{
  PetscFunctionBegin;
  for (PetscInt a = 0; a < block->n_arrays; a++) {
    void *data = (void *)block->array[a].data;

    PetscCall(PetscFree(data));
  }
  PetscCall(PetscFree(block->array));
  PetscCall(PetscFree(block->x));
  PetscCall(PetscFree(block->start));
  PetscCall(PetscFree(block->node));
  PetscCall(PetscFree(block->type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rest positions of all particles on rank 0, packing's order; caller frees. */
PetscErrorCode DemGatherPlaces_Internal(DemModel model, PetscInt *n, PetscReal **x)
{
  return DemGatherReals_Internal(model, model->own, model->ranks->number, 3, model->packing.x, n, x);
}

/* Rows of the bonds list that are counted here: ends by the packing's numbers, and five numbers each. */
PetscErrorCode DemGatherBonds_Internal(DemModel model, const DemBondList *list, PetscInt *n, PetscInt **ends, PetscReal **values)
{
  const DemRanks r = model->ranks;
  PetscInt      *key, *end, rows = 0;
  PetscReal     *value;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(list->n, &key, 2 * list->n, &end, 5 * list->n, &value));
  for (PetscInt k = 0; k < list->n; k++) {
    if (!DemBondIsMine(model, k)) continue;
    key[rows]            = r->bond[k];
    end[2 * rows]        = r->number[list->p[k]];
    end[2 * rows + 1]    = r->number[list->q[k]];
    value[5 * rows]      = list->sigma[k];
    value[5 * rows + 1]  = list->tau[k];
    value[5 * rows + 2]  = list->damage[k];
    value[5 * rows + 3]  = list->criterion[k];
    value[5 * rows++ + 4] = list->state[k];
  }
  PetscCall(DemGatherInts_Internal(model, rows, key, 2, end, n, ends));
  PetscCall(DemGatherReals_Internal(model, rows, key, 5, value, n, values));
  PetscCall(PetscFree3(key, end, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}
