"""Time that `cleave check --measure` foresees against the time the run takes, within 30 %.  python3 duration.py CLEAVE SOURCE_TREE

Each scene is measured before and after its run, on one thread, and the run held against the mean: a machine that is busy for a while
is busy for all three. Runs last some ten seconds, so that starting does not decide.
"""
import os
import re
import subprocess
import sys
import tempfile
import time

CLEAVE, SOURCE = sys.argv[1], sys.argv[2]
SCENES = [
    ("particles", "examples/elastic_cylinder/scene.yaml", ["time.end=10 ms"]),
    ("elements, explicit", "examples/wave_in_a_bar/scene.yaml", ["time.end=40 ms", "output.fields.every=1 ms"]),
    ("elements, static", "examples/thick_sphere/scene.yaml", []),
    ("coupled", "examples/notched_beam/scene.yaml", ["time.end=0.4 ms"]),
]
wrong = []
for name, scene, sets in SCENES:
    words = [os.path.join(SOURCE, scene), "--threads", "1"] + [w for s in sets for w in ("--set", s)]

    def foreseen():
        said = subprocess.run([CLEAVE, "check", *words, "--measure"], capture_output=True, text=True, check=True).stdout
        return float(re.search(r"takes +about ([0-9.e+]+) s", said).group(1))

    with tempfile.TemporaryDirectory() as here:
        before = foreseen()
        start = time.monotonic()
        subprocess.run([CLEAVE, "run", *words, "--output", os.path.join(here, "out")], stdout=subprocess.DEVNULL, check=True)
        took = time.monotonic() - start
        ratio = 0.5 * (before + foreseen()) / took
    print("%-20s foreseen %6.1f s (before), took %6.1f s, ratio %.2f" % (name, before, took, ratio))
    if not 0.7 <= ratio <= 1.3:
        wrong.append(name)
if wrong:
    sys.exit("not within 30 %: " + ", ".join(wrong))
