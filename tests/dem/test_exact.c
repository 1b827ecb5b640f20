/* What the `exact` rule promises (docs/theory.md section 4): linear fields solved to round-off, rigid motion free of force, E and nu without calibration. */
#include "check.h"
#include "dem_solve.h"
#include <petscblaslapack.h>

static const PetscReal ratios[] = {0, 0.1, 0.2, 0.3, 0.45};
static const PetscReal stress3[3][3] = {{0.3, 0.2, -0.1}, {0.2, -0.4, 0.25}, {-0.1, 0.25, 1.0}};
static const char *const faces[] = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};

/* Strain of `stress` in each kind; out of plane rows are not used in 2D. */
static void Strain(DemKind kind, PetscReal young, PetscReal nu, PetscReal strain[3][3])
{
  const PetscInt dim = kind == DEM_SOLID ? 3 : 2;
  PetscReal      trace = 0;

  for (PetscInt i = 0; i < dim; i++) trace += stress3[i][i];
  if (kind == DEM_PLANE_STRAIN) trace *= 1 + nu; /* the third normal stress */
  for (PetscInt i = 0; i < dim; i++)
    for (PetscInt j = 0; j < dim; j++) strain[i][j] = ((1 + nu) * stress3[i][j] - (i == j ? nu * trace : 0)) / young;
}

