/*
  coupling_force.c - forces of the overlap on both sides, and its energy.  Eqs (6.2)-(6.8)

  q = u_i - N U, eps = sym grad U at the particle, w = turn of the particle - 1/2 curl U:
  E = sum 1/2 P |q|^2 + q.F(eps) + w.M(eps); forces are minus its gradient, for particles and nodes alike.
*/
#include "coupling_impl.h"

typedef struct {
  PetscReal q[3], strain[COUPLING_VOIGT], w[3];
} Mismatch;

/* The nodes' displacement, with that of an in-situ stress where there is one. */
static const PetscReal *NodesOf(CouplingModel model, const FemState *fs)
{
  if (!model->before) return fs->u;
  for (PetscInt i = 0; i < fs->n_nodes * model->dim; i++) model->total[i] = fs->u[i] + model->before[i];
  return model->total;
}

static void GetMismatch(CouplingModel model, const CouplingParticle *particle, const PetscReal *u, const DemState *ds, Mismatch *m)
{
  const PetscInt dim = model->dim, p = particle->p, n = ds->n;
  PetscReal      h[3][3] = {{0}};

  for (PetscInt d = 0; d < 3; d++) m->q[d] = d < dim ? ds->u[d * n + p] : 0;
  for (PetscInt a = 0; a < particle->at.n; a++) {
    const PetscReal *U = u + particle->at.node[a] * dim;

    for (PetscInt i = 0; i < dim; i++) {
      m->q[i] -= particle->at.N[a] * U[i];
      for (PetscInt j = 0; j < dim; j++) h[i][j] += U[i] * particle->at.dN[a][j];
    }
  }
  if (dim == 2) {
    m->strain[0] = h[0][0];
    m->strain[1] = h[1][1];
    m->strain[2] = h[0][1] + h[1][0];
    m->w[0] = m->w[1] = 0;
    m->w[2] = ds->rot[2 * n + p] - 0.5 * (h[1][0] - h[0][1]);
  } else {
    for (PetscInt i = 0; i < 3; i++) {
      m->strain[i]     = h[i][i];
      m->strain[3 + i] = h[i][(i + 1) % 3] + h[(i + 1) % 3][i];
      /* small turns: rotation vector = 2 x the quaternion's vector part */
      m->w[i] = 2 * ds->rot[(1 + i) * n + p] - 0.5 * (h[(i + 2) % 3][(i + 1) % 3] - h[(i + 1) % 3][(i + 2) % 3]);
    }
  }
}

