// How much charts are stretched.
#pragma once

#include <cstdint>

namespace ob::flatten {

// Squares of the L2 stretch (Sander et al. 2001) of the triangles of a chart, from begin to end, 3 vertices each, after
// one scale for the chart; 1 for those without area, on the surface or in the plane.
void measure_stretch(const double *points, const double *uv, const int32_t *begin, const int32_t *end, double *squared);

} // namespace ob::flatten
