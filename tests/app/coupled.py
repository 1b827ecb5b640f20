"""How a coupled body steps, through the program: far field, threads, resume, what is refused and where."""
import json
import os
import re
import subprocess
import sys
import tempfile

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from small import COUPLED as SCENE
from small import COUPLED_GEO as GEO

PROGRAM = sys.argv[1]


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


def test_preload(folder):
    """A static start of the whole: the reaction of the loads at t = 0 in the first row, and nothing moves; gravity on both sides; a resume; what cannot be borne."""
    scene = SCENE.replace("{end: 40 us}", "{end: 40 us, preload: static}").replace("{x: {ramp: {to: 1 MPa, over: 20 us}}}", "{x: 1 MPa}").replace("conditions:", "conditions:\n  - {gravity: [2000 m/s2, -1000 m/s2]}")
    write(folder, "held.yaml", scene)
    text = cleave("run", "held.yaml", "--output", "held", "--threads", "1", cwd=folder)
    check("static state of the whole" in text, text)
    rows = history(folder, "held")
    reaction = rows["reaction(left).x"]
    expected = -(1e6 * 0.01 * 0.01 + 2500 * 0.06 * 0.01 * 0.01 * 2000)
    check(abs(reaction[0] / expected - 1) < 1e-4, "reaction", reaction[0], "of", expected)
    check(abs(reaction / reaction[0] - 1).max() < 1e-6, "the reaction moves by", abs(reaction / reaction[0] - 1).max())
    check(abs(rows["displacement(right).x"] / rows["displacement(right).x"][0] - 1).max() < 1e-6, "the end moves")
    check(rows["energy.kinetic"].max() < 1e-9 * rows["energy.strain"][0], "kinetic energy", rows["energy.kinetic"].max())
    print("preload: reaction %.1e of the loads' off, moves by %.1e in %d steps" % (abs(reaction[0] / expected - 1), abs(reaction / reaction[0] - 1).max(), summary(folder, "held")["run"]["steps"]))
    let_go = scene.replace("{x: 1 MPa}", "{x: {table: [[0 us, 1 MPa], [10 us, 0 MPa]]}}")
    write(folder, "go.yaml", let_go)
    cleave("run", "go.yaml", "--output", "go", "--threads", "1", cwd=folder)
    cleave("run", "go.yaml", "--output", "parts", "--threads", "1", "--stop-after", "100", cwd=folder)
    cleave("run", "go.yaml", "--output", "parts", "--threads", "1", "--resume", cwd=folder)
    one, parts = history(folder, "go"), history(folder, "parts")
    for name in one:
        check((one[name] == parts[name]).all(), name, "differs after a resume")
    check(summary(folder, "go")["energy"]["worst_error"] < 1e-4, summary(folder, "go")["energy"])
    turning = scene.replace("substeps: 1", "substeps: 1, switch: {when: rankine, at: 0.3}").replace("{x: 1 MPa}", "{x: {table: [[0 us, 2 MPa], [10 us, 2 MPa], [30 us, 4.5 MPa]]}}").replace("-1000 m/s2", "-100 m/s2")
    turning = turning.replace("poisson: 0.2}", "poisson: 0.2, law: cohesive, tensile_strength: 10 MPa, fracture_energy: 100 J/m2, shear_strength: 40 MPa, fracture_energy_shear: 1000 J/m2, mu_static: 0.5, mu_dynamic: 0.3}")
    write(folder, "turning.yaml", turning)
    cleave("run", "turning.yaml", "--output", "turning", "--threads", "1", cwd=folder)
    events = numpy.genfromtxt(os.path.join(folder, "turning", "switches.csv"), delimiter=",", names=True, dtype=None, encoding=None)
    energy = summary(folder, "turning")["energy"]
    booked = abs(events["bookedJ"]).max() / energy["strain_J"]
    print("preload, then elements that turn: %d events, each books at most %.1e of the strain energy; ledger %.1e" % (len(events), booked, energy["worst_error"]))
    check(len(events) > 1 and booked < 1e-3 and energy["worst_error"] < 1e-6, energy)
    refused(folder, scene.replace("substeps: 1", "substeps: 2"), 8, "do not go together")
    refused(folder, scene.replace("    dem: {group", "    initial_stress: {surface: 0 m}\n    dem: {group"), 14, "begin with time: {preload: static}")
    situ = SCENE.replace("    dem: {group", "    initial_stress: {xx: -1 MPa, zz: -0.2 MPa}\n    dem: {group").replace("{ramp: {to: 1 MPa, over: 20 us}}", "{table: [[0 us, -1 MPa], [20 us, -1 MPa], [21 us, 0 MPa], [50 us, 0 MPa]]}")
    write(folder, "situ.yaml", situ)
    cleave("run", "situ.yaml", "--output", "situ", "--threads", "1", cwd=folder)
    rows, energy = history(folder, "situ"), summary(folder, "situ")["energy"]
    before = rows["time"] < 20e-6
    stretch = 1e6 / 20e9 * (1 - 0.2 ** 2) * 0.06
    print("in-situ stress: reaction within %.1e until the load goes, end moves %.1e of the stretch; then %.2f of it; ledger %.1e" % (abs(rows["reaction(left).x"][before] / 100 - 1).max(),
          abs(rows["displacement(right).x"][before]).max() / stretch, rows["displacement(right).x"][-1] / stretch, energy["worst_error"]))
    check(abs(rows["reaction(left).x"][before] / 100 - 1).max() < 1e-4 and abs(rows["displacement(right).x"][before]).max() < 1e-4 * stretch, "jumps at the start")
    check(0.5 * stretch < rows["displacement(right).x"][-1] and energy["worst_error"] < 1e-6, energy)
    refused(folder, situ.replace("substeps: 1", "substeps: 2"), 8, "with sub-steps is not covered")


