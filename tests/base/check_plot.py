#!/usr/bin/env python3
"""check_plot.py PLOT DIR - plot.py draws what it is asked and says what it cannot.

Makes a small output directory by hand (a flat plate, a block of hexahedra, discs, spheres), asks for pictures, and looks
at their pixels: the sizes, that the colours of the range's two ends appear, that the deformed plate reaches further.
"""
import json
import os
import subprocess
import sys

import h5py
import numpy as np
from matplotlib.image import imread

plot, directory = sys.argv[1:3]
os.makedirs(directory, exist_ok=True)
faults = []


def expect(truth, what):
    if not truth:
        faults.append(what)


def block(frame, name, points, cells, kind, point_data=(), cell_data=()):
    group = frame.create_group(name)
    group["points"] = points
    group["cell_start"] = np.arange(len(cells) + 1, dtype=np.int32) * (len(cells[0]) if len(cells) else 1)
    group["cell_node"] = np.array(cells, dtype=np.int32).ravel()
    group["cell_type"] = np.full(len(cells), kind, dtype=np.uint8)
    for place, arrays in (("point_data", point_data), ("cell_data", cell_data)):
        for array, unit, values in arrays:
            group.require_group(place)[array] = values
            group[place][array].attrs["unit"] = unit


def lattice(n):
    k = np.arange(np.prod([m + 1 for m in n])).reshape([m + 1 for m in n])
    return np.stack(np.meshgrid(*[np.arange(m + 1.0) for m in n], indexing="ij"), -1).reshape(-1, len(n)), k


with h5py.File(os.path.join(directory, "fields.h5"), "w") as fields:
    frame = fields.create_group("frames/000000")
    frame.attrs["time"], frame.attrs["step"] = 0.5, 10
    xy, k = lattice((20, 5))
    quads = [(k[i, j], k[i + 1, j], k[i + 1, j + 1], k[i, j + 1]) for i in range(20) for j in range(5)]
    plate = np.column_stack([xy, np.zeros(len(xy))])
    shift = np.column_stack([0.01 * xy[:, 0], np.zeros(len(xy))])
    block(frame, "plate", plate, quads, 9, [("displacement", "m", shift)], [("damage", "-", np.linspace(0, 1, len(quads)))])
    xyz, k = lattice((4, 3, 2))
    hexes = [(k[a, b, c], k[a + 1, b, c], k[a + 1, b + 1, c], k[a, b + 1, c], k[a, b, c + 1], k[a + 1, b, c + 1], k[a + 1, b + 1, c + 1], k[a, b + 1, c + 1])
             for a in range(4) for b in range(3) for c in range(2)]
    block(frame, "solid", xyz, hexes, 12, [("temperature", "K", xyz[:, 0])])
    block(frame, "discs", plate, np.arange(len(plate))[:, None], 1, [("radius", "m", np.full(len(plate), 0.5))], [("damage", "-", xy[:, 0] / 20)])
    block(frame, "spheres", xyz, np.arange(len(xyz))[:, None], 1, [("radius", "m", np.full(len(xyz), 0.4)), ("damage", "-", xyz[:, 0] / 4)])
    block(frame, "cracks", np.zeros((0, 3)), [], 7)
with open(os.path.join(directory, "history.csv"), "w") as file:
    file.write('time[s],"reaction(a, b)[N]",energy.kinetic[J]\n0,0,0\n1,2,3\n2,1,1\n')
with open(os.path.join(directory, "envelope.csv"), "w") as file:
    file.write("# measured\nx,low,high\n0,0,1\n2,1,3\n")


def run(*specs):
    return subprocess.run([sys.executable, plot, directory, *[s if isinstance(s, str) else json.dumps(s) for s in specs]], capture_output=True, text=True)


def picture(name):
    path = os.path.join(directory, name)
    return imread(path)[..., :3] if os.path.exists(path) else np.zeros((1, 1, 3))


def has_colour(image, rgb):
    return bool((np.abs(image - np.array(rgb)).max(axis=-1) < 0.02).sum() > 20)


dark, bright = (0.267, 0.005, 0.329), (0.993, 0.906, 0.144)  # the ends of viridis
done = run({"kind": "field", "out": "plate.png", "block": "plate", "array": "damage", "scale": 0},
           {"kind": "field", "out": "stretched.png", "block": "plate", "array": "damage", "scale": 100, "range": [0, 1]},
           {"kind": "field", "out": "solid.png", "block": "solid", "array": "temperature"},
           {"kind": "field", "out": "discs.png", "block": "discs", "array": "damage"},
           {"kind": "field", "out": "spheres.png", "block": "spheres", "array": "damage"},
           {"kind": "field", "out": "shift.png", "block": "plate", "array": "displacement", "component": 0},
           {"kind": "history", "out": "force.png", "x": "time", "y": "reaction(a, b)", "xscale": 1000, "overlay": os.path.join(directory, "envelope.csv"), "overlay_xscale": 1000})
expect(done.returncode == 0 and not done.stderr, f"plots failed: {done.stderr}")
for name in ("plate.png", "stretched.png", "discs.png", "spheres.png"):
    image = picture(name)
    expect(image.shape[0] > 300, f"{name} is not there or tiny")
    expect(has_colour(image, dark) and has_colour(image, bright), f"{name} lacks an end of the colour range")
plain, stretched = picture("plate.png"), picture("stretched.png")


def aspect(image):
    """Width over height of the yellow-to-purple body, left of the colour bar."""
    body = (image.max(axis=-1) - image.min(axis=-1) > 0.25)[:, : int(0.88 * image.shape[1])]
    rows, columns = np.nonzero(body.any(axis=1))[0], np.nonzero(body.any(axis=0))[0]
    return (columns[-1] - columns[0]) / (rows[-1] - rows[0])


expect(abs(aspect(plain) - 4) < 0.1, f"the plate is 20 x 5, drawn as {aspect(plain):.2f}")
expect(abs(aspect(stretched) - 8) < 0.3, f"stretched to 40 x 5, drawn as {aspect(stretched):.2f}")
grey = picture("force.png")
expect((np.abs(grey - 0.8).max(axis=-1) < 0.01).mean() > 0.05, "the envelope is not drawn")
for spec, words in (({"kind": "history", "y": "opening"}, "no column 'opening'"), ({"kind": "field", "block": "beam"}, "no block 'beam'"), ({"kind": "field", "block": "cracks"}, "empty"),
                    ({"kind": "field", "block": "plate", "array": "stress"}, "no array 'stress'"), ({"kind": "movie"}, "kind is 'movie'"), ("{bad", "plot.py"),
                    ({"kind": "field", "block": "plate", "frame": 7}, "1 frames"), ({"kind": "history", "y": []}, "columns")):
    done = run(spec)
    expect(done.returncode == 1 and words in done.stderr and "Traceback" not in done.stderr, f"{spec}: '{done.stderr.strip()}' does not say '{words}'")
done = run()
expect(done.returncode == 0 and all(n in done.stdout for n in ("energy.png", "history_reaction_a_b_N.png", "last_plate.png")), f"defaults: {done.stdout} {done.stderr}")
done = subprocess.run([sys.executable, plot, "no such directory"], capture_output=True, text=True)
expect("Traceback" not in done.stderr, "a missing directory ends in a trace")
for fault in faults:
    print("FAULT", fault)
sys.exit(1 if faults else 0)
