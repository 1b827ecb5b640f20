/* switched.h - a box with some particles from the start and the rest free to turn: what the switch tests share. */
#pragma once
#include "coupling.h"

typedef struct Switched Switched;

struct Switched {
  PetscInt       dim, threads, substeps;
  MeshCellType   type;                 /* of the cells; 0: quadrilaterals, hexahedra */
  PetscReal      size[3], h;           /* box [0, size] */
  PetscReal      start[3][2];          /* cells with centroid inside are particles from the start; no limit where both are 0 */
  PetscReal      zone[3][2];           /* cells with centroid inside may turn; all when zone[0][1] = 0 */
  PetscReal      ratio, nu;            /* element / particle spacing */
  PetscInt       width;
  uint64_t       seed;
  DemStrength    strength;             /* tensile 0: far beyond reach */
  CouplingSwitchOptions options;
  PetscErrorCode (*conditions)(Switched *s, FemModel fem, DemModel dem); /* may be NULL */
  PetscErrorCode (*spoil)(Switched *s); /* changes the cells; may be NULL */
  PetscReal      stress[6];            /* in situ; conditions give it to the elements */
  PetscReal      velocity[3], load;     /* for conditions */

  Mesh           mesh;
  DemBody        body;
  DemPacking     packing;
  DemCells       cells;
  FemMaterial    material;
  CouplingSwitch sw;
  Stepper        stepper;
  PetscReal      dt;
};

PetscErrorCode SwitchedFlying(Switched *s, FemModel fem, DemModel dem); /* conditions: all of it begins with s->velocity */
Switched       SwitchedDefault(PetscInt dim, PetscReal x, PetscReal y, PetscReal z);
PetscErrorCode SwitchedCreate(Switched *s); /* 0.9 of the stable step */
PetscErrorCode SwitchedPrepare(Switched *s); /* the same in two parts: all but the first split, */
PetscErrorCode SwitchedBegin(Switched *s);   /* and that */
PetscErrorCode SwitchedSteps(Switched *s, PetscInt *k, PetscInt n); /* from step k, which it moves on */
/* Turns the cells whose centroid lies in the box. */
PetscErrorCode SwitchedConvert(Switched *s, const PetscReal low[3], const PetscReal high[3]);
PetscErrorCode SwitchedDestroy(Switched *s);
PetscReal      SwitchedTotal(const Ledger *ledger); /* all energies */
PetscErrorCode SwitchedMomentum(Switched *s, PetscReal P[3], PetscReal L[3], PetscReal *scale);
