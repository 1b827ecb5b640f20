/* Central differences: exact waves and periods, energy and momentum to round-off, the critical step, restart bit for bit.  Theory 2.4 */
#include "fem_case.h"
#include "fem_element.h"
#include <petscblaslapack.h>
#include <unistd.h>

/* Pushed end of a bar at Courant 1, nu = 0: nodes follow the characteristic g(t - x/c) to round-off.  Notes T6 */
static PetscErrorCode TestBarIsExactAtCourantOne(void)
{
  const FemMaterial  m         = {7800, 207e9, 0};
  const PetscReal    length[3] = {1, 0.2, 0.2}, h = 0.02, c = PetscSqrtReal(207e9 / 7800), dt = h / c;
  const PetscInt     n[3]      = {50, 1, 1};
  const MeshCellType types[2]  = {MESH_QUAD4, MESH_HEX8};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 2; k++) {
    PetscReal time[11], push[11], *u;
    Table     table;
    Mesh      mesh;
    FemModel  model;
    Stepper   s;

    for (PetscInt j = 0; j <= 10; j++) { /* a pulse of ten steps; the table's points are the steps */
      time[j] = j * dt;
      push[j] = 1e-4 * PetscSqr(sin(PETSC_PI * j / 10));
    }
    PetscCall(TableCreate(11, time, push, &table));
    PetscCall(CaseBox(PETSC_COMM_SELF, types[k], length, n, 0, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, k ? FEM_SOLID : FEM_PLANE_STRESS, FEM_EXPLICIT, 0.2, &m, &model));
    for (PetscInt d = 1; d < mesh.dim; d++) PetscCall(CaseFix(model, "body", d, 0));
    PetscCall(FemModelFix(model, "xmin", 0, FEM_DISPLACEMENT, &table));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetStepper(model, &s));
    for (PetscInt j = 0; j < 45; j++) PetscCall(s.step(s.ctx, j * dt, dt));
    PetscCall(PetscMalloc1(3 * mesh.n_nodes, &u));
    PetscCall(FemModelGetField(model, "displacement", u));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) {
      const PetscInt steps = 45 - (PetscInt)floor(mesh.x[3 * i] / h + 0.5);

      CheckNear(u[3 * i], steps < 0 || steps > 10 ? 0 : push[steps], 1e-14);
    }
    PetscCall(PetscFree(u));
    PetscCall(TableDestroy(&table));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One free mode, omega_h = sqrt(2E/rho)/L: u_n = v0 dt sin(n theta)/sin(theta), sin(theta/2) = omega_h dt/2.  Notes T1 */
