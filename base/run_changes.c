/* run_changes.c - two scenes compared, line by line. */
#include "run_changes.h"
#include <string.h>

/* Length of the line at text, and the next line. */
static size_t Line(const char *text, const char **next)
{
  const size_t n = strcspn(text, "\n");

  *next = text + n + (text[n] == '\n');
  return n;
}

static const char *SkipLoads(const char *text, PetscBool skip)
{
  const char *next;

  while (skip && *text == '~') {
    (void)Line(text, &next);
    text = next;
  }
  return text;
}

/* The first lines that differ; false when there is none. */
static PetscBool Parts(const char *saved, const char *now, PetscBool skip, const char **a, const char **b)
{
  const char *next_a, *next_b;

  for (;;) {
    *a = saved = SkipLoads(saved, skip);
    *b = now = SkipLoads(now, skip);
    if (!*saved && !*now) return PETSC_FALSE;
    if (Line(saved, &next_a) != Line(now, &next_b) || strncmp(saved, now, strcspn(saved, "\n"))) return PETSC_TRUE;
    saved = next_a;
    now   = next_b;
  }
}

PetscErrorCode RunStampCheck(MPI_Comm comm, const char *file, const char *saved, const char *now, PetscBool loads_may_change)
{
  const char *a, *b, *c, *d;
  PetscBool   loads;

  PetscFunctionBegin;
  if (!Parts(saved, now, loads_may_change, &a, &b)) PetscFunctionReturn(PETSC_SUCCESS);
  loads = (PetscBool)(!loads_may_change && !Parts(saved, now, PETSC_TRUE, &c, &d));
  a += *a == '~';
  b += *b == '~';
  SETERRQ(comm, PETSC_ERR_USER_INPUT, "The checkpoint '%s' belongs to another scene: it has '%.*s' where this one has '%.*s'; %s", file, (int)PetscMin(strcspn(a, "\n"), 200), a,
          (int)PetscMin(strcspn(b, "\n"), 200), b, loads ? "only loads differ: if they are meant to change from here on, say --new-loads" : "run without resuming, or in another directory");
}

/* The line of text with the same path as the n characters at path; NULL when there is none. */
static const char *Find(const char *text, const char *path, size_t n)
{
  for (const char *next; *text; text = next) {
    (void)Line(text, &next);
    if (!strncmp(text, path, n) && !strncmp(text + n, ": ", 2)) return text + n + 2;
  }
  return NULL;
}

static size_t PathLength(const char *line)
{
  const char *colon = strstr(line, ": ");
  const size_t n    = strcspn(line, "\n");

  return colon && (size_t)(colon - line) < n ? (size_t)(colon - line) : n;
}

PetscErrorCode RunChangesList(const char *before, const char *now, char **list)
{
  size_t size = 1, used = 0;

  PetscFunctionBegin;
  size += 2 * (strlen(before) + strlen(now)); /* every path twice at most ... */
  for (int side = 0; side < 2; side++)
    for (const char *line = side ? now : before, *next; *line; line = next) {
      (void)Line(line, &next);
      size += 64; /* ... and the words between */
    }
  PetscCall(PetscMalloc1(size, list));
  (*list)[0] = 0;
  for (int side = 0; side < 2; side++)
    for (const char *line = side ? now : before, *next; *line; line = next) {
      const size_t n     = Line(line, &next), path = PathLength(line);
      const char  *other = Find(side ? before : now, line, path), *value = line + PetscMin(n, path + 2);
      const int    length = (int)(n - PetscMin(n, path + 2)), other_length = other ? (int)strcspn(other, "\n") : 0;

      if (other && (side || (length == other_length && !strncmp(value, other, (size_t)length)))) continue;
      if (side) used += (size_t)snprintf(*list + used, size - used, "  %.*s: (not given) -> %.*s\n", (int)path, line, length, value);
      else if (other) used += (size_t)snprintf(*list + used, size - used, "  %.*s: %.*s -> %.*s\n", (int)path, line, length, value, other_length, other);
      else used += (size_t)snprintf(*list + used, size - used, "  %.*s: %.*s -> (not given)\n", (int)path, line, length, value);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
