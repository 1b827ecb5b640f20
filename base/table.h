/* table.h - a quantity in time: constant, ramp or piecewise linear; and the time that tables are read at. */
#pragma once
#include "base.h"

/*
  Load time tau(t): how far along its tables a run is at time t, where a governor (run_govern.h) lets the load run ahead or lag.  Eq. (1.9)
  The pace dtau/dt is linear between four knots, the span at hand is knots 1 to 2: what was, is and comes next is known, so that models may look a step back or ahead.
*/
typedef struct {
  PetscReal at[4];   /* time of the knots [s] */
  PetscReal load[4]; /* load time there [s] */
  PetscReal pace[4]; /* d(load time)/d(time) there [-] */
} TableClock;

PetscReal TableClockTime(const TableClock *clock, PetscReal t); /* load time at t; NULL: t itself */
PetscReal TableClockPace(const TableClock *clock, PetscReal t); /* its rate; NULL: 1 */

/* Piecewise linear through (t[k], v[k]), constant outside. n == 1 is a constant. Owned arrays; plain struct, copied by TableCopy. */
typedef struct {
  PetscInt   n;
  PetscReal *t; /* [n] time [s], strictly increasing */
  PetscReal *v; /* [n] value [SI] */
  const TableClock *clock; /* t[] are load times; borrowed, handed on by TableCopy; NULL: times */
} Table;

PetscErrorCode TableCreate(PetscInt n, const PetscReal t[], const PetscReal v[], Table *table); /* copies; no clock */
PetscErrorCode TableCreateConstant(PetscReal value, Table *table);
PetscErrorCode TableCopy(const Table *from, Table *to);
PetscErrorCode TableDestroy(Table *table); /* frees; safe on a zeroed struct */

/* At time t, whatever the clock. Integral and slope belong to displacement given by velocity, and the other way round. */
PetscReal TableValue(const Table *table, PetscReal t);    /* v */
PetscReal TableRate(const Table *table, PetscReal t);     /* v dtau/dt: the speed of what a velocity table moves */
PetscReal TableIntegral(const Table *table, PetscReal t); /* int_0^tau v dtau, exact: a velocity table gives displacement */
PetscReal TableSlope(const Table *table, PetscReal t);    /* dv/dt from the right */
