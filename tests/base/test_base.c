/* test_base.c - what PETSc's own allocator gets wrong when there is no memory. */
#include "check.h"

/* The code is that of memory and the words are of it, from whatever line the call is. */
static PetscErrorCode TestNoMemory(void)
{
  char *p = NULL;

  PetscFunctionBeginUser;
#ifndef __SANITIZE_ADDRESS__ /* which ends a process that asks for so much */
  CheckFails(PetscMalloc1((size_t)1 << 60, &p), PETSC_ERR_MEM, "No memory: 1.15292e+12 MB more were refused");
  PetscCall(PetscMalloc1(8, &p));
  CheckFails(PetscRealloc((size_t)1 << 60, &p), PETSC_ERR_MEM, "No memory: 1.15292e+12 MB in place of less were refused");
  PetscCall(PetscFree(p));
#endif
  PetscCall(PetscMalloc1(8, &p));
  PetscCall(PetscFree(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestNoMemory)

static const struct CMUnitTest tests[] = {TEST(TestNoMemory)};
CHECK_MAIN(tests)
