/*
  dem_clump.h - a grain made of several spheres that keep their places: its shape and what it weighs.  Eqs (5.90)-(5.94)

  The mass is that of the union of the spheres, overlaps counted once, or what the user gives.
*/
#pragma once
#include "dem_packing.h"

typedef struct {
  PetscInt   n;           /* spheres */
  PetscReal *x, *r;       /* [n][3] from the centre of mass, along the axes they were given in; [n] [m] */
  PetscReal  volume;      /* of the union [m3] */
  PetscReal  mass;        /* given [kg]; 0: density x volume */
  PetscReal  moments[3];  /* principal: of the union at unit density [m5], or given with the mass [kg m2] */
  PetscReal  axes[3][3];  /* their axes as columns, right-handed */
  PetscReal  reach;       /* of the sphere about the centre of mass that holds all [m] */
} DemClump;

/* Where one clump of a model lies: a shape drawn `scale` times as large. */
typedef struct {
  const DemClump *shape;
  PetscInt        first;  /* of its spheres in the packing, which follow each other as in the shape */
  PetscReal       scale, centre[3], quaternion[4]; /* of the axes the shape was given in: w x y z */
} DemClumpPlace;

/* Moments of a union of spheres at unit density: volume [m3], int x dV [m4], int x x^T dV [m5].  Eqs (5.90)-(5.92) */
PetscErrorCode DemUnionMoments(PetscInt n, const PetscReal x[], const PetscReal r[], PetscReal *volume, PetscReal first[3], PetscReal second[3][3]);

/* Shape with the mass of its union. x [n][3], r [n]: copied. */
PetscErrorCode DemClumpCreate(PetscInt n, const PetscReal x[], const PetscReal r[], DemClump *clump);
/* Shape with given mass [kg], centre [m] and moments of inertia [kg m2] about the axes x, y, z through it, which must be principal. */
PetscErrorCode DemClumpCreateGiven(PetscInt n, const PetscReal x[], const PetscReal r[], PetscReal mass, const PetscReal centre[3], const PetscReal moments[3], DemClump *clump);
PetscErrorCode DemClumpDestroy(DemClump *clump);

/* A clump into each sphere of `balls`, which holds it: the shape drawn so that its reach is the sphere's radius, turned at random by `seed` or (random
   false) as it was given. members: the spheres of all; place [balls->n], the caller frees. */
PetscErrorCode DemPackingMakeClumps(const DemPacking *balls, const DemClump *shape, PetscBool random, PetscInt seed, DemPacking *members, DemClumpPlace **place);
