/*
  coupling_substep.c - how many particle steps fit in one step of the elements outside.  Eqs (6.10), (6.11)

  The overlap's elements, and some layers beyond, step with the particles; the rest acts in impulses every H = m dt. Impulses
  excite what vibrates with a multiple of pi/H, and particles do; but elements carry no wave that fast, so a layer of
  elements between takes most of it away, and a few layers all that matters. What is left is tried before the run: the linear
  system itself, from random velocities, must not grow.
*/
#include "coupling_impl.h"

#define LAYERS   3    /* beyond the overlap: a vibration faster than pi/H falls to 1/7.7 or less with each, section 6 */
#define MOST     10   /* automatic: beyond it the particles' own cost is all there is */
#define MARGIN   0.95 /* of the outer elements' critical step */
#define WINDOW   40   /* macro steps whose kinetic energy is averaged */
#define WINDOWS  10
#define GROWTH   2.   /* last over first: bounded beating stays below, 0.2 % a macro step does not */

/* Overlap and LAYERS rings of elements beyond it. outside: how many elements remain. */
static PetscErrorCode InnerCells(CouplingModel model, PetscBool *inner, PetscInt *outside)
{
  const Mesh *mesh = CouplingMesh(model);
  PetscBool  *touched;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(mesh->n_nodes, &touched));
  for (PetscInt t = 0; t < model->n_top; t++) inner[t] = model->split->layer[t] > 0 ? PETSC_TRUE : PETSC_FALSE;
  for (PetscInt ring = 0; ring < LAYERS; ring++) {
    for (PetscInt t = 0; t < model->n_top; t++)
      for (PetscInt k = mesh->start[model->top[t]]; inner[t] && k < mesh->start[model->top[t] + 1]; k++) touched[mesh->node[k]] = PETSC_TRUE;
    for (PetscInt t = 0; t < model->n_top; t++)
      for (PetscInt k = mesh->start[model->top[t]]; !inner[t] && k < mesh->start[model->top[t] + 1]; k++)
        if (touched[mesh->node[k]]) {
          inner[t] = PETSC_TRUE;
          break;
        }
  }
  *outside = 0;
  for (PetscInt t = 0; t < model->n_top; t++) *outside += !inner[t];
  PetscCall(PetscFree(touched));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Random(uint64_t *state)
{
  uint64_t z = (*state += 0x9e3779b97f4a7c15ULL);

  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  z ^= z >> 31;
  return (PetscReal)(z >> 11) / 9007199254740992.0 - 0.5;
}

/* Displacements and turns of a trial; velocities with them. */
typedef struct {
  PetscInt   n_dof, n;     /* of nodes; particles */
  PetscReal *U, *V, *slow, *fast, *mobility; /* [n_dof] */
  PetscReal *u, *v;        /* [6][n] displacement and turn */
  PetscReal *f, *f0;       /* [6][n], and at rest */
  PetscReal *g0;           /* [n_dof] */
} Trial;

