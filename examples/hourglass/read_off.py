"""Grains below the neck, by time.  python3 read_off.py RESULTS"""
import os
import sys

import h5py
import numpy


def read(directory):
    """Rows of time [s], grains with z < 0, and the largest distance of a centre from the axis [m] over all frames."""
    rows, farthest = [], 0.0
    with h5py.File(os.path.join(directory, "fields.h5"), "r") as file:
        for name in sorted(file["frames"]):
            block = file["frames"][name]["particles"]
            x = block["points"][()] + block["point_data/displacement"][()]
            rows.append((float(file["frames"][name].attrs["time"]), int((x[:, 2] < 0).sum())))
            farthest = max(farthest, float(numpy.hypot(x[:, 0], x[:, 1]).max()))
    return rows, farthest


if __name__ == "__main__":
    rows, farthest = read(sys.argv[1])
    for time, below in rows:
        print("t = %.2f s: %d grains below the neck" % (time, below))
    print("farthest from the axis: %.1f mm" % (1e3 * farthest))
