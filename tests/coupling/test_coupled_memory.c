/*
  What a coupled body on several ranks holds on each of them, in bytes that PETSc has given out (run with -malloc_debug): the whole
  model of its particles is there during set-up only. The same bits as on one rank.
*/
#include "check.h"
#include "coupled.h"
#include "dem_solve.h"

#define STEPS 12

typedef struct {
  FemModel      fem;
  DemModel      dem; /* that steps */
  CouplingModel model;
  PetscReal     bytes; /* held after the steps, without what the caller had */
} Side;

/* What a side's models are before they are joined; conditions: held at xmin, pulled at xmax. */
static PetscErrorCode Fem(const Coupled *c, FemModel *fem)
{
  const PetscReal pull[3] = {1e-3, 2e-4, 0};
  Table           one, zero;

  PetscFunctionBegin;
  PetscCall(FemModelCreate(PETSC_COMM_SELF, fem));
  PetscCall(FemModelSetKind(*fem, FEM_PLANE_STRAIN, 1));
  PetscCall(FemModelSetMethod(*fem, FEM_EXPLICIT));
  PetscCall(FemModelSetMesh(*fem, &c->split.fem));
  PetscCall(FemModelAddMaterial(*fem, "", &c->material));
  PetscCall(TableCreateConstant(1, &one));
  PetscCall(TableCreateConstant(0, &zero));
  PetscCall(FemModelFix(*fem, "xmin", 0, FEM_DISPLACEMENT, &zero));
  PetscCall(FemModelAddTraction(*fem, "xmax", pull, &one));
  PetscCall(TableDestroy(&one));
  PetscCall(TableDestroy(&zero));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Dem(MPI_Comm comm, const Coupled *c, DemModel *dem)
{
  const DemMaterial material = {.density = 1, .young = 1, .poisson = 0.2};
  const DemStrength strength = {.tensile = 1, .fracture_energy = 1, .shear = 3, .shear_energy = 1};

  PetscFunctionBegin;
  PetscCall(DemModelCreate(comm, dem));
  PetscCall(DemModelSetKind(*dem, DEM_PLANE_STRAIN));
  PetscCall(DemModelSetMaterial(*dem, &material));
  PetscCall(DemModelSetStrength(*dem, &strength));
  PetscCall(DemModelSetBody(*dem, &c->body, &c->packing, &c->cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Run(MPI_Comm comm, const Coupled *c, Side *s)
{
  PetscLogDouble before, after;
  PetscMPIInt    size;
  DemModel       whole;
  Stepper        stepper;
  PetscReal      dt;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(PetscMallocGetCurrentUsage(&before));
  PetscCall(Fem(c, &s->fem));
  PetscCall(Dem(PETSC_COMM_SELF, c, &whole));
  PetscCall(CouplingModelCreate(comm, &s->model));
  if (size > 1) {
    PetscCall(Dem(comm, c, &s->dem));
    PetscCall(CouplingModelSetPart(s->model, s->dem));
  } else
    s->dem = whole;
  PetscCall(CouplingModelSetSplit(s->model, &c->split, NULL));
  PetscCall(CouplingModelSetSides(s->model, s->fem, whole, &c->packing, &c->cells, &c->material, FEM_PLANE_STRAIN, 1));
  PetscCall(CouplingModelSetUp(s->model));
  PetscCall(CouplingModelGetStepper(s->model, &stepper));
  PetscCall(stepper.stable_step(stepper.ctx, &dt));
  for (PetscInt k = 0; k < STEPS; k++) PetscCall(stepper.step(stepper.ctx, 0.9 * dt * k, 0.9 * dt));
  PetscCall(PetscMallocGetCurrentUsage(&after));
  s->bytes = after - before;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode End(Side *s)
{
  PetscFunctionBegin;
  PetscCall(CouplingModelDestroy(&s->model));
  PetscCall(FemModelDestroy(&s->fem));
  PetscCall(DemModelDestroy(&s->dem));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestMemoryOfARank(void)
{
  const PetscReal size[3] = {12, 6, 0};
  PetscReal       most;
  PetscMPIInt     ranks;
  Coupled         c;
  Side            alone, shared;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &ranks));
  PetscCall(CoupledCreate(2, size, 1, 2, 10, 14, 1, 0.2, 3, NULL, &c)); /* some 10,000 particles */
  PetscCall(Run(PETSC_COMM_SELF, &c, &alone));
  PetscCall(Run(PETSC_COMM_WORLD, &c, &shared));
  PetscCall(TestSameState(shared.dem, alone.dem));
  CheckAbove(alone.bytes, 4e6); /* bytes are counted at all */
  most = shared.bytes;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%" PetscInt_FMT " particles: %.2f MB alone, %.2f MB on the fullest of %d ranks, %.2f of it\n", c.packing.n,
                        (double)(1e-6 * alone.bytes), (double)(1e-6 * most), (int)ranks, (double)(most / alone.bytes)));
  if (ranks > 1) CheckBelow(most, (ranks == 2 ? 0.7 : 0.55) * alone.bytes);
  PetscCall(End(&shared));
  PetscCall(End(&alone));
  PetscCall(CoupledDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestMemoryOfARank)

static const struct CMUnitTest tests[] = {TEST(TestMemoryOfARank)};
CHECK_MAIN(tests)
