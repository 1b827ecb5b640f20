"""Rock cut at three depths and three speeds: python3 bench/cutting_sweep.py BUILD OUT [DEPTHS in mm ... [-- SPEEDS in m/s ...]]

The scene of examples/rock_cutting with the tip of the pick at each depth (the cut of block.geo stays the same uncut face), and at 5 mm at each speed, over the same way.
Writes OUT/cutting_sweep.csv: mean and peak force, specific energy; runs that are there are not run again.
"""
import csv, os, re, subprocess, sys

HERE = os.path.dirname(os.path.abspath(__file__))
SCENES = os.path.join(HERE, "..", "examples", "rock_cutting")
sys.path.insert(0, SCENES)
from read_off import cut

WAY = 1.5e-3  # of the pick [m]


def main():
    build, out = sys.argv[1], os.path.abspath(sys.argv[2])
    words = sys.argv[3:]
    split = words.index("--") if "--" in words else len(words)
    depths = [float(x) for x in words[:split]] or [3, 5, 7]
    speeds = [float(x) for x in words[split + 1 :]] or [0.25, 0.5, 1]
    rows = []
    for depth, speed in [(d, 0.5) for d in depths] + [(5, v) for v in speeds if v != 0.5]:
        where = os.path.join(out, f"depth{depth:g}_speed{speed:g}")
        os.makedirs(where, exist_ok=True)
        with open(os.path.join(SCENES, "pick.geo")) as text:
            pick = re.sub(r"D = 5;", f"D = {depth:g};", text.read())
        with open(os.path.join(where, "pick.geo"), "w") as text:
            text.write(pick)
        end = 0.5e-3 + WAY / speed
        with open(os.path.join(SCENES, "scene.yaml")) as text:
            scene = text.read()
        scene = re.sub(r"time: \{end: [^}]*\}", "time: {end: %.6g ms}" % (1e3 * end), scene)
        scene = re.sub(r"velocity: \{x:.*", "velocity: {x: {table: [[0 ms, 0 m/s], [1 ms, %g m/s], [%.6g ms, %g m/s]]}}" % (speed, 1e3 * end + 1, speed), scene)
        scene = scene.replace("geometry: block.geo", "geometry: " + os.path.join(SCENES, "block.geo")).replace("work(pick)", "work(pick), displacement(pick)")
        with open(os.path.join(where, "scene.yaml"), "w") as text:
            text.write(scene)
        if not os.path.exists(os.path.join(where, "run", "summary.json")):
            subprocess.run([os.path.join(build, "app", "cleave"), "run", "scene.yaml", "--output", "run", "--threads", "1", "--no-plots"], cwd=where, check=True, stdout=subprocess.DEVNULL)
        r = cut(os.path.join(where, "run"), 1, 1e-3 * depth)
        rows.append([depth, speed, r["mean"], r["peak"], 1e-6 * r["specific"]])
        print("depth %g mm, speed %g m/s: mean %.4g N/m, peak %.4g N/m, specific energy %.4g MPa" % tuple(rows[-1]), flush=True)
    with open(os.path.join(out, "cutting_sweep.csv"), "w", newline="") as text:
        csv.writer(text).writerows([["depth[mm]", "speed[m/s]", "mean[N/m]", "peak[N/m]", "specific_energy[MPa]"], *rows])


main()
