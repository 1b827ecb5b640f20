/*
  coupling_contact.c - contacts of particles with the moving surface: found, carried over from step to step, and their forces.

  Where a particle touches, F acts on it at the foot of its centre on the surface, and -N_a F on the nodes a around, N_a their
  shape functions there. Feet are looked for by threads; forces are summed by one, in the particles' order: the same bits for
  any number of threads. The law is dem_contact.h's.  Eqs (5.70)-(5.75), docs/theory.md
*/
#include "coupling_contact_impl.h"
#include <omp.h>

#define SAME_CONTACT 0.8 /* cosine between the normals of one contact a step apart: 37 degrees, as with tools */

static PetscReal Distance2(const PetscReal *a, const PetscReal *b)
{
  return PetscSqr(a[0] - b[0]) + PetscSqr(a[1] - b[1]) + PetscSqr(a[2] - b[2]);
}

static void Cross(const PetscReal a[3], const PetscReal b[3], PetscReal c[3])
{
  c[0] = a[1] * b[2] - a[2] * b[1];
  c[1] = a[2] * b[0] - a[0] * b[2];
  c[2] = a[0] * b[1] - a[1] * b[0];
}

static void Centre(const DemState *ds, PetscInt p, PetscReal x[3])
{
  for (PetscInt d = 0; d < 3; d++) x[d] = d < ds->dim ? ds->x0[d * ds->n + p] + ds->u[d * ds->n + p] : 0;
}

