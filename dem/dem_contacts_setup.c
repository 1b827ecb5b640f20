/* dem_contacts_setup.c - contacts of a model: what the user chose, the table of materials, the step they allow. */
#include "dem_impl.h"

PetscErrorCode DemModelSetContact(DemModel model, const DemContactOptions *options)
{
  DemContacts *c = &model->contacts;

  PetscFunctionBegin;
  PetscCheck(!model->ready, model->comm, PETSC_ERR_ORDER, "Say how particles meet before DemModelSetUp()");
  c->on      = PETSC_TRUE;
  c->options = *options;
  if (c->options.skin == 0) c->options.skin = 0.3;
  if (c->options.deepest == 0) c->options.deepest = 0.01;
  BaseCheckInput(c->options.skin > 0, model->comm, "The skin of the neighbour list, %.6g mean radii, must be positive", (double)options->skin);
  BaseCheckInput(c->options.deepest > 0 && c->options.deepest < 1, model->comm, "The deepest overlap, %.6g of the radius, must lie between 0 and 1", (double)options->deepest);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetGrainMaterials(DemModel model, PetscInt n, const DemMaterial material[], const PetscInt of[])
{
  PetscFunctionBegin;
  PetscCheck(model->packing.n && !model->ready && !model->grain_of, model->comm, PETSC_ERR_ORDER, "Materials of grains are given once, between DemModelSetBody() and DemModelSetUp()");
  BaseCheckInput(!model->bonded, model->comm, "Bonded particles have one material");
  BaseCheckInput(n > 0 && n <= 255, model->comm, "%" PetscInt_FMT " materials of grains; between 1 and 255", n);
  PetscCall(PetscMalloc1(n, &model->grain_kind));
  PetscCall(PetscMalloc1(model->packing.n, &model->grain_of)); /* apart: ranks keep their part of it */
  model->n_grain_kinds = n;
  PetscCall(PetscArraycpy(model->grain_kind, material, n));
  for (PetscInt k = 0; k < model->packing.n; k++) {
    PetscCheck(of[k] >= 0 && of[k] < n, model->comm, PETSC_ERR_ARG_OUTOFRANGE, "Grain %" PetscInt_FMT " is of material %" PetscInt_FMT ", there are %" PetscInt_FMT, k, of[k], n);
    model->grain_of[k] = of[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetGrainVelocities(DemModel model, const PetscReal velocity[])
{
  PetscFunctionBegin;
  PetscCheck(model->grain_of && !model->ready && !model->grain_velocity, model->comm, PETSC_ERR_ORDER, "Velocities of grains are given once, after DemModelSetGrainMaterials()");
  PetscCall(PetscMalloc1(3 * model->n_grain_kinds, &model->grain_velocity));
  PetscCall(PetscArraycpy(model->grain_velocity, velocity, 3 * model->n_grain_kinds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelSetContactPair(DemModel model, PetscInt a, PetscInt b, const DemContactChoice *choice)
{
  PetscInt         *of;
  DemContactChoice *grown;

  PetscFunctionBegin;
  PetscCheck(!model->ready, model->comm, PETSC_ERR_ORDER, "Say how particles meet before DemModelSetUp()");
  PetscCall(PetscMalloc2(2 * (model->n_pair_choices + 1), &of, model->n_pair_choices + 1, &grown));
  PetscCall(PetscArraycpy(of, model->pair_of, 2 * model->n_pair_choices));
  PetscCall(PetscArraycpy(grown, model->pair_choice, model->n_pair_choices));
  PetscCall(PetscFree2(model->pair_of, model->pair_choice));
  of[2 * model->n_pair_choices]     = a;
  of[2 * model->n_pair_choices + 1] = b;
  grown[model->n_pair_choices++]    = *choice;
  model->pair_of                    = of;
  model->pair_choice                = grown;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemModelGetContactCounts(DemModel model, DemContactCounts *counts)
{
  const DemContacts *c = &model->contacts;
  PetscInt           sum[3] = {c->n_who, 0, c->touching};
  PetscReal          deepest = c->deepest;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < c->m; k++) sum[1] += c->p[k] < model->own;
  PetscCall(DemContactsAgree_Internal(model, 3, sum));
  if (model->ranks) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &deepest, 1, MPIU_REAL, MPI_MAX, model->comm));
  *counts = (DemContactCounts){.searches = c->searches, .searched = sum[0], .pairs = sum[1], .touching = sum[2], .left = DemGrainsGone_Internal(model) - (model->rain.rate > 0 ? DemGrains_Internal(model) - model->rain.next : 0), .deepest = deepest};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt DemShareKind_Internal(DemModel model, PetscInt p)
{
  PetscInt  kind = 0;
  PetscReal part = 1;

  while (kind < DEM_SHARE_KINDS - 1 && part > model->weight_mass[model->at[p]] * (1 + 1e-12)) {
    part *= 0.5;
    kind++;
  }
  return kind;
}

static PetscErrorCode PairTable(DemModel model)
{
  DemContacts    *c = &model->contacts;
  const PetscBool shares = (PetscBool)(model->weight_mass != NULL);
  const PetscInt  kinds = model->grain_of ? model->n_grain_kinds : shares ? DEM_SHARE_KINDS : 1;

  PetscFunctionBegin;
  c->n_kinds = kinds;
  PetscCall(PetscCalloc1(kinds * kinds, &c->table));
  for (PetscInt a = 0; a < kinds; a++)
    for (PetscInt b = 0; b < kinds; b++) {
      DemMaterial             ma = model->grain_of ? model->grain_kind[a] : model->material, mb = model->grain_of ? model->grain_kind[b] : model->material;
      const DemContactChoice *given = &c->options.choice;
      DemContactChoice        choice;

      for (PetscInt k = 0; k < model->n_pair_choices; k++)
        if ((model->pair_of[2 * k] == a && model->pair_of[2 * k + 1] == b) || (model->pair_of[2 * k] == b && model->pair_of[2 * k + 1] == a)) given = &model->pair_choice[k];
      choice = *given;
      if (!model->grain_of && shares) {
        const PetscReal part = PetscPowReal(0.5, PetscMax(a, b));

        choice.stiffness *= part;
        ma.young *= part;
        mb.young *= part;
      }
      BaseCheckInput(model->dim == 3 || choice.law == DEM_CONTACT_LINEAR, model->comm, "Hertz's law is of spheres; discs (dimension: 2) meet by the linear one");
      PetscCall(DemContactPairSet(&c->table[a * kinds + b], &choice, (DemContactElastic){ma.young, ma.poisson}, (DemContactElastic){mb.young, mb.poisson}));
      if (c->table[a * kinds + b].roll > 0 || c->table[a * kinds + b].twist > 0) c->turns = PETSC_TRUE;
    }
  if (kinds > 1) {
    PetscCall(PetscMalloc1(model->n, &c->kind));
    for (PetscInt p = 0; p < model->n; p++) c->kind[p] = (unsigned char)(model->grain_of ? model->grain_of[model->at[p]] : DemShareKind_Internal(model, p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemSetUpContacts_Internal(DemModel model)
{
  DemContacts   *c = &model->contacts;
  const PetscInt n = model->n;
  PetscReal      mean = 0, most = 0;

  PetscFunctionBegin;
  PetscCall(PairTable(model));
  for (PetscInt p = 0; p < n; p++) {
    mean += model->r[p] / (PetscReal)n;
    most = PetscMax(most, model->r[p]);
  }
  c->skin = c->options.skin * mean;
  c->flat = model->dim == 2 ? 0.25 * model->body.thickness : 0;
  if (c->options.domain == DEM_DOMAIN_PERIODIC)
    for (PetscInt d = 0; d < model->dim; d++) {
      const PetscReal L = c->options.high[d] - c->options.low[d];

      BaseCheckInput(L == 0 || L > 2 * (2 * most + c->skin), model->comm, "A period of %.6g m along %c is too short: it must pass twice the largest diameter and the skin, %.6g m", (double)L, (char)('x' + d),
                     (double)(2 * (2 * most + c->skin)));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemSetUpContactRoom_Internal(DemModel model)
{
  DemContacts   *c = &model->contacts;
  const PetscInt n = model->n, blocks = ((model->ranks ? model->ranks->particles : n) + DEM_CONTACT_BLOCK - 1) / DEM_CONTACT_BLOCK; /* of all ranks: few */

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n, &c->who, 3 * n, &c->ref));
  PetscCall(PetscCalloc6(blocks + 1, &c->pair, blocks + 1, &c->halo_start, n + 1, &c->slot_start, 4 * blocks, &c->sum, blocks, &c->first, blocks, &c->last));
  PetscCall(PetscCalloc1(model->threads, &c->scratch));
  if (c->options.domain == DEM_DOMAIN_BOX || model->rain.rate > 0) PetscCall(PetscCalloc1(n + 1, &c->gone));
  PetscCall(DemContactsRoom_Internal(model, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What DemSetUpContactRoom_Internal() and searches made. */
PetscErrorCode DemContactsRoomDestroy_Internal(DemModel model)
{
  DemContacts *c = &model->contacts;

  PetscFunctionBegin;
  PetscCall(PetscFree2(c->who, c->ref));
  PetscCall(PetscFree6(c->pair, c->halo_start, c->slot_start, c->sum, c->first, c->last));
  PetscCall(PetscFree2(c->halo_p, c->slot));
  PetscCall(PetscFree(c->slot_f));
  PetscCall(PetscFree(c->gone));
  PetscCall(PetscFree(c->p));
  PetscCall(PetscFree(c->q));
  PetscCall(PetscFree(c->ip));
  PetscCall(PetscFree(c->iq));
  PetscCall(PetscFree(c->past));
  PetscCall(PetscFree(c->roll));
  PetscCall(PetscFree(c->image));
  PetscCall(PetscFree(c->met));
  PetscCall(PetscFree(c->ghost_id));
  PetscCall(DemHaloDestroy_Internal(&c->halo));
  if (c->scratch)
    for (PetscInt t = 0; t < model->threads; t++) PetscCall(PetscFree(c->scratch[t]));
  PetscCall(PetscFree(c->scratch));
  c->m = c->room = c->ghosts = c->n_blocks = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemContactsDestroy_Internal(DemModel model)
{
  DemContacts *c = &model->contacts;

  PetscFunctionBegin;
  PetscCall(DemContactsRoomDestroy_Internal(model));
  PetscCall(PetscFree(c->table));
  PetscCall(PetscFree(c->kind));
  PetscCall(PetscFree(c->fresh));
  if (c->record) PetscCallMPI(MPI_Type_free(&c->record));
  PetscCall(PetscFree(model->grain_kind));
  PetscCall(PetscFree(model->grain_of));
  PetscCall(PetscFree(model->grain_velocity));
  PetscCall(PetscFree2(model->pair_of, model->pair_choice));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define ELASTIC_STEPS 32   /* through the shortest contact without loss */
#define HERTZ_TIME 4.0302 /* duration of an elastic impact by sqrt(m/S), S at its deepest: 0.8 sqrt(pi) Gamma(2/5)/Gamma(9/10) sqrt(15/8) */

/*
  Around a sphere of radius r fit at most 2 / (1 - cos a) others of radius s or more, sin a = s/(r + s): their caps do not
  overlap. Each adds at most twice its stiffness to the row of either particle, the tangential one with 1 + m r^2/I = 3.5
  (discs: 3).  Eq. (5.36)
*/
PetscReal DemContactsRate_Internal(DemModel model, PetscReal *drag)
{
  const DemContacts *c = &model->contacts;
  const PetscInt     n = model->n;
  PetscReal          least = PETSC_MAX_REAL, most = 0, lightest = PETSC_MAX_REAL, rate = 0, share;

  for (PetscInt p = 0; p < n; p++) {
    lightest = PetscMin(lightest, DemClumpLight_Internal(model, p, &share));
    least = PetscMin(least, model->r[p]);
    most  = PetscMax(most, model->r[p]);
  }
  *drag = 0;
  for (PetscInt p = 0; p < n; p++) {
    const PetscBool clump = DemInClump(model, p); /* `light` has its rotation in it, `share` all its spheres.  Eq. (5.98) */
    const PetscReal r = model->r[p], sine = least / (r + least), light = DemClumpLight_Internal(model, p, &share), turn = clump ? 1 : 1 + model->mass[p] * r * r / model->inertia[p];
    const PetscReal room = model->dim == 3 ? floor(2 / (1 - PetscSqrtReal(1 - sine * sine))) : floor(PETSC_PI / PetscAsinReal(sine) + 1e-9), N = PetscMin((PetscReal)(n - 1), room);
    /* the stiffest partner is the largest one; the reduced mass is the particle's own at most */
    const PetscReal radius = r * most / (r + most), size = c->flat > 0 ? c->flat : radius;

    for (PetscInt k = 0; k < c->n_kinds; k++) {
      const DemContactPair *pair = &c->table[(c->kind ? c->kind[p] : 0) * c->n_kinds + k];
      const PetscReal       S = DemContactStiffness(pair, size, c->options.deepest * radius), tangent = pair->mu_static > 0 ? pair->ratio * turn : 0;
      const PetscReal       rolls = PetscMax(pair->roll_spring, pair->twist_spring) * (clump ? 1 : radius * radius * model->mass[p] / model->inertia[p]);

      rate  = PetscMax(rate, 2 * N * S / share * PetscMax(1, PetscMax(tangent, rolls)));
      if (pair->zeta == 0 && !model->bonds.n) { /* grains without loss, what a coarse step does to the energy stays.  Eq. (5.38) */
        const PetscReal whole = pair->hertz > 0 ? HERTZ_TIME : PETSC_PI, mass = light * lightest / (light + lightest);

        rate = PetscMax(rate, PetscSqr(2 * ELASTIC_STEPS / whole) * S / mass);
      }
      *drag = PetscMax(*drag, 2 * N * PetscSqrtReal(S / share) * PetscSqrtReal(model->mass[p] / share) * PetscMax(pair->drag, pair->mu_static > 0 ? pair->drag_tangent * turn : 0));
    }
  }
  return rate;
}