def test_absorb(folder):
    """An absorbing side of a coupled body, under sub-steps and with an implicit far field; not on particles."""
    scene = SCENE.replace("{end: 40 us}", "{end: 60 us}").replace("{group: left, fix: [x, y]}", "{group: left, absorb: true}").replace("{ramp: {to: 1 MPa, over: 20 us}}", "{table: [[0 us, 0 MPa], [5 us, 1 MPa], [10 us, 0 MPa]]}")
    scene = scene.replace("reaction(left), ", "")
    for name, words in (("one", "substeps: 1"), ("steps", "substeps: 2"), ("implicit", "substeps: 2, far_field: implicit")):
        write(folder, name + ".yaml", scene.replace("substeps: 1", words))
        cleave("run", name + ".yaml", "--output", name, "--threads", "1", cwd=folder)
        energy = summary(folder, name)["energy"]
        left = (energy["kinetic_J"] + energy["strain_J"]) / energy["work_J"]
        print("absorb, %s: %.1e of the work is left, ledger %.1e" % (words, left, energy["worst_error"]))
        check(left < 0.05 and energy["worst_error"] < 5e-3, energy)
    refused(folder, scene.replace("{group: left, absorb: true}", "{group: waist, absorb: true}"), 17, "particles' side")


def test_static(folder):
    """Load steps: reaction and end of the bar by Hooke, condensed or not, the same bits after a resume; what does not go together."""
    scene = SCENE.replace("{end: 40 us}", "{end: 1 s, method: static, steps: 2}").replace("substeps: 1", "far_field: static, tolerance: 0.000001").replace("over: 20 us", "over: 1 s").replace("every: 2 us", "every: 0.5 s").replace("every: 20 us", "every: 1 s")
    scene = scene.replace("[x, y]", "x")
    for name, more in (("auto", ""), ("never", ", condense: never")):
        write(folder, name + ".yaml", scene.replace("far_field: static", "far_field: static" + more))
        text = cleave("run", name + ".yaml", "--output", name, "--threads", "1", cwd=folder)
        check("condensed to" in text if name == "auto" else "solved in each iteration" in text, text)
    one, never = history(folder, "auto"), history(folder, "never")
    stretch = 1e6 / 20e9 * (1 - 0.2 ** 2) * 0.06
    for rows in (one, never):
        check(abs(rows["reaction(left).x"][-1] / -100 - 1) < 1e-4, rows["reaction(left).x"])
        check(abs(rows["displacement(right).x"][-1] / stretch - 1) < 0.005, rows["displacement(right).x"], stretch)
    found = summary(folder, "auto")
    print("static: end off Hooke by %.1e, ledger %.1e, %d iterations" % (one["displacement(right).x"][-1] / stretch - 1, found["energy"]["worst_error"], found["far_field"]["iterations"]))
    check(found["energy"]["worst_error"] < 1e-3 and found["state"] == "done", found["energy"])
    cleave("run", "auto.yaml", "--output", "parts", "--threads", "1", "--stop-after", "1", cwd=folder)
    cleave("run", "auto.yaml", "--output", "parts", "--threads", "1", "--resume", cwd=folder)
    parts = history(folder, "parts")
    for name in one:
        check((one[name] == parts[name]).all(), name, "differs after a resume")
    refused(folder, scene.replace("far_field: static, tolerance: 0.000001", "substeps: 1"), 12, "far_field: static")
    refused(folder, scene.replace("method: static, steps: 2", "method: explicit"), 15, "load steps")
    refused(folder, scene.replace("method: static, steps: 2", "method: implicit, step: 1 ms").replace("far_field: static, tolerance: 0.000001", "substeps: 1"), 12, "steps explicitly")
    refused(folder, scene.replace("far_field: static", "far_field: static, switch: {at: 0.7}"), 15, "does not go with coupling.switch")
    refused(folder, scene.replace("{group: left, fix: x}", "{group: left, absorb: true}"), 17, "absorb")



