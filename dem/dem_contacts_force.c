/*
  dem_contacts_force.c - forces of a model's contacts, block by block.  Eqs (5.20)-(5.31)

  Distances first, for every pair of the list; then the law, for those that touch, gathered side by side; then the sums.
*/
#include "dem_impl.h"
#include <omp.h>

/* A particle in a block's copy: position, radius, velocity, mass, spin, kind of material. */
enum { AT_X = 0, AT_R = 3, AT_V = 4, AT_M = 7, AT_W = 8, AT_KIND = 11, AT_ALL = 12 };

static void CopyParticle(DemModel model, PetscInt p, PetscReal *a)
{
  const PetscInt n = model->n;

  for (PetscInt d = 0; d < 3; d++) {
    a[AT_X + d] = model->x0[d * n + p] + model->u[d * n + p];
    a[AT_V + d] = model->v[d * n + p];
    a[AT_W + d] = model->dim == 3 ? model->spin[d * n + p] : d == 2 ? model->spin[p] : 0;
  }
  a[AT_R]    = model->r[p];
  a[AT_M]    = model->mass[p];
  a[AT_KIND] = model->contacts.kind ? model->contacts.kind[p] : 0;
}

/* Results of a chunk's contacts, side by side: force and n x force on the first, couple, arms. */
typedef struct {
  PetscReal f[3][DEM_CONTACT_CHUNK], q[3][DEM_CONTACT_CHUNK], couple[3][DEM_CONTACT_CHUNK], arm[2][DEM_CONTACT_CHUNK];
} Chunk;

