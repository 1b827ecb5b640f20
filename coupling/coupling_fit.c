/*
  coupling_fit.c - small symmetric changes of the elements' stiffness that balance the particles' affine residuals.  Eqs (6.7), (6.8)

  Least squares for the least change: conjugate gradients on the normal equations from zero, which ends at the
  minimum-norm solution. Unknowns: one symmetric matrix per integration point of the overlap.
*/
#include "coupling_impl.h"

#define ROUNDS 2000

/* One integration point of the overlap. */
typedef struct {
  PetscInt        n;
  const PetscInt *node;
  PetscReal       dN[FEM_MAX_NODES][3], w;
} Point;

typedef struct {
  CouplingModel model;
  PetscInt      n_points, n_nodes, *at; /* at [fem nodes]: row of an overlap node, -1 */
  Point        *point;
  PetscReal     scale; /* of a stiffness [Pa] */
  PetscReal    *P;     /* Admissible() */
  PetscReal     state[COUPLING_VOIGT][COUPLING_VOIGT]; /* [k][.] strain (engineering) of the k-th unit stress, times scale */
} Fit;

/* r [state][node][dim] += nodal forces of X in every unit stress's strain; X [point][ns][ns] symmetric, in units of scale */
static void Product(const Fit *fit, const PetscReal *X, PetscReal *r)
{
  const PetscInt ns = fit->model->ns, dim = fit->model->dim;

  for (PetscInt g = 0; g < fit->n_points; g++)
    for (PetscInt k = 0; k < ns; k++) {
      PetscReal s[COUPLING_VOIGT] = {0};

      for (PetscInt i = 0; i < ns; i++)
        for (PetscInt j = 0; j < ns; j++) s[i] += X[(g * ns + i) * ns + j] * fit->state[k][j];
      for (PetscInt a = 0; a < fit->point[g].n; a++) CouplingNodeForce(dim, fit->point[g].dN[a], s, fit->point[g].w, r + (k * fit->n_nodes + fit->at[fit->point[g].node[a]]) * dim);
    }
}

/* Y = the transpose applied to r, symmetrised */
static void Transpose(const Fit *fit, const PetscReal *r, PetscReal *Y)
{
  const PetscInt ns = fit->model->ns, dim = fit->model->dim;

  for (PetscInt g = 0; g < fit->n_points; g++) {
    PetscReal Z[COUPLING_VOIGT][COUPLING_VOIGT] = {{0}};

    for (PetscInt k = 0; k < ns; k++)
      for (PetscInt a = 0; a < fit->point[g].n; a++) { /* strain of the vector r at the node */
        const PetscReal *v = r + (k * fit->n_nodes + fit->at[fit->point[g].node[a]]) * dim, *d = fit->point[g].dN[a], w = fit->point[g].w;

        if (dim == 2) {
          Z[0][k] += w * d[0] * v[0];
          Z[1][k] += w * d[1] * v[1];
          Z[2][k] += w * (d[1] * v[0] + d[0] * v[1]);
        } else {
          for (PetscInt i = 0; i < 3; i++) Z[i][k] += w * d[i] * v[i];
          Z[3][k] += w * (d[1] * v[0] + d[0] * v[1]);
          Z[4][k] += w * (d[2] * v[1] + d[1] * v[2]);
          Z[5][k] += w * (d[0] * v[2] + d[2] * v[0]);
        }
      }
    for (PetscInt i = 0; i < ns; i++)
      for (PetscInt j = 0; j < ns; j++) {
        PetscReal sum = 0;

        for (PetscInt k = 0; k < ns; k++) sum += 0.5 * (Z[i][k] * fit->state[k][j] + Z[j][k] * fit->state[k][i]);
        Y[(g * ns + i) * ns + j] = sum;
      }
  }
}

