#include "chart_wedge.h"

#include <algorithm>
#include <limits>

namespace ob::flatten {
namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr double kStride = 1.4; // successive over-relaxation
constexpr int kMostHalvings = 30;
constexpr double kWorthAnother = 0.2; // of the energy that a step took off
constexpr double kNothing = 1e-14;    // of the energy: less than its own rounding
constexpr double kLeastCurvature = 1e-3;

// A function's value, gradient and Hessian.
struct Expansion {
  double value = 0.0;
  Vector2 gradient{0.0, 0.0};
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
};

// With D the Dirichlet energy of a triangle, c twice its area and m twice that on the surface, its energy is
// D (1 + m^2 / c^2). D is a quadratic of the vertex's place, c is linear.
void add_wedge(const Wedge &w, Vector2 place, Expansion &sum) {
  const Vector2 to_next = w.next - place;
  const Vector2 to_previous = w.previous - place;
  const Vector2 across = w.previous - w.next;
  const double inverse = 1.0 / cross(to_next, to_previous);
  const double dirichlet =
      w.stiffness * squared(across) + w.next_stiffness * squared(to_previous) + w.previous_stiffness * squared(to_next);
  const double ratio = w.squared_area * inverse * inverse;
  const double factor = 1.0 + ratio;
  const double slope = -2.0 * ratio * inverse; // of the factor by c
  const Vector2 d_dirichlet = -2.0 * (w.previous_stiffness * to_next + w.next_stiffness * to_previous);
  const Vector2 d_area{-across.y, across.x};
  sum.value += dirichlet * factor;
  sum.gradient = sum.gradient + factor * d_dirichlet + (dirichlet * slope) * d_area;
  const double round = 2.0 * (w.previous_stiffness + w.next_stiffness) * factor;
  const double along = 6.0 * dirichlet * ratio * inverse * inverse;
  sum.xx += round + along * d_area.x * d_area.x + 2.0 * slope * d_dirichlet.x * d_area.x;
  sum.yy += round + along * d_area.y * d_area.y + 2.0 * slope * d_dirichlet.y * d_area.y;
  sum.xy += along * d_area.x * d_area.y + slope * (d_dirichlet.x * d_area.y + d_dirichlet.y * d_area.x);
}

// Newton's step; a Hessian that is not positive is made so by as much of the identity as it takes.
Vector2 newton_step(const Expansion &e) {
  const double mean = 0.5 * (e.xx + e.yy);
  const double half = 0.5 * (e.xx - e.yy);
  const double spread = std::sqrt(half * half + e.xy * e.xy);
  const double shift = std::max(0.0, kLeastCurvature * (std::fabs(mean) + spread) - (mean - spread));
  const double xx = e.xx + shift;
  const double yy = e.yy + shift;
  const double determinant = xx * yy - e.xy * e.xy;
  if (!(determinant > 0.0)) {
    return {0.0, 0.0};
  }
  return {(e.xy * e.gradient.y - yy * e.gradient.x) / determinant,
          (e.xy * e.gradient.x - xx * e.gradient.y) / determinant};
}

} // namespace

double energy(Vector2 place, const Wedge *begin, const Wedge *end) {
  double sum = 0.0;
  for (const Wedge *w = begin; w != end; ++w) {
    const Vector2 to_next = w->next - place;
    const Vector2 to_previous = w->previous - place;
    const double area = cross(to_next, to_previous);
    if (!(area > 0.0)) {
      return kEndless;
    }
    const double dirichlet = w->stiffness * squared(w->previous - w->next) + w->next_stiffness * squared(to_previous) +
                             w->previous_stiffness * squared(to_next);
    sum += dirichlet * (1.0 + w->squared_area / (area * area));
  }
  return sum;
}

double improve(Vector2 &place, const Wedge *begin, const Wedge *end, int most_steps) {
  double taken_off = 0.0;
  for (int i = 0; i < most_steps; ++i) {
    Expansion now;
    for (const Wedge *w = begin; w != end; ++w) {
      add_wedge(*w, place, now);
    }
    Vector2 step = kStride * newton_step(now);
    if (!(-dot(now.gradient, step) > kNothing * now.value)) {
      return taken_off;
    }
    double after = energy(place + step, begin, end);
    for (int halving = 0; !(after < now.value); ++halving) {
      if (halving == kMostHalvings) {
        return taken_off;
      }
      step = 0.5 * step;
      after = energy(place + step, begin, end);
    }
    place = place + step;
    taken_off += now.value - after;
    if (now.value - after < kWorthAnother * now.value) {
      break;
    }
  }
  return taken_off;
}

} // namespace ob::flatten
