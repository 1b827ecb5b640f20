"""What a cut into a large block costs: python3 bench/large_block.py BUILD OUT [--scale 4] [--end 0.36] [--only [BODY ...]]

The block of examples/rock_cutting, `scale` times as long and high, particles, pick and cut as they are: particles alone (16 times as many at scale 4), particles
about the cut alone (scene.yaml), and elements that turn (adaptive.yaml), one packing, the pick at 2 m/s, up to END milliseconds. Cost is processor seconds on one
thread, of the whole run and of its set-up alone (the same run stopped after one step); their difference is stepping and output. --only without a body makes
the packing. Writes OUT/large_block.csv and .md; runs that are there are not run again.
"""
import argparse, csv, json, os, re, resource, subprocess

HERE = os.path.dirname(os.path.abspath(__file__))
SCENES = os.path.join(HERE, "..", "examples", "rock_cutting")
BODIES = {"particles": "particles alone", "scene": "particles about the cut", "adaptive": "elements that turn"}


def scaled(out, scale, end):
    """Scenes and geometries of the larger block in OUT."""
    for geo in ("block.geo", "adaptive.geo"):
        with open(os.path.join(SCENES, geo)) as text:
            words = re.sub(r"W = (\d+); H = (\d+);", lambda m: f"W = {int(m[1]) * scale}; H = {int(m[2]) * scale};", text.read())
        with open(os.path.join(out, geo), "w") as text:
            text.write(words)
    for body in BODIES:
        with open(os.path.join(SCENES, body + ".yaml")) as text:
            scene = text.read()
        scene = re.sub(r"time: \{end: [^}]*\}", "time: {end: %g ms}" % end, scene)
        scene = re.sub(r"velocity: \{x:.*", "velocity: {x: {table: [[0 ms, 0 m/s], [0.2 ms, 2 m/s]]}}", scene)
        scene = re.sub(r"every: 10 us", "every: 1 us", scene)
        scene = re.sub(r"every: 0.5 ms", "every: %g ms" % end, scene)
        scene = scene.replace("file: pick.geo", "file: " + os.path.join(SCENES, "pick.geo"))
        with open(os.path.join(out, body + ".yaml"), "w") as text:
            text.write(scene)


def run(build, out, body, sets, *more):
    """The run's directory and its processor seconds."""
    where = os.path.join(out, body + ("_setup" if more else ""))
    if not os.path.exists(os.path.join(where, "processor.json")):
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        subprocess.run([os.path.join(build, "app", "cleave"), "run", os.path.join(out, body + ".yaml"), "--output", where, "--threads", "1", "--no-plots", "--quiet", *sets, *more], check=not more, stdout=subprocess.DEVNULL)
        with open(os.path.join(where, "processor.json"), "w") as text:
            json.dump(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, text)
    with open(os.path.join(where, "processor.json")) as text:
        return where, json.load(text)


def main():
    words = argparse.ArgumentParser()
    words.add_argument("build")
    words.add_argument("out")
    words.add_argument("--scale", type=int, default=4)
    words.add_argument("--end", type=float, default=0.36, help="[ms]")
    words.add_argument("--only", nargs="*", default=list(BODIES))
    words = words.parse_args()
    build, out = words.build, os.path.abspath(words.out)
    os.makedirs(out, exist_ok=True)
    scaled(out, words.scale, words.end)
    packed = os.path.join(out, "packing")
    if not os.path.exists(os.path.join(packed, "packing.csv")):
        subprocess.run([os.path.join(build, "app", "cleave"), "pack", os.path.join(out, "particles.yaml"), "--output", packed], check=True, stdout=subprocess.DEVNULL)
    sets = ["--set", "bodies.block.dem.packing={file: %s, trim: true}" % os.path.join(packed, "packing.csv")]
    rows, whole = [], None
    for body in words.only:
        _, setup = run(build, out, body, sets, "--stop-after", "1")
        where, seconds = run(build, out, body, sets)
        with open(os.path.join(where, "summary.json")) as text:
            summary = json.load(text)
        with open(os.path.join(where, "history.csv")) as lines:
            table = list(csv.reader(lines))
        column = {key: [float(row[k]) for row in table[1:]] for k, key in enumerate(table[0])}
        force = [-f for f in column["force(pick).x[N]"]]
        turning = summary.get("switch") or {}
        stepping = seconds - setup
        whole = whole or stepping
        rows.append({"body": BODIES[body], "particles": turning.get("particles_awake") or summary["plan"]["particles"], "elements": summary["plan"].get("elements", 0), "steps": summary["run"]["steps"],
                     "substeps": summary["plan"].get("substeps") or 1, "bond-steps": turning.get("bond_steps_of_this_call") or summary["plan"]["bonds"] * summary["run"]["steps"] * (summary["plan"].get("substeps") or 1), "set-up [s]": setup, "stepping [s]": stepping,
                     "of particles alone": whole / stepping, "peak [kN/m]": 1e-3 * max(force), "fracture [J]": column["energy.fracture[J]"][-1], "ledger at the end": abs(column["ledger_error[-]"][-1])})
    if not rows:
        return
    with open(os.path.join(out, "large_block.csv"), "w", newline="") as text:
        table = csv.DictWriter(text, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
    with open(os.path.join(out, "large_block.md"), "w") as text:
        text.write("| " + " | ".join(rows[0]) + " |\n|" + " --- |" * len(rows[0]) + "\n")
        for row in rows:
            text.write("| " + " | ".join(f"{x:.3g}" if isinstance(x, float) else str(x) for x in row.values()) + " |\n")
    print(open(os.path.join(out, "large_block.md")).read())


main()