static PetscErrorCode TestPeriodErrorHasItsClosedForm(void)
{
  const FemMaterial m         = {2000, 1e9, 0};
  const PetscReal   length[3] = {0.5, 0.5, 0}, v0[3] = {3, 0, 0}, omega = PetscSqrtReal(2 * 1e9 / 2000) / 0.5;
  const PetscInt    n[3]      = {1, 1, 0};

  PetscFunctionBeginUser;
  for (PetscInt k = 1; k <= 3; k++) {
    const PetscReal dt = 0.5 * k / omega, theta = 2 * asin(omega * dt / 2);
    Mesh            mesh;
    FemModel        model;
    Stepper         s;
    PetscReal       u[12];

    PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRAIN, FEM_EXPLICIT, 1, &m, &model));
    PetscCall(CaseFix(model, "body", 1, 0));
    PetscCall(CaseFix(model, "xmin", 0, 0));
    PetscCall(FemModelSetInitialVelocity(model, v0));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetStepper(model, &s));
    for (PetscInt j = 0; j < 1000; j++) {
      PetscCall(s.step(s.ctx, j * dt, dt));
      PetscCall(FemModelGetField(model, "displacement", u));
      CheckNear(u[3], 3 * dt * sin((j + 1) * theta) / sin(theta), 1e-10 * 3 / omega);
    }
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A busy run: sudden gravity, a ramped traction, a moving support, an initial velocity, damping alpha. */
static PetscErrorCode BusyModel(MPI_Comm comm, MeshCellType type, PetscReal alpha, PetscBool elements, Mesh *mesh, FemModel *model)
{
  const FemMaterial m         = {2400, 3e9, 0.3};
  const PetscReal   length[3] = {1, 0.5, 0.5}, v0[3] = {0.1, -0.2, 0.3}, g[3] = {1, -9.81, 3}, down[3] = {0, -1, 0.3};
  const PetscInt    n[3]      = {6, 3, 3};
  const PetscReal   time[3] = {0, 1e-3, 2e-3}, speed[3] = {0, 0.05, -0.02}, press[3] = {0, 1e5, 0};
  Table             motion, load;

  PetscFunctionBeginUser;
  if (elements) PetscCall(PetscOptionsSetValue(NULL, "-fem_elements", "1"));
  PetscCall(TableCreate(3, time, speed, &motion));
  PetscCall(TableCreate(3, time, press, &load));
  PetscCall(CaseBox(comm, type, length, n, 0.2, mesh));
  PetscCall(CaseModel(comm, mesh, MeshCellDim(type) == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, FEM_EXPLICIT, 0.4, &m, model));
  PetscCall(FemModelFix(*model, "xmin", 0, FEM_VELOCITY, &motion));
  for (PetscInt d = 1; d < mesh->dim; d++) PetscCall(CaseFix(*model, "xmin", d, 0)); /* a body in flight loses digits of K u to its rigid motion */
  PetscCall(FemModelAddTraction(*model, "ymax", down, &load));
  PetscCall(FemModelAddPressure(*model, "xmax", &load));
  PetscCall(FemModelSetGravity(*model, g));
  PetscCall(FemModelSetInitialVelocity(*model, v0));
  PetscCall(FemModelSetDamping(*model, alpha));
  PetscCall(FemModelAddHistory(*model, "reaction", "xmin"));
  PetscCall(FemModelAddHistory(*model, "velocity", "xmin"));
  PetscCall(FemModelSetUp(*model));
  PetscCall(TableDestroy(&motion));
  PetscCall(TableDestroy(&load));
  if (elements) PetscCall(PetscOptionsClearValue(NULL, "-fem_elements"));
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

/* Every joule accounted for over thousands of steps, close to the critical step, damped or not.  Eq. (2.20), notes T2 */
static PetscErrorCode TestEnergyClosesToRoundOff(void)
{
  const MeshCellType types[4] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 8; k++) {
    Mesh      mesh;
    FemModel  model;
    Ledger    ledger;
    PetscReal dt, worst = 0;

    PetscCall(BusyModel(PETSC_COMM_SELF, types[k % 4], k < 4 ? 0 : 300, PETSC_FALSE, &mesh, &model));
    PetscCall(FemModelGetCriticalStep(model, &dt));
    dt *= 0.95;
    for (PetscInt j = 0; j < 40; j++) {
      PetscCall(CaseLedger(model, &ledger));
      worst = PetscMax(worst, LedgerError(&ledger));
      PetscCall(Run(model, dt, 100 * j, 100 * j + (j ? 100 : 1)));
      if (j == 0) PetscCall(Run(model, dt, 1, 100));
    }
    CheckBelow(worst, 1e-11);
    CheckPositive(ledger.energy[LEDGER_STRAIN]);
    if (k >= 4) CheckPositive(ledger.energy[LEDGER_DAMPING]);
    else CheckNear(ledger.energy[LEDGER_DAMPING], 0, 0);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first step too: a load that appears at once on a body at rest does exactly the work it does. */
static PetscErrorCode TestEnergyOfTheFirstStep(void)
{
  const FemMaterial m         = {2400, 3e9, 0.3};
  const PetscReal   length[3] = {1, 1, 0}, g[3] = {0, -10, 0}, dt = 1e-5;
  const PetscInt    n[3]      = {4, 4, 0};
  Mesh              mesh;
  FemModel          model;
  Ledger            ledger;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_EXPLICIT, 1, &m, &model));
  PetscCall(FemModelSetGravity(model, g));
  PetscCall(FemModelSetUp(model));
  PetscCall(Run(model, dt, 0, 1));
  PetscCall(CaseLedger(model, &ledger));
  /* free fall: v_(1/2) = g dt/2, v_(3/2) = 3 g dt/2, kinetic = m v_(1/2) v_(3/2)/2 */
  CheckClose(ledger.energy[LEDGER_KINETIC], 0.5 * 2400 * 0.75 * 100 * dt * dt, 1e-12);
  CheckClose(ledger.energy[LEDGER_WORK], ledger.energy[LEDGER_KINETIC], 1e-12);
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A free body with a disorderly velocity keeps its linear and angular momentum.  Notes T14 */
static PetscErrorCode TestFreeBodyKeepsMomentum(void)
{
  const FemMaterial  m         = {2400, 3e9, 0.3};
  const PetscReal    length[3] = {1, 0.5, 0.5};
  const PetscInt     n[3]      = {5, 3, 3};
  const MeshCellType types[2]  = {MESH_TET4, MESH_HEX8};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 2; k++) {
    PetscReal p[2][6], big = 0, dt;
    Mesh      mesh;
    FemModel  model;
    FemState  st;

    PetscCall(CaseBox(PETSC_COMM_SELF, types[k], length, n, 0.2, &mesh));
    PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_EXPLICIT, 1, &m, &model));
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetStableStep(model, &dt));
    for (PetscInt pass = 0; pass < 2; pass++) {
      PetscCall(FemModelGetState(model, &st));
      for (PetscInt i = 0; i < 6; i++) p[pass][i] = 0;
      for (PetscInt i = 0; i < st.n_nodes; i++) {
        if (!pass)
          for (PetscInt d = 0; d < 3; d++) st.v[3 * i + d] = sin(7.0 * i + 3 * d);
        for (PetscInt d = 0; d < 3; d++) {
          const PetscInt a = (d + 1) % 3, b = (d + 2) % 3;

          p[pass][d] += st.mass[i] * st.v[3 * i + d];
          p[pass][3 + d] += st.mass[i] * (st.x[3 * i + a] * st.v[3 * i + b] - st.x[3 * i + b] * st.v[3 * i + a]);
          big += st.mass[i] * PetscAbsReal(st.v[3 * i + d]);
        }
      }
      PetscCall(FemModelRestoreState(model, &st));
      if (!pass) PetscCall(Run(model, dt, 0, 2000));
    }
    for (PetscInt i = 0; i < 6; i++) CheckNear(p[1][i], p[0][i], 1e-11 * big);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole body driven at a growing speed: u = a t^2/2, v = a t, reaction = mass x a. */
