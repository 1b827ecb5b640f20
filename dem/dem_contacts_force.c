/*
  dem_contacts_force.c - forces of a model's contacts, block by block.  Eqs (5.20)-(5.31)

  Distances first, for every pair of the list; then the law, for those that touch, gathered side by side; then the sums.
*/
#include "dem_impl.h"
#include "dem_lanes.h"
#include <omp.h>

enum { AT_COUPLE = 4 }; /* what a particle feels: force, -, couple, - */

void DemContactParticle_Internal(DemModel model, PetscInt p, PetscReal a[DEM_MEET_ALL])
{
  const DemContacts *c = &model->contacts;
  const PetscInt     n = model->n;

  if (p >= model->own) { /* another rank's */
    for (PetscInt d = 0; d < DEM_MEET_ALL; d++) a[d] = c->halo.in[DEM_MEET_ALL * (p - model->own) + d];
    return;
  }
  for (PetscInt d = 0; d < 3; d++) {
    a[DEM_MEET_X + d] = model->x0[d * n + p] + model->u[d * n + p];
    a[DEM_MEET_V + d] = model->v[d * n + p];
    a[DEM_MEET_W + d] = model->dim == 3 ? model->spin[d * n + p] : d == 2 ? model->spin[p] : 0;
  }
  a[DEM_MEET_R]    = model->r[p];
  a[DEM_MEET_M]    = model->mass[p];
  a[DEM_MEET_KIND] = c->kind ? c->kind[p] : 0;
}

/* A chunk's contacts side by side, first less second: what the law reads and what it leaves, one row per number. */
enum { ROW_X = 0, ROW_RA = 3, ROW_RB, ROW_MA, ROW_MB, ROW_V, ROW_WA = ROW_V + 3, ROW_WB = ROW_WA + 3, ROW_PAST = ROW_WB + 3, ROW_ROLL = ROW_PAST + DEM_PAST, ROW_F = ROW_ROLL + 4, ROW_TA = ROW_F + 3, ROW_TB = ROW_TA + 3, ROW_FRICTION = ROW_TB + 3, ROW_DAMPING, ROW_DEPTH, ROWS };

typedef struct {
  _Alignas(64) PetscReal row[ROWS][DEM_CONTACT_CHUNK];
  int pair[DEM_CONTACT_CHUNK]; /* of the table */
} Chunk;

/* Rows row, row + 1, ... of four columns from i on */
DEM_INLINE void RowsOf(const PetscReal (*R)[DEM_CONTACT_CHUNK], PetscInt row, PetscInt i, DemLanes out[4])
{
  DemLanesRows(&R[row][i], &R[row + 1][i], &R[row + 2][i], &R[row + 3][i], out);
}

