"""Young's modulus and Poisson's ratio of the cylinder run.  python3 read_off.py RESULTS

Stress: the platen's reaction over the circle's area. Axial strain: the platen's displacement over the height. Lateral
strain: the straight line through the particles' radial displacement against their distance from the axis.
"""
import csv
import math
import os
import sys

import h5py
import numpy

RADIUS, HEIGHT = 0.025, 0.1  # [m], as in scene.yaml


def main(directory):
    with open(os.path.join(directory, "history.csv")) as file:
        last = {key.split("[")[0]: float(value) for key, value in list(csv.DictReader(file))[-1].items()}
    with h5py.File(os.path.join(directory, "fields.h5"), "r") as file:
        frame = file["frames"][sorted(file["frames"])[-1]]
        block = next(frame[name] for name in frame if "displacement" in frame[name].get("point_data", {}))
        x, u = block["points"][()], block["point_data/displacement"][()]
    stress = last["reaction(top).z"] / (math.pi * RADIUS**2)
    axial = last["displacement(top).z"] / HEIGHT
    x, u = x[:, :2] - x[:, :2].mean(axis=0), u[:, :2] - u[:, :2].mean(axis=0)
    lateral = (x * u).sum() / (x * x).sum()
    print("axial strain   = %.6e" % axial)
    print("stress [Pa]    = %.6e" % stress)
    print("young [Pa]     = %.6e" % (stress / axial))
    print("poisson        = %.6f" % (-lateral / axial))
    print("platens agree to %.2e of the force" % abs(1 + last["reaction(bottom).z"] / last["reaction(top).z"]))


if __name__ == "__main__":
    main(sys.argv[1])
