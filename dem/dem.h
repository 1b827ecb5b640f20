/* dem.h - bonded particles: everything another module may know. SI units. Eqs (4.x), (5.x), docs/theory.md */
#pragma once
#include "dem_cells.h"
#include "dem_clump.h"
#include "dem_contact.h"
#include "dem_failure.h"
#include "dem_tool.h"
#include "run.h"
#include "table.h"

typedef struct _p_DemModel *DemModel; /* fields live in dem_impl.h */

typedef enum { DEM_SOLID, DEM_PLANE_STRAIN, DEM_PLANE_STRESS } DemKind;
typedef enum { DEM_DISPLACEMENT, DEM_VELOCITY } DemMotion;

typedef struct {
  PetscReal density; /* [kg/m3] */
  PetscReal young;   /* [Pa] */
  PetscReal poisson; /* [-] in (-1, 1/2) */
} DemMaterial;

/* The bonds' elastic rule. All but `exact` are springs between centres, k_n and k_s = k_n/2(1+nu).  Eqs (4.40)-(4.49) */
typedef enum { DEM_EXACT, DEM_ONATE2015, DEM_KDEM, DEM_GIVEN } DemElasticity;
typedef struct {
  DemElasticity elasticity;
  PetscReal     range;                            /* onate2015, given, polyhedron: bonded when the gap is within +- range (r_p + r_q) */
  PetscReal     area_factor;                      /* onate2015, given: alpha of the circle's area; 0 = 40 P/N_c of the packing */
  PetscReal     normal_factor, shear_factor;      /* onate2015, kdem: on k_n and k_s */
  PetscReal     normal_stiffness, shear_stiffness; /* given: [N/m] */
  PetscBool     poisson_term;                     /* kdem: lateral stress of an earlier step acts along the bond; derives from no energy */
  PetscBool     polyhedron;                       /* kdem: pairs within `range`, areas of virtual regular polyhedra in place of facets.  Eqs (4.66)-(4.68) */
  PetscBool     sphere_pressure;                  /* a pressed particle takes p pi r^2 (2D: 2 p r t) at its centre, not p times its facet */
} DemRule;

/* Arrays on loan; valid until DemModelRestoreState(). Component-major, a[c*n + p], in the model's own order. */
typedef struct {
  PetscInt         dim, n, own; /* the first `own` move here: all on one rank */
  const PetscInt  *number; /* [n] the packing's number of each particle */
  const PetscReal *x0;     /* [3][n] rest position [m] */
  PetscReal       *u, *v;  /* [3][n] displacement [m], half-step velocity [m/s] */
  PetscReal       *rot;    /* [4][n] 3D: unit quaternion w x y z; 2D: sin, cos - 1, angle [rad] */
  PetscReal       *spin;   /* [3][n] angular velocity, half-step [rad/s]; 2D: first row */
  const PetscReal *f, *torque;     /* [3][n] force [N], couple [N m] of the present state; 2D: couple in the first row */
  const PetscReal *mass, *inertia; /* [n] [kg], [kg m2] */
  PetscReal       *f_ext, *t_ext;  /* [3][n] force [N] and couple [N m] from outside (2D: about z, third row); the caller keeps them current */
} DemState;

typedef enum { DEM_DOMAIN_OPEN, DEM_DOMAIN_BOX, DEM_DOMAIN_PERIODIC } DemDomain;

/* How particles that are not bonded meet.  Eqs (5.20)-(5.40) */
typedef struct {
  DemContactChoice choice;        /* of every pair without its own */
  DemDomain        domain;
  PetscReal        low[3], high[3]; /* of the box or the period; a period with low = high along an axis is open there */
  PetscReal        skin;          /* of the neighbour list, in mean radii; 0: 0.3 */
  PetscReal        deepest;       /* Hertz: largest overlap / radius the step is made for; 0: 0.01. A run that passes it stops */
  PetscBool        push;          /* overlaps at the start push; default: they are stress-free until the pair has parted */
} DemContactOptions;

