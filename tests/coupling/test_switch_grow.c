/* Elements that turn by themselves as a cantilever is bent: one way, within their group, counted. */
#include "check.h"
#include "switched.h"

static PetscErrorCode Bend(Switched *s, FemModel fem, DemModel dem)
{
  const PetscReal t[3] = {0, 250, 500}, v[3] = {0, s->load, s->velocity[0] > 0 ? s->load : 0}, push[3] = {0, 1, 0};
  Table           ramp, none;

  PetscFunctionBegin;
  PetscCall(TableCreate(3, t, v, &ramp));
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt d = 0; d < s->dim; d++) PetscCall(FemModelFix(fem, "xmin", d, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(fem, "xmax", push, &ramp));
  PetscCall(CouplingSwitchProtect(s->sw, "xmin"));
  PetscCall(CouplingSwitchProtect(s->sw, "xmax"));
  PetscCall(FemModelSetDamping(fem, 0.05));
  PetscCall(DemModelSetLocalDamping(dem, 0.3));
  PetscCall(TableDestroy(&ramp));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static Switched Beam(PetscReal load)
{
  Switched s = SwitchedDefault(2, 16, 5, 0);

  s.ratio         = 3;
  s.start[0][0]   = 3;
  s.start[0][1]   = 4;
  s.start[1][1]   = 1;
  s.strength      = (DemStrength){.tensile = 1e-3, .fracture_energy = 1e-4, .softening = DEM_SOFTENING_LINEAR};
  s.options.ahead = 0;
  s.load          = load;
  s.conditions    = Bend;
  return s;
}

/* Bent and let go: elements turn while the stress grows, and none comes back. Bonds advanced are those of awake particles. */
static PetscErrorCode TestOneWay(void)
{
  Switched             s = Beam(1.6e-4);
  CouplingSwitchReport report;
  Ledger               ledger = {{0}};
  PetscReal            counted = 0;
  PetscInt             k = 0, most = 0;

  PetscFunctionBeginUser;
  PetscCall(SwitchedCreate(&s));
  while (k * s.dt < 550) {
    DemModel dem;
    PetscInt bonds, particles;

    PetscCall(CouplingSwitchGetSides(s.sw, NULL, NULL, &dem, NULL));
    PetscCall(DemModelGetCounts(dem, &particles, &bonds, NULL));
    counted += (PetscReal)bonds;
    PetscCall(SwitchedSteps(&s, &k, 1));
    PetscCall(CouplingSwitchGetReport(s.sw, &report));
    CheckTrue(report.cells >= most);
    most = report.cells;
    CheckInt(report.particles + report.sleeping, s.packing.n);
  }
  PetscCall(s.stepper.energy(s.sw, &ledger));
  print_message("           %d events, %d elements turned, %d particles awake, %d asleep; booked %.1e of the work; ledger error %.1e\n", (int)report.n_events, (int)report.cells, (int)report.particles, (int)report.sleeping,
                (double)(report.booked / ledger.work_in), (double)LedgerError(&ledger));
  CheckAbove(report.n_events, 1);
  CheckAbove(report.sleeping, 1);
  CheckNear(report.bond_steps, counted, 0);
  for (PetscInt i = 0; i < report.n_events; i++) {
    CheckInt(report.event[i].above, 0);
    CheckAbove(report.event[i].highest, 0.7);
    CheckBelow(report.event[i].time, 450); /* none once the load has gone */
  }
  CheckBelow(LedgerError(&ledger), 0.01);
  PetscCall(SwitchedDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOneWay)

/* What lies outside the group asks in vain, once, and is named. */
static PetscErrorCode TestLimit(void)
{
  Switched             s = Beam(1.6e-4);
  CouplingSwitchReport report;
  PetscInt             k = 0;

  PetscFunctionBeginUser;
  s.zone[0][0] = 3;
  s.zone[0][1] = 5;
  s.zone[1][1] = 1;
  PetscCall(SwitchedCreate(&s));
  while (k * s.dt < 250) PetscCall(SwitchedSteps(&s, &k, 1));
  PetscCall(CouplingSwitchGetReport(s.sw, &report));
  print_message("           group of two elements, one a particle zone already: %d turned; element %d blocked at t = %.4g\n", (int)report.cells, (int)report.blocked, (double)report.blocked_time);
  CheckInt(report.cells, 1);
  CheckPositive(report.blocked);
  PetscCall(SwitchedDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestLimit)

static const struct CMUnitTest tests[] = {TEST(TestOneWay), TEST(TestLimit)};

CHECK_MAIN(tests)
