#include "chart_plane.h"

#include <algorithm>

#include "chart_vectors.h"

namespace ob::flatten {
namespace {

constexpr double kLean = 1e-6;   // 1 - cosine
constexpr double kHeight = 1e-4; // of the chart's size

// As long as twice the area.
Vector3 normal_of(const double *points, const int32_t *triangle) {
  const Vector3 a = point_of(points, triangle[0]);
  return cross(point_of(points, triangle[1]) - a, point_of(points, triangle[2]) - a);
}

// A unit vector square to another one.
Vector3 any_square_to(Vector3 n) {
  const double x = std::fabs(n.x);
  const double y = std::fabs(n.y);
  const double z = std::fabs(n.z);
  const Vector3 axis = x <= y && x <= z ? Vector3{1.0, 0.0, 0.0}
                       : y <= z         ? Vector3{0.0, 1.0, 0.0}
                                        : Vector3{0.0, 0.0, 1.0};
  const Vector3 square = cross(axis, n);
  return (1.0 / length(square)) * square;
}

bool none_leans(const double *points, const int32_t *begin, const int32_t *end, Vector3 normal) {
  for (const int32_t *triangle = begin; triangle != end; triangle += 3) {
    const Vector3 own = normal_of(points, triangle);
    if (dot(own, normal) < (1.0 - kLean) * length(own)) {
      return false;
    }
  }
  return true;
}

bool none_stands_off(const double *points, const int32_t *begin, const int32_t *end, Vector3 normal) {
  const Vector3 origin = point_of(points, *begin);
  double height = 0.0;
  double squared_size = 0.0;
  for (const int32_t *corner = begin; corner != end; ++corner) {
    const Vector3 off = point_of(points, *corner) - origin;
    height = std::max(height, std::fabs(dot(off, normal)));
    squared_size = std::max(squared_size, squared(off));
  }
  return height <= kHeight * std::sqrt(squared_size);
}

} // namespace

bool project(const double *points, const int32_t *begin, const int32_t *end, double *uv) {
  Vector3 sum{0.0, 0.0, 0.0};
  for (const int32_t *triangle = begin; triangle != end; triangle += 3) {
    sum = sum + normal_of(points, triangle);
  }
  const double size = length(sum);
  if (!(size > 0.0)) {
    return false;
  }
  const Vector3 normal = (1.0 / size) * sum;
  if (!none_leans(points, begin, end, normal) || !none_stands_off(points, begin, end, normal)) {
    return false;
  }
  const Vector3 origin = point_of(points, *begin);
  const Vector3 x = any_square_to(normal);
  const Vector3 y = cross(normal, x);
  for (const int32_t *corner = begin; corner != end; ++corner) {
    const Vector3 off = point_of(points, *corner) - origin;
    double *place = uv + 2 * static_cast<int64_t>(*corner);
    place[0] = dot(x, off);
    place[1] = dot(y, off);
  }
  return true;
}

} // namespace ob::flatten
