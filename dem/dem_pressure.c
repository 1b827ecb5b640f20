/*
  dem_pressure.c - pressure that ends on pieces that have come off.  Eq. (4.88)

  What presses on a body surrounds a piece that has left it: the resultant is nothing. Kept on the facet it began at, it would drive the piece like a rocket.
*/
#include "dem_impl.h"

#define LOOK_EVERY 50  /* steps */
#define WHOLE_TURN 0.5 /* cosine of the turn beyond which a facet no longer looks outward: 60 degrees */
#define LARGE 0.05     /* of the body's particles */

static PetscBool Turned(DemModel model, PetscInt p)
{
  const PetscReal w = model->rot[p]; /* cos(half the turn); in the plane row 2 is the turn */

  return (PetscBool)(model->dim == 3 ? 2 * w * w - 1 < WHOLE_TURN : PetscCosReal(model->rot[2 * model->n + p]) < WHOLE_TURN);
}

/*
  By how much each part has gone from the nearest of those it was bonded to [m]; 0 for what pressure stays on: a twentieth of the body at least that is
  the heaviest part or holds a support.
*/
static PetscErrorCode Distances(DemModel model, const PetscInt part[], PetscInt parts, PetscReal gone[])
{
  const DemBonds *b = &model->bonds;
  const DemWalls *w = &model->walls;
  const PetscInt  n = model->n;
  PetscReal      *size, *held;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(parts, &size, parts, &held));
  for (PetscInt k = 0; k < parts; k++) gone[k] = PETSC_MAX_REAL;
  for (PetscInt e = 0; e < b->n; e++) {
    const PetscInt p = b->p[e], q = b->q[e], one = part[model->at[p]], other = part[model->at[q]];
    PetscReal      rest = 0, now = 0;

    if (one == other) continue;
    for (PetscInt d = 0; d < model->dim; d++) {
      const PetscReal gap = model->x0[d * n + q] - model->x0[d * n + p];

      rest += PetscSqr(gap);
      now += PetscSqr(gap + model->u[d * n + q] - model->u[d * n + p]);
    }
    gone[one]   = PetscMin(gone[one], PetscSqrtReal(now) - PetscSqrtReal(rest));
    gone[other] = PetscMin(gone[other], PetscSqrtReal(now) - PetscSqrtReal(rest));
  }
  for (PetscInt p = 0; p < model->own; p++) size[part[model->at[p]]] += 1;
  for (PetscInt i = 0; i < w->n; i++)
    if (w->kind[i] != DEM_WALL_TRACTION) held[part[model->at[w->owner[i]]]] = 1;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, gone, (PetscMPIInt)parts, MPIU_REAL, MPI_MIN, model->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, size, (PetscMPIInt)parts, MPIU_REAL, MPI_SUM, model->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, held, (PetscMPIInt)parts, MPIU_REAL, MPI_MAX, model->comm));
  for (PetscInt k = 0; k < parts; k++)
    if ((k == 0 || held[k] > 0) && size[k] >= LARGE * DemGrains_Internal(model)) gone[k] = 0;
  PetscCall(PetscFree2(size, held));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemPressureLook_Internal(DemModel model)
{
  const DemWalls *w = &model->walls;
  PetscBool       presses = PETSC_FALSE;
  PetscReal       broken = 0, *gone;
  PetscInt       *part, parts;

  PetscFunctionBegin;
  if (!model->crack.damage || model->is_static || model->crack.steps % LOOK_EVERY) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < model->n_faces; k++) presses = (PetscBool)(presses || (model->face[k].pressed && model->face[k].push != 0));
  if (!presses) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt e = 0; e < model->bonds.n; e++) broken += DemBondIsMine(model, e) && model->crack.damage[e] >= 0.9999;
  PetscCall(DemSumRanks_Internal(model, 1, &broken));
  if (broken == 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(model->n, &part));
  PetscCall(DemModelGetFragments(model, &parts, part));
  PetscCall(PetscMalloc1(parts, &gone));
  PetscCall(Distances(model, part, parts, gone));
  for (PetscInt i = 0; i < w->n; i++) {
    const PetscInt  p = w->owner[i];
    const PetscReal far = gone[part[model->at[p]]];

    if (far == 0 || !model->face[w->face[i]].pressed || !(far > model->r[p] || Turned(model, p))) continue;
    model->traction_new[DEM_TRACTION * i + DEM_TRACTION_ENDED] = model->traction_old[DEM_TRACTION * i + DEM_TRACTION_ENDED] = 1;
  }
  PetscCall(PetscFree(gone));
  PetscCall(PetscFree(part));
  PetscFunctionReturn(PETSC_SUCCESS);
}
