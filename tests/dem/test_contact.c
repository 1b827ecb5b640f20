/*
  The contact law alone: two bodies, or a body and a wall, that meet once. Closed forms, then the whole curves of Chung
  and Ooi (2011) and Thornton et al., digitised; their files say where they come from.
*/
#include "check.h"
#include "dem_contact.h"

typedef struct {
  PetscReal x[3], v[3], w[3], m, r;
} Ball; /* m = 0: a wall z = x[2], below */

typedef struct {
  PetscReal most_force, most_overlap, duration, ledger; /* ledger: worst error of the energy at any step / first energy */
  PetscReal friction, damping;
  PetscInt  n;
  PetscReal time[20000], force[20000], overlap[20000];
} Story;

static PetscReal Inertia(const Ball *b)
{
  return 0.4 * b->m * b->r * b->r;
}

static void Cross(const PetscReal a[3], const PetscReal b[3], PetscReal c[3])
{
  c[0] = a[1] * b[2] - a[2] * b[1];
  c[1] = a[2] * b[0] - a[0] * b[2];
  c[2] = a[0] * b[1] - a[1] * b[0];
}

/* Step until the bodies have met and parted again, by half-step velocities. */
static void Meet(const DemContactPair *pair, Ball *a, Ball *b, PetscReal dt, Story *s)
{
  const PetscBool   wall = (PetscBool)(b->m == 0);
  const PetscReal   radius = wall ? a->r : a->r * b->r / (a->r + b->r), mass = wall ? a->m : a->m * b->m / (a->m + b->m);
  DemContactHistory h = {0};
  PetscReal         first = 0, F[3] = {0}, Ta[3] = {0}, Tb[3] = {0};
  Ball             *both[2] = {a, b};

  memset(s, 0, sizeof(*s));
  for (PetscInt k = 0; k < 2; k++)
    if (both[k]->m > 0)
      for (PetscInt d = 0; d < 3; d++) first += 0.5 * (both[k]->m * PetscSqr(both[k]->v[d]) + Inertia(both[k]) * PetscSqr(both[k]->w[d]));
  for (PetscInt step = 0; step < 400000; step++) {
    DemContactMotion m = {.radius = radius, .size = radius, .mass = mass};
    DemContactForce  f = {{0}};
    PetscReal        length = 0, energy = 0, ra[3], rb[3], wr[3], moment[3];

    for (PetscInt d = 0; d < 3; d++) {
      a->x[d] += dt * a->v[d];
      b->x[d] += dt * b->v[d];
    }
    for (PetscInt d = 0; d < 3; d++) {
      m.n[d] = wall ? (d == 2) : a->x[d] - b->x[d];
      length += m.n[d] * m.n[d];
    }
    length = PetscSqrtReal(length);
    for (PetscInt d = 0; d < 3; d++) m.n[d] /= length;
    m.overlap = wall ? a->r - (a->x[2] - b->x[2]) : a->r + b->r - length;
    for (PetscInt d = 0; d < 3; d++) {
      ra[d] = -(a->r - 0.5 * m.overlap) * m.n[d];
      rb[d] = wall ? 0 : (b->r - 0.5 * m.overlap) * m.n[d];
      m.v[d] = a->v[d] - b->v[d];
      m.spin[d] = a->w[d] - b->w[d];
      m.turn += 0.5 * (a->w[d] + b->w[d]) * m.n[d];
    }
    Cross(a->w, ra, wr);
    for (PetscInt d = 0; d < 3; d++) m.v[d] += wr[d];
    Cross(b->w, rb, wr);
    for (PetscInt d = 0; d < 3; d++) m.v[d] -= wr[d];
    if (m.overlap > 0) {
      DemContactStep(pair, &m, dt, 1, &h, &f);
      energy = DemContactEnergy(pair, radius, radius, m.overlap, &h);
      s->duration += dt;
      s->most_overlap = PetscMax(s->most_overlap, m.overlap);
    } else if (h.overlap != 0) DemContactPart(pair, m.v, radius, radius, dt, 1, &h, &f.friction, &f.damping);
    s->friction += f.friction;
    s->damping += f.damping;
    s->most_force = PetscMax(s->most_force, f.force[0] * m.n[0] + f.force[1] * m.n[1] + f.force[2] * m.n[2]);
    if (s->n < 20000 && m.overlap > 0) {
      s->time[s->n] = s->duration;
      s->force[s->n] = f.force[0] * m.n[0] + f.force[1] * m.n[1] + f.force[2] * m.n[2];
      s->overlap[s->n++] = m.overlap;
    }
    for (PetscInt d = 0; d < 3; d++) F[d] = f.force[d];
    Cross(ra, F, moment);
    for (PetscInt d = 0; d < 3; d++) Ta[d] = moment[d] + f.couple[d];
    Cross(rb, F, moment);
    for (PetscInt d = 0; d < 3; d++) Tb[d] = -moment[d] - f.couple[d];
    for (PetscInt k = 0; k < 2; k++)
      if (both[k]->m > 0)
        for (PetscInt d = 0; d < 3; d++) {
          const PetscReal v = both[k]->v[d], w = both[k]->w[d];

          both[k]->v[d] += dt / both[k]->m * (k ? -F[d] : F[d]);
          both[k]->w[d] += dt / Inertia(both[k]) * (k ? Tb[d] : Ta[d]);
          energy += 0.5 * (both[k]->m * v * both[k]->v[d] + Inertia(both[k]) * w * both[k]->w[d]);
        }
    s->ledger = PetscMax(s->ledger, PetscAbsReal(energy + s->friction + s->damping - first) / first);
    if (s->n && m.overlap <= 0) break;
  }
}

