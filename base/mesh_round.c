/*
  mesh_round.c - discs and cylinders drawn by gmsh's CAD kernel, so that nodes between corners lie on the circle too.

  Tetrahedra fill a cylinder freely; hexahedra are a disc of quadrilaterals in layers (a triangle left over among them
  becomes a prism).
*/
#include "mesh_gmsh.h"
#include <gmshc.h>

typedef struct {
  const char *name;
  PetscReal   centre[3], radius, height;
} Round;

static void Name(int dim, size_t n, int tag[], const char *name, int *ierr)
{
  const int group = *ierr || !n ? 0 : gmshModelAddPhysicalGroup(dim, tag, n, -1, ierr);

  if (!*ierr && n) gmshModelSetPhysicalName(dim, group, name, ierr);
}

/* Which side of the cylinder a surface is, by its box: 0 bottom, 1 top, 2 around. */
static int SideOf(const Round *r, int tag, int *ierr)
{
  const double near = 0.25 * r->height;
  double       low[3], high[3];

  gmshModelGetBoundingBox(2, tag, &low[0], &low[1], &low[2], &high[0], &high[1], &high[2], ierr);
  if (*ierr || low[2] > r->centre[2] + r->height - near) return 1;
  return high[2] < r->centre[2] + near ? 0 : 2;
}

static PetscErrorCode Draw(const void *ctx, const char *what, const MeshOptions *options, char words[BASE_LINE])
{
  const Round *r   = (const Round *)ctx;
  const int    dim = (int)options->dimension;
  int          body[2] = {dim, 0}, *sides = NULL, ierr = 0;
  size_t       n = 0;

  PetscFunctionBegin;
  if (dim == 3 && !options->quads) body[1] = gmshModelOccAddCylinder(r->centre[0], r->centre[1], r->centre[2], 0, 0, r->height, r->radius, -1, 2 * PETSC_PI, &ierr);
  else body[1] = gmshModelOccAddDisk(r->centre[0], r->centre[1], r->centre[2], r->radius, r->radius, -1, &ierr);
  if (!ierr && dim == 3 && options->quads) {
    int  disc[2] = {2, body[1]}, layers = (int)PetscMax(1, PetscCeilReal(r->height / options->size * (1 - 1e-9))), *made = NULL;

    gmshModelOccExtrude(disc, 2, 0, 0, r->height, &made, &n, &layers, 1, NULL, 0, 1, &ierr);
    for (size_t k = 0; k + 1 < n && !ierr; k += 2)
      if (made[k] == 3) body[1] = made[k + 1];
    gmshFree(made);
  }
  if (!ierr) gmshModelOccSynchronize(&ierr);
  if (!ierr) gmshModelGetBoundary(body, 2, &sides, &n, 0, 0, 0, &ierr);
  for (int k = dim == 2 ? 2 : 0; k < 3 && !ierr; k++) {
    static const char *const word[] = {"bottom", "top", "side"};
    int                      tag[16];
    size_t                   m = 0;

    for (size_t j = 0; j + 1 < n && m < 16; j += 2)
      if (dim == 2 || SideOf(r, sides[j + 1], &ierr) == k) tag[m++] = sides[j + 1];
    Name(dim - 1, m, tag, word[k], &ierr);
  }
  Name(dim, 1, &body[1], r->name, &ierr);
  gmshFree(sides);
  if (ierr) MeshGmshWords_Internal(words, "draw", what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MeshCreateRound(MPI_Comm comm, const char *name, const PetscReal centre[3], PetscReal radius, PetscReal height, const MeshOptions *options, Mesh *mesh)
{
  const Round r = {name, {centre[0], centre[1], options->dimension == 3 ? centre[2] : 0}, radius, height};
  char        what[BASE_LINE];

  PetscFunctionBegin;
  BaseCheckInput(radius > 0 && !PetscIsInfOrNanReal(radius), comm, "A radius of %g m must be positive", (double)radius);
  BaseCheckInput(options->dimension == 2 || (height > 0 && !PetscIsInfOrNanReal(height)), comm, "A height of %g m must be positive", (double)height);
  BaseCheckInput(options->size > 0, comm, "A built-in %s needs an element size", options->dimension == 2 ? "disc" : "cylinder");
  BaseCheckInput(radius / options->size < 1e4 && height / options->size < 1e5, comm, "Elements of %g m are too many for a radius of %g m", (double)options->size, (double)radius);
  PetscCall(BaseFormat(what, "%s '%s'", options->dimension == 2 ? "disc" : "cylinder", name));
  PetscCall(MeshFromGmsh_Internal(comm, what, Draw, &r, options, mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}
