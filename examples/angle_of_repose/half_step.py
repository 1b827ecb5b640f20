"""The mean angle over seeds, at the run's own step and at half of it.  python3 half_step.py CLEAVE [SEEDS [OUT]]

CLEAVE is the program. One slide more or less moves the angle of one run by a degree or two, so means are compared; the last column is the
standard error of their difference. What OUT (a temporary folder) already holds is not run again.
"""
import json
import os
import statistics
import subprocess
import sys
import tempfile

import read_off

SCENE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "scene.yaml")


def run(cleave, out, seed, step):
    directory = os.path.join(out, "%s%d" % ("half" if step else "whole", seed))
    sets = ["--set", "bodies.grains.dem.packing.seed=%d" % seed, "--set", "output.history.every=100 ms", "--set", "output.fields.every=500 ms"]
    if not os.path.exists(os.path.join(directory, "summary.json")):
        subprocess.run([cleave, "run", SCENE, "--no-plots", "--quiet", "--threads", "1", "--output", directory] + sets + (["--set", "time.step=%.4fus" % (1e6 * step)] if step else []), check=True)
    with open(os.path.join(directory, "summary.json")) as file:
        return directory, json.load(file)["plan"]["step_s"]


def main():
    seeds = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    out = sys.argv[3] if len(sys.argv) > 3 else tempfile.mkdtemp(prefix="repose-")
    angle = ([], [])
    for seed in range(1, seeds + 1):
        whole, step = run(sys.argv[1], out, seed, None)
        half, _ = run(sys.argv[1], out, seed, 0.499995 * step)
        for k, directory in enumerate((whole, half)):
            grains, _, degrees, speed = read_off.read(directory)
            angle[k].append(degrees)
            print("seed %d, %s step: %.2f degrees, %d grains, mean speed %.1e m/s" % (seed, "half" if k else "own", degrees, grains, speed), flush=True)
    error = (sum(statistics.variance(a) for a in angle) / seeds) ** 0.5 if seeds > 1 else float("nan")
    print("mean %.2f and %.2f degrees; half the step adds %.2f, standard error %.2f" % (*map(statistics.mean, angle), statistics.mean(angle[1]) - statistics.mean(angle[0]), error))


main()
