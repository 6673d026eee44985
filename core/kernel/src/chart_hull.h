// Convex polygons in the plane: triangles, hulls of few corners about many points, and what parts two of them.
#pragma once

#include <algorithm>
#include <cstdint>

#include "footprint.h"

namespace ob {

constexpr int kHullCorners = 8;
constexpr int kHullPoints = 24; // at most, to make one of

// Counter-clockwise.
struct Triangle2 {
  double x[3], y[3];
  static constexpr int kCount = 3;

  int count() const { return kCount; }
  double shortest2() const { return 0.0; }
};

struct Box2 {
  double low[2], high[2];

  double half_girth() const { return (high[0] - low[0]) + (high[1] - low[1]); }
};

// Counter-clockwise; the places after the last corner repeat it.
class Hull {
public:
  double x[kHullCorners], y[kHullCorners];
  static constexpr int kCount = kHullCorners;

  // About the points, which come to be sorted; of more corners than there is room for, those edges are left out, the
  // neighbours of which meet soonest beyond them.
  static Hull of(Point2 *points, int count);
  static Hull of(const Box2 &box);

  int count() const { return count_; }
  // The squared length below which an edge is too much at the mercy of rounding to tell the sides apart.
  double shortest2() const { return shortest2_; }

private:
  static Hull of(const Point2 *corners, int count, double size);

  double shortest2_;
  int32_t count_;
};

inline Box2 box_of(const Triangle2 &t) {
  return {{std::min({t.x[0], t.x[1], t.x[2]}), std::min({t.y[0], t.y[1], t.y[2]})},
          {std::max({t.x[0], t.x[1], t.x[2]}), std::max({t.y[0], t.y[1], t.y[2]})}};
}

inline Box2 about(const Box2 &a, const Box2 &b) {
  return {{std::min(a.low[0], b.low[0]), std::min(a.low[1], b.low[1])},
          {std::max(a.high[0], b.high[0]), std::max(a.high[1], b.high[1])}};
}

// Whether a step of `reach` along an axis parts the boxes, and so all that is in them.
inline bool boxes_part(const Box2 &a, const Box2 &b, double reach) {
  return a.high[0] - b.low[0] <= reach || b.high[0] - a.low[0] <= reach || //
         a.high[1] - b.low[1] <= reach || b.high[1] - a.low[1] <= reach;
}

// Whether none of b lies further than `reach` inside of one of a's edges: a step so long parts them.
template <typename A, typename B> bool edge_parts(const A &a, const B &b, double reach) {
  const int count = a.count();
  for (int i = 0; i < count; ++i) {
    const int next = i + 1 < count ? i + 1 : 0;
    const double dx = a.x[next] - a.x[i];
    const double dy = a.y[next] - a.y[i];
    double deepest = 0.0; // times the length of the edge
    for (int j = 0; j < B::kCount; ++j) {
      const double depth = dx * (b.y[j] - a.y[i]) - dy * (b.x[j] - a.x[i]);
      deepest = depth > deepest ? depth : deepest;
    }
    const double length2 = dx * dx + dy * dy;
    if (deepest * deepest <= reach * reach * length2 && length2 > a.shortest2()) {
      return true;
    }
  }
  return false;
}

// The separating axis theorem, with the edges of both.
template <typename A, typename B> bool edges_part(const A &a, const B &b, double reach) {
  return edge_parts(a, b, reach) || edge_parts(b, a, reach);
}

} // namespace ob
