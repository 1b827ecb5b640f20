/*
  dem_ranks.c - a model that has just been set up keeps its rank's part of it.

  Every rank sets up the whole body, so that checks, areas, the critical step are those of one rank to the last bit; then it
  takes its rows out of each array and frees the rest. From there on memory and steps are shared out.
*/
#include "dem_rule.h"
#include "dem_tool_impl.h"

typedef struct {
  PetscMPIInt *owner;  /* [units] */
  PetscInt     own, n; /* particles here: own, with ghosts */
  PetscInt    *take;   /* [n] particle of the whole body */
  PetscInt    *local;  /* [particles] its number here, -1 */
  PetscInt     bonds, *bond;   /* here, of the whole body */
  PetscInt     blocks, *block, *first, *bond_start; /* here: number; first own particle, first bond */
  PetscInt     facets, *facet, *facet_local;
} Part;

/* New array of the chosen rows of so many bytes in place of the one that *array points to; none stays none. */
static PetscErrorCode TakeRows(PetscInt n, const PetscInt take[], size_t row, void *array)
{
  const char *from = *(void **)array;
  char       *to;

  PetscFunctionBegin;
  if (!from) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(row * (size_t)n, &to));
  for (PetscInt k = 0; k < n; k++) memcpy(to + row * (size_t)k, from + row * (size_t)take[k], row);
  PetscCall(PetscFree(*(void **)array));
  *(void **)array = to;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns of length `old` into columns of length `stride`. */
static void Columns(PetscInt columns, PetscInt old, PetscInt stride, PetscInt count, const PetscInt take[], const PetscReal *from, PetscReal *to)
{
  for (PetscInt d = 0; d < columns; d++)
    for (PetscInt k = 0; k < count; k++) to[d * stride + k] = from[d * old + take[k]];
}

PetscErrorCode DemReshape_Internal(DemModel model, PetscInt stride, PetscInt count, const PetscInt take[])
{
  const PetscInt n = model->n;
  PetscReal     *a[6];

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(3 * stride, &a[0], stride, &a[1]));
  Columns(3, n, stride, count, take, model->x0, a[0]);
  Columns(1, n, stride, count, take, model->r, a[1]);
  PetscCall(PetscFree2(model->x0, model->r));
  model->x0 = a[0];
  model->r  = a[1];

  PetscCall(PetscCalloc3(3 * stride, &a[0], 3 * stride, &a[1], 3 * stride, &a[2]));
  Columns(3, n, stride, count, take, model->u, a[0]);
  Columns(3, n, stride, count, take, model->v, a[1]);
  Columns(3, n, stride, count, take, model->f, a[2]);
  PetscCall(PetscFree3(model->u, model->v, model->f));
  model->u = a[0];
  model->v = a[1];
  model->f = a[2];

  PetscCall(PetscCalloc3(4 * stride, &a[0], 3 * stride, &a[1], 3 * stride, &a[2]));
  Columns(4, n, stride, count, take, model->rot, a[0]);
  Columns(3, n, stride, count, take, model->spin, a[1]);
  Columns(3, n, stride, count, take, model->torque, a[2]);
  PetscCall(PetscFree3(model->rot, model->spin, model->torque));
  model->rot    = a[0];
  model->spin   = a[1];
  model->torque = a[2];

  PetscCall(PetscCalloc6(stride, &a[0], stride, &a[1], stride, &a[2], stride, &a[3], stride, &a[4], stride, &a[5]));
  Columns(1, n, stride, count, take, model->mass, a[0]);
  Columns(1, n, stride, count, take, model->inertia, a[1]);
  Columns(1, n, stride, count, take, model->volume, a[2]);
  Columns(1, n, stride, count, take, model->vstar, a[3]);
  Columns(1, n, stride, count, take, model->sum, a[4]);
  Columns(1, n, stride, count, take, model->dilation, a[5]);
  PetscCall(PetscFree6(model->mass, model->inertia, model->volume, model->vstar, model->sum, model->dilation));
  model->mass     = a[0];
  model->inertia  = a[1];
  model->volume   = a[2];
  model->vstar    = a[3];
  model->sum      = a[4];
  model->dilation = a[5];

  PetscCall(PetscCalloc1(3 * stride, &a[0]));
  Columns(3, n, stride, count, take, model->offset, a[0]);
  PetscCall(PetscFree(model->offset));
  model->offset = a[0];

  PetscCall(PetscFree2(model->rank_of, model->at)); /* from here on the packing is what is here, in the same order */
  PetscCall(PetscMalloc2(stride, &model->rank_of, stride, &model->at));
  for (PetscInt p = 0; p < stride; p++) model->rank_of[p] = model->at[p] = p;
  model->n = stride;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool IsOwn(const DemRanks r, PetscInt id)
{
  return (PetscBool)(r->unit_owner[id / r->unit] == r->rank);
}

