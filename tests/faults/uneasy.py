"""Bodies, packings and loads that sit badly: each run keeps its energy balance to 1 % to its end. A far bystander changes no bit. How results scatter with mesh and seed."""
import csv
import os
import re
import statistics

import h5py
import numpy

from common import Wrong, go, lay_out, one, summary
from scenes import BAR_GEO, BREAKING, COUPLED, FEM, SWITCH

PILE = """\
title: grains of very different radii fall on each other
time: {end: 40 ms}
materials: {glass: {density: 2500 kg/m3, young: 5 MPa, poisson: 0.25}}
bodies: {grains: {geometry: {box: {size: [60 mm, 60 mm, 60 mm]}}, method: dem, material: glass, dem: {packing: {file: grains.csv}, bonded: false}, initial_velocity: [0 m/s, 0 m/s, -1 m/s]}}
contact: {restitution: 0.5, friction: 0.5}
tools: {walls: {box: {low: [0 mm, 0 mm, 0 mm], size: [60 mm, 60 mm, 60 mm]}, restitution: 0.5, friction: 0.5}}
conditions: [{gravity: [0 m/s2, 0 m/s2, -9.81 m/s2]}]
output: {history: {every: 1 ms, quantities: [energies]}}
"""

STACK = """\
title: grains at rest in a box
time: {end: 1 s}
materials: {glass: {density: 2500 kg/m3, young: 1 MPa, poisson: 0.25}}
bodies: {grains: {geometry: {box: {size: [20 mm, 20 mm, 30 mm]}}, method: dem, material: glass, dem: {packing: {radius: 3 mm, spread: 0.1, seed: 3, porosity: 0.65}, bonded: false}}}
contact: {restitution: 0.3, friction: 0.5, initial_overlaps: push}
tools: {walls: {box: {low: [0 mm, 0 mm, 0 mm], size: [20 mm, 20 mm, 60 mm]}, restitution: 0.3, friction: 0.5}}
conditions: [{gravity: [0 m/s2, 0 m/s2, -9.81 m/s2]}]
output: {history: {every: 10 ms, quantities: [energies]}}
"""

BLOCK = """\
title: a block of particles drawn apart
time: {end: 200 us}
materials:
  rock: {density: 2500 kg/m3, young: 30 GPa, poisson: 0.2, law: cohesive, tensile_strength: 3 MPa, fracture_energy: 20 J/m2, shear_strength: 6 MPa, fracture_energy_shear: 60 J/m2, mu_static: 0.6, mu_dynamic: 0.4, local_damping: 0.3}
bodies:
  block:
    geometry: {box: {size: [10 mm, 10 mm, 10 mm]}}
    method: dem
    material: rock
    dem: {packing: {file: grains.csv}}
conditions:
  - {group: zmin, velocity: {x: 0 m/s, y: 0 m/s, z: 0 m/s}}
  - {group: zmax, velocity: {x: 0 m/s, y: 0 m/s, z: {ramp: {to: 0.05 m/s, over: 40 us}}}}
output: {history: {every: 5 us, quantities: [reaction(zmax), energies]}}
"""

# Particles in a notch of the elements: the overlap runs up one side, around two corners and down the other; a crack from below crosses it.
CORNER_GEO = """\
h = 3;
Point(1) = {0, 0, 0, h}; Point(2) = {72, 0, 0, h}; Point(3) = {72, 24, 0, h}; Point(4) = {0, 24, 0, h};
Point(5) = {24, 0, 0, h}; Point(6) = {48, 0, 0, h}; Point(7) = {48, 12, 0, h}; Point(8) = {24, 12, 0, h};
Line(1) = {1, 5}; Line(2) = {5, 6}; Line(3) = {6, 2}; Line(4) = {2, 3}; Line(5) = {3, 4}; Line(6) = {4, 1}; Line(7) = {6, 7}; Line(8) = {7, 8}; Line(9) = {8, 5};
Curve Loop(1) = {2, 7, 8, 9}; Plane Surface(1) = {1};
Curve Loop(2) = {1, -9, -8, -7, 3, 4, 5, 6}; Plane Surface(2) = {2};
Physical Surface("arms") = {2};
Physical Surface("middle") = {1};
Physical Curve("left") = {6};
Physical Curve("right") = {4};
"""

TEAR = "{to: 0.1 m/s, over: 50 us}"
PULL = "{to: 0.15 m/s, over: 40 us}"
ELASTIC = re.sub(r"    (law|tensile_strength|fracture_energy|shear_strength|fracture_energy_shear|mu_static|mu_dynamic|local_damping): [^\n]*\n", "", BREAKING)


