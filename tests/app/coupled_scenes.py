"""Scenes over an overlap as they are shipped: closed forms of one dimension, the ledger term by term, probes and strains across events.

coupled_scenes.py CLEAVE SOURCE
"""
import csv
import json
import os
import subprocess
import sys
import tempfile

import numpy

CLEAVE, SOURCE = sys.argv[1:3]
EXAMPLES = os.path.join(SOURCE, "examples")
TERMS = ("kinetic", "strain", "fracture", "friction", "damping", "coupling", "contact")


def check(ok, *what):
    if not ok:
        sys.exit("FAILED: " + " ".join(map(str, what)))


def run(scene, out, *settings):
    words = [word for s in settings for word in ("--set", s)]
    done = subprocess.run([CLEAVE, "run", os.path.join(EXAMPLES, scene), "--output", out, "--threads", "1", "--no-plots", "--quiet", *words], capture_output=True, text=True)
    check(done.returncode == 0, scene, "ended with", done.returncode, done.stdout[-1000:], done.stderr[-1000:])
    return out


def table(out, name="history.csv"):
    with open(os.path.join(out, name)) as file:
        rows = list(csv.reader(file))
    words = ("mode", "asked_by")
    return {key.split("[")[0]: numpy.array([0 if key in words else float(row[k] or "nan") for row in rows[1:]]) for k, key in enumerate(rows[0])}


def numbers(kind, out):
    """What read_off.py prints: a list of (got, closed form)."""
    done = subprocess.run([sys.executable, os.path.join(EXAMPLES, "overlap", "read_off.py"), kind, out], capture_output=True, text=True)
    check(done.returncode == 0, done.stderr)
    print(kind + ":", done.stdout.strip().replace("\n", "; "))
    return [tuple(float(x) for x in line.rsplit(":", 1)[1].replace(", in one dimension", "").split()) for line in done.stdout.strip().split("\n")]


def ledger(name, out, seen):
    """The columns alone say the same as ledger_error; without any one large term they would not."""
    h = table(out)
    terms = {t: h["energy." + t] for t in TERMS}
    work = h["energy.work"]
    first = sum(terms[t][0] for t in TERMS) - work[0]
    scale = numpy.maximum.accumulate(numpy.abs(work)) + first

    def error(parts, done):
        return numpy.abs(sum(parts.values()) - done - first) / numpy.maximum(scale, 1e-3 * scale[-1])

    clean = error(terms, work)
    last = scale > 0.3 * scale[-1]
    check(h["ledger_error"].max() < 0.01, name, "ledger error", h["ledger_error"].max())
    check(clean[last].max() < 0.01, name, "the columns' own error", clean[last].max())
    for t in (*TERMS, "work"):
        parts = {k: (0 * v if k == t else v) for k, v in terms.items()}
        if error(parts, work * (0 if t == "work" else 1))[last].max() > 0.01:
            seen.add(t)
    print("%-12s ledger error %.1e" % (name, h["ledger_error"].max()))


def above(name, out):
    with open(os.path.join(out, "summary.json")) as file:
        switch = json.load(file)["switch"]
    check(switch["events"] > 1 and switch["bonds_above_strength"] == 0, name, switch)
    return switch


with tempfile.TemporaryDirectory() as folder:
    def place(name):
        return os.path.join(folder, name)

    seen = set()
    for (got, want), part in zip(numbers("impact", run("overlap/impact.yaml", place("impact"))), (0.01, 0.01, 0.01)):
        check(abs(got / want - 1) < part, "impact", got, want)
    (crest, c1), (arrival, t1), (back, _) = numbers("wave", run("overlap/wave.yaml", place("wave")))
    check(abs(crest / c1 - 1) < 0.015 and abs(arrival - t1) <= 1 and back < 1e-4, "wave", crest, arrival, back)

    # Elements turn where the wave comes back; a probe there goes on in particles,.
    probes = ["output.probes={p: {at: [121 mm, 6 mm], quantities: [displacement, velocity, stress]}}"]
    out = run("overlap/spall.yaml", place("spall"), probes[0])
    (got, want), _ = numbers("spall", out)
    check(abs(got - want) < 3, "spall plane", got, want)  # an element
    switch = above("spall", out)
    h = table(out)
    check(all(numpy.isfinite(h[k]).all() for k in h), "a column has no number")
    u, v, t = h["displacement(p).x"], h["velocity(p).x"], h["time"]
    drift = numpy.abs(u[1:] - u[:-1] - 0.5 * (v[1:] + v[:-1]) * (t[1:] - t[:-1])).max()
    check(drift < 0.02 * numpy.abs(u).max(), "the probe jumps", drift, numpy.abs(u).max())
    print("probe: %d events, largest jump of the displacement against its velocity %.1e of it; stress from %.3g to %.3g MPa" % (switch["events"], drift / numpy.abs(u).max(), 1e-6 * h["stress(p).xx"].min(), 1e-6 * h["stress(p).xx"].max()))
    check(abs(h["stress(p).xx"].min() + 21.75e6) < 1.5e6, "the probe's pressure", h["stress(p).xx"].min())  # 1.5 MPa/us x 58 mm / c: the rise less itself come back

    out = run("overlap/plate.yaml", place("plate"))
    (got, want), = numbers("plate", out)
    check(8.43 - 0.8 < got < 12.65 + 0.8, "plate", got)  # all of 8.43 to 12.65 mm fail at one instant, within a particle
    out = run("rock_cutting/adaptive.yaml", place("cutting"), "time.end=1.25 ms", "output.fields.every=1 s", "output.history.every=2 us")
    above("cutting", out)
    h = table(out, "switches.csv")
    check(numpy.allclose(h["contact_before"], h["contact_after"], rtol=1e-9), "an event changes what touches")
    for name in ("impact", "wave", "spall", "plate", "cutting"):
        ledger(name, place(name), seen)
    missing = {"kinetic", "strain", "fracture", "contact", "work"} - seen
    check(not missing, "leaving these out goes unnoticed:", missing)  # the rest: tests/coupling/test_switch_tools.c
