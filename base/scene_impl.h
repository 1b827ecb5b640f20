/*
  scene_impl.h - what the scene_*.c files share: the table's rows, the tree, the fault list.

  scene_read.c makes the tree from text, scene_check.c holds it against the table (scene_keys.c), scene_rules.c asks
  what no single key can know, scene_defaults.c fills in, scene_values.c answers getters, scene_write.c prints.
*/
#pragma once
#include "scene.h"

typedef enum {
  SCENE_MAP,    /* named keys, one row each; with choices or SCENE_OR_FILE also one word in place of the map */
  SCENE_NAMES,  /* map of the user's names */
  SCENE_ITEMS,  /* list of maps */
  SCENE_REAL,   /* number with unit */
  SCENE_INT,    /* whole number */
  SCENE_BOOL,
  SCENE_TEXT,
  SCENE_FILE,   /* a file that must exist */
  SCENE_CHOICE, /* one word of choices */
  SCENE_VECTOR, /* [a, b] in 2D, [a, b, c] in 3D */
  SCENE_TABLE,  /* quantity in time: value, table or ramp */
  SCENE_WORDS   /* one word of choices or a list of them; no choices: any text */
} SceneType;

enum {
  SCENE_REQUIRED = 1 << 0,
  SCENE_LATER    = 1 << 1,  /* typed and checked, then refused: not covered yet */
  SCENE_AUTO     = 1 << 2,  /* the word `auto` is a value; getters give 0 */
  SCENE_ONE_OF   = 1 << 3,  /* exactly one of the siblings with this flag */
  SCENE_FILL     = 1 << 4,  /* a section that counts, with its defaults, even when not written */
  SCENE_OR_FILE  = 1 << 5,  /* a map, or the name of a file */
  SCENE_EMPTY    = 1 << 6,  /* text: may be "" */
  SCENE_2D       = 1 << 7,  /* only with dimension: 2, 3, method: fem, dem; several of time.method: static, explicit, implicit, modal */
  SCENE_3D       = 1 << 8,
  SCENE_FEM      = 1 << 9,
  SCENE_DEM      = 1 << 10,
  SCENE_STATIC   = 1 << 11,
  SCENE_EXPLICIT = 1 << 12,
  SCENE_IMPLICIT = 1 << 13,
  SCENE_MODAL    = 1 << 14,
  SCENE_TIMES    = SCENE_STATIC | SCENE_EXPLICIT | SCENE_IMPLICIT | SCENE_MODAL
};

typedef struct {
  const char *path; /* "materials.*.young": * is a user's name, [] a list item */
  SceneType   type;
  const char *unit;     /* as resolved.yaml writes it; "-" none; "" not a quantity */
  const char *preset;   /* default as YAML; "a|b": a in 2D, b in 3D; NULL none */
  const char *range;    /* "(0, inf)" in `unit`; NULL any */
  const char *choices;  /* words apart by blanks; ending ~ : later; ending () : takes a group, reaction(load) */
  const char *equation; /* docs/theory.md, or "-" */
  const char *help;
  unsigned    flags;
} SceneKey;

/* The table. Root is the row with path "". */
PetscInt        SceneKeyCount(void);
const SceneKey *SceneKeyRow(PetscInt i);
const SceneKey *SceneKeyNext(const SceneKey *parent, const SceneKey *before); /* children in table order; NULL at the end */
const SceneKey *SceneKeyChild(const SceneKey *parent, const char *name);      /* NULL when unknown; any name under SCENE_NAMES */
const SceneKey *SceneKeyItem(const SceneKey *parent);                         /* the row of a list's items, NULL when none */
const SceneKey *SceneKeyFind(const char *path);                               /* of a concrete path, materials.concrete.young */
const char     *SceneKeyName(const SceneKey *key);                            /* last part of the path */
PetscInt        SceneKeyChoices(const SceneKey *key, PetscInt max, char word[][32], PetscBool later[], PetscBool group[]);
PetscErrorCode  SceneKeyRange(const SceneKey *key, PetscReal *low, PetscReal *high, PetscBool *low_in, PetscBool *high_in);
void            SceneKeyDefault(const SceneKey *key, PetscInt dimension, size_t size, char text[]); /* one side of "a|b" */

typedef enum { NODE_TEXT, NODE_MAP, NODE_LIST } SceneNodeKind;
typedef enum { SOURCE_USER, SOURCE_DEFAULT, SOURCE_DERIVED } SceneSource;

