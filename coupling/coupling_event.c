/*
  coupling_event.c - one event: who turns, both sides for the new split, the state handed over, what it cost.  Eqs (8.1)-(8.9)

  An event falls between two steps, when both sides stand at the same instant with their forces known. Nodes that stay, and
  particles whose share stays, keep every bit of their state; waking particles take theirs from the elements' field.
*/
#include "coupling_switch.h"
#include <petsctime.h>

/* ---- both sides of the present split ------------------------------------------------------------------------------ */

PetscErrorCode CouplingHalvesDestroy_Internal(CouplingHalves **halves)
{
  CouplingHalves *h = *halves;

  PetscFunctionBegin;
  if (!h) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CouplingModelDestroy(&h->model));
  PetscCall(FemModelDestroy(&h->fem));
  if (!h->part) PetscCall(DemModelDestroy(&h->dem)); /* on several ranks the model's own */
  PetscCall(DemModelDestroy(&h->part));
  PetscCall(CouplingCarvedDestroy_Internal(&h->carved));
  PetscCall(CouplingSplitDestroy(&h->split));
  PetscCall(PetscFree(h->watched));
  PetscCall(PetscFree2(h->top_of, h->gradient));
  PetscCall(PetscFree(*halves));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cell whose stress a facet of the overlap is held against: of its first end that has elements; -1 when neither has. */
static PetscInt CellOf(const CouplingSwitch sw, const CouplingHalves *h, PetscInt facet)
{
  const PetscInt f = h->carved.facet[facet], p = sw->w.home[sw->w.cells->p[f]], q = sw->w.home[sw->w.cells->q[f]];

  return sw->ring[p] > 0 ? p : sw->ring[q] > 0 ? q : -1;
}

