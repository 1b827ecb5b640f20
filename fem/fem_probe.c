/*
  fem_probe.c - what the body does at a point: history columns.

  The element that holds the point interpolates its nodes. Stress is the recovered one, of the patches around that element
  alone. All columns of a row are made together, when the first of them is asked for.
*/
#include "fem_recover.h"

typedef enum { PROBE_DISPLACEMENT, PROBE_VELOCITY, PROBE_STRESS, PROBE_STRAIN, PROBE_VON_MISES, PROBE_PRINCIPAL } ProbeQuantity;

static const struct {
  const char *name, *unit;
  PetscInt    components;
} known[] = {{"displacement", "m", 3}, {"velocity", "m/s", 3}, {"stress", "Pa", 6}, {"strain", "-", 6}, {"von_mises", "Pa", 1}, {"principal_stress", "Pa", 3}};
static const char *const axis[] = {"x", "y", "z"}, *const pair[] = {"xx", "yy", "zz", "xy", "yz", "zx"}, *const place[] = {"1", "2", "3"};

typedef struct {
  char      name[128];
  PetscInt  cell; /* local element, -1: another rank's */
  PetscBool nowhere;
  PetscReal N[FEM_MAX_NODES];
} Probe;

typedef struct {
  PetscInt      probe, component;
  ProbeQuantity quantity;
} Column;

struct _FemProbes {
  PetscInt   n, n_columns;
  Probe     *probe;
  Column    *column;
  PetscReal *value; /* [n_columns] of the row at time t */
  PetscReal  t;
  PetscInt   asked;   /* the last column asked for; an earlier or equal one begins a new row */
  PetscBool  recover, listed;
};

