"""python3 faults.py CLEAVE WHAT... - break runs on purpose.  See README.md beside this file."""
import os
import shutil
import sys
import tempfile

import restart
import watch
from common import Wrong
from scenes import SCENES

CLEAVE = os.path.abspath(sys.argv[1])


def main():
    for what in sys.argv[2:]:
        folder = tempfile.mkdtemp(prefix="cleave-faults-")
        try:
            if what.startswith("restart-"):
                restart.restart(CLEAVE, folder, what[8:], SCENES[what[8:]])
            else:
                {"watch": lambda cleave, folder, _: watch.causes(cleave, folder), "changed": restart.changed, "stopped": restart.stopped}[what](CLEAVE, folder, SCENES)
            print(what, "passed", flush=True)
        except Wrong as wrong:
            print(what, "FAILED:", wrong, flush=True)
            return 1
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
