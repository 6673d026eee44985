// Hulls of points, kept small.
#include "chart_hull.h"

#include <cmath>

#include "chart_convex.h"

namespace ob {
namespace {

// A corner this little off the line between its neighbours, as a part of the whole, is left out: so the lines that meet
// beyond an edge are never parallel to all of a double's digits.
constexpr double kStraight = 0x1p-46;
// An edge as short as this, as a part of the whole, has turned by too much where an end of it was rounded.
constexpr double kShort = 0x1p-10;

// Whether b, on the way from a to c, is no corner of a chain that turns left.
bool is_straight(Point2 a, Point2 b, Point2 c, double off) {
  const Point2 d = c - a;
  return cross(b - a, d) <= off * std::sqrt(d.x * d.x + d.y * d.y);
}

// An edge between two others that meet beyond it.
struct Tip {
  Point2 at;
  double area; // of what would be added; infinite where they do not meet
};

Tip tip_beyond(const Point2 *corners, int count, int edge) {
  const Point2 b = corners[edge];
  const Point2 c = corners[(edge + 1) % count];
  const Point2 u = b - corners[(edge + count - 1) % count];
  const Point2 v = c - corners[(edge + 2) % count];
  const double turn = cross(v, u);
  if (!(turn > 0.0)) {
    return {b, INFINITY};
  }
  const double along = std::max(0.0, cross(v, c - b) / turn);
  return {{b.x + along * u.x, b.y + along * u.y}, 0.5 * along * cross(u, c - b)};
}

// Takes out the edge that adds the least area. False where none can go, as of four corners at right angles.
bool drop_edge(Point2 *corners, int count) {
  int least = -1;
  Tip best{{}, INFINITY};
  for (int edge = 0; edge < count; ++edge) {
    const Tip tip = tip_beyond(corners, count, edge);
    if (tip.area < best.area) {
      least = edge;
      best = tip;
    }
  }
  if (least < 0) {
    return false;
  }
  corners[least] = best.at;
  const int gone = (least + 1) % count;
  std::copy(corners + gone + 1, corners + count, corners + gone);
  return true;
}

} // namespace

Hull Hull::of(Point2 *points, int count) {
  Point2 corners[2 * kHullPoints];
  std::sort(points, points + count, kIsBefore); // equal points are alike
  Box2 box{{points[0].x, points[0].y}, {points[0].x, points[0].y}};
  for (int i = 1; i < count; ++i) {
    box = about(box, {{points[i].x, points[i].y}, {points[i].x, points[i].y}});
  }
  const double size = box.half_girth();
  const double off = kStraight * size;
  int found =
      convex_corners(points, count, corners, [off](Point2 a, Point2 b, Point2 c) { return is_straight(a, b, c, off); });
  while (found > kHullCorners && drop_edge(corners, found)) {
    --found;
  }
  return found > kHullCorners ? of(box) : of(corners, found, size);
}

Hull Hull::of(const Box2 &box) {
  const Point2 corners[] = {
      {box.low[0], box.low[1]}, {box.high[0], box.low[1]}, {box.high[0], box.high[1]}, {box.low[0], box.high[1]}};
  return of(corners, 4, box.half_girth());
}

Hull Hull::of(const Point2 *corners, int count, double size) {
  Hull hull{};
  hull.count_ = count;
  hull.shortest2_ = kShort * size * (kShort * size);
  Point2 corner = corners[0];
  for (int i = 0; i < kHullCorners; ++i) {
    corner = i < count ? corners[i] : corner;
    hull.x[i] = corner.x;
    hull.y[i] = corner.y;
  }
  return hull;
}

} // namespace ob
