/* What comes back from overlaps of one, two and four elements, against an edge: the whole table of docs/validation/coupled_wave.md. */
#include "check.h"
#include "wave.h"

static PetscErrorCode TestWidths(void)
{
  static const PetscReal lambda[]   = {4, 5, 6, 8, 10, 20};
  static const PetscReal seen[6][3] = {{3.467e-03, 8.591e-04, 7.577e-04}, {4.402e-03, 8.818e-05, 1.773e-04}, {2.920e-03, 4.552e-04, 3.668e-04},
                                       {1.163e-03, 4.988e-04, 3.116e-05}, {5.200e-04, 3.142e-04, 9.511e-06}, {3.598e-05, 3.204e-05, 1.902e-05}};
  static const PetscInt  width[]    = {1, 2, 4};

  PetscFunctionBeginUser;
  for (int i = 0; i < 6; i++) {
    PetscReal energy[3], dt = 0;

    for (int k = 0; k < 3; k++) PetscCall(WaveReflect(lambda[i], width[k], NULL, &energy[k], &dt));
    print_message("           %4.0f h: edge %.3e; overlap of 1, 2, 4 h: %.3e %.3e %.3e\n", (double)lambda[i], (double)WaveEdge(lambda[i], dt), (double)energy[0], (double)energy[1], (double)energy[2]);
    for (int k = 0; k < 3; k++) CheckClose(energy[k], seen[i][k], 5e-3); /* as in the page, so that a change shows */
    /* one element is as good as the edge where waves are so long that neither sends back anything: 5 % above 3.4e-5 */
    for (int k = 0; k < 3; k++) CheckBelow(energy[k], (k == 0 && lambda[i] == 20 ? 1.05 : 1) * WaveEdge(lambda[i], dt));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestWidths)

static const struct CMUnitTest tests[] = {TEST(TestWidths)};

CHECK_MAIN(tests)
