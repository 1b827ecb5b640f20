/* Tools and contacts while elements turn: what touches goes on as if nothing had happened, and what a tool comes near turns. */
#include "check.h"
#include "switched.h"

static PetscErrorCode Steady(PetscReal v, PetscReal from, Table *table)
{
  const PetscReal t[3] = {0, from, 1e6}, value[3] = {0, v, v};

  return TableCreate(3, t, value, table);
}

/* A circle of radius 2 pushes against the left face, and rubs along it. */
static PetscErrorCode Rub(Switched *s, FemModel fem, DemModel dem)
{
  DemToolOptions     o = {.shape = DEM_TOOL_CYLINDER, .point = {-2.01, 2.6, 0}, .radius = 2, .damping = 0.2};
  Table              none;
  DemContactOptions  meet = {.choice = {.stiffness = 1, .friction = 0.3, .restitution = 0.5}};

  PetscFunctionBegin;
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt d = 0; d < 2; d++) PetscCall(FemModelFix(fem, "xmax", d, FEM_DISPLACEMENT, &none));
  PetscCall(CouplingSwitchProtect(s->sw, "xmax"));
  PetscCall(FemModelSetDamping(fem, 0.05));
  PetscCall(DemModelSetLocalDamping(dem, 0.3));
  PetscCall(DemModelSetContact(dem, &meet));
  o.contact = (DemContactChoice){.law = DEM_CONTACT_LINEAR, .stiffness = 1, .restitution = 1, .friction = 0.3};
  PetscCall(Steady(5e-4, 10, &o.velocity[0]));
  PetscCall(Steady(8e-4, 10, &o.velocity[1]));
  PetscCall(DemModelAddTool(dem, "stamp", &o));
  for (PetscInt d = 0; d < 2; d++) PetscCall(TableDestroy(&o.velocity[d]));
  PetscCall(DemModelAddHistory(dem, "force", "stamp"));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static Switched Stamped(void)
{
  Switched s = SwitchedDefault(2, 16, 5, 0);

  s.ratio       = 3;
  s.start[0][1] = 7;
  s.conditions  = Rub;
  return s;
}

