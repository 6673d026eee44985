// The charts at one scale, placed by one rule after the other.
#pragma once

#include <cstdint>
#include <vector>

#include "chart_pack_cells.h"
#include "chart_pack_model.h"
#include "chart_pack_place.h"
#include "chart_pack_progress.h"

namespace ob {

// A scale at which charts fit, and how.
struct ChartFit {
  double scale = 0.0; // cells a unit; 0: none was found
  Placing placing;
  PlacingRule rule; // by which the charts were placed

  bool found() const { return scale > 0.0; }
};

// What charts are placed by: threads, and who is told.
struct PackingEffort {
  int threads;
  PackingProgress &progress;
};

class ScaleTrial {
public:
  ScaleTrial(const ChartOutlines &outlines, const PackingGrid &grid, double scale, PackingEffort effort);

  // Places the charts by each of some rules, in up to so many rows. Returns how high each has come; would likely have
  // come, where the rows were too few. Of those that fit the lowest becomes `best`, if it is no higher than `highest`.
  std::vector<double> place(const std::vector<PlacingRule> &rules, int32_t rows, double highest, ChartFit &best);

  // At no smaller scale do they take less.
  bool is_one_cell_each() const { return shapes_.cells() <= charts_; }
  int64_t work() const { return work_; }

private:
  double height_of(const Placing &placing, int32_t rows) const;

  const PackingGrid &grid_;
  double scale_;
  PackingEffort effort_;
  CellShapes shapes_;
  SizeClasses classes_;
  int64_t charts_; // that have triangles
  int64_t work_ = 0;
};

} // namespace ob
