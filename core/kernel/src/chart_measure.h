// Lengths and areas of a chart's triangles.
#pragma once

#include "chart_mesh.h"
#include "chart_watch.h"

namespace ob::flatten {

// Measures the triangles. Those without a height, or nearly so, get one: edges are made longer by as little as gives
// every triangle a height of 1e-4 of its longest edge (intrinsic mollification, after Sharp and Crane 2020, "A
// Laplacian for Nonmanifold Triangle Meshes", but edge by edge). points: of each vertex, the chart about 1 large.
void measure(const std::vector<Vector3> &points, const Watch &watch, Mesh &mesh);

} // namespace ob::flatten
