/*
  coupled_wave.c - energy reflected where particles end, against wavelength and width of the overlap.

  bench/coupled_wave DIRECTORY
  Writes coupled_wave.csv there, and coupled_wave.png when gnuplot is at hand. Strips, waves and measurement: tests/coupling/wave.c.
*/
#include "wave.h"
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

static PetscErrorCode Run(const char *directory)
{
  const PetscReal lambda[] = {4, 5, 6, 7, 8, 10, 12, 15, 20};
  const PetscInt  width[]  = {0, 1, 2, 4};
  char            path[PETSC_MAX_PATH_LEN];
  FILE           *csv, *plot;

  PetscFunctionBeginUser;
  (void)mkdir(directory, 0777); /* may be there */
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/coupled_wave.csv", directory));
  csv = fopen(path, "w");
  BaseCheckInput(csv, PETSC_COMM_SELF, "%s cannot be written; give a directory that can", path);
  fprintf(csv, "wavelength[h],edge_closed_form[-],edge[-],overlap_1h[-],overlap_2h[-],overlap_4h[-]\n");
  for (size_t i = 0; i < sizeof(lambda) / sizeof(lambda[0]); i++) {
    PetscReal energy[4], dt = 0;

    for (int k = 0; k < 4; k++) PetscCall(WaveReflect(lambda[i], width[k], NULL, &energy[k], &dt));
    fprintf(csv, "%g,%.4e,%.4e,%.4e,%.4e,%.4e\n", (double)lambda[i], (double)WaveEdge(lambda[i], dt), (double)energy[0], (double)energy[1], (double)energy[2], (double)energy[3]);
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "%4g h: closed form %.3e, edge %.3e, overlap of 1, 2, 4 h: %.3e %.3e %.3e\n", (double)lambda[i], (double)WaveEdge(lambda[i], dt), (double)energy[0], (double)energy[1],
                          (double)energy[2], (double)energy[3]));
  }
  fclose(csv);
  plot = popen("gnuplot 2>/dev/null", "w");
  if (plot) {
    fprintf(plot, "set terminal pngcairo size 900,600\nset output '%s/coupled_wave.png'\nset datafile separator ','\nset logscale xy\nset xrange [3.5:23]\nset xtics (4,5,6,8,10,15,20)\n", directory);
    fprintf(plot, "set xlabel 'wavelength / element edge'\nset ylabel 'reflected / sent energy'\nset format y '10^{%%L}'\nset key bottom left\n");
    fprintf(plot, "plot for [k=2:6] '%s/coupled_wave.csv' using 1:k with linespoints title word('closed_form edge overlap_1h overlap_2h overlap_4h', k-1) noenhanced\n", directory);
    (void)pclose(plot);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscErrorCode ierr;

  if (argc < 2) {
    fprintf(stderr, "usage: coupled_wave DIRECTORY\n");
    return 2;
  }
  if (BaseInitialize(&argc, &argv)) return 1;
  ierr = Run(argv[1]);
  return BaseFinalize() || ierr ? 1 : 0;
}
