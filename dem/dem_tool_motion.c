/*
  dem_tool_motion.c - how a tool moves: by tables, driven along or about an axis, or free.  Eqs (5.56)-(5.66)

  Prescribed motion is exact: integrals of the tables. A driven motion is one particle with half-step velocity. A free body
  keeps its angular momentum in space, which only a couple changes, and turns by exact rotations about its principal axes
  in the order x y z y x with half, half, whole, half, half a step: second order, and the momentum is kept to rounding.
*/
#include "dem_tool_impl.h"
#include <petscblaslapack.h>

static PetscReal Dot(const PetscReal a[3], const PetscReal b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* c = a b, quaternions w x y z */
static void Product(const PetscReal a[4], const PetscReal b[4], PetscReal c[4])
{
  const PetscReal r[4] = {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2], a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
                          a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1]};

  for (PetscInt k = 0; k < 4; k++) c[k] = r[k];
}

static void AboutAxis(const PetscReal axis[3], PetscReal angle, PetscReal q[4])
{
  q[0] = PetscCosReal(0.5 * angle);
  for (PetscInt d = 0; d < 3; d++) q[1 + d] = PetscSinReal(0.5 * angle) * axis[d];
}

static void Matrix(const PetscReal q[4], PetscReal R[3][3])
{
  const PetscReal w = q[0], x = q[1], y = q[2], z = q[3];

  R[0][0] = 1 - 2 * (y * y + z * z);
  R[1][1] = 1 - 2 * (x * x + z * z);
  R[2][2] = 1 - 2 * (x * x + y * y);
  R[0][1] = 2 * (x * y - w * z);
  R[1][0] = 2 * (x * y + w * z);
  R[0][2] = 2 * (x * z + w * y);
  R[2][0] = 2 * (x * z - w * y);
  R[1][2] = 2 * (y * z - w * x);
  R[2][1] = 2 * (y * z + w * x);
}