typedef struct {
  PetscInt  searches, searched, pairs, touching, left; /* searched: particles that can meet a new partner */
  PetscReal deepest;                                   /* overlap / radius so far */
} DemContactCounts;

/* A rigid plane: inside is n.(x - point) >= 0. */
typedef struct {
  PetscReal point[3], normal[3];
  PetscReal friction;  /* Coulomb coefficient */
  PetscReal stiffness; /* [Pa]: contact stiffness is stiffness x radius; 0 = the material's Young's modulus */
  PetscReal damping;   /* fraction of critical, normal direction */
} DemPlane;

/* On several ranks every rank is given the whole body; DemModelSetUp() keeps its part of it. From then on calls are collective, and counts and columns
   those of the whole body. What one rank alone does (clumps, rain) is refused at set-up. */
PetscErrorCode DemModelCreate(MPI_Comm comm, DemModel *model);
PetscErrorCode DemModelSetKind(DemModel model, DemKind kind);
PetscErrorCode DemModelSetThreads(DemModel model, PetscInt threads);
PetscErrorCode DemModelSetMaterial(DemModel model, const DemMaterial *material);
PetscErrorCode DemModelSetStrength(DemModel model, const DemStrength *strength); /* without it bonds never break */
PetscErrorCode DemModelSetRule(DemModel model, const DemRule *rule); /* before set-up; default: exact */
/* Particles bond within a group only; facets between two groups push and rub. group [packing's order]; needs a strength. */
PetscErrorCode DemModelSetGroups(DemModel model, const PetscInt group[]);
PetscErrorCode DemModelSetBody(DemModel model, const DemBody *body, const DemPacking *packing, const DemCells *cells); /* copies */
PetscErrorCode DemModelTakeBody(DemModel model, const DemBody *body, const DemPacking *packing, DemCells *cells); /* the same, but the cells become the model's own and are left empty */
PetscErrorCode DemModelSetBreakable(DemModel model, const PetscBool breakable[]); /* [facets of the cells]; default: all */
/* Strengths of each facet as a part of the material's, in (0, 1]; the energy it takes to break stays the material's. [facets of the cells]; default: 1 */
PetscErrorCode DemModelSetWeakness(DemModel model, const PetscReal part[]);
/* The facets that may break lie in one plane, a crack whose place is known: they open along their normals, not along the principal direction. */
PetscErrorCode DemModelSetCrackPlane(DemModel model, PetscBool plane); /* default false */
/* For a coupling, before set-up: weight of each particle's mass and of its volumetric energy [packing's order], of each facet's pair energy. */
PetscErrorCode DemModelSetWeights(DemModel model, const PetscReal mass[], const PetscReal volume[], const PetscReal facet[]);
/* A face that is no surface: the body goes on as another model, whose motion completes the dilation of the cells behind it.  Eq. (6.6) */
PetscErrorCode DemModelFindFace(DemModel model, const char *name, PetscInt *face); /* -1 when absent */
PetscErrorCode DemModelSetRim(DemModel model, const char *face);
PetscErrorCode DemModelSetBonded(DemModel model, PetscBool bonded); /* default true; loose grains need no cells: call it before DemModelSetBody() with NULL */

/* Contacts by these rules; without this call unbonded particles pass through each other. */
PetscErrorCode DemModelSetContact(DemModel model, const DemContactOptions *options);
/* Materials of the particles [packing's order], for loose grains, and the choice of one pair of them. */
PetscErrorCode DemModelSetGrainMaterials(DemModel model, PetscInt n, const DemMaterial material[], const PetscInt of[]);
/* Initial velocity of each of those materials, [n][3] [m/s]; default: that of the model. */
PetscErrorCode DemModelSetGrainVelocities(DemModel model, const PetscReal velocity[]);
PetscErrorCode DemModelSetContactPair(DemModel model, PetscInt a, PetscInt b, const DemContactChoice *choice);
/* The grains of DemPackingCreateRain() come one after the other, `rate` a second from time 0 on, into the body's box with the initial velocity. Needs
   contacts. One that finds no free place gives up its turn.  Eqs (5.83)-(5.86) */
