/* dem_bond_list.c - every bond as the outside sees it: stresses, damage, how near to failure; coordination and fragments.  Eqs (4.63), (4.64) */
#include "dem_rule.h"

static inline PetscReal Dot3(const PetscReal a[3], const PetscReal b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Criteria of the mean stress of the ends of bond k; stress in packing's order. */
static void MeanCriteria(DemModel model, PetscInt k, const PetscReal *stress, PetscReal *rankine, PetscReal *coulomb)
{
  const DemStrength *s = &model->strength;
  const PetscInt     p = model->bonds.p[k], q = model->bonds.q[k];
  const PetscReal    vp = model->volume[p], vq = model->volume[q];
  PetscReal          mean[6], value[3];

  for (PetscInt c = 0; c < 6; c++) mean[c] = (stress[6 * model->at[p] + c] * vp + stress[6 * model->at[q] + c] * vq) / (vp + vq);
  DemPrincipalValues(model->dim, mean, value);
  *rankine = s->tensile > 0 ? value[0] / s->tensile : 0;
  *coulomb = s->shear > 0 ? DemMohrCoulomb(value, s->mu_static, s->shear) : 0;
}

/* Springs.  Eq. (4.63) */
static PetscReal PairCriterion(DemModel model, PetscInt k, const PetscReal *stress, const DemPairForce *now)
{
  const DemStrength *s = &model->strength;
  DemNetwork         net = model->net;
  const PetscReal    A = net->area[k];
  PetscReal          worst = 0;

  if (s->nonlocal) {
    PetscReal rankine, coulomb;

    MeanCriteria(model, k, stress, &rankine, &coulomb);
    return PetscMax(rankine, coulomb);
  }
  if (s->shear > 0) worst = now->shear / (s->shear * A + s->mu_static * PetscMax(0, -now->normal));
  if (s->tensile > 0 && now->normal > 0) {
    PetscReal         at[2][DEM_AT_ALL];
    const DemPairView view = {at[0], at[1]};
    const PetscReal   delta = DemPublishedDelta(s->delta_n, s->fracture_energy, s->tensile, A, net->kn[k]);
    DemPairState      pair;
    PetscReal         opened;

    DemCopyParticle_Internal(model, model->bonds.p[k], at[0]);
    DemCopyParticle_Internal(model, model->bonds.q[k], at[1]);
    DemPairGeometry_Internal(model->dim, &view, net->part[k], &pair);
    opened = (pair.open - net->hist[DEM_PAST_SET * model->bonds.n + k]) * net->kn[k] / (s->tensile * A * (1 + delta));
    worst  = PetscMax(worst, opened);
  }
  return worst;
}

static PetscErrorCode Allocate(DemModel model)
{
  const PetscInt m = model->bonds.n;

  PetscFunctionBegin;
  if (!model->list.p) PetscCall(PetscMalloc4(m, &model->list.p, m, &model->list.q, 4 * m, &model->list.value, m, &model->list.state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemBondListDestroy_Internal(DemModel model)
{
  PetscFunctionBegin;
  if (model->list.p) PetscCall(PetscFree4(model->list.p, model->list.q, model->list.value, model->list.state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetBonds(DemModel model, DemBondList *list)
{
  const DemBonds *b = &model->bonds;
  const PetscInt  m = b->n, n = model->n;
  const PetscBool breaks = (PetscBool)(model->crack.damage != NULL);
  PetscReal      *stress = NULL, *sigma, *tau, *damage, *criterion;

  PetscFunctionBegin;
  PetscCall(Allocate(model));
  sigma     = model->list.value;
  tau       = sigma + m;
  damage    = tau + m;
  criterion = damage + m;
  if (breaks && (model->strength.nonlocal || !model->net)) {
    PetscCall(PetscMalloc1(6 * n, &stress));
    PetscCall(DemStress_Internal(model, stress));
    if (model->ranks) PetscCall(DemHaloStress_Internal(model, stress));
  }
  for (PetscInt k = 0; k < m; k++) {
    const PetscInt p = b->p[k], q = b->q[k];
    PetscReal      t[3], normal[3] = {0}, d = 0, area, along;
    DemPairForce   now;

    model->list.p[k] = model->at[p];
    model->list.q[k] = model->at[q];
    for (PetscInt c = 0; c < model->dim; c++) {
      normal[c] = model->x0[c * n + q] - model->x0[c * n + p];
      d += normal[c] * normal[c];
    }
    d    = PetscSqrtReal(d);
    area = b->k[k] * d;
    if (model->net) {
      DemPairNow_Internal(model, k, &now);
      sigma[k] = now.normal / area;
      tau[k]   = now.shear / area;
    } else {
      PetscReal turn[3], t2;

      DemBondForce_Internal(model, k, t);
      DemTurn(model->dim, n, p, model->rot, normal, turn);
      for (PetscInt c = 0; c < 3; c++) normal[c] = (normal[c] + turn[c]) / d;
      along    = Dot3(t, normal);
      t2       = Dot3(t, t) - along * along;
      sigma[k] = along / area;
      tau[k]   = PetscSqrtReal(PetscMax(0, t2)) / area;
    }
    damage[k]    = breaks ? model->crack.damage[k] : 0;
    criterion[k] = 0;
    if (breaks && damage[k] < 1) {
      if (model->net) criterion[k] = PairCriterion(model, k, stress, &now);
      else { /* facets of `exact`: Rankine on the mean stress, shear as the law has it */
        const DemStrength *s = &model->strength;
        PetscReal          rankine, coulomb;

        MeanCriteria(model, k, stress, &rankine, &coulomb);
        if (!s->nonlocal && s->shear > 0) coulomb = (tau[k] + s->mu_static * sigma[k]) / ((1 - damage[k]) * s->shear);
        criterion[k] = PetscMax(rankine, coulomb);
        if (damage[k] > 0) criterion[k] = 1;
      }
      criterion[k] = PetscMax(0, PetscMin(1, criterion[k]));
    } else if (breaks) criterion[k] = 1;
    model->list.state[k] = !breaks || damage[k] == 0 ? 0 : damage[k] < 0.9999 ? 1 : (model->crack.state[k] & (DEM_BOND_PARTED | DEM_BOND_APART)) ? 3 : 2;
  }
  PetscCall(PetscFree(stress));
  *list = (DemBondList){m, model->list.p, model->list.q, sigma, tau, damage, criterion, model->list.state};
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool Holds(DemModel model, PetscInt k)
{
  return (PetscBool)(!model->crack.damage || model->crack.damage[k] < 0.9999);
}

void DemCoordination_Internal(DemModel model, PetscReal *number)
{
  for (PetscInt k = 0; k < model->n; k++) number[k] = 0;
  for (PetscInt k = 0; k < model->bonds.n; k++)
    if (Holds(model, k)) {
      number[model->at[model->bonds.p[k]]]++;
      number[model->at[model->bonds.q[k]]]++;
    }
}

PetscErrorCode DemCriterion_Internal(DemModel model, PetscReal *criterion)
{
  DemBondList list;

  PetscFunctionBegin;
  PetscCall(DemModelGetBonds(model, &list));
  for (PetscInt k = 0; k < model->n; k++) criterion[k] = 0;
  for (PetscInt k = 0; k < list.n; k++) {
    criterion[list.p[k]] = PetscMax(criterion[list.p[k]], list.criterion[k]);
    criterion[list.q[k]] = PetscMax(criterion[list.q[k]], list.criterion[k]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Root of p's tree, halving the path. */
static PetscInt Root(PetscInt *up, PetscInt p)
{
  while (up[p] != p) p = up[p] = up[up[p]];
  return p;
}

typedef struct {
  PetscReal mass;
  PetscInt  root; /* lowest packing's number in it */
} Part;

static int Heavier(const void *a, const void *b)
{
  const Part *s = a, *t = b;

  if (s->mass != t->mass) return s->mass > t->mass ? -1 : 1;
  return s->root < t->root ? -1 : s->root > t->root;
}

/* Parts of n particles that m pairs hold together; fragment of each, 0 the heaviest. */
static PetscErrorCode Parts(PetscInt n, const PetscReal mass[], PetscInt m, const PetscInt pair[], PetscInt *n_parts, PetscInt fragment[])
{
  PetscInt *up, parts = 0;
  Part     *part;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n, &up, n, &part));
  for (PetscInt p = 0; p < n; p++) up[p] = p;
  for (PetscInt k = 0; k < m; k++) { /* the lower number stays on top: the result hangs on no order */
    const PetscInt a = Root(up, pair[2 * k]), b = Root(up, pair[2 * k + 1]);

    if (a != b) up[PetscMax(a, b)] = PetscMin(a, b);
  }
  for (PetscInt p = 0; p < n; p++) part[p] = (Part){0, p};
  for (PetscInt p = 0; p < n; p++) part[Root(up, p)].mass += mass[p];
  for (PetscInt p = 0; p < n; p++)
    if (up[p] == p) part[parts++] = (Part){part[p].mass, p};
  qsort(part, parts, sizeof(*part), Heavier);
  for (PetscInt p = 0; p < n; p++) up[p] = Root(up, p);
  for (PetscInt k = 0; k < parts; k++) fragment[part[k].root] = k;
  for (PetscInt p = 0; p < n; p++) fragment[p] = fragment[up[p]]; /* a root comes before all others of its part */
  *n_parts = parts;
  PetscCall(PetscFree2(up, part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 finds the parts and tells the others. */
static PetscErrorCode PartsOfRanks(DemModel model, PetscInt m, PetscInt pair[], PetscInt *n_parts, PetscInt fragment[])
{
  const DemRanks r = model->ranks;
  PetscInt      *key, *pairs, *whole, n;
  PetscReal     *mass;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m, &key));
  for (PetscInt k = 0; k < m; k++) {
    key[k]          = k;
    pair[2 * k]     = r->number[pair[2 * k]];
    pair[2 * k + 1] = r->number[pair[2 * k + 1]];
  }
  PetscCall(DemGatherInts_Internal(model, m, key, 2, pair, &m, &pairs));
  PetscCall(DemGatherReals_Internal(model, model->own, r->number, 1, model->mass, &n, &mass));
  PetscCall(PetscMalloc1(r->particles, &whole));
  if (r->rank == 0) PetscCall(Parts(n, mass, m, pairs, n_parts, whole));
  PetscCallMPI(MPI_Bcast(n_parts, 1, MPIU_INT, 0, model->comm));
  PetscCallMPI(MPI_Bcast(whole, (PetscMPIInt)r->particles, MPIU_INT, 0, model->comm));
  for (PetscInt p = 0; p < model->own + r->ghosts; p++) fragment[p] = whole[r->number[p]];
  PetscCall(PetscFree(key));
  PetscCall(PetscFree(pairs));
  PetscCall(PetscFree(mass));
  PetscCall(PetscFree(whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetFragments(DemModel model, PetscInt *n_parts, PetscInt fragment[])
{
  PetscInt  *pair, m = 0;
  PetscReal *mass;

  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before asking for fragments");
  PetscCall(PetscMalloc2(2 * model->bonds.n, &pair, model->n, &mass));
  for (PetscInt k = 0; k < model->bonds.n; k++) {
    if (!Holds(model, k) || !DemBondIsMine(model, k)) continue;
    pair[2 * m]       = model->at[model->bonds.p[k]];
    pair[2 * m++ + 1] = model->at[model->bonds.q[k]];
  }
  for (PetscInt p = 0; p < model->n; p++) mass[model->at[p]] = model->mass[p];
  if (model->ranks) PetscCall(PartsOfRanks(model, m, pair, n_parts, fragment));
  else PetscCall(Parts(model->n, mass, m, pair, n_parts, fragment));
  PetscCall(PetscFree2(pair, mass));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same of all ranks' bonds, on rank 0. */
static PetscErrorCode WriteGathered(DemModel model, const DemBondList *list, Output output)
{
  static const char *const name[] = {"sigma", "tau", "damage", "criterion", "state"}, *const unit[] = {"Pa", "Pa", "-", "-", "-"};
  PetscInt                 n, points, *start, *node;
  PetscReal               *value, *column, *x;
  unsigned char           *type;
  OutputArray              array[5];
  OutputBlock              block = {.name = "bonds", .n_arrays = 5, .array = array};

  PetscFunctionBegin;
  PetscCall(DemGatherBonds_Internal(model, list, &n, &node, &value));
  PetscCall(DemGatherPlaces_Internal(model, &points, &x));
  PetscCall(PetscMalloc3(n + 1, &start, n, &type, 5 * n, &column));
  for (PetscInt k = 0; k <= n; k++) start[k] = 2 * k;
  for (PetscInt k = 0; k < n; k++) {
    type[k] = 3;
    for (PetscInt a = 0; a < 5; a++) column[a * n + k] = value[5 * k + a];
  }
  for (PetscInt a = 0; a < 5; a++) array[a] = (OutputArray){name[a], unit[a], OUTPUT_CELL_DATA, 1, column + a * n};
  block.n_points = points;
  block.x        = x;
  block.n_cells  = n;
  block.start    = start;
  block.node     = node;
  block.type     = type;
  PetscCall(OutputFrameBlock(output, &block));
  PetscCall(PetscFree3(start, type, column));
  PetscCall(PetscFree(node));
  PetscCall(PetscFree(value));
  PetscCall(PetscFree(x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemWriteBonds_Internal(DemModel model, Output output)
{
  PetscInt      *start, *node;
  PetscReal     *state;
  unsigned char *type;
  DemBondList    list;

  PetscFunctionBegin;
  PetscCall(DemModelGetBonds(model, &list));
  if (model->ranks) {
    PetscCall(WriteGathered(model, &list, output));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc4(list.n + 1, &start, 2 * list.n, &node, list.n, &type, list.n, &state));
  for (PetscInt k = 0; k < list.n; k++) {
    start[k]        = 2 * k;
    node[2 * k]     = list.p[k];
    node[2 * k + 1] = list.q[k];
    type[k]         = 3;
    state[k]        = list.state[k];
  }
  start[list.n] = 2 * list.n;
  {
    const OutputArray array[] = {{"sigma", "Pa", OUTPUT_CELL_DATA, 1, list.sigma}, {"tau", "Pa", OUTPUT_CELL_DATA, 1, list.tau}, {"damage", "-", OUTPUT_CELL_DATA, 1, list.damage},
                                 {"criterion", "-", OUTPUT_CELL_DATA, 1, list.criterion}, {"state", "-", OUTPUT_CELL_DATA, 1, state}};
    const OutputBlock block = {"bonds", model->n, model->packing.x, list.n, start, node, type, 5, array};

    PetscCall(OutputFrameBlock(output, &block));
  }
  PetscCall(PetscFree4(start, node, type, state));
  PetscFunctionReturn(PETSC_SUCCESS);
}
