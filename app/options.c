/* options.c - the command line. */
#include "app.h"
#include <errno.h>
#include <stdlib.h>
#include <string.h>

/* Options with a value are written "--threads 2" or "--threads=2". */
typedef struct {
  const char *name, *commands; /* commands it belongs to */
  PetscBool   takes;
} Option;

static const Option table[] = {
  {"--output", "run pack", PETSC_TRUE},
  {"--threads", "run check", PETSC_TRUE},
  {"--set", "run check pack", PETSC_TRUE},
  {"--stop-after", "run", PETSC_TRUE},
  {"--time-limit", "run", PETSC_TRUE},
  {"--resume", "run", PETSC_FALSE},
  {"--new-loads", "run", PETSC_FALSE},
  {"--quiet", "run", PETSC_FALSE},
  {"--no-plots", "run check", PETSC_FALSE},
  {"--measure", "check", PETSC_FALSE},
};
enum { N_OPTIONS = sizeof(table) / sizeof(table[0]) };

static int Refuse(const char *what, const char *about, const char *cure)
{
  fprintf(stderr, "cleave: %s '%s'; %s\n", what, about, cure);
  return 2;
}

static int Whole(const char *option, const char *text, PetscInt *value)
{
  char *end;
  long  number;

  errno  = 0;
  number = strtol(text, &end, 10);
  if (end == text || *end || errno || number < 1 || number > PETSC_MAX_INT) {
    fprintf(stderr, "cleave: %s '%s' is not a whole number from 1\n", option, text);
    return 2;
  }
  *value = (PetscInt)number;
  return 0;
}

/* "90 s", "30 min", "2 h"; a plain number is seconds. */
static int Seconds(const char *option, const char *text, PetscReal *value)
{
  static const struct {
    const char *name;
    double      seconds;
  } units[] = {{"", 1}, {"s", 1}, {"min", 60}, {"h", 3600}, {"d", 86400}};
  char        *end;
  const double number = strtod(text, &end);

  while (*end == ' ') end++;
  for (size_t k = 0; k < sizeof(units) / sizeof(units[0]) && end != text && number > 0; k++)
    if (!strcmp(end, units[k].name) && number * units[k].seconds < 1e12) {
      *value = number * units[k].seconds;
      return 0;
    }
  fprintf(stderr, "cleave: %s '%s' is not a time above 0, such as 90s, 30min or 2h\n", option, text);
  return 2;
}

static const Option *Find(const char *word, size_t length)
{
  for (int k = 0; k < N_OPTIONS; k++)
    if (strlen(table[k].name) == length && !strncmp(table[k].name, word, length)) return &table[k];
  return NULL;
}

int AppOptionsRead(int argc, char **argv, AppOptions *o)
{
  int after = argc; /* where "--" stands */

  memset(o, 0, sizeof(*o));
  o->command = argc > 1 ? argv[1] : "--help";
  for (int a = 1; a < argc && after == argc; a++)
    if (!strcmp(argv[a], "--")) after = a;
  o->word  = (const char **)calloc((size_t)argc + 1, sizeof(*o->word));
  o->set   = (const char **)calloc((size_t)argc + 1, sizeof(*o->set));
  o->petsc = (char **)calloc((size_t)argc + 1, sizeof(*o->petsc));
  if (!o->word || !o->set || !o->petsc) return Refuse("no memory for", "the command line", "free some");

  /* PETSc sees only what follows "--": our words are none of its business. */
  o->petsc[o->n_petsc++] = argv[0];
  for (int a = after + 1; a < argc; a++) o->petsc[o->n_petsc++] = argv[a];

  for (int a = 2; a < after; a++) {
    const char   *word   = argv[a], *equals = strchr(word, '=');
    const size_t  length = equals && !strncmp(word, "--", 2) ? (size_t)(equals - word) : strlen(word);
    const Option *option = Find(word, length);
    const char   *value  = NULL;
    int           bad    = 0;

    if (word[0] != '-') {
      o->word[o->n_words++] = word;
      continue;
    }
    if (!option) {
      const char *names[N_OPTIONS], *near;

      for (int k = 0; k < N_OPTIONS; k++) names[k] = table[k].name;
      near = BaseNearest(word, N_OPTIONS, names);
      if (near) fprintf(stderr, "cleave: unknown option '%s'; did you mean %s?\n", word, near);
      else fprintf(stderr, "cleave: unknown option '%s'; `cleave --help` lists them, options of PETSc stand after --\n", word);
      return 2;
    }
    if (!strstr(option->commands, o->command)) return Refuse("this command has no option", option->name, "see cleave --help");
    if (option->takes) {
      if (equals && length < strlen(word)) value = equals + 1;
      else if (a + 1 < after) value = argv[++a];
      if (!value || !value[0]) return Refuse("a value is missing after", option->name, "see cleave --help");
    } else if (length < strlen(word)) return Refuse("no value belongs to", option->name, "write it alone");

    if (!strcmp(option->name, "--output")) o->output = value;
    else if (!strcmp(option->name, "--threads")) bad = Whole("--threads", value, &o->threads);
    else if (!strcmp(option->name, "--stop-after")) bad = Whole("--stop-after", value, &o->stop_after);
    else if (!strcmp(option->name, "--time-limit")) bad = Seconds("--time-limit", value, &o->time_limit);
    else if (!strcmp(option->name, "--resume")) o->resume = PETSC_TRUE;
    else if (!strcmp(option->name, "--new-loads")) o->new_loads = PETSC_TRUE;
    else if (!strcmp(option->name, "--quiet")) o->quiet = PETSC_TRUE;
    else if (!strcmp(option->name, "--no-plots")) o->no_plots = PETSC_TRUE;
    else if (!strcmp(option->name, "--measure")) o->measure = PETSC_TRUE;
    else if (!strchr(value, '=')) bad = Refuse("--set wants key=value, not", value, "for example --set time.end='2 ms'");
    else o->set[o->n_set++] = value;
    if (bad) return bad;
  }
  if (o->new_loads && !o->resume) return Refuse("no checkpoint is resumed, so nothing changes with", "--new-loads", "say --resume too");
  return 0;
}

void AppOptionsFree(AppOptions *o)
{
  free(o->word);
  free(o->set);
  free(o->petsc);
  memset(o, 0, sizeof(*o));
}
