/*
  fem_modal.c - K x = lambda M x by shift-and-invert: Krylov-Schur of SLEPc on (K - sigma M)^-1 M, one factorisation.  Eqs (2.65)-(2.67)

  A held body takes sigma = 0, a free one a small negative sigma: both matrices are positive definite, and CHOLMOD factorises them. The rigid motions
  of a free body are known beforehand and taken out: one Krylov sequence sees a sixfold zero only by its round-off, and once missed one. A shift of the user's lies among the frequencies; there MUMPS factorises L D L'. Held dofs have no mass and stay zero.
*/
#include "fem_impl.h"
#include "fem_modal.h"
#include <petscblaslapack.h>
#include <slepceps.h>

#define FREE_SHIFT 1e-8 /* of the largest k/m on the diagonals: far below what elements can vibrate at, far above round-off */

static PetscErrorCode Begin(void)
{
  PetscFunctionBegin;
  if (SlepcInitializeCalled) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SlepcInitializeNoArguments());
  PetscCall(PetscRegisterFinalize(SlepcFinalize)); /* before PETSc's own end */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* sigma [1/s2] of eq. (2.66) */
static PetscErrorCode Shift(FemModel model, PetscReal wanted, PetscReal *sigma)
{
  PetscBool held;
  PetscReal most = 0;

  PetscFunctionBegin;
  *sigma = wanted < 0 ? 0 : PetscSqr(2 * PETSC_PI * wanted);
  PetscCall(FemIsHeld(model, &held));
  if (held || *sigma > 0) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < model->n_own; i++) {
    const PetscInt  at = FemRowsColumn(model, i, i);
    const PetscReal m  = model->implicit.mass ? model->implicit.mass[at] : model->mass[i];

    for (PetscInt d = 0; d < model->dim; d++) most = PetscMax(most, model->rows.value[((size_t)at * model->dim + d) * model->dim + d] / m);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPIU_MAX, model->comm));
  *sigma = -FREE_SHIFT * most;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Matrices(FemModel model, Mat *K, Mat *M)
{
  const size_t n = (size_t)model->rows.start[model->n_own] * model->dim * model->dim;
  PetscReal   *value, diagonal;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &value));
  PetscCall(PetscArraycpy(value, model->rows.value, n));
  FemRowsIntoFrames(model, value);
  PetscCall(FemMatrixCreate(model, value, &diagonal, K));
  FemMassAddToRows(model, model->implicit.mass, 0, 1, value);
  FemRowsIntoFrames(model, value);
  PetscCall(FemMatrixCreate(model, value, NULL, M));
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rigid motions that supports leave, as frames see them: combinations of translations and turns that vanish at held dofs. */
static PetscErrorCode RigidMotions(FemModel model, Mat K, PetscInt *n, Vec motion[6])
{
  const PetscInt     dim = model->dim, m = dim == 3 ? 6 : 3, dofs = model->n_own * dim;
  const PetscBLASInt six = (PetscBLASInt)m, room = 64;
  PetscBLASInt       info;
  PetscReal          mid[4] = {0, 0, 0, 0}, size = 0, G[36] = {0}, all = 0, lambda[6], work[64], *r;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < model->n_own; i++) {
    for (PetscInt d = 0; d < dim; d++) mid[d] += model->x[i * dim + d];
    mid[3] += 1;
  }
  PetscCall(FemSum(model, 4, mid));
  for (PetscInt d = 0; d < 3; d++) mid[d] /= mid[3];
  for (PetscInt k = 0; k < dofs; k++) size = PetscMax(size, PetscAbsReal(model->x[k] - mid[k % dim]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &size, 1, MPIU_REAL, MPIU_MAX, model->comm));
  PetscCall(PetscMalloc1(m * dofs, &r));
  for (PetscInt i = 0; i < model->n_own; i++) {
    PetscReal s[3] = {0, 0, 0};

    for (PetscInt d = 0; d < dim; d++) s[d] = (model->x[i * dim + d] - mid[d]) / size;
    for (PetscInt c = 0; c < dim; c++) {
      for (PetscInt k = 0; k < dim; k++) r[k * dofs + i * dim + c] = k == c;
      if (dim == 2) r[2 * dofs + i * dim + c] = c ? s[0] : -s[1];
      else
        for (PetscInt a = 0; a < 3; a++) r[(3 + a) * dofs + i * dim + c] = a == c ? 0 : c == (a + 1) % 3 ? -s[(a + 2) % 3] : s[(a + 1) % 3]; /* (e_a x s)_c */
    }
  }
  for (PetscInt a = 0; a < m; a++) {
    FemIntoFrames(model, &r[a * dofs]);
    all += FemDot(model, &r[a * dofs], &r[a * dofs]);
  }
  for (PetscInt k = 0; k < dofs; k++)
    for (PetscInt a = 0; a < m && FemHeld(model, k) >= 0; a++)
      for (PetscInt b = 0; b < m; b++) G[a * m + b] += r[a * dofs + k] * r[b * dofs + k];
  PetscCall(FemSum(model, 36, G));
  PetscCall(FemSum(model, 1, &all));
  PetscCallBLAS("LAPACKsyev", LAPACKsyev_("V", "U", &six, G, &six, lambda, work, &room, &info));
  PetscCheck(!info, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev returned %d", (int)info);
  *n = 0;
  for (PetscInt e = 0; e < m && lambda[e] <= 1e-12 * all; e++) {
    PetscScalar *x;

    PetscCall(MatCreateVecs(K, &motion[*n], NULL));
    PetscCall(VecGetArrayWrite(motion[*n], &x));
    for (PetscInt k = 0; k < dofs; k++) {
      x[k] = 0;
      for (PetscInt a = 0; a < m && FemHeld(model, k) < 0; a++) x[k] += G[e * m + a] * r[a * dofs + k];
    }
    PetscCall(VecRestoreArrayWrite(motion[(*n)++], &x));
  }
  PetscCall(PetscFree(r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Noise on free dofs, the same on any number of ranks. */
static PetscErrorCode Start(FemModel model, Mat M, EPS eps)
{
  Vec          start;
  PetscScalar *x;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(M, &start, NULL));
  PetscCall(VecGetArrayWrite(start, &x));
  for (PetscInt k = 0; k < model->n_own * model->dim; k++) x[k] = FemHeld(model, k) >= 0 ? 0 : FemNoise((PetscInt64)model->gid[k / model->dim] * model->dim + k % model->dim);
  PetscCall(VecRestoreArrayWrite(start, &x));
  PetscCall(EPSSetInitialSpace(eps, 1, &start));
  PetscCall(VecDestroy(&start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solver(FemModel model, Mat K, Mat M, PetscInt count, PetscReal sigma, PetscInt n_rigid, Vec rigid[], EPS *out)
{
  EPS eps;
  ST  st;
  KSP ksp;
  PC  pc;

  PetscFunctionBegin;
  PetscCall(EPSCreate(model->comm, &eps));
  PetscCall(EPSSetOptionsPrefix(eps, "fem_"));
  PetscCall(EPSSetOperators(eps, K, M));
  PetscCall(EPSSetProblemType(eps, EPS_GHEP));
  PetscCall(EPSSetWhichEigenpairs(eps, EPS_TARGET_MAGNITUDE));
  PetscCall(EPSSetTarget(eps, sigma));
  PetscCall(EPSSetDimensions(eps, count, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(EPSSetTolerances(eps, 1e-10, 500));
  PetscCall(EPSGetST(eps, &st));
  PetscCall(STSetType(st, STSINVERT));
  PetscCall(STSetMatStructure(st, SAME_NONZERO_PATTERN));
  PetscCall(STGetKSP(st, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCCHOLESKY));
  PetscCall(PCFactorSetMatSolverType(pc, model->size == 1 && sigma <= 0 ? MATSOLVERCHOLMOD : MATSOLVERMUMPS));
  PetscCall(Start(model, M, eps));
  if (n_rigid) PetscCall(EPSSetDeflationSpace(eps, n_rigid, rigid));
  PetscCall(EPSSetFromOptions(eps));
  *out = eps;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Shape k of the answer, out of frames, its largest component 1.  Eq. (2.67) */
static PetscErrorCode Shape(FemModel model, Vec x, PetscReal *shape)
{
  const PetscInt     n = model->n_own * model->dim;
  const PetscScalar *a;
  PetscReal          mine[2] = {0, 0}, all; /* largest |component|, and its value */
  PetscReal          first[2] = {PETSC_MAX_REAL, 0};

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(x, &a));
  PetscCall(PetscArraycpy(shape, a, n));
  PetscCall(VecRestoreArrayRead(x, &a));
  FemOutOfFrames(model, shape);
  for (PetscInt k = 0; k < n; k++) mine[0] = PetscMax(mine[0], PetscAbsReal(shape[k]));
  PetscCallMPI(MPI_Allreduce(&mine[0], &all, 1, MPIU_REAL, MPIU_MAX, model->comm));
  for (PetscInt k = 0; k < n && first[0] == PETSC_MAX_REAL; k++)
    if (PetscAbsReal(shape[k]) >= 0.999 * all) { /* the first in the mesh's order among equals: the sign does not hang on round-off */
      first[0] = (PetscReal)model->gid[k / model->dim] * model->dim + k % model->dim;
      first[1] = shape[k] > 0 ? 1 : -1;
    }
  PetscCallMPI(MPI_Allreduce(&first[0], &mine[0], 1, MPIU_REAL, MPIU_MIN, model->comm));
  mine[1] = first[0] == mine[0] ? first[1] : 0;
  PetscCall(FemSum(model, 1, &mine[1]));
  for (PetscInt k = 0; k < n; k++) shape[k] *= mine[1] / all;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModalSolve(FemModel model, PetscInt count, PetscReal shift, FemModal *modes)
{
  const PetscInt n = model->n_own * model->dim;
  PetscReal      sigma, *lambda, free_dofs = 0, size, length, force;
  PetscInt       n_rigid = 0, wanted, asked, found = 0, *order;
  Mat            K, M;
  EPS            eps = NULL;
  Vec            x, y, rigid[6];

  PetscFunctionBegin;
  PetscCheck(model->ready && model->method == FEM_MODAL, model->comm, PETSC_ERR_ORDER, "Call FemModelSetUp() on a modal model before its modes are asked for");
  PetscCall(PetscMemzero(modes, sizeof(*modes)));
  for (PetscInt k = 0; k < n; k++) free_dofs += FemHeld(model, k) < 0;
  PetscCall(FemSum(model, 1, &free_dofs));
  BaseCheckInput(count <= (PetscInt)free_dofs, model->comm, "%d modes are asked for, and the mesh has %d free displacements; ask for fewer (time.modes), or refine", (int)count, (int)free_dofs);
  PetscCall(Begin());
  PetscCall(PetscLogEventBegin(FEM_Eigen, 0, 0, 0, 0));
  PetscCall(Shift(model, shift, &sigma));
  PetscCall(Matrices(model, &K, &M));
  if (sigma < 0) PetscCall(RigidMotions(model, K, &n_rigid, rigid));
  wanted = PetscMax(0, count - n_rigid);
  asked  = PetscMin(wanted + 4, (PetscInt)free_dofs - n_rigid); /* a few more, so that a twin of the last ones is not left behind */
  if (wanted) {
    PetscCall(Solver(model, K, M, asked, sigma, n_rigid, rigid, &eps));
    PetscCall(EPSSolve(eps));
    PetscCall(EPSGetConverged(eps, &found));
    PetscCheck(found >= wanted, model->comm, PETSC_ERR_NOT_CONVERGED, "%d of %d modes were found; ask for fewer, or try -- -fem_eps_ncv %d", (int)found, (int)count, (int)(4 * count + 20));
    found = PetscMin(found, asked);
  }
  modes->n     = count;
  modes->shift = (sigma < 0 ? -1 : 1) * PetscSqrtReal(PetscAbsReal(sigma)) / (2 * PETSC_PI);
  PetscCall(PetscMalloc3(count, &modes->frequency, count, &modes->residual, count * n, &modes->shape));
  PetscCall(PetscMalloc2(found, &lambda, found, &order));
  PetscCall(MatCreateVecs(K, &x, &y));
  PetscCall(MatNorm(K, NORM_INFINITY, &size));
  for (PetscInt k = 0; k < found; k++) {
    PetscCall(EPSGetEigenvalue(eps, k, &lambda[k], NULL)); /* nearest to sigma first */
    order[k] = k;
  }
  PetscCall(PetscSortRealWithPermutation(wanted, lambda, order));
  for (PetscInt k = 0; k < count; k++) {
    const PetscInt j = k - n_rigid;

    if (j < 0) {
      PetscCall(MatMult(K, rigid[k], y));
      PetscCall(VecNorm(y, NORM_2, &force));
      PetscCall(VecNorm(rigid[k], NORM_2, &length));
      modes->frequency[k] = 0;
      modes->residual[k]  = force / (size * length);
      PetscCall(Shape(model, rigid[k], &modes->shape[(size_t)k * n]));
      continue;
    }
    modes->frequency[k] = PetscSqrtReal(PetscMax(lambda[order[j]], 0)) / (2 * PETSC_PI);
    PetscCall(EPSComputeError(eps, order[j], EPS_ERROR_BACKWARD, &modes->residual[k]));
    PetscCall(EPSGetEigenvector(eps, order[j], x, NULL));
    PetscCall(Shape(model, x, &modes->shape[(size_t)k * n]));
  }
  PetscCall(PetscFree2(lambda, order));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  for (PetscInt k = 0; k < n_rigid; k++) PetscCall(VecDestroy(&rigid[k]));
  PetscCall(EPSDestroy(&eps));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&M));
  PetscCall(PetscLogEventEnd(FEM_Eigen, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModalShow(FemModel model, const FemModal *modes, PetscInt k)
{
  const PetscInt n = model->n_own * model->dim;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(model->u, &modes->shape[(size_t)k * n], n));
  PetscCall(FemGhosts(model, model->u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModalDestroy(FemModal *modes)
{
  PetscFunctionBegin;
  PetscCall(PetscFree3(modes->frequency, modes->residual, modes->shape));
  modes->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
