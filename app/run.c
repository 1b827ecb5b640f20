/* run.c - `cleave run` and `cleave check`. */
#include "app.h"
#include <petsctime.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { APP_PLOTS = 64 };

PetscErrorCode AppOutputDirectory(const AppOptions *options, size_t size, char directory[])
{
  char  full[PETSC_MAX_PATH_LEN], *slash, *dot;
  const char *scene = options->word[0];

  PetscFunctionBegin;
  if (options->output) {
    PetscCall(PetscStrncpy(directory, options->output, size));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!realpath(scene, full)) PetscCall(PetscStrncpy(full, scene, sizeof(full)));
  slash = strrchr(full, '/');
  if (slash && !strcmp(slash + 1, "scene.yaml")) {
    *slash = 0; /* the folder's name */
    slash  = strrchr(full, '/');
  } else if ((dot = strrchr(slash ? slash : full, '.'))) *dot = 0;
  PetscCall(PetscSNPrintf(directory, size, "results/%s", slash && slash[1] ? slash + 1 : slash ? "scene" : full));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppRunOptions(AppCase *c, const AppOptions *options, const AppPlan *plan, RunOptions *run)
{
  PetscReal given = 0;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(run, sizeof(*run)));
  PetscCall(SceneGetReal(c->scene, "time.end", &run->end));
  if (!c->is_static) PetscCall(SceneGetReal(c->scene, "time.step", &given));
  run->safety       = 1;
  if (!c->is_static && !(run->end / plan->dt < PETSC_MAX_INT - 1))
    PetscCall(SceneFail(c->scene, "time.end", "%.6g s in steps of %.6g s are %.6g steps, more than this build can count (%" PetscInt_FMT ")", (double)run->end, (double)plan->dt, (double)(run->end / plan->dt), PETSC_MAX_INT));
  run->step         = given > 0 || c->is_static ? plan->dt : 0; /* 0: the loop takes safety x stable, as the plan says */
  run->ledger_bound = 0.05;
  if (c->time == APP_EXPLICIT) PetscCall(SceneGetReal(c->scene, "time.safety", &run->safety));
  if (!c->is_static) {
    PetscCall(SceneGetReal(c->scene, "time.stop_unbalanced", &run->unbalanced_stop));
  }
  PetscCall(SceneGetReal(c->scene, "output.history.every", &run->history_every));
  PetscCall(SceneGetReal(c->scene, "output.fields.every", &run->frame_every));
  PetscCall(SceneGetReal(c->scene, "output.checkpoint.every", &run->checkpoint_every));
  run->max_steps = options->stop_after;
  run->stop_at   = options->stop_at;
  run->new_loads = options->new_loads;
  run->resume    = options->resume;
  run->quiet     = options->quiet;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppFieldNames(AppCase *c, Output output)
{
  const char *names[64];
  PetscInt    n;

  PetscFunctionBegin;
  PetscCall(SceneGetSize(c->scene, "output.fields.names", &n));
  n = PetscMin(n, 64);
  for (PetscInt k = 0; k < n; k++) PetscCall(SceneGetEntry(c->scene, "output.fields.names", k, &names[k]));
  PetscCall(OutputSetFieldNames(output, n, names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Scales, labels and overlay of plot k, appended to its JSON. */
static PetscErrorCode PlotExtras(AppCase *c, PetscInt k, char word[BASE_LINE])
{
  static const char *const numbers[] = {"xscale", "yscale"}, *const texts[] = {"xlabel", "ylabel", "overlay"};
  char                     path[64], more[BASE_LINE], file[PETSC_MAX_PATH_LEN];
  const char              *text;
  PetscReal                value;
  PetscBool                has;

  PetscFunctionBegin;
  for (int i = 0; i < 2; i++) {
    PetscCall(BaseFormat(path, "output.plots[%" PetscInt_FMT "].%s", k, numbers[i]));
    PetscCall(SceneGetReal(c->scene, path, &value));
    PetscCall(BaseFormat(more, ", \"%s\": %.17g", numbers[i], (double)value));
    PetscCall(PetscStrlcat(word, more, BASE_LINE));
  }
  for (int i = 0; i < 3; i++) {
    PetscCall(BaseFormat(path, "output.plots[%" PetscInt_FMT "].%s", k, texts[i]));
    PetscCall(SceneHas(c->scene, path, &has));
    if (!has) continue;
    PetscCall(SceneGetString(c->scene, path, &text));
    if (i == 2) {
      PetscCall(SceneFilePath(c->scene, text, sizeof(file), file));
      text = file;
    }
    PetscCall(BaseFormat(more, ", \"%s\": \"%s\"", texts[i], text));
    PetscCall(PetscStrlcat(word, more, BASE_LINE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene's plots as plot.py takes them, one JSON object each. Names of columns hold neither quote nor backslash. */
static PetscErrorCode PlotWords(AppCase *c, PetscInt *n, char *word[APP_PLOTS])
{
  PetscBool has;

  PetscFunctionBegin;
  *n = 0;
  PetscCall(SceneHas(c->scene, "output.plots", &has));
  if (has) PetscCall(SceneGetSize(c->scene, "output.plots", n));
  *n = PetscMin(*n, APP_PLOTS);
  for (PetscInt k = 0; k < *n; k++) {
    const char *x, *y, *out;
    char        path[64], file[256];

    PetscCall(BaseFormat(path, "output.plots[%" PetscInt_FMT "].x", k));
    PetscCall(SceneGetString(c->scene, path, &x));
    PetscCall(BaseFormat(path, "output.plots[%" PetscInt_FMT "].y", k));
    PetscCall(SceneGetString(c->scene, path, &y));
    PetscCall(BaseFormat(path, "output.plots[%" PetscInt_FMT "].file", k));
    PetscCall(SceneHas(c->scene, path, &has));
    if (has) {
      PetscCall(SceneGetString(c->scene, path, &out));
      PetscCall(PetscStrncpy(file, out, sizeof(file)));
    } else {
      PetscCall(BaseFormat(file, "%s-%s.png", y, x));
      for (char *s = file; *s; s++)
        if (strchr(" ()/\\\"", *s)) *s = '_';
    }
    PetscCall(PetscMalloc1(BASE_LINE, &word[k]));
    PetscCall(PetscSNPrintf(word[k], BASE_LINE, "{\"kind\": \"history\", \"out\": \"%s\", \"x\": \"%s\", \"y\": [\"%s\"]", file, x, y));
    PetscCall(PlotExtras(c, k, word[k]));
    PetscCall(PetscStrlcat(word[k], "}", BASE_LINE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppPlots(AppCase *c, const char *directory, PetscBool quiet, AppEnd *end)
{
  PetscBool ran = PETSC_FALSE;
  PetscInt  n;
  char     *word[APP_PLOTS];

  PetscFunctionBegin;
  if (c->rank) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AppClockBegin(&c->clock, "plots"));
  PetscCall(PlotWords(c, &n, word));
  if (n > 0 && n < APP_PLOTS) { /* with the plots asked for, a picture of every block of the last frame */
    PetscCall(PetscMalloc1(BASE_LINE, &word[n]));
    PetscCall(PetscStrncpy(word[n++], "{\"kind\": \"last\"}", BASE_LINE));
  }
  PetscCall(AppPython("base/plot.py", directory, n, (const char *const *)word, quiet, &ran));
  for (PetscInt k = 0; k < n; k++) PetscCall(PetscFree(word[k]));
  if (!ran) PetscCall(PetscStrncpy(end->warning[end->n_warnings++], "plots are missing: see the messages of base/plot.py", sizeof(end->warning[0])));
  PetscCall(AppClockEnd(&c->clock));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A run without steps: what to write is known at once. */
static PetscErrorCode RunModes(AppCase *c, const AppOptions *options, const AppPlan *plan, int *exit_code)
{
  AppEnd end = {.state = "done"};
  Output output;
  char   directory[PETSC_MAX_PATH_LEN], path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  BaseCheckInput(!options->resume, c->comm, "A modal run has no steps to resume; run it without --resume");
  PetscCall(AppOutputDirectory(options, sizeof(directory), directory));
  PetscCall(OutputCreate(c->comm, directory, PETSC_FALSE, &output));
  PetscCall(AppFieldNames(c, output));
  PetscCall(BaseFormat(path, "%s/resolved.yaml", directory));
  PetscCall(SceneWriteResolved(c->scene, path));
  PetscCall(AppModal(c, output, directory, options->quiet));
  PetscCall(OutputDestroy(&output));
  if (!options->no_plots && !c->rank) { /* a picture of the last mode */
    static const char *const last = "{\"kind\": \"last\"}";
    PetscBool                ran;

    PetscCall(AppPython("base/plot.py", directory, 1, &last, options->quiet, &ran));
    if (!ran) PetscCall(PetscStrncpy(end.warning[end.n_warnings++], "the picture is missing: see the messages of base/plot.py", sizeof(end.warning[0])));
  }
  PetscCall(AppSummaryWrite(c, plan, NULL, &end, directory));
  if (!options->quiet && !c->rank) printf("%s: results in %s\n", end.state, directory);
  *exit_code = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  AppCase          *c;
  const AppOptions *options;
  const char       *directory;
} AppGoesOn;

/* The checkpoint is this scene's and the run goes on: say what it does otherwise from here on, and keep it. */
static PetscErrorCode GoesOn(void *ctx, const char *changes)
{
  const AppGoesOn *on = ctx;

  PetscFunctionBegin;
  if (!on->options->quiet && !on->c->rank && changes[0]) printf("%s", changes);
  PetscCall(AppResolvedWrite(on->c, on->directory, changes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *EndWord(const AppOptions *options, const RunSummary *run, int *exit_code)
{
  *exit_code = 0;
  if (run->end != RUN_INTERRUPTED) return "done";
  if (options->stop_after && run->steps_here >= options->stop_after) return "stopped";
  *exit_code = 130;
  return "interrupted";
}

/* The warning just written into its place in `end`. */
static void Told(const AppCase *c, AppEnd *end)
{
  if (!c->rank) fprintf(stderr, "warning: %s\n", end->warning[end->n_warnings]);
  end->n_warnings++;
}

/* Elements are of small strain: a large rotation counts as strain.  Eq. (2.85) */
static PetscErrorCode WarnTurn(AppCase *c, AppEnd *end)
{
  const PetscReal most = 5; /* degrees: 1 - cos is 0.4 % */
  PetscReal       turn = 0;

  PetscFunctionBegin;
  if (!c->fem || c->corotational) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FemModelGetTurn(c->fem, &turn));
  turn *= 180 / PETSC_PI;
  if (!(turn > most)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSNPrintf(end->warning[end->n_warnings], sizeof(end->warning[0]), "a finite element turned by %.3g degrees; elements are of small strain, and take %.2g of strain from a turn of that size", (double)turn,
                          (double)(1 - PetscCosReal(turn * PETSC_PI / 180))));
  Told(c, end);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Linear triangles, tetrahedra and prisms near nu = 1/2 are stiffer than their material by any factor. */
static PetscErrorCode WarnOfLocking(AppCase *c, AppEnd *end)
{
  const char *word;
  PetscInt    elements;
  PetscReal   poisson;

  PetscFunctionBegin;
  if (!c->fem) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FemModelGetLocking(c->fem, &elements, &word, &poisson));
  if (!elements) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BaseFormat(end->warning[end->n_warnings], "%d elements (%s) lock at Poisson's ratio %.6g: they are stiffer than the material by far; use mesh.order: 2, or %s", (int)elements, word, (double)poisson,
                       !strcmp(word, "quad4") || !strcmp(word, "hex8") ? "mesh.element: enhanced" : "quadrilaterals or hexahedra, which do not"));
  Told(c, end);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A bond that still holds turns with its particles by about opening / distance.  Eq. (4.22) */
static PetscErrorCode WarnOfSmallCells(AppCase *c, AppEnd *end)
{
  PetscReal opening = 0, distance = 0;

  PetscFunctionBegin;
  if (c->dem) PetscCall(DemModelGetCrackOpening(c->dem, &opening, &distance));
  if (distance >= 2 * opening) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BaseFormat(end->warning[end->n_warnings],
                       "particles are %.3g mm apart, and cracks open by %.3g mm before they let go: bonds may turn right round while they still hold, which stops a run; use particles at least %.3g mm apart, or a smaller fracture energy",
                       (double)(1e3 * distance), (double)(1e3 * opening), (double)(2e3 * opening)));
  Told(c, end);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A test that asked for its quasi-static quality, and was too fast for it. */
static PetscErrorCode WarnOfHaste(AppCase *c, AppEnd *end)
{
  const PetscReal most_unbalanced = 0.1, most_kinetic = 0.05; /* docs/theory.md (4.71) */
  PetscReal       unbalanced = -1, kinetic = -1;

  PetscFunctionBegin;
  if (c->dem) PetscCall(DemModelGetQuality(c->dem, &unbalanced, &kinetic));
  if (unbalanced <= most_unbalanced && kinetic <= most_kinetic) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BaseFormat(end->warning[end->n_warnings],
                       "loaded too fast to be called quasi-static: at the largest strain energy the unbalanced ratio is %.2g (good below %.2g) and kinetic / strain energy %.2g (good below %.2g); load more slowly, or raise local_damping",
                       (double)unbalanced, (double)most_unbalanced, (double)kinetic, (double)most_kinetic));
  Told(c, end);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppRun(const AppOptions *options, int *exit_code)
{
  AppCase        c;
  AppPlan        plan;
  AppEnd         end = {.state = "running"};
  RunOptions     run_options;
  RunSummary     run = {0};
  Output         output;
  PetscInt       threads;
  PetscErrorCode code;
  char           directory[PETSC_MAX_PATH_LEN], path[PETSC_MAX_PATH_LEN], *stamp, *scene;
  AppGoesOn      on = {.c = &c, .options = options, .directory = directory};

  PetscFunctionBegin;
  PetscCall(AppCaseRead(PETSC_COMM_WORLD, options, &c));
  PetscCall(AppThreads(c.comm, options->threads, &threads));
  PetscCall(AppCaseBuild(&c, threads));
  PetscCall(AppPlanFromModels(&c, threads, &plan));
  if (c.time == APP_MODAL) {
    if (!options->quiet) PetscCall(AppPlanPrint(&c, &plan, stdout));
    PetscCall(RunModes(&c, options, &plan, exit_code));
    PetscCall(AppCaseDestroy(&c));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AppStamp(&c, &stamp, &scene));
  PetscCall(AppRunOptions(&c, options, &plan, &run_options));
  if (!options->quiet) PetscCall(AppPlanPrint(&c, &plan, stdout));
  PetscCall(WarnOfSmallCells(&c, &end));
  if (!c.is_static && run_options.step == 0) PetscCall(SceneSetDerived(c.scene, "time.step", plan.dt, plan.sets));
  run_options.stamp      = stamp;
  run_options.scene      = scene;
  run_options.goes_on    = GoesOn;
  run_options.goes_on_to = &on;

  /* Nothing was written so far; a resume that turns out to be another scene's leaves what is there. */
  PetscCall(AppOutputDirectory(options, sizeof(directory), directory));
  PetscCall(BaseFormat(path, "%s/checkpoint.h5", directory));
  BaseCheckInput(!options->resume || !access(path, R_OK), c.comm, "There is no checkpoint '%s' to resume from; run without --resume, or name the directory with --output", path);
  PetscCall(OutputCreate(c.comm, directory, options->resume, &output));
  PetscCall(AppFieldNames(&c, output));
  if (!options->resume) {
    PetscCall(AppResolvedWrite(&c, directory, NULL));
    PetscCall(AppSummaryWrite(&c, &plan, NULL, &end, directory));
  }
  BaseErrorClear();
  code = RunLoop(c.comm, &c.stepper, &run_options, output, &run);
  PetscCall(OutputDestroy(&output));
  if (code == PETSC_ERR_USER_INPUT) PetscFunctionReturn(code); /* said already: no checkpoint, or another scene's */
  AppClockAdd(&c.clock, "stepping", run.seconds_step);
  AppClockAdd(&c.clock, "output", run.seconds_output);
  AppClockAdd(&c.clock, "checkpoint", run.seconds_checkpoint);
  if (code) {
    end.state     = "failed";
    end.exit_code = 1;
    PetscCall(PetscStrncpy(end.message, BaseErrorMessage(), sizeof(end.message)));
  } else end.state = EndWord(options, &run, &end.exit_code);
  PetscCall(AppSidesNow(&c));
  PetscCall(AppCracksWrite(&c, directory));
  if (!code) PetscCall(WarnTurn(&c, &end));
  if (!code) PetscCall(WarnOfLocking(&c, &end));
  if (!code && c.method == APP_FEM && c.time != APP_MODAL) PetscCall(FemModelGetBalance(c.fem, &c.balance[0], &c.balance[1]));
  if (!code) PetscCall(WarnOfHaste(&c, &end));
  PetscCall(AppSwitchesWrite(&c, directory, &end));
  if (!options->no_plots) PetscCall(AppPlots(&c, directory, options->quiet, &end));
  PetscCall(AppSummaryWrite(&c, &plan, &run, &end, directory));
  if (!options->quiet && !c.rank) printf("%s: results in %s\n", end.state, directory);
  *exit_code = end.exit_code;
  PetscCall(PetscFree(stamp));
  PetscCall(PetscFree(scene));
  PetscCall(RunSummaryDestroy(&run));
  PetscCall(AppCaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A step the user gives can only be judged against the model's own frequencies, and steps be timed only with a model; otherwise none is built. */
PetscErrorCode AppCheck(const AppOptions *options, int *exit_code)
{
  AppCase   c;
  AppPlan   plan;
  PetscInt  threads;
  PetscReal given = 0;
  PetscBool build;

  PetscFunctionBegin;
  PetscCall(AppCaseRead(PETSC_COMM_WORLD, options, &c));
  PetscCall(AppThreads(c.comm, options->threads, &threads));
  if (c.time == APP_EXPLICIT) PetscCall(SceneGetReal(c.scene, "time.step", &given));
  build = (PetscBool)(options->measure || (given > 0 && c.time == APP_EXPLICIT));
  if (build) {
    PetscCall(AppCaseBuild(&c, threads));
    PetscCall(AppPlanFromModels(&c, threads, &plan));
  } else PetscCall(AppPlanEstimate(&c, threads, &plan));
  PetscCall(AppPlanPrint(&c, &plan, stdout));
  PetscCall(AppCountsPrint(&c, stdout));
  if (options->measure) PetscCall(AppMeasure(&c, options, &plan, stdout));
  else if (build && !c.rank) printf("  note      time.step is given: the model was built to hold it against the critical step\n");
  if (!c.rank) printf("%s: no faults found\n", options->word[0]);
  *exit_code = 0;
  PetscCall(AppCaseDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