static PetscErrorCode Unit(const char *name, const char *what, PetscReal a[3])
{
  const PetscReal length = PetscSqrtReal(Dot(a, a));

  PetscFunctionBegin;
  BaseCheckInput(length > 0 && !PetscIsInfOrNanReal(length), PETSC_COMM_SELF, "Tool '%s': the %s has no direction", name, what);
  for (PetscInt d = 0; d < 3; d++) a[d] /= length;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Principal moments and axes of a free body from its surface; its centre of mass becomes the centre. */
static PetscErrorCode FromSurface(DemTool *tool, PetscInt dim, PetscReal thickness)
{
  DemToolOptions *o = &tool->o;
  PetscReal       volume, inertia[3][3], work[16], a[9], moments[3];
  PetscBLASInt    three = 3, size = 16, info;

  PetscFunctionBegin;
  BaseCheckInput(o->shape == DEM_TOOL_SURFACE, PETSC_COMM_SELF, "Tool '%s': a density needs a closed surface; give mass and inertia instead", tool->name);
  BaseCheckInput(o->surface.closed, PETSC_COMM_SELF, "Tool '%s': the surface is not closed, so it has no volume for a density; give mass and inertia instead", tool->name);
  PetscCall(DemSurfaceMass(&o->surface, thickness, &volume, tool->centre0, inertia));
  tool->mass = o->density * volume;
  if (dim == 2) {
    tool->moments[2] = o->density * inertia[2][2];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt i = 0; i < 3; i++)
    for (PetscInt j = 0; j < 3; j++) a[3 * i + j] = o->density * inertia[i][j];
  PetscCallBLAS("LAPACKsyev", LAPACKsyev_("V", "U", &three, a, &three, moments, work, &size, &info));
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev failed (%d) on the inertia of tool '%s'", (int)info, tool->name);
  for (PetscInt k = 0; k < 3; k++) {
    tool->moments[k] = moments[k];
    for (PetscInt d = 0; d < 3; d++) tool->frame[d][k] = a[3 * k + d]; /* column-major: vector k */
  }
  for (PetscInt d = 0; d < 3; d++) { /* LAPACK's axes may be left-handed; TurnAbout() goes round them as right-handed ones */
    const PetscInt e = (d + 1) % 3, f = (d + 2) % 3;

    tool->frame[d][2] = tool->frame[e][0] * tool->frame[f][1] - tool->frame[f][0] * tool->frame[e][1];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemToolMotionSet_Internal(DemTool *tool, PetscInt dim, PetscReal thickness)
{
  DemToolOptions *o = &tool->o;

  PetscFunctionBegin;
  for (PetscInt d = 0; d < 3; d++) {
    tool->centre0[d] = o->shape == DEM_TOOL_SURFACE ? 0.5 * (o->surface.low[d] + o->surface.high[d]) : o->point[d];
    if (o->has_centre) tool->centre0[d] = o->centre[d];
    tool->frame[d][d] = 1;
  }
  tool->quaternion[0] = 1;
  Matrix(tool->quaternion, tool->turn);
  if (dim == 2) {
    o->turn_axis[0] = o->turn_axis[1] = 0;
    o->turn_axis[2]                   = 1;
  } else if (o->twisted || o->speed.n) PetscCall(Unit(tool->name, "axis of rotation", o->turn_axis));
  if (o->motion == DEM_TOOL_FREE) {
    BaseCheckInput(!o->pushed && !o->twisted && !o->speed.n && !o->velocity[0].n && !o->velocity[1].n && !o->velocity[2].n, PETSC_COMM_SELF, "Tool '%s' is free; it takes no prescribed motion and no drive", tool->name);
    tool->rotates = PETSC_TRUE;
    if (o->density > 0) PetscCall(FromSurface(tool, dim, thickness));
    else {
      tool->mass = o->mass;
      for (PetscInt d = 0; d < 3; d++) tool->moments[d] = o->moments[d];
    }
    BaseCheckInput(tool->mass > 0, PETSC_COMM_SELF, "Tool '%s': a free body needs a positive mass, not %.6g kg", tool->name, (double)tool->mass);
    for (PetscInt d = dim == 3 ? 0 : 2; d < 3; d++)
      BaseCheckInput(tool->moments[d] > 0, PETSC_COMM_SELF, "Tool '%s': a free body needs positive moments of inertia, not %.6g kg m2", tool->name, (double)tool->moments[d]);
    for (PetscInt d = 0; d < dim; d++) tool->v[d] = tool->velocity[d] = o->start_velocity[d];
    for (PetscInt i = 0; i < 3; i++) { /* L = A I A^T w */
      tool->spin[i] = dim == 3 || i == 2 ? o->start_spin[i] : 0;
      for (PetscInt k = 0; k < 3; k++) {
        PetscReal w = 0;

        for (PetscInt j = 0; j < 3; j++) w += tool->frame[j][k] * (dim == 3 || j == 2 ? o->start_spin[j] : 0);
        tool->L[i] += tool->frame[i][k] * tool->moments[k] * w;
      }
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  tool->rotates = (PetscBool)(o->twisted || o->speed.n);
  BaseCheckInput(!(o->twisted && o->speed.n), PETSC_COMM_SELF, "Tool '%s': a torque drives the rotation that a speed prescribes; keep one", tool->name);
  if (o->pushed) {
    if (dim == 2) o->push_axis[2] = 0;
    PetscCall(Unit(tool->name, "axis of the force", o->push_axis));
    BaseCheckInput(o->mass > 0, PETSC_COMM_SELF, "Tool '%s': driven by a force it needs a positive mass, not %.6g kg", tool->name, (double)o->mass);
    tool->mass = o->mass;
    for (PetscInt d = 0; d < 3; d++)
      BaseCheckInput(PetscAbsReal(o->push_axis[d]) < 1e-12 || !o->velocity[d].n, PETSC_COMM_SELF, "Tool '%s': the force drives it along %c, where a velocity is prescribed; keep one", tool->name, (char)('x' + d));
  }
  if (o->twisted) BaseCheckInput(o->inertia > 0, PETSC_COMM_SELF, "Tool '%s': driven by a torque it needs a positive moment of inertia, not %.6g kg m2", tool->name, (double)o->inertia);
  for (PetscInt d = 0; d < dim; d++) tool->velocity[d] = o->velocity[d].n ? TableRate(&o->velocity[d], 0) : 0;
  for (PetscInt d = 0; d < 3; d++) tool->spin[d] = o->speed.n ? TableRate(&o->speed, 0) * o->turn_axis[d] : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One rotation about body axis k of the principal frame: L in that frame turns back as the body turns on.  Eq. (5.64) */
static void TurnAbout(DemTool *tool, PetscInt k, PetscReal dt, PetscReal M[3])
{
  const PetscReal angle = dt * M[k] / tool->moments[k], c = PetscCosReal(angle), s = PetscSinReal(angle);
  const PetscInt  i = (k + 1) % 3, j = (k + 2) % 3;
  const PetscReal axis[3] = {tool->frame[0][k], tool->frame[1][k], tool->frame[2][k]}, mi = M[i];
  PetscReal       q[4];

  M[i] = c * mi + s * M[j];
  M[j] = c * M[j] - s * mi;
  AboutAxis(axis, angle, q);
  Product(tool->quaternion, q, tool->quaternion);
}

/* Angular momentum along the principal axes now. */
static void ToFrame(const DemTool *tool, const PetscReal L[3], PetscReal M[3])
{
  for (PetscInt k = 0; k < 3; k++) {
    M[k] = 0;
    for (PetscInt d = 0; d < 3; d++) {
      PetscReal axis = 0;

      for (PetscInt e = 0; e < 3; e++) axis += tool->turn[d][e] * tool->frame[e][k];
      M[k] += axis * L[d];
    }
  }
}

static void AdvanceFree(DemTool *tool, PetscInt dim, const PetscReal gravity[3], PetscReal kick, PetscReal dt)
{
  PetscReal old[4], M[3], norm = 0;

  for (PetscInt d = 0; d < dim; d++) {
    tool->v[d] += kick * (tool->force[d] / tool->mass + gravity[d]);
    tool->moved[d] = dt * tool->v[d];
  }
  for (PetscInt d = 0; d < 3; d++) tool->L[d] += kick * tool->torque[d];
  for (PetscInt k = 0; k < 4; k++) old[k] = tool->quaternion[k];
  if (dim == 2) {
    const PetscReal axis[3] = {0, 0, 1};

    tool->turned[2] = dt * tool->L[2] / tool->moments[2];
    tool->angle += tool->turned[2];
    AboutAxis(axis, tool->angle, tool->quaternion);
  } else {
    static const PetscInt order[5] = {0, 1, 2, 1, 0};

    ToFrame(tool, tool->L, M);
    for (PetscInt k = 0; k < 5; k++) TurnAbout(tool, order[k], order[k] == 2 ? dt : 0.5 * dt, M);
    for (PetscInt k = 0; k < 4; k++) norm += PetscSqr(tool->quaternion[k]);
    for (PetscInt k = 0; k < 4; k++) tool->quaternion[k] /= PetscSqrtReal(norm);
    {
      const PetscReal back[4] = {old[0], -old[1], -old[2], -old[3]};
      PetscReal       q[4], s, f;

      Product(tool->quaternion, back, q);
      s = PetscSqrtReal(PetscSqr(q[1]) + PetscSqr(q[2]) + PetscSqr(q[3]));
      f = s > 1e-14 ? 2 * PetscAtan2Real(s, q[0]) / s : 2;
      for (PetscInt d = 0; d < 3; d++) tool->turned[d] = f * q[1 + d];
    }
  }
}

static PetscErrorCode AdvancePrescribed(DemModel model, DemTool *tool, PetscReal t, PetscReal kick, PetscReal dt)
{
  const DemToolOptions *o = &tool->o;
  PetscReal             drive = 0, turn = 0;

  PetscFunctionBegin;
  tool->turned_given = 0;
  for (PetscInt d = 0; d < 3; d++) tool->moved_given[d] = tool->turned[d] = 0;
  for (PetscInt d = 0; d < model->dim; d++)
    if (o->velocity[d].n) tool->moved_given[d] = TableIntegral(&o->velocity[d], t + dt) - TableIntegral(&o->velocity[d], t);
  if (o->pushed) { /* Eq. (5.59) */
    tool->along_v += kick * ((TableValue(&o->force, t) + Dot(tool->force, o->push_axis)) / o->mass + Dot(model->gravity, o->push_axis));
    drive = dt * tool->along_v;
    tool->along += drive;
    model->work += 0.5 * drive * (TableValue(&o->force, t) + TableValue(&o->force, t + dt));
    model->work_in += PetscAbsReal(0.5 * drive * (TableValue(&o->force, t) + TableValue(&o->force, t + dt)));
  }
  for (PetscInt d = 0; d < model->dim; d++) tool->moved[d] = tool->moved_given[d] + drive * o->push_axis[d];
  if (o->twisted) {
    tool->angle_v += kick * (TableValue(&o->torque, t) + Dot(tool->torque, o->turn_axis)) / o->inertia;
    turn = dt * tool->angle_v;
    tool->angle += turn;
    model->work += 0.5 * turn * (TableValue(&o->torque, t) + TableValue(&o->torque, t + dt));
    model->work_in += PetscAbsReal(0.5 * turn * (TableValue(&o->torque, t) + TableValue(&o->torque, t + dt)));
  } else if (o->speed.n) {
    const PetscReal now = TableIntegral(&o->speed, t + dt);

    turn = tool->turned_given = now - TableIntegral(&o->speed, t);
    tool->angle               = now;
  }
  if (tool->rotates) {
    AboutAxis(o->turn_axis, tool->angle, tool->quaternion);
    for (PetscInt d = 0; d < 3; d++) tool->turned[d] = turn * o->turn_axis[d];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemToolsAdvance_Internal(DemModel model, PetscReal t, PetscReal kick, PetscReal dt)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_tools; k++) {
    DemTool *tool = model->tool[k];

    for (PetscInt d = 0; d < 3; d++) {
      tool->force_old[d]  = tool->force[d];
      tool->torque_old[d] = tool->torque[d];
    }
    if (tool->o.motion == DEM_TOOL_FREE) AdvanceFree(tool, model->dim, model->gravity, kick, dt);
    else PetscCall(AdvancePrescribed(model, tool, t, kick, dt));
    for (PetscInt d = 0; d < 3; d++) {
      /* a table's shift is its integral, not a sum of steps: no drift */
      if (tool->o.motion == DEM_TOOL_PRESCRIBED)
        tool->shift[d] = (d < model->dim && tool->o.velocity[d].n ? TableIntegral(&tool->o.velocity[d], t + dt) : 0) + tool->along * tool->o.push_axis[d];
      else tool->shift[d] += tool->moved[d];
      tool->velocity[d] = tool->moved[d] / dt;
      tool->spin[d]     = tool->turned[d] / dt;
    }
    if (tool->rotates) Matrix(tool->quaternion, tool->turn);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Matrix of the pose after the quaternion has been read. */
void DemToolPose_Internal(DemTool *tool)
{
  Matrix(tool->quaternion, tool->turn);
}

/* Kinetic energy of driven and free tools as in (1.5), and the work of gravity on them. */
void DemToolsKinetic_Internal(DemModel model, PetscReal *kinetic, PetscReal *gravity)
{
  const PetscReal dt = model->started ? model->dt_last : 0;

  for (PetscInt k = 0; k < model->n_tools; k++) {
    const DemTool        *tool = model->tool[k];
    const DemToolOptions *o = &tool->o;

    if (o->motion == DEM_TOOL_FREE) {
      PetscReal L[3], a[3], b[3];

      for (PetscInt d = 0; d < model->dim; d++) {
        *kinetic += 0.5 * tool->v[d] * (tool->mass * tool->v[d] + dt * (tool->force[d] + tool->mass * model->gravity[d]));
        *gravity += tool->mass * model->gravity[d] * tool->shift[d];
      }
      for (PetscInt d = 0; d < 3; d++) L[d] = tool->L[d] + dt * tool->torque[d];
      if (model->dim == 2) *kinetic += 0.5 * tool->L[2] * L[2] / tool->moments[2];
      else {
        ToFrame(tool, tool->L, a);
        ToFrame(tool, L, b);
        for (PetscInt d = 0; d < 3; d++) *kinetic += 0.5 * a[d] * b[d] / tool->moments[d];
      }
      continue;
    }
    if (o->pushed) {
      const PetscReal g = Dot(model->gravity, o->push_axis);

      *kinetic += 0.5 * tool->along_v * (o->mass * tool->along_v + dt * (TableValue(&o->force, model->time) + Dot(tool->force, o->push_axis) + o->mass * g));
      *gravity += o->mass * g * tool->along;
    }
    if (o->twisted) *kinetic += 0.5 * tool->angle_v * (o->inertia * tool->angle_v + dt * (TableValue(&o->torque, model->time) + Dot(tool->torque, o->turn_axis)));
  }
}
