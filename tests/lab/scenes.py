"""The laboratory's scenes as `cleave new` writes them, run and judged; and their peaks against the loading rate.

scenes.py CLEAVE FOLDER KIND...          runs the scenes and asserts what they must show
scenes.py CLEAVE FOLDER rates CSV KIND... runs each at 2, 1 and 1/2 of its rate: the shipped peak within 2 % of the slower one
"""
import csv
import json
import math
import os
import re
import subprocess
import sys

PEAK = {"ucs": ("reaction(top).z", math.pi * 0.025**2), "triaxial": ("reaction(top).z", math.pi * 0.025**2), "direct-tension": ("reaction(zmax).z", 0.03**2),
        "brazilian": ("reaction(upper).y", math.pi * 0.05 * 0.025 / 2), "bending": ("reaction(load).y", 0.02 * 0.02**2 / (1.5 * 0.08))}  # force / this = stress


def check(ok, *what):
    if not ok:
        sys.exit("FAILED: " + " ".join(map(str, what)))


def columns(path):
    with open(path) as f:
        rows = list(csv.reader(f))
    return {name.split("[")[0]: [float(r[i] or "nan") for r in rows[1:]] for i, name in enumerate(rows[0])}


def run(cleave, folder, kind, rate=1.0):
    """The scene of this kind, velocities times rate and times over rate. Returns history, summary and directory."""
    os.makedirs(folder, exist_ok=True)
    scene = os.path.join(folder, f"{kind}-{rate:g}.yaml")
    for old in (scene, os.path.join(folder, kind + ".geo")):
        if os.path.exists(old):
            os.remove(old)
    subprocess.run([cleave, "new", kind, scene], check=True, stdout=subprocess.DEVNULL)
    with open(scene) as f:
        text = f.read()
    text = re.sub(r"([-0-9.]+) (mm/s)", lambda m: f"{float(m[1]) * rate:.9g} {m[2]}", text)
    text = re.sub(r"([0-9.]+) (ms|us)\b", lambda m: f"{float(m[1]) / rate:.9g} {m[2]}", text)
    with open(scene, "w") as f:
        f.write(text[:text.index("  plots:")])  # the last section; only numbers are read here
    out = os.path.join(folder, f"{kind}-{rate:g}")
    subprocess.run([cleave, "run", scene, "--output", out, "--threads", "1", "--no-plots"], check=True, stdout=subprocess.DEVNULL)
    with open(os.path.join(out, "summary.json")) as f:
        return columns(os.path.join(out, "history.csv")), json.load(f), out


def strength(kind, history):
    column, area = PEAK[kind]
    force = [abs(v) for v in history[column]]
    return max(force) / area, force


def judge(kind, history, summary, out):
    peak, force = strength(kind, history)
    at = force.index(max(force))
    print(f"{kind}: peak {peak * 1e-6:.2f} MPa at {history['time'][at] * 1e3:.2f} ms, last/peak {force[-1] / force[at]:.2f}, ledger {max(history['ledger_error']):.1e}, stepping {summary['seconds']['stepping']:.0f} s")
    check(max(history["ledger_error"]) < 0.01, kind, "ledger")
    check(force[-1] < (0.97 if kind == "triaxial" else 0.5) * force[at], kind, "did not break")  # under pressure what is broken still holds
    check(not any("too fast" in w for w in summary.get("warnings", [])), kind, summary.get("warnings"))
    if kind == "direct-tension":
        check(abs(peak / 5e6 - 1) < 0.02, "tensile strength", peak)
    if kind == "brazilian":
        with open(os.path.join(out, "cracks.csv")) as f:
            rows = list(csv.DictReader(f))
        open_ = [(float(r["x[m]"]), float(r["y[m]"]), float(r["area[m2]"]) * abs(float(r["normal.x[-]"]))) for r in rows if r["mode"] == "tension" and float(r["broken[-]"]) > 0.5]
        middle = sum(a for x, y, a in open_ if abs(x) < 0.005 and abs(y) < 0.02) / (0.04 * 0.025)
        print(f"  2P/(pi D t) / tensile strength {peak / 5e6:.3f}; tensile crack through the middle over {middle:.2f} of 0.8 D, all within 5 mm of the load line: {sum(a for x, y, a in open_ if abs(x) < 0.005) / sum(a for x, y, a in open_):.2f}")
        check(middle > 0.95, "the disc did not split", middle)
        check(abs(peak / 5e6 - 1) < 0.1, "splitting strength", peak)
    if kind == "triaxial":
        s, e = history["gauge.stress.z"], history["gauge.strain.z"]
        t = history["time"]
        rest = min(range(len(t)), key=lambda i: abs(t[i] - 2e-3 * t[-1] / 19.6e-3))
        a, b = (min(range(len(t)), key=lambda i: abs(t[i] - x * t[-1] / 19.6e-3)) for x in (5.3e-3, 6e-3))
        unloading = (s[a] - s[b]) / (e[a] - e[b])  # at constant side pressure: Young's modulus
        print(f"  at rest stress {[round(history['gauge.stress.' + c][rest] * -1e-6, 2) for c in 'xyz']} MPa, unloading modulus {unloading * 1e-9:.2f} GPa")
        check(all(abs(history["gauge.stress." + c][rest] / -10e6 - 1) < 0.02 for c in "xyz"), "hydrostatic state")
        check(abs(unloading / 30e9 - 1) < 0.05, "unloading modulus", unloading)
    return peak


def main():
    cleave, folder, what = os.path.abspath(sys.argv[1]), sys.argv[2], sys.argv[3:]
    if what[0] == "rates":
        with open(what[1], "w") as f:
            f.write("scene,rate,peak_MPa,unbalanced_ok\n")
            for kind in what[2:]:
                peaks = {}
                for rate in (2, 1, 0.5):
                    history, summary, _ = run(cleave, folder, kind, rate)
                    peaks[rate] = strength(kind, history)[0]
                    f.write(f"{kind},{rate},{peaks[rate] * 1e-6:.5g},{int(not any('too fast' in w for w in summary.get('warnings', [])))}\n")
                    f.flush()
                print(kind, {r: round(p * 1e-6, 3) for r, p in peaks.items()}, flush=True)
                check(abs(peaks[1] / peaks[0.5] - 1) < 0.02, kind, "shipped rate is too fast:", peaks)
        return
    peaks = {kind: judge(kind, *run(cleave, folder, kind)) for kind in what}
    if "ucs" in peaks and "triaxial" in peaks:
        check(peaks["triaxial"] > 1.2 * peaks["ucs"], "confinement does not strengthen", peaks)


main()
