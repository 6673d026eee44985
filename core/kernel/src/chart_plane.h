// Charts that are planes.
#pragma once

#include <cstdint>

namespace ob::flatten {

// Lays a chart onto its plane, whatever its outline, where it has one: no triangle leans off it, none but those without
// area, and no corner stands off it. triangles: from begin to end, 3 vertices each. uv: of all vertices, in the units
// of the points; those of the chart are written. False, with uv as it was, where there is no such plane.
bool project(const double *points, const int32_t *begin, const int32_t *end, double *uv);

} // namespace ob::flatten
