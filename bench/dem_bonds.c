/*
  dem_bonds.c - seconds per bond and step of bonded particles: whole steps, by rule, state of the bonds, and threads.

  bench/dem_bonds [-particles 14000,60000] [-steps 5] [-repeats 40] [-lattice] [-laws intact,...] [-write FILE] [-check 0.8] [-twin 0.9]
  Rows of a CSV on the screen: dimension, law, threads, particles, bonds, ns per bond-step, ns per particle-step, time over that of
  one thread. Best of the repeats: a busy machine makes a run slower, never faster. With -check f it fails unless two threads take
  less than f of the time of one, for the last size in 3D. With -twin f it fails unless a whole step takes less than f of the time of
  the plain twin, which forms the force of one bond after the other from the model's own arrays and nothing else; both in turn, so that a busy
  machine is busy for both, and both must agree. -write leaves the last packing as a table.

  Particles are packed at random (-lattice: on a jittered lattice) and move at random, slowly. Laws: `intact`, `exact` without a strength;
  `cohesive`, with one, strained to a fifth of it, so that no bond is looked at singly; `watched`, to half of it, so that every bond
  is; `published`, onate2015 with the published law, to a fifth; `softening`, the same where one bond in fifty is softening or broken.
*/
#include "dem_impl.h"
#include <petsctime.h>

static PetscReal Random(uint64_t *state)
{
  uint64_t z = (*state += 0x9e3779b97f4a7c15ULL);

  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  z ^= z >> 31;
  return (PetscReal)(z >> 11) / 9007199254740992.0;
}

typedef struct {
  DemBody    body;
  DemPacking packing;
  DemCells   cells;
} Bench;

static const char *const law_name[] = {"intact", "cohesive", "watched", "published", "softening"};
enum { INTACT, COHESIVE, WATCHED, PUBLISHED, SOFTENING, LAWS };

