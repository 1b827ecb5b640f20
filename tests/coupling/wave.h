/* wave.h - steady waves in a strip, from fine to coarse: how much comes back.  Shared by test_wave.c and bench/coupled_wave.c */
#pragma once
#include "coupled.h"

#define WAVE_RATIO 4 /* coarse edge h over fine spacing d */
#define WAVE_STEP  0.45 /* of d/c, for both; the turning of the cells, not the wave, bounds the coupled strip's step */

/*
  WaveReflect - reflected energy / sent energy at wavelength lambda (in coarse edges h = 1, in a continuum: omega = 2 pi c / lambda)

  width 0: a chain of elements of length d, then of length h, joined at a node. width >= 1: a strip of square cells d in four rows, coupled over width
  coarse elements. nu = 0; a unit wave is sent by the left end, and both directions fitted to what passes a probe section before the join.
  dt: out, the step used; may be NULL.
*/
PetscErrorCode WaveReflect(PetscReal lambda, PetscInt width, const CouplingOptions *options, PetscReal *energy, PetscReal *dt);

/* The same into plane cells of this type with edges of 2 h, say, for quadratic ones: as many nodes on the way, particles as they are. width in such cells, >= 1. */
PetscErrorCode WaveReflectFrom(MeshCellType type, PetscInt edge, PetscReal lambda, PetscInt width, const CouplingOptions *options, PetscReal *energy, PetscReal *dt);

/* ((Z_d - Z_h)/(Z_d + Z_h))^2, Z(s) = sqrt(1 - (O s/2)^2), O = 2/dt sin(omega dt/2): two lumped chains joined at a node */
PetscReal WaveEdge(PetscReal lambda, PetscReal dt);