def spheres(rows):
    return "".join("%.17g %.17g %.17g %.17g\n" % row for row in rows)


def square(n, m, h):
    """Discs of diameter h on a square lattice: four cells meet in every corner."""
    return [(h * (i + 0.5), h * (j + 0.5), 0, h / 2) for i in range(n) for j in range(m)]


def two_materials():
    """Arms of steel, a middle of one ten-thousandth of its stiffness."""
    text = FEM.replace("    geometry: {box: {size: [40 mm, 10 mm]}}\n", "    geometry: bar.geo\n    length_unit: 1 mm\n    group: arms\n").replace("    mesh: {size: 2 mm, cells: quad}\n", "")
    begin, end = text.index("  beam:"), text.index("conditions:")
    text = text[:end] + text[begin:end].replace("beam", "soft").replace("group: arms", "group: middle").replace("material: steel", "material: jelly") + text[end:]
    text = text.replace("bodies:", "  jelly: {density: 7850 kg/m3, young: 21 MPa, poisson: 0.3}\nbodies:").replace("xmin", "left").replace("xmax", "right").replace("-1 MPa", "-10 kPa")
    return text.replace("400 us", "2 ms").replace("300 us", "1 ms").replace("every: 20 us", "every: 1 ms")


def shallow_cut():
    """examples/rock_cutting with block, pick and particles a tenth as large: stress that crushes, pieces slid off and pressed through each other."""
    here = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../examples/rock_cutting")
    texts = {}
    for name in ("scene.yaml", "block.geo", "pick.geo"):
        with open(os.path.join(here, name)) as file:
            texts[name] = file.read()
    scene = re.sub(r"end: [^}]*\}", "end: 520 us}", texts.pop("scene.yaml"), count=1)
    scene = re.sub(r"velocity: \{x:.*", "velocity: {x: {table: [[0 us, 0 m/s], [20 us, 2 m/s]]}}", scene)
    return scene.replace("length_unit: 1 mm", "length_unit: 100 um").replace("radius: 0.5 mm", "radius: 50 um").replace("every: 10 us", "every: 1 us").replace("every: 0.5 ms", "every: 1 s"), texts


def scenes():
    """(name, scene, its files, in the default suite?)"""
    file = BREAKING.replace("{radius: 0.9 mm, spread: 0.2, seed: 1}", "{file: grains.csv}")
    lattice, cube = square(20, 10, 0.002), [(0.002 * (i + 0.5), 0.002 * (j + 0.5), 0.002 * (k + 0.5), 0.001) for i in range(5) for j in range(5) for k in range(5)]
    x, y, _, r = lattice[57]
    coupled = COUPLED.replace("radius: 0.5 mm", "radius: 0.6 mm")
    at_once = SWITCH.replace("y: {ramp: {to: 0.4 m/s, over: 60 us}}", "y: 0 m/s").replace("{to: 0.05 m/s, over: 40 us}", "{to: 0.3 m/s, over: 40 us}")
    small = "".join("%g %g %g 0.0005\n" % (0.022 + 0.0016 * i, 0.022 + 0.0016 * j, 0.012 + 0.0012 * k) for i in range(10) for j in range(10) for k in range(2))
    pile = {"grains.csv": small + "0.03 0.03 0.03 0.01\n"}
    yield "Poisson's ratio 0, elements", FEM.replace("poisson: 0.3", "poisson: 0"), {}, False
    yield "Poisson's ratio 0.499, elements", FEM.replace("poisson: 0.3", "poisson: 0.499"), {}, False
    yield "Poisson's ratio 0, particles", ELASTIC.replace("poisson: 0.2", "poisson: 0"), {}, False
    yield "Poisson's ratio 0.499, particles in plane strain", ELASTIC.replace("poisson: 0.2", "poisson: 0.499").replace("plane: stress", "plane: strain"), {}, False
    yield "stiffness 1 : 10,000 side by side, elements", two_materials(), {"bar.geo": BAR_GEO}, True
    yield "square lattice, every corner one of four cells, torn", file, {"grains.csv": spheres(lattice)}, True
    yield "cubic lattice, every edge one of four cells, torn", BLOCK, {"grains.csv": spheres(cube)}, True
    yield "two centres a 2,000th of a spacing apart: slivers", file, {"grains.csv": spheres(lattice + [(x + 1e-6, y, 0, r)])}, False
    yield "a radius of 1 : 100 among equal ones", file, {"grains.csv": spheres(lattice + [(x + 1e-3, y + 1e-3, 0, 1e-5)])}, False
    yield "one particle wide, torn", BREAKING.replace("[40 mm, 20 mm]", "[40 mm, 2 mm]").replace("radius: 0.9 mm, spread: 0.2", "radius: 1 mm, spread: 0"), {}, True
    yield "a sudden load", FEM.replace("{ramp: {to: -1 MPa, over: 300 us}}", "-1 MPa"), {}, False
    yield "a sudden motion of an end, undamped", ELASTIC.replace("{ramp: %s}" % TEAR, "0.1 m/s"), {}, False
    yield "mass damping, critical for the first mode of a beam", FEM.replace("density: 7850", "mass_damping: 65000 1/s, density: 7850"), {}, False
    yield "local damping 0.95", BREAKING.replace("local_damping: 0.3", "local_damping: 0.95"), {}, False
    yield "torn at 20 times the speed", BREAKING.replace(TEAR, "{to: 2 m/s, over: 50 us}"), {}, False
    yield "an overlap of one element, a crack beside it", COUPLED, {"bar.geo": BAR_GEO}, False
    yield "an overlap around corners", coupled.replace("ramp: " + PULL, "ramp: {to: 0.01 m/s, over: 40 us}"), {"bar.geo": CORNER_GEO}, False
    yield CROSSING, coupled.replace(PULL, "{to: 0.1 m/s, over: 40 us}").replace("end: 200 us", "end: 300 us"), {"bar.geo": CORNER_GEO}, True
    yield "a cut half a millimetre deep, what it crushes driven through what is broken", *shallow_cut(), False
    yield "all that may switch, at once", at_once, {"bar.geo": BAR_GEO}, True
    yield "radii 1 : 20", PILE, pile, False
    yield "radii 1 : 20, an impact at 20 m/s, contacts of critical damping", PILE.replace("-1 m/s]", "-20 m/s]").replace("end: 40 ms", "end: 4 ms").replace("every: 1 ms", "every: 0.1 ms").replace("restitution: 0.5", "restitution: 0"), pile, False


