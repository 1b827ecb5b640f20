"""Picture of a packing: the middle section and the sizes.  python3 packing.py DIRECTORY  (reads packing.csv, writes packing.png)"""
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import EllipseCollection


def read(path):
    with open(path) as table:
        return [[float(word) for word in line.replace(",", " ").split()] for line in table if not line.startswith("#")]


def main(directory):
    spheres = read(os.path.join(directory, "packing.csv"))
    flat = all(s[2] == 0 for s in spheres)
    if flat:
        cut, axis = [(s[0], s[1], s[3]) for s in spheres], ("x", "y")
    else:
        middle = 0.5 * (min(s[1] for s in spheres) + max(s[1] for s in spheres))
        near = [s for s in spheres if abs(s[1] - middle) < s[3]]
        cut, axis = [(s[0], s[2], (s[3] ** 2 - (s[1] - middle) ** 2) ** 0.5) for s in near], ("x", "z")
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4.5), dpi=100)
    size = [2e3 * c[2] for c in cut]
    left.add_collection(EllipseCollection(size, size, [0] * len(cut), units="xy", offsets=[(1e3 * c[0], 1e3 * c[1]) for c in cut],
                                          transOffset=left.transData, facecolors="#c9d8e6", edgecolors="#24486b", linewidths=0.4))
    left.set_xlim(1e3 * min(c[0] - c[2] for c in cut), 1e3 * max(c[0] + c[2] for c in cut))
    left.set_ylim(1e3 * min(c[1] - c[2] for c in cut), 1e3 * max(c[1] + c[2] for c in cut))
    left.set_aspect("equal")
    left.set_xlabel(axis[0] + " [mm]")
    left.set_ylabel(axis[1] + " [mm]")
    left.set_title("discs" if flat else "section through the middle")
    right.hist([1e3 * s[3] for s in spheres], bins=30, color="#24486b")
    right.set_xlabel("radius [mm]")
    right.set_ylabel("particles")
    right.set_title("%d particles" % len(spheres))
    figure.tight_layout()
    figure.savefig(os.path.join(directory, "packing.png"))


if __name__ == "__main__":
    main(sys.argv[1])
