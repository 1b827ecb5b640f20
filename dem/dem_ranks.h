/*
  dem_ranks.h - inside a DemModel that runs on several ranks.

  Particles keep the order one rank would give them, cut into the same blocks; a rank owns whole blocks. Its arrays hold its
  own particles first, [0, own), then copies of others' (ghosts) that its bonds reach. A bond or a contact that joins two
  ranks is in the lists of both: each does it from the same numbers, and takes what falls on its own particles. Blocks
  whose first ends are another rank's stand among the rank's own, without particles of their own, so every sum into a
  particle has the order it has on one rank.
*/
#pragma once
#include "base.h"
#include <petscsf.h>

#define DEM_HALO_ROW   12  /* numbers of the widest record */
#define DEM_RANKS_WORK 256 /* steps whose work waits to be summed over the ranks */

/* Copies of others' particles, and who sends them. */
typedef struct {
  PetscSF    sf;         /* from `border` to the copies */
  PetscInt   n, n_border;
  PetscInt  *border;     /* [n_border] own particles that have copies elsewhere */
  PetscReal *out, *in;   /* [n_border or n][DEM_HALO_ROW] */
} DemHalo;

typedef struct {
  PetscMPIInt    size, rank;
  PetscInt       particles, bonds, walls, cell_walls, blocks; /* of all ranks */
  PetscInt       ghosts;     /* in [own, own + ghosts): copies that bonds reach. Contacts keep their own (dem_contacts.h) */
  PetscInt      *id;         /* [n] number in the order of one rank */
  PetscInt      *number;     /* [n] packing's number */
  PetscInt      *bond;       /* [bonds here] number in the order of one rank */
  PetscInt      *wall;       /* [loaded or held facets here] likewise */
  PetscInt      *facet;      /* [facets here] of the whole body's cells */
  PetscInt      *block;      /* [blocks here] likewise */
  PetscInt      *bond_start; /* [blocks + 1] first bond of each block, in the order of one rank */
  unsigned char *mine;       /* [bonds here] counted here: its first end is the rank's own */
  unsigned char *block_mine; /* [blocks here] */

  PetscInt     unit;       /* particles of one order that stay together */
  PetscMPIInt *unit_owner; /* [ceil(particles / unit)] */
  PetscInt    *unit_start; /* [..] its first particle within its owner's own */

  DemHalo      halo;       /* to the ghosts */
  MPI_Datatype motion, stress; /* records */

  PetscInt   n_work;
  PetscReal  work[DEM_RANKS_WORK]; /* [J] of the last steps, here */
} *DemRanks;
