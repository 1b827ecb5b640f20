/*
  fem_contact_static.c - equilibrium against planes: each node of the group is clear of its plane or pushed by it, never both.  Eqs (2.127)-(2.130)

  The matrix of all steps is K with a spring at every node that may touch, taken out again on the right-hand side, so that a body held by planes alone has
  a factor too, and one factor serves all steps. What the nodes do under unit pushes is worked out once; which of them touch is then found among few numbers.
*/
#include "fem_impl.h"
#include <petscblaslapack.h>

#define MOST_NODES 3000 /* that may touch: two square arrays of so many are kept, 144 MB */
#define MOST_ROUNDS 200

/* The plane's normal seen by the node of entry e in its own axes. */
static void NormalInFrame(FemModel model, PetscInt e, PetscReal n[3])
{
  const FemContact *c   = &model->contact;
  const PetscInt    dim = model->dim, f = model->frame_of ? model->frame_of[c->node[e]] : -1;

  for (PetscInt i = 0; i < 3; i++) {
    n[i] = f < 0 ? c->plane[c->of[e]].normal[i] : 0;
    for (PetscInt d = 0; d < dim && f >= 0 && i < dim; d++) n[i] += model->frame[(f * dim + i) * dim + d] * c->plane[c->of[e]].normal[d];
  }
}

PetscErrorCode FemContactStaticSetUp(FemModel model)
{
  FemContact *c = &model->contact;
  PetscMPIInt n = (PetscMPIInt)c->n;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(c->n, &c->spring, model->size + 1, &c->begin));
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, c->begin + 1, 1, MPI_INT, model->comm));
  for (PetscMPIInt r = 0; r < model->size; r++) c->begin[r + 1] += c->begin[r];
  BaseCheckInput(c->begin[model->size] <= MOST_NODES, model->comm, "%d nodes may meet a plane; a static step finds those that touch among %d at most: name a smaller group, the side near the plane", (int)c->begin[model->size], MOST_NODES);
  for (PetscInt p = 0; p < c->n_planes; p++) {
    const FemGroup *group = &model->group[c->plane[p].group];
    PetscInt        eight = 0;

    for (PetscInt k = 0; k < group->n_facets; k++) {
      const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[group->facet_cell[k]]);

      eight += shape->face_nodes[group->facet_face[k]] == 8;
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &eight, 1, MPIU_INT, MPI_SUM, model->comm));
    BaseCheckInput(!eight, model->comm, "%s: group '%s' has sides of eight nodes, whose corners carry an even pressure with forces that pull; meet a plane with linear elements, tetrahedra or hexahedra of 27 nodes (mesh.incomplete: false)",
                   model->source, group->name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Springs on the diagonal blocks of value, in the pattern of rows and along x, y, z: as stiff as the node itself.  Eq. (2.127) */
void FemContactStiffen(FemModel model, PetscReal *value)
{
  FemContact    *c   = &model->contact;
  const PetscInt dim = model->dim;

  for (PetscInt e = 0; e < c->n; e++) {
    const PetscReal *n     = c->plane[c->of[e]].normal;
    PetscReal       *block = &value[(size_t)FemRowsColumn(model, c->node[e], c->node[e]) * dim * dim];

    c->spring[e] = 0;
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) c->spring[e] += n[i] * block[i * dim + j] * n[j];
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) block[i * dim + j] += c->spring[e] * n[i] * n[j];
  }
}

