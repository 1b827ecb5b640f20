#include "dem_solve.h"
#include "check.h"

PetscReal TestRandom(uint64_t *state)
{
  uint64_t z = (*state += 0x9e3779b97f4a7c15ULL);

  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  z ^= z >> 31;
  return (PetscReal)(z >> 11) / 9007199254740992.0;
}

PetscErrorCode TestBodyCreate(PetscInt dim, const PetscReal size[3], PetscReal n, PetscReal jitter, uint64_t seed, TestBody *t)
{
  const PetscReal zero[3] = {0, 0, 0};
  PetscReal       volume  = 1;
  PetscInt        count[3] = {1, 1, 1}, total = 1, made = 0;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(t, sizeof(*t)));
  PetscCall(DemBodyCreateBox(dim, zero, size, 1, &t->body));
  for (PetscInt d = 0; d < dim; d++) {
    volume *= size[d];
    count[d] = (PetscInt)PetscMax(1, PetscFloorReal(size[d] * n + 0.5));
    total *= count[d];
  }
  t->packing.n = total;
  PetscCall(PetscCalloc1(3 * total, &t->packing.x));
  PetscCall(PetscCalloc1(total, &t->packing.r));
  if (jitter > 0) {
    for (PetscInt k = 0; k < total; k++) {
      const PetscInt at[3] = {k % count[0], k / count[0] % count[1], k / (count[0] * count[1])};

      for (PetscInt d = 0; d < dim; d++) t->packing.x[3 * k + d] = (at[d] + 0.5 + jitter * (TestRandom(&seed) - 0.5)) * size[d] / count[d];
      t->packing.r[k] = 0.3 / n * (1 + 0.3 * (2 * TestRandom(&seed) - 1));
    }
  } else {
    const PetscReal mean = dim == 3 ? PetscPowReal(0.22 * volume / total * 0.75 / PETSC_PI, 1.0 / 3) : PetscSqrtReal(0.38 * volume / total / PETSC_PI);

    for (PetscInt tries = 0; made < total && tries < 5000000; tries++) {
      PetscReal      x[3] = {0}, gap = 1;
      const PetscReal r = mean * (1 + 0.3 * (1 - 2 * (made + 0.5) / total)); /* large ones first */

      for (PetscInt d = 0; d < dim; d++) x[d] = r + TestRandom(&seed) * (size[d] - 2 * r);
      for (PetscInt k = 0; k < made && gap > 0; k++) {
        PetscReal d2 = 0;

        for (PetscInt d = 0; d < dim; d++) d2 += PetscSqr(x[d] - t->packing.x[3 * k + d]);
        gap = PetscSqrtReal(d2) - r - t->packing.r[k];
      }
      if (gap <= 0) continue;
      for (PetscInt d = 0; d < dim; d++) t->packing.x[3 * made + d] = x[d];
      t->packing.r[made++] = r;
    }
    PetscCheck(made == total, PETSC_COMM_SELF, PETSC_ERR_PLIB, "Random addition jammed at %" PetscInt_FMT " of %" PetscInt_FMT, made, total);
  }
  PetscCall(DemCellsCreate(&t->body, &t->packing, &t->cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TestBodyDestroy(TestBody *t)
{
  PetscFunctionBegin;
  PetscCall(DemCellsDestroy(&t->cells));
  PetscCall(DemPackingDestroy(&t->packing));
  PetscCall(DemBodyDestroy(&t->body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TestModelCreate(const TestBody *t, DemKind kind, PetscReal young, PetscReal poisson, DemModel *model)
{
  const DemMaterial material = {.density = 1, .young = young, .poisson = poisson};

  PetscFunctionBegin;
  PetscCall(DemModelCreate(PETSC_COMM_SELF, model));
  PetscCall(DemModelSetKind(*model, kind));
  PetscCall(DemModelSetMaterial(*model, &material));
  PetscCall(DemModelSetBody(*model, &t->body, &t->packing, &t->cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt TestUnknowns(DemModel model)
{
  DemState s;
  PetscInt n;

  PetscCallAbort(PETSC_COMM_SELF, DemModelGetState(model, &s));
  n = (s.dim == 3 ? 6 : 3) * s.n;
  PetscCallAbort(PETSC_COMM_SELF, DemModelRestoreState(model, &s));
  return n;
}

PetscErrorCode TestSetState(DemModel model, const PetscReal *x)
{
  DemState s;

  PetscFunctionBegin;
  PetscCall(DemModelGetState(model, &s));
  PetscCall(PetscArraycpy(s.u, x, s.dim * s.n));
  for (PetscInt p = 0; p < s.n; p++) {
    if (s.dim == 2) {
      const PetscReal a = x[2 * s.n + p];

      s.rot[p]           = PetscSinReal(a);
      s.rot[s.n + p]     = -2 * PetscSqr(PetscSinReal(0.5 * a));
      s.rot[2 * s.n + p] = a;
    } else {
      PetscReal v[3], a = 0, f;

      for (PetscInt d = 0; d < 3; d++) {
        v[d] = x[(3 + d) * s.n + p];
        a += v[d] * v[d];
      }
      a        = PetscSqrtReal(a);
      f        = a > 0 ? PetscSinReal(0.5 * a) / a : 0.5;
      s.rot[p] = PetscCosReal(0.5 * a);
      for (PetscInt d = 0; d < 3; d++) s.rot[(1 + d) * s.n + p] = f * v[d];
    }
  }
  PetscCall(DemModelRestoreState(model, &s));
  PetscCall(DemModelComputeForces(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TestGetForce(DemModel model, PetscReal *f)
{
  DemState s;

  PetscFunctionBegin;
  PetscCall(DemModelGetState(model, &s));
  PetscCall(PetscArraycpy(f, s.f, s.dim * s.n));
  PetscCall(PetscArraycpy(f + s.dim * s.n, s.torque, (s.dim == 3 ? 3 : 1) * s.n));
  PetscCall(DemModelRestoreState(model, &s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Dot(PetscInt n, const PetscReal *a, const PetscReal *b)
{
  PetscReal sum = 0;

  for (PetscInt i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}

PetscErrorCode TestEquilibrium(DemModel model, PetscReal rtol, PetscReal *x, PetscInt *iterations)
{
  const PetscInt n = TestUnknowns(model);
  PetscReal     *r, *z, *p, *q, *m, *zero, rz, loads, *best, dt, start, reference = 0;
  DemState       s;
  PetscInt       it = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc7(n, &r, n, &z, n, &p, n, &q, n, &m, n, &zero, n, &best));
  PetscCall(DemModelGetState(model, &s));
  PetscCall(DemModelGetCriticalStep(model, &dt));
  for (PetscInt i = 0; i < n; i++) m[i] = 0.25 * dt * dt / ( /* search directions are then of the size of the motion: small */i < s.dim * s.n ? s.mass[i % s.n] : s.inertia[i % s.n]);
  PetscCall(DemModelRestoreState(model, &s));
  PetscCall(TestSetState(model, zero));
  PetscCall(TestGetForce(model, best)); /* loads alone */
  loads = PetscSqrtReal(Dot(n, best, best));
  for (PetscInt round = 0; round < 3; round++) { /* restarts refine what rounding left */
    PetscCall(TestSetState(model, x));
    PetscCall(TestGetForce(model, r));
    for (PetscInt i = 0; i < n; i++) p[i] = z[i] = m[i] * r[i];
    rz    = Dot(n, r, z);
    start = PetscSqrtReal(Dot(n, r, r));
    for (PetscInt k = 0; k < 20 * n && PetscSqrtReal(Dot(n, r, r)) > PetscMax(rtol * loads, 1e-6 * start); k++, it++) {
      PetscReal a, old = rz, up;

      if (reference == 0) reference = PetscSqrtReal(Dot(n, p, p));
      up = reference / PetscSqrtReal(Dot(n, p, p)); /* p as large as the first one: K p then stands clear of the loads */
      for (PetscInt i = 0; i < n; i++) z[i] = up * p[i];
      PetscCall(TestSetState(model, z));
      PetscCall(TestGetForce(model, q));
      for (PetscInt i = 0; i < n; i++) q[i] = (best[i] - q[i]) / up; /* K p: the loads taken off */
      a = rz / Dot(n, p, q);
      for (PetscInt i = 0; i < n; i++) {
        x[i] += a * p[i];
        r[i] -= a * q[i];
        z[i] = m[i] * r[i];
      }
      rz = Dot(n, r, z);
      for (PetscInt i = 0; i < n; i++) p[i] = z[i] + rz / old * p[i];
    }
  }
  PetscCall(TestSetState(model, x));
  if (iterations) *iterations = it;
  PetscCall(PetscFree7(r, z, p, q, m, zero, best));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TestRemoveRigid(DemModel model, PetscReal *x)
{
  DemState  s;
  PetscReal A[6][7] = {{0}}, c[3] = {0};

  PetscFunctionBegin;
  PetscCall(DemModelGetState(model, &s));
  const PetscInt n = s.n, dim = s.dim, modes = dim == 3 ? 6 : 3;

  for (PetscInt p = 0; p < n; p++)
    for (PetscInt d = 0; d < dim; d++) c[d] += s.x0[d * n + p] / n;
#define MODE(j, d, p) (j < dim ? (PetscReal)(j == d) : dim == 2 ? (d == 0 ? -y[1] : y[0]) : (d == (j - dim + 2) % 3 ? y[(j - dim + 1) % 3] : d == (j - dim + 1) % 3 ? -y[(j - dim + 2) % 3] : 0))
  for (PetscInt p = 0; p < n; p++) {
    PetscReal y[3] = {0};

    for (PetscInt d = 0; d < dim; d++) y[d] = s.x0[d * n + p] - c[d];
    for (PetscInt d = 0; d < dim; d++)
      for (PetscInt i = 0; i < modes; i++) {
        for (PetscInt j = 0; j < modes; j++) A[i][j] += MODE(i, d, p) * MODE(j, d, p);
        A[i][6] += MODE(i, d, p) * x[d * n + p];
      }
  }
  for (PetscInt i = 0; i < modes; i++) /* Gauss-Jordan; the matrix is well conditioned about the centre */
    for (PetscInt j = 0; j < modes; j++) {
      const PetscReal f = A[j][i] / A[i][i];

      if (j == i) continue;
      for (PetscInt k = 0; k < 7; k++) A[j][k] -= f * A[i][k];
    }
  for (PetscInt p = 0; p < n; p++) {
    PetscReal y[3] = {0};

    for (PetscInt d = 0; d < dim; d++) y[d] = s.x0[d * n + p] - c[d];
    for (PetscInt j = 0; j < modes; j++) {
      for (PetscInt d = 0; d < dim; d++) x[d * n + p] -= A[j][6] / A[j][j] * MODE(j, d, p);
      if (j >= dim) x[j * n + p] -= A[j][6] / A[j][j];
    }
  }
#undef MODE
  PetscCall(DemModelRestoreState(model, &s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rank's own particles are those of the whole body, to the last bit. */
PetscErrorCode TestSameState(DemModel part, DemModel whole)
{
  DemState  a, b;
  PetscInt *where;

  PetscFunctionBegin;
  PetscCall(DemModelGetState(part, &a));
  PetscCall(DemModelGetState(whole, &b));
  PetscCall(PetscMalloc1(b.n, &where));
  for (PetscInt p = 0; p < b.n; p++) where[b.number[p]] = p;
  for (PetscInt p = 0; p < a.own; p++) {
    const PetscInt q = where[a.number[p]];

    for (PetscInt d = 0; d < 3; d++) {
      CheckNear(a.u[d * a.n + p], b.u[d * b.n + q], 0);
      CheckNear(a.v[d * a.n + p], b.v[d * b.n + q], 0);
      CheckNear(a.spin[d * a.n + p], b.spin[d * b.n + q], 0);
      CheckNear(a.f[d * a.n + p], b.f[d * b.n + q], 0);
    }
    for (PetscInt d = 0; d < 4; d++) CheckNear(a.rot[d * a.n + p], b.rot[d * b.n + q], 0);
  }
  PetscCall(PetscFree(where));
  PetscCall(DemModelRestoreState(part, &a));
  PetscCall(DemModelRestoreState(whole, &b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TestSteps(DemModel model, PetscReal safety, PetscInt from, PetscInt to)
{
  PetscReal dt;

  PetscFunctionBegin;
  PetscCall(DemModelGetCriticalStep(model, &dt));
  for (PetscInt k = from; k < to; k++) {
    PetscCall(DemModelAdvance(model, k * safety * dt, safety * dt));
    PetscCall(DemModelEvaluate(model, safety * dt));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TestStepsMigrating(DemModel model, PetscReal safety, PetscInt from, PetscInt to, PetscInt every)
{
  DemSharing  sharing;
  PetscInt    pieces;
  PetscMPIInt size, *owner;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(DemModelGetSharing(model, &pieces, &sharing));
  PetscCall(PetscMalloc1(pieces, &owner));
  for (PetscInt k = from; k < to; k += every) {
    for (PetscInt u = 0; u < pieces; u++) owner[u] = (PetscMPIInt)((u + k / every) % size);
    PetscCall(TestSteps(model, safety, k, PetscMin(k + every, to)));
    PetscCall(DemModelMigrate(model, k / every % 3 == 2 ? NULL : owner));
  }
  PetscCall(PetscFree(owner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TestSameEnergies(DemModel part, DemModel whole, Ledger *of_part, Ledger *of_whole)
{
  Stepper   a, b;
  PetscReal most = 0;

  PetscFunctionBegin;
  PetscCall(DemModelGetStepper(part, &a));
  PetscCall(DemModelGetStepper(whole, &b));
  PetscCall(a.energy(part, of_part));
  PetscCall(b.energy(whole, of_whole));
  for (int k = 0; k < LEDGER_TERMS; k++) most = PetscMax(most, PetscAbsReal(of_whole->energy[k]));
  for (int k = 0; k < LEDGER_TERMS; k++) CheckNear(of_part->energy[k], of_whole->energy[k], 1e-12 * most);
  PetscFunctionReturn(PETSC_SUCCESS);
}
