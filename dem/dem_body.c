/*
  dem_body.c - bodies as unions of convex pieces.

  A prism over a convex polygon makes boxes, cylinders and discs. Meshes are split in
  dem_body_mesh.c.  docs/theory.md 3.1
*/
#include "dem_body_impl.h"
#include <string.h>

/* ---- storage ---- */

PetscErrorCode DemBodyAllocate(PetscInt n_pieces, PetscInt n_planes, PetscInt n_simplices, PetscInt n_faces, DemBody *body)
{
  PetscFunctionBegin;
  body->n_pieces = n_pieces;
  body->n_simplices = n_simplices;
  body->n_faces = n_faces;
  PetscCall(PetscMalloc1(n_pieces + 1, &body->start));
  PetscCall(PetscMalloc1(4 * n_planes, &body->plane));
  PetscCall(PetscMalloc1(n_planes, &body->face));
  PetscCall(PetscMalloc1(n_planes, &body->beyond));
  PetscCall(PetscMalloc1(6 * n_pieces, &body->box));
  PetscCall(PetscCalloc1(n_faces, &body->face_name));
  PetscCall(PetscMalloc1(3 * body->dim * n_simplices, &body->simplex));
  PetscCall(PetscMalloc1(body->dim * n_simplices, &body->simplex_node));
  PetscCall(PetscMalloc1(n_simplices, &body->simplex_face));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemBodyDestroy(DemBody *body)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(body->start));
  PetscCall(PetscFree(body->plane));
  PetscCall(PetscFree(body->face));
  PetscCall(PetscFree(body->beyond));
  PetscCall(PetscFree(body->box));
  PetscCall(PetscFree(body->face_name));
  PetscCall(PetscFree(body->simplex));
  PetscCall(PetscFree(body->simplex_node));
  PetscCall(PetscFree(body->simplex_face));
  PetscCall(PetscMemzero(body, sizeof(*body)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Outward normal times twice the area (3D), times the length (2D), of a boundary simplex. */
static void SimplexNormal(PetscInt dim, const PetscReal *s, PetscReal n[3])
{
  if (dim == 2) {
    n[0] = s[4] - s[1];
    n[1] = s[0] - s[3];
    n[2] = 0;
  } else {
    const PetscReal u[3] = {s[3] - s[0], s[4] - s[1], s[5] - s[2]}, v[3] = {s[6] - s[0], s[7] - s[1], s[8] - s[2]};

    n[0] = u[1] * v[2] - u[2] * v[1];
    n[1] = u[2] * v[0] - u[0] * v[2];
    n[2] = u[0] * v[1] - u[1] * v[0];
  }
}

/* By the divergence theorem over the boundary, about the middle of the body for accuracy. */
PetscReal DemBodyVolume(const DemBody *body)
{
  const PetscInt dim = body->dim;
  PetscReal      sum = 0, mid[3];

  for (PetscInt c = 0; c < 3; c++) mid[c] = 0.5 * (body->low[c] + body->high[c]);
  for (PetscInt k = 0; k < body->n_simplices; k++) {
    const PetscReal *s = &body->simplex[3 * dim * k];
    PetscReal        n[3];

    SimplexNormal(dim, s, n);
    sum += n[0] * (s[0] - mid[0]) + n[1] * (s[1] - mid[1]) + n[2] * (s[2] - mid[2]);
  }
  return dim == 2 ? 0.5 * sum * body->thickness : sum / 6;
}

PetscErrorCode DemBodyFindFace(const DemBody *body, const char *name, PetscInt *face)
{
  PetscFunctionBegin;
  *face = -1;
  for (PetscInt k = 0; k < body->n_faces; k++)
    if (!strcmp(body->face_name[k], name)) *face = k;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- one convex piece: a polygon, or a prism over it ---- */

static void PutCorner(DemBody *body, PetscInt k, PetscInt corner, PetscReal x, PetscReal y, PetscReal z, PetscInt node)
{
  PetscReal *s = &body->simplex[3 * (body->dim * k + corner)];

  s[0] = x;
  s[1] = y;
  s[2] = z;
  body->simplex_node[body->dim * k + corner] = node;
}

/* xy [n][2] counter-clockwise; side_face [n] of the edge that leaves corner i; in 3D from z0 to z1, ends = {bottom, top} faces. */
static PetscErrorCode BodyFromPolygon(PetscInt dim, PetscInt n, const PetscReal *xy, const PetscInt *side_face, PetscReal z0, PetscReal z1,
                                      const PetscInt ends[2], PetscInt n_faces, DemBody *body)
{
  const PetscInt n_planes = dim == 2 ? n : n + 2;
  PetscReal      mid[2] = {0, 0};

  PetscFunctionBegin;
  body->dim = dim;
  PetscCall(DemBodyAllocate(1, n_planes, dim == 2 ? n : 4 * n, n_faces, body));
  body->low[0] = body->low[1] = PETSC_MAX_REAL;
  body->high[0] = body->high[1] = -PETSC_MAX_REAL;
  body->low[2] = dim == 2 ? 0 : z0;
  body->high[2] = dim == 2 ? 0 : z1;
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt c = 0; c < 2; c++) {
      body->low[c] = PetscMin(body->low[c], xy[2 * i + c]);
      body->high[c] = PetscMax(body->high[c], xy[2 * i + c]);
      mid[c] += xy[2 * i + c] / n;
    }
  for (PetscInt c = 0; c < 3; c++) {
    body->box[c] = body->low[c];
    body->box[3 + c] = body->high[c];
  }
  body->start[0] = 0;
  body->start[1] = n_planes;
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt   j = (i + 1) % n;
    const PetscReal *a = &xy[2 * i], *b = &xy[2 * j];
    const PetscReal  len = PetscSqrtReal((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]));
    PetscReal       *p = &body->plane[4 * i];

    p[0] = (b[1] - a[1]) / len;
    p[1] = (a[0] - b[0]) / len;
    p[2] = 0;
    p[3] = p[0] * 0.5 * (a[0] + b[0]) + p[1] * 0.5 * (a[1] + b[1]);
    body->face[i] = side_face[i];
    body->beyond[i] = -1;
    if (dim == 2) {
      PutCorner(body, i, 0, a[0], a[1], 0, i);
      PutCorner(body, i, 1, b[0], b[1], 0, j);
      body->simplex_face[i] = side_face[i];
    } else { /* nodes: bottom corner i, top corner n + i, middles 2n and 2n + 1 */
      PetscInt k = 4 * i;

      for (PetscInt m = 0; m < 4; m++) body->simplex_face[k + m] = m < 2 ? side_face[i] : ends[m - 2];
      PutCorner(body, k, 0, a[0], a[1], z0, i);
      PutCorner(body, k, 1, b[0], b[1], z0, j);
      PutCorner(body, k, 2, b[0], b[1], z1, n + j);
      PutCorner(body, k + 1, 0, a[0], a[1], z0, i);
      PutCorner(body, k + 1, 1, b[0], b[1], z1, n + j);
      PutCorner(body, k + 1, 2, a[0], a[1], z1, n + i);
      PutCorner(body, k + 2, 0, mid[0], mid[1], z0, 2 * n);
      PutCorner(body, k + 2, 1, b[0], b[1], z0, j);
      PutCorner(body, k + 2, 2, a[0], a[1], z0, i);
      PutCorner(body, k + 3, 0, mid[0], mid[1], z1, 2 * n + 1);
      PutCorner(body, k + 3, 1, a[0], a[1], z1, n + i);
      PutCorner(body, k + 3, 2, b[0], b[1], z1, n + j);
    }
  }
  for (PetscInt e = 0; dim == 3 && e < 2; e++) {
    PetscReal *p = &body->plane[4 * (n + e)];

    p[0] = p[1] = 0;
    p[2] = e ? 1 : -1;
    p[3] = e ? z1 : -z0;
    body->face[n + e] = ends[e];
    body->beyond[n + e] = -1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckThickness(PetscInt dim, PetscReal thickness)
{
  PetscFunctionBegin;
  BaseCheckInput(dim == 3 || (thickness > 0 && !PetscIsInfOrNanReal(thickness)), PETSC_COMM_SELF, "A 2D body needs a thickness above 0, not %.6g m",
                 (double)thickness);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemBodyCreateBox(PetscInt dim, const PetscReal low[3], const PetscReal high[3], PetscReal thickness, DemBody *body)
{
  static const char *const names[6] = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};
  const PetscInt           side_face[4] = {2, 1, 3, 0}, ends[2] = {4, 5};

  PetscFunctionBegin;
  PetscCall(PetscMemzero(body, sizeof(*body)));
  PetscCheck(dim == 2 || dim == 3, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "A body has 2 or 3 dimensions, not %" PetscInt_FMT, dim);
  PetscCall(CheckThickness(dim, thickness));
  for (PetscInt c = 0; c < dim; c++)
    BaseCheckInput(high[c] > low[c] && !PetscIsInfOrNanReal(high[c] - low[c]), PETSC_COMM_SELF, "The box has no extent along %c: from %.6g to %.6g m", "xyz"[c],
                   (double)low[c], (double)high[c]);
  {
    const PetscReal xy[8] = {low[0], low[1], high[0], low[1], high[0], high[1], low[0], high[1]};

    PetscCall(BodyFromPolygon(dim, 4, xy, side_face, dim == 3 ? low[2] : 0, dim == 3 ? high[2] : 0, ends, 2 * dim, body));
  }
  body->thickness = dim == 2 ? thickness : 1;
  for (PetscInt k = 0; k < 2 * dim; k++) PetscCall(PetscStrncpy(body->face_name[k], names[k], sizeof(body->face_name[k])));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Regular polygon with the circle's area: 1/2 n R^2 sin(2 pi / n) = pi r^2. */
static PetscErrorCode RegularPolygon(const PetscReal centre[2], PetscReal radius, PetscInt sides, PetscReal **xy, PetscInt **face)
{
  PetscReal outer;

  PetscFunctionBegin;
  BaseCheckInput(radius > 0 && !PetscIsInfOrNanReal(radius), PETSC_COMM_SELF, "The radius of a cylinder or disc is above 0, not %.6g m", (double)radius);
  BaseCheckInput(sides >= 3, PETSC_COMM_SELF, "A cylinder or disc needs at least 3 sides, not %" PetscInt_FMT, sides);
  outer = radius * PetscSqrtReal(PETSC_PI / (0.5 * sides * PetscSinReal(2 * PETSC_PI / sides)));
  PetscCall(PetscMalloc1(2 * sides, xy));
  PetscCall(PetscCalloc1(sides, face));
  for (PetscInt i = 0; i < sides; i++) {
    (*xy)[2 * i] = centre[0] + outer * PetscCosReal(2 * PETSC_PI * i / sides);
    (*xy)[2 * i + 1] = centre[1] + outer * PetscSinReal(2 * PETSC_PI * i / sides);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemBodyCreateCylinder(const PetscReal centre[3], PetscReal radius, PetscReal height, PetscInt sides, DemBody *body)
{
  static const char *const names[3] = {"bottom", "top", "side"};
  const PetscInt           ends[2] = {0, 1};
  PetscReal               *xy;
  PetscInt                *face;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(body, sizeof(*body)));
  BaseCheckInput(height > 0 && !PetscIsInfOrNanReal(height), PETSC_COMM_SELF, "The height of a cylinder is above 0, not %.6g m", (double)height);
  PetscCall(RegularPolygon(centre, radius, sides, &xy, &face));
  for (PetscInt i = 0; i < sides; i++) face[i] = 2;
  PetscCall(BodyFromPolygon(3, sides, xy, face, centre[2], centre[2] + height, ends, 3, body));
  body->thickness = 1;
  for (PetscInt k = 0; k < 3; k++) PetscCall(PetscStrncpy(body->face_name[k], names[k], sizeof(body->face_name[k])));
  PetscCall(PetscFree(xy));
  PetscCall(PetscFree(face));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemBodyCreateDisc(const PetscReal centre[2], PetscReal radius, PetscInt sides, PetscReal thickness, DemBody *body)
{
  const PetscInt ends[2] = {0, 0};
  PetscReal     *xy;
  PetscInt      *face;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(body, sizeof(*body)));
  PetscCall(CheckThickness(2, thickness));
  PetscCall(RegularPolygon(centre, radius, sides, &xy, &face));
  PetscCall(BodyFromPolygon(2, sides, xy, face, 0, 0, ends, 1, body));
  body->thickness = thickness;
  PetscCall(PetscStrncpy(body->face_name[0], "side", sizeof(body->face_name[0])));
  PetscCall(PetscFree(xy));
  PetscCall(PetscFree(face));
  PetscFunctionReturn(PETSC_SUCCESS);
}
