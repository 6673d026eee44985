// The triangles around one vertex, spread out in the plane, and how they are filled in once the vertex is gone.
#pragma once

#include <array>

#include "chart_metric.h"

namespace ob::flatten {

constexpr int32_t kMostSpokes = 12;

// The angle about a vertex: a direction, and how often its sum passed a half turn.
struct TotalAngle {
  Vector2 direction{1.0, 0.0};
  int32_t half_turns = 0;

  void add(Vector2 corner);
};

// A metric of the plane: squared lengths as a quadratic form.
struct Tensor {
  double xx, xy, yy;

  double determinant() const { return xx * yy - xy * xy; }
  double squared_length(Vector2 v) const { return xx * v.x * v.x + 2.0 * xy * v.x * v.y + yy * v.y * v.y; }
};

struct Star {
  int32_t centre;
  bool rough;     // its surface is full of noise
  bool closed;    // the vertex does not lie on the border
  int32_t spokes; // neighbours, counter-clockwise, from border to border where it is not closed
  std::array<int32_t, kMostSpokes> neighbour;
  std::array<int32_t, kMostSpokes> edge;  // from the centre to each; the last of an open star is that of the border
  std::array<Vector2, kMostSpokes> place; // about the centre, once spread

  int32_t triangles() const { return closed ? spokes : spokes - 1; }
  int32_t before(int32_t spoke) const { return spoke == 0 ? spokes - 1 : spoke - 1; }
  int32_t after(int32_t spoke) const { return spoke + 1 == spokes ? 0 : spoke + 1; }
};

// False where it has more than kMostSpokes.
bool gather(const HalfEdgeMesh &mesh, int32_t vertex, Star &star);

// How far the star is from lying flat, or the border there from being straight: 1 - cos of the angle amiss, 3 where
// that is above a half turn.
double bend(const Metric &metric, const Star &star);

// Spreads the star in the plane. The edges of its rim keep their lengths; where its angles do not add up to a full
// turn, its spokes are all made longer or shorter by one factor so that they do (a step of discrete conformal
// flattening: Springborn, Schroeder and Pinkall 2008). Where that is impossible, the spokes keep their lengths and the
// angles are all made wider or narrower by one factor. False where that, too, is impossible.
bool spread(const Metric &metric, Star &star);

// What the metric is, on average, where the star was spread. By it, the symmetric Dirichlet energy of an affine map is
// least where that of all the triangles together is: the geometric mean of the mean and the harmonic mean.
Tensor mean_metric(const Metric &metric, const Star &star);

// Shape of a triangle: 1 where it is equilateral, 0 where it has no area, below where it is turned over.
double quality(Vector2 a, Vector2 b, Vector2 c);
double quality(Vector3 a, Vector3 b, Vector3 c);

// The least quality of the triangles that stay when the centre is moved onto a neighbour.
double quality_onto(const Star &star, const std::vector<Vector3> &points, int32_t spoke, double least_wanted);

// The least quality of the triangles as they are.
double quality_now(const Star &star);

} // namespace ob::flatten
