/* fem_body.h - the finite elements of a mesh on rank 0: cells of top dimension and the nodes they use, checked. */
#pragma once
#include "mesh.h"

typedef struct FemBody {
  PetscInt  n_cells;
  PetscInt *cell;  /* [n_cells] index into the mesh */
  PetscInt *start; /* [n_cells + 1] */
  PetscInt *node;  /* body nodes; a plane cell that ran clockwise is turned round */
  PetscInt  n_nodes;
  PetscInt *old;        /* [n_nodes] index into the mesh, ascending */
  PetscInt *number;     /* [mesh nodes] body node, or -1 */
  PetscInt *star_start; /* [n_nodes + 1] */
  PetscInt *star;       /* cells that use a node, ascending */
} FemBody;

/* words is left empty when all is well. */
PetscErrorCode FemBodyCreate(const Mesh *mesh, FemBody *body, char words[BASE_LINE]);
PetscErrorCode FemBodyDestroy(FemBody *body);

/* Body cells (at most two are kept) of which the given nodes, as mesh nodes, are a side; side of the first. Returns how many there are. */
PetscInt FemBodyFindSide(const Mesh *mesh, const FemBody *body, PetscInt n, const PetscInt node[], PetscInt cell[2], PetscInt *side);
