#include "chart_stretch.h"

#include "chart_vectors.h"

namespace ob::flatten {
namespace {

struct Edges { // of a triangle from its first corner, on the surface and in the plane
  Vector3 p1, p2;
  Vector2 q1, q2;

  double surface() const { return length(cross(p1, p2)); }
  double flat() const { return cross(q1, q2); }
};

Edges edges_of(const double *points, const double *uv, const int32_t *triangle) {
  const auto point = [&](int corner) { return point_of(points, triangle[corner]); };
  const auto place = [&](int corner) { return uv_of(uv, triangle[corner]); };
  return {point(1) - point(0), point(2) - point(0), place(1) - place(0), place(2) - place(0)};
}

// Of the map from the plane to the surface, for a triangle with an area in both.
double squared_stretch(const Edges &e) {
  const Vector3 along_u = e.q2.y * e.p1 - e.q1.y * e.p2;
  const Vector3 along_v = e.q1.x * e.p2 - e.q2.x * e.p1;
  return 0.5 * (squared(along_u) + squared(along_v)) / (e.flat() * e.flat());
}

} // namespace

void measure_stretch(const double *points, const double *uv, const int32_t *begin, const int32_t *end,
                     double *squared) {
  double surface = 0.0;
  double flat = 0.0;
  for (const int32_t *triangle = begin; triangle != end; triangle += 3) {
    const Edges edges = edges_of(points, uv, triangle);
    const bool sound = edges.surface() > 0.0 && edges.flat() > 0.0;
    *squared++ = sound ? squared_stretch(edges) : -1.0;
    surface += sound ? edges.surface() : 0.0;
    flat += sound ? edges.flat() : 0.0;
  }
  const double scale = surface > 0.0 ? flat / surface : 1.0;
  for (double *square = squared - (end - begin) / 3; square != squared; ++square) {
    *square = *square >= 0.0 ? *square * scale : 1.0;
  }
}

} // namespace ob::flatten