/* Forces on particles (and the coupling's on nodes, model->g) in the trial's state. */
static PetscErrorCode TrialForces(CouplingModel model, Trial *trial)
{
  const PetscInt n = trial->n, dim = model->dim;
  FemState       fs;
  DemState       ds;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(DemModelGetState(model->dem, &ds));
  PetscCall(PetscArraycpy(fs.u, trial->U, trial->n_dof));
  PetscCall(PetscArraycpy(ds.u, trial->u, 3 * n));
  for (PetscInt p = 0; p < n; p++) {
    const PetscReal *turn = trial->u + 3 * n;

    if (dim == 2) {
      ds.rot[p]         = turn[p];
      ds.rot[n + p]     = -0.5 * turn[p] * turn[p];
      ds.rot[2 * n + p] = turn[p];
    } else {
      ds.rot[p] = 1;
      for (PetscInt d = 0; d < 3; d++) ds.rot[(1 + d) * n + p] = 0.5 * turn[d * n + p];
    }
  }
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscCall(DemModelRestoreState(model->dem, &ds));
  PetscCall(CouplingForces_Internal(model));
  PetscCall(DemModelComputeForces(model->dem));
  PetscCall(CouplingRimForces_Internal(model));
  PetscCall(DemModelGetState(model->dem, &ds));
  PetscCall(PetscArraycpy(trial->f, ds.f, 3 * n));
  PetscCall(PetscArraycpy(trial->f + 3 * n, ds.torque, (dim == 3 ? 3 : 1) * n));
  PetscCall(DemModelRestoreState(model->dem, &ds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Kinetic energy over that of the start, averaged over the last window and over the first. */
static PetscErrorCode TrialRun(CouplingModel model, Trial *trial, PetscInt m, PetscReal dt, PetscReal *growth)
{
  const PetscInt n = trial->n, dim = model->dim, turns = dim == 3 ? 3 : 1;
  DemState       ds;
  PetscReal      first = 0, window = 0;
  uint64_t       seed = 20;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(trial->U, trial->n_dof));
  PetscCall(PetscArrayzero(trial->u, 6 * n));
  PetscCall(TrialForces(model, trial));
  PetscCall(PetscArraycpy(trial->f0, trial->f, 6 * n));
  PetscCall(PetscArraycpy(trial->g0, model->g, trial->n_dof));
  PetscCall(DemModelGetState(model->dem, &ds));
  PetscCall(FemModelSubForces(model->fem, m * dt, trial->U, trial->slow, trial->fast, trial->mobility));
  for (PetscInt k = 0; k < trial->n_dof; k++) trial->V[k] = trial->mobility[k] > 0 ? 1e-8 * model->speed * Random(&seed) : 0;
  for (PetscInt k = 0; k < 6 * n; k++) trial->v[k] = k < dim * n ? 1e-8 * model->speed * Random(&seed) : 0;
  *growth = 1;
  for (PetscInt step = 0; step < WINDOW * WINDOWS; step++) {
    PetscReal kinetic = 0;

    for (PetscInt k = 0; k < m; k++) {
      PetscCall(FemModelSubForces(model->fem, m * dt, trial->U, trial->slow, trial->fast, trial->mobility));
      PetscCall(TrialForces(model, trial));
      for (PetscInt i = 0; i < trial->n_dof; i++) {
        trial->V[i] += trial->mobility[i] * dt * (trial->fast[i] + model->g[i] - trial->g0[i] + (k == 0 ? m * trial->slow[i] : 0));
        trial->U[i] += dt * trial->V[i];
      }
      for (PetscInt i = 0; i < dim * n; i++) trial->v[i] += dt / ds.mass[i % n] * (trial->f[i] - trial->f0[i]);
      for (PetscInt i = 3 * n; i < (3 + turns) * n; i++) trial->v[i] += dt / ds.inertia[i % n] * (trial->f[i] - trial->f0[i]);
      for (PetscInt i = 0; i < 6 * n; i++) trial->u[i] += dt * trial->v[i];
    }
    for (PetscInt i = 0; i < trial->n_dof; i++)
      if (trial->mobility[i] > 0) kinetic += trial->V[i] * trial->V[i] / trial->mobility[i];
    for (PetscInt i = 0; i < 3 * n; i++) kinetic += ds.mass[i % n] * trial->v[i] * trial->v[i];
    for (PetscInt i = 3 * n; i < 6 * n; i++) kinetic += ds.inertia[i % n] * trial->v[i] * trial->v[i];
    window += kinetic;
    if (step % WINDOW == WINDOW - 1) {
      if (first == 0) first = window;
      *growth = window / first;
      window  = 0;
      if (!(*growth < 100 * GROWTH)) break;
    }
    if (PetscIsInfOrNanReal(kinetic)) {
      *growth = PETSC_MAX_REAL;
      break;
    }
  }
  PetscCall(DemModelRestoreState(model->dem, &ds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One m, at the step dt of the particles; both models come back as they were. */
static PetscErrorCode IsStable(CouplingModel model, PetscInt m, PetscReal dt, PetscBool *stable)
{
  FemState   fs;
  DemState   ds;
  Trial      trial = {0};
  PetscReal *kept, *kept_rot, growth = 0;
  const PetscReal before = model->dt;
  PetscReal *insitu = model->before;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(DemModelGetState(model->dem, &ds));
  trial.n_dof = fs.n_nodes * fs.dim;
  trial.n     = ds.n;
  PetscCall(PetscMalloc2(trial.n_dof + 3 * ds.n, &kept, 4 * ds.n, &kept_rot));
  PetscCall(PetscArraycpy(kept, fs.u, trial.n_dof));
  PetscCall(PetscArraycpy(kept + trial.n_dof, ds.u, 3 * ds.n));
  PetscCall(PetscArraycpy(kept_rot, ds.rot, 4 * ds.n));
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscCall(DemModelRestoreState(model->dem, &ds));
  PetscCall(PetscCalloc6(trial.n_dof, &trial.U, trial.n_dof, &trial.V, trial.n_dof, &trial.slow, trial.n_dof, &trial.fast, trial.n_dof, &trial.mobility, trial.n_dof, &trial.g0));
  PetscCall(PetscCalloc4(6 * trial.n, &trial.u, 6 * trial.n, &trial.v, 6 * trial.n, &trial.f, 6 * trial.n, &trial.f0));
  model->dt     = dt;
  model->before = NULL; /* of the linear system alone */
  PetscCall(TrialRun(model, &trial, m, dt, &growth));
  *stable = growth < GROWTH ? PETSC_TRUE : PETSC_FALSE;
  PetscCall(PetscFree6(trial.U, trial.V, trial.slow, trial.fast, trial.mobility, trial.g0));
  PetscCall(PetscFree4(trial.u, trial.v, trial.f, trial.f0));

  PetscCall(FemModelGetState(model->fem, &fs));
  PetscCall(DemModelGetState(model->dem, &ds));
  PetscCall(PetscArraycpy(fs.u, kept, fs.n_nodes * fs.dim));
  PetscCall(PetscArraycpy(ds.u, kept + fs.n_nodes * fs.dim, 3 * ds.n));
  PetscCall(PetscArraycpy(ds.rot, kept_rot, 4 * ds.n));
  PetscCall(FemModelRestoreState(model->fem, &fs));
  PetscCall(DemModelRestoreState(model->dem, &ds));
  PetscCall(PetscFree2(kept, kept_rot));
  model->before = insitu;
  PetscCall(CouplingForces_Internal(model)); /* outside forces and the rim's motion of the state that is back */
  PetscCall(DemModelComputeForces(model->dem));
  model->dt = before;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest m from `most` down that the trial lets pass; sets the elements apart for it. */
static PetscErrorCode Largest(CouplingModel model, const PetscBool *inner, PetscInt most, PetscReal dt, PetscInt *found)
{
  PetscBool stable = PETSC_FALSE;

  PetscFunctionBegin;
  for (*found = most; *found > 1; (*found)--) {
    PetscCall(FemModelSetInnerCells(model->fem, inner, *found, NULL));
    PetscCall(IsStable(model, *found, dt, &stable));
    if (stable) PetscFunctionReturn(PETSC_SUCCESS);
  }
  *found = 1;
  PetscCall(FemModelSetInnerCells(model->fem, inner, 1, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A run that goes on over a new split keeps its step: the most sub-steps that divide options.substeps and pass the trial

  With fewer of them the Stepper takes its step in as many parts. The particles' step is model->given.
*/
static PetscErrorCode KeepStep(CouplingModel model)
{
  const PetscInt whole = model->options.substeps;
  PetscReal      outer;
  PetscInt       outside;
  PetscBool     *inner, stable = PETSC_FALSE;

  PetscFunctionBegin;
  BaseCheckInput(model->given <= model->limit * (1 + 1e-12), model->comm, "After elements turned into particles the particles' step must be at most %.4g s, and the run's is %.4g s; give a smaller time.step or time.safety", (double)model->limit,
                 (double)model->given);
  if (whole <= 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(model->n_top, &inner));
  PetscCall(InnerCells(model, inner, &outside));
  if (outside > 0) PetscCall(FemModelSetInnerCells(model->fem, inner, 2, &outer));
  for (PetscInt m = whole; m > 1 && outside > 0 && !stable; m--) {
    if (whole % m || m * model->given > MARGIN * outer) continue;
    PetscCall(FemModelSetInnerCells(model->fem, inner, m, NULL));
    PetscCall(IsStable(model, m, model->given, &stable));
    if (stable) model->substeps = m;
  }
  if (!stable) PetscCall(FemModelSetInnerCells(model->fem, inner, 1, NULL));
  PetscCall(PetscFree(inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without sub-steps the trial still tells whether the overlap's energy has a minimum: too few particles to an element, and it has none. */
static PetscErrorCode CheckEnergy(CouplingModel model)
{
  PetscBool stable;

  PetscFunctionBegin;
  PetscCall(IsStable(model, 1, model->given > 0 ? model->given : model->limit, &stable));
  model->unstable = (PetscBool)!stable;
  if (model->given > 0) PetscFunctionReturn(PETSC_SUCCESS); /* of an event: whoever made the split may make another */
  BaseCheckInput(stable || model->options.method != COUPLING_PENALTY, model->comm, "Springs of penalty %.4g are too soft for the overlap's energy to have a minimum: a trial from small random velocities gains energy. Give a larger penalty, about 1, or use method: energy", (double)model->options.penalty);
  BaseCheckInput(stable, model->comm,
                 "The overlap of elements and particles has no stable energy: a trial from small random velocities gains energy. Give the overlap's elements about 4 particles to a side, 3 at least (between nodes, so quadratic ones twice as many): smaller particles, or larger elements there");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Springs of a given stiffness: 4/dt^2 = omega_0^2 + max P/c, since sum c |q|^2 is never above the kinetic norm.  Eq. (6.53) */
static PetscErrorCode PenaltyLimit(CouplingModel model, PetscReal sides)
{
  PetscReal most = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_particles; k++) most = PetscMax(most, model->particle[k].P / model->particle[k].c);
  model->limit = 2 / PetscSqrtReal(PetscSqr(2 / sides) + most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Choose(CouplingModel model)
{
  const PetscInt asked = model->options.substeps;
  PetscReal      fem, dem, outer, room, local;
  PetscInt       outside, found;
  PetscBool     *inner;

  PetscFunctionBegin;
  PetscCall(FemModelGetCriticalStep(model->fem, &fem));
  PetscCall(DemModelGetCriticalStep(model->dem, &dem));
  model->limit    = CouplingStepShare(&model->options) * PetscMin(fem, dem);
  if (model->options.method == COUPLING_PENALTY) PetscCall(PenaltyLimit(model, PetscMin(fem, dem)));
  model->substeps = 1;
  if (model->given > 0) {
    PetscCall(KeepStep(model));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  BaseCheckInput(asked >= 0, model->comm, "substeps: %" PetscInt_FMT " is no number of particle steps; give 1 or more, or auto", asked);
  PetscCall(FemModelGetLocalDamping(model->fem, &local));
  BaseCheckInput(asked <= 1 || local == 0, model->comm, "substeps: %" PetscInt_FMT " and local_damping %.4g do not go together: elements stepping in impulses are never without net force, which this damping would take for motion; use mass_damping, or 1", asked, (double)local);
  BaseCheckInput(asked <= 1 || !model->options.preload, model->comm, "substeps: %" PetscInt_FMT " and a static start do not go together: elements stepping in impulses swing about the state of rest (1e-4 of the load in a bar); use 1, or far_field: implicit", asked);
  if (asked == 1 || local > 0 || model->options.preload || model->options.method != COUPLING_ENERGY || model->options.absorber) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(model->n_top, &inner));
  PetscCall(InnerCells(model, inner, &outside));
  if (asked > 1) {
    BaseCheckInput(outside > 0, model->comm, "substeps: %" PetscInt_FMT " has no element to act on: all lie in the overlap or within %d layers of it; use 1", asked, LAYERS);
  } else if (outside == 0) {
    PetscCall(PetscFree(inner));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FemModelSetInnerCells(model->fem, inner, 2, &outer));
  room = MARGIN * outer / model->limit;
  if (asked > 1 && asked <= room) {
    PetscCall(Largest(model, inner, asked, model->limit, &found));
    BaseCheckInput(found == asked, model->comm, "substeps: %" PetscInt_FMT " resonates with the particles: energy grows in a trial from random velocities; %" PetscInt_FMT " is stable", asked, found);
  } else {
    PetscCall(Largest(model, inner, (PetscInt)PetscMin(MOST, room), model->limit, &found));
    BaseCheckInput(asked == 0, model->comm, "substeps: %" PetscInt_FMT " particle steps of %.4g s exceed what the elements outside the overlap allow, %.4g s; %" PetscInt_FMT " is stable", asked, (double)model->limit,
                   (double)(MARGIN * outer), found);
  }
  PetscCall(PetscFree(inner));
  model->substeps = found;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CouplingChooseSubsteps_Internal(CouplingModel model)
{
  PetscBool implicit;

  PetscFunctionBegin;
  PetscCall(CouplingChooseFar_Internal(model, &implicit));
  if (!implicit) PetscCall(Choose(model));
  if (model->substeps == 1 || implicit) PetscCall(CheckEnergy(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
