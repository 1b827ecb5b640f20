/* hdf5_file.h - the few HDF5 deeds that output and checkpoint share. One rank, default driver, no collective calls. */
#pragma once
#include "base.h"
#include <hdf5.h>

/* A negative id or status of HDF5, in words. */
#define Hdf5Check(status, path, ...) \
  do { \
    char what_[256]; \
    PetscCall(BaseFormat(what_, __VA_ARGS__)); \
    PetscCheck((status) >= 0, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s: HDF5 could not %s (is the disk full?)", path, what_); \
  } while (0)

#if defined(PETSC_USE_64BIT_INDICES)
  #define HDF5_INT H5T_NATIVE_INT64
#else
  #define HDF5_INT H5T_NATIVE_INT32
#endif
#if defined(PETSC_USE_REAL_SINGLE)
  #define HDF5_REAL H5T_NATIVE_FLOAT
#else
  #define HDF5_REAL H5T_NATIVE_DOUBLE
#endif

void           Hdf5Quiet(void); /* HDF5 keeps its own error stack to itself; ours has the words */
PetscErrorCode Hdf5Create(const char *path, hid_t *file);
PetscErrorCode Hdf5CreateInMemory(const char *name, hid_t *file); /* nothing reaches a disk; gone when closed */
PetscErrorCode Hdf5Group(hid_t where, const char *name, const char *path, hid_t *group); /* intermediate groups too */
/* data [rows][columns]; columns 0 makes a 1-D set. unit NULL = none. The same bytes whenever it is written. */
PetscErrorCode Hdf5Write(hid_t where, const char *name, const char *path, hid_t type, hsize_t rows, hsize_t columns, const void *data, const char *unit);
PetscErrorCode Hdf5WriteAttribute(hid_t where, const char *name, const char *path, hid_t type, hsize_t n, const void *data); /* n = 0: scalar */
PetscErrorCode Hdf5WriteText(hid_t where, const char *name, const char *path, const char *text);                             /* attribute */
