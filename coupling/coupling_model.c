/* coupling_model.c - making a CouplingModel, and the weights it gives to both sides.  Eqs (6.1)-(6.5) */
#include "coupling_impl.h"

#define TIGHTEN 200 /* rounds of power iteration */

PetscErrorCode CouplingModelCreate(MPI_Comm comm, CouplingModel *model)
{
  PetscFunctionBegin;
  PetscCall(PetscNew(model));
  (*model)->comm    = comm;
  (*model)->options = (CouplingOptions){.floor = 0.05, .smooth = PETSC_FALSE, .affine = PETSC_TRUE, .substeps = 1};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingModelSetSplit(CouplingModel model, const CouplingSplit *split, const CouplingOptions *options)
{
  const Mesh *mesh = &split->fem;

  PetscFunctionBegin;
  PetscCheck(!model->split, model->comm, PETSC_ERR_ORDER, "A CouplingModel takes one split");
  if (options) model->options = *options;
  BaseCheckInput(model->options.floor > 0 && model->options.floor < 0.5, model->comm, "The overlap's least weight %.4g must lie between 0 and 0.5", (double)model->options.floor);
  model->split = split;
  model->dim   = split->dim;
  model->ns    = split->dim == 3 ? 6 : 3;
  PetscCall(PetscMalloc1(split->n_cells, &model->top));
  PetscCall(PetscMalloc1(split->n_cells, &model->overlap));
  for (PetscInt c = 0; c < mesh->n_cells; c++) {
    if (MeshCellDim(mesh->type[c]) != model->dim) continue;
    if (split->layer[model->n_top] > 0) {
      model->overlap[model->n_overlap++] = model->n_top;
      model->quadratic                   = (PetscBool)(model->quadratic || mesh->type[c] != MeshCellLinear(mesh->type[c]));
    }
    model->top[model->n_top++] = c;
  }
  PetscCheck(model->n_top == split->n_cells, model->comm, PETSC_ERR_PLIB, "%" PetscInt_FMT " elements in the split, %" PetscInt_FMT " in its mesh", split->n_cells, model->n_top);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean share of each element: 1 beyond the overlap. */
static PetscErrorCode ElementShares(CouplingModel model)
{
  const Mesh *mesh = CouplingMesh(model);

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(model->n_top, &model->alpha));
  for (PetscInt t = 0; t < model->n_top; t++) model->alpha[t] = 1;
  for (PetscInt e = 0; e < model->n_overlap; e++) {
    const PetscInt  t = model->overlap[e], c = model->top[t], first = mesh->start[c], n = mesh->start[c + 1] - first;
    const FemShape *shape = FemShapeGet(mesh->type[c]);
    PetscReal       x[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], sum = 0, volume = 0;
    CouplingPoint   at;

    for (PetscInt a = 0; a < n; a++)
      for (PetscInt d = 0; d < model->dim; d++) x[a * model->dim + d] = mesh->x[3 * mesh->node[first + a] + d];
    (void)FemGradients(shape, x, model->thickness, dN, w);
    at.n = n;
    for (PetscInt a = 0; a < n; a++) at.node[a] = mesh->node[first + a];
    for (PetscInt g = 0; g < shape->points; g++) {
      for (PetscInt a = 0; a < n; a++) at.N[a] = shape->N[g][a];
      sum += w[g] * CouplingWeight_Internal(model, &at);
      volume += w[g];
    }
    model->alpha[t] = sum / volume;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* c = A^-1 b of a small positive system, by elimination; overwrites both. */
static void SolveSmall(PetscInt n, PetscReal A[4][4], PetscReal b[4])
{
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt j = i + 1; j < n; j++) {
      const PetscReal f = A[j][i] / A[i][i];

      for (PetscInt k = i; k < n; k++) A[j][k] -= f * A[i][k];
      b[j] -= f * b[i];
    }
  for (PetscInt i = n - 1; i >= 0; i--) {
    for (PetscInt k = i + 1; k < n; k++) b[i] -= A[i][k] * b[k];
    b[i] /= A[i][i];
  }
}

/*
  What both sides together weigh too little, and where: 1 - alpha is taken at the particles' centres. It goes to the overlap's nodes.  Eq. (8.5)

  M_I <- M_I (1 + a + b.x): mass and first moments of the body come out exactly, so that uniform motion knows nothing of a split.
*/
static PetscErrorCode HoldMass(CouplingModel model, PetscReal density, const PetscReal particles[4], PetscReal *extra)
{
  const Mesh    *mesh = CouplingMesh(model);
  const PetscInt n = model->dim + 1;
  PetscReal     *mass, A[4][4] = {{0}}, c[4], centre[3] = {0}, size = 0, overlap = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(mesh->n_nodes, &mass));
  PetscCall(PetscArraycpy(mass, extra, mesh->n_nodes));
  for (PetscInt t = 0; t < model->n_top; t++) {
    const PetscInt  cell = model->top[t], first = mesh->start[cell], nodes = mesh->start[cell + 1] - first;
    const FemShape *shape = FemShapeGet(mesh->type[cell]);
    PetscReal       x[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], m[FEM_MAX_NODES];

    for (PetscInt a = 0; a < nodes; a++)
      for (PetscInt d = 0; d < model->dim; d++) x[a * model->dim + d] = mesh->x[3 * mesh->node[first + a] + d];
    (void)FemGradients(shape, x, model->thickness, dN, w);
    FemLumpedMass(shape, density * model->alpha[t], w, m);
    for (PetscInt a = 0; a < nodes; a++) mass[mesh->node[first + a]] += m[a];
  }
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    if (model->split->s[i] >= 1) continue;
    overlap += mass[i];
    for (PetscInt d = 0; d < model->dim; d++) centre[d] += mass[i] * mesh->x[3 * i + d];
  }
  for (PetscInt d = 0; d < model->dim; d++) centre[d] /= overlap;
  for (PetscInt i = 0; i < mesh->n_nodes; i++)
    for (PetscInt d = 0; d < model->dim && model->split->s[i] < 1; d++) size = PetscMax(size, PetscAbsReal(mesh->x[3 * i + d] - centre[d]));
  c[0] = model->body_mass[0] - particles[0];
  for (PetscInt d = 0; d < model->dim; d++) c[1 + d] = (model->body_mass[1 + d] - particles[1 + d] - centre[d] * c[0]) / size;
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    PetscReal p[4] = {1};

    for (PetscInt d = 0; d < model->dim; d++) p[1 + d] = (mesh->x[3 * i + d] - centre[d]) / size;
    for (PetscInt j = 0; j < n; j++) {
      c[j] -= mass[i] * p[j];
      for (PetscInt k = 0; k < n && model->split->s[i] < 1; k++) A[j][k] += mass[i] * p[j] * p[k];
    }
  }
  SolveSmall(n, A, c);
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    if (model->split->s[i] >= 1) continue;
    extra[i] += mass[i] * c[0];
    for (PetscInt d = 0; d < model->dim; d++) extra[i] += mass[i] * c[1 + d] * (mesh->x[3 * i + d] - centre[d]) / size;
  }
  PetscCall(PetscFree(mass));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Mass of the elements' nodes: rho int alpha N_a, not the element's mean alpha on all of its nodes alike

  Together with the particles' 1 - alpha the density is then the same throughout. With the means alone an overlap of two elements
  sent back five times more of a wave of 8 h (test_wave).
