/*
  dem_walls.c - boundary facets that are held or loaded.  Eqs (4.8)-(4.11), docs/theory.md

  A held facet is a bond with a wall: smooth (normal gap only) or glued (the whole gap). A loaded facet adds its
  traction, all components, to the force and to S. Pressure follows the facet's normal, traction keeps its direction.
*/
#include "dem_impl.h"

void DemFacesSetTime_Internal(DemModel model, PetscReal t)
{
  for (PetscInt k = 0; k < model->n_faces; k++) {
    DemFace *face = &model->face[k];

    for (PetscInt d = 0; d < model->dim; d++) {
      face->shift[d]  = face->fixed[d] ? (face->motion[d] == DEM_VELOCITY ? TableIntegral(&face->table[d], t) : TableValue(&face->table[d], t)) : 0;
      face->stress[d] = face->loaded ? face->direction[d] * TableValue(&face->traction, t) : 0;
    }
    face->push = face->pressed ? TableValue(&face->pressure, t) : 0;
  }
}

/* What one facet feels now: its arm turned with the particle, and the gap (held) or traction (loaded). */
typedef struct {
  PetscReal arm[3], value[3], normal[3];
} Facet;

static void FacetState(DemModel model, PetscInt p, PetscInt i, Facet *facet)
{
  const DemWalls *w = &model->walls;
  const DemFace  *face = &model->face[w->face[i]];
  const PetscInt  n = model->n, dim = model->dim;
  PetscReal       turn[3];

  DemTurn(dim, n, p, model->rot, &w->arm[3 * i], turn);
  for (PetscInt d = 0; d < 3; d++) {
    facet->arm[d]    = w->arm[3 * i + d] + turn[d];
    facet->normal[d] = w->normal[3 * i + d];
    facet->value[d]  = 0;
  }
  if (w->kind[i] == DEM_WALL_TRACTION) {
    const PetscBool ended = (PetscBool)(model->traction_new[DEM_TRACTION * i + DEM_TRACTION_ENDED] > 0);

    if (face->pressed) { /* follows the facet */
      DemTurn(dim, n, p, model->rot, &w->normal[3 * i], turn);
      for (PetscInt d = 0; d < dim; d++) facet->normal[d] += turn[d];
    }
    for (PetscInt d = 0; d < dim; d++) facet->value[d] = face->stress[d] - (ended ? 0 : face->push) * facet->normal[d];
  } else if (w->kind[i] == DEM_WALL_RIM) {
    for (PetscInt d = 0; d < dim; d++) facet->value[d] = w->rim_u[3 * w->rim[i] + d] - model->u[d * n + p] - turn[d];
  } else if (w->kind[i] == DEM_WALL_GLUED) {
    for (PetscInt d = 0; d < dim; d++) facet->value[d] = face->shift[d] - model->u[d * n + p] - turn[d];
  } else {
    PetscReal gap = 0;

    for (PetscInt d = 0; d < dim; d++) gap += facet->normal[d] * (face->shift[d] - model->u[d * n + p] - turn[d]);
    for (PetscInt d = 0; d < dim; d++) facet->value[d] = gap * facet->normal[d];
  }
}

void DemWallsSum_Internal(DemModel model, PetscInt p, PetscReal *sum)
{
  const DemWalls *w = &model->walls;

  for (PetscInt i = w->start[p]; i < w->start[p + 1]; i++) {
    Facet     facet;
    PetscReal dot = 0, along = 0;

    FacetState(model, p, i, &facet);
    for (PetscInt d = 0; d < model->dim; d++) {
      dot += facet.value[d] * facet.arm[d];
      along += facet.value[d] * facet.normal[d];
    }
    if (w->kind[i] == DEM_WALL_TRACTION) *sum += w->area[i] * dot / (2 * model->g_shear);
    else if (w->kind[i] == DEM_WALL_GLUED) *sum += w->area[i] / w->h[i] * dot;
    else *sum += w->area[i] * along;
  }
}

