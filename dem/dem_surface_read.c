/*
  dem_surface_read.c - a surface from a file: STL as text or binary, or a group of a gmsh file.

  A binary STL is 80 bytes of anything, the number of triangles (4 bytes), then 50 bytes each: normal, three corners, 2
  bytes of anything, little endian. Its length says whether it is one; text begins with "solid" (so do some binary files).
  Normals of the file are not used: its corners tell.
*/
#include "dem_surface.h"
#include "files.h"
#include <stdlib.h>
#include <string.h>

static PetscReal LittleFloat(const unsigned char *b)
{
  const uint32_t bits = (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
  float          value;

  memcpy(&value, &bits, 4);
  return (PetscReal)value;
}

static PetscErrorCode ReadBinary(const char *file, const unsigned char *text, size_t length, PetscInt *n, PetscReal **corner)
{
  size_t told;

  PetscFunctionBegin;
  BaseCheckInput(length >= 84, PETSC_COMM_SELF, "%s: the file is cut short: %lld bytes, and the head of a binary STL alone has 84", file, (long long)length);
  told = (size_t)text[80] | (size_t)text[81] << 8 | (size_t)text[82] << 16 | (size_t)text[83] << 24;
  BaseCheckInput(length == 84 + 50 * told, PETSC_COMM_SELF, "%s: %s: it tells of %lld triangles, which take %lld bytes, and has %lld", file,
                 length < 84 + 50 * told ? "the file is cut short, or no STL" : "no STL, or one with something behind its end", (long long)told, (long long)(84 + 50 * told), (long long)length);
  *n = (PetscInt)told;
  PetscCall(PetscMalloc1(9 * (*n) + 1, corner));
  for (PetscInt t = 0; t < *n; t++)
    for (PetscInt k = 0; k < 9; k++) (*corner)[9 * t + k] = LittleFloat(text + 84 + 50 * t + 12 + 4 * k);
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  const char *at;   /* what is not read yet */
  const char *word; /* [length] the last one */
  size_t      length;
  PetscInt    line;
} Reader;

/* The next word; false at the end. The white space behind it stays. */
static PetscBool NextWord(Reader *r)
{
  while (*r->at == ' ' || *r->at == '\t' || *r->at == '\r' || *r->at == '\n') r->line += *r->at++ == '\n';
  r->word   = r->at;
  r->length = strcspn(r->at, " \t\r\n");
  r->at += r->length;
  return (PetscBool)(r->length > 0);
}

static PetscBool Is(const Reader *r, const char *word)
{
  return (PetscBool)(strlen(word) == r->length && !strncmp(r->word, word, r->length));
}

static PetscErrorCode ReadNumber(const char *file, Reader *r, PetscReal *value)
{
  char  word[64];
  char *end;

  PetscFunctionBegin;
  BaseCheckInput(NextWord(r), PETSC_COMM_SELF, "%s:%" PetscInt_FMT ": the file is cut short within a corner", file, r->line);
  (void)PetscSNPrintf(word, PetscMin(r->length + 1, sizeof(word)), "%s", r->word);
  *value = strtod(word, &end);
  BaseCheckInput(end != word && !*end, PETSC_COMM_SELF, "%s:%" PetscInt_FMT ": '%.40s' is not a number", file, r->line, word);
  BaseCheckInput(!PetscIsInfOrNanReal(*value), PETSC_COMM_SELF, "%s:%" PetscInt_FMT ": a corner has a coordinate that is not a number (%.40s)", file, r->line, word);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "vertex x y z" three times in each facet; the rest of the grammar carries nothing. */
static PetscErrorCode ReadText(const char *file, const char *text, PetscInt *n, PetscReal **corner)
{
  Reader    r = {text, text, 0, 1};
  PetscInt  m = 0, room = 1024, in_facet = 0;
  PetscBool ended = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(3 * room, corner));
  while (NextWord(&r)) {
    if (Is(&r, "solid") || Is(&r, "endsolid")) { /* a name of any words follows, to the end of the line */
      ended = Is(&r, "endsolid");
      r.at += strcspn(r.at, "\n");
      continue;
    }
    ended = PETSC_FALSE;
    if (Is(&r, "facet")) in_facet = 0;
    if (Is(&r, "endfacet")) BaseCheckInput(in_facet == 3, PETSC_COMM_SELF, "%s:%" PetscInt_FMT ": a facet with %" PetscInt_FMT " corners; an STL has triangles only", file, r.line, in_facet);
    if (!Is(&r, "vertex")) continue;
    if (m == room) {
      room *= 2;
      PetscCall(PetscRealloc(3 * (size_t)room * sizeof(PetscReal), corner));
    }
    for (PetscInt d = 0; d < 3; d++) PetscCall(ReadNumber(file, &r, &(*corner)[3 * m + d]));
    m++;
    in_facet++;
  }
  BaseCheckInput(ended, PETSC_COMM_SELF, "%s: the file is cut short (no endsolid at its end, line %" PetscInt_FMT ")", file, r.line);
  BaseCheckInput(m % 3 == 0, PETSC_COMM_SELF, "%s: %" PetscInt_FMT " corners are no whole number of triangles", file, m);
  *n = m / 3;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadStl(const char *file, PetscReal scale, DemSurface *surface)
{
  PetscErrorCode code;
  PetscReal     *corner = NULL;
  PetscInt       n = 0;
  size_t         length, told = 0;
  char          *text;

  PetscFunctionBegin;
  BaseCheckInput(!FileUnfit(file), PETSC_COMM_SELF, "%s: the file %s", file, FileUnfit(file));
  PetscCall(FileReadText(file, &text, &length));
  if (length >= 84) told = (size_t)(unsigned char)text[80] | (size_t)(unsigned char)text[81] << 8 | (size_t)(unsigned char)text[82] << 16 | (size_t)(unsigned char)text[83] << 24;
  if (length == 0) {
    PetscCall(PetscFree(text));
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s: the file is empty", file);
  }
  if (!strncmp(text, "solid", 5) && length != 84 + 50 * told && strlen(text) == length) code = ReadText(file, text, &n, &corner);
  else code = ReadBinary(file, (unsigned char *)text, length, &n, &corner);
  if (!code) {
    for (PetscInt k = 0; k < 9 * n; k++) corner[k] *= scale;
    code = DemSurfaceCreate(file, 3, n, corner, surface);
  }
  PetscCall(PetscFree(corner));
  PetscCall(PetscFree(text));
  PetscFunctionReturn(code);
}

PetscErrorCode DemSurfaceCreateFromMesh(const Mesh *mesh, PetscInt dim, const char *group, DemSurface *surface)
{
  const MeshGroup *g = NULL;
  PetscErrorCode   code;
  PetscReal       *corner;
  PetscInt         n = 0;

  PetscFunctionBegin;
  if (group[0]) {
    PetscCall(MeshFindGroup(mesh, group, &g));
    if (!g) {
      const char **names, *near;

      PetscCall(PetscMalloc1(mesh->n_groups + 1, &names));
      for (PetscInt k = 0; k < mesh->n_groups; k++) names[k] = mesh->group[k].name;
      near = BaseNearest(group, mesh->n_groups, names);
      PetscCall(PetscFree(names));
      SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s: no physical group '%s'%s%s%s", mesh->source, group, near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
    }
    BaseCheckInput(g->dim == dim - 1, PETSC_COMM_SELF, "%s: group '%s' has dimension %" PetscInt_FMT "; a tool of a %" PetscInt_FMT "D scene is made of %s", mesh->source, group, g->dim, dim,
                   dim == 3 ? "surfaces" : "curves");
  }
  PetscCall(PetscMalloc1(18 * mesh->n_cells + 1, &corner));
  for (PetscInt i = 0; i < (g ? g->n_cells : mesh->n_cells); i++) {
    const PetscInt  c = g ? g->cell[i] : i, *node = &mesh->node[mesh->start[c]];
    static const PetscInt split[6] = {0, 1, 2, 0, 2, 3};

    if (MeshCellDim(mesh->type[c]) != dim - 1) continue;
    if (dim == 2) {
      for (PetscInt k = 0; k < 2; k++)
        for (PetscInt d = 0; d < 3; d++) corner[6 * n + 3 * k + d] = mesh->x[3 * node[k] + d];
      n++;
      continue;
    }
    for (PetscInt k = 0; k < (MeshCellCorners(mesh->type[c]) == 4 ? 6 : 3); k++)
      for (PetscInt d = 0; d < 3; d++) corner[9 * n + 3 * k + d] = mesh->x[3 * node[split[k]] + d];
    n += MeshCellCorners(mesh->type[c]) == 4 ? 2 : 1;
  }
  code = DemSurfaceCreate(mesh->source, dim, n, corner, surface);
  PetscCall(PetscFree(corner));
  PetscFunctionReturn(code);
}

PetscErrorCode DemSurfaceRead(MPI_Comm comm, const char *file, PetscInt dim, const char *group, PetscReal scale, PetscReal size, DemSurface *surface)
{
  const size_t      length  = strlen(file);
  const MeshOptions options = {.dimension = dim - 1, .size = size, .order = 1, .scale = scale, .facets = PETSC_TRUE};
  PetscErrorCode    code;
  Mesh              mesh;

  PetscFunctionBegin;
  if (length > 4 && (!strcmp(file + length - 4, ".stl") || !strcmp(file + length - 4, ".STL"))) {
    BaseCheckInput(dim == 3, comm, "%s: an STL holds triangles; a tool of a 2D scene is a curve of a gmsh file", file);
    BaseCheckInput(!group[0], comm, "%s: an STL has no groups; take '%s' out", file, group);
    PetscCall(ReadStl(file, scale, surface));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MeshRead(comm, file, &options, &mesh));
  code = DemSurfaceCreateFromMesh(&mesh, dim, group, surface);
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(code);
}
