/* info.c - `cleave info`: what a result directory, fields.h5, a frame or a checkpoint holds. */
#include "app.h"
#include "files.h"
#include <hdf5.h>
#include <string.h>
#include <sys/stat.h>

#define MOST_LINES 40 /* of one file's tree; the rest is counted */

typedef struct {
  int lines, left;
} Listing;

static void PrintAttribute(hid_t where, const char *name)
{
  const hid_t attribute = H5Aopen(where, name, H5P_DEFAULT), type = attribute < 0 ? -1 : H5Aget_type(attribute);
  const hid_t space = attribute < 0 ? -1 : H5Aget_space(attribute);
  char        text[256] = "";

  if (attribute >= 0 && H5Tget_class(type) == H5T_STRING && !H5Tis_variable_str(type) && H5Tget_size(type) < sizeof(text)) {
    if (H5Aread(attribute, type, text) >= 0) printf("  %s: %s\n", name, text);
  } else if (attribute >= 0 && H5Sget_simple_extent_npoints(space) == 1 && H5Tget_class(type) != H5T_STRING) {
    double value;

    if (H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) >= 0) printf("  %s: %.12g\n", name, value);
  }
  if (space >= 0) H5Sclose(space);
  if (type >= 0) H5Tclose(type);
  if (attribute >= 0) H5Aclose(attribute);
}

static herr_t OnAttribute(hid_t where, const char *name, const H5A_info_t *info, void *context)
{
  PrintAttribute(where, name);
  return 0;
}

static void PrintSet(hid_t set, const char *path)
{
  const hid_t    space = H5Dget_space(set), type = H5Dget_type(set);
  const hssize_t n     = H5Sget_simple_extent_npoints(space);
  hsize_t        size[8];
  const int      rank = H5Sget_simple_extent_ndims(space);

  printf("  %-44s", path);
  H5Sget_simple_extent_dims(space, size, NULL);
  for (int d = 0; d < rank && d < 8; d++) printf("%s%llu", d ? " x " : "", (unsigned long long)size[d]);
  if (n == 1 && H5Tget_class(type) != H5T_STRING) {
    double value;

    if (H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) >= 0) printf(" = %.12g", value);
  }
  if (H5Aexists(set, "unit") > 0) {
    const hid_t attribute = H5Aopen(set, "unit", H5P_DEFAULT), text_type = H5Aget_type(attribute);
    char        unit[64] = "";

    if (!H5Tis_variable_str(text_type) && H5Tget_size(text_type) < sizeof(unit) && H5Aread(attribute, text_type, unit) >= 0 && unit[0]) printf(" [%s]", unit);
    H5Tclose(text_type);
    H5Aclose(attribute);
  }
  putchar('\n');
  H5Tclose(type);
  H5Sclose(space);
}

/* Groups in depth, external links followed: a frame is a file of its own. */
static void List(hid_t group, const char *path, Listing *listing)
{
  H5G_info_t info;

  if (H5Gget_info(group, &info) < 0) return;
  for (hsize_t k = 0; k < info.nlinks; k++) {
    char  name[256], below[1024];
    hid_t object;

    if (H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, k, name, sizeof(name), H5P_DEFAULT) < 0) continue;
    snprintf(below, sizeof(below), "%s%s%s", path, path[0] ? "/" : "", name);
    object = H5Oopen(group, name, H5P_DEFAULT);
    if (object < 0) {
      printf("  %-44s(its file is missing)\n", below);
      continue;
    }
    if (H5Iget_type(object) == H5I_GROUP) List(object, below, listing);
    else if (H5Iget_type(object) == H5I_DATASET) {
      if (listing->lines++ < MOST_LINES) PrintSet(object, below);
      else listing->left++;
    }
    H5Oclose(object);
  }
}

/* The index of frames: how many, from when to when, and what the last one holds. */
static void PrintFrames(hid_t file)
{
  const hid_t frames = H5Gopen2(file, "frames", H5P_DEFAULT);
  H5G_info_t  info;
  char        last[256] = "";
  Listing     listing   = {0};

  if (frames < 0) return;
  H5Gget_info(frames, &info);
  printf("  %llu frames\n", (unsigned long long)info.nlinks);
  if (info.nlinks) {
    hid_t frame;

    H5Lget_name_by_idx(frames, ".", H5_INDEX_NAME, H5_ITER_INC, info.nlinks - 1, last, sizeof(last), H5P_DEFAULT);
    printf("  the last, %s:\n", last);
    frame = H5Oopen(frames, last, H5P_DEFAULT);
    if (frame >= 0) {
      H5Aiterate2(frame, H5_INDEX_NAME, H5_ITER_INC, NULL, OnAttribute, NULL);
      List(frame, last, &listing);
      H5Oclose(frame);
    }
  }
  if (listing.left) printf("  and %d more\n", listing.left);
  H5Gclose(frames);
}

