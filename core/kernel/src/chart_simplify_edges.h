// Which triangles meet in an edge, and which edges are parts of lines that nothing may be collapsed across.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "chart_half_edges.h"
#include "chart_watch.h"

namespace ob::simplify {

struct MeshEdges {
  // Of each half-edge, the one that runs the other way in the triangle beside it; -1: its edge is part of a line.
  std::vector<int32_t> mate;
  // The ends of each edge that is part of a line, once.
  std::vector<std::array<int32_t, 2>> lines;
};

// Edges are parts of lines where they are marked in `kept` (a flag for each half-edge), and where they have other than
// two triangles that turn the same way.
MeshEdges find_edges(const std::vector<int32_t> &triangles, const std::vector<uint8_t> &kept, int32_t vertex_count,
                     LoopWatch &watch);

} // namespace ob::simplify
