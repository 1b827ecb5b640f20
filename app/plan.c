/*
  plan.c - what a run is going to do, before it does it.

  `check` estimates from the geometry alone and says so; `run` knows the models. Memory is held against runs by a test
  (tests/app/memory.py). The rates of the time estimate were measured on one core of a 2-core machine with AVX2; they are for orientation: `check --measure`
  (measure.c) times the run itself.
*/
#include "app.h"
#include "files.h"
#include <string.h>

#define SECONDS_BOND_STEP 3e-8  /* [s], one thread */
#define SECONDS_UNKNOWN   1.2e-4  /* [s] of a static solution in 3D; a fifth of it in 2D */
#define SECONDS_ROUND     1.3e-6  /* [s] a bond and round of a crack in load steps, in 2D; 2.5 times that in 3D, where the factor is fuller */
#define ROUNDS_PARTICLE   200     /* of a crack, a particle in the section: teeth go nearly one by one. Bars of 300 particles took 2238 (10 in a section), cut to 0.3 4019; in 3D, 25 in a section, 3859 */
#define SECONDS_LEVELS    2.0e-5  /* [s] of one by two levels */
#define BYTES_START       85e6    /* the program with its libraries */
#define BYTES_PARTICLE    2200. /* bonded */
#define BYTES_BREAKS      1100. /* more where bonds can break */
#define BYTES_NODE        2500.
#define BYTES_FACTOR_NODE 19000. /* a factor in 3D at 5,000 nodes, growing as their cube root; in 2D about half, whatever the size */
#define BYTES_GAMG_NODE   4500.  /* linear elements; quadratic rows are half as long again */
#define BYTES_LEVELS_NODE 1700.  /* two levels, no matrix */

