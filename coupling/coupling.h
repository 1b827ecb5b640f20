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
  PetscInt  *cell;     /* [n_cells] its number among the cells of the whole mesh */
  PetscReal *s;        /* [fem nodes] 0 at the group, 1 at the far side of the overlap and beyond */
  PetscInt  *node;     /* [fem nodes] its number in the whole mesh */
} CouplingSplit;

/* Errors: PETSC_ERR_USER_INPUT for a group that is missing, empty, of another dimension, or leaves no elements; an overlap that reaches
   the far end of the body. */
PetscErrorCode CouplingSplitCreate(const Mesh *whole, const char *group, PetscInt width, CouplingSplit *split);
PetscErrorCode CouplingSplitDestroy(CouplingSplit *split);

/* How the elements outside the overlap step: as the particles or in m of their steps (6.10), by Newmark's average acceleration (6.20), or as auto
   finds cheaper: implicit where those elements alone would make the particles' step much smaller. Static: quasi-static load steps, in each of which the particles and the
   overlap relax and the far field follows (6.40); the Stepper's step is then a load step of any size. */
typedef enum { COUPLING_FAR_EXPLICIT, COUPLING_FAR_IMPLICIT, COUPLING_FAR_AUTO, COUPLING_FAR_STATIC } CouplingFar;

/* What joins the sides in the overlap: the springs of one energy (6.3); for comparison the constraint held exactly, by a solve in each step (6.50), and springs of a
   given stiffness (6.53). The other two: static overlap, all explicit, one step for both sides; consistent: no damping. */
typedef enum { COUPLING_ENERGY, COUPLING_CONSISTENT, COUPLING_PENALTY } CouplingMethod;

typedef struct {
  PetscReal floor;  /* least weight of either side, default 0.05 */
  PetscBool smooth; /* smoothstep instead of linear */
  PetscBool affine; /* the affine correction; PETSC_FALSE only to compare */
  PetscInt  substeps; /* particle steps in one step of the elements outside, default 1; 0 = the most that is stable (implicit: accurate), up to 10 */
  CouplingFar far;  /* default explicit */
  FemCondense condense;  /* of a static far field to the face */
  PetscReal tolerance;   /* of a load step: mean force out of balance / mean force, particles and elements */
  CouplingMethod method;
  PetscReal penalty;  /* of COUPLING_PENALTY: spring of a particle over (lambda + 2 mu) x its volume / its size squared */
  PetscBool absorber; /* waves too short for the elements end in the overlap (6.54); with COUPLING_ENERGY, all explicit, one step for both sides */
  PetscReal stress[6]; /* in-situ stress before any displacement, Voigt xx yy zz xy yz zx [Pa], the same everywhere; the elements have it too (FemModelSetInitialStress()) */
  PetscBool preload; /* begin in static equilibrium with the loads and supports of t = 0; the elements need FemModelSetStartGiven() */
} CouplingOptions;

PetscErrorCode CouplingModelCreate(MPI_Comm comm, CouplingModel *model);
PetscErrorCode CouplingModelSetSplit(CouplingModel model, const CouplingSplit *split, const CouplingOptions *options); /* split borrowed for the model's life */

/* On several ranks every rank gives the same elements and the same particles, made for itself alone (PETSC_COMM_SELF), and a second model of these
   particles made on all ranks together, which is shared out and steps. Before CouplingModelSetSides(). The model made on all ranks is borrowed; the one made for
   itself alone belongs to the CouplingModel from then on, which frees it when the parts step. */
PetscErrorCode CouplingModelSetPart(CouplingModel model, DemModel part);
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
  PetscBool dense;                          /* a static far field is condensed to its face */
  PetscInt  face, iterations;               /* unknowns of the face; relaxations so far */
  PetscReal factor;                         /* entries of the far field's factor */
  PetscBool implicit;                       /* the far field is */
  PetscReal preload_left, preload_use;      /* of a preload: force left out of balance / loads; largest use of a bond's strength */
  PetscInt  preload_evaluations;            /* and how often forces were worked out for it */
  PetscReal explicit_limit;                 /* then: the particles' largest step with an explicit one [s] */
  PetscReal absorbed, solves;               /* [J] by the absorber; solves for multipliers so far */
  PetscReal least_weight;                   /* smallest fitted share of an element's stiffness */
} CouplingReport;

/* Of the far field, where it is implicit: energy the face has taken, distance of the copies.  Eq. (6.27) */
PetscErrorCode CouplingModelGetFar(CouplingModel model, FemFarReport *report);
PetscErrorCode CouplingModelGetReport(CouplingModel model, CouplingReport *report);
PetscErrorCode CouplingModelDestroy(CouplingModel *model);

/*
  Elements that turn into particles while the run goes on.  Section 8 of docs/theory.md

  The region that may turn has its packing and cells from the start; particles sleep until the elements around them near their
  strength, and cost nothing until then. At each event both sides are built anew for the new split by the caller's function, and
  the state is handed over. What the object gives out is a Stepper like any other.
*/
typedef struct _p_CouplingSwitch *CouplingSwitch;

