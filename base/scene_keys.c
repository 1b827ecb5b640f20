/*
  scene_keys.c - every key a scene may hold, once.

  This table checks scenes, answers getters with defaults and prints docs/scene.md. Rows of one section stand together,
  the section's own row first. A row marked SCENE_LATER (or a choice ending in ~) is typed and checked, then refused
  with its place: the program does not cover it yet (docs/not-yet.md).
*/
#include "scene_impl.h"
#include <math.h>
#include <string.h>

#define POSITIVE     "(0, inf)"
#define NOT_NEGATIVE "[0, inf)"

/* clang-format off */
/* x, y and z of a motion or load; z only in 3D */
#define XYZ(path, unit, preset, equation, help, flags) \
  {path ".x", SCENE_TABLE, unit, preset, NULL, NULL, equation, help " along x", flags}, \
  {path ".y", SCENE_TABLE, unit, preset, NULL, NULL, equation, help " along y", flags}, \
  {path ".z", SCENE_TABLE, unit, preset, NULL, NULL, equation, help " along z", (flags) | SCENE_3D}

static const SceneKey keys[] = {
  {"",                                         SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "a scene", 0},
  {"title",                                    SCENE_TEXT,   "",      "''",        NULL,         NULL, "-",   "what the run is, for people", SCENE_EMPTY},
  {"dimension",                                SCENE_INT,    "-",     "3",         NULL,         "2 3", "-",  "2 for a plane body, 3 for a solid", 0},
  {"plane",                                    SCENE_CHOICE, "",      "strain",    NULL,         "strain stress", "2.4, 4.1", "plane strain or plane stress", SCENE_2D},
  {"thickness",                                SCENE_REAL,   "m",     "1 m",       POSITIVE,     NULL, "2.7", "out of the plane", SCENE_2D},

  {"time",                                     SCENE_MAP,    "",      NULL,        NULL,         NULL, "1",   "how long the run is and how it steps", SCENE_REQUIRED},
  {"time.end",                                 SCENE_REAL,   "s",     NULL,        POSITIVE,     NULL, "-",   "the run starts at 0 and stops here; a static run applies the loads of this time", SCENE_REQUIRED | SCENE_STATIC | SCENE_EXPLICIT | SCENE_IMPLICIT},
  {"time.method",                              SCENE_CHOICE, "",      "explicit",  NULL,         "explicit static implicit modal", "1.1, 2.14, 2.51, 2.65", "explicit: central differences; static: equilibrium without inertia, of finite elements or of bonded particles, elastic or of law: cohesive; finite elements alone: implicit: Newmark or generalised-alpha; modal: eigenfrequencies", 0},
  {"time.steps",                               SCENE_INT,    "-",     "1",         "[1, 1e9]",   NULL, "2.14",   "load steps of a static run", SCENE_STATIC},
  {"time.teeth",                               SCENE_REAL,   "-",     "1",         "[0.05, 1]",  NULL, "4.84",   "particles that break: size of the teeth near the strength over the largest; 0.25: the ways cracks take in slow explicit steps, in some 2.5 times the rounds", SCENE_STATIC},
  {"time.step",                                SCENE_REAL,   "s",     "auto",      POSITIVE,     NULL, "1.1",   "time step; auto: safety times the largest stable one; an implicit run needs it", SCENE_AUTO | SCENE_EXPLICIT | SCENE_IMPLICIT},
  {"time.safety",                              SCENE_REAL,   "-",     "0.9",       "(0, 1]",     NULL, "2.13, 4.14",   "step / stable step when the step is auto", SCENE_EXPLICIT},
  {"time.beyond_critical",                     SCENE_BOOL,   "",      "false",     NULL,         NULL, "1.7",   "true: a given step above the critical one is not refused; the run will be stopped by its own watch. For tests of that", SCENE_EXPLICIT},
  {"time.rebalance",                           SCENE_INT,    "-",     "1000",      "[0, 1e9]",   NULL, "-",     "on several ranks: steps between looks at how evenly the work of a body of particles is shared out; 0: owners stay those of the set-up", SCENE_EXPLICIT},
  {"time.stop_unbalanced",                     SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "1",   "stop when the mean unbalanced force falls below this fraction of the mean force; 0: never", SCENE_EXPLICIT | SCENE_IMPLICIT},
  {"time.govern",                              SCENE_MAP,    "",      NULL,        NULL,         NULL, "1.9",   "tables, time.end and output intervals count load time, whose pace is 1 without this: it grows while the body is quiet and falls while it breaks", SCENE_EXPLICIT},
  {"time.govern.unbalanced",                   SCENE_REAL,   "-",     "0",      NOT_NEGATIVE, NULL, "1.10, 1.5", "wanted mean unbalanced force over mean force; 0: not looked at", 0},
  {"time.govern.kinetic",                      SCENE_REAL,   "-",     "0.005",     NOT_NEGATIVE, NULL, "1.10",  "wanted kinetic energy over the largest strain energy so far; 0: not looked at", 0},
  {"time.govern.loading",                      SCENE_REAL,   "-",     "0.5",       NOT_NEGATIVE, NULL, "1.10",  "wanted growth of the largest strain energy so far in a response time, over itself; 0: not looked at", 0},
  {"time.govern.breaking",                     SCENE_REAL,   "-",     "0.2",       NOT_NEGATIVE, NULL, "1.10",  "wanted energy that fracture and friction take in a response time over the largest strain energy so far; 0: not looked at", 0},
  {"time.govern.slowest",                      SCENE_REAL,   "-",     "0.1",       POSITIVE,     NULL, "1.11",  "least pace", 0},
  {"time.govern.fastest",                      SCENE_REAL,   "-",     "10",        POSITIVE,     NULL, "1.11",  "greatest pace", 0},
  {"time.govern.response",                     SCENE_REAL,   "s",     "auto",      POSITIVE,     NULL, "1.11",  "of an e-fold of the pace; auto: ten crossings of a wave through the longest extent", SCENE_AUTO},
  {"time.preload",                             SCENE_CHOICE, "",      "none",      NULL,         "none static", "2.58, 6.30", "static: the run begins at rest in equilibrium with the loads and supports of time 0; finite elements alone, or a coupled body as a whole", SCENE_EXPLICIT | SCENE_IMPLICIT},
  {"time.rho_inf",                             SCENE_REAL,   "-",     NULL,        "[0, 1]",     NULL, "2.52",   "generalised-alpha with this spectral radius at high frequency; without it Newmark's average acceleration, which damps nothing", SCENE_IMPLICIT},
  {"time.mass",                                SCENE_CHOICE, "",      "consistent", NULL,        "consistent lumped", "2.50", "mass of the elements; explicit runs lump it", SCENE_IMPLICIT | SCENE_MODAL},
  {"time.modes",                               SCENE_INT,    "-",     "10",        "[1, 1000]",  NULL, "2.65",   "how many eigenfrequencies, rigid motions of a free body included", SCENE_MODAL},
  {"time.shift",                               SCENE_REAL,   "1/s",   "auto",      NOT_NEGATIVE, NULL, "2.66",   "frequencies nearest this one (write Hz); auto: the lowest", SCENE_AUTO | SCENE_MODAL},

  {"materials",                                SCENE_NAMES,  "",      NULL,        NULL,         NULL, "-",   "materials by name", SCENE_REQUIRED},
  {"materials.*",                              SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "a material", 0},
  {"materials.*.density",                      SCENE_REAL,   "kg/m3", NULL,        POSITIVE,     NULL, "2.10",   "mass per volume; required where the material is used", 0},
  {"materials.*.young",                        SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "2.3, 4.1", "Young's modulus; required where the material is used, unless orthotropic", 0},
  {"materials.*.poisson",                      SCENE_REAL,   "-",     NULL,        "(-1, 0.5)",  NULL, "2.3, 4.1", "Poisson's ratio; required where the material is used, unless orthotropic", 0},
  {"materials.*.elasticity",                   SCENE_CHOICE, "",      "exact",     NULL,         "exact onate2015 kdem given", "4.6, 4.45", "rule of the bonds (DEM): exact needs no calibration; the others are springs between centres", 0},
  {"materials.*.interaction_range",            SCENE_REAL,   "-",     "0.1",       "(0, 1)",     NULL, "4.45", "onate2015, given, and kdem with areas: polyhedron: bonded when the gap is within +- this x the sum of radii", 0},
  {"materials.*.area_factor",                  SCENE_REAL,   "-",     "auto",      POSITIVE,     NULL, "4.46", "onate2015, given: area / area of the smaller circle; auto: 40 x porosity / mean number of bonds", SCENE_AUTO},
  {"materials.*.areas",                        SCENE_CHOICE, "",      "facet",     NULL,         "facet polyhedron", "4.45, 4.66", "kdem: facet: of the power diagram; polyhedron: as in the thesis, regular polyhedra for the pairs within interaction_range", 0},
  {"materials.*.factor_normal",                SCENE_REAL,   "-",     "1",         POSITIVE,     NULL, "4.42", "onate2015, kdem: multiplies the normal stiffness E A/d", 0},
  {"materials.*.factor_shear",                 SCENE_REAL,   "-",     "1",         NOT_NEGATIVE, NULL, "4.42", "onate2015, kdem: multiplies the shear stiffness G A/d", 0},
  {"materials.*.stiffness_normal",             SCENE_REAL,   "N/m",   NULL,        POSITIVE,     NULL, "4.42", "given: normal stiffness of every bond", 0},
  {"materials.*.stiffness_shear",              SCENE_REAL,   "N/m",   NULL,        NOT_NEGATIVE, NULL, "4.42", "given: shear stiffness of every bond", 0},
  {"materials.*.poisson_term",                 SCENE_BOOL,   "",      "false",     NULL,         NULL, "4.44", "kdem: lateral stress of the last step acts along the bond", 0},
  {"materials.*.law",                          SCENE_CHOICE, "",      "elastic",   NULL,         "elastic cohesive published", "4.20, 4.50", "elastic: never breaks; cohesive: facets of the exact rule soften; published: springs damage and yield", 0},
  {"materials.*.criterion",                    SCENE_CHOICE, "",      "local",     NULL,         "local nonlocal", "4.60", "what starts the softening: the bond's own force, or Rankine and Mohr-Coulomb on the mean stress of its particles (cohesive: in shear)", 0},
  {"materials.*.delta_n",                      SCENE_REAL,   "-",     NULL,        POSITIVE,     NULL, "4.53", "published: softening elongation / elastic elongation; in place of fracture_energy", 0},
  {"materials.*.delta_s",                      SCENE_REAL,   "-",     NULL,        POSITIVE,     NULL, "4.53", "published: the same in shear; in place of fracture_energy_shear", 0},
  {"materials.*.compression",                  SCENE_MAP,    "",      NULL,        NULL,         NULL, "4.58", "published: branches beyond the elastic one", 0},
  {"materials.*.compression.lcs1",             SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "4.58", "compressive stress where the first branch begins", SCENE_REQUIRED},
  {"materials.*.compression.yrc1",             SCENE_REAL,   "-",     NULL,        "[1, inf)",   NULL, "4.58", "Young's modulus is divided by this on it", SCENE_REQUIRED},
  {"materials.*.compression.lcs2",             SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "4.58", "second branch", 0},
  {"materials.*.compression.yrc2",             SCENE_REAL,   "-",     NULL,        "[1, inf)",   NULL, "4.58", "its divisor", 0},
  {"materials.*.compression.lcs3",             SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "4.58", "third branch", 0},
  {"materials.*.compression.yrc3",             SCENE_REAL,   "-",     NULL,        "[1, inf)",   NULL, "4.58", "its divisor", 0},
  {"materials.*.orthotropic",                  SCENE_MAP,    "",      NULL,        NULL,         NULL, "2.40", "in place of young and poisson: three axes square to each other, each with its stiffness (FEM)", 0},
  {"materials.*.orthotropic.young_1",          SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "2.40", "Young's modulus along axis 1", SCENE_REQUIRED},
  {"materials.*.orthotropic.young_2",          SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "2.40", "Young's modulus along axis 2", SCENE_REQUIRED},
  {"materials.*.orthotropic.young_3",          SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "2.40", "Young's modulus along axis 3", SCENE_REQUIRED},
  {"materials.*.orthotropic.poisson_12",       SCENE_REAL,   "-",     NULL,        NULL,         NULL, "2.40", "contraction along 2 / stretch, pulled along 1", SCENE_REQUIRED},
  {"materials.*.orthotropic.poisson_13",       SCENE_REAL,   "-",     NULL,        NULL,         NULL, "2.40", "contraction along 3 / stretch, pulled along 1", SCENE_REQUIRED},
  {"materials.*.orthotropic.poisson_23",       SCENE_REAL,   "-",     NULL,        NULL,         NULL, "2.40", "contraction along 3 / stretch, pulled along 2", SCENE_REQUIRED},
  {"materials.*.orthotropic.shear_12",         SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "2.40", "shear modulus in the plane of 1 and 2", SCENE_REQUIRED},
  {"materials.*.orthotropic.shear_13",         SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "2.40", "shear modulus in the plane of 1 and 3", SCENE_REQUIRED},
  {"materials.*.orthotropic.shear_23",         SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "2.40", "shear modulus in the plane of 2 and 3", SCENE_REQUIRED},
  {"materials.*.orthotropic.angle",            SCENE_REAL,   "rad",   "0 rad",     NULL,         NULL, "2.41", "from x to axis 1, towards y; axis 3 stands along z", SCENE_2D},
  {"materials.*.orthotropic.axis_1",           SCENE_VECTOR, "-",     "[1, 0]|[1, 0, 0]", NULL,  NULL, "2.41", "direction of axis 1, any length", SCENE_3D},
  {"materials.*.orthotropic.axis_2",           SCENE_VECTOR, "-",     "[0, 1]|[0, 1, 0]", NULL,  NULL, "2.41", "direction of axis 2; what of it lies along axis 1 is left out", SCENE_3D},
  {"materials.*.tensile_strength",             SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "4.20", "uniaxial tensile strength", 0},
  {"materials.*.shear_strength",               SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "4.25", "cohesion of a facet", 0},
  {"materials.*.fracture_energy",              SCENE_REAL,   "J/m2",  NULL,        POSITIVE,     NULL, "4.22", "energy per crack area, opening", 0},
  {"materials.*.fracture_energy_shear",        SCENE_REAL,   "J/m2",  NULL,        POSITIVE,     NULL, "4.25", "energy per crack area, sliding", 0},
  {"materials.*.mu_static",                    SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "4.25", "friction coefficient of the intact facet", 0},
  {"materials.*.mu_dynamic",                   SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "4.28",   "friction coefficient after failure", 0},
  {"materials.*.softening",                    SCENE_MAP,    "",      "linear",       NULL,         "linear exponential", "4.22", "traction against opening", 0},
  {"materials.*.softening.bilinear",           SCENE_MAP,    "",      NULL,        NULL,         NULL, "4.22", "two straight branches", SCENE_REQUIRED},
  {"materials.*.softening.bilinear.knee_stress",  SCENE_REAL, "-",    NULL,        "(0, 1)",     NULL, "4.22", "traction at the knee / tensile strength", SCENE_REQUIRED},
  {"materials.*.softening.bilinear.knee_opening", SCENE_REAL, "-",    NULL,        POSITIVE,     NULL, "4.22", "opening at the knee / (fracture energy / tensile strength)", SCENE_REQUIRED},
  {"materials.*.expansion",                    SCENE_REAL,   "1/K",   "0 1/K",     NULL,         NULL, "2.77",  "linear thermal expansion, finite elements", 0},
  {"materials.*.local_damping",                SCENE_REAL,   "-",     "0",         "[0, 1)",     NULL, "5.3",   "non-viscous damping of particles: fraction of the unbalanced force", 0},
  {"materials.*.mass_damping",                 SCENE_REAL,   "1/s",   "0 1/s",     NOT_NEGATIVE, NULL, "2.17",  "drag of finite elements, explicit and implicit: force / (mass x velocity)", 0},
  {"materials.*.stiffness_damping",            SCENE_REAL,   "s",     "0 s",       NOT_NEGATIVE, NULL, "2.51",  "viscous stress of finite elements, implicit: stress of the strain rate x this time", 0},

  {"bodies",                                   SCENE_NAMES,  "",      NULL,        NULL,         NULL, "-",   "bodies by name", SCENE_REQUIRED},
  {"bodies.*",                                 SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "a body", 0},
  {"bodies.*.geometry",                        SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "a gmsh file (.geo, .msh) beside the scene, or one built-in shape", SCENE_REQUIRED | SCENE_OR_FILE},
  {"bodies.*.geometry.box",                    SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "groups xmin xmax ymin ymax zmin zmax", SCENE_ONE_OF},
  {"bodies.*.geometry.box.low",                SCENE_VECTOR, "m",     "[0, 0]|[0, 0, 0]", NULL,  NULL, "-",   "lowest corner", 0},
  {"bodies.*.geometry.box.size",               SCENE_VECTOR, "m",     NULL,        POSITIVE,     NULL, "-",   "edge lengths", SCENE_REQUIRED},
  {"bodies.*.geometry.cylinder",               SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "axis z; groups bottom top side", SCENE_ONE_OF | SCENE_3D},
  {"bodies.*.geometry.cylinder.centre",        SCENE_VECTOR, "m",     "[0, 0]|[0, 0, 0]", NULL,  NULL, "-",   "middle of the bottom face", 0},
  {"bodies.*.geometry.cylinder.radius",        SCENE_REAL,   "m",     NULL,        POSITIVE,     NULL, "-",   "radius", SCENE_REQUIRED},
  {"bodies.*.geometry.cylinder.height",        SCENE_REAL,   "m",     NULL,        POSITIVE,     NULL, "-",   "height", SCENE_REQUIRED},
  {"bodies.*.geometry.disc",                   SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "group side", SCENE_ONE_OF | SCENE_2D},
  {"bodies.*.geometry.disc.centre",            SCENE_VECTOR, "m",     "[0, 0]|[0, 0, 0]", NULL,  NULL, "-",   "middle", 0},
  {"bodies.*.geometry.disc.radius",            SCENE_REAL,   "m",     NULL,        POSITIVE,     NULL, "-",   "radius", SCENE_REQUIRED},
  {"bodies.*.length_unit",                     SCENE_REAL,   "m",     "1 m",       POSITIVE,     NULL, "-",   "one unit of the geometry file", 0},
  {"bodies.*.group",                           SCENE_TEXT,   "",      NULL,        NULL,         NULL, "-",   "only this physical group of the geometry file (a surface in 2D, a volume in 3D)", 0},
  {"bodies.*.method",                          SCENE_CHOICE, "",      NULL,        NULL,         "fem dem coupled", "-", "finite elements, bonded particles, or both over an overlap", SCENE_REQUIRED},
  {"bodies.*.material",                        SCENE_TEXT,   "",      NULL,        NULL,         NULL, "-",   "a name of materials", SCENE_REQUIRED},
  {"bodies.*.mesh",                            SCENE_MAP,    "",      NULL,        NULL,         NULL, "2",   "finite elements", SCENE_FEM | SCENE_FILL},
  {"bodies.*.mesh.size",                       SCENE_REAL,   "m",     NULL,        POSITIVE,     NULL, "-",   "element size; required for built-in shapes, else what the .geo says", 0},
  {"bodies.*.mesh.cells",                      SCENE_CHOICE, "",      "tri|tet",   NULL,         "tri quad tet hex", "2.5", "element shape", 0},
  {"bodies.*.mesh.order",                      SCENE_INT,    "-",     "auto",      NULL,         "1 2", "2.5, 2.30",  "of the shape functions: linear or quadratic; auto: 2, but 1 where steps are explicit and for hexahedra. A .msh file has its own", SCENE_AUTO},
  {"bodies.*.mesh.incomplete",                 SCENE_BOOL,   "",      "false",     NULL,         NULL, "2.30", "quadratic cells without nodes inside sides and cells: quad8, hex20 instead of quad9, hex27", 0},
  {"bodies.*.mesh.element",                    SCENE_CHOICE, "",      "enhanced",  NULL,         "enhanced full", "2.32, 2.38", "free of locking: linear quadrilaterals and hexahedra with strains of their own, quadratic hexahedra and prisms with a linear volume change near nu = 1/2; or plain", 0},
  {"bodies.*.mesh.rotation",                   SCENE_CHOICE, "",      "small",     NULL,         "small corotational", "2.86", "corotational: elements turn as far as they like, of small strain in axes that turn with each; explicit only", 0},
  {"bodies.*.dem",                             SCENE_MAP,    "",      NULL,        NULL,         NULL, "3",   "bonded particles", SCENE_DEM | SCENE_REQUIRED},
  {"bodies.*.dem.group",                       SCENE_TEXT,   "",      NULL,        NULL,         NULL, "-",   "coupled: the physical group that is particles", 0},
  {"bodies.*.dem.packing",                     SCENE_MAP,    "",      NULL,        NULL,         NULL, "3", "spheres (2D: discs) that fill the body", SCENE_REQUIRED},
  {"bodies.*.dem.packing.radius",              SCENE_REAL,   "m",     NULL,        POSITIVE,     NULL, "3", "mean radius", SCENE_ONE_OF},
  {"bodies.*.dem.packing.count",               SCENE_INT,    "-",     NULL,        "[1, 1e8]",   NULL, "3", "how many particles, about", SCENE_ONE_OF},
  {"bodies.*.dem.packing.file",                SCENE_FILE,   "",      NULL,        NULL,         NULL, "-",   "own packing: a text table x y z r in metres", SCENE_ONE_OF},
  {"bodies.*.dem.packing.trim",                SCENE_BOOL,   "",      "false",     NULL,         NULL, "-",   "own packing: leave out what lies outside the particles' part of the body, instead of refusing it", 0},
  {"bodies.*.dem.packing.spread",              SCENE_REAL,   "-",     "0.2",       "[0, 0.6]",   NULL, "3", "half width of the sizes / mean radius", 0},
  {"bodies.*.dem.packing.seed",                SCENE_INT,    "-",     "1",         "[0, 2e9]",   NULL, "3", "another seed, another packing; the same seed, the same packing", 0},
  {"bodies.*.dem.packing.porosity",            SCENE_REAL,   "-",     NULL,        "(0, 1)",     NULL, "5.80", "loose grains: laid out apart from each other, so loosely; without: close-packed, which overlaps", 0},
  {"bodies.*.dem.rain",                        SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.83", "loose grains fall in one by one, with initial_velocity, anywhere in the geometry's box, which is empty at first", 0},
  {"bodies.*.dem.rain.rate",                   SCENE_REAL,   "1/s",   NULL,        POSITIVE,     NULL, "5.83", "grains a second", SCENE_REQUIRED},
  {"bodies.*.dem.rain.until",                  SCENE_REAL,   "s",     NULL,        POSITIVE,     NULL, "5.83", "end of the rain", SCENE_REQUIRED},
  {"bodies.*.dem.clump",                       SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.90", "each grain of the packing or rain is a rigid body of spheres; radius is then that of the sphere about its centre of mass which holds it", SCENE_3D},
  {"bodies.*.dem.clump.spheres",               SCENE_ITEMS,  "",      NULL,        NULL,         NULL, "5.90", "the shape, drawn to any scale: a list", SCENE_REQUIRED},
  {"bodies.*.dem.clump.spheres[]",             SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.90", "one sphere", 0},
  {"bodies.*.dem.clump.spheres[].at",          SCENE_VECTOR, "m",     NULL,        NULL,         NULL, "5.90", "centre", SCENE_REQUIRED},
  {"bodies.*.dem.clump.spheres[].radius",      SCENE_REAL,   "m",     NULL,        POSITIVE,     NULL, "5.90", "radius", SCENE_REQUIRED},
  {"bodies.*.dem.clump.orientation",           SCENE_CHOICE, "",      "random",    NULL,         "random given", "5.94", "random: every one turned anew, by the packing's seed; given: as drawn", 0},
  {"bodies.*.dem.clump.mass",                  SCENE_REAL,   "kg",    NULL,        POSITIVE,     NULL, "5.93", "of the shape as drawn; without: density x volume of the union, overlaps once. centre and inertia go with it", 0},
  {"bodies.*.dem.clump.centre",                SCENE_VECTOR, "m",     NULL,        NULL,         NULL, "5.93", "of mass, beside mass", 0},
  {"bodies.*.dem.clump.inertia",               SCENE_VECTOR, "kg m2", NULL,        POSITIVE,     NULL, "5.93", "moments about x, y, z through the centre, which are the principal axes, beside mass", 0},
  {"bodies.*.dem.pressure_area",               SCENE_CHOICE, "",      "facet",     NULL,         "facet sphere", "4.48", "sphere: a pressed particle takes p pi r2 (2D: 2 p r) at its centre, as the papers do; not with exact", 0},
  {"bodies.*.dem.cohesive_groups",             SCENE_WORDS,  "",      NULL,        NULL,         NULL, "4.64",  "physical groups of the geometry file whose particles bond among themselves only; what is in none of them is one more group. Between two groups they push and rub", 0},
  {"bodies.*.dem.bonded",                      SCENE_BOOL,   "",      "true",      NULL,         NULL, "4.6",   "false: loose grains", 0},
  {"bodies.*.initial_stress",                  SCENE_MAP,    "",      NULL,        NULL,         NULL, "2.76",  "in-situ stress before any displacement; components add to what depth gives", SCENE_FEM},
  {"bodies.*.initial_stress.xx",               SCENE_REAL,   "Pa",    "0 Pa",      NULL,         NULL, "2.76",  "positive is tension", 0},
  {"bodies.*.initial_stress.yy",               SCENE_REAL,   "Pa",    "0 Pa",      NULL,         NULL, "2.76",  "positive is tension", 0},
  {"bodies.*.initial_stress.zz",               SCENE_REAL,   "Pa",    "0 Pa",      NULL,         NULL, "2.76",  "positive is tension; in 2D across the plane", 0},
  {"bodies.*.initial_stress.xy",               SCENE_REAL,   "Pa",    "0 Pa",      NULL,         NULL, "2.76",  "shear", 0},
  {"bodies.*.initial_stress.yz",               SCENE_REAL,   "Pa",    "0 Pa",      NULL,         NULL, "2.76",  "shear", SCENE_3D},
  {"bodies.*.initial_stress.zx",               SCENE_REAL,   "Pa",    "0 Pa",      NULL,         NULL, "2.76",  "shear", SCENE_3D},
  {"bodies.*.initial_stress.surface",          SCENE_REAL,   "m",     NULL,        NULL,         NULL, "2.76",  "z (2D: y) of the ground: below it the weight above, density x gravity x depth, presses", 0},
  {"bodies.*.initial_stress.ratio",            SCENE_REAL,   "-",     NULL,        NOT_NEGATIVE, NULL, "2.76",  "sideways / downward stress of the weight; without it poisson / (1 - poisson)", 0},
  {"bodies.*.initial_stress.gravity",          SCENE_REAL,   "m/s2",  "9.81 m/s2", POSITIVE,     NULL, "2.76",  "that made the stress; it is no load", 0},
  {"bodies.*.temperature",                     SCENE_MAP,    "",      NULL,        NULL,         NULL, "2.77",  "rise above the temperature without stress", SCENE_FEM},
  {"bodies.*.temperature.rise",                SCENE_TABLE,  "K",     NULL,        NULL,         NULL, "2.77",  "of the whole body", 0},
  {"bodies.*.temperature.origin",              SCENE_VECTOR, "m",     "[0, 0]|[0, 0, 0]", NULL,  NULL, "2.77",  "where the gradient adds nothing", 0},
  {"bodies.*.temperature.gradient",            SCENE_MAP,    "",      NULL,        NULL,         NULL, "2.77",  "a rise linear in place, added to the uniform one", 0},
  XYZ("bodies.*.temperature.gradient",                       "K/m",   NULL, "2.77", "gradient", 0),
  {"bodies.*.surface",                         SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.70",  "how the particles of another body meet the surface of this one of finite elements", SCENE_FEM},
  {"bodies.*.surface.law",                     SCENE_CHOICE, "",      "linear",    NULL,         "linear hertz", "5.20", "spring in proportion to the overlap, or Hertz and Mindlin for spheres", 0},
  {"bodies.*.surface.stiffness",               SCENE_REAL,   "Pa",    "0 Pa",      NOT_NEGATIVE, NULL, "5.20", "linear: contact stiffness / radius; 0: harmonic mean of both Young's moduli", 0},
  {"bodies.*.surface.tangential",              SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.21", "tangential / normal stiffness; 0: Mindlin's", 0},
  {"bodies.*.surface.restitution",             SCENE_REAL,   "-",     "1",         "[0, 1]",     NULL, "5.24", "of the contact alone; the body's own waves take more", 0},
  {"bodies.*.surface.friction",                SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.27", "Coulomb coefficient", 0},
  {"bodies.*.surface.static_friction",         SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.27", "Coulomb coefficient until a contact slips; 0: the same as friction", 0},
  {"bodies.*.surface.rolling_friction",        SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.31", "largest rolling couple / (radius x normal force)", 0},
  {"bodies.*.surface.torsional_friction",      SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.31", "largest couple about the normal / (radius x normal force)", 0},
  {"bodies.*.initial_velocity",                SCENE_VECTOR, "m/s",   "[0, 0]|[0, 0, 0]", NULL,  NULL, "-",   "of the whole body", SCENE_EXPLICIT | SCENE_IMPLICIT},

  {"tools",                                    SCENE_NAMES,  "",      NULL,        NULL,         NULL, "5.50", "rigid bodies that meet particles, by name", 0},
  {"tools.*",                                  SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.50", "a rigid body", 0},
  {"tools.*.plane",                            SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.53", "a plane without end, solid behind", SCENE_ONE_OF},
  {"tools.*.plane.point",                      SCENE_VECTOR, "m",     NULL,        NULL,         NULL, "5.53", "any point of it at time 0", SCENE_REQUIRED},
  {"tools.*.plane.normal",                     SCENE_VECTOR, "-",     NULL,        NULL,         NULL, "5.53", "points to the side of the particles; any length", SCENE_REQUIRED},
  {"tools.*.surface",                          SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.50", "triangles (2D: segments); particles meet both sides", SCENE_ONE_OF},
  {"tools.*.surface.file",                     SCENE_FILE,   "",      NULL,        NULL,         NULL, "5.50", ".stl (text or binary), .msh or .geo", SCENE_REQUIRED},
  {"tools.*.surface.group",                    SCENE_TEXT,   "",      NULL,        NULL,         NULL, "5.50", "physical surface (2D: curve) of a gmsh file; without: all of them", 0},
  {"tools.*.surface.length_unit",              SCENE_REAL,   "m",     "1 m",       POSITIVE,     NULL, "-",    "one unit of the file", 0},
  {"tools.*.surface.size",                     SCENE_REAL,   "m",     NULL,        POSITIVE,     NULL, "-",    "of a .geo's elements; without: what the .geo says", 0},
  {"tools.*.box",                              SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.50", "thin walls; particles are outside or within", SCENE_ONE_OF},
  {"tools.*.box.low",                          SCENE_VECTOR, "m",     NULL,        NULL,         NULL, "-",    "lowest corner at time 0", SCENE_REQUIRED},
  {"tools.*.box.size",                         SCENE_VECTOR, "m",     NULL,        POSITIVE,     NULL, "-",    "edge lengths", SCENE_REQUIRED},
  {"tools.*.cylinder",                         SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.54", "a round rod, or a tube", SCENE_ONE_OF | SCENE_3D},
  {"tools.*.cylinder.centre",                  SCENE_VECTOR, "m",     NULL,        NULL,         NULL, "5.54", "its middle at time 0", SCENE_REQUIRED},
  {"tools.*.cylinder.axis",                    SCENE_VECTOR, "-",     NULL,        NULL,         NULL, "5.54", "direction; any length", SCENE_REQUIRED},
  {"tools.*.cylinder.radius",                  SCENE_REAL,   "m",     NULL,        POSITIVE,     NULL, "5.54", "radius", SCENE_REQUIRED},
  {"tools.*.cylinder.length",                  SCENE_REAL,   "m",     NULL,        POSITIVE,     NULL, "5.54", "without: no end", 0},
  {"tools.*.cylinder.side",                    SCENE_CHOICE, "",      "outside",   NULL,         "outside inside", "5.54", "where the particles are. outside: a solid with flat ends; inside: a tube without lids", 0},
  {"tools.*.disc",                             SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.55", "3D: a thin round plate, both sides; 2D: a circle", SCENE_ONE_OF},
  {"tools.*.disc.centre",                      SCENE_VECTOR, "m",     NULL,        NULL,         NULL, "5.55", "middle at time 0", SCENE_REQUIRED},
  {"tools.*.disc.normal",                      SCENE_VECTOR, "-",     NULL,        NULL,         NULL, "5.55", "direction; any length", SCENE_REQUIRED | SCENE_3D},
  {"tools.*.disc.radius",                      SCENE_REAL,   "m",     NULL,        POSITIVE,     NULL, "5.55", "radius", SCENE_REQUIRED},
  {"tools.*.disc.side",                        SCENE_CHOICE, "",      "outside",   NULL,         "outside inside", "5.55", "where the particles are", SCENE_2D},
  {"tools.*.velocity",                         SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.58", "prescribed motion of the whole tool", SCENE_FILL},
  XYZ("tools.*.velocity",                                    "m/s",   "0", "5.58", "velocity", 0),
  {"tools.*.rotation",                         SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.58", "prescribed rotation, besides the velocity", 0},
  {"tools.*.rotation.axis",                    SCENE_VECTOR, "-",     NULL,        NULL,         NULL, "5.58", "direction; any length", SCENE_REQUIRED | SCENE_3D},
  {"tools.*.rotation.speed",                   SCENE_TABLE,  "rad/s", NULL,        NULL,         NULL, "5.58", "angular velocity", SCENE_REQUIRED},
  {"tools.*.centre",                           SCENE_VECTOR, "m",     NULL,        NULL,         NULL, "5.58", "point that rotation and torques are about; moves with the tool. Without: the middle; of a free body with density the centre of mass", 0},
  {"tools.*.push",                             SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.59", "driven by a force along an axis, free along it", 0},
  {"tools.*.push.axis",                        SCENE_VECTOR, "-",     NULL,        NULL,         NULL, "5.59", "direction of the force; any length", SCENE_REQUIRED},
  {"tools.*.push.force",                       SCENE_TABLE,  "N",     NULL,        NULL,         NULL, "5.59", "force on the tool along the axis; gravity acts besides", SCENE_REQUIRED},
  {"tools.*.push.mass",                        SCENE_REAL,   "kg",    NULL,        POSITIVE,     NULL, "5.59", "mass that moves", SCENE_REQUIRED},
  {"tools.*.twist",                            SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.60", "driven by a torque about an axis, free about it", 0},
  {"tools.*.twist.axis",                       SCENE_VECTOR, "-",     NULL,        NULL,         NULL, "5.60", "direction; any length", SCENE_REQUIRED | SCENE_3D},
  {"tools.*.twist.torque",                     SCENE_TABLE,  "N m",   NULL,        NULL,         NULL, "5.60", "torque on the tool about the axis", SCENE_REQUIRED},
  {"tools.*.twist.inertia",                    SCENE_REAL,   "kg m2", NULL,        POSITIVE,     NULL, "5.60", "moment of inertia about the axis", SCENE_REQUIRED},
  {"tools.*.free",                             SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.61", "a body of its own, under contact forces and gravity", 0},
  {"tools.*.free.density",                     SCENE_REAL,   "kg/m3", NULL,        POSITIVE,     NULL, "5.62", "mass, centre and inertia from the closed surface", SCENE_ONE_OF},
  {"tools.*.free.mass",                        SCENE_REAL,   "kg",    NULL,        POSITIVE,     NULL, "5.61", "mass; inertia goes with it", SCENE_ONE_OF},
  {"tools.*.free.inertia",                     SCENE_VECTOR, "kg m2", NULL,        POSITIVE,     NULL, "5.61", "moments about x, y, z through the centre, beside mass", SCENE_3D},
  {"tools.*.free.inertia_z",                   SCENE_REAL,   "kg m2", NULL,        POSITIVE,     NULL, "5.61", "moment through the centre, beside mass", SCENE_2D},
  {"tools.*.free.velocity",                    SCENE_VECTOR, "m/s",   "[0, 0]|[0, 0, 0]", NULL,  NULL, "5.61", "at time 0", 0},
  {"tools.*.free.spin",                        SCENE_VECTOR, "rad/s", "[0, 0]|[0, 0, 0]", NULL,  NULL, "5.61", "angular velocity at time 0", SCENE_3D},
  {"tools.*.free.spin_z",                      SCENE_REAL,   "rad/s", "0 rad/s",   NULL,         NULL, "5.61", "angular velocity at time 0", SCENE_2D},
  {"tools.*.law",                              SCENE_CHOICE, "",      "linear",    NULL,         "linear hertz", "5.20", "spring in proportion to the overlap, or Hertz and Mindlin for spheres", 0},
  {"tools.*.stiffness",                        SCENE_REAL,   "Pa",    "0 Pa",      NOT_NEGATIVE, NULL, "5.20", "linear: contact stiffness / radius; 0: Young's modulus of the material", 0},
  {"tools.*.tangential",                       SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.21", "tangential / normal stiffness; 0: Mindlin's, 2 (1 - nu)/(2 - nu)", 0},
  {"tools.*.restitution",                      SCENE_REAL,   "-",     "1",         "[0, 1]",     NULL, "5.24", "speed after / before a normal impact", 0},
  {"tools.*.damping",                          SCENE_REAL,   "-",     "0",         "[0, 1]",     NULL, "5.23", "in place of restitution: dashpot along the normal, fraction of critical", 0},
  {"tools.*.friction",                         SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.27", "Coulomb coefficient", 0},
  {"tools.*.static_friction",                  SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.27", "Coulomb coefficient until a contact slips; 0: the same as friction", 0},
  {"tools.*.rolling_friction",                 SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.31", "largest rolling couple / (radius x normal force)", 0},
  {"tools.*.torsional_friction",               SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.31", "largest couple about the normal / (radius x normal force)", 0},

  {"conditions",                               SCENE_ITEMS,  "",      NULL,        NULL,         NULL, "-",   "supports, motions and loads, a list", 0},
  {"conditions[]",                             SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "one support, motion or load on one group; or gravity", 0},
  {"conditions[].group",                       SCENE_TEXT,   "",      NULL,        NULL,         NULL, "-",   "physical group of the geometry file, or of the built-in shape", 0},
  {"conditions[].body",                        SCENE_TEXT,   "",      NULL,        NULL,         NULL, "-",   "name of bodies; only when two bodies have the group", 0},
  {"conditions[].fix",                         SCENE_WORDS,  "",      NULL,        NULL,         "x y z all", "2.18, 4.10", "components held at zero displacement; one or a list", 0},
  {"conditions[].velocity",                    SCENE_MAP,    "",      NULL,        NULL,         NULL, "2.18, 4.10",   "prescribed velocity; components not named are free", 0},
  XYZ("conditions[].velocity",                               "m/s",   NULL, "2.18, 4.10", "velocity", 0),
  {"conditions[].displacement",                SCENE_MAP,    "",      NULL,        NULL,         NULL, "2.18, 4.10",   "prescribed displacement; components not named are free", 0},
  XYZ("conditions[].displacement",                           "m",     NULL, "2.18, 4.10", "displacement", 0),
  {"conditions[].traction",                    SCENE_MAP,    "",      NULL,        NULL,         NULL, "2.8, 4.8",   "force per area of the undeformed face", 0},
  XYZ("conditions[].traction",                               "Pa",    NULL, "2.8, 4.8", "traction", 0),
  {"conditions[].pressure",                    SCENE_TABLE,  "Pa",    NULL,        NULL,         NULL, "2.8, 4.8",   "positive pushes into the body", 0},
  {"conditions[].symmetry",                    SCENE_BOOL,   "",      NULL,        NULL,         NULL, "2.70",  "no motion along the normal of this flat group, whatever its direction", 0},
  {"conditions[].force",                       SCENE_MAP,    "",      NULL,        NULL,         NULL, "2.75",  "total force on the group: spread by area, by length, or over its points alike", 0},
  XYZ("conditions[].force",                                  "N",     NULL, "2.75", "force", 0),
  {"conditions[].line_load",                   SCENE_MAP,    "",      NULL,        NULL,         NULL, "2.75",  "force per length of a group of lines", 0},
  XYZ("conditions[].line_load",                              "N/m",   NULL, "2.75", "force per length", 0),
  {"conditions[].absorb",                      SCENE_BOOL,   "",      NULL,        NULL,         NULL, "2.60",   "true: the side lets waves out (finite elements)", SCENE_EXPLICIT | SCENE_IMPLICIT},
  {"conditions[].plane",                       SCENE_MAP,    "",      NULL,        NULL,         NULL, "2.120", "a rigid plane that the group's nodes do not pass (finite elements); its push is part of reaction(group)", SCENE_EXPLICIT | SCENE_STATIC | SCENE_IMPLICIT},
  {"conditions[].plane.point",                 SCENE_VECTOR, "m",     NULL,        NULL,         NULL, "2.120", "any point of it at time 0", SCENE_REQUIRED},
  {"conditions[].plane.normal",                SCENE_VECTOR, "-",     NULL,        NULL,         NULL, "2.120", "points to the side of the body; any length", SCENE_REQUIRED},
  {"conditions[].plane.friction",              SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "2.122, 2.132", "Coulomb coefficient", 0},
  {"conditions[].plane.restitution",           SCENE_REAL,   "-",     "1",         "[0, 1]",     NULL, "2.124", "root of the share a node gets back of what it lost when it met the plane; 1: nothing is lost", SCENE_EXPLICIT},
  {"conditions[].plane.velocity",              SCENE_MAP,    "",      NULL,        NULL,         NULL, "2.120", "of the plane; at rest without it", 0},
  XYZ("conditions[].plane.velocity",                         "m/s",   NULL, "2.120", "velocity", 0),
  {"conditions[].gravity",                     SCENE_VECTOR, "m/s2",  NULL,        NULL,         NULL, "2.8",   "acts on every body; stands alone, without group", 0},

  {"contact",                                  SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.20",   "how particles that are not bonded meet; without it they pass through each other", 0},
  {"contact.law",                              SCENE_CHOICE, "",      "linear",    NULL,         "linear hertz", "5.20", "spring in proportion to the overlap, or Hertz and Mindlin for spheres", 0},
  {"contact.stiffness",                        SCENE_REAL,   "Pa",    "0 Pa",      NOT_NEGATIVE, NULL, "5.20",   "linear: normal stiffness / reduced radius; 0: Young's modulus of the material", 0},
  {"contact.tangential",                       SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.21",   "tangential / normal stiffness; 0: Mindlin's, 2 (1 - nu)/(2 - nu) for equal materials", 0},
  {"contact.restitution",                      SCENE_REAL,   "-",     "1",         "[0, 1]",     NULL, "5.24",   "speed after / before a normal impact; under 0.001 it is that", 0},
  {"contact.friction",                         SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.27",   "Coulomb coefficient", 0},
  {"contact.static_friction",                  SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.27",   "Coulomb coefficient until a contact slips; 0: the same as friction", 0},
  {"contact.rolling_friction",                 SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.31",   "largest rolling couple / (reduced radius x normal force)", 0},
  {"contact.rolling_damping",                  SCENE_REAL,   "-",     "0",         "[0, 1]",     NULL, "5.31",   "dashpot of the rolling spring, fraction of critical", 0},
  {"contact.torsional_friction",               SCENE_REAL,   "-",     "0",         NOT_NEGATIVE, NULL, "5.31",   "largest couple about the normal / (reduced radius x normal force)", 0},
  {"contact.pairs",                            SCENE_ITEMS,  "",      NULL,        NULL,         NULL, "5.20", "other values for two materials that meet, a list; what a pair does not say is that of contact", 0},
  {"contact.pairs[]",                          SCENE_MAP,    "",      NULL,        NULL,         NULL, "5.20", "two materials, or one with itself", 0},
  {"contact.pairs[].first",                    SCENE_TEXT,   "",      NULL,        NULL,         NULL, "-",    "name of materials", SCENE_REQUIRED},
  {"contact.pairs[].second",                   SCENE_TEXT,   "",      NULL,        NULL,         NULL, "-",    "name of materials", SCENE_REQUIRED},
  {"contact.pairs[].law",                      SCENE_CHOICE, "",      NULL,        NULL,         "linear hertz", "5.20", "as contact.law", 0},
  {"contact.pairs[].stiffness",                SCENE_REAL,   "Pa",    NULL,        NOT_NEGATIVE, NULL, "5.20", "as contact.stiffness", 0},
  {"contact.pairs[].tangential",               SCENE_REAL,   "-",     NULL,        NOT_NEGATIVE, NULL, "5.21", "as contact.tangential", 0},
  {"contact.pairs[].restitution",              SCENE_REAL,   "-",     NULL,        "[0, 1]",     NULL, "5.24", "as contact.restitution", 0},
  {"contact.pairs[].friction",                 SCENE_REAL,   "-",     NULL,        NOT_NEGATIVE, NULL, "5.27", "as contact.friction", 0},
  {"contact.pairs[].static_friction",          SCENE_REAL,   "-",     NULL,        NOT_NEGATIVE, NULL, "5.27", "as contact.static_friction", 0},
  {"contact.pairs[].rolling_friction",         SCENE_REAL,   "-",     NULL,        NOT_NEGATIVE, NULL, "5.31", "as contact.rolling_friction", 0},
  {"contact.pairs[].rolling_damping",          SCENE_REAL,   "-",     NULL,        "[0, 1]",     NULL, "5.31", "as contact.rolling_damping", 0},
  {"contact.pairs[].torsional_friction",       SCENE_REAL,   "-",     NULL,        NOT_NEGATIVE, NULL, "5.31", "as contact.torsional_friction", 0},
  {"contact.initial_overlaps",                 SCENE_CHOICE, "",      "free",      NULL,         "free push", "5.32", "overlaps of the packing: free of force until the pair has parted, or pushing at once", 0},
  {"contact.domain",                           SCENE_CHOICE, "",      "open",      NULL,         "open box periodic", "5.35", "box: particles that leave it are removed and counted; periodic: images meet across it", 0},
  {"contact.low",                              SCENE_VECTOR, "m",     NULL,        NULL,         NULL, "5.35",   "corner of the box or period", 0},
  {"contact.high",                             SCENE_VECTOR, "m",     NULL,        NULL,         NULL, "5.35",   "the other corner; equal components: no period along that axis", 0},
  {"contact.skin",                             SCENE_REAL,   "-",     "0.3",       "(0, 10]",    NULL, "5.33",   "reach of the neighbour list beyond touching / mean radius; changes nothing but speed", 0},
  {"contact.deepest",                          SCENE_REAL,   "-",     "0.01",      "(0, 1)",     NULL, "5.36",   "hertz: largest overlap / reduced radius the step is made for; a run that passes it stops", 0},

  {"coupling",                                 SCENE_MAP,    "",      NULL,        NULL,         NULL, "6",   "where elements and particles overlap", 0},
  {"coupling.width",                           SCENE_REAL,   "elements", "2 elements", POSITIVE, NULL, "6",   "of the overlap", 0},
  {"coupling.substeps",                        SCENE_INT,    "-",     "auto",      "[1, 1e6]",   NULL, "6.10", "particle steps in one step of the elements outside the overlap; auto: the most that is stable (with an implicit far field: accurate), up to 10. The run's step, time.step too, is the elements'", SCENE_AUTO},
  {"coupling.far_field",                       SCENE_CHOICE, "",      "explicit",  NULL,         "explicit implicit static auto", "6.20, 6.40", "how the elements outside the overlap step: explicit, in impulses of substeps; implicit, by Newmark's average acceleration, at any step; auto: implicit where those elements alone would make the particles' step much smaller; static, with time.method: static: load steps, in each of which the particles relax", 0},
  {"coupling.tolerance",                       SCENE_REAL,   "-",     "1e-5",      "(0, 0.1)",   NULL, "6.45", "far_field: static: a load step is done when the mean force out of balance is this fraction of the mean force through bonds and elements", SCENE_STATIC},
  {"coupling.condense",                        SCENE_CHOICE, "",      "auto",      NULL,         "auto always never", "6.44", "far_field: static: its stiffness as a dense matrix of the face, or a solve in each iteration; auto: the cheaper", SCENE_STATIC},
  {"coupling.weights",                         SCENE_CHOICE, "",      "linear",    NULL,         "linear smoothstep", "6", "share of the elements across the overlap", 0},
  {"coupling.floor",                           SCENE_REAL,   "-",     "0.05",      "(0, 0.5)",   NULL, "6",   "smallest share of either side", 0},
  {"coupling.method",                          SCENE_CHOICE, "",      "energy",    NULL,         "energy consistent penalty", "6.3, 6.50, 6.53", "what joins both sides: springs of one energy, nothing to tune; for comparison the constraint held exactly by a solve in each step, or springs of coupling.penalty", 0},
  {"coupling.penalty",                         SCENE_REAL,   "-",     "1",         POSITIVE,     NULL, "6.53", "method: penalty: stiffness of a particle's spring over (lambda + 2 mu) x its volume / its size squared", 0},
  {"coupling.absorber",                        SCENE_BOOL,   "",      "false",     NULL,         NULL, "6.54", "true: waves too short for the elements end in the overlap instead of coming back to the particles; what it takes is damping in the ledger", 0},
  {"coupling.switch",                          SCENE_MAP,    "",      NULL,        NULL,         NULL, "8",   "elements turn into particles as they near their strength; dem.group is what is particles from the start", 0},
  {"coupling.switch.when",                     SCENE_CHOICE, "",      "rankine",   NULL,         "rankine mohr-coulomb given never", "8.1, 8.2, 8.12", "criterion on the elements' stress: tension, or shear with mu_static too; given: coupling.switch.given; never: for comparison", 0},
  {"coupling.switch.given",                    SCENE_MAP,    "",      NULL,        NULL,         NULL, "8.12", "criterion (mean p + mises q) / strength, with p the mean stress, positive in tension, and q von Mises's", 0},
  {"coupling.switch.given.mean",               SCENE_REAL,   "-",     "0",         NULL,         NULL, "8.12", "factor of the mean stress", 0},
  {"coupling.switch.given.mises",              SCENE_REAL,   "-",     "1",         NULL,         NULL, "8.12", "factor of von Mises's stress", 0},
  {"coupling.switch.given.strength",           SCENE_REAL,   "Pa",    NULL,        POSITIVE,     NULL, "8.12", "what an element bears", SCENE_REQUIRED},
  {"coupling.switch.at",                       SCENE_REAL,   "-",     "0.7",       "(0, 1)",     NULL, "8.1",   "fraction of the strength", 0},
  {"coupling.switch.hysteresis",               SCENE_REAL,   "-",     "0.1",       "[0, 1)",     NULL, "8.1",   "an event takes along elements above (1 - this) of that fraction", 0},
  {"coupling.switch.ahead",                    SCENE_INT,    "-",     "1",         "[0, 100]",   NULL, "8",   "and so many rings of elements around those that reached it", 0},
  {"coupling.switch.group",                    SCENE_TEXT,   "",      NULL,        NULL,         NULL, "8",   "the physical group that may turn; without: all of the body", 0},

  {"output",                                   SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "what is written, how often", SCENE_FILL},
  {"output.history",                           SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "history.csv", SCENE_FILL},
  {"output.history.every",                     SCENE_REAL,   "s",     "0 s",       NOT_NEGATIVE, NULL, "-",   "time between rows; 0: only the first and the last", 0},
  {"output.history.quantities",                SCENE_WORDS,  "",      "[energies]", NULL,        "reaction() displacement() velocity() force() torque() work() opening() strain() error gauge quality grains energies balance", "1.3, 2.84, 2.98, 2.99, 4.70, 4.71, 5.86", "columns; the group's name in brackets: reaction(load); strain(a, b): relative elongation between two groups; error: estimate for the elements; gauge, quality: of a test on particles; grains: how many are there, have come, have left", 0},
  {"output.fields",                            SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "frames for ParaView", SCENE_FILL},
  {"output.fields.every",                      SCENE_REAL,   "s",     "0 s",       NOT_NEGATIVE, NULL, "-",   "time between frames; 0: only the first and the last", 0},
  {"output.fields.names",                      SCENE_WORDS,  "",      "[displacement]", NULL,    "displacement velocity rotation orientation stress strain von_mises principal_stress error element_stress element_strain damage criterion coordination fragment bonds reaction", "2.90-2.97, 4.15", "fields of a frame; stress and strain of elements are recovered at nodes, element_... are their means", 0},
  {"output.probes",                            SCENE_NAMES,  "",      NULL,        NULL,         NULL, "2.93", "points of the finite elements that history.csv follows, by name", 0},
  {"output.probes.*",                          SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "a point", 0},
  {"output.probes.*.at",                       SCENE_VECTOR, "m",     NULL,        NULL,         NULL, "-",   "where, undeformed", SCENE_REQUIRED},
  {"output.probes.*.quantities",               SCENE_WORDS,  "",      "[displacement]", NULL,    "displacement velocity stress strain von_mises principal_stress", "2.93, 2.94", "columns quantity(name).part; stress and strain are recovered", 0},
  {"output.checkpoint",                        SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "states to resume from", SCENE_FILL},
  {"output.checkpoint.every",                  SCENE_REAL,   "s",     "0 s",       NOT_NEGATIVE, NULL, "-",   "simulated time between checkpoints; 0: by wall clock", 0},
  {"output.plots",                             SCENE_ITEMS,  "",      NULL,        NULL,         NULL, "-",   "PNG plots of the history, a list", 0},
  {"output.plots[]",                           SCENE_MAP,    "",      NULL,        NULL,         NULL, "-",   "one plot", 0},
  {"output.plots[].x",                         SCENE_TEXT,   "",      "time",      NULL,         NULL, "-",   "column of history.csv", 0},
  {"output.plots[].y",                         SCENE_TEXT,   "",      NULL,        NULL,         NULL, "-",   "column of history.csv", SCENE_REQUIRED},
  {"output.plots[].xscale",                    SCENE_REAL,   "-",     "1",         NULL,         NULL, "-",   "multiplies the x column: 1000 for mm", 0},
  {"output.plots[].yscale",                    SCENE_REAL,   "-",     "1",         NULL,         NULL, "-",   "multiplies the y column: -1 turns a reaction into a load", 0},
  {"output.plots[].xlabel",                    SCENE_TEXT,   "",      NULL,        NULL,         NULL, "-",   "of the axis", 0},
  {"output.plots[].ylabel",                    SCENE_TEXT,   "",      NULL,        NULL,         NULL, "-",   "of the axis", 0},
  {"output.plots[].overlay",                   SCENE_FILE,   "",      NULL,        NULL,         NULL, "-",   "CSV drawn behind: x and a curve, or x and the bounds of an envelope", 0},
  {"output.plots[].file",                      SCENE_TEXT,   "",      NULL,        NULL,         NULL, "-",   "file name; without: made of x and y", 0}
};
/* clang-format on */

PetscInt SceneKeyCount(void)
{
  return (PetscInt)(sizeof(keys) / sizeof(keys[0]));
}

const SceneKey *SceneKeyRow(PetscInt i)
{
  return &keys[i];
}

const char *SceneKeyName(const SceneKey *key)
{
  const char *dot = strrchr(key->path, '.');

  return dot ? dot + 1 : key->path;
}

/* What follows the parent's path in a direct child's: "young", "*", "[]"; NULL when it is no child. */
static const char *PartUnder(const SceneKey *parent, const SceneKey *key)
{
  const size_t n = strlen(parent->path);
  const char  *part;

  if (key == parent || strncmp(key->path, parent->path, n)) return NULL;
  part = key->path + n;
  if (!strcmp(part, "[]")) return part;
  if (n) {
    if (part[0] != '.') return NULL;
    part++;
  }
  return strpbrk(part, ".[") ? NULL : part;
}

const SceneKey *SceneKeyNext(const SceneKey *parent, const SceneKey *before)
{
  for (const SceneKey *key = before ? before + 1 : keys; key < keys + SceneKeyCount(); key++)
    if (PartUnder(parent, key)) return key;
  return NULL;
}

const SceneKey *SceneKeyChild(const SceneKey *parent, const char *name)
{
  for (const SceneKey *key = SceneKeyNext(parent, NULL); key; key = SceneKeyNext(parent, key)) {
    const char *part = PartUnder(parent, key);

    if (parent->type == SCENE_NAMES || (parent->type == SCENE_MAP && !strcmp(part, name))) return key;
  }
  return NULL;
}

const SceneKey *SceneKeyItem(const SceneKey *parent)
{
  return parent->type == SCENE_ITEMS ? SceneKeyNext(parent, NULL) : NULL;
}

const SceneKey *SceneKeyFind(const char *path)
{
  const SceneKey *key = keys;

  while (key && *path) {
    if (*path == '[') {
      const size_t n = strcspn(path, "]");

      if (!path[n]) return NULL;
      key = SceneKeyItem(key);
      path += n + 1;
    } else {
      const size_t n = strcspn(path, ".[");
      char         name[BASE_LINE];

      if (n == 0 || n >= sizeof(name)) return NULL;
      memcpy(name, path, n);
      name[n] = 0;
      key     = SceneKeyChild(key, name);
      path += n;
    }
    if (*path == '.') path++;
  }
  return key;
}

PetscInt SceneKeyChoices(const SceneKey *key, PetscInt max, char word[][32], PetscBool later[], PetscBool group[])
{
  PetscInt n = 0;

  for (const char *c = key->choices; c && *c && n < max; n++) {
    const size_t whole = strcspn(c, " ");
    size_t       size  = whole;

    later[n] = (PetscBool)(c[size - 1] == '~');
    if (later[n]) size--;
    group[n] = (PetscBool)(size > 2 && c[size - 1] == ')');
    if (group[n]) size -= 2;
    size = PetscMin(size, 31);
    memcpy(word[n], c, size);
    word[n][size] = 0;
    c += whole;
    while (*c == ' ') c++;
  }
  return n;
}

PetscErrorCode SceneKeyRange(const SceneKey *key, PetscReal *low, PetscReal *high, PetscBool *low_in, PetscBool *high_in)
{
  char opens, closes;

  PetscFunctionBegin;
  *low    = -INFINITY;
  *high   = INFINITY;
  *low_in = *high_in = PETSC_TRUE;
  if (!key->range) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(sscanf(key->range, "%c%lf,%lf%c", &opens, low, high, &closes) == 4, PETSC_COMM_SELF, PETSC_ERR_PLIB, "Range %s of key %s", key->range, key->path);
  *low_in  = (PetscBool)(opens == '[');
  *high_in = (PetscBool)(closes == ']');
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SceneKeyDefault(const SceneKey *key, PetscInt dimension, size_t size, char text[])
{
  const char *bar = strchr(key->preset, '|');
  size_t      n;

  if (!bar) snprintf(text, size, "%s", key->preset);
  else if (dimension != 2) snprintf(text, size, "%s", bar + 1);
  else {
    n = PetscMin((size_t)(bar - key->preset), size - 1);
    memcpy(text, key->preset, n);
    text[n] = 0;
  }
}
