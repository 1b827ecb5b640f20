/*
  fem_impl.h - the insides of a FemModel, shared by the files of fem/ only.

  Ranks. Each element and each node belongs to one rank. A rank keeps the elements it owns and those that touch
  a node it owns, so every row of an owned node is complete here: owners compute, and ghosts receive motion only.
  Owned nodes come first, then ghosts, each in the order of their global number, which is the mesh's. Sums into a node run
  over elements in global order: the same bits whatever the number of ranks and threads.
*/
#pragma once
#include <petscksp.h>
#include <petscsf.h>
#include "fem.h"
#include "fem_batch.h"
#include "fem_body.h"
#include "fem_element.h"

/* A named part of the mesh on this rank. */
typedef struct {
  char      name[128];
  PetscInt  dim;
  PetscInt  n_nodes;
  PetscInt *node; /* [n_nodes] owned nodes, ascending */
  PetscInt  n_cells;
  PetscInt *cell; /* [n_cells] local elements; dim == model's */
  PetscInt  n_facets;
  PetscInt *facet_cell, *facet_face; /* [n_facets] element and side; dim == model's - 1 */
  PetscReal *share;                  /* [n_nodes] of points and lines that are no facets: length [m] or number each node stands for; NULL */
  PetscReal  share_all;              /* their sum over the whole group */
  PetscInt  interior, loose;         /* facets with an element on both sides, with none; of the whole mesh */
  PetscInt  n_nodes_global;
} FemGroup;

typedef struct {
  PetscInt  group, component;
  FemMotion motion;
  Table     table;
} FemFix;

/* A plane of symmetry: no motion along the normal. straight: the normal is an axis, and a fix holds it. */
typedef struct {
  PetscInt  group;
  PetscReal normal[3];
  PetscBool straight;
} FemMirror;

/* What FemProject() puts where motion is prescribed. */
typedef enum { FEM_HOLD_ZERO, FEM_HOLD_POSITION, FEM_HOLD_VELOCITY } FemHold;

/* One side of an element with its shape-function integrals.  Eq. (2.8) */
typedef struct {
  PetscInt  n, node[FEM_MAX_FACE_NODES];
  PetscReal x[3 * FEM_MAX_FACE_NODES], N_dA[FEM_MAX_FACE_NODES], N_n_dA[3 * FEM_MAX_FACE_NODES];
} FemSide;

typedef enum { FEM_TRACTION, FEM_PRESSURE, FEM_FORCE, FEM_LINE_LOAD } FemLoadKind;

/* Nodal forces of a unit value on owned nodes; the table scales them. */
typedef struct {
  FemLoadKind kind;
  PetscInt    group;
  PetscReal   direction[3];
  Table       table;
  PetscInt    n;
  PetscInt   *node;  /* [n] owned */
  PetscReal  *force; /* [n][dim] [N] per unit of the table */
} FemLoad;

typedef struct {
  PetscInt    group; /* -1 = the whole body */
  FemMaterial material;
  PetscReal   expansion; /* [1/K] */
} FemRegion;

/* Stress before the run: base + slope x (coordinate along axis - level) [Pa], Voigt xx yy zz xy yz zx. */
typedef struct {
  PetscInt  group, axis; /* group -1 = the whole body */
  PetscReal base[6], slope[6], level;
} FemInSitu;

/* A temperature rise (field[0] + field[1..3].x) x table [K]. */
typedef struct {
  PetscInt  group; /* -1 = the whole body */
  PetscReal field[4];
  Table     table;
} FemHeat;

/* Stress that does not depend on displacement: source 0 is in-situ, the others are temperatures.  fem_thermal.c */
typedef struct {
  PetscInt   n_insitu, n_heat;
  FemInSitu *insitu;
  FemHeat   *heat;
  char      *inside;  /* [n_insitu + n_heat][n_cells] element is in the entry's group */
  PetscInt   n;       /* sources; 0 = none of this */
  PetscReal *pattern; /* [n][n_own*dim] nodal forces int B's per unit of the course [N] */
  PetscReal *gram;    /* [n][n] int s_k:C^-1:s_l [J] */
  PetscReal *course, *power, *course_old, *power_old; /* [n] now and before the last advance; power [J] = dU/d(course) */
  PetscReal *force;   /* [n_own*dim] sum of course x pattern */
} FemPre;

typedef enum { FEM_HIST_REACTION, FEM_HIST_DISPLACEMENT, FEM_HIST_VELOCITY, FEM_HIST_OPENING, FEM_HIST_NORMAL, FEM_HIST_ERROR, FEM_HIST_PROBE, FEM_HIST_BALANCE } FemQuantity;

