/* keep_libraries.c - in a build with the sanitizers no library is unloaded, so that what MPI's modules keep has a name when leaks are told (cmake/leaks.supp). */
int dlclose(void *library);

int dlclose(void *library)
{
  (void)library;
  return 0;
}
