/*
  coupling_ranks.c - a coupled body on several ranks.

  Elements and overlap are few beside the bonds: every rank has all of them and does them alike. The particles are shared out: `part` steps,
  and the whole model, which every rank has too, holds what the overlap's forces read. In a step overlap particles' places go from
  their owners to all, the rim's forces as well; each is one gathering. Sums over the overlap are then those of one rank, to the bit.

  Where the particles are asked for as a whole (set-up, an event) the parts become the whole, and the whole the parts again, through a
  checkpoint in memory: what goes on is what a restart would go on from.
*/
#include "coupling_impl.h"

enum { U = 0, ROT = 3, ROW = 7 };

PetscErrorCode CouplingModelSetPart(CouplingModel model, DemModel part)
{
  PetscFunctionBegin;
  PetscCheck(!model->dem && !model->part, model->comm, PETSC_ERR_ORDER, "Call CouplingModelSetPart() once, before CouplingModelSetSides()");
  model->part        = part;
  model->whole_leads = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingRefuse_Internal(CouplingModel model)
{
  const CouplingOptions *o = &model->options;
  PetscMPIInt            size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(model->comm, &size));
  PetscCheck((size > 1) == (model->part != NULL), model->comm, PETSC_ERR_ORDER, "On several ranks, and only there, a coupled body needs CouplingModelSetPart()");
  if (size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  BaseCheckInput(o->far != COUPLING_FAR_STATIC, model->comm, "A static far field runs on one rank for now, not %d; give it threads instead: cleave run SCENE --threads N", (int)size);
  BaseCheckInput(!model->before, model->comm, "The initial stress of a coupled body runs on one rank for now, not %d; give it threads instead: cleave run SCENE --threads N", (int)size);
  BaseCheckInput(o->method == COUPLING_ENERGY && !o->absorber, model->comm, "The methods kept for comparison and the absorber run on one rank, not %d; use method: energy, or threads: cleave run SCENE --threads N", (int)size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Who gives what to a gathering of `all` rows, from the rows here. place [all]: the row of each number that comes. */
static PetscErrorCode Rows(CouplingModel model, CouplingRows *rows, PetscInt all)
{
  PetscMPIInt size, n = (PetscMPIInt)rows->n;
  PetscInt    sum = 0;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(model->comm, &size));
  PetscCall(PetscMalloc2(size, &rows->count, size, &rows->first));
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, rows->count, 1, MPI_INT, model->comm));
  for (PetscMPIInt s = 0; s < size; s++) {
    rows->first[s] = (PetscMPIInt)sum;
    sum += rows->count[s];
  }
  PetscCheck(sum == all, model->comm, PETSC_ERR_PLIB, "%" PetscInt_FMT " rows of all ranks, not %" PetscInt_FMT, sum, all);
  PetscCall(PetscMalloc1(all, &rows->place));
  PetscCallMPI(MPI_Allgatherv(rows->whole, n, MPIU_INT, rows->place, rows->count, rows->first, MPIU_INT, model->comm));
  PetscCall(PetscMalloc2(ROW * rows->n, &rows->out, ROW * all, &rows->in));
  rows->all = all;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Gather(CouplingModel model, CouplingRows *rows, MPI_Datatype type)
{
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allgatherv(rows->out, (PetscMPIInt)rows->n, type, rows->in, rows->count, rows->first, type, model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingPartSetUp_Internal(CouplingModel model)
{
  CouplingRows *o = &model->overlapping, *r = &model->rims;
  DemState      whole, part;
  DemRim        rim;
  PetscInt     *row;

  PetscFunctionBegin;
  if (!model->part) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DemModelSetUp(model->part));
  PetscCall(DemModelGetState(model->dem, &whole));
  PetscCall(DemModelGetState(model->part, &part));
  PetscCall(PetscMalloc1(whole.n, &row)); /* row of the overlap of a packing's number, -1 */
  for (PetscInt p = 0; p < whole.n; p++) row[p] = -1;
  for (PetscInt k = 0; k < model->n_particles; k++) row[whole.number[model->particle[k].p]] = k;
  PetscCall(PetscMalloc2(part.own, &o->here, part.own, &o->whole));
  for (PetscInt p = 0; p < part.own; p++) {
    if (row[part.number[p]] < 0) continue;
    o->here[o->n]    = p;
    o->whole[o->n++] = row[part.number[p]];
  }
  PetscCall(PetscFree(row));
  PetscCall(DemModelRestoreState(model->dem, &whole));
  PetscCall(DemModelRestoreState(model->part, &part));
  PetscCall(Rows(model, o, model->n_particles));

  PetscCall(DemModelGetRim(model->part, &rim));
  PetscCall(PetscMalloc2(rim.n, &r->here, rim.n, &r->whole));
  for (r->n = 0; r->n < rim.n; r->n++) {
    r->here[r->n]  = r->n;
    r->whole[r->n] = rim.number[r->n];
  }
  PetscCall(Rows(model, r, model->n_rim));
  PetscCall(PetscCalloc1(3 * model->n_rim, &model->rim_force));
  PetscCallMPI(MPI_Type_contiguous(ROW, MPIU_REAL, &model->place_type));
  PetscCallMPI(MPI_Type_commit(&model->place_type));
  PetscCallMPI(MPI_Type_contiguous(3, MPIU_REAL, &model->force_type));
  PetscCallMPI(MPI_Type_commit(&model->force_type));
  PetscCall(CouplingSpread_Internal(model));
  model->whole_leads = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Free(CouplingRows *rows)
{
  PetscFunctionBegin;
  PetscCall(PetscFree2(rows->here, rows->whole));
  PetscCall(PetscFree2(rows->count, rows->first));
  PetscCall(PetscFree(rows->place));
  PetscCall(PetscFree2(rows->out, rows->in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingPartDestroy_Internal(CouplingModel model)
{
  PetscFunctionBegin;
  PetscCall(Free(&model->overlapping));
  PetscCall(Free(&model->rims));
  PetscCall(PetscFree(model->rim_force));
  if (model->place_type) PetscCallMPI(MPI_Type_free(&model->place_type));
  if (model->force_type) PetscCallMPI(MPI_Type_free(&model->force_type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Move(CouplingModel model, DemModel from, DemModel to)
{
  Stepper    a, b;
  Checkpoint c;

  PetscFunctionBegin;
  PetscCall(DemModelGetStepper(from, &a));
  PetscCall(DemModelGetStepper(to, &b));
  PetscCall(CheckpointCreateInMemory(model->comm, &c));
  PetscCall(a.save(from, c));
  PetscCall(b.load(to, c));
  PetscCall(CheckpointClose(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingGather_Internal(CouplingModel model)
{
  PetscFunctionBegin;
  if (!model->part || model->whole_leads) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Move(model, model->part, model->dem));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSpread_Internal(CouplingModel model)
{
  DemRim rim;

  PetscFunctionBegin;
  if (!model->part) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Move(model, model->dem, model->part));
  PetscCall(CouplingPush_Internal(model)); /* lent, and in no checkpoint */
  PetscCall(DemModelGetRim(model->dem, &rim));
  PetscCall(PetscArraycpy(model->rim_force, rim.force, 3 * rim.n));
  model->whole_leads = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Places and turns of the overlap's particles into the whole model. */
PetscErrorCode CouplingPull_Internal(CouplingModel model)
{
  CouplingRows *o = &model->overlapping;
  DemState      s;

  PetscFunctionBegin;
  if (!model->part) PetscFunctionReturn(PETSC_SUCCESS);
  model->whole_leads = PETSC_FALSE;
  PetscCall(DemModelGetState(model->part, &s));
  for (PetscInt k = 0; k < o->n; k++) {
    for (PetscInt d = 0; d < 3; d++) o->out[ROW * k + U + d] = s.u[d * s.n + o->here[k]];
    for (PetscInt d = 0; d < 4; d++) o->out[ROW * k + ROT + d] = s.rot[d * s.n + o->here[k]];
  }
  PetscCall(DemModelRestoreState(model->part, &s));
  PetscCall(Gather(model, o, model->place_type));
  PetscCall(DemModelGetState(model->dem, &s));
  for (PetscInt k = 0; k < o->all; k++) {
    const PetscInt p = model->particle[o->place[k]].p;

    for (PetscInt d = 0; d < 3; d++) s.u[d * s.n + p] = o->in[ROW * k + U + d];
    for (PetscInt d = 0; d < 4; d++) s.rot[d * s.n + p] = o->in[ROW * k + ROT + d];
  }
  PetscCall(DemModelRestoreState(model->dem, &s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces on the overlap's particles, and where the elements are at the rim, to their owners. */
PetscErrorCode CouplingPush_Internal(CouplingModel model)
{
  const CouplingRows *o = &model->overlapping, *r = &model->rims;
  DemState            whole, part;
  DemRim              from, to;

  PetscFunctionBegin;
  if (!model->part) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DemModelGetState(model->dem, &whole));
  PetscCall(DemModelGetState(model->part, &part));
  for (PetscInt k = 0; k < o->n; k++)
    for (PetscInt d = 0; d < 3; d++) {
      part.f_ext[d * part.n + o->here[k]] = whole.f_ext[d * whole.n + model->particle[o->whole[k]].p];
      part.t_ext[d * part.n + o->here[k]] = whole.t_ext[d * whole.n + model->particle[o->whole[k]].p];
    }
  PetscCall(DemModelRestoreState(model->dem, &whole));
  PetscCall(DemModelRestoreState(model->part, &part));
  PetscCall(DemModelGetRim(model->dem, &from));
  PetscCall(DemModelGetRim(model->part, &to));
  for (PetscInt k = 0; k < r->n; k++)
    for (PetscInt d = 0; d < 3; d++) to.u[3 * k + d] = from.u[3 * r->whole[k] + d];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rim's forces of the present state. */
PetscErrorCode CouplingPullRim_Internal(CouplingModel model)
{
  CouplingRows *r = &model->rims;
  DemRim        rim;

  PetscFunctionBegin;
  if (!model->part) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DemModelGetRim(model->part, &rim));
  for (PetscInt k = 0; k < 3 * r->n; k++) r->out[k] = rim.force[k];
  PetscCall(Gather(model, r, model->force_type));
  for (PetscInt k = 0; k < r->all; k++)
    for (PetscInt d = 0; d < 3; d++) model->rim_force[3 * r->place[k] + d] = r->in[3 * k + d];
  PetscFunctionReturn(PETSC_SUCCESS);
}
