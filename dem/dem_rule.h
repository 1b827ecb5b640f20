/*
  dem_rule.h - inside a DemModel whose bonds follow a published rule: springs between particle centres.  Eqs (4.40)-(4.69)

  A rule is data: which pairs, which stiffnesses (dem_rule_setup.c). One kernel a dimension serves them all
  (dem_rule_bonds2.c, dem_rule_bonds3.c); what has history (damage, permanent set, friction) is treated one bond at a
  time (dem_rule_law.c). A model with the `exact` rule has no DemNetwork and comes here never.
*/
#pragma once
#include "dem_impl.h"

typedef struct {
  PetscInt p, q, facet; /* internal numbers, p < q; facet of the cells, -1 = none between them */
} DemPair;

/* History of a bond under the published law, rows of hist[DEM_PAST_ALL][bonds]. */
enum {
  DEM_PAST_OPEN,   /* largest elastic elongation so far / its limit, at least 1 */
  DEM_PAST_SLIDE,  /* largest shear force of the whole bond so far / its limit, at least 1 */
  DEM_PAST_SET,    /* elongation at which the normal force vanishes [m], <= 0 */
  DEM_PAST_YN,     /* 1/2 k_n elongation^2 a step ago [J] */
  DEM_PAST_YS,     /* 1/2 k_s |slide|^2 a step ago [J] */
  DEM_PAST_PUSH,   /* compressive force a step ago [N] */
  DEM_PAST_LIMIT_N, /* nonlocal: elongation at which it began to soften [m], 0 = has not */
  DEM_PAST_LIMIT_S, /* nonlocal: shear force at which it began to soften [N], 0 = has not */
  DEM_PAST_ALL
};

struct _n_DemNetwork {
  PetscReal *kn, *ks;     /* [bonds] stiffness [N/m] */
  PetscReal *area;        /* [bonds] the rule's area [m2] */
  PetscReal *length;      /* [bonds] between the centres at rest [m] */
  PetscReal *part;        /* [bonds] contact point's place on the line p to q, 0 at p and 1 at q */
  PetscReal  area_factor; /* alpha that was used */
  PetscReal *hist;        /* [DEM_PAST_ALL][bonds], NULL unless bonds can break */
  PetscReal *stress;      /* [particles][6] stress [Pa] xx yy zz xy yz zx of an earlier step; NULL unless asked for */
  PetscReal *stress_sum, *slot_stress; /* [particles][6], [slots][6] stress x volume [J] */
  PetscReal *nu_force, *nu_length; /* [bonds] Poisson force [N] and elongation [m] a step ago: for its work */
  PetscReal *block_work;  /* [blocks] work of the Poisson force in this step [J] */
  PetscReal  nu_work;     /* taken by the Poisson force so far [J] */
  PetscReal **scratch;    /* [threads] stress of a block's copy */
};

/* Geometry of one bond now.  Eqs (4.40)-(4.42) */
typedef struct {
  PetscReal a[3], b[3]; /* arms to the contact point */
  PetscReal gap[3];     /* between its two images */
  PetscReal n[3];       /* unit vector from centre p to centre q */
  PetscReal open;       /* elongation of the centre line [m] */
  PetscReal along;      /* gap . n */
  PetscReal slide[3];   /* gap across n */
  PetscReal length;     /* of the centre line now */
} DemPairState;

/* Records of a bond's particles. */
typedef struct {
  const PetscReal *p, *q; /* [DEM_AT_ALL] */
} DemPairView;

/* What one bond does: force on p, couples on p and q; and what it stores. */
typedef struct {
  PetscReal force[3], couple_p[3], couple_q[3];
  PetscReal normal, shear; /* [N] normal force, tension positive; size of the tangential one */
  PetscReal energy;        /* [J] */
} DemPairForce;

/* dem_rule_bonds2.c, dem_rule_bonds3.c: bonds [begin, begin + m) as elastic springs.
   t [9][DEM_CHUNK] out: force on p, couple on p, couple on q
   normal [DEM_CHUNK] out: k_n times elongation [N];  shear2 [DEM_CHUNK] out: (k_s |slide|)^2 [N2] */
void DemPairsForce2_Internal(PetscInt begin, PetscInt m, const DemBonds *bonds, DemNetwork net, const PetscReal *copy, PetscReal t[9][DEM_CHUNK], PetscReal *normal, PetscReal *shear2);
void DemPairsForce3_Internal(PetscInt begin, PetscInt m, const DemBonds *bonds, DemNetwork net, const PetscReal *copy, PetscReal t[9][DEM_CHUNK], PetscReal *normal, PetscReal *shear2);

/* dem_rule_law.c */
void DemPairGeometry_Internal(PetscInt dim, const DemPairView *view, PetscReal part, DemPairState *pair);
/* Force of bond k under the published law; advance: its history moves on.  Eqs (4.50)-(4.62) */
void DemPairLaw_Internal(DemModel model, PetscInt k, const DemPairView *view, PetscBool advance, DemPairForce *force);
/* The same of any bond as it stands, for energies and output */
void DemPairNow_Internal(DemModel model, PetscInt k, DemPairForce *force);

/* dem_rule_setup.c */
PetscErrorCode DemRulePairs_Internal(DemModel model, PetscInt *n, DemPair **pair);
PetscErrorCode DemSetUpRule_Internal(DemModel model);
PetscErrorCode DemRuleCheckLaw_Internal(DemModel model);
PetscErrorCode DemRuleDestroy_Internal(DemModel model);
PetscErrorCode DemRuleSave_Internal(DemModel model, Checkpoint checkpoint);
PetscErrorCode DemRuleLoad_Internal(DemModel model, Checkpoint checkpoint);
PetscErrorCode DemRuleRate_Internal(DemModel model, PetscBool turned, PetscReal *rate);
PetscReal      DemRuleStiffening_Internal(DemModel model); /* how much stiffer the Poisson term can make the network.  Eq. (4.49) */

/* dem_rule_area.c */
PetscErrorCode DemPolyhedronAreas_Internal(DemModel model, PetscReal area[]); /* [bonds] [m2].  Eqs (4.66)-(4.68) */

/* dem_rule_force.c */
PetscErrorCode DemRuleForces_Internal(DemModel model, PetscInt flags);
PetscReal      DemRuleEnergy_Internal(DemModel model);
PetscReal      DemPoissonForce_Internal(DemModel model, PetscInt bond, PetscInt component); /* of the last step, on p [N] */

/* dem_force.c: what the network shares with the exact rule */
void     DemCopyParticle_Internal(DemModel model, PetscInt p, PetscReal at[DEM_AT_ALL]);
PetscInt DemCopyState_Internal(DemModel model, PetscInt block, PetscReal *copy);
void     DemBlockLoads_Internal(DemModel model, PetscInt block, PetscReal *copy, PetscInt flags); /* walls, weight; out to f and slots */
void     DemBlockGather_Internal(DemModel model, PetscInt block, PetscInt flags);
/* dem_stable.c */
PetscReal DemLargestOfBlock_Internal(PetscReal B[6][6]);
