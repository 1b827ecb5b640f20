"""Bonded particles from outside: bonds as lines, fragments, gauge, restart in the middle of a tear, groups that do not bond.

bonded.py CLEAVE
"""
import csv
import glob
import json
import os
import subprocess
import sys
import tempfile

import h5py
import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from small import HALVES

CLEAVE = sys.argv[1]
SCENE = """\
title: a bar that tears
dimension: 2
plane: stress
thickness: 10 mm
time: {end: 0.7 ms}
materials:
  rock: {density: 2500 kg/m3, young: 30 GPa, poisson: 0.2, law: cohesive, tensile_strength: 4 MPa, fracture_energy: 20 J/m2, shear_strength: 12 MPa, fracture_energy_shear: 200 J/m2, mu_dynamic: 0.3, local_damping: 0.3}
bodies:
  bar:
    geometry: bar.geo
    length_unit: 1 mm
    group: bar
    method: dem
    material: rock
    dem: {packing: {radius: 2 mm, spread: 0.2, seed: 2}}
conditions:
  - {group: a, velocity: {x: {ramp: {to: -30 mm/s, over: 0.3 ms}}}}
  - {group: b, velocity: {x: {ramp: {to: 30 mm/s, over: 0.3 ms}}}}
output:
  history: {every: 5 us, quantities: [reaction(b), gauge, quality]}
  fields: {every: 0.35 ms, names: [displacement, stress, damage, criterion, coordination, fragment, bonds]}
"""


def check(ok, *what):
    if not ok:
        sys.exit("FAILED: " + " ".join(map(str, what)))


def cleave(*words, folder, expect=0):
    done = subprocess.run([CLEAVE, *words, "--no-plots"], cwd=folder, capture_output=True, text=True)
    check(done.returncode == expect, words, "ended with", done.returncode, done.stdout[-2000:], done.stderr[-2000:])
    return done.stdout + done.stderr


def table(*path):
    with open(os.path.join(*path)) as file:
        rows = list(csv.reader(file))
    return {name.split("[")[0]: numpy.array([float(r[i] or "nan") if name != "mode" else 0 for r in rows[1:]]) for i, name in enumerate(rows[0])}


def frame(directory, k):
    arrays = {}
    with h5py.File(sorted(glob.glob(os.path.join(directory, "fields", "*.h5")))[k]) as file:
        file.visititems(lambda name, what: arrays.update({name: what[()]}) if hasattr(what, "shape") else None)
    return arrays


