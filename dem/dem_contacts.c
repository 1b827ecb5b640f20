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
  PetscInt *item;     /* [n_who] particles by bucket, ascending within */
  PetscInt *bucket;   /* [n_who] */
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

/* A bond that carries nothing any more is none, and its pair meets again as any other: when its spheres no longer touch, or its facet has slid or turned off. */
static PetscInt PartBonds(DemModel model)
{
  const PetscInt  n = model->n;
  const DemBonds *b = &model->bonds;
  PetscInt        broken = 0;

  if (!model->crack.damage) return 0;
  for (PetscInt e = 0; e < b->n; e++) {
    PetscReal d2 = 0;

    if (model->crack.damage[e] < DEM_CONTACT_BROKEN) continue;
    broken++;
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
  for (PetscInt p = 0; p < model->n; p++)
    if (in[p] && !(c->gone && c->gone[p])) c->who[c->n_who++] = p;
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CellsCreate(DemModel model, Cells *cells)
{
  DemContacts *c = &model->contacts;
  PetscReal    most = 0;
  PetscInt     buckets = 64, *bucket, cell[3];

  PetscFunctionBegin;
  PetscCall(PetscMemzero(cells, sizeof(*cells)));
  for (PetscInt k = 0; k < c->n_who; k++) most = PetscMax(most, model->r[c->who[k]]);
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
  while (buckets < 2 * c->n_who) buckets *= 2;
  cells->mask = buckets - 1;
  PetscCall(PetscMalloc3(buckets + 1, &cells->start, c->n_who, &cells->item, c->n_who, &cells->bucket));
  bucket = cells->bucket;
  PetscCall(PetscArrayzero(cells->start, buckets + 1));
  for (PetscInt k = 0; k < c->n_who; k++) {
    PetscReal x[3];

    Position(model, c->who[k], x);
    CellOf(cells, model->dim, x, cell);
    bucket[k] = Bucket(cells, cell);
    cells->start[bucket[k] + 1]++;
  }
  for (PetscInt b = 0; b < buckets; b++) cells->start[b + 1] += cells->start[b];
  for (PetscInt k = c->n_who - 1; k >= 0; k--) cells->item[--cells->start[bucket[k] + 1]] = c->who[k];
  /* start[b + 1] has run down to the first of bucket b: shift back */
  for (PetscInt b = 0; b < buckets; b++) cells->start[b] = cells->start[b + 1];
  cells->start[buckets] = c->n_who;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Particles whose centre is outside the box stop and take no part any more. With them goes what the ledger had of them a step ago, kinetic and
   in contacts, and the work of their weight since. */
static void Leave(DemModel model)
{
  DemContacts   *c = &model->contacts;
  const PetscInt n = model->n, before = c->n_gone;

  for (PetscInt p = 0; p < n; p++) {
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
  if (c->n_gone == before) return;
  for (PetscInt k = 0; k < c->m; k++)
    if (c->met[k] && (c->gone[c->p[k]] || c->gone[c->q[k]])) c->taken += DemContactEnergy_Internal(model, k, PetscAbsReal(c->past[DEM_PAST * k + DEM_PAST_OVERLAP]));
}

/* Facets still join them. Bonds are sorted by p, then q. */
static PetscBool Joined(DemModel model, const PetscInt *first_bond, PetscInt p, PetscInt q)
{
  const DemBonds *b = &model->bonds;

  if (!b->n) return PETSC_FALSE;
  for (PetscInt e = first_bond[p]; e < first_bond[p + 1]; e++)
    if (b->q[e] == q && !(model->crack.damage && (model->crack.state[e] & DEM_BOND_PARTED))) return PETSC_TRUE;
  return PETSC_FALSE;
}

static int CompareInts(const void *a, const void *b)
{
  const PetscInt x = *(const PetscInt *)a, y = *(const PetscInt *)b;

  return x < y ? -1 : x > y;
}

/* Partners q > p of particle p, ascending and once each. */
static PetscErrorCode Partners(DemModel model, const Cells *cells, const PetscInt *first_bond, PetscInt p, PetscInt *n_found, PetscInt *space, PetscInt **found)
{
  DemContacts *c = &model->contacts;
  const PetscInt  dim = model->dim, *clump = model->clumps.of;
  PetscInt       cell[3], n = 0, kept = 0;
  PetscReal      x[3];

  PetscFunctionBegin;
  Position(model, p, x);
  CellOf(cells, dim, x, cell);
  for (PetscInt o = 0; o < (dim == 3 ? 27 : 9); o++) {
    PetscInt at[3] = {cell[0] + o % 3 - 1, cell[1] + o / 3 % 3 - 1, dim == 3 ? cell[2] + o / 9 - 1 : 0}, b;

    for (PetscInt d = 0; d < dim; d++)
      if (cells->n[d]) at[d] = (at[d] + cells->n[d]) % cells->n[d];
    b = Bucket(cells, at);
    for (PetscInt k = cells->start[b]; k < cells->start[b + 1]; k++) {
      const PetscInt q = cells->item[k];
      PetscReal      d2 = 0;

      if (q <= p || (clump && clump[p] >= 0 && clump[p] == clump[q])) continue;
      for (PetscInt d = 0; d < dim; d++) {
        PetscReal y = x[d] - (model->x0[d * model->n + q] + model->u[d * model->n + q]);

        if (cells->period[d] > 0) y -= cells->period[d] * rint(y / cells->period[d]);
        d2 += y * y;
      }
      c->looked++;
      if (d2 >= PetscSqr(model->r[p] + model->r[q] + c->skin) || Joined(model, first_bond, p, q)) continue;
      if (n == *space) {
        *space = PetscMax(64, 2 * n);
        PetscCall(PetscRealloc(*space * sizeof(PetscInt), found));
      }
      (*found)[n++] = q;
    }
  }
  if (n > 1) qsort(*found, n, sizeof(PetscInt), CompareInts);
  for (PetscInt k = 0; k < n; k++) /* two of the cells may share a bucket */
    if (!k || (*found)[k] != (*found)[k - 1]) (*found)[kept++] = (*found)[k];
  *n_found = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Carry what the old pairs remember over to the new ones, -1 for the offset of a pair that was none; both lists are sorted. */
static void Remember(DemContacts *c, PetscInt m, const PetscInt *p, const PetscInt *q, const PetscReal *past, const PetscReal *roll, const unsigned char *met)
{
  for (PetscInt k = 0, o = 0; k < c->m; k++) {
    while (o < m && (p[o] < c->p[k] || (p[o] == c->p[k] && q[o] < c->q[k]))) o++;
    const PetscBool same = (PetscBool)(o < m && p[o] == c->p[k] && q[o] == c->q[k]);

    for (PetscInt i = 0; i < DEM_PAST; i++) c->past[DEM_PAST * k + i] = same ? past[DEM_PAST * o + i] : i == DEM_PAST_OFFSET ? -1 : 0;
    if (c->turns)
      for (PetscInt i = 0; i < 4; i++) c->roll[4 * k + i] = same ? roll[4 * o + i] : 0;
    c->met[k] = same ? met[o] : 0;
  }
}

PetscErrorCode DemContactsSearch_Internal(DemModel model)
{
  DemContacts   *c = &model->contacts;
  const PetscInt n = model->n, m = c->m;
  PetscInt      *p, *q, *first_bond = NULL, space = 0, *found = NULL, n_found;
  PetscReal     *past, *roll = NULL;
  unsigned char *met;
  Cells          cells;

  PetscFunctionBegin;
  if (c->options.domain == DEM_DOMAIN_BOX) Leave(model);
  c->broken = PartBonds(model);
  PetscCall(DemContactsWho_Internal(model));
  PetscCall(CellsCreate(model, &cells));
  if (model->bonds.n) {
    PetscCall(PetscCalloc1(n + 1, &first_bond));
    for (PetscInt e = 0; e < model->bonds.n; e++) first_bond[model->bonds.p[e] + 1]++;
    for (PetscInt k = 0; k < n; k++) first_bond[k + 1] += first_bond[k];
  }
  PetscCall(PetscMalloc4(m, &p, m, &q, DEM_PAST * m, &past, m, &met));
  PetscCall(PetscArraycpy(p, c->p, m));
  PetscCall(PetscArraycpy(q, c->q, m));
  PetscCall(PetscArraycpy(past, c->past, DEM_PAST * m));
  PetscCall(PetscArraycpy(met, c->met, m));
  if (c->turns) {
    PetscCall(PetscMalloc1(4 * m, &roll));
    PetscCall(PetscArraycpy(roll, c->roll, 4 * m));
  }
  c->m = 0;
  for (PetscInt k = 0; k < c->n_who; k++) {
    PetscCall(Partners(model, &cells, first_bond, c->who[k], &n_found, &space, &found));
    PetscCall(DemContactsRoom_Internal(model, c->m + n_found));
    for (PetscInt i = 0; i < n_found; i++) {
      c->p[c->m] = c->who[k];
      c->q[c->m] = found[i];
      if (c->image)
        for (PetscInt d = 0; d < 3; d++) {
          const PetscReal y = model->x0[d * n + c->who[k]] + model->u[d * n + c->who[k]] - model->x0[d * n + found[i]] - model->u[d * n + found[i]];

          c->image[3 * c->m + d] = cells.period[d] > 0 ? -cells.period[d] * rint(y / cells.period[d]) : 0;
        }
      c->m++;
    }
  }
  Remember(c, m, p, q, past, roll, met);
  /* Pairs that overlap at the start do so without force, and so do those that what broke has made a pair. */
  for (PetscInt k = 0; k < c->m; k++) {
    const PetscBool begins = (PetscBool)((!c->searches || c->fresh) && !c->options.push && (!c->fresh || c->fresh[c->p[k]] || c->fresh[c->q[k]]));
    PetscReal      *offset = &c->past[DEM_PAST * k + DEM_PAST_OFFSET], d2 = 0, overlap;
    const PetscBool breaks = (PetscBool)(*offset < 0 && c->searches && model->bonds.n);

    *offset = PetscMax(0, *offset);
    if (!begins && !breaks) continue;
    for (PetscInt d = 0; d < model->dim; d++) d2 += PetscSqr(model->x0[d * n + c->p[k]] + model->u[d * n + c->p[k]] - model->x0[d * n + c->q[k]] - model->u[d * n + c->q[k]] + (c->image ? c->image[3 * k + d] : 0));
    overlap = model->r[c->p[k]] + model->r[c->q[k]] - PetscSqrtReal(d2);
    if (overlap > 0) *offset = overlap;
  }
  for (PetscInt d = 0; d < 3; d++)
    for (PetscInt k = 0; k < n; k++) c->ref[d * n + k] = model->x0[d * n + k] + model->u[d * n + k];
  c->searches++;
  PetscCall(PetscFree(c->fresh));
  PetscCall(DemContactsBlocks_Internal(model));
  PetscCall(PetscFree4(p, q, past, met));
  PetscCall(PetscFree(roll));
  PetscCall(PetscFree(found));
  PetscCall(PetscFree(first_bond));
  PetscCall(PetscFree3(cells.start, cells.item, cells.bucket));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which pairs each block has, where its copy keeps their particles, and who waits for its slots. */
PetscErrorCode DemContactsBlocks_Internal(DemModel model)
{
  DemContacts   *c = &model->contacts;
  const PetscInt n = model->n;
  PetscInt      *local, slots = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &local));
  PetscCall(PetscFree2(c->halo, c->slot));
  PetscCall(PetscFree(c->slot_f));
  for (PetscInt p = 0; p < n; p++) local[p] = -1;
  PetscCall(PetscArrayzero(c->slot_start, n + 1));
  for (PetscInt b = 0, k = 0; b < c->n_blocks; b++) {
    c->pair[b] = k;
    while (k < c->m && c->p[k] < (b + 1) * DEM_CONTACT_BLOCK) k++;
    c->pair[b + 1] = k;
  }
  c->widest = 0;
  for (PetscInt pass = 0; pass < 2; pass++) {
    slots = 0;
    for (PetscInt b = 0; b < c->n_blocks; b++) {
      const PetscInt begin = b * DEM_CONTACT_BLOCK, end = PetscMin(n, begin + DEM_CONTACT_BLOCK);
      PetscInt       found = 0;

      c->halo_start[b] = slots;
      for (PetscInt k = c->pair[b]; k < c->pair[b + 1]; k++)
        if (c->q[k] >= end && local[c->q[k]] < 0) {
          local[c->q[k]] = 0;
          if (pass) c->halo[slots + found] = c->q[k];
          found++;
        }
      if (pass) {
        PetscCall(PetscSortInt(found, c->halo + slots));
        for (PetscInt s = 0; s < found; s++) {
          local[c->halo[slots + s]] = end - begin + s;
          c->slot_start[c->halo[slots + s] + 1]++;
        }
        for (PetscInt k = c->pair[b]; k < c->pair[b + 1]; k++) {
          c->ip[k] = (int)(c->p[k] - begin);
          c->iq[k] = (int)(c->q[k] < end ? c->q[k] - begin : local[c->q[k]]);
        }
      }
      for (PetscInt k = c->pair[b]; k < c->pair[b + 1]; k++) local[c->q[k]] = -1;
      c->widest = PetscMax(c->widest, end - begin + found);
      slots += found;
    }
    c->halo_start[c->n_blocks] = slots;
    if (!pass) PetscCall(PetscMalloc2(slots, &c->halo, slots, &c->slot));
  }
  for (PetscInt p = 0; p < n; p++) c->slot_start[p + 1] += c->slot_start[p];
  for (PetscInt p = 0; p < n; p++) local[p] = c->slot_start[p];
  for (PetscInt s = 0; s < slots; s++) c->slot[local[c->halo[s]]++] = s;
  c->n_slots = slots;
  PetscCall(PetscCalloc1(8 * slots, &c->slot_f));
  PetscCall(PetscFree(local));
  for (PetscInt t = 0; t < model->threads; t++) PetscCall(PetscRealloc(PetscMax(c->widest, 1) * 20 * sizeof(PetscReal), &c->scratch[t]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
