"""The plate impact of examples/overlap with elements that turn, beside the one whose particles are there from the start.

coupled_plate.py CLEAVE SOURCE
"""
import csv
import json
import os
import subprocess
import sys
import tempfile

CLEAVE, SOURCE = sys.argv[1:3]
SCENE = os.path.join(SOURCE, "examples", "overlap", "plate.yaml")
TURNING = ("bodies.plate.dem.group=spot", "coupling={width: 2 elements, substeps: 1, switch: {when: rankine, at: 0.3, group: upper}}")


def check(ok, *what):
    if not ok:
        sys.exit("FAILED: " + " ".join(map(str, what)))


def run(out, *settings):
    words = [word for s in settings for word in ("--set", s)]
    done = subprocess.run([CLEAVE, "run", SCENE, "--output", out, "--threads", "1", "--no-plots", "--quiet", *words], capture_output=True, text=True)
    check(done.returncode == 0, "ended with", done.returncode, done.stdout[-1000:], done.stderr[-1000:])
    with open(os.path.join(out, "summary.json")) as file:
        summary = json.load(file)
    with open(os.path.join(out, "history.csv")) as file:
        rows = list(csv.reader(file))
    last = {name.split("[")[0]: float(x) for name, x in zip(rows[0], rows[-1])}
    with open(os.path.join(out, "cracks.csv")) as file:
        cracks = list(csv.reader(file))
    column = {name.split("[")[0]: k for k, name in enumerate(cracks[0])}
    first = min((float(row[column["time"]]), float(row[column["y"]])) for row in cracks[1:] if abs(float(row[column["x"]]) - 0.06) < 0.01)
    return summary, last, first[1]


with tempfile.TemporaryDirectory() as folder:
    static, rest, at = run(os.path.join(folder, "static"))
    adaptive, end, turned = run(os.path.join(folder, "adaptive"), *TURNING)
    print("first facet %.3f and %.3f mm from the back, fracture %.4g and %.4g J, ledger %.1e and %.1e; %d events" % (1e3 * (0.02 - at), 1e3 * (0.02 - turned), rest["energy.fracture"],
          end["energy.fracture"], static["energy"]["worst_error"], adaptive["energy"]["worst_error"], adaptive["switch"]["events"]))
    check(abs(turned - at) < 0.8e-3, "another plane", at, turned)  # a particle
    check(abs(end["energy.fracture"] / rest["energy.fracture"] - 1) < 0.1, "fracture work", rest["energy.fracture"], end["energy.fracture"])
    check(adaptive["switch"]["bonds_above_strength"] == 0, adaptive["switch"])
    check(max(adaptive["energy"]["worst_error"], static["energy"]["worst_error"]) < 0.01, "ledger", adaptive["energy"], static["energy"])
