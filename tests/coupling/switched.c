#include "switched.h"
#include "check.h"

static PetscReal Random(uint64_t *state)
{
  uint64_t z = (*state += 0x9e3779b97f4a7c15ULL);

  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  z ^= z >> 31;
  return (PetscReal)(z >> 11) / 9007199254740992.0;
}

Switched SwitchedDefault(PetscInt dim, PetscReal x, PetscReal y, PetscReal z)
{
  return (Switched){.dim = dim, .threads = 1, .substeps = 1, .size = {x, y, z}, .h = 1, .ratio = dim == 3 ? 3 : 4, .nu = 0.2, .width = 2, .seed = 3, .options = {.at = 0.7, .hysteresis = 0.1}};
}

static void Centroid(const Mesh *mesh, PetscInt c, PetscReal x[3])
{
  for (PetscInt d = 0; d < 3; d++) {
    x[d] = 0;
    for (PetscInt k = mesh->start[c]; k < mesh->start[c + 1]; k++) x[d] += mesh->x[3 * mesh->node[k] + d] / (mesh->start[c + 1] - mesh->start[c]);
  }
}

static PetscErrorCode AddGroup(Switched *s, const char *name, const PetscReal low[3], const PetscReal high[3])
{
  MeshGroup *group;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->mesh.n_groups + 1, &group));
  PetscCall(PetscArraycpy(group, s->mesh.group, s->mesh.n_groups));
  PetscCall(PetscFree(s->mesh.group));
  s->mesh.group = group;
  group         = &s->mesh.group[s->mesh.n_groups++];
  PetscCall(PetscMemzero(group, sizeof(*group)));
  PetscCall(PetscStrncpy(group->name, name, sizeof(group->name)));
  group->dim = s->dim;
  PetscCall(PetscMalloc1(s->mesh.n_cells, &group->cell));
  for (PetscInt c = 0; c < s->mesh.n_cells; c++) {
    PetscReal x[3];
    PetscBool inside = PETSC_TRUE;

    if (MeshCellDim(s->mesh.type[c]) != s->dim) continue;
    Centroid(&s->mesh, c, x);
    for (PetscInt d = 0; d < s->dim; d++) inside = (PetscBool)(inside && x[d] > low[d] && x[d] < high[d]);
    if (inside) group->cell[group->n_cells++] = c;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Make(void *ctx, const CouplingSplit *split, const DemBody *body, const DemPacking *packing, const DemCells *cells, FemModel *fem, DemModel *dem)
{
  Switched         *s = ctx;
  const DemMaterial material = {.density = s->material.density, .young = s->material.young, .poisson = s->material.poisson};

  PetscFunctionBegin;
  PetscCall(FemModelCreate(PETSC_COMM_SELF, fem));
  PetscCall(FemModelSetKind(*fem, s->dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, 1));
  PetscCall(FemModelSetMethod(*fem, FEM_EXPLICIT));
  PetscCall(FemModelSetThreads(*fem, s->threads));
  PetscCall(FemModelSetMesh(*fem, &split->fem));
  PetscCall(FemModelAddMaterial(*fem, "", &s->material));
  PetscCall(DemModelCreate(PETSC_COMM_SELF, dem));
  PetscCall(DemModelSetKind(*dem, s->dim == 3 ? DEM_SOLID : DEM_PLANE_STRAIN));
  PetscCall(DemModelSetThreads(*dem, s->threads));
  PetscCall(DemModelSetMaterial(*dem, &material));
  PetscCall(DemModelSetStrength(*dem, &s->strength));
  PetscCall(DemModelSetBody(*dem, body, packing, cells));
  if (s->conditions) PetscCall(s->conditions(s, *fem, *dem));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SwitchedCreate(Switched *s)
{
  PetscFunctionBegin;
  PetscCall(SwitchedPrepare(s));
  PetscCall(SwitchedBegin(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SwitchedPrepare(Switched *s)
{
  const PetscReal       zero[3] = {0, 0, 0}, d = s->h / s->ratio, from[3] = {s->start[0][0], s->start[1][0], s->start[2][0]};
  const Mesh           *region;
  PetscInt              n[3] = {1, 1, 1}, m[3] = {1, 1, 1};
  PetscReal             low[3] = {0}, high[3] = {0}, to[3];
  uint64_t              seed = s->seed;

  PetscFunctionBegin;
  s->material = (FemMaterial){.density = 1, .young = 1, .poisson = s->nu};
  if (s->strength.tensile == 0) s->strength = (DemStrength){.tensile = 1, .fracture_energy = 1e3, .softening = DEM_SOFTENING_LINEAR};
  for (PetscInt k = 0; k < s->dim; k++) n[k] = (PetscInt)(s->size[k] / s->h + 0.5);
  PetscCall(MeshCreateBox(PETSC_COMM_SELF, "body", s->type ? s->type : s->dim == 3 ? MESH_HEX8 : MESH_QUAD4, zero, s->size, n, &s->mesh));
  for (PetscInt k = 0; k < 3; k++) to[k] = s->start[k][1] > 0 ? s->start[k][1] : PETSC_MAX_REAL;
  PetscCall(AddGroup(s, "seed", from, to));
  if (s->zone[0][1] > 0) {
    const PetscReal a[3] = {s->zone[0][0], s->zone[1][0], s->zone[2][0]}, b[3] = {s->zone[0][1], s->zone[1][1], s->zone[2][1]};

    PetscCall(AddGroup(s, "zone", a, b));
    s->options.group = "zone";
  }
  PetscCall(CouplingSwitchCreate(PETSC_COMM_SELF, &s->mesh, "seed", s->width, &s->options, &s->sw));
  PetscCall(CouplingSwitchGetRegion(s->sw, &region));
  PetscCall(DemBodyCreateFromMesh(region, "", 1, &s->body));
  for (PetscInt k = 0; k < s->dim; k++) {
    low[k] = PETSC_MAX_REAL;
    for (PetscInt i = 0; i < region->n_nodes; i++) {
      low[k]  = PetscMin(low[k], region->x[3 * i + k]);
      high[k] = PetscMax(high[k], region->x[3 * i + k]);
    }
    m[k] = (PetscInt)((high[k] - low[k]) / d + 0.5);
  }
  s->packing.n = m[0] * m[1] * m[2];
  PetscCall(PetscCalloc1(3 * s->packing.n, &s->packing.x));
  PetscCall(PetscMalloc1(s->packing.n, &s->packing.r));
  for (PetscInt k = 0; k < s->packing.n; k++) { /* a jittered lattice: cells as random as a packing's */
    const PetscInt at[3] = {k % m[0], k / m[0] % m[1], k / (m[0] * m[1])};

    for (PetscInt i = 0; i < s->dim; i++) s->packing.x[3 * k + i] = low[i] + (at[i] + 0.5 + 0.6 * (Random(&seed) - 0.5)) * (high[i] - low[i]) / m[i];
    s->packing.r[k] = 0.3 * d * (1 + 0.3 * (2 * Random(&seed) - 1));
  }
  PetscCall(DemCellsCreate(&s->body, &s->packing, &s->cells));
  if (s->spoil) PetscCall(s->spoil(s));
  PetscCall(CouplingSwitchSetBody(s->sw, &s->body, &s->packing, &s->cells, &s->material, &s->strength, s->dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SwitchedBegin(Switched *s)
{
  CouplingOptions options = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = s->substeps};

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(options.stress, s->stress, 6));
  PetscCall(CouplingSwitchSetUp(s->sw, &options, Make, s));
  PetscCall(CouplingSwitchGetStepper(s->sw, &s->stepper));
  PetscCall(s->stepper.stable_step(s->sw, &s->dt));
  s->dt *= 0.9;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SwitchedSteps(Switched *s, PetscInt *k, PetscInt n)
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i++, (*k)++) PetscCall(s->stepper.step(s->sw, *k * s->dt, s->dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SwitchedConvert(Switched *s, const PetscReal low[3], const PetscReal high[3])
{
  PetscInt *cell, n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->mesh.n_cells, &cell));
  for (PetscInt c = 0; c < s->mesh.n_cells; c++) {
    PetscReal x[3];
    PetscBool inside = PETSC_TRUE;

    if (MeshCellDim(s->mesh.type[c]) != s->dim) continue;
    Centroid(&s->mesh, c, x);
    for (PetscInt d = 0; d < s->dim; d++) inside = (PetscBool)(inside && x[d] > low[d] && x[d] < high[d]);
    if (inside) cell[n++] = c;
  }
  PetscCall(CouplingSwitchConvert(s->sw, n, cell, s->dt));
  PetscCall(PetscFree(cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SwitchedDestroy(Switched *s)
{
  PetscFunctionBegin;
  PetscCall(CouplingSwitchDestroy(&s->sw));
  PetscCall(DemCellsDestroy(&s->cells));
  PetscCall(DemPackingDestroy(&s->packing));
  PetscCall(DemBodyDestroy(&s->body));
  PetscCall(MeshDestroy(&s->mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SwitchedTotal(const Ledger *ledger)
{
  PetscReal sum = 0;

  for (PetscInt t = 0; t < LEDGER_WORK; t++) sum += ledger->energy[t];
  return sum;
}

PetscErrorCode SwitchedMomentum(Switched *s, PetscReal P[3], PetscReal L[3], PetscReal *scale)
{
  FemModel fem;
  DemModel dem;
  FemState fs;
  DemState ds;

  PetscFunctionBegin;
  PetscCall(CouplingSwitchGetSides(s->sw, NULL, &fem, &dem, NULL));
  PetscCall(FemModelGetState(fem, &fs));
  PetscCall(DemModelGetState(dem, &ds));
  *scale = 0;
  for (PetscInt d = 0; d < 3; d++) P[d] = L[d] = 0;
  for (PetscInt i = 0; i < fs.n_nodes; i++) {
    PetscReal x[3] = {0}, p[3] = {0};

    for (PetscInt d = 0; d < s->dim; d++) {
      x[d] = fs.x[i * s->dim + d];
      p[d] = fs.mass[i] * fs.v[i * s->dim + d];
      P[d] += p[d];
      *scale += PetscAbsReal(p[d]);
    }
    for (PetscInt d = 0; d < 3; d++) L[d] += x[(d + 1) % 3] * p[(d + 2) % 3] - x[(d + 2) % 3] * p[(d + 1) % 3];
  }
  for (PetscInt i = 0; i < ds.n; i++) {
    PetscReal x[3] = {0}, p[3] = {0};

    for (PetscInt d = 0; d < s->dim; d++) {
      x[d] = ds.x0[d * ds.n + i];
      p[d] = ds.mass[i] * ds.v[d * ds.n + i];
      P[d] += p[d];
      *scale += PetscAbsReal(p[d]);
    }
    for (PetscInt d = 0; d < 3; d++) L[d] += x[(d + 1) % 3] * p[(d + 2) % 3] - x[(d + 2) % 3] * p[(d + 1) % 3];
    if (s->dim == 2) L[2] += ds.inertia[i] * ds.spin[i];
    else
      for (PetscInt d = 0; d < 3; d++) L[d] += ds.inertia[i] * ds.spin[d * ds.n + i];
  }
  PetscCall(FemModelRestoreState(fem, &fs));
  PetscCall(DemModelRestoreState(dem, &ds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SwitchedFlying(Switched *s, FemModel fem, DemModel dem)
{
  PetscFunctionBegin;
  PetscCall(FemModelSetInitialVelocity(fem, s->velocity));
  PetscCall(DemModelSetInitialVelocity(dem, s->velocity));
  PetscFunctionReturn(PETSC_SUCCESS);
}
