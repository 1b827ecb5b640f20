/*
  dem_cells_orphan.c - parts of cells on the far side of a notch go to the particles that live there.

  A power cell knows nothing of the body, so beside a notch narrower than the particles it may reach across. That part,
  an orphan, is taken from its owner and shared out among the particles whose cells it touches, again by least power. On
  its border the owner and the touching particle have equal power and all others more, so the new cells meet the old
  ones without a step, every facet is still a true bisector, and the sums over facets stay exact. A share that is not
  joined through the body to its heir's own cell (an heir that came round the tip of a crack and would reach through
  it further down) is shared out again without that heir.  docs/theory.md 3.1
*/
#include "dem_cells_impl.h"
#include <stdlib.h>

#define SMALL 1e-12 /* facet areas in cube units below which parts do not count as touching */
#define MAX_ROUNDS 30

static int CompareOrphans(const void *a, const void *b)
{
  const Orphan *o = a, *q = b;

  return o->p != q->p ? (o->p > q->p) - (o->p < q->p) : (o->piece > q->piece) - (o->piece < q->piece);
}

static int CompareBequests(const void *a, const void *b)
{
  const Bequest *o = a, *q = b;

  return o->heir != q->heir ? (o->heir > q->heir) - (o->heir < q->heir) : (o->share > q->share) - (o->share < q->share);
}

/* Index of p's orphan in a piece, -1 when that part is p's own. */
static PetscInt FindOrphan(const Estate *estate, PetscInt p, PetscInt piece)
{
  PetscInt lo = 0, hi = estate->n_orphans;

  if (!estate->has[p] || piece < 0) return -1;
  while (lo < hi) {
    const PetscInt m = (lo + hi) / 2;
    const Orphan  *o = &estate->orphan[m];

    if (o->p < p || (o->p == p && o->piece < piece))
      lo = m + 1;
    else
      hi = m;
  }
  return lo < estate->n_orphans && estate->orphan[lo].p == p && estate->orphan[lo].piece == piece ? lo : -1;
}

PetscBool DemEstateHas(const Estate *estate, PetscInt p, PetscInt piece) { return FindOrphan(estate, p, piece) >= 0 ? PETSC_TRUE : PETSC_FALSE; }

void DemEstateFind(const Estate *estate, PetscInt heir, PetscInt *first, PetscInt *end)
{
  PetscInt lo = 0, hi = estate->n_bequests;

  while (lo < hi) {
    const PetscInt m = (lo + hi) / 2;

    if (estate->bequest[m].heir < heir)
      lo = m + 1;
    else
      hi = m;
  }
  for (*first = *end = lo; *end < estate->n_bequests && estate->bequest[*end].heir == heir; (*end)++) {
  }
}

PetscInt DemEstateCutter(const Estate *estate, PetscInt a, PetscInt b)
{
  while (estate->share[a].parent != estate->share[b].parent) a = estate->share[a].parent;
  return estate->share[a].heir;
}

PetscBool DemEstateParts(const Estate *estate, PetscInt a, PetscInt b)
{
  return estate->share[a].parent == estate->share[b].parent && estate->share[b].state == SHARE_GIVEN ? PETSC_TRUE : PETSC_FALSE;
}

