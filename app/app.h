/*
  app.h - what the files of the program share.

  The way of a run: AppOptions (the command line) -> Scene -> AppCase (geometry read, groups and rules checked)
  -> models (AppCaseBuild) -> RunLoop -> summary.json. `check` stops before the models.
*/
#pragma once
#include "coupling.h"
#include "coupling_contact.h"
#include "dem.h"
#include "fem.h"
#include "json.h"
#include "run_govern.h"
#include "scene.h"

typedef struct {
  const char  *command;
  PetscInt     n_words;
  const char **word;   /* [n_words] what is not an option: the scene, a kind, a directory */
  const char  *output; /* NULL: results/NAME below the caller */
  PetscInt     threads, stop_after; /* 0: not given */
  PetscInt     n_set;
  const char **set; /* [n_set] "path=value" */
  PetscReal    time_limit; /* [s] of wall time, the set-up included; 0: none */
  PetscLogDouble stop_at;  /* by PetscTime(); 0: never */
  PetscBool    resume, new_loads, quiet, no_plots, measure;
  int          n_petsc;
  char       **petsc; /* [n_petsc + 1] program name and what follows "--" */
} AppOptions;

/* No PETSC in here: options are read before it starts. Returns 0, or 2 after saying on stderr what is wrong. */
int  AppOptionsRead(int argc, char **argv, AppOptions *options);
void AppOptionsFree(AppOptions *options);

/* Wall time by phase, in the order the phases began. */
#define APP_PHASES 16
typedef struct {
  PetscInt       n;
  const char    *name[APP_PHASES];
  PetscLogDouble seconds[APP_PHASES], began;
} AppClock;
PetscErrorCode AppClockBegin(AppClock *clock, const char *phase);
PetscErrorCode AppClockEnd(AppClock *clock);
void           AppClockAdd(AppClock *clock, const char *phase, PetscLogDouble seconds);

/* A named part of a body that conditions and history may speak of. */
typedef struct {
  char     name[128];
  PetscInt dim; /* of its cells; a face of a DEM body is dim - 1, a tool -1 */
  PetscBool particles; /* of the particles' body, where two touch */
} AppGroup;

typedef enum { APP_FIX, APP_TRACTION, APP_PRESSURE, APP_GRAVITY, APP_SYMMETRY, APP_FORCE, APP_LINE_LOAD, APP_ABSORB, APP_PLANE } AppLoadKind;

/* One thing a condition asks for, with the scene path to point at when it is refused. */
typedef struct {
  AppLoadKind kind;
  char        path[256];
  char        group[128];
  PetscBool   particles;  /* two bodies that touch: which of them */
  PetscInt    component;  /* of APP_FIX, APP_TRACTION, APP_FORCE, APP_LINE_LOAD */
  PetscBool   velocity;   /* APP_FIX: the table is a velocity [m/s], not a displacement [m] */
  PetscReal   gravity[3]; /* [m/s2] */
  PetscReal   point[3], normal[3], friction, restitution; /* APP_PLANE: [m], [-] */
  Table       motion[3];  /* APP_PLANE: velocity [m/s], n = 0 at rest; owned */
  Table       table;      /* m, m/s, Pa, N or N/m; owned */
} AppLoad;

typedef struct {
  char path[256], quantity[64], group[128];
  char other[128]; /* of a strain: the second group */
} AppQuantity;

typedef struct _AppReadings *AppReadings; /* readings.c; NULL unless a strain is asked for */

/* A part of the one body: a material on a group ("" = all of it). Several only for finite elements on one mesh. */
typedef struct {
  const char *name;  /* in the scene's bodies; borrowed from the scene */
  const char *group, *material;
  PetscReal   density, young, poisson; /* SI; of an orthotropic material the largest, for estimates */
  FemMaterial elastic;
  PetscReal   local_damping, mass_damping, stiffness_damping; /* [-], [1/s], [s] */
  PetscBool   cohesive;
  DemStrength strength; /* of a material that breaks */
  DemRule     rule;     /* of its bonds */
} AppPart;

typedef enum { APP_FEM, APP_DEM, APP_COUPLED, APP_TOUCH } AppMethod; /* APP_TOUCH: part 0 of finite elements, part 1 of particles, which meet its surface */
typedef enum { APP_EXPLICIT, APP_STATIC, APP_IMPLICIT, APP_MODAL } AppTime;
enum { APP_PARTS = 64 };

