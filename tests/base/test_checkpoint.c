/* test_checkpoint.c - what is written comes back bit for bit; what is not a whole checkpoint of this scene is refused in words. */
#include "check.h"
#include "checkpoint.h"
#include "files.h"
#include <hdf5.h>
#include <unistd.h>

#define FILE_NAME "test_checkpoint.h5"

static PetscErrorCode WriteOne(PetscReal first)
{
  const PetscReal x[3] = {first, -0., 1e-310};
  const PetscInt  k[2] = {-7, PETSC_MAX_INT};
  Checkpoint      c;

  PetscFunctionBeginUser;
  PetscCall(CheckpointCreate(PETSC_COMM_WORLD, FILE_NAME, &c));
  PetscCall(CheckpointWriteReal(c, "dem/position", 3, x));
  PetscCall(CheckpointWriteInt(c, "dem/deep/er/count", 2, k));
  PetscCall(CheckpointWriteReal(c, "dem/none", 0, NULL));
  PetscCall(CheckpointWriteString(c, "title", "two\nlines \xc3\xa9"));
  PetscCall(CheckpointWriteString(c, "empty", ""));
  PetscCall(CheckpointClose(&c));
  CheckTrue(c == NULL);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestRoundTrip(void)
{
  Checkpoint c;
  PetscReal  x[3], none[1];
  PetscInt   k[2];
  char       text[64], *whole;
  PetscBool  has;

  PetscFunctionBeginUser;
  PetscCall(WriteOne(0.1));
  PetscCall(CheckpointOpen(PETSC_COMM_WORLD, FILE_NAME, &c));
  PetscCall(CheckpointReadReal(c, "dem/position", 3, x));
  CheckTrue(x[0] == 0.1 && x[1] == 0 && signbit(x[1]) && x[2] == 1e-310);
  PetscCall(CheckpointReadInt(c, "dem/deep/er/count", 2, k));
  CheckTrue(k[0] == -7 && k[1] == PETSC_MAX_INT);
  PetscCall(CheckpointReadReal(c, "dem/none", 0, none));
  PetscCall(CheckpointReadString(c, "title", sizeof(text), text));
  CheckTrue(!strcmp(text, "two\nlines \xc3\xa9"));
  PetscCall(CheckpointReadText(c, "title", &whole));
  CheckTrue(!strcmp(text, whole));
  PetscCall(PetscFree(whole));
  PetscCall(CheckpointReadString(c, "empty", sizeof(text), text));
  CheckInt(text[0], 0);
  PetscCall(CheckpointHas(c, "dem/deep/er/count", &has));
  CheckTrue(has);
  PetscCall(CheckpointHas(c, "dem/absent/count", &has));
  CheckTrue(!has);
  PetscCall(CheckpointClose(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRoundTrip)

static PetscErrorCode TestAnotherScene(void)
{
  Checkpoint c;
  PetscReal  x[4];
  PetscInt   k[3];
  char       tiny[3];

  PetscFunctionBeginUser;
  PetscCall(WriteOne(0.1));
  PetscCall(CheckpointOpen(PETSC_COMM_WORLD, FILE_NAME, &c));
  CheckFails(CheckpointReadReal(c, "dem/position", 4, x), PETSC_ERR_USER_INPUT, "has 3 numbers, this scene needs 4");
  CheckFails(CheckpointReadReal(c, "fem/position", 4, x), PETSC_ERR_USER_INPUT, "holds no 'fem/position'");
  CheckFails(CheckpointReadInt(c, "dem/position", 3, k), PETSC_ERR_USER_INPUT, "not the list of numbers expected");
  CheckFails(CheckpointReadReal(c, "dem", 3, x), PETSC_ERR_USER_INPUT, "dem"); /* a group, not a list */
  CheckFails(CheckpointReadString(c, "title", sizeof(tiny), tiny), PETSC_ERR_USER_INPUT, "longer than");
  PetscCall(CheckpointClose(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestAnotherScene)

/* While a new one is written, and when it is given up, the file under the final name is the last good one. */
static PetscErrorCode TestOldOneStays(void)
{
  Checkpoint c;
  PetscReal  x[3], y = 5;

  PetscFunctionBeginUser;
  PetscCall(WriteOne(0.25));
  PetscCall(CheckpointCreate(PETSC_COMM_WORLD, FILE_NAME, &c));
  PetscCall(CheckpointWriteReal(c, "dem/position", 1, &y));
  {
    Checkpoint old;

    PetscCall(CheckpointOpen(PETSC_COMM_WORLD, FILE_NAME, &old));
    PetscCall(CheckpointReadReal(old, "dem/position", 3, x));
    CheckNear(x[0], 0.25, 0);
    PetscCall(CheckpointClose(&old));
    CheckTrue(!access(FILE_NAME ".part", F_OK));
    CheckFails(CheckpointOpen(PETSC_COMM_WORLD, FILE_NAME ".part", &old), PETSC_ERR_USER_INPUT, FILE_NAME ".part"); /* unfinished */
  }
  PetscCall(CheckpointAbandon(&c));
  CheckTrue(access(FILE_NAME ".part", F_OK));
  PetscCall(CheckpointOpen(PETSC_COMM_WORLD, FILE_NAME, &c));
  PetscCall(CheckpointReadReal(c, "dem/position", 3, x));
  CheckNear(x[0], 0.25, 0);
  PetscCall(CheckpointClose(&c));
  PetscCall(WriteOne(0.5));
  CheckTrue(access(FILE_NAME ".part", F_OK));
  PetscCall(CheckpointOpen(PETSC_COMM_WORLD, FILE_NAME, &c));
  PetscCall(CheckpointReadReal(c, "dem/position", 3, x));
  CheckNear(x[0], 0.5, 0);
  PetscCall(CheckpointClose(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOldOneStays)

/* Cut after every tenth of its length, absent, another kind of file, another program's HDF5. */
static PetscErrorCode TestRefusesWhatIsNotOne(void)
{
  Checkpoint c;
  char      *bytes;
  size_t     n;
  FILE      *file;
  hid_t      foreign;

  PetscFunctionBeginUser;
  PetscCall(WriteOne(0.1));
  PetscCall(FileReadText(FILE_NAME, &bytes, &n));
  for (size_t cut = 0; cut < 10; cut++) {
    PetscCall(FileOpen("test_cut.h5", "wb", &file));
    fwrite(bytes, 1, n * cut / 10, file);
    PetscCall(FileClose(&file, "test_cut.h5"));
    CheckFails(CheckpointOpen(PETSC_COMM_WORLD, "test_cut.h5", &c), PETSC_ERR_USER_INPUT, "not a whole HDF5 file");
  }
  PetscCall(FileOpen("test_cut.h5", "wb", &file));
  fwrite(bytes, 1, n - 1, file);
  PetscCall(FileClose(&file, "test_cut.h5"));
  CheckFails(CheckpointOpen(PETSC_COMM_WORLD, "test_cut.h5", &c), PETSC_ERR_USER_INPUT, "not a whole HDF5 file");
  PetscCall(PetscFree(bytes));
  CheckFails(CheckpointOpen(PETSC_COMM_WORLD, "absent.h5", &c), PETSC_ERR_USER_INPUT, "no checkpoint 'absent.h5'");
  foreign = H5Fcreate("test_foreign.h5", H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  H5Fclose(foreign);
  CheckFails(CheckpointOpen(PETSC_COMM_WORLD, "test_foreign.h5", &c), PETSC_ERR_USER_INPUT, "not a finished checkpoint");
  CheckFails(CheckpointCreate(PETSC_COMM_WORLD, "no/such/place.h5", &c), PETSC_ERR_FILE_WRITE, "no/such/place.h5");
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestRefusesWhatIsNotOne)

static const struct CMUnitTest tests[] = {TEST(TestRoundTrip), TEST(TestAnotherScene), TEST(TestOldOneStays), TEST(TestRefusesWhatIsNotOne)};
CHECK_MAIN(tests)
