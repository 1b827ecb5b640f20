/* test_packing.c - packings: the marks of design.md 4.1 in the small, flat faces, seeds, files. `long` as argument: 100,000 spheres. */
#include "body_cases.h"
#include "check.h"
#include "dem_pack_impl.h"
#include <omp.h>
#include <stdio.h>

static PetscErrorCode Report(const char *what, const DemBody *body, const DemPacking *packing, DemPackingReport *r)
{
  PetscFunctionBegin;
  PetscCall(DemPackingGetReport(packing, body, r));
  PetscCall(PetscPrintf(PETSC_COMM_SELF,
                        "%s: %" PetscInt_FMT
                        " of mean radius %.4g m (+- %.3f), porosity %.4f, neighbours %.2f / %.2f, overlap <= %.3f, flat to %.1e, smallest cell %.3f\n",
                        what, packing->n, (double)r->mean_radius, (double)r->relative_deviation, (double)r->porosity, (double)r->coordination_10,
                        (double)r->coordination_15, (double)r->largest_overlap, (double)r->flatness, (double)r->smallest_cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No sphere sticks out; the outermost are tangent. */
static PetscErrorCode CheckTangent(const DemBody *body, const DemPacking *packing, PetscReal largest)
{
  DemBodySearch search;
  PetscInt      near = 0;

  PetscFunctionBegin;
  PetscCall(DemBodySearchCreate(body, 2 * largest, 2 * largest, &search));
  for (PetscInt p = 0; p < packing->n; p++) {
    DemWall wall[DEM_MAX_WALLS];

    CheckTrue(DemBodySearchInside(&search, &packing->x[3 * p]));
    if (!DemBodySearchWalls(&search, &packing->x[3 * p], 1.25 * packing->r[p], wall)) continue;
    CheckNear(wall[0].distance / packing->r[p], 1, 1e-6);
    near++;
  }
  CheckAbove(near, 8);
  PetscCall(DemBodySearchDestroy(&search));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks: the thesis' series has 9.29 neighbours for 1004 spheres in the 150 x 300 mm cylinder, 9.63 for 4959. */
static PetscErrorCode TestCylinder(void)
{
  const PetscReal   centre[3] = {0, 0, 0};
  DemPackingOptions options = {.count = 2000, .spread = 0.43, .seed = 1};
  DemPackingReport  r;
  DemBody           body;
  DemPacking        packing;

  PetscFunctionBeginUser;
  PetscCall(DemBodyCreateCylinder(centre, 0.075, 0.3, 96, &body));
  PetscCall(DemPackingCreate(&body, &options, &packing));
  PetscCall(Report("cylinder", &body, &packing, &r));
  CheckInt(packing.n, 2000);
  CheckBelow(r.porosity, 0.29);
  CheckAbove(r.coordination_15, 9.5);
  CheckBelow(r.largest_overlap, 0.25);
  CheckBelow(r.flatness, 1e-6);
  CheckNear(r.relative_deviation, 0.25, 0.03); /* 0.43 / sqrt 3 asked */
  CheckAbove(r.smallest_cell, 0.08);           /* (0.57)^3 / 1.2 of the mean is what the asked radii alone give: 0.16 */
  PetscCall(CheckTangent(&body, &packing, 1.5 * r.mean_radius));
  PetscCall(DemPackingDestroy(&packing));
  PetscCall(DemBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCylinder)

/* A mean radius given is met within 2 %, the default spread leaves no small cell, corners are filled, no direction is preferred. */
static PetscErrorCode TestBox(void)
{
  const PetscReal low[3] = {0, 0, 0}, high[3] = {0.1, 0.1, 0.1};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    DemPackingOptions options = {.radius = dim == 2 ? 0.0012 : 0.0044, .spread = 0.2, .seed = 5};
    DemPackingReport  r;
    DemBody           body;
    DemPacking        packing;
    PetscReal         fabric[3] = {0, 0, 0};
    PetscInt          pairs = 0, *start, *nbr;

    PetscCall(DemBodyCreateBox(dim, low, high, 1, &body));
    PetscCall(DemPackingCreate(&body, &options, &packing));
    PetscCall(Report(dim == 2 ? "square" : "cube", &body, &packing, &r));
    CheckClose(r.mean_radius, options.radius, 0.02);
    CheckBelow(r.porosity, dim == 2 ? 0.11 : 0.29);
    CheckAbove(r.coordination_15, dim == 2 ? 5.5 : 10);
    CheckBelow(r.largest_overlap, 0.25);
    CheckAbove(r.smallest_cell, 0.2);
    PetscCall(CheckTangent(&body, &packing, 1.5 * r.mean_radius));
    for (PetscInt corner = 0; corner < (dim == 2 ? 4 : 8); corner++) {
      PetscBool filled = PETSC_FALSE;

      for (PetscInt p = 0; p < packing.n && !filled; p++) {
        filled = PETSC_TRUE;
        for (PetscInt c = 0; c < dim; c++) {
          const PetscReal x = packing.x[3 * p + c], gap = corner >> c & 1 ? high[c] - x : x - low[c];

          if (PetscAbsReal(gap - packing.r[p]) > 1e-6 * packing.r[p]) filled = PETSC_FALSE;
        }
      }
      CheckTrue(filled);
    }
    PetscCall(DemPackNeighbours(dim, packing.n, packing.x, packing.r, 0.15, &start, &nbr));
    for (PetscInt p = 0; p < packing.n; p++)
      for (PetscInt k = start[p]; k < start[p + 1]; k++, pairs++) {
        PetscReal d[3], len = 0;

        for (PetscInt c = 0; c < 3; c++) {
          d[c] = packing.x[3 * nbr[k] + c] - packing.x[3 * p + c];
          len += d[c] * d[c];
        }
        for (PetscInt c = 0; c < 3; c++) fabric[c] += d[c] * d[c] / len;
      }
    for (PetscInt c = 0; c < dim; c++) CheckNear(dim * fabric[c] / pairs, 1, 0.03);
    PetscCall(PetscFree(start));
    PetscCall(PetscFree(nbr));
    PetscCall(DemPackingDestroy(&packing));
    PetscCall(DemBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBox)

/* Re-entrant bodies, from few particles to many, and a disc. */
static PetscErrorCode TestNotches(void)
{
  const PetscInt  square[3] = {8, 8, 3}, beam[3] = {15, 6, 3};
  const PetscReal centre[2] = {0, 0};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt kind = 0; kind < 4; kind++) {
      DemPackingOptions options = {.count = kind == 0 ? 50 : 400, .spread = 0.2, .seed = 3};
      DemPackingReport  r;
      DemBody           body;
      DemPacking        packing;

      if (kind < 2)
        PetscCall(GridBody(dim, square, 0.01, KeepL, 0, 0, &body));
      else if (kind == 2)
        PetscCall(GridBody(dim, beam, 0.01, KeepNotched, 0, 0, &body));
      else
        PetscCall(DemBodyCreateDisc(centre, 0.05, 48, 1, &body));
      PetscCall(DemPackingCreate(&body, &options, &packing));
      PetscCall(Report(kind < 2 ? "L" : (kind == 2 ? "notched beam" : "disc"), &body, &packing, &r));
      CheckInt(packing.n, options.count);
      CheckBelow(r.largest_overlap, 0.25);
      CheckAbove(r.smallest_cell, 0.2);
      PetscCall(CheckTangent(&body, &packing, 1.5 * r.mean_radius));
      PetscCall(DemPackingDestroy(&packing));
      PetscCall(DemBodyDestroy(&body));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestNotches)

static PetscErrorCode TestSeeds(void)
{
  const PetscReal   low[3] = {0, 0, 0}, high[3] = {0.1, 0.1, 0.1};
  const PetscInt    before = omp_get_max_threads();
  DemPackingOptions options = {.count = 2500, .spread = 0.2, .seed = 1};
  DemBody           body;
  DemPacking        packing[3];

  PetscFunctionBeginUser;
  PetscCall(DemBodyCreateBox(3, low, high, 1, &body));
  for (PetscInt k = 0; k < 3; k++) {
    options.seed = k == 2 ? 2 : 1;
    omp_set_num_threads(k ? 3 : 1);
    PetscCall(DemPackingCreate(&body, &options, &packing[k]));
  }
  omp_set_num_threads((int)before);
  CheckTrue(!memcmp(packing[0].x, packing[1].x, 3 * 2500 * sizeof(PetscReal)));
  CheckTrue(!memcmp(packing[0].r, packing[1].r, 2500 * sizeof(PetscReal)));
  CheckTrue(memcmp(packing[0].x, packing[2].x, 3 * 2500 * sizeof(PetscReal)) != 0);
  for (PetscInt k = 0; k < 3; k++) PetscCall(DemPackingDestroy(&packing[k]));
  PetscCall(DemBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSeeds)

/* Two overlapping balls (discs) in a box, one of them cut by its wall: union by hand.  Eq. (3.7) */
static PetscErrorCode TestPorosity(void)
{
  const PetscReal low[3] = {0, 0, 0}, high[3] = {1, 1, 1}, R = 0.2, a = 0.15; /* centres 2 a apart */
  const PetscReal ball = 4 * PETSC_PI / 3 * R * R * R, cap = PETSC_PI * (R - a) * (R - a) * (2 * R + a) / 3;
  const PetscReal disc = PETSC_PI * R * R, slice = R * R * PetscAcosReal(a / R) - a * PetscSqrtReal(R * R - a * a);

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    PetscReal        x[6] = {0.35, 0.5, dim == 3 ? 0.4 : 0, 0.65, 0.5, dim == 3 ? 0.4 : 0}, r[2] = {R, R};
    DemPacking       packing = {.n = 2, .x = x, .r = r};
    DemPackingReport report;
    DemBody          body;

    PetscCall(DemBodyCreateBox(dim, low, high, 1, &body));
    PetscCall(DemPackingGetReport(&packing, &body, &report));
    CheckClose(1 - report.porosity, dim == 2 ? 2 * (disc - slice) : 2 * (ball - cap), 1e-12);
    CheckClose(report.largest_overlap, 1 - a / R, 1e-12);
    CheckNear(report.coordination_10, 1, 0);
    x[1] = 1 - a; /* the first one through the top wall, and the second far away */
    x[3] = 0.7;
    x[4] = 0.3;
    PetscCall(DemPackingGetReport(&packing, &body, &report));
    CheckClose(1 - report.porosity, dim == 2 ? 2 * disc - slice : 2 * ball - cap, 1e-12);
    CheckNear(report.coordination_15, 0, 0);
    PetscCall(DemBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPorosity)

static PetscErrorCode TestOptions(void)
{
  const PetscReal         low[3] = {0, 0, 0}, high[3] = {0.1, 0.1, 0.005};
  DemBody                 body;
  DemPacking              packing;
  const DemPackingOptions none = {.spread = 0.2}, both = {.radius = 0.01, .count = 10}, wide = {.count = 10, .spread = 0.7}, large = {.radius = 1},
                          tiny = {.radius = 1e-9}, thick = {.radius = 0.004, .seed = 1};

  PetscFunctionBeginUser;
  PetscCall(DemBodyCreateBox(3, low, high, 1, &body));
  CheckFails(DemPackingCreate(&body, &none, &packing), PETSC_ERR_USER_INPUT, "mean radius or by its count");
  CheckFails(DemPackingCreate(&body, &both, &packing), PETSC_ERR_USER_INPUT, "mean radius or by its count");
  CheckFails(DemPackingCreate(&body, &wide, &packing), PETSC_ERR_USER_INPUT, "between 0 and 0.6");
  CheckFails(DemPackingCreate(&body, &large, &packing), PETSC_ERR_USER_INPUT, "smaller ones");
  CheckFails(DemPackingCreate(&body, &tiny, &packing), PETSC_ERR_USER_INPUT, "larger ones");
  CheckFails(DemPackingCreate(&body, &thick, &packing), PETSC_ERR_USER_INPUT, "narrower");
  PetscCall(DemBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOptions)

static void WriteFile(const char *file, const char *text)
{
  FILE *out = fopen(file, "w");

  CheckTrue(out != NULL);
  fputs(text, out);
  fclose(out);
}

static PetscErrorCode TestFiles(void)
{
  const char              *file = "test_packing.txt";
  const PetscReal          low[3] = {0, 0, 0}, high[3] = {0.1, 0.1, 0.1};
  DemPackingOptions        options = {.count = 80, .spread = 0.2, .seed = 1};
  DemBody                  body, flat;
  DemPacking               packing, again;
  static const char *const bad[][2] = {
      {"0.05 0.05 0.05 0.01\n0.05 0.05 0.06\n", ":2: this line is not four numbers"},
      {"# x y z r\n\n0.05,0.05,0.05,0.01,7\n", ":3: this line is not four numbers"},
      {"0.05 0.05 zero 0.01\n", ":1: this line is not four numbers"},
      {"0.05 0.05 0.05 0.01m\n", ":1: this line is not four numbers"},
      {"0.05,0.05,,0.01\n", ":1: this line is not four numbers"},
      {"0.05 0.05 0.05 0.01\n0.05 0.05 0.06 -0.01\n", ":2: this line has a centre that is not finite or a radius"},
      {"0.05 0.05 nan 0.01\n", ":1: this line has a centre that is not finite"},
      {"0.05 0.05 0.05 inf\n", ":1: this line has a centre that is not finite"},
      {"0.05 0.05 0.05 0.01\n50 50 50 10\n", ":2: this line has its centre outside the body (are the numbers in metres?)"},
      {"# nothing\n", "holds no particle"},
      {"", "holds no particle"},
  };

  PetscFunctionBeginUser;
  PetscCall(DemBodyCreateBox(3, low, high, 1, &body));
  PetscCall(DemBodyCreateBox(2, low, high, 1, &flat));
  PetscCall(DemPackingCreate(&body, &options, &packing));
  PetscCall(DemPackingWrite(&packing, file));
  PetscCall(DemPackingRead(file, &body, PETSC_FALSE, &again));
  CheckInt(again.n, packing.n);
  CheckTrue(!memcmp(again.x, packing.x, 3 * packing.n * sizeof(PetscReal)));
  CheckTrue(!memcmp(again.r, packing.r, packing.n * sizeof(PetscReal)));
  PetscCall(DemPackingDestroy(&again));
  WriteFile(file, "# commas, blanks, comments\n  0.01, 0.02,\t0.03 ,0.004 # one\n\n0.05 0.06 0.07 1e-3\r\n");
  PetscCall(DemPackingRead(file, &body, PETSC_FALSE, &again));
  CheckInt(again.n, 2);
  CheckNear(again.x[2], 0.03, 0);
  CheckNear(again.r[1], 1e-3, 0);
  PetscCall(DemPackingDestroy(&again));
  for (size_t k = 0; k < sizeof(bad) / sizeof(bad[0]); k++) {
    WriteFile(file, bad[k][0]);
    CheckFails(DemPackingRead(file, &body, PETSC_FALSE, &again), PETSC_ERR_USER_INPUT, bad[k][1]);
  }
  WriteFile(file, "0.05 0.05 0.05 0.01\n50 50 50 10\n"); /* trimmed: what is outside is left out, nothing left is refused */
  PetscCall(DemPackingRead(file, &body, PETSC_TRUE, &again));
  CheckInt(again.n, 1);
  PetscCall(DemPackingDestroy(&again));
  WriteFile(file, "50 50 50 10\n");
  CheckFails(DemPackingRead(file, &body, PETSC_TRUE, &again), PETSC_ERR_USER_INPUT, "holds no particle with its centre in the body");
  WriteFile(file, "0.05 0.05 0.05 0.01\n");
  CheckFails(DemPackingRead(file, &flat, PETSC_FALSE, &again), PETSC_ERR_USER_INPUT, ":1: this line leaves the plane z = 0");
  {
    char *line;

    PetscCall(PetscMalloc1(20000, &line));
    for (PetscInt k = 0; k < 19999; k++) line[k] = ' ';
    line[19999] = 0;
    WriteFile(file, line);
    PetscCall(PetscFree(line));
    CheckFails(DemPackingRead(file, &body, PETSC_FALSE, &again), PETSC_ERR_USER_INPUT, ":1: this line is too long");
  }
  remove(file);
  CheckFails(DemPackingRead(file, &body, PETSC_FALSE, &again), PETSC_ERR_USER_INPUT, "Cannot read the packing");
  CheckFails(DemPackingWrite(&packing, "no such folder/packing.txt"), PETSC_ERR_USER_INPUT, "Cannot write the packing");
  PetscCall(DemPackingDestroy(&packing));
  PetscCall(DemBodyDestroy(&body));
  PetscCall(DemBodyDestroy(&flat));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFiles)

/* The mark of design.md 4.1, and 100,000 spheres. */
static PetscErrorCode TestLarge(void)
{
  const PetscReal   low[3] = {0, 0, 0}, high[3] = {0.2, 0.2, 0.2};
  DemPackingOptions options = {.count = 13500, .spread = 0.43, .seed = 1};
  DemPackingReport  r;
  DemBody           body;
  DemPacking        packing;
  double            seconds;

  PetscFunctionBeginUser;
  PetscCall(DemBodyCreateCylinder(low, 0.075, 0.3, 96, &body));
  seconds = omp_get_wtime();
  PetscCall(DemPackingCreate(&body, &options, &packing));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%.1f s on %d threads, ", omp_get_wtime() - seconds, omp_get_max_threads()));
  PetscCall(Report("cylinder", &body, &packing, &r));
  CheckBelow(r.porosity, 0.26);
  CheckAbove(r.coordination_15, 9.5);
  PetscCall(DemPackingDestroy(&packing));
  PetscCall(DemBodyDestroy(&body));
  PetscCall(DemBodyCreateBox(3, low, high, 1, &body));
  options.count = 100000;
  options.spread = 0.2;
  seconds = omp_get_wtime();
  PetscCall(DemPackingCreate(&body, &options, &packing));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%.1f s on %d threads, ", omp_get_wtime() - seconds, omp_get_max_threads()));
  PetscCall(Report("cube", &body, &packing, &r));
  CheckBelow(r.porosity, 0.26);
  CheckAbove(r.coordination_15, 10.5);
  CheckBelow(r.largest_overlap, 0.25);
  CheckBelow(r.flatness, 1e-6);
  CheckAbove(r.smallest_cell, 0.2);
  PetscCall(DemPackingDestroy(&packing));
  PetscCall(DemBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestLarge)

/* Grains laid out: nobody touches, nobody sticks out, the porosity is the one asked for or a little more; one that cannot be is refused.  Eqs (5.80)-(5.82) */
static PetscErrorCode TestLoose(void)
{
  const PetscReal low[3] = {0, 0, 0}, size[3] = {0.05, 0.04, 0.06};

  PetscFunctionBegin;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const DemPackingOptions options = {.radius = 1e-3, .spread = 0.2, .seed = 3, .porosity = dim == 2 ? 0.5 : 0.7};
    DemPackingOptions       tight = options;
    DemBody                 body;
    DemPacking              packing, again = {0};
    DemBodySearch           search;
    PetscReal               solid = 0;

    PetscCall(DemBodyCreateBox(dim, low, size, dim == 2 ? 0.01 : 1, &body));
    PetscCall(DemPackingCreate(&body, &options, &packing));
    PetscCall(DemPackingCreate(&body, &options, &again));
    CheckTrue(packing.n == again.n);
    CheckTrue(!memcmp(packing.x, again.x, 3 * (size_t)packing.n * sizeof(PetscReal)));
    PetscCall(DemBodySearchCreate(&body, 2e-3, 2e-3, &search));
    for (PetscInt p = 0; p < packing.n; p++) {
      CheckTrue(DemBodySearchClear(&search, &packing.x[3 * p], packing.r[p] * (1 - 1e-8)));
      solid += dim == 2 ? PETSC_PI * PetscSqr(packing.r[p]) * 0.01 : 4 * PETSC_PI / 3 * PetscPowReal(packing.r[p], 3);
      for (PetscInt q = 0; q < p; q++) {
        PetscReal d2 = 0;

        for (PetscInt d = 0; d < dim; d++) d2 += PetscSqr(packing.x[3 * p + d] - packing.x[3 * q + d]);
        if (d2 < PetscSqr(packing.r[p] + packing.r[q])) CheckAbove(d2, PetscSqr(packing.r[p] + packing.r[q]));
      }
    }
    CheckAbove(1 - solid / DemBodyVolume(&body), options.porosity - 0.01);
    CheckBelow(1 - solid / DemBodyVolume(&body), options.porosity + 0.05);
    tight.porosity = dim == 2 ? 0.4 : 0.6; /* least: 1 - pi (1 + s^2/3) / 4 (1 + s)^2 = 0.447, 0.685 */
    PetscCall(DemBodySearchDestroy(&search));
    PetscCall(DemPackingDestroy(&packing));
    PetscCall(DemPackingDestroy(&again));
    CheckFails(DemPackingCreate(&body, &tight, &packing), PETSC_ERR_USER_INPUT, "leave a porosity of at least");
    PetscCall(DemBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestLoose)

static const struct CMUnitTest tests[] = {TEST(TestCylinder), TEST(TestBox),     TEST(TestNotches), TEST(TestSeeds),
                                          TEST(TestPorosity), TEST(TestOptions), TEST(TestFiles),
                                          TEST(TestLoose)};
static const struct CMUnitTest large[] = {TEST(TestLarge)};

int main(int argc, char **argv)
{
  const int is_long = argc > 1 && !strcmp(argv[1], "long");
  int       failed;

  if (is_long) argc = 1;
  if (BaseInitialize(&argc, &argv)) return 99;
  failed = is_long ? cmocka_run_group_tests_name("packing, long", large, NULL, NULL) : cmocka_run_group_tests_name("packing", tests, NULL, NULL);
  if (BaseFinalize()) return 98;
  return failed;
}
