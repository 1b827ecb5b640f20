/* files.h - files that are whole or absent: written as NAME.part, then renamed. Not collective: the caller is the one rank that writes. */
#pragma once
#include "base.h"

PetscErrorCode FileMakeDirectory(const char *path);        /* parents too; PETSC_ERR_USER_INPUT where that is not possible */
PetscErrorCode FileOpen(const char *path, const char *mode, FILE **file); /* fopen with words on failure */
PetscErrorCode FileClose(FILE **file, const char *path);    /* fails if any write failed (disk full); NULL afterwards */
PetscErrorCode FileCommit(const char *part, const char *path, PetscBool durable); /* rename; durable also survives a power cut */
PetscErrorCode FileSync(const char *path);                                        /* fsync of a file or a directory */
PetscErrorCode FileCreate(const char *path, FILE **file);                         /* PATH.part for writing ... */
PetscErrorCode FileFinish(FILE **file, const char *path);                         /* ... closed, checked and renamed */
PetscErrorCode FileSeal(const char *path);                                        /* a mark of its bytes behind its end: cut or changed, it is no longer whole */
PetscErrorCode FileIsSealed(const char *path, PetscBool *whole);
const char    *FileUnfit(const char *path);                                       /* why it cannot be read as input ("is a directory"), NULL when it can; a device or a pipe might never end */
PetscErrorCode FileReadText(const char *path, char **text, size_t *length);       /* whole file, zero at its end; PetscFree() it */

/* All ranks learn whether the writing rank (0) failed, so that they stop together. `what` names the deed for the other ranks. */
PetscErrorCode FileShareError(MPI_Comm comm, PetscErrorCode code, const char *what);
