/* dem_setup.c - order, blocks, bonds and boundary facets from the packing and its cells. */
#include "dem_rule.h"

typedef struct {
  uint64_t key;
  PetscInt number;
} Place;

static int ComparePlaces(const void *a, const void *b)
{
  const Place *p = a, *q = b;

  if (p->key != q->key) return p->key < q->key ? -1 : 1;
  return p->number < q->number ? -1 : p->number > q->number;
}

/* Morton order: interleaved bits of the position on a grid of 2^bits cells. */
static uint64_t MortonKey(PetscInt dim, const PetscReal x[3], const PetscReal low[3], PetscReal width)
{
  const int      bits = dim == 3 ? 20 : 30;
  const uint64_t most = ((uint64_t)1 << bits) - 1;
  uint64_t       cell[3], key = 0;

  for (PetscInt d = 0; d < dim; d++) {
    const PetscReal s = (x[d] - low[d]) / width * (PetscReal)most;

    cell[d] = s <= 0 ? 0 : s >= (PetscReal)most ? most : (uint64_t)s;
  }
  for (int b = bits - 1; b >= 0; b--)
    for (PetscInt d = 0; d < dim; d++) key = key << 1 | (cell[d] >> b & 1);
  return key;
}

PetscErrorCode DemSetUpOrder_Internal(DemModel model)
{
  const PetscInt  n = model->n, dim = model->dim;
  const DemCells *cells = &model->cells;
  PetscReal       width = 0;
  Place          *place;

  PetscFunctionBegin;
  for (PetscInt d = 0; d < dim; d++) width = PetscMax(width, model->body.high[d] - model->body.low[d]);
  PetscCall(PetscMalloc1(n, &place));
  for (PetscInt k = 0; k < n; k++) {
    place[k].key    = MortonKey(dim, &model->packing.x[3 * k], model->body.low, width);
    place[k].number = k;
  }
  qsort(place, n, sizeof(*place), ComparePlaces);

  PetscCall(PetscMalloc2(n, &model->rank_of, n, &model->at));
  PetscCall(PetscCalloc2(3 * n, &model->x0, n, &model->r));
  PetscCall(PetscCalloc3(3 * n, &model->u, 3 * n, &model->v, 3 * n, &model->f));
  PetscCall(PetscCalloc3(4 * n, &model->rot, 3 * n, &model->spin, 3 * n, &model->torque));
  PetscCall(PetscCalloc6(n, &model->mass, n, &model->inertia, n, &model->volume, n, &model->vstar, n, &model->sum, n, &model->dilation));
  PetscCall(PetscCalloc1(3 * n, &model->offset));
  for (PetscInt p = 0; p < n; p++) {
    const PetscInt  k = place[p].number;
    /* A bonded particle weighs its cell, so the body weighs right; a loose one is its sphere (2D: its disc). */
    const PetscReal r = model->packing.r[k], V = model->bonded ? cells->volume[k] : dim == 3 ? 4.0 / 3 * PETSC_PI * r * r * r : PETSC_PI * r * r * model->body.thickness;

    const DemMaterial *m = model->grain_of ? &model->grain_kind[model->grain_of[k]] : &model->material;
    const PetscReal   *v = model->grain_velocity ? &model->grain_velocity[3 * model->grain_of[k]] : model->initial_velocity;

    model->at[p]      = k;
    model->rank_of[k] = p;
    model->r[p]       = model->packing.r[k];
    for (PetscInt d = 0; d < dim; d++) {
      model->x0[d * n + p]     = model->packing.x[3 * k + d];
      model->v[d * n + p]      = v[d];
      if (model->begin) model->u[d * n + p] = model->begin[3 * k + d];
      if (model->bonded) model->offset[d * n + p] = cells->centroid[3 * k + d] - model->packing.x[3 * k + d];
    }
    model->volume[p] = model->vstar[p] = V;
    model->mass[p]   = m->density * V * (model->weight_mass ? model->weight_mass[k] : 1);
    /* A sphere (2D: disc) of the cell's volume: isotropic, so angular momentum is exact. */
    if (dim == 3) model->inertia[p] = 0.4 * model->mass[p] * PetscPowReal(0.75 * V / PETSC_PI, 2.0 / 3.0);
    else model->inertia[p] = 0.5 * model->mass[p] * V / (model->body.thickness * PETSC_PI);
    if (dim == 3) model->rot[p] = 1;
  }
  if (model->weight_volume) {
    PetscCall(PetscMalloc1(n, &model->share));
    for (PetscInt p = 0; p < n; p++) model->share[p] = model->weight_volume[model->at[p]];
  }
  PetscCall(PetscFree(place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int ComparePairs(const void *a, const void *b)
{
  const DemPair *s = a, *t = b;

  if (s->p != t->p) return s->p < t->p ? -1 : 1;
  return s->q < t->q ? -1 : s->q > t->q;
}

/* Halo of each block: particles of other blocks that its bonds reach, ascending; and each particle's slots, ascending. On one rank only a bond's
   second end can be of another, later block; blocks of other ranks have no particles of their own here. */
PetscErrorCode DemSetUpHalo_Internal(DemModel model)
{
  const PetscInt n = model->n;
  DemBonds      *bonds = &model->bonds;
  DemBlocks     *b = &model->blocks;
  PetscInt      *local, slots = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &local));
  for (PetscInt p = 0; p < n; p++) local[p] = -1;
  for (PetscInt pass = 0; pass < 2; pass++) { /* count, then fill */
    slots = 0;
    for (PetscInt k = 0; k < b->n_blocks; k++) {
      const PetscInt begin = b->first[k], end = b->first[k + 1], own = end - begin;
      PetscInt       found = 0;

      for (PetscInt e = b->bond[k]; e < b->bond[k + 1]; e++)
        for (PetscInt side = 0; side < 2; side++) {
          const PetscInt q = side ? bonds->q[e] : bonds->p[e];

          if ((q >= begin && q < end) || local[q] >= 0) continue;
          local[q] = 0;
          if (pass) b->halo[slots + found] = q;
          found++;
        }
      if (pass) {
        PetscCall(PetscSortInt(found, b->halo + slots));
        for (PetscInt s = 0; s < found; s++) local[b->halo[slots + s]] = own + s;
        for (PetscInt e = b->bond[k]; e < b->bond[k + 1]; e++) {
          const PetscInt p = bonds->p[e], q = bonds->q[e];

          bonds->ip[e] = (int)(p >= begin && p < end ? p - begin : local[p]);
          bonds->iq[e] = (int)(q >= begin && q < end ? q - begin : local[q]);
        }
        for (PetscInt s = 0; s < found; s++) b->slot_start[b->halo[slots + s] + 1]++;
      }
      for (PetscInt e = b->bond[k]; e < b->bond[k + 1]; e++) local[bonds->p[e]] = local[bonds->q[e]] = -1;
      slots += found;
      b->halo_start[k + 1] = slots;
      b->widest            = PetscMax(b->widest, own + found);
    }
    if (!pass) {
      PetscCall(PetscMalloc3(slots, &b->halo, n + 1, &b->slot_start, slots, &b->slot));
      PetscCall(PetscArrayzero(b->slot_start, n + 1));
    }
  }
  for (PetscInt p = 0; p < n; p++) b->slot_start[p + 1] += b->slot_start[p];
  for (PetscInt p = 0; p < n; p++) local[p] = b->slot_start[p];
  for (PetscInt s = 0; s < slots; s++) b->slot[local[b->halo[s]]++] = s;
  PetscCall(PetscCalloc2(slots, &b->slot_s, DEM_FORCE_ALL * slots, &b->slot_f));
  PetscCall(PetscFree(local));
  b->widest = (b->widest + 7) / 8 * 8;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for a block's copy on every thread, and for the blocks' sums. */
PetscErrorCode DemSetUpScratch_Internal(DemModel model)
{
  const PetscInt line = 64 / sizeof(PetscReal), room = (DEM_COPY_ALL * model->blocks.widest + line) / line * line; /* whole cache lines: a force record is one */

  PetscFunctionBegin;
  PetscCall(PetscFree(model->block_sum));
  PetscCall(PetscFree(model->scratch));
  PetscCall(PetscFree(model->scratch_room));
  PetscCall(PetscCalloc1(model->blocks.n_blocks, &model->block_sum));
  PetscCall(PetscCalloc1(model->threads, &model->scratch));
  PetscCall(PetscCalloc1(model->threads * room + line, &model->scratch_room));
  for (PetscInt t = 0; t < model->threads; t++) model->scratch[t] = (PetscReal *)(((uintptr_t)model->scratch_room + 63) / 64 * 64) + t * room;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemSetUpBonds_Internal(DemModel model)
{
  const PetscInt  n = model->n, dim = model->dim;
  const DemCells *cells = &model->cells;
  PetscInt        m = model->bonded ? cells->n_facets : 0;
  DemBonds       *bonds = &model->bonds;
  DemBlocks      *b = &model->blocks;
  DemPair        *pair;

  PetscFunctionBegin;
  if (model->net) PetscCall(DemRulePairs_Internal(model, &m, &pair));
  else PetscCall(PetscMalloc1(m, &pair));
  for (PetscInt k = 0; k < m && !model->net; k++) {
    const PetscInt p = model->rank_of[cells->p[k]], q = model->rank_of[cells->q[k]];

    pair[k].p     = PetscMin(p, q);
    pair[k].q     = PetscMax(p, q);
    pair[k].facet = k;
  }
  if (m > 1 && !model->net) qsort(pair, m, sizeof(*pair), ComparePairs);

  bonds->n = m;
  PetscCall(PetscMalloc7(m, &bonds->p, m, &bonds->q, m, &bonds->ip, m, &bonds->iq, m, &bonds->k, 3 * m, &bonds->arm, m, &bonds->facet));
  for (PetscInt e = 0; e < m; e++) {
    const PetscInt p = pair[e].p, q = pair[e].q, k = pair[e].facet;
    PetscReal      d = 0;

    for (PetscInt c = 0; c < dim; c++) d += PetscSqr(model->x0[c * n + q] - model->x0[c * n + p]);
    bonds->p[e]     = p;
    bonds->q[e]     = q;
    bonds->facet[e] = k;
    if (model->net) continue; /* area and arm are the rule's */
    bonds->k[e]     = cells->area[k] / PetscSqrtReal(d);
    for (PetscInt c = 0; c < 3; c++) bonds->arm[c * m + e] = c < dim ? cells->at[3 * k + c] - model->x0[c * n + p] : 0;
  }
  bonds->now = bonds->k;
  PetscCall(PetscFree(pair));
  if (model->weight_facet) {
    PetscCall(PetscMalloc1(m, &bonds->weight));
    for (PetscInt e = 0; e < m; e++) bonds->weight[e] = model->weight_facet[bonds->facet[e]];
  }

  b->n_blocks = (n + DEM_BLOCK - 1) / DEM_BLOCK;
  PetscCall(PetscMalloc3(b->n_blocks + 1, &b->first, b->n_blocks + 1, &b->bond, b->n_blocks + 1, &b->halo_start));
  b->first[0] = b->bond[0] = b->halo_start[0] = 0;
  for (PetscInt k = 0, e = 0; k < b->n_blocks; k++) {
    b->first[k + 1] = PetscMin(n, (k + 1) * DEM_BLOCK);
    while (e < m && bonds->p[e] < b->first[k + 1]) e++;
    b->bond[k + 1] = e;
  }
  PetscCall(DemSetUpHalo_Internal(model));

  PetscCall(DemSetUpScratch_Internal(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How a face holds its facets; refuses what the rule has no exact form for. */
static PetscErrorCode FaceKind(DemModel model, PetscInt k, const PetscReal normal[3], DemWallKind *kind)
{
  const DemFace *face = &model->face[k];
  PetscInt       fixed = 0, along = -1;

  PetscFunctionBegin;
  *kind = face->rim ? DEM_WALL_RIM : face->loaded || face->pressed ? DEM_WALL_TRACTION : DEM_WALL_FREE;
  for (PetscInt d = 0; d < model->dim; d++)
    if (face->fixed[d]) {
      fixed++;
      along = d;
    }
  if (!fixed) PetscFunctionReturn(PETSC_SUCCESS);
  BaseCheckInput(*kind == DEM_WALL_FREE, model->comm, "Face '%s' of the particle body is held and loaded at once; choose one", model->body.face_name[k]);
  if (fixed == model->dim) {
    *kind = DEM_WALL_GLUED;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  BaseCheckInput(fixed == 1 && PetscAbsReal(PetscAbsReal(normal[along]) - 1) < 1e-9, model->comm,
                 "Face '%s' of the particle body can be held along its own normal (a smooth platen) or in all directions (glued); its normal is (%.3g, %.3g, %.3g)", model->body.face_name[k],
                 (double)normal[0], (double)normal[1], (double)normal[2]);
  *kind = DEM_WALL_SMOOTH;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetUpSurface(DemModel model)
{
  const DemCells *cells = &model->cells;
  PetscBool      *outer;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(model->n, &outer));
  for (PetscInt k = 0; k < cells->n_walls; k++) outer[model->rank_of[cells->wall_p[k]]] = PETSC_TRUE;
  for (PetscInt p = 0; p < model->n; p++) model->n_surface += !model->bonded || outer[p];
  PetscCall(PetscMalloc1(model->n_surface, &model->surface));
  for (PetscInt p = 0, k = 0; p < model->n; p++)
    if (!model->bonded || outer[p]) model->surface[k++] = p;
  PetscCall(PetscFree(outer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The papers' load: each particle's pressed facets of a face share the area pi r^2 (2D: 2 r t), at its centre.  Eq. (4.48) */
static PetscErrorCode SpherePressure(DemModel model)
{
  DemWalls  *w = &model->walls;
  PetscReal *whole;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(w->n, &whole));
  for (PetscInt i = 0; i < w->n; i++) {
    whole[i] = 0;
    for (PetscInt k = w->start[w->owner[i]]; k < w->start[w->owner[i] + 1]; k++)
      if (w->face[k] == w->face[i]) whole[i] += w->area[k];
  }
  for (PetscInt i = 0; i < w->n; i++) {
    const PetscReal r = model->r[w->owner[i]];

    if (!model->face[w->face[i]].pressed) continue;
    w->area[i] *= (model->dim == 3 ? PETSC_PI * r * r : 2 * r * model->body.thickness) / whole[i];
    for (PetscInt d = 0; d < 3; d++) w->arm[3 * i + d] = 0;
  }
  PetscCall(PetscFree(whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemSetUpWalls_Internal(DemModel model)
{
  const PetscInt  n = model->n;
  const DemCells *cells = &model->cells;
  DemWalls       *w = &model->walls;
  PetscInt       *fill, m = 0;
  unsigned char  *kind;

  PetscFunctionBegin;
  PetscCall(SetUpSurface(model));
  if (!model->bonded) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(cells->n_walls, &kind, n + 1, &fill));
  PetscCall(PetscArrayzero(fill, n + 1));
  for (PetscInt k = 0; k < cells->n_walls; k++) {
    const PetscInt   p = model->rank_of[cells->wall_p[k]];
    const PetscReal *normal = &cells->wall_normal[3 * k];
    DemWallKind      what;
    PetscReal        h = 0;

    PetscCall(FaceKind(model, cells->wall_face[k], normal, &what));
    kind[k] = (unsigned char)what;
    for (PetscInt d = 0; d < 3; d++) h += normal[d] * (cells->wall_at[3 * k + d] - model->packing.x[3 * cells->wall_p[k] + d]);
    /* At a re-entrant corner a free facet may face away from its particle: h < 0 is then right in the sum of (4.4). A held one needs its distance. */
    if (what == DEM_WALL_SMOOTH || what == DEM_WALL_GLUED)
      BaseCheckInput(h > 0, model->comm, "Particle %" PetscInt_FMT " lies on or outside face '%s'; its centre must be inside the body", cells->wall_p[k], model->body.face_name[cells->wall_face[k]]);
    if (what == DEM_WALL_FREE || what == DEM_WALL_TRACTION) model->vstar[p] += 0.5 * model->lambda / model->g_shear * cells->wall_area[k] * h; /* condensed.  Eq. (4.4) */
    if (what != DEM_WALL_FREE) {
      fill[p + 1]++;
      m++;
    }
  }
  for (PetscInt p = 0; p < n; p++) fill[p + 1] += fill[p];
  w->n = m;
  PetscCall(PetscMalloc7(n + 1, &w->start, m, &w->face, m, &w->kind, m, &w->area, m, &w->h, 3 * m, &w->arm, 3 * m, &w->normal));
  PetscCall(PetscMalloc1(m, &w->owner));
  PetscCall(PetscCalloc1(DEM_TRACTION * m, &model->traction_old)); /* apart: the step swaps them */
  PetscCall(PetscCalloc1(DEM_TRACTION * m, &model->traction_new));
  PetscCall(PetscArraycpy(w->start, fill, n + 1));
  for (PetscInt k = 0; k < cells->n_walls; k++) {
    const PetscInt p = model->rank_of[cells->wall_p[k]];
    PetscInt       i;

    if (kind[k] == DEM_WALL_FREE) continue;
    i          = fill[p]++;
    w->owner[i] = p;
    w->face[i] = cells->wall_face[k];
    w->kind[i] = kind[k];
    w->area[i] = cells->wall_area[k];
    w->h[i]    = 0;
    for (PetscInt d = 0; d < 3; d++) {
      w->arm[3 * i + d]    = cells->wall_at[3 * k + d] - model->packing.x[3 * cells->wall_p[k] + d];
      w->normal[3 * i + d] = cells->wall_normal[3 * k + d];
      w->h[i] += w->arm[3 * i + d] * w->normal[3 * i + d];
    }
    if (model->dim == 2) w->arm[3 * i + 2] = 0;
  }
  PetscCall(PetscMalloc4(m, &w->rim, 3 * m, &w->rim_x, 3 * m, &w->rim_u, 3 * m, &w->rim_f));
  for (PetscInt i = 0; i < m; i++) {
    w->rim[i] = w->kind[i] == DEM_WALL_RIM ? w->n_rim++ : -1;
    if (w->rim[i] < 0) continue;
    for (PetscInt d = 0; d < 3; d++) {
      w->rim_x[3 * w->rim[i] + d] = (d < model->dim ? model->x0[d * n + w->owner[i]] : 0) + w->arm[3 * i + d];
      w->rim_u[3 * w->rim[i] + d] = w->rim_f[3 * w->rim[i] + d] = 0;
    }
  }
  PetscCall(PetscFree2(kind, fill));
  if (model->rule.sphere_pressure) PetscCall(SpherePressure(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