PetscErrorCode DemModelSetRain(DemModel model, PetscReal rate, PetscInt seed);
/* Spheres of the packing that move as one rigid body each; loose grains in 3D with contacts, without local damping. After DemModelSetBody(); place
   [n] and its shapes stay with the caller, who keeps them until DemModelSetUp().  Eqs (5.90)-(5.99) */
PetscErrorCode DemModelSetClumps(DemModel model, PetscInt n, const DemClumpPlace place[]);
typedef struct {
  PetscReal mass, moments[3];          /* [kg], principal [kg m2] */
  PetscReal centre[3], velocity[3];    /* half-step velocity */
  PetscReal momentum[3];               /* angular, about the centre, half step [kg m2/s] */
  PetscReal quaternion[4];             /* of the axes the shape was given in */
} DemClumpState;
PetscErrorCode DemModelGetClump(DemModel model, PetscInt k, DemClumpState *state);
PetscErrorCode DemModelSetClumpMotion(DemModel model, PetscInt k, const PetscReal velocity[3], const PetscReal spin[3]); /* after set-up, before the first step */
PetscErrorCode DemModelGetContactCounts(DemModel model, DemContactCounts *counts);

/* Facet platens on a named face. Along the face's own normal alone: smooth. All components: glued. Other
   combinations are refused.  Eqs (4.10), (4.11) */
PetscErrorCode DemModelFix(DemModel model, const char *face, PetscInt component, DemMotion motion, const Table *table);
PetscErrorCode DemModelAddTraction(DemModel model, const char *face, const PetscReal direction[3], const Table *table); /* [Pa] */
PetscErrorCode DemModelAddPressure(DemModel model, const char *face, const Table *table);
PetscErrorCode DemModelSetGravity(DemModel model, const PetscReal gravity[3]);
PetscErrorCode DemModelSetInitialVelocity(DemModel model, const PetscReal velocity[3]);
/* Displacement u [packing's order][3] [m] that bonded particles begin with, copied: that of an in-situ stress. The state's u holds it, what is written of displacements
   is from there. One rank; no face may be held. Before set-up. */
PetscErrorCode DemModelSetStart(DemModel model, const PetscReal u[]);
PetscErrorCode DemModelSetLocalDamping(DemModel model, PetscReal alpha); /* non-viscous, in [0, 1) */
/* Before set-up. The options' surface becomes the model's (the caller's is emptied), tables are copied. */
PetscErrorCode DemModelAddTool(DemModel model, const char *name, DemToolOptions *options);
PetscErrorCode DemModelGetTool(DemModel model, const char *name, DemToolState *state);
/* The same for a plane; velocity: three tables [m/s] */
PetscErrorCode DemModelAddPlane(DemModel model, const char *name, const DemPlane *plane, const Table velocity[3]);

/* "reaction" of a face, "displacement" (mean of a face), "velocity"; of a tool also "force", "torque", "work". One column per component. */
PetscErrorCode DemModelAddHistory(DemModel model, const char *quantity, const char *group);
PetscErrorCode DemModelGetGroupMiddle(DemModel model, const char *group, PetscReal middle[3]); /* [m] area mean of a face, a tool's centre; at rest */

/* Columns that belong to no group: "gauge" (mean stress and strain of the middle half of the body's longest axis, and the secant
   modulus and Poisson's ratio along it), "quality" (unbalanced force ratio, kinetic / strain energy), "grains" (present, come, left).  Eqs (4.70), (4.71), (5.86) */
PetscErrorCode DemModelAddColumns(DemModel model, const char *quantity);
/* The two of "quality" at the row of largest strain energy so far; -1 without the columns. */
PetscErrorCode DemModelGetQuality(DemModel model, PetscReal *unbalanced, PetscReal *kinetic);
/* How far a crack of the cohesive law opens before nearly nothing (2 % of the strength) holds it [m], and the mean distance of particles whose bond
   may break [m]: cells smaller than two openings turn right round while they still hold. 0, 0 for what cannot break, or breaks by the published law. After set-up. */