/* The box under uniform traction on all its free faces, solved: error of the displacement over the largest. */
static PetscErrorCode PatchError(const TestBody *body, DemKind kind, PetscReal nu, PetscReal *error)
{
  const PetscReal young = 1e12; /* strains of 1e-12: the finite-rotation rule is then linear to 1e-12 */
  PetscReal      *x, strain[3][3], worst = 0, most = 0;
  Table           one;
  DemModel        model;
  DemState        s;

  PetscFunctionBegin;
  PetscCall(TestModelCreate(body, kind, young, nu, &model));
  PetscCall(TableCreateConstant(1, &one));
  for (PetscInt f = 0; f < 2 * body->body.dim; f++) {
    PetscReal t[3];

    for (PetscInt d = 0; d < 3; d++) t[d] = (f % 2 ? 1 : -1) * stress3[f / 2][d];
    PetscCall(DemModelAddTraction(model, faces[f], t, &one));
  }
  PetscCall(DemModelSetUp(model));
  PetscCall(PetscCalloc1(TestUnknowns(model), &x));
  PetscCall(TestEquilibrium(model, 1e-14, x, NULL));
  Strain(kind, young, nu, strain);
  PetscCall(DemModelGetState(model, &s));
  for (PetscInt p = 0; p < s.n; p++)
    for (PetscInt i = 0; i < s.dim; i++) {
      PetscReal u = 0;

      for (PetscInt j = 0; j < s.dim; j++) u += strain[i][j] * s.x0[j * s.n + p];
      most = PetscMax(most, PetscAbsReal(u));
      x[i * s.n + p] -= u;
    }
  PetscCall(DemModelRestoreState(model, &s));
  PetscCall(TestRemoveRigid(model, x));
  for (PetscInt i = 0; i < body->body.dim * body->packing.n; i++) worst = PetscMax(worst, PetscAbsReal(x[i]));
  *error = worst / most;
  PetscCall(PetscFree(x));
  PetscCall(TableDestroy(&one));
  PetscCall(DemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestSolvedPatch(void)
{
  const PetscReal size[3] = {1, 1, 1.5};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt jitter = 0; jitter < 2; jitter++) {
      TestBody body;

      PetscCall(TestBodyCreate(dim, size, dim == 3 ? 5 : 12, 0.8 * jitter, 11 + dim, &body));
      for (size_t k = 0; k < sizeof(ratios) / sizeof(*ratios); k++) {
        PetscReal error;

        PetscCall(PatchError(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRAIN, ratios[k], &error));
        CheckBelow(error, 1e-10);
        if (dim == 2) {
          PetscCall(PatchError(&body, DEM_PLANE_STRESS, ratios[k], &error));
          CheckBelow(error, 1e-10);
        }
      }
      PetscCall(TestBodyDestroy(&body));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSolvedPatch)

/* Turned as one by 100 turns about a slanted axis and carried far: no force. */
static PetscErrorCode TestHundredTurns(void)
{
  const PetscReal size[3] = {1, 1, 1}, axis[3] = {2. / 7, 3. / 7, 6. / 7}, move[3] = {0.3, -0.2, 0.5};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const PetscReal young = 3e10;
    PetscReal      *f, most = 0;
    TestBody        body;
    DemModel        model;
    DemState        s;

    PetscCall(TestBodyCreate(dim, size, dim == 3 ? 5 : 10, 0, 5, &body));
    PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRAIN, young, 0.2, &model));
    PetscCall(DemModelSetUp(model));
    PetscCall(PetscMalloc1(TestUnknowns(model), &f));
    for (PetscInt turn = 1; turn <= 1000; turn++) { /* a tenth of a turn each */
      const PetscReal angle = 0.1 * turn * 2 * PETSC_PI, c = PetscCosReal(angle), sn = PetscSinReal(angle);

      if (turn % 37 && turn < 990) continue;
      PetscCall(DemModelGetState(model, &s));
      for (PetscInt p = 0; p < s.n; p++) {
        PetscReal x[3] = {0}, dot = 0, *r = s.rot;

        for (PetscInt d = 0; d < dim; d++) x[d] = s.x0[d * s.n + p];
        if (dim == 2) {
          s.u[p]             = (c - 1) * x[0] - sn * x[1] + move[0];
          s.u[s.n + p]       = sn * x[0] + (c - 1) * x[1] + move[1];
          r[p]               = sn;
          r[s.n + p]         = -2 * PetscSqr(PetscSinReal(0.5 * angle));
          r[2 * s.n + p]     = angle;
        } else {
          for (PetscInt d = 0; d < 3; d++) dot += axis[d] * x[d];
          for (PetscInt d = 0; d < 3; d++) {
            const PetscReal cross = axis[(d + 1) % 3] * x[(d + 2) % 3] - axis[(d + 2) % 3] * x[(d + 1) % 3];

            s.u[d * s.n + p]         = (c - 1) * x[d] + sn * cross + (1 - c) * dot * axis[d] + move[d];
            r[(1 + d) * s.n + p] = PetscSinReal(0.5 * angle) * axis[d];
          }
          r[p] = PetscCosReal(0.5 * angle);
        }
      }
      PetscCall(DemModelRestoreState(model, &s));
      PetscCall(DemModelComputeForces(model));
      PetscCall(TestGetForce(model, f));
      for (PetscInt i = 0; i < dim * body.packing.n; i++) most = PetscMax(most, PetscAbsReal(f[i]));
    }
    CheckBelow(most, 1e-10 * young * PetscPowReal(1.0 / (dim == 3 ? 5 : 10), dim - 1)); /* E A, A of a mean facet */
    PetscCall(PetscFree(f));
    PetscCall(DemModelDestroy(&model));
    PetscCall(TestBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestHundredTurns)

/* Spun for 100 turns by the integrator: angular momentum stays, and the body holds together. */
static PetscErrorCode TestFreeMotion(void)
{
  const PetscReal size[3] = {1, 1, 1};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    PetscReal dt, momentum[3] = {0}, angular[3] = {0}, momentum0[3] = {0}, angular0[3] = {0}, scale = 0;
    uint64_t  seed = 3;
    TestBody  body;
    DemModel  model;
    DemState  s;
    Stepper   stepper;
    Ledger    ledger, first;

    PetscCall(TestBodyCreate(dim, size, dim == 3 ? 4 : 8, 0, 5, &body));
    PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS, 1, 0.3, &model));
    PetscCall(DemModelSetUp(model));
    PetscCall(DemModelGetCriticalStep(model, &dt));
    PetscCall(DemModelGetStepper(model, &stepper));
    PetscCall(DemModelGetState(model, &s));
    for (PetscInt p = 0; p < s.n; p++)
      for (PetscInt d = 0; d < dim; d++) s.v[d * s.n + p] = 2e-3 * (TestRandom(&seed) - 0.5);
    for (PetscInt k = 0; k <= 2000; k++) {
      if (k == 1 || k == 2000) {
        for (PetscInt d = 0; d < 3; d++) momentum[d] = angular[d] = 0;
        for (PetscInt p = 0; p < s.n; p++) {
          PetscReal x[3] = {0}, v[3] = {0};

          for (PetscInt d = 0; d < dim; d++) { /* the half step that v belongs to */
            v[d] = s.v[d * s.n + p];
            x[d] = s.x0[d * s.n + p] + s.u[d * s.n + p] - 0.5 * 0.8 * dt * v[d];
            momentum[d] += s.mass[p] * v[d];
            scale += s.mass[p] * PetscAbsReal(v[d]) / 2;
          }
          for (PetscInt d = 0; d < 3; d++) angular[d] += s.mass[p] * (x[(d + 1) % 3] * v[(d + 2) % 3] - x[(d + 2) % 3] * v[(d + 1) % 3]);
          if (dim == 2) angular[2] += s.inertia[p] * s.spin[p];
          else
            for (PetscInt d = 0; d < 3; d++) angular[d] += s.inertia[p] * s.spin[d * s.n + p];
        }
        if (k == 1) {
          for (PetscInt d = 0; d < 3; d++) {
            momentum0[d] = momentum[d];
            angular0[d]  = angular[d];
          }
          PetscCall(stepper.energy(model, &first));
        }
      }
      PetscCall(stepper.step(model, k * 0.8 * dt, 0.8 * dt));
    }
    PetscCall(DemModelRestoreState(model, &s));
    PetscCall(stepper.energy(model, &ledger));
    for (PetscInt d = 0; d < 3; d++) {
      CheckNear(momentum[d], momentum0[d], 1e-12 * scale);
      CheckNear(angular[d], angular0[d], 1e-10 * scale);
    }
    /* Rotations make it non-linear: energy is bounded, not exact. */
    CheckClose(ledger.energy[LEDGER_KINETIC] + ledger.energy[LEDGER_STRAIN], first.energy[LEDGER_KINETIC] + first.energy[LEDGER_STRAIN], 2e-3);
    PetscCall(DemModelDestroy(&model));
    PetscCall(TestBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFreeMotion)

