/* A coupled body under in-situ stress: at rest with the loads that balance it, let go as theory says, the same across a switch.  Eqs (6.60), (6.61) */
#include "check.h"
#include "coupled.h"
#include "switched.h"

#define STRESS -1e-6
#define NU     0.2

/* A bar held along x at xmin, its free end loaded with part x STRESS. Reaction, largest displacement, kinetic and strain energy after the steps. */
static PetscErrorCode Bar(PetscInt dim, PetscBool preload, PetscReal part, PetscInt steps, PetscReal reaction[2], PetscReal *tip, PetscReal *off, Ledger *ledger)
{
  const PetscReal size[3] = {10, 2, 2}, pull[3] = {1, 0, 0}, stress[6] = {STRESS}, none[6] = {0}, strain = (1 - part) * -STRESS * (dim == 2 ? 1 - NU * NU : 1);
  CouplingOptions options = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1, .preload = preload, .stress = {STRESS}};
  Coupled         c;
  Stepper         stepper;
  Table           load, still;
  FemState        fs;
  PetscReal       dt;

  PetscFunctionBegin;
  PetscCall(CoupledCreate(dim, size, 1, 4, 6, dim == 3 ? 3 : 4, 2, NU, 17, &options, &c));
  PetscCall(TableCreateConstant(part * STRESS, &load));
  PetscCall(TableCreateConstant(0, &still));
  PetscCall(FemModelFix(c.fem, "xmin", 0, FEM_DISPLACEMENT, &still));
  PetscCall(FemModelAddTraction(c.fem, "xmax", pull, &load));
  PetscCall(FemModelAddHistory(c.fem, "reaction", "xmin"));
  PetscCall(FemModelSetInitialStress(c.fem, "", stress, none, 0, 0));
  PetscCall(FemModelSetStartGiven(c.fem, preload));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, &dt));
  for (PetscInt k = 0; k < steps; k++) {
    PetscCall(stepper.step(c.model, k * 0.9 * dt, 0.9 * dt));
    if (k == 0) PetscCall(stepper.history(c.model, 0, &reaction[0]));
  }
  PetscCall(stepper.history(c.model, 0, &reaction[1]));
  PetscCall(stepper.energy(c.model, ledger));
  PetscCall(FemModelGetState(c.fem, &fs));
  *tip = *off = 0;
  for (PetscInt i = 0; i < fs.n_nodes; i++) {
    *off = PetscMax(*off, PetscAbsReal(fs.u[i * dim] - strain * fs.x[i * dim]));
    if (fs.x[i * dim] == size[0]) *tip = fs.u[i * dim];
  }
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(TableDestroy(&load));
  PetscCall(TableDestroy(&still));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestRest(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt preload = 0; preload < 2; preload++) {
      const PetscReal area = dim == 2 ? 2 : 4, modulus = dim == 2 ? 1 / (1 - NU * NU) : 1, stored = 0.5 * STRESS * STRESS / modulus * 10 * area, whole = -STRESS / modulus * 10;
      PetscReal       reaction[2], tip, off;
      Ledger          ledger;

      PetscCall(Bar(dim, (PetscBool)preload, 1, 2000, reaction, &tip, &off, &ledger));
      print_message("           %dD%s: reaction off by %.1e, then %.1e; moved %.1e of what the stress strains; kinetic %.1e of the strain energy, ledger %.1e\n", (int)dim, preload ? ", preloaded" : "",
                    (double)(reaction[0] / (-STRESS * area) - 1), (double)(reaction[1] / (-STRESS * area) - 1), (double)(off / whole), (double)(ledger.energy[LEDGER_KINETIC] / stored), (double)LedgerError(&ledger));
      for (int k = 0; k < 2; k++) CheckClose(reaction[k], -STRESS * area, preload || dim == 3 ? 1e-8 : 1e-3);
      CheckBelow(off, (preload || dim == 3 ? 1e-8 : 1e-3) * whole + (preload && dim == 2 ? 1e-4 * whole : 0)); /* the patch's own error in 2D */
      CheckBelow(ledger.energy[LEDGER_KINETIC], (preload || dim == 3 ? 1e-15 : 1e-6) * stored);
      CheckBelow(LedgerError(&ledger), 1e-6);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRest)

/* The end's load gone, or half of it: the bar is as long as Hooke says. */
static PetscErrorCode TestRelease(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt half = 0; half < 2; half++) {
      const PetscReal area = dim == 2 ? 2 : 4, modulus = dim == 2 ? 1 / (1 - NU * NU) : 1, part = 0.5 * half, length = (1 - part) * -STRESS / modulus * 10;
      PetscReal       reaction[2], tip, off;
      Ledger          ledger;

      PetscCall(Bar(dim, PETSC_TRUE, part, 100, reaction, &tip, &off, &ledger));
      print_message("           %dD, %.1f of the load: tip off by %.1e, reaction by %.1e of the stress\n", (int)dim, (double)part, (double)(tip / length - 1), (double)((reaction[1] + part * STRESS * area) / (-STRESS * area)));
      CheckClose(tip, length, 1e-3);
      CheckNear(reaction[1], -part * STRESS * area, -1e-8 * STRESS * area);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRelease)

