"""Finite-element statics beside DOLFINx and CalculiX: whole processes on the same meshes, error against processor time and memory.

python3 bench/fem_peers.py BUILD [DIRECTORY] [--from K] [--sizes N] [--limit SECONDS] [--programs DOLFINx,CalculiX]

Two cases, four sizes each: an eighth of a hollow sphere under pressure (Lame; tet10 with curved sides) and a cantilever
8 x 1 x 1 of hex8 sheared at its end. Every program is a process of its own, one thread, timed and weighed from outside
(wait4): wall and processor time, largest resident memory. Peers run with each of their settings below and the fastest that
converged is kept; those not installed, or longer than the limit, are skipped with a word. Writes fem_peers.csv, .png, .md.
"""
import argparse, csv, os, resource, shutil, subprocess, sys, time
import h5py
import numpy as np

ap = argparse.ArgumentParser()
ap.add_argument("build")
ap.add_argument("directory", nargs="?", default="fem_peers")
ap.add_argument("--sizes", type=int, default=4, help="how many of the four sizes, from the coarsest")
ap.add_argument("--limit", type=float, default=1200, help="longest run of one program [s]")
ap.add_argument("--from", dest="first", type=int, default=0, help="leave out that many of the coarsest")
ap.add_argument("--programs", default="DOLFINx,CalculiX", help="peers to run beside ours")
ap.add_argument("--cases", default="sphere,cantilever")
args = ap.parse_args()
here = os.path.dirname(os.path.abspath(__file__))
CLEAVE = os.path.join(os.path.abspath(args.build), "app", "cleave")
os.makedirs(args.directory, exist_ok=True)
os.chdir(args.directory)
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")

# End deflection of the cantilever, mean over the end [m]: three meshes of hex27 (BUILD/tests/fem/bench_fem_static N 12 -fem_pc_type mg,
# N = 3, 6, 12; there E = 210 GPa), extrapolated
TIP = 0.0097885 * 210
E, NU, P, A, B = 1e9, 0.3, 1e6, 1.0, 2.0  # Young, Poisson, pressure inside; radii
SPHERE = [0.2, 0.11, 0.0625, 0.0528]      # largest element [m]: 13, 66, 315 and over 500 thousand unknowns
BEAM = [8, 16, 24, 28]                    # cells across: 16, 112, 362 and 568 thousand unknowns
GEO = """SetFactory("OpenCASCADE");
Sphere(1) = {0, 0, 0, 2, 0, Pi / 2, Pi / 2};
Sphere(2) = {0, 0, 0, 1, 0, Pi / 2, Pi / 2};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Mesh.MeshSizeMax = %g;
e = 1e-3;
Physical Volume("body") = {3};
Physical Surface("x0") = Surface In BoundingBox {-e, -e, -e, e, 2 + e, 2 + e};
Physical Surface("y0") = Surface In BoundingBox {-e, -e, -e, 2 + e, e, 2 + e};
Physical Surface("z0") = Surface In BoundingBox {-e, -e, -e, 2 + e, 2 + e, e};
Physical Surface("inside") = Surface In BoundingBox {-e, -e, -e, 1 + e, 1 + e, 1 + e};
"""
SCENE = {"sphere": """dimension: 3
time: {end: 1 s, method: static, steps: 1}
materials: {soft: {density: 1000 kg/m3, young: 1 GPa, poisson: 0.3}}
bodies: {body: {geometry: mesh.msh, length_unit: 1 m, method: fem, material: soft}}
conditions:
  - {group: x0, fix: x}
  - {group: y0, fix: y}
  - {group: z0, fix: z}
  - {group: inside, pressure: 1 MPa}
output: {fields: {every: 1 s, names: [displacement]}}
""", "cantilever": """dimension: 3
time: {end: 1 s, method: static, steps: 1}
materials: {soft: {density: 1000 kg/m3, young: 1 GPa, poisson: 0.3}}
bodies: {body: {geometry: mesh.msh, length_unit: 1 m, method: fem, material: soft}}
conditions:
  - {group: xmin, fix: all}
  - {group: xmax, traction: {z: 1 MPa}}
output: {fields: {every: 1 s, names: [displacement]}}
"""}


