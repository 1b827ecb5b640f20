"""Particles on one, two and four ranks: a bar that tears, from a mesh, in groups; the same with contacts; grains on a floor. The same files; on from a checkpoint with another number of ranks.

ranks.py CLEAVE
"""
import csv
import glob
import json
import os
import shutil
import subprocess
import sys
import tempfile

import h5py
import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from small import HALVES

CLEAVE = sys.argv[1]
os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")  # four ranks may have one core
SCENE = """\
title: a bar that tears
dimension: 2
plane: stress
thickness: 10 mm
time: {end: 0.12 ms}
materials:
  rock: {density: 2500 kg/m3, young: 30 GPa, poisson: 0.2, law: cohesive, tensile_strength: 4 MPa, fracture_energy: 20 J/m2, shear_strength: 12 MPa, fracture_energy_shear: 200 J/m2, mu_dynamic: 0.3, local_damping: 0.3}
bodies:
  bar:
    geometry: bar.geo
    length_unit: 1 mm
    group: bar
    method: dem
    material: rock
    dem: {packing: {radius: 0.55 mm, spread: 0.2, seed: 3}}
conditions:
  - {group: a, velocity: {x: {ramp: {to: -1 m/s, over: 0.02 ms}}, y: 0 m/s}}
  - {group: b, velocity: {x: {ramp: {to: 1 m/s, over: 0.02 ms}}, y: 0 m/s}}
output:
  history: {every: 2 us, quantities: [reaction(a), reaction(b), displacement(b), gauge, quality]}
  fields: {every: 30 us, names: [displacement, velocity, rotation, orientation, stress, strain, damage, coordination, criterion, fragment, bonds]}
"""

GRAINS = """\
title: grains that fall on a floor
dimension: 2
thickness: 10 mm
time: {end: 30 ms}
materials:
  glass: {density: 2500 kg/m3, young: 0.1 MPa, poisson: 0.2}
bodies:
  grains: {geometry: {box: {size: [120 mm, 80 mm]}}, method: dem, material: glass, dem: {packing: {radius: 1 mm, spread: 0.2, seed: 5, porosity: 0.5}, bonded: false}}
tools:
  floor: {plane: {point: [0 mm, -0.5 mm], normal: [0, 1]}, restitution: 0.3}
conditions:
  - {gravity: [0 m/s2, -9.81 m/s2]}
contact: {law: linear, friction: 0.4, restitution: 0.3}
output:
  history: {every: 1 ms, quantities: [energies, force(floor)]}
  fields: {every: 10 ms, names: [displacement, velocity, rotation]}
"""


def fail(*what):
    print(*what)
    sys.exit(1)


def run(folder, ranks, output, *words, expect=0, scene="bar.yaml"):
    """One run; with one rank mpiexec stays out of it."""
    start = ["mpiexec", "--oversubscribe", "-n", str(ranks)] if ranks > 1 else []
    done = subprocess.run(start + [CLEAVE, "run", scene, "--threads", "1", "--no-plots", "--output", output, *words], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=600)
    if done.returncode != expect:
        fail(output, "ended with", done.returncode, done.stdout[-3000:])
    return done.stdout


def history(folder, output):
    with open(os.path.join(folder, output, "history.csv"), newline="") as file:
        rows = list(csv.reader(file))
    return rows[0], numpy.array([[float(x) for x in row] for row in rows[1:]])


def same(folder, one, other, arrays=60):
    """Files of particles, bonds and cracks to the last bit, sums to rounding."""
    names, a = history(folder, one)
    _, b = history(folder, other)
    if a.shape != b.shape:
        fail("history of", other, "has", b.shape, "not", a.shape)
    for column, name in enumerate(names):
        scale = abs(a[:, column]).max()
        tolerance = 1e-9 if name.startswith("ledger_error") else 1e-10 * scale
        if abs(a[:, column] - b[:, column]).max() > tolerance:
            fail(name, "of", other, "differs by", abs(a[:, column] - b[:, column]).max(), "of", scale)
    if os.path.exists(os.path.join(folder, one, "cracks.csv")):
        file = "cracks.csv"
        with open(os.path.join(folder, one, file)) as p, open(os.path.join(folder, other, file)) as q:
            if p.read() != q.read():
                fail(file, "of", other, "differs")
    frames = sorted(glob.glob(os.path.join(folder, one, "fields", "*.h5")))
    if len(frames) < 3 or len(frames) != len(glob.glob(os.path.join(folder, other, "fields", "*.h5"))):
        fail("frames of", one, "and", other)
    compared = 0
    for frame in frames:
        with h5py.File(frame, "r") as p, h5py.File(frame.replace(os.sep + one + os.sep, os.sep + other + os.sep), "r") as q:
            found = []
            p.visititems(lambda name, node: found.append(name) if isinstance(node, h5py.Dataset) else None)
            for name in found:
                compared += 1
                x, y = p[name][()], q[name][()]
                if name.endswith("tool_force"):  # a sum over the ranks
                    if abs(x - y).max() > 1e-10 * abs(x).max():
                        fail(name, "in", frame, "differs in", other, abs(x - y).max())
                    continue
                if x.shape != y.shape or x.tobytes() != y.tobytes():
                    fail(name, "in", frame, "differs in", other)
    if compared < arrays:
        fail("only", compared, "arrays")


