/*
  fem_batch_kernel.c - internal forces of one batch.  Eqs (2.9), (2.101)-(2.106)

  Vectors of the compiler, one element a lane, so every operation serves all lanes and lanes never meet. Built for
  x86-64-v3 as well as for the plain machine where the compiler is not told which one it builds for.
*/
#include "fem_batch.h"

#if defined(__x86_64__) && !defined(__AVX2__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define FEM_CLONES __attribute__((target_clones("default", "arch=haswell")))
#else
#define FEM_CLONES
#endif
#define FEM_INLINE static inline __attribute__((always_inline))

/* t = weight x stress of the displacement gradient h; the plane or the solid.  Eq. (2.3), (2.41) */
FEM_INLINE void Stress(PetscInt dim, const FemElastic *law, const FemLanes h[3][3], FemLanes weight, FemLanes t[3][3])
{
  if (law->general) {
    FemLanes e[6], s[6];

    for (PetscInt i = 0; i < 3; i++) {
      const PetscInt j = (i + 1) % 3;

      e[i]     = i < dim ? weight * h[i][i] : 0 * weight;
      e[3 + i] = i < dim && j < dim ? weight * (h[i][j] + h[j][i]) : 0 * weight;
    }
    for (PetscInt i = 0; i < 6; i++) {
      s[i] = law->C[i][0] * e[0];
      for (PetscInt j = 1; j < 6; j++) s[i] += law->C[i][j] * e[j];
    }
    for (PetscInt i = 0; i < 3; i++) {
      t[i][i]           = s[i];
      t[i][(i + 1) % 3] = t[(i + 1) % 3][i] = s[3 + i];
    }
  } else {
    const FemLanes mu = law->mu * weight;
    FemLanes       sum = h[0][0] + h[1][1];

    if (dim == 3) sum += h[2][2];
    sum *= law->lambda * weight;
    for (PetscInt i = 0; i < dim; i++) {
      t[i][i] = 2 * mu * h[i][i] + sum;
      for (PetscInt j = 0; j < i; j++) t[i][j] = t[j][i] = mu * (h[i][j] + h[j][i]);
    }
  }
}

/* h = g J^-1, or back: r = t J^-T */
FEM_INLINE void Turn(PetscInt dim, const FemLanes g[3][3], const FemLanes *inverse, PetscBool back, FemLanes h[3][3])
{
  for (PetscInt i = 0; i < dim; i++)
    for (PetscInt j = 0; j < dim; j++) {
      h[i][j] = g[i][0] * (back ? inverse[j * dim] : inverse[j]);
      for (PetscInt k = 1; k < dim; k++) h[i][j] += g[i][k] * (back ? inverse[j * dim + k] : inverse[k * dim + j]);
    }
}

/* constant [points][dim][dim] + [points]: J^-1 and the weight of each point */
FEM_INLINE void Points(PetscInt nodes, PetscInt dim, PetscInt points, const FemShape *shape, const FemElastic *law, const FemLanes *constant, const FemLanes *u, FemLanes *f)
{
  const FemLanes zero = {0};

  for (PetscInt k = 0; k < nodes * dim; k++) f[k] = zero;
  for (PetscInt q = 0; q < points; q++) {
    const FemLanes *at = &constant[q * (dim * dim + 1)];
    FemLanes        g[3][3], h[3][3], t[3][3];

    for (PetscInt i = 0; i < dim; i++)
      for (PetscInt j = 0; j < dim; j++) g[i][j] = zero;
    for (PetscInt a = 0; a < nodes; a++)
      for (PetscInt i = 0; i < dim; i++)
        for (PetscInt j = 0; j < dim; j++) g[i][j] += u[a * dim + i] * shape->dN[q][a][j];
    Turn(dim, g, at, PETSC_FALSE, h);
    Stress(dim, law, h, at[dim * dim], t);
    Turn(dim, t, at, PETSC_TRUE, g);
    for (PetscInt a = 0; a < nodes; a++)
      for (PetscInt i = 0; i < dim; i++) {
        FemLanes sum = g[i][0] * shape->dN[q][a][0];

        for (PetscInt j = 1; j < dim; j++) sum += g[i][j] * shape->dN[q][a][j];
        f[a * dim + i] += sum;
      }
  }
}

