/*
  fem_thermal.c - stress without strain: in-situ stress, and temperature.  Eqs (2.76)-(2.80)

  Stress is C:(eps - alpha T 1) + s0. What does not depend on displacement is a sum of sources, each an affine field in x
  times a course in time: the in-situ stress (course 1) and every temperature entry (course its table). A source's nodal
  forces int B's and the energies between sources int s:C^-1:s are integrated once; a step then adds a few vectors.
  Heating does work on the body: the power of a source is dU/d(course), booked by the trapezoid, exact as U is quadratic.
*/
#include "fem_impl.h"

PetscErrorCode FemModelSetInitialStress(FemModel model, const char *group, const PetscReal base[6], const PetscReal slope[6], PetscInt axis, PetscReal level)
{
  FemInSitu entry = {.group = -1, .axis = axis, .level = level};

  PetscFunctionBegin;
  PetscCheck(model && model->has_mesh && !model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Initial stress is given between FemModelSetMesh() and FemModelSetUp()");
  BaseCheckInput(axis >= 0 && axis < model->dim, model->comm, "Initial stress varies along axis %d of %d", (int)axis, (int)model->dim);
  if (group[0]) {
    PetscCall(FemFindGroup(model, group, &entry.group));
    BaseCheckInput(model->group[entry.group].dim == model->dim, model->comm, "%s: group '%s' has dimension %d; initial stress fills a group of dimension %d", model->source, group, (int)model->group[entry.group].dim, (int)model->dim);
  }
  for (PetscInt k = 0; k < 6; k++) {
    BaseCheckInput(!PetscIsInfOrNanReal(base[k]) && !PetscIsInfOrNanReal(slope[k]), model->comm, "Initial stress must be finite");
    BaseCheckInput(model->dim == 3 || k < 4 || (base[k] == 0 && slope[k] == 0), model->comm, "A plane body has no initial shear stress out of its plane");
    BaseCheckInput(model->kind != FEM_PLANE_STRESS || k != 2 || (base[k] == 0 && slope[k] == 0), model->comm, "Plane stress has no stress across the plane, so no initial one");
    entry.base[k]  = base[k];
    entry.slope[k] = slope[k];
  }
  PetscCall(PetscRealloc(sizeof(FemInSitu) * (model->pre.n_insitu + 1), &model->pre.insitu));
  model->pre.insitu[model->pre.n_insitu++] = entry;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemModelSetExpansion(FemModel model, const char *group, PetscReal expansion)
{
  PetscInt g = -1;

  PetscFunctionBegin;
  PetscCheck(model && model->has_mesh && !model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Thermal expansion is given between FemModelSetMesh() and FemModelSetUp()");
  BaseCheckInput(!PetscIsInfOrNanReal(expansion), model->comm, "Thermal expansion must be finite");
  if (group[0]) PetscCall(FemFindGroup(model, group, &g));
  for (PetscInt r = 0; r < model->n_regions; r++)
    if (model->region[r].group == g) {
      model->region[r].expansion = expansion;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  SETERRQ(model->comm, PETSC_ERR_ORDER, "Group '%s' has no material yet; expansion belongs to one", group);
}

PetscErrorCode FemModelAddTemperature(FemModel model, const char *group, const PetscReal field[4], const Table *table)
{
  FemHeat entry = {.group = -1};

  PetscFunctionBegin;
  PetscCheck(model && model->has_mesh && !model->ready, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Temperature is given between FemModelSetMesh() and FemModelSetUp()");
  if (group[0]) {
    PetscCall(FemFindGroup(model, group, &entry.group));
    BaseCheckInput(model->group[entry.group].dim == model->dim, model->comm, "%s: group '%s' has dimension %d; a temperature fills a group of dimension %d", model->source, group, (int)model->group[entry.group].dim, (int)model->dim);
  }
  PetscCall(PetscArraycpy(entry.field, field, 4));
  PetscCall(TableCopy(table, &entry.table));
  PetscCall(PetscRealloc(sizeof(FemHeat) * (model->pre.n_heat + 1), &model->pre.heat));
  model->pre.heat[model->pre.n_heat++] = entry;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stress of a temperature rise of 1 K in a body that cannot move, -C alpha 1.  Eq. (2.77) */
static void StressPerKelvin(FemModel model, PetscInt region, PetscReal s[6])
{
  const FemMaterial *m = &model->region[region].material;
  const PetscReal    k = model->kind == FEM_PLANE_STRESS ? m->young / (1 - m->poisson) : m->young / (1 - 2 * m->poisson);

  if (model->law[region].general) { /* 3D: fem_thermal's set-up has refused it in the plane */
    const PetscReal e[6] = {-model->region[region].expansion, -model->region[region].expansion, -model->region[region].expansion, 0, 0, 0};

    FemStress(&model->law[region], 3, e, s);
    return;
  }
  for (PetscInt i = 0; i < 6; i++) s[i] = i < 2 || (i == 2 && model->kind != FEM_PLANE_STRESS) ? -k * model->region[region].expansion : 0;
}

/* Stress of source k per unit of its course at x, in element c. Source 0 is the in-situ stress. */
static void SourceStress(FemModel model, PetscInt k, PetscInt c, const PetscReal x[3], PetscReal s[6])
{
  const FemPre *pre = &model->pre;

  for (PetscInt i = 0; i < 6; i++) s[i] = 0;
  if (k == 0) {
    for (PetscInt j = 0; j < pre->n_insitu; j++) {
      const FemInSitu *e = &pre->insitu[j];

      if (e->group >= 0 && !pre->inside[j * model->n_cells + c]) continue;
      for (PetscInt i = 0; i < 6; i++) s[i] += e->base[i] + e->slope[i] * (x[e->axis] - e->level);
    }
  } else {
    const FemHeat  *e    = &pre->heat[k - 1];
    const PetscReal rise = e->field[0] + e->field[1] * x[0] + e->field[2] * x[1] + e->field[3] * x[2];

    if (e->group >= 0 && !pre->inside[(pre->n_insitu + k - 1) * model->n_cells + c]) return;
    StressPerKelvin(model, model->cell_material[c], s);
    for (PetscInt i = 0; i < 6; i++) s[i] *= rise;
  }
}

/* s:C^-1:t; shear counted twice. */
static PetscReal Complementary(FemModel model, PetscInt region, const PetscReal s[6], const PetscReal t[6])
{
  const FemMaterial *m = &model->region[region].material;
  const PetscReal trace = (s[0] + s[1] + s[2]) * (t[0] + t[1] + t[2]);
  PetscReal       dot = 0;

  if (model->law[region].general) {
    for (PetscInt i = 0; i < 6; i++)
      for (PetscInt j = 0; j < 6; j++) dot += s[i] * model->law[region].S[i][j] * t[j];
    return dot;
  }
  for (PetscInt i = 0; i < 6; i++) dot += (i < 3 ? 1 : 2) * s[i] * t[i];
  return ((1 + m->poisson) * dot - m->poisson * trace) / m->young;
}

static void PointPlace(FemModel model, PetscInt c, PetscInt q, PetscReal x[3])
{
  const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);

  for (PetscInt d = 0; d < 3; d++) x[d] = 0;
  for (PetscInt a = 0; a < shape->nodes; a++)
    for (PetscInt d = 0; d < model->dim; d++) x[d] += shape->N[q][a] * model->x[model->cell_node[model->cell_start[c] + a] * model->dim + d];
}

static PetscErrorCode MarkGroups(FemModel model)
{
  FemPre *pre = &model->pre;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1((size_t)(pre->n_insitu + pre->n_heat) * model->n_cells, &pre->inside));
  for (PetscInt j = 0; j < pre->n_insitu + pre->n_heat; j++) {
    const PetscInt g = j < pre->n_insitu ? pre->insitu[j].group : pre->heat[j - pre->n_insitu].group;

    for (PetscInt k = 0; g >= 0 && k < model->group[g].n_cells; k++) pre->inside[j * model->n_cells + model->group[g].cell[k]] = 1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void SumForce(FemModel model)
{
  FemPre        *pre = &model->pre;
  const PetscInt n   = model->n_own * model->dim;

  for (PetscInt i = 0; i < n; i++) {
    pre->force[i] = 0;
    for (PetscInt k = 0; k < pre->n; k++) pre->force[i] += pre->course[k] * pre->pattern[k * n + i];
  }
}

/* dU/d(course) at the present displacement and courses */
static PetscErrorCode Powers(FemModel model)
{
  FemPre        *pre = &model->pre;
  const PetscInt n   = model->n_own * model->dim;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < pre->n; k++) pre->power[k] = FemDot(model, model->u, &pre->pattern[k * n]);
  PetscCall(FemSum(model, pre->n, pre->power));
  for (PetscInt k = 0; k < pre->n; k++)
    for (PetscInt l = 0; l < pre->n; l++) pre->power[k] += pre->gram[k * pre->n + l] * pre->course[l];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FemSetUpPrestress(FemModel model)
{
  FemPre        *pre = &model->pre;
  const PetscInt dim = model->dim, n = model->n_own * dim;
  PetscBool      expands = PETSC_FALSE;

  PetscFunctionBegin;
  if (!pre->n_insitu && !pre->n_heat) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt r = 0; r < model->n_regions; r++) expands = (PetscBool)(expands || model->region[r].expansion != 0);
  BaseCheckInput(!pre->n_heat || expands, model->comm, "%s: a temperature is given, but no material has an expansion; add expansion: 1e-5 1/K to one, or take the temperature out", model->source);
  for (PetscInt r = 0; r < model->n_regions; r++)
    BaseCheckInput(model->dim == 3 || !model->law[r].general, model->comm, "%s: initial and thermal stress of an orthotropic plane body is not covered; make it a solid, or isotropic", model->source);
  pre->n = 1 + pre->n_heat;
  PetscCall(MarkGroups(model));
  PetscCall(PetscCalloc6(pre->n * n, &pre->pattern, pre->n * pre->n, &pre->gram, pre->n, &pre->course, pre->n, &pre->power, pre->n, &pre->course_old, pre->n, &pre->power_old));
  PetscCall(PetscCalloc1(n, &pre->force));
  for (PetscInt c = 0; c < model->n_cells; c++) {
    const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[c]);
    PetscReal       dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS];

    FemCellGeometry(model, c, dN, w);
    for (PetscInt q = 0; q < shape->points; q++) {
      PetscReal x[3];

      PointPlace(model, c, q, x);
      for (PetscInt k = 0; k < pre->n; k++) {
        PetscReal s[6], t[6];

        SourceStress(model, k, c, x, s);
        for (PetscInt l = 0; l <= k && model->own[c]; l++) {
          SourceStress(model, l, c, x, t);
          pre->gram[k * pre->n + l] += w[q] * Complementary(model, model->cell_material[c], s, t);
        }
        for (PetscInt a = 0; a < shape->nodes; a++) {
          const PetscInt   i = model->cell_node[model->cell_start[c] + a];
          const PetscReal *g = &dN[(q * shape->nodes + a) * dim];

          if (i >= model->n_own) continue;
          if (dim == 2) {
            pre->pattern[k * n + 2 * i] += w[q] * (s[0] * g[0] + s[3] * g[1]);
            pre->pattern[k * n + 2 * i + 1] += w[q] * (s[3] * g[0] + s[1] * g[1]);
          } else {
            pre->pattern[k * n + 3 * i] += w[q] * (s[0] * g[0] + s[3] * g[1] + s[5] * g[2]);
            pre->pattern[k * n + 3 * i + 1] += w[q] * (s[3] * g[0] + s[1] * g[1] + s[4] * g[2]);
            pre->pattern[k * n + 3 * i + 2] += w[q] * (s[5] * g[0] + s[4] * g[1] + s[2] * g[2]);
          }
        }
      }
    }
  }
  for (PetscInt k = 0; k < pre->n; k++)
    for (PetscInt l = 0; l < k; l++) pre->gram[l * pre->n + k] = pre->gram[k * pre->n + l];
  PetscCall(FemSum(model, pre->n * pre->n, pre->gram));
  pre->course[0] = 1;
  for (PetscInt k = 1; k < pre->n && model->method != FEM_STATIC; k++) pre->course[k] = TableValue(&pre->heat[k - 1].table, 0); /* static: the rise grows from nothing in the first step */
  SumForce(model);
  PetscCall(Powers(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void FemPrestressAdvance(FemModel model, PetscReal t)
{
  FemPre *pre = &model->pre;

  if (!pre->n_heat) return;
  for (PetscInt k = 0; k < pre->n; k++) {
    pre->course_old[k] = pre->course[k];
    pre->power_old[k]  = pre->power[k];
    if (k) pre->course[k] = TableValue(&pre->heat[k - 1].table, t);
  }
  SumForce(model);
}

void FemAddPrestress(FemModel model)
{
  for (PetscInt i = 0; i < model->n_own * model->dim && model->pre.n; i++) model->f_int[i] += model->pre.force[i];
}

PetscErrorCode FemHeatWork(FemModel model, PetscReal *work)
{
  FemPre *pre = &model->pre;

  PetscFunctionBegin;
  *work = 0;
  if (!pre->n_heat) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Powers(model));
  for (PetscInt k = 1; k < pre->n; k++) *work += 0.5 * (pre->power_old[k] + pre->power[k]) * (pre->course[k] - pre->course_old[k]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U - 1/2 u.f_int of this state: this rank's share.  Eq. (2.79) */
PetscReal FemPrestressEnergy(FemModel model)
{
  const FemPre *pre = &model->pre;
  PetscReal     sum = 0;

  if (!pre->n) return 0;
  sum = 0.5 * FemDot(model, model->u, pre->force);
  for (PetscInt k = 0; k < pre->n && model->rank == 0; k++)
    for (PetscInt l = 0; l < pre->n; l++) sum += 0.5 * pre->course[k] * pre->gram[k * pre->n + l] * pre->course[l];
  return sum;
}

void FemPrestressAtPlace(FemModel model, PetscInt cell, const PetscReal x[3], PetscReal s[6])
{
  const FemPre *pre = &model->pre;
  PetscReal     part[6];

  for (PetscInt i = 0; i < 6; i++) s[i] = 0;
  for (PetscInt k = 0; k < pre->n; k++) {
    SourceStress(model, k, cell, x, part);
    for (PetscInt i = 0; i < 6; i++) s[i] += pre->course[k] * part[i];
  }
}

void FemCellPrestressMean(FemModel model, PetscInt cell, PetscReal s[6])
{
  const FemShape *shape = FemShapeGet((MeshCellType)model->cell_type[cell]);
  PetscReal       dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], volume = 0, part[6], x[3];

  for (PetscInt i = 0; i < 6; i++) s[i] = 0;
  if (!model->pre.n) return;
  FemCellGeometry(model, cell, dN, w);
  for (PetscInt q = 0; q < shape->points; q++) {
    PointPlace(model, cell, q, x);
    FemPrestressAtPlace(model, cell, x, part);
    volume += w[q];
    for (PetscInt i = 0; i < 6; i++) s[i] += w[q] * part[i];
  }
  for (PetscInt i = 0; i < 6; i++) s[i] /= volume;
}

void FemAddPrestressAt(FemModel model, PetscInt cell, const PetscReal x[3], PetscReal stress[6], PetscReal strain[6])
{
  const FemMaterial *m = &model->region[model->cell_material[cell]].material;
  PetscReal          s[6];

  if (!model->pre.n) return;
  FemPrestressAtPlace(model, cell, x, s);
  for (PetscInt i = 0; i < 6; i++) stress[i] += s[i];
  for (PetscInt k = 1; k < model->pre.n && model->kind == FEM_PLANE_STRESS; k++) {
    SourceStress(model, k, cell, x, s);
    strain[2] -= model->pre.course[k] * s[0] * (1 + m->poisson) / m->young; /* see FemCellThicker() */
  }
}

/* e_zz = -nu/(1 - nu) (e_xx + e_yy - 2 alpha T) + alpha T: the part of T, from its in-plane stress -E/(1 - nu) alpha T. */
PetscReal FemCellThicker(FemModel model, PetscInt cell)
{
  const FemShape    *shape = FemShapeGet((MeshCellType)model->cell_type[cell]);
  PetscReal          dN[FEM_MAX_POINTS * FEM_MAX_DOFS], w[FEM_MAX_POINTS], volume = 0, sum = 0, x[3], s[6];

  if (!model->pre.n_heat) return 0;
  FemCellGeometry(model, cell, dN, w);
  for (PetscInt q = 0; q < shape->points; q++) {
    PointPlace(model, cell, q, x);
    volume += w[q];
    for (PetscInt k = 1; k < model->pre.n; k++) {
      SourceStress(model, k, cell, x, s);
      sum += w[q] * model->pre.course[k] * s[0];
    }
  }
  return -sum / volume * (1 + model->region[model->cell_material[cell]].material.poisson) / model->region[model->cell_material[cell]].material.young;
}

PetscErrorCode FemPrestressDestroy(FemModel model)
{
  FemPre *pre = &model->pre;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < pre->n_heat; k++) PetscCall(TableDestroy(&pre->heat[k].table));
  PetscCall(PetscFree(pre->heat));
  PetscCall(PetscFree(pre->insitu));
  PetscCall(PetscFree(pre->inside));
  PetscCall(PetscFree6(pre->pattern, pre->gram, pre->course, pre->power, pre->course_old, pre->power_old));
  PetscCall(PetscFree(pre->force));
  PetscFunctionReturn(PETSC_SUCCESS);
}
