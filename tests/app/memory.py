"""Memory that `cleave check` predicts against the largest that the run holds, within 30 %.  python3 memory.py CLEAVE SOURCE_TREE"""
import os
import re
import subprocess
import sys
import tempfile

CLEAVE, SOURCE = sys.argv[1], sys.argv[2]
BOX = """\
dimension: 3
time: {end: 1 s, method: static, steps: 1}
materials: {rock: {density: 2500 kg/m3, young: 30 GPa, poisson: 0.2}}
bodies: {block: {geometry: {box: {size: [1 m, 1 m, 1 m]}}, method: fem, material: rock, mesh: {size: %s, cells: %s, order: %d}}}
conditions:
  - {group: zmin, fix: all}
  - {group: zmax, traction: {z: 1 MPa}}
"""
wrong = []


def compare(name, scene):
    """Peak of the process by its own line in the kernel's books: VmHWM as the parent sees it when the child ends."""
    with tempfile.TemporaryDirectory() as here:
        said = subprocess.run([CLEAVE, "check", scene], capture_output=True, text=True, check=True).stdout
        number = re.search(r"memory +about ([0-9.e+]+) MB", said).group(1)
        child = subprocess.Popen([CLEAVE, "run", scene, "--output", os.path.join(here, "out"), "--no-plots", "--threads", "1"], stdout=subprocess.DEVNULL)
        _, status, use = os.wait4(child.pid, 0)
        if status:
            sys.exit(name + ": the run failed")
    predicted, held = float(number), use.ru_maxrss * 1024 / 1e6
    ratio = predicted / held
    print("%-28s predicted %6.0f MB, held %6.0f MB, ratio %.2f" % (name, predicted, held, ratio))
    if not 0.7 <= ratio <= 1.3:
        wrong.append(name)


compare("static, factor, hex8", os.path.join(SOURCE, "examples/elastic_cantilever/scene.yaml"))
compare("static, factor, tri6", os.path.join(SOURCE, "examples/plate_with_hole/scene.yaml"))
compare("explicit", os.path.join(SOURCE, "examples/wave_in_a_bar/scene.yaml"))
compare("particles", os.path.join(SOURCE, "examples/elastic_cylinder/scene.yaml"))
with tempfile.TemporaryDirectory() as here:
    for name, size, cells, order in (("static, two levels, tet10", "6 cm", "tet", 2), ("static, multigrid, hex8", "3.5 cm", "hex", 1)):
        scene = os.path.join(here, "box.yaml")
        with open(scene, "w") as f:
            f.write(BOX % (size, cells, order))
        compare(name, scene)
if wrong:
    sys.exit("not within 30 %: " + ", ".join(wrong))
