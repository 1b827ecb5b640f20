/*
  mesh_gmsh.c - a mesh through the gmsh C API.

  gmsh lives only inside MeshRead, on rank 0. Its errors come back as one message, which all ranks raise together.
  As in the files gmsh writes, only cells of a physical group are kept, so a .geo and its .msh give the same mesh.
*/
#include "files.h"
#include "mesh_gmsh.h"
#include <gmshc.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* gmsh's own last words, after `what`. */
void MeshGmshWords_Internal(char words[BASE_LINE], const char *what, const char *file)
{
  char *text = NULL;
  int   ierr = 0;

  gmshLoggerGetLastError(&text, &ierr);
  (void)PetscSNPrintf(words, BASE_LINE, "%s: gmsh could not %s it: %s", file, what, !ierr && text && text[0] ? text : "no reason given");
  if (!ierr) gmshFree(text);
}

/* The last line of a .msh must end a section; gmsh itself reads some cut files without a word. */
static PetscBool EndsSection(const char *tail, size_t got)
{
  static const char *const section[] = {"MeshFormat", "PhysicalNames", "Entities", "PartitionedEntities", "Nodes", "Elements", "Periodic", "GhostElements", "Parametrizations", "NodeData", "ElementData", "ElementNodeData", "InterpolationScheme", "Comments"};

  while (got > 0 && (tail[got - 1] == '\n' || tail[got - 1] == '\r' || tail[got - 1] == ' ')) got--;
  for (size_t k = 0; k < sizeof(section) / sizeof(section[0]); k++) {
    const size_t n = strlen(section[k]);

    if (got >= n + 4 && !strncmp(&tail[got - n], section[k], n) && !strncmp(&tail[got - n - 4], "$End", 4)) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

static void CheckWhole(const char *file, PetscBool msh, char words[BASE_LINE])
{
  const char *unfit = FileUnfit(file);
  FILE       *in = unfit ? NULL : fopen(file, "rb");
  char        tail[256];
  long        size;

  if (!in) {
    (void)PetscSNPrintf(words, BASE_LINE, "%s: the mesh file %s", file, unfit ? unfit : "cannot be opened");
    return;
  }
  size = fseek(in, 0, SEEK_END) ? -1 : ftell(in);
  if (size <= 0) (void)PetscSNPrintf(words, BASE_LINE, "%s: the file is empty", file);
  else if (msh) {
    (void)fseek(in, size > 256 ? size - 256 : 0, SEEK_SET);
    if (!EndsSection(tail, fread(tail, 1, sizeof(tail), in))) (void)PetscSNPrintf(words, BASE_LINE, "%s: the mesh file is cut short (it does not end with an $End line); write it again", file);
  }
  fclose(in);
}

/*
  gmsh reads a damaged .msh into the ground (a wrong count is a crash, a huge one all memory). A child reads it first: what
  happens to it is a word to the user, not the end of the run. The CPU time it may take grows with the file.
*/
static void TryMsh(const char *file, char words[BASE_LINE])
{
  struct stat info;
  int         status = 0, ierr;
  pid_t       child;

  if (stat(file, &info)) return;
  (void)fflush(NULL); /* what is buffered is the parent's to write */
  child = fork();
  if (child == 0) {
    const struct rlimit none = {0, 0}, seconds = {(rlim_t)(20 + info.st_size / 200000), (rlim_t)(30 + info.st_size / 200000)};
    const int           null = open("/dev/null", O_WRONLY);
    size_t             *tag = NULL, n = 0, m = 0, k = 0;
    double             *x = NULL, *s = NULL;

    for (int number = 1; number < 32; number++) (void)signal(number, SIG_DFL);
    (void)setrlimit(RLIMIT_CORE, &none);
    (void)setrlimit(RLIMIT_CPU, &seconds);
    if (null >= 0) (void)dup2(null, 2);
    gmshInitialize(0, NULL, 0, &ierr);
    gmshOptionSetNumber("General.Terminal", 0, &ierr);
    gmshOpen(file, &ierr);
    if (!ierr) gmshModelMeshGetNodes(&tag, &n, &x, &m, &s, &k, -1, -1, 0, 0, &ierr);
    _exit(0); /* what gmsh itself refuses is told by the parent's own reading */
  }
  if (child < 0) return; /* no room for a child: go on without */
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (WIFSIGNALED(status) || (WIFEXITED(status) && WEXITSTATUS(status)))
    (void)PetscSNPrintf(words, BASE_LINE, "%s: the mesh file is damaged: gmsh %s on it (%s); write it again", file,
                        WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU ? "finds no end" : "breaks", WIFSIGNALED(status) ? strsignal(WTERMSIG(status)) : "out of memory");
}

static PetscBool HasEnding(const char *file, const char *ending)
{
  const size_t n = strlen(file), m = strlen(ending);

  return n > m && !strcmp(&file[n - m], ending) ? PETSC_TRUE : PETSC_FALSE;
}

typedef struct {
  size_t   tag;
  PetscInt type, at; /* gmsh's element type; first entry in the pool of node tags */
  int      dim, entity;
} Cell;

typedef struct {
  MeshGroup group;
  int      *entity; /* gmsh's, sorted, lent by gmsh */
  size_t    n;
} Physical;

/* Everything read so far; freed together. */
typedef struct {
  Physical *physical;
  PetscInt  n_physical;
  Cell     *cell;
  size_t   *pool; /* node tags of all cells */
  PetscInt  n_cells, n_pool;
} Reading;

typedef struct {
  size_t tag;
  size_t at; /* place in gmsh's list */
} Tagged;

static int ByTag(const void *a, const void *b)
{
  const size_t p = ((const Tagged *)a)->tag, q = ((const Tagged *)b)->tag;

  return p < q ? -1 : p > q;
}

static int ByCellTag(const void *a, const void *b)
{
  const size_t p = ((const Cell *)a)->tag, q = ((const Cell *)b)->tag;

  return p < q ? -1 : p > q;
}

static int ByInt(const void *a, const void *b)
{
  const int p = *(const int *)a, q = *(const int *)b;

  return p < q ? -1 : p > q;
}

static int ByDimThenName(const void *a, const void *b)
{
  const MeshGroup *p = &((const Physical *)a)->group, *q = &((const Physical *)b)->group;

  return p->dim != q->dim ? (p->dim < q->dim ? -1 : 1) : strcmp(p->name, q->name);
}

static PetscBool Holds(const Physical *p, int dim, int entity)
{
  return p->group.dim == dim && p->n && bsearch(&entity, p->entity, p->n, sizeof(int), ByInt) ? PETSC_TRUE : PETSC_FALSE;
}

/* Physical groups by name; the words say why when they will not do. */
static PetscErrorCode ReadGroups(Reading *r, const char *file, PetscInt dim, PetscBool facets, char words[BASE_LINE])
{
  int     *pair = NULL, ierr = 0;
  size_t   n    = 0;
  PetscInt top  = 0;

  PetscFunctionBegin;
  gmshModelGetPhysicalGroups(&pair, &n, -1, &ierr);
  PetscCall(PetscCalloc1(n / 2, &r->physical));
  for (size_t k = 0; k < n / 2 && !ierr; k++) {
    Physical *p    = &r->physical[r->n_physical++];
    char     *name = NULL;

    p->group.dim = pair[2 * k];
    if (p->group.dim > top) top = p->group.dim;
    gmshModelGetPhysicalName(pair[2 * k], pair[2 * k + 1], &name, &ierr);
    if (name && name[0]) PetscCall(PetscStrncpy(p->group.name, name, sizeof(p->group.name)));
    else PetscCall(PetscSNPrintf(p->group.name, sizeof(p->group.name), "%d", pair[2 * k + 1])); /* unnamed: its number */
    gmshFree(name);
    if (!ierr) gmshModelGetEntitiesForPhysicalGroup(pair[2 * k], pair[2 * k + 1], &p->entity, &p->n, &ierr);
    if (!ierr && p->n) qsort(p->entity, p->n, sizeof(int), ByInt);
  }
  gmshFree(pair);
  if (ierr) {
    MeshGmshWords_Internal(words, "list the physical groups of", file);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (top < dim || (top > dim && !facets)) {
    static const char *const thing[] = {"point", "curve", "surface", "volume"};

    if (top < dim) PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: no physical group of dimension %d; name the body in the .geo: Physical %s(\"body\") = {...};", file, (int)dim, dim == 3 ? "Volume" : dim == 2 ? "Surface" : "Curve"));
    else PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: it has a physical %s, but the mesh was asked for in %d dimensions", file, thing[PetscMin(top, 3)], (int)dim));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (r->n_physical) qsort(r->physical, r->n_physical, sizeof(*r->physical), ByDimThenName);
  for (PetscInt i = 0; i < r->n_physical; i++)
    for (PetscInt j = 0; j < i; j++)
      if (!words[0] && !strcmp(r->physical[i].group.name, r->physical[j].group.name)) {
        const PetscInt di = r->physical[i].group.dim, dj = r->physical[j].group.dim;

        if (di == dj) PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: two physical groups of dimension %d are named '%s'; give each its own name", file, (int)di, r->physical[i].group.name));
        else PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: '%s' names a physical group of dimension %d and one of dimension %d; give each its own name", file, r->physical[i].group.name, (int)dj, (int)di));
      }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for m more entries in an array of n: grows by doubling whenever n passes a power of two. */
static PetscErrorCode Grow(size_t size, PetscInt n, PetscInt m, void *array)
{
  PetscInt want = 1024;

  PetscFunctionBegin;
  while (want < n + m) want *= 2;
  PetscCall(PetscRealloc(size * want, (void **)array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells of the entities that belong to a physical group. */
static PetscErrorCode ReadCells(Reading *r, const char *file, int most, char words[BASE_LINE])
{
  int   *pair = NULL, ierr = 0;
  size_t n    = 0;

  PetscFunctionBegin;
  gmshModelGetEntities(&pair, &n, -1, &ierr);
  for (size_t k = 0; k < n / 2 && !ierr && !words[0]; k++) {
    const int dim = pair[2 * k], entity = pair[2 * k + 1];
    PetscBool wanted = PETSC_FALSE;
    int      *type   = NULL;
    size_t    n_type = 0, **tag = NULL, *n_tag = NULL, nn_tag = 0, **node = NULL, *n_node = NULL, nn_node = 0;

    for (PetscInt p = 0; p < r->n_physical; p++) wanted = wanted || Holds(&r->physical[p], dim, entity) ? PETSC_TRUE : PETSC_FALSE;
    if (!wanted || dim > most) continue;
    gmshModelMeshGetElements(&type, &n_type, &tag, &n_tag, &nn_tag, &node, &n_node, &nn_node, dim, entity, &ierr);
    for (size_t t = 0; t < n_type && !ierr; t++) {
      if (MeshCellDim((MeshCellType)type[t]) != dim) {
        PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: element %zu is of gmsh type %d, which is not covered; use elements of first or second order", file, n_tag[t] ? tag[t][0] : 0, type[t]));
        break;
      }
      PetscCall(Grow(sizeof(Cell), r->n_cells, (PetscInt)n_tag[t], &r->cell));
      PetscCall(Grow(sizeof(size_t), r->n_pool, (PetscInt)n_node[t], &r->pool));
      for (size_t c = 0; c < n_tag[t]; c++) r->cell[r->n_cells++] = (Cell){tag[t][c], type[t], r->n_pool + (PetscInt)(c * (n_node[t] / n_tag[t])), dim, entity};
      for (size_t c = 0; c < n_node[t]; c++) r->pool[r->n_pool++] = node[t][c];
    }
    for (size_t t = 0; t < nn_tag; t++) gmshFree(tag[t]);
    for (size_t t = 0; t < nn_node; t++) gmshFree(node[t]);
    gmshFree(type);
    gmshFree(tag);
    gmshFree(node);
    gmshFree(n_tag);
    gmshFree(n_node);
  }
  gmshFree(pair);
  if (ierr) MeshGmshWords_Internal(words, "list the elements of", file);
  else if (r->n_cells) qsort(r->cell, r->n_cells, sizeof(Cell), ByCellTag);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes in ascending tag, cells in ascending tag, groups as lists of cells. */
static PetscErrorCode FillMesh(Reading *r, const char *file, PetscReal scale, Mesh *mesh, char words[BASE_LINE])
{
  size_t  *tag = NULL, n = 0, n_x = 0, n_parameter = 0;
  double  *x = NULL, *parameter = NULL;
  Tagged  *sorted;
  PetscInt entries = 0, top = 0;
  int      ierr    = 0;

  PetscFunctionBegin;
  gmshModelMeshGetNodes(&tag, &n, &x, &n_x, &parameter, &n_parameter, -1, -1, 0, 0, &ierr);
  if (ierr) {
    MeshGmshWords_Internal(words, "list the nodes of", file);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(n, &sorted));
  for (size_t k = 0; k < n; k++) sorted[k] = (Tagged){tag[k], k};
  if (n) qsort(sorted, n, sizeof(Tagged), ByTag);
  mesh->n_nodes = (PetscInt)n;
  PetscCall(PetscMalloc2(3 * mesh->n_nodes, &mesh->x, mesh->n_nodes, &mesh->id));
  for (size_t k = 0; k < n; k++) {
    mesh->id[k] = (PetscInt)sorted[k].tag;
    for (PetscInt d = 0; d < 3; d++) {
      mesh->x[3 * k + d] = scale * x[3 * sorted[k].at + d];
      if (PetscIsInfOrNanReal(mesh->x[3 * k + d]) && !words[0]) PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: node %zu has a coordinate that is not a number", file, sorted[k].tag));
    }
  }
  mesh->n_cells = r->n_cells;
  PetscCall(PetscMalloc3(r->n_cells, &mesh->type, r->n_cells, &mesh->cell_id, r->n_cells + 1, &mesh->start));
  PetscCall(PetscMalloc1(r->n_pool, &mesh->node));
  for (PetscInt c = 0; c < r->n_cells; c++) {
    const Cell    *cell  = &r->cell[c];
    const PetscInt nodes = MeshCellNodes((MeshCellType)cell->type);

    mesh->type[c]    = (MeshCellType)cell->type;
    mesh->cell_id[c] = (PetscInt)cell->tag;
    mesh->start[c]   = entries;
    top              = PetscMax(top, cell->dim);
    for (PetscInt a = 0; a < nodes; a++) {
      const Tagged  key = {r->pool[cell->at + a], 0};
      const Tagged *at  = n ? bsearch(&key, sorted, n, sizeof(Tagged), ByTag) : NULL;

      if (!at && !words[0]) PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: element %zu uses node %zu, which the file does not have", file, cell->tag, key.tag));
      mesh->node[entries++] = at ? (PetscInt)(at - sorted) : 0;
    }
  }
  mesh->start[r->n_cells] = entries;
  mesh->dim               = top;
  PetscCall(PetscFree(sorted));
  gmshFree(tag);
  gmshFree(x);
  gmshFree(parameter);
  mesh->n_groups = r->n_physical;
  PetscCall(PetscCalloc1(mesh->n_groups, &mesh->group));
  for (PetscInt g = 0; g < mesh->n_groups; g++) {
    MeshGroup      *group = &mesh->group[g];
    const Physical *p     = &r->physical[g];

    *group = p->group;
    for (PetscInt c = 0; c < r->n_cells; c++) group->n_cells += Holds(p, r->cell[c].dim, r->cell[c].entity);
    PetscCall(PetscMalloc1(group->n_cells, &group->cell));
    group->n_cells = 0;
    for (PetscInt c = 0; c < r->n_cells; c++)
      if (Holds(p, r->cell[c].dim, r->cell[c].entity)) group->cell[group->n_cells++] = c;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Places a file makes repeat each other (its Periodic section, Periodic Curve, Periodic Surface): nothing here would keep their nodes together. */
static void CheckPeriodic(const char *file, char words[BASE_LINE])
{
  static const char *const word[] = {"point", "curve", "surface", "volume"};
  int                     *entity = NULL, ierr;
  size_t                   n = 0;

  gmshModelGetEntities(&entity, &n, -1, &ierr);
  for (size_t k = 0; k + 1 < n && !ierr && !words[0]; k += 2) {
    size_t *node = NULL, *other = NULL, n_node = 0, n_other = 0, n_map = 0;
    double *map    = NULL;
    int     master = entity[k + 1], fails;

    gmshModelMeshGetPeriodicNodes(entity[k], entity[k + 1], &master, &node, &n_node, &other, &n_other, &map, &n_map, 0, &fails);
    if (!fails && master != entity[k + 1])
      (void)PetscSNPrintf(words, BASE_LINE, "%s: %s %d is periodic, it repeats %s %d; a body has no sides that are tied to others: take the periodic section out and mesh again", file, word[entity[k]], entity[k + 1],
                          word[entity[k]], master);
    gmshFree(node);
    gmshFree(other);
    gmshFree(map);
  }
  gmshFree(entity);
}

static void SetOption(const char *name, double value)
{
  int ierr; /* an option this gmsh does not know changes nothing */

  gmshOptionSetNumber(name, value, &ierr);
}

/* Open or draw, mesh when it is a geometry, copy. gmsh is initialised. */
static PetscErrorCode ReadOpened(const char *file, MeshDraw draw, const void *ctx, const MeshOptions *options, Mesh *mesh, char words[BASE_LINE])
{
  const PetscBool msh = HasEnding(file, ".msh");
  Reading         r   = {NULL};
  int             ierr;

  PetscFunctionBegin;
  SetOption("General.Terminal", 0);
  SetOption("General.NumThreads", 1);
  SetOption("Mesh.RandomSeed", 1);
  if (draw) gmshModelAdd(file, &ierr);
  else gmshOpen(file, &ierr);
  if (ierr) MeshGmshWords_Internal(words, draw ? "begin" : "read", file);
  else if (draw) PetscCall(draw(ctx, file, options, words));
  if (!words[0]) PetscCall(ReadGroups(&r, file, options->dimension, options->facets, words));
  if (!words[0] && !msh) {
    /* after the file, which may set options of its own */
    if (options->size > 0) {
      SetOption("Mesh.CharacteristicLengthMin", options->size / options->scale);
      SetOption("Mesh.CharacteristicLengthMax", options->size / options->scale);
    }
    if (options->quads) SetOption("Mesh.RecombineAll", 1);
    SetOption("Mesh.ElementOrder", (double)options->order);
    SetOption("Mesh.SecondOrderIncomplete", options->incomplete ? 1 : 0);
    gmshModelMeshGenerate(options->dimension, &ierr);
    if (ierr) MeshGmshWords_Internal(words, "mesh", file);
  }
  if (!words[0] && !draw) CheckPeriodic(file, words);
  if (!words[0]) PetscCall(ReadCells(&r, file, options->facets ? (int)options->dimension : 3, words));
  if (!words[0]) PetscCall(FillMesh(&r, file, options->scale, mesh, words));
  if (!words[0] && mesh->dim != options->dimension)
    PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: no cell of dimension %d; %s needs a physical %s that is meshed", file, (int)options->dimension, options->facets ? "a tool" : "a body",
                          options->dimension == 3 ? "volume" : options->dimension == 2 ? "surface" : "curve"));
  for (PetscInt p = 0; p < r.n_physical; p++) gmshFree(r.physical[p].entity);
  PetscCall(PetscFree(r.physical));
  PetscCall(PetscFree(r.cell));
  PetscCall(PetscFree(r.pool));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadHere(const char *file, MeshDraw draw, const void *ctx, const MeshOptions *options, Mesh *mesh, char words[BASE_LINE])
{
  struct sigaction interrupt, terminate;
  int              ierr;

  PetscFunctionBegin;
  if (!draw && !HasEnding(file, ".msh") && !HasEnding(file, ".geo") && !HasEnding(file, ".geo_unrolled") && !HasEnding(file, ".step") && !HasEnding(file, ".stp") && !HasEnding(file, ".brep")) {
    PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: a geometry is a gmsh .geo or .msh (or .step, .brep) file", file));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!draw) CheckWhole(file, HasEnding(file, ".msh"), words);
  if (!words[0] && HasEnding(file, ".msh") && !draw) TryMsh(file, words);
  if (words[0]) PetscFunctionReturn(PETSC_SUCCESS);
  (void)sigaction(SIGINT, NULL, &interrupt); /* Ctrl-C stays the run loop's */
  (void)sigaction(SIGTERM, NULL, &terminate);
  gmshInitialize(0, NULL, 0, &ierr);
  if (ierr) PetscCall(PetscSNPrintf(words, BASE_LINE, "%s: gmsh does not start", file));
  else {
    PetscCall(ReadOpened(file, draw, ctx, options, mesh, words));
    gmshFinalize(&ierr);
  }
  (void)sigaction(SIGINT, &interrupt, NULL);
  (void)sigaction(SIGTERM, &terminate, NULL);
  PetscCall(PetscStrncpy(mesh->source, file, sizeof(mesh->source)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MeshRead(MPI_Comm comm, const char *file, const MeshOptions *options, Mesh *mesh)
{
  return MeshFromGmsh_Internal(comm, file, NULL, NULL, options, mesh);
}

PetscErrorCode MeshFromGmsh_Internal(MPI_Comm comm, const char *file, MeshDraw draw, const void *ctx, const MeshOptions *options, Mesh *mesh)
{
  char        words[BASE_LINE] = "";
  PetscMPIInt rank;

  PetscFunctionBegin;
  BaseCheckInput(options->dimension == 2 || options->dimension == 3 || (options->facets && options->dimension == 1), comm, "A mesh has dimension 2 or 3, not %" PetscInt_FMT, options->dimension);
  BaseCheckInput(options->order == 1 || options->order == 2, comm, "Elements have order 1 or 2, not %" PetscInt_FMT, options->order);
  BaseCheckInput(options->size >= 0 && !PetscIsInfOrNanReal(options->size), comm, "An element size of %g m must be positive, or 0 to leave it to the .geo", (double)options->size);
  BaseCheckInput(options->scale > 0 && !PetscIsInfOrNanReal(options->scale), comm, "A length unit of %g m must be positive", (double)options->scale);
  PetscCall(PetscMemzero(mesh, sizeof(*mesh)));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) PetscCall(ReadHere(file, draw, ctx, options, mesh, words));
  PetscCallMPI(MPI_Bcast(words, BASE_LINE, MPI_CHAR, 0, comm));
  if (words[0]) PetscCall(MeshDestroy(mesh));
  BaseCheckInput(!words[0], comm, "%s", words);
  PetscFunctionReturn(PETSC_SUCCESS);
}
