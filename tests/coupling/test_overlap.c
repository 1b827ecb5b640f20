/* The overlap: momentum and energy kept, and a uniform strain that goes through it. */
#include "check.h"
#include "coupled.h"

/* Free in space with random velocities: momentum, angular momentum and energy over 2000 steps. */
static PetscErrorCode TestConservation(void)
{
  const PetscReal size[3] = {12, 3, 3};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    Coupled   c;
    Stepper   stepper;
    FemState  fs;
    DemState  ds;
    Ledger    ledger, first;
    PetscReal dt, p0[3] = {0}, l0[3] = {0}, scale = 0;
    uint64_t  seed = 4;
    CouplingReport report;

    PetscCall(CoupledCreate(dim, size, 1, 4, 8, dim == 3 ? 3 : 4, 2, 0.2, 7, NULL, &c));
    PetscCall(CouplingModelSetUp(c.model));
    PetscCall(CouplingModelGetReport(c.model, &report));
    print_message("           %dD overlap: %d particles, %d bonds, %d elements; residual %.1e, fitted %.1e; least share %.3f\n", (int)dim, (int)report.particles, (int)report.bonds, (int)report.cells,
                  (double)report.residual_before, (double)report.residual, (double)report.least_weight);
    PetscCall(CouplingModelGetStepper(c.model, &stepper));
    PetscCall(stepper.stable_step(c.model, &dt));
    dt *= 0.9;
    PetscCall(FemModelGetState(c.fem, &fs));
    for (PetscInt i = 0; i < fs.n_nodes * dim; i++) {
      fs.v[i] = 1e-15 * ((double)(seed = seed * 6364136223846793005ULL + 1442695040888963407ULL) / 18446744073709551616.0 - 0.5);
    }
    PetscCall(FemModelRestoreState(c.fem, &fs));
    for (PetscInt k = 0; k <= 2000; k++) {
      if (k == 1 || k == 2000) {
        PetscReal p[3] = {0}, l[3] = {0};

        PetscCall(FemModelGetState(c.fem, &fs));
        PetscCall(DemModelGetState(c.dem, &ds));
        for (PetscInt i = 0; i < fs.n_nodes; i++) {
          PetscReal x[3] = {0}, v[3] = {0};

          for (PetscInt d = 0; d < dim; d++) {
            v[d] = fs.v[i * dim + d];
            x[d] = fs.x[i * dim + d];
            p[d] += fs.mass[i] * v[d];
            scale += fs.mass[i] * PetscAbsReal(v[d]) / 2;
          }
          for (PetscInt d = 0; d < 3; d++) l[d] += fs.mass[i] * (x[(d + 1) % 3] * v[(d + 2) % 3] - x[(d + 2) % 3] * v[(d + 1) % 3]);
        }
        for (PetscInt i = 0; i < ds.n; i++) {
          PetscReal x[3] = {0}, v[3] = {0};

          for (PetscInt d = 0; d < dim; d++) {
            v[d] = ds.v[d * ds.n + i];
            x[d] = ds.x0[d * ds.n + i];
            p[d] += ds.mass[i] * v[d];
          }
          for (PetscInt d = 0; d < 3; d++) l[d] += ds.mass[i] * (x[(d + 1) % 3] * v[(d + 2) % 3] - x[(d + 2) % 3] * v[(d + 1) % 3]);
          if (dim == 2) l[2] += ds.inertia[i] * ds.spin[i];
          else
            for (PetscInt d = 0; d < 3; d++) l[d] += ds.inertia[i] * ds.spin[d * ds.n + i];
        }
        PetscCall(FemModelRestoreState(c.fem, &fs));
        PetscCall(DemModelRestoreState(c.dem, &ds));
        if (k == 1) {
          for (PetscInt d = 0; d < 3; d++) {
            p0[d] = p[d];
            l0[d] = l[d];
          }
          PetscCall(stepper.energy(c.model, &first));
        } else {
          for (PetscInt d = 0; d < 3; d++) {
            CheckNear(p[d], p0[d], 1e-12 * scale);
            CheckNear(l[d], l0[d], 1e-12 * 12 * scale); /* about positions at rest: motions are below 1e-13 */
          }
        }
      }
      PetscCall(stepper.step(c.model, k * dt, dt));
    }
    PetscCall(stepper.energy(c.model, &ledger));
    {
      PetscReal a = 0, b = 0;

      for (PetscInt t = 0; t < LEDGER_WORK; t++) {
        a += first.energy[t];
        b += ledger.energy[t];
      }
      CheckClose(b, a, 1e-6);
    }
    PetscCall(CoupledDestroy(&c));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestConservation)

