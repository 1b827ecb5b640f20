/*
  cracks.c - what is broken when the run ends: cracks.csv, the facets that have begun to break, and fragments.csv, the
  parts that bonds still hold together, heaviest first.
*/
#include "app.h"
#include "files.h"

/* Number of particles, mass, centre of mass and its velocity of every fragment. */
static PetscErrorCode FragmentsWrite(AppCase *c, const char *directory)
{
  FILE      *out;
  DemState   s;
  PetscInt  *fragment, parts;
  PetscReal *sum; /* [parts][8] particles, mass, mass x position, mass x velocity */
  char       path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DemModelGetState(c->dem, &s));
  PetscCall(PetscMalloc1(s.n, &fragment));
  PetscCall(DemModelGetFragments(c->dem, &parts, fragment));
  PetscCall(PetscCalloc1(8 * parts, &sum));
  for (PetscInt p = 0; p < s.own; p++) {
    PetscReal *row = sum + 8 * fragment[c->size > 1 ? p : s.number[p]];

    row[0]++;
    row[1] += s.mass[p];
    for (PetscInt d = 0; d < s.dim; d++) {
      row[2 + d] += s.mass[p] * (s.x0[d * s.n + p] + s.u[d * s.n + p]);
      row[5 + d] += s.mass[p] * s.v[d * s.n + p];
    }
  }
  PetscCall(DemModelRestoreState(c->dem, &s));
  if (c->size > 1) { /* in the order of the ranks */
    PetscReal *all;

    PetscCall(PetscMalloc1(8 * parts * c->size, &all));
    PetscCallMPI(MPI_Gather(sum, (PetscMPIInt)(8 * parts), MPIU_REAL, all, (PetscMPIInt)(8 * parts), MPIU_REAL, 0, c->comm));
    for (PetscInt k = 0; k < 8 * parts && !c->rank; k++) {
      sum[k] = 0;
      for (PetscMPIInt r = 0; r < c->size; r++) sum[k] += all[8 * parts * r + k];
    }
    PetscCall(PetscFree(all));
  }
  if (c->rank) {
    PetscCall(PetscFree(sum));
    PetscCall(PetscFree(fragment));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(BaseFormat(path, "%s/fragments.csv", directory));
  PetscCall(FileCreate(path, &out));
  fprintf(out, "fragment[-],particles[-],mass[kg],x[m],y[m],z[m],velocity.x[m/s],velocity.y[m/s],velocity.z[m/s]\n");
  for (PetscInt k = 0; k < parts; k++) {
    const PetscReal *row = sum + 8 * k, m = row[1];

    fprintf(out, "%d,%.0f,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g\n", (int)k, (double)row[0], (double)m, (double)(row[2] / m), (double)(row[3] / m), (double)(row[4] / m), (double)(row[5] / m),
            (double)(row[6] / m), (double)(row[7] / m));
  }
  PetscCall(FileFinish(&out, path));
  PetscCall(PetscFree(sum));
  PetscCall(PetscFree(fragment));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AppCracksWrite(AppCase *c, const char *directory)
{
  FILE     *out;
  DemCracks cracks;
  char      path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  if (!c->dem || !AppGrains(c)->cohesive) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DemModelGetCracks(c->dem, &cracks));
  if (c->rank) {
    PetscCall(FragmentsWrite(c, directory));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(BaseFormat(path, "%s/cracks.csv", directory));
  PetscCall(FileCreate(path, &out));
  fprintf(out, "time[s],x[m],y[m],z[m],normal.x[-],normal.y[-],normal.z[-],area[m2],mode,opening[m],slide[m],energy[J],damage[-],broken[-]\n");
  for (PetscInt k = 0; k < cracks.n; k++) {
    PetscReal at[3], normal[3], area;

    PetscCall(DemModelGetCrackPlace(c->dem, k, at, normal, &area));
    fprintf(out, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%s,%.9g,%.9g,%.9g,%.9g,%.9g\n", (double)cracks.time[k], (double)at[0], (double)at[1], (double)at[2], (double)normal[0], (double)normal[1], (double)normal[2],
            (double)area, cracks.mode[k] == 1 ? "tension" : "shear", (double)cracks.opening[k], (double)cracks.slide[k], (double)cracks.work[k], (double)cracks.damage[k], (double)cracks.broken[k]);
  }
  PetscCall(FileFinish(&out, path));
  PetscCall(FragmentsWrite(c, directory));
  PetscFunctionReturn(PETSC_SUCCESS);
}
