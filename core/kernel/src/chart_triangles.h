// A chart's triangles, as they are cut: half-edge 3 t + i runs from corner i of triangle t to its next corner.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace ob {

struct ChartTriangles {
  int32_t count;
  const double *corners;     // count x 9
  const int64_t *polygon;    // count; those of one number stay together
  const double *weight;      // of the half-edges: what a border along one costs; zero or more
  std::vector<int32_t> twin; // of the half-edges: the one on the other side, whose twin it is; -1 where the chart ends

  int32_t halves() const { return 3 * count; }
  int32_t twin_of(int32_t half) const { return twin[static_cast<size_t>(half)]; }
};

} // namespace ob