/* A bar drawn by a steady traction and brought to rest: reaction, strain on both sides against Hooke, and whether anything creeps. */
static PetscErrorCode StaticBar(PetscInt dim, PetscInt rest, PetscInt watch, PetscReal *strain_error, PetscReal *tip_error, PetscReal *reaction_error, PetscReal *drift)
{
  const PetscReal size[3] = {12, 3, 3}, nu = 0.2, stress = 1e-9, pull[3] = {1, 0, 0};
  const PetscReal t[2] = {0, 30}, v[2] = {0, stress}, strain = stress * (dim == 2 ? 1 - nu * nu : 1);
  Coupled         c;
  Stepper         stepper;
  Table           ramp, none;
  FemState        fs;
  DemState        ds;
  PetscReal       dt, reaction, tip[2];
  PetscReal      *before;

  PetscFunctionBegin;
  PetscCall(CoupledCreate(dim, size, 1, 4, 8, dim == 3 ? 3 : 4, 2, nu, 11, NULL, &c));
  PetscCall(TableCreate(2, t, v, &ramp));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(FemModelFix(c.fem, "xmin", 0, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(c.fem, "xmax", pull, &ramp));
  PetscCall(FemModelAddHistory(c.fem, "reaction", "xmin"));
  PetscCall(FemModelSetDamping(c.fem, 0.15));
  PetscCall(DemModelSetLocalDamping(c.dem, 0.3));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, &dt));
  dt *= 0.9;
  for (PetscInt k = 0; k < rest; k++) PetscCall(stepper.step(c.model, k * dt, dt));
  PetscCall(FemModelGetState(c.fem, &fs));
  PetscCall(DemModelGetState(c.dem, &ds));
  *strain_error = 0;
  for (PetscInt p = 0; p < ds.n; p++) /* secant strain from particle to particle three spacings apart would hide; each against the exact field */
    *strain_error = PetscMax(*strain_error, PetscAbsReal(ds.u[p] - strain * ds.x0[p]) / (strain * 1));
  for (PetscInt i = 0; i < fs.n_nodes; i++) *strain_error = PetscMax(*strain_error, PetscAbsReal(fs.u[i * dim] - strain * fs.x[i * dim]) / (strain * 1));
  tip[0] = 0;
  for (PetscInt i = 0; i < fs.n_nodes; i++)
    if (fs.x[i * dim] == 12) tip[0] = fs.u[i * dim];
  *tip_error = tip[0] / (strain * 12) - 1;
  PetscCall(stepper.history(c.model, 0, &reaction));
  *reaction_error = -reaction / (stress * (dim == 3 ? 9 : 3)) - 1;
  PetscCall(PetscMalloc1(fs.n_nodes * dim, &before));
  PetscCall(PetscArraycpy(before, fs.u, fs.n_nodes * dim));
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(DemModelRestoreState(c.dem, &ds));
  for (PetscInt k = rest; k < rest + watch; k++) PetscCall(stepper.step(c.model, k * dt, dt));
  PetscCall(FemModelGetState(c.fem, &fs));
  *drift = 0;
  for (PetscInt i = 0; i < fs.n_nodes; i++) *drift = PetscMax(*drift, PetscAbsReal(fs.u[i * dim] - before[i * dim]) / (strain * 12));
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(PetscFree(before));
  PetscCall(TableDestroy(&ramp));
  PetscCall(TableDestroy(&none));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestStaticBar(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    PetscReal strain, tip, reaction, drift;

    PetscCall(StaticBar(dim, dim == 2 ? 20000 : 6000, dim == 2 ? 100000 : 1000, &strain, &tip, &reaction, &drift));
    print_message("           %dD bar: displacement off by %.2e of strain x element, tip %.2e, reaction %.2e, drift %.1e\n", (int)dim, (double)strain, (double)tip, (double)reaction, (double)drift);
    CheckBelow(strain, 0.01);
    CheckBelow(PetscAbsReal(tip), 1e-3);
    CheckBelow(PetscAbsReal(reaction), 1e-6);
    CheckBelow(drift, dim == 2 ? 1e-9 : 1e-6);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestStaticBar)

static const struct CMUnitTest tests[] = {TEST(TestConservation), TEST(TestStaticBar)};

CHECK_MAIN(tests)