*/
static PetscErrorCode NodeMasses(CouplingModel model, PetscReal density, const PetscReal particles[4])
{
  const Mesh *mesh = CouplingMesh(model);
  PetscReal  *extra;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(mesh->n_nodes, &extra));
  for (PetscInt e = 0; e < model->n_overlap; e++) {
    const PetscInt  t = model->overlap[e], c = model->top[t], first = mesh->start[c], n = mesh->start[c + 1] - first;
    const FemShape *shape = FemShapeGet(mesh->type[c]);
    PetscReal       x[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], sum = 0;
    CouplingPoint   at;

    for (PetscInt a = 0; a < n; a++)
      for (PetscInt d = 0; d < model->dim; d++) x[a * model->dim + d] = mesh->x[3 * mesh->node[first + a] + d];
    (void)FemGradients(shape, x, model->thickness, dN, w);
    at.n = n;
    for (PetscInt a = 0; a < n; a++) at.node[a] = mesh->node[first + a];
    if (shape->linear != shape->type) { /* the lumped parts (2.31), each with its own node's share; they sum to the mean */
      PetscReal m[FEM_MAX_NODES], whole = 0, part = 0, mean = 0;

      FemLumpedMass(shape, density, w, m);
      for (PetscInt a = 0; a < n; a++) {
        for (PetscInt b = 0; b < n; b++) at.N[b] = a == b;
        at.dN[a][0] = CouplingWeight_Internal(model, &at);
        whole += m[a];
        part += m[a] * at.dN[a][0];
      }
      mean = part / whole;
      for (PetscInt a = 0; a < n; a++) extra[at.node[a]] += m[a] * (at.dN[a][0] * model->alpha[t] / mean - model->alpha[t]);
      continue;
    }
    if (shape->points > 1) { /* the points integrate a linear alpha times N exactly */
      for (PetscInt g = 0; g < shape->points; g++) {
        for (PetscInt a = 0; a < n; a++) at.N[a] = shape->N[g][a];
        const PetscReal more = CouplingWeight_Internal(model, &at) - model->alpha[t];

        for (PetscInt a = 0; a < n; a++) extra[at.node[a]] += density * w[g] * more * shape->N[g][a];
      }
      continue;
    }
    PetscReal corner[FEM_MAX_NODES]; /* simplices: int alpha N_a = V/n (alpha_a + sum alpha_b)/(n + 1) */

    for (PetscInt a = 0; a < n; a++) {
      for (PetscInt b = 0; b < n; b++) at.N[b] = a == b;
      corner[a] = CouplingWeight_Internal(model, &at);
      sum += corner[a];
    }
    for (PetscInt a = 0; a < n; a++) extra[at.node[a]] += density * w[0] / n * (corner[a] - sum / n) / (n + 1);
  }
  if (model->body_mass[0] > 0) PetscCall(HoldMass(model, density, particles, extra));
  PetscCall(FemModelSetExtraMass(model->fem, extra));
  PetscCall(PetscFree(extra));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline void AddMoment(const PetscReal a[3], const PetscReal b[3], PetscReal scale, PetscReal m[3])
{
  for (PetscInt d = 0; d < 3; d++) m[d] += scale * (a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3]);
}

