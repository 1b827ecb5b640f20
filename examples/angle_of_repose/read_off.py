"""Angle of repose of the heap.  python3 read_off.py RESULTS ...

The last frame's grains on the floor, as solid volume per area in slices of the floor's length (spheres cut by the slices' planes): the
straight line through the slices between 15 % and 85 % of the length, its slope over the heap's solid fraction. A line of the highest grain
in each slice would hang on single grains; the ends, a toe on the edge and a top against the wall, are left out.
"""
import math
import os
import sys

import h5py
import numpy

LENGTH, DEPTH, SLICES = 0.1, 0.016, 25  # [m], as in scene.yaml
INSIDE = (0.01, 0.04), (0, DEPTH), (0.006, 0.016)  # a box within the heap: x, y, z [m]


def below(x, r, at):
    """Volume of spheres on the near side of the plane x = at."""
    h = numpy.clip(at - (x - r), 0, 2 * r)
    return math.pi * h * h * (3 * r - h) / 3


def solid_fraction(x, r):
    """Of the box within, by points (0.5 % with these)."""
    draw = numpy.random.default_rng(1)
    points = numpy.column_stack([draw.uniform(low, high, 20000) for low, high in INSIDE])
    hit = numpy.zeros(len(points), bool)
    for centre, radius in zip(x, r):
        hit |= ((points - centre) ** 2).sum(axis=1) < radius * radius
    return hit.mean()


def read(directory):
    """Grains on the floor, solid fraction, angle [degrees], mean speed [m/s]."""
    with h5py.File(os.path.join(directory, "fields.h5"), "r") as file:
        frame = file["frames"][sorted(file["frames"])[-1]]
        block = frame["particles"]
        x = block["points"][()] + block["point_data/displacement"][()]
        r = block["point_data/radius"][()].ravel()
        speed = numpy.linalg.norm(block["point_data/velocity"][()], axis=1)
    on = (x[:, 0] < LENGTH) & (x[:, 2] > 0)
    x, r, speed = x[on], r[on], speed[on]
    edges = numpy.linspace(0, LENGTH, SLICES + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    height = numpy.diff([below(x[:, 0], r, edge).sum() for edge in edges]) / (LENGTH / SLICES * DEPTH)
    inner = (middle > 0.15 * LENGTH) & (middle < 0.85 * LENGTH)
    fraction = solid_fraction(x, r)
    return len(x), fraction, -math.degrees(math.atan(numpy.polyfit(middle[inner], height[inner], 1)[0] / fraction)), speed.mean()


if __name__ == "__main__":
    for directory in sys.argv[1:]:
        print("%s: %d grains on the floor, solid fraction %.3f, angle %.2f degrees, mean speed %.1e m/s" % ((directory,) + read(directory)))
