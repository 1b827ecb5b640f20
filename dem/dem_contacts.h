/*
  dem_contacts.h - contacts among the particles of one DemModel: who may meet whom, and what each pair remembers.

  Pairs are sorted by first, then second particle, whatever found them, so every sum has one order. A pair belongs to
  the block of its first particle; what a block adds to particles of other blocks goes through slots, as bonds do.
*/
#pragma once
#include "dem.h"

#define DEM_CONTACT_BLOCK 512 /* particles */
#define DEM_CONTACT_BROKEN 0.9999 /* damage from which a bond counts as broken; exponential softening never ends */
#define DEM_CONTACT_CHUNK 64  /* pairs looked at together: their numbers stay in the first-level cache */

enum { DEM_PAST_SLIP = 0, DEM_PAST_OVERLAP = 3, DEM_PAST_DRAG = 4, DEM_PAST_OFFSET = 7, DEM_PAST = 8 };

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
  PetscReal     *ref;          /* [3][n] position at the last search [m] */
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

  PetscInt   n_blocks, widest, n_slots;
  PetscInt  *pair;             /* [n_blocks + 1] */
  PetscInt  *halo_start, *halo;
  PetscInt  *slot_start, *slot; /* of each particle */
  PetscReal *slot_f;           /* [slots][8] */
  PetscReal *sum;              /* [n_blocks][4] friction, damping, deepest overlap / radius, touching */
  PetscReal **scratch;         /* [threads] */

  PetscInt  searches, looked;  /* how often; distances taken in all */
  PetscInt  touching;          /* pairs at the last evaluation */
  PetscReal deepest;           /* overlap / radius over the run */
  PetscInt  broken;            /* bonds broken at the last search */
} DemContacts;
