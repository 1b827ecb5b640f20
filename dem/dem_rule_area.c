/* dem_rule_area.c - areas by virtual regular polyhedra, as the KDEM of the thesis has them (4.6.2, appendices B and C).  Eqs (4.66)-(4.68) */
#include "dem_rule.h"

/* Surface of a regular polyhedron over that of its inscribed sphere, 4 to 20 faces: the regular solids, linear in between. Santasusana, table C.2. */
static const PetscReal solid[] = {3.30797, 2.60892, 1.90986, 1.78192, 1.65399, 1.57175, 1.48951, 1.40727, 1.32503, 1.31023, 1.29542, 1.28061, 1.2658, 1.25099, 1.23618, 1.22138, 1.20657};

static PetscReal Ratio(PetscInt dim, PetscInt n)
{
  if (dim == 2) return n < 3 ? 3 / PETSC_PI * PetscTanReal(PETSC_PI / 3) : n / PETSC_PI * PetscTanReal(PETSC_PI / n);
  return n < 4 ? solid[0] : n > 20 ? 1.15 : solid[n - 4];
}

PetscErrorCode DemPolyhedronAreas_Internal(DemModel model, PetscReal area[])
{
  const PetscInt  n = model->n, dim = model->dim;
  const PetscReal t = model->body.thickness;
  const DemBonds *b = &model->bonds;
  const DemCells *cells = &model->cells;
  PetscReal      *sum, *gamma;
  PetscInt       *bonds, inner = 11, deep = 0, held = 0; /* inner: bonds of an inner particle, for those at the surface */
  PetscBool      *skin;

  PetscFunctionBegin;
  PetscCall(PetscCalloc4(n, &sum, n, &gamma, n, &bonds, n, &skin));
  for (PetscInt e = 0; e < b->n; e++) {
    const PetscReal rp = model->r[b->p[e]], rq = model->r[b->q[e]], rc = 2 * rp * rq / (rp + rq);

    area[e] = dim == 3 ? PETSC_PI * rc * rc : 2 * rc * t;
    sum[b->p[e]] += area[e];
    sum[b->q[e]] += area[e];
    bonds[b->p[e]]++;
    bonds[b->q[e]]++;
  }
  for (PetscInt w = 0; w < cells->n_walls; w++) { /* at the surface: nearer to a face than 1.25 radii */
    const PetscReal *normal = cells->wall_normal + 3 * w, *x = model->packing.x + 3 * cells->wall_p[w], *at = cells->wall_at + 3 * w;
    const PetscReal  h = normal[0] * (at[0] - x[0]) + normal[1] * (at[1] - x[1]) + normal[2] * (at[2] - x[2]);

    if (h < 1.25 * model->packing.r[cells->wall_p[w]]) skin[model->rank_of[cells->wall_p[w]]] = PETSC_TRUE;
  }
  for (PetscInt p = 0; p < n; p++)
    if (!skin[p]) {
      deep++;
      held += bonds[p];
    }
  if (dim == 2 && deep) inner = (PetscInt)(0.5 + (PetscReal)held / deep);
  if (dim == 2) inner = PetscMax(inner, 3);
  for (PetscInt p = 0; p < n; p++) {
    const PetscReal sphere = dim == 3 ? 4 * PETSC_PI * model->r[p] * model->r[p] : 2 * PETSC_PI * model->r[p] * t;

    if (bonds[p]) gamma[p] = (skin[p] ? Ratio(dim, inner) * bonds[p] / inner : Ratio(dim, bonds[p])) * sphere / sum[p];
  }
  for (PetscInt e = 0; e < b->n; e++) {
    const PetscInt p = b->p[e], q = b->q[e];

    area[e] *= skin[p] == skin[q] ? 0.5 * (gamma[p] + gamma[q]) : skin[p] ? gamma[q] : gamma[p];
  }
  PetscCall(PetscFree4(sum, gamma, bonds, skin));
  PetscFunctionReturn(PETSC_SUCCESS);
}
