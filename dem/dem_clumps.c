/*
  dem_clumps.c - clumps of spheres in a model: one rigid body each.  Eqs (5.95)-(5.99)

  The spheres meet tools, other grains and bodies of finite elements as particles do. What they feel is summed, in a fixed
  order, to force and couple of their clump; it moves as a free tool does (leapfrog; angular momentum in space, which only
  a couple changes; exact rotations about the principal axes), and its spheres are set where it carries them. A sphere's
  velocity is its displacement in the step over the step, so the power of a contact is that of its clump to second order.
*/
#include "dem_impl.h"

static void Product(const PetscReal a[4], const PetscReal b[4], PetscReal c[4])
{
  const PetscReal r[4] = {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2], a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
                          a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1]};

  for (PetscInt k = 0; k < 4; k++) c[k] = r[k];
}

static void Matrix(const PetscReal q[4], PetscReal R[3][3])
{
  const PetscReal w = q[0], x = q[1], y = q[2], z = q[3];
  const PetscReal r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)}, {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)}, {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};

  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) R[i][j] = r[i][j];
}

/* Quaternion of a rotation matrix: from the largest of its squares, so no division is by a small number. */
static void FromMatrix(PetscReal R[3][3], PetscReal q[4])
{
  const PetscReal square[4] = {1 + R[0][0] + R[1][1] + R[2][2], 1 + R[0][0] - R[1][1] - R[2][2], 1 - R[0][0] + R[1][1] - R[2][2], 1 - R[0][0] - R[1][1] + R[2][2]};
  PetscInt        k = 0;
  PetscReal       f;

  for (PetscInt i = 1; i < 4; i++)
    if (square[i] > square[k]) k = i;
  f    = 0.5 / PetscSqrtReal(square[k]);
  q[k] = 0.5 * PetscSqrtReal(square[k]);
  if (k == 0) {
    for (PetscInt d = 0; d < 3; d++) q[1 + d] = f * (R[(d + 2) % 3][(d + 1) % 3] - R[(d + 1) % 3][(d + 2) % 3]);
    return;
  }
  for (PetscInt d = 0; d < 3; d++)
    if (d != k - 1) q[1 + d] = f * (R[d][k - 1] + R[k - 1][d]);
  q[0] = f * (R[(k + 1) % 3][k % 3] - R[k % 3][(k + 1) % 3]);
}

/* w = R I^-1 R^T L */
static void Spin(const PetscReal R[3][3], const PetscReal moments[3], const PetscReal L[3], PetscReal w[3])
{
  for (PetscInt d = 0; d < 3; d++) w[d] = 0;
  for (PetscInt k = 0; k < 3; k++) {
    const PetscReal along = (R[0][k] * L[0] + R[1][k] * L[1] + R[2][k] * L[2]) / moments[k];

    for (PetscInt d = 0; d < 3; d++) w[d] += along * R[d][k];
  }
}

