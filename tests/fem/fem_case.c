#include "fem_case.h"

static PetscReal Noise(PetscInt number)
{
  unsigned long long z = ((unsigned long long)number + 1) * 0x9E3779B97F4A7C15ull;

  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  z ^= z >> 31;
  return (PetscReal)(z >> 11) / 9007199254740992.0 * 2 - 1;
}

PetscErrorCode CaseStraighten(Mesh *mesh)
{
  PetscFunctionBegin;
  for (PetscInt c = 0; c < mesh->n_cells; c++) {
    const PetscInt *node = &mesh->node[mesh->start[c]];

    for (PetscInt a = MeshCellCorners(mesh->type[c]); a < MeshCellNodes(mesh->type[c]); a++) {
      PetscInt       corner[8];
      const PetscInt n = MeshCellParents(mesh->type[c], a, corner);

      for (PetscInt d = 0; d < 3; d++) {
        mesh->x[3 * node[a] + d] = 0;
        for (PetscInt k = 0; k < n; k++) mesh->x[3 * node[a] + d] += mesh->x[3 * node[corner[k]] + d] / n;
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CaseBox(MPI_Comm comm, MeshCellType type, const PetscReal length[3], const PetscInt n[3], PetscReal distort, Mesh *mesh)
{
  const PetscReal origin[3] = {0, 0, 0};
  const PetscInt  dim       = MeshCellDim(type);

  PetscFunctionBegin;
  PetscCall(MeshCreateBox(comm, "body", type, origin, length, n, mesh));
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    PetscReal *x = &mesh->x[3 * i];

    if (distort == 0) break;
    for (PetscInt d = 0; d < dim; d++)
      if (x[d] > 1e-9 * length[d] && x[d] < length[d] * (1 - 1e-9)) x[d] += distort * Noise(3 * i + d) * length[d] / n[d]; /* nodes of a side slide in it */
  }
  if (distort > 0) PetscCall(CaseStraighten(mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for more cells of `per` nodes and groups at the end of a mesh. */
static PetscErrorCode Extend(Mesh *m, PetscInt cells, PetscInt per, PetscInt groups)
{
  MeshCellType *type;
  PetscInt     *id, *start;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(m->n_cells + cells, &type, m->n_cells + cells, &id, m->n_cells + cells + 1, &start));
  PetscCall(PetscArraycpy(type, m->type, m->n_cells));
  PetscCall(PetscArraycpy(id, m->cell_id, m->n_cells));
  PetscCall(PetscArraycpy(start, m->start, m->n_cells + 1));
  PetscCall(PetscFree3(m->type, m->cell_id, m->start));
  m->type    = type;
  m->cell_id = id;
  m->start   = start;
  PetscCall(PetscRealloc(sizeof(PetscInt) * (m->start[m->n_cells] + cells * per), &m->node));
  PetscCall(PetscRealloc(sizeof(MeshGroup) * (m->n_groups + groups), &m->group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One cell in a group of its own; Extend made the room. */
static PetscErrorCode Append(Mesh *m, MeshCellType type, const PetscInt node[], PetscInt dim, const char *name)
{
  const PetscInt c = m->n_cells++, n = MeshCellNodes(type);
  MeshGroup     *g = &m->group[m->n_groups++];

  PetscFunctionBegin;
  m->type[c]      = type;
  m->cell_id[c]   = c + 1;
  m->start[c + 1] = m->start[c] + n;
  for (PetscInt a = 0; a < n; a++) m->node[m->start[c] + a] = node[a];
  PetscCall(PetscMemzero(g, sizeof(*g)));
  PetscCall(PetscStrncpy(g->name, name, sizeof(g->name)));
  g->dim     = dim;
  g->n_cells = 1;
  PetscCall(PetscMalloc1(1, &g->cell));
  g->cell[0] = c;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CaseAddNodeGroups(Mesh *mesh, PetscInt n, const PetscInt node[])
{
  PetscFunctionBegin;
  PetscCall(Extend(mesh, n, 1, n));
  for (PetscInt k = 0; k < n; k++) {
    char name[64];

    PetscCall(BaseFormat(name, "node %d", (int)node[k]));
    PetscCall(Append(mesh, MESH_POINT, &node[k], 0, name));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CaseAddLine(Mesh *mesh, const char *name, const PetscReal a[3], const PetscReal b[3])
{
  PetscReal *along, length = 0;
  PetscInt  *node, n = 0;
  MeshGroup *g;

  PetscFunctionBegin;
  for (PetscInt d = 0; d < 3; d++) length += PetscSqr(b[d] - a[d]);
  PetscCall(PetscMalloc2(mesh->n_nodes, &along, mesh->n_nodes, &node));
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    PetscReal s = 0, off = 0;

    for (PetscInt d = 0; d < 3; d++) s += (mesh->x[3 * i + d] - a[d]) * (b[d] - a[d]) / length;
    for (PetscInt d = 0; d < 3; d++) off += PetscSqr(mesh->x[3 * i + d] - a[d] - s * (b[d] - a[d]));
    if (off > 1e-16 * length || s < -1e-9 || s > 1 + 1e-9) continue;
    along[n]  = s;
    node[n++] = i;
  }
  PetscCall(PetscSortRealWithArrayInt(n, along, node));
  PetscCall(Extend(mesh, n - 1, 2, n - 1));
  for (PetscInt k = 0; k + 1 < n; k++) PetscCall(Append(mesh, MESH_LINE2, &node[k], 1, name));
  g = &mesh->group[mesh->n_groups - (n - 1)]; /* one group of all */
  PetscCall(PetscRealloc(sizeof(PetscInt) * (n - 1), &g->cell));
  for (PetscInt k = 1; k + 1 < n; k++) {
    g->cell[k] = mesh->group[mesh->n_groups - (n - 1) + k].cell[0];
    PetscCall(PetscFree(mesh->group[mesh->n_groups - (n - 1) + k].cell));
  }
  g->n_cells = n - 1;
  mesh->n_groups -= n - 2;
  PetscCall(PetscFree2(along, node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CaseSplitGroup(Mesh *mesh, const char *group, const char *prefix, PetscInt *n)
{
  const MeshGroup *from;
  MeshGroup        copy;

  PetscFunctionBegin;
  PetscCall(MeshFindGroup(mesh, group, &from));
  copy = *from;
  *n   = copy.n_cells;
  PetscCall(Extend(mesh, copy.n_cells, 9, copy.n_cells));
  for (PetscInt k = 0; k < copy.n_cells; k++) {
    char     name[64];
    PetscInt node[9] = {0}, c = copy.cell[k];

    for (PetscInt a = mesh->start[c]; a < mesh->start[c + 1]; a++) node[a - mesh->start[c]] = mesh->node[a];
    PetscCall(BaseFormat(name, "%s %d", prefix, (int)k));
    PetscCall(Append(mesh, mesh->type[c], node, copy.dim, name));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt CaseSurface(const Mesh *mesh, const PetscReal length[3], PetscInt side, PetscInt list[])
{
  PetscInt n = 0;

  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    PetscBool on = PETSC_FALSE;

    for (PetscInt d = 0; d < mesh->dim; d++)
      for (PetscInt s = 0; s < 2; s++)
        if (PetscAbsReal(mesh->x[3 * i + d] - s * length[d]) < 1e-9 * length[d] && (side < 0 || side == 2 * d + s)) on = PETSC_TRUE;
    if (on) list[n++] = i;
  }
  return n;
}

PetscErrorCode CaseFixNodes(FemModel model, PetscInt dim, PetscInt n, const PetscInt node[], const PetscReal x[], CaseField field)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) {
    char      name[64];
    PetscReal u[3] = {0, 0, 0};

    PetscCall(BaseFormat(name, "node %d", (int)node[k]));
    field(&x[3 * node[k]], u);
    for (PetscInt d = 0; d < dim; d++) PetscCall(CaseFix(model, name, d, u[d]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CaseModel(MPI_Comm comm, const Mesh *mesh, FemKind kind, FemMethod method, PetscReal thickness, const FemMaterial *material, FemModel *model)
{
  PetscFunctionBegin;
  PetscCall(FemModelCreate(comm, model));
  PetscCall(FemModelSetKind(*model, kind, thickness));
  PetscCall(FemModelSetMethod(*model, method));
  PetscCall(FemModelSetMesh(*model, mesh));
  PetscCall(FemModelAddMaterial(*model, "", material));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FixAs(FemModel model, const char *group, PetscInt component, FemMotion motion, PetscReal value)
{
  Table table;

  PetscFunctionBegin;
  PetscCall(TableCreateConstant(value, &table));
  PetscCall(FemModelFix(model, group, component, motion, &table));
  PetscCall(TableDestroy(&table));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CaseFix(FemModel model, const char *group, PetscInt component, PetscReal value)
{
  return FixAs(model, group, component, FEM_DISPLACEMENT, value);
}

PetscErrorCode CaseFixVelocity(FemModel model, const char *group, PetscInt component, PetscReal value)
{
  return FixAs(model, group, component, FEM_VELOCITY, value);
}

PetscErrorCode CaseTraction(FemModel model, const char *group, PetscReal x, PetscReal y, PetscReal z)
{
  const PetscReal direction[3] = {x, y, z};
  Table           one;

  PetscFunctionBegin;
  PetscCall(TableCreateConstant(1, &one));
  PetscCall(FemModelAddTraction(model, group, direction, &one));
  PetscCall(TableDestroy(&one));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CaseSolve(FemModel model)
{
  Stepper s;

  PetscFunctionBegin;
  PetscCall(FemModelSetUp(model));
  PetscCall(FemModelGetStepper(model, &s));
  PetscCall(s.step(s.ctx, 0, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal CaseHistory(FemModel model, const char *name)
{
  Stepper   s;
  PetscReal value = NAN;

  if (FemModelGetStepper(model, &s)) return NAN;
  for (PetscInt i = 0; i < s.n_history; i++)
    if (!strcmp(s.history_name[i], name) && s.history(s.ctx, i, &value)) return NAN;
  return value;
}

PetscErrorCode CaseLedger(FemModel model, Ledger *ledger)
{
  Stepper s;

  PetscFunctionBegin;
  PetscCall(FemModelGetStepper(model, &s));
  PetscCall(s.energy(s.ctx, ledger));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt CaseNodeAt(const Mesh *mesh, PetscReal x, PetscReal y, PetscReal z)
{
  PetscInt  best = 0;
  PetscReal least = PETSC_MAX_REAL;

  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    const PetscReal dx = mesh->x[3 * i] - x, dy = mesh->x[3 * i + 1] - y, dz = mesh->x[3 * i + 2] - z, d = dx * dx + dy * dy + dz * dz;

    if (d < least) {
      least = d;
      best  = i;
    }
  }
  return best;
}
