/*
  scene_read.c - the file's text to a tree of nodes that know their line and column; --set overrides; the fault list.

  libyaml gives events; a scene uses the plain part of YAML: maps with text keys, lists, values. Anchors, aliases, tags
  and a second document are refused in words, a repeated key too (YAML's own loaders keep the last, silently).
*/
#include "scene_impl.h"
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <yaml.h>

#define MAX_BYTES (4 << 20) /* of a scene; the check of repeated keys is quadratic in a map's length */
#define MAX_KEYS  5000      /* in one map */

/* ---- nodes ---- */

PetscErrorCode SceneNodeCreate(SceneNodeKind kind, const char *text, SceneNode *node)
{
  PetscFunctionBegin;
  PetscCall(PetscNew(node));
  (*node)->kind = kind;
  if (text) PetscCall(PetscStrallocpy(text, &(*node)->text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Recursion is bounded: the parser refuses more than SCENE_DEPTH levels. */
PetscErrorCode SceneNodeDestroy(SceneNode *node)
{
  PetscFunctionBegin;
  if (!*node) PetscFunctionReturn(PETSC_SUCCESS);
  for (SceneNode child = (*node)->first, next; child; child = next) {
    next = child->next;
    PetscCall(SceneNodeDestroy(&child));
  }
  PetscCall(PetscFree((*node)->key));
  PetscCall(PetscFree((*node)->text));
  PetscCall(PetscFree((*node)->why));
  PetscCall(PetscFree(*node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SceneNodeAppend(SceneNode parent, SceneNode child)
{
  child->parent = parent;
  if (parent->last) parent->last->next = child;
  else parent->first = child;
  parent->last = child;
  parent->n++;
}

SceneNode SceneNodeChild(SceneNode map, const char *key)
{
  if (map && map->kind == NODE_MAP)
    for (SceneNode child = map->first; child; child = child->next)
      if (!strcmp(child->key, key)) return child;
  return NULL;
}

SceneNode SceneNodeItem(SceneNode list, PetscInt i)
{
  SceneNode item = list && list->kind == NODE_LIST && i >= 0 ? list->first : NULL;

  while (item && i--) item = item->next;
  return item;
}

void SceneNodePath(SceneNode node, size_t size, char path[])
{
  size_t used;

  path[0] = 0;
  if (!node->parent) return;
  SceneNodePath(node->parent, size, path);
  used = strlen(path);
  if (node->key) snprintf(path + used, size - used, "%s%s", used ? "." : "", node->key);
  else {
    int i = 0;

    for (SceneNode item = node->parent->first; item && item != node; item = item->next) i++;
    snprintf(path + used, size - used, "[%d]", i);
  }
}

PetscBool SceneNodeIs(SceneNode node, const char *text)
{
  return (PetscBool)(node && node->kind == NODE_TEXT && !strcmp(node->text, text));
}

/* ---- faults ---- */

static PetscErrorCode AddFault(Scene scene, PetscInt line, PetscInt column, const char *set, const char *format, va_list args)
{
  char text[BASE_LINE];

  PetscFunctionBegin;
  vsnprintf(text, sizeof(text), format, args);
  for (char *c = text; *c; c++)
    if ((unsigned char)*c < ' ') *c = ' '; /* one fault, one line */
  for (PetscInt k = 0; k < PetscMin(scene->n_faults, SCENE_FAULTS); k++)
    if (scene->fault[k].line == line && scene->fault[k].column == column && !strcmp(scene->fault[k].text, text)) PetscFunctionReturn(PETSC_SUCCESS);
  if (scene->n_faults < SCENE_FAULTS) {
    SceneFault *fault = &scene->fault[scene->n_faults];

    fault->line   = line;
    fault->column = column;
    fault->set    = set;
    PetscCall(PetscStrallocpy(text, &fault->text));
  }
  scene->n_faults++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneFaultAt(Scene scene, PetscInt line, PetscInt column, const char *set, const char *format, ...)
{
  va_list        args;
  PetscErrorCode code;

  va_start(args, format);
  code = AddFault(scene, line, column, set, format, args);
  va_end(args);
  return code;
}

PetscErrorCode SceneFaultKey(Scene scene, SceneNode node, const char *format, ...)
{
  va_list        args;
  PetscErrorCode code;

  va_start(args, format);
  code = AddFault(scene, node->key_line, node->key_column, node->set, format, args);
  va_end(args);
  return code;
}

PetscErrorCode SceneFaultValue(Scene scene, SceneNode node, const char *format, ...)
{
  va_list        args;
  PetscErrorCode code;

  va_start(args, format);
  code = AddFault(scene, node->line, node->column, node->set, format, args);
  va_end(args);
  return code;
}

static int CompareFaults(const void *a, const void *b)
{
  const SceneFault *x = a, *y = b;

  if (!x->set != !y->set) return x->set ? 1 : -1; /* the file first */
  if (x->line != y->line) return x->line < y->line ? -1 : 1;
  return (x->column > y->column) - (x->column < y->column);
}

static void FormatFault(Scene scene, const SceneFault *fault, size_t size, char line[])
{
  if (fault->set) snprintf(line, size, "--set %s: error: %s", fault->set, fault->text);
  else if (fault->line > 0) snprintf(line, size, "%s:%d:%d: error: %s", scene->file, (int)fault->line, (int)fault->column, fault->text);
  else snprintf(line, size, "%s: error: %s", scene->file, fault->text);
}

PetscErrorCode SceneFaultsRaise(Scene scene)
{
  const PetscInt kept = PetscMin(scene->n_faults, SCENE_FAULTS);
  char           line[2 * BASE_LINE];
  char           first[1024]; /* PETSc keeps 2048 characters of a message */

  PetscFunctionBegin;
  if (!kept) PetscFunctionReturn(PETSC_SUCCESS);
  qsort(scene->fault, (size_t)kept, sizeof(scene->fault[0]), CompareFaults);
  for (PetscInt k = 0; k < kept; k++) {
    FormatFault(scene, &scene->fault[k], k ? sizeof(line) : sizeof(first), line);
    if (k == 0) strcpy(first, line);
    BaseReport(scene->comm, line);
  }
  if (scene->n_faults > kept) {
    snprintf(line, sizeof(line), "%s: %d more faults", scene->file, (int)(scene->n_faults - kept));
    BaseReport(scene->comm, line);
  }
  for (PetscInt k = 0; k < kept; k++) PetscCall(PetscFree(scene->fault[k].text));
  scene->n_faults = 0;
  SETERRQ(scene->comm, PETSC_ERR_USER_INPUT, "%s", first);
}

/* ---- file ---- */

typedef enum { FILE_OK, FILE_MISSING, FILE_DIRECTORY, FILE_ODD, FILE_LARGE, FILE_UNREADABLE } FileState;

static FileState ReadBytes(const char *file, char **text, size_t *length)
{
  struct stat info;
  FILE       *in;

  if (stat(file, &info)) return FILE_MISSING;
  if (S_ISDIR(info.st_mode)) return FILE_DIRECTORY;
  if (!S_ISREG(info.st_mode)) return FILE_ODD;
  if (info.st_size > MAX_BYTES) return FILE_LARGE;
  in = fopen(file, "rb");
  if (!in) return FILE_UNREADABLE;
  if (PetscMalloc1((size_t)info.st_size + 1, text)) {
    fclose(in);
    return FILE_UNREADABLE;
  }
  *length          = fread(*text, 1, (size_t)info.st_size, in);
  (*text)[*length] = 0;
  fclose(in);
  return FILE_OK;
}

PetscErrorCode SceneReadFile(Scene scene, char **text, size_t *length)
{
  static const char *const wrong[] = {"", "there is no such file; give the path of a scene (.yaml)", "is a directory; give the path of a scene (.yaml) in it", "is not a regular file; give the path of a scene (.yaml)",
                                      "is larger than 4 MB; a scene is a page of text", "cannot be read; look at its permissions"};
  PetscMPIInt              rank;
  long long                head[2] = {FILE_OK, 0};

  PetscFunctionBegin;
  *text = NULL;
  PetscCallMPI(MPI_Comm_rank(scene->comm, &rank));
  if (rank == 0) {
    size_t n = 0;

    head[0] = ReadBytes(scene->file, text, &n);
    head[1] = (long long)n;
  }
  PetscCallMPI(MPI_Bcast(head, 2, MPI_LONG_LONG, 0, scene->comm));
  *length = (size_t)head[1];
  if (head[0] != FILE_OK) {
    PetscCall(SceneFaultAt(scene, 0, 0, NULL, "%s", wrong[head[0]]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (rank) PetscCall(PetscMalloc1(*length + 1, text));
  PetscCallMPI(MPI_Bcast(*text, (PetscMPIInt)(*length + 1), MPI_CHAR, 0, scene->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- text ---- */

/* Bytes of the UTF-8 character at s, 0 when it is none (also overlong forms, surrogates, beyond U+10FFFF). */
static size_t Utf8Length(const unsigned char *s, size_t left)
{
  static const unsigned long least[] = {0, 0, 0x80, 0x800, 0x10000};
  const size_t               n       = s[0] < 0x80 ? 1 : s[0] < 0xc2 ? 0 : s[0] < 0xe0 ? 2 : s[0] < 0xf0 ? 3 : s[0] < 0xf5 ? 4 : 0;
  unsigned long              c;

  if (n < 2) return n;
  if (n > left) return 0;
  c = s[0] & (0xffu >> (n + 1));
  for (size_t k = 1; k < n; k++) {
    if ((s[k] & 0xc0) != 0x80) return 0;
    c = c << 6 | (s[k] & 0x3f);
  }
  return c < least[n] || c > 0x10ffff || (c >= 0xd800 && c <= 0xdfff) ? 0 : n;
}

/* libyaml says neither line nor column for a bad byte, so look first. */
static PetscErrorCode CheckCharacters(Scene scene, const char *text, size_t length, const char *set, PetscBool *good)
{
  PetscInt line = 1, column = 1;

  PetscFunctionBegin;
  *good = PETSC_TRUE;
  for (size_t k = 0; k < length && *good;) {
    const unsigned char c = (unsigned char)text[k];
    const size_t        n = Utf8Length((const unsigned char *)text + k, length - k);

    if (n == 0) {
      PetscCall(SceneFaultAt(scene, line, column, set, "byte 0x%02x is not UTF-8 text; save the file as UTF-8", c));
      *good = PETSC_FALSE;
    } else if ((c < ' ' && c != '\t' && c != '\n' && c != '\r') || c == 0x7f) {
      PetscCall(SceneFaultAt(scene, line, column, set, "control character 0x%02x; a scene is plain text", c));
      *good = PETSC_FALSE;
    }
    if (c == '\n') {
      line++;
      column = 1;
    } else column++;
    k += n;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static char CharacterAt(const char *text, size_t length, size_t line, size_t column)
{
  size_t k = 0;

  for (; k < length && line; k++)
    if (text[k] == '\n') line--;
  for (; k < length && column; column--) k += PetscMax(1, Utf8Length((const unsigned char *)text + k, length - k));
  return k < length ? text[k] : 0;
}

typedef struct {
  Scene       scene;
  const char *set;
  SceneNode   root, at; /* at: the open map or list */
  char       *key;      /* waiting for its value; owned */
  PetscInt    key_line, key_column, depth, documents;
  PetscBool   stop;
} Builder;

/* A value or the start of a map or list: into the open parent. */
static PetscErrorCode AddValue(Builder *b, SceneNodeKind kind, const char *text, PetscBool plain, yaml_mark_t mark)
{
  SceneNode node;

  PetscFunctionBegin;
  PetscCall(SceneNodeCreate(kind, text, &node));
  node->plain  = plain;
  node->set    = b->set;
  node->line   = node->key_line   = (PetscInt)mark.line + 1;
  node->column = node->key_column = (PetscInt)mark.column + 1;
  if (b->at && b->at->kind == NODE_MAP) {
    node->key        = b->key;
    node->key_line   = b->key_line;
    node->key_column = b->key_column;
    b->key           = NULL;
  }
  if (b->at) SceneNodeAppend(b->at, node);
  else {
    PetscCall(SceneNodeDestroy(&b->root));
    b->root = node;
  }
  if (kind != NODE_TEXT) b->at = node;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddKey(Builder *b, const char *text, yaml_mark_t mark)
{
  const PetscInt  line = (PetscInt)mark.line + 1, column = (PetscInt)mark.column + 1;
  const SceneNode twin = SceneNodeChild(b->at, text);

  PetscFunctionBegin;
  if (twin) PetscCall(SceneFaultAt(b->scene, line, column, b->set, "key '%s' is given twice, first in line %d; keep one", text, (int)twin->key_line));
  if (!text[0] || strpbrk(text, ".[]")) PetscCall(SceneFaultAt(b->scene, line, column, b->set, "key '%s': a key is text without . [ ]", text));
  if (b->at->n >= MAX_KEYS) {
    PetscCall(SceneFaultAt(b->scene, line, column, b->set, "more than %d keys in one map", MAX_KEYS));
    b->stop = PETSC_TRUE;
  }
  PetscCall(PetscStrallocpy(text, &b->key));
  b->key_line   = line;
  b->key_column = column;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TakeEvent(Builder *b, const yaml_event_t *event)
{
  const yaml_mark_t   mark  = event->start_mark;
  const PetscInt      line  = (PetscInt)mark.line + 1, column = (PetscInt)mark.column + 1;
  const yaml_char_t  *anchor = NULL, *tag = NULL;
  const PetscBool     wants_key = (PetscBool)(b->at && b->at->kind == NODE_MAP && !b->key);
  const char         *text = NULL;

  PetscFunctionBegin;
  switch (event->type) {
  case YAML_DOCUMENT_START_EVENT:
    if (b->documents++) {
      PetscCall(SceneFaultAt(b->scene, line, column, b->set, "a second document (---); one file holds one scene"));
      b->stop = PETSC_TRUE;
    }
    break;
  case YAML_ALIAS_EVENT:
    PetscCall(SceneFaultAt(b->scene, line, column, b->set, "alias *%s; anchors and aliases are not used in scenes, write the value out", (const char *)event->data.alias.anchor));
    b->stop = PETSC_TRUE;
    break;
  case YAML_SCALAR_EVENT:
    anchor = event->data.scalar.anchor;
    tag    = event->data.scalar.tag;
    text   = (const char *)event->data.scalar.value;
    if (strlen(text) != event->data.scalar.length) {
      PetscCall(SceneFaultAt(b->scene, line, column, b->set, "a text with a zero byte (\\0); take it out"));
      b->stop = PETSC_TRUE;
    } else if (strlen(text) > BASE_LINE / 4) {
      PetscCall(SceneFaultAt(b->scene, line, column, b->set, "a text of %d characters; at most %d are allowed", (int)strlen(text), BASE_LINE / 4));
      b->stop = PETSC_TRUE;
    } else if (wants_key) PetscCall(AddKey(b, text, mark));
    else PetscCall(AddValue(b, NODE_TEXT, text, (PetscBool)(event->data.scalar.style == YAML_PLAIN_SCALAR_STYLE), mark));
    break;
  case YAML_SEQUENCE_START_EVENT:
  case YAML_MAPPING_START_EVENT:
    anchor = event->type == YAML_SEQUENCE_START_EVENT ? event->data.sequence_start.anchor : event->data.mapping_start.anchor;
    tag    = event->type == YAML_SEQUENCE_START_EVENT ? event->data.sequence_start.tag : event->data.mapping_start.tag;
    if (wants_key) {
      PetscCall(SceneFaultAt(b->scene, line, column, b->set, "a key that is a map or a list; a key is text"));
      b->stop = PETSC_TRUE;
    } else if (++b->depth > SCENE_DEPTH) {
      PetscCall(SceneFaultAt(b->scene, line, column, b->set, "nested deeper than %d levels", SCENE_DEPTH));
      b->stop = PETSC_TRUE;
    } else PetscCall(AddValue(b, event->type == YAML_SEQUENCE_START_EVENT ? NODE_LIST : NODE_MAP, NULL, PETSC_FALSE, mark));
    break;
  case YAML_SEQUENCE_END_EVENT:
  case YAML_MAPPING_END_EVENT:
    b->depth--;
    b->at = b->at->parent;
    break;
  default:
    break;
  }
  if (anchor) PetscCall(SceneFaultAt(b->scene, line, column, b->set, "anchor &%s; anchors and aliases are not used in scenes, write the value out", (const char *)anchor));
  if (tag) PetscCall(SceneFaultAt(b->scene, line, column, b->set, "tag %s; the table of keys says the types, take it out", (const char *)tag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneParse(Scene scene, const char *text, size_t length, const char *set, SceneNode *root)
{
  const PetscInt before = scene->n_faults;
  Builder        b      = {.scene = scene, .set = set};
  yaml_parser_t  parser;
  PetscBool      good, done = PETSC_FALSE;

  PetscFunctionBegin;
  *root = NULL;
  if (length >= 3 && !memcmp(text, "\xef\xbb\xbf", 3)) { /* byte order mark: an editor's habit */
    text += 3;
    length -= 3;
  }
  PetscCall(CheckCharacters(scene, text, length, set, &good));
  if (!good) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(yaml_parser_initialize(&parser), PETSC_COMM_SELF, PETSC_ERR_MEM, "libyaml cannot start");
  yaml_parser_set_encoding(&parser, YAML_UTF8_ENCODING);
  yaml_parser_set_input_string(&parser, (const unsigned char *)text, length);
  while (!done && !b.stop) {
    yaml_event_t   event;
    PetscErrorCode code;

    if (!yaml_parser_parse(&parser, &event)) {
      const yaml_mark_t mark = parser.problem_mark;

      code = SceneFaultAt(scene, (PetscInt)mark.line + 1, (PetscInt)mark.column + 1, set, "not YAML: %s%s%s%s", parser.problem ? parser.problem : "unreadable", parser.context ? " " : "", parser.context ? parser.context : "",
                          CharacterAt(text, length, mark.line, mark.column) == '\t' ? "; this is a tab, indent with blanks" : "; look at indentation, colons and brackets here and just above");
      b.stop = PETSC_TRUE;
    } else {
      code = TakeEvent(&b, &event);
      done = (PetscBool)(event.type == YAML_STREAM_END_EVENT);
      yaml_event_delete(&event);
    }
    if (code) yaml_parser_delete(&parser);
    PetscCall(code);
  }
  yaml_parser_delete(&parser);
  PetscCall(PetscFree(b.key));
  if (b.stop) PetscCall(SceneNodeDestroy(&b.root)); /* half a tree would only raise faults that are not there */
  else if (!b.root && scene->n_faults == before) PetscCall(SceneFaultAt(scene, 1, 1, set, "%s", set ? "no value after =" : "the file is empty; a scene has time, materials and bodies, see `cleave new`"));
  *root = b.root;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- overrides ---- */

/* Put `value` in the place of `old` (same parent), or append it when old is NULL. */
static PetscErrorCode Place(SceneNode parent, SceneNode old, SceneNode value)
{
  PetscFunctionBegin;
  if (!old) SceneNodeAppend(parent, value);
  else {
    SceneNode *link = &parent->first;

    while (*link != old) link = &(*link)->next;
    *link         = value;
    value->next   = old->next;
    value->parent = parent;
    if (parent->last == old) parent->last = value;
    PetscCall(SceneNodeDestroy(&old));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "conditions[2].velocity.y=5 mm/s": walk the path, making the maps that are missing, and place the value. */
PetscErrorCode SceneOverride(Scene scene, const char *set)
{
  const char *equal = strchr(set, '='), *path = set;
  SceneNode   value, at = scene->root;
  PetscInt    depth = 0;

  PetscFunctionBegin;
  if (!equal || equal == set) {
    PetscCall(SceneFaultAt(scene, 0, 0, set, "no path=value; write it like time.end=5 ms"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SceneParse(scene, equal + 1, strlen(equal + 1), set, &value));
  if (!value) PetscFunctionReturn(PETSC_SUCCESS);
  while (value) {
    SceneNode next = NULL, *slot = &next;
    char      part[256];
    size_t    n;
    PetscBool item = (PetscBool)(*path == '['), last;

    path += item;
    n = strcspn(path, item ? "]=" : ".[=");
    if (n == 0 || n >= sizeof(part) || (item && path[n] != ']') || ++depth > SCENE_DEPTH) {
      PetscCall(SceneFaultAt(scene, 0, 0, set, "the path before = is broken; write it like conditions[0].velocity.y=5 mm/s"));
      break;
    }
    memcpy(part, path, n);
    part[n] = 0;
    path += n + item;
    last = (PetscBool)(*path == '=');
    if (item) {
      char      *end;
      const long i = strtol(part, &end, 10);

      if (at->kind != NODE_LIST || *end || i < 0 || i > at->n) {
        PetscCall(SceneFaultAt(scene, 0, 0, set, "[%s] is not an item here; %s%d items, counted from 0", part, at->kind == NODE_LIST ? "there are " : "this is no list, there are ", (int)(at->kind == NODE_LIST ? at->n : 0)));
        break;
      }
      *slot = SceneNodeItem(at, (PetscInt)i);
    } else {
      if (at->kind != NODE_MAP) {
        PetscCall(SceneFaultAt(scene, 0, 0, set, "'%s' stands under a %s, not under a map of keys", part, at->kind == NODE_LIST ? "list; give an item, like [0]" : "value"));
        break;
      }
      *slot = SceneNodeChild(at, part);
    }
    if (last || !next) {
      SceneNode node = value;

      if (!last) PetscCall(SceneNodeCreate(*path == '[' ? NODE_LIST : NODE_MAP, NULL, &node));
      node->set = set;
      if (!item) {
        PetscCall(PetscFree(node->key));
        PetscCall(PetscStrallocpy(part, &node->key));
      }
      PetscCall(Place(at, next, node));
      if (last) value = NULL;
      next = node;
    }
    at = next;
    if (*path == '.') path++;
  }
  PetscCall(SceneNodeDestroy(&value));
  PetscFunctionReturn(PETSC_SUCCESS);
}
