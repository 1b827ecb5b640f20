/*
  fem_frame.c - motion prescribed along directions that are not x, y, z: symmetry on inclined planes.  Eqs (2.70)-(2.74)

  A node on inclined planes gets axes of its own, a frame: first the directions that are held (plane normals, then whatever
  x, y, z supports add), made orthonormal one after the other, then the free ones. Seen in its frame the node is an ordinary
  partly held node, so matrices keep whole blocks. What is held in a frame follows a sum of the tables that hold the node,
  itself a table; a direction held twice must be told the same motion. Nodes held along x, y, z alone have no frame.
*/
#include "fem_impl.h"

#define PARALLEL 1e-6 /* sine below which two directions are one: gmsh's planes are flat to 1e-9 */

/* Unit normal of a side, outward of its element, and how far its nodes lie off its plane [m]. */
static PetscReal SideNormal(FemModel model, PetscInt c, PetscInt side, PetscReal normal[3], PetscReal middle[3], PetscReal *size)
{
  const PetscInt dim = model->dim;
  PetscReal      area = 0, off = 0;
  FemSide        s;

  FemSideGet(model, c, side, &s);
  for (PetscInt d = 0; d < 3; d++) normal[d] = middle[d] = 0;
  for (PetscInt a = 0; a < s.n; a++)
    for (PetscInt d = 0; d < dim; d++) {
      normal[d] += s.N_n_dA[a * dim + d];
      middle[d] += s.x[a * dim + d] / s.n;
    }
  for (PetscInt d = 0; d < dim; d++) area += normal[d] * normal[d];
  area  = PetscSqrtReal(area);
  *size = 0;
  for (PetscInt d = 0; d < dim; d++) normal[d] /= area;
  for (PetscInt a = 0; a < s.n; a++) {
    PetscReal along = 0, far = 0;

    for (PetscInt d = 0; d < dim; d++) {
      along += normal[d] * (s.x[a * dim + d] - middle[d]);
      far += (s.x[a * dim + d] - middle[d]) * (s.x[a * dim + d] - middle[d]);
    }
    off   = PetscMax(off, PetscAbsReal(along));
    *size = PetscMax(*size, PetscSqrtReal(far));
  }
  return off;
}

