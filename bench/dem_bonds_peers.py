"""Bonded spheres beside YADE's concrete model on one packing: python3 bench/dem_bonds_peers.py BUILD [PARTICLES [REPEATS]]

The random packing of bench_dem_bonds; bonds of ours by the power diagram (`exact`) or by range (`onate2015` with the published law),
YADE's (CpmMat, damage, plasticity and breakage on) between spheres whose gap is below a tenth of their radii, grown once. Whole
steps, one thread. YADE's processor time is that of a long run less that of a short one, so starting costs nothing; the least of
REPEATS (2). Ours: best of many short repeats within one process (its own bench), run before and after.
"""
import os, resource, shutil, subprocess, sys, tempfile

SHORT, LONG = 20, 120
OURS = ["intact", "cohesive", "published", "softening"]

YADE = """from yade import *
from yade import utils
m = CpmMat(young=1e9, poisson=0.2, frictionAngle=0.5, sigmaT=1e6, epsCrackOnset=1e-3, relDuctility=10, isoPrestress=0, density=1)
O.materials.append(m)
for line in open('packing.txt'):
    if line.startswith('#'):
        continue
    x, y, z, r = map(float, line.replace(',', ' ').split())
    O.bodies.append(utils.sphere((x, y, z), r, material=m))
grow = 1.1
O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=grow, label='aabb')], verletDist=0.05),
  InteractionLoop([Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=grow, label='reach')], [Ip2_CpmMat_CpmMat_CpmPhys()], [Law2_ScGeom_CpmPhys_Cpm()]),
  NewtonIntegrator(damping=0.1)]
O.dt = 1e-9
O.run(1, True)
aabb.aabbEnlargeFactor = 1
reach.interactionDetectionFactor = 1
O.run({steps}, True)
print('bonds', O.interactions.countReal())
import os; os._exit(0)
"""


def cpu(command, folder):
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run(command, cwd=folder, env=dict(os.environ, OMP_NUM_THREADS="1"), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        sys.exit(f"{command[0]} failed:\n{done.stdout[-800:]}")
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, done.stdout


def ours(build, folder, particles):
    out = subprocess.run([f"{build}/tests/dem/bench_dem_bonds", "-particles", str(particles), "-laws", ",".join(OURS), "-write", f"{folder}/packing.txt", "-repeats", "20"],
                         stdout=subprocess.PIPE, text=True, check=True).stdout
    rows = [line.split(",") for line in out.splitlines()[1:]]
    return {law: [(int(r[4]), float(r[5])) for r in rows if r[1] == law and r[2] == "1"][-1] for law in OURS}


def main():
    build, particles = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 60000
    repeats = int(sys.argv[3]) if len(sys.argv) > 3 else 2
    with tempfile.TemporaryDirectory() as folder:
        first = ours(build, folder, particles)
        yade = None
        if shutil.which("yade"):
            least = {}
            for steps in (SHORT, LONG):
                with open(f"{folder}/yade{steps}.py", "w") as f:
                    f.write(YADE.replace("{steps}", str(steps)))
                runs = [cpu(["yade", "-n", "-x", "-j1", f"yade{steps}.py"], folder) for _ in range(repeats)]
                least[steps] = min(r[0] for r in runs)
                bonds = int(runs[0][1].split("bonds ")[1].split()[0])
            yade = 1e9 * (least[LONG] - least[SHORT]) / (LONG - SHORT) / bonds
        else:
            print("yade is not installed, skipped")
        again = ours(build, folder, particles)
    print(f"{particles} spheres packed at random, one thread\n{'':34}{'bonds':>8}{'ns/bond-step':>14}{'YADE over it':>14}")
    for law in OURS:
        n, t = first[law][0], min(first[law][1], again[law][1])
        print(f"{'cleave, ' + law:34}{n:8d}{t:14.1f}" + (f"{yade / t:14.1f}" if yade else ""))
    if yade:
        print(f"{'yade, CPM':34}{bonds:8d}{yade:14.1f}")


main()
