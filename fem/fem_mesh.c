/*
  fem_mesh.c - from the mesh on rank 0 to flat arrays on every rank.

  Rank 0 has the elements partitioned by the graph of shared sides (PetscPartitioner: PT-Scotch), gives each node to the
  lowest rank among its elements, and packs for every rank the elements it owns or that touch a node it owns, their
  nodes and its share of the groups, all in local numbers: one message of integers each, which the rank unpacks.
*/
#include "fem_impl.h"
#include <petscpartitioner.h>
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

/* ---- rank 0: who gets what ---- */

/* A group over the whole mesh, in body numbers; facets as 8*cell + side. */
typedef struct {
  PetscInt  n_nodes, n_cells, n_facets;
  PetscInt *node, *cell, *facet;
} Whole;

typedef struct {
  PetscInt *part;  /* [n_cells] rank of each element */
  PetscInt *owner; /* [n_nodes] rank of each node, and */
  PetscInt *slot;  /* [n_nodes] its number there */
} Cut;

/* Elements that share a side, as a graph. */
static PetscErrorCode SideGraph(const Mesh *mesh, const FemBody *body, PetscInt **start, PetscInt **neighbour)
{
  PetscInt n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(body->n_cells + 1, start));
  PetscCall(PetscMalloc1(6 * body->n_cells, neighbour));
  for (PetscInt c = 0; c < body->n_cells; c++) {
    const FemShape *shape = FemShapeGet(mesh->type[body->cell[c]]);

    (*start)[c] = n;
    for (PetscInt f = 0; f < shape->faces; f++) {
      PetscInt node[FEM_MAX_FACE_NODES], cell[2], side, found;

      for (PetscInt a = 0; a < shape->face_nodes[f]; a++) node[a] = body->old[body->node[body->start[c] + shape->face[f][a]]];
      found = FemBodyFindSide(mesh, body, shape->face_nodes[f], node, cell, &side);
      if (found > 1) (*neighbour)[n++] = cell[0] == c ? cell[1] : cell[0];
    }
  }
  (*start)[body->n_cells] = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: the partitioner wants every rank, though only rank 0 has a graph. */