CROSSING = "a crack that crosses the overlap"


def crosses(here):
    """Facets all but broken through (damage above 0.9) within the overlap above the particles, y from 9 to 12 mm."""
    with open(os.path.join(here, "out", "cracks.csv")) as file:
        broken = sum(float(row["damage[-]"]) > 0.9 and float(row["y[m]"]) > 0.009 for row in csv.DictReader(file))
    if not broken:
        raise Wrong("no facet within the overlap is broken: the crack does not cross it")


def odd(cleave, folder, quick=False, done=(), keep=None):
    """Each to its end with a ledger error below 1 %. done: names left out; keep(row): called after each."""
    rows, bad = [], []
    for number, (name, text, files, soon) in enumerate(scenes()):
        if name in done or quick and not soon:
            continue
        here = lay_out(os.path.join(folder, str(number)), {"files": {"scene.yaml": text, **files}})
        code, said = go(cleave, here, "out", {}, "--quiet")
        if code:
            bad.append("%s: exit %d %s" % (name, code, said))
            print("BAD", bad[-1], flush=True)
            continue
        rows.append([name, summary(here)["run"]["steps"], "%.1e" % summary(here)["energy"]["worst_error"]])
        print(*rows[-1], sep="  ", flush=True)
        if not summary(here)["energy"]["worst_error"] < 0.01:
            bad.append("%s: ledger error %s" % (name, rows[-1][2]))
        if name == CROSSING:
            crosses(here)
        if keep and not bad:
            keep(rows[-1])
    if bad:
        raise Wrong("; ".join(bad))
    return rows


def state(here):
    with h5py.File(os.path.join(here, "out", "checkpoint.h5"), "r") as file:
        return {name: file["dem/" + name][()] for name in ("displacement", "velocity", "rotation", "spin", "force", "contact_first", "contact_second", "contact_history")}