/*
  The law over `hits` pairs hit[] of the list. sum: friction, damping [J], deepest overlap / radius.
  `turns`, `many` (several materials) and `periodic` are constants at the call, so each combination is its own loop.
*/
static inline __attribute__((always_inline)) void Laws(const DemContacts *c, PetscInt hits, const int *restrict hit, const PetscReal *restrict at, PetscReal dt, int turns, int many, int periodic, Chunk *restrict out,
                                                       PetscReal sum[3])
{
  const DemContactPair *table = c->table, one = table[0];
  const PetscInt        kinds = c->n_kinds;
  const int *restrict ip = c->ip, *restrict iq = c->iq;
  const PetscReal *restrict image = c->image;
  const PetscReal flat = c->flat;
  PetscReal *restrict past = c->past, *restrict roll = c->roll;
  PetscReal friction = 0, damping = 0, deepest = 0;

#pragma omp simd reduction(+ : friction, damping) reduction(max : deepest)
  for (PetscInt i = 0; i < hits; i++) {
    const int         k = hit[i], a = AT_ALL * ip[k], b = AT_ALL * iq[k];
    const PetscReal   ra = at[a + AT_R], rb = at[b + AT_R], ma = at[a + AT_M], mb = at[b + AT_M];
    PetscReal         x = at[a] - at[b], y = at[a + 1] - at[b + 1], z = at[a + 2] - at[b + 2];
    DemContactMotion  m;
    DemContactHistory h;
    DemContactForce   f;

    if (periodic) {
      x += image[3 * k];
      y += image[3 * k + 1];
      z += image[3 * k + 2];
    }
    const PetscReal d = PetscSqrtReal(x * x + y * y + z * z), inverse = 1 / (d > 1e-300 ? d : 1e-300), overlap = ra + rb - d, aa = ra - 0.5 * overlap, ab = rb - 0.5 * overlap;
    const PetscReal wx = aa * at[a + AT_W] + ab * at[b + AT_W], wy = aa * at[a + AT_W + 1] + ab * at[b + AT_W + 1], wz = aa * at[a + AT_W + 2] + ab * at[b + AT_W + 2];

    m.n[0]    = x * inverse;
    m.n[1]    = y * inverse;
    m.n[2]    = z * inverse;
    m.v[0]    = at[a + AT_V] - at[b + AT_V] - (wy * m.n[2] - wz * m.n[1]);
    m.v[1]    = at[a + AT_V + 1] - at[b + AT_V + 1] - (wz * m.n[0] - wx * m.n[2]);
    m.v[2]    = at[a + AT_V + 2] - at[b + AT_V + 2] - (wx * m.n[1] - wy * m.n[0]);
    m.spin[0] = at[a + AT_W] - at[b + AT_W];
    m.spin[1] = at[a + AT_W + 1] - at[b + AT_W + 1];
    m.spin[2] = at[a + AT_W + 2] - at[b + AT_W + 2];
    m.turn    = 0.5 * ((at[a + AT_W] + at[b + AT_W]) * m.n[0] + (at[a + AT_W + 1] + at[b + AT_W + 1]) * m.n[1] + (at[a + AT_W + 2] + at[b + AT_W + 2]) * m.n[2]);
    m.radius  = ra * rb / (ra + rb);
    m.size    = flat > 0 ? flat : m.radius;
    m.mass    = ma * mb / (ma + mb);
    m.overlap = overlap - past[DEM_PAST * k + DEM_PAST_OFFSET];
    h.slip[0] = past[DEM_PAST * k];
    h.slip[1] = past[DEM_PAST * k + 1];
    h.slip[2] = past[DEM_PAST * k + 2];
    h.overlap = past[DEM_PAST * k + DEM_PAST_OVERLAP];
    h.drag[0] = past[DEM_PAST * k + DEM_PAST_DRAG];
    h.drag[1] = past[DEM_PAST * k + DEM_PAST_DRAG + 1];
    h.drag[2] = past[DEM_PAST * k + DEM_PAST_DRAG + 2];
    if (turns) {
      h.roll[0] = roll[4 * k];
      h.roll[1] = roll[4 * k + 1];
      h.roll[2] = roll[4 * k + 2];
      h.twist   = roll[4 * k + 3];
    }
    if (many) DemContactStep(&table[(int)at[a + AT_KIND] * kinds + (int)at[b + AT_KIND]], &m, dt, turns, &h, &f);
    else DemContactStep(&one, &m, dt, turns, &h, &f);
    past[DEM_PAST * k]                        = h.slip[0];
    past[DEM_PAST * k + 1]                    = h.slip[1];
    past[DEM_PAST * k + 2]                    = h.slip[2];
    past[DEM_PAST * k + DEM_PAST_OVERLAP]     = h.overlap;
    past[DEM_PAST * k + DEM_PAST_DRAG]        = h.drag[0];
    past[DEM_PAST * k + DEM_PAST_DRAG + 1]    = h.drag[1];
    past[DEM_PAST * k + DEM_PAST_DRAG + 2]    = h.drag[2];
    if (turns) {
      roll[4 * k]     = h.roll[0];
      roll[4 * k + 1] = h.roll[1];
      roll[4 * k + 2] = h.roll[2];
      roll[4 * k + 3] = h.twist;
    }
    friction += f.friction;
    damping += f.damping;
    deepest         = m.overlap / m.radius > deepest ? m.overlap / m.radius : deepest;
    out->f[0][i]    = f.force[0];
    out->f[1][i]    = f.force[1];
    out->f[2][i]    = f.force[2];
    out->q[0][i]    = m.n[1] * f.force[2] - m.n[2] * f.force[1];
    out->q[1][i]    = m.n[2] * f.force[0] - m.n[0] * f.force[2];
    out->q[2][i]    = m.n[0] * f.force[1] - m.n[1] * f.force[0];
    out->arm[0][i]  = aa;
    out->arm[1][i]  = ab;
    if (turns) {
      out->couple[0][i] = f.couple[0];
      out->couple[1][i] = f.couple[1];
      out->couple[2][i] = f.couple[2];
    }
  }
  sum[0] += friction;
  sum[1] += damping;
  sum[2] = PetscMax(sum[2], deepest);
}

static void LawsOne(const DemContacts *c, PetscInt hits, const int *hit, const PetscReal *at, PetscReal dt, Chunk *out, PetscReal sum[3])
{
  Laws(c, hits, hit, at, dt, 0, 0, 0, out, sum);
}

static void LawsMany(const DemContacts *c, PetscInt hits, const int *hit, const PetscReal *at, PetscReal dt, Chunk *out, PetscReal sum[3])
{
  if (c->image) Laws(c, hits, hit, at, dt, 0, 1, 1, out, sum);
  else Laws(c, hits, hit, at, dt, 0, 1, 0, out, sum);
}

static void LawsTurns(const DemContacts *c, PetscInt hits, const int *hit, const PetscReal *at, PetscReal dt, Chunk *out, PetscReal sum[3])
{
  if (c->image) Laws(c, hits, hit, at, dt, 1, 1, 1, out, sum);
  else Laws(c, hits, hit, at, dt, 1, 1, 0, out, sum);
}

