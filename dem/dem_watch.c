/* dem_watch.c - is the state one of particles?  Eq. (1.7) of docs/theory.md */
#include "dem_impl.h"

#define FAR 1000. /* sizes of its body that a particle may be away from where it began */

typedef enum { SOUND, LOST, RUNS, NOT_FINITE } Fault; /* the graver, the higher */

/* Of what the ranks have found the gravest, and of runaways the fastest, is said by all. */
static PetscErrorCode Agree(DemModel model, Fault what, PetscReal worst, char fault[BASE_LINE])
{
  DemRanks    r = model->ranks;
  PetscReal   mine[2] = {what, what == RUNS ? worst : 0}, *all;
  PetscMPIInt best = 0;

  PetscFunctionBegin;
  if (!r) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(2 * r->size, &all));
  PetscCallMPI(MPI_Allgather(mine, 2, MPIU_REAL, all, 2, MPIU_REAL, model->comm));
  for (PetscMPIInt s = 1; s < r->size; s++)
    if (all[2 * s] > all[2 * best] || (all[2 * s] == all[2 * best] && all[2 * s + 1] > all[2 * best + 1])) best = s;
  PetscCall(PetscFree(all));
  PetscCallMPI(MPI_Bcast(fault, BASE_LINE, MPI_CHAR, best, model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemWatch_Internal(void *ctx, RunWatch look, char fault[BASE_LINE])
{
  DemModel        model = ctx;
  const PetscInt  n = model->n, dim = model->dim;
  const PetscReal dt = model->dt_last;
  PetscReal       size2 = 0, worst = look == RUN_WATCH_FASTEST ? 0 : 1, speed = 0, away = 0, x[3] = {0};
  PetscInt        bad = -1, number;
  Fault           what = SOUND;

  PetscFunctionBegin;
  fault[0] = 0;
  for (PetscInt d = 0; d < dim; d++) size2 += PetscSqr(model->body.high[d] - model->body.low[d]);
  for (PetscInt p = 0; p < model->own && what != NOT_FINITE; p++) {
    PetscReal v2 = 0, u2 = 0, steps;

    for (PetscInt d = 0; d < dim; d++) {
      v2 += PetscSqr(model->v[d * n + p]);
      u2 += PetscSqr(model->u[d * n + p]);
    }
    steps = v2 * dt * dt / PetscSqr(model->r[p]); /* square of radii crossed in a step.  Eq. (1.7) */
    if (steps <= worst && u2 <= FAR * FAR * size2) continue;
    if (model->contacts.gone && model->contacts.gone[p]) continue;
    bad = p;
    if (PetscIsInfOrNanReal(v2) || PetscIsInfOrNanReal(u2)) what = NOT_FINITE;
    else if (steps > worst) {
      what  = RUNS; /* the fastest of all */
      worst = steps;
      speed = PetscSqrtReal(v2);
    } else if (what == SOUND) {
      what = LOST;
      away = PetscSqrtReal(u2);
    }
  }
  if (what == SOUND) {
    PetscCall(Agree(model, SOUND, 0, fault));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  number = (model->ranks ? model->ranks->number : model->at)[bad];
  for (PetscInt d = 0; d < dim; d++) x[d] = model->x0[d * n + bad];
  if (what == NOT_FINITE)
    PetscCall(PetscSNPrintf(fault, BASE_LINE, "particle %" PetscInt_FMT ", at (%.6g, %.6g, %.6g) m before it moved, has a place or a velocity that is not finite", number, (double)x[0], (double)x[1], (double)x[2]));
  else if (what == RUNS && look == RUN_WATCH_FASTEST)
    PetscCall(PetscSNPrintf(fault, BASE_LINE, "the fastest particle is %" PetscInt_FMT ", at (%.6g, %.6g, %.6g) m before it moved: %.6g m/s", number, (double)x[0], (double)x[1], (double)x[2], (double)speed));
  else if (what == RUNS)
    PetscCall(PetscSNPrintf(fault, BASE_LINE, "particle %" PetscInt_FMT ", at (%.6g, %.6g, %.6g) m before it moved, runs away: %.6g m/s crosses its radius, %.6g m, in less than a step of %.6g s", number, (double)x[0], (double)x[1],
                            (double)x[2], (double)speed, (double)model->r[bad], (double)dt));
  else
    PetscCall(PetscSNPrintf(fault, BASE_LINE, "particle %" PetscInt_FMT ", at (%.6g, %.6g, %.6g) m before it moved, is lost: %.6g m away from there, %.6g times the size of its body: a floor, or contact.domain, would hold it or take it out", number,
                            (double)x[0], (double)x[1], (double)x[2], (double)away, (double)(away / PetscSqrtReal(size2))));
  PetscCall(Agree(model, what, worst, fault));
  PetscFunctionReturn(PETSC_SUCCESS);
}
