/* Where a bar without a notch breaks, and what makes elements turn: each criterion at its closed form, hysteresis. */
#include "check.h"
#include "coupling_switch.h"
#include "switched.h"

#define WEAK 0.7 /* of the strength */
static const PetscReal spot[2] = {13, 1.5}; /* the facet nearest to this is weak */

/* The ends are drawn apart along x. */
static PetscErrorCode Draw(Switched *s, FemModel fem, DemModel dem)
{
  const PetscReal t[3] = {0, 100, 1e6}, v[3] = {0, s->velocity[0], s->velocity[0]};
  static const char *const end[2] = {"xmin", "xmax"};
  Table           table, none;

  PetscFunctionBegin;
  PetscCall(TableCreate(3, t, v, &table));
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt k = 0; k < 2; k++) {
    PetscCall(FemModelFix(fem, end[k], 0, k ? FEM_VELOCITY : FEM_DISPLACEMENT, k ? &table : &none));
    PetscCall(CouplingSwitchProtect(s->sw, end[k]));
  }
  PetscCall(FemModelFix(fem, "ymin", 1, FEM_DISPLACEMENT, &none)); /* slides */
  PetscCall(FemModelAddHistory(fem, "reaction", "xmax"));
  PetscCall(FemModelSetDamping(fem, 0.02));
  PetscCall(DemModelSetLocalDamping(dem, 0.3));
  PetscCall(TableDestroy(&table));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DrawFree(Switched *s, FemModel fem, DemModel dem)
{
  const PetscReal t[3] = {0, 100, 1e6}, v[3] = {0, s->velocity[0], s->velocity[0]};
  Table           table, none;

  PetscFunctionBegin;
  (void)dem;
  PetscCall(TableCreate(3, t, v, &table));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(FemModelFix(fem, "xmin", 0, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelFix(fem, "xmin", 1, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelFix(fem, "xmax", 0, FEM_VELOCITY, &table));
  PetscCall(CouplingSwitchProtect(s->sw, "xmin"));
  PetscCall(CouplingSwitchProtect(s->sw, "xmax"));
  PetscCall(FemModelAddHistory(fem, "reaction", "xmax"));
  PetscCall(FemModelSetDamping(fem, 0.02));
  PetscCall(DemModelSetLocalDamping(dem, 0.3));
  PetscCall(TableDestroy(&table));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of the facet nearest to the spot, near vertical. */
static PetscInt WeakFacet(const DemPacking *packing, const DemCells *cells)
{
  PetscReal best = PETSC_MAX_REAL;
  PetscInt  found = -1;

  for (PetscInt f = 0; f < cells->n_facets; f++) {
    const PetscReal *p = &packing->x[3 * cells->p[f]], *q = &packing->x[3 * cells->q[f]];
    const PetscReal  d = hypot(q[0] - p[0], q[1] - p[1]), far = hypot(cells->at[3 * f] - spot[0], cells->at[3 * f + 1] - spot[1]);

    if (fabs(q[0] - p[0]) > 0.95 * d && far < best) {
      best  = far;
      found = f;
    }
  }
  return found;
}

typedef struct {
  PetscReal peak, work;
  PetscReal at[2];      /* of the facet that went first [m] */
  PetscInt  first;      /* its number among the whole packing's facets */
  PetscInt  particles, above, events;
  PetscReal far;        /* of a broken facet from the weak one, along the bar */
} Break;

/* Looks at the facets that have begun to break; of_facet: numbers of the whole packing, NULL: its own. */
static PetscErrorCode Look(DemModel dem, const DemCells *cells, const PetscInt *of_facet, Break *b)
{
  DemCracks cracks;
  PetscReal least = PETSC_MAX_REAL;

  PetscFunctionBegin;
  PetscCall(DemModelGetCracks(dem, &cracks));
  b->first = -1;
  b->work  = 0;
  b->far   = 0;
  for (PetscInt k = 0; k < cracks.n; k++) {
    const PetscInt f = of_facet ? of_facet[cracks.facet[k]] : cracks.facet[k];

    b->work += cracks.work[k];
    if (cracks.broken[k] > 0.5) b->far = PetscMax(b->far, fabs(cells->at[3 * f] - spot[0]));
    if (cracks.time[k] < least) {
      least    = cracks.time[k];
      b->first = f;
      for (PetscInt d = 0; d < 2; d++) b->at[d] = cells->at[3 * f + d];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static Switched Bar(void)
{
  Switched s = SwitchedDefault(2, 24, 3, 0);

  s.ratio       = 3;
  s.strength    = (DemStrength){.tensile = 1e-3, .fracture_energy = 2e-6, .softening = DEM_SOFTENING_LINEAR};
  s.velocity[0] = 2.5e-5;
  s.conditions  = DrawFree;
  return s;
}

#define END 1300.0

/* Adaptive: two elements are particles from the start, four elements from the weak facet; all others may turn. */
static PetscErrorCode Adaptive(Break *b, PetscInt *weak)
{
  Switched             s = Bar();
  CouplingSwitchReport report;
  PetscReal            reaction, *part;
  PetscInt             k = 0;

  PetscFunctionBegin;
  *b            = (Break){0};
  s.start[0][0] = 7;
  s.start[0][1] = 8;
  s.start[1][0] = 1;
  s.start[1][1] = 2;
  s.width       = 2;
  s.options.ahead = 0;
  PetscCall(SwitchedPrepare(&s));
  *weak = WeakFacet(&s.packing, &s.cells);
  PetscCall(PetscMalloc1(s.cells.n_facets, &part));
  for (PetscInt f = 0; f < s.cells.n_facets; f++) part[f] = f == *weak ? WEAK : 1;
  PetscCall(CouplingSwitchSetWeakness(s.sw, part));
  PetscCall(PetscFree(part));
  PetscCall(SwitchedBegin(&s));
  while (k * s.dt < END) {
    PetscCall(SwitchedSteps(&s, &k, 1));
    PetscCall(s.stepper.history(s.sw, 0, &reaction));
    b->peak = PetscMax(b->peak, PetscAbsReal(reaction));
  }
  PetscCall(Look(s.sw->now->dem, &s.cells, s.sw->now->carved.facet, b));
  PetscCall(CouplingSwitchGetReport(s.sw, &report));
  b->particles = report.particles;
  b->events    = report.n_events;
  for (PetscInt i = 0; i < report.n_events; i++) b->above += report.event[i].above;
  PetscCall(SwitchedDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All the same particles, none of the elements. */
static PetscErrorCode Pure(Break *b)
{
  Switched          s = Bar();
  const DemMaterial material = {.density = 1, .young = 1, .poisson = s.nu};
  const PetscReal   t[3] = {0, 100, 1e6}, v[3] = {0, s.velocity[0], s.velocity[0]};
  DemModel          dem;
  Stepper           stepper;
  Table             table, none;
  PetscReal         dt, reaction, *part;

  PetscFunctionBegin;
  *b            = (Break){0};
  s.start[0][0] = 7;
  s.start[0][1] = 8;
  s.start[1][0] = 1;
  s.start[1][1] = 2;
  PetscCall(SwitchedPrepare(&s));
  PetscCall(PetscMalloc1(s.cells.n_facets, &part));
  for (PetscInt f = 0; f < s.cells.n_facets; f++) part[f] = f == WeakFacet(&s.packing, &s.cells) ? WEAK : 1;
  PetscCall(DemModelCreate(PETSC_COMM_SELF, &dem));
  PetscCall(DemModelSetKind(dem, DEM_PLANE_STRAIN));
  PetscCall(DemModelSetMaterial(dem, &material));
  PetscCall(DemModelSetStrength(dem, &s.strength));
  PetscCall(DemModelSetLocalDamping(dem, 0.3));
  PetscCall(DemModelSetBody(dem, &s.body, &s.packing, &s.cells));
  PetscCall(DemModelSetWeakness(dem, part));
  PetscCall(PetscFree(part));
  PetscCall(TableCreate(3, t, v, &table));
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt d = 0; d < 2; d++) PetscCall(DemModelFix(dem, "xmin", d, DEM_DISPLACEMENT, &none));
  PetscCall(DemModelFix(dem, "xmax", 0, DEM_VELOCITY, &table));
  PetscCall(DemModelAddHistory(dem, "reaction", "xmax"));
  PetscCall(DemModelSetUp(dem));
  PetscCall(DemModelGetStepper(dem, &stepper));
  PetscCall(DemModelGetCriticalStep(dem, &dt));
  dt *= 0.9;
  for (PetscInt k = 0; k * dt < END; k++) {
    PetscCall(stepper.step(dem, k * dt, dt));
    PetscCall(stepper.history(dem, 0, &reaction));
    b->peak = PetscMax(b->peak, PetscAbsReal(reaction));
  }
  PetscCall(Look(dem, &s.cells, NULL, b));
  b->particles = s.packing.n;
  PetscCall(TableDestroy(&table));
  PetscCall(TableDestroy(&none));
  PetscCall(DemModelDestroy(&dem));
  PetscCall(SwitchedDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No notch: the crack starts at the facet that is weak, and runs across there, whether its surroundings were elements or not. */
static PetscErrorCode TestWeakFacet(void)
{
  Break    adaptive, pure;
  PetscInt weak;

  PetscFunctionBeginUser;
  PetscCall(Adaptive(&adaptive, &weak));
  PetscCall(Pure(&pure));
  print_message("           weak facet %d at %.3g of the strength: adaptive breaks at facet %d (%.3f, %.3f), all particles at %d; peak %.4g and %.4g, work %.4g and %.4g; %d of %d particles, %d events, farthest broken facet %.2f and %.2f\n", (int)weak, WEAK,
                (int)adaptive.first, (double)adaptive.at[0], (double)adaptive.at[1], (int)pure.first, (double)adaptive.peak, (double)pure.peak, (double)adaptive.work, (double)pure.work, (int)adaptive.particles, (int)pure.particles, (int)adaptive.events,
                (double)adaptive.far, (double)pure.far);
  CheckInt(adaptive.first, weak);
  CheckInt(pure.first, weak);
  CheckInt(adaptive.above, 0);
  CheckClose(adaptive.peak, pure.peak, 0.05);
  CheckClose(adaptive.work, pure.work, 0.1);
  CheckBelow(adaptive.far, 1.5);
  CheckBelow(pure.far, 1.5);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestWeakFacet)

/* Values worked by hand. */
static PetscErrorCode TestCriteria(void)
{
  const DemStrength     strength = {.tensile = 2, .shear = 5, .mu_static = 0.75}; /* sqrt(1 + mu^2) = 1.25 */
  CouplingSwitchOptions o = {.when = COUPLING_RANKINE};
  const PetscReal       pull[6] = {1.5, 0, 0, 0, 0, 0}, push[6] = {-8, 0, 0, 0, 0, 0}, shear[6] = {0, 0, 0, 1, 0, 0}, all[6] = {-3, -3, -3, 0, 0, 0};

  PetscFunctionBeginUser;
  CheckNear(CouplingUse_Internal(&o, &strength, 3, pull), 0.75, 1e-6);
  CheckNear(CouplingUse_Internal(&o, &strength, 3, push), 0, 1e-6);
  CheckNear(CouplingUse_Internal(&o, &strength, 2, shear), 0.5, 1e-6);
  o.when = COUPLING_MOHR_COULOMB;
  CheckNear(CouplingUse_Internal(&o, &strength, 3, pull), 0.75, 1e-6);             /* tension leads */
  CheckNear(CouplingUse_Internal(&o, &strength, 3, push), (4 * 1.25 - 3) / 5, 1e-6); /* 4 sqrt(1 + mu^2) - 4 mu, over 5 */
  CheckNear(CouplingUse_Internal(&o, &strength, 3, all), 0, 1e-6); /* pressed from all sides: safe */
  o = (CouplingSwitchOptions){.when = COUPLING_GIVEN, .given_mean = 0.6, .given_mises = 1, .given_strength = 4};
  CheckNear(CouplingUse_Internal(&o, &strength, 3, pull), (0.6 * 0.5 + 1.5) / 4, 1e-12);
  CheckNear(CouplingUse_Internal(&o, &strength, 3, shear), sqrt(3.0) / 4, 1e-12);
  CheckNear(CouplingUse_Internal(&o, &strength, 3, all), -0.6 * 3 / 4, 1e-12);
  for (PetscInt k = 0; k < 3; k++) { /* what a look skips is below the criterion */
    const PetscReal *s[4] = {pull, push, shear, all};

    o.when = k == 0 ? COUPLING_RANKINE : k == 1 ? COUPLING_MOHR_COULOMB : COUPLING_GIVEN;
    for (PetscInt i = 0; i < 4; i++) {
      PetscReal norm = 0;

      for (PetscInt c = 0; c < 6; c++) norm += (c < 3 ? 1 : 2) * s[i][c] * s[i][c];
      CheckBelow(CouplingUse_Internal(&o, &strength, 3, s[i]), sqrt(norm) / CouplingUseBound_Internal(&o, &strength) * (1 + 1e-12));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCriteria)

static PetscReal Squeeze(void *ctx, PetscInt dim, const PetscReal stress[6])
{
  (void)dim;
  return -stress[0] / *(PetscReal *)ctx;
}

/* A bar pressed along its axis, free across: mean axial force when the first element turns; 0 when none does. */
static PetscErrorCode FirstTurns(CouplingSwitchOptions options, PetscReal speed, PetscReal *force)
{
  Switched             s = SwitchedDefault(2, 12, 3, 0);
  CouplingSwitchReport report;
  PetscInt             k = 0;

  PetscFunctionBegin;
  s.ratio         = 3;
  s.width         = 1;
  s.start[0][0]   = 6;
  s.start[0][1]   = 7;
  s.strength      = (DemStrength){.tensile = 1e-3, .fracture_energy = 1, .softening = DEM_SOFTENING_LINEAR, .shear = 2e-3, .shear_energy = 1, .mu_static = 0.75};
  s.velocity[0]   = speed;
  s.conditions    = Draw;
  s.options       = options;
  *force          = 0;
  PetscCall(SwitchedCreate(&s));
  while (k * s.dt < 2500) {
    PetscCall(SwitchedSteps(&s, &k, 1));
    PetscCall(CouplingSwitchGetReport(s.sw, &report));
    if (!report.n_events) continue;
    PetscCall(s.stepper.history(s.sw, 0, force));
    break;
  }
  PetscCall(SwitchedDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Uniaxial stress at which elements turn, each criterion against its closed form. Height 3, so force = 3 sigma. */
static PetscErrorCode TestCriterionInARun(void)
{
  const CouplingSwitchOptions base = {.at = 0.7, .hysteresis = 0.1};
  PetscReal                   limit = 3e-3, force;
  CouplingSwitchOptions       o = base;

  PetscFunctionBeginUser;
  o.when = COUPLING_RANKINE;
  PetscCall(FirstTurns(o, 1e-5, &force));
  print_message("           drawn, rankine: turns at %.4g of the tensile strength\n", (double)(PetscAbsReal(force) / 3e-3));
  CheckClose(PetscAbsReal(force), 3 * 0.7e-3, 0.03);
  PetscCall(FirstTurns(o, -1e-5, &force));
  CheckNear(force, 0, 0); /* pressure alone, no shear surface: never */
  o.when = COUPLING_MOHR_COULOMB;
  PetscCall(FirstTurns(o, -4e-5, &force));
  print_message("           pressed, mohr-coulomb: turns at %.4g of the compressive strength\n", (double)(PetscAbsReal(force) / (3 * 8e-3)));
  CheckClose(PetscAbsReal(force), 3 * 0.7 * 8e-3, 0.03); /* sigma_c = 2 tau / (sqrt(1 + mu^2) - mu) = 4 tau */
  o           = base;
  o.when      = COUPLING_GIVEN;
  o.given     = Squeeze;
  o.given_ctx = &limit;
  PetscCall(FirstTurns(o, -4e-5, &force));
  print_message("           pressed, a given function: turns at %.4g of its limit\n", (double)(PetscAbsReal(force) / (3 * limit)));
  CheckClose(PetscAbsReal(force), 3 * 0.7 * limit, 0.03);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCriterionInARun)

static PetscErrorCode Bend(Switched *s, FemModel fem, DemModel dem)
{
  const PetscReal t[2] = {0, 1500}, v[2] = {0, s->load}, push[3] = {0, 1, 0};
  Table           ramp, none;

  PetscFunctionBegin;
  PetscCall(TableCreate(2, t, v, &ramp));
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt d = 0; d < 2; d++) PetscCall(FemModelFix(fem, "xmin", d, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(fem, "xmax", push, &ramp));
  PetscCall(CouplingSwitchProtect(s->sw, "xmin"));
  PetscCall(CouplingSwitchProtect(s->sw, "xmax"));
  PetscCall(FemModelSetDamping(fem, 0.05));
  PetscCall(DemModelSetLocalDamping(dem, 0.3));
  PetscCall(TableDestroy(&ramp));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells turned by the first event that an element asked for, and the least criterion among them. */
static PetscErrorCode FirstEvent(PetscReal hysteresis, PetscInt *cells, PetscReal *least, PetscInt *left)
{
  Switched             s = SwitchedDefault(2, 24, 6, 0);
  CouplingSwitchReport report = {0};
  PetscBool           *was;
  PetscInt             k = 0;

  PetscFunctionBegin;
  s.ratio              = 3;
  s.width              = 1;
  s.start[0][0]        = 4;
  s.start[0][1]        = 5;
  s.start[1][0]        = 3;
  s.start[1][1]        = 4;
  s.strength           = (DemStrength){.tensile = 1e-3, .fracture_energy = 1, .softening = DEM_SOFTENING_LINEAR};
  s.load               = 1e-4;
  s.conditions         = Bend;
  s.options.hysteresis = hysteresis;
  PetscCall(SwitchedCreate(&s));
  PetscCall(PetscMalloc1(s.mesh.n_cells, &was));
  while (k * s.dt < 1500 && !report.n_events) {
    PetscCall(PetscArraycpy(was, s.sw->is_dem, s.mesh.n_cells));
    PetscCall(SwitchedSteps(&s, &k, 1));
    PetscCall(CouplingSwitchGetReport(s.sw, &report));
  }
  *cells = 0;
  *left  = 0;
  *least = 1;
  for (PetscInt c = 0; c < s.mesh.n_cells; c++) {
    if (s.sw->is_dem[c] && !was[c]) {
      *least = PetscMin(*least, s.sw->use[c]);
      (*cells)++;
    } else if (!s.sw->is_dem[c] && s.sw->may[c] && s.sw->use[c] >= (1 - hysteresis) * s.options.at) (*left)++;
  }
  CheckAbove(report.n_events, 1);
  CheckInt(report.event[0].asked, COUPLING_BY_ELEMENT);
  PetscCall(PetscFree(was));
  PetscCall(SwitchedDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One event takes along what is near the threshold too, and nothing else. */
static PetscErrorCode TestHysteresis(void)
{
  PetscInt  few, many, left;
  PetscReal least;

  PetscFunctionBeginUser;
  PetscCall(FirstEvent(0, &few, &least, &left));
  CheckInt(left, 0);
  CheckAbove(least, 0.7);
  PetscCall(FirstEvent(0.25, &many, &least, &left));
  print_message("           the first event turns %d elements without hysteresis, %d with 0.25, the least at %.3f of the strength\n", (int)few, (int)many, (double)least);
  CheckInt(left, 0);
  CheckAbove(least, 0.75 * 0.7);
  CheckAbove(many, few + 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestHysteresis)

static const struct CMUnitTest tests[] = {TEST(TestWeakFacet), TEST(TestCriteria), TEST(TestCriterionInARun), TEST(TestHysteresis)};

CHECK_MAIN(tests)
