// A texel's footprint on a triangle: the texel's square clipped to the triangle, in texel coordinates.
#pragma once

#include <cstdint>

namespace ob {

struct Point2 {
  double x, y;
};

// A convex polygon; a triangle cut by a square has at most seven corners.
struct Polygon {
  Point2 corner[8];
  int count = 0;
};

// A triangle in texel coordinates: x to the right, y down, texel (i, j) the square [i, i+1] x [j, j+1].
struct TexelTriangle {
  Point2 corner[3]{};

  TexelTriangle() = default;
  TexelTriangle(const float *uv, int32_t width, int32_t height);
  double doubled_area() const; // signed
  bool finite() const;
};

double area(const Polygon &polygon);

// Sutherland-Hodgman against the four sides of texel (x, y).
Polygon clip_to_texel(const TexelTriangle &triangle, int32_t x, int32_t y);

// The part of the polygon with low <= axis <= high (axis 0: x, 1: y).
Polygon clip_to_slab(const Polygon &polygon, int axis, double low, double high);

Point2 centroid(const Polygon &polygon);

// A polygon with an area, cut into triangles about its first corner.
class Fan {
public:
  explicit Fan(const Polygon &polygon);

  // An area-preserving map of the unit square onto the polygon that keeps neighbourhoods: u along the triangles, each
  // by the square-root map.
  Point2 warp(double u, double v) const;

private:
  Point2 first_;
  Point2 spoke_[7]{}; // from the first corner to the others
  double end_[7]{};   // share of the area up to the triangle between this spoke and the next
  int triangles_;
};

} // namespace ob