static PetscErrorCode Pair(DemContactLaw law, PetscReal young, PetscReal poisson, PetscReal e, PetscReal mu, PetscBool rigid, DemContactPair *pair)
{
  const DemContactChoice  c = {.law = law, .restitution = e, .friction = mu};
  const DemContactElastic one = {young, poisson}, other = {rigid ? 0 : young, rigid ? 0 : poisson};

  return DemContactPairSet(pair, &c, one, other);
}

static Ball Sphere(PetscReal r, PetscReal density)
{
  return (Ball){.m = density * 4.0 / 3 * PETSC_PI * r * r * r, .r = r};
}

/* Duration of a Hertz impact [s], largest force and overlap; gamma of Johnson (1985), eqs 11.22-11.25. */
static void Hertz(PetscReal modulus, PetscReal radius, PetscReal mass, PetscReal v, PetscReal *overlap, PetscReal *force, PetscReal *duration)
{
  *overlap  = PetscPowReal(15 * mass * v * v / (16 * modulus * PetscSqrtReal(radius)), 0.4);
  *force    = 4.0 / 3 * modulus * PetscSqrtReal(radius) * PetscPowReal(*overlap, 1.5);
  *duration = 0.8 * PetscSqrtReal(PETSC_PI) * tgamma(0.4) / tgamma(0.9) * *overlap / v;
}

/* Rows "x,y" of a reference file, of one series ("" = the file has none). */
static PetscInt Reference(const char *name, const char *series, PetscReal x[64], PetscReal y[64])
{
  char     path[512], line[512];
  PetscInt n = 0;
  FILE    *file;

  (void)snprintf(path, sizeof(path), "%s/%s", TEST_REFERENCE, name);
  file = fopen(path, "r");
  assert_non_null(file);
  while (fgets(line, sizeof(line), file)) {
    const size_t skip = strlen(series);
    double       a, b;

    if (line[0] == '#' || (skip && (strncmp(line, series, skip) || line[skip] != ','))) continue;
    if (sscanf(line + (skip ? skip + 1 : 0), "%lf,%lf", &a, &b) == 2 && n < 64) {
      x[n]   = a;
      y[n++] = b;
    }
  }
  fclose(file);
  assert_true(n > 5);
  return n;
}

static PetscReal Between(PetscInt n, const PetscReal *x, const PetscReal *y, PetscReal at)
{
  for (PetscInt k = 1; k < n; k++)
    if (x[k] >= at) return y[k - 1] + (y[k] - y[k - 1]) * (at - x[k - 1]) / (x[k] - x[k - 1]);
  return y[n - 1];
}

