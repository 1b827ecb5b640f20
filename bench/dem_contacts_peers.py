"""Contacts beside LIGGGHTS and YADE on one input: python3 bench/dem_contacts_peers.py BUILD [SIDE [REPEATS]]

SIDE^3 spheres on the lattice of bench_dem_contacts, every sphere pressed against its neighbours, Hertz and Mindlin with friction
and restitution, one thread each. Processor time (user, children) of a long run less that of a short one, so starting costs
nothing; the least of REPEATS (3). A peer that is not installed is skipped with a word.
"""
import resource, shutil, subprocess, sys, tempfile, os

SPACING, RADIUS, DENSITY, DT = 1.99e-3, 1e-3, 2500, 1e-9
SHORT, LONG = 100, 600

LIGGGHTS = """atom_style granular
units si
boundary f f f
newton off
communicate single vel yes
read_data lattice.data
neighbor 0.0003 bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype 1e9
fix m2 all property/global poissonsRatio peratomtype 0.25
fix m3 all property/global coefficientRestitution peratomtypepair 1 0.9
fix m4 all property/global coefficientFriction peratomtypepair 1 0.3
pair_style gran model hertz tangential history
pair_coeff * *
timestep {dt}
fix integrate all nve/sphere
thermo 1000000
run {steps}
"""

YADE = """from yade import *
from yade import utils
m = FrictMat(young=1e9, poisson=0.25, frictionAngle=0.2915, density=2500)
O.materials.append(m)
for line in open('lattice.txt'):
    x, y, z, r = map(float, line.split())
    O.bodies.append(utils.sphere((x, y, z), r, material=m))
O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=0.0003),
  InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_MindlinPhys(en=0.9, es=0.9)], [Law2_ScGeom_MindlinPhys_Mindlin()]),
  NewtonIntegrator(damping=0)]
O.dt = {dt}
O.run({steps}, True)
print('contacts', O.interactions.countReal())
import os; os._exit(0)
"""


def cpu(command, folder):
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    environment = dict(os.environ, OMP_NUM_THREADS='1', OMPI_ALLOW_RUN_AS_ROOT='1', OMPI_ALLOW_RUN_AS_ROOT_CONFIRM='1')
    done = subprocess.run(command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        sys.exit(f'{command[0]} failed:\n{done.stdout[-800:]}')
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def peer(name, command, script, folder, repeats):
    if not shutil.which(command[0]):
        print(f'{name}: not installed, skipped')
        return None
    least = {}
    for steps in (SHORT, LONG):
        with open(f'{folder}/{name}.{steps}.py', 'w') as f:
            f.write(script.format(dt=DT, steps=steps))
        least[steps] = min(cpu(command + [f'{name}.{steps}.py'], folder) for _ in range(repeats))
    if least[LONG] < 2 * least[SHORT]:
        print(f'{name}: its start hides its steps ({least[SHORT]:.2g} and {least[LONG]:.2g} s); more spheres are needed')
        return None
    return (least[LONG] - least[SHORT]) / (LONG - SHORT)


def main():
    build, side = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 27
    repeats = int(sys.argv[3]) if len(sys.argv) > 3 else 3
    n, contacts = side**3, 3 * side**2 * (side - 1)
    bench = subprocess.run([f'{build}/tests/dem/bench_dem_contacts', '-side', str(side)], stdout=subprocess.PIPE, text=True, check=True,
                           env=dict(os.environ, OMP_NUM_THREADS='1', OPENBLAS_NUM_THREADS='1')).stdout
    ours = float(bench.split('step ')[1].split(' ms')[0]) * 1e-3
    at = [SPACING * (k + 0.5) for k in range(side)]
    with tempfile.TemporaryDirectory() as folder:
        with open(f'{folder}/lattice.txt', 'w') as t, open(f'{folder}/lattice.data', 'w') as d:
            end = SPACING * side
            d.write(f'lattice\n\n{n} atoms\n1 atom types\n\n' + ''.join(f'{-RADIUS} {end + RADIUS} {c}lo {c}hi\n' for c in 'xyz') + '\nAtoms\n\n')
            for k in range(n):
                x, y, z = at[k % side], at[k // side % side], at[k // side // side]
                t.write(f'{x:.9g} {y:.9g} {z:.9g} {RADIUS}\n')
                d.write(f'{k + 1} 1 {2 * RADIUS} {DENSITY} {x:.9g} {y:.9g} {z:.9g}\n')
        rows = [('cleave', ours), ('liggghts', peer('liggghts', ['liggghts', '-log', 'none', '-in'], LIGGGHTS, folder, repeats)), ('yade', peer('yade', ['yade', '-n', '-x', '-j1'], YADE, folder, repeats))]
    print(f'{n} spheres, {contacts} contacts\n{"":10}{"us/contact-step":>16}{"us/sphere-step":>16}{"ratio":>8}')
    for name, t in rows:
        if t is not None:
            print(f'{name:10}{1e6 * t / contacts:16.4f}{1e6 * t / n:16.4f}{t / ours:8.2f}')


main()
