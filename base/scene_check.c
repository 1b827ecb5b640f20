/*
  scene_check.c - each node against its row of the table: kind, type, unit, range, choice; values to SI.

  A fault is recorded and the check goes on, so that a user sees all of them at once. What no single key can know
  (names that must match, keys that exclude each other) is in scene_rules.c.
*/
#include "scene_impl.h"
#include "units.h"
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define WORDS 32 /* most choices or keys listed in a message */
#define LABEL 160 /* how much of a name a message shows */

static const char *KindWord(SceneNode node)
{
  return node->kind == NODE_TEXT ? "a single value" : node->kind == NODE_MAP ? "a map of keys" : "a list";
}

/* How a message calls a node: "young", "velocity.y", "size[1]", "conditions[2]". */
static void Label(SceneNode node, size_t size, char label[])
{
  SceneNode keyed = node;
  char      path[BASE_LINE];
  size_t    from = 0;

  while (keyed->parent && !keyed->key) keyed = keyed->parent;
  if (keyed->key && strlen(keyed->key) == 1 && keyed->parent && keyed->parent->key && keyed->row && strlen(SceneKeyName(keyed->row)) == 1 && SceneKeyName(keyed->row)[0] != '*') keyed = keyed->parent; /* x, y, z */
  SceneNodePath(node, sizeof(path), path);
  if (keyed->parent) {
    char before[BASE_LINE];

    SceneNodePath(keyed->parent, sizeof(before), before);
    from = strlen(before) ? strlen(before) + 1 : 0;
  }
  snprintf(label, size, "%s", from <= strlen(path) ? path + from : path);
}

static PetscBool IsNull(SceneNode node)
{
  return (PetscBool)(node->kind == NODE_TEXT && node->plain && (!node->text[0] || !strcmp(node->text, "~") || !strcmp(node->text, "null")));
}

/* "a, b, c" */
static void Join(PetscInt n, const char *const words[], size_t size, char text[])
{
  size_t used = 0;

  text[0] = 0;
  for (PetscInt k = 0; k < n && used < size; k++) used += (size_t)snprintf(text + used, size - used, "%s%s", k ? ", " : "", words[k]);
}

/* "did you mean 'young'?", else "allowed: a, b, c" */
static void Suggest(const char *word, PetscInt n, const char *const words[], size_t size, char text[])
{
  const char *nearest = BaseNearest(word, n, words);
  char        all[BASE_LINE / 2];

  Join(n, words, sizeof(all), all);
  if (nearest) snprintf(text, size, "did you mean '%s'?", nearest);
  else snprintf(text, size, "allowed: %s", all);
}

/* ---- numbers ---- */

/* End of the decimal number at s, NULL when there is none. strtod alone would also take nan, inf and 0x1p3. */
static const char *ScanNumber(const char *s, PetscReal *value)
{
  const char *c = s;
  PetscBool   digits = PETSC_FALSE;

  if (*c == '+' || *c == '-') c++;
  for (; isdigit((unsigned char)*c); c++) digits = PETSC_TRUE;
  if (*c == '.') c++;
  for (; isdigit((unsigned char)*c); c++) digits = PETSC_TRUE;
  if (!digits) return NULL;
  if (*c == 'e' || *c == 'E') {
    const char *e = c + 1;

    if (*e == '+' || *e == '-') e++;
    if (isdigit((unsigned char)*e)) {
      while (isdigit((unsigned char)*e)) e++;
      c = e;
    }
  }
  *value = strtod(s, NULL);
  return c;
}

