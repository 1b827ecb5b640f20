"""Angle of repose of the heap.  python3 read_off.py RESULTS

The last frame's surface: in bins one grain's diameter wide along the floor the highest grain; the straight line through
those between 15 % and 85 % of the floor's length. The slope's ends, a toe on the edge and a top against the wall, are left out.
"""
import math
import os
import sys

import h5py
import numpy

LENGTH, RADIUS = 0.1, 0.002  # [m], as in scene.yaml


def main(directory):
    with h5py.File(os.path.join(directory, "fields.h5"), "r") as file:
        frame = file["frames"][sorted(file["frames"])[-1]]
        block = frame["particles"]
        x = block["points"][()] + block["point_data/displacement"][()]
        r = block["point_data/radius"][()]
        speed = numpy.linalg.norm(block["point_data/velocity"][()], axis=1)
    on = (x[:, 0] < LENGTH) & (x[:, 2] > 0)
    x, r, speed = x[on], r[on], speed[on]
    edges = numpy.arange(0.15 * LENGTH, 0.85 * LENGTH, 2 * RADIUS)
    top = [(x[k, 0], x[k, 2]) for a, b in zip(edges[:-1], edges[1:]) for inside in [(x[:, 0] >= a) & (x[:, 0] < b)] if inside.any() for k in [numpy.flatnonzero(inside)[x[inside, 2].argmax()]]]
    slope = numpy.polyfit(*zip(*top), 1)[0]
    print("grains on the floor = %d" % len(x))
    print("angle [degrees]     = %.2f" % -math.degrees(math.atan(slope)))
    print("mean speed [m/s]    = %.1e" % speed.mean())


if __name__ == "__main__":
    main(sys.argv[1])
