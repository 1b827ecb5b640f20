"""Concrete with `exact` and the nonlocal criterion, one set of parameters for every confining pressure: strength and ductility.

confinement.py CLEAVE FOLDER CSV SPHERES PRESSURE...     pressures in MPa; rows are added to the CSV
Cylinder 150 x 300 mm. The side pressure grows in 2 ms while the platens follow the hydrostatic shortening H p (1 - 2 nu)/E, then both press at 50 mm/s.
Young's modulus, Poisson's ratio, density, friction: Onate et al. 2015, table 5; tensile strength: their Brazilian value; fracture energy: 100 J/m2, common
for concrete; cohesion: the one fitted number, on the uniaxial peak.
"""
import csv
import math
import os
import subprocess
import sys

COHESION = 6.0  # MPa
SCENE = """\
title: Concrete under {p} MPa from the side, one set of parameters
time: {{end: {end} ms}}
materials:
  concrete:
    density: 2500 kg/m3
    young: 28 GPa
    poisson: 0.2
    law: cohesive
    criterion: nonlocal
    tensile_strength: 3 MPa
    fracture_energy: 100 J/m2
    shear_strength: {cohesion} MPa
    fracture_energy_shear: 2000 J/m2
    mu_static: 0.9
    mu_dynamic: 0.9
    local_damping: 0.3
bodies:
  sample:
    geometry: {{cylinder: {{radius: 75 mm, height: 300 mm}}}}
    method: dem
    material: concrete
    dem: {{packing: {{count: {count}, spread: 0.2, seed: 1}}}}
conditions:
  - {{group: side, pressure: {{ramp: {{to: {p} MPa, over: 2 ms}}}}}}
  - {{group: bottom, velocity: {{z: {{table: [[0 ms, {v} mm/s], [1.95 ms, {v} mm/s], [2.05 ms, 0 mm/s], [2.5 ms, 0 mm/s], [4 ms, 50 mm/s]]}}}}}}
  - {{group: top, velocity: {{z: {{table: [[0 ms, -{v} mm/s], [1.95 ms, -{v} mm/s], [2.05 ms, 0 mm/s], [2.5 ms, 0 mm/s], [4 ms, -50 mm/s]]}}}}}}
output:
  history: {{every: 50 us, quantities: [reaction(top), displacement(top), displacement(bottom), gauge, quality]}}
"""


def main():
    cleave, folder, path, count = os.path.abspath(sys.argv[1]), sys.argv[2], sys.argv[3], int(sys.argv[4])
    os.makedirs(folder, exist_ok=True)
    new = not os.path.exists(path)
    with open(path, "a") as out:
        if new:
            out.write("pressure_MPa,spheres,peak_MPa,strain_at_peak,strain_at_0.9_after,last/peak,quasi_static,ledger_error,steps,end_s\n")
        for word in sys.argv[5:]:
            p = float(word)
            scene, where = os.path.join(folder, f"p{p:g}.yaml"), os.path.join(folder, f"p{p:g}")
            strain = 0.004 + 0.0005 * p  # far enough past the peak
            with open(scene, "w") as f:
                f.write(SCENE.format(p=f"{p:g}", count=count, cohesion=COHESION, v=f"{300 * p * 0.6 / 28e3 / 2 / 2e-3:.6g}", end=f"{4 + strain * 300 / 100 * 1e3:.6g}"))
            said = subprocess.run([cleave, "run", scene, "--output", where, "--threads", "1", "--no-plots"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True).stdout
            with open(os.path.join(where, "history.csv")) as f:
                rows = list(csv.reader(f))
            col = {n.split("[")[0]: [float(r[i] or "nan") for r in rows[1:]] for i, n in enumerate(rows[0])}
            stress = [abs(x) / (math.pi * 0.075**2) * 1e-6 for x in col["reaction(top).z"]]
            short = [(b - a) / 0.3 for a, b in zip(col["displacement(top).z"], col["displacement(bottom).z"])]
            at = stress.index(max(stress))
            after = next((short[i] for i in range(at, len(stress)) if stress[i] - p < 0.9 * (stress[at] - p)), math.nan)
            out.write(f"{p:g},{count},{stress[at]:.2f},{short[at]:.5f},{after:.5f},{stress[-1] / stress[at]:.2f},{int('too fast' not in said)},{max(col['ledger_error']):.1e},{int(col['step'][-1])},{col['time'][-1]:.4f}\n")
            out.flush()


main()
