/* Quasi-static load steps: particles relax, the far field follows, condensed or not; Hooke's bar, a cantilever, a bar that breaks.  Eqs (6.40)-(6.45) */
#include "check.h"
#include "checkpoint.h"
#include "coupled.h"

static CouplingOptions Options(CouplingFar far, FemCondense condense, PetscReal tolerance)
{
  return (CouplingOptions){.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1, .far = far, .condense = condense, .tolerance = tolerance};
}

typedef struct {
  PetscReal tip[2], reaction[2], error, taken, iterations; /* displacement of the end's middle, force on the support; ledger; at the face / work */
  PetscReal u[4000];
  PetscInt  n;
} Answer;

/* A bar or cantilever held at xmin and loaded at xmax in `steps` load steps; far explicit with preload: equilibrium by conjugate gradients. */
static PetscErrorCode Load(PetscInt dim, const PetscReal pull[3], CouplingFar far, FemCondense condense, PetscReal tolerance, PetscInt steps, Answer *a)
{
  const PetscReal size[3] = {16, 2, 2}, t[2] = {0, 1}, v[2] = {0, 1e-5};
  CouplingOptions options = Options(far, condense, tolerance);
  Coupled         c;
  Stepper         stepper;
  Table           load, none;
  Ledger          ledger;
  CouplingReport  report;
  FemFarReport    face;
  FemState        fs;
  DemState        ds;

  PetscFunctionBegin;
  *a = (Answer){{0}};
  if (far == COUPLING_FAR_EXPLICIT) options.preload = PETSC_TRUE;
  PetscCall(CoupledCreate(dim, size, 1, 7, 9, dim == 3 ? 3 : 5, 2, 0.2, 7, &options, &c));
  if (far == COUPLING_FAR_EXPLICIT) PetscCall(TableCreateConstant(1e-5, &load));
  else PetscCall(TableCreate(2, t, v, &load));
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt d = 0; d < dim; d++) PetscCall(FemModelFix(c.fem, "xmin", d, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(c.fem, "xmax", pull, &load));
  PetscCall(FemModelAddHistory(c.fem, "reaction", "xmin"));
  PetscCall(FemModelSetStartGiven(c.fem, options.preload));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  for (PetscInt k = 0; k < steps; k++) {
    PetscCall(stepper.step(c.model, k / (PetscReal)steps, 1. / steps));
    PetscCall(stepper.energy(c.model, &ledger));
    a->error = PetscMax(a->error, LedgerError(&ledger));
  }
  for (PetscInt d = 0; d < 2; d++) PetscCall(stepper.history(c.model, d, &a->reaction[d]));
  PetscCall(CouplingModelGetReport(c.model, &report));
  PetscCall(CouplingModelGetFar(c.model, &face));
  a->iterations = report.iterations;
  if (steps) a->taken = face.taken / ledger.energy[LEDGER_WORK];
  if (far == COUPLING_FAR_STATIC) CheckTrue(report.dense == (condense != FEM_CONDENSE_NEVER));
  PetscCall(FemModelGetState(c.fem, &fs));
  PetscCall(DemModelGetState(c.dem, &ds));
  for (PetscInt i = 0; i < fs.n_nodes; i++)
    if (fs.x[i * dim] == 16 && fs.x[i * dim + 1] == 1)
      for (PetscInt d = 0; d < 2; d++) a->tip[d] = fs.u[i * dim + d];
  a->n = fs.n_nodes * dim + dim * ds.n;
  CheckBelow(a->n, 4000);
  PetscCall(PetscArraycpy(a->u, fs.u, fs.n_nodes * dim));
  PetscCall(PetscArraycpy(a->u + fs.n_nodes * dim, ds.u, dim * ds.n));
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(DemModelRestoreState(c.dem, &ds));
  PetscCall(TableDestroy(&load));
  PetscCall(TableDestroy(&none));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bar or beam of elements alone. */
static PetscErrorCode Elements(PetscInt dim, const PetscReal pull[3], PetscReal tip[2])
{
  const PetscReal   size[3] = {16, 2, 2}, zero[3] = {0};
  const PetscInt    n[3]    = {16, 2, dim == 3 ? 2 : 1};
  const FemMaterial material = {.density = 1, .young = 1, .poisson = 0.2};
  Mesh              mesh;
  FemModel          model;
  Stepper           stepper;
  Table             load, none;
  PetscReal        *u;

  PetscFunctionBegin;
  PetscCall(MeshCreateBox(PETSC_COMM_SELF, "body", dim == 3 ? MESH_HEX8 : MESH_QUAD4, zero, size, n, &mesh));
  PetscCall(FemModelCreate(PETSC_COMM_SELF, &model));
  PetscCall(FemModelSetKind(model, dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, 1));
  PetscCall(FemModelSetMethod(model, FEM_STATIC));
  PetscCall(FemModelSetMesh(model, &mesh));
  PetscCall(FemModelAddMaterial(model, "", &material));
  PetscCall(TableCreateConstant(1e-5, &load));
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt d = 0; d < dim; d++) PetscCall(FemModelFix(model, "xmin", d, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(model, "xmax", pull, &load));
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModelGetStepper(model, &stepper));
  PetscCall(stepper.step(model, 0, 1));
  PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
  PetscCall(FemModelGetField(model, "displacement", u));
  for (PetscInt i = 0; i < mesh.n_nodes; i++)
    if (mesh.x[3 * i] == 16 && mesh.x[3 * i + 1] == 1 && (dim == 2 || mesh.x[3 * i + 2] == 2))
      for (PetscInt d = 0; d < 2; d++) tip[d] = u[3 * i + d];
  PetscCall(PetscFree(u));
  PetscCall(TableDestroy(&load));
  PetscCall(TableDestroy(&none));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bar and cantilever: the state of equilibrium itself, by another way; a few steps or one; elements alone; the ledger. */
static PetscErrorCode TestEquilibrium(void)
{
  const PetscReal pull[2][3] = {{1, 0, 0}, {0, 0.02, 0}};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt k = 0; k < (dim == 2 ? 2 : 1); k++) {
      static Answer exact, relaxed;
      PetscReal     alone[2], off = 0, top = 0;

      PetscCall(Load(dim, pull[k], COUPLING_FAR_EXPLICIT, FEM_CONDENSE_AUTO, 0, 0, &exact));
      PetscCall(Load(dim, pull[k], COUPLING_FAR_STATIC, FEM_CONDENSE_AUTO, 1e-6, 2, &relaxed));
      PetscCall(Elements(dim, pull[k], alone));
      for (PetscInt i = 0; i < exact.n; i++) {
        top = PetscMax(top, PetscAbsReal(exact.u[i]));
        off = PetscMax(off, PetscAbsReal(exact.u[i] - relaxed.u[i]));
      }
      print_message("           %dD %s: off the equilibrium by %.1e, tip off that of elements alone by %.2e, reaction by %.1e of the load, ledger %.1e, face %.1e of the work, %d iterations in 2 steps\n", (int)dim, k ? "cantilever" : "bar",
                    (double)(off / top), (double)(relaxed.tip[k] / alone[k] - 1), (double)(-relaxed.reaction[k] / ((dim == 3 ? 4 : 2) * 1e-5 * pull[k][k]) - 1), (double)relaxed.error, (double)relaxed.taken, (int)relaxed.iterations);
      CheckBelow(off, 1e-3 * top);
      CheckClose(relaxed.tip[k], alone[k], 0.01);
      CheckClose(-relaxed.reaction[k], (dim == 3 ? 4 : 2) * 1e-5 * pull[k][k], 1e-4);
      CheckBelow(relaxed.error, 1e-3);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestEquilibrium)

/* Condensed to a dense matrix of the face or solved each time: one answer. */
static PetscErrorCode TestCondensed(void)
{
  const PetscReal pull[3] = {1, 0.02, 0};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    static Answer dense, sparse;
    PetscReal     off = 0, top = 0;

    PetscCall(Load(dim, pull, COUPLING_FAR_STATIC, FEM_CONDENSE_ALWAYS, dim == 3 ? 1e-2 : 1e-3, 1, &dense));
    PetscCall(Load(dim, pull, COUPLING_FAR_STATIC, FEM_CONDENSE_NEVER, dim == 3 ? 1e-2 : 1e-3, 1, &sparse));
    for (PetscInt i = 0; i < dense.n; i++) {
      top = PetscMax(top, PetscAbsReal(dense.u[i]));
      off = PetscMax(off, PetscAbsReal(dense.u[i] - sparse.u[i]));
    }
    print_message("           %dD: dense and sparse apart by %.1e after %d and %d iterations\n", (int)dim, (double)(off / top), (int)dense.iterations, (int)sparse.iterations);
    CheckInt(dense.iterations, sparse.iterations);
    CheckBelow(off, 1e-10 * top);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCondensed)

/* A bar pulled until a weak band across its middle has let go. far static: load steps; explicit: slowly. Reaction at `rows` stretches. */
static PetscErrorCode Break(CouplingFar far, PetscInt rows, PetscReal *reaction, Ledger *ledger, PetscReal *worst, PetscInt *steps)
{
  const PetscReal       size[3] = {16, 2, 2}, end = far == COUPLING_FAR_STATIC ? 1 : 2000, t[2] = {0, end}, v[2] = {0, 6e-3};
  const CouplingOptions options = Options(far, FEM_CONDENSE_AUTO, 1e-4);
  const DemStrength     strength = {.tensile = 1e-4, .fracture_energy = 2.5e-7};
  Coupled               c;
  Stepper               stepper;
  CouplingReport        report;
  Table                 stretch, none;
  PetscBool            *breakable;
  PetscReal             dt;

  PetscFunctionBegin;
  PetscCall(CoupledCreate(2, size, 1, 7, 9, 5, 2, 0.2, 7, &options, &c));
  PetscCall(TableCreate(2, t, v, &stretch));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(FemModelFix(c.fem, "xmin", 0, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelFix(c.fem, "xmin", 1, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelFix(c.fem, "xmax", 0, FEM_DISPLACEMENT, &stretch));
  PetscCall(FemModelAddHistory(c.fem, "reaction", "xmax"));
  PetscCall(PetscMalloc1(c.cells.n_facets, &breakable));
  for (PetscInt f = 0; f < c.cells.n_facets; f++) breakable[f] = PetscAbsReal(c.cells.at[3 * f] - 8) < 0.3 ? PETSC_TRUE : PETSC_FALSE;
  PetscCall(DemModelSetStrength(c.dem, &strength));
  PetscCall(DemModelSetBreakable(c.dem, breakable));
  if (far == COUPLING_FAR_EXPLICIT) PetscCall(FemModelSetDamping(c.fem, 0.05));
  if (far == COUPLING_FAR_EXPLICIT) PetscCall(DemModelSetLocalDamping(c.dem, 0.3));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, &dt));
  *steps = far == COUPLING_FAR_STATIC ? rows : (PetscInt)PetscCeilReal(end / (0.9 * dt) / rows) * rows;
  dt     = end / *steps;
  *worst = 0;
  for (PetscInt k = 0; k < *steps; k++) {
    PetscCall(stepper.step(c.model, k * dt, dt));
    if ((k + 1) % (*steps / rows)) continue;
    PetscCall(stepper.history(c.model, 0, &reaction[(k + 1) / (*steps / rows) - 1]));
    PetscCall(stepper.energy(c.model, ledger));
    *worst = PetscMax(*worst, LedgerError(ledger));
  }
  PetscCall(CouplingModelGetReport(c.model, &report));
  if (far == COUPLING_FAR_STATIC) *steps = report.iterations;
  PetscCall(PetscFree(breakable));
  PetscCall(TableDestroy(&stretch));
  PetscCall(TableDestroy(&none));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestBreaking(void)
{
  enum { ROWS = 30 };
  PetscReal slow[ROWS], relaxed[ROWS], worst[2], peak[2] = {0, 0}, off = 0, kinetic;
  PetscInt  steps[2];
  Ledger    ledger[2];

  PetscFunctionBeginUser;
  PetscCall(Break(COUPLING_FAR_EXPLICIT, ROWS, slow, &ledger[0], &worst[0], &steps[0]));
  PetscCall(Break(COUPLING_FAR_STATIC, ROWS, relaxed, &ledger[1], &worst[1], &steps[1]));
  for (PetscInt k = 0; k < ROWS; k++) {
    peak[0] = PetscMax(peak[0], slow[k]);
    peak[1] = PetscMax(peak[1], relaxed[k]);
    if (k + 1 < ROWS) off = PetscMax(off, PetscAbsReal(slow[k] - relaxed[k])); /* the slow pull stops with a jerk */
  }
  kinetic = PetscAbsReal(ledger[0].energy[LEDGER_KINETIC]) / ledger[0].energy[LEDGER_WORK];
  print_message("           peak %.4e, slow run %.4e (of strength x section %.3f, %.3f); forces apart by %.1e of it; fracture work %.4e, %.4e; ledger %.1e, %.1e; %d iterations, %d steps (kinetic %.0e of the work)\n", (double)peak[1], (double)peak[0],
                (double)(peak[1] / 2e-4), (double)(peak[0] / 2e-4), (double)(off / peak[0]), (double)ledger[1].energy[LEDGER_FRACTURE], (double)ledger[0].energy[LEDGER_FRACTURE], (double)worst[1], (double)worst[0], (int)steps[1], (int)steps[0], (double)kinetic);
  CheckClose(peak[1], peak[0], 0.02);
  CheckBelow(off, 0.02 * peak[0]);
  CheckClose(ledger[1].energy[LEDGER_FRACTURE], ledger[0].energy[LEDGER_FRACTURE], 0.03);
  CheckBelow(worst[1], 1e-2);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBreaking)

static const struct CMUnitTest tests[] = {TEST(TestBreaking), TEST(TestEquilibrium), TEST(TestCondensed)};

CHECK_MAIN(tests)