static PetscReal Dot(PetscInt n, const PetscReal *a, const PetscReal *b)
{
  PetscReal sum = 0;

  for (PetscInt i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}

static void Elastic(CouplingModel model, PetscReal C[COUPLING_VOIGT][COUPLING_VOIGT])
{
  for (PetscInt i = 0; i < model->ns; i++)
    for (PetscInt j = 0; j < model->ns; j++) C[i][j] = i < model->dim && j < model->dim ? model->lambda + (i == j ? 2 * model->mu : 0) : i == j ? model->mu : 0;
}

typedef struct {
  PetscInt node[FEM_MAX_FACE_NODES], n, cell, side;
} Side;

static int CompareSides(const void *a, const void *b)
{
  return memcmp(((const Side *)a)->node, ((const Side *)b)->node, sizeof(((const Side *)a)->node));
}

/* One more direction v to be left out of P: P <- P - (P v)(P v)^T / |P v|^2 */
static void LeaveOut(PetscInt ns, PetscReal *P, const PetscReal *v)
{
  PetscReal w[COUPLING_VOIGT] = {0}, norm = 0, size = 0;

  for (PetscInt i = 0; i < ns; i++) {
    for (PetscInt j = 0; j < ns; j++) w[i] += P[i * ns + j] * v[j];
    norm += w[i] * w[i];
    size += v[i] * v[i];
  }
  if (norm < 1e-10 * size) return;
  for (PetscInt i = 0; i < ns; i++)
    for (PetscInt j = 0; j < ns; j++) P[i * ns + j] -= w[i] * w[j] / norm;
}

/*
  P [node][ns][ns]: on the stresses (orthonormal Voigt: shears times sqrt 2) that leave the body's own surface at the node free of traction; one inside.

  Sides of one element are surface, but for those on the inner edge of the overlap (all nodes at s = 0), where the particles go on.
*/
static PetscErrorCode Admissible(CouplingModel model, Fit *fit)
{
  const Mesh    *mesh = CouplingMesh(model);
  const PetscInt dim = model->dim, ns = model->ns;
  Side          *side;
  PetscInt       n = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(fit->n_nodes * ns * ns, &fit->P));
  for (PetscInt i = 0; i < fit->n_nodes; i++)
    for (PetscInt k = 0; k < ns; k++) fit->P[(i * ns + k) * ns + k] = 1;
  PetscCall(PetscMalloc1(6 * model->n_top, &side));
  for (PetscInt t = 0; t < model->n_top; t++) {
    const PetscInt  c = model->top[t];
    const FemShape *shape = FemShapeGet(mesh->type[c]);

    for (PetscInt f = 0; f < shape->faces; f++, n++) {
      side[n].n    = shape->face_nodes[f];
      side[n].cell = t;
      side[n].side = f;
      for (PetscInt k = 0; k < FEM_MAX_FACE_NODES; k++) side[n].node[k] = k < side[n].n ? mesh->node[mesh->start[c] + shape->face[f][k]] : PETSC_MAX_INT;
      PetscCall(PetscSortInt(side[n].n, side[n].node));
    }
  }
  qsort(side, n, sizeof(*side), CompareSides);
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt  c = model->top[side[k].cell];
    const FemShape *shape = FemShapeGet(mesh->type[c]);
    PetscReal       x[3 * FEM_MAX_FACE_NODES], N_dA[FEM_MAX_FACE_NODES], N_n_dA[3 * FEM_MAX_FACE_NODES], normal[3] = {0}, highest = 0;

    if ((k > 0 && !CompareSides(&side[k], &side[k - 1])) || (k + 1 < n && !CompareSides(&side[k], &side[k + 1]))) continue;
    for (PetscInt a = 0; a < side[k].n; a++) {
      const PetscInt node = mesh->node[mesh->start[c] + shape->face[side[k].side][a]];

      highest = PetscMax(highest, model->split->s[node]);
      for (PetscInt d = 0; d < dim; d++) x[a * dim + d] = mesh->x[3 * node + d];
    }
    if (highest == 0) continue;
    FemFaceIntegrals(dim, side[k].n, x, model->thickness, N_dA, N_n_dA);
    for (PetscInt a = 0; a < side[k].n; a++)
      for (PetscInt d = 0; d < dim; d++) normal[d] += N_n_dA[a * dim + d];
    for (PetscInt a = 0; a < side[k].n; a++) {
      const PetscInt node = fit->at[mesh->node[mesh->start[c] + shape->face[side[k].side][a]]];

      for (PetscInt i = 0; i < dim && node >= 0; i++) { /* (sigma n)_i as a vector in stress space */
        PetscReal v[COUPLING_VOIGT] = {0};

        v[i] = normal[i];
        if (dim == 2) v[2] = normal[1 - i] / PetscSqrtReal(2);
        else {
          v[3 + i]           = normal[(i + 1) % 3] / PetscSqrtReal(2);
          v[3 + (i + 2) % 3] = normal[(i + 2) % 3] / PetscSqrtReal(2);
        }
        LeaveOut(ns, fit->P + node * ns * ns, v);
      }
    }
  }
  PetscCall(PetscFree(side));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each node's residuals over the unit stresses, projected in place. */
