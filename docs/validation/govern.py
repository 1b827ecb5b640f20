"""A governed load (time.govern) beside constant rates: bars torn apart, plain and with two notches; steps against the error of peak and energy.

/usr/bin/python3 docs/validation/govern.py CLEAVE [DIRECTORY]     some minutes on one core; writes govern.csv

Errors are against a constant rate of 2000 crossings of a wave through the bar. Every run is the same whatever the machine.
"""
import csv
import os
import subprocess
import sys
import tempfile

CLEAVE = os.path.abspath(sys.argv[1])
WHERE = sys.argv[2] if len(sys.argv) > 2 else os.path.dirname(os.path.abspath(__file__))
OPENS, CROSSING = 0.12e-3, 15.3e-6  # [m] of the platens at last, [s] of a wave through 60 mm
NOTCHED = """SetFactory("Built-in");
Point(1) = {0, 0, 0}; Point(2) = {29.5, 0, 0}; Point(3) = {30, 5, 0}; Point(4) = {30.5, 0, 0}; Point(5) = {60, 0, 0};
Point(6) = {60, 20, 0}; Point(7) = {30.5, 20, 0}; Point(8) = {30, 15, 0}; Point(9) = {29.5, 20, 0}; Point(10) = {0, 20, 0};
For k In {1:9}
  Line(k) = {k, k + 1};
EndFor
Line(10) = {10, 1};
Curve Loop(1) = {1:10};
Plane Surface(1) = {1};
Physical Curve("left") = {10};
Physical Curve("right") = {5};
Physical Surface("bar") = {1};
"""
SCENE = """title: a bar that tears
dimension: 2
plane: stress
thickness: 1 m
time: {end: %(T)s s%(govern)s}
materials:
  concrete: {density: 2400 kg/m3, young: 37 GPa, poisson: 0.2, law: cohesive, tensile_strength: 3.9 MPa, fracture_energy: 143 J/m2, shear_strength: 12 MPa, fracture_energy_shear: 1430 J/m2, mu_static: 0.9, mu_dynamic: 0.3, local_damping: 0.5}
bodies:
  b:
    geometry: %(geometry)s
    method: dem
    material: concrete
    dem: {packing: {radius: 1 mm, spread: 0.2, seed: 1}}
conditions:
  - {group: %(left)s, velocity: {x: {ramp: {to: -%(v)s m/s, over: %(rise)s s}}}}
  - {group: %(right)s, velocity: {x: {ramp: {to: %(v)s m/s, over: %(rise)s s}}}}
output:
  history: {every: %(row)s s, quantities: [reaction(%(right)s), energies]}
"""


def run(shape, crossings, govern=None):
    """steps, peak [N], energy that fracture took [J]"""
    T = crossings * CROSSING
    words = {"T": T, "v": OPENS / 2 / (T - 0.025 * T), "rise": 0.05 * T, "row": T / 2000, "govern": ", govern: " + govern if govern is not None else ""}
    words.update({"geometry": "{box: {size: [60 mm, 20 mm]}}", "left": "xmin", "right": "xmax"} if shape == "bar" else {"geometry": "notched.geo\n    length_unit: 1 mm", "left": "left", "right": "right"})
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "notched.geo"), "w") as file:
            file.write(NOTCHED)
        with open(os.path.join(folder, "scene.yaml"), "w") as file:
            file.write(SCENE % words)
        subprocess.run([CLEAVE, "run", "scene.yaml", "--output", "out", "--quiet", "--no-plots", "--threads", "1"], cwd=folder, check=True)
        with open(os.path.join(folder, "out", "history.csv")) as file:
            rows = list(csv.reader(file))
    column = {name.split("[")[0]: k for k, name in enumerate(rows[0])}
    return int(rows[-1][column["step"]]), max(float(row[column["reaction(%s).x" % words["right"]]]) for row in rows[1:]), float(rows[-1][column["energy.fracture"]])


out = open(os.path.join(WHERE, "govern.csv"), "w")
print("bar,load,steps,peak,energy", file=out)
for shape in ("bar", "notched"):
    reference = run(shape, 2000)
    print("%s,2000 crossings,%d,1,1" % (shape, reference[0]), file=out)
    for load in (1000, 500, 250, 125, "{}", "{breaking: 0.5}", "{loading: 1}"):
        steps, peak, energy = run(shape, 500, load) if isinstance(load, str) else run(shape, load)
        print('%s,"%s",%d,%.4f,%.4f' % (shape, load if isinstance(load, str) else "%d crossings" % load, steps, peak / reference[1], energy / reference[2]), file=out, flush=True)
