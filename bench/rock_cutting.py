"""A cut up to its first chip, with the elements beginning ever deeper: python3 bench/rock_cutting.py BUILD OUT [SEEDS]

The block of examples/rock_cutting on one packing: particles that reach 1, 2 and 4 cut depths below the cut, and particles alone, these at 0.9 and at 0.89 of the critical step. Compares
the pick's force from the first touch to the peak, where the first chip starts to break, and to where it is off (a third of the peak). Writes OUT/rock_cutting.csv, .md and .png.
"""
import csv, json, os, subprocess, sys

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

HERE = os.path.dirname(os.path.abspath(__file__))
SCENES = os.path.join(HERE, "..", "examples", "rock_cutting")
BODIES = [("1 depth", "scene.yaml", "near"), ("2 depths", "scene.yaml", "near 2"), ("4 depths", "scene.yaml", "near 4"), ("particles", "particles.yaml", None),
          ("particles at another step", "particles.yaml", None)]  # the last against the one before it: what the history says of itself
END = "1.6 ms"
GRID = np.linspace(0, 1.6e-3, 161)


def cleave(build, *arguments):
    subprocess.run([os.path.join(build, "app", "cleave"), *arguments], check=True, stdout=subprocess.DEVNULL)


def main():
    build, out = sys.argv[1], os.path.abspath(sys.argv[2])
    rows = []
    for seed in range(1, (int(sys.argv[3]) if len(sys.argv) > 3 else 1) + 1):
        packed = os.path.join(out, f"packing{seed}")
        if not os.path.exists(os.path.join(packed, "packing.csv")):
            cleave(build, "pack", os.path.join(SCENES, "particles.yaml"), "--output", packed, "--set", f"bodies.block.dem.packing.seed={seed}")
        found = {}
        for name, scene, group in BODIES:
            where = os.path.join(out, f"{name.replace(' ', '_')}_{seed}")
            if not os.path.exists(os.path.join(where, "summary.json")):
                sets = ["--set", f"time.end={END}", "--set", "bodies.block.dem.packing={file: %s, trim: true}" % os.path.join(packed, "packing.csv")]
                if "step" in name:
                    sets += ["--set", "time.safety=0.89"]
                cleave(build, "run", os.path.join(SCENES, scene), "--output", where, "--threads", "1", *sets, *(["--set", f"bodies.block.dem.group={group}"] if group else []))
            with open(os.path.join(where, "history.csv")) as lines:
                table = list(csv.reader(lines))
            column = {key: np.array([float(row[k]) for row in table[1:]]) for k, key in enumerate(table[0])}
            with open(os.path.join(where, "summary.json")) as text:
                summary = json.load(text)
            found[name] = {"force": -np.interp(GRID, column["time[s]"], column["force(pick).x[N]"]), "ledger": np.abs(column["ledger_error[-]"]).max(),
                           "particles": summary["plan"]["particles"], "stepping": summary["seconds"]["stepping"]}
        whole = found["particles"]["force"]
        top = int(np.argmax(whole))
        chip = top + int(np.argmax(whole[top:] < whole[top] / 3))
        touch = int(np.argmax(whole > 0))
        for name, r in found.items():
            rms = [np.sqrt(np.mean((r["force"][touch : end + 1] - whole[touch : end + 1]) ** 2)) / whole[top] for end in (top, chip)]
            rows.append([seed, name, r["particles"], r["force"][: chip + 1].max(), *rms, r["ledger"], r["stepping"]])
            if seed == 1:
                plt.plot(1e3 * GRID[touch : 2 * chip - touch], 1e-3 * r["force"][touch : 2 * chip - touch], lw=1, label=name)
    with open(os.path.join(out, "rock_cutting.csv"), "w") as text:
        text.write("seed,body,particles,peak[N],rms/peak to the peak,rms/peak to the chip,ledger_error,stepping[s]\n")
        for row in rows:
            text.write(",".join(f"{x:.6g}" if isinstance(x, float) else str(x) for x in row) + "\n")
    with open(os.path.join(out, "rock_cutting.md"), "w") as text:
        text.write("| seed | particles reach | particles | peak [kN/m] | RMS difference / peak: to the peak | to the chip | ledger | stepping [s] |\n|---|---|---|---|---|---|---|---|\n")
        for seed, name, particles, peak, start, whole, ledger, stepping in rows:
            text.write(f"| {seed} | {name} | {particles} | {1e-3 * peak:.2f} | {100 * start:.2f} % | {100 * whole:.2f} % | {ledger:.1e} | {stepping:.0f} |\n")
    plt.xlabel("time [ms]")
    plt.ylabel("force along the cut [kN/m]")
    plt.legend()
    plt.savefig(os.path.join(out, "rock_cutting.png"), dpi=130, bbox_inches="tight")
    print(open(os.path.join(out, "rock_cutting.md")).read())


main()
