// Charts that are flat already.
#pragma once

#include "chart_mesh.h"

namespace ob::flatten {

// Lays a chart out as it is, where all its vertices lie on one plane (within a millionth of its size, which is about 1)
// and all its triangles face one way. False, uv being of no meaning, where they do not.
bool lay_flat(const Mesh &mesh, const std::vector<Vector3> &points, std::vector<Vector2> &uv);

} // namespace ob::flatten
