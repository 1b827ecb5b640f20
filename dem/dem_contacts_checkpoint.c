/*
  dem_contacts_checkpoint.c - contacts in a checkpoint: the list as one rank keeps it, whatever the number that writes or reads.
*/
#include "dem_impl.h"

/* Bytes of the particles here travel as integers. */
static PetscErrorCode SaveGone(DemModel model, Checkpoint f)
{
  PetscInt *gone;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(model->n, &gone));
  for (PetscInt p = 0; p < model->n; p++) gone[p] = model->contacts.gone[p];
  PetscCall(DemSaveInts_Internal(model, f, "dem/contact_gone", DEM_OF_PARTICLES, gone));
  PetscCall(PetscFree(gone));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of the pairs that count here become those of all on rank 0, as one rank sorts them: pairs of one first particle come from its owner. */
static PetscErrorCode SavePairs(DemModel model, Checkpoint f)
{
  const DemContacts *c     = &model->contacts;
  const PetscInt     width = DEM_PAST + (c->turns ? 4 : 0) + (c->image ? 3 : 0);
  PetscInt          *key, *ends, mine = 0, n, *all, *column;
  PetscReal         *row, *got, *out;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(c->m, &key, 3 * c->m, &ends, width * c->m, &row));
  for (PetscInt k = 0; k < c->m; k++) {
    PetscReal *at = row + width * mine;

    if (c->p[k] >= model->own) continue;
    key[mine] = ends[3 * mine] = DemContactId_Internal(model, c->p[k]);
    ends[3 * mine + 1]         = DemContactId_Internal(model, c->q[k]);
    ends[3 * mine + 2]         = c->met[k];
    for (PetscInt i = 0; i < DEM_PAST; i++) *at++ = c->past[DEM_PAST * k + i];
    for (PetscInt i = 0; i < 4 && c->turns; i++) *at++ = c->roll[4 * k + i];
    for (PetscInt i = 0; i < 3 && c->image; i++) *at++ = c->image[3 * k + i];
    mine++;
  }
  if (model->ranks) {
    PetscCall(DemGatherInts_Internal(model, mine, key, 3, ends, &n, &all));
    PetscCall(DemGatherReals_Internal(model, mine, key, width, row, &n, &got));
  } else {
    n   = mine;
    all = ends;
    got = row;
  }
  PetscCall(PetscMalloc2(n, &column, DEM_PAST * n, &out));
  for (PetscInt i = 0; i < 3; i++) {
    static const char *const name[] = {"dem/contact_first", "dem/contact_second", "dem/contact_touching"};

    for (PetscInt k = 0; k < n; k++) column[k] = all[3 * k + i];
    PetscCall(CheckpointWriteInt(f, name[i], n, column));
  }
  for (PetscInt part = 0, first = 0; part < 3; part++) {
    static const char *const name[] = {"dem/contact_history", "dem/contact_rolling", "dem/contact_image"};
    const PetscInt           w = part == 0 ? DEM_PAST : part == 1 ? (c->turns ? 4 : 0) : (c->image ? 3 : 0);

    for (PetscInt k = 0; k < n; k++)
      for (PetscInt i = 0; i < w; i++) out[w * k + i] = got[width * k + first + i];
    if (w) PetscCall(CheckpointWriteReal(f, name[part], w * n, out));
    first += w;
  }
  PetscCall(PetscFree2(column, out));
  if (model->ranks) {
    PetscCall(PetscFree(all));
    PetscCall(PetscFree(got));
  }
  PetscCall(PetscFree3(key, ends, row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemContactsSave_Internal(DemModel model, Checkpoint f)
{
  const DemContacts *c = &model->contacts;
  PetscInt           sum[3] = {0, c->looked, c->touching}, size[6];
  PetscReal          scalar[2] = {c->deepest, c->taken};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < c->m; k++) sum[0] += c->p[k] < model->own;
  PetscCall(DemContactsAgree_Internal(model, 3, sum));
  if (model->ranks) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &scalar[0], 1, MPIU_REAL, MPI_MAX, model->comm));
  PetscCall(DemSumRanks_Internal(model, 1, &scalar[1]));
  size[0] = sum[0];
  size[1] = c->searches;
  size[2] = sum[1];
  size[3] = c->broken;
  size[4] = c->n_gone;
  size[5] = sum[2];
  PetscCall(CheckpointWriteInt(f, "dem/contact_counts", 6, size));
  PetscCall(CheckpointWriteReal(f, "dem/contact_scalars", 2, scalar));
  PetscCall(DemSaveRows_Internal(model, f, "dem/contact_reference", DEM_OF_PARTICLES, 3, 1, c->ref));
  if (c->gone) PetscCall(SaveGone(model, f));
  if (sum[0]) PetscCall(SavePairs(model, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int CompareInts(const void *a, const void *b)
{
  const PetscInt x = *(const PetscInt *)a, y = *(const PetscInt *)b;

  return x < y ? -1 : x > y;
}

/* Of n pairs of the whole body those that touch a particle here; others' particles in them are asked for. */
static PetscErrorCode LoadPairs(DemModel model, Checkpoint f, PetscInt n)
{
  DemContacts   *c = &model->contacts;
  const DemRanks r = model->ranks;
  PetscInt      *p, *q, *met, *ghost, ghosts = 0, kept = 0;
  PetscReal     *past, *roll = NULL, *image = NULL;

  PetscFunctionBegin;
  PetscCall(PetscMalloc5(n, &p, n, &q, n, &met, DEM_PAST * n, &past, n, &ghost));
  PetscCall(CheckpointReadInt(f, "dem/contact_first", n, p));
  PetscCall(CheckpointReadInt(f, "dem/contact_second", n, q));
  PetscCall(CheckpointReadInt(f, "dem/contact_touching", n, met));
  PetscCall(CheckpointReadReal(f, "dem/contact_history", DEM_PAST * n, past));
  if (c->turns) {
    PetscCall(PetscMalloc1(4 * n, &roll));
    PetscCall(CheckpointReadReal(f, "dem/contact_rolling", 4 * n, roll));
  }
  if (c->options.domain == DEM_DOMAIN_PERIODIC) {
    PetscCall(PetscMalloc1(3 * n, &image));
    PetscCall(CheckpointReadReal(f, "dem/contact_image", 3 * n, image));
  }
  for (PetscInt k = 0; k < n && r; k++) {
    const PetscBool here = (PetscBool)(DemOwnOf(r, p[k]) >= 0), there = (PetscBool)(DemOwnOf(r, q[k]) >= 0);

    if (here != there) ghost[ghosts++] = here ? q[k] : p[k];
  }
  if (r) {
    PetscCall(PetscSortRemoveDupsInt(&ghosts, ghost));
    PetscCall(DemContactGhosts_Internal(model, ghosts, ghost));
  }
  for (PetscInt k = 0; k < n; k++) kept += !r || DemOwnOf(r, p[k]) >= 0 || DemOwnOf(r, q[k]) >= 0;
  PetscCall(DemContactsRoom_Internal(model, kept));
  kept = 0;
  for (PetscInt k = 0; k < n; k++) {
    PetscInt end[2] = {p[k], q[k]};

    if (r) {
      if (DemOwnOf(r, p[k]) < 0 && DemOwnOf(r, q[k]) < 0) continue;
      for (PetscInt s = 0; s < 2; s++) {
        const PetscInt own = DemOwnOf(r, end[s]);

        end[s] = own >= 0 ? own : model->own + (PetscInt)((PetscInt *)bsearch(&end[s], ghost, (size_t)ghosts, sizeof(PetscInt), CompareInts) - ghost);
      }
    }
    c->p[kept]   = end[0];
    c->q[kept]   = end[1];
    c->met[kept] = (unsigned char)met[k];
    PetscCall(PetscArraycpy(c->past + DEM_PAST * kept, past + DEM_PAST * k, DEM_PAST));
    if (roll) PetscCall(PetscArraycpy(c->roll + 4 * kept, roll + 4 * k, 4));
    if (image) PetscCall(PetscArraycpy(c->image + 3 * kept, image + 3 * k, 3));
    kept++;
  }
  c->m = kept;
  PetscCall(PetscFree(roll));
  PetscCall(PetscFree(image));
  PetscCall(PetscFree5(p, q, met, past, ghost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemContactsLoad_Internal(DemModel model, Checkpoint f)
{
  DemContacts    *c     = &model->contacts;
  const PetscBool first = (PetscBool)(!model->ranks || model->ranks->rank == 0);
  PetscInt        size[6];
  PetscReal       scalar[2];

  PetscFunctionBegin;
  PetscCall(CheckpointReadInt(f, "dem/contact_counts", 6, size));
  PetscCall(CheckpointReadReal(f, "dem/contact_scalars", 2, scalar));
  PetscCall(DemLoadRows_Internal(model, f, "dem/contact_reference", DEM_OF_PARTICLES, 3, 1, c->ref));
  c->m        = 0;
  c->searches = size[1];
  c->looked   = first ? size[2] : 0; /* sums over the ranks: one of them goes on with all there was */
  c->broken   = size[3];
  c->n_gone   = size[4];
  c->touching = first ? size[5] : 0;
  c->deepest  = scalar[0];
  c->taken    = first ? scalar[1] : 0;
  if (c->gone) {
    PetscInt *gone;

    PetscCall(PetscMalloc1(model->n, &gone));
    PetscCall(DemLoadInts_Internal(model, f, "dem/contact_gone", DEM_OF_PARTICLES, gone));
    for (PetscInt p = 0; p < model->n; p++) c->gone[p] = (unsigned char)gone[p];
    PetscCall(PetscFree(gone));
  }
  if (size[0]) PetscCall(LoadPairs(model, f, size[0]));
  else if (model->ranks) PetscCall(DemContactGhosts_Internal(model, 0, NULL));
  PetscCall(DemContactsWho_Internal(model));
  PetscCall(DemContactsBlocks_Internal(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
