#include "chart_wedge.h"

#include <algorithm>
#include <limits>

namespace ob::flatten {
namespace {

size_t at(int32_t index) { return static_cast<size_t>(index); }

constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr int kMostHalvings = 30;
constexpr double kWorthAnother = 0.8; // of the energy left after a step

// With D the Dirichlet energy of a triangle, c twice its area and m twice that on the surface, its energy is D (1 + m^2
// / c^2). D is a quadratic of the vertex's place, c is linear.
bool step_once(const Vector2 *uv, Vector2 &place, const Wedge *begin, const Wedge *end) {
  double before = 0.0;
  Vector2 gradient{0.0, 0.0};
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  for (const Wedge *w = begin; w != end; ++w) {
    const Vector2 q = uv[at(w->next)];
    const Vector2 r = uv[at(w->previous)];
    const Vector2 to_q = q - place;
    const Vector2 to_r = r - place;
    const Vector2 across = r - q;
    const double inverse = 1.0 / cross(to_q, to_r);
    const double dirichlet =
        w->stiffness * squared(across) + w->next_stiffness * squared(to_r) + w->previous_stiffness * squared(to_q);
    const Vector2 d_dirichlet = -2.0 * (w->previous_stiffness * to_q + w->next_stiffness * to_r);
    const Vector2 d_area{-across.y, across.x};
    const double ratio = w->squared_area * inverse * inverse;
    const double slope = -2.0 * ratio * inverse; // of the factor by c
    const double curvature = 6.0 * ratio * inverse * inverse;
    before += dirichlet * (1.0 + ratio);
    gradient = gradient + (1.0 + ratio) * d_dirichlet + (dirichlet * slope) * d_area;
    const double both = 2.0 * (w->previous_stiffness + w->next_stiffness) * (1.0 + ratio);
    const double along = dirichlet * curvature;
    xx += both + along * d_area.x * d_area.x + 2.0 * slope * d_dirichlet.x * d_area.x;
    yy += both + along * d_area.y * d_area.y + 2.0 * slope * d_dirichlet.y * d_area.y;
    xy += along * d_area.x * d_area.y + slope * (d_dirichlet.x * d_area.y + d_dirichlet.y * d_area.x);
  }
  // a Hessian that is not positive is made so by more of the identity
  const double mean = 0.5 * (xx + yy);
  const double spread = std::sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy);
  const double least = 1e-3 * (std::fabs(mean) + spread);
  const double shift = std::max(0.0, least - (mean - spread));
  xx += shift;
  yy += shift;
  const double determinant = xx * yy - xy * xy;
  if (!(determinant > 0.0)) {
    return false;
  }
  Vector2 step{(xy * gradient.y - yy * gradient.x) / determinant, (xy * gradient.x - xx * gradient.y) / determinant};
  const double fall = -dot(gradient, step);
  if (!(fall > 1e-14 * before)) {
    return false;
  }
  for (int halving = 0; halving < kMostHalvings; ++halving) {
    const Vector2 tried = place + step;
    const double after = energy(uv, tried, begin, end);
    if (after < before) {
      place = tried;
      return after < kWorthAnother * before;
    }
    step = 0.5 * step;
  }
  return false;
}

} // namespace

double energy(const Vector2 *uv, Vector2 place, const Wedge *begin, const Wedge *end) {
  double sum = 0.0;
  for (const Wedge *w = begin; w != end; ++w) {
    const Vector2 q = uv[at(w->next)];
    const Vector2 r = uv[at(w->previous)];
    const double area = doubled_area(place, q, r);
    if (!(area > 0.0)) {
      return kEndless;
    }
    const double dirichlet = w->stiffness * squared(r - q) + w->next_stiffness * squared(r - place) +
                             w->previous_stiffness * squared(q - place);
    sum += dirichlet * (1.0 + w->squared_area / (area * area));
  }
  return sum;
}

void improve(const Vector2 *uv, Vector2 &place, const Wedge *begin, const Wedge *end, int most_steps) {
  for (int step = 0; step < most_steps && step_once(uv, place, begin, end); ++step) {
  }
}

} // namespace ob::flatten
