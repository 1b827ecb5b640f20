/* body_cases.h - small meshes built by hand for the tests of bodies, packings and cells. */
#pragma once
#include "dem_body.h"
#include <stdlib.h>

typedef PetscBool (*KeepCell)(PetscInt i, PetscInt j, PetscInt k);

static inline PetscBool KeepAll(PetscInt i, PetscInt j, PetscInt k) { return PETSC_TRUE; }

/*
  GridMesh - a block of m[0] x m[1] (x m[2]) cells of side h, QUAD4 or HEX8, less those that `keep` refuses

  crack > 0: nodes on the column i = crack, in rows j < crack_top, are doubled, so cells left and right of it part.
  Groups: "all" (cells), "left" (facets at x = 0).
*/
static inline PetscErrorCode GridMesh(PetscInt dim, const PetscInt m[3], PetscReal h, KeepCell keep, PetscInt crack, PetscInt crack_top, Mesh *mesh)
{
  const PetscInt mz = dim == 3 ? m[2] : 0, row = m[0] + 1, layer = row * (m[1] + 1), n = layer * (mz + 1), corners = dim == 3 ? 8 : 4;
  const PetscInt cells = m[0] * m[1] * PetscMax(1, mz), sides = m[1] * PetscMax(1, mz);

  PetscFunctionBegin;
  PetscCall(PetscMemzero(mesh, sizeof(*mesh)));
  PetscCall(PetscStrncpy(mesh->source, "grid", sizeof(mesh->source)));
  mesh->dim = dim;
  mesh->n_nodes = 2 * n; /* the second half: the right side of the crack; unused elsewhere */
  PetscCall(PetscCalloc1(3 * mesh->n_nodes, &mesh->x));
  PetscCall(PetscMalloc1(cells + sides, &mesh->type));
  PetscCall(PetscMalloc1(cells + sides + 1, &mesh->start));
  PetscCall(PetscMalloc1(corners * (cells + sides), &mesh->node));
  PetscCall(PetscCalloc1(2, &mesh->group));
  for (PetscInt v = 0; v < 2 * n; v++) {
    mesh->x[3 * v] = h * (v % n % row);
    mesh->x[3 * v + 1] = h * (v % n / row % (m[1] + 1));
    mesh->x[3 * v + 2] = h * (v % n / layer);
  }
  mesh->start[0] = 0;
  for (PetscInt k = 0; k < PetscMax(1, mz); k++)
    for (PetscInt j = 0; j < m[1]; j++)
      for (PetscInt i = 0; i < m[0]; i++) {
        const PetscInt c = mesh->n_cells, step[4] = {0, 1, row + 1, row};

        if (!keep(i, j, k)) continue;
        mesh->type[c] = dim == 3 ? MESH_HEX8 : MESH_QUAD4;
        for (PetscInt a = 0; a < corners; a++) {
          PetscInt v = k * layer + j * row + i + step[a % 4] + (a > 3 ? layer : 0);

          if (crack > 0 && i >= crack && v % row == crack && v / row % (m[1] + 1) < crack_top) v += n;
          mesh->node[mesh->start[c] + a] = v;
        }
        mesh->start[c + 1] = mesh->start[c] + corners;
        mesh->n_cells++;
      }
  mesh->n_groups = 2;
  for (PetscInt g = 0; g < 2; g++) {
    MeshGroup *group = &mesh->group[g];

    PetscCall(PetscStrncpy(group->name, g ? "all" : "left", sizeof(group->name)));
    group->dim = dim - 1 + g;
    PetscCall(PetscMalloc1(g ? mesh->n_cells : sides, &group->cell));
    if (g) continue;
    for (PetscInt k = 0; k < PetscMax(1, mz); k++)
      for (PetscInt j = 0; j < m[1]; j++) {
        const PetscInt c = mesh->n_cells + group->n_cells, v = k * layer + j * row, quad[4] = {v, v + row, v + layer + row, v + layer};

        mesh->type[c] = dim == 3 ? MESH_QUAD4 : MESH_LINE2;
        for (PetscInt a = 0; a < 2 * (dim - 1); a++) mesh->node[mesh->start[c] + a] = quad[a];
        mesh->start[c + 1] = mesh->start[c] + 2 * (dim - 1);
        group->cell[group->n_cells++] = c;
      }
  }
  mesh->group[1].n_cells = mesh->n_cells;
  for (PetscInt c = 0; c < mesh->n_cells; c++) mesh->group[1].cell[c] = c;
  mesh->n_cells += mesh->group[0].n_cells;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode GridMeshDestroy(Mesh *mesh)
{
  PetscFunctionBegin;
  for (PetscInt g = 0; g < mesh->n_groups; g++) PetscCall(PetscFree(mesh->group[g].cell));
  PetscCall(PetscFree(mesh->group));
  PetscCall(PetscFree(mesh->x));
  PetscCall(PetscFree(mesh->type));
  PetscCall(PetscFree(mesh->start));
  PetscCall(PetscFree(mesh->node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A body straight from a grid. */
static inline PetscErrorCode GridBody(PetscInt dim, const PetscInt m[3], PetscReal h, KeepCell keep, PetscInt crack, PetscInt crack_top, DemBody *body)
{
  Mesh mesh;

  PetscFunctionBegin;
  PetscCall(GridMesh(dim, m, h, keep, crack, crack_top, &mesh));
  PetscCall(DemBodyCreateFromMesh(&mesh, "all", 0.01, body));
  PetscCall(GridMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An L of 8 x 8 cells less its upper right quarter; a beam of 15 x 6 with a notch one cell wide and three deep. */
static inline PetscBool KeepL(PetscInt i, PetscInt j, PetscInt k) { return i < 4 || j < 4 ? PETSC_TRUE : PETSC_FALSE; }
static inline PetscBool KeepNotched(PetscInt i, PetscInt j, PetscInt k) { return i != 7 || j >= 3 ? PETSC_TRUE : PETSC_FALSE; }
