"""Stop and go on: the same bits for every method, also on other threads; what may change, and what is told of it."""
import csv
import os
import re
import signal

from common import Wrong, command, fresh, lay_out, results, run, run_until, same, summary


def expect(condition, *what):
    if not condition:
        raise Wrong(" ".join(str(word) for word in what))


def all_restarts(cleave, folder, scenes, done=(), keep=None):
    for name in scenes:
        if name in done:
            continue
        restart(cleave, os.path.join(folder, "bits"), name, scenes[name])
        if name in RANKS:
            ranks(cleave, os.path.join(folder, "ranks"), name, scenes[name])
        row = [name, scenes[name]["about"], 2, "yes", "below %.0e" % RANKS[name] if name in RANKS else "-"]
        print(*row, sep="  ", flush=True)
        if keep:
            keep(row)


def alike(one, two, what):
    other = same(one, two)
    expect(not other, what, "differs in", ", ".join(other[:8]))


def finish(cleave, folder, output, *more, threads=1, code=0):
    got, said = run(command(cleave, output, *more, threads=threads), folder)
    expect(got == code, output, *more, "gave", got, "not", code, said)
    return said


STOPS = {"switch": (0.3, 0.52), "breaking": (0.3, 0.45), "coupled": (0.4, 0.5)}  # its last element has turned at 0.55; they are torn through at 0.55 and 0.6


def restart(cleave, folder, name, scene, threads=True):
    """Whole; whole on two threads; stopped at two places and resumed, the last part on two threads."""
    here = lay_out(os.path.join(folder, name), scene)
    parts = STOPS.get(name, (0.37, 0.71))
    for output in ("whole", "two", "parts"):
        fresh(os.path.join(here, output))
    finish(cleave, here, "whole")
    whole, steps = results(os.path.join(here, "whole")), summary(here, "whole")["run"]["steps"]
    if threads:
        finish(cleave, here, "two", threads=2)
        alike(whole, results(os.path.join(here, "two")), name + " on two threads")
    done, so_far = 0, [0]
    for part in parts:
        finish(cleave, here, "parts", "--stop-after", str(max(1, int(part * steps) - done)), *(["--resume"] if done else []))
        done = int(part * steps)
        so_far.append(grown(here, "parts", name))
    finish(cleave, here, "parts", "--resume", threads=2 if threads else 1)
    so_far.append(grown(here, "parts", name))
    expect(name not in GROWS or all(a < b for a, b in zip(so_far, so_far[1:])), name, "is not in the middle of it at its stops:", so_far)
    alike(whole, results(os.path.join(here, "parts")), name + " in %d parts" % (len(parts) + 1))


# Where a scene must be in the middle of it at both stops: a table whose column adds up to more from stop to stop to the end.
GROWS = {"breaking": ("cracks.csv", "energy[J]"), "coupled": ("cracks.csv", "energy[J]"), "confined": ("cracks.csv", "energy[J]"), "switch": ("switches.csv", None)}


def grown(here, output, name):
    if name not in GROWS:
        return 0
    table, column = GROWS[name]
    with open(os.path.join(here, output, table)) as file:
        return sum(float(row[column]) if column else 1 for row in csv.DictReader(file))


def near(one, two, tolerance):
    """Columns of two histories that differ by more than so much of their vector's largest value; the ledger's error is itself round-off."""
    with open(one) as a, open(two) as b:
        first, second = list(csv.reader(a)), list(csv.reader(b))
    expect(first[0] == second[0] and len(first) == len(second), "other columns or rows:", len(first), len(second))
    columns = [[[float(row[k]) for row in rows[1:]] for rows in (first, second)] for k in range(len(first[0]))]
    vector = [name.split("[")[0].rsplit(").", 1)[0] for name in first[0]]  # the components of one have one scale
    bad = []
    for k, name in enumerate(first[0]):
        scale = max(abs(value) for other, (values, _) in zip(vector, columns) if other == vector[k] for value in values)
        worst = max(abs(a - b) for a, b in zip(*columns[k])) / max(scale, 1e-300)
        if "ledger" not in name and worst > tolerance:
            bad.append("%s by %.1e" % (name, worst))
    return bad


RANKS = {"static": 1e-9, "explicit": 1e-9, "implicit": 1e-9, "preload": 1e-9, "corotational": 1e-9}


def ranks(cleave, folder, name, scene, mpi=("mpiexec", "--oversubscribe", "-n", "2")):
    """Stopped on one rank, gone on with on two, ended on one: the history of the run on one, but for round-off."""
    here = lay_out(os.path.join(folder, name), scene)
    finish(cleave, here, "whole")
    steps = summary(here, "whole")["run"]["steps"]
    finish(cleave, here, "parts", "--stop-after", str(int(0.37 * steps)))
    code, said = run([*mpi, *command(cleave, "parts", "--resume", "--stop-after", str(int(0.3 * steps)))], here)
    expect(code == 0, name, "on two ranks gave", code, said)
    expect(summary(here, "parts")["plan"]["ranks"] == 2, "not two ranks")
    finish(cleave, here, "parts", "--resume")
    bad = near(os.path.join(here, "whole", "history.csv"), os.path.join(here, "parts", "history.csv"), RANKS[name])
    expect(not bad, name, "on one, two and one ranks differs in", ", ".join(bad))


