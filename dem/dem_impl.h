/*
  dem_impl.h - inside a DemModel.

  Particles are kept along a space-filling curve and cut into blocks of about DEM_BLOCK; a bond belongs to the block of
  its first end. A block works on a private copy of its own particles and of those its bonds reach into (the halo),
  so no two threads write one place. Contributions to halo particles go to slots of their own and are added up per
  particle in a fixed order: the same bits whatever the number of threads.
*/
#pragma once
#include "dem.h"
#include "dem_contacts.h"
#include "dem_ranks.h"

typedef struct _n_DemNetwork *DemNetwork;
typedef struct _n_DemStatic  *DemStatic; /* dem_static.c */

#define DEM_BLOCK 256 /* particles; state of block and halo stays in a 512 kB second-level cache (72 kB in 3D) */
#define DEM_CHUNK 64  /* bonds treated together: their results stay in the first-level cache */

typedef enum { DEM_WALL_FREE, DEM_WALL_TRACTION, DEM_WALL_SMOOTH, DEM_WALL_GLUED, DEM_WALL_RIM } DemWallKind;

/* What a face of the body does; one per face. */
typedef struct {
  PetscBool  fixed[3];
  DemMotion  motion[3];
  Table      table[3];  /* prescribed displacement [m] or velocity [m/s] */
  PetscReal  shift[3];  /* displacement now [m] */
  PetscBool  loaded, pressed;
  PetscReal  direction[3];
  Table      traction, pressure; /* [Pa] */
  PetscBool  rim;
  PetscReal  stress[3], push;    /* traction now [Pa], pressure now [Pa] */
  PetscReal  reaction[3];        /* force of the face's support on the body [N] */
  PetscReal  shift_old[3], reaction_old[3]; /* a step before */
} DemFace;

typedef struct DemTool DemTool; /* dem_tool_impl.h */

typedef struct {
  char      quantity[32];
  PetscInt  face, tool; /* one of them >= 0; both -1: a column of dem_gauge.c */
  PetscInt  component;
  PetscInt  particle; /* of a probe, packing's number; -1: no cell holds the point; -2: another rank's does */
  PetscReal arm[3];   /* of a probe, from the particle [m] */
  char     *name;
  const char *unit;
} DemHistory;

/* Bonds in block order. Geometry of the rest state; the second arm is arm_q = arm_p - (x_q - x_p). */
typedef struct {
  PetscInt   n;
  PetscInt  *p, *q;      /* [n] internal particle numbers, p < q in block order */
  int       *ip, *iq;    /* [n] the same, within the block's copy */
  PetscReal *k;          /* [n] area / distance [m] */
  PetscReal *now;        /* [n] (1 - D) k: k itself unless bonds can break */
  PetscReal *arm;        /* [3][n] facet centroid from particle p [m] */
  PetscReal *weight;     /* [n] of the pair energy, NULL = 1 everywhere (coupling) */
  PetscInt  *facet;      /* [n] facet of the cells */
} DemBonds;

typedef struct {
  PetscInt   n_blocks;
  PetscInt  *first;      /* [n_blocks + 1] particle */
  PetscInt  *bond;       /* [n_blocks + 1] bond */
  PetscInt  *halo_start; /* [n_blocks + 1] */
  PetscInt  *halo;       /* [halo_start[n_blocks]] particle of each halo slot */
  PetscInt  *slot_start; /* [n + 1] */
  PetscInt  *slot;       /* halo slots of each particle, ascending */
  PetscReal *slot_s;     /* volumetric sum of each slot */
  PetscReal *slot_f;     /* [slots][DEM_FORCE_ALL] of each slot */
  PetscInt   widest;     /* most particles a block's copy holds */
} DemBlocks;

/* Boundary facets that take part: loaded, smooth or glued ones, sorted by particle. Free ones live in vstar. */
typedef struct {
  PetscInt   n;
  PetscInt  *start;  /* [particles + 1] */
  PetscInt  *owner;  /* [n] particle */
  PetscInt  *face;   /* [n] */
  unsigned char *kind;
  PetscReal *area;   /* [n] [m2] */
  PetscReal *h;      /* [n] distance of the particle from the facet's plane [m] */
  PetscReal *arm;    /* [n][3] centroid from the particle [m] */
  PetscReal *normal; /* [n][3] outward, at rest */
  PetscInt   n_rim;
  PetscInt  *rim;    /* [n] row of a rim facet, -1 */
  PetscInt  *rim_number; /* [n_rim] row on one rank; NULL there */
  PetscReal *rim_x, *rim_u, *rim_f; /* [n_rim][3] */
} DemWalls;

