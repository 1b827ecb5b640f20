/* clock.c - wall time by phase, threads, errors at a place: small things every command uses. */
#define _GNU_SOURCE /* sched_getaffinity */
#include "app.h"
#include <petsctime.h>
#include <sched.h>
#include <string.h>

void AppClockAdd(AppClock *clock, const char *phase, PetscLogDouble seconds)
{
  PetscInt k = 0;

  while (k < clock->n && strcmp(clock->name[k], phase)) k++;
  if (k == APP_PHASES) return;
  if (k == clock->n) {
    clock->name[clock->n++] = phase;
    clock->seconds[k]       = 0;
  }
  clock->seconds[k] += seconds;
}

PetscErrorCode AppClockBegin(AppClock *clock, const char *phase)
{
  PetscFunctionBegin;
  AppClockAdd(clock, phase, 0);
  PetscCall(PetscTime(&clock->began));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ends the phase begun last. */
PetscErrorCode AppClockEnd(AppClock *clock)
{
  PetscLogDouble now;

  PetscFunctionBegin;
  PetscCall(PetscTime(&now));
  if (clock->n) clock->seconds[clock->n - 1] += now - clock->began;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ranks bound to cores of their own keep them; ranks that may use the same cores share them evenly. */
PetscErrorCode AppThreads(MPI_Comm comm, PetscInt asked, PetscInt *threads)
{
  MPI_Comm    local;
  PetscMPIInt ranks;
  cpu_set_t   mine, all;

  PetscFunctionBegin;
  if (asked) {
    *threads = asked;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  CPU_ZERO(&mine);
  if (sched_getaffinity(0, sizeof(mine), &mine)) CPU_SET(0, &mine);
  PetscCallMPI(MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &local));
  PetscCallMPI(MPI_Comm_size(local, &ranks));
  PetscCallMPI(MPI_Allreduce(&mine, &all, (int)sizeof(all), MPI_BYTE, MPI_BOR, local));
  PetscCallMPI(MPI_Comm_free(&local));
  *threads = PetscMax(1, CPU_COUNT(&all) / ranks);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppErrorAt(Scene scene, const char *path, PetscErrorCode code)
{
  char message[BASE_LINE];

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(message, BaseErrorMessage(), sizeof(message)));
  BaseErrorClear();
  if (code == PETSC_ERR_USER_INPUT) PetscCall(SceneFail(scene, path, "%s", message));
  SETERRQ(PETSC_COMM_SELF, code, "%s", message);
}