/* Everything built for a scene; only what its method needs is ever made. */
typedef struct {
  MPI_Comm    comm;
  PetscMPIInt rank, size;
  Scene       scene;
  AppClock    clock;

  PetscInt    dim;
  PetscBool   plane_stress, is_static;
  PetscReal   thickness; /* [m], 2D */
  AppMethod   method;
  AppTime     time;
  PetscBool   preload; /* time.preload: static */
  PetscReal   balance[2];   /* of all forces on finite elements at the end of a run: force [N], moment [N m] */
  PetscBool   corotational; /* bodies.*.mesh.rotation */
  PetscInt    n_parts;
  AppPart     part[APP_PARTS];

  PetscInt    n_groups;
  AppGroup   *group;
  PetscInt    n_loads;
  AppLoad    *load;
  PetscInt    n_quantities;
  AppQuantity *quantity;
  PetscInt     n_tools;
  DemSurface  *tool_surface; /* [n_tools] as read, where models are made more than once; else NULL */

  Mesh        mesh; /* fem; on rank 0 */
  DemBody    *joint; /* [n_joints] bodies.*.dem.cohesive_groups; freed once the particles know their group */
  PetscInt    n_joints;
  PetscInt    mesh_nodes, mesh_cells;
  PetscInt    mesh_order; /* 2: every element of the body is quadratic */
  PetscReal   mesh_step, mesh_cost; /* [s] for estimates: wave across the shortest edge; work of one explicit step */
  PetscInt    grain;     /* which part the particles at hand are, where several bodies of grains share a model */
  DemBody    *grain_body; /* [n_parts], of those; body is then the box about them all */
  DemClump   *shape;     /* [n_parts] of their clumps */
  DemClumpPlace *place;  /* where they lie */
  PetscInt    n_places;
  PetscInt   *grain_of;  /* [particles] part of each */
  DemBody     body;      /* dem */
  DemPacking  packing;
  DemCells    cells;
  FemModel    fem;
  DemModel    dem; /* of a coupled body on several ranks: the part that steps */
  CouplingSplit split; /* coupled */
  CouplingModel coupling;
  CouplingContact contact; /* APP_TOUCH */
  CouplingSwitch turning; /* NULL unless elements may turn into particles: fem, dem and coupling are then its own, see AppSidesNow() */
  PetscInt      threads;
  Stepper     stepper;
  TableClock  pace;    /* of time.govern; tables point here */
  PetscBool   governed;
  RunGovernOptions law;
  RunGovern   govern;
  AppReadings readings;

  PetscInt   n_modes; /* of a modal run */
  PetscReal *frequency; /* [n_modes] [Hz] */

  PetscInt made_bodies, made_packings, made_cells, made_dem, made_fem, made_couplings; /* counts of what was constructed */
} AppCase;

/* Geometry and rules: everything `check` wants, no model. Errors are PETSC_ERR_USER_INPUT at a place in the scene. */
PetscErrorCode AppCaseRead(MPI_Comm comm, const AppOptions *options, AppCase *c);
PetscErrorCode AppCaseBuild(AppCase *c, PetscInt threads);
PetscErrorCode AppCasePack(AppCase *c); /* body -> packing */
PetscErrorCode AppSidesNow(AppCase *c); /* fem, dem and coupling as they stand after events */
PetscErrorCode AppCaseDestroy(AppCase *c);

PetscErrorCode AppGeometryRead(AppCase *c);   /* parts, mesh or body, groups */
PetscErrorCode AppConditionsRead(AppCase *c); /* loads and history quantities, checked against the groups */
PetscErrorCode AppConditionsApply(AppCase *c);
PetscErrorCode AppPrestressApply(AppCase *c, const AppPart *part); /* initial stress, expansion and temperature of a part of finite elements */
PetscErrorCode AppToolsApply(AppCase *c);
PetscErrorCode AppToolsDestroy(AppCase *c);

/* The part made of particles; with one body the only one. */
static inline const AppPart *AppGrains(const AppCase *c)
{
  return &c->part[c->method == APP_TOUCH ? 1 : c->grain];
}
PetscErrorCode AppGrainsPack(AppCase *c);    /* packings of all bodies of particles in one, clumps in place of spheres */
PetscErrorCode AppGrainsApply(AppCase *c);   /* their materials, velocities and clumps to the model that has the packing */
PetscErrorCode AppGrainsDestroy(AppCase *c);
PetscErrorCode AppContactRead(AppCase *c, const char *at, DemContactChoice *choice); /* a law of contact below `at` */

/* What history.csv shows beyond the models' own columns: probes, and strains between groups made from mean displacements. */
PetscErrorCode AppProbesCheck(AppCase *c);                            /* names against the groups */
PetscErrorCode AppProbesApply(AppCase *c);
PetscErrorCode AppReadingsNeed(AppCase *c, const AppQuantity *strain); /* the columns it is made of; before the models are set up */
PetscErrorCode AppReadingsBegin(AppCase *c);                          /* puts itself before c->stepper */
PetscErrorCode AppReadingsDestroy(AppCase *c);
PetscErrorCode AppTable(AppCase *c, const char *path, Table *table); /* of the scene, read at load time where the load is governed */
PetscErrorCode AppGovernRead(AppCase *c);
PetscErrorCode AppGovernBegin(AppCase *c); /* puts itself before c->stepper */
PetscErrorCode AppSideOf(AppCase *c, const char *path, const char *group, PetscBool *particles);
PetscErrorCode AppContactApply(AppCase *c);

