/* progress.c - on a terminal a line rewritten every 2 s, elsewhere (a log file) a new line every 30 s. */
#include "progress.h"
#include <petsctime.h>
#include <unistd.h>

void ProgressBegin(Progress *p, PetscBool on, PetscInt first_step)
{
  p->on         = on;
  p->terminal   = (PetscBool)(isatty(fileno(stdout)) != 0);
  p->every      = p->terminal ? 2 : 30;
  p->first_step = first_step;
  p->open       = PETSC_FALSE;
  PetscTime(&p->started);
  p->shown = p->started;
}

PetscBool ProgressDue(const Progress *p, PetscLogDouble now)
{
  return (PetscBool)(p->on && now - p->shown >= p->every);
}

/* 3661 s -> "1 h 01 min"; two units are enough to decide on coffee. */
static void Duration(PetscReal seconds, char *text, size_t size)
{
  const double s = PetscMax(seconds, 0);

  if (!(s < 8.64e8)) snprintf(text, size, "unknown"); /* 10,000 days */
  else if (s < 60) snprintf(text, size, "%.0f s", s);
  else if (s < 3600) snprintf(text, size, "%d min %02d s", (int)s / 60, (int)s % 60);
  else if (s < 86400) snprintf(text, size, "%d h %02d min", (int)s / 3600, (int)s / 60 % 60);
  else snprintf(text, size, "%d d %02d h", (int)(s / 86400), (int)(s / 3600) % 24);
}

void ProgressShow(Progress *p, const ProgressState *s, PetscLogDouble now)
{
  const PetscReal *e       = s->ledger.energy;
  const PetscReal  elapsed = PetscMax(now - p->started, 1e-9);
  const PetscReal  rate    = (s->step - p->first_step) / elapsed; /* steps per second */
  char             eta[64], line[512];
  int              n;

  Duration(rate > 0 ? (s->steps - s->step) / rate : PETSC_MAX_REAL, eta, sizeof(eta));
  n = snprintf(line, sizeof(line), "%5.1f %%  t %.4g s  step %lld/%lld", s->steps ? 100. * (double)s->step / (double)s->steps : 100., (double)s->time, (long long)s->step, (long long)s->steps);
  if (s->elements > 0) n += snprintf(line + n, sizeof(line) - (size_t)n, "  %.3g element-steps/s", (double)(rate * s->elements));
  else n += snprintf(line + n, sizeof(line) - (size_t)n, "  %.3g steps/s", (double)rate);
  n += snprintf(line + n, sizeof(line) - (size_t)n, "  ETA %s", eta);
  if (e[LEDGER_STRAIN] > 0) n += snprintf(line + n, sizeof(line) - (size_t)n, "  kinetic/strain %.2g", (double)(e[LEDGER_KINETIC] / e[LEDGER_STRAIN]));
  if (s->unbalanced >= 0) n += snprintf(line + n, sizeof(line) - (size_t)n, "  unbalanced %.2g", (double)s->unbalanced);
  snprintf(line + n, sizeof(line) - (size_t)n, "  energy error %.2g", (double)LedgerError(&s->ledger));
  if (p->terminal) printf("\r%s\033[K", line);
  else puts(line);
  fflush(stdout);
  p->open  = p->terminal;
  p->shown = now;
}

void ProgressEnd(Progress *p)
{
  if (!p->open) return;
  putchar('\n');
  fflush(stdout);
  p->open = PETSC_FALSE;
}
