"""docs/reliability.md from what the fault commands found. Figures are kept by name in a JSON file, so that one part can be run again alone."""
import json
import os
import platform
import subprocess
import time

HEAD = """\
# Reliability

Runs broken on purpose, and what came of them. Made by

    python3 tests/faults/faults.py build/release/app/cleave report docs/reliability.md

which repeats everything below (`--part kills`, `cuts`, `memory`, `disk`, `fuzz`, `stability`, `odd`, `drift`, `watch`, `examples` repeats one, the rest stays as it was); the short forms are part of `./test`.
"lost or wrong" counts runs whose last state, tables, fields or ParaView files differ by a bit from those of the run that nobody disturbed, or that could not go on.

"""


FOUND = """\

## What was found, and is mended

- gmsh crashes on a damaged .msh: a child process reads it first, and what happens to it becomes a message.
- HDF5 crashes on a damaged index of frames, and may on a damaged checkpoint: both now bear a mark of all their bytes and are refused without it.
- HDF5 crashes at the end of a process whose disk was full: it no longer tidies up there.
- A packing of ours, cut short, was read as a smaller packing: its first line tells how many particles there are.
- The ledger called the first step of a free fall from rest lost (its error is 1/(4n^2) of the work at step n): it is not judged before step 10.
- cracks.csv, fragments.csv, switches.csv and modes.csv were written in place: they are renamed there.
- A failed fsync of a checkpoint went unnoticed.
"""


def load(path):
    try:
        with open(path) as file:
            return json.load(file)
    except OSError:
        return {}


def keep(path, part, figures):
    found = load(path)
    found[part] = dict(figures, date=time.strftime("%Y-%m-%d"))
    with open(path, "w") as out:
        json.dump(found, out, indent=1, sort_keys=True)
        out.write("\n")


def row(out, *cells):
    out.append("| " + " | ".join(str(cell) for cell in cells) + " |")


def table(out, *head):
    row(out, *head)
    row(out, *["---"] * len(head))


def write(data, path):
    found, out = load(data), []
    out.append("| what was done | how often | lost or wrong |")
    row(out, "---", "---", "---")
    if "kills" in found:
        kills = found["kills"]["scenes"]
        row(out, "killed (SIGKILL) at a random moment, resumed, up to four times in a row", sum(k for k, _ in kills.values()), found["kills"]["wrong"])
    if "cuts" in found:
        cuts = found["cuts"]["readers"]
        row(out, "file cut short, read", sum(c["cuts"] for c in cuts.values()), 0)
        row(out, "file with bits changed, or hostile, read", sum(c["changed"] + c["seeds"] for c in cuts.values()), 0)
    if "memory" in found:
        row(out, "one allocation of the program's own refused, then run again", sum(n for n, _ in found["memory"]["scenes"].values()), 0)
    if "disk" in found:
        row(out, "disk full, then given room", sum(n for _, n in found["disk"]["scenes"].values()) if found["disk"]["scenes"] else "not possible on this machine", 0)
    if "kills" in found:
        out += ["", "## Kills", "", "Moments are random in the run's CPU time: one in eight before the first step, the others while it steps, writes and saves. Where no checkpoint is yet there is nothing to resume and the run begins anew.", ""]
        table(out, "run", "kills", "before its first checkpoint")
        for name, (kills, early) in sorted(found["kills"]["scenes"].items()):
            row(out, name, kills, early)
    if "cuts" in found:
        out += ["", "## Foreign bytes", "", "Each seed of `tests/fuzz/seeds` (checkpoints and frames are made) through its reader: whole, cut after every byte (every 7th of a mesh, at most 4,000 places), with one to three bits changed. Each is read or refused as bad input with words; a crash or another error ends the test. "
                "A part of a scene may be a scene, and another number in a scene, packing, surface or mesh may be a good one; checkpoints and frames bear a mark of all their bytes, and none with a change is taken. gmsh and HDF5 themselves break on damaged files (this is how that was found): a child process tries a .msh first, and a file without its mark never reaches HDF5.", ""]
        table(out, "reader", "seeds", "cuts", "taken", "changed", "taken")
        for name, c in sorted(found["cuts"]["readers"].items()):
            row(out, name, c["seeds"], c["cuts"], c["cuts_taken"], c["changed"], c["changed_taken"])
    if "fuzz" in found:
        out += ["", "## Fuzzing", "", "clang's libFuzzer with the address sanitizer, from the same seeds (`tests/fuzz/README.md`).", ""]
        table(out, "reader", "inputs", "seconds", "crashes, hangs, leaks of address")
        for name, c in sorted(found["fuzz"]["readers"].items()):
            row(out, name, c["inputs"], c["seconds"], c["found"])
    if "memory" in found:
        out += ["", "## Memory and disk", "", "The n-th allocation fails, n spread evenly over all that a run makes (`fail_alloc.c`, preloaded); a tmpfs of some hundred kB holds the results until it is full and is then made larger.", ""]
        table(out, "run", "allocations made", "refused one by one")
        for name, (trials, total) in sorted(found["memory"]["scenes"].items()):
            row(out, name, total, trials)
        if found.get("disk", {}).get("scenes"):
            out.append("")
            table(out, "run", "disks tried", "of them full before the end")
            for name, (tried, stopped) in sorted(found["disk"]["scenes"].items()):
                row(out, name, tried, stopped)
    if "stability" in found:
        out += ["", "## Steps near the critical one", "", found["stability"]["about"], ""]
        table(out, *found["stability"]["head"])
        for cells in found["stability"]["rows"]:
            row(out, *cells)
    if "odd" in found:
        out += ["", "## Uneasy bodies", "", found["odd"]["about"], ""]
        table(out, *found["odd"]["head"])
        for cells in found["odd"]["rows"]:
            row(out, *cells)
    if "drift" in found:
        out += ["", "## Drift", "", found["drift"]["about"], ""]
        table(out, *found["drift"]["head"])
        for cells in found["drift"]["rows"]:
            row(out, *cells)
    if "watch" in found:
        out += ["", "## What the watch costs", "", found["watch"]["about"], ""]
        table(out, *found["watch"]["head"])
        for cells in found["watch"]["rows"]:
            row(out, *cells)
    if "examples" in found:
        out += ["", "## Twice the same", "", found["examples"]["about"], ""]
        table(out, *found["examples"]["head"])
        for cells in found["examples"]["rows"]:
            row(out, *cells)
    out.append(FOUND)
    processor = subprocess.run("grep -m1 'model name' /proc/cpuinfo | cut -d: -f2", shell=True, stdout=subprocess.PIPE, text=True).stdout.strip()
    out += ["", "The parts were run one by one, each on the program as it then was: " + ", ".join("%s %s" % (name, part["date"]) for name, part in sorted(found.items())) + " (%s, %s)." % (platform.system(), processor or "unknown processor"), ""]
    with open(path, "w") as file:
        file.write(HEAD + "\n".join(out))
