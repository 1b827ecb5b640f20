/*
  mesh_box.c - structured meshes of a box.

  Nodes run x fastest, then y, then z. A rectangle is cut into triangles along one diagonal, a block into the six
  tetrahedra that share its main diagonal (Kuhn), or into two prisms, so neighbouring blocks meet face to face. Quadratic
  cells take the points of a lattice twice as fine; points no cell uses are left out.
*/
#include "mesh.h"

/* Corners of a hexahedron in gmsh's order, as steps in x, y, z. */
static const PetscInt corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
static const PetscInt whole[8]     = {0, 1, 2, 3, 4, 5, 6, 7};
static const PetscInt half[2][3]   = {{0, 1, 2}, {0, 2, 3}};
static const PetscInt prism[2][6]  = {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 4, 6, 7}};
/* The six paths from corner 0 to corner 6 along edges, each a tetrahedron of positive volume. */
static const PetscInt kuhn[6][4] = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6}, {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};
/* Faces of the box as corners of the hexahedron, seen from outside; triangles of kuhn[] and prism[] use diagonals from corner 0 or 6. */
static const PetscInt    face3[6][4] = {{0, 4, 7, 3}, {6, 5, 1, 2}, {0, 1, 5, 4}, {6, 2, 3, 7}, {0, 3, 2, 1}, {6, 7, 4, 5}};
static const PetscInt    face2[4][2] = {{3, 0}, {1, 2}, {0, 1}, {2, 3}};
static const char *const side[6]     = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};

typedef struct {
  Mesh        *mesh;
  MeshCellType linear;
  PetscBool    quadratic, incomplete;
  PetscInt     n[3], dim;
  PetscInt     step;    /* lattice points per cell: 1 or 2 */
  PetscInt     entries; /* of mesh->node so far */
} Builder;

/* corners: of the block, the cell's own in gmsh's order; its other nodes lie between them. */
static void AddCell(Builder *b, MeshGroup *group, MeshCellType linear, const PetscInt at[3], const PetscInt corners[])
{
  Mesh              *m     = b->mesh;
  const MeshCellType type  = b->quadratic ? MeshCellQuadratic(linear, b->incomplete) : linear;
  const PetscInt     nodes = MeshCellNodes(type), c = m->n_cells++;

  m->type[c]    = type;
  m->cell_id[c] = c + 1;
  m->start[c]   = b->entries;
  for (PetscInt a = 0; a < nodes; a++) {
    PetscInt parent[8], point[3];
    const PetscInt parents = MeshCellParents(type, a, parent);

    for (PetscInt d = 0; d < 3; d++) {
      point[d] = 0;
      for (PetscInt k = 0; k < parents; k++) point[d] += corner[corners[parent[k]]][d];
      point[d] = d < b->dim ? b->step * at[d] + b->step * point[d] / parents : 0;
    }
    m->node[b->entries++] = point[0] + (b->step * b->n[0] + 1) * (point[1] + (b->step * b->n[1] + 1) * point[2]);
  }
  m->start[c + 1]               = b->entries;
  group->cell[group->n_cells++] = c;
}

/* Triangles on side direction d of a block: 2 where the cells' sides are halves, else 1 for a whole side. */
static PetscInt PerSide(const Builder *b, PetscInt d)
{
  return b->linear == MESH_TET4 || (b->linear == MESH_PRISM6 && d == 2) ? 2 : 1;
}

