/* Forces of elements in lanes: the fast kernels against FemStiffness() and FemModesStiffness() times u, lane by lane; runs with and without them. */
#include "fem_batch.h"
#include "fem_case.h"

/* In [-1/2, 1/2), the same on every machine. */
static PetscReal Noise(PetscInt *seed)
{
  *seed = (PetscInt)(((long long)*seed * 1103515245 + 12345) % 2147483648LL);
  return *seed / 2147483648.0 - 0.5;
}

static PetscErrorCode Law(PetscInt kind, PetscInt dim, FemElastic *law)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(law, sizeof(*law)));
  law->lambda = 12e9;
  law->mu     = 9e9;
  if (kind) { /* any symmetric matrix will do: the kernels must not care */
    PetscInt seed = 7;

    law->general = PETSC_TRUE;
    for (PetscInt i = 0; i < 6; i++)
      for (PetscInt j = 0; j <= i; j++) law->C[i][j] = law->C[j][i] = 1e9 * ((i == j) * 20 + Noise(&seed));
    for (PetscInt i = 0; i < 6 && dim == 2; i++)
      if (i == 2 || i > 3)
        for (PetscInt j = 0; j < 6; j++) law->C[i][j] = law->C[j][i] = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* J^-1 and det J, by Cramer's rule written out: the test's own. */
static PetscReal Inverse(PetscInt dim, const PetscReal J[3][3], PetscReal *inverse)
{
  if (dim == 2) {
    const PetscReal det = J[0][0] * J[1][1] - J[0][1] * J[1][0];

    inverse[0] = J[1][1] / det;
    inverse[1] = -J[0][1] / det;
    inverse[2] = -J[1][0] / det;
    inverse[3] = J[0][0] / det;
    return det;
  } else {
    const PetscReal det = J[0][0] * (J[1][1] * J[2][2] - J[1][2] * J[2][1]) - J[0][1] * (J[1][0] * J[2][2] - J[1][2] * J[2][0]) + J[0][2] * (J[1][0] * J[2][1] - J[1][1] * J[2][0]);

    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < 3; j++) {
        const PetscInt r = (j + 1) % 3, t = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;

        inverse[3 * i + j] = (J[r][c] * J[t][d] - J[r][d] * J[t][c]) / det;
      }
    return det;
  }
}

