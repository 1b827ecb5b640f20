/*
  dem_ranks_cut.c - the arrays of a model keep what a rank's part has of them.

  Cut twice alike: out of the whole body at the end of set-up, and out of what all ranks hold when it is shared out anew. Wherever a
  particle is named it is by its number on one rank until its array has been cut, then by its number here.
*/
#include "dem_rule.h"
#include "dem_tool_impl.h"

static void Here(const DemPart *part, PetscInt n, PetscInt *p)
{
  for (PetscInt k = 0; k < n; k++) p[k] = part->local[p[k]];
}

/* Particles' arrays, columns of part->n. */
static PetscErrorCode CutParticles(DemModel model, const DemPart *part)
{
  const PetscInt  n = model->n, stride = part->n;
  const DemCarry *c = &part->of_particles;
  PetscReal      *a[6];

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(3 * stride, &a[0], stride, &a[1]));
  PetscCall(DemCarryColumns_Internal(c, 3, n, stride, model->x0, a[0]));
  PetscCall(DemCarryColumns_Internal(c, 1, n, stride, model->r, a[1]));
  PetscCall(PetscFree2(model->x0, model->r));
  model->x0 = a[0];
  model->r = a[1];

  PetscCall(PetscCalloc3(3 * stride, &a[0], 3 * stride, &a[1], 3 * stride, &a[2]));
  PetscCall(DemCarryColumns_Internal(c, 3, n, stride, model->u, a[0]));
  PetscCall(DemCarryColumns_Internal(c, 3, n, stride, model->v, a[1]));
  PetscCall(DemCarryColumns_Internal(c, 3, n, stride, model->f, a[2]));
  PetscCall(PetscFree3(model->u, model->v, model->f));
  model->u = a[0];
  model->v = a[1];
  model->f = a[2];

  PetscCall(PetscCalloc3(4 * stride, &a[0], 3 * stride, &a[1], 3 * stride, &a[2]));
  PetscCall(DemCarryColumns_Internal(c, 4, n, stride, model->rot, a[0]));
  PetscCall(DemCarryColumns_Internal(c, 3, n, stride, model->spin, a[1]));
  PetscCall(DemCarryColumns_Internal(c, 3, n, stride, model->torque, a[2]));
  PetscCall(PetscFree3(model->rot, model->spin, model->torque));
  model->rot = a[0];
  model->spin = a[1];
  model->torque = a[2];

  PetscCall(PetscCalloc6(stride, &a[0], stride, &a[1], stride, &a[2], stride, &a[3], stride, &a[4], stride, &a[5]));
  PetscCall(DemCarryColumns_Internal(c, 1, n, stride, model->mass, a[0]));
  PetscCall(DemCarryColumns_Internal(c, 1, n, stride, model->inertia, a[1]));
  PetscCall(DemCarryColumns_Internal(c, 1, n, stride, model->volume, a[2]));
  PetscCall(DemCarryColumns_Internal(c, 1, n, stride, model->vstar, a[3]));
  PetscCall(DemCarryColumns_Internal(c, 1, n, stride, model->sum, a[4]));
  PetscCall(DemCarryColumns_Internal(c, 1, n, stride, model->dilation, a[5]));
  PetscCall(PetscFree6(model->mass, model->inertia, model->volume, model->vstar, model->sum, model->dilation));
  model->mass = a[0];
  model->inertia = a[1];
  model->volume = a[2];
  model->vstar = a[3];
  model->sum = a[4];
  model->dilation = a[5];

  PetscCall(PetscCalloc1(3 * stride, &a[0]));
  PetscCall(DemCarryColumns_Internal(c, 3, n, stride, model->offset, a[0]));
  PetscCall(PetscFree(model->offset));
  model->offset = a[0];
  PetscCall(DemCarryRows_Internal(c, sizeof(PetscReal), &model->share));
  PetscCall(DemCarryRows_Internal(c, 1, &model->tool_share));
  PetscCall(DemCarryRows_Internal(c, 1, &model->contacts.kind));
  if (model->f_ext) { /* lent: zero until given anew */
    PetscCall(PetscFree2(model->f_ext, model->t_ext));
    PetscCall(PetscCalloc2(3 * stride, &model->f_ext, 3 * stride, &model->t_ext));
  }
  PetscCall(PetscFree(model->probed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Particles that can meet the outside, and are the rank's own. */
static PetscErrorCode CutSurface(DemModel model, const DemPart *part)
{
  unsigned char *outer;
  PetscInt       kept = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(model->n + 1, &outer));
  for (PetscInt k = 0; k < model->n_surface; k++) outer[model->surface[k]] = 1;
  PetscCall(DemCarryRows_Internal(&part->of_particles, 1, &outer));
  PetscCall(PetscFree(model->surface));
  PetscCall(PetscMalloc1(part->own + 1, &model->surface));
  for (PetscInt p = 0; p < part->own; p++)
    if (outer[p]) model->surface[kept++] = p;
  model->n_surface = kept;
  PetscCall(PetscRealloc(PetscMax(kept, 1) * sizeof(PetscInt), &model->surface));
  PetscCall(PetscFree(outer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The packing here is the model's own order. */
static PetscErrorCode CutPacking(DemModel model, const DemPart *part)
{
  const DemCarry *c = &part->of_packing;

  PetscFunctionBegin;
  if (model->cells.n) {
    PetscCall(DemCarryRows_Internal(c, sizeof(PetscReal), &model->cells.volume));
    PetscCall(DemCarryRows_Internal(c, 3 * sizeof(PetscReal), &model->cells.centroid));
    model->cells.n = part->n;
  }
  PetscCall(DemCarryRows_Internal(c, 3 * sizeof(PetscReal), &model->packing.x));
  PetscCall(DemCarryRows_Internal(c, sizeof(PetscReal), &model->packing.r));
  model->packing.n = part->n;
  PetscCall(PetscFree(model->group));
  PetscCall(PetscFree(model->breakable));
  PetscCall(DemCarryRows_Internal(c, 3 * sizeof(PetscReal), &model->begin));
  PetscCall(DemCarryRows_Internal(c, sizeof(PetscInt), &model->grain_of));
  PetscCall(DemCarryRows_Internal(c, sizeof(PetscReal), &model->weight_mass));
  PetscCall(DemCarryRows_Internal(c, sizeof(PetscReal), &model->weight_volume));
  for (PetscInt k = 0; k < model->n_history; k++) { /* probes are the owner's */
    DemHistory *h = &model->history[k];

    if (h->quantity[0] != 'p') continue;
    if (part->of_particles.sf) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &h->particle, 1, MPIU_INT, MPI_MAX, model->comm));
    if (h->particle < 0) continue;
    h->particle = part->local[h->particle];
    if (h->particle < 0 || h->particle >= part->own) h->particle = -2;
  }
  PetscCall(PetscFree2(model->rank_of, model->at)); /* from here on the packing is what is here, in the same order */
  PetscCall(PetscMalloc2(part->n, &model->rank_of, part->n, &model->at));
  for (PetscInt p = 0; p < part->n; p++) model->rank_of[p] = model->at[p] = p;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Corners of the facets: each sends as many as the most have. */
static PetscErrorCode CutCorners(DemModel model, const DemPart *part)
{
  DemCells *c = &model->cells;
  PetscInt *start, *count, most = 0;
  PetscBool there = (PetscBool)(c->facet_start != NULL);
  float    *corner, *wide;

  PetscFunctionBegin;
  if (part->of_facets.sf) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &there, 1, MPIU_BOOL, MPI_LOR, model->comm));
  if (!there) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(c->n_facets, &count));
  for (PetscInt f = 0; f < c->n_facets; f++) {
    count[f] = c->facet_start[f + 1] - c->facet_start[f];
    most = PetscMax(most, count[f]);
  }
  if (!part->of_facets.sf) { /* all here: no need of rows of one width */
    const PetscInt *facet = part->facet;

    PetscCall(PetscMalloc1(part->facets + 1, &start));
    start[0] = 0;
    for (PetscInt f = 0; f < part->facets; f++) start[f + 1] = start[f] + count[facet[f]];
    PetscCall(PetscMalloc1(3 * start[part->facets], &corner));
    for (PetscInt f = 0; f < part->facets; f++) PetscCall(PetscArraycpy(corner + 3 * start[f], c->corner + 3 * c->facet_start[facet[f]], 3 * count[facet[f]]));
  } else {
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_INT, MPI_MAX, model->comm));
    PetscCall(PetscCalloc1(3 * most * c->n_facets, &wide));
    for (PetscInt f = 0; f < c->n_facets; f++) PetscCall(PetscArraycpy(wide + 3 * most * f, c->corner + 3 * c->facet_start[f], 3 * count[f]));
    if (most) PetscCall(DemCarryRows_Internal(&part->of_facets, 3 * (size_t)most * sizeof(float), &wide));
    PetscCall(DemCarryRows_Internal(&part->of_facets, sizeof(PetscInt), &count));
    PetscCall(PetscMalloc1(part->facets + 1, &start));
    start[0] = 0;
    for (PetscInt f = 0; f < part->facets; f++) start[f + 1] = start[f] + count[f];
    PetscCall(PetscMalloc1(3 * start[part->facets], &corner));
    for (PetscInt f = 0; f < part->facets; f++) PetscCall(PetscArraycpy(corner + 3 * start[f], wide + 3 * most * f, 3 * count[f]));
    PetscCall(PetscFree(wide));
  }
  PetscCall(PetscFree(count));
  PetscCall(PetscFree(c->facet_start));
  PetscCall(PetscFree(c->corner));
  c->facet_start = start;
  c->corner = corner;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CutCells(DemModel model, const DemPart *part)
{
  const DemCarry *f = &part->of_facets, *w = &part->of_cell_walls;
  DemCells       *c = &model->cells;

  PetscFunctionBegin;
  PetscCall(CutCorners(model, part));
  PetscCall(DemCarryRows_Internal(f, sizeof(PetscInt), &c->p));
  PetscCall(DemCarryRows_Internal(f, sizeof(PetscInt), &c->q));
  PetscCall(DemCarryRows_Internal(f, sizeof(PetscReal), &c->area));
  PetscCall(DemCarryRows_Internal(f, 3 * sizeof(PetscReal), &c->at));
  PetscCall(DemCarryRows_Internal(f, sizeof(PetscReal), &model->weak));
  PetscCall(DemCarryRows_Internal(f, sizeof(PetscReal), &model->weight_facet));
  c->n_facets = part->facets;
  Here(part, c->n_facets, c->p);
  Here(part, c->n_facets, c->q);
  PetscCall(DemCarryRows_Internal(w, sizeof(PetscInt), &c->wall_p));
  PetscCall(DemCarryRows_Internal(w, sizeof(PetscInt), &c->wall_face));
  PetscCall(DemCarryRows_Internal(w, sizeof(PetscReal), &c->wall_area));
  PetscCall(DemCarryRows_Internal(w, 3 * sizeof(PetscReal), &c->wall_at));
  PetscCall(DemCarryRows_Internal(w, 3 * sizeof(PetscReal), &c->wall_normal));
  c->n_walls = part->cell_walls;
  Here(part, c->n_walls, c->wall_p);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Loaded and held facets; tractions begin at zero, or come with the state. */
static PetscErrorCode CutWalls(DemModel model, const DemPart *part)
{
  DemWalls       *w = &model->walls, old = *w;
  const DemCarry *c = &part->of_walls;
  const PetscInt  m = part->walls;
  PetscInt       *rim, rims = 0;
  PetscReal      *at;

  PetscFunctionBegin;
  if (!old.start) PetscFunctionReturn(PETSC_SUCCESS); /* loose grains have none */
  PetscCall(PetscMalloc2(old.n, &rim, 3 * old.n, &at));
  for (PetscInt i = 0; i < old.n; i++) {
    rim[i] = old.rim[i] < 0 || !old.rim_number ? old.rim[i] : old.rim_number[old.rim[i]];
    for (PetscInt d = 0; d < 3; d++) at[3 * i + d] = rim[i] < 0 ? 0 : old.rim_x[3 * old.rim[i] + d];
  }
  PetscCall(PetscMalloc7(part->n + 1, &w->start, m, &w->face, m, &w->kind, m, &w->area, m, &w->h, 3 * m, &w->arm, 3 * m, &w->normal));
  PetscCall(PetscMalloc1(m, &w->owner));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscInt), old.face, w->face));
  PetscCall(DemCarryInto_Internal(c, 1, old.kind, w->kind));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscReal), old.area, w->area));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscReal), old.h, w->h));
  PetscCall(DemCarryInto_Internal(c, 3 * sizeof(PetscReal), old.arm, w->arm));
  PetscCall(DemCarryInto_Internal(c, 3 * sizeof(PetscReal), old.normal, w->normal));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscInt), old.owner, w->owner));
  Here(part, m, w->owner);
  for (PetscInt p = 0, i = 0; p <= part->n; p++) { /* sorted by particle, as these are */
    while (i < m && w->owner[i] < p) i++;
    w->start[p] = i;
  }
  {
    PetscInt  *number;
    PetscReal *place;

    PetscCall(PetscMalloc2(m, &number, 3 * m, &place));
    PetscCall(DemCarryInto_Internal(c, sizeof(PetscInt), rim, number));
    PetscCall(DemCarryInto_Internal(c, 3 * sizeof(PetscReal), at, place));
    for (PetscInt i = 0; i < m; i++) rims += number[i] >= 0;
    PetscCall(PetscCalloc4(m, &w->rim, 3 * rims, &w->rim_x, 3 * rims, &w->rim_u, 3 * rims, &w->rim_f));
    PetscCall(PetscMalloc1(rims, &w->rim_number));
    w->n_rim = 0;
    for (PetscInt i = 0; i < m; i++) {
      w->rim[i] = number[i] < 0 ? -1 : w->n_rim;
      if (number[i] < 0) continue;
      for (PetscInt d = 0; d < 3; d++) w->rim_x[3 * w->n_rim + d] = place[3 * i + d];
      w->rim_number[w->n_rim++] = number[i];
    }
    PetscCall(PetscFree2(number, place));
  }
  w->n = m;
  PetscCall(PetscFree2(rim, at));
  PetscCall(PetscFree7(old.start, old.face, old.kind, old.area, old.h, old.arm, old.normal));
  PetscCall(PetscFree(old.owner));
  PetscCall(PetscFree4(old.rim, old.rim_x, old.rim_u, old.rim_f));
  PetscCall(PetscFree(old.rim_number));
  PetscCall(PetscFree(model->traction_old));
  PetscCall(PetscFree(model->traction_new));
  PetscCall(PetscCalloc1(DEM_TRACTION * m, &model->traction_old));
  PetscCall(PetscCalloc1(DEM_TRACTION * m, &model->traction_new));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CutBonds(DemModel model, const DemPart *part)
{
  DemBonds       *b = &model->bonds, old = *b;
  const DemCarry *c = &part->of_bonds;
  const PetscInt  m = part->bonds;

  PetscFunctionBegin;
  b->n = m;
  PetscCall(PetscMalloc7(m, &b->p, m, &b->q, m, &b->ip, m, &b->iq, m, &b->k, 3 * m, &b->arm, m, &b->facet));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscInt), old.p, b->p));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscInt), old.q, b->q));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscReal), old.k, b->k));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscInt), old.facet, b->facet));
  PetscCall(DemCarryColumns_Internal(c, 3, old.n, m, old.arm, b->arm));
  Here(part, m, b->p);
  Here(part, m, b->q);
  for (PetscInt e = 0; e < m; e++) b->facet[e] = b->facet[e] >= 0 ? part->facet_local[b->facet[e]] : -1;
  if (old.now == old.k) b->now = b->k;
  PetscCall(DemCarryRows_Internal(c, sizeof(PetscReal), &b->weight));
  PetscCall(PetscFree7(old.p, old.q, old.ip, old.iq, old.k, old.arm, old.facet));
  PetscCall(DemBondListDestroy_Internal(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CutBlocks(DemModel model, const DemPart *part)
{
  DemBlocks *b = &model->blocks;

  PetscFunctionBegin;
  PetscCall(PetscFree3(b->first, b->bond, b->halo_start));
  PetscCall(PetscFree3(b->halo, b->slot_start, b->slot));
  PetscCall(PetscFree2(b->slot_s, b->slot_f));
  b->n_blocks = part->blocks;
  b->widest = 0;
  PetscCall(PetscMalloc3(b->n_blocks + 1, &b->first, b->n_blocks + 1, &b->bond, b->n_blocks + 1, &b->halo_start));
  PetscCall(PetscArraycpy(b->first, part->first, b->n_blocks + 1));
  PetscCall(PetscArraycpy(b->bond, part->bond_start, b->n_blocks + 1));
  b->halo_start[0] = 0;
  PetscCall(DemSetUpHalo_Internal(model));
  PetscCall(DemSetUpScratch_Internal(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What bonds were born with; the rest of a state that goes on comes with it. A rank without bonds has a damage too: it says that bonds can break. */
static PetscErrorCode CutCracks(DemModel model, const DemPart *part)
{
  DemCrackState  *c = &model->crack, old = *c;
  const DemCarry *carry = &part->of_bonds;
  const PetscInt  m = part->bonds, blocks = part->blocks, n = part->n, slots = model->blocks.halo_start[blocks];
  PetscReal      *now = model->bonds.now;

  PetscFunctionBegin;
  if (!old.damage) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc7(m + 1, &c->damage, 3 * m, &c->e, 3 * m, &c->slip, m, &c->work, m, &c->rub, m, &c->time, m, &c->release));
  PetscCall(PetscCalloc6(m + 1, &c->state, blocks + 1, &c->awake, 6 * n, &c->stress, 6 * slots, &c->slot_stress, slots, &c->slot_v, n, &c->volume));
  PetscCall(PetscCalloc3(m, &model->bonds.now, m, &c->live, blocks, &c->n_live));
  PetscCall(DemCarryInto_Internal(carry, sizeof(PetscReal), old.damage, c->damage));
  PetscCall(DemCarryInto_Internal(carry, 1, old.state, c->state));
  PetscCall(DemCarryInto_Internal(carry, sizeof(PetscReal), now, model->bonds.now));
  if (old.limit) PetscCall(PetscCalloc1(m + 1, &c->limit));
  PetscCall(PetscFree7(old.damage, old.e, old.slip, old.work, old.rub, old.time, old.release));
  PetscCall(PetscFree6(old.state, old.awake, old.stress, old.slot_stress, old.slot_v, old.volume));
  PetscCall(PetscFree3(now, old.live, old.n_live));
  PetscCall(PetscFree(old.limit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CutRule(DemModel model, const DemPart *part, PetscInt old_bonds)
{
  const DemCarry *c = &part->of_bonds;
  DemNetwork      net = model->net;
  const PetscInt  m = part->bonds, n = part->n, slots = model->blocks.halo_start[model->blocks.n_blocks];
  PetscReal      *a[5];

  PetscFunctionBegin;
  if (!net) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc5(m, &a[0], m, &a[1], m, &a[2], m, &a[3], m, &a[4]));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscReal), net->kn, a[0]));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscReal), net->ks, a[1]));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscReal), net->area, a[2]));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscReal), net->part, a[3]));
  PetscCall(DemCarryInto_Internal(c, sizeof(PetscReal), net->length, a[4]));
  PetscCall(PetscFree5(net->kn, net->ks, net->area, net->part, net->length));
  net->kn = a[0];
  net->ks = a[1];
  net->area = a[2];
  net->part = a[3];
  net->length = a[4];
  if (model->crack.damage) { /* all ranks agree; without bonds there is no history to point at */
    PetscReal *hist;

    PetscCall(PetscMalloc1(DEM_PAST_ALL * m + 1, &hist));
    PetscCall(DemCarryColumns_Internal(c, DEM_PAST_ALL, old_bonds, m, net->hist, hist));
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
  if (model->rule.poisson_term) {
    PetscCall(PetscFree3(net->nu_force, net->nu_length, net->block_work));
    PetscCall(PetscCalloc3(m + 1, &net->nu_force, m, &net->nu_length, model->blocks.n_blocks, &net->block_work));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What tools touch comes with the state. */
static PetscErrorCode CutTools(DemModel model, PetscInt old_blocks)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_tools; k++) {
    DemTool *tool = model->tool[k];

    for (PetscInt b = 0; b < old_blocks; b++) PetscCall(PetscFree(tool->contact[b]));
    PetscCall(PetscFree3(tool->contact, tool->n_contacts, tool->room));
    PetscCall(PetscCalloc3(model->blocks.n_blocks, &tool->contact, model->blocks.n_blocks, &tool->n_contacts, model->blocks.n_blocks, &tool->room));
  }
  if (model->tool_scratch)
    for (PetscInt t = 0; t < model->threads; t++) PetscCall(PetscFree(model->tool_scratch[t]));
  PetscCall(PetscFree(model->tool_scratch)); /* of as many blocks as there were */
  PetscCall(PetscFree(model->tool_total));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Who is who, from now on. */
static PetscErrorCode Number(DemModel model, DemPart *part)
{
  DemRanks r = model->ranks;

  PetscFunctionBegin;
  PetscCall(DemCarryRows_Internal(&part->of_particles, sizeof(PetscInt), &r->number));
  PetscCall(PetscFree(r->id));
  PetscCall(PetscFree(r->bond));
  PetscCall(PetscFree(r->mine));
  PetscCall(PetscFree(r->wall));
  PetscCall(PetscFree(r->facet));
  PetscCall(PetscFree(r->cell_wall));
  PetscCall(PetscFree(r->block));
  PetscCall(PetscFree(r->block_mine));
  PetscCall(PetscMalloc1(part->n, &r->id));
  PetscCall(PetscMalloc1(part->bonds, &r->bond));
  PetscCall(PetscMalloc1(part->bonds, &r->mine));
  PetscCall(PetscMalloc1(part->walls, &r->wall));
  PetscCall(PetscMalloc1(part->facets, &r->facet));
  PetscCall(PetscMalloc1(part->cell_walls, &r->cell_wall));
  PetscCall(PetscMalloc1(part->blocks, &r->block));
  PetscCall(PetscMalloc1(part->blocks, &r->block_mine));
  PetscCall(PetscArraycpy(r->id, part->id, part->n));
  PetscCall(PetscArraycpy(r->bond, part->bond, part->bonds));
  PetscCall(PetscArraycpy(r->wall, part->wall, part->walls));
  PetscCall(PetscArraycpy(r->facet, part->facet, part->facets));
  PetscCall(PetscArraycpy(r->cell_wall, part->cell_wall, part->cell_walls));
  PetscCall(PetscArraycpy(r->block, part->block, part->blocks));
  for (PetscInt e = 0; e < part->bonds; e++) r->mine[e] = model->bonds.p[e] < part->own;
  for (PetscInt b = 0; b < part->blocks; b++) r->block_mine[b] = part->first[b + 1] > part->first[b];
  r->ghosts = part->n - part->own;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemCut_Internal(DemModel model, DemPart *part)
{
  const PetscInt old_bonds = model->bonds.n, old_blocks = model->blocks.n_blocks;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(model->ranks->facets, &part->facet_local));
  for (PetscInt f = 0; f < model->ranks->facets; f++) part->facet_local[f] = -1;
  for (PetscInt f = 0; f < part->facets; f++) part->facet_local[part->facet[f]] = f;
  PetscCall(CutPacking(model, part));
  PetscCall(CutCells(model, part));
  PetscCall(CutWalls(model, part));
  PetscCall(CutBonds(model, part));
  PetscCall(CutSurface(model, part));
  PetscCall(CutParticles(model, part));
  PetscCall(Number(model, part));
  model->n = part->n;
  model->own = part->own;
  PetscCall(CutBlocks(model, part));
  PetscCall(CutCracks(model, part));
  PetscCall(CutRule(model, part, old_bonds));
  PetscCall(CutTools(model, old_blocks));
  PetscCall(DemHaloSetUp_Internal(model, model->ranks->ghosts, model->ranks->id + model->own, &model->ranks->halo));
  PetscFunctionReturn(PETSC_SUCCESS);
}
