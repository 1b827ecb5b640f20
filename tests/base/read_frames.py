#!/usr/bin/env python3
"""read_frames.py DIR [--killed] - load every frame of an output directory in VTK's own reader and compare it with fields.h5.

Every block of every step: points, cells, each array's values bit by bit, units, times. The .pvd files and fields.h5 must
name the same frames; after a kill (--killed) a .pvd may lack the last ones, but may name nothing that is not there.
Exit code 0 when all agree, 1 with a list of what does not.
"""
import glob
import os
import sys
import xml.etree.ElementTree as ElementTree

import h5py
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

faults = []
units_seen = 0


def same(a, b):
    """Equal shape and bits; NaN equals itself."""
    a, b = np.ascontiguousarray(a), np.ascontiguousarray(b)
    return a.shape == b.shape and a.tobytes() == b.tobytes()


def read_vtu(path):
    complaints = []
    reader = vtk.vtkXMLUnstructuredGridReader()
    for event in ("ErrorEvent", "WarningEvent"):
        reader.AddObserver(event, lambda *_: complaints.append(path))
    reader.SetFileName(path)
    reader.Update()
    if complaints:
        faults.append(f"{path}: VTK's reader complains")
    return reader.GetOutput()


def compare(path, block, time):
    global units_seen
    grid = read_vtu(path)
    stamp = grid.GetFieldData().GetArray("TimeValue")
    if stamp is None or stamp.GetValue(0) != time:
        faults.append(f"{path}: TimeValue is not {time!r}")
    points = block["points"][...]
    cells = len(block["cell_type"])
    if grid.GetNumberOfPoints() != len(points) or grid.GetNumberOfCells() != cells:
        faults.append(f"{path}: {grid.GetNumberOfPoints()} points and {grid.GetNumberOfCells()} cells, fields.h5 has {len(points)} and {cells}")
        return 0
    if len(points) and not same(vtk_to_numpy(grid.GetPoints().GetData()), points):
        faults.append(f"{path}: points differ")
    if cells:
        array = grid.GetCells()
        if not same(vtk_to_numpy(array.GetConnectivityArray()), block["cell_node"][...].astype(np.int64)):
            faults.append(f"{path}: cells differ")
        if not same(vtk_to_numpy(array.GetOffsetsArray()), block["cell_start"][...].astype(np.int64)):
            faults.append(f"{path}: cell starts differ")
        if not same(vtk_to_numpy(grid.GetCellTypesArray()), block["cell_type"][...]):
            faults.append(f"{path}: cell types differ")
    count = 0
    for place, data in (("point_data", grid.GetPointData()), ("cell_data", grid.GetCellData())):
        names = set(block[place]) if place in block else set()
        loaded = {data.GetArrayName(k) for k in range(data.GetNumberOfArrays())}
        if names != loaded and (len(points) if place == "point_data" else cells):
            faults.append(f"{path}: {place} has {sorted(loaded)}, fields.h5 {sorted(names)}")
        for name in names & loaded:
            array, stored = data.GetArray(name), block[place][name]
            unit = stored.attrs["unit"]
            unit = unit.decode() if isinstance(unit, bytes) else unit
            label = array.GetInformation().Get(vtk.vtkDataArray.UNITS_LABEL())
            units_seen += label is not None
            if (label or "") != unit:
                faults.append(f"{path}: {name} is in '{label}', fields.h5 says '{unit}'")
            if stored.size and not same(vtk_to_numpy(array), stored[...]):
                faults.append(f"{path}: {place} {name} differs")
            count += 1
    return count


def main():
    arguments = [a for a in sys.argv[1:] if not a.startswith("--")]
    killed = "--killed" in sys.argv
    if len(arguments) != 1:
        sys.exit(__doc__)
    directory = arguments[0]
    index = os.path.join(directory, "fields.h5")
    if killed and not os.path.exists(index):
        if glob.glob(os.path.join(directory, "*.pvd")):
            sys.exit(f"{directory}: a .pvd, but no fields.h5")
        print("no frame yet")
        return
    with h5py.File(index, "r") as fields:
        frames = {n: fields["frames"][n] for n in fields["frames"]}
        times = [frames[n].attrs["time"] for n in sorted(frames)]
        if any(b <= a for a, b in zip(times, times[1:])):
            faults.append("times do not increase")
        wanted = {(b, n) for n in frames for b in frames[n]}
        found, arrays = set(), 0
        for pvd in sorted(glob.glob(os.path.join(directory, "*.pvd"))):
            for entry in ElementTree.parse(pvd).getroot().iter("DataSet"):
                path = os.path.join(directory, entry.get("file"))
                stem = os.path.splitext(os.path.basename(path))[0]
                name, number = stem.rsplit("_", 1)
                if not os.path.exists(path):
                    faults.append(f"{pvd} names {path}, which is not there")
                elif number not in frames or name not in frames[number]:
                    faults.append(f"{pvd} names {path}, fields.h5 has no such frame")
                elif float(entry.get("timestep")) != frames[number].attrs["time"]:
                    faults.append(f"{pvd}: time of {path} differs from fields.h5")
                else:
                    arrays += compare(path, frames[number][name], frames[number].attrs["time"])
                    found.add((name, number))
        lost = wanted - found
        if killed and frames:
            lost = {(b, n) for b, n in lost if n != max(frames)}
        if lost:
            faults.append(f"no .pvd names {sorted(lost)}")
        print(f"{len(frames)} frames, {len(found)} block frames, {arrays} arrays compared, {units_seen} units read")
    for fault in faults:
        print("FAULT", fault)
    sys.exit(1 if faults else 0)


main()
