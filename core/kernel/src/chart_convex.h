// Convex hulls of points in the plane.
#pragma once

#include "footprint.h"

namespace ob {

inline Point2 operator-(Point2 a, Point2 b) { return {a.x - b.x, a.y - b.y}; }
inline double cross(Point2 a, Point2 b) { return a.x * b.y - a.y * b.x; }

// For the sort; an object, so that it is compiled into that.
constexpr auto kIsBefore = [](Point2 a, Point2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); };

// Andrew 1979, "Another efficient algorithm for convex hulls in two dimensions": the chain under sorted points, then
// that over them; counter-clockwise. is_straight(a, b, c): whether b, on the way from a to c, is no corner of a chain
// that turns left. corners: room for twice as many as there are points. Returns how many corners there are.
template <typename Count, typename IsStraight>
Count convex_corners(const Point2 *points, Count count, Point2 *corners, IsStraight is_straight) {
  Point2 *chain = corners; // where it begins
  Point2 *end = corners;
  *end++ = points[0];
  const auto add = [&](Point2 point) {
    while (end - chain >= 2 && is_straight(end[-2], end[-1], point)) {
      --end;
    }
    *end++ = point;
  };
  for (Count i = 1; i < count; ++i) {
    add(points[i]);
  }
  chain = end - 1;
  for (Count i = count - 1; i-- > 0;) {
    add(points[i]);
  }
  const auto found = static_cast<Count>(end - corners);
  return found > 1 ? found - 1 : 1;
}

} // namespace ob
