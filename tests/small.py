"""Small scenes that more than one driver runs, each a second or less. A driver gives them other times by replacing text."""

BEAM = """\
title: a small beam
dimension: 2
plane: stress
thickness: 10 mm
time: {end: 40 us}
materials:
  steel: {density: 7850 kg/m3, young: 210 GPa, poisson: 0.3}
bodies:
  beam:
    geometry: {box: {size: [40 mm, 10 mm]}}
    method: fem
    material: steel
    mesh: {size: 2 mm, cells: quad}
conditions:
  - {group: xmin, fix: all}
  - {group: xmax, traction: {y: -1 MPa}}
output:
  history: {every: 2 us, quantities: [reaction(xmin), displacement(xmax)]}
  fields: {every: 20 us, names: [displacement, stress]}
"""

BLOCK = """\
title: a small block
time: {end: 60 us}
materials:
  rock: {density: 2500 kg/m3, young: 30 GPa, poisson: 0.2, local_damping: 0.1}
bodies:
  block:
    geometry: {box: {size: [40 mm, 40 mm, 60 mm]}}
    method: dem
    material: rock
    dem: {packing: {radius: 4 mm, spread: 0.2, seed: 1}}
conditions:
  - {group: zmin, fix: z}
  - {group: zmax, velocity: {z: {ramp: {to: -10 mm/s, over: 20 us}}}}
output:
  history: {every: 5 us, quantities: [reaction(zmax), displacement(zmax)]}
  fields: {every: 20 us, names: [displacement]}
"""

TOOLS = """\
title: grains, a free brick, a driven platen and a driven roller
time: {end: 30 ms, step: 20 us}
materials: {glass: {density: 2500 kg/m3, young: 10 MPa, poisson: 0.25}}
bodies: {grains: {geometry: {box: {size: [0.1 m, 0.1 m, 0.06 m]}}, method: dem, material: glass, dem: {packing: {radius: 8 mm, seed: 3}, bonded: false}}}
tools:
  floor: {surface: {file: floor.stl, length_unit: 1 mm}, friction: 0.4, restitution: 0.7}
  walls: {box: {low: [0 m, 0 m, -0.1 m], size: [0.1 m, 0.1 m, 0.4 m]}, restitution: 0.8}
  brick: {box: {low: [30 mm, 30 mm, 80 mm], size: [40 mm, 30 mm, 20 mm]}, free: {density: 800 kg/m3, velocity: [0 m/s, 0 m/s, -1 m/s], spin: [3 rad/s, 0 rad/s, 1 rad/s]}, friction: 0.2}
  platen: {disc: {centre: [50 mm, 50 mm, 64 mm], normal: [0, 0, 1], radius: 45 mm}, push: {axis: [0, 0, -1], force: 20 N, mass: 0.4 kg}, rotation: {axis: [0, 0, 1], speed: 5 rad/s}}
  roller: {cylinder: {centre: [50 mm, 50 mm, 72 mm], axis: [0, 1, 0], radius: 10 mm, length: 60 mm}, twist: {axis: [0, 1, 0], torque: 0.01 N m, inertia: 0.0001 kg m2}, friction: 0.5, law: hertz}
conditions: [{gravity: [0 m/s2, 0 m/s2, -9.81 m/s2]}]
output:
  history: {every: 1 ms, quantities: [force(floor), torque(roller), work(platen), displacement(platen), displacement(brick), reaction(walls)]}
  fields: {every: 10 ms, names: [displacement]}
"""

FLOOR = "solid floor\n" + "".join("facet normal 0 0 1\nouter loop\nvertex %s\nvertex %s\nvertex %s\nendloop\nendfacet\n" % corners for corners in
                                  [("-10 -10 4", "110 -10 4", "50 50 -16"), ("110 -10 4", "110 110 4", "50 50 -16"), ("110 110 4", "-10 110 4", "50 50 -16"), ("-10 110 4", "-10 -10 4", "50 50 -16")]) + "endsolid floor\n"

