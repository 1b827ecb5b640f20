"""Small scenes over every method: a second or less each, with a state that is in the middle of something.

SCENES[name] = {"files": {file: text}, "about": what it is in the middle of}; every one has scene.yaml and saves often.
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from common import one
from small import BEAM, FLOOR, RAIN as DROPS, TOOLS as GRAINS

FEM = BEAM.replace("end: 40 us", "end: 400 us").replace("{y: -1 MPa}", "{y: {ramp: {to: -1 MPa, over: 300 us}}}").replace("every: 2 us", "every: 5 us").replace("every: 20 us", "every: 100 us")
FEM += "  checkpoint: {every: 20 us}\n"
STATIC = FEM.replace("end: 400 us", "end: 400 us, method: static, steps: 40")
IMPLICIT = FEM.replace("end: 400 us", "end: 400 us, method: implicit, step: 2 us, rho_inf: 0.7, preload: static").replace("  - {group: xmax", "  - {group: ymax, absorb: true}\n  - {group: xmax")
PRELOAD = FEM.replace("end: 400 us", "end: 400 us, preload: static").replace("{ramp: {to: -1 MPa, over: 300 us}}", "{table: [[0 us, -1 MPa], [10 us, 0 MPa]]}")
COROTATED = FEM.replace("{group: xmin, fix: all}", "{gravity: [0 m/s2, -9.81 m/s2]}").replace("cells: quad", "cells: quad, rotation: corotational")

ROCK = """\
    density: 2500 kg/m3
    young: 30 GPa
    poisson: 0.2
    law: cohesive
    tensile_strength: 3 MPa
    fracture_energy: 20 J/m2
    shear_strength: 6 MPa
    fracture_energy_shear: 60 J/m2
    mu_static: 0.6
    mu_dynamic: 0.4
    local_damping: 0.3
"""

BREAKING = """\
title: a plate torn apart
dimension: 2
plane: stress
thickness: 10 mm
time: {end: 300 us}
materials:
  rock:
%s
bodies:
  plate:
    geometry: {box: {size: [40 mm, 20 mm]}}
    method: dem
    material: rock
    dem: {packing: {radius: 0.9 mm, spread: 0.2, seed: 1}}
conditions:
  - {group: xmin, velocity: {x: 0 m/s, y: 0 m/s}}
  - {group: xmax, velocity: {x: {ramp: {to: 0.1 m/s, over: 50 us}}, y: 0 m/s}}
output:
  history: {every: 5 us, quantities: [reaction(xmax), displacement(xmax), quality]}
  fields: {every: 60 us, names: [displacement, stress, damage]}
  checkpoint: {every: 15 us}
""" % ROCK

CONFINED = """\
title: a core under pressure, pressed until it breaks
time: {end: 400 us}
materials:
  rock:
%s
bodies:
  core:
    geometry: {cylinder: {radius: 10 mm, height: 30 mm}}
    method: dem
    material: rock
    dem: {packing: {radius: 2 mm, spread: 0.2, seed: 2}}
conditions:
  - {group: side, pressure: {ramp: {to: 0.3 MPa, over: 200 us}}}
  - {group: bottom, fix: z}
  - {group: top, velocity: {z: {ramp: {to: -300 mm/s, over: 100 us}}}}
output:
  history: {every: 5 us, quantities: [reaction(top), gauge]}
  fields: {every: 100 us, names: [displacement, stress, damage]}
  checkpoint: {every: 20 us}
""" % (ROCK + "    criterion: nonlocal\n")

PUBLISHED = """\
title: the published law, its springs damaged and yielding
time: {end: 300 us}
materials:
  rock: {density: 2500 kg/m3, young: 30 GPa, poisson: 0.2, elasticity: kdem, law: published, tensile_strength: 3 MPa, delta_n: 0.2, shear_strength: 20 MPa, delta_s: 0.2, mu_static: 0.6, mu_dynamic: 0.4,
         compression: {lcs1: 5 MPa, yrc1: 3, lcs2: 12 MPa, yrc2: 12, lcs3: 20 MPa, yrc3: 22}, local_damping: 0.3}
bodies:
  block:
    geometry: {box: {size: [20 mm, 20 mm, 30 mm]}}
    method: dem
    material: rock
    dem: {packing: {radius: 2 mm, spread: 0.2, seed: 1}}
conditions:
  - {group: zmin, fix: z}
  - {group: zmax, velocity: {z: {table: [[0 us, 0 m/s], [50 us, -0.2 m/s], [150 us, -0.2 m/s], [200 us, 0.3 m/s]]}}}
output:
  history: {every: 5 us, quantities: [reaction(zmax), displacement(zmax)]}
  fields: {every: 100 us, names: [displacement, damage]}
  checkpoint: {every: 20 us}
