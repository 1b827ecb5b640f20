/* fem_case.h - meshes and models that several tests build: boxes with moved inner nodes, a group per node, exact fields on the boundary. */
#pragma once
#include "check.h"
#include "fem.h"

/* Exact displacement [m] at x. */
typedef void (*CaseField)(const PetscReal x[3], PetscReal u[3]);

/* Box of size length[] from the origin; corners moved by up to `distort` of a cell (those of a side within it), the same on every
   machine; cells stay straight. */
PetscErrorCode CaseBox(MPI_Comm comm, MeshCellType type, const PetscReal length[3], const PetscInt n[3], PetscReal distort, Mesh *mesh);

/* Nodes between corners back to the middle of those. */
PetscErrorCode CaseStraighten(Mesh *mesh);

/* A point group "node I" for each of these nodes (rank 0). */
PetscErrorCode CaseAddNodeGroups(Mesh *mesh, PetscInt n, const PetscInt node[]);
/* A facet group "PREFIX I" for each cell of the group (rank 0); returns how many. */
PetscErrorCode CaseSplitGroup(Mesh *mesh, const char *group, const char *prefix, PetscInt *n);

/* A line group of the mesh's nodes on the straight line from a to b (rank 0). */
PetscErrorCode CaseAddLine(Mesh *mesh, const char *name, const PetscReal a[3], const PetscReal b[3]);

/* Nodes of the box's surface (or of one side, 2*d + max, when side >= 0). list is the caller's, [n_nodes]. */
PetscInt CaseSurface(const Mesh *mesh, const PetscReal length[3], PetscInt side, PetscInt list[]);

/* Fix all components of the nodes whose groups CaseAddNodeGroups made to the field. All ranks pass the same nodes and places. */
PetscErrorCode CaseFixNodes(FemModel model, PetscInt dim, PetscInt n, const PetscInt node[], const PetscReal x[], CaseField field);

/* Model of one material on a mesh; not yet set up. */
PetscErrorCode CaseModel(MPI_Comm comm, const Mesh *mesh, FemKind kind, FemMethod method, PetscReal thickness, const FemMaterial *material, FemModel *model);

PetscErrorCode CaseFix(FemModel model, const char *group, PetscInt component, PetscReal value);
PetscErrorCode CaseFixVelocity(FemModel model, const char *group, PetscInt component, PetscReal value);
PetscErrorCode CaseTraction(FemModel model, const char *group, PetscReal x, PetscReal y, PetscReal z);

/* One static step to t = 1. */
PetscErrorCode CaseSolve(FemModel model);
PetscReal      CaseHistory(FemModel model, const char *name); /* value of a history column; NaN when there is none */
PetscErrorCode CaseLedger(FemModel model, Ledger *ledger);

PetscInt CaseNodeAt(const Mesh *mesh, PetscReal x, PetscReal y, PetscReal z); /* nearest node */
