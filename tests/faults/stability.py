"""Every shipped scene near its critical step, long runs that must not drift, what the watch costs, and examples run twice."""
import csv
import glob
import json
import os
import re
import shutil
import subprocess

from common import Wrong, fresh, lay_out, results, run, same
from scenes import BAR_GEO, BREAKING, COUPLED, FEM, SWITCH, one

SOURCE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../..")
SECONDS = {"s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}

# Shipped scenes whose time is stepped explicitly, made coarser so that a run takes seconds: name -> (what to set, is 5 % too much surely unstable?).
# Grains that only collide have no mode that lives on from step to step: for them the critical step is that of a lasting contact.
# An overlap takes sqrt(3)/2 of what its sides would, as a bound.
NEW = {"ucs": {"bodies.sample.dem.packing.radius": "5 mm"}, "triaxial": {"bodies.sample.dem.packing.radius": "5 mm"}, "hydrostatic": {"bodies.sample.dem.packing.radius": "5 mm"},
       "compaction": {"bodies.sample.dem.packing.radius": "5 mm"}, "brazilian": {"bodies.sample.dem.packing.radius": "1.6 mm"}, "direct-tension": {"bodies.bar.dem.packing.radius": "4 mm"},
       "bending": {"bodies.beam.dem.packing.radius": "1.5 mm"}, "wave": {}}
EXAMPLES = {"wave_in_a_bar": {}, "elastic_cylinder": {"bodies.sample.dem.packing.radius": "5 mm"}, "angle_of_repose": {"bodies.grains.dem.packing.radius": "4 mm"}, "hourglass": {"bodies.grains.dem.packing.radius": "4 mm"},
            "rotating_drum": {"bodies.grains.dem.packing.radius": "3 mm"}, "notched_beam": {"bodies.beam.dem.packing.radius": "0.7 mm"}}
BOUND_ONLY = {"angle_of_repose", "hourglass", "rotating_drum", "notched_beam"}


def shipped(cleave, folder):
    """(name, folder, settings) of every scene."""
    for kind, sets in NEW.items():
        here = os.path.join(folder, kind)
        os.makedirs(here, exist_ok=True)
        if not os.path.exists(os.path.join(here, "scene.yaml")):
            code, said = run([cleave, "new", kind, "scene.yaml"], here)
            if code:
                raise Wrong(said)
        yield "new " + kind, here, sets
    for name, sets in EXAMPLES.items():
        here = os.path.join(folder, name)
        shutil.copytree(os.path.join(SOURCE, "examples", name), here, dirs_exist_ok=True)
        yield name, here, sets


def words(sets):
    return [word for key, value in sets.items() for word in ("--set", "%s=%s" % (key, value))]


def go(cleave, here, output, sets, *more):
    return run([cleave, "run", "scene.yaml", "--no-plots", "--threads", "1", "--output", fresh(os.path.join(here, output)), *words(sets), *more], here, timeout=3000)


def summary(here, output="out"):
    with open(os.path.join(here, output, "summary.json")) as file:
        return json.load(file)


def steps(cleave, folder, count=1000, only=None):
    """0.5, 0.8, 0.95 of the critical step: ledger error < 1 %; 1.05 and 1.1 of it, asked for by time.beyond_critical: stopped."""
    rows = []
    for name, here, sets in shipped(cleave, folder):
        if only and name not in only:
            continue
        code, said = go(cleave, here, "out", sets, "--stop-after", "1")
        found = re.search(r"critical +([0-9.e+-]+) (s|ms|us|ns)", said)
        if code or not found:
            raise Wrong("%s has no plan: %s" % (name, said))
        critical = float(found.group(1)) * SECONDS[found.group(2)]
        cells = [name, "%.4g" % critical]
        for factor in (0.5, 0.8, 0.95):
            code, said = go(cleave, here, "out", sets, "--quiet", "--set", "time.step=%.9g s" % (factor * critical), "--stop-after", str(count))
            error = summary(here)["energy"]["worst_error"] if not code else None
            if code or not error < 0.01:
                raise Wrong("%s at %g of its critical step: exit %d, ledger error %s: %s" % (name, factor, code, error, said))
            cells.append("%.1e" % error)
        for factor in (1.05, 1.1):
            code, said = go(cleave, here, "out", sets, "--quiet", "--set", "time.step=%.9g s" % (factor * critical), "--set", "time.beyond_critical=true", "--stop-after", "5000")
            at = re.search(r"[Aa]t step (\d+)", said)
            if code == 0 and name in BOUND_ONLY:
                cells.append("runs on, %.1e" % summary(here)["energy"]["worst_error"])
            elif code != 1 or not at:
                raise Wrong("%s at %g of its critical step is not stopped: exit %d %s" % (name, factor, code, said))
            else:
                cells.append("step %s" % at.group(1))
        print(*cells, sep="  ", flush=True)
        rows.append(cells)
    return {"about": "Every shipped scene with explicit steps (made coarser, `tests/faults/stability.py` says how), its first %d steps at a fraction of its critical step: worst ledger error, which must stay below 1 %%. Beyond it (`time.beyond_critical`) the step at "
                     "which the run is stopped. Where the critical step is a bound (an overlap; grains, whose contacts do not last) a longer one may run on; its ledger error then stands there." % count,
            "head": ["scene", "critical step [s]", "0.5", "0.8", "0.95", "1.05", "1.1"], "rows": rows}


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

GRAINS = "".join("%g %g %g 0.0005\n" % (0.022 + 0.0016 * i, 0.022 + 0.0016 * j, 0.012 + 0.0012 * k) for i in range(10) for j in range(10) for k in range(2)) + "0.03 0.03 0.03 0.01\n"


def odd_scenes():
    thin = BREAKING.replace("[40 mm, 20 mm]", "[40 mm, 2 mm]").replace("radius: 0.9 mm, spread: 0.2", "radius: 1 mm, spread: 0")
    elastic = re.sub(r"    (law|tensile_strength|fracture_energy|shear_strength|fracture_energy_shear|mu_static|mu_dynamic|local_damping): [^\n]*\n", "", BREAKING)
    slow = "{to: 0.1 m/s, over: 50 us}"
    at_once = SWITCH.replace("y: {ramp: {to: 0.4 m/s, over: 60 us}}", "y: 0 m/s").replace("{to: 0.05 m/s, over: 40 us}", "{to: 0.3 m/s, over: 40 us}")
    yield "Poisson's ratio 0, elements", FEM.replace("poisson: 0.3", "poisson: 0"), {}
    yield "Poisson's ratio 0.499, elements", FEM.replace("poisson: 0.3", "poisson: 0.499"), {}
    yield "Poisson's ratio 0, particles", elastic.replace("poisson: 0.2", "poisson: 0"), {}
    yield "Poisson's ratio 0.499, particles in plane strain", elastic.replace("poisson: 0.2", "poisson: 0.499").replace("plane: stress", "plane: strain"), {}
    yield "a sudden load", FEM.replace("{ramp: {to: -1 MPa, over: 300 us}}", "-1 MPa"), {}
    yield "a sudden motion of an end, undamped", elastic.replace("{ramp: %s}" % slow, "0.1 m/s"), {}
    yield "local damping 0.95", BREAKING.replace("local_damping: 0.3", "local_damping: 0.95"), {}
    yield "one particle wide, torn", thin, {}
    yield "torn at 20 times the speed", BREAKING.replace(slow, "{to: 2 m/s, over: 50 us}"), {}
    yield "an overlap of one element, a crack beside it", COUPLED, {"bar.geo": BAR_GEO}
    yield "all that may switch, at once", at_once, {"bar.geo": BAR_GEO}
    yield "radii 1 : 20", PILE, {"grains.csv": GRAINS}
    yield "radii 1 : 20, an impact at 20 m/s", PILE.replace("-1 m/s]", "-20 m/s]").replace("end: 40 ms", "end: 4 ms").replace("every: 1 ms", "every: 0.1 ms"), {"grains.csv": GRAINS}


def odd(cleave, folder, only=None):
    """Uneasy bodies and loads: each keeps its ledger to 1 % to its end."""
    rows, bad = [], []
    for number, (name, text, files) in enumerate(odd_scenes()):
        if only and name not in only:
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
    if bad:
        raise Wrong("; ".join(bad))
    return {"about": "Uneasy bodies and loads, run to their end: worst ledger error, below 1 %.", "head": ["run", "steps", "worst ledger error"], "rows": rows}


def columns(here, output="out"):
    with open(os.path.join(here, output, "history.csv")) as file:
        rows = list(csv.reader(file))
    return {name: [float(row[k]) for row in rows[1:]] for k, name in enumerate(rows[0])}


def drift(cleave, folder, count=1000000, only=None):
    """A million steps: energy and its balance at the end against their values at a tenth of it."""
    rows = []
    for name, text, files in (("bonded block, spinning", SPIN, {}), ("resting stack of grains", STACK, {}), ("wave in a closed bar with an overlap", CLOSED, {"bar_geo": BAR_GEO})):
        if only and name not in only:
            continue
        here = lay_out(os.path.join(folder, name.replace(" ", "-")), one(text, "", **files))
        code, said = go(cleave, here, "out", {"output.checkpoint.every": "1000 s", "output.fields.every": "1000 s", "time.end": "1000 s", "output.history.every": "5 ms"}, "--quiet", "--stop-after", str(count))
        if code:
            raise Wrong("%s: exit %d %s" % (name, code, said))
        found = columns(here)
        n = len(found["time[s]"])
        total = [sum(found["energy.%s[J]" % part][k] for part in ("kinetic", "strain", "coupling", "contact")) for k in range(n)]
        early, error = max(1, n // 10), max(found["ledger_error[-]"])
        change = total[-1] / total[early] - 1 if total[early] else 0
        kinetic = found["energy.kinetic[J]"]
        if not error < 1e-3:
            raise Wrong("%s: ledger error %g" % (name, error))
        rows.append([name, summary(here)["run"]["steps"], "%.1e" % error, "%+.1e" % change, "%.2e -> %.2e" % (kinetic[early], kinetic[-1])])
        print(*rows[-1], sep="  ", flush=True)
    return {"about": "%d steps. Worst ledger error; change of the stored energy (kinetic, strain, coupling, contact) between a tenth of the run and its end; kinetic energy then and there." % count,
            "head": ["run", "steps", "worst ledger error", "change of stored energy", "kinetic energy [J]"], "rows": rows}


def overhead(cleave, folder):
    """Instructions in the watch over those of the whole loop, by valgrind's callgrind: inclusive counts of the functions themselves."""
    rows = []
    for name, scene, count in (("elements", one(FEM.replace("{size: 2 mm", "{size: 0.5 mm"), ""), 2000), ("particles, breaking", one(BREAKING, ""), 2000)):
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
        if not share < 0.01:
            raise Wrong("%s: the watch takes %.2f %% of the loop's instructions" % (name, 100 * share))
        rows.append([name, count, total, sum(watch), "%.3f %%" % (100 * share), "%.3f %%" % (100 * all_share)])
        print(*rows[-1], sep="  ", flush=True)
    return {"about": "Instructions inside the models' watch (`FemWatch`, `DemWatch_Internal`) over all of the run loop, and with the ledger's check besides, counted by `valgrind --tool=callgrind --toggle-collect=RunLoop`.",
            "head": ["run", "steps", "instructions of the loop", "of the watch", "share", "with the ledger"], "rows": rows}


def twice(cleave, folder, count=300, only=None):
    """Every example's scenes, coarse, their first steps (or load steps), twice: the same bits."""
    rows = []
    for scene in sorted(glob.glob(os.path.join(SOURCE, "examples/*/*.yaml"))):
        name = os.path.relpath(scene, os.path.join(SOURCE, "examples"))
        if only and name not in only:
            continue
        example = name.split("/")[0]
        here = os.path.join(folder, example)
        shutil.copytree(os.path.dirname(scene), here, dirs_exist_ok=True)
        sets = words(EXAMPLES.get(example, {})) if name.endswith("/scene.yaml") else []
        found = []
        for output in ("one", "two"):
            code, said = run([cleave, "run", os.path.basename(scene), "--no-plots", "--quiet", "--threads", "2", "--output", fresh(os.path.join(here, output)), *sets, "--stop-after", str(count)], here, timeout=3000)
            if code:
                raise Wrong("%s: exit %d %s" % (name, code, said))
            found.append(results(os.path.join(here, output)))
        other = same(*found)
        if other:
            raise Wrong("%s run twice differs in %s" % (name, other[:6]))
        rows.append([name, len(found[0])])
        print(*rows[-1], sep="  ", flush=True)
    return {"about": "Every scene of `examples/`, coarse where `tests/faults/stability.py` says so, its first %d steps on two threads, twice: tables, every array of every frame and of the checkpoint, ParaView's files." % count,
            "head": ["scene", "arrays and files, the same bits"], "rows": rows}
