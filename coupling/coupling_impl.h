/* coupling_impl.h - inside a CouplingModel. */
#pragma once
#include <petscksp.h>
#include "coupling.h"
#include "fem_element.h"

#define COUPLING_VOIGT  6
#define COUPLING_SPRING 0.3 /* of (6.3), what an absorber leaves of the springs */
#define COUPLING_DRAG   0.5 /* theta of (6.54) */

/* A point of the rest state seen from an element. */
typedef struct {
  PetscInt  cell;            /* of split->fem's top cells */
  PetscInt  n;
  PetscInt  node[FEM_MAX_NODES];
  PetscReal N[FEM_MAX_NODES];
  PetscReal dN[FEM_MAX_NODES][3]; /* [1/m] */
} CouplingPoint;

/* One particle of the overlap.  Eqs (6.3)-(6.5) */
typedef struct {
  PetscInt      p;      /* row of what CouplingParticles_Internal() lends */
  PetscInt      whole;  /* in the particle model's order */
  CouplingPoint at;
  PetscReal     c;      /* m-bar c_i: P = c / dt^2 [kg] */
  PetscReal     P;      /* of a penalty [N/m] */
  PetscReal     F[3][COUPLING_VOIGT], M[3][COUPLING_VOIGT]; /* net force [N], moment [N m] per unit strain (engineering Voigt) */
} CouplingParticle;

/* Rows of some list that ranks gather: those this rank gives, and where each that comes belongs. */
typedef struct {
  PetscInt     n, *here, *whole; /* [n] row of the rank's part, row of the whole list */
  PetscInt     all, *place;      /* [all] row of the whole list */
  PetscMPIInt *count, *first;    /* [ranks] */
  PetscReal   *out, *in;
} CouplingRows;

/* Weights of the particles' side, packing's and cells' order. */
typedef struct {
  PetscReal *wm, *wp, *wf; /* [particles] of mass, of volumetric energy, [facets] of the pair energy */
  PetscInt  *row;          /* [particles] of model->particle, -1 */
  PetscBool *breakable;    /* [facets] */
} CouplingWeights;

struct _p_CouplingModel {
  MPI_Comm             comm;
  const CouplingSplit *split;
  CouplingOptions      options;
  FemModel             fem;
  DemModel             dem;         /* with a part: owned, and NULL while the parts step */
  DemModel             part;        /* the particles shared out among ranks, which steps; NULL on one rank */
  PetscBool            whole_leads; /* dem has a state that part is to be given */
  DemState             copy;        /* with a part: of the overlap's particles alone, in particle[]'s order */
  DemRim               rim_copy;    /* and of all of the rim: u, force */
  CouplingRows         overlapping, rims; /* of particle[], of rim[] */
  MPI_Datatype         place_type, force_type;
  PetscInt             dim, ns; /* ns: 3 or 6 strain components */
  PetscReal            thickness, density, lambda, mu, speed; /* of pressure waves [m/s] */
  PetscBool            ready;

  PetscInt  n_top;     /* top cells of the element mesh */
  PetscInt *top;       /* [n_top] their number among all cells of the mesh */
  PetscReal *alpha;    /* [n_top] share of each element */

  PetscInt          n_particles, overlap_bonds;
  CouplingParticle *particle;
  PetscInt          n_rim;
  CouplingPoint    *rim;        /* [n_rim] in the particle model's order */
  PetscInt          n_edge;
  CouplingPoint    *edge;       /* [n_edge] the same facets in the cells' order, with */
  PetscReal        *edge_pull;  /* [n_edge][3] particle weight x area x normal [m2] */

  PetscInt   n_overlap;     /* elements of the overlap */
  PetscInt  *overlap;       /* [n_overlap] top cells */
  PetscReal *K;             /* [n_overlap][width*width] fitted stiffness beyond alpha C [N/m] */
  PetscBool  quadratic;     /* some cells of the overlap are */
  PetscInt   width;         /* most dofs of an overlap element */
  PetscReal *X;             /* [n_overlap][FEM_MAX_POINTS][36] its constitutive matrices [Pa] */
  PetscReal *g;             /* [nodes*dim] forces on the nodes [N] */

