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

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from small import COUPLED
from small import COUPLED_GEO as GEO

CLEAVE = sys.argv[1]
os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")  # four ranks may have one core

WAVE = (COUPLED.replace("a bar of elements with a middle of particles", "a wave goes through a middle of particles").replace("end: 40 us", "end: 24 us").replace("radius: 0.4 mm", "radius: 0.35 mm")
        .replace("substeps: 1}", "substeps: 2}").replace("over: 20 us", "over: 4 us").replace("every: 20 us, names: [displacement, stress]", "every: 8 us, names: [displacement, velocity, stress]"))
TURN = (WAVE.replace("a wave goes through a middle of particles", "elements turn while the bar breaks")
        .replace("poisson: 0.2}", "poisson: 0.2, law: cohesive, tensile_strength: 4 MPa, fracture_energy: 20 J/m2, shear_strength: 12 MPa, fracture_energy_shear: 200 J/m2, mu_dynamic: 0.3}")
        .replace("substeps: 2}", "substeps: 1, switch: {when: rankine, at: 0.5}}").replace("to: 1 MPa, over: 4 us", "to: 6 MPa, over: 20 us").replace("displacement, velocity, stress", "displacement, stress, damage"))

SHORT = WAVE.replace("end: 24 us", "end: 10 us").replace("every: 8 us", "every: 5 us")
WAYS = {"absorber": SHORT.replace("substeps: 2}", "substeps: 1, absorber: true}"),
        "consistent": SHORT.replace("substeps: 2}", "substeps: 1, method: consistent}"),
        "penalty": SHORT.replace("substeps: 2}", "substeps: 1, method: penalty}"),
        "insitu": SHORT.replace("substeps: 2}", "substeps: 1}").replace("    material: rock\n", "    material: rock\n    initial_stress: {xx: -0.5 MPa, yy: -0.3 MPa}\n")}

# load steps come to rest by a drag that sums over particles set: to rounding
STATIC = (WAVE.replace("end: 24 us", "end: 1 s, method: static, steps: 2").replace("substeps: 2", "far_field: static, tolerance: 0.0001").replace("over: 4 us", "over: 1 s")
          .replace("every: 2 us", "every: 0.5 s").replace("every: 8 us", "every: 0.5 s"))


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


def near(folder, one, other):
    """Histories and frames to rounding."""
    names = table(folder, one, "history.csv")[0]
    a, b = [numpy.array(table(folder, output, "history.csv")[1:], dtype=float) for output in (one, other)]
    if a.shape != b.shape:
        fail("history of", other, "has", b.shape, "not", a.shape)
    energy = max(abs(a[:, column]).max() for column, name in enumerate(names) if "energy" in name)
    for column, name in enumerate(names):
        scale = energy if "energy" in name else 1 if name.startswith(("ledger_error", "unbalanced")) else abs(a[:, column]).max()
        if abs(a[:, column] - b[:, column]).max() > 1e-9 * scale:
            fail(name, "of", other, "differs by", abs(a[:, column] - b[:, column]).max(), "of", scale)
    frames = sorted(glob.glob(os.path.join(folder, one, "fields", "*.h5")))
    for frame in frames:
        with h5py.File(frame, "r") as p, h5py.File(frame.replace(os.sep + one + os.sep, os.sep + other + os.sep), "r") as q:
            found = []
            p.visititems(lambda name, node: found.append(name) if isinstance(node, h5py.Dataset) and node.dtype.kind == "f" else None)
            for name in found:
                x, y = p[name][()], q[name][()]
                if x.shape != y.shape or abs(x - y).max() > 1e-9 * abs(x).max():
                    fail(name, "in", frame, "differs in", other, abs(x - y).max(), abs(x).max())
    if len(frames) < 3:
        fail("only", len(frames), "frames of", one)


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
        for way, scene in WAYS.items():
            with open(os.path.join(folder, way + ".yaml"), "w") as file:
                file.write(scene)
            run(folder, way + ".yaml", 1, way + "1")
            run(folder, way + ".yaml", 2, way + "2", "--stop-after", "60")
            run(folder, way + ".yaml", 3, way + "2", "--resume")
            same(folder, way + "1", way + "2")
        with open(os.path.join(folder, "static.yaml"), "w") as file:
            file.write(STATIC)
        run(folder, "static.yaml", 1, "static1")
        run(folder, "static.yaml", 2, "static2", "--stop-after", "1")
        run(folder, "static.yaml", 3, "static2", "--resume")
        near(folder, "static1", "static2")
        print("coupled ranks passed:", events, "events,", broken, "facets cracked")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