/* Mean gradients of the shape functions of every element, so that a look costs a few products each. */
static PetscErrorCode MeanGradients(CouplingSwitch sw, CouplingHalves *h)
{
  const Mesh    *mesh = &h->split.fem;
  const PetscInt dim = mesh->dim;

  PetscFunctionBegin;
  for (PetscInt top = 0; top < h->split.n_cells; top++) h->dofs = PetscMax(h->dofs, dim * (mesh->start[h->model->top[top] + 1] - mesh->start[h->model->top[top]]));
  PetscCall(PetscMalloc2(sw->whole->n_cells, &h->top_of, h->split.n_cells * h->dofs, &h->gradient));
  for (PetscInt c = 0; c < sw->whole->n_cells; c++) h->top_of[c] = -1;
  for (PetscInt top = 0; top < h->split.n_cells; top++) {
    const PetscInt  c = h->model->top[top], first = mesh->start[c], n = mesh->start[c + 1] - first;
    const FemShape *shape = FemShapeGet(mesh->type[c]);
    PetscReal       x[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], volume = 0, *mean = h->gradient + top * h->dofs;

    h->top_of[h->split.cell[top]] = top;
    for (PetscInt a = 0; a < n; a++)
      for (PetscInt d = 0; d < dim; d++) x[a * dim + d] = mesh->x[3 * mesh->node[first + a] + d];
    (void)FemGradients(shape, x, 1, dN, w);
    for (PetscInt k = 0; k < n * dim; k++) mean[k] = 0;
    for (PetscInt g = 0; g < shape->points; g++) {
      volume += w[g];
      for (PetscInt k = 0; k < n * dim; k++) mean[k] += w[g] * dN[g * n * dim + k];
    }
    for (PetscInt k = 0; k < n * dim; k++) mean[k] /= volume;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingBuild_Internal(CouplingSwitch sw, CouplingHalves **halves)
{
  CouplingHalves *h;
  CouplingOptions options = sw->coupling;
  PetscMPIInt     size;

  PetscFunctionBegin;
  PetscCall(PetscNew(&h));
  *halves = h;
  PetscCall(CouplingSplitCells_Internal(sw->whole, sw->is_dem, sw->seed, sw->width, &h->split));
  PetscCall(CouplingRings_Internal(sw->whole, sw->is_dem, sw->width, sw->ring, sw->reach));
  PetscCall(CouplingCarve_Internal(&sw->w, sw->ring, &h->carved));
  PetscCall(sw->make(sw->ctx, &h->split, &sw->body, &h->carved.packing, &h->carved.cells, &h->fem, &h->dem));
  PetscCall(CouplingWeaken_Internal(sw, &h->carved, h->dem));
  PetscCall(CouplingModelCreate(sw->comm, &h->model));
  PetscCallMPI(MPI_Comm_size(sw->comm, &size));
  if (size > 1) {
    PetscCall(sw->make(sw->ctx, &h->split, &sw->body, &h->carved.packing, &h->carved.cells, NULL, &h->part));
    PetscCall(CouplingWeaken_Internal(sw, &h->carved, h->part));
    PetscCall(CouplingModelSetPart(h->model, h->part));
  }
  if (sw->dt > 0) {
    options.substeps = sw->substeps;
    h->model->given  = sw->dt / sw->substeps;
  }
  PetscCall(PetscArraycpy(h->model->body_mass, sw->mass, 4));
  PetscCall(CouplingModelSetSplit(h->model, &h->split, &options));
  PetscCall(CouplingModelSetSides(h->model, h->fem, h->dem, &h->carved.packing, &h->carved.cells, &sw->material, sw->kind, sw->thickness));
  PetscCall(CouplingModelSetUp(h->model));
  PetscCall(CouplingModelGetStepper(h->model, &h->stepper));
  PetscCall(PetscMalloc1(h->carved.cells.n_facets, &h->watched));
  for (PetscInt f = 0; f < h->carved.cells.n_facets; f++)
    if (CellOf(sw, h, f) >= 0) h->watched[h->n_watched++] = f;
  PetscCall(MeanGradients(sw, h));
  if (h->part) PetscCall(CouplingDropCells_Internal(&h->carved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On several ranks: the particles of the present split as a whole again, in the state of the parts. sw->ring is still theirs. */
static PetscErrorCode Recall(CouplingSwitch sw, CouplingHalves *h)
{
  CouplingCarved carved;
  FemModel       fem = NULL;
  DemModel       dem;

  PetscFunctionBegin;
  if (!h->part || h->model->dem) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CouplingCarve_Internal(&sw->w, sw->ring, &carved));
  PetscCall(sw->make(sw->ctx, &h->split, &sw->body, &carved.packing, &carved.cells, &fem, &dem));
  PetscCall(FemModelDestroy(&fem));
  PetscCall(CouplingWeaken_Internal(sw, &carved, dem));
  PetscCall(CouplingRecall_Internal(h->model, dem, &carved.packing, &carved.cells));
  PetscCall(CouplingCarvedDestroy_Internal(&carved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- who turns ----------------------------------------------------------------------------------------------------- */

/* Element mean stress, Voigt xx yy zz xy yz zx. */
static void CellStress(const CouplingSwitch sw, const CouplingHalves *h, const PetscReal *u, PetscInt top, PetscReal stress[6])
{
  const Mesh      *mesh = &h->split.fem;
  const PetscInt   dim = mesh->dim, c = h->model->top[top], first = mesh->start[c], n = mesh->start[c + 1] - first;
  const PetscReal *g = h->gradient + top * h->dofs;
  PetscReal        G[3][3] = {{0}}, trace = 0;

  for (PetscInt a = 0; a < n; a++)
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) G[i][j] += u[mesh->node[first + a] * dim + i] * g[a * dim + j];
  for (PetscInt d = 0; d < dim; d++) trace += G[d][d];
  for (PetscInt d = 0; d < 3; d++) {
    stress[d]     = d < dim ? sw->lambda * trace + 2 * sw->mu * G[d][d] : sw->kind == FEM_PLANE_STRAIN ? sw->lambda * trace : 0;
    stress[3 + d] = sw->mu * (G[d][(d + 1) % 3] + G[(d + 1) % 3][d]);
  }
  for (PetscInt k = 0; k < 6; k++) stress[k] += sw->coupling.stress[k]; /* in situ */
}

/* Bonds of the overlap that near their strength, half way from `at` to 1, ask for the cells they lie in: a crack's tip is finer than an element.  Eq. (8.3) */
static PetscErrorCode LookAtBonds(CouplingSwitch sw, PetscBool marked[], PetscReal *highest)
{
  const CouplingHalves *h = sw->now;
  PetscInt             *facet, n = 0;
  PetscReal            *use;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(h->n_watched, &facet, h->n_watched, &use));
  for (PetscInt k = 0; k < h->n_watched; k++)
    if (sw->use[CellOf(sw, h, h->watched[k])] >= COUPLING_WAKE) facet[n++] = h->watched[k];
  if (n) PetscCall(DemModelGetFacetUse(CouplingMoving(h->model), n, facet, use));
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt c = CellOf(sw, h, facet[k]);

    if (use[k] < 0.5 * (1 + sw->options.at)) continue;
    if (sw->may[c]) *highest = PetscMax(*highest, use[k]);
    marked[c] = PETSC_TRUE;
  }
  PetscCall(PetscFree2(facet, use));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Blocked(CouplingSwitch sw, PetscInt cell, PetscReal t)
{
  if (sw->blocked >= 0) return;
  sw->blocked      = cell;
  sw->blocked_time = t;
}

/*
  Marks overlap elements that no longer lead outwards to whole elements, ring by ring: what is left between two fronts, or between
  a front and the surface. Their share of the energy never rises to one, and such an overlap can lose its minimum.
*/
static PetscErrorCode MarkPockets(CouplingSwitch sw, PetscBool marked[])
{
  const Mesh *mesh = sw->whole;
  PetscInt   *ring, *reach;
  PetscBool  *dem, *leads, more = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(mesh->n_cells, &ring, mesh->n_nodes, &reach, mesh->n_cells, &dem, mesh->n_nodes, &leads));
  while (more) {
    more = PETSC_FALSE;
    for (PetscInt c = 0; c < mesh->n_cells; c++) dem[c] = (PetscBool)(sw->is_dem[c] || (marked[c] && sw->may[c]));
    PetscCall(CouplingRings_Internal(mesh, dem, sw->width, ring, reach));
    for (PetscInt i = 0; i < mesh->n_nodes; i++) leads[i] = (PetscBool)(reach[i] >= sw->width);
    for (PetscInt r = sw->width; r >= 1; r--)
      for (PetscInt c = 0; c < mesh->n_cells; c++) {
        PetscBool out = PETSC_FALSE;

        if (MeshCellDim(mesh->type[c]) != mesh->dim || ring[c] != r) continue;
        for (PetscInt k = mesh->start[c]; k < mesh->start[c + 1]; k++) out = (PetscBool)(out || (leads[mesh->node[k]] && reach[mesh->node[k]] >= r));
        if (out)
          for (PetscInt k = mesh->start[c]; k < mesh->start[c + 1]; k++) leads[mesh->node[k]] = PETSC_TRUE;
        else if (sw->may[c] && !marked[c]) marked[c] = more = PETSC_TRUE;
      }
  }
  PetscCall(PetscFree4(ring, reach, dem, leads));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingLook_Internal(CouplingSwitch sw, PetscReal t, PetscBool tools)
{
  const CouplingHalves *h = sw->now;
  const PetscReal       at = sw->options.at, least = CouplingUseBound_Internal(&sw->options, &sw->strength);
  PetscReal             element = 0, bond = 0;
  PetscBool            *marked, *asks, any = PETSC_FALSE;
  CouplingAsker         asked = COUPLING_BY_ELEMENT;
  FemState              fs;

  PetscFunctionBegin;
  sw->looks++;
  PetscCall(PetscCalloc2(sw->whole->n_cells, &marked, sw->whole->n_cells, &asks));
  PetscCall(FemModelGetState(h->fem, &fs));
  for (PetscInt top = 0; top < h->split.n_cells; top++) {
    const PetscInt c = h->split.cell[top];
    const PetscReal part = sw->weak_cell ? sw->weak_cell[c] : 1;
    PetscReal      stress[6], norm = 0;

    if (!sw->may[c] && h->split.layer[top] == 0) continue;
    CellStress(sw, h, fs.u, top, stress);
    for (PetscInt k = 0; k < 6; k++) norm += (k < 3 ? 1 : 2) * stress[k] * stress[k];
    sw->use[c] = least > 0 ? PetscSqrtReal(norm) / (part * least) : 1; /* never below the criterion; far from it this is enough to know */
    if (sw->use[c] < 0.5 * COUPLING_WAKE) continue;
    sw->use[c] = CouplingUse_Internal(&sw->options, &sw->strength, sw->whole->dim, stress) / part;
    if (sw->use[c] < at) continue;
    if (!sw->may[c]) {
      if (h->split.layer[top] > 0) Blocked(sw, c, t);
      continue;
    }
    marked[c] = PETSC_TRUE;
    any       = PETSC_TRUE;
    element   = PetscMax(element, sw->use[c]);
  }
  PetscCall(LookAtBonds(sw, asks, &bond));
  PetscCall(FemModelRestoreState(h->fem, &fs));
  for (PetscInt c = 0; c < sw->whole->n_cells; c++) {
    if (!asks[c]) continue;
    if (!sw->may[c]) Blocked(sw, c, t);
    else {
      if (!marked[c]) asked = COUPLING_BY_BOND;
      marked[c] = any = PETSC_TRUE;
    }
  }
  if (tools) {
    PetscBool *close;

    PetscCall(PetscCalloc1(sw->whole->n_cells, &close));
    PetscCall(CouplingLookAtTools_Internal(sw, close));
    for (PetscInt c = 0; c < sw->whole->n_cells; c++) {
      if (!close[c] || marked[c]) continue;
      if (!sw->may[c]) Blocked(sw, c, t);
      else {
        marked[c] = any = PETSC_TRUE;
        asked           = COUPLING_BY_TOOL;
      }
    }
    PetscCall(PetscFree(close));
  }
  PetscCallMPI(MPI_Bcast(&any, 1, MPIU_BOOL, 0, sw->comm)); /* ranks do the same sums; should machines differ, the first decides */
  if (any) {
    PetscInt *ring, *reach;

    PetscCallMPI(MPI_Bcast(marked, (PetscMPIInt)sw->whole->n_cells, MPIU_BOOL, 0, sw->comm));

    PetscCall(PetscMalloc2(sw->whole->n_cells, &ring, sw->whole->n_nodes, &reach));
    PetscCall(CouplingRings_Internal(sw->whole, marked, sw->options.ahead, ring, reach));
    for (PetscInt c = 0; c < sw->whole->n_cells; c++)
      marked[c] = (PetscBool)(marked[c] || ring[c] >= 0 || (sw->may[c] && !sw->is_dem[c] && sw->use[c] >= (1 - sw->options.hysteresis) * at));
    PetscCall(PetscFree2(ring, reach));
    PetscCall(MarkPockets(sw, marked));
    PetscCall(CouplingTurn_Internal(sw, marked, t, PetscMax(element, bond), asked));
  }
  PetscCall(PetscFree2(marked, asks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- state of those that wake -------------------------------------------------------------------------------------- */

/* Turn of a rotation vector. */
static void SetTurn(DemState *ds, PetscInt p, const PetscReal w[3])
{
  const PetscInt n = ds->n;

  if (ds->dim == 2) {
    ds->rot[p]         = PetscSinReal(w[2]);
    ds->rot[n + p]     = -2 * PetscSqr(PetscSinReal(0.5 * w[2]));
    ds->rot[2 * n + p] = w[2];
  } else {
    const PetscReal angle = PetscSqrtReal(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]), half = 0.5 * angle, scale = angle > 0 ? PetscSinReal(half) / angle : 0.5;

    ds->rot[p] = PetscCosReal(half);
    for (PetscInt d = 0; d < 3; d++) ds->rot[(1 + d) * n + p] = scale * w[d];
  }
}

/* Half the curl of the gradient G_ij = du_i/dx_j. */
static void HalfCurl(PetscInt dim, const PetscReal G[9], PetscReal w[3])
{
  w[0] = w[1] = w[2] = 0;
  if (dim == 2) w[2] = 0.5 * (G[2] - G[1]);
  else
    for (PetscInt d = 0; d < 3; d++) w[d] = 0.5 * (G[((d + 2) % 3) * 3 + (d + 1) % 3] - G[((d + 1) % 3) * 3 + (d + 2) % 3]);
}

/*
  Value and gradient at x of a field on the old elements.  Eqs (8.6), (8.7)

  curve: 1 keeps the field's curvature; 0 is the elements' own field, which particles of the overlap are tied to. The elements' new share in
  between: a bent beam then takes up 4.7e-4 of its energy (1.2e-3 with 1 everywhere, 1.7e-4 with 0), a pulse of eight elements loses
  2.4e-2 (2.3e-2, 3.3e-2); test_switch.
*/
static void FieldAt(PetscInt dim, PetscInt n, const PetscInt *node, const Mesh *mesh, const PetscReal N[], const PetscReal x[3], const PetscReal *u, const PetscReal *G, PetscReal curve, PetscReal value[3], PetscReal gradient[9])
{
  for (PetscInt d = 0; d < 3; d++) value[d] = 0;
  for (PetscInt k = 0; k < 9; k++) gradient[k] = 0;
  for (PetscInt a = 0; a < n; a++) {
    const PetscReal *g = G + node[a] * dim * dim;

    for (PetscInt k = 0; k < dim * dim; k++) gradient[k] += N[a] * g[k];
    for (PetscInt i = 0; i < dim; i++) {
      PetscReal more = 0;

      for (PetscInt j = 0; j < dim; j++) more += g[i * dim + j] * (x[j] - mesh->x[3 * node[a] + j]);
      value[i] += N[a] * (u[node[a] * dim + i] + 0.5 * curve * more);
    }
  }
}

/* of [carved.packing.n]: the old models' number, -1 = wakes now. */
static PetscErrorCode WakeParticles(CouplingSwitch sw, const CouplingHalves *old, CouplingHalves *h, const PetscInt of[], PetscInt *woken)
{
  const Mesh    *mesh = &old->split.fem;
  const PetscInt dim = mesh->dim;
  PetscBool     *wanted;
  PetscReal     *G, *Gv, *s;
  FemState       fs;
  DemState       ds;

  PetscFunctionBegin;
  *woken = 0;
  PetscCall(PetscCalloc4(mesh->n_nodes, &wanted, mesh->n_nodes * dim * dim, &G, mesh->n_nodes * dim * dim, &Gv, sw->whole->n_nodes, &s));
  for (PetscInt i = 0; i < h->split.fem.n_nodes; i++) s[h->split.node[i]] = h->split.s[i]; /* nodes that left: 0 */
  for (PetscInt p = 0; p < h->carved.packing.n; p++) {
    if (of[p] >= 0) continue;
    const PetscInt top = old->top_of[sw->w.home[h->carved.particle[p]]];

    PetscCheck(top >= 0, sw->comm, PETSC_ERR_PLIB, "Particle %" PetscInt_FMT " wakes where no element was", h->carved.particle[p]);
    for (PetscInt k = mesh->start[old->model->top[top]]; k < mesh->start[old->model->top[top] + 1]; k++) wanted[mesh->node[k]] = PETSC_TRUE;
  }
  PetscCall(FemModelGetState(old->fem, &fs));
  PetscCall(DemModelGetState(h->dem, &ds));
  PetscCall(CouplingRecover_Internal(mesh, sw->thickness, wanted, fs.u, G));
  PetscCall(CouplingRecover_Internal(mesh, sw->thickness, wanted, fs.v, Gv));
  for (PetscInt k = 0; k < ds.n; k++) {
    const PetscInt   p = ds.number[k];
    const PetscReal *x = &h->carved.packing.x[3 * p];

    if (of[p] >= 0) continue;
    const PetscInt c = old->model->top[old->top_of[sw->w.home[h->carved.particle[p]]]], first = mesh->start[c], n = mesh->start[c + 1] - first;
    PetscReal      at[FEM_MAX_NODES][3], N[FEM_MAX_NODES], dN[FEM_MAX_NODES][3], outside, share = 0, value[3], gradient[9], w[3], before[3];

    for (PetscInt a = 0; a < n; a++)
      for (PetscInt d = 0; d < 3; d++) at[a][d] = mesh->x[3 * mesh->node[first + a] + d];
    PetscCall(CouplingShapes_Internal(mesh->type[c], &at[0][0], dim, x, N, dN, &outside));
    for (PetscInt a = 0; a < n; a++) share += N[a] * s[old->split.node[mesh->node[first + a]]];
    share = MeshCellLinear(mesh->type[c]) == mesh->type[c] ? PetscMax(0, PetscMin(1, share)) : 1; /* quadratic elements have a curvature of their own */
    FieldAt(dim, n, mesh->node + first, mesh, N, x, fs.u, G, 1 - share, value, gradient);
    CouplingBefore(h->model, x, before);
    for (PetscInt d = 0; d < dim; d++) ds.u[d * ds.n + k] = value[d] + before[d];
    HalfCurl(dim, gradient, w);
    SetTurn(&ds, k, w);
    FieldAt(dim, n, mesh->node + first, mesh, N, x, fs.v, Gv, 1 - share, value, gradient);
    for (PetscInt d = 0; d < dim; d++) ds.v[d * ds.n + k] = value[d];
    HalfCurl(dim, gradient, w);
    if (dim == 2) ds.spin[k] = w[2];
    else
      for (PetscInt d = 0; d < 3; d++) ds.spin[d * ds.n + k] = w[d];
    (*woken)++;
  }
  PetscCall(FemModelRestoreState(old->fem, &fs));
  PetscCall(DemModelRestoreState(h->dem, &ds));
  PetscCall(PetscFree4(wanted, G, Gv, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Momentum P and angular momentum L about the origin, of positions at rest. */
static PetscErrorCode Momentum(const CouplingHalves *h, PetscReal P[3], PetscReal L[3])
{
  FemState fs;
  DemState ds;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(h->fem, &fs));
  PetscCall(DemModelGetState(h->dem, &ds));
  for (PetscInt d = 0; d < 3; d++) P[d] = L[d] = 0;
  for (PetscInt i = 0; i < fs.n_nodes + ds.n; i++) {
    const PetscInt k = i - fs.n_nodes;
    PetscReal      x[3] = {0}, p[3] = {0};

    for (PetscInt d = 0; d < fs.dim; d++) {
      x[d] = k < 0 ? fs.x[i * fs.dim + d] : ds.x0[d * ds.n + k];
      p[d] = k < 0 ? fs.mass[i] * fs.v[i * fs.dim + d] : ds.mass[k] * ds.v[d * ds.n + k];
      P[d] += p[d];
    }
    for (PetscInt d = 0; d < 3; d++) L[d] += x[(d + 1) % 3] * p[(d + 2) % 3] - x[(d + 2) % 3] * p[(d + 1) % 3];
    if (k >= 0 && fs.dim == 2) L[2] += ds.inertia[k] * ds.spin[k];
    if (k >= 0 && fs.dim == 3)
      for (PetscInt d = 0; d < 3; d++) L[d] += ds.inertia[k] * ds.spin[d * ds.n + k];
  }
  PetscCall(FemModelRestoreState(h->fem, &fs));
  PetscCall(DemModelRestoreState(h->dem, &ds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = J^-1 l; 2D has z alone. PETSC_FALSE: J is singular. */
static PetscBool Solve3(PetscInt dim, PetscReal J[3][3], const PetscReal l[3], PetscReal w[3])
{
  PetscReal C[3][3], det = 0, size = J[0][0] + J[1][1] + J[2][2];

  w[0] = w[1] = w[2] = 0;
  if (dim == 2) {
    if (J[2][2] <= 0) return PETSC_FALSE;
    w[2] = l[2] / J[2][2];
    return PETSC_TRUE;
  }
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) C[i][j] = J[(i + 1) % 3][(j + 1) % 3] * J[(i + 2) % 3][(j + 2) % 3] - J[(i + 1) % 3][(j + 2) % 3] * J[(i + 2) % 3][(j + 1) % 3];
  for (int j = 0; j < 3; j++) det += J[0][j] * C[0][j];
  if (det <= 1e-9 * size * size * size) return PETSC_FALSE;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) w[i] += C[j][i] / det * l[j];
  return PETSC_TRUE;
}

/* Particles that wake, and those whose share of the mass changes: it is there that momentum comes and goes. [particles, in the model's order] */
static PetscErrorCode FindChanged(const CouplingHalves *old, const CouplingHalves *h, const PetscInt of[], PetscBool changed[])
{
  PetscReal *mass;
  DemState   ds;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(old->carved.packing.n, &mass));
  PetscCall(DemModelGetState(old->dem, &ds));
  for (PetscInt k = 0; k < ds.n; k++) mass[ds.number[k]] = ds.mass[k];
  PetscCall(DemModelRestoreState(old->dem, &ds));
  PetscCall(DemModelGetState(h->dem, &ds));
  for (PetscInt k = 0; k < ds.n; k++) {
    const PetscInt o = of[ds.number[k]];

    changed[k] = (PetscBool)(o < 0 || PetscAbsReal(ds.mass[k] - mass[o]) > 1e-9 * mass[o]);
  }
  PetscCall(DemModelRestoreState(h->dem, &ds));
  PetscCall(PetscFree(mass));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those take a common motion, the smallest that leaves the whole body's momentum and angular momentum as they were. Were it the waking ones'
   alone, a few that wake while many change their share would fly.  Eq. (8.8) */
static PetscErrorCode KeepMomentum(CouplingHalves *h, const PetscBool changed[], const PetscReal P0[3], const PetscReal L0[3])
{
  PetscReal P[3], L[3], mass = 0, centre[3] = {0}, J[3][3] = {{0}}, V[3], w[3], l[3];
  DemState  ds;

  PetscFunctionBegin;
  PetscCall(Momentum(h, P, L));
  PetscCall(DemModelGetState(h->dem, &ds));
  for (PetscInt k = 0; k < ds.n; k++) {
    if (!changed[k]) continue;
    mass += ds.mass[k];
    for (PetscInt d = 0; d < ds.dim; d++) centre[d] += ds.mass[k] * ds.x0[d * ds.n + k];
  }
  if (mass > 0) {
    for (PetscInt d = 0; d < 3; d++) {
      centre[d] /= mass;
      V[d] = (P0[d] - P[d]) / mass;
    }
    for (PetscInt k = 0; k < ds.n; k++) {
      PetscReal r[3] = {0}, r2 = 0;

      if (!changed[k]) continue;
      for (PetscInt d = 0; d < ds.dim; d++) {
        r[d] = ds.x0[d * ds.n + k] - centre[d];
        r2 += r[d] * r[d];
      }
      for (PetscInt i = 0; i < 3; i++)
        for (PetscInt j = 0; j < 3; j++) J[i][j] += (i == j ? ds.mass[k] * r2 + ds.inertia[k] : 0) - ds.mass[k] * r[i] * r[j];
    }
    for (PetscInt d = 0; d < 3; d++) l[d] = L0[d] - L[d] - mass * (centre[(d + 1) % 3] * V[(d + 2) % 3] - centre[(d + 2) % 3] * V[(d + 1) % 3]);
    if (!Solve3(ds.dim, J, l, w)) w[0] = w[1] = w[2] = 0;
    for (PetscInt k = 0; k < ds.n; k++) {
      PetscReal r[3] = {0};

      if (!changed[k]) continue;
      for (PetscInt d = 0; d < ds.dim; d++) r[d] = ds.x0[d * ds.n + k] - centre[d];
      for (PetscInt d = 0; d < ds.dim; d++) ds.v[d * ds.n + k] += V[d] + w[(d + 1) % 3] * r[(d + 2) % 3] - w[(d + 2) % 3] * r[(d + 1) % 3];
      if (ds.dim == 2) ds.spin[k] += w[2];
      else
        for (PetscInt d = 0; d < 3; d++) ds.spin[d * ds.n + k] += w[d];
    }
  }
  PetscCall(DemModelRestoreState(h->dem, &ds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- the event ------------------------------------------------------------------------------------------------------ */

/* Facets that can break from now on and could not before, and how many of them are above their strength. */
static PetscErrorCode CountAbove(CouplingSwitch sw, const CouplingHalves *old, const CouplingHalves *h, PetscInt *above)
{
  const PetscInt m = sw->w.cells->n_facets;
  PetscInt      *facet, n = 0;
  PetscBool     *could, *watched;
  PetscReal     *use;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(m, &could, h->carved.cells.n_facets, &watched));
  PetscCall(PetscMalloc2(h->carved.cells.n_facets, &facet, h->carved.cells.n_facets, &use));
  for (PetscInt f = 0; f < old->carved.cells.n_facets; f++) could[old->carved.facet[f]] = PETSC_TRUE;
  for (PetscInt k = 0; k < old->n_watched; k++) could[old->carved.facet[old->watched[k]]] = PETSC_FALSE;
  for (PetscInt k = 0; k < h->n_watched; k++) watched[h->watched[k]] = PETSC_TRUE;
  for (PetscInt f = 0; f < h->carved.cells.n_facets; f++)
    if (!watched[f] && !could[h->carved.facet[f]]) facet[n++] = f;
  *above = 0;
  PetscCall(DemModelGetFacetUse(h->dem, n, facet, use));
  for (PetscInt k = 0; k < n; k++) *above += use[k] > 1;
  PetscCall(PetscFree2(facet, use));
  PetscCall(PetscFree2(could, watched));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Sum(const PetscReal energy[LEDGER_TERMS])
{
  PetscReal sum = -energy[LEDGER_WORK];

  for (PetscInt k = 0; k < LEDGER_WORK; k++) sum += energy[k];
  return sum;
}

/* What the run began with. The particles' ledger takes their weight's work as a potential from rest: for those that wake it is no work of now. */
static PetscErrorCode KeepStart(const CouplingHalves *old, CouplingHalves *h)
{
  Stepper dem;
  Ledger  before = {{0}}, after = {{0}};

  PetscFunctionBegin;
  PetscCall(DemModelGetStepper(old->dem, &dem));
  PetscCall(dem.energy(old->dem, &before));
  PetscCall(DemModelGetStepper(h->dem, &dem));
  PetscCall(dem.energy(h->dem, &after));
  h->model->reference    = old->model->reference;
  h->model->absorbed     = old->model->absorbed;
  h->model->initial      = old->model->initial;
  h->model->initial_work = old->model->initial_work + after.energy[LEDGER_WORK] - before.energy[LEDGER_WORK];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode HandOver(CouplingSwitch sw, CouplingHalves *old, CouplingHalves *h, PetscInt *woken)
{
  PetscInt  *number, *of, *from, *node;
  PetscBool *changed;
  PetscReal  P[3], L[3];

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(PetscMax(sw->w.packing->n, PetscMax(sw->w.cells->n_facets, sw->whole->n_nodes)), &number, h->carved.packing.n, &of, h->carved.cells.n_facets, &from, h->split.fem.n_nodes, &node));
  for (PetscInt i = 0; i < old->split.fem.n_nodes; i++) number[old->split.node[i]] = i;
  for (PetscInt i = 0; i < h->split.fem.n_nodes; i++) node[i] = number[h->split.node[i]];
  for (PetscInt p = 0; p < sw->w.packing->n; p++) number[p] = -1;
  for (PetscInt p = 0; p < old->carved.packing.n; p++) number[old->carved.particle[p]] = p;
  for (PetscInt p = 0; p < h->carved.packing.n; p++) of[p] = number[h->carved.particle[p]];
  for (PetscInt f = 0; f < sw->w.cells->n_facets; f++) number[f] = -1;
  for (PetscInt f = 0; f < old->carved.cells.n_facets; f++) number[old->carved.facet[f]] = f;
  for (PetscInt f = 0; f < h->carved.cells.n_facets; f++) from[f] = number[h->carved.facet[f]];
  PetscCall(CouplingGather_Internal(old->model));
  old->dem = old->model->dem;
  PetscCall(FemModelContinue(h->fem, old->fem, node));
  PetscCall(DemModelContinue(h->dem, old->dem, of, from));
  PetscCall(WakeParticles(sw, old, h, of, woken));
  PetscCall(Momentum(old, P, L));
  PetscCall(PetscMalloc1(h->carved.packing.n, &changed));
  PetscCall(FindChanged(old, h, of, changed));
  for (int pass = 0; pass < 2; pass++) PetscCall(KeepMomentum(h, changed, P, L)); /* the second takes what the first rounded */
  PetscCall(PetscFree(changed));
  PetscCall(PetscFree4(number, of, from, node));
  PetscCall(KeepStart(old, h));
  PetscCall(CouplingStart_Internal(h->model, sw->dt / sw->substeps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cells of turned[] join the particles; PETSC_FALSE, and nothing changed, when that left no far field. */
static PetscErrorCode Join(CouplingSwitch sw, const PetscBool turned[], PetscReal t, PetscBool *joined)
{
  PetscInt *ring, *reach, last = -1, far = 0;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < sw->whole->n_cells; c++)
    if (turned[c]) {
      sw->is_dem[c] = PETSC_TRUE;
      last          = c;
    }
  PetscCall(PetscMalloc2(sw->whole->n_cells, &ring, sw->whole->n_nodes, &reach));
  PetscCall(CouplingRings_Internal(sw->whole, sw->is_dem, sw->width, ring, reach));
  for (PetscInt c = 0; c < sw->whole->n_cells; c++) far += MeshCellDim(sw->whole->type[c]) == sw->whole->dim && ring[c] < 0;
  PetscCall(PetscFree2(ring, reach));
  *joined = (PetscBool)(far > 0);
  if (far > 0) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt c = 0; c < sw->whole->n_cells; c++)
    if (turned[c]) {
      sw->is_dem[c] = PETSC_FALSE;
      sw->may[c]    = PETSC_FALSE; /* asked for once and for all */
    }
  Blocked(sw, last, t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What may turn around what has just turned joins it. */
static PetscErrorCode Widen(CouplingSwitch sw, PetscBool turned[], PetscInt *more)
{
  PetscInt *ring, *reach;

  PetscFunctionBegin;
  *more = 0;
  PetscCall(PetscMalloc2(sw->whole->n_cells, &ring, sw->whole->n_nodes, &reach));
  PetscCall(CouplingRings_Internal(sw->whole, turned, 1, ring, reach));
  for (PetscInt c = 0; c < sw->whole->n_cells; c++) turned[c] = (PetscBool)(turned[c] || ring[c] >= 0);
  PetscCall(MarkPockets(sw, turned));
  for (PetscInt c = 0; c < sw->whole->n_cells; c++) {
    turned[c] = (PetscBool)(turned[c] && sw->may[c]);
    *more += turned[c] && !sw->is_dem[c];
  }
  PetscCall(PetscFree2(ring, reach));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingTurn_Internal(CouplingSwitch sw, const PetscBool marked[], PetscReal t, PetscReal highest, CouplingAsker asked)
{
  CouplingHalves *old = sw->now, *h;
  CouplingEvent   event = {.time = t, .highest = highest, .asked = asked};
  PetscBool      *turned, joined = PETSC_FALSE;
  Ledger          ledger = {{0}};
  PetscLogDouble  begin, end;

  PetscFunctionBegin;
  PetscCall(PetscTime(&begin));
  PetscCall(PetscCalloc1(sw->whole->n_cells, &turned));
  for (PetscInt c = 0; c < sw->whole->n_cells; c++) {
    turned[c] = (PetscBool)(marked[c] && sw->may[c] && !sw->is_dem[c]);
    event.cells += turned[c];
  }
  if (!event.cells) {
    PetscCall(PetscFree(turned));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(Join(sw, turned, t, &joined));
  if (!joined) {
    PetscCall(PetscFree(turned));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(old->stepper.energy(old->model, &ledger));
  PetscCall(PetscArraycpy(event.before, ledger.energy, LEDGER_TERMS));
  PetscCall(Recall(sw, old));
  PetscCall(CouplingBuild_Internal(sw, &h));
  for (PetscInt tries = 0; h->model->unstable && tries < 4; tries++) { /* this shape of front has no minimum: a little more, and try again */
    PetscInt more;

    PetscCall(Widen(sw, turned, &more));
    PetscCall(Join(sw, turned, t, &joined));
    if (!more || !joined) break;
    event.cells += more;
    PetscCall(CouplingHalvesDestroy_Internal(&h));
    PetscCall(CouplingBuild_Internal(sw, &h));
  }
  PetscCall(PetscFree(turned));
  BaseCheckInput(!h->model->unstable, sw->comm, "After elements turned at %.6g s the overlap has no stable energy, nor with some more of them: give its elements about 4 particles to a side, 3 at least (between nodes, so quadratic ones twice as many): smaller particles, or larger elements there", (double)t);
  PetscCall(HandOver(sw, old, h, &event.particles));
  PetscCall(PetscMemzero(&ledger, sizeof(ledger)));
  PetscCall(h->stepper.energy(h->model, &ledger));
  PetscCall(PetscArraycpy(event.after, ledger.energy, LEDGER_TERMS));
  event.booked = Sum(event.before) - Sum(event.after);
  PetscCall(CountAbove(sw, old, h, &event.above));
  PetscCall(CouplingHalvesDestroy_Internal(&old));
  sw->now = h;
  sw->booked += event.booked;
  sw->n_turned += event.cells;
  PetscCall(PetscTime(&end));
  event.seconds = end - begin;
  if (sw->n_events == sw->room) {
    sw->room = 2 * sw->room + 16;
    PetscCall(PetscRealloc((size_t)sw->room * sizeof(*sw->event), &sw->event));
  }
  sw->event[sw->n_events++] = event;
  PetscFunctionReturn(PETSC_SUCCESS);
}