/* Chung and Ooi 1 (two spheres) and 2 (sphere and rigid plane): closed forms to 0.1 %, digitised curves to 1.5 % of their peak. */
static PetscErrorCode TestHertz(void)
{
  static Story s;

  PetscFunctionBeginUser;
  for (PetscInt test = 1; test <= 2; test++) {
    const PetscReal r = test == 1 ? 0.01 : 0.1, young = test == 1 ? 48e9 : 70e9, nu = test == 1 ? 0.2 : 0.3, speed = test == 1 ? 20 : 0.2;
    Ball            a = Sphere(r, test == 1 ? 2800 : 2699), b = a;
    DemContactPair  pair;
    PetscReal       overlap, force, duration, x[64], y[64], worst = 0, modulus = young / (1 - nu * nu) / (test == 1 ? 2 : 1);
    PetscInt        n, top = 0;
    char            name[128];

    PetscCall(Pair(DEM_CONTACT_HERTZ, young, nu, 1, 0.35, (PetscBool)(test == 2), &pair));
    if (test == 1) {
      a.v[2] = -10;
      b.v[2] = 10;
      a.x[2] = 2 * r * (1 + 1e-9);
      Hertz(modulus, r / 2, a.m / 2, speed, &overlap, &force, &duration);
    } else {
      b      = (Ball){{0}};
      a.v[2] = -0.2;
      a.x[2] = r * (1 + 1e-9);
      Hertz(modulus, r, a.m, speed, &overlap, &force, &duration);
    }
    Meet(&pair, &a, &b, duration / 5000, &s);
    CheckClose(s.most_overlap, overlap, 1e-3);
    CheckClose(s.most_force, force, 1e-3);
    CheckClose(s.duration, duration, 1e-3);
    CheckClose(a.v[2], test == 1 ? 10 : 0.2, 1e-4);
    CheckBelow(s.ledger, 1e-3);
    (void)snprintf(name, sizeof(name), "chung_ooi_test%d_force_vs_time.csv", (int)test);
    n = Reference(name, "", x, y);
    for (PetscInt k = 0; k < n; k++)
      if (x[k] * 1e-6 < s.time[s.n - 1]) worst = PetscMax(worst, PetscAbsReal(Between(s.n, s.time, s.force, x[k] * 1e-6) / 1e3 - y[k]) / (force / 1e3));
    CheckBelow(worst, 0.015);
    (void)snprintf(name, sizeof(name), "chung_ooi_test%d_force_vs_displacement.csv", (int)test);
    n = Reference(name, "", x, y);
    while (s.overlap[top + 1] > s.overlap[top]) top++;
    worst = 0;
    for (PetscInt k = 0; k < n; k++)
      if (x[k] * 1e-6 < s.overlap[top]) worst = PetscMax(worst, PetscAbsReal(Between(top + 1, s.overlap, s.force, x[k] * 1e-6) / 1e3 - y[k]) / (force / 1e3));
    CheckBelow(worst, 0.015);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestHertz)

/* Chung and Ooi 3: what comes back is what was asked for, for both laws, though the force never pulls. */
static PetscErrorCode TestRestitution(void)
{
  static Story s;

  PetscFunctionBeginUser;
  for (PetscInt law = DEM_CONTACT_LINEAR; law <= DEM_CONTACT_HERTZ; law++)
    for (PetscInt k = 0; k <= 20; k++) {
      const PetscReal e = k / 20.0;
      Ball            a = Sphere(2.5e-3, 4000), wall = {{0}};
      DemContactPair  pair;
      PetscReal       overlap, force, duration;

      PetscCall(Pair((DemContactLaw)law, 380e9, 0.23, e, 0, PETSC_TRUE, &pair));
      Hertz(pair.modulus / 2, a.r, a.m, 3.9, &overlap, &force, &duration);
      a.v[2] = -3.9;
      a.x[2] = a.r;
      Meet(&pair, &a, &wall, duration / (2000 * (1 + 3 * pair.zeta)), &s);
      CheckNear(a.v[2] / 3.9, PetscMax(e, DEM_CONTACT_LEAST), 2e-3);
      CheckBelow(s.ledger, 1e-3);
      CheckClose(s.damping, 0.5 * a.m * PetscSqr(3.9) * (1 - PetscSqr(a.v[2] / 3.9)), e < 1 ? 2e-3 : 1);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRestitution)

/* Chung and Ooi 7: opposite spins leave no slip at the patch, so nothing of it changes. */
static PetscErrorCode TestOppositeSpins(void)
{
  static Story s;
  PetscReal    x[64], y[64];
  const PetscInt n = Reference("chung_ooi_test7_exact.csv", "", x, y);

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < n; k++) {
    Ball           a = Sphere(0.1, 2699), b = a;
    DemContactPair pair;

    PetscCall(Pair(DEM_CONTACT_HERTZ, 70e9, 0.33, 0.5, 0.4, PETSC_FALSE, &pair));
    a.x[2] = 0.2 * (1 + 1e-9);
    a.v[2] = -0.2;
    b.v[2] = 0.2;
    a.w[1] = x[k];
    b.w[1] = -x[k];
    Meet(&pair, &a, &b, 1e-6, &s);
    CheckNear(a.v[0], y[k], 1e-12);
    CheckNear(a.w[1], x[k], 1e-12);
    CheckNear(b.w[1], -x[k], 1e-12);
    CheckClose(a.v[2], 0.1, 1e-3);
    CheckBelow(s.ledger, 1e-3);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOppositeSpins)

static const struct CMUnitTest tests[] = {TEST(TestHertz), TEST(TestRestitution), TEST(TestOppositeSpins)};

CHECK_MAIN(tests)
