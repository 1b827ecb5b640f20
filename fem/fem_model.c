/* fem_model.c - a FemModel's life: create, say what it is made of and what acts on it, set up, destroy. */
#include "fem_impl.h"

PetscLogEvent FEM_SetUpMesh, FEM_Assemble, FEM_Force, FEM_Solve, FEM_Eigen, FEM_Recover;

static PetscErrorCode RegisterEvents(void)
{
  static PetscBool done = PETSC_FALSE;
  PetscClassId     id;

  PetscFunctionBegin;
  if (done) PetscFunctionReturn(PETSC_SUCCESS);
  done = PETSC_TRUE;
  PetscCall(PetscClassIdRegister("FemModel", &id));
  PetscCall(PetscLogEventRegister("FEM_SetUpMesh", id, &FEM_SetUpMesh));
  PetscCall(PetscLogEventRegister("FEM_Assemble", id, &FEM_Assemble));
  PetscCall(PetscLogEventRegister("FEM_Force", id, &FEM_Force));
  PetscCall(PetscLogEventRegister("FEM_Solve", id, &FEM_Solve));
  PetscCall(PetscLogEventRegister("FEM_Eigen", id, &FEM_Eigen));
  PetscCall(PetscLogEventRegister("FEM_Recover", id, &FEM_Recover));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemAgree(MPI_Comm comm, const char *words)
{
  char text[BASE_LINE] = "";

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(text, words, sizeof(text)));
  PetscCallMPI(MPI_Bcast(text, BASE_LINE, MPI_CHAR, 0, comm));
  BaseCheckInput(!text[0], comm, "%s", text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelCreate(MPI_Comm comm, FemModel *model)
{
  FemModel m;

  PetscFunctionBegin;
  PetscCall(RegisterEvents());
  PetscCall(PetscNew(&m));
  m->comm = comm;
  PetscCallMPI(MPI_Comm_rank(comm, &m->rank));
  PetscCallMPI(MPI_Comm_size(comm, &m->size));
  PetscCall(PetscStrncpy(m->name, "fem", sizeof(m->name)));
  m->kind      = FEM_SOLID;
  m->method    = FEM_STATIC;
  m->operator  = FEM_ROWS;
  m->thickness = 1;
  m->threads   = 1;
  m->implicit.rho_inf = -1;
  *model       = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Setters come before set-up; those that name groups come after the mesh. */
static PetscErrorCode CheckOpen(FemModel model, PetscBool needs_mesh)
{
  PetscFunctionBegin;
  PetscCheck(model, PETSC_COMM_SELF, PETSC_ERR_ARG_NULL, "FemModel is NULL; call FemModelCreate() first");
  PetscCheck(!model->ready, model->comm, PETSC_ERR_ORDER, "The FemModel is set up; what it is made of cannot change any more");
  PetscCheck(!needs_mesh || model->has_mesh, model->comm, PETSC_ERR_ORDER, "Call FemModelSetMesh() before groups are named");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemFindGroup(FemModel model, const char *name, PetscInt *found)
{
  const char **names, *near;
  PetscBool    same;
  char         hint[256] = "the mesh has no named groups";

  PetscFunctionBegin;
  *found = -1;
  for (PetscInt g = 0; g < model->n_groups; g++) {
    PetscCall(PetscStrcmp(model->group[g].name, name, &same));
    if (same) *found = g;
  }
  if (*found >= 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(model->n_groups, &names));
  for (PetscInt g = 0; g < model->n_groups; g++) names[g] = model->group[g].name;
  near = BaseNearest(name, model->n_groups, names);
  if (near) PetscCall(BaseFormat(hint, "did you mean '%s'?", near));
  else if (model->n_groups) PetscCall(BaseFormat(hint, "it has '%s'%s%s%s", names[0], model->n_groups > 1 ? ", '" : "", model->n_groups > 1 ? names[1] : "", model->n_groups > 2 ? "' and others" : model->n_groups > 1 ? "'" : ""));
  PetscCall(PetscFree(names));
  BaseCheckInput(*found >= 0, model->comm, "%s: no group is called '%s'; %s", model->source, name, hint);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetName(FemModel model, const char *name)
{
  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_FALSE));
  PetscCall(PetscStrncpy(model->name, name, sizeof(model->name)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetKind(FemModel model, FemKind kind, PetscReal thickness)
{
  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_FALSE));
  BaseCheckInput(kind == FEM_SOLID || (thickness > 0 && !PetscIsInfOrNanReal(thickness)), model->comm, "A thickness of %g m must be positive", (double)thickness);
  model->kind      = kind;
  model->thickness = kind == FEM_SOLID ? 1 : thickness;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetMethod(FemModel model, FemMethod method)
{
  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_FALSE));
  model->method = method;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetElement(FemModel model, FemElement element)
{
  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_FALSE));
  model->element = element;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelAddMaterial(FemModel model, const char *group, const FemMaterial *material)
{
  FemRegion region = {-1, *material};

  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_TRUE));
  PetscCall(FemCheckMaterial(model, &region.material));
  if (group[0]) {
    PetscCall(FemFindGroup(model, group, &region.group));
    BaseCheckInput(model->group[region.group].dim == model->dim, model->comm, "%s: group '%s' has dimension %d; a material fills a group of dimension %d", model->source, group, (int)model->group[region.group].dim, (int)model->dim);
  }
  PetscCall(PetscRealloc(sizeof(FemRegion) * (model->n_regions + 1), &model->region));
  model->region[model->n_regions++] = region;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelFix(FemModel model, const char *group, PetscInt component, FemMotion motion, const Table *table)
{
  FemFix fix = {-1, component, motion, {0}};

  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_TRUE));
  BaseCheckInput(component >= 0 && component < model->dim, model->comm, "Group '%s': a body of dimension %d has no component %d to fix", group, (int)model->dim, (int)component);
  PetscCall(FemFindGroup(model, group, &fix.group));
  BaseCheckInput(model->group[fix.group].n_nodes_global > 0, model->comm, "%s: group '%s' touches no node of the body, so there is nothing to fix", model->source, group);
  PetscCall(TableCopy(table, &fix.table));
  PetscCall(PetscRealloc(sizeof(FemFix) * (model->n_fixes + 1), &model->fix));
  model->fix[model->n_fixes++] = fix;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddLoad(FemModel model, const char *name, FemLoadKind kind, const PetscReal direction[3], const Table *table)
{
  FemLoad         load = {.kind = kind};
  const FemGroup *group;
  const char     *word = kind == FEM_TRACTION ? "traction" : kind == FEM_PRESSURE ? "pressure" : kind == FEM_FORCE ? "force" : "load per length";

  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_TRUE));
  PetscCall(FemFindGroup(model, name, &load.group));
  group = &model->group[load.group];
  if (kind == FEM_FORCE)
    BaseCheckInput(group->dim < model->dim, model->comm, "%s: group '%s' is a part of the body itself; a force acts on points, lines or sides of it, gravity on its mass", model->source, name);
  else if (kind == FEM_LINE_LOAD)
    BaseCheckInput(group->dim == 1, model->comm, "%s: group '%s' has dimension %d; a %s acts on a group of dimension 1", model->source, name, (int)group->dim, word);
  else BaseCheckInput(group->dim == model->dim - 1, model->comm, "%s: group '%s' has dimension %d; a %s acts on a group of dimension %d", model->source, name, (int)group->dim, word, (int)model->dim - 1);
  BaseCheckInput(group->n_nodes_global > 0, model->comm, "%s: group '%s' touches no node of the body, so a %s has nothing to act on", model->source, name, word);
  BaseCheckInput(!group->loose, model->comm, "%s: %d cells of group '%s' are not a side of any element of the body; a %s cannot act there", model->source, (int)group->loose, name, word);
  BaseCheckInput(kind == FEM_TRACTION || !group->interior, model->comm, "%s: %d cells of group '%s' lie inside the body; a pressure needs a free side", model->source, (int)group->interior, name);
  if (direction) PetscCall(PetscArraycpy(load.direction, direction, 3));
  PetscCall(TableCopy(table, &load.table));
  PetscCall(PetscRealloc(sizeof(FemLoad) * (model->n_loads + 1), &model->load));
  model->load[model->n_loads++] = load;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelAddTraction(FemModel model, const char *group, const PetscReal direction[3], const Table *table)
{
  return AddLoad(model, group, FEM_TRACTION, direction, table);
}

