/*
  fem_solver.c - one symmetric positive matrix in block rows, and how it is solved: shared by statics, implicit dynamics and modes.

  Fixed dofs stay in the matrix as scaled identity rows, so the blocks stay whole and algebraic multigrid coarsens by nodes
  (their columns' share is the caller's, on the right-hand side). The pattern is that of all blocks, zeros included.
  Small: a Cholesky factor, CHOLMOD on one rank, MUMPS on more, made at the first solve and kept. Large: CG with GAMG on the
  rigid-body modes, or, where all elements are quadratic, without a matrix: fem_multigrid.c. Options: -fem_...
*/
#include "fem_impl.h"

/* Up to so many dofs in 3D and at a Poisson's ratio of 0.3 a factor serves better than multigrid; times in fem/README.md. */
#define DIRECT_MOST_3D 20000
#define MULTIGRID_LOST 0.4999 /* Poisson's ratio beyond which multigrid would need more iterations than it is given, likewise */

/* value [start[n_own]][dim][dim] in the pattern of model->rows, seen from frames; rows and columns of fixed dofs become d I, d = *diagonal (NULL: zero). */
PetscErrorCode FemMatrixCreate(FemModel model, const PetscReal *value, PetscReal *diagonal, Mat *matrix)
{
  const PetscInt dim = model->dim, n = model->n_own * dim;
  const FemRows *rows = &model->rows;
  PetscInt       first, *inside, *outside, *column, *number;
  PetscReal     *line, largest = 0, scale = 0, *global;
  Mat            K;

  PetscFunctionBegin;
  PetscCall(MatCreate(model->comm, &K));
  PetscCall(MatSetSizes(K, n, n, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(K, dim));
  PetscCall(MatSetType(K, MATAIJ));
  PetscCall(MatSetOptionsPrefix(K, "fem_"));
  PetscCall(PetscMalloc4(n, &inside, n, &outside, rows->longest * dim, &column, rows->longest * dim, &line));
  for (PetscInt i = 0; i < model->n_own; i++) {
    PetscInt here = 0;

    for (PetscInt k = rows->start[i]; k < rows->start[i + 1]; k++) here += rows->col[k] < model->n_own;
    for (PetscInt d = 0; d < dim; d++) {
      inside[i * dim + d]  = here * dim;
      outside[i * dim + d] = (rows->start[i + 1] - rows->start[i] - here) * dim;
    }
  }
  PetscCall(MatSeqAIJSetPreallocation(K, 0, inside));
  PetscCall(MatMPIAIJSetPreallocation(K, 0, inside, 0, outside));
  PetscCall(MatGetOwnershipRange(K, &first, NULL));
  PetscCall(PetscMalloc2(model->n_loc, &number, model->n_loc * dim, &global));
  for (PetscInt i = 0; i < model->n_own; i++) global[i * dim] = first / dim + i;
  PetscCall(FemGhosts(model, global));
  for (PetscInt i = 0; i < model->n_loc; i++) number[i] = (PetscInt)global[i * dim];

  for (PetscInt i = 0; i < model->n_own && diagonal; i++) /* scale of the identity rows: the largest diagonal entry */
    for (PetscInt k = rows->start[i]; k < rows->start[i + 1]; k++)
      for (PetscInt d = 0; d < dim && rows->col[k] == i; d++) largest = PetscMax(largest, value[((size_t)k * dim + d) * dim + d]);
  PetscCallMPI(MPI_Allreduce(&largest, &scale, 1, MPIU_REAL, MPIU_MAX, model->comm));
  for (PetscInt i = 0; i < model->n_own; i++) {
    const PetscInt m = (rows->start[i + 1] - rows->start[i]) * dim;

    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt row = first + i * dim + d;

      for (PetscInt k = 0; k < m; k++) {
        const PetscInt  at = rows->start[i] + k / dim, j = rows->col[at], e = k % dim;
        const PetscBool held = FemHeld(model, i * dim + d) >= 0 || FemHeld(model, j * dim + e) >= 0 ? PETSC_TRUE : PETSC_FALSE;

        column[k] = number[j] * dim + e;
        line[k]   = !held ? value[((size_t)at * dim + d) * dim + e] : column[k] == row ? scale : 0;
      }
      PetscCall(MatSetValues(K, 1, &row, m, column, line, INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(K, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(K, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  PetscCall(PetscFree4(inside, outside, column, line));
  PetscCall(PetscFree2(number, global));
  if (diagonal) *diagonal = scale;
  *matrix = K;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemRigidModes(FemModel model, Mat matrix, PetscInt n_nodes, const PetscInt *node)
{
  const PetscInt dim = model->dim;
  Vec            coordinates;
  PetscScalar   *x, *all;
  MatNullSpace   modes;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(matrix, &coordinates, NULL));
  PetscCall(VecSetBlockSize(coordinates, dim));
  PetscCall(VecGetArray(coordinates, &x));
  for (PetscInt i = 0; i < n_nodes; i++) PetscCall(PetscArraycpy(&x[i * dim], &model->x[(node ? node[i] : i) * dim], dim));
  PetscCall(VecRestoreArray(coordinates, &x));
  PetscCall(MatNullSpaceCreateRigidBody(coordinates, &modes));
  if (model->frame_of) { /* the modes as nodes with a frame see them */
    const Vec *mode;
    PetscInt   n;

    PetscCall(MatNullSpaceGetVecs(modes, NULL, &n, &mode));
    PetscCall(PetscCalloc1(model->n_own * dim, &all));
    for (PetscInt k = 0; k < n; k++) {
      PetscCall(VecGetArray(mode[k], &x));
      for (PetscInt i = 0; i < n_nodes; i++) PetscCall(PetscArraycpy(&all[(node ? node[i] : i) * dim], &x[i * dim], dim));
      FemIntoFrames(model, all);
      for (PetscInt i = 0; i < n_nodes; i++) PetscCall(PetscArraycpy(&x[i * dim], &all[(node ? node[i] : i) * dim], dim));
      PetscCall(VecRestoreArray(mode[k], &x));
    }
    PetscCall(PetscFree(all));
  }
  PetscCall(MatSetNearNullSpace(matrix, modes));
  PetscCall(MatNullSpaceDestroy(&modes));
  PetscCall(VecDestroy(&coordinates));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemPrefer(const char *name, const char *value)
{
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(PetscOptionsHasName(NULL, NULL, name, &given));
  if (!given) PetscCall(PetscOptionsSetValue(NULL, name, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

FemSolver FemSolverRule(PetscInt dim, PetscInt order, PetscReal dofs, PetscReal poisson, PetscInt ranks)
{
  const PetscReal more = poisson > 0.3 ? PetscSqrtReal(0.4 / PetscMax(1 - 2 * poisson, 1e-12)) : 1; /* eq. (2.82): as the iterations of multigrid grow */
  const PetscReal most = DIRECT_MOST_3D * PetscMin(10, (dim == 3 ? 1 : 10) * more);

  if (dofs > most && poisson <= MULTIGRID_LOST) return order == 2 ? FEM_TWO_LEVEL : FEM_MULTIGRID;
  return ranks == 1 ? FEM_CHOLMOD : FEM_MUMPS;
}

/* The rule, unless -fem_pc_type asks for a factor or for multigrid: then with all that goes with it. */
static PetscErrorCode RuleOrOptions(PetscInt dim, PetscInt order, PetscReal dofs, PetscReal poisson, PetscInt ranks, FemSolver *rule)
{
  PetscBool has, gamg, two, cholesky;
  char      pc[64];

  PetscFunctionBegin;
  *rule = FemSolverRule(dim, order, dofs, poisson, ranks);
  PetscCall(PetscOptionsGetString(NULL, "fem_", "-pc_type", pc, sizeof(pc), &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscStrcmp(pc, PCMG, &two));
  PetscCall(PetscStrcmp(pc, PCGAMG, &gamg));
  PetscCall(PetscStrcmp(pc, PCCHOLESKY, &cholesky));
  if (two && order == 2) *rule = FEM_TWO_LEVEL;
  else if (gamg || *rule == FEM_TWO_LEVEL) *rule = FEM_MULTIGRID; /* any other wants a matrix */
  if (cholesky) *rule = ranks == 1 ? FEM_CHOLMOD : FEM_MUMPS;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemSolverWords(PetscInt dim, PetscInt order, PetscReal dofs, PetscReal poisson, PetscInt ranks, size_t size, char words[])
{
  static const char *const names[] = {"Cholesky (CHOLMOD)", "Cholesky (MUMPS)", "conjugate gradients with multigrid (GAMG on the rigid-body modes)",
                                      "conjugate gradients with two-level multigrid (quadratic without a matrix, linear by GAMG)"}; /* FemSolver */
  FemSolver                rule;
  char                     ksp[64], pc[64];
  PetscBool                has_ksp, has_pc;

  PetscFunctionBegin;
  PetscCall(RuleOrOptions(dim, order, dofs, poisson, ranks, &rule));
  PetscCall(PetscOptionsGetString(NULL, "fem_", "-ksp_type", ksp, sizeof(ksp), &has_ksp));
  PetscCall(PetscOptionsGetString(NULL, "fem_", "-pc_type", pc, sizeof(pc), &has_pc));
  if (!has_ksp) PetscCall(PetscStrncpy(ksp, rule >= FEM_MULTIGRID ? KSPCG : KSPPREONLY, sizeof(ksp)));
  if (!has_pc) PetscCall(PetscStrncpy(pc, rule == FEM_TWO_LEVEL ? PCMG : rule == FEM_MULTIGRID ? PCGAMG : PCCHOLESKY, sizeof(pc)));
  if (has_ksp || has_pc) PetscCall(PetscSNPrintf(words, size, "%s with %s, by the options given", ksp, pc));
  else PetscCall(PetscStrncpy(words, names[rule], size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemSolverWants(FemModel model, FemSolver *solver)
{
  PetscReal poisson = -1;
  PetscInt  linear  = 0;

  PetscFunctionBegin;
  for (PetscInt r = 0; r < model->n_regions; r++) poisson = PetscMax(poisson, model->region[r].material.poisson);
  for (PetscInt c = 0; c < model->n_cells; c++) linear += MeshCellLinear((MeshCellType)model->cell_type[c]) == (MeshCellType)model->cell_type[c];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &linear, 1, MPIU_INT, MPI_SUM, model->comm));
  PetscCall(RuleOrOptions(model->dim, model->method == FEM_STATIC && !linear && !model->contact.n_planes ? 2 : 1, (PetscReal)model->N_nodes * model->dim, poisson, model->size, solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemSolverCreate(FemModel model, const PetscReal *value)
{
  FemSolver rule;
  PetscBool preonly;
  PC        pc;

  PetscFunctionBegin;
  PetscCall(FemSolverWants(model, &rule));
  if (rule != FEM_TWO_LEVEL) { /* value may be NULL on a rank without nodes */
    PetscCall(FemMatrixCreate(model, value, &model->diagonal, &model->K));
    PetscCall(MatSetOption(model->K, MAT_SPD, PETSC_TRUE));
    PetscCall(MatSetOption(model->K, MAT_SPD_ETERNAL, PETSC_TRUE));
    PetscCall(MatCreateVecs(model->K, &model->solution, &model->rhs));
    PetscCall(FemRigidModes(model, model->K, model->n_own, NULL));
  }
  PetscCall(KSPCreate(model->comm, &model->ksp));
  PetscCall(KSPSetOptionsPrefix(model->ksp, "fem_"));
  PetscCall(KSPGetPC(model->ksp, &pc));
  if (rule != FEM_TWO_LEVEL) PetscCall(KSPSetOperators(model->ksp, model->K, model->K));
  else PetscCall(FemMultigridCreate(model));
  if (rule < FEM_MULTIGRID) {
    PetscCall(KSPSetType(model->ksp, KSPPREONLY));
    PetscCall(PCSetType(pc, PCCHOLESKY));
    PetscCall(PCFactorSetMatSolverType(pc, rule == FEM_CHOLMOD ? MATSOLVERCHOLMOD : MATSOLVERMUMPS));
  } else {
    static const char *const ours[][2] = {{"-fem_pc_gamg_agg_nsmooths", "1"},          {"-fem_pc_gamg_aggressive_coarsening", "1"}, {"-fem_pc_gamg_threshold", "0.001"}, {"-fem_pc_gamg_coarse_eq_limit", "200"},
                                          {"-fem_pc_gamg_esteig_ksp_type", "cg"},      {"-fem_pc_gamg_esteig_ksp_max_it", "10"},    {"-fem_mg_levels_ksp_type", "chebyshev"}, {"-fem_mg_levels_ksp_max_it", "2"},
                                          {"-fem_mg_levels_ksp_chebyshev_esteig", "0,0.05,0,1.1"}, {"-fem_mg_levels_pc_type", "jacobi"}};

    for (size_t k = 0; k < sizeof(ours) / sizeof(ours[0]) && rule == FEM_MULTIGRID; k++) PetscCall(FemPrefer(ours[k][0], ours[k][1]));
    PetscCall(KSPSetType(model->ksp, KSPCG));
    PetscCall(KSPSetNormType(model->ksp, KSP_NORM_UNPRECONDITIONED));
    PetscCall(KSPSetTolerances(model->ksp, 1e-11, 1e-300, PETSC_DEFAULT, 2000));
    PetscCall(KSPSetInitialGuessNonzero(model->ksp, PETSC_TRUE)); /* the last step's answer */
    if (rule == FEM_MULTIGRID) PetscCall(PCSetType(pc, PCGAMG));
  }
  PetscCall(KSPSetFromOptions(model->ksp));
  PetscCall(PetscObjectTypeCompare((PetscObject)model->ksp, KSPPREONLY, &preonly)); /* the user may have asked for a factor */
  if (preonly) PetscCall(KSPSetInitialGuessNonzero(model->ksp, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* solution = K^-1 rhs; solution is the first guess of an iterative solver. K singular or nearly so although every part is held:
   say what usually causes it. */
PetscErrorCode FemSolverSolve(FemModel model)
{
  KSPConvergedReason reason;
  PetscErrorCode     code;
  PetscInt           iterations;
  const char *const *words;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(FEM_Solve, 0, 0, 0, 0));
  code = KSPSolve(model->ksp, model->rhs, model->solution);
  PetscCheck(!code, model->comm, PETSC_ERR_NOT_CONVERGED, "%s: the system could not be solved (PETSc error %d); a part held only by a hinge or a single node makes it singular", model->source, (int)code);
  PetscCall(KSPGetConvergedReason(model->ksp, &reason));
  PetscCall(KSPGetIterationNumber(model->ksp, &iterations));
  model->iterations = iterations;
  words = KSPConvergedReasons;
  PetscCheck(reason > 0, model->comm, PETSC_ERR_NOT_CONVERGED, "%s: the solver gave up after %d iterations (%s); a part held only by a hinge or a single node, or a Poisson's ratio near 0.5, can cause it; try -- -fem_ksp_type preonly -fem_pc_type cholesky",
             model->source, (int)iterations, words[reason]);
  PetscCall(PetscLogEventEnd(FEM_Solve, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemSolverSolveArray(FemModel model, const PetscReal *b, PetscReal *x)
{
  const PetscInt     n = model->n_own * model->dim;
  PetscScalar       *rhs;
  const PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(model->rhs, &rhs));
  PetscCall(PetscArraycpy(rhs, b, n));
  PetscCall(VecRestoreArrayWrite(model->rhs, &rhs));
  PetscCall(VecSet(model->solution, 0)); /* the same bits whatever came before */
  PetscCall(FemSolverSolve(model));
  PetscCall(VecGetArrayRead(model->solution, &a));
  PetscCall(PetscArraycpy(x, a, n));
  PetscCall(VecRestoreArrayRead(model->solution, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemSolverDestroy(FemModel model)
{
  PetscFunctionBegin;
  PetscCall(KSPDestroy(&model->ksp));
  PetscCall(FemMultigridDestroy(model));
  PetscCall(MatDestroy(&model->K));
  PetscCall(VecDestroy(&model->rhs));
  PetscCall(VecDestroy(&model->solution));
  PetscFunctionReturn(PETSC_SUCCESS);
}
