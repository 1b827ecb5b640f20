/*
  dem_tool.c - surface particles against rigid planes.  Eqs (5.5)-(5.7), docs/theory.md

  Linear contact of stiffness E_c r, dashpot as a fraction of critical, Coulomb friction with a tangential spring of
  the same stiffness and slip by return mapping.
*/
#include "dem_impl.h"

static PetscReal ContactStiffness(DemModel model, const DemPlane *plane, PetscInt p)
{
  const PetscReal modulus = plane->stiffness > 0 ? plane->stiffness : model->material.young;

  return modulus * model->r[p] * (model->dim == 2 ? model->body.thickness / (2 * model->r[p]) : 1);
}

/* Distance of the sphere's surface from the plane; negative in contact [m] */
static PetscReal Gap(DemModel model, const DemTool *tool, PetscInt p)
{
  PetscReal gap = -model->r[p];

  for (PetscInt d = 0; d < model->dim; d++)
    gap += tool->plane.normal[d] * (model->x0[d * model->n + p] + model->u[d * model->n + p] - tool->plane.point[d] - tool->at[d]);
  return gap;
}

PetscErrorCode DemToolsForce_Internal(DemModel model, PetscReal dt)
{
  const PetscInt n = model->n;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_tools; k++) {
    DemTool         *tool = &model->tool[k];
    const DemPlane  *plane = &tool->plane;
    const PetscReal *e = plane->normal;
    PetscReal        tool_v[3] = {0}, total[3] = {0}, work = 0;

    for (PetscInt d = 0; d < model->dim; d++) tool_v[d] = (TableIntegral(&tool->velocity[d], model->time) - TableIntegral(&tool->velocity[d], model->time - dt)) / dt;
    for (PetscInt s = 0; s < model->n_surface; s++) {
      const PetscInt  p = model->surface[s];
      const PetscReal gap = Gap(model, tool, p), stiffness = ContactStiffness(model, plane, p), arm = model->r[p] + 0.5 * gap;
      PetscReal      *slip = tool->slip + 3 * s, v[3] = {0}, w[3] = {0}, t[3] = {0}, f[3] = {0}, vn = 0, fn, length = 0, most;

      if (gap >= 0) {
        slip[0] = slip[1] = slip[2] = 0;
        continue;
      }
      for (PetscInt d = 0; d < model->dim; d++) v[d] = model->v[d * n + p] - tool_v[d];
      if (model->dim == 2) w[2] = model->spin[p];
      else
        for (PetscInt d = 0; d < 3; d++) w[d] = model->spin[d * n + p];
      /* the contact point lies at -arm e from the centre */
      v[0] -= arm * (w[1] * e[2] - w[2] * e[1]);
      v[1] -= arm * (w[2] * e[0] - w[0] * e[2]);
      v[2] -= arm * (w[0] * e[1] - w[1] * e[0]);
      for (PetscInt d = 0; d < model->dim; d++) vn += v[d] * e[d];
      fn = -stiffness * gap;
      if (plane->damping > 0) {
        const PetscReal drag = PetscMin(2 * plane->damping * PetscSqrtReal(stiffness * model->mass[p]) * vn, fn); /* never pulls */

        fn -= drag;
        model->contact_lost += drag * vn * dt;
      }
      for (PetscInt d = 0; d < model->dim; d++) f[d] = fn * e[d];
      if (plane->friction > 0) {
        const PetscReal old = PetscSqrtReal(slip[0] * slip[0] + slip[1] * slip[1] + slip[2] * slip[2]);

        most = plane->friction * PetscMax(fn, 0);
        for (PetscInt d = 0; d < model->dim; d++) {
          t[d] = slip[d] + dt * (v[d] - vn * e[d]);
          length += t[d] * t[d];
        }
        length = PetscSqrtReal(length);
        if (stiffness * length > most) {
          const PetscReal keep = length > 0 ? most / (stiffness * length) : 0;

          model->friction_lost += 0.5 * (most + stiffness * old) * length * (1 - keep); /* trapezoid, as the work of the force is */
          for (PetscInt d = 0; d < 3; d++) t[d] *= keep;
        }
        for (PetscInt d = 0; d < model->dim; d++) {
          slip[d] = t[d];
          f[d] -= stiffness * t[d];
        }
      }
      for (PetscInt d = 0; d < model->dim; d++) {
        model->f[d * n + p] += f[d];
        total[d] -= f[d];
      }
      if (model->dim == 2) model->torque[p] -= arm * (e[0] * f[1] - e[1] * f[0]);
      else {
        model->torque[p] -= arm * (e[1] * f[2] - e[2] * f[1]);
        model->torque[n + p] -= arm * (e[2] * f[0] - e[0] * f[2]);
        model->torque[2 * n + p] -= arm * (e[0] * f[1] - e[1] * f[0]);
      }
    }
    for (PetscInt d = 0; d < model->dim; d++) work -= 0.5 * (total[d] + tool->force[d]) * tool_v[d] * dt;
    model->work += work;
    model->work_in += PetscAbsReal(work);
    for (PetscInt d = 0; d < 3; d++) tool->force[d] = total[d];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Energy stored in the contact springs [J] */
PetscReal DemToolsEnergy_Internal(DemModel model)
{
  PetscReal sum = 0;

  for (PetscInt k = 0; k < model->n_tools; k++)
    for (PetscInt s = 0; s < model->n_surface; s++) {
      const DemTool  *tool = &model->tool[k];
      const PetscInt  p = model->surface[s];
      const PetscReal gap = Gap(model, tool, p), *slip = tool->slip + 3 * s;

      if (gap < 0) sum += 0.5 * ContactStiffness(model, &tool->plane, p) * (gap * gap + slip[0] * slip[0] + slip[1] * slip[1] + slip[2] * slip[2]);
    }
  return sum;
}
