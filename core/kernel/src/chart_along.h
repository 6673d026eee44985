// How far along a chart each of its polygons lies, between two ends.
#pragma once

#include "chart_dual.h"

namespace ob {

// The difference of the ways over the surface to the two ends: from -span at the first to span at the second.
//
// Nodes below any one place hang together, and so do those above: on the shortest way from one of them to its end each
// is nearer still to that, by the triangle inequality. What has a way to neither end is at the first.
struct Along {
  int32_t ends[2];
  std::vector<double> at;
  double span; // infinite where there is no way from end to end
};

Along along_between(const Dual &dual, int32_t first, int32_t second, ob_control *control);

// Between the two nodes that are farthest apart, or nearly: the farthest from any one and the farthest from that.
Along along_length(const Dual &dual, ob_control *control);

} // namespace ob