/* As Points, and psi [points][4] after them: what lambda has in excess acts on what the volume change has of psi.  Eq. (2.38) */
FEM_INLINE void Volume(PetscInt nodes, PetscInt points, const FemShape *shape, const FemElastic *law, const FemLanes *constant, const FemLanes *u, FemLanes *f)
{
  const PetscReal excess = FemVolumeExcess(shape, law);
  const FemLanes *psi    = &constant[points * 10], zero = {0};
  FemLanes        h[FEM_MAX_POINTS][3][3], div[FEM_MAX_POINTS], amount[4] = {zero, zero, zero, zero};

  for (PetscInt k = 0; k < nodes * 3; k++) f[k] = zero;
  for (PetscInt q = 0; q < points; q++) {
    FemLanes g[3][3];

    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < 3; j++) g[i][j] = zero;
    for (PetscInt a = 0; a < nodes; a++)
      for (PetscInt i = 0; i < 3; i++)
        for (PetscInt j = 0; j < 3; j++) g[i][j] += u[a * 3 + i] * shape->dN[q][a][j];
    Turn(3, g, &constant[q * 10], PETSC_FALSE, h[q]);
    div[q] = h[q][0][0] + h[q][1][1] + h[q][2][2];
    for (PetscInt m = 0; m < 4; m++) amount[m] += constant[q * 10 + 9] * psi[q * 4 + m] * div[q];
  }
  for (PetscInt q = 0; q < points; q++) {
    const FemLanes weight = constant[q * 10 + 9];
    FemLanes       more = -div[q], t[3][3], g[3][3];

    for (PetscInt m = 0; m < 4; m++) more += psi[q * 4 + m] * amount[m];
    Stress(3, law, h[q], weight, t);
    for (PetscInt i = 0; i < 3; i++) t[i][i] += excess * weight * more;
    Turn(3, t, &constant[q * 10], PETSC_TRUE, g);
    for (PetscInt a = 0; a < nodes; a++)
      for (PetscInt i = 0; i < 3; i++) f[a * 3 + i] += g[i][0] * shape->dN[q][a][0] + g[i][1] * shape->dN[q][a][1] + g[i][2] * shape->dN[q][a][2];
  }
}

FEM_CLONES static __attribute__((noinline)) void VolumeAny(const FemShape *shape, const FemElastic *law, const FemLanes *constant, const FemLanes *u, FemLanes *f)
{
  Volume(shape->nodes, shape->points, shape, law, constant, u, f);
}

FEM_CLONES static __attribute__((noinline)) void PointsAny(const FemShape *shape, const FemElastic *law, const FemLanes *constant, const FemLanes *u, FemLanes *f)
{
  if (shape->dim == 2) Points(shape->nodes, 2, shape->points, shape, law, constant, u, f);
  else Points(shape->nodes, 3, shape->points, shape, law, constant, u, f);
}

/* Middle node of corners v and w of a tet10, in gmsh's order. */
static const PetscInt tet_middle[4][4] = {{-1, 4, 6, 7}, {4, -1, 5, 9}, {6, 5, -1, 8}, {7, 9, 8, -1}};

/*
  Straight tet10.  constant: J^-1 [3][3], volume.

  Along corner v the gradient in barycentric coordinates is d_vw = 4 u_vw - u_w - 3 u_v on grad lambda_w, w != v.  Eq. (2.101)
  Linear fields g, g' have the integral V sum_vw (1 + delta_vw)/20 g_v g'_w.  Eq. (2.102)
*/
FEM_CLONES static __attribute__((noinline)) void Tet10(const FemElastic *law, const FemLanes *constant, const FemLanes *u, FemLanes *f)
{
  const FemLanes weight = constant[9] * (1. / 20);
  FemLanes       g[4][3][3], sum[3][3], h[3][3], t[3][3];

  for (PetscInt v = 0; v < 4; v++)
    for (PetscInt i = 0; i < 3; i++) {
      const FemLanes own = 3 * u[3 * v + i];
      FemLanes       d[4] = {own, own, own, own};

      for (PetscInt w = 0; w < 4; w++)
        if (w != v) d[w] = 4 * u[3 * tet_middle[v][w] + i] - u[3 * w + i] - own;
      for (PetscInt j = 0; j < 3; j++) g[v][i][j] = v == 0 ? d[j + 1] : j + 1 == v ? -d[0] : d[j + 1] - d[0];
    }
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) sum[i][j] = (g[0][i][j] + g[1][i][j]) + (g[2][i][j] + g[3][i][j]);
  for (PetscInt k = 0; k < 12; k++) f[k] = 0 * weight;
  for (PetscInt v = 0; v < 4; v++) {
    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < 3; j++) g[v][i][j] += sum[i][j];
    Turn(3, g[v], constant, PETSC_FALSE, h);
    Stress(3, law, h, weight, t);
    Turn(3, t, constant, PETSC_TRUE, h);
    for (PetscInt i = 0; i < 3; i++) {
      FemLanes d[4], all;

      d[0] = d[1] = d[2] = d[3] = 0 * weight; /* force on d_vw */
      for (PetscInt j = 0; j < 3; j++)
        if (j + 1 != v) {
          d[j + 1] = h[i][j];
          if (v) d[0] -= h[i][j];
        } else d[0] -= h[i][j];
      all = (d[0] + d[1]) + (d[2] + d[3]);
      for (PetscInt w = 0; w < 4; w++) {
        if (w == v) continue;
        f[3 * w + i] -= d[w];
        if (w > v) f[3 * tet_middle[v][w] + i] = 4 * d[w];
        else f[3 * tet_middle[v][w] + i] += 4 * d[w];
      }
      f[3 * v + i] -= 3 * all;
    }
  }
}

