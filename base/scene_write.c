/*
  scene_write.c - resolved.yaml (what a run was made of, a scene again) and the reference page of all keys.

  resolved.yaml is in the table's order and in SI; behind each value stands who set it. A derived value whose rival the
  user chose (a radius from the count) is written as a comment, so that the file stays a valid scene.
*/
#include "files.h"
#include "scene_impl.h"
#include <ctype.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>

/* ---- values ---- */

/* Shortest decimal that reads back as the same double. */
static void WriteReal(FILE *out, PetscReal value, const char *unit)
{
  char text[64];

  for (int digits = 6; digits <= 17; digits++) {
    snprintf(text, sizeof(text), "%.*g", digits, (double)value);
    if (strtod(text, NULL) == value) break;
  }
  fprintf(out, "%s%s%s", text, strcmp(unit, "-") ? " " : "", strcmp(unit, "-") ? unit : "");
}

/* Plain where YAML leaves a text alone, in double quotes otherwise. */
static void WriteText(FILE *out, const char *text)
{
  PetscBool    plain = (PetscBool)(isalpha((unsigned char)text[0]) && text[strlen(text) - 1] != ' ' && strcmp(text, "null"));
  const size_t n     = strlen(text);

  for (size_t k = 0; k < n; k++)
    if (!isalnum((unsigned char)text[k]) && !strchr("_ ./()-", text[k])) plain = PETSC_FALSE;
  if (plain) fprintf(out, "%s", text);
  else {
    fputc('"', out);
    for (size_t k = 0; k < n; k++) {
      const unsigned char c = (unsigned char)text[k];

      if (c == '"' || c == '\\') fprintf(out, "\\%c", c);
      else if (c < ' ' || c == 0x7f) fprintf(out, "\\x%02x", c);
      else fputc(c, out);
    }
    fputc('"', out);
  }
}

static void WriteSource(FILE *out, SceneNode node)
{
  if (node->source == SOURCE_DERIVED) {
    fprintf(out, "  # derived: ");
    for (const char *c = node->why; c && *c; c++) fputc((unsigned char)*c < ' ' ? ' ' : *c, out);
  } else fprintf(out, "  # %s%s", node->source == SOURCE_DEFAULT ? "default" : "user", node->set ? ", --set" : "");
  fputc('\n', out);
}