typedef struct {
  FemQuantity quantity;
  PetscInt    group, component; /* group -1: of the whole body, or of a probe; component is then the column among the probes' */
  PetscReal   axis[3], middle; /* of an opening: direction, and where along it the group parts [m] */
} FemHistory;

/* Block rows of owned nodes. Row i: columns col[start[i]..start[i+1]) in global node order, a block of [dim][dim] each. */
typedef struct {
  PetscInt  *start; /* [n_own + 1] */
  PetscInt  *col;   /* [start[n_own]] local nodes */
  PetscReal *value; /* [start[n_own]][dim][dim] [N/m] */
  PetscInt   longest;
} FemRows;

/* Elements that go in m steps while the rest take one, and their nodes.  fem_substep.c */
typedef struct {
  PetscInt   m;             /* 0 = none */
  PetscInt   n, *node;      /* [n] inner nodes, ascending */
  PetscInt  *place;         /* [n_own] index into node, -1 = outer */
  PetscInt  *edge;          /* [n] 1: outer elements touch it too */
  PetscInt  *start, *col;   /* block rows of the inner elements: [n + 1]; local nodes */
  PetscReal *value;
  PetscReal *fast, *slow;   /* [n][dim] K u of inner elements, of the others, at the present displacement [N] */
  PetscReal *net, *correction, *work;
  PetscReal  kinetic;       /* [J] of the present level */
} FemInner;

/* Elements that go implicitly beside inner ones (FemInner holds those). Arrays [n_own*dim] unless said, zero where the far field has no mass.  fem_far.c */
typedef struct {
  PetscInt   m, k;          /* near steps in one of the far field, 0 = none; how many of the present one are done */
  PetscReal  dt;            /* near step the factor belongs to [s], 0 = none */
  PetscReal *near_mass, *far_mass; /* [n_own] [kg] of either side's elements */
  PetscInt   n_face, *face; /* free dofs that both sides have */
  PetscReal *Y, *inverse;   /* [n_face][n_face] [m/(s N)] velocity of the face per force on it, far side; inverse of both sides' */
  PetscReal *lambda, *lambda0, *right, *free[2]; /* [n_face] force on the near copy now and when the far step began [N]; work; free velocity at both its ends */
  PetscReal *u, *v, *a, *g; /* far copy at the last end of a far step; g = K u */
  PetscReal *u1, *v1, *a1, *g1, *f0, *f1, *pull; /* the coming end, free; loads at both ends; lambda on all dofs */
  PetscReal  link, level_link[2]; /* [J] work of the multipliers so far; of the present level before and after it */
  PetscReal  kinetic, apart;      /* near copy's [J]; largest distance between the copies [m] */
  PetscBool  closed;              /* the far field stands at the present time */
  /* static: fem_far_static.c */
  PetscBool  is_static, dense;
  PetscReal *S, *b0, *b1;         /* [n_face][n_face] [N/m], NULL unless dense; [2][n_face] force of loads, of supports on a face at rest, at both ends of the step */
  PetscReal *relax_mass, *was;    /* [n_own] [kg]; [n_own*dim] forces a step ago [N] */
  PetscReal *rest, *moved;        /* [2][n_own*dim] of a face at rest: displacement, K u less loads where prescribed; [n_face] motion of the last iteration [m] */
  PetscReal  share, along;        /* of the load that is there; work of loads and supports over the step with the face at rest [J] */
  PetscReal  from, to, factor_entries;
  PetscInt   solves;
} FemFar;

/* Sides that absorb waves.  fem_absorb.c */
typedef struct {
  PetscInt   n_groups, *group;
  PetscInt   n, *node; /* [n] owned nodes of such sides, ascending */
  PetscReal *block;    /* [n][dim][dim] dashpots of a node [N s/m] */
  PetscReal *force;    /* explicit: [n][dim] what they put on the node at the present level [N] */
  PetscReal *outside;  /* explicit: [n_own*dim] f_ext and these; NULL when nothing absorbs */
} FemAbsorb;

/* A rigid plane that the nodes of a group do not pass. */
typedef struct {
  PetscInt  group;
  PetscReal point[3], normal[3]; /* at t = 0 [m]; unit, towards the body */
  PetscReal friction, restitution;
  PetscBool moves;
  Table     velocity[3]; /* n = 0: at rest [m/s] */
} FemPlane;

/* What a node does on its plane, where the matrix decides: FEM_STICK is touching, without friction too. */
enum { FEM_CLEAR, FEM_STICK, FEM_SLIDE };

