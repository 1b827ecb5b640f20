/* run_toy.h - what the tests of the run loop share: run the toy into a directory, compare directories, read frames back. */
#pragma once
#include "check.h"
#include "toy.h"

/* options->resume goes on from what is there. summary may be NULL. Returns what RunLoop() returned. */
PetscErrorCode RunToy(const char *directory, Toy *toy, const RunOptions *options, RunSummary *summary);

PetscErrorCode SameFiles(const char *a, const char *b); /* history, indices and every frame file, byte by byte; fails the test where they differ */
PetscInt       CountRows(const char *directory);        /* of history.csv, without the header */
PetscReal     *ReadColumn(const char *directory, PetscInt column, PetscInt *n); /* PetscFree() it */
PetscInt       CountFrames(const char *directory);      /* in fields/ */
void           ReadFrames(const char *directory, PetscBool killed); /* VTK's reader against h5py, every frame; fails the test otherwise */
