// A vertex moved onto a neighbour: what becomes of the mesh, and whether it may.
#pragma once

#include "chart_star.h"

namespace ob::flatten {

// Whether the new edges would be the only ones between their ends (the link condition).
bool may_collapse(const Mesh &mesh, const Star &star, int32_t onto);

// Moves the centre onto the neighbour at spoke `onto`, for a star that is not open onto one at its end. The triangles
// that stay keep their numbers and, so far, their lengths; the centre has no half-edge afterwards.
void collapse(Mesh &mesh, const Star &star, int32_t onto);

} // namespace ob::flatten
