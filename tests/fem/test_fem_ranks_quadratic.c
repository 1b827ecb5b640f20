/* Quadratic elements on all ranks together and on rank 0 alone: one answer, static, implicit, explicit and by multigrid; likewise planes in any
   direction under in-situ stress and heat, elements with strains of their own among them. What a rank keeps falls with their number; PT-Scotch cuts.
   Run on any number of ranks. */
#include "fem_case.h"
#include "fem_impl.h"

static const MeshCellType types[] = {MESH_TRI6, MESH_QUAD8, MESH_QUAD9, MESH_TET10, MESH_HEX20, MESH_HEX27, MESH_PRISM15, MESH_PRISM18};
#define N_TYPES 8
static const MeshCellType turned_types[] = {MESH_QUAD4, MESH_TRI6, MESH_HEX8, MESH_TET10, MESH_HEX20};
#define N_TURNED 5

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

/* Turned by 0.4 about (1, 2, 2)/3, z in the plane (Rodrigues): held on planes in slanting directions, stressed from the start, heated, pressed. */
static PetscErrorCode BuildTurned(MPI_Comm comm, MeshCellType type, FemMethod method, FemModel *model)
{
  const FemMaterial m         = {2400, 3e9, 0.3};
  const PetscReal   length[3] = {1, 0.5, 0.5}, time[2] = {0, 2e-3}, press[2] = {0, 1e5}, warm[2] = {0, 20}, base[6] = {-2e5, -1e5, -3e5, 4e4, 0, 0}, slope[6] = {0, 3e4, 0, 0, 0, 0}, field[4] = {1, 0.3, -0.2, 0};
  const PetscInt    n[3]      = {6, 3, 2}, dim = MeshCellDim(type);
  const PetscReal   k[3]      = {dim == 3 ? 1. / 3 : 0, dim == 3 ? 2. / 3 : 0, dim == 3 ? 2. / 3 : 1}, c = PetscCosReal(0.4), s = PetscSinReal(0.4);
  Table             load, heat;
  Mesh              mesh;

  PetscFunctionBeginUser;
  PetscCall(TableCreate(2, time, press, &load));
  PetscCall(TableCreate(2, time, warm, &heat));
  PetscCall(CaseBox(comm, type, length, n, 0.1, &mesh));
  for (PetscInt i = 0; i < mesh.n_nodes; i++) {
    PetscReal      *x = &mesh.x[3 * i];
    const PetscReal y[3] = {x[0], x[1], x[2]}, along = k[0] * y[0] + k[1] * y[1] + k[2] * y[2];

    for (PetscInt d = 0; d < 3; d++) x[d] = c * y[d] + s * (k[(d + 1) % 3] * y[(d + 2) % 3] - k[(d + 2) % 3] * y[(d + 1) % 3]) + (1 - c) * along * k[d];
  }
  PetscCall(CaseModel(comm, &mesh, dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, method, 0.4, &m, model));
  PetscCall(FemModelSetSymmetry(*model, "xmin"));
  PetscCall(FemModelSetSymmetry(*model, "ymin"));
  if (dim == 3) PetscCall(FemModelSetSymmetry(*model, "zmin"));
  PetscCall(FemModelSetInitialStress(*model, "", base, slope, 1, 0.2));
  PetscCall(FemModelSetExpansion(*model, "", 1e-5));
  PetscCall(FemModelAddTemperature(*model, "", field, &heat));
  PetscCall(FemModelAddPressure(*model, "ymax", &load));
  PetscCall(FemModelSetUp(*model));
  PetscCall(TableDestroy(&load));
  PetscCall(TableDestroy(&heat));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacement, velocity, reaction [3][nodes][3]; recovered stress [nodes][6]; on rank 0. */
static PetscErrorCode Answer(MPI_Comm comm, MeshCellType type, PetscBool turned, FemMethod method, PetscInt *nodes, PetscReal **data)
{
  const PetscInt  steps = method == FEM_EXPLICIT ? 100 : 3;
  const PetscReal dt    = method == FEM_EXPLICIT ? 4e-6 : method == FEM_IMPLICIT ? 5e-5 : 5e-4; /* steps far above an element's own period lose digits */
  FemModel        model;
  Stepper         s;

  PetscFunctionBeginUser;
  if (turned) PetscCall(BuildTurned(comm, type, method, &model));
  else PetscCall(Build(comm, type, method, &model));
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

/* every: of the types in turn */
static PetscErrorCode Compare(PetscBool turned, PetscInt every, FemMethod method, const char *word, PetscReal tolerance)
{
  const MeshCellType *type = turned ? turned_types : types;

  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (PetscInt t = 0; t < (turned ? N_TURNED : N_TYPES); t += every) {
    PetscReal *all, *alone, worst = 0, apart[4];
    PetscInt   nodes;

    PetscCall(Answer(PETSC_COMM_WORLD, type[t], turned, method, &nodes, &all));
    if (rank == 0) {
      PetscCall(Answer(PETSC_COMM_SELF, type[t], turned, method, &nodes, &alone));
      for (PetscInt f = 0; f < 4; f++) {
        PetscReal big = 0, off = 0;

        for (PetscInt k = 3 * nodes * f; k < (f == 3 ? 15 : 3 * (f + 1)) * nodes; k++) {
          big = PetscMax(big, PetscAbsReal(alone[k]));
          off = PetscMax(off, PetscAbsReal(all[k] - alone[k]));
        }
        CheckPositive(big);
        worst    = PetscMax(worst, off / big);
        apart[f] = off / big;
      }
      printf("  gmsh type %d, %s%s: one rank and all differ by %.1e in displacement, %.1e velocity, %.1e reaction, %.1e recovered stress\n", (int)type[t], turned ? "turned planes, " : "", word, (double)apart[0], (double)apart[1], (double)apart[2], (double)apart[3]);
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
  PetscCall(Compare(PETSC_FALSE, 1, FEM_STATIC, "static", 1e-10));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestMultigrid(void)
{
  static const char *const option[][2] = {{"-fem_ksp_type", "cg"}, {"-fem_pc_type", "gamg"}, {"-fem_ksp_rtol", "1e-13"}, {"-fem_ksp_norm_type", "unpreconditioned"}};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < 4; k++) PetscCall(PetscOptionsSetValue(NULL, option[k][0], option[k][1]));
  PetscCall(Compare(PETSC_FALSE, 3, FEM_STATIC, "multigrid", 1e-10));
  for (size_t k = 0; k < 4; k++) PetscCall(PetscOptionsClearValue(NULL, option[k][0]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestExplicit(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(PETSC_FALSE, 1, FEM_EXPLICIT, "explicit", 1e-10));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestImplicit(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(PETSC_FALSE, 3, FEM_IMPLICIT, "implicit", 1e-10));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestTurnedPlanes(void)
{
  PetscFunctionBeginUser;
  PetscCall(Compare(PETSC_TRUE, 1, FEM_STATIC, "static", 1e-10));
  PetscCall(Compare(PETSC_TRUE, 1, FEM_IMPLICIT, "implicit", 1e-10));
  PetscCall(Compare(PETSC_TRUE, 1, FEM_EXPLICIT, "explicit", 1e-10));
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

/* Ghosts of a box over all ranks, cut by the partitioner named (NULL: what is there without being asked). */
static PetscErrorCode Ghosts(const char *partitioner, PetscInt *n)
{
  const PetscReal length[3] = {3, 2, 1};
  const PetscInt  cells[3]  = {9, 7, 5};
  PetscInt        mine;
  Mesh            mesh;
  FemModel        model;

  PetscFunctionBeginUser;
  if (partitioner) PetscCall(PetscOptionsSetValue(NULL, "-petscpartitioner_type", partitioner));
  PetscCall(CaseBox(PETSC_COMM_WORLD, MESH_TET10, length, cells, 0, &mesh));
  PetscCall(FemModelCreate(PETSC_COMM_WORLD, &model));
  PetscCall(FemModelSetMesh(model, &mesh));
  mine = model->n_loc - model->n_own;
  PetscCallMPI(MPI_Allreduce(&mine, n, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  if (partitioner) PetscCall(PetscOptionsClearValue(NULL, "-petscpartitioner_type"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PT-Scotch cuts shorter than element numbers in equal parts do; the option is heard. */
static PetscErrorCode TestScotchCuts(void)
{
  PetscInt    scotch, simple;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(Ghosts(NULL, &scotch));
  PetscCall(Ghosts("simple", &simple));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %d ranks: %d ghosts, %d when cut by number\n", (int)size, (int)scotch, (int)simple));
  if (size == 1) CheckInt(scotch, simple);
  else CheckBelow(scotch, 0.95 * simple);
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestStatic)
CHECK_TEST(TestMultigrid)
CHECK_TEST(TestExplicit)
CHECK_TEST(TestImplicit)
CHECK_TEST(TestTurnedPlanes)
CHECK_TEST(TestMemoryFallsWithRanks)
CHECK_TEST(TestScotchCuts)

static const struct CMUnitTest tests[] = {TEST(TestStatic), TEST(TestMultigrid), TEST(TestExplicit), TEST(TestImplicit), TEST(TestTurnedPlanes), TEST(TestMemoryFallsWithRanks), TEST(TestScotchCuts)};
CHECK_MAIN(tests)