/* Nodes against planes.  fem_contact.c, fem_contact_solve.c, fem_contact_implicit.c */
typedef struct {
  PetscInt   n_planes;
  FemPlane  *plane;
  PetscInt   n, *node, *of; /* [n] owned node and its plane, ascending */
  PetscReal *gap;           /* [n] at rest [m] */
  PetscReal *normal, *push; /* [n] across the plane [N], >= 0; [n][3] with friction */
  PetscReal *held, *taken;  /* explicit: [n] energy taken since the node met the plane [J]; of it by this level */
  char      *kick;          /* explicit: [n] this level's push gives it back */
  PetscReal *outside;       /* explicit: [n_own*dim] forces from outside, pushes among them */
  PetscReal  contact, friction; /* [J] up to the last level but for its second half, all ranks */
  /* static and implicit */
  PetscInt     parts;       /* directions of an entry: 1, with friction dim */
  PetscReal   *direction;   /* [n][parts][3] unit: the plane's normal, then along it */
  char        *idle;        /* [n][parts] held along it */
  PetscReal   *before;      /* [n][parts] motion against the plane where the step began [m] */
  PetscReal   *spring, *stiff; /* [n] in the matrix for its sake; of the matrix at the node [N/m] */
  char        *state;       /* [n] FEM_CLEAR, ... */
  PetscBool    touching;    /* any node of any rank */
  PetscMPIInt *begin;       /* [size + 1] entries of each rank */
  PetscReal   *flexible;    /* [N parts][N parts] motion under unit pushes [m/N]; NULL until it is needed */
} FemContact;

/* Newmark and generalised-alpha.  fem_implicit.c */
typedef struct {
  PetscReal  rho_inf; /* < 0: average acceleration */
  PetscBool  lumped, moving; /* moving: some dof is prescribed to move */
  PetscReal  am, af, gamma, beta; /* eq. (2.52) */
  PetscReal  h;       /* step the factor belongs to [s], 0 = none */
  PetscReal *mass;    /* in the pattern of rows, one number a block [kg]; NULL = lumped */
  PetscReal *a;       /* [n_loc*dim] acceleration at t [m/s2] */
  PetscReal *x, *y;   /* [n_loc*dim] work */
  PetscReal *p, *q, *r, *old; /* [n_own*dim] work; old [5][n_own*dim] the level before: u, v, a, K u, loads */
  PetscReal *place;   /* [3][n_fixes] u, v, a along prescribed axes */
  PetscReal  kinetic; /* [J] of the present level, this rank's part */
} FemImplicit;

/* Elements that turn.  fem_corotate.c */
typedef struct {
  PetscBool  on, linear; /* linear: forces as at rest, for the critical step */
  PetscReal *mean;   /* mean gradients of each element's shape functions, as cell_f [1/m] */
  PetscReal *energy; /* [n_cells] [J] at the last forces */
  PetscInt   count;  /* forces of an element so far */
} FemCorotate;

typedef enum { FEM_ROWS, FEM_ELEMENTS } FemOperator;

/* Up to FEM_LANES elements of one kind and material. */
typedef struct {
  FemBatchKind kind;
  MeshCellType type;
  PetscInt     material, shape;    /* shape: one of those that several share, -1 */
  PetscInt     n, first;           /* its elements: cell[first .. first + n) */
  PetscInt     node;               /* its nodes in FemBatches.node */
  size_t       constant;           /* its block in FemBatches.constant, shared with others of the same shape unless it */
  PetscBool    owns;               /* is the first */
} FemBatch;

/* fem_batch.c; NULL where forces are taken otherwise */
typedef struct {
  PetscInt   n, n_node;
  FemBatch  *batch;
  PetscInt  *cell;     /* [n_cells] in the order of batches */
  PetscInt  *node;     /* [n_node] dim x place of a node: per batch [nodes][FEM_LANES] */
  PetscInt  *place;    /* [n_loc] of each node, in the order the batches meet them; NULL: the local number */
  PetscReal *u, *f;    /* [n_loc][dim] work, by place */
  FemLanes  *constant; /* inside room, aligned */
  size_t     n_constants;
  PetscReal *room;
  PetscInt  *touch_start, *touch; /* several threads: entries of force that add to an owned node, [n_own + 1] and theirs */
  PetscReal *force;               /* per batch [nodes][dim][FEM_LANES] */
} FemBatches;

