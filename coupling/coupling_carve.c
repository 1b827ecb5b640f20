/*
  coupling_carve.c - the particles that are awake: a part of one packing, with its cells as they are.  Section 8 of docs/theory.md

  The region that may turn into particles has one packing and one set of cells for the whole run. Awake are the particles
  whose centre lies in the particles' own cells or in the overlap. A facet between an awake and a sleeping one becomes a facet of
  the rim, where the elements' motion completes the cell (6.6); it must lie in an element of the overlap, so particles whose open
  facets stick out are laid to sleep again. Cells keep their order, so a bond keeps its two ends in order too.
*/
#include "coupling_switch.h"

/* Uniform grid over the mesh: which cells' boxes touch a bin. */
typedef struct {
  PetscInt  n[3], *start, *cell;
  PetscReal low[3], width[3];
} Bins;

static void CellBox(const Mesh *mesh, PetscInt c, PetscReal low[3], PetscReal high[3])
{
  for (PetscInt d = 0; d < 3; d++) {
    low[d]  = PETSC_MAX_REAL;
    high[d] = -PETSC_MAX_REAL;
    for (PetscInt k = mesh->start[c]; k < mesh->start[c + 1]; k++) {
      low[d]  = PetscMin(low[d], mesh->x[3 * mesh->node[k] + d]);
      high[d] = PetscMax(high[d], mesh->x[3 * mesh->node[k] + d]);
    }
  }
}

static PetscInt Bin(const Bins *bins, PetscInt d, PetscReal x)
{
  const PetscInt i = bins->width[d] > 0 ? (PetscInt)PetscFloorReal((x - bins->low[d]) / bins->width[d]) : 0;

  return PetscMax(0, PetscMin(bins->n[d] - 1, i));
}

static PetscErrorCode BinsCreate(const Mesh *mesh, Bins *bins)
{
  PetscReal high[3];
  PetscInt  tops = 0, total, *fill;

  PetscFunctionBegin;
  for (PetscInt d = 0; d < 3; d++) {
    bins->low[d] = PETSC_MAX_REAL;
    high[d]      = -PETSC_MAX_REAL;
    for (PetscInt i = 0; i < mesh->n_nodes; i++) {
      bins->low[d] = PetscMin(bins->low[d], mesh->x[3 * i + d]);
      high[d]      = PetscMax(high[d], mesh->x[3 * i + d]);
    }
  }
  for (PetscInt c = 0; c < mesh->n_cells; c++) tops += MeshCellDim(mesh->type[c]) == mesh->dim;
  for (PetscInt d = 0; d < 3; d++) {
    bins->n[d]     = d < mesh->dim ? PetscMax(1, (PetscInt)PetscPowReal((PetscReal)tops, 1.0 / mesh->dim)) : 1;
    bins->width[d] = (high[d] - bins->low[d]) / bins->n[d];
  }
  total = bins->n[0] * bins->n[1] * bins->n[2];
  PetscCall(PetscCalloc1(total + 2, &bins->start));
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt c = 0; c < mesh->n_cells; c++) {
      PetscReal low[3], top[3];

      if (MeshCellDim(mesh->type[c]) != mesh->dim) continue;
      CellBox(mesh, c, low, top);
      for (PetscInt k = Bin(bins, 2, low[2]); k <= Bin(bins, 2, top[2]); k++)
        for (PetscInt j = Bin(bins, 1, low[1]); j <= Bin(bins, 1, top[1]); j++)
          for (PetscInt i = Bin(bins, 0, low[0]); i <= Bin(bins, 0, top[0]); i++) {
            const PetscInt b = i + bins->n[0] * (j + bins->n[1] * k);

            if (pass) bins->cell[fill[b]++] = c;
            else bins->start[b + 1]++;
          }
    }
    if (pass) break;
    for (PetscInt b = 0; b < total; b++) bins->start[b + 1] += bins->start[b];
    PetscCall(PetscMalloc1(bins->start[total], &bins->cell));
    PetscCall(PetscMalloc1(total, &fill));
    PetscCall(PetscArraycpy(fill, bins->start, total));
  }
  PetscCall(PetscFree(fill));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cell a point lies in, or, by a hair outside all of them, the nearest in its own measure; -1 when none is within 1e-6. */