/* The law of column i. Apart from its loop, whose pragma would keep the records below in memory. */
DEM_INLINE void Law(const DemContactPair *pair, PetscReal flat, PetscReal dt, int turns, PetscInt i, PetscReal (*restrict R)[DEM_CONTACT_CHUNK])
{
  const PetscReal   round = flat > 0 ? 0 : 1;
  const PetscReal   ra = R[ROW_RA][i], rb = R[ROW_RB][i], ma = R[ROW_MA][i], mb = R[ROW_MB][i], x = R[ROW_X][i], y = R[ROW_X + 1][i], z = R[ROW_X + 2][i];
  const PetscReal   ax = R[ROW_WA][i], ay = R[ROW_WA + 1][i], az = R[ROW_WA + 2][i], bx = R[ROW_WB][i], by = R[ROW_WB + 1][i], bz = R[ROW_WB + 2][i];
  const PetscReal   d2 = x * x + y * y + z * z, d = PetscSqrtReal(d2 > 1e-300 ? d2 : 1e-300), inverse = 1 / d, overlap = ra + rb - d, aa = ra - 0.5 * overlap, ab = rb - 0.5 * overlap;
  const PetscReal   wx = aa * ax + ab * bx, wy = aa * ay + ab * by, wz = aa * az + ab * bz;
  DemContactMotion  m;
  DemContactHistory h;
  DemContactForce   f;

  m.n[0]    = x * inverse;
  m.n[1]    = y * inverse;
  m.n[2]    = z * inverse;
  m.v[0]    = R[ROW_V][i] - (wy * m.n[2] - wz * m.n[1]);
  m.v[1]    = R[ROW_V + 1][i] - (wz * m.n[0] - wx * m.n[2]);
  m.v[2]    = R[ROW_V + 2][i] - (wx * m.n[1] - wy * m.n[0]);
  m.spin[0] = ax - bx;
  m.spin[1] = ay - by;
  m.spin[2] = az - bz;
  m.turn    = 0.5 * ((ax + bx) * m.n[0] + (ay + by) * m.n[1] + (az + bz) * m.n[2]);
  m.radius  = ra * rb / (ra + rb);
  m.size    = flat + round * m.radius;
  m.mass    = ma * mb / (ma + mb);
  m.overlap = overlap - R[ROW_PAST + DEM_PAST_OFFSET][i];
  h.slip[0] = R[ROW_PAST][i];
  h.slip[1] = R[ROW_PAST + 1][i];
  h.slip[2] = R[ROW_PAST + 2][i];
  h.overlap = R[ROW_PAST + DEM_PAST_OVERLAP][i];
  h.drag[0] = R[ROW_PAST + DEM_PAST_DRAG][i];
  h.drag[1] = R[ROW_PAST + DEM_PAST_DRAG + 1][i];
  h.drag[2] = R[ROW_PAST + DEM_PAST_DRAG + 2][i];
  h.roll[0] = h.roll[1] = h.roll[2] = h.twist = 0;
  if (turns) {
    h.roll[0] = R[ROW_ROLL][i];
    h.roll[1] = R[ROW_ROLL + 1][i];
    h.roll[2] = R[ROW_ROLL + 2][i];
    h.twist   = R[ROW_ROLL + 3][i];
  }
  DemContactStep(pair, &m, dt, turns, &h, &f);
  R[ROW_PAST][i]                    = h.slip[0];
  R[ROW_PAST + 1][i]                = h.slip[1];
  R[ROW_PAST + 2][i]                = h.slip[2];
  R[ROW_PAST + DEM_PAST_OVERLAP][i] = h.overlap;
  R[ROW_PAST + DEM_PAST_DRAG][i]    = h.drag[0];
  R[ROW_PAST + DEM_PAST_DRAG + 1][i] = h.drag[1];
  R[ROW_PAST + DEM_PAST_DRAG + 2][i] = h.drag[2];
  if (turns) {
    R[ROW_ROLL][i]     = h.roll[0];
    R[ROW_ROLL + 1][i] = h.roll[1];
    R[ROW_ROLL + 2][i] = h.roll[2];
    R[ROW_ROLL + 3][i] = h.twist;
  }
  const PetscReal qx = m.n[1] * f.force[2] - m.n[2] * f.force[1], qy = m.n[2] * f.force[0] - m.n[0] * f.force[2], qz = m.n[0] * f.force[1] - m.n[1] * f.force[0];

  R[ROW_FRICTION][i] = f.friction;
  R[ROW_DAMPING][i]  = f.damping;
  R[ROW_DEPTH][i]    = m.overlap / m.radius;
  R[ROW_F][i]      = f.force[0];
  R[ROW_F + 1][i]  = f.force[1];
  R[ROW_F + 2][i]  = f.force[2];
  R[ROW_TA][i]     = f.couple[0] - aa * qx;
  R[ROW_TA + 1][i] = f.couple[1] - aa * qy;
  R[ROW_TA + 2][i] = f.couple[2] - aa * qz;
  R[ROW_TB][i]     = -f.couple[0] - ab * qx;
  R[ROW_TB + 1][i] = -f.couple[1] - ab * qy;
  R[ROW_TB + 2][i] = -f.couple[2] - ab * qz;
}

/* Over the chunk's first `hits` contacts. sum: friction, damping [J], deepest overlap / radius. */
static void LawsOne(const DemContacts *c, PetscInt hits, PetscReal dt, Chunk *chunk)
{
  const DemContactPair pair = c->table[0];
  const PetscReal      flat = c->flat;
  PetscReal(*restrict R)[DEM_CONTACT_CHUNK] = chunk->row;

#pragma omp simd
  for (PetscInt i = 0; i < hits; i++) Law(&pair, flat, dt, 0, i, R);
}

