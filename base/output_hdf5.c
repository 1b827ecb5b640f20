/*
  output_hdf5.c - fields.h5, an index over one HDF5 file per frame.

    fields.h5            /frames/000012 -> fields/000012.h5 (external link)
    fields/000012.h5     time [s], step (attributes of the root)
      <block>/points     [n][3] [m], undeformed
      <block>/cell_start [n_cells + 1], cell_node [...], cell_type [n_cells] VTK's numbers
      <block>/point_data/<array>, <block>/cell_data/<array>   [n] or [n][components], attribute `unit`

  HDF5 follows the links by itself, so a reader sees one tree /frames/000012/beam/points. Geometry that did not change is
  a link to the frame that holds it. One file per frame because HDF5 1.10 has no journal: a kill or a full disk while
  metadata are flushed makes a whole file unreadable. So at worst the frame in hand is lost.
*/
#include "output_impl.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const geometry_name[OUTPUT_GEOMETRY] = {"points", "cell_start", "cell_node", "cell_type"};

/* 64 bits that tell contents apart; the length is part of them. */
static uint64_t Hash(const void *data, size_t bytes)
{
  const unsigned char *byte = data;
  uint64_t             hash = 0x9e3779b97f4a7c15u ^ bytes, word;

  for (; bytes >= 8; bytes -= 8, byte += 8) {
    memcpy(&word, byte, 8);
    hash = (hash ^ word) * 0xff51afd7ed558ccdu;
    hash ^= hash >> 32;
  }
  for (; bytes; bytes--) {
    hash = (hash ^ *byte++) * 0xff51afd7ed558ccdu;
    hash ^= hash >> 32;
  }
  return hash;
}

