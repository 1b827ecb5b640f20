/*
  fem_mass.c - mass as the implicit and modal methods see it: consistent, in the pattern of the stiffness rows, or lumped.  Eq. (2.50)

  Displacement components do not mix, so one number stands for a block of the rows.
*/
#include "fem_impl.h"

/* m [nodes][nodes] of one element [kg]; w the weights of its points. Simplices in closed form: one point integrates N_a N_b badly. */
static void ConsistentMass(const FemShape *shape, PetscReal density, const PetscReal *w, PetscReal *m)
{
  const PetscBool simplex = shape->nodes == shape->dim + 1 ? PETSC_TRUE : PETSC_FALSE;
  PetscReal       volume  = 0;

  for (PetscInt g = 0; g < shape->points; g++) volume += w[g];
  for (PetscInt a = 0; a < shape->nodes; a++)
    for (PetscInt b = 0; b < shape->nodes; b++) {
      PetscReal sum = 0;

      if (simplex) sum = volume * (a == b ? 2 : 1) / ((shape->dim + 1) * (shape->dim + 2));
      else
        for (PetscInt g = 0; g < shape->points; g++) sum += w[g] * shape->N[g][a] * shape->N[g][b];
      m[a * shape->nodes + b] = density * sum;
    }
}

/* mass [rows.start[n_own]] [kg], one for each block of model->rows. */
PetscErrorCode FemMassRows(FemModel model, PetscReal **mass)
{
  PetscReal dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], m[FEM_MAX_NODES * FEM_MAX_NODES], *all;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(model->rows.start[model->n_own], &all));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
    const PetscInt *node  = &model->cell_node[model->cell_start[c]];

    FemCellGeometry(model, c, dN, w);
    ConsistentMass(shape, model->region[model->cell_material[c]].material.density, w, m);
    for (PetscInt a = 0; a < shape->nodes; a++)
      for (PetscInt b = 0; b < shape->nodes && node[a] < model->n_own; b++) all[FemRowsColumn(model, node[a], node[b])] += m[a * shape->nodes + b];
  }
  *mass = all;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stiffness and mass, for eigenvalues; nothing moves. */
PetscErrorCode FemModalSetUp(FemModel model)
{
  PetscFunctionBegin;
  PetscCall(FemRowsCreate(model));
  if (!model->implicit.lumped) PetscCall(FemMassRows(model, &model->implicit.mass));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f [n_own*dim] = M x; x [n_loc*dim] with ghosts filled; mass NULL: lumped. */
void FemMassApply(FemModel model, const PetscReal *mass, const PetscReal *x, PetscReal *f)
{
  const PetscInt  dim = model->dim;
  const FemRows  *rows = &model->rows;

#pragma omp parallel for schedule(static) num_threads(model->threads)
  for (PetscInt i = 0; i < model->n_own; i++) {
    PetscReal sum[3] = {0, 0, 0};

    if (mass)
      for (PetscInt k = rows->start[i]; k < rows->start[i + 1]; k++)
        for (PetscInt d = 0; d < dim; d++) sum[d] += mass[k] * x[rows->col[k] * dim + d];
    else
      for (PetscInt d = 0; d < dim; d++) sum[d] = model->mass[i] * x[i * dim + d];
    for (PetscInt d = 0; d < dim; d++) f[i * dim + d] = sum[d];
  }
}

/* value [start[n_own]][dim][dim] = stiffness x K + inertia x M. */
void FemMassAddToRows(FemModel model, const PetscReal *mass, PetscReal stiffness, PetscReal inertia, PetscReal *value)
{
  const PetscInt dim  = model->dim;
  const FemRows *rows = &model->rows;

  for (PetscInt i = 0; i < model->n_own; i++)
    for (PetscInt k = rows->start[i]; k < rows->start[i + 1]; k++) {
      const PetscReal  m     = inertia * (mass ? mass[k] : rows->col[k] == i ? model->mass[i] : 0);
      PetscReal       *block = &value[(size_t)k * dim * dim];
      const PetscReal *K     = &rows->value[(size_t)k * dim * dim];

      for (PetscInt p = 0; p < dim; p++)
        for (PetscInt q = 0; q < dim; q++) block[p * dim + q] = stiffness * K[p * dim + q] + (p == q ? m : 0);
    }
}

/*
  a [n_loc*dim] = M^-1 f along free axes; in: a along held axes, zero along free ones. f [n_own*dim] is overwritten. planes: what they hold is held too.

  A consistent mass is solved by conjugate gradients with its diagonal, to round-off: it is so well conditioned that a factor does not pay.
*/
PetscErrorCode FemMassSolve(FemModel model, const PetscReal *mass, PetscBool planes, PetscReal *f, PetscReal *a)
{
  const PetscInt dim = model->dim, n = model->n_own * dim, most = 500;
  PetscReal     *p, *z, *q, *inverse, rho = 0, first = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(model->n_loc * dim, &p, n, &z, n, &q, n, &inverse));
  for (PetscInt k = 0; k < n; k++) inverse[k] = mass ? 0 : 1 / model->mass[k / dim];
  for (PetscInt i = 0; i < model->n_own && mass; i++) {
    const PetscReal own = mass[FemRowsColumn(model, i, i)];

    for (PetscInt d = 0; d < dim; d++) inverse[i * dim + d] = 1 / own;
  }
  PetscCall(FemGhosts(model, a));
  FemMassApply(model, mass, a, q);
  for (PetscInt k = 0; k < n; k++) f[k] -= q[k]; /* residual */
  FemKeepFree(model, f);
  if (planes) FemContactKeepFree(model, f);
  for (PetscInt k = 0; k < n; k++) { /* the diagonal is the same in all directions of a node, so it goes with frames */
    z[k] = p[k] = inverse[k] * f[k];
    if (!mass) a[k] += z[k];
  }
  if (mass) {
    first = FemDot(model, f, z);
    PetscCall(FemSum(model, 1, &first));
    rho = first;
  }
  for (PetscInt j = 0; j < most && rho > 1e-30 * first; j++) {
    PetscReal pq, next;

    PetscCall(FemGhosts(model, p));
    FemMassApply(model, mass, p, q);
    FemKeepFree(model, q);
    if (planes) FemContactKeepFree(model, q);
    pq = FemDot(model, p, q);
    PetscCall(FemSum(model, 1, &pq));
    for (PetscInt k = 0; k < n; k++) {
      a[k] += rho / pq * p[k];
      f[k] -= rho / pq * q[k];
      z[k] = inverse[k] * f[k];
    }
    next = FemDot(model, f, z);
    PetscCall(FemSum(model, 1, &next));
    for (PetscInt k = 0; k < n; k++) p[k] = z[k] + next / rho * p[k];
    rho = next;
  }
  PetscCall(FemGhosts(model, a));
  PetscCall(PetscFree4(p, z, q, inverse));
  PetscFunctionReturn(PETSC_SUCCESS);
}