/* A batch of differently shaped elements; straight: only corners are moved. Every lane against its own K u. */
static PetscErrorCode OneBatch(MeshCellType type, FemBatchKind kind, PetscInt general, PetscBool straight, PetscBool enhanced)
{
  const FemShape *shape = FemShapeGet(type);
  const PetscInt  dim = shape->dim, n = shape->nodes * dim, m = FemBatchConstants(kind, shape);
  FemLanes       *constant, u[FEM_MAX_DOFS], f[FEM_MAX_DOFS];
  void           *room;
  PetscReal      *want, *K, one[FEM_MAX_DOFS * 10];
  FemElastic      law;
  PetscInt        seed = 1 + (PetscInt)type + 100 * (PetscInt)kind;

  PetscFunctionBeginUser;
  PetscCall(Law(general, dim, &law));
  if (kind == FEM_BATCH_VOLUME) law.lambda *= 10; /* excess there is */
  PetscCall(PetscMalloc1((m + 1) * sizeof(FemLanes), (char **)&room));
  constant = (FemLanes *)(((size_t)room + sizeof(FemLanes) - 1) / sizeof(FemLanes) * sizeof(FemLanes));
  PetscCall(PetscMalloc2(n * FEM_LANES, &want, n * n, &K));
  for (PetscInt l = 0; l < FEM_LANES; l++) {
    PetscReal x[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS];

    for (PetscInt a = 0; a < shape->nodes; a++)
      for (PetscInt d = 0; d < dim; d++) x[a * dim + d] = 0.01 * (shape->place[a][d] + (a < shape->corners || !straight ? (a < shape->corners ? 0.2 : 0.05) * Noise(&seed) : 0));
    for (PetscInt a = shape->corners; a < shape->nodes && straight; a++) {
      PetscInt       parent[8];
      const PetscInt p = MeshCellParents(type, a, parent);

      for (PetscInt d = 0; d < dim; d++) {
        x[a * dim + d] = 0;
        for (PetscInt k = 0; k < p; k++) x[a * dim + d] += x[parent[k] * dim + d] / p;
      }
    }
    CheckInt(FemGradients(shape, x, 1, dN, w), 0);
    if (enhanced) {
      FemModes modes;

      FemModesCreate(shape, &law, x, w, &modes);
      FemModesStiffness(shape, &law, dN, w, &modes, K);
    } else if (kind == FEM_BATCH_VOLUME) {
      FemVolume volume;

      FemVolumeCreate(shape, x, w, &volume);
      FemVolumeStiffness(shape, &law, dN, w, &volume, K);
      for (PetscInt q = 0; q < shape->points; q++)
        for (PetscInt k = 0; k < 4; k++) one[shape->points * 10 + q * 4 + k] = volume.psi[q][k];
    } else FemStiffness(shape, &law, dN, w, K);
    if (kind == FEM_BATCH_HEX8) {
      PetscReal b[24] = {0}, volume = 0;

      for (PetscInt q = 0; q < 8; q++) volume += w[q];
      for (PetscInt q = 0; q < 8; q++)
        for (PetscInt k = 0; k < 24; k++) b[k] += w[q] / volume * dN[q * 24 + k];
      CheckTrue(FemBatchHex8(K, b, volume, x, one));
    } else if (kind == FEM_BATCH_DENSE) PetscCall(PetscArraycpy(one, K, PetscMin(n * n, (PetscInt)(sizeof(one) / sizeof(*one)))));
    else {
      const FemShape *rule   = kind == FEM_BATCH_TET10 ? FemShapeGet(MESH_TET4) : shape;
      const PetscInt  nodes  = kind == FEM_BATCH_TET10 ? 4 : shape->nodes;

      for (PetscInt q = 0; q < rule->points; q++) {
        PetscReal J[3][3] = {{0}}, *at = &one[q * (dim * dim + 1)];

        for (PetscInt a = 0; a < nodes; a++)
          for (PetscInt i = 0; i < dim; i++)
            for (PetscInt j = 0; j < dim; j++) J[i][j] += x[a * dim + i] * rule->dN[q][a][j];
        at[dim * dim] = Inverse(dim, J, at) * rule->weight[q];
      }
    }
    for (PetscInt k = 0; k < m; k++) constant[k][l] = one[k];
    for (PetscInt k = 0; k < n; k++) u[k][l] = Noise(&seed);
    for (PetscInt i = 0; i < n; i++) {
      want[i * FEM_LANES + l] = 0;
      for (PetscInt j = 0; j < n; j++) want[i * FEM_LANES + l] += K[i * n + j] * u[j][l];
    }
  }
  FemBatchForce(kind, shape, &law, constant, u, f);
  for (PetscInt l = 0; l < FEM_LANES; l++) {
    PetscReal largest = 0;

    for (PetscInt i = 0; i < n; i++) largest = PetscMax(largest, PetscAbsReal(want[i * FEM_LANES + l]));
    for (PetscInt i = 0; i < n; i++) CheckNear(f[i][l], want[i * FEM_LANES + l], 1e-13 * largest);
  }
  PetscCall(PetscFree(room));
  PetscCall(PetscFree2(want, K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every kernel, on shapes of its own in every lane. */
static PetscErrorCode TestKernelsAreTheStiffness(void)
{
  const MeshCellType type[] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8, MESH_PRISM6, MESH_TRI6, MESH_QUAD8, MESH_QUAD9, MESH_TET10, MESH_HEX20, MESH_HEX27, MESH_PRISM15, MESH_PRISM18};

  PetscFunctionBeginUser;
  for (PetscInt general = 0; general < 2; general++) {
    for (size_t t = 0; t < sizeof(type) / sizeof(type[0]); t++) PetscCall(OneBatch(type[t], FEM_BATCH_POINTS, general, PETSC_FALSE, PETSC_FALSE));
    PetscCall(OneBatch(MESH_TET10, FEM_BATCH_TET10, general, PETSC_TRUE, PETSC_FALSE));
    PetscCall(OneBatch(MESH_HEX8, FEM_BATCH_HEX8, general, PETSC_FALSE, PETSC_FALSE));
    PetscCall(OneBatch(MESH_HEX8, FEM_BATCH_HEX8, general, PETSC_FALSE, PETSC_TRUE));
    for (size_t t = 9; t < sizeof(type) / sizeof(type[0]); t++) PetscCall(OneBatch(type[t], FEM_BATCH_VOLUME, general, PETSC_FALSE, PETSC_FALSE));
    PetscCall(OneBatch(MESH_QUAD4, FEM_BATCH_DENSE, general, PETSC_FALSE, PETSC_TRUE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Explicit steps of a sheared block, with batches or by assembled rows; displacement [nodes][3] and the ledger's error. */
static PetscErrorCode Block(const Mesh *mesh, const char *options, PetscInt threads, PetscReal *u, PetscReal *error)
{
  const FemMaterial m    = {2400, 30e9, 0.3};
  const PetscReal   v[3] = {0.1, 0, 0};
  Ledger            ledger;
  FemModel          model;
  Stepper           s;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsInsertString(NULL, options));
  PetscCall(FemModelCreate(PETSC_COMM_SELF, &model));
  PetscCall(FemModelSetKind(model, FEM_SOLID, 1));
  PetscCall(FemModelSetMethod(model, FEM_EXPLICIT));
  PetscCall(FemModelSetThreads(model, threads));
  PetscCall(FemModelSetMesh(model, mesh));
  PetscCall(FemModelAddMaterial(model, "", &m));
  PetscCall(FemModelSetInitialVelocity(model, v));
  for (PetscInt d = 0; d < 3; d++) PetscCall(CaseFix(model, "zmin", d, 0));
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModelGetStepper(model, &s));
  for (PetscInt k = 0; k < 50; k++) PetscCall(s.step(s.ctx, k * 1e-6, 1e-6));
  PetscCall(FemModelGetField(model, "displacement", u));
  PetscCall(CaseLedger(model, &ledger));
  *error = LedgerError(&ledger);
  PetscCall(FemModelDestroy(&model));
  PetscCall(PetscOptionsClearValue(NULL, "-fem_batches"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* hex8 in lanes take the same path as by assembled rows, on a regular mesh (one block for all) and a distorted one (its own block
   each, 4 and 8 lanes not filled); energy is balanced to round-off, and threads change no bit. */
static PetscErrorCode TestExplicitRunsAgree(void)
{
  const PetscReal length[3] = {0.5, 0.3, 0.2};
  const PetscInt  n[3]      = {7, 5, 3};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 2; k++) {
    PetscReal *u[4], error, largest = 0;
    Mesh       mesh;

    PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX8, length, n, 0.3 * k, &mesh));
    for (PetscInt j = 0; j < 4; j++) {
      PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u[j]));
      PetscCall(Block(&mesh, j ? "-fem_batches 1" : "-fem_batches 0", j == 2 ? 2 : j == 3 ? 3 : 1, u[j], &error));
      CheckBelow(error, 1e-12);
    }
    for (PetscInt i = 0; i < 3 * mesh.n_nodes; i++) largest = PetscMax(largest, PetscAbsReal(u[0][i]));
    CheckAbove(largest, 1e-6);
    for (PetscInt i = 0; i < 3 * mesh.n_nodes; i++) {
      CheckNear(u[1][i], u[0][i], 1e-10 * largest);
      CheckTrue(u[2][i] == u[1][i] && u[3][i] == u[1][i]);
    }
    for (PetscInt j = 0; j < 4; j++) PetscCall(PetscFree(u[j]));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestKernelsAreTheStiffness)
CHECK_TEST(TestExplicitRunsAgree)

static const struct CMUnitTest tests[] = {TEST(TestKernelsAreTheStiffness), TEST(TestExplicitRunsAgree)};
CHECK_MAIN(tests)