/* Dense stiffness by unit motions; its eigenvalues count the free motions, and bound the step. */
static PetscErrorCode TestZeroModesAndStep(void)
{
  const PetscReal size[3] = {1, 1, 1};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt c = 0; c < 3; c++) {
      const PetscReal nu = c == 0 ? -0.5 : c == 1 ? 0.2 : 0.499;
      PetscReal      *K, *x, *f, *w, *work, dt, bound;
      PetscInt        zero = 0;
      TestBody        body;
      DemModel        model;
      DemState        s;
      PetscBLASInt    size_k, lwork, info;

      PetscCall(TestBodyCreate(dim, size, dim == 3 ? 4 : 9, c == 2 ? 0.8 : 0, 5, &body));
      PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRAIN, 1, nu, &model));
      PetscCall(DemModelSetUp(model));
      const PetscInt n = TestUnknowns(model);

      size_k = (PetscBLASInt)n;
      lwork  = 40 * size_k;
      PetscCall(PetscCalloc5(n * n, &K, n, &x, n, &f, n, &w, lwork, &work));
      PetscCall(DemModelGetState(model, &s));
      for (PetscInt i = 0; i < n; i++) {
        const PetscReal mi = i < dim * s.n ? s.mass[i % s.n] : s.inertia[i % s.n];

        x[i] = 1e-14 / PetscSqrtReal(mi);
        PetscCall(TestSetState(model, x));
        PetscCall(TestGetForce(model, f));
        x[i] = 0;
        for (PetscInt j = 0; j < n; j++) K[i * n + j] = -f[j] * 1e14 / PetscSqrtReal(j < dim * s.n ? s.mass[j % s.n] : s.inertia[j % s.n]);
      }
      PetscCall(TestSetState(model, x));
      PetscCall(DemModelRestoreState(model, &s));
      for (PetscInt i = 0; i < n; i++)
        for (PetscInt j = 0; j < i; j++) CheckNear(K[i * n + j], K[j * n + i], 1e-9 * PetscAbsReal(K[i * n + i])); /* symmetric: forces come from an energy */
      PetscCallBLAS("LAPACKsyev", LAPACKsyev_("N", "U", &size_k, K, &size_k, w, work, &lwork, &info));
      CheckInt(info, 0);
      for (PetscInt i = 0; i < n; i++) {
        CheckAbove(w[i], -1e-9 * w[n - 1]);
        zero += PetscAbsReal(w[i]) < 1e-9 * w[n - 1];
      }
      CheckInt(zero, dim == 3 ? 6 : 3);
      PetscCall(DemModelGetCriticalStep(model, &dt));
      CheckClose(dt, 2 / PetscSqrtReal(w[n - 1]), 0.01);
      PetscCall(DemModelGetStableStep(model, &bound));
      CheckBelow(bound, 2 / PetscSqrtReal(w[n - 1]) * (1 + 1e-12));
      if (nu == 0.2) CheckAbove(bound, 0.5 * dt);
      PetscCall(PetscFree5(K, x, f, w, work));
      PetscCall(DemModelDestroy(&model));
      PetscCall(TestBodyDestroy(&body));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestZeroModesAndStep)

