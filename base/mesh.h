/*
  mesh.h - a gmsh mesh as plain arrays: nodes, cells of every dimension, named groups.

  Read through the gmsh C API (a .geo is meshed, a .msh is read); fem turns it into a DMPlex, dem into convex pieces.
  Rank 0 reads; the struct is empty on other ranks.
*/
#pragma once
#include "base.h"

/* Numbers are gmsh's element types, so a reader of either code recognises them. */
typedef enum {
  MESH_LINE2 = 1, MESH_TRI3 = 2, MESH_QUAD4 = 3, MESH_TET4 = 4, MESH_HEX8 = 5, MESH_PRISM6 = 6, MESH_PYRAMID5 = 7,
  MESH_LINE3 = 8, MESH_TRI6 = 9, MESH_QUAD9 = 10, MESH_TET10 = 11, MESH_HEX27 = 12, MESH_PRISM18 = 13, MESH_PYRAMID14 = 14,
  MESH_POINT = 15, MESH_QUAD8 = 16, MESH_HEX20 = 17, MESH_PRISM15 = 18
} MeshCellType;

typedef struct {
  char      name[128]; /* physical name */
  PetscInt  dim;       /* 0 point .. 3 volume */
  PetscInt  n_cells;
  PetscInt *cell; /* [n_cells] indices into the mesh's cells, ascending */
} MeshGroup;

typedef struct {
  char          source[BASE_LINE]; /* file it came from, for messages */
  PetscInt      dim;               /* largest cell dimension present: 2 or 3 */
  PetscInt      n_nodes;
  PetscReal    *x;  /* [n_nodes][3] coordinates [m] */
  PetscInt     *id; /* [n_nodes] gmsh's own node tag, for messages */
  PetscInt      n_cells;
  MeshCellType *type;    /* [n_cells] */
  PetscInt     *cell_id; /* [n_cells] gmsh's own element tag, for messages */
  PetscInt     *start;   /* [n_cells + 1] first entry in node[] */
  PetscInt     *node;    /* [start[n_cells]] node indices, gmsh's order within a cell */
  PetscInt      n_groups;
  MeshGroup    *group; /* [n_groups] sorted by dim, then name */
} Mesh;

typedef struct {
  PetscInt  dimension; /* of the mesh to make from a .geo: 2 or 3 */
  PetscReal size;      /* target element size [m]; 0 = what the .geo says */
  PetscInt  order;     /* 1 or 2 */
  PetscReal scale;     /* metres per length unit of the file; 1 = file in metres */
  PetscBool facets;    /* `dimension` is that of a surface or curve to touch (2 or 1): what the file has above it is left out */
  PetscBool quads;     /* recombine triangles to quadrilaterals, subdivide to hexahedra when transfinite */
  PetscBool incomplete; /* order 2 without nodes inside sides and cells: quad8, hex20, prism15 */
} MeshOptions;

/*
  MeshRead - mesh a .geo or read a .msh (4.1, any gmsh can read)

  Collective; rank 0 works. Errors: PETSC_ERR_USER_INPUT for a missing, cut or empty file, a model without a
  top-dimension cell, a group name that names two dimensions.
*/
PetscErrorCode MeshRead(MPI_Comm comm, const char *file, const MeshOptions *options, Mesh *mesh);

/* Structured meshes of a box: cells of `type` (any with straight sides but pyramids), n[] per direction; side groups
   "xmin" .. "zmax" and the body group `name`. */
PetscErrorCode MeshCreateBox(MPI_Comm comm, const char *name, MeshCellType type, const PetscReal origin[3], const PetscReal length[3], const PetscInt n[3], Mesh *mesh);

/* A disc in x, y with the group "side" (options: dimension 2), or a cylinder along z with "bottom", "top", "side" (3), of the body group
   `name`; centre: of the disc or the bottom. By gmsh, as options say; size is needed. quads: a cylinder is drawn as layers, but gmsh may still fill it with tetrahedra. */
PetscErrorCode MeshCreateRound(MPI_Comm comm, const char *name, const PetscReal centre[3], PetscReal radius, PetscReal height, const MeshOptions *options, Mesh *mesh);

PetscErrorCode MeshShare(MPI_Comm comm, Mesh *mesh); /* rank 0's, on all ranks */
PetscErrorCode MeshFindGroup(const Mesh *mesh, const char *name, const MeshGroup **group); /* NULL when absent */
PetscErrorCode MeshDestroy(Mesh *mesh);

PetscInt MeshCellDim(MeshCellType type);
PetscInt MeshCellNodes(MeshCellType type);   /* all nodes */
PetscInt MeshCellCorners(MeshCellType type); /* corner nodes, which come first */
/* Corners whose middle node a is in a straight cell, ascending (a corner is its own); returns how many. */
PetscInt     MeshCellParents(MeshCellType type, PetscInt a, PetscInt corner[8]);
MeshCellType MeshCellLinear(MeshCellType type);                             /* the linear cell of the same corners */
MeshCellType MeshCellQuadratic(MeshCellType type, PetscBool incomplete);    /* the quadratic one; incomplete: without nodes in sides and middles */
