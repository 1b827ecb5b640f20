/* coupling_weights.c - what of each particle, cell and bond is the particles' side's: 1 - alpha of the elements at the place.  Eqs (6.1), (6.2) */
#include "coupling_impl.h"

PetscErrorCode CouplingWeightsCreate_Internal(CouplingModel model, const DemPacking *packing, const DemCells *cells, CouplingParticle *particle,
                                              CouplingWeights *w)
{
  const PetscInt n = packing->n;
  PetscInt       found_all = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc5(n, &w->wm, n, &w->wp, n, &w->row, cells->n_facets, &w->wf, cells->n_facets, &w->breakable));
  for (PetscInt p = 0; p < n; p++) {
    CouplingPoint at;
    PetscBool     found;

    w->row[p] = -1;
    w->wm[p] = 1;
    PetscCall(CouplingLocate_Internal(model, &packing->x[3 * p], 1e-9, &found, &at));
    if (!found) continue;
    if (particle) {
      particle[found_all].p = p; /* the packing's, until set-up */
      particle[found_all].at = at;
    }
    w->row[p] = found_all++;
    w->wm[p] = 1 - CouplingWeight_Internal(model, &at);
  }
  if (particle) model->n_particles = found_all;
  /* A cell beside a particle without elements keeps its whole volumetric energy: that neighbour has nothing to balance a smaller share. */
  for (PetscInt p = 0; p < n; p++) w->wp[p] = w->wm[p];
  for (PetscInt f = 0; f < cells->n_facets; f++)
    if ((w->row[cells->p[f]] < 0) != (w->row[cells->q[f]] < 0)) w->wp[cells->p[f]] = w->wp[cells->q[f]] = 1;
  for (PetscInt f = 0; f < cells->n_facets; f++) {
    CouplingPoint at;
    PetscBool     found = PETSC_FALSE;

    w->wf[f] = 1;
    w->breakable[f] = (PetscBool)(w->row[cells->p[f]] < 0 && w->row[cells->q[f]] < 0);
    if (w->row[cells->p[f]] < 0 || w->row[cells->q[f]] < 0) continue; /* one end outside: full weight */
    PetscCall(CouplingLocate_Internal(model, &cells->at[3 * f], 1e-6, &found, &at));
    if (found) w->wf[f] = 1 - CouplingWeight_Internal(model, &at);
    if (particle) model->overlap_bonds++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingWeightsDestroy_Internal(CouplingWeights *w)
{
  PetscFunctionBegin;
  PetscCall(PetscFree5(w->wm, w->wp, w->row, w->wf, w->breakable));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetStart(CouplingModel model, const DemPacking *packing, DemModel dem)
{
  PetscReal *start;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(3 * packing->n, &start));
  for (PetscInt p = 0; p < packing->n; p++) CouplingBefore(model, &packing->x[3 * p], start + 3 * p);
  PetscCall(DemModelSetStart(dem, start));
  PetscCall(PetscFree(start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingWeightsGive_Internal(CouplingModel model, const CouplingWeights *w, const DemPacking *packing, DemModel dem)
{
  PetscFunctionBegin;
  PetscCall(DemModelSetWeights(dem, w->wm, w->wp, w->wf));
  PetscCall(DemModelSetBreakable(dem, w->breakable));
  PetscCall(DemModelSetRim(dem, COUPLING_RIM));
  if (model->before) PetscCall(SetStart(model, packing, dem));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingGive_Internal(CouplingModel model, DemModel dem, const DemPacking *packing, const DemCells *cells)
{
  CouplingWeights w;

  PetscFunctionBegin;
  PetscCall(CouplingWeightsCreate_Internal(model, packing, cells, NULL, &w));
  PetscCall(CouplingWeightsGive_Internal(model, &w, packing, dem));
  PetscCall(CouplingWeightsDestroy_Internal(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}
