/* test_static_break.c - load steps of bonds that break, without inertia: bars torn, beside explicit steps, a notch, snap-back, pressure on a crack, restart.  Eqs (4.83)-(4.87) */
#include "check.h"
#include "dem_failure.h"
#include "dem_solve.h"
#include <petsctime.h>

static const DemStrength concrete = {.tensile = 3.9e6, .fracture_energy = 143, .softening = DEM_SOFTENING_LINEAR};

typedef struct {
  PetscReal peak, energy, residual, ledger, released; /* / sigma_t, / (G_f x section), / sigma_t, relative, / fracture */
  PetscReal projected; /* area of facets more than half broken, seen along the bar / section */
  PetscReal stiffness;      /* of the pushed bar / of the sound one */
  PetscInt  evaluations;
} Tear;

typedef struct {
  PetscInt    dim, steps;       /* load steps; 0: in time, */
  PetscReal   transits;         /* so many crossings of a wave, */
  PetscReal   h, L, end, notch; /* cell [m], length [m], drawn apart by [m], cut / width */
  uint64_t    seed;
  PetscBool   back;             /* and pressed together again by a sixth of that */
  DemStrength strength;
} Bar;

/* Facets across the middle of the bar, up to `notch` of its width, are as good as cut. */
static PetscErrorCode Notch(const TestBody *body, const Bar *b, PetscReal W, DemModel model)
{
  PetscReal *part;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(body->cells.n_facets, &part));
  for (PetscInt f = 0; f < body->cells.n_facets; f++) {
    const PetscReal *x = body->packing.x + 3 * body->cells.p[f], *y = body->packing.x + 3 * body->cells.q[f];

    part[f] = (x[0] - 0.5 * b->L) * (y[0] - 0.5 * b->L) < 0 && 0.5 * (x[1] + y[1]) < b->notch * W ? 0.01 : 1;
  }
  PetscCall(DemModelSetWeakness(model, part));
  PetscCall(PetscFree(part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A random bar between smooth platens drawn apart. */
static PetscErrorCode TearBar(const Bar *b, Tear *tear)
{
  const DemStrength *s = &b->strength;
  const PetscInt     dim = b->dim, steps = b->steps;
  const PetscReal    L = b->L, end = b->end;
  const PetscReal   young = 37e9, W = 0.02, size[3] = {L, W, dim == 3 ? W : 1}, section = dim == 3 ? W * W : W;
  const PetscReal   c = PetscSqrtReal(young / 2400), T = steps ? 1 : b->transits * L / c;
  const DemMaterial material = {.density = 2400, .young = young, .poisson = 0.2};
  PetscReal         t[65], v[65], half[65], dt, pull;
  PetscLogDouble    begin, stop;
  PetscInt          n;
  TestBody          body;
  DemModel          model;
  Stepper           stepper;
  Ledger            ledger = {{0}};
  Table             left, right;
  DemCracks         cracks;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(tear, sizeof(*tear)));
  PetscCall(TestBodyCreate(dim, size, 1 / b->h, 0, b->seed, &body));
  PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS, young, 0.2, &model));
  PetscCall(DemModelSetMaterial(model, &material));
  PetscCall(DemModelSetStrength(model, s));
  if (b->notch > 0) PetscCall(Notch(&body, b, W, model));
  for (int k = 0; k < 65; k++) { /* displacement in load steps; in time, a speed that grows: slow while it tears is what counts */
    t[k]    = k * T / 64;
    v[k]    = b->back ? 0.5 * end * (k <= 48 ? t[k] / 0.75 : 1 - (t[k] - 0.75) / 0.25 * 7 / 6) : steps ? 0.5 * end * PetscSqr(t[k]) : end / T * t[k] / T;
    half[k] = -v[k];
  }
  PetscCall(TableCreate(65, t, half, &left));
  PetscCall(TableCreate(65, t, v, &right));
  PetscCall(DemModelFix(model, "xmin", 0, steps ? DEM_DISPLACEMENT : DEM_VELOCITY, &left));
  PetscCall(DemModelFix(model, "xmax", 0, steps ? DEM_DISPLACEMENT : DEM_VELOCITY, &right));
  PetscCall(DemModelAddHistory(model, "reaction", "xmax"));
  if (steps) PetscCall(DemModelSetStatic(model, PETSC_TRUE));
  else PetscCall(DemModelSetLocalDamping(model, 0.5));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetStepper(model, &stepper));
  if (steps) dt = T / steps;
  else {
    PetscCall(stepper.stable_step(model, &dt));
    dt *= 0.9;
  }
  n = steps ? steps : (PetscInt)PetscCeilReal(T / dt);
  PetscCall(PetscTime(&begin));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(stepper.step(model, k * dt, dt));
    if (!steps && k % 20) continue;
    PetscCall(stepper.history(model, 0, &pull));
    tear->peak = PetscMax(tear->peak, pull / section / s->tensile);
    if (b->back && k >= n - 2) tear->stiffness += (k == n - 1 ? -1 : 1) * pull / (young * section / L) / (end * 7. / 6 / (0.25 * n));
  }
  PetscCall(PetscTime(&stop));
  PetscCall(stepper.history(model, 0, &pull));
  PetscCall(stepper.energy(model, &ledger));
  if (steps) PetscCall(DemModelGetProducts(model, &tear->evaluations));
  else tear->evaluations = n;
  tear->residual = pull / section / s->tensile;
  tear->energy   = ledger.energy[LEDGER_FRACTURE] / (s->fracture_energy * section);
  tear->released = ledger.energy[LEDGER_DAMPING] / ledger.energy[LEDGER_FRACTURE];
  tear->ledger   = LedgerError(&ledger);
  PetscCall(DemModelGetCracks(model, &cracks));
  for (PetscInt k = 0; k < cracks.n; k++)
    if (cracks.broken[k] > 0.5) {
      const PetscInt   f = cracks.facet[k];
      const PetscReal *x = body.packing.x + 3 * body.cells.p[f], *y = body.packing.x + 3 * body.cells.q[f];

      tear->projected += body.cells.area[f] * PetscAbsReal(y[0] - x[0]) / PetscSqrtReal(PetscSqr(y[0] - x[0]) + PetscSqr(y[1] - x[1]) + PetscSqr(y[2] - x[2])) / section;
    }
  print_message("           %s %dD cell %.1f mm seed %d, %d particles: peak %.4f energy %.4f released %.4f residual %.4f projected %.3f ledger %.1e, %d evaluations, %.2f s\n", steps ? "static" : "explicit", (int)dim, (double)(1e3 * b->h),
                (int)b->seed, (int)body.packing.n, (double)tear->peak, (double)tear->energy, (double)tear->released, (double)tear->residual, (double)tear->projected, (double)tear->ledger, (int)tear->evaluations, stop - begin);
  PetscCall(TableDestroy(&left));
  PetscCall(TableDestroy(&right));
  PetscCall(DemModelDestroy(&model));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The curve's teeth take what lies under it. */
