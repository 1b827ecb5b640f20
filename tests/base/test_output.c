/* test_output.c - frames and history without a run: geometry written once, names, refusals, truncation. */
#include "run_toy.h"
#include "files.h"
#include <hdf5.h>
#include <math.h>
#include <unistd.h>

#define DIRECTORY "test_output.out"

/* Two triangles and a quad; `lift` moves the points, `f` fills the field. */
static PetscErrorCode WriteFrame(Output output, PetscReal time, PetscInt step, PetscReal lift, PetscReal f)
{
  const PetscReal     x[18]     = {0, 0, lift, 1, 0, lift, 1, 1, lift, 0, 1, lift, 2, 0, lift, 2, 1, lift};
  const PetscInt      start[4]  = {0, 3, 6, 10}, node[10] = {0, 1, 2, 0, 2, 3, 1, 4, 5, 2};
  const unsigned char type[3]   = {5, 5, 9};
  const PetscReal     stress[9] = {f, NAN, -0., 1e-310, INFINITY, f, f, f, f}, u[12] = {f, f, 1, 2, 3, 4, 5, 6, 7, 8, 9, f};
  const OutputArray   arrays[]  = {{"stress", "Pa", OUTPUT_CELL_DATA, 3, stress}, {"displacement", "m", OUTPUT_POINT_DATA, 2, u}, {"a<b>&\"c\"", "", OUTPUT_POINT_DATA, 1, u}};
  const OutputBlock   block     = {.name = "the plate", .n_points = 6, .x = x, .n_cells = 3, .start = start, .node = node, .type = type, .n_arrays = 3, .array = arrays};

  PetscFunctionBeginUser;
  PetscCall(OutputFrameBegin(output, time, step));
  PetscCall(OutputFrameBlock(output, &block));
  PetscCall(OutputFrameEnd(output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Size of the file that really holds the points of a frame, by following the link as any reader does. */
static PetscInt PointsLinkKind(const char *frame)
{
  char       path[BASE_LINE];
  hid_t      file;
  H5L_info_t info;

  snprintf(path, sizeof(path), DIRECTORY "/fields/%s.h5", frame);
  file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
  CheckTrue(file >= 0);
  CheckTrue(H5Lget_info(file, "the plate/points", &info, H5P_DEFAULT) >= 0);
  H5Fclose(file);
  return info.type;
}

static PetscErrorCode TestFrames(void)
{
  Output output;

  PetscFunctionBeginUser;
  PetscCall(OutputCreate(PETSC_COMM_WORLD, DIRECTORY "///", PETSC_FALSE, &output));
  CheckTrue(!strcmp(OutputDirectory(output), DIRECTORY));
  PetscCall(WriteFrame(output, 0, 0, 0, 1));
  PetscCall(WriteFrame(output, 0.1, 10, 0, 2));
  PetscCall(WriteFrame(output, 0.2, 20, 0.5, 3)); /* the points moved */
  PetscCall(WriteFrame(output, 0.3, 30, 0.5, 4));
  CheckInt(PointsLinkKind("000000"), H5L_TYPE_HARD);
  CheckInt(PointsLinkKind("000001"), H5L_TYPE_EXTERNAL);
  CheckInt(PointsLinkKind("000002"), H5L_TYPE_HARD);
  CheckInt(PointsLinkKind("000003"), H5L_TYPE_EXTERNAL);
  ReadFrames(DIRECTORY, PETSC_FALSE);
  PetscCall(OutputTruncate(output, 0.25)); /* and the links are right again afterwards */
  CheckInt(CountFrames(DIRECTORY), 3);
  PetscCall(OutputTruncate(output, 0.1));
  CheckInt(CountFrames(DIRECTORY), 2);
  ReadFrames(DIRECTORY, PETSC_FALSE);
  PetscCall(WriteFrame(output, 0.2, 20, 0.5, 3));
  CheckInt(PointsLinkKind("000002"), H5L_TYPE_HARD);
  PetscCall(OutputDestroy(&output));
  PetscCall(OutputCreate(PETSC_COMM_WORLD, DIRECTORY, PETSC_TRUE, &output)); /* goes on with what is there */
  PetscCall(WriteFrame(output, 0.3, 30, 0.5, 4));
  CheckInt(PointsLinkKind("000003"), H5L_TYPE_EXTERNAL);
  CheckInt(CountFrames(DIRECTORY), 4);
  ReadFrames(DIRECTORY, PETSC_FALSE);
  PetscCall(OutputTruncate(output, -1)); /* nothing is left, and nothing is named */
  CheckInt(CountFrames(DIRECTORY), 0);
  CheckTrue(access(DIRECTORY "/the plate.pvd", F_OK));
  PetscCall(OutputDestroy(&output));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFrames)

/* A frame that is not ended leaves no trace in the indices, nor a file. */
static PetscErrorCode TestUnfinishedFrame(void)
{
  Output            output;
  const PetscReal   x[3]  = {0};
  const OutputBlock block = {.name = "the plate", .n_points = 1, .x = x};

  PetscFunctionBeginUser;
  PetscCall(OutputCreate(PETSC_COMM_WORLD, DIRECTORY, PETSC_FALSE, &output));
  PetscCall(WriteFrame(output, 0, 0, 0, 1));
  PetscCall(OutputFrameBegin(output, 1, 1));
  PetscCall(OutputFrameBlock(output, &block));
  ReadFrames(DIRECTORY, PETSC_FALSE);
  PetscCall(OutputDestroy(&output));
  CheckInt(CountFrames(DIRECTORY), 1);
  CheckTrue(access(DIRECTORY "/fields/000001.h5.part", F_OK));
  CheckTrue(access(DIRECTORY "/vtu/the plate_000001.vtu", F_OK));
  ReadFrames(DIRECTORY, PETSC_FALSE);
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestUnfinishedFrame)

static PetscErrorCode TestRefusals(void)
{
  const PetscReal     x[6] = {0};
  const PetscInt      start[2] = {0, 2}, wrong[2] = {0, 2};
  const unsigned char type[1]  = {3};
  const OutputArray   twice[2] = {{"a", "", OUTPUT_POINT_DATA, 1, x}, {"a", "", OUTPUT_POINT_DATA, 1, x}};
  OutputBlock         block    = {.name = "a/b", .n_points = 2, .x = x};
  Output              output;

  PetscFunctionBeginUser;
  PetscCall(OutputCreate(PETSC_COMM_WORLD, DIRECTORY, PETSC_FALSE, &output));
  CheckFails(OutputFrameBlock(output, &block), PETSC_ERR_ORDER, "OutputFrameBegin");
  CheckFails(OutputFrameEnd(output), PETSC_ERR_ORDER, "OutputFrameBegin");
  PetscCall(OutputFrameBegin(output, 0, 0));
  CheckFails(OutputFrameBegin(output, 0, 0), PETSC_ERR_ORDER, "OutputFrameEnd");
  CheckFails(OutputFrameBlock(output, &block), PETSC_ERR_USER_INPUT, "'a/b' cannot name a block");
  block.name = "../up";
  CheckFails(OutputFrameBlock(output, &block), PETSC_ERR_USER_INPUT, "cannot name a block");
  block.name    = "line";
  block.n_cells = 1;
  block.start   = start;
  block.node    = wrong;
  block.type    = type;
  CheckFails(OutputFrameBlock(output, &block), PETSC_ERR_ARG_OUTOFRANGE, "names a point that is not there");
  block.n_cells  = 0;
  block.n_arrays = 2;
  block.array    = twice;
  CheckFails(OutputFrameBlock(output, &block), PETSC_ERR_ARG_WRONG, "twice");
  block.n_arrays = 0;
  PetscCall(OutputFrameBlock(output, &block));
  CheckFails(OutputFrameBlock(output, &block), PETSC_ERR_ARG_WRONG, "twice");
  PetscCall(OutputDestroy(&output));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefusals)

static PetscErrorCode TestFieldNames(void)
{
  const char *const names[] = {"stress", "damage"};
  Output            output;

  PetscFunctionBeginUser;
  PetscCall(OutputCreate(PETSC_COMM_WORLD, DIRECTORY, PETSC_FALSE, &output));
  CheckTrue(OutputWants(output, "velocity"));
  PetscCall(OutputSetFieldNames(output, 2, names));
  CheckTrue(OutputWants(output, "damage") && !OutputWants(output, "velocity"));
  PetscCall(OutputSetFieldNames(output, 0, NULL));
  CheckTrue(!OutputWants(output, "damage"));
  PetscCall(OutputDestroy(&output));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestFieldNames)

/* The text of history.csv by hand; each row is on disk at once; a row cut by a kill goes on resume. */
static PetscErrorCode TestHistory(void)
{
  const char *const names[] = {"time", "reaction(a, b)"}, *const units[] = {"s", "N"}, *const others[] = {"time", "opening"};
  const PetscReal   rows[3][2] = {{0, -1. / 3}, {1e-5 / 3, 1e300}, {2e-5 / 3, 0.1}};
  Output            output;
  char             *text;
  FILE             *file;

  PetscFunctionBeginUser;
  PetscCall(OutputCreate(PETSC_COMM_WORLD, DIRECTORY, PETSC_FALSE, &output));
  PetscCall(OutputHistoryHeader(output, 2, names, units));
  for (int r = 0; r < 3; r++) PetscCall(OutputHistoryRow(output, 2, rows[r]));
  CheckFails(OutputHistoryRow(output, 1, rows[0]), PETSC_ERR_ARG_SIZ, "header");
  PetscCall(FileReadText(DIRECTORY "/history.csv", &text, NULL));
  CheckTrue(!strcmp(text, "time[s],\"reaction(a, b)[N]\"\n0,-0.333333333333\n3.33333333333e-06,1e+300\n6.66666666667e-06,0.1\n"));
  PetscCall(PetscFree(text));
  PetscCall(OutputDestroy(&output));
  PetscCall(FileOpen(DIRECTORY "/history.csv", "a", &file));
  fputs("7e-6,0.", file);
  PetscCall(FileClose(&file, "history.csv"));
  PetscCall(OutputCreate(PETSC_COMM_WORLD, DIRECTORY, PETSC_TRUE, &output));
  PetscCall(OutputTruncate(output, 1e-5 / 3)); /* a time that 12 digits round down */
  PetscCall(OutputHistoryHeader(output, 2, others, units)); /* other columns: what is there is set aside */
  PetscCall(OutputDestroy(&output));
  PetscCall(FileReadText(DIRECTORY "/history.csv", &text, NULL));
  CheckTrue(!strcmp(text, "time[s],opening[N]\n"));
  PetscCall(PetscFree(text));
  PetscCall(FileCommit(DIRECTORY "/history-1.csv", DIRECTORY "/history.csv", PETSC_FALSE));
  PetscCall(OutputCreate(PETSC_COMM_WORLD, DIRECTORY, PETSC_TRUE, &output));
  PetscCall(OutputHistoryHeader(output, 2, names, units));
  PetscCall(OutputHistoryRow(output, 2, rows[2]));
  PetscCall(FileReadText(DIRECTORY "/history.csv", &text, NULL));
  CheckTrue(!strcmp(text, "time[s],\"reaction(a, b)[N]\"\n0,-0.333333333333\n3.33333333333e-06,1e+300\n6.66666666667e-06,0.1\n"));
  PetscCall(PetscFree(text));
  PetscCall(OutputDestroy(&output));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestHistory)

static const struct CMUnitTest tests[] = {TEST(TestFrames), TEST(TestUnfinishedFrame), TEST(TestRefusals), TEST(TestFieldNames), TEST(TestHistory)};
CHECK_MAIN(tests)
