"""Kill runs at random moments, resume them, compare with the undisturbed run bit by bit.

A run is killed (SIGKILL), resumed, killed again, ... up to four times, then left to finish. Moments are random in the
run's own CPU time: one in eight before the first step, the others while it steps, writes and saves. Where the kill came before the first
checkpoint there is nothing to resume and the run begins anew, as a user would.
"""
import os
import random
import signal

from common import Wrong, command, cpu_of, fresh, lay_out, results, run, run_until, same


def moment(begin, end, dice):
    return dice.uniform(0.05, 1) * begin if dice.random() < 0.125 else begin + dice.uniform(0, 0.8) * (end - begin)


def chain(cleave, folder, whole, span, wanted, dice):
    """Up to `wanted` kills of one run; returns how many, and how many came before a checkpoint was there."""
    output = fresh(os.path.join(folder, "killed"))
    kills = early = 0
    for leg in range(5):
        there = os.path.exists(os.path.join(output, "checkpoint.h5"))
        words = command(cleave, "killed", *(["--resume"] if there else []))
        if leg == 4 or kills == wanted:
            code, said = run(words, folder)
        else:
            code, said = run_until(words, folder, moment(*span, dice), signal.SIGKILL)
        if code == -signal.SIGKILL:
            kills += 1
            early += not os.path.exists(os.path.join(output, "checkpoint.h5"))
            continue
        if code:
            raise Wrong("a run that was killed %d times and resumed gave %d: %s" % (kills, code, said))
        break
    other = same(whole, results(output))
    if other:
        raise Wrong("after %d kills these differ: %s" % (kills, ", ".join(other[:8])))
    return kills, early


def kill_runs(cleave, folder, scenes, total, seed, say=print):
    """`total` kills, spread over the scenes. Returns {scene: (kills, early)}."""
    dice = random.Random(seed)
    table = {}
    for number, name in enumerate(sorted(scenes)):
        share = total // len(scenes) + (number < total % len(scenes))
        here = lay_out(os.path.join(folder, name), scenes[name])
        fresh(os.path.join(here, "whole"))
        span = cpu_of(command(cleave, "whole"), here, "whole/history.csv")
        whole = results(os.path.join(here, "whole"))
        kills = early = tries = 0
        while kills < share and tries < 20 + 2 * share:
            made, before = chain(cleave, here, whole, span, min(4, share - kills), dice)
            kills, early, tries = kills + made, early + before, tries + 1
        table[name] = (kills, early)
        say("%-13s %3d kills, %d before the first checkpoint; the same bits" % (name, kills, early), flush=True)
    return table