/* From this rank's entries to all, on every rank. */
static PetscErrorCode GatherEntries(FemModel model, const PetscReal *own, PetscReal *all)
{
  PetscMPIInt *count;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(model->size, &count));
  for (PetscMPIInt r = 0; r < model->size; r++) count[r] = model->contact.begin[r + 1] - model->contact.begin[r];
  PetscCallMPI(MPI_Allgatherv(own, (PetscMPIInt)model->contact.n, MPIU_REAL, all, count, model->contact.begin, MPIU_REAL, model->comm));
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Motion across the planes of this rank's entries, from the solution. */
static PetscErrorCode ReadAcross(FemModel model, PetscReal *across)
{
  const PetscScalar *x;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(model->solution, &x));
  for (PetscInt e = 0; e < model->contact.n; e++) {
    PetscReal n[3];

    NormalInFrame(model, e, n);
    across[e] = 0;
    for (PetscInt d = 0; d < model->dim; d++) across[e] += n[d] * x[model->contact.node[e] * model->dim + d];
  }
  PetscCall(VecRestoreArrayRead(model->solution, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rhs += pushes across planes; push [n] of this rank's entries */
static PetscErrorCode AddPushes(FemModel model, const PetscReal *push)
{
  PetscScalar *b;

  PetscFunctionBegin;
  PetscCall(VecGetArray(model->rhs, &b));
  for (PetscInt e = 0; e < model->contact.n; e++) {
    PetscReal n[3];

    NormalInFrame(model, e, n);
    for (PetscInt d = 0; d < model->dim; d++) b[model->contact.node[e] * model->dim + d] += push[e] * n[d];
  }
  PetscCall(VecRestoreArray(model->rhs, &b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* flexible [N][N]: what each does across its plane under a unit push on one; solved for once, with the factor there is. */
static PetscErrorCode FindFlexibility(FemModel model)
{
  FemContact    *c     = &model->contact;
  const PetscInt N     = c->begin[model->size], first = c->begin[model->rank];
  PetscReal     *across, *unit;
  Vec            keep;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1((size_t)N * N, &c->flexible));
  PetscCall(PetscMalloc2(c->n, &across, c->n, &unit));
  PetscCall(VecDuplicate(model->rhs, &keep));
  PetscCall(VecCopy(model->rhs, keep));
  for (PetscInt j = 0; j < N; j++) {
    for (PetscInt e = 0; e < c->n; e++) unit[e] = first + e == j ? 1 : 0;
    PetscCall(VecZeroEntries(model->rhs));
    PetscCall(VecZeroEntries(model->solution));
    PetscCall(AddPushes(model, unit));
    PetscCall(FemSolverSolve(model));
    PetscCall(ReadAcross(model, across));
    PetscCall(GatherEntries(model, across, &c->flexible[(size_t)j * N]));
  }
  PetscCall(VecCopy(keep, model->rhs));
  PetscCall(VecDestroy(&keep));
  PetscCall(PetscFree2(across, unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Which entries touch: m [N] out, push with the spring's share; push [N] out, lambda.  Eqs (2.128)-(2.130)

  a [N] motion across the planes without pushes, gap [N] at that time without motion, spring [N], touch [N] in/out the first guess and the answer.
  For a guess (2.128) and (2.129) are linear in m; whoever pulls or passes its plane is then told otherwise, until none does.
*/
static PetscErrorCode FindTouching(FemModel model, PetscInt N, const PetscReal *a, const PetscReal *gap, const PetscReal *spring, char *touch, PetscReal *m, PetscReal *push)
{
  const PetscReal *W = model->contact.flexible;
  PetscReal       *A, most = 0;
  PetscBLASInt    *pivot, n = (PetscBLASInt)N, one = 1, info;
  PetscInt         round, wrong = 1;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2((size_t)N * N, &A, N, &pivot));
  for (round = 0; round < MOST_ROUNDS && wrong; round++) {
    PetscReal largest = 0, deepest = 0;

    for (PetscInt i = 0; i < N; i++) { /* column-major; W is symmetric */
      for (PetscInt j = 0; j < N; j++) A[(size_t)j * N + i] = touch[i] ? spring[i] * W[(size_t)j * N + i] : (i == j) - spring[i] * W[(size_t)j * N + i];
      m[i] = touch[i] ? -spring[i] * (gap[i] + a[i]) : spring[i] * a[i];
    }
    PetscCallBLAS("LAPACKgesv", LAPACKgesv_(&n, &one, A, &n, pivot, m, &n, &info));
    PetscCheck(info >= 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK gesv returned %d", (int)info);
    for (PetscInt i = 0; i < N && !info; i++) {
      push[i] = a[i];
      for (PetscInt j = 0; j < N; j++) push[i] += W[(size_t)j * N + i] * m[j]; /* motion across */
      most    = PetscMax(most, spring[i] * (PetscAbsReal(a[i]) + PetscAbsReal(gap[i])));
      largest = PetscMax(largest, PetscAbsReal(m[i]));
    }
    BaseCheckInput(!info && largest <= 1e12 * most, model->comm, "%s: the body leaves the plane it meets and nothing else holds it; fix it, or press it on", model->source);
    wrong = 0;
    for (PetscInt i = 0; i < N; i++) {
      const PetscReal open = gap[i] + push[i];

      push[i] = m[i] - spring[i] * push[i];
      deepest = PetscMax(deepest, PetscAbsReal(push[i]));
      if (!touch[i]) push[i] = -spring[i] * open; /* > 0 where it passes */
    }
    for (PetscInt i = 0; i < N; i++) {
      const char want = touch[i] ? push[i] >= -1e-11 * deepest : push[i] > 1e-11 * PetscMax(deepest, most);

      wrong += want != touch[i];
      if (!touch[i]) push[i] = 0;
      touch[i] = want;
    }
  }
  PetscCall(PetscFree2(A, pivot));
  PetscCheck(!wrong, model->comm, PETSC_ERR_NOT_CONVERGED, "%s: which nodes touch the plane was not settled in %d rounds; a smaller step may help", model->source, MOST_ROUNDS);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* model->solution solves K' x = rhs without pushes; makes it that of the body against its planes at t. */
PetscErrorCode FemContactSolve(FemModel model, PetscReal t)
{
  FemContact    *c = &model->contact;
  const PetscInt N = c->n_planes ? c->begin[model->size] : 0, first = c->n_planes ? c->begin[model->rank] : 0;
  PetscReal     *own, *a, *gap, *spring, *m, *push, least = PETSC_MAX_REAL;
  PetscInt       any = 0, nearest = 0;
  char          *touch;
  Vec            free_motion;

  PetscFunctionBegin;
  if (!N) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc7(c->n, &own, N, &a, N, &gap, N, &spring, N, &m, N, &push, N, &touch));
  PetscCall(ReadAcross(model, own));
  PetscCall(GatherEntries(model, own, a));
  PetscCall(GatherEntries(model, c->spring, spring));
  for (PetscInt e = 0; e < c->n; e++) {
    PetscReal D[3];

    FemPlaneMotion(&c->plane[c->of[e]], t, D);
    own[e] = c->gap[e];
    for (PetscInt d = 0; d < model->dim; d++) own[e] -= c->plane[c->of[e]].normal[d] * D[d];
  }
  PetscCall(GatherEntries(model, own, gap));
  if (!c->flexible) {
    PetscCall(VecDuplicate(model->solution, &free_motion));
    PetscCall(VecCopy(model->solution, free_motion));
    PetscCall(FindFlexibility(model));
    PetscCall(VecCopy(free_motion, model->solution));
    PetscCall(VecDestroy(&free_motion));
  }
  for (PetscInt i = 0; i < N; i++) { /* first guess: the springs alone */
    touch[i] = gap[i] + a[i] < 0;
    any += touch[i];
    if (gap[i] + a[i] < least) {
      least   = gap[i] + a[i];
      nearest = i;
    }
  }
  if (!any) touch[nearest] = 1;
  PetscCall(FindTouching(model, N, a, gap, spring, touch, m, push));
  PetscCall(AddPushes(model, &m[first]));
  PetscCall(FemSolverSolve(model));
  for (PetscInt e = 0; e < c->n; e++) {
    c->normal[e] = push[first + e];
    for (PetscInt d = 0; d < model->dim; d++) c->push[3 * e + d] = push[first + e] * c->plane[c->of[e]].normal[d];
  }
  PetscCall(PetscFree7(own, a, gap, spring, m, push, touch));
  PetscFunctionReturn(PETSC_SUCCESS);
}
