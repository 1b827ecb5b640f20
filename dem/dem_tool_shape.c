/*
  dem_tool_shape.c - touches of a sphere with plane, cylinder, disc and surface, in the tool's own frame.  Eqs (5.53)-(5.55)

  The frame moves, the shape does not: a surface's grid is made once, however the tool moves.
*/
#include "dem_tool_impl.h"

static PetscReal Dot(const PetscReal a[3], const PetscReal b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static PetscErrorCode Unit(const char *name, const char *what, PetscReal a[3])
{
  const PetscReal length = PetscSqrtReal(Dot(a, a));

  PetscFunctionBegin;
  BaseCheckInput(length > 0 && !PetscIsInfOrNanReal(length), PETSC_COMM_SELF, "Tool '%s': the %s has no direction", name, what);
  for (PetscInt d = 0; d < 3; d++) a[d] /= length;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemToolShapeSet_Internal(DemTool *tool, PetscInt dim)
{
  DemToolOptions *o = &tool->o;

  PetscFunctionBegin;
  if (dim == 2 && o->shape == DEM_TOOL_CYLINDER) { /* a circle is a cylinder without end */
    o->axis[0] = o->axis[1] = 0;
    o->axis[2]              = 1;
    o->length               = 0;
    o->point[2]             = 0;
  }
  BaseCheckInput(dim == 3 || o->shape != DEM_TOOL_DISC, PETSC_COMM_SELF, "Tool '%s': in 2D a disc is a circle, made as a cylinder", tool->name);
  if (o->shape == DEM_TOOL_PLANE || o->shape == DEM_TOOL_DISC) PetscCall(Unit(tool->name, "normal", o->axis));
  if (o->shape == DEM_TOOL_CYLINDER) PetscCall(Unit(tool->name, "axis", o->axis));
  if (o->shape == DEM_TOOL_CYLINDER || o->shape == DEM_TOOL_DISC) BaseCheckInput(o->radius > 0, PETSC_COMM_SELF, "Tool '%s': radius %.6g m must be positive", tool->name, (double)o->radius);
  BaseCheckInput(o->length >= 0, PETSC_COMM_SELF, "Tool '%s': length %.6g m cannot be negative", tool->name, (double)o->length);
  if (o->shape == DEM_TOOL_SURFACE) BaseCheckInput(o->surface.dim == dim, PETSC_COMM_SELF, "Tool '%s': a %" PetscInt_FMT "D surface in a %" PetscInt_FMT "D model", tool->name, o->surface.dim, dim);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Along the axis and away from it: w = z axis + rho radial */
static void Cylindrical(const DemToolOptions *o, const PetscReal x[3], PetscReal *z, PetscReal *rho, PetscReal radial[3])
{
  const PetscReal w[3] = {x[0] - o->point[0], x[1] - o->point[1], x[2] - o->point[2]};

  *z = Dot(w, o->axis);
  for (PetscInt d = 0; d < 3; d++) radial[d] = w[d] - *z * o->axis[d];
  *rho = PetscSqrtReal(Dot(radial, radial));
  for (PetscInt d = 0; d < 3; d++) radial[d] = *rho > 0 ? radial[d] / *rho : 0;
}

/* n along a radial and b axial, divided by their length */
static void Set(DemTouch *t, const DemToolOptions *o, const PetscReal radial[3], PetscReal a, PetscReal b, PetscReal distance, PetscReal curvature, PetscInt kind)
{
  const PetscReal length = PetscSqrtReal(a * a + b * b);

  for (PetscInt d = 0; d < 3; d++) t->n[d] = length > 0 ? (a * radial[d] + b * o->axis[d]) / length : o->axis[d];
  t->distance  = distance;
  t->curvature = curvature;
  t->kind      = kind;
}

static PetscInt TouchCylinder(const DemToolOptions *o, const PetscReal x[3], PetscReal radius, DemTouch *t)
{
  PetscReal z, rho, radial[3], dr, dz;

  Cylindrical(o, x, &z, &rho, radial);
  dr = rho - o->radius;
  dz = o->length > 0 ? PetscAbsReal(z) - 0.5 * o->length : -PETSC_MAX_REAL;
  if (o->inside) {
    if (rho == 0 && radius < o->radius) return 0;
    if (dz > 0) Set(t, o, radial, dr, z > 0 ? dz : -dz, PetscSqrtReal(dr * dr + dz * dz), 0, 1); /* rim of the tube */
    else if (o->length > 0 && dr > 0) Set(t, o, radial, 1, 0, dr, 1 / o->radius, 0);            /* its outer side */
    else Set(t, o, radial, -1, 0, -dr, -1 / o->radius, 0);
  } else if (dr > 0 && dz > 0) Set(t, o, radial, dr, z > 0 ? dz : -dz, PetscSqrtReal(dr * dr + dz * dz), 0, 1);
  else if (dr >= dz) Set(t, o, radial, 1, 0, dr, 1 / o->radius, 0);
  else Set(t, o, radial, 0, z > 0 ? 1 : -1, dz, 0, 0);
  return t->distance < radius;
}

static PetscInt TouchDisc(const DemToolOptions *o, const PetscReal x[3], PetscReal radius, DemTouch *t)
{
  PetscReal z, rho, radial[3];

  Cylindrical(o, x, &z, &rho, radial);
  if (rho <= o->radius) Set(t, o, radial, 0, z < 0 ? -1 : 1, PetscAbsReal(z), 0, 0);
  else Set(t, o, radial, rho - o->radius, z, PetscSqrtReal(PetscSqr(rho - o->radius) + z * z), 0, 1);
  return t->distance < radius;
}

static PetscInt TouchPlane(const DemToolOptions *o, const PetscReal x[3], PetscReal radius, DemTouch *t)
{
  const PetscReal w[3] = {x[0] - o->point[0], x[1] - o->point[1], x[2] - o->point[2]};

  *t = (DemTouch){{o->axis[0], o->axis[1], o->axis[2]}, Dot(w, o->axis), 0, 0};
  return t->distance < radius;
}

/* A point of space in the tool's own frame. */
static void Own(const DemTool *tool, PetscInt dim, const PetscReal x[3], PetscReal y[3])
{
  for (PetscInt d = 0; d < 3; d++) y[d] = d < dim ? x[d] - tool->shift[d] : 0;
  if (tool->rotates) {
    const PetscReal w[3] = {y[0] - tool->centre0[0], y[1] - tool->centre0[1], y[2] - tool->centre0[2]};

    for (PetscInt d = 0; d < 3; d++) y[d] = tool->centre0[d] + tool->turn[0][d] * w[0] + tool->turn[1][d] * w[1] + tool->turn[2][d] * w[2];
  }
}

PetscErrorCode DemModelHasTools(DemModel model, PetscBool *has)
{
  PetscFunctionBegin;
  *has = (PetscBool)(model->n_tools > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelNearTools(DemModel model, PetscInt n, const PetscReal x[], const PetscReal margin[], PetscBool near[])
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i++) {
    near[i] = PETSC_FALSE;
    for (PetscInt k = 0; k < model->n_tools && !near[i]; k++) {
      const DemTool    *tool = model->tool[k];
      const DemSurface *s    = &tool->o.surface;
      DemTouch          touch[DEM_TOUCHES];
      PetscReal         y[3];
      PetscBool         far = PETSC_FALSE;

      Own(tool, model->dim, &x[3 * i], y);
      if (tool->o.shape != DEM_TOOL_SURFACE) near[i] = (PetscBool)(DemToolTouch_Internal(tool, model->dim, &x[3 * i], margin[i], touch) > 0);
      else {
        for (PetscInt d = 0; d < model->dim; d++) far = (PetscBool)(far || y[d] < s->low[d] - margin[i] || y[d] > s->high[d] + margin[i]);
        near[i] = (PetscBool)(!far && DemSurfaceDistance(s, y) < margin[i]);
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt DemToolTouch_Internal(const DemTool *tool, PetscInt dim, const PetscReal x[3], PetscReal radius, DemTouch touch[DEM_TOUCHES])
{
  const DemToolOptions *o = &tool->o;
  PetscReal             y[3];
  PetscInt              n = 0;

  Own(tool, dim, x, y);
  switch (o->shape) {
  case DEM_TOOL_PLANE: n = TouchPlane(o, y, radius, touch); break;
  case DEM_TOOL_CYLINDER: n = TouchCylinder(o, y, radius, touch); break;
  case DEM_TOOL_DISC: n = TouchDisc(o, y, radius, touch); break;
  case DEM_TOOL_SURFACE: n = DemSurfaceTouch(&o->surface, y, radius, touch); break;
  }
  if (tool->rotates)
    for (PetscInt k = 0; k < n; k++) {
      const PetscReal a[3] = {touch[k].n[0], touch[k].n[1], touch[k].n[2]};

      for (PetscInt d = 0; d < 3; d++) touch[k].n[d] = Dot(tool->turn[d], a);
    }
  return n;
}

/* Two unit vectors across a. */
static void Across(const PetscReal a[3], PetscReal b[3], PetscReal c[3])
{
  const PetscInt least = PetscAbsReal(a[0]) <= PetscAbsReal(a[1]) && PetscAbsReal(a[0]) <= PetscAbsReal(a[2]) ? 0 : PetscAbsReal(a[1]) <= PetscAbsReal(a[2]) ? 1 : 2;
  PetscReal      length = 0;

  for (PetscInt d = 0; d < 3; d++) b[d] = (d == least) - a[least] * a[d];
  length = PetscSqrtReal(Dot(b, b));
  for (PetscInt d = 0; d < 3; d++) b[d] /= length;
  for (PetscInt d = 0; d < 3; d++) c[d] = a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3];
}

#define SIDES 48

PetscErrorCode DemToolPicture_Internal(const DemTool *tool, PetscInt dim, const PetscReal middle[3], PetscReal size, DemSurface *picture)
{
  const DemToolOptions *o = &tool->o;
  PetscReal             b[3], c[3], x[4 * SIDES][3][3], line[SIDES][2][3], at[3];
  PetscInt              n = 0;

  PetscFunctionBegin;
  if (o->shape == DEM_TOOL_SURFACE) {
    PetscReal *corner;

    PetscCall(PetscMalloc1(3 * dim * o->surface.n, &corner));
    for (PetscInt k = 0; k < dim * o->surface.n; k++)
      for (PetscInt d = 0; d < 3; d++) corner[3 * k + d] = o->surface.x[3 * o->surface.corner[k] + d];
    PetscCall(DemSurfaceCreate(tool->name, dim, o->surface.n, corner, picture));
    PetscCall(PetscFree(corner));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  Across(o->axis, b, c);
  if (dim == 2) {
    if (o->shape == DEM_TOOL_PLANE) {
      const PetscReal t[3] = {-o->axis[1], o->axis[0], 0}, w[3] = {middle[0] - o->point[0], middle[1] - o->point[1], 0}, s = Dot(w, t);

      for (PetscInt k = 0; k < 2; k++)
        for (PetscInt d = 0; d < 3; d++) line[0][k][d] = o->point[d] + (s + (k ? size : -size)) * t[d];
      n = 1;
    } else
      for (n = 0; n < SIDES; n++)
        for (PetscInt k = 0; k < 2; k++) {
          const PetscReal a = 2 * PETSC_PI * ((n + k) % SIDES) / SIDES;

          for (PetscInt d = 0; d < 3; d++) line[n][k][d] = o->point[d] + o->radius * (PetscCosReal(a) * (d == 0) + PetscSinReal(a) * (d == 1));
        }
    PetscCall(DemSurfaceCreate(tool->name, 2, n, &line[0][0][0], picture));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  {
    const PetscReal w[3] = {middle[0] - o->point[0], middle[1] - o->point[1], middle[2] - o->point[2]}, along = Dot(w, o->axis);

    for (PetscInt d = 0; d < 3; d++) at[d] = o->shape == DEM_TOOL_PLANE ? middle[d] - along * o->axis[d] : o->point[d] + (o->length > 0 || o->shape == DEM_TOOL_DISC ? 0 : along * o->axis[d]);
  }
  if (o->shape == DEM_TOOL_PLANE) {
    static const PetscReal corner[6][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, -1}, {1, 1}, {-1, 1}};

    for (PetscInt k = 0; k < 6; k++)
      for (PetscInt d = 0; d < 3; d++) x[k / 3][k % 3][d] = at[d] + size * (corner[k][0] * b[d] + corner[k][1] * c[d]);
    n = 2;
  } else
    for (PetscInt s = 0; s < SIDES; s++) {
      const PetscReal half = o->shape == DEM_TOOL_DISC ? 0 : o->length > 0 ? 0.5 * o->length : size;
      PetscReal       rim[2][2][3], end[2][3];

      for (PetscInt d = 0; d < 3; d++)
        for (PetscInt e = 0; e < 2; e++) {
          end[e][d] = at[d] + (e ? half : -half) * o->axis[d];
          for (PetscInt k = 0; k < 2; k++) {
            const PetscReal a = 2 * PETSC_PI * ((s + k) % SIDES) / SIDES;

            rim[e][k][d] = end[e][d] + o->radius * (PetscCosReal(a) * b[d] + PetscSinReal(a) * c[d]);
          }
        }
      for (PetscInt d = 0; d < 3; d++) {
        PetscInt m = n;

        if (half > 0) { /* two triangles of the side */
          x[m][0][d]   = rim[0][0][d];
          x[m][1][d]   = rim[0][1][d];
          x[m++][2][d] = rim[1][1][d];
          x[m][0][d]   = rim[0][0][d];
          x[m][1][d]   = rim[1][1][d];
          x[m++][2][d] = rim[1][0][d];
        }
        if (half == 0 || (!o->inside && o->length > 0))
          for (PetscInt e = 0; e < (half > 0 ? 2 : 1); e++) {
            x[m][0][d]   = end[e][d];
            x[m][1][d]   = rim[e][0][d];
            x[m++][2][d] = rim[e][1][d];
          }
      }
      n += (half > 0 ? 2 : 0) + (half == 0 ? 1 : !o->inside && o->length > 0 ? 2 : 0);
    }
  PetscCall(DemSurfaceCreate(tool->name, 3, n, &x[0][0][0], picture));
  PetscFunctionReturn(PETSC_SUCCESS);
}
