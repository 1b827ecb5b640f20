"""Rock cut at several depths, speeds and sizes: python3 bench/cutting_sweep.py BUILD OUT [depths | speeds | sizes ...] [--way MM] [--depths MM ...] [--seeds N]

The block of examples/rock_cutting, `way` (10 mm) of the pick from the first touch. depths: 2, 3.5 and 5 mm with elements and with particles alone, the same packings, three of
them; speeds: 1, 2 and 4 m/s at 5 mm; sizes: block, pick and particles smaller by 1, 3 and 10 (way too), the rock's fracture energies as they are: what a
shallow cut costs with as many particles in its depth. First blow: the largest force in the first 0.3 mm of way. Specific energy is over the volume the pick sweeps; beside it over the compressive strength of the
Mohr-Coulomb material, 2c(sqrt(1 + mu^2) + mu); processor seconds are of the whole run on one thread. Writes OUT/cutting_sweep.csv and .md; runs that are there are not run again.
"""
import argparse, csv, json, math, os, re, resource, subprocess, sys

HERE = os.path.dirname(os.path.abspath(__file__))
SCENES = os.path.join(HERE, "..", "examples", "rock_cutting")
sys.path.insert(0, SCENES)
from read_off import cut

GAP = 0.2e-3  # between pick and block [m]
BLOW = 0.3e-3  # of the pick's way from the first touch, block of full size: before the first piece is thrown off [m]
UCS = 2 * 8e6 * (math.hypot(1, 0.9) + 0.9)
COLUMNS = "series", "body", "depth[mm]", "speed[m/s]", "seed", "particles", "mean[N/m]", "first blow[N/m]", "peak[N/m]", "specific energy[MPa]", "over UCS", "ledger_error", "processor[s]"


def cases(wanted, depths, seeds):
    if "depths" in wanted:
        for seed in range(1, seeds + 1):
            for depth in depths:
                for body in ("scene", "particles"):
                    yield "depths", body, depth, 2, seed, 1
    if "speeds" in wanted:
        for speed in (1, 2, 4):
            yield "speeds", "scene", 5, speed, 1, 1
    if "sizes" in wanted:
        for size in (1, 3, 10):
            yield "sizes", "scene", 5, 2, 1, size


def run(build, out, way, body, depth, speed, seed, size):
    where = os.path.join(out, f"{body}_{depth:g}_{speed:g}_{seed}_{size}")
    os.makedirs(where, exist_ok=True)
    ramp = 0.2e-3 / size  # in which the pick gains its speed [s]
    end = (way + GAP) / size / speed + 0.5 * ramp
    with open(os.path.join(SCENES, "pick.geo")) as text:
        pick = text.read().replace("D = 5;", f"D = {depth:g};")
    with open(os.path.join(where, "pick.geo"), "w") as text:
        text.write(pick)
    with open(os.path.join(SCENES, body + ".yaml")) as text:
        scene = text.read()
    scene = re.sub(r"time: \{end: [^}]*\}", "time: {end: %.6g us}" % (1e6 * end), scene)
    scene = re.sub(r"velocity: \{x:.*", "velocity: {x: {table: [[0 us, 0 m/s], [%.6g us, %g m/s]]}}" % (1e6 * ramp, speed), scene)
    scene = re.sub(r"every: 10 us", "every: %.6g us" % (10 / size), scene)
    scene = re.sub(r"every: 0.5 ms", "every: %.6g us" % (1e6 * end / 5), scene)
    scene = scene.replace("geometry: block.geo", "geometry: " + os.path.join(SCENES, "block.geo")).replace("length_unit: 1 mm", "length_unit: %.9g um" % (1e3 / size)).replace("radius: 0.5 mm", "radius: %.9g um" % (500 / size))
    scene = scene.replace("seed: 1", f"seed: {seed}")
    if body == "scene" and size == 1:  # the packing that the particles alone have
        packed = os.path.join(out, f"packing_{seed}")
        if not os.path.exists(os.path.join(packed, "packing.csv")):
            subprocess.run([os.path.join(build, "app", "cleave"), "pack", os.path.join(SCENES, "particles.yaml"), "--output", packed, "--set", f"bodies.block.dem.packing.seed={seed}"], check=True, stdout=subprocess.DEVNULL)
        scene = re.sub(r"packing: \{[^}]*\}", "packing: {file: %s, trim: true}" % os.path.join(packed, "packing.csv"), scene)
    with open(os.path.join(where, "scene.yaml"), "w") as text:
        text.write(scene)
    if not os.path.exists(os.path.join(where, "processor.json")):
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        subprocess.run([os.path.join(build, "app", "cleave"), "run", "scene.yaml", "--output", "run", "--threads", "1", "--no-plots", "--quiet"], cwd=where, check=True, stdout=subprocess.DEVNULL)
        with open(os.path.join(where, "processor.json"), "w") as text:
            json.dump(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, text)
    with open(os.path.join(where, "processor.json")) as text:
        processor = json.load(text)
    with open(os.path.join(where, "run", "summary.json")) as text:
        summary = json.load(text)
    with open(os.path.join(where, "run", "history.csv")) as lines:
        table = list(csv.reader(lines))
    k = table[0].index("ledger_error[-]")
    r = cut(os.path.join(where, "run"), 1, 1e-3 * depth / size)
    column = {name: [float(row[i]) for row in table[1:]] for i, name in enumerate(table[0])}
    first = max(-f for t, f in zip(column["time[s]"], column["force(pick).x[N]"]) if t < r["touch"] + BLOW / size / speed)
    return [summary["plan"]["particles"], r["mean"], first, r["peak"], 1e-6 * r["specific"], r["specific"] / UCS, max(abs(float(row[k])) for row in table[1:]), processor]


def main():
    words = argparse.ArgumentParser()
    words.add_argument("build")
    words.add_argument("out")
    words.add_argument("series", nargs="*", default=["depths", "speeds", "sizes"])
    words.add_argument("--way", type=float, default=10, help="[mm]")
    words.add_argument("--depths", type=float, nargs="*", default=[2, 3.5, 5], help="[mm]")
    words.add_argument("--seeds", type=int, default=3)
    words = words.parse_args()
    build, out = os.path.abspath(words.build), os.path.abspath(words.out)
    os.makedirs(out, exist_ok=True)
    rows = []
    for series, body, depth, speed, seed, size in cases(words.series, words.depths, words.seeds):
        rows.append([series, {"scene": "elements too", "particles": "particles"}[body], depth / size, speed, seed, *run(build, out, 1e-3 * words.way, body, depth, speed, seed, size)])
        print("  ".join(f"{x:.4g}" if isinstance(x, float) else str(x) for x in rows[-1]), flush=True)
    with open(os.path.join(out, "cutting_sweep.csv"), "w", newline="") as text:
        csv.writer(text).writerows([COLUMNS, *rows])
    with open(os.path.join(out, "cutting_sweep.md"), "w") as text:
        text.write("| " + " | ".join(COLUMNS) + " |\n|" + " --- |" * len(COLUMNS) + "\n")
        for row in rows:
            text.write("| " + " | ".join(f"{x:.3g}" if isinstance(x, float) else str(x) for x in row) + " |\n")


main()
