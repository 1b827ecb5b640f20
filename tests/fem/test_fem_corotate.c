/* Elements that turn: forces from their energy, turns without stress, a bar that spins, the elastica.  Theory 2.11, eqs (2.86)-(2.89) */
#include "fem_case.h"
#include "fem_impl.h"

static const FemMaterial steel = {7800, 200e9, 0.3};

static PetscErrorCode Body(MeshCellType type, const PetscReal length[3], const PetscInt n[3], PetscReal distort, const FemMaterial *m, Mesh *mesh, FemModel *model)
{
  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, distort, mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, mesh, mesh->dim == 3 ? FEM_SOLID : FEM_PLANE_STRESS, FEM_EXPLICIT, 1, m, model));
  PetscCall(FemModelSetRotation(*model, FEM_COROTATIONAL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* About (1, 2, 2)/3 in space, z in the plane (Rodrigues). */
static void Turn(PetscInt dim, PetscReal angle, PetscReal R[3][3])
{
  const PetscReal a[3] = {dim == 3 ? 1. / 3 : 0, dim == 3 ? 2. / 3 : 0, dim == 3 ? 2. / 3 : 1}, c = cos(angle), s = sin(angle);

  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) R[i][j] = c * (i == j) + (1 - c) * a[i] * a[j];
  for (PetscInt i = 0; i < 3; i++) {
    R[i][(i + 1) % 3] -= s * a[(i + 2) % 3];
    R[(i + 1) % 3][i] += s * a[(i + 2) % 3];
  }
}

static const MeshCellType types[] = {MESH_TRI3, MESH_QUAD4, MESH_TRI6, MESH_QUAD8, MESH_TET4, MESH_HEX8, MESH_PRISM6, MESH_TET10, MESH_HEX20};

/* Any displacement: f . du = dE by central differences; no net force, no net moment about present places. */
static PetscErrorCode TestForceIsGradientOfEnergy(void)
{
  const PetscReal length[3] = {1, 0.7, 0.5}, step = 1e-6;
  const PetscInt  n[3]      = {2, 1, 1};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(types) / sizeof(types[0]); k++) {
    FemModel  model;
    Mesh      mesh;
    PetscReal R[3][3], work = 0, force[3] = {0}, moment[3] = {0}, size = 0, energy[2];

    PetscCall(Body(types[k], length, n, 0.2, &steel, &mesh, &model));
    PetscCall(FemModelSetUp(model));
    Turn(mesh.dim, 1.9, R);
    for (PetscInt i = 0; i < model->n_own; i++)
      for (PetscInt d = 0; d < model->dim; d++) {
        PetscReal u = -model->x[i * model->dim + d] + 0.08 * FemNoise(i * 3 + d); /* a turn of 109 degrees and strains of some 10 % */

        for (PetscInt j = 0; j < model->dim; j++) u += R[d][j] * model->x[i * model->dim + j];
        model->u[i * model->dim + d] = u;
      }
    PetscCall(FemApply(model, model->u, model->f_int));
    for (PetscInt i = 0; i < model->n_own; i++) {
      PetscReal x[3] = {0}, f[3] = {0};

      for (PetscInt d = 0; d < model->dim; d++) {
        x[d] = model->x[i * model->dim + d] + model->u[i * model->dim + d];
        f[d] = model->f_int[i * model->dim + d];
        size += PetscAbsReal(f[d]);
        work += f[d] * FemNoise(1000 + i * 3 + d);
      }
      for (PetscInt d = 0; d < 3; d++) {
        force[d] += f[d];
        moment[d] += x[(d + 1) % 3] * f[(d + 2) % 3] - x[(d + 2) % 3] * f[(d + 1) % 3];
      }
    }
    for (PetscInt d = 0; d < 3; d++) {
      CheckBelow(PetscAbsReal(force[d]), 1e-13 * size);
      CheckBelow(PetscAbsReal(moment[d]), 1e-13 * size);
    }
    for (PetscInt side = 0; side < 2; side++) {
      for (PetscInt i = 0; i < model->n_own; i++)
        for (PetscInt d = 0; d < model->dim; d++) model->u[i * model->dim + d] += (side ? 2 : -1) * step * FemNoise(1000 + i * 3 + d);
      PetscCall(FemApply(model, model->u, model->f_int));
      energy[side] = FemStrainEnergy(model);
    }
    CheckNear((energy[1] - energy[0]) / (2 * step), work, 1e-7 * size);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A hundred turns by hand leave no force; a stretch along x shown after a quarter turn about z is stress along y. */
static PetscErrorCode TestTurnsCarryNoStress(void)
{
  const FemMaterial m         = {7800, 200e9, 0};
  const PetscReal   length[3] = {1, 1, 1};
  const PetscInt    n[3]      = {1, 1, 1};

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(types) / sizeof(types[0]); k++) {
    FemModel  model;
    Mesh      mesh;
    PetscReal R[3][3], most = 0, *stress;

    PetscCall(Body(types[k], length, n, 0, &m, &mesh, &model));
    PetscCall(FemModelSetUp(model));
    for (PetscInt turn = 0; turn <= 700; turn++) {
      Turn(mesh.dim, turn * 200 * PETSC_PI / 700, R);
      for (PetscInt i = 0; i < model->n_own; i++)
        for (PetscInt d = 0; d < model->dim; d++) {
          PetscReal u = -model->x[i * model->dim + d];

          for (PetscInt j = 0; j < model->dim; j++) u += R[d][j] * model->x[i * model->dim + j];
          model->u[i * model->dim + d] = u;
        }
      PetscCall(FemApply(model, model->u, model->f_int));
      for (PetscInt i = 0; i < model->n_own * model->dim; i++) most = PetscMax(most, PetscAbsReal(model->f_int[i]));
    }
    CheckBelow(most, 1e-13 * m.young * 1);
    for (PetscInt i = 0; i < model->n_own; i++) {
      const PetscReal *x = &model->x[i * model->dim];

      model->u[i * model->dim]     = -x[1] - x[0];
      model->u[i * model->dim + 1] = 1.001 * x[0] - x[1];
    }
    PetscCall(FemApply(model, model->u, model->f_int));
    PetscCall(PetscMalloc1(6 * model->N_cells, &stress));
    PetscCall(FemModelGetField(model, "element_stress", stress));
    CheckNear(stress[1], 0.001 * m.young, 1e-9 * m.young);
    CheckNear(stress[0], 0, 1e-9 * m.young);
    CheckNear(stress[3], 0, 1e-9 * m.young);
    PetscCall(PetscFree(stress));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A free block set spinning at c/10 per length, 100 turns: angular momentum to round-off, energy within the O(dt^2) of the scheme. */
static PetscErrorCode TestSpinningBlockKeepsEnergyAndMomentum(void)
{
  const PetscReal length[3] = {1, 0.8, 0.6}, omega = 0.1 * PetscSqrtReal(steel.young / steel.density), end = 200 * PETSC_PI / omega;
  const PetscInt  n[3]      = {2, 2, 2};
  PetscReal       dt, start, first = 0, lowest = PETSC_MAX_REAL, highest = 0;
  PetscInt        steps;
  FemModel        model;
  FemState        state;
  Ledger          ledger;
  Stepper         s;
  Mesh            mesh;

  PetscFunctionBeginUser;
  PetscCall(Body(MESH_HEX8, length, n, 0, &steel, &mesh, &model));
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModelGetStepper(model, &s));
  PetscCall(FemModelGetCriticalStep(model, &dt));
  steps = (PetscInt)ceil(end / (0.8 * dt));
  dt    = end / steps;
  PetscCall(FemModelGetState(model, &state));
  for (PetscInt i = 0; i < state.n_nodes; i++) {
    state.v[3 * i]     = -omega * (state.x[3 * i + 1] - 0.4);
    state.v[3 * i + 1] = omega * (state.x[3 * i] - 0.5);
  }
  PetscCall(FemModelRestoreState(model, &state));
  start = 0;
  for (PetscInt j = 0; j < steps; j++) {
    PetscReal spin = 0;

    PetscCall(s.step(s.ctx, j * dt, dt));
    for (PetscInt i = 0; i < model->n_own; i++) spin += model->mass[i] * ((model->x[3 * i] + model->u[3 * i]) * model->v[3 * i + 1] - (model->x[3 * i + 1] + model->u[3 * i + 1]) * model->v[3 * i]);
    if (!j) first = spin;
    CheckClose(spin, first, 1e-11);
    PetscCall(s.energy(s.ctx, &ledger));
    if (j == 1) start = ledger.energy[LEDGER_KINETIC] + ledger.energy[LEDGER_STRAIN];
    if (j) lowest = PetscMin(lowest, ledger.energy[LEDGER_KINETIC] + ledger.energy[LEDGER_STRAIN]);
    if (j) highest = PetscMax(highest, ledger.energy[LEDGER_KINETIC] + ledger.energy[LEDGER_STRAIN]);
  }
  CheckBelow(highest - lowest, 1e-3 * start);
  CheckInt(model->corotate.count, (steps + 0) * 8);
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tip of the elastica of dead load P, k = P L^2/(EI): theta'' = -k cos(theta), theta(0) = 0, theta'(1) = 0, by shooting. */
static void Elastica(PetscReal k, PetscReal tip[2])
{
  PetscReal low = 0, high = 2 * k;
  const PetscInt n = 2000;

  for (PetscInt round = 0; round < 60; round++) {
    const PetscReal bend = 0.5 * (low + high), h = 1. / n;
    PetscReal       angle = 0, slope = bend;

    tip[0] = tip[1] = 0;
    for (PetscInt j = 0; j < n; j++) { /* midpoint rule */
      const PetscReal mid = angle + 0.5 * h * slope, turn = slope - 0.5 * h * k * cos(angle);

      slope -= h * k * cos(mid);
      angle += h * turn;
      tip[0] += h * (cos(mid) - 1);
      tip[1] += h * sin(mid);
    }
    if (slope > 0) high = bend;
    else low = bend;
  }
}

/* A slender cantilever under a dead tip load of P L^2 = 2 E I, come to rest by damping. */
static PetscErrorCode TestCantileverFollowsElastica(void)
{
  const FemMaterial m         = {1, 1, 0}; /* c = 1 */
  const PetscReal   thick = 1. / 20, length[3] = {1, thick, 0}, inertia = thick * thick * thick / 12, k = 2, omega = 3.516 * PetscSqrtReal(inertia / thick);
  const PetscInt    n[3] = {30, 2, 0};
  PetscReal         dt, tip[2];
  FemModel          model;
  Stepper           s;
  Mesh              mesh;

  PetscFunctionBeginUser;
  PetscCall(Body(MESH_QUAD4, length, n, 0, &m, &mesh, &model));
  for (PetscInt d = 0; d < 2; d++) PetscCall(CaseFix(model, "xmin", d, 0));
  PetscCall(CaseTraction(model, "xmax", 0, k * inertia / thick, 0));
  PetscCall(FemModelSetDamping(model, 2 * omega));
  PetscCall(FemModelAddHistory(model, "displacement", "xmax"));
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModelGetStepper(model, &s));
  PetscCall(FemModelGetCriticalStep(model, &dt));
  dt *= 0.9;
  for (PetscInt j = 0; j * dt < 14 / omega; j++) PetscCall(s.step(s.ctx, j * dt, dt));
  Elastica(k, tip);
  CheckClose(CaseHistory(model, "displacement(xmax).y"), tip[1], 0.005);
  CheckClose(CaseHistory(model, "displacement(xmax).x"), tip[0], 0.01);
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Who does not ask for it works out no turn; others than explicit bodies are refused. */
static PetscErrorCode TestOnlyWhereAsked(void)
{
  const PetscReal length[3] = {1, 1, 1};
  const PetscInt  n[3]      = {1, 1, 1};
  FemReadings     readings;
  FemModel        model;
  Stepper         s;
  Mesh            mesh;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX8, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_EXPLICIT, 1, &steel, &model));
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModelGetStepper(model, &s));
  PetscCall(s.step(s.ctx, 0, 1e-6));
  PetscCall(FemModelGetReadings(model, &readings));
  CheckInt(readings.turns, 0);
  CheckTrue(!model->corotate.mean && model->batches);
  PetscCall(FemModelDestroy(&model));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &steel, &model));
  PetscCall(FemModelSetRotation(model, FEM_COROTATIONAL));
  CheckFails(FemModelSetUp(model), PETSC_ERR_USER_INPUT, "corotational elements need the explicit method");
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestForceIsGradientOfEnergy)
CHECK_TEST(TestTurnsCarryNoStress)
CHECK_TEST(TestSpinningBlockKeepsEnergyAndMomentum)
CHECK_TEST(TestCantileverFollowsElastica)
CHECK_TEST(TestOnlyWhereAsked)

static const struct CMUnitTest tests[] = {TEST(TestForceIsGradientOfEnergy), TEST(TestTurnsCarryNoStress), TEST(TestSpinningBlockKeepsEnergyAndMomentum), TEST(TestCantileverFollowsElastica), TEST(TestOnlyWhereAsked)};
CHECK_MAIN(tests)
