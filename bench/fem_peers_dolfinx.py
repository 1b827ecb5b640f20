"""One solve by DOLFINx for fem_peers.py: mesh.npz (x, cells in VTK's order) in, dolfinx.npz (x, u) out.  CASE SETTING"""
import sys
import numpy as np
import ufl
import dolfinx
from dolfinx import fem, mesh
from dolfinx.fem.petsc import assemble_matrix, assemble_vector, apply_lifting, set_bc
from mpi4py import MPI
from petsc4py import PETSc

case, setting = sys.argv[1:3]
d = np.load("mesh.npz")
sphere = case == "sphere"
kind, order = ("tetrahedron", 2) if sphere else ("hexahedron", 1)
type_ = mesh.CellType.tetrahedron if sphere else mesh.CellType.hexahedron
perm = dolfinx.cpp.io.perm_vtk(type_, d["cells"].shape[1])
cells = np.ascontiguousarray(d["cells"][:, perm], dtype=np.int64)
domain = mesh.create_mesh(MPI.COMM_WORLD, cells, d["x"], ufl.Mesh(ufl.VectorElement("Lagrange", ufl.Cell(kind, geometric_dimension=3), order)))
V = fem.VectorFunctionSpace(domain, ("Lagrange", order))
E, nu = 1e9, 0.3
mu, lam = E / 2 / (1 + nu), E * nu / (1 + nu) / (1 - 2 * nu)
u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
eps = lambda w: ufl.sym(ufl.grad(w))
a = fem.form((2 * mu * ufl.inner(eps(u), eps(v)) + lam * ufl.div(u) * ufl.div(v)) * ufl.dx(metadata={"quadrature_degree": 2}))
on = (lambda x: np.abs(np.linalg.norm(x, axis=0) - 1) < 1e-6) if sphere else (lambda x: np.isclose(x[0], 8))
facets = np.sort(mesh.locate_entities_boundary(domain, 2, on))
ds = ufl.Measure("ds", subdomain_data=mesh.meshtags(domain, 2, facets, np.ones(len(facets), np.int32)))
load = -1e6 * ufl.inner(ufl.FacetNormal(domain), v) * ds(1) if sphere else 1e6 * v[2] * ds(1)
zero = PETSc.ScalarType(0)
bcs = []
for k in range(3):
    face = mesh.locate_entities_boundary(domain, 2, lambda x: np.abs(x[k if sphere else 0]) < 1e-9)
    bcs.append(fem.dirichletbc(zero, fem.locate_dofs_topological(V.sub(k), 2, face), V.sub(k)))
A = assemble_matrix(a, bcs=bcs)
A.assemble()
b = assemble_vector(fem.form(load))
apply_lifting(b, [a], bcs=[bcs])
b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
set_bc(b, bcs)
uh = fem.Function(V)
x = V.tabulate_dof_coordinates()
modes = []
for k in range(6):
    w = np.zeros((len(x), 3))
    if k < 3:
        w[:, k] = 1
    else:
        i, j = (k + 1) % 3, (k + 2) % 3
        w[:, i], w[:, j] = -x[:, j], x[:, i]
    m = A.createVecLeft()
    m.array[:] = w[: m.local_size // 3].ravel()
    for o in modes:
        m.axpy(-m.dot(o), o)
    m.normalize()
    modes.append(m)
A.setNearNullSpace(PETSc.NullSpace().create(vectors=modes))
A.setOption(PETSc.Mat.Option.SPD, True)
o = PETSc.Options()
o["ksp_type"], o["ksp_rtol"] = "cg", 1e-8
if setting == "hypre":
    o["pc_type"], o["pc_hypre_type"] = "hypre", "boomeramg"
    for k, w in {"strong_threshold": 0.5, "nodal_coarsen": 4, "vec_interp_variant": 2, "P_max": 4, "agg_nl": 0}.items():
        o["pc_hypre_boomeramg_" + k] = w
else:
    o["pc_type"] = "gamg"
    o["mg_levels_ksp_type"], o["mg_levels_pc_type"] = "chebyshev", "jacobi"
    o["mg_levels_ksp_chebyshev_esteig_steps"] = 10
    if setting == "coarsened":
        for k, w in {"pc_gamg_aggressive_coarsening": 1, "pc_gamg_threshold": 0.001, "pc_gamg_coarse_eq_limit": 200, "pc_gamg_agg_nsmooths": 1, "mg_levels_ksp_max_it": 2,
                     "mg_levels_ksp_chebyshev_esteig": "0,0.05,0,1.1", "pc_gamg_esteig_ksp_type": "cg"}.items():
            o[k] = w
solver = PETSc.KSP().create(MPI.COMM_WORLD)
solver.setOperators(A)
solver.setFromOptions()
solver.solve(b, uh.vector)
print(setting, solver.getIterationNumber(), "iterations", solver.getConvergedReason())
if solver.getConvergedReason() < 0:
    sys.exit(3)
np.savez("dolfinx.npz", x=x, u=uh.x.array.reshape(-1, 3))
