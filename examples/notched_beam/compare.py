#!/usr/bin/env python3
"""Runs of the notched beam beside the measured envelope.  python3 compare.py RUN... : directories of results, or history.csv files

One row per run: peak force, its CMOD, the force where the CMOD first passes each measured opening (mean over a window of
CMOD about it, so that a swinging force is not read at one crest) and whether it lies in the envelope, the last force / peak.
"""
import csv
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
WINDOW = 0.05  # half width of the window over which a force is averaged / opening


def envelope():
    with open(os.path.join(HERE, "measured.csv")) as file:
        return [tuple(float(v) for v in line.split(",")) for line in file if line[0] != "#"]


def curve(path):
    """CMOD [mm] and load [N] of a run."""
    if os.path.isdir(path):
        path = os.path.join(path, "history.csv")
    with open(path) as file:
        rows = csv.reader(file)
        names = [name.split("[")[0] for name in next(rows)]
        x, y = names.index("opening(notch mouth)"), names.index("reaction(load).y")
        return [(1e3 * float(row[x]), -float(row[y])) for row in rows if len(row) == len(names)]


def at(points, opening):
    """Mean force over the rows that lie within the window; None when the run did not come that far."""
    inside = [force for cmod, force in points if abs(cmod - opening) <= WINDOW * opening]
    return sum(inside) / len(inside) if inside and max(cmod for cmod, _ in points) > opening else None


def row(path):
    points, cells = curve(path), []
    peak_at, peak = max(points, key=lambda point: point[1])
    for opening, low, high in envelope():
        force = at(points, opening)
        cells.append("-" if force is None else "%.0f %s" % (force, "in" if low <= force <= high else "%+.0f" % (force - high if force > high else force - low)))
    last = [force for cmod, force in points[-25:]]
    return [path, "%.0f" % peak, "%.3f" % peak_at] + cells + ["%.3f" % points[-1][0], "%.2f" % (sum(last) / len(last) / peak)]


def main():
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        return 0 if len(sys.argv) > 1 else 2
    bounds = envelope()
    head = ["run", "peak [N]", "at [mm]"] + ["%.3f mm" % opening for opening, _, _ in bounds] + ["last CMOD", "last/peak"]
    print("| " + " | ".join(head) + " |")
    print("|" + " --- |" * len(head))
    print("| measured | | | " + " | ".join("%.0f–%.0f" % (low, high) for _, low, high in bounds) + " | | |")
    for path in sys.argv[1:]:
        print("| " + " | ".join(row(path)) + " |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
