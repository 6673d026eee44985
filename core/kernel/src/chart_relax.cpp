#include "chart_relax.h"

#include <algorithm>

namespace ob::flatten {
namespace {

constexpr double kMostShrinking = 16.0; // of area, squared
constexpr int kMostSteps = 30;          // of one vertex in one sweep
constexpr double kIsometric = 1e-9;     // of the energy: less over the least conceivable is none
constexpr double kWorthASweep = 5e-5;   // of the energy

// Scales the map to where its energy is least, not counting how much it shrinks a triangle beyond kMostShrinking: the
// few that were put into too little room are no reason to scale up all the others. Returns the energy.
double scale_to_least(const Level &level, const Watch &watch, std::vector<Vector2> &uv) {
  double stretching = 0.0; // grows with the square of the scale
  double shrinking = 0.0;  // falls with it
  double counted = 0.0;    // of that
  for (size_t i = 0; i < level.triangles.size(); ++i) {
    watch.look_at_times(i);
    const auto &[corner, stiffness, area] = level.triangles[i];
    const Vector2 a = uv[at(corner[0])];
    const Vector2 b = uv[at(corner[1])];
    const Vector2 c = uv[at(corner[2])];
    const double dirichlet =
        stiffness[0] * squared(c - b) + stiffness[1] * squared(a - c) + stiffness[2] * squared(b - a);
    const double ratio = 2.0 * area / doubled_area(a, b, c);
    stretching += dirichlet;
    shrinking += dirichlet * ratio * ratio;
    counted += dirichlet * std::min(ratio * ratio, kMostShrinking);
  }
  const double factor = std::sqrt(counted / stretching); // squared
  const double root = std::sqrt(factor);
  for (const int32_t vertex : level.vertices) {
    uv[at(vertex)] = root * uv[at(vertex)];
  }
  return factor * stretching + shrinking / factor;
}

} // namespace

void Relaxation::relax(const Level &level, int most_sweeps, const Watch &watch, std::vector<Vector2> &uv) {
  double least = 0.0;
  for (const Shape &triangle : level.triangles) {
    least += 4.0 * triangle.area;
  }
  double energy = scale_to_least(level, watch, uv);
  if (energy - least < kIsometric * least) {
    return;
  }
  list_spokes(level, watch, uv.size());
  for (int i = 0; i < most_sweeps; ++i) {
    const double taken_off = sweep(level, watch, uv);
    if (taken_off < kWorthASweep * energy) {
      return;
    }
    energy -= taken_off;
  }
}

void Relaxation::list_spokes(const Level &level, const Watch &watch, size_t vertex_count) {
  slot_.resize(vertex_count);
  for (size_t i = 0; i < level.vertices.size(); ++i) {
    slot_[at(level.vertices[i])] = static_cast<int32_t>(i);
  }
  first_.assign(level.vertices.size() + 2, 0);
  for (const Shape &triangle : level.triangles) {
    for (const int32_t vertex : triangle.corner) {
      ++first_[at(slot_[at(vertex)]) + 2];
    }
  }
  for (size_t i = 2; i < first_.size(); ++i) {
    first_[i] += first_[i - 1];
  }
  spokes_.resize(3 * level.triangles.size());
  for (size_t triangle = 0; triangle < level.triangles.size(); ++triangle) {
    watch.look_at_times(triangle);
    const auto &corner = level.triangles[triangle].corner;
    const auto number = static_cast<int32_t>(4 * triangle);
    spokes_[at(first_[at(slot_[at(corner[0])]) + 1]++)] = {corner[1], corner[2], number};
    spokes_[at(first_[at(slot_[at(corner[1])]) + 1]++)] = {corner[2], corner[0], number + 1};
    spokes_[at(first_[at(slot_[at(corner[2])]) + 1]++)] = {corner[0], corner[1], number + 2};
  }
}

// Moves each vertex once. Returns the energy taken off.
double Relaxation::sweep(const Level &level, const Watch &watch, std::vector<Vector2> &uv) {
  double taken_off = 0.0;
  for (size_t slot = 0; slot < level.vertices.size(); ++slot) {
    watch.look_at_times(slot);
    gather_wedges(level, uv, slot);
    taken_off += improve(uv[at(level.vertices[slot])], wedges_.data(), wedges_.data() + wedges_.size(), kMostSteps);
  }
  return taken_off;
}

void Relaxation::gather_wedges(const Level &level, const std::vector<Vector2> &uv, size_t slot) {
  constexpr size_t kNext[] = {1, 2, 0, 1};
  const auto begin = at(first_[slot]);
  const auto end = at(first_[slot + 1]);
  wedges_.resize(end - begin);
  for (size_t i = begin; i < end; ++i) {
    const Spoke spoke = spokes_[i];
    const size_t triangle = at(spoke.corner) >> 2U;
    const size_t corner = at(spoke.corner) & 3U;
    const auto &stiffness = level.triangles[triangle].stiffness;
    const double doubled = 2.0 * level.triangles[triangle].area;
    wedges_[i - begin] = {uv[at(spoke.next)],       uv[at(spoke.previous)],       stiffness[corner],
                          stiffness[kNext[corner]], stiffness[kNext[corner + 1]], doubled * doubled};
  }
}

} // namespace ob::flatten
