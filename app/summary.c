/* summary.c - summary.json: versions, plan, what was constructed, peaks, energies, time by phase, how it ended. */
#include "app.h"
#include "version.h"
#include <H5public.h>
#include <gmshc.h>
#include <petsctime.h>
#include <string.h>

PetscErrorCode AppVersionsJson(Json *json)
{
  char     petsc[256];
  unsigned major, minor, release;

  PetscFunctionBegin;
  PetscCall(PetscGetVersion(petsc, sizeof(petsc)));
  PetscCall(JsonBeginObject(json, "versions"));
  PetscCall(JsonString(json, "cleave", CLEAVE_VERSION));
  PetscCall(JsonString(json, "git", CLEAVE_GIT));
  PetscCall(JsonString(json, "build", CLEAVE_BUILD));
  PetscCall(JsonString(json, "petsc", petsc));
  PetscCall(JsonString(json, "gmsh", GMSH_API_VERSION));
  H5get_libversion(&major, &minor, &release);
  PetscCall(PetscSNPrintf(petsc, sizeof(petsc), "%u.%u.%u", major, minor, release));
  PetscCall(JsonString(json, "hdf5", petsc));
  PetscCall(JsonEnd(json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void AppVersionPrint(FILE *out)
{
  unsigned major, minor, release;

  H5get_libversion(&major, &minor, &release);
  fprintf(out, "cleave %s (git %s, %s)\n", CLEAVE_VERSION, CLEAVE_GIT, CLEAVE_BUILD);
  fprintf(out, "PETSc %d.%d.%d, gmsh %s, HDF5 %u.%u.%u\n", PETSC_VERSION_MAJOR, PETSC_VERSION_MINOR, PETSC_VERSION_SUBMINOR, GMSH_API_VERSION, major, minor, release);
}

/* Calls back for every PETSc class of which something was made; stages added up. PETSc 3.20 closed these tables: nothing is counted there. */
static PetscErrorCode EachClass(PetscErrorCode (*call)(const char *name, int made, void *ctx), void *ctx)
{
#if PETSC_VERSION_LT(3, 20, 0)
  PetscStageLog log;

  PetscFunctionBegin;
  PetscCall(PetscLogGetStageLog(&log));
  if (!log) PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < log->classLog->numClasses; k++) {
    int made = 0;

    for (int s = 0; s < log->numStages; s++)
      if (k < log->stageInfo[s].classLog->numClasses) made += log->stageInfo[s].classLog->classInfo[k].creations;
    if (made && strcmp(log->classLog->classInfo[k].name, "Viewer")) PetscCall(call(log->classLog->classInfo[k].name, made, ctx));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
#else
  return PETSC_SUCCESS;
#endif
}

static PetscErrorCode ClassJson(const char *name, int made, void *json)
{
  return JsonInt((Json *)json, name, made);
}

static PetscErrorCode ClassPrint(const char *name, int made, void *out)
{
  fprintf((FILE *)out, ", %d %s", made, name);
  return PETSC_SUCCESS;
}

/* How often PETSC has factorised a matrix so far, from its own log. */
static PetscErrorCode Factorisations(PetscInt *count)
{
  static const char *const names[] = {"MatCholFctrNum", "MatLUFactorNum"};

  PetscFunctionBegin;
  *count = 0;
  for (int k = 0; k < 2; k++) {
    PetscLogEvent      event;
    PetscEventPerfInfo info;

    PetscCall(PetscLogEventGetId(names[k], &event));
    if (event < 0) continue;
    PetscCall(PetscLogEventGetPerfInfo(PETSC_DETERMINE, event, &info));
    *count += info.count;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppCountsJson(AppCase *c, Json *json)
{
  FemReadings readings = {0};
  PetscInt    factorisations;

  PetscFunctionBegin;
  PetscCall(Factorisations(&factorisations));
  if (c->fem) PetscCall(FemModelGetReadings(c->fem, &readings));
  PetscCall(JsonBeginObject(json, "constructed"));
  PetscCall(JsonInt(json, "FemModel", c->made_fem));
  PetscCall(JsonInt(json, "DemModel", c->made_dem));
  PetscCall(JsonInt(json, "CouplingModel", c->made_couplings));
  PetscCall(JsonInt(json, "DemBody", c->made_bodies));
  PetscCall(JsonInt(json, "DemPacking", c->made_packings));
  PetscCall(JsonInt(json, "DemCells", c->made_cells));
  PetscCall(JsonInt(json, "StressRecoveries", readings.recoveries));
  PetscCall(JsonInt(json, "StressPatches", readings.patches));
  PetscCall(JsonInt(json, "factorisations", factorisations));
  PetscCall(JsonBeginObject(json, "petsc"));
  PetscCall(EachClass(ClassJson, json));
  PetscCall(JsonEnd(json));
  PetscCall(JsonEnd(json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppCountsPrint(AppCase *c, FILE *out)
{
  PetscFunctionBegin;
  if (c->rank) PetscFunctionReturn(PETSC_SUCCESS);
  fprintf(out, "  made      %d FemModel, %d DemModel, %d DemPacking, %d DemCells", (int)c->made_fem, (int)c->made_dem, (int)c->made_packings, (int)c->made_cells);
  PetscCall(EachClass(ClassPrint, out));
  fputc('\n', out);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the search of contacts looked at: an intact body's interior never. */
static PetscErrorCode ContactJson(DemContactCounts n, Json *json)
{
  PetscFunctionBegin;
  if (!n.searches) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(JsonBeginObject(json, "counts"));
  PetscCall(JsonInt(json, "contact_searches", n.searches));
  PetscCall(JsonInt(json, "contact_particles_searched", n.searched));
  PetscCall(JsonInt(json, "contact_pairs", n.pairs));
  PetscCall(JsonInt(json, "contacts_touching", n.touching));
  PetscCall(JsonInt(json, "particles_left_box", n.left));
  PetscCall(JsonReal(json, "deepest_overlap_of_radius", n.deepest));
  PetscCall(JsonEnd(json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How often a body of particles was shared out among the ranks anew. */
static PetscErrorCode SharingJson(DemModel dem, Json *json)
{
  DemSharing s;

  PetscFunctionBegin;
  PetscCall(DemModelGetSharing(dem, NULL, &s));
  if (!s.looks) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(JsonBeginObject(json, "sharing"));
  PetscCall(JsonInt(json, "looks", s.looks)); /* of this call, as all here */
  PetscCall(JsonInt(json, "shared_out_anew", s.times));
  if (s.times) {
    PetscCall(JsonReal(json, "busiest_over_mean_before", s.before));
    PetscCall(JsonReal(json, "busiest_over_mean_after", s.after));
  }
  PetscCall(JsonEnd(json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RunJson(AppCase *c, const RunSummary *run, Json *json)
{
  PetscFunctionBegin;
  PetscCall(JsonBeginObject(json, "run"));
  PetscCall(JsonInt(json, "steps", run->steps));
  PetscCall(JsonInt(json, "steps_of_this_call", run->steps_here));
  PetscCall(JsonReal(json, "time_s", run->time));
  PetscCall(JsonReal(json, "step_s", run->dt));
  PetscCall(JsonReal(json, "stable_step_s", run->stable_dt));
  PetscCall(JsonBool(json, "quiet_state", run->end == RUN_QUIET_STATE ? PETSC_TRUE : PETSC_FALSE));
  if (run->seconds_step > 0 && run->steps_here) PetscCall(JsonReal(json, "element_steps_per_second", c->stepper.elements * run->steps_here / run->seconds_step));
  PetscCall(JsonEnd(json));

  PetscCall(JsonBeginObject(json, "energy"));
  for (int term = 0; term < LEDGER_TERMS; term++) {
    char key[64];

    PetscCall(PetscSNPrintf(key, sizeof(key), "%s_J", LedgerNames[term]));
    PetscCall(JsonReal(json, key, run->ledger.energy[term]));
  }
  PetscCall(JsonReal(json, "initial_J", run->ledger.initial));
  PetscCall(JsonReal(json, "work_in_J", run->ledger.work_in));
  PetscCall(JsonReal(json, "error", LedgerError(&run->ledger)));
  PetscCall(JsonReal(json, "worst_error", run->worst_ledger_error));
  PetscCall(JsonEnd(json));

  if (c->coupling) {
    FemFarReport far;

    PetscCall(CouplingModelGetFar(c->coupling, &far));
    if (c->is_static) {
      CouplingReport report;

      PetscCall(CouplingModelGetReport(c->coupling, &report));
      PetscCall(JsonBeginObject(json, "far_field"));
      PetscCall(JsonInt(json, "iterations", report.iterations)); /* of this call */
      PetscCall(JsonInt(json, "solves", far.solves));
      PetscCall(JsonEnd(json));
    } else if (far.steps) { /* implicit */
      PetscCall(JsonBeginObject(json, "far_field"));
      PetscCall(JsonReal(json, "taken_at_face_J", far.taken));
      PetscCall(JsonReal(json, "copies_apart_m", far.apart));
      PetscCall(JsonEnd(json));
    }
  }
  if (c->fem) {
    FemReadings readings;

    if (c->method == APP_FEM && c->time != APP_MODAL) {
      PetscCall(JsonBeginObject(json, "balance"));
      PetscCall(JsonReal(json, "force_N", c->balance[0]));
      PetscCall(JsonReal(json, "moment_Nm", c->balance[1]));
      PetscCall(JsonEnd(json));
    }

    PetscCall(FemModelGetReadings(c->fem, &readings));
    if (readings.error_known) {
      PetscCall(JsonBeginObject(json, "element_error"));
      PetscCall(JsonReal(json, "share", readings.error_share));
      PetscCall(JsonReal(json, "energy_norm_sqrtJ", readings.error_norm));
      PetscCall(JsonEnd(json));
    }
  }
  PetscCall(JsonBeginObject(json, "peaks"));
  for (PetscInt k = 0; run->lowest && k < PetscMin(run->n_history, c->stepper.n_history); k++) {
    char key[256];

    PetscCall(PetscSNPrintf(key, sizeof(key), "%s[%s]", c->stepper.history_name[k], c->stepper.history_unit[k]));
    PetscCall(JsonBeginObject(json, key));
    PetscCall(JsonReal(json, "lowest", run->lowest[k]));
    PetscCall(JsonReal(json, "highest", run->highest[k]));
    PetscCall(JsonEnd(json));
  }
  PetscCall(JsonEnd(json));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* run is NULL before the loop has begun. Rank 0 writes. */
PetscErrorCode AppSummaryWrite(AppCase *c, const AppPlan *plan, const RunSummary *run, const AppEnd *end, const char *directory)
{
  char           path[PETSC_MAX_PATH_LEN];
  const char    *title;
  Json           json;
  PetscLogDouble bytes;
  DemContactCounts contacts = {0};

  PetscFunctionBegin;
  if (c->dem) PetscCall(DemModelGetContactCounts(c->dem, &contacts));
  if (c->rank) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BaseFormat(path, "%s/summary.json", directory));
  PetscCall(JsonOpen(path, &json));
  PetscCall(SceneGetString(c->scene, "title", &title));
  PetscCall(JsonString(&json, "title", title));
  PetscCall(JsonString(&json, "state", end->state));
  PetscCall(JsonInt(&json, "exit_code", end->exit_code));
  if (end->message[0]) PetscCall(JsonString(&json, "message", end->message));
  PetscCall(AppVersionsJson(&json));
  PetscCall(AppPlanJson(c, plan, &json));
  PetscCall(AppCountsJson(c, &json));
  if (c->dem) PetscCall(ContactJson(contacts, &json));
  if (c->dem) PetscCall(SharingJson(c->dem, &json));
  if (run) PetscCall(RunJson(c, run, &json));
  if (run) PetscCall(AppSwitchesJson(c, &json));
  if (c->n_modes) {
    PetscCall(JsonBeginArray(&json, "frequencies_Hz"));
    for (PetscInt k = 0; k < c->n_modes; k++) PetscCall(JsonReal(&json, NULL, c->frequency[k]));
    PetscCall(JsonEnd(&json));
  }

  PetscCall(JsonBeginObject(&json, "seconds"));
  for (PetscInt k = 0; k < c->clock.n; k++) PetscCall(JsonReal(&json, c->clock.name[k], c->clock.seconds[k]));
  PetscCall(JsonEnd(&json));
  PetscCall(PetscMemoryGetCurrentUsage(&bytes));
  PetscCall(JsonReal(&json, "memory_bytes", bytes));
  PetscCall(JsonBeginArray(&json, "warnings"));
  for (PetscInt k = 0; k < end->n_warnings; k++) PetscCall(JsonString(&json, NULL, end->warning[k]));
  PetscCall(JsonEnd(&json));
  PetscCall(JsonClose(&json));
  PetscFunctionReturn(PETSC_SUCCESS);
}
