"""How far the grains lean over.  python3 read_off.py RESULTS

The line from the drum's middle to the grains' mean place, against the vertical: mean, least and most of the frames from 1.5 s on. The grains
swing with a period of 0.45 s, so one frame says little.
"""
import math
import os
import sys

import h5py

FROM = 1.5  # [s]


def read(directory):
    lean = []
    with h5py.File(os.path.join(directory, "fields.h5"), "r") as file:
        for name in sorted(file["frames"]):
            block = file["frames"][name]["particles"]
            x, y = (block["points"][()] + block["point_data/displacement"][()]).mean(axis=0)[:2]
            if file["frames"][name].attrs["time"] >= FROM - 1e-9:
                lean.append(math.degrees(math.atan2(x, -y)))
    return sum(lean) / len(lean), min(lean), max(lean)


if __name__ == "__main__":
    print("lean %.2f degrees in the mean, %.1f to %.1f" % read(sys.argv[1]))
