/* test_body.c - bodies: volumes, faces, pieces of meshes, what is refused. */
#include "body_cases.h"
#include "check.h"
#include "dem_body_impl.h"

/* The boundary is closed: outward area vectors sum to zero. */
static void CheckClosed(const DemBody *body)
{
  const PetscInt dim = body->dim;
  PetscReal      sum[3] = {0, 0, 0}, size = 0;

  for (PetscInt k = 0; k < body->n_simplices; k++) {
    const PetscReal *s = &body->simplex[3 * dim * k];
    PetscReal        n[3], area;

    DemBodyNormal(dim, s, n);
    if (dim == 2) {
      area = PetscSqrtReal(PetscSqr(s[3] - s[0]) + PetscSqr(s[4] - s[1]));
    } else {
      const PetscReal u[3] = {s[3] - s[0], s[4] - s[1], s[5] - s[2]}, v[3] = {s[6] - s[0], s[7] - s[1], s[8] - s[2]};

      area = 0.5 * (n[0] * (u[1] * v[2] - u[2] * v[1]) + n[1] * (u[2] * v[0] - u[0] * v[2]) + n[2] * (u[0] * v[1] - u[1] * v[0]));
    }
    size += area;
    for (PetscInt c = 0; c < 3; c++) sum[c] += area * n[c];
  }
  for (PetscInt c = 0; c < 3; c++) CheckNear(sum[c], 0, 1e-14 * size);
}

static PetscErrorCode TestBox(void)
{
  const PetscReal low[3] = {1, 2, 3}, high[3] = {2, 4, 6};
  DemBody         body;
  PetscInt        face;

  PetscFunctionBeginUser;
  PetscCall(DemBodyCreateBox(3, low, high, 0, &body));
  CheckClose(DemBodyVolume(&body), 6, 1e-15);
  CheckInt(body.n_faces, 6);
  PetscCall(DemBodyFindFace(&body, "zmax", &face));
  for (PetscInt k = 0; k < body.start[1]; k++)
    if (body.face[k] == face) {
      CheckNear(body.plane[4 * k + 2], 1, 0);
      CheckNear(body.plane[4 * k + 3], 6, 0);
    }
  PetscCall(DemBodyFindFace(&body, "top", &face));
  CheckInt(face, -1);
  CheckClosed(&body);
  PetscCall(DemBodyDestroy(&body));
  PetscCall(DemBodyCreateBox(2, low, high, 0.5, &body));
  CheckClose(DemBodyVolume(&body), 1, 1e-15);
  CheckInt(body.n_faces, 4);
  CheckClosed(&body);
  PetscCall(DemBodyDestroy(&body));
  CheckFails(DemBodyCreateBox(3, high, low, 0, &body), PETSC_ERR_USER_INPUT, "no extent along x");
  CheckFails(DemBodyCreateBox(2, low, high, 0, &body), PETSC_ERR_USER_INPUT, "thickness");
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBox)

/* The prism has the cylinder's volume whatever its sides. */
static PetscErrorCode TestCylinderAndDisc(void)
{
  const PetscReal centre[3] = {0.3, -0.2, 1};
  DemBody         body;

  PetscFunctionBeginUser;
  for (PetscInt sides = 3; sides <= 96; sides += 31) {
    PetscCall(DemBodyCreateCylinder(centre, 0.075, 0.3, sides, &body));
    CheckClose(DemBodyVolume(&body), PETSC_PI * 0.075 * 0.075 * 0.3, 1e-14);
    CheckNear(body.low[2], 1, 0);
    CheckClosed(&body);
    PetscCall(DemBodyDestroy(&body));
    PetscCall(DemBodyCreateDisc(centre, 0.075, sides, 0.02, &body));
    CheckClose(DemBodyVolume(&body), PETSC_PI * 0.075 * 0.075 * 0.02, 1e-14);
    CheckClosed(&body);
    PetscCall(DemBodyDestroy(&body));
  }
  CheckFails(DemBodyCreateCylinder(centre, 0.1, 0.1, 2, &body), PETSC_ERR_USER_INPUT, "at least 3 sides");
  CheckFails(DemBodyCreateCylinder(centre, -1, 0.1, 9, &body), PETSC_ERR_USER_INPUT, "radius");
  CheckFails(DemBodyCreateCylinder(centre, 0.1, 0, 9, &body), PETSC_ERR_USER_INPUT, "height");
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestCylinderAndDisc)

