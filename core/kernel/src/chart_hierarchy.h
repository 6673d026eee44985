// From a chart to ever coarser ones, a vertex at a time, and what it takes to go back.
#pragma once

#include "chart_star.h"
#include "chart_watch.h"

namespace ob::flatten {

struct Spread { // in float32, for there are many
  float x, y;
};

// A vertex that was moved onto a neighbour, and where it was before, by the triangles that stayed.
struct Removal {
  int32_t vertex;
  int32_t first;  // of its neighbours, counter-clockwise, in Hierarchy::neighbours and places
  int16_t spokes; // how many
  bool closed;    // it did not lie on the border
  int8_t onto;    // the neighbour that took its place
  int8_t beside;  // it lay in, or nearest to, the triangle of that one, this one and the one after
  Vector2 weight; // barycentric, of the first and the last; of two neighbours alone: by their edge
};

struct Shape { // of a triangle on the surface
  std::array<int32_t, 3> corner;
  std::array<double, 3> stiffness; // half the cotangent of the angle at each corner
  double area;
};

// Triangles as they are before the removals from a certain one on.
struct Level {
  int32_t removals; // how many came before
  std::vector<int32_t> vertices;
  std::vector<Shape> triangles;
};

struct Hierarchy {
  std::vector<Removal> removals;
  std::vector<int32_t> neighbours;
  std::vector<Spread> places; // of each neighbour, about the vertex, in the plane
  std::vector<Level> levels;  // fine to coarse, each of at most half the vertices of the one before
};

// Coarsens a disk: vertices are moved onto a neighbour, those first whose going changes least, in independent sets
// (Dobkin and Kirkpatrick 1985; Lee et al. 1998, "MAPS"). The shapes of the triangles are intrinsic: a star is spread
// in the plane before its centre goes, which keeps distances of anything developable (compare Liu et al. 2023, "Surface
// Simplification using Intrinsic Error Metrics"). Of needles in rows, the rows are thinned out first, as algebraic
// multigrid does (Ruge and Stueben 1987). Ends at about a dozen vertices, at one triangle where the surface can
// be developed, or where none can go. mesh: that of the coarsest level afterwards.
void coarsen(Mesh &mesh, const std::vector<Vector3> &points, const Watch &watch, Hierarchy &hierarchy);

} // namespace ob::flatten
