/* table.h - a quantity in time: constant, ramp or piecewise linear. */
#pragma once
#include "base.h"

/* Piecewise linear through (t[k], v[k]), constant outside. n == 1 is a constant. Owned arrays; plain struct, copied by TableCopy. */
typedef struct {
  PetscInt   n;
  PetscReal *t; /* [n] time [s], strictly increasing */
  PetscReal *v; /* [n] value [SI] */
} Table;

PetscErrorCode TableCreate(PetscInt n, const PetscReal t[], const PetscReal v[], Table *table); /* copies */
PetscErrorCode TableCreateConstant(PetscReal value, Table *table);
PetscErrorCode TableCopy(const Table *from, Table *to);
PetscErrorCode TableDestroy(Table *table); /* frees; safe on a zeroed struct */

PetscReal TableValue(const Table *table, PetscReal t);    /* v(t) */
PetscReal TableIntegral(const Table *table, PetscReal t); /* int_0^t v dt, exact: a velocity table gives displacement */
PetscReal TableSlope(const Table *table, PetscReal t);    /* dv/dt from the right */
