/* table.c - piecewise linear in time. Few points, so a linear search from the start is the fast one. */
#include "table.h"

PetscErrorCode TableCreate(PetscInt n, const PetscReal t[], const PetscReal v[], Table *table)
{
  PetscFunctionBegin;
  PetscCheck(n > 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "A table needs at least one point");
  for (PetscInt k = 1; k < n; k++)
    BaseCheckInput(t[k] > t[k - 1], PETSC_COMM_SELF, "Table times must increase: %.6g s follows %.6g s", (double)t[k], (double)t[k - 1]);
  table->n     = n;
  table->clock = NULL;
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
  PetscFunctionBegin;
  PetscCall(TableCreate(from->n, from->t, from->v, to));
  to->clock = from->clock;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TableDestroy(Table *table)
{
  PetscFunctionBegin;
  PetscCall(PetscFree2(table->t, table->v));
  table->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The span of knots that holds t, from its start s; the last knot's pace goes on. */
static PetscInt Span(const TableClock *clock, PetscReal t, PetscReal *s, PetscReal *bend)
{
  const PetscInt k = t < clock->at[1] ? 0 : t < clock->at[2] ? 1 : t < clock->at[3] ? 2 : 3;

  *s    = t - clock->at[k];
  *bend = k < 3 ? (clock->pace[k + 1] - clock->pace[k]) / (clock->at[k + 1] - clock->at[k]) : 0;
  return k;
}

PetscReal TableClockTime(const TableClock *clock, PetscReal t)
{
  PetscReal s, bend;
  PetscInt  k;

  if (!clock) return t;
  k = Span(clock, t, &s, &bend);
  return clock->load[k] + s * (clock->pace[k] + 0.5 * bend * s);
}

PetscReal TableClockPace(const TableClock *clock, PetscReal t)
{
  PetscReal s, bend;
  PetscInt  k;

  if (!clock) return 1;
  k = Span(clock, t, &s, &bend);
  return clock->pace[k] + bend * s;
}

static PetscReal ValueAt(const Table *table, PetscReal t)
{
  PetscInt k = 1;

  if (t <= table->t[0]) return table->v[0];
  while (k < table->n && table->t[k] < t) k++;
  if (k == table->n) return table->v[k - 1];
  return table->v[k - 1] + (table->v[k] - table->v[k - 1]) * ((t - table->t[k - 1]) / (table->t[k] - table->t[k - 1]));
}

static PetscReal IntegralTo(const Table *table, PetscReal t)
{
  PetscReal sum = table->v[0] * PetscMin(t, table->t[0]);

  for (PetscInt k = 1; k < table->n && table->t[k - 1] < t; k++) {
    const PetscReal end = PetscMin(t, table->t[k]);

    sum += 0.5 * (table->v[k - 1] + ValueAt(table, end)) * (end - table->t[k - 1]);
  }
  if (t > table->t[table->n - 1]) sum += table->v[table->n - 1] * (t - table->t[table->n - 1]);
  return sum;
}

static PetscReal SlopeAt(const Table *table, PetscReal t)
{
  for (PetscInt k = 1; k < table->n; k++)
    if (t >= table->t[k - 1] && t < table->t[k]) return (table->v[k] - table->v[k - 1]) / (table->t[k] - table->t[k - 1]);
  return 0;
}

PetscReal TableValue(const Table *table, PetscReal t)
{
  return ValueAt(table, TableClockTime(table->clock, t));
}

PetscReal TableRate(const Table *table, PetscReal t)
{
  return TableValue(table, t) * TableClockPace(table->clock, t);
}

PetscReal TableIntegral(const Table *table, PetscReal t)
{
  return IntegralTo(table, TableClockTime(table->clock, t));
}

PetscReal TableSlope(const Table *table, PetscReal t)
{
  return SlopeAt(table, TableClockTime(table->clock, t)) * TableClockPace(table->clock, t);
}
