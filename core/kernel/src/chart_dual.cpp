// Building the dual graph of a chart, and distances in it.
#include "chart_dual.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "chart_vectors.h"
#include "status.h"

namespace ob {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int64_t kPops = 4096; // between looks at whether it is cancelled
// By so much of their mean all lengths and weights are more than they are told to be: no two nodes are in one place,
// and no border is free.
constexpr double kLeast = 1e-6;

// Numbers from 0 in the order of the polygons' own.
std::vector<int32_t> numbered(const int64_t *polygon, int64_t count) {
  std::vector<int32_t> order(static_cast<size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  if (!std::is_sorted(polygon, polygon + count)) {
    std::sort(order.begin(), order.end(),
              [&](int32_t a, int32_t b) { return polygon[a] < polygon[b] || (polygon[a] == polygon[b] && a < b); });
  }
  std::vector<int32_t> number(order.size());
  int32_t last = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    last += i > 0 && polygon[order[i]] != polygon[order[i - 1]] ? 1 : 0;
    number[static_cast<size_t>(order[i])] = last;
  }
  return number;
}

// The chart's measures.
class Surface {
public:
  explicit Surface(const ChartTriangles &chart) : chart_(chart) {}

  Vector3 corner(int32_t t, int i) const {
    const double *p = chart_.corners + 9 * static_cast<int64_t>(t) + 3 * i;
    return {p[0], p[1], p[2]};
  }

  double area(int32_t t) const { return 0.5 * length(cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0))); }
  Vector3 centroid(int32_t t) const { return (1.0 / 3.0) * (corner(t, 0) + corner(t, 1) + corner(t, 2)); }
  Vector3 middle(int32_t t, int edge) const { return 0.5 * (corner(t, edge) + corner(t, (edge + 1) % 3)); }

  // Calls edge(triangle, its edge, the other triangle) once for each edge between two.
  template <typename Edge> void each_edge(Edge edge) const {
    for (int32_t half = 0; half < chart_.halves(); ++half) {
      const int32_t twin = chart_.twin_of(half);
      if (twin >= 0 && twin / 3 > half / 3) {
        edge(half / 3, half % 3, twin / 3);
      }
    }
  }

private:
  const ChartTriangles &chart_;
};

// The middle of each polygon: that of its area, or of its triangles' middles where it has none.
std::vector<Vector3> middles(const Surface &surface, Dual &dual) {
  const auto nodes = static_cast<size_t>(1 + *std::max_element(dual.node.begin(), dual.node.end()));
  dual.area.assign(nodes, 0.0);
  std::vector<Vector3> weighted(nodes, Vector3{});
  std::vector<Vector3> plain(nodes, Vector3{});
  std::vector<double> triangles(nodes, 0.0);
  for (size_t t = 0; t < dual.node.size(); ++t) {
    const auto n = at(dual.node[t]);
    const double area = surface.area(static_cast<int32_t>(t));
    dual.area[n] += area;
    weighted[n] = weighted[n] + area * surface.centroid(static_cast<int32_t>(t));
    plain[n] = plain[n] + surface.centroid(static_cast<int32_t>(t));
    triangles[n] += 1.0;
  }
  for (size_t n = 0; n < nodes; ++n) {
    const bool flat = !(dual.area[n] > std::numeric_limits<double>::min());
    weighted[n] = flat ? (1.0 / triangles[n]) * plain[n] : (1.0 / dual.area[n]) * weighted[n];
  }
  if (std::all_of(dual.area.begin(), dual.area.end(), [](double area) { return area == 0.0; })) {
    dual.area.assign(nodes, 1.0); // so that there is something to share
  }
  return weighted;
}

struct Way {
  double length;
  int32_t node;
};

// For the heap; an object, so that it is compiled into that.
constexpr auto kIsLonger = [](const Way &a, const Way &b) { return a.length > b.length; };

// Adds a small part of their mean to numbers of zero or more, or one where all are zero.
void lift(std::vector<double> &values) {
  double total = 0.0;
  for (const double value : values) {
    total += value;
  }
  const double least = total > 0.0 ? kLeast * total / static_cast<double>(values.size()) : 1.0;
  for (double &value : values) {
    value += least;
  }
}

} // namespace

Dual dual_of(const ChartTriangles &chart) {
  const Surface surface(chart);
  Dual dual;
  dual.node = numbered(chart.polygon, chart.count);
  const std::vector<Vector3> middle = middles(surface, dual);
  const auto each_border = [&](auto border) {
    surface.each_edge([&](int32_t t, int i, int32_t other) {
      const auto u = static_cast<size_t>(dual.node[static_cast<size_t>(t)]);
      const auto v = static_cast<size_t>(dual.node[static_cast<size_t>(other)]);
      if (u != v) {
        border(u, v, t, i);
      }
    });
  };
  dual.graph.first.assign(dual.area.size() + 1, 0);
  each_border([&](size_t u, size_t v, int32_t, int) {
    ++dual.graph.first[u + 1];
    ++dual.graph.first[v + 1];
  });
  std::partial_sum(dual.graph.first.begin(), dual.graph.first.end(), dual.graph.first.begin());
  const auto arcs = static_cast<size_t>(dual.graph.first.back());
  dual.graph.to.resize(arcs);
  dual.length.resize(arcs);
  dual.graph.weight.resize(arcs);
  dual.graph.border.resize(arcs);
  std::vector<int64_t> next(dual.graph.first.begin(), dual.graph.first.end() - 1);
  each_border([&](size_t u, size_t v, int32_t t, int i) {
    const Vector3 edge = surface.middle(t, i);
    const double way = length(edge - middle[u]) + length(edge - middle[v]);
    const double border = length(surface.corner(t, (i + 1) % 3) - surface.corner(t, i));
    for (const auto &[from, to] : {std::pair{u, v}, std::pair{v, u}}) {
      const auto arc = static_cast<size_t>(next[from]++);
      dual.graph.to[arc] = static_cast<int32_t>(to);
      dual.length[arc] = way;
      dual.graph.weight[arc] = chart.weight[3 * t + i];
      dual.graph.border[arc] = border;
    }
  });
  lift(dual.length);
  lift(dual.graph.weight);
  return dual;
}

std::vector<double> distances(const Dual &dual, int32_t from, ob_control *control) {
  std::vector<double> distance(dual.area.size(), kInfinity);
  std::vector<Way> open{{0.0, from}}; // a heap
  distance[static_cast<size_t>(from)] = 0.0;
  for (int64_t pops = 0; !open.empty() && !(pops % kPops == 0 && cancelled(control)); ++pops) {
    std::pop_heap(open.begin(), open.end(), kIsLonger);
    const Way way = open.back();
    open.pop_back();
    if (way.length > distance[static_cast<size_t>(way.node)]) {
      continue; // a shorter one has come since
    }
    dual.graph.each_arc(way.node, [&](size_t arc, int32_t to) {
      const double length = way.length + dual.length[arc];
      if (length < distance[static_cast<size_t>(to)]) {
        distance[static_cast<size_t>(to)] = length;
        open.push_back({length, to});
        std::push_heap(open.begin(), open.end(), kIsLonger);
      }
    });
  }
  return distance;
}

int32_t farthest(const std::vector<double> &distance) {
  return static_cast<int32_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
}

} // namespace ob
