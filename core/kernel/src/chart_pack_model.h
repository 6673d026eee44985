// The grid of an image, and how much of it charts take.
#pragma once

#include <cstdint>

#include "chart_pack_outlines.h"

namespace ob {

// The shorter side of an image is across, so that its rows of bits are short; charts pile up along the longer one.
// gap: cells to keep free between charts; margin: see CellScale.
struct PackingGrid {
  int32_t width, height, gap;
  double margin;

  double cells() const { return static_cast<double>(width) * height; }
  // With what of the gaps may be outside.
  double room() const { return (static_cast<double>(width) + gap) * (static_cast<double>(height) + gap); }
};

// How much of a grid's room charts take at a scale, by sums over all of them: a chart with half of the gap about it,
// and of what whole cells cost, takes its area, its girth times that width, and that width's square.
struct RoomModel {
  double count = 0.0, area = 0.0, girth = 0.0;
  double boxes = 0.0; // area of the charts' boxes

  RoomModel() = default;
  explicit RoomModel(const ChartOutlines &outlines);

  // As a share of the room.
  double taken(double scale, const PackingGrid &grid) const;
  // The scale at which such a share is taken; 0 where more is at any scale.
  double scale_for(double share, const PackingGrid &grid) const;
  // How much of their boxes the charts fill: 1 for rectangles.
  double fullness() const { return boxes > 0.0 ? area / boxes : 1.0; }
};

constexpr double kBelow = 1.0 - 1e-12; // a factor of scales, that keeps rounding from one cell more

// The largest scale at which each chart alone fits; infinite for points.
double scale_of_single_charts(const ChartOutlines &outlines, const PackingGrid &grid);

} // namespace ob
