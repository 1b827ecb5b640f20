/*
  geometry.c - the scene's bodies: which method, which materials, and the mesh or the convex pieces they fill.

  One body per scene; with finite elements several bodies may be parts (physical groups) of one geometry file and then
  share its mesh, a material each.
*/
#include "app.h"
#include <string.h>

#define Path(buffer, ...) PetscCall(PetscSNPrintf(buffer, sizeof(buffer), __VA_ARGS__))

static PetscErrorCode Has(Scene scene, PetscBool *has, const char *format, const char *name)
{
  char path[256];

  PetscFunctionBegin;
  Path(path, format, name);
  PetscCall(SceneHas(scene, path, has));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetString(Scene scene, const char **value, const char *format, const char *name)
{
  char path[256];

  PetscFunctionBegin;
  Path(path, format, name);
  PetscCall(SceneGetString(scene, path, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetReal(Scene scene, PetscReal *value, const char *format, const char *name)
{
  char path[256];

  PetscFunctionBegin;
  Path(path, format, name);
  PetscCall(SceneGetReal(scene, path, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A value without default; stays as it is when the user wrote none. */
static PetscErrorCode GetGiven(Scene scene, PetscReal *value, const char *format, const char *name)
{
  PetscBool has;

  PetscFunctionBegin;
  PetscCall(Has(scene, &has, format, name));
  if (has) PetscCall(GetReal(scene, value, format, name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- materials ------------------------------------------------------------------------------------------------- */

/* Numbers of a breaking law; the scene's rules have seen to it that they go together. */
static PetscErrorCode ReadStrength(AppCase *c, AppPart *part)
{
  DemStrength *s = &part->strength;
  const char  *word;
  char         path[256];
  PetscBool    has;

  PetscFunctionBegin;
  PetscCall(GetString(c->scene, &word, "materials.%s.law", part->material));
  part->cohesive = strcmp(word, "elastic") ? PETSC_TRUE : PETSC_FALSE;
  s->published   = strcmp(word, "published") ? PETSC_FALSE : PETSC_TRUE;
  if (!part->cohesive) PetscFunctionReturn(PETSC_SUCCESS);
  Path(path, "materials.%s.law", part->material);
  if (c->method == APP_FEM) PetscCall(SceneFail(c->scene, path, "finite elements do not break; use method: dem or coupled for the body '%s'", part->name));
  if (c->is_static) PetscCall(SceneGetReal(c->scene, "time.teeth", &s->teeth));
  PetscCall(GetGiven(c->scene, &s->tensile, "materials.%s.tensile_strength", part->material));
  PetscCall(GetGiven(c->scene, &s->fracture_energy, "materials.%s.fracture_energy", part->material));
  PetscCall(GetGiven(c->scene, &s->shear, "materials.%s.shear_strength", part->material));
  PetscCall(GetGiven(c->scene, &s->shear_energy, "materials.%s.fracture_energy_shear", part->material));
  PetscCall(GetGiven(c->scene, &s->delta_n, "materials.%s.delta_n", part->material));
  PetscCall(GetGiven(c->scene, &s->delta_s, "materials.%s.delta_s", part->material));
  PetscCall(GetString(c->scene, &word, "materials.%s.criterion", part->material));
  s->nonlocal = strcmp(word, "nonlocal") ? PETSC_FALSE : PETSC_TRUE;
  for (PetscInt b = 0; b < 3; b++) {
    static const char *const stress[] = {"materials.%s.compression.lcs1", "materials.%s.compression.lcs2", "materials.%s.compression.lcs3"};
    static const char *const divisor[] = {"materials.%s.compression.yrc1", "materials.%s.compression.yrc2", "materials.%s.compression.yrc3"};

    PetscCall(GetGiven(c->scene, &s->crush[b], stress[b], part->material));
    PetscCall(GetGiven(c->scene, &s->reduce[b], divisor[b], part->material));
    if (s->crush[b] > 0) s->n_branches = b + 1;
  }
  PetscCall(GetReal(c->scene, &s->mu_static, "materials.%s.mu_static", part->material));
  PetscCall(GetReal(c->scene, &s->mu_dynamic, "materials.%s.mu_dynamic", part->material));
  PetscCall(Has(c->scene, &has, "materials.%s.softening.bilinear", part->material));
  if (has) {
    s->softening = DEM_SOFTENING_BILINEAR;
    PetscCall(GetReal(c->scene, &s->knee_stress, "materials.%s.softening.bilinear.knee_stress", part->material));
    PetscCall(GetReal(c->scene, &s->knee_opening, "materials.%s.softening.bilinear.knee_opening", part->material));
  } else {
    PetscCall(GetString(c->scene, &word, "materials.%s.softening", part->material));
    s->softening = strcmp(word, "exponential") ? DEM_SOFTENING_LINEAR : DEM_SOFTENING_EXPONENTIAL;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bonds' elastic rule; the scene's rules have seen to it that its numbers belong to it. */
static PetscErrorCode ReadRule(AppCase *c, AppPart *part)
{
  static const char *const words[] = {"exact", "onate2015", "kdem", "given"};
  DemRule                 *r = &part->rule;
  const char              *word;
  char                     path[256];
  PetscBool                has;

  PetscFunctionBegin;
  PetscCall(GetString(c->scene, &word, "materials.%s.elasticity", part->material));
  for (PetscInt k = 0; k < 4; k++)
    if (!strcmp(word, words[k])) r->elasticity = (DemElasticity)k;
  Path(path, "materials.%s.elasticity", part->material);
  if (r->elasticity != DEM_EXACT && c->method == APP_FEM) PetscCall(SceneFail(c->scene, path, "elasticity is the rule of particles' bonds; the body '%s' is made of finite elements, take it out", part->name));
  if (r->elasticity != DEM_EXACT && c->method == APP_COUPLED) PetscCall(SceneFail(c->scene, path, "a coupled body needs elasticity: exact; the published rules do not balance against finite elements"));
  PetscCall(GetReal(c->scene, &r->range, "materials.%s.interaction_range", part->material));
  PetscCall(GetReal(c->scene, &r->area_factor, "materials.%s.area_factor", part->material));
  PetscCall(GetReal(c->scene, &r->normal_factor, "materials.%s.factor_normal", part->material));
  PetscCall(GetReal(c->scene, &r->shear_factor, "materials.%s.factor_shear", part->material));
  PetscCall(GetGiven(c->scene, &r->normal_stiffness, "materials.%s.stiffness_normal", part->material));
  PetscCall(GetGiven(c->scene, &r->shear_stiffness, "materials.%s.stiffness_shear", part->material));
  Path(path, "materials.%s.areas", part->material);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscCall(SceneGetString(c->scene, path, &word));
    r->polyhedron = strcmp(word, "polyhedron") ? PETSC_FALSE : PETSC_TRUE;
  }
  Path(path, "materials.%s.poisson_term", part->material);
  PetscCall(SceneGetBool(c->scene, path, &r->poisson_term));
  if (c->method != APP_DEM) PetscFunctionReturn(PETSC_SUCCESS);
  Path(path, "bodies.%s.dem.pressure_area", part->name);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscCall(SceneGetString(c->scene, path, &word));
    r->sphere_pressure = strcmp(word, "sphere") ? PETSC_FALSE : PETSC_TRUE;
    if (r->sphere_pressure && r->elasticity == DEM_EXACT) PetscCall(SceneFail(c->scene, path, "pressure_area: sphere belongs to the published rules; with elasticity: exact pressure acts on facets"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Groups whose particles bond among themselves only: the parts of the mesh they fill. */
static PetscErrorCode ReadJoints(AppCase *c, const char *body)
{
  char      path[256];
  PetscBool has;

  PetscFunctionBegin;
  Path(path, "bodies.%s.dem.cohesive_groups", body);
  PetscCall(SceneHas(c->scene, path, &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  if (c->method == APP_COUPLED || !c->mesh.n_cells) PetscCall(SceneFail(c->scene, path, "groups of particles are physical groups of a .geo or .msh file, of a body that is particles alone; here there is none"));
  PetscCall(SceneGetSize(c->scene, path, &c->n_joints));
  PetscCall(PetscCalloc1(c->n_joints, &c->joint));
  for (PetscInt k = 0; k < c->n_joints; k++) {
    const char *name;

    PetscCall(SceneGetEntry(c->scene, path, k, &name));
    AppCallAt(c->scene, path, DemBodyCreateFromMesh(&c->mesh, name, c->thickness, &c->joint[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two numbers, or nine and their axes. */
static PetscErrorCode ReadElastic(AppCase *c, AppPart *part)
{
  static const char *const young[] = {"young_1", "young_2", "young_3"}, *const poisson[] = {"poisson_12", "poisson_13", "poisson_23"}, *const shear[] = {"shear_12", "shear_13", "shear_23"};
  FemMaterial             *m = &part->elastic;
  PetscBool                orthotropic;
  char                     path[256];

  PetscFunctionBegin;
  PetscCall(Has(c->scene, &orthotropic, "materials.%s.orthotropic", part->material));
  m->density     = part->density;
  m->orthotropic = orthotropic;
  if (!orthotropic) {
    PetscCall(GetReal(c->scene, &part->young, "materials.%s.young", part->material));
    PetscCall(GetReal(c->scene, &part->poisson, "materials.%s.poisson", part->material));
    m->young   = part->young;
    m->poisson = part->poisson;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = 0; k < 3; k++) {
    Path(path, "materials.%s.orthotropic.%s", part->material, young[k]);
    PetscCall(SceneGetReal(c->scene, path, &m->E[k]));
    Path(path, "materials.%s.orthotropic.%s", part->material, poisson[k]);
    PetscCall(SceneGetReal(c->scene, path, &m->nu[k]));
    Path(path, "materials.%s.orthotropic.%s", part->material, shear[k]);
    PetscCall(SceneGetReal(c->scene, path, &m->G[k]));
    part->young   = PetscMax(part->young, m->E[k]);
    part->poisson = PetscMin(0.45, PetscMax(part->poisson, m->nu[k]));
  }
  if (c->dim == 2) {
    PetscReal angle;

    PetscCall(GetReal(c->scene, &angle, "materials.%s.orthotropic.angle", part->material));
    m->axis[0][0] = PetscCosReal(angle);
    m->axis[0][1] = PetscSinReal(angle);
    m->axis[1][0] = -m->axis[0][1];
    m->axis[1][1] = m->axis[0][0];
  } else
    for (PetscInt k = 0; k < 2; k++) {
      Path(path, "materials.%s.orthotropic.axis_%d", part->material, (int)k + 1);
      PetscCall(SceneGetVector(c->scene, path, 3, m->axis[k]));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene's own rules have seen to it that the material is there and whole. */
static PetscErrorCode ReadMaterial(AppCase *c, AppPart *part)
{
  char path[256];

  PetscFunctionBegin;
  PetscCall(GetString(c->scene, &part->material, "bodies.%s.material", part->name));
  PetscCall(GetReal(c->scene, &part->density, "materials.%s.density", part->material));
  PetscCall(ReadElastic(c, part));
  PetscCall(GetReal(c->scene, &part->local_damping, "materials.%s.local_damping", part->material));
  if (c->method == APP_FEM && c->time != APP_EXPLICIT && part->local_damping > 0) {
    Path(path, "materials.%s.local_damping", part->material);
    PetscCall(SceneFail(c->scene, path, "local damping acts in explicit runs; give mass_damping or stiffness_damping instead"));
  }
  if (c->method == APP_FEM && part->local_damping != c->part[0].local_damping) {
    Path(path, "materials.%s.local_damping", part->material);
    PetscCall(SceneFail(c->scene, path, "local damping is one number for all finite elements for now; '%s' and '%s' give two", c->part[0].material, part->material));
  }
  PetscCall(GetReal(c->scene, &part->mass_damping, "materials.%s.mass_damping", part->material));
  Path(path, "materials.%s.mass_damping", part->material);
  if (c->method == APP_DEM && part->mass_damping > 0) {
    PetscCall(SceneFail(c->scene, path, "mass damping is a drag on finite elements; the body '%s' is made of particles alone, give its material local_damping instead", part->name));
  }
  if ((c->is_static || c->time == APP_MODAL) && part->mass_damping > 0) PetscCall(SceneFail(c->scene, path, "mass damping needs velocities; a %s run has none", c->is_static ? "static" : "modal"));
  if (c->method == APP_FEM && part->mass_damping != c->part[0].mass_damping) {
    PetscCall(SceneFail(c->scene, path, "mass damping is one number for all finite elements for now; '%s' and '%s' give two", c->part[0].material, part->material));
  }
  PetscCall(GetReal(c->scene, &part->stiffness_damping, "materials.%s.stiffness_damping", part->material));
  Path(path, "materials.%s.stiffness_damping", part->material);
  if (part->stiffness_damping > 0 && c->time != APP_IMPLICIT)
    PetscCall(SceneFail(c->scene, path, "stiffness damping needs time.method: implicit; central differences would have to shorten their step for it, and a static run has no velocities: use mass_damping, or time: {method: implicit}"));
  if (part->stiffness_damping != c->part[0].stiffness_damping)
    PetscCall(SceneFail(c->scene, path, "stiffness damping is one number for all finite elements for now; '%s' and '%s' give two", c->part[0].material, part->material));
  PetscCall(ReadRule(c, part));
  PetscCall(ReadStrength(c, part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- finite elements: a mesh ------------------------------------------------------------------------------------ */

static PetscErrorCode CellType(AppCase *c, const char *body, MeshCellType *type)
{
  static const char *const words[] = {"tri", "quad", "tet", "hex"};
  static const MeshCellType types[] = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8};
  char                      path[256];
  const char               *word;
  PetscBool                 has;

  PetscFunctionBegin;
  *type = c->dim == 2 ? MESH_TRI3 : MESH_TET4;
  Path(path, "bodies.%s.mesh.cells", body);
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscCall(SceneGetString(c->scene, path, &word));
    for (int k = 0; k < 4; k++)
      if (!strcmp(word, words[k])) *type = types[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Quadratic unless steps are explicit, where small elements cost less than good ones, or cells are hexahedra, which linear do not lock and
   which multigrid solves many times faster than quadratic ones. */
static PetscErrorCode MeshOrder(AppCase *c, const char *body, PetscInt *order, PetscBool *incomplete)
{
  const char  *method;
  char         path[256];
  MeshCellType type;

  PetscFunctionBegin;
  PetscCall(CellType(c, body, &type));
  PetscCall(SceneGetString(c->scene, "time.method", &method));
  Path(path, "bodies.%s.mesh.order", body);
  PetscCall(SceneGetInt(c->scene, path, order));
  if (!*order) *order = strcmp(method, "explicit") && type != MESH_HEX8 ? 2 : 1;
  Path(path, "bodies.%s.mesh.incomplete", body);
  PetscCall(SceneGetBool(c->scene, path, incomplete));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadBoxMesh(AppCase *c, const char *body)
{
  char         path[256];
  PetscReal    low[3] = {0}, size[3] = {0}, h;
  PetscInt     n[3] = {1, 1, 1}, order;
  MeshCellType type;
  PetscBool    incomplete;

  PetscFunctionBegin;
  PetscCall(CellType(c, body, &type));
  PetscCall(MeshOrder(c, body, &order, &incomplete));
  if (order == 2) type = MeshCellQuadratic(type, incomplete);
  Path(path, "bodies.%s.geometry.box.low", body);
  PetscCall(SceneGetVector(c->scene, path, c->dim, low));
  Path(path, "bodies.%s.geometry.box.size", body);
  PetscCall(SceneGetVector(c->scene, path, c->dim, size));
  Path(path, "bodies.%s.mesh.size", body);
  PetscCall(SceneGetReal(c->scene, path, &h));
  for (PetscInt d = 0; d < c->dim; d++) {
    const PetscReal cells = PetscCeilReal(size[d] / h * (1 - 1e-9));

    if (cells > 1e6) PetscCall(SceneFail(c->scene, path, "a mesh size of %g m makes %g cells along %c", (double)h, (double)cells, (char)('x' + d)));
    n[d] = PetscMax(1, (PetscInt)cells);
  }
  AppCallAt(c->scene, path, MeshCreateBox(c->comm, body, type, low, size, n, &c->mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadRoundMesh(AppCase *c, const char *body)
{
  const char  *shape   = c->dim == 2 ? "disc" : "cylinder";
  MeshOptions  options = {.dimension = c->dim, .scale = 1};
  PetscReal    centre[3] = {0}, radius, height = 0;
  char         path[256];
  MeshCellType type;

  PetscFunctionBegin;
  PetscCall(MeshOrder(c, body, &options.order, &options.incomplete));
  PetscCall(CellType(c, body, &type));
  options.quads = type == MESH_QUAD4 || type == MESH_HEX8 ? PETSC_TRUE : PETSC_FALSE;
  PetscCall(GetReal(c->scene, &options.size, "bodies.%s.mesh.size", body));
  Path(path, "bodies.%s.geometry.%s.centre", body, shape);
  PetscCall(SceneGetVector(c->scene, path, c->dim, centre));
  Path(path, "bodies.%s.geometry.%s.radius", body, shape);
  PetscCall(SceneGetReal(c->scene, path, &radius));
  Path(path, "bodies.%s.geometry.%s.height", body, shape);
  if (c->dim == 3) PetscCall(SceneGetReal(c->scene, path, &height));
  Path(path, "bodies.%s.geometry", body);
  AppCallAt(c->scene, path, MeshCreateRound(c->comm, body, centre, radius, height, &options, &c->mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The file named by bodies.NAME.geometry, meshed or read. */
static PetscErrorCode ReadFileMesh(AppCase *c, const char *body, PetscInt order, PetscBool incomplete)
{
  char        path[256], file[PETSC_MAX_PATH_LEN];
  const char *name;
  MeshOptions options = {.dimension = c->dim, .order = order, .scale = 1, .incomplete = incomplete};
  PetscBool   has;

  PetscFunctionBegin;
  Path(path, "bodies.%s.geometry", body);
  PetscCall(SceneGetString(c->scene, path, &name));
  PetscCall(SceneFilePath(c->scene, name, sizeof(file), file));
  PetscCall(GetReal(c->scene, &options.scale, "bodies.%s.length_unit", body));
  PetscCall(Has(c->scene, &has, "bodies.%s.mesh.size", body));
  if (has) PetscCall(GetReal(c->scene, &options.size, "bodies.%s.mesh.size", body));
  if (c->method != APP_DEM) {
    MeshCellType type;

    PetscCall(CellType(c, body, &type));
    options.quads = (type == MESH_QUAD4 || type == MESH_HEX8) ? PETSC_TRUE : PETSC_FALSE;
  }
  AppCallAt(c->scene, path, MeshRead(c->comm, file, &options, &c->mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keep only the cells of the named top-dimension groups and what lies on them. Rank 0. */
static PetscErrorCode KeepParts(AppCase *c, PetscBool keep_cell[], PetscBool keep_node[])
{
  Mesh     *m = &c->mesh;
  PetscInt *new_node, *new_cell, cells = 0, nodes = 0, at = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m->n_nodes, &new_node, m->n_cells, &new_cell));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    if (MeshCellDim(m->type[e]) == m->dim || m->type[e] == 0) continue;
    keep_cell[e] = PETSC_TRUE;
    for (PetscInt k = m->start[e]; k < m->start[e + 1]; k++) keep_cell[e] = keep_cell[e] && keep_node[m->node[k]];
  }
  for (PetscInt v = 0; v < m->n_nodes; v++) {
    new_node[v] = nodes;
    if (!keep_node[v]) continue;
    m->id[nodes] = m->id[v];
    for (PetscInt d = 0; d < 3; d++) m->x[3 * nodes + d] = m->x[3 * v + d];
    nodes++;
  }
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscInt from = m->start[e], to = m->start[e + 1];

    new_cell[e] = keep_cell[e] ? cells : -1;
    if (!keep_cell[e]) continue;
    m->type[cells]    = m->type[e];
    m->cell_id[cells] = m->cell_id[e];
    m->start[cells]   = at;
    for (PetscInt k = from; k < to; k++) m->node[at++] = new_node[m->node[k]];
    cells++;
  }
  m->start[cells] = at;
  m->n_cells      = cells;
  m->n_nodes      = nodes;
  for (PetscInt g = 0; g < m->n_groups; g++) {
    PetscInt n = 0;

    for (PetscInt k = 0; k < m->group[g].n_cells; k++)
      if (new_cell[m->group[g].cell[k]] >= 0) m->group[g].cell[n++] = new_cell[m->group[g].cell[k]];
    m->group[g].n_cells = n;
  }
  PetscCall(PetscFree2(new_node, new_cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* When every part names a group, the mesh is what those groups cover; a group two parts claim is refused. */
static PetscErrorCode RestrictMesh(AppCase *c)
{
  Mesh      *m = &c->mesh;
  PetscBool *keep_cell, *keep_node;
  PetscInt   twice = -1; /* part that claims a cell again */

  PetscFunctionBegin;
  if (!c->part[0].group[0]) PetscFunctionReturn(PETSC_SUCCESS);
  if (!c->rank) {
    PetscCall(PetscCalloc2(m->n_cells, &keep_cell, m->n_nodes, &keep_node));
    for (PetscInt p = 0; p < c->n_parts; p++) {
      const MeshGroup *g;

      PetscCall(MeshFindGroup(m, c->part[p].group, &g));
      for (PetscInt k = 0; g && k < g->n_cells; k++) {
        const PetscInt e = g->cell[k];

        if (keep_cell[e]) twice = p;
        keep_cell[e] = PETSC_TRUE;
        for (PetscInt q = m->start[e]; q < m->start[e + 1]; q++) keep_node[m->node[q]] = PETSC_TRUE;
      }
    }
    PetscCall(KeepParts(c, keep_cell, keep_node));
    PetscCall(PetscFree2(keep_cell, keep_node));
  }
  PetscCallMPI(MPI_Bcast(&twice, 1, MPIU_INT, 0, c->comm));
  if (twice >= 0) {
    char path[256];

    Path(path, "bodies.%s.group", c->part[twice].name);
    PetscCall(SceneFail(c->scene, path, "cells of '%s' belong to another body's group too; each cell has one material", c->part[twice].group));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- groups ------------------------------------------------------------------------------------------------------ */

static PetscErrorCode ShareMeshGroups(AppCase *c)
{
  PetscInt n[4] = {c->mesh.n_groups, c->mesh.n_nodes, 0, 2};

  PetscFunctionBegin;
  for (PetscInt e = 0; e < c->mesh.n_cells; e++) {
    if (MeshCellDim(c->mesh.type[e]) != c->mesh.dim) continue;
    n[2]++;
    if (MeshCellLinear(c->mesh.type[e]) == c->mesh.type[e]) n[3] = 1;
  }
  PetscCallMPI(MPI_Bcast(n, 4, MPIU_INT, 0, c->comm));
  PetscCallMPI(MPI_Bcast(&c->mesh_step, 1, MPIU_REAL, 0, c->comm));
  PetscCallMPI(MPI_Bcast(&c->mesh_cost, 1, MPIU_REAL, 0, c->comm));
  c->n_groups   = n[0];
  c->mesh_nodes = n[1];
  c->mesh_cells = n[2];
  c->mesh_order = n[3];
  PetscCall(PetscCalloc1(c->n_groups + 1, &c->group));
  for (PetscInt g = 0; !c->rank && g < c->n_groups; g++) {
    PetscCall(PetscStrncpy(c->group[g].name, c->mesh.group[g].name, sizeof(c->group[g].name)));
    c->group[g].dim = c->mesh.group[g].dim;
  }
  PetscCallMPI(MPI_Bcast(c->group, (int)(c->n_groups * sizeof(*c->group)), MPI_BYTE, 0, c->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ShareBodyGroups(AppCase *c)
{
  PetscFunctionBegin;
  PetscCall(PetscCalloc1(c->body.n_faces + 1, &c->group));
  for (PetscInt f = 0; f < c->body.n_faces; f++) {
    if (!c->body.face_name[f][0]) continue; /* the boundary nobody named */
    PetscCall(PetscStrncpy(c->group[c->n_groups].name, c->body.face_name[f], sizeof(c->group[0].name)));
    c->group[c->n_groups++].dim = c->dim - 1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A part's own group must exist and be of the body's dimension. */
static PetscErrorCode CheckPartGroup(AppCase *c, const AppPart *part, PetscInt n, const AppGroup group[])
{
  char        path[256];
  const char *names[256] = {NULL}, *near;
  PetscInt    m = 0;

  PetscFunctionBegin;
  if (!part->group[0]) PetscFunctionReturn(PETSC_SUCCESS);
  Path(path, "bodies.%s.group", part->name);
  for (PetscInt g = 0; g < n && m < 256; g++) {
    if (group[g].dim == c->dim && !strcmp(group[g].name, part->group)) PetscFunctionReturn(PETSC_SUCCESS);
    if (group[g].dim == c->dim) names[m++] = group[g].name;
  }
  near = BaseNearest(part->group, m, names);
  if (near) PetscCall(SceneFail(c->scene, path, "no %s group '%s' in the geometry; did you mean '%s'?", c->dim == 3 ? "volume" : "surface", part->group, near));
  PetscCall(SceneFail(c->scene, path, "no %s group '%s' in the geometry; it names %s%s", c->dim == 3 ? "volume" : "surface", part->group, m ? names[0] : "none", m > 1 ? " and others" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- estimates ---------------------------------------------------------------------------------------------------- */

/* For the plan, not for stepping: crossing time of the shortest edge at the P-wave speed, and the time an explicit step
   takes on one thread (measured: hexahedron 350 ns, tetrahedron 28 ns, quadrilateral 55 ns, triangle 23 ns). Rank 0. */
static void EstimateStep(AppCase *c)
{
  const Mesh *m = &c->mesh;

  c->mesh_step = PETSC_MAX_REAL;
  c->mesh_cost = 0;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscInt corners = MeshCellCorners(m->type[e]);
    PetscReal      h2      = PETSC_MAX_REAL;

    if (MeshCellDim(m->type[e]) != m->dim) continue;
    if (m->dim == 3) c->mesh_cost += corners == 4 ? 2.8e-8 : 3.5e-7;
    else c->mesh_cost += corners == 3 ? 2.3e-8 : 5.5e-8;
    for (PetscInt a = 0; a < corners; a++)
      for (PetscInt b = 0; b < a; b++) {
        PetscReal d2 = 0;

        for (PetscInt d = 0; d < 3; d++) {
          const PetscReal gap = m->x[3 * m->node[m->start[e] + a] + d] - m->x[3 * m->node[m->start[e] + b] + d];

          d2 += gap * gap;
        }
        h2 = PetscMin(h2, d2);
      }
    for (PetscInt p = 0; p < c->n_parts; p++) {
      const AppPart  *part = &c->part[p];
      const PetscReal cp   = PetscSqrtReal(part->young * (1 - part->poisson) / (part->density * (1 + part->poisson) * PetscMax(1 - 2 * part->poisson, 1e-6)));

      c->mesh_step = PetscMin(c->mesh_step, PetscSqrtReal(h2) / cp);
    }
  }
}

/* ---- bodies --------------------------------------------------------------------------------------------------------- */

static PetscErrorCode ReadDemBody(AppCase *c)
{
  const char *body = AppGrains(c)->name;
  char        path[256];
  PetscBool   box, cylinder, disc;
  PetscReal   low[3] = {0}, size[3] = {0}, radius, height;

  PetscFunctionBegin;
  PetscCall(Has(c->scene, &box, "bodies.%s.geometry.box", body));
  PetscCall(Has(c->scene, &cylinder, "bodies.%s.geometry.cylinder", body));
  PetscCall(Has(c->scene, &disc, "bodies.%s.geometry.disc", body));
  Path(path, "bodies.%s.geometry", body);
  if (box) {
    Path(path, "bodies.%s.geometry.box.low", body);
    PetscCall(SceneGetVector(c->scene, path, c->dim, low));
    Path(path, "bodies.%s.geometry.box.size", body);
    PetscCall(SceneGetVector(c->scene, path, c->dim, size));
    for (PetscInt d = 0; d < c->dim; d++) size[d] += low[d];
    AppCallAt(c->scene, path, DemBodyCreateBox(c->dim, low, size, c->thickness, &c->body));
  } else if (cylinder) {
    Path(path, "bodies.%s.geometry.cylinder.centre", body);
    PetscCall(SceneGetVector(c->scene, path, 3, low));
    PetscCall(GetReal(c->scene, &radius, "bodies.%s.geometry.cylinder.radius", body));
    PetscCall(GetReal(c->scene, &height, "bodies.%s.geometry.cylinder.height", body));
    Path(path, "bodies.%s.geometry.cylinder", body);
    AppCallAt(c->scene, path, DemBodyCreateCylinder(low, radius, height, 64, &c->body));
  } else if (disc) {
    Path(path, "bodies.%s.geometry.disc.centre", body);
    PetscCall(SceneGetVector(c->scene, path, 2, low));
    PetscCall(GetReal(c->scene, &radius, "bodies.%s.geometry.disc.radius", body));
    Path(path, "bodies.%s.geometry.disc", body);
    AppCallAt(c->scene, path, DemBodyCreateDisc(low, radius, 64, c->thickness, &c->body));
  } else {
    AppGroup *group;

    PetscCall(ReadFileMesh(c, body, 1, PETSC_FALSE));
    PetscCall(MeshShare(c->comm, &c->mesh)); /* every rank packs the body alike */
    PetscCall(PetscCalloc1(c->mesh.n_groups + 1, &group));
    for (PetscInt g = 0; g < c->mesh.n_groups; g++) {
      PetscCall(PetscStrncpy(group[g].name, c->mesh.group[g].name, sizeof(group[g].name)));
      group[g].dim = c->mesh.group[g].dim;
    }
    PetscCall(CheckPartGroup(c, AppGrains(c), c->mesh.n_groups, group));
    PetscCall(PetscFree(group));
    AppCallAt(c->scene, path, DemBodyCreateFromMesh(&c->mesh, AppGrains(c)->group, c->thickness, &c->body));
    PetscCall(ReadJoints(c, body));
    PetscCall(MeshDestroy(&c->mesh));
  }
  if (!c->joint) PetscCall(ReadJoints(c, body));
  c->made_bodies++;
  PetscCall(ShareBodyGroups(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadFemBody(AppCase *c)
{
  const char *body = c->part[0].name;
  PetscBool   box, cylinder, disc, incomplete;
  PetscInt    order;

  PetscFunctionBegin;
  PetscCall(Has(c->scene, &box, "bodies.%s.geometry.box", body));
  PetscCall(Has(c->scene, &cylinder, "bodies.%s.geometry.cylinder", body));
  PetscCall(Has(c->scene, &disc, "bodies.%s.geometry.disc", body));
  if (box) PetscCall(ReadBoxMesh(c, body));
  else if (cylinder || disc) PetscCall(ReadRoundMesh(c, body));
  else {
    PetscCall(MeshOrder(c, body, &order, &incomplete));
    PetscCall(ReadFileMesh(c, body, order, incomplete));
  }
  PetscCall(ShareMeshGroups(c));
  for (PetscInt p = 0; p < c->n_parts; p++) PetscCall(CheckPartGroup(c, &c->part[p], c->n_groups, c->group));
  PetscCall(RestrictMesh(c));
  if (!c->rank) EstimateStep(c);
  PetscCall(PetscFree(c->group));
  PetscCall(ShareMeshGroups(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elements that may turn: what the packing must fill is more than the particles of the start. */
static PetscErrorCode ReadSwitch(AppCase *c, const char *seed, PetscInt width, const Mesh **region)
{
  CouplingSwitchOptions options = {0};
  const char           *word;
  PetscBool             has;

  PetscFunctionBegin;
  PetscCall(SceneGetString(c->scene, "coupling.switch.when", &word));
  options.when = !strcmp(word, "given") ? COUPLING_GIVEN : strcmp(word, "mohr-coulomb") ? COUPLING_RANKINE : COUPLING_MOHR_COULOMB;
  if (options.when == COUPLING_GIVEN) {
    PetscCall(SceneGetReal(c->scene, "coupling.switch.given.mean", &options.given_mean));
    PetscCall(SceneGetReal(c->scene, "coupling.switch.given.mises", &options.given_mises));
    PetscCall(SceneGetReal(c->scene, "coupling.switch.given.strength", &options.given_strength));
  }
  options.off  = strcmp(word, "never") ? PETSC_FALSE : PETSC_TRUE;
  PetscCall(SceneGetReal(c->scene, "coupling.switch.at", &options.at));
  PetscCall(SceneGetReal(c->scene, "coupling.switch.hysteresis", &options.hysteresis));
  PetscCall(SceneGetInt(c->scene, "coupling.switch.ahead", &options.ahead));
  PetscCall(SceneHas(c->scene, "coupling.switch.group", &has));
  if (has) PetscCall(SceneGetString(c->scene, "coupling.switch.group", &options.group));
  AppCallAt(c->scene, has ? "coupling.switch.group" : "coupling.switch", CouplingSwitchCreate(c->comm, &c->mesh, seed, width, &options, &c->turning));
  PetscCall(CouplingSwitchGetRegion(c->turning, region));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole body's mesh, its elements and what its particles fill. */
static PetscErrorCode ReadCoupledBody(AppCase *c)
{
  const char *body = c->part[0].name, *group;
  char        path[256];
  PetscReal   width;
  const Mesh *region = NULL;
  PetscBool   turns, incomplete;
  PetscInt    order;

  PetscFunctionBegin;
  Path(path, "bodies.%s.mesh.order", body);
  PetscCall(SceneGetInt(c->scene, path, &order));
  Path(path, "bodies.%s.mesh.incomplete", body);
  PetscCall(SceneGetBool(c->scene, path, &incomplete));
  PetscCall(ReadFileMesh(c, body, PetscMax(order, 1), incomplete)); /* auto: linear, that needs half as many particles to a side */
  PetscCall(ShareMeshGroups(c));
  PetscCall(CheckPartGroup(c, &c->part[0], c->n_groups, c->group));
  PetscCall(RestrictMesh(c));
  PetscCall(MeshShare(c->comm, &c->mesh)); /* every rank has all elements of a coupled body */
  EstimateStep(c);
  PetscCall(PetscFree(c->group));
  PetscCall(ShareMeshGroups(c));
  PetscCall(SceneGetReal(c->scene, "coupling.width", &width));
  if (width != PetscFloorReal(width)) PetscCall(SceneFail(c->scene, "coupling.width", "the overlap is a whole number of elements wide, not %.4g", (double)width));
  PetscCall(GetString(c->scene, &group, "bodies.%s.dem.group", body));
  Path(path, "bodies.%s.dem.group", body);
  AppCallAt(c->scene, path, CouplingSplitCreate(&c->mesh, group, (PetscInt)width, &c->split));
  PetscCall(SceneHas(c->scene, "coupling.switch", &turns));
  if (turns) PetscCall(ReadSwitch(c, group, (PetscInt)width, &region));
  AppCallAt(c->scene, path, DemBodyCreateFromMesh(turns ? region : &c->split.dem, "", c->thickness, &c->body));
  c->made_bodies++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One body of elements and one of particles? turned: the particles come first in the scene. */
static PetscErrorCode FindPair(AppCase *c, PetscBool *pair, PetscBool *turned)
{
  const char *name, *method[2];

  PetscFunctionBegin;
  for (PetscInt b = 0; b < 2; b++) {
    PetscCall(SceneGetEntry(c->scene, "bodies", b, &name));
    PetscCall(GetString(c->scene, &method[b], "bodies.%s.method", name));
  }
  *turned = (PetscBool)(!strcmp(method[0], "dem") && !strcmp(method[1], "fem"));
  *pair   = (PetscBool)(*turned || (!strcmp(method[0], "fem") && !strcmp(method[1], "dem")));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckPair(AppCase *c)
{
  char      path[256];
  PetscBool has;

  PetscFunctionBegin;
  c->method = APP_TOUCH;
  BaseCheckInput(c->size == 1, c->comm, "Particles that meet finite elements run on one rank for now, not %d; give them threads instead: cleave run SCENE --threads N", c->size);
  if (c->is_static) PetscCall(SceneFail(c->scene, "time.method", "particles that meet elements move in time; use method: explicit"));
  Path(path, "bodies.%s.surface", c->part[0].name);
  PetscCall(SceneHas(c->scene, path, &has));
  if (!has) PetscCall(SceneFail(c->scene, "bodies", "the particles of '%s' meet the surface of '%s': say how, e.g. bodies.%s.surface: {friction: 0.3}", c->part[1].name, c->part[0].name, c->part[0].name));
  for (PetscInt b = 0; b < 2; b++)
    if (c->part[b].elastic.orthotropic) {
      Path(path, "materials.%s.orthotropic", c->part[b].material);
      PetscCall(SceneFail(c->scene, path, "contact takes a Young's modulus from each body; use an isotropic material where bodies touch"));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BuiltIn(AppCase *c, const char *name, PetscBool *is)
{
  static const char *const shape[] = {"bodies.%s.geometry.box", "bodies.%s.geometry.cylinder", "bodies.%s.geometry.disc"};

  PetscFunctionBegin;
  *is = PETSC_FALSE;
  for (PetscInt k = 0; k < 3; k++) {
    PetscBool has;

    PetscCall(Has(c->scene, &has, shape[k], name));
    *is = (PetscBool)(*is || has);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Are they all loose grains? */
static PetscErrorCode AllLoose(AppCase *c, PetscInt n, PetscBool *loose)
{
  PetscFunctionBegin;
  *loose = PETSC_TRUE;
  for (PetscInt b = 0; b < n && *loose; b++) {
    const char *name, *method;
    char        path[256];
    PetscBool   bonded = PETSC_TRUE;

    PetscCall(SceneGetEntry(c->scene, "bodies", b, &name));
    PetscCall(GetString(c->scene, &method, "bodies.%s.method", name));
    Path(path, "bodies.%s.dem.bonded", name);
    if (!strcmp(method, "dem")) PetscCall(SceneGetBool(c->scene, path, &bonded));
    *loose = (PetscBool)!bonded;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One body, or several of finite elements that are groups of one file; or one of elements and one of particles. */
static PetscErrorCode ReadParts(AppCase *c)
{
  PetscInt    n;
  const char *first = NULL;
  PetscBool   pair = PETSC_FALSE, turned = PETSC_FALSE, loose = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(SceneGetSize(c->scene, "bodies", &n));
  if (n == 2) PetscCall(FindPair(c, &pair, &turned));
  if (n > 1 && !pair) PetscCall(AllLoose(c, n, &loose));
  if (n > APP_PARTS) PetscCall(SceneFail(c->scene, "bodies", "%" PetscInt_FMT " bodies; at most %d are taken", n, APP_PARTS));
  for (PetscInt b = 0; b < n; b++) {
    AppPart    *part = &c->part[b];
    const char *method;
    char        path[256];
    PetscBool   has;

    PetscCall(SceneGetEntry(c->scene, "bodies", turned ? 1 - b : b, &part->name));
    PetscCall(GetString(c->scene, &method, "bodies.%s.method", part->name));
    part->group = "";
    PetscCall(Has(c->scene, &has, "bodies.%s.group", part->name));
    if (has) PetscCall(GetString(c->scene, &part->group, "bodies.%s.group", part->name));
    c->method = !strcmp(method, "dem") ? APP_DEM : !strcmp(method, "coupled") ? APP_COUPLED : APP_FEM;
    if (n > 1) {
      const char *file = NULL;

      PetscCall(BuiltIn(c, part->name, &has));
      Path(path, "bodies.%s.geometry", part->name);
      if (!has) PetscCall(SceneGetString(c->scene, path, &file));
      if (!b) first = file;
      Path(path, "bodies.%s", part->name);
      if (!pair && !loose && (c->method != APP_FEM || !file || !first || strcmp(file, first) || !part->group[0]))
        PetscCall(SceneFail(c->scene, path, "these bodies together are not covered yet, see docs/not-yet.md; what runs is one body, one of method: fem that one of method: dem touches, bodies of loose grains (dem: {bonded: false}), or fem bodies that are groups (group: NAME) of one geometry file"));
    }
    PetscCall(ReadMaterial(c, part));
    Path(path, "bodies.%s.surface", part->name);
    PetscCall(SceneHas(c->scene, path, &has));
    if (has && !pair) PetscCall(SceneFail(c->scene, path, "surface is how particles of another body meet this one, and there is no other body of method: dem; take it out"));
  }
  c->n_parts = n;
  if (pair) PetscCall(CheckPair(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Several bodies of loose grains: each one's shape, and a box about them all for the model, whose faces are nobody's. */
static PetscErrorCode ReadGrains(AppCase *c)
{
  PetscReal low[3] = {PETSC_MAX_REAL, PETSC_MAX_REAL, PETSC_MAX_REAL}, high[3] = {-PETSC_MAX_REAL, -PETSC_MAX_REAL, -PETSC_MAX_REAL};

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(c->n_parts, &c->grain_body));
  for (c->grain = 0; c->grain < c->n_parts; c->grain++) {
    char      path[256];
    PetscBool has;

    Path(path, "bodies.%s.dem.rain", AppGrains(c)->name);
    PetscCall(SceneHas(c->scene, path, &has));
    if (has) PetscCall(SceneFail(c->scene, path, "a rain is the only body of a scene for now, see docs/not-yet.md; give this body a packing"));
    Path(path, "materials.%s.local_damping", AppGrains(c)->material);
    if (AppGrains(c)->local_damping != c->part[0].local_damping) PetscCall(SceneFail(c->scene, path, "local damping is one number for all grains for now; '%s' and '%s' give two", c->part[0].material, AppGrains(c)->material));
    PetscCall(ReadDemBody(c));
    for (PetscInt d = 0; d < 3; d++) {
      low[d]  = PetscMin(low[d], c->body.low[d]);
      high[d] = PetscMax(high[d], c->body.high[d]);
    }
    c->grain_body[c->grain] = c->body;
    PetscCall(PetscMemzero(&c->body, sizeof(c->body)));
    PetscCall(PetscFree(c->group));
    c->n_groups = 0;
  }
  c->grain = 0;
  AppCallAt(c->scene, "bodies", DemBodyCreateBox(c->dim, low, high, c->thickness, &c->body));
  PetscCall(PetscCalloc1(1, &c->group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both bodies; the groups of the elements' first. */
static PetscErrorCode ReadPair(AppCase *c)
{
  AppGroup      *group;
  const PetscInt all = c->n_parts;
  PetscInt       n;

  PetscFunctionBegin;
  {
    char path[256];
    Mesh kept;

    c->n_parts = 1;
    PetscCall(ReadFemBody(c));
    c->n_parts = all;
    group      = c->group;
    n          = c->n_groups;
    kept       = c->mesh;
    c->group   = NULL;
    c->n_groups = 0;
    PetscCall(PetscMemzero(&c->mesh, sizeof(c->mesh)));
    Path(path, "bodies.%s.geometry", c->part[0].name);
    PetscCall(ReadDemBody(c));
    c->mesh = kept;
    AppCallAt(c->scene, path, CouplingContactCreate(c->comm, c->part[0].name, &c->mesh, &c->contact));
  }
  PetscCall(PetscRealloc((size_t)(n + c->n_groups + 1) * sizeof(*group), &group));
  for (PetscInt g = 0; g < c->n_groups; g++) {
    group[n + g]           = c->group[g];
    group[n + g].particles = PETSC_TRUE;
  }
  PetscCall(PetscFree(c->group));
  c->group = group;
  c->n_groups += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppGeometryRead(AppCase *c)
{
  PetscFunctionBegin;
  PetscCall(ReadParts(c));
  if (c->method == APP_TOUCH) PetscCall(ReadPair(c));
  else if (c->method == APP_DEM && c->n_parts > 1) PetscCall(ReadGrains(c));
  else if (c->method == APP_DEM) PetscCall(ReadDemBody(c));
  else if (c->method == APP_COUPLED) PetscCall(ReadCoupledBody(c));
  else PetscCall(ReadFemBody(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
