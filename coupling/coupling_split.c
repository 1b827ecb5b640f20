/* coupling_split.c - which cells become particles, which stay elements, which are both. */
#include "coupling_impl.h"

static PetscBool InGroup(const MeshGroup *group, PetscInt cell)
{
  PetscInt at;

  (void)PetscFindInt(cell, group->n_cells, group->cell, &at);
  return at >= 0 ? PETSC_TRUE : PETSC_FALSE;
}

/* The mesh of the cells marked keep[], with the nodes they use and the groups that are left. map: old cell -> new, -1. corners: as linear cells. */
static PetscErrorCode SubMesh(const Mesh *whole, const PetscBool *keep, PetscBool corners, Mesh *sub, PetscInt *map)
{
  PetscInt *node, used = 0, entries = 0;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(sub, sizeof(*sub)));
  PetscCall(PetscMalloc1(whole->n_nodes, &node));
  for (PetscInt i = 0; i < whole->n_nodes; i++) node[i] = -1;
  for (PetscInt c = 0; c < whole->n_cells; c++) {
    map[c] = keep[c] ? sub->n_cells++ : -1;
    if (!keep[c]) continue;
    const PetscInt n = corners ? MeshCellCorners(whole->type[c]) : whole->start[c + 1] - whole->start[c];

    entries += n;
    for (PetscInt k = whole->start[c]; k < whole->start[c] + n; k++) node[whole->node[k]] = 0;
  }
  for (PetscInt i = 0; i < whole->n_nodes; i++)
    if (node[i] == 0) node[i] = used++;
  PetscCall(PetscStrncpy(sub->source, whole->source, sizeof(sub->source)));
  sub->dim     = whole->dim;
  sub->n_nodes = used;
  PetscCall(PetscMalloc2(3 * used, &sub->x, used, &sub->id)); /* as MeshDestroy() frees them */
  PetscCall(PetscMalloc3(sub->n_cells, &sub->type, sub->n_cells, &sub->cell_id, sub->n_cells + 1, &sub->start));
  PetscCall(PetscMalloc1(entries, &sub->node));
  for (PetscInt i = 0; i < whole->n_nodes; i++)
    if (node[i] >= 0) {
      for (PetscInt d = 0; d < 3; d++) sub->x[3 * node[i] + d] = whole->x[3 * i + d];
      sub->id[node[i]] = whole->id[i];
    }
  sub->start[0] = 0;
  for (PetscInt c = 0; c < whole->n_cells; c++) {
    const PetscInt n = map[c];

    if (n < 0) continue;
    sub->type[n]      = corners ? MeshCellLinear(whole->type[c]) : whole->type[c];
    sub->cell_id[n]   = whole->cell_id[c];
    sub->start[n + 1] = sub->start[n] + (corners ? MeshCellCorners(whole->type[c]) : whole->start[c + 1] - whole->start[c]);
    for (PetscInt k = sub->start[n]; k < sub->start[n + 1]; k++) sub->node[k] = node[whole->node[whole->start[c] + k - sub->start[n]]];
  }
  PetscCall(PetscMalloc1(whole->n_groups + 1, &sub->group)); /* one to spare: the rim */
  for (PetscInt g = 0; g < whole->n_groups; g++) {
    const MeshGroup *from = &whole->group[g];
    MeshGroup       *to = &sub->group[sub->n_groups];

    *to         = *from;
    to->n_cells = 0;
    PetscCall(PetscMalloc1(from->n_cells, &to->cell));
    for (PetscInt k = 0; k < from->n_cells; k++)
      if (map[from->cell[k]] >= 0) to->cell[to->n_cells++] = map[from->cell[k]];
    if (to->n_cells) sub->n_groups++;
    else PetscCall(PetscFree(to->cell));
  }
  PetscCall(PetscFree(node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sides of a cell as lists of corners: up to 6 of up to 4. */
static PetscInt Sides(MeshCellType whole, const PetscInt *node, PetscInt side[6][4], PetscInt size[6])
{
  const MeshCellType    type = MeshCellLinear(whole);
  static const PetscInt tri[3][2] = {{0, 1}, {1, 2}, {2, 0}}, quad[4][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}};
  static const PetscInt tet[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  static const PetscInt hex[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  const PetscInt        n = type == MESH_TRI3 ? 3 : type == MESH_QUAD4 ? 4 : type == MESH_TET4 ? 4 : type == MESH_HEX8 ? 6 : 0;

  for (PetscInt f = 0; f < n; f++) {
    size[f] = type == MESH_TET4 ? 3 : type == MESH_HEX8 ? 4 : 2;
    for (PetscInt k = 0; k < size[f]; k++) side[f][k] = node[type == MESH_TRI3 ? tri[f][k] : type == MESH_QUAD4 ? quad[f][k] : type == MESH_TET4 ? tet[f][k] : hex[f][k]];
  }
  return n;
}

typedef struct {
  PetscInt key[4], cell, side;
} Side;

static int CompareSides(const void *a, const void *b)
{
  const Side *s = a, *t = b;

  for (int k = 0; k < 4; k++)
    if (s->key[k] != t->key[k]) return s->key[k] < t->key[k] ? -1 : 1;
  return s->cell < t->cell ? -1 : s->cell > t->cell;
}

/* Facet cells between a particle cell and an element-only cell, appended to the particles' mesh as the group COUPLING_RIM. */
static PetscErrorCode AddRim(const Mesh *whole, const PetscBool *is_dem, const PetscInt *map, Mesh *dem)
{
  Side     *sides;
  PetscInt  n = 0, m = 0, entries, *node_of;
  PetscInt *pick, *cell_id, *start, *node;
  MeshGroup *rim;
  MeshCellType *type;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(6 * whole->n_cells, &sides, 6 * whole->n_cells, &pick));
  for (PetscInt c = 0; c < whole->n_cells; c++) {
    PetscInt side[6][4], size[6], count;

    if (MeshCellDim(whole->type[c]) != whole->dim) continue;
    count = Sides(whole->type[c], whole->node + whole->start[c], side, size);
    for (PetscInt f = 0; f < count; f++, n++) {
      for (PetscInt k = 0; k < 4; k++) sides[n].key[k] = k < size[f] ? side[f][k] : PETSC_MAX_INT;
      PetscCall(PetscSortInt(size[f], sides[n].key));
      sides[n].cell = c;
      sides[n].side = f;
    }
  }
  qsort(sides, n, sizeof(*sides), CompareSides);
  for (PetscInt k = 0; k + 1 < n; k++) {
    const Side *s = &sides[k], *t = &sides[k + 1];

    if (memcmp(s->key, t->key, sizeof(s->key)) || is_dem[s->cell] == is_dem[t->cell]) continue;
    pick[m++] = is_dem[s->cell] ? k : k + 1;
  }
  /* old node -> new, by the first particle cell that shows it */
  PetscCall(PetscMalloc1(whole->n_nodes, &node_of));
  for (PetscInt c = 0; c < whole->n_cells; c++)
    if (map[c] >= 0)
      for (PetscInt k = dem->start[map[c]]; k < dem->start[map[c] + 1]; k++) node_of[whole->node[whole->start[c] + k - dem->start[map[c]]]] = dem->node[k];
  entries = dem->start[dem->n_cells];
  PetscCall(PetscMalloc3(dem->n_cells + m, &type, dem->n_cells + m, &cell_id, dem->n_cells + m + 1, &start));
  PetscCall(PetscMalloc1(entries + 4 * m, &node));
  PetscCall(PetscArraycpy(type, dem->type, dem->n_cells));
  PetscCall(PetscArraycpy(cell_id, dem->cell_id, dem->n_cells));
  PetscCall(PetscArraycpy(start, dem->start, dem->n_cells + 1));
  PetscCall(PetscArraycpy(node, dem->node, entries));
  PetscCall(PetscFree3(dem->type, dem->cell_id, dem->start));
  PetscCall(PetscFree(dem->node));
  dem->type    = type;
  dem->cell_id = cell_id;
  dem->start   = start;
  dem->node    = node;
  rim = &dem->group[dem->n_groups++];
  PetscCall(PetscMemzero(rim, sizeof(*rim)));
  PetscCall(PetscStrncpy(rim->name, COUPLING_RIM, sizeof(rim->name)));
  rim->dim = whole->dim - 1;
  PetscCall(PetscMalloc1(m, &rim->cell));
  for (PetscInt k = 0; k < m; k++) {
    const Side *s = &sides[pick[k]];
    PetscInt    side[6][4], size[6], c = dem->n_cells++;

    (void)Sides(whole->type[s->cell], whole->node + whole->start[s->cell], side, size);
    dem->type[c]    = size[s->side] == 2 ? MESH_LINE2 : size[s->side] == 3 ? MESH_TRI3 : MESH_QUAD4;
    dem->cell_id[c] = 0;
    for (PetscInt i = 0; i < size[s->side]; i++) dem->node[entries++] = node_of[side[s->side][i]];
    dem->start[c + 1]         = entries;
    rim->cell[rim->n_cells++] = c;
  }
  PetscCall(PetscFree(node_of));
  PetscCall(PetscFree2(sides, pick));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the cells of the named group; refuses one that is missing, of another dimension, or the whole body. */
PetscErrorCode CouplingGroupCells_Internal(const Mesh *whole, const char *name, PetscBool is_dem[])
{
  const MeshGroup *group = NULL;

  PetscFunctionBegin;
  for (PetscInt g = 0; g < whole->n_groups; g++)
    if (!strcmp(whole->group[g].name, name)) group = &whole->group[g];
  if (!group) {
    const char **names, *near;

    PetscCall(PetscMalloc1(whole->n_groups, &names));
    for (PetscInt g = 0; g < whole->n_groups; g++) names[g] = whole->group[g].name;
    near = BaseNearest(name, whole->n_groups, names);
    PetscCall(PetscFree(names));
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s has no group '%s' to fill with particles%s%s%s", whole->source, name, near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
  }
  BaseCheckInput(group->dim == whole->dim, PETSC_COMM_SELF, "Group '%s' of %s has dimension %" PetscInt_FMT "; particles fill a group of dimension %" PetscInt_FMT, name, whole->source, group->dim, whole->dim);
  for (PetscInt c = 0; c < whole->n_cells; c++) is_dem[c] = (PetscBool)(is_dem[c] || (MeshCellDim(whole->type[c]) == whole->dim && InGroup(group, c)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rings of cells around the marked ones, by shared nodes: ring [cells] 0 marked, 1 .. width, -1 beyond; reach [nodes] likewise, PETSC_MAX_INT beyond. */
PetscErrorCode CouplingRings_Internal(const Mesh *whole, const PetscBool marked[], PetscInt width, PetscInt ring[], PetscInt reach[])
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < whole->n_nodes; i++) reach[i] = PETSC_MAX_INT;
  for (PetscInt c = 0; c < whole->n_cells; c++) {
    ring[c] = -1;
    if (MeshCellDim(whole->type[c]) != whole->dim || !marked[c]) continue;
    ring[c] = 0;
    for (PetscInt k = whole->start[c]; k < whole->start[c + 1]; k++) reach[whole->node[k]] = 0;
  }
  for (PetscInt r = 1; r <= width; r++)
    for (PetscInt c = 0; c < whole->n_cells; c++) {
      PetscBool touches = PETSC_FALSE;

      if (MeshCellDim(whole->type[c]) != whole->dim || ring[c] >= 0) continue;
      for (PetscInt k = whole->start[c]; k < whole->start[c + 1]; k++) touches = (PetscBool)(touches || reach[whole->node[k]] == r - 1);
      if (!touches) continue;
      ring[c] = r;
      for (PetscInt k = whole->start[c]; k < whole->start[c + 1]; k++) reach[whole->node[k]] = PetscMin(reach[whole->node[k]], r);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds to keep[], which marks top-dimension cells, the cells of lower dimension that stand on their nodes. */
static PetscErrorCode KeepFaces(const Mesh *whole, PetscBool keep[])
{
  PetscBool *has;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(whole->n_nodes, &has));
  for (PetscInt c = 0; c < whole->n_cells; c++)
    for (PetscInt k = whole->start[c]; MeshCellDim(whole->type[c]) == whole->dim && keep[c] && k < whole->start[c + 1]; k++) has[whole->node[k]] = PETSC_TRUE;
  for (PetscInt c = 0; c < whole->n_cells; c++) {
    if (MeshCellDim(whole->type[c]) == whole->dim) continue;
    keep[c] = PETSC_TRUE;
    for (PetscInt k = whole->start[c]; k < whole->start[c + 1]; k++) keep[c] = (PetscBool)(keep[c] && has[whole->node[k]]);
  }
  PetscCall(PetscFree(has));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckTypes(const Mesh *whole)
{
  PetscFunctionBegin;
  for (PetscInt c = 0; c < whole->n_cells; c++) {
    if (MeshCellDim(whole->type[c]) != whole->dim) continue;
    const MeshCellType type = MeshCellLinear(whole->type[c]);

    BaseCheckInput(type == MESH_TRI3 || type == MESH_QUAD4 || type == MESH_TET4 || type == MESH_HEX8, PETSC_COMM_SELF,
                   "%s: element %" PetscInt_FMT " is of a type a coupled body does not cover yet; use triangles, quadrilaterals, tetrahedra or hexahedra", whole->source, whole->cell_id[c]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Particles lie in quadratic cells by their corners: those must have straight sides, with nodes in the middle. */
static PetscErrorCode CheckStraight(const Mesh *whole, const PetscInt ring[])
{
  PetscFunctionBegin;
  for (PetscInt c = 0; c < whole->n_cells; c++) {
    const PetscInt *node = whole->node + whole->start[c], corners = MeshCellCorners(whole->type[c]);

    if (MeshCellDim(whole->type[c]) != whole->dim || ring[c] < 0) continue;
    for (PetscInt a = corners; a < whole->start[c + 1] - whole->start[c]; a++) {
      PetscInt  of[8];
      const PetscInt n = MeshCellParents(whole->type[c], a, of);
      PetscReal off = 0, size = 0;

      for (PetscInt d = 0; d < 3; d++) {
        PetscReal mean = 0;

        for (PetscInt k = 0; k < n; k++) mean += whole->x[3 * node[of[k]] + d] / n;
        off += PetscSqr(whole->x[3 * node[a] + d] - mean);
        size += PetscSqr(whole->x[3 * node[of[0]] + d] - mean);
      }
      BaseCheckInput(off <= 1e-12 * size, PETSC_COMM_SELF, "%s: element %" PetscInt_FMT " has curved sides and holds particles; cells that do must be straight: mesh.order: 1, or particles away from the curved surface", whole->source, whole->cell_id[c]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* s of the nodes between corners: the corners' mean, so that the cell's own functions give the corners' s. */
static PetscErrorCode MiddleNodes(CouplingSplit *split)
{
  const Mesh *mesh = &split->fem;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < mesh->n_cells; c++)
    for (PetscInt a = MeshCellCorners(mesh->type[c]); MeshCellDim(mesh->type[c]) == mesh->dim && a < mesh->start[c + 1] - mesh->start[c]; a++) {
      PetscInt       of[8];
      const PetscInt n = MeshCellParents(mesh->type[c], a, of), i = mesh->node[mesh->start[c] + a];

      split->s[i] = 0;
      for (PetscInt k = 0; k < n; k++) split->s[i] += split->s[mesh->node[mesh->start[c] + of[k]]] / n;
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Particles alone in the marked cells. name: for messages. */
PetscErrorCode CouplingSplitCells_Internal(const Mesh *whole, const PetscBool marked[], const char *name, PetscInt width, CouplingSplit *split)
{
  PetscInt  *reach, *layer, *map, elements = 0, far = 0;
  PetscBool *keep;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(split, sizeof(*split)));
  BaseCheckInput(width >= 1, PETSC_COMM_SELF, "The overlap must be at least one element wide, not %" PetscInt_FMT, width);
  PetscCall(CheckTypes(whole));
  split->dim = whole->dim;
  PetscCall(PetscMalloc4(whole->n_nodes, &reach, whole->n_cells, &layer, whole->n_cells, &map, whole->n_cells, &keep));
  PetscCall(CouplingRings_Internal(whole, marked, width, layer, reach));
  PetscCall(CheckStraight(whole, layer));
  for (PetscInt c = 0; c < whole->n_cells; c++) {
    if (MeshCellDim(whole->type[c]) != whole->dim) continue;
    elements += layer[c] != 0;
    far += layer[c] < 0;
  }
  BaseCheckInput(elements > 0, PETSC_COMM_SELF, "Group '%s' is the whole body: nothing is left for elements; use method: dem", name);
  BaseCheckInput(far > 0, PETSC_COMM_SELF, "The overlap, %" PetscInt_FMT " elements wide, swallows the whole far field of '%s'; use smaller elements or a narrower overlap", width, name);

  for (PetscInt pass = 0; pass < 2; pass++) { /* elements, then particles */
    for (PetscInt c = 0; c < whole->n_cells; c++) keep[c] = (PetscBool)(MeshCellDim(whole->type[c]) == whole->dim && (pass == 0 ? layer[c] != 0 : layer[c] >= 0));
    PetscCall(KeepFaces(whole, keep));
    PetscCall(SubMesh(whole, keep, (PetscBool)(pass == 1), pass == 0 ? &split->fem : &split->dem, map));
    if (pass == 0) {
      PetscCall(PetscMalloc2(split->fem.n_cells, &split->layer, split->fem.n_cells, &split->cell));
      PetscCall(PetscMalloc2(split->fem.n_nodes, &split->s, split->fem.n_nodes, &split->node));
      for (PetscInt c = 0; c < whole->n_cells; c++) {
        if (map[c] < 0) continue;
        if (MeshCellDim(whole->type[c]) == whole->dim) {
          split->cell[split->n_cells]    = c;
          split->layer[split->n_cells++] = PetscMax(layer[c], 0);
        }
        for (PetscInt k = whole->start[c]; k < whole->start[c + 1]; k++) {
          const PetscInt i = split->fem.node[split->fem.start[map[c]] + k - whole->start[c]];

          split->s[i]    = PetscMin(1, (PetscReal)PetscMin(reach[whole->node[k]], width) / width);
          split->node[i] = whole->node[k];
        }
      }
      PetscCall(MiddleNodes(split));
    } else {
      for (PetscInt c = 0; c < whole->n_cells; c++) keep[c] = (PetscBool)(map[c] >= 0);
      PetscCall(AddRim(whole, keep, map, &split->dem));
    }
  }
  PetscCall(PetscFree4(reach, layer, map, keep));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mesh of the marked cells and `width` rings around them, with the face COUPLING_RIM where the body goes on. */
PetscErrorCode CouplingRegion_Internal(const Mesh *whole, const PetscBool marked[], PetscInt width, Mesh *region)
{
  PetscInt  *reach, *ring, *map;
  PetscBool *keep;

  PetscFunctionBegin;
  PetscCall(CheckTypes(whole));
  PetscCall(PetscMalloc4(whole->n_nodes, &reach, whole->n_cells, &ring, whole->n_cells, &map, whole->n_cells, &keep));
  PetscCall(CouplingRings_Internal(whole, marked, width, ring, reach));
  for (PetscInt c = 0; c < whole->n_cells; c++) keep[c] = (PetscBool)(ring[c] >= 0);
  PetscCall(KeepFaces(whole, keep));
  PetscCall(SubMesh(whole, keep, PETSC_TRUE, region, map));
  for (PetscInt c = 0; c < whole->n_cells; c++) keep[c] = (PetscBool)(map[c] >= 0);
  PetscCall(AddRim(whole, keep, map, region));
  PetscCall(PetscFree4(reach, ring, map, keep));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSplitCreate(const Mesh *whole, const char *name, PetscInt width, CouplingSplit *split)
{
  PetscBool *marked;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(whole->n_cells, &marked));
  PetscCall(CouplingGroupCells_Internal(whole, name, marked));
  PetscCall(CouplingSplitCells_Internal(whole, marked, name, width, split));
  PetscCall(PetscFree(marked));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSplitDestroy(CouplingSplit *split)
{
  PetscFunctionBegin;
  PetscCall(MeshDestroy(&split->fem));
  PetscCall(MeshDestroy(&split->dem));
  PetscCall(PetscFree2(split->layer, split->cell));
  PetscCall(PetscFree2(split->s, split->node));
  PetscFunctionReturn(PETSC_SUCCESS);
}