static PetscErrorCode NewShare(Estate *estate, PetscInt orphan, PetscInt parent, PetscInt heir, PetscInt *index)
{
  PetscFunctionBegin;
  if (estate->n_shares == estate->room_shares) {
    estate->room_shares = PetscMax(256, 2 * estate->room_shares);
    PetscCall(PetscRealloc(estate->room_shares * sizeof(Share), &estate->share));
  }
  *index = estate->n_shares++;
  estate->share[*index] = (Share){.orphan = orphan, .parent = parent, .heir = heir, .root = *index, .state = SHARE_EMPTY, .next = estate->orphan[orphan].first};
  estate->orphan[orphan].first = *index;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt Root(const Estate *estate, PetscInt s)
{
  while (estate->share[s].root != s) s = estate->share[s].root;
  return s;
}

static void Join(Estate *estate, PetscInt s, PetscInt t)
{
  const PetscInt a = Root(estate, s), b = Root(estate, t);

  estate->share[PetscMax(a, b)].root = PetscMin(a, b);
}

static PetscReal FacetSize(const DemBody *body, int n, const double *v)
{
  PetscReal a[3] = {0, 0, 0};

  if (body->dim == 2) return PetscSqrtReal(PetscSqr(v[3] - v[0]) + PetscSqr(v[4] - v[1]));
  for (int k = 1; k + 1 < n; k++) {
    const double e[3] = {v[3 * k] - v[0], v[3 * k + 1] - v[1], v[3 * k + 2] - v[2]}, g[3] = {v[3 * k + 3] - v[0], v[3 * k + 4] - v[1], v[3 * k + 5] - v[2]};

    for (PetscInt c = 0; c < 3; c++) a[c] += 0.5 * (e[(c + 1) % 3] * g[(c + 2) % 3] - e[(c + 2) % 3] * g[(c + 1) % 3]);
  }
  return PetscSqrtReal(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

/* The share has a facet of some size with this id. */
static PetscBool HasFacet(const DemBody *body, Share *share, PetscInt wanted)
{
  const int     *id, *start;
  const double  *corner;
  const PetscInt n = DemClipFacets(&share->clip, &id, &start, &corner);

  for (PetscInt f = 0; f < n; f++)
    if (id[f] == wanted && FacetSize(body, start[f + 1] - start[f], &corner[3 * start[f]]) > SMALL) return PETSC_TRUE;
  return PETSC_FALSE;
}

/* A particle whose own cell, or share already given, touches a group of pending shares. */
typedef struct {
  PetscInt group, heir;
} Touch;

typedef struct {
  PetscInt n, room;
  Touch   *touch;
} TouchList;

static int CompareTouches(const void *a, const void *b)
{
  const Touch *s = a, *t = b;

  return s->group != t->group ? (s->group > t->group) - (s->group < t->group) : (s->heir > t->heir) - (s->heir < t->heir);
}

static PetscErrorCode AddTouch(TouchList *list, PetscInt group, PetscInt heir)
{
  PetscFunctionBegin;
  if (list->n == list->room) {
    list->room = PetscMax(256, 2 * list->room);
    PetscCall(PetscRealloc(list->room * sizeof(Touch), &list->touch));
  }
  list->touch[list->n++] = (Touch){.group = group, .heir = heir};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a share's facet leads to: a particle's own cell (*heir >= 0), or shares of the orphan *beyond that have the
   facet *back (0 with *beyond < 0: one share, *sibling). All -1: the boundary. */
static void FacetLeads(const Estate *estate, const DemBody *body, const Share *share, PetscInt id, PetscInt *heir, PetscInt *sibling, PetscInt *beyond,
                       PetscInt *back)
{
  const Orphan *o = &estate->orphan[share->orphan];

  *heir = *sibling = *beyond = -1;
  *back = 0;
  if (id >= HEIR_ID(0)) {
    *sibling = id - HEIR_ID(0);
  } else if (id >= 0) {
    *beyond = FindOrphan(estate, id, o->piece);
    *back = o->p;
    if (*beyond < 0) *heir = id;
  } else if (id <= PLANE_ID(0)) {
    const PetscInt next = body->beyond[-10 - id];

    *beyond = FindOrphan(estate, o->p, next);
    for (PetscInt k = next < 0 ? 0 : body->start[next]; next >= 0 && k < body->start[next + 1]; k++)
      if (body->beyond[k] == o->piece) *back = PLANE_ID(k);
  }
}

/* Join pending shares that touch into groups and list who touches them. */
static PetscErrorCode GroupPending(const DemBody *body, Estate *estate, TouchList *list)
{
  PetscInt kept = 0;

  PetscFunctionBegin;
  list->n = 0;
  for (PetscInt s = 0; s < estate->n_shares; s++) {
    const int    *id, *start;
    const double *corner;
    PetscInt      n;

    if (estate->share[s].state != SHARE_PENDING) continue;
    n = DemClipFacets(&estate->share[s].clip, &id, &start, &corner);
    for (PetscInt f = 0; f < n; f++) {
      const PetscInt lost = estate->share[s].heir;
      PetscInt       heir, sibling, beyond, back;

      if (FacetSize(body, start[f + 1] - start[f], &corner[3 * start[f]]) < SMALL) continue;
      FacetLeads(estate, body, &estate->share[s], id[f], &heir, &sibling, &beyond, &back);
      if (heir >= 0 && heir != lost) PetscCall(AddTouch(list, s, heir));
      for (PetscInt t = sibling >= 0 ? sibling : (beyond >= 0 ? estate->orphan[beyond].first : -1); t >= 0; t = sibling >= 0 ? -1 : estate->share[t].next) {
        const ShareState state = estate->share[t].state;

        if (t == s || (state != SHARE_PENDING && state != SHARE_GIVEN)) continue;
        if (sibling < 0 && !HasFacet(body, &estate->share[t], back)) continue;
        if (state == SHARE_PENDING)
          Join(estate, s, t);
        else if (estate->share[t].heir != lost)
          PetscCall(AddTouch(list, s, estate->share[t].heir));
      }
    }
  }
  for (PetscInt k = 0; k < list->n; k++) list->touch[k].group = Root(estate, list->touch[k].group);
  if (list->n) qsort(list->touch, list->n, sizeof(Touch), CompareTouches);
  for (PetscInt k = 0; k < list->n; k++)
    if (kept == 0 || CompareTouches(&list->touch[kept - 1], &list->touch[k])) list->touch[kept++] = list->touch[k];
  list->n = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Power(const DemPacking *packing, const PetscReal c[3], PetscInt p)
{
  const PetscReal *x = &packing->x[3 * p];

  return PetscSqr(c[0] - x[0]) + PetscSqr(c[1] - x[1]) + PetscSqr(c[2] - x[2]) - PetscSqr(packing->r[p]);
}

/* Of n particles keep those that can have least power somewhere in the share; heir [n] out, returns how many. */
static PetscInt NearHeirs(const DemPacking *packing, const Orphan *o, Share *share, PetscInt n, const Touch *touch, PetscInt *heir)
{
  const double  *corner;
  const PetscInt n_corners = DemClipCorners(&share->clip, &corner);
  PetscReal      mid[3], radius = 0, least = PETSC_MAX_REAL;
  PetscInt       best = -1, m = 0;

  for (PetscInt c = 0; c < 3; c++) {
    mid[c] = packing->x[3 * o->p + c];
    for (PetscInt v = 0; v < n_corners; v++) mid[c] += o->h * corner[3 * v + c] / n_corners;
  }
  for (PetscInt v = 0; v < n_corners; v++) {
    PetscReal d2 = 0;

    for (PetscInt c = 0; c < 3; c++) d2 += PetscSqr(packing->x[3 * o->p + c] + o->h * corner[3 * v + c] - mid[c]);
    radius = PetscMax(radius, PetscSqrtReal(d2));
  }
  for (PetscInt j = 0; j < n; j++)
    if (Power(packing, mid, touch[j].heir) < least) {
      least = Power(packing, mid, touch[j].heir);
      best = touch[j].heir;
    }
  for (PetscInt j = 0; j < n; j++) { /* within the radius the difference of two powers changes by 2 radius |distance| at most */
    const PetscInt q = touch[j].heir;
    PetscReal      d2 = 0;

    for (PetscInt c = 0; c < 3; c++) d2 += PetscSqr(packing->x[3 * q + c] - packing->x[3 * best + c]);
    if (Power(packing, mid, q) - least <= 2.001 * radius * PetscSqrtReal(d2)) heir[m++] = q;
  }
  return m;
}

/* Cut a pending share among n particles: each keeps what is nearer to it, in power, than to any other. */
static PetscErrorCode CutShare(const DemPacking *packing, PetscInt dim, PetscInt parent, PetscInt n, const Touch *touch, Estate *estate)
{
  const PetscInt orphan = estate->share[parent].orphan, first = estate->n_shares;
  const Orphan  *o = &estate->orphan[orphan];
  PetscInt       m, *heir;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &heir));
  m = NearHeirs(packing, o, &estate->share[parent], n, touch, heir);
  for (PetscInt j = 0; j < m; j++) {
    PetscInt share;

    PetscCall(NewShare(estate, orphan, parent, heir[j], &share)); /* moves estate->share */
  }
  for (PetscInt j = 0; j < m; j++) {
    const PetscReal *a = &packing->x[3 * heir[j]];
    Share           *share = &estate->share[first + j];
    PetscBool        some = PETSC_TRUE;

    PetscCheck(!DemClipCreate(dim, &share->clip) && !DemClipCopy(&share->clip, &estate->share[parent].clip), PETSC_COMM_SELF, PETSC_ERR_MEM,
               "No memory for the cells beside a notch");
    for (PetscInt i = 0; i < m && some; i++) {
      const PetscReal *b = &packing->x[3 * heir[i]];
      PetscReal        normal[3], d = 0, t;

      if (i == j) continue;
      for (PetscInt c = 0; c < 3; c++) {
        normal[c] = b[c] - a[c];
        d += normal[c] * normal[c];
      }
      d = PetscSqrtReal(d);
      t = (d * d + PetscSqr(packing->r[heir[j]]) - PetscSqr(packing->r[heir[i]])) / (2 * d);
      for (PetscInt c = 0; c < 3; c++) {
        normal[c] /= d;
        t += normal[c] * (a[c] - packing->x[3 * o->p + c]);
      }
      PetscCheck(!DemClipCut(&share->clip, normal, t / o->h, HEIR_ID(first + i), &some), PETSC_COMM_SELF, PETSC_ERR_MEM,
                 "No memory for the cells beside a notch");
    }
    if (some)
      share->state = SHARE_GIVEN;
    else
      DemClipDestroy(&share->clip);
  }
  estate->share[parent].state = SHARE_SPLIT;
  PetscCall(PetscFree(heir));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Given shares that no chain of facets joins to their heir's own cell become pending again; *left counts them. */
static PetscErrorCode TakeBackStrays(const DemBody *body, Estate *estate, PetscInt *left)
{
  PetscBool *home; /* by share that is a root: joined to its heir's own cell */

  PetscFunctionBegin;
  *left = 0;
  PetscCall(PetscCalloc1(estate->n_shares, &home));
  for (PetscInt s = 0; s < estate->n_shares; s++) estate->share[s].root = s;
  for (PetscInt pass = 0; pass < 2; pass++)
    for (PetscInt s = 0; s < estate->n_shares; s++) {
      const int    *id, *start;
      const double *corner;
      PetscInt      n;

      if (estate->share[s].state != SHARE_GIVEN) continue;
      n = DemClipFacets(&estate->share[s].clip, &id, &start, &corner);
      for (PetscInt f = 0; f < n; f++) {
        PetscInt heir, sibling, beyond, back;

        if (FacetSize(body, start[f + 1] - start[f], &corner[3 * start[f]]) < SMALL) continue;
        FacetLeads(estate, body, &estate->share[s], id[f], &heir, &sibling, &beyond, &back);
        if (pass == 1 && heir == estate->share[s].heir) home[Root(estate, s)] = PETSC_TRUE;
        for (PetscInt t = sibling >= 0 ? sibling : (beyond >= 0 ? estate->orphan[beyond].first : -1); pass == 0 && t >= 0;
             t = sibling >= 0 ? -1 : estate->share[t].next)
          if (t != s && estate->share[t].state == SHARE_GIVEN && estate->share[t].heir == estate->share[s].heir &&
              (sibling >= 0 || HasFacet(body, &estate->share[t], back)))
            Join(estate, s, t);
      }
    }
  for (PetscInt s = 0; s < estate->n_shares; s++)
    if (estate->share[s].state == SHARE_GIVEN && !home[Root(estate, s)]) {
      estate->share[s].state = SHARE_PENDING;
      (*left)++;
    }
  for (PetscInt s = 0; s < estate->n_shares; s++) estate->share[s].root = s;
  PetscCall(PetscFree(home));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ShareOut(const CellScene *scene, Estate *estate)
{
  const DemBody *body = scene->search->body;
  PetscInt       left = estate->n_orphans, stuck = -1;
  TouchList      list = {0};

  PetscFunctionBegin;
  for (PetscInt round = 0; left && stuck < 0; round++) {
    const PetscInt n = estate->n_shares;

    PetscCall(GroupPending(body, estate, &list));
    for (PetscInt s = 0; s < n && stuck < 0; s++) {
      const PetscInt group = Root(estate, s);
      PetscInt       first = 0, hi = list.n, end;

      if (estate->share[s].state != SHARE_PENDING) continue;
      while (first < hi) {
        const PetscInt m = (first + hi) / 2;

        if (list.touch[m].group < group)
          first = m + 1;
        else
          hi = m;
      }
      for (end = first; end < list.n && list.touch[end].group == group; end++) {
      }
      if (end == first || round == MAX_ROUNDS)
        stuck = s;
      else
        PetscCall(CutShare(scene->packing, body->dim, s, end - first, &list.touch[first], estate));
    }
    if (stuck < 0) PetscCall(TakeBackStrays(body, estate, &left));
  }
  PetscCall(PetscFree(list.touch));
  if (stuck >= 0) {
    const PetscReal *x = &scene->packing->x[3 * estate->orphan[estate->share[stuck].orphan].p];

    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
            "The notch is narrower than the particles beside it allow: a part of the body that the cell of the particle at (%.6g, %.6g, %.6g) m reaches across the "
            "notch has no particle of "
            "its own; use smaller particles",
            (double)x[0], (double)x[1], (double)x[2]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemEstateCreate(const CellScene *scene, PetscInt n_workers, Worker *worker, Estate *estate)
{
  const PetscInt dim = scene->search->body->dim;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(estate, sizeof(*estate)));
  for (PetscInt t = 0; t < n_workers; t++) estate->n_orphans += worker[t].out.n_orphans;
  PetscCall(PetscMalloc1(estate->n_orphans, &estate->orphan));
  PetscCall(PetscCalloc1(scene->packing->n, &estate->has));
  for (PetscInt t = 0, k = 0; t < n_workers; t++) {
    for (PetscInt j = 0; j < worker[t].out.n_orphans; j++, k++) {
      estate->orphan[k] = worker[t].out.orphan[j];
      estate->orphan[k].first = -1;
      estate->has[estate->orphan[k].p] = PETSC_TRUE;
    }
    worker[t].out.n_orphans = 0;
  }
  qsort(estate->orphan, estate->n_orphans, sizeof(Orphan), CompareOrphans);
  for (PetscInt k = 0; k < estate->n_orphans; k++) {
    PetscInt s;

    PetscCall(NewShare(estate, k, -1, -1, &s));
    PetscCheck(!DemClipCreate(dim, &estate->share[s].clip) && !DemClipCopy(&estate->share[s].clip, &estate->orphan[k].clip), PETSC_COMM_SELF, PETSC_ERR_MEM,
               "No memory for the cells beside a notch");
    estate->share[s].state = SHARE_PENDING;
  }
  PetscCall(ShareOut(scene, estate));
  PetscCall(PetscMalloc1(estate->n_shares, &estate->bequest));
  for (PetscInt s = 0; s < estate->n_shares; s++)
    if (estate->share[s].state == SHARE_GIVEN) estate->bequest[estate->n_bequests++] = (Bequest){.heir = estate->share[s].heir, .share = s};
  qsort(estate->bequest, estate->n_bequests, sizeof(Bequest), CompareBequests);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemEstateDestroy(Estate *estate)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < estate->n_orphans; k++) DemClipDestroy(&estate->orphan[k].clip);
  for (PetscInt k = 0; k < estate->n_shares; k++) DemClipDestroy(&estate->share[k].clip);
  PetscCall(PetscFree(estate->orphan));
  PetscCall(PetscFree(estate->share));
  PetscCall(PetscFree(estate->bequest));
  PetscCall(PetscFree(estate->has));
  PetscCall(PetscMemzero(estate, sizeof(*estate)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
