// The outlines of charts, each turned so that its box is small and moved to the origin.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "footprint.h"
#include "occlusion_kernel.h"

namespace ob {

// The chart lies to the left of the edge; `weight` times where triangles lie on one another, and 0 times along an edge
// that is there only to be in the layout.
struct OutlineEdge {
  Point2 from, to;
  int32_t weight;
};

struct ChartOutline {
  const OutlineEdge *edges = nullptr;
  int64_t edge_count = 0;
  Point2 side{1.0, 0.0}; // what lies along x once the chart is turned
  Point2 low{0.0, 0.0};  // of the turned chart
  double width = 0.0, height = 0.0, area = 0.0;
  double girth = 0.0; // half of the sum of |dx| + |dy| along the outline: width + height of a convex chart

  bool empty() const { return edge_count == 0; }
  Point2 turned(Point2 p) const { return {p.x * side.x + p.y * side.y - low.x, p.y * side.x - p.x * side.y - low.y}; }
};

struct PackingTriangles {
  const double *uv; // 6 a triangle
  const int32_t *chart;
  int64_t triangle_count, chart_count;
};

class ChartOutlines {
public:
  // align: charts may be turned by any angle. quarter: and are turned by a quarter on top of that, counter-clockwise.
  // Incomplete once cancelled.
  ChartOutlines(const PackingTriangles &triangles, bool align, bool quarter, int threads, ob_control *control);

  int64_t count() const { return static_cast<int64_t>(charts_.size()); }
  // Of charts that have triangles.
  int64_t filled() const { return filled_; }
  const ChartOutline &operator[](int64_t chart) const { return charts_[static_cast<size_t>(chart)]; }

private:
  std::vector<ChartOutline> charts_;
  std::vector<std::vector<OutlineEdge>> edges_; // of stretches of charts
  int64_t filled_ = 0;
};

} // namespace ob
