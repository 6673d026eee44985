// A side of the smallest rectangle lies along an edge of the convex hull (Freeman and Shapira 1975, "Determining the
// minimum-area encasing rectangle for an arbitrary closed curve"); the corners that the other sides touch move on
// around the hull with that edge (Toussaint 1983, "Solving geometric problems with the rotating calipers").
#include "chart_rectangle.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "chart_convex.h"

namespace ob {
namespace {

// Rectangles whose areas differ by no more than this share are as good as one another.
constexpr double kAlike = 1e-6;

double dot(Point2 a, Point2 b) { return a.x * b.x + a.y * b.y; }

// Counter-clockwise, no three corners on a line.
std::vector<Point2> convex_hull(std::vector<Point2> &points) {
  std::sort(points.begin(), points.end(), kIsBefore);
  points.erase(std::unique(points.begin(), points.end(), [](Point2 a, Point2 b) { return a.x == b.x && a.y == b.y; }),
               points.end());
  std::vector<Point2> hull(2 * points.size());
  if (!points.empty()) {
    hull.resize(convex_corners(points.data(), points.size(), hull.data(),
                               [](Point2 a, Point2 b, Point2 c) { return cross(b - a, c - a) <= 0.0; }));
  }
  return hull;
}

double area_along_axes(const std::vector<Point2> &hull) {
  Point2 low = hull.front();
  Point2 high = low;
  for (const Point2 p : hull) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  return (high.x - low.x) * (high.y - low.y);
}

struct Candidate {
  Point2 side;
  double area;
};

// The corners that touch the sides of a rectangle along one edge of the hull.
class Calipers {
public:
  explicit Calipers(const std::vector<Point2> &hull) : hull_(hull) {}

  // For the edges in their order around the hull.
  Candidate along(size_t edge) {
    const Point2 a = hull_[edge];
    const Point2 b = hull_[(edge + 1) % hull_.size()];
    const double length = std::sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y));
    if (!(length > 0.0)) {
      return {{1.0, 0.0}, std::numeric_limits<double>::infinity()};
    }
    const Point2 along{(b.x - a.x) / length, (b.y - a.y) / length};
    const Point2 across{-along.y, along.x};
    right_ = farthest(std::max(right_, edge + 1), along);
    top_ = farthest(std::max(top_, right_), across);
    left_ = farthest(std::max(left_, top_), {-along.x, -along.y});
    return {along, (dot(at(right_), along) - dot(at(left_), along)) * (dot(at(top_), across) - dot(a, across))};
  }

private:
  Point2 at(size_t corner) const { return hull_[corner % hull_.size()]; }

  size_t farthest(size_t corner, Point2 direction) const {
    for (size_t step = 0; step < hull_.size() && dot(at(corner + 1), direction) > dot(at(corner), direction); ++step) {
      ++corner;
    }
    return corner;
  }

  const std::vector<Point2> &hull_;
  size_t right_ = 0, top_ = 0, left_ = 0;
};

// The one of the four directions of a rectangle's sides that is nearest to (1, 0).
Point2 least_turn(Point2 side) {
  if (std::fabs(side.x) < std::fabs(side.y)) {
    side = {side.y, -side.x};
  }
  return side.x < 0.0 ? Point2{-side.x, -side.y} : side;
}

} // namespace

Point2 smallest_rectangle(std::vector<Point2> &points) {
  const std::vector<Point2> hull = convex_hull(points);
  if (hull.size() < 2) {
    return {1.0, 0.0};
  }
  std::vector<Candidate> candidates{{{1.0, 0.0}, area_along_axes(hull)}};
  Calipers calipers(hull);
  for (size_t edge = 0; edge < hull.size(); ++edge) {
    candidates.push_back(calipers.along(edge));
  }
  double least = std::numeric_limits<double>::infinity();
  for (const Candidate &candidate : candidates) {
    least = std::min(least, candidate.area);
  }
  Point2 best{0.0, 0.0};
  for (const Candidate &candidate : candidates) {
    const Point2 side = least_turn(candidate.side);
    if (candidate.area <= least * (1.0 + kAlike) && side.x > best.x) {
      best = side;
    }
  }
  return best;
}

} // namespace ob
