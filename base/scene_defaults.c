/*
  scene_defaults.c - the defaults that count in a scene, as nodes of the tree.

  A checked scene is filled once, so that getters and resolved.yaml see user's and default values alike; a default of a
  section that is not there is made when it is asked for (scene_values.c).
*/
#include "scene_impl.h"
#include <string.h>

static void MarkDefault(SceneNode node)
{
  node->source = SOURCE_DEFAULT;
  node->line = node->column = node->key_line = node->key_column = 0;
  for (SceneNode child = node->first; child; child = child->next) MarkDefault(child);
}

/* A new node that holds the row's default, under the given key. */
PetscErrorCode SceneDefaultNode(Scene scene, const SceneKey *row, SceneNode parent, SceneNode *node)
{
  char text[256];

  PetscFunctionBegin;
  SceneKeyDefault(row, scene->dimension, sizeof(text), text);
  PetscCall(SceneParse(scene, text, strlen(text), NULL, node));
  PetscCheck(*node, PETSC_COMM_SELF, PETSC_ERR_PLIB, "Default '%s' of key %s is not YAML", text, row->path);
  PetscCall(PetscStrallocpy(SceneKeyName(row), &(*node)->key));
  SceneNodeAppend(parent, *node);
  MarkDefault(*node);
  PetscCall(SceneCheckNode(scene, *node, row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A default that means nothing beside what the user chose. */
static PetscBool IsIdle(SceneNode parent, const SceneKey *row)
{
  const char     *name = SceneKeyName(row);
  const SceneNode law = SceneNodeChild(parent, "law"), rule = SceneNodeChild(parent, "elasticity");

  if (!strcmp(name, "length_unit")) return (PetscBool)(SceneNodeChild(parent, "geometry") && SceneNodeChild(parent, "geometry")->kind == NODE_MAP);
  if (!strcmp(name, "spread") || !strcmp(name, "seed")) return (PetscBool)(SceneNodeChild(parent, "file") != NULL);
  if (!strcmp(name, "softening")) return (PetscBool)!SceneNodeIs(law, "cohesive");
  if (!strcmp(name, "criterion") || !strncmp(name, "mu_", 3)) return (PetscBool) !(SceneNodeIs(law, "cohesive") || SceneNodeIs(law, "published"));
  if (!strcmp(name, "interaction_range") && SceneNodeIs(SceneNodeChild(parent, "areas"), "polyhedron")) return PETSC_FALSE;
  if (!strcmp(name, "interaction_range") || !strcmp(name, "area_factor")) return (PetscBool) !(SceneNodeIs(rule, "onate2015") || SceneNodeIs(rule, "given"));
  if (!strncmp(name, "factor_", 7)) return (PetscBool) !(SceneNodeIs(rule, "onate2015") || SceneNodeIs(rule, "kdem"));
  if (!strcmp(name, "poisson_term") || !strcmp(name, "areas")) return (PetscBool)!SceneNodeIs(rule, "kdem");
  return PETSC_FALSE;
}

static PetscErrorCode FillMap(Scene scene, SceneNode node)
{
  PetscFunctionBegin;
  for (const SceneKey *row = SceneKeyNext(node->row, NULL); row; row = SceneKeyNext(node->row, row)) {
    SceneNode child = SceneNodeChild(node, SceneKeyName(row));

    if (child || (row->flags & (SCENE_LATER | SCENE_ONE_OF)) || SceneKeyMisplaced(scene, node, row)) continue;
    if (row->flags & SCENE_FILL) {
      PetscCall(SceneNodeCreate(NODE_MAP, NULL, &child));
      PetscCall(PetscStrallocpy(SceneKeyName(row), &child->key));
      child->row    = row;
      child->good   = PETSC_TRUE;
      child->source = SOURCE_DEFAULT;
      SceneNodeAppend(node, child);
    } else if (row->preset && !IsIdle(node, row)) PetscCall(SceneDefaultNode(scene, row, node, &child));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Recursion is bounded by the table's depth. */
static PetscErrorCode FillNode(Scene scene, SceneNode node)
{
  PetscFunctionBegin;
  if (!node->row || node->kind == NODE_TEXT || (node->row->type != SCENE_MAP && node->row->type != SCENE_NAMES && node->row->type != SCENE_ITEMS)) PetscFunctionReturn(PETSC_SUCCESS);
  if (node->row->type == SCENE_MAP) PetscCall(FillMap(scene, node));
  for (SceneNode child = node->first; child; child = child->next) PetscCall(FillNode(scene, child));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneFill(Scene scene)
{
  return FillNode(scene, scene->root);
}