RAIN = """\
title: grains that come one by one
time: {end: 0.2 s}
materials: {glass: {density: 2500 kg/m3, young: 0.5 MPa, poisson: 0.25}}
bodies:
  grains:
    geometry: {box: {low: [0 mm, 0 mm, 40 mm], size: [20 mm, 20 mm, 10 mm]}}
    method: dem
    material: glass
    dem: {packing: {radius: 2 mm, spread: 0.1, seed: 4}, bonded: false, rain: {rate: 300 1/s, until: 0.3 s}}
    initial_velocity: [0 m/s, 0 m/s, -0.5 m/s]
conditions:
  - {gravity: [0 m/s2, 0 m/s2, -9.81 m/s2]}
contact: {restitution: 0.8, friction: 0.5, domain: box, low: [-1 mm, -1 mm, -1 mm], high: [18 mm, 21 mm, 60 mm]}
tools:
  floor: {plane: {point: [0 mm, 0 mm, 0 mm], normal: [0, 0, 1]}, restitution: 0.8, friction: 0.5}
  left: {plane: {point: [0 mm, 0 mm, 0 mm], normal: [1, 0, 0]}, restitution: 0.8}
  front: {plane: {point: [0 mm, 0 mm, 0 mm], normal: [0, 1, 0]}, restitution: 0.8}
  back: {plane: {point: [0 mm, 20 mm, 0 mm], normal: [0, -1, 0]}, restitution: 0.8}
output:
  history: {every: 10 ms, quantities: [grains, energies]}
  fields: {every: 100 ms, names: [displacement, orientation, velocity]}
"""

# 60 x 20 mm in two halves, which may be groups of one body
HALVES = """\
Point(1) = {0, 0, 0, 8}; Point(2) = {30, 0, 0, 8}; Point(3) = {60, 0, 0, 8};
Point(4) = {60, 20, 0, 8}; Point(5) = {30, 20, 0, 8}; Point(6) = {0, 20, 0, 8};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 1}; Line(7) = {2, 5};
Curve Loop(1) = {1, 7, 5, 6}; Plane Surface(1) = {1};
Curve Loop(2) = {2, 3, 4, -7}; Plane Surface(2) = {2};
Physical Surface("bar") = {1, 2};
Physical Surface("left") = {1};
Physical Surface("right") = {2};
Physical Curve("a") = {6};
Physical Curve("b") = {3};
"""

# a coupled bar, particles in the middle third
COUPLED_GEO = """SetFactory("Built-in");
Point(1) = {0, 0, 0};   Point(2) = {20, 0, 0};  Point(3) = {40, 0, 0};  Point(4) = {60, 0, 0};
Point(5) = {60, 10, 0}; Point(6) = {40, 10, 0}; Point(7) = {20, 10, 0}; Point(8) = {0, 10, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 8}; Line(8) = {8, 1};
Line(9) = {2, 7}; Line(10) = {3, 6};
Curve Loop(1) = {1, 9, 7, 8};    Plane Surface(1) = {1};
Curve Loop(2) = {2, 10, 6, -9};  Plane Surface(2) = {2};
Curve Loop(3) = {3, 4, 5, -10};  Plane Surface(3) = {3};
Transfinite Curve {4, 8, 9, 10} = 5; Transfinite Curve {1, 3, 5, 7} = 9; Transfinite Curve {2, 6} = 9;
Transfinite Surface {1, 2, 3}; Recombine Surface {1, 2, 3};
Physical Surface("arms") = {1, 3}; Physical Surface("middle") = {2};
Physical Curve("left") = {8}; Physical Curve("waist") = {2}; Physical Curve("right") = {4};
"""

COUPLED = """\
title: a bar of elements with a middle of particles
dimension: 2
plane: strain
thickness: 10 mm
time: {end: 40 us}
materials:
  rock: {density: 2500 kg/m3, young: 20 GPa, poisson: 0.2}
bodies:
  bar:
    geometry: bar.geo
    length_unit: 1 mm
    method: coupled
    material: rock
    dem: {group: middle, packing: {radius: 0.4 mm, spread: 0.2, seed: 1}}
coupling: {width: 2 elements, substeps: 1}
conditions:
  - {group: left, fix: [x, y]}
  - {group: right, traction: {x: {ramp: {to: 1 MPa, over: 20 us}}}}
output:
  history: {every: 2 us, quantities: [reaction(left), displacement(right), energies]}
  fields: {every: 20 us, names: [displacement, stress]}
"""
