"""Uniaxial compression against the number of spheres, the step and the rate: the published law with the thesis' parameters, and `exact`.

convergence.py CLEAVE FOLDER CSV ROW...     ROW = what:rule:spheres:factor, what = spheres, step (times 0.9 of critical) or rate (times 0.1 m/s a platen)
Cylinder 150 x 300 mm; numbers of spheres as in the thesis, table 5.2: 107 251 497 1004 4959 13500 71852. published: `onate2015`, table 7.2, area factor 0.8;
exact: `law: cohesive`, local criterion, the same strengths with G_f = 100 J/m2, G_II = 2000 J/m2.
"""
import csv
import math
import os
import subprocess
import sys

RULES = {
    "published": "elasticity: onate2015, area_factor: 0.8, interaction_range: 0.15, law: published, local_damping: 0.2, density: 2500 kg/m3, young: 27 GPa, poisson: 0.2, tensile_strength: 3.2 MPa, delta_n: 0.1, shear_strength: 15 MPa, delta_s: 0.1, mu_static: 0.9, mu_dynamic: 0.2, compression: {lcs1: 15 MPa, yrc1: 3, lcs2: 25 MPa, yrc2: 7, lcs3: 30 MPa, yrc3: 15}",
    "exact": "law: cohesive, local_damping: 0.2, density: 2500 kg/m3, young: 27 GPa, poisson: 0.2, tensile_strength: 3.2 MPa, fracture_energy: 100 J/m2, shear_strength: 15 MPa, fracture_energy_shear: 2000 J/m2, mu_static: 0.9, mu_dynamic: 0.2",
}
SCENE = """\
title: Uniaxial compression, {rule}, {count} spheres
time: {{end: {end} ms, safety: {safety}}}
materials:
  concrete: {{{material}}}
bodies:
  sample:
    geometry: {{cylinder: {{radius: 75 mm, height: 300 mm}}}}
    method: dem
    material: concrete
    dem: {{packing: {{count: {count}, spread: 0.45, seed: 1}}}}
conditions:
  - {{group: bottom, velocity: {{z: {{ramp: {{to: {v} mm/s, over: 0.3 ms}}}}}}}}
  - {{group: top, velocity: {{z: {{ramp: {{to: -{v} mm/s, over: 0.3 ms}}}}}}}}
output:
  history: {{every: {every} us, quantities: [reaction(top), gauge]}}
"""


def main():
    cleave, folder, path = os.path.abspath(sys.argv[1]), sys.argv[2], sys.argv[3]
    os.makedirs(folder, exist_ok=True)
    new = not os.path.exists(path)
    with open(path, "a") as out:
        if new:
            out.write("what,rule,spheres,factor,peak_MPa,E_gauge_GPa,nu_gauge,last/peak,ledger_error,steps,exit\n")
        for word in sys.argv[4:]:
            what, rule, count, factor = word.split(":")
            v = 100 * (float(factor) if what == "rate" else 1)
            strain = 2.5e-3 if rule == "published" else 4e-3
            scene, where = os.path.join(folder, word.replace(":", "-") + ".yaml"), os.path.join(folder, word.replace(":", "-"))
            with open(scene, "w") as f:
                f.write(SCENE.format(rule=rule, count=count, material=RULES[rule], v=f"{v:g}", end=f"{strain * 300 / (2 * v) * 1e3 + 0.15:g}", every=f"{1000 / v:g}", safety=0.9 * (float(factor) if what == "step" else 1)))
            ended = subprocess.run([cleave, "run", scene, "--output", where, "--threads", "2" if int(count) > 10000 else "1", "--no-plots"], stdout=subprocess.DEVNULL).returncode
            with open(os.path.join(where, "history.csv")) as f:
                rows = list(csv.reader(f))
            col = {n.split("[")[0]: [float(r[i] or "nan") for r in rows[1:]] for i, n in enumerate(rows[0])}
            force = [abs(x) for x in col["reaction(top).z"]]
            peak = max(force)
            early = next(i for i, x in enumerate(force) if x > 0.3 * peak)
            out.write(f"{what},{rule},{count},{factor},{peak / (math.pi * 0.075**2) * 1e-6:.2f},{col['gauge.modulus'][early] * 1e-9:.2f},{col['gauge.poisson'][early]:.3f},{force[-1] / peak:.2f},{max(col['ledger_error']):.1e},{int(col['step'][-1])},{ended}\n")
            out.flush()


main()
