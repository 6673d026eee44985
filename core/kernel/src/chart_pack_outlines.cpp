#include "chart_pack_outlines.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>

#include "chart_rectangle.h"
#include "parallel.h"
#include "status.h"

namespace ob {
namespace {

bool same(Point2 a, Point2 b) { return a.x == b.x && a.y == b.y; }

bool before(Point2 a, Point2 b) { return a.x != b.x ? a.x < b.x : a.y < b.y; }

uint64_t hash(Point2 p) {
  uint64_t x = 0;
  uint64_t y = 0;
  std::memcpy(&x, &p.x, sizeof x);
  std::memcpy(&y, &p.y, sizeof y);
  uint64_t z = x * 0x9e3779b97f4a7c15U + (y ^ (y >> 29)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 30)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31);
}

// The edges of a chart's triangles, those that two triangles use in opposite directions left out.
class OutlineBuilder {
public:
  // For so many triangles.
  void begin(int64_t triangles) {
    size_t slots = 8;
    while (slots < 6 * static_cast<size_t>(triangles)) {
      slots *= 2;
    }
    slots_.assign(slots, -1);
    edges_.clear();
  }

  // A triangle without area does not tell a left from a right: its edges have no weight, and cancel no other.
  void add(const double *uv) {
    // Adding 0 makes -0 into 0, so that equal points have equal bits.
    Point2 p[3] = {{uv[0] + 0.0, uv[1] + 0.0}, {uv[2] + 0.0, uv[3] + 0.0}, {uv[4] + 0.0, uv[5] + 0.0}};
    const double doubled = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[1].y - p[0].y) * (p[2].x - p[0].x);
    if (doubled < 0.0) { // not to be, but then it is to cover its texels all the same
      std::swap(p[1], p[2]);
    }
    for (int i = 0; i < 3; ++i) {
      doubled == 0.0 ? edges_.push_back({p[i], p[(i + 1) % 3], 0}) : add(p[i], p[(i + 1) % 3]);
    }
    area_ += 0.5 * std::fabs(doubled);
  }

  // Moves the outline to the end of `edges`, and returns the area.
  double finish(std::vector<OutlineEdge> &edges) {
    for (const Counted &counted : edges_) {
      if (counted.weight != 0 || counted.slotless) {
        edges.push_back(counted.weight < 0 ? OutlineEdge{counted.to, counted.from, -counted.weight}
                                           : OutlineEdge{counted.from, counted.to, counted.weight});
      }
    }
    return std::exchange(area_, 0.0);
  }

private:
  struct Counted {
    Point2 from, to;
    int32_t weight;
    bool slotless = true; // in no slot: kept whatever its weight
  };

  void add(Point2 from, Point2 to) {
    const int32_t direction = before(from, to) ? 1 : -1;
    if (direction < 0) {
      std::swap(from, to);
    }
    const size_t mask = slots_.size() - 1;
    for (size_t slot = (hash(from) * 3 + hash(to)) & mask;; slot = (slot + 1) & mask) {
      if (slots_[slot] < 0) {
        slots_[slot] = static_cast<int64_t>(edges_.size());
        edges_.push_back({from, to, direction, false});
        return;
      }
      Counted &edge = edges_[static_cast<size_t>(slots_[slot])];
      if (same(edge.from, from) && same(edge.to, to)) {
        edge.weight += direction;
        return;
      }
    }
  }

  std::vector<int64_t> slots_;
  std::vector<Counted> edges_;
  double area_ = 0.0;
};

// Triangles in the order of their charts: those of chart c are order[starts[c]] to order[starts[c + 1] - 1].
struct Grouped {
  std::vector<int64_t> starts, order;

  explicit Grouped(const PackingTriangles &triangles)
      : starts(static_cast<size_t>(triangles.chart_count) + 1), order(static_cast<size_t>(triangles.triangle_count)) {
    for (int64_t t = 0; t < triangles.triangle_count; ++t) {
      ++starts[static_cast<size_t>(triangles.chart[t]) + 1];
    }
    std::partial_sum(starts.begin(), starts.end(), starts.begin());
    std::vector<int64_t> next(starts.begin(), starts.end() - 1);
    for (int64_t t = 0; t < triangles.triangle_count; ++t) {
      order[static_cast<size_t>(next[static_cast<size_t>(triangles.chart[t])]++)] = t;
    }
  }
};

