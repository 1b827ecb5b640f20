/*
  checkpoint.c - one HDF5 file, arrays by name.

  The file carries the root attribute `cleave_checkpoint` (the layout's number), and behind its end a mark of all its bytes:
  cut, changed or unfinished it is refused before HDF5 looks at it, which is not made for damaged files.
*/
#include "checkpoint.h"
#include "files.h"
#include "hdf5_file.h"
#include <string.h>
#include <unistd.h>

#define CHECKPOINT_LAYOUT 2

struct _p_Checkpoint {
  MPI_Comm    comm;
  PetscMPIInt rank;
  PetscBool   writing, memory;
  hid_t       file;            /* rank 0 only; < 0 elsewhere */
  char        path[BASE_LINE]; /* final name */
  char        part[BASE_LINE]; /* what is being written */
};

static PetscErrorCode Allocate(MPI_Comm comm, const char *path, PetscBool writing, Checkpoint *checkpoint)
{
  Checkpoint c;

  PetscFunctionBegin;
  PetscCall(PetscNew(&c));
  c->comm    = comm;
  c->file    = -1;
  c->writing = writing;
  PetscCallMPI(MPI_Comm_rank(comm, &c->rank));
  PetscCall(BaseFormat(c->path, "%s", path));
  PetscCall(BaseFormat(c->part, "%s.part", path));
  *checkpoint = c;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Free(Checkpoint *checkpoint)
{
  Checkpoint c = *checkpoint;

  PetscFunctionBegin;
  if (c->file >= 0) H5Fclose(c->file);
  if (c->writing && !c->memory && c->rank == 0) unlink(c->part); /* already renamed when the close went well */
  PetscCall(PetscFree(*checkpoint));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointCreate(MPI_Comm comm, const char *file, Checkpoint *checkpoint)
{
  PetscErrorCode code = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCall(Allocate(comm, file, PETSC_TRUE, checkpoint));
  if ((*checkpoint)->rank == 0) code = Hdf5Create((*checkpoint)->part, &(*checkpoint)->file);
  if (code) (void)Free(checkpoint);
  PetscCall(FileShareError(comm, code, "create the checkpoint"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointCreateInMemory(MPI_Comm comm, Checkpoint *checkpoint)
{
  PetscErrorCode code = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCall(Allocate(comm, "memory", PETSC_TRUE, checkpoint));
  (*checkpoint)->memory = PETSC_TRUE;
  if ((*checkpoint)->rank == 0) code = Hdf5CreateInMemory("memory", &(*checkpoint)->file);
  if (code) (void)Free(checkpoint);
  PetscCall(FileShareError(comm, code, "keep the state in memory"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode OpenFile(Checkpoint c)
{
  int       layout = 0;
  PetscBool whole;
  hid_t     attribute;
  herr_t    status = -1;

  PetscFunctionBegin;
  Hdf5Quiet();
  BaseCheckInput(!access(c->path, F_OK), PETSC_COMM_SELF, "There is no checkpoint '%s' to go on from; run without resuming", c->path);
  BaseCheckInput(!FileUnfit(c->path), PETSC_COMM_SELF, "The checkpoint '%s' %s", c->path, FileUnfit(c->path));
  PetscCall(FileIsSealed(c->path, &whole));
  BaseCheckInput(whole, PETSC_COMM_SELF, "'%s' is not a whole HDF5 file, or not a finished checkpoint of cleave: cut short, damaged, of an earlier version, or another kind of file", c->path);
  c->file = H5Fopen(c->path, H5F_ACC_RDONLY, H5P_DEFAULT);
  BaseCheckInput(c->file >= 0, PETSC_COMM_SELF, "'%s' cannot be opened as an HDF5 file; a checkpoint is expected", c->path);
  attribute = H5Aopen(c->file, "cleave_checkpoint", H5P_DEFAULT);
  if (attribute >= 0) {
    status = H5Aread(attribute, H5T_NATIVE_INT, &layout);
    H5Aclose(attribute);
  }
  BaseCheckInput(status >= 0, PETSC_COMM_SELF, "'%s' is an HDF5 file, but not a finished checkpoint of cleave", c->path);
  BaseCheckInput(layout == CHECKPOINT_LAYOUT, PETSC_COMM_SELF, "'%s' has checkpoint layout %d, this program reads %d; use the version that wrote it", c->path, layout, CHECKPOINT_LAYOUT);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointOpen(MPI_Comm comm, const char *file, Checkpoint *checkpoint)
{
  PetscErrorCode code = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCall(Allocate(comm, file, PETSC_FALSE, checkpoint));
  if ((*checkpoint)->rank == 0) code = OpenFile(*checkpoint);
  if (code) (void)Free(checkpoint);
  PetscCall(FileShareError(comm, code, "open the checkpoint"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Finish(Checkpoint c)
{
  const int layout = CHECKPOINT_LAYOUT;
  herr_t    status;

  PetscFunctionBegin;
  PetscCall(Hdf5WriteAttribute(c->file, "cleave_checkpoint", c->path, H5T_NATIVE_INT, 0, &layout));
  status  = H5Fclose(c->file);
  c->file = -1;
  Hdf5Check(status, c->path, "finish the file");
  PetscCall(FileSeal(c->part));
  PetscCall(FileCommit(c->part, c->path, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointClose(Checkpoint *checkpoint)
{
  PetscErrorCode code = PETSC_SUCCESS;
  MPI_Comm       comm;

  PetscFunctionBegin;
  if (!*checkpoint) PetscFunctionReturn(PETSC_SUCCESS);
  comm = (*checkpoint)->comm;
  if ((*checkpoint)->rank == 0 && (*checkpoint)->writing && !(*checkpoint)->memory) code = Finish(*checkpoint);
  PetscCall(Free(checkpoint));
  PetscCall(FileShareError(comm, code, "finish the checkpoint"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointAbandon(Checkpoint *checkpoint)
{
  PetscFunctionBegin;
  if (*checkpoint) PetscCall(Free(checkpoint));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteArray(Checkpoint c, const char *name, hid_t type, PetscInt n, const void *data)
{
  PetscErrorCode code = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCheck(c->writing, c->comm, PETSC_ERR_ORDER, "'%s' was opened for reading", c->path);
  if (c->rank == 0) code = Hdf5Write(c->file, name, c->path, type, (hsize_t)n, 0, data, NULL);
  PetscCall(FileShareError(c->comm, code, "write the checkpoint"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointWriteReal(Checkpoint checkpoint, const char *name, PetscInt n, const PetscReal data[])
{
  return WriteArray(checkpoint, name, HDF5_REAL, n, data);
}

PetscErrorCode CheckpointWriteInt(Checkpoint checkpoint, const char *name, PetscInt n, const PetscInt data[])
{
  return WriteArray(checkpoint, name, HDF5_INT, n, data);
}

PetscErrorCode CheckpointWriteString(Checkpoint checkpoint, const char *name, const char *text)
{
  return WriteArray(checkpoint, name, H5T_NATIVE_CHAR, (PetscInt)strlen(text), text);
}

/* Opens a 1-D set of the wanted kind of number; n [entries] comes back. Rank 0. */
static PetscErrorCode OpenArray(Checkpoint c, const char *name, H5T_class_t kind, hid_t *set, PetscInt *n)
{
  hid_t       space, type;
  hsize_t     size = 0;
  H5T_class_t found;
  int         rank;

  PetscFunctionBegin;
  *set = H5Dopen2(c->file, name, H5P_DEFAULT);
  BaseCheckInput(*set >= 0, PETSC_COMM_SELF, "The checkpoint '%s' holds no '%s'; it was written by another scene or version", c->path, name);
  space = H5Dget_space(*set);
  type  = H5Dget_type(*set);
  rank  = H5Sget_simple_extent_ndims(space);
  found = H5Tget_class(type);
  if (rank == 1) H5Sget_simple_extent_dims(space, &size, NULL);
  H5Tclose(type);
  H5Sclose(space);
  if (rank != 1 || found != kind) H5Dclose(*set);
  BaseCheckInput(rank == 1 && found == kind, PETSC_COMM_SELF, "'%s' in the checkpoint '%s' is not the list of numbers expected", name, c->path);
  *n = (PetscInt)size;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FillArray(Checkpoint c, const char *name, hid_t type, hid_t set, PetscInt n, void *data)
{
  const herr_t status = n ? H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) : 0;

  PetscFunctionBegin;
  H5Dclose(set);
  BaseCheckInput(status >= 0, PETSC_COMM_SELF, "'%s' in the checkpoint '%s' cannot be read; the file is damaged", name, c->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadHere(Checkpoint c, const char *name, hid_t type, PetscInt n, void *data)
{
  hid_t    set;
  PetscInt found;

  PetscFunctionBegin;
  PetscCall(OpenArray(c, name, H5Tget_class(type), &set, &found));
  if (found != n) H5Dclose(set);
  BaseCheckInput(found == n, PETSC_COMM_SELF, "'%s' in the checkpoint '%s' has %" PetscInt_FMT " numbers, this scene needs %" PetscInt_FMT "; it was written by another scene", name, c->path, found, n);
  PetscCall(FillArray(c, name, type, set, n, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadArray(Checkpoint c, const char *name, hid_t type, MPI_Datatype mpi, PetscInt n, void *data)
{
  PetscErrorCode code = PETSC_SUCCESS;
  PetscMPIInt    count;

  PetscFunctionBegin;
  PetscCheck(!c->writing || c->memory, c->comm, PETSC_ERR_ORDER, "'%s' was opened for writing", c->path);
  if (c->rank == 0) code = ReadHere(c, name, type, n, data);
  PetscCall(FileShareError(c->comm, code, "read the checkpoint"));
  PetscCall(PetscMPIIntCast(n, &count));
  PetscCallMPI(MPI_Bcast(data, count, mpi, 0, c->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointReadReal(Checkpoint checkpoint, const char *name, PetscInt n, PetscReal data[])
{
  return ReadArray(checkpoint, name, HDF5_REAL, MPIU_REAL, n, data);
}

PetscErrorCode CheckpointReadInt(Checkpoint checkpoint, const char *name, PetscInt n, PetscInt data[])
{
  return ReadArray(checkpoint, name, HDF5_INT, MPIU_INT, n, data);
}

static PetscErrorCode ReadTextHere(Checkpoint c, const char *name, PetscInt *n, char **text)
{
  hid_t set;

  PetscFunctionBegin;
  PetscCall(OpenArray(c, name, H5T_INTEGER, &set, n));
  PetscCall(PetscCalloc1(*n + 1, text));
  PetscCall(FillArray(c, name, H5T_NATIVE_CHAR, set, *n, *text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointReadText(Checkpoint checkpoint, const char *name, char **text)
{
  Checkpoint     c    = checkpoint;
  PetscErrorCode code = PETSC_SUCCESS;
  PetscInt       n    = 0;

  PetscFunctionBegin;
  *text = NULL;
  PetscCheck(!c->writing, c->comm, PETSC_ERR_ORDER, "'%s' was opened for writing", c->path);
  if (c->rank == 0) code = ReadTextHere(c, name, &n, text);
  PetscCall(FileShareError(c->comm, code, "read the checkpoint"));
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, 0, c->comm));
  if (c->rank) PetscCall(PetscCalloc1(n + 1, text));
  PetscCallMPI(MPI_Bcast(*text, (int)n, MPI_CHAR, 0, c->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointReadString(Checkpoint checkpoint, const char *name, size_t size, char text[])
{
  char     *whole;
  PetscBool fits;

  PetscFunctionBegin;
  PetscCall(CheckpointReadText(checkpoint, name, &whole));
  fits = (PetscBool)(strlen(whole) < size);
  if (fits) strcpy(text, whole);
  PetscCall(PetscFree(whole));
  BaseCheckInput(fits, checkpoint->comm, "'%s' in the checkpoint '%s' is longer than the %d characters expected; it was written by another scene", name, checkpoint->path, (int)size - 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointHas(Checkpoint checkpoint, const char *name, PetscBool *has)
{
  Checkpoint c   = checkpoint;
  int        yes = 0;

  PetscFunctionBegin;
  if (c->rank == 0) {
    const hid_t object = H5Oopen(c->file, name, H5P_DEFAULT); /* H5Lexists() needs every parent checked in turn */

    yes = object >= 0;
    if (yes) H5Oclose(object);
  }
  PetscCallMPI(MPI_Bcast(&yes, 1, MPI_INT, 0, c->comm));
  *has = (PetscBool)yes;
  PetscFunctionReturn(PETSC_SUCCESS);
}
