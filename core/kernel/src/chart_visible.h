// Where in the plane a vertex sees all of the polygon around it.
#pragma once

#include <array>

#include "chart_star.h"

namespace ob::flatten {

// The neighbours of a vertex, counter-clockwise; closed: the first follows the last.
struct Rim {
  int32_t count;
  bool closed;
  std::array<Vector2, kMostSpokes> point;

  int32_t sides() const { return closed ? count : count - 1; }
  int32_t after(int32_t i) const { return i + 1 == count ? 0 : i + 1; }
};

// Whether all triangles from the place to the rim are counter-clockwise, and none is all but without area.
bool sees_all(const Rim &rim, Vector2 place);

// Finds a place that sees all: one near `place` in the polygon's kernel or, where that is all but empty, next to the
// point `onto` of the rim, which sees all of it. False where there is no such place in double precision.
bool find_kernel(const Rim &rim, int32_t onto, Vector2 &place);

} // namespace ob::flatten