/* What one facet does to particle `row` in each unit strain: deviatoric part 2 G w A eps n, volumetric part lambda tr(eps) v, at `arm`. */
static void AddFacet(CouplingModel model, CouplingParticle *particle, const PetscReal arm[3], const PetscReal An[3], PetscReal w, const PetscReal v[3])
{
  static const int pair[2][6][2] = {{{0, 0}, {1, 1}, {0, 1}}, {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}}};

  for (PetscInt k = 0; k < model->ns; k++) {
    const int *ij = pair[model->dim - 2][k];
    PetscReal  t[3] = {0}, m[3] = {0};

    if (ij[0] == ij[1]) {
      t[ij[0]] = 2 * model->mu * w * An[ij[0]];
      for (PetscInt d = 0; d < 3; d++) t[d] += model->lambda * v[d];
    } else { /* engineering shear: eps_ij = eps_ji = 1/2 */
      t[ij[0]] = model->mu * w * An[ij[1]];
      t[ij[1]] = model->mu * w * An[ij[0]];
    }
    AddMoment(arm, t, 1, m);
    for (PetscInt d = 0; d < 3; d++) {
      particle->F[d][k] += t[d];
      particle->M[d][k] += m[d];
    }
  }
}

/*
  Net force and moment of the weighted facets on each overlap particle in an affine field.  Eq. (6.5)

  Free facets count with their traction, so that a body without overlap has none: what is left is the weights' doing.
*/
static PetscErrorCode AffineForces(CouplingModel model, const DemPacking *packing, const DemCells *cells, const PetscReal *wp, const PetscReal *wf, const PetscInt *row, PetscInt rim_face)
{
  PetscBool found;

  PetscFunctionBegin;
  for (PetscInt f = 0; f < cells->n_facets; f++) {
    const PetscInt p = cells->p[f], q = cells->q[f];
    PetscReal      ap[3] = {0}, aq[3] = {0}, n[3] = {0}, minus[3] = {0}, v[3] = {0}, d = 0;

    if (row[p] < 0 && row[q] < 0) continue;
    for (PetscInt c = 0; c < model->dim; c++) {
      ap[c] = cells->at[3 * f + c] - packing->x[3 * p + c];
      aq[c] = cells->at[3 * f + c] - packing->x[3 * q + c];
      n[c]  = ap[c] - aq[c];
      d += n[c] * n[c];
    }
    d = PetscSqrtReal(d);
    for (PetscInt c = 0; c < model->dim; c++) {
      n[c] *= cells->area[f] / d;
      minus[c] = -n[c];
      v[c]     = cells->area[f] / d * (wp[p] * ap[c] - wp[q] * aq[c]);
    }
    if (row[p] >= 0) AddFacet(model, &model->particle[row[p]], ap, n, wf[f], v);
    for (PetscInt c = 0; c < model->dim; c++) v[c] = -v[c];
    if (row[q] >= 0) AddFacet(model, &model->particle[row[q]], aq, minus, wf[f], v);
  }
  for (PetscInt k = 0; k < cells->n_walls; k++) {
    const PetscInt p = cells->wall_p[k];
    PetscReal      arm[3] = {0}, An[3] = {0}, v[3] = {0};

    if (row[p] < 0) continue;
    for (PetscInt c = 0; c < model->dim; c++) {
      arm[c] = cells->wall_at[3 * k + c] - packing->x[3 * p + c];
      An[c]  = cells->wall_area[k] * cells->wall_normal[3 * k + c];
      v[c]   = wp[p] * An[c];
    }
    AddFacet(model, &model->particle[row[p]], arm, An, cells->wall_face[k] == rim_face ? 0 : wp[p], v); /* the rim has no spring */
    if (cells->wall_face[k] != rim_face) continue;
    PetscCall(CouplingLocate_Internal(model, &cells->wall_at[3 * k], 1e-6, &found, &model->edge[model->n_edge]));
    PetscCheck(found, model->comm, PETSC_ERR_PLIB, "A rim facet lies in no element of the overlap");
    for (PetscInt c = 0; c < 3; c++) model->edge_pull[3 * model->n_edge + c] = v[c];
    model->n_edge++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  An in-situ stress is the one of an affine displacement, in bonds and overlap alike.  Eqs (6.60), (6.61)

  Particles begin with it; nodes have it in the overlap's energy only, their elements have the stress itself (2.76).
*/
static PetscErrorCode SetInSitu(CouplingModel model)
{
  static const int at[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
  const Mesh      *mesh = CouplingMesh(model);
  const PetscReal *s = model->options.stress;
  PetscReal        trace = 0, u[3];
  PetscBool        any = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 6; k++) any = (PetscBool)(any || s[k] != 0);
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt d = 0; d < model->dim; d++) trace += s[d];
  for (PetscInt i = 0; i < model->dim; i++)
    for (PetscInt j = 0; j < model->dim; j++) model->insitu[i][j] = (s[at[i][j]] - (i == j ? model->lambda * trace / (model->dim * model->lambda + 2 * model->mu) : 0)) / (2 * model->mu);
  PetscCall(PetscMalloc2(mesh->n_nodes * model->dim, &model->before, mesh->n_nodes * model->dim, &model->total));
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    CouplingBefore(model, &mesh->x[3 * i], u);
    for (PetscInt d = 0; d < model->dim; d++) model->before[i * model->dim + d] = u[d];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingModelSetSides(CouplingModel model, FemModel fem, DemModel dem, const DemPacking *packing, const DemCells *cells, const FemMaterial *material, FemKind kind, PetscReal thickness)
{
  PetscReal particles[4] = {0}; /* [kg], [kg m] */
  PetscInt  rim_face = -1, edges = 0;
  CouplingWeights w;

  PetscFunctionBegin;
  PetscCheck(model->split && !model->fem, model->comm, PETSC_ERR_ORDER, "Call CouplingModelSetSplit() once, then CouplingModelSetSides() once");
  model->fem       = fem;
  model->dem       = dem;
  model->thickness = model->dim == 3 ? 1 : thickness;
  model->density   = material->density;
  model->mu        = material->young / (2 * (1 + material->poisson));
  model->lambda    = material->young * material->poisson / ((1 + material->poisson) * (1 - 2 * material->poisson));
  if (kind == FEM_PLANE_STRESS) model->lambda = 2 * model->lambda * model->mu / (model->lambda + 2 * model->mu);
  model->speed = PetscSqrtReal((model->lambda + 2 * model->mu) / material->density);
  PetscCall(ElementShares(model));

  PetscCall(PetscCalloc1(packing->n, &model->particle));
  PetscCall(CouplingWeightsCreate_Internal(model, packing, cells, model->particle, &w));
  BaseCheckInput(model->n_particles > 0, model->comm, "No particle lies in the overlap of '%s'; the particles are larger than its elements, use a smaller packing radius", model->split->fem.source);
  PetscCall(PetscRealloc((size_t)model->n_particles * sizeof(*model->particle), &model->particle)); /* they are few */
  PetscCall(FemModelSetCellWeights(fem, model->alpha));
  for (PetscInt p = 0; p < packing->n; p++) {
    const PetscReal m = material->density * cells->volume[p] * w.wm[p];

    particles[0] += m;
    for (PetscInt d = 0; d < model->dim; d++) particles[1 + d] += m * packing->x[3 * p + d];
  }
  PetscCall(NodeMasses(model, material->density, particles));
  PetscCall(SetInSitu(model));
  PetscCall(CouplingWeightsGive_Internal(model, &w, packing, dem));
  if (model->part) PetscCall(CouplingWeightsGive_Internal(model, &w, packing, model->part));
  PetscCall(DemModelFindFace(dem, COUPLING_RIM, &rim_face));
  for (PetscInt k = 0; k < cells->n_walls; k++) edges += cells->wall_face[k] == rim_face;
  PetscCall(PetscMalloc2(edges, &model->edge, 3 * edges, &model->edge_pull));
  if (model->options.affine) PetscCall(AffineForces(model, packing, cells, w.wp, w.wf, w.row, rim_face));
  PetscCall(CouplingWeightsDestroy_Internal(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  The springs of quadratic cells, whose functions have both signs: as stiff as sum c |q|^2 <= kinetic norm allows.  Below (6.3)

  The bound by |N| is safe and 2 to 4 times too soft. The largest eigenvalue of M^-1 G^T c G, by power iteration, takes out what it gives away.
*/
static PetscErrorCode Tighten(CouplingModel model, const FemState *fs, const DemState *ds)
{
  const PetscInt n = fs->n_nodes;
  PetscReal     *V, *F, *v, mu = 1;

  PetscFunctionBegin;
  PetscCall(PetscCalloc3(n, &V, n, &F, model->n_particles, &v));
  for (PetscInt k = 0; k < model->n_particles; k++) v[k] = 1 + 0.5 * PetscSinReal((PetscReal)k); /* one component: the others are the same */
  for (PetscInt it = 0; it < TIGHTEN; it++) {
    PetscReal sum = 0;

    PetscCall(PetscArrayzero(F, n));
    for (PetscInt k = 0; k < model->n_particles; k++) {
      const CouplingParticle *particle = &model->particle[k];
      PetscReal               q = v[k];

      for (PetscInt a = 0; a < particle->at.n; a++) q -= particle->at.N[a] * V[particle->at.node[a]];
      q *= particle->c;
      v[k] = q / ds->mass[particle->p];
      sum += ds->mass[particle->p] * v[k] * v[k];
      for (PetscInt a = 0; a < particle->at.n; a++) F[particle->at.node[a]] -= particle->at.N[a] * q;
    }
    for (PetscInt i = 0; i < n; i++) {
      V[i] = F[i] / fs->mass[i];
      sum += fs->mass[i] * V[i] * V[i];
    }
    mu = PetscSqrtReal(sum); /* of a vector that was made of length 1 */
    for (PetscInt i = 0; i < n; i++) V[i] /= mu;
    for (PetscInt k = 0; k < model->n_particles; k++) v[k] /= mu;
  }
  for (PetscInt k = 0; k < model->n_particles; k++) model->particle[k].c /= 1.02 * mu;
  PetscCall(PetscFree3(V, F, v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What goes with the methods kept for comparison, and with an absorber. */
static PetscErrorCode CheckMethod(CouplingModel model)
{
  const CouplingOptions *o = &model->options;
  const char            *what = o->method == COUPLING_CONSISTENT ? "method: consistent" : o->method == COUPLING_PENALTY ? "method: penalty" : "absorber: true";

  PetscFunctionBegin;
  if (o->method == COUPLING_ENERGY && !o->absorber) PetscFunctionReturn(PETSC_SUCCESS);
  BaseCheckInput(o->method == COUPLING_ENERGY || !o->absorber, model->comm, "%s and absorber: true do not go together: the absorber belongs to the springs of method: energy; take one out", what);
  BaseCheckInput(o->method != COUPLING_PENALTY || (o->penalty > 0 && !PetscIsInfOrNanReal(o->penalty)), model->comm, "penalty %.4g: the springs' stiffness must be positive and finite; 1 is about a bond's", (double)o->penalty);
  BaseCheckInput(o->far == COUPLING_FAR_EXPLICIT, model->comm, "%s needs all elements to step explicitly with the particles; use far_field: explicit", what);
  BaseCheckInput(o->substeps <= 1, model->comm, "%s needs one step for both sides, not %" PetscInt_FMT " sub-steps; use substeps: 1", what, o->substeps);
  if (o->method == COUPLING_CONSISTENT) {
    PetscReal alpha, local;

    PetscCall(FemModelGetLocalDamping(model->fem, &local));
    PetscCall(FemModelGetDamping(model->fem, &alpha));
    BaseCheckInput(local == 0 && alpha == 0, model->comm, "method: consistent and damping (mass_damping %.4g, local_damping %.4g) do not go together: multipliers are found before damping acts; use method: energy, or no damping", (double)alpha, (double)local);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingModelSetUp(CouplingModel model)
{
  const PetscInt dim = model->dim;
  PetscReal     *rho;
  PetscInt      *inside;
  FemState       fs;
  DemState       ds;
  DemRim         rim;

  PetscFunctionBegin;
  PetscCheck(model->fem && !model->ready, model->comm, PETSC_ERR_ORDER, "Call CouplingModelSetSides(), then CouplingModelSetUp() once");
  PetscCall(CheckMethod(model));
  PetscCall(CouplingCheckPart_Internal(model));
  PetscCall(FemModelSetUp(model->fem));
  PetscCall(DemModelSetUp(model->dem));
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(DemModelGetState(model->dem, &ds));
  PetscCheck(fs.n_nodes == CouplingMesh(model)->n_nodes, model->comm, PETSC_ERR_PLIB, "The element model has %" PetscInt_FMT " nodes, its mesh %" PetscInt_FMT, fs.n_nodes, CouplingMesh(model)->n_nodes);
  for (PetscInt i = 0; i < fs.n_nodes; i++)
    for (PetscInt d = 0; d < dim; d++) PetscCheck(fs.x[i * dim + d] == CouplingMesh(model)->x[3 * i + d], model->comm, PETSC_ERR_PLIB, "Node %" PetscInt_FMT " stands elsewhere in the element model than in its mesh", i);

  PetscCall(PetscMalloc1(ds.n, &inside));
  for (PetscInt p = 0; p < ds.n; p++) inside[ds.number[p]] = p;
  for (PetscInt k = 0; k < model->n_particles; k++) model->particle[k].p = model->particle[k].whole = inside[model->particle[k].p];
  PetscCall(PetscFree(inside));

  /* rho_I = sum |N| m-bar / M-bar, c_i = 1 / (1 + sum |N| rho): the row-sum-lumped multiplier.  Eq. (6.3) */
  PetscCall(PetscCalloc1(fs.n_nodes, &rho));
  for (PetscInt k = 0; k < model->n_particles; k++) {
    const CouplingParticle *particle = &model->particle[k];

    for (PetscInt a = 0; a < particle->at.n; a++) rho[particle->at.node[a]] += PetscAbsReal(particle->at.N[a]) * ds.mass[particle->p] / fs.mass[particle->at.node[a]];
  }
  for (PetscInt k = 0; k < model->n_particles; k++) {
    CouplingParticle *particle = &model->particle[k];
    PetscReal         sum = 1;

    for (PetscInt a = 0; a < particle->at.n; a++) sum += PetscAbsReal(particle->at.N[a]) * rho[particle->at.node[a]];
    particle->c = ds.mass[particle->p] / sum;
    if (model->options.method == COUPLING_PENALTY) {
      const PetscReal share = 1 - CouplingWeight_Internal(model, &particle->at), volume = ds.mass[particle->p] / (share * model->density);

      particle->P = model->options.penalty * (model->lambda + 2 * model->mu) * share * volume / PetscPowReal(volume / model->thickness, 2. / dim);
    }
  }
  PetscCall(PetscFree(rho));
  if (model->quadratic) PetscCall(Tighten(model, &fs, &ds));

  PetscCall(DemModelGetRim(model->dem, &rim));
  model->n_rim = rim.n;
  PetscCall(PetscMalloc1(rim.n, &model->rim));
  for (PetscInt k = 0; k < rim.n; k++) {
    PetscBool found;

    PetscCall(CouplingLocate_Internal(model, &rim.x[3 * k], 1e-6, &found, &model->rim[k]));
    PetscCheck(found, model->comm, PETSC_ERR_PLIB, "Rim facet %" PetscInt_FMT " lies in no element of the overlap", k);
  }
  PetscCall(PetscCalloc1(fs.n_nodes * dim, &model->g));
  PetscCall(CouplingFit_Internal(model));
  model->report.particles = model->n_particles;
  model->report.bonds     = model->overlap_bonds;
  model->report.cells     = model->n_overlap;
  for (PetscInt i = 0; i < fs.n_nodes; i++) model->report.nodes += model->split->s[i] < 1;
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscCall(DemModelRestoreState(model->dem, &ds));
  if (model->options.absorber) PetscCall(PetscCalloc1(3 * model->n_particles, &model->slip));
  if (model->options.method == COUPLING_CONSISTENT) PetscCall(CouplingMultiplierSetUp_Internal(model));
  PetscCall(CouplingChooseSubsteps_Internal(model));
  model->report.substeps = model->substeps;
  model->report.implicit = (PetscBool)(model->far && model->options.far != COUPLING_FAR_STATIC);
  if (model->options.preload && !(model->given > 0)) PetscCall(CouplingPreload_Internal(model)); /* a run that goes on has its state */
  else if (model->before && !(model->given > 0)) PetscCall(CouplingStartStressed_Internal(model));
  PetscCall(CouplingPartSetUp_Internal(model));
  model->ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingModelGetFar(CouplingModel model, FemFarReport *report)
{
  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call CouplingModelSetUp() before asking for its far field");
  PetscCall(FemModelGetFar(model->fem, report));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingModelGetReport(CouplingModel model, CouplingReport *report)
{
  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call CouplingModelSetUp() before asking for its report");
  *report          = model->report;
  report->absorbed = model->absorbed;
  report->solves   = model->solves;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingModelDestroy(CouplingModel *pmodel)
{
  CouplingModel model = *pmodel;

  PetscFunctionBegin;
  if (!model) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(model->top));
  PetscCall(PetscFree(model->overlap));
  PetscCall(PetscFree(model->alpha));
  PetscCall(PetscFree(model->particle));
  PetscCall(PetscFree(model->rim));
  PetscCall(PetscFree2(model->edge, model->edge_pull));
  PetscCall(PetscFree2(model->K, model->X));
  PetscCall(PetscFree(model->g));
  PetscCall(PetscFree(model->slip));
  PetscCall(PetscFree2(model->before, model->total));
  PetscCall(CouplingMultiplierDestroy_Internal(model));
  PetscCall(CouplingPartDestroy_Internal(model));
  PetscCall(PetscFree2(model->history_name, model->history_unit));
  PetscCall(PetscFree(*pmodel));
  PetscFunctionReturn(PETSC_SUCCESS);
}