typedef enum { COUPLING_RANKINE, COUPLING_MOHR_COULOMB, COUPLING_GIVEN } CouplingCriterion;
/* Fraction of its strength that an element with this stress (Voigt xx yy zz xy yz zx [Pa]) has reached. */
typedef PetscReal (*CouplingUseFunction)(void *ctx, PetscInt dim, const PetscReal stress[6]);

typedef struct {
  CouplingCriterion when;
  PetscReal         at;         /* fraction of the strength at which an element turns, in (0, 1) */
  PetscReal         hysteresis; /* an event takes along elements above (1 - hysteresis) at, in [0, 1) */
  PetscInt          ahead;      /* and so many rings of elements around those that reached `at` */
  const char       *group;      /* cells that may turn; NULL = all of the body */
  CouplingUseFunction given;    /* of COUPLING_GIVEN */
  void               *given_ctx;
  PetscReal         given_mean, given_mises, given_strength; /* of COUPLING_GIVEN without a function: (mean p + mises q) / strength.  Eq. (8.12) */
  PetscBool         off;        /* never: the elements stay what they are, for comparison */
} CouplingSwitchOptions;

/* Makes both sides of a split, not yet set up: mesh, material, damping, conditions, history, always the same but for the split. The body is for DemModelSetBody().
   On several ranks both on PETSC_COMM_SELF; and called once more with fem NULL: the particles again, on all ranks. */
typedef PetscErrorCode (*CouplingMakeSides)(void *ctx, const CouplingSplit *split, const DemBody *body, const DemPacking *packing, const DemCells *cells, FemModel *fem, DemModel *dem);

/* seed: the group that is particles from the start. whole is borrowed for the object's life. */
PetscErrorCode CouplingSwitchCreate(MPI_Comm comm, const Mesh *whole, const char *seed, PetscInt width, const CouplingSwitchOptions *options, CouplingSwitch *sw);
PetscErrorCode CouplingSwitchGetRegion(CouplingSwitch sw, const Mesh **region); /* what the packing must fill */
/* A group of the elements that conditions or history speak of: its elements stay, and stay out of the overlap. Before set-up. */
PetscErrorCode CouplingSwitchProtect(CouplingSwitch sw, const char *group);
/* All borrowed for the object's life. strength: of the shared material, for the criterion. */
PetscErrorCode CouplingSwitchSetBody(CouplingSwitch sw, const DemBody *body, const DemPacking *packing, const DemCells *cells, const FemMaterial *material, const DemStrength *strength, FemKind kind, PetscReal thickness);
/* Weak facets, as DemModelSetWeakness(): part [cells->n_facets], copied. An element turns earlier by the weakest facet in it. */
PetscErrorCode CouplingSwitchSetWeakness(CouplingSwitch sw, const PetscReal part[]);
PetscErrorCode CouplingSwitchSetUp(CouplingSwitch sw, const CouplingOptions *options, CouplingMakeSides make, void *ctx);
PetscErrorCode CouplingSwitchGetCriticalStep(CouplingSwitch sw, PetscReal *dt); /* also of everything that may turn */
PetscErrorCode CouplingSwitchGetStepper(CouplingSwitch sw, Stepper *stepper);
/* Both sides as they stand; they change with every event. Any pointer may be NULL. */
PetscErrorCode CouplingSwitchGetSides(CouplingSwitch sw, CouplingModel *model, FemModel *fem, DemModel *dem, const CouplingSplit **split);
/* Turns cells [n] of the whole mesh at the present instant, whatever their stress; cells that may not turn are left out. dt: the Stepper's step. */
PetscErrorCode CouplingSwitchConvert(CouplingSwitch sw, PetscInt n, const PetscInt cell[], PetscReal dt);

typedef enum { COUPLING_BY_ELEMENT, COUPLING_BY_BOND, COUPLING_BY_TOOL } CouplingAsker; /* whose stress, or a tool that comes near */

/* One event. Energies [J] just before and just after; booked = before - after, all terms less work. */
typedef struct {
  PetscReal time;
  PetscInt  cells, particles;         /* turned; woken */
  PetscReal before[LEDGER_TERMS], after[LEDGER_TERMS], booked;
  PetscReal highest;                  /* criterion of the cell that asked */
  PetscInt  above;                    /* bonds above their strength just then that can break from now on */
  PetscInt  asked;                    /* who: a CouplingAsker */
  PetscReal seconds;                  /* of wall clock */
} CouplingEvent;

typedef struct {
  PetscInt             n_events;
  const CouplingEvent *event;   /* [n_events] on loan until the next step */
  PetscInt             cells, particles, sleeping; /* turned so far; awake; asleep */
  PetscReal            booked;  /* sum over events [J] */
  PetscReal            bond_steps, element_steps, looks; /* advanced so far, by this process */
  PetscInt             blocked; /* cell that reached `at` but may not turn, -1 none yet */
  PetscReal            blocked_time;
  PetscInt             every;   /* steps between looks */
} CouplingSwitchReport;

PetscErrorCode CouplingSwitchGetReport(CouplingSwitch sw, CouplingSwitchReport *report);
PetscErrorCode CouplingSwitchDestroy(CouplingSwitch *sw);
