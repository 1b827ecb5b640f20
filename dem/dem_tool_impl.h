/* dem_tool_impl.h - inside a tool: shape, pose, contacts with their history. */
#pragma once
#include "dem_impl.h"

/* One contact that lives; kept in the particles' order. */
typedef struct {
  PetscInt          p;             /* particle */
  PetscReal         n[3];          /* from the tool to the particle */
  PetscReal         radius, size;  /* as in dem_contact.h [m] */
  PetscReal         energy;        /* stored [J] */
  DemContactHistory history;
} DemToolContact;

struct DemTool {
  char           name[128];
  DemToolOptions o;
  DemContactPair *pair;    /* [kinds of grains, or of shares] */
  PetscBool      turns;    /* rolling or twisting resistance */
  PetscBool      rotates;  /* the pose has more than a shift */

  /* pose and motion */
  PetscReal centre0[3], shift[3], quaternion[4], turn[3][3]; /* x = centre0 + shift + turn (X - centre0) */
  PetscReal angle;                     /* about turn_axis, prescribed or driven [rad] */
  PetscReal along, along_v, angle_v;   /* driven motions: half-step velocities */
  PetscReal velocity[3], spin[3];      /* over the last step */
  PetscReal moved[3], turned[3];       /* of the last step: shift [m], rotation vector [rad] */
  PetscReal moved_given[3], turned_given; /* the part of them that tables prescribe */
  PetscReal mass, moments[3], frame[3][3]; /* free: principal moments [kg m2], their axes as columns at the start */
  PetscReal v[3], L[3];                /* free: velocity, angular momentum in space; half step */
  PetscReal force[3], torque[3], force_old[3], torque_old[3];
  PetscReal work;

  /* contacts, by block of particles */
  DemToolContact **contact; /* [n_blocks] */
  PetscInt        *n_contacts, *room; /* [n_blocks] */
};

/* With particle p. */
static inline const DemContactPair *DemToolPair(DemModel model, const DemTool *tool, PetscInt p)
{
  return &tool->pair[model->grain_of ? model->grain_of[model->at[p]] : model->tool_share ? model->tool_share[p] : 0];
}

/* dem_tool_shape.c */
PetscErrorCode DemToolShapeSet_Internal(DemTool *tool, PetscInt dim);
/* Touches of a sphere, nearest first, normals in space. */
PetscInt DemToolTouch_Internal(const DemTool *tool, PetscInt dim, const PetscReal x[3], PetscReal radius, DemTouch touch[DEM_TOUCHES]);
/* A surface to look at: caller destroys. `size`: how much of an infinite shape to show [m], about `middle`. */
PetscErrorCode DemToolPicture_Internal(const DemTool *tool, PetscInt dim, const PetscReal middle[3], PetscReal size, DemSurface *picture);

/* dem_tool_motion.c */
PetscErrorCode DemToolMotionSet_Internal(DemTool *tool, PetscInt dim, PetscReal thickness);
void           DemToolPose_Internal(DemTool *tool); /* its matrix from its quaternion */

/* dem_tool_io.c: the state as one row of numbers; `put` writes it, else reads */
enum { DEM_TOOL_STATE = 52 };
PetscErrorCode DemToolPack_Internal(DemTool *tool, PetscBool put, PetscReal row[DEM_TOOL_STATE]);

/* dem_tool.c: room for n contacts in block b; what was there is lost */
PetscErrorCode DemToolReserve_Internal(DemTool *tool, PetscInt b, PetscInt n);
