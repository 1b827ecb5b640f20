/*
  new_lab.c - scenes of the virtual laboratory that `cleave new` writes: one rock, one way of loading each.

  Both platens move, so the middle stays where it is. Each scene asks for the gauge (stress and strain of the middle
  half) and for its quasi-static quality. Run times are stated for one thread.
*/
#include "new.h"

#define ROCK \
  "materials:\n" \
  "  rock:\n" \
  "    density: 2500 kg/m3\n" \
  "    young: 30 GPa\n" \
  "    poisson: 0.2\n" \
  "    law: cohesive              # or take this and the lines below out: elastic, never breaks\n" \
  "    tensile_strength: 5 MPa\n" \
  "    fracture_energy: 25 J/m2\n" \
  "    shear_strength: 12 MPa     # cohesion of a facet; with mu_static it sets the compressive strength\n" \
  "    fracture_energy_shear: 1000 J/m2\n" \
  "    mu_static: 0.6\n" \
  "    mu_dynamic: 0.4\n" \
  "    local_damping: 0.3\n"

#define CYLINDER \
  "bodies:\n" \
  "  sample:\n" \
  "    geometry:\n" \
  "      cylinder: {radius: 25 mm, height: 100 mm}   # axis z; groups: bottom top side\n" \
  "    method: dem\n" \
  "    material: rock\n" \
  "    dem:\n" \
  "      packing: {radius: 3.2 mm, spread: 0.2, seed: 1}\n"

const char AppNewUcs[] =
  "# A cylinder of bonded particles between two smooth platens, pressed until it breaks.\n"
  "# E and nu are columns of the history (gauge), the peak is in summary.json. docs/scene.md lists every key.\n"
  "title: Uniaxial compression\n"
  "time:\n"
  "  end: 8 ms\n"
  "  safety: 0.9                  # of the largest stable step\n"
  ROCK CYLINDER
  "conditions:\n"
  "  # Smooth: the ends slide on their platens. With friction: velocity: {x: 0, y: 0, z: ...}, which glues them.\n"
  "  - {group: bottom, velocity: {z: {ramp: {to: 20 mm/s, over: 1 ms}}}}\n"
  "  - {group: top, velocity: {z: {ramp: {to: -20 mm/s, over: 1 ms}}}}\n"
  "output:\n"
  "  history: {every: 20 us, quantities: [reaction(top), reaction(bottom), displacement(top), displacement(bottom), gauge, quality]}\n"
  "  fields: {every: 1 ms, names: [displacement, stress, damage]}\n"
  "  plots:\n"
  "    - {x: gauge.strain.z, y: gauge.stress.z, xscale: -1000, yscale: -1e-6, xlabel: \"axial strain [1e-3]\", ylabel: \"axial stress [MPa]\", file: stress-strain.png}\n"
  "    - {x: time, y: kinetic_ratio, file: quality.png}\n";

const char AppNewTriaxial[] =
  "# Triaxial compression: pressure on the side, a rest, axial load with one unloading and reloading, until it breaks.\n"
  "# Platens cannot be held and loaded at once. While the pressure grows they follow the elastic shortening of a hydrostatic\n"
  "# state, H p (1 - 2 nu)/E = 100 mm x 10 MPa x 0.6/30 GPa = 0.02 mm, half of it each; then they rest; then they press.\n"
  "title: Triaxial compression, 10 MPa\n"
  "time: {end: 19.6 ms}\n"
  ROCK CYLINDER
  "conditions:\n"
  "  - {group: side, pressure: {ramp: {to: 10 MPa, over: 1 ms}}}\n"
  "  - {group: bottom, velocity: {z: {table: [[0 ms, 10 mm/s], [0.95 ms, 10 mm/s], [1.05 ms, 0 mm/s], [2 ms, 0 mm/s], [3 ms, 20 mm/s], [5 ms, 20 mm/s], [5.2 ms, -20 mm/s], [6 ms, -20 mm/s], [6.2 ms, 20 mm/s]]}}}\n"
  "  - {group: top, velocity: {z: {table: [[0 ms, -10 mm/s], [0.95 ms, -10 mm/s], [1.05 ms, 0 mm/s], [2 ms, 0 mm/s], [3 ms, -20 mm/s], [5 ms, -20 mm/s], [5.2 ms, 20 mm/s], [6 ms, 20 mm/s], [6.2 ms, -20 mm/s]]}}}\n"
  "output:\n"
  "  history: {every: 20 us, quantities: [reaction(top), displacement(top), displacement(bottom), gauge, quality]}\n"
  "  fields: {every: 2 ms, names: [displacement, stress, damage]}\n"
  "  plots:\n"
  "    - {x: gauge.strain.z, y: gauge.stress.z, xscale: -1000, yscale: -1e-6, xlabel: \"axial strain [1e-3]\", ylabel: \"axial stress [MPa]\", file: stress-strain.png}\n"
  "    - {x: time, y: gauge.stress.x, yscale: -1e-6, ylabel: \"lateral stress [MPa]\", file: confinement.png}\n";

