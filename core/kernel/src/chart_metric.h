// The shape of a chart's triangles by the lengths of their edges alone, as they are on the surface.
#pragma once

#include <vector>

#include "chart_mesh.h"

namespace ob::flatten {

struct Metric {
  std::vector<double> squared_length; // of each half-edge, in its own triangle
  std::vector<double> area;           // of each triangle

  // The angle at the start of a half-edge, in its triangle, as a complex number of length 2 |edge| |edge before|.
  Vector2 corner(int32_t edge) const {
    const auto length = [&](int32_t e) { return squared_length[static_cast<size_t>(e)]; };
    return {length(edge) + length(previous_in_triangle(edge)) - length(next_in_triangle(edge)),
            4.0 * area[static_cast<size_t>(edge / 3)]};
  }
};

// Measures the triangles. Those without a height, or nearly so, get one: edges are made longer by as little as gives
// every triangle a height of 1e-4 of its longest edge (intrinsic mollification, after Sharp and Crane 2020, "A
// Laplacian for Nonmanifold Triangle Meshes", but edge by edge). points: of each vertex, the chart about 1 large.
void measure(const HalfEdgeMesh &mesh, const std::vector<Vector3> &points, Metric &metric);

} // namespace ob::flatten