static PetscErrorCode TestMeshes(void)
{
  const PetscInt m[3] = {8, 8, 2}, beam[3] = {15, 6, 3};

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++) {
    DemBody       body;
    DemBodySearch search;
    PetscInt      face;
    PetscReal     in[3] = {0.35, 0.75, dim == 3 ? 0.1 : 0}, out[3] = {0.45, 0.45, dim == 3 ? 0.1 : 0};

    PetscCall(GridBody(dim, m, 0.1, KeepL, 0, 0, &body));
    CheckClose(DemBodyVolume(&body), dim == 2 ? 0.48 * 0.01 : 0.48 * 0.2, 1e-14);
    CheckInt(body.n_pieces, dim == 2 ? 48 : 2 * 48 * 12);
    CheckInt(body.n_faces, 2);
    PetscCall(DemBodyFindFace(&body, "left", &face));
    CheckTrue(face >= 0);
    PetscCall(DemBodyFindFace(&body, "", &face));
    CheckTrue(face >= 0);
    CheckClosed(&body);
    for (PetscInt k = 0; k < body.start[body.n_pieces]; k++) CheckTrue((body.face[k] < 0) == (body.beyond[k] >= 0));
    PetscCall(DemBodySearchCreate(&body, 0.2, 0.1, &search));
    CheckTrue(DemBodySearchInside(&search, in));
    CheckTrue(!DemBodySearchInside(&search, out));
    PetscCall(DemBodySearchDestroy(&search));
    PetscCall(DemBodyDestroy(&body));
    PetscCall(GridBody(dim, beam, 0.1, KeepNotched, 0, 0, &body));
    CheckClose(DemBodyVolume(&body), 0.87 * (dim == 2 ? 0.01 : 0.3), 1e-14);
    CheckClosed(&body);
    PetscCall(DemBodyDestroy(&body));
    /* a crack opens boundary on both its sides and takes no volume */
    PetscCall(GridBody(dim, m, 0.1, KeepAll, 4, 5, &body));
    CheckClose(DemBodyVolume(&body), 0.64 * (dim == 2 ? 0.01 : 0.2), 1e-14);
    CheckInt(body.n_simplices, dim == 2 ? 32 + 2 * 5 : 2 * (2 * 64 + 32 * 2 + 2 * 5 * 2));
    CheckClosed(&body);
    PetscCall(DemBodyDestroy(&body));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestMeshes)

/* Near a re-entrant corner: the corner itself; near a convex one: both faces; across a crack: only the own side. */
static PetscErrorCode TestWalls(void)
{
  const PetscInt  m[3] = {8, 8, 2};
  const PetscReal inner[3] = {0.37, 0.36, 0}, corner[3] = {0.02, 0.03, 0}, beside[3] = {0.39, 0.2, 0};
  DemBody         body;
  DemBodySearch   search;
  DemWall         wall[DEM_MAX_WALLS];

  PetscFunctionBeginUser;
  PetscCall(GridBody(2, m, 0.1, KeepL, 0, 0, &body));
  PetscCall(DemBodySearchCreate(&body, 0.1, 0.05, &search));
  CheckInt(DemBodySearchWalls(&search, inner, 0.1, wall), 1);
  CheckClose(wall[0].distance, 0.05, 1e-12);
  CheckClose(wall[0].inward[0], -0.6, 1e-12);
  CheckTrue(!wall[0].flat);
  CheckInt(DemBodySearchWalls(&search, corner, 0.1, wall), 2);
  CheckClose(wall[0].distance, 0.02, 1e-12);
  CheckClose(wall[1].distance, 0.03, 1e-12);
  CheckTrue(DemBodySearchClear(&search, inner, 0.049));
  CheckTrue(!DemBodySearchClear(&search, inner, 0.051));
  PetscCall(DemBodySearchDestroy(&search));
  PetscCall(DemBodyDestroy(&body));
  PetscCall(GridBody(2, m, 0.1, KeepAll, 4, 5, &body));
  PetscCall(DemBodySearchCreate(&body, 0.1, 0.05, &search));
  CheckInt(DemBodySearchWalls(&search, beside, 0.1, wall), 1);
  CheckClose(wall[0].distance, 0.01, 1e-12);
  CheckClose(wall[0].inward[0], -1, 1e-12);
  PetscCall(DemBodySearchDestroy(&search));
  PetscCall(DemBodyDestroy(&body));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestWalls)

