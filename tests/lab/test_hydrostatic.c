/*
  How near to failure bonds of a free cylinder come under 30 MPa from all sides (thesis 5.3.4): a local criterion sees a bond's own
  normal force alone and reports some at about 30 % of their shear strength; on the mean stress of the two particles none is. `exact` makes no shear at all.
*/
#include "lab.h"

static int Ascending(const void *a, const void *b)
{
  const PetscReal x = *(const PetscReal *)a, y = *(const PetscReal *)b;

  return x < y ? -1 : x > y;
}

/* Criterion (4.63) of all bonds, ascending; caller frees. Solved at rest with everything scaled down by 1e6, so strains are 1e-9: the ratio of stress to strength is the same. */
static PetscErrorCode Criteria(const TestBody *body, const DemRule *rule, DemStrength strength, PetscReal young, PetscReal pressure, PetscInt *n, PetscReal **value)
{
  const char *const faces[] = {"bottom", "top", "side"};
  PetscReal        *x;
  DemModel          model;
  DemBondList       list;
  Table             table;

  PetscFunctionBegin;
  PetscCall(TestModelCreate(body, DEM_SOLID, young, 0.2, &model));
  if (rule) PetscCall(DemModelSetRule(model, rule));
  PetscCall(DemModelSetStrength(model, &strength));
  PetscCall(TableCreateConstant(pressure, &table));
  for (int f = 0; f < 3; f++) PetscCall(DemModelAddPressure(model, faces[f], &table));
  PetscCall(DemModelSetUp(model));
  PetscCall(PetscCalloc1(TestUnknowns(model), &x));
  PetscCall(TestEquilibrium(model, 1e-8, x, NULL));
  PetscCall(DemModelGetBonds(model, &list));
  *n = list.n;
  PetscCall(PetscMalloc1(list.n, value));
  PetscCall(PetscArraycpy(*value, list.criterion, list.n));
  qsort(*value, list.n, sizeof(PetscReal), Ascending);
  PetscCall(PetscFree(x));
  PetscCall(TableDestroy(&table));
  PetscCall(DemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestArtefact(void)
{
  const DemRule     onate = {.elasticity = DEM_ONATE2015, .range = 0.15, .normal_factor = 1, .shear_factor = 1}, kdem = {.elasticity = DEM_KDEM, .normal_factor = 1, .shear_factor = 1};
  const DemStrength thesis = {.published = PETSC_TRUE, .tensile = 3.2, .delta_n = 0.1, .shear = 15, .delta_s = 0.1, .mu_static = 0.9, .mu_dynamic = 0.2}; /* its table 7.2, by 1e-6 */
  const DemStrength cohesive = {.tensile = 3.2, .fracture_energy = 1, .softening = DEM_SOFTENING_LINEAR, .shear = 15, .shear_energy = 1e4, .mu_static = 0.9, .mu_dynamic = 0.2};
  PetscInt          count = 1000;
  const PetscReal   low[3] = {0};
  PetscReal         high[5], share[5]; /* what one bond in a hundred passes; part of the bonds above a tenth */

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-spheres", &count, NULL));
  const DemPackingOptions options = {.count = count, .spread = 0.45, .seed = 1}; /* their relative deviation is 26 % */
  TestBody                body = {.packing.n = 0};

  PetscCall(DemBodyCreateCylinder(low, 0.075, 0.3, 64, &body.body));
  PetscCall(DemPackingCreate(&body.body, &options, &body.packing));
  PetscCall(DemCellsCreate(&body.body, &body.packing, &body.cells));
  for (int k = 0; k < 5; k++) {
    const char *const names[] = {"onate2015, local", "kdem, local", "onate2015, nonlocal", "kdem, nonlocal", "exact, local"};
    DemStrength       s = k == 4 ? cohesive : thesis;
    PetscReal        *value;
    PetscInt          n = 0, above = 0;

    s.nonlocal = (PetscBool)(k == 2 || k == 3);
    PetscCall(Criteria(&body, k == 4 ? NULL : k % 2 ? &kdem : &onate, s, 27e9, 30, &n, &value));
    for (PetscInt i = 0; i < n; i++) above += value[i] > 0.1;
    high[k]  = value[(PetscInt)(0.99 * n)];
    share[k] = (PetscReal)above / n;
    print_message("           %-20s %d bonds: 99 of 100 below %.3f, half below %.3f, %.2f %% above 0.1, highest %.3f\n", names[k], (int)n, (double)high[k], (double)value[n / 2], 100 * (double)share[k], (double)value[n - 1]);
    PetscCall(PetscFree(value));
  }
  CheckNear(high[0], 0.3, 0.05);
  CheckNear(high[1], 0.2, 0.05);
  for (int k = 2; k < 5; k++) { /* what is left are a few bonds of the skin that the interaction range leaves badly held */
    CheckBelow(high[k], 1e-6);
    CheckBelow(share[k], 1e-3);
    CheckAbove(share[k % 2], 20 * share[k]);
  }
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestArtefact)

static const struct CMUnitTest tests[] = {TEST(TestArtefact)};

CHECK_MAIN(tests)
