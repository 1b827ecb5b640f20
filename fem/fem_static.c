/*
  fem_static.c - K u = f, one factorisation for all load steps.  Eqs (2.14)-(2.16)

  Fixed dofs stay in the matrix as scaled identity rows with their columns moved to the right-hand side, so the blocks
  stay whole and algebraic multigrid coarsens by nodes. The pattern is that of all blocks, zeros included.
  Small: a Cholesky factor, CHOLMOD on one rank, MUMPS on more. Large: CG with GAMG on the rigid-body modes. Options: -fem_...
*/
#include "fem_impl.h"

/* Above so many dofs in 3D (2D, or nearly incompressible: ten times) multigrid beats the factor; times in fem/README.md. */
#define DIRECT_MOST_3D 20000

static PetscErrorCode BuildMatrix(FemModel model)
{
  const PetscInt dim = model->dim, n = model->n_own * dim;
  const FemRows *rows = &model->rows;
  PetscInt       first, *diagonal, *outside, *column, *number;
  PetscReal     *line, largest = 0, *global;

  PetscFunctionBegin;
  PetscCall(MatCreate(model->comm, &model->K));
  PetscCall(MatSetSizes(model->K, n, n, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(model->K, dim));
  PetscCall(MatSetType(model->K, MATAIJ));
  PetscCall(MatSetOptionsPrefix(model->K, "fem_"));
  PetscCall(PetscMalloc4(n, &diagonal, n, &outside, rows->longest * dim, &column, rows->longest * dim, &line));
  for (PetscInt i = 0; i < model->n_own; i++) {
    PetscInt here = 0;

    for (PetscInt k = rows->start[i]; k < rows->start[i + 1]; k++) here += rows->col[k] < model->n_own;
    for (PetscInt d = 0; d < dim; d++) {
      diagonal[i * dim + d] = here * dim;
      outside[i * dim + d]  = (rows->start[i + 1] - rows->start[i] - here) * dim;
    }
  }
  PetscCall(MatSeqAIJSetPreallocation(model->K, 0, diagonal));
  PetscCall(MatMPIAIJSetPreallocation(model->K, 0, diagonal, 0, outside));
  PetscCall(MatGetOwnershipRange(model->K, &first, NULL));
  PetscCall(PetscMalloc2(model->n_loc, &number, model->n_loc * dim, &global));
  for (PetscInt i = 0; i < model->n_own; i++) global[i * dim] = first / dim + i;
  PetscCall(FemGhosts(model, global));
  for (PetscInt i = 0; i < model->n_loc; i++) number[i] = (PetscInt)global[i * dim];

  for (PetscInt i = 0; i < model->n_own; i++) /* scale of the identity rows: the largest diagonal entry */
    for (PetscInt k = rows->start[i]; k < rows->start[i + 1]; k++)
      for (PetscInt d = 0; d < dim && rows->col[k] == i; d++) largest = PetscMax(largest, rows->value[((size_t)k * dim + d) * dim + d]);
  PetscCallMPI(MPI_Allreduce(&largest, &model->diagonal, 1, MPIU_REAL, MPIU_MAX, model->comm));
  for (PetscInt i = 0; i < model->n_own; i++) {
    const PetscInt m = (rows->start[i + 1] - rows->start[i]) * dim;

    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt row = first + i * dim + d;

      for (PetscInt k = 0; k < m; k++) {
        const PetscInt  at = rows->start[i] + k / dim, j = rows->col[at], e = k % dim;
        const PetscBool held = FemHeld(model, i * dim + d) >= 0 || FemHeld(model, j * dim + e) >= 0 ? PETSC_TRUE : PETSC_FALSE;

        column[k] = number[j] * dim + e;
        line[k]   = !held ? rows->value[((size_t)at * dim + d) * dim + e] : column[k] == row ? model->diagonal : 0;
      }
      PetscCall(MatSetValues(model->K, 1, &row, m, column, line, INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(model->K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(model->K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(model->K, MAT_SPD, PETSC_TRUE));
  PetscCall(MatSetOption(model->K, MAT_SPD_ETERNAL, PETSC_TRUE));
  PetscCall(PetscFree4(diagonal, outside, column, line));
  PetscCall(PetscFree2(number, global));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AttachRigidModes(FemModel model)
{
  Vec          coordinates;
  PetscScalar *x;
  MatNullSpace modes;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(model->K, &model->solution, &model->rhs));
  PetscCall(VecDuplicate(model->rhs, &coordinates));
  PetscCall(VecSetBlockSize(coordinates, model->dim));
  PetscCall(VecGetArray(coordinates, &x));
  PetscCall(PetscArraycpy(x, model->x, model->n_own * model->dim));
  PetscCall(VecRestoreArray(coordinates, &x));
  PetscCall(MatNullSpaceCreateRigidBody(coordinates, &modes));
  if (model->frame_of) { /* the modes as nodes with a frame see them */
    const Vec *mode;
    PetscInt   n;

    PetscCall(MatNullSpaceGetVecs(modes, NULL, &n, &mode));
    for (PetscInt k = 0; k < n; k++) {
      PetscCall(VecGetArray(mode[k], &x));
      FemIntoFrames(model, x);
      PetscCall(VecRestoreArray(mode[k], &x));
    }
  }
  PetscCall(MatSetNearNullSpace(model->K, modes));
  PetscCall(MatNullSpaceDestroy(&modes));
  PetscCall(VecDestroy(&coordinates));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An option of ours, unless the user gave it. */
static PetscErrorCode Prefer(const char *name, const char *value)
{
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(PetscOptionsHasName(NULL, NULL, name, &given));
  if (!given) PetscCall(PetscOptionsSetValue(NULL, name, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Multigrid loses its grip there. */
static PetscBool NearlyIncompressible(FemModel model)
{
  for (PetscInt r = 0; r < model->n_regions; r++)
    if (model->region[r].material.poisson > 0.49) return PETSC_TRUE;
  return PETSC_FALSE;
}

static PetscErrorCode BuildSolver(FemModel model)
{
  const PetscReal most = (model->dim == 3 && !NearlyIncompressible(model) ? 1.0 : 10.0) * DIRECT_MOST_3D;
  const PetscBool direct = (PetscReal)model->N_nodes * model->dim <= most ? PETSC_TRUE : PETSC_FALSE;
  PetscBool       preonly;
  PC              pc;

  PetscFunctionBegin;
  PetscCall(KSPCreate(model->comm, &model->ksp));
  PetscCall(KSPSetOptionsPrefix(model->ksp, "fem_"));
  PetscCall(KSPSetOperators(model->ksp, model->K, model->K));
  PetscCall(KSPGetPC(model->ksp, &pc));
  if (direct) {
    PetscCall(KSPSetType(model->ksp, KSPPREONLY));
    PetscCall(PCSetType(pc, PCCHOLESKY));
    PetscCall(PCFactorSetMatSolverType(pc, model->size == 1 ? MATSOLVERCHOLMOD : MATSOLVERMUMPS));
  } else {
    static const char *const ours[][2] = {{"-fem_pc_gamg_agg_nsmooths", "1"},          {"-fem_pc_gamg_aggressive_coarsening", "1"}, {"-fem_pc_gamg_threshold", "0.001"}, {"-fem_pc_gamg_coarse_eq_limit", "200"},
                                          {"-fem_pc_gamg_esteig_ksp_type", "cg"},      {"-fem_pc_gamg_esteig_ksp_max_it", "10"},    {"-fem_mg_levels_ksp_type", "chebyshev"}, {"-fem_mg_levels_ksp_max_it", "2"},
                                          {"-fem_mg_levels_ksp_chebyshev_esteig", "0,0.05,0,1.1"}, {"-fem_mg_levels_pc_type", "jacobi"}};

    for (size_t k = 0; k < sizeof(ours) / sizeof(ours[0]); k++) PetscCall(Prefer(ours[k][0], ours[k][1]));
    PetscCall(KSPSetType(model->ksp, KSPCG));
    PetscCall(KSPSetNormType(model->ksp, KSP_NORM_UNPRECONDITIONED));
    PetscCall(KSPSetTolerances(model->ksp, 1e-11, 1e-300, PETSC_DEFAULT, 2000));
    PetscCall(KSPSetInitialGuessNonzero(model->ksp, PETSC_TRUE)); /* the last step's answer */
    PetscCall(PCSetType(pc, PCGAMG));
  }
  PetscCall(KSPSetFromOptions(model->ksp));
  PetscCall(PetscObjectTypeCompare((PetscObject)model->ksp, KSPPREONLY, &preonly)); /* the user may have asked for a factor */
  if (preonly) PetscCall(KSPSetInitialGuessNonzero(model->ksp, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemStaticSetUp(FemModel model)
{
  PetscFunctionBegin;
  BaseCheckInput(model->alpha == 0, model->comm, "Damping of %g 1/s needs the explicit method; a static body has no velocity", (double)model->alpha);
  for (PetscInt d = 0; d < 3; d++) BaseCheckInput(model->velocity0[d] == 0, model->comm, "An initial velocity needs the explicit method; a static body has no inertia");
  PetscCall(FemCheckRigidMotion(model));
  model->initial = FemPrestressEnergy(model);
  PetscCall(FemSum(model, 1, &model->initial));
  PetscCall(FemRowsCreate(model));
  FemRowsIntoFrames(model);
  PetscCall(BuildMatrix(model));
  PetscCall(FemRowsDestroy(model)); /* K is in the matrix now; forces and reactions come from the elements */
  PetscCall(FemElementsCreate(model));
  PetscCall(AttachRigidModes(model));
  PetscCall(BuildSolver(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K is singular or nearly so although every part is held: say what usually causes it. */
static PetscErrorCode Solve(FemModel model)
{
  KSPConvergedReason reason;
  PetscErrorCode     code;
  PetscInt           iterations;
  const char *const *words;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(FEM_Solve, 0, 0, 0, 0));
  code = KSPSolve(model->ksp, model->rhs, model->solution);
  PetscCheck(!code, model->comm, PETSC_ERR_NOT_CONVERGED, "%s: the static system could not be solved (PETSc error %d); a part held only by a hinge or a single node makes it singular", model->source, (int)code);
  PetscCall(KSPGetConvergedReason(model->ksp, &reason));
  PetscCall(KSPGetIterationNumber(model->ksp, &iterations));
  words = KSPConvergedReasons;
  PetscCheck(reason > 0, model->comm, PETSC_ERR_NOT_CONVERGED, "%s: the static solver gave up after %d iterations (%s); a part held only by a hinge or a single node, or a Poisson's ratio near 0.5, can cause it; try -- -fem_ksp_type preonly -fem_pc_type cholesky",
             model->source, (int)iterations, words[reason]);
  PetscCall(PetscLogEventEnd(FEM_Solve, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reactions, and the out-of-balance force on free dofs against all forces; catches a singular K that still factorised. */
static PetscErrorCode CheckResidual(FemModel model)
{
  PetscReal sum[3] = {0, 0, 0};

  PetscFunctionBegin;
  PetscCall(FemTakeReactions(model, &sum[0]));
  for (PetscInt k = 0; k < model->n_own * model->dim; k++) {
    sum[1] += model->f_int[k] * model->f_int[k] + model->f_app[k] * model->f_app[k] + (model->pre.n ? PetscSqr(model->pre.force[k]) : 0);
    if (FemHeld(model, k) >= 0) sum[2] += PetscSqr(model->diagonal * model->u[k]); /* a body moved as a whole has no force but round-off */
  }
  PetscCall(FemSum(model, 3, sum));
  PetscCheck(sum[0] <= 1e-12 * sum[1] + 1e-26 * sum[2], model->comm, PETSC_ERR_NOT_CONVERGED, "%s: the static solution is out of balance by %g of its forces; a part held only by a hinge or a single node can cause it", model->source,
             (double)PetscSqrtReal(sum[0] / sum[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemStaticStep(void *ctx, PetscReal t, PetscReal dt)
{
  FemModel           model = ctx;
  const PetscInt     dim = model->dim, n = model->n_own * dim;
  PetscReal         *old_u, *old_force, *place, work = 0, heat, moved = 0;
  PetscScalar       *b, *s;
  const PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n, &old_u, n, &old_force, model->n_fixes, &place));
  for (PetscInt k = 0; k < n; k++) {
    old_u[k]     = model->u[k];
    old_force[k] = model->f_app[k] + model->reaction[k];
  }
  for (PetscInt k = 0; k < n && !model->started; k++) old_force[k] = model->pre.n ? model->pre.force[k] : 0; /* loads grow from nothing during the first step, and what held an in-situ stress lets go */
  PetscCall(FemLoadsAt(model, t + dt));

  for (PetscInt k = 0; k < model->n_fixes; k++) place[k] = FemFixPosition(&model->fix[k], t + dt);
  PetscCall(VecGetArrayWrite(model->solution, &s));
  PetscCall(PetscArraycpy(s, model->u, n));
  FemIntoFrames(model, s);
  PetscCall(VecRestoreArrayWrite(model->solution, &s));
  for (PetscInt k = 0; k < n; k++) model->u[k] = FemHeld(model, k) >= 0 ? place[FemHeld(model, k)] : 0;
  FemOutOfFrames(model, model->u);
  PetscCall(FemGhosts(model, model->u));
  for (PetscInt k = 0; k < model->n_loc * dim; k++) moved = PetscMax(moved, PetscAbsReal(model->u[k]));
  if (moved > 0) PetscCall(FemApply(model, model->u, model->f_int));
  else PetscCall(PetscArrayzero(model->f_int, n));
  FemPrestressAdvance(model, t + dt);
  FemAddPrestress(model);
  PetscCall(VecGetArrayWrite(model->rhs, &b));
  for (PetscInt k = 0; k < n; k++) b[k] = model->f_app[k] + model->f_ext[k] - model->f_int[k];
  FemIntoFrames(model, b);
  for (PetscInt k = 0; k < n; k++)
    if (FemHeld(model, k) >= 0) b[k] = model->diagonal * place[FemHeld(model, k)];
  PetscCall(VecRestoreArrayWrite(model->rhs, &b));
  PetscCall(Solve(model));
  PetscCall(VecGetArrayRead(model->solution, &a));
  for (PetscInt k = 0; k < n; k++) model->u[k] = FemHeld(model, k) >= 0 ? place[FemHeld(model, k)] : a[k];
  PetscCall(VecRestoreArrayRead(model->solution, &a));
  FemOutOfFrames(model, model->u);
  PetscCall(FemGhosts(model, model->u));
  PetscCall(FemApply(model, model->u, model->f_int));
  FemAddPrestress(model);
  PetscCall(CheckResidual(model));

  for (PetscInt k = 0; k < n; k++) { /* eq. (2.16) */
    model->v[k] = (model->u[k] - old_u[k]) / dt;
    work += 0.5 * (old_force[k] + model->f_app[k] + model->reaction[k]) * (model->u[k] - old_u[k]);
  }
  PetscCall(PetscFree3(old_u, old_force, place));
  PetscCall(FemSum(model, 1, &work));
  PetscCall(FemHeatWork(model, &heat));
  model->work += work + heat;
  model->work_in += PetscAbsReal(work) + PetscAbsReal(heat);
  model->started = PETSC_TRUE;
  model->t       = t + dt;
  model->dt_last = dt;
  PetscFunctionReturn(PETSC_SUCCESS);
}