static PetscErrorCode Squeezed(Switched *s, FemModel fem, DemModel dem)
{
  const PetscReal pull[3] = {1, 0, 0}, none[6] = {0};
  Table           load, still;

  PetscFunctionBegin;
  (void)dem;
  PetscCall(TableCreateConstant(s->load, &load));
  PetscCall(TableCreateConstant(0, &still));
  PetscCall(FemModelFix(fem, "xmin", 0, FEM_DISPLACEMENT, &still));
  PetscCall(FemModelAddTraction(fem, "xmax", pull, &load));
  PetscCall(FemModelAddHistory(fem, "reaction", "xmin"));
  PetscCall(FemModelSetInitialStress(fem, "", s->stress, none, 0, 0));
  PetscCall(TableDestroy(&load));
  PetscCall(TableDestroy(&still));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elements turn under the stress: nothing moves; and the criterion sees the whole stress. */
static PetscErrorCode TestSwitch(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const PetscReal      low[3] = {5, -1, -1}, high[3] = {7, 9, 9}, area = dim == 2 ? 2 : 4, stored = 0.5 * STRESS * STRESS * (dim == 2 ? 1 - NU * NU : 1) * 13 * area;
    Switched             s = SwitchedDefault(dim, 13, 2, dim == 2 ? 0 : 2);
    CouplingSwitchReport report;
    Ledger               ledger = {{0}};
    PetscReal            reaction[2];
    PetscInt             k = 0;

    s.start[0][0] = 4;
    s.start[0][1] = 5;
    s.stress[0]   = STRESS;
    s.stress[2]   = dim == 2 ? NU * STRESS : 0; /* what plane strain makes of it: particles know no other */
    s.load        = STRESS;
    s.conditions  = Squeezed;
    PetscCall(SwitchedCreate(&s));
    PetscCall(SwitchedSteps(&s, &k, 10));
    PetscCall(s.stepper.history(s.sw, 0, &reaction[0]));
    PetscCall(SwitchedConvert(&s, low, high));
    PetscCall(SwitchedSteps(&s, &k, 500));
    PetscCall(s.stepper.history(s.sw, 0, &reaction[1]));
    PetscCall(s.stepper.energy(s.sw, &ledger));
    PetscCall(CouplingSwitchGetReport(s.sw, &report));
    print_message("           %dD switch: %d elements, booked %.1e of the strain energy, kinetic then %.1e; reaction changes by %.1e; ledger %.1e\n", (int)dim, (int)report.cells, (double)(report.booked / stored),
                  (double)(ledger.energy[LEDGER_KINETIC] / stored), (double)(reaction[1] / reaction[0] - 1), (double)LedgerError(&ledger));
    CheckTrue(report.n_events == 1 && report.cells > 0);
    CheckClose(reaction[0], -STRESS * area, 1e-3);
    CheckClose(reaction[1], -STRESS * area, 1e-3);
    CheckBelow(PetscAbsReal(report.booked), (dim == 2 ? 1e-6 : 1e-9) * stored); /* in a plane, what the fit leaves on nodes */
    CheckBelow(ledger.energy[LEDGER_KINETIC], (dim == 2 ? 1e-6 : 1e-12) * stored);
    CheckBelow(LedgerError(&ledger), 1e-6);
    PetscCall(SwitchedDestroy(&s));
  }
  { /* tension of 0.75 of the strength in situ, loaded by as much: elements turn at once, without any displacement */
    Switched             s = SwitchedDefault(2, 13, 2, 0);
    CouplingSwitchReport report;
    PetscInt             k = 0;

    s.start[0][0] = 4;
    s.start[0][1] = 5;
    s.zone[0][0]  = 6;
    s.zone[0][1]  = 8;
    s.zone[1][1]  = 9;
    s.stress[0]   = 7.5e-7;
    s.load        = 7.5e-7;
    s.strength    = (DemStrength){.tensile = 1e-6, .fracture_energy = 1, .softening = DEM_SOFTENING_LINEAR};
    s.conditions  = Squeezed;
    PetscCall(SwitchedCreate(&s));
    PetscCall(SwitchedSteps(&s, &k, 50));
    PetscCall(CouplingSwitchGetReport(s.sw, &report));
    print_message("           in-situ tension of 0.75 of the strength: %d elements turned, asked at %.4f\n", (int)report.cells, report.n_events ? (double)report.event[0].highest : 0.);
    CheckTrue(report.n_events > 0);
    CheckAbove(report.event[0].highest, 0.748); /* of an element; bonds of the overlap may be nearer */
    PetscCall(SwitchedDestroy(&s));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSwitch)

static const struct CMUnitTest tests[] = {TEST(TestRest), TEST(TestRelease), TEST(TestSwitch)};

CHECK_MAIN(tests)