typedef enum { DEM_WITH_LOADS = 1, DEM_WITH_FAILURE = 2, DEM_TRY_FAILURE = 4 /* forces as damage would have them, but nothing has happened */ } DemForceFlags;

#define DEM_TRACTION       8    /* numbers kept of a loaded facet */
#define DEM_TRACTION_ENDED 7    /* the last of them.  Eq. (4.88) */
#define DEM_STRESS_EVERY  10   /* steps between looks at the principal stress of intact bonds */
#define DEM_STRESS_WAKE   0.4  /* a bond is watched once its stress passes this fraction of a strength */
#define DEM_SMALLEST_COSINE 0.2 /* facets whose normal is further from the opening direction do not fail in tension */

/* State of the bonds that may break; rows in bond order. A block without a watched or damaged bond runs the intact rule. */
typedef struct {
  PetscReal     *damage; /* [n] broken fraction D */
  PetscReal     *e;      /* [n][3] opening direction, turns with particle p; frozen once D > 0 */
  PetscReal     *slip;   /* [n][3] slip of the closed, broken part; turns with p */
  PetscReal     *work;   /* [n] dissipated [J] */
  PetscReal     *release; /* [n] energy release Y = -dE/dD a step ago [J]; of a facet broken whole, the part that faces the other side no more */
  PetscReal     *rub;    /* [n] friction [J] */
  PetscReal     *time;   /* [n] of first damage [s] */
  unsigned char *state;  /* [n] bit 0 watched, 1 tension broke it, 2 shear broke it, 3 much traction, 4 its particles have parted, 6 never bonded, 7 may not break */
  unsigned char *awake;  /* [blocks] some bond is watched or damaged */
  PetscReal     *limit;  /* [n] nonlocal: facet's shear load when it began to soften [Pa]; 0 = has not, -1 = does now; NULL = local */
  PetscReal     *stress; /* [n particles][6] stress x volume, when last looked at */
  PetscReal     *slot_stress; /* [slots][6] */
  PetscReal     *slot_v; /* [slots] condensed volume of damaged facets */
  PetscReal     *volume; /* [particles] condensed volume of damaged facets now.  Eq. (4.4) */
  PetscInt       steps;  /* since the last look */
  PetscReal     *margin; /* [n] of the last trial, as in DemTooth; NULL unless steps are static, like the next three */
  PetscReal     *beyond; /* [n] */
  unsigned char *due;    /* [n] its tooth is cut when failure is next counted */
  PetscReal     *excess; /* [blocks] set free by teeth cut since it was last cleared [J] */
  PetscInt      *live;   /* [n] bonds of each block that are watched or damaged, from the block's first bond on */
  PetscInt      *n_live; /* [blocks] */
  /* list for DemModelGetCracks */
  PetscInt       n_list;
  PetscInt      *facet;
  PetscReal     *list[7];
  unsigned char *mode;
  PetscInt      *bond;  /* of each row; not on loan */
  PetscReal     *place; /* [n_list][7] centroid, normal, area of each row, NULL where the cells have them */
} DemCrackState;

enum { DEM_BOND_WATCHED = 1, DEM_BOND_TENSION = 2, DEM_BOND_SHEAR = 4, DEM_BOND_LOADED = 8, DEM_BOND_PARTED = 16, DEM_BOND_SLID = 32 /* broken, and slid past its facet's width */, DEM_BOND_APART = 64 /* of two groups: never bonded */, DEM_BOND_KEPT = 128 };

/* Grains that come while the run goes on; rate 0: all are there. */
typedef struct {
  PetscReal rate;  /* [1/s] */
  PetscInt  seed;
  PetscInt  turn;  /* turns gone by */
  PetscInt  next;  /* grains that have come: the packing's numbers below this */
} DemRain;

/* Clumps: spheres that move as one rigid body each; empty unless the model has some. Member spheres are particles like others, but for their motion. */
typedef struct {
  PetscInt   n;
  PetscInt  *start;    /* [n + 1] into member, arm */
  PetscInt  *member;   /* internal numbers, in the packing's order */
  PetscReal *arm;      /* [members][3] from the centre, along the principal axes [m] */
  PetscInt  *of;       /* [particles] clump of each, -1 */
  PetscReal *mass, *moments, *reach; /* [n] [kg], [n][3] principal [kg m2], [n] [m] */
  PetscReal *frame;    /* [n][4] quaternion: principal axes to those the shape was given in */
  PetscReal *x0, *u, *v; /* [n][3] centre at the start, displacement, half-step velocity */
  PetscReal *q, *L;    /* [n][4] principal axes to space; [n][3] angular momentum in space, half step */
  PetscReal *force, *couple; /* [n][3] of the present state, about the centre, weight included */
  const DemClumpPlace *place; /* on loan until set-up */
} DemClumps;