PetscErrorCode FemModelAddPressure(FemModel model, const char *group, const Table *table)
{
  return AddLoad(model, group, FEM_PRESSURE, NULL, table);
}

PetscErrorCode FemModelAddForce(FemModel model, const char *group, const PetscReal direction[3], const Table *table)
{
  return AddLoad(model, group, FEM_FORCE, direction, table);
}

PetscErrorCode FemModelAddLineLoad(FemModel model, const char *group, const PetscReal direction[3], const Table *table)
{
  return AddLoad(model, group, FEM_LINE_LOAD, direction, table);
}

PetscErrorCode FemModelSetGravity(FemModel model, const PetscReal gravity[3])
{
  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_FALSE));
  PetscCall(PetscArraycpy(model->gravity, gravity, 3));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetInitialVelocity(FemModel model, const PetscReal velocity[3])
{
  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_FALSE));
  PetscCall(PetscArraycpy(model->velocity0, velocity, 3));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetDamping(FemModel model, PetscReal alpha)
{
  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_FALSE));
  BaseCheckInput(alpha >= 0 && !PetscIsInfOrNanReal(alpha), model->comm, "Mass-proportional damping %g 1/s must not be negative", (double)alpha);
  model->alpha = alpha;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetStiffnessDamping(FemModel model, PetscReal beta)
{
  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_FALSE));
  BaseCheckInput(beta >= 0 && !PetscIsInfOrNanReal(beta), model->comm, "Stiffness-proportional damping %g s must not be negative", (double)beta);
  model->stiff_damping = beta;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetImplicit(FemModel model, PetscReal rho_inf, PetscBool lumped)
{
  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_FALSE));
  BaseCheckInput(rho_inf <= 1, model->comm, "A spectral radius of %g at high frequency must lie in [0, 1]", (double)rho_inf);
  model->implicit.rho_inf = rho_inf;
  model->implicit.lumped  = lumped;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetPreload(FemModel model, PetscBool preload)
{
  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_FALSE));
  model->preload = preload;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetThreads(FemModel model, PetscInt threads)
{
  PetscFunctionBegin;
  PetscCheck(model, PETSC_COMM_SELF, PETSC_ERR_ARG_NULL, "FemModel is NULL; call FemModelCreate() first");
  BaseCheckInput(threads >= 1, model->comm, "%" PetscInt_FMT " threads; at least 1 is needed", threads);
  model->threads = threads;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetLocalDamping(FemModel model, PetscReal alpha)
{
  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_FALSE));
  BaseCheckInput(alpha >= 0 && alpha < 1, model->comm, "Local damping %.4g must lie in [0, 1)", (double)alpha);
  model->local = alpha;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Axis between the two parts of a group, and the middle of the gap between them: lips face each other along the axis whose
   widest gap between neighbouring nodes is largest, also against the group's extent there (lips may be long). */
