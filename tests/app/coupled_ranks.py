"""A coupled body on one, two and four ranks: a wave through the overlap, and elements that turn while a crack runs. The same files; on from a checkpoint with another number of ranks.

coupled_ranks.py CLEAVE
"""
import csv
import glob
import os
import shutil
import subprocess
import sys
import tempfile

import h5py
import numpy

CLEAVE = sys.argv[1]
os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")  # four ranks may have one core

GEO = """SetFactory("Built-in");
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
Physical Curve("left") = {8}; Physical Curve("right") = {4};
"""

WAVE = """\
title: a wave goes through a middle of particles
dimension: 2
plane: strain
thickness: 10 mm
time: {end: 24 us}
materials:
  rock: {density: 2500 kg/m3, young: 20 GPa, poisson: 0.2}
bodies:
  bar:
    geometry: bar.geo
    length_unit: 1 mm
    method: coupled
    material: rock
    dem: {group: middle, packing: {radius: 0.35 mm, spread: 0.2, seed: 1}}
coupling: {width: 2 elements, substeps: 2}
conditions:
  - {group: left, fix: [x, y]}
  - {group: right, traction: {x: {ramp: {to: 1 MPa, over: 4 us}}}}
output:
  history: {every: 2 us, quantities: [reaction(left), displacement(right), energies]}
  fields: {every: 8 us, names: [displacement, velocity, stress]}
"""
TURN = (WAVE.replace("a wave goes through a middle of particles", "elements turn while the bar breaks")
        .replace("poisson: 0.2}", "poisson: 0.2, law: cohesive, tensile_strength: 4 MPa, fracture_energy: 20 J/m2, shear_strength: 12 MPa, fracture_energy_shear: 200 J/m2, mu_dynamic: 0.3}")
        .replace("substeps: 2}", "substeps: 1, switch: {when: rankine, at: 0.5}}").replace("to: 1 MPa, over: 4 us", "to: 6 MPa, over: 20 us").replace("displacement, velocity, stress", "displacement, stress, damage"))


def fail(*what):
    print(*what)
    sys.exit(1)


def run(folder, scene, ranks, output, *words, expect=0):
    start = ["mpiexec", "--oversubscribe", "-n", str(ranks)] if ranks > 1 else []
    done = subprocess.run(start + [CLEAVE, "run", scene, "--threads", "1", "--no-plots", "--output", output, *words], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=900)
    if done.returncode != expect:
        fail(output, "ended with", done.returncode, done.stdout[-3000:])
    return done.stdout


def table(folder, output, file):
    with open(os.path.join(folder, output, file), newline="") as lines:
        return list(csv.reader(lines))


def same(folder, one, other):
    """Files of both sides and cracks to the last bit, sums over particles to rounding."""
    a, b = table(folder, one, "history.csv"), table(folder, other, "history.csv")
    names, a, b = a[0], numpy.array(a[1:], dtype=float), numpy.array(b[1:], dtype=float)
    if a.shape != b.shape:
        fail("history of", other, "has", b.shape, "not", a.shape)
    energy = max(abs(a[:, column]).max() for column, name in enumerate(names) if "energy" in name)
    for column, name in enumerate(names):
        scale = energy if "energy" in name else abs(a[:, column]).max()
        if abs(a[:, column] - b[:, column]).max() > (1e-9 if name.startswith("ledger_error") else 1e-11 * scale):
            fail(name, "of", other, "differs by", abs(a[:, column] - b[:, column]).max(), "of", scale)
    if os.path.exists(os.path.join(folder, one, "switches.csv")):
        for p, q in zip(table(folder, one, "switches.csv"), table(folder, other, "switches.csv"), strict=True):  # sums and wall times follow
            if p[:6] != q[:6]:
                fail("an event of", other, "is another:", p[:6], q[:6])
    if os.path.exists(os.path.join(folder, one, "cracks.csv")) and table(folder, one, "cracks.csv") != table(folder, other, "cracks.csv"):
        fail("cracks.csv of", other, "differs")
    frames, arrays = sorted(glob.glob(os.path.join(folder, one, "fields", "*.h5"))), 0
    if len(frames) < 3 or len(frames) != len(glob.glob(os.path.join(folder, other, "fields", "*.h5"))):
        fail("frames of", one, "and", other)
    for frame in frames:
        with h5py.File(frame, "r") as p, h5py.File(frame.replace(os.sep + one + os.sep, os.sep + other + os.sep), "r") as q:
            found = []
            p.visititems(lambda name, node: found.append(name) if isinstance(node, h5py.Dataset) else None)
            for name in found:
                arrays += 1
                if p[name].shape != q[name].shape or p[name][()].tobytes() != q[name][()].tobytes():
                    fail(name, "in", frame, "differs in", other)
    if arrays < 20:
        fail("only", arrays, "arrays")


def main():
    folder = tempfile.mkdtemp(prefix="cleave-coupled-ranks-")
    try:
        for name, text in (("bar.geo", GEO), ("wave.yaml", WAVE), ("turn.yaml", TURN)):
            with open(os.path.join(folder, name), "w") as file:
                file.write(text)
        for ranks in (1, 2, 4):
            run(folder, "wave.yaml", ranks, "wave%d" % ranks)
            run(folder, "turn.yaml", ranks, "turn%d" % ranks)
        events = len(table(folder, "turn1", "switches.csv")) - 1
        broken = sum(float(row[-1] if row[-1] else 0) >= 0 for row in table(folder, "turn1", "cracks.csv")[1:])
        if events < 2 or broken < 50:
            fail("only", events, "events and", broken, "facets in cracks.csv")
        for ranks in (2, 4):
            same(folder, "wave1", "wave%d" % ranks)
            same(folder, "turn1", "turn%d" % ranks)
        for first, then in ((2, 4), (4, 1), (1, 2)):  # the first event is behind, others to come
            output = "from%dto%d" % (first, then)
            run(folder, "turn.yaml", first, output, "--stop-after", "150")
            if len(table(folder, output, "switches.csv")) < 2:
                fail("no event before the stop")
            run(folder, "turn.yaml", then, output, "--resume")
            same(folder, "turn1", output)
        with open(os.path.join(folder, "turn.yaml"), "w") as file:
            file.write(WAVE.replace("substeps: 2}", "substeps: 1, absorber: true}"))
        if "run on one rank" not in run(folder, "turn.yaml", 2, "absorber", expect=2):
            fail("an absorber on ranks is not refused")
        print("coupled ranks passed:", events, "events,", broken, "facets cracked")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