struct _p_DemModel {
  MPI_Comm  comm;
  DemKind   kind;
  PetscInt  dim, nrot, threads; /* nrot: 3 rotations in 3D, 1 in 2D */
  PetscBool bonded, ready;

  DemMaterial material;
  PetscBool   cohesive;
  DemStrength strength;
  PetscBool  *breakable; /* [facets], NULL = all */
  PetscReal  *weak, weakest; /* [facets] part of the strengths, NULL = 1; the least of them */
  PetscBool   crack_plane; /* facets open along their own normals */
  PetscReal  *weight_mass, *weight_volume, *weight_facet; /* as given, packing's and cells' order; NULL = 1 */
  DemCrackState crack;   /* empty unless cohesive */
  DemRule       rule;    /* elastic rule of the bonds */
  DemStatic     statics; /* of load steps without inertia; NULL otherwise */
  PetscBool     is_static;
  DemNetwork    net;     /* of the published rules (dem_rule.h); NULL with `exact` */
  PetscInt     *group;   /* [particles] packing's order; NULL = all one */
  PetscReal   g_shear, lambda; /* [Pa]; lambda of plane stress in plane stress.  Eq. (4.1) */
  PetscReal   alpha;           /* local damping */
  PetscReal   gravity[3], initial_velocity[3];
  PetscReal  *begin; /* [n][3] packing's order, displacement of the start [m]; NULL = 0 */

  DemPacking packing; /* copies, in the packing's order */
  DemCells   cells;
  DemBody    body;

  PetscInt   n;   /* particles here, and length of a row of the arrays below */
  PetscInt   own; /* the first of them, which move here; n on one rank */
  PetscInt   rebalance; /* steps between looks at how ranks share the work, 0: none */
  DemRanks   ranks; /* NULL on one rank, and during set-up */
  PetscInt  *rank_of, *at; /* [n] internal number of a packing's particle; packing's number of an internal one */

  /* Internal order, component-major: a[c*n + p]. */
  PetscReal *x0, *r;     /* [3][n], [n] */
  PetscReal *u, *v, *f;  /* [3][n] displacement, half-step velocity, force now */
  PetscReal *rot;        /* [4][n] unit quaternion w x y z; 2D: sin, cos - 1, angle, - */
  PetscReal *spin, *torque; /* [3][n] (2D: [n]) */
  PetscReal *mass, *inertia; /* [n] */
  PetscReal *volume, *vstar; /* [n] cell, and cell with condensed facets.  Eq. (4.4) */
  PetscReal *offset;     /* [3][n] cell centroid from the particle, for body forces */
  PetscReal *sum, *dilation; /* [n] S_p, and weight x S_p / V*_p */
  PetscReal *share;      /* [n] weight of the volumetric energy; NULL = 1 (coupling) */
  PetscReal *f_ext, *t_ext; /* [3][n] force and couple from outside, NULL unless lent */

  PetscInt     n_grain_kinds; /* loose grains of several materials */
  DemMaterial *grain_kind;
  PetscReal   *grain_velocity; /* [kinds][3], NULL: initial_velocity for all */
  PetscInt    *grain_of;      /* [n] packing's order */
  PetscInt          n_pair_choices;
  PetscInt         *pair_of;  /* [n_pair_choices][2] */
  DemContactChoice *pair_choice;
  DemContacts contacts;
  DemRain     rain;
  DemClumps   clumps;

  DemBonds  bonds;
  DemBlocks blocks;
  DemWalls  walls;
  PetscInt  n_surface;
  PetscInt *surface;     /* [n_surface] particles that can meet a tool: cells on the boundary, or all when unbonded */
  PetscReal *traction_old, *traction_new; /* [walls][DEM_TRACTION]: motion of the centroid, force, dilation per 2 G, and 1 once its pressure has ended */
  PetscReal *block_sum;  /* [n_blocks] partial sums, added in block order */

  PetscInt n_faces;
  DemFace *face;
  PetscInt  n_tools;
  DemTool **tool;
  unsigned char *tool_share; /* [n] DemShareKind_Internal(); NULL: all whole */
  void    **tool_scratch, *tool_total; /* [threads] contacts of a block, [blocks] its sums; made when first needed */

