/*
  output_vtu.c - what ParaView opens: vtu/BLOCK_000012.vtu and BLOCK.pvd.

  VTK XML, unstructured grid, appended raw data (each array: UInt64 bytes, then the numbers), Float64 fields, Int64 cells.
  Source: The VTK User's Guide, file formats; checked against VTK's own reader by tests/base/read_frames.py.
*/
#include "output_impl.h"
#include <string.h>
#include <unistd.h>

#define REAL_TYPE (sizeof(PetscReal) == 8 ? "Float64" : "Float32")

static const char *ByteOrder(void)
{
  const uint16_t one = 1;

  return *(const unsigned char *)&one ? "LittleEndian" : "BigEndian";
}

static void Escape(FILE *file, const char *text)
{
  for (; *text; text++) {
    if (*text == '<') fputs("&lt;", file);
    else if (*text == '>') fputs("&gt;", file);
    else if (*text == '&') fputs("&amp;", file);
    else if (*text == '"') fputs("&quot;", file);
    else fputc(*text, file);
  }
}

/* Header of one appended array; moves the offset past its data. */
static void Declare(FILE *file, const char *type, const char *name, PetscInt components, const char *unit, uint64_t bytes, uint64_t *offset)
{
  fprintf(file, "<DataArray type=\"%s\" Name=\"", type);
  Escape(file, name);
  fprintf(file, "\" NumberOfComponents=\"%" PetscInt_FMT "\" format=\"appended\" offset=\"%llu\"", components, (unsigned long long)*offset);
  if (unit && unit[0]) {
    fputs("><InformationKey name=\"UNITS_LABEL\" location=\"vtkDataArray\">", file);
    Escape(file, unit);
    fputs("</InformationKey></DataArray>\n", file);
  } else fputs("/>\n", file);
  *offset += sizeof(uint64_t) + bytes;
}

static void Append(FILE *file, const void *data, uint64_t bytes)
{
  fwrite(&bytes, sizeof(bytes), 1, file);
  if (bytes) fwrite(data, 1, bytes, file);
}

/* PetscInt as Int64, whatever its width. */
static void AppendInt(FILE *file, const PetscInt data[], PetscInt n)
{
  const uint64_t bytes = sizeof(int64_t) * (uint64_t)n;
  int64_t        buffer[1024];

  fwrite(&bytes, sizeof(bytes), 1, file);
  for (PetscInt k = 0; k < n;) {
    size_t m = 0;

    while (k < n && m < 1024) buffer[m++] = data[k++];
    fwrite(buffer, sizeof(int64_t), m, file);
  }
}

static uint64_t ArrayBytes(const OutputBlock *block, const OutputArray *array)
{
  return sizeof(PetscReal) * (uint64_t)array->components * (uint64_t)(array->place == OUTPUT_POINT_DATA ? block->n_points : block->n_cells);
}

static void WriteFile(FILE *file, const OutputBlock *block, PetscReal time)
{
  const PetscInt entries = block->n_cells ? block->start[block->n_cells] : 0;
  uint64_t       offset  = 0;

  fprintf(file, "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"%s\" header_type=\"UInt64\">\n<UnstructuredGrid>\n", ByteOrder());
  fprintf(file, "<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">%.17g</DataArray></FieldData>\n", (double)time);
  fprintf(file, "<Piece NumberOfPoints=\"%" PetscInt_FMT "\" NumberOfCells=\"%" PetscInt_FMT "\">\n", block->n_points, block->n_cells);
  for (int place = OUTPUT_POINT_DATA; place <= OUTPUT_CELL_DATA; place++) {
    const char *section = place == OUTPUT_POINT_DATA ? "PointData" : "CellData";

    fprintf(file, "<%s>\n", section);
    for (PetscInt k = 0; k < block->n_arrays; k++) {
      const OutputArray *a = &block->array[k];

      if ((int)a->place == place) Declare(file, REAL_TYPE, a->name, a->components, a->unit, ArrayBytes(block, a), &offset);
    }
    fprintf(file, "</%s>\n", section);
  }
  fputs("<Points>\n", file);
  Declare(file, REAL_TYPE, "Points", 3, NULL, 3 * sizeof(PetscReal) * (uint64_t)block->n_points, &offset);
  fputs("</Points>\n<Cells>\n", file);
  Declare(file, "Int64", "connectivity", 1, NULL, sizeof(int64_t) * (uint64_t)entries, &offset);
  Declare(file, "Int64", "offsets", 1, NULL, sizeof(int64_t) * (uint64_t)block->n_cells, &offset);
  Declare(file, "UInt8", "types", 1, NULL, (uint64_t)block->n_cells, &offset);
  fputs("</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_", file);
  for (int place = OUTPUT_POINT_DATA; place <= OUTPUT_CELL_DATA; place++)
    for (PetscInt k = 0; k < block->n_arrays; k++)
      if ((int)block->array[k].place == place) Append(file, block->array[k].data, ArrayBytes(block, &block->array[k]));
  Append(file, block->x, 3 * sizeof(PetscReal) * (uint64_t)block->n_points);
  AppendInt(file, block->node, entries);
  AppendInt(file, block->n_cells ? block->start + 1 : NULL, block->n_cells);
  Append(file, block->type, (uint64_t)block->n_cells);
  fputs("\n</AppendedData>\n</VTKFile>\n", file);
}

PetscErrorCode OutputVtuBlock(Output output, const OutputBlock *block)
{
  char  path[BASE_LINE], part[BASE_LINE];
  FILE *file;

  PetscFunctionBegin;
  PetscCall(OutputPath(output, path, "vtu/%s_%06" PetscInt_FMT ".vtu", block->name, output->now.number));
  PetscCall(OutputPath(output, part, "vtu/%s_%06" PetscInt_FMT ".vtu.part", block->name, output->now.number));
  PetscCall(FileOpen(part, "wb", &file));
  WriteFile(file, block, output->now.time);
  PetscCall(FileClose(&file, part));
  PetscCall(FileCommit(part, path, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputVtuIndex(Output output, const char *block)
{
  char     path[BASE_LINE], part[BASE_LINE];
  FILE    *file;
  PetscInt n = 0;

  PetscFunctionBegin;
  PetscCall(OutputPath(output, path, "%s.pvd", block));
  PetscCall(OutputPath(output, part, "%s.pvd.part", block));
  PetscCall(FileOpen(part, "w", &file));
  fprintf(file, "<?xml version=\"1.0\"?>\n<!-- cleave -->\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"%s\">\n<Collection>\n", ByteOrder());
  for (PetscInt f = 0; f < output->n_frames; f++)
    for (PetscInt b = 0; b < output->frame[f].n_blocks; b++) {
      if (strcmp(output->frame[f].block[b].name, block)) continue;
      fprintf(file, "<DataSet timestep=\"%.17g\" part=\"0\" file=\"vtu/", (double)output->frame[f].time);
      Escape(file, block);
      fprintf(file, "_%06" PetscInt_FMT ".vtu\"/>\n", output->frame[f].number);
      n++;
    }
  fputs("</Collection>\n</VTKFile>\n", file);
  PetscCall(FileClose(&file, part));
  if (n) PetscCall(FileCommit(part, path, PETSC_FALSE));
  else {
    unlink(part);
    unlink(path);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
