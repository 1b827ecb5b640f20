/*
  fem_mesh.c - from the mesh on rank 0 to flat arrays on every rank, through a DMPlex.

  Each named group becomes a label: 1 on its vertices whatever its dimension, 1 on its cells when it is a part of the body,
  and on a cell whose sides belong to it the set of those sides as bits. PETSc partitions (PT-Scotch), adds the overlap and
  moves the labels; the arrays are extracted once and the DMPlex is dropped. The partitioner needs edges and sides
  as points, so they are made on more than one rank; elements take their nodes, in gmsh's order, from rank 0's list.
*/
#include "fem_impl.h"

PetscErrorCode FemGhosts(FemModel model, PetscReal *u)
{
  MPI_Datatype unit;

  PetscFunctionBegin;
  if (model->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Type_contiguous(model->dim, MPIU_REAL, &unit));
  PetscCallMPI(MPI_Type_commit(&unit));
  PetscCall(PetscSFBcastBegin(model->ghosts, unit, u, u, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(model->ghosts, unit, u, u, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemGather(FemModel model, PetscSF home, PetscInt m, const PetscReal *own, PetscReal *all)
{
  MPI_Datatype unit;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Type_contiguous(m, MPIU_REAL, &unit));
  PetscCallMPI(MPI_Type_commit(&unit));
  PetscCall(PetscSFReduceBegin(home, unit, own, all, MPI_REPLACE));
  PetscCall(PetscSFReduceEnd(home, unit, own, all, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemScatter(FemModel model, PetscSF home, PetscInt m, const PetscReal *all, PetscReal *own)
{
  MPI_Datatype unit;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Type_contiguous(m, MPIU_REAL, &unit));
  PetscCallMPI(MPI_Type_commit(&unit));
  PetscCall(PetscSFBcastBegin(home, unit, all, own, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(home, unit, all, own, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells 0..n_cells-1, then vertices; other ranks hold an empty plex. */
static PetscErrorCode BuildPlex(FemModel model, const FemBody *body, DM *plex)
{
  const PetscInt nc = body->n_cells, nn = body->n_nodes;
  DM             dm;

  PetscFunctionBegin;
  PetscCall(DMPlexCreate(model->comm, &dm));
  PetscCall(DMSetDimension(dm, model->dim));
  PetscCall(DMPlexSetChart(dm, 0, nc + nn));
  for (PetscInt c = 0; c < nc; c++) PetscCall(DMPlexSetConeSize(dm, c, body->start[c + 1] - body->start[c]));
  PetscCall(DMSetUp(dm));
  for (PetscInt c = 0; c < nc; c++) {
    PetscInt cone[FEM_MAX_NODES];

    for (PetscInt k = body->start[c]; k < body->start[c + 1]; k++) cone[k - body->start[c]] = nc + body->node[k];
    if (body->start[c + 1] - body->start[c] == 8) { /* a plex hexahedron's first side is seen from outside, gmsh's from inside; else its sides are wrong */
      cone[1] = nc + body->node[body->start[c] + 3];
      cone[3] = nc + body->node[body->start[c] + 1];
    }
    PetscCall(DMPlexSetCone(dm, c, cone));
  }
  PetscCall(DMPlexSymmetrize(dm));
  PetscCall(DMPlexStratify(dm));
  if (model->size > 1) {
    DM whole;

    PetscCall(DMPlexInterpolate(dm, &whole)); /* cells and vertices keep their numbers; sides and edges come after */
    PetscCall(DMDestroy(&dm));
    dm = whole;
  }
  *plex = dm;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LabelName(PetscInt g, size_t size, char name[])
{
  return PetscSNPrintf(name, size, "group %d", (int)g);
}

/* Rank 0: a label per group; counts sides inside the body and sides of nothing. */
static PetscErrorCode LabelGroups(FemModel model, const Mesh *mesh, const FemBody *body, DM dm)
{
  PetscInt *body_cell;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(mesh->n_cells, &body_cell));
  for (PetscInt c = 0; c < mesh->n_cells; c++) body_cell[c] = -1;
  for (PetscInt c = 0; c < body->n_cells; c++) body_cell[body->cell[c]] = c;
  for (PetscInt g = 0; g < mesh->n_groups; g++) {
    const MeshGroup *from = &mesh->group[g];
    char             name[32];
    DMLabel          label;

    PetscCall(LabelName(g, sizeof(name), name));
    PetscCall(DMCreateLabel(dm, name));
    PetscCall(DMGetLabel(dm, name, &label));
    for (PetscInt k = 0; k < from->n_cells; k++) {
      const PetscInt  c = from->cell[k], n = mesh->start[c + 1] - mesh->start[c];
      const PetscInt *node = &mesh->node[mesh->start[c]];
      PetscInt        cell[2], side, found;

      if (from->dim == model->dim) {
        PetscCall(DMLabelSetValue(label, body_cell[c], 1));
        continue;
      }
      for (PetscInt a = 0; a < n; a++)
        if (body->number[node[a]] >= 0) PetscCall(DMLabelSetValue(label, body->n_cells + body->number[node[a]], 1));
      if (from->dim != model->dim - 1) continue;
      found = FemBodyFindSide(mesh, body, n, node, cell, &side);
      if (!found) model->group[g].loose++;
      else {
        PetscInt bits;

        if (found > 1) model->group[g].interior++;
        PetscCall(DMLabelGetValue(label, cell[0], &bits));
        if (bits >= 0) PetscCall(DMLabelClearValue(label, cell[0], bits));
        PetscCall(DMLabelSetValue(label, cell[0], (bits < 0 ? 0 : bits) | (1 << side)));
      }
    }
  }
  PetscCall(PetscFree(body_cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A number for each point of the plex on rank 0, carried to the points after distribution. */
static PetscErrorCode Carry(DM after, PetscSF moved, PetscInt *root, PetscInt *leaf)
{
  PetscInt end;

  PetscFunctionBegin;
  if (moved) {
    PetscCall(PetscSFBcastBegin(moved, MPIU_INT, root, leaf, MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(moved, MPIU_INT, root, leaf, MPI_REPLACE));
  } else {
    PetscCall(DMPlexGetChart(after, NULL, &end));
    PetscCall(PetscArraycpy(leaf, root, end));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the extraction needs to know of the local cells and vertices, points [0, end). */
typedef struct {
  PetscInt  cell_end, end;
  PetscInt *original; /* number before distribution: cells, then vertices */
  PetscInt *corner;   /* [cell_end][FEM_MAX_NODES] local points, -1 after the last */
  PetscInt *leaf;     /* [end] 1 = owned elsewhere */
  PetscInt *local;    /* [end] our number of the element or node, -1 = dropped */
} Points;

static PetscErrorCode CreatePoints(const FemBody *body, DM before, DM after, PetscSF moved, Points *pt)
{
  PetscInt end_before, end, vertex_start, vertex_end, cell_start, vertices, at, *root, *leaf, *key, *point; /* key: original vertices, sorted; point: where they are */

  PetscFunctionBegin;
  PetscCall(DMPlexGetChart(before, NULL, &end_before));
  PetscCall(DMPlexGetChart(after, NULL, &end));
  PetscCall(DMPlexGetHeightStratum(after, 0, &cell_start, &pt->cell_end));
  PetscCall(DMPlexGetDepthStratum(after, 0, &vertex_start, &vertex_end));
  if (end == 0) cell_start = pt->cell_end = vertex_start = vertex_end = 0; /* this rank got nothing */
  PetscCheck(cell_start == 0 && vertex_start == pt->cell_end, PETSC_COMM_SELF, PETSC_ERR_PLIB, "Cells and vertices are not the first points of the plex");
  pt->end = vertex_end;
  PetscCall(PetscMalloc2(end_before, &root, end, &leaf));
  PetscCall(PetscMalloc1(end, &pt->original));
  for (PetscInt p = 0; p < end_before; p++) root[p] = p;
  PetscCall(Carry(after, moved, root, pt->original));
  vertices = pt->end - pt->cell_end;
  PetscCall(PetscMalloc2(vertices, &key, vertices, &point));
  for (PetscInt k = 0; k < vertices; k++) {
    point[k] = pt->cell_end + k;
    key[k]   = pt->original[point[k]];
  }
  PetscCall(PetscSortIntWithArray(vertices, key, point));
  PetscCall(PetscMalloc1(pt->cell_end * FEM_MAX_NODES, &pt->corner));
  for (PetscInt a = 0; a < FEM_MAX_NODES; a++) {
    for (PetscInt p = 0; p < end_before; p++) root[p] = -1;
    for (PetscInt c = 0; c < body->n_cells; c++)
      if (a < body->start[c + 1] - body->start[c]) root[c] = body->n_cells + body->node[body->start[c] + a];
    PetscCall(Carry(after, moved, root, leaf));
    for (PetscInt c = 0; c < pt->cell_end; c++) {
      pt->corner[c * FEM_MAX_NODES + a] = -1;
      if (leaf[c] < 0) continue;
      PetscCall(PetscFindInt(leaf[c], vertices, key, &at));
      PetscCheck(at >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB, "An element came without one of its nodes");
      pt->corner[c * FEM_MAX_NODES + a] = point[at];
    }
  }
  PetscCall(PetscFree2(key, point));
  PetscCall(PetscFree2(root, leaf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points of [first, last) with keep[p - first] == want, sorted by original number. */
static PetscErrorCode PickPoints(PetscInt first, PetscInt last, const PetscInt *keep, PetscInt want, const PetscInt *original, PetscInt *n, PetscInt *point)
{
  PetscInt *key;

  PetscFunctionBegin;
  *n = 0;
  PetscCall(PetscMalloc1(last - first, &key));
  for (PetscInt p = first; p < last; p++)
    if (keep[p - first] == want) {
      key[*n]      = original[p];
      point[(*n)++] = p;
    }
  PetscCall(PetscSortIntWithArray(*n, key, point));
  PetscCall(PetscFree(key));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Leaves are this rank's owned entities, in order; their roots stand on rank 0 at the global number. */
static PetscErrorCode HomeSF(FemModel model, PetscInt N, PetscInt n, const PetscInt *number, const PetscInt *slot, PetscSF *sf)
{
  PetscSFNode *remote;
  PetscInt    *local;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &remote));
  PetscCall(PetscMalloc1(n, &local));
  for (PetscInt k = 0; k < n; k++) {
    remote[k].rank  = 0;
    remote[k].index = number[k];
    local[k]        = slot ? slot[k] : k;
  }
  PetscCall(PetscSFCreate(model->comm, sf));
  PetscCall(PetscSFSetGraph(*sf, model->rank == 0 ? N : 0, n, local, PETSC_OWN_POINTER, remote, PETSC_OWN_POINTER));
  PetscCall(PetscSFSetUp(*sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GhostSF(FemModel model, DM dm, const Points *pt)
{
  PetscSF            point_sf;
  PetscInt           n_leaves, n_ghosts = 0, end, *owner, *slot;
  const PetscInt    *leaf;
  const PetscSFNode *root;
  PetscSFNode       *remote;

  PetscFunctionBegin;
  PetscCall(DMGetPointSF(dm, &point_sf));
  PetscCall(PetscSFGetGraph(point_sf, NULL, &n_leaves, &leaf, &root));
  PetscCall(DMPlexGetChart(dm, NULL, &end));
  PetscCall(PetscMalloc1(end, &owner));
  for (PetscInt p = 0; p < end; p++) owner[p] = p >= pt->end || pt->leaf[p] ? -1 : pt->local[p];
  PetscCall(PetscSFBcastBegin(point_sf, MPIU_INT, owner, owner, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(point_sf, MPIU_INT, owner, owner, MPI_REPLACE));
  PetscCall(PetscMalloc1(model->n_loc - model->n_own, &remote));
  PetscCall(PetscMalloc1(model->n_loc - model->n_own, &slot));
  for (PetscInt k = 0; k < n_leaves; k++) {
    const PetscInt p = leaf ? leaf[k] : k;

    if (p < pt->cell_end || p >= pt->end || pt->local[p] < 0) continue;
    PetscCheck(owner[p] >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB, "A ghost node has no owner");
    slot[n_ghosts]         = pt->local[p];
    remote[n_ghosts].rank  = root[k].rank;
    remote[n_ghosts].index = owner[p];
    n_ghosts++;
  }
  PetscCheck(n_ghosts == model->n_loc - model->n_own, PETSC_COMM_SELF, PETSC_ERR_PLIB, "Ghost nodes and shared points differ in number");
  PetscCall(PetscFree(owner));
  PetscCall(PetscSFCreate(model->comm, &model->ghosts));
  PetscCall(PetscSFSetGraph(model->ghosts, model->n_own, n_ghosts, slot, PETSC_OWN_POINTER, remote, PETSC_OWN_POINTER));
  PetscCall(PetscSFSetUp(model->ghosts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt CornerCount(const PetscInt corner[])
{
  PetscInt n = 0;

  while (n < FEM_MAX_NODES && corner[n] >= 0) n++;
  return n;
}

/* Elements and nodes of this rank: what it owns, and what its rows need. */
static PetscErrorCode ExtractPoints(FemModel model, DM dm, Points *pt)
{
  const PetscInt     nc = pt->cell_end;
  PetscInt           n_leaves, n, *keep, *point, *slot;
  const PetscInt    *leaf;
  PetscSF            point_sf;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(pt->end, &pt->leaf));
  PetscCall(PetscMalloc1(pt->end, &pt->local));
  for (PetscInt p = 0; p < pt->end; p++) pt->local[p] = -1;
  PetscCall(DMGetPointSF(dm, &point_sf));
  PetscCall(PetscSFGetGraph(point_sf, NULL, &n_leaves, &leaf, NULL));
  for (PetscInt k = 0; k < n_leaves; k++)
    if ((leaf ? leaf[k] : k) < pt->end) pt->leaf[leaf ? leaf[k] : k] = 1;
  PetscCall(PetscCalloc1(pt->end, &keep));
  PetscCall(PetscMalloc1(pt->end, &point));

  for (PetscInt c = 0; c < nc; c++) { /* elements: owned, or touching an owned node; their nodes stay */
    const PetscInt *corner = &pt->corner[c * FEM_MAX_NODES], size = CornerCount(corner);

    keep[c] = !pt->leaf[c];
    for (PetscInt a = 0; a < size; a++) keep[c] |= !pt->leaf[corner[a]];
    for (PetscInt a = 0; a < size && keep[c]; a++) keep[corner[a]] = pt->leaf[corner[a]] ? 2 : 1;
  }
  PetscCall(PickPoints(0, nc, keep, 1, pt->original, &model->n_cells, point));
  for (PetscInt k = 0; k < model->n_cells; k++) pt->local[point[k]] = k;
  PetscCall(PetscMalloc2(model->n_cells, &model->cell_gid, model->n_cells, &model->own));
  for (PetscInt k = 0; k < model->n_cells; k++) {
    model->cell_gid[k] = pt->original[point[k]];
    model->own[k]      = !pt->leaf[point[k]];
  }
  PetscCall(PickPoints(nc, pt->end, &keep[nc], 1, pt->original, &model->n_own, point));
  PetscCall(PickPoints(nc, pt->end, &keep[nc], 2, pt->original, &n, &point[model->n_own]));
  model->n_loc = model->n_own + n;
  PetscCall(PetscMalloc1(model->n_loc, &model->gid));
  for (PetscInt k = 0; k < model->n_loc; k++) {
    pt->local[point[k]] = k;
    model->gid[k]       = pt->original[point[k]] - model->N_cells;
  }
  PetscCall(PetscFree(point));
  PetscCall(PetscFree(keep));
  PetscCall(GhostSF(model, dm, pt));
  PetscCall(HomeSF(model, model->N_nodes, model->n_own, model->gid, NULL, &model->home));

  PetscCall(PetscMalloc2(model->n_cells, &slot, model->n_cells, &point));
  model->n_cells_own = 0;
  for (PetscInt k = 0; k < model->n_cells; k++)
    if (model->own[k]) {
      slot[model->n_cells_own]    = k;
      point[model->n_cells_own++] = model->cell_gid[k];
    }
  PetscCall(HomeSF(model, model->N_cells, model->n_cells_own, point, slot, &model->home_cells));
  PetscCall(PetscFree2(slot, point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ExtractCells(FemModel model, const Points *pt)
{
  PetscInt entries = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(model->n_cells + 1, &model->cell_start, model->n_cells, &model->cell_type, model->n_cells, &model->cell_material));
  PetscCall(PetscMalloc1(FEM_MAX_NODES * model->n_cells, &model->cell_node));
  model->cell_start[0] = 0;
  for (PetscInt c = 0; c < pt->cell_end; c++) {
    const PetscInt k = pt->local[c], size = CornerCount(&pt->corner[c * FEM_MAX_NODES]);

    if (k < 0) continue;
    model->cell_start[k + 1]  = size;
    model->cell_type[k]     = model->dim == 2 ? (size == 3 ? MESH_TRI3 : MESH_QUAD4) : (size == 4 ? MESH_TET4 : MESH_HEX8);
    model->cell_material[k] = -1;
  }
  for (PetscInt k = 0; k < model->n_cells; k++) {
    entries += model->cell_start[k + 1];
    model->cell_start[k + 1] = entries;
  }
  for (PetscInt c = 0; c < pt->cell_end; c++) {
    const PetscInt k = pt->local[c];

    if (k < 0) continue;
    for (PetscInt a = model->cell_start[k]; a < model->cell_start[k + 1]; a++) model->cell_node[a] = pt->local[pt->corner[c * FEM_MAX_NODES + a - model->cell_start[k]]];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Labels back to lists. A label value of a cell is 1 for a part of the body, a set of sides otherwise. */
static PetscErrorCode ExtractGroup(FemModel model, DM dm, const Points *pt, PetscInt g)
{
  FemGroup       *group = &model->group[g];
  char            name[32];
  DMLabel         label;
  IS              values;
  const PetscInt *value;
  PetscInt        n_values, *cell_bits, *on_node;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(model->n_cells, &cell_bits, model->n_loc, &on_node));
  PetscCall(LabelName(g, sizeof(name), name));
  PetscCall(DMGetLabel(dm, name, &label));
  if (label) {
    PetscCall(DMLabelGetNumValues(label, &n_values));
    PetscCall(DMLabelGetValueIS(label, &values));
    PetscCall(ISGetIndices(values, &value));
    for (PetscInt v = 0; v < n_values; v++) {
      IS              points;
      const PetscInt *point;
      PetscInt        n;

      PetscCall(DMLabelGetStratumIS(label, value[v], &points));
      if (!points) continue;
      PetscCall(ISGetLocalSize(points, &n));
      PetscCall(ISGetIndices(points, &point));
      for (PetscInt k = 0; k < n; k++) {
        const PetscInt here = point[k] < pt->end ? pt->local[point[k]] : -1;

        if (here < 0) continue;
        if (point[k] < pt->cell_end) cell_bits[here] = value[v];
        else on_node[here] = 1;
      }
      PetscCall(ISRestoreIndices(points, &point));
      PetscCall(ISDestroy(&points));
    }
    PetscCall(ISRestoreIndices(values, &value));
    PetscCall(ISDestroy(&values));
  }
  for (PetscInt c = 0; c < model->n_cells; c++)
    if (cell_bits[c]) {
      group->n_cells++;
      for (PetscInt f = 0; f < 6; f++) group->n_facets += (cell_bits[c] >> f) & 1;
      if (group->dim == model->dim)
        for (PetscInt k = model->cell_start[c]; k < model->cell_start[c + 1]; k++) on_node[model->cell_node[k]] = 1;
    }
  for (PetscInt i = 0; i < model->n_own; i++) group->n_nodes += on_node[i];
  PetscCall(PetscMalloc1(group->n_nodes, &group->node));
  group->n_nodes = 0;
  for (PetscInt i = 0; i < model->n_own; i++)
    if (on_node[i]) group->node[group->n_nodes++] = i;
  if (group->dim == model->dim) {
    PetscCall(PetscMalloc1(group->n_cells, &group->cell));
    group->n_cells = group->n_facets = 0;
    for (PetscInt c = 0; c < model->n_cells; c++)
      if (cell_bits[c]) group->cell[group->n_cells++] = c;
  } else {
    PetscCall(PetscMalloc2(group->n_facets, &group->facet_cell, group->n_facets, &group->facet_face));
    group->n_cells = group->n_facets = 0;
    for (PetscInt c = 0; c < model->n_cells; c++)
      for (PetscInt f = 0; f < 6; f++)
        if ((cell_bits[c] >> f) & 1) {
          group->facet_cell[group->n_facets]   = c;
          group->facet_face[group->n_facets++] = f;
        }
  }
  PetscCall(PetscFree2(cell_bits, on_node));
  PetscCallMPI(MPI_Allreduce(&group->n_nodes, &group->n_nodes_global, 1, MPIU_INT, MPI_SUM, model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What rank 0 keeps of the whole mesh for frames: nodes and elements in global order. */
static PetscErrorCode KeepWhole(FemModel model, const Mesh *mesh, FemBody *body)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc2(3 * body->n_nodes, &model->x_all, body->n_nodes, &model->id_all));
  for (PetscInt i = 0; i < body->n_nodes; i++) {
    for (PetscInt d = 0; d < 3; d++) model->x_all[3 * i + d] = mesh->x[3 * body->old[i] + d];
    model->id_all[i] = mesh->id[body->old[i]];
  }
  PetscCall(PetscMalloc4(body->n_cells + 1, &model->start_all, body->start[body->n_cells], &model->node_all, body->n_cells, &model->cell_id_all, body->n_cells, &model->vtk_all));
  PetscCall(PetscArraycpy(model->start_all, body->start, body->n_cells + 1));
  PetscCall(PetscArraycpy(model->node_all, body->node, body->start[body->n_cells]));
  for (PetscInt c = 0; c < body->n_cells; c++) {
    model->cell_id_all[c] = mesh->cell_id[body->cell[c]];
    model->vtk_all[c]     = FemShapeGet(mesh->type[body->cell[c]])->vtk;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ShareCounts(FemModel model, const Mesh *mesh, const FemBody *body)
{
  PetscInt count[4] = {mesh->dim, body->n_nodes, body->n_cells, mesh->n_groups};

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(count, 4, MPIU_INT, 0, model->comm));
  model->dim      = count[0];
  model->N_nodes  = count[1];
  model->N_cells  = count[2];
  model->n_groups = count[3];
  if (model->rank == 0) PetscCall(PetscStrncpy(model->source, mesh->source, sizeof(model->source)));
  PetscCallMPI(MPI_Bcast(model->source, BASE_LINE, MPI_CHAR, 0, model->comm));
  PetscCall(PetscCalloc1(model->n_groups, &model->group));
  for (PetscInt g = 0; g < model->n_groups; g++) {
    if (model->rank == 0) {
      PetscCall(PetscStrncpy(model->group[g].name, mesh->group[g].name, sizeof(model->group[g].name)));
      model->group[g].dim = mesh->group[g].dim;
    }
    PetscCallMPI(MPI_Bcast(model->group[g].name, sizeof(model->group[g].name), MPI_CHAR, 0, model->comm));
    PetscCallMPI(MPI_Bcast(&model->group[g].dim, 1, MPIU_INT, 0, model->comm));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetMesh(FemModel model, const Mesh *mesh)
{
  char      words[BASE_LINE] = "";
  FemBody   body             = {0};
  DM        serial, dm = NULL;
  PetscSF   moved = NULL;
  Points    pt    = {0};
  PetscReal *x3;

  PetscFunctionBegin;
  PetscCheck(model, PETSC_COMM_SELF, PETSC_ERR_ARG_NULL, "FemModel is NULL; call FemModelCreate() first");
  PetscCheck(!model->has_mesh, model->comm, PETSC_ERR_ORDER, "The model has a mesh already");
  PetscCall(PetscLogEventBegin(FEM_SetUpMesh, 0, 0, 0, 0));
  if (model->rank == 0) PetscCall(FemBodyCreate(mesh, &body, words));
  if (words[0]) PetscCall(FemBodyDestroy(&body));
  PetscCall(FemAgree(model->comm, words));
  PetscCall(ShareCounts(model, mesh, &body));

  PetscCall(BuildPlex(model, &body, &serial));
  if (model->rank == 0) PetscCall(LabelGroups(model, mesh, &body, serial));
  for (PetscInt g = 0; g < model->n_groups; g++) {
    PetscInt count[2] = {model->group[g].interior, model->group[g].loose};

    PetscCallMPI(MPI_Bcast(count, 2, MPIU_INT, 0, model->comm));
    model->group[g].interior = count[0];
    model->group[g].loose    = count[1];
  }
  if (model->size > 1) {
    PetscPartitioner partitioner;

    PetscCall(DMPlexGetPartitioner(serial, &partitioner));
    PetscCall(PetscPartitionerSetFromOptions(partitioner)); /* DMSetFromOptions would distribute by itself, without our overlap */
    PetscCall(DMPlexDistribute(serial, 1, &moved, &dm));
  }
  if (!dm) {
    PetscCall(PetscObjectReference((PetscObject)serial));
    dm = serial;
  }
  PetscCall(CreatePoints(&body, serial, dm, moved, &pt));
  PetscCall(PetscSFDestroy(&moved));
  PetscCall(ExtractPoints(model, dm, &pt));
  PetscCall(ExtractCells(model, &pt));
  for (PetscInt g = 0; g < model->n_groups; g++) PetscCall(ExtractGroup(model, dm, &pt, g));
  PetscCall(DMDestroy(&dm));
  PetscCall(DMDestroy(&serial));
  PetscCall(PetscFree(pt.original));
  PetscCall(PetscFree(pt.corner));
  PetscCall(PetscFree(pt.leaf));
  PetscCall(PetscFree(pt.local));

  if (model->rank == 0) PetscCall(KeepWhole(model, mesh, &body));
  if (model->rank == 0) PetscCall(FemBodyDestroy(&body));
  PetscCall(PetscMalloc1(3 * model->n_own, &x3));
  PetscCall(FemScatter(model, model->home, 3, model->x_all, x3));
  PetscCall(PetscMalloc1(model->dim * model->n_loc, &model->x));
  for (PetscInt i = 0; i < model->n_own; i++)
    for (PetscInt d = 0; d < model->dim; d++) model->x[i * model->dim + d] = x3[3 * i + d];
  PetscCall(PetscFree(x3));
  PetscCall(FemGhosts(model, model->x));
  model->has_mesh = PETSC_TRUE;
  PetscCall(PetscLogEventEnd(FEM_SetUpMesh, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemMeshDestroy(FemModel model)
{
  PetscFunctionBegin;
  for (PetscInt g = 0; g < model->n_groups && model->group; g++) {
    FemGroup *group = &model->group[g];

    PetscCall(PetscFree(group->node));
    PetscCall(PetscFree(group->cell));
    PetscCall(PetscFree2(group->facet_cell, group->facet_face));
  }
  PetscCall(PetscFree(model->group));
  PetscCall(PetscFree2(model->cell_gid, model->own));
  PetscCall(PetscFree3(model->cell_start, model->cell_type, model->cell_material));
  PetscCall(PetscFree(model->cell_node));
  PetscCall(PetscFree(model->gid));
  PetscCall(PetscFree(model->x));
  PetscCall(PetscSFDestroy(&model->ghosts));
  PetscCall(PetscSFDestroy(&model->home));
  PetscCall(PetscSFDestroy(&model->home_cells));
  PetscCall(PetscFree2(model->x_all, model->id_all));
  PetscCall(PetscFree4(model->start_all, model->node_all, model->cell_id_all, model->vtk_all));
  PetscFunctionReturn(PETSC_SUCCESS);
}
