/* dem_cells_impl.h - one cell in hand, what a thread has made of its cells, and parts cut off by a notch. */
#pragma once
#include "dem_body_impl.h"
#include "dem_cells.h"
#include "dem_clip.h"

/* solid [n], or NULL: volume of each sphere within its own cell [m3]; their sum is the volume of the union. */
PetscErrorCode DemCellsBuild(const DemBody *body, const DemPacking *packing, DemCells *cells, PetscReal *solid);

/* Volume of the ball of radius R around the origin within the cone from the origin over a polygon, signed as `height`.
   corner [n][3] in order around; normal: outward unit normal; height = normal.corner.  Eq. (3.8) */
PetscReal DemBallInCone(PetscInt n, const double *corner, const PetscReal normal[3], PetscReal height, PetscReal R);
/* Area of the disc within the triangle from the origin over a segment.  Eq. (3.9) */
PetscReal DemDiscInTriangle(const double *corner, const PetscReal normal[3], PetscReal height, PetscReal R);

/* Ids of a clip's facets: -1 .. -6 the cube, <= -10 plane k of the body, >= 0 a neighbour; at least HEIR_ID(0)
   another share of an orphan. */
#define PLANE_ID(k) (-10 - (k))
#define HEIR_ID(q) ((q) + (1 << 30))

/* Threads report trouble by code; the caller turns the first particle's into words. */
typedef enum { FINE, NO_MEMORY, SAME_CENTRE, NO_CELL } Trouble;

/* Particles sorted into a grid. */
typedef struct {
  PetscReal low[3], width, r_max;
  PetscInt  m[3];
  PetscInt *start, *item;
} ParticleGrid;

/* A flat piece of a cell's surface. */
typedef struct {
  PetscInt  q;     /* >= 0: neighbour; else -1 - face of the body */
  PetscInt  at, n; /* in the cell in hand: corners [at .. at + n); of a harvested wall: owner, - */
  PetscReal area, x[3], normal[3];
} Patch;

/* A facet of a harvest. */
typedef struct {
  PetscInt  p, q, n; /* n: corners */
  PetscReal area, x[3];
} Facet;

/* A facet as the higher particle sees it, to compare. */
typedef struct {
  PetscInt  p, q;
  PetscReal area;
} Mirror;

/* The cell in one piece of the body. */
typedef struct {
  PetscInt  piece, root; /* root: lowest part it is joined with */
  PetscReal volume;      /* in cube units; 0: only touches */
  PetscReal joined;      /* volume of all parts joined with it, kept by the root */
  PetscReal outside;     /* how far the particle's centre is outside this piece [m] */
} Part;

/* A part of p's cell that is not joined through the body to p's own: the far side of a notch. Coordinates of clip are
   relative to p, in units of h. */
typedef struct {
  PetscInt  p, piece;
  PetscInt  first; /* share of it, then along Share.next; -1 ends */
  PetscReal h;
  DemClip   clip;
} Orphan;

/* What one thread has made of its run of particles. */
typedef struct {
  PetscInt   n_facets, room_facets, n_walls, room_walls, n_corners, room_corners, n_mirrors, room_mirrors, n_orphans, room_orphans;
  Facet     *facet;
  Patch     *wall;
  float     *corner; /* [n_corners][3] from the facet's centroid */
  Mirror    *mirror;
  Orphan    *orphan;
} Harvest;

typedef struct {
  PetscReal t;
  PetscInt  q;
} Candidate;

/* A thread's tools. */
typedef struct {
  DemClip    whole, part;
  Candidate *candidate;
  Patch     *patch;
  PetscReal *corner;
  double    *moved; /* corners of a part seen from another particle */
  Part      *parts;
  PetscInt  *stamp, *part_of; /* [pieces of the body]: particle that meets it now, and as which part */
  PetscInt   room_candidates, n_patches, room_patches, n_corners, room_corners, n_parts, room_parts, room_moved;
  PetscInt   other; /* second particle of a trouble */
  Harvest    out;
} Worker;

typedef struct {
  PetscReal volume, centroid[3], solid;
  PetscBool cube;  /* a face of the cube lies in the body */
  PetscBool apart; /* some parts are orphans */
} Cell;

/* A convex piece of an orphan and who gets it. Coordinates are the orphan's; facets towards other shares of the same
   parent have the id HEIR_ID(share). */
typedef enum { SHARE_PENDING, SHARE_GIVEN, SHARE_SPLIT, SHARE_EMPTY } ShareState;

typedef struct {
  PetscInt   orphan, parent, heir, next; /* parent: the share it was cut from, -1 the whole orphan */
  PetscInt   root;                       /* group that it is joined with */
  ShareState state;
  DemClip    clip;
} Share;

typedef struct {
  PetscInt heir, share;
} Bequest;

/* All orphans, sorted by p then piece; what was given, sorted by heir. Empty for most bodies. */
typedef struct {
  PetscInt   n_orphans, n_shares, room_shares, n_bequests;
  Orphan    *orphan;
  Share     *share;
  Bequest   *bequest;
  PetscBool *has; /* [particles] owns orphans */
} Estate;

/* What the cells are made from; shared by threads, read only. */
typedef struct {
  const DemBodySearch *search;
  const ParticleGrid  *grid;
  const DemPacking    *packing;
  const Estate        *estate; /* NULL in the first pass, when orphans are being found */
  PetscReal            h, h_max;
} CellScene;

Trouble DemCellGrow(PetscInt need, size_t size, PetscInt *room, void *array);
Trouble DemCellMake(const CellScene *scene, PetscInt p, Worker *w, Cell *cell);

PetscErrorCode DemEstateCreate(const CellScene *scene, PetscInt n_workers, Worker *worker, Estate *estate); /* takes the workers' orphans */
PetscErrorCode DemEstateDestroy(Estate *estate);
PetscBool      DemEstateHas(const Estate *estate, PetscInt p, PetscInt piece); /* p's part in that piece is an orphan */
/* A facet of share `a` towards share `b`: whose particle's bisector it lies on, and whether it parts two heirs now. */
PetscInt  DemEstateCutter(const Estate *estate, PetscInt a, PetscInt b);
PetscBool DemEstateParts(const Estate *estate, PetscInt a, PetscInt b);
/* Bequests of an heir are bequest[first .. end). */
void DemEstateFind(const Estate *estate, PetscInt heir, PetscInt *first, PetscInt *end);
