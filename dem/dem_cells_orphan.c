/*
  dem_cells_orphan.c - parts of cells on the far side of a notch go to the particles that live there.

  A power cell knows nothing of the body, so beside a notch narrower than the particles it may reach across. That part
  is taken from its owner and shared out among the particles whose cells it touches, again by least power. On its
  border the owner and the touching particle have equal power and all others more, so the new cells meet the old ones
  without a step, every facet is still a true bisector, and the sums over facets stay exact.  docs/theory.md 3.1
*/
#include "dem_cells_impl.h"
#include <stdlib.h>

static int CompareOrphans(const void *a, const void *b)
{
  const Orphan *o = a, *q = b;

  return o->p != q->p ? (o->p > q->p) - (o->p < q->p) : (o->piece > q->piece) - (o->piece < q->piece);
}

static int CompareBequests(const void *a, const void *b)
{
  const Bequest *o = a, *q = b;

  return o->heir != q->heir ? (o->heir > q->heir) - (o->heir < q->heir) : (o->orphan > q->orphan) - (o->orphan < q->orphan);
}

/* Index of p's orphan in a piece, -1 when that part is p's own. */
static PetscInt FindOrphan(const Estate *estate, PetscInt p, PetscInt piece)
{
  PetscInt lo = 0, hi = estate->n_orphans;

  if (!estate->has[p]) return -1;
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

static PetscInt Root(Estate *estate, PetscInt k)
{
  while (estate->orphan[k].cluster != k) k = estate->orphan[k].cluster;
  return k;
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

/* A particle whose own cell touches a cluster of orphans. */
typedef struct {
  PetscInt cluster, heir;
} Touch;

static int CompareTouches(const void *a, const void *b)
{
  const Touch *s = a, *t = b;

  return s->cluster != t->cluster ? (s->cluster > t->cluster) - (s->cluster < t->cluster) : (s->heir > t->heir) - (s->heir < t->heir);
}

/* Join orphans that touch; list the particles whose own cells touch them. */
static PetscErrorCode FindHeirs(const DemBody *body, Estate *estate, PetscInt *n_touches, Touch **touch)
{
  PetscInt room = 0, n = 0;

  PetscFunctionBegin;
  *touch = NULL;
  for (PetscInt k = 0; k < estate->n_orphans; k++) estate->orphan[k].cluster = k;
  for (PetscInt k = 0; k < estate->n_orphans; k++) {
    Orphan        *o = &estate->orphan[k];
    const int     *id, *start;
    const double  *corner;
    const PetscInt facets = DemClipFacets(&o->clip, &id, &start, &corner);

    for (PetscInt f = 0; f < facets; f++) {
      PetscInt other = -1;

      if (FacetSize(body, start[f + 1] - start[f], &corner[3 * start[f]]) < 1e-12) continue;
      if (id[f] >= 0) {
        other = FindOrphan(estate, id[f], o->piece);
        if (other < 0) {
          if (n == room) {
            room = PetscMax(256, 2 * room);
            PetscCall(PetscRealloc(room * sizeof(Touch), touch));
          }
          (*touch)[n++] = (Touch){.cluster = k, .heir = id[f]};
        }
      } else if (id[f] <= PLANE_ID(0) && body->beyond[-10 - id[f]] >= 0) {
        other = FindOrphan(estate, o->p, body->beyond[-10 - id[f]]);
      }
      if (other >= 0) {
        const PetscInt a = Root(estate, k), b = Root(estate, other);

        estate->orphan[PetscMax(a, b)].cluster = PetscMin(a, b);
      }
    }
  }
  for (PetscInt k = 0; k < n; k++) (*touch)[k].cluster = Root(estate, (*touch)[k].cluster);
  qsort(*touch, n, sizeof(Touch), CompareTouches);
  *n_touches = 0;
  for (PetscInt k = 0; k < n; k++)
    if (*n_touches == 0 || CompareTouches(&(*touch)[*n_touches - 1], &(*touch)[k])) (*touch)[(*n_touches)++] = (*touch)[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Power(const DemPacking *packing, const PetscReal c[3], PetscInt p)
{
  const PetscReal *x = &packing->x[3 * p];

  return PetscSqr(c[0] - x[0]) + PetscSqr(c[1] - x[1]) + PetscSqr(c[2] - x[2]) - PetscSqr(packing->r[p]);
}

/* Share one orphan out among n heirs: each keeps what is nearer to it, in power, than to any other. */
static PetscErrorCode ShareOrphan(const CellScene *scene, PetscInt k, PetscInt n, const Touch *touch, Estate *estate)
{
  const DemPacking *packing = scene->packing;
  const PetscInt    dim = scene->search->body->dim;
  Orphan           *o = &estate->orphan[k];
  const double     *corner;
  const PetscInt    n_corners = DemClipCorners(&o->clip, &corner);
  PetscReal         mid[3], radius = 0, least = PETSC_MAX_REAL;
  PetscInt          best = -1, m = 0, *heir;

  PetscFunctionBegin;
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
  PetscCall(PetscMalloc1(n, &heir));
  for (PetscInt j = 0; j < n; j++) { /* within the radius, power differs by at most 2 radius |distance| more */
    const PetscInt q = touch[j].heir;
    PetscReal      d2 = 0;

    for (PetscInt c = 0; c < 3; c++) d2 += PetscSqr(packing->x[3 * q + c] - packing->x[3 * best + c]);
    if (Power(packing, mid, q) - least <= 2.001 * radius * PetscSqrtReal(d2)) heir[m++] = q;
  }
  for (PetscInt j = 0; j < m; j++) {
    const PetscReal *a = &packing->x[3 * heir[j]];
    PetscBool        some = PETSC_TRUE;
    DemClip          clip;

    PetscCheck(!DemClipCreate(dim, &clip) && !DemClipCopy(&clip, &o->clip), PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for the cells beside a notch");
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
      PetscCheck(!DemClipCut(&clip, normal, t / o->h, HEIR_ID(heir[i]), &some), PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for the cells beside a notch");
    }
    if (!some) {
      DemClipDestroy(&clip);
      continue;
    }
    if (estate->n_bequests == estate->room_bequests) {
      estate->room_bequests = PetscMax(256, 2 * estate->room_bequests);
      PetscCall(PetscRealloc(estate->room_bequests * sizeof(Bequest), &estate->bequest));
    }
    estate->bequest[estate->n_bequests++] = (Bequest){.heir = heir[j], .orphan = k, .clip = clip};
  }
  PetscCall(PetscFree(heir));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemEstateCreate(const CellScene *scene, PetscInt n_workers, Worker *worker, Estate *estate)
{
  Touch   *touch;
  PetscInt n_touches = 0;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(estate, sizeof(*estate)));
  for (PetscInt t = 0; t < n_workers; t++) estate->n_orphans += worker[t].out.n_orphans;
  PetscCall(PetscMalloc1(estate->n_orphans, &estate->orphan));
  PetscCall(PetscCalloc1(scene->packing->n, &estate->has));
  for (PetscInt t = 0, k = 0; t < n_workers; t++) {
    for (PetscInt j = 0; j < worker[t].out.n_orphans; j++, k++) {
      estate->orphan[k] = worker[t].out.orphan[j];
      estate->has[estate->orphan[k].p] = PETSC_TRUE;
    }
    worker[t].out.n_orphans = 0;
  }
  qsort(estate->orphan, estate->n_orphans, sizeof(Orphan), CompareOrphans);
  PetscCall(FindHeirs(scene->search->body, estate, &n_touches, &touch));
  for (PetscInt k = 0; k < estate->n_orphans; k++) {
    const PetscInt cluster = Root(estate, k);
    PetscInt       first = 0, hi = n_touches, end;

    while (first < hi) {
      const PetscInt m = (first + hi) / 2;

      if (touch[m].cluster < cluster)
        first = m + 1;
      else
        hi = m;
    }
    for (end = first; end < n_touches && touch[end].cluster == cluster; end++) {
    }
    if (end == first) {
      const PetscReal *x = &scene->packing->x[3 * estate->orphan[k].p];

      PetscCall(PetscFree(touch));
      SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
              "The notch is narrower than the particles beside it allow: a part of the body that the cell of the particle at (%g, %g, %g) m reaches across the "
              "notch has no particle of "
              "its own; use smaller particles",
              (double)x[0], (double)x[1], (double)x[2]);
    }
    PetscCall(ShareOrphan(scene, k, end - first, &touch[first], estate));
  }
  qsort(estate->bequest, estate->n_bequests, sizeof(Bequest), CompareBequests);
  PetscCall(PetscFree(touch));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemEstateDestroy(Estate *estate)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < estate->n_orphans; k++) DemClipDestroy(&estate->orphan[k].clip);
  for (PetscInt k = 0; k < estate->n_bequests; k++) DemClipDestroy(&estate->bequest[k].clip);
  PetscCall(PetscFree(estate->orphan));
  PetscCall(PetscFree(estate->bequest));
  PetscCall(PetscFree(estate->has));
  PetscCall(PetscMemzero(estate, sizeof(*estate)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
