#include "chart_unfold.h"

#include <algorithm>
#include <iterator>

#include "chart_insert.h"
#include "chart_tutte.h"

namespace ob::flatten {
namespace {

constexpr int kCoarsestSweeps = 300;
constexpr int kSweeps[] = {20, 28, 40, 60, 90, 130, 200}; // at most, from the finest level on, each half as dear

void lay_triangle(const Mesh &mesh, std::vector<Vector2> &uv, int32_t edge) {
  const double base = std::sqrt(mesh.squared_length(edge));
  uv[at(mesh.origin(edge))] = {0.0, 0.0};
  uv[at(mesh.target(edge))] = {base, 0.0};
  uv[at(mesh.origin(previous_in_triangle(edge)))] = (0.5 / base) * mesh.corner(edge);
}

int sweeps_at(int32_t level) { return kSweeps[std::min<size_t>(at(level), std::size(kSweeps) - 1)]; }

} // namespace

bool Unfolder::unfold(const Mesh &mesh, const Hierarchy &hierarchy, const Watch &watch, std::vector<Vector2> &uv) {
  const std::vector<Level> &levels = hierarchy.levels;
  const Level &coarsest = levels.back();
  if (coarsest.triangles.size() == 1) {
    lay_triangle(mesh, uv, mesh.outgoing[at(coarsest.vertices[0])]);
  } else {
    lay_in_circle(mesh, coarsest, watch, uv);
    relaxation_.relax(coarsest, kCoarsestSweeps, watch, uv);
  }
  bool sound = true;
  auto removal = static_cast<int32_t>(hierarchy.removals.size());
  for (auto i = static_cast<int32_t>(levels.size()) - 2; i >= 0; --i) {
    while (removal > levels[at(i)].removals) {
      watch.look_at_times(at(removal));
      sound &= put_back(hierarchy, hierarchy.removals[at(--removal)], uv);
    }
    relaxation_.relax(levels[at(i)], sweeps_at(i), watch, uv);
  }
  return sound;
}

} // namespace ob::flatten