static void Project(const Fit *fit, PetscReal *r)
{
  const PetscInt ns = fit->model->ns, dim = fit->model->dim;

  for (PetscInt i = 0; i < fit->n_nodes; i++)
    for (PetscInt d = 0; d < dim; d++) {
      PetscReal v[COUPLING_VOIGT];

      for (PetscInt k = 0; k < ns; k++) v[k] = r[(k * fit->n_nodes + i) * dim + d];
      for (PetscInt k = 0; k < ns; k++) {
        PetscReal sum = 0;

        for (PetscInt j = 0; j < ns; j++) sum += fit->P[(i * ns + k) * ns + j] * v[j];
        r[(k * fit->n_nodes + i) * dim + d] = sum;
      }
    }
}

/* Largest |residual| over nodes and states, over stress x a mean facet of the elements. */
static PetscReal Worst(const Fit *fit, const PetscReal *r, PetscReal area)
{
  const PetscInt dim = fit->model->dim;
  PetscReal      worst = 0;

  for (PetscInt i = 0; i < fit->model->ns * fit->n_nodes; i++) {
    PetscReal norm = 0;

    for (PetscInt d = 0; d < dim; d++) norm += PetscSqr(r[i * dim + d]);
    worst = PetscMax(worst, PetscSqrtReal(norm));
  }
  return worst / (fit->scale * area);
}

/* Smallest eigenvalue-like measure of D = alpha C + X: its least diagonal ratio to C after symmetric scaling, by Cholesky pivots. */
static PetscReal LeastShare(PetscInt ns, PetscReal C[COUPLING_VOIGT][COUPLING_VOIGT], const PetscReal *D)
{
  PetscReal low = 0, high = 1;

  for (int it = 0; it < 40; it++) { /* largest s with D - s C positive, by bisection on Cholesky */
    const PetscReal s = 0.5 * (low + high);
    PetscReal       L[COUPLING_VOIGT][COUPLING_VOIGT];
    PetscBool       positive = PETSC_TRUE;

    for (PetscInt i = 0; i < ns && positive; i++)
      for (PetscInt j = 0; j <= i; j++) {
        PetscReal v = D[i * ns + j] - s * C[i][j];

        for (PetscInt k = 0; k < j; k++) v -= L[i][k] * L[j][k];
        if (i == j) {
          if (v <= 0) {
            positive = PETSC_FALSE;
            break;
          }
          L[i][i] = PetscSqrtReal(v);
        } else L[i][j] = v / L[j][j];
      }
    if (positive) low = s;
    else high = s;
  }
  return low;
}

/* Share at integration point g beyond the element's mean. A quadratic element feels it: it can strain more where it has less. */
static PetscReal Beyond(CouplingModel model, PetscInt top, PetscInt g)
{
  const Mesh     *mesh = CouplingMesh(model);
  const PetscInt  c = model->top[top], first = mesh->start[c], n = mesh->start[c + 1] - first;
  const FemShape *shape = FemShapeGet(mesh->type[c]);
  CouplingPoint   at;

  if (shape->linear == shape->type) return 0;
  at.n = n;
  for (PetscInt a = 0; a < n; a++) {
    at.node[a] = mesh->node[first + a];
    at.N[a]    = shape->N[g][a];
  }
  return CouplingWeight_Internal(model, &at) - model->alpha[top];
}

