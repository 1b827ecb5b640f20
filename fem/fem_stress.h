/* fem_stress.h - stress and strain at a point: laws both ways, invariants. Plain arrays; Voigt xx yy zz xy yz zx, shear strain as the angle. */
#pragma once
#include "fem_element.h"

/* Components that are independent: xx yy xy in the plane, all six in space. */
#define FEM_PARTS(dim) ((dim) == 2 ? 3 : 6)

/* s [parts] [Pa] of strain e [6]; in a plane body e_zz = 0 here.  Eqs (2.3), (2.4), (2.41) */
void FemStressOf(PetscInt dim, const FemElastic *law, const PetscReal e[6], PetscReal *s);
/* Voigt stress [6] [Pa], and the strain [6] that belongs to it, of s [parts]; either may be NULL. */
void FemStressExpand(PetscInt dim, const FemElastic *law, const PetscReal *s, PetscReal *stress, PetscReal *strain);
/* s : C^-1 : s [J/m3], twice the energy density.  Eq. (2.96) */
PetscReal FemStressNorm(PetscInt dim, const FemElastic *law, const PetscReal *s);

PetscReal FemVonMises(const PetscReal stress[6]); /* eq. (2.94) */
/* Eigenvalues, largest first, and unit eigenvectors direction[k] (NULL: not wanted); repeated roots are no special case.  Eq. (2.94) */
void FemPrincipal(const PetscReal stress[6], PetscReal value[3], PetscReal direction[3][3]);
