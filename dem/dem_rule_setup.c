/*
  dem_rule_setup.c - the published rules as data: which pairs are bonded, over what area, how stiff.  Eqs (4.40)-(4.49)

  onate2015, given   pairs within the interaction range, area of a circle (2D: width of a disc)
  kdem               pairs with a common facet of the power diagram, area of the facet; or pairs within the range, areas of dem_rule_area.c
*/
#include "dem_pack_impl.h"
#include "dem_rule.h"

static int ComparePairs(const void *a, const void *b)
{
  const DemPair *s = a, *t = b;

  if (s->p != t->p) return s->p < t->p ? -1 : 1;
  return s->q < t->q ? -1 : s->q > t->q;
}

/* Neighbours across facets: partner[start[p]..start[p + 1]) of packing's particle p, and the facet's number. Caller frees all three. */
static PetscErrorCode FacetNeighbours(const DemCells *cells, PetscInt **start, PetscInt **partner, PetscInt **facet)
{
  PetscInt *fill;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(cells->n + 1, start));
  PetscCall(PetscMalloc1(cells->n + 1, &fill));
  PetscCall(PetscMalloc1(2 * cells->n_facets, partner));
  PetscCall(PetscMalloc1(2 * cells->n_facets, facet));
  for (PetscInt k = 0; k < cells->n_facets; k++) {
    (*start)[cells->p[k] + 1]++;
    (*start)[cells->q[k] + 1]++;
  }
  for (PetscInt p = 0; p < cells->n; p++) (*start)[p + 1] += (*start)[p];
  PetscCall(PetscArraycpy(fill, *start, cells->n + 1));
  for (PetscInt k = 0; k < cells->n_facets; k++) {
    (*partner)[fill[cells->p[k]]] = cells->q[k];
    (*facet)[fill[cells->p[k]]++] = k;
    (*partner)[fill[cells->q[k]]] = cells->p[k];
    (*facet)[fill[cells->q[k]]++] = k;
  }
  PetscCall(PetscFree(fill));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A particle whose range holds it by fewer than dim + 1 bonds is a rattler, which a pressed face would shoot through the body: it is joined to its
   nearest neighbours across facets as well, until it has as many.  Eq. (4.45) */
