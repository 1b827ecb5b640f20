/*
  replay.c - seeds through a reader without a fuzzer: each whole, cut after every byte (or some 4,000 places), with bytes
  changed. usage: replay KIND [FILE...]; without a file the seed is made. Prints one line of counts.

  Cut files must be refused (the checkpoint and frames bear a mark of all their bytes); a scene is text, and a part of one may be a scene. A scene, a packing or a mesh with another
  number in it may be a good one; a checkpoint with one bit changed never is.
*/
#include "targets.h"
#include "files.h"
#include <stdlib.h>
#include <string.h>

/* splitmix64 */
static unsigned long long Random(unsigned long long *state)
{
  unsigned long long z = (*state += 0x9e3779b97f4a7c15ull);

  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

typedef struct {
  long seeds, cuts, cuts_read, changed, changed_read;
} Counts;

static int Try(const char *kind, const unsigned char *bytes, size_t n, const char *name, Counts *counts)
{
  const PetscBool    text = (PetscBool)!strcmp(kind, "scene"), sealed = (PetscBool)(!strcmp(kind, "checkpoint") || !strcmp(kind, "frames")), bad = (PetscBool)(strstr(name, "bad-") != NULL);
  const size_t       step = n / 4000 + 1, trials = strcmp(kind, "msh") ? 2000 : 400;
  unsigned long long state = 1;
  unsigned char     *copy  = malloc(n + 1);
  PetscBool          read;
  size_t             end = n;

  counts->seeds++;
  FuzzOne(kind, bytes, n, &read);
  if (read == bad) {
    fprintf(stderr, "%s: the seed %s is %s\n", kind, name, read ? "taken" : "refused");
    return 1;
  }
  while (!bad && end > 0 && (bytes[end - 1] == '\n' || bytes[end - 1] == '\r')) end--; /* a text without its last newline is whole */
  if (!strcmp(kind, "stl") && end > 12 && !memcmp(bytes, "solid", 5)) /* nor does its name at the end make it one */
    while (end > 12 && memcmp(bytes + end - 8, "endsolid", 8)) end--;
  for (size_t cut = 0; cut < end && !bad; cut += !strcmp(kind, "msh") ? 7 * step : step) {
    FuzzOne(kind, bytes, cut, &read);
    counts->cuts++;
    counts->cuts_read += read;
    if (!read || text) continue;
    fprintf(stderr, "%s: %s is taken when cut after %zu of %zu bytes\n", kind, name, cut, n);
    return 1;
  }
  for (size_t k = 0; k < trials && !bad && n > 0; k++) {
    const int times = 1 + (int)(Random(&state) % 3);
    PetscBool other = PETSC_FALSE;

    memcpy(copy, bytes, n);
    for (int j = 0; j < times; j++) copy[Random(&state) % n] ^= (unsigned char)(1u << (Random(&state) % 8));
    other = (PetscBool)(memcmp(copy, bytes, n) != 0);
    FuzzOne(kind, copy, n, &read);
    counts->changed++;
    counts->changed_read += read;
    if (!(read && sealed && other)) continue;
    fprintf(stderr, "%s: a changed %s is taken\n", kind, name);
    return 1;
  }
  free(copy);
  return 0;
}

int main(int argc, char **argv)
{
  Counts         c = {0};
  size_t         n;
  unsigned char *made;
  int            failed = 0;

  if (argc < 2) return 2;
  if (argc == 2) {
    made   = FuzzMade(argv[1], &n);
    failed = Try(argv[1], made, n, "made", &c);
    free(made);
  }
  for (int k = 2; k < argc && !failed; k++) {
    char *text;

    made = FuzzMade("checkpoint", &n); /* starts the libraries */
    free(made);
    if (FileReadText(argv[k], &text, &n)) return 1;
    failed = Try(argv[1], (unsigned char *)text, n, argv[k], &c);
    if (PetscFree(text)) return 1;
  }
  printf("%s seeds %ld cuts %ld taken %ld changed %ld taken %ld\n", argv[1], c.seeds, c.cuts, c.cuts_read, c.changed, c.changed_read);
  if (BaseFinalize()) return 1;
  return failed;
}
