/* dem.h - bonded particles: everything another module may know. SI units. Eqs (4.x), (5.x), docs/theory.md */
#pragma once
#include "dem_cells.h"
#include "run.h"
#include "table.h"

typedef struct _p_DemModel *DemModel; /* fields live in dem_impl.h */

typedef enum { DEM_SOLID, DEM_PLANE_STRAIN, DEM_PLANE_STRESS } DemKind;
typedef enum { DEM_DISPLACEMENT, DEM_VELOCITY } DemMotion;

typedef struct {
  PetscReal density; /* [kg/m3] */
  PetscReal young;   /* [Pa] */
  PetscReal poisson; /* [-] in (-1, 1/2) */
} DemMaterial;

/* Arrays on loan; valid until DemModelRestoreState(). Particles in the packing's order. */
typedef struct {
  PetscInt         n;
  const PetscReal *x0;     /* [n][3] rest position [m] */
  PetscReal       *u, *v;  /* [n][3] displacement [m], half-step velocity [m/s] */
  PetscReal       *spin;   /* [n][3] angular velocity [rad/s], half-step */
  const PetscReal *mass, *inertia; /* [n] [kg], [kg m2] */
} DemState;

/* A rigid plane: inside is n.(x - point) >= 0. */
typedef struct {
  PetscReal point[3], normal[3];
  PetscReal friction;  /* Coulomb coefficient */
  PetscReal stiffness; /* [Pa]: contact stiffness is stiffness x radius; 0 = the material's Young's modulus */
  PetscReal damping;   /* fraction of critical, normal direction */
} DemPlane;

PetscErrorCode DemModelCreate(MPI_Comm comm, DemModel *model); /* refuses, in words, more than one rank */
PetscErrorCode DemModelSetKind(DemModel model, DemKind kind);
PetscErrorCode DemModelSetThreads(DemModel model, PetscInt threads);
PetscErrorCode DemModelSetMaterial(DemModel model, const DemMaterial *material);
PetscErrorCode DemModelSetBody(DemModel model, const DemBody *body, const DemPacking *packing, const DemCells *cells); /* copies */
PetscErrorCode DemModelSetBonded(DemModel model, PetscBool bonded); /* default true */

/* Facet platens on a named face. Along the face's own normal alone: smooth. All components: glued. Other
   combinations are refused.  Eqs (4.10), (4.11) */
PetscErrorCode DemModelFix(DemModel model, const char *face, PetscInt component, DemMotion motion, const Table *table);
PetscErrorCode DemModelAddTraction(DemModel model, const char *face, const PetscReal direction[3], const Table *table); /* [Pa] */
PetscErrorCode DemModelAddPressure(DemModel model, const char *face, const Table *table);
PetscErrorCode DemModelSetGravity(DemModel model, const PetscReal gravity[3]);
PetscErrorCode DemModelSetInitialVelocity(DemModel model, const PetscReal velocity[3]);
PetscErrorCode DemModelSetLocalDamping(DemModel model, PetscReal alpha); /* non-viscous, in [0, 1) */
/* velocity: three tables [m/s] */
PetscErrorCode DemModelAddPlane(DemModel model, const char *name, const DemPlane *plane, const Table velocity[3]);

/* "reaction" of a face or plane, "displacement" (mean of a face), "velocity". One column per component. */
PetscErrorCode DemModelAddHistory(DemModel model, const char *quantity, const char *group);

PetscErrorCode DemModelSetUp(DemModel model);
PetscErrorCode DemModelGetCriticalStep(DemModel model, PetscReal *dt); /* power iteration, 1 % */
PetscErrorCode DemModelGetStableStep(DemModel model, PetscReal *dt);   /* rigorous block bound, never above it.  Eq. (4.14) */
PetscErrorCode DemModelGetStepper(DemModel model, Stepper *stepper);   /* borrowed from the model */
PetscErrorCode DemModelGetState(DemModel model, DemState *state);
PetscErrorCode DemModelRestoreState(DemModel model, DemState *state);
PetscErrorCode DemModelGetCounts(DemModel model, PetscInt *particles, PetscInt *bonds, PetscInt *walls);
PetscErrorCode DemModelDestroy(DemModel *model);