  PetscReal     *before, *total; /* of an in-situ stress, NULL without: displacement [nodes][dim] that makes it in an elastic body, and the nodes' with it [m] */
  PetscReal      insitu[3][3];   /* its strain */
  PetscInt       substeps;  /* particle steps in one step of the outer elements; the Stepper's step is the latter */
  PetscBool      far;       /* the outer elements go implicitly */
  PetscReal      reference; /* step the springs belong to whatever the run's is, 0 = the run's [s] */
  PetscReal      initial, initial_work; /* [J] in a preloaded body beyond the elements' own; work of the particles' weight before the run */
  PetscReal      through[2]; /* [N] largest mean force of elements and bonds in relaxations so far */
  PetscReal      relaxed;   /* [J] taken by the drag of relaxations on particles */
  PetscReal      limit;     /* largest step of the particles [s] */
  PetscReal     *slip, absorbed; /* [n_particles][3] of an absorber: mismatch of velocities of the half step before [m/s]; what it took [J] */
  PetscBool      holding, moving; /* multipliers are in charge, no springs; the first step is done */
  PetscInt       n_held, *held; /* of multipliers: nodes under them, [nodes] their number there or -1 */
  PetscReal     *q0, *present, *drive, solves; /* [n_particles][3] mismatch held [m]; [nodes][dim] and [n_particles] work; solves so far */
  KSP            ksp;
  Vec            right, solved;
  PetscReal      dt;        /* particles' step, which P belongs to; 0 = none yet */
  PetscReal      given;     /* particles' step of a run that goes on, whose Stepper's step is a multiple that substeps must divide; 0 = none */
  PetscReal      body_mass[4]; /* [kg], [kg m] mass and first moments of both sides together; 0 = not held to */
  PetscBool      unstable;  /* a trial gains energy: only where `given` is */
  CouplingReport report;

  Stepper    fem_stepper, dem_stepper;
  PetscInt   n_history;
  const char **history_name, **history_unit;
};

/* coupling_split.c */
PetscErrorCode CouplingGroupCells_Internal(const Mesh *whole, const char *name, PetscBool is_dem[]);
PetscErrorCode CouplingRings_Internal(const Mesh *whole, const PetscBool marked[], PetscInt width, PetscInt ring[], PetscInt reach[]);
PetscErrorCode CouplingSplitCells_Internal(const Mesh *whole, const PetscBool marked[], const char *name, PetscInt width, CouplingSplit *split);
PetscErrorCode CouplingRegion_Internal(const Mesh *whole, const PetscBool marked[], PetscInt width, Mesh *region);
/* coupling_locate.c */
PetscErrorCode CouplingShapes_Internal(MeshCellType type, const PetscReal *x, PetscInt dim, const PetscReal point[3], PetscReal N[FEM_MAX_NODES], PetscReal dN[FEM_MAX_NODES][3], PetscReal *outside);
PetscErrorCode CouplingLocate_Internal(CouplingModel model, const PetscReal point[3], PetscReal tolerance, PetscBool *found, CouplingPoint *at);
PetscReal      CouplingWeight_Internal(CouplingModel model, const CouplingPoint *at); /* alpha with floor */

/* coupling_fit.c */
PetscErrorCode CouplingFit_Internal(CouplingModel model);
/* coupling_force.c */
PetscErrorCode CouplingForces_Internal(CouplingModel model);
PetscErrorCode CouplingEnergy_Internal(CouplingModel model, PetscReal *spring, PetscReal *strain);

/* coupling_absorb.c */
PetscErrorCode CouplingAbsorb_Internal(CouplingModel model, PetscReal dt, PetscBool booked);
/* coupling_multiplier.c */
PetscErrorCode CouplingMultiplierSetUp_Internal(CouplingModel model);
PetscErrorCode CouplingMultiplierHold_Internal(CouplingModel model);
PetscErrorCode CouplingMultiply_Internal(CouplingModel model, PetscReal h, PetscReal dt);
PetscErrorCode CouplingMultiplierDestroy_Internal(CouplingModel model);