static void LawsOneTurns(const DemContacts *c, PetscInt hits, PetscReal dt, Chunk *chunk)
{
  const DemContactPair pair = c->table[0];
  const PetscReal      flat = c->flat;
  PetscReal(*restrict R)[DEM_CONTACT_CHUNK] = chunk->row;

#pragma omp simd
  for (PetscInt i = 0; i < hits; i++) Law(&pair, flat, dt, 1, i, R);
}

static void LawsMany(const DemContacts *c, PetscInt hits, PetscReal dt, Chunk *chunk)
{
  if (c->turns)
    for (PetscInt i = 0; i < hits; i++) Law(&c->table[chunk->pair[i]], c->flat, dt, 1, i, chunk->row);
  else
    for (PetscInt i = 0; i < hits; i++) Law(&c->table[chunk->pair[i]], c->flat, dt, 0, i, chunk->row);
}

/* What the law needs of the contacts hit[0..3] into columns i to i + 3. */
DEM_INLINE void Gather(const DemContacts *c, PetscInt i, const int hit[4], const PetscReal *at, Chunk *chunk)
{
  PetscReal(*restrict R)[DEM_CONTACT_CHUNK] = chunk->row;
  const PetscReal *a[4], *b[4], *past[4];
  DemLanes             A[4], B[4];

  for (int k = 0; k < 4; k++) {
    a[k]    = at + DEM_MEET_ALL * c->ip[hit[k]];
    b[k]    = at + DEM_MEET_ALL * c->iq[hit[k]];
    past[k] = c->past + DEM_PAST * hit[k];
  }
  DemLanesRows(a[0] + DEM_MEET_X, a[1] + DEM_MEET_X, a[2] + DEM_MEET_X, a[3] + DEM_MEET_X, A);
  DemLanesRows(b[0] + DEM_MEET_X, b[1] + DEM_MEET_X, b[2] + DEM_MEET_X, b[3] + DEM_MEET_X, B);
  for (int d = 0; d < 3; d++) *(DemLanes *)&R[ROW_X + d][i] = A[d] - B[d];
  *(DemLanes *)&R[ROW_RA][i] = A[3];
  *(DemLanes *)&R[ROW_RB][i] = B[3];
  DemLanesRows(a[0] + DEM_MEET_V, a[1] + DEM_MEET_V, a[2] + DEM_MEET_V, a[3] + DEM_MEET_V, A);
  DemLanesRows(b[0] + DEM_MEET_V, b[1] + DEM_MEET_V, b[2] + DEM_MEET_V, b[3] + DEM_MEET_V, B);
  for (int d = 0; d < 3; d++) *(DemLanes *)&R[ROW_V + d][i] = A[d] - B[d];
  *(DemLanes *)&R[ROW_MA][i] = A[3];
  *(DemLanes *)&R[ROW_MB][i] = B[3];
  DemLanesRows(a[0] + DEM_MEET_W, a[1] + DEM_MEET_W, a[2] + DEM_MEET_W, a[3] + DEM_MEET_W, A);
  DemLanesRows(b[0] + DEM_MEET_W, b[1] + DEM_MEET_W, b[2] + DEM_MEET_W, b[3] + DEM_MEET_W, B);
  for (int d = 0; d < 3; d++) {
    *(DemLanes *)&R[ROW_WA + d][i] = A[d];
    *(DemLanes *)&R[ROW_WB + d][i] = B[d];
  }
  for (int half = 0; half < DEM_PAST; half += 4) {
    DemLanesRows(past[0] + half, past[1] + half, past[2] + half, past[3] + half, A);
    for (int d = 0; d < 4; d++) *(DemLanes *)&R[ROW_PAST + half + d][i] = A[d];
  }
  if (c->turns) {
    DemLanesRows(c->roll + 4 * hit[0], c->roll + 4 * hit[1], c->roll + 4 * hit[2], c->roll + 4 * hit[3], A);
    for (int d = 0; d < 4; d++) *(DemLanes *)&R[ROW_ROLL + d][i] = A[d];
  }
  if (c->image)
    for (int k = 0; k < 4; k++)
      for (int d = 0; d < 3; d++) R[ROW_X + d][i + k] += c->image[3 * hit[k] + d];
  if (c->n_kinds > 1)
    for (int k = 0; k < 4; k++) chunk->pair[i + k] = (int)a[k][DEM_MEET_KIND] * (int)c->n_kinds + (int)b[k][DEM_MEET_KIND];
}

