/* coupling_contact_impl.h - inside a CouplingContact. */
#pragma once
#include "coupling_contact.h"

#define CONTACT_NODES 4 /* body nodes that carry a node of the surface: itself, or the corners around a quadrilateral's middle */

/* One contact that lives; kept in the particles' order. All reals after `cell`: a checkpoint stores them as they are. */
typedef struct {
  PetscInt          p, cell;      /* particle; cell of the surface */
  PetscReal         share[3];     /* of the cell's corners */
  PetscReal         n[3];         /* from the surface to the particle */
  PetscReal         size, energy; /* [m], [J] */
  DemContactHistory history;
} CouplingTouch;

#define TOUCH_REALS ((sizeof(CouplingTouch) - offsetof(CouplingTouch, share)) / sizeof(PetscReal))

struct _p_CouplingContact {
  MPI_Comm               comm;
  char                   name[128];
  FemModel               fem;
  DemModel               dem;
  Stepper                fem_stepper, dem_stepper;
  CouplingContactOptions options;
  DemContactPair         pair;
  PetscBool              ready, turns;
  PetscInt               dim;
  PetscReal              largest, skin; /* [m] radius; slack of the search */

  DemSurface surface;
  PetscInt  *carrier;    /* [surface nodes][CONTACT_NODES] body nodes, -1 where fewer */
  PetscReal *x_grid;     /* [surface nodes][3] when the grid was made */
  PetscReal *x_look;     /* [n_outside][3] particles when they were last looked for */
  PetscInt   n_nodes;    /* of the body */

  PetscInt  seen;        /* DemOutside.looks then, -1: never looked */
  PetscInt  n_candidates, room_outside;
  PetscInt *candidate;   /* [n_candidates] particles */
  PetscInt *n_touch;     /* [n_candidates] of this step, and */
  DemTouch *touch;       /* [n_candidates][DEM_TOUCHES] */
  PetscInt  n, room;
  CouplingTouch *contact, *next;
  PetscReal *press;      /* [body nodes] stiffness that bears on a node [N/m]; all 0 between steps */

  PetscReal rate, drag;  /* of contacts, what the step is made for [1/s2], [1/s] */
  PetscReal force[3], friction, damping;
  PetscReal deepest, time;
  PetscInt  looks, grids, threads;

  PetscInt     n_history;
  const char **history_name, **history_unit;
  char       (*own_name)[160]; /* [dim] */
};

/* coupling_contact_setup.c */
void           CouplingContactMove_Internal(CouplingContact contact, const FemState *fs);          /* the surface's nodes to the body's */
PetscErrorCode CouplingContactRate_Internal(CouplingContact contact);                              /* rate and drag.  Eq. (5.76) */
PetscReal      CouplingContactLimit_Internal(PetscReal fem, PetscReal dem, PetscReal rate, PetscReal drag, PetscReal dt); /* <= 1: stable.  Eq. (5.77) */
/* coupling_contact.c: forces of the present state into both sides' f_ext. dt [s] since the last call, 0 at the start. */
PetscErrorCode CouplingContactForces_Internal(CouplingContact contact, PetscReal dt);

/* Share of body node `a` of a surface node's motion */
static inline PetscInt CouplingCarriers(const PetscInt *carrier)
{
  PetscInt n = 0;

  while (n < CONTACT_NODES && carrier[n] >= 0) n++;
  return n;
}
