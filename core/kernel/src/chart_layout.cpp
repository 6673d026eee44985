#include "chart_layout.h"

#include <algorithm>
#include <iterator>

#include "chart_insert.h"
#include "chart_tutte.h"

namespace ob::flatten {
namespace {

constexpr int kCoarsestSweeps = 300;
constexpr int kSweeps[] = {3, 4, 6, 10, 15, 22, 34, 51}; // at most, from the finest level on, each half as dear
constexpr double kIsometric = 1e-9;                      // excess energy below which nothing is left to gain
constexpr double kSettled = 1e-4;                        // part of the excess that a sweep takes off

size_t at(int32_t index) { return static_cast<size_t>(index); }

void lay_triangle(const HalfEdgeMesh &mesh, const Metric &metric, std::vector<Vector2> &uv, int32_t edge) {
  const double base = std::sqrt(metric.squared_length[at(edge)]);
  uv[at(mesh.origin[at(edge)])] = {0.0, 0.0};
  uv[at(mesh.target(edge))] = {base, 0.0};
  uv[at(mesh.origin[at(previous_in_triangle(edge))])] = (0.5 / base) * metric.corner(edge);
}

int sweeps_at(int32_t level) { return kSweeps[std::min<size_t>(at(level), std::size(kSweeps) - 1)]; }

} // namespace

bool Layout::unfold(const HalfEdgeMesh &mesh, const Metric &metric, const Hierarchy &hierarchy, const Watch &watch,
                    std::vector<Vector2> &uv) {
  const std::vector<Level> &levels = hierarchy.levels;
  const Level &coarsest = levels.back();
  if (coarsest.triangle_count() == 1) {
    lay_triangle(mesh, metric, uv, mesh.outgoing[at(coarsest.vertices[0])]);
  } else {
    lay_in_circle(mesh, metric, coarsest, watch, uv);
    relax(coarsest, kCoarsestSweeps, watch, uv);
  }
  bool sound = true;
  auto removal = static_cast<int32_t>(hierarchy.removals.size());
  for (auto i = static_cast<int32_t>(levels.size()) - 2; i >= 0; --i) {
    while (removal > levels[at(i)].removals) {
      sound &= put_back(hierarchy, hierarchy.removals[at(--removal)], uv);
    }
    relax(levels[at(i)], sweeps_at(i), watch, uv);
  }
  return sound;
}

void Layout::relax(const Level &level, int most_sweeps, const Watch &watch, std::vector<Vector2> &uv) {
  relaxation_.begin(level, uv);
  relaxation_.scale();
  double excess = relaxation_.excess();
  for (int sweep = 0; sweep < most_sweeps && excess > kIsometric; ++sweep) {
    relaxation_.sweep(watch);
    const double before = excess;
    excess = relaxation_.excess();
    if (before - excess < kSettled * before) {
      break;
    }
  }
}

} // namespace ob::flatten