/* And back, the first n of the four: history to its place, forces to both particles, in the contacts' order. */
DEM_INLINE void Scatter(const DemContacts *c, PetscInt i, PetscInt n, const int hit[4], const Chunk *chunk, PetscReal *restrict F)
{
  const PetscReal(*R)[DEM_CONTACT_CHUNK] = chunk->row;
  DemLanes A[4], B[4], C[4];

  for (int half = 0; half < DEM_PAST; half += 4) {
    RowsOf(R, ROW_PAST + half, i, A);
    for (PetscInt k = 0; k < n; k++) *(DemLoose *)(c->past + DEM_PAST * hit[k] + half) = A[k];
  }
  if (c->turns) {
    RowsOf(R, ROW_ROLL, i, A);
    for (PetscInt k = 0; k < n; k++) *(DemLoose *)(c->roll + 4 * hit[k]) = A[k];
  }
  RowsOf(R, ROW_F, i, A); /* the fourth number of each is another row's: nobody reads where it goes */
  RowsOf(R, ROW_TA, i, B);
  RowsOf(R, ROW_TB, i, C);
  for (PetscInt k = 0; k < n; k++) {
    PetscReal *fp = F + 8 * c->ip[hit[k]], *fq = F + 8 * c->iq[hit[k]];

    *(DemLoose *)fp += A[k];
    *(DemLoose *)fq -= A[k];
    *(DemLoose *)(fp + AT_COUPLE) += B[k];
    *(DemLoose *)(fq + AT_COUPLE) += C[k];
  }
}

