/*
  fem_fields.c - a model's frame: its block of points, elements and the fields asked for.

  A recovered field has one value per node and material. Where materials meet, the frame repeats the node once for each
  further material: same place, same displacement, its own stress; the elements of that material use the copy. So a point has one
  value, a jump stays a jump, and a body stays one block. Copies come after all nodes.
*/
#include "fem_recover.h"

/* Rank 0: which slot each point of a frame shows, and which points each element has. */
PetscErrorCode FemRecoveryMapPoints(FemModel model)
{
  FemRecovery r = model->recovery;
  PetscReal  *own, *all;
  PetscInt   *law, *point, room, entries;

  PetscFunctionBegin;
  if (r->mapped) PetscFunctionReturn(PETSC_SUCCESS);
  r->mapped = PETSC_TRUE;
  PetscCall(PetscMalloc2(model->n_cells, &own, model->rank ? 0 : model->N_cells, &all));
  for (PetscInt c = 0; c < model->n_cells; c++) own[c] = r->law[model->cell_material[c]];
  PetscCall(FemGather(model, model->home_cells, 1, own, all));
  if (!model->rank) {
    room    = model->N_nodes * r->sides;
    entries = model->start_all[model->N_cells];
    PetscCall(PetscMalloc2(room, &law, room, &point));
    PetscCall(PetscMalloc2(room, &r->point_slot, room, &r->point_node));
    PetscCall(PetscMalloc1(entries, &r->cell_point));
    for (PetscInt k = 0; k < room; k++) law[k] = -1;
    for (PetscInt c = 0; c < model->N_cells; c++)
      for (PetscInt e = model->start_all[c]; e < model->start_all[c + 1]; e++) { /* insert, ascending: the order of the slots */
        PetscInt *list = &law[model->node_all[e] * r->sides], m = (PetscInt)all[c], j = 0;

        while (j < r->sides && list[j] >= 0 && list[j] < m) j++;
        if (j == r->sides || list[j] == m) continue;
        for (PetscInt l = r->sides - 1; l > j; l--) list[l] = list[l - 1];
        list[j] = m;
      }
    r->n_points = model->N_nodes;
    for (PetscInt i = 0; i < model->N_nodes; i++)
      for (PetscInt k = 0; k < r->sides && law[i * r->sides + k] >= 0; k++) {
        const PetscInt p = k == 0 ? i : r->n_points++;

        point[i * r->sides + k] = p;
        r->point_node[p]        = i;
        r->point_slot[p]        = i * r->sides + k;
      }
    for (PetscInt c = 0; c < model->N_cells; c++)
      for (PetscInt e = model->start_all[c]; e < model->start_all[c + 1]; e++) {
        PetscInt slot = model->node_all[e] * r->sides;

        while (law[slot] != (PetscInt)all[c]) slot++;
        r->cell_point[e] = point[slot];
      }
    PetscCall(PetscFree2(law, point));
  }
  PetscCall(PetscFree2(own, all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelGetPoints(FemModel model, PetscInt *n, const PetscInt **node)
{
  PetscFunctionBegin;
  PetscCheck(model && model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetUp() first");
  PetscCall(FemRecoveryCreate(model));
  PetscCall(FemRecoveryMapPoints(model));
  *n = model->recovery->n_points;
  if (node) *node = model->recovery->point_node;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a node's material carries without strain, as its first element of that material sees it. own [n_own][sides][12] */
static PetscErrorCode AddPrestress(FemModel model, PetscReal *own)
{
  FemRecovery r = model->recovery;
  char       *done;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(model->n_own * r->sides, &done));
  for (PetscInt c = 0; c < model->n_cells; c++)
    for (PetscInt e = model->cell_start[c]; e < model->cell_start[c + 1]; e++)
      for (PetscInt i = model->cell_node[e], k = i * r->sides; i < model->n_own && k < (i + 1) * r->sides; k++) {
        PetscReal x[3] = {0, 0, 0};

        if (done[k] || r->side[k] < 0 || r->side[k] != r->law[model->cell_material[c]]) continue;
        for (PetscInt d = 0; d < model->dim; d++) x[d] = model->x[i * model->dim + d];
        FemAddPrestressAt(model, c, x, &own[12 * k], &own[12 * k + 6]);
        done[k] = 1;
      }
  PetscCall(PetscFree(done));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Recovered Voigt stress and strain of every point on rank 0, [n_points][6] each. The recovery has been done. */
static PetscErrorCode GatherPoints(FemModel model, PetscReal *stress, PetscReal *strain)
{
  FemRecovery    r     = model->recovery;
  const PetscInt width = r->sides * 12;
  PetscReal     *own, *all;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(model->n_own * width, &own));
  PetscCall(PetscMalloc1(model->rank ? 0 : model->N_nodes * width, &all));
  for (PetscInt k = 0; k < model->n_own * r->sides; k++)
    if (r->side[k] >= 0) FemStressExpand(model->dim, &model->law[r->side[k]], &r->value[k * r->parts], &own[12 * k], &own[12 * k + 6]);
  if (model->pre.n) PetscCall(AddPrestress(model, own));
  PetscCall(FemGather(model, model->home, width, own, all));
  for (PetscInt p = 0; p < r->n_points; p++) {
    if (stress) PetscCall(PetscArraycpy(&stress[6 * p], &all[12 * r->point_slot[p]], 6));
    if (strain) PetscCall(PetscArraycpy(&strain[6 * p], &all[12 * r->point_slot[p] + 6], 6));
  }
  PetscCall(PetscFree(own));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelRecover(FemModel model, PetscReal *stress, PetscReal *strain)
{
  PetscFunctionBegin;
  PetscCheck(model && model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Call FemModelSetUp() first");
  PetscCall(FemRecoveryCreate(model));
  PetscCall(FemRecoveryMapPoints(model));
  PetscCall(FemRecover(model, &model->recovery->all));
  PetscCall(GatherPoints(model, stress, strain));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- the frame ---- */

enum { PLAIN_POINT, PLAIN_CELL, RECOVERED, ESTIMATED };

static const struct {
  const char *name, *unit;
  PetscInt    made, components;
} field[] = {{"displacement", "m", PLAIN_POINT, 3}, {"velocity", "m/s", PLAIN_POINT, 3},  {"reaction", "N", PLAIN_POINT, 3},         {"stress", "Pa", RECOVERED, 6},
             {"strain", "-", RECOVERED, 6},         {"von_mises", "Pa", RECOVERED, 1},    {"principal_stress", "Pa", RECOVERED, 3}, {"error", "J/m3", ESTIMATED, 1},
             {"element_stress", "Pa", PLAIN_CELL, 6}, {"element_strain", "-", PLAIN_CELL, 6}};
enum { FIELDS = sizeof(field) / sizeof(field[0]) };

/* One field at the frame's points or elements, on rank 0. stress and strain are there when something recovered is asked for. */
static PetscErrorCode FillField(FemModel model, PetscInt k, PetscInt n_points, const PetscReal *stress, const PetscReal *strain, PetscReal *data)
{
  PetscFunctionBegin;
  if (field[k].made == PLAIN_POINT) {
    PetscCall(FemModelGetField(model, field[k].name, data));
    for (PetscInt p = model->N_nodes; p < n_points; p++)
      for (PetscInt d = 0; d < 3; d++) data[3 * p + d] = data[3 * model->recovery->point_node[p] + d];
  } else if (field[k].made == PLAIN_CELL) PetscCall(FemModelGetField(model, field[k].name, data));
  else if (field[k].made == ESTIMATED) {
    PetscReal *own;

    PetscCall(PetscMalloc1(model->n_cells, &own));
    PetscCall(FemEstimateError(model, own));
    PetscCall(FemGather(model, model->home_cells, 1, own, data));
    PetscCall(PetscFree(own));
  } else {
    for (PetscInt p = 0; p < n_points; p++) {
      if (field[k].components == 6) PetscCall(PetscArraycpy(&data[6 * p], field[k].unit[0] == 'P' ? &stress[6 * p] : &strain[6 * p], 6));
      else if (field[k].components == 1) data[p] = FemVonMises(&stress[6 * p]);
      else FemPrincipal(&stress[6 * p], &data[3 * p], NULL);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemWriteFrame(FemModel model, Output output)
{
  const PetscInt root   = model->rank == 0 ? 1 : 0;
  OutputBlock    block  = {.name = model->name, .n_points = root * model->N_nodes, .x = model->x_all, .n_cells = root * model->N_cells, .start = model->start_all, .node = model->node_all, .type = model->vtk_all};
  OutputArray    array[FIELDS];
  PetscReal     *data[FIELDS], *stress = NULL, *strain = NULL, *x = NULL;
  PetscBool      recover = PETSC_FALSE, estimate = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < FIELDS; k++)
    if (OutputWants(output, field[k].name)) {
      if (field[k].made == RECOVERED) recover = PETSC_TRUE;
      if (field[k].made == ESTIMATED) estimate = PETSC_TRUE;
    }
  if (recover || estimate) {
    PetscCall(FemRecoveryCreate(model));
    PetscCall(FemRecover(model, &model->recovery->all));
  }
  if (recover) {
    FemRecovery r = model->recovery;

    PetscCall(FemRecoveryMapPoints(model));
    block.n_points = r->n_points;
    PetscCall(PetscMalloc3(6 * block.n_points, &stress, 6 * block.n_points, &strain, 3 * block.n_points, &x));
    PetscCall(GatherPoints(model, stress, strain));
    for (PetscInt p = 0; p < block.n_points; p++) PetscCall(PetscArraycpy(&x[3 * p], &model->x_all[3 * r->point_node[p]], 3));
    block.x    = x;
    block.node = r->cell_point;
  }
  for (PetscInt k = 0; k < FIELDS; k++) {
    const PetscBool at_points = (PetscBool)(field[k].made == PLAIN_POINT || field[k].made == RECOVERED);

    if (!OutputWants(output, field[k].name)) continue;
    PetscCall(PetscMalloc1(field[k].components * (at_points ? block.n_points : block.n_cells), &data[block.n_arrays]));
    PetscCall(FillField(model, k, block.n_points, stress, strain, data[block.n_arrays]));
    array[block.n_arrays] = (OutputArray){field[k].name, field[k].unit, at_points ? OUTPUT_POINT_DATA : OUTPUT_CELL_DATA, field[k].components, data[block.n_arrays]};
    block.n_arrays++;
  }
  block.array = array;
  PetscCall(OutputFrameBlock(output, &block));
  for (PetscInt k = 0; k < block.n_arrays; k++) PetscCall(PetscFree(data[k]));
  if (recover) PetscCall(PetscFree3(stress, strain, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
