/* Quadratic elements on all ranks together and on rank 0 alone: one answer, static, explicit and by multigrid; what a rank keeps falls with their
   number; PT-Scotch cuts.  Run on any number of ranks. */
#include "fem_case.h"
#include "fem_impl.h"

static const MeshCellType types[] = {MESH_TRI6, MESH_QUAD8, MESH_QUAD9, MESH_TET10, MESH_HEX20, MESH_HEX27, MESH_PRISM15, MESH_PRISM18};
#define N_TYPES 8

/* A box pushed, pressed and heavy, held on three sides. */
static PetscErrorCode Build(MPI_Comm comm, MeshCellType type, FemMethod method, FemModel *model)
{
  const FemMaterial m         = {2400, 3e9, 0.3};
  const PetscReal   length[3] = {1, 0.5, 0.5}, g[3] = {1, -9.81, 3}, time[2] = {0, 2e-3}, speed[2] = {0, 0.05}, press[2] = {0, 1e5};
  const PetscInt    n[3]      = {6, 3, 2}, dim = MeshCellDim(type);
  Table             motion, load;
  Mesh              mesh;

  PetscFunctionBeginUser;
  PetscCall(TableCreate(2, time, speed, &motion));
  PetscCall(TableCreate(2, time, press, &load));
  PetscCall(CaseBox(comm, type, length, n, 0.1, &mesh));
  PetscCall(CaseModel(comm, &mesh, dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, method, 0.4, &m, model));
  PetscCall(FemModelFix(*model, "xmax", 0, FEM_VELOCITY, &motion));
  PetscCall(CaseFix(*model, "xmin", 0, 0));
  PetscCall(CaseFix(*model, "ymin", 1, 0));
  if (dim == 3) PetscCall(CaseFix(*model, "zmin", 2, 0));
  PetscCall(FemModelAddPressure(*model, "ymax", &load));
  PetscCall(FemModelSetGravity(*model, g));
  PetscCall(FemModelAddHistory(*model, "reaction", "xmin"));
  PetscCall(FemModelAddHistory(*model, "displacement", "ymax"));
  PetscCall(FemModelSetUp(*model));
  PetscCall(TableDestroy(&motion));
  PetscCall(TableDestroy(&load));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacement, velocity, reaction [3][nodes][3]; recovered stress [nodes][6]; on rank 0. */
static PetscErrorCode Answer(MPI_Comm comm, MeshCellType type, FemMethod method, PetscInt *nodes, PetscReal **data)
{
  const PetscInt  steps = method == FEM_EXPLICIT ? 100 : 3;
  const PetscReal dt    = method == FEM_EXPLICIT ? 4e-6 : 5e-4;
  FemModel        model;
  Stepper         s;

  PetscFunctionBeginUser;
  PetscCall(Build(comm, type, method, &model));
  PetscCall(FemModelGetStepper(model, &s));
  for (PetscInt k = 0; k < steps; k++) PetscCall(s.step(s.ctx, k * dt, dt));
  PetscCall(FemModelGetCounts(model, nodes, NULL, NULL));
  PetscCall(PetscCalloc1(15 * *nodes, data));
  PetscCall(FemModelGetField(model, "displacement", *data));
  PetscCall(FemModelGetField(model, "velocity", *data + 3 * *nodes));
  PetscCall(FemModelGetField(model, "reaction", *data + 6 * *nodes));
  PetscCall(FemModelRecover(model, *data + 9 * *nodes, NULL));
  PetscCall(FemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Compare(FemMethod method, const char *word, PetscReal tolerance)
{
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (PetscInt t = 0; t < N_TYPES; t++) {
    PetscReal *all, *alone, worst = 0;
    PetscInt   nodes;

    PetscCall(Answer(PETSC_COMM_WORLD, types[t], method, &nodes, &all));
    if (rank == 0) {
      PetscCall(Answer(PETSC_COMM_SELF, types[t], method, &nodes, &alone));
      for (PetscInt f = 0; f < 4; f++) {
        PetscReal big = 0, off = 0;

        for (PetscInt k = 3 * nodes * f; k < (f == 3 ? 15 : 3 * (f + 1)) * nodes; k++) {
          big = PetscMax(big, PetscAbsReal(alone[k]));
          off = PetscMax(off, PetscAbsReal(all[k] - alone[k]));
        }
        CheckAbove(big, 0);
        worst = PetscMax(worst, off / big);
      }
      printf("  gmsh type %d, %s: one rank and all differ by %.1e\n", (int)types[t], word, (double)worst);
      PetscCall(PetscFree(alone));
    }
    PetscCallMPI(MPI_Bcast(&worst, 1, MPIU_REAL, 0, PETSC_COMM_WORLD)); /* every rank fails together */
    CheckBelow(worst, tolerance);
    PetscCall(PetscFree(all));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestStatic(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(FEM_STATIC, "static", 1e-10));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestMultigrid(void)
{
  static const char *const option[][2] = {{"-fem_ksp_type", "cg"}, {"-fem_pc_type", "gamg"}, {"-fem_ksp_rtol", "1e-12"}, {"-fem_ksp_norm_type", "unpreconditioned"}};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < 4; k++) PetscCall(PetscOptionsSetValue(NULL, option[k][0], option[k][1]));
  PetscCall(Compare(FEM_STATIC, "multigrid", 1e-10));
  for (size_t k = 0; k < 4; k++) PetscCall(PetscOptionsClearValue(NULL, option[k][0]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestExplicit(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(FEM_EXPLICIT, "explicit", 1e-10));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a rank keeps of a bar, the larger part of its memory: nodes with ghosts, elements, blocks of K. */
static PetscErrorCode TestMemoryFallsWithRanks(void)
{
  const PetscReal   length[3] = {8, 1, 1};
  const PetscInt    n[3]      = {48, 3, 3};
  const FemMaterial m         = {2400, 3e9, 0.3};
  PetscMPIInt       size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (PetscInt t = 3; t < 5; t++) {
    Mesh     mesh;
    FemModel model;
    PetscInt mine[3], most[3], sum[3];

    PetscCall(CaseBox(PETSC_COMM_WORLD, types[t], length, n, 0, &mesh));
    PetscCall(CaseModel(PETSC_COMM_WORLD, &mesh, FEM_SOLID, FEM_EXPLICIT, 1, &m, &model));
    PetscCall(FemModelSetUp(model));
    mine[0] = model->n_loc;
    mine[1] = model->n_cells;
    mine[2] = model->rows.start[model->n_own];
    PetscCallMPI(MPI_Allreduce(mine, most, 3, MPIU_INT, MPI_MAX, PETSC_COMM_WORLD));
    PetscCallMPI(MPI_Allreduce(mine, sum, 3, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  gmsh type %d, %d ranks: at most %.3f of the nodes, %.3f of the elements, %.3f of the blocks on one\n", (int)types[t], (int)size, (double)most[0] / model->N_nodes, (double)most[1] / model->N_cells, (double)most[2] / sum[2]));
    CheckBelow((PetscReal)most[0] * size / model->N_nodes, size == 1 ? 1 : 1.35);
    CheckBelow((PetscReal)most[1] * size / model->N_cells, size == 1 ? 1 : 1.35);
    CheckBelow((PetscReal)most[2] * size / sum[2], size == 1 ? 1 : 1.25);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which global nodes this rank owns, of a box cut by the partitioner named (NULL: what is there without being asked). */
static PetscErrorCode Owned(const char *partitioner, PetscInt *n, PetscInt **gid)
{
  const PetscReal length[3] = {3, 2, 1};
  const PetscInt  cells[3]  = {9, 7, 5};
  Mesh            mesh;
  FemModel        model;

  PetscFunctionBeginUser;
  if (partitioner) PetscCall(PetscOptionsSetValue(NULL, "-petscpartitioner_type", partitioner));
  PetscCall(CaseBox(PETSC_COMM_WORLD, MESH_TET10, length, cells, 0, &mesh));
  PetscCall(FemModelCreate(PETSC_COMM_WORLD, &model));
  PetscCall(FemModelSetMesh(model, &mesh));
  *n = model->n_own;
  PetscCall(PetscMalloc1(*n, gid));
  PetscCall(PetscArraycpy(*gid, model->gid, *n));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  if (partitioner) PetscCall(PetscOptionsClearValue(NULL, "-petscpartitioner_type"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestScotchCuts(void)
{
  static const char *const word[3] = {NULL, "ptscotch", "simple"};
  PetscInt                 n[3], *gid[3], same[2];
  PetscMPIInt              size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (PetscInt k = 0; k < 3; k++) PetscCall(Owned(word[k], &n[k], &gid[k]));
  for (PetscInt k = 0; k < 2; k++) same[k] = n[0] == n[k + 1] && !memcmp(gid[0], gid[k + 1], sizeof(PetscInt) * n[0]);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, same, 2, MPIU_INT, MPI_MIN, PETSC_COMM_WORLD));
  CheckInt(same[0], 1);
  CheckInt(same[1], size == 1);
  for (PetscInt k = 0; k < 3; k++) PetscCall(PetscFree(gid[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestStatic)
CHECK_TEST(TestMultigrid)
CHECK_TEST(TestExplicit)
CHECK_TEST(TestMemoryFallsWithRanks)
CHECK_TEST(TestScotchCuts)

static const struct CMUnitTest tests[] = {TEST(TestStatic), TEST(TestMultigrid), TEST(TestExplicit), TEST(TestMemoryFallsWithRanks), TEST(TestScotchCuts)};
CHECK_MAIN(tests)
