/*
  coupling.h - elements and particles over one overlap, from one energy.  Section 6 of docs/theory.md

  The body's mesh is split: cells of one group become particles, the rest stay elements, and `width` layers of elements
  around the group carry both, the element's share alpha growing from `floor` at the group to 1 - floor at the far side.
*/
#pragma once
#include "dem.h"
#include "fem.h"

typedef struct _p_CouplingModel *CouplingModel;

#define COUPLING_RIM "coupling rim" /* face where the particles end inside the elements */

typedef struct {
  Mesh       fem, dem; /* elements; what the particles fill, with the face COUPLING_RIM */
  PetscInt   dim;
  PetscInt   n_cells;  /* top-dimension cells of fem, in its order */
  PetscInt  *layer;    /* [n_cells] 1 .. width in the overlap, 0 beyond it */
  PetscReal *s;        /* [fem nodes] 0 at the group, 1 at the far side of the overlap and beyond */
} CouplingSplit;

/* Errors: PETSC_ERR_USER_INPUT for a group that is missing, empty, of another dimension, or leaves no elements; an overlap that reaches
   the far end of the body. */
PetscErrorCode CouplingSplitCreate(const Mesh *whole, const char *group, PetscInt width, CouplingSplit *split);
PetscErrorCode CouplingSplitDestroy(CouplingSplit *split);

typedef struct {
  PetscReal floor;  /* least weight of either side, default 0.05 */
  PetscBool smooth; /* smoothstep instead of linear */
  PetscBool affine; /* the affine correction; PETSC_FALSE only to compare */
  PetscInt  substeps; /* particle steps in one step of the elements outside, default 1; 0 = the most that is stable, up to 10 */
} CouplingOptions;

PetscErrorCode CouplingModelCreate(MPI_Comm comm, CouplingModel *model);
PetscErrorCode CouplingModelSetSplit(CouplingModel model, const CouplingSplit *split, const CouplingOptions *options); /* split borrowed for the model's life */

/* Both sides, with mesh, material and body given and not yet set up: sets their weights, the rim, and which bonds cannot break.
   material is the one both share in the overlap. thickness [m] in 2D. */
PetscErrorCode CouplingModelSetSides(CouplingModel model, FemModel fem, DemModel dem, const DemPacking *packing, const DemCells *cells, const FemMaterial *material, FemKind kind, PetscReal thickness);

PetscErrorCode CouplingModelSetUp(CouplingModel model); /* sets both sides up too */
PetscErrorCode CouplingModelGetCriticalStep(CouplingModel model, PetscReal *dt); /* the Stepper's: substeps x sqrt(3)/omega_0 of the sides.  Eq. (6.9) */
PetscErrorCode CouplingModelGetStepper(CouplingModel model, Stepper *stepper);

typedef struct {
  PetscInt  particles, bonds, cells, nodes; /* in the overlap */
  PetscReal residual_before, residual;      /* worst node's force in a uniform strain / (stress x facet area), before and after the fit.  Eq. (6.8) */
  PetscInt  substeps;                       /* in use */
  PetscReal least_weight;                   /* smallest fitted share of an element's stiffness */
} CouplingReport;

PetscErrorCode CouplingModelGetReport(CouplingModel model, CouplingReport *report);
PetscErrorCode CouplingModelDestroy(CouplingModel *model);
