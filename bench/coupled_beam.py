"""The notched beam three ways on one packing: python3 bench/coupled_beam.py BUILD OUT [SEEDS [AT ...]] [--faster N] [--seed K ...]

Particles alone (examples/notched_beam/particles.yaml), a fixed overlap, and elements that turn (adaptive.yaml) at each threshold AT
(0.5 0.6 0.7 0.8), for SEEDS (3) packings of the whole beam, of which the coupled bodies take what lies in their part. Same rate, own
step of each. --faster N: the whole history N times as fast, for all bodies alike. --seed K: only these. Cost: processor seconds of the whole run on
one thread (start, set-up, output too; a shared machine tells the same) and bonds advanced x steps. Writes OUT/coupled_beam.csv, .md and .png; runs that are already in OUT are not run again.
"""
import argparse, csv, json, os, re, resource, subprocess

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

HERE = os.path.dirname(os.path.abspath(__file__))
SCENES = os.path.join(HERE, "..", "examples", "notched_beam")


def cleave(build, *arguments):
    subprocess.run([os.path.join(build, "app", "cleave"), *arguments], check=True, stdout=subprocess.DEVNULL)


def run(build, out, name, scene, settings):
    where = os.path.join(out, name)
    if not os.path.exists(os.path.join(where, "processor.json")):
        sets = [word for s in settings for word in ("--set", s)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        cleave(build, "run", scene, "--output", where, "--threads", "1", "--no-plots", *sets)
        with open(os.path.join(where, "processor.json"), "w") as text:
            json.dump(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, text)
    return where


def squeezed(out, scene, faster):
    """The scene with every time in it divided by `faster`, and speeds multiplied."""
    if faster == 1:
        return os.path.join(SCENES, scene)
    with open(os.path.join(SCENES, scene)) as text:
        words = text.read()
    words = re.sub(r"([\d.]+) (ms|us)\b", lambda m: f"{float(m[1]) / faster:.9g} {m[2]}", words)
    words = re.sub(r"(-?[\d.]+) mm/s", lambda m: f"{float(m[1]) * faster:.9g} mm/s", words)
    words = re.sub(r"geometry: (\S+)", lambda m: "geometry: " + os.path.join(SCENES, m[1]), words)
    where = os.path.join(out, scene)
    with open(where, "w") as text:
        text.write(words)
    return where


def read(where):
    with open(os.path.join(where, "history.csv")) as lines:
        rows = list(csv.reader(lines))
    table = np.array(rows[1:], float)
    column = {name: table[:, k] for k, name in enumerate(rows[0])}
    cmod = 1e3 * (column["displacement(right lip).x[m]"] - column["displacement(left lip).x[m]"])
    force = -column["reaction(load).y[N]"]
    mean = np.convolve(force, np.ones(50) / 50, "valid")  # 50 rows, 1 ms: a swing of the arms
    with open(os.path.join(where, "summary.json")) as text:
        summary = json.load(text)
    with open(os.path.join(where, "processor.json")) as text:
        processor = json.load(text)
    turning = summary.get("switch") or {}
    return {
        "cmod": cmod, "force": force, "peak": mean.max(), "work": 1e3 * column["energy.fracture[J]"][-1], "ledger": np.abs(column["ledger_error[-]"]).max(),
        "particles": turning.get("particles_awake") or summary["plan"].get("particles"), "above": turning.get("bonds_above_strength", 0),
        "processor": processor, "bond steps": turning.get("bond_steps_of_this_call") or summary["plan"]["bonds"] * summary["run"]["steps"] * (summary["plan"].get("substeps") or 1),
    }


def main():
    words = argparse.ArgumentParser()
    words.add_argument("build")
    words.add_argument("out")
    words.add_argument("seeds", nargs="?", type=int, default=3)
    words.add_argument("at", nargs="*", default=["0.7", "0.5", "0.6", "0.8"])
    words.add_argument("--faster", type=float, default=1)
    words.add_argument("--seed", type=int, nargs="*")
    words = words.parse_args()
    build, out, thresholds = words.build, os.path.abspath(words.out), words.at
    os.makedirs(out, exist_ok=True)
    rows, curves = [], {}
    for seed in words.seed or range(1, words.seeds + 1):
        packed = os.path.join(out, f"packing{seed}")
        if not os.path.exists(os.path.join(packed, "packing.csv")):
            cleave(build, "pack", os.path.join(SCENES, "particles.yaml"), "--output", packed, "--set", f"bodies.beam.dem.packing.seed={seed}")
        packing = "bodies.beam.dem.packing={file: %s, trim: true}" % os.path.join(packed, "packing.csv")
        jobs = [(f"adaptive {at}", "adaptive.yaml", [packing, f"coupling.switch.at={at}"]) for at in thresholds]
        jobs += [("fixed overlap", "adaptive.yaml", [packing, "coupling.switch.when=never", "bodies.beam.dem.group=ligament"]), ("particles", "particles.yaml", [packing])]
        for name, scene, settings in jobs:
            result = read(run(build, out, f"{name.replace(' ', '_')}_{seed}", squeezed(out, scene, words.faster), settings))
            curves[name, seed] = result
            rows.append([seed, name, result])
    with open(os.path.join(out, "coupled_beam.csv"), "w") as text:
        text.write("seed,body,peak[N],fracture_work[mJ],particles,processor[s],bond_steps,bonds_above_strength,ledger_error\n")
        for seed, name, r in rows:
            text.write(f"{seed},{name},{r['peak']:.6g},{r['work']:.6g},{r['particles']},{r['processor']:.4g},{r['bond steps']:.4g},{r['above']},{r['ledger']:.2g}\n")
    with open(os.path.join(out, "coupled_beam.md"), "w") as text:
        text.write("| seed | body | peak [N] | | fracture work [mJ] | | particles | processor [s] | bond-steps | above strength | ledger |\n|---|---|---|---|---|---|---|---|---|---|---|\n")
        for seed, name, r in rows:
            whole = curves["particles", seed]
            text.write(f"| {seed} | {name} | {r['peak']:.1f} | {100 * (r['peak'] / whole['peak'] - 1):+.1f} % | {r['work']:.2f} | {100 * (r['work'] / whole['work'] - 1):+.1f} % "
                       f"| {r['particles']} | {r['processor']:.0f} | {r['bond steps']:.2e} | {r['above']} | {r['ledger']:.1e} |\n")
    figure, axis = plt.subplots(figsize=(7, 4.5))
    for (name, seed), r in curves.items():
        if seed == min(s for _, s in curves):
            axis.plot(r["cmod"], r["force"], label=name, lw=1)
    axis.set(xlabel="opening between the lips [mm]", ylabel="force [N]", title="one packing, three bodies")
    axis.legend()
    figure.savefig(os.path.join(out, "coupled_beam.png"), dpi=130, bbox_inches="tight")
    print(open(os.path.join(out, "coupled_beam.md")).read())


main()