typedef struct _SceneNode *SceneNode;
struct _SceneNode {
  SceneNodeKind   kind;
  SceneNode       parent, first, last, next; /* children in the order written; owned by the parent */
  PetscInt        n;                         /* children */
  char           *key, *text;                /* owned; key NULL for list items, text NULL for maps and lists */
  PetscBool       plain;                     /* text without quotes */
  PetscInt        line, column, key_line, key_column; /* from 1; the key's are the value's for list items */
  const char     *set;                       /* the --set text it came from; NULL: the file */
  SceneSource     source;
  char           *why;                       /* of a derived value; owned */
  const SceneKey *row;                       /* set by the check */
  PetscBool       good;                      /* value is valid */
  PetscReal       value;                     /* of a number, SI; 0 for auto */
};

typedef struct {
  PetscInt    line, column; /* 0: no place in the file */
  const char *set;
  char       *text;
} SceneFault;

#define SCENE_FAULTS 20
#define SCENE_DEPTH  32

struct _p_Scene {
  MPI_Comm   comm;
  char      *file;
  PetscInt   dimension;    /* 0 while unknown */
  PetscInt   is_static;    /* time.method; -1 while unknown */
  unsigned   time;         /* time.method as its flag, SCENE_STATIC ..; 0 while unknown */
  SceneNode  root;         /* a map */
  SceneNode  spare;        /* defaults asked for in sections that are not there; a list */
  PetscInt   n_sets;
  char     **sets;         /* copies of the overrides */
  PetscInt   n_faults;     /* all; the first SCENE_FAULTS are kept */
  SceneFault fault[SCENE_FAULTS];
};

/* Nodes */
PetscErrorCode SceneNodeCreate(SceneNodeKind kind, const char *text, SceneNode *node);
PetscErrorCode SceneNodeDestroy(SceneNode *node);
void           SceneNodeAppend(SceneNode parent, SceneNode child);
SceneNode      SceneNodeChild(SceneNode map, const char *key);
SceneNode      SceneNodeItem(SceneNode list, PetscInt i);
void           SceneNodePath(SceneNode node, size_t size, char path[]); /* "conditions[2].fix" */
PetscBool      SceneNodeIs(SceneNode node, const char *text);           /* node is not NULL and holds this text */

/* Text to tree. A fault is recorded in scene and *root is NULL. set: the override it belongs to, or NULL. */
PetscErrorCode SceneParse(Scene scene, const char *text, size_t length, const char *set, SceneNode *root);
/* File to text on every rank; faults are recorded, *text is NULL then. Caller frees. */
PetscErrorCode SceneReadFile(Scene scene, char **text, size_t *length);
PetscErrorCode SceneOverride(Scene scene, const char *set);

/* Faults: at the key or at the value of a node. */
PetscErrorCode SceneFaultAt(Scene scene, PetscInt line, PetscInt column, const char *set, const char *format, ...) PETSC_ATTRIBUTE_FORMAT(5, 6);
PetscErrorCode SceneFaultKey(Scene scene, SceneNode node, const char *format, ...) PETSC_ATTRIBUTE_FORMAT(3, 4);
PetscErrorCode SceneFaultValue(Scene scene, SceneNode node, const char *format, ...) PETSC_ATTRIBUTE_FORMAT(3, 4);
PetscErrorCode SceneFaultsRaise(Scene scene); /* report all, in the order of the file; the error when there is one */

PetscErrorCode SceneCheck(Scene scene); /* the whole tree against the table */
PetscErrorCode SceneCheckNode(Scene scene, SceneNode node, const SceneKey *row);
PetscErrorCode SceneRules(Scene scene); /* what needs more than one key */
PetscErrorCode SceneFill(Scene scene);  /* add the defaults that count */
PetscErrorCode SceneDefaultNode(Scene scene, const SceneKey *row, SceneNode parent, SceneNode *node); /* a row's default, appended to parent */

/* "explicit", or "explicit or implicit": the methods of time among flags. */
void SceneTimeWords(unsigned flags, size_t size, char words[]);

/* Why a row does not apply at this place; NULL when it does or when that is unknown. parent: the section's node. */
const char *SceneKeyMisplaced(Scene scene, SceneNode parent, const SceneKey *row);
