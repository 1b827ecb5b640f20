/* dem_watch.c - is the state one of particles?  Eq. (1.7) of docs/theory.md */
#include "dem_impl.h"

#define FAR 1000. /* sizes of its body that a particle may be away from where it began */

PetscErrorCode DemWatch_Internal(void *ctx, RunWatch look, char fault[BASE_LINE])
{
  DemModel        model = ctx;
  const PetscInt  n = model->n, dim = model->dim;
  const PetscReal dt = model->dt_last;
  PetscReal       size2 = 0, worst = look == RUN_WATCH_FASTEST ? 0 : 1, speed = 0, away = 0, x[3] = {0};
  PetscInt        bad = -1;
  enum { SOUND, NOT_FINITE, RUNS, LOST } what = SOUND;

  PetscFunctionBegin;
  fault[0] = 0;
  for (PetscInt d = 0; d < dim; d++) size2 += PetscSqr(model->body.high[d] - model->body.low[d]);
  for (PetscInt p = 0; p < n && what != NOT_FINITE; p++) {
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
  if (what == SOUND) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt d = 0; d < dim; d++) x[d] = model->x0[d * n + bad];
  if (what == NOT_FINITE)
    PetscCall(PetscSNPrintf(fault, BASE_LINE, "particle %" PetscInt_FMT ", at (%.6g, %.6g, %.6g) m before it moved, has a place or a velocity that is not finite", model->at[bad], (double)x[0], (double)x[1], (double)x[2]));
  else if (what == RUNS && look == RUN_WATCH_FASTEST)
    PetscCall(PetscSNPrintf(fault, BASE_LINE, "the fastest particle is %" PetscInt_FMT ", at (%.6g, %.6g, %.6g) m before it moved: %.6g m/s", model->at[bad], (double)x[0], (double)x[1], (double)x[2], (double)speed));
  else if (what == RUNS)
    PetscCall(PetscSNPrintf(fault, BASE_LINE, "particle %" PetscInt_FMT ", at (%.6g, %.6g, %.6g) m before it moved, runs away: %.6g m/s crosses its radius, %.6g m, in less than a step of %.6g s", model->at[bad], (double)x[0], (double)x[1],
                            (double)x[2], (double)speed, (double)model->r[bad], (double)dt));
  else
    PetscCall(PetscSNPrintf(fault, BASE_LINE, "particle %" PetscInt_FMT ", at (%.6g, %.6g, %.6g) m before it moved, is lost: %.6g m away from there, %.6g times the size of its body: a floor, or contact.domain, would hold it or take it out", model->at[bad],
                            (double)x[0], (double)x[1], (double)x[2], (double)away, (double)(away / PetscSqrtReal(size2))));
  PetscFunctionReturn(PETSC_SUCCESS);
}
