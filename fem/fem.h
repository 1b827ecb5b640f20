/* fem.h - elastic body on PETSc: everything another module may know. SI units. Eqs (2.x), docs/theory.md */
#pragma once
#include "mesh.h"
#include "run.h"
#include "table.h"

typedef struct _p_FemModel *FemModel; /* fields live in fem_impl.h */

typedef enum { FEM_SOLID, FEM_PLANE_STRAIN, FEM_PLANE_STRESS } FemKind;
typedef enum { FEM_STATIC, FEM_EXPLICIT, FEM_IMPLICIT, FEM_MODAL } FemMethod;
typedef enum { FEM_DISPLACEMENT, FEM_VELOCITY } FemMotion;
typedef enum { FEM_ENHANCED, FEM_FULL } FemElement; /* quad4, hex8, quadratic hexahedra and prisms: free of locking, or plain with full integration */

typedef enum { FEM_SMALL, FEM_COROTATIONAL } FemRotation;

typedef struct {
  PetscReal density; /* [kg/m3] */
  PetscReal young;   /* [Pa] */
  PetscReal poisson; /* [-] in (-1, 1/2) */
  PetscBool orthotropic;       /* then young and poisson are not read, but these:  Eq. (2.40) */
  PetscReal E[3], nu[3], G[3]; /* along axes 1, 2, 3 [Pa]; nu_ij contraction along j when pulled along i, G_ij [Pa]: 12, 13, 23 */
  PetscReal axis[2][3];        /* directions of 1 and 2, any length, 2 made square to 1; all 0: x and y */
} FemMaterial;

/* Arrays on loan; valid until FemModelRestoreState(). Explicit models on one rank; nodes in the mesh's order of use. */
typedef struct {
  PetscInt         dim, n_nodes;
  const PetscReal *x;        /* [n_nodes][dim] reference position [m] */
  PetscReal       *u, *v;    /* [n_nodes][dim] displacement [m], half-step velocity [m/s] */
  const PetscReal *mass;     /* [n_nodes] lumped mass [kg] */
  PetscReal       *f_ext;    /* [n_nodes][dim] force from outside [N]; callers add, the step clears it. Whoever adds a force
                                books its work: the model's ledger counts loads and supports only */
} FemState;

PetscErrorCode FemModelCreate(MPI_Comm comm, FemModel *model);
PetscErrorCode FemModelSetName(FemModel model, const char *name); /* heads its block in frames; "fem" unless set */
PetscErrorCode FemModelSetKind(FemModel model, FemKind kind, PetscReal thickness); /* thickness [m], ignored for a solid */
PetscErrorCode FemModelSetMethod(FemModel model, FemMethod method);
PetscErrorCode FemModelSetElement(FemModel model, FemElement element);
PetscErrorCode FemModelSetMesh(FemModel model, const Mesh *mesh); /* copies what it needs; call before groups are named */
PetscErrorCode FemModelAddMaterial(FemModel model, const char *group, const FemMaterial *material); /* "" = the whole body */

/* component 0..dim-1; the table's integral is the displacement when motion is FEM_VELOCITY. Any group dimension. */
PetscErrorCode FemModelFix(FemModel model, const char *group, PetscInt component, FemMotion motion, const Table *table);
/* No motion along the normal of a flat facet group, whatever its direction; planes may meet. Eqs (2.70)-(2.74) */
PetscErrorCode FemModelSetSymmetry(FemModel model, const char *group);
/* traction [Pa] = direction x table on a facet group; pressure [Pa] positive when it pushes into the body. */
PetscErrorCode FemModelAddTraction(FemModel model, const char *group, const PetscReal direction[3], const Table *table);
PetscErrorCode FemModelAddPressure(FemModel model, const char *group, const Table *table);
/* Total force [N] = direction x table: over a facet group by area, an edge group by length, points alike; force per length [N/m] on an
   edge group. Eq. (2.75) */
