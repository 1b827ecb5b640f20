/*
  dem_contacts.h - contacts among the particles of one DemModel: who may meet whom, and what each pair remembers.

  Pairs are sorted by first, then second particle, whatever found them, so every sum has one order. A pair belongs to
  the block of its first particle; what a block adds to particles of other blocks goes through slots, as bonds do.

  On several ranks a list holds the pairs that touch the rank's own particles, [0, own); other ranks' particles in it are
  copies, own + k for the k-th, kept here and not among the model's. Pairs are sorted by their particles' numbers on one rank,
  and blocks of others stand among the rank's own, empty of particles, so every sum has the order it has on one rank.
*/
#pragma once
#include "dem.h"
#include "dem_ranks.h"

#define DEM_CONTACT_BLOCK 512 /* particles */
#define DEM_CONTACT_BROKEN 0.9999 /* damage from which a bond counts as broken; exponential softening never ends */
#define DEM_CONTACT_CHUNK 64  /* pairs looked at together: their numbers stay in the first-level cache */

enum { DEM_PAST_SLIP = 0, DEM_PAST_OVERLAP = 3, DEM_PAST_DRAG = 4, DEM_PAST_OFFSET = 7, DEM_PAST = 8 };

/* What a contact knows of a particle: position, radius, velocity, mass, spin, kind of material. */
enum { DEM_MEET_X = 0, DEM_MEET_R = 3, DEM_MEET_V = 4, DEM_MEET_M = 7, DEM_MEET_W = 8, DEM_MEET_KIND = 11, DEM_MEET_ALL = 12 };

/* Those a search looks at, ascending by number. */
typedef struct {
  PetscInt       n;
  PetscInt      *id;    /* [n] number on one rank */
  PetscInt      *at;    /* [n] particle here; -1: another rank's */
  PetscReal     *x, *r; /* [n][3], [n] now [m] */
  unsigned char *fresh; /* [n] NULL: none */
} DemMeeters;

typedef struct {
  PetscBool         on;
  DemContactOptions options;
  PetscInt          n_kinds;   /* of material */
  DemContactPair   *table;     /* [n_kinds][n_kinds] */
  unsigned char    *kind;      /* [n] of each particle; NULL: all 0 */
  PetscBool         turns;     /* some pair has rolling or twisting resistance */
  PetscReal         skin;      /* [m] */
  PetscReal         flat;      /* discs: size of a contact [m]; 0 in 3D */

  PetscInt       n_who, room;  /* particles that are searched; pairs the arrays have room for */
  PetscInt      *who;          /* ascending */
  PetscReal     *ref;          /* [3][n] position at the last search [m]; own */
  unsigned char *gone;         /* [n] has left the box; NULL unless there is one */
  PetscInt       n_gone;
  unsigned char *fresh;        /* [n] woke since the last search: what it overlaps then it overlaps without force; NULL: none */
  PetscReal      taken;        /* energy that left with them [J] */

  PetscInt       m;
  PetscInt      *p, *q;        /* [m] internal numbers, p < q */
  int           *ip, *iq;      /* [m] in the block's copy */
  PetscReal     *past;         /* [m][8] slip, overlap (negative: slid), drag, stress-free offset */
  PetscReal     *roll;         /* [m][4] rolling angle, twist; NULL unless turns */
  PetscReal     *image;        /* [m][3] added to x_p - x_q; NULL unless periodic */
  unsigned char *met;          /* [m] touched at the last evaluation */

  PetscInt       ghosts;       /* others' particles in the list */
  PetscInt      *ghost_id;     /* [ghosts] */
  DemHalo        halo;         /* halo.in: [ghosts][DEM_MEET_ALL] now */
  MPI_Datatype   record;
  PetscInt       too_deep;     /* 1: an overlap has passed what the step was chosen for; told at the next step */

  PetscInt   n_blocks, widest, n_slots;
  PetscInt  *first, *last;     /* [n_blocks] own particles of each; none of another rank's */
  PetscInt  *pair;             /* [n_blocks + 1] */
  PetscInt  *halo_start, *halo_p; /* [n_blocks + 1], particles and copies of other blocks that a block's pairs reach */
  PetscInt  *slot_start, *slot; /* of each own particle */
  PetscReal *slot_f;           /* [slots][8] */
  PetscReal *sum;              /* [n_blocks][4] friction, damping, deepest overlap / radius, touching */
  PetscReal **scratch;         /* [threads] */

  PetscInt  searches, looked;  /* how often; distances taken here in all */
  PetscInt  touching;          /* pairs counted here at the last evaluation */
  PetscReal deepest;           /* overlap / radius over the run */
  PetscInt  broken;            /* bonds broken at the last search, of all ranks */
} DemContacts;
