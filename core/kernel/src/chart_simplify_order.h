// A mesh numbered anew, so that what lies together in space lies together in memory.
#pragma once

#include <cstdint>
#include <vector>

#include "chart_vectors.h"
#include "chart_watch.h"

namespace ob::simplify {

struct OrderedMesh {
  std::vector<int32_t> vertex; // the old numbers of vertices that a triangle uses, along a Z-order curve (Morton 1966)
  std::vector<int32_t> triangle;  // those of triangles, by the first of their vertices in that order
  std::vector<int32_t> triangles; // three vertices each, by their new numbers
  std::vector<uint8_t> kept;      // of each half-edge

  int32_t vertex_count() const { return static_cast<int32_t>(vertex.size()); }
  int32_t triangle_count() const { return static_cast<int32_t>(triangle.size()); }
};

// points: three numbers for each vertex.
OrderedMesh put_in_order(const double *points, int64_t vertex_count, const int32_t *triangles, int64_t triangle_count,
                         const uint8_t *kept, LoopWatch &watch);

} // namespace ob::simplify
