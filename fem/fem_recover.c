/*
  fem_recover.c - stress at nodes by superconvergent patch recovery (Zienkiewicz and Zhu, Int. J. Numer. Meth. Eng. 33 (1992) 1331).

  Around each corner node, and for each material that meets there, a polynomial of the elements' degree is fitted to the
  stress at the elements' best points. A node on the boundary of its material sees elements on one side only: it takes the
  mean of the polynomials of inner corner nodes it shares an element with, and fits its own patch only if there is none.
  A node between corners takes the mean of what those say. Every patch of an owned node lies wholly on its rank, and
  sums run in global order, so the values do not depend on the number of ranks.  Docs: theory 2.9
*/
#include "fem_recover.h"

enum { FIT_NONE, FIT_SAMPLES, FIT_RULE, FIT_MEAN }; /* best points; points of a whole rule, for flat patches; the mean */
#define FLAT 1e-3 /* of what is left of a term, squared, after those before it: points in a line or plane, or nearly; a fit magnifies errors by its inverse */

/* ---- exchange ---- */

/* Numbers of owned nodes to their ghosts. */
static PetscErrorCode ToGhosts(FemModel model, MPI_Datatype type, PetscInt m, void *data)
{
  MPI_Datatype unit;

  PetscFunctionBegin;
  if (model->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Type_contiguous((PetscMPIInt)m, type, &unit));
  PetscCallMPI(MPI_Type_commit(&unit));
  PetscCall(PetscSFBcastBegin(model->ghosts, unit, data, data, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(model->ghosts, unit, data, data, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Flags of ghosts to their owners, who or them. */
static PetscErrorCode ToOwners(FemModel model, PetscInt m, PetscInt *flag)
{
  PetscInt *ghost;

  PetscFunctionBegin;
  if (model->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(model->n_loc, &ghost));
  for (PetscInt k = 0; k < m; k++) { /* one number at a time: MPI's maximum knows no vectors of ours */
    PetscInt *own;

    PetscCall(PetscMalloc1(model->n_loc, &own));
    for (PetscInt i = 0; i < model->n_loc; i++) own[i] = ghost[i] = flag[i * m + k];
    PetscCall(PetscSFReduceBegin(model->ghosts, MPIU_INT, ghost, own, MPI_MAX));
    PetscCall(PetscSFReduceEnd(model->ghosts, MPIU_INT, ghost, own, MPI_MAX));
    for (PetscInt i = 0; i < model->n_own; i++) flag[i * m + k] = own[i];
    PetscCall(PetscFree(own));
  }
  PetscCall(PetscFree(ghost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- stress of an element ---- */

void FemCellPlaces(FemModel model, PetscInt cell, PetscReal *x)
{
  const PetscInt *node = &model->cell_node[model->cell_start[cell]], n = model->cell_start[cell + 1] - model->cell_start[cell];

  for (PetscInt a = 0; a < n; a++)
    for (PetscInt d = 0; d < model->dim; d++) x[a * model->dim + d] = model->x[node[a] * model->dim + d];
}

void FemReadCell(FemModel model, PetscInt cell, PetscBool own, FemReading *reading)
{
  reading->cell = cell;
  FemCellPlaces(model, cell, reading->x);
  FemCellGather(model, cell, model->u, reading->u);
  if (model->corotate.on) {
    PetscReal u[FEM_MAX_DOFS];

    FemCellGather(model, cell, model->u, u);
    FemCorotateSee(model, cell, u, reading->u, reading->turn);
  }
  reading->own.kind = FEM_OWN_NONE;
  if (own || FemCellKind(model, cell) == FEM_OWN_VOLUME) FemCellOwn(model, cell, reading->u, &reading->own);
}

PetscReal FemRawStress(FemModel model, const FemReading *reading, const FemPoints *points, PetscInt q, PetscReal *s, PetscReal at[3])
{
  const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[reading->cell]);
  const PetscInt  dim   = model->dim;
  PetscReal       dN[FEM_MAX_DOFS], h[3][3] = {{0}}, e[6];
  const PetscReal det = FemPointMap(shape, reading->x, points->N[q], points->grad[q], dN, at);

  for (PetscInt a = 0; a < shape->nodes; a++)
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) h[i][j] += reading->u[a * dim + i] * dN[a * dim + j];
  for (PetscInt i = 0; i < 3; i++) {
    e[i]     = h[i][i];
    e[3 + i] = h[i][(i + 1) % 3] + h[(i + 1) % 3][i];
  }
  FemOwnAdd(shape, &model->law[model->cell_material[reading->cell]], &reading->own, points->xi[q], det, at, e);
  FemStressOf(dim, &model->law[model->cell_material[reading->cell]], e, s);
  if (model->corotate.on) { /* eq. (2.89) */
    PetscReal six[6] = {0};

    for (PetscInt i = 0; i < FEM_PARTS(dim); i++) six[dim == 2 && i == 2 ? 3 : i] = s[i];
    FemTurnStress(reading->turn, six);
    for (PetscInt i = 0; i < FEM_PARTS(dim); i++) s[i] = six[dim == 2 && i == 2 ? 3 : i];
  }
  return det;
}

/* ---- polynomials ---- */

/* 1, x, y, (z), then products of two.  Eq. (2.90) */
static void Basis(PetscInt dim, PetscInt terms, const PetscReal *r, PetscReal *P)
{
  PetscInt m = dim + 1;

  P[0] = 1;
  for (PetscInt i = 0; i < dim; i++) P[1 + i] = r[i];
  if (terms > dim + 1)
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = i; j < dim; j++) P[m++] = r[i] * r[j];
}

/* Adds to `sum` the polynomial about a place t away: P(r + t) written in r. */
static void AddMoved(PetscInt dim, PetscInt terms, PetscInt parts, const PetscReal *poly, const PetscReal *t, PetscReal *sum)
{
  PetscReal P[FEM_TERMS];

  Basis(dim, terms, t, P);
  for (PetscInt c = 0; c < parts; c++) {
    PetscInt m = dim + 1;

    for (PetscInt k = 0; k < terms; k++) sum[c] += poly[k * parts + c] * P[k];
    for (PetscInt i = 0; i < dim; i++) sum[(1 + i) * parts + c] += poly[(1 + i) * parts + c];
    if (terms == dim + 1) continue;
    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = i; j < dim; j++, m++) { /* (r_i + t_i)(r_j + t_j) */
        sum[m * parts + c] += poly[m * parts + c];
        sum[(1 + i) * parts + c] += poly[m * parts + c] * t[j];
        sum[(1 + j) * parts + c] += poly[m * parts + c] * t[i];
      }
  }
}

/*
  Least squares in n points.  Eq. (2.91)

  r [n][3] places from the node; s [n][parts] (NULL: only asked whether it can be done)
  poly [terms][parts] out. False when the points are too few or flat. Terms are scaled to the points' own spread, then to a unit diagonal.
*/
static PetscBool Fit(PetscInt dim, PetscInt terms, PetscInt parts, PetscInt n, const PetscReal *r, const PetscReal *s, PetscReal *poly)
{
  PetscReal A[FEM_TERMS][FEM_TERMS] = {{0}}, b[FEM_TERMS][6] = {{0}}, P[FEM_TERMS], scale[FEM_TERMS], unit[3] = {0, 0, 0};

  if (n < terms) return PETSC_FALSE;
  for (PetscInt q = 0; q < n; q++)
    for (PetscInt d = 0; d < dim; d++) unit[d] = PetscMax(unit[d], PetscAbsReal(r[3 * q + d]));
  for (PetscInt d = 0; d < dim; d++)
    if (!(unit[d] > 0)) return PETSC_FALSE;
  for (PetscInt q = 0; q < n; q++) {
    PetscReal t[3];

    for (PetscInt d = 0; d < dim; d++) t[d] = r[3 * q + d] / unit[d];
    Basis(dim, terms, t, P);
    for (PetscInt i = 0; i < terms; i++) {
      for (PetscInt j = 0; j <= i; j++) A[i][j] += P[i] * P[j];
      for (PetscInt c = 0; c < parts && s; c++) b[i][c] += P[i] * s[q * parts + c];
    }
  }
  for (PetscInt i = 0; i < terms; i++) scale[i] = 1 / PetscSqrtReal(A[i][i]);
  for (PetscInt i = 0; i < terms; i++) { /* Cholesky */
    for (PetscInt j = 0; j <= i; j++) {
      PetscReal sum = A[i][j] * scale[i] * scale[j];

      for (PetscInt k = 0; k < j; k++) sum -= A[i][k] * A[j][k];
      if (i == j) {
        if (!(sum > FLAT)) return PETSC_FALSE;
        A[i][i] = PetscSqrtReal(sum);
      } else A[i][j] = sum / A[j][j];
    }
  }
  if (!s) return PETSC_TRUE;
  Basis(dim, terms, unit, P);
  for (PetscInt c = 0; c < parts; c++) {
    for (PetscInt i = 0; i < terms; i++) {
      b[i][c] *= scale[i];
      for (PetscInt k = 0; k < i; k++) b[i][c] -= A[i][k] * b[k][c];
      b[i][c] /= A[i][i];
    }
    for (PetscInt i = terms - 1; i >= 0; i--) {
      for (PetscInt k = i + 1; k < terms; k++) b[i][c] -= A[k][i] * b[k][c];
      b[i][c] /= A[i][i];
    }
    for (PetscInt i = 0; i < terms; i++) poly[i * parts + c] = b[i][c] * scale[i] / P[i];
  }
  return PETSC_TRUE;
}

/* ---- what each node does ---- */

PetscInt FemSlotOf(const struct _FemRecovery *r, PetscInt node, PetscInt law)
{
  for (PetscInt k = 0; k < r->sides; k++)
    if (r->side[node * r->sides + k] == law) return node * r->sides + k;
  return -1;
}

static PetscInt LawOf(FemModel model, PetscInt cell)
{
  return model->recovery->law[model->cell_material[cell]];
}

static PetscErrorCode FindAround(FemModel model)
{
  FemRecovery r = model->recovery;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(model->n_own + 1, &r->start));
  for (PetscInt k = 0; k < model->cell_start[model->n_cells]; k++)
    if (model->cell_node[k] < model->n_own) r->start[model->cell_node[k] + 1]++;
  for (PetscInt i = 0; i < model->n_own; i++) r->start[i + 1] += r->start[i];
  PetscCall(PetscMalloc1(r->start[model->n_own], &r->around));
  for (PetscInt c = 0; c < model->n_cells; c++)
    for (PetscInt k = model->cell_start[c]; k < model->cell_start[c + 1]; k++)
      if (model->cell_node[k] < model->n_own) r->around[r->start[model->cell_node[k]]++] = c;
  for (PetscInt i = model->n_own; i > 0; i--) r->start[i] = r->start[i - 1];
  r->start[0] = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Materials around each node, ascending. */
static PetscErrorCode FindSides(FemModel model)
{
  FemRecovery r    = model->recovery;
  PetscInt    most = 1, room;

  PetscFunctionBegin;
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt i = 0; i < model->n_own; i++) {
      PetscInt n = 0, law[64];

      for (PetscInt k = r->start[i]; k < r->start[i + 1]; k++) {
        const PetscInt m = LawOf(model, r->around[k]);
        PetscInt       j = 0;

        while (j < n && law[j] < m) j++;
        if ((j < n && law[j] == m) || n == 64) continue;
        for (PetscInt l = n++; l > j; l--) law[l] = law[l - 1];
        law[j] = m;
      }
      if (!pass) most = PetscMax(most, n);
      else
        for (PetscInt j = 0; j < n; j++) r->side[i * r->sides + j] = law[j];
    }
    if (pass) break;
    PetscCallMPI(MPI_Allreduce(&most, &r->sides, 1, MPIU_INT, MPI_MAX, model->comm));
    room = model->n_loc * r->sides;
    PetscCall(PetscMalloc3(room, &r->side, room, &r->level, room, &r->kind));
    for (PetscInt k = 0; k < room; k++) {
      r->side[k] = r->level[k] = -1;
      r->kind[k] = FIT_NONE;
    }
  }
  PetscCall(ToGhosts(model, MPIU_INT, r->sides, r->side));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static uint64_t Mix(uint64_t z)
{
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  return z ^ (z >> 31);
}

/* A side of an element at the corner is told by the nodes its edges lead to. Inside the material two elements have each side, and
   their marks cancel; 64 bits leave no room for chance. */
static PetscBool IsInner(FemModel model, PetscInt node, PetscInt law)
{
  FemRecovery r    = model->recovery;
  uint64_t    mark = 0;

  for (PetscInt k = r->start[node]; k < r->start[node + 1]; k++) {
    const PetscInt  c = r->around[k], *list = &model->cell_node[model->cell_start[c]];
    const PetscInt *edge;
    PetscInt        a = 0;

    if (LawOf(model, c) != law) continue;
    while (list[a] != node) a++;
    edge = FemPointEdges((MeshCellType)model->cell_type[c], a);
    for (PetscInt i = 0; i < model->dim; i++) {
      const uint64_t p = (uint64_t)model->gid[list[edge[i]]] + 1, q = model->dim == 2 ? 0 : (uint64_t)model->gid[list[edge[(i + 1) % 3]]] + 1;

      mark ^= Mix(Mix(PetscMin(p, q) * 0x9E3779B97F4A7C15ull) + PetscMax(p, q) * 0x9E3779B97F4A7C15ull);
    }
  }
  return (PetscBool)(mark == 0);
}

/* Points of the patch around a slot, from its node; stresses too when s is not NULL. kind says which. Returns how many; room for `room`. */
static PetscInt PatchPoints(FemModel model, PetscInt slot, PetscInt kind, const PetscReal *sample, PetscInt room, PetscReal *at, PetscReal *s)
{
  FemRecovery      r    = model->recovery;
  const PetscInt   node = slot / r->sides, dim = model->dim, stride = dim + r->parts;
  const PetscReal *centre = &model->x[node * dim];
  PetscInt         n = 0;

  for (PetscInt k = r->start[node]; k < r->start[node + 1]; k++) {
    const PetscInt   c      = r->around[k];
    const FemPoints *points = kind == FIT_RULE ? r->rule[model->cell_type[c]] : r->best[model->cell_type[c]];
    PetscReal        here[3], stress[6];
    FemReading       reading;

    if (LawOf(model, c) != r->side[slot]) continue;
    if (kind == FIT_SAMPLES && sample) {
      for (PetscInt q = 0; q < points->n && n < room; q++, n++) {
        const PetscReal *from = &sample[(r->sample_at[c] + q) * stride];

        for (PetscInt d = 0; d < dim; d++) at[3 * n + d] = from[d] - centre[d];
        for (PetscInt i = 0; i < r->parts; i++) s[n * r->parts + i] = from[dim + i];
      }
      continue;
    }
    FemReadCell(model, c, s && points->n > 1 ? PETSC_TRUE : PETSC_FALSE, &reading);
    for (PetscInt q = 0; q < points->n && n < room; q++, n++) {
      (void)FemRawStress(model, &reading, points, q, stress, here);
      for (PetscInt d = 0; d < dim; d++) at[3 * n + d] = here[d] - centre[d];
      for (PetscInt i = 0; i < r->parts && s; i++) s[n * r->parts + i] = stress[i];
    }
  }
  return n;
}

static PetscInt PatchRoom(FemModel model, PetscInt slot)
{
  const PetscInt node = slot / model->recovery->sides;

  return (model->recovery->start[node + 1] - model->recovery->start[node]) * FEM_RULE_MAX;
}

static PetscErrorCode CanFit(FemModel model, PetscInt slot, PetscInt kind, PetscBool *can)
{
  FemRecovery    r    = model->recovery;
  const PetscInt room = PatchRoom(model, slot);
  PetscReal     *at;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(3 * room, &at));
  *can = Fit(model->dim, r->terms, r->parts, PatchPoints(model, slot, kind, NULL, room, at, NULL), at, NULL, NULL);
  PetscCall(PetscFree(at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Does an element of the slot's material lead to a corner whose level lies in [0, below)? */
static PetscBool HasLower(FemModel model, PetscInt slot, PetscInt below)
{
  FemRecovery    r    = model->recovery;
  const PetscInt node = slot / r->sides;

  for (PetscInt k = r->start[node]; k < r->start[node + 1]; k++) {
    const PetscInt c = r->around[k], corners = MeshCellCorners((MeshCellType)model->cell_type[c]);

    if (LawOf(model, c) != r->side[slot]) continue;
    for (PetscInt a = 0; a < corners; a++) {
      const PetscInt other = FemSlotOf(r, model->cell_node[model->cell_start[c] + a], r->side[slot]);

      if (other >= 0 && other != slot && r->level[other] >= 0 && r->level[other] < below) return PETSC_TRUE;
    }
  }
  return PETSC_FALSE;
}

/* Levels as in fem_recover.h. Geometry alone decides. */
static PetscErrorCode FindLevels(FemModel model)
{
  FemRecovery    r    = model->recovery;
  const PetscInt room = model->n_own * r->sides;
  PetscInt      *open, n_open = 0, more = 1;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(room, &open));
  for (PetscInt i = 0; i < model->n_own; i++) {
    const PetscInt c = r->around[r->start[i]];
    PetscInt       a = 0;

    while (model->cell_node[model->cell_start[c] + a] != i) a++;
    if (a >= MeshCellCorners((MeshCellType)model->cell_type[c])) continue; /* no corner */
    for (PetscInt k = i * r->sides; k < (i + 1) * r->sides && r->side[k] >= 0; k++) {
      PetscBool can = IsInner(model, i, r->side[k]);

      if (can) PetscCall(CanFit(model, k, FIT_SAMPLES, &can));
      if (can) {
        r->level[k] = 0;
        r->kind[k]  = FIT_SAMPLES;
      } else open[n_open++] = k;
    }
  }
  PetscCall(ToGhosts(model, MPIU_INT, r->sides, r->level));
  for (PetscInt level = 1; more; level++) {
    PetscInt left = 0, taken = 0, sum[2];

    if (level == 2) {
      for (PetscInt k = 0; k < n_open; k++) {
        PetscBool can;
        PetscInt  kind = FIT_SAMPLES;

        PetscCall(CanFit(model, open[k], kind, &can));
        if (!can) PetscCall(CanFit(model, open[k], kind = FIT_RULE, &can));
        if (can) {
          r->level[open[k]] = 2;
          r->kind[open[k]]  = kind;
          taken++;
        } else open[left++] = open[k];
      }
    } else {
      PetscInt *found;

      PetscCall(PetscMalloc1(n_open, &found)); /* the level is written after all have looked */
      for (PetscInt k = 0; k < n_open; k++) found[k] = HasLower(model, open[k], level);
      for (PetscInt k = 0; k < n_open; k++)
        if (found[k]) {
          r->level[open[k]] = level;
          taken++;
        } else open[left++] = open[k];
      PetscCall(PetscFree(found));
    }
    n_open = left;
    sum[0] = n_open;
    sum[1] = taken;
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_INT, MPI_SUM, model->comm));
    PetscCall(ToGhosts(model, MPIU_INT, r->sides, r->level));
    if (sum[1]) r->last = level;
    more = sum[0] && (sum[1] || level < 3);
  }
  for (PetscInt k = 0; k < n_open; k++) { /* an element or two on their own */
    r->level[open[k]] = 2;
    r->kind[open[k]]  = FIT_MEAN;
  }
  PetscCall(ToGhosts(model, MPIU_INT, r->sides, r->level));
  PetscCall(PetscFree(open));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Degree, and the points of every type there is. */
static PetscErrorCode FindOrder(FemModel model)
{
  FemRecovery r       = model->recovery;
  PetscInt    most[2] = {1, 1};

  PetscFunctionBegin;
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const MeshCellType type = (MeshCellType)model->cell_type[c];
    const PetscInt     order = FemPointOrder(type);
    FemPoints         *best, *rule;

    if (r->best[type]) continue;
    PetscCheck(FemPointEdges(type, 0), PETSC_COMM_SELF, PETSC_ERR_SUP, "Stress recovery does not cover elements of gmsh's type %d", (int)type);
    PetscCall(PetscCalloc2(1, &best, 1, &rule));
    best->n = FemPointSamples(type, best->xi);
    rule->n = FemPointRule(type, order + (FemPointIsSimplex(type) ? model->dim - 1 : 1), rule->xi, rule->w);
    FemPointsFill(type, best);
    FemPointsFill(type, rule);
    r->best[type] = best;
    r->rule[type] = rule;
    most[0]       = PetscMax(most[0], order);
    most[1]       = PetscMax(most[1], best->n);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 2, MPIU_INT, MPI_MAX, model->comm));
  r->order   = most[0];
  r->samples = most[1];
  r->terms   = r->order == 1 ? model->dim + 1 : (model->dim + 1) * (model->dim + 2) / 2;
  r->parts   = FEM_PARTS(model->dim);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- requests ---- */

static PetscErrorCode CopyList(PetscInt n, const PetscInt *from, PetscInt *m, PetscInt **list)
{
  PetscFunctionBegin;
  *m = n;
  PetscCall(PetscMalloc1(n, list));
  PetscCall(PetscArraycpy(*list, from, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemRequestDestroy(FemRequest *q)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(q->cell));
  PetscCall(PetscFree(q->fit));
  PetscCall(PetscFree(q->take));
  PetscCall(PetscFree(q->between));
  PetscCall(PetscMemzero(q, sizeof(*q)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From flags of slots (polynomial wanted) and of nodes that are no corner, to lists. */
static PetscErrorCode ListRequest(FemModel model, const PetscInt *slot, const PetscInt *between, FemRequest *q)
{
  FemRecovery    r    = model->recovery;
  const PetscInt room = model->n_own * r->sides;
  PetscInt      *list, *cell, n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(PetscMax(room, model->n_cells), &list));
  PetscCall(PetscCalloc1(model->n_cells, &cell));
  for (PetscInt k = 0; k < room; k++)
    if (slot[k] && r->kind[k] != FIT_NONE) list[n++] = k;
  PetscCall(CopyList(n, list, &q->n_fits, &q->fit));
  PetscCallMPI(MPI_Allreduce(&n, &q->fits, 1, MPIU_INT, MPI_SUM, model->comm));
  for (PetscInt k = 0; k < n; k++)
    for (PetscInt e = r->start[list[k] / r->sides]; e < r->start[list[k] / r->sides + 1]; e++) cell[r->around[e]] = 1;
  n = 0;
  for (PetscInt level = 1; level <= r->last; level++)
    for (PetscInt k = 0; k < room; k++)
      if (slot[k] && r->level[k] == level && r->kind[k] == FIT_NONE) list[n++] = k;
  PetscCall(CopyList(n, list, &q->n_takes, &q->take));
  n = 0;
  for (PetscInt k = 0; k < room; k++)
    if (between[k / r->sides] && r->level[k] < 0 && r->side[k] >= 0) list[n++] = k;
  PetscCall(CopyList(n, list, &q->n_between, &q->between));
  n = 0;
  for (PetscInt c = 0; c < model->n_cells; c++)
    if (cell[c]) list[n++] = c;
  PetscCall(CopyList(n, list, &q->n_cells, &q->cell));
  PetscCall(PetscFree(cell));
  PetscCall(PetscFree(list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Slots of the corners a node lies between: ends of its edge, corners of its side or element; all elements around agree on them. Returns how many. */
static PetscInt Parents(FemModel model, PetscInt slot, PetscInt parent[8])
{
  FemRecovery    r    = model->recovery;
  const PetscInt node = slot / r->sides;
  PetscInt       k    = r->start[node], a = 0, corner[8], n;

  while (LawOf(model, r->around[k]) != r->side[slot]) k++;
  while (model->cell_node[model->cell_start[r->around[k]] + a] != node) a++;
  n = MeshCellParents((MeshCellType)model->cell_type[r->around[k]], a, corner);
  for (PetscInt i = 0; i < n; i++) parent[i] = FemSlotOf(r, model->cell_node[model->cell_start[r->around[k]] + corner[i]], r->side[slot]);
  return n;
}

/* Flags the corners of a lower level in the elements of the slot's material around its node. */
static void WantLower(FemModel model, PetscInt slot, PetscInt below, PetscInt *want)
{
  FemRecovery    r    = model->recovery;
  const PetscInt node = slot / r->sides;

  for (PetscInt k = r->start[node]; k < r->start[node + 1]; k++) {
    const PetscInt c = r->around[k], corners = MeshCellCorners((MeshCellType)model->cell_type[c]);

    if (LawOf(model, c) != r->side[slot]) continue;
    for (PetscInt a = 0; a < corners; a++) {
      const PetscInt other = FemSlotOf(r, model->cell_node[model->cell_start[c] + a], r->side[slot]);

      if (r->level[other] < below) want[other] = 1;
    }
  }
}

PetscErrorCode FemRequestCreate(FemModel model, PetscInt *wanted, FemRequest *q)
{
  FemRecovery    r    = model->recovery;
  const PetscInt room = model->n_loc * r->sides;
  PetscInt      *want;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(room, &want));
  PetscCall(ToOwners(model, 1, wanted));
  for (PetscInt k = 0; k < model->n_own * r->sides; k++) {
    if (!wanted[k / r->sides] || r->side[k] < 0) continue;
    if (r->level[k] >= 0) want[k] = 1;
    else {
      PetscInt       parent[8];
      const PetscInt n = Parents(model, k, parent);

      for (PetscInt i = 0; i < n; i++) want[parent[i]] = 1;
    }
  }
  PetscCall(ToOwners(model, r->sides, want));
  for (PetscInt level = r->last; level >= 1; level--) {
    for (PetscInt k = 0; k < model->n_own * r->sides; k++)
      if (want[k] && r->level[k] == level && r->kind[k] == FIT_NONE) WantLower(model, k, level, want);
    PetscCall(ToOwners(model, r->sides, want));
  }
  PetscCall(ListRequest(model, want, wanted, q));
  PetscCall(PetscFree(want));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemRecoveryCreate(FemModel model)
{
  FemRecovery r;
  PetscInt   *every;

  PetscFunctionBegin;
  if (model->recovery) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(1, &model->recovery));
  r = model->recovery;
  PetscCall(PetscMalloc1(model->n_regions, &r->law));
  for (PetscInt k = 0; k < model->n_regions; k++) /* with stress without strain every region stands alone: C:eps may jump between them */
    for (r->law[k] = 0; r->law[k] < k && (model->pre.n || !FemElasticSame(&model->law[r->law[k]], &model->law[k]));) r->law[k]++;
  PetscCall(FindOrder(model));
  PetscCall(FindAround(model));
  PetscCall(FindSides(model));
  PetscCall(FindLevels(model));
  PetscCall(PetscMalloc1(model->n_cells, &r->sample_at));
  PetscCall(PetscCalloc2(model->n_loc * r->sides * r->terms * r->parts, &r->poly, model->n_loc * r->sides * r->parts, &r->value));
  PetscCall(PetscMalloc1(model->n_loc * r->sides, &every));
  for (PetscInt k = 0; k < model->n_loc * r->sides; k++) every[k] = 1;
  PetscCall(ListRequest(model, every, every, &r->all));
  PetscCall(PetscFree(every));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemRecoveryDestroy(FemModel model)
{
  FemRecovery r = model->recovery;

  PetscFunctionBegin;
  if (!r) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt t = 0; t <= MESH_PRISM15; t++) PetscCall(PetscFree2(r->best[t], r->rule[t]));
  PetscCall(PetscFree(r->law));
  PetscCall(PetscFree(r->start));
  PetscCall(PetscFree(r->around));
  PetscCall(PetscFree3(r->side, r->level, r->kind));
  PetscCall(PetscFree(r->sample_at));
  PetscCall(FemRequestDestroy(&r->all));
  PetscCall(FemRequestDestroy(&r->probed));
  PetscCall(PetscFree2(r->poly, r->value));
  PetscCall(PetscFree2(r->point_slot, r->point_node));
  PetscCall(PetscFree(r->cell_point));
  PetscCall(PetscFree(model->recovery));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- the recovery ---- */

static PetscErrorCode FitPatch(FemModel model, PetscInt slot, const PetscReal *sample)
{
  FemRecovery    r    = model->recovery;
  const PetscInt room = PatchRoom(model, slot), size = r->terms * r->parts;
  PetscReal     *at, *s, *poly = &r->poly[slot * size];
  PetscInt       n;
  PetscBool      done = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(3 * room, &at, r->parts * room, &s));
  n = PatchPoints(model, slot, r->kind[slot], sample, room, at, s);
  if (r->kind[slot] != FIT_MEAN) done = Fit(model->dim, r->terms, r->parts, n, at, s, poly);
  if (!done) {
    PetscCall(PetscArrayzero(poly, size));
    for (PetscInt c = 0; c < r->parts; c++)
      for (PetscInt q = 0; q < n; q++) poly[c] += s[q * r->parts + c] / n;
  }
  PetscCall(PetscFree2(at, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean over the elements of the slot's material, and their corners of a lower level, of what those say here.  Eq. (2.92) */
static void TakePatch(FemModel model, PetscInt slot, PetscInt below, PetscReal *poly)
{
  FemRecovery    r    = model->recovery;
  const PetscInt node = slot / r->sides, dim = model->dim, size = r->terms * r->parts;
  PetscInt       n    = 0;

  for (PetscInt k = 0; k < size; k++) poly[k] = 0;
  for (PetscInt k = r->start[node]; k < r->start[node + 1]; k++) {
    const PetscInt c = r->around[k], corners = MeshCellCorners((MeshCellType)model->cell_type[c]);

    if (LawOf(model, c) != r->side[slot]) continue;
    for (PetscInt a = 0; a < corners; a++) {
      const PetscInt from = model->cell_node[model->cell_start[c] + a], other = FemSlotOf(r, from, r->side[slot]);
      PetscReal      t[3];

      if (r->level[other] >= below) continue;
      for (PetscInt d = 0; d < dim; d++) t[d] = model->x[node * dim + d] - model->x[from * dim + d];
      AddMoved(dim, r->terms, r->parts, &r->poly[other * size], t, poly);
      n++;
    }
  }
  for (PetscInt k = 0; k < size; k++) poly[k] /= n;
}

/* Eq. (2.93) */
static void BetweenCorners(FemModel model, PetscInt slot, PetscReal *value)
{
  FemRecovery    r    = model->recovery;
  const PetscInt dim  = model->dim, node = slot / r->sides;
  PetscInt       parent[8];
  const PetscInt n = Parents(model, slot, parent);

  for (PetscInt c = 0; c < r->parts; c++) value[c] = 0;
  for (PetscInt i = 0; i < n; i++) {
    PetscReal t[3], P[FEM_TERMS];

    for (PetscInt d = 0; d < dim; d++) t[d] = model->x[node * dim + d] - model->x[parent[i] / r->sides * dim + d];
    Basis(dim, r->terms, t, P);
    for (PetscInt k = 0; k < r->terms; k++)
      for (PetscInt c = 0; c < r->parts; c++) value[c] += P[k] * r->poly[(parent[i] * r->terms + k) * r->parts + c] / n;
  }
}

PetscErrorCode FemRecover(FemModel model, const FemRequest *q)
{
  FemRecovery    r = model->recovery;
  const PetscInt dim = model->dim, size = r->terms * r->parts, stride = dim + r->parts;
  PetscReal     *sample;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(FEM_Recover, 0, 0, 0, 0));
  PetscCall(FemGhosts(model, model->u));
  PetscCall(PetscMalloc1(q->n_cells * r->samples * stride, &sample));
#pragma omp parallel for schedule(static) num_threads(model->threads)
  for (PetscInt k = 0; k < q->n_cells; k++) {
    const PetscInt   c      = q->cell[k];
    const FemPoints *points = r->best[model->cell_type[c]];
    PetscReal        at[3];
    FemReading       reading;

    r->sample_at[c] = k * r->samples;
    FemReadCell(model, c, points->n > 1 ? PETSC_TRUE : PETSC_FALSE, &reading);
    for (PetscInt p = 0; p < points->n; p++) {
      PetscReal *to = &sample[(k * r->samples + p) * stride];

      (void)FemRawStress(model, &reading, points, p, &to[dim], at);
      for (PetscInt d = 0; d < dim; d++) to[d] = at[d];
    }
  }
  for (PetscInt k = 0; k < q->n_fits; k++) PetscCall(FitPatch(model, q->fit[k], sample));
  PetscCall(PetscFree(sample));
  PetscCall(ToGhosts(model, MPIU_REAL, r->sides * size, r->poly));
  for (PetscInt level = 1, k = 0; level <= r->last; level++) {
    for (; k < q->n_takes && r->level[q->take[k]] == level; k++) TakePatch(model, q->take[k], level, &r->poly[q->take[k] * size]);
    PetscCall(ToGhosts(model, MPIU_REAL, r->sides * size, r->poly));
  }
  for (PetscInt k = 0; k < q->n_fits; k++) PetscCall(PetscArraycpy(&r->value[q->fit[k] * r->parts], &r->poly[q->fit[k] * size], r->parts));
  for (PetscInt k = 0; k < q->n_takes; k++) PetscCall(PetscArraycpy(&r->value[q->take[k] * r->parts], &r->poly[q->take[k] * size], r->parts));
  for (PetscInt k = 0; k < q->n_between; k++) BetweenCorners(model, q->between[k], &r->value[q->between[k] * r->parts]);
  PetscCall(ToGhosts(model, MPIU_REAL, r->sides * r->parts, r->value));
  r->patches += q->fits;
  if (q == &r->all) r->count++;
  PetscCall(PetscLogEventEnd(FEM_Recover, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
