/*
  coupling_absorb.c - a drag on the mismatch of both sides: waves too short for the elements end in it instead of coming back.  Eqs (6.54), (6.55)

  v <- (1 - theta C) v with C = M^-1 G^T A_l^-1 G is the force -theta c/dt q' on a particle, and its opposite by shape functions on the nodes, where q' = G v
  is the mismatch of the half step before. The springs keep 0.3 of their stiffness, so that such waves come in at all.
*/
#include "coupling_impl.h"

/* Adds the drag at the present instant to the forces from outside on both sides; booked: its loss since the last instant too. */
PetscErrorCode CouplingAbsorb_Internal(CouplingModel model, PetscReal dt, PetscBool booked)
{
  const PetscInt dim = model->dim;
  PetscReal      lost = 0;
  FemState       fs;
  DemState       ds;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(CouplingParticles_Internal(model, &ds));
  for (PetscInt k = 0; k < model->n_particles; k++) {
    const CouplingParticle *particle = &model->particle[k];
    const PetscReal         drag = COUPLING_DRAG * particle->c;
    PetscReal              *before = model->slip + 3 * k;

    for (PetscInt d = 0; d < dim; d++) {
      PetscReal slip = ds.v[d * ds.n + particle->p];

      for (PetscInt a = 0; a < particle->at.n; a++) slip -= particle->at.N[a] * fs.v[particle->at.node[a] * dim + d];
      lost += 0.5 * drag * slip * (before[d] + slip);
      before[d] = slip;
      ds.f_ext[d * ds.n + particle->p] -= drag / dt * slip;
      for (PetscInt a = 0; a < particle->at.n; a++) model->g[particle->at.node[a] * dim + d] += particle->at.N[a] * drag / dt * slip;
    }
  }
  if (booked) model->absorbed += lost;
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscFunctionReturn(PETSC_SUCCESS);
}
