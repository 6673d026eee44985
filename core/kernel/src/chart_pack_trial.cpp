#include "chart_pack_trial.h"

#include <algorithm>
#include <utility>

#include "parallel.h"

namespace ob {

ScaleTrial::ScaleTrial(const ChartOutlines &outlines, const PackingGrid &grid, double scale, PackingEffort effort)
    : grid_(grid), scale_(scale), effort_(effort),
      shapes_(outlines, {scale, grid.margin}, effort.threads, effort.progress.control()), classes_(shapes_),
      charts_(outlines.filled()) {}

std::vector<double> ScaleTrial::place(const std::vector<PlacingRule> &rules, int32_t rows, double highest,
                                      ChartFit &best) {
  std::vector<Placing> placings(rules.size());
  run_parallel(effort_.threads, static_cast<int64_t>(rules.size()), [&](auto next) {
    for (int64_t i = next(); i >= 0; i = next()) {
      const auto rule = static_cast<size_t>(i);
      placings[rule] = place_charts(shapes_, classes_, rules[rule], {grid_.width, rows, grid_.gap}, effort_.progress);
    }
  });
  highest = std::min<double>(highest, grid_.height);
  std::vector<double> heights(rules.size());
  for (size_t i = 0; i < rules.size(); ++i) {
    work_ += placings[i].work;
    heights[i] = height_of(placings[i], rows);
    if (placings[i].complete && heights[i] <= highest && !effort_.progress.stopped()) {
      highest = heights[i];
      best = {scale_, std::move(placings[i]), rules[i]};
    }
  }
  return heights;
}

double ScaleTrial::height_of(const Placing &placing, int32_t rows) const {
  if (placing.complete) {
    return placing.height;
  }
  const auto placed = static_cast<double>(std::max<int64_t>(placing.placed_cells, 1));
  return (rows + 1.0) * std::max(1.0, static_cast<double>(shapes_.cells()) / placed);
}

} // namespace ob
