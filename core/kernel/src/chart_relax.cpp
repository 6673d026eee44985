#include "chart_relax.h"

#include <algorithm>

namespace ob::flatten {
namespace {

size_t at(int32_t index) { return static_cast<size_t>(index); }

constexpr int kMostSteps = 30; // of one vertex in one sweep

} // namespace

void Relaxation::begin(const Level &level, std::vector<Vector2> &uv) {
  level_ = &level;
  uv_ = &uv;
  slot_.resize(uv.size());
  for (size_t i = 0; i < level.vertices.size(); ++i) {
    slot_[at(level.vertices[i])] = static_cast<int32_t>(i);
  }
  first_.assign(level.vertices.size() + 2, 0);
  for (const int32_t vertex : level.corners) {
    ++first_[at(slot_[at(vertex)]) + 2];
  }
  for (size_t i = 2; i < first_.size(); ++i) {
    first_[i] += first_[i - 1];
  }
  wedges_.resize(level.corners.size());
  for (size_t triangle = 0; triangle < level.triangle_count(); ++triangle) {
    const int32_t *corner = level.corners.data() + 3 * triangle;
    const double *stiffness = level.stiffness.data() + 3 * triangle;
    const double squared_area = 4.0 * level.area[triangle] * level.area[triangle];
    for (size_t i = 0; i < 3; ++i) {
      const size_t j = (i + 1) % 3;
      const size_t k = (i + 2) % 3;
      wedges_[at(first_[at(slot_[at(corner[i])]) + 1]++)] = {corner[j],    corner[k],    stiffness[i],
                                                             stiffness[j], stiffness[k], squared_area};
    }
  }
}

void Relaxation::scale() {
  double stretching = 0.0; // grows with the square of the scale
  double shrinking = 0.0;  // falls with it
  const std::vector<Vector2> &uv = *uv_;
  for (size_t triangle = 0; triangle < level_->triangle_count(); ++triangle) {
    const int32_t *corner = level_->corners.data() + 3 * triangle;
    const double *stiffness = level_->stiffness.data() + 3 * triangle;
    const Vector2 a = uv[at(corner[0])];
    const Vector2 b = uv[at(corner[1])];
    const Vector2 c = uv[at(corner[2])];
    const double dirichlet =
        stiffness[0] * squared(c - b) + stiffness[1] * squared(a - c) + stiffness[2] * squared(b - a);
    const double ratio = 2.0 * level_->area[triangle] / doubled_area(a, b, c);
    stretching += dirichlet;
    shrinking += dirichlet * ratio * ratio;
  }
  const double factor = std::sqrt(std::sqrt(shrinking / stretching));
  for (const int32_t vertex : level_->vertices) {
    (*uv_)[at(vertex)] = factor * uv[at(vertex)];
  }
}

double Relaxation::excess() const {
  double energy = 0.0;
  double area = 0.0;
  const std::vector<Vector2> &uv = *uv_;
  for (size_t triangle = 0; triangle < level_->triangle_count(); ++triangle) {
    const int32_t *corner = level_->corners.data() + 3 * triangle;
    const double *stiffness = level_->stiffness.data() + 3 * triangle;
    const Vector2 a = uv[at(corner[0])];
    const Vector2 b = uv[at(corner[1])];
    const Vector2 c = uv[at(corner[2])];
    const double dirichlet =
        stiffness[0] * squared(c - b) + stiffness[1] * squared(a - c) + stiffness[2] * squared(b - a);
    const double ratio = 2.0 * level_->area[triangle] / doubled_area(a, b, c);
    energy += dirichlet * (1.0 + ratio * ratio);
    area += level_->area[triangle];
  }
  return energy / (4.0 * area) - 1.0;
}

void Relaxation::sweep(const Watch &watch) {
  for (size_t i = 0; i < level_->vertices.size(); ++i) {
    if (i % 4096 == 0) {
      watch.look();
    }
    improve(uv_->data(), (*uv_)[at(level_->vertices[i])], wedges_.data() + first_[i], wedges_.data() + first_[i + 1],
            kMostSteps);
  }
}

} // namespace ob::flatten
