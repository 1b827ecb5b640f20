/* Bonded solids against closed forms: ring under pressure, plate with a hole, cantilever, eigenfrequency. Errors and their slopes over three sizes
   (-levels 4: four). */
#include "lab.h"
#include "fem_case.h"

#define SIZES 4
static PetscInt levels = 3; /* -levels 4: the finest too */
static const PetscReal young = 1e12; /* strains of 1e-12: linear to 1e-12 */

/* Least squares slope of log(error) on log(h). */
static PetscReal Slope(PetscInt n, const PetscReal h[], const PetscReal error[])
{
  PetscReal mx = 0, my = 0, xx = 0, xy = 0;

  for (PetscInt i = 0; i < n; i++) {
    mx += PetscLogReal(h[i]) / n;
    my += PetscLogReal(error[i]) / n;
  }
  for (PetscInt i = 0; i < n; i++) {
    xx += PetscSqr(PetscLogReal(h[i]) - mx);
    xy += (PetscLogReal(h[i]) - mx) * (PetscLogReal(error[i]) - my);
  }
  return xy / xx;
}

static void Tell(const char *what, PetscInt n, const PetscReal h[], const PetscReal error[])
{
  print_message("           %-34s", what);
  for (PetscInt i = 0; i < n; i++) print_message(" %.2e", (double)error[i]);
  print_message("  slope %.2f\n", (double)Slope(n, h, error));
}

