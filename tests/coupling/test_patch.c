/* What the overlap's equations promise, on random packings: a uniform stress is at rest in one, two and three dimensions, the whole is stable up to the
   step of (6.9), and a body at rest under load stays where it is. */
#include "check.h"
#include "coupled.h"
#include "switched.h"
#include "coupling_impl.h" /* forces of a displacement alone */

typedef struct {
  PetscInt   n_dof, n, turns, m; /* of nodes; particles; their turns; all */
  PetscReal *r0;                 /* [m] forces at rest */
  PetscReal *mass;               /* [m] */
} Whole;

/* Forces r [m] of the displacement x [m]: nodes, particles, their turns. */
static PetscErrorCode Forces(Coupled *c, const Whole *w, const PetscReal *x, PetscReal *r)
{
  const PetscInt dim = c->split.dim, n = w->n;
  FemState       fs;
  DemState       ds;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(c->fem, &fs));
  PetscCall(DemModelGetState(c->dem, &ds));
  PetscCall(PetscArraycpy(fs.u, x, w->n_dof));
  PetscCall(PetscArraycpy(ds.u, x + w->n_dof, dim * n));
  for (PetscInt p = 0; p < n; p++) { /* small turns */
    const PetscReal *turn = x + w->n_dof + dim * n;

    ds.rot[p] = dim == 2 ? turn[p] : 1;
    if (dim == 2) ds.rot[n + p] = -0.5 * turn[p] * turn[p];
    for (PetscInt d = 0; d < w->turns; d++) ds.rot[(dim == 2 ? 2 : 1 + d) * n + p] = (dim == 2 ? 1 : 0.5) * turn[d * n + p];
  }
  PetscCall(FemModelRestoreState(c->fem, &fs));
  PetscCall(DemModelRestoreState(c->dem, &ds));
  PetscCall(CouplingForces_Internal(c->model));
  PetscCall(DemModelComputeForces(c->dem));
  PetscCall(CouplingRimForces_Internal(c->model));
  PetscCall(FemModelGetResidual(c->fem, c->model->g, r));
  PetscCall(DemModelGetState(c->dem, &ds));
  PetscCall(PetscArraycpy(r + w->n_dof, ds.f, dim * n));
  PetscCall(PetscArraycpy(r + w->n_dof + dim * n, ds.torque, w->turns * n));
  PetscCall(DemModelRestoreState(c->dem, &ds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WholeCreate(Coupled *c, Whole *w)
{
  const PetscInt dim = c->split.dim;
  PetscReal     *zero, dt;
  FemState       fs;
  DemState       ds;

  PetscFunctionBegin;
  PetscCall(CouplingModelGetCriticalStep(c->model, &dt));
  PetscCall(CouplingStart_Internal(c->model, dt)); /* the springs belong to the largest step */
  PetscCall(FemModelGetState(c->fem, &fs));
  PetscCall(DemModelGetState(c->dem, &ds));
  *w = (Whole){.n_dof = fs.n_nodes * dim, .n = ds.n, .turns = dim == 3 ? 3 : 1};
  w->m = w->n_dof + (dim + w->turns) * ds.n;
  PetscCall(PetscCalloc2(w->m, &w->r0, w->m, &w->mass));
  for (PetscInt i = 0; i < w->n_dof; i++) w->mass[i] = fs.mass[i / dim];
  for (PetscInt i = 0; i < dim * ds.n; i++) w->mass[w->n_dof + i] = ds.mass[i % ds.n];
  for (PetscInt i = 0; i < w->turns * ds.n; i++) w->mass[w->n_dof + dim * ds.n + i] = ds.inertia[i % ds.n];
  PetscCall(FemModelRestoreState(c->fem, &fs));
  PetscCall(DemModelRestoreState(c->dem, &ds));
  PetscCall(PetscCalloc1(w->m, &zero));
  PetscCall(Forces(c, w, zero, w->r0));
  PetscCall(PetscFree(zero));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WholeDestroy(Whole *w)
{
  PetscFunctionBegin;
  PetscCall(PetscFree2(w->r0, w->mass));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Uniaxial stress of the bar as an affine displacement of everything: largest force on a node and on a particle, away from the two ends, over stress x facet of an element. */
static PetscErrorCode Uniform(Coupled *c, PetscReal *node, PetscReal *particle)
{
  const PetscInt  dim = c->split.dim;
  const PetscReal nu = c->material.poisson, strain = 1e-9, stress = dim == 3 ? strain : strain / (1 - nu * nu), side = dim == 3 ? nu : nu / (1 - nu);
  PetscReal      *x, *r, end = 0;
  Whole           w;
  FemState        fs;
  DemState        ds;

  PetscFunctionBegin;
  PetscCall(WholeCreate(c, &w));
  PetscCall(PetscCalloc2(w.m, &x, w.m, &r));
  PetscCall(FemModelGetState(c->fem, &fs));
  PetscCall(DemModelGetState(c->dem, &ds));
  for (PetscInt i = 0; i < w.n_dof; i++) x[i] = strain * (i % dim ? -side : 1) * fs.x[i];
  for (PetscInt i = 0; i < dim * w.n; i++) x[w.n_dof + i] = strain * (i >= w.n ? -side : 1) * ds.x0[i];
  for (PetscInt i = 0; i < fs.n_nodes; i++) end = PetscMax(end, fs.x[i * dim]);
  PetscCall(FemModelRestoreState(c->fem, &fs));
  PetscCall(DemModelRestoreState(c->dem, &ds));
  PetscCall(Forces(c, &w, x, r));
  PetscCall(FemModelGetState(c->fem, &fs));
  *node = *particle = 0;
  for (PetscInt i = 0; i < w.n_dof; i++)
    if (fs.x[i / dim * dim] > 0.5 && fs.x[i / dim * dim] < end - 0.5) *node = PetscMax(*node, PetscAbsReal(r[i]) / stress);
  for (PetscInt i = w.n_dof; i < w.m; i++) *particle = PetscMax(*particle, PetscAbsReal(r[i]) / stress);
  PetscCall(FemModelRestoreState(c->fem, &fs));
  PetscCall(PetscFree2(x, r));
  PetscCall(WholeDestroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One dimension, random spacing: exact. */
static PetscErrorCode TestPatchLine(void)
{
  PetscReal worst[2] = {0, 0};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 8; k++) {
    const CouplingOptions options = {.floor = 0.05, .smooth = (PetscBool)(k == 3), .affine = PETSC_TRUE, .substeps = 1};
    Coupled               c;
    PetscReal             node, particle;

    PetscCall(CoupledCreateChain(16, 6, 10, 3 + k % 4, 1 + k % 4, 100 + (uint64_t)k, &options, &c));
    PetscCall(CouplingModelSetUp(c.model));
    PetscCall(Uniform(&c, &node, &particle));
    worst[0] = PetscMax(worst[0], node);
    worst[1] = PetscMax(worst[1], particle);
    PetscCall(CoupledDestroy(&c));
  }
  print_message("           1D, eight random spacings: largest force / (stress x area) on a node %.1e, on a particle %.1e\n", (double)worst[0], (double)worst[1]);
  CheckBelow(worst[0], 1e-10);
  CheckBelow(worst[1], 1e-10);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPatchLine)

/* Two and three dimensions: forces at most 3e-3 of stress x facet, and elements of the overlap strained within 1 % once at rest under the stress. */
static PetscErrorCode TestPatch(void)
{
  const PetscReal size[3] = {10, 3, 3}, pull[3] = {1, 0, 0};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 5; k++) {
    const PetscInt        dim = k < 3 ? 2 : 3;
    const PetscReal       stress = 1e-9, nu = 0.2, strain = stress * (dim == 2 ? 1 - nu * nu : 1);
    const CouplingOptions options = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1, .preload = PETSC_TRUE};
    Coupled               c;
    Table                 load, none;
    FemState              fs;
    PetscReal             node, particle, off = 0;

    PetscCall(CoupledCreate(dim, size, 1, 4, 6, dim == 3 ? 3 : 4, 2, nu, 30 + (uint64_t)k, &options, &c));
    PetscCall(TableCreateConstant(stress, &load));
    PetscCall(TableCreateConstant(0, &none));
    PetscCall(FemModelFix(c.fem, "xmin", 0, FEM_DISPLACEMENT, &none));
    PetscCall(FemModelFix(c.fem, "ymin", 1, FEM_DISPLACEMENT, &none));
    if (dim == 3) PetscCall(FemModelFix(c.fem, "zmin", 2, FEM_DISPLACEMENT, &none));
    PetscCall(FemModelAddTraction(c.fem, "xmax", pull, &load));
    PetscCall(FemModelSetStartGiven(c.fem, PETSC_TRUE));
    PetscCall(CouplingModelSetUp(c.model));
    PetscCall(FemModelGetState(c.fem, &fs));
    for (PetscInt t = 0; t < c.split.n_cells; t++) {
      const PetscInt cell = c.model->top[t], first = c.split.fem.start[cell], n = c.split.fem.start[cell + 1] - first;
      PetscReal      mean = 0; /* over a unit element: difference of its two faces along x */

      if (c.split.layer[t] == 0) continue;
      for (PetscInt a = 0; a < n; a++) {
        const PetscInt  i = c.split.fem.node[first + a];
        PetscReal       middle = 0;

        for (PetscInt b = 0; b < n; b++) middle += c.split.fem.x[3 * c.split.fem.node[first + b]] / n;
        mean += (c.split.fem.x[3 * i] > middle ? 1 : -1) * fs.u[i * dim] / (0.5 * n);
      }
      off = PetscMax(off, PetscAbsReal(mean / strain - 1));
    }
    PetscCall(FemModelRestoreState(c.fem, &fs));
    PetscCall(CoupledDestroy(&c));
    PetscCall(TableDestroy(&load));
    PetscCall(TableDestroy(&none));
    PetscCall(CoupledCreate(dim, size, 1, 4, 6, dim == 3 ? 3 : 4, 2, nu, 30 + (uint64_t)k, NULL, &c));
    PetscCall(CouplingModelSetUp(c.model));
    PetscCall(Uniform(&c, &node, &particle));
    print_message("           %dD: largest force / (stress x facet) on a node %.1e, on a particle %.1e; strain of an element of the overlap off by %.2e\n", (int)dim, (double)node, (double)particle, (double)off);
    CheckBelow(node, 3e-3);
    CheckBelow(particle, 1e-9);
    CheckBelow(off, 0.01);
    PetscCall(CoupledDestroy(&c));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPatch)

/* What the fit leaves on the worst node over all unit stresses, particles in a box of the plane whose overlap goes around it, or in a body's corner: no more than a strip's, and less with smaller particles. */
static PetscErrorCode TestPocket(void)
{
  static const struct {
    MeshCellType type;
    PetscReal    low, high, ratio, finer;
  } box[] = {{MESH_QUAD4, 5, 7, 4, 4}, {MESH_QUAD4, 0, 3, 4, 4}, {MESH_TRI3, 0, 3, 4, 4}, {MESH_QUAD9, 5, 7, 6, 2}, {MESH_TRI6, 0, 3, 6, 2}};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(box) / sizeof(box[0]); k++) {
    CouplingReport report[2];

    for (PetscInt j = 0; j < 2; j++) {
      Switched      s = SwitchedDefault(2, 12, 12, 0);
      CouplingModel model;

      s.type  = box[k].type;
      s.ratio = box[k].ratio * (j ? box[k].finer : 1);
      s.width = 1;
      for (PetscInt d = 0; d < 2; d++) {
        s.start[d][0] = box[k].low;
        s.start[d][1] = box[k].high;
        s.zone[d][1]  = 12;
      }
      PetscCall(SwitchedCreate(&s));
      PetscCall(CouplingSwitchGetSides(s.sw, &model, NULL, NULL, NULL));
      PetscCall(CouplingModelGetReport(model, &report[j]));
      PetscCall(SwitchedDestroy(&s));
    }
    print_message("           %d nodes, particles in [%g, %g]^2: left on the worst node %.1e (%.1e before the fit), %.1e with particles %g times as small\n", (int)MeshCellNodes(box[k].type), (double)box[k].low, (double)box[k].high,
                  (double)report[0].residual, (double)report[0].residual_before, (double)report[1].residual, (double)box[k].finer);
    CheckBelow(report[0].residual, 3e-3);
    CheckBelow(report[1].residual, report[0].residual / box[k].finer);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPocket)

/* Largest eigenvalue of M^-1 K of both sides and the overlap, from below: power iteration. */
static PetscErrorCode Highest(Coupled *c, PetscInt rounds, PetscReal *lambda)
{
  PetscReal *x, *r;
  uint64_t   seed = 5;
  Whole      w;

  PetscFunctionBegin;
  PetscCall(WholeCreate(c, &w));
  PetscCall(PetscMalloc2(w.m, &x, w.m, &r));
  for (PetscInt i = 0; i < w.m; i++) x[i] = (PetscReal)((seed = seed * 6364136223846793005ULL + 1442695040888963407ULL) >> 11) / 9007199254740992.0 - 0.5;
  *lambda = 0;
  for (PetscInt k = 0; k < rounds; k++) {
    PetscReal most = 0, up = 0, down = 0;

    for (PetscInt i = 0; i < w.m; i++) most = PetscMax(most, PetscAbsReal(x[i]));
    for (PetscInt i = 0; i < w.m; i++) x[i] *= 1e-9 / most;
    PetscCall(Forces(c, &w, x, r));
    for (PetscInt i = 0; i < w.m; i++) {
      r[i] = w.r0[i] - r[i];
      up += x[i] * r[i];
      down += w.mass[i] * x[i] * x[i];
      x[i] = r[i] / w.mass[i];
    }
    *lambda = up / down;
  }
  PetscCall(PetscFree2(x, r));
  PetscCall(WholeDestroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Uniform stress is at rest and the step's bound holds, elements of edge 1 with `ratio` particles to a side, overlap from x = 3 to `end`. */
static PetscErrorCode CheckQuadratic(MeshCellType type, const PetscReal size[3], PetscReal end, PetscReal ratio, uint64_t seed)
{
  Coupled        c;
  CouplingReport report;
  PetscReal      node, particle, dt, lambda = 0;

  PetscFunctionBeginUser;
  PetscCall(CoupledCreateOf(type, size, 1, 3, end, ratio, 1, 0.2, seed, NULL, &c));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetReport(c.model, &report));
  PetscCall(CouplingModelGetCriticalStep(c.model, &dt));
  PetscCall(Uniform(&c, &node, &particle));
  PetscCall(Highest(&c, 200, &lambda));
  print_message("           %2d nodes: largest force / (stress x facet) on a node %.1e, on a particle %.1e; all states %.1e, before the fit %.1e, least share %.2f; %.3f of the stable dt^2\n", (int)MeshCellNodes(type),
                (double)node, (double)particle, (double)report.residual, (double)report.residual_before, (double)report.least_weight, (double)(0.25 * dt * dt * lambda));
  CheckBelow(node, 3e-3);
  CheckBelow(particle, 1e-9);
  CheckBelow(dt * dt * lambda, 4);
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Quadratic cells, springs through their corners: the uniform stress is as much at rest as with linear ones. */
static PetscErrorCode TestQuadratic(void)
{
  static const MeshCellType type[]  = {MESH_TRI3, MESH_TRI6, MESH_QUAD8, MESH_QUAD9, MESH_TET4};
  const PetscReal           size[3] = {8, 2, 2};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(type) / sizeof(type[0]); k++) PetscCall(CheckQuadratic(type[k], size, 5, MeshCellDim(type[k]) == 3 ? 3 : 6, 70 + (uint64_t)k));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestQuadratic)

/* Solid ones, eight particles to a side; hexahedra without nodes in sides and middle need more: at ten some packings are refused. */
static PetscErrorCode TestQuadraticSolid(void)
{
  static const MeshCellType type[]  = {MESH_TET10, MESH_HEX20, MESH_HEX27};
  const PetscReal           size[3] = {7, 1, 1};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(type) / sizeof(type[0]); k++) PetscCall(CheckQuadratic(type[k], size, 4, type[k] == MESH_HEX20 ? 12 : 8, 90 + (uint64_t)k));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestQuadraticSolid)

/* dt = sqrt(3)/omega_0 is stable whatever the packing, the width and the weights: dt^2 lambda <= 4 of the whole, springs included. */
static PetscErrorCode TestBound(void)
{
  const PetscReal size[3] = {12, 3, 3};
  PetscReal       most = 0;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 14; k++) {
    const PetscInt        dim = k < 11 ? 2 : 3, width = k == 10 ? 4 : 1 + k % 3;
    const CouplingOptions options = {.floor = k == 10 ? 1e-3 : k % 4 == 3 ? 0.2 : 0.05, .smooth = (PetscBool)(k % 5 == 0 && width > 1), .affine = PETSC_TRUE, .substeps = 1};
    Coupled               c;
    PetscReal             dt, fem, dem, lambda = 0;

    PetscCall(CoupledCreate(dim, size, 1, 5, 7, dim == 3 ? 3 : 3 + k % 3, width, k % 2 ? 0.3 : 0.1, 60 + (uint64_t)k, &options, &c));
    PetscCall(CouplingModelSetUp(c.model));
    PetscCall(CouplingModelGetCriticalStep(c.model, &dt));
    PetscCall(FemModelGetCriticalStep(c.fem, &fem));
    PetscCall(DemModelGetCriticalStep(c.dem, &dem));
    CheckAbove(dt, 0.866 * PetscMin(fem, dem)); /* sqrt(3)/2 of the sides' own */
    PetscCall(Highest(&c, 400, &lambda));
    most = PetscMax(most, dt * dt * lambda);
    CheckBelow(dt * dt * lambda, 4);
    PetscCall(CoupledDestroy(&c));
  }
  print_message("           fourteen overlaps at sqrt(3)/omega_0: the whole uses at most %.3f of the stable dt^2\n", (double)(most / 4));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBound)

/* No damping, 100,000 steps of a body that began in equilibrium with traction and weight. */
static PetscErrorCode TestDrift(void)
{
  const PetscReal       size[3] = {8, 2, 2}, pull[3] = {1, 0.2, 0}, gravity[3] = {1e-6, -2e-6, 0};
  const CouplingOptions options = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1, .preload = PETSC_TRUE};
  Coupled               c;
  Stepper               stepper;
  Table                 load, none;
  FemState              fs;
  DemState              ds;
  PetscReal            *before, dt, drift = 0, most = 0;

  PetscFunctionBeginUser;
  PetscCall(CoupledCreate(2, size, 1, 3, 5, 3, 1, 0.2, 3, &options, &c));
  PetscCall(TableCreateConstant(1e-5, &load));
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt d = 0; d < 2; d++) PetscCall(FemModelFix(c.fem, "xmin", d, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(c.fem, "xmax", pull, &load));
  PetscCall(FemModelSetGravity(c.fem, gravity));
  PetscCall(DemModelSetGravity(c.dem, gravity));
  PetscCall(FemModelSetStartGiven(c.fem, PETSC_TRUE));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, &dt));
  dt *= 0.9;
  PetscCall(FemModelGetState(c.fem, &fs));
  PetscCall(DemModelGetState(c.dem, &ds));
  PetscCall(PetscMalloc1(fs.n_nodes * 2 + 3 * ds.n, &before));
  PetscCall(PetscArraycpy(before, fs.u, fs.n_nodes * 2));
  PetscCall(PetscArraycpy(before + fs.n_nodes * 2, ds.u, 3 * ds.n));
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(DemModelRestoreState(c.dem, &ds));
  for (PetscInt k = 0; k < 100000; k++) PetscCall(stepper.step(c.model, k * dt, dt));
  PetscCall(FemModelGetState(c.fem, &fs));
  PetscCall(DemModelGetState(c.dem, &ds));
  for (PetscInt i = 0; i < fs.n_nodes * 2 + 3 * ds.n; i++) {
    const PetscReal now = i < fs.n_nodes * 2 ? fs.u[i] : ds.u[i - fs.n_nodes * 2];

    most  = PetscMax(most, PetscAbsReal(before[i]));
    drift = PetscMax(drift, PetscAbsReal(now - before[i]));
  }
  print_message("           undamped, loaded, at rest: after 100,000 steps off by %.1e of the displacement\n", (double)(drift / most));
  CheckBelow(drift / most, 1e-9);
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(DemModelRestoreState(c.dem, &ds));
  PetscCall(PetscFree(before));
  PetscCall(TableDestroy(&load));
  PetscCall(TableDestroy(&none));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestDrift)

static const struct CMUnitTest tests[] = {TEST(TestPatchLine), TEST(TestPatch), TEST(TestPocket), TEST(TestQuadratic), TEST(TestQuadraticSolid), TEST(TestBound), TEST(TestDrift)};

CHECK_MAIN(tests)
