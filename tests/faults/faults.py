"""python3 faults.py CLEAVE WHAT... - break runs on purpose; CLEAVE report PAGE makes docs/reliability.md.  See README.md beside this file."""
import argparse
import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

import inputs
import kills
import report
import restart
import stability
import starve
import uneasy
import watch
from common import Wrong
from scenes import SCENES

CLEAVE = os.path.abspath(sys.argv[1])
HERE = os.path.dirname(os.path.abspath(__file__))
SOURCE = os.path.normpath(os.path.join(HERE, "../.."))
BUILD = os.path.dirname(os.path.dirname(CLEAVE))
LIBRARY = os.path.join(BUILD, "tests/faults/libfail_alloc.so")
DATA = os.path.join(HERE, "figures.json")
READERS = ("scene", "packing", "stl", "msh", "checkpoint", "frames")
STARVED = ("explicit", "breaking", "switch")


def seeds_of(reader):
    return sorted(glob.glob(os.path.join(SOURCE, "tests/fuzz/seeds", reader, "*")))


def over(names, row):
    """A part of the report that does one name after the other."""
    def part(folder, done, keep):
        for name in names:
            if name not in done:
                keep([name, *row(folder, name)])
    return part


def cut(folder, reader):
    done = subprocess.run([os.path.join(BUILD, "tests/fuzz/fuzz_replay"), reader, *seeds_of(reader)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    numbers = re.search(r"seeds (\d+) cuts (\d+) taken (\d+) changed (\d+) taken (\d+)", done.stdout)
    if done.returncode or not numbers:
        raise Wrong("%s: %d %s" % (reader, done.returncode, done.stdout))
    return map(int, numbers.groups())


def fuzz(folder, reader):
    """With clang's fuzzer, in a build of its own that is made here if need be; FUZZ_BUILD and FUZZ_SECONDS say where it is and how long each reader is tried."""
    build, seconds = os.environ.get("FUZZ_BUILD", os.path.join(SOURCE, "build/fuzz")), int(os.environ.get("FUZZ_SECONDS", 60))
    program = os.path.join(build, "tests/fuzz/fuzz_run_" + reader)
    if not os.path.exists(program):
        for words in (["cmake", "-S", SOURCE, "-B", build, "-G", "Ninja", "-DCLEAVE_FUZZ=ON", "-DCLEAVE_NATIVE=OFF"], ["ninja", "-C", build, "fuzz_run_" + reader]):
            made = subprocess.run(words, env=dict(os.environ, CC="clang", CXX="clang++"), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            if made.returncode:
                raise Wrong("the fuzzer's build: " + made.stdout[-2000:])
    corpus = os.path.join(folder, reader)
    os.makedirs(corpus)
    for seed in seeds_of(reader):
        shutil.copy(seed, corpus)
    done = subprocess.run([program, "-max_total_time=%d" % seconds, "-max_len=8192", "-rss_limit_mb=4000", "-timeout=60", "-print_final_stats=1", "-artifact_prefix=%s/" % folder, corpus],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", env=dict(os.environ, ASAN_OPTIONS="detect_leaks=0"))
    if done.returncode:
        raise Wrong("%s: %s" % (reader, done.stdout[-3000:]))
    return int(re.search(r"stat::number_of_executed_units: (\d+)", done.stdout).group(1)), seconds, 0


def disks(folder, name, sizes=(100000, 300000)):
    stopped = starve.full(CLEAVE, folder, name, SCENES[name], sizes)
    if stopped is None:
        raise Wrong("no tmpfs can be mounted here (it takes root)")
    return len(sizes), stopped


def killed(folder, name, total=216):
    names = sorted(SCENES)
    share = total // len(names) + (names.index(name) < total % len(names))
    return kills.kill_runs(CLEAVE, folder, {name: SCENES[name]}, share, "seed 7 " + name)[name]


PARTS = {
    "kills": over(sorted(SCENES), killed),
    "restart": lambda folder, done, keep: restart.all_restarts(CLEAVE, folder, SCENES, done, keep),
    "cuts": over(READERS, cut),
    "inputs": lambda folder, done, keep: inputs.inputs(CLEAVE, folder, done, keep),
    "fuzz": over(READERS, fuzz),
    "memory": over(STARVED, lambda folder, name: (starve.memory(CLEAVE, folder, name, SCENES[name], LIBRARY, 20), 20)),
    "disk": over(STARVED, disks),
    "stability": lambda folder, done, keep: stability.steps(CLEAVE, folder, done=done, keep=keep),
    "odd": lambda folder, done, keep: uneasy.odd(CLEAVE, folder, done=done, keep=keep),
    "scatter": lambda folder, done, keep: uneasy.scatter(CLEAVE, folder, done, keep),
    "drift": lambda folder, done, keep: stability.drift(CLEAVE, folder, done=done, keep=keep),
    "bystander": lambda folder, done, keep: [keep(row) for row in uneasy.bystander(CLEAVE, folder, 100000) if row[0] not in done],
    "watch": lambda folder, done, keep: stability.overhead(CLEAVE, folder, done, keep),
    "examples": lambda folder, done, keep: stability.twice(CLEAVE, folder, done=done, keep=keep),
}


class TimeIsUp(Exception):
    pass


def make_report(folder, words):
    """Rows made by this very program are kept, the others made; what is found is kept row by row, so that a report that was stopped goes on."""
    p = argparse.ArgumentParser(prog="faults.py CLEAVE report", description=make_report.__doc__)
    p.add_argument("page")
    p.add_argument("--part", nargs="+", choices=list(PARTS), default=list(PARTS), help="only these parts")
    p.add_argument("--fresh", action="store_true", help="make every row anew")
    p.add_argument("--page-only", action="store_true", help="write the page of the rows there are")
    p.add_argument("--minutes", type=float, default=1e9, help="stop after the row in which so much time is up")
    p.add_argument("--figures", default=DATA, help="the file that holds the rows")
    args = p.parse_args(words)
    begin, figures, bad = time.time(), report.Figures(args.figures, report.program(CLEAVE), args.fresh), []

    def keeper(part):
        def keep(row):
            figures.keep(part, row)
            print(part, *row, sep="  ", flush=True)
            if time.time() - begin > 60 * args.minutes:
                raise TimeIsUp
        return keep

    try:
        for part in [] if args.page_only else args.part:
            here = os.path.join(folder, part)
            os.makedirs(here)
            try:
                PARTS[part](here, figures.done(part), keeper(part))
            except Wrong as wrong:
                bad.append("%s: %s" % (part, wrong))
                print("BAD", bad[-1], flush=True)
    except TimeIsUp:
        print("time is up; the same command goes on", flush=True)
    report.write(figures, args.page)
    if bad:
        raise Wrong("; ".join(bad))


def nothing(row):
    pass


def do(what, folder):
    if what.startswith("restart-"):
        restart.restart(CLEAVE, folder, what[8:], SCENES[what[8:]])
    elif what.startswith("ranks-"):
        restart.ranks(CLEAVE, folder, what[6:], SCENES[what[6:]])
    elif what == "watch":
        watch.causes(CLEAVE, folder)
    elif what == "kills":  # the short form
        kills.kill_runs(CLEAVE, folder, {name: SCENES[name] for name in STARVED}, 6, 3)
    elif what == "memory":
        starve.memory(CLEAVE, folder, "breaking", SCENES["breaking"], LIBRARY, 3)
    elif what == "disk":
        if starve.full(CLEAVE, folder, "explicit", SCENES["explicit"], (150000,)) is None:
            print("no tmpfs can be mounted here; skipped", flush=True)
    elif what.endswith("-all"):  # a part of the report, whole
        PARTS[what[:-4]](folder, (), nothing)
    elif what == "odd":
        uneasy.odd(CLEAVE, folder, quick=True)
    elif what == "bystander":
        uneasy.bystander(CLEAVE, folder)
    elif what in ("files", "places", "texts", "meshes"):
        print(getattr(inputs, what)(CLEAVE, folder), "tried", flush=True)
    else:
        {"changed": restart.changed, "stopped": restart.stopped}[what](CLEAVE, folder, SCENES)


def main():
    words = sys.argv[2:]
    folder = tempfile.mkdtemp(prefix="cleave-faults-")
    try:
        if words[0] == "report":
            make_report(folder, words[1:])
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
