/* scene_text.h - a scene as text in a test: written to a file of the test's own folder, read from there. */
#pragma once
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>
#include "check.h"
#include "scene.h"

static char folder[64]; /* made by SceneTextBegin */

static inline int SceneTextBegin(void **state)
{
  (void)state;
  strcpy(folder, "/tmp/cleave-scene-XXXXXX");
  return !mkdtemp(folder);
}

static inline int SceneTextEnd(void **state)
{
  char command[128];

  (void)state;
  snprintf(command, sizeof(command), "rm -r '%s'", folder);
  return system(command);
}

static inline void SceneTextWrite(const char *name, const char *text, size_t length)
{
  char  path[256];
  FILE *out;

  snprintf(path, sizeof(path), "%s/%s", folder, name);
  out = fopen(path, "wb");
  assert_non_null(out);
  assert_int_equal(fwrite(text, 1, length, out), length);
  fclose(out);
}

static inline PetscErrorCode SceneTextRead(const char *text, size_t length, PetscInt n, const char *const set[], Scene *scene)
{
  char path[256];

  SceneTextWrite("scene.yaml", text, length);
  snprintf(path, sizeof(path), "%s/scene.yaml", folder);
  return SceneRead(PETSC_COMM_SELF, path, n, set, scene);
}

#define SCENE_MAIN(tests) \
  int main(int argc, char **argv) \
  { \
    int failed; \
    if (BaseInitialize(&argc, &argv)) return 99; \
    failed = cmocka_run_group_tests_name(__FILE__, tests, SceneTextBegin, SceneTextEnd); \
    if (BaseFinalize()) return 98; \
    return failed; \
  }

/* Two scenes that are right, used by several tests. */
static const char *const plate = "title: Plate under tension\n"
                                 "dimension: 2\n"
                                 "plane: stress\n"
                                 "thickness: 50 mm\n"
                                 "time: {end: 20 ms, step: auto}\n"
                                 "materials:\n"
                                 "  concrete: {density: 2346 kg/m3, young: 37 GPa, poisson: 0.2}\n"
                                 "bodies:\n"
                                 "  plate:\n"
                                 "    geometry: {box: {size: [400 mm, 10 cm]}}\n"
                                 "    method: fem\n"
                                 "    material: concrete\n"
                                 "    mesh: {size: 5 mm, cells: quad}\n"
                                 "conditions:\n"
                                 "  - {group: xmin, fix: [x, y]}\n"
                                 "  - {group: xmax, velocity: {x: {table: [[0 ms, 0 mm/s], [1 ms, 5 mm/s]]}}}\n"
                                 "  - group: ymax\n"
                                 "    pressure: {ramp: {to: 2 MPa, over: 1 ms}}\n"
                                 "  - gravity: [0, -9.81 m/s2]\n"
                                 "output:\n"
                                 "  history: {every: 20 us, quantities: [reaction(xmin), energies]}\n"
                                 "  fields: {every: 1 ms, names: [displacement, stress]}\n"
                                 "  plots:\n"
                                 "    - {y: kinetic, file: kinetic.png}\n";

static const char *const core = "time:\n"
                                "  end: 1 ms\n"
                                "  safety: 0.8\n"
                                "materials:\n"
                                "  rock: {density: 2.5 g/cm3, young: 28 GPa, poisson: 20 %, local_damping: 0.1}\n"
                                "bodies:\n"
                                "  core:\n"
                                "    geometry: {cylinder: {radius: 75 mm, height: 0.3 m}}\n"
                                "    method: dem\n"
                                "    material: rock\n"
                                "    dem: {packing: {count: 500, seed: 7}}\n"
                                "    initial_velocity: [0, 0, -1 m/s]\n"
                                "tools:\n"
                                "  floor: {plane: {point: [0, 0, 0], normal: [0, 0, 1]}, friction: 0.3, velocity: {z: 2 cm/s}}\n"
                                "output: {history: {quantities: reaction(floor)}}\n";