static PetscErrorCode TestPrescribedVelocity(void)
{
  const FemMaterial m         = {2000, 1e9, 0.2};
  const PetscReal   length[3] = {1, 1, 0}, time[2] = {0, 1}, speed[2] = {0, 5}, dt = 1e-4;
  const PetscInt    n[3]      = {3, 3, 0};
  Mesh              mesh;
  FemModel          model;
  Table             table;
  Ledger            ledger;

  PetscFunctionBeginUser;
  PetscCall(TableCreate(2, time, speed, &table));
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_TRI3, length, n, 0.2, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_EXPLICIT, 0.1, &m, &model));
  PetscCall(FemModelFix(model, "body", 0, FEM_VELOCITY, &table));
  PetscCall(CaseFix(model, "body", 1, 0));
  PetscCall(FemModelAddHistory(model, "reaction", "body"));
  PetscCall(FemModelAddHistory(model, "velocity", "body"));
  PetscCall(FemModelAddHistory(model, "displacement", "body"));
  PetscCall(FemModelSetUp(model));
  PetscCall(Run(model, dt, 0, 200));
  CheckClose(CaseHistory(model, "displacement(body).x"), 0.5 * 5 * 0.02 * 0.02, 1e-10);
  CheckClose(CaseHistory(model, "velocity(body).x"), 5 * 0.02, 1e-9);
  CheckClose(CaseHistory(model, "reaction(body).x"), 2000 * 0.1 * 5, 1e-8); /* the acceleration is a second difference of 0.5 a t^2 */
  PetscCall(CaseLedger(model, &ledger));
  CheckClose(ledger.energy[LEDGER_WORK], ledger.energy[LEDGER_KINETIC], 1e-9);
  PetscCall(TableDestroy(&table));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rigid flight under mass-proportional drag: v_(n+1/2) = v0 (1 - a) ((1 - a)/(1 + a))^n, a = alpha dt/2. */