/* Force and couple are minus the gradient of the energy, at finite gaps, with every kind of boundary facet. */
static PetscErrorCode TestForceIsGradient(void)
{
  const PetscReal size[3] = {1, 1, 1}, pull[3] = {0.02, 0.01, -0.03};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    PetscReal *x, *f, h = 1e-5;
    uint64_t   seed = 9;
    TestBody   body;
    DemModel   model;
    DemState   s;
    Stepper    stepper;
    Table      shift, one;

    PetscCall(TestBodyCreate(dim, size, dim == 3 ? 3 : 5, 0.8, 5, &body));
    PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRAIN, 1, 0.3, &model));
    PetscCall(TableCreateConstant(0.05, &shift));
    PetscCall(TableCreateConstant(1, &one));
    for (PetscInt d = 0; d < dim; d++) PetscCall(DemModelFix(model, "xmin", d, DEM_DISPLACEMENT, &shift));
    PetscCall(DemModelFix(model, "ymax", 1, DEM_DISPLACEMENT, &shift));
    PetscCall(DemModelAddTraction(model, "xmax", pull, &one));
    PetscCall(DemModelSetUp(model));
    PetscCall(DemModelGetStepper(model, &stepper));
    const PetscInt n = TestUnknowns(model);

    PetscCall(PetscCalloc2(n, &x, n, &f));
    PetscCall(DemModelGetState(model, &s));
    for (PetscInt i = 0; i < n; i++) x[i] = i < dim * s.n ? 0.1 * (TestRandom(&seed) - 0.5) : 0;
    for (PetscInt i = 0; i < n; i += 7) { /* translations, then turns about each axis */
      Ledger    plus, minus;
      PetscReal keep = x[i], potential = 0;

      x[i] = keep + h;
      PetscCall(TestSetState(model, x));
      PetscCall(stepper.energy(model, &plus));
      for (PetscInt k = 0; k < body.cells.n_walls; k++)
        if (body.cells.wall_face[k] == 1) /* xmax: potential of the dead traction */
          for (PetscInt p = 0; p < s.n; p++)
            if (s.number[p] == body.cells.wall_p[k]) {
              PetscReal a[3] = {0};

              for (PetscInt d = 0; d < dim; d++) a[d] = body.cells.wall_at[3 * k + d] - body.packing.x[3 * body.cells.wall_p[k] + d];
              for (PetscInt side = 0; side < 2; side++) {
                const PetscReal sign = side ? -1 : 1, v = keep + sign * h, ang = i >= dim * s.n && i % s.n == p ? v : 0;
                const PetscInt  ax = dim == 2 ? 2 : i / s.n - 3;
                PetscReal       r[3] = {a[0], a[1], a[2]};

                if (i >= dim * s.n && i % s.n == p) { /* rotation about one axis */
                  const PetscInt  b = (ax + 1) % 3, c = (ax + 2) % 3;
                  const PetscReal rb = r[b], rc = r[c];

                  r[b] = PetscCosReal(ang) * rb - PetscSinReal(ang) * rc;
                  r[c] = PetscSinReal(ang) * rb + PetscCosReal(ang) * rc;
                }
                for (PetscInt d = 0; d < dim; d++) {
                  const PetscReal ud = i == d * s.n + p ? v : 0;

                  potential -= sign * body.cells.wall_area[k] * pull[d] * (ud + r[d]);
                }
              }
            }
      x[i] = keep - h;
      PetscCall(TestSetState(model, x));
      PetscCall(stepper.energy(model, &minus));
      x[i] = keep;
      PetscCall(TestSetState(model, x));
      PetscCall(TestGetForce(model, f));
      CheckNear(f[i], -(plus.energy[LEDGER_STRAIN] - minus.energy[LEDGER_STRAIN] + potential) / (2 * h), 2e-8);
    }
    PetscCall(DemModelRestoreState(model, &s));
    PetscCall(PetscFree2(x, f));
    PetscCall(TableDestroy(&shift));
    PetscCall(TableDestroy(&one));
    PetscCall(DemModelDestroy(&model));
    PetscCall(TestBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestForceIsGradient)

