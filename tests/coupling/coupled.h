/* coupled.h - a box whose middle is particles: what the coupling tests share. */
#pragma once
#include "coupling.h"

typedef struct {
  Mesh          mesh;
  CouplingSplit split;
  DemBody       body;
  DemPacking    packing;
  DemCells      cells;
  FemModel      fem;
  DemModel      dem;
  CouplingModel model;
  FemMaterial   material;
} Coupled;

/* Box [0, size] of elements of edge h, cells with centroid x in (from, to) particles of spacing h/ratio; plane strain in 2D. Young 1, density 1. */
PetscErrorCode CoupledCreate(PetscInt dim, const PetscReal size[3], PetscReal h, PetscReal from, PetscReal to, PetscReal ratio, PetscInt width, PetscReal nu, uint64_t seed, const CouplingOptions *options, Coupled *c);
/* The same with cells of this type instead of quadrilaterals or hexahedra. */
PetscErrorCode CoupledCreateOf(MeshCellType type, const PetscReal size[3], PetscReal h, PetscReal from, PetscReal to, PetscReal ratio, PetscInt width, PetscReal nu, uint64_t seed, const CouplingOptions *options, Coupled *c);
/* The same; nodes that are chosen by their place [m] are groups of their own, "node <number in the whole mesh>". */
typedef PetscBool (*CoupledNodes)(const PetscReal x[3]);
PetscErrorCode CoupledCreateNodes(MeshCellType type, const PetscReal size[3], PetscReal h, PetscReal from, PetscReal to, PetscReal ratio, PetscInt width, PetscReal nu, uint64_t seed, CoupledNodes nodes, const CouplingOptions *options, Coupled *c);
/* The same equations in one dimension: a strip one element high, nu = 0, its particles in columns of random spacing; rows alike. */
PetscErrorCode CoupledCreateChain(PetscReal length, PetscReal from, PetscReal to, PetscReal ratio, PetscInt width, uint64_t seed, const CouplingOptions *options, Coupled *c);
PetscErrorCode CoupledDestroy(Coupled *c);
/* Steps from .. to of a plane strip held at xmin and ymin, with weight, pulled ever more at xmax: loads and supports on inner and outer nodes. Sets the model
   up. load, save: checkpoints to begin from, to end with, or NULL; look: energies after every step. u [room]: displacements of nodes, then of particles, n of them. */
PetscErrorCode CoupledRunPulled(Coupled *c, PetscInt from, PetscInt to, PetscBool look, const char *load, const char *save, PetscInt room, PetscReal *u, PetscInt *n, Ledger *ledger);
/* A plane bar under traction, at rest from the start: largest |u - exact| / (strain x element) of nodes; what is off along the bar after so many undamped steps, over the
   displacement of the end (across it the bar is free); critical step; wall clock of the steps [s], may be NULL. options: with preload. */
PetscErrorCode CoupledRest(const CouplingOptions *options, PetscInt steps, PetscReal *off, PetscReal *drift, PetscReal *step, PetscReal *seconds);
