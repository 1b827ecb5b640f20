/*
  dem_contacts.c - who may meet whom: cells, a list with a skin, and what survives from list to list.  Eqs (5.32)-(5.35)

  Cells are hashed, so one grain that flies off costs nothing. A list holds every pair of searched particles nearer than
  the sum of their radii and the skin; it is good until one of them has moved half the skin.
*/
#include "dem_impl.h"

typedef struct {
  PetscInt  n[3];     /* cells of a period; 0: open */
  PetscReal low[3], period[3], width[3];
  PetscInt  mask;     /* buckets - 1 */
  PetscInt *start;    /* [buckets + 1] */
  PetscInt *item;     /* [meeters] by bucket, ascending within */
  PetscInt *bucket;   /* [meeters] */
} Cells;

static PetscInt Bucket(const Cells *c, const PetscInt cell[3])
{
  uint64_t h = (uint64_t)(int64_t)cell[0] * 0x9E3779B97F4A7C15ULL ^ (uint64_t)(int64_t)cell[1] * 0xC2B2AE3D27D4EB4FULL ^ (uint64_t)(int64_t)cell[2] * 0x165667B19E3779F9ULL;

  h ^= h >> 29;
  return (PetscInt)(h & (uint64_t)c->mask);
}

static void CellOf(const Cells *c, PetscInt dim, const PetscReal x[3], PetscInt cell[3])
{
  for (PetscInt d = 0; d < 3; d++) {
    const PetscReal s = d < dim ? (x[d] - c->low[d]) / c->width[d] : 0;

    cell[d] = (PetscInt)floor(PetscMax(PetscMin(s, 1e15), -1e15));
    if (c->n[d]) cell[d] = (cell[d] % c->n[d] + c->n[d]) % c->n[d];
  }
}

static void Position(DemModel model, PetscInt p, PetscReal x[3])
{
  for (PetscInt d = 0; d < 3; d++) x[d] = model->x0[d * model->n + p] + model->u[d * model->n + p];
}

