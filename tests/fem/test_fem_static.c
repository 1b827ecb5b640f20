/* Statics against closed forms: beam, column, pressure, reactions, energy; one factorisation for all steps.  Theory 2.3 */
#include "fem_case.h"
#include <petscksp.h>
#include <unistd.h>

/* Timoshenko cantilever, notes S4: end load P upward at x = L, exact displacement where it is built in. */
static const PetscReal beam_L = 48, beam_D = 12, beam_E = 3e7, beam_nu = 0.3, beam_P = 1000;

static void Timoshenko(const PetscReal x[3], PetscReal u[3])
{
  const PetscReal y = x[1] - beam_D / 2, inertia = beam_D * beam_D * beam_D / 12, c = beam_P / (6 * beam_E * inertia);

  u[0] = -c * y * ((6 * beam_L - 3 * x[0]) * x[0] + (2 + beam_nu) * (y * y - beam_D * beam_D / 4));
  u[1] = c * (3 * beam_nu * y * y * (beam_L - x[0]) + (4 + 5 * beam_nu) * beam_D * beam_D * x[0] / 4 + (3 * beam_L - x[0]) * x[0] * x[0]);
  u[2] = 0;
}

/* Tip deflection with `deep` quadrilaterals over the depth; the end shear is parabolic, its exact mean on each side. */
static PetscErrorCode BeamTip(PetscInt deep, PetscReal *tip)
{
  const FemMaterial m         = {1, 3e7, 0.3};
  const PetscReal   length[3] = {48, 12, 1};
  const PetscInt    n[3]      = {3 * deep, deep, 1};
  PetscInt         *wall, n_wall, sides;
  PetscReal        *u;
  Mesh              mesh;
  FemModel          model;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  PetscCall(PetscMalloc2(mesh.n_nodes, &wall, 3 * mesh.n_nodes, &u));
  n_wall = CaseSurface(&mesh, length, 0, wall);
  PetscCall(CaseAddNodeGroups(&mesh, n_wall, wall));
  PetscCall(CaseSplitGroup(&mesh, "xmax", "end", &sides));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_STATIC, 1, &m, &model));
  PetscCall(CaseFixNodes(model, 2, n_wall, wall, mesh.x, Timoshenko));
  for (PetscInt k = 0; k < sides; k++) {
    const PetscReal a = k * beam_D / deep - beam_D / 2, b = a + beam_D / deep, inertia = beam_D * beam_D * beam_D / 12;
    char            name[32];

    PetscCall(BaseFormat(name, "end %d", (int)k));
    PetscCall(CaseTraction(model, name, 0, beam_P / (2 * inertia) * (beam_D * beam_D / 4 - (b * b * b - a * a * a) / (3 * (b - a))), 0));
  }
  PetscCall(FemModelAddHistory(model, "reaction", "xmin"));
  PetscCall(CaseSolve(model));
  PetscCall(FemModelGetField(model, "displacement", u));
  *tip = u[3 * CaseNodeAt(&mesh, 48, 6, 0) + 1];
  CheckClose(CaseHistory(model, "reaction(xmin).y"), -beam_P, 1e-9); /* the sides' means add up to P */
  CheckNear(CaseHistory(model, "reaction(xmin).x"), 0, 1e-8 * beam_P);
  PetscCall(PetscFree2(wall, u));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestTimoshenkoBeamConverges(void)
{
  const PetscReal exact = 8.9e-3; /* P/(6EI) [(4 + 5 nu) D^2 L/4 + 2 L^3] = 8.900e-3 */
  PetscReal       tip[4], slope;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 4; k++) PetscCall(BeamTip(4 << k, &tip[k]));
  slope = log2((exact - tip[2]) / (exact - tip[3]));
  CheckAbove(slope, 1.9);
  CheckBelow(slope, 2.1);
  CheckClose(tip[3], exact, 2e-3);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Column under its own weight: u_z(H) = -rho g H^2/2E with nu = 0, nodal values exact in one dimension; reaction = weight. */
