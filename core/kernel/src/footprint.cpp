#include "footprint.h"

#include <algorithm>
#include <cmath>

namespace ob {
namespace {

double cross(Point2 origin, Point2 a, Point2 b) {
  return (a.x - origin.x) * (b.y - origin.y) - (a.y - origin.y) * (b.x - origin.x);
}

double along(Point2 point, int axis) { return axis == 0 ? point.x : point.y; }

// The point t of the way from a to b, and between them however it is rounded. So a polygon's coordinates still rise
// once and fall once on the way round, no line cuts it more than twice, and seven corners are the most it gets.
double between(double a, double b, double t) { return std::clamp(a + t * (b - a), std::min(a, b), std::max(a, b)); }

// Keeps the half plane where sign * (axis - bound) >= 0. A cut point lies exactly on the bound.
void clip_to_half_plane(Polygon &polygon, int axis, double bound, double sign) {
  double inside[8];
  bool cuts = false;
  for (int i = 0; i < polygon.count; ++i) {
    inside[i] = sign * (along(polygon.corner[i], axis) - bound);
    cuts = cuts || inside[i] < 0.0;
  }
  if (!cuts) {
    return;
  }
  Polygon kept;
  for (int i = 0; i < polygon.count; ++i) {
    const int next = i + 1 == polygon.count ? 0 : i + 1;
    const Point2 a = polygon.corner[i];
    const Point2 b = polygon.corner[next];
    if (inside[i] >= 0.0) {
      kept.corner[kept.count++] = a;
    }
    if ((inside[i] > 0.0 && inside[next] < 0.0) || (inside[i] < 0.0 && inside[next] > 0.0)) {
      const double t = inside[i] / (inside[i] - inside[next]);
      Point2 cut{between(a.x, b.x, t), between(a.y, b.y, t)};
      (axis == 0 ? cut.x : cut.y) = bound;
      kept.corner[kept.count++] = cut;
    }
  }
  polygon = kept;
}

} // namespace

TexelTriangle::TexelTriangle(const float *uv, int32_t width, int32_t height) {
  for (int i = 0; i < 3; ++i) {
    corner[i] = {static_cast<double>(uv[2 * i]) * width, (1.0 - static_cast<double>(uv[2 * i + 1])) * height};
  }
}

double TexelTriangle::doubled_area() const { return cross(corner[0], corner[1], corner[2]); }

bool TexelTriangle::finite() const {
  return std::all_of(corner, corner + 3, [](Point2 p) { return std::isfinite(p.x) && std::isfinite(p.y); });
}

double area(const Polygon &polygon) {
  double doubled = 0.0;
  for (int i = 2; i < polygon.count; ++i) {
    doubled += cross(polygon.corner[0], polygon.corner[i - 1], polygon.corner[i]);
  }
  return 0.5 * std::fabs(doubled);
}

Polygon clip_to_slab(const Polygon &polygon, int axis, double low, double high) {
  Polygon kept = polygon;
  clip_to_half_plane(kept, axis, low, 1.0);
  clip_to_half_plane(kept, axis, high, -1.0);
  return kept;
}

Polygon clip_to_texel(const TexelTriangle &triangle, int32_t x, int32_t y) {
  Polygon polygon;
  std::copy(triangle.corner, triangle.corner + 3, polygon.corner);
  polygon.count = 3;
  clip_to_half_plane(polygon, 1, y, 1.0);
  clip_to_half_plane(polygon, 1, static_cast<double>(y) + 1.0, -1.0);
  clip_to_half_plane(polygon, 0, x, 1.0);
  clip_to_half_plane(polygon, 0, static_cast<double>(x) + 1.0, -1.0);
  return polygon;
}

Point2 centroid(const Polygon &polygon) {
  Point2 sum{0.0, 0.0};
  double total = 0.0;
  const Point2 first = polygon.corner[0];
  for (int i = 2; i < polygon.count; ++i) {
    const Point2 a = polygon.corner[i - 1];
    const Point2 b = polygon.corner[i];
    const double weight = cross(first, a, b);
    total += weight;
    sum = {sum.x + weight * (a.x - first.x + b.x - first.x) / 3.0,
           sum.y + weight * (a.y - first.y + b.y - first.y) / 3.0};
  }
  return total == 0.0 ? first : Point2{first.x + sum.x / total, first.y + sum.y / total};
}

Fan::Fan(const Polygon &polygon) : first_(polygon.corner[0]), triangles_(polygon.count - 2) {
  for (int i = 1; i < polygon.count; ++i) {
    spoke_[i - 1] = {polygon.corner[i].x - first_.x, polygon.corner[i].y - first_.y};
  }
  double total = 0.0;
  for (int i = 0; i < triangles_; ++i) {
    total += std::fabs(spoke_[i].x * spoke_[i + 1].y - spoke_[i].y * spoke_[i + 1].x);
    end_[i] = total;
  }
  for (int i = 0; i < triangles_; ++i) {
    end_[i] = total > 0.0 ? end_[i] / total : 1.0;
  }
}

Point2 Fan::warp(double u, double v) const {
  int i = 0;
  while (u > end_[i] && i + 1 < triangles_) {
    ++i;
  }
  const double start = i == 0 ? 0.0 : end_[i - 1];
  const double s = end_[i] > start ? std::min((u - start) / (end_[i] - start), 1.0) : 0.0;
  const double root = std::sqrt(v);
  return {first_.x + root * (spoke_[i].x + s * (spoke_[i + 1].x - spoke_[i].x)),
          first_.y + root * (spoke_[i].y + s * (spoke_[i + 1].y - spoke_[i].y))};
}

} // namespace ob
