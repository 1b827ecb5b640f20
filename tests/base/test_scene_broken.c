/*
  test_scene_broken.c - scenes that are wrong, each with the place and the words a user must see.

  Most cases change one line of a good scene; `at` is line:column of the fault in the text made so.
*/
#include "scene_text.h"

/* Line 1 to 11 of a good 3D scene; a case replaces one line and may add lines at the end. */
static const char *const good[] = {"time: {end: 1 ms}",                                                   /*  1 */
                                   "materials:",                                                          /*  2 */
                                   "  concrete:",                                                         /*  3 */
                                   "    density: 2400 kg/m3",                                             /*  4 */
                                   "    young: 28 GPa",                                                   /*  5 */
                                   "    poisson: 0.2",                                                    /*  6 */
                                   "bodies:",                                                             /*  7 */
                                   "  block:",                                                            /*  8 */
                                   "    geometry: {box: {size: [1 m, 1 m, 1 m]}}",                        /*  9 */
                                   "    method: fem",                                                     /* 10 */
                                   "    material: concrete",                                              /* 11 */
                                   "    mesh: {size: 0.1 m}",                                             /* 12 */
                                   "conditions:",                                                         /* 13 */
                                   "  - {group: xmin, fix: all}"};                                        /* 14 */
#define LINES (PetscInt)(sizeof(good) / sizeof(good[0]))

static void Compose(PetscInt line, const char *text, size_t size, char scene[])
{
  size_t used = 0;

  for (PetscInt k = 1; k <= LINES + (line > LINES); k++) {
    const char *now = k == line ? text : k <= LINES ? good[k - 1] : "";

    used += (size_t)snprintf(scene + used, size - used, "%s\n", now);
  }
}

