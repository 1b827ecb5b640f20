/*
  wave.c - a steady wave sent down a strip, and the two amplitudes before the join.

  The end moves as a sine that swells over ten periods. Then, over ten more and under a Hann window in time, every point of the
  probe section gives its complex amplitude; A exp(-ikx) + B exp(ikx) with the fine chain's own k is fitted to them by least squares.
  The strip is so long that nothing comes back from its ends before that is over.
*/
#include "wave.h"
#include <complex.h>

#define SWELL  12 /* periods until the amplitude is full */
#define WATCH  12 /* periods watched */
/* The strip is one square element high. With a single row of particles across flat elements the corrected energy (6.2) is not positive: it grew at any step */

PetscReal WaveEdge(PetscReal lambda, PetscReal dt)
{
  const PetscReal O = 2 / dt * PetscSinReal(PETSC_PI * dt / lambda);
  const PetscReal fine = PetscSqrtReal(1 - PetscSqr(0.5 * O / WAVE_RATIO)), coarse = PetscSqrtReal(1 - PetscSqr(0.5 * O));

  return PetscSqr((fine - coarse) / (fine + coarse));
}

/* `before` cells of this edge up to x = 0, each in `fine` parts, then `after` whole ones: one row; groups "xmin", and "grains" for x < 0. */
static PetscErrorCode StripMesh(MeshCellType type, PetscInt edge, PetscInt before, PetscInt fine, PetscInt after, Mesh *mesh)
{
  const PetscReal zero[3] = {0}, size[3] = {1, edge, 1};
  const PetscInt  n[3] = {before * fine + after, 1, 1};
  MeshGroup      *group;

  PetscFunctionBegin;
  PetscCall(MeshCreateBox(PETSC_COMM_SELF, "body", type, zero, size, n, mesh));
  for (PetscInt i = 0; i < mesh->n_nodes; i++) { /* half column of the unit box to its place */
    const PetscInt half = (PetscInt)(2 * mesh->x[3 * i] * n[0] + 0.5) - 2 * before * fine;

    mesh->x[3 * i] = 0.5 * edge * (half < 0 ? (PetscReal)half / fine : (PetscReal)half);
  }
  PetscCall(PetscMalloc1(mesh->n_groups + 1, &group));
  PetscCall(PetscArraycpy(group, mesh->group, mesh->n_groups));
  PetscCall(PetscFree(mesh->group));
  mesh->group = group;
  group       = &mesh->group[mesh->n_groups++];
  PetscCall(PetscMemzero(group, sizeof(*group)));
  PetscCall(PetscStrncpy(group->name, "grains", sizeof(group->name)));
  group->dim = 2;
  PetscCall(PetscMalloc1(mesh->n_cells, &group->cell));
  for (PetscInt k = 0; k < mesh->n_cells; k++) {
    PetscReal x = 0;

    if (MeshCellDim(mesh->type[k]) != 2) continue;
    for (PetscInt a = mesh->start[k]; a < mesh->start[k + 1]; a++) x += mesh->x[3 * mesh->node[a]];
    if (x < 0) group->cell[group->n_cells++] = k;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of square cells over the particles' mesh. */
static PetscErrorCode StripParticles(PetscInt edge, Coupled *c)
{
  const PetscInt rows = edge * WAVE_RATIO;
  PetscReal      low = PETSC_MAX_REAL, high = PETSC_MIN_REAL;

  PetscFunctionBegin;
  PetscCall(DemBodyCreateFromMesh(&c->split.dem, "", 1, &c->body));
  for (PetscInt i = 0; i < c->split.dem.n_nodes; i++) {
    low  = PetscMin(low, c->split.dem.x[3 * i]);
    high = PetscMax(high, c->split.dem.x[3 * i]);
  }
  c->packing.n = rows * (PetscInt)((high - low) * WAVE_RATIO + 0.5);
  PetscCall(PetscCalloc1(3 * c->packing.n, &c->packing.x));
  PetscCall(PetscMalloc1(c->packing.n, &c->packing.r));
  for (PetscInt k = 0; k < c->packing.n; k++) {
    c->packing.x[3 * k]     = low + (k / rows + 0.5) / WAVE_RATIO;
    c->packing.x[3 * k + 1] = (k % rows + 0.5) / WAVE_RATIO;
    c->packing.r[k]         = 0.5 / WAVE_RATIO;
  }
  PetscCall(DemCellsCreate(&c->body, &c->packing, &c->cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode StripCreate(MeshCellType type, PetscInt edge, PetscInt before, PetscInt after, PetscInt width, const CouplingOptions *options, const Table *drive, Coupled *c)
{
  const DemMaterial material = {.density = 1, .young = 1, .poisson = 0};

  PetscFunctionBegin;
  PetscCall(PetscMemzero(c, sizeof(*c)));
  c->material = (FemMaterial){.density = 1, .young = 1, .poisson = 0};
  PetscCall(StripMesh(type, edge, before, width ? 1 : WAVE_RATIO, after, &c->mesh));
  if (width) PetscCall(CouplingSplitCreate(&c->mesh, "grains", width, &c->split));
  PetscCall(FemModelCreate(PETSC_COMM_SELF, &c->fem));
  PetscCall(FemModelSetKind(c->fem, FEM_PLANE_STRAIN, 1));
  PetscCall(FemModelSetMethod(c->fem, FEM_EXPLICIT));
  PetscCall(FemModelSetMesh(c->fem, width ? &c->split.fem : &c->mesh));
  PetscCall(FemModelAddMaterial(c->fem, "", &c->material));
  if (!width) {
    PetscCall(FemModelFix(c->fem, "xmin", 0, FEM_DISPLACEMENT, drive));
    PetscCall(FemModelSetUp(c->fem));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(StripParticles(edge, c));
  PetscCall(DemModelCreate(PETSC_COMM_SELF, &c->dem));
  PetscCall(DemModelSetKind(c->dem, DEM_PLANE_STRAIN));
  PetscCall(DemModelSetMaterial(c->dem, &material));
  PetscCall(DemModelSetBody(c->dem, &c->body, &c->packing, &c->cells));
  PetscCall(DemModelFix(c->dem, "xmin", 0, DEM_DISPLACEMENT, drive));
  PetscCall(CouplingModelCreate(PETSC_COMM_SELF, &c->model));
  PetscCall(CouplingModelSetSplit(c->model, &c->split, options));
  PetscCall(CouplingModelSetSides(c->model, c->fem, c->dem, &c->packing, &c->cells, &c->material, FEM_PLANE_STRAIN, 1));
  PetscCall(CouplingModelSetUp(c->model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode StripDestroy(PetscInt width, Coupled *c)
{
  PetscFunctionBegin;
  if (width) PetscCall(CoupledDestroy(c));
  else {
    PetscCall(FemModelDestroy(&c->fem));
    PetscCall(MeshDestroy(&c->mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Least squares of A exp(-ikx) + B exp(ikx) to the amplitudes a at x: |B/A|^2. */
static PetscReal Ratio(PetscInt n, const PetscReal *x, const double complex *a, PetscReal k)
{
  double complex down = 0, up = 0, cross = 0;

  for (PetscInt i = 0; i < n; i++) {
    down += a[i] * cexp(I * k * x[i]);
    up += a[i] * cexp(-I * k * x[i]);
    cross += cexp(2 * I * k * x[i]);
  }
  /* n A + cross B = down, conj(cross) A + n B = up */
  const double complex A = n * down - cross * up, B = n * up - conj(cross) * down;

  return PetscSqr(cabs(B) / cabs(A));
}

PetscErrorCode WaveReflect(PetscReal lambda, PetscInt width, const CouplingOptions *options, PetscReal *energy, PetscReal *step)
{
  PetscFunctionBegin;
  PetscCall(WaveReflectFrom(MESH_QUAD4, 1, lambda, width, options, energy, step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode WaveReflectFrom(MeshCellType type, PetscInt edge, PetscReal lambda, PetscInt width, const CouplingOptions *options, PetscReal *energy, PetscReal *step)
{
  const PetscReal omega = 2 * PETSC_PI / lambda, dt = (options && options->method == COUPLING_PENALTY && options->penalty > 0.2 ? 0.5 : 1) * WAVE_STEP / WAVE_RATIO; /* stiff springs have a smaller step */
  const PetscReal k = 2 * WAVE_RATIO * asin(PetscSinReal(0.5 * omega * dt) / (dt * WAVE_RATIO)); /* sin(kd/2) = (d/dt) sin(omega dt/2) */
  const PetscReal probe = 2 * lambda, swell = SWELL * lambda, watch = WATCH * lambda;
  /* the front runs to the join, swells there, comes back over the probe; the end's echo of it must not be in time */
  const PetscInt  far = (PetscInt)(0.55 * (swell + watch)) + 2 * (PetscInt)probe + 10, cells = ((PetscInt)(0.55 * (swell + watch) + 2 * probe) + 9 + edge) / edge, before = cells * edge;
  const PetscReal begin = before + 1.1 * probe + swell;
  const PetscInt  first = (PetscInt)(begin / dt), last = first + (PetscInt)(watch / dt + 0.5);
  PetscReal      *t, *v, *x, most;
  double complex *a;
  PetscInt       *row, n = 0;
  Coupled         c;
  Table           drive;
  Stepper         stepper;
  FemState        fs = {0};
  DemState        ds = {0};

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(last + 2, &t, last + 2, &v));
  for (PetscInt i = 0; i < last + 2; i++) {
    t[i] = i * dt;
    v[i] = 1e-9 * PetscSinReal(omega * t[i]) * (t[i] < swell ? PetscSqr(PetscSinReal(0.5 * PETSC_PI * t[i] / swell)) : 1);
  }
  PetscCall(TableCreate(last + 2, t, v, &drive));
  PetscCall(PetscFree2(t, v));
  PetscCall(StripCreate(type, edge, cells, (far + edge - 1) / edge + width, width, options, &drive, &c));
  if (width) PetscCall(CouplingModelGetStepper(c.model, &stepper));
  else PetscCall(FemModelGetStepper(c.fem, &stepper));
  PetscCall(stepper.stable_step(stepper.ctx, &most));
  PetscCheck(dt < most, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "Step %g s above the strip's %g s", (double)dt, (double)most);

  if (width) PetscCall(DemModelGetState(c.dem, &ds));
  else PetscCall(FemModelGetState(c.fem, &fs));
  const PetscInt   all = width ? ds.n : fs.n_nodes, stride = width ? 1 : 2;
  const PetscReal *x0 = width ? ds.x0 : fs.x;

  PetscCall(PetscMalloc3(all, &x, all, &row, all, &a));
  for (PetscInt i = 0; i < all; i++)
    if (x0[i * stride] > -1 - probe && x0[i * stride] < -1) {
      x[n]   = x0[i * stride];
      a[n]   = 0;
      row[n++] = i;
    }
  for (PetscInt i = 0; i < last; i++) {
    if (width) PetscCall(DemModelRestoreState(c.dem, &ds));
    else PetscCall(FemModelRestoreState(c.fem, &fs));
    PetscCall(stepper.step(stepper.ctx, i * dt, dt));
    if (width) PetscCall(DemModelGetState(c.dem, &ds));
    else PetscCall(FemModelGetState(c.fem, &fs));
    if (i < first) continue;
    const PetscReal hann = 1 - PetscCosReal(2 * PETSC_PI * (i - first + 1.0) / (last - first + 1.0));

    const PetscReal *u = width ? ds.u : fs.u;

    for (PetscInt j = 0; j < n; j++) a[j] += hann * u[row[j] * stride] * cexp(-I * omega * (i + 1) * dt);
  }
  *energy = Ratio(n, x, a, k);
  if (step) *step = dt;
  if (width) PetscCall(DemModelRestoreState(c.dem, &ds));
  else PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(PetscFree3(x, row, a));
  PetscCall(TableDestroy(&drive));
  PetscCall(StripDestroy(width, &c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
