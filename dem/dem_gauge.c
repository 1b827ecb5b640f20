/* dem_gauge.c - columns of the history that belong to the whole body: a gauge in its middle, and how quasi-static the test is.  Eqs (4.70), (4.71) */
#include "dem_impl.h"

static PetscInt LongestAxis(DemModel model)
{
  PetscInt a = 0;

  for (PetscInt d = 1; d < model->dim; d++)
    if (model->body.high[d] - model->body.low[d] > (model->body.high[a] - model->body.low[a]) * (1 + 1e-12)) a = d;
  return a;
}

PetscErrorCode DemModelAddColumns(DemModel model, const char *quantity)
{
  static const char *const gauge[] = {"stress.x", "stress.y", "stress.z", "strain.x", "strain.y", "strain.z", "modulus", "poisson"};
  static const char *const gauge_unit[] = {"Pa", "Pa", "Pa", "-", "-", "-", "Pa", "-"};
  static const char *const quality[] = {"unbalanced", "kinetic_ratio"}, *const grains[] = {"grains.present", "grains.come", "grains.left"};
  const PetscBool          is_gauge = strcmp(quantity, "gauge") ? PETSC_FALSE : PETSC_TRUE;
  const PetscBool          is_grains = strcmp(quantity, "grains") ? PETSC_FALSE : PETSC_TRUE;
  const PetscInt           n = is_gauge ? 8 : is_grains ? 3 : 2;
  DemHistory              *grown;

  PetscFunctionBegin;
  BaseCheckInput(is_gauge || is_grains || !strcmp(quantity, "quality"), model->comm, "History quantity '%s' is not known for particles; known without a group: gauge, quality, grains", quantity);
  PetscCheck(model->packing.n, model->comm, PETSC_ERR_ORDER, "Call DemModelSetBody() before asking for columns");
  PetscCall(PetscMalloc1(model->n_history + n, &grown));
  PetscCall(PetscArraycpy(grown, model->history, model->n_history));
  PetscCall(PetscFree(model->history));
  model->history = grown;
  for (PetscInt c = 0; c < n; c++) {
    DemHistory *h = &model->history[model->n_history];
    char        name[64];

    if (is_gauge && model->dim == 2 && (c == 2 || c == 5)) continue;
    PetscCall(PetscStrncpy(h->quantity, quantity, sizeof(h->quantity)));
    h->face = h->tool = -1;
    h->component      = c;
    h->unit           = is_gauge ? gauge_unit[c] : "-";
    PetscCall(BaseFormat(name, "%s%s", is_gauge ? "gauge." : "", is_gauge ? gauge[c] : is_grains ? grains[c] : quality[c]));
    PetscCall(PetscStrallocpy(name, &h->name));
    model->n_history++;
  }
  model->quality[1] = model->quality[2] = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Gauge(DemModel model)
{
  const PetscInt  n = model->n, dim = model->dim, a = LongestAxis(model);
  const PetscReal middle = 0.5 * (model->body.low[a] + model->body.high[a]), reach = 0.25 * (model->body.high[a] - model->body.low[a]);
  PetscReal      *stress, volume = 0, lateral = 0, *g = model->gauge, mx[3] = {0}, mu[3] = {0}, xx[3] = {0}, xu[3] = {0};

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(6 * n, &stress));
  PetscCall(DemStress_Internal(model, stress));
  for (PetscInt c = 0; c < 8; c++) g[c] = 0;
  for (PetscInt k = 0; k < model->own; k++) {
    const PetscReal V = model->volume[model->rank_of[k]];

    if (PetscAbsReal(model->packing.x[3 * k + a] - middle) > reach) continue;
    volume += V;
    for (PetscInt c = 0; c < 3; c++) g[c] += V * stress[6 * k + c];
    for (PetscInt c = 0; c < dim; c++) {
      mx[c] += V * model->packing.x[3 * k + c];
      mu[c] += V * model->u[c * n + model->rank_of[k]];
    }
  }
  if (model->ranks) {
    PetscReal all[10] = {volume, g[0], g[1], g[2], mx[0], mx[1], mx[2], mu[0], mu[1], mu[2]};

    PetscCall(DemSumRanks_Internal(model, 10, all));
    volume = all[0];
    for (PetscInt c = 0; c < 3; c++) {
      g[c]  = all[1 + c];
      mx[c] = all[4 + c];
      mu[c] = all[7 + c];
    }
  }
  volume = PetscMax(volume, PETSC_MIN_REAL);
  for (PetscInt k = 0; k < model->own; k++) { /* slope of u_c on x_c: right for linear fields, which cell means (4.16) are not at the surface */
    const PetscReal V = model->volume[model->rank_of[k]];

    if (PetscAbsReal(model->packing.x[3 * k + a] - middle) > reach) continue;
    for (PetscInt c = 0; c < dim; c++) {
      const PetscReal x = model->packing.x[3 * k + c] - mx[c] / volume;

      xx[c] += V * x * x;
      xu[c] += V * x * (model->u[c * n + model->rank_of[k]] - mu[c] / volume);
    }
  }
  PetscCall(DemSumRanks_Internal(model, 3, xx));
  PetscCall(DemSumRanks_Internal(model, 3, xu));
  for (PetscInt c = 0; c < 3; c++) g[c] /= volume;
  for (PetscInt c = 0; c < dim; c++) g[3 + c] = xx[c] > 0 ? xu[c] / xx[c] : 0;
  for (PetscInt d = 0; d < dim; d++)
    if (d != a) lateral += g[3 + d] / (dim - 1);
  if (g[3 + a] != 0) {
    g[6] = g[a] / g[3 + a];
    g[7] = -lateral / g[3 + a];
  }
  PetscCall(PetscFree(stress));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemColumn_Internal(DemModel model, const DemHistory *h, PetscReal *value)
{
  PetscReal kinetic, due, strain;

  PetscFunctionBegin;
  if (h->quantity[0] == 'g' && h->quantity[1] == 'r') {
    const PetscInt all = DemGrains_Internal(model), come = model->rain.rate > 0 ? model->rain.next : all, present = all - DemGrainsGone_Internal(model);

    *value = (PetscReal)(h->component == 0 ? present : h->component == 1 ? come : come - present);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (h->quantity[0] == 'g') {
    if (h->component == 0) PetscCall(Gauge(model)); /* once a row */
    *value = model->gauge[h->component];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (h->component == 0) {
    *value = 0;
    if (model->bonds.n) PetscCall(DemUnbalanced_Internal(model, value));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(DemKineticEnergy_Internal(model, &kinetic, &due));
  PetscCall(DemStrainEnergy_Internal(model, &strain));
  *value = strain > 0 ? kinetic / strain : 0;
  if (strain > model->quality[0]) {
    model->quality[0] = strain;
    model->quality[2] = *value;
    PetscCall(DemUnbalanced_Internal(model, &model->quality[1]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetQuality(DemModel model, PetscReal *unbalanced, PetscReal *kinetic)
{
  PetscFunctionBegin;
  *unbalanced = model->quality[0] > 0 ? model->quality[1] : -1;
  *kinetic    = model->quality[0] > 0 ? model->quality[2] : -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}
