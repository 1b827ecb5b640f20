/*
  scene_rules.c - what no single key can know: names that must match, keys that need or exclude each other.

  Only what the scene's own text decides stands here; whether a group is in a mesh file, or a step below the critical
  one, the program asks when it has the mesh and the model. Nodes with a fault of their own are skipped.
*/
#include "files.h"
#include "scene_impl.h"
#include <string.h>

#define GROUPS 6 /* of a built-in shape */

/* A file that the scene names must be there, and be a file. */
static PetscErrorCode CheckFile(Scene scene, SceneNode node)
{
  char        path[BASE_LINE], unfit[128] = "";
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCall(SceneFilePath(scene, node->text, sizeof(path), path));
  PetscCallMPI(MPI_Comm_rank(scene->comm, &rank));
  if (rank == 0 && FileUnfit(path)) PetscCall(BaseFormat(unfit, "%s", FileUnfit(path)));
  PetscCallMPI(MPI_Bcast(unfit, sizeof(unfit), MPI_CHAR, 0, scene->comm));
  if (!strcmp(unfit, "is not there")) PetscCall(SceneFaultValue(scene, node, "there is no file '%.200s' (looked for beside the scene); give its path from the scene's own folder", node->text));
  else if (unfit[0]) PetscCall(SceneFaultValue(scene, node, "'%.200s' %s; name a file", node->text, unfit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool EndsWith(const char *text, const char *end)
{
  const size_t n = strlen(text), m = strlen(end);

  return (PetscBool)(n > m && !strcmp(text + n - m, end));
}

/* Groups of a built-in shape; -1: a file's, unknown here. */
static PetscInt ShapeGroups(Scene scene, SceneNode body, const char *groups[GROUPS])
{
  static const char *const box[] = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"}, *const cylinder[] = {"bottom", "top", "side"};
  const SceneNode          geometry = SceneNodeChild(body, "geometry");
  PetscInt                 n = -1;

  if (SceneNodeChild(geometry, "box")) {
    n = scene->dimension == 2 ? 4 : 6;
    for (PetscInt k = 0; k < n; k++) groups[k] = box[k];
  } else if (SceneNodeChild(geometry, "cylinder")) {
    n = 3;
    for (PetscInt k = 0; k < n; k++) groups[k] = cylinder[k];
  } else if (SceneNodeChild(geometry, "disc")) {
    n         = 1;
    groups[0] = "side";
  }
  return n;
}

/* ---- time ---- */

static const char *TimeWord(Scene scene)
{
  static char word[32];

  SceneTimeWords(scene->time, sizeof(word), word);
  return word;
}

static PetscErrorCode CheckTime(Scene scene, SceneNode time)
{
  const SceneNode step = SceneNodeChild(time, "step");

  PetscFunctionBegin;
  if (scene->time != SCENE_IMPLICIT || !time || time->kind != NODE_MAP) PetscFunctionReturn(PETSC_SUCCESS);
  if (!step || SceneNodeIs(step, "auto")) PetscCall(SceneFaultKey(scene, step ? step : time, "an implicit run has no largest stable step to choose from; add step, a twentieth of the shortest period that matters, e.g. step: 10 us"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- bodies ---- */

static PetscErrorCode CheckUsedMaterial(Scene scene, SceneNode body)
{
  static const char *const needed[] = {"density", "young", "poisson"}, *const example[] = {"2400 kg/m3", "28 GPa", "0.2"};
  const SceneNode          name = SceneNodeChild(body, "material"), materials = SceneNodeChild(scene->root, "materials");
  const SceneNode          material = name && name->good ? SceneNodeChild(materials, name->text) : NULL;
  const char              *known[64];
  PetscInt                 n = 0;

  PetscFunctionBegin;
  if (!name || !name->good || !materials || materials->kind != NODE_MAP) PetscFunctionReturn(PETSC_SUCCESS);
  if (!material) {
    const char *nearest;

    for (SceneNode m = materials->first; m && n < 64; m = m->next) known[n++] = m->key;
    nearest = BaseNearest(name->text, n, known);
    PetscCall(SceneFaultValue(scene, name, "material '%.60s' is not in materials; %s'%.60s'", name->text, nearest ? "did you mean " : "there is ", nearest ? nearest : n ? known[0] : ""));
  } else if (material->kind == NODE_MAP) {
    const SceneNode orthotropic = SceneNodeChild(material, "orthotropic");

    for (PetscInt k = 1; k < 3 && orthotropic; k++)
      if (SceneNodeChild(material, needed[k])) PetscCall(SceneFaultKey(scene, SceneNodeChild(material, needed[k]), "%s and orthotropic exclude each other; keep one", needed[k]));
    if (orthotropic && !SceneNodeIs(SceneNodeChild(body, "method"), "fem")) PetscCall(SceneFaultKey(scene, orthotropic, "orthotropic is for finite elements, and body '%.60s' has particles; give young and poisson, or use method: fem", body->key));
    for (PetscInt k = 0; k < (orthotropic ? 1 : 3); k++)
      if (!SceneNodeChild(material, needed[k])) PetscCall(SceneFaultKey(scene, material, "material '%.60s' has no '%s', and body '%.60s' uses it; add it, e.g. %s: %s", material->key, needed[k], body->key, needed[k], example[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckGeometry(Scene scene, SceneNode body)
{
  const SceneNode geometry = SceneNodeChild(body, "geometry"), mesh = SceneNodeChild(body, "mesh"), size = SceneNodeChild(mesh, "size"), cells = SceneNodeChild(mesh, "cells"), order = SceneNodeChild(mesh, "order"), unit = SceneNodeChild(body, "length_unit"),
                  group = SceneNodeChild(body, "group");

  PetscFunctionBegin;
  if (!geometry || !geometry->good) PetscFunctionReturn(PETSC_SUCCESS);
  if (geometry->kind == NODE_TEXT) {
    const PetscBool is_mesh = EndsWith(geometry->text, ".msh");

    if (!is_mesh && !EndsWith(geometry->text, ".geo")) PetscCall(SceneFaultValue(scene, geometry, "geometry '%.200s' is neither .geo nor .msh; give a gmsh file or one of {box: ...}, {cylinder: ...}, {disc: ...}", geometry->text));
    else PetscCall(CheckFile(scene, geometry));
    if (is_mesh && size) PetscCall(SceneFaultKey(scene, size, "size: a .msh file is meshed already; take it out or give the .geo"));
    if (is_mesh && order && !SceneNodeIs(order, "auto")) PetscCall(SceneFaultKey(scene, order, "order: a .msh file is meshed already; take it out or give the .geo"));
    if (is_mesh && cells) PetscCall(SceneFaultKey(scene, cells, "cells: a .msh file is meshed already; take it out or give the .geo"));
  } else {
    if (unit) PetscCall(SceneFaultKey(scene, unit, "length_unit is of a geometry file, and this body has a built-in shape; take it out"));
    if (group) PetscCall(SceneFaultKey(scene, group, "group is of a geometry file, and this body has a built-in shape; take it out"));
    if (SceneNodeIs(SceneNodeChild(body, "method"), "fem") && !size) PetscCall(SceneFaultKey(scene, mesh ? mesh : body, "%s%.60s has no element size; add mesh: {size: 5 mm}", mesh ? "" : "body ", mesh ? "mesh" : body->key));
  }
  if (cells && cells->good && scene->dimension) {
    const PetscBool flat = (PetscBool)(SceneNodeIs(cells, "tri") || SceneNodeIs(cells, "quad"));

    if (flat != (scene->dimension == 2)) PetscCall(SceneFaultValue(scene, cells, "cells: %s in %d dimensions; allowed: %s", cells->text, (int)scene->dimension, scene->dimension == 2 ? "tri, quad" : "tet, hex"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Particles at rest: bonded, elastic, with nothing that lives on motion. */
static PetscErrorCode CheckStatic(Scene scene, SceneNode body)
{
  const SceneNode name = SceneNodeChild(body, "material"), material = name && name->text ? SceneNodeChild(SceneNodeChild(scene->root, "materials"), name->text) : NULL;
  const SceneNode law = SceneNodeChild(material, "law"), term = SceneNodeChild(material, "poisson_term"), bonded = SceneNodeChild(SceneNodeChild(body, "dem"), "bonded");
  static const char *const moving[] = {"tools", "contact"};

  PetscFunctionBegin;
  if (law && SceneNodeIs(law, "published")) PetscCall(SceneFaultValue(scene, law, "a static run of particles breaks by law: cohesive of elasticity: exact: write that, or law: elastic, or time: {method: explicit} and load slowly"));
  if (SceneNodeIs(term, "true")) PetscCall(SceneFaultValue(scene, term, "the Poisson term follows the steps of an explicit run, and this one is static: leave it out, or write time: {method: explicit}"));
  if (SceneNodeIs(bonded, "false")) PetscCall(SceneFaultValue(scene, bonded, "loose grains have no static state to solve for: write time: {method: explicit}"));
  for (PetscInt k = 0; k < 2; k++) {
    const SceneNode node = SceneNodeChild(scene->root, moving[k]);

    if (node) PetscCall(SceneFaultKey(scene, node, "a static run of particles has no %s: write time: {method: explicit}", moving[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckBody(Scene scene, SceneNode body)
{
  const SceneNode method = SceneNodeChild(body, "method"), packing = SceneNodeChild(SceneNodeChild(body, "dem"), "packing"), file = SceneNodeChild(packing, "file");

  PetscFunctionBegin;
  if (body->kind != NODE_MAP) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckUsedMaterial(scene, body));
  PetscCall(CheckGeometry(scene, body));
  if (SceneNodeIs(method, "coupled")) {
    const SceneNode geometry = SceneNodeChild(body, "geometry"), dem = SceneNodeChild(body, "dem");

    const SceneNode far = SceneNodeChild(SceneNodeChild(scene->root, "coupling"), "far_field");
    const PetscBool is_static = (PetscBool)(far && SceneNodeIs(far, "static"));

    if ((scene->time & SCENE_STATIC) && !is_static) PetscCall(SceneFaultValue(scene, method, "time.method is static: write coupling: {far_field: static} for load steps in which the particles relax, or time: {method: explicit}"));
    if (scene->time & ~(SCENE_EXPLICIT | SCENE_STATIC)) PetscCall(SceneFaultValue(scene, method, "time.method is %s, and a coupled body steps explicitly: write time: {method: explicit}", TimeWord(scene)));
    if (is_static && (scene->time & SCENE_EXPLICIT)) PetscCall(SceneFaultValue(scene, far, "far_field: static is of load steps; write time: {method: static, steps: ...}, or far_field: implicit for steps in time"));
    if (is_static && SceneNodeChild(scene->root, "tools")) PetscCall(SceneFaultKey(scene, SceneNodeChild(scene->root, "tools"), "tools move in time, and a static run has none; prescribe the motion of groups, or use far_field: implicit"));
    if (geometry && geometry->kind == NODE_MAP) PetscCall(SceneFaultKey(scene, geometry, "a coupled body needs a geometry file with a physical group for its particles; built-in shapes have none"));
    if (dem && dem->kind == NODE_MAP && !SceneNodeChild(dem, "group")) PetscCall(SceneFaultKey(scene, dem, "dem has no group; name the physical group that becomes particles, e.g. group: ligament"));
  } else if (SceneNodeChild(SceneNodeChild(body, "dem"), "group"))
    PetscCall(SceneFaultKey(scene, SceneNodeChild(SceneNodeChild(body, "dem"), "group"), "dem.group belongs to method: coupled; for a body of particles alone write group beside geometry"));
  if (scene->time == SCENE_STATIC && SceneNodeIs(method, "dem")) PetscCall(CheckStatic(scene, body));
  else if ((scene->time & ~SCENE_EXPLICIT) && SceneNodeIs(method, "dem")) PetscCall(SceneFaultValue(scene, method, "time.method is %s, and %s needs a fem body; body '%.60s' is dem: write time: {method: explicit}", TimeWord(scene), TimeWord(scene), body->key));
  if (SceneNodeIs(SceneNodeChild(SceneNodeChild(scene->root, "time"), "preload"), "static") && SceneNodeIs(method, "dem"))
    PetscCall(SceneFaultValue(scene, method, "time.preload: static needs a fem or a coupled body; body '%.60s' is %s: let the load grow slowly instead", body->key, method->text));
  if (SceneNodeChild(SceneNodeChild(body, "dem"), "rain")) {
    const SceneNode rain = SceneNodeChild(SceneNodeChild(body, "dem"), "rain");
    static const char *const other[] = {"count", "file", "porosity"};

    if (!SceneNodeIs(SceneNodeChild(SceneNodeChild(body, "dem"), "bonded"), "false")) PetscCall(SceneFaultKey(scene, rain, "a rain is of loose grains; write bonded: false beside it"));
    if (!SceneNodeChild(scene->root, "contact")) PetscCall(SceneFaultKey(scene, rain, "grains that rain need to know how they meet; add a contact section"));
    if (!SceneNodeChild(SceneNodeChild(body, "geometry"), "box")) PetscCall(SceneFaultKey(scene, rain, "grains rain from a box; write geometry: {box: ...}"));
    for (PetscInt k = 0; k < 3; k++)
      if (SceneNodeChild(packing, other[k])) PetscCall(SceneFaultKey(scene, SceneNodeChild(packing, other[k]), "%s is of grains that are there from the start; with a rain give the radius, its rate and its end", other[k]));
  }
  if (SceneNodeChild(SceneNodeChild(body, "dem"), "clump")) {
    const SceneNode clump = SceneNodeChild(SceneNodeChild(body, "dem"), "clump"), mass = SceneNodeChild(clump, "mass"), spheres = SceneNodeChild(clump, "spheres");
    static const char *const with[] = {"centre", "inertia"};

    if (!SceneNodeIs(SceneNodeChild(SceneNodeChild(body, "dem"), "bonded"), "false")) PetscCall(SceneFaultKey(scene, clump, "clumps are loose grains; write bonded: false beside it"));
    if (!SceneNodeChild(scene->root, "contact")) PetscCall(SceneFaultKey(scene, clump, "clumps need to know how they meet; add a contact section"));
    if (spheres && !spheres->first) PetscCall(SceneFaultKey(scene, spheres, "a clump has at least one sphere, e.g. {at: [0 mm, 0 mm, 0 mm], radius: 1 mm}"));
    for (PetscInt k = 0; k < 2; k++) {
      if (mass && !SceneNodeChild(clump, with[k])) PetscCall(SceneFaultKey(scene, mass, "mass alone does not say how the clump turns; add %s", with[k]));
      if (!mass && SceneNodeChild(clump, with[k])) PetscCall(SceneFaultKey(scene, SceneNodeChild(clump, with[k]), "%s goes with mass; add it, or take this out: the union of the spheres has its own", with[k]));
    }
  }
  if (SceneNodeChild(packing, "porosity") && !SceneNodeIs(SceneNodeChild(SceneNodeChild(body, "dem"), "bonded"), "false"))
    PetscCall(SceneFaultKey(scene, SceneNodeChild(packing, "porosity"), "porosity is of loose grains; write bonded: false beside packing, or take it out: bonded particles fill the body"));
  if (file && file->good) {
    static const char *const made[] = {"spread", "seed", "porosity"};

    for (PetscInt k = 0; k < 3; k++) {
      const SceneNode key = SceneNodeChild(packing, made[k]);

      if (key) PetscCall(SceneFaultKey(scene, key, "%s is of a packing we make, and file brings its own; take one out", made[k]));
    }
    PetscCall(CheckFile(scene, file));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A breaking law and its numbers go together. */
static PetscErrorCode CheckStrength(Scene scene, SceneNode material)
{
  static const char *const numbers[] = {"tensile_strength", "fracture_energy", "shear_strength", "fracture_energy_shear", "mu_static", "mu_dynamic", "softening", "criterion"};
  static const char *const published[] = {"delta_n", "delta_s", "compression"};
  const SceneNode          law = SceneNodeChild(material, "law"), shear = SceneNodeChild(material, "shear_strength"), shear_energy = SceneNodeChild(material, "fracture_energy_shear");
  const PetscBool          cohesive = SceneNodeIs(law, "cohesive"), springs = SceneNodeIs(law, "published");

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 8; k++) {
    const SceneNode number = SceneNodeChild(material, numbers[k]);

    if (cohesive && k < 2 && !number) PetscCall(SceneFaultKey(scene, law, "law: cohesive needs %s; add it, e.g. %s: %s", numbers[k], numbers[k], k ? "143 J/m2" : "3 MPa"));
    if (springs && k == 6 && number) PetscCall(SceneFaultKey(scene, number, "softening belongs to law: cohesive; law: published softens along a straight line"));
    if (!cohesive && !springs && number && number->row && !(number->row->flags & SCENE_LATER)) PetscCall(SceneFaultKey(scene, number, "%s acts with law: cohesive or published only; add that or take it out", numbers[k]));
  }
  for (PetscInt k = 0; k < 3; k++)
    if (!springs && SceneNodeChild(material, published[k])) PetscCall(SceneFaultKey(scene, SceneNodeChild(material, published[k]), "%s acts with law: published only; add that or take it out", published[k]));
  if (cohesive && !shear != !shear_energy) PetscCall(SceneFaultKey(scene, shear ? shear : shear_energy, "shear_strength and fracture_energy_shear go together; give both or neither"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Exactly one of two softening numbers beside a strength, under law: published. */
static PetscErrorCode CheckEnd(Scene scene, SceneNode material, const char *strength, const char *delta, const char *energy)
{
  const SceneNode s = SceneNodeChild(material, strength), d = SceneNodeChild(material, delta), e = SceneNodeChild(material, energy);

  PetscFunctionBegin;
  if (s && !d == !e) PetscCall(SceneFaultKey(scene, s, "%s of law: published needs one of %s and %s; %s", strength, delta, energy, d ? "take one out" : "add one"));
  if (!s && (d || e)) PetscCall(SceneFaultKey(scene, d ? d : e, "%s goes with %s; add that or take it out", d ? delta : energy, strength));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bonds' rule, its own numbers, and the law it can carry. */
static PetscErrorCode CheckElasticity(Scene scene, SceneNode material)
{
  static const struct {
    const char *key, *rules;
  } own[] = {{"interaction_range", "onate2015 given"}, {"area_factor", "onate2015 given"}, {"factor_normal", "onate2015 kdem"}, {"factor_shear", "onate2015 kdem"},
             {"stiffness_normal", "given"},           {"stiffness_shear", "given"},       {"poisson_term", "kdem"}, {"areas", "kdem"}};
  const PetscBool          polyhedron = SceneNodeIs(SceneNodeChild(material, "areas"), "polyhedron");
  static const char *const stiffness[] = {"stiffness_normal", "stiffness_shear"};
  const SceneNode          rule = SceneNodeChild(material, "elasticity"), law = SceneNodeChild(material, "law"), compression = SceneNodeChild(material, "compression");
  const char              *name = rule && rule->kind == NODE_TEXT && rule->good ? rule->text : "exact";

  PetscFunctionBegin;
  if (rule && !rule->good) PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t k = 0; k < sizeof(own) / sizeof(own[0]); k++)
    if (SceneNodeChild(material, own[k].key) && !strstr(own[k].rules, name) && !(k == 0 && polyhedron)) PetscCall(SceneFaultKey(scene, SceneNodeChild(material, own[k].key), "%s belongs to elasticity: %s, and here it is %s; take it out", own[k].key, own[k].rules, name));
  for (PetscInt k = 0; k < 2; k++)
    if (!strcmp(name, "given") && !SceneNodeChild(material, stiffness[k])) PetscCall(SceneFaultKey(scene, rule, "elasticity: given needs %s; add it, e.g. %s: 10 MN/m", stiffness[k], stiffness[k]));
  if (!strcmp(name, "exact") && SceneNodeIs(law, "published")) PetscCall(SceneFaultValue(scene, law, "law: published breaks springs; with elasticity: exact write law: cohesive, or choose elasticity: onate2015, kdem or given"));
  if (strcmp(name, "exact") && SceneNodeIs(law, "cohesive")) PetscCall(SceneFaultValue(scene, law, "law: cohesive breaks the facets of elasticity: exact; with %s write law: published", name));
  if (SceneNodeIs(law, "published")) {
    PetscCall(CheckEnd(scene, material, "tensile_strength", "delta_n", "fracture_energy"));
    PetscCall(CheckEnd(scene, material, "shear_strength", "delta_s", "fracture_energy_shear"));
    if (!SceneNodeChild(material, "tensile_strength") && !SceneNodeChild(material, "shear_strength")) PetscCall(SceneFaultKey(scene, law, "law: published needs tensile_strength or shear_strength; add one, e.g. tensile_strength: 3 MPa"));
  }
  if (compression && compression->kind == NODE_MAP) {
    const char *const stress[] = {"lcs1", "lcs2", "lcs3"}, *const divisor[] = {"yrc1", "yrc2", "yrc3"};

    for (PetscInt k = 1; k < 3; k++) {
      const SceneNode s = SceneNodeChild(compression, stress[k]), d = SceneNodeChild(compression, divisor[k]), before = SceneNodeChild(compression, stress[k - 1]);

      if (!s != !d) PetscCall(SceneFaultKey(scene, s ? s : d, "%s and %s go together; give both or neither", stress[k], divisor[k]));
      if (s && !before) PetscCall(SceneFaultKey(scene, s, "%s without %s; branches are given in order", stress[k], stress[k - 1]));
      if (s && s->good && before && before->good && s->value <= before->value) PetscCall(SceneFaultValue(scene, s, "%s is not above %s; the branches' stresses must rise", stress[k], stress[k - 1]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- groups ---- */

/*
  A group named at `node`: known to one body (only_body, or any)? With only built-in shapes the names are known here.
  tools: a tool's name will do too. single: two bodies that have it are ambiguous.
*/
static PetscErrorCode CheckGroup(Scene scene, SceneNode node, const char *group, const char *only_body, PetscBool tools, PetscBool single)
{
  const SceneNode bodies = SceneNodeChild(scene->root, "bodies"), tool = SceneNodeChild(scene->root, "tools");
  const char     *known[64], *nearest, *owner[2] = {NULL, NULL};
  char            all[BASE_LINE / 4] = "";
  PetscInt        n = 0, found = 0;

  PetscFunctionBegin;
  if (!bodies || bodies->kind != NODE_MAP || !scene->dimension) PetscFunctionReturn(PETSC_SUCCESS);
  for (SceneNode body = bodies->first; body; body = body->next) {
    const char *names[GROUPS];
    PetscInt    m;

    if (only_body && strcmp(only_body, body->key)) continue;
    m = ShapeGroups(scene, body, names);
    if (m < 0) PetscFunctionReturn(PETSC_SUCCESS); /* a file's groups, asked when it is read */
    for (PetscInt k = 0; k < m; k++) {
      PetscBool new = PETSC_TRUE;

      for (PetscInt j = 0; j < n; j++)
        if (!strcmp(known[j], names[k])) new = PETSC_FALSE;
      if (new && n < 32) known[n++] = names[k];
      if (!strcmp(names[k], group) && found < 2) owner[found++] = body->key;
    }
  }
  if (tools && tool && tool->kind == NODE_MAP)
    for (SceneNode t = tool->first; t && n < 64; t = t->next) {
      known[n++] = t->key;
      if (!strcmp(t->key, group)) found = PetscMax(found, 1);
    }
  for (PetscInt k = 0; k < n; k++) {
    const size_t used = strlen(all);

    snprintf(all + used, sizeof(all) - used, "%s%s", k ? ", " : "", known[k]);
  }
  nearest = BaseNearest(group, n, known);
  if (!found) PetscCall(SceneFaultValue(scene, node, "group '%.60s' is not there; %s%s%sallowed: %s", group, nearest ? "did you mean '" : "", nearest ? nearest : "", nearest ? "'? " : "", all));
  else if (single && !only_body && found > 1) PetscCall(SceneFaultValue(scene, node, "group '%.60s' is in bodies '%.60s' and '%.60s'; add body: %.60s or body: %.60s", group, owner[0], owner[1], owner[0], owner[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- conditions ---- */

static const char *const components[] = {"x", "y", "z"};

static PetscBool Fixes(SceneNode fix, PetscInt c)
{
  if (SceneNodeIs(fix, components[c]) || SceneNodeIs(fix, "all")) return PETSC_TRUE;
  if (fix && fix->kind == NODE_LIST)
    for (SceneNode item = fix->first; item; item = item->next)
      if (SceneNodeIs(item, components[c]) || SceneNodeIs(item, "all")) return PETSC_TRUE;
  return PETSC_FALSE;
}

/* The keys of a condition that prescribe component c: fix, velocity.c, displacement.c. */
static PetscInt Prescribes(SceneNode condition, PetscInt c, SceneNode who[3])
{
  const SceneNode fix = SceneNodeChild(condition, "fix"), velocity = SceneNodeChild(SceneNodeChild(condition, "velocity"), components[c]), displacement = SceneNodeChild(SceneNodeChild(condition, "displacement"), components[c]);
  PetscInt        n = 0;

  if (Fixes(fix, c)) who[n++] = fix;
  if (velocity) who[n++] = velocity;
  if (displacement) who[n++] = displacement;
  return n;
}

static const char *MotionWord(SceneNode node)
{
  return node->key && strlen(node->key) == 1 ? node->parent->key : node->key;
}

static PetscErrorCode CheckMotions(Scene scene, SceneNode condition, PetscInt index)
{
  const SceneNode group = SceneNodeChild(condition, "group"), body = SceneNodeChild(condition, "body");

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 3; c++) {
    SceneNode      who[3], earlier[3], other = condition->parent->first;
    const PetscInt n = Prescribes(condition, c, who);

    if (n > 1) PetscCall(SceneFaultKey(scene, who[1], "%s and %s of the same component %s exclude each other; keep one", MotionWord(who[0]), MotionWord(who[1]), components[c]));
    if (!n || !group || group->kind != NODE_TEXT) continue;
    for (PetscInt i = 0; i < index; i++, other = other->next) {
      const SceneNode its_body = SceneNodeChild(other, "body");

      if (!SceneNodeIs(SceneNodeChild(other, "group"), group->text)) continue;
      if (body && its_body && body->kind == NODE_TEXT && !SceneNodeIs(its_body, body->text)) continue;
      if (!Prescribes(other, c, earlier)) continue;
      PetscCall(SceneFaultKey(scene, who[0], "component %s of group '%.60s' is prescribed twice, first in conditions[%d]; keep one", components[c], group->text, (int)i));
      break;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckCondition(Scene scene, SceneNode condition, PetscInt index)
{
  static const char *const acts[] = {"fix", "symmetry", "velocity", "displacement", "traction", "pressure", "force", "line_load", "absorb", "plane"};
  const SceneNode          group = SceneNodeChild(condition, "group"), body = SceneNodeChild(condition, "body"), gravity = SceneNodeChild(condition, "gravity"), fix = SceneNodeChild(condition, "fix"),
                  bodies = SceneNodeChild(scene->root, "bodies");
  PetscBool body_good = PETSC_TRUE;
  PetscInt  n = 0;

  PetscFunctionBegin;
  if (condition->kind != NODE_MAP) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < 10; k++) {
    const SceneNode act = SceneNodeChild(condition, acts[k]);

    if (!act || SceneNodeIs(act, "false")) continue;
    n++;
    if (act->kind == NODE_MAP && !act->n && k < 9) PetscCall(SceneFaultKey(scene, act, "%s is empty; name a component, e.g. %s: {y: ...}", acts[k], acts[k]));
    if (act->kind == NODE_LIST && !act->n) PetscCall(SceneFaultValue(scene, act, "%s is empty; name a component, e.g. %s: [x, y]", acts[k], acts[k]));
    if (gravity) PetscCall(SceneFaultKey(scene, act, "gravity acts on every body and stands alone; give %s its own condition", acts[k]));
  }
  if (gravity && group) PetscCall(SceneFaultKey(scene, group, "gravity acts on every body; take the group out"));
  if (gravity && body) PetscCall(SceneFaultKey(scene, body, "gravity acts on every body; take the body out"));
  if (gravity) PetscFunctionReturn(PETSC_SUCCESS);
  if (!n) PetscCall(SceneFaultKey(scene, condition, "conditions[%d] does nothing; give one of fix, symmetry, velocity, displacement, traction, pressure, force, line_load, absorb, plane, gravity", (int)index));
  if (n && !group) PetscCall(SceneFaultKey(scene, condition, "conditions[%d] has no 'group'; name the group it acts on", (int)index));
  if (fix && scene->dimension == 2) {
    if (SceneNodeIs(fix, "z")) PetscCall(SceneFaultValue(scene, fix, "fix: z, but the scene has dimension: 2; allowed: x, y, all"));
    for (SceneNode item = fix->first; item; item = item->next)
      if (SceneNodeIs(item, "z")) PetscCall(SceneFaultValue(scene, item, "fix: z, but the scene has dimension: 2; allowed: x, y, all"));
  }
  if (body && body->good && bodies && bodies->kind == NODE_MAP && !SceneNodeChild(bodies, body->text)) {
    const char *known[64], *nearest;
    PetscInt    m = 0;

    for (SceneNode b = bodies->first; b && m < 64; b = b->next) known[m++] = b->key;
    nearest = BaseNearest(body->text, m, known);
    PetscCall(SceneFaultValue(scene, body, "body '%.60s' is not in bodies; %s'%.60s'", body->text, nearest ? "did you mean " : "there is ", nearest ? nearest : m ? known[0] : ""));
    body_good = PETSC_FALSE;
  }
  if (group && group->good && body_good) PetscCall(CheckGroup(scene, group, group->text, body && body->good ? body->text : NULL, PETSC_FALSE, PETSC_TRUE));
  PetscCall(CheckMotions(scene, condition, index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- the rest ---- */

/* A direction of no length, and motions that exclude each other. */
static PetscErrorCode CheckTool(Scene scene, SceneNode tool)
{
  static const char *const arrow[][2] = {{"plane", "normal"}, {"disc", "normal"}, {"cylinder", "axis"}, {"rotation", "axis"}, {"push", "axis"}, {"twist", "axis"}};
  static const char *const moves[] = {"rotation", "push", "twist"}; /* a velocity of zero stands in every resolved scene; the model refuses another */
  const SceneNode          free = SceneNodeChild(tool, "free"), density = SceneNodeChild(free, "density"), mass = SceneNodeChild(free, "mass"), rotation = SceneNodeChild(tool, "rotation"), twist = SceneNodeChild(tool, "twist"),
                  damping = SceneNodeChild(tool, "damping"), restitution = SceneNodeChild(tool, "restitution"), law = SceneNodeChild(tool, "law"), friction = SceneNodeChild(tool, "friction"), rest = SceneNodeChild(tool, "static_friction");
  const char     *inertia = scene->dimension == 2 ? "inertia_z" : "inertia";
  const SceneNode moment  = SceneNodeChild(free, inertia);

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 6; k++) {
    const SceneNode a = SceneNodeChild(SceneNodeChild(tool, arrow[k][0]), arrow[k][1]);
    PetscReal       length = 0;

    if (!a || !a->good) continue;
    for (SceneNode item = a->first; item; item = item->next) length += PetscAbsReal(item->value);
    if (length == 0) PetscCall(SceneFaultValue(scene, a, "%s has length zero; give a direction, e.g. %s", arrow[k][1], scene->dimension == 2 ? "[0, 1]" : "[0, 0, 1]"));
  }
  for (PetscInt k = 0; free && k < 3; k++) {
    const SceneNode move = SceneNodeChild(tool, moves[k]);

    if (move) PetscCall(SceneFaultKey(scene, move, "a tool that is free takes no %s; take one of them out", moves[k]));
  }
  if (rotation && twist) PetscCall(SceneFaultKey(scene, twist, "rotation prescribes what twist would drive; keep one"));
  if (mass && !moment) PetscCall(SceneFaultKey(scene, mass, "mass needs %s beside it; give both, or a density for a closed surface", inertia));
  if (density && moment) PetscCall(SceneFaultKey(scene, moment, "the density gives the inertia; take one of them out"));
  if (density && !SceneNodeChild(tool, "surface") && !SceneNodeChild(tool, "box")) PetscCall(SceneFaultKey(scene, density, "a density needs a closed surface or a box; give mass and %s instead", inertia));
  if (density && SceneNodeChild(tool, "centre")) PetscCall(SceneFaultKey(scene, SceneNodeChild(tool, "centre"), "the density gives the centre of mass; take centre out"));
  if (damping && damping->good && damping->value > 0 && restitution && restitution->good && restitution->value < 1) PetscCall(SceneFaultKey(scene, damping, "damping stands in place of restitution; keep one"));
  if (SceneNodeIs(law, "hertz") && scene->dimension == 2) PetscCall(SceneFaultValue(scene, law, "hertz is the law of spheres; with dimension: 2 use linear"));
  if (rest && rest->good && rest->value > 0 && rest->value < (friction && friction->good ? friction->value : 0)) PetscCall(SceneFaultValue(scene, rest, "static_friction is less than friction; it must be at least that, or left out"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckTools(Scene scene, SceneNode tools, SceneNode bodies)
{
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  if (!tools || tools->kind != NODE_MAP || !bodies || bodies->kind != NODE_MAP) PetscFunctionReturn(PETSC_SUCCESS);
  for (SceneNode body = bodies->first; body; body = body->next) {
    const SceneNode method = SceneNodeChild(body, "method");

    if (!SceneNodeIs(method, "fem")) any = PETSC_TRUE;
  }
  if (tools->n && !any) PetscCall(SceneFaultKey(scene, tools, "tools meet particles only, and no body has method: dem; use conditions on the body's groups"));
  for (SceneNode tool = tools->first; tool; tool = tool->next) PetscCall(CheckTool(scene, tool));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contact among particles: someone to meet, a law that fits, corners where they are needed. */
static PetscErrorCode CheckContact(Scene scene, SceneNode contact, SceneNode bodies)
{
  const SceneNode domain = SceneNodeChild(contact, "domain"), law = SceneNodeChild(contact, "law"), friction = SceneNodeChild(contact, "friction"), rest = SceneNodeChild(contact, "static_friction");
  const PetscBool bounded = (PetscBool)(SceneNodeIs(domain, "box") || SceneNodeIs(domain, "periodic"));
  PetscBool       any = PETSC_FALSE;

  PetscFunctionBegin;
  if (!contact || contact->kind != NODE_MAP || !bodies || bodies->kind != NODE_MAP) PetscFunctionReturn(PETSC_SUCCESS);
  for (SceneNode body = bodies->first; body; body = body->next) any = (PetscBool)(any || !SceneNodeIs(SceneNodeChild(body, "method"), "fem"));
  if (!any) PetscCall(SceneFaultKey(scene, contact, "contact is between particles, and no body has method: dem; take it out"));
  if (SceneNodeIs(law, "hertz") && scene->dimension == 2) PetscCall(SceneFaultValue(scene, law, "hertz is the law of spheres; with dimension: 2 use linear"));
  if (rest && rest->good && rest->value > 0 && rest->value < (friction && friction->good ? friction->value : 0)) PetscCall(SceneFaultValue(scene, rest, "static_friction is less than friction; it must be at least that, or left out"));
  for (PetscInt k = 0; k < 2; k++) {
    const SceneNode corner = SceneNodeChild(contact, k ? "high" : "low");

    if (bounded && !corner) PetscCall(SceneFaultValue(scene, domain, "domain: %s needs both corners, contact.low and contact.high", domain->text));
    if (!bounded && corner) PetscCall(SceneFaultKey(scene, corner, "%s is a corner of domain: box or periodic; take it out or name the domain", k ? "high" : "low"));
  }
  if (bounded) {
    const SceneNode low = SceneNodeChild(contact, "low"), high = SceneNodeChild(contact, "high");

    if (low && high && low->good && high->good)
      for (SceneNode a = low->first, b = high->first; a && b; a = a->next, b = b->next)
        if (b->value < a->value || (b->value == a->value && SceneNodeIs(domain, "box"))) {
          PetscCall(SceneFaultValue(scene, high, "high lies below low along an axis; high must be the larger"));
          break;
        }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The group within "reaction(load)", or the two within "strain(top, bottom)". */
static PetscErrorCode CheckQuantity(Scene scene, SceneNode node)
{
  const char *open = node->kind == NODE_TEXT ? strchr(node->text, '(') : NULL;
  char        group[BASE_LINE / 2], *comma;
  size_t      n;
  static const char *const of_tools[] = {"force(", "torque(", "work("};

  PetscFunctionBegin;
  if (!open || !node->good || !open[1]) PetscFunctionReturn(PETSC_SUCCESS);
  n = strlen(open + 1) - 1;
  memcpy(group, open + 1, n);
  group[n] = 0;
  for (PetscInt k = 0; k < 3; k++) {
    const SceneNode tools = SceneNodeChild(scene->root, "tools");

    if (!strncmp(node->text, of_tools[k], strlen(of_tools[k])) && !(tools && tools->kind == NODE_MAP && SceneNodeChild(tools, group)))
      PetscCall(SceneFaultValue(scene, node, "%s) is of a tool, and '%.60s' is none; of a body's group ask reaction(%.60s)", of_tools[k], group, group));
  }
  if (strncmp(node->text, "strain", 6)) {
    PetscCall(CheckGroup(scene, node, group, NULL, PETSC_TRUE, PETSC_FALSE));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  comma = strchr(group, ',');
  if (!comma) PetscCall(SceneFaultValue(scene, node, "%.200s: a strain is the elongation between two groups; name both: strain(bottom, top)", node->text));
  else {
    const char *second = comma + 1 + strspn(comma + 1, " ");

    while (comma > group && comma[-1] == ' ') comma--;
    *comma = 0;
    PetscCall(CheckGroup(scene, node, group, NULL, PETSC_TRUE, PETSC_FALSE));
    PetscCall(CheckGroup(scene, node, second, NULL, PETSC_TRUE, PETSC_FALSE));
    if (!strcmp(group, second)) PetscCall(SceneFaultValue(scene, node, "%.200s: a strain needs two different groups", node->text));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fields that only one method has; asked of the other they would be missing in silence. */
static PetscErrorCode CheckField(Scene scene, SceneNode node, SceneNode bodies)
{
  const PetscBool of_dem = (PetscBool)(SceneNodeIs(node, "rotation") || SceneNodeIs(node, "orientation") || SceneNodeIs(node, "damage") || SceneNodeIs(node, "criterion") || SceneNodeIs(node, "coordination") || SceneNodeIs(node, "fragment") || SceneNodeIs(node, "bonds")), of_fem = (PetscBool)(SceneNodeIs(node, "reaction") || SceneNodeIs(node, "von_mises") || SceneNodeIs(node, "principal_stress") || SceneNodeIs(node, "error") || SceneNodeIs(node, "element_stress") || SceneNodeIs(node, "element_strain"));

  PetscFunctionBegin;
  if (!(of_dem || of_fem) || !bodies || bodies->kind != NODE_MAP) PetscFunctionReturn(PETSC_SUCCESS);
  for (SceneNode body = bodies->first; body; body = body->next)
    if (!SceneNodeIs(SceneNodeChild(body, "method"), of_dem ? "fem" : "dem")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SceneFaultValue(scene, node, "field %s belongs to method: %s, and no body has it; take it out", node->text, of_dem ? "dem" : "fem"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What only finite elements have: probes, the error. */
static PetscErrorCode CheckElements(Scene scene, SceneNode node, const char *what, SceneNode bodies)
{
  PetscFunctionBegin;
  if (!node || !bodies || bodies->kind != NODE_MAP) PetscFunctionReturn(PETSC_SUCCESS);
  for (SceneNode body = bodies->first; body; body = body->next)
    if (!SceneNodeIs(SceneNodeChild(body, "method"), "dem")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SceneFaultKey(scene, node, "%s of finite elements, and every body has method: dem; take it out", what));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ways of joining that are there for comparison, and an absorber, go with the plainest of steps. */
static PetscErrorCode CheckMethod(Scene scene, SceneNode coupling)
{
  const SceneNode method = SceneNodeChild(coupling, "method"), absorber = SceneNodeChild(coupling, "absorber"), penalty = SceneNodeChild(coupling, "penalty"), far = SceneNodeChild(coupling, "far_field");
  const SceneNode steps = SceneNodeChild(coupling, "substeps");
  const PetscBool other = (PetscBool)(SceneNodeIs(method, "consistent") || SceneNodeIs(method, "penalty")), absorbs = SceneNodeIs(absorber, "true");

  PetscFunctionBegin;
  if (penalty && !SceneNodeIs(method, "penalty")) PetscCall(SceneFaultKey(scene, penalty, "this stiffness belongs to method: penalty; add it, or take it out"));
  if (!other && !absorbs) PetscFunctionReturn(PETSC_SUCCESS);
  if (other && absorbs) PetscCall(SceneFaultValue(scene, absorber, "the absorber belongs to the springs of method: energy, and method is %s; take one out", method->text));
  if (other && SceneNodeChild(coupling, "switch")) PetscCall(SceneFaultValue(scene, method, "method: %s is there for comparison and does not go with coupling.switch; use method: energy", method->text));
  if (far && !SceneNodeIs(far, "explicit"))
    PetscCall(SceneFaultValue(scene, far, "far_field: %s does not go with %s: all steps explicitly then; use far_field: explicit", far->text, other ? "this method" : "absorber: true"));
  if (steps && !SceneNodeIs(steps, "1") && !SceneNodeIs(steps, "auto"))
    PetscCall(SceneFaultValue(scene, steps, "substeps: %s does not go with %s: both sides take one step then; use substeps: 1", steps->text, other ? "this method" : "absorber: true"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What turns must be able to break: without a strength there is nothing to be near to. */
static PetscErrorCode CheckSwitch(Scene scene, SceneNode turn, SceneNode bodies)
{
  const SceneNode far = SceneNodeChild(SceneNodeChild(scene->root, "coupling"), "far_field");

  PetscFunctionBegin;
  if (!turn) PetscFunctionReturn(PETSC_SUCCESS);
  if (far && !SceneNodeIs(far, "explicit")) PetscCall(SceneFaultValue(scene, far, "far_field: %s does not go with coupling.switch: its matrix would have to be made anew at every event; use explicit", far->text));
  if (SceneNodeIs(SceneNodeChild(turn, "when"), "given") && !SceneNodeChild(turn, "given"))
    PetscCall(SceneFaultKey(scene, SceneNodeChild(turn, "when"), "a given criterion needs its numbers, as in given: {mean: 0.5, mises: 1, strength: 5 MPa}"));
  if (SceneNodeChild(turn, "given") && !SceneNodeIs(SceneNodeChild(turn, "when"), "given")) PetscCall(SceneFaultKey(scene, SceneNodeChild(turn, "given"), "these numbers belong to when: given; add it, or take them out"));
  for (SceneNode body = bodies->first; body; body = body->next) {
    const SceneNode name = SceneNodeChild(body, "material"), material = name && name->good ? SceneNodeChild(SceneNodeChild(scene->root, "materials"), name->text) : NULL;

    if (material && !SceneNodeIs(SceneNodeChild(material, "law"), "cohesive"))
      PetscCall(SceneFaultKey(scene, turn, "elements turn when they near their strength, and material '%.60s' never breaks; give it law: cohesive, or take switch out", material->key));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneRules(Scene scene)
{
  const SceneNode root = scene->root, bodies = SceneNodeChild(root, "bodies"), materials = SceneNodeChild(root, "materials"), fields = SceneNodeChild(SceneNodeChild(SceneNodeChild(root, "output"), "fields"), "names"), conditions = SceneNodeChild(root, "conditions"), quantities = SceneNodeChild(SceneNodeChild(SceneNodeChild(root, "output"), "history"), "quantities");
  PetscInt        i = 0;

  PetscFunctionBegin;
  PetscCall(CheckTime(scene, SceneNodeChild(root, "time")));
  if (bodies && bodies->kind == NODE_MAP) {
    const SceneNode coupling = SceneNodeChild(scene->root, "coupling");
    PetscBool       coupled = PETSC_FALSE;

    for (SceneNode body = bodies->first; body; body = body->next) {
      PetscCall(CheckBody(scene, body));
      coupled = (PetscBool)(coupled || SceneNodeIs(SceneNodeChild(body, "method"), "coupled"));
    }
    if (coupled && coupling) PetscCall(CheckMethod(scene, coupling));
    if (coupled) PetscCall(CheckSwitch(scene, SceneNodeChild(coupling, "switch"), bodies));
    if (coupling && !coupled) PetscCall(SceneFaultKey(scene, coupling, "coupling joins elements and particles, and no body has method: coupled; take it out"));
  }
  if (conditions && conditions->kind == NODE_LIST)
    for (SceneNode condition = conditions->first; condition; condition = condition->next) PetscCall(CheckCondition(scene, condition, i++));
  PetscCall(CheckTools(scene, SceneNodeChild(root, "tools"), bodies));
  PetscCall(CheckContact(scene, SceneNodeChild(root, "contact"), bodies));
  if (materials && materials->kind == NODE_MAP)
    for (SceneNode material = materials->first; material; material = material->next) {
      PetscCall(CheckStrength(scene, material));
      PetscCall(CheckElasticity(scene, material));
    }
  if (fields) {
    PetscCall(CheckField(scene, fields, bodies));
    for (SceneNode item = fields->first; item; item = item->next) PetscCall(CheckField(scene, item, bodies));
  }
  PetscCall(CheckElements(scene, SceneNodeChild(SceneNodeChild(root, "output"), "probes"), "probes are points", bodies));
  if (quantities) {
    if (quantities->kind == NODE_TEXT) PetscCall(CheckQuantity(scene, quantities));
    if (SceneNodeIs(quantities, "error")) PetscCall(CheckElements(scene, quantities, "error is the estimate", bodies));
    for (SceneNode item = quantities->first; item; item = item->next) {
      PetscCall(CheckQuantity(scene, item));
      if (SceneNodeIs(item, "error")) PetscCall(CheckElements(scene, item, "error is the estimate", bodies));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
