/* The notched beam of examples/notched_beam: a random packing that may break anywhere against one plane crack of the same softening. */
#include "check.h"
#include "coupled.h"

#define MIDDLE    87.5e-3 /* mid-span [m] */
#define THICKNESS 50e-3
#define RADIUS    0.5e-3  /* mean particle radius, the example's own */
#define ROWS      4000

typedef struct {
  PetscInt  n;
  PetscReal cmod[ROWS], force[ROWS];
} Curve;

/*
  A packing with one plane of facets at mid-span: near it the particles left of it and their mirror images.  A point of the
  plane is as far from a particle as from its image, so the facets on it join images and nothing else.
*/
static PetscErrorCode Mirror(DemPacking *packing)
{
  const PetscReal strip = 8 * RADIUS, clear = 0.5 * RADIUS;
  DemPacking      made = {0};
  PetscInt        images;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(6 * packing->n, &made.x));
  PetscCall(PetscMalloc1(2 * packing->n, &made.r));
  for (PetscInt p = 0; p < packing->n; p++) {
    const PetscReal x = packing->x[3 * p] - MIDDLE;

    if (x > -clear || x < -strip) continue;
    for (PetscInt side = 0; side < 2; side++, made.n++) {
      PetscCall(PetscArraycpy(&made.x[3 * made.n], &packing->x[3 * p], 3));
      if (side) made.x[3 * made.n] = MIDDLE - x;
      made.r[made.n] = packing->r[p];
    }
  }
  images = made.n;
  for (PetscInt p = 0; p < packing->n; p++) {
    const PetscReal *x    = &packing->x[3 * p];
    PetscBool        keep = (PetscBool)(PetscAbsReal(x[0] - MIDDLE) > strip);

    for (PetscInt q = 0; q < images && keep; q++)
      if (PetscSqr(x[0] - made.x[3 * q]) + PetscSqr(x[1] - made.x[3 * q + 1]) < PetscSqr(0.8 * (packing->r[p] + made.r[q]))) keep = PETSC_FALSE;
    if (!keep) continue;
    PetscCall(PetscArraycpy(&made.x[3 * made.n], x, 3));
    made.r[made.n++] = packing->r[p];
  }
  PetscCall(DemPackingDestroy(packing));
  *packing = made;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene examples/notched_beam/scene.yaml through the C API, as far as CMOD `last`; plane: only the facets of the mid-span plane may break. */
