#include "coupled.h"
#include "check.h"
#include "fem_case.h"
#include <petsctime.h>

static PetscReal Random(uint64_t *state)
{
  uint64_t z = (*state += 0x9e3779b97f4a7c15ULL);

  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  z ^= z >> 31;
  return (PetscReal)(z >> 11) / 9007199254740992.0;
}

/* A group "node <number in the mesh>" of each node that is chosen. */
static PetscErrorCode NameNodes(Mesh *mesh, CoupledNodes chosen)
{
  PetscInt n = 0, *node;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(mesh->n_nodes, &node));
  for (PetscInt i = 0; i < mesh->n_nodes; i++)
    if (chosen(mesh->x + 3 * i)) node[n++] = i;
  PetscCall(CaseAddNodeGroups(mesh, n, node));
  PetscCall(PetscFree(node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* columns: one random spacing along x, the same in every row of equal cells, so that with nu = 0 each row is the same chain. */
static PetscErrorCode Create(MeshCellType type, const PetscReal size[3], PetscReal h, PetscReal from, PetscReal to, PetscReal ratio, PetscInt width, PetscReal nu, uint64_t seed, PetscBool columns, CoupledNodes nodes, const CouplingOptions *options, Coupled *c)
{
  const PetscReal zero[3] = {0, 0, 0}, d = h / ratio;
  const PetscInt  dim = MeshCellDim(type);
  PetscInt        n[3] = {1, 1, 1}, m[3] = {1, 1, 1};
  MeshGroup      *group;
  PetscReal       low[3] = {0}, high[3] = {0};

  PetscFunctionBegin;
  PetscCall(PetscMemzero(c, sizeof(*c)));
  for (PetscInt k = 0; k < dim; k++) n[k] = (PetscInt)(size[k] / h + 0.5);
  PetscCall(MeshCreateBox(PETSC_COMM_SELF, "body", type, zero, size, n, &c->mesh));
  if (nodes) PetscCall(NameNodes(&c->mesh, nodes));
  /* one more group: the cells that become particles */
  PetscCall(PetscMalloc1(c->mesh.n_groups + 1, &group));
  PetscCall(PetscArraycpy(group, c->mesh.group, c->mesh.n_groups));
  PetscCall(PetscFree(c->mesh.group));
  c->mesh.group = group;
  group         = &c->mesh.group[c->mesh.n_groups++];
  PetscCall(PetscMemzero(group, sizeof(*group)));
  PetscCall(PetscStrncpy(group->name, "grains", sizeof(group->name)));
  group->dim = dim;
  PetscCall(PetscMalloc1(c->mesh.n_cells, &group->cell));
  for (PetscInt k = 0; k < c->mesh.n_cells; k++) {
    PetscReal x = 0;

    if (MeshCellDim(c->mesh.type[k]) != dim) continue;
    for (PetscInt a = c->mesh.start[k]; a < c->mesh.start[k + 1]; a++) x += c->mesh.x[3 * c->mesh.node[a]] / (c->mesh.start[k + 1] - c->mesh.start[k]);
    if (x > from && x < to) group->cell[group->n_cells++] = k;
  }
  PetscCall(CouplingSplitCreate(&c->mesh, "grains", width, &c->split));

  PetscCall(DemBodyCreateFromMesh(&c->split.dem, "", 1, &c->body));
  for (PetscInt k = 0; k < dim; k++) {
    low[k] = PETSC_MAX_REAL;
    for (PetscInt i = 0; i < c->split.dem.n_nodes; i++) {
      low[k]  = PetscMin(low[k], c->split.dem.x[3 * i + k]);
      high[k] = PetscMax(high[k], c->split.dem.x[3 * i + k]);
    }
    m[k] = (PetscInt)((high[k] - low[k]) / d + 0.5);
  }
  c->packing.n = m[0] * m[1] * m[2];
  PetscCall(PetscCalloc1(3 * c->packing.n, &c->packing.x));
  PetscCall(PetscMalloc1(c->packing.n, &c->packing.r));
  for (PetscInt k = 0; k < c->packing.n; k++) { /* a jittered lattice: cells as random as a packing's */
    const PetscInt at[3] = {k % m[0], k / m[0] % m[1], k / (m[0] * m[1])};

    for (PetscInt i = 0; i < dim; i++) c->packing.x[3 * k + i] = low[i] + (at[i] + 0.5 + 0.6 * (Random(&seed) - 0.5)) * (high[i] - low[i]) / m[i];
    c->packing.r[k] = 0.3 * d * (1 + 0.3 * (2 * Random(&seed) - 1));
    if (!columns) continue;
    for (PetscInt i = 0; i < dim; i++) c->packing.x[3 * k + i] = k >= m[0] && i == 0 ? c->packing.x[3 * at[0]] : low[i] + (at[i] + 0.5 + (i == 0 ? 0.6 * (Random(&seed) - 0.5) : 0)) * (high[i] - low[i]) / m[i];
    c->packing.r[k] = 0.3 * d;
  }
  PetscCall(DemCellsCreate(&c->body, &c->packing, &c->cells));

  c->material = (FemMaterial){.density = 1, .young = 1, .poisson = nu};
  {
    const DemMaterial material = {.density = 1, .young = 1, .poisson = nu};

    PetscCall(FemModelCreate(PETSC_COMM_SELF, &c->fem));
    PetscCall(FemModelSetKind(c->fem, dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, 1));
    PetscCall(FemModelSetMethod(c->fem, FEM_EXPLICIT));
    PetscCall(FemModelSetMesh(c->fem, &c->split.fem));
    PetscCall(FemModelAddMaterial(c->fem, "", &c->material));
    PetscCall(DemModelCreate(PETSC_COMM_SELF, &c->dem));
    PetscCall(DemModelSetKind(c->dem, dim == 3 ? DEM_SOLID : DEM_PLANE_STRAIN));
    PetscCall(DemModelSetMaterial(c->dem, &material));
    PetscCall(DemModelSetBody(c->dem, &c->body, &c->packing, &c->cells));
  }
  PetscCall(CouplingModelCreate(PETSC_COMM_SELF, &c->model));
  PetscCall(CouplingModelSetSplit(c->model, &c->split, options));
  PetscCall(CouplingModelSetSides(c->model, c->fem, c->dem, &c->packing, &c->cells, &c->material, dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CoupledCreate(PetscInt dim, const PetscReal size[3], PetscReal h, PetscReal from, PetscReal to, PetscReal ratio, PetscInt width, PetscReal nu, uint64_t seed, const CouplingOptions *options, Coupled *c)
{
  PetscFunctionBegin;
  PetscCall(Create(dim == 3 ? MESH_HEX8 : MESH_QUAD4, size, h, from, to, ratio, width, nu, seed, PETSC_FALSE, NULL, options, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CoupledCreateOf(MeshCellType type, const PetscReal size[3], PetscReal h, PetscReal from, PetscReal to, PetscReal ratio, PetscInt width, PetscReal nu, uint64_t seed, const CouplingOptions *options, Coupled *c)
{
  PetscFunctionBegin;
  PetscCall(Create(type, size, h, from, to, ratio, width, nu, seed, PETSC_FALSE, NULL, options, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CoupledCreateNodes(MeshCellType type, const PetscReal size[3], PetscReal h, PetscReal from, PetscReal to, PetscReal ratio, PetscInt width, PetscReal nu, uint64_t seed, CoupledNodes nodes, const CouplingOptions *options, Coupled *c)
{
  PetscFunctionBegin;
  PetscCall(Create(type, size, h, from, to, ratio, width, nu, seed, PETSC_FALSE, nodes, options, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CoupledCreateChain(PetscReal length, PetscReal from, PetscReal to, PetscReal ratio, PetscInt width, uint64_t seed, const CouplingOptions *options, Coupled *c)
{
  const PetscReal size[3] = {length, 1, 1};

  PetscFunctionBegin;
  PetscCall(Create(MESH_QUAD4, size, 1, from, to, ratio, width, 0, seed, PETSC_TRUE, NULL, options, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CoupledDestroy(Coupled *c)
{
  PetscFunctionBegin;
  PetscCall(CouplingModelDestroy(&c->model));
  PetscCall(FemModelDestroy(&c->fem));
  PetscCall(DemModelDestroy(&c->dem));
  PetscCall(DemCellsDestroy(&c->cells));
  PetscCall(DemPackingDestroy(&c->packing));
  PetscCall(DemBodyDestroy(&c->body));
  PetscCall(CouplingSplitDestroy(&c->split));
  PetscCall(MeshDestroy(&c->mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CoupledRunPulled(Coupled *c, PetscInt from, PetscInt to, PetscBool look, const char *load, const char *save, PetscInt room, PetscReal *u, PetscInt *n, Ledger *ledger)
{
  const PetscReal pull[3] = {1, 0, 0}, gravity[3] = {0, -1e-6, 0}, t[2] = {0, 3}, v[2] = {0, 1e-6};
  Stepper         stepper;
  Table           ramp, none;
  FemState        fs;
  DemState        ds;
  Checkpoint      checkpoint;
  PetscReal       dt;

  PetscFunctionBegin;
  PetscCall(TableCreate(2, t, v, &ramp));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(FemModelFix(c->fem, "xmin", 0, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelFix(c->fem, "ymin", 1, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(c->fem, "xmax", pull, &ramp));
  PetscCall(FemModelSetGravity(c->fem, gravity));
  PetscCall(DemModelSetGravity(c->dem, gravity));
  PetscCall(CouplingModelSetUp(c->model));
  PetscCall(CouplingModelGetStepper(c->model, &stepper));
  PetscCall(stepper.stable_step(c->model, &dt));
  dt *= 0.9;
  if (load) {
    PetscCall(CheckpointOpen(PETSC_COMM_SELF, load, &checkpoint));
    PetscCall(stepper.load(c->model, checkpoint));
    PetscCall(CheckpointAbandon(&checkpoint));
  }
  for (PetscInt k = from; k < to; k++) {
    PetscCall(stepper.step(c->model, k * dt, dt));
    if (look) PetscCall(stepper.energy(c->model, ledger));
  }
  if (save) {
    PetscCall(CheckpointCreate(PETSC_COMM_SELF, save, &checkpoint));
    PetscCall(stepper.save(c->model, checkpoint));
    PetscCall(CheckpointClose(&checkpoint));
  }
  PetscCall(stepper.energy(c->model, ledger));
  PetscCall(FemModelGetState(c->fem, &fs));
  PetscCall(DemModelGetState(c->dem, &ds));
  *n = fs.n_nodes * 2 + 3 * ds.n;
  PetscCheck(*n <= room, PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ, "%" PetscInt_FMT " displacements, room for %" PetscInt_FMT, *n, room);
  PetscCall(PetscArraycpy(u, fs.u, fs.n_nodes * 2));
  PetscCall(PetscArraycpy(u + fs.n_nodes * 2, ds.u, 3 * ds.n));
  PetscCall(FemModelRestoreState(c->fem, &fs));
  PetscCall(DemModelRestoreState(c->dem, &ds));
  PetscCall(TableDestroy(&ramp));
  PetscCall(TableDestroy(&none));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CoupledRest(const CouplingOptions *options, PetscInt steps, PetscReal *off, PetscReal *drift, PetscReal *step, PetscReal *seconds)
{
  const PetscReal size[3] = {10, 3, 3}, pull[3] = {1, 0, 0}, stress = 1e-9, nu = 0.2, strain = stress * (1 - nu * nu);
  Coupled         c;
  Stepper         stepper;
  Table           load, none;
  FemState        fs;
  PetscReal      *before;
  PetscLogDouble  begin, end;

  PetscFunctionBegin;
  PetscCall(CoupledCreate(2, size, 1, 4, 6, 4, 2, nu, 41, options, &c));
  PetscCall(TableCreateConstant(stress, &load));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(FemModelFix(c.fem, "xmin", 0, FEM_DISPLACEMENT, &none));
  PetscCall(FemModelAddTraction(c.fem, "xmax", pull, &load));
  PetscCall(FemModelSetStartGiven(c.fem, PETSC_TRUE));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(CouplingModelGetStepper(c.model, &stepper));
  PetscCall(stepper.stable_step(c.model, step));
  PetscCall(FemModelGetState(c.fem, &fs));
  PetscCall(PetscMalloc1(2 * fs.n_nodes, &before));
  PetscCall(PetscArraycpy(before, fs.u, 2 * fs.n_nodes));
  *off = *drift = 0;
  for (PetscInt i = 0; i < fs.n_nodes; i++) *off = PetscMax(*off, PetscAbsReal(fs.u[2 * i] - strain * fs.x[2 * i]) / strain);
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(PetscTime(&begin));
  for (PetscInt k = 0; k < steps; k++) PetscCall(stepper.step(c.model, k * 0.9 * *step, 0.9 * *step));
  PetscCall(PetscTime(&end));
  if (seconds) *seconds = end - begin;
  PetscCall(FemModelGetState(c.fem, &fs));
  for (PetscInt i = 0; i < 2 * fs.n_nodes; i += 2) *drift = PetscMax(*drift, PetscAbsReal(fs.u[i] - before[i]) / (strain * size[0]));
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(PetscFree(before));
  PetscCall(TableDestroy(&load));
  PetscCall(TableDestroy(&none));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
