/* test_scene_keys.c - the table itself: complete rows, defaults that pass their own check, the committed reference page. */
#include "scene_impl.h"
#include "scene_text.h"
#include "units.h"

static PetscErrorCode TestRowsAreComplete(void)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < SceneKeyCount(); k++) {
    const SceneKey *row      = SceneKeyRow(k);
    const PetscBool quantity = (PetscBool)(row->type == SCENE_REAL || row->type == SCENE_INT || row->type == SCENE_VECTOR || row->type == SCENE_TABLE);
    PetscReal       low, high, got;
    PetscBool       low_in, high_in;
    UnitsResult     why;

    if (!row->help || strlen(row->help) < 4 || row->help[strlen(row->help) - 1] == '.') fail_msg("key %s: help", row->path);
    if (!row->equation || !row->equation[0]) fail_msg("key %s: equation or '-'", row->path);
    if (!row->unit || quantity != (row->unit[0] != 0)) fail_msg("key %s: a unit or '-' for quantities, \"\" for the others", row->path);
    if (quantity) {
      PetscCall(UnitsConvert(row->unit, row->unit[0] == '-' ? "%" : row->unit, 1, &got, &why));
      CheckInt(why, UNITS_OK);
    }
    if (row->preset && (row->flags & SCENE_REQUIRED)) fail_msg("key %s: required, and a default", row->path);
    if (row->range && !quantity) fail_msg("key %s: a range of no quantity", row->path);
    if (row->type == SCENE_CHOICE && !row->choices) fail_msg("key %s: no choices", row->path);
    PetscCall(SceneKeyRange(row, &low, &high, &low_in, &high_in));
    CheckTrue(low < high);
    for (PetscInt j = 0; j < k; j++)
      if (!strcmp(row->path, SceneKeyRow(j)->path)) fail_msg("key %s stands twice", row->path);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRowsAreComplete)

/* Every row is reached by the path of a scene, and by no other. */
static PetscErrorCode TestRowsAreFound(void)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < SceneKeyCount(); k++) {
    char path[256] = "";

    for (const char *c = SceneKeyRow(k)->path; *c; c++) {
      if (*c == '*') strcat(path, "my name");
      else if (*c == '[') strcat(path, "[3");
      else strncat(path, c, 1);
    }
    if (SceneKeyFind(path) != SceneKeyRow(k)) fail_msg("path %s does not find its row", path);
    if (k) {
      strcat(path, "?");
      CheckTrue(SceneKeyFind(path) == NULL || strchr(SceneKeyRow(k)->path, '*') == SceneKeyRow(k)->path + strlen(SceneKeyRow(k)->path) - 1 || SceneKeyRow(k)->path[strlen(SceneKeyRow(k)->path) - 1] == ']');
    }
  }
  CheckTrue(SceneKeyFind("conditions") != NULL && SceneKeyFind("conditions.fix") == NULL && SceneKeyFind("time[0]") == NULL && SceneKeyFind("[") == NULL && SceneKeyFind("..") == NULL);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRowsAreFound)

/* A scene whose flow text is given, to ask for defaults in two and three dimensions. */
static PetscErrorCode TestDefaultsPassTheirCheck(void)
{
  static const char *const scenes[] = {"time: {end: 1 s}\nmaterials: {m: {density: 1 kg/m3, young: 1 Pa, poisson: 0}}\nbodies: {b: {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: fem, material: m, mesh: {size: 1 m}}}\n",
                                       "dimension: 2\ntime: {end: 1 s}\nmaterials: {m: {density: 1 kg/m3, young: 1 Pa, poisson: 0}}\nbodies: {b: {geometry: {disc: {radius: 1 m}}, method: dem, material: m, dem: {packing: {radius: 0.1 m}}}}\n"};

  PetscFunctionBeginUser;
  for (PetscInt s = 0; s < 2; s++) {
    Scene scene;

    PetscCall(SceneTextRead(scenes[s], strlen(scenes[s]), 0, NULL, &scene));
    for (PetscInt k = 0; k < SceneKeyCount(); k++) {
      const SceneKey *row = SceneKeyRow(k);
      SceneNode       node;

      if (!row->preset) continue;
      PetscCall(SceneDefaultNode(scene, row, scene->spare, &node));
      if (!node->good || scene->n_faults) fail_msg("default of %s: %s", row->path, scene->n_faults ? scene->fault[0].text : "refused");
    }
    PetscCall(SceneDestroy(&scene));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestDefaultsPassTheirCheck)

/* docs/scene.md is what the table prints; CLEAVE_UPDATE=1 in the environment writes it. */
static PetscErrorCode TestReferencePage(void)
{
  const char *page = CLEAVE_SOURCE_DIR "/docs/scene.md";
  char       *made = NULL, *kept;
  size_t      n = 0;
  FILE       *out = open_memstream(&made, &n), *in;

  PetscFunctionBeginUser;
  PetscCall(SceneWriteReference(out));
  fclose(out);
  if (getenv("CLEAVE_UPDATE")) {
    out = fopen(page, "w");
    CheckTrue(out && fwrite(made, 1, n, out) == n && !fclose(out));
  }
  for (PetscInt k = 1; k < SceneKeyCount(); k++) {
    char cell[256];

    snprintf(cell, sizeof(cell), "| `%s` |", SceneKeyRow(k)->path);
    CheckContains(made, cell);
  }
  kept = calloc(1, n + 2);
  in   = fopen(page, "r");
  CheckTrue(in != NULL);
  CheckInt(fread(kept, 1, n + 1, in), n);
  fclose(in);
  if (strcmp(made, kept)) fail_msg("docs/scene.md is not what the table prints; run CLEAVE_UPDATE=1 ctest -R scene_keys");
  free(made);
  free(kept);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestReferencePage)

static const struct CMUnitTest tests[] = {TEST(TestRowsAreComplete), TEST(TestRowsAreFound), TEST(TestDefaultsPassTheirCheck), TEST(TestReferencePage)};

SCENE_MAIN(tests)
