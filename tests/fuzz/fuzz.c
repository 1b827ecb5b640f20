/* fuzz.c - libFuzzer's way in. FUZZ_KIND names the reader; made seeds are its first inputs (FUZZ_SEED=FILE writes one and ends). */
#include "targets.h"
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size);

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size)
{
  PetscBool read;

  FuzzOne(FUZZ_KIND, data, size, &read);
  return 0;
}
