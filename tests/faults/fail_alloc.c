/*
  fail_alloc.c - preloaded, it makes one allocation of the program's own fail: the FAIL_AT-th PetscMalloc (counted from 1)
  that is called from a module's own file. Without FAIL_AT it counts, and writes the count to FAIL_COUNT at the end.
*/
#include <petscsys.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static long count, at = -1;

/* Ours, not PETSc's: by the module's folder. */
static int Ours(const char *file)
{
  static const char *const folder[] = {"/app/", "/base/", "/coupling/", "/dem/", "/fem/"};

  for (int k = 0; file && k < 5; k++)
    if (strstr(file, folder[k]) && !strstr(file, "/src/")) return 1;
  return 0;
}

static int Fails(const char *file)
{
  const char *text = getenv("FAIL_AT");

  if (at < 0) at = text ? atol(text) : 0;
  return Ours(file) && __atomic_add_fetch(&count, 1, __ATOMIC_RELAXED) == at;
}

static PetscErrorCode (*next_malloc)(size_t, PetscBool, int, const char[], const char[], void **);
static PetscErrorCode (*next_realloc)(size_t, int, const char[], const char[], void **);

static PetscErrorCode Malloc(size_t size, PetscBool clear, int line, const char function[], const char file[], void **result)
{
  if (Fails(file)) return PetscError(PETSC_COMM_SELF, line, function, file, PETSC_ERR_MEM, PETSC_ERROR_INITIAL, "Memory requested %.0f", (double)size);
  return next_malloc(size, clear, line, function, file, result);
}

static PetscErrorCode Realloc(size_t size, int line, const char function[], const char file[], void **result)
{
  if (Fails(file)) return PetscError(PETSC_COMM_SELF, line, function, file, PETSC_ERR_MEM, PETSC_ERROR_INITIAL, "Memory requested %.0f", (double)size);
  return next_realloc(size, line, function, file, result);
}

__attribute__((constructor)) static void Begin(void)
{
  next_malloc    = PetscTrMalloc;
  next_realloc   = PetscTrRealloc;
  PetscTrMalloc  = Malloc;
  PetscTrRealloc = Realloc;
}

__attribute__((destructor)) static void Tell(void)
{
  const char *file = getenv("FAIL_COUNT");
  FILE       *out  = file && count ? fopen(file, "w") : NULL; /* MPI's helpers are preloaded too, and count nothing */

  if (!out) return;
  fprintf(out, "%ld\n", count);
  fclose(out);
}
