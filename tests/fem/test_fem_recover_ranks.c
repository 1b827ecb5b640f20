/* Recovered stress of two materials, its estimate and probes: one answer on any number of ranks. The displacement is given, not solved for. */
#include "fem_case.h"
#include "fem_impl.h"

static void Wave(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * sin(3 * x[0] + x[1]) * cos(2 * x[2]);
  u[1] = 1e-3 * x[0] * x[1] * exp(x[2]);
  u[2] = 1e-3 * cos(x[0] - 2 * x[1] + x[2]);
}

/* Cells beyond a slanted plane are of the second material, so that the seam has corners. */
static PetscErrorCode Build(MPI_Comm comm, MeshCellType type, FemModel *model)
{
  static const char *const quantity[] = {"displacement", "stress", "von_mises"};
  const FemMaterial        m[2] = {{2400, 3e9, 0.3}, {7800, 2e11, 0.2}};
  const PetscReal          length[3] = {1, 0.5, 0.5}, at[3] = {0.52, 0.21, 0.33}, edge[3] = {1, 0.5, 0.5};
  const PetscInt           n[3] = {9, 6, 5};
  PetscMPIInt              rank;
  Mesh                     mesh;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(CaseBox(comm, type, length, n, 0.2, &mesh));
  if (rank == 0) {
    PetscCall(PetscRealloc(sizeof(MeshGroup) * (mesh.n_groups + 2), &mesh.group));
    for (PetscInt side = 0; side < 2; side++) {
      MeshGroup *group = &mesh.group[mesh.n_groups++];

      PetscCall(PetscMemzero(group, sizeof(*group)));
      PetscCall(PetscStrncpy(group->name, side ? "far" : "near", sizeof(group->name)));
      group->dim = mesh.dim;
      PetscCall(PetscMalloc1(mesh.n_cells, &group->cell));
      for (PetscInt c = 0; c < mesh.n_cells; c++) {
        const PetscReal *x = &mesh.x[3 * mesh.node[mesh.start[c]]];

        if (MeshCellDim(mesh.type[c]) == mesh.dim && (x[0] + 0.7 * x[1] - 0.2 * x[2] > 0.6) == side) group->cell[group->n_cells++] = c;
      }
    }
  }
  PetscCall(FemModelCreate(comm, model));
  PetscCall(FemModelSetKind(*model, MeshCellDim(type) == 2 ? FEM_PLANE_STRESS : FEM_SOLID, 1));
  PetscCall(FemModelSetMethod(*model, FEM_EXPLICIT));
  PetscCall(FemModelSetMesh(*model, &mesh));
  PetscCall(FemModelAddMaterial(*model, "near", &m[0]));
  PetscCall(FemModelAddMaterial(*model, "far", &m[1]));
  PetscCall(FemModelAddProbe(*model, "A", at, 3, quantity));
  PetscCall(FemModelAddProbe(*model, "B", edge, 3, quantity));
  PetscCall(FemModelAddHistory(*model, "error", ""));
  PetscCall(FemModelSetUp(*model));
  for (PetscInt i = 0; i < (*model)->n_own; i++) {
    PetscReal x[3] = {0, 0, 0}, u[3];

    for (PetscInt d = 0; d < (*model)->dim; d++) x[d] = (*model)->x[i * (*model)->dim + d];
    Wave(x, u);
    for (PetscInt d = 0; d < (*model)->dim; d++) (*model)->u[i * (*model)->dim + d] = u[d];
  }
  PetscCall(FemGhosts(*model, (*model)->u));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stress and strain of every point on rank 0, then the history on all. */
static PetscErrorCode Collect(FemModel model, PetscInt *n, PetscReal **data)
{
  Stepper  s;
  PetscInt points;

  PetscFunctionBeginUser;
  PetscCall(FemModelGetPoints(model, &points, NULL));
  PetscCall(FemModelGetStepper(model, &s));
  *n = 12 * points;
  PetscCall(PetscCalloc1(*n + s.n_history, data));
  PetscCall(FemModelRecover(model, *data, *data + 6 * points));
  for (PetscInt i = 0; i < s.n_history; i++) PetscCall(s.history(s.ctx, i, *data + *n + i));
  *n += s.n_history;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Compare(MeshCellType type)
{
  PetscMPIInt rank;
  FemModel    model;
  FemReadings all, one;
  PetscInt    n, m;
  PetscReal  *together, *alone;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(Build(PETSC_COMM_WORLD, type, &model));
  PetscCall(Collect(model, &n, &together));
  PetscCall(FemModelGetReadings(model, &all));
  PetscCall(FemModelDestroy(&model));
  if (rank == 0) {
    PetscInt nodes, points;

    PetscCall(Build(PETSC_COMM_SELF, type, &model));
    PetscCall(Collect(model, &m, &alone));
    PetscCall(FemModelGetReadings(model, &one));
    PetscCall(FemModelGetCounts(model, &nodes, NULL, NULL));
    PetscCall(FemModelGetPoints(model, &points, NULL));
    CheckAbove(points, nodes + 1);
    CheckInt(n, m);
    CheckInt(all.recoveries, one.recoveries);
    CheckInt(all.patches, one.patches);
    for (PetscInt part = 0; part < 2; part++) {
      PetscReal big = 0, off = 0;

      for (PetscInt k = 6 * points * part; k < 6 * points * (part + 1); k++) {
        big = PetscMax(big, PetscAbsReal(alone[k]));
        off = PetscMax(off, PetscAbsReal(alone[k] - together[k]));
      }
      CheckBelow(off, 1e-12 * big);
    }
    for (PetscInt k = 12 * points; k < n; k++) CheckClose(together[k], alone[k], 1e-12);
    PetscCall(FemModelDestroy(&model));
    PetscCall(PetscFree(alone));
  }
  PetscCall(PetscFree(together));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestRanks(void)
{
  static const MeshCellType types[] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) PetscCall(Compare(types[t]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestRanks)

static const struct CMUnitTest tests[] = {TEST(TestRanks)};
CHECK_MAIN(tests)
