/* scene_values.c - reading a scene in its stages, and what the program asks of it afterwards. */
#include "scene_impl.h"
#include <string.h>

PetscErrorCode SceneRead(MPI_Comm comm, const char *file, PetscInt n_overrides, const char *const overrides[], Scene *scene)
{
  Scene          s;
  char          *text;
  size_t         length;
  PetscErrorCode code;

  PetscFunctionBegin;
  *scene = NULL;
  PetscCall(PetscNew(&s));
  s->comm = comm;
  PetscCall(PetscStrallocpy(file, &s->file));
  PetscCall(PetscCalloc1(n_overrides + 1, &s->sets));
  for (; s->n_sets < n_overrides; s->n_sets++) PetscCall(PetscStrallocpy(overrides[s->n_sets], &s->sets[s->n_sets]));
  PetscCall(SceneNodeCreate(NODE_MAP, NULL, &s->spare));

  PetscCall(SceneReadFile(s, &text, &length));
  if (text) PetscCall(SceneParse(s, text, length, NULL, &s->root));
  PetscCall(PetscFree(text));
  if (s->root) {
    if (s->root->kind == NODE_MAP)
      for (PetscInt k = 0; k < n_overrides; k++) PetscCall(SceneOverride(s, s->sets[k]));
    PetscCall(SceneCheck(s));
    if (s->root->kind == NODE_MAP) PetscCall(SceneRules(s));
  }
  code = SceneFaultsRaise(s);
  if (code) PetscCall(SceneDestroy(&s));
  PetscCall(code);
  PetscCall(SceneFill(s));
  *scene = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneDestroy(Scene *scene)
{
  Scene s = *scene;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SceneNodeDestroy(&s->root));
  PetscCall(SceneNodeDestroy(&s->spare));
  for (PetscInt k = 0; k < s->n_sets; k++) PetscCall(PetscFree(s->sets[k]));
  for (PetscInt k = 0; k < SCENE_FAULTS; k++) PetscCall(PetscFree(s->fault[k].text));
  PetscCall(PetscFree(s->sets));
  PetscCall(PetscFree(s->file));
  PetscCall(PetscFree(*scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- places ---- */

/* The node at a path, NULL when there is none; *nearest: the deepest node of the user's on the way. */
static SceneNode Walk(Scene scene, const char *path, SceneNode *nearest)
{
  SceneNode at = scene->root;

  *nearest = at;
  while (at && *path) {
    if (*path == '[') {
      int i = -1, used = 0;

      if (sscanf(path, "[%d]%n", &i, &used) != 1 || !used) return NULL;
      at = SceneNodeItem(at, i);
      path += used;
    } else {
      const size_t n = strcspn(path, ".[");
      char         name[BASE_LINE];

      if (n == 0 || n >= sizeof(name)) return NULL;
      memcpy(name, path, n);
      name[n] = 0;
      at      = SceneNodeChild(at, name);
      path += n;
    }
    if (*path == '.') path++;
    if (at && at->source == SOURCE_USER) *nearest = at;
  }
  return at;
}

PetscErrorCode SceneFail(Scene scene, const char *path, const char *format, ...)
{
  SceneNode      nearest;
  const SceneNode node = Walk(scene, path, &nearest);
  const PetscBool at_value = (PetscBool)(node == nearest && node->kind == NODE_TEXT);
  char           text[1024], line[1536];
  va_list        args;

  va_start(args, format);
  vsnprintf(text, sizeof(text), format, args);
  va_end(args);
  if (nearest->set) snprintf(line, sizeof(line), "--set %.200s: error: %s", nearest->set, text);
  else snprintf(line, sizeof(line), "%.400s:%d:%d: error: %s", scene->file, (int)(at_value ? nearest->line : nearest->key_line), (int)(at_value ? nearest->column : nearest->key_column), text);
  BaseReport(scene->comm, line);
  return PetscError(scene->comm, __LINE__, PETSC_FUNCTION_NAME, __FILE__, PETSC_ERR_USER_INPUT, PETSC_ERROR_INITIAL, "%s", line);
}

static PetscErrorCode KnownKey(const char *path, const SceneKey **row)
{
  PetscFunctionBegin;
  *row = SceneKeyFind(path);
  PetscCheck(*row, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "'%s' is not a key of scenes; the table is in base/scene_keys.c", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The user's node, else one that holds the default; NULL when there is neither. */
static PetscErrorCode Find(Scene scene, const char *path, const SceneKey **row, SceneNode *node)
{
  SceneNode nearest;

  PetscFunctionBegin;
  PetscCall(KnownKey(path, row));
  *node = Walk(scene, path, &nearest);
  if (!*node && (*row)->preset) {
    *node = SceneNodeChild(scene->spare, path);
    if (!*node) {
      PetscCall(SceneDefaultNode(scene, *row, scene->spare, node));
      PetscCall(PetscFree((*node)->key));
      PetscCall(PetscStrallocpy(path, &(*node)->key));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same, when the value must be there and of one of two types. */
static PetscErrorCode Need(Scene scene, const char *path, SceneType a, SceneType b, SceneNode *node)
{
  const SceneKey *row;

  PetscFunctionBegin;
  PetscCall(Find(scene, path, &row, node));
  PetscCheck(row->type == a || row->type == b, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "Key %s is of another type than asked for", path);
  if (!*node) PetscCall(SceneFail(scene, path, "'%s' is needed here and has no default; add it", path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- getters ---- */

PetscErrorCode SceneHas(Scene scene, const char *path, PetscBool *has)
{
  const SceneKey *row;
  SceneNode       node, nearest;

  PetscFunctionBegin;
  PetscCall(KnownKey(path, &row));
  node = Walk(scene, path, &nearest);
  *has = (PetscBool)(node && node->source == SOURCE_USER);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneGetReal(Scene scene, const char *path, PetscReal *value)
{
  SceneNode node;

  PetscFunctionBegin;
  PetscCall(Need(scene, path, SCENE_REAL, SCENE_INT, &node));
  *value = node->value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneGetInt(Scene scene, const char *path, PetscInt *value)
{
  SceneNode node;

  PetscFunctionBegin;
  PetscCall(Need(scene, path, SCENE_INT, SCENE_INT, &node));
  *value = (PetscInt)node->value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneGetBool(Scene scene, const char *path, PetscBool *value)
{
  SceneNode node;

  PetscFunctionBegin;
  PetscCall(Need(scene, path, SCENE_BOOL, SCENE_BOOL, &node));
  *value = (PetscBool)(node->value != 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneGetString(Scene scene, const char *path, const char **value)
{
  const SceneKey *row;
  SceneNode       node;

  PetscFunctionBegin;
  PetscCall(Find(scene, path, &row, &node));
  if (!node) PetscCall(SceneFail(scene, path, "'%s' is needed here and has no default; add it", path));
  PetscCheck(node->kind == NODE_TEXT, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "Key %s holds a map or list here, not a text", path);
  *value = node->text;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneGetVector(Scene scene, const char *path, PetscInt n, PetscReal value[])
{
  SceneNode node;

  PetscFunctionBegin;
  PetscCall(Need(scene, path, SCENE_VECTOR, SCENE_VECTOR, &node));
  PetscCheck(node->n <= n, PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ, "Key %s has %d components, %d asked for", path, (int)node->n, (int)n);
  for (PetscInt k = 0; k < n; k++) value[k] = k < node->n ? SceneNodeItem(node, k)->value : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneGetTable(Scene scene, const char *path, Table *table)
{
  SceneNode node, rows, ramp;

  PetscFunctionBegin;
  PetscCall(Need(scene, path, SCENE_TABLE, SCENE_TABLE, &node));
  rows = SceneNodeChild(node, "table");
  ramp = SceneNodeChild(node, "ramp");
  if (rows) {
    PetscReal *t, *v;
    PetscInt   n = 0;

    PetscCall(PetscMalloc2(rows->n, &t, rows->n, &v));
    for (SceneNode row = rows->first; row; row = row->next, n++) {
      t[n] = row->first->value;
      v[n] = row->last->value;
    }
    PetscCall(TableCreate(n, t, v, table));
    PetscCall(PetscFree2(t, v));
  } else if (ramp) {
    const PetscReal t[2] = {0, SceneNodeChild(ramp, "over")->value}, v[2] = {0, SceneNodeChild(ramp, "to")->value};

    PetscCall(TableCreate(2, t, v, table));
  } else PetscCall(TableCreateConstant(node->value, table));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneGetSize(Scene scene, const char *path, PetscInt *n)
{
  const SceneKey *row;
  SceneNode       node;

  PetscFunctionBegin;
  PetscCall(Find(scene, path, &row, &node));
  *n = !node ? 0 : node->kind == NODE_TEXT ? 1 : node->n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneGetEntry(Scene scene, const char *path, PetscInt i, const char **key)
{
  const SceneKey *row;
  SceneNode       node, child;

  PetscFunctionBegin;
  PetscCall(Find(scene, path, &row, &node));
  child = node && node->kind == NODE_TEXT && i == 0 ? node : node && i >= 0 ? node->first : NULL;
  for (PetscInt k = 0; child && k < i; k++) child = child->next;
  PetscCheck(child, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "Key %s has no entry %d", path, (int)i);
  *key = node->kind == NODE_MAP ? child->key : child->text;
  PetscCheck(*key, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "Entry %d of key %s is a map, not a text", (int)i, path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneFilePath(Scene scene, const char *name, size_t size, char path[])
{
  const char *slash = strrchr(scene->file, '/');
  int         n;

  PetscFunctionBegin;
  if (name[0] == '/' || !slash) n = snprintf(path, size, "%s", name);
  else n = snprintf(path, size, "%.*s/%s", (int)(slash - scene->file), scene->file, name);
  BaseCheckInput(n >= 0 && (size_t)n < size, scene->comm, "The path of file '%.100s' is too long; move the scene or shorten its names", name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- derived values ---- */

/* The path's map nodes, made where the user wrote none. Names and list items must exist. */
static PetscErrorCode MakeNode(Scene scene, const char *path, SceneNode *node)
{
  char      part[BASE_LINE];
  SceneNode nearest;

  PetscFunctionBegin;
  *node = Walk(scene, path, &nearest);
  if (!*node) {
    const char *dot = strrchr(path, '.');
    SceneNode   parent = scene->root;

    PetscCheck(path[strlen(path) - 1] != ']', PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "There is no %s in the scene", path);
    if (dot) {
      snprintf(part, sizeof(part), "%.*s", (int)(dot - path), path);
      PetscCall(MakeNode(scene, part, &parent));
    }
    PetscCheck(parent->kind == NODE_MAP && parent->row->type == SCENE_MAP, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "There is no %s in the scene", path);
    PetscCall(SceneNodeCreate(NODE_MAP, NULL, node));
    PetscCall(PetscStrallocpy(dot ? dot + 1 : path, &(*node)->key));
    (*node)->source = SOURCE_DEFAULT;
    (*node)->good   = PETSC_TRUE;
    (*node)->row    = SceneKeyFind(path);
    SceneNodeAppend(parent, *node);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneSetDerived(Scene scene, const char *path, PetscReal value, const char *why)
{
  const SceneKey *row;
  SceneNode       node;

  PetscFunctionBegin;
  PetscCall(KnownKey(path, &row));
  PetscCheck(row->type == SCENE_REAL || row->type == SCENE_INT, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "Key %s is not a number", path);
  PetscCall(MakeNode(scene, path, &node));
  node->kind   = NODE_TEXT;
  node->source = SOURCE_DERIVED;
  node->value  = value;
  node->good   = PETSC_TRUE;
  PetscCall(PetscFree(node->text));
  PetscCall(PetscStrallocpy("", &node->text));
  PetscCall(PetscFree(node->why));
  PetscCall(PetscStrallocpy(why, &node->why));
  PetscFunctionReturn(PETSC_SUCCESS);
}
