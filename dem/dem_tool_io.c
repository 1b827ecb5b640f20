/* dem_tool_io.c - what a tool tells: history, frames, checkpoint. */
#include "dem_tool_impl.h"

static PetscInt Contacts(DemModel model, const DemTool *tool)
{
  PetscInt n = 0;

  for (PetscInt b = 0; b < model->blocks.n_blocks; b++) n += tool->n_contacts[b];
  return n;
}

PetscErrorCode DemModelGetTool(DemModel model, const char *name, DemToolState *s)
{
  const PetscInt k = DemToolFind_Internal(model, name);
  const DemTool *tool;

  PetscFunctionBegin;
  PetscCheck(model->ready, model->comm, PETSC_ERR_ORDER, "Call DemModelSetUp() before asking for a tool's state");
  BaseCheckInput(k >= 0, model->comm, "There is no tool '%s'", name);
  tool = model->tool[k];
  PetscCall(PetscMemzero(s, sizeof(*s)));
  for (PetscInt d = 0; d < 3; d++) {
    s->centre[d]   = tool->centre0[d] + tool->shift[d];
    s->shift[d]    = tool->shift[d];
    s->velocity[d] = tool->velocity[d];
    s->spin[d]     = tool->spin[d];
    s->momentum[d] = tool->o.motion == DEM_TOOL_FREE ? tool->mass * tool->v[d] : 0;
    s->angular[d]  = tool->L[d];
    s->force[d]    = tool->force[d];
    s->torque[d]   = tool->torque[d];
  }
  for (PetscInt d = 0; d < 4; d++) s->quaternion[d] = tool->quaternion[d];
  s->work     = tool->work;
  s->mass     = tool->mass;
  s->contacts = Contacts(model, tool);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Components of a quantity of a tool: 0 when it has none of that name. */
PetscInt DemToolQuantity_Internal(PetscInt dim, const char *quantity, PetscInt *first, const char **unit)
{
  static const char *const known[] = {"reaction", "force", "displacement", "velocity", "torque", "work"};
  static const char *const units[] = {"N", "N", "m", "m/s", "N m", "J"};

  *first = 0;
  for (PetscInt k = 0; k < 6; k++)
    if (!strcmp(quantity, known[k])) {
      *unit = units[k];
      if (k == 4) *first = dim == 2 ? 2 : 0; /* in the plane a torque is about z */
      return k == 5 ? 1 : k == 4 && dim == 2 ? 1 : dim;
    }
  return 0;
}

PetscReal DemToolHistory_Internal(DemModel model, PetscInt k, const char *quantity, PetscInt c)
{
  const DemTool *tool = model->tool[k];

  switch (quantity[0]) {
  case 'd': return tool->shift[c];
  case 'v': return tool->velocity[c];
  case 't': return tool->torque[c];
  case 'w': return tool->work;
  default: return tool->force[c];
  }
}

/* Block "tool-NAME": the shape at the start, and the displacement that takes it to where it is now. */
PetscErrorCode DemToolsWrite_Internal(DemModel model, Output output)
{
  PetscReal middle[3] = {0}, size = 0;

  PetscFunctionBegin;
  for (PetscInt d = 0; d < model->dim; d++) {
    middle[d] = 0.5 * (model->body.low[d] + model->body.high[d]);
    size      = PetscMax(size, model->body.high[d] - model->body.low[d]);
  }
  for (PetscInt k = 0; k < model->n_tools; k++) {
    const DemTool *tool = model->tool[k];
    DemSurface     s;
    PetscReal     *u, *force;
    PetscInt      *start;
    unsigned char *type;
    char           name[160];
    OutputArray    array[2];
    OutputBlock    block = {0};

    PetscCall(DemToolPicture_Internal(tool, model->dim, middle, size, &s));
    PetscCall(PetscMalloc4(3 * s.n_nodes, &u, 3 * s.n, &force, s.n + 1, &start, s.n, &type));
    for (PetscInt i = 0; i < s.n_nodes; i++) {
      const PetscReal w[3] = {s.x[3 * i] - tool->centre0[0], s.x[3 * i + 1] - tool->centre0[1], s.x[3 * i + 2] - tool->centre0[2]};

      for (PetscInt d = 0; d < 3; d++) u[3 * i + d] = tool->shift[d] + (tool->rotates ? tool->turn[d][0] * w[0] + tool->turn[d][1] * w[1] + tool->turn[d][2] * w[2] - w[d] : 0);
    }
    for (PetscInt c = 0; c <= s.n; c++) start[c] = model->dim * c;
    for (PetscInt c = 0; c < s.n; c++) {
      type[c] = model->dim == 3 ? 5 : 3;
      for (PetscInt d = 0; d < 3; d++) force[3 * c + d] = tool->force[d];
    }
    PetscCall(BaseFormat(name, "tool-%s", tool->name));
    array[0] = (OutputArray){"displacement", "m", OUTPUT_POINT_DATA, 3, u};
    array[1] = (OutputArray){"tool_force", "N", OUTPUT_CELL_DATA, 3, force};
    block    = (OutputBlock){name, s.n_nodes, s.x, s.n, start, s.corner, type, 2, array};
    PetscCall(OutputFrameBlock(output, &block));
    PetscCall(PetscFree4(u, force, start, type));
    PetscCall(DemSurfaceDestroy(&s));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

enum { ROW = 17 };

PetscErrorCode DemToolPack_Internal(DemTool *tool, PetscBool put, PetscReal row[DEM_TOOL_STATE])
{
  PetscReal *const part[] = {tool->shift, tool->quaternion, &tool->angle, &tool->along, &tool->along_v, &tool->angle_v, tool->velocity, tool->spin, tool->moved, tool->turned, tool->moved_given, &tool->turned_given,
                             tool->v,     tool->L,          tool->force,  tool->torque, tool->force_old, tool->torque_old, &tool->work};
  const PetscInt   size[] = {3, 4, 1, 1, 1, 1, 3, 3, 3, 3, 3, 1, 3, 3, 3, 3, 3, 3, 1};
  PetscInt         at = 0;

  PetscFunctionBegin;
  for (size_t k = 0; k < sizeof(size) / sizeof(size[0]); k++)
    for (PetscInt i = 0; i < size[k]; i++, at++)
      if (put) row[at] = part[k][i];
      else part[k][i] = row[at];
  PetscCheck(at <= DEM_TOOL_STATE, PETSC_COMM_SELF, PETSC_ERR_PLIB, "State of a tool has %" PetscInt_FMT " numbers", at);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemToolsSave_Internal(DemModel model, Checkpoint c)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_tools; k++) {
    DemTool  *tool = model->tool[k];
    PetscInt  n    = Contacts(model, tool), all = n, at = 0, *particle, *number;
    PetscReal row[DEM_TOOL_STATE] = {0}, *data, *rows;
    char      name[64];

    PetscCall(DemToolPack_Internal(tool, PETSC_TRUE, row));
    PetscCall(BaseFormat(name, "dem/tool_%" PetscInt_FMT "_state", k));
    PetscCall(CheckpointWriteReal(c, name, DEM_TOOL_STATE, row));
    PetscCall(BaseFormat(name, "dem/tool_%" PetscInt_FMT "_contacts", k));
    if (model->ranks) PetscCallMPI(MPI_Allreduce(&n, &all, 1, MPIU_INT, MPI_SUM, model->comm));
    PetscCall(CheckpointWriteInt(c, name, 1, &all));
    if (!all) continue;
    PetscCall(PetscMalloc2(n, &particle, ROW * n, &data));
    for (PetscInt b = 0; b < model->blocks.n_blocks; b++)
      for (PetscInt i = 0; i < tool->n_contacts[b]; i++, at++) {
        const DemToolContact *s = &tool->contact[b][i];

        particle[at] = model->ranks ? model->ranks->id[s->p] : s->p;
        for (PetscInt d = 0; d < 3; d++) data[ROW * at + d] = s->n[d];
        data[ROW * at + 3] = s->radius;
        data[ROW * at + 4] = s->size;
        data[ROW * at + 5] = s->energy;
        PetscCall(PetscMemcpy(&data[ROW * at + 6], &s->history, sizeof(s->history)));
      }
    number = particle;
    rows   = data;
    if (model->ranks) { /* by particle; contacts of one particle stay in their order */
      PetscCall(DemGatherInts_Internal(model, n, particle, 1, particle, &all, &number));
      PetscCall(DemGatherReals_Internal(model, n, particle, ROW, data, &all, &rows));
    }
    PetscCall(BaseFormat(name, "dem/tool_%" PetscInt_FMT "_particle", k));
    PetscCall(CheckpointWriteInt(c, name, all, number));
    PetscCall(BaseFormat(name, "dem/tool_%" PetscInt_FMT "_history", k));
    PetscCall(CheckpointWriteReal(c, name, ROW * all, rows));
    if (model->ranks) {
      PetscCall(PetscFree(number));
      PetscCall(PetscFree(rows));
    }
    PetscCall(PetscFree2(particle, data));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemToolsLoad_Internal(DemModel model, Checkpoint c)
{
  PetscFunctionBegin;
  PetscCheck(sizeof(DemContactHistory) == (ROW - 6) * sizeof(PetscReal), PETSC_COMM_SELF, PETSC_ERR_PLIB, "A contact's history has another size than the checkpoint's rows");
  for (PetscInt k = 0; k < model->n_tools; k++) {
    DemTool  *tool = model->tool[k];
    PetscInt  n, at = 0, *particle;
    PetscReal row[DEM_TOOL_STATE], *data;
    char      name[64];

    PetscCall(BaseFormat(name, "dem/tool_%" PetscInt_FMT "_state", k));
    PetscCall(CheckpointReadReal(c, name, DEM_TOOL_STATE, row));
    PetscCall(DemToolPack_Internal(tool, PETSC_FALSE, row));
    DemToolPose_Internal(tool);
    PetscCall(BaseFormat(name, "dem/tool_%" PetscInt_FMT "_contacts", k));
    PetscCall(CheckpointReadInt(c, name, 1, &n));
    for (PetscInt b = 0; b < model->blocks.n_blocks; b++) tool->n_contacts[b] = 0;
    if (!n) continue;
    PetscCall(PetscMalloc2(n, &particle, ROW * n, &data));
    PetscCall(BaseFormat(name, "dem/tool_%" PetscInt_FMT "_particle", k));
    PetscCall(CheckpointReadInt(c, name, n, particle));
    PetscCall(BaseFormat(name, "dem/tool_%" PetscInt_FMT "_history", k));
    PetscCall(CheckpointReadReal(c, name, ROW * n, data));
    if (model->ranks) { /* keep what touches the rank's own */
      PetscInt kept = 0;

      for (PetscInt i = 0; i < n; i++) {
        const PetscInt p = DemOwnOf(model->ranks, particle[i]);

        if (p < 0) continue;
        particle[kept] = p;
        PetscCall(PetscArraymove(data + ROW * kept, data + ROW * i, ROW));
        kept++;
      }
      n = kept;
    }
    for (PetscInt b = 0; b < model->blocks.n_blocks; b++) {
      PetscInt m = 0;

      while (at + m < n && particle[at + m] < model->blocks.first[b + 1]) m++;
      PetscCall(DemToolReserve_Internal(tool, b, m));
      for (PetscInt i = 0; i < m; i++, at++) {
        DemToolContact *s = &tool->contact[b][i];

        s->p = particle[at];
        for (PetscInt d = 0; d < 3; d++) s->n[d] = data[ROW * at + d];
        s->radius = data[ROW * at + 3];
        s->size   = data[ROW * at + 4];
        s->energy = data[ROW * at + 5];
        PetscCall(PetscMemcpy(&s->history, &data[ROW * at + 6], sizeof(s->history)));
      }
      tool->n_contacts[b] = m;
    }
    PetscCall(PetscFree2(particle, data));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
