/* test_scene_ranks.c - two ranks: rank 0 reads the file, both hold the same scene or raise the same error. */
#include "scene_text.h"

static PetscMPIInt rank;

/* Only rank 0 has the file: rank 1 names one that is not there. */
static PetscErrorCode ReadTogether(const char *text, Scene *scene)
{
  char path[256];

  if (rank == 0) SceneTextWrite("scene.yaml", text, strlen(text));
  snprintf(path, sizeof(path), "%s/%s", folder, rank ? "nowhere.yaml" : "scene.yaml");
  return SceneRead(PETSC_COMM_WORLD, path, 0, NULL, scene);
}

static PetscErrorCode TestSameScene(void)
{
  Scene     scene;
  PetscReal value, other;
  char      path[256];

  PetscFunctionBeginUser;
  PetscCall(ReadTogether(core, &scene));
  PetscCall(SceneGetReal(scene, "materials.rock.young", &value));
  CheckNear(value, 28e9, 0);
  PetscCallMPI(MPI_Allreduce(&value, &other, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  CheckNear(other, 56e9, 0);
  snprintf(path, sizeof(path), "%s/resolved.yaml", folder);
  PetscCall(SceneWriteResolved(scene, path));
  CheckInt(access(path, F_OK), rank ? -1 : 0);
  PetscCall(SceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSameScene)

static PetscErrorCode TestSameError(void)
{
  Scene scene;

  PetscFunctionBeginUser;
  CheckFails(ReadTogether("time: {end: 1 kg}\nmaterials: {m: {density: 1 kg/m3, young: 1 Pa, poisson: 0}}\nbodies: {b: {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: fem, material: m, mesh: {size: 1 m}}}\n", &scene), PETSC_ERR_USER_INPUT, ":1:13: error: end: 1 kg is a mass; end wants s");
  CheckFails(ReadTogether("time: {end: 1 s}\nmaterials: {m: {density: 1 kg/m3, young: 1 Pa, poisson: 0}}\nbodies: {b: {geometry: b.geo, method: fem, material: m}}\n", &scene), PETSC_ERR_USER_INPUT, ":3:24: error: there is no file 'b.geo'");
  CheckFails(SceneRead(PETSC_COMM_WORLD, "/nowhere/scene.yaml", 0, NULL, &scene), PETSC_ERR_USER_INPUT, "/nowhere/scene.yaml: error: there is no such file");
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSameError)

static int Begin(void **state)
{
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  return SceneTextBegin(state);
}

static const struct CMUnitTest tests[] = {TEST(TestSameScene), TEST(TestSameError)};

int main(int argc, char **argv)
{
  int failed;

  if (BaseInitialize(&argc, &argv)) return 99;
  failed = cmocka_run_group_tests_name(__FILE__, tests, Begin, SceneTextEnd);
  if (BaseFinalize()) return 98;
  return failed;
}
