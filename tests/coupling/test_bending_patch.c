/*
  A beam in pure bending whose middle is particles, against the exact solution: the first field beyond the patch test's, which the overlap can
  only converge on. Equilibrium of both sides at once, by the static start.

  With Y = y - D/2 and curvature kappa, E' = E/(1 - nu^2) in plane strain and E in a solid:

    u_x = kappa x Y,   u_y = -kappa/2 [ x^2 + nu/(1 - nu) Y^2 ]                                      plane strain
    u_x = kappa x Y,   u_y = -kappa/2 [ x^2 + nu (Y^2 - Z^2) ],   u_z = -kappa nu Y Z                solid
    sigma_xx = E' kappa Y, all other stress zero but sigma_zz = nu sigma_xx in plane strain
*/
#include "check.h"
#include "coupled.h"
#include "dem_impl.h" /* mean stress of particles */
#include "fem_case.h"

#define LENGTH 12
#define NU 0.2
#define KAPPA 1e-7 /* curvature [1/m]: 2e-7 of strain, small against the difference of forces' own step */

static PetscReal depth, breadth; /* of the body made last */

static PetscBool AtEnds(const PetscReal x[3]) { return (PetscBool)(x[0] < 1e-9 || x[0] > LENGTH - 1e-9); }

static void Exact(PetscInt dim, const PetscReal x[3], PetscReal u[3])
{
  const PetscReal Y = x[1] - 0.5 * depth, Z = dim == 3 ? x[2] - 0.5 * breadth : 0;

  u[0] = KAPPA * x[0] * Y;
  u[1] = -0.5 * KAPPA * (x[0] * x[0] + (dim == 3 ? NU * (Y * Y - Z * Z) : NU / (1 - NU) * Y * Y));
  u[2] = -KAPPA * NU * Y * Z;
}

/* Of node a of a line or rectangle of order 1 or 2, whose place along the side is at = -1, 0 or 1. */
static PetscReal Shape(PetscInt order, PetscReal at, PetscReal s)
{
  if (order == 1) return 0.5 * (1 + at * s);
  return PetscAbsReal(at) < 0.5 ? 1 - s * s : 0.5 * s * (s + at);
}

/* f [nodes] = integral of N_I sigma_xx over the end x = LENGTH. Simpson's rule, exact here, over facets that are lines or rectangles. */
static PetscErrorCode EndForces(const Mesh *mesh, PetscReal modulus, PetscReal *f)
{
  static const PetscReal s[3] = {-1, 0, 1}, w[3] = {1. / 3, 4. / 3, 1. / 3};
  const MeshGroup       *end;

  PetscFunctionBegin;
  PetscCall(MeshFindGroup(mesh, "xmax", &end));
  for (PetscInt k = 0; k < end->n_cells; k++) {
    const PetscInt c = end->cell[k], n = mesh->start[c + 1] - mesh->start[c], corners = MeshCellCorners(mesh->type[c]), order = n > corners ? 2 : 1,
                   *node = mesh->node + mesh->start[c];
    PetscReal middle[3] = {0}, half[3] = {0};

    for (PetscInt a = 0; a < corners; a++)
      for (PetscInt d = 1; d < 3; d++) middle[d] += mesh->x[3 * node[a] + d] / corners;
    for (PetscInt d = 1; d < 3; d++) half[d] = PetscAbsReal(mesh->x[3 * node[0] + d] - middle[d]);
    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < (mesh->dim == 3 ? 3 : 1); j++) {
        const PetscReal stress = modulus * KAPPA * (middle[1] + s[i] * half[1] - 0.5 * depth);

        for (PetscInt a = 0; a < n; a++) {
          PetscReal N = Shape(order, (mesh->x[3 * node[a] + 1] - middle[1]) / half[1], s[i]) * w[i] * half[1];

          if (mesh->dim == 3) N *= Shape(order, (mesh->x[3 * node[a] + 2] - middle[2]) / half[2], s[j]) * w[j] * half[2];
          f[node[a]] += N * stress;
        }
      }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  MeshCellType type;
  FemElement   element;
  PetscReal    h, ratio, depth, breadth, half; /* edge; particles to an edge; of the body; half the length that is particles alone */
  PetscInt     width;
} Beam;

