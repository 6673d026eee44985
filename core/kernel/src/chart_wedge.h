// The energy of the triangles around one vertex, and where to move the vertex for less of it.
#pragma once

#include <cstdint>

#include "chart_vectors.h"

namespace ob::flatten {

// A triangle at a vertex: the two other corners, counter-clockwise, and its shape on the surface.
struct Wedge {
  int32_t next, previous;
  double stiffness, next_stiffness, previous_stiffness; // of each corner: half the cotangent of its angle
  double squared_area;                                  // of twice the area
};

// The symmetric Dirichlet energy of a vertex's wedges were it at a certain place; endless where one has no area or is
// clockwise. uv: where all vertices lie.
double energy(const Vector2 *uv, Vector2 place, const Wedge *begin, const Wedge *end);

// Moves a vertex, whose wedges are all counter-clockwise, to where they have less energy: steps of Newton's method, cut
// short until they help, as long as each one takes off a fifth, at most so many.
void improve(const Vector2 *uv, Vector2 &place, const Wedge *begin, const Wedge *end, int most_steps);

} // namespace ob::flatten