static PetscErrorCode InfoHdf5(const char *path)
{
  hid_t   file;
  Listing listing = {0};

  PetscFunctionBegin;
  BaseCheckInput(!FileUnfit(path), PETSC_COMM_SELF, "'%s' %s", path, FileUnfit(path));
  H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
  file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
  BaseCheckInput(file >= 0, PETSC_COMM_SELF, "'%s' cannot be read as HDF5; is it whole?", path);
  printf("%s\n", path);
  H5Aiterate2(file, H5_INDEX_NAME, H5_ITER_INC, NULL, OnAttribute, NULL);
  if (H5Lexists(file, "frames", H5P_DEFAULT) > 0) PrintFrames(file);
  else {
    List(file, "", &listing);
    if (listing.left) printf("  and %d more\n", listing.left);
  }
  H5Fclose(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* summary.json is ours, one key a line: the plain values of its first two levels, without quotes and commas. */
static PetscErrorCode InfoSummary(const char *path)
{
  char *text, *line, *next, section[64] = "";

  PetscFunctionBegin;
  PetscCall(FileReadText(path, &text, NULL));
  for (line = text; *line; line = next) {
    const size_t length = strcspn(line, "\n"), indent = strspn(line, " ");
    char        *key = line + indent, *colon;

    next         = line + length + (line[length] == '\n');
    line[length] = 0;
    colon        = strstr(key, "\": ");
    if (indent > 4 || key[0] != '"' || !colon) continue;
    *colon = 0;
    key++;
    if (colon[3] == '{' || colon[3] == '[') {
      snprintf(section, sizeof(section), "%s", indent == 2 ? key : section);
      continue;
    }
    if (indent == 4 && strcmp(section, "plan") && strcmp(section, "run") && strcmp(section, "versions")) continue;
    for (char *c = colon + 3; *c; c++)
      if (*c == '"' || (*c == ',' && !c[1])) *c = ' ';
    printf("  %s%s%s:%s%s\n", indent == 4 ? section : "", indent == 4 ? "." : "", key, colon[3] == ' ' ? "" : " ", colon + 3);
  }
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode InfoDirectory(const char *directory)
{
  static const char *const what[][2] = {
    {"summary.json", "how it went"},          {"resolved.yaml", "every value of the scene"}, {"history.csv", "quantities in time"}, {"fields.h5", "frames"},
    {"checkpoint.h5", "state to resume from"}, {"packing.csv", "spheres"},                   {"packing.json", "quality of the packing"}};
  char        path[PETSC_MAX_PATH_LEN];
  struct stat info;
  int         found = 0;

  PetscFunctionBegin;
  printf("%s\n", directory);
  for (size_t k = 0; k < sizeof(what) / sizeof(what[0]); k++) {
    PetscCall(BaseFormat(path, "%s/%s", directory, what[k][0]));
    if (stat(path, &info)) continue;
    printf("  %-16s%12lld bytes  %s\n", what[k][0], (long long)info.st_size, what[k][1]);
    found++;
  }
  BaseCheckInput(found, PETSC_COMM_SELF, "'%s' holds no results; name the directory a run wrote", directory);
  PetscCall(BaseFormat(path, "%s/summary.json", directory));
  if (!stat(path, &info)) PetscCall(InfoSummary(path));
  PetscCall(BaseFormat(path, "%s/fields.h5", directory));
  if (!stat(path, &info)) PetscCall(InfoHdf5(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppInfo(const AppOptions *options, int *exit_code)
{
  struct stat info;
  PetscMPIInt rank;
  const char *file = options->word[0];

  PetscFunctionBegin;
  BaseCheckInput(options->n_words == 1, PETSC_COMM_WORLD, "cleave info takes one file or result directory");
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  BaseCheckInput(!stat(file, &info), PETSC_COMM_WORLD, "'%s' does not exist", file);
  *exit_code = 0;
  if (rank) PetscFunctionReturn(PETSC_SUCCESS);
  if (S_ISDIR(info.st_mode)) PetscCall(InfoDirectory(file));
  else PetscCall(InfoHdf5(file));
  PetscFunctionReturn(PETSC_SUCCESS);
}