static PetscErrorCode JoinLoose(DemModel model, const PetscInt *start, const PetscInt *partner, const PetscInt *facet, PetscInt *m, DemPair **pairs)
{
  const PetscInt   n = model->n, found = *m;
  const PetscReal *x = model->packing.x, *r = model->packing.r;
  PetscInt        *degree, extra = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n, &degree)); /* of packing's particles */
  for (PetscInt k = 0; k < found; k++) {
    degree[model->at[(*pairs)[k].p]]++;
    degree[model->at[(*pairs)[k].q]]++;
  }
  for (PetscInt p = 0; p < n; p++)
    if (degree[p] <= model->dim) extra += model->dim + 1 - degree[p];
  if (extra) PetscCall(PetscRealloc((found + extra) * sizeof(**pairs), pairs));
  for (PetscInt p = 0; p < n; p++)
    while (degree[p] <= model->dim) {
      PetscReal least = PETSC_MAX_REAL;
      PetscInt  best = -1;

      for (PetscInt f = start[p]; f < start[p + 1]; f++) {
        const PetscInt  q = partner[f], a = PetscMin(model->rank_of[p], model->rank_of[q]), b = PetscMax(model->rank_of[p], model->rank_of[q]);
        const PetscReal d = PetscSqrtReal(PetscSqr(x[3 * p] - x[3 * q]) + PetscSqr(x[3 * p + 1] - x[3 * q + 1]) + PetscSqr(x[3 * p + 2] - x[3 * q + 2])), gap = d / (r[p] + r[q]);
        PetscBool       joined = (PetscBool)(PetscAbsReal(gap - 1) <= model->rule.range); /* then it is in the list */

        for (PetscInt k = found; k < *m && !joined; k++) joined = (PetscBool)((*pairs)[k].p == a && (*pairs)[k].q == b);
        if (joined || gap >= least) continue;
        least = gap;
        best  = f;
      }
      if (best < 0) break; /* no more neighbours */
      (*pairs)[(*m)++] = (DemPair){PetscMin(model->rank_of[p], model->rank_of[partner[best]]), PetscMax(model->rank_of[p], model->rank_of[partner[best]]), facet[best]};
      degree[p]++;
      degree[partner[best]]++;
    }
  PetscCall(PetscFree(degree));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemRulePairs_Internal(DemModel model, PetscInt *n_pairs, DemPair **pairs)
{
  const DemCells *cells = &model->cells;
  const PetscInt  n = model->n;
  PetscInt        m = 0, *start, *near_start, *near, *partner, *facet;

  PetscFunctionBegin;
  if (model->rule.elasticity == DEM_KDEM && !model->rule.polyhedron) {
    PetscCall(PetscMalloc1(cells->n_facets, pairs));
    for (PetscInt k = 0; k < cells->n_facets; k++) {
      const PetscInt p = model->rank_of[cells->p[k]], q = model->rank_of[cells->q[k]];

      (*pairs)[k] = (DemPair){PetscMin(p, q), PetscMax(p, q), k};
    }
    m = cells->n_facets;
  } else {
    PetscCall(FacetNeighbours(cells, &start, &partner, &facet));
    PetscCall(DemPackNeighbours(model->dim, n, model->packing.x, model->packing.r, model->rule.range + 1e-12, &near_start, &near));
    PetscCall(PetscMalloc1(near_start[n] / 2 + 1, pairs));
    for (PetscInt p = 0; p < n; p++)
      for (PetscInt l = near_start[p]; l < near_start[p + 1]; l++) {
        const PetscInt  q = near[l];
        const PetscReal reach = model->packing.r[p] + model->packing.r[q];
        PetscReal       d = 0;
        PetscInt        shared = -1;
        PetscBool       joined = PETSC_FALSE;

        if (q <= p) continue;
        for (PetscInt c = 0; c < 3; c++) d += PetscSqr(model->packing.x[3 * p + c] - model->packing.x[3 * q + c]);
        d = PetscSqrtReal(d);
        if (d < (1 - model->rule.range) * reach || d > (1 + model->rule.range) * reach) continue; /* Eq. (4.45) */
        for (PetscInt f = start[p]; f < start[p + 1]; f++)
          if (partner[f] == q) shared = facet[f];
        joined = (PetscBool)(shared >= 0);
        for (PetscInt f = start[p]; f < start[p + 1] && !joined; f++) /* through one common neighbour: no bond then crosses a notch */
          for (PetscInt g = start[q]; g < start[q + 1] && !joined; g++) joined = (PetscBool)(partner[f] == partner[g]);
        if (!joined) continue;
        (*pairs)[m++] = (DemPair){PetscMin(model->rank_of[p], model->rank_of[q]), PetscMax(model->rank_of[p], model->rank_of[q]), shared};
      }
    PetscCall(PetscFree(near_start));
    PetscCall(PetscFree(near));
    PetscCall(JoinLoose(model, start, partner, facet, &m, pairs));
    PetscCall(PetscFree(start));
    PetscCall(PetscFree(partner));
    PetscCall(PetscFree(facet));
    BaseCheckInput(m > 0, model->comm, "No two particles lie within the interaction range %.6g of each other; raise interaction_range or pack denser", (double)model->rule.range);
  }
  if (m > 1) qsort(*pairs, m, sizeof(**pairs), ComparePairs);
  *n_pairs = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Volume that spheres of radii a and b at distance d have in common [m3] */
static PetscReal Lens(PetscReal a, PetscReal b, PetscReal d)
{
  return d >= a + b ? 0 : PETSC_PI * PetscSqr(a + b - d) * (d * d + 2 * d * (a + b) - 3 * PetscSqr(a - b)) / (12 * d);
}

/* alpha = 40 P / N_c, the overlap of bonded pairs counted once.  Eq. (4.47) */
static PetscReal PublishedFactor(DemModel model)
{
  const PetscInt  n = model->n;
  const DemBonds *b = &model->bonds;
  PetscReal       solid = 0, volume = 0;

  for (PetscInt p = 0; p < n; p++) {
    solid += 4.0 / 3 * PETSC_PI * model->r[p] * model->r[p] * model->r[p];
    volume += model->volume[p];
  }
  for (PetscInt e = 0; e < b->n; e++) {
    PetscReal d = 0;

    for (PetscInt c = 0; c < 3; c++) d += PetscSqr(model->x0[c * n + b->q[e]] - model->x0[c * n + b->p[e]]);
    solid -= Lens(model->r[b->p[e]], model->r[b->q[e]], PetscSqrtReal(d));
  }
  return 40 * (1 - solid / volume) / (2.0 * b->n / n);
}

PetscErrorCode DemSetUpRule_Internal(DemModel model)
{
  const PetscInt  n = model->n, m = model->bonds.n, slots = model->blocks.halo_start[model->blocks.n_blocks];
  const DemRule  *rule = &model->rule;
  const PetscReal E = model->material.young, G = 0.5 * E / (1 + model->material.poisson);
  DemBonds       *bonds = &model->bonds;
  DemNetwork      net = model->net;
  PetscReal      *area = NULL;

  PetscFunctionBegin;
  BaseCheckInput(!model->weight_mass, model->comm, "A coupled body needs elasticity: exact; the published rules do not balance against finite elements");
  PetscCall(PetscMalloc5(m, &net->kn, m, &net->ks, m, &net->area, m, &net->part, m, &net->length));
  net->area_factor = rule->area_factor;
  if (rule->elasticity != DEM_KDEM && net->area_factor == 0) {
    BaseCheckInput(model->dim == 3, model->comm, "The published packing factor 40 P/N_c is for spheres; give area_factor in two dimensions");
    net->area_factor = PublishedFactor(model);
  }
  if (rule->polyhedron) {
    PetscCall(PetscMalloc1(m, &area));
    PetscCall(DemPolyhedronAreas_Internal(model, area));
  }
  for (PetscInt e = 0; e < m; e++) {
    const PetscInt  p = bonds->p[e], q = bonds->q[e];
    const PetscReal rp = model->r[p], rq = model->r[q], rc = PetscMin(rp, rq);
    PetscReal       d = 0;

    for (PetscInt c = 0; c < model->dim; c++) d += PetscSqr(model->x0[c * n + q] - model->x0[c * n + p]);
    d = PetscSqrtReal(d);
    if (rule->polyhedron) net->area[e] = area[e];
    else if (rule->elasticity == DEM_KDEM) net->area[e] = model->cells.area[bonds->facet[e]];
    else net->area[e] = net->area_factor * (model->dim == 3 ? PETSC_PI * rc * rc : 2 * rc * model->body.thickness); /* Eq. (4.46) */
    net->kn[e] = rule->elasticity == DEM_GIVEN ? rule->normal_stiffness : E * net->area[e] / d * rule->normal_factor;
    net->ks[e] = rule->elasticity == DEM_GIVEN ? rule->shear_stiffness : G * net->area[e] / d * rule->shear_factor;
    net->part[e] = PetscMax(0.1, PetscMin(0.9, 0.5 * (d + rp - rq) / d)); /* middle of the gap.  Eq. (4.40) */
    net->length[e] = d;
    bonds->k[e]  = net->area[e] / d;
    for (PetscInt c = 0; c < 3; c++) bonds->arm[c * m + e] = c < model->dim ? net->part[e] * (model->x0[c * n + q] - model->x0[c * n + p]) : 0;
  }
  PetscCall(PetscFree(area));
  if (rule->poisson_term || model->strength.nonlocal) {
    PetscCall(PetscCalloc3(6 * n, &net->stress, 6 * n, &net->stress_sum, 6 * slots, &net->slot_stress));
    PetscCall(PetscCalloc1(model->threads, &net->scratch));
    for (PetscInt t = 0; t < model->threads; t++) PetscCall(PetscMalloc1(6 * model->blocks.widest, &net->scratch[t]));
  }
  if (rule->poisson_term) PetscCall(PetscCalloc3(m, &net->nu_force, m, &net->nu_length, model->blocks.n_blocks, &net->block_work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every bond must reach its limit before its end.  Eq. (4.53) */
PetscErrorCode DemRuleCheckLaw_Internal(DemModel model)
{
  const DemStrength *s = &model->strength;
  DemNetwork         net = model->net;
  PetscReal          tension = 0, shear = 0; /* largest limit / end of the softening */

  PetscFunctionBegin;
  BaseCheckInput(s->published, model->comm, "law: cohesive belongs to elasticity: exact; with the published rules write law: published");
  for (PetscInt e = 0; e < model->bonds.n; e++) {
    if (s->tensile > 0 && s->delta_n == 0) tension = PetscMax(tension, s->tensile * s->tensile * net->area[e] / (2 * s->fracture_energy * net->kn[e]));
    if (s->shear > 0 && s->delta_s == 0) shear = PetscMax(shear, s->shear * s->shear * net->area[e] / (2 * s->shear_energy * net->ks[e]));
  }
  BaseCheckInput(tension < 1, model->comm, "The particles are too far apart for the fracture energy: the longest bond is %.3g times what d < 2 E G_f/sigma_t^2 allows (smaller particles, a larger fracture_energy, or delta_n)", (double)tension);
  BaseCheckInput(shear < 1, model->comm, "The particles are too far apart for the shear fracture energy: the longest bond is %.3g times what it allows (smaller particles, a larger fracture_energy_shear, or delta_s)", (double)shear);
  PetscCall(PetscCalloc1(DEM_PAST_ALL * model->bonds.n, &net->hist));
  for (PetscInt e = 0; e < model->bonds.n; e++) net->hist[DEM_PAST_OPEN * model->bonds.n + e] = net->hist[DEM_PAST_SLIDE * model->bonds.n + e] = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemRuleDestroy_Internal(DemModel model)
{
  DemNetwork net = model->net;

  PetscFunctionBegin;
  if (!net) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree5(net->kn, net->ks, net->area, net->part, net->length));
  PetscCall(PetscFree3(net->stress, net->stress_sum, net->slot_stress));
  PetscCall(PetscFree3(net->nu_force, net->nu_length, net->block_work));
  PetscCall(PetscFree(net->hist));
  if (net->scratch)
    for (PetscInt t = 0; t < model->threads; t++) PetscCall(PetscFree(net->scratch[t]));
  PetscCall(PetscFree(net->scratch));
  PetscCall(PetscFree(model->net));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal DemRuleStiffening_Internal(DemModel model)
{
  const PetscReal nu = model->rule.poisson_term ? model->material.poisson : 0;

  return PetscMax(1, (1 - nu) / ((1 + nu) * (1 - 2 * nu)));
}

/*
  Largest omega^2 by a bound per particle. |w_q - w_p|^2 <= 2 |w_p|^2 + 2 |w_q|^2 for the motion w of either particle's contact point parts the particles, as in
  (4.14); what is left is one 6 x 6 eigenvalue per particle. The Poisson term is bounded by the stiffness of confined
  compression over that of a free bar.  Eq. (4.49)

  turned: the pairs may have broken and turned as far as they like. Their friction then acts half way between the two images of the
  contact point, which can be as far from a centre as the other centre, while the slide still grows by the arm at rest: |a| d for |a|^2.  Eq. (4.72)
*/
PetscErrorCode DemRuleRate_Internal(DemModel model, PetscBool turned, PetscReal *rate)
{
  const PetscInt  n = model->n, dim = model->dim;
  const DemBonds *b = &model->bonds;
  const DemWalls *w = &model->walls;
  DemNetwork      net = model->net;
  PetscReal      *block, worst = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(36 * n, &block));
  for (PetscInt e = 0; e < b->n; e++) {
    PetscReal y[3] = {0}, d = 0;

    for (PetscInt c = 0; c < dim; c++) {
      y[c] = model->x0[c * n + b->q[e]] - model->x0[c * n + b->p[e]];
      d += y[c] * y[c];
    }
    d = PetscSqrtReal(d);
    for (PetscInt side = 0; side < 2; side++) {
      const PetscInt  p = side ? b->q[e] : b->p[e];
      const PetscReal im = 1 / PetscSqrtReal(model->mass[p]), ii = 1 / PetscSqrtReal(model->inertia[p]), f = side ? net->part[e] - 1 : net->part[e];
      const PetscReal arm = turned ? f / PetscSqrtReal(PetscMax(PetscAbsReal(f), PETSC_SMALL)) : f; /* of the distance */
      PetscReal(*B)[6] = (PetscReal(*)[6])(block + 36 * p);

      for (PetscInt r = 0; r < 3; r++) { /* k_s of the whole motion, k_n - k_s of its part along n */
        const PetscInt  u = (r + 1) % 3, v = (r + 2) % 3;
        PetscReal       row[6] = {0};

        row[r]     = im;
        row[3 + u] = ii * arm * y[v];
        row[3 + v] = -ii * arm * y[u];
        for (int i = 0; i < 6; i++)
          for (int j = 0; j < 6; j++) B[i][j] += 2 * net->ks[e] * row[i] * row[j];
      }
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) B[i][j] += 2 * (net->kn[e] - net->ks[e]) * im * im * y[i] * y[j] / (d * d);
    }
  }
  for (PetscInt i = 0; i < w->n; i++) {
    const PetscInt  p = w->owner[i];
    const PetscReal im = 1 / PetscSqrtReal(model->mass[p]), ii = 1 / PetscSqrtReal(model->inertia[p]), *a = w->arm + 3 * i;
    PetscReal(*B)[6] = (PetscReal(*)[6])(block + 36 * p);

    if (w->kind[i] == DEM_WALL_TRACTION) continue;
    for (PetscInt r = 0; r < 3; r++) {
      const PetscInt u = (r + 1) % 3, v = (r + 2) % 3;
      PetscReal      row[6] = {0};

      row[r]     = im;
      row[3 + u] = ii * a[v];
      row[3 + v] = -ii * a[u];
      for (int s = 0; s < 6; s++)
        for (int t = 0; t < 6; t++) B[s][t] += w->area[i] / w->h[i] * 2 * model->g_shear * row[s] * row[t];
    }
  }
  for (PetscInt p = 0; p < n; p++) {
    PetscReal(*B)[6] = (PetscReal(*)[6])(block + 36 * p);

    if (dim == 2)
      for (int i = 2; i < 5; i++)
        for (int j = 0; j < 6; j++) B[i][j] = B[j][i] = 0;
    const PetscReal largest = DemLargestOfBlock_Internal(B); /* spends B */

    worst = PetscMax(worst, largest);
  }
  PetscCall(PetscFree(block));
  *rate = worst * DemRuleStiffening_Internal(model);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemRuleSave_Internal(DemModel model, Checkpoint c)
{
  DemNetwork      net = model->net;
  PetscReal       work = net->nu_work;

  PetscFunctionBegin;
  if (net->hist) PetscCall(DemSaveRows_Internal(model, c, "dem/bond_past", DEM_OF_BONDS, DEM_PAST_ALL, 1, net->hist));
  if (net->stress) PetscCall(DemSaveRows_Internal(model, c, "dem/stress", DEM_OF_PARTICLES, 1, 6, net->stress));
  if (net->nu_force) {
    PetscCall(DemSumRanks_Internal(model, 1, &work));
    PetscCall(DemSaveRows_Internal(model, c, "dem/poisson_force", DEM_OF_BONDS, 1, 1, net->nu_force));
    PetscCall(DemSaveRows_Internal(model, c, "dem/poisson_length", DEM_OF_BONDS, 1, 1, net->nu_length));
    PetscCall(CheckpointWriteReal(c, "dem/poisson_work", 1, &work));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemRuleLoad_Internal(DemModel model, Checkpoint c)
{
  DemNetwork     net = model->net;

  PetscFunctionBegin;
  if (net->hist) PetscCall(DemLoadRows_Internal(model, c, "dem/bond_past", DEM_OF_BONDS, DEM_PAST_ALL, 1, net->hist));
  if (net->stress) PetscCall(DemLoadRows_Internal(model, c, "dem/stress", DEM_OF_PARTICLES, 1, 6, net->stress));
  if (net->nu_force) {
    PetscCall(DemLoadRows_Internal(model, c, "dem/poisson_force", DEM_OF_BONDS, 1, 1, net->nu_force));
    PetscCall(DemLoadRows_Internal(model, c, "dem/poisson_length", DEM_OF_BONDS, 1, 1, net->nu_length));
    PetscCall(CheckpointReadReal(c, "dem/poisson_work", 1, &net->nu_work));
    if (model->ranks && model->ranks->rank) net->nu_work = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
