"""docs/reliability.md from what the fault commands found. Every figure is kept in a JSON file, row by row, with the program that made it and the day."""
import json
import os
import platform
import re
import subprocess
import time

HEAD = """\
# Reliability

Runs broken on purpose, and what came of them. Made by

    python3 tests/faults/faults.py build/release/app/cleave report docs/reliability.md

which makes every row below that the program at hand has not made yet and keeps it in `tests/faults/figures.json` (`--fresh`: all of them anew; `--part kills`: only these; stopped, it goes on where it was; `--page-only` runs nothing).
The short forms are part of `./test`. "lost or wrong" counts runs whose last state, tables, fields or ParaView files differ by a bit from those of the run that nobody disturbed, or that could not go on.

"""

# part -> (title, words above the table, head of the table)
TABLES = {
    "kills": ("Kills", "Moments are random in the run's CPU time: one in eight before the first step, the others while it steps, writes and saves; up to four kills in a row. Where no checkpoint is yet there is nothing to resume and the run begins anew.",
              ("run", "kills", "before its first checkpoint")),
    "restart": ("Stopped and resumed", "Stopped in the middle, resumed, stopped, resumed on two threads: the same bits as the run in one go, on one thread and on two. Where cracks or switches are the matter they grow from stop to stop to end. "
                "Elements also go on on two ranks and end on one: the history within so much of each quantity's largest value.", ("run", "in the middle of", "stops", "the same bits", "one, two, one ranks")),
    "cuts": ("Foreign bytes", "Each seed of `tests/fuzz/seeds` (checkpoints and frames are made) through its reader: whole, cut after every byte (every 7th of a mesh, at most 4,000 places), with one to three bits changed. Each is read or refused as bad input with words; a crash or another "
             "error ends the test. A part of a scene may be a scene, and another number in a scene, packing, surface or mesh may be a good one; checkpoints and frames bear a mark of all their bytes, and none with a change is taken. gmsh and HDF5 themselves break on damaged files "
             "(this is how that was found): a child process tries a .msh first, and a file without its mark never reaches HDF5.", ("reader", "seeds", "cuts", "taken", "changed", "taken")),
    "inputs": ("Hostile input to the whole program", "`tests/faults/inputs.py`: each refused with exit 2 and words (where memory is short, exit 1) within 120 s and 6 GB, and nothing written; or, for a roundabout way to a good file or place, the same bits.", ("what", "tried", "wrong")),
    "fuzz": ("Fuzzing", "clang's libFuzzer with the address sanitizer, from the same seeds (`tests/fuzz/README.md`).", ("reader", "inputs", "seconds", "crashes, hangs, errors of address")),
    "memory": ("Memory", "The n-th allocation fails, n spread evenly over all that a run makes (`fail_alloc.c`, preloaded); then the run goes on without.", ("run", "allocations made", "refused one by one")),
    "disk": ("Disk", "A tmpfs of 100 and of 300 kB holds the results until it is full and is then made larger.", ("run", "disks tried", "of them full before the end")),
    "stability": ("Steps near the critical one", "Every shipped scene with explicit steps (made coarser, `tests/faults/stability.py` says how), its first 1000 steps (notched_beam/scene3d: 100) at a fraction of its critical step: worst ledger error, which must stay below 1 %. Beyond it (`time.beyond_critical`) the step at "
                  "which the run is stopped, among the first 5000. Where the critical step is a bound (an overlap; grains, whose contacts do not last) a longer one may run on; its ledger error after 2000 steps then stands there.",
                  ("scene", "critical step [s]", "0.5", "0.8", "0.95", "1.05", "1.1")),
    "odd": ("Uneasy bodies", "Uneasy bodies and loads, run to their end: worst ledger error, below 1 %.", ("run", "steps", "worst ledger error")),
    "scatter": ("Scatter", "The same body on other packings and meshes: mean, standard deviation over mean, range.", ("figure", "over", "mean [N, m]", "deviation", "from .. to")),
    "drift": ("Drift", "Worst ledger error (below 1e-3; 1e-6 for the wave without sub-steps; 1 % with three, whose impulses keep an energy that lies O(step²) beside the true one, and a quarter of that at half the step); largest less smallest stored energy (kinetic, strain, coupling, contact) after the first tenth, over its mean; change of its mean from the second tenth of the run to the last, below 1e-4.", ("run", "steps", "worst ledger error", "swing of stored energy", "change of its mean")),
    "bystander": ("A far bystander", "Grains that lie on each other in a box, alone and with one more 1.9 m above them that falls: their positions, velocities, forces and contacts.", ("run", "steps", "they are", "of", "speed")),
    "watch": ("What the watch costs", "Instructions inside the models' watch (`FemWatch`, `DemWatch_Internal`) over all of the run loop, and with the ledger's check besides, counted by `valgrind --tool=callgrind --toggle-collect=RunLoop`.",
              ("run", "steps", "instructions of the loop", "of the watch", "share", "with the ledger")),
    "examples": ("Twice the same", "Every scene of `examples/`, coarse where `tests/faults/stability.py` says so, its first 300 steps (or load steps) on two threads, twice: tables, every array of every frame and of the checkpoint, ParaView's files.", ("scene", "arrays and files, the same bits")),
}

# words -> (part, columns to add up, column of what is wrong or None)
SUMMARY = (("killed (SIGKILL) at a random moment, resumed", "kills", (1,)), ("stopped in the middle, resumed", "restart", (2,)), ("file cut short, read", "cuts", (2,)), ("file with bits changed, or hostile, read", "cuts", (1, 4)),
           ("hostile input to the whole program", "inputs", (1,)), ("input made by a fuzzer, read", "fuzz", (1,)), ("one allocation of the program's own refused, then run again", "memory", (2,)), ("disk full, then given room", "disk", (2,)),
           ("example run twice", "examples", ()))

