#!/usr/bin/env python3
"""plot.py DIR [SPEC...] - pictures of an output directory, drawn without a display.

A SPEC is a JSON object (or @FILE with one, or a list of them). Names of columns are those of history.csv, with or
without their [unit].

curves from history.csv
  {"kind": "history", "out": "force.png", "x": "opening(mouth)", "y": ["reaction(load).y"],
   "xscale": 1000, "yscale": -1, "xlabel": "CMOD [mm]", "ylabel": "force [N]", "title": "...", "logy": false,
   "overlay": "envelope.csv", "overlay_label": "measured", "overlay_xscale": 1, "overlay_yscale": 1}
  xscale, yscale multiply the columns. The overlay's lines starting with # are skipped; its first column is x, and two
  more are the lower and upper bound of an envelope, one more is a curve.

last frame of a block from fields.h5
  {"kind": "field", "out": "damage.png", "block": "beam", "array": "damage", "component": "magnitude",
   "scale": 100, "deform": "displacement", "frame": -1, "view": [-60, 25], "title": "...", "range": [0, 1]}
  component: a number or "magnitude" (default for several). scale multiplies the displacement; absent: chosen, and stated
  in the title; 0: undeformed. A flat block (all z equal) is drawn in its plane, others projected: view is azimuth and
  elevation in degrees. frame counts from 0, -1 is the last.

out is a file in DIR unless it is absolute. Without any SPEC: the energies, and the last frame of every block.
A SPEC that cannot be drawn is said on stderr and the others go on; exit code 1 then, 0 when all were drawn.
"""
import csv
import json
import os
import re
import sys

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402 (the backend is chosen first)
import numpy as np  # noqa: E402
from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection  # noqa: E402

