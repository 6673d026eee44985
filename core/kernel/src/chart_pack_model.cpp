#include "chart_pack_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ob {
namespace {

// What half a gap does not tell of the room a chart takes: the cells along its border that it does not fill.
constexpr double kBorder = 0.7;

} // namespace

RoomModel::RoomModel(const ChartOutlines &outlines) : count(static_cast<double>(outlines.filled())) {
  for (int64_t c = 0; c < outlines.count(); ++c) {
    const ChartOutline &chart = outlines[c];
    area += chart.area;
    girth += chart.girth;
    boxes += chart.width * chart.height;
  }
}

double RoomModel::taken(double scale, const PackingGrid &grid) const {
  const double border = grid.gap + kBorder;
  return (area * scale * scale + girth * border * scale + count * border * border) / grid.room();
}

double RoomModel::scale_for(double share, const PackingGrid &grid) const {
  const double border = grid.gap + kBorder;
  const double left = share * grid.room() - count * border * border;
  if (!(left > 0.0)) {
    return 0.0;
  }
  // The positive root, in the form that holds without an area, too.
  const double half = 0.5 * girth * border;
  return left / (half + std::sqrt(half * half + area * left));
}

double scale_of_single_charts(const ChartOutlines &outlines, const PackingGrid &grid) {
  const double width = grid.width - 2.0 * grid.margin;
  const double height = grid.height - 2.0 * grid.margin;
  double scale = std::numeric_limits<double>::infinity();
  for (int64_t c = 0; c < outlines.count(); ++c) {
    const ChartOutline &chart = outlines[c];
    scale = std::min(scale, std::max(std::min(width / chart.width, height / chart.height),
                                     std::min(width / chart.height, height / chart.width)));
  }
  return scale * kBelow;
}

} // namespace ob