  PetscInt    n_history;
  DemHistory *history;
  const char **history_name, **history_unit;
  PetscReal  *probed, probed_time; /* [2][6][n] stress and strain for the probes' row at hand */
  PetscReal   gauge[8];  /* row at hand: stress, strain, modulus, Poisson's ratio */
  PetscReal   quality[3]; /* largest strain energy of a row [J], unbalanced ratio and kinetic / strain energy then */

  PetscReal time, dt_last;
  PetscBool started;     /* the first half kick is done */
  PetscReal work, work_in, damped, contact_lost, friction_lost; /* [J] */
  PetscReal stable;      /* critical step found, 0 = not yet */

  PetscReal **scratch, *scratch_room; /* [threads] block copies, and where they lie */
  PetscReal  *lent;      /* state on loan, packing's order */
  struct {
    PetscInt      *p, *q;
    PetscReal     *value; /* [4][bonds] sigma, tau, damage, criterion */
    unsigned char *state;
  } list; /* on loan by DemModelGetBonds */
};

/* Where a block's copy keeps what, in lengths of `widest`: records of the particles, of the forces on them, volumetric sums, condensed volumes. */
enum { DEM_COPY_AT = 0, DEM_COPY_F = 12, DEM_COPY_S = 20, DEM_COPY_V = 21, DEM_COPY_ALL = 22 };
/* A particle's record: displacement, dilation, rotation, rest position, -. */
enum { DEM_AT_U = 0, DEM_AT_E = 3, DEM_AT_R = 4, DEM_AT_X = 8, DEM_AT_ALL = 12 };
/* What it feels: force, -, couple, -. */
enum { DEM_FORCE_COUPLE = 4, DEM_FORCE_ALL = 8 };

static inline PetscReal *DemCopyAt(PetscReal *copy, PetscInt i)
{
  return copy + DEM_AT_ALL * i;
}

/* dem_ranks.c: at the end of set-up every rank keeps its part and drops the rest */
PetscErrorCode DemSpread_Internal(DemModel model);
PetscErrorCode DemRanksDestroy_Internal(DemModel model);
PetscErrorCode DemOwners_Internal(DemModel model, const PetscMPIInt owner[], PetscMPIInt unit_owner[], PetscInt unit_start[]); /* of each unit: where its particles stand among their owner's */
PetscErrorCode DemPartBlocks_Internal(DemModel model, const PetscInt first[], const PetscMPIInt unit_owner[], DemPart *part); /* once part->bond is known */
PetscErrorCode DemPartGhosts_Internal(DemModel model, PetscInt n, const PetscInt id[], DemPart *part); /* own particles are known; others' among id[] become ghosts */
PetscErrorCode DemPartDestroy_Internal(DemPart *part);
/* dem_ranks_cut.c: arrays keep the part's rows; particles in them are by their numbers on one rank before, by those here after */
PetscErrorCode DemCut_Internal(DemModel model, DemPart *part);
/* dem_ranks_carry.c */
PetscErrorCode DemCarryInto_Internal(const DemCarry *c, size_t row, const void *from, void *to); /* collective with sf, as the next two */
PetscErrorCode DemCarryRows_Internal(const DemCarry *c, size_t row, void *array);               /* new array of the wanted rows in place of the one that *array points to; none stays none */
PetscErrorCode DemCarryColumns_Internal(const DemCarry *c, PetscInt columns, PetscInt old, PetscInt stride, const PetscReal *from, PetscReal *to); /* of length `old` into `stride` */
/* of so many rows here row[k], known everywhere as key[k], goes to ranks to[2k] and to[2k + 1] (-1: none); caller frees the keys that come, ascending, and c->sf */
PetscErrorCode DemCarryPush_Internal(MPI_Comm comm, PetscInt rows, PetscInt pushed, const PetscInt row[], const PetscInt key[], const PetscMPIInt to[], PetscInt **keys, DemCarry *c);
/* dem_ranks_migrate.c: between two steps */
PetscErrorCode DemMigrate_Internal(DemModel model, const PetscMPIInt owner[]); /* [units] */
PetscErrorCode DemLookAtShares_Internal(DemModel model);
/* dem_ranks_partition.c: owner of each unit of `unit` particles [ceil(n / unit)], the same on all ranks; load of the busiest over the mean.
   was [units]: owners now, of a body that is shared out; *now: the same of them */
