/* fem_check.c - what a run can say about itself: whether its forces balance, how far its elements have turned.  Eqs (2.84), (2.85) */
#include "fem_impl.h"

/* Inertia and drag [n_own*dim] of an implicit level into f; average acceleration balances forces there, generalised-alpha between levels. */
static PetscErrorCode Inertia(FemModel model, PetscReal *f)
{
  FemImplicit   *im = &model->implicit;
  const PetscInt n  = model->n_own * model->dim;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(im->x, model->v, n));
  PetscCall(FemGhosts(model, im->x));
  PetscCall(FemImplicitDrag(model, im->x, f, im->r));
  FemMassApply(model, im->mass, im->a, im->r);
  for (PetscInt k = 0; k < n; k++) f[k] += im->r[k];
  for (PetscInt e = 0; e < model->contact.n; e++) /* a plane's push is a reaction, and is not in a.  Eq. (2.136) */
    for (PetscInt d = 0; d < model->dim; d++) f[model->contact.node[e] * model->dim + d] += model->contact.push[3 * e + d];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  FemBalance - loads + reactions - inertia - drag of the whole body, and their moment about the origin; zero but for round-off

  value [6] out: force [N], moment [N m] about places at rest, of corotational elements about present places; in the plane xy and about z. Where the drag is known to the step alone (sub-steps, local damping,
  generalised-alpha) the sum of the internal forces, which must vanish likewise. The level has been closed.
*/
PetscErrorCode FemBalance(FemModel model, PetscReal value[6])
{
  const PetscInt   dim     = model->dim;
  const PetscReal *outside = FemOutside(model); /* with absorbing sides */
  const PetscBool  moving = model->method != FEM_STATIC ? PETSC_TRUE : PETSC_FALSE, inner = (PetscBool)(model->method != FEM_EXPLICIT || model->inner.m > 1 || model->local > 0);
  const PetscBool  level  = model->method == FEM_IMPLICIT && model->implicit.rho_inf < 0 ? PETSC_TRUE : PETSC_FALSE;
  const PetscReal  h      = model->started ? 0.5 * model->dt_last + 0.5 * model->level_dt : 0.5 * model->level_dt;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(value, 6));
  if (level) PetscCall(Inertia(model, model->implicit.p));
  for (PetscInt i = 0; i < model->n_own; i++) {
    PetscReal f[3] = {0, 0, 0}, x[3] = {0, 0, 0};

    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt k = i * dim + d;

      x[d] = model->x[k] + (model->corotate.on ? model->u[k] : 0);
      f[d] = model->f_app[k] + outside[k] + model->reaction[k];
      if (moving && h > 0) f[d] -= model->mass[i] * ((model->v_next[k] - model->v[k]) / h + model->alpha * (model->started ? 0.5 * (model->v[k] + model->v_next[k]) : model->v[k]));
      if (moving && (inner || !(h > 0))) f[d] = model->f_int[k];
      if (level) f[d] = model->f_app[k] + model->reaction[k] - model->implicit.p[k];
    }
    if (model->contact.outside) /* a plane's push is a reaction, and outside has it too */
      for (PetscInt d = 0; d < dim && !inner && h > 0; d++) f[d] -= model->contact.outside[i * dim + d] - (model->absorb.outside ? model->absorb.outside : model->f_ext)[i * dim + d];
    for (PetscInt d = 0; d < 3; d++) {
      value[d] += f[d];
      value[3 + d] += x[(d + 1) % 3] * f[(d + 2) % 3] - x[(d + 2) % 3] * f[(d + 1) % 3];
    }
  }
  PetscCall(FemSum(model, 6, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Angle [rad] of the rotation in a gradient F = 1 + h: exact in the plane, and in space for a rotation times a stretch along its axis. */
static PetscReal Angle(PetscInt dim, PetscReal h[3][3])
{
  const PetscReal x = h[2][1] - h[1][2], y = h[0][2] - h[2][0], z = h[1][0] - h[0][1];

  if (dim == 2) return PetscAbsReal(PetscAtan2Real(z, 2 + h[0][0] + h[1][1]));
  return PetscAtan2Real(PetscSqrtReal(x * x + y * y + z * z), 2 + h[0][0] + h[1][1] + h[2][2]);
}

PetscErrorCode FemModelGetTurn(FemModel model, PetscReal *angle)
{
  PetscFunctionBegin;
  PetscCheck(model && model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetUp() first");
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
    const PetscInt  dim   = model->dim;
    PetscReal       dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], u[FEM_MAX_DOFS], h[3][3] = {{0}}, volume = 0;

    if (!model->own[c]) continue;
    FemCellGeometry(model, c, dN, w);
    FemCellGather(model, c, model->u, u);
    for (PetscInt q = 0; q < shape->points; q++) volume += w[q];
    for (PetscInt q = 0; q < shape->points; q++)
      for (PetscInt a = 0; a < shape->nodes; a++)
        for (PetscInt i = 0; i < dim; i++)
          for (PetscInt j = 0; j < dim; j++) h[i][j] += w[q] / volume * u[a * dim + i] * dN[(q * shape->nodes + a) * dim + j];
    model->turn = PetscMax(model->turn, Angle(dim, h));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &model->turn, 1, MPIU_REAL, MPIU_MAX, model->comm));
  *angle = model->turn;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetLocking(FemModel model, PetscInt *elements, const char **word, PetscReal *poisson)
{
  static const char *const words[] = {"tri3", "quad4", "tet4", "hex8", "prism6"};
  static const MeshCellType types[] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8, MESH_PRISM6};
  PetscReal                 sum[5]  = {0, 0, 0, 0, 0};

  PetscFunctionBegin;
  PetscCheck(model && model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetUp() first");
  *elements = 0;
  *word     = NULL;
  *poisson  = 0;
  for (PetscInt c = 0; c < model->n_cells && model->kind != FEM_PLANE_STRESS; c++) {
    const FemElastic *law = &model->law[model->cell_material[c]];
    const PetscReal   nu  = law->general ? 0 : 0.5 * law->lambda / (law->lambda + law->mu);

    for (PetscInt k = 0; k < 5; k++)
      if (model->own[c] && model->cell_type[c] == (PetscInt)types[k] && nu > 0.45 && !FemCellEnhanced(model, c)) {
        sum[k] += 1;
        *poisson = PetscMax(*poisson, nu);
      }
  }
  PetscCall(FemSum(model, 5, sum));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, poisson, 1, MPIU_REAL, MPIU_MAX, model->comm));
  for (PetscInt k = 4; k >= 0; k--) {
    *elements += (PetscInt)sum[k];
    if (sum[k] > 0) *word = words[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