/* Which particles, blocks, bonds and facets are this rank's. */
static PetscErrorCode Choose(DemModel model, Part *part)
{
  const DemRanks  r = model->ranks;
  const DemBonds *bonds = &model->bonds;
  const DemBlocks *b = &model->blocks;
  const DemCells *cells = &model->cells;
  const PetscInt  n = model->n, n_facets = cells->n_facets;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n, &part->take, n, &part->local));
  for (PetscInt p = 0; p < n; p++) part->local[p] = -1;
  for (PetscInt p = 0; p < n; p++)
    if (IsOwn(r, p)) {
      part->local[p]         = part->own;
      part->take[part->own++] = p;
    }
  PetscCall(PetscMalloc4(bonds->n, &part->bond, b->n_blocks, &part->block, b->n_blocks + 1, &part->first, b->n_blocks + 1, &part->bond_start));
  part->first[0] = part->bond_start[0] = 0;
  for (PetscInt k = 0; k < b->n_blocks; k++) {
    const PetscBool mine = IsOwn(r, b->first[k]);
    const PetscInt  before = part->bonds;

    for (PetscInt e = b->bond[k]; e < b->bond[k + 1]; e++)
      if (mine || IsOwn(r, bonds->q[e])) part->bond[part->bonds++] = e;
    if (!mine && part->bonds == before) continue;
    part->block[part->blocks++]     = k;
    part->first[part->blocks]       = part->first[part->blocks - 1] + (mine ? b->first[k + 1] - b->first[k] : 0);
    part->bond_start[part->blocks]  = part->bonds;
  }
  PetscCall(PetscMalloc2(n_facets, &part->facet, n_facets, &part->facet_local));
  for (PetscInt f = 0; f < n_facets; f++) {
    const PetscInt p = model->rank_of[cells->p[f]], q = model->rank_of[cells->q[f]];

    part->facet_local[f] = -1;
    if (!IsOwn(r, p) && !IsOwn(r, q)) continue;
    part->facet_local[f]        = part->facets;
    part->facet[part->facets++] = f;
    if (part->local[p] < 0) part->local[p] = n;
    if (part->local[q] < 0) part->local[q] = n;
  }
  for (PetscInt k = 0; k < part->bonds; k++) {
    const PetscInt end[2] = {bonds->p[part->bond[k]], bonds->q[part->bond[k]]};

    for (PetscInt s = 0; s < 2; s++)
      if (part->local[end[s]] < 0) part->local[end[s]] = n;
  }
  part->n = part->own;
  for (PetscInt p = 0; p < n; p++)
    if (part->local[p] == n) {
      part->local[p]       = part->n;
      part->take[part->n++] = p;
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What says who is who, before the arrays it comes from are cut. */
static PetscErrorCode Number(DemModel model, const Part *part)
{
  DemRanks r = model->ranks;

  PetscFunctionBegin;
  r->particles  = model->n;
  r->bonds      = model->bonds.n;
  r->walls      = model->walls.n;
  r->cell_walls = model->cells.n_walls;
  r->blocks     = model->blocks.n_blocks;
  r->ghosts     = part->n - part->own;
  PetscCall(PetscMalloc1(part->n, &r->id));
  PetscCall(PetscMalloc1(part->n, &r->number));
  PetscCall(PetscMalloc1(part->bonds, &r->bond));
  PetscCall(PetscMalloc1(part->bonds, &r->mine));
  PetscCall(PetscMalloc1(part->facets, &r->facet));
  PetscCall(PetscMalloc1(part->blocks, &r->block));
  PetscCall(PetscMalloc1(part->blocks, &r->block_mine));
  PetscCall(PetscMalloc1(r->blocks + 1, &r->bond_start));
  PetscCall(PetscArraycpy(r->bond_start, model->blocks.bond, r->blocks + 1));
  for (PetscInt p = 0; p < part->n; p++) {
    r->id[p]     = part->take[p];
    r->number[p] = model->at[part->take[p]];
  }
  for (PetscInt e = 0; e < part->bonds; e++) {
    r->bond[e] = part->bond[e];
    r->mine[e] = IsOwn(r, model->bonds.p[part->bond[e]]);
  }
  for (PetscInt f = 0; f < part->facets; f++) r->facet[f] = part->facet[f];
  for (PetscInt b = 0; b < part->blocks; b++) {
    r->block[b]      = part->block[b];
    r->block_mine[b] = IsOwn(r, model->blocks.first[part->block[b]]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Facets and boundary facets of the rank's own particles. The packing here is the model's own order: at[] is still the whole body's. */
static PetscErrorCode CutCells(DemModel model, const Part *part)
{
  DemCells  *c = &model->cells;
  PetscInt  *wall, walls = 0, *packed;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(c->n_walls, &wall, part->n, &packed));
  for (PetscInt p = 0; p < part->n; p++) packed[p] = model->at[part->take[p]];
  for (PetscInt w = 0; w < c->n_walls; w++) {
    const PetscInt p = part->local[model->rank_of[c->wall_p[w]]];

    if (p >= 0 && p < part->own) wall[walls++] = w;
  }
  for (PetscInt f = 0; f < c->n_facets; f++) {
    c->p[f] = part->local[model->rank_of[c->p[f]]];
    c->q[f] = part->local[model->rank_of[c->q[f]]];
  }
  for (PetscInt k = 0; k < model->n_history; k++) { /* probes are the owner's */
    DemHistory *h = &model->history[k];

    if (h->quantity[0] != 'p' || h->particle < 0) continue;
    h->particle = part->local[model->rank_of[h->particle]];
    if (h->particle < 0 || h->particle >= part->own) h->particle = -2;
  }
  for (PetscInt w = 0; w < c->n_walls; w++) c->wall_p[w] = part->local[model->rank_of[c->wall_p[w]]];
  if (c->facet_start) {
    PetscInt *start, corners = 0;
    float    *corner;

    PetscCall(PetscMalloc1(part->facets + 1, &start));
    for (PetscInt f = 0; f < part->facets; f++) corners += c->facet_start[part->facet[f] + 1] - c->facet_start[part->facet[f]];
    PetscCall(PetscMalloc1(3 * corners, &corner));
    start[0] = 0;
    for (PetscInt f = 0; f < part->facets; f++) {
      const PetscInt first = c->facet_start[part->facet[f]], m = c->facet_start[part->facet[f] + 1] - first;

      PetscCall(PetscArraycpy(corner + 3 * start[f], c->corner + 3 * first, 3 * m));
      start[f + 1] = start[f] + m;
    }
    PetscCall(PetscFree(c->facet_start));
    PetscCall(PetscFree(c->corner));
    c->facet_start = start;
    c->corner      = corner;
  }
  if (c->n) {
    PetscCall(TakeRows(part->n, packed, sizeof(PetscReal), &c->volume));
    PetscCall(TakeRows(part->n, packed, 3 * sizeof(PetscReal), &c->centroid));
    c->n = part->n;
  }
  PetscCall(TakeRows(part->facets, part->facet, sizeof(PetscInt), &c->p));
  PetscCall(TakeRows(part->facets, part->facet, sizeof(PetscInt), &c->q));
  PetscCall(TakeRows(part->facets, part->facet, sizeof(PetscReal), &c->area));
  PetscCall(TakeRows(part->facets, part->facet, 3 * sizeof(PetscReal), &c->at));
  c->n_facets = part->facets;
  PetscCall(TakeRows(walls, wall, sizeof(PetscInt), &c->wall_p));
  PetscCall(TakeRows(walls, wall, sizeof(PetscInt), &c->wall_face));
  PetscCall(TakeRows(walls, wall, sizeof(PetscReal), &c->wall_area));
  PetscCall(TakeRows(walls, wall, 3 * sizeof(PetscReal), &c->wall_at));
  PetscCall(TakeRows(walls, wall, 3 * sizeof(PetscReal), &c->wall_normal));
  c->n_walls = walls;
  PetscCall(TakeRows(part->n, packed, 3 * sizeof(PetscReal), &model->packing.x));
  PetscCall(TakeRows(part->n, packed, sizeof(PetscReal), &model->packing.r));
  model->packing.n = part->n;
  PetscCall(TakeRows(part->facets, part->facet, sizeof(PetscReal), &model->weak));
  PetscCall(PetscFree(model->group));
  PetscCall(PetscFree(model->breakable));
  PetscCall(TakeRows(part->n, packed, sizeof(PetscInt), &model->grain_of));
  PetscCall(TakeRows(part->n, packed, sizeof(PetscReal), &model->weight_mass));
  PetscCall(TakeRows(part->n, packed, sizeof(PetscReal), &model->weight_volume));
  PetscCall(TakeRows(part->facets, part->facet, sizeof(PetscReal), &model->weight_facet));
  PetscCall(TakeRows(part->n, part->take, sizeof(PetscReal), &model->share));
  PetscCall(TakeRows(part->n, part->take, 1, &model->tool_share));
  PetscCall(TakeRows(part->n, part->take, 1, &model->contacts.kind));
  PetscCall(PetscFree2(wall, packed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CutWalls(DemModel model, const Part *part)
{
  DemWalls      *w = &model->walls, old = *w;
  DemRanks       r = model->ranks;
  PetscInt       m = 0, rims = 0;

  PetscFunctionBegin;
  if (!old.start) PetscFunctionReturn(PETSC_SUCCESS); /* loose grains have none */
  for (PetscInt p = 0; p < part->own; p++)
    for (PetscInt i = old.start[part->take[p]]; i < old.start[part->take[p] + 1]; i++) {
      m++;
      rims += old.rim[i] >= 0;
    }
  PetscCall(PetscMalloc1(m, &r->wall));
  PetscCall(PetscMalloc7(part->n + 1, &w->start, m, &w->face, m, &w->kind, m, &w->area, m, &w->h, 3 * m, &w->arm, 3 * m, &w->normal));
  PetscCall(PetscMalloc1(m, &w->owner));
  PetscCall(PetscCalloc4(m, &w->rim, 3 * rims, &w->rim_x, 3 * rims, &w->rim_u, 3 * rims, &w->rim_f));
  PetscCall(PetscMalloc1(rims, &w->rim_number));
  w->n = w->n_rim = 0;
  for (PetscInt p = 0; p < part->n; p++) {
    w->start[p] = w->n;
    for (PetscInt i = old.start[part->take[p]]; p < part->own && i < old.start[part->take[p] + 1]; i++, w->n++) {
      r->wall[w->n]  = i;
      w->owner[w->n] = p;
      w->face[w->n]  = old.face[i];
      w->kind[w->n]  = old.kind[i];
      w->area[w->n]  = old.area[i];
      w->h[w->n]     = old.h[i];
      w->rim[w->n]   = old.rim[i] >= 0 ? w->n_rim : -1;
      if (old.rim[i] >= 0) {
        for (PetscInt d = 0; d < 3; d++) w->rim_x[3 * w->n_rim + d] = old.rim_x[3 * old.rim[i] + d];
        w->rim_number[w->n_rim++] = old.rim[i];
      }
      for (PetscInt d = 0; d < 3; d++) {
        w->arm[3 * w->n + d]    = old.arm[3 * i + d];
        w->normal[3 * w->n + d] = old.normal[3 * i + d];
      }
    }
  }
  w->start[part->n] = w->n;
  PetscCall(PetscFree7(old.start, old.face, old.kind, old.area, old.h, old.arm, old.normal));
  PetscCall(PetscFree(old.owner));
  PetscCall(PetscFree4(old.rim, old.rim_x, old.rim_u, old.rim_f));
  PetscCall(PetscFree(model->traction_old));
  PetscCall(PetscFree(model->traction_new));
  PetscCall(PetscCalloc1(DEM_TRACTION * m, &model->traction_old));
  PetscCall(PetscCalloc1(DEM_TRACTION * m, &model->traction_new));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CutBonds(DemModel model, const Part *part)
{
  DemBonds      *b = &model->bonds, old = *b;
  const PetscInt m = part->bonds, *take = part->bond;

  PetscFunctionBegin;
  b->n = m;
  PetscCall(PetscMalloc7(m, &b->p, m, &b->q, m, &b->ip, m, &b->iq, m, &b->k, 3 * m, &b->arm, m, &b->facet));
  for (PetscInt e = 0; e < m; e++) {
    b->p[e]     = part->local[old.p[take[e]]];
    b->q[e]     = part->local[old.q[take[e]]];
    b->k[e]     = old.k[take[e]];
    b->facet[e] = old.facet[take[e]] >= 0 ? part->facet_local[old.facet[take[e]]] : -1;
  }
  Columns(3, old.n, m, m, take, old.arm, b->arm);
  if (old.now == old.k) b->now = b->k;
  PetscCall(TakeRows(m, take, sizeof(PetscReal), &b->weight));
  PetscCall(PetscFree7(old.p, old.q, old.ip, old.iq, old.k, old.arm, old.facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CutBlocks(DemModel model, const Part *part)
{
  DemBlocks *b = &model->blocks;

  PetscFunctionBegin;
  PetscCall(PetscFree3(b->first, b->bond, b->halo_start));
  PetscCall(PetscFree3(b->halo, b->slot_start, b->slot));
  PetscCall(PetscFree2(b->slot_s, b->slot_f));
  b->n_blocks = part->blocks;
  b->widest   = 0;
  PetscCall(PetscMalloc3(b->n_blocks + 1, &b->first, b->n_blocks + 1, &b->bond, b->n_blocks + 1, &b->halo_start));
  PetscCall(PetscArraycpy(b->first, part->first, b->n_blocks + 1));
  PetscCall(PetscArraycpy(b->bond, part->bond_start, b->n_blocks + 1));
  b->halo_start[0] = 0;
  PetscCall(DemSetUpHalo_Internal(model));
  PetscCall(DemSetUpScratch_Internal(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing has broken yet: of the old state only what the bonds were born with counts. A rank without bonds has a damage too: it says that bonds can break. */
static PetscErrorCode CutCracks(DemModel model, const Part *part)
{
  DemCrackState *c = &model->crack, old = *c;
  const PetscInt m = part->bonds, blocks = part->blocks, n = model->n, slots = model->blocks.halo_start[blocks];
  PetscReal     *now = model->bonds.now;

  PetscFunctionBegin;
  if (!old.damage) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc7(m + 1, &c->damage, 3 * m, &c->e, 3 * m, &c->slip, m, &c->work, m, &c->rub, m, &c->time, m, &c->release));
  PetscCall(PetscCalloc6(m + 1, &c->state, blocks + 1, &c->awake, 6 * n, &c->stress, 6 * slots, &c->slot_stress, slots, &c->slot_v, n, &c->volume));
  PetscCall(PetscCalloc3(m, &model->bonds.now, m, &c->live, blocks, &c->n_live));
  for (PetscInt e = 0; e < m; e++) {
    c->damage[e]         = old.damage[part->bond[e]];
    c->state[e]          = old.state[part->bond[e]];
    model->bonds.now[e] = now[part->bond[e]];
  }
  if (old.limit) PetscCall(PetscCalloc1(m + 1, &c->limit));
  PetscCall(PetscFree7(old.damage, old.e, old.slip, old.work, old.rub, old.time, old.release));
  PetscCall(PetscFree6(old.state, old.awake, old.stress, old.slot_stress, old.slot_v, old.volume));
  PetscCall(PetscFree3(now, old.live, old.n_live));
  PetscCall(PetscFree(old.limit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CutRule(DemModel model, const Part *part, PetscInt old_bonds)
{
  DemNetwork     net = model->net;
  const PetscInt m = part->bonds, n = model->n, slots = model->blocks.halo_start[model->blocks.n_blocks];

  PetscFunctionBegin;
  if (!net) PetscFunctionReturn(PETSC_SUCCESS);
  {
    PetscReal *a[5];

    PetscCall(PetscMalloc5(m, &a[0], m, &a[1], m, &a[2], m, &a[3], m, &a[4]));
    Columns(1, 0, m, m, part->bond, net->kn, a[0]);
    Columns(1, 0, m, m, part->bond, net->ks, a[1]);
    Columns(1, 0, m, m, part->bond, net->area, a[2]);
    Columns(1, 0, m, m, part->bond, net->part, a[3]);
    Columns(1, 0, m, m, part->bond, net->length, a[4]);
    PetscCall(PetscFree5(net->kn, net->ks, net->area, net->part, net->length));
    net->kn   = a[0];
    net->ks   = a[1];
    net->area = a[2];
    net->part = a[3];
    net->length = a[4];
  }
  if (net->hist) {
    PetscReal *hist;

    PetscCall(PetscMalloc1(DEM_PAST_ALL * m, &hist));
    Columns(DEM_PAST_ALL, old_bonds, m, m, part->bond, net->hist, hist);
    PetscCall(PetscFree(net->hist));
    net->hist = hist;
  }
  if (net->stress) {
    PetscCall(PetscFree3(net->stress, net->stress_sum, net->slot_stress));
    PetscCall(PetscCalloc3(6 * n, &net->stress, 6 * n, &net->stress_sum, 6 * slots, &net->slot_stress));
    for (PetscInt t = 0; t < model->threads; t++) {
      PetscCall(PetscFree(net->scratch[t]));
      PetscCall(PetscMalloc1(6 * model->blocks.widest, &net->scratch[t]));
    }
  }
  if (net->nu_force) {
    PetscCall(PetscFree3(net->nu_force, net->nu_length, net->block_work));
    PetscCall(PetscCalloc3(m, &net->nu_force, m, &net->nu_length, model->blocks.n_blocks, &net->block_work));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CutSurface(DemModel model, const Part *part)
{
  PetscInt kept = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_surface; k++) {
    const PetscInt p = part->local[model->surface[k]];

    if (p >= 0 && p < part->own) model->surface[kept++] = p;
  }
  model->n_surface = kept;
  PetscCall(PetscRealloc(PetscMax(kept, 1) * sizeof(PetscInt), &model->surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No tool has met a particle yet. */
static PetscErrorCode CutTools(DemModel model)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_tools; k++) {
    DemTool *tool = model->tool[k];

    PetscCall(PetscFree3(tool->contact, tool->n_contacts, tool->room));
    PetscCall(PetscCalloc3(model->blocks.n_blocks, &tool->contact, model->blocks.n_blocks, &tool->n_contacts, model->blocks.n_blocks, &tool->room));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Refuse(DemModel model)
{
  PetscFunctionBegin;
  BaseCheckInput(!model->clumps.n, model->comm, "Clumps run on one rank for now; give them threads instead: cleave run SCENE --threads N");
  BaseCheckInput(model->rain.rate == 0, model->comm, "A rain of grains runs on one rank for now; give it threads instead: cleave run SCENE --threads N");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemSpread_Internal(DemModel model)
{
  PetscMPIInt size, rank;
  PetscInt    unit = model->contacts.on ? DEM_CONTACT_BLOCK : DEM_BLOCK, units, old_bonds = model->bonds.n, *filled;
  PetscReal   dt;
  DemRanks    r;
  Part        part = {0};

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(model->comm, &size));
  if (size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Comm_rank(model->comm, &rank));
  PetscCall(Refuse(model));
  while (model->n / unit > 20000) unit *= 2;
  units = (model->n + unit - 1) / unit;
  /* the particles of a coupled body may be few at first: ranks without any wait until more have woken */
  BaseCheckInput(units >= size || model->weight_mass, model->comm, "%" PetscInt_FMT " particles are %" PetscInt_FMT " pieces of %" PetscInt_FMT ", too few for %d ranks; use %" PetscInt_FMT " at most, or threads", model->n, units, unit, (int)size, units);
  PetscCall(DemModelGetCriticalStep(model, &dt)); /* of the whole body: kept */

  PetscCall(PetscNew(&r));
  r->size = size;
  r->rank = rank;
  r->unit = unit;
  PetscCall(PetscMalloc2(units, &r->unit_owner, units, &r->unit_start));
  PetscCall(DemPartition_Internal(model, unit, r->unit_owner));
  PetscCall(PetscCalloc1(size, &filled));
  for (PetscInt k = 0; k < units; k++) {
    r->unit_start[k] = filled[r->unit_owner[k]];
    filled[r->unit_owner[k]] += PetscMin(unit, model->n - k * unit);
  }
  PetscCall(PetscFree(filled));
  PetscCallMPI(MPI_Type_contiguous(7, MPIU_REAL, &r->motion));
  PetscCallMPI(MPI_Type_commit(&r->motion));
  PetscCallMPI(MPI_Type_contiguous(6, MPIU_REAL, &r->stress));
  PetscCallMPI(MPI_Type_commit(&r->stress));

  model->ranks = r;
  PetscCall(Choose(model, &part));
  PetscCall(Number(model, &part));
  PetscCall(CutCells(model, &part));
  PetscCall(CutWalls(model, &part));
  PetscCall(CutBonds(model, &part));
  PetscCall(CutSurface(model, &part));
  PetscCall(DemReshape_Internal(model, part.n, part.n, part.take));
  model->own = part.own;
  PetscCall(CutBlocks(model, &part));
  PetscCall(CutCracks(model, &part));
  PetscCall(CutRule(model, &part, old_bonds));
  PetscCall(CutTools(model));
  PetscCall(PetscFree2(part.take, part.local));
  PetscCall(PetscFree4(part.bond, part.block, part.first, part.bond_start));
  PetscCall(PetscFree2(part.facet, part.facet_local));
  PetscCall(DemHaloSetUp_Internal(model, model->ranks->ghosts, model->ranks->id + model->own, &model->ranks->halo));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemRanksDestroy_Internal(DemModel model)
{
  DemRanks r = model->ranks;

  PetscFunctionBegin;
  if (!r) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(r->id));
  PetscCall(PetscFree(r->number));
  PetscCall(PetscFree(r->bond));
  PetscCall(PetscFree(r->wall));
  PetscCall(PetscFree(r->facet));
  PetscCall(PetscFree(r->block));
  PetscCall(PetscFree(r->bond_start));
  PetscCall(PetscFree(r->mine));
  PetscCall(PetscFree(r->block_mine));
  PetscCall(PetscFree2(r->unit_owner, r->unit_start));
  PetscCall(DemHaloDestroy_Internal(&r->halo));
  PetscCallMPI(MPI_Type_free(&r->motion));
  PetscCallMPI(MPI_Type_free(&r->stress));
  PetscCall(PetscFree(model->ranks));
  PetscFunctionReturn(PETSC_SUCCESS);
}