/* Points of the lattice that some cell uses, in order. */
static PetscErrorCode DropUnused(Builder *b)
{
  Mesh     *m = b->mesh;
  PetscInt *number, nodes = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes, &number));
  for (PetscInt k = 0; k < b->entries; k++) number[m->node[k]] = 1;
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    if (!number[i]) continue;
    for (PetscInt d = 0; d < 3; d++) m->x[3 * nodes + d] = m->x[3 * i + d];
    m->id[nodes] = nodes + 1;
    number[i]    = nodes++;
  }
  for (PetscInt k = 0; k < b->entries; k++) m->node[k] = number[m->node[k]];
  m->n_nodes = nodes;
  PetscCall(PetscFree(number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void AddSide(Builder *b, MeshGroup *group, PetscInt f, const PetscInt at[3])
{
  const PetscInt *q         = face3[f];
  const PetscInt  two[2][3] = {{q[0], q[1], q[2]}, {q[0], q[2], q[3]}};

  if (b->dim == 2) AddCell(b, group, MESH_LINE2, at, face2[f]);
  else if (PerSide(b, f / 2) == 1) AddCell(b, group, MESH_QUAD4, at, q);
  else {
    AddCell(b, group, MESH_TRI3, at, two[0]);
    AddCell(b, group, MESH_TRI3, at, two[1]);
  }
}

static PetscErrorCode BoxBuild(const char *name, MeshCellType type, const PetscReal origin[3], const PetscReal length[3], const PetscInt n[3], Mesh *mesh)
{
  const PetscInt dim = MeshCellDim(type), nz = dim == 3 ? n[2] : 0, sides = 2 * dim;
  Builder        b   = {mesh, MeshCellLinear(type), type != MeshCellLinear(type), type != MeshCellQuadratic(type, PETSC_FALSE), {n[0], n[1], nz}, dim, 1, 0};
  const PetscInt per  = b.linear == MESH_TET4 ? 6 : b.linear == MESH_TRI3 || b.linear == MESH_PRISM6 ? 2 : 1;
  const PetscInt body = n[0] * n[1] * PetscMax(nz, 1) * per;
  PetscInt       cells = body, nodes = 0, across[3] = {0, 0, 0}, widest, count[3];

  PetscFunctionBegin;
  b.step = b.quadratic ? 2 : 1;
  for (PetscInt d = 0; d < dim; d++) {
    across[d] = PerSide(&b, d) * (d == 0 ? 1 : n[0]) * (d == 1 ? 1 : n[1]) * (d == 2 || dim == 2 ? 1 : nz);
    cells += 2 * across[d];
  }
  for (PetscInt d = 0; d < 3; d++) count[d] = b.step * b.n[d];
  mesh->dim     = dim;
  mesh->n_nodes = (count[0] + 1) * (count[1] + 1) * (count[2] + 1);
  PetscCall(PetscSNPrintf(mesh->source, sizeof(mesh->source), "box '%s'", name));
  PetscCall(PetscMalloc2(3 * mesh->n_nodes, &mesh->x, mesh->n_nodes, &mesh->id));
  for (PetscInt k = 0; k <= count[2]; k++)
    for (PetscInt j = 0; j <= count[1]; j++)
      for (PetscInt i = 0; i <= count[0]; i++, nodes++) {
        mesh->x[3 * nodes]     = origin[0] + length[0] * i / count[0];
        mesh->x[3 * nodes + 1] = origin[1] + length[1] * j / count[1];
        mesh->x[3 * nodes + 2] = dim == 3 ? origin[2] + length[2] * k / count[2] : 0;
        mesh->id[nodes]        = nodes + 1;
      }
  PetscCall(PetscMalloc3(cells, &mesh->type, cells, &mesh->cell_id, cells + 1, &mesh->start));
  PetscCall(PetscMalloc1((size_t)MeshCellNodes(type) * cells, &mesh->node));
  widest         = PetscMax(across[0], PetscMax(across[1], across[2]));
  mesh->n_groups = sides + 1;
  PetscCall(PetscCalloc1(mesh->n_groups, &mesh->group));
  for (PetscInt g = 0; g <= sides; g++) { /* sides come first: groups are sorted by dimension, then name */
    MeshGroup *group = &mesh->group[g];

    PetscCall(PetscStrncpy(group->name, g < sides ? side[0] : name, sizeof(group->name)));
    group->dim = g < sides ? dim - 1 : dim;
    PetscCall(PetscMalloc1((g < sides ? widest : body), &group->cell));
  }
  for (PetscInt d = 0; d < dim; d++) /* sorted: xmax before xmin */
    for (PetscInt s = 0; s < 2; s++) {
      const PetscInt f     = 2 * d + s;
      MeshGroup     *group = &mesh->group[2 * d + (1 - s)];
      PetscInt       lo[3] = {0, 0, 0}, hi[3] = {n[0], n[1], PetscMax(nz, 1)}, at[3];

      PetscCall(PetscStrncpy(group->name, side[f], sizeof(group->name)));
      lo[d] = s ? hi[d] - 1 : 0;
      hi[d] = lo[d] + 1;
      for (at[2] = lo[2]; at[2] < hi[2]; at[2]++)
        for (at[1] = lo[1]; at[1] < hi[1]; at[1]++)
          for (at[0] = lo[0]; at[0] < hi[0]; at[0]++) AddSide(&b, group, f, at);
    }
  for (PetscInt k = 0; k < PetscMax(nz, 1); k++)
    for (PetscInt j = 0; j < n[1]; j++)
      for (PetscInt i = 0; i < n[0]; i++) {
        const PetscInt at[3] = {i, j, k};

        for (PetscInt p = 0; p < per; p++) AddCell(&b, &mesh->group[sides], b.linear, at, b.linear == MESH_TRI3 ? half[p] : b.linear == MESH_TET4 ? kuhn[p] : b.linear == MESH_PRISM6 ? prism[p] : whole);
      }
  if (b.quadratic) PetscCall(DropUnused(&b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MeshCreateBox(MPI_Comm comm, const char *name, MeshCellType type, const PetscReal origin[3], const PetscReal length[3], const PetscInt n[3], Mesh *mesh)
{
  const PetscInt dim = MeshCellDim(type), step = type == MeshCellLinear(type) ? 1 : 2;
  PetscMPIInt    rank;
  PetscReal      cells = 8;

  PetscFunctionBegin;
  PetscCheck(dim >= 2 && MeshCellLinear(type) != MESH_PYRAMID5, comm, PETSC_ERR_ARG_OUTOFRANGE, "A box is meshed with triangles, quadrilaterals, tetrahedra, hexahedra or prisms, not with gmsh type %d", (int)type);
  for (PetscInt d = 0; d < dim; d++) {
    BaseCheckInput(n[d] > 0, comm, "A box needs at least one cell along %c, not %" PetscInt_FMT, "xyz"[d], n[d]);
    BaseCheckInput(length[d] > 0 && !PetscIsInfOrNanReal(length[d]), comm, "The box is %g m long along %c; lengths must be positive", (double)length[d], "xyz"[d]);
    cells *= 6 * step * (n[d] + 1.0);
  }
  BaseCheckInput(cells < 108.0 * PETSC_MAX_INT, comm, "A box of so many cells does not fit 32-bit indices; make the cells larger");
  PetscCall(PetscMemzero(mesh, sizeof(*mesh)));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) PetscCall(BoxBuild(name, type, origin, length, n, mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}
