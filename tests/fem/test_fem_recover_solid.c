/* Recovered stress of quadratic elements in space: orders. */
#include "recover_case.h"

static PetscErrorCode TestOrders(void)
{
  static const MeshCellType types[] = {MESH_TET10, MESH_HEX20, MESH_HEX27, MESH_PRISM15, MESH_PRISM18};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 5; t++) PetscCall(RecoverCheckOrders(types[t], types[t] == MESH_TET10 ? 3 : 5, 2.6, types[t] == MESH_HEX20 || types[t] == MESH_PRISM15 ? 0 : 2));
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestOrders)

static const struct CMUnitTest tests[] = {TEST(TestOrders)};
CHECK_MAIN(tests)