PetscErrorCode DemPartition_Internal(DemModel model, PetscInt unit, const PetscMPIInt was[], PetscMPIInt owner[], PetscReal *load, PetscReal *now);
/* dem_ranks_halo.c */
PetscErrorCode DemHaloSetUp_Internal(DemModel model, PetscInt n, const PetscInt id[], DemHalo *halo); /* of copies with these numbers; collective. What was there goes */
PetscErrorCode DemHaloDestroy_Internal(DemHalo *halo);
PetscErrorCode DemHaloSend_Internal(DemHalo *halo, MPI_Datatype record); /* halo->out to halo->in */
PetscErrorCode DemHaloMotion_Internal(DemModel model);   /* motion of the ghosts */
PetscErrorCode DemHaloReal_Internal(DemModel model, PetscReal *a); /* [n] */
PetscErrorCode DemHaloStress_Internal(DemModel model, PetscReal *a); /* [n][6] */
PetscErrorCode DemSumRanks_Internal(DemModel model, PetscInt n, PetscReal *a); /* in the order of the ranks; nothing on one */
PetscErrorCode DemRanksWork_Internal(DemModel model, PetscReal work);          /* of this step; summed over the ranks later */
PetscErrorCode DemRanksFlush_Internal(DemModel model);
PetscErrorCode DemGatherBlock_Internal(DemModel model, OutputBlock *block); /* dem_ranks_output.c: rows of the rank's particles become those of all on rank 0 */
PetscErrorCode DemGatherBlockFree_Internal(DemModel model, OutputBlock *block);
PetscErrorCode DemGatherPlaces_Internal(DemModel model, PetscInt *n, PetscReal **x);
PetscErrorCode DemGatherBonds_Internal(DemModel model, const DemBondList *list, PetscInt *n, PetscInt **ends, PetscReal **values); /* [n][2], [n][5] sigma, tau, damage, criterion, state */
/* dem_ranks_gather.c: what rank 0 writes. On one rank the arrays themselves. */
typedef enum { DEM_OF_PARTICLES, DEM_OF_BONDS, DEM_OF_WALLS } DemRowsOf;
PetscErrorCode DemSaveRows_Internal(DemModel model, Checkpoint c, const char *name, DemRowsOf of, PetscInt columns, PetscInt width, const PetscReal *a); /* a[columns][rows][width] */
PetscErrorCode DemLoadRows_Internal(DemModel model, Checkpoint c, const char *name, DemRowsOf of, PetscInt columns, PetscInt width, PetscReal *a);
PetscErrorCode DemSaveInts_Internal(DemModel model, Checkpoint c, const char *name, DemRowsOf of, const PetscInt *a); /* [rows] */
PetscErrorCode DemLoadInts_Internal(DemModel model, Checkpoint c, const char *name, DemRowsOf of, PetscInt *a);
PetscErrorCode DemGatherReals_Internal(DemModel model, PetscInt rows, const PetscInt key[], PetscInt width, const PetscReal *a, PetscInt *n, PetscReal **all); /* rank 0: rows by ascending key; caller frees */
PetscErrorCode DemGatherInts_Internal(DemModel model, PetscInt rows, const PetscInt key[], PetscInt width, const PetscInt *a, PetscInt *n, PetscInt **all);

/* Counted here: on several ranks a bond between two of them is in both lists. */
static inline PetscBool DemBondIsMine(DemModel model, PetscInt e)
{
  return (PetscBool)(!model->ranks || model->ranks->mine[e]);
}

/* Number here of an own particle by its number on one rank; -1: another rank's. */
static inline PetscInt DemOwnOf(const DemRanks r, PetscInt id)
{
  return r->unit_owner[id / r->unit] == r->rank ? r->unit_start[id / r->unit] + id % r->unit : -1;
}

static inline PetscBool DemBlockIsMine(DemModel model, PetscInt b)
{
  return (PetscBool)(!model->ranks || model->ranks->block_mine[b]);
}

/* dem_setup.c */
PetscErrorCode DemSetUpHalo_Internal(DemModel model); /* of the bonds' blocks */
PetscErrorCode DemSetUpScratch_Internal(DemModel model);
PetscErrorCode DemSetUpOrder_Internal(DemModel model);
PetscErrorCode DemSetUpBonds_Internal(DemModel model);
PetscErrorCode DemSetUpWalls_Internal(DemModel model);

/* dem_bonds2.c, dem_bonds3.c: one block. copy holds position, rotation (and dilation for forces); S or F come back in it. */
void DemBondsSum2_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal *copy);
void DemBondsSum3_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal *copy);
void DemBondsForce2_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal g2, PetscReal lambda, PetscReal *copy);
void DemBondsForce3_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal g2, PetscReal lambda, PetscReal *copy);
/* sum of G (A/d) |gap|^2 over the block's bonds [J] */
PetscReal DemBondsEnergy2_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal g_shear, const PetscReal *copy);
PetscReal DemBondsEnergy3_Internal(PetscInt wide, PetscInt first, PetscInt last, const DemBonds *bonds, PetscReal g_shear, const PetscReal *copy);