FEM_CLONES static __attribute__((noinline)) void Tet10Points(const FemShape *shape, const FemElastic *law, const FemLanes *constant, const FemLanes *u, FemLanes *f)
{
  Points(10, 3, 14, shape, law, constant, u, f);
}

FEM_CLONES static __attribute__((noinline)) void Hex27Points(const FemShape *shape, const FemElastic *law, const FemLanes *constant, const FemLanes *u, FemLanes *f)
{
  Points(27, 3, 27, shape, law, constant, u, f);
}

FEM_CLONES static __attribute__((noinline)) void Hex27Volume(const FemShape *shape, const FemElastic *law, const FemLanes *constant, const FemLanes *u, FemLanes *f)
{
  Volume(27, 27, shape, law, constant, u, f);
}

/* Sums and differences of eight numbers along three directions, in place: 1, x, xy, y, z, xz, xyz, yz from the corners of a hex8. Its own transpose but for signs. */
FEM_INLINE void Pairs(FemLanes a[8])
{
  static const PetscInt first[3][4] = {{0, 3, 4, 7}, {0, 1, 4, 5}, {0, 1, 2, 3}}, second[3][4] = {{1, 2, 5, 6}, {3, 2, 7, 6}, {4, 5, 6, 7}};

  for (PetscInt d = 0; d < 3; d++)
    for (PetscInt k = 0; k < 4; k++) {
      const FemLanes p = a[first[d][k]], q = a[second[d][k]];

      a[first[d][k]]  = p + q;
      a[second[d][k]] = q - p;
    }
}

FEM_INLINE void PairsBack(FemLanes a[8])
{
  static const PetscInt first[3][4] = {{0, 3, 4, 7}, {0, 1, 4, 5}, {0, 1, 2, 3}}, second[3][4] = {{1, 2, 5, 6}, {3, 2, 7, 6}, {4, 5, 6, 7}};

  for (PetscInt d = 2; d >= 0; d--)
    for (PetscInt k = 0; k < 4; k++) {
      const FemLanes p = a[first[d][k]], q = a[second[d][k]];

      a[first[d][k]]  = p - q;
      a[second[d][k]] = p + q;
    }
}

/* Places after Pairs(): of the four patterns that no linear field has; and of all but the sum, lines first. */
static const PetscInt hex_pattern[4] = {2, 5, 7, 6}, hex_order[7] = {1, 3, 4, 2, 5, 7, 6};
/* Signs of the eight corners in each place. */
static const PetscInt hex_sign[8][8] = {{1, 1, 1, 1, 1, 1, 1, 1}, {-1, 1, 1, -1, -1, 1, 1, -1}, {1, -1, 1, -1, 1, -1, 1, -1}, {-1, -1, 1, 1, -1, -1, 1, 1},
                                        {-1, -1, -1, -1, 1, 1, 1, 1}, {1, -1, -1, 1, -1, 1, 1, -1}, {-1, 1, -1, 1, 1, -1, 1, -1}, {1, 1, -1, -1, -1, -1, 1, 1}};