/* A pair that touched and does not any more. */
static void Part(const DemContacts *c, PetscInt k, const PetscReal *a, const PetscReal *b, PetscReal dt, PetscReal sum[3])
{
  const DemContactPair *pair = &c->table[(int)a[AT_KIND] * c->n_kinds + (int)b[AT_KIND]];
  PetscReal            *past = c->past + DEM_PAST * k, *roll = c->turns ? c->roll + 4 * k : NULL, n[3], v[3], w[3], d = 0, friction, damping;
  const PetscReal       radius = a[AT_R] * b[AT_R] / (a[AT_R] + b[AT_R]);
  DemContactHistory     h = {{past[0], past[1], past[2]}, past[DEM_PAST_OVERLAP], {past[DEM_PAST_DRAG], past[DEM_PAST_DRAG + 1], past[DEM_PAST_DRAG + 2]}, {0}, 0};

  if (roll) {
    for (PetscInt i = 0; i < 3; i++) h.roll[i] = roll[i];
    h.twist = roll[3];
  }
  for (PetscInt i = 0; i < 3; i++) {
    n[i] = a[i] - b[i] + (c->image ? c->image[3 * k + i] : 0);
    w[i] = a[AT_R] * a[AT_W + i] + b[AT_R] * b[AT_W + i];
    d += n[i] * n[i];
  }
  d = PetscSqrtReal(d);
  for (PetscInt i = 0; i < 3; i++) v[i] = a[AT_V + i] - b[AT_V + i] - (w[(i + 1) % 3] * n[(i + 2) % 3] - w[(i + 2) % 3] * n[(i + 1) % 3]) / d;
  DemContactPart(pair, v, radius, c->flat > 0 ? c->flat : radius, dt, c->turns, &h, &friction, &damping);
  sum[0] += friction;
  sum[1] += damping;
  for (PetscInt i = 0; i < DEM_PAST_OFFSET; i++) past[i] = 0;
  if (roll)
    for (PetscInt i = 0; i < 4; i++) roll[i] = 0;
}

static void BlockForce(DemModel model, PetscInt block, PetscReal dt, PetscReal *scratch)
{
  DemContacts    *c = &model->contacts;
  const PetscInt  n = model->n, begin = block * DEM_CONTACT_BLOCK, own = PetscMin(n, begin + DEM_CONTACT_BLOCK) - begin;
  const PetscInt  halo = c->halo_start[block + 1] - c->halo_start[block], *ghost = c->halo + c->halo_start[block], all = own + halo;
  PetscReal      *at = scratch, *F = scratch + AT_ALL * c->widest, *sum = c->sum + 4 * block;
  Chunk           out;

  sum[0] = sum[1] = sum[2] = sum[3] = 0;
  if (c->pair[block] == c->pair[block + 1]) return;
  for (PetscInt i = 0; i < own; i++) CopyParticle(model, begin + i, at + AT_ALL * i);
  for (PetscInt i = 0; i < halo; i++) CopyParticle(model, ghost[i], at + AT_ALL * (own + i));
  for (PetscInt i = 0; i < 8 * all; i++) F[i] = 0;
  for (PetscInt first = c->pair[block]; first < c->pair[block + 1]; first += DEM_CONTACT_CHUNK) {
    const PetscInt m = PetscMin(DEM_CONTACT_CHUNK, c->pair[block + 1] - first);
    PetscReal      deep[DEM_CONTACT_CHUNK];
    int            hit[DEM_CONTACT_CHUNK], hits = 0;
    const int     *ip = c->ip + first, *iq = c->iq + first;

    if (c->image) {
      const PetscReal *image = c->image + 3 * first;

      for (PetscInt k = 0; k < m; k++) {
        const PetscReal *a = at + AT_ALL * ip[k], *b = at + AT_ALL * iq[k], x = a[0] - b[0] + image[3 * k], y = a[1] - b[1] + image[3 * k + 1], z = a[2] - b[2] + image[3 * k + 2];

        deep[k] = (a[AT_R] + b[AT_R]) * (a[AT_R] + b[AT_R]) - (x * x + y * y + z * z);
      }
    } else {
#pragma omp simd
      for (PetscInt k = 0; k < m; k++) {
        const int       a = AT_ALL * ip[k], b = AT_ALL * iq[k];
        const PetscReal x = at[a] - at[b], y = at[a + 1] - at[b + 1], z = at[a + 2] - at[b + 2], r = at[a + AT_R] + at[b + AT_R];

        deep[k] = r * r - (x * x + y * y + z * z);
      }
    }
    for (PetscInt k = 0; k < m; k++) {
      PetscReal    *past = c->past + DEM_PAST * (first + k);
      unsigned char touch = deep[k] > 0;

      if (touch && past[DEM_PAST_OFFSET] > 0) { /* stress-free up to the overlap it began with */
        const PetscReal r = at[AT_ALL * ip[k] + AT_R] + at[AT_ALL * iq[k] + AT_R];

        touch = deep[k] > past[DEM_PAST_OFFSET] * (2 * r - past[DEM_PAST_OFFSET]) * (1 + 1e-12);
      } else if (!touch) past[DEM_PAST_OFFSET] = 0;
      hit[hits] = (int)(first + k);
      hits += touch;
      if (!touch && c->met[first + k]) Part(c, first + k, at + AT_ALL * ip[k], at + AT_ALL * iq[k], dt, sum);
      c->met[first + k] = touch;
    }
    if (c->turns) LawsTurns(c, hits, hit, at, dt, &out, sum);
    else if (c->n_kinds > 1 || c->image) LawsMany(c, hits, hit, at, dt, &out, sum);
    else LawsOne(c, hits, hit, at, dt, &out, sum);
    for (PetscInt i = 0; i < hits; i++) {
      PetscReal *fp = F + 8 * c->ip[hit[i]], *fq = F + 8 * c->iq[hit[i]];

      for (PetscInt d = 0; d < 3; d++) {
        fp[d] += out.f[d][i];
        fq[d] -= out.f[d][i];
        fp[3 + d] -= out.arm[0][i] * out.q[d][i];
        fq[3 + d] -= out.arm[1][i] * out.q[d][i];
      }
      if (c->turns)
        for (PetscInt d = 0; d < 3; d++) {
          fp[3 + d] += out.couple[d][i];
          fq[3 + d] -= out.couple[d][i];
        }
    }
    sum[3] += hits;
  }
  for (PetscInt i = 0; i < own; i++) {
    const PetscInt p = begin + i;

    for (PetscInt d = 0; d < model->dim; d++) model->f[d * n + p] += F[8 * i + d];
    if (model->dim == 2) model->torque[p] += F[8 * i + 5];
    else
      for (PetscInt d = 0; d < 3; d++) model->torque[d * n + p] += F[8 * i + 3 + d];
  }
  for (PetscInt i = 0; i < halo; i++)
    for (PetscInt d = 0; d < 6; d++) c->slot_f[8 * (c->halo_start[block] + i) + d] = F[8 * (own + i) + d];
}

