/*
  fem_corotate.c - elements that turn: small strain seen from axes that turn with each element.  Eqs (2.86)-(2.89)

  An element's turn R is the rotation in the mean F of its deformation gradient. Motion seen from those axes, d = R'x - X, has the
  elastic energy 1/2 d.K d of the element at rest; forces are the exact gradient of that energy, the turn's own change included, so
  energy, momentum and angular momentum are kept as by the linear element. Explicit models, element by element.
*/
#include "fem_impl.h"

PetscErrorCode FemModelSetRotation(FemModel model, FemRotation rotation)
{
  PetscFunctionBegin;
  PetscCheck(model && !model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "How elements turn is said before FemModelSetUp()");
  model->corotate.on = rotation == FEM_COROTATIONAL ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After materials: what is not covered is refused here. */
PetscErrorCode FemCorotateCheck(FemModel model)
{
  PetscFunctionBegin;
  if (!model->corotate.on) PetscFunctionReturn(PETSC_SUCCESS);
  BaseCheckInput(model->method == FEM_EXPLICIT, model->comm, "%s: corotational elements need the explicit method; static, implicit and modal bodies are of small rotation", model->source);
  BaseCheckInput(!model->preload, model->comm, "%s: corotational elements cannot start from a static state; take the preload out, or let the load grow slowly", model->source);
  BaseCheckInput(!model->pre.n, model->comm, "%s: in-situ stress and temperature in corotational elements are not covered; elements of small rotation take them", model->source);
  BaseCheckInput(!model->cell_weight, model->comm, "%s: the elements of a coupled body are of small rotation", model->source);
  for (PetscInt r = 0; r < model->n_regions; r++)
    BaseCheckInput(!model->region[r].material.orthotropic, model->comm, "%s: an orthotropic material in corotational elements is not covered", model->source);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean gradients of the shape functions of each element, [nodes][dim] [1/m]; they sum to zero. */
PetscErrorCode FemCorotateCreate(FemModel model)
{
  FemCorotate *co = &model->corotate;

  PetscFunctionBegin;
  if (!co->on) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc2((size_t)model->cell_start[model->n_cells] * model->dim, &co->mean, model->n_cells, &co->energy));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
    PetscReal       dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], volume = 0, *mean = &co->mean[model->cell_start[c] * model->dim];

    FemCellGeometry(model, c, dN, w);
    for (PetscInt q = 0; q < shape->points; q++) volume += w[q];
    for (PetscInt q = 0; q < shape->points; q++)
      for (PetscInt k = 0; k < shape->nodes * shape->dim; k++) mean[k] += w[q] / volume * dN[q * shape->nodes * shape->dim + k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemCorotateDestroy(FemModel model)
{
  PetscFunctionBegin;
  PetscCall(PetscFree2(model->corotate.mean, model->corotate.energy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* inverse of A; returns its determinant */
static PetscReal Inverse(PetscReal A[3][3], PetscReal inverse[3][3])
{
  PetscReal det = 0;

  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) inverse[j][i] = A[(i + 1) % 3][(j + 1) % 3] * A[(i + 2) % 3][(j + 2) % 3] - A[(i + 1) % 3][(j + 2) % 3] * A[(i + 2) % 3][(j + 1) % 3];
  for (PetscInt j = 0; j < 3; j++) det += A[0][j] * inverse[j][0];
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) inverse[i][j] /= det;
  return det;
}

/* R of F = R S by Newton's iteration R <- (R + R^-T)/2 (Higham), quadratic; false where det F <= 0. */
static PetscBool Polar(PetscReal F[3][3], PetscReal R[3][3])
{
  PetscReal inverse[3][3];

  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) R[i][j] = F[i][j];
  for (PetscInt round = 0; round < 30; round++) {
    PetscReal change = 0;

    if (!(Inverse(R, inverse) > 0)) return PETSC_FALSE;
    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < 3; j++) inverse[j][i] -= R[i][j];
    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < 3; j++) {
        R[i][j] += 0.5 * inverse[j][i];
        change = PetscMax(change, PetscAbsReal(inverse[j][i]));
      }
    if (change < 1e-8) return PETSC_TRUE; /* what is left is its square */
  }
  return PETSC_FALSE;
}

/*
  FemCorotateSee - an element's motion from its own axes.  Eqs (2.86), (2.87)

  X, u [nodes][dim]  places at rest and displacement [m]; mean [nodes][dim] mean gradients
  R, S [3][3]        out, turn and stretch (1 across a plane)
  d    [nodes][dim]  out, R'(X + u) - X but for a translation [m]
  y    [nodes][dim]  out, R'(X + u) from the mean place [m]; may be NULL
  False where the element is turned inside out.
*/
static PetscBool See(PetscInt nodes, PetscInt dim, const PetscReal *X, const PetscReal *u, const PetscReal *mean, PetscReal R[3][3], PetscReal S[3][3], PetscReal *d, PetscReal *y)
{
  PetscReal F[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, middle[3] = {0, 0, 0}, shift[3] = {0, 0, 0};

  for (PetscInt a = 0; a < nodes; a++)
    for (PetscInt i = 0; i < dim; i++) {
      middle[i] += X[a * dim + i] / nodes;
      shift[i] += u[a * dim + i] / nodes;
      for (PetscInt j = 0; j < dim; j++) F[i][j] += u[a * dim + i] * mean[a * dim + j];
    }
  if (!Polar(F, R)) return PETSC_FALSE;
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) {
      S[i][j] = 0;
      for (PetscInt k = 0; k < 3; k++) S[i][j] += R[k][i] * F[k][j];
    }
  for (PetscInt a = 0; a < nodes; a++)
    for (PetscInt i = 0; i < dim; i++) {
      PetscReal turned = 0;

      for (PetscInt k = 0; k < dim; k++) turned += R[k][i] * (X[a * dim + k] - middle[k] + u[a * dim + k] - shift[k]);
      d[a * dim + i] = turned - (X[a * dim + i] - middle[i]);
      if (y) y[a * dim + i] = turned;
    }
  return PETSC_TRUE;
}

