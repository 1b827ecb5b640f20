/*
  coupling_ranks.c - a coupled body on several ranks.

  Elements and overlap are few beside the bonds: every rank has all of them and does them alike. The particles are shared out: `part` steps,
  and what the overlap's forces read and write are copies of the overlap's own particles. In a step their places go from
  their owners to all, the rim's forces as well; each is one gathering. Sums over the overlap are then those of one rank, to the bit.

  Set-up and events ask for the particles as a whole, and every rank makes the whole model for it. Its state becomes that of the parts
  through a checkpoint in memory, and theirs its: what goes on is what a restart would go on from. When the parts step the whole is
  gone; an event makes it again.
*/
#include "coupling_impl.h"

enum { U = 0, ROT = 3, V = 7, F = 10 }; /* of a row: displacement, rotation; velocity and force where they are read */

/* Numbers of a row. */
static PetscInt Width(CouplingModel model)
{
  return model->options.method == COUPLING_CONSISTENT ? F + 3 : model->options.absorber ? V + 3 : V;
}

PetscErrorCode CouplingModelSetPart(CouplingModel model, DemModel part)
{
  PetscFunctionBegin;
  PetscCheck(!model->dem && !model->part, model->comm, PETSC_ERR_ORDER, "Call CouplingModelSetPart() once, before CouplingModelSetSides()");
  model->part        = part;
  model->whole_leads = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingCheckPart_Internal(CouplingModel model)
{
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(model->comm, &size));
  PetscCheck((size > 1) == (model->part != NULL), model->comm, PETSC_ERR_ORDER, "On several ranks, and only there, a coupled body needs CouplingModelSetPart()");
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
  PetscCall(PetscMalloc2(Width(model) * rows->n, &rows->out, Width(model) * all, &rows->in));
  rows->all = all;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Who has the state the overlap is to see. */
static void Lead(CouplingModel model, PetscBool whole)
{
  model->whole_leads = whole;
  for (PetscInt k = 0; k < model->n_particles; k++) model->particle[k].p = whole ? model->particle[k].whole : k;
}

PetscErrorCode CouplingParticles_Internal(CouplingModel model, DemState *s)
{
  PetscFunctionBegin;
  if (model->part && !model->whole_leads) *s = model->copy;
  else PetscCall(DemModelGetState(model->dem, s)); /* arrays that stay where they are: nothing to give back */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingRim_Internal(CouplingModel model, DemRim *rim)
{
  PetscFunctionBegin;
  if (model->part && !model->whole_leads) *rim = model->rim_copy;
  else PetscCall(DemModelGetRim(model->dem, rim));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Gather(CouplingModel model, CouplingRows *rows, MPI_Datatype type)
{
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allgatherv(rows->out, (PetscMPIInt)rows->n, type, rows->in, rows->count, rows->first, type, model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for what the overlap sees; masses stay. */
static PetscErrorCode CopyCreate(CouplingModel model)
{
  const PetscInt n = model->n_particles;
  DemState      *c = &model->copy, whole;
  PetscReal     *a[6];

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 6; k++) PetscCall(PetscCalloc1((k == 1 ? 4 : 3) * n, &a[k]));
  *c = (DemState){.dim = model->dim, .n = n, .own = n, .u = a[0], .rot = a[1], .v = a[2], .f = a[3], .f_ext = a[4], .t_ext = a[5]};
  PetscCall(DemModelGetState(model->dem, &whole));
  PetscCall(PetscMalloc1(n, &a[0]));
  for (PetscInt k = 0; k < n; k++) a[0][k] = whole.mass[model->particle[k].whole];
  c->mass = a[0];
  PetscCall(DemModelRestoreState(model->dem, &whole));
  PetscCall(PetscCalloc1(3 * model->n_rim, &a[0]));
  PetscCall(PetscCalloc1(3 * model->n_rim, &a[1]));
  model->rim_copy = (DemRim){.n = model->n_rim, .u = a[0], .force = a[1]};
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CopyDestroy(CouplingModel model)
{
  DemState  *c    = &model->copy;
  PetscReal *mass = (PetscReal *)c->mass, *f = (PetscReal *)c->f, *force = (PetscReal *)model->rim_copy.force;

  PetscFunctionBegin;
  PetscCall(PetscFree(c->u));
  PetscCall(PetscFree(c->rot));
  PetscCall(PetscFree(c->v));
  PetscCall(PetscFree(f));
  PetscCall(PetscFree(c->f_ext));
  PetscCall(PetscFree(c->t_ext));
  PetscCall(PetscFree(mass));
  PetscCall(PetscFree(model->rim_copy.u));
  PetscCall(PetscFree(force));
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
  for (PetscInt k = 0; k < model->n_particles; k++) row[whole.number[model->particle[k].whole]] = k;
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
  PetscCall(CopyCreate(model));
  PetscCallMPI(MPI_Type_contiguous((PetscMPIInt)Width(model), MPIU_REAL, &model->place_type));
  PetscCallMPI(MPI_Type_commit(&model->place_type));
  PetscCallMPI(MPI_Type_contiguous(3, MPIU_REAL, &model->force_type));
  PetscCallMPI(MPI_Type_commit(&model->force_type));
  PetscCall(CouplingSpread_Internal(model));
  Lead(model, PETSC_TRUE);
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
  PetscCall(CopyDestroy(model));
  if (model->part) PetscCall(DemModelDestroy(&model->dem));
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

PetscErrorCode CouplingForget_Internal(CouplingModel model)
{
  PetscFunctionBegin;
  if (model->part && model->dem && !model->whole_leads) PetscCall(DemModelDestroy(&model->dem));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingRecall_Internal(CouplingModel model, DemModel dem, const DemPacking *packing, const DemCells *cells)
{
  PetscFunctionBegin;
  PetscCheck(!model->dem, model->comm, PETSC_ERR_ORDER, "The whole model of the particles is still there");
  PetscCall(CouplingGive_Internal(model, dem, packing, cells));
  PetscCall(DemModelSetUp(dem));
  model->dem = dem;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingSpread_Internal(CouplingModel model)
{
  const DemState *c = &model->copy;
  PetscReal      *force = (PetscReal *)model->rim_copy.force;
  DemState        s;
  DemRim          rim;

  PetscFunctionBegin;
  if (!model->part) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Move(model, model->dem, model->part));
  PetscCall(DemModelGetState(model->dem, &s));
  for (PetscInt k = 0; k < c->n; k++) {
    const PetscInt p = model->particle[k].whole;

    for (PetscInt d = 0; d < 3; d++) {
      c->u[d * c->n + k]     = s.u[d * s.n + p];
      c->v[d * c->n + k]     = s.v[d * s.n + p];
      ((PetscReal *)c->f)[d * c->n + k] = s.f[d * s.n + p];
      c->f_ext[d * c->n + k] = s.f_ext[d * s.n + p];
      c->t_ext[d * c->n + k] = s.t_ext[d * s.n + p];
    }
    for (PetscInt d = 0; d < 4; d++) c->rot[d * c->n + k] = s.rot[d * s.n + p];
  }
  PetscCall(DemModelRestoreState(model->dem, &s));
  PetscCall(DemModelGetRim(model->dem, &rim));
  PetscCall(PetscArraycpy(model->rim_copy.u, rim.u, 3 * rim.n));
  PetscCall(PetscArraycpy(force, rim.force, 3 * rim.n));
  Lead(model, PETSC_FALSE);
  PetscCall(CouplingPush_Internal(model)); /* lent, and in no checkpoint */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Places, turns, velocities and forces of the overlap's particles to all ranks. */
PetscErrorCode CouplingPull_Internal(CouplingModel model)
{
  CouplingRows   *o = &model->overlapping;
  const PetscInt  width = Width(model);
  const DemState *c = &model->copy;
  DemState        s;

  PetscFunctionBegin;
  if (!model->part) PetscFunctionReturn(PETSC_SUCCESS);
  if (model->whole_leads) Lead(model, PETSC_FALSE);
  PetscCall(DemModelGetState(model->part, &s));
  for (PetscInt k = 0; k < o->n; k++) {
    PetscReal     *row = o->out + width * k;
    const PetscInt p   = o->here[k];

    for (PetscInt d = 0; d < 3; d++) {
      row[U + d] = s.u[d * s.n + p];
      if (width > V) row[V + d] = s.v[d * s.n + p];
      if (width > F) row[F + d] = s.f[d * s.n + p];
    }
    for (PetscInt d = 0; d < 4; d++) row[ROT + d] = s.rot[d * s.n + p];
  }
  PetscCall(DemModelRestoreState(model->part, &s));
  PetscCall(Gather(model, o, model->place_type));
  for (PetscInt k = 0; k < o->all; k++) {
    const PetscReal *row = o->in + width * k;
    const PetscInt   p   = o->place[k];

    for (PetscInt d = 0; d < 3; d++) {
      c->u[d * c->n + p] = row[U + d];
      if (width > V) c->v[d * c->n + p] = row[V + d];
      if (width > F) ((PetscReal *)c->f)[d * c->n + p] = row[F + d];
    }
    for (PetscInt d = 0; d < 4; d++) c->rot[d * c->n + p] = row[ROT + d];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces on the overlap's particles, and where the elements are at the rim, to their owners. */
PetscErrorCode CouplingPush_Internal(CouplingModel model)
{
  const CouplingRows *o = &model->overlapping, *r = &model->rims;
  const DemState     *c = &model->copy;
  DemState            part;
  DemRim              to;

  PetscFunctionBegin;
  if (!model->part) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DemModelGetState(model->part, &part));
  for (PetscInt k = 0; k < o->n; k++)
    for (PetscInt d = 0; d < 3; d++) {
      part.f_ext[d * part.n + o->here[k]] = c->f_ext[d * c->n + o->whole[k]];
      part.t_ext[d * part.n + o->here[k]] = c->t_ext[d * c->n + o->whole[k]];
    }
  PetscCall(DemModelRestoreState(model->part, &part));
  PetscCall(DemModelGetRim(model->part, &to));
  for (PetscInt k = 0; k < r->n; k++)
    for (PetscInt d = 0; d < 3; d++) to.u[3 * k + d] = model->rim_copy.u[3 * r->whole[k] + d];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rim's forces of the present state. */
PetscErrorCode CouplingPullRim_Internal(CouplingModel model)
{
  CouplingRows *r = &model->rims;
  PetscReal    *force = (PetscReal *)model->rim_copy.force;
  DemRim        rim;

  PetscFunctionBegin;
  if (!model->part) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DemModelGetRim(model->part, &rim));
  for (PetscInt k = 0; k < 3 * r->n; k++) r->out[k] = rim.force[k];
  PetscCall(Gather(model, r, model->force_type));
  for (PetscInt k = 0; k < r->all; k++)
    for (PetscInt d = 0; d < 3; d++) force[3 * r->place[k] + d] = r->in[3 * k + d];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* more [3][overlap's particles] [N]: added to the forces of the present state. */
PetscErrorCode CouplingAddForces_Internal(CouplingModel model, const PetscReal more[])
{
  const CouplingRows *o = &model->overlapping;
  const PetscBool     parts = (PetscBool)(model->part && !model->whole_leads);
  DemModel            dem = parts ? model->part : model->dem;
  PetscReal          *all;
  DemState            s;

  PetscFunctionBegin;
  PetscCall(DemModelGetState(dem, &s));
  PetscCall(PetscCalloc1(3 * s.n, &all));
  for (PetscInt k = 0; k < (parts ? o->n : model->n_particles); k++)
    for (PetscInt d = 0; d < model->dim; d++) all[d * s.n + (parts ? o->here[k] : model->particle[k].whole)] = more[d * model->n_particles + (parts ? o->whole[k] : k)];
  PetscCall(DemModelRestoreState(dem, &s));
  PetscCall(DemModelAddForces(dem, all));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}
