/*
  coupling_tools.c - elements that a tool comes near.

  Tools meet particles, so what they are about to touch must be particles, whatever its stress: cells whose surface particles,
  asleep or of the overlap, are within their own size of a tool.
*/
#include "coupling_switch.h"

static PetscErrorCode Skin(CouplingSwitch sw)
{
  const DemCells *cells = sw->w.cells;
  PetscBool      *outer;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(cells->n, &outer));
  for (PetscInt k = 0; k < cells->n_walls; k++)
    if (strcmp(sw->body.face_name[cells->wall_face[k]], COUPLING_RIM)) outer[cells->wall_p[k]] = PETSC_TRUE;
  for (PetscInt p = 0; p < cells->n; p++) sw->n_skin += outer[p];
  PetscCall(PetscMalloc2(sw->n_skin, &sw->skin, sw->n_skin, &sw->skin_margin));
  for (PetscInt p = 0, k = 0; p < cells->n; p++) {
    if (!outer[p]) continue;
    sw->skin[k]          = p;
    sw->skin_margin[k++] = sw->w.packing->r[p] + PetscPowReal(CouplingVolume_Internal(sw->whole, sw->w.home[p]), 1.0 / sw->whole->dim);
  }
  PetscCall(PetscFree(outer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingLookAtTools_Internal(CouplingSwitch sw, PetscBool close[])
{
  const CouplingHalves *h = sw->now;
  PetscInt              n = 0, *which;
  PetscReal            *x, *margin;
  PetscBool            *near, tools;

  PetscFunctionBegin;
  PetscCall(DemModelHasTools(CouplingMoving(h->model), &tools));
  if (!tools) PetscFunctionReturn(PETSC_SUCCESS);
  if (!sw->skin) PetscCall(Skin(sw));
  PetscCall(PetscMalloc4(sw->n_skin, &which, 3 * sw->n_skin, &x, sw->n_skin, &margin, sw->n_skin, &near));
  for (PetscInt k = 0; k < sw->n_skin; k++) {
    const PetscInt p = sw->skin[k];

    if (sw->is_dem[sw->w.home[p]]) continue;
    which[n]  = p;
    margin[n] = sw->skin_margin[k];
    for (PetscInt d = 0; d < 3; d++) x[3 * n + d] = sw->w.packing->x[3 * p + d]; /* at rest: small strain */
    n++;
  }
  PetscCall(DemModelNearTools(CouplingMoving(h->model), n, x, margin, near));
  for (PetscInt k = 0; k < n; k++)
    if (near[k]) close[sw->w.home[which[k]]] = PETSC_TRUE;
  PetscCall(PetscFree4(which, x, margin, near));
  PetscFunctionReturn(PETSC_SUCCESS);
}