/* Threads to use: those asked for, else the cores this process may use, shared among the ranks of the machine. */
PetscErrorCode AppThreads(MPI_Comm comm, PetscInt asked, PetscInt *threads);

/* results/NAME below the caller, NAME the scene's folder when the file is scene.yaml, else the file's own. */
PetscErrorCode AppOutputDirectory(const AppOptions *options, size_t size, char directory[]);
/* Lines "path: value". stamp: what a checkpoint depends on, the resolved scene without title, end and output, loads marked '~'; scene: everything. Caller frees. */
PetscErrorCode AppStamp(AppCase *c, char **stamp, char **scene);
PetscErrorCode AppResolvedWrite(AppCase *c, const char *directory, const char *changes); /* changes: NULL, or lines kept below as comments */

/* An error a library raised about the scene's own data becomes an error at the scene's place. */
#define AppCallAt(scene, path, call) \
  do { \
    BaseErrorClear(); \
    BaseErrorQuiet(PETSC_TRUE); \
    const PetscErrorCode code_ = (call); \
    BaseErrorQuiet(PETSC_FALSE); \
    if (PetscUnlikely(code_)) PetscCall(AppErrorAt(scene, path, code_)); \
  } while (0)
PetscErrorCode AppErrorAt(Scene scene, const char *path, PetscErrorCode code);

/* What a run is going to do. */
typedef struct {
  PetscBool built;     /* from the models; otherwise estimates */
  char      sets[256]; /* what sets the step */
  PetscReal nodes, elements, dofs, particles, bonds, walls;
  PetscReal bytes;       /* memory */
  PetscReal dt, critical; /* [s]; critical 0 when not computed, dt 0 for static */
  PetscReal steps, seconds;
  PetscReal rounds, breaking; /* of load steps in which bonds may break: rounds and seconds [s] that one crack through the narrowest section takes on top; 0 elsewhere */
  PetscInt  threads;
  PetscInt  substeps; /* particle steps in one step; 1 unless coupled, and in an estimate */
} AppPlan;
PetscErrorCode AppPlanEstimate(AppCase *c, PetscInt threads, AppPlan *plan);
PetscErrorCode AppPlanFromModels(AppCase *c, PetscInt threads, AppPlan *plan); /* refuses a given step above the critical one */
PetscErrorCode AppPlanPrint(AppCase *c, const AppPlan *plan, FILE *out);
/* Time the run would take, from some seconds of it in a temporary directory: `check --measure`. The case is spent. */
PetscErrorCode AppMeasure(AppCase *c, const AppOptions *options, const AppPlan *plan, FILE *out);
PetscErrorCode AppPlanJson(AppCase *c, const AppPlan *plan, Json *json);

/* What the loop needs of scene and plan; fields to write; plots of the results, with warnings to end. */
PetscErrorCode AppRunOptions(AppCase *c, const AppOptions *options, const AppPlan *plan, RunOptions *run);
PetscErrorCode AppFieldNames(AppCase *c, Output output);

/* Objects of every PETSc class made so far on this rank, from PETSc's own log, and our own. */
PetscErrorCode AppCountsJson(AppCase *c, Json *json);
PetscErrorCode AppCountsPrint(AppCase *c, FILE *out);

typedef struct {
  const char *state; /* running, done, interrupted, stopped, failed */
  int         exit_code;
  char        message[BASE_LINE];
  PetscInt    n_warnings;
  char        warning[8][512];
} AppEnd;
PetscErrorCode AppPlots(AppCase *c, const char *directory, PetscBool quiet, AppEnd *end);
PetscErrorCode AppSummaryWrite(AppCase *c, const AppPlan *plan, const RunSummary *run, const AppEnd *end, const char *directory);
PetscErrorCode AppModal(AppCase *c, Output output, const char *directory, PetscBool quiet); /* modes.csv, frames, c->frequency */
PetscErrorCode AppCracksWrite(AppCase *c, const char *directory); /* cracks.csv and fragments.csv, where the material can break */
PetscErrorCode AppSwitchesWrite(AppCase *c, const char *directory, AppEnd *end); /* switches.csv, where elements may turn */
PetscErrorCode AppSwitchesJson(AppCase *c, Json *json);
PetscErrorCode AppVersionsJson(Json *json);
void           AppVersionPrint(FILE *out);

/* The commands; the value is the exit code. */
PetscErrorCode AppRun(const AppOptions *options, int *exit_code);
PetscErrorCode AppCheck(const AppOptions *options, int *exit_code);
PetscErrorCode AppPack(const AppOptions *options, int *exit_code);
PetscErrorCode AppInfo(const AppOptions *options, int *exit_code);
PetscErrorCode AppNew(const AppOptions *options, int *exit_code);

/* Run Python on one of our scripts, quiet: without what it prints; *ran is false, with a word on stderr, when that is impossible. Rank 0 only. */
PetscErrorCode AppPython(const char *script, const char *argument, PetscInt n, const char *const more[], PetscBool quiet, PetscBool *ran);
