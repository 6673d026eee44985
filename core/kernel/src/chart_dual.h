// The dual graph of a chart: its polygons, and the edges across which they meet.
#pragma once

#include "chart_graph.h"
#include "chart_triangles.h"
#include "occlusion_kernel.h"

namespace ob {

struct Dual {
  ChartGraph graph;
  std::vector<int32_t> node;  // of each triangle: its polygon, from 0
  std::vector<double> area;   // of the nodes; if they have none, one each
  std::vector<double> length; // of the arcs: from middle to middle by way of the edge; above zero
};

// Of a chart of at least one triangle; its corners and weights are no larger than OB_LARGEST.
Dual dual_of(const ChartTriangles &chart);

// Of each node the length of the shortest way from one: Dijkstra 1959. Infinite where there is none, and where it was
// cancelled.
std::vector<double> distances(const Dual &dual, int32_t from, ob_control *control);

// The node with the greatest distance, or one that there is no way to; of several the first.
int32_t farthest(const std::vector<double> &distance);

} // namespace ob
