/* The same body on all ranks together and on rank 0 alone: one answer.  Run on any number of ranks. */
#include "fem_case.h"
#include "fem_impl.h"
#include <unistd.h>

typedef struct {
  PetscReal *data;
  PetscInt   n;
} Answer;

/* A held, loaded body; distorted mesh; groups of several dimensions. */
static PetscErrorCode Build(MPI_Comm comm, MeshCellType type, FemMethod method, FemModel *model, PetscInt *nodes)
{
  const FemMaterial m         = {2400, 3e9, 0.3};
  const PetscReal   length[3] = {1, 0.5, 0.5}, g[3] = {1, -9.81, 3}, time[3] = {0, 1e-3, 2e-3}, speed[3] = {0, 0.05, -0.02}, press[3] = {0, 1e5, 0};
  const PetscInt    n[3]      = {9, 5, 4}, dim = MeshCellDim(type);
  PetscMPIInt       rank;
  PetscInt          corner = 0;
  Table             motion, load;
  Mesh              mesh;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(TableCreate(3, time, speed, &motion));
  PetscCall(TableCreate(3, time, press, &load));
  PetscCall(CaseBox(comm, type, length, n, 0.2, &mesh));
  if (rank == 0) PetscCall(CaseAddNodeGroups(&mesh, 1, &corner));
  *nodes = mesh.n_nodes;
  PetscCall(CaseModel(comm, &mesh, dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, method, 0.4, &m, model));
  PetscCall(FemModelFix(*model, "xmax", 0, FEM_VELOCITY, &motion));
  PetscCall(CaseFix(*model, "xmin", 0, 0));
  PetscCall(CaseFix(*model, "node 0", 1, 0));
  if (dim == 3) PetscCall(CaseFix(*model, "zmin", 2, 0));
  PetscCall(FemModelAddPressure(*model, "ymax", &load));
  PetscCall(FemModelSetGravity(*model, g));
  if (method != FEM_STATIC) PetscCall(FemModelSetDamping(*model, 50));
  if (method == FEM_IMPLICIT) {
    PetscCall(FemModelSetStiffnessDamping(*model, 1e-5));
    PetscCall(FemModelSetImplicit(*model, 0.8, PETSC_FALSE));
    PetscCall(FemModelSetPreload(*model, PETSC_TRUE));
    PetscCall(FemModelAddAbsorber(*model, "ymin"));
  }
  PetscCall(FemModelAddHistory(*model, "reaction", "xmin"));
  PetscCall(FemModelAddHistory(*model, "displacement", "ymax"));
  PetscCall(FemModelSetUp(*model));
  PetscCall(TableDestroy(&motion));
  PetscCall(TableDestroy(&load));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Run(FemModel model, PetscReal dt, PetscInt from, PetscInt to)
{
  Stepper s;

  PetscFunctionBeginUser;
  PetscCall(FemModelGetStepper(model, &s));
  for (PetscInt k = from; k < to; k++) PetscCall(s.step(s.ctx, k * dt, dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacement, velocity, reaction, stress, then ledger and history; whole on rank 0. */
static PetscErrorCode Collect(FemModel model, PetscInt nodes, Answer *a)
{
  PetscInt n_nodes, cells, at;
  Ledger   ledger;
  Stepper  s;

  PetscFunctionBeginUser;
  (void)nodes;
  PetscCall(FemModelGetCounts(model, &n_nodes, &cells, NULL));
  PetscCall(FemModelGetStepper(model, &s));
  at   = 9 * n_nodes + 6 * cells;
  a->n = at + LEDGER_TERMS + s.n_history + 2;
  PetscCall(PetscCalloc1(a->n, &a->data));
  PetscCall(FemModelGetField(model, "displacement", a->data));
  PetscCall(FemModelGetField(model, "velocity", a->data + 3 * n_nodes));
  PetscCall(FemModelGetField(model, "reaction", a->data + 6 * n_nodes));
  PetscCall(FemModelGetField(model, "element_stress", a->data + 9 * n_nodes));
  PetscCall(CaseLedger(model, &ledger));
  PetscCall(PetscArraycpy(a->data + at, ledger.energy, LEDGER_TERMS));
  for (PetscInt i = 0; i < s.n_history; i++) PetscCall(s.history(s.ctx, i, a->data + at + LEDGER_TERMS + i));
  PetscCall(FemModelGetStableStep(model, &a->data[a->n - 2]));
  PetscCall(FemModelGetCriticalStep(model, &a->data[a->n - 1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest difference of entries [from, to) over their largest value. */
static PetscReal Apart(const Answer *a, const Answer *b, PetscInt from, PetscInt to)
{
  PetscReal big = 0, off = 0;

  for (PetscInt k = from; k < to; k++) {
    big = PetscMax(big, PetscAbsReal(b->data[k]));
    off = PetscMax(off, PetscAbsReal(a->data[k] - b->data[k]));
  }
  return big > 0 ? off / big : off;
}

static PetscErrorCode Compare(MeshCellType type, FemMethod method, PetscReal dt, PetscInt steps, PetscReal tolerance)
{
  PetscMPIInt rank;
  FemModel    model;
  Answer      all, alone;
  PetscInt    nodes, cells;
  PetscReal   worst = 0;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(Build(PETSC_COMM_WORLD, type, method, &model, &nodes));
  PetscCall(Run(model, dt, 0, steps));
  PetscCall(Collect(model, nodes, &all));
  PetscCall(FemModelGetCounts(model, &nodes, &cells, NULL));
  PetscCall(FemModelDestroy(&model));
  if (rank == 0) {
    PetscCall(Build(PETSC_COMM_SELF, type, method, &model, &nodes));
    PetscCall(Run(model, dt, 0, steps));
    PetscCall(Collect(model, nodes, &alone));
    PetscCall(FemModelDestroy(&model));
    CheckInt(all.n, alone.n);
    for (PetscInt f = 0; f < 3; f++) worst = PetscMax(worst, Apart(&all, &alone, 3 * nodes * f, 3 * nodes * (f + 1)));
    worst = PetscMax(worst, Apart(&all, &alone, 9 * nodes, 9 * nodes + 6 * cells));
    for (PetscInt k = 9 * nodes + 6 * cells; k < all.n; k++) worst = PetscMax(worst, Apart(&all, &alone, k, k + 1));
    printf("  gmsh type %d, %s: one rank and all differ by %.1e\n", (int)type, method == FEM_STATIC ? "static" : method == FEM_IMPLICIT ? "implicit" : "explicit", (double)worst);
    PetscCall(PetscFree(alone.data));
  }
  PetscCallMPI(MPI_Bcast(&worst, 1, MPIU_REAL, 0, PETSC_COMM_WORLD)); /* every rank fails together */
  CheckBelow(worst, tolerance);
  PetscCall(PetscFree(all.data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const MeshCellType types[4] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8};

static PetscErrorCode TestStaticAnswersAgree(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) PetscCall(Compare(types[t], FEM_STATIC, 5e-4, 3, 1e-10));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same through multigrid, whose iterations see the partition; tolerance as tight as its own. */
static PetscErrorCode TestMultigridAnswersAgree(void)
{
  static const char *const option[][2] = {{"-fem_ksp_type", "cg"}, {"-fem_pc_type", "gamg"}, {"-fem_ksp_rtol", "1e-12"}, {"-fem_ksp_norm_type", "unpreconditioned"}};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < 4; k++) PetscCall(PetscOptionsSetValue(NULL, option[k][0], option[k][1]));
  for (PetscInt t = 0; t < 4; t++) PetscCall(Compare(types[t], FEM_STATIC, 5e-4, 2, 1e-10));
  for (size_t k = 0; k < 4; k++) PetscCall(PetscOptionsClearValue(NULL, option[k][0]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A bar is cut across: equal shares, and ghosts only at the cut. Wrong sides in the plex once made a ghost of every other node. */
static PetscErrorCode TestPartitionCutsAcross(void)
{
  const PetscReal length[3] = {4, 1, 1};
  const PetscInt  n[3]      = {80, 8, 8};
  PetscMPIInt     size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (PetscInt t = 0; t < 4; t++) {
    Mesh     mesh;
    FemModel model;
    PetscInt count[2], most[2];

    PetscCall(CaseBox(PETSC_COMM_WORLD, types[t], length, n, 0, &mesh));
    PetscCall(FemModelCreate(PETSC_COMM_WORLD, &model));
    PetscCall(FemModelSetMesh(model, &mesh));
    count[0] = model->n_loc - model->n_own;
    count[1] = model->n_cells_own;
    PetscCallMPI(MPI_Allreduce(count, most, 2, MPIU_INT, MPI_MAX, PETSC_COMM_WORLD));
    CheckBelow(most[0], size == 1 ? 0 : 2 * (t < 2 ? 9 : 81) * 1.5);
    CheckBelow(most[1], 1.05 * model->N_cells / size);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestImplicitAnswersAgree(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) PetscCall(Compare(types[t], FEM_IMPLICIT, 2e-5, 20, 1e-10));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestExplicitAnswersAgree(void)
{
  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) PetscCall(Compare(types[t], FEM_EXPLICIT, 8e-6, 300, 1e-10));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Motion is the same to the bit: rows are whole on their owner and sum in the mesh's order. */
static PetscErrorCode TestExplicitMotionIsTheSameBits(void)
{
  PetscMPIInt rank;
  PetscInt    same = 1;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (PetscInt t = 0; t < 4; t++) {
    FemModel model;
    Answer   all, alone;
    PetscInt nodes;

    PetscCall(Build(PETSC_COMM_WORLD, types[t], FEM_EXPLICIT, &model, &nodes));
    PetscCall(Run(model, 8e-6, 0, 200));
    PetscCall(Collect(model, nodes, &all));
    PetscCall(FemModelDestroy(&model));
    if (rank == 0) {
      PetscCall(Build(PETSC_COMM_SELF, types[t], FEM_EXPLICIT, &model, &nodes));
      PetscCall(Run(model, 8e-6, 0, 200));
      PetscCall(Collect(model, nodes, &alone));
      PetscCall(FemModelDestroy(&model));
      for (PetscInt k = 0; k < 9 * nodes; k++) same = same && all.data[k] == alone.data[k];
      PetscCall(PetscFree(alone.data));
    }
    PetscCall(PetscFree(all.data));
  }
  PetscCallMPI(MPI_Bcast(&same, 1, MPIU_INT, 0, PETSC_COMM_WORLD));
  CheckTrue(same);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Saved by all ranks, continued by rank 0 alone; saved alone, continued by all. */
static PetscErrorCode TestCheckpointCrossesRankCounts(void)
{
  char        file[] = "fem_ranks_checkpoint.h5";
  PetscMPIInt rank;
  PetscInt    nodes, same = 1;
  FemModel    model;
  Stepper     s;
  Checkpoint  checkpoint;
  Answer      all, alone;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(Build(PETSC_COMM_WORLD, MESH_TET4, FEM_EXPLICIT, &model, &nodes));
  PetscCall(Run(model, 8e-6, 0, 100));
  PetscCall(FemModelGetStepper(model, &s));
  PetscCall(CheckpointCreate(PETSC_COMM_WORLD, file, &checkpoint));
  PetscCall(s.save(s.ctx, checkpoint));
  PetscCall(CheckpointClose(&checkpoint));
  PetscCall(Run(model, 8e-6, 100, 200));
  PetscCall(Collect(model, nodes, &all));
  PetscCall(FemModelDestroy(&model));
  if (rank == 0) {
    PetscCall(Build(PETSC_COMM_SELF, MESH_TET4, FEM_EXPLICIT, &model, &nodes));
    PetscCall(FemModelGetStepper(model, &s));
    PetscCall(CheckpointOpen(PETSC_COMM_SELF, file, &checkpoint));
    PetscCall(s.load(s.ctx, checkpoint));
    PetscCall(CheckpointClose(&checkpoint));
    PetscCall(Run(model, 8e-6, 100, 200));
    PetscCall(Collect(model, nodes, &alone));
    PetscCall(FemModelDestroy(&model));
    for (PetscInt k = 0; k < 9 * nodes; k++) same = same && all.data[k] == alone.data[k];
    for (PetscInt k = 9 * nodes; k < all.n; k++) same = same && PetscAbsReal(all.data[k] - alone.data[k]) <= 1e-10 * PetscAbsReal(alone.data[k]) + 1e-10 * PetscAbsReal(alone.data[all.n - LEDGER_TERMS]);
    PetscCall(PetscFree(alone.data));
    unlink(file);
  }
  PetscCallMPI(MPI_Bcast(&same, 1, MPIU_INT, 0, PETSC_COMM_WORLD));
  CheckTrue(same);
  PetscCall(PetscFree(all.data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One element on several ranks: some own nothing, and still take part. */
static PetscErrorCode TestRankWithoutElements(void)
{
  const FemMaterial m         = {1000, 1e9, 0};
  const PetscReal   length[3] = {1, 1, 1};
  const PetscInt    n[3]      = {1, 1, 1};
  Mesh              mesh;
  FemModel          model;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_WORLD, MESH_HEX8, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_WORLD, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
  PetscCall(CaseFix(model, "xmin", 0, 0));
  PetscCall(CaseFix(model, "ymin", 1, 0));
  PetscCall(CaseFix(model, "zmin", 2, 0));
  PetscCall(CaseTraction(model, "xmax", 1e6, 0, 0));
  PetscCall(FemModelAddHistory(model, "displacement", "xmax"));
  PetscCall(CaseSolve(model));
  CheckClose(CaseHistory(model, "displacement(xmax).x"), 1e-3, 1e-9);
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refusals reach every rank with the same words. */
static PetscErrorCode TestAllRanksRefuseTogether(void)
{
  const FemMaterial m         = {1000, 1e9, 0};
  const PetscReal   length[3] = {1, 1, 1};
  const PetscInt    n[3]      = {3, 3, 3};
  Mesh              mesh;
  FemModel          model;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_WORLD, MESH_TET4, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_WORLD, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
  CheckFails(CaseFix(model, "xmim", 0, 0), PETSC_ERR_USER_INPUT, "did you mean 'xmin'?");
  PetscCall(CaseFix(model, "xmin", 0, 0));
  PetscCall(CaseFix(model, "zmin", 2, 0));
  CheckFails(FemModelSetUp(model), PETSC_ERR_USER_INPUT, "move along y");
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestStaticAnswersAgree)
CHECK_TEST(TestMultigridAnswersAgree)
CHECK_TEST(TestPartitionCutsAcross)
CHECK_TEST(TestImplicitAnswersAgree)
CHECK_TEST(TestExplicitAnswersAgree)
CHECK_TEST(TestExplicitMotionIsTheSameBits)
CHECK_TEST(TestCheckpointCrossesRankCounts)
CHECK_TEST(TestRankWithoutElements)
CHECK_TEST(TestAllRanksRefuseTogether)

static const struct CMUnitTest tests[] = {TEST(TestStaticAnswersAgree), TEST(TestMultigridAnswersAgree), TEST(TestPartitionCutsAcross), TEST(TestImplicitAnswersAgree), TEST(TestExplicitAnswersAgree), TEST(TestExplicitMotionIsTheSameBits), TEST(TestCheckpointCrossesRankCounts), TEST(TestRankWithoutElements),
                                          TEST(TestAllRanksRefuseTogether)};
CHECK_MAIN(tests)
