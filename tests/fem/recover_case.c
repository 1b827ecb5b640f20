#include "recover_case.h"
#include "fem_recover.h"

const FemMaterial recover_steel = {7850, 2.1e11, 0.3};

/* The nodes of the model follow a field. */
PetscErrorCode RecoverImpose(FemModel model, CaseField field)
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
PetscErrorCode RecoverFree(MeshCellType type, const PetscReal length[3], const PetscInt n[3], PetscReal distort, FemKind kind, const FemMaterial *material, Mesh *mesh, FemModel *model)
{
  PetscFunctionBeginUser;
  PetscCall(CaseBox(PETSC_COMM_SELF, type, length, n, distort, mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, mesh, kind, FEM_EXPLICIT, 1, material, model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

FemKind RecoverKind(MeshCellType type)
{
  return MeshCellDim(type) == 2 ? FEM_PLANE_STRAIN : FEM_SOLID;
}

/* Hooke's law by hand: stress of a gradient, solid or plane strain. */
void RecoverHooke(const FemMaterial *m, PetscReal h[3][3], PetscReal s[6])
{
  const PetscReal mu = m->young / (2 * (1 + m->poisson)), lambda = m->young * m->poisson / ((1 + m->poisson) * (1 - 2 * m->poisson)), trace = h[0][0] + h[1][1] + h[2][2];

  for (PetscInt i = 0; i < 3; i++) {
    s[i]     = 2 * mu * h[i][i] + lambda * trace;
    s[3 + i] = mu * (h[i][(i + 1) % 3] + h[(i + 1) % 3][i]);
  }
}

/* RecoverWorst difference of recovered and exact stress over the points, in parts of the largest stress; inner points only when asked. */
PetscErrorCode RecoverWorst(FemModel model, const Mesh *mesh, RecoverField exact, PetscBool inner, PetscReal *worst)
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

  RecoverHooke(&recover_steel, h, s);
}

static void SolidStress(const PetscReal x[3], PetscReal s[6])
{
  const PetscReal r = sqrt(2.0), e = 1e-3 * exp(r * x[0]), cy = cos(x[1]), sy = sin(x[1]), cz = cos(x[2]), sz = sin(x[2]);
  PetscReal       h[3][3] = {{2 * e * cy * cz, -r * e * sy * cz, -r * e * cy * sz}, {-r * e * sy * cz, -e * cy * cz, e * sy * sz}, {-r * e * cy * sz, e * sy * sz, -e * cy * cz}};

  RecoverHooke(&recover_steel, h, s);
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
  const RecoverField exact = dim == 2 ? PlaneStress : SolidStress;
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
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, RecoverKind(type), FEM_STATIC, 1, &recover_steel, &model));
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
      FemOwnAdd(shape, &model->law[0], &reading.own, xi[q], dV / w[q], at, e);
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
PetscErrorCode RecoverCheckOrders(MeshCellType type, PetscInt coarse, PetscReal smooth_order, PetscReal rough_order)
{
  PetscFunctionBeginUser;
  for (PetscInt smooth = 1; smooth >= (rough_order > 0 ? 0 : 1); smooth--) {
    PetscReal raw[2], recovered[2], estimate[2], order;

    for (PetscInt k = 0; k < 2; k++) PetscCall(Errors(type, coarse << k, smooth ? 0 : 0.15, &raw[k], &recovered[k], &estimate[k]));
    order = log2(recovered[0] / recovered[1]);
    printf("  gmsh type %d, %s, %d and %d cells a side: raw order %.2f, recovered order %.2f, estimate / error %.3f and %.3f\n", (int)type, smooth ? "smooth" : "distorted", (int)coarse, (int)coarse * 2,
           log2(raw[0] / raw[1]), (double)order, (double)(estimate[0] / raw[0]), (double)(estimate[1] / raw[1]));
    CheckNear(log2(raw[0] / raw[1]), FemPointOrder(type), 0.1);
    if (smooth) CheckAbove(order, smooth_order);
    else CheckAbove(order, rough_order);
    CheckBelow(recovered[1], (FemPointOrder(type) == 1 ? 0.3 : 0.6) * raw[1]);
    for (PetscInt k = 0; k < 2; k++) CheckNear(estimate[k] / raw[k], 1, 0.2);
    if (smooth && FemPointOrder(type) == 1) CheckBelow(fabs(estimate[1] / raw[1] - 1), 0.6 * fabs(estimate[0] / raw[0] - 1)); /* tends to 1 */
    if (smooth) CheckBelow(recovered[1] / raw[1], 0.75 * recovered[0] / raw[0]); /* and this bounds how far the estimate can be from 1 */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
