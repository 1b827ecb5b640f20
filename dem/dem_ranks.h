/*
  dem_ranks.h - inside a DemModel that runs on several ranks.

  Particles keep the order one rank would give them, cut into the same blocks; a rank owns whole blocks. Its arrays hold its
  own particles first, [0, own), then copies of others' (ghosts) that its bonds reach. A bond or a contact that joins two
  ranks is in the lists of both: each does it from the same numbers, and takes what falls on its own particles. Blocks
  whose first ends are another rank's stand among the rank's own, without particles of their own, so every sum into a
  particle has the order it has on one rank.
*/
#pragma once
#include "dem.h"
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

/* Rows that a rank wants, and where they are. */
typedef struct {
  PetscInt        n;    /* rows wanted */
  const PetscInt *take; /* [n] rows of arrays that are all here; not with sf */
  PetscSF         sf;   /* from the rows of all ranks */
  MPI_Comm        comm; /* with sf */
} DemCarry;

/* What becomes of a rank when a body is shared out; numbers are those of one rank. */
typedef struct {
  PetscInt  own, n, *id;          /* particles here: own, with ghosts; their numbers */
  PetscInt *local;                /* [particles] number here, -1 */
  PetscInt  bonds, *bond;         /* ascending, as all lists */
  PetscInt  blocks, *block, *first, *bond_start; /* blocks that are here: number; first own particle, first bond */
  PetscInt  facets, *facet, *facet_local;
  PetscInt  walls, *wall, cell_walls, *cell_wall;
  DemCarry  of_particles, of_packing, of_bonds, of_facets, of_walls, of_cell_walls;
} DemPart;

typedef struct {
  PetscMPIInt    size, rank;
  PetscInt       particles, bonds, walls, cell_walls, facets, blocks; /* of all ranks */
  PetscInt       ghosts;     /* in [own, own + ghosts): copies that bonds reach. Contacts keep their own (dem_contacts.h) */
  PetscInt      *id;         /* [n] number in the order of one rank */
  PetscInt      *number;     /* [n] packing's number */
  PetscInt      *bond;       /* [bonds here] number in the order of one rank */
  PetscInt      *wall;       /* [loaded or held facets here] likewise */
  PetscInt      *facet;      /* [facets here] of the whole body's cells */
  PetscInt      *cell_wall;  /* [boundary facets here] likewise */
  PetscInt      *block;      /* [blocks here] likewise */
  PetscInt      *bond_start; /* [blocks + 1] first bond of each block, in the order of one rank */
  unsigned char *mine;       /* [bonds here] counted here: its first end is the rank's own */
  unsigned char *block_mine; /* [blocks here] */

  PetscInt     unit;       /* particles of one order that stay together */
  PetscMPIInt *unit_owner; /* [ceil(particles / unit)] */
  PetscInt    *unit_start; /* [..] its first particle within its owner's own */

  DemHalo      halo;       /* to the ghosts */
  MPI_Datatype motion, stress; /* records */

  PetscInt   steps, every;  /* since the set-up; between looks at who has how much to do, 0: none */
  PetscReal  settled;       /* load of the busiest rank over the mean, when last shared out or found to stay */
  DemSharing sharing;

  PetscInt   n_work;
  PetscReal  work[DEM_RANKS_WORK]; /* [J] of the last steps, here */
} *DemRanks;
