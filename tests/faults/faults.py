"""python3 faults.py CLEAVE WHAT... - break runs on purpose.  See README.md beside this file."""
import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile

import kills
import report
import restart
import stability
import starve
import watch
from common import Wrong
from scenes import SCENES

CLEAVE = os.path.abspath(sys.argv[1])
HERE = os.path.dirname(os.path.abspath(__file__))
BUILD = os.path.dirname(os.path.dirname(CLEAVE))
LIBRARY = os.path.join(BUILD, "tests/faults/libfail_alloc.so")
DATA = os.path.join(HERE, "figures.json")
READERS = ("scene", "packing", "stl", "msh", "checkpoint", "frames")


def part_kills(folder, total=216, seed=7):
    return {"scenes": kills.kill_runs(CLEAVE, folder, SCENES, total, seed), "wrong": 0}


def part_cuts(folder):
    found = {}
    for reader in READERS:
        seeds = sorted(glob.glob(os.path.join(HERE, "../fuzz/seeds", reader, "*")))
        done = subprocess.run([os.path.join(BUILD, "tests/fuzz/fuzz_replay"), reader, *seeds], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        numbers = re.search(r"seeds (\d+) cuts (\d+) taken (\d+) changed (\d+) taken (\d+)", done.stdout)
        if done.returncode or not numbers:
            raise Wrong("%s: %d %s" % (reader, done.returncode, done.stdout))
        found[reader] = dict(zip(("seeds", "cuts", "cuts_taken", "changed", "changed_taken"), map(int, numbers.groups())))
        print(done.stdout.strip(), flush=True)
    return {"readers": found}


def part_memory(folder, names=("explicit", "breaking", "switch"), trials=4):
    return {"scenes": {name: (trials, starve.memory(CLEAVE, folder, name, SCENES[name], LIBRARY, trials)) for name in names}}


def part_disk(folder, names=("explicit", "breaking", "switch"), sizes=(100000, 300000)):
    found = {}
    for name in names:
        stopped = starve.full(CLEAVE, folder, name, SCENES[name], sizes)
        if stopped is None:
            print("disk: no tmpfs can be mounted here; skipped", flush=True)
            return {"scenes": {}}
        found[name] = (len(sizes), stopped)
    return {"scenes": found}


def part_fuzz(folder, build="build/fuzz", seconds=300):
    """Needs the fuzzer's own build; FUZZ_BUILD and FUZZ_SECONDS say where it is and how long each reader is tried."""
    build, seconds = os.environ.get("FUZZ_BUILD", build), int(os.environ.get("FUZZ_SECONDS", seconds))
    found = {}
    for reader in READERS:
        corpus = os.path.join(folder, reader)
        os.makedirs(corpus)
        for seed in glob.glob(os.path.join(HERE, "../fuzz/seeds", reader, "*")):
            shutil.copy(seed, corpus)
        env = dict(os.environ, ASAN_OPTIONS="detect_leaks=0")
        done = subprocess.run([os.path.join(build, "tests/fuzz/fuzz_run_" + reader), "-max_total_time=%d" % seconds, "-max_len=8192", "-rss_limit_mb=4000", "-timeout=60", "-print_final_stats=1", "-artifact_prefix=%s/" % folder, corpus],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", env=env)
        inputs = re.search(r"stat::number_of_executed_units: (\d+)", done.stdout)
        if done.returncode:
            raise Wrong("%s: %s" % (reader, done.stdout[-3000:]))
        found[reader] = {"inputs": int(inputs.group(1)), "seconds": seconds, "found": 0}
        print(reader, found[reader], flush=True)
    return {"readers": found}


def make_report(folder, page, part):
    parts = {"kills": part_kills, "cuts": part_cuts, "memory": part_memory, "disk": part_disk, "fuzz": part_fuzz, "stability": lambda f: stability.steps(CLEAVE, f), "odd": lambda f: stability.odd(CLEAVE, f), "drift": lambda f: stability.drift(CLEAVE, f),
             "watch": lambda f: stability.overhead(CLEAVE, f), "examples": lambda f: stability.twice(CLEAVE, f)}
    for name in [part] if part else parts:
        here = os.path.join(folder, name)
        os.makedirs(here)
        report.keep(DATA, name, parts[name](here))
    report.write(DATA, page)


def do(what, folder):
    if what.startswith("restart-"):
        restart.restart(CLEAVE, folder, what[8:], SCENES[what[8:]])
    elif what == "watch":
        watch.causes(CLEAVE, folder)
    elif what == "kills":  # the short form
        kills.kill_runs(CLEAVE, folder, {name: SCENES[name] for name in ("explicit", "breaking", "switch")}, 6, 3)
    elif what == "memory":
        part_memory(folder, ("breaking",), 3)
    elif what == "disk":
        part_disk(folder, ("explicit",), (150000,))
    elif what == "kills-all":
        part_kills(folder)
    elif what == "memory-all":
        part_memory(folder)
        part_disk(folder)
    elif what in ("steps", "drift", "overhead", "twice", "odd"):
        getattr(stability, what)(CLEAVE, folder)
    else:
        {"changed": restart.changed, "stopped": restart.stopped}[what](CLEAVE, folder, SCENES)


def main():
    words = sys.argv[2:]
    folder = tempfile.mkdtemp(prefix="cleave-faults-")
    try:
        if words[0] == "report":
            make_report(folder, words[1], words[3] if len(words) > 3 and words[2] == "--part" else None)
            return 0
        for what in words:
            here = os.path.join(folder, what)
            os.makedirs(here)
            do(what, here)
            print(what, "passed", flush=True)
    except Wrong as wrong:
        print(words, "FAILED:", wrong, flush=True)
        return 1
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