static const struct {
  PetscInt    line; /* replaced; 15: added at the end */
  const char *text, *at, *words;
} cases[] = {
  /* numbers and units */
  {4,  "    density: 28 GPa",                       "4:14",  "density: 28 GPa is a pressure; density wants kg/m3, e.g. 2400 kg/m3"                    },
  {5,  "    young: 28",                             "5:12",  "young: 28 has no unit; Pa is expected, e.g. 28 GPa"                                     },
  {5,  "    young: 28 GPx",                         "5:12",  "young: unknown unit 'GPx' in '28 GPx'; Pa is expected, e.g. 28 GPa"                     },
  {5,  "    young: 2o GPa",                         "5:12",  "young: cannot read '2o GPa' as a number with a unit; write it like 28 GPa"              },
  {5,  "    young: about 28 GPa",                   "5:12",  "young: 'about 28 GPa' is not a number; write it like 28 GPa"                            },
  {5,  "    young: .nan",                           "5:12",  "young: '.nan' is not a number"                                                          },
  {5,  "    young: nan GPa",                        "5:12",  "young: 'nan GPa' is not a number"                                                       },
  {5,  "    young: inf",                            "5:12",  "young: 'inf' is not a number"                                                           },
  {5,  "    young: 1e400 Pa",                       "5:12",  "young: '1e400 Pa' is not a finite number"                                               },
  {5,  "    young: 1e305 GPa",                      "5:12",  "young: '1e305 GPa' is not a finite number"                                              },
  {5,  "    young: 0x10 Pa",                        "5:12",  "young: cannot read '0x10 Pa' as a number with a unit"                                   },
  {5,  "    young: -3 GPa",                         "5:12",  "young is -3 GPa, out of range; allowed: young > 0 Pa"                                   },
  {5,  "    young: 0",                              "5:12",  "young is 0, out of range; allowed: young > 0 Pa"                                        },
  {6,  "    poisson: 0.5",                          "6:14",  "poisson is 0.5, out of range; allowed: -1 < poisson < 0.5"                              },
  {6,  "    poisson: 0.2 m",                        "6:14",  "poisson: 0.2 m is a length; poisson wants a plain number"                               },
  {6,  "    poisson: 26.6 deg",                     "6:14",  "poisson: 26.6 deg is an angle; poisson wants a plain number"                            },
  {6,  "    poisson: 0,2",                          "6:14",  "poisson: cannot read '0,2' as a plain number"                                           },
  {6,  "    poisson: [0.2]",                        "6:14",  "poisson is a list; a number is expected"                                                },
  {1,  "time: {end: 1 ms, safety: 1.5}",            "1:27",  "safety is 1.5, out of range; allowed: 0 < safety <= 1"                                  },
  {1,  "time: {end: 1 ms, step: automatic}",        "1:25",  "step: 'automatic' is not a number"                                                      },
  {1,  "time: {end: }",                             "1:13",  "end has no value; give one or take the key out"                                         },
  {1,  "time: {end: ~}",                            "1:13",  "end has no value"                                                                       },
  /* keys */
  {5,  "    yung: 28 GPa",                          "5:5",   "unknown key 'yung' in materials.concrete; did you mean 'young'?"                        },
  {5,  "    young: 28 GPa\n    colour: grey",       "6:5",   "unknown key 'colour' in materials.concrete; allowed: density, young, poisson"           },
  {1,  "tiem: {end: 1 ms}",                         "1:1",   "unknown key 'tiem'; did you mean 'time'?"                                               },
  {1,  "time: {method: explicit}",                  "1:1",   "time has no 'end'; add it, e.g. end: 20 ms"                                             },
  {1,  "title: no time",                            "1:1",   "the scene has no 'time'"                                                                },
  {4,  "    young: 3 GPa",                          "5:5",   "key 'young' is given twice, first in line 4; keep one"                                  },
  {4,  "    # nothing",                             "3:3",   "material 'concrete' has no 'density', and body 'block' uses it; add it, e.g. density: 2400 kg/m3"},
  {10, "    # nothing",                             "8:3",   "block has no 'method'; add it, one of: fem, dem"                                        },
  {11, "    material: concrte",                     "11:15", "material 'concrte' is not in materials; did you mean 'concrete'"                        },
  {11, "    material: ''",                          "11:15", "material is empty"                                                                      },
  {11, "    material: {a: 1}",                      "11:15", "material is a map of keys; a single text is expected"                                   },
  {1,  "time: [1 ms]",                              "1:7",   "time is a list; a map of keys is expected: end, method"                                 },
  {13, "conditions: {group: a}\nx:",                "13:13", "conditions is a map of keys; a list is expected"                                        },
  {14, "  - xmin",                                  "14:5",  "conditions[0] is a single value; a map of keys is expected: group, body, fix"           },
  {15, "tools: [a]",                                "15:8",  "tools is a list; a map of names is expected"                                            },
  {15, "? [a, b]\n: c",                             "15:3",  "a key that is a map or a list; a key is text"                                           },
  {15, "a.b: c",                                    "15:1",  "key 'a.b': a key is text without . [ ]"                                                 },
  /* words */
  {10, "    method: mesh",                          "10:13", "method: 'mesh' is unknown; allowed: fem, dem, coupled"                                  },
  {1,  "time: {end: 1 ms, method: explict}",        "1:27",  "method: 'explict' is unknown; did you mean 'explicit'? allowed: explicit, static"       },
  {1,  "dimension: 4\ntime: {end: 1 ms}",           "1:12",  "dimension is 4; allowed: 2, 3"                                                          },
  {1,  "dimension: 2.5\ntime: {end: 1 ms}",         "1:12",  "dimension is 2.5; allowed: 2, 3"                                                        },
  {14, "  - {group: xmin, fix: w}",                 "14:24", "fix: 'w' is unknown; allowed: x, y, z, all"                                             },
  {14, "  - {group: xmin, fix: [x, x]}",            "14:28", "fix names x twice"                                                                      },
  {14, "  - {group: xmin, fix: [x, [y]]}",          "14:28", "an item of fix is a list; a word is expected"                                           },
  {15, "output: {fields: {names: [displacment]}}",  "15:27", "did you mean 'displacement'?"                                                           },
  {15, "output: {fields: {names: [stress, rotation]}}", "15:35", "field rotation belongs to method: dem, and no body has it; take it out"            },
  {15, "output: {history: {quantities: [reaction]}}", "15:33", "'reaction' needs a group; write reaction(name of the group)"                          },
  {15, "output: {history: {quantities: [reaction(]}}", "15:33", "'reaction(' needs a group"                                                           },
  {15, "output: {history: {quantities: [energies(a)]}}", "15:33", "energies takes no group; write energies"                                           },
  {15, "output: {history: {quantities: [reaction(xmim)]}}", "15:33", "group 'xmim' is not there; did you mean 'xmin'?"                                },
  /* sections that exclude or need each other */
  {9,  "    geometry: {box: {size: [1 m, 1 m, 1 m]}, cylinder: {radius: 1 m, height: 1 m}}", "9:46", "box and cylinder exclude each other; keep one"         },
  {9,  "    geometry: {}",                          "9:5",   "geometry has none of box, cylinder; give exactly one"                                   },
  {9,  "    geometry: {disc: {radius: 1 m}}",       "9:16",  "'disc' belongs to dimension: 2, and this scene has dimension: 3"                        },
  {9,  "    geometry: {box: {size: [1 m, 1 m]}}",   "9:28",  "size has 2 components; 3 are expected"                                                  },
  {9,  "    geometry: {box: {size: [1 m, 0, 1 m]}}", "9:34", "size[1] is 0, out of range; allowed: size[1] > 0 m"                                     },
  {9,  "    geometry: {box: {size: 1 m}}",          "9:28",  "size is a single value; a list of 3 numbers is expected"                                },
  {9,  "    geometry: beam.geo",                    "9:15",  "there is no file 'beam.geo'"                                                            },
  {9,  "    geometry: beam.step",                   "9:15",  "geometry 'beam.step' is neither .geo nor .msh"                                          },
  {9,  "    geometry: {box: {size: [1 m, 1 m, 1 m]}}\n    length_unit: 1 mm", "10:5", "length_unit is of a geometry file"                                },
  {12, "    mesh: {size: 0.1 m, cells: quad}",      "12:32", "cells: quad in 3 dimensions; allowed: tet, hex"                                         },
  {12, "    mesh: {order: 2}",                      "12:5",  "mesh has no element size; add mesh: {size: 5 mm}"                                       },
  {12, "    mesh: {size: 0.1 m, order: 3}",         "12:32", "order is 3; allowed: 1, 2"                                                              },
  {12, "    mesh: {size: 0.1 m}\n    dem: {packing: {radius: 1 mm}}", "13:5", "'dem' belongs to method: dem, and this body has method: fem; take it out" },
  {10, "    method: dem",                           "8:3",   "block has no 'dem'"                                                                     },
  {10, "    method: dem\n    dem: {packing: {seed: 3}}", "11:11", "packing has none of radius, count, file; give exactly one"                         },
  {10, "    method: dem\n    dem: {packing: {radius: 1 mm, count: 500}}", "11:35", "radius and count exclude each other; keep one"                    },
  {10, "    method: dem\n    dem: {packing: {count: 12.5}}", "11:28", "count is 12.5; a whole number is expected"                                     },
  {10, "    method: dem\n    dem: {packing: {file: p.txt, seed: 3}}", "11:34", "seed is of a packing we make, and file brings its own"                },
  {10, "    method: dem\n    dem: {packing: {radius: 1 mm}, bonded: maybe}", "11:44", "bonded is maybe; allowed: true, false"                         },
  {1,  "thickness: 50 mm\ntime: {end: 1 ms}",       "1:1",   "'thickness' belongs to dimension: 2, and this scene has dimension: 3; take it out"      },
  {1,  "plane: strain\ntime: {end: 1 ms}",          "1:1",   "'plane' belongs to dimension: 2"                                                        },
  {1,  "time: {end: 1 ms, steps: 10}",              "1:19",  "'steps' belongs to time.method: static, and this run is explicit"                       },
  {1,  "time: {end: 1 ms, method: static, step: 1 us}", "1:35", "'step' belongs to time.method: explicit or implicit, and this run is static"         },
  {1,  "time: {end: 1 ms, method: implicit}",       "1:1",   "an implicit run has no largest stable step to choose from; add step"                    },
  {1,  "time: {end: 1 ms, method: implicit, step: auto}", "1:37", "an implicit run has no largest stable step"                                        },
  {1,  "time: {end: 1 ms, method: implicit, step: 1 us, rho_inf: 1.2}", "1:58", "rho_inf is 1.2, out of range"                                        },
  {1,  "time: {end: 1 ms, rho_inf: 0.8}",           "1:19",  "'rho_inf' belongs to time.method: implicit, and this run is explicit"                   },
  {1,  "time: {end: 1 ms, method: implicit, step: 1 us, safety: 0.8}", "1:49", "'safety' belongs to time.method: explicit, and this run is implicit"  },
  {1,  "time: {end: 1 ms, method: static, preload: static}", "1:35", "'preload' belongs to time.method: explicit or implicit, and this run is static"},
  {14, "  - {group: xmin, absorb: 3}",              "14:27", "absorb is 3; allowed: true, false"                                                      },
  {14, "  - {group: xmin, absorb: false}",          "14:5",  "conditions[0] does nothing"                                                             },
  {14, "  - {group: xmin, plane: {}}",              "14:19", "plane has no 'point'"                                                                   },
  {14, "  - {group: xmin, plane: {point: [0 m, 0 m, 0 m]}}", "14:19", "plane has no 'normal'"                                                         },
  {14, "  - {group: xmin, plane: {point: [0 m, 0 m], normal: [1, 0, 0]}}", "14:34", "point"                                                           },
  {14, "  - {group: xmin, plane: {point: [0 m, 0 m, 0 m], normal: [1, 0, 0], friction: -1}}", "14:80", "friction is -1"                               },
  {14, "  - {group: xmin, plane: {point: [0 m, 0 m, 0 m], normal: [1, 0, 0], restitution: 2}}", "14:83", "restitution is 2"                           },
  {14, "  - {group: xmin, plane: {point: [0 m, 0 m, 0 m], normal: [1, 0, 0], velocity: {x: 1 m}}}", "14:84", "1 m"                                    },
  /* conditions, tables, tools */
  {14, "  - {group: xmin}",                         "14:5",  "conditions[0] does nothing; give one of fix, symmetry, velocity"                                  },
  {14, "  - {fix: x}",                              "14:5",  "conditions[0] has no 'group'"                                                           },
  {14, "  - {group: xmni, fix: x}",                 "14:13", "group 'xmni' is not there; did you mean 'xmin'?"                                        },
  {14, "  - {group: top, fix: x}",                  "14:13", "group 'top' is not there; allowed: xmin, xmax, ymin, ymax, zmin, zmax"                  },
  {14, "  - {group: xmin, body: blok, fix: x}",     "14:25", "body 'blok' is not in bodies; did you mean 'block'"                                     },
  {14, "  - {group: xmin, velocity: {y: 1 m/s}, displacement: {y: 1 m}}", "14:56", "velocity and displacement of the same component y exclude each other; keep one"},
  {14, "  - {group: xmin, fix: [x, y], velocity: {y: 1 m/s}}", "14:43", "fix and velocity of the same component y exclude each other"                 },
  {14, "  - {group: xmin, fix: all}\n  - {group: xmin, velocity: {z: 1 m/s}}", "15:30", "component z of group 'xmin' is prescribed twice, first in conditions[0]"},
  {14, "  - {group: xmin, velocity: {}}",           "14:19", "velocity is empty; name a component"                                                    },
  {14, "  - {group: xmin, velocity: 1 m/s}",        "14:29", "velocity is a single value; a map of keys is expected: x, y, z"                         },
  {14, "  - {group: xmin, velocity: {x: {table: [[0 s, 0], [1 s]]}}}", "14:52", "a row of the table has 1 columns; 2 are expected"                    },
  {14, "  - {group: xmin, velocity: {x: {table: [[1 s, 0], [1 s, 0]]}}}", "14:53", "time 1 s does not come after 1 s of the row before; times must increase"},
  {14, "  - {group: xmin, velocity: {x: {table: [[0 s, 0], [5 m, 0]]}}}", "14:53", "time: 5 m is a length; time wants s, e.g. 20 ms"                                                  },
  {14, "  - {group: xmin, velocity: {x: {table: []}}}", "14:41", "the table is empty or no list; write rows of [time, value], e.g. [[0 s, 0], [1 ms, 0.2 m/s]]"               },
  {14, "  - {group: xmin, velocity: {x: {ramp: {to: 1 m/s}}}}", "14:34", "ramp has no 'over', the time it takes"                                      },
  {14, "  - {group: xmin, velocity: {x: {ramp: {to: 1 m/s, over: 0}}}}", "14:58", "over is 0, out of range; allowed: over > 0 s"                      },
  {14, "  - {group: xmin, velocity: {x: {ramp: 1 m/s}}}", "14:40", "ramp is a single value; write {ramp: {to: 0.2 m/s, over: 1 ms}}"                  },
  {14, "  - {group: xmin, velocity: {x: {tabel: []}}}", "14:34", "unknown key 'tabel' in velocity.x; allowed: table, ramp"                            },
  {14, "  - {group: xmin, velocity: {x: [1 m/s]}}", "14:33", "velocity.x is a list; write a value"                                                    },
  {14, "  - {group: xmin, velocity: {x: 1 m}}",     "14:33", "velocity.x: 1 m is a length; velocity.x wants m/s"                                      },
  {14, "  - {gravity: [0, 0, -9.81 m/s2], group: xmin}", "14:35", "gravity acts on every body; take the group out"                                    },
  {15, "tools: {floor: {friction: 0.1}}",           "15:9",  "floor has none of plane, surface, box, cylinder, disc; give exactly one"                },
  {15, "tools: {floor: {}}",                        "15:9",  "floor has none of plane, surface, box, cylinder, disc; give exactly one"                },
  {15, "tools: {floor: {plane: {point: [0, 0, 0], normal: [0, 0, 1]}}}", "15:1", "tools meet particles only, and no body has method: dem"             },
  {15, "tools: {floor: {plane: {point: [0, 0, 0], normal: [0, 0, 0]}}}", "15:51", "normal has length zero; give a direction"                          },
  {15, "tools: {bit: {box: {low: [0, 0, 0], size: [1, 1, 0 m]}}}", "15:50", "size"                                                                      },
  {15, "tools: {bit: {cylinder: {centre: [0, 0, 0], axis: [0, 0, 0], radius: 1}}}", "15:51", "axis has length zero; give a direction"                },
  {15, "tools: {bit: {box: {low: [0, 0, 0], size: [1, 1, 1]}, free: {density: 1}, rotation: {axis: [0, 0, 1], speed: 1}}}", "15:75", "a tool that is free takes no rotation"  },
  {15, "tools: {bit: {box: {low: [0, 0, 0], size: [1, 1, 1]}, free: {mass: 1}}}", "15:62", "mass needs inertia beside it"                               },
  {15, "tools: {bit: {disc: {centre: [0, 0, 0], normal: [0, 0, 1], radius: 1}, free: {density: 1}}}", "15:79", "a density needs a closed surface or a box"  },
  {15, "tools: {bit: {plane: {point: [0, 0, 0], normal: [0, 0, 1]}, damping: 0.1, restitution: 0.5}}", "15:61", "damping stands in place of restitution"  },
  {15, "tools: {bit: {plane: {point: [0, 0, 0], normal: [0, 0, 1]}, rotation: {axis: [0, 0, 1], speed: 1}, twist: {axis: [0, 0, 1], torque: 1, inertia: 1}}}", "15:100", "rotation prescribes what twist would drive"  },
  {15, "output: {history: {quantities: [force(xmin)]}}", "15:33", "force() is of a tool, and 'xmin' is none"                                          },
  {15, "contact: {friction: 0.1}",                  "15:1",  "contact is between particles, and no body has method: dem"                              },
  {15, "contact: {friction: -1}",                   "15:21", "friction"                                                                               },
  {15, "contact: {restitution: 1.1}",               "15:24", "restitution"                                                                            },
  {15, "contact: {law: herz}",                      "15:16", "did you mean 'hertz'"                                                                    },
  {15, "contact: {friction: 0.3, static_friction: 0.2}", "15:43", "static_friction is less than friction"                                              },
  {15, "contact: {domain: box}",                    "15:19", "domain: box needs both corners, contact.low and contact.high"                           },
  {15, "contact: {low: [0, 0, 0]}",                 "15:11", "low is a corner of domain: box or periodic"                                             },
  {15, "contact: {domain: box, low: [0, 0, 0], high: [1 m, -1 m, 1 m]}", "15:46", "high lies below low along an axis"                                   },
  /* not covered yet */
  {6,  "    poisson: 0.2\n    tensile_strength: 3 MPa", "7:5", "tensile_strength acts with law: cohesive or published only; add that or take it out"  },
  {6,  "    poisson: 0.2\n    law: cohesive",       "7:5",   "law: cohesive needs tensile_strength"                                                   },
  {6,  "    poisson: 0.2\n    law: cohesive\n    shear_strength: 5 MPa", "7:5", "law: cohesive needs tensile_strength; add it, e.g. tensile_strength: 3 MPa"      },
  {6,  "    poisson: 0.2\n    law: cohesive\n    shear_strength: 5 MPa", "8:5", "shear_strength and fracture_energy_shear go together; give both or neither"      },
  {6,  "    poisson: 0.2\n    elasticity: given", "7:5",   "elasticity: given needs stiffness_normal; add it"                                       },
  {6,  "    poisson: 0.2\n    poisson_term: true", "7:5",  "poisson_term belongs to elasticity: kdem, and here it is exact; take it out"            },
  {6,  "    poisson: 0.2\n    elasticity: kdem\n    interaction_range: 0.1", "8:5", "interaction_range belongs to elasticity: onate2015 given"    },
  {6,  "    poisson: 0.2\n    law: published\n    tensile_strength: 3 MPa\n    delta_n: 0.2", "7:10", "law: published breaks springs; with elasticity: exact write law: cohesive" },
  {6,  "    poisson: 0.2\n    elasticity: kdem\n    law: cohesive\n    tensile_strength: 3 MPa\n    fracture_energy: 100 J/m2", "8:10", "law: cohesive breaks the facets of elasticity: exact" },
  {6,  "    poisson: 0.2\n    elasticity: kdem\n    law: published", "8:5", "law: published needs tensile_strength or shear_strength"                  },
  {6,  "    poisson: 0.2\n    elasticity: kdem\n    law: published\n    tensile_strength: 3 MPa", "9:5", "tensile_strength of law: published needs one of delta_n and fracture_energy" },
  {6,  "    poisson: 0.2\n    elasticity: kdem\n    law: published\n    tensile_strength: 3 MPa\n    delta_n: 0.2\n    compression: {lcs1: 3 MPa, yrc1: 3, lcs2: 2 MPa, yrc2: 9}", "11:47", "lcs2 is not above lcs1" },
  {6,  "    poisson: 0.2\n    elasticity: kdem\n    law: published\n    tensile_strength: 3 MPa\n    delta_n: 0.2\n    compression: {lcs1: 3 MPa, yrc1: 3, lcs2: 5 MPa}", "11:41", "lcs2 and yrc2 go together" },
  {6,  "    poisson: 0.2\n    delta_n: 0.2",        "7:5",   "delta_n acts with law: published only; add that or take it out"                         },
  {6,  "    poisson: 0.2\n    softening: {bilinear: {knee_stress: 2, knee_opening: 0.5}}", "7:41", "knee_stress is 2, out of range"                        },
  {15, "coupling: {width: 2 m}",                    "15:19", "width: 2 m is a length; width wants elements, e.g. 2 elements"                          },
  {15, "coupling: {width: 2 elements}",             "15:1",  "coupling joins elements and particles, and no body has method: coupled; take it out"    },
  {15, "coupling: {switch: {at: 1.2}}",             "15:25", "at is 1.2, out of range"                                                                },
  /* coupled bodies */
  {10, "    method: coupled",                       "8:3",   "block has no 'dem'; add it"                                                             },
  {10, "    method: coupled",                       "9:5",   "a coupled body needs a geometry file with a physical group for its particles"           },
  {10, "    method: coupled\n    dem: {packing: {radius: 1 mm}}", "11:5", "dem has no group; name the physical group that becomes particles"        },
  {10, "    method: dem\n    dem: {group: core, packing: {radius: 1 mm}}", "11:11", "dem.group belongs to method: coupled"                          },
  /* YAML */
  {5,  "\tyoung: 28 GPa",                           "5:1",   "this is a tab, indent with blanks"                                                      },
  {5,  "   young: 28 GPa",                          "5:4",   "not YAML: "                                                                             },
  {9,  "    geometry: {box: {size: [1 m, 1 m}}",    "9:37",  "not YAML: "                                                                             },
  {5,  "    young: &e 28 GPa",                      "5:12",  "anchor &e; anchors and aliases are not used in scenes, write the value out"             },
  {5,  "    young: *e",                             "5:12",  "alias *e; anchors and aliases are not used in scenes"                                   },
  {5,  "    young: !!str 28 GPa",                   "5:12",  "tag tag:yaml.org,2002:str; the table of keys says the types"                            },
  {5,  "    young: 28 \xff GPa",                    "5:15",  "byte 0xff is not UTF-8 text; save the file as UTF-8"                                    },
  {5,  "    # \xc3\xa9 \xc0\x80",                   "5:9",   "byte 0xc0 is not UTF-8 text"                                                            },
  {5,  "    young: 28\x01 GPa",                     "5:14",  "control character 0x01"                                                                 },
  {15, "---\ntime: 1",                              "15:1",  "a second document (---); one file holds one scene"                                      }
};

