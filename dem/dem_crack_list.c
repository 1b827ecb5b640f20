/* dem_crack_list.c - facets that have begun to break, as the outside sees them; on several ranks, all of them on rank 0. */
#include "dem_impl.h"

static PetscBool Shown(DemModel model, PetscInt k)
{
  const DemCrackState *crack = &model->crack;

  return (PetscBool)(crack->damage[k] > 0 && model->bonds.facet[k] >= 0 && !(crack->state[k] & DEM_BOND_APART) && DemBondIsMine(model, k));
}

/* What is counted here; facet: of the cells here. */
static PetscErrorCode CracksHere(DemModel model)
{
  DemCrackState *crack = &model->crack;
  PetscInt       n = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->bonds.n; k++) n += Shown(model, k);
  PetscCall(PetscFree(crack->facet));
  PetscCall(PetscFree(crack->mode));
  PetscCall(PetscFree(crack->bond));
  PetscCall(PetscFree(crack->place));
  for (PetscInt c = 0; c < 7; c++) PetscCall(PetscFree(crack->list[c]));
  PetscCall(PetscMalloc1(n, &crack->facet));
  PetscCall(PetscMalloc1(n, &crack->mode));
  PetscCall(PetscMalloc1(n, &crack->bond));
  for (PetscInt c = 0; c < 7; c++) PetscCall(PetscMalloc1(n, &crack->list[c]));
  n = 0;
  for (PetscInt k = 0; k < model->bonds.n; k++) {
    const DemBonds *bonds = &model->bonds;
    const PetscInt  p = bonds->p[k], q = bonds->q[k];
    const PetscReal D = crack->damage[k];
    PetscReal       ra[3] = {0}, rb[3] = {0}, y[3] = {0}, ta[3], tb[3], gap[3] = {0}, normal = 0, slide = 0, d = 0, along = 0;

    if (!Shown(model, k)) continue;
    for (PetscInt c = 0; c < model->dim; c++) {
      ra[c] = bonds->arm[c * bonds->n + k];
      y[c]  = model->x0[c * model->n + q] - model->x0[c * model->n + p];
      rb[c] = ra[c] - y[c];
      d += y[c] * y[c];
    }
    d = PetscSqrtReal(d);
    DemTurn(model->dim, model->n, p, model->rot, ra, ta);
    DemTurn(model->dim, model->n, q, model->rot, rb, tb);
    for (PetscInt c = 0; c < model->dim; c++) gap[c] = model->u[c * model->n + q] - model->u[c * model->n + p] + tb[c] - ta[c];
    DemTurn(model->dim, model->n, p, model->rot, y, ta);
    for (PetscInt c = 0; c < 3; c++) {
      along += y[c] / d * crack->e[3 * k + c];
      y[c] = (y[c] + ta[c]) / d;
      normal += gap[c] * y[c];
    }
    for (PetscInt c = 0; c < 3; c++) slide += PetscSqr(gap[c] - normal * y[c]);
    crack->bond[n]    = k;
    crack->facet[n]   = bonds->facet[k];
    crack->mode[n]    = (crack->state[k] & DEM_BOND_TENSION) ? 1 : 2;
    crack->list[0][n] = crack->time[k];
    crack->list[1][n] = D;
    crack->list[2][n] = D;
    if (!model->net && (crack->state[k] & DEM_BOND_TENSION) && D < 1) { /* s from D by the series: t(w) = (1-D) s, t(w) + k w = s */
      const DemStrength own = DemStrengthOf_Internal(model, k);
      const PetscReal   kk = 2 * model->g_shear / (PetscAbsReal(along) * d);
      PetscReal         low = own.tensile, high = 1e6 * own.tensile;

      for (int it = 0; it < 200; it++) {
        const PetscReal s = 0.5 * (low + high), t = DemSofteningStress(&own, DemSofteningOpening(&own, kk, s));

        if (1 - t / s < D) low = s;
        else high = s;
      }
      crack->list[2][n] = 1 - (1 - D) * low / own.tensile;
    }
    crack->list[3][n] = normal;
    crack->list[4][n] = PetscSqrtReal(slide);
    crack->list[5][n] = crack->work[k];
    crack->list[6][n] = PetscAbsReal(along);
    n++;
  }
  crack->n_list = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

enum { LIST = 7, PLACE = 7 }; /* numbers of a row of DemCracks; centroid, normal, area */