/* A pair that touched and does not any more. */
static void Part(const DemContacts *c, PetscInt k, const PetscReal *a, const PetscReal *b, PetscReal dt, PetscReal sum[3])
{
  const DemContactPair *pair = &c->table[(int)a[DEM_MEET_KIND] * c->n_kinds + (int)b[DEM_MEET_KIND]];
  PetscReal            *past = c->past + DEM_PAST * k, *roll = c->turns ? c->roll + 4 * k : NULL, n[3], v[3], w[3], d = 0, friction, damping;
  const PetscReal       radius = a[DEM_MEET_R] * b[DEM_MEET_R] / (a[DEM_MEET_R] + b[DEM_MEET_R]);
  DemContactHistory     h = {{past[0], past[1], past[2]}, past[DEM_PAST_OVERLAP], {past[DEM_PAST_DRAG], past[DEM_PAST_DRAG + 1], past[DEM_PAST_DRAG + 2]}, {0}, 0};

  if (roll) {
    for (PetscInt i = 0; i < 3; i++) h.roll[i] = roll[i];
    h.twist = roll[3];
  }
  for (PetscInt i = 0; i < 3; i++) {
    n[i] = a[i] - b[i] + (c->image ? c->image[3 * k + i] : 0);
    w[i] = a[DEM_MEET_R] * a[DEM_MEET_W + i] + b[DEM_MEET_R] * b[DEM_MEET_W + i];
    d += n[i] * n[i];
  }
  d = PetscSqrtReal(d);
  for (PetscInt i = 0; i < 3; i++) v[i] = a[DEM_MEET_V + i] - b[DEM_MEET_V + i] - (w[(i + 1) % 3] * n[(i + 2) % 3] - w[(i + 2) % 3] * n[(i + 1) % 3]) / d;
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
  const PetscInt  n = model->n, begin = c->first[block], own = c->last[block] - begin;
  const PetscInt  halo = c->halo_start[block + 1] - c->halo_start[block], *ghost = c->halo_p + c->halo_start[block], all = own + halo;
  PetscReal      *at = scratch, *F = scratch + DEM_MEET_ALL * c->widest, *sum = c->sum + 4 * block;
  Chunk           chunk;

  sum[0] = sum[1] = sum[2] = sum[3] = 0;
  if (c->pair[block] == c->pair[block + 1]) return;
  for (PetscInt i = 0; i < own; i++) DemContactParticle_Internal(model, begin + i, at + DEM_MEET_ALL * i);
  for (PetscInt i = 0; i < halo; i++) DemContactParticle_Internal(model, ghost[i], at + DEM_MEET_ALL * (own + i));
  for (PetscInt i = 0; i < 8 * all; i++) F[i] = 0;
  for (PetscInt first = c->pair[block]; first < c->pair[block + 1]; first += DEM_CONTACT_CHUNK) {
    const PetscInt m = PetscMin(DEM_CONTACT_CHUNK, c->pair[block + 1] - first);
    PetscReal      deep[DEM_CONTACT_CHUNK];
    int            hit[DEM_CONTACT_CHUNK], hits = 0;
    const int     *ip = c->ip + first, *iq = c->iq + first;

    if (c->image) {
      const PetscReal *image = c->image + 3 * first;

      for (PetscInt k = 0; k < m; k++) {
        const PetscReal *a = at + DEM_MEET_ALL * ip[k], *b = at + DEM_MEET_ALL * iq[k], x = a[0] - b[0] + image[3 * k], y = a[1] - b[1] + image[3 * k + 1], z = a[2] - b[2] + image[3 * k + 2];

        deep[k] = (a[DEM_MEET_R] + b[DEM_MEET_R]) * (a[DEM_MEET_R] + b[DEM_MEET_R]) - (x * x + y * y + z * z);
      }
    } else {
#pragma omp simd
      for (PetscInt k = 0; k < m; k++) {
        const int       a = DEM_MEET_ALL * ip[k], b = DEM_MEET_ALL * iq[k];
        const PetscReal x = at[a] - at[b], y = at[a + 1] - at[b + 1], z = at[a + 2] - at[b + 2], r = at[a + DEM_MEET_R] + at[b + DEM_MEET_R];

        deep[k] = r * r - (x * x + y * y + z * z);
      }
    }
    for (PetscInt k = 0; k < m; k++) {
      PetscReal    *past = c->past + DEM_PAST * (first + k);
      unsigned char touch = deep[k] > 0;

      if (touch && past[DEM_PAST_OFFSET] > 0) { /* stress-free up to the overlap it began with */
        const PetscReal r = at[DEM_MEET_ALL * ip[k] + DEM_MEET_R] + at[DEM_MEET_ALL * iq[k] + DEM_MEET_R];

        touch = deep[k] > past[DEM_PAST_OFFSET] * (2 * r - past[DEM_PAST_OFFSET]) * (1 + 1e-12);
      } else if (!touch) past[DEM_PAST_OFFSET] = 0;
      hit[hits] = (int)(first + k);
      hits += touch;
      if (!touch && c->met[first + k]) Part(c, first + k, at + DEM_MEET_ALL * ip[k], at + DEM_MEET_ALL * iq[k], dt, sum);
      c->met[first + k] = touch;
    }
    for (int i = hits; i % 4; i++) hit[i] = hit[hits - 1]; /* columns that nobody takes back */
    for (PetscInt i = 0; i < hits; i += 4) Gather(c, i, hit + i, at, &chunk);
    if (c->n_kinds > 1) LawsMany(c, hits, dt, &chunk);
    else if (c->turns) LawsOneTurns(c, (hits + 3) / 4 * 4, dt, &chunk);
    else LawsOne(c, (hits + 3) / 4 * 4, dt, &chunk);
    for (PetscInt i = 0; i < hits; i += 4) Scatter(c, i, PetscMin(4, hits - i), hit + i, &chunk, F);
    for (PetscInt i = 0; i < hits; i++) {
      sum[0] += chunk.row[ROW_FRICTION][i];
      sum[1] += chunk.row[ROW_DAMPING][i];
      sum[2] = PetscMax(sum[2], chunk.row[ROW_DEPTH][i]);
    }
    sum[3] += hits;
  }
  for (PetscInt i = 0; i < own; i++) {
    const PetscInt p = begin + i;

    for (PetscInt d = 0; d < model->dim; d++) model->f[d * n + p] += F[8 * i + d];
    if (model->dim == 2) model->torque[p] += F[8 * i + AT_COUPLE + 2];
    else
      for (PetscInt d = 0; d < 3; d++) model->torque[d * n + p] += F[8 * i + AT_COUPLE + d];
  }
  for (PetscInt i = 0; i < halo; i++)
    for (PetscInt d = 0; d < 8; d++) c->slot_f[8 * (c->halo_start[block] + i) + d] = F[8 * (own + i) + d];
}

