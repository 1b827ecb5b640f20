/* Meshes: boxes by count and volume, gmsh geometries and files with groups of every dimension, and every refusal of the reader. */
#include "check.h"
#include "fem_element.h"
#include "mesh.h"
#include <unistd.h>

static const MeshOptions plane = {2, 0, 1, 1, PETSC_FALSE}, solid = {3, 0, 1, 1, PETSC_FALSE};

/* A scratch file with this text; the caller removes it. */
static PetscErrorCode Scratch(const char *ending, const char *text, char path[64])
{
  FILE *out;
  int   fd;

  PetscFunctionBeginUser;
  (void)snprintf(path, 64, "mesh_test_XXXXXX%s", ending);
  fd = mkstemps(path, (int)strlen(ending));
  CheckTrue(fd >= 0);
  out = fdopen(fd, "w");
  fputs(text, out);
  fclose(out);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadText(const char *ending, const char *text, const MeshOptions *options, Mesh *mesh)
{
  char           path[64];
  PetscErrorCode code;

  PetscFunctionBeginUser;
  PetscCall(Scratch(ending, text, path));
  code = MeshRead(PETSC_COMM_SELF, path, options, mesh);
  unlink(path);
  PetscFunctionReturn(code);
}

/* Volume of a group's cells (area, length); pieces of MESH_TRI3.. by quadrature. */
static PetscReal Volume(const Mesh *mesh, const char *name)
{
  const MeshGroup *g;
  PetscReal        sum = 0;

  if (MeshFindGroup(mesh, name, &g) || !g) return -1;
  for (PetscInt k = 0; k < g->n_cells; k++) {
    const PetscInt  c     = g->cell[k], *node = &mesh->node[mesh->start[c]];
    const FemShape *shape = FemShapeGet(mesh->type[c]);
    PetscReal       x[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], N[9], n[27];

    if (shape && shape->dim == mesh->dim) {
      for (PetscInt a = 0; a < shape->nodes; a++)
        for (PetscInt d = 0; d < mesh->dim; d++) x[a * mesh->dim + d] = mesh->x[3 * node[a] + d];
      if (FemGradients(shape, x, 1, dN, w)) return -2;
      for (PetscInt q = 0; q < shape->points; q++) sum += w[q];
    } else if (g->dim == mesh->dim - 1) {
      const PetscInt nodes = mesh->start[c + 1] - mesh->start[c];

      for (PetscInt a = 0; a < nodes; a++)
        for (PetscInt d = 0; d < mesh->dim; d++) x[a * mesh->dim + d] = mesh->x[3 * node[a] + d];
      FemFaceIntegrals(mesh->dim, nodes, x, 1, N, n);
      for (PetscInt a = 0; a < nodes; a++) sum += N[a];
    }
  }
  return sum;
}

static PetscErrorCode TestBoxes(void)
{
  const MeshCellType types[4]  = {MESH_TRI3, MESH_QUAD4, MESH_TET4, MESH_HEX8};
  const PetscReal    origin[3] = {1, 2, 3}, length[3] = {2, 3, 5};
  const PetscInt     n[3]      = {2, 3, 4}, cells[4] = {12, 6, 144, 24};
  const char *const  sides[6]  = {"xmax", "xmin", "ymax", "ymin", "zmax", "zmin"};

  PetscFunctionBeginUser;
  for (PetscInt t = 0; t < 4; t++) {
    Mesh            mesh;
    const PetscBool flat = t < 2 ? PETSC_TRUE : PETSC_FALSE;
    const PetscReal side[3] = {flat ? 3 : 15, flat ? 2 : 10, 6};

    PetscCall(MeshCreateBox(PETSC_COMM_SELF, "block", types[t], origin, length, n, &mesh));
    CheckInt(mesh.n_nodes, flat ? 12 : 60);
    CheckInt(mesh.n_groups, flat ? 5 : 7);
    for (PetscInt g = 0; g + 1 < mesh.n_groups; g++) {
      CheckTrue(!strcmp(mesh.group[g].name, sides[g]));
      CheckClose(Volume(&mesh, sides[g]), side[g / 2], 1e-13);
    }
    CheckInt(mesh.group[mesh.n_groups - 1].n_cells, cells[t]);
    CheckClose(Volume(&mesh, "block"), flat ? 6 : 30, 1e-13);
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *square = "Point(1) = {0, 0, 0, 0.25}; Point(2) = {1, 0, 0, 0.25}; Point(3) = {1, 2, 0, 0.25}; Point(4) = {0, 2, 0, 0.25};\n"
                            "Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};\n"
                            "Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};\n"
                            "Physical Point(\"corner\") = {1}; Physical Curve(\"right\") = {2}; Physical Curve(\"round\") = {1, 3};\n";

static PetscErrorCode TestPlaneGeometry(void)
{
  Mesh             mesh;
  const MeshGroup *g;
  char             text[BASE_LINE];
  MeshOptions      options = plane;

  PetscFunctionBeginUser;
  PetscCall(BaseFormat(text, "%sPhysical Surface(\"plate\") = {1};", square));
  PetscCall(ReadText(".geo", text, &plane, &mesh));
  CheckInt(mesh.dim, 2);
  CheckInt(mesh.n_groups, 4);
  CheckTrue(!strcmp(mesh.group[0].name, "corner") && !strcmp(mesh.group[1].name, "right") && !strcmp(mesh.group[2].name, "round") && !strcmp(mesh.group[3].name, "plate"));
  CheckClose(Volume(&mesh, "plate"), 2, 1e-12);
  CheckClose(Volume(&mesh, "right"), 2, 1e-12);
  CheckClose(Volume(&mesh, "round"), 2, 1e-12);
  PetscCall(MeshFindGroup(&mesh, "corner", &g));
  CheckInt(g->n_cells, 1);
  CheckNear(mesh.x[3 * mesh.node[mesh.start[g->cell[0]]]], 0, 0);
  PetscCall(MeshFindGroup(&mesh, "nothing", &g));
  CheckTrue(!g);
  PetscCall(MeshDestroy(&mesh));

  options.scale = 1e-3; /* millimetres; the size asked for is in metres */
  options.size  = 0.5e-3;
  options.quads = PETSC_TRUE;
  PetscCall(ReadText(".geo", text, &options, &mesh));
  CheckClose(Volume(&mesh, "plate"), 2e-6, 1e-12);
  PetscCall(MeshFindGroup(&mesh, "plate", &g));
  CheckBelow(g->n_cells, 40);
  for (PetscInt k = 0; k < g->n_cells; k++) CheckInt(mesh.type[g->cell[k]], MESH_QUAD4);
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same geometry gives the same mesh, node by node. */
static PetscErrorCode TestSameFileSameMesh(void)
{
  Mesh a, b;
  char text[BASE_LINE];

  PetscFunctionBeginUser;
  PetscCall(BaseFormat(text, "%sout[] = Extrude {0, 0, 0.5} { Surface{1}; };\nPhysical Volume(\"body\") = {out[1]}; Physical Surface(\"top\") = {out[0]};\n", square));
  PetscCall(ReadText(".geo", text, &solid, &a));
  PetscCall(ReadText(".geo", text, &solid, &b));
  CheckInt(a.dim, 3);
  CheckClose(Volume(&a, "body"), 1, 1e-12);
  CheckClose(Volume(&a, "top"), 2, 1e-12);
  CheckInt(a.n_nodes, b.n_nodes);
  CheckInt(a.n_cells, b.n_cells);
  for (PetscInt k = 0; k < 3 * a.n_nodes; k++) CheckTrue(a.x[k] == b.x[k]);
  for (PetscInt k = 0; k < a.start[a.n_cells]; k++) CheckInt(a.node[k], b.node[k]);
  PetscCall(MeshDestroy(&a));
  PetscCall(MeshDestroy(&b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestSecondOrderIsRead(void)
{
  Mesh        mesh;
  char        text[BASE_LINE];
  MeshOptions options = plane;

  PetscFunctionBeginUser;
  options.order = 2;
  PetscCall(BaseFormat(text, "%sPhysical Surface(\"plate\") = {1};", square));
  PetscCall(ReadText(".geo", text, &options, &mesh));
  CheckInt(mesh.type[mesh.group[3].cell[0]], MESH_TRI6);
  CheckInt(mesh.type[mesh.group[1].cell[0]], MESH_LINE3);
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One square of two triangles, its edge in a group, as gmsh 4.1 writes it; and files that break off. */
static const char *whole = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
                           "$PhysicalNames\n2\n1 1 \"edge\"\n2 2 \"plate\"\n$EndPhysicalNames\n"
                           "$Entities\n0 1 1 0\n1 0 0 0 1 0 0 1 1 0\n1 0 0 0 1 1 0 1 2 1 1\n$EndEntities\n"
                           "$Nodes\n1 4 1 4\n2 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n$EndNodes\n"
                           "$Elements\n2 3 1 3\n1 1 1 1\n1 1 2\n2 1 2 2\n2 1 2 3\n3 1 3 4\n$EndElements\n";

static PetscErrorCode TestMeshFile(void)
{
  Mesh mesh;

  PetscFunctionBeginUser;
  PetscCall(ReadText(".msh", whole, &plane, &mesh));
  CheckInt(mesh.n_nodes, 4);
  CheckInt(mesh.n_cells, 3);
  CheckClose(Volume(&mesh, "plate"), 1, 1e-15);
  CheckClose(Volume(&mesh, "edge"), 1, 1e-15);
  CheckInt(mesh.cell_id[mesh.group[1].cell[1]], 3);
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestRefusals(void)
{
  Mesh mesh = {{0}};
  char text[BASE_LINE];

  PetscFunctionBeginUser;
  CheckFails(MeshRead(PETSC_COMM_SELF, "no/such/file.geo", &plane, &mesh), PETSC_ERR_USER_INPUT, "no/such/file.geo: the mesh file is not there");
  CheckFails(ReadText(".stl", "solid", &plane, &mesh), PETSC_ERR_USER_INPUT, "a geometry is a gmsh .geo or .msh");
  CheckFails(ReadText(".msh", "", &plane, &mesh), PETSC_ERR_USER_INPUT, "empty");
  CheckFails(ReadText(".geo", "Point(1) = {0, 0, 0", &plane, &mesh), PETSC_ERR_USER_INPUT, "gmsh could not read it");
  CheckFails(ReadText(".geo", square, &plane, &mesh), PETSC_ERR_USER_INPUT, "no physical group of dimension 2; name the body");
  PetscCall(BaseFormat(text, "%sPhysical Surface(\"plate\") = {1};", square));
  CheckFails(ReadText(".geo", text, &solid, &mesh), PETSC_ERR_USER_INPUT, "no physical group of dimension 3");
  PetscCall(BaseFormat(text, "%sPhysical Surface(\"right\") = {1};", square));
  CheckFails(ReadText(".geo", text, &plane, &mesh), PETSC_ERR_USER_INPUT, "'right' names a physical group of dimension 1 and one of dimension 2");
  PetscCall(BaseFormat(text, "%sout[] = Extrude {0, 0, 0.5} { Surface{1}; };\nPhysical Volume(\"body\") = {out[1]};\n", square));
  CheckFails(ReadText(".geo", text, &plane, &mesh), PETSC_ERR_USER_INPUT, "it has a physical volume, but the mesh was asked for in 2 dimensions");
  {
    MeshOptions bad = plane;

    bad.size = -1;
    CheckFails(ReadText(".geo", text, &bad, &mesh), PETSC_ERR_USER_INPUT, "element size");
    bad       = plane;
    bad.scale = 0;
    CheckFails(ReadText(".geo", text, &bad, &mesh), PETSC_ERR_USER_INPUT, "length unit");
  }
  CheckFails(ReadText(".msh",
                      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 2 \"plate\"\n$EndPhysicalNames\n$Entities\n0 0 1 0\n1 0 0 0 1 1 0 1 2 0\n$EndEntities\n"
                      "$Nodes\n1 3 1 3\n2 1 0 3\n1\n2\n3\n0 0 0\n1 0 0\n1 1 0\n$EndNodes\n",
                      &plane, &mesh),
             PETSC_ERR_USER_INPUT, "no cell of dimension 2");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sides that repeat each other, drawn so or in the file's own section. */
static PetscErrorCode TestPeriodicIsRefused(void)
{
  Mesh mesh = {{0}};

  PetscFunctionBeginUser;
  CheckFails(ReadText(".msh",
                      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 2 \"plate\"\n$EndPhysicalNames\n"
                      "$Entities\n0 2 1 0\n1 0 0 0 1 0 0 0 0\n2 0 1 0 1 1 0 0 0\n1 0 0 0 1 1 0 1 2 2 1 2\n$EndEntities\n"
                      "$Nodes\n3 4 1 4\n1 1 0 2\n1\n2\n0 0 0\n1 0 0\n1 2 0 2\n3\n4\n1 1 0\n0 1 0\n2 1 0 0\n$EndNodes\n"
                      "$Elements\n1 2 1 2\n2 1 2 2\n1 1 2 3\n2 1 3 4\n$EndElements\n$Periodic\n1\n1 2 1\n0\n2\n3 2\n4 1\n$EndPeriodic\n",
                      &plane, &mesh),
             PETSC_ERR_USER_INPUT, "curve 2 is periodic, it repeats curve 1");
  CheckFails(ReadText(".geo", "Point(1) = {0, 0, 0, 0.5};\nPoint(2) = {1, 0, 0, 0.5};\nPoint(3) = {1, 1, 0, 0.5};\nPoint(4) = {0, 1, 0, 0.5};\nLine(1) = {1, 2};\nLine(2) = {2, 3};\nLine(3) = {3, 4};\nLine(4) = {4, 1};\nCurve Loop(1) = {1, 2, 3, 4};\n"
                              "Plane Surface(1) = {1};\nPeriodic Curve {2} = {-4};\nPhysical Surface(\"plate\") = {1};\n",
                      &plane, &mesh),
             PETSC_ERR_USER_INPUT, "point 2 is periodic, it repeats point 1");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file that breaks off anywhere is refused, never half read. */
static PetscErrorCode TestCutFilesAreRefused(void)
{
  const size_t length = strlen(whole);
  char        *text;
  Mesh         mesh = {{0}};

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(length + 1, &text));
  for (size_t cut = 1; cut + 2 < length; cut += 7) {
    PetscCall(PetscArrayzero(text, length + 1));
    PetscCall(PetscArraycpy(text, whole, cut));
    CheckFails(ReadText(".msh", text, &plane, &mesh), PETSC_ERR_USER_INPUT, "");
  }
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Discs and cylinders: quadratic cells follow the circle, so volume and sides are right to the fourth order; groups as promised. */
static PetscErrorCode TestRound(void)
{
  const PetscReal centre[3] = {1, 2, 3}, r = 0.5, h = 2;

  PetscFunctionBeginUser;
  for (PetscInt dim = 2; dim <= 3; dim++)
    for (PetscInt k = 0; k < 4; k++) {
      const MeshOptions options = {dim, 0.2, 2 - k % 2, 1, k / 2 ? PETSC_TRUE : PETSC_FALSE, PETSC_FALSE};
      const PetscReal   error   = k % 2 ? 0.05 : 1e-3;
      Mesh              mesh;

      PetscCall(MeshCreateRound(PETSC_COMM_SELF, "body", centre, r, h, &options, &mesh));
      CheckInt(mesh.dim, dim);
      CheckInt(mesh.n_groups, dim == 2 ? 2 : 4);
      CheckClose(Volume(&mesh, "body"), PETSC_PI * r * r * (dim == 3 ? h : 1), error);
      CheckClose(Volume(&mesh, "side"), 2 * PETSC_PI * r * (dim == 3 ? h : 1), error);
      if (dim == 3) CheckClose(Volume(&mesh, "bottom"), PETSC_PI * r * r, error);
      if (dim == 3) CheckClose(Volume(&mesh, "top"), PETSC_PI * r * r, error);
      PetscCall(MeshDestroy(&mesh));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

CHECK_TEST(TestRound)
CHECK_TEST(TestBoxes)
CHECK_TEST(TestPlaneGeometry)
CHECK_TEST(TestSameFileSameMesh)
CHECK_TEST(TestSecondOrderIsRead)
CHECK_TEST(TestMeshFile)
CHECK_TEST(TestRefusals)
CHECK_TEST(TestPeriodicIsRefused)
CHECK_TEST(TestCutFilesAreRefused)

static const struct CMUnitTest tests[] = {TEST(TestRound), TEST(TestBoxes), TEST(TestPlaneGeometry), TEST(TestSameFileSameMesh), TEST(TestSecondOrderIsRead), TEST(TestMeshFile), TEST(TestRefusals), TEST(TestPeriodicIsRefused), TEST(TestCutFilesAreRefused)};
CHECK_MAIN(tests)