typedef struct {
  PetscReal tip, field, curvature, stress; /* relative errors: of the far end's deflection; rms of u of nodes and particles over its largest; of the particles'
                                              curvature; rms of their sigma_xx over its largest */
  PetscReal alone;                         /* tip of elements alone, the same mesh */
  PetscInt  particles;
} Bent;

/* Held as the exact solution has it: no u_x at xmin, one node's place, in space one more against turning about x. */
static PetscErrorCode Hold(FemModel fem, const Mesh *mesh, PetscReal modulus)
{
  const PetscReal push[3] = {1, 0, 0};
  PetscReal      *f;
  Table           table;

  PetscFunctionBegin;
  PetscCall(CaseFix(fem, "xmin", 0, 0));
  PetscCall(PetscCalloc1(mesh->n_nodes, &f));
  PetscCall(EndForces(mesh, modulus, f));
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    const PetscReal *x = mesh->x + 3 * i;
    const PetscBool  origin = (PetscBool)(x[0] < 1e-9 && x[1] < 1e-9 && x[2] < 1e-9), above = (PetscBool)(x[0] < 1e-9 && x[1] > depth - 1e-9 && x[2] < 1e-9);
    PetscReal        u[3];
    char             name[64];

    PetscCall(BaseFormat(name, "node %d", (int)i));
    Exact(mesh->dim, x, u);
    for (PetscInt d = 1; d < mesh->dim; d++)
      if (origin || (above && d == 2)) PetscCall(CaseFix(fem, name, d, u[d]));
    if (f[i] == 0) continue;
    PetscCall(TableCreateConstant(f[i], &table));
    PetscCall(FemModelAddForce(fem, name, push, &table));
    PetscCall(TableDestroy(&table));
  }
  PetscCall(PetscFree(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Deflection of the far end's first corner over the exact one, less 1. u [nodes][stride] */
static PetscReal Tip(PetscInt dim, PetscInt n, PetscInt stride, const PetscReal *x, const PetscReal *u)
{
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal at[3] = {x[i * stride], x[i * stride + 1], dim == 3 ? x[i * stride + 2] : 0};
    PetscReal       want[3];

    if (at[0] < LENGTH - 1e-9 || at[1] > 1e-9 || at[2] > 1e-9) continue;
    Exact(dim, at, want);
    return u[i * stride + 1] / want[1] - 1;
  }
  return PETSC_INFINITY;
}

static PetscErrorCode Alone(const Beam *beam, const Coupled *c, PetscReal modulus, PetscReal *tip)
{
  FemModel   fem;
  PetscReal *u;

  PetscFunctionBegin;
  PetscCall(CaseModel(PETSC_COMM_SELF, &c->mesh, c->mesh.dim == 3 ? FEM_SOLID : FEM_PLANE_STRAIN, FEM_STATIC, 1, &c->material, &fem));
  PetscCall(FemModelSetElement(fem, beam->element));
  PetscCall(Hold(fem, &c->mesh, modulus));
  PetscCall(CaseSolve(fem));
  PetscCall(PetscMalloc1(3 * c->mesh.n_nodes, &u));
  PetscCall(FemModelGetField(fem, "displacement", u));
  *tip = Tip(c->mesh.dim, c->mesh.n_nodes, 3, c->mesh.x, u);
  PetscCall(PetscFree(u));
  PetscCall(FemModelDestroy(&fem));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Errors of particles alone, between the two overlaps: slope of their turns about z along the beam, which is -kappa x, and stress. */
static PetscErrorCode Particles(const Beam *beam, DemModel dem, PetscReal modulus, Bent *bent)
{
  PetscReal sx = 0, st = 0, sxx = 0, sxt = 0, off = 0, *stress;
  PetscInt  n = 0;
  DemState  ds;

  PetscFunctionBegin;
  PetscCall(DemModelGetState(dem, &ds));
  PetscCall(PetscMalloc1(6 * ds.n, &stress));
  PetscCall(DemStress_Internal(dem, stress));
  for (PetscInt p = 0; p < ds.n; p++) {
    const PetscReal x = ds.x0[p], turn = ds.dim == 2 ? ds.rot[2 * ds.n + p] : 2 * ds.rot[3 * ds.n + p];

    if (PetscAbsReal(x - 0.5 * LENGTH) > beam->half) continue;
    n++;
    sx += x;
    st += turn;
    sxx += x * x;
    sxt += x * turn;
    off += PetscSqr(stress[6 * ds.number[p]] - modulus * KAPPA * (ds.x0[ds.n + p] - 0.5 * depth));
  }
  bent->particles = ds.n;
  bent->curvature = -(n * sxt - sx * st) / (n * sxx - sx * sx) / KAPPA - 1;
  bent->stress = PetscSqrtReal(off / n) / (modulus * KAPPA * 0.5 * depth);
  PetscCall(PetscFree(stress));
  PetscCall(DemModelRestoreState(dem, &ds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Bend(const Beam *beam, Bent *bent)
{
  const PetscInt        dim = MeshCellDim(beam->type);
  const PetscReal       size[3] = {LENGTH, beam->depth, beam->breadth}, modulus = dim == 3 ? 1 : 1 / (1 - NU * NU);
  const CouplingOptions options = {.floor = 0.05, .affine = PETSC_TRUE, .substeps = 1, .preload = PETSC_TRUE};
  PetscReal             most = 0, off = 0;
  Coupled               c;
  FemState              fs;
  DemState              ds;

  PetscFunctionBegin;
  depth = beam->depth;
  breadth = beam->breadth;
  PetscCall(CoupledCreateNodes(beam->type, size, beam->h, 0.5 * LENGTH - beam->half, 0.5 * LENGTH + beam->half, beam->ratio, beam->width, NU, 11, AtEnds,
                               &options, &c));
  PetscCall(FemModelSetElement(c.fem, beam->element));
  PetscCall(Hold(c.fem, &c.mesh, modulus));
  PetscCall(FemModelSetStartGiven(c.fem, PETSC_TRUE));
  PetscCall(CouplingModelSetUp(c.model));
  PetscCall(FemModelGetState(c.fem, &fs));
  PetscCall(DemModelGetState(c.dem, &ds));
  for (PetscInt i = 0; i < fs.n_nodes + ds.n; i++) {
    const PetscInt p = i - fs.n_nodes;
    PetscReal      x[3] = {0}, u[3];

    for (PetscInt d = 0; d < dim; d++) x[d] = p < 0 ? fs.x[i * dim + d] : ds.x0[d * ds.n + p];
    Exact(dim, x, u);
    for (PetscInt d = 0; d < dim; d++) {
      most = PetscMax(most, PetscAbsReal(u[d]));
      off += PetscSqr((p < 0 ? fs.u[i * dim + d] : ds.u[d * ds.n + p]) - u[d]);
    }
  }
  bent->field = PetscSqrtReal(off / (fs.n_nodes + ds.n)) / most;
  bent->tip = Tip(dim, fs.n_nodes, dim, fs.x, fs.u);
  PetscCall(FemModelRestoreState(c.fem, &fs));
  PetscCall(DemModelRestoreState(c.dem, &ds));
  PetscCall(Particles(beam, c.dem, modulus, bent));
  PetscCall(Alone(beam, &c, modulus, &bent->alone));
  PetscCall(CoupledDestroy(&c));
  print_message("           %2d nodes%s, h = %.3g, overlap of %d: tip %+.5f (elements alone %+.5f), displacement %.2e, particles' curvature %+.5f, stress "
                "%.4f; %d particles\n",
                (int)MeshCellNodes(beam->type), beam->element == FEM_FULL ? ", plain" : "", (double)beam->h, (int)beam->width, (double)bent->tip,
                (double)bent->alone, (double)bent->field, (double)bent->curvature, (double)bent->stress, (int)bent->particles);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Slope(PetscReal coarse, PetscReal fine) { return PetscLogReal(coarse / fine) / PetscLogReal(2.); }

/*
  Three elements over the depth. Linear elements without locking and quadratic ones bend exactly alone, so what is off is the overlap's and the particles' own:
  below 1 % of the tip's deflection at the default width, displacement of second order in h, particles' stress of first. Plain linear elements are too stiff;
  particles in their middle take from that. -bend_fine: one halving more and all widths, the table of docs/validation/bending.md.
*/
static PetscErrorCode TestPlane(void)
{
  static const struct {
    MeshCellType type;
    FemElement   element;
    PetscReal    ratio;
  } kind[] = {{MESH_QUAD4, FEM_ENHANCED, 4}, {MESH_QUAD4, FEM_FULL, 4}, {MESH_TRI3, FEM_FULL, 4}, {MESH_QUAD9, FEM_ENHANCED, 6}, {MESH_TRI6, FEM_FULL, 6}};
  PetscBool fine = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-bend_fine", &fine, NULL));
  for (size_t k = 0; k < sizeof(kind) / sizeof(kind[0]); k++) {
    const PetscBool bends = (PetscBool)(k != 1 && k != 2);
    Bent            bent[5] = {{0}};
    PetscInt        n = 0;

    for (PetscReal h = 1; h > (fine || k == 0 ? 0.2 : 0.4); h *= 0.5) {
      const Beam beam = {kind[k].type, kind[k].element, h, kind[k].ratio, 3, 1, 1, 2};

      PetscCall(Bend(&beam, &bent[n++]));
      if (n == 1) continue;
      CheckAbove(Slope(bent[n - 2].field, bent[n - 1].field), k == 2 ? 1.5 : 1.8);
      CheckAbove(Slope(bent[n - 2].stress, bent[n - 1].stress), k == 2 ? 0.5 : 0.8);
    }
    for (PetscInt width = 1; width <= 4; width++) {
      const Beam beam = {kind[k].type, kind[k].element, 1, kind[k].ratio, 3, 1, 1, width};

      if (width == 2 || (!fine && width == 4)) continue;
      PetscCall(Bend(&beam, &bent[n]));
      CheckBelow(PetscAbsReal(bent[n].tip), bends ? 0.01 : PetscAbsReal(bent[n].alone));
    }
    if (bends) {
      CheckBelow(PetscAbsReal(bent[0].tip), 0.01);
      CheckBelow(PetscAbsReal(bent[0].alone), 1e-9);
      CheckBelow(PetscAbsReal(bent[0].curvature), 0.01);
    } else
      CheckBelow(PetscAbsReal(bent[0].tip), PetscAbsReal(bent[0].alone));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestPlane)

/* Two linear elements over depth and breadth, or one quadratic one. */
static PetscErrorCode TestSolid(void)
{
  static const Beam beam[] = {{MESH_HEX8, FEM_ENHANCED, 1, 3, 2, 2, 1, 2},
                              {MESH_HEX8, FEM_ENHANCED, 0.5, 3, 2, 2, 1, 2},
                              {MESH_HEX8, FEM_ENHANCED, 1, 3, 2, 2, 1, 1},
                              {MESH_HEX27, FEM_ENHANCED, 2, 8, 2, 2, 2, 1}};
  PetscBool         fine = PETSC_FALSE;
  Bent              bent[4];

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-bend_fine", &fine, NULL));
  for (PetscInt k = 0; k < 4; k++) {
    if (k == 1 && !fine) continue;
    PetscCall(Bend(&beam[k], &bent[k]));
    CheckBelow(PetscAbsReal(bent[k].tip), 0.01);
    CheckBelow(PetscAbsReal(bent[k].alone), 1e-9);
  }
  if (fine) CheckAbove(Slope(bent[0].field, bent[1].field), 1.8);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestSolid)

static const struct CMUnitTest tests[] = {TEST(TestPlane), TEST(TestSolid)};

CHECK_MAIN(tests)
