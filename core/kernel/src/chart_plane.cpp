#include "chart_plane.h"

#include <algorithm>

namespace ob::flatten {
namespace {

constexpr double kFlat = 1e-6;

// A unit vector square to another one.
Vector3 any_square_to(Vector3 n) {
  const Vector3 off = std::fabs(n.x) < 0.6 ? Vector3{1.0, 0.0, 0.0} : Vector3{0.0, 1.0, 0.0};
  const Vector3 square = cross(n, off);
  return (1.0 / length(square)) * square;
}

} // namespace

bool lay_flat(const Mesh &mesh, const std::vector<Vector3> &points, std::vector<Vector2> &uv) {
  Vector3 sum{0.0, 0.0, 0.0};
  for (const Triangle &triangle : mesh.triangles) {
    const Vector3 a = points[at(triangle.origin[0])];
    sum = sum + cross(points[at(triangle.origin[1])] - a, points[at(triangle.origin[2])] - a);
  }
  const double size = length(sum);
  if (!(size > 0.0)) {
    return false;
  }
  const Vector3 normal = (1.0 / size) * sum;
  double low = 1e300;
  double high = -1e300;
  for (const Vector3 &point : points) {
    low = std::min(low, dot(normal, point));
    high = std::max(high, dot(normal, point));
    if (high - low > 2.0 * kFlat) {
      return false;
    }
  }
  const Vector3 x = any_square_to(normal);
  const Vector3 y = cross(normal, x);
  uv.resize(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    uv[i] = {dot(x, points[i]), dot(y, points[i])};
  }
  return true;
}

} // namespace ob::flatten
