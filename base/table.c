/* table.c - piecewise linear in time. Few points, so a linear search from the start is the fast one. */
#include "table.h"

PetscErrorCode TableCreate(PetscInt n, const PetscReal t[], const PetscReal v[], Table *table)
{
  PetscFunctionBegin;
  PetscCheck(n > 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "A table needs at least one point");
  for (PetscInt k = 1; k < n; k++)
    BaseCheckInput(t[k] > t[k - 1], PETSC_COMM_SELF, "Table times must increase: %.6g s follows %.6g s", (double)t[k], (double)t[k - 1]);
  table->n = n;
  PetscCall(PetscMalloc2(n, &table->t, n, &table->v));
  PetscCall(PetscArraycpy(table->t, t, n));
  PetscCall(PetscArraycpy(table->v, v, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TableCreateConstant(PetscReal value, Table *table)
{
  const PetscReal zero = 0;

  return TableCreate(1, &zero, &value, table);
}

PetscErrorCode TableCopy(const Table *from, Table *to)
{
  return TableCreate(from->n, from->t, from->v, to);
}

PetscErrorCode TableDestroy(Table *table)
{
  PetscFunctionBegin;
  PetscCall(PetscFree2(table->t, table->v));
  table->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal TableValue(const Table *table, PetscReal t)
{
  PetscInt k = 1;

  if (t <= table->t[0]) return table->v[0];
  while (k < table->n && table->t[k] < t) k++;
  if (k == table->n) return table->v[k - 1];
  return table->v[k - 1] + (table->v[k] - table->v[k - 1]) * ((t - table->t[k - 1]) / (table->t[k] - table->t[k - 1]));
}

PetscReal TableIntegral(const Table *table, PetscReal t)
{
  PetscReal sum = table->v[0] * PetscMin(t, table->t[0]);

  for (PetscInt k = 1; k < table->n && table->t[k - 1] < t; k++) {
    const PetscReal end = PetscMin(t, table->t[k]);

    sum += 0.5 * (table->v[k - 1] + TableValue(table, end)) * (end - table->t[k - 1]);
  }
  if (t > table->t[table->n - 1]) sum += table->v[table->n - 1] * (t - table->t[table->n - 1]);
  return sum;
}

PetscReal TableSlope(const Table *table, PetscReal t)
{
  for (PetscInt k = 1; k < table->n; k++)
    if (t >= table->t[k - 1] && t < table->t[k]) return (table->v[k] - table->v[k - 1]) / (table->t[k] - table->t[k - 1]);
  return 0;
}
