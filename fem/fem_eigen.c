/*
  fem_eigen.c - the critical step of central differences, and a bound that never exceeds it.  Eqs (2.12), (2.13)

  2/omega_max with omega_max^2 the largest eigenvalue of M^-1 K on the free dofs. The largest eigenvalue of any assembly
  is at most the largest over its elements (Irons), whichever way the nodal masses are dealt out to them, and fixing dofs
  lowers it further. Masses go to elements by their share of the node's stiffness: with each element's own mass, slivers
  among large neighbours made the bound 0.41 of the critical step; dealt out it is 0.68. The value itself comes from Lanczos
  on M^-1/2 K M^-1/2, which reaches the ends of a spectrum in far fewer products than power iteration.
*/
#include "fem_impl.h"
#include <petscblaslapack.h>

/* splitmix64 of a global number: the same start vector on any number of ranks. */
PetscReal FemNoise(PetscInt64 number)
{
  unsigned long long z = (unsigned long long)number * 0x9E3779B97F4A7C15ull + 0x9E3779B97F4A7C15ull;

  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  z ^= z >> 31;
  return (PetscReal)(z >> 11) / 9007199254740992.0 - 0.5;
}

/* k [nodes] trace of the diagonal block of each node: how much of the node's stiffness this element is. */
static void NodeTraces(PetscInt nodes, PetscInt dim, const PetscReal *K, PetscReal *k)
{
  for (PetscInt a = 0; a < nodes; a++) {
    k[a] = 0;
    for (PetscInt d = 0; d < dim; d++) k[a] += K[(a * dim + d) * (nodes * dim + 1)];
  }
}

/* Eq. (2.13). share [n_loc*dim], first of dim: mass over stiffness of a node, so that an element gets mass where it is stiff. */
PetscErrorCode FemBoundStep(FemModel model)
{
  const PetscInt dim     = model->dim;
  PetscReal      largest = 0, *share;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(FEM_Eigen, 0, 0, 0, 0));
  PetscCall(PetscCalloc1(model->n_loc * dim, &share));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const PetscInt nodes = model->cell_start[c + 1] - model->cell_start[c];
    PetscReal      K[FEM_MAX_DOFS * FEM_MAX_DOFS], k[FEM_MAX_NODES];

    FemCellStiffness(model, c, K);
    NodeTraces(nodes, dim, K, k);
    for (PetscInt a = 0; a < nodes; a++) share[model->cell_node[model->cell_start[c] + a] * dim] += k[a];
  }
  for (PetscInt i = 0; i < model->n_own; i++) share[i * dim] = model->mass[i] / share[i * dim];
  PetscCall(FemGhosts(model, share));
