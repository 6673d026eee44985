// The energy of the triangles around one vertex, and where to move the vertex for less of it.
#pragma once

#include "chart_vectors.h"

namespace ob::flatten {

// A triangle at a vertex: where its two other corners lie, counter-clockwise, and its shape on the surface.
struct Wedge {
  Vector2 next, previous;
  double stiffness, next_stiffness, previous_stiffness; // of each corner: half the cotangent of its angle
  double squared_area;                                  // of twice the area
};

// The symmetric Dirichlet energy of a vertex's wedges were it at a certain place; endless where one has no area or is
// clockwise.
double energy(Vector2 place, const Wedge *begin, const Wedge *end);

// Moves a vertex, whose wedges are all counter-clockwise, to where they have less energy: steps of Newton's method,
// made longer and halved until they help, as long as each one takes off a fifth, at most so many. Returns what was
// taken off.
double improve(Vector2 &place, const Wedge *begin, const Wedge *end, int most_steps);

} // namespace ob::flatten
