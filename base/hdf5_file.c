/* hdf5_file.c - thin words over HDF5. Object times are not kept, so equal runs make equal files. */
#include "hdf5_file.h"
#include <string.h>
#include <unistd.h>

/* At the end of a process HDF5 writes out what is still open, and breaks when the disk that could not take it is still full. */
void Hdf5Quiet(void)
{
  static PetscBool said;

  if (!said) (void)H5dont_atexit();
  said = PETSC_TRUE;
  H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
}

PetscErrorCode Hdf5Create(const char *path, hid_t *file)
{
  PetscFunctionBegin;
  Hdf5Quiet();
  (void)unlink(path); /* a link of that name is not written through */
  *file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  Hdf5Check(*file, path, "create the file");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Hdf5CreateInMemory(const char *name, hid_t *file)
{
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);

  PetscFunctionBegin;
  Hdf5Quiet();
  H5Pset_fapl_core(access, 1 << 20, 0);
  *file = H5Fcreate(name, H5F_ACC_TRUNC, H5P_DEFAULT, access);
  H5Pclose(access);
  Hdf5Check(*file, name, "make room for it in memory");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Hdf5Group(hid_t where, const char *name, const char *path, hid_t *group)
{
  const hid_t parents = H5Pcreate(H5P_LINK_CREATE);

  PetscFunctionBegin;
  H5Pset_create_intermediate_group(parents, 1);
  *group = H5Gcreate2(where, name, parents, H5P_DEFAULT, H5P_DEFAULT);
  H5Pclose(parents);
  Hdf5Check(*group, path, "create group '%s'", name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Hdf5Write(hid_t where, const char *name, const char *path, hid_t type, hsize_t rows, hsize_t columns, const void *data, const char *unit)
{
  const hsize_t  size[2] = {rows, columns};
  const hid_t    space   = H5Screate_simple(columns ? 2 : 1, size, NULL);
  const hid_t    parents = H5Pcreate(H5P_LINK_CREATE), plain = H5Pcreate(H5P_DATASET_CREATE);
  hid_t          set;
  herr_t         status = 0;
  PetscErrorCode code   = PETSC_SUCCESS;

  PetscFunctionBegin;
  H5Pset_create_intermediate_group(parents, 1);
  H5Pset_obj_track_times(plain, 0);
  set = H5Dcreate2(where, name, type, space, parents, plain, H5P_DEFAULT);
  if (set >= 0) {
    if (rows && data) status = H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
    if (unit) code = Hdf5WriteText(set, "unit", path, unit);
    if (H5Dclose(set) < 0) status = -1;
  }
  H5Pclose(plain);
  H5Pclose(parents);
  H5Sclose(space);
  Hdf5Check(set, path, "create '%s'", name);
  Hdf5Check(status, path, "write '%s'", name);
  PetscCall(code);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Hdf5WriteAttribute(hid_t where, const char *name, const char *path, hid_t type, hsize_t n, const void *data)
{
  const hid_t space = n ? H5Screate_simple(1, &n, NULL) : H5Screate(H5S_SCALAR);
  const hid_t attribute = H5Acreate2(where, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
  herr_t      status    = -1;

  PetscFunctionBegin;
  if (attribute >= 0) {
    status = H5Awrite(attribute, type, data);
    H5Aclose(attribute);
  }
  H5Sclose(space);
  Hdf5Check(status, path, "write attribute '%s'", name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Hdf5WriteText(hid_t where, const char *name, const char *path, const char *text)
{
  const hid_t    type = H5Tcopy(H5T_C_S1);
  PetscErrorCode code;

  PetscFunctionBegin;
  H5Tset_size(type, strlen(text) + 1);
  H5Tset_cset(type, H5T_CSET_UTF8);
  code = Hdf5WriteAttribute(where, name, path, type, 0, text);
  H5Tclose(type);
  PetscCall(code);
  PetscFunctionReturn(PETSC_SUCCESS);
}
