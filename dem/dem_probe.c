/*
  dem_probe.c - what the body does at a point: history columns of the particle whose cell holds it.

  Motion is the particle's, carried rigidly to the point; stress and strain are its cell's means, eqs (4.15), (4.16).
*/
#include "dem_impl.h"

static const struct {
  const char *name, *unit;
  PetscInt    components;
} known[] = {{"displacement", "m", 3}, {"velocity", "m/s", 3}, {"stress", "Pa", 6}, {"strain", "-", 6}, {"von_mises", "Pa", 1}, {"principal_stress", "Pa", 3}};
static const char *const axis[] = {"x", "y", "z"}, *const pair[] = {"xx", "yy", "zz", "xy", "yz", "zx"}, *const place[] = {"1", "2", "3"};

/* The particle of least power distance, if the point is no further from it than a cell reaches. */
static PetscInt Holder(DemModel model, const PetscReal at[3])
{
  PetscReal best = PETSC_MAX_REAL, least = 0;
  PetscInt  found = -1;

  for (PetscInt k = 0; k < model->packing.n; k++) {
    PetscReal d2 = 0;

    for (PetscInt d = 0; d < model->dim; d++) d2 += PetscSqr(model->packing.x[3 * k + d] - at[d]);
    if (d2 - PetscSqr(model->packing.r[k]) < best) {
      best  = d2 - PetscSqr(model->packing.r[k]);
      least = d2;
      found = k;
    }
  }
  return found >= 0 && least < PetscSqr(2 * model->packing.r[found]) ? found : -1;
}

PetscErrorCode DemModelAddProbe(DemModel model, const char *name, const PetscReal at[3], PetscInt n, const char *const quantity[])
{
  const PetscInt dim = model->dim, particle = Holder(model, at);

  PetscFunctionBegin;
  PetscCheck(model->packing.n && !model->ready, model->comm, PETSC_ERR_ORDER, "A probe is set between DemModelSetBody() and DemModelSetUp()");
  for (PetscInt i = 0; i < n; i++) {
    PetscInt q = 0;

    while (q < 6 && strcmp(quantity[i], known[q].name)) q++;
    BaseCheckInput(q < 6, model->comm, "Probe '%s': a point has no quantity '%s'; it has displacement, velocity, stress, strain, von_mises, principal_stress", name, quantity[i]);
    for (PetscInt c = 0; c < known[q].components; c++) {
      const char *part = known[q].components == 6 ? pair[c] : q == 5 ? place[c] : axis[c];
      DemHistory *grown, *h;
      char        line[300];

      if (dim == 2 && ((q < 2 && c == 2) || (known[q].components == 6 && c > 3))) continue;
      PetscCall(PetscCalloc1(model->n_history + 1, &grown));
      PetscCall(PetscArraycpy(grown, model->history, model->n_history));
      PetscCall(PetscFree(model->history));
      model->history = grown;
      h              = &model->history[model->n_history++];
      PetscCall(BaseFormat(h->quantity, "p%s", quantity[i]));
      h->face = h->tool = -1;
      h->component      = c;
      h->particle       = particle;
      h->unit           = known[q].unit;
      for (PetscInt d = 0; d < dim && particle >= 0; d++) h->arm[d] = at[d] - model->packing.x[3 * particle + d];
      if (known[q].components == 1) PetscCall(BaseFormat(line, "%s(%s)", quantity[i], name));
      else PetscCall(BaseFormat(line, "%s(%s).%s", quantity[i], name, part));
      PetscCall(PetscStrallocpy(line, &h->name));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stress and strain of all particles, once a row. */
static PetscErrorCode Row(DemModel model)
{
  PetscFunctionBegin;
  if (model->probed && model->probed_time == model->time) PetscFunctionReturn(PETSC_SUCCESS);
  if (!model->probed) PetscCall(PetscMalloc1(12 * model->n, &model->probed));
  PetscCall(DemStress_Internal(model, model->probed));
  PetscCall(DemStrain_Internal(model, model->probed + 6 * model->n));
  model->probed_time = model->time;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemProbe_Internal(DemModel model, const DemHistory *h, PetscReal *value)
{
  const PetscInt   dim = model->dim, n = model->n, c = h->component;
  const char      *q = h->quantity + 1;
  const PetscReal *s;
  PetscReal        principal[3];

  PetscFunctionBegin;
  *value = NAN;
  if (h->particle < 0) PetscFunctionReturn(PETSC_SUCCESS);
  const PetscInt p = model->rank_of[h->particle];

  if (q[0] == 'd' || (q[0] == 'v' && q[1] == 'e')) {
    PetscReal turn[3], arm[3] = {h->arm[0], h->arm[1], h->arm[2]}, w[3] = {0, 0, dim == 2 ? model->spin[p] : 0};

    DemTurn(dim, n, p, model->rot, arm, turn);
    if (q[0] == 'd') *value = model->u[c * n + p] + turn[c] - (model->begin ? model->begin[3 * h->particle + c] : 0);
    else {
      for (PetscInt d = 0; d < 3 && dim == 3; d++) w[d] = model->spin[d * n + p];
      for (PetscInt d = 0; d < 3; d++) arm[d] += turn[d];
      *value = model->v[c * n + p] + 0.5 * (model->started ? model->dt_last : 0) / model->mass[p] * model->f[c * n + p] + w[(c + 1) % 3] * arm[(c + 2) % 3] - w[(c + 2) % 3] * arm[(c + 1) % 3];
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(Row(model));
  s = model->probed + 6 * h->particle + (strcmp(q, "strain") ? 0 : 6 * n);
  if (q[0] == 's') *value = s[c];
  else if (q[0] == 'v') *value = PetscSqrtReal(0.5 * (PetscSqr(s[0] - s[1]) + PetscSqr(s[1] - s[2]) + PetscSqr(s[2] - s[0])) + 3 * (PetscSqr(s[3]) + PetscSqr(s[4]) + PetscSqr(s[5])));
  else {
    DemPrincipalValues(3, s, principal);
    *value = principal[c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
