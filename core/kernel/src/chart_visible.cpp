#include "chart_visible.h"

#include <algorithm>

namespace ob::flatten {
namespace {

constexpr double kLeastShare = 1e-6; // of a triangle in the area of all
constexpr int kMostHalvings = 40;

struct Polygon {
  static constexpr int32_t kRoom = 2 * kMostSpokes; // a convex one gets at most a corner more by each of the sides

  int32_t count = 0;
  std::array<Vector2, kRoom> point;
};

// What lies left of the line from a to b; empty where rounding has made it so little convex that it has no room.
Polygon clipped(const Polygon &polygon, Vector2 a, Vector2 b) {
  Polygon left;
  for (int32_t i = 0; i < polygon.count; ++i) {
    if (left.count + 2 > Polygon::kRoom) {
      return {};
    }
    const Vector2 p = polygon.point[at(i)];
    const Vector2 q = polygon.point[at(i + 1 == polygon.count ? 0 : i + 1)];
    const double of_p = doubled_area(a, b, p);
    const double of_q = doubled_area(a, b, q);
    if (of_p >= 0.0) {
      left.point[at(left.count++)] = p;
    }
    if ((of_p >= 0.0) != (of_q >= 0.0)) {
      left.point[at(left.count++)] = p + (of_p / (of_p - of_q)) * (q - p);
    }
  }
  return left;
}

// The rim's box; of an open rim with as much room around it, as the vertex may lie outside.
Polygon box(const Rim &rim) {
  Vector2 low = rim.point[0];
  Vector2 high = low;
  for (int32_t i = 1; i < rim.count; ++i) {
    low = {std::min(low.x, rim.point[at(i)].x), std::min(low.y, rim.point[at(i)].y)};
    high = {std::max(high.x, rim.point[at(i)].x), std::max(high.y, rim.point[at(i)].y)};
  }
  const double room = rim.closed ? 0.0 : 0.5 * std::max(high.x - low.x, high.y - low.y);
  low = {low.x - room, low.y - room};
  high = {high.x + room, high.y + room};
  Polygon polygon;
  polygon.count = 4;
  polygon.point[0] = low;
  polygon.point[1] = {high.x, low.y};
  polygon.point[2] = high;
  polygon.point[3] = {low.x, high.y};
  return polygon;
}

bool middle_of_kernel(const Rim &rim, Vector2 &middle) {
  Polygon kernel = box(rim);
  for (int32_t i = 0; i < rim.sides() && kernel.count > 0; ++i) {
    kernel = clipped(kernel, rim.point[at(i)], rim.point[at(rim.after(i))]);
  }
  if (kernel.count < 3) {
    return false;
  }
  middle = {0.0, 0.0};
  for (int32_t i = 0; i < kernel.count; ++i) {
    middle = middle + (1.0 / kernel.count) * kernel.point[at(i)];
  }
  return sees_all(rim, middle);
}

// As far towards the place as all is seen, and half the way back.
Vector2 nearest_to(const Rim &rim, Vector2 middle, Vector2 place) {
  for (const double part : {0.5, 0.25, 0.125}) {
    const Vector2 tried = middle + part * (place - middle);
    if (sees_all(rim, tried)) {
      return tried;
    }
  }
  return middle;
}

double least_area(const Rim &rim, Vector2 place) {
  double least = 1e300;
  for (int32_t i = 0; i < rim.sides(); ++i) {
    least = std::min(least, doubled_area(place, rim.point[at(i)], rim.point[at(rim.after(i))]));
  }
  return least;
}

// Off the point of the rim that sees all of it, square to the sides there or along their bisector, by less and less.
bool beside_point(const Rim &rim, int32_t onto, Vector2 &place) {
  const Vector2 from = rim.point[at(onto)];
  Vector2 inward{0.0, 0.0};
  const auto add_side = [&](Vector2 a, Vector2 b) {
    const double size = std::sqrt(squared(b - a));
    if (size > 0.0) {
      inward = inward + (1.0 / size) * Vector2{a.y - b.y, b.x - a.x};
    }
  };
  if (rim.closed || onto + 1 < rim.count) {
    add_side(from, rim.point[at(rim.after(onto))]);
  }
  if (rim.closed || onto > 0) {
    add_side(rim.point[at(onto == 0 ? rim.count - 1 : onto - 1)], from);
  }
  double reach = 0.0;
  for (int32_t i = 0; i < rim.count; ++i) {
    reach = std::max(reach, std::sqrt(squared(rim.point[at(i)] - from)));
  }
  for (int halving = 0; halving < kMostHalvings; ++halving) {
    const Vector2 tried = from + reach * inward;
    if (least_area(rim, tried) > 0.0) {
      place = tried;
      return true;
    }
    reach *= 0.5;
  }
  return false;
}

} // namespace

bool sees_all(const Rim &rim, Vector2 place) {
  double sum = 0.0;
  double least = 1e300;
  for (int32_t i = 0; i < rim.sides(); ++i) {
    const double area = doubled_area(place, rim.point[at(i)], rim.point[at(rim.after(i))]);
    sum += std::fabs(area);
    least = std::min(least, area);
  }
  return least > kLeastShare * sum;
}

bool find_kernel(const Rim &rim, int32_t onto, Vector2 &place) {
  Vector2 middle;
  if (middle_of_kernel(rim, middle)) {
    place = nearest_to(rim, middle, place);
    return true;
  }
  return beside_point(rim, onto, place);
}

} // namespace ob::flatten
