/* mesh.c - what holds for any mesh, wherever it came from: cell types, group look-up, freeing. */
#include "mesh.h"

/* gmsh's element types 1..18: dimension, nodes, corners, the linear cell of the same corners, and for each further node the corners whose middle it is. */
static const struct {
  PetscInt     dim, nodes, corners;
  MeshCellType linear;
  const char  *middle;
} cell_table[19] = {
  {-1, 0, 0, (MeshCellType)0, ""},
  {1, 2, 2, MESH_LINE2, ""},
  {2, 3, 3, MESH_TRI3, ""},
  {2, 4, 4, MESH_QUAD4, ""},
  {3, 4, 4, MESH_TET4, ""},
  {3, 8, 8, MESH_HEX8, ""},
  {3, 6, 6, MESH_PRISM6, ""},
  {3, 5, 5, MESH_PYRAMID5, ""},
  {1, 3, 2, MESH_LINE2, "01"},
  {2, 6, 3, MESH_TRI3, "01 12 02"},
  {2, 9, 4, MESH_QUAD4, "01 12 23 03 0123"},
  {3, 10, 4, MESH_TET4, "01 12 02 03 23 13"},
  {3, 27, 8, MESH_HEX8, "01 03 04 12 15 23 26 37 45 47 56 67 0123 0145 0347 1256 2367 4567 01234567"},
  {3, 18, 6, MESH_PRISM6, "01 02 03 12 14 25 34 35 45 0134 0235 1245"},
  {3, 14, 5, MESH_PYRAMID5, "01 03 04 12 14 23 24 34 0123"},
  {0, 1, 1, MESH_POINT, ""},
  {2, 8, 4, MESH_QUAD4, "01 12 23 03"},
  {3, 20, 8, MESH_HEX8, "01 03 04 12 15 23 26 37 45 47 56 67"},
  {3, 15, 6, MESH_PRISM6, "01 02 03 12 14 25 34 35 45"},
};

PetscInt MeshCellDim(MeshCellType type)
{
  return (int)type < 1 || (int)type > 18 ? -1 : cell_table[type].dim;
}

PetscInt MeshCellNodes(MeshCellType type)
{
  return (int)type < 1 || (int)type > 18 ? 0 : cell_table[type].nodes;
}

PetscInt MeshCellCorners(MeshCellType type)
{
  return (int)type < 1 || (int)type > 18 ? 0 : cell_table[type].corners;
}

PetscInt MeshCellParents(MeshCellType type, PetscInt a, PetscInt corner[8])
{
  const PetscInt corners = MeshCellCorners(type);
  const char    *c       = (int)type < 1 || (int)type > 18 ? "" : cell_table[type].middle;
  PetscInt       n       = 0;

  if (a < corners) {
    corner[0] = a;
    return 1;
  }
  for (PetscInt k = corners; k < a; k++) { /* the word of node a */
    while (*c && *c != ' ') c++;
    if (*c) c++;
  }
  for (; *c && *c != ' '; c++) corner[n++] = *c - '0';
  return n;
}

MeshCellType MeshCellLinear(MeshCellType type)
{
  return (int)type < 1 || (int)type > 18 ? (MeshCellType)0 : cell_table[type].linear;
}

MeshCellType MeshCellQuadratic(MeshCellType type, PetscBool incomplete)
{
  switch (MeshCellLinear(type)) {
  case MESH_LINE2: return MESH_LINE3;
  case MESH_TRI3: return MESH_TRI6;
  case MESH_QUAD4: return incomplete ? MESH_QUAD8 : MESH_QUAD9;
  case MESH_TET4: return MESH_TET10;
  case MESH_HEX8: return incomplete ? MESH_HEX20 : MESH_HEX27;
  case MESH_PRISM6: return incomplete ? MESH_PRISM15 : MESH_PRISM18;
  default: return type;
  }
}