/* constant: volume; B [7][3] in hex_order; places [4][3] of the patterns; lower triangle of the patterns' stiffness [12][12].  Eq. (2.106) */
FEM_CLONES static __attribute__((noinline)) void Hex8(const FemElastic *law, const FemLanes *constant, const FemLanes *u, FemLanes *f)
{
  const FemLanes *B = &constant[1], *place = &constant[22], *K = &constant[34], zero = {0};
  FemLanes        a[3][8], H[3][3], t[3][3], q[12], p[12];

  for (PetscInt i = 0; i < 3; i++) {
    for (PetscInt k = 0; k < 8; k++) a[i][k] = u[3 * k + i];
    Pairs(a[i]);
    for (PetscInt j = 0; j < 3; j++) {
      H[i][j] = B[j] * a[i][hex_order[0]];
      for (PetscInt k = 1; k < 7; k++) H[i][j] += B[3 * k + j] * a[i][hex_order[k]];
    }
    for (PetscInt k = 0; k < 4; k++) {
      q[3 * k + i] = a[i][hex_pattern[k]];
      for (PetscInt j = 0; j < 3; j++) q[3 * k + i] -= place[3 * k + j] * H[i][j];
    }
  }
  for (PetscInt k = 0; k < 12; k++) p[k] = zero;
  for (PetscInt k = 0; k < 12; k++) {
    FemLanes sum = K[k * (k + 1) / 2 + k] * q[k];

    for (PetscInt l = 0; l < k; l++) {
      sum += K[k * (k + 1) / 2 + l] * q[l];
      p[l] += K[k * (k + 1) / 2 + l] * q[k];
    }
    p[k] += sum;
  }
  Stress(3, law, H, constant[0], t);
  for (PetscInt i = 0; i < 3; i++) {
    for (PetscInt j = 0; j < 3; j++)
      for (PetscInt k = 0; k < 4; k++) t[i][j] -= place[3 * k + j] * p[3 * k + i];
    a[i][0] = zero;
    for (PetscInt k = 0; k < 7; k++) {
      a[i][hex_order[k]] = k < 3 ? zero : p[3 * (k - 3) + i];
      for (PetscInt j = 0; j < 3; j++) a[i][hex_order[k]] += B[3 * k + j] * t[i][j];
    }
    PairsBack(a[i]);
    for (PetscInt k = 0; k < 8; k++) f[3 * k + i] = a[i][k];
  }
}

FEM_CLONES static __attribute__((noinline)) void Dense(PetscInt n, const FemLanes *K, const FemLanes *u, FemLanes *f)
{
  for (PetscInt i = 0; i < n; i++) {
    f[i] = K[i * n] * u[0];
    for (PetscInt j = 1; j < n; j++) f[i] += K[i * n + j] * u[j];
  }
}

PetscInt FemBatchConstants(FemBatchKind kind, const FemShape *shape)
{
  if (kind == FEM_BATCH_TET10) return 10;
  if (kind == FEM_BATCH_HEX8) return FEM_HEX8_CONSTANTS;
  if (kind == FEM_BATCH_DENSE) return shape->nodes * shape->dim * shape->nodes * shape->dim;
  return shape->points * (shape->dim * shape->dim + 1 + (kind == FEM_BATCH_VOLUME ? shape->dim + 1 : 0));
}

void FemBatchForce(FemBatchKind kind, const FemShape *shape, const FemElastic *law, const FemLanes *constant, const FemLanes *u, FemLanes *f)
{
  if (kind == FEM_BATCH_TET10) Tet10(law, constant, u, f);
  else if (kind == FEM_BATCH_HEX8) Hex8(law, constant, u, f);
  else if (kind == FEM_BATCH_DENSE) Dense(shape->nodes * shape->dim, constant, u, f);
  else if (kind == FEM_BATCH_VOLUME && shape->type == MESH_HEX27) Hex27Volume(shape, law, constant, u, f);
  else if (kind == FEM_BATCH_VOLUME) VolumeAny(shape, law, constant, u, f);
  else if (shape->type == MESH_TET10) Tet10Points(shape, law, constant, u, f);
  else if (shape->type == MESH_HEX27) Hex27Points(shape, law, constant, u, f);
  else PointsAny(shape, law, constant, u, f);
}