PetscErrorCode FemModelAddForce(FemModel model, const char *group, const PetscReal direction[3], const Table *table);
PetscErrorCode FemModelAddLineLoad(FemModel model, const char *group, const PetscReal direction[3], const Table *table);
PetscErrorCode FemModelSetGravity(FemModel model, const PetscReal gravity[3]); /* [m/s2] */
/* Stress before any displacement, base + slope (x_axis - level) [Pa], Voigt xx yy zz xy yz zx; group "" = the whole body. Eq. (2.76) */
PetscErrorCode FemModelSetInitialStress(FemModel model, const char *group, const PetscReal base[6], const PetscReal slope[6], PetscInt axis, PetscReal level);
/* Linear expansion [1/K] of the material given to this group; a temperature rise (field[0] + field[1..3].x) x table [K]. Eq. (2.77) */
PetscErrorCode FemModelSetExpansion(FemModel model, const char *group, PetscReal expansion);
PetscErrorCode FemModelAddTemperature(FemModel model, const char *group, const PetscReal field[4], const Table *table);
PetscErrorCode FemModelSetInitialVelocity(FemModel model, const PetscReal velocity[3]);
PetscErrorCode FemModelSetDamping(FemModel model, PetscReal alpha); /* mass-proportional, [1/s]; explicit, implicit */
PetscErrorCode FemModelSetStiffnessDamping(FemModel model, PetscReal beta); /* C = beta K, [s]; implicit only */
/* Generalised-alpha with this spectral radius at high frequency, in [0, 1]; < 0 (unless set): Newmark's average acceleration. Mass
   consistent, or lumped. Eqs (2.50)-(2.52) */
PetscErrorCode FemModelSetImplicit(FemModel model, PetscReal rho_inf, PetscBool lumped);
/* Dynamics that begin at rest in static equilibrium with the loads and supports of t = 0. Eq. (2.58) */
PetscErrorCode FemModelSetPreload(FemModel model, PetscBool preload);
/* Displacement at t = 0 is the caller's, given after set-up through FemState: FemModelHoldStart() puts supports where they stand then,
   FemModelStartHere() makes what the state holds the start of the run. Explicit, one rank. */
PetscErrorCode FemModelSetStartGiven(FemModel model, PetscBool given);
PetscErrorCode FemModelHoldStart(FemModel model);
/* r [nodes][dim] = loads + outside - K u of the present displacement [N], zero where motion is prescribed; outside [nodes][dim] may be NULL. */
PetscErrorCode FemModelGetResidual(FemModel model, const PetscReal *outside, PetscReal *r);
PetscErrorCode FemModelGetForces(FemModel model, PetscReal *r); /* the same as it stands after a step, nothing computed anew, without what is from outside */
PetscErrorCode FemModelStartHere(FemModel model);
/* Elements that turn as far as they like, of small strain in axes that turn with each. Explicit, isotropic. Eqs (2.86)-(2.89) */
PetscErrorCode FemModelSetRotation(FemModel model, FemRotation rotation);
/* Nodes of the group (any dimension) against a rigid plane through point, its normal towards the body; friction mu against sliding,
   restitution in [0, 1] of what a node has when it meets the plane (explicit only); velocity [3] tables of the plane's motion [m/s], n = 0 at rest, or
   NULL. The push is part of the group's reaction; of an implicit step its mean. Eqs (2.120)-(2.139) */
PetscErrorCode FemModelAddPlane(FemModel model, const char *group, const PetscReal point[3], const PetscReal normal[3], PetscReal friction, PetscReal restitution, const Table *velocity);
/* A facet group that lets waves out: dashpots rho c_p and rho c_s of the material behind it. Eqs (2.60)-(2.62) */
PetscErrorCode FemModelAddAbsorber(FemModel model, const char *group);
PetscErrorCode FemModelSetLocalDamping(FemModel model, PetscReal alpha); /* non-viscous, in [0, 1), eq. (5.3); explicit only */
PetscErrorCode FemModelGetLocalDamping(FemModel model, PetscReal *alpha);
PetscErrorCode FemModelGetDamping(FemModel model, PetscReal *alpha); /* mass-proportional [1/s] */
PetscErrorCode FemModelSetThreads(FemModel model, PetscInt threads);

/* A history quantity over a group: "reaction", "displacement" (mean), "velocity" (mean), one column per component; "opening":
   how far the two parts of a group (lips of a notch, say) have moved apart, along the line between them; "error": of the whole body,
   whatever the group, the share of FemModelComputeError(). */
PetscErrorCode FemModelAddHistory(FemModel model, const char *quantity, const char *group);

/* Mean place [m] of a group's nodes, undeformed; what its mean displacement belongs to. Collective. */
PetscErrorCode FemModelGetGroupMiddle(FemModel model, const char *group, PetscReal middle[3]);
/* Columns of a point of the body: "displacement", "velocity", "stress", "strain", "von_mises", "principal_stress", named quantity(name).part. After
   FemModelSetMesh(), before set-up; at [dim] [m]. Only the patches around the probes are recovered, and only when a row is written. */
PetscErrorCode FemModelAddProbe(FemModel model, const char *name, const PetscReal at[3], PetscInt n, const char *const quantity[]);
/* The same, for a point that need not be in the elements: its columns are nan where it is not. One rank. */
PetscErrorCode FemModelAddProbeAnywhere(FemModel model, const char *name, const PetscReal at[3], PetscInt n, const char *const quantity[]);