/* How an element's strain differs from B u. */
typedef enum { FEM_OWN_NONE, FEM_OWN_MODES, FEM_OWN_VOLUME } FemOwnKind; /* eqs (2.32), (2.37) */
typedef struct {
  FemOwnKind kind;
  FemModes   modes;
  FemVolume  volume;
  PetscReal  amount[FEM_MODES]; /* of each mode, or of each psi */
} FemOwn;

typedef struct _FemMultigrid *FemMultigrid; /* fem_multigrid.c; NULL unless it preconditions */

typedef struct _FemRecovery *FemRecovery; /* fem_recover.h; NULL until a recovered field, an error or a probe is asked for */
typedef struct _FemProbes   *FemProbes;   /* fem_probe.c; NULL without probes */

struct _p_FemModel {
  MPI_Comm    comm;
  PetscMPIInt rank, size;
  char        name[128];
  FemKind     kind;
  FemMethod   method;
  FemOperator operator;
  FemElement  element;
  PetscReal   thickness, alpha, local, gravity[3], velocity0[3];
  PetscReal   stiff_damping; /* [s] */
  PetscBool   start_given;   /* displacement at t = 0 comes from a caller */
  PetscBool   preload;       /* begin in static equilibrium with the loads of t = 0 */
  PetscInt    threads;
  PetscBool   has_mesh, ready;

  /* mesh */
  PetscInt   dim, N_nodes, N_cells; /* global */
  PetscInt   n_own, n_loc;          /* owned nodes, with ghosts */
  PetscInt   n_cells, n_cells_own;  /* kept elements; owned ones carry own[] = 1 */
  PetscInt  *gid;                   /* [n_loc] global node number */
  PetscInt  *cell_gid, *own;        /* [n_cells] */
  PetscReal *extra_mass;            /* [n_own] [kg] beyond the elements', NULL = none; one rank */
  PetscReal *cell_weight;           /* [N_cells] share of each element, global order; NULL = 1 */
  PetscInt  *cell_start, *cell_node; /* [n_cells + 1], local nodes */
  PetscInt  *cell_type, *cell_material; /* [n_cells] MeshCellType; index into region, -1 = none yet */
  PetscReal *x;                     /* [n_loc][dim] */
  PetscSF    ghosts;                /* owned nodes -> ghosts elsewhere */
  PetscSF    home, home_cells;      /* rank 0's arrays in global order -> owned nodes, owned elements */
  PetscInt   n_groups;
  FemGroup  *group;
  char       source[BASE_LINE];
  /* rank 0 only: the whole mesh, for frames and messages; an element's nodes in VTK's order */
  PetscReal     *x_all;    /* [N_nodes][3] */
  PetscInt      *start_all, *node_all, *id_all, *cell_id_all;
  unsigned char *vtk_all;

  /* what the user asked for */
  PetscInt    n_regions, n_fixes, n_mirrors, n_loads, n_history;
  FemRegion  *region;
  FemFix     *fix;    /* after set-up also the sums of motions that frames follow */
  FemMirror  *mirror;
  FemLoad    *load;
  FemHistory *history;
  char      **history_name;
  const char **history_unit;

  /* set up */
  FemElastic *law;    /* [n_regions] */
  PetscInt   *fixed;  /* [n_loc*dim] index into fix, -1 = free along this axis, or the node has a frame: FemHeld() knows both */
  PetscInt    n_frames, n_frames_own; /* nodes with axes of their own, fem_frame.c; owned ones first */
  PetscInt   *frame_of;   /* [n_loc] index of a node's frame, -1; NULL when there is none anywhere */
  PetscInt   *frame_node; /* [n_frames] */
  PetscInt   *frame_fix;  /* [n_frames][dim] index into fix of each axis, -1 = free; of ghosts only the sign means something */
  PetscReal  *frame;      /* [n_frames][dim][dim] rows are the axes */
  PetscInt    n_fixed_own;
  PetscInt   *fixed_dof; /* [n_fixed_own] owned dofs, ascending */
  PetscReal  *mass;      /* [n_own] [kg] */
  PetscReal  *borne;     /* [n_own] [kg] int rho N_a, what gravity acts on in a static model and beside a consistent mass; mass elsewhere */
  FemRows     rows;      /* of the outer elements only while inner.m > 1 */
  FemInner    inner;
  FemFar      far;
  FemAbsorb   absorb;
  FemContact  contact;
  FemImplicit implicit;
  FemCorotate corotate;
  PetscReal   bound, critical, scale; /* [s], [s] 0 = not yet computed, [J] */
  PetscReal  *cell_dN, *cell_w, *cell_f; /* element operator: gradients (enhanced: stiffness), weights, forces */
  PetscInt   *cell_point, *cell_at;      /* [n_cells] first point, first entry of dN; */
  PetscInt   *touch_start, *touch;       /* [n_own + 1], entries of cell_f rows that add to a node */
  FemBatches *batches;
  FemMultigrid multigrid;

