/* fem_watch.c - is the state one of a body?  Eqs (1.7), (1.8) of docs/theory.md */
#include "fem_impl.h"
#include <string.h>

/* Shortest edge between corners of this rank's elements [m]. */
static PetscReal Shortest(FemModel model)
{
  const PetscInt dim = model->dim;
  PetscReal      shortest = PETSC_MAX_REAL;

  for (PetscInt c = 0; c < model->n_cells; c++) {
    const PetscInt *node    = model->cell_node + model->cell_start[c];
    const PetscInt  corners = FemShapeGet((MeshCellType)model->cell_type[c])->corners;

    for (PetscInt a = 0; a < corners; a++) {
      const PetscInt b = (a + 1) % corners;
      PetscReal      d2 = 0;

      for (PetscInt d = 0; d < dim; d++) d2 += PetscSqr(model->x[node[b] * dim + d] - model->x[node[a] * dim + d]);
      shortest = PetscMin(shortest, d2);
    }
  }
  return PetscSqrtReal(shortest);
}

/* Owned nodes: finite, and none that leaps over an element in one step. Eq. (1.7). Returns the first bad one, -1; runs: it is too fast. */
static PetscInt BadNode(FemModel model, PetscReal limit, PetscBool *runs, PetscReal *speed)
{
  const PetscInt dim = model->dim;
  PetscInt       bad = -1;
  PetscReal      most = limit < PETSC_MAX_REAL ? limit * limit : PETSC_MAX_REAL; /* 0: any speed is too fast */

  *runs = PETSC_FALSE;
  for (PetscInt i = 0; i < model->n_own; i++) {
    PetscReal v2 = 0, u = 0;

    for (PetscInt d = 0; d < dim; d++) {
      v2 += PetscSqr(model->v[i * dim + d]);
      u += model->u[i * dim + d];
    }
    if (v2 <= most && PetscAbsReal(u) < PETSC_MAX_REAL) continue;
    if (PetscIsInfOrNanReal(v2) || PetscIsInfOrNanReal(u)) { /* the worst fault */
      *runs = PETSC_FALSE;
      return i;
    }
    bad    = i; /* the fastest of all */
    most   = v2;
    *runs  = PETSC_TRUE;
    *speed = PetscSqrtReal(v2);
  }
  return bad;
}

/* Reference gradients of the corners' functions at the middle of an element, by type; made when a type is met. */
typedef struct {
  PetscBool made;
  PetscReal dN[8][3];
} Middle;

static void MakeMiddle(const FemShape *shape, Middle *m)
{
  const FemShape *linear = FemShapeGet(shape->linear);
  PetscReal       xi[3]  = {0}, N[FEM_MAX_NODES], dN[FEM_MAX_NODES][3];

  for (PetscInt a = 0; a < linear->nodes; a++)
    for (PetscInt d = 0; d < 3; d++) xi[d] += linear->place[a][d] / linear->nodes;
  FemShapeAt(shape->linear, xi, N, dN);
  memcpy(m->dN, dN, sizeof(m->dN));
  m->made = PETSC_TRUE;
}

/* Owned elements turned inside out: det of the Jacobian at the middle, by the corners' present places. Eq. (1.8). The first one, -1. */
static PetscInt InvertedCell(FemModel model, PetscReal at[3])
{
  const PetscInt dim = model->dim;
  Middle         middle[32];

  memset(middle, 0, sizeof(middle));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const PetscInt *node  = model->cell_node + model->cell_start[c], type = model->cell_type[c];
    const FemShape *shape = FemShapeGet((MeshCellType)type);
    PetscReal       J[3][3] = {{0}}, det;

    if (!model->own[c]) continue;
    if (!middle[type].made) MakeMiddle(shape, &middle[type]);
    for (PetscInt a = 0; a < shape->corners; a++)
      for (PetscInt i = 0; i < dim; i++) {
        const PetscReal y = model->x[node[a] * dim + i] + model->u[node[a] * dim + i];

        for (PetscInt j = 0; j < dim; j++) J[i][j] += y * middle[type].dN[a][j];
      }
    det = dim == 2 ? J[0][0] * J[1][1] - J[0][1] * J[1][0]
                   : J[0][0] * (J[1][1] * J[2][2] - J[1][2] * J[2][1]) - J[0][1] * (J[1][0] * J[2][2] - J[1][2] * J[2][0]) + J[0][2] * (J[1][0] * J[2][1] - J[1][1] * J[2][0]);
    if (det > 0) continue;
    for (PetscInt a = 0; a < shape->corners; a++)
      for (PetscInt d = 0; d < dim; d++) at[d] += (model->x[node[a] * dim + d] + model->u[node[a] * dim + d]) / shape->corners;
    return c;
  }
  return -1;
}

PetscErrorCode FemWatch(void *ctx, RunWatch look, char fault[BASE_LINE])
{
  FemModel        model  = ctx;
  const PetscBool moving = (PetscBool)(model->method == FEM_EXPLICIT && model->dt_last > 0);
  PetscReal       at[3] = {0}, speed = 0;
  PetscInt        bad, cell = -1;
  PetscBool       runs;
  PetscMPIInt     mine, first;

  PetscFunctionBegin;
  fault[0] = 0;
  if (model->shortest == 0) model->shortest = Shortest(model);
  bad = BadNode(model, look == RUN_WATCH_FASTEST ? 0 : moving ? model->shortest / model->dt_last : PETSC_MAX_REAL, &runs, &speed);
  if (bad >= 0) {
    for (PetscInt d = 0; d < model->dim; d++) at[d] = model->x[bad * model->dim + d];
    if (runs && look == RUN_WATCH_FASTEST)
      PetscCall(PetscSNPrintf(fault, BASE_LINE, "the fastest node is %" PetscInt_FMT ", at (%.6g, %.6g, %.6g) m before it moved: %.6g m/s", model->gid[bad], (double)at[0], (double)at[1], (double)at[2], (double)speed));
    else if (runs)
      PetscCall(PetscSNPrintf(fault, BASE_LINE, "node %" PetscInt_FMT ", at (%.6g, %.6g, %.6g) m before it moved, runs away: %.6g m/s crosses the shortest edge, %.6g m, in less than a step of %.6g s", model->gid[bad], (double)at[0],
                              (double)at[1], (double)at[2], (double)speed, (double)model->shortest, (double)model->dt_last));
    else PetscCall(PetscSNPrintf(fault, BASE_LINE, "node %" PetscInt_FMT ", at (%.6g, %.6g, %.6g) m before it moved, has a place or a velocity that is not finite", model->gid[bad], (double)at[0], (double)at[1], (double)at[2]));
  } else if (look == RUN_WATCH_ALL && model->method != FEM_STATIC && (cell = InvertedCell(model, at)) >= 0)
    PetscCall(PetscSNPrintf(fault, BASE_LINE, "element %" PetscInt_FMT ", now about (%.6g, %.6g, %.6g) m, is turned inside out", model->cell_gid[cell], (double)at[0], (double)at[1], (double)at[2]));
  mine = fault[0] ? model->rank : model->size;
  PetscCallMPI(MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, model->comm));
  if (first < model->size) PetscCallMPI(MPI_Bcast(fault, BASE_LINE, MPI_CHAR, first, model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