PetscErrorCode CouplingFit_Internal(CouplingModel model)
{
  const Mesh    *mesh = CouplingMesh(model);
  const PetscInt dim = model->dim, ns = model->ns;
  Fit            fit = {.model = model, .scale = model->lambda + 2 * model->mu};
  PetscReal      C[COUPLING_VOIGT][COUPLING_VOIGT], *r, *X, *p, *z, *q, area = 0, zz, volume = 0;
  PetscInt       rows, unknowns;
  PetscBool     *mine;

  PetscFunctionBegin;
  Elastic(model, C);
  for (PetscInt e = 0; e < model->n_overlap; e++) model->width = PetscMax(model->width, dim * (mesh->start[model->top[model->overlap[e]] + 1] - mesh->start[model->top[model->overlap[e]]]));
  PetscCall(PetscCalloc2(model->n_overlap * model->width * model->width, &model->K, model->n_overlap * FEM_MAX_POINTS * 36, &model->X));
  model->report.least_weight = 1;
  PetscCall(PetscMalloc2(mesh->n_nodes, &fit.at, model->n_top, &mine));
  for (PetscInt i = 0; i < mesh->n_nodes; i++) fit.at[i] = -1;
  for (PetscInt t = 0; t < model->n_top; t++) mine[t] = PETSC_FALSE;
  for (PetscInt e = 0; e < model->n_overlap; e++) {
    const PetscInt c = model->top[model->overlap[e]];

    mine[model->overlap[e]] = PETSC_TRUE;
    fit.n_points += FemShapeGet(mesh->type[c])->points;
    for (PetscInt k = mesh->start[c]; k < mesh->start[c + 1]; k++)
      if (fit.at[mesh->node[k]] < 0) fit.at[mesh->node[k]] = fit.n_nodes++;
  }
  PetscCall(PetscCalloc1(fit.n_points, &fit.point));
  rows     = ns * fit.n_nodes * dim;
  unknowns = fit.n_points * ns * ns;
  PetscCall(PetscCalloc5(rows, &r, rows, &q, unknowns, &X, unknowns, &p, unknowns, &z));

  /* strains of the unit stresses, shears as sqrt 2 times the tensor component so that rotating them keeps their length */
  for (PetscInt k = 0; k < ns; k++) {
    const PetscReal kappa = model->lambda / (2 * model->mu * (dim * model->lambda + 2 * model->mu));

    if (k < dim)
      for (PetscInt i = 0; i < dim; i++) fit.state[k][i] = fit.scale * ((i == k ? 1 / (2 * model->mu) : 0) - kappa);
    else fit.state[k][k] = fit.scale / (model->mu * PetscSqrtReal(2));
  }
  PetscCall(Admissible(model, &fit));

  /* r = what is left on the nodes in each state: coupling and rim less the elements */
  for (PetscInt k = 0; k < model->n_particles; k++) {
    const CouplingParticle *particle = &model->particle[k];

    for (PetscInt s = 0; s < ns; s++) {
      PetscReal f[3] = {0}, t[3] = {0};

      for (PetscInt d = 0; d < 3; d++)
        for (PetscInt j = 0; j < ns; j++) {
          f[d] += particle->F[d][j] * fit.state[s][j];
          t[d] += particle->M[d][j] * fit.state[s][j];
        }
      for (PetscInt a = 0; a < particle->at.n; a++) {
        const PetscReal *g = particle->at.dN[a];
        PetscReal       *out = r + (s * fit.n_nodes + fit.at[particle->at.node[a]]) * dim;

        for (PetscInt d = 0; d < dim; d++) out[d] += particle->at.N[a] * f[d] + 0.5 * (t[(d + 1) % 3] * g[(d + 2) % 3] - t[(d + 2) % 3] * g[(d + 1) % 3]);
      }
    }
  }
  for (PetscInt k = 0; k < model->n_edge; k++) /* the rim pulls on the nodes what it pushes on its particle */
    for (PetscInt s = 0; s < ns; s++) {
      PetscReal trace = 0;

      for (PetscInt i = 0; i < dim; i++) trace += fit.state[s][i];
      for (PetscInt a = 0; a < model->edge[k].n; a++)
        for (PetscInt d = 0; d < dim; d++) r[(s * fit.n_nodes + fit.at[model->edge[k].node[a]]) * dim + d] -= model->edge[k].N[a] * model->lambda * trace * model->edge_pull[3 * k + d];
    }
  PetscInt point = 0;
  for (PetscInt t = 0; t < model->n_top; t++) {
    const PetscInt  c = model->top[t], first = mesh->start[c], n = mesh->start[c + 1] - first;
    const FemShape *shape = FemShapeGet(mesh->type[c]);
    PetscReal       x[FEM_MAX_DOFS], dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS];
    PetscBool       touches = PETSC_FALSE;

    for (PetscInt a = 0; a < n; a++) touches = (PetscBool)(touches || fit.at[mesh->node[first + a]] >= 0);
    if (!touches) continue;
    for (PetscInt a = 0; a < n; a++)
      for (PetscInt d = 0; d < dim; d++) x[a * dim + d] = mesh->x[3 * mesh->node[first + a] + d];
    (void)FemGradients(shape, x, model->thickness, dN, w);
    for (PetscInt g = 0; g < shape->points; g++) {
      for (PetscInt s = 0; s < ns; s++) {
        PetscReal stress[COUPLING_VOIGT] = {0};

        for (PetscInt i = 0; i < ns; i++)
          for (PetscInt j = 0; j < ns; j++) stress[i] += C[i][j] * fit.state[s][j];
        for (PetscInt a = 0; a < n; a++) {
          const PetscInt node = fit.at[mesh->node[first + a]];
          PetscReal      grad[3] = {0};

          if (node < 0) continue;
          for (PetscInt d = 0; d < dim; d++) grad[d] = dN[(g * n + a) * dim + d];
          CouplingNodeForce(dim, grad, stress, -w[g] * (model->alpha[t] + (mine[t] ? Beyond(model, t, g) : 0)), r + (s * fit.n_nodes + node) * dim);
        }
      }
      if (!mine[t]) continue;
      fit.point[point].n    = n;
      fit.point[point].node = mesh->node + first;
      fit.point[point].w    = w[g];
      for (PetscInt a = 0; a < n; a++)
        for (PetscInt d = 0; d < dim; d++) fit.point[point].dN[a][d] = dN[(g * n + a) * dim + d];
      volume += w[g];
      point++;
    }
  }
  Project(&fit, r);
  area = PetscPowReal(volume / model->thickness / model->n_overlap, (PetscReal)(dim - 1) / dim) * model->thickness;
  model->report.residual_before = Worst(&fit, r, area);

  if (model->options.affine) {
    PetscReal target;

    for (PetscInt i = 0; i < rows; i++) r[i] /= fit.scale;
    Transpose(&fit, r, z);
    PetscCall(PetscArraycpy(p, z, unknowns));
    zz     = Dot(unknowns, z, z);
    target = 1e-20 * zz;
    for (PetscInt it = 0; it < ROUNDS && zz > target; it++) { /* r - A X shrinks */
      PetscReal a, old = zz;

      PetscCall(PetscArrayzero(q, rows));
      Product(&fit, p, q);
      Project(&fit, q);
      a = zz / Dot(rows, q, q);
      for (PetscInt i = 0; i < unknowns; i++) X[i] += a * p[i];
      for (PetscInt i = 0; i < rows; i++) r[i] -= a * q[i];
      Transpose(&fit, r, z);
      zz = Dot(unknowns, z, z);
      for (PetscInt i = 0; i < unknowns; i++) p[i] = z[i] + zz / old * p[i];
    }
    for (PetscInt i = 0; i < rows; i++) r[i] *= fit.scale;
  }
  model->report.residual = Worst(&fit, r, area);

  point = 0;
  for (PetscInt e = 0; e < model->n_overlap; e++) {
    const PetscInt c = model->top[model->overlap[e]], n = mesh->start[c + 1] - mesh->start[c], points = FemShapeGet(mesh->type[c])->points;
    PetscReal     *K = model->K + (size_t)e * model->width * model->width;

    for (PetscInt g = 0; g < points; g++, point++) {
      PetscReal *D = model->X + (e * FEM_MAX_POINTS + g) * 36, whole[36];

      for (PetscInt i = 0; i < ns * ns; i++) D[i] = fit.scale * X[point * ns * ns + i] + Beyond(model, model->overlap[e], g) * C[i / ns][i % ns];
      for (PetscInt i = 0; i < ns; i++)
        for (PetscInt j = 0; j < ns; j++) whole[i * ns + j] = D[i * ns + j] + model->alpha[model->overlap[e]] * C[i][j];
      model->report.least_weight = PetscMin(model->report.least_weight, LeastShare(ns, C, whole));
      for (PetscInt b = 0; b < n; b++)
        for (PetscInt j = 0; j < dim; j++) { /* column: strain of a unit motion of node b along j */
          const PetscReal *d = fit.point[point].dN[b];
          PetscReal        strain[COUPLING_VOIGT] = {0}, stress[COUPLING_VOIGT] = {0};

          if (dim == 2) {
            strain[j] = d[j];
            strain[2] = d[1 - j];
          } else {
            strain[j]               = d[j];
            strain[3 + j]           = d[(j + 1) % 3];
            strain[3 + (j + 2) % 3] = d[(j + 2) % 3];
          }
          for (PetscInt i = 0; i < ns; i++)
            for (PetscInt k = 0; k < ns; k++) stress[i] += D[i * ns + k] * strain[k];
          for (PetscInt a = 0; a < n; a++) {
            PetscReal f[3] = {0};

            CouplingNodeForce(dim, fit.point[point].dN[a], stress, fit.point[point].w, f);
            for (PetscInt i = 0; i < dim; i++) K[(a * dim + i) * n * dim + b * dim + j] += f[i];
          }
        }
    }
  }
  PetscCall(PetscFree5(r, q, X, p, z));
  PetscCall(PetscFree(fit.point));
  PetscCall(PetscFree(fit.P));
  PetscCall(PetscFree2(fit.at, mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}