/* For a coupling, before set-up: share of each element's stiffness and mass, > 0, in the mesh's order of top-dimension cells. */
PetscErrorCode FemModelSetCellWeights(FemModel model, const PetscReal weight[]);
/* mass [kg] each node has beyond its elements' (less where negative), in the mesh's order; one rank. */
PetscErrorCode FemModelSetExtraMass(FemModel model, const PetscReal mass[]);

PetscErrorCode FemModelSetUp(FemModel model);
/* How systems with a body's matrix are solved: a rule by size, order, Poisson's ratio and ranks, or what -fem_ksp_type and -fem_pc_type
   say. order: 2 where all elements are quadratic and the run is static; poisson: the largest of the body. */
typedef enum { FEM_CHOLMOD, FEM_MUMPS, FEM_MULTIGRID, FEM_TWO_LEVEL } FemSolver;
FemSolver      FemSolverRule(PetscInt dim, PetscInt order, PetscReal dofs, PetscReal poisson, PetscInt ranks);
PetscErrorCode FemSolverWords(PetscInt dim, PetscInt order, PetscReal dofs, PetscReal poisson, PetscInt ranks, size_t size, char words[]); /* options included */

/* Explicit: 2/omega_max by power iteration to 1 %, and the rigorous element bound that never exceeds it.
   Static: PETSC_MAX_REAL. Eq. (2.12). sets: which element sets it, for the plan. */
PetscErrorCode FemModelGetCriticalStep(FemModel model, PetscReal *dt);
PetscErrorCode FemModelGetStableStep(FemModel model, PetscReal *dt);

PetscErrorCode FemModelGetStepper(FemModel model, Stepper *stepper); /* borrowed from the model */
/* A field gathered to rank 0 in the mesh's order: "displacement", "velocity", "reaction" [nodes][3]; "element_stress" [Pa],
   "element_strain" [elements][6] Voigt xx yy zz xy yz zx, element means. data is the caller's; ignored on other ranks. Collective. */
PetscErrorCode FemModelGetField(FemModel model, const char *name, PetscReal *data);
/* Points of recovered fields on rank 0 (none elsewhere): the nodes in the mesh's order, then a copy of each node for every further material that
   meets there. node [n] is borrowed. Recovered stress [Pa] and strain [-] of these points, [n][6]; either may be NULL. Eqs (2.90)-(2.93). Collective. */
PetscErrorCode FemModelGetPoints(FemModel model, PetscInt *n, const PetscInt **node);
PetscErrorCode FemModelRecover(FemModel model, PetscReal *stress, PetscReal *strain);
/* Estimate of the present error: norm [sqrt(J)] in energy, and its share of the whole energy norm [-]. Eqs (2.97), (2.98). Collective. */
PetscErrorCode FemModelComputeError(FemModel model, PetscReal *share, PetscReal *norm);
/* A straight crack and the ring around its front over which J is taken. */
typedef struct {
  PetscReal tip[3];       /* of the crack, or a point of its front [m] */
  PetscReal direction[3]; /* in which it would go, any length */
  PetscReal front[3];     /* along the front, square to direction, and [m] how long; solids only */
  PetscReal length;
  PetscReal inner, outer; /* radii of the ring [m]; inner may be 0 */
  PetscBool half;         /* the body is one side of the crack's plane, which is a plane of symmetry */
} FemCrack;
/* Energy release rate [J/m2], the mean over the front. Lips bear no load, and no weight or inertia matters inside the ring. Eq. (2.95). Collective. */
PetscErrorCode FemModelGetJ(FemModel model, const FemCrack *crack, PetscReal *J);
typedef struct {
  PetscInt  recoveries, patches; /* of the whole body, done so far; patches fitted, those for probes too */
  PetscBool error_known;
  PetscReal error_share, error_norm; /* [-], [sqrt(J)] the last estimate asked for */
  PetscInt  iterations;              /* of the last solve with a matrix; 1 with a factor, 0 when nothing was solved */
  PetscInt  turns;                   /* forces of a corotational element worked out on this rank */
} FemReadings;
PetscErrorCode FemModelGetReadings(FemModel model, FemReadings *readings);
PetscErrorCode FemModelGetState(FemModel model, FemState *state);
PetscErrorCode FemModelRestoreState(FemModel model, FemState *state);
/* Largest turn of an element [rad] now or at a frame before: a small-strain body takes 1 - cos of it for strain. Eq. (2.85). Collective. */
PetscErrorCode FemModelGetTurn(FemModel model, PetscReal *angle);
/* Elements that lock near nu = 1/2: linear triangles, tetrahedra and prisms, and plain quad4 and hex8, of a material beyond nu = 0.45 that is not in
   plane stress; what they are called (borrowed; of the first kind), and the largest such nu. Collective. */