PetscErrorCode FemProbesDestroy(FemModel model)
{
  FemProbes p = model->probes;

  PetscFunctionBegin;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(p->probe));
  PetscCall(PetscFree(p->column));
  PetscCall(PetscFree(p->value));
  PetscCall(PetscFree(model->probes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Place of this rank's elements nearest to a point outside; for messages. */
static PetscErrorCode Nearest(FemModel model, const PetscReal at[3], PetscReal *distance, PetscReal where[3])
{
  struct {
    double value;
    int    rank;
  } mine = {PETSC_MAX_REAL, model->rank}, least;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
    PetscReal       x[FEM_MAX_DOFS], xi[3], N[FEM_MAX_NODES], dN[FEM_MAX_NODES * 3], here[3], sum = 0;

    FemCellPlaces(model, c, x);
    if (FemPointFind(shape, x, at, xi) == PETSC_MAX_REAL)
      for (PetscInt i = 0; i < 3; i++) xi[i] = 0;
    FemPointClamp(shape->type, xi);
    (void)FemPointAt(shape, x, xi, N, dN, here);
    for (PetscInt d = 0; d < model->dim; d++) sum += PetscSqr(here[d] - at[d]);
    if (PetscSqrtReal(sum) < mine.value) {
      mine.value = PetscSqrtReal(sum);
      for (PetscInt d = 0; d < 3; d++) where[d] = d < model->dim ? here[d] : 0;
    }
  }
  PetscCallMPI(MPI_Allreduce(&mine, &least, 1, MPI_DOUBLE_INT, MPI_MINLOC, model->comm));
  *distance = least.value;
  PetscCallMPI(MPI_Bcast(where, 3, MPIU_REAL, least.rank, model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The element that holds the point: of several, the first of the mesh. */
static PetscErrorCode Locate(FemModel model, const PetscReal at[3], PetscBool anywhere, Probe *probe)
{
  PetscInt first = PETSC_MAX_INT, all;

  PetscFunctionBegin;
  probe->cell = -1;
  for (PetscInt c = 0; c < model->n_cells && first == PETSC_MAX_INT; c++) {
    const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
    PetscReal       x[FEM_MAX_DOFS], xi[3], dN[FEM_MAX_NODES * 3], here[3];
    PetscBool       near = PETSC_TRUE;

    if (!model->own[c]) continue;
    FemCellPlaces(model, c, x);
    for (PetscInt d = 0; d < model->dim; d++) {
      PetscReal low = PETSC_MAX_REAL, high = -PETSC_MAX_REAL;

      for (PetscInt a = 0; a < shape->nodes; a++) {
        low  = PetscMin(low, x[a * model->dim + d]);
        high = PetscMax(high, x[a * model->dim + d]);
      }
      near = (PetscBool)(near && at[d] >= low - 0.25 * (high - low) && at[d] <= high + 0.25 * (high - low)); /* a curved side bulges less */
    }
    if (!near || FemPointFind(shape, x, at, xi) > 1e-6) continue;
    first       = model->cell_gid[c];
    probe->cell = c;
    (void)FemPointAt(shape, x, xi, probe->N, dN, here);
  }
  PetscCallMPI(MPI_Allreduce(&first, &all, 1, MPIU_INT, MPI_MIN, model->comm));
  probe->nowhere = (PetscBool)(all == PETSC_MAX_INT);
  if (all == PETSC_MAX_INT && !anywhere) {
    PetscReal distance, where[3] = {0, 0, 0};

    PetscCall(Nearest(model, at, &distance, where));
    if (model->dim == 2) SETERRQ(model->comm, PETSC_ERR_USER_INPUT, "%s: probe '%s' at (%.6g, %.6g) m lies outside the finite elements, about %.3g m from their nearest place (%.6g, %.6g) m", model->source, probe->name, (double)at[0], (double)at[1], (double)distance, (double)where[0], (double)where[1]);
    SETERRQ(model->comm, PETSC_ERR_USER_INPUT, "%s: probe '%s' at (%.6g, %.6g, %.6g) m lies outside the finite elements, about %.3g m from their nearest place (%.6g, %.6g, %.6g) m", model->source, probe->name, (double)at[0], (double)at[1], (double)at[2], (double)distance, (double)where[0], (double)where[1], (double)where[2]);
  }
  if (first != all) probe->cell = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Is this component there in the plane? */
static PetscBool Shown(PetscInt dim, ProbeQuantity quantity, PetscInt component)
{
  if (dim == 3) return PETSC_TRUE;
  if (quantity <= PROBE_VELOCITY) return (PetscBool)(component < 2);
  return (PetscBool)(known[quantity].components < 6 || component < 4);
}

static PetscErrorCode AddColumns(FemModel model, const char *name, const char *word)
{
  FemProbes p = model->probes;
  PetscInt  q = 0;
  PetscBool same = PETSC_FALSE;

  PetscFunctionBegin;
  for (q = 0; q < 6; q++) {
    PetscCall(PetscStrcmp(word, known[q].name, &same));
    if (same) break;
  }
  BaseCheckInput(same, model->comm, "Probe '%s': a point has no quantity '%s'; it has displacement, velocity, stress, strain, von_mises, principal_stress", name, word);
  if (q >= PROBE_STRESS) p->recover = PETSC_TRUE;
  for (PetscInt k = 0; k < known[q].components; k++) {
    const char *part = known[q].components == 6 ? pair[k] : q == PROBE_PRINCIPAL ? place[k] : axis[k];
    char        line[BASE_LINE];

    if (!Shown(model->dim, (ProbeQuantity)q, k)) continue;
    PetscCall(PetscRealloc(sizeof(Column) * (p->n_columns + 1), &p->column));
    p->column[p->n_columns] = (Column){p->n - 1, k, (ProbeQuantity)q};
    PetscCall(PetscRealloc(sizeof(FemHistory) * (model->n_history + 1), &model->history));
    PetscCall(PetscRealloc(sizeof(char *) * (model->n_history + 1), &model->history_name));
    PetscCall(PetscRealloc(sizeof(char *) * (model->n_history + 1), &model->history_unit));
    if (known[q].components == 1) PetscCall(BaseFormat(line, "%s(%s)", word, name));
    else PetscCall(BaseFormat(line, "%s(%s).%s", word, name, part));
    PetscCall(PetscStrallocpy(line, &model->history_name[model->n_history]));
    model->history_unit[model->n_history] = known[q].unit;
    model->history[model->n_history++]    = (FemHistory){.quantity = FEM_HIST_PROBE, .group = -1, .component = p->n_columns++};
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddProbe(FemModel model, const char *name, const PetscReal at[3], PetscBool anywhere, PetscInt n, const char *const quantity[])
{
  FemProbes p;

  PetscFunctionBegin;
  PetscCheck(model && model->has_mesh && !model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "A probe is set between FemModelSetMesh() and FemModelSetUp()");
  if (!model->probes) PetscCall(PetscCalloc1(1, &model->probes));
  p = model->probes;
  PetscCall(PetscRealloc(sizeof(Probe) * (p->n + 1), &p->probe));
  PetscCall(PetscMemzero(&p->probe[p->n], sizeof(Probe)));
  PetscCall(PetscStrncpy(p->probe[p->n].name, name, sizeof(p->probe[p->n].name)));
  PetscCall(Locate(model, at, anywhere, &p->probe[p->n++]));
  for (PetscInt k = 0; k < n; k++) PetscCall(AddColumns(model, name, quantity[k]));
  PetscCall(PetscRealloc(sizeof(PetscReal) * p->n_columns, &p->value));
  p->asked = p->n_columns;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelAddProbe(FemModel model, const char *name, const PetscReal at[3], PetscInt n, const char *const quantity[])
{
  return AddProbe(model, name, at, PETSC_FALSE, n, quantity);
}

PetscErrorCode FemModelAddProbeAnywhere(FemModel model, const char *name, const PetscReal at[3], PetscInt n, const char *const quantity[])
{
  return AddProbe(model, name, at, PETSC_TRUE, n, quantity);
}

/* ---- a row ---- */

/* Which patches the probes need; once. */
static PetscErrorCode ListPatches(FemModel model)
{
  FemProbes p = model->probes;
  PetscInt *wanted;

  PetscFunctionBegin;
  PetscCall(FemRecoveryCreate(model));
  PetscCall(PetscCalloc1(model->n_loc, &wanted));
  for (PetscInt k = 0; k < p->n; k++) {
    PetscBool stress = PETSC_FALSE;

    for (PetscInt j = 0; j < p->n_columns; j++) stress = (PetscBool)(stress || (p->column[j].probe == k && p->column[j].quantity >= PROBE_STRESS));
    if (p->probe[k].cell < 0 || !stress) continue;
    for (PetscInt e = model->cell_start[p->probe[k].cell]; e < model->cell_start[p->probe[k].cell + 1]; e++) wanted[model->cell_node[e]] = 1;
  }
  PetscCall(FemRequestCreate(model, wanted, &model->recovery->probed));
  PetscCall(PetscFree(wanted));
  p->listed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal ColumnValue(FemModel model, const Column *column, const PetscReal *v)
{
  const Probe    *probe = &model->probes->probe[column->probe];
  const PetscInt  c = probe->cell, dim = model->dim, *node = &model->cell_node[model->cell_start[c]], n = model->cell_start[c + 1] - model->cell_start[c];
  PetscReal       part[6] = {0}, stress[6], strain[6], principal[3], sum = 0;
  FemRecovery     r = model->recovery;

  if (column->quantity <= PROBE_VELOCITY) {
    const PetscReal *from = column->quantity == PROBE_VELOCITY ? v : model->u;

    for (PetscInt a = 0; a < n; a++) sum += probe->N[a] * from[node[a] * dim + column->component];
    return sum;
  }
  for (PetscInt a = 0; a < n; a++) {
    const PetscInt slot = FemSlotOf(r, node[a], r->law[model->cell_material[c]]);

    for (PetscInt i = 0; i < r->parts; i++) part[i] += probe->N[a] * r->value[slot * r->parts + i];
  }
  FemStressExpand(dim, &model->law[model->cell_material[c]], part, stress, strain);
  if (model->pre.n) {
    PetscReal x[3] = {0, 0, 0};

    for (PetscInt a = 0; a < n; a++)
      for (PetscInt d = 0; d < dim; d++) x[d] += probe->N[a] * model->x[node[a] * dim + d];
    FemAddPrestressAt(model, c, x, stress, strain);
  }
  if (column->quantity == PROBE_STRESS) return stress[column->component];
  if (column->quantity == PROBE_STRAIN) return strain[column->component];
  if (column->quantity == PROBE_VON_MISES) return FemVonMises(stress);
  FemPrincipal(stress, principal, NULL);
  return principal[column->component];
}

static PetscErrorCode MakeRow(FemModel model)
{
  FemProbes  p = model->probes;
  PetscReal *v = NULL;

  PetscFunctionBegin;
  if (p->recover && !p->listed) PetscCall(ListPatches(model));
  if (p->recover) PetscCall(FemRecover(model, &model->recovery->probed));
  for (PetscInt j = 0; j < p->n_columns && !v; j++)
    if (p->column[j].quantity == PROBE_VELOCITY) {
      PetscCall(PetscMalloc1(model->n_loc * model->dim, &v));
      for (PetscInt k = 0; k < model->n_own * model->dim; k++) v[k] = FemVelocityOf(model, k);
      PetscCall(FemGhosts(model, v));
    }
  for (PetscInt j = 0; j < p->n_columns; j++) p->value[j] = p->probe[p->column[j].probe].cell < 0 ? 0 : ColumnValue(model, &p->column[j], v);
  PetscCall(PetscFree(v));
  PetscCall(FemSum(model, p->n_columns, p->value));
  for (PetscInt j = 0; j < p->n_columns; j++)
    if (p->probe[p->column[j].probe].nowhere) p->value[j] = NAN;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemProbesHistory(FemModel model, PetscInt i, PetscReal *value)
{
  FemProbes      p = model->probes;
  const PetscInt j = model->history[i].component;

  PetscFunctionBegin;
  if (j <= p->asked || p->t != model->t) PetscCall(MakeRow(model));
  p->asked = j;
  p->t     = model->t;
  *value   = p->value[j];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetGroupMiddle(FemModel model, const char *name, PetscReal middle[3])
{
  PetscInt g;

  PetscFunctionBegin;
  PetscCall(FemFindGroup(model, name, &g));
  for (PetscInt d = 0; d < 3; d++) middle[d] = 0;
  for (PetscInt k = 0; k < model->group[g].n_nodes; k++)
    for (PetscInt d = 0; d < model->dim; d++) middle[d] += model->x[model->group[g].node[k] * model->dim + d] / model->group[g].n_nodes_global;
  PetscCall(FemSum(model, 3, middle));
  PetscFunctionReturn(PETSC_SUCCESS);
}