PetscErrorCode DemModelGetCrackOpening(DemModel model, PetscReal *opening, PetscReal *distance);

/* Steps are load steps: equilibrium of the loads and supports at their end, without inertia. Bonded particles that cannot break, without tools and
   contacts, one rank. Before set-up; default false.  Eqs (4.80), (4.81) */
PetscErrorCode DemModelSetStatic(DemModel model, PetscBool is_static);
PetscErrorCode DemModelGetProducts(DemModel model, PetscInt *products); /* force evaluations that stood for a matrix, so far */
PetscErrorCode DemModelSetUp(DemModel model);
PetscErrorCode DemModelGetCriticalStep(DemModel model, PetscReal *dt); /* power iteration, 1 % */
PetscErrorCode DemModelGetStableStep(DemModel model, PetscReal *dt);   /* rigorous block bound, never above it.  Eq. (4.14) */
PetscErrorCode DemModelComputeForces(DemModel model);                   /* of a state the caller has changed */
/* force [3][n] [N] joins those of the present state, loads and failure done: multipliers, which follow from all the others. Until the next evaluation. */
PetscErrorCode DemModelAddForces(DemModel model, const PetscReal force[]);
PetscErrorCode DemModelGetStepper(DemModel model, Stepper *stepper);   /* borrowed from the model */
PetscErrorCode DemModelGetState(DemModel model, DemState *state);
PetscErrorCode DemModelRestoreState(DemModel model, DemState *state);
/* Particles that may meet what is not bonded to them, ascending in the model's own order, on loan until the next step. The list changes with `looks` only. */
typedef struct {
  PetscInt         n, looks;
  const PetscInt  *who;    /* [n] */
  const PetscReal *radius; /* of every particle [m] */
} DemOutside;
PetscErrorCode DemModelGetOutside(DemModel model, DemOutside *outside);
PetscErrorCode DemModelGetCounts(DemModel model, PetscInt *particles, PetscInt *bonds, PetscInt *walls);
/* What this rank holds. */
typedef struct {
  PetscInt own, ghosts;    /* particles that move here; copies of others' */
  PetscInt bonds, counted; /* bonds done here; those whose first end is its own */
  PetscInt facets;         /* of the cells */
  PetscInt pairs, copies;  /* that may touch, in the list; others' particles in it */
  PetscInt between;        /* pairs of two ranks that touch, counted here */
} DemShare;
PetscErrorCode DemModelGetShare(DemModel model, DemShare *share);
/* How a body of particles is shared out among ranks. Load: bonds, contacts and particles, counted; the busiest rank's over the mean. */
typedef struct {
  PetscInt  looks, times;  /* how often looked at; how often shared out anew */
  PetscReal before, after; /* load before and after it was last shared out of itself; 0: never was */
} DemSharing;
PetscErrorCode DemModelSetRebalance(DemModel model, PetscInt every); /* steps between looks; 0: owners stay those of the set-up */
PetscErrorCode DemModelMigrate(DemModel model, const PetscMPIInt owner[]); /* collective, between steps. owner [pieces]: rank of each; NULL: as shares are best now */
PetscErrorCode DemModelGetSharing(DemModel model, PetscInt *pieces, DemSharing *sharing);

/* One row per facet that has begun to break, in the cells' facet order; arrays on loan until the next step. */
typedef struct {
  PetscInt         n;
  const PetscInt  *facet;    /* [n] of the cells */
  const PetscReal *time;     /* [n] of first damage [s] */
  const PetscReal *damage;   /* [n] broken fraction D */
  const PetscReal *broken;   /* [n] 1 - t/sigma_t along the softening curve, or D of a shear break; 1 = carries nothing */
  const PetscReal *opening;  /* [n] normal component of the gap of the broken part [m] */
  const PetscReal *slide;    /* [n] tangential one [m] */
  const PetscReal *work;     /* [n] energy it took [J] */
  const PetscReal *along;    /* [n] |n.e|, facet normal against opening direction; projected area is area x along */
  const unsigned char *mode; /* [n] 1 tension, 2 shear */
} DemCracks;