static void BlockGather(DemModel model, PetscInt block)
{
  const DemContacts *c = &model->contacts;
  const PetscInt     n = model->n;

  for (PetscInt p = c->first[block]; p < c->last[block]; p++)
    for (PetscInt s = c->slot_start[p]; s < c->slot_start[p + 1]; s++) {
      const PetscReal *f = c->slot_f + 8 * c->slot[s];

      for (PetscInt d = 0; d < model->dim; d++) model->f[d * n + p] += f[d];
      if (model->dim == 2) model->torque[p] += f[AT_COUPLE + 2];
      else
        for (PetscInt d = 0; d < 3; d++) model->torque[d * n + p] += f[AT_COUPLE + d];
    }
}

/* One of ours has moved half the skin. */
static PetscBool Moved(DemModel model)
{
  const DemContacts *c = &model->contacts;
  const PetscInt     n = model->n;
  PetscReal          most = 0;

  if (c->n_who == model->own) {
#pragma omp simd reduction(max : most)
    for (PetscInt p = 0; p < model->own; p++) {
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
  return (PetscBool)(4 * most >= c->skin * c->skin);
}

/* Bonds broken, counted here. Springs keep no list of the live ones. */
static PetscInt Broken(DemModel model)
{
  const DemCrackState *crack = &model->crack;
  const DemBlocks     *blocks = &model->blocks;
  PetscInt             broken = 0;

  for (PetscInt e = 0; e < model->bonds.n && model->net; e++) broken += crack->damage[e] >= DEM_CONTACT_BROKEN && DemBondIsMine(model, e);
  for (PetscInt b = 0; b < blocks->n_blocks && !model->net; b++)
    for (PetscInt l = 0; l < crack->n_live[b]; l++) {
      const PetscInt e = crack->live[blocks->bond[b] + l];

      broken += crack->damage[e] >= DEM_CONTACT_BROKEN && DemBondIsMine(model, e);
    }
  return broken;
}

/* Somebody has moved half the skin, or a bond has broken since the last search: of all ranks. */
static PetscErrorCode Stale(DemModel model, PetscBool *stale)
{
  const DemContacts *c = &model->contacts;
  const PetscBool    look = (PetscBool)(model->crack.damage && model->crack.steps % DEM_STRESS_EVERY == 0); /* no hurry: what is newly broken is still joined to its neighbours */
  PetscInt           sum[3] = {0};

  PetscFunctionBegin;
  *stale = PETSC_TRUE;
  if (!c->searches || c->fresh) PetscFunctionReturn(PETSC_SUCCESS);
  sum[0] = Moved(model);
  if (look && (model->ranks || !sum[0])) sum[1] = Broken(model);
  sum[2] = c->too_deep;
  PetscCall(DemContactsAgree_Internal(model, 3, sum));
  *stale = (PetscBool)(sum[0] || (look && sum[1] != c->broken));
  if (sum[2]) {
    PetscReal deepest = c->deepest;

    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &deepest, 1, MPIU_REAL, MPI_MAX, model->comm));
    BaseCheckInput(PETSC_FALSE, model->comm, "Two particles overlap by %.3g of their radius at time %.6g s; the time step was chosen for %.3g. Stiffer contacts, or a larger contact.deepest, would carry them", (double)deepest,
                   (double)model->time, (double)c->options.deepest);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemContactsForce_Internal(DemModel model, PetscReal dt)
{
  DemContacts *c = &model->contacts;
  PetscBool    stale;

  PetscFunctionBegin;
  PetscCall(Stale(model, &stale));
  if (stale) PetscCall(DemContactsSearch_Internal(model));
  if (model->ranks) PetscCall(DemContactGhostsMove_Internal(model));
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
    c->deepest = PetscMax(c->deepest, c->sum[4 * b + 2]);
    if (c->first[b] == c->last[b]) continue; /* another rank's: counted there */
    model->friction_lost += c->sum[4 * b];
    model->contact_lost += c->sum[4 * b + 1];
    c->touching += (PetscInt)c->sum[4 * b + 3];
  }
  if (c->table[0].hertz > 0 && c->deepest > c->options.deepest) {
    PetscCheck(model->ranks, model->comm, PETSC_ERR_USER_INPUT,
               "Two particles overlap by %.3g of their radius at time %.6g s; the time step was chosen for %.3g. Stiffer contacts, or a larger contact.deepest, would carry them", (double)c->deepest,
               (double)model->time, (double)c->options.deepest);
    c->too_deep = 1; /* all ranks stop together */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void DemContactsStill_Internal(DemModel model)
{
  const PetscInt n = model->n;

  for (PetscInt p = 0; p < n; p++)
    if (model->contacts.gone[p])
      for (PetscInt d = 0; d < 3; d++) model->f[d * n + p] = model->torque[d * n + p] = 0;
}

/* Both ends of pair k as they are now, and the pair's law. */
static const DemContactPair *Ends(DemModel model, PetscInt k, PetscReal a[DEM_MEET_ALL], PetscReal b[DEM_MEET_ALL])
{
  const DemContacts *c = &model->contacts;

  DemContactParticle_Internal(model, c->p[k], a);
  DemContactParticle_Internal(model, c->q[k], b);
  return &c->table[(PetscInt)a[DEM_MEET_KIND] * c->n_kinds + (PetscInt)b[DEM_MEET_KIND]];
}

void DemContactsThrough_Internal(DemModel model, PetscReal *sum, PetscInt *touching)
{
  const DemContacts *c = &model->contacts;
  PetscReal          a[DEM_MEET_ALL], b[DEM_MEET_ALL];

  for (PetscInt k = 0; k < c->m; k++) {
    if (!c->met[k] || c->p[k] >= model->own) continue;
    const DemContactPair *pair = Ends(model, k, a, b);
    const PetscReal       ra = a[DEM_MEET_R], rb = b[DEM_MEET_R], size = c->flat > 0 ? c->flat : ra * rb / (ra + rb), overlap = PetscAbsReal(c->past[DEM_PAST * k + DEM_PAST_OVERLAP]);

    *sum += pair->share * DemContactStiffness(pair, size, overlap) * overlap;
    (*touching)++;
  }
}

PetscReal DemContactEnergy_Internal(DemModel model, PetscInt k, PetscReal overlap)
{
  const DemContacts    *c = &model->contacts;
  PetscReal             a[DEM_MEET_ALL], b[DEM_MEET_ALL];
  const DemContactPair *pair   = Ends(model, k, a, b);
  const PetscReal      *past   = c->past + DEM_PAST * k, radius = a[DEM_MEET_R] * b[DEM_MEET_R] / (a[DEM_MEET_R] + b[DEM_MEET_R]);
  DemContactHistory     h = {{past[0], past[1], past[2]}};

  if (c->turns) {
    for (PetscInt d = 0; d < 3; d++) h.roll[d] = c->roll[4 * k + d];
    h.twist = c->roll[4 * k + 3];
  }
  return DemContactEnergy(pair, radius, c->flat > 0 ? c->flat : radius, overlap, &h);
}

/* Energy stored in the contacts that touch and are counted here [J] */
PetscReal DemContactsEnergy_Internal(DemModel model)
{
  const DemContacts *c = &model->contacts;
  PetscReal          sum = 0, a[DEM_MEET_ALL], b[DEM_MEET_ALL];

  for (PetscInt k = 0; k < c->m; k++) {
    PetscReal d2 = 0, overlap;

    if (!c->met[k] || c->p[k] >= model->own) continue;
    (void)Ends(model, k, a, b);
    for (PetscInt d = 0; d < model->dim; d++) d2 += PetscSqr(a[d] - b[d] + (c->image ? c->image[3 * k + d] : 0));
    overlap = a[DEM_MEET_R] + b[DEM_MEET_R] - PetscSqrtReal(d2) - c->past[DEM_PAST * k + DEM_PAST_OFFSET];
    if (overlap > 0) sum += DemContactEnergy_Internal(model, k, overlap);
  }
  return sum;
}