#pragma omp parallel for schedule(static) num_threads(model->threads) reduction(max : largest)
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const PetscInt nodes = model->cell_start[c + 1] - model->cell_start[c];
    PetscReal      K[FEM_MAX_DOFS * FEM_MAX_DOFS], m[FEM_MAX_NODES];

    FemCellStiffness(model, c, K);
    NodeTraces(nodes, dim, K, m);
    for (PetscInt a = 0; a < nodes; a++) m[a] *= share[model->cell_node[model->cell_start[c] + a] * dim];
    largest = PetscMax(largest, FemEigenBound(nodes, dim, K, m));
  }
  PetscCall(PetscFree(share));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPIU_REAL, MPIU_MAX, model->comm));
  model->bound = 2 / PetscSqrtReal(largest * (1 + model->local));
  PetscCall(PetscLogEventEnd(FEM_Eigen, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetStableStep(FemModel model, PetscReal *dt)
{
  PetscFunctionBegin;
  PetscCheck(model && model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetUp() first");
  if (model->method == FEM_EXPLICIT && !(model->bound > 0)) PetscCall(FemBoundStep(model));
  *dt = model->method == FEM_EXPLICIT ? model->bound : PETSC_MAX_REAL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest eigenvalue of the k x k tridiagonal (a, b), and the last entry of its unit vector. */
static PetscErrorCode LargestRitz(PetscInt k, const PetscReal *a, const PetscReal *b, PetscReal *theta, PetscReal *last)
{
  PetscBLASInt n, info;
  PetscReal   *d, *e, *Z, *work;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(k, &n));
  PetscCall(PetscMalloc4(k, &d, k, &e, k * k, &Z, 2 * k, &work));
  PetscCall(PetscArraycpy(d, a, k));
  PetscCall(PetscArraycpy(e, b, k));
  PetscCallBLAS("LAPACKsteqr", LAPACKsteqr_("I", &n, d, e, Z, &n, work, &info));
  PetscCheck(!info, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK steqr returned %d", (int)info);
  *theta = d[k - 1];
  *last  = Z[(k - 1) * k + k - 1];
  PetscCall(PetscFree4(d, e, Z, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What prescribed axes of a frame hold is taken out; the mass of a node is the same in all directions, so scaling commutes. */
static void FrameFree(FemModel model, PetscReal *a)
{
  if (!model->frame_of) return;
  FemIntoFrames(model, a);
  for (PetscInt f = 0; f < model->n_frames_own; f++)
    for (PetscInt i = 0; i < model->dim; i++)
      if (model->frame_fix[f * model->dim + i] >= 0) a[model->frame_node[f] * model->dim + i] = 0;
  FemOutOfFrames(model, a);
}

/* Lanczos on M^-1/2 K M^-1/2 of the free dofs until the residual is below tolerance x theta; the largest eigenvalue. */
static PetscErrorCode LargestEigenvalue(FemModel model, PetscReal tolerance, PetscReal *theta)
{
  const PetscInt n = model->n_own * model->dim, most = 200;
  PetscReal     *scale, *q, *q_old, *r, *y, a[200], b[200], last = 1, beta;

  PetscFunctionBegin;
  PetscCall(PetscMalloc5(n, &scale, n, &q, n, &q_old, n, &r, model->n_loc * model->dim, &y));
  for (PetscInt k = 0; k < n; k++) {
    scale[k] = model->fixed[k] >= 0 ? 0 : 1 / PetscSqrtReal(model->mass[k / model->dim]);
    q[k]     = scale[k] > 0 ? FemNoise((PetscInt64)model->gid[k / model->dim] * model->dim + k % model->dim) : 0;
    q_old[k] = 0;
  }
  FrameFree(model, q);
  beta = FemDot(model, q, q);
  PetscCall(FemSum(model, 1, &beta));
  beta   = PetscSqrtReal(beta);
  *theta = 0;
  for (PetscInt k = 0; k < n; k++) q[k] /= beta > 0 ? beta : 1;
  beta = beta > 0 ? 0 : -1; /* nothing free: omega = 0 */
  for (PetscInt j = 0; j < most && beta >= 0; j++) {
    for (PetscInt k = 0; k < n; k++) y[k] = scale[k] * q[k];
    PetscCall(FemGhosts(model, y));
    model->corotate.linear = PETSC_TRUE;
    PetscCall(FemApply(model, y, r));
    model->corotate.linear = PETSC_FALSE;
    for (PetscInt k = 0; k < n; k++) r[k] *= scale[k];
    FrameFree(model, r);
    for (PetscInt k = 0; k < n; k++) r[k] -= beta * q_old[k];
    a[j] = FemDot(model, r, q);
    PetscCall(FemSum(model, 1, &a[j]));
    for (PetscInt k = 0; k < n; k++) {
      r[k] -= a[j] * q[k];
      q_old[k] = q[k];
    }
    beta = FemDot(model, r, r);
    PetscCall(FemSum(model, 1, &beta));
    b[j] = beta = PetscSqrtReal(beta);
    if (j % 5 == 4 || j + 1 == most || beta <= 1e-12 * PetscAbsReal(a[0])) {
      PetscCall(LargestRitz(j + 1, a, b, theta, &last));
      if (beta * PetscAbsReal(last) <= tolerance * *theta || beta <= 1e-12 * PetscAbsReal(a[0])) break;
    }
    for (PetscInt k = 0; k < n; k++) q[k] = r[k] / beta;
  }
  PetscCall(PetscFree5(scale, q, q_old, r, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetCriticalStep(FemModel model, PetscReal *dt)
{
  PetscReal theta;

  PetscFunctionBegin;
  PetscCheck(model && model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetUp() first");
  *dt = PETSC_MAX_REAL;
  if (model->method != FEM_EXPLICIT) PetscFunctionReturn(PETSC_SUCCESS);
  if (!(model->critical > 0)) {
    PetscCall(PetscLogEventBegin(FEM_Eigen, 0, 0, 0, 0));
    PetscCall(LargestEigenvalue(model, 1e-3, &theta)); /* 0.05 % of the step, well inside the promised 1 % */
    model->critical = theta > 0 ? 2 / PetscSqrtReal(theta * (1 + model->local)) : PETSC_MAX_REAL; /* local drag: see (4.13) */
    PetscCall(PetscLogEventEnd(FEM_Eigen, 0, 0, 0, 0));
  }
  *dt = model->critical;
  PetscFunctionReturn(PETSC_SUCCESS);
}