static void BlockGather(DemModel model, PetscInt block)
{
  const DemContacts *c = &model->contacts;
  const PetscInt     n = model->n, begin = block * DEM_CONTACT_BLOCK, end = PetscMin(n, begin + DEM_CONTACT_BLOCK);

  for (PetscInt p = begin; p < end; p++)
    for (PetscInt s = c->slot_start[p]; s < c->slot_start[p + 1]; s++) {
      const PetscReal *f = c->slot_f + 8 * c->slot[s];

      for (PetscInt d = 0; d < model->dim; d++) model->f[d * n + p] += f[d];
      if (model->dim == 2) model->torque[p] += f[5];
      else
        for (PetscInt d = 0; d < 3; d++) model->torque[d * n + p] += f[3 + d];
    }
}

/* Somebody has moved half the skin, or a bond has broken since the last search. */
static PetscBool Stale(DemModel model)
{
  const DemContacts *c = &model->contacts;
  const PetscInt     n = model->n;
  PetscReal          most = 0;

  if (!c->searches) return PETSC_TRUE;
  if (c->n_who == n) {
#pragma omp simd reduction(max : most)
    for (PetscInt p = 0; p < n; p++) {
      const PetscReal x = model->x0[p] + model->u[p] - c->ref[p], y = model->x0[n + p] + model->u[n + p] - c->ref[n + p], z = model->x0[2 * n + p] + model->u[2 * n + p] - c->ref[2 * n + p];
      const PetscReal d2 = x * x + y * y + z * z;

      most = d2 > most ? d2 : most;
    }
  } else
    for (PetscInt k = 0; k < c->n_who; k++) {
      const PetscInt p = c->who[k];
      PetscReal      d2 = 0;

      for (PetscInt d = 0; d < 3; d++) d2 += PetscSqr(model->x0[d * n + p] + model->u[d * n + p] - c->ref[d * n + p]);
      most = PetscMax(most, d2);
    }
  if (4 * most >= c->skin * c->skin) return PETSC_TRUE;
  if (model->crack.damage && model->crack.steps % DEM_STRESS_EVERY == 0) { /* no hurry: what is newly broken is still joined to its neighbours */
    PetscInt broken = 0;

    for (PetscInt e = 0; e < model->bonds.n && model->net; e++) broken += model->crack.damage[e] >= DEM_CONTACT_BROKEN; /* springs keep no list */
    for (PetscInt b = 0; b < model->blocks.n_blocks && !model->net; b++)
      for (PetscInt l = 0; l < model->crack.n_live[b]; l++) broken += model->crack.damage[model->crack.live[model->blocks.bond[b] + l]] >= DEM_CONTACT_BROKEN;
    return (PetscBool)(broken != c->broken);
  }
  return PETSC_FALSE;
}