/* The list here becomes that of all ranks on rank 0, in the order of one rank, and empty elsewhere. */
static PetscErrorCode GatherCracks(DemModel model)
{
  DemCrackState *crack = &model->crack;
  PetscInt      *key, *facet, *facets, n = crack->n_list;
  PetscReal     *row, *rows;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n, &key, 2 * n, &facet, (LIST + PLACE) * n, &row));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal *o = row + (LIST + PLACE) * k;

    key[k]           = model->ranks->bond[crack->bond[k]];
    facet[2 * k]     = model->ranks->facet[crack->facet[k]];
    facet[2 * k + 1] = crack->mode[k];
    for (PetscInt c = 0; c < LIST; c++) o[c] = crack->list[c][k];
    PetscCall(DemModelGetFacet(model, crack->facet[k], o + LIST, o + LIST + 3, o + LIST + 6));
  }
  PetscCall(DemGatherInts_Internal(model, n, key, 2, facet, &crack->n_list, &facets));
  PetscCall(DemGatherReals_Internal(model, n, key, LIST + PLACE, row, &crack->n_list, &rows));
  PetscCall(PetscFree3(key, facet, row));
  n = crack->n_list;
  PetscCall(PetscRealloc(PetscMax(n, 1) * sizeof(PetscInt), &crack->facet));
  PetscCall(PetscRealloc(PetscMax(n, 1) * sizeof(unsigned char), &crack->mode));
  for (PetscInt c = 0; c < LIST; c++) PetscCall(PetscRealloc(PetscMax(n, 1) * sizeof(PetscReal), &crack->list[c]));
  PetscCall(PetscMalloc1(PLACE * n, &crack->place));
  for (PetscInt k = 0; k < n; k++) {
    crack->facet[k] = facets[2 * k];
    crack->mode[k]  = (unsigned char)facets[2 * k + 1];
    for (PetscInt c = 0; c < LIST; c++) crack->list[c][k] = rows[(LIST + PLACE) * k + c];
    for (PetscInt c = 0; c < PLACE; c++) crack->place[PLACE * k + c] = rows[(LIST + PLACE) * k + LIST + c];
  }
  PetscCall(PetscFree(facets));
  PetscCall(PetscFree(rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetCracks(DemModel model, DemCracks *cracks)
{
  const DemCrackState *crack = &model->crack;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(cracks, sizeof(*cracks)));
  if (!crack->damage) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CracksHere(model));
  if (model->ranks) PetscCall(GatherCracks(model));
  *cracks = (DemCracks){crack->n_list, crack->facet, crack->list[0], crack->list[1], crack->list[2], crack->list[3], crack->list[4], crack->list[5], crack->list[6], crack->mode};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetCrackPlace(DemModel model, PetscInt k, PetscReal at[3], PetscReal normal[3], PetscReal *area)
{
  const DemCrackState *crack = &model->crack;

  PetscFunctionBegin;
  PetscCheck(k >= 0 && k < crack->n_list, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "Crack %" PetscInt_FMT " of %" PetscInt_FMT, k, crack->n_list);
  if (!crack->place) {
    PetscCall(DemModelGetFacet(model, crack->facet[k], at, normal, area));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt d = 0; d < 3; d++) {
    at[d]     = crack->place[PLACE * k + d];
    normal[d] = crack->place[PLACE * k + 3 + d];
  }
  *area = crack->place[PLACE * k + 6];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Corners of the facets of the list here, one after the other. Caller frees. */
static PetscErrorCode Corners(DemModel model, PetscInt **count, PetscReal **x, PetscInt *points)
{
  const DemCells      *cells = &model->cells;
  const DemCrackState *crack = &model->crack;

  PetscFunctionBegin;
  *points = 0;
  for (PetscInt i = 0; i < crack->n_list; i++) *points += cells->facet_start[crack->facet[i] + 1] - cells->facet_start[crack->facet[i]];
  PetscCall(PetscMalloc1(crack->n_list, count));
  PetscCall(PetscMalloc1(3 * *points, x));
  *points = 0;
  for (PetscInt i = 0; i < crack->n_list; i++) {
    const PetscInt first = cells->facet_start[crack->facet[i]], last = cells->facet_start[crack->facet[i] + 1];

    (*count)[i] = last - first;
    for (PetscInt k = first; k < last; k++, (*points)++)
      for (PetscInt d = 0; d < 3; d++) (*x)[3 * *points + d] = cells->at[3 * crack->facet[i] + d] + cells->corner[3 * k + d];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Facets as polygons (2D: lines) at rest, with what DemModelGetCracks says of them. */
PetscErrorCode DemWriteCracks_Internal(DemModel model, Output output)
{
  PetscReal     *x;
  PetscInt      *count, *start, *node, points;
  unsigned char *type;
  DemCracks      c;

  PetscFunctionBegin;
  PetscCall(CracksHere(model));
  PetscCall(Corners(model, &count, &x, &points));
  if (model->ranks) { /* corners of one facet keep their order */
    const PetscInt n = model->crack.n_list, here = points;
    PetscInt      *key, *point_key, *counts, found;
    PetscReal     *all;

    PetscCall(PetscMalloc2(n, &key, here, &point_key));
    points = 0;
    for (PetscInt i = 0; i < n; i++) {
      key[i] = model->ranks->bond[model->crack.bond[i]];
      for (PetscInt k = 0; k < count[i]; k++) point_key[points++] = key[i];
    }
    PetscCall(DemGatherInts_Internal(model, n, key, 1, count, &found, &counts));
    PetscCall(DemGatherReals_Internal(model, here, point_key, 3, x, &points, &all));
    PetscCall(PetscFree2(key, point_key));
    PetscCall(PetscFree(count));
    PetscCall(PetscFree(x));
    count = counts;
    x     = all;
  }
  PetscCall(DemModelGetCracks(model, &c));
  PetscCall(PetscMalloc3(c.n + 1, &start, points, &node, c.n, &type));
  start[0] = 0;
  for (PetscInt i = 0; i < c.n; i++) {
    start[i + 1] = start[i] + count[i];
    type[i]      = model->dim == 2 ? 4 : 7; /* VTK polyline, polygon */
  }
  for (PetscInt k = 0; k < points; k++) node[k] = k;
  {
    const OutputArray array[] = {{"damage", "-", OUTPUT_CELL_DATA, 1, c.damage},  {"broken", "-", OUTPUT_CELL_DATA, 1, c.broken}, {"opening", "m", OUTPUT_CELL_DATA, 1, c.opening},
                                 {"slide", "m", OUTPUT_CELL_DATA, 1, c.slide},    {"energy", "J", OUTPUT_CELL_DATA, 1, c.work},   {"time", "s", OUTPUT_CELL_DATA, 1, c.time}};
    const OutputBlock block = {"cracks", points, x, c.n, start, node, type, 6, array};

    PetscCall(OutputFrameBlock(output, &block));
  }
  PetscCall(PetscFree3(start, node, type));
  PetscCall(PetscFree(count));
  PetscCall(PetscFree(x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
