/*
  The thesis' area check (5.1.2, table 5.1) and its study of the stiffness factors alpha and beta (5.1.3), on packings of the same
  numbers of particles: its meshes are not at hand.

  Rectangles of 5 x 10 cm in plane stress, E = 20 MPa (only ratios matter), nu = 0.25; k_n = alpha E A/d, k_s = alpha beta G A/d: only with
  k_s growing with alpha too does nu not depend on it, as the thesis finds.
*/
#include "lab.h"
#include "dem_rule.h"

#define MESHES 5

typedef struct {
  PetscInt  dim, count;
  PetscReal spread;
} Case;

/* Relative deviations of 45 to 9 % in the thesis; a uniform distribution gives at most 0.6/sqrt 3 = 35 %. The last: a square lattice of 13 x 25. */
static const Case meshes[MESHES] = {{2, 2260, 0.6}, {2, 1262, 0.54}, {2, 725, 0.18}, {2, 1343, 0.16}, {2, 325, 0}};

static PetscErrorCode Mesh2(PetscInt which, TestBody *t)
{
  const PetscReal         low[3] = {0}, size[3] = {0.05, which == 4 ? 25 * 0.05 / 13 : 0.1, 1};
  const DemPackingOptions options = {.count = meshes[which].count, .spread = meshes[which].spread, .seed = 1};

  PetscFunctionBegin;
  PetscCall(PetscMemzero(t, sizeof(*t)));
  PetscCall(DemBodyCreateBox(2, low, size, 1, &t->body));
  if (which < 4) PetscCall(DemPackingCreate(&t->body, &options, &t->packing));
  else {
    t->packing.n = 325;
    PetscCall(PetscCalloc1(3 * 325, &t->packing.x));
    PetscCall(PetscMalloc1(325, &t->packing.r));
    for (PetscInt k = 0; k < 325; k++) {
      t->packing.r[k]         = 0.05 / 26;
      t->packing.x[3 * k]     = (2 * (k % 13) + 1) * 0.05 / 26;
      t->packing.x[3 * k + 1] = (2 * (k / 13) + 1) * 0.05 / 26;
    }
  }
  PetscCall(DemCellsCreate(&t->body, &t->packing, &t->cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Area of the bonds that cross horizontal cuts, seen from above, over the section: mean of the cuts. */
static PetscErrorCode CutArea(const TestBody *body, PetscBool polyhedron, PetscReal *ratio, PetscReal *coordination)
{
  const PetscInt  up = body->body.dim - 1, cuts = 9;
  const PetscReal H = body->body.high[up], section = DemBodyVolume(&body->body) / H;
  const DemRule   rule = {.elasticity = DEM_KDEM, .polyhedron = polyhedron, .range = 0.15, .normal_factor = 1, .shear_factor = 1};
  DemModel        model;

  PetscFunctionBegin;
  PetscCall(TestModelCreate(body, up == 2 ? DEM_SOLID : DEM_PLANE_STRESS, 1, 0.25, &model));
  PetscCall(DemModelSetRule(model, &rule));
  PetscCall(DemModelSetUp(model));
  *ratio = 0;
  for (PetscInt cut = 1; cut <= cuts; cut++)
    for (PetscInt e = 0; e < model->bonds.n; e++) {
      const PetscInt p = model->bonds.p[e], q = model->bonds.q[e], n = model->n;
      PetscReal      d = 0, level = H * cut / (cuts + 1), zp = model->x0[up * n + p], zq = model->x0[up * n + q];

      if ((zp < level) == (zq < level)) continue;
      for (PetscInt c = 0; c < 3; c++) d += PetscSqr(model->x0[c * n + q] - model->x0[c * n + p]);
      *ratio += model->net->area[e] * (zq - zp) * (zp < level ? 1 : -1) / PetscSqrtReal(d) / section / cuts;
    }
  *coordination = 2.0 * model->bonds.n / model->n;
  PetscCall(DemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestAreas(void)
{
  const PetscReal thesis[MESHES + 1] = {0.033, 0.026, 0.022, -0.014, 0, 0.009};
  PetscInt        count = 2000; /* -spheres 13500: the thesis' */

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-spheres", &count, NULL));
  for (PetscInt k = 0; k <= MESHES; k++) {
    PetscReal facets, poly, n_f, n_p;
    TestBody  body;

    if (k < MESHES) PetscCall(Mesh2(k, &body));
    else {
      const PetscReal         bottom[3] = {0};
      const DemPackingOptions options = {.count = count, .spread = 0.45, .seed = 1};

      PetscCall(PetscMemzero(&body, sizeof(body)));
      PetscCall(DemBodyCreateCylinder(bottom, 0.075, 0.3, 64, &body.body));
      PetscCall(DemPackingCreate(&body.body, &options, &body.packing));
      PetscCall(DemCellsCreate(&body.body, &body.packing, &body.cells));
    }
    PetscCall(CutArea(&body, PETSC_FALSE, &facets, &n_f));
    PetscCall(CutArea(&body, PETSC_TRUE, &poly, &n_p));
    print_message("           %-9s %5d particles: virtual polyhedra %+.1f %% of the section (%.2f bonds each; thesis %+.1f %%), facets %+.1e\n", k < 4 ? "rectangle" : k == 4 ? "lattice" : "cylinder",
                  (int)body.packing.n, 100 * (double)(poly - 1), (double)n_p, 100 * (double)thesis[k], (double)(facets - 1));
    CheckNear(facets, 1, 1e-10); /* closed cells: exact */
    CheckNear(poly, 1, 0.035); /* the largest of the thesis is 3.3 % */
    PetscCall(TestBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestAreas)

/* E and nu by the gauge between smooth platens, as the thesis' monitoring particles. */
static PetscErrorCode Stiffness(const TestBody *body, PetscReal alpha, PetscReal beta, PetscReal *E, PetscReal *nu)
{
  const DemRule rule = {.elasticity = DEM_KDEM, .polyhedron = PETSC_TRUE, .range = 0.15, .normal_factor = alpha, .shear_factor = alpha * beta};
  PetscReal    *x, g[6];
  DemModel      model;
  Stepper       stepper;
  Table         none, shift;

  PetscFunctionBegin;
  PetscCall(TestModelCreate(body, DEM_PLANE_STRESS, 1, 0.25, &model));
  PetscCall(DemModelSetRule(model, &rule));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(TableCreateConstant(-1e-10, &shift));
  PetscCall(DemModelFix(model, "ymin", 1, DEM_DISPLACEMENT, &none));
  PetscCall(DemModelFix(model, "ymax", 1, DEM_DISPLACEMENT, &shift));
  PetscCall(DemModelAddColumns(model, "gauge"));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetStepper(model, &stepper));
  PetscCall(PetscCalloc1(TestUnknowns(model), &x));
  PetscCall(TestEquilibrium(model, 1e-6, x, NULL));
  for (PetscInt c = 0; c < 6; c++) PetscCall(stepper.history(model, c, &g[c]));
  *E  = g[4];
  *nu = g[5];
  PetscCall(PetscFree(x));
  PetscCall(TableDestroy(&none));
  PetscCall(TableDestroy(&shift));
  PetscCall(DemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestFactors(void)
{
  const PetscReal betas[] = {0.1, 1, 2, 2.5, 3}; /* without any shear springs a packing of discs is next to a mechanism */
  PetscReal       E[MESHES][5], nu[MESHES][5];
  char            path[PETSC_MAX_PATH_LEN] = "";
  PetscBool       given;
  FILE           *csv = NULL;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(NULL, NULL, "-csv", path, sizeof(path), &given));
  if (given) {
    csv = fopen(path, "w");
    CheckTrue(csv != NULL);
    fprintf(csv, "mesh,discs,beta,E,nu\n");
  }
  for (PetscInt m = 0; m < MESHES; m++) {
    TestBody body;

    PetscCall(Mesh2(m, &body));
    print_message("           mesh %d, %d discs: E, nu at beta", (int)m + 1, (int)body.packing.n);
    for (PetscInt k = 0; k < 5; k++) {
      PetscCall(Stiffness(&body, 1, betas[k], &E[m][k], &nu[m][k]));
      print_message(" %g: %.3f %.3f;", (double)betas[k], (double)E[m][k], (double)nu[m][k]);
      if (csv) fprintf(csv, "%d,%d,%g,%.5f,%.5f\n", (int)m + 1, (int)body.packing.n, (double)betas[k], (double)E[m][k], (double)nu[m][k]);
    }
    print_message("\n");
    if (m == 2) {
      PetscReal E2, nu2;

      PetscCall(Stiffness(&body, 1.75, 1, &E2, &nu2)); /* linear in alpha; nu does not depend on it */
      CheckClose(E2, 1.75 * E[m][1], 0.02);            /* the platens' own springs stay as they are */
      CheckNear(nu2, nu[m][1], 0.01);
    }
    PetscCall(TestBodyDestroy(&body));
  }
  if (csv) fclose(csv);
  for (PetscInt m = 0; m < 4; m++) {
    for (PetscInt k = 1; k < 5; k++) { /* stiffer, and contracting less, the larger beta */
      CheckAbove(E[m][k], E[m][k - 1]);
      CheckBelow(nu[m][k], nu[m][k - 1]);
    }
    CheckNear(E[m][3], 1, 0.03);      /* E is recovered as the tangential stiffness becomes large: where k_s = k_n, the affine network of nu = 0 */
    CheckBelow(nu[m][4], 0.05);       /* and nu goes to zero, or a little below */
    CheckAbove(nu[m][0], 0.3);        /* largest without shear springs */
    CheckNear(nu[m][1], (1 - 0.4) / (3 + 0.4), 0.02); /* beta = 1: the affine estimate of a plane, 0.18 for 0.25 given; the thesis' meshes came nearer */
    CheckBelow(E[m][1], 1);           /* so an alpha above 1 fits E */
    for (PetscInt k = 1; k < 5; k++) CheckNear(E[m][k], E[0][k], 0.12); /* alike on all meshes but the lattice */
  }
  for (PetscInt k = 1; k < 5; k++) { /* the lattice contracts not at all */
    CheckNear(nu[4][k], 0, 1e-3);
    CheckClose(E[4][k], E[4][1], 1e-3);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFactors)

static const struct CMUnitTest tests[] = {TEST(TestAreas), TEST(TestFactors)};

CHECK_MAIN(tests)
