// A small disk laid out in a circle.
#pragma once

#include "chart_hierarchy.h"

namespace ob::flatten {

// Each vertex of the border on a circle, by the lengths of its edges, and each other one in the middle of its
// neighbours: no triangle turns over (Tutte 1963, "How to Draw a Graph"). The level is that of the mesh.
void lay_in_circle(const Mesh &mesh, const Level &level, const Watch &watch, std::vector<Vector2> &uv);

} // namespace ob::flatten
