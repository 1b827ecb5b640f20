"""What one-dimensional theory says of these scenes, beside what a run gave: python3 read_off.py KIND DIRECTORY, KIND one of impact, wave, spall, cantilever, plate"""
import csv
import math
import sys


def table(name):
    with open(name, newline="") as file:
        rows = list(csv.reader(file))
    return {key.split("[")[0]: [float(row[k]) if row[k].replace(".", "").replace("-", "").replace("e", "").replace("+", "").isdigit() else row[k] for row in rows[1:]] for k, key in enumerate(rows[0])}


def impact(where):
    """Force rho c v A for 2 L/c; the bar leaves as fast as it came."""
    h, rho, E, v, L, A = table(where + "/history.csv"), 2500, 30e9, 1, 0.2, 0.01 * 0.01
    c, f, t = math.sqrt(E / rho), [abs(x) for x in h["force(wall).x"]], h["time"]
    plateau = [x for x, s in zip(f, t) if 0.25 * 2 * L / c < s < 0.75 * 2 * L / c]
    return [("force on the wall [N]", sum(plateau) / len(plateau), rho * c * v * A), ("impulse [N s]", sum(0.5 * (f[k] + f[k + 1]) * (t[k + 1] - t[k]) for k in range(len(t) - 1)), 2 * rho * A * L * v),
            ("contact ends at [us]", 1e6 * max(s for s, x in zip(t, f) if x > 0.5 * rho * c * v * A), 1e6 * 2 * L / c)]


def wave(where):
    """The far end, free, moves with 2 p/(rho c), when the pulse's crest is there."""
    h, rho, c, L = table(where + "/history.csv"), 2400, 4000, 0.6
    v, t = h["velocity(right).x"], h["time"]
    back = [abs(x) for x, s in zip(h["velocity(left).x"], t) if 60e-6 < s < 280e-6 - 50e-6 and s < 2 * L / c - 1e-6]
    crest = max(range(len(v)), key=lambda k: v[k])
    return [("far end [m/s]", v[crest], 2 * 1e6 / (rho * c)), ("crest arrives at [us]", 1e6 * t[crest], 25 + 1e6 * L / c), ("sent back by the overlaps, energy / sent", (max(back) / (2 * 1e6 / (rho * c))) ** 2, 0)]


def spall(where):
    """Tension c T/2 sigma_t/p from the free end."""
    rows, c, T, p, strength = table(where + "/cracks.csv"), math.sqrt(41.6e9 / 2600), 40e-6, 30e6, 10e6
    first = min(range(len(rows["time"])), key=lambda k: rows["time"][k])
    off = [0.15 - x for x, b in zip(rows["x"], rows["broken"]) if b > 0.99]
    nearest = min(off) if off else float("nan")
    return [("first facet breaks, from the free end [mm]", 1e3 * (0.15 - rows["x"][first]), 1e3 * strength * c * T / (2 * p)), ("nearest parted facet [mm]", 1e3 * nearest, 1e3 * strength * c * T / (2 * p))]


def cantilever(where):
    """P L^3/3EI + P L/kGA; k = 5/6."""
    h, P, L, E, nu, b, d = table(where + "/history.csv"), 200, 0.12, 30e9, 0.2, 0.01, 0.02
    u = -h["displacement(right).y"][-1]
    return [("tip [um]", 1e6 * u, 1e6 * (P * L**3 / (3 * E * b * d**3 / 12) + P * L / (5 / 6 * E / (2 * (1 + nu)) * b * d))), ("reaction [N]", h["reaction(left).y"][-1], P)]


def plate(where):
    """Half of the pulse gone, all of the reflected one there: c_p (6 - 2)/2 us from the back."""
    rows, c = table(where + "/cracks.csv"), math.sqrt(41.6e9 * 0.8 / (1.2 * 0.6) / 2600)
    middle = [(t, y) for t, x, y in zip(rows["time"], rows["x"], rows["y"]) if abs(x - 0.06) < 0.01]
    return [("first facet breaks, from the back [mm]", 1e3 * (0.02 - min(middle)[1]), 1e3 * c * 2e-6)]


for name, got, want in globals()[sys.argv[1]](sys.argv[2]):
    print(f"{name}: {got:.4g}, in one dimension {want:.4g}")