const char AppNewHydrostatic[] =
  "# Pressure from all sides on a free cylinder. `criterion` shows how near each bond is to failure: with elasticity: exact\n"
  "# nothing is. A local rule between centres (elasticity: onate2015, law: published) puts one bond in a hundred above 0.3,\n"
  "# criterion: nonlocal takes that away again (ctest -R lab_hydrostatic).\n"
  "title: Hydrostatic compression, 30 MPa\n"
  "time: {end: 3 ms}\n"
  ROCK CYLINDER
  "conditions:\n"
  "  - {group: bottom, pressure: {ramp: {to: 30 MPa, over: 2 ms}}}\n"
  "  - {group: top, pressure: {ramp: {to: 30 MPa, over: 2 ms}}}\n"
  "  - {group: side, pressure: {ramp: {to: 30 MPa, over: 2 ms}}}\n"
  "output:\n"
  "  history: {every: 20 us, quantities: [gauge, quality]}\n"
  "  fields: {every: 1 ms, names: [displacement, stress, criterion]}\n"
  "  plots:\n"
  "    - {x: gauge.strain.z, y: gauge.stress.z, xscale: -1000, yscale: -1e-6, xlabel: \"axial strain [1e-3]\", ylabel: \"pressure [MPa]\", file: stress-strain.png}\n";

const char AppNewCompaction[] =
  "# Uniaxial strain: a block in a stiff, smooth box is pressed from both ends. The published law with its branches of\n"
  "# compression, then unloading: the set stays. The first slope is E (1 - nu)/((1 + nu)(1 - 2 nu)) with elasticity: exact.\n"
  "title: Uniaxial strain compaction\n"
  "time: {end: 8 ms}\n"
  "materials:\n"
  "  rock:\n"
  "    density: 2500 kg/m3\n"
  "    young: 30 GPa\n"
  "    poisson: 0.2\n"
  "    elasticity: kdem           # springs through the facets; the branches belong to the published rules\n"
  "    law: published\n"
  "    tensile_strength: 5 MPa\n"
  "    delta_n: 0.2\n"
  "    shear_strength: 60 MPa\n"
  "    delta_s: 0.2\n"
  "    mu_static: 0.6\n"
  "    mu_dynamic: 0.4\n"
  "    compression: {lcs1: 20 MPa, yrc1: 3, lcs2: 45 MPa, yrc2: 12, lcs3: 70 MPa, yrc3: 22}\n"
  "    local_damping: 0.3\n"
  "bodies:\n"
  "  sample:\n"
  "    geometry:\n"
  "      box: {size: [40 mm, 40 mm, 80 mm]}\n"
  "    method: dem\n"
  "    material: rock\n"
  "    dem:\n"
  "      packing: {radius: 3.2 mm, spread: 0.2, seed: 1}\n"
  "conditions:\n"
  "  - {group: xmin, fix: x}\n"
  "  - {group: xmax, fix: x}\n"
  "  - {group: ymin, fix: y}\n"
  "  - {group: ymax, fix: y}\n"
  "  - {group: zmin, velocity: {z: {table: [[0 ms, 0 mm/s], [1 ms, 20 mm/s], [6 ms, 20 mm/s], [6.5 ms, -10 mm/s], [8 ms, -10 mm/s]]}}}\n"
  "  - {group: zmax, velocity: {z: {table: [[0 ms, 0 mm/s], [1 ms, -20 mm/s], [6 ms, -20 mm/s], [6.5 ms, 10 mm/s], [8 ms, 10 mm/s]]}}}\n"
  "output:\n"
  "  history: {every: 20 us, quantities: [reaction(zmax), reaction(xmax), displacement(zmax), displacement(zmin), gauge, quality]}\n"
  "  fields: {every: 2 ms, names: [displacement, stress, damage]}\n"
  "  plots:\n"
  "    - {x: gauge.strain.z, y: gauge.stress.z, xscale: -1000, yscale: -1e-6, xlabel: \"axial strain [1e-3]\", ylabel: \"axial stress [MPa]\", file: stress-strain.png}\n";

