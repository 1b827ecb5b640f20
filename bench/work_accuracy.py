"""Run time against error, mesh, particle and step size swept: python3 bench/work_accuracy.py BUILD OUT [CASE ...]

Cases: fem_static fem_wave dem_wave dem_fracture coupled_wave coupled_beam (all). Each point is one `cleave run` of a whole scene, on
one thread, with its start, set-up and output; seconds are the processor's, so a machine shared with others tells the same. Runs
that are in OUT already are not run again. Writes OUT/work_accuracy.csv and .md and a picture per case; points on the front, which no
other beats in time and error both, are marked.
"""
import csv
import json
import os
import resource
import subprocess
import sys

import h5py
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

HERE = os.path.dirname(os.path.abspath(__file__))
EXAMPLES = os.path.join(HERE, "..", "examples")
PULSE = ", ".join("[%.10g us, %.10g MPa]" % (t, np.sin(np.pi * t / 100) ** 2) for t in np.linspace(0, 100, 101))
C, RHO, LENGTH = 4000.0, 2400.0, 2.0  # of the bars


def run(cleave, out, name, scene, sets=()):
    """The results' directory and the run's processor time [s]."""
    where = os.path.join(out, name)
    if not os.path.exists(os.path.join(where, "cpu.json")):
        words = [w for s in sets for w in ("--set", s)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([cleave, "run", scene, "--output", where, "--threads", "1", "--no-plots", "--quiet", *words], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        with open(os.path.join(where, "cpu.json"), "w") as f:
            json.dump(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, f)
    with open(os.path.join(where, "cpu.json")) as f:
        return where, json.load(f)


def history(where):
    with open(os.path.join(where, "history.csv")) as lines:
        rows = list(csv.reader(lines))
    table = np.array(rows[1:], float)
    return {name: table[:, k] for k, name in enumerate(rows[0])}


def scene(out, name, text):
    os.makedirs(out, exist_ok=True)
    path = os.path.join(out, name + ".yaml")
    with open(path, "w") as f:
        f.write(text)
    return path


# ---- elements at rest: hollow sphere under pressure, Lame; error of all nodes' displacement, root mean square over that of the solution ----


def lame(points):
    a, b, p, young, nu = 1.0, 2.0, 1e6, 1e9, 0.3
    r = np.linalg.norm(points, axis=1)
    u = p * a**3 / (b**3 - a**3) / young * ((1 - 2 * nu) * r + (1 + nu) * b**3 / (2 * r**2))
    return points * (u / r)[:, None]


def fem_static(cleave, out):
    for order, sizes in ((1, (0.3, 0.2, 0.13, 0.09)), (2, (0.6, 0.45, 0.3, 0.2))):
        for size in sizes:
            where, seconds = run(cleave, out, f"fem_static_{order}_{size}", os.path.join(EXAMPLES, "thick_sphere", "scene.yaml"),
                                 [f"bodies.sphere.mesh={{cells: tet, order: {order}, size: {size} m}}", "output.fields.names=[displacement]", "output.probes={inner: {at: [1 m, 0 m, 0 m]}}", "output.history.quantities=[reaction(x0)]"])
            with h5py.File(os.path.join(where, "fields.h5")) as fields:
                block = fields["frames"][sorted(fields["frames"])[-1]]["fem"]
                points, u = block["points"][:], block["point_data/displacement"][:]
            exact = lame(points)
            yield f"tet{(0, 4, 10)[order]}", "%g m" % size, len(points), seconds, np.sqrt(np.sum((u - exact) ** 2) / np.sum(exact**2))


# ---- a pulse in a bar with a free end: error of that end's velocity, root mean square over the peak ----

BAR = """\
dimension: 2
plane: stress
thickness: 100 mm
time: {end: 0.65 ms, method: explicit}
materials: {concrete: {density: 2400 kg/m3, young: 38.4 GPa, poisson: 0}}
conditions:
  - {group: %s, traction: {x: {table: [""" + PULSE + """]}}}
output: {history: {every: 2 us, quantities: ["displacement(%s)"]}}
"""
BOX = "bodies: {bar: {geometry: {box: {size: [2 m, 100 mm]}}, material: concrete, "


def pulse_error(where, group):
    h = history(where)
    t, u = h["time[s]"], h[f"displacement({group}).x[m]"]
    late = np.clip(t - LENGTH / C, 0, 1e-4)
    exact = 2 / (RHO * C) * 1e6 * (late / 2 - 1e-4 / (4 * np.pi) * np.sin(2 * np.pi * late / 1e-4))  # the displacement: integral of 2 p / rho c
    return np.sqrt(np.mean((u - exact) ** 2)) / exact[-1]


def fem_wave(cleave, out):
    text = BAR % ("xmin", "xmax")
    for cells, order in (("quad", 1), ("quad", 2)):
        for size in (40, 20, 10, 5) if order == 1 else (80, 40, 20, 10):
            for safety in (0.9, 0.45):
                path = scene(out, f"fem_wave_{order}", text + BOX + "method: fem, mesh: {cells: %s, order: %d, size: 10 mm}}}\n" % (cells, order))
                where, seconds = run(cleave, out, f"fem_wave_{order}_{size}_{safety}", path, [f"bodies.bar.mesh.size={size} mm", f"time.safety={safety}"])
                yield f"quad{4 * order}, {safety} of the step", "%g mm" % size, size, seconds, pulse_error(where, "xmax")


def dem_wave(cleave, out):
    path = scene(out, "dem_wave", BAR % ("xmin", "xmax") + BOX + "method: dem, dem: {packing: {radius: 10 mm, spread: 0.2, seed: 1}}}}\n")
    for radius in (10, 7, 5, 3.5, 2.5):
        for safety in (0.9, 0.45):
            where, seconds = run(cleave, out, f"dem_wave_{radius}_{safety}", path, [f"bodies.bar.dem.packing.radius={radius} mm", f"time.safety={safety}"])
            yield f"particles, {safety} of the step", "radius %g mm" % radius, radius, seconds, pulse_error(where, "xmax")


GEO = """\
// 2 m x 0.1 m, its middle fifth particles
h = %g; L = 2; H = 0.1; a = 0.8; b = 1.2;
Point(1) = {0, 0, 0}; Point(2) = {a, 0, 0}; Point(3) = {b, 0, 0}; Point(4) = {L, 0, 0};
Point(5) = {L, H, 0}; Point(6) = {b, H, 0}; Point(7) = {a, H, 0}; Point(8) = {0, H, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 8}; Line(8) = {8, 1}; Line(9) = {2, 7}; Line(10) = {3, 6};
Curve Loop(1) = {1, 9, 7, 8}; Plane Surface(1) = {1};
Curve Loop(2) = {2, 10, 6, -9}; Plane Surface(2) = {2};
Curve Loop(3) = {3, 4, 5, -10}; Plane Surface(3) = {3};
Transfinite Curve{1, 7, 3, 5} = a/h + 1; Transfinite Curve{2, 6} = (b - a)/h + 1; Transfinite Curve{8, 9, 10, 4} = H/h + 1;
Transfinite Surface{1, 2, 3}; Recombine Surface{1, 2, 3};
Physical Surface("arms") = {1, 3}; Physical Surface("middle") = {2};
Physical Curve("sent") = {8}; Physical Curve("end") = {4};
"""


def coupled_wave(cleave, out):
    for size in (50, 25, 12.5):
        for ratio in (8, 4):  # element edge over radius
            geo = f"coupled_wave_{size}.geo"
            os.makedirs(out, exist_ok=True)
            with open(os.path.join(out, geo), "w") as f:
                f.write(GEO % (1e-3 * size))
            path = scene(out, f"coupled_wave_{size}_{ratio}", BAR % ("sent", "end") + "coupling: {width: 2 elements}\nbodies: {bar: {geometry: %s, length_unit: 1 m, method: coupled, material: concrete, dem: {group: middle, packing: {radius: %g mm, spread: 0.2, seed: 1}}}}\n" % (geo, size / ratio))
            where, seconds = run(cleave, out, f"coupled_wave_{size}_{ratio}", path)
            yield f"element / radius = {ratio}", "h = %g mm" % size, size, seconds, pulse_error(where, "end")


# ---- a plate of particles torn apart: peak over strength, fracture energy over G_f x section, both against 1 ----


def dem_fracture(cleave, out):
    text = """\
dimension: 2
plane: stress
thickness: 10 mm
time: {end: 6 ms}
materials:
  rock: {density: 2500 kg/m3, young: 30 GPa, poisson: 0.2, law: cohesive, tensile_strength: 5 MPa, fracture_energy: 60 J/m2, local_damping: 0.3}
bodies: {bar: {geometry: {box: {size: [80 mm, 30 mm]}}, method: dem, material: rock, dem: {packing: {radius: 2 mm, spread: 0.2, seed: 1}}}}
conditions:
  - {group: xmin, velocity: {x: {ramp: {to: -6 mm/s, over: 1 ms}}, y: 0 m/s}}
  - {group: xmax, velocity: {x: {ramp: {to: 6 mm/s, over: 1 ms}}, y: 0 m/s}}
output: {history: {every: 5 us, quantities: [reaction(xmax)]}}
"""
    path = scene(out, "dem_fracture", text)
    for radius in (3, 2, 1.4, 1):
        for rate in (12, 6, 3):
            end = 6.0 * 6 / rate
            where, seconds = run(cleave, out, f"dem_fracture_{radius}_{rate}", path,
                                 [f"bodies.bar.dem.packing.radius={radius} mm", f"time.end={end} ms", f"conditions[0].velocity.x.ramp.to=-{rate} mm/s", f"conditions[1].velocity.x.ramp.to={rate} mm/s"])
            h = history(where)
            peak, energy = h["reaction(xmax).x[N]"].max() / (5e6 * 0.03 * 0.01), h["energy.fracture[J]"][-1] / (60 * 0.03 * 0.01)
            yield f"ends at {rate} mm/s each", "radius %g mm" % radius, radius, seconds, max(abs(peak - 1), abs(energy - 1)), {"peak": peak, "energy": energy}


# ---- the notched beam to its peak: mean force over 1 ms at the peak against the same scene with particles of half a millimetre ----


def coupled_beam(cleave, out):
    path = os.path.join(EXAMPLES, "notched_beam", "scene.yaml")
    rows = []
    for radius in (0.9, 0.75, 0.6, 0.5):
        where, seconds = run(cleave, out, f"coupled_beam_{radius}", path, [f"bodies.beam.dem.packing.radius={radius} mm", "time.end=30 ms"])
        force = -history(where)["reaction(load).y[N]"]
        rows.append((radius, seconds, np.convolve(force, np.ones(50) / 50, "valid").max()))
    for radius, seconds, peak in rows[:-1]:
        yield "fixed overlap", "radius %g mm" % radius, radius, seconds, abs(peak / rows[-1][2] - 1), {"peak": peak, "reference": rows[-1][2]}


CASES = {f.__name__: f for f in (fem_static, fem_wave, dem_wave, dem_fracture, coupled_wave, coupled_beam)}
TITLES = {"fem_static": "Elements at rest: hollow sphere, Lamé", "fem_wave": "Elements: a pulse through a bar", "dem_wave": "Particles: the same pulse", "dem_fracture": "Particles: a plate torn apart",
          "coupled_wave": "Elements, particles, elements: the same pulse", "coupled_beam": "The notched beam, peak force"}


def front(points):
    """Of (seconds, error): which no other beats in both."""
    return [not any(s <= p[0] and e <= p[1] and (s, e) != p for s, e in points) for p in points]


def main():
    build, out = sys.argv[1], os.path.abspath(sys.argv[2])
    os.makedirs(out, exist_ok=True)
    names = sys.argv[3:] or list(CASES)
    rows, words = [], []
    for name in names:
        found = list(CASES[name](os.path.join(build, "app", "cleave"), out))
        best = front([(p[3], p[4]) for p in found])
        figure, axes = plt.subplots(figsize=(7, 5), layout="constrained")
        for label in dict.fromkeys(p[0] for p in found):
            of = [p for p in found if p[0] == label]
            axes.loglog([p[3] for p in of], [p[4] for p in of], "o-", label=label)
            for p in of:
                axes.annotate(p[1], (p[3], p[4]), fontsize=7, xytext=(4, 4), textcoords="offset points")
        axes.loglog([p[3] for p, b in zip(found, best) if b], [p[4] for p, b in zip(found, best) if b], "s", markersize=12, fillstyle="none", color="black", label="front")
        axes.set(xlabel="processor time / s", ylabel="error", title=TITLES[name])
        axes.grid(which="both", alpha=0.3)
        axes.legend(fontsize=8)
        figure.savefig(os.path.join(out, f"work_{name}.png"), dpi=110)
        plt.close(figure)
        words += [f"### {TITLES[name]}", "", "| what | size | seconds | error | front |", "| --- | --- | --- | --- | --- |"]
        for p, b in zip(found, best):
            extra = "".join(", %s %.4g" % (k, v) for k, v in p[5].items()) if len(p) > 5 else ""
            words.append("| %s | %s | %.2f | %.2e%s | %s |" % (p[0], p[1], p[3], p[4], extra, "*" if b else ""))
            rows.append([name, p[0], p[1], "%.3f" % p[3], "%.4e" % p[4], int(b)])
        words += ["", f"![{TITLES[name]}](work_{name}.png)", ""]
        with open(os.path.join(out, "work_accuracy.csv"), "w", newline="") as f:
            csv.writer(f, lineterminator="\n").writerows([["case", "what", "size", "seconds[s]", "error[-]", "front"]] + rows)
        with open(os.path.join(out, "work_accuracy.md"), "w") as f:
            f.write("\n".join(words))


main()