PetscErrorCode FemModelGetLocking(FemModel model, PetscInt *elements, const char **word, PetscReal *poisson);
/* What is left of all forces on the body [N], and of their moment [N m]; round-off in a sound run. Eq. (2.84). Collective. */
PetscErrorCode FemModelGetBalance(FemModel model, PetscReal *force, PetscReal *moment);
PetscErrorCode FemModelGetCounts(FemModel model, PetscInt *nodes, PetscInt *elements, PetscInt *dofs); /* global */

/* Sub-steps, for a coupling: elements with inner[] true (the mesh's order of top-dimension cells) and their nodes go in m steps of dt, the
   rest in one of m dt. After set-up, before the first step; explicit, one rank. m = 1 takes it back. critical [s]: of the rest
   alone; may be NULL. From then on the model advances by FemModelSubStep(), k = 0 .. m - 1, from t to t + dt: outer nodes move
   whole with k = 0; frames, energies and checkpoints belong between macro steps. Eqs (6.10)-(6.12) */
PetscErrorCode FemModelSetInnerCells(FemModel model, const PetscBool inner[], PetscInt m, PetscReal *critical);
PetscErrorCode FemModelSubStep(FemModel model, PetscReal t, PetscReal dt, PetscInt k);
/* Forces [N] of a displacement alone, [nodes][dim]: impulses of the macro step H, forces of the sub-steps; mobility [1/kg], 0 = prescribed. */
PetscErrorCode FemModelSubForces(FemModel model, PetscReal H, const PetscReal *u, PetscReal *slow, PetscReal *fast, PetscReal *mobility);
/* A far field, for a coupling: elements with near[] true (the mesh's order of top-dimension cells) and their nodes step by central differences,
   m steps of dt; the others by average acceleration in one of m dt. The nodes between exist twice, tied in velocity. After set-up,
   before the first step; explicit, one rank; again to change m alone. critical [s]: of the near elements; may be NULL. From then on the
   model advances by FemModelFarStep(), k = 0 .. m - 1; frames, energies and checkpoints belong between far steps. Eqs (6.20)-(6.28) */
PetscErrorCode FemModelSetFar(FemModel model, const PetscBool near[], PetscInt m, PetscReal *critical);
PetscErrorCode FemModelFarStep(FemModel model, PetscReal t, PetscReal dt, PetscInt k);
/* A static far field instead: the near elements relax under its pull, b - S u of the face, S condensed to a dense matrix of the face where that
   is cheaper than a solve each time. A load step: FemModelFarLoad() to t + h, FemModelFarRelax() as often as it takes, s of the load there, and
   FemModelFarFinish(). Eqs (6.40)-(6.44) */
typedef enum { FEM_CONDENSE_AUTO, FEM_CONDENSE_ALWAYS, FEM_CONDENSE_NEVER } FemCondense;
typedef struct {
  PetscReal change, moving; /* sums over the near nodes: v.(force before - force), v.M v */
  PetscReal left, free, through, all; /* |out of balance| and how many, |internal force| and how many */
} FemRelax;
PetscErrorCode FemModelSetFarStatic(FemModel model, const PetscBool near[], FemCondense condense, PetscReal *critical);
PetscErrorCode FemModelFarLoad(FemModel model, PetscReal t, PetscReal h, PetscReal dt);
PetscErrorCode FemModelFarRelax(FemModel model, PetscReal s, PetscReal keep, FemRelax *sums); /* adds to sums */
PetscErrorCode FemModelFarFinish(FemModel model);
typedef struct {
  PetscBool dense; /* static: condensed */
  PetscReal entries; /* and of its factor, PETSC_MAX_REAL unless direct */
  PetscInt  solves;
  PetscInt  steps, face; /* near steps in a far one, 0 = no far field; unknowns of the face */
  PetscReal taken;       /* energy that went at the face so far [J], part of the ledger's coupling */
  PetscReal apart;       /* largest distance between the two copies of a node [m] */
} FemFarReport;
PetscErrorCode FemModelGetFar(FemModel model, FemFarReport *report);
/* Goes on where `from` stands, at the same instant, with fewer elements: node i is node[i] of from. After set-up, before the first step; explicit, one rank. */
PetscErrorCode FemModelContinue(FemModel model, FemModel from, const PetscInt node[]);
PetscErrorCode FemModelDestroy(FemModel *model);