static PetscErrorCode TestRefusals(void)
{
  const PetscInt m[3] = {2, 2, 2};
  DemBody        body;
  Mesh           mesh;

  PetscFunctionBeginUser;
  PetscCall(GridMesh(2, m, 0.1, KeepAll, 0, 0, &mesh));
  CheckFails(DemBodyCreateFromMesh(&mesh, "beam", 1, &body), PETSC_ERR_USER_INPUT, "no group 'beam'");
  CheckFails(DemBodyCreateFromMesh(&mesh, "left", 1, &body), PETSC_ERR_USER_INPUT, "no group 'left'");
  CheckFails(DemBodyCreateFromMesh(&mesh, "", 0, &body), PETSC_ERR_USER_INPUT, "thickness");
  mesh.x[5] = 0.01;
  CheckFails(DemBodyCreateFromMesh(&mesh, "", 1, &body), PETSC_ERR_USER_INPUT, "z = 0.01");
  mesh.x[5] = 0;
  mesh.x[3] = 0.25; /* node 1 beyond node 2: the first cell is no longer convex */
  CheckFails(DemBodyCreateFromMesh(&mesh, "", 1, &body), PETSC_ERR_USER_INPUT, "mesh the body again");
  mesh.x[3] = 0.1;
  for (PetscInt a = 0; a < 4; a++) mesh.node[4 + a] = mesh.node[a]; /* the second cell repeats the first */
  mesh.group[1].n_cells = 2;
  CheckFails(DemBodyCreateFromMesh(&mesh, "all", 1, &body), PETSC_ERR_USER_INPUT, "repeated");
  mesh.group[1].n_cells = 4;
  CheckFails(DemBodyCreateFromMesh(&mesh, "all", 1, &body), PETSC_ERR_USER_INPUT, "share one facet");
  PetscCall(GridMeshDestroy(&mesh));

  PetscCall(GridMesh(3, m, 0.1, KeepAll, 0, 0, &mesh));
  mesh.x[3 * 13] = mesh.x[3 * 13 + 1] = 0; /* the middle node onto an edge: a flat or folded hexahedron */
  mesh.x[3 * 13 + 2] = 0;
  CheckFails(DemBodyCreateFromMesh(&mesh, "", 1, &body), PETSC_ERR_USER_INPUT, "mesh the body again");
  mesh.x[3 * 13] = mesh.x[3 * 13 + 1] = mesh.x[3 * 13 + 2] = 0.1;
  PetscCall(PetscRealloc(3 * sizeof(MeshGroup), &mesh.group)); /* a second name on a facet of "left" */
  mesh.group[2] = mesh.group[1];
  mesh.group[1] = mesh.group[0];
  PetscCall(PetscStrncpy(mesh.group[1].name, "other", sizeof(mesh.group[1].name)));
  PetscCall(PetscMalloc1(1, &mesh.group[1].cell));
  mesh.group[1].cell[0] = mesh.group[0].cell[0];
  mesh.group[1].n_cells = 1;
  mesh.n_groups = 3;
  CheckFails(DemBodyCreateFromMesh(&mesh, "", 1, &body), PETSC_ERR_USER_INPUT, "'left' and 'other' share facets");
  PetscCall(GridMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefusals)

static const struct CMUnitTest tests[] = {TEST(TestBox), TEST(TestCylinderAndDisc), TEST(TestMeshes), TEST(TestWalls), TEST(TestRefusals)};
CHECK_MAIN(tests)