/* About n particles of unit spacing: packed at random, or a lattice jittered by a third. */
static PetscErrorCode BenchCreate(PetscInt dim, PetscInt n, PetscBool lattice, Bench *b)
{
  const PetscInt  side = (PetscInt)(PetscPowReal(n, 1.0 / dim) + 0.5);
  const PetscReal low[3] = {0}, high[3] = {side, side, dim == 3 ? side : 1};
  uint64_t        seed = 5;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(b, sizeof(*b)));
  PetscCall(DemBodyCreateBox(dim, low, high, 1, &b->body));
  if (!lattice) {
    const DemPackingOptions options = {.count = n, .spread = 0.3, .seed = 5};

    PetscCall(DemPackingCreate(&b->body, &options, &b->packing));
    PetscCall(DemCellsCreate(&b->body, &b->packing, &b->cells));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  b->packing.n = dim == 3 ? side * side * side : side * side;
  PetscCall(PetscCalloc1(3 * b->packing.n, &b->packing.x));
  PetscCall(PetscMalloc1(b->packing.n, &b->packing.r));
  for (PetscInt k = 0; k < b->packing.n; k++) {
    const PetscInt at[3] = {k % side, k / side % side, k / (side * side)};

    for (PetscInt d = 0; d < dim; d++) b->packing.x[3 * k + d] = at[d] + 0.5 + 0.33 * (2 * Random(&seed) - 1);
    b->packing.r[k] = 0.4;
  }
  PetscCall(DemCellsCreate(&b->body, &b->packing, &b->cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ModelCreate(const Bench *b, PetscInt law, PetscInt threads, DemModel *out, PetscReal *dt)
{
  const DemMaterial material = {.density = 1, .young = 1, .poisson = 0.2};
  const DemStrength cohesive = {.tensile = 1e-6, .fracture_energy = 1e-9, .softening = DEM_SOFTENING_LINEAR, .shear = 2e-6, .shear_energy = 1e-9, .mu_static = 0.5, .mu_dynamic = 0.5};
  const DemStrength published = {.tensile = 1e-6, .shear = 2e-6, .delta_n = 5, .delta_s = 5, .mu_static = 0.5, .mu_dynamic = 0.5, .published = PETSC_TRUE};
  const DemRule     onate = {.elasticity = DEM_ONATE2015, .range = 0.1, .normal_factor = 1, .shear_factor = 1, .area_factor = b->body.dim == 3 ? 0 : 0.6};
  const PetscReal   strain[LAWS] = {0.2e-6, 0.2e-6, 0.5e-6, 0.2e-6, 0.2e-6};
  uint64_t          seed = 9;
  DemModel          model;
  DemState          s;

  PetscFunctionBeginUser;
  PetscCall(DemModelCreate(PETSC_COMM_SELF, &model));
  PetscCall(DemModelSetKind(model, b->body.dim == 3 ? DEM_SOLID : DEM_PLANE_STRESS));
  PetscCall(DemModelSetMaterial(model, &material));
  PetscCall(DemModelSetBody(model, &b->body, &b->packing, &b->cells));
  if (law == COHESIVE || law == WATCHED) PetscCall(DemModelSetStrength(model, &cohesive));
  if (law >= PUBLISHED) {
    PetscCall(DemModelSetRule(model, &onate));
    PetscCall(DemModelSetStrength(model, &published));
  }
  PetscCall(DemModelSetThreads(model, threads));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetStableStep(model, dt));
  PetscCall(DemModelGetState(model, &s));
  for (PetscInt p = 0; p < s.n; p++)
    for (PetscInt d = 0; d < s.dim; d++) {
      s.u[d * s.n + p] = strain[law] * (d == 0 ? s.x0[p] : 0);
      s.v[d * s.n + p] = 1e-12 * (2 * Random(&seed) - 1);
    }
  if (law == SOFTENING) /* every 300th particle out of its place: some of its bonds soften, some are broken */
    for (PetscInt p = 0; p < s.n; p += 300) s.u[p] += 4e-6;
  PetscCall(DemModelRestoreState(model, &s));
  PetscCall(DemModelComputeForces(model));
  *out = model;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Best time of a step with one and with two threads [s]: repeats turn by turn, so that both see the same machine. */
static PetscErrorCode Time(const Bench *b, PetscInt law, PetscInt steps, PetscInt repeats, PetscReal best[2], PetscInt *bonds)
{
  PetscReal dt[2];
  DemModel  model[2];
  DemCracks cracks;
  Stepper   stepper;

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 2; t++) {
    PetscCall(ModelCreate(b, law, t + 1, &model[t], &dt[t]));
    best[t] = PETSC_MAX_REAL;
  }
  for (PetscInt r = -1; r < repeats; r++) /* one to warm up */
    for (PetscInt t = 0; t < 2; t++) {
      PetscLogDouble begin, end;

      PetscCall(DemModelGetStepper(model[t], &stepper));
      PetscCall(PetscTime(&begin));
      for (PetscInt k = 0; k < steps; k++) PetscCall(stepper.step(model[t], 0, 1e-6 * dt[t])); /* strained, and as good as at rest */
      PetscCall(PetscTime(&end));
      if (r >= 0) best[t] = PetscMin(best[t], (end - begin) / steps);
    }
  for (PetscInt t = 0; t < 2; t++) {
    PetscCall(DemModelGetCracks(model[t], &cracks));
    if (law != SOFTENING) PetscCheck(cracks.n == 0, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%d bonds broke in the benchmark", (int)cracks.n);
    PetscCall(DemModelGetCounts(model[t], NULL, bonds, NULL));
    PetscCall(DemModelDestroy(&model[t]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The twin: forces on the particles from every bond's own force, one by one. */
static void Twin(DemModel model, PetscReal *f)
{
  const DemBonds *b = &model->bonds;

  for (PetscInt i = 0; i < 3 * model->n; i++) f[i] = 0;
  for (PetscInt e = 0; e < b->n; e++) {
    PetscReal t[3];

    DemBondForce_Internal(model, e, t);
    for (PetscInt d = 0; d < 3; d++) {
      f[d * model->n + b->p[e]] += t[d];
      f[d * model->n + b->q[e]] -= t[d];
    }
  }
}

/* Time of a step over that of the twin; their forces must be the same. */
static PetscErrorCode TimeTwin(const Bench *b, PetscInt law, PetscInt repeats, PetscReal *ratio)
{
  PetscReal dt, best[2] = {PETSC_MAX_REAL, PETSC_MAX_REAL}, *f, off = 0, size = 0;
  DemModel  model;
  DemState  s;

  PetscFunctionBeginUser;
  PetscCall(ModelCreate(b, law, 1, &model, &dt));
  PetscCall(PetscMalloc1(3 * model->n, &f));
  for (PetscInt r = 0; r < repeats; r++) {
    PetscLogDouble begin, middle, end;

    PetscCall(PetscTime(&begin));
    PetscCall(DemStep_Internal(model, 0, 1e-6 * dt));
    PetscCall(PetscTime(&middle));
    Twin(model, f);
    PetscCall(PetscTime(&end));
    best[0] = PetscMin(best[0], middle - begin);
    best[1] = PetscMin(best[1], end - middle);
  }
  PetscCall(DemModelGetState(model, &s));
  for (PetscInt i = 0; i < b->body.dim * model->n; i++) {
    off  = PetscMax(off, PetscAbsReal(f[i] - s.f[i]));
    size = PetscMax(size, PetscAbsReal(f[i]));
  }
  PetscCall(DemModelRestoreState(model, &s));
  PetscCheck(off <= 1e-10 * size, PETSC_COMM_SELF, PETSC_ERR_PLIB, "Forces are off by %g of the twin's %g", (double)off, (double)size);
  *ratio = best[0] / best[1];
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%d,%s: a step takes %.3f of the twin's time\n", (int)b->body.dim, law_name[law], (double)*ratio));
  PetscCall(PetscFree(f));
  PetscCall(DemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Run(void)
{
  PetscInt  sizes[8] = {14000, 60000}, n_sizes = 8, steps = 5, repeats = 40;
  PetscReal check = 0, ratio = 0, twin = 0;
  PetscBool given, lattice = PETSC_FALSE, some, writes;
  char      file[PETSC_MAX_PATH_LEN], *laws[LAWS];
  PetscInt  n_laws = LAWS;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetIntArray(NULL, NULL, "-particles", sizes, &n_sizes, &given));
  if (!given) n_sizes = 2;
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-lattice", &lattice, NULL));
  PetscCall(PetscOptionsGetStringArray(NULL, NULL, "-laws", laws, &n_laws, &some));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-write", file, sizeof(file), &writes));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-steps", &steps, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-repeats", &repeats, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-check", &check, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-twin", &twin, NULL));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "dimension[-],law,threads[-],particles[-],bonds[-],bond_step[ns],particle_step[ns],of_one_thread[-]\n"));
  for (PetscInt dim = check > 0 || writes ? 3 : 2; dim <= 3; dim++)
    for (PetscInt i = 0; i < n_sizes; i++) {
      Bench b;

      PetscCall(BenchCreate(dim, sizes[i], lattice, &b));
      if (writes) PetscCall(DemPackingWrite(&b.packing, file));
      for (int law = 0; law < (check > 0 ? 1 : LAWS); law++) {
        PetscReal best[2] = {0, 0};
        PetscInt  bonds   = 0;
        PetscBool wanted  = some ? PETSC_FALSE : PETSC_TRUE;

        for (PetscInt l = 0; l < n_laws && some; l++) {
          PetscCall(PetscStrcmp(laws[l], law_name[law], &given));
          wanted = (PetscBool)(wanted || given);
        }
        if (!wanted) continue;
        if (twin > 0) {
          PetscReal of_twin;

          PetscCall(TimeTwin(&b, law, repeats, &of_twin));
          PetscCheck(of_twin < twin, PETSC_COMM_SELF, PETSC_ERR_PLIB, "A step takes %.3f of the time of its plain twin, not below %.3f", (double)of_twin, (double)twin);
          continue;
        }
        PetscCall(Time(&b, law, steps, repeats, best, &bonds));
        ratio = best[1] / best[0];
        for (int t = 0; t < 2; t++)
          PetscCall(PetscPrintf(PETSC_COMM_SELF, "%d,%s,%d,%d,%d,%.2f,%.1f,%.3f\n", (int)dim, law_name[law], t + 1, (int)b.packing.n, (int)bonds, (double)(1e9 * best[t] / bonds),
                                (double)(1e9 * best[t] / b.packing.n), (double)(best[t] / best[0])));
      }
      PetscCall(DemCellsDestroy(&b.cells));
      PetscCall(DemPackingDestroy(&b.packing));
      PetscCall(DemBodyDestroy(&b.body));
    }
  for (PetscInt l = 0; l < n_laws && some; l++) PetscCall(PetscFree(laws[l]));
  if (check > 0) PetscCheck(ratio < check, PETSC_COMM_SELF, PETSC_ERR_PLIB, "Two threads take %.3f of one thread's time, not below %.3f", (double)ratio, (double)check);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscErrorCode ierr;

  if (BaseInitialize(&argc, &argv)) return 1;
  ierr = Run();
  return BaseFinalize() || ierr ? 1 : 0;
}
