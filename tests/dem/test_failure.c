/* How facets break: the law on one facet, and bars that tear.  docs/theory.md (4.20)-(4.28) */
#include "check.h"
#include "dem_solve.h"

static const DemStrength linear = {.tensile = 3.9e6, .fracture_energy = 143, .softening = DEM_SOFTENING_LINEAR};
static const DemStrength bilinear = {.tensile = 3.9e6, .fracture_energy = 143, .softening = DEM_SOFTENING_BILINEAR, .knee_stress = 0.25, .knee_opening = 0.75};
static const DemStrength exponential = {.tensile = 3.9e6, .fracture_energy = 143, .softening = DEM_SOFTENING_EXPONENTIAL};
static const DemStrength *const curves[] = {&linear, &bilinear, &exponential};
static const char *const names[] = {"linear", "bilinear", "exponential"};

/* The curve encloses G_f, and the opening found in series with a spring is the one the curve belongs to. */
static PetscErrorCode TestCurves(void)
{
  PetscFunctionBeginUser;
  for (int c = 0; c < 3; c++) {
    const DemStrength *s = curves[c];
    const PetscReal    end = PetscMin(DemSofteningEnd(s), 40 * s->fracture_energy / s->tensile), G = 15e9, k = 2 * G / (0.5 * DemSofteningLongest(s, G));
    PetscReal          area = 0;

    for (PetscInt i = 0; i < 200000; i++) area += end / 200000 * DemSofteningStress(s, (i + 0.5) / 200000 * end);
    CheckClose(area, s->fracture_energy, 1e-8);
    for (PetscInt i = 1; i < 100; i++) {
      const PetscReal w = 0.3 * end * i / 100, t = DemSofteningStress(s, w), total = t + k * w;

      CheckClose(DemSofteningOpening(s, k, total), w, 1e-9);
      CheckNear(DemDamageTension(s, G, 2 * G / k, total), 1 - t / total, 1e-12);
    }
    CheckNear(DemDamageTension(s, G, 2 * G / k, s->tensile), 0, 0);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCurves)

/* Two equal cells, one facet, drawn apart through the whole curve with equal volume strains: carried traction against opening, energy G_f A.
   A shear strength, odd rounds, must not cut the curve's tail short: an opening is no sliding. */
static PetscErrorCode TestOneFacet(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (int round = 0; round < 6; round++) {
      const int          c = round / 2;
      const DemStrength *s = curves[c];
      DemStrength        whole = *s;
      const PetscReal    young = 37e9, h = 0.3 * DemSofteningLongest(s, young / 2), size[3] = {2 * h, h, h}, A = dim == 3 ? h * h : h, low[3] = {0};
      const PetscReal    end = PetscMin(DemSofteningEnd(s), 30 * s->fracture_energy / s->tensile);
      const PetscInt     n = 20000;
      TestBody           body = {.packing.n = 2};
      DemModel           model;
      DemState           st;
      Stepper            stepper;
      Ledger             ledger;
      Table              none;
      PetscReal          work = 0, before = 0, u_before = 0, worst = 0;

      PetscCall(DemBodyCreateBox(dim, low, size, 1, &body.body));
      PetscCall(PetscCalloc1(6, &body.packing.x));
      PetscCall(PetscMalloc1(2, &body.packing.r));
      for (PetscInt p = 0; p < 2; p++) {
        body.packing.r[p]     = 0.5 * h;
        body.packing.x[3 * p] = (p + 0.5) * h;
        for (PetscInt d = 1; d < dim; d++) body.packing.x[3 * p + d] = 0.5 * h;
      }
      PetscCall(DemCellsCreate(&body.body, &body.packing, &body.cells));
      PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS, young, 0, &model));
      if (round % 2) {
        whole.shear        = 5e6;
        whole.shear_energy = s->fracture_energy;
        whole.mu_static    = 0.9;
        whole.mu_dynamic   = 0.3;
      }
      PetscCall(DemModelSetStrength(model, &whole));
      PetscCall(TableCreateConstant(0, &none));
      PetscCall(DemModelSetUp(model));
      PetscCall(DemModelGetStepper(model, &stepper));
      PetscCall(DemModelGetState(model, &st));
      for (PetscInt i = 1; i <= n; i++) { /* the gap is drawn, the state set: no dynamics in between */
        const PetscReal w = end * PetscPowReal((PetscReal)i / n, 3), t = DemSofteningStress(s, w), gap = w + t * h / young;
        const PetscInt  right = st.number[0] == 1 ? 0 : 1;

        st.v[right] = st.v[1 - right] = 0;
        st.u[right] = gap;
        /* a step of zero length: forces and damage of the new state */
        PetscCall(stepper.step(model, 0, 1e-300));
        PetscCall(DemModelGetState(model, &st));
        worst = PetscMax(worst, PetscAbsReal(-st.f[right] / A - t) / s->tensile);
        work += 0.5 * (-st.f[right] + before) * (gap - u_before);
        before   = -st.f[right];
        u_before = gap;
      }
      PetscCall(stepper.energy(model, &ledger));
      CheckBelow(worst, 1e-6);
      CheckClose(work, s->fracture_energy * A * (c == 2 ? 1 - PetscExpReal(-30) : 1) + (c == 2 ? ledger.energy[LEDGER_STRAIN] : 0), 1e-6);
      CheckClose(ledger.energy[LEDGER_FRACTURE] + ledger.energy[LEDGER_STRAIN], work, 1e-6);
      CheckClose(ledger.energy[LEDGER_FRACTURE], s->fracture_energy * A, 1e-6);
      PetscCall(DemModelRestoreState(model, &st));
      PetscCall(TableDestroy(&none));
      PetscCall(DemModelDestroy(&model));
      PetscCall(TestBodyDestroy(&body));
    }
  (void)names;
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOneFacet)

