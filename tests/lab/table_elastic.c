/*
  table_elastic.c - E and nu from uniaxial tests at rest, by rule, shape, platens, number of spheres, seed and nu.

  E is stress over strain of a gauge in the middle half. Glued platens bulge the specimen, so the same gauge in a body of
  quadratic finite elements between the same platens is what E and nu are compared with; the modulus that the platens
  themselves feel stands beside it. `exact` must return what was given within 1 %; the published rules return what they
  return, and the table says it.
  Options: -sizes 500,2000 -seeds 3 -seed 1 (the first) -ratios 0,0.2,0.45 -rules 3 (1: exact alone) -platens 2 (1: smooth alone) -rtol 1e-7 -csv FILE
*/
#include "lab.h"

typedef struct {
  const char *name;
  DemRule     rule;
} Rule;

static const Rule rules[] = {
  {"exact", {.elasticity = DEM_EXACT}},
  {"onate2015", {.elasticity = DEM_ONATE2015, .range = 0.1, .normal_factor = 1, .shear_factor = 1}},
  {"kdem", {.elasticity = DEM_KDEM, .normal_factor = 1, .shear_factor = 1}},
  {"kdem+poisson", {.elasticity = DEM_KDEM, .normal_factor = 1, .shear_factor = 1, .poisson_term = PETSC_TRUE}},
};

#define MOST 16

static PetscErrorCode TestTable(void)
{
  PetscInt  sizes[MOST] = {500}, n_sizes = MOST, seeds = 1, first = 1, n_rules = 4, platens = 2, n_ratios = MOST;
  PetscReal ratios[MOST] = {0.2, 0.45}, rtol = 1e-7;
  char      path[PETSC_MAX_PATH_LEN] = "";
  PetscBool given;
  FILE     *csv = NULL;
  LabUniaxial fem[2][MOST];

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetIntArray(NULL, NULL, "-sizes", sizes, &n_sizes, &given));
  if (!given) n_sizes = 1;
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, "-ratios", ratios, &n_ratios, &given));
  if (!given) n_ratios = 2;
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-seeds", &seeds, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-seed", &first, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-rules", &n_rules, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-platens", &platens, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-rtol", &rtol, NULL));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-csv", path, sizeof(path), &given));
  if (given) {
    csv = fopen(path, "w");
    CheckTrue(csv != NULL);
    fprintf(csv, "rule,shape,platens,spheres,seed,poisson,E,nu,E_fem_gauge,nu_fem_gauge,modulus_of_platens,modulus_of_platens_fem,iterations\n");
  }
  for (PetscInt shape = 0; shape < 2; shape++)
    for (PetscInt k = 0; k < n_ratios && platens > 1; k++) PetscCall(LabGluedFem((LabShape)shape, ratios[k], given ? 0.1 : 0.2, &fem[shape][k]));
  for (PetscInt i = 0; i < n_sizes; i++)
    for (PetscInt shape = 0; shape < 2; shape++)
      for (PetscInt seed = first; seed < first + seeds; seed++) {
        TestBody body;

        PetscCall(LabSpecimen((LabShape)shape, sizes[i], seed, &body));
        for (PetscInt r = 0; r < n_rules; r++)
          for (PetscInt glued = 0; glued < platens; glued++)
            for (PetscInt k = 0; k < n_ratios; k++) {
              const LabUniaxial want = glued ? fem[shape][k] : (LabUniaxial){1, 1, ratios[k], 0};
              LabUniaxial       u;

              if (rules[r].rule.poisson_term && (ratios[k] == 0 || glued)) continue; /* the term is nothing, or the row says no more */
              PetscCall(LabUniaxialSolve(&body, r ? &rules[r].rule : NULL, ratios[k], (PetscBool)glued, rtol, &u));
              print_message("           %-12s %-8s %-6s %6d spheres seed %d nu %.2f: gauge E %.4f nu %.4f, platens %.4f", rules[r].name, LabShapeName[shape], glued ? "glued" : "smooth", (int)body.packing.n,
                            (int)seed, (double)ratios[k], (double)u.E, (double)u.nu, (double)u.modulus);
              if (glued) print_message(" (elements: %.4f %.4f, %.4f)", (double)want.E, (double)want.nu, (double)want.modulus);
              print_message("\n");
              if (csv) {
                fprintf(csv, "%s,%s,%s,%d,%d,%.2f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%d\n", rules[r].name, LabShapeName[shape], glued ? "glued" : "smooth", (int)body.packing.n, (int)seed, (double)ratios[k], (double)u.E,
                        (double)u.nu, (double)want.E, (double)want.nu, (double)u.modulus, (double)want.modulus, (int)u.iterations);
                fflush(csv);
              }
              if (r == 0) {
                CheckClose(u.E, want.E, 0.01);
                CheckNear(u.nu, want.nu, 0.01 * PetscMax(want.nu, 0.1)); /* 1 %, of 0.1 where nu is next to nothing */
                if (!glued) CheckClose(u.modulus, 1, 0.01);
              } else if (!rules[r].rule.poisson_term) {
                const PetscReal a = 1 / (2 * (1 + ratios[k])); /* the affine estimate, docs/theory.md after (4.49) */

                if (!glued) CheckNear(u.nu, (1 - a) / (4 + a), 0.04);
                if (!glued && r == 2) CheckNear(u.E, (2 + 3 * a) / (4 + a), 0.05);
              }
            }
        PetscCall(TestBodyDestroy(&body));
      }
  if (csv) fclose(csv);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTable)

static const struct CMUnitTest tests[] = {TEST(TestTable)};

CHECK_MAIN(tests)
