"""time.govern: a bar torn with a governed load beside constant rates; the same bits with other threads, ranks and after a resume; finite elements, coupled bodies, tools.

governed.py CLEAVE
"""
import csv
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from small import BEAM, BLOCK, COUPLED, COUPLED_GEO

CLEAVE = sys.argv[1]
os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")
END, CROSSING = 0.12e-3, 0.06 / (37e9 / 2400) ** 0.5  # [m] opening of the bar at last, [s] of a wave
BAR = """\
title: a bar that tears
dimension: 2
plane: stress
thickness: 1 m
time: {end: DURATION sGOVERN}
materials:
  concrete: {density: 2400 kg/m3, young: 37 GPa, poisson: 0.2, law: cohesive, tensile_strength: 3.9 MPa, fracture_energy: 143 J/m2, shear_strength: 12 MPa, fracture_energy_shear: 1430 J/m2, mu_static: 0.9, mu_dynamic: 0.3, local_damping: 0.5}
bodies:
  bar:
    geometry: {box: {size: [60 mm, 20 mm]}}
    method: dem
    material: concrete
    dem: {packing: {radius: 1 mm, spread: 0.2, seed: 1}}
conditions:
  - {group: xmin, velocity: {x: {ramp: {to: -SPEED m/s, over: RISE s}}}}
  - {group: xmax, velocity: {x: {ramp: {to: SPEED m/s, over: RISE s}}}}
output:
  history: {every: ROW s, quantities: [reaction(xmax), displacement(xmax), velocity(xmax), energies]}
  checkpoint: {every: 1 s}
"""


def check(true, *words):
    if not true:
        raise AssertionError(" ".join(str(word) for word in words))


def bar(crossings, govern=""):
    """Drawn apart by END in so many crossings of a wave, the first twentieth getting there."""
    duration = crossings * CROSSING
    values = {"DURATION": duration, "GOVERN": govern and ", govern: " + govern, "SPEED": END / 2 / (0.975 * duration), "RISE": 0.05 * duration, "ROW": duration / 2000}
    text = BAR
    for word, value in values.items():
        text = text.replace(word, str(value))
    return text


def run(folder, name, scene, *options, expect=0, before=()):
    with open(os.path.join(folder, name + ".yaml"), "w") as file:
        file.write(scene)
    done = subprocess.run([*before, CLEAVE, "run", name + ".yaml", "--output", name, "--no-plots", *([] if "--threads" in options else ["--threads", "1"]), *options], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=600)
    check(done.returncode == expect, name, options, "returned", done.returncode, done.stdout)
    return done.stdout


def history(folder, name):
    with open(os.path.join(folder, name, "history.csv")) as file:
        rows = list(csv.reader(file))
    return {word.split("[")[0]: [float(row[k]) for row in rows[1:]] for k, word in enumerate(rows[0])}


def text_of(folder, name):
    """Rows of the history without the last column, ledger_error: what ranks sum in another order."""
    with open(os.path.join(folder, name, "history.csv")) as file:
        return "\n".join(line.rsplit(",", 1)[0] for line in file.read().splitlines())


