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
PetscErrorCode CoupledDestroy(Coupled *c);
