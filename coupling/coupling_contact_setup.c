/* coupling_contact_setup.c - the surface from the body's boundary facets, and the step that contacts allow.  Eqs (5.70), (5.76)-(5.78), docs/theory.md */
#include "coupling_contact_impl.h"
#include "fem_body.h"
#include "fem_element.h"

/* Cells of the surface before they are one: their corners in space, and which body nodes carry each corner. */
typedef struct {
  PetscInt   n, room;
  PetscReal *x;       /* [n][dim][3] */
  PetscInt  *carrier; /* [n][dim][CONTACT_NODES] */
} Loose;

static PetscErrorCode AddCell(const Mesh *mesh, const FemBody *body, PetscInt dim, const PetscInt carriers[][CONTACT_NODES], Loose *loose)
{
  PetscFunctionBegin;
  if (loose->n == loose->room) {
    loose->room = 2 * loose->room + 64;
    PetscCall(PetscRealloc((size_t)(loose->room * dim * 3) * sizeof(PetscReal), &loose->x));
    PetscCall(PetscRealloc((size_t)(loose->room * dim * CONTACT_NODES) * sizeof(PetscInt), &loose->carrier));
  }
  for (PetscInt k = 0; k < dim; k++) {
    PetscReal     *x = &loose->x[(loose->n * dim + k) * 3];
    const PetscInt m = CouplingCarriers(carriers[k]);

    for (PetscInt d = 0; d < 3; d++) x[d] = 0;
    for (PetscInt a = 0; a < CONTACT_NODES; a++) {
      loose->carrier[(loose->n * dim + k) * CONTACT_NODES + a] = carriers[k][a];
      for (PetscInt d = 0; d < dim && a < m; d++) x[d] += mesh->x[3 * body->old[carriers[k][a]] + d] / m;
    }
  }
  loose->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One boundary facet: a segment, a triangle, or a quadrilateral as four triangles about its middle. node: body nodes. */
static PetscErrorCode AddFacet(const Mesh *mesh, const FemBody *body, PetscInt dim, PetscInt n, const PetscInt node[], Loose *loose)
{
  PetscInt carriers[3][CONTACT_NODES];

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 3; k++)
    for (PetscInt a = 0; a < CONTACT_NODES; a++) carriers[k][a] = -1;
  if (n == dim) {
    for (PetscInt k = 0; k < dim; k++) carriers[k][0] = node[k];
    PetscCall(AddCell(mesh, body, dim, (const PetscInt(*)[CONTACT_NODES])carriers, loose));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt a = 0; a < 4; a++) carriers[2][a] = node[a];
  for (PetscInt k = 0; k < 4; k++) {
    carriers[0][0] = node[k];
    carriers[1][0] = node[(k + 1) % 4];
    PetscCall(AddCell(mesh, body, dim, (const PetscInt(*)[CONTACT_NODES])carriers, loose));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddFacets(MPI_Comm comm, const char *name, const Mesh *mesh, const FemBody *body, Loose *loose)
{
  PetscFunctionBegin;
  for (PetscInt c = 0; c < body->n_cells; c++) {
    const MeshCellType type  = mesh->type[body->cell[c]];
    const FemShape    *shape = FemShapeGet(type);

    BaseCheckInput(MeshCellNodes(type) == MeshCellCorners(type), comm, "Body '%s' has quadratic cells; particles meet the surface of linear ones (mesh: {order: 1})", name);
    for (PetscInt f = 0; f < shape->faces; f++) {
      PetscInt node[FEM_MAX_FACE_NODES], old[FEM_MAX_FACE_NODES], cell[2], side;

      for (PetscInt a = 0; a < shape->face_nodes[f]; a++) {
        node[a] = body->node[body->start[c] + shape->face[f][a]];
        old[a]  = body->old[node[a]];
      }
      if (FemBodyFindSide(mesh, body, shape->face_nodes[f], old, cell, &side) == 1) PetscCall(AddFacet(mesh, body, mesh->dim, shape->face_nodes[f], node, loose));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells keep their number but may be turned round: each corner takes the carriers of the loose corner at its place. */
static PetscErrorCode Carry(CouplingContact c, const Loose *loose)
{
  const DemSurface *s = &c->surface;
  const PetscInt    dim = s->dim;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(CONTACT_NODES * s->n_nodes, &c->carrier, 3 * s->n_nodes, &c->x_grid));
  for (PetscInt k = 0; k < dim * s->n; k++) {
    const PetscReal *x    = &s->x[3 * s->corner[k]];
    PetscReal        best = PETSC_MAX_REAL;
    PetscInt         at   = -1;

    for (PetscInt j = k - k % dim; j < k - k % dim + dim; j++) {
      const PetscReal gap = PetscSqr(x[0] - loose->x[3 * j]) + PetscSqr(x[1] - loose->x[3 * j + 1]) + PetscSqr(x[2] - loose->x[3 * j + 2]);

      if (gap < best) {
        best = gap;
        at   = j;
      }
    }
    PetscCall(PetscArraycpy(&c->carrier[CONTACT_NODES * s->corner[k]], &loose->carrier[CONTACT_NODES * at], CONTACT_NODES));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MakeSurface(CouplingContact c, const Mesh *mesh, const FemBody *body, Loose *loose)
{
  PetscFunctionBegin;
  PetscCall(AddFacets(c->comm, c->name, mesh, body, loose));
  PetscCall(DemSurfaceCreate(c->name, mesh->dim, loose->n, loose->x, &c->surface));
  BaseCheckInput(c->surface.closed, c->comm, "The boundary of body '%s' is not a closed surface", c->name);
  PetscCall(Carry(c, loose));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingContactCreate(MPI_Comm comm, const char *name, const Mesh *mesh, CouplingContact *contact)
{
  CouplingContact c;
  FemBody         body;
  Loose           loose = {0};
  PetscMPIInt     size;
  PetscErrorCode  code;
  char            words[BASE_LINE] = "";

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  BaseCheckInput(size == 1, comm, "Particles against finite elements run on one rank for now, not %d; give them threads instead", size);
  PetscCall(FemBodyCreate(mesh, &body, words));
  BaseCheckInput(!words[0], comm, "%s", words);
  PetscCall(PetscNew(&c));
  c->comm    = comm;
  c->dim     = mesh->dim;
  c->n_nodes = body.n_nodes;
  c->seen    = -1;
  PetscCall(PetscStrncpy(c->name, name, sizeof(c->name)));
  code = MakeSurface(c, mesh, &body, &loose);
  PetscCall(FemBodyDestroy(&body));
  PetscCall(PetscFree(loose.x));
  PetscCall(PetscFree(loose.carrier));
  if (code) PetscCall(CouplingContactDestroy(&c));
  *contact = c;
  PetscFunctionReturn(code);
}

PetscErrorCode CouplingContactSetSides(CouplingContact c, FemModel fem, DemModel dem)
{
  FemState fs;
  DemState ds;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(fem, &fs));
  PetscCall(DemModelGetState(dem, &ds));
  PetscCheck(fs.n_nodes == c->n_nodes && fs.dim == c->dim && ds.dim == c->dim, c->comm, PETSC_ERR_ARG_INCOMP, "The surface of '%s' belongs to a mesh of %" PetscInt_FMT " nodes in %" PetscInt_FMT "D; the model has %" PetscInt_FMT " in %" PetscInt_FMT "D, the particles are %" PetscInt_FMT "D", c->name,
             c->n_nodes, c->dim, fs.n_nodes, fs.dim, ds.dim);
  PetscCall(FemModelRestoreState(fem, &fs));
  PetscCall(DemModelRestoreState(dem, &ds));
  c->fem = fem;
  c->dem = dem;
  PetscCall(FemModelGetStepper(fem, &c->fem_stepper));
  PetscCall(DemModelGetStepper(dem, &c->dem_stepper));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void CouplingContactMove_Internal(CouplingContact c, const FemState *fs)
{
  for (PetscInt i = 0; i < c->surface.n_nodes; i++) {
    const PetscInt *carrier = &c->carrier[CONTACT_NODES * i], m = CouplingCarriers(carrier);

    for (PetscInt d = 0; d < fs->dim; d++) {
      PetscReal sum = 0;

      for (PetscInt a = 0; a < m; a++) sum += fs->x[carrier[a] * fs->dim + d] + fs->u[carrier[a] * fs->dim + d];
      c->surface.x[3 * i + d] = sum / m;
    }
  }
}

/* int N_a dA over the surface [m2] (2D: [m]) of each body node, and sum |lever|^2/m over the worst cell [1/(kg m2)] */
static void Areas(CouplingContact c, const FemState *fs, PetscReal *area, PetscReal *couple)
{
  const DemSurface *s = &c->surface;

  *couple = 0;
  for (PetscInt e = 0; e < s->n; e++) {
    const PetscInt *corner = &s->corner[c->dim * e];
    PetscReal       side2[3], size, sum = 0;

    for (PetscInt k = 0; k < 3; k++) { /* opposite to corner k */
      const PetscReal *a = &s->x[3 * corner[(k + 1) % c->dim]], *b = &s->x[3 * corner[c->dim == 3 ? (k + 2) % 3 : 0]];

      side2[k] = PetscSqr(b[0] - a[0]) + PetscSqr(b[1] - a[1]) + PetscSqr(b[2] - a[2]);
    }
    if (c->dim == 2) size = PetscSqrtReal(side2[0]);
    else size = 0.25 * PetscSqrtReal(PetscMax(0, 2 * (side2[0] * side2[1] + side2[1] * side2[2] + side2[2] * side2[0]) - side2[0] * side2[0] - side2[1] * side2[1] - side2[2] * side2[2])); /* Heron */
    for (PetscInt k = 0; k < c->dim; k++) {
      const PetscInt *carrier = &c->carrier[CONTACT_NODES * corner[k]], m = CouplingCarriers(carrier);

      for (PetscInt a = 0; a < m; a++) {
        area[carrier[a]] += size / c->dim / m;
        sum += (c->dim == 3 ? side2[k] / PetscSqr(2 * size) : 1 / PetscSqr(size)) / m / fs->mass[carrier[a]];
      }
    }
    *couple = PetscMax(*couple, sum);
  }
}

/*
  Largest (stiffness/mass) and (dashpot/mass) that contacts can have: P of the particles plus Q of the nodes. A particle has two
  contacts in a line; on a node bear as many as the densest layer of the smallest particles sets there, and one more.
*/
PetscErrorCode CouplingContactRate_Internal(CouplingContact c)
{
  const DemContactPair *pair = &c->pair;
  const PetscReal       slides = pair->mu_static > 0 ? 1 : 0;
  DemOutside            o;
  FemState              fs;
  DemState              ds;
  PetscReal             P = 0, Q = 0, DP = 0, DQ = 0, S_most = 0, drag_most = 0, couple, smallest = PETSC_MAX_REAL, *area, bears = 0, roll = 0;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(c->fem, &fs));
  PetscCall(DemModelGetState(c->dem, &ds));
  PetscCall(DemModelGetOutside(c->dem, &o));
  for (PetscInt p = 0; p < ds.n; p++) {
    const PetscReal r = o.radius[p], size = c->dim == 2 ? 0.5 * c->options.thickness : r, S = DemContactStiffness(pair, size, c->options.deepest * r);
    const PetscReal turn = 1 + ds.mass[p] * r * r / ds.inertia[p], sum = (pair->roll_spring + pair->twist_spring) * S * r * r;

    smallest = PetscMin(smallest, r);
    P        = PetscMax(P, 2 * (S / ds.mass[p] * PetscMax(1, slides * pair->ratio * turn) + (c->turns ? sum / ds.inertia[p] : 0)));
    DP       = PetscMax(DP, 2 * PetscSqrtReal(S / ds.mass[p]) * PetscMax(pair->drag, slides * pair->drag_tangent * turn));
    S_most    = PetscMax(S_most, S);
    drag_most = PetscMax(drag_most, PetscSqrtReal(S * ds.mass[p]));
    if (c->turns) roll = PetscMax(roll, sum);
  }
  PetscCall(PetscCalloc1(fs.n_nodes, &area));
  Areas(c, &fs, area, &couple);
  for (PetscInt a = 0; a < fs.n_nodes; a++) {
    const PetscReal most = 1 + area[a] / (c->dim == 3 ? 2 * PetscSqrtReal(3.0) * smallest * smallest : 2 * smallest);

    if (area[a] == 0) continue;
    Q     = PetscMax(Q, most * S_most / fs.mass[a] * PetscMax(1, slides * pair->ratio));
    DQ    = PetscMax(DQ, most * drag_most / fs.mass[a] * PetscMax(pair->drag, slides * pair->drag_tangent));
    bears = PetscMax(bears, most);
  }
  if (c->turns) Q += bears * roll * couple;
  c->rate = P + Q;
  c->drag = DP + DQ;
  PetscCall(PetscFree(area));
  PetscCall(DemModelRestoreState(c->dem, &ds));
  PetscCall(FemModelRestoreState(c->fem, &fs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal CouplingContactLimit_Internal(PetscReal fem, PetscReal dem, PetscReal rate, PetscReal drag, PetscReal dt)
{
  return PetscMax(PetscSqr(dt / fem), dt / dem) + 0.25 * rate * dt * dt + 0.5 * drag * dt;
}

PetscErrorCode CouplingContactGetStableStep(CouplingContact c, PetscReal *dt)
{
  PetscReal fem, dem, low = 0, high;

  PetscFunctionBegin;
  PetscCheck(c->ready, c->comm, PETSC_ERR_ORDER, "Call CouplingContactSetUp() before asking for the step");
  PetscCall(c->fem_stepper.stable_step(c->fem_stepper.ctx, &fem));
  PetscCall(c->dem_stepper.stable_step(c->dem_stepper.ctx, &dem));
  high = PetscMin(fem, dem);
  for (PetscInt k = 0; k < 60; k++) { /* the limit grows with the step */
    const PetscReal middle = 0.5 * (low + high);

    if (CouplingContactLimit_Internal(fem, dem, c->rate, c->drag, middle) <= 1) low = middle;
    else high = middle;
  }
  *dt = low;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Overlaps at the start push, so they must be none to speak of. */
static PetscErrorCode CheckStart(CouplingContact c)
{
  DemState ds;

  PetscFunctionBegin;
  PetscCall(DemModelGetState(c->dem, &ds));
  for (PetscInt k = 0; k < c->n; k++) {
    const CouplingTouch *t = &c->contact[k];
    DemOutside           o;

    PetscCall(DemModelGetOutside(c->dem, &o));
    BaseCheckInput(PetscAbsReal(t->history.overlap) <= 1e-3 * o.radius[t->p], c->comm, "At the start particle %" PetscInt_FMT " overlaps the surface of '%s' by %.3g of its radius, near (%.6g, %.6g, %.6g) m; move the bodies apart",
                   ds.number[t->p], c->name, (double)(PetscAbsReal(t->history.overlap) / o.radius[t->p]), (double)ds.x0[t->p], (double)ds.x0[ds.n + t->p], (double)ds.x0[2 * ds.n + t->p]);
  }
  PetscCall(DemModelRestoreState(c->dem, &ds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingContactSetUp(CouplingContact c, const CouplingContactOptions *options)
{
  PetscReal  smallest = PETSC_MAX_REAL;
  PetscInt   n;
  DemOutside o;

  PetscFunctionBegin;
  PetscCheck(c->fem && c->dem && !c->ready, c->comm, PETSC_ERR_ORDER, "CouplingContactSetUp() comes once, after CouplingContactSetSides()");
  c->options = *options;
  if (c->options.deepest == 0) c->options.deepest = 0.01;
  if (c->options.skin == 0) c->options.skin = 0.3;
  BaseCheckInput(c->dim == 3 || options->choice.law == DEM_CONTACT_LINEAR, c->comm, "Discs of a 2D model meet '%s' by the linear law; Hertz's is for spheres", c->name);
  PetscCall(DemContactPairSet(&c->pair, &options->choice, options->particle, options->body));
  c->turns = (PetscBool)(c->pair.roll > 0 || c->pair.twist > 0);
  PetscCall(DemModelGetOutside(c->dem, &o));
  PetscCall(DemModelGetCounts(c->dem, &n, NULL, NULL));
  for (PetscInt p = 0; p < n; p++) {
    c->largest = PetscMax(c->largest, o.radius[p]);
    smallest   = PetscMin(smallest, o.radius[p]);
  }
  c->skin = c->options.skin * smallest;
  PetscCall(DemSurfaceSetReach(&c->surface, (c->largest + c->skin) * (1 + 1e-9)));
  PetscCall(PetscCalloc1(c->n_nodes, &c->press));
  PetscCall(CouplingContactRate_Internal(c));
  c->ready = PETSC_TRUE;
  PetscCall(CouplingContactForces_Internal(c, 0));
  PetscCall(CheckStart(c));
  if (c->n) PetscCall(DemModelComputeForces(c->dem));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingContactGetReport(CouplingContact c, CouplingContactReport *r)
{
  DemOutside o;

  PetscFunctionBegin;
  PetscCall(DemModelGetOutside(c->dem, &o));
  *r = (CouplingContactReport){.facets = c->surface.n, .nodes = c->surface.n_nodes, .searched = o.n, .candidates = c->n_candidates, .looks = c->looks, .grids = c->grids, .touching = c->n,
                               .force = {c->force[0], c->force[1], c->force[2]}, .friction = c->friction, .damping = c->damping, .deepest = c->deepest};
  for (PetscInt k = 0; k < c->n; k++) r->energy += c->contact[k].energy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingContactDestroy(CouplingContact *contact)
{
  CouplingContact c = *contact;

  PetscFunctionBegin;
  if (!c) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DemSurfaceDestroy(&c->surface));
  PetscCall(PetscFree2(c->carrier, c->x_grid));
  PetscCall(PetscFree4(c->x_look, c->candidate, c->n_touch, c->touch));
  PetscCall(PetscFree(c->contact));
  PetscCall(PetscFree(c->next));
  PetscCall(PetscFree(c->press));
  PetscCall(PetscFree3(c->history_name, c->history_unit, c->own_name));
  PetscCall(PetscFree(*contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}