FOUND = """\

## Sanitizers

`./test asan` runs the quick suite with the address, undefined and leak sanitizers; `cmake/leaks.supp` names what Open MPI and gmsh keep until a process ends, and a leak of ours fails its test. It has not been run whole since leaks are looked for. On 2026-11-23 these passed:
every scene of `tests/faults/scenes.py` on two threads, 150 steps and 100 more after a resume, through the program; and of the suite `base`, `body`, `checkpoint`, `closing`, `clumps`, `contact`, `exact`, `failure`, `fem_batch`, `fem_beams`, `fem_cases`, `fem_element`, `fem_explicit`, `fem_far`, `fem_lame`, `fem_modes`, `fem_multigrid`, `fem_multigrid_ranks`, `fem_order`, `fem_patch`, `fem_recover`, `fem_recover_quadratic`, `fem_recover_ranks`, `fem_recover_ranks4`, `fem_recover_turned`, `fem_static`, `fem_volume`, `laws`, `ledger`, `output`, `plot`, `resume`, `rules`, `run`, `run_ranks`, `scene_broken`, `scene_fuzz`, `scene_good`, `scene_keys`, `scene_ranks`, `surface`, `units`.

## What was found, and is mended

- gmsh crashes on a damaged .msh: a child process reads it first, and what happens to it becomes a message.
- HDF5 crashes on a damaged index of frames, and may on a damaged checkpoint: both now bear a mark of all their bytes and are refused without it.
- HDF5 crashes at the end of a process whose disk was full: it no longer tidies up there.
- A packing of ours, cut short, was read as a smaller packing: its first line tells how many particles there are.
- The ledger called the first step of a free fall from rest lost: what its first steps leave out, 1/(4n^2) of the work at step n, is taken off there.
- cracks.csv, fragments.csv, switches.csv and modes.csv were written in place: they are renamed there.
- A failed fsync of a checkpoint went unnoticed.
- A pipe, /dev/zero or another device as packing, mesh or tool was read for ever: only files are read.
- Where memory is refused, PETSc 3.18's own allocator raises an error whose code is the caller's line number and whose words are its name: it is told as what it is.
- Two centres less than a millionth of a spacing apart ended as an internal error: they are refused as one.
- A run wrote through a symbolic link named like one of its unfinished files: it is replaced.
- A run of more steps than can be counted was refused only after its directory was made.
- A facet that had slid or turned held with its whole stiffness up to its rim, and then with nothing: confined and crushed bodies ran away at 0.9 of the critical step. It bears with what still faces the other side, and what slid off becomes a contact.
"""


def program(cleave):
    """What `cleave --version` says of its source."""
    said = subprocess.run([cleave, "--version"], stdout=subprocess.PIPE, text=True).stdout
    return re.search(r"git ([^,)]+)", said).group(1)


class Figures:
    """{part: {first cell: {"row": [...], "program": ..., "day": ...}}} in a file, written after every row."""

    def __init__(self, path, maker, fresh=False):
        self.path, self.maker = path, maker
        self.found = {}
        if os.path.exists(path) and not fresh:
            with open(path) as file:
                self.found = json.load(file)

    def done(self, part):
        return {name for name, entry in self.found.get(part, {}).items() if entry["program"] == self.maker}

    def keep(self, part, row):
        self.found.setdefault(part, {})[str(row[0])] = {"row": list(row), "program": self.maker, "day": time.strftime("%Y-%m-%d")}
        with open(self.path + ".part", "w") as out:
            json.dump(self.found, out, indent=1)
            out.write("\n")
        os.replace(self.path + ".part", self.path)

    def rows(self, part):
        return [entry["row"] for entry in self.found.get(part, {}).values()]

    def makers(self, parts):
        """{(program, day): {part: rows it made of it}}"""
        by = {}
        for part in parts:
            for entry in self.found.get(part, {}).values():
                rows = by.setdefault((entry["program"], entry["day"]), {})
                rows[part] = rows.get(part, 0) + 1
        return by


def table(out, head, rows):
    for cells in (head, ["---"] * len(head), *rows):
        out.append("| " + " | ".join(str(cell) for cell in cells) + " |")
    out.append("")


def write(figures, path):
    out, rows = [], []
    for what, part, columns in SUMMARY:
        found = figures.rows(part)
        if found:
            rows.append((what, sum(sum(row[k] for k in columns) for row in found) if columns else len(found), 0))  # a row is kept only when nothing in it was lost or wrong
    table(out, ("what was done", "how often", "lost or wrong"), rows)
    for part, (title, words, head) in TABLES.items():
        if figures.rows(part):
            out += ["## " + title, "", words, ""]
            table(out, head, figures.rows(part))
    missing = [part for part in TABLES if not figures.rows(part)]
    makers = figures.makers(TABLES)
    processor = subprocess.run("grep -m1 'model name' /proc/cpuinfo | cut -d: -f2", shell=True, stdout=subprocess.PIPE, text=True).stdout.strip()
    foot = ["", "## Made by", "", "Rows, by the commit of the program that made them (%s, %s).%s" % (platform.system(), processor or "unknown processor", " Not run: %s." % ", ".join(missing) if missing else ""), ""]
    if len(makers) > 1:
        foot[-1:] = ["", "No one program has made all of them: the command was not run whole.", ""]
    table(foot, ("program", "day", "rows"), [(maker, day, ", ".join("%s %d" % item for item in parts.items())) for (maker, day), parts in sorted(makers.items(), key=lambda item: item[0][1])])
    with open(path, "w") as file:
        file.write(HEAD + "\n".join(out).rstrip("\n") + "\n" + FOUND + "\n".join(foot).rstrip("\n") + "\n")
