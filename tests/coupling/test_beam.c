/* The notched beam of examples/notched_beam: a random packing that may break anywhere against one plane crack of the same softening. */
#include "check.h"
#include "coupled.h"

#define MIDDLE    87.5e-3 /* mid-span [m] */
#define NOTCH     25e-3   /* its depth, and the ligament's */
#define HALF_NOTCH 1e-3
#define THICKNESS 50e-3
#define RADIUS    0.5e-3  /* mean particle radius, the example's own */
#define ROWS      4000

typedef struct {
  PetscInt  n;
  PetscReal cmod[ROWS], force[ROWS];
} Curve;

/* The straight line that lies best among the facets broken by more than half, by area: x = MIDDLE + at + slope (y - NOTCH). */
typedef struct {
  PetscReal at, slope;
} Line;

/* Distance of x from the line; normal[]: its unit normal, to the right. */
static PetscReal LineDistance(const Line *line, const PetscReal x[3], PetscReal normal[2])
{
  const PetscReal length = PetscSqrtReal(1 + PetscSqr(line->slope));

  normal[0] = 1 / length;
  normal[1] = -line->slope / length;
  return (x[0] - MIDDLE - line->at) * normal[0] + (x[1] - NOTCH) * normal[1];
}

static PetscErrorCode LineFit(DemModel dem, const DemCells *cells, Line *line)
{
  DemCracks cracks;
  PetscReal w = 0, wy = 0, wyy = 0, wx = 0, wxy = 0;

  PetscFunctionBegin;
  PetscCall(DemModelGetCracks(dem, &cracks));
  for (PetscInt k = 0; k < cracks.n; k++) {
    const PetscReal area = cells->area[cracks.facet[k]], x = cells->at[3 * cracks.facet[k]] - MIDDLE, y = cells->at[3 * cracks.facet[k] + 1] - NOTCH;

    if (cracks.broken[k] < 0.5) continue;
    w += area;
    wx += area * x;
    wy += area * y;
    wxy += area * x * y;
    wyy += area * y * y;
  }
  line->slope = (w * wxy - wx * wy) / (w * wyy - wy * wy);
  line->at    = (wx - line->slope * wy) / w;
  line->at    = PetscMax(-0.9 * HALF_NOTCH, PetscMin(0.9 * HALF_NOTCH, line->at)); /* out of the notch, not beside it */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Is the sphere's centre well inside the particles' part of the beam, which begins at height `low`? */
static PetscBool Inside(const PetscReal x[3], PetscReal low)
{
  const PetscReal clear = 0.5 * RADIUS;

  if (x[1] > 2 * NOTCH - clear || x[1] < low) return PETSC_FALSE;
  return (PetscBool)(x[1] > NOTCH + clear || PetscAbsReal(x[0] - MIDDLE) > HALF_NOTCH + clear);
}

/*
  A packing with one plane of facets along the line: near it the particles left of it and their mirror images.  A point of the
  plane is as far from a particle as from its image, so the facets on it join images and nothing else.
*/
static PetscErrorCode Mirror(const Line *line, DemPacking *packing)
{
  const PetscReal strip = 8 * RADIUS, clear = 0.5 * RADIUS;
  DemPacking      made = {0};
  PetscInt        images;
  PetscReal       n[2], low = PETSC_MAX_REAL;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(6 * packing->n, &made.x));
  PetscCall(PetscMalloc1(2 * packing->n, &made.r));
  for (PetscInt p = 0; p < packing->n; p++) low = PetscMin(low, packing->x[3 * p + 1]);
  for (PetscInt p = 0; p < packing->n; p++) {
    const PetscReal *x = &packing->x[3 * p], away = LineDistance(line, x, n);
    const PetscReal  image[3] = {x[0] - 2 * away * n[0], x[1] - 2 * away * n[1], x[2]};

    if (away > -clear || away < -strip || !Inside(image, low)) continue;
    for (PetscInt side = 0; side < 2; side++, made.n++) {
      PetscCall(PetscArraycpy(&made.x[3 * made.n], side ? image : x, 3));
      made.r[made.n] = packing->r[p];
    }
  }
  images = made.n;
  for (PetscInt p = 0; p < packing->n; p++) {
    const PetscReal *x    = &packing->x[3 * p];
    PetscBool        keep = (PetscBool)(PetscAbsReal(LineDistance(line, x, n)) > strip || x[1] < NOTCH - strip);

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

/* The scene examples/notched_beam/scene.yaml through the C API, as far as CMOD `last`. plane NULL: any facet may break, *found gets the
   line of the crack; else only the facets of that plane may break, along its normal. */
static PetscErrorCode Beam(const Line *plane, PetscReal last, Curve *curve, Line *found)
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
  if (plane) PetscCall(Mirror(plane, &c.packing));
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
    PetscReal  length = 0, normal[2] = {1, 0};

    PetscCall(PetscMalloc1(c.cells.n_facets, &breakable));
    for (PetscInt f = 0; f < c.cells.n_facets; f++) {
      breakable[f] = (PetscBool)(PetscAbsReal(LineDistance(plane, &c.cells.at[3 * f], normal)) < 1e-9);
      if (breakable[f]) length += c.cells.area[f] / THICKNESS;
    }
    CheckNear(length * normal[0], NOTCH, 1e-8); /* the plane goes from the notch to the top, and lies outside the overlap */
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
  if (found) PetscCall(LineFit(c.dem, &c.cells, found));
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

/*
  One plane crack of the same particles and softening curve, put where the random packing breaks (the best straight line through
  its crack): every opening, the peak and the mean force within 5 %.  The table shows the mid-span plane beside it: a crack some
  millimetres off it bears more, since the moment there is smaller.
*/
static PetscErrorCode TestPlaneCrack(void)
{
  const PetscReal at[7] = {0.01e-3, 0.02e-3, 0.03e-3, 0.05e-3, 0.075e-3, 0.1e-3, 0.15e-3};
  Curve          *curve, *random, *plane, *middle;
  Line            line, half = {0, 0};

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3, &curve));
  random = curve;
  plane  = curve + 1;
  middle = curve + 2;
  PetscCall(Beam(NULL, 0.167e-3, random, &line));
  PetscCall(Beam(&line, 0.167e-3, plane, NULL));
  PetscCall(Beam(&half, 0.167e-3, middle, NULL));
  print_message("           crack: %.2f mm beside mid-span at the notch, %.3f mm per mm of height\n", (double)(1e3 * line.at), (double)line.slope);
  print_message("           CMOD [mm]  packing [N]  its plane [N]          mid-span plane [N]\n");
  for (int k = 0; k < 7; k++) {
    const PetscReal a = ForceAt(random, at[k]), b = ForceAt(plane, at[k]), c = ForceAt(middle, at[k]);

    print_message("           %9.3f  %11.1f  %13.1f  %+.1f %%  %13.1f  %+.1f %%\n", (double)(1e3 * at[k]), (double)a, (double)b, (double)(100 * (a / b - 1)), (double)c, (double)(100 * (a / c - 1)));
  }
  for (int k = 0; k < 2; k++) {
    const PetscReal a = k ? MeanForce(random, at[6]) : Peak(random), b = k ? MeanForce(plane, at[6]) : Peak(plane), c = k ? MeanForce(middle, at[6]) : Peak(middle);

    print_message("           %9s  %11.1f  %13.1f  %+.1f %%  %13.1f  %+.1f %%\n", k ? "mean" : "peak", (double)a, (double)b, (double)(100 * (a / b - 1)), (double)c, (double)(100 * (a / c - 1)));
    CheckClose(a, b, 0.05);
    CheckClose(a, c, 0.05);
  }
  for (int k = 0; k < 7; k++) CheckClose(ForceAt(random, at[k]), ForceAt(plane, at[k]), 0.05);
  PetscCall(PetscFree(curve));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPlaneCrack)

static const struct CMUnitTest tests[] = {TEST(TestPlaneCrack)};

CHECK_MAIN(tests)