"""

TOOLS = GRAINS.replace("end: 30 ms", "end: 20 ms").replace("every: 1 ms", "every: 0.5 ms").replace("every: 10 ms", "every: 4 ms") + "  checkpoint: {every: 1 ms}\n"

RAIN = DROPS.replace("end: 0.2 s", "end: 0.15 s").replace("every: 10 ms", "every: 2 ms").replace("every: 100 ms", "every: 30 ms") + "  checkpoint: {every: 5 ms}\n"

# A bar of elements, with particles in its middle. "seed" is particles from the start, "middle" may turn.
BAR_GEO = """\
h = 3;
Point(1) = {0, 0, 0, h}; Point(2) = {24, 0, 0, h}; Point(3) = {33, 0, 0, h}; Point(4) = {39, 0, 0, h}; Point(5) = {48, 0, 0, h}; Point(6) = {72, 0, 0, h};
Point(7) = {72, 12, 0, h}; Point(8) = {48, 12, 0, h}; Point(9) = {39, 12, 0, h}; Point(10) = {33, 12, 0, h}; Point(11) = {24, 12, 0, h}; Point(12) = {0, 12, 0, h};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 7};
Line(7) = {7, 8}; Line(8) = {8, 9}; Line(9) = {9, 10}; Line(10) = {10, 11}; Line(11) = {11, 12}; Line(12) = {12, 1};
Line(13) = {2, 11}; Line(14) = {3, 10}; Line(15) = {4, 9}; Line(16) = {5, 8};
Curve Loop(1) = {1, 13, 11, 12};   Plane Surface(1) = {1};
Curve Loop(2) = {2, 14, 10, -13};  Plane Surface(2) = {2};
Curve Loop(3) = {3, 15, 9, -14};   Plane Surface(3) = {3};
Curve Loop(4) = {4, 16, 8, -15};   Plane Surface(4) = {4};
Curve Loop(5) = {5, 6, 7, -16};    Plane Surface(5) = {5};
Physical Surface("arms") = {1, 5};
Physical Surface("middle") = {2, 3, 4};
Physical Surface("seed") = {3};
Physical Curve("left") = {12};
Physical Curve("right") = {6};
"""

COUPLED = """\
title: a bar of elements with a breaking middle of particles
dimension: 2
plane: stress
thickness: 10 mm
time: {end: 200 us}
materials:
  rock:
%s
bodies:
  bar:
    geometry: bar.geo
    length_unit: 1 mm
    method: coupled
    material: rock
    dem: {group: middle, packing: {radius: 0.5 mm, spread: 0.2, seed: 1}}
coupling: {width: 1 element, substeps: auto}
conditions:
  - {group: left, fix: [x, y]}
  - {group: right, velocity: {x: {ramp: {to: 0.15 m/s, over: 40 us}}, y: 0 m/s}}
output:
  history: {every: 4 us, quantities: [reaction(left), displacement(right), energies]}
  fields: {every: 50 us, names: [displacement, stress, damage]}
  checkpoint: {every: 10 us}
""" % ROCK

SWITCH = COUPLED.replace("a breaking middle of particles", "elements that turn into particles one after another").replace("group: middle", "group: seed").replace("substeps: auto", "substeps: 1, switch: {when: rankine, at: 0.7, group: middle}")
SWITCH = SWITCH.replace("{group: right, velocity: {x: {ramp: {to: 0.15 m/s, over: 40 us}}, y: 0 m/s}}", "{group: right, velocity: {x: {ramp: {to: 0.05 m/s, over: 40 us}}, y: {ramp: {to: 0.4 m/s, over: 60 us}}}}")

SCENES = {
    "static": one(STATIC, "load steps of elements"),
    "explicit": one(FEM, "elements in motion, a load rising"),
    "implicit": one(IMPLICIT, "implicit steps after a static preload, an absorbing side"),
    "preload": one(PRELOAD, "explicit steps after a static preload"),
    "corotational": one(COROTATED, "a free body of elements that turn"),
    "breaking": one(BREAKING, "a plate of particles, mid-fracture"),
    "confined": one(CONFINED, "a core of particles, pressure rising, nonlocal criterion"),
    "published": one(PUBLISHED, "springs that damage and yield"),
    "tools": one(TOOLS, "contacts, tools moved and free", floor_stl=FLOOR),
    "rain": one(RAIN, "grains that come and go"),
    "coupled": one(COUPLED, "an overlap, sub-steps, mid-fracture", bar_geo=BAR_GEO),
    "switch": one(SWITCH, "elements turning into particles", bar_geo=BAR_GEO),
}
