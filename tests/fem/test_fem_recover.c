/*
  Recovered stress, its error estimate, invariants and probes.

  Displacements are often given at the nodes directly, so that the recovery is looked at alone. The smooth case of the orders
  is that of test_fem_order: u = grad phi, phi harmonic.
*/
#include "fem_case.h"
#include "fem_recover.h"
#include "fem_point.h"
#include "fem_stress.h"

static const FemMaterial steel = {7850, 2.1e11, 0.3};

typedef void (*StressField)(const PetscReal x[3], PetscReal s[6]);

/* The nodes of the model follow a field. */
static PetscErrorCode Impose(FemModel model, CaseField field)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < model->n_own; i++) {
    PetscReal x[3] = {0, 0, 0}, u[3];

    for (PetscInt d = 0; d < model->dim; d++) x[d] = model->x[i * model->dim + d];
    field(x, u);
    for (PetscInt d = 0; d < model->dim; d++) model->u[i * model->dim + d] = u[d];
  }
  PetscCall(FemGhosts(model, model->u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A model ready to be imposed upon; one corner held so that set-up accepts it. */
static PetscErrorCode Free(MeshCellType type, const PetscReal length[3], const PetscInt n[3], PetscReal distort, FemKind kind, const FemMaterial *material, Mesh *mesh, FemModel *model)
{
  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, distort, mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, mesh, kind, FEM_EXPLICIT, 1, material, model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static FemKind KindOf(MeshCellType type)
{
  return MeshCellDim(type) == 2 ? FEM_PLANE_STRAIN : FEM_SOLID;
}

/* Hooke's law by hand: stress of a gradient, solid or plane strain. */
static void Hooke(const FemMaterial *m, PetscReal h[3][3], PetscReal s[6])
{
  const PetscReal mu = m->young / (2 * (1 + m->poisson)), lambda = m->young * m->poisson / ((1 + m->poisson) * (1 - 2 * m->poisson)), trace = h[0][0] + h[1][1] + h[2][2];

  for (PetscInt i = 0; i < 3; i++) {
    s[i]     = 2 * mu * h[i][i] + lambda * trace;
    s[3 + i] = mu * (h[i][(i + 1) % 3] + h[(i + 1) % 3][i]);
  }
}

/* ---- exactness ---- */

static void Linear(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * (2 * x[0] - x[1] + 0.5 * x[2]);
  u[1] = 1e-3 * (x[0] + 3 * x[1] - x[2]);
  u[2] = 1e-3 * (-x[0] + x[1] - 2 * x[2]);
}

/* u_x = x^2 + xy, u_y = y^2 - 2xy + xz, u_z = z^2 - 2yz: its stress is linear */
static void Quadratic(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * (x[0] * x[0] + x[0] * x[1]);
  u[1] = 1e-3 * (x[1] * x[1] - 2 * x[0] * x[1] + x[0] * x[2]);
  u[2] = 1e-3 * (x[2] * x[2] - 2 * x[1] * x[2]);
}

static void LinearStress(const PetscReal x[3], PetscReal s[6])
{
  PetscReal h[3][3] = {{2e-3, -1e-3, 0.5e-3}, {1e-3, 3e-3, -1e-3}, {-1e-3, 1e-3, -2e-3}};

  (void)x;
  Hooke(&steel, h, s);
}

static void QuadraticStress(const PetscReal x[3], PetscReal s[6])
{
  PetscReal h[3][3] = {{1e-3 * (2 * x[0] + x[1]), 1e-3 * x[0], 0}, {1e-3 * (x[2] - 2 * x[1]), 1e-3 * (2 * x[1] - 2 * x[0]), 1e-3 * x[0]}, {0, -2e-3 * x[2], 1e-3 * (2 * x[2] - 2 * x[1])}};

  Hooke(&steel, h, s);
}

/* Worst difference of recovered and exact stress over the points, in parts of the largest stress; inner points only when asked. */
static PetscErrorCode Worst(FemModel model, const Mesh *mesh, StressField exact, PetscBool inner, PetscReal *worst)
{
  PetscInt        n;
  const PetscInt *node;
  PetscReal      *stress, big = 0, off = 0;

  PetscFunctionBeginUser;
  PetscCall(FemModelGetPoints(model, &n, &node));
  PetscCall(PetscMalloc1(6 * n, &stress));
  PetscCall(FemModelRecover(model, stress, NULL));
  for (PetscInt p = 0; p < n; p++) {
    PetscReal want[6], at[3] = {0, 0, 0};
    PetscBool edge = PETSC_FALSE;

    for (PetscInt d = 0; d < mesh->dim; d++) {
      at[d] = mesh->x[3 * node[p] + d];
      edge  = (PetscBool)(edge || at[d] < 1e-9 || at[d] > 1 - 1e-9);
    }
    exact(at, want);
    for (PetscInt i = 0; i < 6; i++) {
      if (mesh->dim == 2 && i > 3) continue;
      big = PetscMax(big, PetscAbsReal(want[i]));
      if (!inner || !edge) off = PetscMax(off, PetscAbsReal(stress[6 * p + i] - want[i]));
    }
  }
  *worst = off / big;
  PetscCall(PetscFree(stress));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void PlaneLinear(const PetscReal x[3], PetscReal u[3])
{
  const PetscReal flat[3] = {x[0], x[1], 0};

  Linear(flat, u);
}

static void PlaneLinearStress(const PetscReal x[3], PetscReal s[6])
{
  PetscReal h[3][3] = {{2e-3, -1e-3, 0}, {1e-3, 3e-3, 0}, {0, 0, 0}};

  (void)x;
  Hooke(&steel, h, s);
}

static void PlaneQuadraticStress(const PetscReal x[3], PetscReal s[6])
{
  PetscReal h[3][3] = {{1e-3 * (2 * x[0] + x[1]), 1e-3 * x[0], 0}, {-2e-3 * x[1], 1e-3 * (2 * x[1] - 2 * x[0]), 0}, {0, 0, 0}};

  Hooke(&steel, h, s);
}

/* Uniform stress on distorted meshes, on fine and on hardly any elements. */
static PetscErrorCode TestUniform(void)
{
  static const MeshCellType types[] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8};
  const PetscReal           length[3] = {1, 1, 1};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++)
    for (PetscInt cells = 1; cells <= 4; cells += 3) {
      const PetscInt n[3] = {cells, cells, cells}, flat = MeshCellDim(types[t]) == 2;
      Mesh           mesh;
      FemModel       model;
      PetscReal      worst = 0;

      PetscCall(Free(types[t], length, n, 0.2, KindOf(types[t]), &steel, &mesh, &model));
      PetscCall(FemModelSetUp(model));
      PetscCall(Impose(model, flat ? PlaneLinear : Linear));
      PetscCall(Worst(model, &mesh, flat ? PlaneLinearStress : LinearStress, PETSC_FALSE, &worst));
      CheckBelow(worst, 1e-12);
      PetscCall(FemModelDestroy(&model));
      PetscCall(MeshDestroy(&mesh));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A stress linear in x, from the nodes of a quadratic displacement. The middles of rectangles and boxes see it exactly, so every node does, those of
   the boundary too; in a regular mesh of triangles the errors of a patch cancel at inner nodes. */
static PetscErrorCode TestLinearStress(void)
{
  static const MeshCellType types[] = {MESH_QUAD4, MESH_HEX8, MESH_TRI3};
  const PetscReal           length[3] = {1, 1, 1};
  const PetscInt            cells[3] = {4, 4, 4};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 3; t++) {
    const PetscInt flat = MeshCellDim(types[t]) == 2;
    Mesh           mesh;
    FemModel       model;
    PetscReal      worst = 0;

    PetscCall(Free(types[t], length, cells, 0, KindOf(types[t]), &steel, &mesh, &model));
    PetscCall(FemModelSetUp(model));
    PetscCall(Impose(model, Quadratic));
    PetscCall(Worst(model, &mesh, flat ? PlaneQuadraticStress : QuadraticStress, types[t] == MESH_TRI3 ? PETSC_TRUE : PETSC_FALSE, &worst));
    CheckBelow(worst, 1e-12);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Bending(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * x[0] * (x[2] - 0.5);
  u[1] = 0;
  u[2] = -0.5e-3 * x[0] * x[0];
}

/* A plate of one layer of hexahedra in pure bending, nu = 0: the middles all lie in one plane, and top and bottom are still told apart. */
static PetscErrorCode TestOneLayer(void)
{
  const FemMaterial m = {1000, 1e9, 0};
  const PetscReal   length[3] = {4, 3, 1};
  const PetscInt    cells[3] = {8, 6, 1};
  PetscInt          n_points;
  PetscReal        *stress;
  Mesh              mesh;
  FemModel          model;

  PetscFunctionBeginUser;
  PetscCall(Free(MESH_HEX8, length, cells, 0, FEM_SOLID, &m, &mesh, &model));
  PetscCall(FemModelSetUp(model));
  PetscCall(Impose(model, Bending));
  PetscCall(FemModelGetPoints(model, &n_points, NULL));
  PetscCall(PetscMalloc1(6 * n_points, &stress));
  PetscCall(FemModelRecover(model, stress, NULL));
  for (PetscInt p = 0; p < n_points; p++) CheckNear(stress[6 * p], 1e6 * (mesh.x[3 * p + 2] - 0.5), 1e-6);
  PetscCall(PetscFree(stress));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- orders ---- */

static void Plane(const PetscReal x[3], PetscReal u[3])
{
  u[0] = 1e-3 * exp(x[0]) * cos(x[1]);
  u[1] = -1e-3 * exp(x[0]) * sin(x[1]);
  u[2] = 0;
}

static void Solid(const PetscReal x[3], PetscReal u[3])
{
  const PetscReal r = sqrt(2.0), e = 1e-3 * exp(r * x[0]);

  u[0] = r * e * cos(x[1]) * cos(x[2]);
  u[1] = -e * sin(x[1]) * cos(x[2]);
  u[2] = -e * cos(x[1]) * sin(x[2]);
}

static void PlaneStress(const PetscReal x[3], PetscReal s[6])
{
  const PetscReal e = 1e-3 * exp(x[0]);
  PetscReal       h[3][3] = {{e * cos(x[1]), -e * sin(x[1]), 0}, {-e * sin(x[1]), -e * cos(x[1]), 0}, {0, 0, 0}};

  Hooke(&steel, h, s);
}

static void SolidStress(const PetscReal x[3], PetscReal s[6])
{
  const PetscReal r = sqrt(2.0), e = 1e-3 * exp(r * x[0]), cy = cos(x[1]), sy = sin(x[1]), cz = cos(x[2]), sz = sin(x[2]);
  PetscReal       h[3][3] = {{2 * e * cy * cz, -r * e * sy * cz, -r * e * cy * sz}, {-r * e * sy * cz, -e * cy * cz, e * sy * sz}, {-r * e * cy * sz, e * sy * sz, -e * cy * cz}};

  Hooke(&steel, h, s);
}

/* Nodes moved by up to 0.05, zero on the boundary: neighbours move nearly alike. */
static void Bend(Mesh *mesh)
{
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    PetscReal *x = &mesh->x[3 * i], move = 0.05;

    for (PetscInt d = 0; d < mesh->dim; d++) move *= sin(PETSC_PI * x[d]);
    for (PetscInt d = 0; d < mesh->dim; d++) x[d] += move * (d == 1 ? -1 : 1);
  }
}

/* Energy norms of the errors of raw and recovered stress, and the estimate. distort 0: a smoothly bent mesh. */
static PetscErrorCode Errors(MeshCellType type, PetscInt cells, PetscReal distort, PetscReal *raw, PetscReal *recovered, PetscReal *estimate)
{
  const PetscInt    dim = MeshCellDim(type), n[3] = {cells, cells, cells};
  const CaseField   field = dim == 2 ? Plane : Solid;
  const StressField exact = dim == 2 ? PlaneStress : SolidStress;
  const PetscReal   length[3] = {1, 1, 1};
  const FemShape   *shape = FemShapeGet(type);
  PetscInt         *surface, n_surface, n_points;
  PetscReal        *stress, *u;
  Mesh              mesh;
  FemModel          model;
  PetscInt          cell = 0;

  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, distort, &mesh));
  if (distort == 0) Bend(&mesh);
  PetscCall(PetscMalloc1(mesh.n_nodes, &surface));
  n_surface = CaseSurface(&mesh, length, -1, surface);
  PetscCall(CaseAddNodeGroups(&mesh, n_surface, surface));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, KindOf(type), FEM_STATIC, 1, &steel, &model));
  PetscCall(CaseFixNodes(model, dim, n_surface, surface, mesh.x, field));
  PetscCall(CaseSolve(model));
  PetscCall(FemModelGetPoints(model, &n_points, NULL));
  CheckInt(n_points, mesh.n_nodes);
  PetscCall(PetscMalloc2(6 * n_points, &stress, 3 * n_points, &u));
  PetscCall(FemModelRecover(model, stress, NULL));
  PetscCall(FemModelGetField(model, "displacement", u));
  PetscCall(FemModelComputeError(model, NULL, estimate));
  *raw = *recovered = 0;
  for (PetscInt c = 0; c < mesh.n_cells; c++) {
    const PetscInt *node = &mesh.node[mesh.start[c]];
    PetscReal       x[FEM_MAX_DOFS], xi[FEM_RULE_MAX][3], w[FEM_RULE_MAX];
    PetscInt        points;
    FemReading      reading;

    if (mesh.type[c] != type) continue;
    for (PetscInt a = 0; a < shape->nodes; a++)
      for (PetscInt d = 0; d < dim; d++) x[a * dim + d] = mesh.x[3 * node[a] + d];
    points = FemPointRule(type, 4, xi, w);
    FemReadCell(model, cell++, PETSC_TRUE, &reading);
    for (PetscInt q = 0; q < points; q++) {
      PetscReal       N[FEM_MAX_NODES], dN[FEM_MAX_DOFS], at[3] = {0, 0, 0}, h[3][3] = {{0}}, mine[6], want[6], e[6], f[6];
      const PetscReal dV = w[q] * FemPointAt(shape, x, xi[q], N, dN, at);

      for (PetscInt a = 0; a < shape->nodes; a++)
        for (PetscInt i = 0; i < dim; i++)
          for (PetscInt j = 0; j < dim; j++) h[i][j] += u[3 * node[a] + i] * dN[a * dim + j];
      for (PetscInt i = 0; i < 3; i++) {
        e[i]     = h[i][i];
        e[3 + i] = h[i][(i + 1) % 3] + h[(i + 1) % 3][i];
      }
      if (reading.own) FemModesAdd(shape, &reading.modes, reading.amount, xi[q], dV / w[q], e);
      FemStress(&model->law[0], dim, e, mine);
      exact(at, want);
      for (PetscInt i = 0; i < FEM_PARTS(dim); i++) {
        const PetscInt v = dim == 2 && i == 2 ? 3 : i;

        e[i] = mine[v] - want[v];
        f[i] = -want[v];
        for (PetscInt a = 0; a < shape->nodes; a++) f[i] += N[a] * stress[6 * node[a] + v];
      }
      *raw += dV * FemStressNorm(dim, &model->law[0], e);
      *recovered += dV * FemStressNorm(dim, &model->law[0], f);
    }
  }
  *raw       = sqrt(*raw);
  *recovered = sqrt(*recovered);
  PetscCall(PetscFree2(stress, u));
  PetscCall(PetscFree(surface));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On smoothly bent meshes the recovered stress is an order better; where neighbours are distorted each in its own way it is better by less, and the
   estimate is as good. */
static PetscErrorCode CheckOrders(MeshCellType type, PetscInt coarse)
{
  PetscFunctionBeginUser;
  for (PetscInt smooth = 1; smooth >= 0; smooth--) {
    PetscReal raw[2], recovered[2], estimate[2], order;

    for (PetscInt k = 0; k < 2; k++) PetscCall(Errors(type, coarse << k, smooth ? 0 : 0.15, &raw[k], &recovered[k], &estimate[k]));
    order = log2(recovered[0] / recovered[1]);
    printf("  gmsh type %d, %s, %d and %d cells a side: raw order %.2f, recovered order %.2f, estimate / error %.3f and %.3f\n", (int)type, smooth ? "smooth" : "distorted", (int)coarse, (int)coarse * 2,
           log2(raw[0] / raw[1]), (double)order, (double)(estimate[0] / raw[0]), (double)(estimate[1] / raw[1]));
    CheckNear(log2(raw[0] / raw[1]), 1, 0.1);
    if (smooth) CheckAbove(order, 1.85);
    else CheckAbove(order, 1.3);
    CheckBelow(recovered[1], 0.3 * raw[1]);
    for (PetscInt k = 0; k < 2; k++) CheckNear(estimate[k] / raw[k], 1, 0.2);
    if (smooth) CheckBelow(fabs(estimate[1] / raw[1] - 1), 0.6 * fabs(estimate[0] / raw[0] - 1)); /* tends to 1 */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestOrderTri3(void)
{
  return CheckOrders(MESH_TRI3, 16);
}

static PetscErrorCode TestOrderQuad4(void)
{
  return CheckOrders(MESH_QUAD4, 16);
}

static PetscErrorCode TestOrderTet4(void)
{
  return CheckOrders(MESH_TET4, 8);
}

static PetscErrorCode TestOrderHex8(void)
{
  return CheckOrders(MESH_HEX8, 8);
}

/* ---- invariants ---- */

static PetscErrorCode TestInvariants(void)
{
  const PetscReal tension[6] = {5, 0, 0, 0, 0, 0}, shear[6] = {0, 0, 0, 0, 7, 0}, even[6] = {-4, -4, -4, 0, 0, 0}, twice[6] = {2, 2, 5, 0, 0, 0}, known[6] = {3, 2, 3, 1, 1, 1};
  const PetscReal nearly[6] = {1e9, 1e9 * (1 + 1e-9), 1e9, 1e-3, 0, 0};
  PetscReal       p[3], v[3][3], turned[6];

  PetscFunctionBeginUser;
  CheckNear(FemVonMises(tension), 5, 1e-15);
  CheckNear(FemVonMises(shear), 7 * sqrt(3.0), 1e-14);
  CheckNear(FemVonMises(even), 0, 1e-15);
  FemPrincipal(tension, p, v);
  CheckNear(p[0], 5, 0);
  CheckNear(p[1], 0, 0);
  CheckNear(p[2], 0, 0);
  FemPrincipal(shear, p, v);
  CheckNear(p[0], 7, 1e-14);
  CheckNear(p[1], 0, 1e-14);
  CheckNear(p[2], -7, 1e-14);
  CheckNear(fabs(v[0][1]), sqrt(0.5), 1e-15);
  FemPrincipal(even, p, v);
  for (PetscInt k = 0; k < 3; k++) CheckNear(p[k], -4, 0);
  FemPrincipal(twice, p, NULL);
  CheckNear(p[0], 5, 0);
  CheckNear(p[1], 2, 0);
  CheckNear(p[2], 2, 0);
  FemPrincipal(known, p, NULL); /* characteristic polynomial (s - 2)(s^2 - 6 s + 6) */
  CheckNear(p[0], 3 + sqrt(3.0), 1e-14);
  CheckNear(p[1], 2, 1e-14);
  CheckNear(p[2], 3 - sqrt(3.0), 1e-14);
  FemPrincipal(nearly, p, v);
  CheckNear(p[0], 1e9 + 1 + 1e-6, 6e-7); /* second order in the shear: 1e-6 / 1 */
  CheckNear(p[2], 1e9 - 1e-6, 6e-7);

  /* a pair of equal roots, turned: sum of value * direction (x) direction comes back */
  for (PetscInt k = 0; k < 6; k++) turned[k] = (k < 3 ? 2 : 0) + 3. / 9 * (PetscReal[]){1, 4, 4, 2, 4, 2}[k]; /* 2 I + 3 n n, n = (1, 2, 2)/3 */
  FemPrincipal(turned, p, v);
  CheckNear(p[0], 5, 1e-14);
  CheckNear(p[1], 2, 1e-14);
  CheckNear(p[2], 2, 1e-14);
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) {
      PetscReal sum = 0, dot = 0;

      for (PetscInt k = 0; k < 3; k++) {
        sum += p[k] * v[k][i] * v[k][j];
        dot += v[i][k] * v[j][k];
      }
      CheckNear(sum, turned[i == j ? i : i + j == 1 ? 3 : i + j == 3 ? 4 : 5], 1e-14);
      CheckNear(dot, i == j, 1e-14);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* There and back: gradient to stress to Voigt stress and strain, in the three kinds of space. */
static PetscErrorCode TestLaws(void)
{
  static const FemKind kinds[] = {FEM_SOLID, FEM_PLANE_STRAIN, FEM_PLANE_STRESS};
  const PetscReal      E = steel.young, nu = steel.poisson, length[3] = {1, 1, 1};
  const PetscInt       n[3] = {1, 1, 1};

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < 3; k++) {
    const PetscInt dim = k ? 2 : 3;
    PetscReal      h[3][3] = {{1e-3, 4e-4, k ? 0 : 2e-4}, {-1e-4, -5e-4, 0}, {0, k ? 0 : 3e-4, k ? 0 : 7e-4}}, e[6], s[6], stress[6], strain[6];
    Mesh           mesh;
    FemModel       model;

    PetscCall(Free(k ? MESH_QUAD4 : MESH_HEX8, length, n, 0, kinds[k], &steel, &mesh, &model));
    PetscCall(FemModelSetUp(model));
    for (PetscInt i = 0; i < 3; i++) {
      e[i]     = h[i][i];
      e[3 + i] = h[i][(i + 1) % 3] + h[(i + 1) % 3][i];
    }
    FemStressOf(dim, &model->law[0], e, s);
    FemStressExpand(dim, &model->law[0], s, stress, strain);
    CheckNear(strain[0], 1e-3, 1e-15);
    CheckNear(strain[1], -5e-4, 1e-15);
    CheckNear(strain[3], 3e-4, 1e-15);
    for (PetscInt i = 0; i < 3; i++) { /* Hooke's law the other way */
      CheckNear(strain[i], (stress[i] - nu * (stress[(i + 1) % 3] + stress[(i + 2) % 3])) / E, 1e-15);
      CheckNear(strain[3 + i], stress[3 + i] * 2 * (1 + nu) / E, 1e-15);
    }
    if (k == 1) CheckNear(strain[2], 0, 1e-18);
    if (k == 2) CheckNear(stress[2], 0, 1e-9);
    CheckClose(FemStressNorm(dim, &model->law[0], s), stress[0] * strain[0] + stress[1] * strain[1] + stress[2] * strain[2] + stress[3] * strain[3] + stress[4] * strain[4] + stress[5] * strain[5], 1e-14);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- two materials ---- */

/* Halves of a bar pulled along x, nu = 0, E 1 : 3. The strain across the interface jumps, the stress does not; with the same strain on both sides it is
   the stress that jumps. Both sides keep their own value at the interface. */
static PetscErrorCode TestTwoMaterials(void)
{
  const FemMaterial soft = {1000, 1e9, 0}, hard = {1000, 3e9, 0};
  const PetscReal   length[3] = {2, 1, 1};
  const PetscInt    n[3] = {8, 4, 4};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 2; t++) {
    const MeshCellType type = t ? MESH_HEX8 : MESH_TRI3;
    Mesh               mesh;
    FemModel           model;
    PetscInt           n_points, seams = 0, cells;
    const PetscInt    *node;
    PetscReal         *stress, *strain;
    MeshGroup         *group;

    PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, 0, &mesh));
    PetscCall(PetscRealloc(sizeof(MeshGroup) * (mesh.n_groups + 2), &mesh.group)); /* left and right cells */
    for (PetscInt side = 0; side < 2; side++) {
      group = &mesh.group[mesh.n_groups++];
      PetscCall(PetscMemzero(group, sizeof(*group)));
      PetscCall(PetscStrncpy(group->name, side ? "right" : "left", sizeof(group->name)));
      group->dim = mesh.dim;
      PetscCall(PetscMalloc1(mesh.n_cells, &group->cell));
      for (PetscInt c = 0; c < mesh.n_cells; c++) {
        PetscReal middle = 0;

        if (MeshCellDim(mesh.type[c]) != mesh.dim) continue;
        for (PetscInt a = mesh.start[c]; a < mesh.start[c + 1]; a++) middle += mesh.x[3 * mesh.node[a]] / (mesh.start[c + 1] - mesh.start[c]);
        if ((middle > 1) == side) group->cell[group->n_cells++] = c;
      }
    }
    PetscCall(FemModelCreate(PETSC_COMM_SELF, &model));
    PetscCall(FemModelSetKind(model, KindOf(type), 1));
    PetscCall(FemModelSetMethod(model, FEM_STATIC));
    PetscCall(FemModelSetMesh(model, &mesh));
    PetscCall(FemModelAddMaterial(model, "left", &soft));
    PetscCall(FemModelAddMaterial(model, "right", &hard));
    PetscCall(CaseFix(model, "xmin", 0, 0));
    PetscCall(CaseFix(model, "ymin", 1, 0));
    if (mesh.dim == 3) PetscCall(CaseFix(model, "zmin", 2, 0));
    PetscCall(CaseTraction(model, "xmax", 3e6, 0, 0));
    PetscCall(CaseSolve(model));
    PetscCall(FemModelGetPoints(model, &n_points, &node));
    PetscCall(FemModelGetCounts(model, NULL, &cells, NULL));
    for (PetscInt i = 0; i < mesh.n_nodes; i++) seams += fabs(mesh.x[3 * i] - 1) < 1e-9;
    CheckInt(n_points, mesh.n_nodes + seams);
    PetscCall(PetscMalloc2(6 * n_points, &stress, 6 * n_points, &strain));
    PetscCall(FemModelRecover(model, stress, strain));
    for (PetscInt p = 0; p < n_points; p++) {
      const PetscReal x = mesh.x[3 * node[p]];

      if (p >= mesh.n_nodes) CheckNear(x, 1, 1e-12);
      CheckClose(stress[6 * p], 3e6, 1e-9);
      CheckClose(strain[6 * p], x > 1 + 1e-9 || p >= mesh.n_nodes ? 1e-3 : 3e-3, 1e-9);
    }
    PetscCall(Impose(model, mesh.dim == 2 ? PlaneLinear : Linear)); /* the same strain on both sides */
    PetscCall(FemModelRecover(model, stress, NULL));
    for (PetscInt p = 0; p < n_points; p++) CheckClose(stress[6 * p], 2e-3 * (mesh.x[3 * node[p]] > 1 + 1e-9 || p >= mesh.n_nodes ? 3e9 : 1e9), 1e-12);
    PetscCall(PetscFree2(stress, strain));
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- probes ---- */

static PetscErrorCode TestProbes(void)
{
  static const MeshCellType types[] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8};
  static const char *const  quantity[] = {"displacement", "velocity", "stress", "strain", "von_mises", "principal_stress"};
  const PetscReal           length[3] = {1, 1, 1}, at[3] = {0.37, 0.71, 0.22}, corner[3] = {1, 1, 1}, away[3] = {1.25, 0.5, 0.5};
  const PetscInt            n[3] = {6, 6, 6};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) {
    const PetscInt flat = MeshCellDim(types[t]) == 2;
    PetscReal      u[3], s[6], p[3];
    Mesh           mesh;
    FemModel       model;
    FemReadings    readings;

    PetscCall(Free(types[t], length, n, 0.2, KindOf(types[t]), &steel, &mesh, &model));
    PetscCall(FemModelAddProbe(model, "A", at, 6, quantity));
    PetscCall(FemModelAddProbe(model, "corner", corner, 1, &quantity[2]));
    CheckFails(FemModelAddProbe(model, "B", away, 1, quantity), PETSC_ERR_USER_INPUT, "probe 'B'");
    CheckContains(BaseErrorMessage(), "about 0.25");
    CheckFails(FemModelAddProbe(model, "C", at, 1, (const char *const[]){"colour"}), PETSC_ERR_USER_INPUT, "no quantity 'colour'");
    PetscCall(FemModelSetUp(model));
    PetscCall(FemModelGetReadings(model, &readings));
    CheckInt(readings.recoveries + readings.patches, 0); /* nobody has looked yet */
    PetscCall(Impose(model, flat ? PlaneLinear : Linear));
    (flat ? PlaneLinear : Linear)(at, u);
    (flat ? PlaneLinearStress : LinearStress)(at, s);
    FemPrincipal(s, p, NULL);
    CheckNear(CaseHistory(model, "displacement(A).x"), u[0], 1e-16);
    CheckNear(CaseHistory(model, "displacement(A).y"), u[1], 1e-16);
    CheckNear(CaseHistory(model, "velocity(A).y"), 0, 0);
    CheckClose(CaseHistory(model, "stress(A).xx"), s[0], 1e-12);
    CheckClose(CaseHistory(model, "stress(A).zz"), s[2], 1e-12);
    CheckClose(CaseHistory(model, "stress(corner).yy"), s[1], 1e-12);
    CheckNear(CaseHistory(model, "strain(A).yy"), 3e-3, 1e-15);
    CheckClose(CaseHistory(model, "von_mises(A)"), FemVonMises(s), 1e-12);
    CheckClose(CaseHistory(model, "principal_stress(A).1"), p[0], 1e-12);
    CheckTrue(isnan(CaseHistory(model, "stress(A).yz")) == flat);
    PetscCall(FemModelGetReadings(model, &readings));
    CheckInt(readings.recoveries, 0);
    CheckAbove(readings.patches, 1);
    CheckBelow(readings.patches / 9, 30); /* patches of two elements, once for each of the nine columns asked for alone */
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Newton on the map of elements that are no parallelograms, corners and all. */
static PetscErrorCode TestPointFind(void)
{
  const PetscReal quad[8] = {0, 0, 2, 0.3, 1.7, 1.4, -0.2, 0.9}, hex[24] = {0, 0, 0, 1.2, 0, 0.1, 1, 1.1, 0, -0.1, 0.9, 0, 0.1, 0, 1, 1, 0.1, 1.2, 1.3, 1.2, 1, 0, 1, 0.8};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 2; t++) {
    const FemShape  *shape = FemShapeGet(t ? MESH_HEX8 : MESH_QUAD4);
    const PetscReal *x = t ? hex : quad;

    for (PetscInt k = 0; k < 27; k++) {
      const PetscReal want[3] = {k % 3 - 1, k / 3 % 3 - 1, t ? k / 9 - 1 : 0};
      PetscReal       N[8], dN[24], at[3], xi[3];

      (void)FemPointAt(shape, x, want, N, dN, at);
      CheckBelow(FemPointFind(shape, x, at, xi), 1e-12);
      for (PetscInt d = 0; d < shape->dim; d++) CheckNear(xi[d], want[d], 1e-12);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rules integrate what they promise: monomials on the reference elements. */
static PetscErrorCode TestRules(void)
{
  static const MeshCellType types[] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8, MESH_PRISM6};
  const PetscReal           volume[] = {0.5, 4, 1. / 6, 8, 1}, second[] = {1. / 12, 4. / 3, 1. / 60, 8. / 3, 1. / 6}; /* int xi_0^2 */

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 5; t++) {
    PetscReal xi[FEM_RULE_MAX][3], w[FEM_RULE_MAX], sum[2] = {0, 0};
    PetscInt  n = FemPointRule(types[t], 3, xi, w);

    for (PetscInt q = 0; q < n; q++) {
      sum[0] += w[q];
      sum[1] += w[q] * xi[q][0] * xi[q][0];
    }
    CheckClose(sum[0], volume[t], 1e-14);
    CheckClose(sum[1], second[t], 1e-14);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestUniform)
CHECK_TEST(TestLinearStress)
CHECK_TEST(TestOneLayer)
CHECK_TEST(TestOrderTri3)
CHECK_TEST(TestOrderQuad4)
CHECK_TEST(TestOrderTet4)
CHECK_TEST(TestOrderHex8)
CHECK_TEST(TestInvariants)
CHECK_TEST(TestLaws)
CHECK_TEST(TestTwoMaterials)
CHECK_TEST(TestProbes)
CHECK_TEST(TestPointFind)
CHECK_TEST(TestRules)

static const struct CMUnitTest tests[] = {TEST(TestUniform), TEST(TestLinearStress), TEST(TestOneLayer), TEST(TestOrderTri3), TEST(TestOrderQuad4), TEST(TestOrderTet4), TEST(TestOrderHex8),
                                          TEST(TestInvariants), TEST(TestLaws), TEST(TestTwoMaterials), TEST(TestProbes), TEST(TestPointFind), TEST(TestRules)};
CHECK_MAIN(tests)
