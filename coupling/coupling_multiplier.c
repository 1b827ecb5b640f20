/*
  coupling_multiplier.c - the overlap's constraint held exactly, for comparison with the springs of (6.3).  Eqs (6.50)-(6.52)

  Multipliers at the particles make q at the next instant what it was at the first. Particles of the overlap then move as the elements have it, and their
  elimination leaves a sparse system of the overlap's nodes alone, the same for each component: the nodes' mass with the particles' on it.
  Its factor is made once and serves every step.
*/
#include "coupling_impl.h"

/* B = M + sum m N N^T over the overlap's nodes. */
static PetscErrorCode Assemble(CouplingModel model, Mat *B)
{
  const PetscInt n = model->n_held;
  PetscInt      *count;
  FemState       fs;
  DemState       ds;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(CouplingParticles_Internal(model, &ds));
  PetscCall(PetscMalloc1(n, &count));
  for (PetscInt i = 0; i < n; i++) count[i] = PetscMin(n, 4 * FEM_MAX_NODES); /* elements around a node share nodes; more costs time alone */
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, n, n, 0, count, B));
  PetscCall(MatSetOption(*B, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(PetscFree(count));
  for (PetscInt i = 0; i < fs.n_nodes; i++)
    if (model->held[i] >= 0) PetscCall(MatSetValue(*B, model->held[i], model->held[i], fs.mass[i], ADD_VALUES));
  for (PetscInt k = 0; k < model->n_particles; k++) {
    const CouplingPoint *at = &model->particle[k].at;
    PetscInt             row[FEM_MAX_NODES];
    PetscReal            block[FEM_MAX_NODES * FEM_MAX_NODES];

    for (PetscInt a = 0; a < at->n; a++) {
      row[a] = model->held[at->node[a]];
      for (PetscInt b = 0; b < at->n; b++) block[a * at->n + b] = ds.mass[model->particle[k].p] * at->N[a] * at->N[b];
    }
    PetscCall(MatSetValues(*B, at->n, row, at->n, row, block, ADD_VALUES));
  }
  PetscCall(MatAssemblyBegin(*B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(*B, MAT_SPD, PETSC_TRUE));
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After both sides' set-up. */
PetscErrorCode CouplingMultiplierSetUp_Internal(CouplingModel model)
{
  const PetscInt nodes = CouplingMesh(model)->n_nodes;
  Mat            B;
  PC             pc;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(nodes, &model->held));
  for (PetscInt i = 0; i < nodes; i++) model->held[i] = -1;
  for (PetscInt k = 0; k < model->n_particles; k++)
    for (PetscInt a = 0; a < model->particle[k].at.n; a++) {
      PetscInt *at = &model->held[model->particle[k].at.node[a]];

      if (*at < 0) *at = model->n_held++;
    }
  PetscCall(Assemble(model, &B));
  PetscCall(KSPCreate(PETSC_COMM_SELF, &model->ksp));
  PetscCall(KSPSetOptionsPrefix(model->ksp, "coupling_"));
  PetscCall(KSPSetOperators(model->ksp, B, B));
  PetscCall(KSPSetType(model->ksp, KSPPREONLY));
  PetscCall(KSPGetPC(model->ksp, &pc));
  PetscCall(PCSetType(pc, PCCHOLESKY));
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERCHOLMOD));
  PetscCall(KSPSetUp(model->ksp));
  PetscCall(MatCreateVecs(B, &model->right, &model->solved));
  PetscCall(MatDestroy(&B));
  PetscCall(PetscCalloc3(3 * model->n_particles, &model->q0, CouplingMesh(model)->n_nodes * model->dim, &model->present, PetscMax(1, model->n_particles), &model->drive));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingMultiplierDestroy_Internal(CouplingModel model)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(model->held));
  PetscCall(PetscFree3(model->q0, model->present, model->drive));
  PetscCall(KSPDestroy(&model->ksp));
  PetscCall(VecDestroy(&model->right));
  PetscCall(VecDestroy(&model->solved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mismatch that is held from now on. */
PetscErrorCode CouplingMultiplierHold_Internal(CouplingModel model)
{
  const PetscInt dim = model->dim;
  FemState       fs;
  DemState       ds;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(CouplingParticles_Internal(model, &ds));
  for (PetscInt k = 0; k < model->n_particles; k++)
    for (PetscInt d = 0; d < dim; d++) {
      const CouplingPoint *at = &model->particle[k].at;

      model->q0[3 * k + d] = ds.u[d * ds.n + model->particle[k].p];
      for (PetscInt a = 0; a < at->n; a++) model->q0[3 * k + d] -= at->N[a] * fs.u[at->node[a] * dim + d];
    }
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Multipliers of the present instant, once all other forces of it are known: added to the particles' forces and to model->g.  Eqs (6.50)-(6.52)

  h: what velocities move on with these forces, dt or at the start dt/2; dt: what displacements do then.
*/
PetscErrorCode CouplingMultiply_Internal(CouplingModel model, PetscReal h, PetscReal dt)
{
  const PetscInt dim = model->dim;
  PetscReal     *more, *r;
  FemState       fs;
  DemState       ds;

  PetscFunctionBegin;
  PetscCall(FemModelGetForces(model->fem, model->present));
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(CouplingParticles_Internal(model, &ds));
  PetscCall(PetscCalloc1(3 * model->n_particles, &more));
  for (PetscInt d = 0; d < dim; d++) {
    PetscScalar       *right;
    const PetscScalar *V;

    PetscCall(VecGetArray(model->right, &right));
    for (PetscInt i = 0; i < fs.n_nodes; i++)
      if (model->held[i] >= 0) right[model->held[i]] = fs.mass[i] * fs.v[i * dim + d] + h * (model->present[i * dim + d] + model->g[i * dim + d]);
    r = model->drive;
    for (PetscInt k = 0; k < model->n_particles; k++) { /* r: velocity a particle would have, less what q needs to be q0 at the next instant */
      const CouplingPoint *at = &model->particle[k].at;
      const PetscInt       p = d * ds.n + model->particle[k].p;
      PetscReal            q = ds.u[p];

      for (PetscInt a = 0; a < at->n; a++) q -= at->N[a] * fs.u[at->node[a] * dim + d];
      r[k] = ds.v[p] + h * ds.f[p] / ds.mass[model->particle[k].p] - (model->q0[3 * k + d] - q) / dt;
      for (PetscInt a = 0; a < at->n; a++) right[model->held[at->node[a]]] += at->N[a] * ds.mass[model->particle[k].p] * r[k];
    }
    PetscCall(VecRestoreArray(model->right, &right));
    PetscCall(KSPSolve(model->ksp, model->right, model->solved));
    PetscCall(VecGetArrayRead(model->solved, &V));
    for (PetscInt k = 0; k < model->n_particles; k++) {
      const CouplingPoint *at = &model->particle[k].at;
      PetscReal            lambda = -r[k];

      for (PetscInt a = 0; a < at->n; a++) lambda += at->N[a] * V[model->held[at->node[a]]];
      lambda *= ds.mass[model->particle[k].p] / h;
      more[d * model->n_particles + k] = lambda;
      for (PetscInt a = 0; a < at->n; a++) model->g[at->node[a] * dim + d] -= at->N[a] * lambda;
    }
    PetscCall(VecRestoreArrayRead(model->solved, &V));
    model->solves++;
  }
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscCall(CouplingAddForces_Internal(model, more));
  PetscCall(PetscFree(more));
  PetscFunctionReturn(PETSC_SUCCESS);
}