static PetscErrorCode Stamp(Switched *s, DemToolState *tool)
{
  DemModel dem;

  PetscFunctionBegin;
  PetscCall(CouplingSwitchGetSides(s->sw, NULL, NULL, &dem, NULL));
  PetscCall(DemModelGetTool(dem, "stamp", tool));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elements turn behind a tool that slides: its force, its work and what friction took are the same to the bit, and go on as if they had not. */
static PetscErrorCode TestSliding(void)
{
  const PetscReal      low[3] = {7, -1, -1}, high[3] = {11, 6, 1};
  Switched             s = Stamped(), twin = Stamped();
  DemToolState         before, after, other;
  CouplingSwitchReport report;
  PetscInt             k = 0, j = 0;
  PetscReal            apart = 0, most = 0, mean = 0, mean_other = 0;
  Ledger               ledger = {{0}};

  PetscFunctionBeginUser;
  PetscCall(SwitchedCreate(&s));
  PetscCall(SwitchedCreate(&twin));
  PetscCall(SwitchedSteps(&s, &k, (PetscInt)(120 / s.dt)));
  PetscCall(SwitchedSteps(&twin, &j, k));
  PetscCall(Stamp(&s, &before));
  PetscCall(SwitchedConvert(&s, low, high));
  PetscCall(Stamp(&s, &after));
  CheckAbove(before.contacts, 1);
  CheckInt(after.contacts, before.contacts);
  for (PetscInt d = 0; d < 2; d++) CheckClose(after.force[d], before.force[d], 1e-12);
  CheckNear(after.work, before.work, 0);
  PetscCall(CouplingSwitchGetReport(s.sw, &report));
  CheckInt(report.n_events, 1);
  CheckAbove(report.event[0].particles, 20);
  CheckAbove(report.event[0].before[LEDGER_FRICTION], 1e-9);
  CheckNear(report.event[0].after[LEDGER_FRICTION], report.event[0].before[LEDGER_FRICTION], 0);
  CheckAbove(report.event[0].before[LEDGER_DAMPING], 1e-9);
  CheckClose(report.event[0].after[LEDGER_CONTACT], report.event[0].before[LEDGER_CONTACT], 1e-12);
  CheckNear(report.event[0].after[LEDGER_WORK], report.event[0].before[LEDGER_WORK], 0);
  for (PetscInt i = 0; i < 400; i++) {
    PetscCall(SwitchedSteps(&s, &k, 1));
    PetscCall(SwitchedSteps(&twin, &j, 1));
    PetscCall(Stamp(&s, &after));
    PetscCall(Stamp(&twin, &other));
    mean += after.force[0] / 400;
    mean_other += other.force[0] / 400;
    for (PetscInt d = 0; d < 2; d++) {
      apart = PetscMax(apart, PetscAbsReal(after.force[d] - other.force[d]));
      most  = PetscMax(most, PetscAbsReal(other.force[d]));
    }
  }
  PetscCall(s.stepper.energy(s.sw, &ledger));
  print_message("           %d contacts slide while %d particles wake; in 400 steps the force departs from that without by %.1e of it, its mean by %.1e; booked %.1e of the work, ledger error %.1e\n", (int)before.contacts, (int)report.event[0].particles,
                (double)(apart / most), (double)(mean / mean_other - 1), (double)(report.booked / ledger.work_in), (double)LedgerError(&ledger));
  CheckClose(mean, mean_other, 0.005);
  CheckBelow(apart / most, 0.03); /* what is booked, 1e-3 of the work, runs as a wave of its root */
  CheckBelow(LedgerError(&ledger), 0.01);
  PetscCall(SwitchedDestroy(&s));
  PetscCall(SwitchedDestroy(&twin));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSliding)

/* Stopped after the event and begun again from the file: the same bits. */
static PetscErrorCode TestRestart(void)
{
  const PetscReal low[3] = {7, -1, -1}, high[3] = {9, 6, 1};
  const char     *file = "switch_tools.h5";
  Switched        s = Stamped(), again = Stamped();
  Checkpoint      checkpoint;
  PetscInt        k = 0, j;
  PetscReal       a, b;

  PetscFunctionBeginUser;
  PetscCall(SwitchedCreate(&s));
  PetscCall(SwitchedSteps(&s, &k, (PetscInt)(60 / s.dt)));
  PetscCall(SwitchedConvert(&s, low, high));
  PetscCall(SwitchedSteps(&s, &k, 50));
  PetscCall(CheckpointCreate(PETSC_COMM_SELF, file, &checkpoint));
  PetscCall(s.stepper.save(s.sw, checkpoint));
  PetscCall(CheckpointClose(&checkpoint));
  PetscCall(SwitchedCreate(&again));
  PetscCall(CheckpointOpen(PETSC_COMM_SELF, file, &checkpoint));
  PetscCall(again.stepper.load(again.sw, checkpoint));
  PetscCall(CheckpointClose(&checkpoint));
  j = k;
  PetscCall(SwitchedSteps(&s, &k, 50));
  PetscCall(SwitchedSteps(&again, &j, 50));
  for (PetscInt c = 0; c < s.stepper.n_history; c++) {
    PetscCall(s.stepper.history(s.sw, c, &a));
    PetscCall(again.stepper.history(again.sw, c, &b));
    CheckNear(b, a, 0);
  }
  remove(file);
  PetscCall(SwitchedDestroy(&s));
  PetscCall(SwitchedDestroy(&again));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRestart)

/* A box comes down beside the particles, on elements. */
static PetscErrorCode Descend(Switched *s, FemModel fem, DemModel dem)
{
  const PetscReal low[3] = {6, 5.2, 0}, high[3] = {8, 7, 0};
  DemToolOptions  o = {.shape = DEM_TOOL_SURFACE, .damping = 0.3};
  Table           none;

  PetscFunctionBegin;
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt d = 0; d < 2; d++) PetscCall(FemModelFix(fem, "ymin", d, FEM_DISPLACEMENT, &none));
  PetscCall(CouplingSwitchProtect(s->sw, "ymin"));
  PetscCall(DemSurfaceCreateBox(2, low, high, &o.surface));
  o.contact = (DemContactChoice){.law = DEM_CONTACT_LINEAR, .stiffness = 1, .restitution = 1};
  PetscCall(Steady(-5e-3, 1, &o.velocity[1]));
  PetscCall(DemModelAddTool(dem, "stamp", &o));
  PetscCall(TableDestroy(&o.velocity[1]));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elements that a tool comes near turn before it touches, whatever their stress: it never passes through them. */
static PetscErrorCode TestNear(void)
{
  Switched             s = SwitchedDefault(2, 14, 8, 0);
  CouplingSwitchReport report;
  DemToolState         tool;
  PetscInt             k = 0;

  PetscFunctionBeginUser;
  s.size[1]     = 5;
  s.ratio       = 3;
  s.start[0][1] = 2;
  s.start[1][0] = 3;
  s.start[1][1] = 5;
  s.width       = 1;
  s.conditions  = Descend;
  PetscCall(SwitchedCreate(&s));
  PetscCall(SwitchedSteps(&s, &k, (PetscInt)(60 / s.dt)));
  PetscCall(CouplingSwitchGetReport(s.sw, &report));
  PetscCall(Stamp(&s, &tool));
  CheckAbove(report.n_events, 1);
  CheckInt(report.event[0].asked, COUPLING_BY_TOOL);
  CheckNear(report.event[0].after[LEDGER_CONTACT], 0, 0); /* nothing touched yet */
  print_message("           %d elements turned under a box that sank by %.2g; it bears %.3g, indentation %.3g\n", (int)report.cells, (double)-tool.shift[1], (double)tool.force[1], (double)(-tool.shift[1] - 0.2));
  /* a body of depth 5, E = 1: pressed by 0.1 over a width of 2 it must push back with about that */
  CheckAbove(tool.contacts, 3);
  CheckAbove(tool.force[1], 0.02);
  PetscCall(SwitchedDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestNear)

/* Ledger errors with each term 3 % off, in `bounds` of what the clean one stays below. */
static PetscErrorCode Spoil(const DemStrength *strength, PetscReal bound, PetscReal caught[LEDGER_TERMS])
{
  const PetscReal low[3] = {7, -1, -1}, high[3] = {9, 6, 1};
  Switched        s = Stamped();
  Ledger          ledger = {{0}};
  PetscInt        k = 0;

  PetscFunctionBegin;
  s.strength = *strength;
  PetscCall(SwitchedCreate(&s));
  for (PetscInt turn = 0; turn < 2; turn++) {
    PetscCall(SwitchedSteps(&s, &k, (PetscInt)(60 / s.dt)));
    if (!turn) PetscCall(SwitchedConvert(&s, low, high));
  }
  PetscCall(s.stepper.energy(s.sw, &ledger));
  CheckBelow(LedgerError(&ledger), bound);
  for (PetscInt t = 0; t < LEDGER_TERMS; t++) {
    Ledger spoiled = ledger;

    spoiled.energy[t] *= 1.03;
    caught[t] = LedgerError(&spoiled) / bound;
    print_message("           %-9s %.2e of the work; 3 %% off: ledger error %.1e, clean %.1e\n", LedgerNames[t], (double)(PetscAbsReal(ledger.energy[t]) / ledger.work_in), (double)(caught[t] * bound), (double)LedgerError(&ledger));
  }
  PetscCall(SwitchedDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each term of the ledger is needed: with any one of them 3 % off it no longer closes as it does. A tool that rubs, damping, an overlap under load
   and elements that turn; and the same with bonds that soften, whose steps the ledger follows less closely. */
static PetscErrorCode TestEveryTermCounts(void)
{
  const DemStrength strong = {.tensile = 1, .fracture_energy = 1e3, .softening = DEM_SOFTENING_LINEAR};
  const DemStrength soft = {.tensile = 1e-3, .fracture_energy = 2e-4, .softening = DEM_SOFTENING_LINEAR, .shear = 4e-3, .shear_energy = 1e-3, .mu_static = 0.5};
  PetscReal         caught[2][LEDGER_TERMS];

  PetscFunctionBeginUser;
  PetscCall(Spoil(&strong, 2e-7, caught[0]));
  PetscCall(Spoil(&soft, 3e-4, caught[1]));
  for (PetscInt t = 0; t < LEDGER_TERMS; t++) CheckAbove(PetscMax(caught[0][t], caught[1][t]), 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestEveryTermCounts)

static const struct CMUnitTest tests[] = {TEST(TestSliding), TEST(TestRestart), TEST(TestNear), TEST(TestEveryTermCounts)};

CHECK_MAIN(tests)
