// What a chart's dual graph and its coarser copies have in common.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace ob {

struct ChartGraph {
  std::vector<int64_t> first; // of a node's arcs; one more than there are nodes
  std::vector<int32_t> to;    // of the arcs; each edge is one from either side
  std::vector<double> weight; // of the arcs: what a border along it costs; above zero
  std::vector<double> border; // of the arcs: how long it is

  int32_t nodes() const { return static_cast<int32_t>(first.size()) - 1; }

  // Calls arc(its number, the node it leads to).
  template <typename Arc> void each_arc(int32_t node, Arc arc) const {
    const auto n = static_cast<size_t>(node);
    for (auto a = static_cast<size_t>(first[n]); a < static_cast<size_t>(first[n + 1]); ++a) {
      arc(a, to[a]);
    }
  }
};

} // namespace ob