// Turns the outline as the chart is told to be, and moves it to the origin.
void settle(ChartOutline &chart, std::vector<OutlineEdge> &edges, size_t first) {
  Point2 low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  Point2 high{-low.x, -low.y};
  for (size_t i = first; i < edges.size(); ++i) {
    for (Point2 *p : {&edges[i].from, &edges[i].to}) {
      *p = chart.turned(*p);
      low = {std::min(low.x, p->x), std::min(low.y, p->y)};
      high = {std::max(high.x, p->x), std::max(high.y, p->y)};
    }
  }
  double around = 0.0;
  for (size_t i = first; i < edges.size(); ++i) {
    OutlineEdge &edge = edges[i];
    edge.from = {edge.from.x - low.x, edge.from.y - low.y};
    edge.to = {edge.to.x - low.x, edge.to.y - low.y};
    around += std::fabs(edge.to.x - edge.from.x) + std::fabs(edge.to.y - edge.from.y);
  }
  chart.low = low;
  chart.width = high.x - low.x;
  chart.height = high.y - low.y;
  chart.girth = 0.5 * around;
}

// Stretches of charts, each of about so many triangles.
std::vector<int64_t> stretches(const std::vector<int64_t> &starts, int64_t triangles) {
  std::vector<int64_t> ends{0};
  const auto charts = static_cast<int64_t>(starts.size()) - 1;
  for (int64_t c = 0; c < charts; ++c) {
    if (starts[static_cast<size_t>(c) + 1] - starts[static_cast<size_t>(ends.back())] >= triangles || c + 1 == charts) {
      ends.push_back(c + 1);
    }
  }
  return ends;
}

} // namespace

ChartOutlines::ChartOutlines(const PackingTriangles &triangles, bool align, bool quarter, int threads,
                             ob_control *control)
    : charts_(static_cast<size_t>(triangles.chart_count)) {
  const Grouped grouped(triangles);
  const std::vector<int64_t> ends = stretches(grouped.starts, 4096);
  edges_.resize(ends.size() - 1);
  const auto outline = [&](int64_t c, OutlineBuilder &builder, std::vector<OutlineEdge> &edges) {
    ChartOutline &chart = charts_[static_cast<size_t>(c)];
    const int64_t begin = grouped.starts[static_cast<size_t>(c)];
    const int64_t end = grouped.starts[static_cast<size_t>(c) + 1];
    builder.begin(end - begin);
    for (int64_t i = begin; i < end && ((i - begin) % 4096 != 0 || !cancelled(control)); ++i) {
      builder.add(triangles.uv + 6 * grouped.order[static_cast<size_t>(i)]);
    }
    const size_t first = edges.size();
    chart.area = builder.finish(edges);
    chart.edge_count = static_cast<int64_t>(edges.size() - first);
    if (align) {
      std::vector<Point2> points;
      for (size_t i = first; i < edges.size(); ++i) {
        points.insert(points.end(), {edges[i].from, edges[i].to});
      }
      chart.side = smallest_rectangle(points);
    }
    if (quarter) {
      chart.side = {chart.side.y, -chart.side.x};
    }
    if (!chart.empty()) {
      settle(chart, edges, first);
    }
  };
  run_parallel(threads, static_cast<int64_t>(edges_.size()), [&](auto next) {
    OutlineBuilder builder;
    for (int64_t piece = next(); piece >= 0 && !cancelled(control); piece = next()) {
      std::vector<OutlineEdge> &edges = edges_[static_cast<size_t>(piece)];
      const int64_t first = ends[static_cast<size_t>(piece)];
      const int64_t last = ends[static_cast<size_t>(piece) + 1];
      for (int64_t c = first; c < last && !cancelled(control); ++c) {
        outline(c, builder, edges);
      }
      const OutlineEdge *at = edges.data();
      for (int64_t c = first; c < last; ++c) {
        charts_[static_cast<size_t>(c)].edges = at;
        at += charts_[static_cast<size_t>(c)].edge_count;
      }
    }
  });
  filled_ = std::count_if(charts_.begin(), charts_.end(), [](const ChartOutline &chart) { return !chart.empty(); });
}

} // namespace ob