PetscErrorCode DemModelSetClumps(DemModel model, PetscInt n, const DemClumpPlace place[])
{
  PetscInt covered = 0;

  PetscFunctionBegin;
  PetscCheck(model->packing.n && !model->ready && !model->clumps.n, model->comm, PETSC_ERR_ORDER, "Clumps are given once, between DemModelSetBody() and DemModelSetUp()");
  BaseCheckInput(model->dim == 3 && !model->bonded, model->comm, "Clumps are loose grains in three dimensions");
  BaseCheckInput(model->alpha == 0, model->comm, "Clumps take no local damping; contacts damp them (restitution)");
  for (PetscInt k = 0; k < n; k++) {
    PetscCheck(place[k].first >= covered && place[k].first + place[k].shape->n <= model->packing.n, model->comm, PETSC_ERR_ARG_OUTOFRANGE, "Clump %" PetscInt_FMT " begins at sphere %" PetscInt_FMT " of %" PetscInt_FMT, k, place[k].first,
               model->packing.n);
    covered = place[k].first + place[k].shape->n;
  }
  model->clumps.n     = n;
  model->clumps.place = place;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Spheres to where their clump is; velocity and spin are the caller's. */
static void Carry(DemModel model, PetscInt k, const PetscReal R[3][3])
{
  const DemClumps *c = &model->clumps;
  const PetscInt   n = model->n;
  const PetscReal  back[4] = {c->frame[4 * k], -c->frame[4 * k + 1], -c->frame[4 * k + 2], -c->frame[4 * k + 3]};
  PetscReal        turn[4];

  Product(&c->q[4 * k], back, turn);
  for (PetscInt i = c->start[k]; i < c->start[k + 1]; i++) {
    const PetscInt   p = c->member[i];
    const PetscReal *b = &c->arm[3 * i];

    for (PetscInt d = 0; d < 3; d++) model->u[d * n + p] = c->x0[3 * k + d] + c->u[3 * k + d] + (R[d][0] * b[0] + R[d][1] * b[1] + R[d][2] * b[2]) - model->x0[d * n + p];
    for (PetscInt d = 0; d < 4; d++) model->rot[d * n + p] = turn[d];
  }
}

PetscErrorCode DemSetUpClumps_Internal(DemModel model)
{
  DemClumps     *c = &model->clumps;
  const PetscInt n = model->n;
  PetscInt       all = 0;

  PetscFunctionBegin;
  if (!c->n) PetscFunctionReturn(PETSC_SUCCESS);
  BaseCheckInput(model->alpha == 0, model->comm, "Clumps take no local damping; contacts damp them (restitution)");
  for (PetscInt k = 0; k < c->n; k++) all += c->place[k].shape->n;
  PetscCall(PetscMalloc4(c->n + 1, &c->start, all, &c->member, 3 * all, &c->arm, n, &c->of));
  PetscCall(PetscMalloc4(c->n, &c->mass, 3 * c->n, &c->moments, c->n, &c->reach, 4 * c->n, &c->frame));
  PetscCall(PetscCalloc3(3 * c->n, &c->x0, 3 * c->n, &c->u, 3 * c->n, &c->v));
  PetscCall(PetscCalloc4(4 * c->n, &c->q, 3 * c->n, &c->L, 3 * c->n, &c->force, 3 * c->n, &c->couple));
  for (PetscInt p = 0; p < n; p++) c->of[p] = -1;
  c->start[0] = 0;
  for (PetscInt k = 0; k < c->n; k++) {
    const DemClumpPlace *place = &c->place[k];
    const DemClump      *shape = place->shape;
    const PetscReal      s = place->scale, s3 = s * s * s, density = (model->grain_of ? &model->grain_kind[model->grain_of[place->first]] : &model->material)->density;
    PetscReal            axes[3][3], R[3][3];

    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < 3; j++) axes[i][j] = shape->axes[i][j];
    FromMatrix(axes, &c->frame[4 * k]);
    Product(place->quaternion, &c->frame[4 * k], &c->q[4 * k]);
    Matrix(&c->q[4 * k], R);
    c->mass[k]  = shape->mass > 0 ? shape->mass * s3 : density * shape->volume * s3;
    c->reach[k] = shape->reach * s;
    for (PetscInt d = 0; d < 3; d++) {
      c->moments[3 * k + d] = (shape->mass > 0 ? 1 : density) * shape->moments[d] * s3 * s * s;
      c->x0[3 * k + d]      = place->centre[d];
      c->v[3 * k + d]       = model->v[d * n + model->rank_of[place->first]];
    }
    c->start[k + 1] = c->start[k] + shape->n;
    for (PetscInt i = 0; i < shape->n; i++) {
      const PetscInt p = model->rank_of[place->first + i];

      c->member[c->start[k] + i] = p;
      c->of[p]                   = k;
      for (PetscInt j = 0; j < 3; j++) {
        c->arm[3 * (c->start[k] + i) + j] = 0;
        for (PetscInt d = 0; d < 3; d++) c->arm[3 * (c->start[k] + i) + j] += s * shape->axes[d][j] * shape->x[3 * i + d];
      }
      /* what a contact's dashpot feels; the sphere's own inertia is never used */
      model->mass[p]    = c->mass[k];
      model->inertia[p] = c->mass[k] * PetscSqr(c->reach[k]);
    }
    Carry(model, k, (const PetscReal(*)[3])R);
  }
  c->place = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemClumpsDestroy_Internal(DemModel model)
{
  DemClumps *c = &model->clumps;

  PetscFunctionBegin;
  PetscCall(PetscFree4(c->start, c->member, c->arm, c->of));
  PetscCall(PetscFree4(c->mass, c->moments, c->reach, c->frame));
  PetscCall(PetscFree3(c->x0, c->u, c->v));
  PetscCall(PetscFree4(c->q, c->L, c->force, c->couple));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetClump(DemModel model, PetscInt k, DemClumpState *s)
{
  const DemClumps *c = &model->clumps;
  PetscReal        back[4];

  PetscFunctionBegin;
  PetscCheck(model->ready && k >= 0 && k < c->n, model->comm, PETSC_ERR_ARG_OUTOFRANGE, "Clump %" PetscInt_FMT " of %" PetscInt_FMT ", after set-up", k, c->n);
  s->mass = c->mass[k];
  for (PetscInt d = 0; d < 3; d++) {
    s->moments[d]  = c->moments[3 * k + d];
    s->centre[d]   = c->x0[3 * k + d] + c->u[3 * k + d];
    s->velocity[d] = c->v[3 * k + d];
    s->momentum[d] = c->L[3 * k + d];
  }
  for (PetscInt d = 0; d < 4; d++) back[d] = (d ? -1 : 1) * c->frame[4 * k + d];
  Product(&c->q[4 * k], back, s->quaternion);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetClumpMotion(DemModel model, PetscInt k, const PetscReal velocity[3], const PetscReal spin[3])
{
  DemClumps     *c = &model->clumps;
  const PetscInt n = model->n;
  PetscReal      R[3][3];

  PetscFunctionBegin;
  PetscCheck(model->ready && !model->started && k >= 0 && k < c->n, model->comm, PETSC_ERR_ORDER, "A clump is given its motion between set-up and the first step");
  Matrix(&c->q[4 * k], R);
  for (PetscInt d = 0; d < 3; d++) c->L[3 * k + d] = 0;
  for (PetscInt j = 0; j < 3; j++) {
    const PetscReal along = c->moments[3 * k + j] * (R[0][j] * spin[0] + R[1][j] * spin[1] + R[2][j] * spin[2]);

    for (PetscInt d = 0; d < 3; d++) c->L[3 * k + d] += along * R[d][j];
  }
  for (PetscInt d = 0; d < 3; d++) c->v[3 * k + d] = velocity[d];
  for (PetscInt i = c->start[k]; i < c->start[k + 1]; i++) {
    const PetscInt p = c->member[i];
    PetscReal      a[3];

    for (PetscInt d = 0; d < 3; d++) a[d] = R[d][0] * c->arm[3 * i] + R[d][1] * c->arm[3 * i + 1] + R[d][2] * c->arm[3 * i + 2];
    for (PetscInt d = 0; d < 3; d++) {
      model->spin[d * n + p] = spin[d];
      model->v[d * n + p]    = velocity[d] + spin[(d + 1) % 3] * a[(d + 2) % 3] - spin[(d + 2) % 3] * a[(d + 1) % 3];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void DemClumpsUnweigh_Internal(DemModel model)
{
  const DemClumps *c = &model->clumps;
  const PetscInt   n = model->n;

  for (PetscInt i = 0; c->n && i < c->start[c->n]; i++)
    for (PetscInt d = 0; d < 3; d++) model->f[d * n + c->member[i]] = 0;
}

/* Eq. (5.95) */
void DemClumpsGather_Internal(DemModel model)
{
  DemClumps     *c = &model->clumps;
  const PetscInt n = model->n;

  if (!c->n) return;
#pragma omp parallel for schedule(static) num_threads((int)model->threads)
  for (PetscInt k = 0; k < c->n; k++) {
    PetscReal F[3], T[3] = {0, 0, 0};

    if (model->contacts.gone && model->contacts.gone[c->member[c->start[k]]]) {
      for (PetscInt d = 0; d < 3; d++) c->force[3 * k + d] = c->couple[3 * k + d] = 0;
      continue;
    }
    for (PetscInt d = 0; d < 3; d++) F[d] = c->mass[k] * model->gravity[d];
    for (PetscInt i = c->start[k]; i < c->start[k + 1]; i++) {
      const PetscInt p = c->member[i];
      PetscReal      a[3], f[3];

      for (PetscInt d = 0; d < 3; d++) {
        a[d] = model->x0[d * n + p] + model->u[d * n + p] - c->x0[3 * k + d] - c->u[3 * k + d];
        f[d] = model->f[d * n + p];
        F[d] += f[d];
      }
      for (PetscInt d = 0; d < 3; d++) T[d] += model->torque[d * n + p] + a[(d + 1) % 3] * f[(d + 2) % 3] - a[(d + 2) % 3] * f[(d + 1) % 3];
    }
    for (PetscInt d = 0; d < 3; d++) {
      c->force[3 * k + d]  = F[d];
      c->couple[3 * k + d] = T[d];
    }
  }
}

/* One rotation about principal axis k: the momentum along the axes turns back as they turn on.  Eq. (5.64) */
static void TurnAbout(PetscInt k, PetscReal dt, const PetscReal moments[3], PetscReal M[3], PetscReal q[4])
{
  const PetscReal angle = dt * M[k] / moments[k], c = PetscCosReal(angle), s = PetscSinReal(angle);
  const PetscInt  i = (k + 1) % 3, j = (k + 2) % 3;
  const PetscReal mi = M[i];
  PetscReal       turn[4] = {PetscCosReal(0.5 * angle), 0, 0, 0};

  turn[1 + k] = PetscSinReal(0.5 * angle);
  M[i]        = c * mi + s * M[j];
  M[j]        = c * M[j] - s * mi;
  Product(q, turn, q);
}

void DemClumpsAdvance_Internal(DemModel model, PetscReal kick, PetscReal dt)
{
  static const PetscInt order[5] = {0, 1, 2, 1, 0};
  DemClumps            *c = &model->clumps;
  const PetscInt        n = model->n;

  if (!c->n) return;
#pragma omp parallel for schedule(static) num_threads((int)model->threads)
  for (PetscInt k = 0; k < c->n; k++) {
    PetscReal       *q = &c->q[4 * k], *L = &c->L[3 * k], R[3][3], S[3][3], M[3], w[3], w1[3], norm = 0;
    const PetscReal *moments = &c->moments[3 * k];

    if (model->contacts.gone && model->contacts.gone[c->member[c->start[k]]]) continue;
    for (PetscInt d = 0; d < 3; d++) {
      c->v[3 * k + d] += kick / c->mass[k] * c->force[3 * k + d];
      c->u[3 * k + d] += dt * c->v[3 * k + d];
      L[d] += kick * c->couple[3 * k + d];
    }
    Matrix(q, R);
    for (PetscInt j = 0; j < 3; j++) M[j] = R[0][j] * L[0] + R[1][j] * L[1] + R[2][j] * L[2];
    for (PetscInt j = 0; j < 5; j++) TurnAbout(order[j], order[j] == 2 ? dt : 0.5 * dt, moments, M, q);
    for (PetscInt d = 0; d < 4; d++) norm += q[d] * q[d];
    for (PetscInt d = 0; d < 4; d++) q[d] /= PetscSqrtReal(norm);
    Matrix(q, S);
    Spin((const PetscReal(*)[3])R, moments, L, w);
    Spin((const PetscReal(*)[3])S, moments, L, w1);
    Carry(model, k, (const PetscReal(*)[3])S);
    for (PetscInt i = c->start[k]; i < c->start[k + 1]; i++) { /* Eq. (5.97) */
      const PetscInt   p = c->member[i];
      const PetscReal *b = &c->arm[3 * i];

      for (PetscInt d = 0; d < 3; d++) {
        model->v[d * n + p]    = c->v[3 * k + d] + ((S[d][0] - R[d][0]) * b[0] + (S[d][1] - R[d][1]) * b[1] + (S[d][2] - R[d][2]) * b[2]) / dt;
        model->spin[d * n + p] = 0.5 * (w[d] + w1[d]);
      }
    }
  }
}

void DemClumpsPlace_Internal(DemModel model, PetscInt k, const PetscReal x[3], const PetscReal v[3])
{
  DemClumps     *c = &model->clumps;
  const PetscInt n = model->n;
  PetscReal      R[3][3];

  Matrix(&c->q[4 * k], R);
  for (PetscInt d = 0; d < 3; d++) {
    c->x0[3 * k + d] = x[d];
    c->u[3 * k + d] = c->L[3 * k + d] = 0;
    c->v[3 * k + d]                   = v[d];
  }
  for (PetscInt i = c->start[k]; i < c->start[k + 1]; i++) {
    const PetscInt p = c->member[i];

    for (PetscInt d = 0; d < 3; d++) {
      model->x0[d * n + p] = model->packing.x[3 * model->at[p] + d] = x[d] + R[d][0] * c->arm[3 * i] + R[d][1] * c->arm[3 * i + 1] + R[d][2] * c->arm[3 * i + 2];
      model->u[d * n + p] = model->spin[d * n + p] = 0;
      model->v[d * n + p]                          = v[d];
    }
  }
}

/* Kinetic energy of the instant before the kick that comes; the first kick is half a one. */
static PetscReal Kinetic(const DemClumps *c, PetscInt k, PetscReal dt, PetscReal sign)
{
  PetscReal R[3][3], sum = 0;

  Matrix(&c->q[4 * k], R);
  for (PetscInt d = 0; d < 3; d++) sum += 0.5 * c->v[3 * k + d] * (c->mass[k] * c->v[3 * k + d] + sign * dt * c->force[3 * k + d]);
  for (PetscInt j = 0; j < 3; j++) {
    PetscReal a = 0, b = 0;

    for (PetscInt d = 0; d < 3; d++) {
      a += R[d][j] * c->L[3 * k + d];
      b += R[d][j] * (c->L[3 * k + d] + sign * dt * c->couple[3 * k + d]);
    }
    sum += 0.5 * a * b / c->moments[3 * k + j];
  }
  return sum;
}

void DemClumpsLeave_Internal(DemModel model, PetscInt k, PetscReal *taken)
{
  DemClumps *c = &model->clumps;

  *taken += Kinetic(c, k, model->dt_last, -1);
  for (PetscInt d = 0; d < 3; d++) {
    *taken += c->mass[k] * model->gravity[d] * c->v[3 * k + d] * model->dt_last;
    c->v[3 * k + d] = c->L[3 * k + d] = c->force[3 * k + d] = c->couple[3 * k + d] = 0;
  }
  for (PetscInt i = c->start[k]; i < c->start[k + 1]; i++) {
    const PetscInt p = c->member[i];

    for (PetscInt d = 0; d < 3; d++) model->v[d * model->n + p] = model->spin[d * model->n + p] = 0;
    model->contacts.gone[p] = 1;
    model->contacts.n_gone++;
  }
}

void DemClumpsEnergy_Internal(DemModel model, PetscReal *kinetic, PetscReal *gravity)
{
  const DemClumps *c = &model->clumps;

  for (PetscInt k = 0; k < c->n; k++) {
    *kinetic += Kinetic(c, k, model->started ? model->dt_last : 0, 1);
    for (PetscInt d = 0; d < 3; d++) *gravity += c->mass[k] * model->gravity[d] * c->u[3 * k + d];
  }
}

/* 1/m + reach^2 / least moment bounds what a force anywhere on the clump moves there.  Eq. (5.98) */
PetscReal DemClumpLight_Internal(DemModel model, PetscInt p, PetscReal *share)
{
  const DemClumps *c = &model->clumps;
  PetscReal        light = model->mass[p];

  *share = light;
  if (DemInClump(model, p)) {
    const PetscInt   k = c->of[p];
    const PetscReal *moments = &c->moments[3 * k];

    light  = 1 / (1 / c->mass[k] + PetscSqr(c->reach[k]) / PetscMin(moments[0], PetscMin(moments[1], moments[2])));
    *share = light / (PetscReal)(c->start[k + 1] - c->start[k]);
  }
  return light;
}

PetscInt DemGrains_Internal(DemModel model)
{
  if (model->ranks) return model->ranks->particles;
  return model->clumps.n ? model->n - model->clumps.start[model->clumps.n] + model->clumps.n : model->n;
}

PetscInt DemGrainsGone_Internal(DemModel model)
{
  const DemClumps *c = &model->clumps;
  PetscInt         gone = model->contacts.n_gone;

  if (gone)
    for (PetscInt k = 0; k < c->n; k++)
      if (model->contacts.gone[c->member[c->start[k]]]) gone -= c->start[k + 1] - c->start[k] - 1;
  return gone;
}

PetscErrorCode DemClumpsSave_Internal(DemModel model, Checkpoint f)
{
  const DemClumps *c = &model->clumps;

  PetscFunctionBegin;
  if (!c->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckpointWriteReal(f, "dem/clump_start", 3 * c->n, c->x0));
  PetscCall(CheckpointWriteReal(f, "dem/clump_displacement", 3 * c->n, c->u));
  PetscCall(CheckpointWriteReal(f, "dem/clump_velocity", 3 * c->n, c->v));
  PetscCall(CheckpointWriteReal(f, "dem/clump_orientation", 4 * c->n, c->q));
  PetscCall(CheckpointWriteReal(f, "dem/clump_momentum", 3 * c->n, c->L));
  PetscCall(CheckpointWriteReal(f, "dem/clump_force", 3 * c->n, c->force));
  PetscCall(CheckpointWriteReal(f, "dem/clump_couple", 3 * c->n, c->couple));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemClumpsLoad_Internal(DemModel model, Checkpoint f)
{
  DemClumps *c = &model->clumps;

  PetscFunctionBegin;
  if (!c->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckpointReadReal(f, "dem/clump_start", 3 * c->n, c->x0));
  PetscCall(CheckpointReadReal(f, "dem/clump_displacement", 3 * c->n, c->u));
  PetscCall(CheckpointReadReal(f, "dem/clump_velocity", 3 * c->n, c->v));
  PetscCall(CheckpointReadReal(f, "dem/clump_orientation", 4 * c->n, c->q));
  PetscCall(CheckpointReadReal(f, "dem/clump_momentum", 3 * c->n, c->L));
  PetscCall(CheckpointReadReal(f, "dem/clump_force", 3 * c->n, c->force));
  PetscCall(CheckpointReadReal(f, "dem/clump_couple", 3 * c->n, c->couple));
  PetscFunctionReturn(PETSC_SUCCESS);
}