/* The normal of the group's first side in the mesh's order, the same bits on every rank; axes to 1e-12 are axes. */
static PetscErrorCode GroupNormal(FemModel model, const FemGroup *group, PetscReal normal[3], PetscReal middle[3])
{
  struct {
    int key, rank;
  } mine = {PETSC_MAX_INT, model->rank}, first;
  PetscReal both[6] = {0}, size;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < group->n_facets; k++) {
    const int key = (int)(model->cell_gid[group->facet_cell[k]] * 6 + group->facet_face[k]);

    if (key >= mine.key) continue;
    mine.key = key;
    (void)SideNormal(model, group->facet_cell[k], group->facet_face[k], both, both + 3, &size);
  }
  PetscCallMPI(MPI_Allreduce(&mine, &first, 1, MPI_2INT, MPI_MINLOC, model->comm));
  PetscCallMPI(MPI_Bcast(both, 6, MPIU_REAL, first.rank, model->comm));
  for (PetscInt d = 0; d < 3; d++)
    if (PetscAbsReal(both[d]) > 1 - 1e-12) {
      const PetscReal sign = both[d] > 0 ? 1 : -1;

      for (PetscInt e = 0; e < 3; e++) both[e] = e == d ? sign : 0;
    }
  PetscCall(PetscArraycpy(normal, both, 3));
  PetscCall(PetscArraycpy(middle, both + 3, 3));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetSymmetry(FemModel model, const char *name)
{
  FemMirror       mirror = {.group = -1};
  const FemGroup *group;
  PetscReal       middle[3], worst[2] = {0, 0}, turn;
  Table           zero;

  PetscFunctionBegin;
  PetscCheck(model && model->has_mesh && !model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Symmetry is given between FemModelSetMesh() and FemModelSetUp()");
  PetscCall(FemFindGroup(model, name, &mirror.group));
  group = &model->group[mirror.group];
  BaseCheckInput(group->dim == model->dim - 1, model->comm, "%s: group '%s' has dimension %d; a plane of symmetry is a group of dimension %d", model->source, name, (int)group->dim, (int)model->dim - 1);
  BaseCheckInput(!group->loose, model->comm, "%s: %d cells of group '%s' are not a side of any element of the body; symmetry cannot act there", model->source, (int)group->loose, name);
  BaseCheckInput(group->n_nodes_global > 0, model->comm, "%s: group '%s' touches no node of the body, so there is nothing to hold", model->source, name);
  PetscCall(GroupNormal(model, group, mirror.normal, middle));
  for (PetscInt k = 0; k < group->n_facets; k++) {
    PetscReal normal[3], here[3], size, off, dot = 0;

    off = SideNormal(model, group->facet_cell[k], group->facet_face[k], normal, here, &size) / size;
    for (PetscInt d = 0; d < 3; d++) dot += normal[d] * mirror.normal[d];
    turn     = PetscSqrtReal(PetscMax(0, 1 - dot * dot));
    worst[0] = PetscMax(worst[0], turn);
    worst[1] = PetscMax(worst[1], off);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, worst, 2, MPIU_REAL, MPIU_MAX, model->comm));
  turn = PetscAsinReal(PetscMin(1, worst[0])) * 180 / PETSC_PI;
  BaseCheckInput(worst[0] < PARALLEL && worst[1] < PARALLEL, model->comm,
                 "%s: group '%s' is not flat: its sides turn by up to %.3g degrees, and symmetry holds the motion along one normal; give each plane its own group, or fix components", model->source, name, (double)turn);
  for (PetscInt d = 0; d < 3; d++)
    if (PetscAbsReal(mirror.normal[d]) == 1) {
      PetscCall(TableCreateConstant(0, &zero));
      PetscCall(FemModelFix(model, name, d, FEM_DISPLACEMENT, &zero));
      PetscCall(TableDestroy(&zero));
      mirror.straight = PETSC_TRUE;
    }
  PetscCall(PetscRealloc(sizeof(FemMirror) * (model->n_mirrors + 1), &model->mirror));
  model->mirror[model->n_mirrors++] = mirror;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- what holds a node in its frame ---- */

/* Sum of the motions of at most six sources; the tables that are zero for ever are left out. */
typedef struct {
  PetscInt  n, fix[6];
  PetscReal coefficient[6];
} Motion;

static PetscBool AtRest(const FemFix *fix)
{
  for (PetscInt k = 0; k < fix->table.n; k++)
    if (fix->table.v[k] != 0) return PETSC_FALSE;
  return PETSC_TRUE;
}

static void MotionAdd(FemModel model, Motion *m, PetscInt fix, PetscReal coefficient)
{
  if (fix < 0 || PetscAbsReal(coefficient) < 1e-14 || AtRest(&model->fix[fix])) return;
  for (PetscInt k = 0; k < m->n; k++)
    if (m->fix[k] == fix) {
      m->coefficient[k] += coefficient;
      return;
    }
  m->fix[m->n]           = fix;
  m->coefficient[m->n++] = coefficient;
}

static void MotionAddAll(FemModel model, Motion *m, const Motion *other, PetscReal factor)
{
  for (PetscInt k = 0; k < other->n; k++) MotionAdd(model, m, other->fix[k], factor * other->coefficient[k]);
}

/* Largest of the motion over the corners of all its tables, against that of its parts; positions when kinds differ. */
static PetscBool MotionIsZero(FemModel model, const Motion *m)
{
  for (PetscInt k = 0; k < m->n; k++)
    for (PetscInt j = 0; j < model->fix[m->fix[k]].table.n; j++)
      for (PetscInt shift = 0; shift < 2; shift++) { /* at a corner and well after it, where a slope shows */
        const PetscReal t = model->fix[m->fix[k]].table.t[j] + shift;
        PetscReal       sum = 0, size = 0;

        for (PetscInt i = 0; i < m->n; i++) {
          const PetscReal part = m->coefficient[i] * FemFixPosition(&model->fix[m->fix[i]], t);

          sum += part;
          size += PetscAbsReal(part);
        }
        if (PetscAbsReal(sum) > 1e-9 * size) return PETSC_FALSE;
      }
  return PETSC_TRUE;
}

/* The motion as an entry of fix[]; made once for each different sum. kept [n_kept] motions made so far, first = entry of the first. */
static PetscErrorCode MotionToFix(FemModel model, const Motion *m, PetscInt first, PetscInt *n_kept, Motion **kept, PetscInt *fix)
{
  FemFix     entry = {.group = m->n ? model->fix[m->fix[0]].group : model->mirror[0].group, .component = 0, .motion = m->n ? model->fix[m->fix[0]].motion : FEM_DISPLACEMENT};
  PetscInt   room = 0, n = 0;
  PetscReal *t, *v;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < *n_kept; k++) {
    PetscBool same = (PetscBool)(m->n == (*kept)[k].n);

    for (PetscInt j = 0; j < m->n && same; j++) same = (PetscBool)(m->fix[j] == (*kept)[k].fix[j] && m->coefficient[j] == (*kept)[k].coefficient[j]);
    if (same) {
      *fix = first + k;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  }
  for (PetscInt k = 0; k < m->n; k++) {
    PetscCheck(model->fix[m->fix[k]].motion == entry.motion, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: groups '%s' and '%s' meet on an inclined plane of symmetry, one moved by displacement and one by velocity; give both in the same way", model->source, model->group[entry.group].name,
               model->group[model->fix[m->fix[k]].group].name);
    room += model->fix[m->fix[k]].table.n;
  }
  PetscCall(PetscMalloc2(room + 1, &t, room + 1, &v));
  for (PetscInt k = 0; k < m->n; k++)
    for (PetscInt j = 0; j < model->fix[m->fix[k]].table.n; j++) t[n++] = model->fix[m->fix[k]].table.t[j];
  if (!n) t[n++] = 0;
  PetscCall(PetscSortRemoveDupsReal(&n, t));
  for (PetscInt j = 0; j < n; j++) {
    v[j] = 0;
    for (PetscInt k = 0; k < m->n; k++) {
      Table plain = model->fix[m->fix[k]].table;

      plain.clock = NULL; /* t is in the tables' own time */
      v[j] += m->coefficient[k] * TableValue(&plain, t[j]);
    }
  }
  PetscCall(TableCreate(n, t, v, &entry.table));
  if (m->n) entry.table.clock = model->fix[m->fix[0]].table.clock;
  PetscCall(PetscFree2(t, v));
  PetscCall(PetscRealloc(sizeof(Motion) * (*n_kept + 1), kept));
  (*kept)[(*n_kept)++] = *m;
  PetscCall(PetscRealloc(sizeof(FemFix) * (model->n_fixes + 1), &model->fix));
  *fix                          = model->n_fixes;
  model->fix[model->n_fixes++]  = entry;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  One more direction a, held to motion g, for the frame q [rank][3] with motions G [rank].  Eq. (2.71)
  Returns 0 when it is new, 1 when the frame holds it already and the motions agree, 2 when they do not.
*/
static PetscInt Hold(FemModel model, const PetscReal a[3], const Motion *g, PetscInt *rank, PetscReal q[3][3], Motion G[3])
{
  PetscReal v[3] = {a[0], a[1], a[2]}, size = 0;
  Motion    rest = *g;

  for (PetscInt i = 0; i < *rank; i++) {
    const PetscReal dot = a[0] * q[i][0] + a[1] * q[i][1] + a[2] * q[i][2];

    for (PetscInt d = 0; d < 3; d++) v[d] -= dot * q[i][d];
    MotionAddAll(model, &rest, &G[i], -dot);
  }
  for (PetscInt d = 0; d < 3; d++) size += v[d] * v[d];
  size = PetscSqrtReal(size);
  if (size < PARALLEL || *rank == model->dim) return MotionIsZero(model, &rest) ? 1 : 2;
  for (PetscInt k = 0; k < rest.n; k++) rest.coefficient[k] /= size;
  for (PetscInt d = 0; d < 3; d++) q[*rank][d] = v[d] / size;
  G[(*rank)++] = rest;
  return 0;
}

/* Free axes after the held ones: what is left of x, y, z, the largest first. */
static void Complete(PetscInt dim, PetscInt rank, PetscReal q[3][3])
{
  for (; rank < dim; rank++) {
    PetscReal best[3] = {0, 0, 0}, most = 0;

    for (PetscInt e = 0; e < dim; e++) {
      PetscReal v[3] = {e == 0, e == 1, e == 2}, size = 0;

      for (PetscInt pass = 0; pass < 2; pass++)
        for (PetscInt i = 0; i < rank; i++) {
          const PetscReal dot = v[0] * q[i][0] + v[1] * q[i][1] + v[2] * q[i][2];

          for (PetscInt d = 0; d < 3; d++) v[d] -= dot * q[i][d];
        }
      for (PetscInt d = 0; d < 3; d++) size += v[d] * v[d];
      if (size <= most + 1e-12) continue;
      most = size;
      for (PetscInt d = 0; d < 3; d++) best[d] = v[d] / PetscSqrtReal(size);
    }
    for (PetscInt d = 0; d < 3; d++) q[rank][d] = best[d];
  }
}

/* Frames of ghosts come from their owners; which of their axes are held, as 1 or -1. */
static PetscErrorCode ShareFrames(FemModel model, PetscReal *axes)
{
  const PetscInt dim = model->dim, n = model->n_loc * dim;
  PetscReal     *flag;
  PetscInt       count = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &flag));
  for (PetscInt a = 0; a < dim; a++) PetscCall(FemGhosts(model, &axes[a * n]));
  for (PetscInt k = 0; k < n; k++) flag[k] = k < model->n_own * dim && model->frame_of[k / dim] >= 0 ? (model->frame_fix[model->frame_of[k / dim] * dim + k % dim] >= 0 ? 1 : -1) : 0;
  PetscCall(FemGhosts(model, flag));
  for (PetscInt i = 0; i < model->n_loc; i++) count += flag[i * dim] != 0;
  PetscCall(PetscRealloc(sizeof(PetscInt) * PetscMax(1, count * dim), &model->frame_fix));
  PetscCall(PetscMalloc2(count, &model->frame_node, count * dim * dim, &model->frame));
  for (PetscInt i = 0; i < model->n_loc; i++) {
    if (flag[i * dim] == 0) continue;
    if (i >= model->n_own) {
      model->frame_of[i] = model->n_frames;
      for (PetscInt a = 0; a < dim; a++) model->frame_fix[model->n_frames * dim + a] = flag[i * dim + a] > 0 ? 0 : -1;
    }
    model->frame_node[model->n_frames] = i;
    for (PetscInt a = 0; a < dim; a++)
      for (PetscInt d = 0; d < dim; d++) model->frame[(model->n_frames * dim + a) * dim + d] = axes[a * n + i * dim + d];
    model->n_frames++;
  }
  PetscCall(PetscFree(flag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemSetUpFrames(FemModel model)
{
  const PetscInt dim = model->dim, n = model->n_loc * dim, first = model->n_fixes;
  PetscInt       n_kept = 0, inclined = 0, clash = PETSC_MAX_INT, lowest, other = -1, names[2], tag = 0;
  PetscReal     *axes; /* [dim][n_loc*dim] */
  Motion        *kept = NULL;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_mirrors; k++) inclined += !model->mirror[k].straight;
  if (!inclined) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(model->n_loc, &model->frame_of));
  PetscCall(PetscCalloc1(dim * n, &axes));
  for (PetscInt i = 0; i < model->n_loc; i++) model->frame_of[i] = -1;
  for (PetscInt k = 0; k < model->n_mirrors; k++)
    for (PetscInt j = 0; j < model->group[model->mirror[k].group].n_nodes && !model->mirror[k].straight; j++) model->frame_of[model->group[model->mirror[k].group].node[j]] = 0;
  for (PetscInt i = 0; i < model->n_own; i++)
    if (model->frame_of[i] == 0) model->frame_of[i] = model->n_frames_own++;
  PetscCall(PetscMalloc1(PetscMax(1, model->n_frames_own * dim), &model->frame_fix));
  names[0] = names[1] = 0;
  for (PetscInt i = 0; i < model->n_own; i++) {
    PetscReal q[3][3] = {{0}};
    PetscInt  rank = 0, f = model->frame_of[i];
    Motion    G[3] = {{0}}, still = {0};

    if (f < 0) continue;
    for (PetscInt k = 0; k < model->n_mirrors; k++) {
      const FemGroup *group = &model->group[model->mirror[k].group];
      PetscInt        at;

      if (model->mirror[k].straight) continue;
      PetscCall(PetscFindInt(i, group->n_nodes, group->node, &at));
      if (at >= 0) (void)Hold(model, model->mirror[k].normal, &still, &rank, q, G);
      if (at >= 0) other = model->mirror[k].group;
    }
    for (PetscInt d = 0; d < dim; d++) {
      const PetscReal e[3] = {d == 0, d == 1, d == 2};
      Motion          g    = {0};

      if (model->fixed[i * dim + d] < 0) continue;
      MotionAdd(model, &g, model->fixed[i * dim + d], 1);
      if (Hold(model, e, &g, &rank, q, G) == 2 && model->gid[i] < clash) {
        clash    = model->gid[i];
        names[0] = model->fix[model->fixed[i * dim + d]].group;
        names[1] = other;
      }
      model->fixed[i * dim + d] = -1;
    }
    Complete(dim, rank, q);
    for (PetscInt a = 0; a < dim; a++) {
      if (a < rank) PetscCall(MotionToFix(model, &G[a], first, &n_kept, &kept, &model->frame_fix[f * dim + a]));
      else model->frame_fix[f * dim + a] = -1;
      for (PetscInt d = 0; d < dim; d++) axes[a * n + i * dim + d] = q[a][d];
    }
  }
  PetscCall(PetscFree(kept));
  PetscCallMPI(MPI_Allreduce(&clash, &lowest, 1, MPIU_INT, MPI_MIN, model->comm));
  if (lowest != PETSC_MAX_INT) {
    PetscMPIInt mine = lowest == clash ? model->rank : model->size, holder;

    PetscCallMPI(MPI_Allreduce(&mine, &holder, 1, MPI_INT, MPI_MIN, model->comm));
    PetscCallMPI(MPI_Bcast(names, 2, MPIU_INT, holder, model->comm));
    if (model->rank == 0) tag = model->id_all[lowest];
    PetscCallMPI(MPI_Bcast(&tag, 1, MPIU_INT, 0, model->comm));
    SETERRQ(model->comm, PETSC_ERR_USER_INPUT, "%s: group '%s' moves node %d through the plane of symmetry '%s'; move it along the plane, or take the node out of one of them", model->source, model->group[names[0]].name, (int)tag,
            model->group[names[1]].name);
  }
  PetscCall(ShareFrames(model, axes));
  PetscCall(PetscFree(axes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemFramesDestroy(FemModel model)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(model->mirror));
  PetscCall(PetscFree(model->frame_of));
  PetscCall(PetscFree(model->frame_fix));
  PetscCall(PetscFree2(model->frame_node, model->frame));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- vectors and matrices seen from frames ---- */

void FemIntoFrames(FemModel model, PetscReal *a)
{
  const PetscInt dim = model->dim;

  for (PetscInt f = 0; f < model->n_frames_own; f++) {
    const PetscReal *Q = &model->frame[f * dim * dim];
    PetscReal       *at = &a[model->frame_node[f] * dim], v[3] = {0, 0, 0};

    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt d = 0; d < dim; d++) v[i] += Q[i * dim + d] * at[d];
    for (PetscInt i = 0; i < dim; i++) at[i] = v[i];
  }
}

void FemOutOfFrames(FemModel model, PetscReal *a)
{
  const PetscInt dim = model->dim;

  for (PetscInt f = 0; f < model->n_frames_own; f++) {
    const PetscReal *Q = &model->frame[f * dim * dim];
    PetscReal       *at = &a[model->frame_node[f] * dim], v[3] = {0, 0, 0};

    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt d = 0; d < dim; d++) v[d] += Q[i * dim + d] * at[i];
    for (PetscInt i = 0; i < dim; i++) at[i] = v[i];
  }
}

/* Blocks of K from axes to frames, Q_i K_ij Q_j'.  Eq. (2.72) */
void FemRowsIntoFrames(FemModel model, PetscReal *value)
{
  const PetscInt dim = model->dim;
  const FemRows *rows = &model->rows;

  for (PetscInt i = 0; i < model->n_own && model->frame_of; i++)
    for (PetscInt b = rows->start[i]; b < rows->start[i + 1]; b++) {
      const PetscInt fi = model->frame_of[i], fj = model->frame_of[rows->col[b]];
      PetscReal     *K = &value[(size_t)b * dim * dim], half[9] = {0}, full[9] = {0};

      if (fi < 0 && fj < 0) continue;
      for (PetscInt p = 0; p < dim; p++)
        for (PetscInt q = 0; q < dim; q++)
          for (PetscInt d = 0; d < dim; d++) half[p * dim + q] += (fi < 0 ? p == d : model->frame[(fi * dim + p) * dim + d]) * K[d * dim + q];
      for (PetscInt p = 0; p < dim; p++)
        for (PetscInt q = 0; q < dim; q++)
          for (PetscInt d = 0; d < dim; d++) full[p * dim + q] += half[p * dim + d] * (fj < 0 ? q == d : model->frame[(fj * dim + q) * dim + d]);
      for (PetscInt k = 0; k < dim * dim; k++) K[k] = full[k];
    }
}

PetscErrorCode FemProject(FemModel model, FemHold hold, PetscReal t, PetscReal *a)
{
  PetscReal *place;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(model->n_fixes, &place));
  for (PetscInt k = 0; k < model->n_fixes; k++) place[k] = hold == FEM_HOLD_POSITION ? FemFixPosition(&model->fix[k], t) : hold == FEM_HOLD_VELOCITY ? FemFixVelocity(&model->fix[k], t) : 0;
  FemProjectTo(model, place, a);
  PetscCall(PetscFree(place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* place [n_fixes]: what each prescribed component becomes */
void FemProjectTo(FemModel model, const PetscReal *place, PetscReal *a)
{
  const PetscInt dim = model->dim;

  for (PetscInt k = 0; k < model->n_fixed_own; k++) a[model->fixed_dof[k]] = place[model->fixed[model->fixed_dof[k]]];
  for (PetscInt f = 0; f < model->n_frames_own; f++)
    for (PetscInt i = 0; i < dim; i++) {
      const PetscInt   fix = model->frame_fix[f * dim + i];
      const PetscReal *q   = &model->frame[(f * dim + i) * dim];
      PetscReal       *at  = &a[model->frame_node[f] * dim], more;

      if (fix < 0) continue;
      more = place[fix];
      for (PetscInt d = 0; d < dim; d++) more -= q[d] * at[d];
      for (PetscInt d = 0; d < dim; d++) at[d] += more * q[d];
    }
}

PetscReal FemKeepHeld(FemModel model, PetscReal *a)
{
  PetscReal sum = 0;

  FemIntoFrames(model, a);
  for (PetscInt k = 0; k < model->n_own * model->dim; k++) {
    if (FemHeld(model, k) >= 0) continue;
    sum += a[k] * a[k];
    a[k] = 0;
  }
  FemOutOfFrames(model, a);
  return sum;
}

void FemKeepFree(FemModel model, PetscReal *a)
{
  FemIntoFrames(model, a);
  for (PetscInt k = 0; k < model->n_own * model->dim; k++)
    if (FemHeld(model, k) >= 0) a[k] = 0;
  FemOutOfFrames(model, a);
}

PetscErrorCode FemTakeReactions(FemModel model, PetscReal *out_of_balance)
{
  PetscReal *r = model->reaction, sum;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_own * model->dim; k++) r[k] = model->f_int[k] - model->f_app[k] - model->f_ext[k];
  for (PetscInt e = 0; e < model->contact.n; e++) /* planes push free nodes */
    for (PetscInt d = 0; d < model->dim; d++) r[model->contact.node[e] * model->dim + d] -= model->contact.push[3 * e + d];
  sum = FemKeepHeld(model, r);
  for (PetscInt e = 0; e < model->contact.n; e++)
    for (PetscInt d = 0; d < model->dim; d++) r[model->contact.node[e] * model->dim + d] += model->contact.push[3 * e + d];
  if (out_of_balance) *out_of_balance = sum;
  PetscFunctionReturn(PETSC_SUCCESS);
}
