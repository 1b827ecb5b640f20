/* cracks.csv - the facets that have begun to break, one a row, as they stand when the run ends. */
#include "app.h"
#include "files.h"

PetscErrorCode AppCracksWrite(AppCase *c, const char *directory)
{
  FILE     *out;
  DemCracks cracks;
  char      path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  if (c->rank || !c->dem || !c->part[0].cohesive) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BaseFormat(path, "%s/cracks.csv", directory));
  PetscCall(DemModelGetCracks(c->dem, &cracks));
  PetscCall(FileOpen(path, "w", &out));
  fprintf(out, "time[s],x[m],y[m],z[m],normal.x[-],normal.y[-],normal.z[-],area[m2],mode,opening[m],slide[m],energy[J],damage[-],broken[-]\n");
  for (PetscInt k = 0; k < cracks.n; k++) {
    PetscReal at[3], normal[3], area;

    PetscCall(DemModelGetFacet(c->dem, cracks.facet[k], at, normal, &area));
    fprintf(out, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%s,%.9g,%.9g,%.9g,%.9g,%.9g\n", (double)cracks.time[k], (double)at[0], (double)at[1], (double)at[2], (double)normal[0], (double)normal[1], (double)normal[2],
            (double)area, cracks.mode[k] == 1 ? "tension" : "shear", (double)cracks.opening[k], (double)cracks.slide[k], (double)cracks.work[k], (double)cracks.damage[k], (double)cracks.broken[k]);
  }
  PetscCall(FileClose(&out, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}