/* dem_checkpoint.c: as Stepper.save and load */
PetscErrorCode DemSave_Internal(void *ctx, Checkpoint c);
PetscErrorCode DemLoad_Internal(void *ctx, Checkpoint c);

/* dem_watch.c */
PetscErrorCode DemWatch_Internal(void *ctx, RunWatch look, char fault[BASE_LINE]); /* as Stepper.watch */

/* dem_walls.c */
void      DemFacesSetTime_Internal(DemModel model, PetscReal t);
PetscErrorCode DemPressureLook_Internal(DemModel model); /* between steps, collective */
void      DemWallsSum_Internal(DemModel model, PetscInt p, PetscReal *sum);
void      DemWallsForce_Internal(DemModel model, PetscInt p, PetscReal dilation, PetscReal f[DEM_FORCE_ALL]);
PetscReal DemWallsEnergy_Internal(DemModel model);
void      DemFacesReactions_Internal(DemModel model);
/* State of the loaded facets into now [walls][7]; returns their work since `before` (may be NULL) [J], trapezoid.  Eq. (4.12) */
PetscReal DemTractionWork_Internal(DemModel model, const PetscReal *before, PetscReal *now);

void      DemFacetForce_Internal(DemModel model, PetscInt i, PetscReal t[3]); /* of boundary facet i on its particle [N] */

/* dem_fields.c, dem_crack_list.c */
void           DemBondForce_Internal(DemModel model, PetscInt e, PetscReal t[3]); /* on particle p [N] */
PetscErrorCode DemStress_Internal(DemModel model, PetscReal *stress);            /* [n][6] packing's order */
PetscErrorCode DemStrain_Internal(DemModel model, PetscReal *strain);            /* [n][6] */
void           DemDamage_Internal(DemModel model, PetscReal *damage);            /* [n] largest over the cell's facets */
PetscErrorCode DemWriteCracks_Internal(DemModel model, Output output);           /* block "cracks": facets that have begun to break */

/* dem_bond_list.c */
void           DemCoordination_Internal(DemModel model, PetscReal *number);        /* [n] unbroken bonds of each particle, packing's order */
PetscErrorCode DemCriterion_Internal(DemModel model, PetscReal *criterion);        /* [n] largest over the particle's bonds */
PetscErrorCode DemWriteBonds_Internal(DemModel model, Output output);              /* block "bonds": lines between centres */
PetscErrorCode DemBondListDestroy_Internal(DemModel model);

/* dem_gauge.c */
PetscErrorCode DemColumn_Internal(DemModel model, const DemHistory *column, PetscReal *value);
PetscErrorCode DemProbe_Internal(DemModel model, const DemHistory *column, PetscReal *value); /* dem_probe.c */
PetscErrorCode DemUnbalanced_Internal(void *model, PetscReal *ratio); /* dem_stepper.c */

/* dem_force.c: forces, torques, dilations of the present state */
PetscErrorCode DemForces_Internal(DemModel model, PetscInt flags);
PetscErrorCode DemStrainEnergy_Internal(DemModel model, PetscReal *energy);

PetscErrorCode DemKineticEnergy_Internal(DemModel model, PetscReal *kinetic, PetscReal *damping_due);

/* dem_crack.c: what the live bonds of a block add to the rule of all its bonds */
PetscErrorCode DemSetUpCracks_Internal(DemModel model);
PetscErrorCode DemCracksDestroy_Internal(DemModel model);
DemStrength    DemStrengthOf_Internal(DemModel model, PetscInt bond);
/* Major principal value and unit direction of a symmetric tensor, Voigt xx yy zz xy yz zx; 2D uses the plane alone. */
PetscReal      DemMajorDirection_Internal(PetscInt dim, const PetscReal s[6], PetscReal e[3]);
PetscErrorCode DemCracksLook_Internal(DemModel model); /* stresses, opening directions, which blocks are awake */
void      DemCracksSum_Internal(DemModel model, PetscInt block, PetscReal *copy);
void      DemCracksForce_Internal(DemModel model, PetscInt block, PetscReal *copy, PetscInt flags);
PetscBool DemCrackClosed_Internal(DemModel model, PetscInt e); /* the broken part of bond e is pressed shut */
PetscReal DemCracksEnergy_Internal(DemModel model, PetscInt block, PetscReal *copy); /* of closed, broken parts */