static PetscErrorCode Home(const Mesh *mesh, const Bins *bins, const PetscReal point[3], PetscInt *home)
{
  const PetscInt b = Bin(bins, 0, point[0]) + bins->n[0] * (Bin(bins, 1, point[1]) + bins->n[1] * Bin(bins, 2, point[2]));
  PetscReal      least = 1e-6;

  PetscFunctionBegin;
  *home = -1;
  for (PetscInt k = bins->start[b]; k < bins->start[b + 1] && (*home < 0 || least > 0); k++) {
    const PetscInt c = bins->cell[k], n = mesh->start[c + 1] - mesh->start[c];
    PetscReal      x[FEM_MAX_NODES][3], N[FEM_MAX_NODES], dN[FEM_MAX_NODES][3], low[3], high[3], outside;
    PetscBool      near = PETSC_TRUE;

    CellBox(mesh, c, low, high);
    for (PetscInt d = 0; d < mesh->dim; d++) {
      const PetscReal slack = 2e-6 * (high[d] - low[d]);

      near = (PetscBool)(near && point[d] >= low[d] - slack && point[d] <= high[d] + slack);
    }
    if (!near) continue;
    for (PetscInt a = 0; a < n; a++)
      for (PetscInt d = 0; d < 3; d++) x[a][d] = mesh->x[3 * mesh->node[mesh->start[c] + a] + d];
    PetscCall(CouplingShapes_Internal(mesh->type[c], &x[0][0], mesh->dim, point, N, dN, &outside));
    if (outside > least || (*home >= 0 && outside >= least)) continue;
    *home = c;
    least = outside;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingHomes_Internal(const Mesh *whole, const DemPacking *packing, const DemCells *cells, PetscInt **particle, PetscInt **facet)
{
  Bins     bins;
  PetscInt lost = -1;

  PetscFunctionBegin;
  PetscCall(BinsCreate(whole, &bins));
  PetscCall(PetscMalloc1(packing->n, particle));
  PetscCall(PetscMalloc1(cells->n_facets, facet));
  for (PetscInt p = 0; p < packing->n; p++) {
    PetscCall(Home(whole, &bins, &packing->x[3 * p], &(*particle)[p]));
    if ((*particle)[p] < 0 && lost < 0) lost = p;
  }
  for (PetscInt f = 0; f < cells->n_facets; f++) PetscCall(Home(whole, &bins, &cells->at[3 * f], &(*facet)[f]));
  PetscCall(PetscFree(bins.start));
  PetscCall(PetscFree(bins.cell));
  BaseCheckInput(lost < 0, PETSC_COMM_SELF, "Particle %" PetscInt_FMT " of the packing, at (%.6g, %.6g, %.6g) m, lies in no element of %s", lost, (double)packing->x[3 * lost], (double)packing->x[3 * lost + 1],
                 (double)packing->x[3 * lost + 2], whole->source);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  awake [packing->n]: centre in a cell of ring 0 .. width, every open facet in a cell of ring 1 .. width

  Particles on the region's own rim sleep for good: that boundary follows the elements, corner by corner, and leaves slivers of cells (one
  took the step of a notched beam from 88 to 17 ns).
*/
static PetscErrorCode Wake(const CouplingWhole *w, const PetscInt ring[], PetscBool awake[])
{
  const DemCells *cells = w->cells;
  PetscBool       changed = PETSC_TRUE;
  PetscInt        rim;

  PetscFunctionBegin;
  PetscCall(DemBodyFindFace(w->body, COUPLING_RIM, &rim));
  for (PetscInt p = 0; p < cells->n; p++) awake[p] = (PetscBool)(ring[w->home[p]] >= 0);
  for (PetscInt k = 0; k < cells->n_walls; k++)
    if (cells->wall_face[k] == rim) awake[cells->wall_p[k]] = PETSC_FALSE;
  while (changed) {
    changed = PETSC_FALSE;
    for (PetscInt f = 0; f < cells->n_facets; f++) {
      const PetscInt p = cells->p[f], q = cells->q[f];

      if (awake[p] == awake[q] || (w->facet_home[f] >= 0 && ring[w->facet_home[f]] > 0)) continue;
      awake[p] = awake[q] = PETSC_FALSE;
      changed  = PETSC_TRUE;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  PetscInt p, from; /* awake particle; wall >= 0 of the whole, or -1 - facet */
} Wall;

static int CompareWalls(const void *a, const void *b)
{
  const Wall *v = a, *w = b;

  if (v->p != w->p) return v->p < w->p ? -1 : 1;
  if ((v->from >= 0) != (w->from >= 0)) return v->from >= 0 ? -1 : 1;
  return v->from >= 0 ? (v->from > w->from) - (v->from < w->from) : (v->from < w->from) - (v->from > w->from);
}

static PetscErrorCode CarveWalls(const CouplingWhole *w, const PetscInt index[], PetscInt rim, CouplingCarved *out)
{
  const DemCells *cells = w->cells;
  DemCells       *c = &out->cells;
  Wall           *wall;
  PetscInt        n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(cells->n_walls + cells->n_facets, &wall));
  for (PetscInt k = 0; k < cells->n_walls; k++)
    if (index[cells->wall_p[k]] >= 0) wall[n++] = (Wall){cells->wall_p[k], k};
  for (PetscInt f = 0; f < cells->n_facets; f++)
    if ((index[cells->p[f]] >= 0) != (index[cells->q[f]] >= 0)) wall[n++] = (Wall){index[cells->p[f]] >= 0 ? cells->p[f] : cells->q[f], -1 - f};
  qsort(wall, n, sizeof(*wall), CompareWalls);
  c->n_walls = n;
  PetscCall(PetscMalloc1(n, &c->wall_p));
  PetscCall(PetscMalloc1(n, &c->wall_face));
  PetscCall(PetscMalloc1(n, &c->wall_area));
  PetscCall(PetscMalloc1(3 * n, &c->wall_at));
  PetscCall(PetscMalloc1(3 * n, &c->wall_normal));
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt from = wall[k].from, f = -1 - from;

    c->wall_p[k]    = index[wall[k].p];
    c->wall_face[k] = from >= 0 ? cells->wall_face[from] : rim;
    c->wall_area[k] = from >= 0 ? cells->wall_area[from] : cells->area[f];
    PetscReal length = 0;

    for (PetscInt d = 0; d < 3; d++) {
      c->wall_at[3 * k + d] = from >= 0 ? cells->wall_at[3 * from + d] : cells->at[3 * f + d];
      if (from >= 0) c->wall_normal[3 * k + d] = cells->wall_normal[3 * from + d];
      else {
        c->wall_normal[3 * k + d] = (wall[k].p == cells->p[f] ? 1 : -1) * (w->packing->x[3 * cells->q[f] + d] - w->packing->x[3 * cells->p[f] + d]);
        length += PetscSqr(c->wall_normal[3 * k + d]);
      }
    }
    for (PetscInt d = 0; d < 3 && from < 0; d++) c->wall_normal[3 * k + d] /= PetscSqrtReal(length);
  }
  PetscCall(PetscFree(wall));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CarveFacets(const CouplingWhole *w, const PetscInt index[], CouplingCarved *out)
{
  const DemCells *cells = w->cells;
  DemCells       *c = &out->cells;
  PetscInt        corners = 0;

  PetscFunctionBegin;
  for (PetscInt f = 0; f < cells->n_facets; f++) {
    if (index[cells->p[f]] < 0 || index[cells->q[f]] < 0) continue;
    c->n_facets++;
    if (cells->facet_start) corners += cells->facet_start[f + 1] - cells->facet_start[f];
  }
  PetscCall(PetscMalloc1(c->n_facets, &c->p));
  PetscCall(PetscMalloc1(c->n_facets, &c->q));
  PetscCall(PetscMalloc1(c->n_facets, &c->area));
  PetscCall(PetscMalloc1(3 * c->n_facets, &c->at));
  PetscCall(PetscMalloc1(c->n_facets, &out->facet));
  if (cells->facet_start) {
    PetscCall(PetscMalloc1(c->n_facets + 1, &c->facet_start));
    PetscCall(PetscMalloc1(3 * corners, &c->corner));
    c->facet_start[0] = 0;
  }
  for (PetscInt f = 0, k = 0; f < cells->n_facets; f++) {
    if (index[cells->p[f]] < 0 || index[cells->q[f]] < 0) continue;
    c->p[k]       = index[cells->p[f]];
    c->q[k]       = index[cells->q[f]];
    c->area[k]    = cells->area[f];
    out->facet[k] = f;
    for (PetscInt d = 0; d < 3; d++) c->at[3 * k + d] = cells->at[3 * f + d];
    if (cells->facet_start) {
      const PetscInt n = cells->facet_start[f + 1] - cells->facet_start[f];

      PetscCall(PetscArraycpy(c->corner + 3 * c->facet_start[k], cells->corner + 3 * cells->facet_start[f], 3 * n));
      c->facet_start[k + 1] = c->facet_start[k] + n;
    }
    k++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingCarve_Internal(const CouplingWhole *w, const PetscInt ring[], CouplingCarved *out)
{
  const DemCells *cells = w->cells;
  PetscBool      *awake;
  PetscInt       *index, n = 0, rim;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(out, sizeof(*out)));
  PetscCall(PetscMalloc2(cells->n, &awake, cells->n, &index));
  PetscCall(Wake(w, ring, awake));
  for (PetscInt p = 0; p < cells->n; p++) {
    BaseCheckInput(awake[p] || ring[w->home[p]] != 0, PETSC_COMM_SELF, "Particle %" PetscInt_FMT " reaches from the particles' own cells across the whole overlap; use smaller particles, or a wider overlap", p);
    index[p] = awake[p] ? n++ : -1;
  }
  BaseCheckInput(n > 0, PETSC_COMM_SELF, "No particle of the packing lies in the cells that are particles from the start; they are smaller than a particle");
  out->packing.n = out->cells.n = n;
  PetscCall(PetscMalloc1(n, &out->particle));
  PetscCall(PetscMalloc1(3 * n, &out->packing.x));
  PetscCall(PetscMalloc1(n, &out->packing.r));
  PetscCall(PetscMalloc1(n, &out->cells.volume));
  PetscCall(PetscMalloc1(3 * n, &out->cells.centroid));
  for (PetscInt p = 0; p < cells->n; p++) {
    const PetscInt k = index[p];

    if (k < 0) continue;
    out->particle[k]     = p;
    out->packing.r[k]    = w->packing->r[p];
    out->cells.volume[k] = cells->volume[p];
    for (PetscInt d = 0; d < 3; d++) {
      out->packing.x[3 * k + d]      = w->packing->x[3 * p + d];
      out->cells.centroid[3 * k + d] = cells->centroid[3 * p + d];
    }
  }
  PetscCall(DemBodyFindFace(w->body, COUPLING_RIM, &rim));
  PetscCheck(rim >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB, "The body has no face '%s'", COUPLING_RIM);
  PetscCall(CarveFacets(w, index, out));
  PetscCall(CarveWalls(w, index, rim, out));
  PetscCall(PetscFree2(awake, index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingCarvedDestroy_Internal(CouplingCarved *carved)
{
  PetscFunctionBegin;
  PetscCall(DemPackingDestroy(&carved->packing));
  PetscCall(DemCellsDestroy(&carved->cells));
  PetscCall(PetscFree(carved->particle));
  PetscCall(PetscFree(carved->facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingDropCells_Internal(CouplingCarved *carved)
{
  const PetscInt facets = carved->cells.n_facets;

  PetscFunctionBegin;
  PetscCall(DemCellsDestroy(&carved->cells));
  carved->cells.n_facets = facets;
  PetscFunctionReturn(PETSC_SUCCESS);
}