def make_sphere(h):
    """By gmsh, once: a mesh found in the directory is used again."""
    name = "sphere_%g.msh" % h
    if not os.path.exists(name):
        open("sphere.geo", "w").write(GEO % h)
        subprocess.run(["gmsh", "-3", "-order", "2", "-bin", "sphere.geo", "-o", name, "-v", "1", "-nt", "1"], check=True)
    shutil.copy(name, "mesh.msh")


def make_beam(n):
    """A regular box of hexahedra as gmsh 4.1 text."""
    m = (8 * n, n, n)
    x = [np.linspace(0, L, k + 1) for L, k in zip((8.0, 1.0, 1.0), m)]
    number = np.arange((m[0] + 1) * (n + 1) * (n + 1)).reshape(m[0] + 1, n + 1, n + 1) + 1
    points = np.stack(np.meshgrid(*x, indexing="ij"), -1).reshape(-1, 3)
    i, j, k = [a.ravel() for a in np.meshgrid(*[np.arange(c) for c in m], indexing="ij")]
    corner = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = np.stack([number[i + a, j + b, k + c] for a, b, c in corner], 1)
    j, k = [a.ravel() for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij")]
    side = {t: np.stack([number[t, j + b, k + c] for b, c in ((0, 0), (1, 0), (1, 1), (0, 1))], 1) for t in (0, m[0])}
    with open("mesh.msh", "w") as f:
        f.write('$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 "xmin"\n2 2 "xmax"\n3 3 "body"\n$EndPhysicalNames\n')
        f.write("$Entities\n0 0 2 1\n1 0 0 0 0 1 1 1 1 0\n2 8 0 0 8 1 1 1 2 0\n1 0 0 0 8 1 1 1 3 0\n$EndEntities\n")
        f.write("$Nodes\n1 %d 1 %d\n3 1 0 %d\n" % ((len(points),) * 3))
        np.savetxt(f, np.arange(1, len(points) + 1), fmt="%d")
        np.savetxt(f, points, fmt="%.17g")
        total = len(cells) + 2 * n * n
        f.write("$EndNodes\n$Elements\n3 %d 1 %d\n" % (total, total))
        first = 1
        for dim, tag, kind, list_ in ((2, 1, 3, side[0]), (2, 2, 3, side[m[0]]), (3, 1, 5, cells)):
            f.write("%d %d %d %d\n" % (dim, tag, kind, len(list_)))
            np.savetxt(f, np.column_stack([np.arange(first, first + len(list_)), list_]), fmt="%d")
            first += len(list_)
        f.write("$EndElements\n")


def run(words, name, limit=None):
    """Wall [s], processor [s], largest resident memory [MiB], exit code; None when it took too long."""
    out = open(name + ".log", "w")
    began = time.time()
    child = subprocess.Popen(words, stdout=out, stderr=subprocess.STDOUT)
    while True:
        pid, status, use = os.wait4(child.pid, os.WNOHANG)
        if pid:
            return time.time() - began, use.ru_utime + use.ru_stime, use.ru_maxrss / 1024, os.waitstatus_to_exitcode(status)
        if time.time() - began > (limit or args.limit):
            child.kill()
            os.wait4(child.pid, 0)
            return None
        time.sleep(0.02)


def mesh_arrays():
    """Nodes and top cells (VTK's order) of our own first frame: what every program is given."""
    with h5py.File("ours/fields/000000.h5") as f:
        g = f["fem"]
        return g["points"][:], g["cell_node"][:].reshape(len(g["cell_type"]), -1)


def sphere_exact(x):
    r = np.linalg.norm(x, axis=1)
    k = P * A**3 / (E * (B**3 - A**3))
    return x * (k * ((1 - 2 * NU) + (1 + NU) * B**3 / (2 * r**3)))[:, None]


def error(case, x, u):
    if case == "sphere":
        w = sphere_exact(x)
        return np.sqrt(((u - w) ** 2).sum() / (w**2).sum())
    tip = u[np.isclose(x[:, 0], 8.0), 2].mean()
    return abs(tip / TIP - 1)


def ours(case, x_cells_needed=True):
    open("scene.yaml", "w").write(SCENE[case])
    shutil.rmtree("ours", ignore_errors=True)
    t = run([CLEAVE, "run", "scene.yaml", "--output", "ours", "--threads", "1", "--no-plots"], "ours")
    if t is None or t[3]:
        return t, None
    with h5py.File("ours/fields/000001.h5") as f:
        u = f["fem/point_data/displacement"][:]
    return t, u


DOLFINX = ["default", "coarsened", "hypre"]  # GAMG as its elasticity demo; GAMG with our settings; BoomerAMG
CALCULIX = ["ITERATIVE CHOLESKY", "ITERATIVE SCALING", "SPOOLES"]


def dolfinx(case, setting):
    t = run(["/usr/bin/python3", os.path.join(here, "fem_peers_dolfinx.py"), case, setting], "dolfinx")
    if t is None or t[3]:
        return t, None, None
    d = np.load("dolfinx.npz")
    return t, d["x"], d["u"]


def calculix(case, setting, x, cells):
    quadratic = cells.shape[1] == 10
    with open("ccx.inp", "w") as f:
        f.write("*NODE, NSET=ALL\n")
        np.savetxt(f, np.column_stack([np.arange(1, len(x) + 1), x]), fmt="%d, %.15g, %.15g, %.15g")
        f.write("*ELEMENT, TYPE=%s, ELSET=BODY\n" % ("C3D10" if quadratic else "C3D8I"))
        np.savetxt(f, np.column_stack([np.arange(1, len(cells) + 1), cells + 1]), fmt="%d", delimiter=", ")
        f.write("*MATERIAL, NAME=SOFT\n*ELASTIC\n1e9, 0.3\n*SOLID SECTION, ELSET=BODY, MATERIAL=SOFT\n*BOUNDARY\n")
        for d in range(3 if case == "sphere" else 1):
            for i in np.flatnonzero(np.abs(x[:, d]) < 1e-9) + 1:
                f.write("%d, %d, %d\n" % ((i, d + 1, d + 1) if case == "sphere" else (i, 1, 3)))
        f.write("*STEP\n*STATIC, SOLVER=%s\n1., 1.\n" % setting)
        if case == "sphere":
            on = np.abs(np.linalg.norm(x, axis=1) - A) < 1e-6
            f.write("*DLOAD\n")
            for s, face in enumerate(((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))):
                for c in np.flatnonzero(on[cells[:, face]].all(axis=1)) + 1:
                    f.write("%d, P%d, 1e6\n" % (c, s + 1))
        else:
            end = np.isclose(x[:, 0], 8.0)
            n = round(np.sqrt(end.sum())) - 1
            share = np.where(np.isclose(x[:, 1] % 1, 0), 0.5, 1) * np.where(np.isclose(x[:, 2] % 1, 0), 0.5, 1) / n**2
            f.write("*CLOAD\n")
            for i in np.flatnonzero(end):
                f.write("%d, 3, %.15g\n" % (i + 1, 1e6 * share[i]))
        f.write("*NODE PRINT, NSET=ALL\nU\n*END STEP\n")
    t = run([shutil.which("ccx"), "-i", "ccx"], "ccx")
    if t is None or t[3]:
        return t, None
    u = np.zeros_like(x)
    for line in open("ccx.dat"):
        w = line.split()
        if len(w) == 4 and w[0].isdigit():
            u[int(w[0]) - 1] = [float(v) for v in w[1:]]
    return t, (u if np.abs(u).max() > 0 else None)


def has_dolfinx():
    return subprocess.run(["/usr/bin/python3", "-c", "import dolfinx"], capture_output=True).returncode == 0


rows = []


def keep(case, program, setting, dofs, t, e):
    if t is None:
        rows.append([case, program, setting, dofs, "", "", "", "longer than %g s" % args.limit])
    elif e is None:
        rows.append([case, program, setting, dofs, "%.2f" % t[0], "%.2f" % t[1], "%.0f" % t[2], "no answer (exit %d)" % t[3]])
    else:
        rows.append([case, program, setting, dofs, "%.2f" % t[0], "%.2f" % t[1], "%.0f" % t[2], "%.3e" % e])
    print(*rows[-1], sep="  ", flush=True)
    with open("fem_peers.csv", "w", newline="") as f:
        w = csv.writer(f)
        w.writerow(["case", "program", "setting", "unknowns", "wall[s]", "processor[s]", "memory[MiB]", "error[-]"])
        w.writerows(rows)


for case in args.cases.split(","):
    tired = set()  # settings that took too long once
    for size in (SPHERE if case == "sphere" else BEAM)[args.first : args.sizes]:
        (make_sphere if case == "sphere" else make_beam)(size)
        t, u = ours(case)
        x, cells = mesh_arrays()
        keep(case, "cleave", "as chosen", 3 * len(x), t, None if u is None else error(case, x, u))
        if "DOLFINx" not in args.programs:
            pass
        elif has_dolfinx():
            np.savez("mesh.npz", x=x, cells=cells)
            if not any(r[1] == "DOLFINx" and r[0] == case for r in rows):
                dolfinx(case, DOLFINX[0])  # its compiled forms are then in its cache
            for s in DOLFINX:
                if s in tired:
                    continue
                t, y, u = dolfinx(case, s)
                keep(case, "DOLFINx", s, 3 * len(x), t, None if u is None else error(case, y, u))
                if t is None or t[3]:
                    tired.add(s)
        else:
            print("DOLFINx is not installed (python3-dolfinx): skipped")
        if "CalculiX" not in args.programs:
            pass
        elif shutil.which("ccx"):
            for s in CALCULIX:
                if s in tired:
                    continue
                t, u = calculix(case, s, x, cells)
                keep(case, "CalculiX", s, 3 * len(x), t, None if u is None else error(case, x, u))
                if t is None or t[1] > args.limit / 8:  # a factor grows faster than eightfold from size to size
                    tired.add(s)
        else:
            print("CalculiX is not installed (calculix-ccx): skipped")

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt

good = [r for r in rows if r[4] and "answer" not in r[7]]
best = {}
for r in good:
    k = (r[0], r[1], r[3])
    if k not in best or float(r[5]) < float(best[k][5]):
        best[k] = r
with open("fem_peers.md", "w") as f:
    f.write("| case | unknowns | program (setting) | wall, s | processor, s | memory, MiB | error |\n|---|---|---|---|---|---|---|\n")
    for r in best.values():
        f.write("| %s | %d | %s (%s) | %s | %s | %s | %s |\n" % (r[0], r[3], r[1], r[2].lower(), r[4], r[5], r[6], r[7]))
fig, ax = plt.subplots(1, 2, figsize=(10, 4.2))
for k, case in enumerate(("sphere", "cantilever")):
    for program, mark in (("cleave", "o-"), ("DOLFINx", "s-"), ("CalculiX", "^-")):
        line = sorted((float(r[5]), float(r[7])) for r in best.values() if r[0] == case and r[1] == program)
        if line:
            ax[k].loglog(*zip(*line), mark, label=program)
    ax[k].set(title=case, xlabel="processor time of the whole process [s]", ylabel="relative error of displacement [-]")
    ax[k].grid(True, which="both", alpha=0.3)
    ax[k].legend()
fig.tight_layout()
fig.savefig("fem_peers.png", dpi=110)