static PetscErrorCode Beam(PetscBool plane, PetscReal last, Curve *curve)
{
  const MeshOptions       mesh     = {.dimension = 2, .order = 1, .scale = 1e-3};
  const DemPackingOptions packing  = {.radius = RADIUS, .spread = 0.2, .seed = 1};
  const DemMaterial       material = {.density = 2346, .young = 37e9, .poisson = 0.2};
  const DemStrength       strength = {.tensile = 3.3e6, .fracture_energy = 143, .softening = DEM_SOFTENING_BILINEAR, .knee_stress = 0.2, .knee_opening = 0.45,
                                       .shear = 5e6, .shear_energy = 1430, .mu_static = 0.9, .mu_dynamic = 0.3};
  const CouplingOptions   options  = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1};
  const PetscReal         t[5] = {0, 6e-3, 20e-3, 32e-3, 56e-3}, v[5] = {0, -1.5e-3, -1.5e-3, -3e-3, -10e-3};
  Coupled                 c;
  Stepper                 stepper;
  Table                   none, motion;
  Ledger                  ledger;
  PetscReal               dt, next = 0;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(&c, sizeof(c)));
  c.material = (FemMaterial){material.density, material.young, material.poisson};
  PetscCall(MeshRead(PETSC_COMM_SELF, CLEAVE_BEAM, &mesh, &c.mesh));
  PetscCall(CouplingSplitCreate(&c.mesh, "ligament", 2, &c.split));
  PetscCall(DemBodyCreateFromMesh(&c.split.dem, "", THICKNESS, &c.body));
  PetscCall(DemPackingCreate(&c.body, &packing, &c.packing));
  if (plane) PetscCall(Mirror(&c.packing));
  PetscCall(DemCellsCreate(&c.body, &c.packing, &c.cells));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(TableCreate(5, t, v, &motion));
  PetscCall(FemModelCreate(PETSC_COMM_SELF, &c.fem));
  PetscCall(FemModelSetKind(c.fem, FEM_PLANE_STRESS, THICKNESS));
  PetscCall(FemModelSetMethod(c.fem, FEM_EXPLICIT));
  PetscCall(FemModelSetMesh(c.fem, &c.split.fem));
  PetscCall(FemModelAddMaterial(c.fem, "", &c.material));
  PetscCall(FemModelSetDamping(c.fem, 3000));
  PetscCall(FemModelFix(c.fem, "left support", 1, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelFix(c.fem, "right support", 0, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelFix(c.fem, "right support", 1, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddHistory(c.fem, "opening", "notch mouth"));
  PetscCall(DemModelCreate(PETSC_COMM_SELF, &c.dem));
  PetscCall(DemModelSetKind(c.dem, DEM_PLANE_STRESS));
  PetscCall(DemModelSetMaterial(c.dem, &material));
  PetscCall(DemModelSetStrength(c.dem, &strength));
  PetscCall(DemModelSetBody(c.dem, &c.body, &c.packing, &c.cells));
  PetscCall(DemModelFix(c.dem, "load", 1, DEM_VELOCITY, &motion));
  PetscCall(DemModelAddHistory(c.dem, "reaction", "load"));
  PetscCall(CouplingModelCreate(PETSC_COMM_SELF, &c.model));
  PetscCall(CouplingModelSetSplit(c.model, &c.split, &options));
  PetscCall(CouplingModelSetSides(c.model, c.fem, c.dem, &c.packing, &c.cells, &c.material, FEM_PLANE_STRESS, THICKNESS));
  if (plane) {
    PetscBool *breakable;
    PetscReal  length = 0;

    PetscCall(PetscMalloc1(c.cells.n_facets, &breakable));
    for (PetscInt f = 0; f < c.cells.n_facets; f++) {
      breakable[f] = (PetscBool)(PetscAbsReal(c.cells.at[3 * f] - MIDDLE) < 1e-9);
      if (breakable[f]) length += c.cells.area[f] / THICKNESS;
    }
    CheckNear(length, 25e-3, 1e-8); /* the plane goes from the notch to the top, and lies outside the overlap */
    PetscCall(DemModelSetBreakable(c.dem, breakable));
    PetscCall(DemModelSetCrackPlane(c.dem, PETSC_TRUE));
    PetscCall(PetscFree(breakable));
  }
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, &dt));
  dt *= 0.9;
  curve->n = 0;
  for (PetscInt k = 0; curve->n == 0 || curve->cmod[curve->n - 1] < last; k++) {
    PetscCall(stepper.step(c.model, k * dt, dt));
    if ((k + 1) * dt < next) continue;
    PetscCheck(curve->n < ROWS && next < t[4], PETSC_COMM_SELF, PETSC_ERR_PLIB, "The beam did not open to %g m", (double)last);
    next += 20e-6;
    for (PetscInt h = 0; h < stepper.n_history; h++) {
      PetscReal value;

      PetscCall(stepper.history(c.model, h, &value));
      if (!strncmp(stepper.history_name[h], "opening", 7)) curve->cmod[curve->n] = value;
      if (!strcmp(stepper.history_name[h], "reaction(load).y")) curve->force[curve->n] = -value;
    }
    curve->n++;
  }
  PetscCall(stepper.energy(c.model, &ledger));
  CheckBelow(PetscAbsReal(LedgerError(&ledger)), 0.01);
  PetscCall(TableDestroy(&none));
  PetscCall(TableDestroy(&motion));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean force over the rows whose CMOD lies within 10 % of `at`: the arms swing about the ligament. */
static PetscReal ForceAt(const Curve *curve, PetscReal at)
{
  PetscReal sum = 0;
  PetscInt  n   = 0;

  for (PetscInt k = 0; k < curve->n; k++)
    if (PetscAbsReal(curve->cmod[k] - at) < 0.1 * at) {
      sum += curve->force[k];
      n++;
    }
  return sum / PetscMax(n, 1);
}

/* Largest mean over 1 ms, a swing of the arms. */
static PetscReal Peak(const Curve *curve)
{
  PetscReal best = 0;

  for (PetscInt k = 0; k + 50 <= curve->n; k++) {
    PetscReal sum = 0;

    for (PetscInt i = k; i < k + 50; i++) sum += curve->force[i] / 50;
    best = PetscMax(best, sum);
  }
  return best;
}

/* Area under the curve as far as `last`, per opening [N]: the mean force. */
static PetscReal MeanForce(const Curve *curve, PetscReal last)
{
  PetscReal sum = 0;

  for (PetscInt k = 1; k < curve->n; k++)
    if (curve->cmod[k] <= last) sum += 0.5 * (curve->force[k] + curve->force[k - 1]) * (curve->cmod[k] - curve->cmod[k - 1]);
  return sum / last;
}

/* Peak and work within 5 %; the whole curve within 5 % of the peak. Along the tail, where little is left, the random packing carries more. */
static PetscErrorCode TestPlaneCrack(void)
{
  const PetscReal at[7] = {0.01e-3, 0.02e-3, 0.03e-3, 0.05e-3, 0.075e-3, 0.1e-3, 0.15e-3};
  Curve          *curve;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(2, &curve));
  for (int k = 0; k < 2; k++) PetscCall(Beam(k ? PETSC_TRUE : PETSC_FALSE, 0.167e-3, &curve[k]));
  print_message("           CMOD [mm]  packing [N]  plane crack [N]\n");
  for (int k = 0; k < 7; k++) {
    const PetscReal random = ForceAt(&curve[0], at[k]), plane = ForceAt(&curve[1], at[k]);

    print_message("           %9.3f  %11.1f  %15.1f  %+.1f %%\n", (double)(1e3 * at[k]), (double)random, (double)plane, (double)(100 * (random / plane - 1)));
  }
  print_message("           peak       %11.1f  %15.1f  %+.1f %%\n", (double)Peak(&curve[0]), (double)Peak(&curve[1]), (double)(100 * (Peak(&curve[0]) / Peak(&curve[1]) - 1)));
  print_message("           mean       %11.1f  %15.1f  %+.1f %%\n", (double)MeanForce(&curve[0], at[6]), (double)MeanForce(&curve[1], at[6]),
                (double)(100 * (MeanForce(&curve[0], at[6]) / MeanForce(&curve[1], at[6]) - 1)));
  CheckClose(Peak(&curve[0]), Peak(&curve[1]), 0.05);
  CheckClose(MeanForce(&curve[0], at[6]), MeanForce(&curve[1], at[6]), 0.05);
  for (int k = 0; k < 7; k++) CheckNear(ForceAt(&curve[0], at[k]), ForceAt(&curve[1], at[k]), 0.05 * Peak(&curve[1]));
  for (int k = 0; k < 5; k++) CheckClose(ForceAt(&curve[0], at[k]), ForceAt(&curve[1], at[k]), 0.05);
  PetscCall(PetscFree(curve));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPlaneCrack)

static const struct CMUnitTest tests[] = {TEST(TestPlaneCrack)};

CHECK_MAIN(tests)
