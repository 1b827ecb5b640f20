"""Uniaxial compression and Brazilian splitting with the published parameters and the published law, none of them touched: peak against the laboratory.

published.py CLEAVE FOLDER CSV SET:SPHERES...     sets: concrete, concrete_thesis, shale, cement; brazilian_concrete, brazilian_shale, brazilian_cement
Parameters: Onate et al. 2015, tables 2-6; Santasusana's thesis, table 7.2. Their contact damping of 0.9 of critical is not offered;
the non-viscous damping of their papers (0.1; thesis 0.2) is. Platens smooth, both driven at the papers' rate, 0.2 m/s together on 300 mm.
Brazilian: discs of 150 x 75 mm (cement: its specimen, 1.487 x 0.863 in) between flats 20 degrees wide, 0.25 m/s together; the peak is 2P/(pi D t).
"""
import csv
import json
import math
import os
import subprocess
import sys

SETS = {  # experiment [MPa]; diameter, height [mm]; damping, range; the material
    "concrete": (37, 150, 300, 0.1, 0.10, "density: 2500 kg/m3, young: 28 GPa, poisson: 0.2, tensile_strength: 5 MPa, delta_n: 0.2, shear_strength: 16 MPa, delta_s: 0.2, mu_static: 0.9, mu_dynamic: 0.25, compression: {lcs1: 20 MPa, yrc1: 3, lcs2: 45 MPa, yrc2: 12, lcs3: 70 MPa, yrc3: 22}", 1.0),
    "concrete_thesis": (32.8, 150, 300, 0.2, 0.15, "density: 2500 kg/m3, young: 27 GPa, poisson: 0.2, tensile_strength: 3.2 MPa, delta_n: 0.1, shear_strength: 15 MPa, delta_s: 0.1, mu_static: 0.9, mu_dynamic: 0.2, compression: {lcs1: 15 MPa, yrc1: 3, lcs2: 25 MPa, yrc2: 7, lcs3: 30 MPa, yrc3: 15}", 0.8),
    "shale": (50, 150, 300, 0.1, 0.10, "density: 2550 kg/m3, young: 30 GPa, poisson: 0.2, tensile_strength: 5 MPa, delta_n: 0.2, shear_strength: 25 MPa, delta_s: 0.2, mu_static: 0.7, mu_dynamic: 0.6, compression: {lcs1: 20 MPa, yrc1: 1, lcs2: 30 MPa, yrc2: 1, lcs3: 40 MPa, yrc3: 1}", 1.0),
    "cement": (17, 25.4, 50.8, 0.1, 0.10, "density: 1700 kg/m3, young: 3.8 GPa, poisson: 0.2, tensile_strength: 4.8 MPa, delta_n: 0.2, shear_strength: 8.5 MPa, delta_s: 0.2, mu_static: 0.3, mu_dynamic: 0.4, compression: {lcs1: 8.5 MPa, yrc1: 3, lcs2: 9 MPa, yrc2: 9, lcs3: 11 MPa, yrc3: 24}", 1.0),
}
DISCS = {"brazilian_concrete": ("concrete", 3.0, 150, 75), "brazilian_shale": ("shale", 5.0, 150, 75), "brazilian_cement": ("cement", 2.9, 37.77, 21.92)}  # material; experiment [MPa]; diameter, thickness [mm]
GEO = """\
R = {radius}; a = 10*Pi/180; h = {radius}/6; c = R*Cos(a); s = R*Sin(a);
Point(1) = {{0, 0, 0, h}}; Point(2) = {{s, -c, 0, h}}; Point(3) = {{R, 0, 0, h}}; Point(4) = {{s, c, 0, h}}; Point(5) = {{-s, c, 0, h}}; Point(6) = {{-R, 0, 0, h}}; Point(7) = {{-s, -c, 0, h}};
Circle(1) = {{2, 1, 3}}; Circle(2) = {{3, 1, 4}}; Line(3) = {{4, 5}}; Circle(4) = {{5, 1, 6}}; Circle(5) = {{6, 1, 7}}; Line(6) = {{7, 2}};
Curve Loop(1) = {{1:6}}; Plane Surface(1) = {{1}};
e[] = Extrude {{0, 0, {thick}}} {{ Surface{{1}}; }};
Physical Volume("disc") = {{e[1]}}; Physical Surface("upper") = {{e[4]}}; Physical Surface("lower") = {{e[7]}};
"""
DISC = """\
title: Brazilian test, published parameters, {name}
time: {{end: {end} ms}}
materials:
  rock: {{elasticity: onate2015, area_factor: {alpha}, interaction_range: {range}, law: published, local_damping: {damping}, {material}}}
bodies:
  sample:
    geometry: {name}.geo
    length_unit: 1 mm
    method: dem
    material: rock
    dem: {{packing: {{count: {count}, spread: 0.45, seed: 1}}}}
conditions:
  - {{group: lower, velocity: {{y: {{ramp: {{to: {v} mm/s, over: 0.3 ms}}}}}}}}
  - {{group: upper, velocity: {{y: {{ramp: {{to: -{v} mm/s, over: 0.3 ms}}}}}}}}
output:
  history: {{every: 10 us, quantities: [reaction(upper), gauge, quality]}}
"""
SCENE = """\
title: Uniaxial compression, published parameters, {name}
time: {{end: {end} ms}}
materials:
  rock: {{elasticity: onate2015, area_factor: {alpha}, interaction_range: {range}, law: published, local_damping: {damping}, {material}}}
bodies:
  sample:
    geometry: {{cylinder: {{radius: {radius} mm, height: {height} mm}}}}
    method: dem
    material: rock
    dem: {{packing: {{count: {count}, spread: 0.45, seed: 1}}}}
conditions:
  - {{group: bottom, velocity: {{z: {{ramp: {{to: {v} mm/s, over: 0.3 ms}}}}}}}}
  - {{group: top, velocity: {{z: {{ramp: {{to: -{v} mm/s, over: 0.3 ms}}}}}}}}
output:
  history: {{every: 10 us, quantities: [reaction(top), gauge, quality]}}
"""


