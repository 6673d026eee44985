// Charts placed on a grid one after the other, each at its lowest place.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "chart_pack_cells.h"
#include "chart_pack_grid.h"
#include "chart_pack_progress.h"

namespace ob {

struct ChartPlace {
  CellPlace at;
  int32_t turn = 0;
};

// How charts are placed: in which order, and what is called low of a place: the top of the chart, or its middle.
struct PlacingRule {
  std::vector<int32_t> order;
  bool by_middle = false;
};

struct Placing {
  std::vector<ChartPlace> places; // of all charts
  int32_t height = 0;             // rows used
  int64_t placed_cells = 0;       // of the charts that found a place
  bool complete = false;          // all did
  int64_t work = 0;
};

// What charts are placed on. rows: at most; gap: cells kept free between charts.
struct PlacingGround {
  int32_t width, rows, gap;
};

// Charts that are alike in size have likely the same lowest place, as all that is taken stays taken: classes of such.
class SizeClasses {
public:
  explicit SizeClasses(const CellShapes &shapes);

  int32_t count() const { return static_cast<int32_t>(smaller_.size()); }
  int32_t of(int64_t chart, int turn) const { return class_[static_cast<size_t>(kTurns * chart + turn)]; }
  // The classes that are a step narrower, lower, or both; -1 where there is none.
  const std::array<int32_t, 3> &smaller(int32_t size_class) const { return smaller_[static_cast<size_t>(size_class)]; }

private:
  std::vector<int32_t> class_;
  std::vector<std::array<int32_t, 3>> smaller_;
};

// Ends at the first chart without a place, and once cancelled.
Placing place_charts(const CellShapes &shapes, const SizeClasses &classes, const PlacingRule &rule,
                     PlacingGround ground, PackingProgress &progress);

} // namespace ob
