/*
  coupling_contact.h - particles against the surface of a body of finite elements.  Section 5, (5.70)-(5.79), of docs/theory.md

  The body's boundary facets, moving with its nodes, are the surface that particles meet; the force of a contact acts at one
  point on both, and reaches the nodes by the surface's own shape functions.
*/
#pragma once
#include "dem.h"
#include "fem.h"

typedef struct _p_CouplingContact *CouplingContact;

typedef struct {
  DemContactChoice  choice;
  DemContactElastic particle, body;
  PetscReal         thickness; /* [m], 2D */
  PetscReal         deepest;   /* Hertz: largest overlap / radius the step is made for; 0: 0.01 */
  PetscReal         skin;      /* of the search, in smallest radii; 0: 0.3 */
} CouplingContactOptions;

/* name heads messages and the history. mesh: the body's, linear cells; not kept. Refuses, in words, quadratic cells and boundaries that are no surface. */
PetscErrorCode CouplingContactCreate(MPI_Comm comm, const char *name, const Mesh *mesh, CouplingContact *contact);
PetscErrorCode CouplingContactSetSides(CouplingContact contact, FemModel fem, DemModel dem); /* explicit, set up, one rank; borrowed */
PetscErrorCode CouplingContactSetUp(CouplingContact contact, const CouplingContactOptions *options);
PetscErrorCode CouplingContactGetStableStep(CouplingContact contact, PetscReal *dt); /* of both sides and the contacts.  Eq. (5.77) */
PetscErrorCode CouplingContactGetStepper(CouplingContact contact, Stepper *stepper);

typedef struct {
  PetscInt  facets, nodes;        /* of the surface */
  PetscInt  searched, candidates; /* particles that could meet it; of them close enough to be tried each step */
  PetscInt  looks, grids;         /* searches so far; of them with a new grid */
  PetscInt  touching;             /* contacts now */
  PetscReal force[3];             /* on the body [N] */
  PetscReal energy, friction, damping; /* [J] stored now; taken so far */
  PetscReal deepest;              /* overlap / radius so far */
} CouplingContactReport;

PetscErrorCode CouplingContactGetReport(CouplingContact contact, CouplingContactReport *report);
PetscErrorCode CouplingContactDestroy(CouplingContact *contact);