static PetscErrorCode TestGravityColumn(void)
{
  const FemMaterial m          = {2400, 30e9, 0};
  const PetscReal   length[3]  = {1, 0.5, 8}, g[3] = {0, 0, -9.81};
  const PetscInt    n[3]       = {2, 1, 16};
  const MeshCellType types[2]  = {MESH_HEX8, MESH_TET4};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 2; t++) {
    Mesh       mesh;
    FemModel   model;
    PetscReal *u;

    PetscCall(CaseBox(PETSC_COMM_SELF, types[t], length, n, 0, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
    PetscCall(CaseFix(model, "zmin", 2, 0));
    PetscCall(CaseFix(model, "xmin", 0, 0));
    PetscCall(CaseFix(model, "ymin", 1, 0));
    PetscCall(FemModelSetGravity(model, g));
    PetscCall(FemModelAddHistory(model, "reaction", "zmin"));
    PetscCall(CaseSolve(model));
    CheckClose(CaseHistory(model, "reaction(zmin).z"), 2400 * 9.81 * 4, 1e-10);
    PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
    PetscCall(FemModelGetField(model, "displacement", u));
    if (t == 0)
      for (PetscInt i = 0; i < mesh.n_nodes; i++) {
        const PetscReal z = mesh.x[3 * i + 2];

        CheckNear(u[3 * i + 2], -2400 * 9.81 / 30e9 * (8 * z - z * z / 2), 1e-10 * 2400 * 9.81 / 30e9 * 32);
      }
    else CheckClose(u[3 * CaseNodeAt(&mesh, 0.5, 0.25, 8) + 2], -2400 * 9.81 / 30e9 * 32, 5e-3);
    PetscCall(PetscFree(u));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pressure on all free sides of a block: s = -p I, strain -p (1 - 2 nu)/E, volume work = strain energy. */
static PetscErrorCode TestPressureAllRound(void)
{
  const FemMaterial m         = {2400, 30e9, 0.2};
  const PetscReal   length[3] = {1, 0.8, 0.6}, p = 5e6;
  const PetscInt    n[3]      = {3, 3, 3};
  const char *const side[3]   = {"xmax", "ymax", "zmax"}, *const held[3] = {"xmin", "ymin", "zmin"};
  const MeshCellType types[2] = {MESH_HEX8, MESH_TET4};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 2; t++) {
    Mesh       mesh;
    FemModel   model;
    Table      table;
    Ledger     ledger;
    PetscInt   cells;
    PetscReal *s;

    PetscCall(TableCreateConstant(p, &table));
    PetscCall(CaseBox(PETSC_COMM_SELF, types[t], length, n, 0.2, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
    for (PetscInt d = 0; d < 3; d++) {
      PetscCall(CaseFix(model, held[d], d, 0));
      PetscCall(FemModelAddPressure(model, side[d], &table));
    }
    PetscCall(CaseSolve(model));
    PetscCall(PetscMalloc1(6 * mesh.n_cells, &s));
    PetscCall(FemModelGetField(model, "element_stress", s));
    PetscCall(FemModelGetCounts(model, NULL, &cells, NULL));
    for (PetscInt c = 0; c < cells; c++)
      for (PetscInt i = 0; i < 6; i++) CheckNear(s[6 * c + i], i < 3 ? -p : 0, 1e-9 * p);
    PetscCall(CaseLedger(model, &ledger));
    CheckClose(ledger.energy[LEDGER_STRAIN], 0.5 * 3 * p * p * (1 - 2 * 0.2) / 30e9 * 0.48, 1e-10);
    CheckClose(ledger.energy[LEDGER_WORK], ledger.energy[LEDGER_STRAIN], 1e-10);
    PetscCall(PetscFree(s));
    PetscCall(TableDestroy(&table));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces and moments of the reactions balance traction, pressure and weight on a body held in one corner. */
static PetscErrorCode TestReactionsBalance(void)
{
  const FemMaterial m         = {2400, 30e9, 0.3};
  const PetscReal   length[3] = {1, 0.8, 0.6}, g[3] = {1, -2, -9.81}, weight = 2400 * 0.48, area = 0.48;
  const PetscInt    n[3]      = {5, 4, 3};
  Mesh              mesh;
  FemModel          model;
  PetscReal        *r, sum[3] = {0, 0, 0}, moment[3] = {0, 0, 0}, big = 0;
  Table             table;

  PetscFunctionBeginUser;
  PetscCall(TableCreateConstant(2e5, &table));
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_TET4, length, n, 0.2, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
  for (PetscInt d = 0; d < 3; d++) PetscCall(CaseFix(model, "xmin", d, d == 1 ? 1e-5 : 0));
  PetscCall(CaseTraction(model, "xmax", 1e5, 2e5, -3e5));
  PetscCall(FemModelAddPressure(model, "zmax", &table)); /* 1 x 0.8 = 0.8 m2, pushes down */
  PetscCall(FemModelSetGravity(model, g));
  PetscCall(CaseSolve(model));
  PetscCall(PetscMalloc1(3 * mesh.n_nodes, &r));
  PetscCall(FemModelGetField(model, "reaction", r));
  for (PetscInt i = 0; i < mesh.n_nodes; i++)
    for (PetscInt d = 0; d < 3; d++) {
      sum[d] += r[3 * i + d];
      moment[d] += mesh.x[3 * i + (d + 1) % 3] * r[3 * i + (d + 2) % 3] - mesh.x[3 * i + (d + 2) % 3] * r[3 * i + (d + 1) % 3];
      big = PetscMax(big, PetscAbsReal(r[3 * i + d]));
    }
  {
    const PetscReal load[3] = {1e5 * area + weight * g[0], 2e5 * area + weight * g[1], -3e5 * area + weight * g[2] - 2e5 * 0.8}, end[3] = {1e5 * area, 2e5 * area, -3e5 * area};
    const PetscReal at_end[3] = {1, 0.4, 0.3}, middle[3] = {0.5, 0.4, 0.3}, top[3] = {0.5, 0.4, 0.6}, push[3] = {0, 0, -2e5 * 0.8};

    for (PetscInt d = 0; d < 3; d++) {
      const PetscInt a = (d + 1) % 3, b = (d + 2) % 3;

      CheckNear(sum[d], -load[d], 1e-10 * big * 100);
      CheckNear(moment[d], -(at_end[a] * end[b] - at_end[b] * end[a] + weight * (middle[a] * g[b] - middle[b] * g[a]) + top[a] * push[b] - top[b] * push[a]), 1e-10 * big * 100);
    }
  }
  PetscCall(PetscFree(r));
  PetscCall(TableDestroy(&table));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CountFactorisations(PetscInt *count)
{
  PetscLogEvent      event;
  PetscEventPerfInfo info;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventGetId("MatCholFctrNum", &event));
  PetscCall(PetscLogEventGetPerfInfo(PETSC_DETERMINE, event, &info));
  *count = (PetscInt)info.count;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A support driven through a table in 10 steps: proportional answers, work equal to strain energy, K factorised once. */
static PetscErrorCode TestTenStepsOneFactorisation(void)
{
  const FemMaterial m         = {2400, 30e9, 0.2};
  const PetscReal   length[3] = {2, 1, 1}, time[2] = {0, 1}, value[2] = {0, 1e-3};
  const PetscInt    n[3]      = {6, 3, 3};
  PetscInt          before, after;
  Mesh              mesh;
  FemModel          model;
  Stepper           s;
  Table             table;
  Ledger            ledger;

  PetscFunctionBeginUser;
  PetscCall(PetscLogDefaultBegin());
  PetscCall(CountFactorisations(&before));
  PetscCall(TableCreate(2, time, value, &table));
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX8, length, n, 0.1, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
  PetscCall(CaseFix(model, "xmin", 0, 0));
  PetscCall(CaseFix(model, "ymin", 1, 0));
  PetscCall(CaseFix(model, "zmin", 2, 0));
  PetscCall(FemModelFix(model, "xmax", 0, FEM_DISPLACEMENT, &table));
  PetscCall(FemModelAddHistory(model, "reaction", "xmax"));
  PetscCall(FemModelAddHistory(model, "displacement", "xmax"));
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModelGetStepper(model, &s));
  CheckInt(s.n_history, 6);
  CheckTrue(!strcmp(s.history_name[0], "reaction(xmax).x"));
  CheckTrue(!strcmp(s.history_unit[0], "N"));
  for (PetscInt k = 0; k < 10; k++) {
    PetscCall(s.step(s.ctx, 0.1 * k, 0.1));
    CheckClose(CaseHistory(model, "displacement(xmax).x"), 1e-4 * (k + 1), 1e-12);
    CheckClose(CaseHistory(model, "reaction(xmax).x"), 30e9 * 0.5e-4 * (k + 1), 1e-9); /* E A u/L, A = 1, L = 2 */
    PetscCall(CaseLedger(model, &ledger));
    CheckClose(ledger.energy[LEDGER_WORK], 0.5 * 30e9 * 0.5e-4 * (k + 1) * 1e-4 * (k + 1), 1e-9);
    CheckBelow(LedgerError(&ledger), 1e-10);
  }
  PetscCall(CountFactorisations(&after));
  CheckInt(after - before, 1);
  PetscCall(TableDestroy(&table));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ten load steps, and five + checkpoint + five in another model: the same bits, work included. */
static PetscErrorCode TestRestartContinuesBitForBit(void)
{
  const FemMaterial m         = {2400, 30e9, 0.2};
  const PetscReal   length[3] = {2, 1, 1}, time[3] = {0, 0.3, 1}, value[3] = {0, 1e-3, 2e-4}, g[3] = {0, 0, -9.81};
  const PetscInt    n[3]      = {6, 3, 3};
  char              file[]    = "fem_static_restart_XXXXXX.h5";
  PetscReal        *bits[2];
  PetscInt          count     = 0;
  Table             table;

  PetscFunctionBeginUser;
  {
    const int fd = mkstemps(file, 3);

    CheckTrue(fd >= 0);
    close(fd);
  }
  PetscCall(TableCreate(3, time, value, &table));
  for (PetscInt k = 0; k < 2; k++) {
    Ledger ledger;

    for (PetscInt half = 0; half < 2; half++) { /* the first half alone only when restarting */
      Mesh       mesh;
      FemModel   model;
      Stepper    s;
      Checkpoint checkpoint;

      if (!k && !half) continue;
      PetscCall(CaseBox(PETSC_COMM_SELF, MESH_TET4, length, n, 0.1, &mesh));
      PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
      for (PetscInt d = 0; d < 3; d++) PetscCall(CaseFix(model, "xmin", d, 0));
      PetscCall(FemModelFix(model, "xmax", 2, FEM_DISPLACEMENT, &table));
      PetscCall(FemModelSetGravity(model, g));
      PetscCall(FemModelSetUp(model));
      PetscCall(FemModelGetStepper(model, &s));
      if (k && half) {
        PetscCall(CheckpointOpen(PETSC_COMM_SELF, file, &checkpoint));
        PetscCall(s.load(s.ctx, checkpoint));
        PetscCall(CheckpointClose(&checkpoint));
      }
      for (PetscInt j = k && half ? 5 : 0; j < (half ? 10 : 5); j++) PetscCall(s.step(s.ctx, 0.1 * j, 0.1));
      if (!half) {
        PetscCall(CheckpointCreate(PETSC_COMM_SELF, file, &checkpoint));
        PetscCall(s.save(s.ctx, checkpoint));
        PetscCall(CheckpointClose(&checkpoint));
      } else {
        count = 9 * mesh.n_nodes + LEDGER_TERMS;
        PetscCall(PetscMalloc1(count, &bits[k]));
        PetscCall(FemModelGetField(model, "displacement", bits[k]));
        PetscCall(FemModelGetField(model, "velocity", bits[k] + 3 * mesh.n_nodes));
        PetscCall(FemModelGetField(model, "reaction", bits[k] + 6 * mesh.n_nodes));
        PetscCall(CaseLedger(model, &ledger));
        PetscCall(PetscArraycpy(bits[k] + 9 * mesh.n_nodes, ledger.energy, LEDGER_TERMS));
        CheckBelow(LedgerError(&ledger), 1e-10);
      }
      PetscCall(FemModelDestroy(&model));
      PetscCall(MeshDestroy(&mesh));
    }
  }
  for (PetscInt k = 0; k < count; k++) CheckTrue(bits[0][k] == bits[1][k]);
  PetscCall(PetscFree(bits[0]));
  PetscCall(PetscFree(bits[1]));
  PetscCall(TableDestroy(&table));
  unlink(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two materials in series, nu = 0: the same stress in both, strains as 1/E. */
static PetscErrorCode TestTwoMaterials(void)
{
  const FemMaterial soft = {1000, 1e9, 0}, stiff = {1000, 4e9, 0};
  const PetscReal   length[3] = {2, 1, 0};
  const PetscInt    n[3]      = {8, 4, 0};
  Mesh              mesh;
  MeshGroup        *whole, *half;
  FemModel          model;
  PetscReal        *u;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  PetscCall(PetscRealloc(sizeof(MeshGroup) * (mesh.n_groups + 1), &mesh.group));
  whole = &mesh.group[mesh.n_groups - 1];
  half  = &mesh.group[mesh.n_groups++];
  *half = *whole;
  PetscCall(PetscStrncpy(half->name, "right", sizeof(half->name)));
  PetscCall(PetscStrncpy(whole->name, "left", sizeof(whole->name)));
  PetscCall(PetscMalloc1(whole->n_cells, &half->cell));
  {
    PetscInt left = 0, right = 0;

    for (PetscInt k = 0; k < whole->n_cells; k++) {
      const PetscInt c = whole->cell[k];

      if (mesh.x[3 * mesh.node[mesh.start[c]]] < 1 - 1e-9) whole->cell[left++] = c;
      else half->cell[right++] = c;
    }
    whole->n_cells = left;
    half->n_cells  = right;
  }
  PetscCall(FemModelCreate(PETSC_COMM_SELF, &model));
  PetscCall(FemModelSetKind(model, FEM_PLANE_STRESS, 0.1));
  PetscCall(FemModelSetMesh(model, &mesh));
  PetscCall(FemModelAddMaterial(model, "left", &soft));
  PetscCall(FemModelAddMaterial(model, "right", &stiff));
  PetscCall(CaseFix(model, "xmin", 0, 0));
  PetscCall(CaseFix(model, "ymin", 1, 0));
  PetscCall(CaseTraction(model, "xmax", 1e6, 0, 0));
  PetscCall(CaseSolve(model));
  PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
  PetscCall(FemModelGetField(model, "displacement", u));
  CheckClose(u[3 * CaseNodeAt(&mesh, 1, 0.5, 0)], 1e-3, 1e-10);
  CheckClose(u[3 * CaseNodeAt(&mesh, 2, 0.5, 0)], 1.25e-3, 1e-10);
  PetscCall(PetscFree(u));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Multigrid and the factor agree: the same body by both, on one rank. */
static PetscErrorCode TestMultigridAgreesWithFactor(void)
{
  const FemMaterial m         = {2400, 30e9, 0.3};
  const PetscReal   length[3] = {3, 1, 1};
  const PetscInt    n[3]      = {12, 5, 5};
  Mesh              mesh;
  PetscReal        *u[2];

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX8, length, n, 0.2, &mesh));
  for (PetscInt k = 0; k < 2; k++) {
    FemModel model;

    PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u[k]));
    if (k) PetscCall(PetscOptionsInsertString(NULL, "-fem_ksp_type cg -fem_pc_type gamg -fem_ksp_rtol 1e-11 -fem_ksp_norm_type unpreconditioned"));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
    for (PetscInt d = 0; d < 3; d++) PetscCall(CaseFix(model, "xmin", d, 0));
    PetscCall(CaseTraction(model, "xmax", 1e5, 2e5, -1e5));
    PetscCall(CaseSolve(model));
    PetscCall(FemModelGetField(model, "displacement", u[k]));
    PetscCall(FemModelDestroy(&model));
  }
  PetscCall(PetscOptionsClearValue(NULL, "-fem_ksp_type"));
  PetscCall(PetscOptionsClearValue(NULL, "-fem_pc_type"));
  PetscCall(PetscOptionsClearValue(NULL, "-fem_ksp_rtol"));
  PetscCall(PetscOptionsClearValue(NULL, "-fem_ksp_norm_type"));
  for (PetscInt i = 0; i < 3 * mesh.n_nodes; i++) CheckNear(u[1][i], u[0][i], 1e-9 * PetscAbsReal(u[0][3 * CaseNodeAt(&mesh, 3, 1, 1) + 1]));
  PetscCall(PetscFree(u[0]));
  PetscCall(PetscFree(u[1]));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rule by size, Poisson's ratio and ranks, eq. (2.82), as a plan names it; options overrule it, and are named. */
static PetscErrorCode TestSolverIsNamed(void)
{
  char words[128];

  PetscFunctionBeginUser;
  CheckInt(FemSolverRule(3, 1, 19e3, 0.2, 1), FEM_CHOLMOD);
  CheckInt(FemSolverRule(3, 1, 19e3, 0.2, 2), FEM_MUMPS);
  CheckInt(FemSolverRule(3, 1, 21e3, 0.2, 1), FEM_MULTIGRID);
  CheckInt(FemSolverRule(3, 1, 85e3, 0.49, 1), FEM_CHOLMOD); /* 20,000 x sqrt(0.4/0.02) = 89,443 */
  CheckInt(FemSolverRule(3, 1, 95e3, 0.49, 1), FEM_MULTIGRID);
  CheckInt(FemSolverRule(3, 1, 210e3, 0.4999, 1), FEM_MULTIGRID);
  CheckInt(FemSolverRule(3, 1, 1e6, 0.49999, 2), FEM_MUMPS);
  CheckInt(FemSolverRule(3, 2, 21e3, 0.2, 2), FEM_TWO_LEVEL);
  CheckInt(FemSolverRule(3, 2, 19e3, 0.2, 2), FEM_MUMPS);
  CheckInt(FemSolverRule(2, 1, 190e3, 0.2, 1), FEM_CHOLMOD);
  CheckInt(FemSolverRule(2, 1, 210e3, 0.49, 1), FEM_MULTIGRID);
  PetscCall(FemSolverWords(3, 1, 1e3, 0.2, 1, sizeof(words), words));
  CheckContains(words, "Cholesky (CHOLMOD)");
  PetscCall(FemSolverWords(3, 1, 1e6, 0.2, 4, sizeof(words), words));
  CheckContains(words, "conjugate gradients with multigrid");
  PetscCall(PetscOptionsInsertString(NULL, "-fem_ksp_type minres -fem_pc_type jacobi"));
  PetscCall(FemSolverWords(3, 1, 1e3, 0.2, 1, sizeof(words), words));
  PetscCall(PetscOptionsClearValue(NULL, "-fem_ksp_type"));
  PetscCall(PetscOptionsClearValue(NULL, "-fem_pc_type"));
  CheckContains(words, "minres with jacobi, by the options given");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Multigrid on the rigid-body modes, some nodes held in part: few iterations at nu = 0.3, and no more than the size asks for. */
static PetscErrorCode TestMultigridTakesFewIterations(void)
{
  const FemMaterial m         = {2400, 30e9, 0.3};
  const PetscReal   length[3] = {3, 1, 1};
  PetscInt          iterations[2];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 2; k++) {
    const PetscInt n[3] = {12 * (k + 1), 4 * (k + 1), 4 * (k + 1)};
    FemReadings    readings;
    FemModel       model;
    Mesh           mesh;

    PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX8, length, n, 0, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &m, &model));
    PetscCall(CaseFix(model, "xmin", 0, 0));
    PetscCall(CaseFix(model, "ymin", 1, 0));
    PetscCall(CaseFix(model, "zmin", 2, 0));
    PetscCall(CaseTraction(model, "xmax", 1e5, 2e5, -1e5));
    PetscCall(PetscOptionsInsertString(NULL, "-fem_pc_type gamg"));
    PetscCall(CaseSolve(model));
    PetscCall(PetscOptionsClearValue(NULL, "-fem_pc_type"));
    PetscCall(FemModelGetReadings(model, &readings));
    iterations[k] = readings.iterations;
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  CheckBelow(iterations[1], 40);
  CheckBelow(iterations[1], 1.5 * iterations[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestSolverIsNamed)
CHECK_TEST(TestMultigridTakesFewIterations)
CHECK_TEST(TestTimoshenkoBeamConverges)
CHECK_TEST(TestGravityColumn)
CHECK_TEST(TestPressureAllRound)
CHECK_TEST(TestReactionsBalance)
CHECK_TEST(TestTenStepsOneFactorisation)
CHECK_TEST(TestRestartContinuesBitForBit)
CHECK_TEST(TestTwoMaterials)
CHECK_TEST(TestMultigridAgreesWithFactor)

static const struct CMUnitTest tests[] = {TEST(TestSolverIsNamed), TEST(TestMultigridTakesFewIterations), TEST(TestTimoshenkoBeamConverges), TEST(TestGravityColumn), TEST(TestPressureAllRound), TEST(TestReactionsBalance), TEST(TestTenStepsOneFactorisation), TEST(TestRestartContinuesBitForBit), TEST(TestTwoMaterials),
                                          TEST(TestMultigridAgreesWithFactor)};
CHECK_MAIN(tests)
