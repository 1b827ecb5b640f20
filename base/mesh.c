/* mesh.c - what holds for any mesh, wherever it came from: cell types, group look-up, freeing. */
#include "mesh.h"

/* gmsh's element types 1..18: dimension, nodes, corners. */
static const struct {
  PetscInt dim, nodes, corners;
} cell_table[19] = {
  {-1, 0, 0}, {1, 2, 2}, {2, 3, 3}, {2, 4, 4}, {3, 4, 4}, {3, 8, 8}, {3, 6, 6}, {3, 5, 5}, {1, 3, 2}, {2, 6, 3}, {2, 9, 4}, {3, 10, 4}, {3, 27, 8}, {3, 18, 6}, {3, 14, 5}, {0, 1, 1}, {2, 8, 4}, {3, 20, 8}, {3, 15, 6},
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
