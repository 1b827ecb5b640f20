/* python.c - pictures: our Python scripts, run without a display; a machine without matplotlib loses pictures, nothing else. */
#include "app.h"
#include <fcntl.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <spawn.h>
#include <unistd.h>

extern char **environ;

PetscErrorCode AppPython(const char *script, const char *argument, PetscInt n, const char *const more[], PetscBool quiet, PetscBool *ran)
{
  char        path[PETSC_MAX_PATH_LEN];
  const char *home     = getenv("CLEAVE_HOME"); /* a source tree that has moved since the build */
  char      **words;
  pid_t       child;
  posix_spawn_file_actions_t files;
  int         status = -1;

  PetscFunctionBegin;
  *ran = PETSC_FALSE;
  PetscCall(BaseFormat(path, "%s/%s", home ? home : CLEAVE_SOURCE, script));
  PetscCall(PetscCalloc1(n + 4, &words));
  words[0] = (char *)CLEAVE_PYTHON;
  words[1] = path;
  words[2] = (char *)argument;
  for (PetscInt k = 0; k < n; k++) words[3 + k] = (char *)more[k];
  fflush(stdout);
  posix_spawn_file_actions_init(&files);
  if (quiet) posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  if (!posix_spawnp(&child, CLEAVE_PYTHON, &files, NULL, words, environ) && waitpid(child, &status, 0) == child && WIFEXITED(status) && !WEXITSTATUS(status)) *ran = PETSC_TRUE;
  else fprintf(stderr, "cleave: warning: %s could not run on '%s'; the pictures are missing, the results are whole\n", script, argument);
  posix_spawn_file_actions_destroy(&files);
  PetscCall(PetscFree(words));
  PetscFunctionReturn(PETSC_SUCCESS);
}