  /* state at t */
  PetscReal  t, dt_last;
  PetscBool  started;
  PetscReal *u;     /* [n_loc*dim] */
  PetscReal *v;     /* [n_own*dim] explicit: at the last half step (at t = 0: v there); static: mean over the last step */
  PetscReal *v_next; /* [n_own*dim] explicit: at the coming half step, once the level is closed */
  PetscReal *f_int, *f_app, *f_ext, *reaction; /* [n_own*dim] */
  PetscReal *load_value; /* [n_loads] tables at the last evaluation */
  PetscBool  loads_known, level_known;
  PetscReal  level_dt, level_sum[8]; /* eq. (2.19): work of the half step before, after; then of damping, contact, friction; this rank */
  PetscReal  work, damping, work_in, initial; /* [J] all ranks */
  PetscBool  lent;
  FemPre     pre;
  PetscReal  shortest; /* [m] edge of this rank's elements, 0 = not yet looked for */
  PetscReal  turn; /* [rad] largest turn of an element seen so far, at frames */

  /* static and implicit: one matrix and its solver */
  Mat      K;
  KSP      ksp;
  Vec      rhs, solution;
  PetscReal diagonal;
  PetscInt  iterations; /* of the last solve */
  Stepper   stepper;

  /* read off on request */
  FemRecovery recovery;
  FemProbes   probes;
  PetscReal   error_norm, error_share; /* the last estimate, eqs (2.97), (2.98) */
  PetscBool   error_known;
};

extern PetscLogEvent FEM_SetUpMesh, FEM_Assemble, FEM_Force, FEM_Solve, FEM_Eigen, FEM_Recover;

/* fem_model.c */
PetscErrorCode FemFindGroup(FemModel model, const char *name, PetscInt *group);
PetscErrorCode FemAgree(MPI_Comm comm, const char *words); /* rank 0's words, if any, are everyone's error */
/* fem_mesh.c */
PetscErrorCode FemMeshDestroy(FemModel model);
PetscErrorCode FemGhosts(FemModel model, PetscReal *u);                                        /* [n_loc*dim] owners to ghosts */
PetscErrorCode FemGather(FemModel model, PetscSF home, PetscInt m, const PetscReal *own, PetscReal *all); /* m numbers each */
PetscErrorCode FemScatter(FemModel model, PetscSF home, PetscInt m, const PetscReal *all, PetscReal *own);
/* fem_material.c */
PetscErrorCode FemCheckMaterial(FemModel model, FemMaterial *material); /* and young, poisson as sizes where it is orthotropic */
FemElastic     FemElasticOf(FemKind kind, const FemMaterial *material);
PetscBool      FemElasticSame(const FemElastic *a, const FemElastic *b);
/* fem_setup.c */
PetscErrorCode FemSetUpMaterials(FemModel model);
PetscErrorCode FemSetUpFixes(FemModel model);
PetscErrorCode FemSetUpMass(FemModel model);
PetscErrorCode FemCheckRigidMotion(FemModel model);
PetscErrorCode FemIsHeld(FemModel model, PetscBool *held); /* no part can move as a rigid body */
/* fem_frame.c: supports along directions of their own. Vectors a are [n_own*dim]. */
PetscErrorCode FemSetUpFrames(FemModel model);
PetscErrorCode FemFramesDestroy(FemModel model);
/* Give the prescribed components of a (along x, y, z; frames included) their value at t; the free ones stay. The one way to
   prescribe motion outside the static solver: a displacement, a velocity, or an increment or residual that must vanish there. */
