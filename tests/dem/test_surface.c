/* test_surface.c - surfaces from triangles: where spheres touch them, what they weigh, how they are read. */
#include "tool_cases.h"
#include <stdio.h>

static const PetscReal zero[3] = {0, 0, 0}, ex[3] = {1, 0, 0}, ey[3] = {0, 1, 0};

/* On a flat sheet of shaken triangles a sphere touches once, at its height, over faces, seams and nodes alike. */
static PetscErrorCode TestFlat(void)
{
  const PetscReal a[3] = {0.8, 0, 0.6}, n[3] = {-0.6, 0, 0.8};
  DemSurface      s;
  DemTouch        touch[DEM_TOUCHES];
  uint64_t        seed = 5;

  PetscFunctionBeginUser;
  PetscCall(Sheet(12, zero, a, ey, 3, 7, &s));
  PetscCall(DemSurfaceSetReach(&s, 0.5));
  CheckInt(s.n, 288);
  CheckInt(s.n_nodes, 169);
  CheckInt(s.n_edges, 3 * 144 + 2 * 12);
  CheckTrue(!s.closed);
  for (PetscInt k = 0; k < 30000; k++) {
    PetscReal h = (TestRandom(&seed) - 0.5) * 0.98, at[3], x[3];

    if (k % 3 == 0) {
      const PetscReal along = 5.6 * (TestRandom(&seed) - 0.5), across = 5.6 * (TestRandom(&seed) - 0.5);

      for (PetscInt d = 0; d < 3; d++) at[d] = along * a[d] + across * ey[d];
    } else { /* on an edge that has both sides, or on an inner node */
      const PetscInt  e = (PetscInt)(TestRandom(&seed) * s.n_edges);
      const PetscReal t = k % 3 == 1 ? TestRandom(&seed) : 0;

      if (s.edge_cell[2 * e + 1] < 0) continue;
      for (PetscInt d = 0; d < 3; d++) at[d] = (1 - t) * s.x[3 * s.edge[2 * e] + d] + t * s.x[3 * s.edge[2 * e + 1] + d];
      if (PetscAbsReal(at[1]) > 2.9 || PetscAbsReal(at[0]) > 2.3) continue;
    }
    for (PetscInt d = 0; d < 3; d++) x[d] = at[d] + h * n[d];
    if (PetscAbsReal(h) < 1e-3) continue;
    CheckInt(DemSurfaceTouch(&s, x, 0.5, touch), 1);
    CheckNear(touch[0].distance, PetscAbsReal(h), 1e-13);
    for (PetscInt d = 0; d < 3; d++) CheckNear(touch[0].n[d], h > 0 ? n[d] : -n[d], 1e-11);
  }
  PetscCall(DemSurfaceDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFlat)

/* A box from outside: face, edge and corner give their own distances; from inside, a hollow edge two touches and a hollow corner three. */
static PetscErrorCode TestBox(void)
{
  const PetscReal high[3] = {2, 2, 2};
  DemSurface      s;
  DemTouch        t[DEM_TOUCHES];

  PetscFunctionBeginUser;
  PetscCall(DemSurfaceCreateBox(3, zero, high, &s));
  PetscCall(DemSurfaceSetReach(&s, 0.5));
  CheckTrue(s.closed);
  CheckInt(DemSurfaceTouch(&s, (PetscReal[3]){1.2, 0.9, 2.4}, 0.5, t), 1);
  CheckNear(t[0].distance, 0.4, 1e-15);
  CheckInt(t[0].kind, 0);
  CheckInt(DemSurfaceTouch(&s, (PetscReal[3]){2.3, 0.9, 2.2}, 0.5, t), 1);
  CheckNear(t[0].distance, PetscSqrtReal(0.13), 1e-15);
  CheckNear(t[0].n[0], 0.3 / PetscSqrtReal(0.13), 1e-15);
  CheckInt(t[0].kind, 1);
  CheckInt(DemSurfaceTouch(&s, (PetscReal[3]){2.1, 2.2, 2.3}, 0.5, t), 1);
  CheckNear(t[0].distance, PetscSqrtReal(0.14), 1e-15);
  CheckNear(t[0].n[2], 0.3 / PetscSqrtReal(0.14), 1e-15);
  CheckInt(t[0].kind, 2);
  CheckInt(DemSurfaceTouch(&s, (PetscReal[3]){1, 1, 1}, 0.5, t), 0);
  CheckInt(DemSurfaceTouch(&s, (PetscReal[3]){0.3, 0.4, 1.1}, 0.5, t), 2);
  CheckNear(t[0].distance, 0.3, 1e-15);
  CheckNear(t[0].n[0], 1, 1e-15);
  CheckNear(t[1].distance, 0.4, 1e-15);
  CheckNear(t[1].n[1], 1, 1e-15);
  CheckInt(DemSurfaceTouch(&s, (PetscReal[3]){0.3, 0.4, 1.7}, 0.5, t), 3);
  CheckInt(DemSurfaceTouch(&s, (PetscReal[3]){9, 9, 9}, 0.5, t), 0);
  PetscCall(DemSurfaceDestroy(&s));

  PetscCall(DemSurfaceCreateBox(2, zero, high, &s));
  PetscCall(DemSurfaceSetReach(&s, 0.5));
  CheckTrue(s.closed);
  CheckInt(DemSurfaceTouch(&s, (PetscReal[3]){1.2, 2.4, 0}, 0.5, t), 1);
  CheckNear(t[0].distance, 0.4, 1e-15);
  CheckInt(DemSurfaceTouch(&s, (PetscReal[3]){2.3, 2.2, 0}, 0.5, t), 1);
  CheckNear(t[0].distance, PetscSqrtReal(0.13), 1e-15);
  CheckInt(t[0].kind, 2);
  CheckInt(DemSurfaceTouch(&s, (PetscReal[3]){0.3, 0.4, 0}, 0.5, t), 2);
  PetscCall(DemSurfaceDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestBox)

/* A crumpled closed surface: n triangles of a sphere of latitudes, nodes shaken; and its twin that tries every triangle. */
static PetscErrorCode Crumpled(PetscInt m, PetscReal shake, DemSurface *s)
{
  PetscReal(*node)[3], (*corner)[3][3];
  PetscInt n     = 0;
  uint64_t seed = 3;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2((m + 1) * 2 * m, &node, 4 * m * m, &corner));
  for (PetscInt i = 0; i <= m; i++)
    for (PetscInt j = 0; j < 2 * m; j++) {
      const PetscReal a = PETSC_PI * i / m, b = PETSC_PI * j / m, r = 1 + (i > 0 && i < m ? shake * (TestRandom(&seed) - 0.5) : 0);

      node[2 * m * i + j][0] = r * PetscSinReal(a) * PetscCosReal(b);
      node[2 * m * i + j][1] = r * PetscSinReal(a) * PetscSinReal(b);
      node[2 * m * i + j][2] = r * PetscCosReal(a);
    }
  for (PetscInt j = 0; j < 2 * m; j++) /* the poles are one node each */
    for (PetscInt d = 0; d < 2; d++) node[j][d] = node[2 * m * m + j][d] = 0;
  for (PetscInt i = 0; i < m; i++)
    for (PetscInt j = 0; j < 2 * m; j++) {
      const PetscInt q[4] = {2 * m * i + j, 2 * m * (i + 1) + j, 2 * m * (i + 1) + (j + 1) % (2 * m), 2 * m * i + (j + 1) % (2 * m)};

      for (PetscInt t = 0; t < 2; t++) {
        if ((i == 0 && t == 1) || (i == m - 1 && t == 0)) continue;
        for (PetscInt k = 0; k < 3; k++)
          for (PetscInt d = 0; d < 3; d++) corner[n][k][d] = node[q[k ? k + t : 0]][d];
        n++;
      }
    }
  PetscCall(DemSurfaceCreate("crumpled", 3, n, &corner[0][0][0], s));
  PetscCall(PetscFree2(node, corner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestTwin(void)
{
  DemSurface s;
  DemTouch   fast[DEM_TOUCHES], slow[DEM_TOUCHES];
  uint64_t   seed = 11;
  PetscInt   touches = 0, several = 0;

  PetscFunctionBeginUser;
  PetscCall(Crumpled(10, 0.25, &s));
  CheckTrue(s.closed);
  PetscCall(DemSurfaceSetReach(&s, 0.3));
  for (PetscInt k = 0; k < 20000; k++) {
    const PetscReal x[3] = {3 * (TestRandom(&seed) - 0.5), 3 * (TestRandom(&seed) - 0.5), 3 * (TestRandom(&seed) - 0.5)}, r = 0.3 * (0.3 + 0.7 * TestRandom(&seed));
    const PetscInt  n = DemSurfaceTouch(&s, x, r, fast);

    CheckInt(n, DemSurfaceTouchAll(&s, x, r, slow));
    for (PetscInt i = 0; i < n; i++) {
      CheckNear(fast[i].distance, slow[i].distance, 0);
      CheckNear(fast[i].n[0], slow[i].n[0], 0);
    }
    touches += n;
    several += n > 1;
  }
  CheckAbove(touches, 3000);
  CheckAbove(several, 300);
  PetscCall(DemSurfaceDestroy(&s));

  /* Convex: a sphere outside touches once wherever it is. */
  PetscCall(Crumpled(6, 0, &s));
  for (PetscInt k = 0; k < 5000; k++) {
    const PetscReal a = PETSC_PI * TestRandom(&seed), b = 2 * PETSC_PI * TestRandom(&seed), x[3] = {1.2 * PetscSinReal(a) * PetscCosReal(b), 1.2 * PetscSinReal(a) * PetscSinReal(b), 1.2 * PetscCosReal(a)};

    CheckInt(DemSurfaceTouchAll(&s, x, 0.4, slow), 1);
  }
  PetscCall(DemSurfaceDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestTwin)

/* Volume, centre and moments of a box and of a tetrahedron by hand; triangles given the wrong way round are turned. */
static PetscErrorCode TestMass(void)
{
  const PetscReal low[3] = {1, 2, 3}, high[3] = {3, 5, 4};
  const PetscReal tet[4][3][3] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  DemSurface      s;
  PetscReal       V, c[3], J[3][3];

  PetscFunctionBeginUser;
  PetscCall(DemSurfaceCreateBox(3, low, high, &s));
  PetscCall(DemSurfaceMass(&s, 1, &V, c, J));
  CheckClose(V, 6, 1e-14);
  CheckClose(c[1], 3.5, 1e-14);
  CheckClose(J[0][0], 6 * (9 + 1) / 12., 1e-14);
  CheckClose(J[1][1], 6 * (4 + 1) / 12., 1e-14);
  CheckClose(J[2][2], 6 * (4 + 9) / 12., 1e-14);
  CheckNear(J[0][1], 0, 1e-13);
  PetscCall(DemSurfaceDestroy(&s));
  PetscCall(DemSurfaceCreate("tet", 3, 4, &tet[0][0][0], &s));
  PetscCall(DemSurfaceMass(&s, 1, &V, c, J));
  CheckClose(V, 1 / 6., 1e-14);
  CheckClose(c[2], 0.25, 1e-14);
  CheckClose(J[0][0], 2 * (1 / 60. - 1 / 96.), 1e-13); /* int x^2 = 1/60, less V c^2 */
  CheckClose(J[0][1], -(1 / 120. - 1 / 96.), 1e-13);
  PetscCall(DemSurfaceDestroy(&s));
  PetscCall(DemSurfaceCreateBox(2, low, high, &s));
  PetscCall(DemSurfaceMass(&s, 0.5, &V, c, J));
  CheckClose(V, 3, 1e-14);
  CheckClose(J[2][2], 3 * (4 + 9) / 12., 1e-14);
  PetscCall(DemSurfaceDestroy(&s));
  PetscCall(Sheet(2, zero, ex, ey, 1, 1, &s));
  CheckFails(DemSurfaceMass(&s, 1, &V, c, J), PETSC_ERR_USER_INPUT, "not closed");
  PetscCall(DemSurfaceDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestMass)

static PetscErrorCode Put(const char *name, const char *text, size_t length)
{
  FILE *file = fopen(name, "wb");

  PetscFunctionBegin;
  CheckTrue(file && fwrite(text, 1, length, file) == length);
  fclose(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define TRIANGLE(a, b, c) "facet normal 0 0 1\n outer loop\n vertex " a "\n vertex " b "\n vertex " c "\n endloop\nendfacet\n"

static PetscErrorCode TestFaults(void)
{
  static const struct {
    const char *text, *words;
  } bad[] = {
    {"",                                                                                        "the file is empty"                                   },
    {"solid",                                                                                   "cut short (no endsolid"                              },
    {"solid a\n" TRIANGLE("0 0 0", "1 0 0", "0 1 0"),                                           "cut short (no endsolid"                              },
    {"solid a\nendsolid a\n",                                                                   "no triangle"                                         },
    {"solid a\nfacet\nvertex 0 0",                                                              "cut short within a corner"                           },
    {"solid a\n" TRIANGLE("0 0 0", "1 0 zwei", "0 1 0") "endsolid a\n",                         ":5: 'zwei' is not a number"                          },
    {"solid a\n" TRIANGLE("0 0 0", "1 0 nan", "0 1 0") "endsolid a\n",                          "not a number (nan)"                                  },
    {"solid a\n" TRIANGLE("0 0 0", "1 0 0", "2 0 0") "endsolid a\n",                            "triangle 1, at (0, 0, 0) m, has no area"             },
    {"solid a\n" TRIANGLE("0 0 0", "0 0 0", "2 0 0") "endsolid a\n",                            "has no area"                                         },
    {"solid a\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendfacet\nendsolid", "a facet with 4 corners"                           },
    {"solid a\n" TRIANGLE("0 0 0", "1 0 0", "0 1 0") TRIANGLE("1 0 0", "0 0 0", "0 1 0") "endsolid a\n", "triangles 1 and 2 have the same corners"   },
    {"solid a\n" TRIANGLE("0 0 0", "1 0 0", "0 1 0") TRIANGLE("1 0 0", "0 0 0", "0 -1 0") TRIANGLE("0 0 0", "1 0 0", "0 0 1") "endsolid a\n", "3 triangles (numbers 1, 2, 3) share the edge"},
    {"what is this",                                                                            "the head of a binary STL alone has 84"               },
  };
  char        head[84 + 50] = "binary";
  const float corner[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  DemSurface  s;

  PetscFunctionBeginUser;
  for (size_t k = 0; k < sizeof(bad) / sizeof(bad[0]); k++) {
    PetscCall(Put("test_surface.stl", bad[k].text, strlen(bad[k].text)));
    CheckFails(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.stl", 3, "", 1, 0, &s), PETSC_ERR_USER_INPUT, bad[k].words);
  }
  /* any cut of a good text is refused, none crashes */
  {
    const char *good = "solid my part\n" TRIANGLE("0 0 0", "1 0 0", "0 1 0") TRIANGLE("1 0 0", "0 0 0", "0 -1 0") "endsolid my part\n";

    PetscCall(Put("test_surface.stl", good, strlen(good)));
    PetscCall(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.stl", 3, "", 1e-3, 0, &s));
    CheckInt(s.n, 2);
    CheckInt(s.n_nodes, 4);
    CheckInt(s.n_edges, 5);
    CheckNear(s.high[0], 1e-3, 1e-18);
    PetscCall(DemSurfaceDestroy(&s));
    for (size_t cut = 0; cut < strlen(good) - 9; cut += 3) {
      PetscCall(Put("test_surface.stl", good, cut));
      CheckFails(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.stl", 3, "", 1, 0, &s), PETSC_ERR_USER_INPUT, "test_surface.stl");
    }
  }
  head[80] = 1;
  memcpy(head + 84 + 12, corner, sizeof(corner)); /* this test's machine is little-endian, as the file is */
  PetscCall(Put("test_surface.stl", head, sizeof(head)));
  PetscCall(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.stl", 3, "", 1, 0, &s));
  CheckInt(s.n, 1);
  CheckNear(s.x[3], 1, 0);
  PetscCall(DemSurfaceDestroy(&s));
  PetscCall(Put("test_surface.stl", head, sizeof(head) - 7));
  CheckFails(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.stl", 3, "", 1, 0, &s), PETSC_ERR_USER_INPUT, "cut short");
  head[81] = 1;
  PetscCall(Put("test_surface.stl", head, sizeof(head)));
  CheckFails(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.stl", 3, "", 1, 0, &s), PETSC_ERR_USER_INPUT, "it tells of 257 triangles");
  head[81] = 0;
  memset(head + 84 + 12, 0xff, 4); /* a NaN */
  PetscCall(Put("test_surface.stl", head, sizeof(head)));
  CheckFails(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.stl", 3, "", 1, 0, &s), PETSC_ERR_USER_INPUT, "triangle 1 has a coordinate that is not a number");
  CheckFails(DemSurfaceRead(PETSC_COMM_SELF, "no_such.stl", 3, "", 1, 0, &s), PETSC_ERR_USER_INPUT, "no_such.stl");
  CheckFails(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.stl", 2, "", 1, 0, &s), PETSC_ERR_USER_INPUT, "a tool of a 2D scene is a curve");

  /* A strip with one side: five quadrilaterals round a ring, joined with half a turn. */
  {
    PetscReal strip[10][3][3];

    for (PetscInt q = 0; q < 5; q++) {
      PetscReal p[4][3];

      for (PetscInt k = 0; k < 4; k++) {
        const PetscInt  end = k == 1 || k == 2, at = (q + end) % 5, side = (k >= 2) ^ (q == 4 && end);
        const PetscReal a = 2 * PETSC_PI * at / 5, half = PETSC_PI * at / 5, w = side ? 0.3 : -0.3;

        p[k][0] = (2 + w * PetscCosReal(half)) * PetscCosReal(a);
        p[k][1] = (2 + w * PetscCosReal(half)) * PetscSinReal(a);
        p[k][2] = w * PetscSinReal(half);
      }
      for (PetscInt t = 0; t < 2; t++)
        for (PetscInt k = 0; k < 3; k++)
          for (PetscInt d = 0; d < 3; d++) strip[2 * q + t][k][d] = p[k ? k + t : 0][d];
    }
    CheckFails(DemSurfaceCreate("strip", 3, 10, &strip[0][0][0], &s), PETSC_ERR_USER_INPUT, "one side only");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFaults)

/* A .geo with a volume and a surface group: the group's triangles; without a name all of them; in 2D its curves. */
static PetscErrorCode TestGmsh(void)
{
  const char *geo = "SetFactory(\"OpenCASCADE\");\nBox(1) = {0, 0, 0, 1, 2, 3};\nMesh.CharacteristicLengthMax = 1;\nPhysical Volume(\"body\") = {1};\nPhysical Surface(\"top\") = {6};\nPhysical Surface(\"rest\") = {1:5};\n";
  const char *flat = "SetFactory(\"OpenCASCADE\");\nDisk(1) = {0, 0, 0, 1, 1};\nMesh.CharacteristicLengthMax = 0.2;\nPhysical Surface(\"body\") = {1};\nPhysical Curve(\"rim\") = {1};\n";
  DemSurface  s;
  PetscReal   V, c[3], J[3][3];

  PetscFunctionBeginUser;
  PetscCall(Put("test_surface.geo", geo, strlen(geo)));
  PetscCall(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.geo", 3, "top", 1, 0, &s));
  CheckNear(s.low[2], 3, 1e-12);
  CheckTrue(!s.closed);
  PetscCall(DemSurfaceDestroy(&s));
  PetscCall(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.geo", 3, "", 1e-3, 0, &s));
  PetscCall(DemSurfaceMass(&s, 1, &V, c, J));
  CheckClose(V, 6e-9, 1e-12);
  CheckClose(c[2], 1.5e-3, 1e-12);
  PetscCall(DemSurfaceDestroy(&s));
  CheckFails(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.geo", 3, "tip", 1, 0, &s), PETSC_ERR_USER_INPUT, "no physical group 'tip'; did you mean 'top'?");
  CheckFails(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.geo", 3, "body", 1, 0, &s), PETSC_ERR_USER_INPUT, "group 'body' has dimension 3; a tool of a 3D scene is made of surfaces");
  PetscCall(Put("test_surface.geo", flat, strlen(flat)));
  PetscCall(DemSurfaceRead(PETSC_COMM_SELF, "test_surface.geo", 2, "rim", 1, 0, &s));
  CheckTrue(s.closed);
  PetscCall(DemSurfaceMass(&s, 1, &V, c, J));
  CheckClose(V, PETSC_PI, 0.01);
  PetscCall(DemSurfaceDestroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestGmsh)

static const struct CMUnitTest tests[] = {TEST(TestFlat), TEST(TestBox), TEST(TestTwin), TEST(TestMass), TEST(TestFaults), TEST(TestGmsh)};

CHECK_MAIN(tests)