def main():
    folder = tempfile.mkdtemp(prefix="cleave-ranks-")
    try:
        with open(os.path.join(folder, "bar.geo"), "w") as file:
            file.write(HALVES)
        with open(os.path.join(folder, "bar.yaml"), "w") as file:
            file.write(SCENE)
        run(folder, 1, "one")
        run(folder, 2, "two")
        run(folder, 4, "four")
        with open(os.path.join(folder, "one", "cracks.csv")) as file:
            broken = sum(float(row["broken[-]"]) > 0.99 for row in csv.DictReader(file))
        if broken < 20:
            fail("only", broken, "facets broken")
        with open(os.path.join(folder, "two", "summary.json")) as file:
            if json.load(file)["plan"]["ranks"] != 2:
                fail("not two ranks")
        same(folder, "one", "two")
        same(folder, "one", "four")
        for first, then in ((2, 1), (1, 2), (2, 4)):
            output = "from%dto%d" % (first, then)
            run(folder, first, output, "--stop-after", "150")
            run(folder, then, output, "--resume")
            same(folder, "one", output)
        if "too few for 3 ranks" not in run(folder, 3, "few", "--set", "bodies.bar.dem.packing.radius=1.2 mm", expect=2):
            fail("too many ranks are not told")
        with open(os.path.join(folder, "bar.yaml"), "a") as file:
            file.write("contact: {law: linear}\n")
        with open(os.path.join(folder, "grains.yaml"), "w") as file:
            file.write(GRAINS)
        for scene in ("bar", "grains"):
            meet = lambda ranks, output, *words: run(folder, ranks, scene + output, *words, scene=scene + ".yaml")
            meet(1, "one")
            meet(2, "two", "--stop-after", "300")
            meet(3, "two", "--resume")
            meet(2, "on", "--stop-after", "200")
            meet(1, "on", "--resume")
            same(folder, scene + "one", scene + "two", arrays=60 if scene == "bar" else 15)
            same(folder, scene + "one", scene + "on", arrays=60 if scene == "bar" else 15)
            counts = [json.load(open(os.path.join(folder, scene + output, "summary.json")))["counts"] for output in ("one", "two", "on")]
            if not all(c["contact_pairs"] == counts[0]["contact_pairs"] > 50 and c["contacts_touching"] == counts[0]["contacts_touching"] for c in counts):
                fail("counts of contacts", scene, counts)
        # grains that flow out of a box on one side: the ranks that lose theirs are given others
        flow = GRAINS.replace("[0 m/s2, -9.81 m/s2]", "[-40 m/s2, -9.81 m/s2]").replace("restitution: 0.3}\noutput", "restitution: 0.3, domain: box, low: [0 mm, -5 mm], high: [200 mm, 200 mm]}\noutput").replace("end: 30 ms", "end: 60 ms, rebalance: 40")
        with open(os.path.join(folder, "flow.yaml"), "w") as file:
            file.write(flow)
        for ranks, output in ((1, "one"), (2, "two")):
            run(folder, ranks, "flow" + output, scene="flow.yaml")
        run(folder, 3, "flowon", "--stop-after", "700", scene="flow.yaml")
        run(folder, 2, "flowon", "--resume", scene="flow.yaml")
        for output in ("two", "on"):
            same(folder, "flowone", "flow" + output, arrays=15)
        with open(os.path.join(folder, "flowtwo", "summary.json")) as file:
            sharing = json.load(file)["sharing"]
        if sharing["looks"] < 10 or not 0 < sharing["shared_out_anew"] < sharing["looks"] / 2 or sharing["busiest_over_mean_after"] > 0.95 * sharing["busiest_over_mean_before"]:
            fail("sharing", sharing)
        rain = GRAINS.replace("bonded: false", "bonded: false, rain: {rate: 60 kHz, until: 20 ms}").replace(", porosity: 0.5", "").replace("energies, force", "energies, grains, force")
        with open(os.path.join(folder, "rain.yaml"), "w") as file:
            file.write(rain)
        run(folder, 1, "rainone", scene="rain.yaml")
        run(folder, 2, "raintwo", "--stop-after", "300", scene="rain.yaml")
        run(folder, 3, "raintwo", "--resume", scene="rain.yaml")
        same(folder, "rainone", "raintwo", arrays=15)
        clump = GRAINS.replace("dimension: 2\nthickness: 10 mm", "dimension: 3").replace("size: [120 mm, 80 mm]", "size: [120 mm, 80 mm, 80 mm]").replace("bonded: false", "bonded: false, clump: {spheres: [{at: [0 mm, 0 mm, 0 mm], radius: 1 mm}, {at: [1 mm, 0 mm, 0 mm], radius: 1 mm}]}")
        with open(os.path.join(folder, "grains.yaml"), "w") as file:
            file.write(clump.replace("[0 mm, -0.5 mm]", "[0 mm, -0.5 mm, 0 mm]").replace("[0, 1]", "[0, 1, 0]").replace("[0 m/s2, -9.81 m/s2]", "[0 m/s2, -9.81 m/s2, 0 m/s2]"))
        if "clump: particles of this kind run on one rank for now" not in run(folder, 2, "clump", scene="grains.yaml", expect=2):
            fail("clumps on ranks are not refused in their place")
        print("ranks passed:", broken, "facets broken")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
