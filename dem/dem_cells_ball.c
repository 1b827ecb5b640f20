/*
  dem_cells_ball.c - volume of a ball within its cell, exactly.

  Seen from the ball's centre a convex cell is a sum of signed cones over its facets. About the foot of the centre on a
  facet's plane each cone is a sum over edges of an integral over the angle phi around the foot, and that has a closed
  form.  Eqs (3.8), (3.9), docs/theory.md
*/
#include "dem_cells_impl.h"

/* int_0^phi of min(h/cos, R)^3 / 3 over the polar angle up to the edge at distance e from the foot; odd in phi. */
static PetscReal ConeIntegral(PetscReal h, PetscReal e, PetscReal R, PetscReal phi)
{
  const PetscReal a = PetscAbsReal(phi), s = PetscSqrtReal(h * h + e * e), R3 = R * R * R / 3;
  PetscReal       g;

  if (h >= R) {
    g = R3 * (a - PetscAsinReal(PetscMin(1, h * PetscSinReal(a) / s)));
  } else {
    const PetscReal rho = PetscSqrtReal(R * R - h * h), edge = e < rho ? PetscAcosReal(e / rho) : 0, in = PetscMin(a, edge);

    g = h * e * e * PetscTanReal(in) / 6;
    if (a > edge)
      g += (a - edge) * (h * rho * rho / 6 + R3 * h / R) -
           R3 * (PetscAsinReal(PetscMin(1, h * PetscSinReal(a) / s)) - PetscAsinReal(PetscMin(1, h * PetscSinReal(edge) / s)));
  }
  return phi < 0 ? -g : g;
}

PetscReal DemBallInCone(PetscInt n, const double *corner, const PetscReal normal[3], PetscReal height, PetscReal R)
{
  const PetscReal h = PetscAbsReal(height);
  PetscReal       sum = 0, around = 0;

  if (h <= 0) return 0;
  for (PetscInt k = 0; k < n; k++) {
    const double *a = &corner[3 * k], *b = &corner[3 * ((k + 1) % n)];
    PetscReal     u[3], p[3], len = 0, ta = 0, tb = 0, e = 0, part;

    for (PetscInt c = 0; c < 3; c++) {
      u[c] = b[c] - a[c];
      len += u[c] * u[c];
    }
    len = PetscSqrtReal(len);
    if (!(len > 0)) continue;
    for (PetscInt c = 0; c < 3; c++) {
      u[c] /= len;
      p[c] = a[c] - height * normal[c]; /* from the foot */
      ta += p[c] * u[c];
    }
    tb = ta + len;
    e = normal[0] * (p[1] * u[2] - p[2] * u[1]) + normal[1] * (p[2] * u[0] - p[0] * u[2]) + normal[2] * (p[0] * u[1] - p[1] * u[0]);
    around += e * len; /* twice the area, signed by the order of the corners */
    part = ConeIntegral(h, PetscAbsReal(e), R, PetscAtan2Real(tb, PetscAbsReal(e))) - ConeIntegral(h, PetscAbsReal(e), R, PetscAtan2Real(ta, PetscAbsReal(e)));
    sum += e < 0 ? -part : part;
  }
  if (around < 0) sum = -sum;
  return height < 0 ? -sum : sum;
}

PetscReal DemDiscInTriangle(const double *corner, const PetscReal normal[3], PetscReal height, PetscReal R)
{
  const PetscReal e = PetscAbsReal(height), edge = e < R ? PetscAcosReal(e / R) : 0;
  PetscReal       t[2], g[2];

  if (e <= 0) return 0;
  for (PetscInt k = 0; k < 2; k++) {
    PetscReal a;

    t[k] = normal[0] * corner[3 * k + 1] - normal[1] * corner[3 * k]; /* along the edge from the foot */
    a = PetscAtan2Real(PetscAbsReal(t[k]), e);
    g[k] = 0.5 * e * e * PetscTanReal(PetscMin(a, edge)) + (a > edge ? 0.5 * R * R * (a - edge) : 0);
    if (t[k] < 0) g[k] = -g[k];
  }
  return (height < 0 ? -1 : 1) * PetscAbsReal(g[1] - g[0]);
}