PetscErrorCode DemContactsRoom_Internal(DemModel model, PetscInt room)
{
  DemContacts *c = &model->contacts;

  PetscFunctionBegin;
  if (room <= c->room) PetscFunctionReturn(PETSC_SUCCESS);
  room = PetscMax(room, c->room + c->room / 2);
  PetscCall(PetscRealloc(room * sizeof(*c->p), &c->p));
  PetscCall(PetscRealloc(room * sizeof(*c->q), &c->q));
  PetscCall(PetscRealloc(room * sizeof(*c->ip), &c->ip));
  PetscCall(PetscRealloc(room * sizeof(*c->iq), &c->iq));
  PetscCall(PetscRealloc(room * DEM_PAST * sizeof(*c->past), &c->past));
  PetscCall(PetscRealloc(room * sizeof(*c->met), &c->met));
  if (c->turns) PetscCall(PetscRealloc(room * 4 * sizeof(*c->roll), &c->roll));
  if (c->options.domain == DEM_DOMAIN_PERIODIC) PetscCall(PetscRealloc(room * 3 * sizeof(*c->image), &c->image));
  c->room = room;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A bond that carries nothing any more is none, and its pair meets again as any other: when its spheres no longer touch, or its facet has slid or turned off. Returns
   how many are broken and counted here. */
static PetscInt PartBonds(DemModel model)
{
  const PetscInt  n = model->n;
  const DemBonds *b = &model->bonds;
  PetscInt        broken = 0;

  if (!model->crack.damage) return 0;
  for (PetscInt e = 0; e < b->n; e++) {
    PetscReal d2 = 0;

    if (model->crack.damage[e] < DEM_CONTACT_BROKEN) continue;
    broken += DemBondIsMine(model, e);
    if (model->crack.state[e] & DEM_BOND_PARTED) continue;
    for (PetscInt d = 0; d < model->dim; d++) d2 += PetscSqr(model->x0[d * n + b->p[e]] + model->u[d * n + b->p[e]] - model->x0[d * n + b->q[e]] - model->u[d * n + b->q[e]]);
    if (!(!model->net && model->crack.damage[e] == 1 && model->crack.release[e] == 1)) {
      if (d2 <= PetscSqr(model->r[b->p[e]] + model->r[b->q[e]])) continue;
      if (DemCrackClosed_Internal(model, e)) continue;
    }
    model->crack.state[e] |= DEM_BOND_PARTED;
  }
  return broken;
}

/* Particles that can meet a new partner: all loose ones; of a bonded body its surface, and those that have lost a bond. */
PetscErrorCode DemContactsWho_Internal(DemModel model)
{
  DemContacts *c = &model->contacts;
  PetscBool   *in;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(model->n, &in));
  for (PetscInt k = 0; k < model->n_surface; k++) in[model->surface[k]] = PETSC_TRUE;
  if (model->crack.damage)
    for (PetscInt e = 0; e < model->bonds.n; e++)
      if (model->crack.damage[e] >= DEM_CONTACT_BROKEN) in[model->bonds.p[e]] = in[model->bonds.q[e]] = PETSC_TRUE;
  c->n_who = 0;
  for (PetscInt p = 0; p < model->own; p++)
    if (in[p] && !(c->gone && c->gone[p])) c->who[c->n_who++] = p;
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CellsCreate(DemModel model, const DemMeeters *m, Cells *cells)
{
  DemContacts *c = &model->contacts;
  PetscReal    most = 0;
  PetscInt     buckets = 64, *bucket, cell[3];

  PetscFunctionBegin;
  PetscCall(PetscMemzero(cells, sizeof(*cells)));
  for (PetscInt k = 0; k < m->n; k++) most = PetscMax(most, m->r[k]);
  for (PetscInt d = 0; d < 3; d++) {
    const PetscReal L = c->options.high[d] - c->options.low[d];

    cells->low[d]   = c->options.low[d];
    cells->width[d] = 2 * most + c->skin;
    if (c->options.domain == DEM_DOMAIN_PERIODIC && d < model->dim && L > 0) {
      cells->period[d] = L;
      cells->n[d]      = PetscMax(1, (PetscInt)(L / cells->width[d]));
      cells->width[d]  = L / cells->n[d];
    }
  }
  while (buckets < 2 * m->n) buckets *= 2;
  cells->mask = buckets - 1;
  PetscCall(PetscMalloc3(buckets + 1, &cells->start, m->n, &cells->item, m->n, &cells->bucket));
  bucket = cells->bucket;
  PetscCall(PetscArrayzero(cells->start, buckets + 1));
  for (PetscInt k = 0; k < m->n; k++) {
    CellOf(cells, model->dim, m->x + 3 * k, cell);
    bucket[k] = Bucket(cells, cell);
    cells->start[bucket[k] + 1]++;
  }
  for (PetscInt b = 0; b < buckets; b++) cells->start[b + 1] += cells->start[b];
  for (PetscInt k = m->n - 1; k >= 0; k--) cells->item[--cells->start[bucket[k] + 1]] = k;
  /* start[b + 1] has run down to the first of bucket b: shift back */
  for (PetscInt b = 0; b < buckets; b++) cells->start[b] = cells->start[b + 1];
  cells->start[buckets] = m->n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Particles whose centre is outside the box stop and take no part any more. With them goes what the ledger had of them a step ago, kinetic and
   in contacts, and the work of their weight since. */
static PetscErrorCode Leave(DemModel model)
{
  DemContacts   *c = &model->contacts;
  const PetscInt n = model->n, before = c->n_gone;
  PetscInt       left;
  unsigned char *ghost_gone = NULL;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < model->own; p++) {
    PetscBool out = PETSC_FALSE;
    PetscReal x[3];

    if (c->gone[p]) continue;
    Position(model, p, x);
    for (PetscInt d = 0; d < model->dim; d++) out = (PetscBool)(out || x[d] < c->options.low[d] || x[d] > c->options.high[d]);
    if (!out) continue;
    if (DemInClump(model, p)) {
      DemClumpsLeave_Internal(model, model->clumps.of[p], &c->taken);
      continue;
    }
    for (PetscInt d = 0; d < model->dim; d++) {
      PetscReal *v = &model->v[d * n + p];

      c->taken += 0.5 * *v * (model->mass[p] * *v - model->dt_last * model->f[d * n + p]) + model->mass[p] * model->gravity[d] * *v * model->dt_last;
      *v = 0;
    }
    for (PetscInt d = 0; d < model->nrot; d++) {
      c->taken += 0.5 * model->inertia[p] * PetscSqr(model->spin[d * n + p]);
      model->spin[d * n + p] = 0;
    }
    c->gone[p] = 1;
    c->n_gone++;
  }
  left = c->n_gone - before;
  PetscCall(DemContactsAgree_Internal(model, 1, &left));
  c->n_gone = before + left; /* of all ranks */
  if (!left) PetscFunctionReturn(PETSC_SUCCESS);
  if (model->ranks) {
    PetscCall(PetscMalloc1(c->ghosts, &ghost_gone));
    PetscCall(DemContactGhostsGone_Internal(model, ghost_gone));
  }
  for (PetscInt k = 0; k < c->m; k++) {
    const PetscInt  p = c->p[k], q = c->q[k];

    if (!c->met[k] || p >= model->own || !(c->gone[p] || (q < model->own ? c->gone[q] : ghost_gone[q - model->own]))) continue;
    c->taken += DemContactEnergy_Internal(model, k, PetscAbsReal(c->past[DEM_PAST * k + DEM_PAST_OVERLAP]));
  }
  PetscCall(PetscFree(ghost_gone));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bonds of each of our own particles that still hold, by particle. */
typedef struct {
  PetscInt *start, *partner; /* [own + 1], numbers on one rank */
} Joints;

static PetscInt IdOf(DemModel model, PetscInt p)
{
  return model->ranks ? model->ranks->id[p] : p;
}

static PetscErrorCode JointsCreate(DemModel model, Joints *j)
{
  const DemBonds *b = &model->bonds;
  const PetscInt  own = model->own;

  PetscFunctionBegin;
  j->start = j->partner = NULL;
  if (!b->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(own + 2, &j->start));
  PetscCall(PetscMalloc1(2 * b->n, &j->partner));
  for (PetscInt fill = 0; fill < 2; fill++) { /* count, then fill: start[p + 1] runs from the first of p to the first of p + 1 */
    for (PetscInt e = 0; e < b->n; e++) {
      const PetscInt p = b->p[e], q = b->q[e];

      if (model->crack.damage && (model->crack.state[e] & DEM_BOND_PARTED)) continue;
      if (p < own) {
        if (fill) j->partner[j->start[p + 1]++] = IdOf(model, q);
        else j->start[p + 2]++;
      }
      if (q < own) {
        if (fill) j->partner[j->start[q + 1]++] = IdOf(model, p);
        else j->start[q + 2]++;
      }
    }
    for (PetscInt p = 0; !fill && p <= own; p++) j->start[p + 1] += j->start[p];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Facets still join the two; one of them at least is here. */
static PetscBool Joined(const Joints *j, const DemMeeters *m, PetscInt a, PetscInt b)
{
  const PetscInt here = m->at[a] >= 0 ? m->at[a] : m->at[b], other = m->at[a] >= 0 ? m->id[b] : m->id[a];

  if (!j->start) return PETSC_FALSE;
  for (PetscInt k = j->start[here]; k < j->start[here + 1]; k++)
    if (j->partner[k] == other) return PETSC_TRUE;
  return PETSC_FALSE;
}

static int CompareInts(const void *a, const void *b)
{
  const PetscInt x = *(const PetscInt *)a, y = *(const PetscInt *)b;

  return x < y ? -1 : x > y;
}

/* Partners b > a of a, ascending and once each; of two from other ranks nobody here feels anything. */
static PetscErrorCode Partners(DemModel model, const DemMeeters *m, const Cells *cells, const Joints *joints, PetscInt a, PetscInt *n_found, PetscInt *space, PetscInt **found)
{
  DemContacts    *c = &model->contacts;
  const PetscInt  dim = model->dim, *clump = model->clumps.of, p = m->at[a];
  const PetscReal *x = m->x + 3 * a;
  PetscInt        cell[3], n = 0, kept = 0;

  PetscFunctionBegin;
  CellOf(cells, dim, x, cell);
  for (PetscInt o = 0; o < (dim == 3 ? 27 : 9); o++) {
    PetscInt at[3] = {cell[0] + o % 3 - 1, cell[1] + o / 3 % 3 - 1, dim == 3 ? cell[2] + o / 9 - 1 : 0}, bucket;

    for (PetscInt d = 0; d < dim; d++)
      if (cells->n[d]) at[d] = (at[d] + cells->n[d]) % cells->n[d];
    bucket = Bucket(cells, at);
    for (PetscInt k = cells->start[bucket]; k < cells->start[bucket + 1]; k++) {
      const PetscInt b  = cells->item[k];
      PetscReal      d2 = 0;

      if (b <= a || (p < 0 && m->at[b] < 0) || (clump && clump[p] >= 0 && clump[p] == clump[m->at[b]])) continue;
      for (PetscInt d = 0; d < dim; d++) {
        PetscReal y = x[d] - m->x[3 * b + d];

        if (cells->period[d] > 0) y -= cells->period[d] * rint(y / cells->period[d]);
        d2 += y * y;
      }
      c->looked++;
      if (d2 >= PetscSqr(m->r[a] + m->r[b] + c->skin) || Joined(joints, m, a, b)) continue;
      if (n == *space) {
        *space = PetscMax(64, 2 * n);
        PetscCall(PetscRealloc(*space * sizeof(PetscInt), found));
      }
      (*found)[n++] = b;
    }
  }
  if (n > 1) qsort(*found, n, sizeof(PetscInt), CompareInts);
  for (PetscInt k = 0; k < n; k++) /* two of the cells may share a bucket */
    if (!k || (*found)[k] != (*found)[k - 1]) (*found)[kept++] = (*found)[k];
  *n_found = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A list before a search: its pairs by their numbers on one rank, and what they remember. */
typedef struct {
  PetscInt       m, *p, *q;
  PetscReal     *past, *roll;
  unsigned char *met;
} Old;

PetscInt DemContactId_Internal(DemModel model, PetscInt p)
{
  return p < model->own ? IdOf(model, p) : model->contacts.ghost_id[p - model->own];
}

static PetscErrorCode OldCreate(DemModel model, Old *o)
{
  const DemContacts *c = &model->contacts;
  const PetscInt     m = c->m;

  PetscFunctionBegin;
  *o = (Old){.m = m};
  PetscCall(PetscMalloc5(m, &o->p, m, &o->q, DEM_PAST * m, &o->past, m, &o->met, c->turns ? 4 * m : 0, &o->roll));
  for (PetscInt k = 0; k < m; k++) {
    o->p[k] = DemContactId_Internal(model, c->p[k]);
    o->q[k] = DemContactId_Internal(model, c->q[k]);
  }
  PetscCall(PetscArraycpy(o->past, c->past, DEM_PAST * m));
  PetscCall(PetscArraycpy(o->met, c->met, m));
  if (c->turns) PetscCall(PetscArraycpy(o->roll, c->roll, 4 * m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Carry what the old pairs remember over to the new ones, -1 for the offset of a pair that was none; both lists are sorted. */
static void Remember(DemModel model, const Old *old)
{
  DemContacts *c = &model->contacts;

  for (PetscInt k = 0, o = 0; k < c->m; k++) {
    const PetscInt p = DemContactId_Internal(model, c->p[k]), q = DemContactId_Internal(model, c->q[k]);

    while (o < old->m && (old->p[o] < p || (old->p[o] == p && old->q[o] < q))) o++;
    const PetscBool same = (PetscBool)(o < old->m && old->p[o] == p && old->q[o] == q);

    for (PetscInt i = 0; i < DEM_PAST; i++) c->past[DEM_PAST * k + i] = same ? old->past[DEM_PAST * o + i] : i == DEM_PAST_OFFSET ? -1 : 0;
    if (c->turns)
      for (PetscInt i = 0; i < 4; i++) c->roll[4 * k + i] = same ? old->roll[4 * o + i] : 0;
    c->met[k] = same ? old->met[o] : 0;
  }
}

static PetscErrorCode MeetersCreate(DemModel model, DemMeeters *m)
{
  const DemContacts *c = &model->contacts;

  PetscFunctionBegin;
  *m = (DemMeeters){.n = c->n_who};
  PetscCall(PetscMalloc1(m->n, &m->id));
  PetscCall(PetscMalloc1(m->n, &m->at));
  PetscCall(PetscMalloc1(3 * m->n, &m->x));
  PetscCall(PetscMalloc1(m->n, &m->r));
  if (c->fresh) PetscCall(PetscMalloc1(m->n, &m->fresh));
  for (PetscInt k = 0; k < m->n; k++) {
    const PetscInt p = c->who[k];

    m->at[k] = p;
    m->id[k] = IdOf(model, p);
    m->r[k]  = model->r[p];
    Position(model, p, m->x + 3 * k);
    if (c->fresh) m->fresh[k] = c->fresh[p];
  }
  if (model->ranks) PetscCall(DemMeetersOfOthers_Internal(model, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MeetersDestroy(DemMeeters *m)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(m->id));
  PetscCall(PetscFree(m->at));
  PetscCall(PetscFree(m->x));
  PetscCall(PetscFree(m->r));
  PetscCall(PetscFree(m->fresh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The pairs' ends, so far rows of m, become particles here and copies of others'; the copies are asked for. */
static PetscErrorCode Settle(DemModel model, const DemMeeters *m)
{
  DemContacts *c = &model->contacts;
  PetscInt    *here, *id, n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m->n, &here, m->n, &id));
  for (PetscInt a = 0; a < m->n; a++) here[a] = m->at[a] >= 0 ? m->at[a] : -1;
  if (model->ranks) {
    for (PetscInt k = 0; k < c->m; k++) {
      if (m->at[c->p[k]] < 0) here[c->p[k]] = -2;
      if (m->at[c->q[k]] < 0) here[c->q[k]] = -2;
    }
    for (PetscInt a = 0; a < m->n; a++)
      if (here[a] == -2) {
        here[a] = model->own + n;
        id[n++] = m->id[a];
      }
    PetscCall(DemContactGhosts_Internal(model, n, id));
  }
  for (PetscInt k = 0; k < c->m; k++) {
    c->p[k] = here[c->p[k]];
    c->q[k] = here[c->q[k]];
  }
  PetscCall(PetscFree2(here, id));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemContactsSearch_Internal(DemModel model)
{
  DemContacts   *c = &model->contacts;
  const PetscInt n = model->n;
  PetscInt       space = 0, *found = NULL, n_found;
  PetscReal     *overlap;
  PetscBool     *begins; /* [pairs] as the run does, or a particle that wakes */
  DemMeeters     meeters;
  Joints         joints;
  Cells          cells;
  Old            old;

  PetscFunctionBegin;
  if (c->options.domain == DEM_DOMAIN_BOX) PetscCall(Leave(model));
  c->broken = PartBonds(model);
  PetscCall(DemContactsAgree_Internal(model, 1, &c->broken));
  PetscCall(DemContactsWho_Internal(model));
  PetscCall(MeetersCreate(model, &meeters));
  PetscCall(CellsCreate(model, &meeters, &cells));
  PetscCall(JointsCreate(model, &joints));
  PetscCall(OldCreate(model, &old));
  c->m = 0;
  for (PetscInt a = 0; a < meeters.n; a++) {
    PetscCall(Partners(model, &meeters, &cells, &joints, a, &n_found, &space, &found));
    PetscCall(DemContactsRoom_Internal(model, c->m + n_found));
    for (PetscInt i = 0; i < n_found; i++) {
      c->p[c->m] = a;
      c->q[c->m] = found[i];
      for (PetscInt d = 0; c->image && d < 3; d++) {
        const PetscReal y = meeters.x[3 * a + d] - meeters.x[3 * found[i] + d];

        c->image[3 * c->m + d] = cells.period[d] > 0 ? -cells.period[d] * rint(y / cells.period[d]) : 0;
      }
      c->m++;
    }
  }
  PetscCall(PetscMalloc2(c->m, &overlap, c->m, &begins));
  for (PetscInt k = 0; k < c->m; k++) {
    const PetscInt a = c->p[k], b = c->q[k];
    PetscReal      d2 = 0;

    begins[k] = (PetscBool)((!c->searches || c->fresh) && !c->options.push && (!meeters.fresh || meeters.fresh[a] || meeters.fresh[b]));
    for (PetscInt d = 0; d < model->dim; d++) d2 += PetscSqr(meeters.x[3 * a + d] - meeters.x[3 * b + d] + (c->image ? c->image[3 * k + d] : 0));
    overlap[k] = meeters.r[a] + meeters.r[b] - PetscSqrtReal(d2);
  }
  PetscCall(Settle(model, &meeters));
  Remember(model, &old);
  /* Pairs that overlap at the start do so without force, and so do those that what broke has made a pair. */
  for (PetscInt k = 0; k < c->m; k++) {
    PetscReal      *offset = &c->past[DEM_PAST * k + DEM_PAST_OFFSET];
    const PetscBool breaks = (PetscBool)(*offset < 0 && c->searches && model->bonded);

    *offset = PetscMax(0, *offset);
    if ((begins[k] || breaks) && overlap[k] > 0) *offset = overlap[k];
  }
  for (PetscInt d = 0; d < 3; d++)
    for (PetscInt k = 0; k < model->own; k++) c->ref[d * n + k] = model->x0[d * n + k] + model->u[d * n + k];
  c->searches++;
  PetscCall(PetscFree(c->fresh));
  PetscCall(DemContactsBlocks_Internal(model));
  PetscCall(PetscFree5(old.p, old.q, old.past, old.met, old.roll));
  PetscCall(PetscFree(found));
  PetscCall(PetscFree2(overlap, begins));
  PetscCall(PetscFree(joints.start));
  PetscCall(PetscFree(joints.partner));
  PetscCall(MeetersDestroy(&meeters));
  PetscCall(PetscFree3(cells.start, cells.item, cells.bucket));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Blocks whose pairs are here: first and last of each one's own particles, first pair. */
static PetscErrorCode Blocks(DemModel model)
{
  DemContacts   *c   = &model->contacts;
  const PetscInt all = model->ranks ? model->ranks->particles : model->n, size = DEM_CONTACT_BLOCK;
  PetscInt       k   = 0;

  PetscFunctionBegin;
  c->n_blocks = 0;
  for (PetscInt b = 0; b * size < all; b++) {
    const PetscInt first = model->ranks ? DemOwnOf(model->ranks, b * size) : b * size, from = k;

    while (k < c->m && DemContactId_Internal(model, c->p[k]) < (b + 1) * size) k++;
    if (first < 0 && from == k) continue;
    c->first[c->n_blocks]  = PetscMax(first, 0);
    c->last[c->n_blocks]   = first < 0 ? 0 : first + PetscMin(size, all - b * size);
    c->pair[c->n_blocks++] = from;
  }
  c->pair[c->n_blocks] = k;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which pairs each block has, where its copy keeps their particles, and who waits for its slots. */
PetscErrorCode DemContactsBlocks_Internal(DemModel model)
{
  DemContacts   *c = &model->contacts;
  const PetscInt n = model->own + c->ghosts;
  PetscInt      *local, slots = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &local));
  PetscCall(PetscFree2(c->halo_p, c->slot));
  PetscCall(PetscFree(c->slot_f));
  for (PetscInt p = 0; p < n; p++) local[p] = -1;
  PetscCall(PetscArrayzero(c->slot_start, model->own + 1));
  PetscCall(Blocks(model));
  c->widest = 0;
  for (PetscInt pass = 0; pass < 2; pass++) {
    slots = 0;
    for (PetscInt b = 0; b < c->n_blocks; b++) {
      const PetscInt begin = c->first[b], end = c->last[b];
      PetscInt       found = 0;

      c->halo_start[b] = slots;
      for (PetscInt k = c->pair[b]; k < c->pair[b + 1]; k++)
        for (PetscInt side = 0; side < 2; side++) {
          const PetscInt q = side ? c->q[k] : c->p[k];

          if ((q >= begin && q < end) || local[q] >= 0) continue;
          local[q] = 0;
          if (pass) c->halo_p[slots + found] = q;
          found++;
        }
      if (pass) {
        PetscCall(PetscSortInt(found, c->halo_p + slots));
        for (PetscInt s = 0; s < found; s++) {
          const PetscInt q = c->halo_p[slots + s];

          local[q] = end - begin + s;
          if (q < model->own) c->slot_start[q + 1]++;
        }
        for (PetscInt k = c->pair[b]; k < c->pair[b + 1]; k++) {
          const PetscInt p = c->p[k], q = c->q[k];

          c->ip[k] = (int)(p >= begin && p < end ? p - begin : local[p]);
          c->iq[k] = (int)(q >= begin && q < end ? q - begin : local[q]);
        }
      }
      for (PetscInt k = c->pair[b]; k < c->pair[b + 1]; k++) local[c->p[k]] = local[c->q[k]] = -1;
      c->widest = PetscMax(c->widest, end - begin + found);
      slots += found;
    }
    c->halo_start[c->n_blocks] = slots;
    if (!pass) PetscCall(PetscMalloc2(slots, &c->halo_p, slots, &c->slot));
  }
  for (PetscInt p = 0; p < model->own; p++) c->slot_start[p + 1] += c->slot_start[p];
  for (PetscInt p = 0; p < model->own; p++) local[p] = c->slot_start[p];
  for (PetscInt s = 0; s < slots; s++)
    if (c->halo_p[s] < model->own) c->slot[local[c->halo_p[s]]++] = s;
  c->n_slots = slots;
  PetscCall(PetscCalloc1(8 * slots, &c->slot_f));
  PetscCall(PetscFree(local));
  for (PetscInt t = 0; t < model->threads; t++) PetscCall(PetscRealloc(PetscMax(c->widest, 1) * 20 * sizeof(PetscReal), &c->scratch[t]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
