"""What the fault commands share: runs, their CPU time, and whether two results are the same."""
import hashlib
import json
import os
import re
import shutil
import subprocess
import time

import h5py

os.environ.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OPENBLAS_NUM_THREADS="1")


class Wrong(Exception):
    """A result that is lost or wrong."""


def lay_out(folder, scene):
    """The files of a scene in a folder of their own."""
    os.makedirs(folder, exist_ok=True)
    for name, text in scene["files"].items():
        with open(os.path.join(folder, name), "w") as out:
            out.write(text)
    return folder


def command(cleave, output, *more, threads=1):
    return [cleave, "run", "scene.yaml", "--no-plots", "--quiet", "--threads", str(threads), "--output", output, *more]


def run(words, cwd, env=None, timeout=600, before=None):
    """Exit code and all that was said."""
    done = subprocess.run(words, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", timeout=timeout, env=env, preexec_fn=before)
    return done.returncode, done.stdout


def cpu_seconds(pid):
    """CPU time of a process's first thread so far [s]; None when it is gone."""
    try:
        with open("/proc/%d/schedstat" % pid) as file:
            return int(file.read().split()[0]) * 1e-9
    except (OSError, ValueError, IndexError):
        return None


def count_lines(path):
    try:
        with open(path, "rb") as file:
            return file.read().count(b"\n")
    except OSError:
        return 0


def run_until(words, cwd, seconds, number, after=None, rows=0):
    """Signal a run after so much CPU time of its own: moments do not depend on what else the machine does. after: and once this file has so many lines."""
    process = subprocess.Popen(words, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    while process.poll() is None:
        used = cpu_seconds(process.pid)
        if used is not None and used >= seconds and (not after or count_lines(os.path.join(cwd, after)) > rows):
            process.send_signal(number)
            break
        time.sleep(0.001)
    said = process.communicate()[0].decode(errors="replace")
    return process.returncode, said


def cpu_of(words, cwd, history):
    """CPU time [s] of a whole run until its first row of history, and until its end."""
    process = subprocess.Popen(words, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    begin = end = None
    while process.poll() is None:
        end = cpu_seconds(process.pid) or end
        if begin is None and os.path.exists(os.path.join(cwd, history)):
            begin = end
        time.sleep(0.002)
    said = process.communicate()[0].decode(errors="replace")
    if process.returncode or begin is None:
        raise Wrong("the undisturbed run gave %d: %s" % (process.returncode, said))
    return begin, end


def digest(path):
    """Every array of an HDF5 file, or the text of a table, as a name -> hash."""
    found = {}

    def put(name, data):
        found[name] = hashlib.sha256(data).hexdigest()

    def visit(group, at):
        for key in group:
            item = group[key]
            if isinstance(item, h5py.Group):
                visit(item, at + "/" + key)
            elif key != "seconds":  # wall time
                put(at + "/" + key, str(item.shape).encode() + item[()].tobytes())

    if path.endswith(".h5"):
        with h5py.File(path, "r") as file:
            visit(file, "")
    else:
        with open(path, "rb") as file:
            data = file.read()
        if path.endswith("switches.csv"):  # its last column is the wall time of the event
            data = re.sub(rb",[^,\n]*\n", b"\n", data)
        put("", data)
    return found


def results(directory):
    """All that a run leaves behind and that must not depend on how it got there: tables, fields, state, ParaView's files."""
    found = {}
    for name in ("history.csv", "cracks.csv", "fragments.csv", "switches.csv", "fields.h5", "checkpoint.h5"):
        path = os.path.join(directory, name)
        if os.path.exists(path):
            found.update((name + key, value) for key, value in digest(path).items())
    for folder in ("", "vtu"):
        here = os.path.join(directory, folder)
        for name in sorted(os.listdir(here)) if os.path.isdir(here) else ():
            if name.endswith((".vtu", ".pvd")):
                found.update((os.path.join(folder, name) + key, value) for key, value in digest(os.path.join(here, name)).items())
            if name.endswith(".part"):
                found["left over: " + name] = ""
    return found


def same(one, two):
    """Names of what differs between two results."""
    return sorted(key for key in set(one) | set(two) if one.get(key) != two.get(key))


def words(sets):
    return [word for key, value in sets.items() for word in ("--set", "%s=%s" % (key, value))]


def go(cleave, here, output, sets, *more, scene="scene.yaml", threads=1):
    """A scene with other values, into a fresh directory: exit code and words."""
    return run([cleave, "run", scene, "--no-plots", "--threads", str(threads), "--output", fresh(os.path.join(here, output)), *words(sets), *more], here, timeout=3000)


def summary(here, output="out"):
    with open(os.path.join(here, output, "summary.json")) as file:
        return json.load(file)


def one(text, about, **files):
    """A scene of one text, and the files it names: bar_geo stands for bar.geo."""
    return {"files": {"scene.yaml": text, **{name.replace("_", "."): data for name, data in files.items()}}, "about": about}


def fresh(folder):
    shutil.rmtree(folder, ignore_errors=True)
    return folder
