/* Waves from fine to coarse: what an edge sends back on its closed form, and an overlap that sends back no more. */
#include "check.h"
#include "wave.h"

static const PetscReal lambdas[] = {4, 5, 6, 8, 10, 20};

/* Chain of elements d = h/4 joined to h at a node.  Closed form: overlap's yardstick, docs/theory.md 6 */
static PetscErrorCode TestEdge(void)
{
  PetscFunctionBeginUser;
  for (size_t i = 0; i < sizeof(lambdas) / sizeof(lambdas[0]); i++) {
    PetscReal energy, dt, exact;

    PetscCall(WaveReflect(lambdas[i], 0, NULL, &energy, &dt));
    exact = WaveEdge(lambdas[i], dt);
    print_message("           %4.0f h: edge %.3e, closed form %.3e (%+.2f %%)\n", (double)lambdas[i], (double)energy, (double)exact, (double)(100 * (energy / exact - 1)));
    CheckClose(energy, exact, 1e-3);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestEdge)

/* Two elements of overlap send back less than the edge at every wavelength, and what the one-dimensional chain does: its values in the
   frequency domain, exact ends, at this step (dense matrices of the same energy, written apart). */
static PetscErrorCode TestOverlap(void)
{
  const PetscReal chain[] = {8.5933e-4, 8.8065e-5, 4.5500e-4, 4.9874e-4, 3.1417e-4, 3.2044e-5};

  PetscFunctionBeginUser;
  for (size_t i = 0; i < sizeof(lambdas) / sizeof(lambdas[0]); i++) {
    PetscReal energy, dt;

    PetscCall(WaveReflect(lambdas[i], 2, NULL, &energy, &dt));
    print_message("           %4.0f h: overlap of 2 h %.3e, edge %.3e\n", (double)lambdas[i], (double)energy, (double)WaveEdge(lambdas[i], dt));
    CheckBelow(energy, WaveEdge(lambdas[i], dt));
    CheckClose(energy, chain[i], 2e-3);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOverlap)

/* Quadratic cells of twice the edge, as many nodes and particles as linear ones: one of them, from four to a wave on, sends back less than two linear ones. */
static PetscErrorCode TestQuadratic(void)
{
  PetscFunctionBeginUser;
  for (PetscReal lambda = 8; lambda <= 10; lambda += 2) {
    PetscReal energy, linear, dt;

    PetscCall(WaveReflectFrom(MESH_QUAD9, 2, lambda, 1, NULL, &energy, &dt));
    PetscCall(WaveReflect(lambda, 2, NULL, &linear, NULL));
    print_message("           %4.0f h: one quadratic cell %.3e, two linear ones %.3e, edge %.3e\n", (double)lambda, (double)energy, (double)linear, (double)WaveEdge(lambda, dt));
    CheckBelow(energy, linear);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestQuadratic)

static const struct CMUnitTest tests[] = {TEST(TestEdge), TEST(TestOverlap), TEST(TestQuadratic)};

CHECK_MAIN(tests)
