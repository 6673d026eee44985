// Ever coarser copies of a chart's graph.
#pragma once

#include "chart_graph.h"

namespace ob {

struct CoarseGraph {
  ChartGraph graph;
  std::vector<double> at;      // of the nodes: the mean place of those of the finer graph
  std::vector<int32_t> parent; // of the nodes of the finer graph: the node that each is part of
};

// Neighbours put together, a few each time, until no more than `enough` nodes are left or they hardly become fewer.
// at: a place of each node, or anything else that has a mean. Finest first.
std::vector<CoarseGraph> coarse_graphs(const ChartGraph &graph, const std::vector<double> &at, int64_t enough);

} // namespace ob