/* A random bar between smooth platens drawn apart slowly: peak, energy per projected crack area, what it still carries. */
typedef struct {
  PetscReal peak, energy, residual, ledger; /* / sigma_t, / (G_f x section), / sigma_t, relative */
  PetscReal area, projected;                /* crack area (more than half broken) / section */
} Tear;

static PetscErrorCode TearBar(PetscInt dim, PetscReal h, uint64_t seed, PetscReal transits, Tear *tear)
{
  const DemStrength s = {.tensile = 3.9e6, .fracture_energy = 143, .softening = DEM_SOFTENING_LINEAR};
  const PetscReal   young = 37e9, L = 0.06, W = 0.02, size[3] = {L, W, dim == 3 ? W : 1}, section = dim == 3 ? W * W : W;
  const PetscReal   end = 0.12e-3, c = PetscSqrtReal(young / 2400), T = transits * L / c;
  const DemMaterial material = {.density = 2400, .young = young, .poisson = 0.2};
  PetscReal         t[65], v[65], half[65], dt, pull, steps;
  TestBody          body;
  DemModel          model;
  Stepper           stepper;
  Ledger            ledger;
  Table             left, right;
  DemCracks         cracks;

  PetscFunctionBegin;
  PetscCall(TestBodyCreate(dim, size, 1 / h, 0, seed, &body));
  PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS, young, 0.2, &model));
  PetscCall(DemModelSetMaterial(model, &material));
  PetscCall(DemModelSetStrength(model, &s));
  for (int k = 0; k < 65; k++) { /* the speed grows: slow while it tears is what counts */
    t[k]    = k * T / 64;
    v[k]    = end / T * t[k] / T;
    half[k] = -v[k];
  }
  PetscCall(TableCreate(65, t, half, &left));
  PetscCall(TableCreate(65, t, v, &right));
  PetscCall(DemModelFix(model, "xmin", 0, DEM_VELOCITY, &left));
  PetscCall(DemModelFix(model, "xmax", 0, DEM_VELOCITY, &right));
  PetscCall(DemModelAddHistory(model, "reaction", "xmax"));
  PetscCall(DemModelSetLocalDamping(model, 0.5));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetStepper(model, &stepper));
  PetscCall(stepper.stable_step(model, &dt));
  dt *= 0.9;
  steps = PetscCeilReal(T / dt);
  PetscCall(PetscMemzero(tear, sizeof(*tear)));
  for (PetscInt k = 0; k < steps; k++) {
    PetscCall(stepper.step(model, k * dt, dt));
    if (k % 20 == 0) {
      PetscCall(stepper.history(model, 0, &pull));
      tear->peak = PetscMax(tear->peak, pull / section / s.tensile);
    }
  }
  PetscCall(stepper.history(model, 0, &pull));
  PetscCall(stepper.energy(model, &ledger));
  tear->residual = pull / section / s.tensile;
  tear->energy   = ledger.energy[LEDGER_FRACTURE] / (s.fracture_energy * section);
  tear->ledger   = LedgerError(&ledger);
  PetscCall(DemModelGetCracks(model, &cracks));
  {
    PetscReal work = 0;

    for (PetscInt k = 0; k < cracks.n; k++) {
      work += cracks.work[k];
      if (cracks.broken[k] > 0.5) {
        const PetscInt  f = cracks.facet[k], p = body.cells.p[f], q = body.cells.q[f];
        const PetscReal *x = body.packing.x + 3 * p, *y = body.packing.x + 3 * q;
        const PetscReal d = PetscSqrtReal(PetscSqr(y[0] - x[0]) + PetscSqr(y[1] - x[1]) + PetscSqr(y[2] - x[2]));

        tear->area += body.cells.area[f] / section;
        tear->projected += body.cells.area[f] * PetscAbsReal(y[0] - x[0]) / d / section;
      }
    }
    CheckClose(work, ledger.energy[LEDGER_FRACTURE], 1e-8); /* the ledger is the sum of the facets */
  }
  print_message("           %dD cell %.1f mm seed %d, %d particles: peak %.4f energy %.4f residual %.4f crack area %.3f projected %.3f ledger %.1e\n", (int)dim, (double)(1e3 * h), (int)seed,
                (int)body.packing.n, (double)tear->peak, (double)tear->energy, (double)tear->residual, (double)tear->area, (double)tear->projected, (double)tear->ledger);
  PetscCall(TableDestroy(&left));
  PetscCall(TableDestroy(&right));
  PetscCall(DemModelDestroy(&model));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckTear(PetscInt dim, PetscReal h, uint64_t seed, PetscReal transits)
{
  Tear tear;

  PetscFunctionBegin;
  PetscCall(TearBar(dim, h, seed, transits, &tear));
  CheckNear(tear.peak, 1, 0.02);
  CheckNear(tear.energy, 1, 0.03);
  CheckBelow(PetscAbsReal(tear.residual), 0.01);
  CheckBelow(tear.ledger, 0.01);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestBars(void)
{
  PetscInt  dim = 2;
  PetscReal h = 2e-3, transits = 500;
  PetscInt  seeds = 1;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-bar_dim", &dim, NULL)); /* longer runs: tests/dem/CMakeLists.txt */
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-bar_cell", &h, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-bar_transits", &transits, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-bar_seeds", &seeds, NULL));
  for (PetscInt seed = 1; seed <= seeds; seed++) PetscCall(CheckTear(dim, h, seed, transits));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBars)

static const struct CMUnitTest tests[] = {TEST(TestCurves), TEST(TestOneFacet), TEST(TestBars)};

CHECK_MAIN(tests)
