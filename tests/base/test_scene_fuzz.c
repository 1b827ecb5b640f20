/*
  test_scene_fuzz.c - no text crashes the reader: good scenes cut at every byte, with bits flipped, with bytes swapped
  for those that mean something to YAML, and deep nests. Each must be read, or refused with PETSC_ERR_USER_INPUT; what
  is read must also be written and read again. Most telling in the asan build.
*/
#include "scene_text.h"

/* splitmix64 */
static unsigned long long Random(unsigned long long *state)
{
  unsigned long long z = (*state += 0x9e3779b97f4a7c15ull);

  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

static PetscInt n_read, n_refused;

static void Try(const char *text, size_t length)
{
  char           path[256];
  Scene          scene = NULL;
  PetscErrorCode code;

  BaseErrorClear();
  BaseErrorQuiet(PETSC_TRUE);
  code = SceneTextRead(text, length, 0, NULL, &scene);
  if (code) {
    n_refused++;
    if (code != PETSC_ERR_USER_INPUT || scene || !BaseErrorMessage()[0]) fail_msg("code %d, '%s' for\n%.*s", (int)code, BaseErrorMessage(), (int)length, text);
  } else {
    n_read++;
    snprintf(path, sizeof(path), "%s/resolved.yaml", folder);
    assert_int_equal(SceneWriteResolved(scene, path), 0);
    assert_int_equal(SceneDestroy(&scene), 0);
    code = SceneRead(PETSC_COMM_SELF, path, 0, NULL, &scene);
    if (code) fail_msg("resolved.yaml is refused: %s\n%.*s", BaseErrorMessage(), (int)length, text);
    assert_int_equal(SceneDestroy(&scene), 0);
  }
  BaseErrorQuiet(PETSC_FALSE);
}

static PetscErrorCode TestCutAnywhere(void)
{
  const char *const scenes[] = {plate, core};

  PetscFunctionBeginUser;
  for (int s = 0; s < 2; s++)
    for (size_t n = 0; n <= strlen(scenes[s]); n++) Try(scenes[s], n);
  CheckTrue(n_read > 0 && n_refused > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCutAnywhere)

static PetscErrorCode TestFlippedBits(void)
{
  const char *const  scenes[] = {plate, core};
  unsigned long long state    = 1;
  char               text[4096];

  PetscFunctionBeginUser;
  for (int s = 0; s < 2; s++) {
    const size_t n = strlen(scenes[s]);

    for (size_t k = 0; k < n; k++) { /* each byte once, a bit of it */
      memcpy(text, scenes[s], n);
      text[k] ^= (char)(1 << (Random(&state) % 8));
      Try(text, n);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFlippedBits)

static PetscErrorCode TestSwappedBytes(void)
{
  static const char  telling[] = "{}[]:,-?&*!|>'\"%@`#~ \n\t.()=0e9";
  const char *const  scenes[]  = {plate, core};
  unsigned long long state     = 2;
  char               text[4096];

  PetscFunctionBeginUser;
  for (int trial = 0; trial < 2500; trial++) {
    const char  *scene = scenes[trial % 2];
    const size_t n     = strlen(scene);
    const int    times = 1 + (int)(Random(&state) % 3);

    memcpy(text, scene, n);
    for (int k = 0; k < times; k++) text[Random(&state) % n] = telling[Random(&state) % (sizeof(telling) - 1)];
    Try(text, n);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSwappedBytes)

/* Nests deeper than any scene, endless lines, many keys: refused at once, not a stack run over or a hang. */
static PetscErrorCode TestDeepAndLong(void)
{
  const size_t n    = 1 << 20;
  char        *text = malloc(n + 64);
  size_t       used;

  PetscFunctionBeginUser;
  for (const char *open = "[{(\"x "; *open; open++) {
    memset(text, *open, n);
    Try(text, n);
  }
  for (size_t k = 0; k < n; k += 2) memcpy(text + k, "- ", 2);
  Try(text, 4096);
  for (size_t k = 0; k + 4 <= n; k += 4) memcpy(text + k, "? \n ", 4);
  Try(text, 4096);
  for (used = 0; used < n;) used += (size_t)snprintf(text + used, 64, "key%zu: 1\n", used);
  Try(text, used);
  used = (size_t)snprintf(text, 64, "title: ");
  memset(text + used, 'a', n - used);
  Try(text, n);
  free(text);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestDeepAndLong)

/* The same for --set: any path and value. */
static PetscErrorCode TestOverrideTexts(void)
{
  static const char  letters[] = "time.end=conditions[0].fix{}[]:,=.x5 s";
  unsigned long long state     = 3;

  PetscFunctionBeginUser;
  for (int trial = 0; trial < 3000; trial++) {
    char        set[64];
    const int   n     = 1 + (int)(Random(&state) % 30);
    const char *one   = set;
    const char *start[] = {"", "time.end=", "conditions[1].", "bodies.plate.geometry=", "materials."};
    Scene       scene = NULL;
    PetscErrorCode code;

    snprintf(set, sizeof(set), "%s", start[trial % 5]);
    for (int k = 0; k < n; k++) snprintf(set + strlen(set), sizeof(set) - strlen(set), "%c", letters[Random(&state) % (sizeof(letters) - 1)]);
    BaseErrorClear();
    BaseErrorQuiet(PETSC_TRUE);
    code = SceneTextRead(plate, strlen(plate), 1, &one, &scene);
    BaseErrorQuiet(PETSC_FALSE);
    if (code && code != PETSC_ERR_USER_INPUT) fail_msg("code %d for --set %s", (int)code, set);
    assert_int_equal(SceneDestroy(&scene), 0);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOverrideTexts)

static const struct CMUnitTest tests[] = {TEST(TestCutAnywhere), TEST(TestFlippedBits), TEST(TestSwappedBytes), TEST(TestDeepAndLong), TEST(TestOverrideTexts)};

SCENE_MAIN(tests)