PetscErrorCode MeshFindGroup(const Mesh *mesh, const char *name, const MeshGroup **group)
{
  PetscBool same;

  PetscFunctionBegin;
  *group = NULL;
  for (PetscInt g = 0; g < mesh->n_groups; g++) {
    PetscCall(PetscStrcmp(mesh->group[g].name, name, &same));
    if (same) *group = &mesh->group[g];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MeshShare(MPI_Comm comm, Mesh *mesh)
{
  PetscMPIInt rank, size;
  PetscInt    nodes;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Bcast(mesh->source, BASE_LINE, MPI_CHAR, 0, comm));
  PetscCallMPI(MPI_Bcast(&mesh->dim, 1, MPIU_INT, 0, comm));
  PetscCallMPI(MPI_Bcast(&mesh->n_nodes, 1, MPIU_INT, 0, comm));
  PetscCallMPI(MPI_Bcast(&mesh->n_cells, 1, MPIU_INT, 0, comm));
  PetscCallMPI(MPI_Bcast(&mesh->n_groups, 1, MPIU_INT, 0, comm));
  nodes = rank ? 0 : mesh->start[mesh->n_cells];
  PetscCallMPI(MPI_Bcast(&nodes, 1, MPIU_INT, 0, comm));
  if (rank) {
    PetscCall(PetscMalloc2(3 * mesh->n_nodes, &mesh->x, mesh->n_nodes, &mesh->id));
    PetscCall(PetscMalloc3(mesh->n_cells, &mesh->type, mesh->n_cells, &mesh->cell_id, mesh->n_cells + 1, &mesh->start));
    PetscCall(PetscMalloc1(nodes, &mesh->node));
    PetscCall(PetscCalloc1(mesh->n_groups, &mesh->group));
  }
  PetscCallMPI(MPI_Bcast(mesh->x, (PetscMPIInt)(3 * mesh->n_nodes), MPIU_REAL, 0, comm));
  PetscCallMPI(MPI_Bcast(mesh->id, (PetscMPIInt)mesh->n_nodes, MPIU_INT, 0, comm));
  PetscCallMPI(MPI_Bcast(mesh->type, (PetscMPIInt)(mesh->n_cells * (PetscInt)sizeof(*mesh->type)), MPI_BYTE, 0, comm));
  PetscCallMPI(MPI_Bcast(mesh->cell_id, (PetscMPIInt)mesh->n_cells, MPIU_INT, 0, comm));
  PetscCallMPI(MPI_Bcast(mesh->start, (PetscMPIInt)(mesh->n_cells + 1), MPIU_INT, 0, comm));
  PetscCallMPI(MPI_Bcast(mesh->node, (PetscMPIInt)nodes, MPIU_INT, 0, comm));
  for (PetscInt g = 0; g < mesh->n_groups; g++) {
    MeshGroup *group = &mesh->group[g];

    PetscCallMPI(MPI_Bcast(group->name, (PetscMPIInt)sizeof(group->name), MPI_CHAR, 0, comm));
    PetscCallMPI(MPI_Bcast(&group->dim, 1, MPIU_INT, 0, comm));
    PetscCallMPI(MPI_Bcast(&group->n_cells, 1, MPIU_INT, 0, comm));
    if (rank) PetscCall(PetscMalloc1(group->n_cells, &group->cell));
    PetscCallMPI(MPI_Bcast(group->cell, (PetscMPIInt)group->n_cells, MPIU_INT, 0, comm));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MeshDestroy(Mesh *mesh)
{
  PetscFunctionBegin;
  for (PetscInt g = 0; g < mesh->n_groups; g++) PetscCall(PetscFree(mesh->group[g].cell));
  PetscCall(PetscFree(mesh->group));
  PetscCall(PetscFree2(mesh->x, mesh->id));
  PetscCall(PetscFree3(mesh->type, mesh->cell_id, mesh->start));
  PetscCall(PetscFree(mesh->node));
  PetscCall(PetscMemzero(mesh, sizeof(*mesh)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
