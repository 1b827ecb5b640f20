/*
  fem_modal.h - eigenfrequencies and shapes of a body, through SLEPc: a library of its own, so that nobody else links it.  Eqs (2.65)-(2.67)
*/
#pragma once
#include "fem.h"

typedef struct {
  PetscInt   n;
  PetscReal *frequency; /* [n] ascending [Hz]; rigid motions of a free body come first, at 0 up to round-off */
  PetscReal *residual;  /* [n] |K x - lambda M x| / ((|K| + |lambda| |M|) |x|) */
  PetscReal *shape;     /* [n][own dofs of this rank]; largest displacement 1 m, the first such component positive */
  PetscReal  shift;     /* [Hz] of the factor K - (2 pi shift)^2 M; negative: K + (2 pi shift)^2 M, for a body that can move freely */
} FemModal;

/*
  FemModalSolve - the count modes nearest to a frequency

  Input:   model - FEM_MODAL, after FemModelSetUp(); shift [Hz], < 0: the lowest modes
  Errors:  PETSC_ERR_USER_INPUT for more modes than free dofs, PETSC_ERR_NOT_CONVERGED
*/
PetscErrorCode FemModalSolve(FemModel model, PetscInt count, PetscReal shift, FemModal *modes);
PetscErrorCode FemModalShow(FemModel model, const FemModal *modes, PetscInt k); /* its shape becomes the model's displacement, for frames */
PetscErrorCode FemModalDestroy(FemModal *modes);