static PetscErrorCode TestOneLineWrong(void)
{
  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(cases) / sizeof(cases[0]); k++) {
    char           text[4096], want[64];
    Scene          scene = NULL;
    PetscErrorCode code;

    Compose(cases[k].line, cases[k].text, sizeof(text), text);
    BaseErrorClear();
    BaseErrorQuiet(PETSC_TRUE);
    code = SceneTextRead(text, strlen(text), 0, NULL, &scene);
    BaseErrorQuiet(PETSC_FALSE);
    if (code != PETSC_ERR_USER_INPUT || scene) fail_msg("case '%s' passed", cases[k].text);
    snprintf(want, sizeof(want), "scene.yaml:%s: error: ", cases[k].at);
    /* the words, at the place, in one line of the report */
    {
      PetscBool   found = PETSC_FALSE;
      char       *reports = strdup(BaseReports()), *rest = reports, *line;

      while ((line = strsep(&rest, "\n"))) found = (PetscBool)(found || (strstr(line, want) && strstr(line, cases[k].words)));
      if (!found) fail_msg("case '%s'\n  wants %s%s\n  got   %s", cases[k].text, want, cases[k].words, BaseReports());
      free(reports);
    }
    if (strncmp(BaseErrorMessage(), BaseReports(), strlen(BaseErrorMessage()))) fail_msg("case '%s': message '%s' is not the first of\n%s", cases[k].text, BaseErrorMessage(), BaseReports());
    if (!strstr(BaseReports(), "; ")) {
      const char *covered = strstr(BaseReports(), "not covered yet");

      if (!covered) fail_msg("case '%s' says no cure: %s", cases[k].text, BaseReports());
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOneLineWrong)

/* The unchanged text is good; otherwise the cases above prove nothing. */
static PetscErrorCode TestUnchangedIsGood(void)
{
  char  text[4096];
  Scene scene;

  PetscFunctionBeginUser;
  Compose(0, "", sizeof(text), text);
  PetscCall(SceneTextRead(text, strlen(text), 0, NULL, &scene));
  PetscCall(SceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestUnchangedIsGood)

/* A criterion of one's own: its numbers and the word go together, its strength is there and positive, no key is odd. */
static PetscErrorCode TestGivenCriterion(void)
{
  static const struct {
    const char *turn, *words;
  } cases[] = {
    {"when: given",                                                          "4:21: error: a given criterion needs its numbers"                       },
    {"when: rankine, given: {mises: 1, strength: 1 Pa}",                     "4:36: error: these numbers belong to when: given"                       },
    {"given: {mises: 1, strength: 1 Pa}",                                    "4:21: error: these numbers belong to when: given"                       },
    {"when: given, given: {mises: 1}",                                       "4:34: error: given has no 'strength'"                                   },
    {"when: given, given: {mises: 1, strength: 0 Pa}",                       "4:62: error: strength is 0 Pa, out of range"                            },
    {"when: given, given: {mises: 1, strength: 5}",                          "strength: 5 has no unit"                                                },
    {"when: given, given: {mises: 1 Pa, strength: 1 Pa}",                    "mises: 1 Pa is a pressure; mises wants a plain number"                  },
    {"when: given, given: {shear: 1, strength: 1 Pa}",                       "unknown key 'shear' in coupling.switch.given"                           },
    {"when: given, given: [1, 2]",                                           "given is a list"                                                        },
    {"when: mises",                                                          "'mises'"                                                                },
  };
  static const char scene_text[] = "time: {end: 1 s}\nmaterials: {m: {density: 1 kg/m3, young: 1 Pa, poisson: 0, law: cohesive, tensile_strength: 1 Pa, fracture_energy: 1 J/m2}}\n"
                                   "bodies: {b: {geometry: b.geo, method: coupled, material: m, dem: {group: g, packing: {radius: 1 m}}}}\ncoupling: {switch: {%s}}\n";

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(cases) / sizeof(cases[0]); k++) {
    char  text[1024];
    Scene scene;

    SceneTextWrite("b.geo", "\n", 1);
    snprintf(text, sizeof(text), scene_text, cases[k].turn);
    CheckFails(SceneTextRead(text, strlen(text), 0, NULL, &scene), PETSC_ERR_USER_INPUT, cases[k].words);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestGivenCriterion)

/* Ways of joining for comparison, and the absorber: what they do not go with. */
static PetscErrorCode TestJoining(void)
{
  static const struct {
    const char *coupling, *words;
  } cases[] = {
    {"method: glue",                                  "'glue'"                                                                },
    {"penalty: 1",                                    "4:12: error: this stiffness belongs to method: penalty"                },
    {"method: consistent, penalty: 1",                "4:32: error: this stiffness belongs to method: penalty"                },
    {"method: penalty, penalty: 0",                   "4:38: error: penalty is 0, out of range"                               },
    {"method: consistent, absorber: true",            "4:42: error: the absorber belongs to the springs of method: energy"    },
    {"method: consistent, switch: {at: 0.7}",         "4:20: error: method: consistent is there for comparison"               },
    {"method: penalty, far_field: implicit",          "4:40: error: far_field: implicit does not go with this method"         },
    {"absorber: true, far_field: auto",               "4:39: error: far_field: auto does not go with absorber: true"          },
    {"absorber: true, substeps: 2",                   "4:38: error: substeps: 2 does not go with absorber: true"              },
    {"method: consistent, substeps: 5",               "4:42: error: substeps: 5 does not go with this method"                 },
    {"absorber: perhaps",                             "absorber"                                                              },
  };
  static const char scene_text[] = "time: {end: 1 s}\nmaterials: {m: {density: 1 kg/m3, young: 1 Pa, poisson: 0, law: cohesive, tensile_strength: 1 Pa, fracture_energy: 1 J/m2}}\n"
                                   "bodies: {b: {geometry: b.geo, method: coupled, material: m, dem: {group: g, packing: {radius: 1 m}}}}\ncoupling: {%s}\n";

  PetscFunctionBeginUser;
  SceneTextWrite("b.geo", "\n", 1);
  for (size_t k = 0; k < sizeof(cases) / sizeof(cases[0]); k++) {
    char  text[1024];
    Scene scene;

    snprintf(text, sizeof(text), scene_text, cases[k].coupling);
    CheckFails(SceneTextRead(text, strlen(text), 0, NULL, &scene), PETSC_ERR_USER_INPUT, cases[k].words);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestJoining)

/* Whole texts, one fault each and no other. */
static PetscErrorCode TestWholeTexts(void)
{
  static const char materials[] = "materials: {m: {density: 1 kg/m3, young: 1 Pa, poisson: 0}}\n";
  static const struct {
    const char *head, *tail, *words;
  } texts[] = {
    {"",                                            NULL,                                                                                                   "1:1: error: the file is empty"                                },
    {"# only a comment\n",                          NULL,                                                                                                   "1:1: error: the file is empty"                                },
    {"just words\n",                                NULL,                                                                                                   "1:1: error: a scene is a map of keys, this is a single value" },
    {"- a\n- b\n",                                  NULL,                                                                                                   "1:1: error: a scene is a map of keys, this is a list"         },
    {"time: {end: 1 s}\nbodies: {}\n",              "",                                                                                                     "2:1: error: bodies is empty; at least one is needed"          },
    {"dimension: 2\ntime: {end: 1 s}\n",            "bodies: {b: {geometry: {cylinder: {radius: 1 m, height: 1 m}}, method: fem, material: m, mesh: {size: 1 m}}}\n", "4:25: error: 'cylinder' belongs to dimension: 3"    },
    {"dimension: 2\ntime: {end: 1 s}\n",            "bodies: {b: {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: fem, material: m, mesh: {size: 1 m}}}\n", "4:48: error: size has a z component, but the scene has dimension: 2"},
    {"dimension: 2\ntime: {end: 1 s}\n",            "bodies: {b: {geometry: {disc: {radius: 1 m}}, method: fem, material: m, mesh: {size: 1 m}}}\nconditions: [{group: side, fix: [x, z]}]\n", "5:37: error: fix: z, but the scene has dimension: 2"},
    {"dimension: 2\ntime: {end: 1 s}\n",            "bodies: {b: {geometry: {disc: {radius: 1 m}}, method: fem, material: m, mesh: {size: 1 m}}}\nconditions: [{group: side, velocity: {z: 1 m/s}}]\n", "5:39: error: 'z' belongs to dimension: 3"},
    {"time: {end: 1 s, method: static}\n",          "bodies: {b: {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: dem, material: m, dem: {bonded: false, packing: {radius: 1 m}}}}\n", "3:96: error: loose grains have no static state"},
    {"time: {end: 1 s, method: implicit, step: 1 ms}\n", "bodies: {b: {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: dem, material: m, dem: {packing: {radius: 1 m}}}}\n", "3:64: error: time.method is implicit, and implicit needs a fem body"},
    {"time: {end: 1 s, preload: static}\n",         "bodies: {b: {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: dem, material: m, dem: {packing: {radius: 1 m}}}}\n", "3:64: error: time.preload: static needs a fem or a coupled body"},
    {"time: {end: 1 s}\n",                          "bodies: {a: &x {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: fem, material: m, mesh: {size: 1 m}}}\n", "3:13: error: anchor &x"},
    {"time: {end: 1 s}\n",                          "bodies: {a: {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: fem, material: m, mesh: {size: 1 m}}, b: {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: fem, material: m, mesh: {size: 1 m}}}\nconditions: [{group: xmax, fix: x}]\n", "4:22: error: group 'xmax' is in bodies 'a' and 'b'; add body: a or body: b"},
    {"time: {end: 1 s}\n",                          "bodies: {a: {geometry: {cylinder: {radius: 1 m, height: 1 m}}, method: fem, material: m, mesh: {size: 1 m}}}\nconditions: [{group: tip, fix: x}]\n", "4:22: error: group 'tip' is not there; did you mean 'top'? allowed: bottom, top, side"}
  };

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(texts) / sizeof(texts[0]); k++) {
    char  text[2048];
    Scene scene;

    snprintf(text, sizeof(text), "%s%s%s", texts[k].head, texts[k].tail ? materials : "", texts[k].tail ? texts[k].tail : "");
    CheckFails(SceneTextRead(text, strlen(text), 0, NULL, &scene), PETSC_ERR_USER_INPUT, texts[k].words);
    if (strchr(BaseReports(), '\n')[1]) fail_msg("one fault expected:\n%s", BaseReports());
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestWholeTexts)

static PetscErrorCode TestNoFile(void)
{
  char  path[256];
  Scene scene = NULL;

  PetscFunctionBeginUser;
  snprintf(path, sizeof(path), "%s/nothing.yaml", folder);
  CheckFails(SceneRead(PETSC_COMM_SELF, path, 0, NULL, &scene), PETSC_ERR_USER_INPUT, "nothing.yaml: error: there is no such file; give the path of a scene");
  CheckContains(BaseErrorMessage(), folder);
  CheckFails(SceneRead(PETSC_COMM_SELF, folder, 0, NULL, &scene), PETSC_ERR_USER_INPUT, "error: is a directory");
  CheckFails(SceneRead(PETSC_COMM_SELF, "/dev/zero", 0, NULL, &scene), PETSC_ERR_USER_INPUT, "error: is not a regular file");
  CheckFails(SceneRead(PETSC_COMM_SELF, "", 0, NULL, &scene), PETSC_ERR_USER_INPUT, "error: there is no such file");
  CheckTrue(scene == NULL);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestNoFile)

/* All faults in one pass, in the order of the file; at most 20, and the rest counted. */
static PetscErrorCode TestManyFaults(void)
{
  static const char *const three = "time: {end: 1}\nmaterials: {m: {density: 1 m, young: 1 Pa, poisson: 0}}\nbodies: {b: {geometry: {box: {size: [1 m, 1 m, 1 m]}}, methd: fem, material: k}}\n";
  const char              *at;
  char                     many[4096] = "time: {end: 1 s}\nmaterials: {m: {density: 1 kg/m3, young: 1 Pa, poisson: 0}}\nbodies: {b: {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: fem, material: m, mesh: {size: 1 m}}}\n";
  PetscInt                 lines = 0;
  Scene                    scene;

  PetscFunctionBeginUser;
  CheckFails(SceneTextRead(three, strlen(three), 0, NULL, &scene), PETSC_ERR_USER_INPUT, "scene.yaml:1:13: error: end: 1 has no unit");
  CheckContains(BaseReports(), "scene.yaml:2:26: error: density: 1 m is a length");
  CheckContains(BaseReports(), "scene.yaml:3:10: error: b has no 'method'");
  CheckContains(BaseReports(), "scene.yaml:3:56: error: unknown key 'methd' in bodies.b; did you mean 'method'?");
  CheckContains(BaseReports(), "scene.yaml:3:78: error: material 'k' is not in materials; there is 'm'");
  CheckTrue(strstr(BaseReports(), ":2:26:") < strstr(BaseReports(), ":3:10:") && strstr(BaseReports(), ":3:10:") < strstr(BaseReports(), ":3:56:"));
  for (PetscInt k = 0; k < 25; k++) snprintf(many + strlen(many), sizeof(many) - strlen(many), "wrong%d: 1\n", (int)k);
  CheckFails(SceneTextRead(many, strlen(many), 0, NULL, &scene), PETSC_ERR_USER_INPUT, "scene.yaml:4:1: error: unknown key 'wrong0'");
  for (at = BaseReports(); (at = strchr(at, '\n')); at++) lines++;
  CheckInt(lines, 21);
  CheckContains(BaseReports(), "scene.yaml: 5 more faults");
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestManyFaults)

static PetscErrorCode TestWrongOverrides(void)
{
  static const struct {
    const char *set, *words;
  } wrong[] = {
    {"time.end",                      "--set time.end: error: no path=value; write it like time.end=5 ms"            },
    {"=5",                            "--set =5: error: no path=value"                                               },
    {"time.end=",                     "--set time.end=: error: no value after ="                                     },
    {"time.end=5",                    "--set time.end=5: error: end: 5 has no unit; s is expected"                   },
    {"time.edn=5 s",                  "--set time.edn=5 s: error: unknown key 'edn' in time; did you mean 'end'?"    },
    {"tme.end=5 s",                   "--set tme.end=5 s: error: unknown key 'tme'; did you mean 'time'?"            },
    {"conditions[7].fix=x",           "error: [7] is not an item here; there are 1 items, counted from 0"            },
    {"conditions[x].fix=x",           "error: [x] is not an item here"                                               },
    {"time[0]=x",                     "error: [0] is not an item here; this is no list"                              },
    {"conditions.fix=x",              "error: 'fix' stands under a list; give an item"                               },
    {"title.x=x",                     "error: 'x' stands under a value"                                              },
    {"a..b=1",                        "error: the path before = is broken"                                           },
    {"conditions[0=1",                "error: the path before = is broken"                                           },
    {"time={end: 1",                  "--set time={end: 1: error: not YAML"                                          },
    {"time.end=\xff",                 "error: byte 0xff is not UTF-8 text"                                           },
    {"a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a=1", "error: the path before = is broken"}
  };
  char text[4096];

  PetscFunctionBeginUser;
  Compose(1, "title: t\ntime: {end: 1 s}", sizeof(text), text);
  for (size_t k = 0; k < sizeof(wrong) / sizeof(wrong[0]); k++) {
    Scene scene;

    CheckFails(SceneTextRead(text, strlen(text), 1, &wrong[k].set, &scene), PETSC_ERR_USER_INPUT, wrong[k].words);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestWrongOverrides)

static const struct CMUnitTest tests[] = {TEST(TestUnchangedIsGood), TEST(TestOneLineWrong), TEST(TestGivenCriterion), TEST(TestJoining), TEST(TestWholeTexts), TEST(TestNoFile), TEST(TestManyFaults), TEST(TestWrongOverrides)};

SCENE_MAIN(tests)
