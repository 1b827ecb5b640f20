/* ledger.c - the sum that must stay zero.  Eqs (1.3), (1.4), docs/theory.md */
#include "ledger.h"

const char *const LedgerNames[LEDGER_TERMS] = {"kinetic", "strain", "fracture", "friction", "damping", "coupling", "contact", "work"};

void LedgerAdd(Ledger *sum, const Ledger *part)
{
  for (int term = 0; term < LEDGER_TERMS; term++) sum->energy[term] += part->energy[term];
  sum->initial += part->initial;
  sum->work_in += part->work_in;
  sum->scale += part->scale;
}

PetscReal LedgerBalance(const Ledger *ledger)
{
  PetscReal sum = 0;

  for (int term = 0; term < LEDGER_WORK; term++) sum += ledger->energy[term];
  return sum - ledger->energy[LEDGER_WORK] - ledger->initial;
}

/* Nothing in and nothing out is no error; something out of nothing is an infinite one. NaN stays NaN. */
PetscReal LedgerError(const Ledger *ledger)
{
  const PetscReal off   = PetscAbsReal(LedgerBalance(ledger));
  const PetscReal floor = 1e-12 * PetscAbsReal(ledger->scale);
  const PetscReal given = ledger->work_in + PetscAbsReal(ledger->initial);

  if (off == 0) return 0;
  return off / PetscMax(given, floor);
}
