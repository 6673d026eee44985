// Angles by arithmetic that has the same bits everywhere; complex numbers stand for turns.
#pragma once

#include "chart_vectors.h"
#include "elementary.h"

namespace ob::flatten {

using elementary::kPi;

// The product of corners, each of an angle between 0 and pi, and how often their sum passed a half turn.
struct TotalAngle {
  Vector2 direction{1.0, 0.0};
  int32_t half_turns = 0;

  void add(Vector2 corner) {
    const Vector2 sum = turned(direction, corner);
    half_turns += (sum.y < 0.0) != (direction.y < 0.0) ? 1 : 0;
    direction = (1.0 / (std::fabs(sum.x) + std::fabs(sum.y))) * sum;
  }
};

// The angle of a complex number, -pi to pi, within a hundredth, and ever closer towards 0.
inline double rough_angle(Vector2 z) {
  const double half = z.y / (std::sqrt(squared(z)) + std::fabs(z.x)); // the tangent of half the angle to the x axis
  const double angle = 2.0 * half / (1.0 + 0.28 * half * half);
  return z.x >= 0.0 ? angle : (z.y >= 0.0 ? kPi : -kPi) - angle;
}

// A complex number of length 1 and nearly such an angle, -pi to pi; ever closer towards 0.
inline Vector2 roughly_turned(double angle) {
  const double h = 0.5 * angle;
  const double t = h * (1.0 + h * h * (1.0 / 3.0 + h * h * (2.0 / 15.0))); // about the tangent of half the angle
  const double inverse = 1.0 / (1.0 + t * t);
  return {(1.0 - t * t) * inverse, 2.0 * t * inverse};
}

} // namespace ob::flatten