static PetscErrorCode TestTeeth(void)
{
  const DemSoftening kind[] = {DEM_SOFTENING_LINEAR, DEM_SOFTENING_BILINEAR, DEM_SOFTENING_EXPONENTIAL};

  PetscFunctionBeginUser;
  for (int c = 0; c < 3; c++) {
    DemStrength s = concrete;
    PetscReal   D = 0, taken = 0, k;
    PetscInt    teeth = 0;

    s.softening    = kind[c];
    s.knee_stress  = 0.25;
    s.knee_opening = 0.75;
    k              = 2 * 15e9 / (0.05 * DemSofteningLongest(&s, 15e9));
    for (PetscInt i = 0; i < 200000; i++) { /* what the whole facet would carry grows */
      const PetscReal load  = s.tensile * PetscExpReal(5e-5 * i);
      const DemTooth  tooth = DemToothOf(&s, k, load, D);

      CheckTrue(tooth.damage >= D && tooth.damage <= 1 && (tooth.beyond > 0) == (tooth.damage > D));
      taken += 0.5 * load * load / k * tooth.law * (tooth.damage - D);
      teeth += tooth.damage > D;
      D = tooth.damage;
    }
    CheckNear(D, 1, 0);
    CheckTrue(teeth > 20 && teeth < 200);
    CheckClose(taken, s.fracture_energy, c ? 2e-3 : 1e-9); /* chords of a curve that is straight, or not */
    for (PetscInt i = 1; i < 20; i++) {
      const PetscReal w = DemSofteningAt(&s, k, 0.05 * i), t = DemSofteningStress(&s, w);

      CheckClose(1 - t / (t + k * w), 0.05 * i, 1e-10);
      CheckClose(DemSofteningOpening(&s, k, t + k * w), w, 1e-9);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTeeth)

/* One bar in load steps and, if asked, slowly in time: strength, energy per section, and the same of both. */
static PetscErrorCode TestBars(void)
{
  Bar      b     = {.dim = 2, .steps = 64, .transits = 500, .h = 2e-3, .L = 0.06, .end = 0.12e-3, .strength = concrete};
  PetscInt seeds = 1;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-bar_dim", &b.dim, NULL)); /* longer runs: tests/dem/CMakeLists.txt */
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-bar_steps", &b.steps, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-bar_cell", &b.h, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-bar_transits", &b.transits, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-bar_seeds", &seeds, NULL));
  for (b.seed = 1; b.seed <= (uint64_t)seeds; b.seed++) {
    Bar  in_time = b;
    Tear tear, slow;

    PetscCall(TearBar(&b, &tear));
    CheckNear(tear.peak, 1, 0.01);
    CheckNear(tear.energy, 1, 0.03);
    CheckBelow(PetscAbsReal(tear.residual), 0.01);
    CheckBelow(tear.ledger, 0.002);
    if (b.transits <= 0) continue;
    in_time.steps = 0;
    PetscCall(TearBar(&in_time, &slow));
    CheckNear(tear.peak / slow.peak, 1, 0.01);
    CheckNear(tear.energy / slow.energy, 1, 0.02);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBars)

/* A bar with a cut to 0.3 of its width bends open as it tears: the load and the energy as in time, where the teeth are fine enough that the crack takes the same way (whole ones take another one here, of 3 % less energy). */
static PetscErrorCode TestNotch(void)
{
  PetscInt seeds = 2, first = 2;
  Bar      b     = {.dim = 2, .steps = 64, .transits = 500, .h = 2e-3, .L = 0.06, .end = 0.12e-3, .notch = 0.3, .strength = concrete};
  Tear     tear, slow;

  PetscFunctionBeginUser;
  b.strength.teeth = 0.25;
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-notch_transits", &b.transits, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-notch_teeth", &b.strength.teeth, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-notch_first", &first, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-notch_last", &seeds, NULL));
  for (b.seed = (uint64_t)first; b.seed <= (uint64_t)seeds; b.seed++) {
    b.steps = 64;
    PetscCall(TearBar(&b, &tear));
    b.steps = 0;
    PetscCall(TearBar(&b, &slow));
    CheckNear(tear.peak / slow.peak, 1, 0.01);
    CheckNear(tear.energy / slow.energy, 1, 0.02);
    CheckBelow(tear.ledger, 0.002);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestNotch)

