/* An implicit far field beside explicit elements: what the face takes against its closed form, ledger, order, restart.  Eqs (6.20)-(6.28) */
#include "fem_case.h"
#include "fem_impl.h"
#include <unistd.h>

#define MOST 400

/* Plane box 12 x 2 of unit squares, those with x < 5 near. */
static PetscErrorCode Bar(PetscInt n, PetscInt m, PetscReal alpha, PetscBool fixed, const Table *load, Mesh *mesh, FemModel *model, Stepper *stepper, PetscReal *critical)
{
  const FemMaterial material  = {1, 1, 0.2};
  const PetscReal   length[3] = {12, 2, 0}, pull[3] = {1, 0, 0};
  const PetscInt    count[3]  = {12 * n, 2 * n, 1};
  PetscBool        *near;
  PetscReal         whole;
  PetscInt          top = 0;

  PetscFunctionBegin;
  PetscCall(CaseBox(PETSC_COMM_SELF, MESH_QUAD4, length, count, n == 1 ? 0.2 : 0, mesh));
  PetscCall(CaseModel(PETSC_COMM_SELF, mesh, FEM_PLANE_STRAIN, FEM_EXPLICIT, 1, &material, model));
  if (fixed) PetscCall(CaseFix(*model, "xmax", 0, 0));
  if (fixed) PetscCall(CaseFix(*model, "ymin", 1, 0)); /* dofs of the face among them */
  if (load) PetscCall(FemModelAddTraction(*model, "xmin", pull, load));
  PetscCall(FemModelAddHistory(*model, "reaction", "xmax"));
  PetscCall(FemModelSetDamping(*model, alpha));
  PetscCall(FemModelSetUp(*model));
  PetscCall(FemModelGetCriticalStep(*model, &whole));
  PetscCall(PetscMalloc1(mesh->n_cells, &near));
  for (PetscInt c = 0; c < mesh->n_cells; c++) {
    PetscReal x = 0;

    if (MeshCellDim(mesh->type[c]) != 2) continue;
    for (PetscInt a = mesh->start[c]; a < mesh->start[c + 1]; a++) x += mesh->x[3 * mesh->node[a]] / 4;
    near[top++] = x < 5 ? PETSC_TRUE : PETSC_FALSE;
  }
  if (m > 0) PetscCall(FemModelSetFar(*model, near, m, critical));
  else *critical = whole;
  PetscCall(PetscFree(near));
  PetscCall(FemModelGetStepper(*model, stepper));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Shake(FemModel model)
{
  FemState s;

  PetscFunctionBegin;
  PetscCall(FemModelGetState(model, &s));
  for (PetscInt k = 0; k < s.n_nodes * s.dim; k++) s.v[k] = 1e-3 * FemNoise(k + 7);
  PetscCall(FemModelRestoreState(model, &s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 1/2 a.A a + 1/2 v.K v of both sides, A = M - dt^2/4 K near and M far: what Newmark's steps keep when nothing acts on them.  Eq. (6.28) */
static PetscReal Pseudo(FemModel model, PetscReal dt)
{
  FemFar        *far = &model->far;
  const FemInner *in = &model->inner;
  const PetscInt n = model->n_own * model->dim, dim = model->dim;
  PetscReal      a[MOST] = {0}, v[MOST] = {0}, Kv[MOST], Ka[MOST], Kfar[MOST], sum = 0;

  for (PetscInt k = 0; k < n; k++) {
    if (in->place[k / dim] < 0) continue;
    v[k] = 0.5 * (model->v[k] + model->v_next[k]);
    a[k] = (model->v_next[k] - model->v[k]) / dt;
  }
  FemInnerTimes(model, v, Kv);
  FemInnerTimes(model, a, Ka);
  (void)FemApply(model, far->v, Kfar);
  for (PetscInt j = 0; j < in->n; j++)
    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt k = in->node[j] * dim + d, i = j * dim + d;

      sum += 0.5 * (far->near_mass[in->node[j]] * a[k] * a[k] - 0.25 * dt * dt * a[k] * Ka[i] + v[k] * Kv[i]);
    }
  for (PetscInt k = 0; k < n; k++) sum += 0.5 * (far->far_mass[k / dim] * far->a[k] * far->a[k] + far->v[k] * Kfar[k]);
  return sum;
}

static PetscReal Form(PetscInt n, const PetscReal *Y, const PetscReal *x)
{
  PetscReal sum = 0;

  for (PetscInt r = 0; r < n; r++)
    for (PetscInt c = 0; c < n; c++) sum += x[r] * Y[r * n + c] * x[c];
  return sum;
}

/* Random velocities, far past the far elements' own limit: what goes at the face in each step is the closed form, none at m = 1; velocities agree; the ledger closes. */
static PetscErrorCode TestLossIsItsClosedForm(void)
{
  PetscFunctionBeginUser;
  for (PetscInt m = 1; m <= 9; m += 4) {
    Mesh         mesh;
    FemModel     model;
    Stepper      s;
    FemFarReport report;
    Ledger       ledger;
    PetscReal    dt, all = 0, first = 0, begin = 0, gap = 0, speed = 0, worst = 0;

    PetscCall(Bar(1, m, 0, PETSC_TRUE, NULL, &mesh, &model, &s, &dt));
    dt *= 0.9;
    PetscCall(Shake(model));
    FemFar *far = &model->far;
    for (PetscInt step = 0; step < 300; step++) {
      PetscReal old[60], d[60], total[60] = {0}, squares = 0;

      CheckBelow(far->n_face, 60);
      for (PetscInt k = 0; k < m; k++) {
        PetscCall(FemModelFarStep(model, (step * m + k) * dt, dt, k));
        for (PetscInt c = 0; c < far->n_face; c++) {
          if (k > 0) total[c] += d[c] = far->lambda[c] - old[c];
          old[c] = far->lambda[c];
        }
        if (k > 0) squares += Form(far->n_face, far->Y, d);
      }
      PetscCall(FemModelGetFar(model, &report));
      for (PetscInt c = 0; c < far->n_face; c++) {
        const PetscInt k = far->face[c];

        total[c] += d[c] = far->lambda[c] - old[c];
        gap   = PetscMax(gap, PetscAbsReal(0.5 * (model->v[k] + model->v_next[k]) - far->v[k]));
        speed = PetscMax(speed, PetscAbsReal(far->v[k]));
      }
      squares += Form(far->n_face, far->Y, d);
      const PetscReal loss = (m * squares - Form(far->n_face, far->Y, total)) / (m * dt), now = Pseudo(model, dt);

      CheckAbove(loss, -1e-13 * now);
      if (step == 0) first = now;
      else CheckNear(now, all - loss, 1e-12 * first);
      all = now;
      PetscCall(s.energy(s.ctx, &ledger)); /* initial knows nothing of the shake */
      if (step == 0) begin = LedgerBalance(&ledger);
      worst = PetscMax(worst, PetscAbsReal(LedgerBalance(&ledger) / begin - 1));
    }
    print_message("           m = %d: pseudo-energy after 300 steps %.6f of the first, ledger off by %.1e, velocities of the copies by %.1e, their places by %.1e of %.1e\n", (int)m, (double)(all / first), (double)worst,
                  (double)(gap / speed), (double)report.apart, (double)(speed * m * dt));
    CheckBelow(gap, 1e-12 * speed);
    CheckBelow(worst, 1e-12);
    if (m == 1) CheckClose(all, first, 1e-12);
    else CheckBelow(all, 0.99 * first);
    CheckBelow(report.apart, speed * m * dt);
    PetscCall(FemModelDestroy(&model));
    PetscCall(MeshDestroy(&mesh));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestLossIsItsClosedForm)

/* Uniform motion stays uniform to round-off: the face feels none of it. */
static PetscErrorCode TestUniformMotion(void)
{
  Mesh      mesh;
  FemModel  model;
  Stepper   s;
  FemState  state;
  PetscReal dt;

  PetscFunctionBeginUser;
  PetscCall(Bar(1, 6, 0, PETSC_FALSE, NULL, &mesh, &model, &s, &dt));
  PetscCall(FemModelGetState(model, &state));
  for (PetscInt k = 0; k < state.n_nodes * 2; k++) state.v[k] = k % 2 ? -2 : 3;
  PetscCall(FemModelRestoreState(model, &state));
  for (PetscInt k = 0; k < 600; k++) PetscCall(FemModelFarStep(model, k * dt, dt, k % 6));
  FemFarReport report;

  PetscCall(FemModelGetFar(model, &report));
  for (PetscInt k = 0; k < model->n_own * 2; k++) CheckClose(model->u[k], (k % 2 ? -2 : 3) * 600 * dt, 1e-10);
  CheckNear(report.taken, 0, 1e-10);
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestUniformMotion)

/* A smooth push on the near end at a series of steps: where the far end of a bar is after the wave has passed the face. */
static PetscErrorCode Push(PetscInt m, PetscInt steps, PetscReal *u, PetscReal *loss)
{
  const PetscReal end = 12;
  PetscReal       t[81], v[81], dt = end / steps;
  Table           load;
  Mesh            mesh;
  FemModel        model;
  Stepper         s;
  Ledger          ledger;
  FemFarReport    report;
  PetscReal       critical;

  PetscFunctionBegin;
  for (PetscInt k = 0; k <= 80; k++) {
    t[k] = 0.1 * k;
    v[k] = PetscPowReal(PetscSinReal(PETSC_PI * k / 80), 4);
  }
  PetscCall(TableCreate(81, t, v, &load));
  PetscCall(Bar(1, m, 0, PETSC_TRUE, &load, &mesh, &model, &s, &critical));
  CheckBelow(dt, critical);
  for (PetscInt k = 0; k < steps; k++)
    if (m) PetscCall(FemModelFarStep(model, k * dt, dt, k % m));
    else PetscCall(s.step(s.ctx, k * dt, dt));
  PetscCall(s.energy(s.ctx, &ledger));
  PetscCall(FemModelGetFar(model, &report));
  PetscCall(PetscArraycpy(u, model->u, model->n_own * 2));
  *loss = m ? report.taken / ledger.energy[LEDGER_WORK] : 0;
  PetscCall(TableDestroy(&load));
  PetscCall(FemModelDestroy(&model));
  PetscCall(MeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TestOrderInTime(void)
{
  const PetscInt m[3] = {1, 2, 4};
  PetscReal      exact[MOST], u[MOST], loss, top = 0;

  PetscFunctionBeginUser;
  PetscCall(Push(0, 12800, exact, &loss));
  for (PetscInt k = 0; k < 78; k++) top = PetscMax(top, PetscAbsReal(exact[k]));
  for (PetscInt i = 0; i < 3; i++) {
    PetscReal error[4], slope = 0;

    for (PetscInt r = 0; r < 4; r++) {
      PetscCall(Push(m[i], 80 << r, u, &loss));
      error[r] = 0;
      for (PetscInt k = 0; k < 78; k++) error[r] = PetscMax(error[r], PetscAbsReal(u[k] - exact[k]) / top);
      print_message("           m = %d, H = %.4f: off by %.2e, the face took %.2e of the work\n", (int)m[i], (double)(m[i] * 12. / (80 << r)), (double)error[r], (double)loss);
    }
    slope = PetscLog2Real(error[1] / error[3]) / 2;
    print_message("           m = %d: order %.2f\n", (int)m[i], (double)slope);
    CheckAbove(slope, m[i] == 1 ? 1.95 : 1); /* the free velocity between its ends is a straight line: first order for m > 1 */
    CheckPositive(loss);
    CheckBelow(error[3], m[i] == 1 ? 2e-5 : 7e-4);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
CHECK_TEST(TestOrderInTime)

static const struct CMUnitTest tests[] = {TEST(TestLossIsItsClosedForm), TEST(TestUniformMotion), TEST(TestOrderInTime)};

CHECK_MAIN(tests)
