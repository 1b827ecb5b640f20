/*
  test_contact_fem.c - particles against a deformable body: what a contact gives to one it takes from the other.

  Units: density 1000, young 1e7 for particles (tool_cases.h).
*/
#include <unistd.h>
#include "../dem/tool_cases.h"
#include "coupling_contact.h"

typedef struct {
  Mesh            mesh;
  FemModel        fem;
  DemModel        dem;
  CouplingContact contact;
  Stepper         stepper;
} Case;

static PetscErrorCode Block(PetscInt dim, MeshCellType type, const PetscReal low[3], const PetscReal size[3], const PetscInt n[3], PetscReal density, PetscReal young, Case *c)
{
  const FemMaterial material = {density, young, 0.25};

  PetscFunctionBegin;
  PetscCall(MeshCreateBox(PETSC_COMM_SELF, "block", type, low, size, n, &c->mesh));
  PetscCall(FemModelCreate(PETSC_COMM_SELF, &c->fem));
  PetscCall(FemModelSetKind(c->fem, dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, 1));
  PetscCall(FemModelSetMethod(c->fem, FEM_EXPLICIT));
  PetscCall(FemModelSetMesh(c->fem, &c->mesh));
  PetscCall(FemModelAddMaterial(c->fem, "", &material));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Hold(Case *c, const char *group, PetscInt dim)
{
  Table zero;

  PetscFunctionBegin;
  PetscCall(TableCreateConstant(0, &zero));
  for (PetscInt d = 0; d < dim; d++) PetscCall(FemModelFix(c->fem, group, d, FEM_DISPLACEMENT, &zero));
  PetscCall(TableDestroy(&zero));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Join(PetscReal young, const DemContactChoice *choice, PetscInt threads, Case *c)
{
  const CouplingContactOptions o = {.choice = *choice, .particle = {1e7, 0.25}, .body = {young, 0.25}, .thickness = 1};

  PetscFunctionBegin;
  PetscCall(FemModelSetThreads(c->fem, threads));
  PetscCall(FemModelSetUp(c->fem));
  PetscCall(DemModelSetUp(c->dem));
  PetscCall(CouplingContactCreate(PETSC_COMM_SELF, "block", &c->mesh, &c->contact));
  PetscCall(CouplingContactSetSides(c->contact, c->fem, c->dem));
  PetscCall(CouplingContactSetUp(c->contact, &o));
  PetscCall(CouplingContactGetStepper(c->contact, &c->stepper));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Destroy(Case *c)
{
  PetscFunctionBegin;
  PetscCall(CouplingContactDestroy(&c->contact));
  PetscCall(FemModelDestroy(&c->fem));
  PetscCall(DemModelDestroy(&c->dem));
  PetscCall(MeshDestroy(&c->mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Momentum P and angular momentum L of both; the body's about its reference positions, which its own forces keep. slip: sum of
   u x (contact force) over its nodes, which moves that L on. residual: force and moment of the contact on both together. */
typedef struct {
  PetscReal P[3], L[3], slip[3], force[3], moment[3], scale;
} Sums;

static void AddCross(const PetscReal a[3], const PetscReal b[3], PetscReal s, PetscReal c[3])
{
  for (PetscInt d = 0; d < 3; d++) c[d] += s * (a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3]);
}

static PetscErrorCode Measure(Case *c, Sums *s)
{
  FemState fs;
  DemState ds;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(s, sizeof(*s)));
  PetscCall(FemModelGetState(c->fem, &fs));
  PetscCall(DemModelGetState(c->dem, &ds));
  for (PetscInt a = 0; a < fs.n_nodes; a++) {
    PetscReal X[3] = {0}, x[3] = {0}, u[3] = {0}, v[3] = {0}, f[3] = {0};

    for (PetscInt d = 0; d < fs.dim; d++) {
      X[d] = fs.x[a * fs.dim + d];
      u[d] = fs.u[a * fs.dim + d];
      x[d] = X[d] + u[d];
      v[d] = fs.v[a * fs.dim + d];
      f[d] = fs.f_ext[a * fs.dim + d];
      s->P[d] += fs.mass[a] * v[d];
      s->force[d] += f[d];
      s->scale += PetscAbsReal(f[d]);
    }
    AddCross(X, v, fs.mass[a], s->L);
    AddCross(u, f, 1, s->slip);
    AddCross(x, f, 1, s->moment);
  }
  for (PetscInt p = 0; p < ds.n; p++) {
    PetscReal x[3] = {0}, v[3] = {0}, f[3] = {0};

    for (PetscInt d = 0; d < ds.dim; d++) {
      x[d] = ds.x0[d * ds.n + p] + ds.u[d * ds.n + p];
      v[d] = ds.v[d * ds.n + p];
      f[d] = ds.f_ext[d * ds.n + p];
      s->P[d] += ds.mass[p] * v[d];
      s->force[d] += f[d];
    }
    AddCross(x, v, ds.mass[p], s->L);
    AddCross(x, f, 1, s->moment);
    for (PetscInt d = 0; d < 3; d++) {
      s->moment[d] += ds.t_ext[d * ds.n + p];
      if (ds.dim == 3) s->L[d] += ds.inertia[p] * ds.spin[d * ds.n + p];
    }
    if (ds.dim == 2) s->L[2] += ds.inertia[p] * ds.spin[p];
  }
  PetscCall(FemModelRestoreState(c->fem, &fs));
  PetscCall(DemModelRestoreState(c->dem, &ds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A spinning sphere hits a free block off its centre and at a slant: P and L stay to round-off through hit, slide and flight. */
static PetscErrorCode EccentricHit(PetscInt dim, MeshCellType type, PetscReal rolling)
{
  const DemContactChoice choice = {.law = dim == 3 ? DEM_CONTACT_HERTZ : DEM_CONTACT_LINEAR, .restitution = 0.8, .friction = 0.3, .rolling = rolling, .twisting = rolling};
  const PetscReal        at[1][3] = {{0.83, dim == 3 ? 0.27 : 1.11, dim == 3 ? 0.61 : 0}}, r[1] = {0.1};
  Case                   c = {0};
  Sums                   first, now;
  PetscReal              dt, t = 0, slip[3] = {0}, size_L = 0, size_P = 0;
  PetscInt               met = 0;

  PetscFunctionBegin;
  PetscCall(Block(dim, type, (PetscReal[3]){0, 0, 0}, (PetscReal[3]){1, 1, 0.5}, (PetscInt[3]){4, 4, 2}, 1000, 5e6, &c));
  PetscCall(Spheres(dim, 1, at, r, 1, &c.dem));
  PetscCall(DemModelSetInitialVelocity(c.dem, dim == 3 ? (PetscReal[3]){-0.8, 0.5, -1.5} : (PetscReal[3]){-0.8, -1.5, 0}));
  PetscCall(Join(5e6, &choice, 1, &c));
  if (dim == 3) { /* spin */
    DemState ds;

    PetscCall(DemModelGetState(c.dem, &ds));
    for (PetscInt d = 0; d < 3; d++) ds.spin[d] = 3 - 2 * d;
    PetscCall(DemModelRestoreState(c.dem, &ds));
  }
  PetscCall(CouplingContactGetStableStep(c.contact, &dt));
  dt *= 0.3;
  PetscCall(Measure(&c, &first));
  for (PetscInt d = 0; d < 3; d++) {
    size_L = PetscMax(size_L, PetscAbsReal(first.L[d]));
    size_P = PetscMax(size_P, PetscAbsReal(first.P[d]));
  }
  for (; t < 0.06; t += dt) {
    PetscCall(c.stepper.step(c.stepper.ctx, t, dt));
    PetscCall(Measure(&c, &now));
    for (PetscInt d = 0; d < 3; d++) {
      CheckBelow(PetscAbsReal(now.force[d]), 1e-13 * now.scale);
      CheckBelow(PetscAbsReal(now.moment[d]), 1e-13 * now.scale);
      CheckNear(now.P[d], first.P[d], 1e-12 * size_P);
      CheckNear(now.L[d], first.L[d] - slip[d], 2e-12 * size_L);
      slip[d] += dt * now.slip[d]; /* those forces act in the coming step */
    }
    met += now.scale > 0;
  }
  CheckAbove(met, 20);
  CheckBelow(now.scale, 0); /* and it has left */
  PetscCall(Destroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestMomentum(void)
{
  PetscFunctionBeginUser;
  PetscCall(EccentricHit(3, MESH_TET4, 0));
  PetscCall(EccentricHit(3, MESH_HEX8, 0));
  PetscCall(EccentricHit(3, MESH_TET4, 0.1)); /* couples too */
  PetscCall(EccentricHit(2, MESH_TRI3, 0));
  PetscCall(EccentricHit(2, MESH_QUAD4, 0.1));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestMomentum)

static PetscReal Balance(const Ledger *l)
{
  PetscReal sum = -l->energy[LEDGER_WORK];

  for (PetscInt k = 0; k < LEDGER_WORK; k++) sum += l->energy[k];
  return sum;
}

/* Nine grains rain on a beam that bounces them; every joule is found within 0.1 % of what fell. */
static PetscErrorCode TestEnergy(void)
{
  const DemContactChoice choice = {.restitution = 0.7, .friction = 0.3};
  PetscReal              at[9][3], r[9], dt, t = 0, worst = 0, start;
  Case                   c = {0};
  Ledger                 ledger;
  CouplingContactReport  report;

  PetscFunctionBeginUser;
  PetscCall(Block(3, MESH_HEX8, (PetscReal[3]){0, 0, 0}, (PetscReal[3]){2, 0.4, 0.2}, (PetscInt[3]){10, 2, 1}, 1000, 1e7, &c));
  PetscCall(Hold(&c, "xmin", 3));
  PetscCall(Hold(&c, "xmax", 3));
  for (PetscInt k = 0; k < 9; k++) {
    at[k][0] = 0.2 + 0.2 * k + 0.013 * (k % 3);
    at[k][1] = 0.2 + 0.03 * (k % 4);
    at[k][2] = 0.31 + 0.01 * k;
    r[k]     = 0.05 + 0.005 * (k % 3);
  }
  PetscCall(Spheres(3, 9, at, r, 1, &c.dem));
  PetscCall(DemModelSetInitialVelocity(c.dem, (PetscReal[3]){0.7, 0.1, -2}));
  PetscCall(Join(1e7, &choice, 1, &c));
  PetscCall(CouplingContactGetStableStep(c.contact, &dt));
  dt *= 0.05; /* the largest step meets a contact with four steps; its begin and end then cost 1 % */
  PetscCall(c.stepper.energy(c.stepper.ctx, &ledger));
  start = Balance(&ledger);
  CheckPositive(start);
  for (; t < 0.15; t += dt) {
    PetscCall(c.stepper.step(c.stepper.ctx, t, dt));
    PetscCall(c.stepper.energy(c.stepper.ctx, &ledger));
    worst = PetscMax(worst, PetscAbsReal(Balance(&ledger) - start));
  }
  PetscCall(CouplingContactGetReport(c.contact, &report));
  CheckAbove(report.friction, 1e-3 * start);
  CheckAbove(report.damping, 0.01 * start);
  printf("energy off by %.2g of what fell, deepest %.2g radii, %d looks, %d grids\n", (double)(worst / start), (double)report.deepest, (int)report.looks, (int)report.grids);
  CheckBelow(worst, 1e-3 * start);
  PetscCall(Destroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestEnergy)

/* On a block a million times as stiff the sphere bounces as from the rigid box of the same size. */
static PetscErrorCode TestStiffIsRigid(void)
{
  const DemContactChoice choice = {.stiffness = 1e9, .ratio = 0.5, .restitution = 0.6, .friction = 0.25};
  const PetscReal        at[1][3] = {{0.2, 0.3, 0.605}}, r[1] = {0.1}, v[3] = {0.5, 0.2, -1};
  DemToolOptions         tool = {.shape = DEM_TOOL_SURFACE, .contact = choice};
  Case                   c = {0};
  DemModel               alone;
  Stepper                stepper;
  DemState               a, b;
  PetscReal              dt;

  PetscFunctionBeginUser;
  PetscCall(Block(3, MESH_TET4, (PetscReal[3]){0, 0, 0}, (PetscReal[3]){1, 1, 0.5}, (PetscInt[3]){3, 3, 2}, 1e9, 1e13, &c));
  PetscCall(Hold(&c, "zmin", 3));
  PetscCall(Spheres(3, 1, at, r, 1, &c.dem));
  PetscCall(Spheres(3, 1, at, r, 1, &alone));
  PetscCall(DemModelSetInitialVelocity(c.dem, v));
  PetscCall(DemModelSetInitialVelocity(alone, v));
  PetscCall(DemSurfaceCreateBox(3, (PetscReal[3]){0, 0, 0}, (PetscReal[3]){1, 1, 0.5}, &tool.surface));
  PetscCall(DemModelAddTool(alone, "box", &tool));
  PetscCall(DemModelSetUp(alone));
  PetscCall(Join(1e13, &choice, 1, &c));
  PetscCall(CouplingContactGetStableStep(c.contact, &dt));
  dt = PetscMin(0.9 * dt, 1e-6);
  PetscCall(DemModelGetStepper(alone, &stepper));
  for (PetscReal t = 0; t < 0.012; t += dt) {
    PetscCall(c.stepper.step(c.stepper.ctx, t, dt));
    PetscCall(stepper.step(stepper.ctx, t, dt));
  }
  PetscCall(DemModelGetState(c.dem, &a));
  PetscCall(DemModelGetState(alone, &b));
  CheckAbove(b.v[2], 0.5); /* it came back */
  for (PetscInt d = 0; d < 3; d++) {
    CheckNear(a.v[d], b.v[d], 1e-3);
    CheckNear(a.spin[d], b.spin[d], 1e-2); /* of 4: the point of a tool is half an overlap, 0.1 % of r, from the foot */
  }
  PetscCall(DemModelRestoreState(c.dem, &a));
  PetscCall(DemModelRestoreState(alone, &b));
  PetscCall(DemModelDestroy(&alone));
  PetscCall(Destroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestStiffIsRigid)

/* A sphere at rest on a column: support, contact and weight are one number. */
static PetscErrorCode TestStack(void)
{
  const DemContactChoice choice = {.stiffness = 1e7, .ratio = 0.5, .restitution = 0.3};
  const PetscReal        at[1][3] = {{0.17, 0.13, 1.1}}, r[1] = {0.1}, g[3] = {0, 0, -9.81};
  const PetscReal        weight = 1000 * 4.0 / 3 * PETSC_PI * 1e-3 * 9.81, column = 1000 * 0.3 * 0.3 * 9.81;
  Case                   c = {0};
  CouplingContactReport  report;
  PetscReal              dt, reaction = 0;

  PetscFunctionBeginUser;
  PetscCall(Block(3, MESH_HEX8, (PetscReal[3]){0, 0, 0}, (PetscReal[3]){0.3, 0.3, 1}, (PetscInt[3]){2, 2, 6}, 1000, 1e7, &c));
  PetscCall(Hold(&c, "zmin", 3));
  PetscCall(FemModelSetGravity(c.fem, g));
  PetscCall(FemModelSetDamping(c.fem, 60));
  PetscCall(FemModelAddHistory(c.fem, "reaction", "zmin"));
  PetscCall(Spheres(3, 1, at, r, 1, &c.dem));
  PetscCall(DemModelSetGravity(c.dem, g));
  PetscCall(DemModelSetLocalDamping(c.dem, 0.3));
  PetscCall(Join(1e7, &choice, 1, &c));
  PetscCall(CouplingContactGetStableStep(c.contact, &dt));
  dt *= 0.9;
  for (PetscReal t = 0; t < 1; t += dt) PetscCall(c.stepper.step(c.stepper.ctx, t, dt));
  {
    Ledger ledger; /* closes the level the reaction belongs to */

    PetscCall(c.stepper.energy(c.stepper.ctx, &ledger));
  }
  for (PetscInt k = 0; k < c.stepper.n_history; k++)
    if (!strcmp(c.stepper.history_name[k], "reaction(zmin).z")) PetscCall(c.stepper.history(c.stepper.ctx, k, &reaction));
  PetscCall(CouplingContactGetReport(c.contact, &report));
  CheckInt(report.touching, 1);
  CheckClose(report.force[2], -weight, 1e-6);
  CheckClose(reaction, weight + column, 1e-6);
  PetscCall(Destroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestStack)

/* Without friction a sphere presses down and slides over 20 edges of triangles: nothing along the way pushes it. */
static PetscErrorCode Slide(MeshCellType type, PetscReal young, PetscReal *kick)
{
  const DemContactChoice choice = {.stiffness = 1e6, .ratio = 0.5, .restitution = 1};
  const PetscReal        at[1][3] = {{0.13, 0.31, 0.599905}}, r[1] = {0.1}, g[3] = {0, 0, -10};
  Case                   c = {0};
  DemState               ds;
  PetscReal              dt;
  CouplingContactReport  report;

  PetscFunctionBeginUser;
  PetscCall(Block(3, type, (PetscReal[3]){0, 0, 0}, (PetscReal[3]){1, 0.6, 0.5}, (PetscInt[3]){7, 5, 2}, 1e9, young, &c));
  PetscCall(Hold(&c, "zmin", 3));
  PetscCall(Spheres(3, 1, at, r, 1, &c.dem));
  PetscCall(DemModelSetGravity(c.dem, g));
  PetscCall(DemModelSetInitialVelocity(c.dem, (PetscReal[3]){1, 0.1, 0}));
  PetscCall(Join(young, &choice, 1, &c));
  PetscCall(CouplingContactGetStableStep(c.contact, &dt));
  dt    = PetscMin(0.5 * dt, 2e-4);
  *kick = 0;
  for (PetscReal t = 0; t < 0.6; t += dt) {
    PetscCall(c.stepper.step(c.stepper.ctx, t, dt));
    PetscCall(CouplingContactGetReport(c.contact, &report));
    CheckInt(report.touching, 1);
    PetscCall(DemModelGetState(c.dem, &ds));
    *kick = PetscMax(*kick, PetscMax(PetscAbsReal(ds.v[0] - 1), PetscAbsReal(ds.v[1] - 0.1)));
    PetscCall(DemModelRestoreState(c.dem, &ds));
  }
  PetscCall(Destroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestSlide(void)
{
  PetscReal kick;

  PetscFunctionBeginUser;
  PetscCall(Slide(MESH_TET4, 1e14, &kick)); /* as good as flat */
  CheckBelow(kick, 1e-9);
  PetscCall(Slide(MESH_HEX8, 1e14, &kick));
  CheckBelow(kick, 1e-9);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSlide)

/* A heap of 60 grains thrown on a block. */
static PetscErrorCode Heap(PetscInt threads, Case *c)
{
  const DemContactChoice  choice = {.restitution = 0.6, .friction = 0.4};
  const DemContactOptions among  = {.choice = choice};
  PetscReal               at[60][3], r[60];
  uint64_t                seed = 7;

  PetscFunctionBegin;
  PetscCall(Block(3, MESH_TET4, (PetscReal[3]){0, 0, 0}, (PetscReal[3]){1, 1, 0.2}, (PetscInt[3]){5, 5, 1}, 1000, 5e6, c));
  PetscCall(Hold(c, "zmin", 3));
  for (PetscInt k = 0; k < 60; k++) {
    r[k]     = 0.03 + 0.02 * TestRandom(&seed);
    at[k][0] = 0.2 + 0.12 * (k % 5) + 0.02 * TestRandom(&seed);
    at[k][1] = 0.2 + 0.12 * (k / 5 % 4) + 0.02 * TestRandom(&seed);
    at[k][2] = 0.26 + 0.12 * (k / 20);
  }
  PetscCall(Spheres(3, 60, at, r, threads, &c->dem));
  PetscCall(DemModelSetContact(c->dem, &among));
  PetscCall(DemModelSetInitialVelocity(c->dem, (PetscReal[3]){0.3, 0.1, -2}));
  PetscCall(Join(5e6, &choice, threads, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void SameState(Case *a, Case *b)
{
  FemState fa, fb;
  DemState da, db;

  assert_int_equal(FemModelGetState(a->fem, &fa) + FemModelGetState(b->fem, &fb) + DemModelGetState(a->dem, &da) + DemModelGetState(b->dem, &db), 0);
  assert_memory_equal(fa.u, fb.u, (size_t)(3 * fa.n_nodes) * sizeof(PetscReal));
  assert_memory_equal(da.u, db.u, (size_t)(3 * da.n) * sizeof(PetscReal));
  assert_memory_equal(da.spin, db.spin, (size_t)(3 * da.n) * sizeof(PetscReal));
  assert_int_equal(FemModelRestoreState(a->fem, &fa) + FemModelRestoreState(b->fem, &fb) + DemModelRestoreState(a->dem, &da) + DemModelRestoreState(b->dem, &db), 0);
}

/* One, two and three threads; and a run stopped in mid-contact that goes on: the same bits. */
static PetscErrorCode TestSameBits(void)
{
  char                  file[64];
  Case                  c[4];
  Ledger                end[4];
  Checkpoint            checkpoint;
  CouplingContactReport report;
  PetscReal             dt;
  PetscInt              steps, half;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(c, sizeof(c)));
  PetscCall(BaseFormat(file, "/tmp/contact_fem-%d.h5", (int)getpid()));
  for (PetscInt k = 0; k < 4; k++) PetscCall(Heap(k < 3 ? k + 1 : 2, &c[k]));
  PetscCall(CouplingContactGetStableStep(c[0].contact, &dt));
  dt *= 0.8;
  half  = (PetscInt)(0.032 / dt);
  steps = 2 * half;
  for (PetscInt s = 0; s < steps; s++) {
    for (PetscInt k = 0; k < 3; k++) PetscCall(c[k].stepper.step(c[k].stepper.ctx, s * dt, dt));
    if (s + 1 != half) continue;
    PetscCall(CouplingContactGetReport(c[0].contact, &report));
    CheckAbove(report.touching, 2);
    PetscCall(CheckpointCreate(PETSC_COMM_SELF, file, &checkpoint));
    PetscCall(c[0].stepper.save(c[0].stepper.ctx, checkpoint));
    PetscCall(CheckpointClose(&checkpoint));
    PetscCall(CheckpointOpen(PETSC_COMM_SELF, file, &checkpoint));
    PetscCall(c[3].stepper.load(c[3].stepper.ctx, checkpoint));
    PetscCall(CheckpointClose(&checkpoint));
    unlink(file);
  }
  for (PetscInt s = half; s < steps; s++) PetscCall(c[3].stepper.step(c[3].stepper.ctx, s * dt, dt));
  for (PetscInt k = 0; k < 4; k++) {
    PetscCall(c[k].stepper.energy(c[k].stepper.ctx, &end[k]));
    if (k) SameState(&c[0], &c[k]);
    for (PetscInt e = 0; e < LEDGER_TERMS; e++) CheckNear(end[k].energy[e], end[0].energy[e], 0);
  }
  PetscCall(CouplingContactGetReport(c[0].contact, &report));
  CheckBelow(report.looks, steps / 4); /* the search rests while nothing has moved far */
  CheckBelow(report.grids, 3);
  for (PetscInt k = 0; k < 4; k++) PetscCall(Destroy(&c[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSameBits)

/* What cannot be is said. */
static PetscErrorCode TestRefusals(void)
{
  const DemContactChoice choice = {.stiffness = 1e4, .ratio = 0.5, .restitution = 1};
  const PetscReal        deep[1][3] = {{0.5, 0.5, 0.59}}, above[1][3] = {{0.5, 0.5, 0.61}}, r[1] = {0.1};
  const PetscInt         n[3] = {2, 2, 1};
  const PetscReal        low[3] = {0, 0, 0}, size[3] = {1, 1, 0.5};
  CouplingContact        contact;
  Case                   c = {0};
  Mesh                   mesh;
  PetscErrorCode         code = PETSC_SUCCESS;
  PetscReal              dt;

  PetscFunctionBeginUser;
  PetscCall(MeshCreateBox(PETSC_COMM_SELF, "block", MESH_TET10, low, size, n, &mesh));
  CheckFails(CouplingContactCreate(PETSC_COMM_SELF, "block", &mesh, &contact), PETSC_ERR_USER_INPUT, "quadratic cells");
  PetscCall(MeshDestroy(&mesh));

  PetscCall(Block(3, MESH_TET4, low, size, n, 1000, 1e7, &c));
  PetscCall(Spheres(3, 1, deep, r, 1, &c.dem));
  CheckFails(Join(1e7, &choice, 1, &c), PETSC_ERR_USER_INPUT, "overlaps the surface of 'block'");
  PetscCall(Destroy(&c));

  PetscCall(Block(3, MESH_TET4, low, size, n, 1000, 1e7, &c));
  PetscCall(Spheres(3, 1, above, r, 1, &c.dem));
  PetscCall(DemModelSetInitialVelocity(c.dem, (PetscReal[3]){0, 0, -30}));
  PetscCall(Join(1e7, &choice, 1, &c));
  PetscCall(CouplingContactGetStableStep(c.contact, &dt));
  dt *= 0.9;
  BaseErrorClear();
  BaseErrorQuiet(PETSC_TRUE);
  for (PetscReal t = 0; t < 0.05 && !code; t += dt) code = c.stepper.step(c.stepper.ctx, t, dt);
  BaseErrorQuiet(PETSC_FALSE);
  CheckTrue(code);
  CheckContains(BaseErrorMessage(), "is inside the body 'block'");
  PetscCall(Destroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefusals)

static const struct CMUnitTest tests[] = {TEST(TestMomentum), TEST(TestEnergy), TEST(TestStiffIsRigid), TEST(TestStack), TEST(TestSlide), TEST(TestSameBits), TEST(TestRefusals)};
CHECK_MAIN(tests)