/* Snap-back: a bar that stores some three times what its section takes breaks under platens that stand still, and the ledger knows what is set free. */
static PetscErrorCode TestSnapBack(void)
{
  Bar             b      = {.dim = 2, .steps = 120, .h = 2e-3, .L = 0.06, .end = 0.02e-3, .seed = 1, .strength = concrete};
  const PetscReal stored = 0.5 * PetscSqr(concrete.tensile) / 37e9 * b.L;
  Tear            tear;

  PetscFunctionBeginUser;
  b.strength.fracture_energy = stored / 3;
  PetscCall(TearBar(&b, &tear));
  CheckNear(tear.peak, 1, 0.02);
  CheckTrue(tear.energy > 0.97 && tear.energy < 1.4); /* neighbours begin to break while it falls; slow explicit steps take 1.97 here: two sections */
  CheckNear(tear.energy * (1 + tear.released), 3.2, 0.2); /* what was stored, and what it took beyond the straight line */
  CheckBelow(PetscAbsReal(tear.residual), 0.01);
  CheckBelow(tear.ledger, 0.03); /* whole facets go at once on the way down */
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSnapBack)

/* Torn, then pressed together: the closed crack carries as the sound bar does. */
static PetscErrorCode TestPressed(void)
{
  Bar  b = {.dim = 2, .steps = 64, .h = 2e-3, .L = 0.06, .end = 0.1e-3, .seed = 1, .back = PETSC_TRUE, .strength = concrete};
  Tear tear;

  PetscFunctionBeginUser;
  b.strength.mu_dynamic = 0.5;
  PetscCall(TearBar(&b, &tear));
  CheckTrue(tear.stiffness > 0.85 && tear.stiffness < 1); /* slopes of the crack slide a little */
  CheckBelow(tear.ledger, 0.01);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPressed)

static const struct CMUnitTest tests[] = {TEST(TestTeeth), TEST(TestBars), TEST(TestNotch), TEST(TestSnapBack), TEST(TestPressed)};

CHECK_MAIN(tests)
