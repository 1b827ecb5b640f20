/* What a broken facet still does: unloading, closing, friction, shear, turning.  docs/theory.md (4.20)-(4.28) */
#include "check.h"
#include "dem_impl.h" /* to leave single facets to their law */
#include "dem_solve.h"

/* Two equal cells of edge h along x with one facet between them; the state is set, not moved: no dynamics in between. */
typedef struct {
  TestBody  body;
  DemModel  model;
  DemState  st;
  Stepper   stepper;
  PetscInt  dim, left, right;
  PetscReal h, A, young, G;
  PetscReal gap[3], force[3]; /* of the right cell against the left [m]; on the right cell [N] */
  PetscReal work;             /* put in from outside [J] */
} Pair;

#define YOUNG 37e9

/* radius, over h: that of both spheres; meet: NULL, or how they touch when no bond joins them. */
static PetscErrorCode PairCreateMeeting(PetscInt dim, PetscReal poisson, PetscReal h, const DemStrength *s, PetscReal radius, const DemContactOptions *meet, Pair *p)
{
  const PetscReal low[3] = {0}, size[3] = {2 * h, h, h};

  PetscFunctionBegin;
  PetscCall(PetscMemzero(p, sizeof(*p)));
  p->dim   = dim;
  p->h     = h;
  p->A     = dim == 3 ? h * h : h;
  p->young = YOUNG;
  p->G     = YOUNG / (2 * (1 + poisson));
  PetscCall(DemBodyCreateBox(dim, low, size, 1, &p->body.body));
  p->body.packing.n = 2;
  PetscCall(PetscCalloc1(6, &p->body.packing.x));
  PetscCall(PetscMalloc1(2, &p->body.packing.r));
  for (PetscInt k = 0; k < 2; k++) {
    p->body.packing.r[k]     = radius * h;
    p->body.packing.x[3 * k] = (k + 0.5) * h;
    for (PetscInt d = 1; d < dim; d++) p->body.packing.x[3 * k + d] = 0.5 * h;
  }
  PetscCall(DemCellsCreate(&p->body.body, &p->body.packing, &p->body.cells));
  PetscCall(TestModelCreate(&p->body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS, YOUNG, poisson, &p->model));
  PetscCall(DemModelSetStrength(p->model, s));
  if (meet) PetscCall(DemModelSetContact(p->model, meet));
  PetscCall(DemModelSetUp(p->model));
  PetscCall(DemModelGetStepper(p->model, &p->stepper));
  PetscCall(DemModelGetState(p->model, &p->st));
  p->right = p->st.number[0] == 1 ? 0 : 1;
  p->left  = 1 - p->right;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PairCreate(PetscInt dim, PetscReal poisson, PetscReal h, const DemStrength *s, Pair *p)
{
  return PairCreateMeeting(dim, poisson, h, s, 0.5, NULL, p);
}

static PetscErrorCode PairDestroy(Pair *p)
{
  PetscFunctionBegin;
  PetscCall(DemModelRestoreState(p->model, &p->st));
  PetscCall(DemModelDestroy(&p->model));
  PetscCall(TestBodyDestroy(&p->body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A step of no length: forces and damage of the state as it is set. */
static PetscErrorCode PairAdvance(Pair *p)
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < 2 * 3; i++) p->st.v[i] = p->st.spin[i % (p->dim == 3 ? 6 : 2)] = 0;
  PetscCall(p->stepper.step(p->model, 0, 1e-300));
  PetscCall(DemModelGetState(p->model, &p->st));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Right cell moved to gap (x opens, y slides) against the left. */
static PetscErrorCode PairSet(Pair *p, PetscReal x, PetscReal y)
{
  const PetscReal gap[3] = {x, y, 0};

  PetscFunctionBegin;
  for (PetscInt d = 0; d < 3; d++) p->st.u[2 * d + p->right] = gap[d];
  PetscCall(PairAdvance(p));
  for (PetscInt d = 0; d < 3; d++) {
    const PetscReal f = p->st.f[2 * d + p->right];

    p->work -= 0.5 * (f + p->force[d]) * (gap[d] - p->gap[d]);
    p->force[d] = f;
    p->gap[d]   = gap[d];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same in n equal steps. */
static PetscErrorCode PairMove(Pair *p, PetscInt n, PetscReal x, PetscReal y)
{
  const PetscReal x0 = p->gap[0], y0 = p->gap[1];

  PetscFunctionBegin;
  for (PetscInt i = 1; i <= n; i++) PetscCall(PairSet(p, i == n ? x : x0 + (x - x0) * i / n, i == n ? y : y0 + (y - y0) * i / n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PairEnergy(Pair *p, PetscReal *strain, PetscReal *fracture, PetscReal *friction)
{
  Ledger ledger;

  PetscFunctionBegin;
  PetscCall(p->stepper.energy(p->model, &ledger));
  *strain   = ledger.energy[LEDGER_STRAIN];
  *fracture = ledger.energy[LEDGER_FRACTURE];
  *friction = ledger.energy[LEDGER_FRICTION];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const DemStrength tension[] = {
  {.tensile = 3.9e6, .fracture_energy = 143, .softening = DEM_SOFTENING_LINEAR, .mu_static = 0.6, .mu_dynamic = 0.4},
  {.tensile = 3.9e6, .fracture_energy = 143, .softening = DEM_SOFTENING_BILINEAR, .knee_stress = 0.25, .knee_opening = 0.75, .mu_static = 0.6, .mu_dynamic = 0.4},
  {.tensile = 3.9e6, .fracture_energy = 143, .softening = DEM_SOFTENING_EXPONENTIAL, .mu_static = 0.6, .mu_dynamic = 0.4},
};

/* Drawn half-way, let back and drawn again: secant both ways, nothing dissipated on it, then the curve. */
static PetscErrorCode TestSecant(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (int c = 0; c < 3; c++) {
      const DemStrength *s = &tension[c];
      const PetscReal    h = 0.2 * DemSofteningLongest(s, YOUNG / 2), w = 0.3 * s->fracture_energy / s->tensile, t = DemSofteningStress(s, w), far = w + t * h / YOUNG;
      const PetscReal    w2 = 1.5 * w, t2 = DemSofteningStress(s, w2);
      PetscReal          strain = 0, lost = 0, again = 0, rub = 0;
      Pair               p;

      PetscCall(PairCreate(dim, 0, h, s, &p));
      PetscCall(PairMove(&p, 4000, far, 0));
      CheckNear(-p.force[0] / p.A, t, 1e-6 * s->tensile);
      PetscCall(PairEnergy(&p, &strain, &lost, &rub));
      CheckClose(strain, 0.5 * t * far * p.A, 1e-6); /* unloading gives back the triangle under the secant */
      for (int way = 0; way < 2; way++)
        for (PetscInt i = 1; i <= 100; i++) {
          const PetscReal part = way ? i / 100. : 1 - i / 100.;

          PetscCall(PairSet(&p, part * far, 0));
          CheckNear(-p.force[0] / p.A, part * t, 1e-6 * s->tensile);
          PetscCall(PairEnergy(&p, &strain, &again, &rub));
          CheckNear(again, lost, 0);
          CheckNear(strain, 0.5 * part * part * t * far * p.A, 1e-6 * 0.5 * t * far * p.A);
        }
      PetscCall(PairMove(&p, 4000, w2 + t2 * h / YOUNG, 0)); /* on along the curve */
      CheckNear(-p.force[0] / p.A, t2, 1e-6 * s->tensile);
      PetscCall(PairEnergy(&p, &strain, &again, &rub));
      CheckAbove(again, 1.01 * lost);
      CheckClose(again + strain, p.work, 1e-6);
      CheckNear(rub, 0, 0);
      PetscCall(PairDestroy(&p));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSecant)

/* Drawn until nothing is left (the exponential: until 1e-9 is), it stands at (far, 0). */
static PetscErrorCode PairBreak(PetscInt dim, PetscReal poisson, const DemStrength *s, Pair *p)
{
  const PetscReal h = 0.2 * DemSofteningLongest(s, YOUNG / 2), w0 = s->fracture_energy / s->tensile;

  PetscFunctionBegin;
  PetscCall(PairCreate(dim, poisson, h, s, p));
  PetscCall(PairMove(p, 8000, s->softening == DEM_SOFTENING_EXPONENTIAL ? 25 * w0 : 1.2 * DemSofteningEnd(s), 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Broken, pressed shut it is as stiff as an intact one (nu = 0); drawn again it carries nothing. */
static PetscErrorCode TestPressedShut(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (int c = 0; c < 3; c++) {
      PetscReal   strain = 0, lost = 0, rub = 0;
      Pair        p;
      DemBondList list;

      PetscCall(PairBreak(dim, 0, &tension[c], &p));
      CheckNear(p.force[0], 0, 1e-9 * tension[c].tensile * p.A);
      PetscCall(PairMove(&p, 100, 0, 0));
      CheckNear(p.force[0], 0, 1e-12 * tension[c].tensile * p.A);
      for (PetscInt round = 0; round < 2; round++) {
        for (PetscInt i = 1; i <= 20; i++) {
          PetscCall(PairSet(&p, -1e-7 * i, 0));
          CheckClose(p.force[0], YOUNG / p.h * p.A * 1e-7 * i, 1e-9);
          PetscCall(DemModelGetBonds(p.model, &list)); /* what is written out knows of it too */
          CheckClose(list.sigma[0], -YOUNG / p.h * 1e-7 * i, 1e-9);
        }
        PetscCall(PairEnergy(&p, &strain, &lost, &rub));
        CheckClose(strain, 0.5 * YOUNG / p.h * p.A * 4e-12, 1e-9);
        CheckNear(rub, 0, 0);
        PetscCall(PairMove(&p, 20, 0, 0));
        PetscCall(PairSet(&p, 2e-5, 0));
        CheckNear(p.force[0], 0, 1e-9 * tension[c].tensile * p.A);
      }
      CheckClose(lost, 143 * p.A, 2e-5); /* trapezoid steps; G_f itself: TestOneFacet of test_failure */
      PetscCall(PairDestroy(&p));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPressedShut)

/* What is left of the facet, slid by y at most.  Eq. (4.82) */
static PetscReal Facing(const Pair *p, PetscReal y)
{
  return PetscMax(0, 1 - y / p->h);
}

/* Closed and sheared to and fro: Coulomb's limit, friction booked as force x slip, the loop's area. */
static PetscErrorCode TestFriction(void)
{
  const DemStrength *s = &tension[0];

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const PetscReal press = 1e-6, elastic = s->mu_dynamic * press, amplitude = 5 * elastic;
    PetscReal       strain = 0, lost = 0, rub = 0, limit, before = 0, booked = 0;
    Pair            p;

    PetscCall(PairBreak(dim, 0, s, &p));
    PetscCall(PairMove(&p, 10, -press, 0));
    limit = s->mu_dynamic * p.force[0];
    CheckClose(limit, s->mu_dynamic * YOUNG / p.h * p.A * press, 1e-9);
    p.work = 0;
    PetscCall(PairEnergy(&p, &before, &lost, &rub));
    CheckNear(rub, 0, 0);
    for (PetscInt i = 1; i <= 50; i++) { /* ten steps of sticking, then slip */
      const PetscReal y = i * elastic / 10, stuck = PetscMin(y, elastic);

      PetscCall(PairSet(&p, -press, y));
      CheckClose(-p.force[1], PetscMin(i / 10., 1) * limit * Facing(&p, y), 1e-9);
      CheckBelow(PetscAbsReal(p.force[1]), s->mu_dynamic * p.force[0] * (1 + 1e-12));
      booked += (i > 10 ? limit * Facing(&p, y) * elastic / 10 : 0) + 0.5 * YOUNG / p.h * p.A * (press * press + stuck * stuck) * elastic / 10 / p.h;
    }
    PetscCall(PairEnergy(&p, &strain, &lost, &rub));
    CheckClose(rub, booked, 1e-6);
    CheckClose(strain - before + rub, p.work, 1e-6);
    p.work = 0;
    before = rub;
    limit *= Facing(&p, amplitude);
    PetscCall(PairMove(&p, 100, -press, -amplitude));
    CheckClose(p.force[1], limit, 1e-9);
    PetscCall(PairMove(&p, 100, -press, amplitude));
    PetscCall(PairEnergy(&p, &strain, &lost, &rub));
    CheckClose(rub - before, 4 * limit * (amplitude - elastic), 1e-6); /* the loop: a parallelogram */
    CheckClose(p.work, rub - before, 1e-6);
    CheckClose(lost, 143 * p.A, 2e-5); /* nothing more broke */
    PetscCall(PairDestroy(&p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFriction)

/*
  Shear until it is broken, the facet held shut by a constant gap.  Eq. (4.25)

  r = 1/(1 - cD), c = 1 - tau_f d/(2G w_s); the gap slides to d/2G (tau_f r + M), M = mu_static |t_n|, and with a broken part
  that slips freely the facet gives up G A/d gap^2 per D: A d/4G [tau_f^2/(1-c) - 2 tau_f M ln(1-c)/c + M^2]. M = 0: G_II A.
*/
static PetscErrorCode TestShear(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (int closed = 0; closed < 2; closed++)
      for (int rough = 0; rough < 2; rough++) {
        const DemStrength s = {.shear = 8e6, .shear_energy = 400, .mu_static = 0.6, .mu_dynamic = rough ? 0.6 : 0};
        const PetscReal   G = YOUNG / 2, h = 0.25 * DemShearLongest(&s, G), ws = 2 * s.shear_energy / s.shear, c = 1 - s.shear * h / (2 * G * ws);
        const PetscReal   press = closed ? 0.3 * s.shear / YOUNG * h : 0, M = s.mu_static * YOUNG / h * press;
        const PetscReal   end = h / (2 * G) * (s.shear / (1 - c) + M);
        const PetscInt    n = 20000;
        PetscReal         strain = 0, lost = 0, rub = 0, worst = 0, before = 0;
        Pair              p;

        PetscCall(PairCreate(dim, 0, h, &s, &p));
        PetscCall(PairMove(&p, 20, -press, 0));
        PetscCall(PairEnergy(&p, &before, &lost, &rub));
        p.work = 0;
        for (PetscInt i = 1; i <= n; i++) {
          const PetscReal y = 1.1 * end * i / n, total = 2 * G / h * y, r = (total - M) / s.shear, D = r <= 1 ? 0 : PetscMin(1, (1 - 1 / r) / c);

          PetscCall(PairSet(&p, -press, y));
          if (!rough) worst = PetscMax(worst, PetscAbsReal(-p.force[1] / p.A - (1 - D) * total) / s.shear);
        }
        PetscCall(PairEnergy(&p, &strain, &lost, &rub));
        print_message("           %dD %s, mu_dynamic %.1f: fracture %.6f of closed form, friction %.4f, balance %.1e\n", (int)dim, closed ? "pressed" : "open", (double)s.mu_dynamic,
                      (double)(lost / (p.A * h / (4 * G) * (s.shear * s.shear / (1 - c) - 2 * s.shear * M * PetscLogReal(1 - c) / c + M * M))), (double)(rub / (s.shear_energy * p.A)),
                      (double)((strain - before + lost + rub) / p.work - 1));
        CheckBelow(worst, 1e-6);
        CheckClose(strain - before + lost + rub, p.work, closed && rough ? 1e-5 : 1e-6);
        if (!rough || !closed) {
          CheckClose(lost, p.A * h / (4 * G) * (s.shear * s.shear / (1 - c) - 2 * s.shear * M * PetscLogReal(1 - c) / c + M * M), 1e-5);
          CheckClose(rub, 0.5 * YOUNG / h * p.A * press * press * 1.1 * end / h, 1e-9); /* what slid past the rim lets go */
          CheckNear(p.force[1], 0, 1e-9 * s.shear * p.A);
        } else {
          CheckClose(-p.force[1], M * p.A * Facing(&p, 1.1 * end), 1e-9); /* what is left is friction */
          CheckPositive(rub);
        }
        if (!closed) CheckClose(lost, s.shear_energy * p.A, 1e-5);
        PetscCall(PairDestroy(&p));
      }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestShear)

/* Broken, slid apart while open, then let touch: no force at first touch, a normal one after it, friction from there. */
static PetscErrorCode TestFreshTouch(void)
{
  const DemStrength *s = &tension[0];

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const PetscReal slid = 3e-5;
    Pair            p;

    PetscCall(PairBreak(dim, 0, s, &p));
    PetscCall(PairMove(&p, 50, p.gap[0], slid));
    PetscCall(PairMove(&p, 50, 1e-9, slid));
    for (PetscInt d = 0; d < 3; d++) CheckNear(p.force[d], 0, 0);
    PetscCall(PairSet(&p, 0, slid));
    for (PetscInt d = 0; d < 3; d++) CheckNear(p.force[d], 0, 0);
    PetscCall(PairSet(&p, -1e-8, slid));
    CheckClose(p.force[0], YOUNG / p.h * p.A * 1e-8 * Facing(&p, slid), 1e-9);
    CheckNear(p.force[1], 0, 1e-9 * p.force[0]);
    PetscCall(PairSet(&p, -1e-8, slid + 1e-9)); /* sticks */
    CheckClose(-p.force[1], YOUNG / p.h * p.A * 1e-9 * Facing(&p, slid), 1e-6);
    PetscCall(PairDestroy(&p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFreshTouch)

/* Cell i at displacement u, turned by the angle about z. */
static void PairPlace(Pair *p, PetscInt i, const PetscReal u[3], PetscReal angle)
{
  for (PetscInt d = 0; d < 3; d++) p->st.u[2 * d + i] = u[d];
  if (p->dim == 2) {
    p->st.rot[i]     = PetscSinReal(angle);
    p->st.rot[2 + i] = -2 * PetscSqr(PetscSinReal(0.5 * angle));
    p->st.rot[4 + i] = angle;
  } else {
    p->st.rot[i]     = PetscCosReal(0.5 * angle);
    p->st.rot[2 + i] = p->st.rot[4 + i] = 0;
    p->st.rot[6 + i] = PetscSinReal(0.5 * angle);
  }
}

static PetscErrorCode CheckPairMomentum(const Pair *p)
{
  PetscReal sum[3] = {0}, couple = 0, scale = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < 2; i++) {
    const PetscReal x = p->st.x0[i] + p->st.u[i], y = p->st.x0[2 + i] + p->st.u[2 + i];

    for (PetscInt d = 0; d < 3; d++) {
      sum[d] += p->st.f[2 * d + i];
      scale += PetscAbsReal(p->st.f[2 * d + i]);
    }
    couple += x * p->st.f[2 + i] - y * p->st.f[i] + p->st.torque[(p->dim == 3 ? 4 : 0) + i];
  }
  CheckPositive(scale);
  for (PetscInt d = 0; d < 3; d++) CheckNear(sum[d], 0, 1e-14 * scale);
  CheckNear(couple, 0, 1e-13 * scale * p->h);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A facet broken, closed, pressed, slipped and bent, then turned by a right angle in space: the same forces, turned; momentum exact; no new damage or slip. */
static PetscErrorCode TestTurned(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (int half = 0; half < 2; half++) { /* fully broken, or with half of it intact */
      const DemStrength *s = &tension[0];
      const PetscReal    h = 0.2 * DemSofteningLongest(s, YOUNG / 2), quarter = 0.5 * PETSC_PI, bend = 2e-4, squeeze = 1e-6;
      PetscReal          f[6], t[2], strain[2] = {0}, lost[2] = {0}, rub[2] = {0}, u[2][3], zero[3] = {0};
      Pair               p;

      PetscCall(PairCreate(dim, 0.2, h, s, &p));
      PetscCall(PairMove(&p, 4000, (half ? 0.4 : 1.2) * DemSofteningEnd(s), 0));
      PetscCall(PairMove(&p, 50, -squeeze, 0));
      PetscCall(PairMove(&p, 50, -squeeze, 4 * squeeze));
      {
        const PetscReal bent[3] = {-squeeze, 4 * squeeze, 0};

        PairPlace(&p, p.right, bent, 0.01 * bend);
        PairPlace(&p, p.left, zero, 0);
        for (int again = 0; again < 3; again++) PetscCall(PairAdvance(&p)); /* slip comes to rest */
      }
      PetscCall(CheckPairMomentum(&p));
      PetscCall(PairEnergy(&p, &strain[0], &lost[0], &rub[0]));
      CheckPositive(rub[0]);
      for (PetscInt i = 0; i < 2; i++) {
        for (PetscInt d = 0; d < 3; d++) f[2 * d + i] = p.st.f[2 * d + i];
        t[i] = p.st.torque[(dim == 3 ? 4 : 0) + i];
      }
      for (PetscInt i = 0; i < 2; i++) { /* x -> (-y, x) about the origin */
        const PetscReal x = p.st.x0[i] + p.st.u[i], y = p.st.x0[2 + i] + p.st.u[2 + i];

        u[i][0] = -y - p.st.x0[i];
        u[i][1] = x - p.st.x0[2 + i];
        u[i][2] = 0;
      }
      PairPlace(&p, p.left, u[p.left], quarter);
      PairPlace(&p, p.right, u[p.right], quarter + 0.01 * bend);
      PetscCall(PairAdvance(&p));
      for (PetscInt i = 0; i < 2; i++) {
        const PetscReal scale = PetscAbsReal(f[0]) + PetscAbsReal(f[2]);

        CheckNear(p.st.f[i], -f[2 + i], 1e-8 * scale);
        CheckNear(p.st.f[2 + i], f[i], 1e-8 * scale);
        CheckNear(p.st.torque[(dim == 3 ? 4 : 0) + i], t[i], 1e-8 * scale * h);
      }
      PetscCall(CheckPairMomentum(&p));
      PetscCall(PairEnergy(&p, &strain[1], &lost[1], &rub[1]));
      CheckClose(strain[1], strain[0], 1e-8);
      CheckClose(lost[1], lost[0], 1e-12);
      CheckClose(rub[1], rub[0], 1e-9);
      PetscCall(PairDestroy(&p));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTurned)

/* Whole broken, without friction, slid by a third of its width and its cells turned against each other by ten degrees: the couples and forces are the energy's slopes. */
static PetscErrorCode TestSlidIsConservative(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    DemStrength     s = tension[0];
    const PetscReal h = 0.2 * DemSofteningLongest(&s, YOUNG / 2), step = 1e-6;
    Pair            p;

    s.mu_static = s.mu_dynamic = 0;
    PetscCall(PairBreak(dim, 0, &s, &p));
    { /* further first: what that has taken off the facet is gone, and is the same for all that follows */
      const PetscReal zero[3] = {0}, far[3] = {-0.15 * h, 0.4 * h, 0};

      PairPlace(&p, p.left, zero, 0.07);
      PairPlace(&p, p.right, far, -0.14);
      PetscCall(PairAdvance(&p));
    }
    for (int row = 0; row < 4; row++) { /* turn of the left, of the right, x and y of the right */
      const PetscReal small = row < 2 ? step : step * h;
      PetscReal       energy[2], lost, rub, found = 0;

      for (int side = 0; side < 3; side++) { /* below, above, at the place */
        const PetscReal off = side == 2 ? 0 : side ? small : -small;
        const PetscReal zero[3] = {0}, moved[3] = {-0.15 * h + (row == 2 ? off : 0), 0.33 * h + (row == 3 ? off : 0), 0};

        PairPlace(&p, p.left, zero, 0.05 + (row == 0 ? off : 0));
        PairPlace(&p, p.right, moved, -0.12 + (row == 1 ? off : 0));
        PetscCall(PairAdvance(&p));
        PetscCall(PairEnergy(&p, &energy[side % 2], &lost, &rub));
        if (side == 1) found = (energy[1] - energy[0]) / (2 * small);
      }
      CheckAbove(energy[0], 1e-6 * YOUNG * h * (dim == 3 ? h * h : h)); /* it is pressed */
      CheckClose(row < 2 ? p.st.torque[(dim == 3 ? 4 : 0) + (row ? p.right : p.left)] : p.st.f[2 * (row - 2) + p.right], -found, 1e-6);
    }
    PetscCall(CheckPairMomentum(&p));
    PetscCall(PairDestroy(&p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSlidIsConservative)

/* Largest eigenvalue of M^-1 K of a pair of square cells of mass 1 where it stands, the left one turned by angle, K from differences of the forces. */
static PetscErrorCode PairFastest(Pair *p, PetscReal angle, PetscReal *fastest)
{
  const PetscReal small = 1e-9 * p->h, gap = p->gap[0], slide = p->gap[1], root = PetscSqrtReal(6) / p->h; /* of 1/(moment of inertia) */
  PetscReal       K[6][6], x[6] = {1, 2, 3, -2, 1, 2}, y[6], norm = 0;

  PetscFunctionBegin;
  for (int j = 0; j < 6; j++)
    for (int side = 0; side < 2; side++) {
      PetscReal u[2][3] = {{0}, {gap, slide, 0}}, turn[2] = {angle, 0}, off = side ? small : -small;

      if (j % 3 == 2) turn[j / 3] += off * root; /* of mass-weighted motions */
      else u[j / 3][j % 3] += off;
      PairPlace(p, p->left, u[0], turn[0]);
      PairPlace(p, p->right, u[1], turn[1]);
      PetscCall(PairAdvance(p));
      for (int i = 0; i < 6; i++) {
        const PetscInt  who = i < 3 ? p->left : p->right;
        const PetscReal f = i % 3 == 2 ? p->st.torque[(p->dim == 3 ? 4 : 0) + who] * root : p->st.f[2 * (i % 3) + who];

        K[i][j] = (side ? K[i][j] : 0) - (side ? 1 : -1) * f / (2 * small);
      }
    }
  for (int it = 0; it < 500; it++) {
    norm = 0;
    for (int i = 0; i < 6; i++) {
      y[i] = 0;
      for (int j = 0; j < 6; j++) y[i] += K[i][j] * x[j];
      norm += y[i] * y[i];
    }
    norm = PetscSqrtReal(norm);
    if (norm == 0) break;
    for (int i = 0; i < 6; i++) x[i] = y[i] / norm;
  }
  *fastest = norm;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* However far it has slid or turned, sticking and pressed, a broken facet makes its pair no faster than the intact one does, so the body's critical step holds. */
static PetscErrorCode TestSlidNoFaster(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const DemStrength *s = &tension[0];
    const PetscReal    h = 0.2 * DemSofteningLongest(s, YOUNG / 2), press = 1e-5 * h;
    PetscReal          whole, now, last;
    Pair               p;

    PetscCall(PairCreate(dim, 0, h, s, &p));
    PetscCall(PairFastest(&p, 0, &whole));
    CheckClose(whole, 5 * YOUNG / h * p.A, 1e-5); /* shear: two masses, two cells that turn */
    PetscCall(PairDestroy(&p));
    PetscCall(PairBreak(dim, 0, s, &p));
    PetscCall(PairMove(&p, 100, -press, 0));
    last = whole * (1 + 1e-3); /* the squeeze's own geometric stiffness */
    for (PetscInt i = 0; i < 10; i++) {
      PetscCall(PairSet(&p, -press, 0.1 * i * h));
      PetscCall(PairSet(&p, -press, 0.1 * i * h - 0.5 * s->mu_dynamic * press)); /* back to where it sticks */
      PetscCall(PairFastest(&p, 0, &now));
      CheckBelow(now, last);
      last = now;
    }
    PetscCall(PairDestroy(&p));
    PetscCall(PairBreak(dim, 0, s, &p));
    PetscCall(PairMove(&p, 100, -press, 0));
    for (PetscInt i = 1; i <= 19; i++) { /* on its edge: the push grows with the turn, and the spring goes */
      const PetscReal angle = i * PETSC_PI / 36, zero[3] = {0}, shut[3] = {-press, 0, 0};

      PairPlace(&p, p.left, zero, angle);
      PairPlace(&p, p.right, shut, 0);
      PetscCall(PairAdvance(&p));
      PetscCall(PairFastest(&p, angle, &now));
      CheckBelow(now, whole);
    }
    CheckNear(now, 0, 1e-12 * whole);
    PetscCall(PairDestroy(&p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSlidNoFaster)

/* Slid on, ever less of it faces the other, and what the rest held stands under friction; past its width no force is left, and it stays so when the pair comes back. */
static PetscErrorCode TestSlidOff(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const DemStrength *s = &tension[0];
    const PetscReal    h = 0.2 * DemSofteningLongest(s, YOUNG / 2), press = 1e-4 * h;
    PetscReal          held = 0, strain = 0, lost, rub = 0, before = 0;
    Pair               p;

    PetscCall(PairBreak(dim, 0, s, &p));
    PetscCall(PairMove(&p, 100, -press, 0));
    PetscCall(PairEnergy(&p, &held, &lost, &before));
    p.work = 0;
    for (PetscInt i = 1; i <= 9; i++) {
      PetscCall(PairMove(&p, 1000, -press, 0.1 * i * h));
      CheckClose(p.force[0], (1 - 0.1 * i) * YOUNG / h * p.A * press, 1e-9);
      CheckClose(-p.force[1], s->mu_dynamic * p.force[0], 1e-9);
    }
    PetscCall(PairEnergy(&p, &strain, &lost, &rub));
    CheckClose(held - strain + p.work, rub - before, 1e-3);
    PetscCall(PairMove(&p, 1000, -press, 0.8 * h)); /* back: no more of it than before */
    CheckClose(p.force[0], 0.1 * YOUNG / h * p.A * press, 1e-9);
    PetscCall(PairMove(&p, 1000, -press, 0.9 * h));
    PetscCall(PairEnergy(&p, &held, &lost, &before));
    PetscCall(PairSet(&p, -press, 1.0001 * h));
    PetscCall(PairEnergy(&p, &strain, &lost, &rub));
    CheckNear(strain, 0, 1e-12 * held);
    CheckClose(rub - before, held, 1e-9);
    PetscCall(PairSet(&p, -press, 0));
    CheckNear(p.force[0], 0, 1e-12);
    PetscCall(PairDestroy(&p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSlidOff)

/* Slid off while their spheres overlap: a contact from the next search on, without force up to the overlap it then has, pushing beyond it; met again from afar, pushing from the first touch. */
static PetscErrorCode TestSlidOffMeets(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const DemStrength      *s = &tension[0];
    const DemContactOptions meet = {.choice = {.law = DEM_CONTACT_LINEAR, .stiffness = YOUNG, .restitution = 1}};
    const PetscReal         h = 0.2 * DemSofteningLongest(s, YOUNG / 2), radius = 0.95, press = 1e-4 * h;
    PetscReal               pushed;
    Pair                    p;

    PetscCall(PairCreateMeeting(dim, 0, h, s, radius, &meet, &p));
    PetscCall(PairMove(&p, 8000, 1.2 * DemSofteningEnd(s), 0));
    PetscCall(PairMove(&p, 100, -press, 0));
    PetscCall(PairMove(&p, 1000, -press, 1.3 * h)); /* centres 1.64 h apart, radii 1.9 h; a search comes by every 0.14 h */
    for (PetscInt d = 0; d < 3; d++) CheckNear(p.force[d], 0, 0);
    PetscCall(PairMove(&p, 100, -press, 0.9 * h));
    pushed = p.force[0];
    PetscCall(PairMove(&p, 1000, -press, 2 * h)); /* apart, and back to the same place: the whole overlap counts, 0.555 h */
    for (PetscInt d = 0; d < 3; d++) CheckNear(p.force[d], 0, 0);
    PetscCall(PairMove(&p, 1000, -press, 0.9 * h));
    CheckNear(pushed / p.force[0], 0.22, 0.1); /* it began between the slides of 1 and 1.14 h: overlaps of 0.38 to 0.49 h */
    CheckClose(p.force[1] / p.force[0], 0.9 / (1 - 1e-4), 1e-9);
    PetscCall(PairDestroy(&p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSlidOffMeets)

/*
  Random bars in a uniform strain with scatter on it, materials of next to no strength: 20 facets in turn are left to their law and
  break whole in one step, or hold where breaking would free no energy (Y < 0). What is stored never rises.
*/
static PetscErrorCode TestBreakingLowersEnergy(void)
{
  const DemStrength s[3] = {{.tensile = 1e-12, .fracture_energy = 5e-21, .mu_dynamic = 0.4},
                            {.shear = 1e-12, .shear_energy = 5e-21, .mu_static = 0.6, .mu_dynamic = 0.4},
                            {.tensile = 1e-12, .fracture_energy = 5e-21, .shear = 1e-12, .shear_energy = 5e-21, .mu_static = 0.6, .mu_dynamic = 0}};
  PetscInt          broken = 0, closed = 0, held = 0, rises = 0;
  PetscReal         highest = -1;

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (uint64_t seed = 1; seed <= 6; seed++) {
      const PetscReal size[3] = {4, 2, 2};
      uint64_t        state = 100 * seed;
      PetscReal       before, after, strain[3][3], *x;
      TestBody        body;
      DemModel        model;
      DemState        st;
      Stepper         stepper;

      PetscCall(TestBodyCreate(dim, size, 3, 0, seed, &body));
      PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS, 1, 0.25, &model));
      PetscCall(DemModelSetStrength(model, &s[seed % 3]));
      PetscCall(DemModelSetUp(model));
      PetscCall(DemModelGetStepper(model, &stepper));
      PetscCall(PetscCalloc1(TestUnknowns(model), &x));
      for (int i = 0; i < 3; i++)
        for (int j = 0; j <= i; j++) strain[i][j] = strain[j][i] = 1e-6 * (2 * TestRandom(&state) - 1);
      PetscCall(DemModelGetState(model, &st));
      for (PetscInt p = 0; p < st.n; p++)
        for (PetscInt d = 0; d < dim; d++) {
          x[d * st.n + p] = 1e-8 * (2 * TestRandom(&state) - 1);
          for (PetscInt e = 0; e < dim; e++) x[d * st.n + p] += strain[d][e] * st.x0[e * st.n + p];
        }
      PetscCall(DemModelRestoreState(model, &st));
      PetscCall(TestSetState(model, x));
      for (PetscInt k = 0; k < model->bonds.n; k++) model->crack.state[k] = DEM_BOND_KEPT;
      PetscCall(DemStrainEnergy_Internal(model, &before));
      for (PetscInt turn = 0; turn < 20; turn++) {
        const PetscInt bond = (PetscInt)(TestRandom(&state) * model->bonds.n);

        if (model->crack.damage[bond] > 0) continue;
        model->crack.state[bond] = 0;
        model->crack.steps       = 0; /* look now */
        PetscCall(stepper.step(model, 0, 1e-300));
        PetscCall(DemStrainEnergy_Internal(model, &after));
        if (model->crack.damage[bond] > 0) {
          broken++;
          closed += model->crack.state[bond] & DEM_BOND_SHEAR ? 1 : 0;
          rises += after > before;
          highest = PetscMax(highest, after / before - 1);
        } else {
          held++;
          CheckBelow(after, before * (1 + 1e-13));
          model->crack.state[bond] = DEM_BOND_KEPT;
        }
        before = after;
      }
      PetscCall(PetscFree(x));
      PetscCall(DemModelDestroy(&model));
      PetscCall(TestBodyDestroy(&body));
    }
  print_message("           %d facets broken (%d in shear), %d held; energy rose %d times, largest change %+.1e of it\n", (int)broken, (int)closed, (int)held, (int)rises, (double)highest);
  CheckAbove(broken, 100);
  CheckInt(rises, 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBreakingLowersEnergy)

static const struct CMUnitTest tests[] = {TEST(TestSecant), TEST(TestPressedShut), TEST(TestFriction), TEST(TestShear), TEST(TestFreshTouch), TEST(TestTurned), TEST(TestSlidIsConservative), TEST(TestSlidNoFaster), TEST(TestSlidOff), TEST(TestSlidOffMeets), TEST(TestBreakingLowersEnergy)};

CHECK_MAIN(tests)
