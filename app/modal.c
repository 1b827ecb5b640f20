/* modal.c - a run that asks for eigenfrequencies: modes.csv, one frame per mode, summary.json. */
#include "app.h"
#include "files.h"
#if defined(CLEAVE_SLEPC)
  #include "fem_modal.h"

static PetscErrorCode WriteTable(AppCase *c, const FemModal *modes, const char *directory)
{
  char  path[PETSC_MAX_PATH_LEN];
  FILE *out;

  PetscFunctionBegin;
  if (c->rank) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BaseFormat(path, "%s/modes.csv", directory));
  PetscCall(FileCreate(path, &out));
  fprintf(out, "mode[-],frequency[Hz],residual[-]\n");
  for (PetscInt k = 0; k < modes->n; k++) fprintf(out, "%d,%.12g,%.3g\n", (int)k + 1, (double)modes->frequency[k], (double)modes->residual[k]);
  PetscCall(FileFinish(&out, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Frame k is mode k: its time is the mode's number. */
PetscErrorCode AppModal(AppCase *c, Output output, const char *directory, PetscBool quiet)
{
  FemModal  modes;
  PetscInt  count;
  PetscReal shift;

  PetscFunctionBegin;
  PetscCall(SceneGetInt(c->scene, "time.modes", &count));
  PetscCall(SceneGetReal(c->scene, "time.shift", &shift)); /* auto: 0 */
  PetscCall(AppClockBegin(&c->clock, "modes"));
  AppCallAt(c->scene, "time.modes", FemModalSolve(c->fem, count, shift > 0 ? shift : -1, &modes));
  PetscCall(AppClockEnd(&c->clock));
  PetscCall(AppClockBegin(&c->clock, "output"));
  for (PetscInt k = 0; k < count; k++) {
    PetscCall(FemModalShow(c->fem, &modes, k));
    PetscCall(OutputFrameBegin(output, k + 1, k + 1));
    PetscCall(c->stepper.write(c->stepper.ctx, output));
    PetscCall(OutputFrameEnd(output));
  }
  PetscCall(WriteTable(c, &modes, directory));
  PetscCall(AppClockEnd(&c->clock));
  c->n_modes = count;
  PetscCall(PetscMalloc1(count, &c->frequency));
  PetscCall(PetscArraycpy(c->frequency, modes.frequency, count));
  for (PetscInt k = 0; k < count && !quiet && !c->rank; k++) printf("  mode %-4d %.6g Hz\n", (int)k + 1, (double)modes.frequency[k]);
  PetscCall(FemModalDestroy(&modes));
  PetscFunctionReturn(PETSC_SUCCESS);
}
#else
PetscErrorCode AppModal(AppCase *c, Output output, const char *directory, PetscBool quiet)
{
  PetscFunctionBegin;
  PetscCall(SceneFail(c->scene, "time.method", "this build has no SLEPc, which finds eigenfrequencies; install slepc-dev and build again"));
  PetscFunctionReturn(PETSC_SUCCESS);
}
#endif