/* Facets of the rim, on loan for the model's life: u is the caller's to keep current, force what the facets put on the other model [N]. */
typedef struct {
  PetscInt         n;
  const PetscReal *x;     /* [n][3] centroid at rest [m] */
  PetscReal       *u;     /* [n][3] displacement of the other model there [m] */
  const PetscReal *force; /* [n][3] [N] */
  const PetscInt  *number; /* [n] on several ranks: row on one; else NULL */
} DemRim;

PetscErrorCode DemModelGetRim(DemModel model, DemRim *rim);

/* A step in two halves, for a coupling: kick and drift to t + dt; then forces of the new state. */
PetscErrorCode DemModelAdvance(DemModel model, PetscReal t, PetscReal dt);
PetscErrorCode DemModelEvaluate(DemModel model, PetscReal dt);

/* Goes on where `from` stands, at the same instant, with more particles of one packing. particle [n]: from's number of each of the packing's, -1 = new; facet
   likewise, of the cells. After set-up, before the first step; the caller then gives new particles their state and asks for forces. */
PetscErrorCode DemModelContinue(DemModel model, DemModel from, const PetscInt particle[], const PetscInt facet[]);
/* near[k]: some tool's surface is within margin[k] of the point x[k], where it is now. x [n][3] [m]; a look at every triangle, for now and then */
PetscErrorCode DemModelHasTools(DemModel model, PetscBool *has);
PetscErrorCode DemModelNearTools(DemModel model, PetscInt n, const PetscReal x[], const PetscReal margin[], PetscBool near[]);
/* Columns of the particle whose cell holds a point at rest, quantity(name).part, as FemModelAddProbe()'s; nan where no particle does. */
PetscErrorCode DemModelAddProbe(DemModel model, const char *name, const PetscReal at[3], PetscInt n, const char *const quantity[]);
PetscErrorCode DemModelGetTime(DemModel model, PetscReal *t); /* of the present state [s] */
PetscErrorCode DemModelGetFacetUse(DemModel model, PetscInt n, const PetscInt facet[], PetscReal use[]); /* fraction of their strength [n], of the cells' facets */

/* On several ranks rank 0 has all rows, the others none. */
PetscErrorCode DemModelGetCracks(DemModel model, DemCracks *cracks);
PetscErrorCode DemModelGetCrackPlace(DemModel model, PetscInt row, PetscReal at[3], PetscReal normal[3], PetscReal *area); /* as DemModelGetFacet(), of a row of the last list */
/* One row per bond, on loan until the next call. */
typedef struct {
  PetscInt             n;
  const PetscInt      *p, *q;     /* [n] packing's numbers */
  const PetscReal     *sigma, *tau; /* [n] normal stress, tension positive, and size of the shear stress, over the bond's area [Pa] */
  const PetscReal     *damage;    /* [n] 1 = broken */
  const PetscReal     *criterion; /* [n] 0 unloaded, 1 at its strength, softening or broken; 0 where the material does not break.  Eq. (4.63) */
  const unsigned char *state;     /* [n] 0 intact, 1 softening, 2 broken, 3 parted, or of two groups */
} DemBondList;

PetscErrorCode DemModelGetBonds(DemModel model, DemBondList *list);
/* Parts that bonds still hold together: fragment [packing's order] of each particle, 0 the heaviest. Returns how many. */
PetscErrorCode DemModelGetFragments(DemModel model, PetscInt *n, PetscInt fragment[]);
PetscErrorCode DemModelGetFacet(DemModel model, PetscInt facet, PetscReal at[3], PetscReal normal[3], PetscReal *area); /* at rest: centroid [m], unit normal, [m2] */
PetscErrorCode DemModelDestroy(DemModel *model);