PetscErrorCode FemProject(FemModel model, FemHold hold, PetscReal t, PetscReal *a);
/* reaction = f_int - f_app - f_ext where motion is prescribed, 0 elsewhere; the sum of squares of the rest, this rank's. */
PetscErrorCode FemTakeReactions(FemModel model, PetscReal *out_of_balance);
void           FemIntoFrames(FemModel model, PetscReal *a);  /* in place, nodes with a frame only */
void           FemOutOfFrames(FemModel model, PetscReal *a);
void           FemRowsIntoFrames(FemModel model, PetscReal *value); /* blocks in the rows' pattern; then a matrix is solved in frames, held where FemHeld() >= 0 */
void           FemProjectTo(FemModel model, const PetscReal *place, PetscReal *a); /* place [n_fixes]: what prescribed components of a become */
PetscReal      FemKeepHeld(FemModel model, PetscReal *a); /* zero along free axes; returns the sum of squares of what went (this rank) */
void           FemKeepFree(FemModel model, PetscReal *a); /* zero along held axes */
/* Index into fix of dof k seen in its node's own axes, -1 = free. k of an owned node or, for the sign alone, of a ghost. */
static inline PetscInt FemHeld(const struct _p_FemModel *model, PetscInt k)
{
  const PetscInt f = model->frame_of ? model->frame_of[k / model->dim] : -1;

  return f < 0 ? model->fixed[k] : model->frame_fix[f * model->dim + k % model->dim];
}
/* fem_load.c */
void           FemSideGet(FemModel model, PetscInt cell, PetscInt side, FemSide *s);
PetscErrorCode FemSetUpLoads(FemModel model);
PetscErrorCode FemLoadsAt(FemModel model, PetscReal t); /* f_app */
PetscReal      FemFixPosition(const FemFix *fix, PetscReal t);
PetscReal      FemFixVelocity(const FemFix *fix, PetscReal t);
/* fem_thermal.c: f_int = K u + what prestress adds. A step: FemPrestressAdvance() to the coming time, FemAddPrestress() after each
   FemApply() into f_int, FemHeatWork() once displacement is final; nothing happens where no such stress is. */
