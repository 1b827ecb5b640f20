/*
  fem_recover.h - stress at nodes by superconvergent patch recovery.  Eqs (2.90)-(2.93)

  Made when the first recovered field or probe is asked for. A node has a side for each material that meets there (regions of
  equal law are one); a slot is a node's side, node * sides + k, sides in the order of their materials.
*/
#pragma once
#include "fem_impl.h"
#include "fem_point.h"
#include "fem_stress.h"

#define FEM_TERMS 10 /* of the largest patch polynomial: quadratic in space */

/* What a request needs: all of it for a frame, the patches around the elements of the probes for those. */
typedef struct {
  PetscInt  n_cells, *cell; /* sampled */
  PetscInt  n_fits, *fit;   /* slots of owned corner nodes that fit their own samples */
  PetscInt  fits;           /* of all ranks */
  PetscInt  n_takes, *take; /* slots of owned corner nodes that take their neighbours' polynomials, by level */
  PetscInt  n_between, *between; /* slots of owned nodes between corners */
} FemRequest;

struct _FemRecovery {
  PetscInt   order, terms, parts, samples, sides; /* samples: most of any element */
  FemPoints *best[MESH_PRISM15 + 1], *rule[MESH_PRISM15 + 1]; /* by element type: where its stress is best; a rule exact for squared errors */
  PetscInt   last;       /* highest level */
  PetscInt  *law;        /* [n_regions] first region of equal law */
  PetscInt  *start, *around; /* [n_own + 1]: elements around each owned node, ascending */
  PetscInt  *side;       /* [n_loc][sides] law, -1 = none */
  PetscInt  *level;      /* [n_loc][sides] 0 inner patch; 1 takes from those; 2 own patch of a boundary node; from 3 takes from lower ones; -1 no corner */
  PetscInt  *kind;       /* [n_loc][sides] of a slot that fits: what is fitted */
  PetscInt  *sample_at;  /* [n_cells] place among the samples */
  FemRequest all, probed;
  PetscReal *poly;       /* [n_loc][sides][terms][parts] of x - x_node [Pa/m^degree] */
  PetscReal *value;      /* [n_loc][sides][parts] [Pa] */
  PetscInt   count, patches; /* whole recoveries, patches fitted by all ranks */

  /* rank 0: points of a frame, nodes first, then further sides */
  PetscBool  mapped;
  PetscInt   n_points, *point_slot, *point_node; /* [n_points] */
  PetscInt  *cell_point; /* as node_all, of points */
};

PetscErrorCode FemRecoveryCreate(FemModel model);  /* nothing when there is one already */
PetscErrorCode FemRecoveryDestroy(FemModel model);
PetscErrorCode FemRecover(FemModel model, const FemRequest *request); /* fills poly, value; ghosts too */
/* Slots that the values at these nodes [n_loc] flags depend on, on every rank. */
PetscErrorCode FemRequestCreate(FemModel model, PetscInt *wanted, FemRequest *request);
PetscErrorCode FemRequestDestroy(FemRequest *request);
PetscErrorCode FemRecoveryMapPoints(FemModel model);
PetscInt       FemSlotOf(const struct _FemRecovery *r, PetscInt node, PetscInt law);
/* An element while it is read: its nodes' places and displacements, and its own strains where it has some. */
typedef struct {
  PetscInt  cell;
  PetscReal x[FEM_MAX_DOFS], u[FEM_MAX_DOFS];
  PetscReal turn[3][3]; /* of a corotational element: u is then the motion from its own axes */
  FemOwn    own;
} FemReading;
void FemReadCell(FemModel model, PetscInt cell, PetscBool own, FemReading *reading); /* own false: leave the modes out, zero at the centre */
/* Stress [parts] of the element's own displacement at point q, and the place; returns det J. */
PetscReal FemRawStress(FemModel model, const FemReading *reading, const FemPoints *points, PetscInt q, PetscReal *s, PetscReal at[3]);
void FemCellPlaces(FemModel model, PetscInt cell, PetscReal *x); /* [nodes][dim] [m] */
