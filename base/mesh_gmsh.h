/* mesh_gmsh.h - gmsh's session, shared by the files that draw and read through it. */
#pragma once
#include "mesh.h"

/* Draws a model and its physical groups; `what` names it in words, which stay empty when all is well. gmsh is initialised. */
typedef PetscErrorCode (*MeshDraw)(const void *ctx, const char *what, const MeshOptions *options, char words[BASE_LINE]);

/* A file (draw NULL), or what draw draws: meshed, read, checked. Collective; rank 0 works. */
PetscErrorCode MeshFromGmsh_Internal(MPI_Comm comm, const char *file, MeshDraw draw, const void *ctx, const MeshOptions *options, Mesh *mesh);
/* gmsh's own last words: it could not `what` the file. */
void MeshGmshWords_Internal(char words[BASE_LINE], const char *what, const char *file);