static PetscErrorCode Partition(FemModel model, const Mesh *mesh, const FemBody *body, PetscInt *part)
{
  PetscPartitioner partitioner;
  PetscSection     sections;
  IS               order;
  const PetscInt  *cell;
  PetscInt        *start = NULL, *neighbour = NULL, count, first;

  PetscFunctionBegin;
  if (model->size == 1) {
    PetscCall(PetscArrayzero(part, body->n_cells));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (model->rank == 0) PetscCall(SideGraph(mesh, body, &start, &neighbour));
  else PetscCall(PetscCalloc1(1, &start));
  PetscCall(PetscSectionCreate(model->comm, &sections));
  PetscCall(PetscPartitionerCreate(model->comm, &partitioner));
  PetscCall(PetscPartitionerSetType(partitioner, PETSCPARTITIONERPTSCOTCH));
  PetscCall(PetscPartitionerSetFromOptions(partitioner));
  PetscCall(PetscPartitionerPartition(partitioner, model->size, model->rank == 0 ? body->n_cells : 0, start, neighbour, NULL, NULL, sections, &order));
  if (model->rank == 0) {
    PetscCall(ISGetIndices(order, &cell));
    for (PetscInt r = 0; r < model->size; r++) {
      PetscCall(PetscSectionGetDof(sections, r, &count));
      PetscCall(PetscSectionGetOffset(sections, r, &first));
      for (PetscInt k = first; k < first + count; k++) part[cell[k]] = r;
    }
    PetscCall(ISRestoreIndices(order, &cell));
  }
  PetscCall(ISDestroy(&order));
  PetscCall(PetscPartitionerDestroy(&partitioner));
  PetscCall(PetscSectionDestroy(&sections));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(neighbour));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode OwnNodes(FemModel model, const FemBody *body, Cut *cut)
{
  PetscInt *count;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(model->size, &count));
  for (PetscInt i = 0; i < body->n_nodes; i++) {
    cut->owner[i] = model->size;
    for (PetscInt k = body->star_start[i]; k < body->star_start[i + 1]; k++) cut->owner[i] = PetscMin(cut->owner[i], cut->part[body->star[k]]);
    cut->slot[i] = count[cut->owner[i]]++;
  }
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes, elements and sides of a group; counts sides inside the body and sides of nothing. */
static PetscErrorCode FindWhole(FemModel model, const Mesh *mesh, const FemBody *body, const PetscInt *body_cell, PetscInt g, Whole *w)
{
  const MeshGroup *from = &mesh->group[g];
  const PetscBool  part = from->dim == model->dim ? PETSC_TRUE : PETSC_FALSE, sides = from->dim == model->dim - 1 ? PETSC_TRUE : PETSC_FALSE;
  char            *on_node;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(body->n_nodes, &on_node));
  PetscCall(PetscMalloc1(part ? from->n_cells : 0, &w->cell));
  PetscCall(PetscMalloc1(sides ? from->n_cells : 0, &w->facet));
  for (PetscInt k = 0; k < from->n_cells; k++) {
    const PetscInt  c = from->cell[k], n = mesh->start[c + 1] - mesh->start[c];
    const PetscInt *node = &mesh->node[mesh->start[c]];
    PetscInt        cell[2], side, found;

    for (PetscInt a = 0; a < n; a++)
      if (body->number[node[a]] >= 0) on_node[body->number[node[a]]] = 1;
    if (part) w->cell[w->n_cells++] = body_cell[c];
    if (!sides) continue;
    found = FemBodyFindSide(mesh, body, n, node, cell, &side);
    if (!found) model->group[g].loose++;
    else w->facet[w->n_facets++] = 8 * cell[0] + side;
    if (found > 1) model->group[g].interior++;
  }
  for (PetscInt i = 0; i < body->n_nodes; i++) w->n_nodes += on_node[i];
  PetscCall(PetscMalloc1(w->n_nodes, &w->node));
  w->n_nodes = 0;
  for (PetscInt i = 0; i < body->n_nodes; i++)
    if (on_node[i]) w->node[w->n_nodes++] = i;
  PetscCall(PetscSortInt(w->n_cells, w->cell));
  PetscCall(PetscSortRemoveDupsInt(&w->n_facets, w->facet));
  PetscCall(PetscFree(on_node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- one message of integers ---- */

typedef struct {
  PetscInt  n, room, *v;
} Words;

static PetscErrorCode Put(Words *w, PetscInt value)
{
  PetscFunctionBegin;
  if (w->n == w->room) {
    w->room = PetscMax(1024, 2 * w->room);
    PetscCall(PetscRealloc(sizeof(PetscInt) * w->room, &w->v));
  }
  w->v[w->n++] = value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A list with its length in front; Close writes the length. */
static PetscErrorCode Open(Words *w, PetscInt *at)
{
  PetscFunctionBegin;
  *at = w->n;
  PetscCall(Put(w, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Close(Words *w, PetscInt at)
{
  w->v[at] = w->n - at - 1;
}

static const PetscInt *Take(const PetscInt **at, PetscInt *n)
{
  const PetscInt *list = *at + 1;

  *n = **at;
  *at += 1 + *n;
  return list;
}

/* What rank r needs, in its own numbers. place [n_nodes], here [n_cells]: -1 everywhere, before and after. */
static PetscErrorCode Pack(const Mesh *mesh, const FemBody *body, const Cut *cut, PetscInt n_groups, const Whole *whole, PetscInt r, PetscInt *place, PetscInt *here, Words *w)
{
  PetscInt cells = 0, own = 0, nodes = 0, at;

  PetscFunctionBegin;
  w->n = 0;
  for (PetscInt c = 0; c < body->n_cells; c++) {
    PetscBool keep = cut->part[c] == r ? PETSC_TRUE : PETSC_FALSE;

    for (PetscInt k = body->start[c]; k < body->start[c + 1] && !keep; k++) keep = cut->owner[body->node[k]] == r ? PETSC_TRUE : PETSC_FALSE;
    if (!keep) continue;
    here[c] = cells++;
    for (PetscInt k = body->start[c]; k < body->start[c + 1]; k++) place[body->node[k]] = 0;
  }
  for (PetscInt i = 0; i < body->n_nodes; i++)
    if (cut->owner[i] == r) place[i] = own++;
  nodes = own;
  for (PetscInt i = 0; i < body->n_nodes; i++)
    if (cut->owner[i] != r && place[i] >= 0) place[i] = nodes++;

  PetscCall(Open(w, &at));
  for (PetscInt owned = 1; owned >= 0; owned--) /* global numbers, owned first */
    for (PetscInt i = 0; i < body->n_nodes; i++)
      if (place[i] >= 0 && (cut->owner[i] == r) == owned) PetscCall(Put(w, i));
  Close(w, at);
  PetscCall(Open(w, &at)); /* ghosts: owner, number there */
  for (PetscInt i = 0; i < body->n_nodes; i++)
    if (place[i] >= 0 && cut->owner[i] != r) {
      PetscCall(Put(w, cut->owner[i]));
      PetscCall(Put(w, cut->slot[i]));
    }
  Close(w, at);
  PetscCall(Open(w, &at)); /* elements: global number, owned, type, nodes */
  for (PetscInt c = 0; c < body->n_cells; c++) {
    if (here[c] < 0) continue;
    PetscCall(Put(w, c));
    PetscCall(Put(w, cut->part[c] == r));
    PetscCall(Put(w, (PetscInt)mesh->type[body->cell[c]]));
    for (PetscInt k = body->start[c]; k < body->start[c + 1]; k++) PetscCall(Put(w, place[body->node[k]]));
  }
  Close(w, at);
  for (PetscInt g = 0; g < n_groups; g++) {
    PetscCall(Open(w, &at));
    for (PetscInt k = 0; k < whole[g].n_nodes; k++)
      if (cut->owner[whole[g].node[k]] == r) PetscCall(Put(w, place[whole[g].node[k]]));
    Close(w, at);
    PetscCall(Open(w, &at));
    for (PetscInt k = 0; k < whole[g].n_cells; k++)
      if (here[whole[g].cell[k]] >= 0) PetscCall(Put(w, here[whole[g].cell[k]]));
    Close(w, at);
    PetscCall(Open(w, &at));
    for (PetscInt k = 0; k < whole[g].n_facets; k++)
      if (here[whole[g].facet[k] / 8] >= 0) PetscCall(Put(w, 8 * here[whole[g].facet[k] / 8] + whole[g].facet[k] % 8));
    Close(w, at);
  }
  for (PetscInt c = 0; c < body->n_cells; c++) here[c] = -1;
  for (PetscInt i = 0; i < body->n_nodes; i++) place[i] = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- every rank: its own arrays ---- */

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

static PetscErrorCode UnpackNodes(FemModel model, const PetscInt **at)
{
  const PetscInt *number, *ghost;
  PetscInt        n, n_ghosts, *slot;
  PetscSFNode    *remote;

  PetscFunctionBegin;
  number = Take(at, &n);
  ghost  = Take(at, &n_ghosts);
  n_ghosts /= 2;
  model->n_loc = n;
  model->n_own = n - n_ghosts;
  PetscCall(PetscMalloc1(n, &model->gid));
  PetscCall(PetscArraycpy(model->gid, number, n));
  PetscCall(PetscMalloc1(n_ghosts, &remote));
  PetscCall(PetscMalloc1(n_ghosts, &slot));
  for (PetscInt k = 0; k < n_ghosts; k++) {
    slot[k]         = model->n_own + k;
    remote[k].rank  = ghost[2 * k];
    remote[k].index = ghost[2 * k + 1];
  }
  PetscCall(PetscSFCreate(model->comm, &model->ghosts));
  PetscCall(PetscSFSetGraph(model->ghosts, model->n_own, n_ghosts, slot, PETSC_OWN_POINTER, remote, PETSC_OWN_POINTER));
  PetscCall(PetscSFSetUp(model->ghosts));
  PetscCall(HomeSF(model, model->N_nodes, model->n_own, model->gid, NULL, &model->home));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode UnpackCells(FemModel model, const PetscInt **at)
{
  const PetscInt *word;
  PetscInt        n, entries = 0, cells = 0, *slot, *number;

  PetscFunctionBegin;
  word = Take(at, &n);
  for (PetscInt k = 0; k < n; k += 3 + MeshCellNodes((MeshCellType)word[k + 2])) {
    entries += MeshCellNodes((MeshCellType)word[k + 2]);
    cells++;
  }
  model->n_cells = cells;
  PetscCall(PetscMalloc2(cells, &model->cell_gid, cells, &model->own));
  PetscCall(PetscMalloc3(cells + 1, &model->cell_start, cells, &model->cell_type, cells, &model->cell_material));
  PetscCall(PetscMalloc1(entries, &model->cell_node));
  PetscCall(PetscMalloc2(cells, &slot, cells, &number));
  model->n_cells_own = entries = 0;
  for (PetscInt c = 0; c < cells; c++) {
    model->cell_gid[c]      = word[0];
    model->own[c]           = word[1];
    model->cell_type[c]     = word[2];
    model->cell_material[c] = -1;
    model->cell_start[c]    = entries;
    for (PetscInt a = 0; a < MeshCellNodes((MeshCellType)word[2]); a++) model->cell_node[entries++] = word[3 + a];
    if (model->own[c]) {
      slot[model->n_cells_own]     = c;
      number[model->n_cells_own++] = word[0];
    }
    word += 3 + MeshCellNodes((MeshCellType)word[2]);
  }
  model->cell_start[cells] = entries;
  PetscCall(HomeSF(model, model->N_cells, model->n_cells_own, number, slot, &model->home_cells));
  PetscCall(PetscFree2(slot, number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode UnpackGroup(FemModel model, const PetscInt **at, FemGroup *group)
{
  const PetscInt *node, *cell, *facet;

  PetscFunctionBegin;
  node  = Take(at, &group->n_nodes);
  cell  = Take(at, &group->n_cells);
  facet = Take(at, &group->n_facets);
  PetscCall(PetscMalloc1(group->n_nodes, &group->node));
  PetscCall(PetscArraycpy(group->node, node, group->n_nodes));
  if (group->dim == model->dim) {
    PetscCall(PetscMalloc1(group->n_cells, &group->cell));
    PetscCall(PetscArraycpy(group->cell, cell, group->n_cells));
  } else PetscCall(PetscMalloc2(group->n_facets, &group->facet_cell, group->n_facets, &group->facet_face));
  for (PetscInt k = 0; k < group->n_facets; k++) {
    group->facet_cell[k] = facet[k] / 8;
    group->facet_face[k] = facet[k] % 8;
  }
  PetscCallMPI(MPI_Allreduce(&group->n_nodes, &group->n_nodes_global, 1, MPIU_INT, MPI_SUM, model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Unpack(FemModel model, const PetscInt *words)
{
  const PetscInt *at = words;

  PetscFunctionBegin;
  PetscCall(UnpackNodes(model, &at));
  PetscCall(UnpackCells(model, &at));
  for (PetscInt g = 0; g < model->n_groups; g++) PetscCall(UnpackGroup(model, &at, &model->group[g]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 sends each rank its words; every rank, itself included, unpacks. */
static PetscErrorCode Distribute(FemModel model, const Mesh *mesh, const FemBody *body)
{
  Cut   cut  = {NULL};
  Words mine = {0};

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(body->n_cells, &cut.part, body->n_nodes, &cut.owner, body->n_nodes, &cut.slot));
  PetscCall(Partition(model, mesh, body, cut.part));
  if (model->rank == 0) {
    Whole    *whole;
    PetscInt *place, *here, *body_cell;

    PetscCall(OwnNodes(model, body, &cut));
    PetscCall(PetscCalloc1(model->n_groups, &whole));
    PetscCall(PetscMalloc3(body->n_nodes, &place, body->n_cells, &here, mesh->n_cells, &body_cell));
    for (PetscInt i = 0; i < body->n_nodes; i++) place[i] = -1;
    for (PetscInt c = 0; c < body->n_cells; c++) here[c] = -1;
    for (PetscInt c = 0; c < body->n_cells; c++) body_cell[body->cell[c]] = c;
    for (PetscInt g = 0; g < model->n_groups; g++) PetscCall(FindWhole(model, mesh, body, body_cell, g, &whole[g]));
    for (PetscMPIInt r = model->size - 1; r >= 0; r--) {
      PetscCall(Pack(mesh, body, &cut, model->n_groups, whole, r, place, here, &mine));
      if (r > 0) {
        PetscCallMPI(MPI_Send(&mine.n, 1, MPIU_INT, r, 1, model->comm));
        PetscCallMPI(MPI_Send(mine.v, (PetscMPIInt)mine.n, MPIU_INT, r, 2, model->comm));
      }
    }
    for (PetscInt g = 0; g < model->n_groups; g++) {
      PetscCall(PetscFree(whole[g].node));
      PetscCall(PetscFree(whole[g].cell));
      PetscCall(PetscFree(whole[g].facet));
    }
    PetscCall(PetscFree3(place, here, body_cell));
    PetscCall(PetscFree(whole));
  } else {
    PetscCallMPI(MPI_Recv(&mine.n, 1, MPIU_INT, 0, 1, model->comm, MPI_STATUS_IGNORE));
    PetscCall(PetscMalloc1(mine.n, &mine.v));
    PetscCallMPI(MPI_Recv(mine.v, (PetscMPIInt)mine.n, MPIU_INT, 0, 2, model->comm, MPI_STATUS_IGNORE));
  }
  PetscCall(PetscFree3(cut.part, cut.owner, cut.slot));
  PetscCall(Unpack(model, mine.v));
  PetscCall(PetscFree(mine.v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points and lines that are no sides: how much of the group each node stands for. A node of a point group stands for one.  Eq. (2.75) */
static PetscErrorCode GroupShares(FemModel model, const Mesh *mesh, const FemBody *body, PetscInt g)
{
  FemGroup  *group = &model->group[g];
  PetscReal *all, *own;

  PetscFunctionBegin;
  if (group->dim >= model->dim - 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(group->n_nodes, &group->share));
  for (PetscInt k = 0; k < group->n_nodes; k++) group->share[k] = 1;
  group->share_all = group->n_nodes_global;
  if (group->dim == 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc2(model->rank == 0 ? model->N_nodes : 0, &all, model->n_own, &own));
  group->share_all = 0;
  for (PetscInt k = 0; model->rank == 0 && k < mesh->group[g].n_cells; k++) { /* chords: curved edges of second order count as two */
    const PetscInt c = mesh->group[g].cell[k], n = mesh->start[c + 1] - mesh->start[c], *node = &mesh->node[mesh->start[c]];
    PetscReal      length = 0;

    for (PetscInt a = 0; a + 1 < n; a++) {
      const PetscInt from = n == 2 ? 0 : a == 0 ? 0 : 2, to = n == 2 ? 1 : a == 0 ? 2 : 1;
      PetscReal      square = 0;

      for (PetscInt d = 0; d < 3; d++) square += PetscSqr(mesh->x[3 * node[to] + d] - mesh->x[3 * node[from] + d]);
      length += PetscSqrtReal(square);
    }
    for (PetscInt a = 0; a < n; a++)
      if (body->number[node[a]] >= 0) all[body->number[node[a]]] += length * (n == 2 ? 0.5 : a < 2 ? 1. / 6 : 2. / 3);
    group->share_all += length;
  }
  PetscCallMPI(MPI_Bcast(&group->share_all, 1, MPIU_REAL, 0, model->comm));
  PetscCall(FemScatter(model, model->home, 1, all, own));
  for (PetscInt k = 0; k < group->n_nodes; k++) group->share[k] = own[group->node[k]];
  PetscCall(PetscFree2(all, own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What rank 0 keeps of the whole mesh for frames: nodes and elements in global order, an element's nodes in VTK's. */
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
  for (PetscInt c = 0; c < body->n_cells; c++) {
    const FemShape *shape = FemShapeGet(mesh->type[body->cell[c]]);

    model->cell_id_all[c] = mesh->cell_id[body->cell[c]];
    model->vtk_all[c]     = shape->vtk;
    for (PetscInt a = 0; a < shape->nodes; a++) model->node_all[body->start[c] + a] = body->node[body->start[c] + shape->vtk_node[a]];
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
  char       words[BASE_LINE] = "";
  FemBody    body             = {0};
  PetscReal *x3;

  PetscFunctionBegin;
  PetscCheck(model, PETSC_COMM_SELF, PETSC_ERR_ARG_NULL, "FemModel is NULL; call FemModelCreate() first");
  PetscCheck(!model->has_mesh, model->comm, PETSC_ERR_ORDER, "The model has a mesh already");
  PetscCall(PetscLogEventBegin(FEM_SetUpMesh, 0, 0, 0, 0));
  if (model->rank == 0) PetscCall(FemBodyCreate(mesh, &body, words));
  if (words[0]) PetscCall(FemBodyDestroy(&body));
  PetscCall(FemAgree(model->comm, words));
  PetscCall(ShareCounts(model, mesh, &body));
  PetscCall(Distribute(model, mesh, &body));
  for (PetscInt g = 0; g < model->n_groups; g++) PetscCall(GroupShares(model, mesh, &body, g));
  for (PetscInt g = 0; g < model->n_groups; g++) {
    PetscInt count[2] = {model->group[g].interior, model->group[g].loose};

    PetscCallMPI(MPI_Bcast(count, 2, MPIU_INT, 0, model->comm));
    model->group[g].interior = count[0];
    model->group[g].loose    = count[1];
  }
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
    PetscCall(PetscFree(group->share));
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