/* "> 0 Pa", "0 < safety <= 1" */
static PetscErrorCode RangeWords(const SceneKey *row, const char *label, const char *unit, size_t size, char text[])
{
  PetscReal   low, high;
  PetscBool   low_in, high_in;
  const char *blank = strcmp(unit, "-") ? " " : "", *u = strcmp(unit, "-") ? unit : "";

  PetscFunctionBegin;
  PetscCall(SceneKeyRange(row, &low, &high, &low_in, &high_in));
  if (isinf(high)) snprintf(text, size, "%s %s %g%s%s", label, low_in ? ">=" : ">", low, blank, u);
  else snprintf(text, size, "%g%s%s %s %s %s %g%s%s", low, blank, u, low_in ? "<=" : "<", label, high_in ? "<=" : "<", high, blank, u);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One number with unit. name: as messages call it, NULL: its key. range: row whose range holds, or NULL. Sets node->value and node->good. */
static PetscErrorCode CheckReal(Scene scene, SceneNode node, const char *name, const char *unit, const SceneKey *range)
{
  const PetscBool bare_wanted = (PetscBool)!strcmp(unit, "-");
  const char     *example = UnitsExample(unit), *rest;
  char            label[LABEL], text[64], words[512];
  PetscReal       number, low, high;
  PetscBool       low_in, high_in;
  UnitsResult     result;

  PetscFunctionBegin;
  if (name) snprintf(label, sizeof(label), "%s", name);
  else Label(node, sizeof(label), label);
  if (node->kind != NODE_TEXT) {
    PetscCall(SceneFaultValue(scene, node, "%s is %s; a number%s%s is expected, e.g. %s", label, KindWord(node), bare_wanted ? "" : " in ", bare_wanted ? "" : unit, example));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  snprintf(text, sizeof(text), "%s", node->text);
  rest = ScanNumber(node->text, &number);
  if (!rest || strlen(node->text) >= sizeof(text)) {
    PetscCall(SceneFaultValue(scene, node, "%s: '%.60s' is not a number; write it like %s", label, node->text, example));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!isfinite(number)) {
    PetscCall(SceneFaultValue(scene, node, "%s: '%s' is not a finite number; write it like %s", label, text, example));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  const PetscBool glued = (PetscBool)(*rest && *rest != ' ');

  while (*rest == ' ') rest++;
  if (!*rest && !bare_wanted && number != 0) {
    PetscCall(SceneFaultValue(scene, node, "%s: %s has no unit; %s is expected, e.g. %s", label, text, unit, example));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!*rest) node->value = number;
  else {
    PetscCall(UnitsConvert(rest, unit, number, &node->value, &result));
    if (result == UNITS_UNKNOWN && glued && strchr(rest, ' ')) PetscCall(SceneFaultValue(scene, node, "%s: cannot read '%s' as a number with a unit; write it like %s", label, text, example));
    else if (result == UNITS_UNKNOWN && bare_wanted) PetscCall(SceneFaultValue(scene, node, "%s: cannot read '%s' as a plain number; write it like %s", label, text, example));
    else if (result == UNITS_UNKNOWN) PetscCall(SceneFaultValue(scene, node, "%s: unknown unit '%s' in '%s'; %s is expected, e.g. %s", label, rest, text, unit, example));
    else if (result == UNITS_DIMENSION) {
      if (bare_wanted) PetscCall(SceneFaultValue(scene, node, "%s: %s is %s; %s wants a plain number, e.g. %s", label, text, UnitsWord(rest), label, example));
      else PetscCall(SceneFaultValue(scene, node, "%s: %s is %s; %s wants %s, e.g. %s", label, text, UnitsWord(rest), label, unit, example));
    }
    if (result != UNITS_OK) PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!isfinite(node->value)) {
    PetscCall(SceneFaultValue(scene, node, "%s: '%s' is not a finite number; write it like %s", label, text, example));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (range && range->range) {
    PetscCall(SceneKeyRange(range, &low, &high, &low_in, &high_in));
    if (node->value < low || node->value > high || (!low_in && node->value == low) || (!high_in && node->value == high)) {
      PetscCall(RangeWords(range, label, unit, sizeof(words), words));
      PetscCall(SceneFaultValue(scene, node, "%s is %s, out of range; allowed: %s", label, text, words));
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  }
  node->good = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- words ---- */

static PetscErrorCode CheckWord(Scene scene, SceneNode node, const SceneKey *row)
{
  char        word[WORDS][32], shown[WORDS][48], label[LABEL], name[BASE_LINE], words[BASE_LINE];
  PetscBool   later[WORDS], group[WORDS];
  const char *list[WORDS] = {NULL}, *open;
  PetscInt    n = SceneKeyChoices(row, WORDS, word, later, group), found = -1;

  PetscFunctionBegin;
  if (!row->choices) { /* any text */
    node->good = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  Label(node, sizeof(label), label);
  for (PetscInt k = 0; k < n; k++) {
    snprintf(shown[k], sizeof(shown[k]), "%s%s", word[k], group[k] ? "(group)" : "");
    list[k] = word[k];
  }
  snprintf(name, sizeof(name), "%s", node->text);
  open = strchr(node->text, '(');
  if (open) name[open - node->text] = 0;
  for (PetscInt k = 0; k < n; k++)
    if (!strcmp(name, word[k])) found = k;
  if (found < 0) {
    const char *nearest = BaseNearest(name, n, list);

    for (PetscInt k = 0; k < n; k++) list[k] = shown[k];
    Join(n, list, sizeof(words), words);
    PetscCall(SceneFaultValue(scene, node, "%s: '%.60s' is unknown; %s%s%sallowed: %s", label, node->text, nearest ? "did you mean '" : "", nearest ? nearest : "", nearest ? "'? " : "", words));
  } else if (group[found] && (!open || open[1] == ')' || node->text[strlen(node->text) - 1] != ')')) PetscCall(SceneFaultValue(scene, node, "%s: '%.60s' needs a group; write %s(name of the group)", label, node->text, word[found]));
  else if (!group[found] && open) PetscCall(SceneFaultValue(scene, node, "%s: %s takes no group; write %s", label, word[found], word[found]));
  else if (later[found]) PetscCall(SceneFaultValue(scene, node, "%s: %s is not covered yet, see docs/not-yet.md", label, word[found]));
  else node->good = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The choices covered today: "fem, dem". */
static PetscErrorCode ChoiceWords(const SceneKey *row, size_t size, char text[])
{
  char        word[WORDS][32];
  PetscBool   later[WORDS], group[WORDS];
  const char *list[WORDS] = {NULL};
  PetscInt    n = SceneKeyChoices(row, WORDS, word, later, group), m = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++)
    if (!later[k]) list[m++] = word[k];
  Join(m, list, size, text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckWords(Scene scene, SceneNode node, const SceneKey *row)
{
  char label[LABEL];

  PetscFunctionBegin;
  Label(node, sizeof(label), label);
  if (node->kind == NODE_MAP) {
    PetscCall(SceneFaultValue(scene, node, "%s is a map of keys; a word or a list of words is expected, e.g. [a, b]", label));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (node->kind == NODE_TEXT) PetscCall(CheckWord(scene, node, row));
  for (SceneNode item = node->first; item; item = item->next) {
    if (item->kind != NODE_TEXT || IsNull(item)) {
      PetscCall(SceneFaultValue(scene, item, "an item of %s is %s; a word is expected", label, item->kind == NODE_TEXT ? "empty" : KindWord(item)));
      continue;
    }
    PetscCall(CheckWord(scene, item, row));
    for (SceneNode twin = node->first; twin != item; twin = twin->next)
      if (SceneNodeIs(twin, item->text)) {
        PetscCall(SceneFaultValue(scene, item, "%s names %.60s twice; keep one", label, item->text));
        break;
      }
  }
  if (node->kind == NODE_LIST) node->good = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckInt(Scene scene, SceneNode node, const SceneKey *row)
{
  char        word[WORDS][32], label[LABEL], words[512] = "";
  PetscBool   later[WORDS], group[WORDS];
  const char *list[WORDS] = {NULL};
  PetscInt    n = SceneKeyChoices(row, WORDS, word, later, group);

  PetscFunctionBegin;
  PetscCall(CheckReal(scene, node, NULL, "-", row));
  if (!node->good) PetscFunctionReturn(PETSC_SUCCESS);
  Label(node, sizeof(label), label);
  node->good = PETSC_FALSE;
  for (PetscInt k = 0; k < n; k++) {
    list[k] = word[k];
    if (node->value == atoi(word[k])) node->good = PETSC_TRUE;
  }
  Join(n, list, sizeof(words), words);
  if (n && !node->good) PetscCall(SceneFaultValue(scene, node, "%s is %.60s; allowed: %s", label, node->text, words));
  else if (node->value != floor(node->value) || fabs(node->value) > 2e9) PetscCall(SceneFaultValue(scene, node, "%s is %.60s; a whole number is expected, e.g. 3", label, node->text));
  else node->good = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckBool(Scene scene, SceneNode node)
{
  char label[LABEL];

  PetscFunctionBegin;
  node->good = PETSC_TRUE;
  if (SceneNodeIs(node, "true") || SceneNodeIs(node, "yes") || SceneNodeIs(node, "on")) node->value = 1;
  else if (SceneNodeIs(node, "false") || SceneNodeIs(node, "no") || SceneNodeIs(node, "off")) node->value = 0;
  else {
    Label(node, sizeof(label), label);
    node->good = PETSC_FALSE;
    PetscCall(SceneFaultValue(scene, node, "%s is %.60s; allowed: true, false", label, node->kind == NODE_TEXT ? node->text : KindWord(node)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- vectors and tables in time ---- */

static PetscErrorCode CheckVector(Scene scene, SceneNode node, const SceneKey *row)
{
  const PetscInt want = scene->dimension;
  char           label[LABEL];

  PetscFunctionBegin;
  Label(node, sizeof(label), label);
  if (node->kind != NODE_LIST) {
    PetscCall(SceneFaultValue(scene, node, "%s is %s; a list of %s numbers is expected, e.g. [0, %s%s]", label, KindWord(node), want == 2 ? "2" : "3", want == 2 ? "" : "0, ", UnitsExample(row->unit)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (want == 2 && node->n == 3) PetscCall(SceneFaultValue(scene, SceneNodeItem(node, 2), "%s has a z component, but the scene has dimension: 2; give [x, y]", label));
  else if ((want && node->n != want) || node->n < 2 || node->n > 3) PetscCall(SceneFaultValue(scene, node, "%s has %d components; %s are expected, one for each dimension", label, (int)node->n, want == 2 ? "2" : "3"));
  else {
    node->good = PETSC_TRUE;
    for (SceneNode item = node->first; item; item = item->next) {
      PetscCall(CheckReal(scene, item, NULL, row->unit, row));
      if (!item->good) node->good = PETSC_FALSE;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* {table: [[t, v], ...]} */
static PetscErrorCode CheckTableRows(Scene scene, SceneNode node, SceneNode rows, const SceneKey *row)
{
  const char *example = UnitsExample(row->unit);
  SceneNode   before  = NULL;
  char        label[LABEL];

  PetscFunctionBegin;
  Label(node, sizeof(label), label);
  node->good = PETSC_TRUE;
  if (rows->kind != NODE_LIST || !rows->n) {
    PetscCall(SceneFaultValue(scene, rows, "the table is empty or no list; write rows of [time, value], e.g. [[0 s, 0], [1 ms, %s]]", example));
    node->good = PETSC_FALSE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (SceneNode pair = rows->first; pair; pair = pair->next) {
    SceneNode t = SceneNodeItem(pair, 0), v = SceneNodeItem(pair, 1);

    if (pair->kind != NODE_LIST || pair->n != 2) {
      PetscCall(SceneFaultValue(scene, pair, "a row of the table has %d columns; 2 are expected: [time, value], e.g. [1 ms, %s]", pair->kind == NODE_LIST ? (int)pair->n : 1, example));
      node->good = PETSC_FALSE;
      continue;
    }
    PetscCall(CheckReal(scene, t, "time", "s", NULL));
    PetscCall(CheckReal(scene, v, label, row->unit, row));
    if (!t->good || !v->good) node->good = PETSC_FALSE;
    if (t->good && before && t->value <= before->value) {
      PetscCall(SceneFaultValue(scene, t, "time %s does not come after %s of the row before; times must increase", t->text, before->text));
      node->good = PETSC_FALSE;
    }
    if (t->good) before = t;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* {ramp: {to: v, over: t}} */
static PetscErrorCode CheckRamp(Scene scene, SceneNode node, SceneNode ramp, const SceneKey *row)
{
  const SceneKey positive = {.path = "", .range = "(0, inf)"};
  SceneNode      to = SceneNodeChild(ramp, "to"), over = SceneNodeChild(ramp, "over");
  const char    *example = UnitsExample(row->unit);

  PetscFunctionBegin;
  if (ramp->kind != NODE_MAP) {
    PetscCall(SceneFaultValue(scene, ramp, "ramp is %s; write {ramp: {to: %s, over: 1 ms}}", KindWord(ramp), example));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (SceneNode child = ramp->first; child; child = child->next)
    if (child != to && child != over) PetscCall(SceneFaultKey(scene, child, "unknown key '%s' in ramp; allowed: to, over", child->key));
  if (!to) PetscCall(SceneFaultKey(scene, ramp, "ramp has no 'to'; write {ramp: {to: %s, over: 1 ms}}", example));
  if (!over) PetscCall(SceneFaultKey(scene, ramp, "ramp has no 'over', the time it takes; write {ramp: {to: %s, over: 1 ms}}", example));
  if (to) PetscCall(CheckReal(scene, to, NULL, row->unit, row));
  if (over) PetscCall(CheckReal(scene, over, NULL, "s", &positive));
  node->good = (PetscBool)(to && over && to->good && over->good);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckTable(Scene scene, SceneNode node, const SceneKey *row)
{
  SceneNode rows = SceneNodeChild(node, "table"), ramp = SceneNodeChild(node, "ramp");
  char      label[LABEL];

  PetscFunctionBegin;
  Label(node, sizeof(label), label);
  if (node->kind == NODE_TEXT) PetscCall(CheckReal(scene, node, NULL, row->unit, row));
  else if (node->kind == NODE_LIST) PetscCall(SceneFaultValue(scene, node, "%s is a list; write a value (%s), {table: [[0 s, 0], [1 ms, %s]]} or {ramp: {to: %s, over: 1 ms}}", label, UnitsExample(row->unit), UnitsExample(row->unit), UnitsExample(row->unit)));
  else {
    for (SceneNode child = node->first; child; child = child->next)
      if (child != rows && child != ramp) PetscCall(SceneFaultKey(scene, child, "unknown key '%s' in %s; allowed: table, ramp, or a value like %s", child->key, label, UnitsExample(row->unit)));
    if (rows && ramp) PetscCall(SceneFaultKey(scene, ramp, "table and ramp exclude each other; keep one"));
    else if (rows) PetscCall(CheckTableRows(scene, node, rows, row));
    else if (ramp) PetscCall(CheckRamp(scene, node, ramp, row));
    else if (!node->n) PetscCall(SceneFaultKey(scene, node, "%s is empty; write a value like %s, a table or a ramp", label, UnitsExample(row->unit)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- sections ---- */

static SceneNode BodyOf(SceneNode node)
{
  while (node && node->parent && !(node->parent->key && !strcmp(node->parent->key, "bodies") && node->parent->parent && !node->parent->parent->parent)) node = node->parent;
  return node && node->parent ? node : NULL;
}

static const struct {
  unsigned    flag;
  const char *word;
} times[] = {
  {SCENE_STATIC,   "static"  },
  {SCENE_EXPLICIT, "explicit"},
  {SCENE_IMPLICIT, "implicit"},
  {SCENE_MODAL,    "modal"   }
};

void SceneTimeWords(unsigned flags, size_t size, char words[])
{
  int left = 0, done = 0;

  words[0] = 0;
  for (int k = 0; k < 4; k++) left += (flags & times[k].flag) != 0;
  for (int k = 0; k < 4; k++)
    if (flags & times[k].flag) {
      const size_t used = strlen(words);

      left--;
      snprintf(words + used, size - used, "%s%s", done ? left ? ", " : " or " : "", times[k].word);
      done++;
    }
}

const char *SceneKeyMisplaced(Scene scene, SceneNode parent, const SceneKey *row)
{
  const SceneNode method = SceneNodeChild(BodyOf(parent), "method");

  if ((row->flags & SCENE_2D) && scene->dimension == 3) return "belongs to dimension: 2, and this scene has dimension: 3";
  if ((row->flags & SCENE_3D) && scene->dimension == 2) return "belongs to dimension: 3, and this scene has dimension: 2";
  if ((row->flags & SCENE_FEM) && SceneNodeIs(method, "dem")) return "belongs to method: fem, and this body has method: dem";
  if ((row->flags & SCENE_DEM) && SceneNodeIs(method, "fem")) return "belongs to method: dem, and this body has method: fem";
  if ((row->flags & SCENE_TIMES) && scene->time && !(row->flags & scene->time)) {
    static char why[256];
    char        wanted[96], given[32];

    SceneTimeWords(row->flags, sizeof(wanted), wanted);
    SceneTimeWords(scene->time, sizeof(given), given);
    snprintf(why, sizeof(why), "belongs to time.method: %s, and this run is %s", wanted, given);
    return why;
  }
  return NULL;
}

/* Required and one-of keys of a section that were not written. */
static PetscErrorCode CheckMissing(Scene scene, SceneNode node, const SceneKey *row)
{
  char        where[BASE_LINE], words[BASE_LINE];
  const char *list[WORDS] = {NULL};
  SceneNode   chosen = NULL;
  PetscInt    n = 0;

  PetscFunctionBegin;
  Label(node, sizeof(where), where);
  if (!node->parent) strcpy(where, "the scene");
  for (const SceneKey *key = SceneKeyNext(row, NULL); key; key = SceneKeyNext(row, key)) {
    SceneNode child = SceneNodeChild(node, SceneKeyName(key));

    if (key->flags & SCENE_ONE_OF) {
      const PetscBool misplaced = (PetscBool)(SceneKeyMisplaced(scene, node, key) != NULL);

      if (n < WORDS && !misplaced) list[n++] = SceneKeyName(key);
      if (child && chosen) {
        SceneNode later = child->key_line > chosen->key_line || (child->key_line == chosen->key_line && child->key_column > chosen->key_column) || child->set ? child : chosen;

        PetscCall(SceneFaultKey(scene, later, "%s and %s exclude each other; keep one", chosen->key, child->key));
      }
      if (child) chosen = child;
    } else if ((key->flags & SCENE_REQUIRED) && !child && !SceneKeyMisplaced(scene, node, key)) {
      const SceneNode method = SceneNodeChild(BodyOf(node), "method");

      const char     *name   = SceneKeyName(key);

      if ((key->flags & SCENE_DEM) && !SceneNodeIs(method, "dem") && !SceneNodeIs(method, "coupled")) continue; /* method has its own fault */
      if (key->type == SCENE_REAL || key->type == SCENE_INT) PetscCall(SceneFaultKey(scene, node, "%s has no '%s'; add it, e.g. %s: %s", where, name, name, UnitsExample(key->unit)));
      else if (key->choices) {
        PetscCall(ChoiceWords(key, sizeof(words), words));
        PetscCall(SceneFaultKey(scene, node, "%s has no '%s'; add it, one of: %s", where, name, words));
      } else PetscCall(SceneFaultKey(scene, node, "%s has no '%s'; add it (%s)", where, name, key->help));
    }
  }
  Join(n, list, sizeof(words), words);
  if (n && !chosen) PetscCall(SceneFaultKey(scene, node, "%s has none of %s; give exactly one", where, words));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckMap(Scene scene, SceneNode node, const SceneKey *row)
{
  char        where[BASE_LINE], hint[BASE_LINE];
  const char *list[WORDS] = {NULL};
  PetscInt    n = 0;

  PetscFunctionBegin;
  SceneNodePath(node, sizeof(where), where);
  for (const SceneKey *key = SceneKeyNext(row, NULL); key && n < WORDS; key = SceneKeyNext(row, key))
    if (!(key->flags & SCENE_LATER) || (row->flags & SCENE_LATER)) list[n++] = SceneKeyName(key);
  for (SceneNode child = node->first; child; child = child->next) {
    const SceneKey *key = SceneKeyChild(row, child->key);
    const char     *misplaced;

    if (!key) {
      Suggest(child->key, n, list, sizeof(hint), hint);
      PetscCall(SceneFaultKey(scene, child, "unknown key '%.60s'%s%s; %s", child->key, node->parent ? " in " : "", where, hint));
      continue;
    }
    misplaced = SceneKeyMisplaced(scene, node, key);
    if (misplaced) PetscCall(SceneFaultKey(scene, child, "'%s' %s; take it out", child->key, misplaced));
    else PetscCall(SceneCheckNode(scene, child, key));
  }
  PetscCall(CheckMissing(scene, node, row));
  node->good = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneCheckNode(Scene scene, SceneNode node, const SceneKey *row)
{
  char label[LABEL];

  PetscFunctionBegin;
  node->row = row;
  Label(node, sizeof(label), label);
  if ((row->flags & SCENE_LATER) && node->source == SOURCE_USER && !(node->parent && node->parent->row && (node->parent->row->flags & SCENE_LATER))) PetscCall(SceneFaultKey(scene, node, "%s is not covered yet, see docs/not-yet.md", label));
  if (IsNull(node)) {
    PetscCall(SceneFaultValue(scene, node, "%s has no value; give one or take the key out", label));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if ((row->flags & SCENE_AUTO) && SceneNodeIs(node, "auto")) {
    node->good = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  switch (row->type) {
  case SCENE_REAL:
    PetscCall(CheckReal(scene, node, NULL, row->unit, row));
    break;
  case SCENE_INT:
    PetscCall(CheckInt(scene, node, row));
    break;
  case SCENE_BOOL:
    PetscCall(CheckBool(scene, node));
    break;
  case SCENE_VECTOR:
    PetscCall(CheckVector(scene, node, row));
    break;
  case SCENE_TABLE:
    PetscCall(CheckTable(scene, node, row));
    break;
  case SCENE_WORDS:
    PetscCall(CheckWords(scene, node, row));
    break;
  case SCENE_CHOICE:
  case SCENE_TEXT:
  case SCENE_FILE:
    if (node->kind != NODE_TEXT) PetscCall(SceneFaultValue(scene, node, "%s is %s; a single text is expected", label, KindWord(node)));
    else if (row->type == SCENE_CHOICE) PetscCall(CheckWord(scene, node, row));
    else if (!node->text[0] && !(row->flags & SCENE_EMPTY)) PetscCall(SceneFaultValue(scene, node, "%s is empty; give a text or take the key out", label));
    else node->good = PETSC_TRUE;
    break;
  case SCENE_MAP:
    if (node->kind == NODE_MAP) PetscCall(CheckMap(scene, node, row));
    else if (node->kind == NODE_TEXT && row->choices) PetscCall(CheckWord(scene, node, row));
    else if (node->kind == NODE_TEXT && (row->flags & SCENE_OR_FILE)) node->good = PETSC_TRUE;
    else {
      const char *list[WORDS] = {NULL};
      char        words[BASE_LINE];
      PetscInt    n = 0;

      for (const SceneKey *key = SceneKeyNext(row, NULL); key && n < WORDS; key = SceneKeyNext(row, key)) list[n++] = SceneKeyName(key);
      Join(n, list, sizeof(words), words);
      if (node->parent) PetscCall(SceneFaultValue(scene, node, "%s is %s; a map of keys is expected: %s", label, KindWord(node), words));
      else PetscCall(SceneFaultValue(scene, node, "a scene is a map of keys, this is %s; its keys are %s", KindWord(node), words));
    }
    break;
  case SCENE_NAMES:
    if (node->kind != NODE_MAP) PetscCall(SceneFaultValue(scene, node, "%s is %s; a map of names is expected, each with its keys", label, KindWord(node)));
    else if (!node->n && (row->flags & SCENE_REQUIRED)) PetscCall(SceneFaultKey(scene, node, "%s is empty; at least one is needed", label));
    else {
      for (SceneNode child = node->first; child; child = child->next) PetscCall(SceneCheckNode(scene, child, SceneKeyChild(row, child->key)));
      node->good = PETSC_TRUE;
    }
    break;
  case SCENE_ITEMS:
    if (node->kind != NODE_LIST) PetscCall(SceneFaultValue(scene, node, "%s is %s; a list is expected, each item a map of keys after '- '", label, KindWord(node)));
    else {
      for (SceneNode child = node->first; child; child = child->next) PetscCall(SceneCheckNode(scene, child, SceneKeyItem(row)));
      node->good = PETSC_TRUE;
    }
    break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneCheck(Scene scene)
{
  const SceneNode time = SceneNodeChild(scene->root, "time"), method = SceneNodeChild(time, "method"), dimension = SceneNodeChild(scene->root, "dimension");

  PetscFunctionBegin;
  scene->dimension = !dimension || SceneNodeIs(dimension, "3") ? 3 : SceneNodeIs(dimension, "2") ? 2 : 0;
  scene->time      = !method ? SCENE_EXPLICIT : 0;
  for (int k = 0; k < 4; k++)
    if (SceneNodeIs(method, times[k].word)) scene->time = times[k].flag;
  scene->is_static = !method || SceneNodeIs(method, "explicit") ? 0 : SceneNodeIs(method, "static") ? 1 : -1;
  PetscCall(SceneCheckNode(scene, scene->root, SceneKeyRow(0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
