/*
  fem_contact_solve.c - equilibrium against planes, by a matrix: each node of the group is clear of its plane or pushed by it, never both; with friction it
  sticks or slides.  Static and implicit steps.  Eqs (2.127)-(2.135)

  The matrix of all static steps is K with a spring at every node that may touch, taken out again on the right-hand side, so that a body held by planes alone
  has a factor too, and one factor serves all steps. An implicit step has inertia and needs no springs. What the nodes do under unit pushes is worked out once;
  which of them touch, stick and slide is then found among few numbers.

  An entry is a node and its plane, with `parts` directions: the normal, and where any plane has friction those along the plane.
*/
#include "fem_impl.h"
#include <petscblaslapack.h>

#define MOST_UNKNOWNS 3000 /* of entries that may touch: two square arrays of so many are kept, 144 MB */
#define MOST_ROUNDS   1000
#define PATIENCE      50 /* rounds in which all may change; then one a round, which does not go in circles */

/* Direction d of the plane seen by the node of entry e in its own axes. */
static void IntoAxes(FemModel model, PetscInt e, const PetscReal d[3], PetscReal n[3])
{
  const PetscInt dim = model->dim, f = model->frame_of ? model->frame_of[model->contact.node[e]] : -1;

  for (PetscInt i = 0; i < 3; i++) {
    n[i] = f < 0 ? d[i] : 0;
    for (PetscInt k = 0; k < dim && f >= 0 && i < dim; k++) n[i] += model->frame[(f * dim + i) * dim + k] * d[k];
  }
}

/* Directions of entry e: its normal and, along the plane, first one in which the node is held, if any; idle where it is. */
static void Directions(FemModel model, PetscInt e)
{
  FemContact      *c    = &model->contact;
  const PetscInt   dim  = model->dim, k = c->node[e] * dim, f = model->frame_of ? model->frame_of[c->node[e]] : -1;
  const PetscReal *n    = c->plane[c->of[e]].normal;
  PetscReal       *d    = &c->direction[3 * c->parts * e];
  char            *idle = &c->idle[c->parts * e];
  PetscInt         held = 0, least = 0;

  for (PetscInt i = 0; i < 3; i++) d[i] = n[i];
  if (c->parts == 1) return;
  for (PetscInt i = 0; i < dim; i++) {
    if (FemHeld(model, k + i) < 0) continue;
    for (PetscInt j = 0; j < 3 && !held; j++) d[3 + j] = j >= dim ? 0 : f < 0 ? j == i : model->frame[(f * dim + i) * dim + j];
    held++;
  }
  if (!held && dim == 3) { /* any direction along the plane */
    PetscReal size = 0;

    for (PetscInt i = 1; i < 3; i++)
      if (PetscAbsReal(n[i]) < PetscAbsReal(n[least])) least = i;
    for (PetscInt i = 0; i < 3; i++) {
      d[3 + i] = (i == least) - n[least] * n[i];
      size += d[3 + i] * d[3 + i];
    }
    for (PetscInt i = 0; i < 3; i++) d[3 + i] /= PetscSqrtReal(size);
  }
  if (dim == 2) {
    d[3] = -n[1];
    d[4] = n[0];
    d[5] = 0;
  } else
    for (PetscInt i = 0; i < 3; i++) d[6 + i] = n[(i + 1) % 3] * d[3 + (i + 2) % 3] - n[(i + 2) % 3] * d[3 + (i + 1) % 3];
  for (PetscInt p = 1; p < c->parts; p++) idle[p] = held >= p;
}

