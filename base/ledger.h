/* ledger.h - where the joules are.  Eq. (1.3), docs/theory.md */
#pragma once
#include "base.h"

typedef enum {
  LEDGER_KINETIC, LEDGER_STRAIN, LEDGER_FRACTURE, LEDGER_FRICTION, LEDGER_DAMPING, LEDGER_COUPLING, LEDGER_CONTACT,
  LEDGER_WORK, LEDGER_TERMS
} LedgerTerm;

extern const char *const LedgerNames[LEDGER_TERMS];

/* energy[] [J]: each term from its own force and motion; none is the difference of others. work_in is the sum of
   |increments of external work| so far [J], scale a strain-energy scale of the model for the floor [J]. */
typedef struct {
  PetscReal energy[LEDGER_TERMS];
  PetscReal initial; /* kinetic + strain when the run began */
  PetscReal work_in;
  PetscReal scale;
} Ledger;

void      LedgerAdd(Ledger *sum, const Ledger *part);
PetscReal LedgerBalance(const Ledger *ledger); /* signed, [J] */
PetscReal LedgerError(const Ledger *ledger);   /* relative, >= 0; eq. (1.4) */
