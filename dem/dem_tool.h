/*
  dem_tool.h - rigid bodies that press, cut, turn or lie about: what a DemModel is told of them. SI units.  docs/theory.md 5.3
*/
#pragma once
#include "dem_contact.h"
#include "dem_surface.h"
#include "table.h"

typedef enum { DEM_TOOL_PLANE, DEM_TOOL_SURFACE, DEM_TOOL_CYLINDER, DEM_TOOL_DISC } DemToolShape;
typedef enum { DEM_TOOL_PRESCRIBED, DEM_TOOL_FREE } DemToolMotion;

typedef struct {
  DemToolShape shape;
  PetscReal    point[3]; /* plane: any point of it; cylinder, disc: the middle [m] */
  PetscReal    axis[3];  /* plane: normal, to the side of the particles; disc: normal; cylinder: axis (2D: not used) */
  PetscReal    radius;   /* cylinder (2D: a circle), disc (a flat, thin plate, 3D only) [m] */
  PetscReal    length;   /* cylinder: 0 = without end. With ends: a solid with flat ends; a tube without lids when `inside` [m] */
  PetscBool    inside;   /* cylinder: the particles are in it */
  DemSurface   surface;  /* DEM_TOOL_SURFACE: the model takes it over (and leaves zeros) */

  DemContactChoice contact;
  PetscReal        damping; /* fraction of critical along the normal; > 0 replaces contact.restitution */

  /* Prescribed: what the tables say. A drive adds one free motion along (about) its axis. Missing tables (n = 0) are zero. */
  DemToolMotion motion;
  Table         velocity[3];      /* [m/s] */
  PetscReal     centre[3];        /* point that the rotation and all torques are about; moves with the tool [m] */
  PetscBool     has_centre;       /* else: middle of the shape; of a free body, its centre of mass */
  PetscReal     turn_axis[3];     /* of rotation and torque (2D: z) */
  Table         speed;            /* angular velocity [rad/s] */
  PetscBool     pushed, twisted;  /* driven by a force along push_axis; by a torque about turn_axis */
  PetscReal     push_axis[3];
  Table         force, torque;    /* [N], [N m] */
  PetscReal     mass, inertia;    /* of the driven motion [kg], about turn_axis [kg m2] */

  /* Free: mass and moments of inertia from the closed surface when density > 0, else mass and these about x, y, z (2D: z). */
  PetscReal density, moments[3];
  PetscReal start_velocity[3], start_spin[3];
} DemToolOptions;

/* What a tool does now; all about its centre. */
typedef struct {
  PetscReal centre[3], shift[3];   /* now, since the start [m] */
  PetscReal quaternion[4];         /* w x y z, from the start */
  PetscReal velocity[3], spin[3];  /* over the last step [m/s], [rad/s] */
  PetscReal momentum[3], angular[3]; /* of a free body, half step [kg m/s], [kg m2/s] */
  PetscReal force[3], torque[3];   /* of the particles on the tool [N], [N m] */
  PetscReal work;                  /* of the tool on the particles so far [J] */
  PetscReal mass;                  /* [kg]; 0 unless driven by a force or free */
  PetscInt  contacts;
} DemToolState;
