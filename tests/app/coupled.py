"""How a coupled body steps, through the program: far field, threads, resume, what is refused and where."""
import json
import os
import re
import subprocess
import sys
import tempfile

import numpy

PROGRAM = sys.argv[1]

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

SCENE = """\
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


def check(true, *words):
    if not true:
        raise AssertionError(" ".join(str(word) for word in words))


def cleave(*arguments, cwd, expect=0):
    done = subprocess.run([PROGRAM, *arguments, *(["--no-plots"] if arguments[0] == "run" else [])], cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=600)
    check(done.returncode == expect, arguments, "returned", done.returncode, done.stdout)
    return done.stdout


def write(folder, name, text):
    with open(os.path.join(folder, name), "w") as file:
        file.write(text)
    with open(os.path.join(folder, "bar.geo"), "w") as file:
        file.write(GEO)


def history(folder, output):
    with open(os.path.join(folder, output, "history.csv")) as file:
        names = [name.split("[")[0] for name in file.readline().strip().split(",")]
    rows = numpy.loadtxt(os.path.join(folder, output, "history.csv"), delimiter=",", skiprows=1)
    return {name: rows[:, k] for k, name in enumerate(names)}


def summary(folder, output):
    with open(os.path.join(folder, output, "summary.json")) as file:
        return json.load(file)


def refused(folder, scene, line, part):
    write(folder, "broken.yaml", scene)
    text = cleave("run", "broken.yaml", cwd=folder, expect=2)
    places = [int(at) for at in re.findall(r"broken\.yaml:(\d+):\d+: ", text)]
    check(line in places and part in text, "expected", repr(part), "on line", line, "but:", text)


def test_far(folder):
    """An implicit far field: the explicit run's history, the same bits with two threads and after a resume; the plan says what and why."""
    implicit = SCENE.replace("substeps: 1", "substeps: 2, far_field: implicit")
    write(folder, "explicit.yaml", SCENE)
    write(folder, "implicit.yaml", implicit)
    text = cleave("run", "implicit.yaml", "--output", "one", "--threads", "1", cwd=folder)
    check(re.search(r"far field implicit .*as asked", text), text)
    cleave("run", "explicit.yaml", "--output", "explicit", cwd=folder)
    cleave("run", "implicit.yaml", "--output", "two", "--threads", "2", cwd=folder)
    cleave("run", "implicit.yaml", "--output", "parts", "--stop-after", "60", cwd=folder)
    cleave("run", "implicit.yaml", "--output", "parts", "--resume", cwd=folder)
    one, two, parts, explicit = (history(folder, name) for name in ("one", "two", "parts", "explicit"))
    for name in one:
        if "energy" not in name and "error" not in name:
            check((one[name] == two[name]).all(), name, "differs with two threads")
        check((one[name] == parts[name]).all(), name, "differs after a resume")
    off = abs(numpy.interp(explicit["time"], one["time"], one["displacement(right).x"]) - explicit["displacement(right).x"]).max()
    check(off < 0.01 * abs(explicit["displacement(right).x"]).max(), "displacement off by", off)
    found = summary(folder, "one")
    check(found["energy"]["worst_error"] < 1e-3, found["energy"])
    check(found["far_field"]["taken_at_face_J"] < 0.01 * found["energy"]["work_J"], found["far_field"])
    print("far field: displacement off by %.1e of its largest, ledger %.1e, the faces took %.1e of the work" % (off / abs(explicit["displacement(right).x"]).max(), found["energy"]["worst_error"],
          found["far_field"]["taken_at_face_J"] / found["energy"]["work_J"]))
    refused(folder, implicit.replace("far_field: implicit", "far_field: implicit, switch: {at: 0.7}"), 15, "does not go with coupling.switch")
    refused(folder, implicit.replace("poisson: 0.2", "poisson: 0.2, local_damping: 0.1"), 8, "do not go together")
    refused(folder, implicit.replace("far_field: implicit", "far_field: implict"), 15, "implicit")
    text = cleave("run", "explicit.yaml", "--set", "coupling.far_field=auto", "--stop-after", "2", "--output", "auto", cwd=folder)
    check("far field explicit; chosen" in text, text)


def main():
    for name in sys.argv[2:]:
        with tempfile.TemporaryDirectory(prefix="cleave-coupled-" + name + "-") as folder:
            globals()["test_" + name](folder)
        print(name, "passed")


main()