static PetscErrorCode FindLips(FemModel model, FemHistory *entry)
{
  const FemGroup *group = &model->group[entry->group];
  const PetscInt  dim = model->dim, n = group->n_nodes;
  PetscReal      *along, best = 0;

  PetscFunctionBegin;
  BaseCheckInput(model->size == 1, model->comm, "An opening is followed on one rank only for now, not %d", (int)model->size);
  BaseCheckInput(n >= 2, model->comm, "%s: group '%s' has %" PetscInt_FMT " nodes; an opening needs two lips", model->source, group->name, n);
  PetscCall(PetscMalloc1(n, &along));
  for (PetscInt d = 0; d < dim; d++) {
    PetscReal gap = 0, middle = 0;

    for (PetscInt i = 0; i < n; i++) along[i] = model->x[group->node[i] * dim + d];
    PetscCall(PetscSortReal(n, along));
    for (PetscInt i = 0; i + 1 < n; i++)
      if (along[i + 1] - along[i] > gap) {
        gap    = along[i + 1] - along[i];
        middle = 0.5 * (along[i + 1] + along[i]);
      }
    if (!(gap > 0) || !(gap * gap / (along[n - 1] - along[0]) > best)) continue;
    best          = gap * gap / (along[n - 1] - along[0]);
    entry->middle = middle;
    for (PetscInt k = 0; k < 3; k++) entry->axis[k] = k == d;
  }
  PetscCall(PetscFree(along));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelAddHistory(FemModel model, const char *quantity, const char *group)
{
  static const char *const names[] = {"reaction", "displacement", "velocity", "opening"}, *const units[] = {"N", "m", "m/s", "m"};
  FemHistory               entry = {.quantity = FEM_HIST_REACTION, .group = -1};
  PetscBool                same;
  PetscInt                 found = -1;

  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_TRUE));
  PetscCall(PetscStrcmp(quantity, "error", &same));
  if (same) {
    PetscCall(PetscRealloc(sizeof(FemHistory) * (model->n_history + 1), &model->history));
    PetscCall(PetscRealloc(sizeof(char *) * (model->n_history + 1), &model->history_name));
    PetscCall(PetscRealloc(sizeof(char *) * (model->n_history + 1), &model->history_unit));
    PetscCall(PetscStrallocpy("error", &model->history_name[model->n_history]));
    model->history_unit[model->n_history] = "-";
    model->history[model->n_history++]    = (FemHistory){.quantity = FEM_HIST_ERROR, .group = -1};
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscStrcmp(quantity, "balance", &same));
  if (same) {
    const PetscInt columns = model->dim == 3 ? 6 : 3;

    PetscCall(PetscRealloc(sizeof(FemHistory) * (model->n_history + columns), &model->history));
    PetscCall(PetscRealloc(sizeof(char *) * (model->n_history + columns), &model->history_name));
    PetscCall(PetscRealloc(sizeof(char *) * (model->n_history + columns), &model->history_unit));
    for (PetscInt k = 0; k < 6; k++) {
      const char *const column[6] = {"balance.x", "balance.y", "balance.z", "balance.about_x", "balance.about_y", "balance.about_z"};

      if (model->dim == 2 && k >= 2 && k <= 4) continue;
      PetscCall(PetscStrallocpy(column[k], &model->history_name[model->n_history]));
      model->history_unit[model->n_history] = k < 3 ? "N" : "N m";
      model->history[model->n_history++]    = (FemHistory){.quantity = FEM_HIST_BALANCE, .group = -1, .component = k};
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt q = 0; q < 4; q++) {
    PetscCall(PetscStrcmp(quantity, names[q], &same));
    if (same) found = q;
  }
  BaseCheckInput(found >= 0, model->comm, "A finite-element group has no history quantity '%s'; it has reaction, displacement, velocity, opening, and the body error", quantity);
  entry.quantity = (FemQuantity)found;
  PetscCall(FemFindGroup(model, group, &entry.group));
  BaseCheckInput(model->group[entry.group].n_nodes_global > 0, model->comm, "%s: group '%s' touches no node of the body, so it has no %s", model->source, group, quantity);
  PetscCall(PetscRealloc(sizeof(FemHistory) * (model->n_history + model->dim + 1), &model->history));
  PetscCall(PetscRealloc(sizeof(char *) * (model->n_history + model->dim + 1), &model->history_name));
  PetscCall(PetscRealloc(sizeof(char *) * (model->n_history + model->dim + 1), &model->history_unit));
  if (entry.quantity == FEM_HIST_OPENING) PetscCall(FindLips(model, &entry));
  for (entry.component = 0; entry.component < (entry.quantity == FEM_HIST_OPENING ? 1 : model->dim); entry.component++) {
    char line[BASE_LINE];

    if (entry.quantity == FEM_HIST_OPENING) PetscCall(BaseFormat(line, "%s(%s)", quantity, group));
    else PetscCall(BaseFormat(line, "%s(%s).%c", quantity, group, "xyz"[entry.component]));
    PetscCall(PetscStrallocpy(line, &model->history_name[model->n_history]));
    model->history_unit[model->n_history] = units[found];
    model->history[model->n_history++]    = entry;
  }
  for (PetscInt k = 0; k < model->n_mirrors; k++) { /* what a plane of symmetry carries, along its outward normal */
    char line[BASE_LINE];

    if (entry.quantity != FEM_HIST_REACTION || model->mirror[k].group != entry.group) continue;
    PetscCall(PetscArraycpy(entry.axis, model->mirror[k].normal, 3));
    entry.quantity = FEM_HIST_NORMAL;
    PetscCall(BaseFormat(line, "%s(%s).normal", quantity, group));
    PetscCall(PetscStrallocpy(line, &model->history_name[model->n_history]));
    model->history_unit[model->n_history] = units[found];
    model->history[model->n_history++]    = entry;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetUp(FemModel model)
{
  PetscFunctionBegin;
  PetscCall(CheckOpen(model, PETSC_TRUE));
  BaseCheckInput((model->kind == FEM_SOLID) == (model->dim == 3), model->comm, "%s: a mesh of dimension %d, but the model is %s", model->source, (int)model->dim, model->kind == FEM_SOLID ? "a solid" : "plane");
  PetscOptionsBegin(model->comm, "fem_", "Finite elements", NULL);
  {
    PetscBool elements = model->operator == FEM_ELEMENTS;

    PetscCall(PetscOptionsBool("-elements", "Forces element by element instead of by assembled rows", NULL, elements, &elements, NULL));
    model->operator = elements ? FEM_ELEMENTS : FEM_ROWS;
  }
  PetscOptionsEnd();
  PetscCall(FemSetUpMaterials(model));
  PetscCall(FemSetUpFixes(model));
  PetscCall(FemSetUpMass(model));
  PetscCall(PetscCalloc5(model->n_loc * model->dim, &model->u, model->n_own * model->dim, &model->v, model->n_own * model->dim, &model->f_int, model->n_own * model->dim, &model->f_app, model->n_own * model->dim, &model->f_ext));
  PetscCall(PetscCalloc2(model->n_own * model->dim, &model->v_next, model->n_own * model->dim, &model->reaction));
  PetscCall(FemSetUpLoads(model));
  PetscCall(FemSetUpPrestress(model));
  BaseCheckInput(model->stiff_damping == 0 || model->method == FEM_IMPLICIT, model->comm, "Stiffness-proportional damping of %g s needs the implicit method: central differences would have to shorten their step to 2/omega (sqrt(1 + x^2) - x), x = beta omega/2; use mass-proportional damping, or the implicit method", (double)model->stiff_damping);
  BaseCheckInput(model->local == 0 || model->method == FEM_EXPLICIT, model->comm, "Local damping needs the explicit method; use viscous damping");
  BaseCheckInput(!model->pre.n || model->method != FEM_MODAL, model->comm, "%s: in-situ stress and temperature do not change the frequencies of a body at small strain; take them out of a modal run", model->source);
  PetscCall(FemCorotateCheck(model));
  PetscCall(FemSetUpAbsorbers(model));
  PetscCall(FemSetUpContact(model));
  if (model->method == FEM_STATIC) PetscCall(FemStaticSetUp(model));
  else if (model->method == FEM_IMPLICIT) PetscCall(FemImplicitSetUp(model));
  else if (model->method == FEM_MODAL) PetscCall(FemModalSetUp(model));
  else PetscCall(FemExplicitSetUp(model));
  PetscCall(FemSetUpStepper(model));
  model->ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetCellWeights(FemModel model, const PetscReal weight[])
{
  PetscFunctionBegin;
  PetscCheck(model && model->has_mesh && !model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Element weights are given between FemModelSetMesh() and FemModelSetUp()");
  for (PetscInt c = 0; c < model->N_cells; c++)
    PetscCheck(weight[c] > 0, model->comm, PETSC_ERR_ARG_OUTOFRANGE, "Weight %.6g of element %" PetscInt_FMT " must be positive", (double)weight[c], c);
  PetscCall(PetscFree(model->cell_weight));
  PetscCall(PetscMalloc1(model->N_cells, &model->cell_weight));
  PetscCall(PetscArraycpy(model->cell_weight, weight, model->N_cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetExtraMass(FemModel model, const PetscReal mass[])
{
  PetscFunctionBegin;
  PetscCheck(model && model->has_mesh && !model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Extra mass is given between FemModelSetMesh() and FemModelSetUp()");
  PetscCall(PetscFree(model->extra_mass));
  PetscCall(PetscMalloc1(model->n_own, &model->extra_mass));
  PetscCall(PetscArraycpy(model->extra_mass, mass, model->n_own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetState(FemModel model, FemState *state)
{
  PetscFunctionBegin;
  PetscCheck(model && model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetUp() before FemModelGetState()");
  PetscCheck(model->method == FEM_EXPLICIT && model->size == 1, model->comm, PETSC_ERR_SUP, "The state is lent by explicit models on one rank only");
  PetscCheck(!model->lent, model->comm, PETSC_ERR_ORDER, "The state is lent already; FemModelRestoreState() first");
  model->lent = PETSC_TRUE;
  *state      = (FemState){model->dim, model->n_own, model->x, model->u, model->v, model->mass, model->f_ext};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelRestoreState(FemModel model, FemState *state)
{
  PetscFunctionBegin;
  PetscCheck(model && model->lent, PETSC_COMM_SELF, PETSC_ERR_ORDER, "The state is not lent");
  model->lent        = PETSC_FALSE;
  model->level_known = PETSC_FALSE; /* forces or motion may have changed */
  PetscCall(PetscMemzero(state, sizeof(*state)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetCounts(FemModel model, PetscInt *nodes, PetscInt *elements, PetscInt *dofs)
{
  PetscFunctionBegin;
  PetscCheck(model && model->has_mesh, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetMesh() first");
  if (nodes) *nodes = model->N_nodes;
  if (elements) *elements = model->N_cells;
  if (dofs) *dofs = model->N_nodes * model->dim;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelDestroy(FemModel *model)
{
  FemModel m = *model;

  PetscFunctionBegin;
  if (!m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FemRecoveryDestroy(m));
  PetscCall(FemProbesDestroy(m));
  PetscCall(FemMeshDestroy(m));
  PetscCall(FemRowsDestroy(m));
  PetscCall(FemElementsDestroy(m));
  PetscCall(FemBatchesDestroy(m));
  PetscCall(FemInnerDestroy(m));
  PetscCall(FemFarDestroy(m));
  for (PetscInt k = 0; k < m->n_fixes; k++) PetscCall(TableDestroy(&m->fix[k].table));
  for (PetscInt k = 0; k < m->n_loads; k++) {
    PetscCall(TableDestroy(&m->load[k].table));
    PetscCall(PetscFree2(m->load[k].node, m->load[k].force));
  }
  for (PetscInt k = 0; k < m->n_history; k++) PetscCall(PetscFree(m->history_name[k]));
  PetscCall(PetscFree(m->history_name));
  PetscCall(PetscFree(m->history_unit));
  PetscCall(PetscFree(m->history));
  PetscCall(PetscFree(m->region));
  PetscCall(PetscFree(m->fix));
  PetscCall(PetscFree(m->load));
  PetscCall(PetscFree(m->law));
  PetscCall(PetscFree(m->fixed));
  PetscCall(FemFramesDestroy(m));
  PetscCall(FemPrestressDestroy(m));
  PetscCall(PetscFree(m->fixed_dof));
  PetscCall(PetscFree(m->cell_weight));
  PetscCall(PetscFree(m->extra_mass));
  PetscCall(PetscFree2(m->mass, m->borne));
  PetscCall(PetscFree(m->load_value));
  PetscCall(PetscFree5(m->u, m->v, m->f_int, m->f_app, m->f_ext));
  PetscCall(PetscFree2(m->v_next, m->reaction));
  PetscCall(FemSolverDestroy(m));
  PetscCall(FemAbsorbDestroy(m));
  PetscCall(FemContactDestroy(m));
  PetscCall(FemImplicitDestroy(m));
  PetscCall(PetscFree(*model));
  *model = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}