def told(folder, output):
    with open(os.path.join(folder, output, "resolved.yaml")) as file:
        return [line[2:].rstrip() for line in file.read().splitlines()[1:] if line.startswith("#")]


def changed(cleave, folder, scenes):
    """A later end, other output and other loads: the first two as they come, loads when they are declared; all listed, all kept."""
    here = lay_out(os.path.join(folder, "changed"), scenes["explicit"])
    for output in ("run", "far"):
        fresh(os.path.join(here, output))
    finish(cleave, here, "run", "--stop-after", "600")
    before = open(os.path.join(here, "run", "history.csv")).read()
    load = ["--set", "conditions[1].traction.y={ramp: {to: -2 MPa, over: 300 us}}"]
    said = finish(cleave, here, "run", "--resume", *load, code=2)
    expect("only loads differ" in said and "--new-loads" in said and "-1e+06 Pa" in said, said)
    expect(open(os.path.join(here, "run", "history.csv")).read() == before, "a refused resume touched the history")
    said = finish(cleave, here, "run", "--resume", "--new-loads", "--set", "materials.steel.young=200 GPa", *load, code=2)
    expect("young" in said and "another scene" in said, said)
    finish(cleave, here, "run", "--resume", "--new-loads", *load, "--stop-after", "200")
    lines = told(here, "run")
    expect(len(lines) == 2 and re.match(r"changed from step 600, t = \S+ s on:", lines[0]) and "conditions[1].traction.y: {ramp: {to: -1e+06 Pa" in lines[1] and "-> {ramp: {to: -2e+06 Pa" in lines[1], lines)
    # again otherwise: a later end, and a history of other columns, which gets a file of its own
    finish(cleave, here, "run", "--resume", *load, "--set", "time.end=500 us", "--set", "output.history.quantities=[displacement(xmax), energies]", "--set", "output.history.every=10 us")
    lines = told(here, "run")
    expect(len(lines) == 6 and "step 800" in lines[2] and any("time.end: 0.0004 s -> 0.0005 s" in line for line in lines[3:]) and any("output.history.quantities" in line for line in lines[3:]), lines)
    old, new = (open(os.path.join(here, "run", name)).read().splitlines() for name in ("history-1.csv", "history.csv"))
    expect(float(old[-1].split(",")[0]) < float(new[1].split(",")[0]) <= float(old[-1].split(",")[0]) + 15.1e-6, "a gap or a repeat between", old[-1][:20], "and", new[1][:20])
    expect("reaction(xmin).x[N]" in old[0] and "reaction(xmin).x[N]" not in new[0], old[0], new[0])
    # all of it as it would have been: up to the change the old run, then the new load
    finish(cleave, here, "far", "--stop-after", "600")
    finish(cleave, here, "far", "--resume", "--new-loads", *load, "--set", "time.end=500 us")
    both = [name for name in results(os.path.join(here, "run")) if name.startswith("checkpoint.h5/fem")]
    one, two = results(os.path.join(here, "run")), results(os.path.join(here, "far"))
    expect(both and all(one[name] == two[name] for name in both), "the state depends on what was written beside it")
    said = finish(cleave, here, "run", "--new-loads", code=2)
    expect("--resume" in said, said)


def stopped(cleave, folder, scenes):
    """SIGINT, SIGTERM and the wall clock: a checkpoint, exit 130, and the run goes on as if nothing had been."""
    here = lay_out(os.path.join(folder, "stopped"), scenes["explicit"])
    more = ["--set", "time.end=4 ms", "--set", "output.history.every=50 us", "--set", "output.fields.every=2 ms", "--set", "output.checkpoint.every=3.9 ms"]
    fresh(os.path.join(here, "whole"))
    finish(cleave, here, "whole", *more)
    whole = results(os.path.join(here, "whole"))
    for number in (signal.SIGINT, signal.SIGTERM, 0):
        output = "cut-%d" % number
        fresh(os.path.join(here, output))
        if number:
            code, said = run_until(command(cleave, output, *more), here, 0, number, after=os.path.join(output, "history.csv"), rows=3)
        else:
            code, said = run(command(cleave, output, *more, "--time-limit", "0.01 s"), here)  # gone before the first step
        expect(code == 130, "signal", number, "gave", code, said)
        expect(os.path.exists(os.path.join(here, output, "checkpoint.h5")), "no checkpoint after signal", number)
        finish(cleave, here, output, *more, "--resume")
        alike(whole, results(os.path.join(here, output)), "the run after signal %d" % number)
    for text in ("0", "-3 s", "2 weeks", "soon", "nan", "inf"):
        said = finish(cleave, here, "never", "--time-limit", text, code=2)
        expect("not a time above 0" in said and not os.path.exists(os.path.join(here, "never")), said)