/* Who is near enough to be tried until something has moved by half the skin.  Eq. (5.78) */
static PetscErrorCode Look(CouplingContact c, const DemState *ds, const DemOutside *o)
{
  const PetscReal half2 = PetscSqr(0.5 * c->skin);
  PetscReal       moved = 0;
  PetscBool       fresh = (PetscBool)(c->seen == o->looks && c->looks > 0);

  PetscFunctionBegin;
  for (PetscInt i = 0; i < c->surface.n_nodes; i++) moved = PetscMax(moved, Distance2(&c->surface.x[3 * i], &c->x_grid[3 * i]));
  if (moved > half2 || !c->grids) {
    PetscCall(DemSurfaceRegrid(&c->surface));
    PetscCall(PetscArraycpy(c->x_grid, c->surface.x, 3 * c->surface.n_nodes));
    c->grids++;
    fresh = PETSC_FALSE;
  }
  for (PetscInt k = 0; fresh && k < o->n; k++) {
    PetscReal x[3];

    Centre(ds, o->who[k], x);
    if (Distance2(x, &c->x_look[3 * k]) > half2) fresh = PETSC_FALSE;
  }
  if (fresh) PetscFunctionReturn(PETSC_SUCCESS);
  if (o->n > c->room_outside) {
    PetscCall(PetscFree4(c->x_look, c->candidate, c->n_touch, c->touch));
    PetscCall(PetscMalloc4(3 * o->n, &c->x_look, o->n, &c->candidate, o->n, &c->n_touch, DEM_TOUCHES * o->n, &c->touch));
    c->room_outside = o->n;
  }
  c->n_candidates = 0;
  for (PetscInt k = 0; k < o->n; k++) {
    Centre(ds, o->who[k], &c->x_look[3 * k]);
    if (DemSurfaceNear(&c->surface, &c->x_look[3 * k])) c->candidate[c->n_candidates++] = o->who[k];
  }
  c->seen = o->looks;
  c->looks++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Velocity of the surface at a point of a cell, and its spin: how the cell turns.  Eqs (5.71), (5.74) */
static void SurfaceMotion(CouplingContact c, const FemState *fs, PetscInt cell, const PetscReal share[3], PetscReal v[3], PetscReal spin[3], PetscReal lever[3][3])
{
  const DemSurface *s = &c->surface;
  const PetscReal  *n = &s->normal[3 * cell];
  const PetscInt   *corner = &s->corner[s->dim * cell];
  PetscReal         area2 = 1;

  if (s->dim == 3) { /* lever_k = n x grad N_k = -(opposite side) / (2 area) */
    PetscReal a[3], b[3], w[3];

    for (PetscInt d = 0; d < 3; d++) {
      a[d] = s->x[3 * corner[1] + d] - s->x[3 * corner[0] + d];
      b[d] = s->x[3 * corner[2] + d] - s->x[3 * corner[0] + d];
    }
    Cross(a, b, w);
    area2 = PetscSqrtReal(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  }
  for (PetscInt d = 0; d < 3; d++) v[d] = spin[d] = 0;
  for (PetscInt k = 0; k < s->dim; k++) {
    const PetscInt *carrier = &c->carrier[CONTACT_NODES * corner[k]], m = CouplingCarriers(carrier);
    PetscReal       w[3] = {0, 0, 0}, along, turn;

    for (PetscInt a = 0; a < m; a++)
      for (PetscInt d = 0; d < fs->dim; d++) w[d] += fs->v[carrier[a] * fs->dim + d] / m;
    if (s->dim == 3)
      for (PetscInt d = 0; d < 3; d++) lever[k][d] = (s->x[3 * corner[(k + 1) % 3] + d] - s->x[3 * corner[(k + 2) % 3] + d]) / area2;
    else {
      PetscReal gradient[3] = {0, 0, 0}, length2 = 0;

      for (PetscInt d = 0; d < 2; d++) {
        gradient[d] = s->x[3 * corner[k] + d] - s->x[3 * corner[1 - k] + d];
        length2 += gradient[d] * gradient[d];
      }
      for (PetscInt d = 0; d < 2; d++) gradient[d] /= length2;
      Cross(n, gradient, lever[k]);
    }
    along = n[0] * w[0] + n[1] * w[1] + n[2] * w[2];
    turn  = lever[k][0] * w[0] + lever[k][1] * w[1] + lever[k][2] * w[2];
    for (PetscInt d = 0; d < 3; d++) {
      v[d] += share[k] * w[d];
      spin[d] += -lever[k][d] * along + 0.5 * n[d] * turn;
    }
  }
}

/* Velocity of the particle relative to the surface at the foot, `arm` along -n from its centre; both spins. */
static void Relative(CouplingContact c, const FemState *fs, const DemState *ds, const CouplingTouch *t, PetscReal arm, PetscReal v[3], PetscReal spin[3], PetscReal under[3], PetscReal lever[3][3])
{
  const PetscInt n = ds->n, p = t->p;
  PetscReal      surface[3];

  SurfaceMotion(c, fs, t->cell, t->share, surface, under, lever);
  for (PetscInt d = 0; d < 3; d++) spin[d] = ds->dim == 3 ? ds->spin[d * n + p] : d == 2 ? ds->spin[p] : 0;
  for (PetscInt d = 0; d < 3; d++) {
    const PetscInt i = (d + 1) % 3, j = (d + 2) % 3;

    v[d] = d < ds->dim ? ds->v[d * n + p] - surface[d] - arm * (spin[i] * t->n[j] - spin[j] * t->n[i]) : 0;
  }
}

static void Part(CouplingContact c, const FemState *fs, const DemState *ds, PetscReal radius, PetscReal dt, CouplingTouch *t)
{
  PetscReal v[3], spin[3], under[3], lever[3][3], friction, damping;

  Relative(c, fs, ds, t, radius, v, spin, under, lever);
  DemContactPart(&c->pair, v, radius, t->size, dt, c->turns, &t->history, &friction, &damping);
  c->friction += friction;
  c->damping += damping;
}

/* Force and couple to the nodes of the cell, by shape functions.  Eqs (5.72), (5.75) */
static void GiveNodes(CouplingContact c, FemState *fs, const CouplingTouch *t, const PetscReal f[3], const PetscReal couple[3], PetscReal lever[3][3])
{
  const DemSurface *s = &c->surface;
  const PetscReal  *n = &s->normal[3 * t->cell], about = n[0] * couple[0] + n[1] * couple[1] + n[2] * couple[2];

  for (PetscInt k = 0; k < s->dim; k++) {
    const PetscInt *carrier = &c->carrier[CONTACT_NODES * s->corner[s->dim * t->cell + k]], m = CouplingCarriers(carrier);
    const PetscReal tilt    = lever[k][0] * couple[0] + lever[k][1] * couple[1] + lever[k][2] * couple[2];

    for (PetscInt a = 0; a < m; a++)
      for (PetscInt d = 0; d < fs->dim; d++) fs->f_ext[carrier[a] * fs->dim + d] -= (t->share[k] * f[d] + (c->turns ? 0.5 * lever[k][d] * about - n[d] * tilt : 0)) / m;
  }
}

/* Stiffness on the nodes, for what the step must carry; sign -1 takes it off again. Returns the largest rate among them. */
static PetscReal Press(CouplingContact c, const FemState *fs, const CouplingTouch *t, PetscReal k)
{
  PetscReal most = 0;

  for (PetscInt i = 0; i < c->dim; i++) {
    const PetscInt *carrier = &c->carrier[CONTACT_NODES * c->surface.corner[c->dim * t->cell + i]], m = CouplingCarriers(carrier);

    for (PetscInt a = 0; a < m; a++) {
      if (k == 0) c->press[carrier[a]] = 0;
      else most = PetscMax(most, (c->press[carrier[a]] += k * t->share[i] / m) / fs->mass[carrier[a]]);
    }
  }
  return most;
}

/* Force of one touch into both sides; t holds the history of the step before. */
static PetscErrorCode Act(CouplingContact c, FemState *fs, DemState *ds, PetscReal radius, PetscReal distance, PetscReal dt, CouplingTouch *t)
{
  const PetscInt   n = ds->n, p = t->p;
  DemContactMotion m;
  DemContactForce  f;
  PetscReal        under[3], lever[3][3], moment[3];

  PetscFunctionBegin;
  for (PetscInt d = 0; d < 3; d++) m.n[d] = t->n[d];
  m.overlap = radius - distance;
  Relative(c, fs, ds, t, distance, m.v, m.spin, under, lever);
  m.turn = 0;
  for (PetscInt d = 0; d < 3; d++) {
    m.turn += 0.5 * (m.spin[d] + under[d]) * m.n[d];
    m.spin[d] -= under[d];
  }
  m.radius = radius;
  m.size = t->size = c->dim == 2 ? 0.5 * c->options.thickness : radius;
  m.mass           = ds->mass[p]; /* as against a wall: a mass of nodes would depend on the mesh */
  if (c->turns) DemContactStep(&c->pair, &m, dt, 1, &t->history, &f);
  else DemContactStep(&c->pair, &m, dt, 0, &t->history, &f);
  t->energy = DemContactEnergy(&c->pair, m.radius, m.size, m.overlap, &t->history);
  Cross(t->n, f.force, moment);
  for (PetscInt d = 0; d < 3; d++) {
    ds->f_ext[d * n + p] += d < c->dim ? f.force[d] : 0;
    if (c->dim == 3 || d == 2) ds->t_ext[d * n + p] += f.couple[d] - distance * moment[d];
    c->force[d] -= f.force[d];
  }
  GiveNodes(c, fs, t, f.force, f.couple, lever);
  c->friction += f.friction;
  c->damping += f.damping;
  c->deepest = PetscMax(c->deepest, m.overlap / radius);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All touches of candidate k: matched to the contacts old [from, to) of its particle by their normals. */
static PetscErrorCode ActAll(CouplingContact c, FemState *fs, DemState *ds, const DemOutside *o, PetscInt k, PetscInt from, PetscInt to, PetscReal dt, PetscInt *count)
{
  const PetscInt p = c->candidate[k];
  PetscBool      taken[DEM_TOUCHES] = {PETSC_FALSE};
  PetscReal      x[3];

  PetscFunctionBegin;
  Centre(ds, p, x);
  for (PetscInt i = 0; i < c->n_touch[k]; i++) {
    const DemTouch *touch = &c->touch[DEM_TOUCHES * k + i];
    CouplingTouch  *t     = &c->next[(*count)++];
    PetscReal       best = SAME_CONTACT, inside;
    PetscInt        match = -1;

    PetscCall(PetscMemzero(t, sizeof(*t)));
    for (PetscInt j = from; j < to; j++) {
      const PetscReal cosine = c->contact[j].n[0] * touch->n[0] + c->contact[j].n[1] * touch->n[1] + c->contact[j].n[2] * touch->n[2];

      if (!taken[j - from] && cosine > best) {
        best  = cosine;
        match = j;
      }
    }
    if (match >= 0) {
      *t                  = c->contact[match];
      taken[match - from] = PETSC_TRUE;
    }
    t->p = p;
    for (PetscInt d = 0; d < 3; d++) t->n[d] = touch->n[d];
    DemSurfaceFoot(&c->surface, touch, x, &t->cell, t->share);
    inside = t->n[0] * c->surface.normal[3 * t->cell] + t->n[1] * c->surface.normal[3 * t->cell + 1] + t->n[2] * c->surface.normal[3 * t->cell + 2];
    if (touch->kind == 0) /* a face met from behind: the centre lies in the body */
      PetscCheck(inside > 0, c->comm, PETSC_ERR_NOT_CONVERGED, "At time %.6g s the centre of particle %" PetscInt_FMT " is inside the body '%s', near (%.6g, %.6g, %.6g) m: the contact is too soft for this impact; give it a larger stiffness", (double)c->time,
                 ds->number[p], c->name, (double)x[0], (double)x[1], (double)x[2]);
    PetscCall(Act(c, fs, ds, o->radius[p], touch->distance, dt, t));
  }
  for (PetscInt j = from; j < to; j++)
    if (!taken[j - from]) Part(c, fs, ds, o->radius[p], dt, &c->contact[j]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The step was made for so much stiffness on a node and on a particle; more than it can carry stops the run.  Eq. (5.77) */
static PetscErrorCode Watch(CouplingContact c, const FemState *fs, const DemState *ds, PetscReal dt)
{
  PetscReal node = 0, particle = 0, fem, dem;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < c->n;) {
    const PetscInt  p = c->contact[k].p;
    PetscReal       sum = 0;
    const PetscReal turn = c->pair.mu_static > 0 ? c->pair.ratio * (1 + ds->mass[p] * PetscSqr(c->largest) / ds->inertia[p]) : 0, side = c->pair.mu_static > 0 ? c->pair.ratio : 0;

    for (; k < c->n && c->contact[k].p == p; k++) {
      const PetscReal S = DemContactStiffness(&c->pair, c->contact[k].size, PetscAbsReal(c->contact[k].history.overlap));

      sum += S;
      node = PetscMax(node, Press(c, fs, &c->contact[k], S * PetscMax(1, side)));
    }
    particle = PetscMax(particle, sum / ds->mass[p] * PetscMax(1, turn));
  }
  for (PetscInt k = 0; k < c->n; k++) (void)Press(c, fs, &c->contact[k], 0);
  if (node + particle <= c->rate) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(c->fem_stepper.stable_step(c->fem_stepper.ctx, &fem));
  PetscCall(c->dem_stepper.stable_step(c->dem_stepper.ctx, &dem));
  PetscCheck(CouplingContactLimit_Internal(fem, dem, node + particle, c->drag, dt) <= 1, c->comm, PETSC_ERR_NOT_CONVERGED,
             "At time %.6g s particles press on '%s' more stiffly than the step of %.4g s can carry (%" PetscInt_FMT " contacts, deepest %.3g radii); give a smaller time.step or time.safety", (double)c->time, c->name, (double)dt, c->n,
             (double)c->deepest);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingContactForces_Internal(CouplingContact c, PetscReal dt)
{
  DemOutside     o;
  FemState       fs;
  DemState       ds;
  PetscInt       count = 0, at = 0, most = 0;
  CouplingTouch *swap;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(c->fem, &fs));
  PetscCall(DemModelGetState(c->dem, &ds));
  PetscCall(DemModelGetOutside(c->dem, &o));
  PetscCall(DemModelGetTime(c->dem, &c->time));
  CouplingContactMove_Internal(c, &fs);
  PetscCall(Look(c, &ds, &o));
  for (PetscInt k = 0; k < c->n; k++) /* what the step before gave them */
    for (PetscInt d = 0; d < 3; d++) ds.f_ext[d * ds.n + c->contact[k].p] = ds.t_ext[d * ds.n + c->contact[k].p] = 0;
  for (PetscInt d = 0; d < 3; d++) c->force[d] = 0;
  if (c->n_candidates || c->n) {
    DemSurfaceNormals(&c->surface);
#pragma omp parallel for schedule(static) num_threads((int)c->threads) if (c->n_candidates > 64) reduction(+ : most)
    for (PetscInt k = 0; k < c->n_candidates; k++) {
      PetscReal x[3];

      Centre(&ds, c->candidate[k], x);
      c->n_touch[k] = DemSurfaceTouch(&c->surface, x, o.radius[c->candidate[k]], &c->touch[DEM_TOUCHES * k]);
      most += c->n_touch[k];
    }
    if (most > c->room) {
      CouplingTouch *grown, *other;

      PetscCall(PetscMalloc1(2 * most, &grown)); /* apart: they change places */
      PetscCall(PetscMalloc1(2 * most, &other));
      PetscCall(PetscArraycpy(grown, c->contact, c->n));
      PetscCall(PetscFree(c->contact));
      PetscCall(PetscFree(c->next));
      c->contact = grown;
      c->next    = other;
      c->room    = 2 * most;
    }
    for (PetscInt k = 0; k < c->n_candidates; k++) {
      const PetscInt p = c->candidate[k];
      PetscInt       from;

      for (; at < c->n && c->contact[at].p < p; at++) Part(c, &fs, &ds, o.radius[c->contact[at].p], dt, &c->contact[at]);
      from = at;
      while (at < c->n && c->contact[at].p == p) at++;
      if (c->n_touch[k] || at > from) PetscCall(ActAll(c, &fs, &ds, &o, k, from, at, dt, &count));
    }
    for (; at < c->n; at++) Part(c, &fs, &ds, o.radius[c->contact[at].p], dt, &c->contact[at]);
    swap       = c->contact;
    c->contact = c->next;
    c->next    = swap;
    c->n       = count;
    if (dt > 0) PetscCall(Watch(c, &fs, &ds, dt));
  }
  PetscCall(DemModelRestoreState(c->dem, &ds));
  PetscCall(FemModelRestoreState(c->fem, &fs));
  PetscFunctionReturn(PETSC_SUCCESS);
}
