// A mesh numbered anew, so that what lies together in space lies together in memory.
#pragma once

#include <cstdint>
#include <vector>

#include "chart_vectors.h"
#include "chart_watch.h"

namespace ob::simplify {

struct OrderedMesh {
  std::vector<Vector3> points;    // of vertices that a triangle uses, along a Z-order curve (Morton 1966)
  std::vector<int32_t> triangles; // three vertices each, by the first of these in that order
  std::vector<uint8_t> kept;
  std::vector<int32_t> vertex, triangle; // what their numbers were

  int32_t vertex_count() const { return static_cast<int32_t>(vertex.size()); }
  int32_t triangle_count() const { return static_cast<int32_t>(triangle.size()); }
};

OrderedMesh put_in_order(const double *points, int64_t vertex_count, const int32_t *triangles, int64_t triangle_count,
                         const uint8_t *kept, LoopWatch &watch);

} // namespace ob::simplify
