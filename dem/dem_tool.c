/*
  dem_tool.c - surface particles against the tools: contacts found, carried over from step to step, and their forces.

  A particle's contacts with a tool are matched to those of the step before by their normals, so friction goes on from one
  triangle to the next. Blocks of particles work on their own and are summed in order: the same bits for any number of
  threads. The law is dem_contact.h's.  Eqs (5.50)-(5.57), docs/theory.md
*/
#include "dem_tool_impl.h"
#include <omp.h>

#define SAME_CONTACT 0.8 /* cosine between the normals of one contact a step apart: 37 degrees */

typedef struct {
  PetscReal force[3], torque[3], friction, damping;
} Total;

PetscErrorCode DemModelAddTool(DemModel model, const char *name, DemToolOptions *options)
{
  DemTool **grown, *tool;

  PetscFunctionBegin;
  PetscCheck(!model->ready && model->dim, model->comm, PETSC_ERR_ORDER, "Tools are added between DemModelSetBody() and DemModelSetUp()");
  for (PetscInt k = 0; k < model->n_tools; k++) BaseCheckInput(strcmp(model->tool[k]->name, name), model->comm, "Two tools are named '%s'", name);
  PetscCall(PetscCalloc1(model->n_tools + 1, &grown));
  PetscCall(PetscArraycpy(grown, model->tool, model->n_tools));
  PetscCall(PetscFree(model->tool));
  model->tool = grown;
  PetscCall(PetscNew(&tool));
  model->tool[model->n_tools++] = tool;
  PetscCall(PetscStrncpy(tool->name, name, sizeof(tool->name)));
  tool->o = *options;
  PetscCall(PetscMemzero(&options->surface, sizeof(options->surface)));
  for (PetscInt d = 0; d < 3; d++) PetscCall(PetscMemzero(&tool->o.velocity[d], sizeof(Table)));
  PetscCall(PetscMemzero(&tool->o.speed, sizeof(Table)));
  PetscCall(PetscMemzero(&tool->o.force, sizeof(Table)));
  PetscCall(PetscMemzero(&tool->o.torque, sizeof(Table)));
  for (PetscInt d = 0; d < 3; d++)
    if (options->velocity[d].n) PetscCall(TableCopy(&options->velocity[d], &tool->o.velocity[d]));
  if (options->speed.n) PetscCall(TableCopy(&options->speed, &tool->o.speed));
  if (options->force.n) PetscCall(TableCopy(&options->force, &tool->o.force));
  else PetscCall(TableCreateConstant(0, &tool->o.force));
  if (options->torque.n) PetscCall(TableCopy(&options->torque, &tool->o.torque));
  else PetscCall(TableCreateConstant(0, &tool->o.torque));
  PetscCall(DemToolShapeSet_Internal(tool, model->dim));
  PetscCall(DemToolMotionSet_Internal(tool, model->dim, model->body.thickness));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelAddPlane(DemModel model, const char *name, const DemPlane *plane, const Table velocity[3])
{
  DemToolOptions o = {.shape = DEM_TOOL_PLANE, .damping = plane->damping};

  PetscFunctionBegin;
  for (PetscInt d = 0; d < 3; d++) {
    o.point[d]    = plane->point[d];
    o.axis[d]     = plane->normal[d];
    o.velocity[d] = velocity[d];
  }
  o.contact = (DemContactChoice){.law = DEM_CONTACT_LINEAR, .stiffness = plane->stiffness, .ratio = 1, .restitution = 1, .friction = plane->friction};
  PetscCall(DemModelAddTool(model, name, &o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt DemToolFind_Internal(DemModel model, const char *name)
{
  for (PetscInt k = 0; k < model->n_tools; k++)
    if (!strcmp(model->tool[k]->name, name)) return k;
  return -1;
}

PetscErrorCode DemToolsSetUp_Internal(DemModel model)
{
  const DemContactElastic rigid = {0, 0};
  const PetscInt          kinds = model->grain_of ? model->n_grain_kinds : model->weight_mass ? DEM_SHARE_KINDS : 1;
  PetscReal               largest = 0;

  PetscFunctionBegin;
  if (model->n_tools && !model->grain_of && model->weight_mass) {
    PetscCall(PetscMalloc1(model->n, &model->tool_share));
    for (PetscInt p = 0; p < model->n; p++) model->tool_share[p] = (unsigned char)DemShareKind_Internal(model, p);
  }
  for (PetscInt p = 0; p < model->n; p++) largest = PetscMax(largest, model->r[p]);
  for (PetscInt k = 0; k < model->n_tools; k++) {
    DemTool *tool = model->tool[k];

    BaseCheckInput(model->dim == 3 || tool->o.contact.law == DEM_CONTACT_LINEAR, model->comm, "Tool '%s': discs of a 2D model meet it by the linear law; Hertz's is for spheres", tool->name);
    PetscCall(PetscCalloc1(kinds, &tool->pair));
    for (PetscInt g = 0; g < kinds; g++) {
      const DemMaterial *m      = model->grain_of ? &model->grain_kind[g] : &model->material;
      const PetscReal    part   = model->grain_of ? 1 : PetscPowReal(0.5, g);
      DemContactPair    *pair   = &tool->pair[g];
      DemContactChoice   choice = tool->o.contact;

      choice.stiffness *= part;
      PetscCall(DemContactPairSet(pair, &choice, (DemContactElastic){part * m->young, m->poisson}, rigid));
      if (tool->o.damping > 0) {
        pair->zeta         = tool->o.damping;
        pair->drag         = 2 * tool->o.damping * (pair->hertz > 0 ? PetscSqrtReal(5.0 / 6) : 1);
        pair->drag_tangent = 0;
      }
      tool->turns = (PetscBool)(tool->turns || pair->roll > 0 || pair->twist > 0);
    }
    if (tool->o.shape == DEM_TOOL_SURFACE) PetscCall(DemSurfaceSetReach(&tool->o.surface, largest * (1 + 1e-9)));
    PetscCall(PetscCalloc3(model->blocks.n_blocks, &tool->contact, model->blocks.n_blocks, &tool->n_contacts, model->blocks.n_blocks, &tool->room));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemToolsDestroy_Internal(DemModel model)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_tools; k++) {
    DemTool *tool = model->tool[k];

    for (PetscInt d = 0; d < 3; d++) PetscCall(TableDestroy(&tool->o.velocity[d]));
    PetscCall(TableDestroy(&tool->o.speed));
    PetscCall(TableDestroy(&tool->o.force));
    PetscCall(TableDestroy(&tool->o.torque));
    PetscCall(DemSurfaceDestroy(&tool->o.surface));
    if (tool->contact)
      for (PetscInt b = 0; b < model->blocks.n_blocks; b++) PetscCall(PetscFree(tool->contact[b]));
    PetscCall(PetscFree3(tool->contact, tool->n_contacts, tool->room));
    PetscCall(PetscFree(tool->pair));
    PetscCall(PetscFree(model->tool[k]));
  }
  PetscCall(PetscFree(model->tool));
  PetscCall(PetscFree(model->tool_share));
  model->n_tools = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemToolReserve_Internal(DemTool *tool, PetscInt b, PetscInt n)
{
  PetscFunctionBegin;
  if (n > tool->room[b]) {
    PetscCall(PetscFree(tool->contact[b]));
    PetscCall(PetscMalloc1(2 * n, &tool->contact[b]));
    tool->room[b] = 2 * n;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Velocity of particle p relative to the tool at the point `arm` along -n from its centre; the arm of the tool's centre. */
static void Relative(DemModel model, const DemTool *tool, PetscInt p, const PetscReal x[3], PetscReal arm, const PetscReal n[3], PetscReal v[3], PetscReal spin[3], PetscReal from[3])
{
  const PetscInt m = model->n;
  PetscReal      w[3] = {0};

  if (model->dim == 2) w[2] = model->spin[p];
  else
    for (PetscInt d = 0; d < 3; d++) w[d] = model->spin[d * m + p];
  for (PetscInt d = 0; d < 3; d++) {
    from[d] = x[d] - arm * n[d] - tool->centre0[d] - tool->shift[d];
    spin[d] = w[d];
  }
  if (model->dim == 2) from[2] = 0;
  for (PetscInt d = 0; d < 3; d++) {
    const PetscInt i = (d + 1) % 3, j = (d + 2) % 3;

    v[d] = (d < model->dim ? model->v[d * m + p] - tool->velocity[d] : 0) - arm * (w[i] * n[j] - w[j] * n[i]) - (tool->spin[i] * from[j] - tool->spin[j] * from[i]);
  }
  if (model->dim == 2) v[2] = 0;
}

/* Radius of the contact of a sphere with a body of curvature c in one direction; what the spring is that times.  Eq. (5.56) */
static void Sizes(DemModel model, PetscInt p, PetscReal curvature, PetscReal *radius, PetscReal *size)
{
  const PetscReal r = model->r[p], closer = PetscMax(1 + r * curvature, 1e-3);

  if (model->dim == 2) {
    *radius = r / closer;
    *size   = 0.5 * model->body.thickness;
  } else *radius = *size = r / PetscSqrtReal(closer);
}

static void Part(DemModel model, const DemTool *tool, DemToolContact *c, PetscReal dt, Total *total)
{
  const PetscInt p = c->p;
  PetscReal      x[3], v[3], spin[3], from[3], friction, damping;

  for (PetscInt d = 0; d < 3; d++) x[d] = d < model->dim ? model->x0[d * model->n + p] + model->u[d * model->n + p] : 0;
  Relative(model, tool, p, x, model->r[p], c->n, v, spin, from);
  DemContactPart(DemToolPair(model, tool, c->p), v, c->radius, c->size, dt, tool->turns, &c->history, &friction, &damping);
  total->friction += friction;
  total->damping += damping;
}

/* Force of one touch into the particle and the total; c holds the history of the step before. */
static void Act(DemModel model, const DemTool *tool, const PetscReal x[3], const DemTouch *touch, PetscReal dt, DemToolContact *c, Total *total)
{
  const PetscInt   n = model->n, p = c->p;
  DemContactMotion m;
  DemContactForce  f;
  PetscReal        from[3], arm, moment[3];
  const PetscReal *e = m.n;

  for (PetscInt d = 0; d < 3; d++) m.n[d] = c->n[d] = touch->n[d];
  m.overlap = model->r[p] - touch->distance;
  arm       = model->r[p] - 0.5 * m.overlap;
  Relative(model, tool, p, x, arm, m.n, m.v, m.spin, from);
  m.turn = 0;
  for (PetscInt d = 0; d < 3; d++) {
    m.turn += 0.5 * (m.spin[d] + tool->spin[d]) * e[d];
    m.spin[d] -= tool->spin[d];
  }
  Sizes(model, p, touch->curvature, &m.radius, &m.size);
  m.mass    = tool->mass > 0 ? 1 / (1 / model->mass[p] + 1 / tool->mass) : model->mass[p];
  c->radius = m.radius;
  c->size   = m.size;
  if (tool->turns) DemContactStep(DemToolPair(model, tool, c->p), &m, dt, 1, &c->history, &f);
  else DemContactStep(DemToolPair(model, tool, c->p), &m, dt, 0, &c->history, &f);
  c->energy = DemContactEnergy(DemToolPair(model, tool, c->p), m.radius, m.size, m.overlap, &c->history);
  for (PetscInt d = 0; d < 3; d++) moment[d] = -arm * (e[(d + 1) % 3] * f.force[(d + 2) % 3] - e[(d + 2) % 3] * f.force[(d + 1) % 3]) + f.couple[d];
  for (PetscInt d = 0; d < 3; d++) {
    const PetscInt i = (d + 1) % 3, j = (d + 2) % 3;

    if (d < model->dim) model->f[d * n + p] += f.force[d];
    total->force[d] -= f.force[d];
    total->torque[d] -= from[i] * f.force[j] - from[j] * f.force[i] + f.couple[d];
  }
  if (model->dim == 2) model->torque[p] += moment[2];
  else
    for (PetscInt d = 0; d < 3; d++) model->torque[d * n + p] += moment[d];
  total->friction += f.friction;
  total->damping += f.damping;
}

/* Particles that may meet a tool, ascending: the surface; where particles meet each other, those the search asks for. */
static const PetscInt *Who(DemModel model, PetscInt *n)
{
  *n = model->contacts.on ? model->contacts.n_who : model->n_surface;
  return model->contacts.on ? model->contacts.who : model->surface;
}

/* First of them that is not below p. */
static PetscInt LowerBound(const PetscInt *who, PetscInt n, PetscInt p)
{
  PetscInt low = 0, high = n;

  while (low < high) {
    const PetscInt middle = (low + high) / 2;

    if (who[middle] < p) low = middle + 1;
    else high = middle;
  }
  return low;
}

/* Contacts of block b's surface particles with the tool; new ones go to `next`. Returns how many. */
static PetscInt BlockContacts(DemModel model, DemTool *tool, PetscInt b, PetscReal dt, DemToolContact *next, Total *total)
{
  PetscInt        n_who;
  const PetscInt *who = Who(model, &n_who), n = model->n, end = LowerBound(who, n_who, model->blocks.first[b + 1]), n_old = tool->n_contacts[b];
  DemToolContact *old = tool->contact[b];
  PetscInt        count = 0, at = 0;

  for (PetscInt s = LowerBound(who, n_who, model->blocks.first[b]); s < end; s++) {
    const PetscInt p    = who[s];
    PetscReal      x[3] = {0};
    DemTouch       touch[DEM_TOUCHES];
    PetscInt       m, first;
    PetscBool      taken[DEM_TOUCHES] = {PETSC_FALSE};

    for (PetscInt d = 0; d < model->dim; d++) x[d] = model->x0[d * n + p] + model->u[d * n + p];
    m = DemToolTouch_Internal(tool, model->dim, x, model->r[p], touch);
    for (; at < n_old && old[at].p < p; at++) Part(model, tool, &old[at], dt, total); /* it is no surface particle any more */
    first = at;
    while (at < n_old && old[at].p == p) at++;
    for (PetscInt k = 0; k < m; k++) {
      DemToolContact *c    = &next[count++];
      PetscReal       best = SAME_CONTACT;
      PetscInt        match = -1;

      PetscMemzero(c, sizeof(*c));
      for (PetscInt i = first; i < at; i++) {
        const PetscReal cosine = old[i].n[0] * touch[k].n[0] + old[i].n[1] * touch[k].n[1] + old[i].n[2] * touch[k].n[2];

        if (!taken[i - first] && cosine > best) {
          best  = cosine;
          match = i;
        }
      }
      if (match >= 0) {
        *c                   = old[match];
        taken[match - first] = PETSC_TRUE;
      }
      c->p = p;
      Act(model, tool, x, &touch[k], dt, c, total);
    }
    for (PetscInt i = first; i < at; i++)
      if (!taken[i - first]) Part(model, tool, &old[i], dt, total);
  }
  for (; at < n_old; at++) Part(model, tool, &old[at], dt, total);
  return count;
}

static PetscErrorCode ToolForce(DemModel model, DemTool *tool, PetscReal dt, DemToolContact **scratch, Total *part)
{
  const PetscInt n_blocks = model->blocks.n_blocks;
  PetscInt       failed   = 0;
  PetscReal      work = 0, given = 0;

  PetscFunctionBegin;
#pragma omp parallel for schedule(static) num_threads((int)model->threads) reduction(+ : failed)
  for (PetscInt b = 0; b < n_blocks; b++) {
    DemToolContact *next = scratch[omp_get_thread_num()];
    PetscInt        count;

    PetscMemzero(&part[b], sizeof(part[b]));
    count = BlockContacts(model, tool, b, dt, next, &part[b]);
    if (count > tool->room[b]) {
#pragma omp critical
      failed += DemToolReserve_Internal(tool, b, count) ? 1 : 0; /* rare: the list of a block has grown */
    }
    if (count <= tool->room[b]) PetscMemcpy(tool->contact[b], next, (size_t)count * sizeof(*next));
    tool->n_contacts[b] = count;
  }
  PetscCheck(!failed, model->comm, PETSC_ERR_MEM, "No memory for the contacts of tool '%s'", tool->name);
  for (PetscInt d = 0; d < 3; d++) tool->force[d] = tool->torque[d] = 0;
  for (PetscInt b = 0; b < n_blocks; b++) {
    for (PetscInt d = 0; d < 3; d++) {
      tool->force[d] += part[b].force[d];
      tool->torque[d] += part[b].torque[d];
    }
    model->friction_lost += part[b].friction;
    model->contact_lost += part[b].damping;
  }
  if (model->ranks) {
    PetscReal all[6];

    for (PetscInt d = 0; d < 3; d++) {
      all[d]     = tool->force[d];
      all[3 + d] = tool->torque[d];
    }
    PetscCall(DemSumRanks_Internal(model, 6, all));
    for (PetscInt d = 0; d < 3; d++) {
      tool->force[d]  = all[d];
      tool->torque[d] = all[3 + d];
    }
  }
  if (dt > 0) {
    for (PetscInt d = 0; d < 3; d++) {
      const PetscReal f = 0.5 * (tool->force[d] + tool->force_old[d]), t = 0.5 * (tool->torque[d] + tool->torque_old[d]);

      work -= f * tool->moved[d] + t * tool->turned[d];
      if (tool->o.motion == DEM_TOOL_PRESCRIBED) given -= f * tool->moved_given[d] + t * tool->turned_given * tool->o.turn_axis[d];
    }
    tool->work += work;
    model->work += given;
    model->work_in += PetscAbsReal(given);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemToolsForce_Internal(DemModel model, PetscReal dt)
{
  PetscFunctionBegin;
  if (!model->n_tools) PetscFunctionReturn(PETSC_SUCCESS);
  if (!model->tool_scratch) {
    PetscCall(PetscCalloc1(model->threads, &model->tool_scratch));
    for (PetscInt t = 0; t < model->threads; t++) PetscCall(PetscMalloc1(DEM_BLOCK * DEM_TOUCHES, (DemToolContact **)&model->tool_scratch[t]));
    PetscCall(PetscMalloc1(model->blocks.n_blocks, (Total **)&model->tool_total));
  }
  for (PetscInt k = 0; k < model->n_tools; k++) PetscCall(ToolForce(model, model->tool[k], dt, (DemToolContact **)model->tool_scratch, model->tool_total));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Energy stored in the contact springs [J] */
PetscReal DemToolsEnergy_Internal(DemModel model)
{
  PetscReal sum = 0;

  for (PetscInt k = 0; k < model->n_tools; k++)
    for (PetscInt b = 0; b < model->blocks.n_blocks; b++)
      for (PetscInt i = 0; i < model->tool[k]->n_contacts[b]; i++) sum += model->tool[k]->contact[b][i].energy;
  return sum;
}

/*
  A particle is held by at most two contacts in a line, by the tangential springs at its radius: 1/m + r^2/I. Overlap for
  Hertz: that of the particles' own contacts. A driven or free tool of mass M moves too, which adds to 1/m.
*/
PetscReal DemToolsRate_Internal(DemModel model, PetscReal *drag)
{
  const PetscReal deepest = model->contacts.on ? model->contacts.options.deepest : 0.01;
  PetscReal       rate = 0, damp = 0;

  for (PetscInt k = 0; k < model->n_tools; k++) {
    const DemTool        *tool = model->tool[k];
    const PetscReal       both = model->n_tools > 1 || tool->o.shape == DEM_TOOL_SURFACE || tool->o.inside ? 2 : 1;

    for (PetscInt p = 0; p < model->n; p++) {
      PetscReal       radius, size, S, share;
      const PetscReal light = DemClumpLight_Internal(model, p, &share), m = 1 / (1 / share + (tool->mass > 0 ? 1 / tool->mass : 0)), felt = 1 / (1 / model->mass[p] + (tool->mass > 0 ? 1 / tool->mass : 0));
      const PetscReal turn = light < model->mass[p] ? 1 : 1 + model->mass[p] * PetscSqr(model->r[p]) / model->inertia[p];

      const DemContactPair *pair = DemToolPair(model, tool, p);

      Sizes(model, p, 0, &radius, &size);
      S    = DemContactStiffness(pair, size, deepest * radius);
      rate = PetscMax(rate, both * S / m * PetscMax(1, pair->mu_static > 0 ? pair->ratio * turn : 0));
      damp = PetscMax(damp, both * PetscSqrtReal(S / m) * PetscSqrtReal(felt / m) * PetscMax(pair->drag, pair->mu_static > 0 ? pair->drag_tangent * turn : 0));
    }
  }
  *drag += damp;
  return rate;
}