PetscErrorCode FemSetUpPrestress(FemModel model);
void           FemPrestressAdvance(FemModel model, PetscReal t);
void           FemAddPrestress(FemModel model);
PetscErrorCode FemHeatWork(FemModel model, PetscReal *work);
PetscReal      FemPrestressEnergy(FemModel model);
void           FemPrestressAtPlace(FemModel model, PetscInt cell, const PetscReal x[3], PetscReal s[6]); /* at x of the element, to be added to C:eps [Pa] */
void           FemAddPrestressAt(FemModel model, PetscInt cell, const PetscReal x[3], PetscReal stress[6], PetscReal strain[6]); /* to what comes of C:eps there */
void           FemCellPrestressMean(FemModel model, PetscInt cell, PetscReal s[6]);
PetscReal      FemCellThicker(FemModel model, PetscInt cell); /* plane stress: what heat adds to the element's mean strain across the plane */
PetscErrorCode FemPrestressDestroy(FemModel model);
/* fem_watch.c */
PetscErrorCode FemWatch(void *ctx, RunWatch look, char fault[BASE_LINE]); /* as Stepper.watch */
/* fem_check.c */
PetscErrorCode FemBalance(FemModel model, PetscReal value[6]);
/* fem_corotate.c */
PetscErrorCode FemCorotateCheck(FemModel model);
PetscErrorCode FemCorotateCreate(FemModel model);
PetscErrorCode FemCorotateDestroy(FemModel model);
PetscInt       FemCorotateForces(FemModel model, const PetscReal *u);
void           FemCorotateSee(FemModel model, PetscInt cell, const PetscReal *ue, PetscReal *d, PetscReal R[3][3]);
void           FemTurnStress(const PetscReal R[3][3], PetscReal s[6]); /* Voigt, from an element's axes */
PetscReal      FemStrainEnergy(FemModel model); /* [J] of owned nodes or elements, prestress apart */
/* fem_operator.c */
void           FemCellStoredForce(FemModel model, PetscInt c, const PetscReal *ue, PetscReal *f); /* explicit, after FemElementsCreate() */
PetscErrorCode FemRowsCreate(FemModel model);
PetscErrorCode FemRowsFill(FemModel model, const PetscBool *flag, PetscBool take, PetscReal *value); /* of cells whose flag is take; flag NULL: all */
PetscErrorCode FemRowsDestroy(FemModel model);
PetscErrorCode FemElementsCreate(FemModel model);
PetscErrorCode FemElementsDestroy(FemModel model);
PetscErrorCode FemApply(FemModel model, const PetscReal *u, PetscReal *f); /* f [n_own*dim] = K u, ghosts of u filled */
void           FemCellGeometry(FemModel model, PetscInt cell, PetscReal *dN, PetscReal *w);
FemOwnKind     FemCellKind(FemModel model, PetscInt cell);
PetscBool      FemCellEnhanced(FemModel model, PetscInt cell); /* is its strain other than B u? */
void           FemCellStiffness(FemModel model, PetscInt cell, PetscReal *K); /* [n][n], as the cell is: plain or enhanced */
void           FemCellForce(FemModel model, PetscInt cell, const PetscReal *ue, PetscReal *f);
/* The cell's own strains at displacement ue; and what they make of e = B u at a point xi, which is at x and has the Jacobian det. */
void           FemCellOwn(FemModel model, PetscInt cell, const PetscReal *ue, FemOwn *own);
void           FemOwnAdd(const FemShape *shape, const FemElastic *law, const FemOwn *own, const PetscReal xi[3], PetscReal det, const PetscReal x[3], PetscReal e[6]);
/* [points][6] each, of displacement ue [nodes][dim], the cell's own strains in it; either may be NULL */
void           FemCellStress(FemModel model, PetscInt cell, const PetscReal *ue, PetscReal strain[][6], PetscReal stress[][6]);
void           FemCellGather(FemModel model, PetscInt cell, const PetscReal *u, PetscReal *ue);
PetscReal      FemDot(FemModel model, const PetscReal *a, const PetscReal *b); /* owned dofs of this rank, same bits for any threads */
PetscErrorCode FemSum(FemModel model, PetscInt n, PetscReal *value);           /* over ranks */
/* fem_batch.c: f = K u by batches of elements, owned nodes; u [n_loc*dim] with ghosts filled */
PetscErrorCode FemBatchesCreate(FemModel model, PetscBool sort); /* sort: elements and nodes along a curve through space */
PetscErrorCode FemBatchesDestroy(FemModel model);
PetscErrorCode FemBatchesWanted(FemModel model, PetscBool *wanted); /* do explicit forces come by batches? */
void           FemBatchesApply(FemModel model, const PetscReal *u, PetscReal *f);
/* fem_multigrid.c */
PetscErrorCode FemMultigridCreate(FemModel model); /* K as an operator, its preconditioner, the solver's vectors */
PetscErrorCode FemMultigridDestroy(FemModel model);
/* fem_eigen.c */
PetscErrorCode FemBoundStep(FemModel model);
PetscReal      FemNoise(PetscInt64 number); /* in [-1/2, 1/2), a function of the number alone */
PetscInt       FemRowsColumn(const FemModel model, PetscInt i, PetscInt j); /* entry of rows.col in row i that is node j */
/* fem_mass.c */
PetscErrorCode FemMassRows(FemModel model, PetscReal **mass);
PetscErrorCode FemModalSetUp(FemModel model);
void           FemMassApply(FemModel model, const PetscReal *mass, const PetscReal *x, PetscReal *f);
void           FemMassAddToRows(FemModel model, const PetscReal *mass, PetscReal stiffness, PetscReal inertia, PetscReal *value);
PetscErrorCode FemMassSolve(FemModel model, const PetscReal *mass, PetscBool planes, PetscReal *f, PetscReal *a);
/* fem_solver.c */
PetscErrorCode FemMatrixCreate(FemModel model, const PetscReal *value, PetscReal *diagonal, Mat *matrix);
PetscErrorCode FemSolverCreate(FemModel model, const PetscReal *value); /* values in the pattern of rows; not read where FemSolverWants() says FEM_TWO_LEVEL */
PetscErrorCode FemSolverWants(FemModel model, FemSolver *solver); /* the rule's choice for this model, or the options' */
PetscErrorCode FemRigidModes(FemModel model, Mat matrix, PetscInt n, const PetscInt *node); /* near null space of a matrix over these owned nodes [n]; NULL: all */
PetscErrorCode FemPrefer(const char *name, const char *value); /* an option of ours, unless the user gave it */
PetscErrorCode FemSolverSolve(FemModel model);
PetscErrorCode FemSolverSolveArray(FemModel model, const PetscReal *b, PetscReal *x); /* one rank: x [n] = A^-1 b from a guess of zero; b zero along held dofs, may be x */
PetscErrorCode FemSolverDestroy(FemModel model);
/* fem_absorb.c */
PetscErrorCode   FemSetUpAbsorbers(FemModel model);
void             FemAbsorbTimes(FemModel model, const PetscReal *v, PetscReal *f);
void             FemAbsorbAddToRows(FemModel model, PetscReal scale, PetscReal *value);
void             FemAbsorbLevel(FemModel model, PetscReal before, PetscReal after, const PetscReal *place);
void             FemAbsorbBook(FemModel model, PetscReal before, PetscReal after, PetscReal sum[4]);
const PetscReal *FemOutside(FemModel model);
PetscErrorCode   FemAbsorbDestroy(FemModel model);
/* fem_contact.c */
PetscErrorCode FemSetUpContact(FemModel model);
void           FemPlaneMotion(const FemPlane *plane, PetscReal t, PetscReal D[3]); /* [m] since t = 0 */
void           FemContactLevel(FemModel model, PetscReal before, PetscReal after, PetscReal keep, PetscReal gain, const PetscReal *place);
void           FemContactBook(FemModel model, PetscReal before, PetscReal after, PetscReal sum[8]);
PetscReal      FemContactAdvance(FemModel model);
PetscErrorCode FemContactSave(FemModel model, Checkpoint checkpoint);
PetscErrorCode FemContactLoad(FemModel model, Checkpoint checkpoint);
PetscErrorCode FemContactDestroy(FemModel model);
/* fem_contact_solve.c */
PetscErrorCode FemContactSolveSetUp(FemModel model);
PetscErrorCode FemContactStiffen(FemModel model, PetscReal *value); /* springs into the rows of a static matrix */
PetscErrorCode FemContactWeigh(FemModel model, const PetscReal *value); /* of a matrix that needs none */
void           FemContactBegin(FemModel model, PetscReal t, const PetscReal *u);
PetscErrorCode FemContactSolve(FemModel model, PetscReal t, const PetscReal *known);
void           FemContactWork(FemModel model, PetscReal from, PetscReal to, const PetscReal *old_u, const PetscReal *push, const PetscReal *normal, PetscReal sum[3]);
/* fem_contact_implicit.c */
PetscErrorCode FemContactImplicit(FemModel model, PetscReal t, PetscReal h, const PetscReal *old_u); /* once the step's motion is booked */
void           FemContactKeepFree(FemModel model, PetscReal *a);
/* fem_start.c, fem_implicit.c */
PetscErrorCode FemStart(FemModel model);
PetscErrorCode FemImplicitSetUp(FemModel model);
PetscErrorCode FemImplicitDrag(FemModel model, const PetscReal *v, PetscReal *f, PetscReal *work); /* f [n_own*dim] = C v */
PetscErrorCode FemImplicitLevel(FemModel model);
PetscErrorCode FemImplicitStep(void *ctx, PetscReal t, PetscReal dt);
PetscErrorCode FemImplicitDestroy(FemModel model);
/* fem_static.c, fem_explicit.c */
PetscErrorCode FemPreload(FemModel model);
PetscErrorCode FemStaticSetUp(FemModel model);
PetscErrorCode FemStaticStep(void *ctx, PetscReal t, PetscReal dt);
PetscErrorCode FemExplicitSetUp(FemModel model);
PetscErrorCode FemExplicitStep(void *ctx, PetscReal t, PetscReal dt);
PetscErrorCode FemExplicitLevel(FemModel model, PetscReal dt);
/* fem_substep.c */
PetscErrorCode FemForces(FemModel model); /* f_int of u, inner and outer */
PetscErrorCode FemInnerLevel(FemModel model, PetscReal H);
PetscErrorCode FemInnerDestroy(FemModel model);
PetscErrorCode FemInnerCreate(FemModel model, const PetscBool inner[]);
void           FemInnerTimes(const FemModel model, const PetscReal *u, PetscReal *f);
/* fem_far.c */
PetscErrorCode FemFarStaticLevel(FemModel model);
void           FemFarSame(FemModel model); /* the far copy goes where model->u is */
PetscErrorCode FemFarForces(FemModel model);
PetscErrorCode FemFarTrial(FemModel model, const PetscReal *u, PetscReal *slow, PetscReal *fast, PetscReal *mobility);
PetscErrorCode FemFarLevel(FemModel model);
void           FemFarEnergies(FemModel model, PetscReal *kinetic, PetscReal *strain, PetscReal *taken);
PetscErrorCode FemFarSave(FemModel model, Checkpoint checkpoint);
PetscErrorCode FemFarLoad(FemModel model, Checkpoint checkpoint);
PetscErrorCode FemFarDestroy(FemModel model);
/* fem_recover.c */
PetscErrorCode FemRecoveryDestroy(FemModel model);
/* fem_error.c: after FemRecover(); density [n_cells] [J/m3] of owned elements, may be NULL */
PetscErrorCode FemEstimateError(FemModel model, PetscReal *density);
/* fem_fields.c */
PetscErrorCode FemWriteFrame(FemModel model, Output output);
/* fem_probe.c */
PetscErrorCode FemProbesHistory(FemModel model, PetscInt i, PetscReal *value); /* column i of the model */
PetscErrorCode FemProbesDestroy(FemModel model);
/* fem_stepper.c */
PetscErrorCode FemSetUpStepper(FemModel model);
PetscReal      FemVelocityOf(FemModel model, PetscInt k); /* [m/s] of owned dof k at the present time, once the level is closed */
