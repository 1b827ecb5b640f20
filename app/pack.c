/* pack.c - `cleave pack`: only the packing, with its quality report, a table and a picture. */
#include "app.h"
#include "files.h"

static PetscErrorCode WriteReport(AppCase *c, const DemPackingReport *r, const char *directory)
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
  PetscCall(JsonReal(&json, "seconds", c->clock.seconds[c->clock.n - 1]));
  PetscCall(AppVersionsJson(&json));
  PetscCall(JsonClose(&json));

  printf("packing of '%s'\n", c->part[0].name);
  printf("  particles     %d, mean radius %.4g mm, deviation %.1f %%\n", (int)c->packing.n, (double)(1e3 * r->mean_radius), (double)(100 * r->relative_deviation));
  printf("  porosity      %.2f %%\n", (double)(100 * r->porosity));
  printf("  neighbours    %.2f within a gap of 10 %%, %.2f within 15 %%\n", (double)r->coordination_10, (double)r->coordination_15);
  printf("  overlap       at most %.2g of the sum of two radii\n", (double)r->largest_overlap);
  printf("  flat faces    touched to %.2g radii\n", (double)r->flatness);
  printf("  time          %.2f s\n", c->clock.seconds[c->clock.n - 1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppPack(const AppOptions *options, int *exit_code)
{
  AppCase          c;
  DemPackingReport report;
  char             directory[PETSC_MAX_PATH_LEN], path[PETSC_MAX_PATH_LEN];
  PetscBool        ran;

  PetscFunctionBegin;
  PetscCall(AppCaseRead(PETSC_COMM_WORLD, options, &c));
  if (c.method != APP_DEM) {
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.method", c.part[0].name));
    PetscCall(SceneFail(c.scene, path, "this body has no particles to pack; method: dem has"));
  }
  if (c.grain_body) PetscCall(SceneFail(c.scene, "bodies", "cleave pack makes the packing of one body, and here are %" PetscInt_FMT "; cleave run packs them all", c.n_parts));
  PetscCall(AppCasePack(&c));
  PetscCall(DemPackingGetReport(&c.packing, &c.body, &report));
  PetscCall(AppOutputDirectory(options, sizeof(directory), directory));
  PetscCall(FileMakeDirectory(directory));
  PetscCall(BaseFormat(path, "%s/packing.csv", directory));
  PetscCall(DemPackingWrite(&c.packing, path));
  PetscCall(WriteReport(&c, &report, directory));
  PetscCall(AppPython("app/packing.py", directory, 0, NULL, &ran));
  printf("written to %s\n", directory);
  *exit_code = 0;
  PetscCall(AppCaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
