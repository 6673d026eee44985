#include "chart_metric.h"

#include <algorithm>
#include <utility>

namespace ob::flatten {
namespace {

constexpr double kLeastHeight = 1e-4;      // of a triangle's longest edge
constexpr double kLeastEdge = 2e-4;        // of its triangles' longest edges
constexpr double kLeastEdgeOfChart = 1e-8; // of the chart's size
constexpr int kMostPasses = 8;             // an edge made longer may leave the next triangle without a height

size_t at(int32_t index) { return static_cast<size_t>(index); }

struct Sides {
  double longest, middle, shortest;
  int32_t longest_edge, middle_edge, shortest_edge;
};

Sides sorted_sides(const std::vector<double> &length, int32_t triangle) {
  std::pair<double, int32_t> side[3];
  for (int32_t i = 0; i < 3; ++i) {
    side[i] = {length[at(3 * triangle + i)], 3 * triangle + i};
  }
  std::sort(side, side + 3);
  return {side[2].first, side[1].first, side[0].first, side[2].second, side[1].second, side[0].second};
}

// 16 times the squared area, without loss for needles (Kahan, "Miscalculating Area and Angles of a Needle-like
// Triangle").
double heron(double longest, double middle, double shortest) {
  return (longest + (middle + shortest)) * (shortest - (longest - middle)) * (shortest + (longest - middle)) *
         (longest + (middle - shortest));
}

double least_heron(double longest) {
  const double doubled_area = kLeastHeight * longest * longest;
  return 4.0 * doubled_area * doubled_area;
}

void lengthen(const HalfEdgeMesh &mesh, std::vector<double> &length, int32_t edge, double value) {
  length[at(edge)] = value;
  if (mesh.twin[at(edge)] != kNone) {
    length[at(mesh.twin[at(edge)])] = value;
  }
}

// Returns whether the triangle lacked height.
bool give_height(const HalfEdgeMesh &mesh, std::vector<double> &length, int32_t triangle) {
  Sides s = sorted_sides(length, triangle);
  const double least = kLeastEdge * s.longest;
  const bool short_edge = s.shortest < least;
  if (short_edge) {
    s.shortest = least;
    s.middle = std::max(s.middle, least);
    lengthen(mesh, length, s.shortest_edge, s.shortest);
    lengthen(mesh, length, s.middle_edge, s.middle);
  }
  if (heron(s.longest, s.middle, s.shortest) >= least_heron(s.longest)) {
    return short_edge;
  }
  const double others = (s.longest + s.middle + s.shortest) * (s.shortest + (s.longest - s.middle)) *
                        (s.longest + (s.middle - s.shortest));
  const double excess = 1.0001 * least_heron(s.longest) / others; // of the two shorter sides over the longest
  const double missing = excess - (s.shortest - (s.longest - s.middle));
  const double share = missing / (s.middle + s.shortest);
  lengthen(mesh, length, s.middle_edge, s.middle * (1.0 + share));
  lengthen(mesh, length, s.shortest_edge, s.shortest * (1.0 + share));
  return true;
}

} // namespace

void measure(const HalfEdgeMesh &mesh, const std::vector<Vector3> &points, Metric &metric) {
  std::vector<double> &length = metric.squared_length; // not squared yet
  length.resize(mesh.origin.size());
  for (int32_t edge = 0; edge < static_cast<int32_t>(length.size()); ++edge) {
    const Vector3 along = points[at(mesh.target(edge))] - points[at(mesh.origin[at(edge)])];
    length[at(edge)] = std::max(std::sqrt(squared(along)), kLeastEdgeOfChart);
  }
  bool changed = true;
  for (int pass = 0; pass < kMostPasses && changed; ++pass) {
    changed = false;
    for (int32_t triangle = 0; triangle < mesh.triangle_count(); ++triangle) {
      changed |= give_height(mesh, length, triangle);
    }
  }
  metric.area.resize(at(mesh.triangle_count()));
  for (int32_t triangle = 0; triangle < mesh.triangle_count(); ++triangle) {
    const Sides s = sorted_sides(length, triangle);
    metric.area[at(triangle)] =
        0.25 * std::sqrt(std::max(heron(s.longest, s.middle, s.shortest), least_heron(s.longest)));
  }
  for (double &value : length) {
    value *= value;
  }
}

} // namespace ob::flatten
