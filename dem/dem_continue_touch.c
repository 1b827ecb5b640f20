/*
  dem_continue_touch.c - contacts among particles and with tools, as a model of more particles goes on.  Section 8 of docs/theory.md

  What touches keeps its history to the bit. Both models keep their particles along one curve, so a pair's first is its first in
  both, and lists that were sorted still are.
*/
#include "dem_tool_impl.h"

PetscErrorCode DemContactsContinue_Internal(DemModel model, DemModel from, const PetscInt of[])
{
  DemContacts       *c = &model->contacts;
  const DemContacts *o = &from->contacts;
  const PetscInt     n = model->n, m = from->n;

  PetscFunctionBegin;
  PetscCheck(c->turns == o->turns && !c->image == !o->image && !c->gone == !o->gone, model->comm, PETSC_ERR_ARG_WRONG, "The two models do not meet by the same rules");
  if (!o->searches) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DemContactsRoom_Internal(model, o->m));
  c->m        = o->m;
  c->searches = o->searches;
  c->looked   = o->looked;
  c->broken   = o->broken;
  c->n_gone   = o->n_gone;
  c->touching = o->touching;
  c->deepest  = o->deepest;
  c->taken    = o->taken;
  for (PetscInt k = 0; k < o->m; k++) {
    c->p[k]   = of[o->p[k]];
    c->q[k]   = of[o->q[k]];
    c->met[k] = o->met[k];
    PetscCheck(c->p[k] >= 0 && c->q[k] > c->p[k] && (!k || c->p[k] >= c->p[k - 1]), model->comm, PETSC_ERR_PLIB, "A pair of particles in contact stands in another order in the model that goes on");
  }
  PetscCall(PetscArraycpy(c->past, o->past, DEM_PAST * o->m));
  if (c->turns) PetscCall(PetscArraycpy(c->roll, o->roll, 4 * o->m));
  if (c->image) PetscCall(PetscArraycpy(c->image, o->image, 3 * o->m));
  PetscCall(PetscMalloc1(n, &c->fresh)); /* the search that the next evaluation makes frees it */
  for (PetscInt p = 0; p < n; p++) c->fresh[p] = 1;
  for (PetscInt p = 0; p < m; p++) {
    if (of[p] < 0) continue;
    c->fresh[of[p]] = 0;
    if (c->gone) c->gone[of[p]] = o->gone[p];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemToolsContinue_Internal(DemModel model, DemModel from, const PetscInt of[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < model->n_tools; k++) {
    DemTool  *tool = model->tool[k], *old = from->tool[k];
    PetscInt  block = 0, *count;
    PetscReal row[DEM_TOOL_STATE] = {0};

    PetscCall(DemToolPack_Internal(old, PETSC_TRUE, row));
    PetscCall(DemToolPack_Internal(tool, PETSC_FALSE, row));
    DemToolPose_Internal(tool);
    PetscCall(PetscCalloc1(model->blocks.n_blocks, &count));
    for (PetscInt pass = 0; pass < 2; pass++) {
      block = 0;
      for (PetscInt b = 0; b < from->blocks.n_blocks; b++)
        for (PetscInt i = 0; i < old->n_contacts[b]; i++) {
          const PetscInt p = of[old->contact[b][i].p];

          PetscCheck(p >= model->blocks.first[block], model->comm, PETSC_ERR_PLIB, "Contacts of tool '%s' stand in another order in the model that goes on", tool->name);
          while (p >= model->blocks.first[block + 1]) block++;
          if (!pass) count[block]++;
          else {
            tool->contact[block][tool->n_contacts[block]]     = old->contact[b][i];
            tool->contact[block][tool->n_contacts[block]++].p = p;
          }
        }
      for (PetscInt b = 0; !pass && b < model->blocks.n_blocks; b++) {
        PetscCall(DemToolReserve_Internal(tool, b, count[b]));
        tool->n_contacts[b] = 0;
      }
    }
    PetscCall(PetscFree(count));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
