/* dem_surface_move.c - a surface whose nodes move: its grid anew, and the foot of a touch as shares of a cell's corners.  Eq. (5.70) */
#include "dem_surface.h"

PetscErrorCode DemSurfaceRegrid(DemSurface *s)
{
  const PetscReal reach = s->reach;

  PetscFunctionBegin;
  PetscCheck(s->box_start, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call DemSurfaceSetReach() before DemSurfaceRegrid()");
  PetscCall(PetscFree(s->box_start));
  PetscCall(PetscFree(s->box));
  for (PetscInt d = 0; d < 3; d++) {
    s->low[d]  = PETSC_MAX_REAL;
    s->high[d] = -PETSC_MAX_REAL;
  }
  for (PetscInt i = 0; i < s->n_nodes; i++)
    for (PetscInt d = 0; d < 3; d++) {
      s->low[d]  = PetscMin(s->low[d], s->x[3 * i + d]);
      s->high[d] = PetscMax(s->high[d], s->x[3 * i + d]);
    }
  PetscCall(DemSurfaceSetReach(s, reach));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool DemSurfaceNear(const DemSurface *s, const PetscReal x[3])
{
  PetscInt at = 0;

  for (PetscInt d = 2; d >= 0; d--) {
    const PetscReal y = (x[d] - s->origin[d]) / s->width;

    if (!(y >= 0 && y < (PetscReal)s->m[d])) return PETSC_FALSE;
    at = at * s->m[d] + (PetscInt)y;
  }
  return (PetscBool)(s->box_start[at] < s->box_start[at + 1]);
}

/* Share t of the second end of a segment that the foot of w, from the first end, has */
static PetscReal Along(const PetscReal *a, const PetscReal *b, const PetscReal *x)
{
  PetscReal dot = 0, length2 = 0;

  for (PetscInt d = 0; d < 3; d++) {
    dot += (x[d] - a[d]) * (b[d] - a[d]);
    length2 += (b[d] - a[d]) * (b[d] - a[d]);
  }
  return dot / length2;
}

void DemSurfaceFoot(const DemSurface *s, const DemTouch *touch, const PetscReal x[3], PetscInt *cell, PetscReal share[3])
{
  const PetscInt  dim = s->dim, c = touch->kind == 0 ? touch->which : touch->kind == 1 ? s->edge_cell[2 * touch->which] : s->node_owner[touch->which];
  const PetscInt *corner = &s->corner[dim * c];

  *cell    = c;
  share[0] = share[1] = share[2] = 0;
  if (touch->kind == 2) {
    for (PetscInt k = 0; k < dim; k++) share[k] = corner[k] == touch->which ? 1 : 0;
  } else if (touch->kind == 1) {
    for (PetscInt k = 0; k < 3; k++) {
      if (s->cell_edge[3 * c + k] != touch->which) continue;
      share[(k + 1) % 3] = Along(&s->x[3 * corner[k]], &s->x[3 * corner[(k + 1) % 3]], x);
      share[k]           = 1 - share[(k + 1) % 3];
    }
  } else if (dim == 2) {
    share[1] = Along(&s->x[3 * corner[0]], &s->x[3 * corner[1]], x);
    share[0] = 1 - share[1];
  } else {
    const PetscReal *n = &s->normal[3 * c];
    PetscReal        part[3], sum = 0;

    for (PetscInt k = 0; k < 3; k++) { /* triangle of the foot and the side opposite to corner k */
      const PetscReal *a = &s->x[3 * corner[(k + 1) % 3]], *b = &s->x[3 * corner[(k + 2) % 3]];

      part[k] = 0;
      for (PetscInt d = 0; d < 3; d++) {
        const PetscInt i = (d + 1) % 3, j = (d + 2) % 3;

        part[k] += n[d] * ((b[i] - a[i]) * (x[j] - a[j]) - (b[j] - a[j]) * (x[i] - a[i]));
      }
      sum += part[k];
    }
    share[0] = part[0] / sum;
    share[1] = part[1] / sum;
    share[2] = 1 - share[0] - share[1];
  }
}