/* E from the reaction of smooth platens, nu from the sideways strain of the particles, no calibration. */
static PetscErrorCode TestPlatens(void)
{
  const PetscReal size[3] = {1, 1, 1.5};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(ratios) / sizeof(*ratios); k++) {
    const PetscReal shorten = 1e-12;
    PetscReal      *x, value, slope[3];
    TestBody        body;
    DemModel        model;
    DemState        s;
    Stepper         stepper;
    Table           none, shift;

    PetscCall(TestBodyCreate(3, size, 5, 0, 17, &body));
    PetscCall(TestModelCreate(&body, DEM_SOLID, 1, ratios[k], &model));
    PetscCall(TableCreateConstant(0, &none));
    PetscCall(TableCreateConstant(-shorten, &shift));
    PetscCall(DemModelFix(model, "zmin", 2, DEM_DISPLACEMENT, &none));
    PetscCall(DemModelFix(model, "zmax", 2, DEM_DISPLACEMENT, &shift));
    PetscCall(DemModelAddHistory(model, "reaction", "zmax"));
    PetscCall(DemModelSetUp(model));
    PetscCall(DemModelGetStepper(model, &stepper));
    PetscCall(PetscCalloc1(TestUnknowns(model), &x));
    PetscCall(TestEquilibrium(model, 1e-13, x, NULL));
    PetscCall(stepper.history(model, 2, &value));
    CheckClose(-value / (size[0] * size[1]) / (shorten / size[2]), 1, 1e-8);
    PetscCall(DemModelGetState(model, &s));
    for (PetscInt d = 0; d < 3; d++) { /* least squares of u_d on x_d */
      PetscReal mx = 0, mu = 0, xx = 0, xu = 0;

      for (PetscInt p = 0; p < s.n; p++) {
        mx += s.x0[d * s.n + p] / s.n;
        mu += s.u[d * s.n + p] / s.n;
      }
      for (PetscInt p = 0; p < s.n; p++) {
        xx += PetscSqr(s.x0[d * s.n + p] - mx);
        xu += (s.x0[d * s.n + p] - mx) * (s.u[d * s.n + p] - mu);
      }
      slope[d] = xu / xx;
    }
    PetscCall(DemModelRestoreState(model, &s));
    CheckNear(-0.5 * (slope[0] + slope[1]) / slope[2], ratios[k], 1e-8);
    PetscCall(PetscFree(x));
    PetscCall(TableDestroy(&none));
    PetscCall(TableDestroy(&shift));
    PetscCall(DemModelDestroy(&model));
    PetscCall(TestBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPlatens)

static const struct CMUnitTest tests[] = {TEST(TestSolvedPatch), TEST(TestHundredTurns), TEST(TestFreeMotion), TEST(TestZeroModesAndStep), TEST(TestForceIsGradient), TEST(TestPlatens)};

CHECK_MAIN(tests)
