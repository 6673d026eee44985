// The smallest rectangle about points.
#pragma once

#include <vector>

#include "footprint.h"

namespace ob {

// The direction, of length 1 and within 45 degrees of (1, 0), of a side of the rectangle of least area about the
// points, which come to be sorted. (1, 0) itself wherever a rectangle along the axes is as small to within rounding.
Point2 smallest_rectangle(std::vector<Point2> &points);

} // namespace ob
