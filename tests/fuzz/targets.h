/* targets.h - the readers of foreign bytes, each as one function. */
#pragma once
#include "base.h"

/*
  FuzzOne - give `size` bytes to a reader as its file

  kind: scene, packing, stl, msh, checkpoint, frames
  read: the reader took it. Anything but "taken" or "refused as bad input, with words" ends the process.
*/
void FuzzOne(const char *kind, const unsigned char *data, size_t size, PetscBool *read);

/* A whole checkpoint, or index of frames, as bytes; malloc(). These are made, not kept: HDF5 versions differ. */
unsigned char *FuzzMade(const char *kind, size_t *size);
