// Bridges: the vertices of a chart, its borders, and the cheapest path between two of them.
#include "chart_bridge.h"

#include <functional>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "chart_half_edges.h"
#include "chart_vectors.h"
#include "chart_watch.h"

namespace ob {
namespace {

constexpr int32_t kNone = -1;

// Which corners are one vertex where the chart goes on between them. A vertex's triangles are a fan, so that each on a
// border has one half-edge of the border that starts there, and borders are loops.
class Vertices {
public:
  explicit Vertices(const ChartTriangles &chart) : chart_(chart), vertex_(chart.twin.size(), kNone) {
    for (int32_t corner = 0; corner < chart.halves(); ++corner) {
      if (vertex_[at(corner)] == kNone) {
        border_.push_back(number_fan(corner, count()));
      }
    }
  }

  int32_t count() const { return static_cast<int32_t>(border_.size()); }
  int32_t tail(int32_t half) const { return vertex_[at(half)]; }
  int32_t head(int32_t half) const { return vertex_[at(next_corner(half))]; }
  int32_t border(int32_t vertex) const { return border_[at(vertex)]; }

private:
  // The half-edge of the border that starts there, or kNone.
  int32_t number_fan(int32_t corner, int32_t number) {
    for (int32_t half = corner;;) {
      vertex_[at(half)] = number;
      if (chart_.twin_of(half) == kNone) {
        number_back(corner, number);
        return half;
      }
      half = next_corner(chart_.twin_of(half));
      if (half == corner) {
        return kNone;
      }
    }
  }

  void number_back(int32_t corner, int32_t number) {
    int32_t half = chart_.twin_of(previous_corner(corner));
    while (half != kNone) {
      vertex_[at(half)] = number;
      half = chart_.twin_of(previous_corner(half));
    }
  }

  const ChartTriangles &chart_;
  std::vector<int32_t> vertex_; // of each corner, numbered in the order of their first corners
  std::vector<int32_t> border_; // of each vertex
};

// Of each vertex the half-edges that start there and that a bridge may run along, lowest first.
class Ways {
public:
  Ways(const ChartTriangles &chart, const Vertices &vertices) : first_(at(vertices.count()) + 1, 0) {
    const auto each_way = [&](auto way) {
      for (int32_t half = 0; half < chart.halves(); ++half) {
        const int32_t beyond = chart.twin_of(half);
        if (beyond != kNone && chart.polygon[half / 3] != chart.polygon[beyond / 3]) {
          way(half);
        }
      }
    };
    each_way([&](int32_t half) { ++first_[at(vertices.tail(half)) + 1]; });
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    half_.resize(at(first_.back()));
    std::vector<int32_t> next(first_.begin(), first_.end() - 1);
    each_way([&](int32_t half) { half_[at(next[at(vertices.tail(half))]++)] = half; });
  }

  template <typename Way> void each_from(int32_t vertex, Way way) const {
    for (int32_t i = first_[at(vertex)]; i < first_[at(vertex) + 1]; ++i) {
      way(half_[at(i)]);
    }
  }

private:
  std::vector<int32_t> first_; // of a vertex's half-edges; one more than there are vertices
  std::vector<int32_t> half_;
};

// The border with the lowest vertex: of each vertex whether it lies there. Empty where there is no other border.
std::vector<uint8_t> first_border(const Vertices &vertices) {
  std::vector<uint8_t> on_first(at(vertices.count()), 0);
  int32_t first = 0;
  while (first < vertices.count() && vertices.border(first) == kNone) {
    ++first;
  }
  if (first < vertices.count()) {
    int32_t vertex = first;
    do {
      on_first[at(vertex)] = 1;
      vertex = vertices.head(vertices.border(vertex));
    } while (vertex != first);
  }
  for (int32_t vertex = first; vertex < vertices.count(); ++vertex) {
    if (vertices.border(vertex) != kNone && on_first[at(vertex)] == 0) {
      return on_first;
    }
  }
  return {};
}

class Search {
public:
  Search(const ChartTriangles &chart, const Vertices &vertices, const std::vector<uint8_t> &start, ob_control *control)
      : chart_(chart), vertices_(vertices), start_(start), ways_(chart, vertices), watch_(control),
        reached_(start.size(), std::numeric_limits<double>::infinity()), by_(start.size(), kNone) {
    for (int32_t vertex = 0; vertex < vertices.count(); ++vertex) {
      if (start[at(vertex)] != 0) {
        reach(vertex, 0.0, kNone);
      }
    }
  }

  std::vector<int32_t> path() {
    while (!open_.empty()) {
      watch_.look();
      const auto [cost, vertex] = open_.top();
      open_.pop();
      if (cost > reached_[at(vertex)]) {
        continue; // a cheaper way has come since
      }
      if (vertices_.border(vertex) != kNone && start_[at(vertex)] == 0) {
        return path_to(vertex);
      }
      ways_.each_from(vertex, [&, so_far = cost](int32_t half) {
        const double further = so_far + chart_.weight[half];
        if (further < reached_[at(vertices_.head(half))]) {
          reach(vertices_.head(half), further, half);
        }
      });
    }
    return {};
  }

private:
  using Reached = std::pair<double, int32_t>; // its cost and the vertex: of equals the lowest comes first

  void reach(int32_t vertex, double cost, int32_t half) {
    reached_[at(vertex)] = cost;
    by_[at(vertex)] = half;
    open_.emplace(cost, vertex);
  }

  std::vector<int32_t> path_to(int32_t vertex) const {
    std::vector<int32_t> halves;
    for (int32_t half = by_[at(vertex)]; half != kNone; half = by_[at(vertices_.tail(half))]) {
      halves.push_back(half);
    }
    return {halves.rbegin(), halves.rend()};
  }

  const ChartTriangles &chart_;
  const Vertices &vertices_;
  const std::vector<uint8_t> &start_;
  Ways ways_;
  LoopWatch watch_;
  std::vector<double> reached_; // of each vertex: what the way to it costs
  std::vector<int32_t> by_;     // of each vertex: the half-edge by which it was reached
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> open_;
};

} // namespace

std::vector<int32_t> bridge(const ChartTriangles &chart, ob_control *control) {
  const Vertices vertices(chart);
  const std::vector<uint8_t> start = first_border(vertices);
  return start.empty() ? std::vector<int32_t>{} : Search(chart, vertices, start, control).path();
}

} // namespace ob