def test_tear(folder):
    """Governed, a bar gives the peak of a constant rate that is slow enough to 1 % and its energy to 3 %, in less than half the steps; a constant rate of as many steps misses the energy by more."""
    run(folder, "slow", bar(1000))
    slow = history(folder, "slow")
    peak, energy, steps = max(slow["reaction(xmax).x"]), slow["energy.fracture"][-1], slow["step"][-1]
    check(abs(energy / (143 * 0.02) - 1) < 0.02 and abs(peak / (3.9e6 * 0.02) - 1) < 0.01, "slow:", peak, energy)
    run(folder, "governed", bar(500, "{}"))
    g = history(folder, "governed")
    print("slow: %d steps; governed: %d steps, peak %.4f energy %.4f of it, pace %.2f to %.2f" % (steps, g["step"][-1], max(g["reaction(xmax).x"]) / peak, g["energy.fracture"][-1] / energy, min(g["load_rate"]), max(g["load_rate"])))
    check(abs(max(g["reaction(xmax).x"]) / peak - 1) < 0.01 and abs(g["energy.fracture"][-1] / energy - 1) < 0.03, "governed:", max(g["reaction(xmax).x"]), g["energy.fracture"][-1])
    check(g["step"][-1] < 0.5 * steps, "governed took", g["step"][-1], "steps of", steps)
    check(max(g["ledger_error"]) < 1e-5, "ledger", max(g["ledger_error"]))
    run(folder, "quick", bar(1000 * g["step"][-1] / steps))
    quick = history(folder, "quick")["energy.fracture"][-1]
    print("constant rate, as many steps: energy %.4f" % (quick / energy))
    check(quick / energy - 1 > 1.5 * (g["energy.fracture"][-1] / energy - 1), "a constant rate of as many steps is as good:", quick, g["energy.fracture"][-1], energy)
    # The platen is where its table has it at the load time, as fast as the table times the pace.
    duration, rise = 500 * CROSSING, 0.05 * 500 * CROSSING
    speed = END / 2 / (0.975 * duration)
    for T, pace, u, v in zip(g["load_time"], g["load_rate"], g["displacement(xmax).x"], g["velocity(xmax).x"]):
        check(abs(u - speed * (T * T / 2 / rise if T < rise else T - rise / 2)) < 1e-9 * END, "at load time", T, "the platen stands at", u)
        check(abs(v - pace * speed * min(T / rise, 1)) < 1e-6 * speed, "at load time", T, "it moves at", v)
    check(abs(g["load_time"][-1] / duration - 1) < 1e-3, "ended at load time", g["load_time"][-1])
    # Bits: threads, ranks, and a run that stopped and went on.
    run(folder, "threads", bar(500, "{}"), "--threads", "2", "--stop-after", "6000")
    run(folder, "ranks", bar(500, "{}"), "--stop-after", "1000", before=("mpiexec", "-n", "2"))
    whole = text_of(folder, "governed").splitlines()
    for name in ("threads", "ranks"):
        rows = text_of(folder, name).splitlines()
        check(len(rows) > 2 and rows == whole[: len(rows)], name, "gives other bits")
    for stop in ("--stop-after 18333", "--stop-after 10 --resume", "--stop-after 4000 --resume"):
        run(folder, "pieces", bar(500, "{}"), *stop.split())
    rows = text_of(folder, "pieces").splitlines()
    check(max(history(folder, "pieces")["energy.fracture"]) > 0.01 * energy and rows == whole[: len(rows)], "a run that stopped and went on has other rows")


def test_others(folder):
    """A bound of 1 on either side is the plain run; elements, a coupled body and a solid block hurry while they are quiet, and book every joule."""
    scenes = {"beam": BEAM.replace("-1 MPa", "{ramp: {to: -1 MPa, over: 40 us}}"), "block": BLOCK, "coupled": COUPLED}
    with open(os.path.join(folder, "bar.geo"), "w") as file:
        file.write(COUPLED_GEO)
    for name, scene in scenes.items():
        at = scene.index("time: {") + 7
        run(folder, name, scene)
        run(folder, name + "-one", scene[:at] + "govern: {slowest: 1, fastest: 1}, " + scene[at:])
        plain, one = history(folder, name), history(folder, name + "-one")
        for column, values in plain.items():
            scale = max(1e-300, max(abs(v) for v in values))
            check(len(values) == len(one[column]) and max(abs(a - b) for a, b in zip(values, one[column])) <= (1e-9 if column != "ledger_error" else 1e9) * scale, name, "with pace 1 differs in", column)
        run(folder, name + "-fast", scene[:at] + "govern: {loading: 2, kinetic: 10, slowest: 1, fastest: 3, response: 2 us}, " + scene[at:])
        fast = history(folder, name + "-fast")
        print("%s: %d steps, governed %d, pace up to %.2f, ledger %.1e" % (name, plain["step"][-1], fast["step"][-1], max(fast["load_rate"]), max(fast["ledger_error"])))
        check(fast["step"][-1] < 0.9 * plain["step"][-1] and max(fast["ledger_error"]) < 1e-6, name, "took", fast["step"][-1], "steps, ledger", max(fast["ledger_error"]))
    for change, part in (("govern: {kinetic: 0, loading: 0, breaking: 0}", "nothing governs the load"), ("govern: {slowest: 3, fastest: 2}", "below time.govern.slowest"), ("govern: {slowest: 0}", "slowest"), ("method: static, govern: {}", "govern")):
        text = run(folder, "refused", BEAM.replace("time: {", "time: {" + change + ", "), expect=2)
        check("refused.yaml:5:" in text and part in text, "expected", repr(part), "but:", text)


if __name__ == "__main__":
    for test in (test_tear, test_others):
        with tempfile.TemporaryDirectory() as folder:
            test(folder)
        print(test.__name__, "ok", flush=True)
