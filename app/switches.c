/* switches.c - switches.csv: when elements turned into particles, one event a row, and what it did to the energy. */
#include "app.h"
#include "files.h"

PetscErrorCode AppSwitchesWrite(AppCase *c, const char *directory, AppEnd *end)
{
  FILE                *out;
  CouplingSwitchReport r;
  char                 path[PETSC_MAX_PATH_LEN];
  static const char   *by[] = {"element", "bond", "tool"};

  PetscFunctionBegin;
  if (c->rank || !c->turning) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CouplingSwitchGetReport(c->turning, &r));
  PetscCall(BaseFormat(path, "%s/switches.csv", directory));
  PetscCall(FileCreate(path, &out));
  fprintf(out, "time[s],elements,particles,criterion[-],asked_by,above_strength");
  for (int k = 0; k < LEDGER_TERMS; k++) fprintf(out, ",%s_before[J],%s_after[J]", LedgerNames[k], LedgerNames[k]);
  fprintf(out, ",booked[J],wall[s]\n");
  for (PetscInt i = 0; i < r.n_events; i++) {
    const CouplingEvent *e = &r.event[i];

    fprintf(out, "%.9g,%d,%d,%.4g,%s,%d", (double)e->time, (int)e->cells, (int)e->particles, (double)e->highest, by[e->asked], (int)e->above);
    for (int k = 0; k < LEDGER_TERMS; k++) fprintf(out, ",%.9g,%.9g", (double)e->before[k], (double)e->after[k]);
    fprintf(out, ",%.9g,%.3g\n", (double)e->booked, (double)e->seconds);
  }
  PetscCall(FileFinish(&out, path));
  if (r.blocked >= 0 && end->n_warnings < 8)
    PetscCall(PetscSNPrintf(end->warning[end->n_warnings++], sizeof(end->warning[0]),
                            "element %d of the geometry reached the threshold, or a tool came near it, at %.6g s and may not turn into particles: it is outside coupling.switch.group, too near to a support, load or history group of the elements, or the last that keeps the overlap from the body's end; the crack cannot grow there, and the tool meets nothing",
                            (int)r.blocked, (double)r.blocked_time));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppSwitchesJson(AppCase *c, Json *json)
{
  CouplingSwitchReport r;
  PetscReal            seconds = 0, above = 0;

  PetscFunctionBegin;
  if (!c->turning) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CouplingSwitchGetReport(c->turning, &r));
  for (PetscInt i = 0; i < r.n_events; i++) {
    seconds += r.event[i].seconds;
    above += (PetscReal)r.event[i].above;
  }
  PetscCall(JsonBeginObject(json, "switch"));
  PetscCall(JsonInt(json, "events", r.n_events));
  PetscCall(JsonInt(json, "elements_turned", r.cells));
  PetscCall(JsonInt(json, "particles_awake", r.particles));
  PetscCall(JsonInt(json, "particles_asleep", r.sleeping));
  PetscCall(JsonReal(json, "booked_J", r.booked));
  PetscCall(JsonInt(json, "bonds_above_strength", (PetscInt64)above));
  PetscCall(JsonReal(json, "bond_steps_of_this_call", r.bond_steps));
  PetscCall(JsonReal(json, "element_steps_of_this_call", r.element_steps));
  PetscCall(JsonReal(json, "looks_of_this_call", r.looks));
  PetscCall(JsonReal(json, "event_seconds", seconds));
  PetscCall(JsonEnd(json));
  PetscFunctionReturn(PETSC_SUCCESS);
}