def test_ways(folder):
    """Other ways of joining, the absorber, quadratic cells: each runs to the end, keeps its ledger and ends where the plain run does; a resume goes on to the bit."""
    plain = SCENE.replace("{end: 40 us}", "{end: 20 us}")
    quadratic = plain.replace("radius: 0.4 mm", "radius: 0.22 mm").replace("    material: rock\n    dem", "    material: rock\n    mesh: {order: 2}\n    dem")
    write(folder, "plain.yaml", plain)
    write(folder, "quadratic.yaml", quadratic)
    cleave("run", "plain.yaml", "--output", "plain", cwd=folder)
    end = history(folder, "plain")["displacement(right).x"][-1]
    for scene, key in (("plain", "coupling.method=consistent"), ("plain", "coupling.method=penalty"), ("plain", "coupling.absorber=true"), ("quadratic", "coupling.substeps=1"), ("quadratic", "coupling.substeps=2"),
                       ("quadratic", "coupling.far_field=implicit"), ("quadratic", "bodies.bar.mesh.incomplete=true")):
        name = scene + key.replace("=", ".")
        cleave("run", scene + ".yaml", "--set", key, "--output", name, cwd=folder)
        off, error = history(folder, name)["displacement(right).x"][-1] / end - 1, summary(folder, name)["energy"]["worst_error"]
        print("%s %s: end off by %.1e, ledger %.1e" % (scene, key, off, error))
        check(abs(off) < 0.01 and error < (1e-3 if "substeps=2" in key else 1e-6), name, off, error)
    cleave("run", "plain.yaml", "--set", "coupling.method=consistent", "--output", "parts", "--stop-after", "60", cwd=folder)
    cleave("run", "plain.yaml", "--set", "coupling.method=consistent", "--output", "parts", "--resume", cwd=folder)
    whole, parts = history(folder, "plaincoupling.method.consistent"), history(folder, "parts")
    check(all((whole[name] == parts[name]).all() for name in whole), "a resume of method: consistent differs")
    refused(folder, quadratic.replace("0.22 mm", "0.45 mm"), 8, "no stable energy")
    refused(folder, plain.replace("substeps: 1", "substeps: 1, method: consistent").replace("poisson: 0.2", "poisson: 0.2, mass_damping: 10 1/s"), 8, "do not go together")

def main():
    for name in sys.argv[2:]:
        with tempfile.TemporaryDirectory(prefix="cleave-coupled-" + name + "-") as folder:
            globals()["test_" + name](folder)
        print(name, "passed")


main()