/* coupling_stepper.c */
/* Faults of both sides, the elements' first. */
PetscErrorCode CouplingWatch_Internal(const Stepper *fem, const Stepper *dem, RunWatch look, char fault[BASE_LINE]);
PetscErrorCode CouplingGiveNodes_Internal(CouplingModel model); /* forces on the nodes, the rim's included, to the elements */
PetscErrorCode CouplingRimForces_Internal(CouplingModel model); /* adds the rim's to model->g */
/* coupling_far.c */
PetscErrorCode CouplingChooseFar_Internal(CouplingModel model, PetscBool *implicit);
/* coupling_relax.c */
PetscErrorCode CouplingRelax_Internal(CouplingModel model, PetscReal t, PetscReal h); /* a load step from t to t + h */
/* What the overlap sees of its particles and of the rim: of the whole model, or copies that Pull brings. */
PetscErrorCode CouplingParticles_Internal(CouplingModel model, DemState *s);
PetscErrorCode CouplingRim_Internal(CouplingModel model, DemRim *rim);
/* coupling_ranks.c: nothing to do on one rank */
PetscErrorCode CouplingCheckPart_Internal(CouplingModel model);
PetscErrorCode CouplingPartSetUp_Internal(CouplingModel model);
PetscErrorCode CouplingPartDestroy_Internal(CouplingModel model);
PetscErrorCode CouplingGather_Internal(CouplingModel model); /* the parts' state to the whole model of every rank, which must be there */
PetscErrorCode CouplingSpread_Internal(CouplingModel model); /* and back */
PetscErrorCode CouplingForget_Internal(CouplingModel model); /* the whole model goes, once the parts lead */
PetscErrorCode CouplingRecall_Internal(CouplingModel model, DemModel dem, const DemPacking *packing, const DemCells *cells); /* and comes again, made anew but not set up: weights, set-up, state */
/* coupling_weights.c. particle: out, where those of the overlap are, with room for all; NULL: known already */
PetscErrorCode CouplingWeightsCreate_Internal(CouplingModel model, const DemPacking *packing, const DemCells *cells, CouplingParticle *particle, CouplingWeights *w);
PetscErrorCode CouplingWeightsGive_Internal(CouplingModel model, const CouplingWeights *w, const DemPacking *packing, DemModel dem); /* to a model that is not yet set up */
PetscErrorCode CouplingWeightsDestroy_Internal(CouplingWeights *w);
PetscErrorCode CouplingGive_Internal(CouplingModel model, DemModel dem, const DemPacking *packing, const DemCells *cells); /* all three */
PetscErrorCode CouplingPull_Internal(CouplingModel model);
PetscErrorCode CouplingPush_Internal(CouplingModel model);
PetscErrorCode CouplingPullRim_Internal(CouplingModel model);
PetscErrorCode CouplingAddForces_Internal(CouplingModel model, const PetscReal more[]); /* [3][n_particles], on one rank too */
/* coupling_static.c */
PetscErrorCode CouplingPreload_Internal(CouplingModel model);
PetscErrorCode CouplingStartStressed_Internal(CouplingModel model); /* under in-situ stress as it is, without a preload */
/* coupling_substep.c */
PetscErrorCode CouplingChooseSubsteps_Internal(CouplingModel model);
PetscErrorCode CouplingStart_Internal(CouplingModel model, PetscReal dt); /* forces of the present state for the particles' step dt */

/* f[dim] += scale B^T s: nodal force of stress s (Voigt) where the node's shape function has gradient g */
static inline void CouplingNodeForce(PetscInt dim, const PetscReal g[3], const PetscReal *s, PetscReal scale, PetscReal *f)
{
  if (dim == 2) {
    f[0] += scale * (g[0] * s[0] + g[1] * s[2]);
    f[1] += scale * (g[1] * s[1] + g[0] * s[2]);
  } else {
    f[0] += scale * (g[0] * s[0] + g[1] * s[3] + g[2] * s[5]);
    f[1] += scale * (g[1] * s[1] + g[0] * s[3] + g[2] * s[4]);
    f[2] += scale * (g[2] * s[2] + g[1] * s[4] + g[0] * s[5]);
  }
}

/* Displacement of an in-situ stress at x [m]. */
static inline void CouplingBefore(CouplingModel model, const PetscReal x[3], PetscReal u[3])
{
  for (PetscInt i = 0; i < 3; i++) u[i] = model->insitu[i][0] * x[0] + model->insitu[i][1] * x[1] + model->insitu[i][2] * x[2];
}

/* Stiffness of a particle's spring [N/m].  Eqs (6.3), (6.53), (6.54) */
static inline PetscReal CouplingSpring(CouplingModel model, const CouplingParticle *particle)
{
  if (model->options.method == COUPLING_PENALTY) return particle->P;
  if (model->holding || model->dt <= 0) return 0;
  return (model->options.absorber ? COUPLING_SPRING : 1) * particle->c / (model->dt * model->dt);
}

/* Largest stable step of the whole over the smaller critical step of its sides.  Eqs (6.9), (6.55) */
static inline PetscReal CouplingStepShare(const CouplingOptions *options)
{
  return 0.5 * PetscSqrtReal(options->absorber ? 4 - COUPLING_SPRING - 2 * COUPLING_DRAG : 3);
}

/* The particles that step. */
static inline DemModel CouplingMoving(CouplingModel model)
{
  return model->part ? model->part : model->dem;
}

static inline const Mesh *CouplingMesh(CouplingModel model)
{
  return &model->split->fem;
}
