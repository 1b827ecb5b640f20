/* coupling_switch.h - inside a CouplingSwitch. */
#pragma once
#include "coupling_impl.h"

#define COUPLING_WAKE 0.4 /* bonds of the overlap are looked at where the elements pass this fraction of their strength, as DEM_STRESS_WAKE */
#define COUPLING_TOOL_LOOKS 16 /* looks at the stress between two at the tools: one slower than 1/16 of a wave gains half an element on them */

/* What never changes: the body, its packing, and where it lies in the mesh. All borrowed. */
typedef struct {
  const Mesh       *mesh;
  const DemBody    *body;
  const DemPacking *packing;
  const DemCells   *cells;
  PetscInt         *home;       /* [packing->n] cell of the mesh that holds the particle's centre; owned */
  PetscInt         *facet_home; /* [cells->n_facets] and the facet's centroid, -1 outside all; owned */
} CouplingWhole;

/* The particles awake at a time. */
typedef struct {
  DemPacking packing;
  DemCells   cells;
  PetscInt  *particle; /* [packing.n] number in the whole packing, ascending */
  PetscInt  *facet;    /* [cells.n_facets] number among the whole's facets */
} CouplingCarved;

/* Both sides of one split. */
typedef struct {
  CouplingSplit  split;
  CouplingCarved carved;
  FemModel       fem;
  DemModel       dem, part; /* part: on several ranks; dem is then the model's, and there during events alone */
  CouplingModel  model;
  Stepper        stepper;
  PetscInt       n_watched, *watched; /* bonds of the overlap that cannot break: facets of carved.cells */
  PetscInt      *top_of;              /* [cells of the whole mesh] element of the split, -1 */
  PetscInt       dofs;                /* most of an element */
  PetscReal     *gradient;            /* [split.n_cells][dofs] mean gradients of the shape functions [1/m] */
} CouplingHalves;

struct _p_CouplingSwitch {
  MPI_Comm              comm;
  const Mesh           *whole;
  PetscInt              width;
  CouplingSwitchOptions options;
  CouplingOptions       coupling;
  char                  seed[128];
  Mesh                  region;
  CouplingWhole         w;
  DemBody               body; /* of the models: the region's faces, and COUPLING_RIM */
  FemMaterial           material;
  DemStrength           strength;
  FemKind               kind;
  PetscReal             thickness, lambda, mu, mass[4]; /* mass and first moments of the body [kg], [kg m] */
  CouplingMakeSides     make;
  void                 *ctx;
  PetscBool             ready;

  PetscBool *is_dem, *may, *stays; /* [cells] particles alone now; may become so; held by a condition */
  PetscInt  *ring, *reach;         /* [cells], [nodes] of the present split */
  PetscReal *weak, *weak_cell;     /* [facets], [cells] part of the strength, NULL = 1 */
  PetscReal *use;                  /* [cells] criterion when last looked at */
  CouplingHalves *now;

  PetscInt  substeps;       /* of the first split */
  PetscReal limit;          /* of the Stepper's step */
  PetscReal dt;             /* the Stepper's step, 0 = none yet */
  PetscInt  every;          /* steps between looks */
  PetscReal smallest;       /* cell that may turn [m] */
  PetscInt  n_skin, *skin;  /* particles of the whole packing at the body's surface, whose cell a tool may come near; made at the first look */
  PetscReal *skin_margin;   /* [n_skin] their cell's size and radius [m] */

  PetscInt       n_events, room, n_turned;
  CouplingEvent *event;
  PetscReal      booked, bond_steps, element_steps, looks, blocked_time;
  PetscInt       blocked;
  PetscInt       n_columns;
  const char   **history_name, **history_unit; /* [n_columns] owned, with their texts */
};

/* coupling_carve.c */
PetscErrorCode CouplingHomes_Internal(const Mesh *whole, const DemPacking *packing, const DemCells *cells, PetscInt **particle, PetscInt **facet);
PetscErrorCode CouplingCarve_Internal(const CouplingWhole *w, const PetscInt ring[], CouplingCarved *carved);
PetscErrorCode CouplingCarvedDestroy_Internal(CouplingCarved *carved);
PetscErrorCode CouplingDropCells_Internal(CouplingCarved *carved); /* all but their number: they can be carved again */

/* coupling_criterion.c */
PetscReal CouplingUse_Internal(const CouplingSwitchOptions *options, const DemStrength *strength, PetscInt dim, const PetscReal stress[6]);
PetscReal CouplingUseBound_Internal(const CouplingSwitchOptions *options, const DemStrength *strength); /* [Pa] use <= |stress| / this; 0: not known */

/* coupling_tools.c: close[c]: a tool has come so near to cell c, which is not particles alone, that it must be when they touch */
PetscErrorCode CouplingLookAtTools_Internal(CouplingSwitch sw, PetscBool close[]);
PetscReal      CouplingVolume_Internal(const Mesh *mesh, PetscInt cell); /* [m3], 2D [m2]; coupling_switch.c */

/* coupling_recover.c: nodal gradients of a field on the elements; G [nodes][dim][dim], G_ij = du_i/dx_j */
PetscErrorCode CouplingRecover_Internal(const Mesh *mesh, PetscReal thickness, const PetscBool wanted[], const PetscReal *u, PetscReal *G);

/* coupling_event.c */
PetscErrorCode CouplingWeaken_Internal(CouplingSwitch sw, const CouplingCarved *carved, DemModel dem); /* coupling_switch.c: weak facets to a model of some */
PetscErrorCode CouplingBuild_Internal(CouplingSwitch sw, CouplingHalves **halves);
PetscErrorCode CouplingHalvesDestroy_Internal(CouplingHalves **halves);
PetscErrorCode CouplingLook_Internal(CouplingSwitch sw, PetscReal t, PetscBool tools); /* tools: at them too */
/* marked [cells]: may-not ones are left out. highest: criterion of the one that asked */
PetscErrorCode CouplingTurn_Internal(CouplingSwitch sw, const PetscBool marked[], PetscReal t, PetscReal highest, CouplingAsker asked);