/* d [nodes][dim] and R of displacement ue, for stress: sigma = R s(d) R'.  Eq. (2.89) */
void FemCorotateSee(FemModel model, PetscInt cell, const PetscReal *ue, PetscReal *d, PetscReal R[3][3])
{
  const PetscInt nodes = model->cell_start[cell + 1] - model->cell_start[cell];
  PetscReal      X[FEM_MAX_DOFS], S[3][3];

  FemCellGather(model, cell, model->x, X);
  (void)See(nodes, model->dim, X, ue, &model->corotate.mean[model->cell_start[cell] * model->dim], R, S, d, NULL); /* inside out: the step has stopped the run */
}

void FemTurnStress(const PetscReal R[3][3], PetscReal s[6])
{
  const PetscReal a[3][3] = {{s[0], s[3], s[5]}, {s[3], s[1], s[4]}, {s[5], s[4], s[2]}};
  PetscReal       b[3][3] = {{0}};

  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++)
      for (PetscInt k = 0; k < 3; k++)
        for (PetscInt l = 0; l < 3; l++) b[i][j] += R[i][k] * a[k][l] * R[j][l];
  for (PetscInt i = 0; i < 3; i++) {
    s[i]     = b[i][i];
    s[3 + i] = b[i][(i + 1) % 3];
  }
}

/* f of element c at displacement u into cell_f, and its energy; false where it is turned inside out.  Eq. (2.88) */
static PetscBool CellForce(FemModel model, PetscInt c, const PetscReal *u, PetscReal *f)
{
  const PetscInt   dim = model->dim, nodes = model->cell_start[c + 1] - model->cell_start[c];
  const PetscReal *mean = &model->corotate.mean[model->cell_start[c] * dim];
  PetscReal        X[FEM_MAX_DOFS], ue[FEM_MAX_DOFS], d[FEM_MAX_DOFS], y[FEM_MAX_DOFS], R[3][3], S[3][3], inverse[3][3], moment[3] = {0, 0, 0}, p[3] = {0, 0, 0}, energy = 0, trace;

  FemCellGather(model, c, model->x, X);
  FemCellGather(model, c, u, ue);
  if (!See(nodes, dim, X, ue, mean, R, S, d, y)) return PETSC_FALSE;
  FemCellStoredForce(model, c, d, f);
  for (PetscInt a = 0; a < nodes; a++) {
    PetscReal at[3] = {0, 0, 0}, g[3] = {0, 0, 0};

    for (PetscInt i = 0; i < dim; i++) {
      at[i] = y[a * dim + i];
      g[i]  = f[a * dim + i];
      energy += 0.5 * d[a * dim + i] * g[i];
    }
    for (PetscInt i = 0; i < 3; i++) moment[i] += at[(i + 1) % 3] * g[(i + 2) % 3] - at[(i + 2) % 3] * g[(i + 1) % 3];
  }
  trace = S[0][0] + S[1][1] + S[2][2];
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) S[i][j] = (i == j ? trace : 0) - S[i][j]; /* symmetric */
  (void)Inverse(S, inverse);
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) p[i] += inverse[i][j] * moment[j];
  for (PetscInt a = 0; a < nodes; a++) {
    PetscReal g[3] = {0, 0, 0}, h[3] = {0, 0, 0};

    for (PetscInt i = 0; i < dim; i++) g[i] = mean[a * dim + i];
    for (PetscInt i = 0; i < dim; i++) h[i] = f[a * dim + i] - (p[(i + 1) % 3] * g[(i + 2) % 3] - p[(i + 2) % 3] * g[(i + 1) % 3]);
    for (PetscInt i = 0; i < dim; i++) {
      f[a * dim + i] = 0;
      for (PetscInt k = 0; k < dim; k++) f[a * dim + i] += R[i][k] * h[k];
    }
  }
  model->corotate.energy[c] = energy;
  return PETSC_TRUE;
}

/* Forces of all elements into cell_f; bad: the first element (in global order) that is inside out, or a large number. */
PetscInt FemCorotateForces(FemModel model, const PetscReal *u)
{
  PetscInt bad = PETSC_MAX_INT;

#pragma omp parallel for schedule(static) num_threads(model->threads) reduction(min : bad)
  for (PetscInt c = 0; c < model->n_cells; c++)
    if (!CellForce(model, c, u, &model->cell_f[model->cell_start[c] * model->dim])) bad = PetscMin(bad, model->cell_gid[c]);
  model->corotate.count += model->n_cells;
  return bad;
}

PetscReal FemStrainEnergy(FemModel model)
{
  PetscReal sum = 0;

  if (!model->corotate.on) return 0.5 * FemDot(model, model->u, model->f_int);
  for (PetscInt c = 0; c < model->n_cells; c++) sum += model->own[c] ? model->corotate.energy[c] : 0;
  return sum;
}
