// A chart's triangles as half-edges, with the lengths of their sides.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "chart_vectors.h"

namespace ob::flatten {

constexpr int32_t kNone = -1;

// Half-edge 4 t + i runs from corner i of triangle t to its next corner.
inline int32_t triangle_of(int32_t edge) { return edge >> 2; }
inline int32_t next_in_triangle(int32_t edge) { return (edge & 3) == 2 ? edge - 2 : edge + 1; }
inline int32_t previous_in_triangle(int32_t edge) { return (edge & 3) == 0 ? edge + 2 : edge - 1; }

struct Triangle {                       // by its half-edges
  std::array<int32_t, 3> origin;        // the vertex that each starts at; kNone: the triangle is gone
  std::array<int32_t, 3> twin;          // that of the other triangle; kNone: the edge is of the border
  std::array<double, 3> squared_length; // on the surface, which the two triangles of an edge may come to see unlike
  double area;
};

struct Mesh {
  std::vector<Triangle> triangles;
  std::vector<int32_t> outgoing; // of each vertex: the first half-edge of its fan, the border's where it lies there

  int32_t vertex_count() const { return static_cast<int32_t>(outgoing.size()); }
  int32_t triangle_count() const { return static_cast<int32_t>(triangles.size()); }

  const Triangle &triangle(int32_t edge) const { return triangles[at(triangle_of(edge))]; }
  Triangle &triangle(int32_t edge) { return triangles[at(triangle_of(edge))]; }
  int32_t origin(int32_t edge) const { return triangle(edge).origin[at(edge & 3)]; }
  int32_t &origin(int32_t edge) { return triangle(edge).origin[at(edge & 3)]; }
  int32_t target(int32_t edge) const { return origin(next_in_triangle(edge)); }
  int32_t twin(int32_t edge) const { return triangle(edge).twin[at(edge & 3)]; }
  int32_t &twin(int32_t edge) { return triangle(edge).twin[at(edge & 3)]; }
  double squared_length(int32_t edge) const { return triangle(edge).squared_length[at(edge & 3)]; }
  double &squared_length(int32_t edge) { return triangle(edge).squared_length[at(edge & 3)]; }
  double area(int32_t edge) const { return triangle(edge).area; }

  // The next half-edge, counter-clockwise, that starts at the same vertex; kNone: the fan ends at the border.
  int32_t next_around(int32_t edge) const { return twin(previous_in_triangle(edge)); }
  bool on_border(int32_t vertex) const { return twin(outgoing[at(vertex)]) == kNone; }

  // The angle at the start of a half-edge, in its triangle, as a complex number of length 2 |edge| |edge before|.
  Vector2 corner(int32_t edge) const {
    const double across = squared_length(next_in_triangle(edge));
    return {squared_length(edge) + squared_length(previous_in_triangle(edge)) - across, 4.0 * area(edge)};
  }
};

} // namespace ob::flatten
