#include "lab.h"
#include "fem_case.h"

const char *const LabShapeName[] = {"box", "cylinder"};
#define HEIGHT 2.0

static const PetscReal shorten = 1e-9; /* small enough for both sides to be linear, large enough for differences of positions */

PetscErrorCode LabSpecimen(LabShape shape, PetscInt count, PetscInt seed, TestBody *t)
{
  const PetscReal         low[3] = {-0.5, -0.5, 0}, size[3] = {0.5, 0.5, HEIGHT}, bottom[3] = {0};
  const DemPackingOptions options = {.count = count, .spread = 0.2, .seed = seed};

  PetscFunctionBegin;
  PetscCall(PetscMemzero(t, sizeof(*t)));
  if (shape == LAB_BOX) PetscCall(DemBodyCreateBox(3, low, size, 1, &t->body));
  else PetscCall(DemBodyCreateCylinder(bottom, 0.5, HEIGHT, 64, &t->body));
  PetscCall(DemPackingCreate(&t->body, &options, &t->packing));
  PetscCall(DemCellsCreate(&t->body, &t->packing, &t->cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode LabUniaxialSolve(const TestBody *body, const DemRule *rule, PetscReal nu, PetscBool glued, PetscReal rtol, LabUniaxial *result)
{
  const char *const low = body->body.face_name[0][0] == 'b' ? "bottom" : "zmin", *const high = low[0] == 'b' ? "top" : "zmax";
  const PetscReal   section = DemBodyVolume(&body->body) / HEIGHT;
  const PetscInt    rounds = rule && rule->poisson_term ? 60 : 1;
  PetscReal        *x, g[8], value, before = 0;
  DemModel          model;
  Stepper           stepper;
  Table             none, shift;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(result, sizeof(*result)));
  PetscCall(TestModelCreate(body, DEM_SOLID, 1, nu, &model));
  if (rule) PetscCall(DemModelSetRule(model, rule));
  PetscCall(TableCreateConstant(0, &none));
  PetscCall(TableCreateConstant(-shorten, &shift));
  for (PetscInt d = glued ? 0 : 2; d < 3; d++) {
    PetscCall(DemModelFix(model, low, d, DEM_DISPLACEMENT, &none));
    PetscCall(DemModelFix(model, high, d, DEM_DISPLACEMENT, d == 2 ? &shift : &none));
  }
  PetscCall(DemModelAddHistory(model, "reaction", high));
  PetscCall(DemModelAddColumns(model, "gauge"));
  PetscCall(DemModelSetUp(model));
  PetscCall(DemModelGetStepper(model, &stepper));
  PetscCall(PetscCalloc1(TestUnknowns(model), &x));
  for (PetscInt round = 0; round < rounds; round++) {
    PetscInt its;

    PetscCall(TestEquilibrium(model, rtol, x, &its));
    result->iterations += its;
    PetscCall(stepper.history(model, 2, &value));
    result->modulus = -value / section / (shorten / HEIGHT);
    if (PetscAbsReal(result->modulus - before) < 1e-6) break;
    before = result->modulus;
    if (round + 1 < rounds) { /* no motion: stresses follow the state, and the forces of the term with them */
      DemState s;

      PetscCall(DemModelGetState(model, &s));
      PetscCall(PetscArrayzero(s.v, 3 * s.n));
      PetscCall(PetscArrayzero(s.spin, 3 * s.n));
      PetscCall(DemModelRestoreState(model, &s));
      PetscCall(stepper.step(model, 0, 1e-300));
    }
  }
  for (PetscInt c = 0; c < 8; c++) PetscCall(stepper.history(model, 3 + c, &g[c]));
  result->E  = g[6];
  result->nu = g[7];
  PetscCall(PetscFree(x));
  PetscCall(TableDestroy(&none));
  PetscCall(TableDestroy(&shift));
  PetscCall(DemModelDestroy(&model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode LabGluedFem(LabShape shape, PetscReal nu, PetscReal size, LabUniaxial *result)
{
  const PetscReal   length[3] = {1, 1, HEIGHT}, bottom[3] = {0};
  const PetscInt    n = (PetscInt)PetscCeilReal(1 / size - 1e-9), cells[3] = {n, n, 2 * n};
  const char *const low = shape == LAB_BOX ? "zmin" : "bottom", *const high = shape == LAB_BOX ? "zmax" : "top";
  const MeshOptions options = {.dimension = 3, .size = size, .order = 2, .scale = 1};
  const FemMaterial material = {.density = 1, .young = 1, .poisson = nu};
  PetscReal        *u, *stress, s[3] = {0}, volume = 0, mx[3] = {0}, mu[3] = {0}, xx[3] = {0}, xu[3] = {0};
  FemModel          model;
  Mesh              mesh;

  PetscFunctionBegin;
  if (shape == LAB_BOX) PetscCall(CaseBox(PETSC_COMM_SELF, MESH_HEX20, length, cells, 0, &mesh));
  else PetscCall(MeshCreateRound(PETSC_COMM_SELF, "body", bottom, 0.5, HEIGHT, &options, &mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, &mesh, FEM_SOLID, FEM_STATIC, 1, &material, &model));
  PetscCall(CaseFix(model, low, 2, 0));
  PetscCall(CaseFix(model, high, 2, -1));
  for (PetscInt d = 0; d < 2; d++) {
    PetscCall(CaseFix(model, low, d, 0));
    PetscCall(CaseFix(model, high, d, 0));
  }
  PetscCall(FemModelAddHistory(model, "reaction", high));
  PetscCall(CaseSolve(model));
  PetscCall(PetscMalloc2(3 * mesh.n_nodes, &u, 6 * mesh.n_cells, &stress));
  PetscCall(FemModelGetField(model, "displacement", u));
  PetscCall(FemModelGetField(model, "element_stress", stress));
  {
    char name[64];

    PetscCall(BaseFormat(name, "reaction(%s).z", high));
    result->modulus = -CaseHistory(model, name) / (shape == LAB_BOX ? 1 : PETSC_PI / 4) * HEIGHT;
  }
  for (PetscInt pass = 0; pass < 2; pass++)
    for (PetscInt c = 0, e = 0; c < mesh.n_cells; c++) { /* as the gauge of particles: volume-weighted slope of u on x over the middle half */
      const PetscInt *node = mesh.node + mesh.start[c], corners = MeshCellCorners(mesh.type[c]), all = MeshCellNodes(mesh.type[c]);
      PetscReal       x[3] = {0}, v[3] = {0}, V = 1;

      if (MeshCellDim(mesh.type[c]) < 3) continue;
      for (PetscInt a = 0; a < corners; a++)
        for (PetscInt d = 0; d < 3; d++) x[d] += mesh.x[3 * node[a] + d] / corners;
      for (PetscInt d = 0; d < 3; d++) { /* serendipity and tet10 alike at the middle: -1/4 (-1/8) of the corners and 1/4 of the edges */
        const PetscInt edges = all - corners;

        for (PetscInt a = 0; a < all; a++) v[d] += u[3 * node[a] + d] * (a < corners ? (corners == 8 ? -0.25 : -0.125) : (corners == 8 ? 3.0 / edges : 1.5 / edges));
      }
      if (corners == 4) {
        PetscReal A[3][3];

        for (PetscInt a = 0; a < 3; a++)
          for (PetscInt d = 0; d < 3; d++) A[a][d] = mesh.x[3 * node[a + 1] + d] - mesh.x[3 * node[0] + d];
        V = PetscAbsReal(A[0][0] * (A[1][1] * A[2][2] - A[1][2] * A[2][1]) - A[0][1] * (A[1][0] * A[2][2] - A[1][2] * A[2][0]) + A[0][2] * (A[1][0] * A[2][1] - A[1][1] * A[2][0])) / 6;
      }
      e++;
      if (PetscAbsReal(x[2] - 0.5 * HEIGHT) > 0.25 * HEIGHT) continue;
      for (PetscInt d = 0; d < 3; d++) {
        if (!pass) {
          mx[d] += V * x[d];
          mu[d] += V * v[d];
          s[d] += V * stress[6 * (e - 1) + d];
        } else {
          xx[d] += V * PetscSqr(x[d] - mx[d] / volume);
          xu[d] += V * (x[d] - mx[d] / volume) * (v[d] - mu[d] / volume);
        }
      }
      if (!pass) volume += V;
    }
  result->E          = s[2] / volume / (xu[2] / xx[2]);
  result->nu         = -0.5 * (xu[0] / xx[0] + xu[1] / xx[1]) / (xu[2] / xx[2]);
  result->iterations = 0;
  PetscCall(PetscFree2(u, stress));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}
