/* test_cells.c - power cells: sums exact on every body, known lattices, brute force in 2D, notches not crossed. */
#include "body_cases.h"
#include "check.h"
#include "dem_cells_impl.h"
#include "dem_pack_impl.h"
#include <omp.h>

static PetscErrorCode NewPacking(PetscInt n, DemPacking *packing)
{
  PetscFunctionBegin;
  packing->n = n;
  PetscCall(PetscCalloc1(3 * n, &packing->x));
  PetscCall(PetscMalloc1(n, &packing->r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n centres at random inside the body; small radii spread tenfold, so that no particle hides another. */
static PetscErrorCode RandomPacking(const DemBody *body, PetscInt n, PetscInt seed, DemPacking *packing)
{
  DemBodySearch search;
  PetscInt64    k = 0;

  PetscFunctionBegin;
  PetscCall(NewPacking(n, packing));
  PetscCall(DemBodySearchCreate(body, 0, (body->high[0] - body->low[0]) / 10, &search));
  for (PetscInt p = 0; p < n; p++) {
    do {
      for (PetscInt c = 0; c < body->dim; c++) packing->x[3 * p + c] = body->low[c] + (body->high[c] - body->low[c]) * DemPackRandom(seed, 0, k++);
    } while (!DemBodySearchInside(&search, &packing->x[3 * p]));
    packing->r[p] = (body->high[0] - body->low[0]) * (body->dim == 2 ? 3e-6 : 3e-4) * (1 + 9 * DemPackRandom(seed, 1, p));
  }
  PetscCall(DemBodySearchDestroy(&search));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Eqs (3.2), (3.3): per cell sum A n = 0 and sum A n (x) (x_f - x_p) = V_p I; globally sum V = V and, face by face, the area. */
static PetscErrorCode CheckSums(const DemBody *body, const DemPacking *packing, const DemCells *cells, PetscReal tolerance)
{
  const PetscInt dim = body->dim;
  PetscReal      volume = 0, *close, *surface, *sum, *face_area;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(9 * cells->n, &close));
  PetscCall(PetscCalloc1(3 * cells->n, &sum));
  PetscCall(PetscCalloc1(cells->n, &surface));
  PetscCall(PetscCalloc1(2 * body->n_faces, &face_area));
  for (PetscInt k = 0; k < cells->n_facets + cells->n_walls; k++) {
    const PetscInt   w = k - cells->n_facets, p = w < 0 ? cells->p[k] : cells->wall_p[w];
    const PetscReal *at = w < 0 ? &cells->at[3 * k] : &cells->wall_at[3 * w], A = w < 0 ? cells->area[k] : cells->wall_area[w];
    PetscReal        n[3], d = 0;

    CheckTrue(A > 0);
    for (PetscInt c = 0; c < 3; c++) {
      n[c] = w < 0 ? packing->x[3 * cells->q[k] + c] - packing->x[3 * p + c] : cells->wall_normal[3 * w + c];
      d += n[c] * n[c];
    }
    for (PetscInt c = 0; c < 3; c++) n[c] /= PetscSqrtReal(d);
    for (PetscInt side = 0; side < (w < 0 ? 2 : 1); side++) {
      const PetscInt  o = side ? cells->q[k] : p;
      const PetscReal sign = side ? -1 : 1;

      surface[o] += A;
      for (PetscInt i = 0; i < 3; i++) {
        sum[3 * o + i] += sign * A * n[i];
        for (PetscInt j = 0; j < 3; j++) close[9 * o + 3 * i + j] += sign * A * n[i] * (at[j] - packing->x[3 * o + j]);
      }
    }
    if (w >= 0)
      face_area[cells->wall_face[w]] += A;
    else
      CheckTrue(cells->p[k] < cells->q[k]);
    if (w < 0 && k > 0) CheckTrue(cells->p[k - 1] < cells->p[k] || (cells->p[k - 1] == cells->p[k] && cells->q[k - 1] < cells->q[k]));
    if (w > 0) CheckTrue(cells->wall_p[w - 1] <= p);
  }
  for (PetscInt p = 0; p < cells->n; p++) {
    volume += cells->volume[p];
    for (PetscInt i = 0; i < dim; i++) {
      CheckNear(sum[3 * p + i], 0, tolerance * surface[p]);
      for (PetscInt j = 0; j < dim; j++) CheckNear(close[9 * p + 3 * i + j], i == j ? cells->volume[p] : 0, tolerance * cells->volume[p]);
    }
  }
  CheckClose(volume, DemBodyVolume(body), 1e-12);
  for (PetscInt k = 0; k < body->n_simplices; k++) {
    const PetscReal *s = &body->simplex[3 * dim * k];
    PetscReal        a[3], u[3], v[3];

    for (PetscInt c = 0; c < 3; c++) {
      u[c] = s[3 + c] - s[c];
      v[c] = dim == 3 ? s[6 + c] - s[c] : (c == 2 ? 2 * body->thickness : 0);
    }
    for (PetscInt c = 0; c < 3; c++) a[c] = 0.5 * (u[(c + 1) % 3] * v[(c + 2) % 3] - u[(c + 2) % 3] * v[(c + 1) % 3]);
    face_area[body->n_faces + body->simplex_face[k]] += PetscSqrtReal(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
  }
  for (PetscInt f = 0; f < body->n_faces; f++) CheckClose(face_area[f], face_area[body->n_faces + f], 1e-12);
  PetscCall(PetscFree(close));
  PetscCall(PetscFree(sum));
  PetscCall(PetscFree(surface));
  PetscCall(PetscFree(face_area));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckBody(DemBody *body, PetscInt n)
{
  DemPackingOptions options = {.count = n, .spread = 0.3, .seed = 7};
  DemPacking        packing;
  DemCells          cells;

  PetscFunctionBegin;
  PetscCall(RandomPacking(body, n, 3, &packing));
  PetscCall(DemCellsCreate(body, &packing, &cells));
  PetscCall(CheckSums(body, &packing, &cells, 1e-11)); /* cells as flat as 1 : 100 lose digits */
  PetscCall(DemCellsDestroy(&cells));
  PetscCall(DemPackingDestroy(&packing));
  PetscCall(DemPackingCreate(body, &options, &packing));
  PetscCall(DemCellsCreate(body, &packing, &cells));
  PetscCall(CheckSums(body, &packing, &cells, 1e-12));
  PetscCall(DemCellsDestroy(&cells));
  PetscCall(DemPackingDestroy(&packing));
  PetscCall(DemBodyDestroy(body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Volumes fill the body and every cell closes: box, cylinder, disc, L, notched beam, cracked block. */
static PetscErrorCode TestSums(void)
{
  const PetscReal low[3] = {-0.01, 0, 0.3}, high[3] = {0.02, 0.02, 0.34}, centre[3] = {0.1, 0.2, 0};
  const PetscInt  square[3] = {8, 8, 3}, beam[3] = {15, 6, 3};
  DemBody         body;

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    PetscCall(DemBodyCreateBox(dim, low, high, 0.01, &body));
    PetscCall(CheckBody(&body, 1500));
    if (dim == 2)
      PetscCall(DemBodyCreateDisc(centre, 0.02, 48, 0.01, &body));
    else
      PetscCall(DemBodyCreateCylinder(centre, 0.02, 0.05, 48, &body));
    PetscCall(CheckBody(&body, 1500));
    PetscCall(GridBody(dim, square, 0.01, KeepL, 0, 0, &body));
    PetscCall(CheckBody(&body, 600));
    PetscCall(GridBody(dim, beam, 0.01, KeepNotched, 0, 0, &body));
    PetscCall(CheckBody(&body, 600));
    PetscCall(GridBody(dim, square, 0.01, KeepAll, 4, 5, &body));
    PetscCall(CheckBody(&body, 300));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSums)

/* Two particles in a box: the facet stands where the powers are equal, x = 1/2 (1/4 + 3/4) + (r0^2 - r1^2)/(2 d). */
static PetscErrorCode TestTwoParticles(void)
{
  const PetscReal low[3] = {0, 0, 0}, high[3] = {1, 1, 1}, where = 0.5 + (0.2 * 0.2 - 0.1 * 0.1) / (2 * 0.5);
  DemBody         body;
  DemPacking      packing;
  DemCells        cells;

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    const PetscReal t = dim == 2 ? 0.1 : 1;

    PetscCall(DemBodyCreateBox(dim, low, high, 0.1, &body));
    PetscCall(NewPacking(2, &packing));
    packing.x[0] = 0.25;
    packing.x[3] = 0.75;
    packing.x[1] = packing.x[4] = 0.5;
    if (dim == 3) packing.x[2] = packing.x[5] = 0.5;
    packing.r[0] = 0.2;
    packing.r[1] = 0.1;
    PetscCall(DemCellsCreate(&body, &packing, &cells));
    CheckInt(cells.n_facets, 1);
    CheckInt(cells.n_walls, dim == 2 ? 6 : 10);
    CheckClose(cells.volume[0], where * t, 1e-14);
    CheckClose(cells.area[0], t, 1e-14);
    CheckClose(cells.at[0], where, 1e-14);
    CheckClose(cells.centroid[0], where / 2, 1e-14);
    CheckClose(cells.centroid[3], (1 + where) / 2, 1e-14);
    CheckInt(cells.facet_start[1], dim == 2 ? 2 : 4);
    for (PetscInt k = 0; k < cells.facet_start[1]; k++) CheckClose(cells.at[0] + cells.corner[3 * k], where, 1e-14);
    PetscCall(DemCellsDestroy(&cells));
    PetscCall(DemPackingDestroy(&packing));
    PetscCall(DemBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTwoParticles)

/* Inner cells of lattices of cube side a: simple cubic, bcc (truncated octahedra), fcc (rhombic dodecahedra, whose
   four-fold corners are the hard case for a cutter). facets [2], areas [2] in a^2. */
static PetscErrorCode CheckLattice(PetscInt n_basis, const PetscReal basis[][3], PetscReal volume, const PetscInt facets[2], const PetscReal areas[2])
{
  const PetscInt  m = 5;
  const PetscReal low[3] = {0, 0, 0}, high[3] = {0.05, 0.05, 0.05}, a = 0.01;
  DemBody         body;
  DemPacking      packing;
  DemCells        cells;
  PetscInt        n = 0, *found;

  PetscFunctionBegin;
  PetscCall(DemBodyCreateBox(3, low, high, 1, &body));
  PetscCall(NewPacking(n_basis * m * m * m, &packing));
  for (PetscInt k = 0; k < m * m * m; k++)
    for (PetscInt b = 0; b < n_basis; b++, n++) {
      packing.r[n] = 0.003;
      packing.x[3 * n] = a * (k % m + 0.1 + basis[b][0]);
      packing.x[3 * n + 1] = a * (k / m % m + 0.1 + basis[b][1]);
      packing.x[3 * n + 2] = a * (k / m / m + 0.1 + basis[b][2]);
    }
  PetscCall(DemCellsCreate(&body, &packing, &cells));
  PetscCall(CheckSums(&body, &packing, &cells, 1e-12));
  PetscCall(PetscCalloc1(2 * n, &found));
  for (PetscInt f = 0; f < cells.n_facets; f++)
    for (PetscInt side = 0; side < 2; side++)
      for (PetscInt kind = 0; kind < 2; kind++)
        if (PetscAbsReal(cells.area[f] / (a * a) - areas[kind]) < 1e-10) found[2 * (side ? cells.q[f] : cells.p[f]) + kind]++;
  for (PetscInt p = 0; p < n; p++) {
    PetscBool inner = PETSC_TRUE;

    for (PetscInt c = 0; c < 3; c++) inner = inner && packing.x[3 * p + c] > 1.05 * a && packing.x[3 * p + c] < (m - 1.05) * a ? PETSC_TRUE : PETSC_FALSE;
    if (!inner) continue;
    CheckClose(cells.volume[p], volume * a * a * a, 1e-12);
    for (PetscInt kind = 0; kind < 2; kind++) CheckInt(found[2 * p + kind], facets[kind]);
    for (PetscInt c = 0; c < 3; c++) CheckNear(cells.centroid[3 * p + c], packing.x[3 * p + c], 1e-12 * a);
  }
  PetscCall(PetscFree(found));
  PetscCall(DemCellsDestroy(&cells));
  PetscCall(DemPackingDestroy(&packing));
  PetscCall(DemBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestLattices(void)
{
  const PetscReal sc[1][3] = {{0, 0, 0}}, bcc[2][3] = {{0, 0, 0}, {0.5, 0.5, 0.5}}, fcc[4][3] = {{0, 0, 0}, {0, 0.5, 0.5}, {0.5, 0, 0.5}, {0.5, 0.5, 0}};
  const PetscInt  six[2] = {6, 0}, fourteen[2] = {8, 6}, twelve[2] = {12, 0};
  const PetscReal cube[2] = {1, -1}, octa[2] = {3 * PetscSqrtReal(3.) / 16, 0.125}, dodeca[2] = {PetscSqrtReal(2.) / 8, -1};

  PetscFunctionBeginUser;
  PetscCall(CheckLattice(1, sc, 1, six, cube));
  PetscCall(CheckLattice(2, bcc, 0.5, fourteen, octa));
  PetscCall(CheckLattice(4, fcc, 0.25, twelve, dodeca));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestLattices)

/* Keep the part of a polygon with nx x + ny y <= c; returns its corners. */
static PetscInt CutPolygon(PetscInt n, PetscReal (*x)[2], PetscReal nx, PetscReal ny, PetscReal c)
{
  PetscReal y[256][2];
  PetscInt  m = 0;

  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *a = x[k], *b = x[(k + 1) % n], s = nx * a[0] + ny * a[1] - c, t = nx * b[0] + ny * b[1] - c;

    if (s <= 0) {
      y[m][0] = a[0];
      y[m++][1] = a[1];
    }
    if (s * t < 0) {
      y[m][0] = a[0] + s / (s - t) * (b[0] - a[0]);
      y[m++][1] = a[1] + s / (s - t) * (b[1] - a[1]);
    }
  }
  for (PetscInt k = 0; k < m; k++)
    for (PetscInt e = 0; e < 2; e++) x[k][e] = y[k][e];
  return m;
}

/* The slow twin: every cell cut by the bisectors with all others, in any order. */
static PetscErrorCode TestBruteForce2D(void)
{
  const PetscReal low[3] = {0, 0, 0}, high[3] = {0.3, 0.1, 0};
  DemBody         body;
  DemPacking      packing;
  DemCells        cells;

  PetscFunctionBeginUser;
  PetscCall(DemBodyCreateBox(2, low, high, 0.01, &body));
  PetscCall(RandomPacking(&body, 400, 11, &packing));
  for (PetscInt p = 0; p < packing.n; p++) packing.r[p] *= 100; /* overlapping, some centres outside their cells */
  {
    PetscErrorCode code;

    BaseErrorQuiet(PETSC_TRUE);
    code = DemCellsCreate(&body, &packing, &cells);
    BaseErrorQuiet(PETSC_FALSE);
    if (code) { /* some are hidden: halve the radii until none is */
      for (PetscInt p = 0; p < packing.n; p++) packing.r[p] *= 0.1;
      PetscCall(DemCellsCreate(&body, &packing, &cells));
    }
  }
  for (PetscInt p = 0; p < packing.n; p++) {
    PetscReal x[256][2] = {{0, 0}, {0.3, 0}, {0.3, 0.1}, {0, 0.1}}, area = 0;
    PetscInt  n = 4;

    for (PetscInt q = 0; q < packing.n; q++) {
      const PetscReal dx = packing.x[3 * q] - packing.x[3 * p], dy = packing.x[3 * q + 1] - packing.x[3 * p + 1];

      if (q != p)
        n = CutPolygon(n, x, dx, dy,
                       dx * packing.x[3 * p] + dy * packing.x[3 * p + 1] + 0.5 * (dx * dx + dy * dy + PetscSqr(packing.r[p]) - PetscSqr(packing.r[q])));
    }
    for (PetscInt k = 0; k < n; k++) area += 0.5 * (x[k][0] * x[(k + 1) % n][1] - x[k][1] * x[(k + 1) % n][0]);
    CheckNear(cells.volume[p], 0.01 * area, 1e-12 * 0.01 * 0.03 / 400);
  }
  PetscCall(DemCellsDestroy(&cells));
  PetscCall(DemPackingDestroy(&packing));
  PetscCall(DemBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBruteForce2D)

/* A crack without width: its two sides are joined only around its tip, within a particle of it. */
static PetscErrorCode TestCrackIsNotCrossed(void)
{
  const PetscInt m[3] = {8, 8, 3};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt seed = 1; seed <= 3; seed++) {
      DemPackingOptions options = {.count = dim == 2 ? 60 : 200, .spread = 0.4, .seed = seed};
      DemBody           body;
      DemPacking        packing;
      DemCells          cells;

      PetscCall(GridBody(dim, m, 0.01, KeepAll, 4, 5, &body)); /* at x = 0.04, up to y = 0.05 */
      PetscCall(DemPackingCreate(&body, &options, &packing));
      PetscCall(DemCellsCreate(&body, &packing, &cells));
      PetscCall(CheckSums(&body, &packing, &cells, 1e-12));
      for (PetscInt f = 0; f < cells.n_facets; f++) {
        const PetscReal a = packing.x[3 * cells.p[f]], b = packing.x[3 * cells.q[f]];

        for (PetscInt k = cells.facet_start[f]; k < cells.facet_start[f + 1]; k++) {
          const PetscReal x[2] = {cells.at[3 * f] + cells.corner[3 * k], cells.at[3 * f + 1] + cells.corner[3 * k + 1]};

          if (PetscMin(a, b) - 0.04 < 0 && (PetscMax(a, b) > 0.04 || x[0] > 0.04 + 1e-9))
            CheckBelow(0.05 - x[1], packing.r[cells.p[f]] + packing.r[cells.q[f]]);
          if (PetscMin(a, b) > 0.04 && x[0] < 0.04 - 1e-9) CheckBelow(0.05 - x[1], packing.r[cells.p[f]] + packing.r[cells.q[f]]);
        }
      }
      for (PetscInt w = 0; w < cells.n_walls; w++) /* walls on the crack belong to particles of their own side */
        if (PetscAbsReal(cells.wall_at[3 * w] - 0.04) < 1e-9 && PetscAbsReal(cells.wall_normal[3 * w]) > 0.9) {
          const PetscInt p = cells.wall_p[w];

          if (packing.x[3 * p + 1] < 0.045) CheckBelow((packing.x[3 * p] - 0.04) * cells.wall_normal[3 * w], 0);
        }
      PetscCall(DemCellsDestroy(&cells));
      PetscCall(DemPackingDestroy(&packing));
      PetscCall(DemBodyDestroy(&body));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCrackIsNotCrossed)

/* A side without a particle of its own cannot be filled. */
static PetscErrorCode TestNotchTooNarrow(void)
{
  const PetscInt m[3] = {8, 8, 3};
  DemBody        body;
  DemPacking     packing;
  DemCells       cells;

  PetscFunctionBeginUser;
  PetscCall(GridBody(2, m, 0.01, KeepAll, 4, 7, &body));
  PetscCall(NewPacking(1, &packing));
  packing.x[0] = 0.02;
  packing.x[1] = 0.02;
  packing.r[0] = 0.01;
  PetscCall(DemCellsCreate(&body, &packing, &cells)); /* joined above the tip: one cell */
  PetscCall(CheckSums(&body, &packing, &cells, 1e-12));
  PetscCall(DemCellsDestroy(&cells));
  PetscCall(DemBodyDestroy(&body));
  PetscCall(GridBody(2, m, 0.01, KeepAll, 4, 9, &body)); /* parted for good */
  CheckFails(DemCellsCreate(&body, &packing, &cells), PETSC_ERR_USER_INPUT, "notch is narrower than the particles");
  PetscCall(DemPackingDestroy(&packing));
  PetscCall(DemBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestNotchTooNarrow)

/* m^dim particles on a cubic lattice in the unit box, each moved at random by up to `shift` of the spacing; one more, if wanted, `apart` of a spacing from particle 0. */
static PetscErrorCode Lattice(PetscInt dim, PetscInt m, PetscReal shift, PetscReal apart, DemPacking *packing)
{
  const PetscInt n = dim == 2 ? m * m : m * m * m;

  PetscFunctionBegin;
  PetscCall(NewPacking(n + (apart > 0), packing));
  for (PetscInt p = 0; p < n; p++) {
    const PetscInt at[3] = {p % m, p / m % m, p / (m * m)};

    for (PetscInt c = 0; c < dim; c++) packing->x[3 * p + c] = (at[c] + 0.5 + shift * (2 * DemPackRandom(5, c, p) - 1)) / m;
    packing->r[p] = 0.5 / m;
  }
  if (apart > 0) {
    PetscCall(PetscArraycpy(&packing->x[3 * n], packing->x, 3));
    packing->x[3 * n] += apart / m;
    packing->r[n] = packing->r[0];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Edges where four (3D: corners where eight) cells meet, and all but meet: facets of vanishing area, slivers between all but coincident centres. */
static PetscErrorCode TestNearlyDegenerate(void)
{
  const PetscReal low[3] = {0, 0, 0}, high[3] = {1, 1, 1};
  DemBody         body;
  DemPacking      packing;
  DemCells        cells;

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    PetscCall(DemBodyCreateBox(dim, low, high, 1, &body));
    for (PetscInt k = 0; k <= 6; k++) {
      const PetscReal shift = k ? PetscPowReal(10, -17 + 2 * k) : 0; /* 0, 1e-15, 1e-13, ... 1e-5 */

      PetscCall(Lattice(dim, 6, shift, 0, &packing));
      PetscCall(DemCellsCreate(&body, &packing, &cells));
      PetscCall(CheckSums(&body, &packing, &cells, 1e-11));
      for (PetscInt p = 0; p < packing.n; p++) CheckClose(cells.volume[p], dim == 2 ? 1. / 36 : 1. / 216, 10 * shift + 1e-12);
      PetscCall(DemCellsDestroy(&cells));
      PetscCall(DemPackingDestroy(&packing));
    }
    for (PetscInt k = 0; k < 4; k++) { /* centres 1e-5, 1e-4, .. 1e-2 of the spacing apart halve a cell; its other facets keep their digits */
      const PetscReal apart = PetscPowReal(10, -5 + k);

      PetscCall(Lattice(dim, 6, 0, apart, &packing));
      PetscCall(DemCellsCreate(&body, &packing, &cells));
      CheckClose(cells.volume[0] + cells.volume[packing.n - 1], dim == 2 ? 1. / 36 : 1. / 216, 2 * apart);
      PetscCall(CheckSums(&body, &packing, &cells, 1e-9));
      PetscCall(DemCellsDestroy(&cells));
      PetscCall(DemPackingDestroy(&packing));
    }
    PetscCall(Lattice(dim, 6, 0, 1e-7, &packing));
    CheckFails(DemCellsCreate(&body, &packing, &cells), PETSC_ERR_USER_INPUT, "or as good as the same; remove one");
    PetscCall(DemPackingDestroy(&packing));
    PetscCall(DemBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestNearlyDegenerate)

static PetscErrorCode TestRefusals(void)
{
  const PetscReal low[3] = {0, 0, 0}, high[3] = {1, 1, 1};
  DemBody         body;
  DemPacking      packing;
  DemCells        cells;

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    PetscCall(DemBodyCreateBox(dim, low, high, 1, &body));
    PetscCall(NewPacking(3, &packing));
    for (PetscInt p = 0; p < 3; p++) {
      for (PetscInt c = 0; c < dim; c++) packing.x[3 * p + c] = 0.5;
      packing.r[p] = 0.1;
    }
    packing.x[3] = 0.2;
    packing.x[6] = 0.2;
    CheckFails(DemCellsCreate(&body, &packing, &cells), PETSC_ERR_USER_INPUT, "Particles 1 and 2 have the same centre");
    packing.x[6] = 0.21;
    packing.r[2] = 0.3;
    CheckFails(DemCellsCreate(&body, &packing, &cells), PETSC_ERR_USER_INPUT, "Particle 1 at (0.2, 0.5");
    packing.r[2] = 0;
    CheckFails(DemCellsCreate(&body, &packing, &cells), PETSC_ERR_USER_INPUT, "radii above 0");
    packing.r[2] = 0.1;
    packing.x[0] = NAN;
    CheckFails(DemCellsCreate(&body, &packing, &cells), PETSC_ERR_USER_INPUT, "centres are finite");
    packing.n = 0;
    CheckFails(DemCellsCreate(&body, &packing, &cells), PETSC_ERR_USER_INPUT, "without particles");
    PetscCall(DemPackingDestroy(&packing));
    PetscCall(DemBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefusals)

/* The same bits from one thread and from three, with parts across a crack too. */
static PetscErrorCode TestThreads(void)
{
  const PetscInt    m[3] = {8, 8, 3}, before = omp_get_max_threads();
  DemPackingOptions options = {.count = 2500, .spread = 0.4, .seed = 2};
  DemBody           body;
  DemPacking        packing[2];
  DemCells          cells[2];

  PetscFunctionBeginUser;
  PetscCall(GridBody(3, m, 0.01, KeepAll, 4, 5, &body));
  for (PetscInt k = 0; k < 2; k++) {
    omp_set_num_threads(k ? 3 : 1);
    PetscCall(DemPackingCreate(&body, &options, &packing[k]));
    PetscCall(DemCellsCreate(&body, &packing[k], &cells[k]));
  }
  omp_set_num_threads((int)before);
  CheckInt(cells[0].n_facets, cells[1].n_facets);
  CheckInt(cells[0].n_walls, cells[1].n_walls);
  CheckTrue(!memcmp(packing[0].x, packing[1].x, 3 * packing[0].n * sizeof(PetscReal)));
  CheckTrue(!memcmp(packing[0].r, packing[1].r, packing[0].n * sizeof(PetscReal)));
  CheckTrue(!memcmp(cells[0].volume, cells[1].volume, cells[0].n * sizeof(PetscReal)));
  CheckTrue(!memcmp(cells[0].q, cells[1].q, cells[0].n_facets * sizeof(PetscInt)));
  CheckTrue(!memcmp(cells[0].area, cells[1].area, cells[0].n_facets * sizeof(PetscReal)));
  CheckTrue(!memcmp(cells[0].at, cells[1].at, 3 * cells[0].n_facets * sizeof(PetscReal)));
  CheckTrue(!memcmp(cells[0].wall_area, cells[1].wall_area, cells[0].n_walls * sizeof(PetscReal)));
  CheckTrue(!memcmp(cells[0].corner, cells[1].corner, 3 * cells[0].facet_start[cells[0].n_facets] * sizeof(float)));
  for (PetscInt k = 0; k < 2; k++) {
    PetscCall(DemCellsDestroy(&cells[k]));
    PetscCall(DemPackingDestroy(&packing[k]));
  }
  PetscCall(DemBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestThreads)

static const struct CMUnitTest tests[] = {TEST(TestTwoParticles),      TEST(TestLattices),       TEST(TestBruteForce2D), TEST(TestSums),
                                          TEST(TestCrackIsNotCrossed), TEST(TestNotchTooNarrow), TEST(TestNearlyDegenerate), TEST(TestRefusals),     TEST(TestThreads)};
CHECK_MAIN(tests)
