/* toy.c - central differences, eqs (1.1), (1.2), with the kinetic energy of (1.5): the ledger closes to round-off. */
#include "toy.h"
#include <stdlib.h>
#include <unistd.h>

static const char *const names[] = {"displacement(last)", "force"};
static const char *const units[] = {"m", "N"};

static PetscReal Drive(const Toy *toy, PetscReal t)
{
  return toy->drive * PetscSinReal(0.3 * t);
}

static PetscReal Force(const Toy *toy, PetscInt i, PetscReal t)
{
  const PetscReal left = i ? toy->u[i - 1] : 0, right = i + 1 < toy->n ? toy->u[i + 1] : 0;

  return left - 2 * toy->u[i] + right + (i + 1 == toy->n ? Drive(toy, t) : 0);
}

static PetscErrorCode StableStep(void *ctx, PetscReal *dt)
{
  *dt = 2 / ToyFrequency(ctx, ((Toy *)ctx)->n);
  return PETSC_SUCCESS;
}

static PetscErrorCode Step(void *ctx, PetscReal t, PetscReal dt)
{
  Toy            *toy  = ctx;
  const PetscReal half = toy->steps ? dt : dt / 2, last = toy->u[toy->n - 1];
  PetscReal       work;

  PetscFunctionBegin;
  toy->steps++;
  PetscCheck(toy->steps != toy->fail, PETSC_COMM_SELF, PETSC_ERR_PLIB, "the toy broke");
  if (toy->sleep) usleep((useconds_t)toy->sleep);
  while (toy->hang) pause();
  for (PetscInt i = 0; i < toy->n; i++) toy->v[i] += half * Force(toy, i, t);
  for (PetscInt i = 0; i < toy->n; i++) toy->u[i] += dt * toy->v[i];
  toy->t  = t + dt;
  toy->dt = dt;
  work    = 0.5 * (Drive(toy, t) + Drive(toy, t + dt)) * (toy->u[toy->n - 1] - last);
  toy->work += work;
  toy->work_in += PetscAbsReal(work);
  if (toy->steps == toy->poison) toy->u[toy->n / 2] = NAN;
  if (toy->steps == toy->kick)
    for (PetscInt i = 0; i < toy->n; i++) toy->v[i] *= 1.5;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Energy(void *ctx, Ledger *ledger)
{
  Toy      *toy     = ctx;
  PetscReal kinetic = 0, strain = 0;

  toy->looks++;
  for (PetscInt i = 0; i < toy->n; i++) kinetic += 0.5 * toy->v[i] * (toy->v[i] + (toy->steps ? toy->dt * Force(toy, i, toy->t) : 0));
  for (PetscInt i = 0; i <= toy->n; i++) {
    const PetscReal stretch = (i < toy->n ? toy->u[i] : 0) - (i ? toy->u[i - 1] : 0);

    strain += 0.5 * stretch * stretch;
  }
  ledger->energy[LEDGER_KINETIC] = kinetic;
  ledger->energy[LEDGER_STRAIN]  = strain;
  ledger->energy[LEDGER_WORK]    = toy->work;
  ledger->work_in                = toy->work_in;
  ledger->scale                  = 1e-6;
  return PETSC_SUCCESS;
}

static PetscErrorCode History(void *ctx, PetscInt i, PetscReal *value)
{
  const Toy *toy = ctx;

  *value = i == 0 ? toy->u[toy->n - 1] : Drive(toy, toy->t);
  return PETSC_SUCCESS;
}

static PetscErrorCode Unbalanced(void *ctx, PetscReal *ratio)
{
  const Toy *toy = ctx;

  *ratio = toy->stillness / PetscMax(toy->steps, 1);
  return PETSC_SUCCESS;
}

/* "chain": lines at rest with fields; "moving": points whose place changes; "late": nothing until step 20, then one triangle. */
static PetscErrorCode Write(void *ctx, Output output)
{
  const Toy     *toy = ctx;
  const PetscInt n   = toy->n;
  PetscMPIInt    rank;
  PetscReal     *x, *moved, *shift, *stretch, corner[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  PetscInt      *start, *node, *one, triangle[2] = {0, 3}, corners[3] = {0, 1, 2};
  unsigned char *type, *vertex, polygon = 5;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(PetscCalloc4(3 * n, &x, 3 * n, &moved, 3 * n, &shift, n, &stretch));
  PetscCall(PetscMalloc3(n + 1, &start, 2 * n, &node, n + 1, &one));
  PetscCall(PetscMalloc2(n, &type, n, &vertex));
  for (PetscInt i = 0; i < n; i++) {
    x[3 * i]     = (PetscReal)i;
    moved[3 * i] = (PetscReal)i + toy->u[i];
    shift[3 * i] = toy->u[i];
    one[i]       = i;
    vertex[i]    = 1;
    if (i + 1 < n) {
      start[i]        = 2 * i;
      node[2 * i]     = i;
      node[2 * i + 1] = i + 1;
      type[i]         = 3;
      stretch[i]      = toy->u[i + 1] - toy->u[i];
    }
  }
  start[n - 1] = 2 * (n - 1);
  one[n]       = n;
  {
    const OutputArray chain[]  = {{"displacement", "m", OUTPUT_POINT_DATA, 3, shift}, {"velocity", "m/s", OUTPUT_POINT_DATA, 1, toy->v}, {"stretch", "m", OUTPUT_CELL_DATA, 1, stretch}};
    const OutputArray moving[] = {{"velocity", "m/s", OUTPUT_CELL_DATA, 1, toy->v}, {"parity", "", OUTPUT_POINT_DATA, 1, toy->u}};
    const OutputArray late[]   = {{"area", "m2", OUTPUT_CELL_DATA, 1, corner + 3}};
    const PetscInt    there    = toy->steps >= 20;
    const OutputBlock a        = {.name = "chain", .n_points = n, .x = x, .n_cells = n - 1, .start = start, .node = node, .type = type, .n_arrays = 3, .array = chain};
    const OutputBlock b        = {.name = "moving", .n_points = n, .x = moved, .n_cells = n, .start = one, .node = one, .type = vertex, .n_arrays = 2, .array = moving};
    const OutputBlock c        = {.name = "late", .n_points = 3 * there, .x = corner, .n_cells = there, .start = triangle, .node = corners, .type = &polygon, .n_arrays = 1, .array = late};
    const OutputBlock none     = {.name = NULL};

    PetscCall(OutputFrameBlock(output, rank ? &none : &a));
    PetscCall(OutputFrameBlock(output, rank ? &none : &b));
    PetscCall(OutputFrameBlock(output, rank ? &none : &c));
  }
  PetscCall(PetscFree4(x, moved, shift, stretch));
  PetscCall(PetscFree3(start, node, one));
  PetscCall(PetscFree2(type, vertex));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Save(void *ctx, Checkpoint checkpoint)
{
  const Toy      *toy     = ctx;
  const PetscReal kept[4] = {toy->t, toy->dt, toy->work, toy->work_in};

  PetscFunctionBegin;
  PetscCall(CheckpointWriteReal(checkpoint, "toy/u", toy->n, toy->u));
  PetscCall(CheckpointWriteReal(checkpoint, "toy/v", toy->n, toy->v));
  PetscCall(CheckpointWriteReal(checkpoint, "toy/kept", 4, kept));
  PetscCall(CheckpointWriteInt(checkpoint, "toy/steps", 1, &toy->steps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Load(void *ctx, Checkpoint checkpoint)
{
  Toy      *toy = ctx;
  PetscReal kept[4];

  PetscFunctionBegin;
  PetscCall(CheckpointReadReal(checkpoint, "toy/u", toy->n, toy->u));
  PetscCall(CheckpointReadReal(checkpoint, "toy/v", toy->n, toy->v));
  PetscCall(CheckpointReadReal(checkpoint, "toy/kept", 4, kept));
  PetscCall(CheckpointReadInt(checkpoint, "toy/steps", 1, &toy->steps));
  toy->t       = kept[0];
  toy->dt      = kept[1];
  toy->work    = kept[2];
  toy->work_in = kept[3];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ToyCreate(PetscInt n, Toy *toy)
{
  PetscFunctionBegin;
  PetscCall(PetscMemzero(toy, sizeof(*toy)));
  toy->n     = n;
  toy->drive = 1e-3;
  PetscCall(PetscCalloc2(n, &toy->u, n, &toy->v));
  for (PetscInt i = 0; i < n; i++) toy->v[i] = 1e-3 * PetscSqr(PetscSinReal(1. + (PetscReal)i * i));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ToySetMode(Toy *toy, PetscInt mode)
{
  toy->drive = 0;
  for (PetscInt i = 0; i < toy->n; i++) toy->v[i] = 1e-3 * PetscSinReal(PETSC_PI * mode * (i + 1) / (toy->n + 1));
  return PETSC_SUCCESS;
}

PetscReal ToyFrequency(const Toy *toy, PetscInt mode)
{
  return 2 * PetscSinReal(PETSC_PI * mode / (2. * (toy->n + 1)));
}

PetscErrorCode ToyDestroy(Toy *toy)
{
  PetscFunctionBegin;
  PetscCall(PetscFree2(toy->u, toy->v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void ToyGetStepper(Toy *toy, Stepper *stepper)
{
  *stepper = (Stepper){.name = "toy", .ctx = toy, .stable_step = StableStep, .step = Step, .energy = Energy, .history = History, .write = Write, .save = Save, .load = Load,
                       .unbalanced = toy->stillness > 0 ? Unbalanced : NULL, .n_history = 2, .history_name = names, .history_unit = units, .elements = (PetscReal)toy->n + 1};
}
