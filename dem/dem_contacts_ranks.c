/*
  dem_contacts_ranks.c - contacts between particles of several ranks.

  A search needs to know who else is near: ranks tell each other the box of their own particles, and send what lies within
  reach of the other's box. What a list then needs of others is sent in every step by its owners, as it is: both ranks do the pair
  from the same numbers, so its history is the same on both to the last bit.
*/
#include "dem_impl.h"

PetscErrorCode DemContactsAgree_Internal(DemModel model, PetscInt n, PetscInt sum[])
{
  PetscFunctionBegin;
  if (model->ranks) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, (PetscMPIInt)n, MPIU_INT, MPI_SUM, model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

enum { BOX_LOW = 0, BOX_HIGH = 3, BOX_RADIUS = 6, BOX_ALL = 7 }; /* of a rank's meeters; nobody: low above high */
enum { SENT_ID = 0, SENT_X = 1, SENT_R = 4, SENT_FRESH = 5, SENT_ALL = 6 };

/* A point within `reach` of a box, or one of its periodic copies is. */
static PetscBool Near(DemModel model, const PetscReal x[3], const PetscReal box[BOX_ALL], PetscReal reach)
{
  const DemContacts *c = &model->contacts;

  for (PetscInt d = 0; d < model->dim; d++) {
    const PetscReal low = box[BOX_LOW + d] - reach, high = box[BOX_HIGH + d] + reach, L = c->options.high[d] - c->options.low[d];

    if (box[BOX_LOW + d] > box[BOX_HIGH + d]) return PETSC_FALSE;
    if (c->options.domain == DEM_DOMAIN_PERIODIC && L > 0) {
      if (x[d] + L * ceil((low - x[d]) / L) > high) return PETSC_FALSE; /* the first copy not below */
    } else if (x[d] < low || x[d] > high) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

static PetscErrorCode Boxes(DemModel model, const DemMeeters *m, PetscReal *box, PetscReal *reach)
{
  const DemRanks r = model->ranks;
  PetscReal      mine[BOX_ALL], widest = 0;

  PetscFunctionBegin;
  for (PetscInt d = 0; d < 3; d++) {
    mine[BOX_LOW + d]  = PETSC_MAX_REAL;
    mine[BOX_HIGH + d] = PETSC_MIN_REAL;
  }
  mine[BOX_RADIUS] = 0;
  for (PetscInt k = 0; k < m->n; k++) {
    for (PetscInt d = 0; d < 3; d++) {
      mine[BOX_LOW + d]  = PetscMin(mine[BOX_LOW + d], m->x[3 * k + d]);
      mine[BOX_HIGH + d] = PetscMax(mine[BOX_HIGH + d], m->x[3 * k + d]);
    }
    mine[BOX_RADIUS] = PetscMax(mine[BOX_RADIUS], m->r[k]);
  }
  PetscCallMPI(MPI_Allgather(mine, BOX_ALL, MPIU_REAL, box, BOX_ALL, MPIU_REAL, model->comm));
  for (PetscMPIInt s = 0; s < r->size; s++) widest = PetscMax(widest, box[BOX_ALL * s + BOX_RADIUS]);
  *reach = (2 * widest + model->contacts.skin) * (1 + 1e-9);
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  PetscInt      id, at;
  PetscReal     x[3], r;
  unsigned char fresh;
} Meeter;

static int CompareMeeters(const void *a, const void *b)
{
  const Meeter *p = a, *q = b;

  return p->id < q->id ? -1 : p->id > q->id;
}

/* Ours and those that came into one list by number. */
static PetscErrorCode Merge(DemMeeters *m, PetscBool fresh, PetscInt came, const PetscReal *in)
{
  const PetscInt n = m->n + came;
  Meeter        *all;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &all));
  for (PetscInt k = 0; k < m->n; k++) all[k] = (Meeter){m->id[k], m->at[k], {m->x[3 * k], m->x[3 * k + 1], m->x[3 * k + 2]}, m->r[k], fresh ? m->fresh[k] : 0};
  for (PetscInt k = 0; k < came; k++) {
    const PetscReal *row = in + SENT_ALL * k;

    all[m->n + k] = (Meeter){(PetscInt)row[SENT_ID], -1, {row[SENT_X], row[SENT_X + 1], row[SENT_X + 2]}, row[SENT_R], (unsigned char)row[SENT_FRESH]};
  }
  if (n > 1) qsort(all, n, sizeof(*all), CompareMeeters);
  PetscCall(PetscRealloc(n * sizeof(*m->id), &m->id));
  PetscCall(PetscRealloc(n * sizeof(*m->at), &m->at));
  PetscCall(PetscRealloc(3 * n * sizeof(*m->x), &m->x));
  PetscCall(PetscRealloc(n * sizeof(*m->r), &m->r));
  if (fresh) PetscCall(PetscRealloc(n * sizeof(*m->fresh), &m->fresh));
  m->n = n;
  for (PetscInt k = 0; k < n; k++) {
    m->id[k] = all[k].id;
    m->at[k] = all[k].at;
    m->r[k]  = all[k].r;
    for (PetscInt d = 0; d < 3; d++) m->x[3 * k + d] = all[k].x[d];
    if (fresh) m->fresh[k] = all[k].fresh;
  }
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemMeetersOfOthers_Internal(DemModel model, DemMeeters *m)
{
  const DemRanks r = model->ranks;
  PetscReal     *box, *out, *in, reach = 0;
  PetscMPIInt   *send, *receive, *send_at, *receive_at;
  PetscInt       at = 0;
  MPI_Datatype   record;

  PetscFunctionBegin;
  PetscCall(PetscMalloc5(BOX_ALL * r->size, &box, r->size, &send, r->size, &receive, r->size + 1, &send_at, r->size + 1, &receive_at));
  PetscCall(Boxes(model, m, box, &reach));
  send_at[0] = receive_at[0] = 0;
  for (PetscMPIInt s = 0; s < r->size; s++) {
    send[s] = 0;
    for (PetscInt k = 0; k < m->n && s != r->rank; k++) send[s] += Near(model, m->x + 3 * k, box + BOX_ALL * s, reach);
    send_at[s + 1] = send_at[s] + send[s];
  }
  PetscCall(PetscMalloc1(SENT_ALL * send_at[r->size], &out));
  for (PetscMPIInt s = 0; s < r->size; s++)
    for (PetscInt k = 0; k < m->n && s != r->rank; k++) {
      PetscReal *row = out + SENT_ALL * at;

      if (!Near(model, m->x + 3 * k, box + BOX_ALL * s, reach)) continue;
      row[SENT_ID] = (PetscReal)m->id[k];
      for (PetscInt d = 0; d < 3; d++) row[SENT_X + d] = m->x[3 * k + d];
      row[SENT_R]     = m->r[k];
      row[SENT_FRESH] = m->fresh ? m->fresh[k] : 0;
      at++;
    }
  PetscCallMPI(MPI_Alltoall(send, 1, MPI_INT, receive, 1, MPI_INT, model->comm));
  for (PetscMPIInt s = 0; s < r->size; s++) receive_at[s + 1] = receive_at[s] + receive[s];
  PetscCall(PetscMalloc1(SENT_ALL * receive_at[r->size], &in));
  PetscCallMPI(MPI_Type_contiguous(SENT_ALL, MPIU_REAL, &record));
  PetscCallMPI(MPI_Type_commit(&record));
  PetscCallMPI(MPI_Alltoallv(out, send, send_at, record, in, receive, receive_at, record, model->comm));
  PetscCallMPI(MPI_Type_free(&record));
  PetscCall(Merge(m, (PetscBool)(model->contacts.fresh != NULL), receive_at[r->size], in));
  PetscCall(PetscFree(out));
  PetscCall(PetscFree(in));
  PetscCall(PetscFree5(box, send, receive, send_at, receive_at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemContactGhosts_Internal(DemModel model, PetscInt n, const PetscInt id[])
{
  DemContacts *c = &model->contacts;

  PetscFunctionBegin;
  if (!c->record) {
    PetscCallMPI(MPI_Type_contiguous(DEM_MEET_ALL, MPIU_REAL, &c->record));
    PetscCallMPI(MPI_Type_commit(&c->record));
  }
  PetscCall(PetscFree(c->ghost_id));
  PetscCall(PetscMalloc1(n, &c->ghost_id));
  PetscCall(PetscArraycpy(c->ghost_id, id, n));
  c->ghosts = n;
  PetscCall(DemHaloSetUp_Internal(model, n, id, &c->halo));
  PetscCall(DemContactGhostsMove_Internal(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemContactGhostsMove_Internal(DemModel model)
{
  DemContacts *c = &model->contacts;

  PetscFunctionBegin;
  for (PetscInt b = 0; b < c->halo.n_border; b++) DemContactParticle_Internal(model, c->halo.border[b], c->halo.out + DEM_MEET_ALL * b);
  PetscCall(DemHaloSend_Internal(&c->halo, c->record));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemContactGhostsGone_Internal(DemModel model, unsigned char gone[])
{
  DemContacts *c = &model->contacts;
  PetscInt    *out, *in;

  PetscFunctionBegin;
  if (!c->halo.sf) PetscFunctionReturn(PETSC_SUCCESS); /* before the first search */
  PetscCall(PetscMalloc2(c->halo.n_border, &out, c->ghosts, &in));
  for (PetscInt b = 0; b < c->halo.n_border; b++) out[b] = c->gone[c->halo.border[b]];
  PetscCall(PetscSFBcastBegin(c->halo.sf, MPIU_INT, out, in, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(c->halo.sf, MPIU_INT, out, in, MPI_REPLACE));
  for (PetscInt g = 0; g < c->ghosts; g++) gone[g] = (unsigned char)in[g];
  PetscCall(PetscFree2(out, in));
  PetscFunctionReturn(PETSC_SUCCESS);
}