static PetscErrorCode TestDampingHasItsClosedForm(void)
{
  const FemMaterial m         = {2000, 1e9, 0.2};
  const PetscReal   length[3] = {1, 1, 0}, v0[3] = {2, 0, 0}, dt = 1e-5, a = 0.5 * 400 * dt;
  const PetscInt    n[3]      = {3, 3, 0};
  Mesh              mesh;
  FemModel          model;
  FemState          st;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_EXPLICIT, 0.1, &m, &model));
  PetscCall(FemModelSetInitialVelocity(model, v0));
  PetscCall(FemModelSetDamping(model, 400));
  PetscCall(FemModelSetUp(model));
  PetscCall(Run(model, dt, 0, 1000));
  PetscCall(FemModelGetState(model, &st));
  for (PetscInt i = 0; i < st.n_nodes; i++) CheckClose(st.v[2 * i], 2 * (1 - a) * pow((1 - a) / (1 + a), 999), 1e-11);
  PetscCall(FemModelRestoreState(model, &st));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest eigenvalue of the free part of M^-1 K, assembled densely from the elements' own kernels. */
static PetscErrorCode DenseOmega(const Mesh *mesh, MeshCellType type, const FemMaterial *m, const PetscReal *x, const char *fixed, PetscReal *omega)
{
  const FemShape  *shape = FemShapeGet(type);
  const PetscInt   dim = shape->dim, n = mesh->n_nodes * dim;
  const FemElastic law = {m->young * m->poisson / ((1 + m->poisson) * (1 - 2 * m->poisson)), m->young / (2 * (1 + m->poisson)), 0, 0};
  PetscReal       *K, *mass, *lambda, *work;
  PetscBLASInt     size, room, info;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc4(n * n, &K, mesh->n_nodes, &mass, n, &lambda, 8 * n, &work));
  for (PetscInt c = 0; c < mesh->n_cells; c++) {
    const PetscInt *node = &mesh->node[mesh->start[c]];
    PetscReal       xe[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], Ke[FEM_MAX_DOFS * FEM_MAX_DOFS], me[FEM_MAX_NODES];
    FemModes        modes;

    if (mesh->type[c] != type) continue;
    for (PetscInt a = 0; a < shape->nodes; a++)
      for (PetscInt d = 0; d < dim; d++) xe[a * dim + d] = x[3 * node[a] + d];
    (void)FemGradients(shape, xe, 1, dN, w);
    if (FemModesHas(shape)) {
      FemModesCreate(shape, &law, xe, w, &modes);
      FemModesStiffness(shape, &law, dN, w, &modes, Ke);
    } else FemStiffness(shape, &law, dN, w, Ke);
    FemLumpedMass(shape, m->density, w, me);
    for (PetscInt a = 0; a < shape->nodes; a++) {
      mass[node[a]] += me[a];
      for (PetscInt b = 0; b < shape->nodes; b++)
        for (PetscInt i = 0; i < dim; i++)
          for (PetscInt j = 0; j < dim; j++) K[(node[a] * dim + i) * n + node[b] * dim + j] += Ke[(a * dim + i) * shape->nodes * dim + b * dim + j];
    }
  }
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt j = 0; j < n; j++) K[i * n + j] = fixed[i / dim] || fixed[j / dim] ? 0 : K[i * n + j] / PetscSqrtReal(mass[i / dim] * mass[j / dim]);
  size = (PetscBLASInt)n;
  room = 8 * size;
  LAPACKsyev_("N", "U", &size, K, &size, lambda, work, &room, &info);
  CheckInt(info, 0);
  *omega = PetscSqrtReal(lambda[n - 1]);
  PetscCall(PetscFree4(K, mass, lambda, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Critical step within 1 % of dense eigenvalues, the bound never above it; stable just below, not just above. */
static PetscErrorCode TestCriticalStep(void)
{
  const MeshCellType types[11] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8, MESH_PRISM6, MESH_TRI6, MESH_QUAD8, MESH_QUAD9, MESH_TET10, MESH_HEX20, MESH_PRISM15};
  const FemMaterial  m         = {2400, 3e9, 0.3};
  const PetscReal    length[3] = {1, 0.5, 0.5}, v0[3] = {1, 0.5, 0};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 11; k++) {
    const PetscInt n[3] = {k < 5 ? 5 : 2, k < 5 ? 3 : 2, k < 5 ? 3 : 1};
    PetscReal omega = 0, critical, bound, high[2] = {0, 0}, *u;
    Mesh      mesh;
    FemModel  model;
    char     *fixed;

    PetscCall(CaseBox(PETSC_COMM_SELF, types[k], length, n, 0.25, &mesh));
    PetscCall(PetscCalloc2(mesh.n_nodes, &fixed, 3 * mesh.n_nodes, &u));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) fixed[i] = mesh.x[3 * i] < 1e-9;
    PetscCall(DenseOmega(&mesh, types[k], &m, mesh.x, fixed, &omega));
    for (PetscInt run = 0; run < 2; run++) {
      PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, mesh.dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, FEM_EXPLICIT, 1, &m, &model));
      for (PetscInt d = 0; d < mesh.dim; d++) PetscCall(CaseFix(model, "xmin", d, 0));
      PetscCall(FemModelSetInitialVelocity(model, v0));
      PetscCall(FemModelSetUp(model));
      PetscCall(FemModelGetCriticalStep(model, &critical));
      PetscCall(FemModelGetStableStep(model, &bound));
      CheckClose(critical, 2 / omega, 1e-3);
      CheckBelow(bound, 2 / omega);
      CheckAbove(bound, 0.6 * 2 / omega);
      PetscCall(Run(model, 2 / omega * (run ? 1.02 : 0.99), 0, 1500));
      PetscCall(FemModelGetField(model, "displacement", u));
      for (PetscInt i = 0; i < 3 * mesh.n_nodes; i++) high[run] = PetscMax(high[run], PetscAbsReal(u[i]));
      PetscCall(FemModelDestroy(&model));
    }
    printf("  gmsh type %d: bound/critical %.3f\n", (int)types[k], bound / critical);
    CheckBelow(high[0], 0.1); /* v0/omega_1 is about 1e-3 m */
    CheckAbove(high[1], 1e3);
    PetscCall(PetscFree2(fixed, u));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AllBits(FemModel model, PetscInt nodes, PetscReal **bits, PetscInt *n)
{
  Ledger  ledger;
  Stepper s;

  PetscFunctionBeginUser;
  *n = 9 * nodes + LEDGER_TERMS + 6;
  PetscCall(PetscCalloc1(*n, bits));
  PetscCall(FemModelGetField(model, "displacement", *bits));
  PetscCall(FemModelGetField(model, "velocity", *bits + 3 * nodes));
  PetscCall(FemModelGetField(model, "reaction", *bits + 6 * nodes));
  PetscCall(CaseLedger(model, &ledger));
  PetscCall(PetscArraycpy(*bits + 9 * nodes, ledger.energy, LEDGER_TERMS));
  PetscCall(FemModelGetStepper(model, &s));
  for (PetscInt i = 0; i < s.n_history; i++) PetscCall(s.history(s.ctx, i, *bits + 9 * nodes + LEDGER_TERMS + i));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestThreadsDoNotChangeABit(void)
{
  PetscFunctionBeginUser;
  for (PetscInt elements = 0; elements < 2; elements++) {
    PetscReal *bits[2];
    PetscInt   n;

    for (PetscInt threads = 1; threads <= 2; threads++) {
      Mesh     mesh;
      FemModel model;

      PetscCall(BusyModel(PETSC_COMM_SELF, MESH_HEX8, 100, elements ? PETSC_TRUE : PETSC_FALSE, &mesh, &model));
      PetscCall(FemModelSetThreads(model, threads));
      PetscCall(Run(model, 1e-5, 0, 300));
      PetscCall(AllBits(model, mesh.n_nodes, &bits[threads - 1], &n));
      PetscCall(FemModelDestroy(&model));
      PetscCall(MeshDestroy(&mesh));
    }
    for (PetscInt k = 0; k < n; k++) CheckTrue(bits[0][k] == bits[1][k]);
    PetscCall(PetscFree(bits[0]));
    PetscCall(PetscFree(bits[1]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows and elements are twins: the same run to round-off. */
static PetscErrorCode TestRowsAgreeWithElements(void)
{
  const MeshCellType types[4] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) {
    PetscReal *u[2], big = 0;
    PetscInt   nodes = 0;

    for (PetscInt k = 0; k < 2; k++) {
      Mesh     mesh;
      FemModel model;

      PetscCall(BusyModel(PETSC_COMM_SELF, types[t], 0, k ? PETSC_TRUE : PETSC_FALSE, &mesh, &model));
      nodes = mesh.n_nodes;
      PetscCall(PetscMalloc1(3 * nodes, &u[k]));
      PetscCall(Run(model, 1e-5, 0, 300));
      PetscCall(FemModelGetField(model, "displacement", u[k]));
      PetscCall(FemModelDestroy(&model));
      PetscCall(MeshDestroy(&mesh));
    }
    for (PetscInt k = 0; k < 3 * nodes; k++) big = PetscMax(big, PetscAbsReal(u[0][k]));
    for (PetscInt k = 0; k < 3 * nodes; k++) CheckNear(u[1][k], u[0][k], 1e-12 * big);
    PetscCall(PetscFree(u[0]));
    PetscCall(PetscFree(u[1]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 2N steps, and N + checkpoint + N in another model: the same bits. Asking for energies on the way changes none. */
static PetscErrorCode TestRestartContinuesBitForBit(void)
{
  char file[] = "fem_restart_XXXXXX.h5";

  PetscFunctionBeginUser;
  {
    const int fd = mkstemps(file, 3);

    CheckTrue(fd >= 0);
    close(fd);
  }
  for (PetscInt method = 0; method < 2; method++) {
    PetscReal *bits[2];
    PetscInt   n;

    for (PetscInt k = 0; k < 2; k++) {
      Mesh       mesh;
      FemModel   model;
      Stepper    s;
      Checkpoint checkpoint;
      Ledger     ledger;

      PetscCall(BusyModel(PETSC_COMM_SELF, method ? MESH_TET4 : MESH_QUAD4, 100, PETSC_FALSE, &mesh, &model));
      if (k) {
        PetscCall(Run(model, 1e-5, 0, 100));
        PetscCall(CaseLedger(model, &ledger));
        PetscCall(Run(model, 1e-5, 100, 151));
        PetscCall(FemModelGetStepper(model, &s));
        PetscCall(CheckpointCreate(PETSC_COMM_SELF, file, &checkpoint));
        PetscCall(s.save(s.ctx, checkpoint));
        PetscCall(CheckpointClose(&checkpoint));
        PetscCall(FemModelDestroy(&model));
        PetscCall(MeshDestroy(&mesh));
        PetscCall(BusyModel(PETSC_COMM_SELF, method ? MESH_TET4 : MESH_QUAD4, 100, PETSC_FALSE, &mesh, &model));
        PetscCall(FemModelGetStepper(model, &s));
        PetscCall(CheckpointOpen(PETSC_COMM_SELF, file, &checkpoint));
        PetscCall(s.load(s.ctx, checkpoint));
        PetscCall(CheckpointClose(&checkpoint));
        PetscCall(Run(model, 1e-5, 151, 302));
      } else PetscCall(Run(model, 1e-5, 0, 302));
      PetscCall(AllBits(model, mesh.n_nodes, &bits[k], &n));
      PetscCall(FemModelDestroy(&model));
      PetscCall(MeshDestroy(&mesh));
    }
    for (PetscInt k = 0; k < n; k++) CheckTrue(bits[0][k] == bits[1][k]);
    PetscCall(PetscFree(bits[0]));
    PetscCall(PetscFree(bits[1]));
  }
  unlink(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A force lent from outside: one kick of impulse f dt (half a step's at the start), then cleared. */
static PetscErrorCode TestLentForceActsOnce(void)
{
  const FemMaterial m         = {2000, 1e9, 0.2};
  const PetscReal   length[3] = {1, 1, 0}, dt = 1e-5;
  const PetscInt    n[3]      = {2, 2, 0};
  Mesh              mesh;
  FemModel          model;
  FemState          st;
  PetscReal         p[3];

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, n, 0, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_PLANE_STRESS, FEM_EXPLICIT, 0.1, &m, &model));
  PetscCall(FemModelSetUp(model));
  for (PetscInt k = 0; k < 3; k++) {
    PetscCall(FemModelGetState(model, &st));
    for (PetscInt d = 0; d < 2; d++) CheckNear(st.f_ext[d], 0, 0);
    if (k < 2) st.f_ext[0] += 100;
    PetscCall(FemModelRestoreState(model, &st));
    PetscCall(Run(model, dt, k, k + 1));
    PetscCall(FemModelGetState(model, &st));
    p[k] = 0;
    for (PetscInt i = 0; i < st.n_nodes; i++) p[k] += st.mass[i] * st.v[2 * i];
    PetscCall(FemModelRestoreState(model, &st));
  }
  CheckClose(p[0], 100 * dt / 2, 1e-12);
  CheckClose(p[1], 100 * dt * 1.5, 1e-12);
  CheckClose(p[2], 100 * dt * 1.5, 1e-12);
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestBarIsExactAtCourantOne)
CHECK_TEST(TestPeriodErrorHasItsClosedForm)
CHECK_TEST(TestEnergyClosesToRoundOff)
CHECK_TEST(TestEnergyOfTheFirstStep)
CHECK_TEST(TestFreeBodyKeepsMomentum)
CHECK_TEST(TestPrescribedVelocity)
CHECK_TEST(TestDampingHasItsClosedForm)
CHECK_TEST(TestCriticalStep)
CHECK_TEST(TestThreadsDoNotChangeABit)
CHECK_TEST(TestRowsAgreeWithElements)
CHECK_TEST(TestRestartContinuesBitForBit)
CHECK_TEST(TestLentForceActsOnce)

static const struct CMUnitTest tests[] = {TEST(TestBarIsExactAtCourantOne), TEST(TestPeriodErrorHasItsClosedForm), TEST(TestEnergyClosesToRoundOff), TEST(TestEnergyOfTheFirstStep), TEST(TestFreeBodyKeepsMomentum),
                                          TEST(TestPrescribedVelocity), TEST(TestDampingHasItsClosedForm), TEST(TestCriticalStep), TEST(TestThreadsDoNotChangeABit), TEST(TestRowsAgreeWithElements),
                                          TEST(TestRestartContinuesBitForBit), TEST(TestLentForceActsOnce)};
CHECK_MAIN(tests)