/* A quarter of a ring, inner radius 1: `sides` straight pieces; faces xmin inside, xmax outside (or "outer k" of each piece), ymin on y = 0, ymax on x = 0. */
static PetscErrorCode Quarter(PetscReal outer, PetscInt sides, PetscBool split, PetscReal h, PetscInt seed, TestBody *t)
{
  const PetscReal         origin[3] = {0}, length[3] = {1, 1, 1};
  const PetscInt          n[3] = {1, sides, 1};
  const DemPackingOptions options = {.radius = 0.5 * h, .spread = 0.2, .seed = seed};
  PetscInt                pieces;
  Mesh                    mesh;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(t, sizeof(*t)));
  PetscCall(MeshCreateBox(PETSC_COMM_SELF, "body", MESH_QUAD4, origin, length, n, &mesh));
  for (PetscInt i = 0; i < mesh.n_nodes; i++) {
    const PetscReal r = 1 + (outer - 1) * mesh.x[3 * i], a = mesh.x[3 * i + 1] * PETSC_PI / 2;

    mesh.x[3 * i]     = mesh.x[3 * i + 1] == 1 ? 0 : r * PetscCosReal(a);
    mesh.x[3 * i + 1] = r * PetscSinReal(a);
  }
  if (split) {
    PetscCall(CaseSplitGroup(&mesh, "xmax", "outer", &pieces));
    for (PetscInt g = 0; g < mesh.n_groups; g++) /* a facet belongs to one face */
      if (!strcmp(mesh.group[g].name, "xmax")) mesh.group[g].n_cells = 0;
  }
  PetscCall(DemBodyCreateFromMesh(&mesh, "body", 1, &t->body));
  PetscCall(MeshDestroy(&mesh));
  PetscCall(DemPackingCreate(&t->body, &options, &t->packing));
  PetscCall(DemCellsCreate(&t->body, &t->packing, &t->cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef void (*Field)(PetscReal nu, PetscReal x, PetscReal y, PetscReal u[2]);

#define OUTER 2.0
/* Lamé's ring, plane stress, unit pressure inside: E u_r = A [(1 - nu) r + (1 + nu) b^2/r], A = 1/(b^2 - 1). */
static void Lame(PetscReal nu, PetscReal x, PetscReal y, PetscReal u[2])
{
  const PetscReal r2 = x * x + y * y, b2 = OUTER * OUTER, f = 1 / (b2 - 1) * ((1 - nu) + (1 + nu) * b2 / r2) / young;

  u[0] = f * x;
  u[1] = f * y;
}

#define REACH 4.0
/* Kirsch's plate, plane stress, unit tension along x: displacement, and stress xx yy xy. */
static void Kirsch(PetscReal nu, PetscReal x, PetscReal y, PetscReal u[2])
{
  const PetscReal r = PetscSqrtReal(x * x + y * y), a = PetscAtan2Real(y, x), k = (3 - nu) / (1 + nu), f = (1 + nu) / (4 * young); /* 1/8G */

  u[0] = f * (r * (k + 1) * PetscCosReal(a) + 2 / r * ((1 + k) * PetscCosReal(a) + PetscCosReal(3 * a)) - 2 / (r * r * r) * PetscCosReal(3 * a));
  u[1] = f * (r * (k - 3) * PetscSinReal(a) + 2 / r * ((1 - k) * PetscSinReal(a) + PetscSinReal(3 * a)) - 2 / (r * r * r) * PetscSinReal(3 * a));
}

static void KirschStress(PetscReal x, PetscReal y, PetscReal s[3])
{
  const PetscReal r2 = 1 / (x * x + y * y), r4 = r2 * r2, a = PetscAtan2Real(y, x), c2 = PetscCosReal(2 * a), c4 = PetscCosReal(4 * a), s2 = PetscSinReal(2 * a), s4 = PetscSinReal(4 * a);

  s[0] = 1 - r2 * (1.5 * c2 + c4) + 1.5 * r4 * c4;
  s[1] = -r2 * (0.5 * c2 - c4) - 1.5 * r4 * c4;
  s[2] = -r2 * (0.5 * s2 + s4) + 1.5 * r4 * s4;
}

/* Displacement error in the mass-weighted mean square, relative to that of the field. */
static PetscErrorCode Error(DemModel model, const PetscReal *x, Field field, PetscReal nu, PetscReal *error)
{
  PetscReal sum = 0, norm = 0;
  DemState  s;

  PetscFunctionBegin;
  PetscCall(DemModelGetState(model, &s));
  for (PetscInt p = 0; p < s.n; p++) {
    PetscReal u[2];

    field(nu, s.x0[p], s.x0[s.n + p], u);
    for (PetscInt d = 0; d < 2; d++) {
      sum += s.mass[p] * PetscSqr(x[d * s.n + p] - u[d]);
      norm += s.mass[p] * u[d] * u[d];
    }
  }
  PetscCall(DemModelRestoreState(model, &s));
  *error = PetscSqrtReal(sum / norm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Quartered(PetscBool plate, PetscReal nu, PetscReal h, PetscInt seed, PetscReal *error)
{
  const PetscInt sides = (PetscInt)PetscCeilReal(PETSC_PI / 2 / h); /* the inner arc's straight pieces are as long as the particles */
  PetscReal     *x;
  TestBody       body;
  DemModel       model;
  Table          one, none;

  PetscFunctionBegin;
  PetscCall(Quarter(plate ? REACH : OUTER, sides, plate, h, seed, &body));
  PetscCall(TestModelCreate(&body, DEM_PLANE_STRESS, young, nu, &model));
  PetscCall(TableCreateConstant(1, &one));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(DemModelFix(model, "ymin", 1, DEM_DISPLACEMENT, &none));
  PetscCall(DemModelFix(model, "ymax", 0, DEM_DISPLACEMENT, &none));
  if (!plate) PetscCall(DemModelAddPressure(model, "xmin", &one));
  else
    for (PetscInt k = 0; k < sides; k++) {
      const PetscReal a = (k + 0.5) / sides * PETSC_PI / 2, r = REACH * PetscCosReal(0.25 * PETSC_PI / sides), n[2] = {PetscCosReal(a), PetscSinReal(a)};
      PetscReal       s[3], t[3];
      char            name[64];

      KirschStress(r * n[0], r * n[1], s);
      t[0] = s[0] * n[0] + s[2] * n[1];
      t[1] = s[2] * n[0] + s[1] * n[1];
      t[2] = 0;
      PetscCall(BaseFormat(name, "outer %d", (int)k));
      PetscCall(DemModelAddTraction(model, name, t, &one));
    }
  PetscCall(DemModelSetUp(model));
  PetscCall(PetscCalloc1(TestUnknowns(model), &x));
  PetscCall(TestEquilibrium(model, 1e-8, x, NULL));
  PetscCall(Error(model, x, plate ? Kirsch : Lame, nu, error));
  PetscCall(PetscFree(x));
  PetscCall(TableDestroy(&one));
  PetscCall(TableDestroy(&none));
  PetscCall(DemModelDestroy(&model));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Series(PetscBool plate, const PetscReal h[SIZES])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < 3; k++) {
    const PetscReal nu = 0.15 * k;
    PetscReal       e[SIZES];
    char            what[64];

    for (PetscInt i = 0; i < levels; i++) PetscCall(Quartered(plate, nu, h[i], 3, &e[i]));
    PetscCall(BaseFormat(what, "%s, nu %.2f:", plate ? "plate with a hole" : "ring under pressure", (double)nu));
    Tell(what, levels, h, e);
    CheckAbove(Slope(levels, h, e), 1.6);
    CheckBelow(e[levels - 1], 0.01);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestRing(void)
{
  const PetscReal h[SIZES] = {0.2, 0.1, 0.05, 0.025};

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-levels", &levels, NULL)); /* the first of the tests: for all of them */
  PetscCall(Series(PETSC_FALSE, h));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRing)

static PetscErrorCode TestPlate(void)
{
  const PetscReal h[SIZES] = {0.4, 0.2, 0.1, 0.05};

  PetscFunctionBeginUser;
  PetscCall(Series(PETSC_TRUE, h));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPlate)

/* Cantilever 8 depths long, plane strain, glued root, end shear; the reference: quadratic elements, the same problem. */
static PetscErrorCode CantileverReference(PetscReal nu, PetscReal *tip)
{
  const PetscReal   length[3] = {8, 1, 1};
  const PetscInt    n[3] = {256, 32, 1};
  const FemMaterial material = {.density = 1, .young = young, .poisson = nu};
  FemModel          model;
  Mesh              mesh;

  PetscFunctionBegin;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD8, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRAIN, FEM_STATIC, 1, &material, &model));
  for (PetscInt d = 0; d < 2; d++) PetscCall(CaseFix(model, "xmin", d, 0));
  PetscCall(CaseTraction(model, "xmax", 0, 1, 0));
  PetscCall(FemModelAddHistory(model, "displacement", "xmax"));
  PetscCall(CaseSolve(model));
  *tip = CaseHistory(model, "displacement(xmax).y");
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestCantilever(void)
{
  const PetscReal size[3] = {8, 1, 1}, push[3] = {0, 1, 0};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 2; k++) {
    const PetscReal nu = k ? 0.3 : 0.2;
    PetscReal       reference = 1, e[SIZES], h[SIZES];
    char            what[64];

    PetscCall(CantileverReference(nu, &reference));
    for (PetscInt i = 0; i < levels; i++) {
      PetscReal e2 = 0;

      h[i] = 0.25 / (1 << i);
      for (uint64_t seed = 1; seed <= 2; seed++) { /* mean square of two packings: one alone may be right by chance */
        PetscReal *x, tip;
        TestBody   body;
        DemModel   model;
        Stepper    stepper;
        Table      one, none;

        PetscCall(TestBodyCreate(2, size, 1 / h[i], 0.5, seed, &body));
        PetscCall(TestModelCreate(&body, DEM_PLANE_STRAIN, young, nu, &model));
        PetscCall(TableCreateConstant(1, &one));
        PetscCall(TableCreateConstant(0, &none));
        for (PetscInt d = 0; d < 2; d++) PetscCall(DemModelFix(model, "xmin", d, DEM_DISPLACEMENT, &none));
        PetscCall(DemModelAddTraction(model, "xmax", push, &one));
        PetscCall(DemModelAddHistory(model, "displacement", "xmax"));
        PetscCall(DemModelSetUp(model));
        PetscCall(DemModelGetStepper(model, &stepper));
        PetscCall(PetscCalloc1(TestUnknowns(model), &x));
        PetscCall(TestEquilibrium(model, 1e-8, x, NULL));
        PetscCall(stepper.history(model, 1, &tip));
        e2 += 0.5 * PetscSqr(tip / reference - 1);
        PetscCall(PetscFree(x));
        PetscCall(TableDestroy(&one));
        PetscCall(TableDestroy(&none));
        PetscCall(DemModelDestroy(&model));
        PetscCall(TestBodyDestroy(&body));
      }
      e[i] = PetscSqrtReal(e2);
    }
    PetscCall(BaseFormat(what, "cantilever's tip, nu %.2f:", (double)nu));
    Tell(what, levels, h, e);
    CheckAbove(Slope(levels, h, e), 1.6);
    CheckBelow(e[2], 0.006); /* 16 cells of depth */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCantilever)

/*
  First eigenfrequency of a square (cube) between smooth walls: u_x = sin(ax) cos(ay), u_y = -cos(ax) sin(ay), a = pi/L, free of
  divergence: omega = sqrt(2) a c_s, below the first of compression, a c_p. By inverse iteration; the Rayleigh quotient.
*/
static PetscErrorCode Frequency(PetscInt dim, PetscReal nu, PetscReal cells, PetscReal *error)
{
  const PetscReal size[3] = {1, 1, 1}, a = PETSC_PI, exact2 = 2 * a * a * young / (2 * (1 + nu)); /* density 1 */
  PetscReal      *x, *y, value = 0;
  TestBody        body;
  DemModel        model;
  DemState        s;
  Table           none;
  static const char *const faces[] = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};

  PetscFunctionBegin;
  PetscCall(TestBodyCreate(dim, size, cells, 0.6, 5, &body));
  PetscCall(TestModelCreate(&body, dim == 3 ? DEM_SOLID : DEM_PLANE_STRAIN, young, nu, &model));
  PetscCall(TableCreateConstant(0, &none));
  for (PetscInt f = 0; f < 2 * dim; f++) PetscCall(DemModelFix(model, faces[f], f / 2, DEM_DISPLACEMENT, &none));
  PetscCall(DemModelSetUp(model));
  const PetscInt n = TestUnknowns(model), nr = dim == 3 ? 3 : 1;

  PetscCall(PetscCalloc2(n, &x, n, &y));
  PetscCall(DemModelGetState(model, &s));
  for (PetscInt p = 0; p < s.n; p++) {
    y[p]       = PetscSinReal(a * s.x0[p]) * PetscCosReal(a * s.x0[s.n + p]);
    y[s.n + p] = -PetscCosReal(a * s.x0[p]) * PetscSinReal(a * s.x0[s.n + p]);
  }
  for (PetscInt round = 0; round < 5; round++) {
    PetscReal xy = 0, xx = 0, most = 0;

    for (PetscInt p = 0; p < s.n; p++) {
      for (PetscInt d = 0; d < dim; d++) s.f_ext[d * s.n + p] = s.mass[p] * y[d * s.n + p];
      for (PetscInt d = 0; d < nr; d++) s.t_ext[(dim == 2 ? 2 : d) * s.n + p] = s.inertia[p] * y[(dim + d) * s.n + p];
    }
    for (PetscInt i = 0; i < n; i++) x[i] = y[i] / exact2; /* a good start */
    PetscCall(TestEquilibrium(model, 1e-8, x, NULL));
    for (PetscInt i = 0; i < n; i++) {
      const PetscReal m = i < dim * s.n ? s.mass[i % s.n] : s.inertia[i % s.n];

      xy += m * x[i] * y[i];
      xx += m * x[i] * x[i];
      most = PetscMax(most, PetscAbsReal(x[i]));
    }
    value = xy / xx;
    for (PetscInt i = 0; i < n; i++) y[i] = x[i] / most;
  }
  *error = PetscAbsReal(PetscSqrtReal(value / exact2) - 1);
  PetscCall(DemModelRestoreState(model, &s));
  PetscCall(PetscFree2(x, y));
  PetscCall(TableDestroy(&none));
  PetscCall(DemModelDestroy(&model));
  PetscCall(TestBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestFrequency(void)
{
  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt k = 0; k < 3; k++) {
      const PetscInt  sizes = dim == 3 ? levels - 1 : levels;
      const PetscReal nu = 0.15 * k;
      PetscReal       e[SIZES], h[SIZES];
      char            what[64];

      for (PetscInt i = 0; i < sizes; i++) {
        const PetscReal cells = (dim == 3 ? 4 : 8) * (1 << i);

        h[i] = 1 / cells;
        PetscCall(Frequency(dim, nu, cells, &e[i]));
      }
      PetscCall(BaseFormat(what, "%s between walls, nu %.2f:", dim == 3 ? "cube" : "square", (double)nu));
      Tell(what, sizes, h, e);
      CheckAbove(Slope(sizes, h, e), 1.6);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFrequency)

static const struct CMUnitTest tests[] = {TEST(TestRing), TEST(TestPlate), TEST(TestCantilever), TEST(TestFrequency)};

CHECK_MAIN(tests)