PetscErrorCode DemContactsForce_Internal(DemModel model, PetscReal dt)
{
  DemContacts *c = &model->contacts;

  PetscFunctionBegin;
  if (Stale(model)) PetscCall(DemContactsSearch_Internal(model));
  if (!c->m) PetscFunctionReturn(PETSC_SUCCESS);
#pragma omp parallel num_threads((int)model->threads)
  {
    PetscReal *scratch = c->scratch[omp_get_thread_num()];

#pragma omp for schedule(static)
    for (PetscInt b = 0; b < c->n_blocks; b++) BlockForce(model, b, dt, scratch);
#pragma omp for schedule(static)
    for (PetscInt b = 0; b < c->n_blocks; b++) BlockGather(model, b);
  }
  c->touching = 0;
  for (PetscInt b = 0; b < c->n_blocks; b++) {
    model->friction_lost += c->sum[4 * b];
    model->contact_lost += c->sum[4 * b + 1];
    c->deepest = PetscMax(c->deepest, c->sum[4 * b + 2]);
    c->touching += (PetscInt)c->sum[4 * b + 3];
  }
  if (c->table[0].hertz > 0 && c->deepest > c->options.deepest)
    SETERRQ(model->comm, PETSC_ERR_USER_INPUT,
            "Two particles overlap by %.3g of their radius at time %.6g s; the time step was chosen for %.3g. Stiffer contacts, or a larger contact.deepest, would carry them", (double)c->deepest,
            (double)model->time, (double)c->options.deepest);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void DemContactsStill_Internal(DemModel model)
{
  const PetscInt n = model->n;

  for (PetscInt p = 0; p < n; p++)
    if (model->contacts.gone[p])
      for (PetscInt d = 0; d < 3; d++) model->f[d * n + p] = model->torque[d * n + p] = 0;
}

void DemContactsThrough_Internal(DemModel model, PetscReal *sum, PetscInt *touching)
{
  const DemContacts *c = &model->contacts;

  for (PetscInt k = 0; k < c->m; k++) {
    const PetscInt        p = c->p[k], q = c->q[k];
    const DemContactPair *pair = &c->table[(c->kind ? c->kind[p] : 0) * c->n_kinds + (c->kind ? c->kind[q] : 0)];
    const PetscReal       size = c->flat > 0 ? c->flat : model->r[p] * model->r[q] / (model->r[p] + model->r[q]), overlap = PetscAbsReal(c->past[DEM_PAST * k + DEM_PAST_OVERLAP]);

    if (!c->met[k]) continue;
    *sum += pair->share * DemContactStiffness(pair, size, overlap) * overlap;
    (*touching)++;
  }
}

/* Energy stored in the contacts that touch [J] */
PetscReal DemContactsEnergy_Internal(DemModel model)
{
  const DemContacts *c = &model->contacts;
  const PetscInt     n = model->n;
  PetscReal          sum = 0;

  for (PetscInt k = 0; k < c->m; k++) {
    const PetscInt    p = c->p[k], q = c->q[k];
    const PetscReal  *past = c->past + DEM_PAST * k, radius = model->r[p] * model->r[q] / (model->r[p] + model->r[q]);
    DemContactHistory h = {{past[0], past[1], past[2]}};
    PetscReal         d2 = 0, overlap;

    if (!c->met[k]) continue;
    for (PetscInt d = 0; d < 3; d++) d2 += PetscSqr(model->x0[d * n + p] + model->u[d * n + p] - model->x0[d * n + q] - model->u[d * n + q] + (c->image ? c->image[3 * k + d] : 0));
    if (c->turns) {
      for (PetscInt d = 0; d < 3; d++) h.roll[d] = c->roll[4 * k + d];
      h.twist = c->roll[4 * k + 3];
    }
    overlap = model->r[p] + model->r[q] - PetscSqrtReal(d2) - past[DEM_PAST_OFFSET];
    if (overlap > 0) sum += DemContactEnergy(&c->table[(c->kind ? c->kind[p] : 0) * c->n_kinds + (c->kind ? c->kind[q] : 0)], radius, c->flat > 0 ? c->flat : radius, overlap, &h);
  }
  return sum;
}
