/*
  dem_cells.c - the power diagram clipped by the body: all cells, joined and checked.

  Each cell is made by itself (dem_cells_one.c), so threads share nothing; runs of particles are joined in order. Both
  particles of a facet make it, and must agree on its area; the lower one's is kept.  Eqs (3.1)-(3.3), docs/theory.md
*/
#include "dem_cells_impl.h"
#include <omp.h>
#include <stdlib.h>
#include <string.h>

#define FIRST_CUBE 1.5      /* half side / mean spacing */
#define SUM_TOLERANCE 1e-10 /* of the body's volume */

static PetscErrorCode ParticleGridCreate(const DemBody *body, const DemPacking *packing, ParticleGrid *g)
{
  PetscInt cells = 1, *cell;

  PetscFunctionBegin;
  g->width = PetscPowReal(DemBodyVolume(body) / body->thickness / packing->n, 1. / body->dim);
  for (PetscInt again = 1; again;) {
    PetscReal total = 1;

    again = 0;
    for (PetscInt c = 0; c < 3; c++) total *= PetscMax(1, PetscCeilReal((body->high[c] - body->low[c]) / g->width));
    if (total > 8. * packing->n + 64) { /* thin bodies in big boxes */
      g->width *= 1.2;
      again = 1;
    }
  }
  for (PetscInt c = 0; c < 3; c++) {
    g->low[c] = body->low[c];
    g->m[c] = (PetscInt)PetscMax(1, PetscCeilReal((body->high[c] - body->low[c]) / g->width));
    cells *= g->m[c];
  }
  PetscCall(PetscCalloc1(cells + 2, &g->start));
  PetscCall(PetscMalloc1(packing->n, &g->item));
  PetscCall(PetscMalloc1(packing->n, &cell));
  g->r_max = 0;
  for (PetscInt p = 0; p < packing->n; p++) {
    PetscInt at[3];

    for (PetscInt c = 0; c < 3; c++) at[c] = (PetscInt)PetscMax(0, PetscMin(g->m[c] - 1, PetscFloorReal((packing->x[3 * p + c] - g->low[c]) / g->width)));
    cell[p] = (at[2] * g->m[1] + at[1]) * g->m[0] + at[0];
    g->r_max = PetscMax(g->r_max, packing->r[p]);
    g->start[cell[p] + 2]++;
  }
  for (PetscInt c = 0; c < cells; c++) g->start[c + 2] += g->start[c + 1];
  for (PetscInt p = 0; p < packing->n; p++) g->item[g->start[cell[p] + 1]++] = p;
  PetscCall(PetscFree(cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int ComparePatches(const void *a, const void *b)
{
  const Patch *f = a, *g = b;

  return f->q != g->q ? (f->q > g->q) - (f->q < g->q) : (f->at > g->at) - (f->at < g->at);
}

/* Take in another piece of the same flat facet: area and centroid. */
static void JoinPatch(Patch *to, const Patch *from)
{
  const PetscReal area = to->area + from->area;

  for (PetscInt c = 0; c < 3; c++) to->x[c] += from->area / area * (from->x[c] - to->x[c]);
  to->area = area;
}

/* Copy the corners of pieces first .. last: one polygon as it is, several each closed by its first corner; 2D: the far ends. From x, the facet's centroid. */
static Trouble HarvestCorners(PetscInt dim, const Worker *w, const Patch *first, const Patch *last, const PetscReal x[3], Harvest *out, PetscInt *n)
{
  const PetscInt   closed = dim == 3 && last > first;
  const PetscReal *end[2] = {&w->corner[3 * first->at], &w->corner[3 * first->at]}, axis[2] = {-first->normal[1], first->normal[0]};
  PetscInt         room = 0;
  float           *to;

  for (const Patch *piece = first; piece <= last; piece++) room += piece->n + closed;
  if (DemCellGrow(3 * (out->n_corners + room), sizeof(float), &out->room_corners, &out->corner)) return NO_MEMORY;
  to = &out->corner[3 * out->n_corners];
  *n = 0;
  if (dim == 2) {
    for (const Patch *piece = first; piece <= last; piece++)
      for (PetscInt k = piece->at; k < piece->at + piece->n; k++) {
        const PetscReal *y = &w->corner[3 * k];

        if (axis[0] * (y[0] - end[0][0]) + axis[1] * (y[1] - end[0][1]) < 0) end[0] = y;
        if (axis[0] * (y[0] - end[1][0]) + axis[1] * (y[1] - end[1][1]) > 0) end[1] = y;
      }
    for (*n = 0; *n < 2; (*n)++)
      for (PetscInt c = 0; c < 3; c++) to[3 * *n + c] = (float)(end[*n][c] - x[c]);
  } else
    for (const Patch *piece = first; piece <= last; piece++)
      for (PetscInt k = 0; k < piece->n + closed; k++, (*n)++)
        for (PetscInt c = 0; c < 3; c++) to[3 * *n + c] = (float)(w->corner[3 * (piece->at + k % piece->n) + c] - x[c]);
  out->n_corners += *n;
  return FINE;
}

static Trouble HarvestCell(PetscInt dim, PetscInt p, Worker *w)
{
  Harvest *out = &w->out;

  qsort(w->patch, w->n_patches, sizeof(Patch), ComparePatches);
  for (PetscInt k = 0, m; k < w->n_patches; k += m) {
    Patch joined = w->patch[k];

    for (m = 1; k + m < w->n_patches && w->patch[k + m].q == joined.q; m++) {
    }
    if (joined.q >= 0) {
      for (PetscInt j = 1; j < m; j++) JoinPatch(&joined, &w->patch[k + j]);
      if (joined.q < p) {
        if (DemCellGrow(out->n_mirrors + 1, sizeof(Mirror), &out->room_mirrors, &out->mirror)) return NO_MEMORY;
        out->mirror[out->n_mirrors++] = (Mirror){.p = joined.q, .q = p, .area = joined.area};
      } else {
        if (HarvestCorners(dim, w, &w->patch[k], &w->patch[k + m - 1], joined.x, out, &joined.n)) return NO_MEMORY;
        if (DemCellGrow(out->n_facets + 1, sizeof(Facet), &out->room_facets, &out->facet)) return NO_MEMORY;
        out->facet[out->n_facets++] = (Facet){p, joined.q, joined.n, joined.area, {joined.x[0], joined.x[1], joined.x[2]}};
      }
    } else { /* one wall per face and plane */
      const PetscInt first = out->n_walls;

      for (PetscInt j = k; j < k + m; j++) {
        PetscInt same;

        for (same = first; same < out->n_walls; same++) {
          const Patch *a = &out->wall[same], *b = &w->patch[j];
          PetscReal    turn = 0, step = 0;

          for (PetscInt c = 0; c < 3; c++) {
            turn += PetscSqr(a->normal[c] - b->normal[c]);
            step += a->normal[c] * (a->x[c] - b->x[c]);
          }
          if (turn < 1e-18 && PetscAbsReal(step) < 1e-9 * PetscSqrtReal(a->area + b->area)) break;
        }
        if (same < out->n_walls) {
          JoinPatch(&out->wall[same], &w->patch[j]);
        } else {
          if (DemCellGrow(out->n_walls + 1, sizeof(Patch), &out->room_walls, &out->wall)) return NO_MEMORY;
          out->wall[out->n_walls] = w->patch[j];
          out->wall[out->n_walls].at = p;
          out->n_walls++;
        }
      }
    }
  }
  return FINE;
}

static void WorkerFree(Worker *w)
{
  DemClipDestroy(&w->whole);
  DemClipDestroy(&w->part);
  free(w->candidate);
  free(w->patch);
  free(w->corner);
  free(w->parts);
  free(w->stamp);
  free(w->part_of);
  free(w->out.facet);
  free(w->out.wall);
  free(w->out.corner);
  free(w->out.mirror);
  for (PetscInt k = 0; k < w->out.n_orphans; k++) DemClipDestroy(&w->out.orphan[k].clip);
  free(w->out.orphan);
  free(w->moved);
  memset(w, 0, sizeof(*w));
}

/* Each thread takes one run of particles; joining the runs in order gives the same arrays for any number of threads. */
static PetscErrorCode MakeCells(const CellScene *scene, PetscInt n_workers, Worker *worker, DemCells *cells, PetscReal *solid)
{
  const DemPacking *packing = scene->packing;
  const PetscInt    n = packing->n, dim = scene->search->body->dim, pieces = scene->search->body->n_pieces;
  PetscInt          bad = n, bad_other = -1;
  Trouble           kind = FINE;

  PetscFunctionBegin;
#pragma omp parallel for schedule(static, 1) num_threads((int)n_workers)
  for (PetscInt t = 0; t < n_workers; t++) {
    Worker        *w = &worker[t];
    const PetscInt end = (PetscInt)((PetscInt64)n * (t + 1) / n_workers);
    PetscInt       p = (PetscInt)((PetscInt64)n * t / n_workers);
    Trouble        trouble = DemClipCreate(dim, &w->whole) || DemClipCreate(dim, &w->part) ? NO_MEMORY : FINE;

    w->stamp = malloc(pieces * sizeof(PetscInt));
    w->part_of = malloc(pieces * sizeof(PetscInt));
    if (!w->stamp || !w->part_of) trouble = NO_MEMORY;
    for (PetscInt k = 0; k < pieces && !trouble; k++) w->stamp[k] = -1;
    for (; p < end && !trouble; p++) {
      Cell cell;

      trouble = DemCellMake(scene, p, w, &cell);
      if (!trouble) trouble = HarvestCell(dim, p, w);
      if (trouble) break;
      cells->volume[p] = cell.volume;
      for (PetscInt c = 0; c < 3; c++) cells->centroid[3 * p + c] = cell.centroid[c];
      if (solid) solid[p] = cell.solid;
    }
    if (trouble) {
#pragma omp critical
      if (p < bad) {
        bad = p;
        kind = trouble;
        bad_other = w->other;
      }
    }
  }
  if (kind != FINE) {
    const PetscReal *x = &packing->x[3 * bad];

    PetscCheck(kind != NO_MEMORY, PETSC_COMM_SELF, PETSC_ERR_MEM, "No memory for the cells of %" PetscInt_FMT " particles", n);
    BaseCheckInput(kind != SAME_CENTRE, PETSC_COMM_SELF, "Particles %" PetscInt_FMT " and %" PetscInt_FMT " have the same centre (%.6g, %.6g, %.6g) m, or as good as the same; remove one",
                   bad, bad_other, (double)x[0], (double)x[1], (double)x[2]);
    BaseCheckInput(kind != NO_CELL, PETSC_COMM_SELF,
                   "Particle %" PetscInt_FMT
                   " at (%.6g, %.6g, %.6g) m with radius %.6g m has no cell: it lies outside the body or hidden by larger neighbours; remove it or change its radius",
                   bad, (double)x[0], (double)x[1], (double)x[2], (double)packing->r[bad]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Join the threads' runs into the caller's arrays; what has been taken over goes at once. */
static PetscErrorCode JoinHarvests(PetscInt n_workers, Worker *worker, DemCells *cells)
{
  PetscInt facets = 0, walls = 0, corners = 0;

  PetscFunctionBegin;
  for (PetscInt t = 0; t < n_workers; t++) {
    facets += worker[t].out.n_facets;
    walls += worker[t].out.n_walls;
    corners += worker[t].out.n_corners;
  }
  PetscCall(PetscMalloc1(facets, &cells->p));
  PetscCall(PetscMalloc1(facets, &cells->q));
  PetscCall(PetscMalloc1(facets, &cells->area));
  PetscCall(PetscMalloc1(3 * facets, &cells->at));
  PetscCall(PetscMalloc1(facets + 1, &cells->facet_start));
  PetscCall(PetscMalloc1(3 * corners, &cells->corner));
  PetscCall(PetscMalloc1(walls, &cells->wall_p));
  PetscCall(PetscMalloc1(walls, &cells->wall_face));
  PetscCall(PetscMalloc1(walls, &cells->wall_area));
  PetscCall(PetscMalloc1(3 * walls, &cells->wall_at));
  PetscCall(PetscMalloc1(3 * walls, &cells->wall_normal));
  facets = walls = corners = 0;
  for (PetscInt t = 0; t < n_workers; t++) {
    Harvest *h = &worker[t].out;

    PetscCall(PetscArraycpy(&cells->corner[3 * corners], h->corner, 3 * h->n_corners));
    free(h->corner);
    h->corner = NULL;
    for (PetscInt k = 0; k < h->n_facets; k++, facets++) {
      cells->p[facets] = h->facet[k].p;
      cells->q[facets] = h->facet[k].q;
      cells->area[facets] = h->facet[k].area;
      cells->facet_start[facets] = corners;
      for (PetscInt c = 0; c < 3; c++) cells->at[3 * facets + c] = h->facet[k].x[c];
      corners += h->facet[k].n;
    }
    free(h->facet);
    h->facet = NULL;
    for (PetscInt k = 0; k < h->n_walls; k++, walls++) {
      cells->wall_p[walls] = h->wall[k].at;
      cells->wall_face[walls] = -1 - h->wall[k].q;
      cells->wall_area[walls] = h->wall[k].area;
      for (PetscInt c = 0; c < 3; c++) {
        cells->wall_at[3 * walls + c] = h->wall[k].x[c];
        cells->wall_normal[3 * walls + c] = h->wall[k].normal[c];
      }
    }
  }
  cells->facet_start[facets] = corners;
  cells->n_facets = facets;
  cells->n_walls = walls;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both particles of a facet must see the same area. `tiny` [m2]: what a cutting tolerance may drop on one side. */
static PetscErrorCode CheckMirrors(PetscInt n_workers, const Worker *worker, const DemCells *cells, PetscReal tiny)
{
  PetscInt  *first;
  PetscBool *seen; /* [n_facets] by the higher particle */

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(cells->n + 2, &first));
  PetscCall(PetscCalloc1(cells->n_facets, &seen));
  for (PetscInt k = 0; k < cells->n_facets; k++) first[cells->p[k] + 1]++;
  for (PetscInt p = 0; p < cells->n; p++) first[p + 1] += first[p];
  for (PetscInt t = 0; t < n_workers; t++)
    for (PetscInt k = 0; k < worker[t].out.n_mirrors; k++) {
      const Mirror *m = &worker[t].out.mirror[k];
      PetscReal     area = 0;
      PetscInt      lo = first[m->p], hi = first[m->p + 1];

      while (lo < hi) {
        const PetscInt mid = (lo + hi) / 2;

        if (cells->q[mid] < m->q)
          lo = mid + 1;
        else
          hi = mid;
      }
      if (lo < first[m->p + 1] && cells->q[lo] == m->q) {
        area = cells->area[lo];
        seen[lo] = PETSC_TRUE;
      }
      PetscCheck(PetscAbsReal(area - m->area) <= tiny, PETSC_COMM_SELF, PETSC_ERR_PLIB,
                 "Particles %" PetscInt_FMT " and %" PetscInt_FMT " see their facet as %.6g and %.6g m2: the diagram is broken", m->p, m->q, (double)area,
                 (double)m->area);
    }
  for (PetscInt k = 0; k < cells->n_facets; k++)
    PetscCheck(seen[k] || cells->area[k] <= tiny, PETSC_COMM_SELF, PETSC_ERR_PLIB,
               "Particle %" PetscInt_FMT " does not see its facet of %.6g m2 with %" PetscInt_FMT, cells->q[k], (double)cells->area[k], cells->p[k]);
  PetscCall(PetscFree(first));
  PetscCall(PetscFree(seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckInput(const DemPacking *packing)
{
  PetscFunctionBegin;
  BaseCheckInput(packing->n > 0, PETSC_COMM_SELF, "A packing without particles has no cells");
  for (PetscInt p = 0; p < packing->n; p++) {
    const PetscReal *x = &packing->x[3 * p], r = packing->r[p];

    BaseCheckInput(r > 0 && !PetscIsInfOrNanReal(r + x[0] + x[1] + x[2]), PETSC_COMM_SELF,
                   "Particle %" PetscInt_FMT " at (%.6g, %.6g, %.6g) m with radius %.6g m: centres are finite and radii above 0", p, (double)x[0], (double)x[1],
                   (double)x[2], (double)r);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First pass: cells as they are, and parts across notches. Second, if there were such parts: with the parts shared out.
   A part beyond a void wider than the first cube is missing from the sum: then once more with cubes that span the body. */
static PetscErrorCode MakeAndJoin(CellScene *scene, PetscReal spacing, PetscInt n_workers, Worker *worker, DemCells *cells, PetscReal *solid)
{
  const DemBody  *body = scene->search->body;
  const PetscReal total = DemBodyVolume(body);
  PetscReal       sum = 0;

  PetscFunctionBegin;
  for (PetscInt wide = 0; wide < 2; wide++) {
    scene->h = wide ? scene->h_max : PetscMin(scene->h_max, FIRST_CUBE * spacing);
    for (PetscInt t = 0; t < n_workers; t++) WorkerFree(&worker[t]);
    PetscCall(MakeCells(scene, n_workers, worker, cells, solid));
    sum = 0;
    for (PetscInt p = 0; p < cells->n; p++) sum += cells->volume[p];
    if (PetscAbsReal(sum - total) <= SUM_TOLERANCE * total) break;
  }
  if (PetscAbsReal(sum - total) <= SUM_TOLERANCE * total) {
    PetscInt orphans = 0;

    for (PetscInt t = 0; t < n_workers; t++) orphans += worker[t].out.n_orphans;
    if (orphans) {
      Estate         estate;
      PetscErrorCode code = DemEstateCreate(scene, n_workers, worker, &estate);

      for (PetscInt t = 0; t < n_workers; t++) WorkerFree(&worker[t]);
      scene->estate = &estate;
      if (!code) code = MakeCells(scene, n_workers, worker, cells, solid);
      scene->estate = NULL;
      PetscCall(DemEstateDestroy(&estate));
      PetscCall(code);
      sum = 0;
      for (PetscInt p = 0; p < cells->n; p++) sum += cells->volume[p];
    }
  }
  PetscCheck(PetscAbsReal(sum - total) <= SUM_TOLERANCE * total, PETSC_COMM_SELF, PETSC_ERR_PLIB, "The cells fill %.12g m3 of a body of %.12g m3%s",
             (double)sum, (double)total, body->n_pieces > 1 ? "; do cells of the mesh overlap?" : "");
  PetscCall(JoinHarvests(n_workers, worker, cells));
  PetscCall(CheckMirrors(n_workers, worker, cells, 1e-9 * total / cells->n / spacing));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemCellsBuild(const DemBody *body, const DemPacking *packing, DemCells *cells, PetscReal *solid)
{
  const PetscInt  n = packing->n, dim = body->dim, n_workers = PetscMin(PetscMax(n, 1), omp_get_max_threads());
  const PetscReal spacing = PetscPowReal(DemBodyVolume(body) / body->thickness / PetscMax(n, 1), 1. / dim);
  PetscReal       h_max = 0;
  ParticleGrid    grid;
  DemBodySearch   search;
  Worker         *worker;
  CellScene       scene = {.search = &search, .grid = &grid, .packing = packing};
  PetscErrorCode  code;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(cells, sizeof(*cells)));
  PetscCall(CheckInput(packing));
  for (PetscInt p = 0; p < n; p++)
    for (PetscInt c = 0; c < dim; c++)
      h_max = PetscMax(h_max, PetscMax(PetscAbsReal(packing->x[3 * p + c] - body->low[c]), PetscAbsReal(packing->x[3 * p + c] - body->high[c])));
  scene.h_max = 1.01 * h_max;
  cells->n = n;
  PetscCall(PetscMalloc1(n, &cells->volume));
  PetscCall(PetscMalloc1(3 * n, &cells->centroid));
  PetscCall(ParticleGridCreate(body, packing, &grid));
  PetscCall(DemBodySearchCreate(body, body->n_pieces > 1 ? 1.2 * spacing : 0, spacing, &search));
  PetscCall(PetscCalloc1(n_workers, &worker));
  code = MakeAndJoin(&scene, spacing, n_workers, worker, cells, solid);
  for (PetscInt t = 0; t < n_workers; t++) WorkerFree(&worker[t]);
  PetscCall(PetscFree(worker));
  PetscCall(DemBodySearchDestroy(&search));
  PetscCall(PetscFree(grid.start));
  PetscCall(PetscFree(grid.item));
  if (code) PetscCall(DemCellsDestroy(cells));
  PetscCall(code);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemCellsCreate(const DemBody *body, const DemPacking *packing, DemCells *cells) { return DemCellsBuild(body, packing, cells, NULL); }

PetscErrorCode DemCellsDropCorners(DemCells *cells)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(cells->facet_start));
  PetscCall(PetscFree(cells->corner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemCellsDestroy(DemCells *cells)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(cells->volume));
  PetscCall(PetscFree(cells->centroid));
  PetscCall(PetscFree(cells->p));
  PetscCall(PetscFree(cells->q));
  PetscCall(PetscFree(cells->area));
  PetscCall(PetscFree(cells->at));
  PetscCall(PetscFree(cells->wall_p));
  PetscCall(PetscFree(cells->wall_face));
  PetscCall(PetscFree(cells->wall_area));
  PetscCall(PetscFree(cells->wall_at));
  PetscCall(PetscFree(cells->wall_normal));
  PetscCall(DemCellsDropCorners(cells));
  PetscCall(PetscMemzero(cells, sizeof(*cells)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
