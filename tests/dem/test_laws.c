/* The published law of failure on two particles: closed forms of loading, unloading, closing, every way to fail.  docs/theory.md (4.50)-(4.63) */
#include "check.h"
#include "dem_solve.h"
#include <petscblaslapack.h>

static const DemRule kdem = {.elasticity = DEM_KDEM, .normal_factor = 1, .shear_factor = 1};

#define YOUNG 30e9 /* [Pa] */

/* Two cubes of edge h under the law, right one moved by hand; kn = E h, area h^2. Tiny strengths: second-order lengthening by a slide is far below them. */
typedef struct {
  TestBody    body;
  DemModel    model;
  Stepper     stepper;
  DemState    s;
  PetscReal   h, A, kn, ks;
  PetscInt    right;
  PetscReal   work, before[2], move[2]; /* trapezoid of the hand's work [J] */
} Two;

static PetscErrorCode TwoCreate(PetscInt dim, PetscReal h, const DemStrength *strength, const PetscInt group[2], Two *t)
{
  const PetscReal low[3] = {0}, size[3] = {2 * h, h, h};

  PetscFunctionBegin;
  PetscCall(PetscMemzero(t, sizeof(*t)));
  t->h = h;
  PetscCall(DemBodyCreateBox(dim, low, size, 1, &t->body.body));
  t->body.packing.n = 2;
  PetscCall(PetscCalloc1(6, &t->body.packing.x));
  PetscCall(PetscMalloc1(2, &t->body.packing.r));
  for (PetscInt p = 0; p < 2; p++) {
    t->body.packing.r[p]     = 0.5 * h;
    t->body.packing.x[3 * p] = (p + 0.5) * h;
    for (PetscInt d = 1; d < dim; d++) t->body.packing.x[3 * p + d] = 0.5 * h;
  }
  PetscCall(DemCellsCreate(&t->body.body, &t->body.packing, &t->body.cells));
  PetscCall(TestModelCreate(&t->body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS, YOUNG, 0.2, &t->model));
  PetscCall(DemModelSetRule(t->model, &kdem));
  if (strength) PetscCall(DemModelSetStrength(t->model, strength));
  if (group) PetscCall(DemModelSetGroups(t->model, group));
  PetscCall(DemModelSetUp(t->model));
  PetscCall(DemModelGetStepper(t->model, &t->stepper));
  PetscCall(DemModelGetState(t->model, &t->s));
  t->right = t->s.number[0] == 1 ? 0 : 1;
  t->A     = dim == 3 ? h * h : h;
  t->kn    = YOUNG * t->A / h;
  t->ks    = t->kn / 2.4;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TwoDestroy(Two *t)
{
  PetscFunctionBegin;
  PetscCall(DemModelRestoreState(t->model, &t->s));
  PetscCall(DemModelDestroy(&t->model));
  PetscCall(TestBodyDestroy(&t->body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elongation n and slide s, reached in `steps` even steps; out: pull and shear force that the bond puts against them. */
static PetscErrorCode Move(Two *t, PetscReal n, PetscReal s, PetscInt steps, PetscReal *pull, PetscReal *shear)
{
  const PetscReal from[2] = {t->move[0], t->move[1]};

  PetscFunctionBegin;
  for (PetscInt i = 1; i <= steps; i++) {
    const PetscReal now[2] = {from[0] + (n - from[0]) * i / steps, from[1] + (s - from[1]) * i / steps};

    for (PetscInt p = 0; p < 2; p++) t->s.v[p] = t->s.v[2 + p] = t->s.spin[p] = 0;
    t->s.u[t->right]     = now[0];
    t->s.u[2 + t->right] = now[1];
    PetscCall(t->stepper.step(t->model, 0, 1e-300)); /* of zero length: forces and history of the new state */
    PetscCall(DemModelGetState(t->model, &t->s));
    for (PetscInt d = 0; d < 2; d++) {
      const PetscReal f = -t->s.f[d * 2 + t->right];

      t->work += 0.5 * (f + t->before[d]) * (now[d] - t->move[d]);
      t->before[d] = f;
      t->move[d]   = now[d];
    }
  }
  *pull  = t->before[0];
  *shear = t->before[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The ledger takes all the work of the hand. */
static PetscErrorCode CheckLedger(Two *t, PetscReal relative)
{
  Ledger ledger;

  PetscFunctionBegin;
  PetscCall(t->stepper.energy(t->model, &ledger));
  CheckClose(ledger.energy[LEDGER_STRAIN] + ledger.energy[LEDGER_FRACTURE] + ledger.energy[LEDGER_FRICTION], t->work, relative);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestTension(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt given = 0; given < 2; given++) {
      /* delta_n, or the fracture energy that means the same: delta = 2 E G_f/(sigma_t^2 d) - 1 */
      const PetscReal   st = 3e3, h = 0.1, delta = 0.2, ul = st * h / YOUNG;
      const DemStrength s = {.published = PETSC_TRUE, .tensile = st, .delta_n = given ? delta : 0, .fracture_energy = given ? 0 : 0.5 * st * ul * (1 + delta)};
      Two               t;
      PetscReal         N, T;
      Ledger            ledger;

      PetscCall(TwoCreate(dim, h, &s, NULL, &t));
      PetscCall(Move(&t, 0.5 * ul, 0, 10, &N, &T));
      CheckClose(N, 0.5 * st * t.A, 1e-6);
      PetscCall(Move(&t, -2 * ul, 0, 10, &N, &T)); /* compression is elastic */
      CheckClose(N, -2 * st * t.A, 1e-6);
      PetscCall(Move(&t, 1.1 * ul, 0, 4000, &N, &T)); /* half way down the line */
      CheckClose(N, 0.5 * st * t.A, 1e-6);
      PetscCall(Move(&t, 0.55 * ul, 0, 10, &N, &T)); /* unloads towards the origin */
      CheckClose(N, 0.25 * st * t.A, 1e-6);
      PetscCall(Move(&t, -ul, 0, 4000, &N, &T)); /* closes with its full stiffness */
      CheckClose(N, -st * t.A, 1e-6);
      PetscCall(Move(&t, 1.1 * ul, 0, 4000, &N, &T));
      CheckClose(N, 0.5 * st * t.A, 1e-6);
      PetscCall(Move(&t, 1.15 * ul, 0, 1000, &N, &T));
      CheckClose(N, 0.25 * st * t.A, 1e-6);
      PetscCall(Move(&t, 1.25 * ul, 0, 2000, &N, &T));
      CheckNear(N, 0, 1e-12 * st * t.A);
      PetscCall(t.stepper.energy(t.model, &ledger));
      CheckClose(ledger.energy[LEDGER_FRACTURE], 0.5 * st * t.A * 1.2 * ul, 1e-5);
      CheckNear(ledger.energy[LEDGER_STRAIN], 0, 1e-12 * t.work);
      PetscCall(Move(&t, -ul, 0.3 * ul, 4000, &N, &T)); /* shut again; without friction it carries no shear */
      CheckClose(N, -st * t.A, 1e-6);
      CheckNear(T, 0, 1e-6 * st * t.A);
      PetscCall(CheckLedger(&t, 1e-4));
      PetscCall(TwoDestroy(&t));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTension)

static PetscErrorCode TestShear(void)
{
  const PetscReal   h = 0.1, tau = 3e3, mu1 = 0.9, mu2 = 0.25, delta = 0.2;
  const DemStrength s = {.published = PETSC_TRUE, .shear = tau, .delta_s = delta, .mu_static = mu1, .mu_dynamic = mu2};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt pressed = 0; pressed < 2; pressed++) {
      Two             t;
      PetscReal       N, T, un, limit, us;

      PetscCall(TwoCreate(dim, h, &s, NULL, &t));
      un    = pressed ? -2 * tau * t.A / t.kn : 0;           /* pressed with 2 tau A */
      limit = tau * t.A * (pressed ? 1 + 2 * mu1 : 1);
      us    = limit / t.ks;
      PetscCall(Move(&t, un, 0, 10, &N, &T));
      PetscCall(Move(&t, un, 0.99 * us, 100, &N, &T));
      CheckClose(T, 0.99 * limit, 1e-5);
      PetscCall(Move(&t, un, 1.1 * us, 2000, &N, &T));
      CheckClose(T, 0.5 * limit, 1e-4); /* a slide lengthens the centre line, to second order */
      PetscCall(Move(&t, un, -0.55 * us, 100, &N, &T)); /* back through the origin */
      CheckClose(T, -0.25 * limit, 1e-4);
      PetscCall(Move(&t, un, 1.25 * us, 8000, &N, &T)); /* broken at 1.2: from there on it rubs */
      CheckNear(T, pressed ? PetscMin(0.05 * us * t.ks, 2 * mu2 * tau * t.A) : 0, 1e-3 * limit);
      PetscCall(Move(&t, un, 3 * us, 4000, &N, &T));
      CheckNear(T, pressed ? 2 * mu2 * tau * t.A : 0, 1e-4 * limit);
      PetscCall(CheckLedger(&t, 1e-3));
      PetscCall(Move(&t, 3 * us, 3 * us, 100, &N, &T)); /* opened: neither pull nor friction */
      CheckNear(PetscMax(N, T), 0, 1e-9 * limit);
      PetscCall(TwoDestroy(&t));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestShear)

/* Branches of compression, elastic unloading, the set that stays, and what crushing takes. */
static PetscErrorCode TestCompression(void)
{
  const PetscReal   h = 0.1, L1 = 2e3, L2 = 4.5e3, L3 = 7e3;
  const DemStrength s = {.published = PETSC_TRUE, .tensile = 1e3, .delta_n = 0.2, .n_branches = 3, .crush = {L1, L2, L3}, .reduce = {3, 12, 22}};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    Two             t;
    PetscReal       N, T, set;
    const PetscReal e1 = L1 / YOUNG, e2 = e1 + 3 * (L2 - L1) / YOUNG, e3 = e2 + 12 * (L3 - L2) / YOUNG, e4 = e3 + 22 * L1 / YOUNG; /* strains of the corners */
    Ledger          ledger;

    PetscCall(TwoCreate(dim, h, &s, NULL, &t));
    PetscCall(Move(&t, -0.5 * e1 * h, 0, 10, &N, &T));
    CheckClose(N, -0.5 * L1 * t.A, 1e-6);
    PetscCall(Move(&t, 0, 0, 10, &N, &T));
    CheckNear(N, 0, 1e-9 * L1 * t.A);
    PetscCall(Move(&t, -0.5 * (e1 + e2) * h, 0, 1000, &N, &T));
    CheckClose(N, -0.5 * (L1 + L2) * t.A, 1e-6);
    set = -0.5 * (e1 + e2) * h + 0.5 * (L1 + L2) * t.A / t.kn;
    PetscCall(Move(&t, set - 0.1 * e1 * h, 0, 10, &N, &T)); /* unloads with E */
    CheckClose(N, -0.1 * L1 * t.A, 1e-5);
    PetscCall(Move(&t, set + 0.4 * e1 * h, 0, 100, &N, &T)); /* still shorter than at rest, by less than any limit: but longer than its set, so it pulls */
    CheckClose(N, 0.4 * L1 * t.A, 1e-5);
    PetscCall(Move(&t, -0.5 * (e1 + e2) * h, 0, 10, &N, &T)); /* and comes back to where it left */
    CheckClose(N, -0.5 * (L1 + L2) * t.A, 1e-6);
    PetscCall(Move(&t, -e2 * h, 0, 1000, &N, &T));
    CheckClose(N, -L2 * t.A, 1e-6);
    PetscCall(Move(&t, -0.5 * (e2 + e3) * h, 0, 1000, &N, &T));
    CheckClose(N, -0.5 * (L2 + L3) * t.A, 1e-6);
    PetscCall(Move(&t, -e4 * h, 0, 1000, &N, &T));
    CheckClose(N, -(L3 + L1) * t.A, 1e-6);
    PetscCall(t.stepper.energy(t.model, &ledger)); /* area under the branches less what is stored */
    CheckClose(ledger.energy[LEDGER_FRACTURE],
               t.A * h * (0.5 * L1 * e1 + 0.5 * (L1 + L2) * (e2 - e1) + 0.5 * (L2 + L3) * (e3 - e2) + 0.5 * (2 * L3 + L1) * (e4 - e3) - 0.5 * PetscSqr(L3 + L1) / YOUNG), 1e-5);
    PetscCall(CheckLedger(&t, 1e-9));
    set = -e4 * h + (L3 + L1) * t.A / t.kn;
    PetscCall(Move(&t, set + 0.5 * 1e3 * h / YOUNG, 0, 10, &N, &T)); /* tension begins at the set */
    CheckClose(N, 0.5 * 1e3 * t.A, 1e-5);
    PetscCall(TwoDestroy(&t));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCompression)

/* A bond of negligible strength, and two particles of different groups, behave as if there were none: they push and rub alike. */
static PetscErrorCode TestNoStrengthIsNoBond(void)
{
  const PetscReal   h = 0.1, unit = 1e-7, mu2 = 0.3;
  const DemStrength s = {.published = PETSC_TRUE, .tensile = 1e-9, .delta_n = 0.2, .shear = 1e-9, .delta_s = 0.2, .mu_dynamic = mu2};
  const PetscReal   path[][2] = {{0.5, 0}, {0.5, 0.4}, {0, 0.4}, {-1, 0.4}, {-1, 0.6}, {-1, 3}, {-2, 1}, {-0.1, 1}, {1, 0}};
  const PetscInt    apart[2] = {0, 1};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    Two       t, g;
    PetscReal N, T, M, R;

    PetscCall(TwoCreate(dim, h, &s, NULL, &t));
    PetscCall(TwoCreate(dim, h, &s, apart, &g));
    for (size_t k = 0; k < sizeof(path) / sizeof(path[0]); k++) {
      PetscCall(Move(&t, unit * path[k][0], unit * path[k][1], 50, &N, &T));
      PetscCall(Move(&g, unit * path[k][0], unit * path[k][1], 50, &M, &R));
      CheckNear(N, PetscMin(0, path[k][0]) * unit * t.kn, 1e-5 * unit * t.kn);
      CheckBelow(PetscAbsReal(T), (mu2 * PetscMax(0, -path[k][0]) + 1e-5) * unit * t.kn);
      CheckNear(M, N, 1e-9 * unit * t.kn);
      CheckNear(R, T, 1e-9 * unit * t.kn);
    }
    PetscCall(TwoDestroy(&t));
    PetscCall(TwoDestroy(&g));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestNoStrengthIsNoBond)

/* Rankine on the mean of the two particles: a bond starts to soften when their stress is there, not when its own is. */
static PetscErrorCode TestNonlocalOnset(void)
{
  const PetscReal   h = 0.1, st = 3e3;
  const DemStrength s = {.published = PETSC_TRUE, .nonlocal = PETSC_TRUE, .tensile = st, .delta_n = 0.2};

  PetscFunctionBeginUser;
  for (PetscInt pulled = 0; pulled < 2; pulled++) {
    /* The bond alone, free at the outer faces: each particle carries half of its stress. Loaded at the faces too: all of it. */
    const PetscReal none[3] = {0}, size[3] = {2 * h, h, h}, left[3] = {-1, 0, 0}, out[3] = {1, 0, 0};
    Two             t = {0};
    Table           table;
    PetscReal       N, T, limit = st * h / YOUNG, onset = pulled ? 1.2 : 2;

    PetscCall(TwoCreate(3, h, &s, NULL, &t));
    if (pulled) {
      PetscCall(DemModelRestoreState(t.model, &t.s));
      PetscCall(DemModelDestroy(&t.model));
      PetscCall(TestModelCreate(&t.body, DEM_SOLID, YOUNG, 0.2, &t.model));
      PetscCall(DemModelSetRule(t.model, &kdem));
      PetscCall(DemModelSetStrength(t.model, &s));
      PetscCall(TableCreateConstant(0.8 * st, &table)); /* their mean: (0.8 sigma_t + N/A)/2 */
      PetscCall(DemModelAddTraction(t.model, "xmin", left, &table));
      PetscCall(DemModelAddTraction(t.model, "xmax", out, &table));
      PetscCall(DemModelSetUp(t.model));
      PetscCall(DemModelGetStepper(t.model, &t.stepper));
      PetscCall(DemModelGetState(t.model, &t.s));
      PetscCall(TableDestroy(&table));
    }
    (void)none, (void)size;
    PetscCall(Move(&t, 0.98 * onset * limit, 0, 2000, &N, &T));
    CheckClose(N + (pulled ? 0.8 * st * t.A : 0), 0.98 * onset * st * t.A, 1e-5); /* the hand holds against the traction too */
    PetscCall(Move(&t, 1.1 * onset * limit, 0, 4000, &N, &T));
    CheckClose(N + (pulled ? 0.8 * st * t.A : 0), 0.5 * onset * st * t.A, 5e-2); /* the look is every ten steps */
    PetscCall(Move(&t, 1.21 * onset * limit, 0, 2000, &N, &T));
    CheckNear(N + (pulled ? 0.8 * st * t.A : 0), 0, 1e-9 * st * t.A);
    PetscCall(TwoDestroy(&t));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestNonlocalOnset)

/* Many particles thrown about: at a fixed state the stored energy never rises when damage grows, and what it loses the ledger books. */
static PetscErrorCode TestEnergyFallsWithDamage(void)
{
  const PetscReal zero[3] = {0}, size[3] = {1, 1, 1};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt nonlocal = 0; nonlocal < 2; nonlocal++) {
      const DemStrength       s = {.published = PETSC_TRUE, .nonlocal = (PetscBool)nonlocal, .tensile = 1e-3, .delta_n = 0.5, .shear = 2e-3, .delta_s = 0.5, .mu_static = 0.3, .mu_dynamic = 0.2,
                                   .n_branches = 2, .crush = {2e-3, 4e-3}, .reduce = {3, 9}};
      const DemPackingOptions options = {.count = 60, .spread = 0.2, .seed = 2};
      TestBody                body = {.packing.n = 0};
      DemModel                model;
      DemState                st;
      Stepper                 stepper;
      Ledger                  before, after;
      uint64_t                seed = 4;
      PetscReal               broken = 0;

      PetscCall(DemBodyCreateBox(dim, zero, size, 1, &body.body));
      PetscCall(DemPackingCreate(&body.body, &options, &body.packing));
      PetscCall(DemCellsCreate(&body.body, &body.packing, &body.cells));
      PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRAIN, 1, 0.2, &model));
      PetscCall(DemModelSetRule(model, &kdem));
      PetscCall(DemModelSetStrength(model, &s));
      PetscCall(DemModelSetUp(model));
      PetscCall(DemModelGetStepper(model, &stepper));
      PetscCall(DemModelGetState(model, &st));
      for (PetscInt k = 0; k < 40; k++) {
        for (PetscInt p = 0; p < st.n; p++)
          for (PetscInt d = 0; d < dim; d++) st.u[d * st.n + p] = 1e-4 * (k + 1) * (TestRandom(&seed) - 0.5);
        PetscCall(PetscArrayzero(st.v, 3 * st.n));
        PetscCall(PetscArrayzero(st.spin, 3 * st.n));
        PetscCall(stepper.energy(model, &before));
        for (PetscInt i = 0; i < 12; i++) PetscCall(stepper.step(model, 0, 1e-300)); /* a look at the stress among them */
        PetscCall(stepper.energy(model, &after));
        CheckBelow(after.energy[LEDGER_STRAIN], before.energy[LEDGER_STRAIN] * (1 + 1e-12));
        CheckAbove(after.energy[LEDGER_FRACTURE], before.energy[LEDGER_FRACTURE] * (1 - 1e-12));
      }
      broken = after.energy[LEDGER_FRACTURE];
      CheckAbove(broken, 1e-9);
      PetscCall(DemModelRestoreState(model, &st));
      PetscCall(DemModelDestroy(&model));
      PetscCall(TestBodyDestroy(&body));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestEnergyFallsWithDamage)

/* Numbers that cannot be. */
static PetscErrorCode TestRefusals(void)
{
  DemStrength s = {.published = PETSC_TRUE, .tensile = 3e6, .fracture_energy = 1};
  Two         t = {0};
  DemModel    model;

  PetscFunctionBeginUser;
  CheckFails(TwoCreate(3, 0.1, &s, NULL, &t), PETSC_ERR_USER_INPUT, "too far apart for the fracture energy"); /* d < 2 E G_f/sigma_t^2 = 6.7 mm */
  PetscCall(DemModelDestroy(&t.model));
  PetscCall(TestBodyDestroy(&t.body));
  PetscCall(DemModelCreate(PETSC_COMM_SELF, &model));
  s = (DemStrength){.published = PETSC_TRUE, .tensile = 3e6, .delta_n = 0.2, .n_branches = 2, .crush = {3e6, 2e6}, .reduce = {2, 3}};
  CheckFails(DemModelSetStrength(model, &s), PETSC_ERR_USER_INPUT, "Branch 2 of compression");
  PetscCall(DemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefusals)

/* All pairs broken, pressed together, sticking, and every particle turned at random by up to half a turn: no mode of the forces is faster than the step allows.
   The highest frequency of the intact body alone would allow too much: that let a run of shale explode at 0.9 of it. */
static PetscErrorCode TestTurnedPairs(void)
{
  const DemStrength strength = {.published = PETSC_TRUE, .tensile = 1, .delta_n = 0.2, .shear = 1, .delta_s = 0.2, .mu_dynamic = 0.6};
  const PetscReal   low[3] = {0}, one[3] = {1, 1, 1}, press = 1e-3, h = 1e-7;

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const DemPackingOptions options = {.count = dim == 3 ? 40 : 30, .spread = 0.45, .seed = 2};
    PetscReal              *J, *f, *g, *base, *turn, *re, *im, *work, dt, none, most = 0;
    PetscInt                broken = 0, bonds;
    uint64_t                seed = 11;
    PetscBLASInt            size, lwork, info, one_row = 1;
    TestBody                body = {.packing.n = 0};
    DemModel                model, intact;
    DemState                s;
    DemBondList             list;
    Stepper                 stepper;

    PetscCall(DemBodyCreateBox(dim, low, one, 1, &body.body));
    PetscCall(DemPackingCreate(&body.body, &options, &body.packing));
    PetscCall(DemCellsCreate(&body.body, &body.packing, &body.cells));
    PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRAIN, YOUNG, 0.2, &intact));
    PetscCall(DemModelSetRule(intact, &kdem));
    PetscCall(DemModelSetUp(intact));
    PetscCall(DemModelGetCriticalStep(intact, &none));
    PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRAIN, YOUNG, 0.2, &model));
    PetscCall(DemModelSetRule(model, &kdem));
    PetscCall(DemModelSetStrength(model, &strength));
    PetscCall(DemModelSetUp(model));
    PetscCall(DemModelGetCriticalStep(model, &dt));
    CheckBelow(dt, none);
    CheckAbove(dt, 0.4 * none);
    PetscCall(DemModelGetStepper(model, &stepper));
    const PetscInt n = TestUnknowns(model), rows = dim == 3 ? 4 : 3;

    size  = (PetscBLASInt)n;
    lwork = 8 * size;
    PetscCall(PetscMalloc4(n * n, &J, n, &f, n, &g, lwork, &work));
    PetscCall(DemModelGetState(model, &s));
    PetscCall(PetscMalloc4(dim * s.n, &base, rows * s.n, &turn, n, &re, n, &im));
    for (PetscInt i = 0; i < dim * s.n; i++) s.u[i] = base[i] = -press * s.x0[i] + 1e-2 * press * TestRandom(&seed);
    PetscCall(DemModelRestoreState(model, &s));
    PetscCall(stepper.step(model, 0, 1e-300)); /* breaks them where they are */
    PetscCall(DemModelGetBonds(model, &list));
    for (PetscInt k = 0; k < list.n; k++) broken += list.damage[k] >= 1;
    PetscCall(DemModelGetCounts(model, NULL, &bonds, NULL));
    CheckInt(broken, bonds);
    PetscCall(DemModelGetState(model, &s));
    for (PetscInt p = 0; p < s.n; p++) {
      const PetscReal angle = PETSC_PI * TestRandom(&seed);
      PetscReal       axis[3], length = 0;

      for (int d = 0; d < 3; d++) {
        axis[d] = TestRandom(&seed) - 0.5;
        length += axis[d] * axis[d];
      }
      if (dim == 2) {
        turn[p]           = PetscSinReal(angle);
        turn[s.n + p]     = -2 * PetscSqr(PetscSinReal(0.5 * angle));
        turn[2 * s.n + p] = angle;
      } else {
        turn[p] = PetscCosReal(0.5 * angle);
        for (int d = 0; d < 3; d++) turn[(1 + d) * s.n + p] = PetscSinReal(0.5 * angle) * axis[d] / PetscSqrtReal(length);
      }
    }
    for (PetscInt i = -1; i < n; i++) { /* -1: the state itself; then each unknown by h on either side would be the same to 1e-6: one side */
      const PetscReal by = i < 0 ? 0 : h / PetscSqrtReal(i < dim * s.n ? s.mass[i % s.n] : s.inertia[i % s.n]) * PetscSqrtReal(s.mass[0]);

      PetscCall(PetscArraycpy(s.u, base, dim * s.n));
      PetscCall(PetscArraycpy(s.rot, turn, rows * s.n));
      if (i >= 0 && i < dim * s.n) s.u[i] += by;
      else if (i >= 0 && dim == 2) {
        const PetscInt  p = i % s.n;
        const PetscReal a = turn[2 * s.n + p] + by;

        s.rot[p]           = PetscSinReal(a);
        s.rot[s.n + p]     = -2 * PetscSqr(PetscSinReal(0.5 * a));
        s.rot[2 * s.n + p] = a;
      } else if (i >= 0) { /* turned on by a small angle about axis d: (1, by/2 e_d) times q */
        const PetscInt  p = i % s.n, d = i / s.n - 3, u = (d + 1) % 3, v = (d + 2) % 3;
        const PetscReal w = turn[p], q[3] = {turn[s.n + p], turn[2 * s.n + p], turn[3 * s.n + p]};

        s.rot[p]                 = w - 0.5 * by * q[d];
        s.rot[(1 + d) * s.n + p] = q[d] + 0.5 * by * w;
        s.rot[(1 + u) * s.n + p] = q[u] - 0.5 * by * q[v];
        s.rot[(1 + v) * s.n + p] = q[v] + 0.5 * by * q[u];
      }
      PetscCall(DemModelComputeForces(model));
      PetscCall(TestGetForce(model, i < 0 ? f : g));
      for (PetscInt j = 0; j < n && i >= 0; j++)
        J[i * n + j] = (g[j] - f[j]) / (h * PetscSqrtReal(s.mass[0])) / PetscSqrtReal(j < dim * s.n ? s.mass[j % s.n] : s.inertia[j % s.n]);
    }
    PetscCall(DemModelRestoreState(model, &s));
    PetscCallBLAS("LAPACKgeev", LAPACKgeev_("N", "N", &size, J, &size, re, im, NULL, &one_row, NULL, &one_row, work, &lwork, &info));
    CheckInt(info, 0);
    for (PetscInt i = 0; i < n; i++) most = PetscMax(most, PetscSqrtReal(re[i] * re[i] + im[i] * im[i]));
    print_message("           %dD: fastest mode of turned pairs %.3f of what the step bears, intact body %.3f\n", (int)dim, (double)(0.5 * dt * PetscSqrtReal(most)), (double)(dt / none));
    CheckBelow(0.5 * dt * PetscSqrtReal(most), 1);
    PetscCall(PetscFree4(base, turn, re, im));
    PetscCall(PetscFree4(J, f, g, work));
    PetscCall(DemModelDestroy(&model));
    PetscCall(DemModelDestroy(&intact));
    PetscCall(TestBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTurnedPairs)

static const struct CMUnitTest tests[] = {TEST(TestTension), TEST(TestShear), TEST(TestCompression), TEST(TestNoStrengthIsNoBond), TEST(TestNonlocalOnset), TEST(TestEnergyFallsWithDamage), TEST(TestTurnedPairs), TEST(TestRefusals)};

CHECK_MAIN(tests)
