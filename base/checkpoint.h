/* checkpoint.h - state in HDF5, by name, in global order; everything a restart needs. */
#pragma once
#include "base.h"

typedef struct _p_Checkpoint *Checkpoint;

/* Write to FILE.part, renamed to FILE on close: a stop in between leaves the last good one. Collective; rank 0 writes. */
PetscErrorCode CheckpointCreate(MPI_Comm comm, const char *file, Checkpoint *checkpoint);
PetscErrorCode CheckpointCreateInMemory(MPI_Comm comm, Checkpoint *checkpoint); /* written, then read from the same handle; no file */
PetscErrorCode CheckpointOpen(MPI_Comm comm, const char *file, Checkpoint *checkpoint);
PetscErrorCode CheckpointClose(Checkpoint *checkpoint);
PetscErrorCode CheckpointAbandon(Checkpoint *checkpoint); /* drop the unfinished file */

/* Names may hold slashes: "dem/position". Arrays live whole on rank 0 (n is ignored elsewhere). */
PetscErrorCode CheckpointWriteReal(Checkpoint checkpoint, const char *name, PetscInt n, const PetscReal data[]);
PetscErrorCode CheckpointWriteInt(Checkpoint checkpoint, const char *name, PetscInt n, const PetscInt data[]);
PetscErrorCode CheckpointWriteString(Checkpoint checkpoint, const char *name, const char *text);
/* Reading broadcasts to all ranks; a size that differs from n is PETSC_ERR_USER_INPUT (another scene's checkpoint). */
PetscErrorCode CheckpointReadReal(Checkpoint checkpoint, const char *name, PetscInt n, PetscReal data[]);
PetscErrorCode CheckpointReadInt(Checkpoint checkpoint, const char *name, PetscInt n, PetscInt data[]);
PetscErrorCode CheckpointReadString(Checkpoint checkpoint, const char *name, size_t size, char text[]);
PetscErrorCode CheckpointReadText(Checkpoint checkpoint, const char *name, char **text); /* of any length; PetscFree() it */
PetscErrorCode CheckpointHas(Checkpoint checkpoint, const char *name, PetscBool *has);