/* Solve M X = Y, M [4][4], Y [4][n] in place; false when M is singular. */
static PetscBool Solve4(PetscReal M[4][4], PetscInt n, PetscReal *Y)
{
  for (PetscInt c = 0; c < 4; c++) {
    PetscInt p = c;

    for (PetscInt r = c + 1; r < 4; r++)
      if (PetscAbsReal(M[r][c]) > PetscAbsReal(M[p][c])) p = r;
    if (PetscAbsReal(M[p][c]) < 1e-3) return PETSC_FALSE;
    for (PetscInt k = 0; k < 4 && p != c; k++) {
      const PetscReal m = M[c][k];

      M[c][k] = M[p][k];
      M[p][k] = m;
    }
    for (PetscInt k = 0; k < n && p != c; k++) {
      const PetscReal y = Y[c * n + k];

      Y[c * n + k] = Y[p * n + k];
      Y[p * n + k] = y;
    }
    for (PetscInt r = 0; r < 4; r++) {
      const PetscReal s = M[r][c] / M[c][c];

      if (r == c) continue;
      for (PetscInt k = c; k < 4; k++) M[r][k] -= s * M[c][k];
      for (PetscInt k = 0; k < n; k++) Y[r * n + k] -= s * Y[c * n + k];
    }
  }
  for (PetscInt r = 0; r < 4; r++)
    for (PetscInt k = 0; k < n; k++) Y[r * n + k] /= M[r][r];
  return PETSC_TRUE;
}

PetscBool FemBatchHex8(const PetscReal *K, const PetscReal *b, PetscReal volume, const PetscReal *x, PetscReal constant[FEM_HEX8_CONSTANTS])
{
  PetscReal *B = &constant[1], *place = &constant[22], *stiff = &constant[34], M[4][4], pattern[4][8], both[12][12], KP[24][12];

  constant[0] = volume;
  for (PetscInt k = 0; k < 7; k++)
    for (PetscInt j = 0; j < 3; j++) {
      B[3 * k + j] = 0;
      for (PetscInt a = 0; a < 8; a++) B[3 * k + j] += hex_sign[hex_order[k]][a] * b[3 * a + j] / 8;
    }
  for (PetscInt k = 0; k < 4; k++)
    for (PetscInt j = 0; j < 3; j++) {
      place[3 * k + j] = 0;
      for (PetscInt a = 0; a < 8; a++) place[3 * k + j] += hex_sign[hex_pattern[k]][a] * x[3 * a + j];
    }
  for (PetscInt k = 0; k < 4; k++) /* each pattern without mean gradient, and how the kernel measures it: (2.104) */
    for (PetscInt l = 0; l < 4; l++) {
      M[l][k] = k == l ? 8 : 0;
      for (PetscInt j = 0; j < 3; j++) M[l][k] -= place[3 * l + j] * 8 * B[3 * (3 + k) + j];
    }
  for (PetscInt k = 0; k < 4; k++)
    for (PetscInt a = 0; a < 8; a++) {
      pattern[k][a] = hex_sign[hex_pattern[k]][a];
      for (PetscInt j = 0; j < 3; j++) pattern[k][a] -= x[3 * a + j] * 8 * B[3 * (3 + k) + j];
    }
  { /* rows of M' X = pattern: the field that measures 1 in its own pattern, 0 in the others */
    PetscReal T[4][4];

    for (PetscInt k = 0; k < 4; k++)
      for (PetscInt l = 0; l < 4; l++) T[k][l] = M[l][k];
    if (!Solve4(T, 8, &pattern[0][0])) return PETSC_FALSE;
  }
  for (PetscInt r = 0; r < 24; r++)
    for (PetscInt k = 0; k < 4; k++)
      for (PetscInt j = 0; j < 3; j++) {
        KP[r][3 * k + j] = 0;
        for (PetscInt a = 0; a < 8; a++) KP[r][3 * k + j] += K[r * 24 + 3 * a + j] * pattern[k][a];
      }
  for (PetscInt k = 0; k < 4; k++)
    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt c = 0; c < 12; c++) {
        both[3 * k + i][c] = 0;
        for (PetscInt a = 0; a < 8; a++) both[3 * k + i][c] += pattern[k][a] * KP[3 * a + i][c];
      }
  for (PetscInt k = 0; k < 12; k++)
    for (PetscInt l = 0; l <= k; l++) stiff[k * (k + 1) / 2 + l] = 0.5 * (both[k][l] + both[l][k]);
  return PETSC_TRUE;
}