# Corner points of the faces of VTK's solid cells, outward.
FACES = {
    10: [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)],
    12: [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
    13: [(0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)],
    14: [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
}
FACES[24] = FACES[10]
FACES[25] = FACES[29] = FACES[12]
FACES[26] = FACES[32] = FACES[13]
CORNERS = {5: 3, 9: 4, 22: 3, 23: 4, 28: 4, 34: 3}  # flat cells: corners come first


class Trouble(Exception):
    """Something a user can mend."""


def read_history(path):
    try:
        with open(path, newline="") as file:
            rows = list(csv.reader(file))
    except OSError as error:
        raise Trouble(f"cannot read {path}: {error.strerror}") from None
    if len(rows) < 2:
        raise Trouble(f"{path} has no rows")
    width = len(rows[0])
    values = np.array([[float(v) for v in row] for row in rows[1:] if len(row) == width])
    return {name: values[:, k] for k, name in enumerate(rows[0])}


def column(history, wanted):
    """A column by its full name or by its name without [unit]."""
    if wanted in history:
        return wanted
    bare = [name for name in history if re.sub(r"\[[^\[\]]*\]$", "", name) == wanted]
    if len(bare) != 1:
        raise Trouble(f"history.csv has no column '{wanted}'; it has {', '.join(history)}")
    return bare[0]


def read_overlay(path):
    rows = []
    if os.path.exists(path) and not os.path.isfile(path):
        raise Trouble(f"{path} is not a file")
    with open(path) as file:
        for line in file:
            try:
                rows.append([float(v) for v in line.split(",")])
            except ValueError:
                continue  # comment or header
    if not rows:
        raise Trouble(f"{path} has no numbers")
    return np.array(rows)


def plot_history(directory, spec, out):
    history = read_history(os.path.join(directory, "history.csv"))
    x = column(history, spec.get("x", "time"))
    names = spec.get("y", [])
    names = [column(history, y) for y in ([names] if isinstance(names, str) else names)]
    if not names:
        raise Trouble("a history plot needs \"y\": [columns]")
    xscale, yscale = spec.get("xscale", 1), spec.get("yscale", 1)
    figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
    if "overlay" in spec:
        data = read_overlay(spec["overlay"])
        ox, oy = data[:, 0] * spec.get("overlay_xscale", 1), data[:, 1:] * spec.get("overlay_yscale", 1)
        label = spec.get("overlay_label", os.path.basename(spec["overlay"]))
        if oy.shape[1] >= 2:
            axes.fill_between(ox, oy[:, 0], oy[:, 1], color="0.8", label=label, lw=0)
        else:
            axes.plot(ox, oy[:, 0], "k--", lw=1, label=label)
    for y in names:
        axes.plot(xscale * history[x], yscale * history[y], lw=1.2, label=y)
    axes.set_xlabel(spec.get("xlabel", x if xscale == 1 else f"{xscale:g} × {x}"))
    axes.set_ylabel(spec.get("ylabel", names[0] if len(names) == 1 else ""))
    if spec.get("logy"):
        axes.set_yscale("log")
    if len(names) > 1 or "overlay" in spec:
        axes.legend(fontsize=8)
    axes.grid(alpha=0.3)
    axes.set_title(spec.get("title", ""), fontsize=10)
    figure.savefig(out, dpi=150)
    plt.close(figure)


def field_values(block, spec):
    """Values to colour by, their label, and whether they belong to points."""
    name = spec.get("array")
    if name is None:
        return None, "", True
    for place in ("point_data", "cell_data"):
        if place in block and name in block[place]:
            data = block[place][name]
            unit = data.attrs.get("unit", "")
            unit = unit.decode() if isinstance(unit, bytes) else unit
            values, label = data[...], name
            if values.ndim > 1:
                component = spec.get("component", "magnitude")
                if component == "magnitude":
                    values, label = np.linalg.norm(values, axis=1), f"|{name}|"
                elif 0 <= int(component) < values.shape[1]:
                    values, label = values[:, int(component)], f"{name} {component}"
                else:
                    raise Trouble(f"array '{name}' has {values.shape[1]} components, not {component}")
            return values, f"{label} [{unit}]" if unit else label, place == "point_data"
    there = [n for place in ("point_data", "cell_data") if place in block for n in block[place]]
    raise Trouble(f"the block has no array '{name}'; it has {', '.join(there) or 'none'}")


def displaced(block, spec):
    """Points where they are drawn, and the scale used (0: undeformed)."""
    points = block["points"][...]
    name = spec.get("deform", "displacement")
    if not len(points) or "point_data" not in block or name not in block["point_data"]:
        return points, 0
    shift = block["point_data"][name][...]
    if shift.ndim != 2:
        return points, 0
    shift = np.pad(shift, ((0, 0), (0, 3 - shift.shape[1])))
    scale = spec.get("scale")
    if scale is None:
        size, largest = np.linalg.norm(np.ptp(points, axis=0)), np.linalg.norm(shift, axis=1).max()
        scale = 10.0 ** np.floor(np.log10(0.05 * size / largest)) if largest > 0 and size > 0 else 1
        scale = max(scale, 1.0) if largest < 0.05 * size else 1.0
    return points + scale * shift, scale


def project(points, view):
    """Orthographic: picture coordinates and depth towards the viewer."""
    if len(points) == 0 or np.ptp(points[:, 2]) <= 1e-9 * max(np.ptp(points, axis=0).max(), 1e-300):
        return points[:, :2], np.zeros(len(points)), True
    a, e = np.radians(view)
    right = np.array([-np.sin(a), np.cos(a), 0])
    towards = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    up = np.cross(towards, right)
    return np.column_stack([points @ right, points @ up]), points @ towards, False


def surface(start, node, kinds):
    """Polygons to draw: flat cells as they are, solids by the faces that only one of them has. (polygon, cell) pairs."""
    polygons, faces = [], {}
    for cell, kind in enumerate(kinds):
        members = node[start[cell]:start[cell + 1]]
        if kind in FACES:
            for face in FACES[kind]:
                polygon = members[list(face)]
                key = tuple(sorted(polygon))
                faces[key] = None if key in faces else (polygon, cell)
        elif kind == 7:
            polygons.append((members, cell))
        elif kind in CORNERS:
            polygons.append((members[:CORNERS[kind]], cell))
    return polygons + [face for face in faces.values() if face is not None]


def shade(polygons, points, light):
    """Brightness of each polygon from its normal, for pictures of solids."""
    result = np.ones(len(polygons))
    for k, (polygon, _) in enumerate(polygons):
        corner = points[polygon]
        normal = np.cross(corner[1] - corner[0], corner[2] - corner[0])
        length = np.linalg.norm(normal)
        if length > 0:
            result[k] = 0.55 + 0.45 * abs(normal @ light) / length
    return result


def draw_polygons(axes, polygons, points, flat, depth, plane, values, at_points, norm, colours, towards):
    polygons.sort(key=lambda item: depth[item[0]].mean())
    if values is None:
        colour = np.tile(np.array([0.75, 0.8, 0.88, 1.0]), (len(polygons), 1))
    else:
        face = np.array([values[p].mean() if at_points else values[c] for p, c in polygons])
        colour = colours(norm(face))
    if not flat:
        colour[:, :3] *= shade(polygons, points, towards)[:, None]
    edge = (0, 0, 0, 0.25) if len(polygons) < 3000 else "face"
    axes.add_collection(PolyCollection([plane[p] for p, _ in polygons], facecolors=colour, edgecolors=edge, linewidths=0.3))


def draw_lines(axes, lines, cells, plane, values, at_points, norm, colours):
    if values is None:
        colour = "0.3"
    else:
        colour = colours(norm(np.array([values[line].mean() if at_points else values[c] for line, c in zip(lines, cells)])))
    axes.add_collection(LineCollection([plane[line] for line in lines], colors=colour, linewidths=0.8))


def draw_points(axes, figure, block, plane, depth, values, norm, colours):
    order = np.argsort(depth, kind="stable")
    colour = np.tile(np.array([0.55, 0.65, 0.8, 1.0]), (len(plane), 1)) if values is None else colours(norm(values))
    for place in ("point_data", "cell_data"):
        if place in block and "radius" in block[place] and len(block[place]["radius"]) == len(plane):
            radius = block[place]["radius"][...]
            size = 2 * radius[order]
            axes.add_collection(EllipseCollection(size, size, np.zeros(len(plane)), units="xy", offsets=plane[order], offset_transform=axes.transData,
                                                  facecolors=colour[order], edgecolors=(0, 0, 0, 0.3), linewidths=0.2))
            return radius.max()
    axes.scatter(plane[order, 0], plane[order, 1], c=colour[order], s=max(1.0, min(30.0, 2e4 / max(len(plane), 1))), linewidths=0)
    return 0


def plot_field(directory, spec, out):
    path = os.path.join(directory, "fields.h5")
    try:
        fields = h5py.File(path, "r")
    except OSError:
        raise Trouble(f"cannot read {path}") from None
    with fields:
        numbers = sorted(fields["frames"], key=int)
        name = spec.get("block")
        try:
            frame = fields["frames"][numbers[int(spec.get("frame", -1))]]
        except IndexError:
            raise Trouble(f"{path} has {len(numbers)} frames") from None
        if name is None and len(frame) == 1:
            name = list(frame)[0]
        if name not in frame:
            raise Trouble(f"the frame has no block '{name}'; it has {', '.join(frame)}")
        block = frame[name]
        if len(block["points"]) == 0:
            raise Trouble(f"block '{name}' is empty")
        points, scale = displaced(block, spec)
        values, label, at_points = field_values(block, spec)
        view = spec.get("view", [-60, 25])
        plane, depth, flat = project(points, view)
        start, node, kinds = block["cell_start"][...], block["cell_node"][...], block["cell_type"][...]

        figure, axes = plt.subplots(figsize=(8, 5), layout="constrained")
        colours = plt.get_cmap(spec.get("colours", "viridis"))
        norm = None
        if values is not None:
            finite = values[np.isfinite(values)]
            low, high = spec.get("range", (finite.min(), finite.max()) if len(finite) else (0, 1))
            norm = matplotlib.colors.Normalize(low, high if high > low else low + max(abs(low), 1) * 1e-9)
        margin = 0
        polygons = surface(start, node, kinds)
        lines = [(node[start[c]:start[c + 1] if kinds[c] == 4 else start[c] + 2], c) for c in np.nonzero((kinds == 3) | (kinds == 4) | (kinds == 21))[0]]
        if polygons:
            a, e = np.radians(view)
            towards = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
            draw_polygons(axes, polygons, points, flat, depth, plane, values, at_points, norm, colours, towards)
        if lines:
            draw_lines(axes, [line for line, _ in lines], [c for _, c in lines], plane, values, at_points, norm, colours)
        if not polygons and not lines:
            if values is not None and not at_points and np.all(kinds == 1):
                ordered = np.empty(len(points))
                ordered[node] = values
                values = ordered
            margin = draw_points(axes, figure, block, plane, depth, values, norm, colours)
        low, high = plane.min(axis=0), plane.max(axis=0)
        margin += 0.03 * max(np.max(high - low), 1e-12)
        axes.set_xlim(low[0] - margin, high[0] + margin)
        axes.set_ylim(low[1] - margin, high[1] + margin)
        axes.set_aspect("equal")
        if flat:
            axes.set_xlabel("x [m]")
            axes.set_ylabel("y [m]")
        else:
            axes.set_axis_off()
        if values is not None:
            figure.colorbar(matplotlib.cm.ScalarMappable(norm, colours), ax=axes, label=label, shrink=0.8)
        title = spec.get("title", name)
        said = "undeformed" if not scale else "true scale" if scale == 1 else f"displacement × {scale:g}"
        axes.set_title(f"{title}, t = {frame.attrs['time']:.4g} s, {said}", fontsize=10)
        figure.savefig(out, dpi=150)
        plt.close(figure)


def defaults(directory):
    """What to draw when nobody says."""
    specs = []
    history = os.path.join(directory, "history.csv")
    if os.path.exists(history):
        names = list(read_history(history))
        energies = [n for n in names if n.startswith("energy.")]
        specs.append({"kind": "history", "out": "energy.png", "x": "time", "y": energies, "ylabel": "energy [J]"})
        own = [n for n in names if n not in energies and not n.startswith(("time[", "step[", "ledger_error["))]
        specs += [{"kind": "history", "out": "history_" + re.sub(r"[^A-Za-z0-9.]+", "_", n).strip("_") + ".png", "x": "time", "y": n} for n in own]
    return specs + last_frame(directory)


def last_frame(directory):
    """A picture of every block of the last frame, by what tells most."""
    specs = []
    if os.path.exists(os.path.join(directory, "fields.h5")):
        with h5py.File(os.path.join(directory, "fields.h5"), "r") as fields:
            numbers = sorted(fields["frames"], key=int)
            frame = fields["frames"][numbers[-1]] if numbers else {}
            for name in frame:
                if len(frame[name]["points"]):
                    arrays = [a for place in ("point_data", "cell_data") if place in frame[name] for a in frame[name][place]]
                    best = [a for a in ("broken", "damage", "stress", "displacement") if a in arrays] + arrays
                    specs.append({"kind": "field", "out": f"last_{name}.png", "block": name, **({"array": best[0]} if best else {})})
    return specs


def read_specs(arguments):
    specs = []
    for text in arguments:
        if text.startswith("@"):
            with open(text[1:]) as file:
                text = file.read()
        found = json.loads(text)
        specs += found if isinstance(found, list) else [found]
    return specs


def main():
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        return 0 if len(sys.argv) > 1 else 2
    directory, failed = sys.argv[1], 0
    try:
        specs = read_specs(sys.argv[2:]) or defaults(directory)
        specs = [one for spec in specs for one in (last_frame(directory) if isinstance(spec, dict) and spec.get("kind") == "last" else [spec])]
    except (ValueError, OSError, Trouble) as error:
        print(f"plot.py: {error}", file=sys.stderr)
        return 1
    for spec in specs:
        try:
            kinds = {"history": plot_history, "field": plot_field}
            if spec.get("kind") not in kinds:
                raise Trouble(f"kind is '{spec.get('kind')}', it must be one of {', '.join(kinds)}")
            out = os.path.join(directory, spec.get("out", f"{spec['kind']}.png"))
            kinds[spec["kind"]](directory, spec, out)
            print(out)
        except (Trouble, OSError, ValueError, KeyError, TypeError) as error:
            print(f"plot.py: {spec.get('out', '?') if isinstance(spec, dict) else spec}: {error}", file=sys.stderr)
            failed = 1
    return failed


if __name__ == "__main__":
    sys.exit(main())