const char AppNewBrazilian[] =
  "# Brazilian splitting test: a disc pressed between platens on two flats 20 degrees wide, so that it tears from the middle and is\n"
  "# not crushed at a point; its geometry is brazilian.geo, written beside this file. 2 P/(pi D t), P the peak of\n"
  "# reaction(upper).y, came to 5.24 MPa for a tensile strength of 5 MPa (0.964 of it is the stress in the middle for such flats).\n"
  "title: Brazilian test\n"
  "dimension: 2\n"
  "plane: stress\n"
  "thickness: 25 mm\n"
  "time: {end: 2.4 ms}\n"
  ROCK
  "bodies:\n"
  "  sample:\n"
  "    geometry: brazilian.geo\n"
  "    length_unit: 1 mm\n"
  "    method: dem\n"
  "    material: rock\n"
  "    dem:\n"
  "      packing: {radius: 0.8 mm, spread: 0.2, seed: 1}\n"
  "conditions:\n"
  "  - {group: lower, velocity: {y: {ramp: {to: 15 mm/s, over: 0.5 ms}}}}\n"
  "  - {group: upper, velocity: {y: {ramp: {to: -15 mm/s, over: 0.5 ms}}}}\n"
  "output:\n"
  "  history: {every: 5 us, quantities: [reaction(upper), reaction(lower), displacement(upper), displacement(lower), quality]}\n"
  "  fields: {every: 0.4 ms, names: [displacement, stress, damage, fragment]}\n"
  "  plots:\n"
  "    - {x: displacement(upper).y, y: reaction(upper).y, xscale: -1000, yscale: -0.001, xlabel: \"platen [mm]\", ylabel: \"force [kN]\", file: force-displacement.png}\n";

const char AppNewBrazilianGeo[] =
  "// A disc of 50 mm with two flats, 20 degrees wide, that the platens press on. Millimetres.\n"
  "R = 25; a = 10*Pi/180;            // radius, half the angle of a flat\n"
  "h = 4;                            // of the cells that describe the shape; particles have their own size\n"
  "c = R*Cos(a); s = R*Sin(a);\n"
  "Point(1) = {0, 0, 0, h};\n"
  "Point(2) = {s, -c, 0, h};\n"
  "Point(3) = {R, 0, 0, h};\n"
  "Point(4) = {s, c, 0, h};\n"
  "Point(5) = {-s, c, 0, h};\n"
  "Point(6) = {-R, 0, 0, h};\n"
  "Point(7) = {-s, -c, 0, h};\n"
  "Circle(1) = {2, 1, 3};\n"
  "Circle(2) = {3, 1, 4};\n"
  "Line(3) = {4, 5};\n"
  "Circle(4) = {5, 1, 6};\n"
  "Circle(5) = {6, 1, 7};\n"
  "Line(6) = {7, 2};\n"
  "Curve Loop(1) = {1:6};\n"
  "Plane Surface(1) = {1};\n"
  "Physical Surface(\"disc\") = {1};\n"
  "Physical Curve(\"upper\") = {3};\n"
  "Physical Curve(\"lower\") = {6};\n";