def main(folder):
    with open(os.path.join(folder, "bar.geo"), "w") as file:
        file.write(HALVES)
    with open(os.path.join(folder, "bar.yaml"), "w") as file:
        file.write(SCENE)
    cleave("run", "bar.yaml", "--output", "whole", folder=folder)
    whole = os.path.join(folder, "whole")
    h = table(whole, "history.csv")
    early = numpy.argmax(h["gauge.stress.x"] > 1e6)
    check(abs(h["gauge.modulus"][early] / 30e9 - 1) < 0.01 and abs(h["gauge.poisson"][early] - 0.2) < 0.004, "gauge", h["gauge.modulus"][early], h["gauge.poisson"][early])
    check(abs(h["gauge.stress.x"][early] * 2e-4 / h["reaction(b).x"][early] - 1) < 0.05, "gauge stress against the reaction")
    peak = h["reaction(b).x"].max() / 2e-4
    check(abs(peak / 4e6 - 1) < 0.05, "peak", peak)
    check(h["reaction(b).x"][-1] < 0.15 * h["reaction(b).x"].max(), "the bar still holds", h["reaction(b).x"][-1])
    check(abs(h["ledger_error"]).max() < 0.01, "ledger")

    # fragments: two big ones, and every gram in the table
    parts = table(whole, "fragments.csv")
    check(abs(parts["mass"].sum() / (2500 * 0.06 * 0.02 * 0.01) - 1) < 1e-6, "mass", parts["mass"].sum())
    check(list(parts["mass"]) == sorted(parts["mass"], reverse=True) and parts["mass"][1] > 0.01 * parts["mass"][0] and parts["mass"][2:].sum() < 0.1 * parts["mass"].sum(), "fragments", parts["mass"])
    check(parts["velocity.x"][0] * parts["velocity.x"][1] < 0, "the parts do not move apart")
    last = frame(whole, -1)
    key = {name.split("/")[-1]: name for name in last if name.startswith("particles/")}
    fragment = last[key["fragment"]].ravel()
    check(numpy.array_equal(numpy.bincount(fragment.astype(int)), parts["particles"].astype(int)), "the frame's fragments are not the table's")

    # bonds: lines between particles; stress, damage, criterion and state belong together
    bonds = {name.split("/")[-1]: last[name].ravel() for name in last if name.startswith("bonds/")}
    check(all(name in bonds for name in ("sigma", "tau", "damage", "criterion", "state")), sorted(last))
    state, damage = bonds["state"], bonds["damage"]
    check(len(state) == len(damage) == len(bonds["sigma"]) and set(state) <= {0, 1, 2, 3}, set(state))
    check(((state >= 2) == (damage >= 0.9999)).all() and ((state == 0) == (damage == 0)).all(), "state and damage")
    check((bonds["criterion"][state > 0] == 1).all() and (bonds["criterion"][state == 0] < 1 + 1e-12).all(), "criterion")
    check((state >= 2).sum() >= 5 and abs(bonds["sigma"][state == 3]).max(initial=0) == 0, "broken bonds", (state >= 2).sum())
    coordination = last[key["coordination"]].ravel()
    check(coordination.sum() == 2 * (damage < 0.9999).sum(), "coordination counts the bonds that hold")
    first = frame(whole, 0)
    check((first[next(n for n in first if n.startswith("bonds/") and n.endswith("/state"))] == 0).all(), "bonds at the start")

    # stopped while it tears, and resumed: the same bits
    at = int(h["step"][numpy.argmax(h["reaction(b).x"])]) + 150
    bare = SCENE[:SCENE.index("  fields:")]  # frames and their pictures are the first run's
    with open(os.path.join(folder, "cut.yaml"), "w") as file:
        file.write(bare)
    cleave("run", "cut.yaml", "--output", "cut", "--stop-after", str(at), folder=folder)
    cut = table(folder, "cut", "cracks.csv")
    check(0 < ((cut["broken"] > 0.01) & (cut["broken"] < 0.99)).sum(), "stopped where nothing softens")
    cleave("run", "cut.yaml", "--output", "cut", "--resume", folder=folder)
    for name in ("history.csv", "cracks.csv", "fragments.csv"):
        with open(os.path.join(whole, name), "rb") as a, open(os.path.join(folder, "cut", name), "rb") as b:
            check(a.read() == b.read(), name, "differs after a resume")

    # two groups that do not bond: nothing to tear when drawn apart, a push goes through
    joint = bare.replace("seed: 2}}", "seed: 2}, cohesive_groups: [left, right]}")
    for name, text in (("joint", joint), ("push", joint.replace("to: -30", "to: 3").replace("to: 30", "to: -3"))):
        with open(os.path.join(folder, name + ".yaml"), "w") as file:
            file.write(text)
        cleave("run", name + ".yaml", "--output", name, folder=folder)
    apart, push = table(folder, "joint", "history.csv"), table(folder, "push", "history.csv")
    check(abs(apart["reaction(b).x"]).max() < 0.1 * h["reaction(b).x"].max(), "two groups hold together", abs(apart["reaction(b).x"]).max())
    check(-push["reaction(b).x"].min() / 2e-4 > 0.8e6, "two groups do not push", push["reaction(b).x"].min())
    parts = table(folder, "joint", "fragments.csv")
    check(len(parts["mass"]) >= 2 and abs(parts["mass"][0] / parts["mass"][1] - 1) < 0.1 and parts["mass"][2:].sum() == 0, "groups as fragments", parts["mass"])
    for old, new, words in (("[left, right]", "[left, rihgt]", "rihgt"), ("geometry: bar.geo\n    length_unit: 1 mm\n    group: bar", "geometry: {box: {size: [60 mm, 20 mm]}}", "physical groups of a .geo or .msh file")):
        with open(os.path.join(folder, "wrong.yaml"), "w") as file:
            file.write(joint.replace(old, new).replace("group: a,", "group: xmin," if "box" in new else "group: a,").replace("group: b,", "group: xmax," if "box" in new else "group: b,").replace("(b)", "(xmax)" if "box" in new else "(b)"))
        text = cleave("run", "wrong.yaml", "--output", "wrong", folder=folder, expect=2)
        check(words in text and "wrong.yaml:" in text, words, "not in", text)
    print(json.dumps({"peak / strength": peak / 4e6, "fragments": len(parts["mass"])}))