/* dem_tool.c: contact of surface particles with the tools, added to f and torque. dt = 0: of the state at the start */
PetscErrorCode DemToolsSetUp_Internal(DemModel model);
PetscErrorCode DemToolsDestroy_Internal(DemModel model);
PetscInt       DemToolFind_Internal(DemModel model, const char *name); /* -1 when absent */
PetscErrorCode DemToolsForce_Internal(DemModel model, PetscReal dt);
PetscReal      DemToolsEnergy_Internal(DemModel model);
PetscReal      DemToolsRate_Internal(DemModel model, PetscReal *drag); /* bound of K/m [1/s2]; adds that of C/m [1/s] to *drag.  Eq. (5.57) */
/* dem_tool_motion.c: kick (kick: dt, or half of it at first) and drift to t + dt; adds to *kinetic and *gravity */
PetscErrorCode DemToolsAdvance_Internal(DemModel model, PetscReal t, PetscReal kick, PetscReal dt);
void           DemToolsKinetic_Internal(DemModel model, PetscReal *kinetic, PetscReal *gravity);
/* dem_tool_io.c */
PetscInt       DemToolQuantity_Internal(PetscInt dim, const char *quantity, PetscInt *first, const char **unit); /* components; 0: not known */
PetscReal      DemToolHistory_Internal(DemModel model, PetscInt tool, const char *quantity, PetscInt c);
PetscErrorCode DemToolsWrite_Internal(DemModel model, Output output);
PetscErrorCode DemToolsSave_Internal(DemModel model, Checkpoint checkpoint);
PetscErrorCode DemToolsLoad_Internal(DemModel model, Checkpoint checkpoint);

/* dem_contacts.c: search; dem_contacts_force.c: forces, added to f and torque; dt [s] since the last evaluation */
PetscErrorCode DemSetUpContacts_Internal(DemModel model);     /* of the whole body: laws, skin */
PetscErrorCode DemSetUpContactRoom_Internal(DemModel model);  /* of what is here */
PetscErrorCode DemContactsRoomDestroy_Internal(DemModel model);
PetscErrorCode DemContactsDestroy_Internal(DemModel model);
PetscErrorCode DemContactsSearch_Internal(DemModel model);
PetscErrorCode DemContactsBlocks_Internal(DemModel model);
PetscErrorCode DemContactsWho_Internal(DemModel model);
PetscErrorCode DemContactsRoom_Internal(DemModel model, PetscInt room);
PetscErrorCode DemContactsForce_Internal(DemModel model, PetscReal dt);
/* dem_contacts_ranks.c: contacts between ranks */
PetscErrorCode DemMeetersOfOthers_Internal(DemModel model, DemMeeters *m);      /* those that may meet a particle here, put in between */
PetscErrorCode DemContactGhosts_Internal(DemModel model, PetscInt n, const PetscInt id[]); /* the copies a list needs from now on, ascending */
PetscErrorCode DemContactGhostsMove_Internal(DemModel model);                   /* their motion */
PetscErrorCode DemContactGhostsGone_Internal(DemModel model, unsigned char gone[]); /* [ghosts] */
PetscErrorCode DemContactsAgree_Internal(DemModel model, PetscInt n, PetscInt sum[]); /* sums over the ranks; nothing on one */
PetscInt       DemContactId_Internal(DemModel model, PetscInt p);                /* its number on one rank */
void           DemContactParticle_Internal(DemModel model, PetscInt p, PetscReal at[DEM_MEET_ALL]); /* particle or copy p of a pair */
void           DemContactsStill_Internal(DemModel model);  /* no force on particles that have left */
void           DemContactsThrough_Internal(DemModel model, PetscReal *sum, PetscInt *n); /* of normal forces, for the out-of-balance ratio */
PetscReal      DemContactEnergy_Internal(DemModel model, PetscInt k, PetscReal overlap); /* of pair k [J] */
PetscReal      DemContactsEnergy_Internal(DemModel model);
PetscReal      DemContactsRate_Internal(DemModel model, PetscReal *drag); /* bounds of K/m [1/s2] and C/m [1/s].  Eq. (5.36) */
PetscReal      DemDampedStep_Internal(PetscReal rate, PetscReal drag);
PetscErrorCode DemContactsSave_Internal(DemModel model, Checkpoint c);
PetscErrorCode DemContactsLoad_Internal(DemModel model, Checkpoint c);
/* Kind of a particle that shares its mass with elements: 0 whole, k from 2^-k of it up; as stiff in a contact as that, so that the overlap sets no smaller step. */
#define DEM_SHARE_KINDS 8
PetscInt       DemShareKind_Internal(DemModel model, PetscInt p);
/* dem_continue_touch.c: what touches goes on; of [from->n]: this model's number of each of from's particles */
PetscErrorCode DemContactsContinue_Internal(DemModel model, DemModel from, const PetscInt of[]);
PetscErrorCode DemToolsContinue_Internal(DemModel model, DemModel from, const PetscInt of[]);