def main():
    cleave, folder, path = os.path.abspath(sys.argv[1]), sys.argv[2], sys.argv[3]
    os.makedirs(folder, exist_ok=True)
    new = not os.path.exists(path)
    with open(path, "a") as out:
        if new:
            out.write("set,spheres,porosity,neighbours_10,E_gauge_GPa,peak_MPa,experiment_MPa,peak/experiment,last/peak,ledger_error,steps,exit\n")
        for word in sys.argv[4:]:
            name, count = word.split(":")
            disc = DISCS.get(name)
            experiment, d, height, damping, reach, material, alpha = SETS[disc[0] if disc else name]
            v = 100 * height / 300
            strain = 2.5e-3 if name != "cement" else 9e-3
            scene = os.path.join(folder, f"{name}-{count}.yaml")
            column, area = "reaction(top).z", math.pi * (d / 2000) ** 2
            if disc:
                _, experiment, d, thick = disc
                v = 125 * d / 300
                column, area = "reaction(upper).y", math.pi * d * thick * 0.5e-6
                with open(os.path.join(folder, name + ".geo"), "w") as f:
                    f.write(GEO.format(radius=d / 2, thick=thick))
            with open(scene, "w") as f:
                if disc:
                    f.write(DISC.format(name=name, end=(6e-3 if "cement" in name else 2e-3) * d / (2 * v) * 1e3 + 0.3, alpha=alpha, range=reach, damping=damping, material=material, count=count, v=v))
                else:
                    f.write(SCENE.format(name=name, end=strain * height / (2 * v) * 1e3 + 0.3, alpha=alpha, range=reach, damping=damping, material=material, radius=d / 2, height=height, count=count, v=v))
            where = os.path.join(folder, f"{name}-{count}")
            subprocess.run([cleave, "pack", scene, "--output", where + "-pack"], check=True, stdout=subprocess.DEVNULL)
            ended = subprocess.run([cleave, "run", scene, "--output", where, "--threads", "1", "--no-plots"], stdout=subprocess.DEVNULL).returncode  # 1: stopped by its ledger after the peak; the row says so
            with open(os.path.join(where + "-pack", "packing.json")) as f:
                pack = json.load(f)
            with open(os.path.join(where, "history.csv")) as f:
                rows = list(csv.reader(f))
            col = {n.split("[")[0]: [float(r[i] or "nan") for r in rows[1:]] for i, n in enumerate(rows[0])}
            force = [abs(x) for x in col[column]]
            peak = max(force)
            early = next(i for i, x in enumerate(force) if x > 0.2 * peak)
            out.write(f"{name},{pack['particles']},{pack['porosity']:.4f},{pack['coordination_gap_10_percent']:.2f},{'' if disc else format(col['gauge.modulus'][early] * 1e-9, '.2f')},{peak / area * 1e-6:.2f},{experiment},{peak / area * 1e-6 / experiment:.3f},"
                      f"{force[-1] / peak:.2f},{max(col['ledger_error']):.1e},{int(col['step'][-1])},{ended}\n")
            out.flush()


main()