/*
  Forces of the present state of both sides: on the particles into their f_ext and t_ext, on the nodes into model->g. The rim's
  part on the nodes follows once the particle model has evaluated (CouplingStep). Also tells the rim where the elements are.
*/
PetscErrorCode CouplingForces_Internal(CouplingModel model)
{
  const PetscInt  dim = model->dim, ns = model->ns;
  const Mesh     *mesh = CouplingMesh(model);
  FemState        fs;
  DemState        ds;
  DemRim          rim;
  const PetscReal *nodes;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(CouplingParticles_Internal(model, &ds));
  PetscCall(CouplingRim_Internal(model, &rim));
  nodes = NodesOf(model, &fs);
  PetscCall(PetscArrayzero(model->g, fs.n_nodes * dim));
  for (PetscInt k = 0; k < model->n_particles; k++) {
    const CouplingParticle *particle = &model->particle[k];
    const PetscReal         P = CouplingSpring(model, particle);
    PetscReal               f[3] = {0}, t[3] = {0}, s[COUPLING_VOIGT] = {0};
    Mismatch                m;

    GetMismatch(model, particle, nodes, &ds, &m);
    for (PetscInt d = 0; d < 3; d++) {
      f[d] = P * m.q[d];
      for (PetscInt j = 0; j < ns; j++) {
        f[d] += particle->F[d][j] * m.strain[j];
        t[d] += particle->M[d][j] * m.strain[j];
        s[j] += particle->F[d][j] * m.q[d] + particle->M[d][j] * m.w[d];
      }
    }
    for (PetscInt d = 0; d < 3; d++) {
      ds.f_ext[d * ds.n + particle->p] = d < dim ? -f[d] : 0;
      ds.t_ext[d * ds.n + particle->p] = dim == 3 || d == 2 ? -t[d] : 0;
    }
    for (PetscInt a = 0; a < particle->at.n; a++) {
      const PetscReal *g = particle->at.dN[a];
      PetscReal       *out = model->g + particle->at.node[a] * dim;

      for (PetscInt d = 0; d < dim; d++) out[d] += particle->at.N[a] * f[d];
      CouplingNodeForce(dim, g, s, -1, out);
      for (PetscInt d = 0; d < dim; d++) out[d] += 0.5 * (t[(d + 1) % 3] * g[(d + 2) % 3] - t[(d + 2) % 3] * g[(d + 1) % 3]); /* 1/2 M x grad N: the spin's share */
    }
  }
  for (PetscInt e = 0; e < model->n_overlap; e++) {
    const PetscInt   c = model->top[model->overlap[e]], first = mesh->start[c], n = mesh->start[c + 1] - first, m = n * dim;
    const PetscReal *K = model->K + (size_t)e * model->width * model->width;
    PetscReal        u[FEM_MAX_DOFS];

    for (PetscInt a = 0; a < n; a++)
      for (PetscInt d = 0; d < dim; d++) u[a * dim + d] = nodes[mesh->node[first + a] * dim + d];
    for (PetscInt i = 0; i < m; i++) {
      PetscReal sum = 0;

      for (PetscInt j = 0; j < m; j++) sum += K[i * m + j] * u[j];
      model->g[mesh->node[first + i / dim] * dim + i % dim] -= sum;
    }
  }
  for (PetscInt k = 0; k < rim.n; k++)
    for (PetscInt d = 0; d < 3; d++) {
      rim.u[3 * k + d] = 0;
      if (d < dim)
        for (PetscInt a = 0; a < model->rim[k].n; a++) rim.u[3 * k + d] += model->rim[k].N[a] * nodes[model->rim[k].node[a] * dim + d];
    }
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* spring: E of the particles' mismatch; strain: of the fitted stiffness [J] */
PetscErrorCode CouplingEnergy_Internal(CouplingModel model, PetscReal *spring, PetscReal *strain)
{
  const PetscInt  dim = model->dim;
  const Mesh     *mesh = CouplingMesh(model);
  FemState        fs;
  DemState        ds;
  const PetscReal *nodes;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(CouplingParticles_Internal(model, &ds));
  *spring = *strain = 0;
  nodes = NodesOf(model, &fs);
  for (PetscInt k = 0; k < model->n_particles; k++) {
    const CouplingParticle *particle = &model->particle[k];
    Mismatch                m;

    GetMismatch(model, particle, nodes, &ds, &m);
    for (PetscInt d = 0; d < 3; d++) {
      *spring += 0.5 * CouplingSpring(model, particle) * m.q[d] * m.q[d];
      for (PetscInt j = 0; j < model->ns; j++) *spring += (m.q[d] * particle->F[d][j] + m.w[d] * particle->M[d][j]) * m.strain[j];
    }
  }
  for (PetscInt e = 0; e < model->n_overlap; e++) {
    const PetscInt   c = model->top[model->overlap[e]], first = mesh->start[c], m = (mesh->start[c + 1] - first) * dim;
    const PetscReal *K = model->K + (size_t)e * model->width * model->width;

    for (PetscInt i = 0; i < m; i++)
      for (PetscInt j = 0; j < m; j++) *strain += 0.5 * nodes[mesh->node[first + i / dim] * dim + i % dim] * K[i * m + j] * nodes[mesh->node[first + j / dim] * dim + j % dim];
  }
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscFunctionReturn(PETSC_SUCCESS);
}
