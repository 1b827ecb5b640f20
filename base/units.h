/* units.h - a number with a unit, to SI. Reading of units is udunits2's; the names it lacks (deg, elements) are ours. */
#pragma once
#include "base.h"

typedef enum { UNITS_OK, UNITS_UNKNOWN, UNITS_DIMENSION } UnitsResult;

/*
  UnitsConvert - value [from] as *result [to]

  Both are texts such as "GPa", "kg/m3", "mm"; "-" or "" is a plain number. An angle is not a plain number here, although
  udunits takes it for one: a friction coefficient of 26.6 deg would silently become 0.46 instead of 0.50.
  Powers of ten are exact: 1.1 mm is the double nearest to 0.0011.

  Output: why - UNITS_UNKNOWN: `from` is not a unit; UNITS_DIMENSION: it is, of another dimension. *result is set for UNITS_OK only.
  Errors: PETSC_ERR_LIB when udunits' database is missing; PETSC_ERR_ARG_WRONG when `to` is not a unit
*/
PetscErrorCode UnitsConvert(const char *from, const char *to, PetscReal value, PetscReal *result, UnitsResult *why);

const char *UnitsWord(const char *unit);    /* "a pressure" for "GPa"; "of another kind" for a dimension without a word of ours */
const char *UnitsExample(const char *unit); /* "28 GPa" for "Pa" */