PetscErrorCode FemContactSolveSetUp(FemModel model)
{
  FemContact *c = &model->contact;
  PetscMPIInt n = (PetscMPIInt)c->n;

  PetscFunctionBegin;
  c->parts = 1;
  for (PetscInt p = 0; p < c->n_planes; p++)
    if (c->plane[p].friction > 0) c->parts = model->dim;
  PetscCall(PetscCalloc2(c->n, &c->spring, model->size + 1, &c->begin));
  PetscCall(PetscCalloc5(3 * c->parts * c->n, &c->direction, c->parts * c->n, &c->idle, c->parts * c->n, &c->before, c->n, &c->stiff, c->n, &c->state));
  for (PetscInt e = 0; e < c->n; e++) Directions(model, e);
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, c->begin + 1, 1, MPI_INT, model->comm));
  for (PetscMPIInt r = 0; r < model->size; r++) c->begin[r + 1] += c->begin[r];
  BaseCheckInput(c->begin[model->size] * c->parts <= MOST_UNKNOWNS, model->comm, "%d nodes may meet a plane; a static or implicit step finds those that touch among %d at most: name a smaller group, the side near the plane",
                 (int)c->begin[model->size], MOST_UNKNOWNS / (int)c->parts);
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

/* How stiff the matrix with these rows is at each entry across the plane, by which motions and pushes are weighed against each other; its flexibility is that of another. */
static PetscErrorCode Weigh(FemModel model, const PetscReal *value)
{
  FemContact    *c   = &model->contact;
  const PetscInt dim = model->dim;

  PetscFunctionBegin;
  PetscCall(PetscFree(c->flexible));
  for (PetscInt e = 0; e < c->n; e++) {
    const PetscReal *n     = c->plane[c->of[e]].normal;
    const PetscReal *block = &value[(size_t)FemRowsColumn(model, c->node[e], c->node[e]) * dim * dim];

    c->stiff[e] = c->spring[e] = 0;
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) c->stiff[e] += n[i] * block[i * dim + j] * n[j];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemContactWeigh(FemModel model, const PetscReal *value)
{
  return model->contact.n_planes ? Weigh(model, value) : PETSC_SUCCESS;
}

/* Springs on the diagonal blocks of value, in the pattern of rows and along x, y, z: as stiff as the node itself.  Eq. (2.127) */
PetscErrorCode FemContactStiffen(FemModel model, PetscReal *value)
{
  FemContact    *c   = &model->contact;
  const PetscInt dim = model->dim;

  PetscFunctionBegin;
  if (!c->n_planes) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Weigh(model, value));
  for (PetscInt e = 0; e < c->n; e++) {
    PetscReal *block = &value[(size_t)FemRowsColumn(model, c->node[e], c->node[e]) * dim * dim];

    c->spring[e] = c->stiff[e];
    for (PetscInt p = 0; p < c->parts; p++) {
      const PetscReal *d = &c->direction[3 * (c->parts * e + p)];

      for (PetscInt i = 0; i < dim && !c->idle[c->parts * e + p]; i++)
        for (PetscInt j = 0; j < dim; j++) block[i * dim + j] += c->spring[e] * d[i] * d[j];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From this rank's entries to all, on every rank; width numbers each. */
static PetscErrorCode GatherEntries(FemModel model, PetscInt width, const PetscReal *own, PetscReal *all)
{
  PetscMPIInt *count, *at;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(model->size, &count, model->size, &at));
  for (PetscMPIInt r = 0; r < model->size; r++) {
    count[r] = (PetscMPIInt)width * (model->contact.begin[r + 1] - model->contact.begin[r]);
    at[r]    = (PetscMPIInt)width * model->contact.begin[r];
  }
  PetscCallMPI(MPI_Allgatherv(own, (PetscMPIInt)(width * model->contact.n), MPIU_REAL, all, count, at, MPIU_REAL, model->comm));
  PetscCall(PetscFree2(count, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Motion of this rank's entries in their directions, from the solution. */
static PetscErrorCode ReadMotion(FemModel model, PetscReal *motion)
{
  const FemContact  *c = &model->contact;
  const PetscScalar *x;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(model->solution, &x));
  for (PetscInt k = 0; k < c->n * c->parts; k++) {
    PetscReal n[3];

    IntoAxes(model, k / c->parts, &c->direction[3 * k], n);
    motion[k] = 0;
    for (PetscInt d = 0; d < model->dim; d++) motion[k] += n[d] * x[c->node[k / c->parts] * model->dim + d];
  }
  PetscCall(VecRestoreArrayRead(model->solution, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rhs += pushes in their directions; push [n][parts] of this rank's entries */
static PetscErrorCode AddPushes(FemModel model, const PetscReal *push)
{
  const FemContact *c = &model->contact;
  PetscScalar      *b;

  PetscFunctionBegin;
  PetscCall(VecGetArray(model->rhs, &b));
  for (PetscInt k = 0; k < c->n * c->parts; k++) {
    PetscReal n[3];

    if (c->idle[k]) continue;
    IntoAxes(model, k / c->parts, &c->direction[3 * k], n);
    for (PetscInt d = 0; d < model->dim; d++) b[c->node[k / c->parts] * model->dim + d] += push[k] * n[d];
  }
  PetscCall(VecRestoreArray(model->rhs, &b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* flexible [M][M], M = parts x entries: how each moves under a unit push on one; solved for once, with the factor there is. */
static PetscErrorCode FindFlexibility(FemModel model)
{
  FemContact    *c = &model->contact;
  const PetscInt M = c->begin[model->size] * c->parts, first = c->begin[model->rank] * c->parts, n = c->n * c->parts;
  PetscReal     *motion, *unit;
  Vec            rhs, solution;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1((size_t)M * M, &c->flexible));
  PetscCall(PetscMalloc2(n, &motion, n, &unit));
  PetscCall(VecDuplicate(model->rhs, &rhs));
  PetscCall(VecDuplicate(model->solution, &solution));
  PetscCall(VecCopy(model->rhs, rhs));
  PetscCall(VecCopy(model->solution, solution));
  for (PetscInt j = 0; j < M; j++) {
    for (PetscInt k = 0; k < n; k++) unit[k] = first + k == j ? 1 : 0;
    PetscCall(VecZeroEntries(model->rhs));
    PetscCall(VecZeroEntries(model->solution));
    PetscCall(AddPushes(model, unit));
    PetscCall(FemSolverSolve(model));
    PetscCall(ReadMotion(model, motion));
    PetscCall(GatherEntries(model, c->parts, motion, &c->flexible[(size_t)j * M]));
  }
  PetscCall(VecCopy(rhs, model->rhs));
  PetscCall(VecCopy(solution, model->solution));
  PetscCall(VecDestroy(&rhs));
  PetscCall(VecDestroy(&solution));
  PetscCall(PetscFree2(motion, unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All entries of the body, the same on every rank; parts numbers each: along the normal, then along the plane. */
typedef struct {
  PetscInt         N, P, M; /* entries, parts, N*P */
  const PetscReal *W;       /* [M][M] motion under unit pushes [m/N], symmetric */
  PetscReal       *a;       /* [M] motion without pushes [m] */
  PetscReal       *aim;     /* [M] motion of a node that touches and sticks [m] */
  PetscReal       *spring, *stiff, *friction; /* [N] */
  PetscReal       *idle;    /* [M] held along this direction */
  PetscReal       *m, *x, *push; /* [M] push with the spring's share, motion, push */
  PetscReal       *tau, *shrink; /* [M], [N] of sliding: direction of friction; how much a change of it turns it */
  char            *state;   /* [N] */
} Problem;

/* One row of A m = b as a combination p m + q x of the entry's own push and motion, x = a + W m.  A is column-major, of the listed unknowns. */
static void AddToRow(const Problem *s, PetscInt n, const PetscInt *list, PetscInt row, PetscInt of, PetscReal p, PetscReal q, PetscReal *A, PetscReal *b)
{
  for (PetscInt j = 0; j < n; j++) A[(size_t)j * n + row] += (list[j] == of ? p : 0) + q * s->W[(size_t)list[j] * s->M + of];
  b[row] -= q * s->a[of];
}

/* The pushes that this guess of states has: linear.  Eqs (2.128), (2.129), (2.133), (2.134). False: singular. */
static PetscErrorCode SolveGuess(const Problem *s, PetscReal *A, PetscInt *list, PetscBLASInt *pivot, PetscReal *b, PetscBool *singular)
{
  PetscInt     n = 0;
  PetscBLASInt size, one = 1, info = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->M; k++) {
    s->m[k] = 0;
    if (s->idle[k] == 0 && (s->state[k / s->P] != FEM_CLEAR || s->spring[k / s->P] > 0)) list[n++] = k;
  }
  PetscCall(PetscArrayzero(A, (size_t)n * n));
  for (PetscInt r = 0; r < n; r++) {
    const PetscInt  k = list[r], e = k / s->P, first = e * s->P;
    const PetscReal spring = s->spring[e], stiff = s->stiff[e], mu = s->friction[e];

    b[r] = 0;
    if (s->state[e] == FEM_CLEAR) AddToRow(s, n, list, r, k, 1, -spring, A, b);
    else if (k == first || (s->state[e] == FEM_STICK && mu > 0)) {
      AddToRow(s, n, list, r, k, 0, stiff, A, b);
      b[r] += stiff * s->aim[k];
    } else { /* T - mu N tau - shrink (1 - tau tau')(T - stiff (x - aim)) = 0 */
      AddToRow(s, n, list, r, k, 1, -spring, A, b);
      if (mu > 0) AddToRow(s, n, list, r, first, -mu * s->tau[k], mu * s->tau[k] * spring, A, b);
      for (PetscInt j = first + 1; j < first + s->P && mu > 0 && s->shrink[e] > 0; j++) {
        const PetscReal share = s->shrink[e] * ((j == k) - s->tau[k] * s->tau[j]);

        if (s->idle[j] > 0) continue;
        AddToRow(s, n, list, r, j, -share, share * (spring + stiff), A, b);
        b[r] += share * stiff * s->aim[j];
      }
    }
  }
  size = (PetscBLASInt)n;
  if (n) PetscCallBLAS("LAPACKgesv", LAPACKgesv_(&size, &one, A, &size, pivot, b, &size, &info));
  PetscCheck(info >= 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK gesv returned %d", (int)info);
  *singular = info ? PETSC_TRUE : PETSC_FALSE;
  for (PetscInt r = 0; r < n; r++) s->m[list[r]] = b[r];
  for (PetscInt k = 0; k < s->M; k++) {
    s->x[k] = s->a[k];
    for (PetscInt r = 0; r < n; r++) s->x[k] += s->W[(size_t)list[r] * s->M + k] * b[r];
    s->push[k] = s->idle[k] > 0 || s->state[k / s->P] == FEM_CLEAR ? 0 : s->m[k] - s->spring[k / s->P] * s->x[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  What entry e should be after this answer (2.130), (2.135), with tau and shrink of a node that slides. Returns whether anything changed.

  A node that comes to the plane sticks or slides by the forces that would undo its motion past and along the plane, a node that touches by those it has.
  least: forces below are round-off [N]; close: of a node that comes.
*/
static PetscBool Judge(Problem *s, PetscInt e, PetscReal least, PetscReal close)
{
  const PetscInt  first = e * s->P;
  const PetscBool comes = s->state[e] == FEM_CLEAR ? PETSC_TRUE : PETSC_FALSE;
  const PetscReal N = comes ? s->stiff[e] * (s->aim[first] - s->x[first]) : s->push[first], limit = s->friction[e] * N;
  PetscReal       star[3] = {0, 0, 0}, size = 0, turn = 0;
  char            want    = (comes ? N > close : N >= -least) ? FEM_STICK : FEM_CLEAR;

  for (PetscInt p = 1; p < s->P && want != FEM_CLEAR && s->friction[e] > 0; p++) {
    const PetscInt k = first + p;

    if (s->idle[k] > 0) continue;
    star[p] = s->push[k] - (s->state[e] != FEM_STICK ? s->stiff[e] * (s->x[k] - s->aim[k]) : 0);
    size += star[p] * star[p];
  }
  size = PetscSqrtReal(size);
  if (want != FEM_CLEAR && size > limit + least) {
    want         = FEM_SLIDE;
    s->shrink[e] = PetscMax(0, PetscMin(1, limit / size));
    for (PetscInt p = 1; p < s->P; p++) {
      turn += PetscSqr(star[p] / size - s->tau[first + p]);
      s->tau[first + p] = star[p] / size;
    }
  }
  if (want == s->state[e]) return want == FEM_SLIDE && turn > 1e-20 && limit > least ? PETSC_TRUE : PETSC_FALSE;
  s->state[e] = want;
  return PETSC_TRUE;
}

static PetscErrorCode FindStates(FemModel model, Problem *s)
{
  PetscReal    *A, *b, most = 0;
  PetscInt     *list, round, wrong = 1, patience = PATIENCE;
  PetscBLASInt *pivot;
  PetscBool     singular = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4((size_t)s->M * s->M, &A, s->M, &list, s->M, &pivot, s->M, &b));
  for (PetscInt k = 0; k < s->M; k++) most = PetscMax(most, s->stiff[k / s->P] * (PetscAbsReal(s->a[k]) + PetscAbsReal(s->aim[k])));
  for (round = 0; round < MOST_ROUNDS && wrong; round++) {
    PetscReal largest = 0, hardest = 0;

    PetscCall(SolveGuess(s, A, list, pivot, b, &singular));
    for (PetscInt k = 0; k < s->M; k++) {
      largest = PetscMax(largest, PetscAbsReal(s->m[k]));
      hardest = PetscMax(hardest, PetscAbsReal(s->push[k]));
    }
    if ((singular || !(largest <= 1e12 * most)) && patience) { /* a guess in which all slide: begin again with all that touch at rest, and let them go one by one */
      patience = 0;
      wrong    = 1;
      for (PetscInt e = 0; e < s->N; e++)
        if (s->state[e] == FEM_SLIDE) s->state[e] = FEM_STICK;
      continue;
    }
    BaseCheckInput(!singular && largest <= 1e12 * most, model->comm, "%s: the body leaves the plane it meets%s and nothing else holds it; fix it, or press it on", model->source, s->P > 1 ? ", or slides along it," : "");
    wrong = 0;
    for (PetscInt e = 0; e < s->N && !(wrong && round > PATIENCE); e++) wrong += Judge(s, e, 1e-11 * hardest, 1e-11 * PetscMax(hardest, most));
  }
  PetscCall(PetscFree4(A, list, pivot, b));
  PetscCheck(!wrong, model->comm, PETSC_ERR_NOT_CONVERGED, "%s: which nodes touch the plane, stick and slide was not settled in %d rounds; a smaller step may help", model->source, MOST_ROUNDS);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where nodes are along their planes at t, at displacement u: a node that sticks stays there. */
void FemContactBegin(FemModel model, PetscReal t, const PetscReal *u)
{
  FemContact *c = &model->contact;

  for (PetscInt k = 0; k < c->n * c->parts; k++) {
    PetscReal D[3];

    FemPlaneMotion(&c->plane[c->of[k / c->parts]], t, D);
    c->before[k] = 0;
    for (PetscInt d = 0; d < model->dim; d++) c->before[k] += c->direction[3 * k + d] * (u[c->node[k / c->parts] * model->dim + d] - D[d]);
  }
}

/*
  model->solution solves the system of rhs without pushes; makes it that of the body against its planes at t. known [n_own*dim]: displacement the solution
  adds to, NULL: none. normal, push: what the planes put on the nodes, as the matrix sees it.
*/
PetscErrorCode FemContactSolve(FemModel model, PetscReal t, const PetscReal *known)
{
  FemContact    *c = &model->contact;
  const PetscInt dim = model->dim, P = c->parts, N = c->n_planes ? c->begin[model->size] : 0, M = N * P, first = N ? c->begin[model->rank] * P : 0, n = c->n * P;
  PetscReal     *own, *aim, *flag, least = PETSC_MAX_REAL;
  PetscInt       any = 0, nearest = 0;
  Problem        s = {N, P, M, .state = NULL};

  PetscFunctionBegin;
  if (!N) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc3(n, &own, n, &aim, n, &flag));
  PetscCall(PetscCalloc7(M, &s.a, M, &s.aim, M, &s.idle, M, &s.m, M, &s.x, M, &s.push, M, &s.tau));
  PetscCall(PetscCalloc5(N, &s.spring, N, &s.stiff, N, &s.friction, N, &s.shrink, N, &s.state));
  PetscCall(ReadMotion(model, own));
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt e = k / P;
    PetscReal      D[3];

    FemPlaneMotion(&c->plane[c->of[e]], t, D);
    aim[k] = k % P ? c->before[k] : -c->gap[e];
    for (PetscInt d = 0; d < dim; d++) {
      aim[k] += c->direction[3 * k + d] * D[d];
      if (known) own[k] += c->direction[3 * k + d] * known[c->node[e] * dim + d];
    }
    flag[k] = c->idle[k];
  }
  PetscCall(GatherEntries(model, P, own, s.a));
  PetscCall(GatherEntries(model, P, aim, s.aim));
  PetscCall(GatherEntries(model, P, flag, s.idle));
  PetscCall(GatherEntries(model, 1, c->spring, s.spring));
  PetscCall(GatherEntries(model, 1, c->stiff, s.stiff));
  for (PetscInt e = 0; e < c->n; e++) flag[e] = c->plane[c->of[e]].friction;
  PetscCall(GatherEntries(model, 1, flag, s.friction));
  for (PetscInt k = 0; k < M; k++) s.x[k] = s.a[k];
  for (PetscInt e = 0; e < N; e++) { /* first guess: by the motion without pushes */
    const PetscReal open = s.a[e * P] - s.aim[e * P];

    any += open < 0;
    if (s.spring[e] == 0) (void)Judge(&s, e, 0, 0);
    else if (open < 0) s.state[e] = FEM_STICK;
    if (open < least) {
      least   = open;
      nearest = e;
    }
  }
  if (!any && s.spring[nearest] > 0) s.state[nearest] = FEM_STICK;
  if (any || s.spring[nearest] > 0) {
    if (!c->flexible) PetscCall(FindFlexibility(model));
    s.W = c->flexible;
    PetscCall(FindStates(model, &s));
    PetscCall(AddPushes(model, &s.m[first]));
    PetscCall(FemSolverSolve(model));
  }
  c->touching = PETSC_FALSE;
  for (PetscInt e = 0; e < N; e++)
    if (s.state[e] != FEM_CLEAR) c->touching = PETSC_TRUE;
  for (PetscInt e = 0; e < c->n; e++) {
    c->normal[e] = s.push[first + e * P];
    c->state[e]  = s.state[first / P + e];
    for (PetscInt d = 0; d < dim; d++) {
      c->push[3 * e + d] = 0;
      for (PetscInt p = 0; p < P; p++) c->push[3 * e + d] += s.push[first + e * P + p] * c->direction[3 * (e * P + p) + d];
    }
  }
  PetscCall(PetscFree3(own, aim, flag));
  PetscCall(PetscFree7(s.a, s.aim, s.idle, s.m, s.x, s.push, s.tau));
  PetscCall(PetscFree5(s.spring, s.stiff, s.friction, s.shrink, s.state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Work of pushes over a step from old_u [n_own*dim] at `from` to now at `to`: push [n][3], normal [n] of them across.  Eq. (2.131)

   sum [3] += across the planes, along them, of their own motion; of this rank */
void FemContactWork(FemModel model, PetscReal from, PetscReal to, const PetscReal *old_u, const PetscReal *push, const PetscReal *normal, PetscReal sum[3])
{
  const FemContact *c = &model->contact;

  for (PetscInt e = 0; e < c->n; e++) {
    const FemPlane *plane = &c->plane[c->of[e]];
    PetscReal       D0[3], D1[3];

    FemPlaneMotion(plane, from, D0);
    FemPlaneMotion(plane, to, D1);
    for (PetscInt d = 0; d < model->dim; d++) {
      const PetscInt  k    = c->node[e] * model->dim + d;
      const PetscReal slip = model->u[k] - old_u[k] - (D1[d] - D0[d]), across = normal[e] * plane->normal[d];

      sum[0] += across * slip;
      sum[1] += (push[3 * e + d] - across) * slip;
      sum[2] += push[3 * e + d] * (D1[d] - D0[d]);
    }
  }
}
