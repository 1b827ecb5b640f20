/* pack.c - `cleave pack`: only the packing, with its quality report, a table and a picture. */
#include "app.h"
#include "files.h"

#define BINS 20
/* What the cells say of the packing. */
typedef struct {
  PetscInt  size[BINS], gap[BINS]; /* radius/mean from 0 in steps of 0.1; gap of facet neighbours/(r_i + r_j) from -0.2 in steps of 0.05 */
  PetscReal fabric;                /* largest |dim sum A n_i n_j/sum A - delta_ij| over the facets: 0 when no direction is preferred */
  PetscReal closure;               /* largest |sum A d n_i n_j + walls - V delta_ij|/V: (3.2), round-off */
} CellReport;

static void Count(PetscReal place, PetscInt bin[BINS])
{
  bin[place < 0 ? 0 : place >= BINS ? BINS - 1 : (PetscInt)place]++;
}

static PetscErrorCode ReadCells(AppCase *c, const DemPackingReport *r, CellReport *report)
{
  const PetscInt   dim = c->dim;
  const PetscReal *x = c->packing.x;
  const DemCells  *cells = &c->cells;
  PetscReal        sum[3][3] = {{0}}, close[3][3] = {{0}}, area = 0, volume = 0;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(report, sizeof(*report)));
  for (PetscInt p = 0; p < cells->n; p++) {
    Count(10 * c->packing.r[p] / r->mean_radius, report->size);
    volume += cells->volume[p];
  }
  for (PetscInt f = 0; f < cells->n_facets; f++) {
    const PetscInt p = cells->p[f], q = cells->q[f];
    PetscReal      n[3], d = 0;

    for (PetscInt i = 0; i < 3; i++) {
      n[i] = x[3 * q + i] - x[3 * p + i];
      d += n[i] * n[i];
    }
    d = PetscSqrtReal(d);
    Count(20 * (d / (c->packing.r[p] + c->packing.r[q]) - 1 + 0.2), report->gap);
    area += cells->area[f];
    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < 3; j++) {
        sum[i][j] += cells->area[f] * n[i] * n[j] / (d * d);
        close[i][j] += cells->area[f] * n[i] * n[j] / d;
      }
  }
  for (PetscInt w = 0; w < cells->n_walls; w++)
    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < 3; j++) close[i][j] += cells->wall_area[w] * cells->wall_normal[3 * w + i] * (cells->wall_at[3 * w + j] - x[3 * cells->wall_p[w] + j]);
  for (PetscInt i = 0; i < dim; i++)
    for (PetscInt j = 0; j < dim; j++) {
      report->fabric  = PetscMax(report->fabric, PetscAbsReal(dim * sum[i][j] / area - (i == j)));
      report->closure = PetscMax(report->closure, PetscAbsReal(close[i][j] / volume - (i == j)));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteBins(Json *json, const char *key, PetscReal first, PetscReal width, const PetscInt bin[BINS])
{
  PetscFunctionBegin;
  PetscCall(JsonBeginObject(json, key));
  PetscCall(JsonReal(json, "first", first));
  PetscCall(JsonReal(json, "width", width));
  PetscCall(JsonBeginArray(json, "count"));
  for (PetscInt k = 0; k < BINS; k++) PetscCall(JsonInt(json, NULL, bin[k]));
  PetscCall(JsonEnd(json));
  PetscCall(JsonEnd(json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteReport(AppCase *c, const DemPackingReport *r, const CellReport *cells, const char *directory)
{
  char path[PETSC_MAX_PATH_LEN];
  Json json;

  PetscFunctionBegin;
  PetscCall(BaseFormat(path, "%s/packing.json", directory));
  PetscCall(JsonOpen(path, &json));
  PetscCall(JsonInt(&json, "particles", c->packing.n));
  PetscCall(JsonReal(&json, "body_volume_m3", DemBodyVolume(&c->body)));
  PetscCall(JsonReal(&json, "porosity", r->porosity));
  PetscCall(JsonReal(&json, "coordination_gap_10_percent", r->coordination_10));
  PetscCall(JsonReal(&json, "coordination_gap_15_percent", r->coordination_15));
  PetscCall(JsonReal(&json, "mean_radius_m", r->mean_radius));
  PetscCall(JsonReal(&json, "relative_deviation", r->relative_deviation));
  PetscCall(JsonReal(&json, "largest_overlap", r->largest_overlap));
  PetscCall(JsonReal(&json, "flatness", r->flatness));
  if (cells) {
    PetscCall(JsonReal(&json, "fabric_deviator", cells->fabric));
    PetscCall(JsonReal(&json, "area_closure", cells->closure));
    PetscCall(WriteBins(&json, "radius_over_mean", 0, 0.1, cells->size));
    PetscCall(WriteBins(&json, "gap_of_facet_neighbours", -0.2, 0.05, cells->gap));
  }
  PetscCall(JsonReal(&json, "seconds", c->clock.seconds[c->clock.n - 1]));
  PetscCall(AppVersionsJson(&json));
  PetscCall(JsonClose(&json));

  printf("packing of '%s'\n", c->part[0].name);
  printf("  particles     %d, mean radius %.4g mm, deviation %.1f %%\n", (int)c->packing.n, (double)(1e3 * r->mean_radius), (double)(100 * r->relative_deviation));
  printf("  porosity      %.2f %%\n", (double)(100 * r->porosity));
  printf("  neighbours    %.2f within a gap of 10 %%, %.2f within 15 %%\n", (double)r->coordination_10, (double)r->coordination_15);
  printf("  overlap       at most %.2g of the sum of two radii\n", (double)r->largest_overlap);
  printf("  flat faces    touched to %.2g radii\n", (double)r->flatness);
  if (cells) printf("  facets        fabric off by %.2g, areas close to %.1e\n", (double)cells->fabric, (double)cells->closure);
  printf("  time          %.2f s\n", c->clock.seconds[c->clock.n - 1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppPack(const AppOptions *options, int *exit_code)
{
  AppCase          c;
  DemPackingReport report;
  char             directory[PETSC_MAX_PATH_LEN], path[PETSC_MAX_PATH_LEN];
  PetscBool        ran, bonded;
  CellReport       cells;

  PetscFunctionBegin;
  PetscCall(AppCaseRead(PETSC_COMM_WORLD, options, &c));
  if (c.method != APP_DEM) {
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.method", c.part[0].name));
    PetscCall(SceneFail(c.scene, path, "this body has no particles to pack; method: dem has"));
  }
  if (c.grain_body) PetscCall(SceneFail(c.scene, "bodies", "cleave pack makes the packing of one body, and here are %" PetscInt_FMT "; cleave run packs them all", c.n_parts));
  PetscCall(AppCasePack(&c));
  PetscCall(DemPackingGetReport(&c.packing, &c.body, &report));
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.bonded", c.part[0].name));
  PetscCall(SceneGetBool(c.scene, path, &bonded));
  if (bonded) {
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing", c.part[0].name));
    AppCallAt(c.scene, path, DemCellsCreate(&c.body, &c.packing, &c.cells));
    PetscCall(ReadCells(&c, &report, &cells));
  }
  PetscCall(AppOutputDirectory(options, sizeof(directory), directory));
  PetscCall(FileMakeDirectory(directory));
  PetscCall(BaseFormat(path, "%s/packing.csv", directory));
  PetscCall(DemPackingWrite(&c.packing, path));
  PetscCall(WriteReport(&c, &report, bonded ? &cells : NULL, directory));
  PetscCall(AppPython("app/packing.py", directory, 0, NULL, PETSC_FALSE, &ran));
  printf("written to %s\n", directory);
  *exit_code = 0;
  PetscCall(AppCaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