def bystander(cleave, folder, steps=20000):
    """Grains at rest on each other, alone and with one more far away that falls (it takes 118,000 steps to reach them): every bit of theirs is the same."""
    dice = numpy.random.default_rng(4)
    grains = [(0.0034 + 0.0066 * i + dice.uniform(-2e-4, 2e-4), 0.0034 + 0.0066 * j + dice.uniform(-2e-4, 2e-4), 0.0034 + 0.0066 * k, 0.003 * dice.uniform(0.95, 1)) for k in range(4) for j in range(3) for i in range(3)]
    text = STACK.replace("[20 mm, 20 mm, 30 mm]", "[20 mm, 20 mm, 2 m]").replace("packing: {radius: 3 mm, spread: 0.1, seed: 3, porosity: 0.65}", "packing: {file: grains.csv}").replace("end: 1 s", "end: 100 s, step: 5 us").replace("20 mm, 60 mm]", "20 mm, 4 m]")
    found = []
    for extra in ([], [(0.01, 0.01, 1.9, 0.0025)]):
        here = lay_out(os.path.join(folder, "with" if extra else "without"), {"files": {"scene.yaml": text.replace("every: 10 ms", "every: 1 s"), "grains.csv": spheres(grains + extra)}})
        code, said = go(cleave, here, "out", {"output.checkpoint.every": "100 s", "output.fields.every": "100 s"}, "--quiet", "--stop-after", str(steps))
        if code:
            raise Wrong("grains with a bystander: exit %d %s" % (code, said))
        found.append(state(here))
    n, (alone, beside) = len(grains), found
    if not len(alone["contact_first"]) > n:
        raise Wrong("the grains do not lie on each other: %d contacts" % len(alone["contact_first"]))
    for name in alone:
        a, b = alone[name].ravel(), beside[name].ravel()
        if a.size != b.size:  # components of n and of n + 1 grains
            a, b = a.reshape(-1, n), b.reshape(-1, n + 1)[:, :n]
        if a.tobytes() != b.tobytes():
            raise Wrong("a far bystander changes %s of grains at rest" % name)
    speed = abs(alone["velocity"]).max()
    print("bystander: %d steps, %d contacts, fastest %.1e m/s, the same bits" % (steps, len(alone["contact_first"]), speed), flush=True)
    return [["grains at rest, a far bystander added", steps, "the same bits", "%d contacts" % len(alone["contact_first"]), "fastest %.1e m/s" % speed]]


def largest(here, name):
    with open(os.path.join(here, "out", "history.csv"), newline="") as file:
        rows = list(csv.reader(file))
    at = next(k for k, word in enumerate(rows[0]) if word.startswith(name))
    return max(abs(float(row[at])) for row in rows[1:])


def scatter(cleave, folder, done=(), keep=None):
    """The same body on other meshes and packings: a figure's mean, standard deviation and range."""
    torn, bar, rows = BREAKING.replace("seed: 1", "seed: %d"), COUPLED.replace("radius: 0.5 mm", "radius: 0.6 mm"), []
    still = ELASTIC.replace("{ramp: %s}" % TEAR, "{ramp: {to: 0.02 m/s, over: 150 us}}").replace("seed: 1", "seed: %d")
    meshes = [("quad", size) for size in ("2 mm", "1.4 mm", "1 mm")] + [("tri", size) for size in ("1.4 mm", "1 mm")]
    families = (
        ("largest reaction of a plate torn apart, particles", "8 seeds", "reaction(xmax).x", [(torn % seed, {}) for seed in range(1, 9)]),
        ("largest reaction of the plate, elastic, particles", "8 seeds", "reaction(xmax).x", [(still % seed, {}) for seed in range(1, 9)]),
        ("largest reaction of a bar torn in its overlap's middle", "3 seeds x 2 meshes", "reaction(left).x", [(bar.replace("seed: 1", "seed: %d" % seed), {"bar.geo": BAR_GEO.replace("h = 3", "h = " + h)}) for h in ("3", "4") for seed in (1, 2, 3)]),
        ("largest deflection of a beam, elements", "5 meshes", "displacement(xmax).y", [(FEM.replace("{size: 2 mm, cells: quad}", "{size: %s, cells: %s}" % (size, cells)), {}) for cells, size in meshes]),
    )
    for number, (name, what, column, runs) in enumerate(families):
        if name in done:
            continue
        values = []
        for k, (text, files) in enumerate(runs):
            here = lay_out(os.path.join(folder, "%d-%d" % (number, k)), one(text, "", **{key.replace(".", "_"): data for key, data in files.items()}))
            code, said = go(cleave, here, "out", {}, "--quiet")
            if code:
                raise Wrong("%s, run %d: exit %d %s" % (name, k, code, said))
            values.append(largest(here, column))
        mean = statistics.mean(values)
        rows.append([name, what, "%.4g" % mean, "%.2g %%" % (100 * statistics.stdev(values) / mean), "%.4g .. %.4g" % (min(values), max(values))])
        print(*rows[-1], sep="  ", flush=True)
        if keep:
            keep(rows[-1])
    return rows
