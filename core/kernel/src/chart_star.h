// The triangles around one vertex, spread out in the plane, and how they are filled in once the vertex is gone.
#pragma once

#include "chart_mesh.h"

namespace ob::flatten {

constexpr int32_t kMostSpokes = 12;

struct Star {
  int32_t centre;
  bool closed;    // the vertex does not lie on the border
  int32_t spokes; // neighbours, counter-clockwise, from border to border where it is not closed
  std::array<int32_t, kMostSpokes> neighbour;
  std::array<int32_t, kMostSpokes> edge;  // from the centre to each; the last of an open star is that of the border
  std::array<Vector2, kMostSpokes> place; // about the centre, once spread

  int32_t triangles() const { return closed ? spokes : spokes - 1; }
  int32_t before(int32_t spoke) const { return spoke == 0 ? spokes - 1 : spoke - 1; }
  int32_t after(int32_t spoke) const { return spoke + 1 == spokes ? 0 : spoke + 1; }

  // Whether the triangle between a spoke and the next one stays when the centre is moved onto a neighbour.
  bool stays(int32_t spoke, int32_t onto) const { return spoke != onto && after(spoke) != onto; }
};

// False where it has more than kMostSpokes.
bool gather(const Mesh &mesh, int32_t vertex, Star &star);

struct FanShape {
  double area;
  double bend; // how far it is from lying flat, or the border from being straight: 1 - cos of the angle amiss, 3 where
               // that is above a half turn
};

// The triangles around a vertex as they are; those of one with more than kMostSpokes count as endless.
FanShape shape_of_fan(const Mesh &mesh, int32_t vertex);

// Spreads the star in the plane. Its spokes keep their lengths; where its angles do not add up to a full turn, they are
// all made wider or narrower by one factor so that they do (a geodesic polar map: Welch and Witkin 1994, "Free-Form
// Shape Design Using Triangulated Surfaces"). False where that leaves no triangle.
bool spread(const Mesh &mesh, Star &star);

// Shape of a triangle: 1 where it is equilateral, 0 where it has no area, below where it is turned over.
double quality(Vector2 a, Vector2 b, Vector2 c);
double quality(Vector3 a, Vector3 b, Vector3 c);

} // namespace ob::flatten