/* Force and moment of facet i on particle p, dilation = S/V*; t[] the facet's force. */
static void FacetForce(DemModel model, PetscInt p, PetscInt i, PetscReal dilation, PetscReal t[3], PetscReal f[DEM_FORCE_ALL])
{
  const DemWalls *w = &model->walls;
  const PetscReal A = w->area[i], h = w->h[i], g2 = 2 * model->g_shear, lambda = model->lambda;
  Facet           facet;

  FacetState(model, p, i, &facet);
  switch (w->kind[i]) {
  case DEM_WALL_TRACTION:
    for (PetscInt d = 0; d < 3; d++) t[d] = A * facet.value[d];
    DemAddMoment(facet.arm, facet.value, -lambda * dilation * A / g2, f); /* S turns with the arm */
    break;
  case DEM_WALL_RIM: /* S alone: the rim has no spring of its own */
    for (PetscInt d = 0; d < 3; d++) {
      t[d]                         = A * lambda * dilation * facet.normal[d];
      w->rim_f[3 * w->rim[i] + d] = -t[d];
    }
    break;
  case DEM_WALL_SMOOTH:
    for (PetscInt d = 0; d < 3; d++) t[d] = A * (g2 / h * facet.value[d] + lambda * dilation * facet.normal[d]);
    break;
  default:
    for (PetscInt d = 0; d < 3; d++) t[d] = A / h * (g2 * facet.value[d] + lambda * dilation * facet.arm[d]);
    DemAddMoment(facet.value, facet.arm, lambda * dilation * A / h, f);
  }
  for (PetscInt d = 0; d < 3; d++) f[d] += t[d];
  DemAddMoment(facet.arm, t, 1, f);
}

void DemWallsForce_Internal(DemModel model, PetscInt p, PetscReal dilation, PetscReal f[DEM_FORCE_ALL])
{
  const DemWalls *w = &model->walls;

  for (PetscInt i = w->start[p]; i < w->start[p + 1]; i++) {
    PetscReal t[3];

    FacetForce(model, p, i, dilation, t, f);
  }
}

void DemFacetForce_Internal(DemModel model, PetscInt i, PetscReal t[3])
{
  PetscReal f[DEM_FORCE_ALL] = {0};

  FacetForce(model, model->walls.owner[i], i, model->dilation[model->walls.owner[i]], t, f);
}

PetscReal DemWallsEnergy_Internal(DemModel model)
{
  const DemWalls *w = &model->walls;
  PetscReal       sum = 0;

  for (PetscInt i = 0; i < w->n; i++) {
    Facet facet;

    if (w->kind[i] == DEM_WALL_TRACTION || w->kind[i] == DEM_WALL_RIM) continue;
    FacetState(model, w->owner[i], i, &facet);
    for (PetscInt d = 0; d < model->dim; d++) sum += model->g_shear * w->area[i] / w->h[i] * PetscSqr(facet.value[d]);
  }
  return sum;
}

/* Reaction of every held face (force of the support on the body), summed in particle order. */
void DemFacesReactions_Internal(DemModel model)
{
  const DemWalls *w = &model->walls;

  for (PetscInt k = 0; k < model->n_faces; k++)
    for (PetscInt d = 0; d < 3; d++) model->face[k].reaction[d] = 0;
  for (PetscInt i = 0; i < w->n; i++) {
    PetscReal t[3], f[DEM_FORCE_ALL] = {0};

    if (w->kind[i] == DEM_WALL_TRACTION || w->kind[i] == DEM_WALL_RIM) continue;
    FacetForce(model, w->owner[i], i, model->dilation[w->owner[i]], t, f);
    for (PetscInt d = 0; d < model->dim; d++) model->face[w->face[i]].reaction[d] += t[d];
  }
}

PetscReal DemTractionWork_Internal(DemModel model, const PetscReal *before, PetscReal *now)
{
  const DemWalls *w = &model->walls;
  PetscReal       work = 0;

  for (PetscInt i = 0; i < w->n; i++) {
    const PetscInt p = w->owner[i];
    PetscReal     *s = now + DEM_TRACTION * i, turn[3]; /* motion of the centroid, force, dilation per 2 G */
    Facet          facet;

    if (w->kind[i] != DEM_WALL_TRACTION) continue;
    FacetState(model, p, i, &facet);
    DemTurn(model->dim, model->n, p, model->rot, &w->arm[3 * i], turn);
    for (PetscInt d = 0; d < 3; d++) {
      s[d]     = (d < model->dim ? model->u[d * model->n + p] : 0) + turn[d];
      s[3 + d] = w->area[i] * facet.value[d];
    }
    s[6] = model->lambda * model->dilation[p] / (2 * model->g_shear);
    if (before) { /* of the force, and of its change on the condensed facet */
      const PetscReal *o = before + DEM_TRACTION * i;

      for (PetscInt d = 0; d < 3; d++) work += 0.5 * (s[3 + d] + o[3 + d]) * (s[d] - o[d]) + 0.5 * (s[6] + o[6]) * (s[3 + d] - o[3 + d]) * facet.arm[d];
    }
  }
  return work;
}
