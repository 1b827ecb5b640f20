/* test_scene_good.c - scenes that are right: SI values, defaults, tables, overrides, resolved.yaml. */
#include "scene_text.h"

static Scene Read(const char *text, PetscInt n, const char *const set[])
{
  Scene scene = NULL;

  BaseErrorClear();
  if (SceneTextRead(text, strlen(text), n, set, &scene)) fail_msg("refused: %s", BaseReports());
  return scene;
}

static PetscErrorCode TestPlate(void)
{
  Scene       scene = Read(plate, 0, NULL);
  PetscReal   value, size[3];
  PetscInt    n;
  PetscBool   has;
  const char *text;
  Table       table;

  PetscFunctionBeginUser;
  PetscCall(SceneGetString(scene, "title", &text));
  assert_string_equal(text, "Plate under tension");
  PetscCall(SceneGetInt(scene, "dimension", &n));
  CheckInt(n, 2);
  PetscCall(SceneGetReal(scene, "thickness", &value));
  CheckNear(value, 0.05, 0);
  PetscCall(SceneGetReal(scene, "time.step", &value)); /* auto */
  CheckNear(value, 0, 0);
  PetscCall(SceneGetReal(scene, "materials.concrete.young", &value));
  CheckNear(value, 37e9, 0);
  PetscCall(SceneGetVector(scene, "bodies.plate.geometry.box.size", 3, size));
  CheckNear(size[0], 0.4, 0);
  CheckNear(size[1], 0.1, 1e-16);
  CheckNear(size[2], 0, 0);
  PetscCall(SceneGetString(scene, "bodies.plate.mesh.cells", &text));
  assert_string_equal(text, "quad");

  PetscCall(SceneGetSize(scene, "conditions", &n));
  CheckInt(n, 4);
  PetscCall(SceneGetSize(scene, "conditions[0].fix", &n));
  CheckInt(n, 2);
  PetscCall(SceneGetEntry(scene, "conditions[0].fix", 1, &text));
  assert_string_equal(text, "y");
  PetscCall(SceneHas(scene, "conditions[1].velocity.x", &has));
  CheckTrue(has);
  PetscCall(SceneHas(scene, "conditions[1].velocity.y", &has));
  CheckTrue(!has);
  PetscCall(SceneHas(scene, "conditions[1].pressure", &has));
  CheckTrue(!has);
  PetscCall(SceneGetTable(scene, "conditions[1].velocity.x", &table));
  CheckNear(TableValue(&table, 0.5e-3), 2.5e-3, 1e-18);
  CheckNear(TableValue(&table, 1), 5e-3, 0);
  PetscCall(TableDestroy(&table));
  PetscCall(SceneGetTable(scene, "conditions[2].pressure", &table)); /* ramp: from zero, constant after */
  CheckNear(TableValue(&table, 0), 0, 0);
  CheckNear(TableValue(&table, 0.25e-3), 0.5e6, 1e-9);
  CheckNear(TableValue(&table, 2), 2e6, 0);
  PetscCall(TableDestroy(&table));
  PetscCall(SceneGetVector(scene, "conditions[3].gravity", 3, size));
  CheckNear(size[1], -9.81, 0);

  PetscCall(SceneGetSize(scene, "bodies", &n));
  CheckInt(n, 1);
  PetscCall(SceneGetEntry(scene, "bodies", 0, &text));
  assert_string_equal(text, "plate");
  PetscCall(SceneGetReal(scene, "output.history.every", &value));
  CheckNear(value, 2e-5, 0);
  PetscCall(SceneGetEntry(scene, "output.history.quantities", 0, &text));
  assert_string_equal(text, "reaction(xmin)");
  PetscCall(SceneGetString(scene, "output.plots[0].x", &text));
  assert_string_equal(text, "time");
  PetscCall(SceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPlate)

static PetscErrorCode TestCoreAndDefaults(void)
{
  Scene       scene = Read(core, 0, NULL);
  PetscReal   value, vector[3];
  PetscInt    n;
  PetscBool   flag;
  const char *text;
  Table       table;

  PetscFunctionBeginUser;
  PetscCall(SceneGetInt(scene, "dimension", &n));
  CheckInt(n, 3);
  PetscCall(SceneHas(scene, "dimension", &flag));
  CheckTrue(!flag);
  PetscCall(SceneGetReal(scene, "materials.rock.density", &value));
  CheckNear(value, 2500, 0);
  PetscCall(SceneGetReal(scene, "materials.rock.poisson", &value));
  CheckNear(value, 0.2, 1e-17);
  PetscCall(SceneGetReal(scene, "time.safety", &value));
  CheckNear(value, 0.8, 0);
  PetscCall(SceneGetInt(scene, "bodies.core.dem.packing.count", &n));
  CheckInt(n, 500);
  PetscCall(SceneHas(scene, "bodies.core.dem.packing.radius", &flag));
  CheckTrue(!flag);
  PetscCall(SceneGetReal(scene, "bodies.core.dem.packing.spread", &value)); /* default, filled in */
  CheckNear(value, 0.2, 0);
  PetscCall(SceneGetBool(scene, "bodies.core.dem.bonded", &flag));
  CheckTrue(flag);
  PetscCall(SceneGetVector(scene, "bodies.core.initial_velocity", 3, vector));
  CheckNear(vector[2], -1, 0);
  PetscCall(SceneGetVector(scene, "bodies.core.geometry.cylinder.centre", 3, vector));
  CheckNear(vector[0], 0, 0);
  PetscCall(SceneGetTable(scene, "tools.floor.velocity.z", &table));
  CheckNear(TableIntegral(&table, 2), 0.04, 1e-16);
  PetscCall(TableDestroy(&table));
  PetscCall(SceneGetTable(scene, "tools.floor.velocity.x", &table)); /* default 0 */
  CheckNear(TableValue(&table, 1), 0, 0);
  PetscCall(TableDestroy(&table));
  PetscCall(SceneGetReal(scene, "tools.floor.stiffness", &value));
  CheckNear(value, 0, 0);
  PetscCall(SceneGetSize(scene, "output.history.quantities", &n)); /* one word stands for a list of one */
  CheckInt(n, 1);
  PetscCall(SceneGetEntry(scene, "output.history.quantities", 0, &text));
  assert_string_equal(text, "reaction(floor)");
  /* defaults of sections that are not there, also of what is refused today */
  PetscCall(SceneGetReal(scene, "coupling.width", &value));
  CheckNear(value, 2, 0);
  PetscCall(SceneGetInt(scene, "coupling.substeps", &n));
  CheckInt(n, 0);
  PetscCall(SceneGetReal(scene, "thickness", &value));
  CheckNear(value, 1, 0);
  PetscCall(SceneGetString(scene, "bodies.core.mesh.cells", &text));
  assert_string_equal(text, "tet");
  PetscCall(SceneGetSize(scene, "conditions", &n));
  CheckInt(n, 0);
  PetscCall(SceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCoreAndDefaults)

static PetscErrorCode TestGettersRefuse(void)
{
  Scene       scene = Read(core, 0, NULL);
  PetscReal   value;
  PetscInt    n;
  PetscBool   flag;
  const char *text;

  PetscFunctionBeginUser;
  CheckFails(SceneGetReal(scene, "materials.rock.yuong", &value), PETSC_ERR_ARG_WRONG, "not a key");
  CheckFails(SceneHas(scene, "nothing", &flag), PETSC_ERR_ARG_WRONG, "not a key");
  CheckFails(SceneGetInt(scene, "time.end", &n), PETSC_ERR_ARG_WRONG, "another type");
  CheckFails(SceneGetString(scene, "bodies.core.geometry", &text), PETSC_ERR_ARG_WRONG, "map or list");
  CheckFails(SceneGetEntry(scene, "bodies", 1, &text), PETSC_ERR_ARG_OUTOFRANGE, "no entry 1");
  CheckFails(SceneGetReal(scene, "bodies.core.dem.packing.radius", &value), PETSC_ERR_USER_INPUT, "scene.yaml:11:11: error: 'bodies.core.dem.packing.radius' is needed");
  PetscCall(SceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestGettersRefuse)

static PetscErrorCode TestSceneFail(void)
{
  const char *const set[] = {"time.end=2 ms"};
  Scene             scene = Read(core, 1, set);

  PetscFunctionBeginUser;
  CheckFails(SceneFail(scene, "materials.rock.young", "too soft: %g Pa; take more", 1.0), PETSC_ERR_USER_INPUT, "scene.yaml:5:37: error: too soft: 1 Pa; take more");
  CheckFails(SceneFail(scene, "bodies.core", "no such shape"), PETSC_ERR_USER_INPUT, "scene.yaml:7:3: error: no such shape");
  CheckFails(SceneFail(scene, "bodies.core.mesh.size", "x"), PETSC_ERR_USER_INPUT, "scene.yaml:7:3: error: x"); /* nearest parent written */
  CheckFails(SceneFail(scene, "bodies.core.dem.packing.spread", "x"), PETSC_ERR_USER_INPUT, "scene.yaml:11:11: error: x"); /* a default */
  CheckFails(SceneFail(scene, "", "x"), PETSC_ERR_USER_INPUT, "scene.yaml:1:1: error: x");
  CheckFails(SceneFail(scene, "time.end", "too short"), PETSC_ERR_USER_INPUT, "--set time.end=2 ms: error: too short");
  PetscCall(SceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSceneFail)

static PetscErrorCode TestOverrides(void)
{
  const char *const set[] = {"thickness=2 cm", "materials.concrete.young = 30 GPa", "bodies.plate.mesh.order=2", "conditions[1].velocity={y: 1 m/s}", "conditions[0].fix=[x]", "conditions[4]={group: ymin, fix: y}", "time.end=1 s", "time.end=2 s", "output.checkpoint.every=3 s"};
  Scene             scene = NULL;
  PetscReal         value;
  PetscInt          n;
  PetscBool         has;
  const char       *text;

  PetscFunctionBeginUser;
  BaseErrorClear();
  BaseErrorQuiet(PETSC_TRUE);
  CheckInt(SceneTextRead(plate, strlen(plate), 9, set, &scene), PETSC_ERR_USER_INPUT); /* blank before = is part of the key */
  BaseErrorQuiet(PETSC_FALSE);
  CheckContains(BaseErrorMessage(), "--set materials.concrete.young = 30 GPa: error: unknown key 'young ' in materials.concrete; did you mean 'young'");
  {
    const char *fixed[9];

    memcpy(fixed, set, sizeof(fixed));
    fixed[1] = "materials.concrete.young=30 GPa";
    scene    = Read(plate, 9, fixed);
  }
  PetscCall(SceneGetReal(scene, "thickness", &value));
  CheckNear(value, 0.02, 0);
  PetscCall(SceneGetReal(scene, "materials.concrete.young", &value));
  CheckNear(value, 30e9, 0);
  PetscCall(SceneGetInt(scene, "bodies.plate.mesh.order", &n));
  CheckInt(n, 2);
  PetscCall(SceneHas(scene, "conditions[1].velocity.x", &has));
  CheckTrue(!has);
  PetscCall(SceneHas(scene, "conditions[1].velocity.y", &has));
  CheckTrue(has);
  PetscCall(SceneGetSize(scene, "conditions[0].fix", &n));
  CheckInt(n, 1);
  PetscCall(SceneGetSize(scene, "conditions", &n));
  CheckInt(n, 5);
  PetscCall(SceneGetString(scene, "conditions[4].group", &text));
  assert_string_equal(text, "ymin");
  PetscCall(SceneGetReal(scene, "time.end", &value)); /* the last one holds */
  CheckNear(value, 2, 0);
  PetscCall(SceneGetReal(scene, "output.checkpoint.every", &value)); /* a section made for it */
  CheckNear(value, 3, 0);
  PetscCall(SceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOverrides)

static PetscErrorCode TestFilePath(void)
{
  Scene scene = Read(core, 0, NULL);
  char  path[256], want[256];

  PetscFunctionBeginUser;
  PetscCall(SceneFilePath(scene, "beam.geo", sizeof(path), path));
  snprintf(want, sizeof(want), "%s/beam.geo", folder);
  assert_string_equal(path, want);
  PetscCall(SceneFilePath(scene, "/data/beam.geo", sizeof(path), path));
  assert_string_equal(path, "/data/beam.geo");
  CheckFails(SceneFilePath(scene, "beam.geo", 5, path), PETSC_ERR_USER_INPUT, "too long");
  PetscCall(SceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFilePath)

/* ---- resolved.yaml ---- */

static char *Slurp(const char *path)
{
  FILE  *in   = fopen(path, "rb");
  char  *text = calloc(1, 1 << 16);
  size_t n;

  assert_non_null(in);
  n = fread(text, 1, (1 << 16) - 1, in);
  assert_true(n > 0);
  fclose(in);
  return text;
}

/* Drop comments, and the lines that are only comments. No value of these scenes holds a #. */
static void WithoutComments(char *text)
{
  char *to = text;

  for (char *line = text, *next; *line; line = next) {
    size_t n = strcspn(line, "\n"), keep = strcspn(line, "#\n");

    next = line + n + (line[n] == '\n');
    while (keep && line[keep - 1] == ' ') keep--;
    if (!keep) continue;
    memmove(to, line, keep);
    to += keep;
    *to++ = '\n';
  }
  *to = 0;
}

/* Writing, reading and writing again changes nothing but who set it. */
static PetscErrorCode CheckRoundTrip(Scene *scene, const char *const contains[])
{
  char  first[256], second[256], *a, *b;
  Scene again;

  PetscFunctionBeginUser;
  snprintf(first, sizeof(first), "%s/resolved.yaml", folder);
  snprintf(second, sizeof(second), "%s/resolved2.yaml", folder);
  PetscCall(SceneWriteResolved(*scene, first));
  PetscCall(SceneDestroy(scene));
  PetscCall(SceneRead(PETSC_COMM_SELF, first, 0, NULL, &again));
  PetscCall(SceneWriteResolved(again, second));
  PetscCall(SceneDestroy(&again));
  a = Slurp(first);
  b = Slurp(second);
  for (PetscInt k = 0; contains[k]; k++) CheckContains(a, contains[k]);
  WithoutComments(a);
  WithoutComments(b);
  assert_string_equal(a, b);
  free(a);
  free(b);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestResolvedPlate(void)
{
  static const char *const contains[] = {"title: Plate under tension  # user\n",
                                         "thickness: 0.05 m  # user\n",
                                         "  end: 0.02 s  # user, --set\n",
                                         "  step: 1.2345e-07 s  # derived: 0.9 x the stable step\n",
                                         "  safety: 0.9  # default\n",
                                         "    young: 3.7e+10 Pa  # user\n",
                                         "    elasticity: exact  # default\n",
                                         "        low: [0 m, 0 m]  # default\n",
                                         "        size: [0.4 m, 0.1 m]  # user\n",
                                         "      order: auto  # default\n",
                                         "  - group: xmin  # user\n    fix: [x, y]  # user\n",
                                         "      x: {table: [[0 s, 0 m/s], [0.001 s, 0.005 m/s]]}  # user\n",
                                         "    pressure: {ramp: {to: 2e+06 Pa, over: 0.001 s}}  # user\n",
                                         "  - gravity: [0 m/s2, -9.81 m/s2]  # user\n",
                                         "    quantities: [reaction(xmin), energies]  # user\n",
                                         "  checkpoint:\n    every: 0 s  # default\n",
                                         NULL};
  const char *const set[] = {"time.end=20 ms"};
  Scene             scene = Read(plate, 1, set);
  PetscReal         value;

  PetscFunctionBeginUser;
  PetscCall(SceneSetDerived(scene, "time.step", 1.2345e-7, "0.9 x the stable step"));
  PetscCall(SceneGetReal(scene, "time.step", &value));
  CheckNear(value, 1.2345e-7, 0);
  PetscCall(CheckRoundTrip(&scene, contains));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestResolvedPlate)

/* radius derived from count stands as a comment: a scene must not give both. */
static PetscErrorCode TestResolvedCore(void)
{
  static const char *const contains[] = {"        # radius: 0.0123456789 m  # derived: from count\n        count: 500  # user\n        trim: false  # default\n        spread: 0.2  # default\n        seed: 7  # user\n",
                                         "dimension: 3  # default\n",
                                         "    poisson: 0.2  # user\n",
                                         "    bonded: true  # default\n",
                                         "      x: 0 m/s  # default\n",
                                         "      z: 0.02 m/s  # user\n",
                                         "    quantities: reaction(floor)  # user\n",
                                         NULL};
  Scene                    scene      = Read(core, 0, NULL);
  char                     text[2048];

  PetscFunctionBeginUser;
  PetscCall(SceneSetDerived(scene, "bodies.core.dem.packing.radius", 0.0123456789, "from\ncount"));
  CheckFails(SceneSetDerived(scene, "bodies.other.mesh.size", 1, "?"), PETSC_ERR_ARG_WRONG, "There is no bodies.other");
  CheckFails(SceneSetDerived(scene, "title", 1, "?"), PETSC_ERR_ARG_WRONG, "not a number");
  PetscCall(CheckRoundTrip(&scene, contains));

  /* names and texts that need quotes, a file beside the scene */
  SceneTextWrite("core pack.txt", "0 0 0 1\n", 8);
  snprintf(text, sizeof(text), "%s",
           "title: \"a: \\\"b\\\" # c \\\\ \\u00e9\\n\"\ntime: {end: 1 s}\nmaterials: {'my rock: 1': {density: 1 kg/m3, young: 1 Pa, poisson: 0.1}}\nbodies:\n  '1': {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: dem, material: 'my rock: 1', dem: {packing: {file: core pack.txt}, bonded: no}}\n"
           "conditions: []\ntools: {}\n");
  scene = Read(text, 0, NULL);
  {
    static const char *const odd[] = {"title: \"a: \\\"b\\\" # c \\\\ \xc3\xa9\\x0a\"  # user\n", "  \"my rock: 1\":\n", "/core pack.txt", "    bonded: false  # user\n", "conditions: []  # user\n", "tools: {}  # user\n", NULL};

    PetscCall(CheckRoundTrip(&scene, odd));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestResolvedCore)

/* Byte order mark, Windows line ends, a comment in front, no newline at the end. */
static PetscErrorCode TestOddButGood(void)
{
  Scene     scene = Read("\xef\xbb\xbf# made elsewhere\r\ntime: {end: 1ms}\r\nmaterials: {m: {density: +1.5e3 kg/m3, young: .5 GPa, poisson: 0}}\r\nbodies: {b: {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: fem, material: m, mesh: {size: 0.1 m}}}", 0, NULL);
  PetscReal value;

  PetscFunctionBeginUser;
  PetscCall(SceneGetReal(scene, "time.end", &value));
  CheckNear(value, 1e-3, 0);
  PetscCall(SceneGetReal(scene, "materials.m.young", &value));
  CheckNear(value, 5e8, 0);
  PetscCall(SceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOddButGood)

static const struct CMUnitTest tests[] = {TEST(TestPlate), TEST(TestCoreAndDefaults), TEST(TestGettersRefuse), TEST(TestSceneFail), TEST(TestOverrides), TEST(TestFilePath), TEST(TestResolvedPlate), TEST(TestResolvedCore), TEST(TestOddButGood)};

SCENE_MAIN(tests)