static PetscErrorCode Steps(AppCase *c, AppPlan *plan)
{
  PetscReal end, given = 0;

  PetscFunctionBegin;
  if (c->time == APP_MODAL) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SceneGetReal(c->scene, "time.end", &end));
  if (c->is_static) {
    PetscInt steps;

    PetscCall(SceneGetInt(c->scene, "time.steps", &steps));
    plan->steps = steps;
    plan->dt    = end / steps;
    PetscCall(PetscStrncpy(plan->sets, "time.steps load steps; inertia plays no part", sizeof(plan->sets)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SceneGetReal(c->scene, "time.step", &given)); /* 0: auto */
  if (given > 0) {
    plan->dt = given;
    PetscCall(PetscStrncpy(plan->sets, "time.step of the scene", sizeof(plan->sets)));
  }
  plan->steps = plan->dt > 0 ? PetscCeilReal(end / plan->dt * (1 - 1e-12)) : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal LargestPoisson(const AppCase *c)
{
  PetscReal poisson = -1;

  for (PetscInt p = 0; p < c->n_parts; p++) poisson = PetscMax(poisson, c->part[p].poisson);
  return poisson;
}

/* Load steps that break: facets across the longest axis, tooth by tooth. Which sections break, and how many, the run finds out. */
static PetscErrorCode Breaking(AppCase *c, AppPlan *plan)
{
  PetscReal teeth, across, longest = 0;

  PetscFunctionBegin;
  if (c->method != APP_DEM || !c->is_static || !AppGrains(c)->cohesive) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SceneGetReal(c->scene, "time.teeth", &teeth));
  for (PetscInt d = 0; d < c->dim; d++) longest = PetscMax(longest, c->body.high[d] - c->body.low[d]);
  across         = plan->particles * PetscPowReal(DemBodyVolume(&c->body) / c->thickness / plan->particles, 1. / c->dim) / longest; /* particles in a mean section */
  plan->rounds   = PetscCeilReal(ROUNDS_PARTICLE * across / (0.2 + 0.8 * teeth));
  plan->breaking = plan->rounds * plan->bonds * SECONDS_ROUND * (c->dim == 3 ? 2.5 : 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Seconds(const AppCase *c, AppPlan *plan)
{
  if (c->method == APP_DEM && c->is_static) { /* so many evaluations of all forces as the body is particles across, some times */
    plan->seconds = plan->steps * 8 * PetscPowReal(plan->particles, 1. / c->dim) * plan->bonds * SECONDS_BOND_STEP / plan->threads;
    return;
  }
  if (c->time == APP_STATIC && FemSolverRule(c->dim, c->mesh_order, plan->dofs, LargestPoisson(c), c->size) == FEM_TWO_LEVEL) {
    plan->seconds = plan->dofs * SECONDS_LEVELS * (0.4 + 0.6 * plan->steps) / c->size; /* every step solves anew */
    return;
  }
  if (c->time != APP_EXPLICIT) plan->seconds = plan->dofs * SECONDS_UNKNOWN * (c->dim == 3 ? 1 : 0.2) * (1 + 0.02 * plan->steps) / c->size;
  else if (c->method == APP_FEM) plan->seconds = plan->steps * c->mesh_cost / plan->threads / c->size;
  else if (c->method == APP_COUPLED || c->method == APP_TOUCH) plan->seconds = plan->steps * (c->mesh_cost + plan->substeps * plan->bonds * SECONDS_BOND_STEP) / plan->threads;
  else plan->seconds = plan->steps * plan->bonds * SECONDS_BOND_STEP / plan->threads;
}

/* Particles from the wanted radius: the sphere's share of its cell is 1 - porosity, about 0.74 (2D: 0.86). */
static PetscErrorCode EstimateBody(AppCase *c, const DemBody *body, AppPlan *plan)
{
  char            path[256];
  PetscBool       has;
  PetscInt        count;
  PetscReal       radius, spread, filling = c->dim == 3 ? 0.74 : 0.86;
  const PetscReal volume = DemBodyVolume(body);

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing.count", AppGrains(c)->name));
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscCall(SceneGetInt(c->scene, path, &count));
    plan->particles = count;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.rain", AppGrains(c)->name));
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscReal rate, until;

    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.rain.rate", AppGrains(c)->name));
    PetscCall(SceneGetReal(c->scene, path, &rate));
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.rain.until", AppGrains(c)->name));
    PetscCall(SceneGetReal(c->scene, path, &until));
    plan->particles = PetscMax(1, PetscFloorReal(rate * until));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing.radius", AppGrains(c)->name));
  PetscCall(SceneHas(c->scene, path, &has));
  if (has) {
    PetscCall(SceneGetReal(c->scene, path, &radius));
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing.spread", AppGrains(c)->name));
    PetscCall(SceneGetReal(c->scene, path, &spread));
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing.porosity", AppGrains(c)->name));
    PetscCall(SceneHas(c->scene, path, &has));
    if (has) {
      PetscReal porosity;

      PetscCall(SceneGetReal(c->scene, path, &porosity));
      filling = 1 - porosity;
    }
    if (c->dim == 3) plan->particles = filling * volume / (4. / 3 * PETSC_PI * PetscPowReal(radius, 3) * (1 + spread * spread));
    else plan->particles = filling * volume / c->thickness / (PETSC_PI * radius * radius * (1 + spread * spread / 3));
  } else { /* a file of the user's, one line a particle */
    const char *name;
    char        file[PETSC_MAX_PATH_LEN], line[BASE_LINE];
    FILE       *in;

    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.packing.file", AppGrains(c)->name));
    PetscCall(SceneGetString(c->scene, path, &name));
    PetscCall(SceneFilePath(c->scene, name, sizeof(file), file));
    in = FileUnfit(file) ? NULL : fopen(file, "r");
    if (!in) PetscCall(SceneFail(c->scene, path, "cannot read '%s'", file));
    while (fgets(line, sizeof(line), in)) plan->particles += line[0] != '#' && line[0] != '\n';
    fclose(in);
  }
  plan->particles = PetscMax(1, PetscFloorReal(plan->particles));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of all bodies of particles; a clump counts its spheres. */
static PetscErrorCode EstimateParticles(AppCase *c, AppPlan *plan)
{
  PetscReal all = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < (c->grain_body ? c->n_parts : 1); k++) {
    char      path[256];
    PetscBool has;
    PetscInt  spheres = 1;

    c->grain        = k;
    plan->particles = 0;
    PetscCall(EstimateBody(c, c->grain_body ? &c->grain_body[k] : &c->body, plan));
    PetscCall(PetscSNPrintf(path, sizeof(path), "bodies.%s.dem.clump.spheres", AppGrains(c)->name));
    PetscCall(SceneHas(c->scene, path, &has));
    if (has) PetscCall(SceneGetSize(c->scene, path, &spheres));
    all += plan->particles * (PetscReal)spheres;
  }
  c->grain        = 0;
  plan->particles = all;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest resident memory of a run's finite elements; tests/app/memory.py holds it against runs. */
static PetscReal FemBytes(const AppCase *c, PetscReal nodes)
{
  const PetscInt order = c->time == APP_STATIC ? c->mesh_order : 1;
  FemSolver      solver;

  if (c->time == APP_EXPLICIT && (!c->preload || c->method == APP_COUPLED)) return nodes * BYTES_NODE;
  solver = FemSolverRule(c->dim, order, nodes * c->dim, LargestPoisson(c), c->size);
  if (solver == FEM_TWO_LEVEL) return nodes * BYTES_LEVELS_NODE;
  if (solver == FEM_MULTIGRID) return nodes * BYTES_GAMG_NODE * (c->mesh_order == 2 ? 1.5 : 1);
  return nodes * BYTES_FACTOR_NODE * (c->dim == 3 ? PetscPowReal(nodes / 5000, 1. / 3) : 0.5);
}

PetscErrorCode AppPlanEstimate(AppCase *c, PetscInt threads, AppPlan *plan)
{
  PetscReal safety = 1, stable = 0;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(plan, sizeof(*plan)));
  plan->threads  = threads;
  plan->substeps = 1;
  if (c->time == APP_EXPLICIT) PetscCall(SceneGetReal(c->scene, "time.safety", &safety));
  if (c->method != APP_DEM) {
    plan->nodes    = c->mesh_nodes;
    plan->elements = c->mesh_cells;
    plan->dofs     = (PetscReal)c->dim * c->mesh_nodes;
    plan->bytes    = BYTES_START + FemBytes(c, plan->nodes);
    stable         = 0.6 * c->mesh_step;
    PetscCall(PetscStrncpy(plan->sets, "estimate: shortest edge / P-wave speed; the run bounds the eigenvalues of the elements", sizeof(plan->sets)));
  }
  if (c->method != APP_FEM) {
    const AppPart  *part = AppGrains(c);
    const PetscReal cp   = PetscSqrtReal(part->young * (1 - part->poisson) / (part->density * (1 + part->poisson) * PetscMax(1 - 2 * part->poisson, 1e-6)));
    PetscReal       s;

    PetscCall(EstimateParticles(c, plan));
    plan->bonds = plan->particles * (c->dim == 3 ? 7.6 : 3);
    plan->bytes = PetscMax(plan->bytes, BYTES_START) + plan->particles * (BYTES_PARTICLE + (part->cohesive ? BYTES_BREAKS : 0));
    s           = PetscPowReal(DemBodyVolume(&c->body) / c->thickness / plan->particles, 1. / c->dim);
    s           = (c->method == APP_COUPLED ? 0.75 : 0.87) * 0.53 * s / cp; /* an overlap takes sqrt(3)/2 */
    stable      = c->method == APP_TOUCH ? 0.6 * PetscMin(stable, s) : s;    /* contacts take some of either */
    PetscCall(PetscStrncpy(plan->sets, "estimate: mean cell size / P-wave speed; the run bounds the stiffness of every particle", sizeof(plan->sets)));
  }
  plan->dt = safety * stable;
  PetscCall(Steps(c, plan));
  Seconds(c, plan);
  PetscCall(Breaking(c, plan));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppPlanFromModels(AppCase *c, PetscInt threads, AppPlan *plan)
{
  PetscReal      safety = 1, stable = 0, given = 0;
  PetscBool      beyond;
  PetscInt       a = 0, b = 0, w = 0;
  PetscLogDouble bytes;

  PetscFunctionBegin;
  PetscCall(AppClockBegin(&c->clock, "critical step"));
  PetscCall(PetscMemzero(plan, sizeof(*plan)));
  plan->built    = PETSC_TRUE;
  plan->threads  = threads;
  plan->substeps = 1;
  if (c->coupling) {
    CouplingReport r;

    PetscCall(CouplingModelGetReport(c->coupling, &r));
    plan->substeps = r.substeps;
  }
  if (c->method != APP_DEM) {
    PetscCall(FemModelGetCounts(c->fem, &a, &b, &w));
    plan->nodes    = a;
    plan->elements = b;
    plan->dofs     = w;
  }
  if (c->method != APP_FEM) {
    PetscCall(DemModelGetCounts(c->dem, &a, &b, &w));
    plan->particles = a;
    plan->bonds     = b;
    plan->walls     = w;
  }
  if (c->time == APP_EXPLICIT) {
    PetscCall(SceneGetReal(c->scene, "time.safety", &safety));
    PetscCall(SceneGetReal(c->scene, "time.step", &given));
    PetscCall(c->stepper.stable_step(c->stepper.ctx, &stable)); /* the loop's own */
    if (c->turning) PetscCall(CouplingSwitchGetCriticalStep(c->turning, &plan->critical));
    else if (c->method == APP_COUPLED) PetscCall(CouplingModelGetCriticalStep(c->coupling, &plan->critical));
    else if (c->method == APP_TOUCH) plan->critical = stable;
    else if (c->method == APP_FEM) PetscCall(FemModelGetCriticalStep(c->fem, &plan->critical));
    else PetscCall(DemModelGetCriticalStep(c->dem, &plan->critical));
    PetscCall(PetscSNPrintf(plan->sets, sizeof(plan->sets), "%g x %s", (double)safety,
                            c->method == APP_TOUCH ? "the bound from both bodies and their contacts" : stable == plan->critical ? "the critical step" : c->method == APP_COUPLED ? "the overlap's limit" : c->method == APP_FEM ? "the bound from the stiffest element" : "the bound from the stiffest particle"));
    plan->dt = safety * stable;
    PetscCall(SceneGetBool(c->scene, "time.beyond_critical", &beyond));
    if (given > plan->critical && !beyond)
      PetscCall(SceneFail(c->scene, "time.step", "a step of %g s exceeds the critical step %.4g s, which the highest frequency of the %s sets (2/omega_max); use at most %.3g s, or auto", (double)given, (double)plan->critical,
                          c->method == APP_FEM ? "mesh" : c->method == APP_TOUCH ? "two bodies with their contacts" : "bonded particles", (double)(0.9 * plan->critical)));
  }
  PetscCall(Steps(c, plan));
  Seconds(c, plan);
  PetscCall(Breaking(c, plan));
  PetscCall(PetscMemoryGetCurrentUsage(&bytes));
  plan->bytes = bytes;
  PetscCall(AppClockEnd(&c->clock));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 3.2 ms rather than 0.0032 s */
static void Time(FILE *out, PetscReal t)
{
  if (t == 0 || t >= 1) fprintf(out, "%.4g s", (double)t);
  else if (t >= 1e-3) fprintf(out, "%.4g ms", (double)(t * 1e3));
  else if (t >= 1e-6) fprintf(out, "%.4g us", (double)(t * 1e6));
  else fprintf(out, "%.4g ns", (double)(t * 1e9));
}

static void Expected(FILE *out, PetscReal s)
{
  if (s < 1) fprintf(out, "under a second");
  else if (s < 90) fprintf(out, "about %.0f s", (double)s);
  else if (s < 5400) fprintf(out, "about %.0f minutes", (double)(s / 60));
  else fprintf(out, "about %.1f hours", (double)(s / 3600));
}

/* "implicit (average acceleration, consistent mass), from the static state" */
static PetscErrorCode TimeWords(AppCase *c, size_t size, char words[])
{
  static const char *const times[] = {"explicit", "static", "implicit", "modal"}; /* AppTime */
  const char              *mass;
  char                     more[160];
  PetscReal                rho;
  PetscBool                has = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(words, times[c->time], size));
  if (c->time == APP_IMPLICIT || c->time == APP_MODAL) {
    PetscCall(SceneGetString(c->scene, "time.mass", &mass));
    if (c->time == APP_IMPLICIT) PetscCall(SceneHas(c->scene, "time.rho_inf", &has));
    if (has) {
      PetscCall(SceneGetReal(c->scene, "time.rho_inf", &rho));
      PetscCall(BaseFormat(more, " (generalised-alpha, rho_inf %.4g, %s mass)", (double)rho, mass));
    } else PetscCall(BaseFormat(more, c->time == APP_MODAL ? " (%s mass)" : " (average acceleration, %s mass)", mass));
    PetscCall(PetscStrlcat(words, more, size));
  }
  if (c->preload) PetscCall(PetscStrlcat(words, ", from the static state", size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How systems are solved, and how often K is factorised; empty when nothing is solved. */
static PetscErrorCode SolverWords(AppCase *c, PetscReal dofs, size_t size, char words[])
{
  PetscReal poisson = -1;
  PetscInt  times   = (c->preload && c->method != APP_COUPLED) + (c->time != APP_EXPLICIT), planes = 0;
  char      name[128], ending[64];

  PetscFunctionBegin;
  words[0] = 0;
  if (!times) PetscFunctionReturn(PETSC_SUCCESS);
  if (c->method == APP_DEM) {
    PetscCall(PetscStrncpy(words, "Newton, conjugate gradients on the bonds' own forces, no matrix", size));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt p = 0; p < c->n_parts; p++) poisson = PetscMax(poisson, c->part[p].poisson);
  for (PetscInt k = 0; k < c->n_loads; k++) planes += c->load[k].kind == APP_PLANE; /* they want a matrix */
  if (c->time == APP_MODAL) PetscCall(BaseFormat(name, "Cholesky (%s)", c->size == 1 ? "CHOLMOD" : "MUMPS"));
  else PetscCall(FemSolverWords(c->dim, c->time == APP_STATIC && !planes ? c->mesh_order : 1, dofs, poisson, c->size, sizeof(name), name));
  if (!strncmp(name, "Cholesky", 8)) PetscCall(BaseFormat(ending, ", %d factorisation%s%s", (int)times, times > 1 ? "s" : "", c->time == APP_EXPLICIT ? " before the first step" : c->time == APP_MODAL ? "" : " for all steps"));
  else PetscCall(BaseFormat(ending, ", set up %s", times > 1 ? "twice" : "once"));
  PetscCall(PetscSNPrintf(words, size, "%s%s", name, ending));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How the elements outside the overlap step, and why. */
static PetscErrorCode FarWords(AppCase *c, size_t size, char words[])
{
  CouplingReport r;
  FemFarReport   far;
  const char    *asked;

  PetscFunctionBegin;
  PetscCall(SceneGetString(c->scene, "coupling.far_field", &asked));
  PetscCall(CouplingModelGetReport(c->coupling, &r));
  PetscCall(CouplingModelGetFar(c->coupling, &far));
  if (c->is_static) {
    char entries[64] = "a solver without a factor";

    if (r.factor < PETSC_MAX_REAL) PetscCall(PetscSNPrintf(entries, sizeof(entries), "%.3g of its factor", (double)r.factor));
    PetscCall(PetscSNPrintf(words, size, r.dense ? "static, condensed to %d unknowns of its face: %.3g products in each iteration beside %s" : "static, solved in each iteration: its face has %d unknowns, %.3g products if condensed, beside %s", (int)r.face,
                            (double)PetscSqr((PetscReal)r.face), entries));
  } else if (r.implicit)
    PetscCall(PetscSNPrintf(words, size, "implicit (average acceleration, one factorisation), %d unknowns on the face; %s: explicit it would hold the particles' step at %.4g s", (int)far.face, strcmp(asked, "auto") ? "as asked" : "chosen",
                            (double)r.explicit_limit));
  else PetscCall(PetscSNPrintf(words, size, "explicit%s", !strcmp(asked, "auto") ? "; chosen: its elements do not make the particles' step much smaller" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppPlanPrint(AppCase *c, const AppPlan *p, FILE *out)
{
  char            active[256], solver[256], far[256];
  const char     *title, *about = p->built ? "" : "about ";
  const PetscBool sure = p->built || c->time != APP_EXPLICIT ? PETSC_TRUE : PETSC_FALSE;
  PetscReal       end = 0;

  PetscFunctionBegin;
  if (c->rank) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SceneGetString(c->scene, "title", &title));
  if (c->time != APP_MODAL) PetscCall(SceneGetReal(c->scene, "time.end", &end));
  fprintf(out, "plan%s%s\n", title[0] ? ": " : "", title);
  fprintf(out, "  space     %s", c->dim == 3 ? "3D" : c->plane_stress ? "2D, plane stress" : "2D, plane strain");
  if (c->dim == 2) fprintf(out, ", %g mm thick", (double)(c->thickness * 1e3));
  PetscCall(TimeWords(c, sizeof(active), active));
  PetscCall(SolverWords(c, p->dofs, sizeof(solver), solver));
  fprintf(out, "\n  active    %s%s%s\n", c->method == APP_FEM ? "finite elements, " : "", c->method == APP_TOUCH ? "finite elements and particles that touch them, explicit" : c->method == APP_COUPLED ? "finite elements and bonded particles over an overlap" : c->method == APP_FEM ? active : c->is_static ? "bonded particles, static" : "bonded particles, explicit", c->method != APP_COUPLED ? "" : c->is_static ? ", quasi-static" : ", explicit");
  if (c->method != APP_DEM) fprintf(out, "  size      %.0f nodes, %.0f elements, %.0f unknowns\n", (double)p->nodes, (double)p->elements, (double)p->dofs);
  if (c->method != APP_FEM) {
    fprintf(out, "  size      %s%.0f particles, %s%.0f bonds", about, (double)p->particles, about, (double)p->bonds);
    if (p->built) fprintf(out, ", %.0f boundary facets", (double)p->walls);
    fputc('\n', out);
  }
  if (c->coupling) {
    CouplingReport r;

    PetscCall(CouplingModelGetReport(c->coupling, &r));
    fprintf(out, "  overlap   %d particles, %d bonds, %d elements; force left on a node in uniform stress %.2g of stress x facet\n", (int)r.particles, (int)r.bonds, (int)r.cells, (double)r.residual);
    if (!c->is_static) {
      fprintf(out, "  substeps  %d particle step%s of ", (int)p->substeps, p->substeps > 1 ? "s" : "");
      Time(out, p->dt / p->substeps);
      fprintf(out, " in one step of the elements outside%s\n", r.implicit ? ", which is implicit" : "");
    }
    PetscCall(FarWords(c, sizeof(far), far));
    fprintf(out, "  far field %s\n", far);
    if (r.preload_evaluations)
      fprintf(out, "  preload   static state of the whole by conjugate gradients: %d evaluations of all forces, %.1e of the loads left out of balance, bonds at %.3g of their strength\n", (int)r.preload_evaluations, (double)r.preload_left,
              (double)r.preload_use);
  }
  if (solver[0]) fprintf(out, "  solver    %s\n", solver);
  fprintf(out, "  loads     %d from conditions, %d tools\n", (int)c->n_loads, (int)c->n_tools);
  fprintf(out, "  memory    %s%.3g MB\n", about, (double)(p->bytes / 1e6));
  if (c->time == APP_MODAL) {
    PetscInt  modes;
    PetscReal shift;

    PetscCall(SceneGetInt(c->scene, "time.modes", &modes));
    PetscCall(SceneGetReal(c->scene, "time.shift", &shift));
    fprintf(out, "  modes     %d, ", (int)modes);
    if (shift > 0) fprintf(out, "nearest %.6g Hz", (double)shift);
    else fprintf(out, "the lowest");
  } else {
    fprintf(out, "  step      %s", sure ? "" : "about ");
    Time(out, p->dt);
    fprintf(out, "  (%s)\n", p->sets);
    if (p->critical > 0) {
      fprintf(out, "  critical  ");
      Time(out, p->critical);
      fprintf(out, c->method == APP_TOUCH ? "  (at least: the bound itself)\n" : "  (2/omega_max by power iteration)\n");
    }
    fprintf(out, "  steps     %s%.0f to ", sure ? "" : "about ", (double)p->steps);
    Time(out, end);
    if (c->governed) fprintf(out, " at pace 1; the load is governed: between %.0f and %.0f (pace %.4g to %.4g)", (double)(p->steps / c->law.fastest), (double)(p->steps / c->law.slowest), (double)c->law.fastest, (double)c->law.slowest);
  }
  fprintf(out, "\n  expected  ");
  Expected(out, p->seconds);
  fprintf(out, " on %d thread%s%s\n", (int)p->threads, p->threads > 1 ? "s" : "", c->size > 1 ? " a rank" : "");
  if (p->rounds > 0) {
    fprintf(out, "  breaking  not counted; a crack through a mean section takes about %.0f rounds, ", (double)p->rounds);
    Expected(out, p->breaking);
    fprintf(out, ", within a factor of two\n");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppPlanJson(AppCase *c, const AppPlan *p, Json *json)
{
  char active[256], solver[256];

  PetscFunctionBegin;
  PetscCall(BaseFormat(active, "fem "));
  PetscCall(TimeWords(c, sizeof(active) - 4, active + 4));
  PetscCall(SolverWords(c, p->dofs, sizeof(solver), solver));
  PetscCall(JsonBeginObject(json, "plan"));
  PetscCall(JsonString(json, "active", c->method == APP_TOUCH ? "fem and dem in contact, explicit" : c->method == APP_COUPLED ? (c->is_static ? "coupled quasi-static" : "coupled explicit") : c->method == APP_FEM ? active : c->is_static ? "dem static" : "dem explicit"));
  if (solver[0]) PetscCall(JsonString(json, "solver", solver));
  PetscCall(JsonBool(json, "estimated", p->built ? PETSC_FALSE : PETSC_TRUE));
  PetscCall(JsonInt(json, "dimension", c->dim));
  if (c->method != APP_DEM) {
    PetscCall(JsonInt(json, "nodes", (PetscInt64)p->nodes));
    PetscCall(JsonInt(json, "elements", (PetscInt64)p->elements));
    PetscCall(JsonInt(json, "unknowns", (PetscInt64)p->dofs));
  }
  if (c->method != APP_FEM) {
    PetscCall(JsonInt(json, "particles", (PetscInt64)p->particles));
    PetscCall(JsonInt(json, "bonds", (PetscInt64)p->bonds));
    PetscCall(JsonInt(json, "boundary_facets", (PetscInt64)p->walls));
  }
  PetscCall(JsonInt(json, "loads", c->n_loads));
  PetscCall(JsonInt(json, "tools", c->n_tools));
  PetscCall(JsonReal(json, "memory_bytes", p->bytes));
  PetscCall(JsonReal(json, "step_s", p->dt));
  PetscCall(JsonString(json, "step_set_by", p->sets));
  if (p->critical > 0) PetscCall(JsonReal(json, "critical_step_s", p->critical));
  if (c->coupling) {
    char far[256];

    PetscCall(JsonInt(json, "substeps", p->substeps));
    PetscCall(FarWords(c, sizeof(far), far));
    PetscCall(JsonString(json, "far_field", far));
  }
  PetscCall(JsonReal(json, "steps", p->steps));
  PetscCall(JsonBool(json, "governed", c->governed)); /* steps are of pace 1 */
  PetscCall(JsonReal(json, "expected_seconds", p->seconds));
  if (p->rounds > 0) {
    PetscCall(JsonReal(json, "breaking_rounds", p->rounds));
    PetscCall(JsonReal(json, "breaking_seconds", p->breaking));
  }
  PetscCall(JsonInt(json, "threads", p->threads));
  PetscCall(JsonInt(json, "ranks", c->size));
  PetscCall(JsonEnd(json));
  PetscFunctionReturn(PETSC_SUCCESS);
}
