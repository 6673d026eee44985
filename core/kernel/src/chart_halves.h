// A chart's graph cut in two along a short border.
#pragma once

#include "chart_dual.h"

namespace ob {

// Of each node the side it is on, 0 or 1; both sides hang together. A border is taken for shorter, the more evenly it
// shares out the area. first, second: two nodes, on side 0 and on side 1; where they are one, two that are about as far
// apart as any, so that long charts are cut across their length. All 0 where there is but one node. Of no meaning once
// it is cancelled.
//
// The minimum cut (Ford and Fulkerson 1956) in a range between the two ends, on coarse copies of the graph first, as in
// graph partitioning (Hendrickson and Leland 1995, "A multilevel algorithm for partitioning graphs"), with costs as in
// a ratio cut (Hagen and Kahng 1992).
std::vector<uint8_t> halves(const Dual &dual, int32_t first, int32_t second, ob_control *control);

} // namespace ob
