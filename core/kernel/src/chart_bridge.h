// The shortest way across a chart from one of its borders to another.
#pragma once

#include "chart_triangles.h"
#include "occlusion_kernel.h"

namespace ob {

// The half-edges of the path that costs least (Dijkstra 1959) from the border with the lowest corner to any other, in
// their order; it runs between polygons alone. None where the chart has one border or none, or there is no such path.
// Throws Stopped.
std::vector<int32_t> bridge(const ChartTriangles &chart, ob_control *control);

} // namespace ob
