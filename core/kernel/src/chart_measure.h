// Lengths and areas of a chart's triangles.
#pragma once

#include "chart_mesh.h"
#include "chart_watch.h"

namespace ob::flatten {

// Measures the triangles. Those of a height below 1e-4 of their longest edge get one of 3e-4: edges are made longer by
// as little as it takes (intrinsic mollification, after Sharp and Crane 2020, "A Laplacian for Nonmanifold Triangle
// Meshes", but edge by edge). points: of each vertex, the chart about 1 large.
void measure(const std::vector<Vector3> &points, const Watch &watch, Mesh &mesh);

} // namespace ob::flatten
