"""Every shipped scene near its critical step, long runs that must not drift, what the watch costs, and examples run twice."""
import csv
import glob
import os
import re
import shutil
import subprocess

from common import Wrong, fresh, go, lay_out, one, results, run, same, summary, words
from scenes import BAR_GEO, BREAKING, COUPLED, FEM
from uneasy import STACK

SOURCE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../..")
SECONDS = {"s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}

# What `cleave new` writes and the scenes of examples/ whose time is stepped explicitly, made coarser so that a run takes seconds: name -> what to set.
NEW = {"ucs": {"bodies.sample.dem.packing.radius": "5 mm"}, "triaxial": {"bodies.sample.dem.packing.radius": "5 mm"}, "hydrostatic": {"bodies.sample.dem.packing.radius": "5 mm"},
       "compaction": {"bodies.sample.dem.packing.radius": "5 mm"}, "brazilian": {"bodies.sample.dem.packing.radius": "1.6 mm"}, "direct-tension": {"bodies.bar.dem.packing.radius": "4 mm"},
       "bending": {"bodies.beam.dem.packing.radius": "1.5 mm"}, "wave": {}}
EXAMPLES = {"wave_in_a_bar/scene": {}, "elastic_cylinder/scene": {"bodies.sample.dem.packing.radius": "5 mm"}, "angle_of_repose/scene": {"bodies.grains.dem.packing.radius": "4 mm"},
            "hourglass/scene": {"bodies.grains.dem.packing.radius": "4 mm"}, "rotating_drum/scene": {"bodies.grains.dem.packing.radius": "3 mm"}, "notched_beam/scene": {"bodies.beam.dem.packing.radius": "0.7 mm"},
            "notched_beam/particles": {"bodies.beam.dem.packing.radius": "1.5 mm"}, "notched_beam/adaptive": {"bodies.beam.dem.packing.radius": "0.8 mm"}, "notched_beam/scene3d": {},
            "rock_cutting/scene": {"bodies.block.dem.packing.radius": "0.8 mm", "tools.pick.velocity.x": "5 m/s"},
            "rock_cutting/particles": {"bodies.block.dem.packing.radius": "1.5 mm", "tools.pick.velocity.x": "5 m/s"},  # slower, the pick would not be there yet
            "rock_cutting/adaptive": {"bodies.block.dem.packing.radius": "0.8 mm", "tools.pick.velocity.x": "5 m/s"}, "rock_cutting/scene3d": {"bodies.block.dem.packing.radius": "1.5 mm", "tools.pick.velocity.x": "3 m/s"},
            "rock_cutting/disc": {"bodies.block.dem.packing.radius": "0.8 mm"}, "rock_cutting/disc3d": {"bodies.block.dem.packing.radius": "1.5 mm"},
            "overlap/cantilever": {"bodies.beam.dem.packing.radius": "0.8 mm"}, "overlap/impact": {}, "overlap/plate": {}, "overlap/spall": {}, "overlap/wave": {}}
# Where the critical step is a bound a longer one may run on. An overlap takes sqrt(3)/2 of what its sides would. Grains that only collide have no mode that lives on
# from step to step: for them it is that of a lasting contact; a body that is cut counts the contacts its bonds may become. Published laws hold a bound for pairs broken and turned (4.72).
BOUND_ONLY = {"new compaction", "angle_of_repose/scene", "hourglass/scene", "rotating_drum/scene", "notched_beam/scene", "notched_beam/adaptive", "notched_beam/scene3d", "rock_cutting/scene", "rock_cutting/particles",
              "rock_cutting/scene3d", "rock_cutting/disc", "rock_cutting/disc3d", "rock_cutting/adaptive", "overlap/cantilever", "overlap/impact", "overlap/plate", "overlap/spall", "overlap/wave"}
FEWER = {"notched_beam/scene3d": 100}  # steps of a scene that cannot be made coarser: its overlap wants three particles and more to the side of an element
BEYOND_STEPS = 5000  # within which a step beyond the critical one is caught


def shipped(cleave, folder):
    """(name, folder, file, settings) of every scene."""
    for kind, sets in NEW.items():
        here = os.path.join(folder, kind)
        os.makedirs(here, exist_ok=True)
        if not os.path.exists(os.path.join(here, "scene.yaml")):
            code, said = run([cleave, "new", kind, "scene.yaml"], here)
            if code:
                raise Wrong(said)
        yield "new " + kind, here, "scene.yaml", sets
    for name, sets in EXAMPLES.items():
        example, file = name.split("/")
        here = os.path.join(folder, example)
        shutil.copytree(os.path.join(SOURCE, "examples", example), here, dirs_exist_ok=True)
        yield name, here, file + ".yaml", sets


def near_critical(cleave, name, here, file, sets, count):
    """A row: 0.5, 0.8, 0.95 of the critical step with a ledger error < 1 %; 1.05 and 1.1 of it, asked for by time.beyond_critical, stopped."""
    code, said = go(cleave, here, "out", sets, "--stop-after", "1", scene=file)
    found = re.search(r"critical +([0-9.e+-]+) (s|ms|us|ns)", said)
    if code or not found:
        raise Wrong("%s has no plan: %s" % (name, said))
    critical = float(found.group(1)) * SECONDS[found.group(2)]
    cells = [name, "%.4g" % critical]
    for factor in (0.5, 0.8, 0.95):
        code, said = go(cleave, here, "out", sets, "--quiet", "--set", "time.step=%.9g s" % (factor * critical), "--stop-after", str(count), scene=file)
        error = summary(here)["energy"]["worst_error"] if not code else None
        if code or not error < 0.01:
            raise Wrong("%s at %g of its critical step: exit %d, ledger error %s: %s" % (name, factor, code, error, said))
        cells.append("%.1e" % error)
    for factor in (1.05, 1.1):
        beyond = BEYOND_STEPS if name not in BOUND_ONLY else 2 * count
        code, said = go(cleave, here, "out", sets, "--quiet", "--set", "time.step=%.9g s" % (factor * critical), "--set", "time.beyond_critical=true", "--stop-after", str(beyond), scene=file)
        at = re.search(r"[Aa]t step (\d+)", said)
        if code == 0 and name in BOUND_ONLY:
            cells.append("runs on, %.1e" % summary(here)["energy"]["worst_error"])
        elif code == 2 and "After elements turned into particles" in said:
            cells.append("refused as elements turn")
        elif code != 1 or not at:
            raise Wrong("%s at %g of its critical step is not stopped: exit %d %s" % (name, factor, code, said))
        else:
            cells.append("step %s" % at.group(1))
    return cells


def steps(cleave, folder, count=1000, done=(), keep=None):
    rows, bad = [], []
    for name, here, file, sets in shipped(cleave, folder):
        if name in done:
            continue
        try:
            rows.append(near_critical(cleave, name, here, file, sets, FEWER.get(name, count)))
        except Wrong as wrong:  # the others are worth knowing
            bad.append(str(wrong))
            print("BAD", wrong, flush=True)
            continue
        print(*rows[-1], sep="  ", flush=True)
        if keep:
            keep(rows[-1])
    if bad:
        raise Wrong("; ".join(bad))
    return rows


SPIN = """\
title: a bonded block, set spinning, then left alone
dimension: 2
plane: stress
thickness: 10 mm
time: {end: 1 s}
materials: {rock: {density: 2500 kg/m3, young: 30 MPa, poisson: 0.2}}
bodies:
  block:
    geometry: {box: {size: [20 mm, 20 mm]}}
    method: dem
    material: rock
    dem: {packing: {radius: 2 mm, spread: 0.2, seed: 1}}
conditions:
  - {group: xmin, traction: {y: {table: [[0 ms, 0 Pa], [1 ms, 1000 Pa], [2 ms, 0 Pa]]}}}
  - {group: xmax, traction: {y: {table: [[0 ms, 0 Pa], [1 ms, -1000 Pa], [2 ms, 0 Pa]]}}}
output: {history: {every: 1 ms, quantities: [energies]}}
"""

CLOSED = COUPLED.replace("    law: cohesive\n", "").replace("    local_damping: 0.3\n", "")
for key in ("tensile_strength", "fracture_energy", "shear_strength", "fracture_energy_shear", "mu_static", "mu_dynamic"):
    CLOSED = re.sub(r"    %s: [^\n]*\n" % key, "", CLOSED)
CLOSED = CLOSED.replace("{group: right, velocity: {x: {ramp: {to: 0.15 m/s, over: 40 us}}, y: 0 m/s}}", "{group: right, traction: {x: {table: [[0 us, 0 MPa], [5 us, 1 MPa], [10 us, 0 MPa]]}}}").replace("radius: 0.5 mm", "radius: 0.7 mm")
CLOSED = CLOSED.replace("reaction(left), displacement(right), energies", "energies").replace("every: 4 us", "every: 1 ms").replace("every: 50 us", "every: 1 s").replace("every: 10 us", "every: 1 s")


def columns(here, output="out"):
    with open(os.path.join(here, output, "history.csv")) as file:
        rows = list(csv.reader(file))
    return {name: [float(row[k]) for row in rows[1:]] for k, name in enumerate(rows[0])}


def stored(here):
    """Kinetic, strain, coupling and contact energy, row by row."""
    found = columns(here)
    return [sum(row) for row in zip(*(found["energy.%s[J]" % part] for part in ("kinetic", "strain", "coupling", "contact")))], found


def tenth(values, k):
    return values[k * len(values) // 10 : (k + 1) * len(values) // 10]


DRIFTS = (("bonded block, spinning", SPIN, {}, {}, 1e-3), ("resting stack of grains", STACK, {}, {}, 1e-3), ("wave in a closed bar with an overlap", CLOSED, {"bar_geo": BAR_GEO}, {"coupling.substeps": "1"}, 1e-6),
          ("the same wave, three sub-steps", CLOSED, {"bar_geo": BAR_GEO}, {"coupling.substeps": "3"}, 1e-2), ("the same, half the step", CLOSED, {"bar_geo": BAR_GEO}, {"coupling.substeps": "3", "time.safety": "0.45"}, 2.5e-3))


def drift(cleave, folder, count=1000000, done=(), keep=None):
    """Many steps: mean stored energy of the last tenth against that of the second, and the energy's balance all along.

    Impulses of sub-steps keep an energy that lies O(step^2) beside the true one: the balance swings, but its mean stays. Its bound (last column of DRIFTS) is
    section 0's 1 % there, and a quarter of it at half the step.
    """
    rows = []
    for name, text, files, sets, bound in DRIFTS:
        if name in done:
            continue
        here = lay_out(os.path.join(folder, name.replace(" ", "-")), one(text, "", **files))
        code, said = go(cleave, here, "out", {"output.checkpoint.every": "100 s", "output.fields.every": "100 s", "time.end": "100 s", "output.history.every": "1 ms", **sets}, "--quiet", "--stop-after", str(count))
        if code:
            raise Wrong("%s: exit %d %s" % (name, code, said))
        total, found = stored(here)
        early, late, error = tenth(total, 1), tenth(total, 9), max(found["ledger_error[-]"])
        early, swing, late = sum(early) / len(early), max(total[len(total) // 10:]) - min(total[len(total) // 10:]), sum(late) / len(late)
        change = late / early - 1 if early > 1e-20 else 0
        if not error < bound or not abs(change) < 1e-4:
            raise Wrong("%s: ledger error %g, change of the mean stored energy %g" % (name, error, change))
        rows.append([name, summary(here)["run"]["steps"], "%.1e" % error, "%.1e" % (swing / early if early > 1e-20 else 0), "%+.1e" % change])
        print(*rows[-1], sep="  ", flush=True)
        if keep:
            keep(rows[-1])
    return rows


def overhead(cleave, folder, done=(), keep=None):
    """Instructions in the watch over those of the whole loop, by valgrind's callgrind: inclusive counts of the functions themselves."""
    rows = []
    for name, scene, count in (("elements", one(FEM.replace("{size: 2 mm", "{size: 0.5 mm"), ""), 2000), ("particles, breaking", one(BREAKING, ""), 2000)):
        if name in done:
            continue
        here = lay_out(os.path.join(folder, name.split(",")[0]), scene)
        sets = {"output.checkpoint.every": "1 s", "output.fields.every": "1 s", "output.history.every": "1 s", "time.end": "1 s"}
        out = os.path.join(here, "callgrind.out")
        code, said = run(["valgrind", "--tool=callgrind", "--callgrind-out-file=" + out, "--toggle-collect=RunLoop", cleave, "run", "scene.yaml", "--no-plots", "--quiet", "--threads", "1", "--output", "out", "--stop-after", str(count), *words(sets)], here,
                         timeout=3000, env=dict(os.environ, GOMP_SPINCOUNT="20000"))
        if code:
            raise Wrong("%s under callgrind: %d %s" % (name, code, said[-2000:]))
        text = subprocess.run(["callgrind_annotate", "--inclusive=yes", "--threshold=100", out], stdout=subprocess.PIPE, text=True).stdout
        total = int(re.search(r"([\d,]+) \(100\.0%\) +PROGRAM TOTALS", text).group(1).replace(",", ""))
        watch = [int(n.replace(",", "")) for n in re.findall(r"^ *([\d,]+) \([^\n]*?:(?:FemWatch|DemWatch_Internal)\b", text, re.M)]
        state = [int(n.replace(",", "")) for n in re.findall(r"^ *([\d,]+) \([^\n]*?:CheckState", text, re.M)]
        share, all_share = sum(watch) / total, (sum(watch) + max(state or [0])) / total
        if not watch or not share < 0.01:
            raise Wrong("%s: the watch takes %.2f %% of the loop's instructions" % (name, 100 * share))
        rows.append([name, count, total, sum(watch), "%.3f %%" % (100 * share), "%.3f %%" % (100 * all_share)])
        print(*rows[-1], sep="  ", flush=True)
        if keep:
            keep(rows[-1])
    return rows


def twice(cleave, folder, count=300, done=(), keep=None):
    """Every example's scenes, coarse, their first steps (or load steps), twice: the same bits."""
    rows = []
    for scene in sorted(glob.glob(os.path.join(SOURCE, "examples/*/*.yaml"))):
        name = os.path.relpath(scene, os.path.join(SOURCE, "examples"))
        if name in done:
            continue
        example = name.split("/")[0]
        here = os.path.join(folder, example)
        shutil.copytree(os.path.dirname(scene), here, dirs_exist_ok=True)
        found = []
        for output in ("one", "two"):
            code, said = go(cleave, here, output, EXAMPLES.get(name[: -len(".yaml")], {}), "--quiet", "--stop-after", str(count), scene=os.path.basename(scene), threads=2)
            if code:
                raise Wrong("%s: exit %d %s" % (name, code, said))
            found.append(results(os.path.join(here, output)))
        other = same(*found)
        if other or not found[0]:
            raise Wrong("%s run twice differs in %s" % (name, other[:6]))
        rows.append([name, len(found[0])])
        print(*rows[-1], sep="  ", flush=True)
        if keep:
            keep(rows[-1])
    return rows
