// voro_shim.cc - voro++'s cell in C; see voro_shim.h.
#include "voro_shim.h"
#include <cmath>
#include <new>
#include <vector>
#include <voro++/voro++.hh>

// voro++ compares normal.x - offset with 1e-11 whatever the normal's length: a long normal makes that distance
// 2e-13, still well above round-off for coordinates below 2.
static const double normal_length = 32;

struct VoroCell {
  voro::voronoicell_neighbor cell;
  std::vector<double>        point, corner;
  std::vector<int>           order, id, start;
};

extern "C" VoroCell *VoroCellCreate(void) { return new (std::nothrow) VoroCell; }

extern "C" void VoroCellDestroy(VoroCell *c) { delete c; }

extern "C" void VoroCellBox(VoroCell *c, const double low[3], const double high[3]) { c->cell.init(low[0], high[0], low[1], high[1], low[2], high[2]); }

extern "C" int VoroCellCut(VoroCell *c, const double n[3], double offset, int id)
{
  return c->cell.nplane(normal_length * n[0], normal_length * n[1], normal_length * n[2], 2 * normal_length * offset, id);
}

extern "C" void VoroCellCopy(VoroCell *to, VoroCell *from) { to->cell = from->cell; }

extern "C" double VoroCellReach(VoroCell *c) { return 0.5 * std::sqrt(c->cell.max_radius_squared()); }

extern "C" int VoroCellCorners(VoroCell *c, const double **corner)
{
  c->cell.vertices(c->point);
  *corner = c->point.data();
  return (int)(c->point.size() / 3);
}

extern "C" int VoroCellFacets(VoroCell *c, const int **id, const int **start, const double **corner)
{
  size_t at = 0;

  c->cell.vertices(c->point);
  c->cell.face_vertices(c->order);
  c->cell.neighbors(c->id);
  c->start.assign(1, 0);
  c->corner.clear();
  while (at < c->order.size()) {
    const int n = c->order[at];
    for (int k = 1; k <= n; k++)
      for (int d = 0; d < 3; d++) c->corner.push_back(c->point[3 * c->order[at + k] + d]);
    c->start.push_back(c->start.back() + n);
    at += n + 1;
  }
  *id = c->id.data();
  *start = c->start.data();
  *corner = c->corner.data();
  return (int)c->id.size();
}