/* dem_rain.c */
void           DemRainSleep_Internal(DemModel model); /* at set-up */
PetscErrorCode DemRainFall_Internal(DemModel model);  /* those whose turn has come, before forces */
PetscErrorCode DemRainSave_Internal(DemModel model, Checkpoint c);
PetscErrorCode DemRainLoad_Internal(DemModel model, Checkpoint c);

/* dem_clumps.c; all but the first do nothing without clumps */
PetscErrorCode DemSetUpClumps_Internal(DemModel model);   /* after the particles' order */
PetscErrorCode DemClumpsDestroy_Internal(DemModel model);
void           DemClumpsUnweigh_Internal(DemModel model); /* the weight of a clump acts on the clump, not on its spheres */
void           DemClumpsGather_Internal(DemModel model);  /* forces of the spheres to force and couple of their clump */
void           DemClumpsAdvance_Internal(DemModel model, PetscReal kick, PetscReal dt);
void           DemClumpsPlace_Internal(DemModel model, PetscInt k, const PetscReal x[3], const PetscReal v[3]); /* put clump k there, not spinning */
void           DemClumpsLeave_Internal(DemModel model, PetscInt k, PetscReal *taken); /* out of the box: its spheres are gone, its energy is taken */
void           DemClumpsEnergy_Internal(DemModel model, PetscReal *kinetic, PetscReal *gravity);
PetscReal      DemClumpLight_Internal(DemModel model, PetscInt p, PetscReal *share); /* least mass a contact of sphere p can feel [kg]; *share: that over the spheres of its clump */
PetscInt       DemGrains_Internal(DemModel model);        /* grains: clumps, and spheres that belong to none */
PetscInt       DemGrainsGone_Internal(DemModel model);
PetscErrorCode DemClumpsSave_Internal(DemModel model, Checkpoint c);
PetscErrorCode DemClumpsLoad_Internal(DemModel model, Checkpoint c);

static inline PetscBool DemInClump(DemModel model, PetscInt p)
{
  return (PetscBool)(model->clumps.n && model->clumps.of[p] >= 0);
}

/* dem_static.c */
PetscErrorCode DemStaticCreate_Internal(DemModel model); /* at the end of set-up */
PetscErrorCode DemStaticDestroy_Internal(DemModel model);
PetscErrorCode DemStaticStep_Internal(void *ctx, PetscReal t, PetscReal dt);
PetscReal     *DemStaticReference_Internal(DemModel model); /* what a checkpoint keeps: out-of-balance [N] */

/* dem_step.c */
PetscErrorCode DemBook_Internal(DemModel model); /* work of supports and loads since DemModelAdvance() */
PetscErrorCode DemStep_Internal(void *ctx, PetscReal t, PetscReal dt);

/* couple += scale (a x b): moment of a force b at arm a, in a record of what a particle feels */
static inline void DemAddMoment(const PetscReal a[3], const PetscReal b[3], PetscReal scale, PetscReal *f)
{
  f[DEM_FORCE_COUPLE] += scale * (a[1] * b[2] - a[2] * b[1]);
  f[DEM_FORCE_COUPLE + 1] += scale * (a[2] * b[0] - a[0] * b[2]);
  f[DEM_FORCE_COUPLE + 2] += scale * (a[0] * b[1] - a[1] * b[0]);
}

/* Current vector of a body-fixed one: (R - I) r, by the particle's rotation.  Eq. (4.2) */
static inline void DemTurn(PetscInt dim, PetscInt n, PetscInt p, const PetscReal *rot, const PetscReal r[3], PetscReal out[3])
{
  if (dim == 2) {
    const PetscReal s = rot[p], c1 = rot[n + p];

    out[0] = c1 * r[0] - s * r[1];
    out[1] = s * r[0] + c1 * r[1];
    out[2] = 0;
  } else {
    const PetscReal w = rot[p], x = rot[n + p], y = rot[2 * n + p], z = rot[3 * n + p];
    const PetscReal tx = 2 * (y * r[2] - z * r[1]), ty = 2 * (z * r[0] - x * r[2]), tz = 2 * (x * r[1] - y * r[0]);

    out[0] = w * tx + (y * tz - z * ty);
    out[1] = w * ty + (z * tx - x * tz);
    out[2] = w * tz + (x * ty - y * tx);
  }
}