static PetscErrorCode WriteFileName(FILE *out, Scene scene, const char *name)
{
  char path[BASE_LINE], *whole;

  PetscFunctionBegin;
  PetscCall(SceneFilePath(scene, name, sizeof(path), path));
  whole = realpath(path, NULL);
  WriteText(out, whole ? whole : name);
  free(whole);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void WriteTable(FILE *out, SceneNode node, const char *unit)
{
  const SceneNode rows = SceneNodeChild(node, "table"), ramp = SceneNodeChild(node, "ramp");

  if (rows) {
    fprintf(out, "{table: [");
    for (SceneNode row = rows->first; row; row = row->next) {
      fprintf(out, "[");
      WriteReal(out, row->first->value, "s");
      fprintf(out, ", ");
      WriteReal(out, row->last->value, unit);
      fprintf(out, row->next ? "], " : "]");
    }
    fprintf(out, "]}");
  } else {
    fprintf(out, "{ramp: {to: ");
    WriteReal(out, SceneNodeChild(ramp, "to")->value, unit);
    fprintf(out, ", over: ");
    WriteReal(out, SceneNodeChild(ramp, "over")->value, "s");
    fprintf(out, "}}");
  }
}

/* A value that fits behind its key on one line. */
static PetscErrorCode WriteValue(FILE *out, Scene scene, SceneNode node)
{
  const SceneKey *row = node->row;

  PetscFunctionBegin;
  if ((row->flags & SCENE_AUTO) && SceneNodeIs(node, "auto")) fprintf(out, "auto");
  else if (row->type == SCENE_BOOL) fprintf(out, node->value != 0 ? "true" : "false");
  else if (row->type == SCENE_INT) fprintf(out, "%lld", (long long)node->value);
  else if (row->type == SCENE_REAL || (row->type == SCENE_TABLE && node->kind == NODE_TEXT)) WriteReal(out, node->value, row->unit);
  else if (row->type == SCENE_TABLE) WriteTable(out, node, row->unit);
  else if (node->kind == NODE_LIST) {
    fprintf(out, "[");
    for (SceneNode item = node->first; item; item = item->next) {
      if (row->type == SCENE_VECTOR) WriteReal(out, item->value, row->unit);
      else WriteText(out, item->text);
      if (item->next) fprintf(out, ", ");
    }
    fprintf(out, "]");
  } else if (row->type == SCENE_FILE || (row->flags & SCENE_OR_FILE)) PetscCall(WriteFileName(out, scene, node->text));
  else WriteText(out, node->text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteChildren(FILE *out, Scene scene, SceneNode node, int indent, PetscBool item);

/* dash: the entry is the first of a list item */
static PetscErrorCode WriteEntry(FILE *out, Scene scene, SceneNode node, int indent, PetscBool dash)
{
  const PetscBool section = (PetscBool)(node->kind != NODE_TEXT && (node->row->type == SCENE_MAP || node->row->type == SCENE_NAMES || node->row->type == SCENE_ITEMS));
  PetscBool       rival   = PETSC_FALSE;

  PetscFunctionBegin;
  if (node->source == SOURCE_DERIVED && (node->row->flags & SCENE_ONE_OF))
    for (SceneNode other = node->parent->first; other; other = other->next)
      if (other != node && (other->row->flags & SCENE_ONE_OF)) rival = PETSC_TRUE;
  fprintf(out, "%*s%s%s", dash ? indent - 2 : indent, "", dash ? "- " : "", rival ? "# " : "");
  WriteText(out, node->key);
  if (section && node->n) {
    fprintf(out, ":\n");
    PetscCall(WriteChildren(out, scene, node, indent + 2, PETSC_FALSE));
  } else {
    fprintf(out, ": ");
    if (section) fprintf(out, node->kind == NODE_MAP ? "{}" : "[]");
    else PetscCall(WriteValue(out, scene, node));
    WriteSource(out, node);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Recursion is bounded by the table's depth. */
static PetscErrorCode WriteChildren(FILE *out, Scene scene, SceneNode node, int indent, PetscBool item)
{
  PetscFunctionBegin;
  if (node->row->type == SCENE_MAP) {
    for (const SceneKey *row = SceneKeyNext(node->row, NULL); row; row = SceneKeyNext(node->row, row)) {
      SceneNode child = SceneNodeChild(node, SceneKeyName(row));

      if (!child) continue;
      PetscCall(WriteEntry(out, scene, child, indent, item));
      item = PETSC_FALSE;
    }
  } else
    for (SceneNode child = node->first; child; child = child->next) {
      if (node->row->type == SCENE_ITEMS) PetscCall(WriteChildren(out, scene, child, indent + 2, PETSC_TRUE));
      else PetscCall(WriteEntry(out, scene, child, indent, PETSC_FALSE));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneWriteResolved(Scene scene, const char *file)
{
  PetscMPIInt rank;
  FILE       *out;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(scene->comm, &rank));
  if (rank) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FileCreate(file, &out));
  fprintf(out, "# Every value of this run in SI and who set it. It is a scene again: `cleave run` takes it.\n");
  PetscCall(WriteChildren(out, scene, scene->root, 0, PETSC_FALSE));
  PetscCall(FileFinish(&out, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- the reference page ---- */

static void WriteType(FILE *out, const SceneKey *key)
{
  static const char *const words[] = {"section", "names", "list of sections", "number", "whole number", "true or false", "text", "file", "one word", "vector", "in time", "words"};
  char                     word[32][32];
  PetscBool                later[32], group[32];
  const PetscInt           n = SceneKeyChoices(key, 32, word, later, group);

  fprintf(out, "%s", key->flags & SCENE_OR_FILE ? "file or section" : words[key->type]);
  if (n) {
    fprintf(out, ": ");
    for (PetscInt k = 0; k < n; k++) fprintf(out, "%s`%s%s`%s", k ? ", " : "", word[k], group[k] ? "(group)" : "", later[k] ? " (not yet)" : "");
  }
  if (key->type == SCENE_MAP && n) fprintf(out, ", or section");
  if (key->flags & SCENE_AUTO) fprintf(out, ", or `auto`");
}

static void WriteDefault(FILE *out, const SceneKey *key)
{
  char flat[64], solid[64];

  if (key->preset) {
    SceneKeyDefault(key, 2, sizeof(flat), flat);
    SceneKeyDefault(key, 3, sizeof(solid), solid);
    if (strcmp(flat, solid)) fprintf(out, "`%s` in 2D, `%s` in 3D", flat, solid);
    else fprintf(out, "`%s`", flat);
  } else if (key->flags & SCENE_REQUIRED) fprintf(out, "required");
  else if (key->flags & SCENE_ONE_OF) fprintf(out, "one of these");
  else fprintf(out, "none");
}

static void WriteRange(FILE *out, const SceneKey *key)
{
  PetscReal low, high;
  PetscBool low_in, high_in;

  if (!key->range || SceneKeyRange(key, &low, &high, &low_in, &high_in)) fprintf(out, "-");
  else if (PetscIsInfReal(high)) fprintf(out, "%s %g", low_in ? ">=" : ">", (double)low);
  else fprintf(out, "%g %s .. %s %g", (double)low, low_in ? "<=" : "<", high_in ? "<=" : "<", (double)high);
}

static void WriteRow(FILE *out, const SceneKey *key)
{
  static const struct {
    unsigned    flag;
    const char *words;
  } notes[] = {
    {SCENE_LATER,    " Not covered yet."               },
    {SCENE_2D,       " Only with `dimension: 2`."      },
    {SCENE_3D,       " Only with `dimension: 3`."      },
    {SCENE_FEM,      " Only with `method: fem`."       },
    {SCENE_DEM,      " Only with `method: dem`."       }
  };
  char words[96];

  fprintf(out, "| `%s` | ", key->path);
  WriteType(out, key);
  fprintf(out, " | %s | ", key->unit[0] ? key->unit : "-");
  WriteDefault(out, key);
  fprintf(out, " | ");
  WriteRange(out, key);
  fprintf(out, " | %s | %s.", key->equation, key->help);
  for (size_t k = 0; k < sizeof(notes) / sizeof(notes[0]); k++)
    if (key->flags & notes[k].flag) fprintf(out, "%s", notes[k].words);
  SceneTimeWords(key->flags, sizeof(words), words);
  if (words[0]) fprintf(out, " Only with `time.method`: %s.", words);
  fprintf(out, " |\n");
}

PetscErrorCode SceneWriteReference(FILE *out)
{
  static const char *const header = "| key | type | unit | default | range | section or equation of theory.md | meaning |\n| --- | --- | --- | --- | --- | --- | --- |\n";
  const SceneKey          *root   = SceneKeyRow(0);

  PetscFunctionBegin;
  fprintf(out, "# Scene reference\n\n"
               "Made from the table in `base/scene_keys.c`, which is what checks a scene; do not edit by hand (a test compares; `CLEAVE_UPDATE=1 ctest -R scene_keys` writes it anew).\n\n"
               "- A scene is one YAML map. `*` stands for a name you choose, `[]` for the items of a list.\n"
               "- A number carries its unit: `28 GPa`, `150 mm`, `0.2 m/s`, `26.6 deg`; any unit of the right dimension will do. A bare `0` needs none. Where the unit is `-` a plain number (or `20 %%`) is expected.\n"
               "- A vector has one number for each dimension: `[0, 0, 150 mm]`.\n"
               "- A value in time is a number (constant), `{table: [[0 ms, 0 mm/s], [1 ms, -5 mm/s]]}` (piecewise linear, constant outside) or `{ramp: {to: -5 mm/s, over: 1 ms}}` (from zero at t = 0, constant after).\n"
               "- A file is looked for beside the scene.\n"
               "- `--set materials.concrete.young='30 GPa'` replaces or adds a value; `conditions[0].velocity.y` names an item of a list, counted from 0.\n"
               "- Anchors, aliases and tags of YAML are not used. A repeated or unknown key, a wrong unit or a value out of range is refused with file:line:column.\n"
               "- \"Not covered yet\": the key is known and checked, and refused; see `not-yet.md`.\n"
               "- `resolved.yaml` in the output lists every value in SI and who set it (user, default, derived); it is a scene again.\n");
  fprintf(out, "\n## The scene\n\n%s", header);
  for (const SceneKey *key = SceneKeyNext(root, NULL); key; key = SceneKeyNext(root, key))
    if (!SceneKeyNext(key, NULL)) WriteRow(out, key);
  for (const SceneKey *section = SceneKeyNext(root, NULL); section; section = SceneKeyNext(root, section)) {
    const size_t n = strlen(section->path);

    if (!SceneKeyNext(section, NULL)) continue;
    fprintf(out, "\n## %s\n\n%s", section->path, header);
    for (PetscInt k = 1; k < SceneKeyCount(); k++) {
      const SceneKey *key = SceneKeyRow(k);

      if (!strncmp(key->path, section->path, n) && (!key->path[n] || strchr(".[", key->path[n]))) WriteRow(out, key);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
