/*
  dem_static_factor.c - the springs of bonds and held facets as a matrix, for the preconditioner of load steps.  Eq. (4.83)

  What couples a particle's neighbours through its volume is left out: it makes the body stiffer by a factor that depends on Poisson's ratio alone, so that
  conjugate gradients need a number of products that neither size nor broken bonds change.
*/
#include "dem_static_impl.h"

#define FACTOR_REST  1e-4 /* of a broken, open bond's stiffness stays in the matrix: pieces that nothing holds do not make it singular */
#define FACTOR_SHIFT 1e-7 /* of the diagonal on top: bodies that are free to slide */

/* B of one end: columns of displacement and rotation, sign x (I, -[r]x).  Returns them in B[dim][dim + nrot] */
static void End(DemModel model, PetscReal sign, const PetscReal r[3], PetscReal B[3][6])
{
  const PetscInt dim = model->dim;

  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 6; j++) B[i][j] = 0;
  for (PetscInt i = 0; i < dim; i++) B[i][i] = sign;
  if (dim == 2) { /* theta x r = theta (-y, x) */
    B[0][2] = -sign * r[1];
    B[1][2] = sign * r[0];
  } else {
    B[0][4] = sign * r[2];
    B[0][5] = -sign * r[1];
    B[1][3] = -sign * r[2];
    B[1][5] = sign * r[0];
    B[2][3] = sign * r[1];
    B[2][4] = -sign * r[0];
  }
}

/* Add P' M Q, M = along n n' + across (I - n n'), at the unknowns of particles p and q; the lower half is dropped by the matrix. */
static PetscErrorCode Add(DemModel model, PetscInt p, PetscInt q, PetscReal P[3][6], PetscReal Q[3][6], const PetscReal n[3], PetscReal along, PetscReal across)
{
  const PetscInt dim = model->dim, each = dim + model->nrot;
  PetscReal      block[36];
  PetscInt       row[6], column[6];

  PetscFunctionBegin;
  for (PetscInt a = 0; a < each; a++) {
    row[a]    = a * model->n + p;
    column[a] = a * model->n + q;
  }
  for (PetscInt b = 0; b < each; b++) {
    PetscReal t[3], dot = 0;

    for (PetscInt i = 0; i < dim; i++) dot += n[i] * Q[i][b];
    for (PetscInt i = 0; i < dim; i++) t[i] = across * Q[i][b] + (along - across) * dot * n[i];
    for (PetscInt a = 0; a < each; a++) {
      block[each * a + b] = 0;
      for (PetscInt i = 0; i < dim; i++) block[each * a + b] += P[i][a] * t[i];
    }
  }
  PetscCall(MatSetValues(model->statics->springs, each, row, each, column, block, ADD_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Upper half, component-major: row a n + p meets columns b n + q with b > a, or b = a and q >= p. */
static PetscErrorCode Pattern(DemModel model)
{
  const PetscInt n = model->n, each = model->dim + model->nrot, all = DemStaticUnknowns(model);
  PetscInt      *count;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(all, &count));
  for (PetscInt i = 0; i < all; i++) count[i] = each - i / n;
  for (PetscInt e = 0; e < model->bonds.n; e++)
    for (PetscInt side = 0; side < 2; side++) {
      const PetscInt p = side ? model->bonds.q[e] : model->bonds.p[e], q = side ? model->bonds.p[e] : model->bonds.q[e];

      for (PetscInt a = 0; a < each; a++) count[a * n + p] += each - 1 - a + (q > p);
    }
  PetscCall(MatCreateSeqSBAIJ(PETSC_COMM_SELF, 1, all, all, 0, count, &model->statics->springs));
  PetscCall(MatSetOption(model->statics->springs, MAT_IGNORE_LOWER_TRIANGULAR, PETSC_TRUE));
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemStaticSprings_Internal(DemModel model, PetscBool fresh)
{
  const DemBonds *bonds = &model->bonds;
  const DemWalls *walls = &model->walls;
  const PetscInt  n = model->n, dim = model->dim;
  DemStatic       s = model->statics;

  PetscFunctionBegin;
  if (fresh) PetscCall(Pattern(model));
  PetscCall(MatZeroEntries(s->springs));
  for (PetscInt e = 0; e < bonds->n; e++) {
    const PetscInt p = bonds->p[e], q = bonds->q[e];
    PetscReal      ra[3] = {0}, rb[3] = {0}, y[3] = {0}, turn[3], P[3][6], Q[3][6], d = 0, part = 1, along, across;

    for (PetscInt c = 0; c < dim; c++) {
      ra[c] = bonds->arm[c * bonds->n + e];
      y[c]  = model->x0[c * n + q] - model->x0[c * n + p];
      rb[c] = ra[c] - y[c];
      d += y[c] * y[c];
    }
    DemTurn(dim, n, p, model->rot, ra, turn);
    for (PetscInt c = 0; c < dim; c++) ra[c] += turn[c];
    DemTurn(dim, n, q, model->rot, rb, turn);
    for (PetscInt c = 0; c < dim; c++) rb[c] += turn[c];
    DemTurn(dim, n, p, model->rot, y, turn);
    for (PetscInt c = 0; c < dim; c++) y[c] = (y[c] + turn[c]) / PetscSqrtReal(d);
    if (model->crack.damage && model->crack.damage[e] > 0 && !DemCrackClosed_Internal(model, e)) part = PetscMax(1 - model->crack.damage[e], FACTOR_REST);
    along  = part * (model->net ? model->net->kn[e] : 2 * model->g_shear * bonds->k[e]);
    across = part * (model->net ? model->net->ks[e] : 2 * model->g_shear * bonds->k[e]);
    End(model, -1, ra, P);
    End(model, 1, rb, Q);
    PetscCall(Add(model, p, p, P, P, y, along, across));
    PetscCall(Add(model, q, q, Q, Q, y, along, across));
    PetscCall(Add(model, p, q, P, Q, y, along, across));
    PetscCall(Add(model, q, p, Q, P, y, along, across));
  }
  for (PetscInt i = 0; i < walls->n; i++) {
    const PetscInt  p = walls->owner[i];
    const PetscReal k = walls->h[i] > 0 && (walls->kind[i] == DEM_WALL_SMOOTH || walls->kind[i] == DEM_WALL_GLUED) ? 2 * model->g_shear * walls->area[i] / walls->h[i] : 0;
    PetscReal       r[3], turn[3], P[3][6];

    if (k == 0) continue;
    DemTurn(dim, n, p, model->rot, walls->arm + 3 * i, turn);
    for (PetscInt c = 0; c < 3; c++) r[c] = walls->arm[3 * i + c] + turn[c];
    End(model, 1, r, P);
    PetscCall(Add(model, p, p, P, P, walls->normal + 3 * i, k, walls->kind[i] == DEM_WALL_GLUED ? k : 0));
  }
  for (PetscInt i = 0; i < DemStaticUnknowns(model); i++) {
    const PetscReal shift = FACTOR_SHIFT * s->diagonal[i];

    PetscCall(MatSetValues(s->springs, 1, &i, 1, &i, &shift, ADD_VALUES));
  }
  PetscCall(MatAssemblyBegin(s->springs, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(s->springs, MAT_FINAL_ASSEMBLY));
  PetscCall(KSPSetReusePreconditioner(s->ksp, PETSC_FALSE));
  PetscCall(KSPSetOperators(s->ksp, s->K, s->springs));
  s->usual = -1;
  s->factors++;
  PetscFunctionReturn(PETSC_SUCCESS);
}