def at_rest(folder):
    """E and nu of a cylinder of particles by load steps without inertia, stopped and gone on with; what moves is refused."""
    text = """\
time: {end: 1 s, method: static, steps: 4}
materials: {rock: {density: 2500 kg/m3, young: 30 GPa, poisson: 0.2}}
bodies: {core: {geometry: {cylinder: {radius: 25 mm, height: 100 mm}}, method: dem, material: rock, dem: {packing: {count: 800, spread: 0.2, seed: 1}}}}
conditions:
  - {group: bottom, fix: z}
  - {group: top, displacement: {z: {ramp: {to: -0.01 mm, over: 1 s}}}}
output: {history: {every: 0.25 s, quantities: [reaction(top), gauge]}}
"""
    with open(os.path.join(folder, "rest.yaml"), "w") as file:
        file.write(text)
    cleave("run", "rest.yaml", "--output", "rest", folder=folder)
    rows = table(folder, "rest", "history.csv")
    check(abs(rows["gauge.modulus"][-1] / 30e9 - 1) < 1e-5 and abs(rows["gauge.poisson"][-1] - 0.2) < 1e-5, "E, nu at rest", rows["gauge.modulus"][-1], rows["gauge.poisson"][-1])
    cleave("run", "rest.yaml", "--output", "cut_rest", "--stop-after", "2", folder=folder)
    cleave("run", "rest.yaml", "--output", "cut_rest", "--resume", folder=folder)
    with open(os.path.join(folder, "rest", "history.csv"), "rb") as a, open(os.path.join(folder, "cut_rest", "history.csv"), "rb") as b:
        check(a.read() == b.read(), "load steps differ after a resume")
    torn = """\
time: {end: 1 s, method: static, steps: 30}
dimension: 2
materials: {rock: {density: 2500 kg/m3, young: 30 GPa, poisson: 0.2, law: cohesive, tensile_strength: 4 MPa, fracture_energy: 20 J/m2}}
bodies: {bar: {geometry: {box: {size: [60 mm, 20 mm]}}, method: dem, material: rock, dem: {packing: {count: 300, spread: 0.2, seed: 1}}}}
conditions:
  - {group: xmin, fix: x}
  - {group: xmax, displacement: {x: {ramp: {to: 0.015 mm, over: 1 s}}}}
output: {fields: {every: 0.5 s, names: [damage, fragment]}, history: {every: 0.03333333333333333 s, quantities: [reaction(xmax)]}}
"""
    with open(os.path.join(folder, "torn.yaml"), "w") as file:
        file.write(torn)
    said = cleave("check", "torn.yaml", folder=folder)
    rounds = [line for line in said.splitlines() if line.startswith("  breaking")]
    check(len(rounds) == 1 and "not counted" in rounds[0] and abs(float(rounds[0].split("about ")[1].split()[0]) / 2000 - 1) < 0.05, "what breaks is told apart in the plan:", said)  # 10 particles in a section, 200 rounds each
    cleave("run", "torn.yaml", "--output", "torn", "--threads", "1", folder=folder)
    rows, cracks = table(folder, "torn", "history.csv"), table(folder, "torn", "cracks.csv")
    peak = rows["reaction(xmax).x"].max() / (4e6 * 0.02)
    check(0.95 < peak < 1.01 and abs(rows["reaction(xmax).x"][-1]) < 0.02 * 4e6 * 0.02 and 0.97 < rows["energy.fracture"][-1] / (20 * 0.02) < 1.1, "a bar torn in load steps", peak, rows["energy.fracture"][-1])
    check((numpy.diff(rows["energy.fracture"]) >= 0).all() and rows["ledger_error"].max() < 0.01 and len(cracks["time"]) > 10, "its energies", rows["ledger_error"].max())
    cleave("run", "torn.yaml", "--output", "cut_torn", "--stop-after", "17", "--threads", "2", folder=folder)
    cleave("run", "torn.yaml", "--output", "cut_torn", "--resume", "--threads", "2", folder=folder)
    for name in ("history.csv", "cracks.csv"):
        with open(os.path.join(folder, "torn", name), "rb") as a, open(os.path.join(folder, "cut_torn", name), "rb") as b:
            check(a.read() == b.read(), "load steps that break differ after a resume on two threads in", name)
    with open(os.path.join(folder, "breaks.yaml"), "w") as file:
        file.write(torn.replace("law: cohesive, tensile_strength: 4 MPa, fracture_energy: 20 J/m2", "elasticity: onate2015, law: published, tensile_strength: 4 MPa, shear_strength: 8 MPa, delta_n: 5, delta_s: 5"))
    said = cleave("run", "breaks.yaml", "--output", "breaks", folder=folder, expect=2)
    check("breaks by law: cohesive" in said and "breaks.yaml:3:" in said, "a static run of the published law:", said)


with tempfile.TemporaryDirectory() as scratch:
    main(scratch)
    at_rest(scratch)
