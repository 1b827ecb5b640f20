/* dem_pack_io.c - packings as text: one "x y z r" a line [m], commas or blanks between, '#' starts a comment. */
#include "dem_body_impl.h"
#include "dem_packing.h"
#include "files.h"
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define OUR_HEAD "# x y z r [m]; " /* of a packing we wrote; the number of particles follows, so that a cut file is noticed */

/* Numbers of a line into v[5]; returns how many (5 = too many), -1 when something is not a number. */
static PetscInt ReadNumbers(char *text, PetscReal v[5])
{
  PetscInt n = 0;
  int      comma = 0; /* a comma waits for its number */

  for (;;) {
    char *end;

    while (isspace((unsigned char)*text)) text++;
    if (!*text || *text == '#') return comma ? -1 : n;
    if (n == 5) return 5;
    v[n] = strtod(text, &end);
    if (end == text) return -1;
    n++;
    text = end;
    while (isspace((unsigned char)*text)) text++;
    comma = *text == ',';
    if (comma)
      text++;
    else if (*text && *text != '#' && !isspace((unsigned char)text[-1]))
      return -1;
  }
}

PetscErrorCode DemPackingRead(const char *file, const DemBody *body, PetscBool trim, DemPacking *packing)
{
  FILE         *in;
  char          text[BASE_LINE];
  PetscBool     whole = PETSC_TRUE; /* the last line read ends as lines do */
  long long     told  = -1;         /* particles, by our own first line */
  PetscInt      line = 0, trimmed = 0, room = 0, n = 0, fault_line = 0, got = 4;
  const char   *fault = NULL;
  PetscReal     v[5] = {0, 0, 0, 0, 0};
  DemBodySearch search;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(packing, sizeof(*packing)));
  BaseCheckInput(!FileUnfit(file), PETSC_COMM_SELF, "Cannot read the packing %s: it %s", file, FileUnfit(file));
  in = fopen(file, "r");
  BaseCheckInput(in, PETSC_COMM_SELF, "Cannot read the packing %s", file);
  PetscCall(DemBodySearchCreate(body, 0, PetscMax(body->high[0] - body->low[0], body->high[1] - body->low[1]) / 50, &search));
  while (!fault && fgets(text, sizeof(text), in)) {
    fault_line = ++line;
    whole      = (PetscBool)(text[0] && text[strlen(text) - 1] == '\n');
    if (line == 1) (void)sscanf(text, OUR_HEAD "%lld particles", &told);
    if (strlen(text) == sizeof(text) - 1 && text[sizeof(text) - 2] != '\n') {
      fault = "is too long";
      break;
    }
    got = ReadNumbers(text, v);
    if (got == 0) continue;
    if (got != 4) {
      fault = "is not four numbers x y z r [m]";
    } else if (PetscIsInfOrNanReal(v[0] + v[1] + v[2]) || !(v[3] > 0) || PetscIsInfOrNanReal(v[3])) {
      fault = "has a centre that is not finite or a radius that is not above 0";
    } else if (body->dim == 2 && v[2] != 0) {
      fault = "leaves the plane z = 0 of a 2D body";
    } else if (!DemBodySearchInside(&search, v)) {
      if (trim) {
        trimmed++;
        continue;
      }
      fault = "has its centre outside the body (are the numbers in metres?)";
    } else {
      if (n == room) {
        room = PetscMax(1024, 2 * room);
        PetscCall(PetscRealloc(3 * room * sizeof(PetscReal), &packing->x));
        PetscCall(PetscRealloc(room * sizeof(PetscReal), &packing->r));
      }
      for (PetscInt c = 0; c < 3; c++) packing->x[3 * n + c] = v[c];
      packing->r[n++] = v[3];
    }
  }
  if (!fault && told >= 0 && (told != n + trimmed || !whole)) fault = "ends the file, and the first one tells of another number of particles: the file is cut short (or edited: then take the first line out)";
  fclose(in);
  packing->n = n;
  PetscCall(DemBodySearchDestroy(&search));
  if (fault || !n) PetscCall(DemPackingDestroy(packing));
  BaseCheckInput(!fault, PETSC_COMM_SELF, "%s:%" PetscInt_FMT ": this line %s", file, fault_line, fault);
  BaseCheckInput(n, PETSC_COMM_SELF, "%s holds no particle%s; a packing is lines x y z r [m]", file, trim ? " with its centre in the body" : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DemPackingWrite(const DemPacking *packing, const char *file)
{
  FILE *out;
  int   bad;

  PetscFunctionBegin;
  out = fopen(file, "w");
  BaseCheckInput(out, PETSC_COMM_SELF, "Cannot write the packing to %s", file);
  fprintf(out, OUR_HEAD "%" PetscInt_FMT " particles\n", packing->n);
  for (PetscInt p = 0; p < packing->n; p++)
    fprintf(out, "%.17g %.17g %.17g %.17g\n", (double)packing->x[3 * p], (double)packing->x[3 * p + 1], (double)packing->x[3 * p + 2], (double)packing->r[p]);
  bad = ferror(out);
  bad |= fclose(out);
  PetscCheck(!bad, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "The disk refused a part of the packing %s", file);
  PetscFunctionReturn(PETSC_SUCCESS);
}
