"""Runs on a disk that fills up, and runs whose memory is refused: a clear error, nothing corrupted, and the run goes on once there is room."""
import os
import subprocess

from common import Wrong, command, fresh, lay_out, results, run, same


def finish(cleave, here, output, whole, what):
    """Resume, or begin anew where no checkpoint is yet; the end must be that of the undisturbed run."""
    there = os.path.exists(os.path.join(here, output, "checkpoint.h5"))
    code, said = run(command(cleave, output, *(["--resume"] if there else [])), here)
    if code:
        raise Wrong("after %s the run cannot go on (%d): %s" % (what, code, said))
    other = same(whole, results(os.path.join(here, output)))
    if other:
        raise Wrong("after %s these differ: %s" % (what, ", ".join(other[:8])))
    return there


def whole_run(cleave, folder, name, scene):
    here = lay_out(os.path.join(folder, name), scene)
    fresh(os.path.join(here, "whole"))
    code, said = run(command(cleave, "whole"), here)
    if code:
        raise Wrong("the undisturbed run gave %d: %s" % (code, said))
    return here, results(os.path.join(here, "whole"))


def refused(code, said, what, words):
    if code not in (1, 2) or not any(word in said for word in words):
        raise Wrong("%s: exit %s and no word of it: %s" % (what, code, said[-800:]))
    if "Traceback" in said or "terminate called" in said:
        raise Wrong("%s: %s" % (what, said[-800:]))


DISK = ("disk", "No space left", "Cannot write", "cannot", "could not")


def full(cleave, folder, name, scene, sizes):
    """A real disk of so many bytes (a tmpfs); None where this machine lets nobody mount one."""
    here, whole = whole_run(cleave, folder, name, scene)
    stopped = 0
    for size in sizes:
        output = os.path.join(fresh(os.path.join(here, "full")), "out")
        os.makedirs(os.path.dirname(output))
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=%d" % size, "tmpfs", os.path.dirname(output)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode:
            return None
        try:
            code, said = run(command(cleave, "full/out"), here)
            if code:
                refused(code, said, "%s, a disk of %d bytes" % (name, size), DISK)
                stopped += 1
            subprocess.run(["mount", "-o", "remount,size=200m", os.path.dirname(output)], check=True)
            finish(cleave, here, "full/out", whole, "a disk of %d bytes" % size)
        finally:
            subprocess.run(["umount", os.path.dirname(output)])
    return stopped


def memory(cleave, folder, name, scene, library, trials):
    """The n-th allocation of the program's own fails, n spread over the run."""
    here, whole = whole_run(cleave, folder, name, scene)
    count = os.path.join(here, "count")
    env = dict(os.environ, LD_PRELOAD=library, FAIL_COUNT=count)
    fresh(os.path.join(here, "starved"))
    code, said = run(command(cleave, "starved"), here, env=env)
    if code:
        raise Wrong("counted, the run gives %d: %s" % (code, said))
    with open(count) as file:
        total = int(file.read())
    for k in range(trials):
        number = 1 + (2 * k + 1) * total // (2 * trials)
        fresh(os.path.join(here, "starved"))
        code, said = run(command(cleave, "starved"), here, env=dict(env, FAIL_AT=str(number)))
        refused(code, said, "%s, allocation %d of %d" % (name, number, total), ("emory",))
        finish(cleave, here, "starved", whole, "a failed allocation")
    return total
