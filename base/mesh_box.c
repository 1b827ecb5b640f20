/*
  mesh_box.c - structured meshes of a box.

  Nodes run x fastest, then y, then z. A rectangle is cut into triangles along one diagonal, a block into the six
  tetrahedra that share its main diagonal (Kuhn), so neighbouring blocks meet face to face.
*/
#include "mesh.h"

/* Corners of a hexahedron in gmsh's order, as steps in x, y, z. */
static const PetscInt corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
/* The six paths from corner 0 to corner 6 along edges, each a tetrahedron of positive volume. */
static const PetscInt kuhn[6][4] = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6}, {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};
/* Faces of the box as corners of the hexahedron, seen from outside; the triangles of kuhn[] use diagonals from corner 0 or 6. */
static const PetscInt    face3[6][4] = {{0, 4, 7, 3}, {6, 5, 1, 2}, {0, 1, 5, 4}, {6, 2, 3, 7}, {0, 3, 2, 1}, {6, 7, 4, 5}};
static const PetscInt    face2[4][2] = {{3, 0}, {1, 2}, {0, 1}, {2, 3}};
static const char *const side[6]     = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};

typedef struct {
  Mesh    *mesh;
  PetscInt n[3], dim;
  PetscInt entries; /* of mesh->node so far */
} Builder;

static PetscInt NodeAt(const Builder *b, const PetscInt cell[3], PetscInt c)
{
  return cell[0] + corner[c][0] + (b->n[0] + 1) * (cell[1] + corner[c][1] + (b->n[1] + 1) * (cell[2] + (b->dim == 3 ? corner[c][2] : 0)));
}

static void AddCell(Builder *b, MeshGroup *group, MeshCellType type, const PetscInt at[3], const PetscInt corners[])
{
  Mesh          *m     = b->mesh;
  const PetscInt nodes = MeshCellNodes(type), c = m->n_cells++;

  m->type[c]    = type;
  m->cell_id[c] = c + 1;
  m->start[c]   = b->entries;
  for (PetscInt a = 0; a < nodes; a++) m->node[b->entries++] = NodeAt(b, at, corners[a]);
  m->start[c + 1]               = b->entries;
  group->cell[group->n_cells++] = c;
}

static PetscErrorCode BoxBuild(const char *name, MeshCellType type, const PetscReal origin[3], const PetscReal length[3], const PetscInt n[3], Mesh *mesh)
{
  static const PetscInt hex[8] = {0, 1, 2, 3, 4, 5, 6, 7}, quad[4] = {0, 1, 2, 3}, half[2][3] = {{0, 1, 2}, {0, 2, 3}};
  const PetscInt        dim = MeshCellDim(type), nz = dim == 3 ? n[2] : 0, sides = 2 * dim;
  const PetscInt        per = type == MESH_TET4 ? 6 : type == MESH_TRI3 ? 2 : 1, tris = type == MESH_TET4 ? 2 : 1;
  const PetscInt        body = n[0] * n[1] * PetscMax(nz, 1) * per;
  Builder               b    = {mesh, {n[0], n[1], nz}, dim, 0};
  PetscInt              cells = body, nodes = 0, across[3] = {0, 0, 0}, widest;

  PetscFunctionBegin;
  for (PetscInt d = 0; d < dim; d++) {
    across[d] = tris * (d == 0 ? 1 : n[0]) * (d == 1 ? 1 : n[1]) * (d == 2 || dim == 2 ? 1 : nz);
    cells += 2 * across[d];
  }
  mesh->dim     = dim;
  mesh->n_nodes = (n[0] + 1) * (n[1] + 1) * (nz + 1);
  PetscCall(PetscSNPrintf(mesh->source, sizeof(mesh->source), "box '%s'", name));
  PetscCall(PetscMalloc2(3 * mesh->n_nodes, &mesh->x, mesh->n_nodes, &mesh->id));
  for (PetscInt k = 0; k <= nz; k++)
    for (PetscInt j = 0; j <= n[1]; j++)
      for (PetscInt i = 0; i <= n[0]; i++, nodes++) {
        mesh->x[3 * nodes]     = origin[0] + length[0] * i / n[0];
        mesh->x[3 * nodes + 1] = origin[1] + length[1] * j / n[1];
        mesh->x[3 * nodes + 2] = dim == 3 ? origin[2] + length[2] * k / nz : 0;
        mesh->id[nodes]        = nodes + 1;
      }
  PetscCall(PetscMalloc3(cells, &mesh->type, cells, &mesh->cell_id, cells + 1, &mesh->start));
  PetscCall(PetscMalloc1(8 * cells, &mesh->node));
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
          for (at[0] = lo[0]; at[0] < hi[0]; at[0]++) {
            if (dim == 2) AddCell(&b, group, MESH_LINE2, at, face2[f]);
            else if (type == MESH_HEX8) AddCell(&b, group, MESH_QUAD4, at, face3[f]);
            else {
              const PetscInt *q         = face3[f];
              const PetscInt  two[2][3] = {{q[0], q[1], q[2]}, {q[0], q[2], q[3]}};

              AddCell(&b, group, MESH_TRI3, at, two[0]);
              AddCell(&b, group, MESH_TRI3, at, two[1]);
            }
          }
    }
  for (PetscInt k = 0; k < PetscMax(nz, 1); k++)
    for (PetscInt j = 0; j < n[1]; j++)
      for (PetscInt i = 0; i < n[0]; i++) {
        const PetscInt at[3] = {i, j, k};

        for (PetscInt p = 0; p < per; p++) AddCell(&b, &mesh->group[sides], type, at, type == MESH_HEX8 ? hex : type == MESH_QUAD4 ? quad : type == MESH_TRI3 ? half[p] : kuhn[p]);
      }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MeshCreateBox(MPI_Comm comm, const char *name, MeshCellType type, const PetscReal origin[3], const PetscReal length[3], const PetscInt n[3], Mesh *mesh)
{
  const PetscInt dim = MeshCellDim(type);
  PetscMPIInt    rank;
  PetscReal      cells = 8;

  PetscFunctionBegin;
  PetscCheck(type == MESH_TRI3 || type == MESH_QUAD4 || type == MESH_TET4 || type == MESH_HEX8, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "A box is meshed with TRI3, QUAD4, TET4 or HEX8, not with gmsh type %d", (int)type);
  for (PetscInt d = 0; d < dim; d++) {
    BaseCheckInput(n[d] > 0, comm, "A box needs at least one cell along %c, not %" PetscInt_FMT, "xyz"[d], n[d]);
    BaseCheckInput(length[d] > 0 && !PetscIsInfOrNanReal(length[d]), comm, "The box is %g m long along %c; lengths must be positive", (double)length[d], "xyz"[d]);
    cells *= 6 * (n[d] + 1.0);
  }
  BaseCheckInput(cells < 108.0 * PETSC_MAX_INT, comm, "A box of so many cells does not fit 32-bit indices; make the cells larger");
  PetscCall(PetscMemzero(mesh, sizeof(*mesh)));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) PetscCall(BoxBuild(name, type, origin, length, n, mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}