PetscErrorCode OutputHdf5Begin(Output output)
{
  char          path[BASE_LINE];
  const double  time = (double)output->now.time;
  const int64_t step = output->now.step;

  PetscFunctionBegin;
  PetscCall(OutputPath(output, path, "fields/%06" PetscInt_FMT ".h5.part", output->now.number));
  PetscCall(Hdf5Create(path, &output->file));
  PetscCall(Hdf5WriteAttribute(output->file, "time", path, H5T_NATIVE_DOUBLE, 0, &time));
  PetscCall(Hdf5WriteAttribute(output->file, "step", path, H5T_NATIVE_INT64, 0, &step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One part of the geometry: written, or linked to where it was written before. */
static PetscErrorCode WriteGeometry(Output output, hid_t group, const char *block, const OutputBlockRecord *before, OutputGeometry part, hid_t type, hsize_t rows,
                                    hsize_t columns, const void *data, const char *unit, OutputBlockRecord *record)
{
  PetscFunctionBegin;
  record->hash[part] = Hash(data, rows * PetscMax(columns, 1) * H5Tget_size(type));
  if (before && before->hash[part] == record->hash[part]) {
    char file[64], object[2 * OUTPUT_NAME];

    record->home[part] = before->home[part];
    PetscCall(BaseFormat(file, "%06" PetscInt_FMT ".h5", before->home[part]));
    PetscCall(BaseFormat(object, "/%s/%s", block, geometry_name[part]));
    Hdf5Check(H5Lcreate_external(file, object, group, geometry_name[part], H5P_DEFAULT, H5P_DEFAULT), output->directory, "link '%s'", object);
  } else {
    record->home[part] = output->now.number;
    PetscCall(Hdf5Write(group, geometry_name[part], output->directory, type, rows, columns, data, unit));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputHdf5Block(Output output, const OutputBlock *block, OutputBlockRecord *record)
{
  const OutputBlockRecord *before  = OutputFindBlock(output, block->name);
  const PetscInt           zero    = 0;
  const PetscInt           entries = block->n_cells ? block->start[block->n_cells] : 0;
  int64_t                  home[OUTPUT_GEOMETRY];
  hid_t                    group;

  PetscFunctionBegin;
  PetscCall(Hdf5Group(output->file, block->name, output->directory, &group));
  PetscCall(WriteGeometry(output, group, block->name, before, OUTPUT_POINTS, HDF5_REAL, (hsize_t)block->n_points, 3, block->x, "m", record));
  PetscCall(WriteGeometry(output, group, block->name, before, OUTPUT_CELL_START, HDF5_INT, (hsize_t)block->n_cells + 1, 0, block->n_cells ? block->start : &zero, NULL, record));
  PetscCall(WriteGeometry(output, group, block->name, before, OUTPUT_CELL_NODE, HDF5_INT, (hsize_t)entries, 0, block->node, NULL, record));
  PetscCall(WriteGeometry(output, group, block->name, before, OUTPUT_CELL_TYPE, H5T_NATIVE_UCHAR, (hsize_t)block->n_cells, 0, block->type, NULL, record));
  for (int k = 0; k < OUTPUT_GEOMETRY; k++) home[k] = record->home[k];
  PetscCall(Hdf5WriteAttribute(group, "geometry_frame", output->directory, H5T_NATIVE_INT64, OUTPUT_GEOMETRY, home));
  PetscCall(Hdf5WriteAttribute(group, "geometry_hash", output->directory, H5T_NATIVE_UINT64, OUTPUT_GEOMETRY, record->hash));
  for (PetscInt k = 0; k < block->n_arrays; k++) {
    const OutputArray *a = &block->array[k];
    char               name[2 * OUTPUT_NAME];

    PetscCall(BaseFormat(name, "%s/%s", a->place == OUTPUT_POINT_DATA ? "point_data" : "cell_data", a->name));
    PetscCall(Hdf5Write(group, name, output->directory, HDF5_REAL, (hsize_t)(a->place == OUTPUT_POINT_DATA ? block->n_points : block->n_cells),
                        a->components > 1 ? (hsize_t)a->components : 0, a->data, a->unit ? a->unit : ""));
  }
  Hdf5Check(H5Gclose(group), output->directory, "close block '%s'", block->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputHdf5End(Output output)
{
  char   path[BASE_LINE], part[BASE_LINE];
  herr_t status;

  PetscFunctionBegin;
  PetscCall(OutputPath(output, path, "fields/%06" PetscInt_FMT ".h5", output->now.number));
  PetscCall(OutputPath(output, part, "fields/%06" PetscInt_FMT ".h5.part", output->now.number));
  status       = H5Fclose(output->file);
  output->file = -1;
  Hdf5Check(status, path, "finish the frame");
  PetscCall(FileSeal(part));
  PetscCall(FileCommit(part, path, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputHdf5Index(Output output)
{
  char   path[BASE_LINE], part[BASE_LINE];
  hid_t  file, frames;
  herr_t status = 0;

  PetscFunctionBegin;
  PetscCall(OutputPath(output, path, "fields.h5"));
  PetscCall(OutputPath(output, part, "fields.h5.part"));
  PetscCall(Hdf5Create(part, &file));
  PetscCall(Hdf5WriteText(file, "layout", part, "cleave fields 1"));
  PetscCall(Hdf5Group(file, "frames", part, &frames));
  for (PetscInt f = 0; f < output->n_frames && status >= 0; f++) {
    char name[64], target[64];

    PetscCall(BaseFormat(name, "%06" PetscInt_FMT, output->frame[f].number));
    PetscCall(BaseFormat(target, "fields/%06" PetscInt_FMT ".h5", output->frame[f].number));
    status = H5Lcreate_external(target, "/", frames, name, H5P_DEFAULT, H5P_DEFAULT);
  }
  if (H5Gclose(frames) < 0) status = -1;
  if (H5Fclose(file) < 0) status = -1;
  Hdf5Check(status, part, "write the index of frames");
  PetscCall(FileSeal(part));
  PetscCall(FileCommit(part, path, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static herr_t ReadAttribute(hid_t where, const char *name, hid_t type, hssize_t n, void *data)
{
  const hid_t attribute = H5Aopen(where, name, H5P_DEFAULT);
  hid_t       space;
  herr_t      status = -1;

  if (attribute < 0) return -1;
  space = H5Aget_space(attribute);
  if (H5Sget_simple_extent_npoints(space) == n) status = H5Aread(attribute, type, data);
  H5Sclose(space);
  H5Aclose(attribute);
  return status;
}

/* Callback of H5Literate: one block of a frame's file. */
static herr_t ScanBlock(hid_t file, const char *name, const H5L_info_t *info, void *context)
{
  OutputFrame       *frame = context;
  OutputBlockRecord *grown;
  int64_t            home[OUTPUT_GEOMETRY];
  hid_t              group;
  herr_t             status;

  if (strlen(name) >= OUTPUT_NAME) return -1;
  group = H5Gopen2(file, name, H5P_DEFAULT);
  if (group < 0) return -1;
  grown = realloc(frame->block, sizeof(*grown) * (size_t)(frame->n_blocks + 1));
  if (!grown) return -1;
  frame->block = grown;
  memset(&grown[frame->n_blocks], 0, sizeof(*grown));
  strcpy(grown[frame->n_blocks].name, name);
  status = ReadAttribute(group, "geometry_frame", H5T_NATIVE_INT64, OUTPUT_GEOMETRY, home);
  if (status >= 0) status = ReadAttribute(group, "geometry_hash", H5T_NATIVE_UINT64, OUTPUT_GEOMETRY, grown[frame->n_blocks].hash);
  for (int k = 0; k < OUTPUT_GEOMETRY; k++) grown[frame->n_blocks].home[k] = status >= 0 ? (PetscInt)home[k] : -1;
  frame->n_blocks++;
  H5Gclose(group);
  return status < 0 ? -1 : 0;
}

static herr_t ScanFrame(Output output, PetscInt number, OutputFrame *frame)
{
  PetscBool whole;
  char    path[BASE_LINE];
  hid_t   file;
  herr_t  status;
  double  time;
  int64_t step;

  memset(frame, 0, sizeof(*frame));
  if (OutputPath(output, path, "fields/%06" PetscInt_FMT ".h5", number) || FileIsSealed(path, &whole) || !whole) return -1;
  file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
  if (file < 0) return -1;
  status = ReadAttribute(file, "time", H5T_NATIVE_DOUBLE, 1, &time);
  if (status >= 0) status = ReadAttribute(file, "step", H5T_NATIVE_INT64, 1, &step);
  if (status >= 0) status = H5Literate(file, H5_INDEX_NAME, H5_ITER_INC, NULL, ScanBlock, frame);
  H5Fclose(file);
  if (status < 0) return -1;
  frame->number = number;
  frame->time   = time;
  frame->step   = (PetscInt)step;
  return 0;
}

static herr_t CountLink(hid_t group, const char *name, const H5L_info_t *info, void *context)
{
  PetscInt *list = context; /* list[0] counts, then the numbers */

  list[++list[0]] = (PetscInt)atol(name);
  return 0;
}

static int CompareInt(const void *a, const void *b)
{
  const PetscInt x = *(const PetscInt *)a, y = *(const PetscInt *)b;

  return (x > y) - (x < y);
}

/* Frames are kept up to the first that cannot be read: after a power cut the last ones may be missing. */
PetscErrorCode OutputHdf5Scan(Output output)
{
  char       path[BASE_LINE];
  PetscInt  *list;
  H5G_info_t info;
  hid_t      file, frames;
  herr_t     status;
  PetscBool  whole;

  PetscFunctionBegin;
  Hdf5Quiet();
  PetscCall(OutputPath(output, path, "fields.h5"));
  if (access(path, F_OK)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FileIsSealed(path, &whole));
  BaseCheckInput(whole, PETSC_COMM_SELF, "'%s' cannot be read as an index of frames of cleave: it is cut short, damaged, or another kind of file; run without resuming", path);
  file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
  BaseCheckInput(file >= 0, PETSC_COMM_SELF, "'%s' cannot be read as HDF5; run without resuming", path);
  frames = H5Gopen2(file, "frames", H5P_DEFAULT);
  status = frames < 0 ? -1 : H5Gget_info(frames, &info);
  if (frames < 0 || status < 0) H5Fclose(file);
  BaseCheckInput(status >= 0, PETSC_COMM_SELF, "'%s' is not an index of frames; run without resuming", path);
  PetscCall(PetscCalloc1(info.nlinks + 1, &list));
  H5Literate(frames, H5_INDEX_NAME, H5_ITER_INC, NULL, CountLink, list);
  H5Gclose(frames);
  H5Fclose(file);
  qsort(list + 1, (size_t)list[0], sizeof(*list), CompareInt);
  for (PetscInt k = 1; k <= list[0]; k++) {
    OutputFrame frame;

    if (ScanFrame(output, list[k], &frame) < 0) {
      OutputFreeFrame(&frame);
      break;
    }
    PetscCall(OutputAppendFrame(output, &frame));
  }
  PetscCall(PetscFree(list));
  PetscFunctionReturn(PETSC_SUCCESS);
}
