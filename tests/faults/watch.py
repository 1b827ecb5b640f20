"""Runs that lose their state are stopped: exit 1, what, where, when and the last good checkpoint; nothing of the bad state is written."""
import os
import re

from common import Wrong, command, fresh, lay_out, one, run
from scenes import FEM, SCENES

GRAINS = """\
title: grains that nothing holds
time: {end: 0.5 s, step: 20 us}
materials: {glass: {density: 2500 kg/m3, young: 5 MPa, poisson: 0.25}}
bodies:
  grains:
    geometry: {box: {size: [4 mm, 4 mm, 4 mm]}}
    method: dem
    material: glass
    dem: {packing: {radius: 1 mm, spread: 0.1, porosity: 0.7, seed: 4}, bonded: false}
    initial_velocity: [0 m/s, 0 m/s, -30 m/s]
output: {history: {every: 20 ms, quantities: [energies]}, checkpoint: {every: 50 ms}}
"""

SLOW = FEM.replace("{y: {ramp: {to: -1 MPa, over: 300 us}}}", "{y: -1 kPa}")
CRUSHED = FEM.replace("xmax, traction: {y: {ramp: {to: -1 MPa, over: 300 us}}}", "xmax, velocity: {x: -200 m/s, y: 0 m/s}").replace("displacement(xmax)", "energies")
FLOOD = FEM.replace("{y: {ramp: {to: -1 MPa, over: 300 us}}}", "{y: {table: [[0 us, 0 MPa], [100 us, 0 MPa], [101 us, 1e300 MPa]]}}")


def critical_step(cleave, here):
    """As the plan of a run gives it [s]."""
    code, said = run([cleave, "run", "scene.yaml", "--no-plots", "--threads", "1", "--stop-after", "1", "--output", fresh(os.path.join(here, "plan"))], here)
    found = re.search(r"critical +([0-9.e+-]+) (s|ms|us|ns)", said)
    if code or not found:
        raise Wrong("no critical step in the plan: %d %s" % (code, said))
    return float(found.group(1)) * {"s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[found.group(2)]


def caught(cleave, folder, name, scene, words, *more):
    here = lay_out(os.path.join(folder, name), scene)
    more = [word(cleave, here) if callable(word) else word for word in more]
    code, said = run(command(cleave, fresh(os.path.join(here, "out")), *more), here)
    if code != 1 or not all(re.search(word, said) for word in words + (r"step \d+", "checkpoint")):
        raise Wrong("%s: exit %d, which lacks one of %s: %s" % (name, code, words, said))
    with open(os.path.join(here, "out", "history.csv")) as file:
        text = file.read().lower()
    if "nan" in text or "inf" in text:
        raise Wrong(name + ": a state that is not finite was written")
    with open(os.path.join(here, "out", "summary.json")) as file:
        if '"failed"' not in file.read():
            raise Wrong(name + ": summary.json does not say failed")
    return said


def too_long(factor):
    return lambda cleave, here: "time.step=%.9g s" % (factor * critical_step(cleave, here))


def causes(cleave, folder):
    beyond = ["--set", "time.beyond_critical=true", "--set"]
    caught(cleave, folder, "elements", one(SLOW, ""), (r"node (is )?\d+, at \(.*\) m",), *beyond, too_long(1.05))
    caught(cleave, folder, "particles", SCENES["breaking"], (r"particle (is )?\d+, at \(.*\) m",), *beyond, too_long(1.05))
    caught(cleave, folder, "overlap", SCENES["coupled"], (r"(particle|node) (is )?\d+, at \(.*\) m",), *beyond, too_long(1.3))  # its critical step is a bound
    caught(cleave, folder, "flood", one(FLOOD, ""), (r"node (is )?\d+, at \(.*\) m", "last good checkpoint: .*checkpoint.h5"))
    caught(cleave, folder, "crushed", one(CRUSHED, ""), (r"element \d+, now about \(.*\) m, is turned inside out",))
    said = caught(cleave, folder, "lost", one(GRAINS, ""), (r"particle \d+, at \(.*\) m", "is lost", "contact.domain", r"last good checkpoint: .*checkpoint.h5 \(step \d+\)"))
    return said
