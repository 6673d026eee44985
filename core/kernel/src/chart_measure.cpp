#include "chart_measure.h"

#include <algorithm>
#include <utility>

namespace ob::flatten {
namespace {

constexpr double kLeastHeight = 1e-4;      // of a triangle's longest edge
constexpr double kGivenHeight = 3e-4;      // to one with less: float32 has to tell it from none
constexpr double kLeastEdge = 2e-4;        // of its triangles' longest edges
constexpr double kLeastEdgeOfChart = 1e-8; // of the chart's size
constexpr int kMostPasses = 8;             // an edge made longer may leave the next triangle without a height

struct Sides { // of a triangle, and which half-edges they are
  double longest, middle, shortest;
  int32_t middle_edge, shortest_edge;
};

// While triangles are measured, they have their edges' lengths, not the squares.
Sides sides_of(const Mesh &mesh, int32_t triangle) {
  std::pair<double, int32_t> side[3];
  for (int32_t i = 0; i < 3; ++i) {
    side[i] = {mesh.squared_length(4 * triangle + i), 4 * triangle + i};
  }
  std::sort(side, side + 3);
  return {side[2].first, side[1].first, side[0].first, side[1].second, side[0].second};
}

// Three of the four factors of Heron's formula, and the fourth, which is what a triangle's two shorter sides have over
// the longest one; without loss for needles (Kahan, "Miscalculating Area and Angles of a Needle-like Triangle"). Their
// product is 16 times the squared area.
double heron_others(const Sides &s) {
  return (s.longest + (s.middle + s.shortest)) * (s.shortest + (s.longest - s.middle)) *
         (s.longest + (s.middle - s.shortest));
}
double heron_excess(const Sides &s) { return s.shortest - (s.longest - s.middle); }

double heron_of(double height, double longest) {
  const double doubled_area = height * longest * longest;
  return 4.0 * doubled_area * doubled_area;
}

void lengthen(Mesh &mesh, int32_t edge, double length) {
  mesh.squared_length(edge) = length;
  if (mesh.twin(edge) != kNone) {
    mesh.squared_length(mesh.twin(edge)) = length;
  }
}

// Returns whether the triangle lacked height.
bool give_height(Mesh &mesh, int32_t triangle) {
  Sides s = sides_of(mesh, triangle);
  const double least = kLeastEdge * s.longest;
  const bool short_edge = s.shortest < least;
  if (short_edge) {
    s.shortest = least;
    s.middle = std::max(s.middle, least);
    lengthen(mesh, s.shortest_edge, s.shortest);
    lengthen(mesh, s.middle_edge, s.middle);
  }
  const double others = heron_others(s);
  const double excess = heron_excess(s);
  if (others * excess >= heron_of(kLeastHeight, s.longest)) {
    return short_edge;
  }
  const double missing = heron_of(kGivenHeight, s.longest) / others - excess;
  const double factor = 1.0 + missing / (s.middle + s.shortest);
  lengthen(mesh, s.middle_edge, s.middle * factor);
  lengthen(mesh, s.shortest_edge, s.shortest * factor);
  return true;
}

void measure_edges(const std::vector<Vector3> &points, const Watch &watch, Mesh &mesh) {
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    watch.look_at_times(i);
    Triangle &triangle = mesh.triangles[i];
    const Vector3 a = points[at(triangle.origin[0])];
    const Vector3 b = points[at(triangle.origin[1])];
    const Vector3 c = points[at(triangle.origin[2])];
    triangle.squared_length = {std::max(length(b - a), kLeastEdgeOfChart), std::max(length(c - b), kLeastEdgeOfChart),
                               std::max(length(a - c), kLeastEdgeOfChart)};
  }
}

} // namespace

void measure(const std::vector<Vector3> &points, const Watch &watch, Mesh &mesh) {
  measure_edges(points, watch, mesh);
  bool changed = true;
  for (int pass = 0; pass < kMostPasses && changed; ++pass) {
    changed = false;
    for (int32_t triangle = 0; triangle < mesh.triangle_count(); ++triangle) {
      watch.look_at_times(at(triangle));
      changed |= give_height(mesh, triangle);
    }
  }
  for (int32_t triangle = 0; triangle < mesh.triangle_count(); ++triangle) {
    const Sides s = sides_of(mesh, triangle);
    const double heron = std::max(heron_others(s) * heron_excess(s), heron_of(0.5 * kLeastHeight, s.longest));
    mesh.triangles[at(triangle)].area = 0.25 * std::sqrt(heron);
    for (double &length : mesh.triangles[at(triangle)].squared_length) {
      length *= length;
    }
  }
}

} // namespace ob::flatten