const char AppNewTension[] =
  "# A bar drawn apart between glued ends until it tears. The peak is the tensile strength, the energy its fracture energy x crack.\n"
  "title: Direct tension\n"
  "time: {end: 4 ms}\n"
  ROCK
  "bodies:\n"
  "  bar:\n"
  "    geometry:\n"
  "      box: {size: [30 mm, 30 mm, 80 mm]}\n"
  "    method: dem\n"
  "    material: rock\n"
  "    dem:\n"
  "      packing: {radius: 3 mm, spread: 0.2, seed: 1}\n"
  "conditions:\n"
  "  - {group: zmin, velocity: {x: 0 m/s, y: 0 m/s, z: {ramp: {to: -5 mm/s, over: 1 ms}}}}\n"
  "  - {group: zmax, velocity: {x: 0 m/s, y: 0 m/s, z: {ramp: {to: 5 mm/s, over: 1 ms}}}}\n"
  "output:\n"
  "  history: {every: 10 us, quantities: [reaction(zmax), reaction(zmin), displacement(zmax), displacement(zmin), gauge, quality]}\n"
  "  fields: {every: 1 ms, names: [displacement, stress, damage]}\n"
  "  plots:\n"
  "    - {x: displacement(zmax).z, y: reaction(zmax).z, xscale: 1000, yscale: 0.001, xlabel: \"end [mm]\", ylabel: \"force [kN]\", file: force-displacement.png}\n";

const char AppNewBending[] =
  "# Three-point bending of a plain beam of particles; its geometry is bending.geo, written beside this file.\n"
  "title: Three-point bending\n"
  "dimension: 2\n"
  "plane: stress\n"
  "thickness: 20 mm\n"
  "time: {end: 8 ms}\n"
  ROCK
  "bodies:\n"
  "  beam:\n"
  "    geometry: bending.geo\n"
  "    length_unit: 1 mm\n"
  "    method: dem\n"
  "    material: rock\n"
  "    dem:\n"
  "      packing: {radius: 1 mm, spread: 0.2, seed: 1}\n"
  "conditions:\n"
  "  - {group: left support, fix: y}\n"
  "  - {group: right support, fix: y}\n"
  "  - {group: load, velocity: {y: {ramp: {to: -10 mm/s, over: 2 ms}}}}\n"
  "output:\n"
  "  history: {every: 20 us, quantities: [reaction(load), displacement(load), reaction(left support), quality]}\n"
  "  fields: {every: 2 ms, names: [displacement, stress, damage]}\n"
  "  plots:\n"
  "    - {x: displacement(load).y, y: reaction(load).y, xscale: -1000, yscale: -0.001, xlabel: \"deflection [mm]\", ylabel: \"force [kN]\", file: force-deflection.png}\n";

const char AppNewBendingGeo[] =
  "// A beam 100 x 20 mm on two short bearings 80 mm apart, loaded through a third in the middle of its top. Millimetres.\n"
  "L = 100; H = 20; S = 80; b = 2;   // length, depth, span, width of a bearing\n"
  "h = 5;                            // of the cells that describe the shape; particles have their own size\n"
  "Point(1) = {0, 0, 0, h};\n"
  "Point(2) = {L/2 - S/2 - b/2, 0, 0, h};\n"
  "Point(3) = {L/2 - S/2 + b/2, 0, 0, h};\n"
  "Point(4) = {L/2 + S/2 - b/2, 0, 0, h};\n"
  "Point(5) = {L/2 + S/2 + b/2, 0, 0, h};\n"
  "Point(6) = {L, 0, 0, h};\n"
  "Point(7) = {L, H, 0, h};\n"
  "Point(8) = {L/2 + b/2, H, 0, h};\n"
  "Point(9) = {L/2 - b/2, H, 0, h};\n"
  "Point(10) = {0, H, 0, h};\n"
  "For i In {1:9}\n"
  "  Line(i) = {i, i + 1};\n"
  "EndFor\n"
  "Line(10) = {10, 1};\n"
  "Curve Loop(1) = {1:10};\n"
  "Plane Surface(1) = {1};\n"
  "Physical Surface(\"beam\") = {1};\n"
  "Physical Curve(\"left support\") = {2};\n"
  "Physical Curve(\"right support\") = {4};\n"
  "Physical Curve(\"load\") = {8};\n";
